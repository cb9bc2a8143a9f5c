#include "filigree/io/losses.h"

#include "filigree/mesh.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(Losses, PolygonsAreCutAndTheRestIsLeftOut) {
    EXPECT_EQ(cannot_hold("STL", {"UVs"}), "STL cannot hold UVs; left out.");
    EXPECT_EQ(cannot_hold("STL", {"UVs", "colours", "groups"}), "STL cannot hold UVs, colours and groups; left out.");
    EXPECT_EQ(cannot_hold("GLB", {kPolygonLoss}),
              "GLB cannot hold faces of more than three corners; cut into triangles. PLY and OBJ keep them.");
    EXPECT_EQ(cannot_hold("GLB", {kPolygonLoss, "groups"}),
              "GLB cannot hold groups; left out. Faces of more than three corners are cut into triangles; PLY and OBJ "
              "keep them.");
}

TEST(Losses, WhatIsPlayedMayBeOfTriangles) {
    EXPECT_EQ(losses_of_played({kPolygonLoss, "groups"}), std::vector<std::string>{"groups"});
    EXPECT_TRUE(losses_of_played({kPolygonLoss}).empty());
}

TEST(Losses, SmoothingGroupsAreNoLossBesideNormals) {
    Mesh mesh = make_wavy_cube({.resolution = 1});
    EXPECT_FALSE(needs_smoothing(mesh));
    mesh.smoothing.assign(mesh.face_count(), 0); // "s off", as most programs write
    EXPECT_FALSE(needs_smoothing(mesh));
    mesh.smoothing.front() = 1;
    EXPECT_TRUE(needs_smoothing(mesh));
    mesh.normals.values.assign(mesh.vertex_count(), Vec3f::UnitZ());
    EXPECT_FALSE(needs_smoothing(mesh));
}

} // namespace
} // namespace filigree
