// An endless regular grid, of which blocks of 8 x 8 x 8 nodes are kept where something is.
#pragma once

#include "filigree/types.h"

#include <array>
#include <cstdint>
#include <vector>

namespace filigree {

using GridNode = std::array<std::int32_t, 3>;

/// Nodes lie at cell * node + shift. The cell of a node is the one above it on all axes. Arrays over a grid have one
/// value a slot: 512 a block, x fastest.
class BlockGrid {
public:
    static constexpr int kSide = 8, kNodes = kSide * kSide * kSide;
    static constexpr std::int32_t kFarthest = 1 << 23; ///< nodes' coordinates are below this

    BlockGrid() = default;
    /// keys: of blocks, in any order, as often as one likes. Cost O(n log n).
    BlockGrid(double cell, const Vec3d& shift, std::vector<std::uint64_t> keys);

    static std::uint64_t key_of_block(std::int32_t x, std::int32_t y, std::int32_t z) {
        constexpr std::int32_t kBias = kFarthest / kSide;
        return std::uint64_t(z + kBias) << 42 | std::uint64_t(y + kBias) << 21 | std::uint64_t(x + kBias);
    }

    double cell() const { return cell_; }
    const Vec3d& shift() const { return shift_; }
    std::size_t block_count() const { return keys_.size(); }
    std::size_t slot_count() const { return keys_.size() * kNodes; }
    const std::vector<std::uint64_t>& keys() const { return keys_; } ///< ascending

    Index block(std::uint64_t key) const; ///< kNoIndex: not kept
    /// The block itself and those that touch it, x fastest; kNoIndex: not kept.
    const std::array<Index, 27>& around(Index block) const { return neighbours_[block]; }
    GridNode block_corner(Index block) const;
    GridNode node(Index slot) const;
    Vec3d position(const GridNode& node) const { return Vec3d(node[0], node[1], node[2]) * cell_ + shift_; }
    /// kNoIndex where no block is.
    Index slot(const GridNode& node) const;
    /// The slot some steps from another, less than 8 on each axis.
    Index step(Index slot, int x, int y, int z) const {
        const int lx = int(slot & 7) + x, ly = int(slot >> 3 & 7) + y, lz = int(slot >> 6 & 7) + z;
        const Index at = neighbours_[slot >> 9][std::size_t((lx >> 3) + 1 + 3 * ((ly >> 3) + 1) + 9 * ((lz >> 3) + 1))];
        return at == kNoIndex ? at : at * kNodes + Index((lx & 7) | (ly & 7) << 3 | (lz & 7) << 6);
    }
    Index step(Index slot, int axis, int by) const {
        return step(slot, axis == 0 ? by : 0, axis == 1 ? by : 0, axis == 2 ? by : 0);
    }
    /// The slots of a cell's corners: corner q at q & 1, q >> 1 & 1, q >> 2.
    std::array<Index, 8> corners(Index slot) const {
        constexpr Index kLast = 7;
        if ((slot & 7) != kLast && (slot >> 3 & 7) != kLast && (slot >> 6 & 7) != kLast)
            return {slot, slot + 1, slot + 8, slot + 9, slot + 64, slot + 65, slot + 72, slot + 73};
        std::array<Index, 8> all;
        for (int q = 0; q < 8; ++q) all[std::size_t(q)] = step(slot, q & 1, q >> 1 & 1, q >> 2);
        return all;
    }
    /// The node below `at`, where a coordinate that is a node's counts as below it: what `sample` says of points.
    GridNode node_below(const Vec3d& at) const;

private:
    double cell_ = 1;
    Vec3d shift_ = Vec3d::Zero();
    std::vector<std::uint64_t> keys_;
    std::vector<Index> table_; ///< open addressing by key; a power of two
    std::vector<std::array<Index, 27>> neighbours_;
};

/// Trilinear interpolation of an array over a grid; `outside` where no block is. gradient: of the same, 1 / length.
float interpolate(const BlockGrid& grid, const std::vector<float>& values, float outside, const Vec3d& at,
                  Vec3f* gradient = nullptr);

/// The differences of the values across nodes, interpolated the same way: a gradient without steps between cells.
Vec3f smooth_gradient(const BlockGrid& grid, const std::vector<float>& values, float outside, const Vec3d& at);

} // namespace filigree
