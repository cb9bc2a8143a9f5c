#include "filigree/deform/unwarp.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(Unwarped, IsTheWayBack) {
    const Box box{Vec3d(-0.5, -0.5, -0.5), Vec3d(0.5, 0.5, 0.5)};
    std::vector<std::unique_ptr<SpaceWarp>> steps;
    steps.push_back(make_stretch(box, Axis::y, 1.2).value());
    steps.push_back(make_bend(box, Axis::y, 90));
    steps.push_back(make_twist(box, Axis::y, 50));
    steps.push_back(make_taper(box, Axis::y, 0.6).value());
    const auto warp = make_chain(std::move(steps));
    for (const Vec3d& point : {Vec3d(0.3, 0.4, -0.2), Vec3d(-0.5, 0.1, 0.5), Vec3d(0, -0.45, 0)}) {
        const Vec3d place = warp->position(point);
        EXPECT_LT((unwarped(*warp, place, point + Vec3d(0.1, -0.1, 0.05)) - point).norm(), 1e-9);
    }
    EXPECT_TRUE(unwarped(*warp, Vec3d(1e6, 1e6, 1e6), Vec3d::Zero()).allFinite()); // out of reach
}

TEST(Unwarped, StaysWhereTheWarpIsFlat) {
    class Flat : public SpaceWarp {
        Vec3d position(const Vec3d& point) const override { return {point.x(), point.y(), 0}; }
        Warped warp(const Vec3d& point) const override { return {position(point), Mat3d(Vec3d(1, 1, 0).asDiagonal())}; }
    };
    EXPECT_EQ(unwarped(Flat(), Vec3d(1, 2, 3), Vec3d(0.5, 0.5, 0.5)), Vec3d(0.5, 0.5, 0.5));
}

} // namespace
} // namespace filigree
