// Based on:
//   [Ericson 2005] 5.1.2 and 5.1.5 (closest point on a segment and a triangle). We try the plane, then the edges
//   that the point is beyond, in place of the regions: this is right for triangles without an area as well.
//   Embree's point queries [Wald 2014]. Embree is told boxes only, in float and in units of the whole box; every
//   distance that decides is computed here in double, and Embree's radius is kept a little too large.
#include "filigree/mesh/closest_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <embree3/rtcore.h>
#include <new>

namespace filigree {
namespace {

constexpr double kFlat = 1e-20;       // squared sine of a corner, below which a triangle has no plane in double
constexpr double kFarthest = 1e4;     // box sizes: from further out, a query is moved here first
constexpr double kRadiusSlack = 1e-6; // of the coordinates' size: several roundings of Embree's floats

struct TrianglePoint {
    Vec3d barycentric;
    Vec3d position;
    double squared_distance = std::numeric_limits<double>::infinity();
};

TrianglePoint closest_on_edge(const Vec3d& p, const std::array<Vec3d, 3>& corners, int from, int to) {
    // one direction for both triangles of an edge, so that they are equally close to the bit
    if (std::ranges::lexicographical_compare(corners[to], corners[from])) std::swap(from, to);
    const Vec3d edge = corners[to] - corners[from];
    const double squared_length = edge.squaredNorm();
    const double t = squared_length > 0 ? std::clamp(edge.dot(p - corners[from]) / squared_length, 0.0, 1.0) : 0;
    TrianglePoint result;
    result.barycentric.setZero();
    result.barycentric[from] = 1 - t;
    result.barycentric[to] = t;
    result.position = t == 1 ? corners[to] : Vec3d(corners[from] + t * edge); // corners exactly
    result.squared_distance = (p - result.position).squaredNorm();
    return result;
}

TrianglePoint closest_on_triangle(const Vec3d& p, const std::array<Vec3d, 3>& corners) {
    const Vec3d ab = corners[1] - corners[0], ac = corners[2] - corners[0], ap = p - corners[0];
    const Vec3d normal = ab.cross(ac);
    const double squared_area = normal.squaredNorm();
    std::array<bool, 3> beyond = {true, true, true}; // corner k's opposite edge, where nothing better is known
    if (squared_area > kFlat * ab.squaredNorm() * ac.squaredNorm()) {
        const double v = ap.cross(ac).dot(normal), w = ab.cross(ap).dot(normal), u = squared_area - v - w;
        if (u >= 0 && v >= 0 && w >= 0) {
            TrianglePoint result;
            result.barycentric = Vec3d(u, v, w) / squared_area;
            result.position = corners[0] + result.barycentric[1] * ab + result.barycentric[2] * ac;
            result.squared_distance = (p - result.position).squaredNorm();
            return result;
        }
        beyond = {u < 0, v < 0, w < 0}; // p sees no other edge
    }
    TrianglePoint best;
    for (int k = 0; k < 3; ++k) {
        if (!beyond[k]) continue;
        const TrianglePoint candidate = closest_on_edge(p, corners, (k + 1) % 3, (k + 2) % 3);
        if (candidate.squared_distance < best.squared_distance) best = candidate;
    }
    return best;
}

SurfacePoint surface_point(const TrianglePoint& point, Index triangle) {
    return {triangle, point.barycentric.cast<float>(), point.position.cast<float>(), std::sqrt(point.squared_distance)};
}

bool share_an_edge(const Triangle& s, const Triangle& t) {
    return std::ranges::count_if(t, [&](Index vertex) { return std::ranges::find(s, vertex) != s.end(); }) == 2;
}

/// One for the process: a device is slow to make, and its own threads are TBB's.
RTCDevice embree_device() {
    struct Device {
        RTCDevice handle = rtcNewDevice(nullptr);
        ~Device() { rtcReleaseDevice(handle); }
    };
    static const Device device;
    if (!device.handle) throw std::bad_alloc();
    return device.handle;
}

} // namespace

SurfacePoint closest_point_on_triangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    return surface_point(closest_on_triangle(p.cast<double>(), {a.cast<double>(), b.cast<double>(), c.cast<double>()}),
                         kNoIndex);
}

struct ClosestPointTree::Tree {
    std::span<const Vec3f> positions;
    std::span<const Triangle> triangles;
    Vec3d centre = Vec3d::Zero();
    double scale = 1; ///< Embree's units in a model unit: the box becomes -1 to 1
    RTCScene scene = nullptr;
    /// Leaf i has the triangles leaf_begin[i] .. leaf_begin[i + 1] - 1; empty: one triangle each.
    std::vector<Index> leaf_begin;
    /// In Embree's units, during the build only: Embree flushes denormal floats to zero while it calls set_bounds.
    std::vector<Vec3f> local_positions;

    Tree(std::span<const Vec3f> positions_, std::span<const Triangle> triangles_, TreeLeaves leaves)
        : positions(positions_), triangles(triangles_) {
        if (triangles.empty()) return;
        Box box;
        for (const Triangle& triangle : triangles)
            for (const Index vertex : triangle) box.extend(positions[vertex].cast<double>());
        centre = box.centre();
        const double size = box.size().maxCoeff();
        if (size > 0) scale = 2 / size;
        local_positions.reserve(positions.size());
        for (const Vec3f& p : positions) local_positions.push_back(to_local(p.cast<double>()).cast<float>());
        if (leaves == TreeLeaves::pairs) pair_triangles();
        build();
        local_positions = {};
    }
    ~Tree() {
        if (scene) rtcReleaseScene(scene);
    }
    Tree(const Tree&) = delete;
    Tree& operator=(const Tree&) = delete;

    Vec3d to_local(const Vec3d& p) const { return (p - centre) * scale; }
    std::array<Vec3d, 3> corners(Index triangle) const {
        const auto& [a, b, c] = triangles[triangle];
        return {positions[a].cast<double>(), positions[b].cast<double>(), positions[c].cast<double>()};
    }

    std::size_t leaf_count() const { return leaf_begin.empty() ? triangles.size() : leaf_begin.size() - 1; }
    std::span<const Triangle> leaf(Index i) const {
        return leaf_begin.empty() ? triangles.subspan(i, 1)
                                  : triangles.subspan(leaf_begin[i], leaf_begin[i + 1] - leaf_begin[i]);
    }

    void pair_triangles() {
        leaf_begin.reserve(triangles.size() / 2 + 1);
        for (std::size_t t = 0; t < triangles.size(); ++t) {
            leaf_begin.push_back(static_cast<Index>(t));
            if (t + 1 < triangles.size() && share_an_edge(triangles[t], triangles[t + 1])) ++t;
        }
        leaf_begin.push_back(static_cast<Index>(triangles.size()));
    }

    void build() {
        const RTCDevice device = embree_device();
        const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(leaf_count()));
        rtcSetGeometryUserData(geometry, this);
        rtcSetGeometryBoundsFunction(geometry, set_bounds, nullptr);
        rtcCommitGeometry(geometry);
        scene = rtcNewScene(device);
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        if (rtcGetDeviceError(device) == RTC_ERROR_NONE) return;
        rtcReleaseScene(scene);
        throw std::bad_alloc();
    }

    static void set_bounds(const RTCBoundsFunctionArguments* args) {
        const Tree& tree = *static_cast<const Tree*>(args->geometryUserPtr);
        Vec3f low = Vec3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
        for (const auto& [a, b, c] : tree.leaf(args->primID)) {
            const Vec3f &p = tree.local_positions[a], &q = tree.local_positions[b], &r = tree.local_positions[c];
            low = low.cwiseMin(p).cwiseMin(q).cwiseMin(r);
            high = high.cwiseMax(p).cwiseMax(q).cwiseMax(r);
        }
        *args->bounds_o = {low.x(), low.y(), low.z(), 0, high.x(), high.y(), high.z(), 0};
    }

    /// A query on its way through the tree.
    struct Search {
        const Tree& tree;
        Vec3d query, facing;
        double slack;
        Index triangle = kNoIndex;
        double distance = std::numeric_limits<double>::infinity();

        float radius() const {
            const double local = distance * tree.scale * (1 + kRadiusSlack) + slack;
            return static_cast<float>(std::min(local, 10 * kFarthest)); // that reaches all
        }

        /// Whether the triangle is closer than all before.
        bool visit_triangle(Index candidate) {
            const std::array<Vec3d, 3> corners = tree.corners(candidate);
            if (!facing.isZero(0) && !((corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(facing) > 0))
                return false;
            const double found = std::sqrt(closest_on_triangle(query, corners).squared_distance); // as it is returned
            const bool closer = found < distance;
            if (!closer && !(found == distance && candidate < triangle)) return false;
            distance = found;
            triangle = candidate;
            return closer;
        }
    };

    static bool visit(RTCPointQueryFunctionArguments* args) {
        Search& search = *static_cast<Search*>(args->userPtr);
        const std::span<const Triangle> leaf = search.tree.leaf(args->primID);
        const Index first = static_cast<Index>(leaf.data() - search.tree.triangles.data());
        bool closer = false;
        for (Index i = 0; i < leaf.size(); ++i) closer |= search.visit_triangle(first + i);
        if (closer) args->query->radius = search.radius();
        return closer;
    }

    SurfacePoint closest(const Vec3d& query, double max_distance, const Vec3d& facing) const {
        Vec3d local = to_local(query);
        const double reach = local.cwiseAbs().maxCoeff();
        const bool far = reach > kFarthest;
        if (far) local *= kFarthest / reach;

        Search search{.tree = *this,
                      .query = far ? Vec3d(centre + local / scale) : query,
                      .facing = facing,
                      .slack = kRadiusSlack * (1 + std::min(reach, kFarthest)),
                      .distance = far ? std::numeric_limits<double>::infinity() : max_distance};
        RTCPointQuery point{};
        point.x = static_cast<float>(local.x());
        point.y = static_cast<float>(local.y());
        point.z = static_cast<float>(local.z());
        point.radius = search.radius();
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        rtcPointQuery(scene, &point, &context, visit, &search);
        if (search.triangle == kNoIndex) return {};
        const SurfacePoint found = surface_point(closest_on_triangle(query, corners(search.triangle)), search.triangle);
        return found.distance <= max_distance ? found : SurfacePoint{};
    }
};

ClosestPointTree::ClosestPointTree(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                   TreeLeaves leaves)
    : tree_(std::make_unique<Tree>(positions, triangles, leaves)) {}
ClosestPointTree::~ClosestPointTree() = default;
ClosestPointTree::ClosestPointTree(ClosestPointTree&&) noexcept = default;
ClosestPointTree& ClosestPointTree::operator=(ClosestPointTree&&) noexcept = default;

SurfacePoint ClosestPointTree::closest(const Vec3f& query, double max_distance, const Vec3f& facing) const {
    if (!tree_->scene || !(max_distance >= 0)) return {};
    return tree_->closest(query.cast<double>(), max_distance, facing.cast<double>());
}

} // namespace filigree
