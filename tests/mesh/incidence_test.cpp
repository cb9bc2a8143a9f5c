#include "filigree/mesh/incidence.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

std::vector<Index> list(const IndexLists& lists, std::size_t id) { return {lists[id].begin(), lists[id].end()}; }

TEST(Incidence, ListsCornersAndTrianglesAscending) {
    const std::vector<Triangle> triangles = {{4, 1, 2}, {2, 1, 0}, {4, 4, 2}};
    const std::vector<Index> corners = {4, 1, 2, 2, 1, 0, 4, 4, 2};
    const IndexLists corners_at = corners_at_vertices(corners, 5), triangles_at = triangles_at_vertices(triangles, 5);
    ASSERT_EQ(corners_at.size(), 5u);
    ASSERT_EQ(triangles_at.size(), 5u);
    EXPECT_EQ(list(corners_at, 2), (std::vector<Index>{2, 3, 8}));
    EXPECT_EQ(list(triangles_at, 2), (std::vector<Index>{0, 1, 2}));
    EXPECT_EQ(list(triangles_at, 4), (std::vector<Index>{0, 2, 2})); // the last uses it twice
    EXPECT_TRUE(list(corners_at, 3).empty() && list(triangles_at, 3).empty());
}

TEST(Incidence, OfNothingIsAnEmptyListAVertex) {
    EXPECT_EQ(IndexLists{}.size(), 0u);
    EXPECT_EQ(triangles_at_vertices({}, 2).size(), 2u);
    EXPECT_TRUE(triangles_at_vertices({}, 2)[1].empty());
    EXPECT_EQ(corners_at_vertices({}, 0).size(), 0u);
}

} // namespace
} // namespace filigree
