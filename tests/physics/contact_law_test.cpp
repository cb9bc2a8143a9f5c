// Friction, restitution and energy of elastic bodies that touch obstacles and each other.
#include "filigree/mesh.h"
#include "filigree/physics/material.h"
#include "physics/test_bodies.h"
#include "simulation_scenes.h"
#include "threads.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <ostream>
#include <string>

namespace filigree::contact_law_test {
namespace {

using namespace simulation_scenes;

constexpr StepOptions kExplicit{.mode = StepMode::explicit_steps};

Material preset(const std::string& name) {
    const auto all = named_materials();
    return std::ranges::find(all, name, &NamedMaterial::name)->material;
}

std::shared_ptr<const Body> body_of(const Mesh& mesh, const Material& of, std::size_t particles) {
    return std::make_shared<const Body>(
        make_body(mesh, of, {.scale = 1, .cells = {.spacing = 0, .count = particles}}, kOneThread).value());
}
std::shared_ptr<const Body> cube(double size, const Material& of, std::size_t particles = 200) {
    return body_of(make_box(Vec3d::Zero(), Vec3d::Constant(size)), of, particles);
}
std::shared_ptr<const Body> ball(double radius, const Material& of, std::size_t particles = 200) {
    Mesh mesh = make_wavy_cube({.resolution = 12});
    for (Vec3f& p : mesh.positions) p *= float(radius) / p.norm();
    return body_of(mesh, of, particles);
}

Vec3d velocity_of(const Simulation& of, std::size_t body) {
    Vec3d sum = Vec3d::Zero();
    double mass = 0;
    for (std::size_t i = 0; i < of.body(body).mass.size(); ++i) {
        sum += double(of.body(body).mass[i]) * of.velocities(body)[i].cast<double>();
        mass += double(of.body(body).mass[i]);
    }
    return sum / mass;
}

// On slopes: friction 0.5 holds up to 26.6 degrees.

enum class Ground { plane, mesh, body };
struct OnSlope {
    const char* material;
    Ground ground;
    double turned, heading; ///< degrees about the normal: of the body, and of the way down
    Vec3d size = Vec3d::Constant(0.1);
};
void PrintTo(const OnSlope& row, std::ostream* out) { *out << row.material; } // else its bytes, padding too

/// A box on flat ground, and gravity that leans.
Simulation on_slope(const OnSlope& row, double degrees, double damping) {
    const double angle = degrees * std::numbers::pi / 180, heading = row.heading * std::numbers::pi / 180;
    World world;
    world.body_friction = 0.5;
    world.body_restitution = 0;
    world.gravity =
        9.81 * Vec3d(std::sin(angle) * std::cos(heading), -std::cos(angle), std::sin(angle) * std::sin(heading));
    Material material = preset(row.material);
    material.damping = damping;
    std::vector<Actor> actors = {
        actor(body_of(make_box(Vec3d::Zero(), row.size), material, 200), {0, row.size.y() / 2, 0})};
    actors[0].placement.linear() =
        Eigen::AngleAxisd(row.turned * std::numbers::pi / 180, Vec3d::UnitY()).toRotationMatrix();
    if (row.ground == Ground::body) {
        Pin pin;
        pin.body = 1;
        actors.push_back(actor(block(14, 1, 3, 0.1, undamped(0.3)), {0.5, -0.05, 0}));
        for (Index i = 0; i < actors[1].body->particle_count(); ++i) pin.particles.push_back(i);
        world.pins.push_back(pin);
    } else {
        Obstacle& ground = world.obstacles.emplace_back();
        ground.restitution = 0;
        ground.shape = HalfSpace{};
        if (row.ground == Ground::mesh)
            ground.shape = make_mesh_obstacle(make_box({0, -0.5, 0}, {8, 1, 8}), 1, 0, kOneThread).value();
    }
    return simulation(std::move(world), std::move(actors), kExplicit);
}

// Softer presets lean and sway for a while where gravity sets in at once, and their feet stick meanwhile: what they
// slide is measured from then on.

class Friction : public testing::TestWithParam<OnSlope> {};

TEST_P(Friction, HoldsBelowItsAngle) {
    Simulation resting = on_slope(GetParam(), 25, preset(GetParam().material).damping);
    run(resting, 30);
    const Vec3d before = centre_of_mass(resting);
    run(resting, 150);
    EXPECT_LT((centre_of_mass(resting) - before).norm(), 1e-3);
}

TEST_P(Friction, SlidesAboveItsAngleByCoulombsLaw) {
    Simulation sliding = on_slope(GetParam(), 29, 0);
    run(sliding, 30);
    const Vec3d before = velocity_of(sliding, 0), at = centre_of_mass(sliding);
    run(sliding, 60);
    const Vec3d along(sliding.world().gravity.x(), 0, sliding.world().gravity.z());
    const Vec3d gained = velocity_of(sliding, 0) - before, way = centre_of_mass(sliding) - at;
    const double angle = 29 * std::numbers::pi / 180;
    const double wanted = 9.81 * (std::sin(angle) - 0.5 * std::cos(angle)); // m/s in a second
    EXPECT_NEAR(gained.dot(along.normalized()), wanted, 0.05 * wanted);
    EXPECT_LT(along.normalized().cross(way).norm(), 0.02 * way.norm()) << "it does not turn aside";
}

std::string row_name(const testing::TestParamInfo<OnSlope>& info) {
    std::string name = info.param.material;
    std::erase(name, '-');
    const std::array grounds = {"Plane", "Mesh", "Body"};
    return name + grounds[std::size_t(info.param.ground)] + std::to_string(int(info.param.turned)) +
           (info.param.size.y() < 0.1 ? "Flat" : "");
}

INSTANTIATE_TEST_SUITE_P(ContactLaw, Friction,
                         testing::Values(OnSlope{"rubber", Ground::plane, 0, 0}, OnSlope{"rubber", Ground::mesh, 30, 0},
                                         OnSlope{"rubber", Ground::body, 0, 0},
                                         OnSlope{"rubber", Ground::plane, 0, 0, {0.2, 0.06, 0.2}},
                                         OnSlope{"soft-rubber", Ground::plane, 45, 70},
                                         OnSlope{"foam", Ground::plane, 0, 20},
                                         OnSlope{"lattice", Ground::plane, 15, 0}),
                         row_name);

// A stiff body that is stepped as elastic leaves as fast as restitution says; its own vibration has no say.

Material stiff() {
    Material material = preset("stone");
    material.model = MaterialModel::fem;
    material.damping = 0;
    return material;
}

TEST(ContactLaw, StiffBodiesLeaveTheGroundAsFastAsRestitutionSays) {
    for (const auto& body : {cube(0.2, stiff(), 100), ball(0.1, stiff(), 100)})
        for (const double restitution : {0.0, 0.25, 0.5, 0.75, 1.0})
            for (const double speed : {1.0, 4.0, 10.0}) {
                World world = free_space();
                world.obstacles.emplace_back().shape = HalfSpace{};
                world.obstacles[0].restitution = restitution;
                Actor falling = actor(body, {0, 0.1 + speed * 0.01, 0});
                falling.velocity = {0, -speed, 0};
                Simulation hit = simulation(world, {falling}, kExplicit);
                const double before = hit.energy(kOneThread).total();
                double most = 0;
                for (int frame = 0; frame < 3; ++frame) {
                    run(hit, 1);
                    most = std::max(most, hit.energy(kOneThread).total());
                }
                EXPECT_NEAR(velocity_of(hit, 0).y() / speed, restitution, 0.05) << restitution << " at " << speed;
                EXPECT_LT(most, 1.01 * before);
            }
}

TEST(ContactLaw, StiffBodiesLeaveEachOtherAsFastAsRestitutionSays) {
    const auto body = ball(0.1, stiff(), 100);
    for (const double restitution : {0.0, 0.5, 1.0}) {
        World world = free_space();
        world.body_restitution = restitution;
        Actor left = actor(body, {-0.12, 0, 0}), right = actor(body, {0.12, 0.02, 0});
        left.velocity = {2, 0, 0};
        right.velocity = {-2, 0, 0};
        Simulation meeting = simulation(world, {left, right}, kExplicit);
        const Momentum before = meeting.momentum();
        const double energy = meeting.energy(kOneThread).total();
        run(meeting, 4);
        const Vec3d normal = Vec3d(0.2, 0.02, 0).normalized(); // about the line between their centres as they meet
        const Vec3d apart = velocity_of(meeting, 1) - velocity_of(meeting, 0);
        EXPECT_NEAR(apart.dot(normal) / (4 * normal.x()), restitution, 0.06) << restitution;
        EXPECT_LT((meeting.momentum().linear - before.linear).norm(), 1e-3);
        EXPECT_LT((meeting.momentum().angular - before.angular).norm(), 1e-3 * before.angular.norm());
        EXPECT_LT(meeting.energy(kOneThread).total(), 1.01 * energy);
    }
}

/// Frames shorter than the hit: it is saved in its midst.
TEST(ContactLaw, AHitThatIsSavedGoesOnTheSame) {
    World world = free_space();
    world.obstacles.emplace_back().shape = HalfSpace{};
    Actor falling = actor(cube(0.2, stiff(), 100), {0, 0.1001, 0});
    falling.velocity = {0, -1, 0};
    const StepOptions options{.frames_per_second = 1e4, .mode = StepMode::explicit_steps};
    Simulation whole = simulation(world, {falling}, options), resumed = simulation(world, {falling}, options);
    std::size_t touched = 0;
    for (int frame = 0; frame < 30; ++frame) {
        touched += run(whole, 1).contacts > 0 ? 1 : 0;
        ASSERT_TRUE(resumed.restore(resumed.save()).ok());
        run(resumed, 1, 2);
        ASSERT_TRUE(whole.save() == resumed.save()) << frame;
    }
    EXPECT_GT(touched, 3u);
    EXPECT_NEAR(velocity_of(resumed, 0).y(), 0.5, 0.025);
}

// Energy never grows in a hit, though cells are crushed and points pushed out.

struct Hit {
    const char* material;
    const char* onto;
    double speed, restitution;
};

World world_of(const Hit& hit, double size) {
    World world = free_space();
    world.body_restitution = hit.restitution;
    if (hit.onto == std::string("body")) return world;
    Obstacle& obstacle = world.obstacles.emplace_back();
    obstacle.restitution = hit.restitution;
    obstacle.shape = HalfSpace{};
    if (hit.onto == std::string("edge")) {
        obstacle.shape = Cuboid{{0, -size, 0}, {std::numbers::sqrt2 * size, std::numbers::sqrt2 * size, 8 * size}};
        obstacle.motion.centre = {0, -size, 0};
        obstacle.motion.angle.constant = {0, 0, std::numbers::pi / 4};
    }
    return world;
}

TEST(ContactLaw, EnergyNeverGrowsInAHit) {
    const double size = 0.2;
    for (const Hit& hit :
         {Hit{"rubber", "plane", 30, 1}, Hit{"rubber", "body", 30, 0}, Hit{"soft-rubber", "edge", 10, 0},
          Hit{"soft-rubber", "body", 10, 0}, Hit{"soft-rubber", "body", 10, 1}, Hit{"lattice", "plane", 10, 1}}) {
        Actor first = actor(cube(size, preset(hit.material)), Vec3d(0.03, 0.505, 0.02) * size);
        first.velocity = {0, -hit.speed, 0};
        std::vector<Actor> actors = {first};
        if (hit.onto == std::string("body")) {
            actors.push_back(actor(first.body, Vec3d(-0.03, -0.505, -0.02) * size));
            actors[1].velocity = {0, hit.speed, 0};
        }
        Simulation hitting = simulation(world_of(hit, size), actors, {.automatic_rigid = false});
        const double before = hitting.energy(kOneThread).total();
        for (int frame = 0; frame < 12; ++frame) {
            run(hitting, 1);
            ASSERT_LT(hitting.energy(kOneThread).total(), 1.01 * before)
                << hit.material << " onto " << hit.onto << " at " << hit.speed << ", frame " << frame;
        }
        EXPECT_GT(velocity_of(hitting, 0).y(), 0) << hit.material << " does not stick to " << hit.onto;
    }
}

// What jumps strikes nobody.

TEST(ContactLaw, AnObstacleThatJumpsIntoABodyMovesItWithoutABlow) {
    for (const bool is_cuboid : {false, true}) {
        World world = with_ground(0);
        if (is_cuboid) world.obstacles[0].shape = Cuboid{{0, -0.5, 0}, {2, 1, 2}};
        const double jump = 0.1;
        world.obstacles[0].motion.move = {{0, 0.25, 0.25, 1}, {}, Vec3d::Zero()};
        for (const double up : {0.0, 0.0, jump, jump}) world.obstacles[0].motion.move.values.emplace_back(0, up, 0);
        Simulation stands = simulation(world, {actor(block(4, 4, 4, 0.1, preset("rubber")), {0, 0.2, 0})}, kExplicit);
        double fastest = 0;
        for (int frame = 0; frame < 40; ++frame) {
            run(stands, 1);
            for (std::size_t i = 0; i < stands.velocities(0).size(); ++i)
                fastest = std::max(fastest, double(stands.velocities(0)[i].norm()));
        }
        EXPECT_LT(fastest, 0.5) << (is_cuboid ? "cuboid" : "half-space");
        EXPECT_NEAR(centre_of_mass(stands).y(), 0.2 + jump, 0.01) << (is_cuboid ? "cuboid" : "half-space");
    }
}

// A stone on soft rubber sinks in as far as rubber lets it, and stays out.

TEST(ContactLaw, AStoneStandsOnSoftRubber) {
    World world = with_ground(0);
    const auto mat = block(6, 3, 6, 0.1, preset("soft-rubber")), stone = block(2, 2, 2, 0.1, preset("stone"));
    Simulation stack = simulation(world, {actor(mat, {0, 0.15, 0}), actor(stone, {0, 0.401, 0})}, kExplicit);
    FrameReport last;
    for (int frame = 0; frame < 300; ++frame) last = run(stack, 1);
    EXPECT_LT(last.deepest_in_matter, 0.03);
    EXPECT_GT(centre_of_mass(stack, 1).y(), 0.36);
    EXPECT_LT(velocity_of(stack, 1).norm(), 0.1) << "rubber sways on, but no more";
}

/// A column of 1e6 Pa, 0.1 m across, buckles under its own weight from 0.85 m on: (7.84 E I / (rho g A))^(1/3).
TEST(ContactLaw, TenSoftCubesStand) {
    World world = with_ground(0);
    world.body_restitution = 0;
    world.body_friction = 0.5;
    Material material = preset("rubber");
    material.damping = 0.5;
    material.young_modulus = 3e6;
    const auto one = block(3, 3, 3, 0.1 / 3, material);
    std::vector<Actor> cubes;
    for (int i = 0; i < 10; ++i) cubes.push_back(actor(one, {0, 0.05 + 0.1 * i, 0}));
    Simulation stack = simulation(world, cubes, kExplicit);
    run(stack, 50);
    for (std::size_t b = 0; b < cubes.size(); ++b) {
        const Vec3d at = centre_of_mass(stack, b);
        EXPECT_NEAR(at.y(), 0.05 + 0.1 * double(b), 0.01) << b;
        EXPECT_LT(std::hypot(at.x(), at.z()), 0.01) << b;
    }
}

} // namespace
} // namespace filigree::contact_law_test
