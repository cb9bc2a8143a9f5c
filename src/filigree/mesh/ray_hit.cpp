#include "filigree/mesh/ray_hit.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace filigree {

namespace {

constexpr double kRim = 1e-12;    // barycentric: no ray slips through between two neighbours
constexpr double kEdgeOn = 1e-13; // sine: seen from the side, or without area
constexpr std::size_t kPiece = 1 << 14;

/// Distance and the barycentrics of b and c; infinite: not met.
struct Meeting {
    double distance = std::numeric_limits<double>::infinity(), v = 0, w = 0;
};

Meeting meet(const Vec3d& a, const Vec3d& ab, const Vec3d& ac, const Vec3d& origin, const Vec3d& direction) {
    const Vec3d p = direction.cross(ac);
    const double determinant = ab.dot(p);
    if (determinant == 0) return {};
    const Vec3d from_a = origin - a;
    const double v = from_a.dot(p) / determinant;
    if (!(v >= -kRim && v <= 1 + kRim)) return {};
    const Vec3d q = from_a.cross(ab);
    const double w = direction.dot(q) / determinant;
    if (!(w >= -kRim && v + w <= 1 + kRim)) return {};
    const double distance = ac.dot(q) / determinant;
    if (!(distance >= 0)) return {};
    if (std::abs(determinant) <= kEdgeOn * ab.norm() * ac.norm() * direction.norm()) return {};
    return {distance, v, w};
}

} // namespace

std::optional<RayHit> first_hit(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                const Vec3d& origin, const Vec3d& direction, const RunContext& context) {
    struct Best {
        Meeting meeting;
        std::size_t triangle = 0;
    };
    std::vector<Best> best_of_piece((triangles.size() + kPiece - 1) / kPiece);
    parallel_for(context, triangles.size(), kPiece, [&](std::size_t begin, std::size_t end) {
        Best best;
        for (std::size_t t = begin; t < end; ++t) {
            const Vec3d a = positions[triangles[t][0]].cast<double>();
            const Vec3d ab = positions[triangles[t][1]].cast<double>() - a;
            const Vec3d ac = positions[triangles[t][2]].cast<double>() - a;
            const Meeting meeting = meet(a, ab, ac, origin, direction);
            if (meeting.distance < best.meeting.distance) best = {meeting, t};
        }
        best_of_piece[begin / kPiece] = best;
    });
    Best first;
    for (const Best& best : best_of_piece)
        if (best.meeting.distance < first.meeting.distance) first = best;
    if (!std::isfinite(first.meeting.distance)) return std::nullopt;
    const double v = std::clamp(first.meeting.v, 0.0, 1.0), w = std::clamp(first.meeting.w, 0.0, 1 - v);
    return RayHit{static_cast<Index>(first.triangle), Vec3d(1 - v - w, v, w).cast<float>(), first.meeting.distance};
}

} // namespace filigree
