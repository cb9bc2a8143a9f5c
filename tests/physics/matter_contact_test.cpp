// Bodies that touch each other and themselves.

#include "filigree/core/random.h"
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/physics/contact/cell_boxes.h"
#include "filigree/physics/rigid/rigid_body.h"
#include "io/corpus.h"
#include "physics/test_bodies.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace filigree {
namespace {

Material rubber(double young_modulus = 1e6, double damping = 0) {
    Material material;
    material.young_modulus = young_modulus;
    material.damping = damping;
    return material;
}

Actor put(std::shared_ptr<const Body> body, const Vec3d& at, double degrees = 0,
          const Vec3d& velocity = Vec3d::Zero()) {
    Actor actor{.body = std::move(body), .velocity = velocity};
    actor.placement = Eigen::Translation3d(at) * Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3d::UnitZ());
    return actor;
}

Simulation begin(World world, std::vector<Actor> actors) {
    return Simulation::create(std::move(world), std::move(actors), {.mode = StepMode::explicit_steps}, kOneThread)
        .value();
}

/// Something at rest on a slope, or sliding down it. `on_body`: the slope is a body that is held fast.
struct Slope {
    double degrees;
    bool on_body;
    World world;
    std::vector<Actor> actors;
    Vec3d normal, down;

    Slope(double the_degrees, bool is_body, double friction, const Material& matter = rubber(),
          std::size_t cells_along = 60)
        : degrees(the_degrees), on_body(is_body) {
        const double angle = degrees * std::numbers::pi / 180;
        normal = Vec3d(-std::sin(angle), std::cos(angle), 0);
        down = Vec3d(-std::cos(angle), -std::sin(angle), 0);
        world.body_friction = friction;
        if (on_body) {
            actors.push_back(put(block(cells_along, 3, 8, 0.05, matter), -0.075 * normal, degrees));
            Pin pin;
            for (Index i = 0; i < actors[0].body->particle_count(); ++i) pin.particles.push_back(i);
            world.pins.push_back(pin);
        } else {
            Obstacle plane;
            plane.shape = HalfSpace{Vec3d::Zero(), normal};
            plane.friction = friction;
            world.obstacles.push_back(plane);
        }
    }
    /// Metres up the slope from its middle.
    std::size_t add(std::shared_ptr<const Body> body, double height, double up, double speed) {
        Actor actor = put(std::move(body), height * normal - up * down, degrees, speed * down);
        actors.push_back(actor);
        return actors.size() - 1;
    }
};

TEST(MatterContact, ASquareStackStands) {
    const std::size_t bodies = 5;
    const int seconds = 60;
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    std::vector<Actor> actors;
    const auto cube = block(3, 3, 3, 0.4 / 3, rubber(1e6, 0.5));
    for (std::size_t i = 0; i < bodies; ++i) actors.push_back(put(cube, Vec3d(0, 0.2 + 0.4 * double(i), 0)));
    Simulation stack = begin(world, actors);
    std::vector<Vec3d> before;
    for (int frame = 0; frame < 60 * seconds; ++frame) {
        ASSERT_TRUE(stack.advance(kOneThread).ok());
        if (frame + 1 != 60 * (seconds - 4)) continue;
        for (std::size_t b = 0; b < bodies; ++b) before.push_back(centre_of_mass(stack, b));
    }
    for (std::size_t b = 0; b < bodies; ++b) {
        EXPECT_LT((centre_of_mass(stack, b) - before[b]).norm() / 4, 1e-5) << "m/s, of body " << b;
        EXPECT_NEAR(centre_of_mass(stack, b).y(), 0.2 + 0.4 * double(b), 0.03);
        EXPECT_LT(std::hypot(centre_of_mass(stack, b).x(), centre_of_mass(stack, b).z()), 2e-3);
    }
}

// Flat plates: a tower of five cubes would tip over.
TEST(MatterContact, AStackHoldsOnASlopeOfTwentyDegrees) {
    const std::size_t bodies = 5;
    Slope slope(20, false, 0.5);
    const std::size_t across = 6, high = 2;
    const double spacing = 0.4 / double(across);
    const auto plate = block(across, high, across, spacing, rubber(1e6, 0.5));
    for (std::size_t i = 0; i < bodies; ++i) slope.add(plate, (0.5 + double(i)) * double(high) * spacing, 0, 0);
    Simulation stack = begin(slope.world, slope.actors);
    std::vector<Vec3d> before;
    for (int frame = 0; frame < 900; ++frame) {
        ASSERT_TRUE(stack.advance(kOneThread).ok());
        if (frame + 1 != 600) continue;
        for (std::size_t b = 0; b < bodies; ++b) before.push_back(centre_of_mass(stack, b));
    }
    for (std::size_t b = 0; b < bodies; ++b)
        EXPECT_LT((centre_of_mass(stack, b) - before[b]).norm() / 5, 1e-5) << "m/s, of body " << b;
}

TEST(MatterContact, SlidingFollowsCoulombOnObstaclesAndOnBodies) {
    for (const bool on_body : {false, true})
        for (const double degrees : {26.0, 30.0, 40.0}) {
            Slope slope(degrees, on_body, 0.5);
            const std::size_t body = slope.add(block(4, 4, 4, 0.05, rubber()), 0.1002, 1.2, 1);
            Simulation sliding = begin(slope.world, slope.actors);
            std::vector<double> way;
            for (int frame = 0; frame < 33; ++frame) {
                ASSERT_TRUE(sliding.advance(kOneThread).ok());
                way.push_back(centre_of_mass(sliding, body).dot(slope.down));
            }
            const double first = (way[7] - way[2]) * 12, last = (way[32] - way[27]) * 12; // m/s
            const double angle = degrees * std::numbers::pi / 180, acceleration = (last - first) / (25.0 / 60);
            const double friction = (9.81 * std::sin(angle) - acceleration) / (9.81 * std::cos(angle));
            EXPECT_NEAR(friction, 0.5, 0.01) << degrees << (on_body ? " degrees, on a body" : " degrees");
        }
}

TEST(MatterContact, ABlockHoldsOnABodyAndSlidesBeyondItsAngle) {
    for (const double degrees : {10.0, 20.0, 24.0, 30.0}) {
        Slope slope(degrees, true, 0.5);
        const std::size_t body = slope.add(block(4, 4, 4, 0.05, rubber(1e6, 0.5)), 0.1002, 0.3, 0);
        Simulation resting = begin(slope.world, slope.actors);
        for (int frame = 0; frame < 120; ++frame) ASSERT_TRUE(resting.advance(kOneThread).ok());
        const Vec3d before = centre_of_mass(resting, body);
        for (int frame = 0; frame < 60; ++frame) ASSERT_TRUE(resting.advance(kOneThread).ok());
        const double speed = (centre_of_mass(resting, body) - before).norm();
        if (degrees < 26)
            EXPECT_LT(speed, 1e-4) << degrees;
        else
            EXPECT_GT(speed, 0.1) << degrees;
    }
}

TEST(MatterContact, BodiesMeetWithoutPassingAndKeepMomentumAndEnergy) {
    const auto cube = block(6, 6, 6, 0.4 / 6, rubber());
    const double wave_speed = pressure_wave_speed(rubber()); // 36.7 m/s
    for (const double speed : {1.0, 5.0, wave_speed / 2}) {
        World world;
        world.gravity.setZero();
        Simulation meeting = begin(world, {put(cube, {-0.3, 0, 0}, 0, {speed / 2, 0, 0}),
                                           put(cube, {0.3, 0.05, 0.03}, 0, {-speed / 2, 0, 0})});
        const double energy = meeting.energy(kOneThread).total();
        const Momentum momentum = meeting.momentum();
        double nearest = 1;
        for (int frame = 0; frame < 45; ++frame) {
            ASSERT_TRUE(meeting.advance(kOneThread).ok());
            nearest = std::min(nearest, centre_of_mass(meeting, 1).x() - centre_of_mass(meeting, 0).x());
            EXPECT_LT(meeting.energy(kOneThread).total(), 1.01 * energy) << speed;
        }
        EXPECT_LT(nearest, 0.42);
        EXPECT_GT(nearest, 0.2);
        EXPECT_GT(centre_of_mass(meeting, 1).x() - centre_of_mass(meeting, 0).x(), nearest + 0.02) << "they part again";
        const Momentum after = meeting.momentum();
        EXPECT_LT((after.angular - momentum.angular).norm(), 1e-5 * momentum.angular.norm()) << speed;
        EXPECT_LT((after.linear - momentum.linear).norm(), 1e-5 * 64 * speed) << speed;
    }
}

/// The arms are pressed together by a palm on each side.
Simulation fork_between_palms(MaterialModel model, bool touches_itself) {
    World world;
    world.gravity.setZero();
    for (const int side : {-1, 1}) {
        Obstacle palm;
        palm.shape = Cuboid{Vec3d(side * 0.5, 1.2, 0), Vec3d(0.2, 0.3, 1)};
        palm.motion.move = {{0, 1}, {Vec3d::Zero(), Vec3d(-side * 0.16, 0, 0)}, Vec3d::Zero()};
        palm.friction = 0;
        world.obstacles.push_back(palm);
    }
    Material matter = rubber(1e5, 2);
    matter.model = model;
    const auto body = std::make_shared<Body>(make_body(fork(), matter));
    return Simulation::create(std::move(world), {put(body, Vec3d::Zero())},
                              {.mode = StepMode::explicit_steps, .contacts_within_bodies = touches_itself}, kOneThread)
        .value();
}

/// Returns how far one arm's inner face went past the other's, m.
double press(MaterialModel model, bool touches_itself, FrameReport& worst) {
    Simulation pressed = fork_between_palms(model, touches_itself);
    std::vector<Vec3f> faces;
    for (const float side : {-0.05f, 0.05f})
        for (const float z : {-0.1f, 0.0f, 0.1f}) faces.emplace_back(side, 1.2f, z);
    const std::size_t attachment = pressed.attach(0, faces, kOneThread);
    for (int frame = 0; frame < 90; ++frame) {
        const FrameReport report = pressed.advance(kOneThread).value();
        worst.deepest_in_matter = std::max(worst.deepest_in_matter, report.deepest_in_matter);
    }
    pressed.attached(attachment, faces, {}, kOneThread);
    double past = -1;
    for (std::size_t k = 0; k < 3; ++k) past = std::max(past, double(faces[k].x() - faces[k + 3].x()));
    return past;
}

TEST(MatterContact, ABodyMeetsItself) {
    FrameReport with, without;
    EXPECT_LT(press(MaterialModel::fem, true, with), 0.03);
    EXPECT_GT(press(MaterialModel::fem, false, without), 0.06) << "the scene asks nothing of contact";
    EXPECT_LT(with.deepest_in_matter, 0.3 * 0.1);
    EXPECT_GT(with.deepest_in_matter, 0);
    EXPECT_EQ(without.deepest_in_matter, 0);
}

/// Surface points that lie deeper than 0.3 spacings in a body's own matter, more than a spacing at rest from their own
/// place: asked cell by cell.
std::size_t points_within(const Matter& matter, const Vectors& positions) {
    const Body& body = matter.body();
    const Embedding& points = body.surface.points;
    std::vector<CellBox> boxes;
    for (Index c = 0; c < body.cells.cells.size(); ++c) boxes.emplace_back(matter.corners(c), positions);
    const auto spacing = float(body.spacing());
    std::size_t count = 0;
    for (Index s = 0; s < points.size(); ++s) {
        float deepest = 0;
        const Vec3f p = embedded_point(points, s, positions);
        for (Index c = 0; c < boxes.size(); ++c) {
            if (!boxes[c].holds(p, 0)) continue;
            Matter::Place place{c};
            if (!matter.locate_in_cell(positions, p, place)) continue;
            if ((matter.rest_position(place) - points.rest[s]).norm() < spacing) continue;
            const auto depth = matter.depth(place, matter.inverse_derivative(positions, place), Vec3f::Zero());
            if (depth) deepest = std::max(deepest, depth->depth);
        }
        count += deepest > 0.3f * spacing;
    }
    return count;
}

/// It lands on its feet, and its creases close.
TEST(MatterContact, AKoalaThatSitsDownStaysOutOfItself) {
    constexpr std::size_t kAsked = 300; // points that would lie within the koala without contact
    const std::vector<filigree_test::CorpusRow> rows = filigree_test::read_corpus();
    const auto koala = std::ranges::find_if(rows, [](const auto& row) { return row.path.stem() == "koala_100k"; });
    if (koala == rows.end()) GTEST_SKIP() << "no koala in the corpus";
    const Mesh mesh = read_mesh(koala->path, kAllThreads).value().mesh;
    BodyOptions options;
    options.scale = 0.12;
    options.cells.count = 6000;
    const auto body = std::make_shared<Body>(make_body(mesh, rubber(1.5e5, 1), options, kAllThreads).value());
    const Box box = bounds(mesh.positions);
    const auto drop = [&](bool meets_itself) {
        World world;
        Obstacle& ground = world.obstacles.emplace_back();
        ground.shape = HalfSpace{Vec3d::Zero(), Vec3d::UnitY()};
        ground.friction = 0.8;
        Simulation dropped = Simulation::create(world, {put(body, Vec3d(0, 0.55, 0) - 0.12 * box.centre())},
                                                {.contacts_within_bodies = meets_itself}, kAllThreads)
                                 .value();
        const Matter matter(*body);
        std::size_t within = 0;
        for (int frame = 0; frame < 90; ++frame) {
            EXPECT_TRUE(dropped.advance(kAllThreads).ok());
            if (frame % 3 == 0) within += points_within(matter, dropped.positions(0));
            if (!meets_itself && within > kAsked) break; // enough is known
        }
        return within;
    };
    const std::size_t within = drop(true), unmet = drop(false);
    EXPECT_LT(within, 10u); // in 30 frames; 274 where no folds are looked for
    EXPECT_GT(unmet, kAsked) << "the scene asks nothing of contact";
    RecordProperty("points", std::to_string(within) + " of " + std::to_string(unmet));
}

/// Two plates press a koala's legs against each other and its belly.
TEST(MatterContact, AKoalasLegsStayOutOfEachOther) {
    const std::vector<filigree_test::CorpusRow> rows = filigree_test::read_corpus();
    const auto koala = std::ranges::find_if(rows, [](const auto& row) { return row.path.stem() == "koala_100k"; });
    if (koala == rows.end()) GTEST_SKIP() << "no koala in the corpus";
    const Mesh mesh = read_mesh(koala->path, kAllThreads).value().mesh;
    const double scale = 0.12;
    BodyOptions options;
    options.scale = scale;
    options.cells.count = 6000;
    const auto body = std::make_shared<Body>(make_body(mesh, rubber(2e5, 0.2), options, kAllThreads).value());
    const Box box = bounds(mesh.positions);
    const Vec3d size = scale * box.size();
    World world;
    world.gravity.setZero();
    for (const int side : {-1, 1}) {
        Obstacle& plate = world.obstacles.emplace_back();
        plate.shape = Cuboid{Vec3d(side * (size.x() / 2 + 0.1), -size.y() / 4, 0), Vec3d(0.2, 0.35 * size.y(), 2)};
        plate.motion.move = {{0, 1.5}, {Vec3d::Zero(), Vec3d(-side * 0.225 * size.x(), 0, 0)}, Vec3d::Zero()};
        plate.friction = 0.5;
    }
    Simulation pressed = begin(world, {put(body, -scale * box.centre())});
    double deepest = 0;
    for (int frame = 0; frame < 120; ++frame)
        deepest = std::max(deepest, pressed.advance(kAllThreads).value().deepest_in_matter);
    EXPECT_GT(deepest, 0) << "the scene asks nothing of contact";
    EXPECT_LT(deepest, 0.3 * body->spacing());
    RecordProperty("spacings", std::to_string(deepest / body->spacing()));
}

TEST(MatterContact, FrictionMayDifferFromPairToPair) {
    Slope slope(20, true, 0.5);
    const std::size_t rough = slope.add(block(2, 2, 2, 0.1, rubber(1e6, 0.5)), 0.1002, 0.3, 0);
    const std::size_t smooth = slope.add(block(2, 2, 2, 0.1, rubber(1e6, 0.5)), 0.1002, -0.3, 0);
    slope.world.body_pairs.push_back({smooth, 0, {.friction = 0.05}});
    Simulation both = begin(slope.world, slope.actors);
    for (int frame = 0; frame < 60; ++frame) ASSERT_TRUE(both.advance(kOneThread).ok());
    EXPECT_LT(centre_of_mass(both, rough).dot(slope.down), -0.28);
    EXPECT_GT(centre_of_mass(both, smooth).dot(slope.down), 0.8);
}

TEST(MatterContact, SavedWhileTouchingItGoesOnTheSameForAnyThreads) {
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    const auto cube = block(4, 4, 4, 0.1, rubber(1e5, 0.5));
    const std::vector<Actor> actors = {put(cube, {0, 0.2, 0}), put(cube, {0.1, 0.62, 0.05}, 10),
                                       put(std::make_shared<Body>(make_body(fork(), rubber(5e4))), {0, 0.9, 0})};
    Simulation one = begin(world, actors);
    for (int frame = 0; frame < 40; ++frame) ASSERT_TRUE(one.advance(kOneThread).ok());
    Simulation other = begin(world, actors);
    ASSERT_TRUE(other.restore(one.save()).ok());
    EXPECT_TRUE(one.save() == other.save());
    const RunContext two_threads(2);
    for (int frame = 0; frame < 20; ++frame) {
        ASSERT_TRUE(one.advance(kOneThread).ok());
        ASSERT_TRUE(other.advance(two_threads).ok());
    }
    EXPECT_TRUE(one.save() == other.save());
}

} // namespace
} // namespace filigree
