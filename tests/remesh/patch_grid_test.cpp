#include "filigree/remesh/patch_grid.h"

#include "filigree/mesh.h"
#include "filigree/remesh/base_triangles.h"
#include "grids.h"

#include <cstring>

namespace filigree {
namespace {

using namespace filigree_test;

/// What must be true of every grid: shared by index, the surface's topology, curves where curves are.
void expect_grid(const PatchGrid& grid, const Prepared& on, unsigned levels) {
    const std::size_t n = grid.patches.side();
    ASSERT_EQ(grid.patches.levels, levels);
    ASSERT_EQ(grid.features.size(), grid.patches.patch_count());
    ASSERT_EQ(grid.positions.size(), grid.source.size());
    ASSERT_EQ(grid.positions.size(), grid.kinds.size());
    ASSERT_EQ(grid.positions.size(), grid.along.size());
    ASSERT_EQ(grid.positions.size(), grid.held.size());
    ASSERT_EQ(grid.quads().size(), grid.patches.patch_count() * n * n);
    const Mesh mesh = grid_mesh(grid, Vec3d(1, 2, 3));
    ASSERT_EQ(check_mesh(mesh), "");
    EXPECT_EQ(mesh.origin, Vec3d(1, 2, 3));
    const TopologyReport report = analyse_topology(mesh, kOneThread);
    EXPECT_EQ(report.quads, report.faces);
    EXPECT_EQ(report.unused_vertices.count, 0u);
    EXPECT_TRUE(report.is_manifold());
    EXPECT_TRUE(report.is_oriented());
    EXPECT_EQ(report.euler, on.topology().euler);
    EXPECT_EQ(report.components, on.topology().components);
    EXPECT_EQ(report.open_edges.count > 0, on.topology().border_edges > 0);
    EXPECT_EQ(topology_of_quads(mesh).border_loops, on.topology().border_loops);
    const auto found = find_regular_patches(mesh, 8, kOneThread);
    ASSERT_TRUE(found.ok());
    EXPECT_GE(found->levels, levels);

    const SurfaceWalk walk = on.walk();
    for (Index v = 0; v < grid.positions.size(); ++v) {
        ASSERT_LT((walk.position(grid.source[v]) - grid.positions[v]).norm(), 1e-9 * on.diagonal);
        if (grid.kinds[v] != VertexKind::curve) continue;
        ASSERT_LT(on.distance_to_curves(grid.positions[v]), 1e-6 * on.diagonal) << "vertex " << v;
        for (const Index w : grid.along[v]) {
            ASSERT_NE(w, kNoIndex);
            ASSERT_NE(grid.kinds[w], VertexKind::inside);
            const auto& back = grid.along[w];
            ASSERT_TRUE(grid.kinds[w] == VertexKind::corner || back[0] == v || back[1] == v);
        }
    }
}

TEST(PatchGrid, SharesVerticesAndKeepsTopologyAndCurves) {
    for (const Mesh& mesh : {bumpy_torus(), ridged_sheet(), plain_cube(), machined_part()})
        for (const unsigned levels : {1u, 3u}) {
            const Prepared on(mesh, 60);
            const PatchGrid grid = sampled_grid(on, 60, levels, kOneThread);
            ASSERT_NO_FATAL_FAILURE(expect_grid(grid, on, levels));
        }
}

TEST(PatchGrid, HalvingKeepsWhatIsThere) {
    for (const Mesh& mesh : {bumpy_torus(), ridged_sheet(), plain_cube(), machined_part()}) {
        const Prepared on(mesh, 60);
        const PatchGrid coarse = sampled_grid(on, 60, 2, kOneThread);
        const PatchGrid fine = halve_grid(coarse, on.walk(), kOneThread);
        ASSERT_NO_FATAL_FAILURE(expect_grid(fine, on, 3));
        EXPECT_EQ(fine.patches.base, coarse.patches.base);
        EXPECT_EQ(fine.features, coarse.features);
        const std::size_t n = coarse.patches.side();
        for (std::size_t p = 0; p < coarse.patches.patch_count(); ++p)
            for (std::size_t j = 0; j <= n; ++j)
                for (std::size_t i = 0; i <= n; ++i) {
                    const Index v = coarse.patches.at(p, i, j), w = fine.patches.at(p, 2 * i, 2 * j);
                    ASSERT_EQ(std::memcmp(&coarse.positions[v], &fine.positions[w], sizeof(Vec3d)), 0);
                    ASSERT_EQ(coarse.kinds[v], fine.kinds[w]);
                    ASSERT_EQ(coarse.source[v].triangle, fine.source[w].triangle);
                }
    }
}

TEST(PatchGrid, OfAPlaneLiesInIt) {
    const Prepared on(make_wavy_plane({.resolution = 20, .amplitude = 0}), 30);
    const PatchGrid grid = halve_grid(sampled_grid(on, 30, 3, kOneThread), on.walk(), kOneThread);
    double area = 0;
    for (const auto& [a, b, c, d] : grid.quads())
        area += 0.5 * (grid.positions[c] - grid.positions[a]).cross(grid.positions[d] - grid.positions[b]).z();
    EXPECT_NEAR(area, 1, 1e-6); // signed: no fold, and the border is the square's
    for (const Vec3d& p : grid.positions) EXPECT_EQ(p.z(), 0);
}

TEST(PatchGrid, SameForAnyNumberOfThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Prepared on(machined_part(), 60);
    const PatchGrid one = sampled_grid(on, 60, 3, kOneThread), two = sampled_grid(on, 60, 3, RunContext(2));
    EXPECT_EQ(one.positions, two.positions);
    EXPECT_EQ(halve_grid(one, on.walk(), kOneThread).positions, halve_grid(one, on.walk(), RunContext(2)).positions);
}

} // namespace
} // namespace filigree
