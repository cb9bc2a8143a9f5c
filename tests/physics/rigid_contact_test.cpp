// Rigid bodies that hit, stack and carry: restitution, mass ratios and stacks are what was asked.
#include "filigree/mesh/shapes.h"
#include "filigree/physics/simulation.h"
#include "simulation_scenes.h"
#include "test_bodies.h"

#include <cmath>
#include <gtest/gtest.h>

namespace filigree::rigid_contact_test {
namespace {

using namespace simulation_scenes;

const RunContext kContext(2);

Material stone(double density = 2600) {
    Material material;
    material.model = MaterialModel::rigid;
    material.density = density;
    material.damping = 0;
    return material;
}

std::shared_ptr<const Body> body_of(Mesh mesh, std::size_t particles) {
    BodyOptions options;
    options.cells.count = particles;
    return std::make_shared<const Body>(make_body(mesh, stone(), options, kContext).value());
}

/// A cube and a ball, 0.2 m across.
std::vector<std::shared_ptr<const Body>> shapes() {
    Mesh ball = make_wavy_cube({.resolution = 16});
    for (Vec3f& p : ball.positions) p *= 0.1f / p.norm();
    return {body_of(make_box({-0.1f, -0.1f, -0.1f}, {0.2f, 0.2f, 0.2f}), 200), body_of(std::move(ball), 200)};
}

double mass_of(const Body& body) {
    double mass = 0;
    for (const float m : body.mass) mass += double(m);
    return mass;
}

double speed_along(const Simulation& of, std::size_t body, int axis) {
    double sum = 0;
    for (std::size_t i = 0; i < of.body(body).mass.size(); ++i)
        sum += double(of.body(body).mass[i]) * double(of.velocities(body)[i][axis]);
    return sum / mass_of(of.body(body));
}

constexpr double kRestitutions[] = {0, 0.25, 0.5, 0.75, 1}, kSpeeds[] = {1, 4, 10};

TEST(RigidContact, BodiesLeaveTheGroundAsFastAsRestitutionSays) {
    for (const auto& body : shapes())
        for (const double restitution : kRestitutions)
            for (const double speed : kSpeeds) {
                World world = free_space();
                world.obstacles.emplace_back().shape = HalfSpace{};
                world.obstacles[0].restitution = restitution;
                Actor falling = actor(body, Vec3d(0, 0.1 + speed * 0.055, 0));
                falling.velocity = {0, -speed, 0};
                Simulation hit = simulation(world, {falling});
                const double before = hit.energy(kContext).total();
                double most = 0;
                for (int frame = 0; frame < 15; ++frame) {
                    run(hit, 1);
                    most = std::max(most, hit.energy(kContext).total());
                }
                EXPECT_NEAR(speed_along(hit, 0, 1) / speed, restitution, 0.02) << restitution << " at " << speed;
                EXPECT_LT(most, 1.001 * before);
            }
}

TEST(RigidContact, BodiesLeaveEachOtherAsFastAsRestitutionSays) {
    for (const auto& body : shapes())
        for (const double restitution : kRestitutions)
            for (const double speed : kSpeeds) {
                World world = free_space();
                world.body_restitution = restitution;
                Actor left = actor(body, Vec3d(-0.1 - speed * 0.03, 0, 0)),
                      right = actor(body, Vec3d(0.1 + speed * 0.03, 0, 0));
                left.velocity = {speed / 2, 0, 0};
                right.velocity = {-speed / 2, 0, 0};
                Simulation meeting = simulation(world, {left, right});
                run(meeting, 15);
                EXPECT_NEAR(speed_along(meeting, 1, 0) / (speed / 2), restitution, 0.03)
                    << restitution << " at " << speed;
                EXPECT_LT(meeting.momentum().linear.norm(), 1e-5 * mass_of(*body) * speed);
            }
}

/// Cubes of 0.4 m on the ground, the topmost of another density.
Simulation tower(std::size_t count, double ratio, int cells) {
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    const auto light = box(cells, cells, cells, 0.4 / cells, stone(1000)),
               heavy = box(cells, cells, cells, 0.4 / cells, stone(1000 * ratio));
    std::vector<Actor> cubes;
    for (std::size_t i = 0; i < count; ++i)
        cubes.push_back(actor(i + 1 == count ? heavy : light, Vec3d(0, 0.401 * double(i), 0)));
    return simulation(world, cubes);
}

TEST(RigidContact, TenStoneCubesStand) {
    Simulation stack = tower(10, 1, 3);
    run(stack, 600);
    for (std::size_t b = 0; b < 10; ++b) {
        const Vec3d off = centre_of_mass(stack, b) - Vec3d(0.2, 0.2 + 0.4 * double(b), 0.2);
        EXPECT_LT(off.norm(), 1e-3) << b;
    }
}

TEST(RigidContact, AHeavyCubeStandsOnALightOne) {
    for (const double ratio : {10.0, 100.0, 1000.0}) {
        Simulation stack = tower(3, ratio, 3);
        run(stack, 300);
        for (std::size_t b = 0; b < 3; ++b)
            EXPECT_NEAR(centre_of_mass(stack, b).y(), 0.2 + 0.4 * double(b), 2e-3) << ratio << ", " << b;
    }
}

TEST(RigidContact, FrictionHoldsBelowItsAngleAndSlidesAboveIt) {
    const auto cube = box(4, 4, 4, 0.05, stone());
    for (const double degrees : {20.0, 25.0, 28.0, 40.0}) { // the limit is 26.57
        const double angle = degrees * 3.14159265358979 / 180;
        World world;
        world.gravity = {9.81 * std::sin(angle), -9.81 * std::cos(angle), 0};
        world.obstacles.emplace_back().shape = HalfSpace{};
        world.obstacles[0].friction = 0.5;
        Simulation sliding = simulation(world, {actor(cube)});
        run(sliding, 30);
        const double from = centre_of_mass(sliding).x(), speed = speed_along(sliding, 0, 0);
        run(sliding, 60);
        const double way = centre_of_mass(sliding).x() - from;
        const double pull = std::max(0.0, 9.81 * (std::sin(angle) - 0.5 * std::cos(angle)));
        EXPECT_NEAR(way, speed + 0.5 * pull, 0.02 * way + 1e-4) << degrees;
        EXPECT_NEAR(speed, 0.5 * pull, 0.03 * speed + 1e-4) << degrees;
    }
}

} // namespace
} // namespace filigree::rigid_contact_test
