// Based on: [Jacobson 2013], winding numbers of meshes that are not closed; [Barill 2018], a tree of dipoles with the
// first and second moments; [Van Oosterom 1983], the solid angle of a triangle.
#include "filigree/sample/winding_tree.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/sample/exact_sign.h"
#include "filigree/sample/wide_tree.h"
#include "filigree/sample/wide_tree_lanes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr std::size_t kWidth = WideTree::kWidth, kLeafSize = WideTree::kLeafSize;
constexpr std::uint32_t kLeaf = WideTree::kLeaf;
constexpr std::size_t kStackSize = (kWidth - 1) * WideTree::kDeepest + kWidth;

constexpr float kNearest = 1e-5f; // half sizes: nearer, the powers of the distance would leave the range of float
constexpr float kNowhere = 1e3f;  // half sizes: where the children that are not there are, of moments 0
constexpr double kFarthest = 1e6; // half sizes: beyond, nothing has a solid angle worth a float
constexpr double kPlane = 6e-15;  // as kSideError of inside_rays.cpp: closer to a triangle's plane, its side is exact
constexpr double kBeside = 1e-9;  // of a triangle's size: from where a point on a triangle's edge is looked at

/// Moments of the children about their centres, as the coefficients of 1, x, y, z, and of their products, of the unit
/// vector from the point to the centre: of the order 0 over r^2, 1 over r^3, 2 over r^4.
struct alignas(64) Node {
    float centre[3][kWidth];
    float squared_reach[kWidth]; ///< nearer than its root, a child is opened
    float dipole[3][kWidth];
    float quadrupole[6][kWidth]; ///< xx yy zz xy xz yz
    float octupole[10][kWidth];  ///< xxx yyy zzz xxy xxz xyy yyz xzz yzz xyz
    std::uint32_t child[kWidth];
};

/// Four triangles; where there are fewer, points at the first one's corner, which have no solid angle.
struct alignas(64) Leaf {
    float corner[3][3][kLeafSize]; ///< [corner][axis][triangle]
    Vec3d vertex(int k, int triangle) const {
        return {corner[k][0][triangle], corner[k][1][triangle], corner[k][2][triangle]};
    }
};

struct Tree {
    std::vector<Node> nodes;
    std::vector<Leaf> leaves;
    Vec3d centre = Vec3d::Zero();
    double inverse_half_size = 1;
    double nearness = 0; ///< what is not opened is at least this share of its centre's distance away
};

using Winding = WindingTree::NumberAndDistance;

// Making the tree.

/// Moments of some triangles, in half sizes of the mesh.
struct Moments {
    Vec3d centre = Vec3d::Zero();
    double radius = 0;
    Vec3d dipole = Vec3d::Zero();
    std::array<double, 6> quadrupole = {};
    std::array<double, 10> octupole = {};
};

using Corners = std::array<Vec3d, 3>;

template <class CornersOf>
Moments moments_of(std::span<const Index> triangles, const CornersOf& corners_of) {
    Moments m;
    double area = 0;
    Box box;
    for (const Index t : triangles) {
        const Corners p = corners_of(t);
        const double a = (p[1] - p[0]).cross(p[2] - p[0]).norm();
        area += a;
        m.centre += a / 3 * (p[0] + p[1] + p[2]);
        for (const Vec3d& x : p) box.extend(x);
    }
    m.centre = area > 0 ? Vec3d(m.centre / area) : box.centre();

    Mat3d first = Mat3d::Zero();         // of n (x) x over the triangles
    std::array<double, 10> product = {}; // of n x x, by the monomials of the octupole
    Vec3d trace = Vec3d::Zero();
    for (const Index t : triangles) {
        Corners p = corners_of(t);
        for (Vec3d& x : p) {
            x -= m.centre;
            m.radius = std::max(m.radius, x.norm());
        }
        const Vec3d n = 0.5 * (p[1] - p[0]).cross(p[2] - p[0]);
        m.dipole += n;
        first += n * ((p[0] + p[1] + p[2]) / 3).transpose();
        Mat3d s = Mat3d::Zero(); // the mean of x (x) x: exact from the middles of the sides
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d middle = 0.5 * (p[k] + p[(k + 1) % 3]);
            s += middle * middle.transpose() / 3;
        }
        product[0] += n[0] * s(0, 0);
        product[1] += n[1] * s(1, 1);
        product[2] += n[2] * s(2, 2);
        product[3] += n[1] * s(0, 0) + 2 * n[0] * s(0, 1);
        product[4] += n[2] * s(0, 0) + 2 * n[0] * s(0, 2);
        product[5] += n[0] * s(1, 1) + 2 * n[1] * s(0, 1);
        product[6] += n[2] * s(1, 1) + 2 * n[1] * s(1, 2);
        product[7] += n[0] * s(2, 2) + 2 * n[2] * s(0, 2);
        product[8] += n[1] * s(2, 2) + 2 * n[2] * s(1, 2);
        product[9] += 2 * (n[0] * s(1, 2) + n[1] * s(0, 2) + n[2] * s(0, 1));
        trace += 2 * s * n + s.trace() * n;
    }
    // Derivatives of x / |x|^3; the terms with a trace get the factor x x + y y + z z = 1.
    m.quadrupole = {first.trace() - 3 * first(0, 0),  first.trace() - 3 * first(1, 1),
                    first.trace() - 3 * first(2, 2),  -3 * (first(0, 1) + first(1, 0)),
                    -3 * (first(0, 2) + first(2, 0)), -3 * (first(1, 2) + first(2, 1))};
    constexpr int kTraceAxis[9] = {0, 1, 2, 1, 2, 0, 2, 0, 1};
    for (std::size_t i = 0; i < 10; ++i) {
        m.octupole[i] = 7.5 * product[i];
        if (i < 9) m.octupole[i] -= 1.5 * trace[kTraceAxis[i]];
    }
    return m;
}

void set_child(Node& node, std::size_t c, const Moments& m, double beta) {
    const double scale = 1 / (4 * std::numbers::pi);
    for (int i = 0; i < 3; ++i) {
        node.centre[i][c] = static_cast<float>(m.centre[i]);
        node.dipole[i][c] = static_cast<float>(scale * m.dipole[i]);
    }
    node.squared_reach[c] = static_cast<float>(math::pow(std::max(beta * m.radius, double{kNearest}), 2));
    for (std::size_t i = 0; i < 6; ++i) node.quadrupole[i][c] = static_cast<float>(scale * m.quadrupole[i]);
    for (std::size_t i = 0; i < 10; ++i) node.octupole[i][c] = static_cast<float>(scale * m.octupole[i]);
}

/// How many radii away a node's moments stand for it. Largest errors measured on the dragon with holes and turned
/// triangles go down as beta^-4.35; with this they are about a third of `accuracy`.
double beta_of(double accuracy) { return 1.2 * math::pow(0.1 / std::clamp(accuracy, 1e-4, 0.1), 0.24); }

/// Empty when there is no triangle, or when cancelled.
Tree make_tree(std::span<const Vec3f> positions, std::span<const Triangle> triangles, double accuracy,
               const RunContext& context) {
    Tree tree;
    if (triangles.empty()) return tree;
    Box box;
    for (const Triangle& t : triangles)
        for (const Index v : t) box.extend(positions[v].cast<double>());
    tree.centre = box.centre();
    const double half_size = 0.5 * box.size().maxCoeff();
    tree.inverse_half_size = half_size > 0 ? 1 / half_size : 1;
    const double beta = beta_of(accuracy);
    tree.nearness = 1 - 1 / beta;

    const auto corners_of = [&](Index t) {
        Corners p;
        for (std::size_t k = 0; k < 3; ++k)
            p[k] = (positions[triangles[t][k]].cast<double>() - tree.centre) * tree.inverse_half_size;
        return p;
    };
    std::vector<FlatBox> boxes(triangles.size());
    parallel_for(context, triangles.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t)
            for (const Vec3d& x : corners_of(static_cast<Index>(t))) {
                const Vec3f p = x.cast<float>();
                boxes[t].extend({{p[0], p[1], p[2]}, {p[0], p[1], p[2]}});
            }
    });
    const auto shape = make_wide_tree(boxes, context);
    if (!shape) return tree;

    const auto fill_leaf = [&](Leaf& leaf, std::span<const Index> of_leaf) {
        for (std::size_t lane = 0; lane < kLeafSize; ++lane)
            for (std::size_t k = 0; k < 3; ++k) {
                const bool there = lane < of_leaf.size();
                const Vec3f& p = positions[triangles[of_leaf[there ? lane : 0]][there ? k : 0]];
                for (int axis = 0; axis < 3; ++axis) leaf.corner[k][axis][lane] = p[axis];
            }
    };
    std::vector<Node> nodes(shape->nodes.size());
    tree.leaves.resize(shape->leaf_count);
    parallel_for(context, nodes.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end && !context.is_cancelled(); ++n) {
            nodes[n] = {};
            for (std::size_t c = 0; c < kWidth; ++c) {
                nodes[n].centre[0][c] = kNowhere;
                if (c >= shape->nodes[n].count) continue;
                const WideTree::Child& child = shape->nodes[n].children[c];
                const auto part = std::span(shape->order).subspan(child.begin, child.end - child.begin);
                set_child(nodes[n], c, moments_of(part, corners_of), beta);
                nodes[n].child[c] = child.id;
                if (child.id & kLeaf) fill_leaf(tree.leaves[child.id & ~kLeaf], part);
            }
        }
    });
    if (!context.is_cancelled()) tree.nodes = std::move(nodes);
    return tree;
}

// Asking it.

/// By Newton steps, each of which doubles the digits.
FILIGREE_INLINE Double4 square_root(Double4 x) {
    Double4 y = (Double4)(0x5fe6eb50c7b537a9 - ((Long4)x >> 1));
    for (int step = 0; step < 4; ++step) y = y * (1.5 - 0.5 * x * y * y);
    return x * y;
}

/// Angle of (x, y), y >= 0, from 0 to pi; to 2e-10. Its arc tangent series is used up to pi / 8.
FILIGREE_INLINE Double4 angle(Double4 y, Double4 x) {
    const Double4 across = absolute(x);
    const Double4 low = smaller(y, across), high = larger(y, across);
    const Long4 steep = low > 0.41421356237309503 * high;
    const Double4 above = steep ? low - high : low, below = steep ? low + high : high;
    const Double4 t = above / (below + 1e-300);
    const Double4 square = t * t;
    Double4 series = Double4{} + 1.0 / 21;
    for (int k = 19; k > 0; k -= 2) series = 1.0 / k - square * series;
    Double4 result = t * series;
    result = steep ? result + std::numbers::pi / 4 : result;
    result = y > across ? std::numbers::pi / 2 - result : result;
    return x < 0 ? std::numbers::pi - result : result;
}

/// Half the solid angle of a triangle whose plane the point is in, to rounding: its side is found exactly, and on an
/// edge the point is looked at from beside it, where the same rule has moved it.
double half_angle_in_plane(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& point) {
    const int side = -exact::orient3d_perturbed(a, b, c, point);
    if (side == 0) return 0;
    Corners p = {a - point, b - point, c - point};
    double size = 0;
    for (const Vec3d& x : p) size = std::max(size, x.cwiseAbs().maxCoeff());
    for (Vec3d& x : p) x -= kBeside * size * Vec3d(1, 1e-3, 1e-6);
    const double la = p[0].norm(), lb = p[1].norm(), lc = p[2].norm();
    const double along = la * lb * lc + p[0].dot(p[1]) * lc + p[1].dot(p[2]) * la + p[2].dot(p[0]) * lb;
    return side * math::atan2(std::abs(p[0].dot(p[1].cross(p[2]))), along);
}

/// Sum of half the solid angles. `nearest`: made less where a triangle's box is nearer.
template <bool Avx2, bool Distance>
FILIGREE_INLINE double half_angles(const Leaf& leaf, const Vec3d& point, double& nearest) {
    Double4 a[3], b[3], c[3], size = {}, squared_distance = {};
    for (int i = 0; i < 3; ++i) {
        a[i] = load4(leaf.corner[0][i]) - point[i];
        b[i] = load4(leaf.corner[1][i]) - point[i];
        c[i] = load4(leaf.corner[2][i]) - point[i];
        size = larger(size, larger(absolute(a[i]), larger(absolute(b[i]), absolute(c[i]))));
        if constexpr (Distance) {
            const Double4 low = smaller(a[i], smaller(b[i], c[i])), high = larger(a[i], larger(b[i], c[i]));
            const Double4 outside = larger(larger(low, -high), Double4{});
            squared_distance += outside * outside;
        }
    }
    if constexpr (Distance)
        for (int lane = 0; lane < 4; ++lane) nearest = std::min(nearest, squared_distance[lane]);

    const auto dot = [](const Double4* u, const Double4* v) __attribute__((always_inline)) {
        return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    };
    const Double4 across =
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    const Double4 la = square_root(dot(a, a)), lb = square_root(dot(b, b)), lc = square_root(dot(c, c));
    const Double4 along = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    Double4 half = angle(absolute(across), along);
    half = across < 0 ? -half : half;

    const Double4 volume = size * size * size;
    const Long4 in_plane = (absolute(across) <= kPlane * volume) & (along < 1e-6 * volume);
    for (unsigned lanes = lane_bits<Avx2>(in_plane); lanes != 0; lanes &= lanes - 1) {
        const int lane = std::countr_zero(lanes);
        half[lane] = half_angle_in_plane(leaf.vertex(0, lane), leaf.vertex(1, lane), leaf.vertex(2, lane), point);
    }
    return (half[0] + half[1]) + (half[2] + half[3]);
}

template <bool Avx2, bool Distance>
FILIGREE_INLINE Winding winding_of(const Tree& tree, const Vec3d& point) {
    const Vec3d place = (point - tree.centre) * tree.inverse_half_size;
    const double farness = place.cwiseAbs().maxCoeff();
    if (tree.nodes.empty() || !(farness < kFarthest)) return {0, farness};
    const float x = static_cast<float>(place[0]), y = static_cast<float>(place[1]), z = static_cast<float>(place[2]);

    Float8 far_sum = {}, far_nearest = Float8{} + 1e30f;
    double half_angle = 0, near_nearest = 1e300;
    std::uint32_t stack[kStackSize];
    std::size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const std::uint32_t id = stack[--top];
        if (id & kLeaf) {
            half_angle += half_angles<Avx2, Distance>(tree.leaves[id & ~kLeaf], point, near_nearest);
            continue;
        }
        const Node& n = tree.nodes[id];
        Float8 u = load8(n.centre[0]) - x, v = load8(n.centre[1]) - y, w = load8(n.centre[2]) - z;
        const Float8 squared = u * u + v * v + w * w;
        const Int8 is_far = squared > load8(n.squared_reach);
        const Float8 inverse = inverse_sqrt(squared);
        u *= inverse, v *= inverse, w *= inverse;
        const Float8 uu = u * u, vv = v * v, ww = w * w, uv = u * v, uw = u * w, vw = v * w;
        const Float8 dipole = load8(n.dipole[0]) * u + load8(n.dipole[1]) * v + load8(n.dipole[2]) * w;
        const Float8 quadrupole = load8(n.quadrupole[0]) * uu + load8(n.quadrupole[1]) * vv +
                                  load8(n.quadrupole[2]) * ww + load8(n.quadrupole[3]) * uv +
                                  load8(n.quadrupole[4]) * uw + load8(n.quadrupole[5]) * vw;
        const Float8 octupole =
            u * (load8(n.octupole[0]) * uu + load8(n.octupole[5]) * vv + load8(n.octupole[7]) * ww +
                 load8(n.octupole[9]) * vw) +
            v * (load8(n.octupole[1]) * vv + load8(n.octupole[3]) * uu + load8(n.octupole[8]) * ww) +
            w * (load8(n.octupole[2]) * ww + load8(n.octupole[4]) * uu + load8(n.octupole[6]) * vv);
        const Float8 number = inverse * inverse * (dipole + inverse * (quadrupole + inverse * octupole));
        far_sum += is_far ? number : Float8{};
        if constexpr (Distance) {
            const Float8 passed = is_far ? squared : far_nearest;
            far_nearest = passed < far_nearest ? passed : far_nearest;
        }
        for (unsigned near = ~lane_bits<Avx2>(is_far) & 0xff; near != 0; near &= near - 1) {
            const std::uint32_t child = n.child[std::countr_zero(near)];
            if (child & kLeaf)
                prefetch(tree.leaves[child & ~kLeaf]);
            else
                prefetch(tree.nodes[child]);
            stack[top++] = child;
        }
    }
    double number = half_angle / (2 * std::numbers::pi), squared_distance = 1e300;
    for (int lane = 0; lane < 8; ++lane) {
        number += double{far_sum[lane]};
        squared_distance = std::min(squared_distance, double{far_nearest[lane]});
    }
    const double near_distance = std::sqrt(near_nearest) * tree.inverse_half_size;
    return {number, std::min(near_distance, tree.nearness * std::sqrt(squared_distance))};
}

using WindingFunction = Winding (*)(const Tree&, const Vec3d&);

#if defined(FILIGREE_HAS_WIDTHS)
FILIGREE_AVX2 Winding winding_avx2(const Tree& tree, const Vec3d& point) {
    return winding_of<true, false>(tree, point);
}
FILIGREE_AVX2 Winding winding_and_distance_avx2(const Tree& tree, const Vec3d& point) {
    return winding_of<true, true>(tree, point);
}
#endif
Winding winding_plain(const Tree& tree, const Vec3d& point) { return winding_of<false, false>(tree, point); }
Winding winding_and_distance_plain(const Tree& tree, const Vec3d& point) {
    return winding_of<false, true>(tree, point);
}

/// What the tree answers, by the widest vectors. A struct of its own: GCC 13 and 14 crash where a class with a linkage
/// has such pointers as members, and several sources are compiled as one.
struct Answers {
    WindingFunction number = winding_plain, number_and_distance = winding_and_distance_plain;
};
Answers widest_answers() {
#if defined(FILIGREE_HAS_WIDTHS)
    if (widest_vectors() >= VectorWidth::bytes32) return {winding_avx2, winding_and_distance_avx2};
#endif
    return {};
}

} // namespace

struct WindingTree::Content {
    Tree tree;
    Answers answers = widest_answers();
};

WindingTree::WindingTree(std::unique_ptr<Content> content) : content_(std::move(content)) {}
WindingTree::WindingTree(WindingTree&&) noexcept = default;
WindingTree& WindingTree::operator=(WindingTree&&) noexcept = default;
WindingTree::~WindingTree() = default;

Result<WindingTree> WindingTree::create(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                        double accuracy, const RunContext& context) {
    Tree tree = make_tree(positions, triangles, accuracy, context);
    if (context.is_cancelled()) return cancelled_error();
    return WindingTree(std::make_unique<Content>(Content{std::move(tree)}));
}

double WindingTree::inverse_half_size() const { return content_->tree.inverse_half_size; }

WindingTree::NumberAndDistance WindingTree::winding_and_distance(const Vec3d& point) const {
    return content_->answers.number_and_distance(content_->tree, point);
}

double WindingTree::winding(const Vec3d& point) const { return content_->answers.number(content_->tree, point).number; }

Result<std::vector<float>> WindingTree::winding(std::span<const Vec3d> points, const RunContext& context) const {
    constexpr std::size_t kPiece = 1024, kBetweenLooks = 64, kBetweenReports = std::size_t{1} << 18;
    std::vector<float> numbers(points.size());
    for (std::size_t first = 0; first < points.size(); first += kBetweenReports) {
        context.report("winding", static_cast<double>(first) / static_cast<double>(points.size()));
        const std::size_t count = std::min(kBetweenReports, points.size() - first);
        parallel_for(context, count, kPiece, [&](std::size_t begin, std::size_t end) {
            if (context.is_cancelled()) return;
            for (std::size_t i = first + begin; i < first + end; ++i) {
                if (i % kBetweenLooks == 0 && context.is_cancelled()) return;
                numbers[i] = static_cast<float>(winding(points[i]));
            }
        });
        if (context.is_cancelled()) return cancelled_error();
    }
    return numbers;
}

} // namespace filigree
