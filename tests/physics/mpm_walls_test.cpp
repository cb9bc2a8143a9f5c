// Matter of mpm against what is thinner than its grid: sheets, thin boxes, trays, rooms, tunnels.
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/grid/grid_limits.h"
#include "filigree/physics/material.h"
#include "physics/obstacle_meshes.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

namespace filigree::mpm_walls_test {
namespace {

namespace meshes = obstacle_meshes;

constexpr double kSpacing = 0.02;

Material cold() {
    Material material;
    material.model = MaterialModel::mpm;
    material.density = 1000;
    material.young_modulus = 1e5;
    material.poisson_ratio = 0.3;
    material.damping = 0;
    return material;
}
Material melt() {
    Material wax = std::ranges::find(named_materials(), "wax", &NamedMaterial::name)->material;
    wax.temperature = 350;
    wax.viscosity = 0.5;
    return wax;
}

Actor cube(const Material& material, const Vec3d& middle, std::size_t side = 8, const Vec3d& velocity = Vec3d::Zero()) {
    const Vec3d half = Vec3d::Constant(0.5 * kSpacing * double(side));
    Actor actor{std::make_shared<const Body>(bare_body(box_cells(side, side, side, kSpacing, -half), material))};
    actor.placement.translation() = middle;
    actor.velocity = velocity;
    return actor;
}

Obstacle box_at(const Vec3d& centre, const Vec3d& size, double friction = 0.5) {
    Obstacle obstacle;
    obstacle.shape = Cuboid{centre, size};
    obstacle.friction = friction;
    return obstacle;
}
Obstacle of_mesh(const Mesh& mesh, const Vec3d& at = Vec3d::Zero()) {
    Obstacle obstacle;
    MeshObstacle shape = make_mesh_obstacle(mesh, 1, 0, kAllThreads).value();
    shape.offset = at;
    obstacle.shape = shape;
    return obstacle;
}

Simulation begin(std::vector<Obstacle> obstacles, std::vector<Actor> actors, const Vec3d& gravity = {0, -9.81, 0}) {
    World world;
    world.gravity = gravity;
    world.obstacles = std::move(obstacles);
    return Simulation::create(std::move(world), std::move(actors), {}, kAllThreads).value();
}

void run(Simulation& simulation, int frames) {
    for (int f = 0; f < frames; ++f) simulation.advance(kAllThreads).value();
}

Box box_of_body(const Simulation& simulation, std::size_t body = 0) {
    Box box;
    const Vectors& positions = simulation.positions(body);
    for (std::size_t i = 0; i < positions.size(); ++i) box.extend(positions[i].cast<double>());
    return box;
}
Vec3d middle(const Simulation& simulation, std::size_t body) {
    const Vectors& positions = simulation.positions(body);
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < positions.size(); ++i) sum += positions[i].cast<double>();
    return sum / double(positions.size());
}

} // namespace

TEST(MpmWalls, AThinPlateStopsWhatFallsOnIt) {
    for (const double thickness : {0.001, 0.02, 0.04})
        for (const double speed : {0.0, 10.0, 60.0}) {
            Simulation simulation = begin({box_at({0, -thickness / 2, 0}, {4, thickness, 4})},
                                          {cube(cold(), {0, 0.2, 0}, 8, {0, -speed, 0})});
            double energy = simulation.energy(kAllThreads).total();
            for (int f = 0; f < 20; ++f) {
                run(simulation, 1);
                ASSERT_GE(box_of_body(simulation).min.y(), 0) << thickness << " " << speed << " " << f;
                EXPECT_LT(simulation.energy(kAllThreads).total(), 1.01 * energy) << thickness << " " << speed;
            }
        }
}

TEST(MpmWalls, ABlockStandsAtItsHeightOnAPlate) {
    Material material = cold();
    material.damping = 5;
    Simulation simulation = begin({box_at({0, -0.0005, 0}, {2, 0.001, 2})}, {cube(material, {0, 0.08, 0})});
    run(simulation, 90);
    EXPECT_NEAR(middle(simulation, 0).y(), 0.08, 0.25 * kSpacing);
    EXPECT_GE(box_of_body(simulation).min.y(), 0);
    EXPECT_NEAR(box_of_body(simulation).size().x(), 0.14, 0.1 * kSpacing);
}

TEST(MpmWalls, ASheetStopsMatterFromBothSides) {
    for (const bool turned : {false, true})
        for (const double side : {1.0, -1.0})
            for (const double speed : {2.0, 40.0}) {
                const Mesh sheet = turned ? meshes::turned_over(meshes::flat_sheet(3)) : meshes::flat_sheet(3);
                Simulation simulation =
                    begin({of_mesh(sheet)}, {cube(cold(), {0.1, 0.15 * side, 0.05}, 6, Vec3d(0, -speed * side, 0))},
                          Vec3d::Zero());
                for (int f = 0; f < 10; ++f) {
                    run(simulation, 1);
                    const Box box = box_of_body(simulation);
                    ASSERT_GE(std::min(box.min.y() * side, box.max.y() * side), 0) << turned << side << speed;
                }
            }
}

TEST(MpmWalls, TerrainIsStoodOn) {
    Simulation simulation = begin({of_mesh(meshes::terrain(24))}, {cube(melt(), {0.1, 0.25, 0.1}, 6)});
    run(simulation, 40);
    const Vectors& positions = simulation.positions(0);
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const Vec3d p = positions[i].cast<double>();
        ASSERT_GT(p.y(), meshes::terrain_height(p.x(), p.z()) - 0.01) << "quads cut the waves by less";
    }
}

TEST(MpmWalls, ATrayHoldsMelt) {
    for (const double thickness : {0.05, 0.01, 0.002}) {
        const double w = 0.14, t = thickness, height = 0.2;
        std::vector<Obstacle> tray = {box_at({0, -t / 2, 0}, {2 * w + 2 * t, t, 2 * w + 2 * t})};
        for (const double side : {-1.0, 1.0}) {
            tray.push_back(box_at({side * (w + t / 2), height / 2, 0}, {t, height, 2 * w + 2 * t}));
            tray.push_back(box_at({0, height / 2, side * (w + t / 2)}, {2 * w + 2 * t, height, t}));
        }
        Simulation simulation = begin(tray, {cube(melt(), {0, 0.1, 0})});
        run(simulation, 40);
        const Box box = box_of_body(simulation);
        EXPECT_GE(box.min.y(), 0) << t;
        EXPECT_LE(box.max.x(), w) << t;
        EXPECT_GE(box.min.x(), -w) << t;
        EXPECT_LE(box.max.z(), w) << t;
        EXPECT_GE(box.min.z(), -w) << t;
    }
}

TEST(MpmWalls, ATrayOfSheetsHoldsMeltAndARoomKeepsIt) {
    Mesh room = meshes::box_shell(0.14f, 2), tray = room;
    tray.face_offsets.clear();
    tray.corners.clear();
    tray.face_offsets.push_back(0);
    for (std::size_t f = 0; f + 1 < room.face_offsets.size(); ++f) { // all but the lid
        bool is_lid = true;
        for (Index c = room.face_offsets[f]; c < room.face_offsets[f + 1]; ++c)
            is_lid &= room.positions[room.corners[c]].y() > 0.13f;
        if (is_lid) continue;
        tray.corners.insert(tray.corners.end(), room.corners.begin() + room.face_offsets[f],
                            room.corners.begin() + room.face_offsets[f + 1]);
        tray.face_offsets.push_back(Index(tray.corners.size()));
    }
    for (const Mesh& mesh : {tray, room, meshes::turned_over(room)}) {
        Simulation simulation = begin({of_mesh(mesh)}, {cube(melt(), {0, -0.05, 0})});
        run(simulation, 30);
        const Box box = box_of_body(simulation);
        EXPECT_GE(box.min.minCoeff(), -0.14);
        EXPECT_LE(box.max.maxCoeff(), 0.14);
        EXPECT_LT(middle(simulation, 0).y(), -0.07) << "it falls and flows";
    }
}

TEST(MpmWalls, MatterOnBothSidesOfASheetIsNotOne) {
    Obstacle sheet = of_mesh(meshes::flat_sheet(1));
    sheet.friction = 0;
    Simulation simulation =
        begin({sheet}, {cube(cold(), {0, 0.041, 0}, 4, {1, 0, 0}), cube(cold(), {0, -0.041, 0}, 4)}, Vec3d::Zero());
    run(simulation, 12);
    EXPECT_NEAR(middle(simulation, 0).x(), 0.2, 0.01);
    EXPECT_NEAR(middle(simulation, 1).x(), 0, 0.002);
}

TEST(MpmWalls, AThinPaddlePushesWhatItMeets) {
    for (const double speed : {3.0, 30.0}) {
        Obstacle paddle = box_at({-0.12, 0, 0}, {0.002, 1, 1});
        paddle.motion.move = {{0, 0.2}, {Vec3d::Zero(), Vec3d(0.2 * speed, 0, 0)}, Vec3d::Zero()};
        Simulation simulation = begin({paddle}, {cube(cold(), Vec3d::Zero(), 6)}, Vec3d::Zero());
        for (int f = 1; f <= 12; ++f) {
            run(simulation, 1);
            ASSERT_GE(box_of_body(simulation).min.x(), -0.12 + speed * f / 60) << speed << " " << f;
        }
    }
}

TEST(MpmWalls, FrictionOnAThinPlateHoldsAndSlides) {
    for (const double degrees : {15.0, 35.0}) {
        const double angle = degrees * std::numbers::pi / 180;
        Simulation simulation = begin({box_at({0, -0.001, 0}, {8, 0.002, 8})}, {cube(cold(), {0, 0.081, 0})},
                                      9.81 * Vec3d(std::sin(angle), -std::cos(angle), 0));
        run(simulation, 20);
        const double from = middle(simulation, 0).x(), speed = simulation.momentum().linear.x() / 4.096;
        run(simulation, 30);
        const double way = middle(simulation, 0).x() - from;
        const double pull = 9.81 * (std::sin(angle) - 0.5 * std::cos(angle));
        if (degrees < 26)
            EXPECT_LT(std::abs(way), 0.003);
        else
            EXPECT_NEAR(way, speed * 0.5 + 0.5 * pull * 0.25, 0.1 * way);
    }
}

/// What cannot be felt is told before anything moves.
TEST(MpmWalls, WiresAndOtherModelsAreToldOf) {
    World world;
    world.obstacles.push_back(box_at(Vec3d::Zero(), {0.001, 0.001, 1}));
    world.obstacles.push_back(box_at(Vec3d::Zero(), {0.001, 1, 1}));
    world.obstacles.emplace_back().shape = Ball{Vec3d::Zero(), 0.004};
    world.obstacles.push_back(of_mesh(meshes::box_mesh({0, 0, 0}, {0.002f, 0.5f, 0.003f})));
    world.obstacles.emplace_back().shape = HalfSpace{};
    Material rubber = cold();
    rubber.model = MaterialModel::fem;
    const Actor matter = cube(cold(), Vec3d::Zero()), other = cube(rubber, Vec3d::Zero());
    std::vector<std::size_t> told;
    for (const SlenderObstacle& slender : find_slender_obstacles(world, std::span(&matter, 1))) {
        told.push_back(slender.obstacle);
        EXPECT_NE(slender.sentence("obstacle 'wire'").find("obstacle 'wire' is 0.0"), std::string::npos);
    }
    EXPECT_EQ(told, (std::vector<std::size_t>{0, 2, 3}));
    EXPECT_TRUE(find_slender_obstacles(world, std::span(&other, 1)).empty());
    EXPECT_EQ(why_models_do_not_meet(std::span(&matter, 1)), "");
    EXPECT_NE(why_models_do_not_meet(std::vector{matter, other}).find("pass through"), std::string::npos);
}

TEST(MpmWalls, SameBytesForAnyNumberOfThreadsAndWhenResumed) {
    const RunContext one(1), two(2);
    const auto made = [&] { return begin({of_mesh(meshes::terrain(12))}, {cube(melt(), {0, 0.12, 0}, 12)}); };
    Simulation a = made(), b = made();
    for (int f = 0; f < 6; ++f) {
        a.advance(one).value();
        b.advance(two).value();
    }
    EXPECT_EQ(a.save(), b.save());
    Simulation c = made();
    ASSERT_TRUE(c.restore(a.save()).ok());
    a.advance(one).value();
    c.advance(two).value();
    EXPECT_EQ(a.save(), c.save());
}

} // namespace filigree::mpm_walls_test
