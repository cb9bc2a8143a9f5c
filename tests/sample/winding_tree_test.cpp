#include "filigree/sample/winding_tree.h"

#include "sample/triangle_surfaces.h"

#include <gtest/gtest.h>

namespace filigree::winding_tree_test {
namespace {

TEST(WindingTree, KnowsTheSolidAngleOfAnOctant) {
    const RunContext context(1);
    const TriangleSurface octant{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2}}};
    const WindingTree tree = WindingTree::create(octant.positions, octant.triangles, 1e-4, context).value();
    EXPECT_NEAR(tree.winding({0, 0, 0}), 1.0 / 8, 1e-9);
    for (const Vec3d& p : random_points(octant, 200)) EXPECT_NEAR(tree.winding(p), brute_force(octant, p), 1e-9);
}

TEST(WindingTree, IsAWholeNumberForClosedMeshes) {
    const RunContext context(1);
    const TriangleSurface cube = box({-1, -1, -1}, {1, 1, 1}); // so few triangles that all are summed exactly
    const WindingTree tree = WindingTree::create(cube.positions, cube.triangles, 1e-4, context).value();
    int inside = 0;
    for (const Vec3d& p : random_points(cube, 2000)) {
        const bool expected = (p.array().abs() < 1).all();
        ASSERT_NEAR(tree.winding(p), expected ? 1 : 0, 1e-6) << p.transpose();
        inside += expected;
    }
    EXPECT_GT(inside, 300);
    for (const std::string_view name : {"wavy-cube", "wavy-sphere", "torus"}) {
        const TriangleSurface surface = shape(name, 12);
        const WindingTree larger = WindingTree::create(surface.positions, surface.triangles, 1e-3, context).value();
        for (const Vec3d& p : random_points(surface, 1000)) {
            const double number = larger.winding(p);
            ASSERT_NEAR(number, std::round(brute_force(surface, p)), 1e-3) << name;
        }
    }
}

TEST(WindingTree, KeepsTheAccuracyAskedFor) {
    const RunContext context(1);
    for (const TriangleSurface& surface : {without_cap(shape("wavy-sphere", 20)), with_some_turned(shape("torus", 24)),
                                           shape("wavy-plane", 30), soup(without_cap(shape("wavy-cube", 16)))}) {
        const std::vector<Vec3d> points = random_points(surface, 400);
        double error_before = 1;
        for (const double accuracy : {0.1, 0.01, 0.001, 0.0001}) {
            const WindingTree tree =
                WindingTree::create(surface.positions, surface.triangles, accuracy, context).value();
            double error = 0;
            for (const Vec3d& p : points) error = std::max(error, std::abs(tree.winding(p) - brute_force(surface, p)));
            EXPECT_LT(error, accuracy);
            EXPECT_LT(error, error_before);
            error_before = error;
        }
    }
}

TEST(WindingTree, ManyPointsAreOnePointManyTimes) {
    const TriangleSurface surface = without_cap(shape("wavy-sphere", 16));
    std::vector<Vec3d> points = random_points(surface, 3000);
    for (const double far : {1e3, 1e7, 1e30, 1e300}) points.push_back({far, -far, 0});
    points.push_back({NAN, 0, 0});
    for (const unsigned threads : {1u, 4u}) {
        const RunContext context(threads);
        const WindingTree tree = WindingTree::create(surface.positions, surface.triangles, 0.01, context).value();
        const auto numbers = tree.winding(points, context);
        ASSERT_TRUE(numbers);
        for (std::size_t i = 0; i < points.size(); ++i)
            ASSERT_EQ((*numbers)[i], static_cast<float>(tree.winding(points[i])));
        for (std::size_t i = 3000; i < points.size(); ++i) EXPECT_NEAR((*numbers)[i], 0, 1e-5);
        context.cancel();
        EXPECT_EQ(tree.winding(points, context).error().code, ErrorCode::cancelled);
    }
    const RunContext context(1);
    EXPECT_EQ(WindingTree::create({}, {}, 0.01, context)->winding({0, 0, 0}), 0);
}

TEST(WindingTree, OnTheSurfaceItFollowsTheRuleOfThePerturbedPoint) {
    const RunContext context(1);
    const TriangleSurface cube = box({0, 0, 0}, {4, 4, 4});
    const WindingTree tree = WindingTree::create(cube.positions, cube.triangles, 1e-4, context).value();
    for (int k = -1; k <= 5; ++k)
        for (int j = -1; j <= 5; ++j)
            for (int i = -1; i <= 5; ++i) {
                const Vec3d p(i, j, k);
                const bool expected = (p.array() >= 0).all() && (p.array() < 4).all();
                EXPECT_NEAR(tree.winding(p), expected ? 1 : 0, 1e-4) << p.transpose(); // corners and edges too
            }
}

TEST(WindingTree, CancelledIsNoTree) {
    const TriangleSurface surface = shape("wavy-sphere", 8);
    const RunContext context;
    context.cancel();
    EXPECT_EQ(WindingTree::create(surface.positions, surface.triangles, 0.01, context).error().code,
              ErrorCode::cancelled);
}

} // namespace
} // namespace filigree::winding_tree_test
