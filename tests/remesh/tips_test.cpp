#include "filigree/remesh/manifold_surface.h"
#include "filigree/remesh/tips.h"

#include "filigree/remesh/relax.h"
#include "grids.h"

namespace filigree {
namespace {

using namespace filigree_test;

/// Distances of a surface's vertices that are 0 but near some places, where they are cones of this height.
std::vector<float> cones(const ManifoldSurface& surface, const std::vector<Vec3d>& places, double height) {
    std::vector<float> distances(surface.positions.size(), 0.0f);
    for (std::size_t v = 0; v < distances.size(); ++v)
        for (const Vec3d& place : places)
            distances[v] =
                std::max(distances[v], static_cast<float>(height - 0.5 * (surface.positions[v] - place).norm()));
    return distances;
}

TEST(Tips, AreTheFurthestOfEachRegion) {
    const Prepared on(make_wavy_sphere({.resolution = 24, .amplitude = 0}));
    const std::vector<Vec3d>& positions = on.surface.positions;
    const Vec3d a = positions[100], b = positions[1500];
    ASSERT_GT((a - b).norm(), 0.4);
    const auto tips = [&](const std::vector<Vec3d>& places, double bound) {
        return find_tips(on.surface, on.twins, on.kinds, cones(on.surface, places, 0.1), bound);
    };
    EXPECT_EQ(tips({a, b}, 0.05), (std::vector<Index>{100, 1500}));
    EXPECT_EQ(tips({a}, 0.05), (std::vector<Index>{100}));
    EXPECT_TRUE(tips({a, b}, 0.2).empty()) << "nothing is further out";
    EXPECT_TRUE(tips({}, 0.05).empty());
}

TEST(Tips, FollowOneAnotherAlongARidge) {
    const Prepared on(make_wavy_sphere({.resolution = 24, .amplitude = 0}));
    std::vector<float> distances;
    for (const Vec3d& p : on.surface.positions) distances.push_back(std::abs(p.z()) < 0.1 ? 0.1f : 0.0f);
    const std::vector<Index> tips = find_tips(on.surface, on.twins, on.kinds, distances, 0.05);
    EXPECT_GT(tips.size(), 8u);
    for (const Index a : tips)
        for (const Index b : tips)
            EXPECT_TRUE(a == b || (on.surface.positions[a] - on.surface.positions[b]).norm() >= 0.15 * (1 - 1e-6));
}

TEST(Tips, AreNotOnCurves) {
    const Prepared on(machined_part());
    const std::vector<float> far(on.surface.positions.size(), 1.0f);
    for (const Index tip : find_tips(on.surface, on.twins, on.kinds, far, 0.1))
        EXPECT_EQ(on.kinds[tip], VertexKind::inside);
}

TEST(Tips, AreHeldThroughRelaxingAndHalving) {
    const Prepared on(bumpy_torus(), 80);
    const SurfaceWalk walk = on.walk();
    PatchGrid grid = sampled_grid(on, 80, 2, kOneThread);
    const std::vector<Index> tips = {10, 11, 300};
    ASSERT_EQ(hold_tips(on.surface, on.twins, tips, 0.01, grid), tips.size());
    relax(grid, walk, 10, kOneThread);
    grid = halve_grid(grid, walk, kOneThread);
    relax(grid, walk, 4, kOneThread);
    EXPECT_EQ(std::ranges::count_if(grid.held, [](float leash) { return leash > 0; }), std::ptrdiff_t(tips.size()));
    for (const Index tip : tips) {
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t v = 0; v < grid.positions.size(); ++v)
            if (grid.held[v] > 0) nearest = std::min(nearest, (grid.positions[v] - on.surface.positions[tip]).norm());
        EXPECT_LT(nearest, 1e-6 * on.diagonal) << "tip " << tip;
    }
}

TEST(Tips, UntanglingKeepsThemOnTheirLeash) {
    const Prepared on(bumpy_torus(), 80);
    const SurfaceWalk walk = on.walk();
    PatchGrid grid = sampled_grid(on, 80, 3, kOneThread);
    ASSERT_EQ(hold_tips(on.surface, on.twins, std::vector<Index>{10, 300}, 0.02, grid), 2u);
    relax(grid, walk, 20, kOneThread);
    const PatchGrid before = grid;
    EXPECT_EQ(untangle(grid, walk, 0.9, kOneThread).inverted, 0u); // nearly all quads are to be mended
    for (std::size_t v = 0; v < grid.positions.size(); ++v)
        if (before.held[v] > 0) {
            EXPECT_LE((grid.positions[v] - before.positions[v]).norm(), 0.02 * (1 + 1e-6));
        }
}

TEST(Tips, FindNoVertexWhereAllAreHeld) {
    const Prepared on(bumpy_torus(), 80);
    PatchGrid grid = sampled_grid(on, 80, 1, kOneThread);
    grid.held.assign(grid.held.size(), 0.01f);
    EXPECT_EQ(hold_tips(on.surface, on.twins, std::vector<Index>{10}, 0.01, grid), 0u);
}

} // namespace
} // namespace filigree
