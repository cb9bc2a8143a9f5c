#include "filigree/deform/carried_points.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/mesh.h"

#include <algorithm>

namespace filigree {

std::vector<Vec3f> carried_points(std::span<const Vec3f> rest, std::span<const Vec3f> driver, const Pose& pose,
                                  const RunContext& context) {
    std::vector<Vec3f> carried(rest.begin(), rest.end());
    if (rest.empty()) return carried;
    constexpr std::size_t kMostPairs = 1'500'000, kLeast = 64; // a few milliseconds
    const std::size_t most = std::clamp(kMostPairs / rest.size(), kLeast, driver.size() + kLeast);
    const std::size_t step = (driver.size() + most - 1) / most;
    const float least = 1e-6f * bounds(driver).size().cast<float>().squaredNorm();
    parallel_for(context, rest.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Vec3f place = Vec3f::Zero();
            float sum = 0;
            for (std::size_t v = 0; v < driver.size(); v += step) {
                const Vec3f offset = rest[i] - driver[v];
                const float distance2 = offset.squaredNorm() + least, weight = 1 / (distance2 * distance2);
                const Vec3f turned = pose.gradients.empty() ? offset : Vec3f(pose.gradients[v] * offset);
                place += weight * (pose.positions[v] + turned);
                sum += weight;
            }
            carried[i] = place / sum;
        }
    });
    return carried;
}

} // namespace filigree
