// What acts on bodies of mpm from outside is what acts on all others: forces on regions and particles, hands, pins,
// wind.
#include "filigree/physics/simulation.h"
#include "physics/test_bodies.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

Material of_model(MaterialModel model) {
    Material material = undamped(0.3);
    material.model = model;
    material.young_modulus = 1e5;
    return material;
}

World weightless_world() {
    World world;
    world.gravity.setZero();
    return world;
}

Simulation moved(World world, const std::shared_ptr<const Body>& body) {
    StepOptions options;
    options.mode = StepMode::explicit_steps;
    return Simulation::create(std::move(world), {{.body = body}}, options, kAllThreads).value();
}

void run_frames(Simulation& simulation, int frames) {
    for (int f = 0; f < frames; ++f) simulation.advance(kAllThreads).value();
}

class ForcesOnModels : public testing::TestWithParam<MaterialModel> {};

TEST_P(ForcesOnModels, ARegionAndTheWholeBodyGainWhatIsGiven) {
    const auto cube = block(6, 6, 6, 0.02, of_model(GetParam()));
    for (const bool whole : {false, true}) {
        World world = weightless_world();
        RegionForce& force = world.forces.emplace_back();
        for (Index p = 0; p < cube->particle_count() && !whole; ++p)
            if (cube->rest[p].x() < 0) force.particles.push_back(p);
        force.force.constant = {0.2, 0, 0};
        Simulation simulation = moved(world, cube);
        run_frames(simulation, 30);
        EXPECT_NEAR(simulation.momentum().linear.x(), 0.1, 1e-3);
    }
}

TEST_P(ForcesOnModels, ForcesOnParticlesAddUp) {
    const auto cube = block(6, 6, 6, 0.02, of_model(GetParam()));
    Simulation simulation = moved(weightless_world(), cube);
    Vectors newtons(cube->particle_count());
    for (std::size_t i = 0; i < newtons.size(); ++i) newtons.set(i, Vec3f(0, 0.3f / float(newtons.size()), 0));
    ASSERT_TRUE(simulation.set_forces(0, newtons).ok());
    run_frames(simulation, 30);
    EXPECT_NEAR(simulation.momentum().linear.y(), 0.15, 2e-3);
    ASSERT_TRUE(simulation.set_forces(0, {}).ok());
    run_frames(simulation, 30);
    EXPECT_NEAR(simulation.momentum().linear.y(), 0.15, 2e-3) << "no force, no more momentum";
}

TEST_P(ForcesOnModels, AHandPullsTheBodyToItsTarget) {
    Material material = of_model(GetParam());
    material.damping = 4;
    const auto cube = block(6, 6, 6, 0.02, material);
    Hand hand;
    hand.point = {0.055f, 0, 0};
    hand.target.constant = {0.205, 0, 0};
    hand.stiffness = 20;
    World world = weightless_world();
    world.hands.push_back(hand);
    Simulation simulation = moved(world, cube);
    run_frames(simulation, 240);
    EXPECT_NEAR(centre_of_mass(simulation).x(), 0.15, 0.01);
    hand.target.constant = {0.055, 0.1, 0};
    ASSERT_TRUE(simulation.set_hands({hand}, kAllThreads).ok());
    run_frames(simulation, 300);
    const Vec3d arm = centre_of_mass(simulation) - Vec3d(0.055, 0.1, 0); // it may hang turned from the hand
    EXPECT_NEAR(arm.norm(), 0.055, 0.015);
    EXPECT_LT(simulation.momentum().linear.norm(), 0.02);
    ASSERT_TRUE(simulation.set_hands({}, kAllThreads).ok());
}

TEST_P(ForcesOnModels, ForcesAreNoPartOfWhatIsSavedAndPinsAre) {
    const auto cube = block(6, 6, 6, 0.02, of_model(GetParam()));
    World world = weightless_world();
    Pin& pin = world.pins.emplace_back();
    for (Index p = 0; p < cube->particle_count(); ++p)
        if (cube->rest[p].y() > 0.03f) pin.particles.push_back(p);
    pin.motion.move = {{0, 1}, {Vec3d::Zero(), Vec3d(0.1, 0, 0)}, Vec3d::Zero()};
    Simulation simulation = moved(world, cube);
    const float from = simulation.positions(0)[pin.particles[0]].x();
    run_frames(simulation, 30);
    EXPECT_NEAR(simulation.positions(0)[pin.particles[0]].x() - from, 0.05f, 1e-4f);
    EXPECT_NEAR(simulation.velocities(0)[pin.particles[0]].x(), 0.1f, 1e-4f);
    EXPECT_NEAR(centre_of_mass(simulation).x(), 0.05, 0.01) << "the rest follows";
}

TEST_P(ForcesOnModels, WindPressesOnWhatFacesIt) {
    const auto cube = block(12, 12, 12, 0.01, of_model(GetParam())); // edges are as round as the grid has them
    World world = weightless_world();
    world.wind.constant = {0, 0, 5};
    world.air_density = 1.2;
    Simulation simulation = moved(world, cube);
    run_frames(simulation, 12);
    const double speed = simulation.momentum().linear.z() / 1.728, theory = 0.5 * 1.2 * 25 * 0.0144 / 1.728 * 0.2;
    EXPECT_NEAR(speed, theory, 0.2 * theory);
    EXPECT_LT(std::abs(simulation.momentum().linear.x()), 0.02 * simulation.momentum().linear.z());
}

INSTANTIATE_TEST_SUITE_P(All, ForcesOnModels, testing::Values(MaterialModel::fem, MaterialModel::mpm),
                         [](const auto& model) { return model.param == MaterialModel::mpm ? "mpm" : "fem"; });

} // namespace
} // namespace filigree
