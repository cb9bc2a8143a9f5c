// Clouds of particles, and what holds of every surface of them.
#pragma once

#include "filigree/core/random.h"
#include "filigree/mesh.h"
#include "filigree/physics/simulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace filigree_test {

using namespace filigree;

inline constexpr float kSpacing = 0.05f;

struct Dice {
    std::uint64_t seed, rolls = 0;
    float roll() { return float(random_unit(seed, rolls++)); }
    Vec3f point() {
        const float x = roll(), y = roll();
        return {x, y, roll()};
    }
};

inline MatterParticles matter_where(const std::function<bool(const Vec3f&)>& is_inside, const Vec3f& half,
                                    float jitter = 0, std::uint64_t seed = 1) {
    MatterParticles matter;
    matter.spacing = kSpacing;
    Dice dice{seed};
    const auto steps = [&](int axis) { return int(std::ceil(half[axis] / kSpacing)); };
    for (int z = -steps(2); z < steps(2); ++z)
        for (int y = -steps(1); y < steps(1); ++y)
            for (int x = -steps(0); x < steps(0); ++x) {
                const Vec3f shake = dice.point();
                const Vec3f at = kSpacing * (Vec3f(float(x), float(y), float(z)) + Vec3f::Constant(0.5f) +
                                             jitter * (shake - Vec3f::Constant(0.5f)));
                if (is_inside(at)) matter.positions.push_back(at);
            }
    matter.volumes.assign(matter.positions.size(), kSpacing * kSpacing * kSpacing);
    return matter;
}

inline MatterParticles ball(float radius, float jitter = 0, std::uint64_t seed = 1) {
    return matter_where([&](const Vec3f& at) { return at.norm() < radius; }, Vec3f::Constant(radius), jitter, seed);
}

/// Checks the mesh, and returns its volume.
inline double checked_volume(const Mesh& mesh) {
    EXPECT_EQ(check_mesh(mesh), "");
    const TopologyReport report = analyse_topology(mesh, RunContext(1));
    EXPECT_TRUE(report.is_closed());
    EXPECT_TRUE(report.is_manifold());
    EXPECT_TRUE(report.is_oriented());
    EXPECT_EQ(report.unused_vertices.count, 0u);
    EXPECT_GT(report.volume, 0);
    return report.volume;
}

} // namespace filigree_test
