#include "filigree/physics/body/body_state.h"

#include "filigree/core/random.h"
#include "filigree/physics/step/external_forces.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

/// A body that melts, at rest where it was made.
BodyState melting(std::size_t nx, std::size_t ny, std::size_t nz, double spacing) {
    Material material;
    material.model = MaterialModel::meshfree;
    material.melting_from = 300;
    material.melting_to = 350;
    BodyState state;
    state.body = std::make_shared<Body>(make_body(box_cells(nx, ny, nz, spacing), material));
    const std::size_t count = state.body->particle_count();
    state.elasticity = make_elasticity(*state.body, kOneThread);
    state.positions = state.body->rest;
    state.velocities = state.forces = Vectors(count);
    state.rest_squared_frequency =
        state.elasticity->forces(state.body->rest, state.forces, kOneThread).squared_frequency;
    for (const float mass : state.body->mass) state.inverse_mass.push_back(1 / mass);
    embed_surface_at_rest(state, false, kOneThread);
    return state;
}

/// Moves every particle, and renews the neighbourhoods there.
template <class Motion>
void flow_by(BodyState& state, std::span<Attachment* const> attachments, const Motion& motion) {
    for (std::size_t i = 0; i < state.positions.size(); ++i) state.positions.set(i, motion(state.positions[i]));
    renew_neighbourhoods(state, attachments, kOneThread);
}

std::vector<Vec3f> points_in_box(const Vec3f& size) {
    std::vector<Vec3f> points;
    for (std::uint64_t k = 0; k < 100; ++k)
        points.push_back(
            Vec3f(float(random_unit(3, 3 * k)), float(random_unit(3, 3 * k + 1)), float(random_unit(3, 3 * k + 2)))
                .cwiseProduct(size));
    return points;
}

/// Largest distance and difference of gradients between points attached before the body flowed and after.
std::pair<float, float> differences(const BodyState& state, const Attachment& before, const Attachment& after) {
    const std::size_t count = before.points.size();
    std::vector<Vec3f> one(count), other(count);
    std::vector<Mat3f> one_gradients(count), other_gradients(count);
    move_attached(state, before, one, one_gradients, kOneThread);
    move_attached(state, after, other, other_gradients, kOneThread);
    float distance = 0, gradient = 0;
    for (std::size_t i = 0; i < count; ++i) {
        distance = std::max(distance, (one[i] - other[i]).norm());
        gradient = std::max(gradient, (one_gradients[i] - other_gradients[i]).norm());
    }
    return {distance, gradient};
}

TEST(BodyState, AttachIsTheSameBeforeAndAfterAffineFlow) {
    BodyState state = melting(8, 4, 4, 0.1);
    const std::vector<Vec3f> points = points_in_box({0.8f, 0.4f, 0.4f});
    Attachment before = attach(state, 0, points, kOneThread);
    EXPECT_FALSE(state.has_flowed());
    Mat3f shear = Mat3f::Identity();
    shear(0, 1) = 0.2f;
    for (int renewal = 0; renewal < 3; ++renewal)
        flow_by(state, std::array{&before}, [&](const Vec3f& p) { return Vec3f(shear * p + Vec3f(3, 0, 1)); });
    EXPECT_TRUE(state.has_flowed());
    const auto [distance, gradient] = differences(state, before, attach(state, 0, points, kOneThread));
    EXPECT_LT(distance, 1e-4f);
    EXPECT_LT(gradient, 1e-3f);
    // And the same is true after the body moved on.
    for (std::size_t i = 0; i < state.positions.size(); ++i)
        state.positions.set(i, shear.transpose() * state.positions[i]);
    EXPECT_LT(differences(state, before, attach(state, 0, points, kOneThread)).first, 1e-4f);
}

// What is bent in several goes is placed by one: half a spacing at most, of a way of many.
TEST(BodyState, AttachIsNearlyTheSameAfterUnevenFlow) {
    BodyState state = melting(10, 4, 4, 0.1);
    const std::vector<Vec3f> points = points_in_box({1, 0.4f, 0.4f});
    Attachment before = attach(state, 0, points, kOneThread);
    for (int renewal = 0; renewal < 4; ++renewal)
        flow_by(state, std::array{&before},
                [&](const Vec3f& p) { return Vec3f(p.x() + 2, p.y() + 0.3f * std::sin(3 * p.x()), p.z()); });
    EXPECT_LT(differences(state, before, attach(state, 0, points, kOneThread)).first, 0.05f);
}

// A drop that left takes the points along that were next to its particles; nothing is in the empty space between.
TEST(BodyState, PointsGoWithTheNearestParticleWhereABodyCameApart) {
    BodyState state = melting(8, 4, 4, 0.1);
    flow_by(state, {}, [](const Vec3f& p) { return Vec3f(p.x() > 0.4f ? p.x() + 5 : p.x(), p.y(), p.z()); });
    const std::vector<Vec3f> points = {{0.36f, 0.2f, 0.2f}, {0.44f, 0.2f, 0.2f}};
    const PlacedPoints placed = place_in_reference(state, points, kOneThread);
    EXPECT_LT((placed.places[0] - points[0]).norm(), 0.1f);
    EXPECT_LT((placed.places[1] - points[1] - Vec3f(5, 0, 0)).norm(), 0.1f);
}

TEST(BodyState, AHandSeizesWhatWasAtItsPointAtRest) {
    BodyState state = melting(10, 3, 3, 0.1);
    flow_by(state, {}, [](const Vec3f& p) { return Vec3f(-p.x() + 5, p.y(), -p.z()); }); // turned around and far away
    Hand hand;
    hand.point = {1, 0.15f, 0.15f};
    const Grip grip = make_grip(hand, state, kOneThread);
    ASSERT_GT(grip.region.particles.size(), 9u);
    for (const Index particle : grip.region.particles) EXPECT_GT(state.body->rest.x[particle], 0.55f);
    EXPECT_LT((embedded_point(grip.region, 0, state.positions) + grip.offset - Vec3f(4, 0.15f, -0.15f)).norm(), 1e-3f);
}

// The wind presses on what faces it now: a renewal, which makes the present shape the reference, changes nothing.
TEST(BodyState, WindPressesTheSameAfterARenewal) {
    World world;
    world.air_density = 1.2;
    world.wind.constant = {10, 0, 0};
    BodyState state[1] = {melting(8, 2, 2, 0.1)};
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
    const Vec3f before = push();
    EXPECT_NEAR(before.x(), 0.5 * 1.2 * 100 * 0.16, 0.1); // the long side
    renew_neighbourhoods(state[0], {}, kOneThread);
    EXPECT_LT((push() - before).norm(), 0.02f * before.norm());
}

} // namespace
} // namespace filigree
