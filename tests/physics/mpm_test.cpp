// Bodies of the model mpm against what theory says of them.
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/material.h"
#include "filigree/physics/simulation.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <numbers>

namespace filigree::mpm_test {
namespace {

Material elastic(double young = 1e5) {
    Material material;
    material.model = MaterialModel::mpm;
    material.density = 1000;
    material.young_modulus = young;
    material.poisson_ratio = 0.3;
    material.damping = 0;
    return material;
}

std::shared_ptr<const Body> box(std::size_t nx, std::size_t ny, std::size_t nz, double spacing,
                                const Material& material) {
    return std::make_shared<const Body>(bare_body(box_cells(nx, ny, nz, spacing), material));
}

Eigen::Isometry3d at(double x, double y, double z) {
    Eigen::Isometry3d placement = Eigen::Isometry3d::Identity();
    placement.translation() = Vec3d(x, y, z);
    return placement;
}

Simulation begin(World world, std::vector<Actor> actors, double frames_per_second = 60) {
    StepOptions options;
    options.frames_per_second = frames_per_second;
    return Simulation::create(std::move(world), std::move(actors), options, kAllThreads).value();
}

void run(Simulation& simulation, int frames) {
    for (int f = 0; f < frames; ++f) simulation.advance(kAllThreads).value();
}

World no_gravity() {
    World world;
    world.gravity.setZero();
    return world;
}

World on_ground(double friction = 0.5) {
    World world;
    Obstacle ground;
    ground.shape = HalfSpace{};
    ground.friction = friction;
    world.obstacles.push_back(ground);
    return world;
}

Vec3d middle(const Simulation& simulation, std::size_t body) {
    const Vectors& positions = simulation.positions(body);
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < positions.size(); ++i) sum += positions[i].cast<double>();
    return sum / double(positions.size());
}

Vec3d extent(const Simulation& simulation, std::size_t body) {
    Box box;
    for (std::size_t i = 0; i < simulation.positions(body).size(); ++i)
        box.extend(simulation.positions(body)[i].cast<double>());
    return box.size();
}

} // namespace

TEST(Mpm, FallsAsTheoryHasIt) {
    Simulation simulation = begin(World{}, {{box(6, 6, 6, 0.02, elastic())}});
    const Vec3d start = middle(simulation, 0);
    run(simulation, 30);
    const Vec3d way = middle(simulation, 0) - start;
    EXPECT_NEAR(way.y(), -0.5 * 9.81 * 0.25, 0.01 * 1.23); // first order in the step
    EXPECT_NEAR(std::hypot(way.x(), way.z()), 0, 1e-5);
    EXPECT_NEAR(simulation.velocities(0)[0].y(), -9.81 * 0.5, 1e-3);
}

TEST(Mpm, KeepsMomentumAndGainsNoEnergy) {
    Actor actor{box(12, 6, 6, 0.02, elastic()), at(0, 0, 0)};
    actor.velocity = {1, 0.5, 0};
    actor.spin = {0, 2, 3};
    Simulation simulation = begin(no_gravity(), {actor});
    const Momentum before = simulation.momentum();
    const double energy = simulation.energy(kAllThreads).total();
    run(simulation, 30);
    const Momentum after = simulation.momentum();
    EXPECT_LT((after.linear - before.linear).norm(), 1e-5 * before.linear.norm());
    EXPECT_LT((after.angular - before.angular).norm(), 2e-3 * before.angular.norm());
    EXPECT_LT(simulation.energy(kAllThreads).total(), 1.01 * energy);
}

/// A bar held at its left end sags: Euler and Bernoulli's beam, and Timoshenko's shear.
TEST(Mpm, BarSagsAsTheoryHasIt) {
    const double h = 0.02, length = 30 * h, height = 8 * h, young = 1e6;
    Material material = elastic(young);
    material.damping = 12; // about critical
    const auto body = box(34, 8, 8, h, material);
    World world = no_gravity();
    world.gravity = {0, -2, 0};
    Pin pin;
    for (Index p = 0; p < body->particle_count(); ++p)
        if (body->rest[p].x() < 4 * h) pin.particles.push_back(p);
    world.pins.push_back(pin);
    Simulation simulation = begin(std::move(world), {{body}}, 60);
    const std::size_t tip = body->particle_count() - 1;
    const double rest = double(simulation.positions(0)[tip].y());
    run(simulation, 90);
    const double sag = rest - double(simulation.positions(0)[tip].y());
    const double load = 1000 * 2 * height, inertia = height * height * height / 12; // by the bar's width
    const double shear = young / 2.6 * height * 5 / 6;
    const double theory = load * std::pow(length, 4) / (8 * young * inertia) + load * length * length / (2 * shear);
    EXPECT_NEAR(sag, theory, 0.15 * theory); // the clamp, a cell wide, gives way
    run(simulation, 30);
    EXPECT_NEAR(rest - double(simulation.positions(0)[tip].y()), sag, 0.02 * sag) << "it has come to rest";
}

/// A bar held at its left end that hangs out and swings: Euler and Bernoulli's beam.
TEST(Mpm, BarSwingsAtItsFirstFrequency) {
    const double h = 0.02, length = 30 * h, height = 8 * h, young = 1e6;
    const auto body = box(34, 8, 8, h, elastic(young));
    World world = no_gravity();
    Pin pin;
    for (Index p = 0; p < body->particle_count(); ++p)
        if (body->rest[p].x() < 4 * h) pin.particles.push_back(p);
    world.pins.push_back(pin);
    Simulation simulation = begin(std::move(world), {{body}}, 200);
    Vectors velocities = simulation.velocities(0);
    for (std::size_t i = 0; i < velocities.size(); ++i) {
        const double along = std::max(0.0, (double(body->rest[i].x()) - 4 * h) / length);
        velocities.set(i, Vec3f(0, float(0.1 * along * along), 0));
    }
    ASSERT_TRUE(simulation.set_velocities(0, velocities).ok());
    const std::size_t tip = body->particle_count() - 1;
    const float rest = simulation.positions(0)[tip].y();
    // Half a period: from the start until the tip is back.
    double half = 0;
    float before = 0;
    for (int f = 0; f < 200 && half == 0; ++f) {
        run(simulation, 1);
        const float now = simulation.positions(0)[tip].y() - rest;
        if (before > 0 && now <= 0) half = simulation.time() - double(now / (now - before)) / 200;
        before = now;
    }
    const double inertia = height * height / 12, speed = std::sqrt(young / 1000);
    const double theory = 1.875 * 1.875 / (2 * std::numbers::pi) * speed * std::sqrt(inertia) / (length * length);
    EXPECT_NEAR(0.5 / half, theory, 0.12 * theory);
}

TEST(Mpm, ColdCubesPartAgain) {
    const auto cube = box(8, 8, 8, 0.02, elastic(3e4)), base = box(16, 8, 16, 0.02, elastic(3e4));
    Simulation simulation = begin(on_ground(), {{base, at(0, 0.001, 0)}, {cube, at(0.09, 0.18, 0.07)}});
    run(simulation, 60);
    EXPECT_GT(middle(simulation, 1).y() - middle(simulation, 0).y(), 0.11) << "one does not sink into the other";
    EXPECT_NEAR(extent(simulation, 0).y(), 0.14, 0.03);
    // Gravity turned round lifts the upper one off.
    const double before = middle(simulation, 1).y();
    Vectors up = simulation.velocities(1);
    for (std::size_t i = 0; i < up.size(); ++i) up.set(i, {0, 3, 0});
    ASSERT_TRUE(simulation.set_velocities(1, up).ok());
    run(simulation, 12);
    EXPECT_GT(middle(simulation, 1).y() - before, 0.25);
    EXPECT_LT(extent(simulation, 1).y(), 0.16) << "nothing stuck to the other";
    EXPECT_LT(middle(simulation, 0).y(), 0.12);
}

TEST(Mpm, FrictionHoldsAndSlides) {
    const auto block = box(10, 4, 10, 0.02, elastic(2e5));
    for (const double degrees : {15.0, 35.0}) {
        World world = on_ground(0.5);
        const double angle = degrees * std::numbers::pi / 180;
        world.gravity = 9.81 * Vec3d(std::sin(angle), -std::cos(angle), 0);
        Simulation simulation = begin(std::move(world), {{block, at(0, 0.0, 0)}});
        run(simulation, 20);
        const double from = middle(simulation, 0).x();
        const double speed = double(simulation.velocities(0)[0].x());
        run(simulation, 30);
        const double way = middle(simulation, 0).x() - from;
        if (degrees < 26) {
            EXPECT_LT(way, 2e-3);
        } else {
            const double pull = 9.81 * (std::sin(angle) - 0.5 * std::cos(angle));
            EXPECT_NEAR(way, speed * 0.5 + 0.5 * pull * 0.25, 0.1 * way);
        }
    }
}

namespace {

/// Ice as it were, that conducts quickly.
Material melting() {
    Material material = elastic(1e5);
    material.melting_from = material.melting_to = 300;
    material.temperature = 290;
    material.specific_heat = 1000;
    material.latent_heat = 20'000;
    material.conductivity = 1e-3;
    material.viscosity = 5;
    return material;
}

} // namespace

TEST(Mpm, HeatStaysInAClosedBox) {
    Material hot = melting();
    hot.temperature = 330;
    const auto cold_box = box(6, 6, 6, 0.02, melting()), hot_box = box(6, 6, 6, 0.02, hot);
    Simulation simulation = begin(no_gravity(), {{cold_box}, {hot_box, at(0.12, 0, 0)}});
    const double before = simulation.heat();
    run(simulation, 60);
    EXPECT_NEAR(simulation.heat() / before, 1, 1e-4);
}

/// Stefan's problem of one phase: a bar at its melting point, warmed at one end.
TEST(Mpm, FrontOfMeltFollowsStefan) {
    const double h = 0.005;
    Material material = melting();
    material.temperature = 299.999;
    const auto bar = box(40, 4, 4, h, material);
    World world = no_gravity();
    Obstacle plate;
    plate.shape = HalfSpace{Vec3d(0, 0, 0), Vec3d(1, 0, 0)};
    plate.temperature.constant = 340;
    plate.heat_transfer = 1e7;
    world.obstacles.push_back(plate);
    Simulation simulation = begin(std::move(world), {{bar}});
    const double stefan = 1000 * 40 / 20'000.0; // c dT / L
    double root = 0.5;                          // of root e^(root^2) erf(root) = stefan / sqrt(pi)
    for (int k = 0; k < 60; ++k) {
        const auto f = [&](double x) {
            return x * std::exp(x * x) * std::erf(x) - stefan / std::sqrt(std::numbers::pi);
        };
        root -= f(root) / ((f(root + 1e-6) - f(root - 1e-6)) / 2e-6);
    }
    const auto front = [&] {
        double molten = 0;
        const MatterParticles matter = simulation.matter(0);
        for (const float liquid : matter.liquid) molten += double(liquid);
        return molten / 16 * h;
    };
    for (const int second : {3, 5}) {
        run(simulation, second == 3 ? 180 : 120);
        const double theory = 2 * root * std::sqrt(1e-3 * second);
        EXPECT_NEAR(front(), theory, 0.03 * theory);
    }
}

TEST(Mpm, MeltsFlowsAndFreezesInTheShapeItHas) {
    Material wax = melting();
    wax.melting_to = 305;
    wax.temperature = 299;
    wax.viscosity = 2;
    wax.conductivity = 5e-3;
    World world = on_ground();
    world.air_heat_transfer = 15'000;
    world.air_temperature = {{0, 2, 2.001}, {420, 420, 60}, 0};
    Simulation simulation = begin(std::move(world), {{box(8, 8, 8, 0.02, wax)}});
    const std::size_t points =
        simulation.attach(0, std::vector<Vec3f>{{0.08f, 0.08f, 0.08f}, {0.01f, 0.15f, 0.01f}}, kAllThreads);
    std::vector<float> renewal(2);
    simulation.renewal(points, renewal);
    EXPECT_EQ(renewal, std::vector<float>({0, 0}));
    run(simulation, 120);
    EXPECT_LT(extent(simulation, 0).y(), 0.11) << "it has flowed";
    simulation.renewal(points, renewal);
    EXPECT_GT(renewal[1], 0.9f);
    run(simulation, 240);
    const MatterParticles frozen = simulation.matter(0);
    for (const float liquid : frozen.liquid) EXPECT_EQ(liquid, 0);
    const Vec3d shape = extent(simulation, 0);
    run(simulation, 60);
    EXPECT_NEAR((extent(simulation, 0) - shape).norm(), 0, 0.003) << "it keeps the shape it froze in";
    double volume = 0;
    for (const float v : frozen.volumes) volume += double(v);
    EXPECT_NEAR(volume, 0.16 * 0.16 * 0.16, 0.03 * 0.16 * 0.16 * 0.16);
}

/// Melt that spreads is no more than it was: its surface is made to enclose these volumes.
TEST(Mpm, TheVolumeOfMeltStays) {
    Material wax = std::ranges::find(named_materials(), "wax", &NamedMaterial::name)->material;
    wax.temperature = 345;
    wax.viscosity = 5;
    Simulation simulation = begin(on_ground(), {{.body = box(10, 10, 10, 0.02, wax), .placement = at(0, 0.1, 0)}}, 30);
    for (int k = 0; k < 3; ++k) {
        run(simulation, 10);
        double volume = 0;
        for (const float v : simulation.matter(0).volumes) volume += double(v);
        EXPECT_NEAR(volume, 0.008, 0.01 * 0.008) << k;
    }
}

/// A third body near two, in the same block of nodes, does not change how these rub.
TEST(Mpm, FrictionOfAPairHoldsBesideAThirdBody) {
    const auto slab = box(16, 4, 8, 0.02, elastic(2e5)), block = box(6, 4, 4, 0.02, elastic(2e5));
    const auto way = [&](bool beside) {
        World world = on_ground(5);
        world.gravity = {4, -9.81, 0};
        world.body_pairs.push_back({0, 1, {.friction = 0}});
        world.body_friction = 5;
        std::vector<Actor> actors = {{slab, at(0, 0, 0)}, {block, at(0.02, 0.081, 0.0)}};
        if (beside) actors.push_back({box(6, 6, 3, 0.02, elastic(2e5)), at(0.02, 0, 0.205)});
        Simulation simulation = begin(std::move(world), std::move(actors));
        const double from = middle(simulation, 1).x();
        run(simulation, 18);
        return middle(simulation, 1).x() - from;
    };
    const double alone = way(false);
    EXPECT_GT(alone, 0.1) << "it slides without friction";
    EXPECT_NEAR(way(true), alone, 0.1 * alone);
}

TEST(Mpm, SameBytesForAnyNumberOfThreadsAndWhenResumed) {
    Material wax = melting();
    wax.temperature = 299;
    World world = on_ground();
    world.air_heat_transfer = 2000;
    world.air_temperature.constant = 350;
    const auto cube = box(8, 8, 8, 0.02, wax);
    const std::vector<Actor> actors = {{cube, at(0, 0.05, 0)}, {cube, at(0.05, 0.25, 0.03)}};
    const RunContext one(1), two(2);
    Simulation a = Simulation::create(world, actors, {}, one).value(),
               b = Simulation::create(world, actors, {}, two).value();
    for (int f = 0; f < 10; ++f) {
        a.advance(one).value();
        b.advance(two).value();
    }
    EXPECT_EQ(a.save(), b.save());
    Simulation c = Simulation::create(world, actors, {}, one).value();
    ASSERT_TRUE(c.restore(a.save()).ok());
    a.advance(one).value();
    c.advance(two).value();
    EXPECT_EQ(a.save(), c.save());
}

TEST(Mpm, HostileStartsStayBounded) {
    for (const double spacing : {1e-4, 0.02, 5.0}) {
        Material material = melting();
        material.temperature = 1e5;
        material.viscosity = 1e9;
        World world = on_ground();
        world.air_heat_transfer = 1e12;
        world.air_temperature.constant = 1e5;
        Actor thin{box(6, 1, 1, spacing, material), at(1e4, 3 * spacing, -1e4)};
        thin.velocity = {1e3, -1e3, 0};
        Actor lone{box(1, 1, 1, spacing, material), at(1e4, 3 * spacing, -1e4)};
        Simulation simulation = begin(std::move(world), {thin, lone}, 1000);
        run(simulation, 3);
        for (std::size_t b = 0; b < 2; ++b)
            for (std::size_t i = 0; i < simulation.positions(b).size(); ++i)
                ASSERT_TRUE(simulation.positions(b)[i].allFinite() && simulation.velocities(b)[i].norm() < 1e5f);
    }
}

} // namespace filigree::mpm_test
