// Public calls of the layer look at the meshes they are given.
#include "broken_meshes.h"
#include "filigree/mesh.h"
#include "filigree/mesh/edges.h"
#include "filigree/mesh/normals.h"
#include "filigree/mesh/surface.h"
#include "filigree/mesh/surfels.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(CheckedMesh, WhatIsBrokenIsRefusedInOneSentence) {
    const Mesh sound = make_box(Vec3d::Zero(), Vec3d::Ones());
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return make_surface(m, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return make_surfels(m, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return find_regular_patches(m, 3, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([&](const Mesh& m) { return mesh_distance(m, sound, 10, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([&](const Mesh& m) { return mesh_distance(sound, m, 10, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([&](const Mesh& m) { return vertex_distance(sound, m, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED(
        [&](const Mesh& m) { return distances_to_surface(sound, m, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([&](const Mesh& m) { return edge_strains(m, m); });
}

TEST(CheckedMesh, TheSentenceBeginsWithTheNameThatIsGiven) {
    EXPECT_FALSE(mesh_error(make_box(Vec3d::Zero(), Vec3d::Ones())));
    const Error error = *mesh_error(broken_meshes()[0].second, "The driver");
    EXPECT_EQ(error.code, ErrorCode::usage);
    EXPECT_EQ(error.message, "The driver is inconsistent: Corner 5 refers to a vertex that is not there.");
}

TEST(CheckedMesh, OneThatWasMovedFromIsEmpty) {
    Mesh mesh = moved_from();
    EXPECT_EQ(mesh.face_count(), 0u);
    EXPECT_EQ(mesh.vertex_count(), 0u);
    EXPECT_EQ(check_mesh(mesh), "");
    EXPECT_TRUE(bounds(mesh).empty());
    EXPECT_TRUE(triangulate(mesh).triangles.empty());
    EXPECT_TRUE(vertex_normals(mesh, mesh.positions, kOneThread).empty());
    EXPECT_EQ(analyse_topology(mesh, kOneThread).faces, 0u);
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.add_face(std::array<Index, 3>{0, 1, 2});
    EXPECT_EQ(mesh.face_count(), 1u);
    EXPECT_EQ(check_mesh(mesh), "");
    mesh.face_offsets.clear();
    EXPECT_EQ(check_mesh(mesh), "There are corners, and no face offsets.");

    IndexLists lists = corners_at_vertices(std::array<Index, 3>{0, 1, 2}, 3);
    const IndexLists taken = std::move(lists);
    EXPECT_EQ(lists.size(), 0u); // NOLINT: what is left of it is the point
}

TEST(CheckedMesh, MoreTrianglesThanCanBeListedAreAnError) {
    EXPECT_FALSE(too_many_triangles(kMostListedTriangles));
    const std::optional<Error> error = too_many_triangles(kMostListedTriangles + 1);
    ASSERT_TRUE(error);
    EXPECT_EQ(error->code, ErrorCode::unsuitable);
    EXPECT_NE(error->message.find("1431655765"), std::string::npos) << error->message;
}

} // namespace
} // namespace filigree
