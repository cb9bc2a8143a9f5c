// Obstacles are there: whatever they are made of, from both sides, at any speed.
#include "obstacle_meshes.h"
#include "simulation_scenes.h"
#include "threads.h"

namespace filigree {

namespace obstacle_contact {

using namespace obstacle_meshes;
using namespace simulation_scenes;

constexpr double kRadius = 0.1;

std::shared_ptr<const Body> ball_of(MaterialModel model, double young_modulus = 1e6, double spacing = 0.04) {
    Material matter = material(model, young_modulus);
    matter.internal_damping = 0;
    return std::make_shared<Body>(
        make_body(sphere(float(kRadius), 16, 8), matter, {.cells = {.spacing = spacing}}, kAllThreads).value());
}

Obstacle of_mesh(const Mesh& mesh, double restitution = 0) {
    Obstacle obstacle;
    obstacle.shape = make_mesh_obstacle(mesh, 1, 0, kAllThreads).value();
    obstacle.restitution = restitution;
    return obstacle;
}
Obstacle of_box(const Vec3d& centre, const Vec3d& size) {
    Obstacle obstacle;
    obstacle.shape = Cuboid{centre, size};
    obstacle.restitution = 0;
    return obstacle;
}

World world_with(std::vector<Obstacle> obstacles, double gravity = 0) {
    World world = free_space();
    world.gravity.y() = -gravity;
    world.obstacles = std::move(obstacles);
    return world;
}

Vec3d centre_of(const Simulation& simulation) {
    Vec3d sum = Vec3d::Zero();
    double mass = 0;
    const Body& body = simulation.body(0);
    for (std::size_t i = 0; i < body.particle_count(); ++i) {
        sum += double(body.mass[i]) * simulation.positions(0)[i].cast<double>();
        mass += double(body.mass[i]);
    }
    return sum / mass;
}

constexpr StepOptions kExplicit = {.mode = StepMode::explicit_steps, .automatic_rigid = false};

Actor thrown(std::shared_ptr<const Body> body, const Vec3d& at, const Vec3d& velocity) {
    Actor made = actor(std::move(body), at);
    made.velocity = velocity;
    return made;
}

/// Runs frames, and looks at the centre after each.
template <class Holds>
void expect_always(Simulation& simulation, int frames, const std::string& what, const Holds& holds) {
    for (int frame = 0; frame < frames; ++frame) {
        run(simulation, 1);
        const Vec3d centre = centre_of(simulation);
        ASSERT_TRUE(holds(centre)) << what << ": after frame " << frame << " the centre is at " << centre.transpose();
    }
}

class EachModel : public testing::TestWithParam<MaterialModel> {};
std::string name_of_model(const testing::TestParamInfo<MaterialModel>& info) {
    switch (info.param) {
    case MaterialModel::fem:
        return "fem";
    case MaterialModel::springs:
        return "springs";
    case MaterialModel::meshfree:
        return "meshfree";
    default:
        return "rigid";
    }
}
INSTANTIATE_TEST_SUITE_P(ObstacleContact, EachModel,
                         testing::Values(MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree,
                                         MaterialModel::rigid),
                         name_of_model);

struct Named {
    const char* name;
    Obstacle obstacle;
};
/// What lies in the plane y = 0, about 2 m wide and at most 1 mm thick.
std::vector<Named> thin_things() {
    return {{"two triangles", of_mesh(flat_sheet(1))},
            {"two triangles, turned over", of_mesh(turned_over(flat_sheet(1)))},
            {"a thousand triangles", of_mesh(flat_sheet(24))},
            {"a sheet twice", of_mesh(doubled(flat_sheet(3)))},
            {"a plate", of_mesh(box_mesh({-1, -0.0005f, -1}, {1, 0.0005f, 1}, 4))},
            {"a plate inside out", of_mesh(turned_over(box_mesh({-1, -0.0005f, -1}, {1, 0.0005f, 1}, 4)))},
            {"a thin cuboid", of_box({0, 0, 0}, {2, 0.001, 2})}};
}

/// Soft bodies that are crushed take thousands of substeps a frame: those meet fewer things, and less fast.
std::vector<Named> thin_things_for(MaterialModel model) {
    std::vector<Named> all = thin_things();
    if (model == MaterialModel::rigid) return all;
    if (model == MaterialModel::fem) return {all[0], all[4], all[6]};
    return {all[4]};
}
std::vector<double> speeds_for(MaterialModel model) {
    if (model == MaterialModel::rigid) return {1, 36, 1000};
    if (model == MaterialModel::fem) return {1, 36, 100};
    return {36};
}

TEST_P(EachModel, ThinThingsStopFromBothSidesAtAnySpeed) {
    const auto body = ball_of(GetParam());
    for (const auto& [name, obstacle] : thin_things_for(GetParam()))
        for (const double side : {1.0, -1.0})
            for (const double speed : speeds_for(GetParam())) {
                if (speed != 36 && side < 0) continue;
                Simulation sim =
                    simulation(world_with({obstacle}),
                               {thrown(body, {0.03, side * 0.25, -0.02}, {0, -side * speed, 0})}, kExplicit);
                const int frames = int(std::clamp(60 * 0.5 / speed, 3.0, 30.0));
                expect_always(sim, frames,
                              std::string(name) + (side > 0 ? " from above at " : " from below at ") +
                                  std::to_string(speed),
                              [&](const Vec3d& centre) { return side * centre.y() > 0; });
            }
}

TEST_P(EachModel, WhatLiesOnThinThingsStaysThere) {
    const auto body = ball_of(GetParam());
    for (const auto& [name, obstacle] : thin_things_for(GetParam())) {
        Simulation sim = simulation(world_with({obstacle}, 9.81), {actor(body, {0.03, kRadius, 0.02})}, kExplicit);
        run(sim, 60);
        EXPECT_NEAR(centre_of(sim).y(), kRadius, 0.025) << name;
    }
}

TEST_P(EachModel, TerrainHoldsEitherWayRound) {
    const auto body = ball_of(GetParam());
    for (const bool turned : {false, true})
        for (const Vec3d& at : {Vec3d(0, 0.6, 0), Vec3d(1.2, 0.8, -0.7), Vec3d(-1, 0.5, 0.4)}) {
            if (at.x() != 0 && GetParam() != MaterialModel::rigid) continue; // they take long
            const Mesh mesh = turned ? turned_over(terrain(40)) : terrain(40);
            Simulation sim = simulation(world_with({of_mesh(mesh)}, 9.81), {actor(body, at)}, kExplicit);
            expect_always(sim, 90, turned ? "turned" : "as it is", [&](const Vec3d& centre) {
                const bool is_over = std::max(std::abs(centre.x()), std::abs(centre.z())) < 2;
                return !is_over || centre.y() > terrain_height(centre.x(), centre.z()) + 0.4 * kRadius;
            });
        }
}

TEST_P(EachModel, RoomsKeepWhatIsInThem) {
    const auto body = ball_of(GetParam());
    const std::vector<Named> rooms = {{"faces inwards", of_mesh(box_shell(0.5f, 1))},
                                      {"faces outwards", of_mesh(turned_over(box_shell(0.5f, 4)))},
                                      {"doubled faces", of_mesh(doubled(box_shell(0.5f, 3)))},
                                      {"doubled walls", of_mesh(joined(box_shell(0.5f, 3), box_shell(0.503f, 2)))},
                                      {"thick walls", of_mesh(thick_shell(0.5f, 0.05f))},
                                      {"thin walls", of_mesh(thick_shell(0.5f, 0.001f))}};
    for (const auto& [name, room] : rooms)
        for (const Vec3d& velocity : {Vec3d(0, 0, 0), Vec3d(30, 20, 0), Vec3d(-200, 300, 150)}) {
            const bool is_rigid = GetParam() == MaterialModel::rigid;
            if (!is_rigid && (velocity.z() != 0 || (name != rooms.front().name && name != rooms.back().name)))
                continue; // they take long
            Simulation sim = simulation(world_with({room}, 9.81), {thrown(body, {0.05, 0.1, 0}, velocity)}, kExplicit);
            // What is crushed flat for a moment has corners of cells outside of its surface, so that the mean of all
            // may lie a little behind the wall.
            expect_always(sim, velocity.isZero() ? 20 : 8, name,
                          [&](const Vec3d& centre) { return centre.cwiseAbs().maxCoeff() < 0.51; });
        }
}

TEST_P(EachModel, TunnelsTraysStairsAndWedgesHold) {
    const auto body = ball_of(GetParam());
    const Mesh tunnel = grid_mesh(
        8,
        [](double u, double v) -> Vec3d {
            const double at = 4 * v, part = at - std::floor(at);
            const std::array<Vec3d, 5> corners = {Vec3d(0, -0.3, -0.3), Vec3d(0, -0.3, 0.3), Vec3d(0, 0.3, 0.3),
                                                  Vec3d(0, 0.3, -0.3), Vec3d(0, -0.3, -0.3)};
            const auto k = std::size_t(std::min(at, 3.999));
            return Vec3d(2 * u - 1, 0, 0) + corners[k] + (at < 4 ? part : 1.0) * (corners[k + 1] - corners[k]);
        },
        4);
    for (const Mesh& mesh : {tunnel, turned_over(tunnel)}) {
        Simulation sim = simulation(world_with({of_mesh(mesh)}, 9.81), {actor(body, {0, 0, 0.05})}, kExplicit);
        expect_always(sim, 60, "tunnel", [](const Vec3d& c) { return c.y() > -0.3 && c.y() < 0.3; });
    }
    Mesh tray = box_mesh({-0.3f, -0.001f, -0.3f}, {0.3f, 0, 0.3f});
    for (const float x : {-0.3f, 0.299f}) tray = joined(tray, box_mesh({x, 0, -0.3f}, {x + 0.001f, 0.2f, 0.3f}));
    for (const float z : {-0.3f, 0.299f}) tray = joined(tray, box_mesh({-0.3f, 0, z}, {0.3f, 0.2f, z + 0.001f}));
    Simulation in_tray =
        simulation(world_with({of_mesh(tray)}, 9.81), {thrown(body, {0, 0.2, 0}, {2, 0, 1})}, kExplicit);
    expect_always(in_tray, 60, "tray",
                  [](const Vec3d& c) { return c.y() > 0 && std::abs(c.x()) < 0.3 && std::abs(c.z()) < 0.3; });
    const Mesh stairs = grid_mesh(
        2,
        [](double u, double v) {
            const int edge = int(std::lround(12 * v)); // along, down, along, down ...
            return Vec3d(2 * u - 1, -0.15 * (edge / 2), 0.25 * ((edge + 1) / 2));
        },
        12);
    for (const Mesh& mesh : {stairs, turned_over(stairs)}) {
        Simulation sim =
            simulation(world_with({of_mesh(mesh)}, 9.81), {thrown(body, {0, 0.3, 0.1}, {0, 0, 1})}, kExplicit);
        expect_always(sim, 60, "stairs", [](const Vec3d& c) {
            return c.z() > 1.5 || c.y() > -0.15 * std::floor(std::max(0.0, c.z()) / 0.25);
        });
    }
    const Mesh wedge = grid_mesh(
        1, [](double u, double v) { return Vec3d(2 * u - 1, 0.5 * std::abs(2 * v - 1), 0.6 * (2 * v - 1)); }, 2);
    for (const double speed : {0.0, 50.0}) {
        Simulation sim =
            simulation(world_with({of_mesh(wedge)}, 9.81), {thrown(body, {0, 0.4, 0.1}, {0, -speed, 0})}, kExplicit);
        expect_always(sim, 30, "wedge", [](const Vec3d& c) { return c.y() > 0.5 / 0.6 * std::abs(c.z()); });
    }
}

/// A sheet that sweeps over what rests takes it along.
TEST_P(EachModel, MovingThinThingsPushWhatRests) {
    const auto body = ball_of(GetParam());
    for (const auto& [name, thing] : thin_things_for(GetParam()))
        for (const double speed : speeds_for(GetParam())) {
            Obstacle obstacle = thing;
            const double seconds = 0.8 / speed;
            obstacle.motion.move = {{0, seconds}, {Vec3d(0, 0.3, 0), Vec3d(0, -0.5, 0)}, Vec3d::Zero()};
            Simulation sim = simulation(world_with({obstacle}), {actor(body, {0.03, 0, 0.02})}, kExplicit);
            run(sim, std::size_t(std::ceil(60 * seconds)) + 1);
            EXPECT_LT(centre_of(sim).y(), -0.5) << name << " at " << speed;
        }
}

TEST_P(EachModel, TurningThinThingsPushWhatRests) {
    const auto body = ball_of(GetParam());
    for (const double turns : {0.5, 5.0}) {            // a second
        Obstacle paddle = of_mesh(flat_sheet(2, 0.5)); // about the z axis, from +x to below
        const double rate = 2 * std::numbers::pi * turns;
        paddle.motion.angle = {{0, 10}, {Vec3d::Zero(), Vec3d(0, 0, -10 * rate)}, Vec3d::Zero()};
        Simulation sim = simulation(world_with({paddle}), {actor(body, {0.3, -0.15, 0})}, kExplicit);
        for (int frame = 0; frame < 60; ++frame) {
            run(sim, 1);
            const Vec3d own = Eigen::AngleAxisd(rate * sim.time(), Vec3d::UnitZ()) * centre_of(sim);
            if (std::abs(own.x()) > 0.45) break; // it has slipped off
            ASSERT_LT(own.y(), 0) << turns << " after frame " << frame;
        }
        EXPECT_GT(centre_of(sim).norm(), 0.45) << turns;
    }
}

TEST_P(EachModel, SpheresAndCuboidsStopAtAnySpeed) {
    const auto body = ball_of(GetParam());
    Obstacle globe;
    globe.shape = Ball{{0, -0.3, 0}, 0.3};
    for (const Obstacle& obstacle : {globe, of_box({0, -0.05, 0}, {2, 0.1, 2}), of_box({0, -5, 0}, {20, 10, 20})})
        for (const double speed : speeds_for(GetParam())) {
            Simulation sim =
                simulation(world_with({obstacle}), {thrown(body, {0, 0.25, 0}, {0, -speed, 0})}, kExplicit);
            expect_always(sim, int(std::clamp(30 / speed, 5.0, 30.0)), std::to_string(speed),
                          [](const Vec3d& centre) { return centre.y() > 0; });
        }
}

TEST_P(EachModel, WhatStartsAcrossASheetComesOutWhereMostOfItIs) {
    const auto body = ball_of(GetParam());
    for (const double height : {0.05, -0.05}) {
        Simulation sim = simulation(world_with({of_mesh(flat_sheet(4))}), {actor(body, {0, height, 0})}, kExplicit);
        run(sim, 30);
        for (std::size_t i = 0; i < sim.positions(0).size(); ++i)
            EXPECT_GT(double(sim.positions(0).y[i]) * (height > 0 ? 1 : -1), -0.06) << height;
        EXPECT_GT(centre_of(sim).y() * (height > 0 ? 1 : -1), 0.07) << height;
    }
}

/// What is thinner than the distance between surface points does not go in between them.
TEST_P(EachModel, PostsAndKnivesHoldWhatFallsOnThem) {
    const auto body = ball_of(GetParam(), 1e6, 0.05);
    const std::vector<Named> things = {
        {"a post", of_box({0.011, -0.5, 0.013}, {0.004, 1, 0.004})},
        {"a post of a mesh", of_mesh(box_mesh({0.009f, -1, 0.011f}, {0.013f, 0, 0.015f}))},
        {"a needle", of_mesh(needle(0.01f))},
        {"a knife", of_mesh(grid_mesh(4, [](double u, double v) { return Vec3d(2 * u - 1, -v, 0.012); }))}};
    for (const auto& [name, thing] : things)
        for (const double speed : {1.0, 4.5}) {
            Simulation sim = simulation(world_with({thing}), {thrown(body, {0, 0.2, 0}, {0, -speed, 0})}, kExplicit);
            double lowest = 1;
            for (int frame = 0; frame < 30; ++frame) {
                run(sim, 1);
                lowest = std::min(lowest, centre_of(sim).y());
            }
            const double least = GetParam() == MaterialModel::meshfree ? 0.01 : 0.03; // it gives way further
            EXPECT_GT(lowest, least) << name << " at " << speed;
        }
}

TEST(ObstacleContact, StartsInsideObstaclesAreTold) {
    const auto body = ball_of(MaterialModel::fem);
    const auto overlaps = [&](const Obstacle& obstacle, const Vec3d& at) {
        return simulation(world_with({obstacle}), {actor(body, at)}, kExplicit).start_overlaps();
    };
    const Obstacle room = of_mesh(box_shell(0.5f, 2)), plate = of_mesh(flat_sheet(2));
    ASSERT_EQ(overlaps(room, {0, 0, 0}).size(), 1u);
    EXPECT_TRUE(overlaps(room, {0, 0, 0})[0].is_inside);
    EXPECT_TRUE(overlaps(room, {0, 0.7, 0}).empty());
    EXPECT_TRUE(overlaps(plate, {0, kRadius, 0}).empty());
    ASSERT_EQ(overlaps(plate, {0, 0.02, 0}).size(), 1u);
    EXPECT_NEAR(overlaps(plate, {0, 0.02, 0})[0].depth, 0.08, 0.01);
    EXPECT_EQ(overlaps(of_box({0, -0.5, 0}, {2, 1, 2}), {0, 0.02, 0}).size(), 1u);
    Obstacle ground;
    ground.shape = HalfSpace{};
    EXPECT_NEAR(overlaps(ground, {0, 0, 0}).at(0).depth, 0.1, 0.01);
    EXPECT_NE(overlaps(plate, {0, 0.02, 0})[0].sentence("body 'a'", "obstacle 'b'").find("0.08 m deep in obstacle 'b'"),
              std::string::npos);
}

/// An obstacle that jumps to the other side of a body has not gone through it.
TEST(ObstacleContact, ASheetThatJumpsOverABodyLeavesItAlone) {
    Obstacle sheet = of_mesh(flat_sheet(2));
    sheet.motion.move = {
        {0, 0.1, 0.1, 1}, {Vec3d(0, 0.5, 0), Vec3d(0, 0.5, 0), Vec3d(0, -0.5, 0), Vec3d(0, -0.5, 0)}, Vec3d::Zero()};
    Simulation sim = simulation(world_with({sheet}), {actor(ball_of(MaterialModel::fem))}, kExplicit);
    run(sim, 12);
    EXPECT_LT(centre_of(sim).norm(), 1e-3);
}

TEST_P(EachModel, ARunOverTerrainIsSavedWithItsSides) {
    const auto body = ball_of(GetParam());
    const auto begin = [&](unsigned threads) {
        return simulation(world_with({of_mesh(flat_sheet(3)), of_box({0.5, 0, 0}, {0.1, 0.5, 1})}, 9.81),
                          {thrown(body, {0.2, 0.15, 0}, {3, -3, 0})}, kExplicit, threads);
    };
    Simulation whole = begin(1), first = begin(2), second = begin(1);
    run(whole, 12);
    run(first, 5, 2);
    ASSERT_TRUE(second.restore(first.save()).ok());
    run(second, 7, 2);
    for (std::size_t i = 0; i < body->particle_count(); ++i)
        ASSERT_EQ(whole.positions(0)[i], second.positions(0)[i]) << i;
    EXPECT_EQ(whole.save(), second.save());
}

} // namespace obstacle_contact

} // namespace filigree
