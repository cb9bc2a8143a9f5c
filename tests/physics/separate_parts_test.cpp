// Parts of a mesh that are nearer to each other than a cell, kept apart.
#include "elastic_checks.h"
#include "filigree/mesh.h"
#include "filigree/physics/body.h"
#include "joined_fingers.h"
#include "simulation_scenes.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <set>

namespace filigree::separate_parts_test {
namespace {

using joined_fingers::fork;

constexpr double kSpacing = 0.061;

Body fingers(double gap, bool separate, BodyReport* report = nullptr, double spacing = kSpacing) {
    Material material;
    material.damping = 2;
    BodyOptions options{.cells = {.spacing = spacing}, .separate = separate};
    return make_body(fork(gap), material, options, kTwoThreads, report).value();
}

/// The particles that carry points of one finger, away from the hand.
std::set<Index> carriers(const Embedding& points, bool upper, double gap) {
    std::set<Index> found;
    for (std::size_t p = 0; p < points.size(); ++p) {
        if (points.rest[p].x() < 0.3f || (double(points.rest[p].y()) > 0.2 + gap / 2) != upper) continue;
        found.insert(points.particles.begin() + points.offsets[p], points.particles.begin() + points.offsets[p + 1]);
    }
    return found;
}

TEST(SeparateParts, FingersShareNoParticle) {
    for (const double gap : {0.03, 0.07})
        for (const double spacing : {0.061, 0.1}) {
            BodyReport report, joined;
            const Body body = fingers(gap, true, &report, spacing), glued = fingers(gap, false, &joined, spacing);
            if (joined.joined.corners == 0) continue;
            EXPECT_EQ(report.joined.corners, 0U) << gap << " " << spacing << report.warning;
            EXPECT_GT(report.separated_corners, 20U) << gap << " " << spacing;
            EXPECT_EQ(report.warning.find("move as one"), std::string::npos) << report.warning;
            EXPECT_NEAR(report.mass, joined.mass, 2e-3 * joined.mass);
            const std::set<Index> lower = carriers(body.surface.points, false, gap);
            for (const Index particle : carriers(body.surface.points, true, gap))
                EXPECT_FALSE(lower.contains(particle)) << gap << " " << spacing << " at " << body.rest[particle].x();
            const std::set<Index> both = carriers(glued.surface.points, false, gap);
            std::size_t shared = 0;
            for (const Index particle : carriers(glued.surface.points, true, gap)) shared += both.contains(particle);
            EXPECT_GT(shared, 0U);
        }
}

TEST(SeparateParts, ForcesAreTheEnergysAndTheSameForAnyThreads) {
    const Body body = fingers(0.03, true);
    checks::expect_no_net_force(body, make_elasticity);
    checks::expect_forces_from_energy(body, make_elasticity);
    checks::expect_same_bytes_for_threads(body, make_elasticity);
    Body yields = body;
    yields.material.yield_stress = 1e4;
    checks::expect_forces_from_energy(yields, make_elasticity);
}

/// Held at the hand; the lower finger's end is pushed by so many newtons.
struct Pushed {
    Simulation simulation;
    std::size_t lower, upper; ///< attachments at the fingers' ends

    Pushed(const std::shared_ptr<const Body>& body, const Vec3d& newtons, double gap)
        : simulation(begin(body, newtons)) {
        const std::vector<Vec3f> low = {{1.9f, 0.1f, 0.1f}}, high = {{1.9f, float(0.3 + gap), 0.1f}};
        lower = simulation.attach(0, low, kTwoThreads);
        upper = simulation.attach(0, high, kTwoThreads);
    }
    Vec3f way(std::size_t attached) const {
        std::vector<Vec3f> now(1);
        simulation.attached(attached, now, {}, kTwoThreads);
        return now[0];
    }

private:
    static Simulation begin(const std::shared_ptr<const Body>& body, const Vec3d& newtons) {
        World world = simulation_scenes::free_space();
        Pin pin;
        RegionForce force;
        for (Index i = 0; i < body->rest.size(); ++i) {
            if (body->rest[i].x() < -0.2f) pin.particles.push_back(i);
            if (body->rest[i].x() > 1.7f && body->rest[i].y() < 0.1f) force.particles.push_back(i);
        }
        force.force.constant = newtons;
        world.pins.push_back(pin);
        world.forces.push_back(force);
        return Simulation::create(world, {{.body = body}}, {}, kTwoThreads).value();
    }
};

TEST(SeparateParts, OneFingerMovesAlone) {
    constexpr double kGap = 0.03;
    for (const bool separate : {false, true}) {
        const auto body = std::make_shared<const Body>(fingers(kGap, separate));
        Pushed pushed(body, {0, -6, 0}, kGap);
        const Vec3f low = pushed.way(pushed.lower), high = pushed.way(pushed.upper);
        simulation_scenes::run(pushed.simulation, 60, 2);
        const float lower = (pushed.way(pushed.lower) - low).y(), upper = (pushed.way(pushed.upper) - high).y();
        EXPECT_LT(lower, -0.025f) << separate;
        if (separate)
            EXPECT_GT(upper, 0.2f * lower) << "through the hand alone";
        else
            EXPECT_LT(upper, 0.8f * lower) << "glued";
    }
}

TEST(SeparateParts, NothingMovesThatNothingMoves) {
    for (const double gap : {0.02, 0.05}) {
        const auto body = std::make_shared<const Body>(fingers(gap, true));
        Simulation simulation = simulation_scenes::simulation(simulation_scenes::free_space(), {{.body = body}});
        const FrameReport report = simulation_scenes::run(simulation, 10, 2);
        EXPECT_EQ(report.contacts, 0U) << gap;
        float most = 0;
        for (std::size_t i = 0; i < body->rest.size(); ++i)
            most = std::max(most, (simulation.positions(0)[i] - body->rest[i]).norm());
        EXPECT_LT(most, 1e-5f) << gap;
    }
}

TEST(SeparateParts, FingersTouchEachOther) {
    constexpr double kGap = 0.03;
    const auto body = std::make_shared<const Body>(fingers(kGap, true));
    Pushed pushed(body, {0, 10, 0}, kGap);
    const Vec3f low = pushed.way(pushed.lower), high = pushed.way(pushed.upper);
    const FrameReport report = simulation_scenes::run(pushed.simulation, 60, 2);
    const float lower = (pushed.way(pushed.lower) - low).y(), upper = (pushed.way(pushed.upper) - high).y();
    EXPECT_GT(upper, 0.3f * lower);
    EXPECT_LT(lower - upper, float(kGap + 0.5 * kSpacing)) << "the one would be in the other";
    EXPECT_GT(report.contacts, 0U);
}

TEST(SeparateParts, SameBytesForThreadsAndAfterARestore) {
    const auto body = std::make_shared<const Body>(fingers(0.03, true));
    EXPECT_EQ(body->cells.cell_corners,
              make_body(fork(0.03), body->material, {.cells = {.spacing = kSpacing}, .separate = true}, kOneThread)
                  .value()
                  .cells.cell_corners);
    const auto begin = [&](unsigned threads) {
        Actor falls = simulation_scenes::actor(body, {0, 0.05, 0});
        return simulation_scenes::simulation(simulation_scenes::with_ground(), {falls}, {}, threads);
    };
    Simulation one = begin(1), two = begin(2), resumed = begin(2);
    simulation_scenes::run(one, 16, 1);
    simulation_scenes::run(two, 8, 2);
    ASSERT_TRUE(resumed.restore(two.save()).ok());
    simulation_scenes::run(resumed, 8, 2);
    EXPECT_TRUE(one.save() == resumed.save());
}

TEST(SeparateParts, WhatIsWholeStaysAsItIs) {
    for (const Mesh& mesh : {make_wavy_cube({.resolution = 16}), make_torus({.resolution = 24, .thickness = 0.2})}) {
        BodyReport report;
        const Body plain = make_body(mesh, {}, {.cells = {.count = 500}}, kTwoThreads).value();
        const Body asked =
            make_body(mesh, {}, {.cells = {.count = 500}, .separate = true}, kTwoThreads, &report).value();
        EXPECT_EQ(report.separated_corners, 0U);
        EXPECT_EQ(plain.cells.cell_corners, asked.cells.cell_corners);
        EXPECT_EQ(plain.mass, asked.mass);
        EXPECT_FALSE(asked.cells.is_parted());
    }
}

TEST(SeparateParts, SaysWhereItSeesNoGaps) {
    BodyReport report;
    BodyOptions options{.cells = {.count = 200}, .separate = true};
    ASSERT_TRUE(make_body(make_wavy_plane({.resolution = 8}), {}, options, kTwoThreads, &report));
    EXPECT_NE(report.warning.find("The mesh is open"), std::string::npos) << report.warning;
}

TEST(SeparateParts, RefusesWhatItCannotDo) {
    Material springs;
    springs.model = MaterialModel::springs;
    BodyOptions options;
    options.separate = true;
    EXPECT_EQ(make_body(fork(0.03), springs, options, kTwoThreads).error().code, ErrorCode::usage);
    const Partition halves{2, [](const Vec3d& p) { return p.x() < 1 ? Index(0) : Index(1); }};
    const auto broken = break_body(std::make_shared<const Body>(fingers(0.03, true)), halves, kTwoThreads);
    ASSERT_FALSE(broken);
    EXPECT_EQ(broken.error().code, ErrorCode::unsuitable);
}

} // namespace
} // namespace filigree::separate_parts_test
