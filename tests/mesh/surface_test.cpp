// What algorithms see of a mesh: welded, triangles alone, none that repeats a vertex.
#include "filigree/mesh/surface.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

/// Two quads side by side that share no vertex; a triangle with two corners at one place; one that begins at -0, 0, 0.
/// Vertex 9 is in no face.
Mesh split_strip() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0},    {0, 1, 0}, {1, 0, 0}, {2, 0, 0},
                      {2, 1, 0}, {1, 1, 0}, {-0.f, 0, 0}, {5, 5, 5}, {3, 3, 0}};
    mesh.add_face(std::vector<Index>{0, 1, 2, 3});
    mesh.add_face(std::vector<Index>{4, 5, 6, 7});
    mesh.add_face(std::vector<Index>{2, 7, 10});
    mesh.add_face(std::vector<Index>{8, 10, 6});
    return mesh;
}

TEST(Surface, IsWeldedAndHasNoTriangleThatRepeatsAVertex) {
    const Surface surface = make_surface(split_strip(), kOneThread).value();
    EXPECT_EQ(surface.representative, (std::vector<Index>{0, 1, 2, 3, 1, 5, 6, 2, 0, 9, 10}));
    EXPECT_EQ(surface.vertex_count(), 11u);
    EXPECT_EQ(surface.place_count, 8u); // the one that no face uses among them
    EXPECT_EQ(surface.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {1, 5, 6}, {1, 6, 2}, {0, 10, 6}}));
    EXPECT_EQ(surface.source_face, (std::vector<Index>{0, 0, 1, 1, 3}));
}

TEST(Surface, OfNothingIsEmpty) {
    const Surface surface = make_surface(Mesh{}, kOneThread).value();
    EXPECT_EQ(surface.vertex_count(), 0u);
    EXPECT_EQ(surface.place_count, 0u);
    EXPECT_TRUE(surface.triangles.empty() && surface.source_face.empty());
}

TEST(Surface, CanBeCancelled) {
    const RunContext cancelled(1);
    cancelled.cancel();
    const Result<Surface> surface = make_surface(split_strip(), cancelled);
    ASSERT_FALSE(surface.ok());
    EXPECT_EQ(surface.error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
