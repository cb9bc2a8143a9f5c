// Based on: [Jacobson 2013], winding numbers of meshes that are not closed.
//
// We differ: cones over the edges at which triangles do not cancel close the mesh, and the crossings of lattice rows
// with a closed mesh are whole numbers, exactly. The winding numbers of the cones are then subtracted; only they need a
// tree. They vary slowly away from the cones, so most blocks of points are decided at their centres.
#include "filigree/sample/winding_inside.h"
#include "filigree/sample/inside_scan.h"
#include "filigree/sample/lattice_memory.h"

#include "filigree/core/now_seconds.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh/edges.h"
#include "filigree/sample/border_cones.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace filigree {

namespace {

/// Cones over the edges at which faces do not cancel.
BorderCones cones_of(const ScanMesh& mesh) {
    std::vector<MissingSide> sides;
    for (const std::span<const Index> edge : edges_of(mesh.triangles, mesh.positions.size())) {
        const int net = edge_balance(mesh.triangles, edge);
        if (net == 0) continue;
        const auto [low, high] = edge_ends(mesh.triangles, edge);
        sides.push_back(net > 0 ? MissingSide{low, high, net} : MissingSide{high, low, -net});
    }
    return make_border_cones(mesh.positions, sides);
}

constexpr std::size_t kBlock = 16, kSmallestBlock = 4; // points along a side
// A block is decided at its centre when the cones are twice its radius away and their part is this far from where the
// answer changes. Not proven; a bound by the cones' area decides a tenth of the blocks. No point differed in the tests.
constexpr double kClear = 2, kMargin = 0.2;
constexpr double kNearHalf = 0.1;

/// Decides the points of some layers of a lattice.
struct Layers {
    const Lattice& lattice;
    const WindingTree& cones;
    std::size_t first_k;
    std::span<const std::int16_t> crossings; ///< of the closed mesh, before each point
    Occupancy& occupancy;
    const RunContext& context;

    struct Block {
        std::array<std::size_t, 3> begin, end;
    };

    /// Returns how many points have a winding number near a half. Looks at `cancel` for each block, the smallest too:
    /// beside a fan of 200,000 triangles a point takes a millisecond.
    std::size_t decide(const Block& block, std::size_t side) const {
        if (context.is_cancelled()) return 0;
        Vec3d low, high;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto i = static_cast<Eigen::Index>(axis);
            low[i] = lattice.coordinates[axis][block.begin[axis]];
            high[i] = lattice.coordinates[axis][block.end[axis] - 1];
        }
        const double radius = 0.5 * (high - low).norm() * cones.inverse_half_size();
        const WindingTree::NumberAndDistance w = cones.winding_and_distance(0.5 * (low + high));
        if (w.distance >= kClear * radius && from_half(w.number) > kMargin) {
            for (std::size_t k = block.begin[2]; k < block.end[2]; ++k)
                for (std::size_t j = block.begin[1]; j < block.end[1]; ++j)
                    set(block, j, k, [t = threshold(w.number)](std::size_t) { return t; });
            return 0;
        }
        std::size_t near_half = 0;
        if (side > kSmallestBlock) {
            for_each_block(block, side / 2, [&](const Block& part) { near_half += decide(part, side / 2); });
            return near_half;
        }
        for (std::size_t k = block.begin[2]; k < block.end[2]; ++k)
            for (std::size_t j = block.begin[1]; j < block.end[1]; ++j)
                set(block, j, k, [&](std::size_t i) {
                    const double number = cones.winding(lattice.point(i, j, k));
                    near_half += from_half(number) < kNearHalf;
                    return threshold(number);
                });
        return near_half;
    }

    template <class Body>
    static void for_each_block(const Block& whole, std::size_t side, const Body& body) {
        Block part;
        const auto cut = [&](std::size_t axis, std::size_t begin) {
            part.begin[axis] = begin;
            part.end[axis] = std::min(begin + side, whole.end[axis]);
        };
        for (std::size_t k = whole.begin[2]; k < whole.end[2]; k += side) {
            cut(2, k);
            for (std::size_t j = whole.begin[1]; j < whole.end[1]; j += side) {
                cut(1, j);
                for (std::size_t i = whole.begin[0]; i < whole.end[0]; i += side) {
                    cut(0, i);
                    body(part);
                }
            }
        }
    }

private:
    static double from_half(double number) { return std::abs(number - std::floor(number) - 0.5); }
    static int threshold(double number) { return ClosedByCones::least_winding(number); }

    template <class Threshold>
    void set(const Block& block, std::size_t j, std::size_t k, const Threshold& threshold_at) const {
        const std::size_t nx = occupancy.counts[0], ny = occupancy.counts[1];
        const std::int16_t* row = &crossings[((k - first_k) * ny + j) * nx];
        std::uint64_t bits = 0;
        for (std::size_t i = block.begin[0]; i < block.end[0]; ++i)
            bits |= std::uint64_t{row[i] >= threshold_at(i)} << (i & 63);
        occupancy.bits[(k * ny + j) * occupancy.words_per_row + (block.begin[0] >> 6)] |= bits;
    }
};
static_assert(64 % kBlock == 0, "a block's row of bits is in one word");

constexpr std::size_t kSlabPoints = std::size_t{1} << 25; // of crossings at a time

/// Layers of a slab: whole blocks, as many as kSlabPoints holds.
std::size_t slab_layers(const std::array<std::size_t, 3>& counts) {
    const std::size_t layer_points = std::max<std::size_t>(1, counts[0] * counts[1]);
    return std::min(counts[2], std::max<std::size_t>(1, kSlabPoints / (layer_points * kBlock)) * kBlock);
}

} // namespace

Result<ClosedByCones> close_by_cones(const ScanMesh& mesh, double accuracy, const RunContext& context) {
    ClosedByCones closed;
    BorderCones cones = cones_of(mesh);
    if (context.is_cancelled()) return cancelled_error();
    closed.open_edges = cones.open_edges;
    if (cones.triangles.empty()) return closed;
    Result<WindingTree> tree = WindingTree::create(cones.positions, cones.triangles, accuracy, context);
    if (!tree) return tree.error();
    closed.cones = std::move(tree).value();
    closed.positions = std::move(cones.positions);
    closed.triangles.assign(mesh.triangles.begin(), mesh.triangles.end());
    closed.triangles.insert(closed.triangles.end(), cones.triangles.begin(), cones.triangles.end());
    return closed;
}

Result<WindingSampler> WindingSampler::create(const ScanMesh& mesh, const WindingOptions& options,
                                              const RunContext& context) {
    WindingSampler sampler(mesh, options);
    Result<ClosedByCones> closed = close_by_cones(mesh, options.accuracy, context);
    if (!closed) return closed.error();
    sampler.closed_ = std::move(closed).value();
    return sampler;
}

Result<Occupancy> WindingSampler::inside(const Lattice& lattice, const RunContext& context,
                                         WindingReport* report) const {
    const double start = now_seconds();
    WindingReport found;
    found.open_edges = closed_.open_edges;
    const auto finish = [&] {
        found.seconds = now_seconds() - start;
        if (report) *report = found;
    };
    if (!closed_.cones) {
        auto occupancy =
            scan_inside(mesh_, lattice, {.overlap = Overlap::merged, .most_bytes = options_.most_bytes}, context);
        finish();
        return occupancy;
    }

    const auto [nx, ny, nz] = lattice.counts();
    const std::size_t layers = slab_layers(lattice.counts());
    Result<Occupancy> occupancy =
        make_occupancy(lattice, sizeof(std::int16_t) * double(nx) * double(ny) * double(layers), options_.most_bytes);
    if (!occupancy) return occupancy;
    std::atomic<std::size_t> near_half = 0;
    for (std::size_t first_k = 0; first_k < nz; first_k += layers) {
        context.report("winding", double(first_k) / double(nz));
        const auto crossings = scan_winding({closed_.positions, closed_.triangles}, lattice, first_k, layers, context);
        if (!crossings) return crossings.error();
        const Layers slab{lattice, *closed_.cones, first_k, *crossings, *occupancy, context};
        const std::size_t last_k = std::min(first_k + layers, nz);
        parallel_for(context, ny, kBlock, [&](std::size_t begin, std::size_t end) {
            std::size_t near = 0;
            Layers::for_each_block({{0, begin, first_k}, {nx, end, last_k}}, kBlock,
                                   [&](const Layers::Block& block) { near += slab.decide(block, kBlock); });
            near_half += near;
        });
        if (context.is_cancelled()) return cancelled_error();
    }
    const double points = lattice.point_count();
    found.near_half = points > 0 ? static_cast<double>(near_half) / points : 0;
    finish();
    return occupancy;
}

Result<Occupancy> winding_inside(const ScanMesh& mesh, const Lattice& lattice, const WindingOptions& options,
                                 const RunContext& context, WindingReport* report) {
    const Result<WindingSampler> sampler = WindingSampler::create(mesh, options, context);
    if (!sampler) return sampler.error();
    return sampler->inside(lattice, context, report);
}

} // namespace filigree
