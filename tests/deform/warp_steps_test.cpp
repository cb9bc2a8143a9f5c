#include "filigree/deform/warp_steps.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

const Box kTallBox{Vec3d(-1, -2, -1), Vec3d(1, 2, 1)};
const Vec3d kPoint(0.4, 1.3, -0.7);

TEST(WarpSteps, AreDoneOneAfterTheOtherOverOneBox) {
    const std::vector<WarpStep> steps = {{WarpKind::bend, 60}, {WarpKind::stretch, 1.5}, {WarpKind::random, 0.1}};
    const Vec3d bent = make_bend(kTallBox, Axis::y, 60)->position(kPoint);
    const Vec3d stretched = make_stretch(kTallBox, Axis::y, 1.5).value()->position(bent);
    const Vec3d all = make_smooth_random(kTallBox, 0.1, 7)->position(stretched);
    EXPECT_EQ(make_warp(steps, kTallBox, Axis::y, 7)->position(kPoint), all);
    EXPECT_EQ(make_warp(std::vector<WarpStep>(), kTallBox, Axis::y)->position(kPoint), kPoint);
}

TEST(WarpSteps, PartsGoFromNothingToAll) {
    for (const WarpKind kind :
         {WarpKind::stretch, WarpKind::squeeze, WarpKind::bend, WarpKind::twist, WarpKind::taper, WarpKind::random}) {
        const WarpStep step{kind, 0.7};
        const WarpStep nothing = step.part(0);
        EXPECT_LT((make_warp(std::span(&nothing, 1), kTallBox, Axis::x)->position(kPoint) - kPoint).norm(), 1e-12);
        EXPECT_EQ(step.part(1).amount, 0.7);
    }
    EXPECT_EQ((WarpStep{WarpKind::bend, 90}).part(0.5).amount, 45);
    EXPECT_EQ((WarpStep{WarpKind::taper, 3}).part(0.5).amount, 2);
}

TEST(WarpInfos, HaveARowForEachKindInItsOrder) {
    const std::span<const WarpInfo> infos = warp_infos();
    ASSERT_EQ(infos.size(), static_cast<std::size_t>(WarpKind::random) + 1);
    Warps one_slider_each;
    for (std::size_t k = 0; k < infos.size(); ++k) {
        EXPECT_EQ(infos[k].kind, static_cast<WarpKind>(k)) << infos[k].name;
        if (infos[k].amount == nullptr) continue;
        EXPECT_EQ(one_slider_each.*infos[k].amount, infos[k].nothing()) << infos[k].name;
        one_slider_each.*infos[k].amount = -1; // so that a second row with this member would fail
    }
}

TEST(Warps, AreStepsInAFixedOrder) {
    EXPECT_EQ(make_warp(Warps(), kTallBox), nullptr);
    EXPECT_EQ(make_warp(Warps{.bend = 30}, Box()), nullptr);
    const Warps warps{.axis = Axis::z, .stretch = 1.2, .squeeze = 0.9, .bend = 30, .twist = 20, .taper = 0.8};
    const std::vector<WarpStep> steps = {{WarpKind::stretch, 1.2},
                                         {WarpKind::squeeze, 0.9},
                                         {WarpKind::bend, 30},
                                         {WarpKind::twist, 20},
                                         {WarpKind::taper, 0.8}};
    EXPECT_EQ(make_warp(warps, kTallBox)->position(kPoint), make_warp(steps, kTallBox, Axis::z)->position(kPoint));
}

} // namespace
} // namespace filigree
