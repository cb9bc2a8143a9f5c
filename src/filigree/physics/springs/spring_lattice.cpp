// From a body's cells to springs, and from springs to runs of particles that share a stencil.
#include "filigree/physics/springs/spring_kernel.h"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace filigree::spring_kernel {

namespace {

constexpr double kSpringStiffness = 0.4; // of E h: gives Young's modulus E with axis and face springs alike
constexpr float kLeastLength = 1e-6f;    // of the rest length: a shorter spring has its direction at rest
constexpr std::size_t kLongestRun = 256; // particles, so that threads have something to share
constexpr std::size_t kMostLanes = 16;
constexpr std::size_t kBending = kAxis + kFace;
constexpr std::array<std::array<int, 3>, kStencil> kSteps = {{
    {1, 0, 0},  {-1, 0, 0}, {0, 1, 0}, {0, -1, 0},  {0, 0, 1},  {0, 0, -1}, {1, 1, 0}, {-1, -1, 0},
    {1, -1, 0}, {-1, 1, 0}, {1, 0, 1}, {-1, 0, -1}, {1, 0, -1}, {-1, 0, 1}, {0, 1, 1}, {0, -1, -1},
    {0, 1, -1}, {0, -1, 1}, {2, 0, 0}, {-2, 0, 0},  {0, 2, 0},  {0, -2, 0}, {0, 0, 2}, {0, 0, -2},
}};

/// Number of the step from one corner of a cell to another; kStencil for a diagonal of the body of the cell.
std::size_t stencil_number(std::size_t from, std::size_t to) {
    std::array<int, 3> step{};
    for (std::size_t a = 0; a < 3; ++a) step[a] = int(to >> a & 1) - int(from >> a & 1);
    return std::size_t(std::find(kSteps.begin(), kSteps.end(), step) - kSteps.begin());
}

} // namespace

std::vector<Star> make_stars(const Body& body) {
    const Cells& cells = body.cells;
    Star none;
    none.other.fill(kNoIndex);
    none.stiffness.fill(0);
    std::vector<Star> stars(body.particle_count(), none);

    const double whole = kSpringStiffness * body.material.young_modulus * cells.spacing;
    for (std::size_t c = 0; c < cells.cells.size(); ++c)
        for (std::size_t a = 0; a < 8; ++a)
            for (std::size_t b = 0; b < 8; ++b) {
                const std::size_t s = stencil_number(a, b);
                if (a == b || s >= kStencil) continue;
                Star& star = stars[cells.cell_corners[c][a]];
                star.other[s] = cells.cell_corners[c][b];
                star.stiffness[s] += float(whole * (s < kAxis ? 0.25 : 0.5) * double(cells.fraction[c]));
            }

    const float bending = float(body.material.bending);
    if (!(bending > 0)) return stars;
    const std::vector<Star> unbent = stars;
    for (std::size_t i = 0; i < stars.size(); ++i)
        for (std::size_t s = 0; s < kAxis; ++s) {
            const Index middle = unbent[i].other[s];
            if (middle == kNoIndex || unbent[middle].other[s] == kNoIndex) continue;
            const float first = unbent[i].stiffness[s], second = unbent[middle].stiffness[s];
            const float k = bending * std::min(first, second);
            stars[i].other[kBending + s] = unbent[middle].other[s];
            stars[i].stiffness[kBending + s] = k;
            stars[i].stiffness[s] -= 2 * k;          // the spring to the middle, seen from here
            stars[middle].stiffness[s ^ 1] -= 2 * k; // and seen from the middle
        }
    return stars;
}

Runs make_runs(const std::vector<Star>& stars) {
    constexpr std::int64_t kOpen = std::numeric_limits<std::int64_t>::max();
    Runs result;
    const std::size_t n = stars.size();
    for (std::size_t first = 0; first < n;) {
        std::array<std::int64_t, kStencil> offset;
        offset.fill(kOpen);
        std::size_t end = first;
        for (; end < n && end - first < kLongestRun; ++end) {
            std::array<std::int64_t, kStencil> next = offset;
            bool fits = true;
            for (std::size_t s = 0; s < kStencil; ++s) {
                if (stars[end].other[s] == kNoIndex) continue;
                const std::int64_t here = std::int64_t(stars[end].other[s]) - std::int64_t(end);
                fits = fits && (next[s] == kOpen || next[s] == here);
                next[s] = here;
                // Particles without this neighbour read there all the same, so it has to be in the arrays.
                fits = fits && std::int64_t(first) + here >= 0;
            }
            for (std::size_t s = 0; s < kStencil; ++s)
                fits = fits && (next[s] == kOpen || std::int64_t(end) + next[s] < std::int64_t(n));
            if (!fits) break;
            offset = next;
        }
        const std::size_t count = end - first;
        Run run{Index(first), Index(count), Index(result.slots.size()), 0};
        const std::size_t padded = (count + kMostLanes - 1) / kMostLanes * kMostLanes;
        for (std::size_t s = 0; s < kStencil; ++s) {
            if (offset[s] == kOpen) continue;
            result.slots.push_back({std::int32_t(offset[s]), Index(result.stiffness.size()), Index(s)});
            ++run.slot_count;
            for (std::size_t t = 0; t < padded; ++t)
                result.stiffness.push_back(t < count ? stars[first + t].stiffness[s] : 0);
        }
        result.runs.push_back(run);
        first = end;
    }
    return result;
}

std::array<Step, kStencil> make_steps(double spacing) {
    std::array<Step, kStencil> steps;
    for (std::size_t s = 0; s < kStencil; ++s) {
        const Vec3d d = Vec3d(kSteps[s][0], kSteps[s][1], kSteps[s][2]) * spacing;
        const float least = kLeastLength * float(d.norm());
        steps[s] = {float(d.norm()), least * least, (d.normalized() * double(least)).cast<float>()};
    }
    return steps;
}

} // namespace filigree::spring_kernel
