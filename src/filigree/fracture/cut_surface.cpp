#include "filigree/fracture/cut_surface.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/hash.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/random.h"
#include "filigree/mesh/edges.h"

#include <algorithm>
#include <bit>
#include <map>

namespace filigree {

namespace {

constexpr double kEdgeOfWavelength = 0.35; ///< longest edges near rough cracks, of the finest bump
constexpr int kMostRefinements = 12;
/// Triangles after dividing are no more than so many times those before, and so many: long thin ones would be without
/// end.
constexpr std::size_t kMostGrowth = 3, kFewestRefined = 500'000;

using Name = std::array<Index, 4>;
struct NameHash {
    std::size_t operator()(const Name& name) const { return hash_words(name[0], name[1], name[2], name[3]); }
};

/// Cones over the open borders, each around the middle of a connected border.
void close_borders(CutSurface& cut, std::size_t mesh_vertices, const FractureCells& cells) {
    std::vector<Triangle> triangles(cut.triangles.size());
    for (std::size_t k = 0; k < triangles.size(); ++k) triangles[k] = cut.triangles[k].vertices;
    struct Open {
        Index from, to;
        int times;
    };
    std::vector<Open> open;
    for (const std::span<const Index> edge : edges_of(triangles, mesh_vertices)) {
        const int net = edge_balance(triangles, edge);
        const auto [low, high] = edge_ends(triangles, edge);
        if (net > 0) open.push_back({high, low, net}); // the cone runs the other way
        if (net < 0) open.push_back({low, high, -net});
    }
    if (open.empty()) return;
    DisjointSets borders(mesh_vertices);
    for (const Open& edge : open) borders.join(edge.from, edge.to);
    std::map<Index, std::pair<Vec3d, double>> middles; // sum and count
    for (const Open& edge : open) {
        auto& [sum, count] = middles.try_emplace(borders.root(edge.from), Vec3d::Zero(), 0.0).first->second;
        sum += cut.vertices.position(edge.from).cast<double>() + cut.vertices.position(edge.to).cast<double>();
        count += 2;
    }
    std::map<Index, Index> apex;
    for (const auto& [border, middle] : middles) {
        const Vec3d centre = middle.first / middle.second;
        apex[border] = cut.vertices.add_corner(centre.cast<float>(), cells.on_grid(centre), {});
    }
    for (const Open& edge : open)
        for (int k = 0; k < edge.times; ++k) {
            cut.triangles.push_back({{edge.from, edge.to, apex[borders.root(edge.from)]}, kNoIndex});
            ++cut.closing_triangles;
        }
}

/// The box, areas, and the volume.
void measure(CutSurface& cut) {
    for (const UncutTriangle& t : cut.triangles)
        for (const Index v : t.vertices) cut.box.extend(cut.vertices.position(v).cast<double>());
    const Vec3d middle = cut.box.centre();
    for (const UncutTriangle& t : cut.triangles) {
        const auto at = [&](std::size_t k) -> Vec3d {
            return cut.vertices.position(t.vertices[k]).cast<double>() - middle;
        };
        const Vec3d a = at(0), cross = (at(1) - a).cross(at(2) - a);
        (t.source == kNoIndex ? cut.closing_area : cut.area) += 0.5 * cross.norm();
        cut.volume += a.dot(cross) / 6;
    }
}

/// The middle of two points of a triangle.
FacePoint between(const FacePoint& a, const FacePoint& b, double t) {
    FacePoint middle;
    std::size_t used = 0;
    const auto add = [&](const FacePoint& p, double share) {
        for (std::size_t k = 0; k < 3; ++k) {
            if (p.vertices[k] == kNoIndex || p.weights[k] == 0) continue;
            std::size_t slot = 0;
            while (slot < used && middle.vertices[slot] != p.vertices[k]) ++slot;
            if (slot == used) middle.vertices[used++] = p.vertices[k];
            middle.weights[slot] += share * p.weights[k];
        }
    };
    add(a, 1 - t);
    add(b, t);
    return middle;
}

/// Divides edges that are long beside the bumps of the cracks near them, so that crack lines are rough on large
/// triangles too. Whether an edge is divided depends on the edge alone, so neighbours agree.
class CrackRefinement {
public:
    CrackRefinement(CutSurface& cut, const FractureCells& cells)
        : cut_(cut), cells_(cells), longest_(kEdgeOfWavelength * cells.warp().finest_wavelength()) {}

    void run() {
        const std::size_t most = kMostGrowth * cut_.triangles.size() + kFewestRefined;
        for (int round = 0; round < kMostRefinements; ++round) {
            std::vector<UncutTriangle> next;
            next.reserve(cut_.triangles.size());
            std::size_t divided = 0, closing = 0;
            for (const UncutTriangle& triangle : cut_.triangles) {
                const std::size_t before = next.size();
                divide(triangle, next);
                divided += next.size() - before - 1;
                if (triangle.source == kNoIndex) closing += next.size() - before;
            }
            if (divided == 0 || next.size() > most) return;
            cut_.triangles = std::move(next);
            cut_.closing_triangles = closing;
        }
    }

private:
    /// The vertex in the middle of an edge that has to be divided; kNoIndex for others.
    Index middle(Index a, Index b) {
        if (a > b) std::swap(a, b);
        const Vec3d p = cut_.vertices.position(a).cast<double>(), q = cut_.vertices.position(b).cast<double>();
        if ((q - p).squaredNorm() <= longest_ * longest_ || is_apex(a) || is_apex(b)) return kNoIndex;
        const auto [known, is_new] = middles_.try_emplace({a, b, 0, 0}, kNoIndex);
        if (!is_new || !is_near_crack(a, b)) return known->second;
        const Vec3d m = 0.5 * (p + q);
        const Index vertex =
            cut_.vertices.add_corner(m.cast<float>(), cells_.on_grid(m),
                                     between(cut_.vertices.surface_point(a), cut_.vertices.surface_point(b), 0.5));
        return middles_[{a, b, 0, 0}] = vertex;
    }

    /// Whether a vertex is the tip of a cone over an open border: cones are cut as they are.
    bool is_apex(Index vertex) const { return cut_.vertices.surface_point(vertex).vertices[0] == kNoIndex; }

    /// Whether a crack may come as near to the edge as the edge is long.
    bool is_near_crack(Index a, Index b) const {
        const GridPoint &p = cut_.vertices.grid(a), &q = cut_.vertices.grid(b);
        const Index cell = cells_.cell_at(p);
        const double reach = 1.5 * (to_double(q) - to_double(p)).norm();
        for (const CellFace& face : cells_.cell(cell)) {
            if (cells_.grid().is_ghost(face.neighbour)) continue;
            const double gradient = to_double(cells_.grid().gradient(cell, face.neighbour)).norm();
            if (double(cells_.grid().margin(cell, face.neighbour, p)) < reach * gradient) return true;
        }
        return false;
    }

    void divide(const UncutTriangle& triangle, std::vector<UncutTriangle>& into) {
        const auto& [a, b, c] = triangle.vertices;
        const std::array<Index, 3> middles = {middle(a, b), middle(b, c), middle(c, a)};
        const auto add = [&](Index u, Index v, Index w) { into.push_back({{u, v, w}, triangle.source}); };
        const std::ptrdiff_t count = 3 - std::count(middles.begin(), middles.end(), kNoIndex);
        if (count == 0) {
            into.push_back(triangle);
        } else if (count == 3) {
            add(a, middles[0], middles[2]);
            add(middles[0], b, middles[1]);
            add(middles[2], middles[1], c);
            add(middles[0], middles[1], middles[2]);
        } else {
            // Turned such that edge 0 is divided and edge 2 is not.
            std::size_t turn = 0;
            while (middles[turn] == kNoIndex || middles[(turn + 2) % 3] != kNoIndex) ++turn;
            const Index u = triangle.vertices[turn], v = triangle.vertices[(turn + 1) % 3],
                        w = triangle.vertices[(turn + 2) % 3];
            const Index uv = middles[turn], vw = middles[(turn + 1) % 3];
            add(u, uv, w);
            if (vw == kNoIndex) {
                add(uv, v, w);
            } else {
                add(uv, vw, w);
                add(uv, v, vw);
            }
        }
    }

    CutSurface& cut_;
    const FractureCells& cells_;
    double longest_;
    std::unordered_map<Name, Index, NameHash> middles_;
};

/// Divides one triangle among the cells that it touches, again and again.
class TriangleCutter {
public:
    TriangleCutter(CutSurface& cut, const FractureCells& cells) : cut_(cut), cells_(cells), seeds_(cells.grid()) {}

    void cut(Index triangle, const std::array<Index, 3>& labels) {
        triangle_ = triangle;
        corners_ = cut_.triangles[triangle].vertices;
        for (const Index corner : corners_) cut_.vertices.register_place(corner);
        waiting_.assign(labels.begin(), labels.end());
        done_.clear();
        while (!waiting_.empty()) {
            const Index cell = waiting_.back();
            waiting_.pop_back();
            if (std::find(done_.begin(), done_.end(), cell) != done_.end()) continue;
            done_.push_back(cell);
            if (clip_to(cell)) emit(cell);
        }
    }

private:
    /// A side of the polygon: a side of the triangle (-1 - edge), or the border against a cell.
    using Tag = std::int64_t;
    static bool is_edge(Tag tag) { return tag < 0; }
    static int edge_of(Tag tag) { return static_cast<int>(-1 - tag); }

    GridPoint margins(Index i, Index j) const {
        return {seeds_.margin(i, j, cut_.vertices.grid(corners_[0])),
                seeds_.margin(i, j, cut_.vertices.grid(corners_[1])),
                seeds_.margin(i, j, cut_.vertices.grid(corners_[2]))};
    }
    const GridPoint& known_margins(Tag cell) const {
        std::size_t k = 0;
        while (known_[k].first != static_cast<Index>(cell)) ++k;
        return known_[k].second;
    }
    /// Ends of an edge of the triangle, the lower vertex first, as corners.
    std::pair<std::size_t, std::size_t> ends(int edge) const {
        std::size_t a = static_cast<std::size_t>(edge), b = (a + 1) % 3;
        if (corners_[a] > corners_[b]) std::swap(a, b);
        return {a, b};
    }

    /// Sign of D_ik where the polygon's sides a and b meet, a before b.
    int sign_between(Tag a, Tag b, Index i, Index k, const GridPoint& d) const {
        if (is_edge(a) && is_edge(b)) return sign_at_vertex(d[static_cast<std::size_t>(edge_of(b))], i, k);
        if (is_edge(a) || is_edge(b)) {
            const auto [low, high] = ends(edge_of(is_edge(a) ? a : b));
            const Tag j = is_edge(a) ? b : a;
            const GridPoint& of_j = known_margins(j);
            return sign_on_edge(of_j[low], of_j[high], d[low], d[high], i, static_cast<Index>(j), k);
        }
        return sign_in_triangle(known_margins(a), known_margins(b), d, i, static_cast<Index>(a), static_cast<Index>(b),
                                k);
    }

    /// sides_ becomes the part of the triangle in the cell; false: there is none.
    bool clip_to(Index i) {
        sides_ = {-1, -2, -3};
        known_.clear();
        for (const CellFace& face : cells_.cell(i)) {
            const Index k = face.neighbour;
            if (seeds_.is_ghost(k)) continue;
            const GridPoint d = margins(i, k);
            if (d[0] > 0 && d[1] > 0 && d[2] > 0) continue;
            const std::size_t n = sides_.size();
            signs_.resize(n);
            bool has_inside = false, has_outside = false;
            for (std::size_t z = 0; z < n; ++z) {
                signs_[z] = sign_between(sides_[(z + n - 1) % n], sides_[z], i, k, d);
                (signs_[z] > 0 ? has_inside : has_outside) = true;
            }
            if (!has_outside) continue;
            if (!has_inside) return false;
            // Corner z lies before side z. The corners inside follow each other.
            std::size_t first = 0;
            while (!(signs_[first] > 0 && signs_[(first + n - 1) % n] < 0)) ++first;
            next_ = {sides_[(first + n - 1) % n]};
            for (std::size_t z = first; signs_[z] > 0; z = (z + 1) % n) next_.push_back(sides_[z]);
            next_.push_back(k);
            sides_.swap(next_);
            known_.emplace_back(k, d);
        }
        return true;
    }

    Index edge_vertex(int edge, Index i, Index j) {
        if (i > j) std::swap(i, j);
        const auto [low, high] = ends(edge);
        const Index a = corners_[low], b = corners_[high];
        const auto [known, is_new] = on_edges_.try_emplace({a, b, i, j}, kNoIndex);
        if (!is_new) return known->second;
        const double d0 = double(seeds_.margin(i, j, cut_.vertices.grid(a))),
                     d1 = double(seeds_.margin(i, j, cut_.vertices.grid(b)));
        const double t = d0 == d1 ? 0 : d0 / (d0 - d1);
        return known->second = t == 0 ? a : t == 1 ? b : vertex_between(a, b, t);
    }

    Index vertex_between(Index a, Index b, double t) {
        const CutVertices& v = cut_.vertices;
        const Vec3d p = v.position(a).cast<double>(), q = v.position(b).cast<double>();
        const Vec3f place = (p + t * (q - p)).cast<float>();
        return cut_.vertices.add(place, v.plane(a) + t * (v.plane(b) - v.plane(a)),
                                 between(v.surface_point(a), v.surface_point(b), t));
    }

    Index inner_vertex(std::array<Index, 3> cells) {
        std::sort(cells.begin(), cells.end());
        for (const LineCrossing& known : in_triangle_)
            if (known.cells == cells) return known.vertex;
        const GridPoint a = margins(cells[0], cells[1]), b = margins(cells[0], cells[2]);
        const Wide sum = cross_sum(a, b);
        const std::array<Wide, 3> of_corner = {Wide(a[1]) * b[2] - Wide(a[2]) * b[1],
                                               Wide(a[2]) * b[0] - Wide(a[0]) * b[2],
                                               Wide(a[0]) * b[1] - Wide(a[1]) * b[0]};
        std::array<double, 3> weights;
        for (std::size_t k = 0; k < 3; ++k) weights[k] = ratio(of_corner[k], sum);
        Index vertex = kNoIndex;
        for (std::size_t k = 0; k < 3 && vertex == kNoIndex; ++k) // on a corner or an edge: the same numbers as there
            if (of_corner[k] == 0) {
                std::size_t u = (k + 1) % 3, w = (k + 2) % 3;
                if (corners_[u] > corners_[w]) std::swap(u, w);
                vertex = of_corner[w] == 0   ? corners_[u]
                         : of_corner[u] == 0 ? corners_[w]
                                             : vertex_between(corners_[u], corners_[w], weights[w]);
            }
        if (vertex == kNoIndex) {
            Vec3d place = Vec3d::Zero(), plane = Vec3d::Zero();
            for (std::size_t k = 0; k < 3; ++k) {
                place += weights[k] * cut_.vertices.position(corners_[k]).cast<double>();
                plane += weights[k] * cut_.vertices.plane(corners_[k]);
            }
            const auto source = [&](std::size_t k) { return cut_.vertices.surface_point(corners_[k]); };
            const double rest = weights[1] + weights[2];
            vertex = cut_.vertices.add(place.cast<float>(), plane,
                                       between(source(0), between(source(1), source(2), weights[2] / rest), rest));
        }
        in_triangle_.push_back({cells, vertex, sign_of(sum)});
        cut_.crossings.push_back(in_triangle_.back());
        return vertex;
    }

    void emit(Index i) {
        if (in_triangle_of_ != triangle_) {
            in_triangle_.clear();
            in_triangle_of_ = triangle_;
        }
        const std::size_t n = sides_.size();
        const Index first = static_cast<Index>(cut_.polygon_vertices.size());
        for (std::size_t z = 0; z < n; ++z) {
            const Tag a = sides_[(z + n - 1) % n], b = sides_[z];
            Index vertex;
            if (is_edge(a) && is_edge(b))
                vertex = corners_[static_cast<std::size_t>(edge_of(b))];
            else if (is_edge(a))
                vertex = edge_vertex(edge_of(a), i, static_cast<Index>(b));
            else if (is_edge(b))
                vertex = edge_vertex(edge_of(b), i, static_cast<Index>(a));
            else
                vertex = inner_vertex({i, static_cast<Index>(a), static_cast<Index>(b)});
            cut_.polygon_vertices.push_back(vertex);
        }
        cut_.polygons.push_back({i, triangle_, first, static_cast<Index>(n)});
        for (std::size_t z = 0; z < n; ++z) {
            if (is_edge(sides_[z])) continue;
            const Index j = static_cast<Index>(sides_[z]);
            waiting_.push_back(j);
            const Index from = cut_.polygon_vertices[first + z], to = cut_.polygon_vertices[first + (z + 1) % n];
            if (i < j && from != to) cut_.segments.push_back({i, j, from, to});
        }
    }

    CutSurface& cut_;
    const FractureCells& cells_;
    const GridSeeds& seeds_;
    Index triangle_ = 0, in_triangle_of_ = kNoIndex;
    Triangle corners_{};
    std::vector<Index> waiting_, done_;
    std::vector<Tag> sides_, next_;
    std::vector<int> signs_;
    std::vector<std::pair<Index, GridPoint>> known_; ///< D at the corners, of cells that are sides
    std::vector<LineCrossing> in_triangle_;
    std::unordered_map<Name, Index, NameHash> on_edges_;
};

} // namespace

CutVertices::CutVertices(std::span<const Vec3f> mesh_positions, std::vector<GridPoint> grid)
    : mesh_count_(static_cast<Index>(mesh_positions.size())), positions_(mesh_positions.begin(), mesh_positions.end()),
      grid_(std::move(grid)) {}

std::size_t CutVertices::PlaceHash::operator()(const std::array<std::uint32_t, 3>& key) const {
    return random_bits(std::uint64_t(key[0]) << 32 | key[1], key[2]);
}

std::array<std::uint32_t, 3> CutVertices::key_of(const Vec3f& p) {
    std::array<std::uint32_t, 3> key;
    for (int axis = 0; axis < 3; ++axis)
        key[static_cast<std::size_t>(axis)] = std::bit_cast<std::uint32_t>(p[axis] + 0.0f);
    return key;
}

FacePoint CutVertices::surface_point(Index vertex) const {
    if (vertex >= mesh_count_) return source(vertex);
    return {{vertex, kNoIndex, kNoIndex}, {1, 0, 0}};
}

Index CutVertices::add_corner(const Vec3f& position, const GridPoint& grid, const FacePoint& source) {
    positions_.push_back(position);
    grid_.push_back(grid);
    sources_.push_back(source);
    return count() - 1;
}

Index CutVertices::add(const Vec3f& position, const Vec3d& plane, const FacePoint& source) {
    const auto [known, is_new] = places_.try_emplace(key_of(position), count());
    if (is_new) {
        positions_.push_back(position);
        planes_.push_back(plane);
        sources_.push_back(source);
    }
    return known->second;
}

Result<CutSurface> cut_surface(const Mesh& mesh, const Surface& surface, const FractureCells& cells,
                               const RunContext& context) {
    constexpr std::size_t kGrain = 4096;
    std::vector<GridPoint> grid(mesh.vertex_count());
    parallel_for(context, grid.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            if (surface.representative[v] == v) grid[v] = cells.on_grid(mesh.positions[v].cast<double>());
    });
    CutSurface cut(CutVertices(mesh.positions, std::move(grid)));
    cut.triangles.reserve(surface.triangles.size());
    for (std::size_t k = 0; k < surface.triangles.size(); ++k)
        cut.triangles.push_back({surface.triangles[k], static_cast<Index>(k)});
    close_borders(cut, mesh.vertex_count(), cells);
    if (context.is_cancelled()) return cancelled_error();
    if (cells.warp().is_rough()) CrackRefinement(cut, cells).run();
    measure(cut);

    std::vector<Index> label(cut.vertices.count());
    parallel_for(context, label.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        Index near = kNoIndex;
        for (std::size_t v = begin; v < end; ++v)
            label[v] = near = cells.cell_at(cut.vertices.grid(static_cast<Index>(v)), near);
    });
    context.report("cutting", 0.2);

    cut.cell_of_triangle.resize(cut.triangles.size());
    TriangleCutter cutter(cut, cells);
    for (std::size_t k = 0; k < cut.triangles.size(); ++k) {
        const Triangle& t = cut.triangles[k].vertices;
        const std::array<Index, 3> labels = {label[t[0]], label[t[1]], label[t[2]]};
        const bool is_whole = labels[0] == labels[1] && labels[1] == labels[2];
        cut.cell_of_triangle[k] = is_whole ? labels[0] : kNoIndex;
        if (!is_whole) cutter.cut(static_cast<Index>(k), labels);
        if (k % 65536 == 0 && context.is_cancelled()) return cancelled_error();
    }
    return cut;
}

} // namespace filigree
