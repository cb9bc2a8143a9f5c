#include "filigree/fracture.h"
#include "filigree/fracture/broken_model.h"

#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/restore.h"
#include "filigree/strip.h"
#include "threads.h"

#include <cstring>
#include <gtest/gtest.h>
#include <map>

namespace filigree {
namespace {

struct Case {
    Model model;
    FractureCells cells;
    FracturedMesh fractured;
    BrokenModel broken;
};

Case broken_ball(double roughness = 0.5) {
    const Mesh mesh = make_wavy_sphere({.resolution = 32});
    Model model = strip(mesh, {.base = 400}, kOneThread).value().model;
    FractureCells cells = make_fracture_cells(mesh, {.pieces = 12, .roughness = roughness}, kOneThread).value();
    FracturedMesh fractured = fracture(mesh, cells, {.pieces_are_cells = true}, kOneThread).value();
    BrokenModel broken = break_model(model, fractured, cells, 0.08, kOneThread).value();
    return {std::move(model), std::move(cells), std::move(fractured), std::move(broken)};
}

TEST(BrokenModel, IsAModel) {
    const Case ball = broken_ball();
    EXPECT_EQ(check_model(ball.broken.model), "");
    EXPECT_EQ(check_mesh(ball.broken.model.mesh), "");
    EXPECT_EQ(ball.broken.piece_of_driver.size(), ball.broken.model.driver().vertices.size());
    // At rest everything is where it was.
    const Restorer restorer = Restorer::create(ball.broken.model, {}, kOneThread).value();
    Pose rest = rest_pose(ball.broken.model);
    rest.gradients.assign(rest.positions.size(), Mat3f::Identity());
    const std::vector<Vec3f> restored = restorer.positions(rest, kOneThread).value();
    for (std::size_t v = 0; v < restored.size(); ++v)
        EXPECT_LT((restored[v] - ball.broken.model.mesh.positions[v]).norm(), 1e-6f);
}

TEST(BrokenModel, MovesAsTheUnbrokenOneUntilPiecesPart) {
    const Case ball = broken_ball();
    const std::unique_ptr<SpaceWarp> twist = make_twist(world_bounds(ball.model.mesh), Axis::z, 60);
    const Pose whole = warp_pose(*twist, ball.model, kOneThread),
               pose = warp_pose(*twist, ball.broken.model, kOneThread);
    const std::vector<Vec3f> before =
        Restorer::create(ball.model, {}, kOneThread).value().positions(whole, kOneThread).value();
    const std::vector<Vec3f> after =
        Restorer::create(ball.broken.model, {}, kOneThread).value().positions(pose, kOneThread).value();
    EXPECT_EQ(std::memcmp(before.data(), after.data(), before.size() * sizeof(Vec3f)), 0);
    for (std::size_t d = 0; d < pose.positions.size(); ++d)
        EXPECT_LT((after[ball.broken.model.driver().vertices[d]] - pose.positions[d]).norm(), 1e-5f);
    // Copies in several pieces are in one place, to the bit; points on cracks are where the warp takes them.
    std::map<Index, Vec3f> at;
    double worst_old = 0, worst_surface = 0, worst_inside = 0;
    for (std::size_t v = 0; v < ball.fractured.mesh.vertex_count(); ++v) {
        const auto [known, is_new] = at.try_emplace(ball.fractured.place[v], after[v]);
        EXPECT_EQ(std::memcmp(&known->second, &after[v], sizeof(Vec3f)), 0);
        const Vec3d exact = twist->position(ball.fractured.mesh.positions[v].cast<double>());
        double& w = v < before.size()                                                   ? worst_old
                    : ball.fractured.sources[v - before.size()].vertices[0] == kNoIndex ? worst_inside
                                                                                        : worst_surface;
        w = std::max(w, (after[v].cast<double>() - exact).norm());
    }
    EXPECT_LT(worst_old, 2e-4);
    EXPECT_LT(worst_surface, 1e-3);
    EXPECT_LT(worst_inside, 4e-3); // half the square of the way to a driver point, 0.08, times the twist
}

TEST(BrokenModel, EveryPieceMovesByItself) {
    const Case ball = broken_ball();
    Pose pose = rest_pose(ball.broken.model);
    pose.gradients.assign(pose.positions.size(), Mat3f::Identity());
    const auto shift = [](Index piece) { return Vec3f(float(piece), float(2 * piece), 0); };
    for (std::size_t d = 0; d < pose.positions.size(); ++d) pose.positions[d] += shift(ball.broken.piece_of_driver[d]);
    const std::vector<Vec3f> moved =
        Restorer::create(ball.broken.model, {}, kOneThread).value().positions(pose, kOneThread).value();
    for (std::size_t v = 0; v < ball.fractured.mesh.vertex_count(); ++v)
        EXPECT_LT((moved[v] - ball.fractured.mesh.positions[v] - shift(ball.fractured.piece_of_vertex[v])).norm(),
                  1e-5f);
}

TEST(BrokenModel, CracksThatNeverOpenedCanBeLeftOut) {
    const Case ball = broken_ball(0);
    Mesh mesh = ball.broken.model.mesh;
    std::vector<std::uint8_t> is_open(ball.fractured.cells_of_crack.size(), 0);
    is_open[0] = 1;
    drop_closed_cracks(mesh, ball.fractured.crack_of_face, is_open);
    EXPECT_EQ(check_mesh(mesh), "");
    std::size_t wanted = 0;
    for (const Index crack : ball.fractured.crack_of_face) wanted += crack == kNoIndex || crack == 0;
    EXPECT_EQ(mesh.face_count(), wanted);
    EXPECT_LT(wanted, ball.fractured.mesh.face_count());
}

TEST(BrokenModel, CracksOpenWhereCopiesPart) {
    const Case ball = broken_ball(0);
    Pose rest = rest_pose(ball.broken.model), moved = rest;
    const auto open = [&](const Pose& pose) {
        return open_cracks(ball.broken.model, ball.broken.piece_of_driver, ball.broken.driver_is_on_crack,
                           ball.fractured.cells_of_crack, std::vector<Pose>{rest, pose, rest}, 1e-3);
    };
    for (const std::uint8_t is_open : open(rest)) EXPECT_EQ(is_open, 0);
    for (std::size_t d = 0; d < moved.positions.size(); ++d)
        if (ball.broken.piece_of_driver[d] == 3) moved.positions[d] += Vec3f(1, 0, 0);
    const std::vector<std::uint8_t> opened = open(moved);
    for (std::size_t crack = 0; crack < opened.size(); ++crack) {
        const auto& [i, j] = ball.fractured.cells_of_crack[crack];
        EXPECT_EQ(opened[crack] != 0, i == 3 || j == 3);
    }
}

TEST(BrokenModel, RefusesOtherMeshes) {
    const Case ball = broken_ball(0);
    const Mesh other = make_wavy_cube({.resolution = 8});
    EXPECT_EQ(break_model(strip(other, {}, kOneThread).value().model, ball.fractured, ball.cells, 0.1, kOneThread)
                  .error()
                  .code,
              ErrorCode::unsuitable);
}

} // namespace
} // namespace filigree
