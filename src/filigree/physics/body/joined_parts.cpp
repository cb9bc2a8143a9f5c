#include "filigree/physics/body/joined_parts.h"
#include "filigree/core/math.h"
#include "filigree/sample/closure.h"

#include "filigree/core/parallel_for.h"
#include "filigree/core/text.h"
#include "filigree/physics/body/occupied_cells.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>

namespace filigree {

namespace {

using mesh_cells::Grid;

constexpr unsigned kSamplesAlong = 4; // of a cell
constexpr double kMostBoxCells = 0x1p24;
constexpr int kCellsNear = 1, kCellsFar = 4; ///< cells to either side of a corner that are looked at
constexpr int kLeastPart = 64;               ///< samples: smaller parts are flecks
/// Of all corners: fewer that join something are creases, where two parts part that hang together further on.
constexpr double kFewCorners = 0.008;
constexpr std::size_t kFewestCorners = 6;

std::string two_digits(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g", x);
    return text;
}

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

JoinedParts parts_of(const std::vector<std::uint8_t>& gaps, const Cells& cells) {
    std::vector<std::uint8_t> all;
    JoinedParts joined;
    std::size_t narrowest = gaps.size();
    for (std::size_t c = 0; c < gaps.size(); ++c) {
        if (gaps[c] == 0) continue;
        all.push_back(gaps[c]);
        if (narrowest == gaps.size() || gaps[c] < gaps[narrowest]) narrowest = c;
    }
    if (all.size() < kFewestCorners || double(all.size()) < kFewCorners * double(gaps.size())) return joined;
    const auto middle = all.begin() + std::ptrdiff_t(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    const double step = cells.spacing / kSamplesAlong;
    joined.corners = all.size();
    joined.gap = (*middle - 0.5) * step; // between one step less and one more
    const auto& at = cells.corners[narrowest];
    joined.place = (cells.origin + cells.spacing * Vec3d(at[0], at[1], at[2])).cast<float>();
    return joined;
}

Grid grid_of(const Cells& cells, double scale) {
    Grid grid{cells.spacing / scale, cells.origin / scale, {}};
    for (const auto& cell : cells.cells)
        for (int axis = 0; axis < 3; ++axis)
            grid.counts[axis] = std::max(grid.counts[axis], std::size_t(cell[axis]) + 1);
    return grid;
}

} // namespace

Result<JoinedParts> find_joined_parts(std::span<const Vec3f> positions, const WeldedTriangles& welded, double scale,
                                      const Cells& cells, const RunContext& context) {
    RunContext quiet = context;
    quiet.progress = nullptr;
    const Grid grid = grid_of(cells, scale);
    if (double(grid.counts[0]) * double(grid.counts[1]) * double(grid.counts[2]) > kMostBoxCells) return JoinedParts{};
    const Result<InsideSampler> sampler = InsideSampler::create(positions, welded, {.overlap = Overlap::merged}, quiet);
    if (!sampler) return sampler.error();
    if (sampler->used() != InsideMethod::scan) return JoinedParts{};
    const Result<Occupancy> samples =
        sampler->inside(mesh_cells::sample_points(grid, kSamplesAlong, 0, grid.counts[2]), quiet);
    if (!samples) return samples.error();

    const GapFinder finder(*samples);
    std::vector<std::uint8_t> gaps(cells.corners.size());
    parallel_for(quiet, gaps.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end && !quiet.is_cancelled(); ++c)
            gaps[c] = std::uint8_t(finder.gap(cells.corners[c]));
    });
    if (quiet.is_cancelled()) return cancelled_error();
    return parts_of(gaps, cells);
}

std::string joined_sentence(const JoinedParts& joined, double spacing, std::size_t particles) {
    if (joined.corners == 0) return "";
    const double finer = joined.gap / 2; // for any place of the gap between the cells
    const double count = double(particles) * math::pow(spacing / finer, 3);
    const double unit = math::power_of_ten(int(std::floor(math::log10(count))) - 1); // of the second digit
    const Vec3f& at = joined.place;
    return "Parts with a gap between them are nearer to each other than two particles and move as one, at " +
           with_commas(joined.corners) + " corners of cells; the gap is about " + two_digits(joined.gap) +
           " m wide, and narrowest near (" + two_digits(double(at.x())) + ", " + two_digits(double(at.y())) + ", " +
           two_digits(double(at.z())) + ") m. A spacing of " + two_digits(finer) + " m (about " +
           with_commas(std::uint64_t(std::round(count / unit) * unit)) + " particles) parts most of them.";
}

} // namespace filigree
