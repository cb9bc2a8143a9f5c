// Based on:
//   [Mueller 2004] Point based animation of elastic, plastic and melting objects: gradients of the displacement by
//   moving least squares over neighbours. Ours weights them by volume, and enlarges the radius for the pairs of a
//   particle with too few.
#include "filigree/physics/meshfree/mls_neighbours.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/body/point_grid.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace filigree {
namespace {

constexpr float kSupportRadius = 1.74f;     // spacings
constexpr float kMostRadius = 3.6f;         // spacings: neighbours are not looked for farther away
constexpr float kGrowth = 1.2f;             // of the radius, a try
constexpr std::size_t kEnough = 8;          // neighbours
constexpr float kLeastMomentSpread = 0.03f; // spacings^2: weighted mean square of offsets in the direction of the least
constexpr float kNoSpread = 0.03f;          // below it there is no gradient in that direction
constexpr std::size_t kMlsNeighboursGrain = 256;

float kernel(float squared, float radius) {
    const float t = 1 - squared / (radius * radius);
    return t > 0 ? t * t * t : 0.f;
}

/// The particles and what each has around it, before pairs are weighted.
struct Surroundings {
    const Vectors& positions;
    std::span<const float> volume;
    float spacing;
    std::vector<std::vector<Index>> found; // of each particle
    std::vector<float> radius;             // of each particle on its own
};

/// Neighbours of one particle within `radius`. Whether they are enough and spread in all directions.
bool look_within(float radius, std::size_t i, const PointGrid& grid, Surroundings& around) {
    std::vector<Index>& found = around.found[i];
    found.clear();
    Mat3f moment = Mat3f::Zero();
    float sum = 0;
    grid.near(around.positions[i], radius, [&](Index j) {
        const Vec3f d = around.positions[j] - around.positions[i];
        const float squared = d.squaredNorm();
        if (j == i || squared >= radius * radius) return;
        found.push_back(j);
        const float weight = around.volume[j] * kernel(squared, radius);
        moment += (weight * d) * d.transpose();
        sum += weight;
    });
    if (found.size() < kEnough || !(sum > 0)) return false;
    return symmetric_eigenvalues(moment / sum)[0] >= kLeastMomentSpread * around.spacing * around.spacing;
}

Surroundings find_surroundings(const Vectors& positions, std::span<const float> volume, float spacing,
                               const RunContext& context) {
    const std::size_t n = positions.size();
    Surroundings around{positions, volume, spacing, std::vector<std::vector<Index>>(n), std::vector<float>(n)};
    const PointGrid grid(positions, kSupportRadius * spacing);
    parallel_for(context, n, kMlsNeighboursGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            float radius = kSupportRadius * spacing;
            while (!look_within(radius, i, grid, around) && !(radius > kMostRadius * spacing)) radius *= kGrowth;
            around.radius[i] = radius;
        }
    });
    // A pair has the larger radius of its two.
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0, count = around.found[i].size(); k < count; ++k) {
            const Index j = around.found[i][k];
            if (around.radius[i] > around.radius[j] &&
                (positions[j] - positions[i]).squaredNorm() >= around.radius[j] * around.radius[j])
                around.found[j].push_back(Index(i));
        }
    parallel_for(context, n, kMlsNeighboursGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) std::sort(around.found[i].begin(), around.found[i].end());
    });
    return around;
}

/// Sums over the pairs of one particle.
struct PairSums {
    Mat3f moment = Mat3f::Zero();
    Vec3f first = Vec3f::Zero(); // moment
    float weight = 0;
};

/// Writes the pairs of particle i.
PairSums weigh_pairs(std::size_t i, const Surroundings& around, float inverse_cube, MlsNeighbours& result) {
    PairSums sums;
    for (std::size_t k = 0; k < around.found[i].size(); ++k) {
        const Index j = around.found[i][k];
        const Vec3f d = around.positions[j] - around.positions[i];
        const float r = std::max(around.radius[i], around.radius[j]), squared = d.squaredNorm();
        const float s = (around.volume[i] * inverse_cube) * (around.volume[j] * inverse_cube) * kernel(squared, r);
        result.neighbours[result.offsets[i] + k] = j;
        result.pairs[result.offsets[i] + k] = Float4{s * d.x(), s * d.y(), s * d.z(), s};
        sums.moment += (s * d) * d.transpose();
        sums.first += s * d;
        sums.weight += s;
    }
    return sums;
}

struct InverseMoment {
    Mat3f inverse = Mat3f::Zero(), missing = Mat3f::Zero(); // the latter: directions without a gradient
};

InverseMoment invert(const PairSums& sums, float spacing, std::size_t neighbour_count) {
    const float unit = sums.weight * spacing * spacing; // the mean square: eigenvalues then compare with spreads
    const auto [values, vectors] = symmetric_eigen(sums.weight > 0 ? Mat3f(sums.moment / unit) : Mat3f::Zero());
    InverseMoment result;
    for (int a = 0; a < 3; ++a) {
        const Vec3f axis = vectors.col(a);
        const float value = values[a];
        if (value >= kNoSpread && neighbour_count >= 3)
            result.inverse += axis * axis.transpose() / (value * sums.weight * spacing * spacing);
        else
            result.missing += axis * axis.transpose();
    }
    return result;
}

} // namespace

MlsNeighbours find_mls_neighbours(const Vectors& positions, std::span<const float> volume, double spacing,
                                  const RunContext& context) {
    const std::size_t n = positions.size();
    const auto h = float(spacing);
    const float inverse_cube = float(1 / (spacing * spacing * spacing));
    const Surroundings around = find_surroundings(positions, volume, h, context);

    MlsNeighbours result;
    result.offsets.resize(n + 1);
    for (std::size_t i = 0; i < n; ++i) result.offsets[i + 1] = Index(result.offsets[i] + around.found[i].size());
    result.neighbours.resize(result.offsets[n]);
    result.pairs.resize(result.offsets[n]);
    result.weight_sum.resize(n);
    result.inverse_moment.resize(n);
    result.self_gradient.resize(n);
    result.missing.resize(n);
    parallel_for(context, n, kMlsNeighboursGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const PairSums sums = weigh_pairs(i, around, inverse_cube, result);
            result.weight_sum[i] = sums.weight;
            const InverseMoment moment = invert(sums, h, around.found[i].size());
            const Mat3f& inverse = moment.inverse;
            result.inverse_moment[i] = {inverse(0, 0), inverse(1, 1), inverse(2, 2),
                                        inverse(0, 1), inverse(0, 2), inverse(1, 2)};
            result.self_gradient[i] = -result.gradient(i, sums.first);
            result.missing[i] = moment.missing;
        }
    });
    result.lonely_particles = std::size_t(
        std::count_if(result.missing.begin(), result.missing.end(), [](const Mat3f& m) { return !m.isZero(0); }));
    if (result.lonely_particles == 0) result.missing = {};
    return result;
}

} // namespace filigree
