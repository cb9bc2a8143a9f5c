#include "filigree/remesh/transfer_attributes.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/edges.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <unordered_set>

namespace filigree {
namespace {

constexpr std::size_t kTransferAttributesGrain = 1024;
constexpr float kSameUv = 1e-5f;         // a sixth of a pixel of 16,384
constexpr float kSameNormal = 1e-2f;     // half a degree: as files of few digits round
constexpr double kTransferReach = 1.25;  // of the distance from a face's centre to its corners: what is searched
constexpr double kEdgeOn = 0.1;          // cosine, below which a triangle is not under a face but beside it
constexpr std::size_t kMostUnder = 4096; // triangles looked at under one face
constexpr double kMostSeamCells = 1e5;   // that seams are long: the grid grows coarser instead
constexpr double kSameSide = 0.25;       // of a face's extent: values at a vertex that belong to one side of a seam
constexpr double kFlatDirection = 1e-6;  // of the largest variance: directions that a gradient knows nothing about
constexpr double kOnTheSeam = 1e-6;      // of the radius: too close to the side to be continued

Vec3d to_double(const Vec3f& p) { return p.cast<double>(); }

/// `from` as triangles over corners, with what lies beyond their edges: vertices at one position count as one.
struct InputSurface {
    const Mesh& mesh;
    std::vector<Triangle> corners; ///< of each triangle
    PolygonCorners polygons;
    /// Half-edge 3 t + i runs from corner i of triangle t to the next. The next half-edge between the same positions
    /// (the other one, where there are two); kNoIndex on borders.
    std::vector<Index> beyond;
    std::vector<Index> place; ///< of each vertex

    InputSurface(const Mesh& from, const Triangulation& cut)
        : mesh(from), polygons(from.face_offsets), place(weld_map(from.positions)) {
        take_faces(cut);
        at_middle_ = make_lists<Index>(mesh.corner_count(), [&](const auto& add) {
            for (Index t = 0; t < corners.size(); ++t) add(middle_corner(corners[t]), t);
        });
        join_edges();
    }

    Index place_of(Index corner) const { return place[mesh.corners[corner]]; }
    Vec3d position(Index corner) const { return to_double(mesh.positions[mesh.corners[corner]]); }
    SurfacePoint closest(Index t, const Vec3d& p) const {
        const auto at = [&](int k) { return mesh.positions[mesh.corners[corners[t][k]]]; };
        return closest_point_on_triangle(p.cast<float>(), at(0), at(1), at(2));
    }
    Vec3d normal(Index t) const {
        const Vec3d a = position(corners[t][0]);
        return (position(corners[t][1]) - a).cross(position(corners[t][2]) - a);
    }

    /// The triangle that has the point, or the first of its face.
    Index triangle_of(const CornerPoint& point) const {
        for (const Index t : at_middle_[middle_corner(point.corners)])
            if (std::ranges::is_permutation(corners[t], point.corners)) return t;
        return first_triangle_[polygons.face(point.corners[0])];
    }

private:
    static Index middle_corner(const Triangle& t) {
        return std::max(std::min(t[0], t[1]), std::min(std::max(t[0], t[1]), t[2]));
    }

    void take_faces(const Triangulation& cut) {
        first_triangle_.assign(mesh.face_count() + 1, 0);
        for (const Index face : cut.source_face) ++first_triangle_[face + 1];
        for (std::size_t f = 0; f < mesh.face_count(); ++f) first_triangle_[f + 1] += first_triangle_[f];
        corners.reserve(cut.triangles.size());
        std::vector<Index> corner_of(mesh.vertex_count()); // in the face at hand: the vertex's first corner there
        for (std::size_t f = 0; f < mesh.face_count(); ++f) {
            for (Index c = mesh.face_offsets[f + 1]; c-- > mesh.face_offsets[f];) corner_of[mesh.corners[c]] = c;
            for (Index t = first_triangle_[f]; t < first_triangle_[f + 1]; ++t) {
                const auto& [a, b, c] = cut.triangles[t];
                corners.push_back({corner_of[a], corner_of[b], corner_of[c]});
            }
        }
    }

    void join_edges() {
        const auto start = [&](Index t, Index k) { return place_of(corners[t][k % 3]); };
        const IndexLists edges = edges_from(mesh.vertex_count(), [&](const auto& add) {
            for (Index h = 0; h < 3 * corners.size(); ++h)
                if (const Index a = start(h / 3, h % 3), b = start(h / 3, h % 3 + 1); a != b) add(a, b, h);
        });
        beyond.assign(3 * corners.size(), kNoIndex);
        for (const std::span<const Index> edge : edges)
            for (std::size_t i = 0; i < edge.size() && edge.size() > 1; ++i)
                beyond[edge[i]] = edge[i + 1 < edge.size() ? i + 1 : 0];
    }

    std::vector<Index> first_triangle_; ///< of each face, and the count of all
    /// Triangles by their middle corner, of the three in order: each corner of a face but the first and the last is the
    /// middle of one triangle.
    IndexLists at_middle_;
};

/// Whether each half-edge is a seam: whether `same(corner, corner)` fails at one of its ends.
template <class Same>
std::vector<std::uint8_t> find_seams(const InputSurface& surface, const Same& same) {
    std::vector<std::uint8_t> seam(surface.beyond.size());
    for (Index h = 0; h < surface.beyond.size(); ++h) {
        const Index other = surface.beyond[h];
        if (other == kNoIndex) continue;
        Index here[2], there[2];
        for (Index k = 0; k < 2; ++k) {
            here[k] = surface.corners[h / 3][(h + k) % 3];
            there[k] = surface.corners[other / 3][(other + k) % 3];
        }
        if (surface.place_of(here[0]) != surface.place_of(there[0])) std::swap(there[0], there[1]);
        seam[h] = !same(here[0], there[0]) || !same(here[1], there[1]);
    }
    return seam;
}

/// Where a face of `to` lies on `from`.
struct Spot {
    Vec3d centre = Vec3d::Zero();
    double radius = 0;            ///< of all that is searched
    Vec3d normal = Vec3d::Zero(); ///< of unit length, or zero
};

/// The cells of a grid that seams pass through, to tell quickly which faces are far from all of them.
class SeamGrid {
public:
    SeamGrid(const InputSurface& surface, std::span<const std::uint8_t> seam, double cell) {
        const Box box = bounds(surface.mesh);
        double length = 0;
        for_each_seam(surface, seam, [&](const Vec3d& a, const Vec3d& b) { length += (b - a).norm(); });
        origin_ = box.min;
        cell_ = std::max({cell, length / kMostSeamCells, box.diagonal() / double(kMostCells)});
        if (!(cell_ > 0)) cell_ = 1; // all in one place
        for_each_seam(surface, seam, [&](const Vec3d& a, const Vec3d& b) {
            const double pieces = std::ceil((b - a).norm() / cell_) + 1;
            for (double i = 0; i < pieces; ++i) mark(a + i / pieces * (b - a), a + (i + 1) / pieces * (b - a));
        });
        std::ranges::sort(marked_);
        marked_.erase(std::unique(marked_.begin(), marked_.end()), marked_.end());
    }

    bool empty() const { return marked_.empty(); }
    bool near(const Spot& spot) const {
        const Cell low = cell_at(spot.centre.array() - spot.radius), high = cell_at(spot.centre.array() + spot.radius);
        if ((high - low).maxCoeff() > kMostAcross) return true; // to be looked at closely
        bool found = false;
        for_each_cell(low, high, [&](std::uint64_t key) { found = found || std::ranges::binary_search(marked_, key); });
        return found;
    }

private:
    using Cell = Eigen::Array<std::int64_t, 3, 1>;
    static constexpr std::int64_t kMostCells = 1 << 20; // on a side
    static constexpr std::int64_t kMostAcross = 8;

    template <class Visit>
    static void for_each_seam(const InputSurface& surface, std::span<const std::uint8_t> seam, const Visit& visit) {
        for (Index h = 0; h < seam.size(); ++h)
            if (seam[h])
                visit(surface.position(surface.corners[h / 3][h % 3]),
                      surface.position(surface.corners[h / 3][(h + 1) % 3]));
    }
    template <class Visit>
    static void for_each_cell(const Cell& low, const Cell& high, const Visit& visit) {
        for (std::int64_t z = low[2]; z <= high[2]; ++z)
            for (std::int64_t y = low[1]; y <= high[1]; ++y)
                for (std::int64_t x = low[0]; x <= high[0]; ++x)
                    visit((std::uint64_t(z) * kMostCells * 2 + std::uint64_t(y)) * kMostCells * 2 + std::uint64_t(x));
    }
    Cell cell_at(const Eigen::Array3d& p) const {
        return ((p - origin_.array()) / cell_).floor().max(0.0).min(double(kMostCells)).cast<std::int64_t>();
    }
    void mark(const Vec3d& a, const Vec3d& b) {
        for_each_cell(cell_at(a.cwiseMin(b)), cell_at(a.cwiseMax(b)),
                      [&](std::uint64_t key) { marked_.push_back(key); });
    }

    Vec3d origin_;
    double cell_;
    std::vector<std::uint64_t> marked_;
};

/// `to` on `from`: everything that does not depend on the attribute.
struct Placement {
    const InputSurface& surface;
    const Mesh& to;
    std::span<const CornerPoint> points; ///< of each vertex of `to`
    std::vector<Vec3d> positions;        ///< of those points
    std::vector<Index> triangles;        ///< of those points; kNoIndex where there is none
    std::vector<Spot> spots;             ///< of each face of `to`; radius below 0 where no corner has a point
    double mean_radius = 0;
};

Spot find_spot(const Placement& placement, std::span<const Index> face) {
    Spot spot;
    double count = 0;
    for (const Index v : face) {
        if (placement.triangles[v] == kNoIndex) continue;
        spot.centre += placement.positions[v];
        ++count;
    }
    spot.radius = -1;
    if (count == 0) return spot;
    spot.centre /= count;
    for (std::size_t k = 0; k < face.size(); ++k) {
        if (placement.triangles[face[k]] == kNoIndex) continue;
        const Vec3d here = placement.positions[face[k]] - spot.centre;
        spot.radius = std::max(spot.radius, kTransferReach * here.norm());
        const Index next = face[(k + 1) % face.size()];
        if (placement.triangles[next] != kNoIndex) spot.normal += here.cross(placement.positions[next] - spot.centre);
    }
    spot.normal.normalize(); // stays zero where it is
    return spot;
}

Placement make_placement(const InputSurface& surface, const Mesh& to, std::span<const CornerPoint> points,
                         const RunContext& context) {
    Placement placement{surface, to, points, {}, {}, {}};
    placement.positions.assign(points.size(), Vec3d::Zero());
    placement.triangles.assign(points.size(), kNoIndex);
    placement.spots.resize(to.face_count());
    parallel_for(context, points.size(), kTransferAttributesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            if (points[v].corners[0] == kNoIndex) continue;
            placement.triangles[v] = surface.triangle_of(points[v]);
            for (int k = 0; k < 3; ++k)
                placement.positions[v] += double(points[v].barycentric[k]) * surface.position(points[v].corners[k]);
        }
    });
    parallel_for(context, to.face_count(), kTransferAttributesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) placement.spots[f] = find_spot(placement, to.face(f));
    });
    for (const Spot& spot : placement.spots) placement.mean_radius += std::max(0.0, spot.radius);
    placement.mean_radius /= double(std::max<std::size_t>(1, to.face_count()));
    return placement;
}

bool is_under(const InputSurface& surface, Index triangle, const Spot& spot) {
    if (surface.closest(triangle, spot.centre).distance > spot.radius) return false;
    const Vec3d normal = surface.normal(triangle);
    // either way round, as clean-up may have turned faces; the far side of a tube is only reached past its flanks
    return std::abs(normal.dot(spot.normal)) >= kEdgeOn * normal.norm() * spot.normal.norm();
}

/// The triangles under a face that are connected to the first ones through half-edges that pass.
template <class Passes>
std::vector<Index> flood(const InputSurface& surface, const Spot& spot, std::vector<Index> found,
                         const Passes& passes) {
    std::unordered_set<Index> seen(found.begin(), found.end());
    for (std::size_t i = 0; i < found.size() && found.size() < kMostUnder; ++i)
        for (Index h = 3 * found[i]; h < 3 * found[i] + 3; ++h) {
            if (surface.beyond[h] == kNoIndex || !passes(h)) continue;
            const Index next = surface.beyond[h] / 3;
            if (!seen.contains(next) && is_under(surface, next, spot)) {
                seen.insert(next);
                found.push_back(next);
            }
        }
    return found;
}

SurfacePoint closest_of(const InputSurface& surface, std::span<const Index> triangles, const Vec3d& p) {
    SurfacePoint best;
    for (const Index t : triangles) {
        SurfacePoint point = surface.closest(t, p);
        if (point.distance > best.distance || (point.distance == best.distance && t > best.triangle)) continue;
        point.triangle = t;
        best = point;
    }
    return best;
}

/// The triangle of `from` under the centre of a face that has a spot.
Index triangle_under_centre(const Placement& placement, std::size_t face) {
    std::vector<Index> seeds;
    for (const Index v : placement.to.face(face))
        if (const Index t = placement.triangles[v]; t != kNoIndex && std::ranges::find(seeds, t) == seeds.end())
            seeds.push_back(t);
    const Spot& spot = placement.spots[face];
    const std::vector<Index> under = flood(placement.surface, spot, seeds, [](Index) { return true; });
    return closest_of(placement.surface, under, spot.centre).triangle;
}

/// Values at the corners of `from`.
template <class T>
struct CornerValues {
    const Mesh& mesh;
    const std::vector<T>& values;
    const std::vector<Index>& corners;
    float tolerance; ///< within which values are the same

    Index index(Index corner) const { return corners.empty() ? mesh.corners[corner] : corners[corner]; }
    bool has(Index corner) const { return index(corner) != kNoIndex; }
    bool has(const Triangle& t) const { return has(t[0]) && has(t[1]) && has(t[2]); }
    auto at(Index corner) const { return values[index(corner)].template cast<double>(); }
    auto at(const Triangle& t, const Vec3f& barycentric) const {
        return (double(barycentric[0]) * at(t[0]) + double(barycentric[1]) * at(t[1]) +
                double(barycentric[2]) * at(t[2]))
            .eval();
    }
    bool same(Index c, Index d) const {
        const Index i = index(c), j = index(d);
        if (i == j || i == kNoIndex || j == kNoIndex) return i == j;
        return (values[i] - values[j]).cwiseAbs().maxCoeff() <= tolerance;
    }
};

/// The change of a value with position over triangles, by least squares around `centre`; none along directions in which
/// they do not extend.
template <class T>
auto gradient_over(const InputSurface& surface, const CornerValues<T>& values, std::span<const Index> triangles,
                   const Vec3d& centre, double radius) {
    constexpr int kSize = T::SizeAtCompileTime;
    using Value = Eigen::Matrix<double, kSize, 1>;
    const auto for_each_corner = [&](const auto& visit) {
        for (const Index t : triangles)
            for (const Index c : surface.corners[t]) {
                const Vec3d offset = surface.position(c) - centre;
                visit(offset, values.at(c), 1 / (offset.squaredNorm() + radius * radius));
            }
    };
    double weights = 0;
    Vec3d mean_offset = Vec3d::Zero();
    Value mean = Value::Zero();
    for_each_corner([&](const Vec3d& offset, const Value& value, double weight) {
        weights += weight;
        mean_offset += weight * offset;
        mean += weight * value;
    });
    mean_offset /= weights;
    mean /= weights;
    Mat3d variance = Mat3d::Zero();
    Eigen::Matrix<double, kSize, 3> covariance = Eigen::Matrix<double, kSize, 3>::Zero();
    for_each_corner([&](const Vec3d& offset, const Value& value, double weight) {
        variance += weight * (offset - mean_offset) * (offset - mean_offset).transpose();
        covariance += weight * (value - mean) * (offset - mean_offset).transpose();
    });
    const SymmetricEigen<double, 3> axes = symmetric_eigen(variance);
    Vec3d inverse = Vec3d::Zero();
    for (int k = 0; k < 3; ++k)
        if (axes.values[k] > kFlatDirection * axes.values[2]) inverse[k] = 1 / axes.values[k];
    return (covariance * axes.vectors * inverse.asDiagonal() * axes.vectors.transpose()).eval();
}

enum class CornerKind : std::uint8_t {
    own,       ///< the value at the vertex's own point
    none,      ///< the side that the face is on has no values
    continued, ///< from the side that the face is on
};

/// What each corner of `to` gets.
template <class T>
struct CornerResults {
    using Value = Eigen::Matrix<double, T::SizeAtCompileTime, 1>;
    std::vector<CornerKind> kinds;
    std::vector<Value> values;  ///< of those continued
    std::vector<float> extents; ///< of those continued: how far apart the values of its face are
};

/// The value of the side at `p`, which may lie beyond it.
template <class T>
auto continue_side(const InputSurface& surface, const CornerValues<T>& values, std::span<const Index> side,
                   const Vec3d& p, double radius) {
    const SurfacePoint foot = closest_of(surface, side, p);
    const Triangle& corners = surface.corners[foot.triangle];
    auto value = values.at(corners, foot.barycentric);
    if (!(foot.distance > kOnTheSeam * radius)) return value;
    Vec3d at = Vec3d::Zero();
    for (int k = 0; k < 3; ++k) at += double(foot.barycentric[k]) * surface.position(corners[k]);
    value += gradient_over(surface, values, side, at, radius) * (p - at);
    return value;
}

template <class T>
void cross_seam(const Placement& placement, const CornerValues<T>& values, std::span<const std::uint8_t> seam,
                std::size_t face, CornerResults<T>& results) {
    const Spot& spot = placement.spots[face];
    const Index middle = triangle_under_centre(placement, face);
    const Index first = placement.to.face_offsets[face];
    const std::span<const Index> vertices = placement.to.face(face);
    if (!values.has(placement.surface.corners[middle])) {
        std::fill_n(results.kinds.begin() + first, vertices.size(), CornerKind::none);
        return;
    }
    const std::vector<Index> side = flood(placement.surface, spot, {middle}, [&](Index h) {
        return !seam[h] && values.has(placement.surface.corners[placement.surface.beyond[h] / 3]);
    });
    using Value = typename CornerResults<T>::Value;
    Value low = Value::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (Index c = first; c < first + vertices.size(); ++c) {
        const Index v = vertices[c - first], triangle = placement.triangles[v];
        if (triangle == kNoIndex) continue;
        Value value;
        if (std::ranges::find(side, triangle) != side.end()) {
            if (results.kinds[c] == CornerKind::none) continue; // a polygon with values at some of its corners
            value = values.at(placement.points[v].corners, placement.points[v].barycentric);
        } else {
            value = continue_side(placement.surface, values, side, placement.positions[v], spot.radius);
            results.kinds[c] = CornerKind::continued;
            results.values[c] = value;
        }
        low = low.cwiseMin(value);
        high = high.cwiseMax(value);
    }
    for (Index c = first; c < first + vertices.size(); ++c) results.extents[c] = float((high - low).norm());
}

template <class T>
CornerResults<T> find_corner_values(const Placement& placement, const CornerValues<T>& values,
                                    const RunContext& context) {
    const std::size_t count = placement.to.corner_count();
    CornerResults<T> results{std::vector<CornerKind>(count, CornerKind::own), {}, {}};
    for (std::size_t c = 0; c < count; ++c) {
        const CornerPoint& point = placement.points[placement.to.corners[c]];
        if (point.corners[0] == kNoIndex || !values.has(point.corners)) results.kinds[c] = CornerKind::none;
    }
    const std::vector<std::uint8_t> seam =
        find_seams(placement.surface, [&](Index c, Index d) { return values.same(c, d); });
    const SeamGrid grid(placement.surface, seam, 2 * placement.mean_radius);
    if (grid.empty()) return results;
    results.values.resize(count);
    results.extents.resize(count);
    parallel_for(context, placement.to.face_count(), kTransferAttributesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end && !context.is_cancelled(); ++f)
            if (placement.spots[f].radius >= 0 && grid.near(placement.spots[f]))
                cross_seam(placement, values, seam, f, results);
    });
    return results;
}

/// Corners of `to` in the order of their vertices.
std::vector<Index> by_vertex(const Mesh& to, std::span<const CornerKind> kinds, CornerKind wanted) {
    std::vector<Index> corners;
    for (Index c = 0; c < kinds.size(); ++c)
        if (kinds[c] == wanted) corners.push_back(c);
    std::ranges::stable_sort(corners, {}, [&](Index c) { return to.corners[c]; });
    return corners;
}

/// Adds the values of the continued corners, one for each side that meets at a vertex.
template <class T>
void add_continued(const Mesh& to, const CornerResults<T>& results, float tolerance, CornerAttribute<T>& attribute) {
    using Value = typename CornerResults<T>::Value;
    struct Side {
        Value first, sum;
        double count;
        Index index;
    };
    std::vector<Side> sides; // at the vertex
    Index vertex = kNoIndex;
    const auto finish = [&] {
        for (const Side& side : sides) attribute.values[side.index] = (side.sum / side.count).template cast<float>();
        sides.clear();
    };
    for (const Index c : by_vertex(to, results.kinds, CornerKind::continued)) {
        if (to.corners[c] != vertex) finish();
        vertex = to.corners[c];
        const double reach = double(tolerance) + kSameSide * double(results.extents[c]);
        auto side =
            std::ranges::find_if(sides, [&](const Side& s) { return (s.first - results.values[c]).norm() <= reach; });
        if (side == sides.end()) {
            sides.push_back({results.values[c], Value::Zero(), 0, Index(attribute.values.size())});
            attribute.values.emplace_back(T::Zero());
            side = sides.end() - 1;
        }
        side->sum += results.values[c];
        ++side->count;
        attribute.corners[c] = side->index;
    }
    finish();
}

/// One value a vertex where no corner needs another, else corners that share what they can.
template <class T>
CornerAttribute<T> assemble(const Placement& placement, const CornerValues<T>& values,
                            const CornerResults<T>& results) {
    CornerAttribute<T> attribute;
    const std::size_t vertices = placement.to.vertex_count();
    std::vector<std::uint8_t> used(vertices);
    for (std::size_t c = 0; c < results.kinds.size(); ++c)
        if (results.kinds[c] == CornerKind::own) used[placement.to.corners[c]] = 1;
    const bool per_vertex = std::ranges::all_of(results.kinds, [](CornerKind kind) { return kind == CornerKind::own; });
    std::vector<Index> index_of(vertices, kNoIndex);
    for (std::size_t v = 0; v < vertices; ++v) {
        if (!used[v] && !per_vertex) continue;
        index_of[v] = Index(attribute.values.size());
        const CornerPoint& point = placement.points[v];
        attribute.values.push_back(used[v] ? T(values.at(point.corners, point.barycentric).template cast<float>())
                                           : T(T::Zero())); // in no face
    }
    if (per_vertex) return attribute;
    attribute.corners.assign(results.kinds.size(), kNoIndex);
    for (std::size_t c = 0; c < results.kinds.size(); ++c)
        if (results.kinds[c] == CornerKind::own) attribute.corners[c] = index_of[placement.to.corners[c]];
    add_continued(placement.to, results, values.tolerance, attribute);
    return attribute.values.empty() ? CornerAttribute<T>{} : attribute;
}

template <class T>
CornerAttribute<T> transfer_corners(const Placement& placement, const CornerAttribute<T>& attribute, float tolerance,
                                    const RunContext& context) {
    if (attribute.empty()) return {};
    const CornerValues<T> values{placement.surface.mesh, attribute.values, attribute.corners, tolerance};
    return assemble(placement, values, find_corner_values(placement, values, context));
}

/// Unit length, and no value where there is no direction.
void normalize(CornerAttribute<Vec3f>& normals, const Mesh& mesh) {
    for (Vec3f& n : normals.values) n = n.cast<double>().stableNormalized().cast<float>();
    const auto is_none = [&](Index i) { return i != kNoIndex && normals.values[i].isZero(0); };
    if (std::ranges::none_of(normals.values, [](const Vec3f& n) { return n.isZero(0); })) return;
    if (normals.per_vertex()) normals.corners = mesh.corners;
    for (Index& i : normals.corners)
        if (is_none(i)) i = kNoIndex;
}

CornerAttribute<Vec3f> transfer_normals(const Placement& placement, const RunContext& context) {
    CornerAttribute<Vec3f> normals = placement.surface.mesh.normals;
    normalize(normals, placement.surface.mesh);
    normals = transfer_corners(placement, normals, kSameNormal, context);
    if (!normals.empty()) normalize(normals, placement.to);
    return normals;
}

/// The face of `from` under the centre of each face of `to`.
std::vector<Index> faces_under(const Placement& placement, const RunContext& context) {
    const Mesh& from = placement.surface.mesh;
    const auto same = [&](Index c, Index d) {
        const Index f = placement.surface.polygons.face(c), g = placement.surface.polygons.face(d);
        for (const FaceLabels* labels : {&from.objects, &from.groups, &from.materials})
            if (!labels->empty() && labels->of_face[f] != labels->of_face[g]) return false;
        return from.smoothing.empty() || from.smoothing[f] == from.smoothing[g];
    };
    const SeamGrid grid(placement.surface, find_seams(placement.surface, same), 2 * placement.mean_radius);
    std::vector<Index> faces(placement.to.face_count(), kNoIndex);
    parallel_for(context, faces.size(), kTransferAttributesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end && !context.is_cancelled(); ++f) {
            if (placement.spots[f].radius < 0) continue;
            const std::span<const Index> face = placement.to.face(f);
            const auto known = std::ranges::find_if(face, [&](Index v) { return placement.triangles[v] != kNoIndex; });
            const Index triangle = !grid.empty() && grid.near(placement.spots[f]) ? triangle_under_centre(placement, f)
                                                                                  : placement.triangles[*known];
            faces[f] = placement.surface.polygons.face(placement.surface.corners[triangle][0]);
        }
    });
    return faces;
}

void transfer_labels(const Placement& placement, Mesh& to, const RunContext& context) {
    const Mesh& from = placement.surface.mesh;
    const std::vector<Index> faces = faces_under(placement, context);
    const auto copy = [&](const FaceLabels& source, FaceLabels& target) {
        target.of_face.clear();
        if (source.empty()) return;
        for (const Index f : faces) target.of_face.push_back(f == kNoIndex ? kNoIndex : source.of_face[f]);
    };
    copy(from.objects, to.objects);
    copy(from.groups, to.groups);
    copy(from.materials, to.materials);
    if (from.smoothing.empty()) return;
    for (const Index f : faces) to.smoothing.push_back(f == kNoIndex ? 0 : from.smoothing[f]);
}

/// Vertices without a point take that of the nearest vertex of one of their faces that has one, from the known ones
/// outwards.
std::vector<CornerPoint> fill_missing_points(const Mesh& to, std::span<const CornerPoint> points) {
    std::vector<CornerPoint> filled(points.begin(), points.end());
    const auto missing = [&](Index v) { return filled[v].corners[0] == kNoIndex; };
    std::vector<Index> faces;
    for (std::size_t f = 0; f < to.face_count(); ++f)
        if (std::ranges::any_of(to.face(f), missing)) faces.push_back(Index(f));
    while (!faces.empty()) {
        struct Found {
            Index vertex, source;
            float distance;
        };
        std::vector<Found> round;
        for (const Index f : faces)
            for (const Index v : to.face(f)) {
                if (!missing(v)) continue;
                for (const Index w : to.face(f))
                    if (!missing(w)) round.push_back({v, w, (to.positions[v] - to.positions[w]).norm()});
            }
        if (round.empty()) break; // a component of which nothing is known
        std::ranges::sort(round, {}, [](const Found& f) { return std::tuple(f.vertex, f.distance, f.source); });
        for (const Found& f : round) // the nearest of each vertex first
            if (missing(f.vertex)) filled[f.vertex] = filled[f.source];
        std::erase_if(faces, [&](Index f) { return std::ranges::none_of(to.face(f), missing); });
    }
    return filled;
}

void interpolate_vertex_data(const Mesh& from, std::span<const CornerPoint> points, Mesh& to,
                             const RunContext& context) {
    to.colors.assign(from.colors.empty() ? 0 : points.size(), Vec4f::Zero());
    to.colors_have_alpha = from.colors_have_alpha;
    to.scalars.clear();
    for (const VertexScalar& scalar : from.scalars)
        to.scalars.push_back({scalar.name, std::vector<float>(points.size())});
    parallel_for(context, points.size(), kTransferAttributesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            if (points[v].corners[0] == kNoIndex) continue;
            Eigen::Vector4d color = Eigen::Vector4d::Zero();
            for (int k = 0; k < 3 && !to.colors.empty(); ++k)
                color +=
                    double(points[v].barycentric[k]) * from.colors[from.corners[points[v].corners[k]]].cast<double>();
            if (!to.colors.empty()) to.colors[v] = color.cast<float>();
            for (std::size_t s = 0; s < to.scalars.size(); ++s) {
                double value = 0;
                for (int k = 0; k < 3; ++k)
                    value += double(points[v].barycentric[k]) *
                             double(from.scalars[s].values[from.corners[points[v].corners[k]]]);
                to.scalars[s].values[v] = float(value);
            }
        }
    });
}

void clear_face_data(const Mesh& from, Mesh& to) {
    to.uvs = {};
    to.normals = {};
    to.objects = {from.objects.names, {}};
    to.groups = {from.groups.names, {}};
    to.materials = {from.materials.names, {}};
    to.smoothing.clear();
    to.material_files = from.material_files;
    to.embedded_materials = from.embedded_materials;
}

bool has_face_data(const Mesh& mesh) {
    return !mesh.uvs.empty() || !mesh.normals.empty() || !mesh.objects.empty() || !mesh.groups.empty() ||
           !mesh.materials.empty() || !mesh.smoothing.empty();
}

std::optional<Error> transfer_error(const Mesh& from, std::span<const CornerPoint> points, const Mesh& to) {
    if (std::optional<Error> error = mesh_error(from, "The mesh with the attributes")) return error;
    if (std::optional<Error> error = mesh_error(to, "The mesh that takes the attributes")) return error;
    if (points.size() != to.vertex_count())
        return Error{ErrorCode::usage, "There is not one point for each vertex that takes attributes."};
    for (const CornerPoint& point : points) {
        if (point.corners[0] == kNoIndex) continue;
        if (std::ranges::any_of(point.corners, [&](Index corner) { return corner >= from.corner_count(); }))
            return Error{ErrorCode::usage, "A point lies on corners that the mesh with the attributes does not have."};
    }
    return std::nullopt;
}

} // namespace

Status transfer_attributes(const Mesh& from, std::span<const CornerPoint> points, Mesh& to, const RunContext& context) {
    if (std::optional<Error> error = transfer_error(from, points, to)) return *error;
    const std::vector<CornerPoint> filled = fill_missing_points(to, points);
    interpolate_vertex_data(from, filled, to, context);
    clear_face_data(from, to);
    if (context.is_cancelled()) return cancelled_error();
    if (!has_face_data(from)) return Success{};

    const Result<Triangulation> cut = triangulate(from, context);
    if (!cut) return cut.error();
    const InputSurface surface(from, *cut);
    const Placement placement = make_placement(surface, to, filled, context);
    if (context.is_cancelled()) return cancelled_error();
    to.uvs = transfer_corners(placement, from.uvs, kSameUv, context);
    if (context.is_cancelled()) return cancelled_error();
    to.normals = transfer_normals(placement, context);
    if (context.is_cancelled()) return cancelled_error();
    transfer_labels(placement, to, context);
    if (context.is_cancelled()) return cancelled_error();
    return Success{};
}

} // namespace filigree
