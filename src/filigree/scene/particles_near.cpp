#include "filigree/scene/particles_near.h"

#include "filigree/physics/body/point_grid.h"

#include <cstdint>
#include <limits>

namespace filigree {

namespace {

constexpr double kHalfDiagonal = 0.87; // of a cell, in its sides
constexpr float kFarAway = 8;          // times that: no grid is of use beyond

} // namespace

std::vector<Index> particles_near(const Body& body, std::span<const Vec3f> points) {
    const Vectors& rest = body.rest;
    const float reach = float(kHalfDiagonal * body.spacing());
    const PointGrid grid(rest, reach);
    std::vector<std::uint8_t> is_chosen(rest.size(), 0);
    for (const Vec3f& point : points) {
        Index nearest = kNoIndex;
        float least = std::numeric_limits<float>::infinity();
        const auto look_at = [&](Index i) {
            const float distance = (rest[i] - point).norm();
            if (distance <= reach) is_chosen[i] = 1;
            if (distance > least || (distance == least && i > nearest)) return;
            nearest = i;
            least = distance;
        };
        // A ball of such a radius that something lies in it holds the nearest; most points lie among particles.
        float around = reach;
        for (; !(least <= around) && around < kFarAway * reach; around *= 2) grid.near(point, around, look_at);
        for (Index i = 0; !(least <= around) && i < rest.size(); ++i) look_at(i);
        is_chosen[nearest] = 1;
    }
    std::vector<Index> chosen;
    for (Index i = 0; i < rest.size(); ++i)
        if (is_chosen[i]) chosen.push_back(i);
    return chosen;
}

} // namespace filigree
