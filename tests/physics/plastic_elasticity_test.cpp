// fem that yields: its formulas, and what it keeps.
#include "elastic_checks.h"
#include "filigree/mesh.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/fem/plastic_cells.h"
#include "test_bodies.h"
#include "threads.h"

namespace filigree {
namespace {

Material clay() {
    Material material = undamped(0.3);
    material.yield_stress = 1e4; // a strain of 1 %
    return material;
}

/// Kneaded: its cells are at rest in other shapes, bent ones among them.
std::unique_ptr<Elasticity> kneaded(const Body& body, const RunContext& context) {
    auto elasticity = make_elasticity(body, context);
    for (std::uint64_t round = 0; round < 3; ++round)
        elasticity->finish_substep(
            checks::moved(body.rest,
                          [&](std::size_t i, const Vec3f& p) {
                              return Vec3f(Vec3f(1.3f * p.x() + 0.2f * p.y(), p.y(), 0.8f * p.z()) +
                                           0.2f * float(body.spacing()) * checks::random_vector(i + 100 * round));
                          }),
            0.01f, context);
    return elasticity;
}

TEST(PlasticElasticity, ForcesAreTheEnergys) {
    checks::expect_forces_from_energy(make_body(checks::uneven_cells(0.1), clay()), kneaded);
}
TEST(PlasticElasticity, NoNetForce) {
    checks::expect_no_net_force(make_body(checks::uneven_cells(0.1), clay()), kneaded);
}
TEST(PlasticElasticity, TheRateIsABound) {
    checks::expect_rate_is_a_bound(make_body(box_cells(2, 2, 2, 0.1), clay()), kneaded);
}
TEST(PlasticElasticity, SameBytesForThreads) {
    checks::expect_same_bytes_for_threads(make_body(box_cells(12, 9, 8, 0.1), clay()), kneaded);
}

TEST(PlasticElasticity, IsFemUntilItYields) {
    Material elastic = clay(), plastic = clay();
    elastic.yield_stress = Material::kNever;
    plastic.yield_stress = 1e12;
    const Body first = make_body(checks::uneven_cells(0.1), elastic), second = make_body(first.cells, plastic);
    const auto fem = make_elasticity(first, kTwoThreads), yields = make_elasticity(second, kTwoThreads);
    for (const checks::Start& state : checks::states(first)) {
        yields->finish_substep(state.positions, 0.01f, kTwoThreads);
        Vectors wanted(first.particle_count()), found(first.particle_count());
        const ElasticReport a = fem->forces(state.positions, wanted, kTwoThreads);
        const ElasticReport b = yields->forces(state.positions, found, kTwoThreads);
        float most = 0;
        for (std::size_t i = 0; i < wanted.size(); ++i) most = std::max(most, wanted[i].norm());
        for (std::size_t i = 0; i < wanted.size(); ++i)
            EXPECT_LT((wanted[i] - found[i]).norm(), 1e-5f * most) << state.name;
        EXPECT_NEAR(a.squared_frequency, b.squared_frequency, 1e-4f * a.squared_frequency) << state.name;
        EXPECT_NEAR(a.least_volume_ratio, b.least_volume_ratio, 1e-4f) << state.name;
        const double energy = fem->energy(state.positions, kTwoThreads);
        EXPECT_NEAR(yields->energy(state.positions, kTwoThreads), energy, 1e-4 * energy) << state.name;
    }
}

TEST(PlasticElasticity, ABarYieldsAtItsStressAndStaysLonger) {
    Material material = clay();
    material.poisson_ratio = 0; // so that the stress is the same everywhere
    const Body body = make_body(box_cells(6, 2, 2, 0.1), material);
    const auto elasticity = make_elasticity(body, kTwoThreads);
    const auto pulled = [&](float stretch) {
        const float across = 1 / std::sqrt(stretch); // keeps its volume
        return checks::moved(body.rest, [&](std::size_t, const Vec3f& p) {
            return Vec3f(stretch * p.x(), across * p.y(), across * p.z());
        });
    };
    for (int step = 0; step <= 300; ++step)
        elasticity->finish_substep(pulled(1 + 0.001f * float(step)), 0.001f, kTwoThreads);
    // Hencky's strain at the yield point: yield stress / (2 mu) times sqrt(2/3), of its deviator.
    const double energy = elasticity->energy(pulled(1.3f), kTwoThreads), volume = 6 * 2 * 2 * 1e-3;
    const double strain = 1e4 * std::sqrt(2 / 3.) / (2 * 0.5e6);          // mu = E / 2
    EXPECT_NEAR(energy, 0.5e6 * strain * strain * volume, 0.03 * energy); // mu |dev e|^2
    // Where it is at rest now.
    double least = 1e9;
    float at = 0;
    for (float stretch = 1.25f; stretch < 1.31f; stretch += 0.0005f)
        if (const double e = elasticity->energy(pulled(stretch), kTwoThreads); e < least) {
            least = e;
            at = stretch;
        }
    EXPECT_NEAR(at, 1.3 * std::exp(-strain / std::sqrt(1.5)), 0.002);
    EXPECT_LT(least, 1e-3 * energy);
}

TEST(PlasticElasticity, BendingYieldsToo) {
    const Body body = make_body(box_cells(8, 1, 1, 0.1), clay()); // one cell across: it bends by that alone
    const auto elasticity = make_elasticity(body, kTwoThreads);
    const float radius = 0.5f; // a strain of 10 % on its outside
    const Vectors bent = checks::moved(body.rest, [&](std::size_t, const Vec3f& p) {
        const float angle = p.x() / radius, r = radius + p.y();
        return Vec3f(r * std::sin(angle), r * std::cos(angle) - radius, p.z());
    });
    const double before = elasticity->energy(bent, kTwoThreads);
    for (int step = 0; step < 5; ++step) elasticity->finish_substep(bent, 0.001f, kTwoThreads);
    EXPECT_LT(elasticity->energy(bent, kTwoThreads), 0.1 * before);
}

TEST(PlasticElasticity, CreepsAtItsRate) {
    Material material = clay();
    material.creep_time = 0.1;
    const Body body = make_body(box_cells(2, 2, 2, 0.1), material);
    const auto excess = [&](int steps) {
        const auto elasticity = make_elasticity(body, kTwoThreads);
        const Vectors sheared = checks::moved(
            body.rest, [](std::size_t, const Vec3f& p) { return Vec3f(p.x() + 0.1f * p.y(), p.y(), p.z()); });
        for (int step = 0; step < steps; ++step) elasticity->finish_substep(sheared, 0.001f, kTwoThreads);
        const double mu = 1e6 / 2.6, strain = std::sqrt(elasticity->energy(sheared, kTwoThreads) / (mu * 8e-3));
        return strain - std::sqrt(2 / 3.) * 1e4 / (2 * mu);
    };
    EXPECT_NEAR(excess(100) / excess(0), std::exp(-1), 0.02);
}

TEST(PlasticElasticity, OpeningsOnPlanes) {
    PlasticCell cell;
    const Mat3f turn = Eigen::AngleAxisf(0.7f, Vec3f(1, 2, 3).normalized()).toRotationMatrix();
    const Vec3f normal = Vec3f(1, 0.5f, -0.2f).normalized(), other = normal.unitOrthogonal();
    const auto with = [&](const Mat3f& plastic) {
        cell.inverse = plastic.inverse() * turn; // how an elastic frame is turned does not matter
        return plastic_opening(cell, normal, 0.1f);
    };
    const Mat3f stretch =
        1 / std::sqrt(1.5f) * Mat3f::Identity() + (1.5f - 1 / std::sqrt(1.5f)) * normal * normal.transpose();
    EXPECT_NEAR(with(stretch), 0.05f, 1e-5f);
    EXPECT_NEAR(with(stretch.inverse()), 0, 1e-5f); // closer together
    const Mat3f slip = Mat3f::Identity() + 0.4f * other * normal.transpose();
    EXPECT_NEAR(with(slip), 0.5f * 0.04f, 1e-5f);
    const Vec3f third = normal.cross(other); // stretched in the plane alone
    const Mat3f within =
        normal * normal.transpose() + 1.4f * other * other.transpose() + 1 / 1.4f * third * third.transpose();
    EXPECT_NEAR(with(within), 0, 1e-5f);
}

TEST(PlasticElasticity, AFreeBodyKeepsItsMomentumAndStaysLonger) {
    Material material = clay();
    material.damping = 0;
    World world;
    world.gravity = Vec3d::Zero();
    const auto body = block(6, 4, 4, 0.1, material);
    Simulation simulation =
        Simulation::create(
            world, {{.body = body}},
            {.frames_per_second = 100, .mode = StepMode::explicit_steps, .contacts_within_bodies = false}, kTwoThreads)
            .value();
    Vectors velocities(body->rest.size());
    for (std::size_t i = 0; i < velocities.size(); ++i) {
        const Vec3f& p = body->rest[i];
        velocities.set(i, {10 * p.x() + 1, -2 * p.x() * p.y() + 0.3f, -p.z()});
    }
    ASSERT_TRUE(simulation.set_velocities(0, velocities).ok());
    const Momentum before = simulation.momentum();
    const double start = simulation.energy(kTwoThreads).total();
    for (int frame = 0; frame < 60; ++frame) ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
    const Momentum after = simulation.momentum();
    const double size = before.linear.norm(), exact = 1e-6;
    EXPECT_LT((after.linear - before.linear).norm(), exact * size);
    EXPECT_LT((after.angular - before.angular).norm(), 20 * exact * size * 0.6);
    EXPECT_LT(simulation.energy(kTwoThreads).total(), start);
    // Longer than it was, for good: what is elastic is a hundredth. The block does not turn.
    const auto length = [](const Vectors& x) {
        const auto [least, most] = std::minmax_element(x.x.begin(), x.x.begin() + std::ptrdiff_t(x.size()));
        return *most - *least;
    };
    EXPECT_GT(length(simulation.positions(0)), 1.08f * length(body->rest));
}

TEST(PlasticElasticity, SavedAndRestored) {
    const Body body = make_body(box_cells(3, 3, 3, 0.1), clay());
    const auto first = kneaded(body, kTwoThreads), second = make_elasticity(body, kTwoThreads);
    EXPECT_FALSE(second->restore_state(""));
    EXPECT_FALSE(second->restore_state(first->state().substr(4)));
    ASSERT_TRUE(second->restore_state(first->state()));
    EXPECT_EQ(second->state(), first->state());
    Vectors a(body.particle_count()), b(body.particle_count());
    first->forces(body.rest, a, kTwoThreads);
    second->forces(body.rest, b, kTwoThreads);
    EXPECT_TRUE(checks::same_bytes(a, b));
}

} // namespace
} // namespace filigree
