#include "filigree/remesh/voxel_grid.h"

#include "threads.h"

#include <gtest/gtest.h>
#include <random>

namespace filigree {
namespace {

constexpr VoxelIndex kSize = {131, 9, 11}; // rows of three words, the last one with three voxels

template <class Visit>
void for_each_voxel(const VoxelIndex& size, const Visit& visit) {
    for (int z = 0; z < size[2]; ++z)
        for (int y = 0; y < size[1]; ++y)
            for (int x = 0; x < size[0]; ++x) visit(VoxelIndex{x, y, z});
}

/// One voxel in `of`, and none in the `margin` outermost layers.
VoxelGrid voxels_at_random(unsigned of, unsigned seed, int margin = 0) {
    VoxelGrid grid(kSize);
    std::mt19937 random(seed);
    for_each_voxel(kSize, [&](const VoxelIndex& v) {
        bool within = true;
        for (int k = 0; k < 3; ++k) within = within && v[k] >= margin && v[k] < kSize[k] - margin;
        if (random() % of == 0 && within) grid.set(v);
    });
    return grid;
}

bool has(const VoxelGrid& grid, const VoxelIndex& v) { return grid.inside(v) && grid.test(v); }

std::array<VoxelIndex, 6> beside(const VoxelIndex& v) {
    std::array<VoxelIndex, 6> result;
    for (int k = 0; k < 6; ++k) {
        result[k] = v;
        result[k][k / 2] += k % 2 ? 1 : -1;
    }
    return result;
}

TEST(VoxelGrid, ComplementKeepsToTheGrid) {
    const VoxelGrid grid = voxels_at_random(3, 1), other = complement(grid);
    for_each_voxel(kSize, [&](const VoxelIndex& v) { ASSERT_NE(grid.test(v), other.test(v)); });
    EXPECT_EQ(complement(other).bits, grid.bits);
    for (std::size_t r = 0; r < other.row_count(); ++r) EXPECT_EQ(other.row(r).back() & ~other.valid_bits(2), 0u);
}

TEST(VoxelGrid, DilatedHasAllThatShareACorner) {
    const VoxelGrid grid = voxels_at_random(90, 2), wider = dilated(grid, kOneThread);
    for_each_voxel(kSize, [&](const VoxelIndex& v) {
        bool expected = false;
        for_each_voxel({3, 3, 3}, [&](const VoxelIndex& d) {
            expected = expected || has(grid, {v[0] + d[0] - 1, v[1] + d[1] - 1, v[2] + d[2] - 1});
        });
        ASSERT_EQ(wider.test(v), expected);
    });
}

TEST(VoxelGrid, FloodReachesWhatIsConnected) {
    for (const unsigned of : {2u, 3u, 4u}) { // from mazes to open halls
        VoxelGrid closed = voxels_at_random(of, of);
        closed.bits[0] &= ~std::uint64_t(1);
        const VoxelGrid outside = flood_outside(closed);
        VoxelGrid expected(kSize);
        std::vector<VoxelIndex> queue = {{0, 0, 0}};
        expected.set(queue[0]);
        for (std::size_t i = 0; i < queue.size(); ++i)
            for (const VoxelIndex& v : beside(queue[i]))
                if (expected.inside(v) && !closed.test(v) && !expected.test(v)) {
                    expected.set(v);
                    queue.push_back(v);
                }
        EXPECT_GT(queue.size(), 1u);
        EXPECT_EQ(outside.bits, expected.bits);
    }
    EXPECT_EQ(flood_outside(complement(VoxelGrid(kSize))).bits, VoxelGrid(kSize).bits); // everything closed
}

TEST(VoxelGrid, BorderBecomesAManifold) {
    for (const unsigned of : {2u, 4u, 8u, 30u}) {
        const VoxelGrid before = voxels_at_random(of, 10 + of, 2);
        VoxelGrid solid = before;
        make_border_manifold(solid);
        for_each_voxel(kSize, [&](const VoxelIndex& v) { ASSERT_TRUE(solid.test(v) || !before.test(v)); });
        EXPECT_EQ(flood_outside(solid).bits, complement(solid).bits); // nothing shut in
        // each edge of the grid has no sides or two, which is a manifold along edges
        for_each_voxel({kSize[0] - 1, kSize[1] - 1, kSize[2] - 1}, [&](const VoxelIndex& v) {
            for (int axis = 0; axis < 3; ++axis) {
                VoxelIndex p = v, q = v, both = v;
                ++p[(axis + 1) % 3], ++q[(axis + 2) % 3], ++both[(axis + 1) % 3], ++both[(axis + 2) % 3];
                const bool diagonal = solid.test(v) == solid.test(both) && solid.test(p) == solid.test(q) &&
                                      solid.test(v) != solid.test(p);
                ASSERT_FALSE(diagonal);
            }
        });
        // no two that only share a corner across a block
        for_each_border_corner(solid, [&](const VoxelIndex& c) {
            int inside = 0;
            for_each_voxel({2, 2, 2}, [&](const VoxelIndex& d) {
                inside += solid.test({c[0] - d[0], c[1] - d[1], c[2] - d[2]});
            });
            for (int sign = 0; sign < 4; ++sign) {
                const int x = sign & 1, y = sign >> 1;
                const bool ends =
                    solid.test({c[0] - x, c[1] - y, c[2]}) == solid.test({c[0] - 1 + x, c[1] - 1 + y, c[2] - 1});
                const bool first = solid.test({c[0] - x, c[1] - y, c[2]});
                ASSERT_FALSE(ends && inside == (first ? 2 : 6));
            }
        });
    }
}

TEST(VoxelGrid, ManifoldSetsStayAsTheyAre) {
    VoxelGrid box(kSize);
    for_each_voxel(kSize, [&](const VoxelIndex& v) {
        if (v[0] > 2 && v[0] < 70 && v[1] > 2 && v[1] < 6 && v[2] > 2 && v[2] < 8) box.set(v);
    });
    const VoxelGrid before = box;
    make_border_manifold(box);
    EXPECT_EQ(box.bits, before.bits);
    std::size_t corners = 0;
    for_each_border_corner(box, [&](const VoxelIndex&) { ++corners; });
    EXPECT_EQ(corners, 68u * 4 * 6 - 66 * 2 * 4); // of the block of corners, those that are not within it
}

TEST(VoxelGrid, DilationIsIndependentOfThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const VoxelGrid grid = voxels_at_random(20, 3);
    EXPECT_EQ(dilated(grid, kOneThread).bits, dilated(grid, RunContext(2)).bits);
}

} // namespace
} // namespace filigree
