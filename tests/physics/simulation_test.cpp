#include "filigree/physics/simulation.h"

#include "filigree/core/random.h"
#include "filigree/mesh.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/material.h"
#include "physics/simulation_scenes.h"
#include "physics/test_bodies.h"
#include "threads.h"

#include <cmath>
#include <numbers>
#include <numeric>

namespace filigree {
namespace {

using namespace simulation_scenes;

class EachMaterial : public testing::TestWithParam<MaterialModel> {};

INSTANTIATE_TEST_SUITE_P(Simulation, EachMaterial, kModels, model_name);

// Half a second of fall is g t^2 / 2, to the rounding of positions, whatever the step.

TEST(Simulation, FreeFallIsExact) {
    for (const double rate : {10.0, 60.0, 1000.0}) {
        StepOptions options;
        options.mode = StepMode::explicit_steps;
        options.frames_per_second = rate;
        Simulation falling = simulation(World{}, {actor(box(4, 4, 4, 0.25, material(MaterialModel::fem)))}, options);
        const Vec3d start = centre_of_mass(falling);
        run(falling, std::size_t(0.5 * rate));
        EXPECT_NEAR(centre_of_mass(falling).y() - start.y(), -9.81 / 8, 2e-5) << rate << " frames a second";
        EXPECT_LT(shape_error(falling), 2e-5);
        EXPECT_NEAR(falling.momentum().linear.y() / 1000, -9.81 / 2, 1e-4);
    }
}

TEST_P(EachMaterial, KeepsMomentumWithExplicitSteps) {
    StepOptions options;
    options.mode = StepMode::explicit_steps;
    Actor spinning = actor(box(5, 5, 5, 0.2, material(GetParam())));
    spinning.velocity = {1, 2, 3};
    spinning.spin = {0, 5, 1};
    Simulation free = simulation(free_space(), {spinning}, options);
    const Momentum before = free.momentum();
    run(free, 600); // 10 s
    const Momentum after = free.momentum();
    EXPECT_LT((after.linear - before.linear).norm() / before.linear.norm(), 1e-6);
    // About the centre of mass; that of the world's origin grows with the distance, and so does its rounding.
    const Vec3d arm = centre_of_mass(free);
    const Vec3d spin_after = after.angular - arm.cross(after.linear);
    const Simulation start = simulation(free_space(), {spinning}, options);
    const Vec3d spin_before = before.angular - centre_of_mass(start).cross(before.linear);
    EXPECT_LT((spin_after - spin_before).norm() / spin_before.norm(),
              GetParam() == MaterialModel::springs ? 1e-5 : 2e-5);
}

TEST(Simulation, KeepsEnergyWithExplicitSteps) {
    StepOptions options;
    options.mode = StepMode::explicit_steps;
    Actor spinning = actor(box(5, 5, 5, 0.2, material(MaterialModel::fem)));
    spinning.spin = {0, 5, 1};
    Simulation free = simulation(free_space(), {spinning}, options);
    const double before = free.energy(RunContext(1)).total();
    run(free, 600);
    EXPECT_NEAR(free.energy(RunContext(1)).total() / before, 1, 0.01);
}

// On a mat much softer than itself a body behaves like a hard point: it leaves with e times its speed.

TEST(Simulation, BounceHeightFollowsRestitution) {
    for (const double restitution : {1.0, 0.7, 0.0}) {
        World world = with_ground(restitution);
        world.obstacles[0].stiffness = 0.03;
        const double drop = 0.5, size = 0.3;
        Simulation bouncing =
            simulation(world, {actor(box(3, 3, 3, 0.1, material(MaterialModel::fem, 1e6)), {0, drop, 0})},
                       {.mode = StepMode::explicit_steps});
        double highest = 0;
        bool bounced = false;
        for (int frame = 0; frame < 60; ++frame) {
            bounced = run(bouncing, 1).contacts > 0 || bounced;
            if (bounced) highest = std::max(highest, centre_of_mass(bouncing).y() - size / 2);
        }
        EXPECT_NEAR(highest, drop * restitution * restitution, 0.03 * drop) << restitution;
    }
}

// A soft body that bounces on a ground of restitution 1 turns its fall into swinging, and back; nothing is lost.

TEST(Simulation, BounceKeepsEnergy) {
    World world = with_ground(1);
    world.obstacles[0].friction = 0; // the foot widens as it lands, and would rub
    Simulation bouncing = simulation(world, {actor(box(5, 5, 5, 0.1, material(MaterialModel::fem, 1e5)), {0, 0.5, 0})},
                                     {.mode = StepMode::explicit_steps});
    const double before = bouncing.energy(RunContext(1)).total();
    const double below = 9.81 * 125 * 0.25; // what is left when it lies on the ground
    std::size_t contacts = 0;
    for (int frame = 0; frame < 120; ++frame) contacts += run(bouncing, 1).contacts;
    EXPECT_GT(contacts, 100u);
    for (int frame = 0; frame < 60 && run(bouncing, 1).contacts > 0;) ++frame;
    EXPECT_NEAR((bouncing.energy(RunContext(1)).total() - below) / (before - below), 1, 0.05);
}

TEST_P(EachMaterial, RestStaysAtRest) {
    StepOptions options;
    options.mode = StepMode::explicit_steps;
    Simulation resting = simulation(free_space(), {actor(box(3, 3, 3, 0.1, material(GetParam())))}, options);
    run(resting, 1000);
    EXPECT_LT(shape_error(resting), 3e-6);
    EXPECT_LT((centre_of_mass(resting) - Vec3d(0.15, 0.15, 0.15)).norm(), 1e-6);
}

// 100,000 frames, 28 minutes of it.

TEST(Simulation, RestStaysAtRestForLong) {
    StepOptions options;
    options.mode = StepMode::explicit_steps;
    World world;
    Material soft = material(MaterialModel::fem, 1e4);
    soft.damping = 1;
    const auto body = box(1, 2, 1, 0.2, soft);
    Pin pin;
    for (Index i = 0; i < body->particle_count(); ++i)
        if (body->rest.y[i] > 0.39f) pin.particles.push_back(i);
    world.pins.push_back(pin);
    Simulation hanging = simulation(world, {actor(body)}, options);
    run(hanging, 2000);
    const Vectors settled = hanging.positions(0);
    run(hanging, 98000);
    double moved = 0;
    for (std::size_t i = 0; i < settled.size(); ++i)
        moved = std::max(moved, double((settled[i] - hanging.positions(0)[i]).norm()));
    EXPECT_LT(moved, 2e-6);
}

TEST(Simulation, RestsOnTheGround) {
    Material soft = material(MaterialModel::fem);
    soft.damping = 1;
    Simulation resting = simulation(with_ground(), {actor(box(5, 5, 5, 0.2, soft), {0, 0.01, 0})});
    run(resting, 600);
    const Vectors settled = resting.positions(0);
    const FrameReport report = run(resting, 600);
    EXPECT_LT(report.deepest_contact, 0.02);
    EXPECT_GT(report.contacts, 50u);
    double moved = 0;
    for (std::size_t i = 0; i < settled.size(); ++i)
        moved = std::max(moved, double((settled[i] - resting.positions(0)[i]).norm()));
    EXPECT_LT(moved, 1e-4);
}

// A block on a slope of 30 degrees stays for a friction above tan 30 = 0.577 and slides at g (sin - mu cos) below.

TEST(Simulation, FrictionHoldsAndSlides) {
    for (const double friction : {0.7, 0.3}) {
        World world;
        Obstacle slope;
        const double angle = std::numbers::pi / 6;
        slope.shape = HalfSpace{Vec3d::Zero(), {std::sin(angle), std::cos(angle), 0}};
        slope.friction = friction;
        slope.restitution = 0;
        world.obstacles.push_back(slope);
        Material rubber = material(MaterialModel::fem, 1e6);
        rubber.internal_damping = 2e-3;
        Actor block = actor(box(6, 2, 6, 0.1, rubber));
        block.placement.linear() = Eigen::AngleAxisd(-angle, Vec3d::UnitZ()).toRotationMatrix();
        Simulation sliding = simulation(world, {block}, {.mode = StepMode::explicit_steps});
        run(sliding, 30); // half a second to settle
        const Vec3d before = centre_of_mass(sliding);
        run(sliding, 60);
        const double way = (centre_of_mass(sliding) - before).norm();
        const double acceleration = 9.81 * (std::sin(angle) - friction * std::cos(angle));
        if (friction == 0.7) {
            EXPECT_LT(way, 2e-3);
            continue;
        }
        EXPECT_NEAR(way, acceleration * (0.5 + 0.5), 0.1 * acceleration); // (1.5^2 - 0.5^2) / 2
    }
}

// First bending frequency of a clamped bar, 4 cells across: Euler and Bernoulli's less what shear and the bar's

// thickness take (Timoshenko), 0.56 (h / L^2) sqrt(E / (12 rho)) ...

TEST(Simulation, BarSwingsAtItsFrequency) {
    const double length = 1, height = 0.1, young = 1e7, density = 1000;
    Material rubber = material(MaterialModel::fem, young);
    const auto body = box(40, 4, 4, 0.025, rubber);
    World world = free_space();
    Pin pin;
    for (Index i = 0; i < body->particle_count(); ++i)
        if (body->rest.x[i] == 0) pin.particles.push_back(i);
    world.pins.push_back(pin);
    Simulation bar = simulation(world, {actor(body)}, {.frames_per_second = 240, .mode = StepMode::explicit_steps});
    Vectors bent = bar.positions(0), swing(bent.size());
    for (std::size_t i = 0; i < bent.size(); ++i) swing.y[i] = 0.05f * bent.x[i] * bent.x[i] * (3 - bent.x[i]) / 2;
    ASSERT_TRUE(bar.set_velocities(0, swing).ok());
    std::size_t tip = 0;
    for (std::size_t i = 0; i < bent.size(); ++i)
        if (bent.x[i] > 0.999f) tip = i;
    // Times when the tip passes its rest place upwards.
    std::vector<double> passes;
    double before = 0;
    for (int frame = 1; frame <= 960; ++frame) {
        run(bar, 1);
        const double now = double(bar.positions(0).y[tip] - bent.y[tip]);
        if (before < 0 && now >= 0) passes.push_back((frame - 1 + before / (before - now)) / 240);
        before = now;
    }
    ASSERT_GT(passes.size(), 4u);
    const double measured = double(passes.size() - 1) / (passes.back() - passes.front());
    const double slender = 1.8751 * 1.8751 / (2 * std::numbers::pi) *
                           std::sqrt(young * height * height / 12 / density) / (length * length);
    EXPECT_NEAR(measured / slender, 1, 0.03);
}

// A block that is sent along the ground stops after v^2 / (2 mu g), trembling or not.

TEST(Simulation, SlidingFollowsCoulomb) {
    for (const double restitution : {0.0, 0.5, 1.0})
        for (const double friction : {0.2, 0.5}) {
            World world = with_ground(restitution);
            world.obstacles[0].friction = friction;
            Actor block = actor(box(6, 2, 6, 0.1, material(MaterialModel::fem, 1e6)));
            block.velocity = {2, 0, 0};
            Simulation sliding = simulation(world, {block}, {.mode = StepMode::explicit_steps});
            const double from = centre_of_mass(sliding).x();
            run(sliding, 120);
            const double expected = 4 / (2 * friction * 9.81);
            EXPECT_NEAR(centre_of_mass(sliding).x() - from, expected, 0.06 * expected)
                << restitution << " " << friction;
        }
}

// Damping inside a body acts on what deforms it, not on how it turns.

TEST(Simulation, InternalDampingLetsBodiesSpin) {
    Material jelly = material(MaterialModel::fem, 1e6);
    jelly.internal_damping = 2e-3;
    Actor spinning = actor(box(4, 4, 4, 0.1, jelly));
    spinning.spin = {0, 20, 0};
    Simulation free = simulation(free_space(), {spinning}, {.mode = StepMode::explicit_steps});
    const double before = free.momentum().angular.y();
    run(free, 120);
    EXPECT_NEAR(free.momentum().angular.y() / before, 1, 1e-3);
}

// Hands and ground share particles of one color among many points: each sees its own moves alone.

// A surface that halves the outer cells: they are whole with half the mass and half the stiffness, which bends a little

/// How far the tip of a bar along x sinks when its other end is held.
double sag(std::shared_ptr<const Body> body, const Vec3d& tip) {
    World world;
    world.gravity = {0, -0.5, 0};
    Pin pin;
    std::size_t nearest = 0;
    const auto distance = [&](std::size_t i) { return (body->rest[i].cast<double>() - tip).norm(); };
    for (Index i = 0; i < body->particle_count(); ++i) {
        if (body->rest.x[i] == 0) pin.particles.push_back(i);
        if (distance(i) < distance(nearest)) nearest = i;
    }
    world.pins.push_back(pin);
    Simulation bar = simulation(world, {actor(body)});
    run(bar, 240);
    return double(body->rest.y[nearest] - bar.positions(0).y[nearest]);
}

// less than the true bar. Eight spacings across.

TEST(Simulation, HalfFullCellsAreALittleStiff) {
    Material rubber = material(MaterialModel::fem, 1e6);
    rubber.damping = 8;
    const double h = 0.025;
    Cells cut = box_cells(32, 9, 9, h, {0, -h / 2, -h / 2});
    for (std::size_t c = 0; c < cut.cells.size(); ++c)
        for (const int axis : {1, 2})
            if (cut.cells[c][axis] == 0 || cut.cells[c][axis] == 8) cut.fraction[c] *= 0.5f;
    const auto exact = box(32, 8, 8, h, rubber);
    const auto halved = std::make_shared<Body>(make_body(std::move(cut), rubber));
    const double ratio = sag(halved, {0.8, 0.1, 0.1}) / sag(exact, {0.8, 0.1, 0.1});
    RecordProperty("ratio", std::to_string(ratio));
    EXPECT_GT(ratio, 0.93);
    EXPECT_LT(ratio, 1.0);
}

// A bar pulled at its ends: stress over strain is E, and it thins by nu.

TEST(Simulation, StretchGivesModulusAndPoissonRatio) {
    Material rubber = material(MaterialModel::fem, 1e5);
    rubber.damping = 5;
    const auto body = box(16, 4, 4, 0.05, rubber);
    World world = free_space();
    const double area = 0.04, strain = 0.01, force = 1e5 * area * strain;
    for (const double end : {0.0, 0.8}) {
        RegionForce pull;
        for (Index i = 0; i < body->particle_count(); ++i)
            if (std::abs(double(body->rest.x[i]) - end) < 1e-6) pull.particles.push_back(i);
        pull.force.constant = Vec3d(end == 0 ? -force : force, 0, 0);
        world.forces.push_back(pull);
    }
    Simulation bar = simulation(world, {actor(body)});
    run(bar, 300);
    const Vectors &rest = body->rest, &now = bar.positions(0);
    double length = 0, width = 0, rest_length = 0, rest_width = 0;
    const auto between = [&](const Vec3f& from, const Vec3f& to, double& rest_distance, double& distance) {
        std::size_t a = 0, b = 0;
        for (std::size_t i = 0; i < rest.size(); ++i) {
            if ((rest[i] - from).norm() < 1e-4f) a = i;
            if ((rest[i] - to).norm() < 1e-4f) b = i;
        }
        rest_distance = double((rest[a] - rest[b]).norm());
        distance = double((now[a] - now[b]).norm());
    };
    between({0.2f, 0.1f, 0.1f}, {0.6f, 0.1f, 0.1f}, rest_length, length);
    between({0.4f, 0.0f, 0.1f}, {0.4f, 0.2f, 0.1f}, rest_width, width);
    const double measured = length / rest_length - 1;
    EXPECT_NEAR(measured / strain, 1, 0.03);
    EXPECT_NEAR((1 - width / rest_width) / measured, 0.3, 0.015);
}

TEST(Simulation, TwoBodiesKeepTheirMomentumInACollision) {
    StepOptions options;
    options.mode = StepMode::explicit_steps;
    const auto body = box(4, 4, 4, 0.1, material(MaterialModel::fem, 1e5));
    Actor left = actor(body), right = actor(body, {0.8, 0.1, 0.05});
    left.velocity = {2, 0, 0};
    Simulation colliding = simulation(free_space(), {left, right}, options);
    const Momentum before = colliding.momentum();
    std::size_t most_contacts = 0;
    for (int frame = 0; frame < 60; ++frame) most_contacts = std::max(most_contacts, run(colliding, 1).contacts);
    EXPECT_GT(most_contacts, 10u);
    const Momentum after = colliding.momentum();
    const double allowed = 1e-5;
    EXPECT_LT((after.linear - before.linear).norm() / before.linear.norm(), allowed);
    // They pushed each other and did not pass through.
    EXPECT_GT(centre_of_mass(colliding, 1).x(), centre_of_mass(colliding, 0).x() + 0.35);
    EXPECT_GT(centre_of_mass(colliding, 1).x(), 1.2);
}

TEST(Simulation, PinsFollowTheirKeys) {
    const auto body = box(4, 4, 4, 0.1, material(MaterialModel::fem));
    World world;
    Pin pin;
    for (Index i = 0; i < body->particle_count(); ++i)
        if (body->rest.x[i] == 0) pin.particles.push_back(i);
    pin.motion.move.times = {0, 1};
    pin.motion.move.values = {Vec3d::Zero(), Vec3d(0, 0.5, 0)};
    world.pins.push_back(pin);
    Simulation moved = simulation(world, {actor(body)});
    run(moved, 120);
    for (const Index particle : pin.particles)
        EXPECT_NEAR(moved.positions(0).y[particle], body->rest.y[particle] + 0.5f, 1e-6);
    EXPECT_GT(centre_of_mass(moved).y(), 0.3);
}

/// A floor that jumps down by 0.1 m and up again takes no speed with it: whoever stands on it falls, and no more.
TEST(Simulation, AJumpOfAnObstacleIsNoBlow) {
    World world = with_ground(0);
    world.obstacles[0].motion.move = {{0, 0.5, 0.5, 1}, {}, Vec3d::Zero()};
    for (const double down : {0.0, 0.0, -0.02, -0.02}) world.obstacles[0].motion.move.values.emplace_back(0, down, 0);
    Simulation stands = simulation(world, {actor(box(4, 4, 4, 0.1, material(MaterialModel::fem)), {0, 0, 0})}, {});
    double fastest = 0;
    for (int frame = 0; frame < 60; ++frame) {
        run(stands, 1);
        for (std::size_t i = 0; i < stands.velocities(0).size(); ++i)
            fastest = std::max(fastest, double(stands.velocities(0)[i].norm()));
    }
    EXPECT_LT(fastest, 2);
}

TEST(Simulation, AJumpOfAPinIsNoBlowOfItsOwn) {
    const auto body = box(2, 2, 2, 0.1, material(MaterialModel::fem));
    World world = free_space();
    Pin pin;
    for (Index i = 0; i < body->particle_count(); ++i) pin.particles.push_back(i);
    pin.motion.move = {{0, 0.1, 0.1, 1}, {Vec3d::Zero(), Vec3d::Zero(), Vec3d(1, 0, 0), Vec3d(1, 0, 0)}, Vec3d::Zero()};
    world.pins.push_back(pin);
    Simulation held = simulation(world, {actor(body)});
    for (int frame = 0; frame < 10; ++frame) {
        run(held, 1);
        EXPECT_EQ(held.energy(kOneThread).kinetic, 0);
    }
}

/// A force that names no particles is the whole body's, whatever that is of.
TEST(Simulation, AForceWithoutParticlesPushesTheWholeBody) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree,
                                      MaterialModel::rigid, MaterialModel::mpm}) {
        World world = free_space();
        world.forces.push_back({.body = 0, .particles = {}, .force = {{}, {}, Vec3d(10, 0, 0)}});
        Simulation pushed =
            simulation(world, {actor(box(3, 3, 3, 0.1, material(model)))}, {.mode = StepMode::explicit_steps});
        run(pushed, 20);
        EXPECT_NEAR(pushed.momentum().linear.x(), 10 * pushed.time(), 0.01 * 10 * pushed.time()) << int(model);
    }
}

TEST(Simulation, AHandPulls) {
    Material soft = material(MaterialModel::fem);
    soft.damping = 2;
    const auto body = box(4, 4, 4, 0.1, soft);
    Simulation pulled = simulation(free_space(), {actor(body)});
    Hand hand;
    hand.point = {0.4f, 0.2f, 0.2f};
    hand.target.times = {0, 0.5}; // at once would turn the body inside out, and then to any side
    hand.target.values = {hand.point.cast<double>(), Vec3d(1.4, 0.2, 0.2)};
    ASSERT_TRUE(pulled.set_hands({hand}, RunContext(1)).ok());
    run(pulled, 300);
    EXPECT_NEAR(centre_of_mass(pulled).x(), 1.2, 0.05);
    ASSERT_TRUE(pulled.set_hands({}, RunContext(1)).ok());
    run(pulled, 10);
}

// A force on each particle moves the body as the sum of forces does, in either way of stepping, until it is taken away.

TEST(Simulation, ForcesOnParticlesPush) {
    const auto body = box(3, 3, 3, 0.1, material(MaterialModel::fem, 1e6));
    Simulation pushed = simulation(free_space(), {actor(body)}, {.mode = StepMode::explicit_steps});
    Vectors forces(body->particle_count());
    for (std::size_t i = 0; i < forces.size(); ++i) forces.set(i, Vec3f(2 * body->mass[i], 0, 0));
    ASSERT_TRUE(pushed.set_forces(0, forces).ok());
    run(pushed, 30); // half a second of 2 m/s^2
    const double mass = std::accumulate(body->mass.begin(), body->mass.end(), 0.0);
    EXPECT_NEAR(pushed.momentum().linear.x() / mass, 1, 0.01);
    ASSERT_TRUE(pushed.set_forces(0, {}).ok());
    run(pushed, 30);
    EXPECT_NEAR(pushed.momentum().linear.x() / mass, 1, 0.01);
    EXPECT_EQ(pushed.set_forces(0, Vectors(3)).error().code, ErrorCode::usage);
    EXPECT_EQ(pushed.set_forces(1, {}).error().code, ErrorCode::usage);
    forces.set(5, Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
    EXPECT_EQ(pushed.set_forces(0, forces).error().code, ErrorCode::usage);
}

TEST(Simulation, WindPushes) {
    World world = free_space();
    world.air_density = 1.2;
    world.wind.constant = Vec3d(10, 0, 0);
    Simulation blown = simulation(world, {actor(box(4, 4, 4, 0.1, material(MaterialModel::fem, 1e6)))});
    run(blown, 6); // a tenth of a second
    // rho v^2 / 2 on 0.16 m^2, and suction is not modelled; 64 kg.
    const double expected = 0.5 * 1.2 * 100 * 0.16 / 64 * 0.1;
    EXPECT_NEAR(blown.momentum().linear.x() / 64, expected, 0.05 * expected);
}

// Attached points follow an affine motion of the particles exactly, with its gradient.

TEST_P(EachMaterial, AttachedPointsFollowAffineMotions) {
    const auto body = box(5, 5, 5, 0.2, material(GetParam()));
    Simulation moved = simulation(free_space(), {actor(body)});
    std::vector<Vec3f> points;
    for (int k = 0; k < 50; ++k)
        points.emplace_back(float(random_unit(1, 3 * k)), float(random_unit(1, 3 * k + 1)),
                            float(random_unit(1, 3 * k + 2)));
    const std::size_t attachment = moved.attach(0, points, RunContext(1));
    Mat3f turn = Eigen::AngleAxisf(1.0f, Vec3f(1, 2, 3).normalized()).toRotationMatrix();
    turn.col(0) *= 1.5f;
    Vectors positions = moved.positions(0);
    for (std::size_t i = 0; i < positions.size(); ++i) positions.set(i, turn * positions[i] + Vec3f(1, 2, 3));
    ASSERT_TRUE(moved.set_positions(0, positions).ok());
    std::vector<Vec3f> now(points.size());
    std::vector<Mat3f> gradients(points.size());
    moved.attached(attachment, now, gradients, RunContext(1));
    for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_LT((now[i] - (turn * points[i] + Vec3f(1, 2, 3))).norm(), 5e-6f);
        EXPECT_LT((gradients[i] - turn).norm(), 2e-5f);
    }
}

// Starts that would break most solvers come back to the shape they had.

// Huge starts, steps, stiffnesses and mass ratios: finite, whatever else.

// Pressed to a twentieth of its height: cells turn inside out for seconds. Without damping there it gains 40 %.

TEST(Simulation, RefusesWhatIsNotThere) {
    const auto body = box(2, 2, 2, 0.1, material(MaterialModel::fem));
    const RunContext context(1);
    EXPECT_FALSE(Simulation::create({}, {actor(body)}, {.frames_per_second = 0}, context).ok());
    EXPECT_FALSE(Simulation::create({}, {actor(body)}, {.most_substeps = 0}, context).ok());

    Simulation one = simulation(free_space(), {actor(body)});
    EXPECT_EQ(one.set_positions(1, one.positions(0)).error().code, ErrorCode::usage);
    EXPECT_EQ(one.set_positions(0, Vectors(26)).error().code, ErrorCode::usage);
    EXPECT_EQ(one.set_velocities(0, Vectors(28)).error().code, ErrorCode::usage);
    Hand hand;
    ASSERT_TRUE(one.set_hands({hand}, context).ok());
    hand.body = 1;
    EXPECT_EQ(one.set_hands({hand}, context).error().code, ErrorCode::usage);
    EXPECT_EQ(one.world().hands.size(), 1u); // the old one stays
    hand.body = 0;
    hand.target.times = {1, 0};
    hand.target.values = {Vec3d::Zero(), Vec3d::Zero()};
    EXPECT_NE(one.set_hands({hand}, context).error().message.find("hands[0].target.times"), std::string::npos);
}

// A piston that strikes in the middle of a frame and is back at its end has gone nowhere, and yet it was there.

TEST(Simulation, ObstaclesThatGoAndReturnWithinAFrameAreFelt) {
    World world = free_space();
    Obstacle piston;
    piston.shape = Cuboid{{-0.5, 0.15, 0.15}, {0.6, 1, 1}}; // 0.2 m from the body
    piston.motion.move.times = {0, 0.05, 0.1};
    piston.motion.move.values = {Vec3d::Zero(), Vec3d(0.25, 0, 0), Vec3d::Zero()};
    world.obstacles.push_back(piston);
    Simulation struck = simulation(world, {actor(box(3, 3, 3, 0.1, material(MaterialModel::fem)))},
                                   {.frames_per_second = 10, .mode = StepMode::explicit_steps});
    run(struck, 1);
    EXPECT_GT(struck.momentum().linear.x(), 1);
}

TEST(Simulation, WhatIsLostInAFrameIsHeldAndSaid) {
    Simulation broken = simulation(free_space(), {actor(box(2, 2, 2, 0.1, material(MaterialModel::fem)))});
    Vectors velocities = broken.velocities(0);
    velocities.x[13] = std::numeric_limits<float>::infinity();
    ASSERT_TRUE(broken.set_velocities(0, velocities).ok());
    EXPECT_GT(run(broken, 1).clamped_particles, 0u);
    EXPECT_TRUE(all_finite(broken.positions(0)));
}

TEST(Simulation, ThrownClayStaysTogether) {
    const auto named = std::find_if(named_materials().begin(), named_materials().end(),
                                    [](const NamedMaterial& each) { return each.name == "clay"; });
    ASSERT_NE(named, named_materials().end());
    const Mesh mesh = make_wavy_sphere({.resolution = 24, .frequency = 2, .amplitude = 0.15});
    Result<Body> ball = make_body(mesh, named->material, {.scale = 0.7, .cells = {.count = 2000}}, kAllThreads);
    ASSERT_TRUE(ball) << ball.error().message;
    Actor thrown = actor(std::make_shared<Body>(*std::move(ball)), {0, 0.5, 0});
    thrown.velocity = {0, -6, 0};
    Simulation clay = simulation(with_ground(), {thrown});
    run(clay, 24);
    // Without damping, or where what was crushed pushes for ever, bits fly two metres high.
    for (std::size_t i = 0; i < clay.body(0).particle_count(); ++i) {
        const Vec3f at = clay.positions(0)[i];
        ASSERT_LT(at.y(), 0.6f);
        ASSERT_LT(std::hypot(at.x(), at.z()), 0.7f);
    }
}

// Const functions share no scratch.

} // namespace
} // namespace filigree
