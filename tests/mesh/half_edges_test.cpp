#include "filigree/mesh/half_edges.h"

#include "filigree/mesh/shapes.h"
#include "remesh/manifold_check.h"

namespace filigree_test {
namespace {

TEST(HalfEdges, EveryHalfEdgeIsThereOnceBesideItsEdgesOthers) {
    std::mt19937 random(2);
    std::vector<Triangle> triangles;
    while (triangles.size() < 200) {
        const Triangle t = {Index(random() % 15), Index(random() % 15), Index(random() % 15)};
        if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
    }
    std::map<std::pair<Index, Index>, std::vector<Index>> expected;
    for (Index h = 0; h < 600; ++h)
        expected[std::minmax(half_edge_start(triangles, h), half_edge_end(triangles, h))].push_back(h);
    const std::vector<Index> sorted = half_edges_by_edge(triangles, 15);
    auto edge = expected.begin();
    for_each_edge(triangles, sorted, [&](std::span<const Index> half_edges) {
        EXPECT_EQ(std::vector<Index>(half_edges.begin(), half_edges.end()), edge->second);
        ++edge;
    });
    EXPECT_EQ(edge, expected.end());
}

TEST(HalfEdges, OppositesRunBackAndFansAreVertices) {
    Mesh mesh;
    append(mesh, make_wavy_plane({.resolution = 5}));
    append(mesh, make_torus({.resolution = 5}), {9, 0, 0});
    append(mesh, make_bar({.resolution = 2}), {0, 9, 0});
    const ManifoldSurface surface = manifold(mesh);
    const std::vector<Index> opposite = opposite_half_edges(surface.triangles, surface.positions.size());
    std::size_t borders = 0;
    for (Index h = 0; h < opposite.size(); ++h) {
        EXPECT_EQ(next_half_edge(previous_half_edge(h)), h);
        EXPECT_EQ(half_edge_end(surface.triangles, h), half_edge_start(surface.triangles, next_half_edge(h)));
        borders += opposite[h] == kNoIndex;
        if (opposite[h] == kNoIndex) continue;
        EXPECT_EQ(opposite[opposite[h]], h);
        EXPECT_EQ(half_edge_start(surface.triangles, h), half_edge_end(surface.triangles, opposite[h]));
        EXPECT_EQ(half_edge_end(surface.triangles, h), half_edge_start(surface.triangles, opposite[h]));
    }
    EXPECT_EQ(borders, 20u);
    EXPECT_EQ(components(opposite).count, 3u);
    const Labels fan = fans(opposite);
    EXPECT_EQ(fan.count, surface.positions.size());
    std::map<Index, Index> vertex;
    for (Index h = 0; h < opposite.size(); ++h) {
        const Index start = half_edge_start(surface.triangles, h);
        EXPECT_EQ(vertex.try_emplace(fan.of[h], start).first->second, start);
    }
}

TEST(HalfEdges, NoTriangles) {
    EXPECT_TRUE(half_edges_by_edge({}, 0).empty());
    EXPECT_TRUE(opposite_half_edges({}, 7).empty());
    EXPECT_EQ(fans({}).count + components({}).count, 0u);
}

} // namespace
} // namespace filigree_test
