// Based on: the report, 2.2 (plane and side tests, parity), with exact signs instead of its list of cases; binned
// surface area heuristic and eight-wide nodes after [Wald 2014].
//
// A node tests eight boxes at once in floats. Boxes are kept in units of half the mesh's size, around its centre, and
// are widened by more than the test can err, so it never loses a triangle. A leaf tests four triangles at once in
// doubles with a bound on the error; what the bound leaves open is decided exactly.
#include "filigree/sample/inside_rays.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/sample/wide_tree.h"
#include "filigree/sample/wide_tree_lanes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <mutex>

namespace filigree {

namespace {

// In units of 2^-24: rounding of the point (1), of the box (2), of their difference (2), and of the inverse direction
// and the product (4 relative to at most 2 half sizes) move a plane by less than 13.
constexpr float kWiden = 0x1p-20f;
constexpr double kLongest = 4;         // of a ray, in half sizes: leaves the box from anywhere inside
constexpr double kLeastStep = 0x1p-40; // of a direction's component: moves a ray's end by less than rounding does

// Each side test is the sum of six products of three differences with a relative error below 8 * 2^-53.
constexpr double kSideError = 6e-15;
constexpr double kRayUnderflow = 0x1p-1060; // see exact_sign.cpp

constexpr std::uint32_t kRayLeaf = WideTree::kLeaf;
constexpr std::size_t kRayLeafSize = WideTree::kLeafSize, kRayWidth = WideTree::kWidth;
constexpr std::size_t kWaiting = 32; // leaves found before they are tested
constexpr std::size_t kRaysBetweenLooks =
    64; // points from one look at `cancel` to the next: each may take a millisecond
constexpr std::size_t kRayStackSize = (kRayWidth - 1) * WideTree::kDeepest + kRayWidth;

struct alignas(64) RayNode {
    float lo[3][kRayWidth], hi[3][kRayWidth];
    std::uint32_t child[kRayWidth]; ///< of nodes; with kRayLeaf, of leaves
};

struct alignas(64) RayLeaf {
    float corner[3][3][kRayLeafSize]; ///< [corner][axis][triangle]
    float eye_side[kRayLeafSize];     ///< orient3d(a, b, c, eye); 0 also where there is no triangle
    std::uint32_t count;

    Vec3d vertex(int k, int triangle) const {
        return {corner[k][0][triangle], corner[k][1][triangle], corner[k][2][triangle]};
    }
};

struct RayTree {
    std::vector<RayNode> nodes; ///< the first is the root
    std::vector<RayLeaf> leaves;
    Vec3d eye;
    std::int64_t eye_winding = 0; ///< of the mesh around the eye
    bool eye_inside = false;
    Vec3d lowest, highest, centre;
    double inverse_half_size = 1;
    void (*count_crossings)(const RayTree&, const Vec3d&, RayParity::Count&) = nullptr;
};

/// Nodes and leaves as queries read them.
void fill(RayTree& tree, const WideTree& shape, std::span<const Vec3f> positions, std::span<const Triangle> triangles,
          std::span<const std::int8_t> eye_side, const RunContext& context) {
    tree.nodes.resize(shape.nodes.size());
    tree.leaves.resize(shape.leaf_count);
    const auto fill_leaf = [&](RayLeaf& leaf, std::span<const Index> of_leaf) {
        leaf = {};
        leaf.count = static_cast<std::uint32_t>(of_leaf.size());
        for (std::size_t lane = 0; lane < of_leaf.size(); ++lane) {
            const Triangle& triangle = triangles[of_leaf[lane]];
            for (std::size_t k = 0; k < 3; ++k)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    leaf.corner[k][axis][lane] = positions[triangle[k]][static_cast<Eigen::Index>(axis)];
            leaf.eye_side[lane] = static_cast<float>(eye_side[of_leaf[lane]]);
        }
    };
    parallel_for(context, shape.nodes.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n)
            for (std::size_t c = 0; c < kRayWidth; ++c) {
                const WideTree::Child& child = shape.nodes[n].children[c]; // an empty box is never entered
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    tree.nodes[n].lo[axis][c] = child.box.lo[axis];
                    tree.nodes[n].hi[axis][c] = child.box.hi[axis];
                }
                tree.nodes[n].child[c] = child.id;
                if (child.id & kRayLeaf)
                    fill_leaf(tree.leaves[child.id & ~kRayLeaf],
                              std::span(shape.order).subspan(child.begin, child.end - child.begin));
            }
    });
}

/// The segment from the point towards the eye as the boxes are tested with it: near and far are rows of RayNode::lo,
/// hi.
struct Ray {
    float origin[3], inverse[3];
    int near[3], far[3];
};

Ray make_ray(const RayTree& tree, const Vec3d& point) {
    const Vec3d from = (point - tree.centre) * tree.inverse_half_size;
    Vec3d step = (tree.eye - point) * tree.inverse_half_size;
    const double length = step.cwiseAbs().maxCoeff();
    if (length > kLongest) step *= kLongest / length;
    Ray ray;
    for (int i = 0; i < 3; ++i) {
        const double component = std::abs(step[i]) < kLeastStep ? std::copysign(kLeastStep, step[i]) : step[i];
        ray.origin[i] = static_cast<float>(from[i]);
        ray.inverse[i] = static_cast<float>(1 / component);
        ray.near[i] = component > 0 ? i : 3 + i;
        ray.far[i] = component > 0 ? 3 + i : i;
    }
    return ray;
}

/// A bit for each child whose box the ray meets.
template <bool Avx2>
FILIGREE_INLINE unsigned children_met(const RayNode& node, const Ray& ray) {
    const float(*rows)[kRayWidth] = node.lo; // hi follows
    Float8 enter = {}, leave = Float8{} + 1;
    for (int i = 0; i < 3; ++i) {
        const Float8 to_near = (load8(rows[ray.near[i]]) - ray.origin[i]) * ray.inverse[i];
        const Float8 to_far = (load8(rows[ray.far[i]]) - ray.origin[i]) * ray.inverse[i];
        enter = to_near > enter ? to_near : enter;
        leave = to_far < leave ? to_far : leave;
    }
    return lane_bits<Avx2>(Int8(enter <= leave));
}

bool crosses_exactly(const RayLeaf& leaf, int triangle, const Vec3d& eye, const Vec3d& point, exact::Tally& tally) {
    const Vec3d a = leaf.vertex(0, triangle), b = leaf.vertex(1, triangle), c = leaf.vertex(2, triangle);
    const int side = exact::orient3d_perturbed(eye, a, b, point, &tally);
    return exact::orient3d_perturbed(eye, b, c, point, &tally) == side &&
           exact::orient3d_perturbed(eye, c, a, point, &tally) == side &&
           exact::orient3d_perturbed(a, b, c, point, &tally) != static_cast<int>(leaf.eye_side[triangle]);
}

template <bool Avx2>
FILIGREE_INLINE void count_leaf(const RayLeaf& leaf, const Vec3d& eye, const Vec3d& point, const Vec3d& to_eye,
                                double longest_step, RayParity::Count& count) {
    Double4 a[3], b[3], c[3], size = {};
    for (int i = 0; i < 3; ++i) {
        a[i] = load4(leaf.corner[0][i]) - point[i];
        b[i] = load4(leaf.corner[1][i]) - point[i];
        c[i] = load4(leaf.corner[2][i]) - point[i];
        size = larger(size, larger(absolute(a[i]), larger(absolute(b[i]), absolute(c[i]))));
    }
    const Double4 bound = kSideError * longest_step * size * size + kRayUnderflow;
    // Sides of the planes through the ray's ends and each edge: to_eye . (a x b), (b x c), (c x a).
    const Double4 eye_a[3] = {to_eye[1] * a[2] - to_eye[2] * a[1], to_eye[2] * a[0] - to_eye[0] * a[2],
                              to_eye[0] * a[1] - to_eye[1] * a[0]};
    const Double4 eye_b[3] = {to_eye[1] * b[2] - to_eye[2] * b[1], to_eye[2] * b[0] - to_eye[0] * b[2],
                              to_eye[0] * b[1] - to_eye[1] * b[0]};
    const Double4 ab = eye_a[0] * b[0] + eye_a[1] * b[1] + eye_a[2] * b[2];
    const Double4 bc = eye_b[0] * c[0] + eye_b[1] * c[1] + eye_b[2] * c[2];
    const Double4 ca = -(eye_a[0] * c[0] + eye_a[1] * c[1] + eye_a[2] * c[2]);

    const Double4 eye_side = load4(leaf.eye_side);
    const Long4 some_left = (ab > bound) | (bc > bound) | (ca > bound);
    const Long4 some_right = (ab < -bound) | (bc < -bound) | (ca < -bound);
    const Long4 possible = ~(some_left & some_right) & (eye_side != 0);
    if (lane_bits<Avx2>(possible) == 0) return;

    const Long4 all_left = (ab > bound) & (bc > bound) & (ca > bound);
    const Long4 all_right = (ab < -bound) & (bc < -bound) & (ca < -bound);
    const Double4 across = eye_side * (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                                       a[2] * (b[0] * c[1] - b[1] * c[0]));
    const Double4 across_bound = kSideError * size * size * size + kRayUnderflow;
    const Long4 beyond = across > across_bound, before = across < -across_bound;
    const Long4 crossed = possible & (all_left | all_right) & beyond;
    const Long4 open = possible & ~((all_left | all_right) & beyond) & ~before;
    const auto add = [&](unsigned lanes, unsigned seen_from_front) __attribute__((always_inline)) {
        const int all = std::popcount(lanes);
        count.crossings += static_cast<std::uint64_t>(all);
        count.net += 2 * std::popcount(lanes & seen_from_front) - all;
    };
    const Long4 in_front = eye_side > 0;
    const unsigned seen_from_front = lane_bits<Avx2>(in_front);
    add(lane_bits<Avx2>(crossed), seen_from_front);
    for (unsigned lanes = lane_bits<Avx2>(open); lanes != 0; lanes &= lanes - 1)
        if (crosses_exactly(leaf, std::countr_zero(lanes), eye, point, count.tally))
            add(lanes & -lanes, seen_from_front);
}

template <bool Avx2>
FILIGREE_INLINE void count_crossings(const RayTree& tree, const Vec3d& point, RayParity::Count& count) {
    const Ray ray = make_ray(tree, point);
    const Vec3d to_eye = tree.eye - point;
    const double longest_step = to_eye.cwiseAbs().maxCoeff();
    // Leaves wait until the memory they were asked from has answered: that, not arithmetic, is what a query waits for.
    std::uint32_t stack[kRayStackSize], leaves[kWaiting + kRayWidth];
    std::size_t top = 0, waiting = 0;
    stack[top++] = 0;
    while (top > 0) {
        const RayNode& node = tree.nodes[stack[--top]];
        for (unsigned met = children_met<Avx2>(node, ray); met != 0; met &= met - 1) {
            const std::uint32_t child = node.child[std::countr_zero(met)];
            if (child & kRayLeaf) {
                prefetch(tree.leaves[child & ~kRayLeaf]);
                leaves[waiting++] = child & ~kRayLeaf;
            } else {
                prefetch(tree.nodes[child]);
                stack[top++] = child;
            }
        }
        if (waiting < kWaiting && top > 0) continue;
        for (std::size_t i = 0; i < waiting; ++i) {
            const RayLeaf& leaf = tree.leaves[leaves[i]];
            count.triangles_tested += leaf.count;
            count_leaf<Avx2>(leaf, tree.eye, point, to_eye, longest_step, count);
        }
        waiting = 0;
    }
}

#if defined(FILIGREE_HAS_WIDTHS)
FILIGREE_AVX2 void count_crossings_avx2(const RayTree& tree, const Vec3d& point, RayParity::Count& count) {
    count_crossings<true>(tree, point, count);
}
#endif
void count_crossings_plain(const RayTree& tree, const Vec3d& point, RayParity::Count& count) {
    count_crossings<false>(tree, point, count);
}

auto counting_function() {
#if defined(FILIGREE_HAS_WIDTHS)
    if (widest_vectors() >= VectorWidth::bytes32) return count_crossings_avx2;
#endif
    return count_crossings_plain;
}

/// Whether the eye, which is in the triangle's plane, lies in the triangle or on its border.
bool is_in_triangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& eye) {
    const std::array<int, 3> normal = exact::normal_signs(a, b, c);
    for (int axis = 0; axis < 3; ++axis) {
        const int facing = normal[static_cast<std::size_t>(axis)];
        if (facing == 0) continue;
        const auto flat = [&](const Vec3d& p) { return std::array{p[(axis + 1) % 3], p[(axis + 2) % 3]}; };
        const auto is_outside = [&](const Vec3d& from, const Vec3d& to) {
            return exact::orient2d(flat(from), flat(to), flat(eye)) == -facing;
        };
        return !is_outside(a, b) && !is_outside(b, c) && !is_outside(c, a);
    }
    return false; // without area; where it belongs to a closed surface, others lie there as well
}

} // namespace

struct RayParity::Content : RayTree {};

RayParity::RayParity(std::unique_ptr<Content> content) : content_(std::move(content)) {}
RayParity::RayParity(RayParity&&) noexcept = default;
RayParity& RayParity::operator=(RayParity&&) noexcept = default;
RayParity::~RayParity() = default;

Result<RayParity> RayParity::create(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                    const std::optional<Vec3d>& eye, const RunContext& context) {
    if (triangles.empty()) return Error{ErrorCode::unsuitable, "The mesh has no triangles, so nothing is inside it."};
    auto content = std::make_unique<Content>();
    Box box;
    for (const Triangle& t : triangles)
        for (const Index v : t) box.extend(positions[v].cast<double>());
    content->lowest = box.min;
    content->highest = box.max;
    content->centre = box.centre();
    const double half_size = 0.5 * box.size().maxCoeff();
    content->inverse_half_size = half_size > 0 ? 1 / half_size : 1;
    content->count_crossings = counting_function();

    // Towards no direction that meshes favour, in coordinates of few digits so that ties can be decided in integers.
    if (eye)
        content->eye = *eye;
    else {
        const double unit = math::exp2(std::ceil(math::log2(half_size > 0 ? half_size : 1)) - 8);
        const Vec3d wanted = content->centre + half_size * Vec3d(2.417, 3.731, 1.183);
        content->eye = (wanted / unit).array().round() * unit;
    }
    const Vec3d& e = content->eye;
    for (const double x : e)
        if (!(std::abs(x) <= 0x1p300) || (x != 0 && std::abs(x) < 0x1p-300))
            return Error{ErrorCode::unsuitable,
                         "The eye's coordinates must be numbers that are 0 or from 2^-300 to 2^300 in size."};

    // On which side of each triangle the eye is, once; whether it is on the surface or inside.
    const bool is_within_box = (e.array() >= box.min.array()).all() && (e.array() <= box.max.array()).all();
    std::vector<std::int8_t> eye_side(triangles.size());
    std::vector<FlatBox> boxes(triangles.size());
    std::atomic<bool> is_on_surface = false;
    std::atomic<std::uint64_t> crossings = 0;
    std::atomic<std::int64_t> winding = 0;
    parallel_for(context, triangles.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
        std::uint64_t crossed = 0;
        std::int64_t net = 0;
        for (std::size_t t = begin; t < end; ++t) {
            std::array<Vec3d, 3> p;
            for (std::size_t k = 0; k < 3; ++k) {
                p[k] = positions[triangles[t][k]].cast<double>();
                const Vec3f place = ((p[k] - content->centre) * content->inverse_half_size).cast<float>();
                boxes[t].extend({{place[0] - kWiden, place[1] - kWiden, place[2] - kWiden},
                                 {place[0] + kWiden, place[1] + kWiden, place[2] + kWiden}});
            }
            eye_side[t] = static_cast<std::int8_t>(exact::orient3d(p[0], p[1], p[2], e));
            if (!is_within_box) continue;
            if (eye_side[t] == 0 && is_in_triangle(p[0], p[1], p[2], e)) is_on_surface = true;
            const int crossing = exact::crosses_along_x(p[0], p[1], p[2], e);
            crossed += crossing != 0;
            net += crossing;
        }
        crossings += crossed;
        winding += net;
    });
    if (is_on_surface)
        return Error{ErrorCode::unsuitable,
                     "The eye lies on the surface, so it is neither inside nor outside; move it a little."};
    content->eye_inside = crossings % 2 == 1;
    content->eye_winding = winding;

    const auto shape = make_wide_tree(boxes, context);
    if (!shape) return shape.error();
    fill(*content, *shape, positions, triangles, eye_side, context);
    if (context.is_cancelled()) return cancelled_error();
    return RayParity(std::move(content));
}

RayParity::Crossings RayParity::crossings(const Vec3d& point, Count* count) const {
    // Beyond the box there is nothing; as the point counts as moved up, nothing begins at the highest coordinate
    // either.
    const auto p = point.array();
    if (!((p >= content_->lowest.array()).all() && (p < content_->highest.array()).all())) return {};
    Count own;
    content_->count_crossings(*content_, point, own);
    if (count) {
        count->crossings += own.crossings;
        count->triangles_tested += own.triangles_tested;
        count->tally.integers += own.tally.integers;
        count->tally.expansions += own.tally.expansions;
    }
    return {(own.crossings % 2 == 1) != content_->eye_inside, content_->eye_winding + own.net};
}

Result<std::vector<std::uint8_t>> RayParity::contains(std::span<const Vec3d> points, const RunContext& context,
                                                      Count* count, bool merged) const {
    constexpr std::size_t kPiece = 1024, kBetweenReports = std::size_t{1} << 18;
    std::vector<std::uint8_t> inside(points.size());
    std::mutex adding;
    for (std::size_t first = 0; first < points.size(); first += kBetweenReports) {
        context.report("inside", static_cast<double>(first) / static_cast<double>(points.size()));
        const std::size_t pieces = std::min(kBetweenReports, points.size() - first);
        parallel_for(context, pieces, kPiece, [&](std::size_t begin, std::size_t end) {
            if (context.is_cancelled()) return;
            Count own;
            for (std::size_t i = first + begin; i < first + end; ++i) {
                if (i % kRaysBetweenLooks == 0 && context.is_cancelled()) return;
                const Crossings found = crossings(points[i], &own);
                inside[i] = merged ? found.winding >= 1 : found.is_odd;
            }
            if (!count) return;
            const std::lock_guard lock(adding);
            count->crossings += own.crossings;
            count->triangles_tested += own.triangles_tested;
            count->tally.integers += own.tally.integers;
            count->tally.expansions += own.tally.expansions;
        });
        if (context.is_cancelled()) return cancelled_error();
    }
    return inside;
}

const Vec3d& RayParity::eye() const { return content_->eye; }

} // namespace filigree
