// Bodies that break: what holds pieces, when it lets go, and what is kept.
#include "filigree/core/random.h"
#include "filigree/mesh.h"
#include "filigree/physics/body/elasticity.h"
#include "filigree/physics/breaking/broken_body.h"
#include "filigree/physics/simulation.h"
#include "test_bodies.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace filigree {
namespace {

/// Voronoi cells of points.
Partition cells_of(std::vector<Vec3d> seeds) {
    const auto count = Index(seeds.size());
    return {count, [seeds = std::move(seeds)](const Vec3d& point) {
                Index nearest = 0;
                for (Index s = 1; s < seeds.size(); ++s)
                    if ((seeds[s] - point).squaredNorm() < (seeds[nearest] - point).squaredNorm()) nearest = s;
                return nearest;
            }};
}

/// Two pieces on either side of a plane.
Partition halves(const Vec3d& point, const Vec3d& normal) {
    return cells_of({point - 0.1 * normal.normalized(), point + 0.1 * normal.normalized()});
}

Material brittle() { return undamped(0.2); }

std::shared_ptr<Fracture> fracture_of(std::shared_ptr<const Body> whole, Partition partition, double strength,
                                      double energy) {
    auto fracture = std::make_shared<Fracture>();
    fracture->body = break_body(std::move(whole), std::move(partition), kTwoThreads).value();
    fracture->material.strength = strength;
    fracture->material.energy = energy;
    return fracture;
}

World empty_world() {
    World world;
    world.gravity = Vec3d::Zero();
    return world;
}

/// Pieces that are not there, or too few of them: points go with the piece they lie in.
TEST(BrokenBody, PointsOfPiecesThatAreNotThereGoWithThoseTheyLieIn) {
    const auto whole = block(6, 5, 4, 0.1, brittle());
    Actor falls{whole};
    falls.fracture = fracture_of(whole, halves({0.013, 0, 0}, {1, 0.3, 0.2}), 1e3, 1);
    Simulation simulation = Simulation::create(World{}, {falls}, {}, kTwoThreads).value();
    const std::vector<Vec3f> points = {{0.2f, 0, 0}, {-0.2f, 0.1f, 0}};
    const std::vector<Index> wrong = {99, kNoIndex}, few = {77};
    for (const std::size_t attached :
         {simulation.attach(0, points, kTwoThreads), simulation.attach(0, points, wrong, kTwoThreads),
          simulation.attach(0, points, few, kTwoThreads)}) {
        std::vector<Vec3f> now(2);
        simulation.attached(attached, now, {}, kTwoThreads);
        for (std::size_t p = 0; p < 2; ++p) EXPECT_LT((now[p] - points[p]).norm(), 1e-5f);
    }
}

TEST(BrokenBody, PiecesAreTheWhole) {
    const auto whole = block(6, 5, 4, 0.1, brittle());
    BrokenBodyReport report;
    const auto kept = break_body(whole, halves({0.013, 0, 0}, {1, 0.3, 0.2}), kTwoThreads, &report).value();
    const BrokenBody& broken = *kept;
    ASSERT_EQ(broken.pieces.size(), 2u);
    // Masses of the copies add up to each corner's.
    for (Index corner = 0; corner < whole->mass.size(); ++corner) {
        double mass = 0;
        for (const CornerCopy& copy : broken.copies_of(corner))
            mass += double(broken.pieces[copy.piece]->mass[copy.corner]);
        EXPECT_NEAR(mass, double(whole->mass[corner]), 1e-6 * double(whole->mass[corner]));
    }
    // The plane's area within the block: 0.5 * 0.4 over the cosine.
    const double area = 0.5 * 0.4 * Vec3d(1, 0.3, 0.2).norm();
    EXPECT_NEAR(report.crack_area, area, 0.02 * area);
    double held = 0;
    for (const CrackLink& link : broken.links) held += double(link.area);
    EXPECT_NEAR(held, report.crack_area, 1e-4 * area);
    // Energies of deformed copies add up to the whole's.
    Vectors positions = whole->rest;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const Vec3f p = whole->rest[i];
        positions.set(i, p + Vec3f(0.1f * p.x() + 0.2f * p.y() * p.y(), -0.05f * p.y(), 0.3f * p.x() * p.z()));
    }
    double sum = 0;
    for (std::size_t k = 0; k < 2; ++k) {
        Vectors own(broken.pieces[k]->rest.size());
        for (std::size_t c = 0; c < own.size(); ++c) own.set(c, positions[broken.corners_of_whole[k][c]]);
        sum += make_elasticity(*broken.pieces[k], kTwoThreads)->energy(own, kTwoThreads);
    }
    const double energy = make_elasticity(*whole, kTwoThreads)->energy(positions, kTwoThreads);
    EXPECT_NEAR(sum, energy, 1e-5 * energy);
}

/// A plane that leaves a sliver of a layer of cells on one side.
Partition sliced_beside_cells() { return halves({0.0006, 0, 0}, {1, 0.02, 0.01}); }

TEST(BrokenBody, NoCopyOfACellIsASliver) {
    const auto whole = block(10, 3, 3, 0.1, brittle());
    const auto broken = break_body(whole, sliced_beside_cells(), kTwoThreads).value();
    std::vector<float> sum(whole->cells.cells.size(), 0);
    for (std::size_t k = 0; k < broken->pieces.size(); ++k)
        for (std::size_t c = 0; c < broken->cells_of_whole[k].size(); ++c) {
            EXPECT_GE(broken->pieces[k]->cells.fraction[c], 0.999f * Cells::kLeastFraction);
            sum[broken->cells_of_whole[k][c]] += broken->pieces[k]->cells.fraction[c];
        }
    for (const float fraction : sum) EXPECT_NEAR(fraction, 1, 1e-6);
}

/// A bar pulled at both ends at a constant speed.
struct PulledBar {
    std::shared_ptr<const Body> body;
    World world;
    double length;

    PulledBar(std::shared_ptr<const Body> bar, double speed) : body(std::move(bar)), world(empty_world()) {
        const Box box = bounds([&] {
            std::vector<Vec3f> points;
            for (std::size_t i = 0; i < body->rest.size(); ++i) points.push_back(body->rest[i]);
            return points;
        }());
        length = box.size().x();
        for (const double side : {-1.0, 1.0}) {
            Pin pin;
            for (std::size_t i = 0; i < body->rest.size(); ++i)
                if (std::abs(double(body->rest[i].x()) - side * 0.5 * length) < 1e-4) pin.particles.push_back(Index(i));
            pin.motion.move.times = {0, 100};
            pin.motion.move.values = {Vec3d::Zero(), {side * 50 * speed, 0, 0}};
            world.pins.push_back(pin);
        }
    }
};

TEST(Fracture, ABarBreaksAtItsStrength) {
    Material material = brittle();
    material.poisson_ratio = 0; // so that the pinned ends do no harm
    material.damping = 20;
    const double strength = 1e4; // a strain of 1 %
    for (const double place : {0.0, 0.03, 0.05}) {
        PulledBar bar(block(16, 3, 3, 0.1, material), 0.02);
        const auto fracture = fracture_of(bar.body, halves({place, 0, 0}, {1, 0, 0}), strength, 5);
        Simulation simulation =
            Simulation::create(bar.world, {{.body = bar.body, .fracture = fracture}},
                               {.frames_per_second = 200, .contacts_within_bodies = false}, kTwoThreads)
                .value();
        double time = 0;
        while (simulation.fracture(0).parts == 1 && time < 2) {
            ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
            time = simulation.time();
        }
        const double stress = 1e6 * 0.02 * simulation.fracture(0).first / bar.length;
        EXPECT_NEAR(stress, strength, 0.02 * strength) << place;
        EXPECT_EQ(simulation.fracture(0).parts, 2u);
    }
}

/// A free block whose ends fly apart, and turn a little.
struct FlyingBlock {
    std::shared_ptr<const Body> body = block(10, 3, 3, 0.1, brittle());
    Vectors velocities{body->rest.size()};
    explicit FlyingBlock(float rate) {
        for (std::size_t i = 0; i < body->rest.size(); ++i) {
            const Vec3f& p = body->rest[i];
            velocities.set(i, {rate * p.x() + 1, -0.05f * rate * p.x() + 0.3f, 0.1f * rate * p.y()});
        }
    }
    Simulation simulation(std::shared_ptr<const Fracture> fracture) const {
        Simulation made = Simulation::create(empty_world(), {{.body = body, .fracture = std::move(fracture)}},
                                             {.frames_per_second = 100,
                                              .mode = StepMode::explicit_steps,
                                              .contacts_between_bodies = false,
                                              .contacts_within_bodies = false},
                                             kTwoThreads)
                              .value();
        EXPECT_TRUE(made.set_velocities(0, velocities).ok());
        return made;
    }
};

/// Over several places of the crack in its cells: at one of them the loss may be right by chance.
TEST(Fracture, EnergyAndMomentum) {
    constexpr std::array kPlaces = {0.0, 0.02, 0.035, 0.05};
    std::map<double, double> mean; // of the loss over what the crack takes, by energy
    for (const double energy : {5.0, 20.0, 60.0})
        for (const double place : kPlaces) {
            const FlyingBlock block(2);
            Simulation simulation =
                block.simulation(fracture_of(block.body, halves({place, 0, 0}, {1, 0.2, 0.1}), 1e4, energy));
            const Energy start = simulation.energy(kTwoThreads);
            const Momentum before = simulation.momentum();
            for (int frame = 0; frame < 40; ++frame) {
                ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
            }
            const FractureReport report = simulation.fracture(0);
            EXPECT_EQ(report.parts, 2u);
            EXPECT_NEAR(report.broken_area, report.crack_area, 1e-6);
            EXPECT_NEAR(report.dissipated, energy * report.crack_area, 0.01 * energy * report.crack_area);
            const double lost = start.total() - simulation.energy(kTwoThreads).total();
            EXPECT_NEAR(lost, energy * report.crack_area, 0.2 * energy * report.crack_area) << energy << " " << place;
            mean[energy] += lost / (energy * report.crack_area) / double(kPlaces.size());
            const Momentum after = simulation.momentum();
            const double size = before.linear.norm();
            EXPECT_LT((after.linear - before.linear).norm(), 1e-6 * size);
            EXPECT_LT((after.angular - before.angular).norm(), 1e-5 * size * 0.5);
        }
    for (const auto& [energy, share] : mean) EXPECT_NEAR(share, 1, 0.1) << energy;
}

std::vector<Vec3d> scattered_seeds(std::size_t count, double reach, std::uint64_t seed) {
    std::vector<Vec3d> seeds;
    for (std::size_t s = 0; s < count; ++s)
        seeds.push_back(reach * Vec3d(2 * random_unit(seed, 3 * s) - 1, 2 * random_unit(seed, 3 * s + 1) - 1,
                                      2 * random_unit(seed, 3 * s + 2) - 1));
    return seeds;
}

World ground_world() {
    World world;
    Obstacle ground;
    ground.shape = HalfSpace{{0, -0.6, 0}, {0, 1, 0}};
    world.obstacles.push_back(ground);
    return world;
}

TEST(Fracture, WhatIsNeverReachedChangesNothing) {
    const auto body = block(5, 5, 5, 0.1, brittle());
    const auto fracture = fracture_of(body, cells_of(scattered_seeds(6, 0.25, 1)), 1e9, 1e9);
    const auto last = [&](std::shared_ptr<const Fracture> breaks) {
        Simulation simulation =
            Simulation::create(ground_world(), {{.body = body, .velocity = {0, -2, 0}, .fracture = breaks}},
                               {.frames_per_second = 60, .mode = StepMode::explicit_steps}, kTwoThreads)
                .value();
        for (int frame = 0; frame < 30; ++frame) EXPECT_TRUE(simulation.advance(kTwoThreads).ok());
        return simulation.positions(0);
    };
    const Vectors with = last(fracture), without = last(nullptr);
    EXPECT_EQ(with.x, without.x);
    EXPECT_EQ(with.y, without.y);
    EXPECT_EQ(with.z, without.z);
}

TEST(Fracture, CopiesCoincideUntilTheirPiecesPart) {
    const FlyingBlock flying(2);
    const auto fracture = fracture_of(flying.body, cells_of({{-0.3, 0, 0}, {0, 0.02, 0}, {0.3, 0, 0.05}}), 1e9, 20);
    fracture->events.push_back({.time = 0.05, .pieces = {2}, .particles = {}});
    Simulation simulation = flying.simulation(fracture);
    std::vector<Vec3f> points;
    for (int n = 0; n < 60; ++n) points.push_back({-0.45f + 0.015f * float(n), 0.1f * std::sin(float(n)), 0.05f});
    std::vector<std::size_t> of_piece;
    for (Index piece = 0; piece < 3; ++piece)
        of_piece.push_back(simulation.attach(0, points, std::vector<Index>(points.size(), piece), kTwoThreads));
    const auto places = [&](std::size_t piece) {
        std::vector<Vec3f> moved(points.size());
        std::vector<Mat3f> gradients(points.size());
        simulation.attached(of_piece[piece], moved, gradients, kTwoThreads);
        for (const Mat3f& gradient : gradients)
            for (int column = 0; column < 3; ++column) moved.push_back(gradient.col(column));
        return moved;
    };
    for (int frame = 0; frame < 4; ++frame) ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
    EXPECT_EQ(simulation.fracture(0).parts, 1u);
    EXPECT_EQ(places(0), places(1));
    EXPECT_EQ(places(0), places(2));
    for (int frame = 0; frame < 12; ++frame) ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
    EXPECT_EQ(simulation.fracture(0).parts, 2u);
    EXPECT_NEAR(simulation.fracture(0).first, 0.05, 0.01);
    const std::vector<Vec3f> first = places(0), middle = places(1), last = places(2);
    for (int n = 0; n < 30; ++n) EXPECT_EQ(first[n], middle[n]) << n; // x up to 0: around the crack that holds
    for (int n = 25; n < 50; ++n) EXPECT_GT((last[n] - middle[n]).norm(), 0.01f) << n;
    for (const std::vector<Vec3f>* moved : {&first, &middle, &last})
        for (const Vec3f& p : *moved) EXPECT_LT(p.norm(), 3);
}

/// A cube thrown on the ground; it breaks.
Simulation thrown_cube(double young_modulus = 1e6, bool pieces_touch = true) {
    Material material = brittle();
    material.damping = 1;
    material.young_modulus = young_modulus;
    const auto body = block(6, 6, 6, 0.05, material);
    const auto fracture = fracture_of(body, cells_of(scattered_seeds(8, 0.15, 3)), 5 * std::sqrt(young_modulus), 1);
    fracture->material.scatter = 0.2;
    Actor actor{.body = body, .velocity = {0, -4, 0}, .spin = {1, 0, 2}, .fracture = fracture};
    actor.placement.rotate(Eigen::AngleAxisd(0.5, Vec3d(1, 0, 1).normalized()));
    return Simulation::create(
               ground_world(), {actor},
               {.frames_per_second = 60, .mode = StepMode::explicit_steps, .contacts_between_bodies = pieces_touch},
               kTwoThreads)
        .value();
}

TEST(Fracture, AThrownCubeBreaksAndItsPiecesLieOnTheGround) {
    Simulation simulation = thrown_cube();
    double least = 1e9, start = simulation.energy(kTwoThreads).total();
    for (int frame = 0; frame < 150; ++frame) {
        ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
        const double energy = simulation.energy(kTwoThreads).total();
        EXPECT_LT(energy, start + 2) << frame; // J, of 216 that it has at first
        start = std::min(start, energy);
        for (std::size_t i = 0; i < simulation.positions(0).size(); ++i)
            least = std::min(least, double(simulation.positions(0)[i].y()));
    }
    EXPECT_GT(simulation.fracture(0).parts, 3u);
    EXPECT_GT(least, -0.63);                              // the ground is at -0.6
    EXPECT_LT(simulation.energy(kTwoThreads).kinetic, 4); // of 216 J
}

/// A crack leaves cells that are hardly filled; their light corners must not set the pace.
TEST(Fracture, PiecesMoveInHardlyShorterSteps) {
    Simulation simulation = thrown_cube();
    const unsigned unbroken = simulation.advance(kTwoThreads).value().substeps;
    unsigned substeps = 0;
    for (int frame = 1; frame < 60; ++frame) {
        const FrameReport report = simulation.advance(kTwoThreads).value();
        if (frame >= 20) substeps += report.substeps;
    }
    EXPECT_GT(simulation.fracture(0).parts, 3u);
    EXPECT_LT(substeps, 2 * 40 * unbroken);
}

/// Copies of 0.001 of a cell were crushed by the recoil, and resisted that so stiffly that a frame took 699 substeps.
TEST(Fracture, ASliverBesideACrackDoesNotSetThePace) {
    const FlyingBlock block(30);
    Simulation simulation = block.simulation(fracture_of(block.body, sliced_beside_cells(), 2e5, 20));
    const unsigned unbroken = simulation.advance(kTwoThreads).value().substeps;
    for (int frame = 1; frame < 20; ++frame)
        EXPECT_LT(simulation.advance(kTwoThreads).value().substeps, 4 * unbroken) << frame;
    EXPECT_EQ(simulation.fracture(0).parts, 2u);
}

TEST(Fracture, SavedInTheMiddleOfABreak) {
    Simulation first = thrown_cube();
    std::string middle;
    std::size_t broken_parts = 0;
    for (int frame = 0; frame < 24; ++frame) {
        ASSERT_TRUE(first.advance(kTwoThreads).ok());
        if (first.fracture(0).broken_area > 0 && middle.empty()) {
            middle = first.save();
            broken_parts = first.fracture(0).parts;
        }
    }
    ASSERT_FALSE(middle.empty());
    Simulation second = thrown_cube();
    ASSERT_TRUE(second.restore(middle).ok());
    EXPECT_EQ(second.fracture(0).parts, broken_parts);
    EXPECT_EQ(second.save(), middle);
    while (second.frame() < first.frame()) ASSERT_TRUE(second.advance(RunContext(1)).ok()); // another number of threads
    EXPECT_EQ(second.save(), first.save());
    EXPECT_EQ(second.positions(0).x, first.positions(0).x);
}

TEST(Fracture, GoesOnTheSameAfterGoingBackBeforeTheBreak) {
    Simulation thrown = thrown_cube(1e5); // soft: vibrations are damped a little
    const std::string start = thrown.save();
    const auto end = [&] {
        while (thrown.frame() < 12) EXPECT_TRUE(thrown.advance(kTwoThreads).ok());
        return thrown.save();
    };
    const std::string first = end();
    EXPECT_GT(thrown.fracture(0).broken_area, 0);
    ASSERT_TRUE(thrown.restore(start).ok());
    EXPECT_EQ(end(), first);
}

TEST(Fracture, AHandPullsAPieceOff) {
    Material material = brittle();
    material.damping = 5;
    const auto body = block(10, 3, 3, 0.1, material);
    const auto fracture = fracture_of(body, halves({0.2, 0, 0}, {1, 0, 0}), 5e3, 2);
    World world = empty_world();
    Pin pin;
    for (std::size_t i = 0; i < body->rest.size(); ++i)
        if (body->rest[i].x() < -0.49f) pin.particles.push_back(Index(i));
    world.pins.push_back(pin);
    Hand hand;
    hand.point = {0.5f, 0, 0};
    hand.target.times = {0, 1};
    hand.target.values = {{0.5, 0, 0}, {1.5, 0.2, 0}};
    world.hands.push_back(hand);
    Simulation simulation =
        Simulation::create(world, {{.body = body, .fracture = fracture}}, {.frames_per_second = 60}, kTwoThreads)
            .value();
    const std::size_t tip = simulation.attach(0, std::vector<Vec3f>{{0.5f, 0, 0}, {-0.4f, 0, 0}}, kTwoThreads);
    for (int frame = 0; frame < 120; ++frame) ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
    EXPECT_EQ(simulation.fracture(0).parts, 2u);
    std::vector<Vec3f> points(2);
    simulation.attached(tip, points, {}, kTwoThreads);
    EXPECT_NEAR(points[0].x(), 1.5f, 0.05f);
    EXPECT_NEAR(points[1].x(), -0.4f, 0.01f);
}

/// Pa: what a plate of 1 m x 2 m with an edge crack of 0.3 m carries, pulled at its ends, turned about the lattice.
double notched_strength(double spacing, double degrees, double offset, double energy) {
    const double thickness = spacing, angle = degrees * std::numbers::pi / 180;
    const Vec3d along(std::cos(angle), std::sin(angle), 0), across(-std::sin(angle), std::cos(angle), 0);
    Mesh mesh = make_box({0, 0, 0}, {2, 1, thickness});
    for (Vec3f& p : mesh.positions)
        p = (double(p.x()) * along + double(p.y()) * across + Vec3d(0, 0, double(p.z()))).cast<float>();
    Material material = brittle();
    material.damping = 10;
    BodyOptions options;
    options.cells.spacing = spacing;
    const auto body = std::make_shared<const Body>(make_body(mesh, material, options, kTwoThreads).value());
    const auto fracture = fracture_of(body, halves(offset * spacing * along, along), 1e9, energy);
    FractureEvent notch;
    World world = empty_world();
    world.pins.resize(2);
    for (Index i = 0; i < body->rest.size(); ++i) {
        const Vec3d p = body->rest[i].cast<double>();
        if (p.dot(across) <= -0.2) notch.particles.push_back(i);
        for (int side = 0; side < 2; ++side)
            if ((side ? 1 : -1) * p.dot(along) > 1 - 0.5 * spacing) world.pins[side].particles.push_back(i);
    }
    fracture->events.push_back(notch);
    const double speed = 0.01; // m/s
    for (int side = 0; side < 2; ++side) {
        world.pins[side].motion.move.times = {0, 100};
        world.pins[side].motion.move.values = {Vec3d::Zero(), (side ? 50 : -50) * speed * along};
    }
    Simulation simulation = Simulation::create(world, {{.body = body, .fracture = fracture}},
                                               {.frames_per_second = 100,
                                                .mode = StepMode::explicit_steps,
                                                .contacts_between_bodies = false,
                                                .contacts_within_bodies = false},
                                               kTwoThreads)
                                .value();
    double most = 0;
    while (simulation.fracture(0).parts == 1 && simulation.time() < 4) {
        EXPECT_TRUE(simulation.advance(kTwoThreads).ok());
        if (simulation.time() > 0.2)
            most = std::max(most, 2 * simulation.energy(kTwoThreads).elastic / (speed * simulation.time() * thickness));
    }
    EXPECT_EQ(simulation.fracture(0).parts, 2u);
    return most;
}

/// m: how deep the notch is on a straight lattice: half a spacing beyond the last corner whose link it cuts.
double notch_depth(double spacing) { return (std::floor(0.3 / spacing + 1e-9) + 0.5) * spacing; }

/// What an edge crack of this depth makes of the load on a plate of 1 m: stress intensity over stress [Tada 2000].
double intensity(double depth) {
    const double x = depth;
    return std::sqrt(std::numbers::pi * depth) *
           (1.12 - 0.231 * x + 10.55 * x * x - 21.72 * x * x * x + 30.39 * x * x * x * x);
}

TEST(Fracture, ANotchedPlateBreaksAtTheSameLoadOnFinerLattices) {
    std::vector<double> loads, intensities;
    for (const double spacing : {1.0 / 8, 1.0 / 16, 1.0 / 32, 1.0 / 64}) {
        loads.push_back(notched_strength(spacing, 0, 0.5, 10));
        intensities.push_back(loads.back() * intensity(notch_depth(spacing))); // lattices cut notches of other depths
    }
    const auto spread = [](const std::vector<double>& of) { // about the middle
        const auto [least, most] = std::ranges::minmax(of);
        return (most - least) / (most + least);
    };
    EXPECT_LT(spread(loads), 0.15);
    EXPECT_LT(spread(intensities), 0.15);
}

TEST(Fracture, ANotchedPlateBreaksAtTheSameLoadOnTurnedLattices) {
    for (const double spacing : {1.0 / 16, 1.0 / 32}) {
        const double straight = notched_strength(spacing, 0, 0.3, 10);
        for (const double degrees : {15.0, 30.0, 45.0})
            EXPECT_NEAR(notched_strength(spacing, degrees, 0.3, 10), straight, 0.25 * straight) << degrees;
    }
}

TEST(Fracture, AHeldBodyIsHitByAnother) {
    Material material = brittle();
    material.damping = 0.5;
    const auto target = block(4, 10, 3, 0.1, material), ball = block(3, 3, 3, 0.1, material);
    const auto fracture = fracture_of(target, cells_of(scattered_seeds(9, 0.4, 5)), 4e3, 2);
    World world = empty_world();
    Pin pin;
    RegionForce force;
    force.force.constant = {0, 3, 0};
    for (Index i = 0; i < target->rest.size(); ++i) {
        if (target->rest[i].y() < -0.49f) pin.particles.push_back(i);
        if (target->rest[i].y() > 0.39f) force.particles.push_back(i);
    }
    world.pins.push_back(pin);
    world.forces.push_back(force);
    Actor flying{.body = ball, .velocity = {4, 0, 0}};
    flying.placement.translate(Vec3d(-0.6, 0.2, 0.02));
    Simulation simulation =
        Simulation::create(world, {{.body = target, .fracture = fracture}, flying},
                           {.frames_per_second = 60, .mode = StepMode::explicit_steps, .automatic_rigid = false},
                           kTwoThreads)
            .value();
    const double start = simulation.energy(kTwoThreads).total();
    for (int frame = 0; frame < 40; ++frame) ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
    EXPECT_GT(simulation.fracture(0).parts, 1u);
    EXPECT_GT(simulation.fracture(0).first, 0.01);
    const double work = 3 * 5; // J: of the force, over 5 m at most
    EXPECT_LT(simulation.energy(kTwoThreads).total(), start + work);
    double highest = 0;
    for (std::size_t i = 0; i < target->rest.size(); ++i) {
        ASSERT_TRUE(simulation.positions(0)[i].allFinite());
        highest = std::max(highest, double(simulation.positions(0)[i].norm()));
    }
    EXPECT_LT(highest, 5);
    EXPECT_GT(simulation.momentum().linear.x(), 0);
}

} // namespace
} // namespace filigree
