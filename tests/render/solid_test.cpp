// Which surfaces hide all of their back faces.
#include "filigree/render/solid.h"

#include "filigree/mesh.h"

#include <algorithm>

#include <gtest/gtest.h>

using namespace filigree;

namespace {

struct Surface {
    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;

    bool is_solid() const { return filigree::is_solid(positions, triangles); }
    void turn_round() {
        for (Triangle& t : triangles) std::swap(t[0], t[1]);
    }
    void add(const Surface& other, const Vec3f& place, float scale) {
        const auto first = static_cast<Index>(positions.size());
        for (const Vec3f& p : other.positions) positions.push_back(scale * p + place);
        for (const Triangle& t : other.triangles) triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
};

Surface tetrahedron() {
    return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

/// Every triangle with corners of its own, as in an STL.
Surface soup(const Surface& from) {
    Surface result;
    for (const Triangle& t : from.triangles) {
        const auto first = static_cast<Index>(result.positions.size());
        for (const Index v : t) result.positions.push_back(from.positions[v]);
        result.triangles.push_back({first, first + 1, first + 2});
    }
    return result;
}

} // namespace

TEST(Solid, ClosedAndOutwardIsWhatItTakes) {
    Surface surface = tetrahedron();
    EXPECT_TRUE(surface.is_solid());
    EXPECT_TRUE(soup(surface).is_solid());
    surface.turn_round();
    EXPECT_FALSE(surface.is_solid()) << "inside out";
    surface = tetrahedron();
    std::swap(surface.triangles[1][0], surface.triangles[1][1]);
    EXPECT_FALSE(surface.is_solid()) << "one face turned";
    surface = tetrahedron();
    surface.triangles.pop_back();
    EXPECT_FALSE(surface.is_solid()) << "open";
    EXPECT_FALSE(Surface().is_solid());
}

TEST(Solid, EachPartCounts) {
    Surface two = tetrahedron();
    two.add(tetrahedron(), {0.1f, 0, 0}, 1); // through each other
    EXPECT_TRUE(two.is_solid());
    Surface hollow = tetrahedron(), cavity = tetrahedron();
    cavity.turn_round();
    hollow.add(cavity, {0.1f, 0.1f, 0.1f}, 0.3f);
    EXPECT_FALSE(hollow.is_solid()) << "a part that is inside out may stand outside as well";
}
