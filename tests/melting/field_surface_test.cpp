// Surfaces of particles: closed, manifold and oriented whatever the particles, and of their volume.
#include "matter.h"

#include "filigree/melting/field_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace filigree {
namespace {

using namespace filigree_test;

Mesh surface_of(const MatterParticles& matter, const ParticleFieldOptions& options = {}, unsigned threads = 1) {
    const RunContext context(threads);
    return make_field_surface(make_particle_field(matter, options, context).value(), context).value();
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
