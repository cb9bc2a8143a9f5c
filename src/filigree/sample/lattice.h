// Regular points in space, and which of them are in a set.
#pragma once

#include "filigree/core/result.h"
#include "filigree/mesh/mesh.h"

#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

namespace filigree {

/// Points along an axis at most, so that lower bounds on them, 0 to count, fit 16 bits.
inline constexpr std::size_t kMostLowerBounds = 65534;

/// Points (x[i], y[j], z[k]), relative to the mesh's origin. The stored doubles are the points: every decision is made
/// about them, exactly.
struct Lattice {
    std::array<std::vector<double>, 3> coordinates; ///< ascending, `spacing` apart up to rounding
    double spacing = 0;                             ///< model units

    std::array<std::size_t, 3> counts() const {
        return {coordinates[0].size(), coordinates[1].size(), coordinates[2].size()};
    }
    double point_count() const { ///< as a double: it may not fit an integer
        return double(coordinates[0].size()) * double(coordinates[1].size()) * double(coordinates[2].size());
    }
    Vec3d point(std::size_t i, std::size_t j, std::size_t k) const {
        return {coordinates[0][i], coordinates[1][j], coordinates[2][k]};
    }
};

struct LatticeOptions {
    double spacing = 0;               ///< model units, above 0
    std::optional<Vec3d> origin = {}; ///< a lattice point, relative to the mesh's origin; unset: half a spacing inside
                                      ///< the box's lowest corner, so that the lattice is centred in its cells
};

/// The lattice over a box (relative to the mesh's origin). Spacing and origin are rounded to a dyadic grid fine enough
/// that nothing changes by more than 2^-24 of the spacing, so that most ties can be decided in integers.
/// Without an origin, an axis shorter than the spacing gets one layer, in its middle.
/// Errors: usage (spacing not finite, not above 0 or larger than the box; a box without extent), unsuitable (more than
/// 65,534 points on an axis, or none, or a spacing below the resolution of the coordinates: says what would do).
Result<Lattice> make_lattice(const Box& box, const LatticeOptions& options);

/// One bit a lattice point, rows along x: bit i & 63 of word i >> 6 of row (j, k).
struct Occupancy {
    std::array<std::size_t, 3> counts = {};
    std::size_t words_per_row = 0;
    std::vector<std::uint64_t> bits;

    bool contains(std::size_t i, std::size_t j, std::size_t k) const {
        return bits[(k * counts[1] + j) * words_per_row + (i >> 6)] >> (i & 63) & 1;
    }
    std::size_t count() const; ///< points inside
};

/// The most memory that deciding about a lattice may take, where a caller does not say.
inline constexpr std::size_t kMostLatticeBytes = std::size_t{4} << 30;

/// Whether so many bytes for a lattice are no more than allowed. Errors: unsuitable (says how much).
Status check_lattice_bytes(const Lattice& lattice, double bytes, std::size_t most_bytes);

/// An occupancy with no point inside. other_bytes: what the caller needs beside the bits.
/// Errors: unsuitable (bits and other bytes are more than most_bytes: says how much).
Result<Occupancy> make_occupancy(const Lattice& lattice, double other_bytes = 0,
                                 std::size_t most_bytes = kMostLatticeBytes);

/// Calls visit(i, j, k) for each point inside, in the order of k, j, i.
template <class Visit>
void for_each_inside(const Occupancy& occupancy, const Visit& visit) {
    std::size_t word = 0;
    for (std::size_t k = 0; k < occupancy.counts[2]; ++k)
        for (std::size_t j = 0; j < occupancy.counts[1]; ++j)
            for (std::size_t w = 0; w < occupancy.words_per_row; ++w, ++word)
                for (std::uint64_t rest = occupancy.bits[word]; rest != 0; rest &= rest - 1)
                    visit(64 * w + std::size_t(std::countr_zero(rest)), j, k);
}

/// The points inside, in the order of k, j, i.
struct LatticePoints {
    std::vector<std::array<std::uint16_t, 3>> indices; ///< i, j, k
    std::vector<Vec3f> positions;                      ///< relative to the mesh's origin, rounded to float
};
LatticePoints points_inside(const Lattice& lattice, const Occupancy& occupancy);

} // namespace filigree
