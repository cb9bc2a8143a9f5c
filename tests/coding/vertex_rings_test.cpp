// Rings of neighbours: after splits they are those of the map that splits make, also where rings are long.
#include "filigree/coding/vertex_rings.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <random>
#include <set>

using namespace filigree;

namespace {

/// Two vertices, and so many in a ring between them.
std::vector<Triangle> bipyramid(Index sides) {
    std::vector<Triangle> triangles;
    for (Index i = 0; i < sides; ++i) {
        const Index a = 2 + i, b = 2 + (i + 1) % sides;
        triangles.push_back({0, a, b});
        triangles.push_back({1, b, a});
    }
    return triangles;
}

std::multiset<Triangle> turned(std::vector<Triangle> triangles) { // the lowest corner first
    for (Triangle& t : triangles) std::ranges::rotate(t, std::ranges::min_element(t));
    return {triangles.begin(), triangles.end()};
}

/// The same on triangles alone: those from u that lie between its neighbours `begin` to `begin` + `sector`.
void split(std::vector<Triangle>& triangles, Index u, Index v, const std::vector<Index>& ring, std::size_t begin,
           std::size_t sector) {
    const auto at = [&](std::size_t k) { return ring[(begin + k) % ring.size()]; };
    for (std::size_t k = 1; k <= sector; ++k)
        for (Triangle& t : triangles)
            for (std::size_t c = 0; c < 3; ++c)
                if (t[c] == u && t[(c + 1) % 3] == at(k) && t[(c + 2) % 3] == at(k - 1)) t[c] = v;
    triangles.push_back({u, v, at(0)});
    triangles.push_back({u, at(sector), v});
}

} // namespace

TEST(VertexRings, SplitsKeepTheMapThatTrianglesMake) {
    for (const Index sides : {3u, 5u, 12u, 40u, 56u, 57u, 100u}) {
        std::mt19937 random(sides);
        std::vector<Triangle> triangles = bipyramid(sides);
        const ClosedMap map = map_of(triangles, std::vector<bool>(sides + 2));
        VertexRings rings(map, std::vector<FinePlace>(sides + 2), 0);
        ASSERT_EQ(turned(rings.triangles()), turned(triangles));
        for (Index trial = 0; trial < 400; ++trial) {
            const Index u = trial % 3 ? Index(random() % 3) : Index(random() % rings.vertex_count()); // some grow long
            if (!rings.is_kept(u) || rings.size(u) < 3) continue;
            const std::vector<Index> ring(rings.ends(u), rings.ends(u) + rings.size(u));
            const std::size_t begin = random() % ring.size(),
                              sector = 1 + random() % std::min<std::size_t>(2, ring.size() - 1);
            const auto v = static_cast<Index>(rings.vertex_count());
            rings.add(1);
            ASSERT_TRUE(rings.split(u, v, begin, sector));
            split(triangles, u, v, ring, begin, sector);
            ASSERT_EQ(turned(rings.triangles()), turned(triangles)) << sides << " sides, split " << trial;
        }
    }
}

TEST(ClosedMap, OppositesOfTrianglesAlone) {
    const ClosedMap map = map_of(bipyramid(300), std::vector<bool>(302));
    for (Index h = 0; h < map.opposite.size(); ++h) {
        ASSERT_NE(map.opposite[h], kNoIndex);
        EXPECT_EQ(map.opposite[map.opposite[h]], h);
        EXPECT_EQ(map.origin(map.opposite[h]), map.origin(next_half_edge(h)));
    }
    const ClosedMap open = map_of({{0, 1, 2}}, std::vector<bool>(3));
    EXPECT_EQ(std::ranges::count(open.opposite, kNoIndex), 3);
}
