// Based on:
//   [Gibson 1998], surface nets: the vertices of the voxels' border are smoothed, each within a box of its own, so that
//   steps go and thin parts stay. Ours start at the voxels' corners.
// A triangle is cut to each row of voxels that it crosses; the interval left along the row touches those voxels which
// the separating axes of triangle and voxel would find, at the cost of rows instead of voxels.
#include "filigree/remesh/voxel_wrap.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/lists.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/remesh/manifold_surface.h"
#include "filigree/remesh/voxel_grid.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

namespace filigree {
namespace {

constexpr std::uint8_t kMostCrossings = 16;
constexpr double kNeedleLength = 8, kNeedleWidth = 0.5; // voxels: longer and thinner, a triangle is a needle
constexpr std::size_t kSlab = 8;                        // layers of voxels a piece; even, as blocks must not be shared
constexpr std::size_t kVoxelWrapGrain = 2048;           // vertices or triangles a piece
constexpr double kTouch = 1e-9;                         // voxels: what is closer than this touches
constexpr int kSmoothRounds = 6;
constexpr double kFreedom = 0.45; // voxels that smoothing moves a vertex along each axis: sides never meet
constexpr int kPullRounds = 3;
constexpr double kProbe = 1.5;          // voxels below the surface that are looked at to see whether a part is thin
constexpr double kShell = 0.2;          // voxels between a sheet and each side of the shell around it
constexpr int kHalvings = 5;            // of a step that turns a triangle over, before it is not made at all
constexpr double kMostTurn = 0.3;       // cosine: further than this no triangle turns in a step
constexpr double kLeastWrapArea = 1e-4; // voxels squared, twice the area: smaller, a triangle only grows

// ---- Touched voxels

/// A triangle cut by planes: convex, at most one corner more for each.
struct Polygon {
    std::array<Vec3d, 8> corners;
    int count = 0;

    double lowest(int axis) const {
        double low = corners[0][axis];
        for (int k = 1; k < count; ++k) low = std::min(low, corners[k][axis]);
        return low;
    }
    double highest(int axis) const {
        double high = corners[0][axis];
        for (int k = 1; k < count; ++k) high = std::max(high, corners[k][axis]);
        return high;
    }
};

/// What of the polygon lies where sign * (coordinate - at) >= 0.
Polygon cut(const Polygon& polygon, int axis, double at, double sign) {
    Polygon result;
    for (int k = 0; k < polygon.count; ++k) {
        const Vec3d &p = polygon.corners[k], &q = polygon.corners[(k + 1) % polygon.count];
        const double dp = sign * (p[axis] - at), dq = sign * (q[axis] - at);
        if (dp >= 0) result.corners[result.count++] = p;
        if ((dp < 0) != (dq < 0)) result.corners[result.count++] = p + dp / (dp - dq) * (q - p);
    }
    return result;
}

Polygon cut_to_layer(const Polygon& polygon, int axis, int layer) {
    return cut(cut(polygon, axis, layer - kTouch, 1), axis, layer + 1 + kTouch, -1);
}

/// The layers that the polygon reaches into, of those from low to high.
std::pair<int, int> layers(const Polygon& polygon, int axis, int low, int high) {
    return {std::max(low, int(std::floor(polygon.lowest(axis) - kTouch))),
            std::min(high, int(std::floor(polygon.highest(axis) + kTouch)))};
}

void mark_run(std::span<std::uint64_t> row, int low, int high) {
    for (int x = low; x <= high;) {
        const int in_word = x % 64, count = std::min(64 - in_word, high - x + 1);
        const std::uint64_t run = count == 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << count) - 1;
        row[std::size_t(x) / 64] |= run << in_word;
        x += count;
    }
}

/// What the triangles touch, and what of needles the wrap is pulled onto: pieces as long as a voxel is wide, and no
/// more than enough for each place. A fan of 100,000 around one vertex would otherwise cost minutes.
struct Touched {
    VoxelGrid grid;
    std::vector<std::uint8_t> crossings; ///< pieces in each block of 2 x 2 x 2 voxels; at most kMostCrossings

    explicit Touched(const VoxelIndex& size)
        : grid(size),
          crossings((std::size_t(size[0]) / 2 + 1) * (std::size_t(size[1]) / 2 + 1) * (std::size_t(size[2]) / 2 + 1)) {}

    /// Whether one of the blocks with the voxels from low to high of a row has too few pieces; counts one more there.
    bool needs_piece(int y, int z, int low, int high) {
        const std::size_t row = std::size_t(z / 2) * (std::size_t(grid.size[1]) / 2 + 1) + std::size_t(y / 2);
        std::uint8_t* const blocks = crossings.data() + row * (std::size_t(grid.size[0]) / 2 + 1);
        bool needs = false;
        for (int x = low / 2; x <= high / 2; ++x) {
            if (blocks[x] == kMostCrossings) continue;
            ++blocks[x];
            needs = true;
        }
        return needs;
    }
};

bool is_needle(const Polygon& triangle) {
    double longest = 0;
    for (int k = 0; k < 3; ++k)
        longest = std::max(longest, (triangle.corners[(k + 1) % 3] - triangle.corners[k]).norm());
    const Vec3d& a = triangle.corners[0];
    const double doubled_area = (triangle.corners[1] - a).cross(triangle.corners[2] - a).norm();
    return longest > kNeedleLength && doubled_area < kNeedleWidth * longest;
}

/// What the wrap is pulled onto; positions in voxels.
struct PullTarget {
    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;

    void add(const Polygon& polygon) {
        const Index first = Index(positions.size());
        for (int k = 0; k < polygon.count; ++k) positions.push_back(polygon.corners[k].cast<float>());
        for (Index k = 2; k < Index(polygon.count); ++k) triangles.push_back({first, first + k - 1, first + k});
        if (polygon.count < 3) triangles.push_back({first, first, first + Index(polygon.count) - 1});
    }
    void add(const PullTarget& other) {
        const Index first = Index(positions.size());
        positions.insert(positions.end(), other.positions.begin(), other.positions.end());
        for (const auto& [a, b, c] : other.triangles) triangles.push_back({first + a, first + b, first + c});
    }
};

/// Marks the voxels that the triangle touches, in the layers from low to high along z. Adds the pieces of needles.
void mark_triangle(const Polygon& triangle, int low, int high, Touched& touched, PullTarget& pieces) {
    VoxelGrid& grid = touched.grid;
    const bool needle = is_needle(triangle);
    const auto [z_low, z_high] = layers(triangle, 2, low, high);
    for (int z = z_low; z <= z_high; ++z) {
        const Polygon slice = cut_to_layer(triangle, 2, z);
        if (slice.count == 0) continue;
        const auto [y_low, y_high] = layers(slice, 1, 0, grid.size[1] - 1);
        for (int y = y_low; y <= y_high; ++y) {
            const Polygon piece = cut_to_layer(slice, 1, y);
            if (piece.count == 0) continue;
            const auto [x_low, x_high] = layers(piece, 0, 0, grid.size[0] - 1);
            mark_run(grid.row(grid.row_of(y, z)), x_low, x_high);
            if (needle && touched.needs_piece(y, z, x_low, x_high)) pieces.add(piece);
        }
    }
}

/// The triangles that reach into each slab of layers.
Lists<Index, std::size_t> sort_into_slabs(std::span<const Vec3d> positions, std::span<const Triangle> triangles,
                                          int layer_count) {
    const std::size_t slabs = (std::size_t(layer_count) + kSlab - 1) / kSlab;
    const auto slab = [&](double z) { return std::min(slabs - 1, std::size_t(std::max(0.0, std::floor(z))) / kSlab); };
    return make_lists<Index, std::size_t>(slabs, [&](const auto& add) {
        for (Index t = 0; t < triangles.size(); ++t) {
            const auto& [a, b, c] = triangles[t];
            const auto [low, high] = std::minmax({positions[a].z(), positions[b].z(), positions[c].z()});
            for (std::size_t s = slab(low - kTouch); s <= slab(high + kTouch); ++s) add(s, t);
        }
    });
}

/// Marks what the triangles touch, and finds what the wrap will be pulled onto. positions: in voxels.
VoxelGrid touched_voxels(std::span<const Vec3d> positions, std::span<const Triangle> triangles, const VoxelIndex& size,
                         PullTarget& target, const RunContext& context) {
    Touched touched(size);
    const auto polygon = [&](const Triangle& t) {
        return Polygon{{positions[t[0]], positions[t[1]], positions[t[2]]}, 3};
    };
    const Lists<Index, std::size_t> slabs = sort_into_slabs(positions, triangles, size[2]);
    std::vector<PullTarget> pieces(slabs.size()); // of each slab
    parallel_for(context, pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end && !context.is_cancelled(); ++s) {
            const int low = int(s * kSlab), high = std::min(low + int(kSlab), size[2]) - 1;
            for (const Index t : slabs[s]) mark_triangle(polygon(triangles[t]), low, high, touched, pieces[s]);
        }
    });
    for (const Vec3d& p : positions) target.positions.push_back(p.cast<float>());
    for (const Triangle& t : triangles)
        if (!is_needle(polygon(t))) target.triangles.push_back(t);
    for (const PullTarget& slab : pieces) target.add(slab);
    return std::move(touched.grid);
}

/// Everything that cannot be reached from outside once openings up to twice `radius` are closed.
VoxelGrid solid_voxels(const VoxelGrid& touched, unsigned radius, const RunContext& context) {
    VoxelGrid closed = touched;
    for (unsigned i = 0; i < radius; ++i) closed = dilated(closed, context);
    VoxelGrid outside = flood_outside(closed);
    for (unsigned i = 0; i < radius; ++i) outside = dilated(outside, context); // the solid back to where it was
    return complement(std::move(outside));
}

// ---- The border as a mesh

struct QuadSurface {
    std::vector<Vec3d> positions; ///< in voxels
    std::vector<std::array<Index, 4>> quads;
};

/// Numbers the corners of the border in the grid's order.
class CornerNumbers {
public:
    explicit CornerNumbers(const VoxelGrid& solid) : corners_(solid.size), before_(solid.bits.size()) {
        for_each_border_corner(solid, [&](const VoxelIndex& corner) { corners_.set(corner); });
        for (std::size_t i = 0; i < corners_.bits.size(); ++i) {
            before_[i] = count_;
            count_ += Index(std::popcount(corners_.bits[i]));
        }
    }
    Index operator()(const VoxelIndex& corner) const {
        const std::size_t word = corners_.word_of(corner);
        const std::uint64_t below = (std::uint64_t(1) << (corner[0] % 64)) - 1;
        return before_[word] + Index(std::popcount(corners_.bits[word] & below));
    }

private:
    VoxelGrid corners_;
    std::vector<Index> before_;
    Index count_ = 0;
};

/// The side of a voxel that faces along an axis, counter-clockwise from outside.
std::array<VoxelIndex, 4> voxel_side(VoxelIndex corner, int axis, bool positive) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    corner[axis] += positive;
    std::array<VoxelIndex, 4> side = {corner, corner, corner, corner};
    ++side[1][b], ++side[2][b], ++side[2][c], ++side[3][c];
    if (!positive) std::swap(side[1], side[3]);
    return side;
}

QuadSurface extract_border(const VoxelGrid& solid) {
    QuadSurface surface;
    const CornerNumbers number(solid);
    for_each_border_corner(solid, [&](const VoxelIndex& c) { surface.positions.emplace_back(c[0], c[1], c[2]); });
    for (int z = 1; z + 1 < solid.size[2]; ++z)
        for (int y = 1; y + 1 < solid.size[1]; ++y) {
            const auto row = [&](int v, int w) { return solid.row(solid.row_of(v, w)); };
            const auto here = row(y, z);
            for (std::size_t w = 0; w < solid.words; ++w) {
                if (here[w] == 0) continue;
                const std::array<std::uint64_t, 6> beside = {voxels_below(here, w), voxels_above(here, w),
                                                             row(y - 1, z)[w],      row(y + 1, z)[w],
                                                             row(y, z - 1)[w],      row(y, z + 1)[w]};
                for (int side = 0; side < 6; ++side)
                    for_each_bit(here[w] & ~beside[side], [&](int x) {
                        const auto corners = voxel_side({int(64 * w) + x, y, z}, side / 2, side % 2);
                        surface.quads.push_back(
                            {number(corners[0]), number(corners[1]), number(corners[2]), number(corners[3])});
                    });
            }
        }
    return surface;
}

/// The neighbours of each vertex along edges. Each edge of a closed surface is left once from each end.
template <class Face>
IndexLists find_neighbours(std::span<const Face> faces, std::size_t vertex_count) {
    return make_lists<Index>(vertex_count, [&](const auto& add) {
        for (const Face& face : faces)
            for (std::size_t k = 0; k < face.size(); ++k) add(face[k], face[(k + 1) % face.size()]);
    });
}

Vec3d mean_of(std::span<const Index> vertices, std::span<const Vec3d> positions) {
    Vec3d sum = Vec3d::Zero();
    for (const Index v : vertices) sum += positions[v];
    return sum / double(vertices.size());
}

/// Takes the steps off, each vertex within its own box.
void smooth_steps(QuadSurface& surface, const RunContext& context) {
    const std::vector<Vec3d> corners = surface.positions;
    const IndexLists neighbours =
        find_neighbours(std::span<const std::array<Index, 4>>(surface.quads), surface.positions.size());
    std::vector<Vec3d> moved(corners.size());
    for (int round = 0; round < kSmoothRounds; ++round) {
        parallel_for(context, corners.size(), kVoxelWrapGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t v = begin; v < end && !context.is_cancelled(); ++v)
                moved[v] = mean_of(neighbours[v], surface.positions)
                               .cwiseMax(corners[v] - Vec3d::Constant(kFreedom))
                               .cwiseMin(corners[v] + Vec3d::Constant(kFreedom));
        });
        surface.positions.swap(moved);
    }
}

/// Along the shorter diagonals.
std::vector<Triangle> cut_quads(const QuadSurface& surface) {
    std::vector<Triangle> triangles;
    triangles.reserve(2 * surface.quads.size());
    for (const auto& [a, b, c, d] : surface.quads) {
        const auto& p = surface.positions;
        if ((p[a] - p[c]).squaredNorm() <= (p[b] - p[d]).squaredNorm())
            triangles.insert(triangles.end(), {{a, b, c}, {a, c, d}});
        else
            triangles.insert(triangles.end(), {{a, b, d}, {b, c, d}});
    }
    return triangles;
}

// ---- Onto the input

Vec3d doubled_area(std::span<const Vec3d> positions, const Triangle& t) {
    return (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
}

std::vector<Vec3d> unit_normals(std::span<const Vec3d> positions, std::span<const Triangle> triangles) {
    std::vector<Vec3d> normals(positions.size(), Vec3d::Zero());
    for (const Triangle& t : triangles) {
        const Vec3d normal = doubled_area(positions, t);
        for (const Index v : t) normals[v] += normal;
    }
    for (Vec3d& n : normals) n.normalize(); // stays zero where it is
    return normals;
}

/// Whether a triangle may go from one shape to another: it neither turns far nor vanishes.
bool may_become(const Vec3d& from, const Vec3d& to) {
    const double before = from.norm(), after = to.norm();
    return after > std::min(before, kLeastWrapArea) && from.dot(to) >= kMostTurn * before * after;
}

/// Moves vertices towards their targets, in smaller steps, or not at all, where a triangle would turn over.
void move_towards(std::span<const Vec3d> targets, std::span<const Triangle> triangles, std::vector<Vec3d>& positions,
                  const RunContext& context) {
    std::vector<double> step(positions.size(), 1.0);
    std::vector<Vec3d> moved(positions.size());
    std::vector<std::uint8_t> bad(triangles.size());
    for (int round = 0;; ++round) {
        parallel_for(context, positions.size(), kVoxelWrapGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t v = begin; v < end; ++v) moved[v] = positions[v] + step[v] * (targets[v] - positions[v]);
        });
        parallel_for(context, triangles.size(), kVoxelWrapGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t t = begin; t < end; ++t) {
                const auto& [a, b, c] = triangles[t];
                bad[t] = (step[a] > 0 || step[b] > 0 || step[c] > 0) &&
                         !may_become(doubled_area(positions, triangles[t]), doubled_area(moved, triangles[t]));
            }
        });
        bool any = false;
        std::vector<std::uint8_t> shorten(positions.size());
        for (std::size_t t = 0; t < triangles.size(); ++t) {
            if (!bad[t]) continue;
            any = true;
            for (const Index v : triangles[t]) shorten[v] = 1;
        }
        if (!any || context.is_cancelled()) break; // at the latest when nothing around moves
        for (std::size_t v = 0; v < step.size(); ++v)
            if (shorten[v]) step[v] = round < kHalvings ? step[v] / 2 : 0.0;
    }
    positions.swap(moved);
}

/// Where each vertex should go: onto the input, and a little off it where the part is a sheet, so that the two sides of
/// the shell around it stay apart.
std::vector<Vec3d> pull_targets(const ClosestPointTree& tree, const VoxelGrid& solid, std::span<const Vec3d> positions,
                                std::span<const Vec3d> normals, const RunContext& context) {
    std::vector<Vec3d> targets(positions.size());
    parallel_for(context, positions.size(), kVoxelWrapGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end && !context.is_cancelled(); ++v) {
            const SurfacePoint closest = tree.closest(positions[v].cast<float>());
            targets[v] = closest.position.cast<double>();
            const Vec3d below = targets[v] - kProbe * normals[v];
            const VoxelIndex voxel = {int(std::floor(below.x())), int(std::floor(below.y())),
                                      int(std::floor(below.z()))};
            if (!solid.inside(voxel) || !solid.test(voxel)) targets[v] += kShell * normals[v];
        }
    });
    return targets;
}

/// Each vertex to the middle of its neighbours, along the surface.
std::vector<Vec3d> tangential_targets(std::span<const Vec3d> positions, std::span<const Vec3d> normals,
                                      const IndexLists& neighbours, const RunContext& context) {
    std::vector<Vec3d> targets(positions.size());
    parallel_for(context, positions.size(), kVoxelWrapGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const Vec3d offset = mean_of(neighbours[v], positions) - positions[v];
            targets[v] = positions[v] + 0.5 * (offset - offset.dot(normals[v]) * normals[v]);
        }
    });
    return targets;
}

void pull_onto_input(const PullTarget& input, const VoxelGrid& solid, std::span<const Triangle> triangles,
                     std::vector<Vec3d>& positions, const RunContext& context) {
    const ClosestPointTree tree(input.positions, input.triangles, context);
    const IndexLists neighbours = find_neighbours(triangles, positions.size());
    for (int round = 0; round < kPullRounds && !context.is_cancelled(); ++round) {
        context.report("pulling the wrap onto the surface", double(round) / kPullRounds);
        std::vector<Vec3d> normals = unit_normals(positions, triangles);
        if (round > 0) {
            move_towards(tangential_targets(positions, normals, neighbours, context), triangles, positions, context);
            normals = unit_normals(positions, triangles);
        }
        move_towards(pull_targets(tree, solid, positions, normals, context), triangles, positions, context);
    }
}

/// Vertices of one component have one number: its lowest vertex.
std::vector<Index> find_components(std::span<const Triangle> triangles, std::size_t vertex_count) {
    DisjointSets components(vertex_count);
    for (const auto& [a, b, c] : triangles)
        for (const Index v : {b, c}) components.join(a, v);
    std::vector<Index> component(vertex_count);
    for (Index v = 0; v < vertex_count; ++v) component[v] = components.root(v);
    return component;
}

/// Puts components that were pulled inside out, which only those of a few voxels can be, back to where they began.
void restore_flattened(std::span<const Vec3d> before, std::span<const Triangle> triangles,
                       std::vector<Vec3d>& positions) {
    const std::vector<Index> component = find_components(triangles, positions.size());
    std::vector<double> volume(positions.size());
    for (const Triangle& t : triangles) { // from a vertex of the component: small ones lose no digits
        const Vec3d& origin = positions[component[t[0]]];
        volume[component[t[0]]] +=
            (positions[t[0]] - origin).dot((positions[t[1]] - origin).cross(positions[t[2]] - origin));
    }
    for (std::size_t v = 0; v < positions.size(); ++v)
        if (!(volume[component[v]] > 0)) positions[v] = before[v];
}

// ---- From the model to voxels and back

struct VoxelFrame {
    Vec3d origin; ///< of the grid's first voxel
    double voxel; ///< its side
    VoxelIndex size;

    Vec3d to_voxels(const Vec3d& p) const { return (p - origin) / voxel; }
    Vec3d to_model(const Vec3d& p) const { return origin + voxel * p; }
};

/// The box lies in the middle of a whole number of voxels, so that its sides are not on the voxels' own.
VoxelFrame make_frame(const Box& box, unsigned resolution, unsigned margin) {
    VoxelFrame frame;
    frame.voxel = box.size().maxCoeff() / resolution;
    for (int k = 0; k < 3; ++k) {
        const double length = box.size()[k] / frame.voxel;
        const int inside = int(std::floor(length * (1 + kTouch))) + 1;
        frame.size[k] = inside + 2 * int(margin);
        frame.origin[k] = box.min[k] - frame.voxel * ((inside - length) / 2 + margin);
    }
    return frame;
}

} // namespace

Result<ManifoldSurface> voxel_wrap(std::span<const Vec3d> positions, std::span<const Triangle> triangles,
                                   const WrapOptions& options, const RunContext& context) {
    Box box;
    for (const Triangle& t : triangles)
        for (const Index v : t) box.extend(positions[v]);
    if (!(box.size().maxCoeff() > 0))
        return Error{ErrorCode::unsuitable, "The mesh has no extent, so nothing can be wrapped around it."};

    const unsigned radius = (options.closing + 1) / 2;
    const VoxelFrame frame = make_frame(box, options.resolution, radius + 2);
    std::vector<Vec3d> in_voxels(positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v) in_voxels[v] = frame.to_voxels(positions[v]);

    context.report("finding the outside", 0);
    PullTarget input;
    VoxelGrid solid = solid_voxels(touched_voxels(in_voxels, triangles, frame.size, input, context), radius, context);
    if (context.is_cancelled()) return cancelled_error();
    make_border_manifold(solid);
    if (context.is_cancelled()) return cancelled_error();

    QuadSurface border = extract_border(solid);
    const std::vector<Vec3d> corners = border.positions;
    smooth_steps(border, context);
    ManifoldSurface surface{{}, cut_quads(border), {}};
    surface.positions = std::move(border.positions);
    pull_onto_input(input, solid, surface.triangles, surface.positions, context);
    if (context.is_cancelled()) return cancelled_error();
    restore_flattened(corners, surface.triangles, surface.positions);
    for (Vec3d& p : surface.positions) p = frame.to_model(p);
    return surface;
}

} // namespace filigree
