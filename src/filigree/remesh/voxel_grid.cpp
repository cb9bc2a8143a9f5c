// Based on:
//   [Latecki 1997]: the border of a set of voxels is a manifold when it is one around each corner (the set is well
//   composed); as his repair, ours adds voxels.
#include "filigree/remesh/voxel_grid.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>

namespace filigree {
namespace {

/// Spreads the seeds of a row along its free voxels.
void spread_along(std::span<std::uint64_t> seeds, std::span<const std::uint64_t> closed) {
    std::uint64_t carry = 0;
    for (std::size_t w = 0; w < seeds.size(); ++w) {
        std::uint64_t free = ~closed[w], s = seeds[w] | (carry & free);
        for (int step = 1; step < 64; step *= 2) {
            s |= free & (s << step);
            free &= free << step;
        }
        seeds[w] = s;
        carry = s >> 63;
    }
    carry = 0;
    for (std::size_t w = seeds.size(); w-- > 0;) {
        std::uint64_t free = ~closed[w], s = seeds[w] | (carry & free);
        for (int step = 1; step < 64; step *= 2) {
            s |= free & (s >> step);
            free &= free >> step;
        }
        seeds[w] = s;
        carry = s << 63;
    }
}

/// Whether the bits, voxels around a corner (bit i has its x, y, z in the bits of i), are connected through faces.
bool is_connected(unsigned bits) {
    unsigned reached = bits & -bits;
    for (unsigned before = 0; before != reached;) {
        before = reached;
        for (unsigned i = 0; i < 8; ++i)
            for (unsigned axis = 1; axis < 8; axis *= 2)
                if (reached >> i & 1) reached |= bits & (1u << (i ^ axis));
    }
    return reached == bits;
}

/// For the solid voxels around a corner, which of the others to fill so that the border is one fan there.
std::array<std::uint8_t, 256> fills() {
    std::array<std::uint8_t, 256> table{};
    const auto is_manifold = [](unsigned solid) { return is_connected(solid) && is_connected(~solid & 255u); };
    for (unsigned solid = 0; solid < 256; ++solid) {
        unsigned best = 255;
        for (unsigned more = solid; more < 256; ++more)
            if ((more & solid) == solid && is_manifold(more) && std::popcount(more) < std::popcount(best)) best = more;
        table[solid] = std::uint8_t(best & ~solid);
    }
    return table;
}

VoxelIndex voxel_at(const VoxelIndex& corner, unsigned i) {
    return {corner[0] - 1 + int(i & 1), corner[1] - 1 + int(i >> 1 & 1), corner[2] - 1 + int(i >> 2)};
}

} // namespace

VoxelGrid complement(VoxelGrid grid) {
    for (std::size_t i = 0; i < grid.bits.size(); ++i) grid.bits[i] = ~grid.bits[i] & grid.valid_bits(i % grid.words);
    return grid;
}

VoxelGrid dilated(const VoxelGrid& grid, const RunContext& context) {
    VoxelGrid across(grid.size), result(grid.size);
    const auto for_each_layer = [&](const auto& visit) {
        parallel_for(context, std::size_t(grid.size[2]), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t z = begin; z < end; ++z) visit(int(z));
        });
    };
    for_each_layer([&](int z) { // along x and y
        for (int y = 0; y < grid.size[1]; ++y)
            for (int other = std::max(0, y - 1); other <= std::min(grid.size[1] - 1, y + 1); ++other) {
                const auto source = grid.row(grid.row_of(other, z));
                const auto target = across.row(grid.row_of(y, z));
                for (std::size_t w = 0; w < grid.words; ++w)
                    target[w] |= (source[w] | voxels_below(source, w) | voxels_above(source, w)) & grid.valid_bits(w);
            }
    });
    for_each_layer([&](int z) {
        const std::size_t layer = std::size_t(grid.size[1]) * grid.words;
        for (int other = std::max(0, z - 1); other <= std::min(grid.size[2] - 1, z + 1); ++other)
            for (std::size_t i = 0; i < layer; ++i)
                result.bits[std::size_t(z) * layer + i] |= across.bits[std::size_t(other) * layer + i];
    });
    return result;
}

VoxelGrid flood_outside(const VoxelGrid& closed) {
    VoxelGrid outside(closed.size);
    std::vector<std::size_t> queue = {0};
    std::vector<std::uint8_t> queued(closed.row_count());
    std::vector<std::uint64_t> seeds(closed.words);
    const std::size_t across = std::size_t(closed.size[1]);
    for (std::size_t done = 0; done < queue.size(); ++done) {
        const std::size_t row = queue[done];
        queued[row] = 0;
        std::array<std::size_t, 4> beside;
        std::size_t count = 0;
        if (row % across > 0) beside[count++] = row - 1;
        if (row % across + 1 < across) beside[count++] = row + 1;
        if (row >= across) beside[count++] = row - across;
        if (row + across < closed.row_count()) beside[count++] = row + across;
        const auto here = outside.row(row);
        for (std::size_t w = 0; w < closed.words; ++w) {
            seeds[w] = here[w];
            for (std::size_t k = 0; k < count; ++k) seeds[w] |= outside.row(beside[k])[w];
            seeds[w] &= ~closed.row(row)[w];
        }
        if (row == 0) seeds[0] |= ~closed.bits[0] & 1;
        spread_along(seeds, closed.row(row));
        seeds.back() &= closed.valid_bits(closed.words - 1);
        if (std::ranges::equal(seeds, here)) continue;
        std::ranges::copy(seeds, here.begin());
        for (std::size_t k = 0; k < count; ++k)
            if (!queued[beside[k]]) {
                queued[beside[k]] = 1;
                queue.push_back(beside[k]);
            }
    }
    return outside;
}

std::uint64_t border_corners(const VoxelGrid& solid, int y, int z, std::size_t word) {
    std::uint64_t any = 0, all = ~std::uint64_t(0);
    for (const auto& [v, w] : {std::pair(y, z), {y - 1, z}, {y, z - 1}, {y - 1, z - 1}}) {
        const auto row = solid.row(solid.row_of(v, w));
        const std::uint64_t below = voxels_below(row, word);
        any |= row[word] | below;
        all &= row[word] & below;
    }
    return any & ~all;
}

void make_border_manifold(VoxelGrid& solid) {
    static const std::array<std::uint8_t, 256> table = fills();
    for (bool changed = true; changed;) {
        changed = false;
        for_each_border_corner(solid, [&](const VoxelIndex& corner) {
            unsigned around = 0;
            for (unsigned i = 0; i < 8; ++i) around |= unsigned(solid.test(voxel_at(corner, i))) << i;
            for (unsigned i = 0; i < 8; ++i)
                if (table[around] >> i & 1) solid.set(voxel_at(corner, i));
            changed = changed || table[around];
        });
        if (changed) solid = complement(flood_outside(solid));
    }
}

} // namespace filigree
