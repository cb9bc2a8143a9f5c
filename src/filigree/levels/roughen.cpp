#include "filigree/levels/roughen.h"

#include "filigree/core/random.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

/// The largest move, in mean edges at the vertex. 0.17 makes meshoptimizer price length as collapse_edges does, but
/// loses scraps of scans that are as thin as that; from 0.05 on there are no needles.
constexpr float kRoughness = 0.07f;

/// Sums over the triangles at a vertex.
struct Fan {
    Vec3f normal = Vec3f::Zero();  ///< of twice the area
    Vec3f corners = Vec3f::Zero(); ///< the two other corners of each triangle
    float length = 0;              ///< one side of each triangle
    float triangles = 0;
};

std::vector<Fan> fans(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
    std::vector<Fan> fans(positions.size());
    for (const Triangle& t : triangles) {
        const Vec3f normal = (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3f &next = positions[t[(k + 1) % 3]], &last = positions[t[(k + 2) % 3]];
            Fan& fan = fans[t[k]];
            fan.normal += normal;
            fan.corners += next + last;
            fan.length += (next - positions[t[k]]).norm();
            ++fan.triangles;
        }
    }
    return fans;
}

} // namespace

std::vector<Vec3f> roughened(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                             std::span<const Index> names, std::span<const std::uint8_t> keeps) {
    std::vector<Vec3f> rough(positions.begin(), positions.end());
    const std::vector<Fan> all = fans(positions, triangles);
    for (Index v = 0; v < rough.size(); ++v) {
        const Fan& fan = all[v];
        const float length = fan.normal.norm();
        if (!(fan.triangles > 0 && length > 0) || (!keeps.empty() && keeps[v])) continue;
        const Vec3f normal = fan.normal / length;
        const float stands_out = std::abs(normal.dot(fan.corners / (2 * fan.triangles) - positions[v]));
        const float most = std::max(0.0f, kRoughness * fan.length / fan.triangles - stands_out);
        rough[v] += most * float(2 * random_unit(1, names.empty() ? v : names[v]) - 1) * normal;
    }
    return rough;
}

} // namespace filigree
