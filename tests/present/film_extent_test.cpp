#include "filigree/present/film_extent.h"

#include <gtest/gtest.h>

#include <cmath>

namespace filigree {
namespace {

const std::vector<Vec3f> kTriangle = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};

TEST(FilmExtent, HoldsAllMoments) {
    FilmExtent extent;
    extent.add(kTriangle, {1e6, 0, 0});
    extent.add(kTriangle, {1e6, 3, 1});
    extent.add({}, {0, 0, 0});
    EXPECT_EQ(extent.box().min, Vec3d(1e6, 0, 0));
    EXPECT_EQ(extent.box().max, Vec3d(1e6 + 1, 5, 1));
    const CameraPoints points = extent.points();
    ASSERT_EQ(points.positions.size(), 6U);
    Box seen;
    for (const Vec3f& p : points.positions) seen.extend(points.origin + p.cast<double>());
    EXPECT_EQ(seen.min, extent.box().min);
    EXPECT_EQ(seen.max, extent.box().max);
    EXPECT_LT(extent.ground_level(UpAxis::y), 0);
    EXPECT_GT(extent.ground_level(UpAxis::y), -0.01);
}

TEST(FilmExtent, KeepsFewPointsOfLargeMoments) {
    FilmExtent extent;
    extent.add(std::vector<Vec3f>(1'000'000, Vec3f(1, 2, 3)), Vec3d::Zero());
    EXPECT_LE(extent.points().positions.size(), 20'000U);
}

TEST(FilmExtent, ATurningBodyStaysInside) {
    FilmExtent extent;
    extent.add(kTriangle, {5, 0, 0});
    std::vector<Vec3f> ring;
    const CameraPoints points = extent.points_turning(UpAxis::y, ring);
    const Vec3d centre = extent.box().centre();
    EXPECT_EQ(points.origin, centre);
    double most = 0;
    for (const Vec3f& p : points.positions) {
        most = std::max(most, double(std::hypot(p.x(), p.z())));
        EXPECT_LE(std::abs(p.y()), 1.0001f);
    }
    EXPECT_NEAR(most, 0.5, 1e-5); // the farthest from the axis
}

TEST(FilmExtent, BallsNeedRoom) {
    FilmExtent extent;
    extent.add(kTriangle, Vec3d::Zero());
    extent.widen(0.25);
    EXPECT_EQ(extent.box().min, Vec3d(-0.25, -0.25, -0.25));
    EXPECT_EQ(extent.points().radius, 0.25);
}

} // namespace
} // namespace filigree
