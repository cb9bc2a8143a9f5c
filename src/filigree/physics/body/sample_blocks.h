// Samples inside a mesh around the corners of cells, one bit each, and which of them hang together. Private to the
// layer.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/sample/closure.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <optional>

namespace filigree {

inline constexpr unsigned kSamplesAlong = 4;        ///< of a cell
inline constexpr int kCellsNear = 1, kCellsFar = 4; ///< cells to either side of a corner that are looked at
inline constexpr int kLeastPart = 64;               ///< samples: smaller parts are flecks
inline constexpr int kLeastNear = 16;               ///< of those in the 2^3 cells around a corner

/// A cube of samples, one bit each: rows along x, by z and y.
template <class Word>
struct SampleBlock {
    static constexpr int kSide = std::numeric_limits<Word>::digits;
    std::array<Word, std::size_t(kSide)* kSide> rows = {};

    Word& row(int y, int z) { return rows[std::size_t(z * kSide + y)]; }
    Word row(int y, int z) const { return rows[std::size_t(z * kSide + y)]; }
    bool is_empty() const {
        return std::ranges::all_of(rows, [](Word word) { return word == 0; });
    }
    bool is_full() const {
        return std::ranges::all_of(rows, [](Word word) { return Word(~word) == 0; });
    }
    int count() const {
        int bits = 0;
        for (const Word word : rows) bits += std::popcount(word);
        return bits;
    }
    bool meets(const SampleBlock& other) const {
        for (std::size_t r = 0; r < rows.size(); ++r)
            if (rows[r] & other.rows[r]) return true;
        return false;
    }
    SampleBlock without(const SampleBlock& other) const {
        SampleBlock left;
        for (std::size_t r = 0; r < rows.size(); ++r) left.rows[r] = Word(rows[r] & ~other.rows[r]);
        return left;
    }
    /// The first of its samples alone.
    SampleBlock first() const {
        SampleBlock one;
        const auto found = std::ranges::find_if(rows, [](Word word) { return word != 0; });
        if (found != rows.end())
            one.rows[std::size_t(found - rows.begin())] = Word(Word{1} << std::countr_zero(*found));
        return one;
    }
    /// A row and those beside it, one sample wider.
    Word around(int y, int z) const {
        Word all = 0;
        for (int k = std::max(z - 1, 0); k <= std::min(z + 1, kSide - 1); ++k)
            for (int j = std::max(y - 1, 0); j <= std::min(y + 1, kSide - 1); ++j) all |= row(j, k);
        return Word(all | Word(all << 1) | Word(all >> 1));
    }
    /// Everything that hangs together with what is in it, by `inside`: samples beside each other, corners included.
    void flood(const SampleBlock& inside) {
        const auto grow = [&](int y, int z) {
            Word now = row(y, z);
            for (Word next = Word(now | (around(y, z) & inside.row(y, z))); next != now;) {
                now = next;
                next = Word(now | ((now << 1 | now >> 1) & inside.row(y, z)));
            }
            const bool grew = now != row(y, z);
            row(y, z) = now;
            return grew;
        };
        for (bool grew = true; grew;) {
            grew = false;
            for (int z = 0; z < kSide; ++z)
                for (int y = 0; y < kSide; ++y) grew |= grow(y, z);
            for (int z = kSide; z-- > 0;)
                for (int y = kSide; y-- > 0;) grew |= grow(y, z);
        }
    }
    SampleBlock dilated() const {
        SampleBlock wider;
        for (int z = 0; z < kSide; ++z)
            for (int y = 0; y < kSide; ++y) wider.row(y, z) = around(y, z);
        return wider;
    }
    /// Whether it is two samples thick somewhere: what is thinner is sampled in shreds.
    bool is_thick() const {
        for (int z = 0; z + 1 < kSide; ++z)
            for (int y = 0; y + 1 < kSide; ++y) {
                const Word four = row(y, z) & row(y + 1, z) & row(y, z + 1) & row(y + 1, z + 1);
                if (four & Word(four >> 1)) return true;
            }
        return false;
    }
};

using NearBlock = SampleBlock<std::uint8_t>; // two cells along each axis
using FarBlock = SampleBlock<std::uint32_t>; // eight
static_assert(NearBlock::kSide == 2 * kCellsNear * int(kSamplesAlong));
static_assert(FarBlock::kSide == 2 * kCellsFar * int(kSamplesAlong));

/// Finds corners of cells around which two parts lie that do not hang together.
class GapFinder {
public:
    explicit GapFinder(const Occupancy& samples) : samples_(samples) {}

    /// Steps of samples between two parts around a corner of cells, 0 where it joins nothing.
    int gap(const Cells::LatticeIndex& corner) const {
        const auto inside = block<std::uint8_t>(corner, kCellsNear);
        if (inside.is_full()) return 0;
        NearBlock part = inside.first();
        part.flood(inside);
        const NearBlock others = inside.without(part);
        if (others.is_empty()) return 0;
        const auto around = block<std::uint32_t>(corner, kCellsFar);
        FarBlock reached = moved(part.first());
        reached.flood(around);
        const FarBlock left = moved(others).without(reached);
        if (left.is_empty() || reached.count() < kLeastPart || !reached.is_thick()) return 0;
        FarBlock other = left.first();
        other.flood(around);
        if (other.count() < kLeastPart || !other.is_thick()) return 0;
        int steps = 0;
        for (FarBlock wider = reached; !wider.meets(other) && steps < FarBlock::kSide; ++steps) wider = wider.dilated();
        return steps - 1;
    }

    /// Whether the cells around a corner hold two parts that do not hang together in these, neither of them a fleck: a
    /// gap, or a crease that is deeper than a cell.
    bool parts_near(const Cells::LatticeIndex& corner) const {
        const auto inside = block<std::uint8_t>(corner, kCellsNear);
        if (inside.is_full()) return false;
        int parts = 0;
        for (NearBlock left = inside; !left.is_empty() && parts < 2;) {
            NearBlock part = left.first();
            part.flood(inside);
            left = left.without(part);
            parts += part.count() >= kLeastNear && part.is_thick();
        }
        return parts == 2;
    }

private:
    /// Up to 32 samples of a row from `x` on; none outside.
    std::uint32_t bits(int x, int y, int z) const {
        if (y < 0 || z < 0 || y >= int(samples_.counts[1]) || z >= int(samples_.counts[2])) return 0;
        const std::uint64_t* words =
            &samples_.bits[(std::size_t(z) * samples_.counts[1] + std::size_t(y)) * samples_.words_per_row];
        const auto word = [&](int w) {
            return w < 0 || w >= int(samples_.words_per_row) ? std::uint64_t{0} : words[w];
        };
        const int first = x >> 6, shift = x & 63;
        const std::uint64_t high = shift == 0 ? 0 : word(first + 1) << (64 - shift);
        return std::uint32_t(word(first) >> shift | high);
    }
    template <class Word>
    SampleBlock<Word> block(const Cells::LatticeIndex& corner, int cells) const {
        std::array<int, 3> from;
        for (int axis = 0; axis < 3; ++axis) from[axis] = int(kSamplesAlong) * (int(corner[axis]) - cells);
        SampleBlock<Word> found;
        for (int z = 0; z < found.kSide; ++z)
            for (int y = 0; y < found.kSide; ++y) found.row(y, z) = Word(bits(from[0], from[1] + y, from[2] + z));
        return found;
    }
    static FarBlock moved(const NearBlock& block) {
        constexpr int kAside = (kCellsFar - kCellsNear) * int(kSamplesAlong);
        FarBlock found;
        for (int z = 0; z < block.kSide; ++z)
            for (int y = 0; y < block.kSide; ++y)
                found.row(y + kAside, z + kAside) = std::uint32_t(block.row(y, z)) << kAside;
        return found;
    }

    const Occupancy& samples_;
};

} // namespace filigree
