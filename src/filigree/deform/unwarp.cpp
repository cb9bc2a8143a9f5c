#include "filigree/deform/unwarp.h"

#include <Eigen/LU> // inverse

namespace filigree {

Vec3d unwarped(const SpaceWarp& warp, const Vec3d& place, const Vec3d& guess) {
    constexpr int kSteps = 20, kHalvings = 8;
    Vec3d point = guess;
    Warped now = warp.warp(point);
    double distance = (place - now.position).norm();
    for (int step = 0; step < kSteps; ++step) {
        Vec3d way = now.gradient.inverse() * (place - now.position);
        if (!way.allFinite()) break;
        bool is_nearer = false;
        for (int halving = 0; halving < kHalvings && !is_nearer; ++halving, way *= 0.5) {
            const Warped next = warp.warp(point + way);
            const double next_distance = (place - next.position).norm();
            is_nearer = next_distance < distance;
            if (!is_nearer) continue;
            point += way;
            now = next;
            distance = next_distance;
        }
        if (!is_nearer) break;
    }
    return point;
}

} // namespace filigree
