#include "filigree/fracture/fracture.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/random.h"
#include "filigree/mesh/normals.h"
#include "filigree/sample/edge_balance.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <numeric>
#include <unordered_map>

namespace filigree {

namespace {

constexpr double kSheetShare = 0.25;  ///< of closing area beside the mesh's: above, there is no inside worth the name
constexpr float kCreaseCosine = 0.8f; ///< 37 degrees
constexpr double kPlanarEdge = 1.0 / 6, kRoughEdge = 1.0 / 20; ///< of a piece's size

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Numbers for pairs of a vertex and something that it belongs to; the first owner of a vertex has the vertex's own.
class OwnedVertices {
public:
    explicit OwnedVertices(Index vertices) : owner_(vertices, kNoIndex), count_(vertices) {}

    Index number(Index vertex, Index owner) {
        if (owner_[vertex] == kNoIndex) owner_[vertex] = owner;
        if (owner_[vertex] == owner) return vertex;
        const auto [known, is_new] = others_.try_emplace(std::uint64_t(vertex) << 32 | owner, count_);
        if (is_new) ++count_;
        return known->second;
    }
    Index count() const { return count_; }

private:
    std::vector<Index> owner_;
    std::unordered_map<std::uint64_t, Index> others_;
    Index count_;
};

/// A triangle of one cell's closed surface.
struct CellTriangle {
    Triangle vertices; ///< of CutSurface::vertices
    Index cell;
    Index part = kNoIndex;                    ///< what hangs together in a cell
    Index uncut = kNoIndex, facet = kNoIndex; ///< one of CutSurface::triangles, or a facet
};

/// Everything that is in cells, facets from both sides.
std::vector<CellTriangle> cell_triangles(const CutSurface& cut, const CrackSurfaces& facets) {
    std::vector<CellTriangle> all;
    all.reserve(cut.triangles.size() + 2 * facets.triangles.size() + 2 * cut.polygons.size());
    std::size_t polygon = 0;
    for (Index k = 0; k < cut.triangles.size(); ++k) {
        if (cut.cell_of_triangle[k] != kNoIndex) {
            all.push_back({cut.triangles[k].vertices, cut.cell_of_triangle[k], kNoIndex, k, kNoIndex});
            continue;
        }
        for (; polygon < cut.polygons.size() && cut.polygons[polygon].triangle == k; ++polygon) {
            const CutPolygon& p = cut.polygons[polygon];
            const std::span<const Index> v(cut.polygon_vertices.data() + p.first, p.count);
            for (std::size_t c = 2; c < v.size(); ++c)
                if (v[0] != v[c - 1] && v[c - 1] != v[c] && v[c] != v[0])
                    all.push_back({{v[0], v[c - 1], v[c]}, p.cell, kNoIndex, k, kNoIndex});
        }
    }
    for (Index f = 0; f < facets.facets.size(); ++f) {
        const CrackSurface& facet = facets.facets[f];
        for (Index k = 0; k < facet.count; ++k) {
            const Triangle& t = facets.triangles[facet.first + k];
            all.push_back({t, facet.i, kNoIndex, kNoIndex, f});
            all.push_back({{t[0], t[2], t[1]}, facet.j, kNoIndex, kNoIndex, f});
        }
    }
    return all;
}

/// Parts of cells that hang together, and which of them become pieces.
class Parts {
public:
    Parts(const CutSurface& cut, std::vector<CellTriangle>& triangles, bool is_sheet) : is_sheet_(is_sheet) {
        find(cut, triangles);
        measure(cut, triangles);
    }

    std::size_t count() const { return size_.size(); }
    std::size_t islands() const { return islands_; }
    std::size_t joined() const { return joined_; }

    /// Parts too small, and shells around cavities, become one with others. Returns the piece of each part.
    std::vector<Index> pieces(double smallest) {
        DisjointSets sets(count());
        std::map<Index, Index> largest_of_cell;
        for (Index p = 0; p < count(); ++p) {
            Index& largest = largest_of_cell.try_emplace(cell_[p], p).first->second;
            if (size_[p] > size_[largest]) largest = p;
        }
        if (!is_sheet_)
            for (Index p = 0; p < count(); ++p)
                if (size_[p] <= 0 && sets.join(p, largest_of_cell[cell_[p]])) ++joined_;
        std::vector<double> size(count(), 0);
        double total = 0;
        for (Index p = 0; p < count(); ++p) {
            size[sets.root(p)] += size_[p];
            total += size_[p];
        }
        const double least = smallest * total / double(largest_of_cell.size());
        std::vector<std::map<Index, double>> shared(count());
        for (const auto& [pair, area] : shared_area_) {
            shared[sets.root(pair.first)][sets.root(pair.second)] += area;
            shared[sets.root(pair.second)][sets.root(pair.first)] += area;
        }
        std::vector<Index> order;
        for (Index p = 0; p < count(); ++p)
            if (sets.root(p) == p) order.push_back(p);
        std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return size[a] < size[b]; });
        for (const Index start : order) {
            const Index p = sets.root(start);
            if (size[p] >= least) continue;
            Index best = kNoIndex;
            double most = 0;
            for (const auto& [other, area] : shared[p]) {
                const Index root = sets.root(other);
                if (root != p && area > most) {
                    most = area;
                    best = root;
                }
            }
            if (best == kNoIndex) continue;
            sets.join(p, best);
            ++joined_;
            const Index root = sets.root(p), gone = root == p ? best : p;
            size[root] += size[gone];
            for (const auto& [other, area] : shared[gone]) shared[root][other] += area;
        }
        std::vector<Index> piece(count(), kNoIndex);
        Index pieces = 0;
        for (Index p = 0; p < count(); ++p)
            if (sets.root(p) == p) piece[p] = pieces++;
        for (Index p = 0; p < count(); ++p) piece[p] = piece[sets.root(p)];
        islands_ = pieces > largest_of_cell.size() ? pieces - largest_of_cell.size() : 0;
        return piece;
    }
    /// The same, where each cell is one piece.
    std::vector<Index> cell_numbers() {
        joined_ = count() - cells();
        islands_ = 0;
        return cell_;
    }
    std::size_t cells() const {
        std::vector<Index> cells = cell_;
        std::sort(cells.begin(), cells.end());
        return static_cast<std::size_t>(std::unique(cells.begin(), cells.end()) - cells.begin());
    }

private:
    void find(const CutSurface& cut, std::vector<CellTriangle>& triangles) {
        OwnedVertices owned(cut.vertices.count());
        for (const CellTriangle& t : triangles)
            for (const Index v : t.vertices) owned.number(v, t.cell);
        DisjointSets sets(owned.count());
        for (const CellTriangle& t : triangles) {
            const Index a = owned.number(t.vertices[0], t.cell);
            sets.join(a, owned.number(t.vertices[1], t.cell));
            sets.join(a, owned.number(t.vertices[2], t.cell));
        }
        std::vector<Index> part(owned.count(), kNoIndex);
        for (CellTriangle& t : triangles) {
            Index& of_root = part[sets.root(owned.number(t.vertices[0], t.cell))];
            if (of_root == kNoIndex) {
                of_root = static_cast<Index>(cell_.size());
                cell_.push_back(t.cell);
            }
            t.part = of_root;
        }
    }

    void measure(const CutSurface& cut, const std::vector<CellTriangle>& triangles) {
        size_.assign(cell_.size(), 0);
        const Vec3d middle = bounds(cut.vertices.positions()).centre();
        const CellTriangle* previous = nullptr;
        for (const CellTriangle& t : triangles) {
            const auto at = [&](std::size_t k) -> Vec3d {
                return cut.vertices.position(t.vertices[k]).cast<double>() - middle;
            };
            const Vec3d a = at(0), cross = (at(1) - a).cross(at(2) - a);
            const bool is_virtual = t.facet == kNoIndex && cut.triangles[t.uncut].source == kNoIndex;
            if (!is_sheet_)
                size_[t.part] += a.dot(cross) / 6;
            else if (t.facet == kNoIndex && !is_virtual)
                size_[t.part] += 0.5 * cross.norm();
            if (t.facet != kNoIndex && previous && previous->facet == t.facet && previous->cell != t.cell)
                shared_area_[std::minmax(previous->part, t.part)] +=
                    0.5 * cross.norm(); // the two sides follow each other
            previous = &t;
        }
    }

    bool is_sheet_;
    std::vector<Index> cell_;  ///< of each part
    std::vector<double> size_; ///< volume; of sheets, area
    std::map<std::pair<Index, Index>, double> shared_area_;
    std::size_t islands_ = 0, joined_ = 0;
};

/// Copies of an attribute's values at corners of the new mesh, interpolated where there was no corner.
template <class T>
class CornerCopier {
public:
    CornerCopier(const CornerAttribute<T>& from, CornerAttribute<T>& to) : from_(from), to_(to) {
        to_.values = from.values;
        to_.corners.clear();
    }
    /// A corner of the old mesh, whose vertex is `vertex`.
    void copy(Index corner, Index vertex) { to_.corners.push_back(value_at(corner, vertex)); }
    /// A place between corners (kNoIndex: none) of one face.
    void blend(const std::array<Index, 3>& corners, const std::array<Index, 3>& vertices,
               const std::array<double, 3>& weights) {
        T sum = T::Zero();
        for (std::size_t k = 0; k < 3; ++k) {
            if (corners[k] == kNoIndex) continue;
            const Index value = value_at(corners[k], vertices[k]);
            if (value == kNoIndex) return none();
            sum += static_cast<float>(weights[k]) * from_.values[value];
        }
        add(sum);
    }
    void add(const T& value) {
        to_.corners.push_back(static_cast<Index>(to_.values.size()));
        to_.values.push_back(value);
    }
    void none() { to_.corners.push_back(kNoIndex); }

private:
    Index value_at(Index corner, Index vertex) const {
        return from_.empty() ? kNoIndex : from_.per_vertex() ? vertex : from_.corners[corner];
    }
    const CornerAttribute<T>& from_;
    CornerAttribute<T>& to_;
};

/// Puts faces in the order of their pieces, which then follow each other in files; within a piece order stays.
void sort_by_piece(FracturedMesh& fractured) {
    Mesh& mesh = fractured.mesh;
    std::vector<Index> order(mesh.face_count());
    std::iota(order.begin(), order.end(), Index{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](Index a, Index b) { return fractured.piece_of_face[a] < fractured.piece_of_face[b]; });
    const auto sort_faces = [&](auto& values) {
        if (values.empty()) return;
        const auto before = values;
        for (std::size_t k = 0; k < order.size(); ++k) values[k] = before[order[k]];
    };
    const std::vector<Index> offsets = std::move(mesh.face_offsets);
    mesh.face_offsets = {0};
    for (const Index face : order)
        mesh.face_offsets.push_back(mesh.face_offsets.back() + offsets[face + 1] - offsets[face]);
    const auto sort_corners = [&](std::vector<Index>& values) {
        if (values.empty()) return;
        const std::vector<Index> before = values;
        std::size_t to = 0;
        for (const Index face : order)
            for (Index c = offsets[face]; c < offsets[face + 1]; ++c) values[to++] = before[c];
    };
    sort_corners(mesh.corners);
    sort_corners(mesh.uvs.corners);
    sort_corners(mesh.normals.corners);
    sort_faces(mesh.materials.of_face);
    sort_faces(mesh.smoothing);
    sort_faces(fractured.piece_of_face);
    sort_faces(fractured.is_inside);
    sort_faces(fractured.crack_of_face);
}

/// Puts pieces together from the cut's triangles.
class Assembly {
public:
    Assembly(const Mesh& mesh, const Surface& surface, const CutSurface& cut, const CrackSurfaces& facets,
             const FractureCells& cells, const RunContext& context)
        : mesh_(mesh), surface_(surface), cut_(cut), facets_(facets), cells_(cells), normals_(normals_of(context)),
          uv_(mesh.uvs, out_.mesh.uvs), normal_(normals_, out_.mesh.normals) {}

    FracturedMesh run(std::span<const CellTriangle> triangles, std::span<const Index> piece_of_part, bool is_sheet) {
        Mesh& out = out_.mesh;
        out.origin = mesh_.origin;
        out.positions = mesh_.positions;
        out.colors = mesh_.colors;
        out.colors_have_alpha = mesh_.colors_have_alpha;
        out.scalars = mesh_.scalars;
        out.material_files = mesh_.material_files;
        out.embedded_materials = mesh_.embedded_materials;
        out.materials.names = mesh_.materials.names;
        inside_material_ = static_cast<Index>(out.materials.names.size());
        out_.piece_of_vertex.assign(mesh_.vertex_count(), kNoIndex);
        out_.place.resize(mesh_.vertex_count());
        std::iota(out_.place.begin(), out_.place.end(), Index{0});
        for (const CrackSurface& facet : facets_.facets) out_.cells_of_crack.push_back({facet.i, facet.j});
        for (const Index piece : piece_of_part) out_.pieces = std::max(out_.pieces, piece + 1);

        std::size_t at = 0;
        while (at < triangles.size() && triangles[at].facet == kNoIndex) {
            const Index source = cut_.triangles[triangles[at].uncut].source;
            if (source == kNoIndex) {
                ++at;
                continue;
            }
            const Index face = surface_.source_face[source];
            std::size_t end = at;
            bool is_whole = true;
            const Index piece = piece_of_part[triangles[at].part];
            for (; end < triangles.size() && triangles[end].facet == kNoIndex; ++end) {
                const Index other = cut_.triangles[triangles[end].uncut].source;
                if (other == kNoIndex || surface_.source_face[other] != face) break;
                is_whole &= piece_of_part[triangles[end].part] == piece;
                for (const Index v : triangles[end].vertices) is_whole &= v < mesh_.vertex_count();
            }
            if (is_whole)
                add_face(face, piece);
            else
                for (; at < end; ++at)
                    add_surface_triangle(triangles[at].vertices, face, piece_of_part[triangles[at].part]);
            at = end;
        }
        if (!is_sheet)
            for (; at + 1 < triangles.size(); at += 2) {
                const CellTriangle &a = triangles[at], &b = triangles[at + 1];
                const Index piece = piece_of_part[a.part], other = piece_of_part[b.part];
                if (piece == other) continue;
                ++out_.report.inside_faces;
                add_inside_triangle(a, piece);
                add_inside_triangle(b, other);
            }
        finish();
        return std::move(out_);
    }

private:
    CornerAttribute<Vec3f> normals_of(const RunContext& context) const {
        if (!mesh_.normals.empty()) return mesh_.normals;
        // Smooth but where a face turns away from the smooth normal by more than kCreaseCosine: there the face's own.
        CornerAttribute<Vec3f> normals;
        normals.values = vertex_normals(surface_.triangles, mesh_.positions, context);
        for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
            const Vec3f of_face = doubled_area_vector(mesh_.positions, mesh_.face(f)).normalized().cast<float>();
            Index own = kNoIndex;
            for (const Index vertex : mesh_.face(f)) {
                const Index smooth = surface_.representative[vertex];
                if (normals.values[smooth].dot(of_face) >= kCreaseCosine) {
                    normals.corners.push_back(smooth);
                    continue;
                }
                if (own == kNoIndex) {
                    own = static_cast<Index>(normals.values.size());
                    normals.values.push_back(of_face);
                }
                normals.corners.push_back(own);
            }
        }
        return normals;
    }

    /// The vertex of the new mesh that stands for one of the cut's in a piece; `own`: the old mesh's vertex at its
    /// place that the face itself has.
    Index vertex_in(Index vertex, Index own, Index piece) {
        if (own != kNoIndex) {
            Index& owner = out_.piece_of_vertex[own];
            if (owner == kNoIndex) owner = piece;
            if (owner == piece) return own;
        }
        const auto [known, is_new] = copies_.try_emplace(std::uint64_t(own == kNoIndex ? vertex : own) << 32 | piece,
                                                         static_cast<Index>(out_.mesh.positions.size()));
        if (is_new) {
            out_.mesh.positions.push_back(cut_.vertices.position(vertex));
            out_.piece_of_vertex.push_back(piece);
            const FacePoint source = cut_.vertices.surface_point(vertex);
            out_.sources.push_back(source);
            out_.place.push_back(own == kNoIndex ? vertex : own);
            if (!out_.mesh.colors.empty()) out_.mesh.colors.push_back(color_at(source));
            for (std::size_t k = 0; k < out_.mesh.scalars.size(); ++k)
                out_.mesh.scalars[k].values.push_back(scalar_at(mesh_.scalars[k], source));
        }
        return known->second;
    }

    Vec4f color_at(const FacePoint& p) const {
        if (p.vertices[0] == kNoIndex) return Vec4f(0.75f, 0.75f, 0.75f, 1);
        Vec4f sum = Vec4f::Zero();
        for (std::size_t k = 0; k < 3; ++k)
            if (p.vertices[k] != kNoIndex) sum += static_cast<float>(p.weights[k]) * mesh_.colors[p.vertices[k]];
        return sum;
    }
    static float scalar_at(const VertexScalar& scalar, const FacePoint& p) {
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k)
            if (p.vertices[k] != kNoIndex) sum += p.weights[k] * double(scalar.values[p.vertices[k]]);
        return static_cast<float>(sum);
    }

    void label(Index old_face, Index piece, Index crack) {
        const bool is_inside = crack != kNoIndex;
        out_.crack_of_face.push_back(crack);
        out_.piece_of_face.push_back(piece);
        out_.is_inside.push_back(is_inside);
        const Index old_material = is_inside || mesh_.materials.empty() ? kNoIndex : mesh_.materials.of_face[old_face];
        out_.mesh.materials.of_face.push_back(is_inside ? inside_material_ : old_material);
        if (!mesh_.smoothing.empty()) out_.mesh.smoothing.push_back(is_inside ? 0 : mesh_.smoothing[old_face]);
    }

    void add_face(Index face, Index piece) {
        std::vector<Index> corners;
        for (Index c = mesh_.face_offsets[face]; c < mesh_.face_offsets[face + 1]; ++c) {
            const Index vertex = mesh_.corners[c];
            corners.push_back(vertex_in(surface_.representative[vertex], vertex, piece));
            uv_.copy(c, vertex);
            normal_.copy(c, vertex);
        }
        out_.mesh.add_face(corners);
        label(face, piece, kNoIndex);
    }

    /// The corner of an old face at a place.
    Index corner_at(Index face, Index representative) const {
        for (Index c = mesh_.face_offsets[face]; c < mesh_.face_offsets[face + 1]; ++c)
            if (surface_.representative[mesh_.corners[c]] == representative) return c;
        return kNoIndex;
    }

    void add_surface_triangle(const Triangle& triangle, Index face, Index piece) {
        std::array<Index, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            const FacePoint point = cut_.vertices.surface_point(triangle[k]);
            std::array<Index, 3> at = {kNoIndex, kNoIndex, kNoIndex}, own = at;
            for (std::size_t s = 0; s < 3; ++s)
                if (point.vertices[s] != kNoIndex && (at[s] = corner_at(face, point.vertices[s])) != kNoIndex)
                    own[s] = mesh_.corners[at[s]];
            const bool is_old = triangle[k] < mesh_.vertex_count();
            corners[k] = vertex_in(triangle[k], is_old ? own[0] : kNoIndex, piece);
            if (is_old && at[0] != kNoIndex) {
                uv_.copy(at[0], own[0]);
                normal_.copy(at[0], own[0]);
            } else {
                uv_.blend(at, own, point.weights);
                normal_.blend(at, own, point.weights);
            }
        }
        out_.mesh.add_face(corners);
        label(face, piece, kNoIndex);
    }

    void add_inside_triangle(const CellTriangle& triangle, Index piece) {
        const CrackSurface& facet = facets_.facets[triangle.facet];
        if (triangle.facet != frame_of_) {
            frame_of_ = triangle.facet;
            frame_ = facet_frame(cells_, facet.i, facet.j);
            inside_normals_ = facet_normals(facet);
        }
        std::array<Index, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            const Index vertex = triangle.vertices[k];
            corners[k] = vertex_in(vertex, vertex < mesh_.vertex_count() ? vertex : kNoIndex, piece);
            const Vec3d p = cells_.warp().unstretched(cut_.vertices.plane(vertex));
            uv_.add(Vec2f(static_cast<float>(p.dot(frame_.x)), static_cast<float>(p.dot(frame_.y))));
            const Vec3f normal = inside_normals_[vertex];
            normal_.add(triangle.cell == facet.i ? normal : Vec3f(-normal));
        }
        out_.mesh.add_face(corners);
        label(kNoIndex, piece, triangle.facet);
    }

    std::unordered_map<Index, Vec3f> facet_normals(const CrackSurface& facet) const {
        std::unordered_map<Index, Vec3f> normals;
        for (Index k = 0; k < facet.count; ++k) {
            const Triangle& t = facets_.triangles[facet.first + k];
            const Vec3f a = cut_.vertices.position(t[0]);
            const Vec3f cross = (cut_.vertices.position(t[1]) - a).cross(cut_.vertices.position(t[2]) - a);
            for (const Index v : t) normals.try_emplace(v, Vec3f::Zero()).first->second += cross;
        }
        for (auto& [vertex, normal] : normals) normal.stableNormalize();
        return normals;
    }

    void finish() {
        Mesh& out = out_.mesh;
        if (out_.report.inside_faces > 0) {
            out.materials.names.push_back("inside");
            if (out.embedded_materials.size() + 1 == out.materials.names.size())
                out.embedded_materials.emplace_back().name = "inside";
        } else if (mesh_.materials.empty()) {
            out.materials.of_face.clear();
        }
        sort_by_piece(out_);
        out.groups.of_face = out_.piece_of_face;
        for (Index p = 0; p < out_.pieces; ++p) out.groups.names.push_back("piece_" + std::to_string(p));
        out.objects = out.groups;
        VertexScalar piece{"piece", {}};
        for (const Index p : out_.piece_of_vertex)
            piece.values.push_back(p == kNoIndex ? -1.0f : static_cast<float>(p));
        out.scalars.push_back(std::move(piece));
    }

    const Mesh& mesh_;
    const Surface& surface_;
    const CutSurface& cut_;
    const CrackSurfaces& facets_;
    const FractureCells& cells_;
    FracturedMesh out_;
    CornerAttribute<Vec3f> normals_; ///< the unbroken mesh's
    std::unordered_map<std::uint64_t, Index> copies_;
    CornerCopier<Vec2f> uv_;
    CornerCopier<Vec3f> normal_;
    Index inside_material_ = 0;
    Index frame_of_ = kNoIndex;
    FacetFrame frame_;
    std::unordered_map<Index, Vec3f> inside_normals_;
};

/// How far a piece of average volume is across.
double piece_size(const CutSurface& cut, Index cells) {
    double volume = 0;
    const Vec3d middle = bounds(cut.vertices.positions()).centre();
    for (const UncutTriangle& t : cut.triangles) {
        const auto at = [&](std::size_t k) -> Vec3d {
            return cut.vertices.position(t.vertices[k]).cast<double>() - middle;
        };
        volume += at(0).dot(at(1).cross(at(2))) / 6;
    }
    const double thinnest = 1e-3 * std::pow(bounds(cut.vertices.positions()).diagonal(), 3);
    return std::cbrt(std::max(std::abs(volume), thinnest) / double(cells));
}

/// Edges at which a piece's triangles do not cancel.
std::size_t count_open_edges(const CutSurface& cut, std::span<const CellTriangle> triangles,
                             std::span<const Index> piece_of_part) {
    OwnedVertices owned(cut.vertices.count());
    std::vector<Triangle> named;
    named.reserve(triangles.size());
    for (const CellTriangle& t : triangles) {
        const Index piece = piece_of_part[t.part];
        named.push_back({owned.number(t.vertices[0], piece), owned.number(t.vertices[1], piece),
                         owned.number(t.vertices[2], piece)});
    }
    std::size_t open = 0;
    for_each_edge(owned.count(), named, [&](const EdgeBalance& edge) { open += edge.net != 0; });
    return open;
}

/// Signed volumes (areas of sheets) of pieces, and of the whole.
void report_sizes(const CutSurface& cut, std::span<const CellTriangle> triangles, std::span<const Index> piece_of_part,
                  Index pieces, CutReport& report) {
    const Vec3d middle = bounds(cut.vertices.positions()).centre();
    const auto doubled = [&](const Triangle& t, Vec3d& a) {
        const auto at = [&](std::size_t k) -> Vec3d { return cut.vertices.position(t[k]).cast<double>() - middle; };
        a = at(0);
        return Vec3d((at(1) - a).cross(at(2) - a));
    };
    std::vector<double> volume(pieces, 0), area(pieces, 0);
    Vec3d a;
    for (const CellTriangle& t : triangles) {
        const Vec3d cross = doubled(t.vertices, a);
        volume[piece_of_part[t.part]] += a.dot(cross) / 6;
        if (t.facet == kNoIndex && cut.triangles[t.uncut].source != kNoIndex)
            area[piece_of_part[t.part]] += 0.5 * cross.norm();
    }
    for (const UncutTriangle& t : cut.triangles) {
        const Vec3d cross = doubled(t.vertices, a);
        report.volume += a.dot(cross) / 6;
    }
    double sum = 0;
    for (const double v : volume) sum += v;
    if (!report.is_sheet && report.volume != 0) report.volume_error = std::abs(sum / report.volume - 1);
    std::vector<double>& size = report.is_sheet ? area : volume;
    for (double& v : size) v = std::abs(v);
    std::sort(size.begin(), size.end());
    if (size.empty()) return;
    report.smallest = size.front();
    report.median = size[size.size() / 2];
    report.largest = size.back();
}

} // namespace

Result<FracturedMesh> fracture(const Mesh& mesh, const FractureCells& cells, const FractureOptions& options,
                               const RunContext& context) {
    if (mesh.face_count() == 0)
        return Error{ErrorCode::unsuitable, "The mesh has no faces: there is nothing to break."};
    const Result<Surface> surface = make_surface(mesh, context);
    if (!surface) return surface.error();
    CutReport report;
    double start = now();
    const auto lap = [&start] {
        const double before = start;
        return (start = now()) - before;
    };
    Result<CutSurface> cut = cut_surface(mesh, *surface, cells, context);
    if (!cut) return cut.error();
    report.cut_seconds = lap();
    report.closing_triangles = cut->closing_triangles;
    report.is_sheet = cut->closing_area > kSheetShare * cut->area;

    const double edge =
        options.edge.value_or((cells.warp().is_rough() ? kRoughEdge : kPlanarEdge) * piece_size(*cut, cells.count()));
    const Result<CrackSurfaces> facets = report.is_sheet ? CrackSurfaces{} : crack_surfaces(*cut, cells, edge, context);
    if (!facets) return facets.error();
    report.facet_seconds = lap();
    report.facets = facets->facets.size();
    for (const CrackSurface& facet : facets->facets) report.fan_facets += facet.is_fan;
    context.report("putting pieces together", 0.8);

    std::vector<CellTriangle> triangles = cell_triangles(*cut, *facets);
    Parts parts(*cut, triangles, report.is_sheet);
    const std::vector<Index> piece_of_part =
        options.pieces_are_cells ? parts.cell_numbers() : parts.pieces(options.smallest);
    report.cells = parts.cells();
    report.islands = parts.islands();
    report.joined = parts.joined();
    FracturedMesh result =
        Assembly(mesh, *surface, *cut, *facets, cells, context).run(triangles, piece_of_part, report.is_sheet);
    report.inside_faces = result.report.inside_faces;
    report.assemble_seconds = lap();
    if (!report.is_sheet) report.open_edges = count_open_edges(*cut, triangles, piece_of_part);
    report_sizes(*cut, triangles, piece_of_part, result.pieces, report);
    result.report = report;
    if (context.is_cancelled()) return cancelled_error();
    return result;
}

void explode(FracturedMesh& fractured, double distance) {
    Mesh& mesh = fractured.mesh;
    const Vec3d middle = bounds(mesh.positions).centre();
    std::vector<Box> boxes(fractured.pieces);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        if (fractured.piece_of_vertex[v] != kNoIndex)
            boxes[fractured.piece_of_vertex[v]].extend(mesh.positions[v].cast<double>());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        if (const Index piece = fractured.piece_of_vertex[v]; piece != kNoIndex)
            mesh.positions[v] += (distance * (boxes[piece].centre() - middle)).cast<float>();
}

Mesh piece_mesh(const FracturedMesh& fractured, Index piece) {
    const Mesh& all = fractured.mesh;
    Mesh mesh;
    mesh.origin = all.origin;
    mesh.colors_have_alpha = all.colors_have_alpha;
    mesh.material_files = all.material_files;
    mesh.embedded_materials = all.embedded_materials;
    for (const VertexScalar& scalar : all.scalars) mesh.scalars.push_back({scalar.name, {}});
    std::vector<Index> renamed(all.vertex_count(), kNoIndex);
    for (std::size_t v = 0; v < all.vertex_count(); ++v) {
        if (fractured.piece_of_vertex[v] != piece) continue;
        renamed[v] = static_cast<Index>(mesh.positions.size());
        mesh.positions.push_back(all.positions[v]);
        if (!all.colors.empty()) mesh.colors.push_back(all.colors[v]);
        for (std::size_t k = 0; k < all.scalars.size(); ++k) mesh.scalars[k].values.push_back(all.scalars[k].values[v]);
    }
    const auto copy_corner = [](const auto& from, auto& to, Index corner) {
        if (from.empty()) return;
        const Index value = from.corners[corner];
        to.corners.push_back(value == kNoIndex ? kNoIndex : static_cast<Index>(to.values.size()));
        if (value != kNoIndex) to.values.push_back(from.values[value]);
    };
    mesh.materials.names = all.materials.names;
    for (std::size_t f = 0; f < all.face_count(); ++f) {
        if (fractured.piece_of_face[f] != piece) continue;
        std::vector<Index> corners;
        for (Index c = all.face_offsets[f]; c < all.face_offsets[f + 1]; ++c) {
            corners.push_back(renamed[all.corners[c]]);
            copy_corner(all.uvs, mesh.uvs, c);
            copy_corner(all.normals, mesh.normals, c);
        }
        mesh.add_face(corners);
        if (!all.materials.empty()) mesh.materials.of_face.push_back(all.materials.of_face[f]);
        if (!all.smoothing.empty()) mesh.smoothing.push_back(all.smoothing[f]);
    }
    return mesh;
}

} // namespace filigree
