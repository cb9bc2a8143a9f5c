#include "filigree/remesh/relax.h"

#include "filigree/mesh/closest_point.h"
#include "filigree/remesh/quad_quality.h"
#include "grids.h"

namespace filigree {
namespace {

using namespace filigree_test;

QuadQuality quality(const PatchGrid& grid) { return measure_quads(grid_mesh(grid, Vec3d::Zero()), kOneThread); }

/// Every vertex on the surface, curve vertices on curves, corners where they were.
void expect_in_place(const PatchGrid& grid, const PatchGrid& before, const Prepared& on) {
    std::vector<Vec3f> positions;
    for (const Vec3d& p : on.surface.positions) positions.push_back(p.cast<float>());
    const ClosestPointTree tree(positions, on.surface.triangles);
    const SurfaceWalk walk = on.walk();
    for (Index v = 0; v < grid.positions.size(); ++v) {
        ASSERT_LT(tree.closest(grid.positions[v].cast<float>()).distance, 1e-6 * on.diagonal) << "vertex " << v;
        ASSERT_LT((walk.position(grid.source[v]) - grid.positions[v]).norm(), 1e-6 * on.diagonal);
        if (grid.kinds[v] == VertexKind::curve) {
            ASSERT_LT(on.distance_to_curves(grid.positions[v]), 1e-6 * on.diagonal);
        }
        if (grid.kinds[v] == VertexKind::corner) {
            ASSERT_LT((grid.positions[v] - before.positions[v]).norm(), 1e-6 * on.diagonal);
        }
    }
}

std::vector<Mesh> waved_shapes() {
    return {bumpy_torus(), ridged_sheet(), plain_cube(), machined_part(),
            make_wavy_sphere({.resolution = 24, .frequency = 3, .amplitude = 0.1})};
}

TEST(Relax, StaysOnTheSurfaceAndMakesNoQuadWorse) {
    for (const Mesh& mesh : waved_shapes()) {
        const Prepared on(mesh, 80);
        const SurfaceWalk walk = on.walk();
        PatchGrid grid = sampled_grid(on, 80, 3, kOneThread);
        const PatchGrid before = grid;
        double least = quality(grid).min_scaled_jacobian;
        const double mean = quality(grid).mean_scaled_jacobian;
        for (int sweep = 0; sweep < 6; ++sweep) {
            relax(grid, walk, 1, kOneThread);
            const double now = quality(grid).min_scaled_jacobian;
            EXPECT_GE(now, std::min(least, 0.5) - 1e-4); // rounded once, at first
            least = now;
        }
        EXPECT_GT(quality(grid).mean_scaled_jacobian, mean);
        ASSERT_NO_FATAL_FAILURE(expect_in_place(grid, before, on));
    }
}

TEST(Relax, LeavesSquaresAsTheyAre) {
    // a grid of squares is at rest: each vertex is its neighbours' mean
    const Prepared on(make_wavy_plane({.resolution = 2, .amplitude = 0}));
    PatchGrid grid = sampled_grid(on, 4, 3, kOneThread);
    relax(grid, on.walk(), 60, kOneThread);
    const PatchGrid before = grid;
    relax(grid, on.walk(), 5, kOneThread);
    for (Index v = 0; v < grid.positions.size(); ++v) EXPECT_LT((grid.positions[v] - before.positions[v]).norm(), 5e-3);
}

TEST(Relax, SameForAnyNumberOfThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    for (const Mesh& mesh : {bumpy_torus(), machined_part()}) {
        const Prepared on(mesh, 80);
        PatchGrid one = sampled_grid(on, 80, 4, kOneThread), two = one;
        relax(one, on.walk(), 5, kOneThread);
        relax(two, on.walk(), 5, RunContext(2));
        EXPECT_EQ(one.positions, two.positions);
        untangle(one, on.walk(), 0.3, kOneThread);
        untangle(two, on.walk(), 0.3, RunContext(2));
        EXPECT_EQ(one.positions, two.positions);
    }
}

/// Some vertices inside thrown to their neighbours' places and beyond.
std::size_t tangle(PatchGrid& grid, const SurfaceWalk& walk, unsigned seed, Index every) {
    std::mt19937 random(seed);
    const std::vector<std::array<Index, 4>> quads = grid.quads();
    for (std::size_t q = random() % every; q < quads.size(); q += every) {
        const Index v = quads[q][0], across = quads[q][2];
        if (grid.kinds[v] != VertexKind::inside) continue;
        const Vec3d target = grid.positions[v] + 1.2 * (grid.positions[across] - grid.positions[v]);
        const SurfaceWalk::Place place = walk.walk(grid.source[v], target);
        grid.positions[v] = place.position;
        grid.source[v] = place.point;
    }
    return quality(grid).inverted;
}

TEST(Untangle, LeavesNoneInverted) {
    for (const Mesh& mesh : {bumpy_torus(), ridged_sheet(), machined_part()})
        for (unsigned seed = 0; seed < 8; ++seed) {
            const Prepared on(mesh, 80);
            const SurfaceWalk walk = on.walk();
            PatchGrid grid = sampled_grid(on, 80, 3, kOneThread);
            relax(grid, walk, 10, kOneThread);
            ASSERT_EQ(quality(grid).inverted, 0u);
            EXPECT_GT(tangle(grid, walk, seed, static_cast<Index>(grid.quads().size() / 4)), 2u);
            const PatchGrid before = grid;
            const Untangled untangled = untangle(grid, walk, 0.2, kOneThread);
            EXPECT_EQ(untangled.inverted, 0u) << mesh.face_count() << " faces, seed " << seed;
            EXPECT_EQ(quality(grid).inverted, 0u);
            if (untangled.off_surface == 0) {
                ASSERT_NO_FATAL_FAILURE(expect_in_place(grid, before, on));
            }
        }
}

TEST(Untangle, TouchesNothingThatIsGood) {
    const Prepared on(bumpy_torus(), 80);
    PatchGrid grid = sampled_grid(on, 80, 3, kOneThread);
    relax(grid, on.walk(), 20, kOneThread);
    ASSERT_GT(quality(grid).min_scaled_jacobian, 0.1);
    const PatchGrid before = grid;
    const Untangled untangled = untangle(grid, on.walk(), 0.1, kOneThread);
    EXPECT_EQ(untangled.inverted, 0u);
    EXPECT_EQ(untangled.off_surface, 0u);
    EXPECT_EQ(grid.positions, before.positions);
}

TEST(Untangle, TriesNothingWhereTooMuchIsTangled) {
    const Prepared on(bumpy_torus(), 80);
    PatchGrid grid = sampled_grid(on, 80, 3, kOneThread);
    const std::size_t tangled = tangle(grid, on.walk(), 0, 3);
    EXPECT_GT(tangled, grid.quads().size() / 5);
    const PatchGrid before = grid;
    EXPECT_EQ(untangle(grid, on.walk(), 0.2, kOneThread).inverted, tangled);
    EXPECT_EQ(grid.positions, before.positions);
}

TEST(Untangle, SaysWhatItCannotMend) {
    // corners stay, and here all four are one point
    const Prepared on(triangle_mesh({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}), 1);
    SurfaceMap map = on.map();
    const auto base = make_base_quads(map, false, kOneThread);
    ASSERT_TRUE(base.ok());
    PatchGrid grid = sample_patches(map, *base, on.walk(), 1, kOneThread);
    for (Vec3d& p : grid.positions) p = Vec3d::Zero();
    for (VertexKind& kind : grid.kinds) kind = VertexKind::corner;
    EXPECT_EQ(untangle(grid, on.walk(), 0.2, kOneThread).inverted, grid.quads().size());
}

} // namespace
} // namespace filigree
