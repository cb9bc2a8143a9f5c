// The tree holds boxes only, in float and in units of the whole box. Every distance that decides is computed in double,
// and the tree's radius is kept a little too large.
#include "filigree/mesh/closest_point.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/box_tree.h"
#include "filigree/mesh/triangle_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace filigree {
namespace {

constexpr std::size_t kGrain = 1 << 14;
constexpr double kFarthest = 1e4;  // box sizes: from further out, a query is moved here first
constexpr double kNeedle = 4;      // times its doubled area: a larger box is mostly empty
constexpr double kMostPieces = 64; // of a needle as long as the whole
constexpr std::size_t kMostMorePieces = std::size_t(1) << 20; // for all needles together
constexpr double kRadiusSlack = 1e-6;                         // of the coordinates' size: several roundings of floats

SurfacePoint surface_point(const ClosestTrianglePoint& point, Index triangle) {
    return {triangle, point.barycentric.cast<float>(), point.position.cast<float>(), std::sqrt(point.squared_distance)};
}

double half_surface(const Vec3d& size) { return size.x() * size.y() + size.y() * size.z() + size.z() * size.x(); }

} // namespace

SurfacePoint closest_point_on_triangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    return surface_point(closest_on_triangle(p.cast<double>(), {a.cast<double>(), b.cast<double>(), c.cast<double>()}),
                         kNoIndex);
}

struct ClosestPointTree::Tree {
    /// A triangle, or of a needle only a piece, between planes across its box's longest axis.
    struct Leaf {
        Index triangle;
        std::uint8_t piece = 0, pieces = 1;
    };

    std::span<const Vec3f> positions;
    std::span<const Triangle> triangles;
    Vec3d centre = Vec3d::Zero();
    double scale = 1;         ///< the tree's units in a model unit: the box becomes -1 to 1
    std::vector<Leaf> leaves; ///< empty: one triangle each
    BoxTree boxes;

    Tree(std::span<const Vec3f> positions_, std::span<const Triangle> triangles_, const RunContext& context)
        : positions(positions_), triangles(triangles_) {
        if (triangles.empty()) return;
        Box box;
        for (const Triangle& triangle : triangles)
            for (const Index vertex : triangle) box.extend(positions[vertex].cast<double>());
        centre = box.centre();
        const double size = box.size().maxCoeff();
        if (size > 0) scale = 2 / size;
        make_leaves(context);
        std::vector<FloatBox> of_leaves(leaves.empty() ? triangles.size() : leaves.size());
        parallel_for(context, of_leaves.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Box one = leaf_box(leaf(static_cast<Index>(i)));
                of_leaves[i] = {one.min.cast<float>(), one.max.cast<float>()};
            }
        });
        boxes = BoxTree(of_leaves, context);
    }

    Vec3d to_local(const Vec3d& p) const { return (p - centre) * scale; }
    std::array<Vec3d, 3> corners(Index triangle) const {
        const auto& [a, b, c] = triangles[triangle];
        return {positions[a].cast<double>(), positions[b].cast<double>(), positions[c].cast<double>()};
    }

    Leaf leaf(Index i) const { return leaves.empty() ? Leaf{i} : leaves[i]; }

    /// Rounded to float: boxes of triangles that share a corner meet there.
    Vec3d local_corner(Index vertex) const {
        return to_local(positions[vertex].cast<double>()).cast<float>().cast<double>();
    }
    Box local_box(const Triangle& triangle) const {
        Box box;
        for (const Index vertex : triangle) box.extend(local_corner(vertex));
        return box;
    }

    /// How many boxes each triangle should have: several where it is much thinner than its own box, and the box not
    /// small. Queries would find hundreds of such needles in place of a few.
    std::vector<std::uint8_t> count_pieces(const RunContext& context) const {
        const double whole = half_surface(2 * Vec3d::Ones());
        std::vector<std::uint8_t> pieces(triangles.size(), 1);
        parallel_for(context, triangles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t t = begin; t < end; ++t) {
                const auto& [a, b, c] = triangles[t];
                const Vec3d p = local_corner(a);
                const Vec3d doubled_area = (local_corner(b) - p).cross(local_corner(c) - p);
                const double excess = half_surface(local_box(triangles[t]).size()) - kNeedle * doubled_area.norm();
                if (excess > 0) pieces[t] = std::uint8_t(std::max(1.0, kMostPieces * std::sqrt(excess / whole)));
            }
        });
        std::size_t more = 0;
        for (const std::uint8_t n : pieces) more += n - 1u;
        if (more > kMostMorePieces)
            for (std::uint8_t& n : pieces) n = std::uint8_t(1 + (n - 1) * kMostMorePieces / more);
        return pieces;
    }

    void make_leaves(const RunContext& context) {
        const std::vector<std::uint8_t> pieces = count_pieces(context);
        if (std::ranges::all_of(pieces, [](std::uint8_t n) { return n == 1; })) return;
        for (std::size_t t = 0; t < triangles.size(); ++t)
            for (std::uint8_t i = 0; i < pieces[t]; ++i) leaves.push_back({static_cast<Index>(t), i, pieces[t]});
    }

    Box leaf_box(const Leaf& leaf) const {
        const Triangle& triangle = triangles[leaf.triangle];
        const Box whole = local_box(triangle);
        return leaf.pieces == 1 ? whole : piece_box(triangle, whole, leaf);
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
            const Vec3d p = local_corner(triangle[k]);
            const Vec3d q = local_corner(triangle[(k + 1) % 3]);
            if (std::max(p[axis], q[axis]) < low || std::min(p[axis], q[axis]) > high) continue;
            for (const double at : {std::clamp(p[axis], low, high), std::clamp(q[axis], low, high)}) {
                const double t = p[axis] == q[axis] ? 0 : (at - p[axis]) / (q[axis] - p[axis]);
                box.extend(p + t * (q - p));
            }
            if (p[axis] == q[axis]) box.extend(q);
        }
        return box;
    }

    /// A query on its way through the tree.
    struct Search {
        const Tree& tree;
        Vec3d query, facing;
        double slack;
        Index triangle = kNoIndex;
        double distance = std::numeric_limits<double>::infinity();

        /// In the tree's units.
        float squared_radius() const {
            const double local =
                std::min(distance * tree.scale * (1 + kRadiusSlack) + slack, 10 * kFarthest); // reaches all
            return static_cast<float>(local * local);
        }

        void visit(Index candidate) {
            const std::array<Vec3d, 3> corners = tree.corners(candidate);
            if (!facing.isZero(0) && !((corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(facing) > 0))
                return;
            const double found = std::sqrt(closest_on_triangle(query, corners).squared_distance); // as it is returned
            if (!(found < distance || (found == distance && candidate < triangle))) return;
            distance = found;
            triangle = candidate;
        }
    };

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
        boxes.visit_near(local.cast<float>(), search.squared_radius(), [&](std::uint32_t item) {
            search.visit(leaf(item).triangle);
            return search.squared_radius();
        });
        if (search.triangle == kNoIndex) return {};
        const SurfacePoint found = surface_point(closest_on_triangle(query, corners(search.triangle)), search.triangle);
        return found.distance <= max_distance ? found : SurfacePoint{};
    }

    void visit_near(const Vec3d& at, double radius, const void* of, void (*visit)(const void*, Index)) const {
        const Vec3d local = to_local(at);
        const double reach = local.cwiseAbs().maxCoeff();
        const double wide = radius * scale * (1 + kRadiusSlack) + kRadiusSlack * (1 + reach);
        if (!(reach <= 1 + wide)) return; // it is that far from the box of all
        const auto squared = static_cast<float>(std::min(wide * wide, 100 * kFarthest * kFarthest));
        boxes.visit_near(local.cast<float>(), squared, [&](std::uint32_t item) {
            visit(of, leaf(item).triangle);
            return squared; // the radius stays
        });
    }
};

ClosestPointTree::ClosestPointTree(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                   const RunContext& context)
    : tree_(std::make_unique<Tree>(positions, triangles, context)) {}
ClosestPointTree::~ClosestPointTree() = default;
ClosestPointTree::ClosestPointTree(ClosestPointTree&&) noexcept = default;
ClosestPointTree& ClosestPointTree::operator=(ClosestPointTree&&) noexcept = default;

SurfacePoint ClosestPointTree::closest(const Vec3f& query, double max_distance, const Vec3f& facing) const {
    if (tree_->triangles.empty() || !(max_distance >= 0) || !query.allFinite()) return {};
    return tree_->closest(query.cast<double>(), max_distance, facing.cast<double>());
}

void ClosestPointTree::visit_near(const Vec3f& point, double radius, const void* of,
                                  void (*visit)(const void*, Index)) const {
    if (!tree_->triangles.empty() && radius >= 0 && point.allFinite())
        tree_->visit_near(point.cast<double>(), radius, of, visit);
}

} // namespace filigree
