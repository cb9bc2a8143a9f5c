// Rigid bodies that hit, stack and carry: restitution, mass ratios and stacks are what was asked.
#include "../../bench/heap.h"

#include "filigree/mesh.h"
#include "filigree/physics/rigid/contact_manifold.h"
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

/// Of meshes, whose fields lean at their edges.
TEST(RigidContact, TenCubesOfOneMeshStand) {
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    const auto cube = body_of(make_box({0.2, 0.2, 0.2}, {0.4, 0.4, 0.4}), 200);
    std::vector<Actor> cubes;
    for (int i = 0; i < 10; ++i) cubes.push_back(actor(cube, Vec3d(0, 0.401 * i, 0)));
    Simulation stack = simulation(world, cubes);
    run(stack, 300);
    for (std::size_t b = 0; b < 10; ++b) {
        const Vec3d off = centre_of_mass(stack, b) - Vec3d(0.2, 0.2 + 0.4 * double(b), 0.2);
        EXPECT_LT(off.norm(), 5e-4) << b;
    }
}

TEST(RigidContact, AHeapOfTwoHundredStaysOutOfItselfAndFallsAsleep) {
    const bench::Heap scene = bench::make_heap();
    Simulation heap = simulation(scene.world, scene.actors);
    double before = heap.energy(kContext).total();
    for (int frame = 0; frame < 240; ++frame) {
        const FrameReport report = heap.advance(kContext).value();
        EXPECT_LT(report.deepest_in_matter, 0.01) << frame;
        EXPECT_LT(report.deepest_contact, 0.01) << frame;
        const double now = heap.energy(kContext).total();
        EXPECT_LT(now, 1.0005 * before) << frame;
        before = now;
    }
    const FrameReport report = heap.advance(kContext).value();
    EXPECT_EQ(report.contacts, 0U) << "something is awake";
    EXPECT_EQ(heap.energy(kContext).kinetic, 0);
}

TEST(RigidContact, AManifoldIsTheDeepestPointAndTheCornersAndKeepsAllForce) {
    std::vector<ManifoldPoint> grid;
    for (int i = 0; i < 25; ++i)
        grid.push_back({.place = Vec3f(float(i % 5), 0, float(i / 5)), .normal = Vec3f::UnitY(), .separation = 1e-3f});
    grid[0].separation = -0.05f;
    grid[12].force = {1, 10, 2};
    grid[23].force = {0, 5, 0};
    reduce_manifold(grid, 0.1f);
    Vec3f force = Vec3f::Zero();
    for (std::size_t k = 0; k < grid.size(); ++k) {
        EXPECT_EQ(grid[k].is_kept, k == 0 || k == 4 || k == 20 || k == 24) << k;
        if (grid[k].is_kept) force += grid[k].force;
    }
    EXPECT_TRUE(force.isApprox(Vec3f(1, 15, 2)));
}

TEST(RigidContact, AHeavyCubeStandsOnALightOne) {
    for (const double ratio : {10.0, 100.0, 1000.0}) {
        Simulation stack = tower(3, ratio, 3);
        run(stack, 300);
        for (std::size_t b = 0; b < 3; ++b)
            EXPECT_NEAR(centre_of_mass(stack, b).y(), 0.2 + 0.4 * double(b), 2e-3) << ratio << ", " << b;
    }
}

TEST(RigidContact, WhatRocksComesToRestOnEveryKindOfObstacle) {
    const Mesh plate = make_box({0, -0.1, 0}, {10, 0.2, 10});
    World plane, box, mesh;
    plane.obstacles.emplace_back().shape = HalfSpace{};
    box.obstacles.emplace_back().shape = Cuboid{{0, -0.1, 0}, {10, 0.2, 10}};
    mesh.obstacles.emplace_back().shape = make_mesh_obstacle(plate, 1, 0.05, kContext).value();
    const auto ball = body_of(make_wavy_sphere({.resolution = 4, .amplitude = 0, .size = 0.2}), 300);
    const auto cube = body_of(make_wavy_cube({.resolution = 8, .size = 0.3}), 100);
    for (const auto& body : {ball, cube})
        for (const World& world : {plane, box, mesh}) {
            Actor falls = actor(body, {0.02, 0.5, 0});
            falls.placement.rotate(Eigen::AngleAxisd(0.1, Vec3d::UnitX()));
            falls.may_sleep = false;
            Simulation scene = simulation(world, {falls});
            run(scene, 420);
            const double before = scene.energy(kContext).total();
            run(scene, 60);
            EXPECT_LT(scene.energy(kContext).kinetic, 1e-6 * mass_of(*body));
            EXPECT_NEAR(scene.energy(kContext).total(), before, 1e-4 * mass_of(*body));
            EXPECT_GT(centre_of_mass(scene).y(), 0.05);
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
