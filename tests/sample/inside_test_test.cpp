#include "filigree/sample.h"

#include "filigree/mesh.h"
#include "sample/bodies.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(InsideTest, SinglePointsGetTheLatticesAnswers) {
    const Mesh mesh = make_wavy_sphere({.resolution = 10});
    const Mesh open = without_faces(mesh, mesh.face_count() - 2);
    for (const Mesh* m : {&mesh, &open}) {
        const Lattice lattice = lattice_over(*m, 0.13);
        const Occupancy occupancy = sample_inside(*m, lattice, {}, kAllThreads).value();
        const InsideTest test = InsideTest::create(*m, {}, kAllThreads).value();
        std::vector<Vec3d> points;
        std::size_t different = 0;
        const auto [nx, ny, nz] = lattice.counts();
        for (std::size_t k = 0; k < nz; ++k)
            for (std::size_t j = 0; j < ny; ++j)
                for (std::size_t i = 0; i < nx; ++i) {
                    points.push_back(lattice.point(i, j, k));
                    different += test.contains(points.back()) != occupancy.contains(i, j, k);
                }
        EXPECT_LE(different, m == &mesh ? 0 : points.size() / 200); // winding numbers are right to 0.01
        const auto many = test.contains(points, kAllThreads).value();
        for (std::size_t p = 0; p < points.size(); ++p) ASSERT_EQ(many[p] != 0, test.contains(points[p]));
    }
}

TEST(InsideTest, PointsInsideAreThoseThatItContains) {
    const Mesh mesh = make_wavy_sphere({.resolution = 10});
    const Lattice lattice = lattice_over(mesh, 0.13);
    const auto [nx, ny, nz] = lattice.counts();
    std::vector<Vec3d> points, expected;
    const InsideTest test = InsideTest::create(mesh, by(InsideMethod::rays), kAllThreads).value();
    for (std::size_t i = 0; i < nx * ny * nz; ++i) {
        points.push_back(lattice.point(i % nx, i / nx % ny, i / nx / ny));
        if (test.contains(points.back())) expected.push_back(points.back());
    }
    InsideReport report;
    EXPECT_EQ(points_inside(mesh, points, {}, kAllThreads, &report).value(), expected);
    EXPECT_EQ(report.used, InsideMethod::rays);
    EXPECT_EQ(points_inside(mesh, points, by(InsideMethod::winding), kAllThreads, &report).value().size(),
              expected.size());
    EXPECT_EQ(report.used, InsideMethod::winding);
    EXPECT_EQ(points_inside(without_faces(mesh, 3), points, {}, kAllThreads).error().code, ErrorCode::unsuitable);
}

TEST(InsideTest, CancelledIsNoAnswer) {
    const Mesh mesh = make_wavy_sphere({.resolution = 10});
    for (const InsideMethod method : {InsideMethod::rays, InsideMethod::winding}) {
        RunContext context;
        context.cancel();
        const auto test = InsideTest::create(mesh, by(method), context);
        ASSERT_FALSE(test);
        EXPECT_EQ(test.error().code, ErrorCode::cancelled);
    }
}

} // namespace
} // namespace filigree
