#include "filigree/deform/carried_points.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh.h"

#include <algorithm>
#include <cmath>

namespace filigree {

std::vector<Vec3f> carried_points(std::span<const Vec3f> rest, std::span<const Vec3f> driver, const Pose& pose,
                                  const RunContext& context) {
    std::vector<Vec3f> carried(rest.begin(), rest.end());
    if (rest.empty()) return carried;
    constexpr float kFarthest2 = 1e12f; // squared, of the driver's size: all vertices of it are as far then
    constexpr std::size_t kMostPairs = 1'500'000, kLeast = 64; // a few milliseconds
    const std::size_t most = std::clamp(kMostPairs / rest.size(), kLeast, driver.size() + kLeast);
    const std::size_t step = (driver.size() + most - 1) / most;
    // In a box of about one unit: by powers of two, so that no digit changes, and units of any size serve.
    const double size = bounds(driver).size().norm();
    const float to_unit = size > 0 ? math::exp2(float(-std::clamp(std::ilogb(size), -126, 126))) : 1;
    const float least = 1e-6f * float(size * double(to_unit) * size * double(to_unit));
    parallel_for(context, rest.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Vec3f place = Vec3f::Zero();
            float sum = 0;
            for (std::size_t v = 0; v < driver.size(); v += step) {
                const Vec3f offset = to_unit * (rest[i] - driver[v]);
                const float distance2 = std::min(offset.squaredNorm() + least, kFarthest2);
                const float weight = 1 / (distance2 * distance2);
                const Vec3f turned = pose.gradients.empty() ? offset : Vec3f(pose.gradients[v] * offset);
                place += weight * (to_unit * pose.positions[v] + turned);
                sum += weight;
            }
            carried[i] = (place / sum) / to_unit;
        }
    });
    return carried;
}

} // namespace filigree
