// Starts, steps and loads that would break most solvers.
#include "filigree/physics/simulation.h"

#include "filigree/core/random.h"
#include "filigree/mesh.h"
#include "physics/simulation_scenes.h"
#include "physics/test_bodies.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace filigree {
namespace {

using namespace simulation_scenes;

class HardStart : public testing::TestWithParam<MaterialModel> {};
INSTANTIATE_TEST_SUITE_P(Simulation, HardStart, kModels, model_name);

class BadStart : public testing::TestWithParam<std::tuple<MaterialModel, const char*>> {};

INSTANTIATE_TEST_SUITE_P(Simulation, BadStart,
                         testing::Combine(kModels,
                                          testing::Values("inverted", "plane", "line", "point", "shrunk", "random")),
                         [](const auto& start) {
                             return std::string(std::array{"fem", "springs",
                                                           "meshfree"}[std::size_t(std::get<0>(start.param))]) +
                                    "_" + std::get<1>(start.param);
                         });

TEST_P(BadStart, ComesBackToRest) {
    const auto [model, start] = GetParam();
    Material rubber = material(model, 1e5);
    rubber.damping = 2;
    const auto body = box(4, 4, 4, 0.25, rubber);
    Simulation wild = simulation(free_space(), {actor(body)});
    Vectors positions = wild.positions(0);
    const std::string kind = start;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        Vec3f p = positions[i];
        if (kind == "inverted") p.y() = -p.y();
        if (kind == "plane") p.y() = 0;
        if (kind == "line") p.y() = p.z() = 0;
        if (kind == "point") p.setZero();
        if (kind == "shrunk") p *= 1e-3f;
        if (kind == "random")
            p = Vec3f(float(random_unit(7, 3 * i)), float(random_unit(7, 3 * i + 1)), float(random_unit(7, 3 * i + 2)));
        positions.set(i, p);
    }
    ASSERT_TRUE(wild.set_positions(0, positions).ok());
    FrameReport report;
    const auto is_at_rest = [&] { return shape_error(wild) < 5e-3 && report.least_volume_ratio > 0.98f; };
    for (int second = 0; second < 40 && (second < 2 || !is_at_rest()); ++second) report = run(wild, 60);
    ASSERT_TRUE(all_finite(wild.positions(0)));
    EXPECT_LT(shape_error(wild), 5e-3);
    EXPECT_GT(report.least_volume_ratio, 0.98f);
}

TEST_P(HardStart, NeverNotFinite) {
    for (const double scale : {10.0, 1000.0})
        for (const double rate : {10.0, 60.0, 1000.0})
            for (const double young : {1e2, 1e5, 1e9}) {
                const auto body = box(3, 3, 3, 0.25, material(GetParam(), young));
                Simulation wild = simulation(with_ground(), {actor(body, {0, 0.2, 0})},
                                             {.frames_per_second = rate, .mode = StepMode::explicit_steps});
                Vectors positions = wild.positions(0);
                for (std::size_t i = 0; i < positions.size(); ++i) positions.set(i, float(scale) * positions[i]);
                ASSERT_TRUE(wild.set_positions(0, positions).ok());
                const FrameReport first = run(wild, 1);
                if (scale == 1000) {
                    EXPECT_GT(first.clamped_particles, 0u);
                }
                run(wild, 30);
                EXPECT_TRUE(all_finite(wild.positions(0))) << scale << " " << rate << " " << young;
                double furthest = 0;
                for (std::size_t i = 0; i < positions.size(); ++i)
                    furthest = std::max(furthest, double(wild.positions(0)[i].norm()));
                EXPECT_LT(furthest, 2e3 * scale) << scale << " " << rate << " " << young;
            }
}

// Larger bodies than BadStart's: what looks for contacts must bear them too.
TEST_P(HardStart, ParticlesWithoutNumbersAreLeftToTheStepper) {
    for (const std::size_t bodies : {1, 2}) {
        const auto body = box(10, 10, 10, 0.1, material(GetParam(), 1e5));
        Actor beside = actor(body);
        beside.placement = Eigen::Translation3d(0, 1.05, 0);
        std::vector<Actor> actors = {actor(body)};
        if (bodies == 2) actors.push_back(beside);
        for (const std::size_t lost : {std::size_t{0}, std::size_t{555}}) {
            Simulation wild =
                Simulation::create(free_space(), actors, {.mode = StepMode::explicit_steps}, RunContext(1)).value();
            Vectors positions = wild.positions(0);
            positions.x[lost] = std::numeric_limits<float>::quiet_NaN();
            ASSERT_TRUE(wild.set_positions(0, positions).ok());
            const auto report = wild.advance(RunContext(1));
            EXPECT_TRUE(!report || all_finite(wild.positions(0)));
        }
    }
}

TEST(HardStarts, ACrushedMeshfreeBodyDoesNotMeetAllOfItself) {
    for (const bool is_mixed : {false, true}) {
        const auto body = box(12, 12, 12, 0.1, material(MaterialModel::meshfree, 1e5));
        Simulation wild =
            Simulation::create(free_space(), {actor(body)}, {.mode = StepMode::explicit_steps}, RunContext(1)).value();
        Vectors positions = wild.positions(0);
        for (std::size_t i = 0; i < positions.size(); ++i)
            positions.set(i, is_mixed ? Vec3f(float(random_unit(7, 3 * i)), float(random_unit(7, 3 * i + 1)),
                                              float(random_unit(7, 3 * i + 2)))
                                      : Vec3f(0.01f * positions[i]));
        ASSERT_TRUE(wild.set_positions(0, positions).ok());
        ASSERT_TRUE(wild.advance(RunContext(1)).ok()); // in a second; with all pairs of points in minutes
        EXPECT_TRUE(all_finite(wild.positions(0)));
    }
}

// Far too stiff for the particles it has: 60,000 substeps a frame would be stable.
TEST(HardStarts, StepsThatAreLongerThanIsStableAreTold) {
    Material stiff = material(MaterialModel::fem, 1e9);
    stiff.density = 1e-3;
    const auto soft = box(2, 2, 2, 0.25, material(MaterialModel::fem, 1e5));
    const auto hard = box(2, 2, 2, 0.25, stiff);
    const StepOptions options{.frames_per_second = 60, .automatic_rigid = false};
    Simulation slow = simulation(free_space(), {actor(soft), actor(hard, {2, 0, 0})}, options);
    const FrameReport told = run(slow, 1);
    EXPECT_GT(told.unstable_substeps, 0u); // until it is lost, and held where it was
    EXPECT_EQ(told.unstable_body, 1u);
    Simulation quick = simulation(free_space(), {actor(soft), actor(hard, {2, 0, 0})},
                                  {.frames_per_second = 2000, .automatic_rigid = false});
    const FrameReport fine = run(quick, 1);
    EXPECT_LT(fine.substeps, kMostSubsteps);
    EXPECT_EQ(fine.unstable_substeps, 0u);
}

// One crushed cell is stiff. Damping it for as long as the rest would ask for steps as short as its squared frequency
// says, and to damp the rest for less time would not be what was asked for.
TEST(HardStarts, ACrushedCellDoesNotShortenStepsByItsDamping) {
    Material jelly = material(MaterialModel::fem, 1e7);
    const auto substeps = [&](double seconds, bool is_crushed) {
        jelly.internal_damping = seconds;
        Simulation one = simulation(free_space(), {actor(box(6, 6, 6, 0.1, jelly))}, {.automatic_rigid = false});
        Vectors positions = one.positions(0);
        for (std::size_t i = 0; i < positions.size() && is_crushed; ++i) // all corners at x = 0
            if (positions.x[i] < 0.05f) positions.x[i] = 0.09f;
        EXPECT_TRUE(one.set_positions(0, positions).ok());
        return run(one, 1).substeps;
    };
    const double elastic = double(substeps(0, true)) / substeps(0, false);
    const double damped = double(substeps(5e-4, true)) / substeps(5e-4, false);
    EXPECT_GT(elastic, 3);
    EXPECT_LT(damped, 1.5 * elastic); // and not its square
}

// A slow swing loses what Kelvin and Voigt say: the amplitude by exp(-omega^2 tau t / 2).
TEST(HardStarts, AHeavyInternalDampingDampsSlowModesAsAsked) {
    const double length = 1, young = 1e5, tau = 0.02;
    Material jelly = material(MaterialModel::fem, young);
    jelly.poisson_ratio = 0;
    jelly.internal_damping = tau;
    Simulation bar = simulation(free_space(), {actor(box(20, 2, 2, length / 20, jelly))}, {.automatic_rigid = false});
    const double omega = std::numbers::pi / length * std::sqrt(young / jelly.density);
    Vectors swing = bar.velocities(0);
    for (std::size_t i = 0; i < swing.size(); ++i)
        swing.x[i] = float(0.01 * std::cos(std::numbers::pi * double(bar.body(0).rest.x[i]) / length));
    ASSERT_TRUE(bar.set_velocities(0, swing).ok());
    const auto energy = [&] { return bar.energy(RunContext(1)).total(); };
    const double start = energy();
    // Over whole swings energy falls by exp(-omega^2 tau t); omega tau is 0.63, so a mode swings a little slower.
    const double zeta = 0.5 * omega * tau, period = 2 * std::numbers::pi / (omega * std::sqrt(1 - zeta * zeta));
    const auto frames = std::size_t(std::lround(60 * period));
    run(bar, frames);
    const double expected = -omega * omega * tau * double(frames) / 60;
    EXPECT_NEAR(std::log(energy() / start), expected, 0.05 * std::abs(expected));
}

TEST(HardStarts, AHeavyBodyOnALightOne) {
    Material light = material(MaterialModel::fem, 1e5), heavy = light;
    light.density = 100;
    heavy.density = 1e5;
    light.damping = heavy.damping = 1;
    Simulation stacked = simulation(
        with_ground(), {actor(box(4, 4, 4, 0.25, light)), actor(box(2, 2, 2, 0.25, heavy), {0.25, 1.05, 0.25})});
    run(stacked, 120);
    EXPECT_TRUE(all_finite(stacked.positions(0)));
    EXPECT_TRUE(all_finite(stacked.positions(1)));
}

TEST(HardStarts, ACrushedBodyGainsNoEnergy) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree}) {
        Simulation crushed = simulation(free_space(), {actor(box(4, 4, 4, 0.05, material(model, 5e4)))},
                                        {.mode = StepMode::explicit_steps});
        Vectors flat = crushed.positions(0);
        for (std::size_t i = 0; i < flat.size(); ++i) flat.y[i] *= 0.05f;
        ASSERT_TRUE(crushed.set_positions(0, flat).ok());
        const RunContext context(1);
        const double before = crushed.energy(context).total();
        for (int frame = 0; frame < 240; ++frame) {
            const FrameReport report = crushed.advance(context).value();
            if (frame == 0) {
                EXPECT_LT(report.least_volume_ratio, 0.1f);
            }
            ASSERT_LT(crushed.energy(context).total(), 1.01 * before) << int(model) << ", frame " << frame;
        }
    }
}

// A few crushed cells are little of all that moves.

TEST(HardStarts, ALargeBodyWithACrushedCornerGainsNoEnergy) {
    Simulation crushed = simulation(free_space(), {actor(box(16, 16, 16, 0.05, material(MaterialModel::fem, 5e4)))},
                                    {.mode = StepMode::explicit_steps});
    Vectors positions = crushed.positions(0);
    const float corner = 0.2f;
    for (std::size_t i = 0; i < positions.size(); ++i)
        if (positions[i].maxCoeff() < corner) positions.y[i] = corner + 0.05f * (positions.y[i] - corner);
    ASSERT_TRUE(crushed.set_positions(0, positions).ok());
    const RunContext context(1);
    const double before = crushed.energy(context).total();
    for (int frame = 0; frame < 240; ++frame) {
        ASSERT_TRUE(crushed.advance(context).ok());
        ASSERT_LT(crushed.energy(context).total(), 1.01 * before) << "frame " << frame;
    }
}

// The energy of Verlet steps swings by itself: what is all speed at first has up to half as much again later.

TEST(HardStarts, ANoisyBodyGainsNoEnergy) {
    const auto signed_unit = [](std::size_t number) { return 2 * float(random_unit(1, number)) - 1; };
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree})
        for (const std::size_t cells : {2, 4})
            for (const float part : {0.1f, 0.3f}) {
                const Material of = material(model, 1e6);
                Simulation noisy = simulation(free_space(), {actor(box(cells, cells, cells, 0.05, of))},
                                              {.mode = StepMode::explicit_steps});
                Vectors velocities = noisy.velocities(0);
                const float most = part * std::sqrt(float(of.young_modulus / of.density));
                for (std::size_t i = 0; i < velocities.size(); ++i)
                    velocities.set(i, most * Vec3f(signed_unit(3 * i), signed_unit(3 * i + 1), signed_unit(3 * i + 2)));
                ASSERT_TRUE(noisy.set_velocities(0, velocities).ok());
                const RunContext context(1);
                const double before = noisy.energy(context).total();
                double highest = 0;
                for (int frame = 0; frame < 120; ++frame) {
                    ASSERT_TRUE(noisy.advance(context).ok());
                    highest = std::max(highest, noisy.energy(context).total());
                }
                EXPECT_LT(highest, 1.5 * before) << int(model) << ", " << cells << " cells, " << part;
            }
}

TEST(HardStarts, ABodyThatHitsFasterThanItsWavesIsStoppedByTheGround) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree}) {
        Material soft = material(model, 3e4);
        soft.damping = 1;
        const double spacing = 0.1;
        Actor falling = actor(box(4, 4, 4, spacing, soft), {0, 0.2, 0});
        falling.velocity = {0, -2.5 * std::sqrt(soft.young_modulus / soft.density), 0};
        Simulation hit = simulation(with_ground(0), {falling}, {.mode = StepMode::explicit_steps});
        const Vectors& positions = hit.positions(0);
        for (int frame = 0; frame < 300; ++frame) {
            ASSERT_TRUE(hit.advance(RunContext(1)).ok());
            const float lowest = *std::min_element(positions.y.begin(), positions.y.begin() + long(positions.size()));
            ASSERT_GT(lowest, -1.5 * spacing) << int(model) << ", frame " << frame;
            ASSERT_GT(centre_of_mass(hit).y(), -0.75 * spacing) << int(model);
        }
        if (model == MaterialModel::meshfree) continue; // stays crumpled
        EXPECT_GT(centre_of_mass(hit).y(), 1.5 * spacing) << int(model);
        EXPECT_LT(shape_error(hit), 0.5 * spacing) << int(model);
    }
}

// Cells that the surface only passes through have corners far outside of it.

TEST(HardStarts, ABodyDeepInSoftGroundKeepsTheCellsUnderIt) {
    const Mesh sphere = make_wavy_sphere({.resolution = 40, .amplitude = 0});
    Material heavy = material(MaterialModel::fem, 1e7);
    heavy.density = 4500;
    heavy.damping = 5;
    const auto body =
        std::make_shared<Body>(make_body(sphere, heavy, {.cells = {.count = 1000}}, RunContext(2)).value());
    World world = with_ground(0);
    world.obstacles[0].stiffness = 0.003;
    Simulation resting = simulation(world, {actor(body, {0, 0.5, 0})});
    run(resting, 120);
    const FrameReport last = run(resting, 1);
    const double depth = last.deepest_contact / body->spacing();
    EXPECT_GT(depth, 0.5);
    EXPECT_LT(depth, 0.77);
    EXPECT_GT(last.least_volume_ratio, 0.8f);
}

TEST(HardStarts, ReportsSayWhichBodyIsCrushedMost) {
    const auto cube = box(3, 3, 3, 0.1, material(MaterialModel::fem));
    Simulation both = simulation(free_space(), {actor(cube), actor(cube, {1, 0, 0})});
    Vectors flat = both.positions(1);
    for (std::size_t i = 0; i < flat.size(); ++i) flat.y[i] *= 0.08f;
    ASSERT_TRUE(both.set_positions(1, flat).ok());
    const FrameReport report = run(both, 1);
    EXPECT_LT(report.least_volume_ratio, 0.1f);
    EXPECT_EQ(report.most_crushed, 1u);
}

} // namespace
} // namespace filigree
