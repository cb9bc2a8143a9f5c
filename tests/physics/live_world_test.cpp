// A simulation at its start as bytes: what is read again moves as what was written, to the byte.
#include "filigree/physics/step/live_world.h"

#include "filigree/physics/simulation.h"

#include <gtest/gtest.h>

#include <cstring>

namespace filigree {

namespace {

std::shared_ptr<const Body> body_of(const char* shape, const Material& material, std::size_t particles, double size) {
    const Mesh mesh = make_shape(shape, {.resolution = 8}).value();
    BodyOptions options;
    options.size = size;
    options.cells.count = particles;
    return std::make_shared<const Body>(make_body(mesh, material, options).value());
}

/// Two bodies that share their matter, one that breaks, a pin, a hand, wind, a mesh and a moving ball.
LiveWorld everything() {
    LiveWorld live;
    const auto rubber = body_of("wavy-sphere", Material{}, 60, 0.4);
    const auto brittle = body_of("wavy-cube", Material{.young_modulus = 3e5}, 60, 0.4);
    const auto stone = body_of("wavy-cube", Material{.model = MaterialModel::rigid}, 60, 0.2);
    const auto halves = break_body(brittle, {2, [](const Vec3d& p) { return Index(p.x() > 0.01); }}).value();
    for (int k = 0; k < 2; ++k) {
        Actor& actor = live.actors.emplace_back(Actor{.body = rubber, .velocity = {0, -1, 0}});
        actor.placement.translation() = Vec3d(0.05 * k, 0.5 + 0.45 * k, 0);
    }
    live.actors.push_back({.body = stone});
    live.actors.back().placement.translation() = Vec3d(0.3, 1.3, 0.1);
    live.actors.push_back({.body = brittle});
    live.actors.back().placement.translation() = Vec3d(-0.6, 0.5, 0);
    Fracture fracture{halves, {.strength = 1e3, .seed = 3}, {{.time = 0.05, .pieces = {}, .particles = {}}}};
    live.actors.back().fracture = std::make_shared<const Fracture>(fracture);

    World& world = live.world;
    world.wind = {{}, {}, Vec3d(1, 0, 0)};
    world.air_density = 1.2;
    world.obstacles.push_back(Obstacle{HalfSpace{}, {}});
    world.obstacles.push_back(Obstacle{Ball{{0.3, 0.1, 0}, 0.2}, {}});
    world.obstacles.back().motion.move = {{0, 1}, {Vec3d::Zero(), Vec3d(-0.3, 0, 0)}, Vec3d::Zero()};
    world.obstacles.push_back(Obstacle{Cuboid{{-1, 0.2, 0}, {0.2, 0.4, 1}}, {}});
    const Mesh bump = make_shape("wavy-sphere", {.resolution = 6}).value();
    world.obstacles.push_back(Obstacle{make_mesh_obstacle(bump, 0.2, 0.05).value(), {}});
    world.pins.push_back({.body = 1, .particles = {0, 1, 2}, .motion = {}});
    world.hands.push_back({.body = 0, .point = rubber->rest[0], .target = {{}, {}, Vec3d(0.5, 1, 0)}});
    world.body_pairs.push_back({0, 1, {.friction = 0.1, .restitution = 0.2}});
    world.group_pairs.push_back({{2}, {0, 1}, {.friction = 0.6, .restitution = 0.1}});
    live.attached.push_back({0, {rubber->rest[0], rubber->rest[5]}, {}});
    live.attached.push_back({3, {brittle->rest[0], brittle->rest[9]}, {0, 1}});
    return live;
}

/// Where everything is after some frames.
std::string motion_of(const LiveWorld& live, int frames) {
    Simulation simulation = Simulation::create(live.world, live.actors, live.options).value();
    for (const AttachedPoints& points : live.attached)
        simulation.attach(points.body, points.points, points.pieces, RunContext());
    for (int frame = 0; frame < frames; ++frame) simulation.advance().value();
    std::string bytes = simulation.save();
    for (std::size_t k = 0; k < live.attached.size(); ++k) {
        std::vector<Vec3f> points(live.attached[k].points.size());
        std::vector<Mat3f> gradients(points.size());
        simulation.attached(k, points, gradients, RunContext());
        bytes.append(reinterpret_cast<const char*>(points.data()), points.size() * sizeof(Vec3f));
        bytes.append(reinterpret_cast<const char*>(gradients.data()), gradients.size() * sizeof(Mat3f));
    }
    return bytes;
}

} // namespace

TEST(LiveWorld, MovesAsTheWorldThatWasWritten) {
    const LiveWorld live = everything();
    const LiveWorld again = read_live_world(write_live_world(live).value()).value();
    EXPECT_EQ(again.actors[0].body, again.actors[1].body); // shared again
    EXPECT_EQ(motion_of(again, 12), motion_of(live, 12));
}

TEST(LiveWorld, APointOfABrokenBodyGoesToTheNearestPiece) {
    const LiveWorld live = everything();
    const LiveWorld again = read_live_world(write_live_world(live).value()).value();
    const Actor& actor = again.actors[3];
    Simulation simulation = Simulation::create(again.world, again.actors, again.options).value();
    // A hand on the left half pulls the left half alone once the halves have come apart.
    const Body& whole = *actor.body;
    Index left = 0, right = 0;
    for (Index i = 0; i < whole.particle_count(); ++i) {
        if (whole.rest.x[i] < whole.rest.x[left]) left = i;
        if (whole.rest.x[i] > whole.rest.x[right]) right = i;
    }
    Hand hand{.body = 3, .point = whole.rest[left]};
    hand.target.constant = Vec3d(-2, 2, 0);
    ASSERT_TRUE(simulation.set_hands({hand}));
    for (int frame = 0; frame < 40; ++frame) simulation.advance().value();
    EXPECT_GT(simulation.fracture(3).broken_area, 0);
    EXPECT_GT((simulation.positions(3)[left] - simulation.positions(3)[right]).norm(), 1);
}

TEST(LiveWorld, DamagedBytesAreRefused) {
    const std::string bytes = write_live_world(everything()).value();
    for (const std::size_t size :
         {std::size_t(0), std::size_t(7), std::size_t(20), bytes.size() / 2, bytes.size() - 1}) {
        const Result<LiveWorld> read = read_live_world(std::string_view(bytes).substr(0, size));
        ASSERT_FALSE(read) << size;
        EXPECT_EQ(read.error().code, ErrorCode::bad_file);
    }
    for (const std::size_t place : {std::size_t(0), std::size_t(9), bytes.size() / 3, bytes.size() - 4}) {
        std::string other = bytes;
        other[place] = char(other[place] ^ 0x20);
        EXPECT_FALSE(read_live_world(other)) << place;
    }
}

TEST(LiveWorld, ABodyOfMpmIsRefused) {
    LiveWorld live;
    live.actors.push_back({.body = body_of("wavy-sphere", Material{.model = MaterialModel::mpm}, 60, 0.4)});
    const Result<std::string> bytes = write_live_world(live);
    ASSERT_FALSE(bytes);
    EXPECT_EQ(bytes.error().code, ErrorCode::unsuitable);
}

TEST(SetGravity, TurnsFallAndWakesWhatSleeps) {
    World world;
    world.obstacles.push_back(Obstacle{HalfSpace{}, {}});
    Actor actor{.body = body_of("wavy-cube", Material{.model = MaterialModel::rigid}, 60, 0.2)};
    actor.placement.translation() = Vec3d(0, 0.101, 0);
    Simulation simulation = Simulation::create(world, {actor}).value();
    for (int frame = 0; frame < 240 && !simulation.is_asleep(0); ++frame) simulation.advance().value();
    ASSERT_TRUE(simulation.is_asleep(0));
    ASSERT_TRUE(simulation.set_gravity(Vec3d(0, -9.81, 0))); // the same: nothing wakes
    EXPECT_TRUE(simulation.is_asleep(0));
    ASSERT_TRUE(simulation.set_gravity(Vec3d(0, 5, 0)));
    EXPECT_FALSE(simulation.is_asleep(0));
    const float before = simulation.positions(0).y[0];
    for (int frame = 0; frame < 30; ++frame) simulation.advance().value();
    EXPECT_NEAR(simulation.positions(0).y[0] - before, 0.5 * 5 * 0.25, 0.1); // it rises as far as it would fall
    const Status refused = simulation.set_gravity(Vec3d(0, std::numeric_limits<double>::quiet_NaN(), 0));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    EXPECT_EQ(simulation.world().gravity, Vec3d(0, 5, 0));
}

} // namespace filigree
