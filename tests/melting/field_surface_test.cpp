// Surfaces of particles: closed, manifold and oriented whatever the particles, and of their volume.
#include "filigree/core/random.h"
#include "filigree/melting/field_surface.h"
#include "filigree/mesh/topology.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace filigree {
namespace {

constexpr float kSpacing = 0.05f;

struct Dice {
    std::uint64_t seed, rolls = 0;
    float roll() { return float(random_unit(seed, rolls++)); }
    Vec3f point() {
        const float x = roll(), y = roll();
        return {x, y, roll()};
    }
};

MatterParticles matter_where(const std::function<bool(const Vec3f&)>& is_inside, const Vec3f& half, float jitter = 0,
                             std::uint64_t seed = 1) {
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

MatterParticles ball(float radius, float jitter = 0, std::uint64_t seed = 1) {
    return matter_where([&](const Vec3f& at) { return at.norm() < radius; }, Vec3f::Constant(radius), jitter, seed);
}

Mesh surface_of(const MatterParticles& matter, const ParticleFieldOptions& options = {}, unsigned threads = 1) {
    const RunContext context(threads);
    return make_field_surface(make_particle_field(matter, options, context).value(), context).value();
}

/// Checks the mesh, and returns its volume.
double checked_volume(const Mesh& mesh) {
    EXPECT_EQ(check_mesh(mesh), "");
    const TopologyReport report = analyse_topology(mesh, RunContext(1));
    EXPECT_TRUE(report.is_closed());
    EXPECT_TRUE(report.is_manifold());
    EXPECT_TRUE(report.is_oriented());
    EXPECT_EQ(report.unused_vertices.count, 0u);
    EXPECT_GT(report.volume, 0);
    return report.volume;
}

double volume_of(const MatterParticles& matter) {
    double sum = 0;
    for (const float volume : matter.volumes) sum += double(volume);
    return sum;
}

TEST(FieldSurface, BallIsRoundAndOfItsVolume) {
    const MatterParticles matter = ball(0.5f);
    const Mesh mesh = surface_of(matter);
    EXPECT_NEAR(checked_volume(mesh) / volume_of(matter), 1, 0.01);
    const double radius = std::cbrt(volume_of(matter) * 3 / (4 * std::numbers::pi));
    double worst = 0;
    for (const Vec3f& at : mesh.positions) worst = std::max(worst, std::abs(double(at.norm()) - radius));
    EXPECT_LT(worst, 0.5 * double(kSpacing)); // the lattice's steps, smoothed
}

TEST(FieldSurface, VolumeOfBlobsSheetsAndDrops) {
    const auto slab = [](const Vec3f& at) { return std::abs(at[2]) < 2.1f * kSpacing && at.head<2>().norm() < 0.6f; };
    for (const MatterParticles& matter :
         {ball(0.3f, 0.6f, 2), ball(0.15f, 0.3f, 3), matter_where(slab, {0.6f, 0.6f, 0.2f}, 0.5f, 4),
          matter_where([](const Vec3f& at) { return at.cwiseAbs().maxCoeff() < 0.3f; }, Vec3f::Constant(0.3f))})
        EXPECT_NEAR(checked_volume(surface_of(matter)) / volume_of(matter), 1, 0.01);
}

TEST(FieldSurface, ClosedManifoldAndOrientedForAnyCloud) {
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        Dice dice{seed};
        MatterParticles matter;
        matter.spacing = kSpacing;
        const std::size_t count = 1 + std::size_t(400 * double(dice.roll()));
        const float size = kSpacing * (1 + 15 * dice.roll()), flat = dice.roll();
        for (std::size_t i = 0; i < count; ++i)
            matter.positions.push_back(size * dice.point().cwiseProduct(Vec3f(1, 1, flat)));
        matter.volumes.assign(count, kSpacing * kSpacing * kSpacing);
        ParticleFieldOptions options;
        options.cell = 0.4 + 1.2 * double(dice.roll());
        SCOPED_TRACE(seed);
        const Mesh mesh = surface_of(matter, options);
        if (mesh.face_count() != 0) checked_volume(mesh);
    }
}

TEST(FieldSurface, SameBytesForAnyThreads) {
    const MatterParticles matter = ball(0.4f, 0.5f, 9);
    const Mesh one = surface_of(matter, {}, 1), two = surface_of(matter, {}, 2);
    EXPECT_EQ(one.positions, two.positions);
    EXPECT_EQ(one.corners, two.corners);
    EXPECT_EQ(one.normals.values, two.normals.values);
}

TEST(FieldSurface, HostileParticlesGetASentence) {
    const RunContext context(1);
    const auto code_of = [&](const MatterParticles& matter) {
        const Result<ParticleField> field = make_particle_field(matter, {}, context);
        return field ? 0 : int(field.error().code);
    };
    MatterParticles matter = ball(0.1f);
    EXPECT_EQ(code_of(matter), 0);
    matter.positions[0][1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(code_of(matter), int(ErrorCode::usage));
    matter.positions[0] = Vec3f(1e9f, 0, 0);
    EXPECT_EQ(code_of(matter), int(ErrorCode::unsuitable));
    matter = ball(0.1f);
    matter.volumes.pop_back();
    EXPECT_EQ(code_of(matter), int(ErrorCode::usage));
    matter = {};
    EXPECT_EQ(code_of(matter), int(ErrorCode::usage)); // no spacing
    matter.spacing = kSpacing;
    EXPECT_EQ(surface_of(matter).face_count(), 0u);
}

TEST(FieldSurface, OneParticleIsADrop) {
    const MatterParticles matter = {{Vec3f(1, 2, 3)}, {kSpacing * kSpacing * kSpacing}, {}, {}, {}, kSpacing};
    EXPECT_NEAR(checked_volume(surface_of(matter, {.cell = 0.4})) / volume_of(matter), 1, 0.05);
}

} // namespace
} // namespace filigree
