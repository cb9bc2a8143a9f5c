#include "filigree/physics/body/body_state.h"

#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/step/external_forces.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

/// A meshfree body at rest where it was made.
BodyState resting(std::size_t nx, std::size_t ny, std::size_t nz, double spacing) {
    Material material;
    material.model = MaterialModel::meshfree;
    BodyState state;
    state.body = std::make_shared<Body>(make_body(box_cells(nx, ny, nz, spacing), material));
    const std::size_t count = state.body->particle_count();
    state.elasticity = make_elasticity(*state.body, kOneThread);
    state.positions = state.body->rest;
    state.velocities = state.forces = Vectors(count);
    state.rest_squared_frequency =
        state.elasticity->forces(state.body->rest, state.forces, kOneThread).squared_frequency;
    for (const float mass : state.body->mass) state.inverse_mass.push_back(1 / mass);
    state.surface = state.body->surface.points;
    return state;
}

TEST(BodyState, AHandSeizesWhatWasAtItsPointAtRest) {
    BodyState state = resting(10, 3, 3, 0.1);
    for (std::size_t i = 0; i < state.positions.size(); ++i) { // turned around and far away
        const Vec3f p = state.positions[i];
        state.positions.set(i, {-p.x() + 5, p.y(), -p.z()});
    }
    Hand hand;
    hand.point = {1, 0.15f, 0.15f};
    const Grip grip = make_grip(hand, state, kOneThread);
    ASSERT_GT(grip.region.particles.size(), 9u);
    for (const Index particle : grip.region.particles) EXPECT_GT(state.body->rest.x[particle], 0.55f);
    EXPECT_LT((embedded_point(grip.region, 0, state.positions) + grip.offset - Vec3f(4, 0.15f, -0.15f)).norm(), 1e-3f);
}

TEST(BodyState, WindPressesOnWhatFacesItNow) {
    World world;
    world.air_density = 1.2;
    world.wind.constant = {10, 0, 0};
    BodyState state[1] = {resting(8, 2, 2, 0.1)};
    const auto push = [&] {
        ExternalForces external(world, 1);
        state[0].forces = Vectors(state[0].positions.size());
        external.find_wind(state, 0, 60, kOneThread);
        external.add_forces(state, 0, kOneThread);
        Vec3f sum = Vec3f::Zero();
        for (std::size_t i = 0; i < state[0].forces.size(); ++i) sum += state[0].forces[i];
        return sum;
    };
    for (std::size_t i = 0; i < state[0].positions.size(); ++i) { // a quarter turn about z
        const Vec3f p = state[0].body->rest[i];
        state[0].positions.set(i, {-p.y(), p.x(), p.z()});
    }
    EXPECT_NEAR(push().x(), 0.5 * 1.2 * 100 * 0.16, 0.1); // the long side
}

} // namespace
} // namespace filigree
