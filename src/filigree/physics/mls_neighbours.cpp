// Based on:
//   [Mueller 2004] Point based animation of elastic, plastic and melting objects: gradients of the displacement by
//   moving least squares over neighbours. Ours weights them by volume, and enlarges the radius for the pairs of a
//   particle with too few.
#include "filigree/physics/mls_neighbours.h"

#include "filigree/core/parallel_for.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

namespace filigree {
namespace {

constexpr float kRadius = 1.74f;      // spacings
constexpr float kMostRadius = 3.6f;   // spacings: neighbours are not looked for farther away
constexpr float kGrowth = 1.2f;       // of the radius, a try
constexpr std::size_t kEnough = 8;    // neighbours
constexpr float kLeastSpread = 0.03f; // spacings^2: weighted mean square of offsets in the direction of the least
constexpr float kNoSpread = 0.03f;    // below it there is no gradient in that direction
constexpr std::size_t kGrain = 256;

/// Particles sorted by the cells of a grid.
class Grid {
public:
    Grid(const Vectors& positions, float cell_size) : positions_(positions), inverse_size_(1 / double(cell_size)) {
        const std::size_t n = positions.size();
        least_ = Vec3d::Constant(std::numeric_limits<double>::infinity());
        for (std::size_t i = 0; i < n; ++i) least_ = least_.cwiseMin(positions[i].cast<double>());
        sorted_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            const auto at = cell_of(positions[i]);
            sorted_[i] = {key(at[0], at[1], at[2]), Index(i)};
        }
        std::sort(sorted_.begin(), sorted_.end());
    }

    /// Calls visit(index) for all particles in cells within `radius` of a point, and some more.
    template <class Visit>
    void near(const Vec3f& point, float radius, const Visit& visit) const {
        const auto low = cell_of(point - Vec3f::Constant(radius)), high = cell_of(point + Vec3f::Constant(radius));
        for (std::int64_t k = low[2]; k <= high[2]; ++k)
            for (std::int64_t j = low[1]; j <= high[1]; ++j) {
                const Entry first{key(low[0], j, k), 0};
                const std::uint64_t last = key(high[0], j, k);
                for (auto e = std::lower_bound(sorted_.begin(), sorted_.end(), first);
                     e != sorted_.end() && e->key <= last; ++e)
                    visit(e->particle);
            }
    }

private:
    static constexpr std::int64_t kMostCells = (std::int64_t{1} << 21) - 1;
    struct Entry {
        std::uint64_t key;
        Index particle;
        auto operator<=>(const Entry&) const = default;
    };

    std::array<std::int64_t, 3> cell_of(const Vec3f& point) const {
        std::array<std::int64_t, 3> cell;
        for (int a = 0; a < 3; ++a) {
            const double at = std::floor((double(point[a]) - least_[a]) * inverse_size_);
            cell[std::size_t(a)] = std::int64_t(std::clamp(at, 0.0, double(kMostCells)));
        }
        return cell;
    }
    static std::uint64_t key(std::int64_t i, std::int64_t j, std::int64_t k) {
        return (std::uint64_t(k) << 42) | (std::uint64_t(j) << 21) | std::uint64_t(i);
    }

    const Vectors& positions_;
    double inverse_size_;
    Vec3d least_;
    std::vector<Entry> sorted_;
};

float kernel(float squared, float radius) {
    const float t = 1 - squared / (radius * radius);
    return t > 0 ? t * t * t : 0.f;
}

/// Kernel sum in a full lattice, the particle itself included.
float full_density() {
    float sum = 0;
    for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i) sum += kernel(float(i * i + j * j + k * k), kRadius);
    return sum;
}

} // namespace

MlsNeighbours find_mls_neighbours(const Vectors& positions, std::span<const float> volume, double spacing,
                                  const RunContext& context) {
    const std::size_t n = positions.size();
    const auto h = float(spacing);
    const float inverse_cube = float(1 / (spacing * spacing * spacing));
    const Grid grid(positions, kRadius * h);

    // The radius of each particle on its own, and the neighbours within.
    std::vector<std::vector<Index>> found(n);
    std::vector<float> radius(n);
    parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            for (float r = kRadius * h;; r *= kGrowth) {
                found[i].clear();
                Mat3f moment = Mat3f::Zero();
                float sum = 0;
                grid.near(positions[i], r, [&](Index j) {
                    const Vec3f d = positions[j] - positions[i];
                    const float squared = d.squaredNorm();
                    if (j == i || squared >= r * r) return;
                    found[i].push_back(j);
                    const float weight = volume[j] * kernel(squared, r);
                    moment += (weight * d) * d.transpose();
                    sum += weight;
                });
                radius[i] = r;
                if (r > kMostRadius * h) break;
                if (found[i].size() < kEnough || !(sum > 0)) continue;
                const Eigen::SelfAdjointEigenSolver<Mat3f> eigen(moment / sum, Eigen::EigenvaluesOnly);
                if (eigen.eigenvalues()[0] >= kLeastSpread * h * h) break;
            }
    });
    // A pair has the larger radius of its two.
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0, count = found[i].size(); k < count; ++k) {
            const Index j = found[i][k];
            if (radius[i] > radius[j] && (positions[j] - positions[i]).squaredNorm() >= radius[j] * radius[j])
                found[j].push_back(Index(i));
        }

    MlsNeighbours result;
    result.offsets.resize(n + 1);
    for (std::size_t i = 0; i < n; ++i) result.offsets[i + 1] = Index(result.offsets[i] + found[i].size());
    result.neighbours.resize(result.offsets[n]);
    result.pairs.resize(result.offsets[n]);
    result.weight_sum.resize(n);
    result.inverse_moment.resize(n);
    result.self_gradient.resize(n);
    result.exposure.resize(n);
    result.density.resize(n);
    std::vector<Mat3f> missing(n, Mat3f::Zero());
    std::vector<std::uint8_t> is_lonely(n);
    const float full = full_density();
    parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            std::sort(found[i].begin(), found[i].end());
            Mat3f moment = Mat3f::Zero();
            Vec3f first = Vec3f::Zero();
            float sum = 0, length = 0, density = volume[i];
            for (std::size_t k = 0; k < found[i].size(); ++k) {
                const Index j = found[i][k];
                const Vec3f d = positions[j] - positions[i];
                const float r = std::max(radius[i], radius[j]), squared = d.squaredNorm();
                const float s = (volume[i] * inverse_cube) * (volume[j] * inverse_cube) * kernel(squared, r);
                result.neighbours[result.offsets[i] + k] = j;
                result.pairs[result.offsets[i] + k] = Float4{s * d.x(), s * d.y(), s * d.z(), s};
                moment += (s * d) * d.transpose();
                first += s * d;
                sum += s;
                length += s * std::sqrt(squared);
                density += volume[j] * kernel(squared, kRadius * h);
            }
            result.weight_sum[i] = sum;
            result.density[i] = density * inverse_cube / full;
            result.exposure[i] = length > 0 ? std::clamp(first.norm() / length / 0.15f - 1, 0.f, 1.f) : 1.f;

            // In units of the mean square, so that eigenvalues compare with spreads.
            const Eigen::SelfAdjointEigenSolver<Mat3f> eigen(sum > 0 ? Mat3f(moment / (sum * h * h)) : Mat3f::Zero());
            Mat3f inverse = Mat3f::Zero();
            for (int a = 0; a < 3; ++a) {
                const Vec3f axis = eigen.eigenvectors().col(a);
                const float value = eigen.eigenvalues()[a];
                if (value >= kNoSpread && found[i].size() >= 3)
                    inverse += axis * axis.transpose() / (value * sum * h * h);
                else {
                    missing[i] += axis * axis.transpose();
                    is_lonely[i] = 1;
                }
            }
            result.inverse_moment[i] = {inverse(0, 0), inverse(1, 1), inverse(2, 2),
                                        inverse(0, 1), inverse(0, 2), inverse(1, 2)};
            result.self_gradient[i] = -result.gradient(i, first);
        }
    });
    result.lonely_particles = std::size_t(std::count(is_lonely.begin(), is_lonely.end(), 1));
    if (result.lonely_particles > 0) result.missing = std::move(missing);
    return result;
}

} // namespace filigree
