// A set of voxels, and the border between those and the rest.
#pragma once

#include "filigree/context.h"
#include "filigree/core/bits.h"
#include "filigree/types.h"

#include <array>
#include <span>
#include <vector>

namespace filigree {

using VoxelIndex = std::array<int, 3>; ///< of a voxel, or of the corner at its lower end

/// A bit a voxel, in rows along x. Bits of a row's last word that are no voxels are 0.
struct VoxelGrid {
    VoxelIndex size;
    std::size_t words; ///< of a row
    std::vector<std::uint64_t> bits;

    /// size: at least 1 each.
    explicit VoxelGrid(const VoxelIndex& size_)
        : size(size_), words((std::size_t(size_[0]) + 63) / 64), bits(words * row_count()) {}

    std::size_t row_count() const { return std::size_t(size[1]) * std::size_t(size[2]); }
    std::size_t row_of(int y, int z) const { return std::size_t(z) * std::size_t(size[1]) + std::size_t(y); }
    std::span<std::uint64_t> row(std::size_t r) { return std::span(bits).subspan(r * words, words); }
    std::span<const std::uint64_t> row(std::size_t r) const { return std::span(bits).subspan(r * words, words); }
    /// The bits of a row's word that are voxels.
    std::uint64_t valid_bits(std::size_t word) const {
        const std::size_t left = std::size_t(size[0]) - 64 * word;
        return left >= 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << left) - 1;
    }

    bool inside(const VoxelIndex& v) const {
        for (int k = 0; k < 3; ++k)
            if (v[k] < 0 || v[k] >= size[k]) return false;
        return true;
    }
    std::size_t word_of(const VoxelIndex& v) const { return row_of(v[1], v[2]) * words + std::size_t(v[0]) / 64; }
    bool test(const VoxelIndex& v) const { return bits[word_of(v)] >> (v[0] % 64) & 1; }
    void set(const VoxelIndex& v) { bits[word_of(v)] |= std::uint64_t(1) << (v[0] % 64); }
};

/// Bit x of the result is bit x - 1 (x + 1) of the row, for one of its words.
inline std::uint64_t voxels_below(std::span<const std::uint64_t> row, std::size_t word) {
    return row[word] << 1 | (word > 0 ? row[word - 1] >> 63 : 0);
}
inline std::uint64_t voxels_above(std::span<const std::uint64_t> row, std::size_t word) {
    return row[word] >> 1 | (word + 1 < row.size() ? row[word + 1] << 63 : 0);
}

VoxelGrid complement(VoxelGrid grid);

/// Every voxel that shares at least a corner with one of the grid's, and those. Cost O(size / 64).
VoxelGrid dilated(const VoxelGrid& grid, const RunContext& context);

/// The voxels that are not closed and connected, through faces, to the first one of the grid.
VoxelGrid flood_outside(const VoxelGrid& closed);

/// The corners in one row and word that have voxels of the set around them and others; y and z from 1.
std::uint64_t border_corners(const VoxelGrid& solid, int y, int z, std::size_t word);

/// Calls visit(corner) for every corner of the border, in the order of the grid. The grid's outermost voxels must not
/// be in the set.
template <class Visit>
void for_each_border_corner(const VoxelGrid& solid, const Visit& visit) {
    for (int z = 1; z < solid.size[2]; ++z)
        for (int y = 1; y < solid.size[1]; ++y)
            for (std::size_t w = 0; w < solid.words; ++w)
                for_each_bit(border_corners(solid, y, z, w), [&](int x) { visit(VoxelIndex{int(64 * w) + x, y, z}); });
}

/// Adds voxels until the border is a manifold, one fan at each corner, and no others are shut in. The grid's two
/// outermost layers must not be in the set.
void make_border_manifold(VoxelGrid& solid);

} // namespace filigree
