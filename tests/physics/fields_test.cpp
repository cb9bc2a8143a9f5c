// Matter that varies within a body.
#include "elastic_checks.h"
#include "filigree/mesh.h"
#include "filigree/physics/body/fields.h"
#include "filigree/physics/breaking/broken_body.h"
#include "filigree/physics/fem/cell_kernel.h"
#include "filigree/physics/fem/plastic_cells.h"
#include "simulation_scenes.h"
#include "test_bodies.h"
#include "threads.h"

namespace filigree {
namespace {

using simulation_scenes::actor;
using simulation_scenes::free_space;

std::vector<float> a_cell(const Body& body, const std::function<double(const Vec3f&)>& value) {
    std::vector<float> field;
    for (const Vec3f& at : body.cells.centroid) field.push_back(float(value(at)));
    return field;
}

/// Stiffness and density that vary from cell to cell, without an order.
Body varied(Body body) {
    BodyFields fields;
    for (std::size_t c = 0; c < body.cells.cells.size(); ++c) {
        fields.stiffness.push_back(float(0.2 + 5 * random_unit(11, c)));
        fields.density.push_back(float(0.3 + 2 * random_unit(12, c)));
    }
    EXPECT_TRUE(set_fields(body, fields).ok());
    return body;
}

/// A bar along x about the origin, held where x is least.
Simulation held_bar(const std::shared_ptr<const Body>& body, double newtons, StepOptions options = {}) {
    World world = free_space();
    Pin pin;
    RegionForce force;
    Box box;
    for (std::size_t i = 0; i < body->rest.size(); ++i) box.extend(body->rest[i].cast<double>());
    for (Index i = 0; i < body->rest.size(); ++i) {
        if (double(body->rest[i].x()) < box.min.x() + 1e-6) pin.particles.push_back(i);
        if (double(body->rest[i].x()) > box.max.x() - 1e-6) force.particles.push_back(i);
    }
    force.force.constant = {newtons, 0, 0};
    world.pins.push_back(pin);
    world.forces.push_back(force);
    return Simulation::create(world, {{.body = body}}, options, kTwoThreads).value();
}

/// m: how far the pulled end has gone, in the mean.
double extension(const Simulation& simulation) {
    double sum = 0;
    for (const Index i : simulation.world().forces[0].particles)
        sum += double(simulation.positions(0)[i].x() - simulation.body(0).rest[i].x());
    return sum / double(simulation.world().forces[0].particles.size());
}

std::shared_ptr<Body> bar(const Material& material) {
    return std::make_shared<Body>(make_body(box_cells(16, 4, 4, 0.0625, Vec3d(-0.5, -0.125, -0.125)), material));
}

TEST(Fields, OnesChangeNoByte) {
    const Body plain = make_body(checks::uneven_cells(0.1), undamped(0.3));
    Body ones = plain;
    const std::vector<float> one(plain.cells.cells.size(), 1);
    ASSERT_TRUE(set_fields(ones, {one, one, one, one, one}).ok());
    EXPECT_EQ(plain.mass, ones.mass);
    const auto first = make_elasticity(plain, kTwoThreads), second = make_elasticity(ones, kTwoThreads);
    for (const checks::Start& state : checks::states(plain)) {
        Vectors wanted(plain.particle_count()), found(plain.particle_count());
        const ElasticReport a = first->forces(state.positions, wanted, kTwoThreads);
        const ElasticReport b = second->forces(state.positions, found, kTwoThreads);
        EXPECT_TRUE(checks::same_bytes(wanted, found)) << state.name;
        EXPECT_EQ(a.squared_frequency, b.squared_frequency);
        EXPECT_EQ(first->energy(state.positions, kTwoThreads), second->energy(state.positions, kTwoThreads));
    }
}

TEST(Fields, ForcesAreTheEnergys) {
    checks::expect_forces_from_energy(varied(make_body(checks::uneven_cells(0.1), undamped(0.3))), make_elasticity);
    Material yields = undamped(0.3);
    yields.yield_stress = 1e4;
    checks::expect_forces_from_energy(varied(make_body(checks::uneven_cells(0.1), yields)), make_elasticity);
}
TEST(Fields, NoNetForce) {
    checks::expect_no_net_force(varied(make_body(checks::uneven_cells(0.1), undamped(0.3))), make_elasticity);
}
TEST(Fields, TheRateIsABound) {
    checks::expect_rate_is_a_bound(varied(make_body(box_cells(2, 2, 2, 0.1), undamped(0.3))), make_elasticity);
    Material yields = undamped(0.3);
    yields.yield_stress = 1e4;
    checks::expect_rate_is_a_bound(varied(make_body(box_cells(2, 2, 2, 0.1), yields)), make_elasticity);
}
TEST(Fields, SameBytesForThreadsAndWidths) {
    const Body body = varied(make_body(box_cells(17, 9, 8, 0.1), undamped(0.3)));
    checks::expect_same_bytes_for_threads(body, make_elasticity);
    const cell_kernel::Plan plan = cell_kernel::make_plan(body);
    cell_kernel::Sums sums;
    InternalDamping damping{checks::states(body)[0].positions, 0.01f, 0.02f, 1e6f, {}};
    for (const checks::Start& state : checks::states(body))
        for (const InternalDamping* damped : {static_cast<const InternalDamping*>(nullptr), &std::as_const(damping)}) {
            Vectors narrow(body.particle_count()), wide(body.particle_count());
            const ElasticReport one = cell_kernel::forces(plan, state.positions, narrow, sums, 4, kTwoThreads, damped);
            for (const int lanes : cell_kernel::lane_counts()) {
                const ElasticReport other =
                    cell_kernel::forces(plan, state.positions, wide, sums, lanes, kTwoThreads, damped);
                EXPECT_TRUE(checks::same_bytes(narrow, wide)) << state.name << lanes;
                EXPECT_EQ(one.squared_frequency, other.squared_frequency);
                EXPECT_EQ(one.damping_rate, other.damping_rate);
            }
        }
}

TEST(Fields, ABarWhoseHalfIsTenTimesAsStiffExtendsAsTheorySays) {
    Material material = undamped(0.3);
    material.damping = 60;
    const double newtons = 300, area = 0.25 * 0.25;
    for (const double stiff : {1.0, 10.0}) {
        const auto body = bar(material);
        ASSERT_TRUE(
            set_fields(*body, {.stiffness = a_cell(*body, [&](const Vec3f& at) { return at.x() > 0 ? stiff : 1.0; })})
                .ok());
        Simulation simulation = held_bar(body, newtons);
        const FrameReport last = simulation_scenes::run(simulation, 40, 2);
        const double wanted = newtons / (area * material.young_modulus) * (0.5 + 0.5 / stiff);
        EXPECT_NEAR(extension(simulation), wanted, 0.03 * wanted) << stiff;
        EXPECT_LT(simulation.energy(kTwoThreads).kinetic, 1e-6 * simulation.energy(kTwoThreads).elastic);
        // Half of the work, as of any spring.
        EXPECT_NEAR(simulation.energy(kTwoThreads).elastic, newtons * extension(simulation) / 2,
                    0.01 * newtons * wanted);
        EXPECT_EQ(last.unstable_substeps, 0u);
    }
}

TEST(Fields, TheStiffestCellSetsTheStep) {
    const auto substeps = [](double stiff, double dense) {
        const auto body = bar(undamped(0.3));
        std::vector<float> one(body->cells.cells.size(), 1), field = one;
        field[37] = float(stiff);
        BodyFields fields{.stiffness = field, .density = one};
        fields.density[37] = float(dense);
        EXPECT_TRUE(set_fields(*body, fields).ok());
        Simulation simulation = held_bar(body, 0);
        return simulation_scenes::run(simulation, 2, 2).substeps;
    };
    const double plain = substeps(1, 1);
    EXPECT_NEAR(substeps(9, 1) / plain, 3, 0.1);
    EXPECT_NEAR(substeps(1, 0.25) / plain, 2, 0.1);
    EXPECT_EQ(substeps(9, 9), plain);
}

TEST(Fields, DensityMovesTheCentreOfMass) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::rigid}) {
        Material material = undamped(0.3);
        material.model = model;
        const auto body = bar(material);
        ASSERT_TRUE(
            set_fields(*body, {.density = a_cell(*body, [](const Vec3f& at) { return at.x() > 0 ? 3.0 : 1.0; })}).ok());
        double mass = 0;
        for (const float m : body->mass) mass += double(m);
        EXPECT_NEAR(mass, 1000 * 0.0625 * 2, 1e-3);
        Simulation simulation = simulation_scenes::simulation(free_space(), {actor(body)});
        EXPECT_NEAR(centre_of_mass(simulation).x(), (3 * 0.25 - 0.25) / 4, 0.01);
        ASSERT_TRUE(set_fields(*body, {}).ok());
        EXPECT_EQ(body->mass, bar(material)->mass) << "as if it had never been";
    }
}

TEST(Fields, DampingSlowsByWhatTheFieldSays) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::rigid}) {
        Material material = undamped(0.3);
        material.model = model;
        material.damping = 0.5;
        const auto body = bar(material);
        ASSERT_TRUE(set_fields(*body, {.damping = std::vector<float>(body->cells.cells.size(), 4)}).ok());
        Actor moves = actor(body);
        moves.velocity = {2, 0, 0};
        Simulation simulation = simulation_scenes::simulation(free_space(), {moves});
        simulation_scenes::run(simulation, 60);
        EXPECT_NEAR(double(simulation.velocities(0)[0].x()), 2 * std::exp(-4 * 0.5), 2e-3);
    }
}

TEST(Fields, WeakMatterYieldsWhereItIsWeak) {
    Material material = undamped(0.3);
    material.damping = 60;
    material.yield_stress = 1e5;
    const auto body = bar(material);
    ASSERT_TRUE(
        set_fields(*body, {.yield_stress = a_cell(*body, [](const Vec3f& at) { return at.x() > 0.25f ? 0.2 : 1.0; })})
            .ok());
    const auto elasticity = make_elasticity(*body, kTwoThreads);
    const Vectors pulled =
        checks::moved(body->rest, [](std::size_t, const Vec3f& p) { return Vec3f(1.05f * p.x(), p.y(), p.z()); });
    elasticity->finish_substep(pulled, 0.01f, kTwoThreads); // 5e4 Pa: half of one yield stress, 2.5 of the other
    const std::span<const PlasticCell> cells = elasticity->plastic_cells();
    for (std::size_t c = 0; c < cells.size(); ++c)
        EXPECT_EQ(cells[c].inverse.isIdentity(1e-7f), !(body->cells.centroid[c].x() > 0.25f)) << c;
}

/// Three pieces in a row, of which one end is pulled: the crack that gives way is the weak one.
TEST(Fields, ABodyBreaksWhereItIsWeak) {
    Material material = undamped(0);
    material.damping = 20;
    for (const double weak : {-0.2, 0.2}) {
        const auto body = bar(material);
        ASSERT_TRUE(set_fields(*body, {.strength = a_cell(*body,
                                                          [&](const Vec3f& at) {
                                                              return std::abs(double(at.x()) - weak) < 0.1 ? 0.3 : 1.0;
                                                          })})
                        .ok());
        const Partition thirds{3, [](const Vec3d& p) {
                                   return p.x() < -0.2 ? Index(0) : p.x() < 0.2 ? Index(1) : Index(2);
                               }};
        auto fracture = std::make_shared<Fracture>();
        fracture->body = break_body(body, thirds, kTwoThreads).value();
        fracture->material.strength = 4e4;
        fracture->material.energy = 100;
        World world = free_space();
        for (const double side : {-1.0, 1.0}) {
            Pin pin;
            for (Index i = 0; i < body->rest.size(); ++i)
                if (std::abs(double(body->rest[i].x()) - side * 0.5) < 1e-4) pin.particles.push_back(i);
            pin.motion.move.times = {0, 100};
            pin.motion.move.values = {Vec3d::Zero(), {side * 5, 0, 0}};
            world.pins.push_back(pin);
        }
        Simulation simulation =
            Simulation::create(world, {{.body = body, .fracture = fracture}}, {}, kTwoThreads).value();
        while (!(simulation.fracture(0).broken_area > 0) && simulation.time() < 1)
            simulation.advance(kTwoThreads).value();
        const std::vector<double> broke = simulation.fracture(0).broke;
        ASSERT_EQ(broke.size(), 3u);
        // 0.3 times 4e4 Pa is a strain of 1.2 %, and the ends part by 0.1 of the length a second.
        EXPECT_NEAR(simulation.time(), 0.12, 0.03) << weak;
        EXPECT_TRUE(std::isfinite(broke[1]));
        EXPECT_EQ(std::isfinite(broke[0]), weak < 0);
        EXPECT_EQ(std::isfinite(broke[2]), weak > 0);
    }
}

TEST(Fields, PiecesHaveTheFieldsOfTheirCells) {
    const auto body = std::make_shared<Body>(varied(*bar(undamped(0.3))));
    const Partition halves{2, [](const Vec3d& p) { return p.x() < 0.02 ? Index(0) : Index(1); }};
    const auto broken = break_body(body, halves, kTwoThreads).value();
    std::vector<double> mass(body->mass.size());
    for (std::size_t k = 0; k < broken->pieces.size(); ++k) {
        const Body& piece = *broken->pieces[k];
        for (std::size_t c = 0; c < piece.cells.cells.size(); ++c)
            EXPECT_EQ(piece.fields.stiffness[c], body->fields.stiffness[broken->cells_of_whole[k][c]]);
        for (std::size_t i = 0; i < piece.mass.size(); ++i)
            mass[broken->corners_of_whole[k][i]] += double(piece.mass[i]);
    }
    for (std::size_t i = 0; i < mass.size(); ++i) EXPECT_NEAR(mass[i], double(body->mass[i]), 1e-5 * mass[i]);
}

TEST(Fields, AStateIsOfItsFields) {
    const auto plain = bar(undamped(0.3));
    const auto body = std::make_shared<Body>(varied(*plain));
    ASSERT_TRUE(set_fields(*body, {.stiffness = body->fields.stiffness, .damping = body->fields.density}).ok());
    const auto begin = [](const std::shared_ptr<const Body>& of) {
        Actor falls = actor(of, {0, 0.3, 0});
        falls.spin = {1, 2, 3};
        return simulation_scenes::simulation(simulation_scenes::with_ground(), {falls});
    };
    Simulation whole = begin(body), first = begin(body), second = begin(body), other = begin(plain);
    simulation_scenes::run(whole, 24);
    simulation_scenes::run(first, 12);
    const std::string saved = first.save();
    ASSERT_TRUE(second.restore(saved).ok());
    simulation_scenes::run(second, 12);
    EXPECT_TRUE(whole.save() == second.save());
    const Status refused = other.restore(saved);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::mismatch);
}

TEST(Fields, SpreadInwardsWhatIsHarmonic) {
    const Mesh mesh = make_ball({0.1, 0.2, 0.3}, 0.5);
    const Body body = make_body(mesh, {}, {.scale = 2, .cells = {.count = 3000}}, kTwoThreads).value();
    std::vector<float> x, one(mesh.vertex_count(), 0.37f);
    for (const Vec3f& p : mesh.positions) x.push_back(p.x());
    const std::vector<float> inside = spread_inwards(body, mesh, x, kTwoThreads).value();
    double most = 0;
    for (std::size_t c = 0; c < inside.size(); ++c)
        most = std::max(most, std::abs(double(inside[c] - body.cells.centroid[c].x() / 2)));
    EXPECT_LT(most, 0.5 * body.spacing() / 2) << "x is harmonic; surface cells have it where the surface is";
    for (const float value : spread_inwards(body, mesh, one, kTwoThreads).value()) EXPECT_FLOAT_EQ(value, 0.37f);
    EXPECT_EQ(inside, spread_inwards(body, mesh, x, kOneThread).value());
}

TEST(Fields, ABodyTakesThemByTheMesh) {
    const Mesh mesh = make_bar({.resolution = 4, .length = 3});
    std::vector<float> stiff;
    for (const Vec3f& p : mesh.positions) stiff.push_back(p.x() > 0 ? 20.0f : 1.0f);
    BodyOptions options{.size = 0.3, .cells = {.count = 400}, .fields = {{FieldOf::stiffness, stiff}}};
    BodyReport report;
    const Body body = make_body(mesh, {}, options, kTwoThreads, &report).value();
    for (std::size_t c = 0; c < body.cells.cells.size(); ++c) {
        const float x = body.cells.centroid[c].x();
        if (std::abs(x) < 0.1f) continue;
        EXPECT_NEAR(body.fields.stiffness[c], x > 0 ? 20 : 1, 1) << x;
    }
    EXPECT_NE(report.warning.find("stiffness varies from 1 to 20 times"), std::string::npos) << report.warning;
    options.fields[0].values.pop_back();
    EXPECT_EQ(make_body(mesh, {}, options, kTwoThreads).error().code, ErrorCode::usage);
    options.fields = {{FieldOf::density, stiff}, {FieldOf::density, stiff}};
    EXPECT_EQ(make_body(mesh, {}, options, kTwoThreads).error().message, "There are two fields of density; give one.");
}

TEST(Fields, RefusesWhatItCannotUse) {
    Body body = make_body(box_cells(2, 2, 2, 0.1), undamped(0.3));
    const std::vector<float> mass = body.mass;
    const auto sentence = [&](BodyFields fields) {
        const Status set = set_fields(body, std::move(fields));
        return set.ok() ? "" : set.error().message;
    };
    EXPECT_EQ(sentence({.density = {1, 2}}), "The field of density has 2 values, and the body has 8 cells.");
    EXPECT_EQ(sentence({.density = {1, 1, 1, 1, 1, 2, 1, 1}, .strength = {1, 1, 0, 1, 1, 1, 1, 1}}),
              "The field of strength is 0 in cell 2; it multiplies the material's value, from 0.001 to 1000.");
    EXPECT_TRUE(body.fields.empty());
    EXPECT_EQ(body.mass, mass);
    Material springs;
    springs.model = MaterialModel::springs;
    body = make_body(box_cells(2, 2, 2, 0.1), springs);
    EXPECT_NE(sentence({.density = {1, 1, 1, 1, 1, 1, 1, 1}}), "");
    EXPECT_EQ(sentence({}), "");
}

} // namespace
} // namespace filigree
