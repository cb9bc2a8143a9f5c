#include "filigree/fracture/broken_model.h"
#include "filigree/blend/blend_code.h"
#include "filigree/fracture.h"

#include "filigree/fracture/crack_surfaces.h"
#include "filigree/fracture/planar_fill.h"
#include "filigree/mesh/closest_point.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

namespace filigree {

namespace {

constexpr double kFinestSpacing = 0.05; ///< of that asked for, on cracks too small for three points

/// Some of the points, none closer to another than `spacing`; the first is always among them.
std::vector<Index> thin(std::span<const Vec3d> points, double spacing) {
    std::unordered_map<std::uint64_t, std::vector<Index>> kept_in; // boxes of a spacing's side
    const auto box = [&](const Vec3d& p, int x, int y, int z) {
        std::uint64_t key = 0;
        for (const auto& [axis, step] : {std::pair(0, x), std::pair(1, y), std::pair(2, z)})
            key = key << 21 |
                  (static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(p[axis] / spacing)) + step) &
                   0x1fffff);
        return key;
    };
    std::vector<Index> kept;
    for (Index k = 0; k < points.size(); ++k) {
        bool is_free = true;
        for (int n = 0; n < 27 && is_free; ++n) {
            const auto found = kept_in.find(box(points[k], n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
            if (found == kept_in.end()) continue;
            for (const Index other : found->second)
                is_free &= (points[other] - points[k]).squaredNorm() >= spacing * spacing;
        }
        if (!is_free) continue;
        kept_in[box(points[k], 0, 0, 0)].push_back(k);
        kept.push_back(k);
    }
    return kept;
}

constexpr std::uint64_t kOnCrack = std::uint64_t(1) << 32; ///< in a driver vertex's place: not of the unbroken driver

/// The driver's copies and cells as they are asked for.
class DriverCopies {
public:
    explicit DriverCopies(Mesh& mesh) : mesh_(mesh) {}

    /// A driver vertex at a place for a piece; `own`: the mesh's vertex there that is of the piece (kNoIndex: a loose
    /// one is made). place: any number that tells places apart.
    Index vertex(std::uint64_t place, Index piece, Index own, const Vec3f& position) {
        const auto [known, is_new] = numbers_.try_emplace({place, piece}, static_cast<Index>(vertices_.size()));
        if (is_new) {
            if (own == kNoIndex) {
                own = static_cast<Index>(mesh_.positions.size());
                mesh_.positions.push_back(position);
                if (!mesh_.colors.empty()) mesh_.colors.push_back(Vec4f::Ones());
                for (VertexScalar& scalar : mesh_.scalars) scalar.values.push_back(0);
            }
            vertices_.push_back({own, piece, (place & kOnCrack) != 0});
        }
        return known->second;
    }
    Index cell(const Triangle& corners) {
        const auto [known, is_new] = cells_of_.try_emplace(corners, static_cast<Index>(cells_.size()));
        if (is_new) cells_.push_back(corners);
        return known->second;
    }

    struct Vertex {
        Index mesh_vertex, piece;
        bool is_on_crack;
    };
    const std::vector<Vertex>& vertices() const { return vertices_; }
    const std::vector<Triangle>& cells() const { return cells_; }

private:
    Mesh& mesh_;
    std::map<std::pair<std::uint64_t, Index>, Index> numbers_;
    std::vector<Vertex> vertices_;
    std::map<Triangle, Index> cells_of_;
    std::vector<Triangle> cells_; ///< of numbers in vertices_
};

/// A vertex's bond to places, the same in every piece.
struct PlaceBond {
    std::array<Index, 3> places; ///< indices of crack points
    float u, v;                  ///< weights of the second and the third
    double distance;             ///< of the vertex from where it hangs, model units
};

class ModelBreaker {
public:
    ModelBreaker(const Model& model, const FracturedMesh& fractured, const FractureCells& cells, double spacing)
        : model_(model), detail_(model.detail), fractured_(fractured), cells_(cells), spacing_(spacing) {
        broken_.model.mesh = fractured.mesh;
    }

    BrokenModel run() {
        DriverCopies copies(broken_.model.mesh);
        copies_ = &copies;
        const std::size_t count = fractured_.mesh.vertex_count(), old = model_.mesh.vertex_count();
        bonds_.resize(count);
        find_old_bonds();
        for (Index v = 0; v < old; ++v) hang_old(v);
        for (Index v = static_cast<Index>(old); v < count; ++v)
            if (fractured_.sources[v - old].vertices[0] != kNoIndex) hang_on_surface(v);
        hang_inside();
        return finish();
    }

private:
    void find_old_bonds() {
        old_bonds_.resize(model_.mesh.vertex_count());
        for (Index cell = 0; cell + 1 < detail_.cell_offsets.size(); ++cell)
            for (Index r = detail_.cell_offsets[cell]; r < detail_.cell_offsets[cell + 1]; ++r)
                old_bonds_[detail_.order[r]] = {cell, detail_.u[r], detail_.v[r]};
    }

    Index piece_of(Index vertex) const {
        const Index piece = fractured_.piece_of_vertex[vertex];
        if (piece != kNoIndex) return piece;
        return cells_.piece_at(model_.mesh.positions[vertex].cast<double>()); // a loose vertex of the mesh
    }

    /// The unbroken driver's cell, of a piece's copies.
    Index surface_cell(Index cell, Index piece) {
        Triangle corners;
        for (std::size_t k = 0; k < 3; ++k) {
            const Index vertex = model_.driver().vertices[detail_.cells[cell][k]];
            const Index own = piece_of(vertex) == piece ? vertex : kNoIndex;
            corners[k] = copies_->vertex(vertex, piece, own, model_.mesh.positions[vertex]);
        }
        return copies_->cell(corners);
    }

    void hang_old(Index vertex) {
        bonds_[vertex] = old_bonds_[vertex];
        bonds_[vertex].cell = surface_cell(old_bonds_[vertex].cell, piece_of(vertex));
    }

    void hang_on_surface(Index vertex) {
        const FacePoint& source = fractured_.sources[vertex - model_.mesh.vertex_count()];
        Index first = source.vertices[0];
        for (const Index other : source.vertices)
            if (other != kNoIndex) first = std::min(first, other);
        const Index cell = old_bonds_[first].cell;
        const auto corner = [&](std::size_t k) -> const Vec3f& {
            return model_.mesh.positions[model_.driver().vertices[detail_.cells[cell][k]]];
        };
        const SurfacePoint hook =
            closest_point_on_triangle(fractured_.mesh.positions[vertex], corner(0), corner(1), corner(2));
        bonds_[vertex] = {surface_cell(cell, fractured_.piece_of_vertex[vertex]), hook.barycentric[1],
                          hook.barycentric[2]};
    }

    bool is_inside(Index vertex) const {
        return vertex >= model_.mesh.vertex_count() &&
               fractured_.sources[vertex - model_.mesh.vertex_count()].vertices[0] == kNoIndex;
    }

    void hang_inside() {
        // The places of each crack, those on the surface too, and the pieces that meet at each place inside.
        std::vector<std::vector<Index>> vertices_of_crack(fractured_.cells_of_crack.size()); // of its first cell
        std::unordered_map<Index, std::vector<Index>> copies_at;                             // of a place inside
        for (std::size_t f = 0; f < fractured_.mesh.face_count(); ++f) {
            const Index crack = fractured_.crack_of_face[f];
            if (crack == kNoIndex ||
                fractured_.piece_of_face[f] != cells_.piece_of(fractured_.cells_of_crack[crack][0]))
                continue;
            for (const Index v : fractured_.mesh.face(f)) vertices_of_crack[crack].push_back(v);
        }
        for (Index v = 0; v < fractured_.mesh.vertex_count(); ++v)
            if (is_inside(v)) copies_at[fractured_.place[v]].push_back(v);

        // Lines on which three and more pieces meet first: they are of several cracks.
        std::map<std::vector<Index>, std::vector<Index>> lines; // pieces, and places
        for (const auto& [place, copies] : copies_at) {
            if (copies.size() < 3) continue;
            std::vector<Index> pieces;
            for (const Index v : copies) pieces.push_back(fractured_.piece_of_vertex[v]);
            std::sort(pieces.begin(), pieces.end());
            lines[pieces].push_back(place);
        }
        std::unordered_map<Index, PlaceBond> bond_at;
        for (auto& [pieces, places] : lines) {
            std::sort(places.begin(), places.end());
            const std::vector<Index> drivers = thinned(places, copies_at);
            for (const Index place : places) bond_at[place] = hang_on_line(place, drivers, copies_at);
        }
        for (std::size_t crack = 0; crack < vertices_of_crack.size(); ++crack)
            hang_crack(crack, vertices_of_crack[crack], copies_at, bond_at);

        for (const auto& [place, copies] : copies_at) {
            const auto found = bond_at.find(place);
            if (found != bond_at.end())
                for (const Index v : copies) bonds_of_places_.emplace_back(v, found->second);
        }
        std::sort(bonds_of_places_.begin(), bonds_of_places_.end(),
                  [](const auto& a, const auto& b) { return a.first < b.first; });
        for (const auto& [vertex, bond] : bonds_of_places_) {
            const Index piece = fractured_.piece_of_vertex[vertex];
            Triangle corners;
            for (std::size_t k = 0; k < 3; ++k)
                corners[k] = copies_->vertex(kOnCrack | bond.places[k], piece, kNoIndex, position_at(bond.places[k]));
            bonds_[vertex] = {copies_->cell(corners), bond.u, bond.v};
        }
        // What no crack holds any more (a face that rounding took away) hangs on the surface.
        for (Index v = static_cast<Index>(model_.mesh.vertex_count()); v < bonds_.size(); ++v)
            if (bonds_[v].cell == kNoIndex) bonds_[v] = {surface_cell(0, fractured_.piece_of_vertex[v]), 0, 0};
    }

    using CopiesAt = std::unordered_map<Index, std::vector<Index>>;

    const Vec3f& position_at(Index place) const { return position_of_.at(place); }

    std::vector<Index> thinned(std::span<const Index> places, const CopiesAt& copies_at) {
        std::vector<Vec3d> points;
        for (const Index place : places) {
            const Vec3f& p = fractured_.mesh.positions[copies_at.at(place).front()];
            points.push_back(p.cast<double>());
            position_of_[place] = p;
        }
        std::vector<Index> drivers;
        for (double spacing = spacing_; drivers.size() < 2 && spacing > kFinestSpacing * spacing_; spacing /= 2) {
            drivers.clear();
            for (const Index k : thin(points, spacing)) drivers.push_back(places[k]);
        }
        return drivers;
    }

    static PlaceBond hung(const Triangle& places, const SurfacePoint& hook) {
        return {places, hook.barycentric[1], hook.barycentric[2], hook.distance};
    }

    PlaceBond hang_on_line(Index place, std::span<const Index> drivers, const CopiesAt& copies_at) const {
        const Vec3f& p = fractured_.mesh.positions[copies_at.at(place).front()];
        std::array<std::pair<float, Index>, 2> nearest;
        nearest.fill({std::numeric_limits<float>::infinity(), drivers[0]});
        for (const Index driver : drivers) {
            const std::pair<float, Index> entry = {(position_at(driver) - p).squaredNorm(), driver};
            if (entry < nearest[0]) {
                nearest[1] = nearest[0];
                nearest[0] = entry;
            } else if (entry < nearest[1]) {
                nearest[1] = entry;
            }
        }
        const Index a = nearest[0].second, b = nearest[1].second;
        return hung({a, b, b}, closest_point_on_triangle(p, position_at(a), position_at(b), position_at(b)));
    }

    void hang_crack(std::size_t crack, std::vector<Index>& vertices, const CopiesAt& copies_at,
                    std::unordered_map<Index, PlaceBond>& bond_at) {
        std::sort(vertices.begin(), vertices.end());
        vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
        if (vertices.empty()) return;
        // Points on lines that are drivers already come first, so that they stay.
        std::stable_partition(vertices.begin(), vertices.end(), [&](Index v) {
            const auto found = bond_at.find(fractured_.place[v]);
            return found != bond_at.end() && found->second.places[0] == fractured_.place[v];
        });
        const auto& [i, j] = fractured_.cells_of_crack[crack];
        const FacetFrame frame = facet_frame(cells_, i, j);
        std::vector<Vec3d> points;
        for (const Index v : vertices) points.push_back(fractured_.mesh.positions[v].cast<double>());
        std::vector<Index> drivers;
        std::vector<Vec2d> flat;
        std::vector<Triangle> triangles;
        for (double spacing = spacing_; triangles.empty() && spacing > kFinestSpacing * spacing_; spacing /= 2) {
            drivers.clear();
            flat.clear();
            for (const Index k : thin(points, spacing)) {
                drivers.push_back(fractured_.place[vertices[k]]);
                position_of_[drivers.back()] = fractured_.mesh.positions[vertices[k]];
                flat.emplace_back(points[k].dot(frame.x), points[k].dot(frame.y));
            }
            triangles = delaunay_triangles(flat);
        }
        for (std::size_t k = 0; k < vertices.size(); ++k) {
            const Index place = fractured_.place[vertices[k]];
            if (!is_inside(vertices[k]) || copies_at.at(place).size() != 2) continue;
            // Beside points that are almost on a line there may be no triangle near.
            PlaceBond best = hang_on_line(place, drivers, copies_at);
            const auto in_plane = [](const Vec2d& p) { return Vec3f(float(p[0]), float(p[1]), 0); };
            const Vec3f p = in_plane({points[k].dot(frame.x), points[k].dot(frame.y)});
            for (const Triangle& t : triangles) {
                const SurfacePoint hook =
                    closest_point_on_triangle(p, in_plane(flat[t[0]]), in_plane(flat[t[1]]), in_plane(flat[t[2]]));
                if (hook.distance <= best.distance) best = hung({drivers[t[0]], drivers[t[1]], drivers[t[2]]}, hook);
                if (hook.distance == 0) break;
            }
            bond_at[place] = best;
        }
    }

    BrokenModel finish() {
        // The driver's vertices in the order of the mesh's.
        const auto& vertices = copies_->vertices();
        std::vector<Index> order(vertices.size()), number(vertices.size());
        for (Index k = 0; k < order.size(); ++k) order[k] = k;
        std::sort(order.begin(), order.end(),
                  [&](Index a, Index b) { return vertices[a].mesh_vertex < vertices[b].mesh_vertex; });
        Level driver;
        for (Index k = 0; k < order.size(); ++k) {
            number[order[k]] = k;
            driver.vertices.push_back(vertices[order[k]].mesh_vertex);
            broken_.piece_of_driver.push_back(vertices[order[k]].piece);
            broken_.driver_is_on_crack.push_back(vertices[order[k]].is_on_crack);
        }
        std::vector<Triangle> cells;
        bonds_.resize(broken_.model.mesh.vertex_count()); // loose vertices
        for (const Triangle& cell : copies_->cells()) {
            const Triangle named = {number[cell[0]], number[cell[1]], number[cell[2]]};
            for (std::size_t k = 0; k < 3; ++k) {
                Bond& own = bonds_[driver.vertices[named[k]]];
                if (own.cell == kNoIndex)
                    own = {static_cast<Index>(cells.size()), k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f};
            }
            if (named[0] != named[1] && named[1] != named[2] && named[2] != named[0]) {
                driver.corners.insert(driver.corners.end(), named.begin(), named.end());
                driver.face_offsets.push_back(static_cast<Index>(driver.corners.size()));
            }
            cells.push_back(named);
        }
        broken_.model.levels = {driver};
        broken_.model.detail = encode_blend(std::move(cells), {std::move(bonds_), {}, {}});
        return std::move(broken_);
    }

    const Model& model_;
    const BlendDetail& detail_;
    const FracturedMesh& fractured_;
    const FractureCells& cells_;
    double spacing_;
    BrokenModel broken_;
    DriverCopies* copies_ = nullptr;
    std::vector<Bond> old_bonds_, bonds_; ///< of the unbroken mesh's vertices in its own cells; of the new mesh's
    std::unordered_map<Index, Vec3f> position_of_;
    std::vector<std::pair<Index, PlaceBond>> bonds_of_places_;
};

} // namespace

Result<BrokenModel> break_model(const Model& model, const FracturedMesh& fractured, const FractureCells& cells,
                                double crack_spacing, const RunContext& context) {
    if (fractured.mesh.vertex_count() < model.mesh.vertex_count() ||
        !std::equal(model.mesh.positions.begin(), model.mesh.positions.end(), fractured.mesh.positions.begin()))
        return Error{ErrorCode::unsuitable, "The pieces are those of another mesh than the model's."};
    if (!(crack_spacing > 0))
        return Error{ErrorCode::usage, "The spacing of the driver's points on cracks is above 0."};
    BrokenModel broken = ModelBreaker(model, fractured, cells, crack_spacing).run();
    if (context.is_cancelled()) return cancelled_error();
    return broken;
}

std::vector<std::uint8_t> open_cracks(const Model& broken, std::span<const Index> piece_of_driver,
                                      std::span<const std::uint8_t> driver_is_on_crack,
                                      std::span<const std::array<Index, 2>> pieces_of_crack,
                                      std::span<const Pose> frames, double apart) {
    const std::vector<Vec3f> rest = driver_positions(broken);
    std::map<std::array<float, 3>, std::vector<Index>> copies; // at one place
    for (Index d = 0; d < rest.size(); ++d)
        if (driver_is_on_crack[d]) copies[{rest[d][0], rest[d][1], rest[d][2]}].push_back(d);
    std::map<std::array<Index, 2>, std::vector<std::array<Index, 2>>> pairs; // of two pieces
    for (const auto& [place, at] : copies)
        for (const Index a : at)
            for (const Index b : at)
                if (piece_of_driver[a] < piece_of_driver[b])
                    pairs[{piece_of_driver[a], piece_of_driver[b]}].push_back({a, b});
    std::vector<std::uint8_t> is_open;
    for (const std::array<Index, 2>& pieces : pieces_of_crack) {
        const auto found = pairs.find(pieces);
        const bool opened =
            found == pairs.end() || std::any_of(frames.begin(), frames.end(), [&](const Pose& pose) {
                return std::any_of(found->second.begin(), found->second.end(), [&](const std::array<Index, 2>& pair) {
                    return (pose.positions[pair[0]] - pose.positions[pair[1]]).norm() > static_cast<float>(apart);
                });
            });
        is_open.push_back(opened);
    }
    return is_open;
}

void drop_closed_cracks(Mesh& mesh, std::span<const Index> crack_of_face, std::span<const std::uint8_t> is_open) {
    const Mesh before = mesh;
    const auto keeps = [&](std::size_t f) { return crack_of_face[f] == kNoIndex || is_open[crack_of_face[f]]; };
    mesh.face_offsets = {0};
    mesh.corners.clear();
    const auto keep_corners = [&](const std::vector<Index>& from, std::vector<Index>& to) {
        to.clear();
        for (std::size_t f = 0; f < before.face_count(); ++f)
            if (keeps(f) && !from.empty())
                to.insert(to.end(), from.begin() + before.face_offsets[f], from.begin() + before.face_offsets[f + 1]);
    };
    const auto keep_faces = [&](const auto& from, auto& to) {
        to.clear();
        for (std::size_t f = 0; f < before.face_count(); ++f)
            if (keeps(f) && !from.empty()) to.push_back(from[f]);
    };
    for (std::size_t f = 0; f < before.face_count(); ++f)
        if (keeps(f)) mesh.add_face(before.face(f));
    keep_corners(before.uvs.corners, mesh.uvs.corners);
    keep_corners(before.normals.corners, mesh.normals.corners);
    keep_faces(before.objects.of_face, mesh.objects.of_face);
    keep_faces(before.groups.of_face, mesh.groups.of_face);
    keep_faces(before.materials.of_face, mesh.materials.of_face);
    keep_faces(before.smoothing, mesh.smoothing);
}

} // namespace filigree
