// Bodies of fem whose rest shape is stretched.
#include "filigree/core/math.h"
#include "filigree/physics/body/fields.h"
#include "filigree/physics/fem/cell_kernel.h"
#include "filigree/physics/fem/cell_lanes.h"

#include "physics/elastic_checks.h"
#include "physics/simulation_scenes.h"
#include "physics/test_bodies.h"

namespace filigree {
namespace {

using namespace simulation_scenes;

constexpr StepOptions kGrowing = {.mode = StepMode::explicit_steps, .automatic_rigid = false};

/// Each another symmetric matrix, with eigenvalues between 0.6 and 1.7.
RestStretch some_stretch(std::uint64_t i) {
    const auto unit = [&](std::uint64_t k) { return float(random_unit(11, 6 * i + k)); };
    return {0.9f + 0.5f * unit(0), 0.9f + 0.5f * unit(1), 0.9f + 0.5f * unit(2),
            0.1f * unit(3),        0.1f * unit(4),        -0.1f * unit(5)};
}

std::unique_ptr<Elasticity> grown(const Body& body, const RunContext& context) {
    auto elasticity = make_elasticity(body, context);
    std::vector<RestStretch> from, to;
    for (std::uint64_t i = 0; i < body.particle_count(); ++i) {
        from.push_back(some_stretch(i));
        to.push_back(some_stretch(i + 1000000));
    }
    elasticity->set_rest_stretches(from, to);
    elasticity->set_part_of_frame(0.4f);
    return elasticity;
}

Body uneven_body() { return make_body(checks::uneven_cells(0.1), material(MaterialModel::fem, 1e5)); }

TEST(GrownCells, ForcesAreTheEnergysDerivatives) {
    checks::expect_forces_from_energy(uneven_body(), grown);
    checks::expect_no_net_force(uneven_body(), grown);
    checks::expect_same_bytes_for_threads(uneven_body(), grown);
}

TEST(GrownCells, TheReportedRateIsABound) {
    checks::expect_rate_is_a_bound(make_body(box_cells(2, 2, 2, 0.1), material(MaterialModel::fem, 1e5)), grown);
}

TEST(GrownCells, AllWidthsGiveTheSameBytes) {
    const Body body = uneven_body();
    cell_kernel::Plan plan = cell_kernel::make_plan(body);
    const std::size_t count = body.cells.cells.size() + cell_kernel::kPadding;
    for (std::size_t k = 0; k < plan.growth.numbers.size(); ++k)
        for (std::size_t c = 0; c < count; ++c)
            plan.growth.numbers[k].push_back((k < 3 || k > 5 ? 0.8f : 0.0f) + 0.1f * float(random_unit(5, 8 * c + k)));
    plan.growth.pace.assign(count, 1.7f);
    InternalDamping damping;
    damping.velocities = checks::states(body)[0].positions;
    damping.seconds = 1e-3f;
    damping.stiffest = 1e9f;
    for (const InternalDamping* damped : {static_cast<const InternalDamping*>(nullptr), &std::as_const(damping)})
        for (const checks::Start& start : checks::states(body)) {
            std::optional<Vectors> first;
            for (const int lanes : cell_kernel::lane_counts()) {
                cell_kernel::Sums sums;
                Vectors forces(body.particle_count());
                cell_kernel::forces(plan, start.positions, forces, sums, lanes, RunContext(1), damped);
                if (!first) first = forces;
                EXPECT_TRUE(checks::same_bytes(*first, forces)) << start.name << lanes;
            }
        }
}

/// A body that lies as large as its rest shape is at rest; one that does not goes there.
TEST(GrownCells, TheRestShapeIsAtRest) {
    Mat3f stretch;
    stretch << 1.5f, 0.1f, 0, 0.1f, 0.8f, 0.2f, 0, 0.2f, 1.2f;
    const auto body = block(6, 4, 4, 0.05, material(MaterialModel::fem, 1e5));
    const std::vector<Mat3f> stretches(body->particle_count(), stretch);
    Follow free;
    free.frequency.assign(body->particle_count(), 0);
    free.damping = {20};
    free.leash = {std::numeric_limits<float>::infinity()};
    Vectors grown(body->particle_count());
    for (std::size_t i = 0; i < grown.size(); ++i) grown.set(i, stretch * body->rest[i]);
    for (const bool begins_grown : {true, false}) {
        Simulation one = simulation(free_space(), {actor(body)}, kGrowing);
        const Vectors& start = begins_grown ? grown : body->rest;
        const Vectors still(start.size());
        ASSERT_TRUE(one.set_positions(0, start).ok());
        ASSERT_TRUE(one.set_follow(0, free, start, still, begins_grown ? stretches : std::vector<Mat3f>()).ok());
        EXPECT_TRUE(!begins_grown || one.energy().elastic < 1e-6);
        for (int frame = 0; frame < (begins_grown ? 3 : 60); ++frame) {
            ASSERT_TRUE(one.set_targets(0, start, still, {}, stretches).ok());
            EXPECT_EQ(one.advance().value().unstable_substeps, 0u);
        }
        // All but a turn and a shift, which rigid motion is free to make.
        const Mat3f metric = stretch.transpose() * stretch;
        const std::size_t last = grown.size() - 1;
        const Vec3f side = body->rest[last] - body->rest[0], found = one.positions(0)[last] - one.positions(0)[0];
        EXPECT_NEAR(found.norm(), std::sqrt(side.dot(metric * side)), begins_grown ? 1e-5 : 2e-3);
        EXPECT_LT(one.energy().elastic, begins_grown ? 1e-5 : 1e-3);
        if (!begins_grown) continue;
        // Without stretches it is as it was again.
        ASSERT_TRUE(one.set_targets(0, start, still).ok());
        EXPECT_TRUE(one.advance().ok());
        EXPECT_GT(one.energy().elastic, 1);
    }
}

TEST(GrownCells, TheRestShapeIsSavedAndResumed) {
    const auto body = block(4, 4, 4, 0.05, material(MaterialModel::fem, 1e5));
    Follow follow;
    follow.frequency.assign(body->particle_count(), 3);
    const Vectors still(body->particle_count());
    const std::vector<Mat3f> large(body->particle_count(), 1.3f * Mat3f::Identity());
    const auto begun = [&] {
        Simulation one = simulation(free_space(), {actor(body)}, kGrowing);
        EXPECT_TRUE(one.set_follow(0, follow, body->rest, still, large).ok());
        return one;
    };
    const auto steps = [&](Simulation& one, int frames) {
        for (int frame = 0; frame < frames; ++frame) {
            EXPECT_TRUE(one.set_targets(0, body->rest, still, {}, large).ok());
            EXPECT_TRUE(one.advance().ok());
        }
    };
    Simulation whole = begun(), first = begun(), second = begun();
    steps(whole, 8);
    steps(first, 5);
    ASSERT_TRUE(second.restore(first.save()).ok());
    EXPECT_EQ(second.energy().elastic, first.energy().elastic);
    steps(second, 3);
    EXPECT_TRUE(checks::same_bytes(whole.positions(0), second.positions(0)));
}

TEST(GrownCells, WhatIsNoRestShapeIsRefused) {
    const auto sentence = [](const Status& status) { return status.ok() ? "" : status.error().message; };
    Material yields = material(MaterialModel::fem, 1e5);
    yields.yield_stress = 1e3;
    for (const Material& of : {material(MaterialModel::springs, 1e5), yields, material(MaterialModel::fem, 1e5)}) {
        const auto body = block(3, 3, 3, 0.1, of);
        Simulation one = simulation(free_space(), {actor(body)}, kGrowing);
        const Vectors still(body->particle_count());
        Follow follow;
        follow.frequency.assign(body->particle_count(), 1);
        ASSERT_TRUE(one.set_follow(0, follow, body->rest, still).ok());
        std::vector<Mat3f> stretches(body->particle_count(), Mat3f::Identity());
        const auto said = [&] { return sentence(one.set_targets(0, body->rest, still, {}, stretches)); };
        if (of.model != MaterialModel::fem || of.is_plastic()) {
            EXPECT_NE(said().find("grow"), std::string::npos);
            continue;
        }
        EXPECT_EQ(said(), "");
        stretches[3](0, 1) = 0.5f;
        EXPECT_NE(said().find("stretches[3] must be symmetric"), std::string::npos);
        stretches[3] = 9 * Mat3f::Identity();
        EXPECT_NE(said().find("eight times"), std::string::npos);
        stretches[3] = Vec3f(1, -1, -1).asDiagonal();
        EXPECT_NE(said().find("eight times"), std::string::npos);
        stretches.pop_back();
        EXPECT_NE(said().find("matrices"), std::string::npos);
    }
}

} // namespace
} // namespace filigree
