#include "filigree/remesh/patch_layout.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(PatchLayout, LeavesFiveHundredPatchesOrMore) {
    EXPECT_EQ(plan_patches(50'000, {}).levels, 3u);
    EXPECT_EQ(plan_patches(50'000, {}).patches, 781u);
    EXPECT_EQ(plan_patches(6, {}).levels, 1u);
    EXPECT_EQ(plan_patches(6, {}).patches, 2u);
    EXPECT_EQ(plan_patches(50'000, 1).patches, 12'500u);
    EXPECT_EQ(plan_patches(6, 8).patches, 1u);
    for (const std::size_t quads : {8'000u, 31'999u, 32'000u, 1'000'000u, 100'000'000u}) {
        const PatchLayout layout = plan_patches(quads, {});
        EXPECT_GE(layout.patches, 500u) << quads;
        EXPECT_LE(layout.levels, kMostQuadLevels) << quads;
    }
}

TEST(PatchLayout, ManyPartsGetMorePatches) {
    const PatchLayout layout = with_more_patches({600, 4}, least_patches(1000));
    EXPECT_EQ(layout.patches, 9600u);
    EXPECT_EQ(layout.levels, 2u);
    EXPECT_EQ(with_more_patches({600, 2}, 1'000'000).levels, 1u); // no further
    EXPECT_EQ(with_more_patches({600, 2}, 600).patches, 600u);
}

TEST(PatchLayout, AFinerOneKeepsToTheMostPatches) {
    const auto finer = finer_layout({600, 3});
    ASSERT_TRUE(finer);
    EXPECT_EQ(finer->patches, 2400u);
    EXPECT_EQ(finer->levels, 2u);
    EXPECT_FALSE(finer_layout({600, 1}));
    EXPECT_TRUE(finer_layout({kMostPatches / 4, 2}));
    EXPECT_FALSE(finer_layout({kMostPatches / 4 + 1, 2})); // what was tried again with too many
}

} // namespace
} // namespace filigree
