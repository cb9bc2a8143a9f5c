#include "filigree/physics/body/joined_parts.h"
#include "filigree/core/math.h"
#include "filigree/sample/closure.h"

#include "filigree/core/parallel_for.h"
#include "filigree/core/text.h"
#include "filigree/physics/body/occupied_cells.h"
#include "filigree/physics/body/sample_blocks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>

namespace filigree {

namespace {

using mesh_cells::Grid;

constexpr double kMostBoxCells = 0x1p24;
/// Of all corners: fewer that join something are creases, where two parts part that hang together further on.
constexpr double kFewCorners = 0.008;
constexpr std::size_t kFewestCorners = 6;

std::string two_digits(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g", x);
    return text;
}

Grid grid_of(const Cells& cells, double scale) {
    Grid grid{cells.spacing / scale, cells.origin / scale, {}};
    for (const auto& cell : cells.cells)
        for (int axis = 0; axis < 3; ++axis)
            grid.counts[axis] = std::max(grid.counts[axis], std::size_t(cell[axis]) + 1);
    return grid;
}

} // namespace

JoinedParts joined_parts_of(std::span<const std::uint8_t> gaps, const Cells& cells) {
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

Result<std::optional<Occupancy>> gap_samples(std::span<const Vec3f> positions, const WeldedTriangles& welded,
                                             double scale, const Cells& cells, const RunContext& context) {
    const Grid grid = grid_of(cells, scale);
    if (double(grid.counts[0]) * double(grid.counts[1]) * double(grid.counts[2]) > kMostBoxCells)
        return std::optional<Occupancy>();
    const Result<InsideSampler> sampler =
        InsideSampler::create(positions, welded, {.overlap = Overlap::merged}, context);
    if (!sampler) return sampler.error();
    if (sampler->used() != InsideMethod::scan) return std::optional<Occupancy>();
    Result<Occupancy> samples =
        sampler->inside(mesh_cells::sample_points(grid, kSamplesAlong, 0, grid.counts[2]), context);
    if (!samples) return samples.error();
    return std::optional<Occupancy>(std::move(*samples));
}

Result<JoinedParts> find_joined_parts(std::span<const Vec3f> positions, const WeldedTriangles& welded, double scale,
                                      const Cells& cells, const RunContext& context) {
    RunContext quiet = context;
    quiet.progress = nullptr;
    const Result<std::optional<Occupancy>> samples = gap_samples(positions, welded, scale, cells, quiet);
    if (!samples) return samples.error();
    if (!*samples) return JoinedParts{};
    const GapFinder finder(**samples);
    std::vector<std::uint8_t> gaps(cells.corners.size());
    parallel_for(quiet, gaps.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end && !quiet.is_cancelled(); ++c)
            gaps[c] = std::uint8_t(finder.gap(cells.corners[c]));
    });
    if (quiet.is_cancelled()) return cancelled_error();
    return joined_parts_of(gaps, cells);
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
