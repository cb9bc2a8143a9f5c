#include "filigree/mesh/edges.h"
#include "filigree/remesh/manifold_surface.h"

#include "filigree/mesh.h"
#include "remesh/manifold_check.h"

namespace filigree_test {
namespace {

std::vector<Index> list(std::span<const Index> items) { return {items.begin(), items.end()}; }

TEST(Edges, EveryHalfEdgeIsThereOnceBesideItsEdgesOthers) {
    std::mt19937 random(2);
    std::vector<Triangle> triangles;
    while (triangles.size() < 200) {
        const Triangle t = {Index(random() % 15), Index(random() % 15), Index(random() % 15)};
        if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
    }
    std::map<std::pair<Index, Index>, std::vector<Index>> expected;
    for (Index h = 0; h < 600; ++h)
        expected[std::minmax(half_edge_start(triangles, h), half_edge_end(triangles, h))].push_back(h);
    const IndexLists edges = edges_of(triangles, 15);
    ASSERT_EQ(edges.size(), expected.size());
    auto wanted = expected.begin();
    for (const std::span<const Index> edge : edges) {
        EXPECT_EQ(list(edge), wanted->second);
        EXPECT_EQ(std::pair(edge_ends(triangles, edge)[0], edge_ends(triangles, edge)[1]), wanted->first);
        ++wanted;
    }
}

TEST(Edges, OppositesRunBackAndFansAreVertices) {
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

TEST(Edges, BalanceCountsTheWaysAndLoopsAreLeftOut) {
    const std::vector<Triangle> triangles = {{2, 0, 1}, {0, 2, 3}, {0, 2, 1}, {3, 3, 1}};
    std::vector<std::array<int, 4>> edges;
    for (const std::span<const Index> edge : edges_of(triangles, 4)) {
        const auto [low, high] = edge_ends(triangles, edge);
        edges.push_back({int(low), int(high), int(edge.size()), edge_balance(triangles, edge)});
    }
    EXPECT_EQ(edges, (std::vector<std::array<int, 4>>{
                         {0, 1, 2, 0}, {0, 2, 3, 1}, {0, 3, 1, -1}, {1, 2, 2, 0}, {1, 3, 2, 0}, {2, 3, 1, 1}}));
}

TEST(Edges, OfPolygonsAreNamedAsTheyAreGiven) {
    const std::vector<std::array<Index, 4>> quads = {{0, 1, 4, 3}, {1, 2, 5, 4}};
    const IndexLists edges = edges_from(6, [&](const auto& add) {
        for (Index h = 0; h < 8; ++h) add(quads[h / 4][h % 4], quads[h / 4][(h + 1) % 4], 10 + h);
    });
    ASSERT_EQ(edges.size(), 7u);
    EXPECT_EQ(list(edges[0]), (std::vector<Index>{10}));     // 0 1
    EXPECT_EQ(list(edges[3]), (std::vector<Index>{11, 17})); // 1 4, after 0 3 and 1 2
}

TEST(Edges, NeighboursAreNotOneFaceTwice) {
    const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 2, 1}, {3, 4, 5}, {4, 3, 6}};
    const IndexLists edges = edges_of(triangles, 7);
    EXPECT_TRUE(is_one_face_twice(triangles, edges[0]));
    const std::vector<Index> neighbour = neighbour_half_edges(triangles, edges);
    EXPECT_EQ(std::ranges::count(neighbour, kNoIndex), 10);
    EXPECT_EQ(neighbour[6], 9u);
    EXPECT_EQ(neighbour[9], 6u);
    EXPECT_EQ(opposite_half_edges(triangles, 7)[0], 5u);
}

TEST(Edges, CornersOfPolygonsGoRoundTheirFace) {
    const std::vector<Index> offsets = {0, 3, 3, 7};
    const PolygonCorners polygons(offsets);
    ASSERT_EQ(polygons.count(), 7u);
    for (Index c = 0; c < 7; ++c) {
        EXPECT_EQ(polygons.face(c), c < 3 ? 0u : 2u);
        EXPECT_EQ(polygons.size(c), c < 3 ? 3u : 4u);
        EXPECT_EQ(polygons.previous(polygons.next(c)), c);
    }
    EXPECT_EQ(polygons.next(2), 0u);
    EXPECT_EQ(polygons.next(6), 3u);
    EXPECT_EQ(PolygonCorners().count(), 0u);
}

TEST(Edges, ListsCornersAndTrianglesAscending) {
    const std::vector<Triangle> triangles = {{4, 1, 2}, {2, 1, 0}, {4, 4, 2}};
    const std::vector<Index> corners = {4, 1, 2, 2, 1, 0, 4, 4, 2};
    const IndexLists corners_at = corners_at_vertices(corners, 5), triangles_at = triangles_at_vertices(triangles, 5);
    ASSERT_EQ(corners_at.size(), 5u);
    ASSERT_EQ(triangles_at.size(), 5u);
    EXPECT_EQ(list(corners_at[2]), (std::vector<Index>{2, 3, 8}));
    EXPECT_EQ(list(triangles_at[2]), (std::vector<Index>{0, 1, 2}));
    EXPECT_EQ(list(triangles_at[4]), (std::vector<Index>{0, 2, 2})); // the last uses it twice
    EXPECT_TRUE(corners_at[3].empty() && triangles_at[3].empty());
    EXPECT_EQ(triangles_at_vertices({}, 2).size(), 2u);
    EXPECT_TRUE(triangles_at_vertices({}, 2)[1].empty());
    EXPECT_EQ(corners_at_vertices({}, 0).size(), 0u);
}

TEST(Edges, NoTriangles) {
    EXPECT_EQ(edges_of({}, 0).size(), 0u);
    EXPECT_EQ(edges_of({}, 7).size(), 0u);
    EXPECT_TRUE(opposite_half_edges({}, 7).empty());
    EXPECT_EQ(fans({}).count + components({}).count, 0u);
}

} // namespace
} // namespace filigree_test
