#include "broken_meshes.h"
#include "filigree/pose.h"

#include "filigree/mesh.h"
#include "filigree/strip.h"
#include "threads.h"

#include <cmath>
#include <gtest/gtest.h>

namespace filigree {
namespace {

/// A bar along x, 4 long, whose ends are taken: one stays, the other goes 1 along y.
std::vector<HandleRegion> ends(double move) {
    return {{.name = "foot", .box = Box{Vec3d(-9, -9, -9), Vec3d(-1.9, 9, 9)}},
            {.name = "head", .box = Box{Vec3d(1.9, -9, -9), Vec3d(9, 9, 9)}, .move = Vec3d(0, move, 0)}};
}

Error refusal(const Mesh& mesh, const std::vector<HandleRegion>& handles) {
    return move_by_handles(mesh, handles, kAllThreads).error();
}

TEST(HandleRegions, EndsGoWhereTheyAreSent) {
    const Mesh bar = make_bar({.resolution = 4});
    const Mesh moved = move_by_handles(bar, ends(1), kAllThreads).value();
    for (Index v = 0; v < bar.vertex_count(); ++v) {
        const Vec3f way = moved.positions[v] - bar.positions[v];
        const float x = bar.positions[v].x();
        EXPECT_TRUE(x >= -1.9f || way.norm() < 1e-5f);
        EXPECT_TRUE(x <= 1.9f || (way - Vec3f(0, 1, 0)).norm() < 1e-5f);
        EXPECT_LT(way.norm(), 1.5f);
    }
}

TEST(HandleRegions, APartOfAHandleGoesAPartOfTheWay) {
    HandleRegion handle = ends(3)[1];
    handle.rotation = Eigen::AngleAxisd(0.6, Vec3d::UnitX());
    const HandleRegion half = handle.part(0.5), none = handle.part(0);
    EXPECT_EQ(half.move, Vec3d(0, 1.5, 0));
    EXPECT_EQ(half.rotation.angle(), 0.3);
    EXPECT_EQ(half.rotation.axis(), Vec3d::UnitX());
    EXPECT_EQ(half.name, handle.name);
    EXPECT_TRUE(none.move.isZero(0) && none.rotation.angle() == 0);
    EXPECT_EQ(handle.part(1).move, handle.move);
}

TEST(HandleRegions, ARegionTurnsAboutItsMiddleOrTheCentreGiven) {
    const Mesh bar = make_bar({.resolution = 4});
    std::vector<HandleRegion> handles = ends(0);
    handles[1].rotation = Eigen::AngleAxisd(0.5, Vec3d::UnitX());
    const Mesh turned = move_by_handles(bar, handles, kAllThreads).value();
    handles[1].centre = Vec3d(0, 1, 0);
    const Mesh swung = move_by_handles(bar, handles, kAllThreads).value();
    for (Index v = 0; v < bar.vertex_count(); ++v) {
        if (bar.positions[v].x() < 1.9f) continue;
        const Vec3d p = bar.positions[v].cast<double>();
        EXPECT_LT((handles[1].rotation * p - turned.positions[v].cast<double>()).norm(), 1e-5);
        const Vec3d about = *handles[1].centre + handles[1].rotation * (p - *handles[1].centre);
        EXPECT_LT((about - swung.positions[v].cast<double>()).norm(), 1e-5);
    }
}

TEST(HandleRegions, TheDriverFollowsTheSameHandles) {
    const Mesh bar = make_bar({.resolution = 8});
    const Model model = strip(bar, {.base = 100}, kAllThreads).value().model;
    const Pose pose = pose_by_handles(model, ends(1), kAllThreads).value();
    const std::vector<Vec3f> rest = driver_positions(model);
    ASSERT_EQ(pose.positions.size(), rest.size());
    for (Index v = 0; v < rest.size(); ++v)
        EXPECT_TRUE(rest[v].x() <= 1.9f || (pose.positions[v] - rest[v] - Vec3f(0, 1, 0)).norm() < 1e-5f);
}

TEST(HandleRegions, VerticesAtOnePlaceMoveAsOne) {
    Mesh seam; // two triangles whose common edge is there twice
    seam.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    seam.add_face(std::array<Index, 3>{0, 1, 2});
    seam.add_face(std::array<Index, 3>{3, 4, 5});
    const Mesh moved = move_by_handles(seam, {{{.vertices = {1}, .move = Vec3d(0, 0, 1)}}}, kAllThreads).value();
    EXPECT_EQ(moved.positions[1], moved.positions[3]);
    const Error apart = refusal(seam, {{.vertices = {1}}, {.vertices = {3}, .move = Vec3d(0, 0, 1)}});
    EXPECT_EQ(apart.code, ErrorCode::usage);
    EXPECT_NE(apart.message.find("vertices 1 and 3"), std::string::npos);
}

TEST(HandleRegions, SayWhichHandleIsWrong) {
    const Mesh bar = make_bar({.resolution = 4});
    const Error empty = refusal(bar, {{.sphere = std::pair(Vec3d(9, 9, 9), 1.0)}});
    EXPECT_TRUE(empty.message.starts_with("handle 1 holds no vertex")) << empty.message;
    const Error unknown = refusal(bar, {{.name = "head", .vertices = {Index(bar.vertex_count())}}});
    EXPECT_TRUE(unknown.message.starts_with("handle 'head' names vertex")) << unknown.message;
    const Error shared = refusal(bar, {{.vertices = {0, 1}}, {.vertices = {1}}});
    EXPECT_TRUE(shared.message.starts_with("handle 2 shares a vertex")) << shared.message;
}

TEST(HandleRegions, ManyNamedVerticesHoldTheNearestOfTheDriver) {
    const Mesh bar = make_bar({.resolution = 24});
    const Model model = strip(bar, {.base = 2000}, kAllThreads).value().model;
    const std::vector<Vec3f> driver = driver_positions(model);
    HandleRegion named{.move = Vec3d(0, 1, 0)};
    std::vector<bool> is_held(driver.size());
    for (Index v = 0; v < bar.vertex_count(); ++v) {
        if (bar.positions[v].x() < 1) continue;
        named.vertices.push_back(v);
        Index best = 0;
        for (Index d = 1; d < driver.size(); ++d)
            if ((driver[d] - bar.positions[v]).squaredNorm() < (driver[best] - bar.positions[v]).squaredNorm())
                best = d;
        is_held[best] = true;
    }
    const std::vector<HandleRegion> handles = {ends(0)[0], named};
    const Pose pose = pose_by_handles(model, handles, kAllThreads).value();
    for (Index d = 0; d < driver.size(); ++d)
        EXPECT_TRUE(!is_held[d] || (pose.positions[d] - driver[d] - Vec3f(0, 1, 0)).norm() < 1e-5f) << d;

    std::vector<HandleRegion> often = handles; // two million names: seconds by trying every driver vertex for each
    for (int k = 0; k < 400; ++k)
        often[1].vertices.insert(often[1].vertices.end(), named.vertices.begin(), named.vertices.end());
    EXPECT_EQ(pose_by_handles(model, often, kAllThreads).value().positions, pose.positions);
    const RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(pose_by_handles(model, often, cancelled).error().code, ErrorCode::cancelled);
    EXPECT_EQ(move_by_handles(bar, handles, cancelled).error().code, ErrorCode::cancelled);
}

TEST(HandleRegions, WhatIsBrokenIsRefused) {
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return move_by_handles(m, ends(1), kOneThread); });
}

} // namespace
} // namespace filigree
