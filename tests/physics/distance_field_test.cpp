#include "filigree/physics/body.h"

#include "filigree/core/random.h"
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/sample.h"
#include "filigree/sample/closure.h"
#include "io/corpus.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

Vec3f random_point(const Box& box, std::size_t n) {
    const Vec3d unit(random_unit(1, n), random_unit(2, n), random_unit(3, n));
    return (box.min + unit.cwiseProduct(box.size())).cast<float>();
}

TEST(DistanceField, ASphereIsRound) {
    const Mesh sphere = make_wavy_sphere({.resolution = 96, .amplitude = 0});
    const auto field = DistanceField::create(sphere, 4, 0, kAllThreads); // radius 2, spacing 1/16
    ASSERT_TRUE(field) << field.error().message;
    for (std::size_t n = 0; n < 5000; ++n) {
        const Vec3f point = random_point(field->box(), n);
        const DistanceField::Sample sample = field->at(point);
        if (point.norm() < 0.2f) continue; // all directions are the nearest there
        // Near by, the error of trilinear interpolation: the spacing squared over the radius of curvature. Further out
        // closest points are those of neighbours.
        const double error = std::abs(point.norm() - 2) < 0.18 ? 0.5 / 256 / point.norm() + 5e-4 : 0.15 / 16;
        EXPECT_NEAR(sample.distance, point.norm() - 2, error);
        EXPECT_GT(sample.normal.dot(point.normalized()), 0.95f);
        EXPECT_NEAR(sample.normal.norm(), 1, 1e-5);
    }
}

double box_distance(const Vec3d& p, const Vec3d& half) {
    const Vec3d d = p.cwiseAbs() - half;
    return d.cwiseMax(0.0).norm() + std::min(d.maxCoeff(), 0.0);
}

TEST(DistanceField, ABoxIsRightWithinAFractionOfTheSpacing) {
    const Mesh bar = make_bar({.resolution = 2, .size = 1, .length = 2}); // two large triangles a side
    const double spacing = 0.05;
    const auto field = DistanceField::create(bar, 1, spacing, kAllThreads);
    ASSERT_TRUE(field) << field.error().message;
    for (std::size_t n = 0; n < 5000; ++n) {
        const Vec3f point = random_point(field->box(), n);
        const double wanted = box_distance(point.cast<double>(), Vec3d(1, 0.5, 0.5));
        EXPECT_NEAR(field->at(point).distance, wanted, 0.4 * spacing) << point.transpose();
    }
    EXPECT_NEAR(field->at({0.2f, 0.52f, 0.1f}).distance, 0.02, 1e-6);
    EXPECT_NEAR(field->at({0.2f, 0.41f, 0.1f}).distance, -0.09, 1e-6);
    EXPECT_GT(field->at({0.2f, 0.41f, 0.1f}).normal.y(), 0.999f);
}

TEST(DistanceField, OutsideTheGridPointsAreFar) {
    const auto field = DistanceField::create(make_wavy_cube({.resolution = 8, .amplitude = 0}), 1, 0, kAllThreads);
    ASSERT_TRUE(field) << field.error().message;
    const DistanceField::Sample sample = field->at({0, 10, 0});
    EXPECT_NEAR(sample.distance, 9.5, 0.05);
    EXPECT_GT(sample.normal.y(), 0.999f);
    const DistanceField::Sample corner = field->at({-10, -10, -10});
    EXPECT_GT(corner.distance, 16);
    EXPECT_NEAR(corner.normal.dot(Vec3f(-1, -1, -1).normalized()), 1, 1e-3);
    // Just across the border nothing jumps.
    const auto edge = float(field->box().max.y());
    EXPECT_NEAR(field->at({0.1f, edge - 1e-5f, 0}).distance, field->at({0.1f, edge + 1e-5f, 0}).distance, 1e-4);
}

TEST(DistanceField, NormalsAreAlwaysUnit) {
    const auto field = DistanceField::create(make_wavy_cube({.resolution = 8, .amplitude = 0}), 1, 0.125, kAllThreads);
    ASSERT_TRUE(field) << field.error().message;
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    for (const Vec3f& point : {Vec3f(0, 0, 0), Vec3f(0.5f, 0.5f, 0.5f), Vec3f(nan, 0, 0), Vec3f(0, infinity, 0),
                               Vec3f(1e30f, -1e30f, 1e30f), Vec3f(0.25f, 0.25f, 0)})
        EXPECT_NEAR(field->at(point).normal.norm(), 1, 1e-5) << point.transpose();
}

TEST(DistanceField, KoalaAgreesWithClosestPointsAndInsideTest) {
    const auto path = filigree_test::corpus_folder() / "good/koala_100k.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no corpus";
    const Mesh koala = read_mesh(path, kAllThreads)->mesh;
    const auto field = DistanceField::create(koala, 1, 0, kAllThreads);
    ASSERT_TRUE(field) << field.error().message;
    const WeldedTriangles welded = weld_triangles(koala, kAllThreads).value();
    const ClosestPointTree tree(koala.positions, welded.triangles);
    const InsideTest inside = InsideTest::create(koala, {}, kAllThreads).value();
    const double spacing = bounds(koala.positions).size().maxCoeff() / 64;
    for (std::size_t n = 0; n < 5000; ++n) {
        const Vec3f point = random_point(field->box(), n);
        const double distance = tree.closest(point).distance;
        const float found = field->at(point).distance;
        EXPECT_NEAR(std::abs(found), distance, 0.5 * spacing);
        if (distance > 0.5 * spacing) {
            EXPECT_EQ(found < 0, inside.contains(point.cast<double>()));
        }
    }
}

TEST(DistanceField, ThreadsDoNotMatter) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh cube = make_wavy_cube({.resolution = 16});
    const auto one = DistanceField::create(cube, 1, 0.04, RunContext(1));
    const auto two = DistanceField::create(cube, 1, 0.04, RunContext(2));
    for (std::size_t n = 0; n < 5000; ++n) {
        const Vec3f point = random_point(one->box(), n);
        ASSERT_EQ(one->at(point).distance, two->at(point).distance);
    }
}

TEST(DistanceField, BadRequestsAreRefused) {
    const Mesh cube = make_wavy_cube({.resolution = 4});
    const auto code = [&](const Mesh& mesh, double scale, double spacing) {
        const auto field = DistanceField::create(mesh, scale, spacing, kAllThreads);
        return field ? ErrorCode{} : field.error().code;
    };
    EXPECT_EQ(code(cube, 0, 0), ErrorCode::usage);
    EXPECT_EQ(code(cube, 1, -1), ErrorCode::usage);
    EXPECT_EQ(code(cube, 1e200, 0), ErrorCode::usage);
    EXPECT_EQ(code(cube, 1, 1e-6), ErrorCode::unsuitable);
    EXPECT_EQ(code(Mesh{}, 1, 0), ErrorCode::unsuitable);
    const RunContext cancelled;
    cancelled.cancel();
    const auto field = DistanceField::create(cube, 1, 0, cancelled);
    ASSERT_FALSE(field);
    EXPECT_EQ(field.error().code, ErrorCode::cancelled);
}

TEST(DistanceField, AnObstacleThatIsInsideOutIsSolid) {
    Mesh cube = make_wavy_cube({.resolution = 4, .amplitude = 0});
    OutwardReport outward;
    const DistanceField right = DistanceField::create(cube, 1, 0, kAllThreads, &outward).value();
    EXPECT_TRUE(outward.is_as_it_was());
    for (std::size_t f = 0; f < cube.face_count(); ++f)
        std::reverse(cube.corners.begin() + cube.face_offsets[f], cube.corners.begin() + cube.face_offsets[f + 1]);
    const DistanceField turned = DistanceField::create(cube, 1, 0, kAllThreads, &outward).value();
    EXPECT_EQ(outward.inward_parts, 1u);
    EXPECT_LT(turned.at(Vec3f::Zero()).distance, 0);
    for (const Vec3f& p : {Vec3f(0, 0, 0), Vec3f(0.4f, 0.1f, 0), Vec3f(0.7f, 0, 0.2f)})
        EXPECT_NEAR(turned.at(p).distance, right.at(p).distance, 1e-6f);
}

} // namespace
} // namespace filigree
