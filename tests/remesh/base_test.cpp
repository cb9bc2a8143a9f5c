// The base: triangles decimated to a count, then paired to quads.
#include "filigree/remesh/base_quads.h"
#include "filigree/remesh/base_triangles.h"
#include "prepared.h"

namespace filigree {
namespace {

using namespace filigree_test;

std::vector<Mesh> shapes() {
    return {bumpy_torus(), ridged_sheet(), plain_cube(), machined_part(), make_wavy_sphere({.resolution = 24})};
}

/// Triangles of each part of the surface that features and borders cut out.
std::vector<std::size_t> region_sizes(const SurfaceMap& map) {
    std::vector<Index> parent(map.slot_count());
    for (Index s = 0; s < parent.size(); ++s) parent[s] = s;
    const auto root = [&](Index s) {
        while (parent[s] != s) s = parent[s] = parent[parent[s]];
        return s;
    };
    for (Index h = 0; h < 3 * map.slot_count(); ++h)
        if (!map.is_removed(h / 3) && !map.is_feature(h)) parent[root(h / 3)] = root(map.twin(h) / 3);
    std::map<Index, std::size_t> sizes;
    for (Index s = 0; s < parent.size(); ++s)
        if (!map.is_removed(s)) ++sizes[root(s)];
    std::vector<std::size_t> result;
    for (const auto& [part, size] : sizes) result.push_back(size);
    return result;
}

/// What must be true of every base: triangles covered once, sides shared, corners where the vertices are.
void expect_patches(const SurfaceMap& map, const BaseQuads& base, const Prepared& on) {
    std::map<Index, int> covered; // quarters or thirds when halved, else once
    std::map<std::pair<Index, Index>, std::size_t> sides;
    std::vector<std::optional<Vec3d>> place(base.kinds.size());
    for (const BaseQuad& quad : base.quads) {
        for (const Index slot : quad.slots)
            if (slot != kNoIndex) {
                ASSERT_FALSE(map.is_removed(slot));
                ++covered[slot];
            }
        ASSERT_EQ((std::set<Index>(quad.vertices.begin(), quad.vertices.end()).size()), 4u);
        for (std::size_t k = 0; k < 4; ++k) {
            const Index v = quad.vertices[k];
            ASSERT_LT(v, base.kinds.size());
            ASSERT_TRUE((sides.emplace(std::pair(v, quad.vertices[(k + 1) % 4]), 0).second)) << "a side twice one way";
            const TrianglePoint at = quad.at(k == 1 || k == 2, k >= 2);
            ASSERT_TRUE(at.triangle == quad.slots[0] || at.triangle == quad.slots[1]);
            const Vec3d here = map.original_position(map.trace(at));
            if (!place[v]) place[v] = here;
            ASSERT_LT((*place[v] - here).norm(), 1e-5 * on.diagonal) << "patches disagree about vertex " << v;
            if (quad.features[k]) {
                ASSERT_NE(base.kinds[v], VertexKind::inside);
                ASSERT_LT(on.distance_to_curves(here), 1e-6 * on.diagonal);
                const TrianglePoint halfway = quad.at(k == 1 ? 1 : k == 3 ? 0 : 0.5, k == 0 ? 0 : k == 2 ? 1 : 0.5);
                ASSERT_LT(on.distance_to_curves(map.original_position(map.trace(halfway))), 1e-6 * on.diagonal);
            }
        }
    }
    ASSERT_EQ(covered.size(), map.triangle_count()) << "all triangles are covered";
    for (const auto& [slot, times] : covered) ASSERT_EQ(times == 1, !base.halved) << "slot " << slot;
    ASSERT_TRUE(std::ranges::all_of(place, [](const auto& p) { return p.has_value(); })) << "a vertex without a patch";
    // Euler number: vertices, sides as undirected pairs, patches
    std::set<std::pair<Index, Index>> edges;
    for (const auto& [ends, unused] : sides) edges.insert(std::minmax(ends.first, ends.second));
    EXPECT_EQ(std::int64_t(base.kinds.size()) - std::int64_t(edges.size()) + std::int64_t(base.quads.size()),
              on.topology().euler);
}

TEST(BaseTriangles, ReachTheCount) {
    for (const Mesh& mesh : shapes())
        for (const std::size_t wanted : {200, 600, 3000}) { // the last refines all of these first
            const Prepared on(mesh, wanted / 2);
            SurfaceMap map = on.map();
            ASSERT_TRUE(make_base_triangles(map, {.triangles = wanted}, kOneThread).ok());
            ASSERT_NO_FATAL_FAILURE(expect_sound(map, on));
            ASSERT_NO_FATAL_FAILURE(expect_continuous(map, on));
            EXPECT_LE(map.triangle_count(), wanted) << wanted;
            EXPECT_GE(double(map.triangle_count()), 0.95 * double(wanted));
            for (Index v = 0; v < map.vertex_count(); ++v)
                EXPECT_TRUE(map.is_vertex_removed(v) || map.kind(v) != VertexKind::inside || map.valence(v) >= 3);
        }
}

TEST(BaseTriangles, KeepEveryCorner) {
    for (const Mesh& mesh : {plain_cube(), machined_part(), ridged_sheet()}) {
        const Prepared on(mesh, 50);
        SurfaceMap map = on.map();
        ASSERT_TRUE(make_base_triangles(map, {.triangles = 100}, kOneThread).ok());
        for (Index v = 0; v < on.kinds.size(); ++v)
            if (on.kinds[v] == VertexKind::corner) {
                ASSERT_FALSE(map.is_vertex_removed(v));
                EXPECT_EQ(map.position(v), on.surface.positions[v]);
            }
    }
}

TEST(BaseTriangles, KeepTheTopologyHoweverFewAreWanted) {
    const Mesh ring = make_torus({.resolution = 12, .amplitude = 0, .thickness = 0.1}); // loops of few edges
    for (const Mesh& mesh :
         {ring, bumpy_torus(), ridged_sheet(), machined_part(), make_wavy_sphere({.resolution = 24})}) {
        const Prepared on(mesh, 4, 180);
        SurfaceMap map = on.map();
        ASSERT_TRUE(make_base_triangles(map, {.triangles = 4}, kOneThread).ok());
        ASSERT_NO_FATAL_FAILURE(expect_sound(map, on));
        EXPECT_LT(map.triangle_count(), 200u);
    }
}

TEST(BaseTriangles, StandForAboutTheirOwnArea) {
    const Prepared on(make_wavy_sphere({.resolution = 48, .frequency = 3, .amplitude = 0.1}), 250);
    SurfaceMap map = on.map();
    ASSERT_TRUE(make_base_triangles(map, {.triangles = 500}, kOneThread).ok());
    double covered = 0, area = 0;
    for (Index s = 0; s < map.slot_count(); ++s) {
        if (map.is_removed(s)) continue;
        covered += map.covered_area(s);
        area += map.area(s);
        EXPECT_LT(map.covered_area(s), 6 * map.area(s));
    }
    EXPECT_NEAR(covered, area_of(on.surface), 1e-9 * covered);
    EXPECT_GT(area, 0.9 * covered);
}

TEST(BaseTriangles, EdgeCases) {
    // one triangle: its three corners stay
    const Prepared triangle(triangle_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}));
    SurfaceMap map = triangle.map();
    ASSERT_TRUE(make_base_triangles(map, {.triangles = 1}, kOneThread).ok());
    ASSERT_NO_FATAL_FAILURE(expect_sound(map, triangle));
    // a tetrahedron of which fewer than four triangles are wanted
    const Prepared four(
        triangle_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}));
    SurfaceMap small = four.map();
    ASSERT_TRUE(make_base_triangles(small, {.triangles = 2}, kOneThread).ok());
    ASSERT_NO_FATAL_FAILURE(expect_sound(small, four));
    EXPECT_GE(small.triangle_count(), 4u);
}

TEST(BaseTriangles, Cancelled) {
    const Prepared on(make_ball({0, 0, 0}, 1));
    SurfaceMap map = on.map();
    const RunContext context(1);
    context.cancel();
    const Status made = make_base_triangles(map, {.triangles = 100}, context);
    ASSERT_FALSE(made.ok());
    EXPECT_EQ(made.error().code, ErrorCode::cancelled);
}

TEST(BaseQuads, CoverEveryTriangleOnce) {
    for (const Mesh& mesh : shapes())
        for (const bool halve : {false, true})
            for (const std::size_t triangles : {120, 121, 700}) {
                const Prepared on(mesh, triangles / 2);
                SurfaceMap map = on.map();
                ASSERT_TRUE(make_base_triangles(map, {.triangles = triangles}, kOneThread).ok());
                const auto base = make_base_quads(map, halve, kOneThread);
                ASSERT_TRUE(base.ok());
                ASSERT_NO_FATAL_FAILURE(expect_sound(map, on));
                ASSERT_NO_FATAL_FAILURE(expect_patches(map, *base, on));
                for (const std::size_t size : region_sizes(map)) EXPECT_EQ(size % 2, 0u) << "an odd region";
                if (halve) {
                    EXPECT_TRUE(base->halved);
                } else if (!base->halved) {
                    EXPECT_EQ(2 * base->quads.size(), map.triangle_count());
                }
                // parts between sharp corners may be even and still have triangles that fight for a partner
                if (region_sizes(map).size() <= 2) {
                    EXPECT_EQ(base->halved, halve);
                }
            }
}

TEST(BaseQuads, OfTrianglesThatCannotAllBePaired) {
    // one triangle alone: three quads around its middle
    const Prepared one(triangle_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}));
    SurfaceMap map = one.map();
    const auto base = make_base_quads(map, false, kOneThread);
    ASSERT_TRUE(base.ok());
    EXPECT_TRUE(base->halved || base->quads.size() * 2 == map.triangle_count());
    ASSERT_NO_FATAL_FAILURE(expect_patches(map, *base, one));
}

TEST(BaseQuads, HaveNoStraightCornersOnCurves) {
    // beside a straight curve, a vertex has two quads at least
    const Prepared on(ridged_sheet(), 60);
    SurfaceMap map = on.map();
    ASSERT_TRUE(make_base_triangles(map, {.triangles = 120}, kOneThread).ok());
    const auto base = make_base_quads(map, false, kOneThread);
    ASSERT_TRUE(base.ok());
    for (const BaseQuad& quad : base->quads)
        for (std::size_t k = 0; k < 4; ++k)
            EXPECT_FALSE(quad.features[k] && quad.features[(k + 3) % 4] &&
                         base->kinds[quad.vertices[k]] == VertexKind::curve);
}

TEST(BaseQuads, Cancelled) {
    const Prepared on(plain_cube());
    SurfaceMap map = on.map();
    const RunContext context(1);
    context.cancel();
    const auto base = make_base_quads(map, false, context);
    ASSERT_FALSE(base.ok());
    EXPECT_EQ(base.error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
