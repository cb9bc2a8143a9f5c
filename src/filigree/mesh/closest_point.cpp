// Based on:
//   Embree's point queries [Wald 2014]. Embree is told boxes only, in float and in units of the whole box; every
//   distance that decides is computed here in double, and Embree's radius is kept a little too large.
#include "filigree/mesh/closest_point.h"

#include "filigree/mesh/triangle_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <new>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace filigree {
namespace {

constexpr double kFarthest = 1e4;  // box sizes: from further out, a query is moved here first
constexpr double kNeedle = 4;      // times its doubled area: a larger box is mostly empty
constexpr double kMostPieces = 64; // of a needle as long as the whole
constexpr std::size_t kMostMorePieces = std::size_t(1) << 20; // for all needles together
constexpr double kRadiusSlack = 1e-6; // of the coordinates' size: several roundings of Embree's floats

SurfacePoint surface_point(const ClosestTrianglePoint& point, Index triangle) {
    return {triangle, point.barycentric.cast<float>(), point.position.cast<float>(), std::sqrt(point.squared_distance)};
}

double half_surface(const Vec3d& size) { return size.x() * size.y() + size.y() * size.z() + size.z() * size.x(); }

bool share_an_edge(const Triangle& s, const Triangle& t) {
    return std::ranges::count_if(t, [&](Index vertex) { return std::ranges::find(s, vertex) != s.end(); }) == 2;
}

/// One for the process: a device is slow to make, and its own threads are TBB's.
RTCDevice embree_device() {
#ifdef __SANITIZE_THREAD__
    // The thread sanitizer takes every hand-over in oneTBB for a race: see run_pieces.
    constexpr const char* kConfig = "threads=1";
#else
    constexpr const char* kConfig = nullptr; // as many as oneTBB has
#endif
    struct Device {
        RTCDevice handle = rtcNewDevice(kConfig);
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
    /// Triangles from `first` on with one box; of a needle only a piece, between planes across its box's longest axis.
    struct Leaf {
        Index first;
        std::uint8_t count = 1, piece = 0, pieces = 1;
    };

    std::span<const Vec3f> positions;
    std::span<const Triangle> triangles;
    Vec3d centre = Vec3d::Zero();
    double scale = 1; ///< Embree's units in a model unit: the box becomes -1 to 1
    RTCScene scene = nullptr;
    std::vector<Leaf> leaves; ///< empty: one triangle each
    /// In Embree's units, during the build only: Embree flushes denormal floats to zero while it calls set_bounds.
    std::vector<Vec3f> local_positions;

    Tree(std::span<const Vec3f> positions_, std::span<const Triangle> triangles_, TreeLeaves kind)
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
        make_leaves(kind);
        build();
        local_positions = std::vector<Vec3f>(); // {} would keep the memory
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

    Leaf leaf(Index i) const { return leaves.empty() ? Leaf{i} : leaves[i]; }

    Box local_box(const Triangle& triangle) const {
        Box box;
        for (const Index vertex : triangle) box.extend(local_positions[vertex].cast<double>());
        return box;
    }

    /// How many boxes each triangle should have: several where it is much thinner than its own box, and the box not
    /// small. Queries would find hundreds of such needles in place of a few.
    std::vector<std::uint8_t> count_pieces() const {
        const double whole = half_surface(2 * Vec3d::Ones());
        std::vector<std::uint8_t> pieces(triangles.size(), 1);
        std::size_t more = 0;
        for (std::size_t t = 0; t < triangles.size(); ++t) {
            const auto& [a, b, c] = triangles[t];
            const Vec3d p = local_positions[a].cast<double>();
            const Vec3d doubled_area =
                (local_positions[b].cast<double>() - p).cross(local_positions[c].cast<double>() - p);
            const double excess = half_surface(local_box(triangles[t]).size()) - kNeedle * doubled_area.norm();
            if (excess > 0) pieces[t] = std::uint8_t(std::max(1.0, kMostPieces * std::sqrt(excess / whole)));
            more += pieces[t] - 1u;
        }
        if (more > kMostMorePieces)
            for (std::uint8_t& n : pieces) n = std::uint8_t(1 + (n - 1) * kMostMorePieces / more);
        return pieces;
    }

    void make_leaves(TreeLeaves kind) {
        const std::vector<std::uint8_t> pieces = count_pieces();
        const auto is_whole = [](std::uint8_t n) { return n == 1; };
        if (kind == TreeLeaves::single && std::ranges::all_of(pieces, is_whole)) return;
        for (std::size_t t = 0; t < triangles.size(); ++t) {
            const Index first = static_cast<Index>(t);
            const bool pair = kind == TreeLeaves::pairs && t + 1 < triangles.size() && is_whole(pieces[t]) &&
                              is_whole(pieces[t + 1]) && share_an_edge(triangles[t], triangles[t + 1]);
            for (std::uint8_t i = 0; i < pieces[t]; ++i)
                leaves.push_back({first, std::uint8_t(pair ? 2 : 1), i, pieces[t]});
            if (pair) ++t;
        }
    }

    Box leaf_box(const Leaf& leaf) const {
        Box box;
        for (Index i = 0; i < leaf.count; ++i) {
            const Box whole = local_box(triangles[leaf.first + i]);
            box.extend(whole.min);
            box.extend(whole.max);
        }
        return leaf.pieces == 1 ? box : piece_box(triangles[leaf.first], box, leaf);
    }

    /// The box of the part of a triangle that lies between the leaf's two planes. Every corner of that part lies on an
    /// edge of the triangle, so the edges, cut at the planes, are enough.
    Box piece_box(const Triangle& triangle, const Box& whole, const Leaf& leaf) const {
        int axis = 0;
        const double length = whole.size().maxCoeff(&axis);
        const auto plane = [&](int i) { return whole.min[axis] + length * i / leaf.pieces; };
        const double low = plane(leaf.piece), high = plane(leaf.piece + 1);
        Box box;
        for (int k = 0; k < 3; ++k) {
            const Vec3d p = local_positions[triangle[k]].cast<double>();
            const Vec3d q = local_positions[triangle[(k + 1) % 3]].cast<double>();
            if (std::max(p[axis], q[axis]) < low || std::min(p[axis], q[axis]) > high) continue;
            for (const double at : {std::clamp(p[axis], low, high), std::clamp(q[axis], low, high)}) {
                const double t = p[axis] == q[axis] ? 0 : (at - p[axis]) / (q[axis] - p[axis]);
                box.extend(p + t * (q - p));
            }
            if (p[axis] == q[axis]) box.extend(q);
        }
        return box;
    }

    void build() {
        const RTCDevice device = embree_device();
        const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry,
                                         static_cast<unsigned>(leaves.empty() ? triangles.size() : leaves.size()));
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
        const Box box = tree.leaf_box(tree.leaf(args->primID));
        const Vec3f low = box.min.cast<float>(), high = box.max.cast<float>();
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
        const Leaf leaf = search.tree.leaf(args->primID);
        bool closer = false;
        for (Index i = 0; i < leaf.count; ++i) closer |= search.visit_triangle(leaf.first + i);
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

    struct Listing {
        const Tree& tree;
        const void* of;
        void (*visit)(const void*, Index);
    };
    static bool list(RTCPointQueryFunctionArguments* args) {
        const Listing& listing = *static_cast<const Listing*>(args->userPtr);
        const Leaf leaf = listing.tree.leaf(args->primID);
        for (Index i = 0; i < leaf.count; ++i) listing.visit(listing.of, leaf.first + i);
        return false; // the radius stays
    }
    void visit_near(const Vec3d& at, double radius, Listing listing) const {
        const Vec3d local = to_local(at);
        const double reach = local.cwiseAbs().maxCoeff();
        const double wide = radius * scale * (1 + kRadiusSlack) + kRadiusSlack * (1 + reach);
        if (!(reach <= 1 + wide)) return; // it is that far from the box of all
        RTCPointQuery point{};
        point.x = static_cast<float>(local.x());
        point.y = static_cast<float>(local.y());
        point.z = static_cast<float>(local.z());
        point.radius = static_cast<float>(std::min(wide, 10 * kFarthest));
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        rtcPointQuery(scene, &point, &context, list, &listing);
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

void ClosestPointTree::visit_near(const Vec3f& point, double radius, const void* of,
                                  void (*visit)(const void*, Index)) const {
    if (tree_->scene && radius >= 0 && point.allFinite())
        tree_->visit_near(point.cast<double>(), radius, {*tree_, of, visit});
}

} // namespace filigree
