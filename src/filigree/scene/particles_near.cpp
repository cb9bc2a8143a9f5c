#include "filigree/scene/particles_near.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr double kHalfDiagonal = 0.87; // of a cell, in its sides

} // namespace

std::vector<Index> particles_near(const Body& body, std::span<const Vec3f> points) {
    const Vectors& rest = body.rest;
    const float reach = float(kHalfDiagonal * body.spacing());
    std::vector<Index> chosen;
    for (const Vec3f& point : points) {
        Index nearest = 0;
        for (Index i = 0; i < rest.size(); ++i) {
            const float distance = (rest[i] - point).norm();
            if (distance <= reach) chosen.push_back(i);
            if (distance < (rest[nearest] - point).norm()) nearest = i;
        }
        chosen.push_back(nearest);
    }
    std::sort(chosen.begin(), chosen.end());
    chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
    return chosen;
}

} // namespace filigree
