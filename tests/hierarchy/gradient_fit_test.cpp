#include "filigree/hierarchy/gradient_fit.h"

#include "filigree/core/random.h"
#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"
#include "stripping.h"
#include "threads.h"

#include <gtest/gtest.h>
#include <numbers>

namespace filigree {
namespace {

template <class Map>
std::vector<Vec3f> mapped(std::span<const Vec3f> positions, const Map& map) {
    std::vector<Vec3f> out;
    for (const Vec3f& p : positions) out.push_back(Vec3d(map(p.cast<double>())).cast<float>());
    return out;
}

double largest_error(std::span<const Mat3f> gradients, const Mat3d& expected) {
    double largest = 0;
    for (const Mat3f& a : gradients) largest = std::max(largest, (a.cast<double>() - expected).norm());
    return largest;
}

std::vector<Mesh> meshes_with_bad_rings() {
    std::vector<Mesh> meshes = {make_wavy_sphere({.resolution = 12}), make_bar({.resolution = 3})};
    Mesh triangle, line, fan, points;
    triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.add_face(Triangle{0, 1, 2});
    line.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 0}};
    line.add_face(Triangle{0, 1, 2});
    line.add_face(Triangle{0, 1, 3});
    fan.positions = {{0, 0, 0}};
    for (unsigned k = 0; k < 200; ++k)
        fan.positions.emplace_back(std::cos(0.0314159f * float(k)), std::sin(0.0314159f * float(k)), 0.0f);
    for (Index k = 1; k <= 200; ++k) fan.add_face(Triangle{0, k, k % 200 + 1});
    points.positions = {{1, 2, 3}, {4, 5, 6}};
    for (const Mesh& mesh : {triangle, line, fan, points}) meshes.push_back(mesh);
    for (const float size : {1e-30f, 1e30f}) {
        meshes.push_back(make_wavy_cube({.resolution = 6}));
        for (Vec3f& p : meshes.back().positions) p *= size;
    }
    return meshes;
}

TEST(GradientFit, IsTheIdentityAtRest) {
    const std::vector<Mesh> meshes = meshes_with_bad_rings();
    for (std::size_t m = 0; m < meshes.size(); ++m) {
        const Mesh& mesh = meshes[m];
        const GradientFit fit(mesh, kOneThread);
        EXPECT_LT(largest_error(fit.fit(mesh.positions, kOneThread), Mat3d::Identity()), 1e-6) << m;
    }
}

TEST(GradientFit, RigidMotionsAndUniformScaleAreExact) {
    const Mat3d turn = Eigen::AngleAxisd(2, Vec3d(1, -1, 0.5).normalized()).toRotationMatrix();
    const Mesh mesh = make_wavy_sphere({.resolution = 16});
    for (const double scale : {0.1, 1.0, 50.0}) {
        const auto moved =
            mapped(mesh.positions, [&](const Vec3d& p) { return Vec3d(scale * turn * (p + Vec3d(1, 2, 3))); });
        const GradientFit fit(mesh, kOneThread);
        EXPECT_LT(largest_error(fit.fit(moved, kOneThread), scale * turn), 1e-4 * scale);
    }
}

/// A quadratic deformation, f(p) = (x, y, z) + (x y, x^2 / 2, x y): its gradient is met up to O(h).
TEST(GradientFit, QuadraticsToFirstOrder) {
    const auto f = [](const Vec3d& p) { return Vec3d(p + Vec3d(p.x() * p.y(), p.x() * p.x() / 2, p.x() * p.y())); };
    const auto error_at = [&](unsigned resolution) {
        const Mesh mesh = make_wavy_sphere({.resolution = resolution, .amplitude = 0});
        const GradientFit fit(mesh, kOneThread);
        const auto moved = mapped(mesh.positions, f);
        const std::vector<Vec3f> rest_normals = vertex_normals(mesh, mesh.positions, kOneThread);
        const auto a = fit.fit(moved, kOneThread);
        double in_plane = 0;
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
            const Vec3d p = mesh.positions[v].cast<double>(), n = rest_normals[v].cast<double>();
            Mat3d g = Mat3d::Identity();
            g(0, 0) += p.y(), g(0, 1) += p.x(), g(1, 0) += p.x(), g(2, 0) += p.y(), g(2, 1) += p.x();
            in_plane = std::max(in_plane, ((a[v].cast<double>() - g) * (Mat3d::Identity() - n * n.transpose())).norm());
        }
        return in_plane;
    };
    const double coarse = error_at(8), fine = error_at(32);
    EXPECT_LT(fine, coarse / 2);
    EXPECT_LT(fine, 0.05);
}

TEST(GradientFit, CollapsedDriversGiveFiniteGradients) {
    const Mesh mesh = make_wavy_cube({.resolution = 8});
    const GradientFit fit(mesh, kOneThread);
    for (const float squash : {0.0f, 1e-20f}) {
        const auto moved =
            mapped(mesh.positions, [&](const Vec3d& p) { return Vec3d(squash * p.x(), squash * p.y(), 0); });
        for (const Mat3f& a : fit.fit(moved, kOneThread)) ASSERT_TRUE(a.allFinite());
    }
}

TEST(GradientFit, NoThreadChangesAByte) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh mesh = make_wavy_sphere({.resolution = 32});
    const auto moved =
        mapped(mesh.positions, [](const Vec3d& p) { return Vec3d(p.x() * p.y(), p.y(), p.z() + p.x()); });
    const auto one = GradientFit(mesh, kOneThread).fit(moved, kOneThread);
    const RunContext two(2);
    EXPECT_EQ(GradientFit(mesh, two).fit(moved, two), one);
}

const Mat3d kRotation = Eigen::AngleAxisd(1.1, Vec3d(0.3, 1, -0.4).normalized()).toRotationMatrix();

/// Stretched, sheared and turned.
const Mat3d kAffine = (Mat3d() << 1.4, 0.3, -0.2, 0.1, 0.7, 0.4, -0.5, 0.2, 1.1).finished();

Vec3d affinely(const Vec3d& p) { return kAffine * p + Vec3d(1, -2, 3); }

/// Largest difference from an affine map's gradient over all vertices, from positions alone.
double affine_error(const Mesh& mesh) {
    const GradientFit fit(mesh, kOneThread);
    return largest_error(fit.fit(mapped(mesh.positions, affinely), kOneThread), kAffine);
}

TEST(GradientFit, AffineMapsAreExactWhereNeighboursSpread) {
    EXPECT_LT(affine_error(make_wavy_sphere({.resolution = 16})), 1e-4);
    EXPECT_LT(affine_error(make_bar({.resolution = 4})), 1e-4);
    // Its sides are flat and seven edges wide at least: one neighbour in four is of a sparser set, which sees past
    // them.
    EXPECT_LT(affine_error(make_wavy_cube({.resolution = 8, .amplitude = 0})), 1e-4);
}

TEST(GradientFit, APlateAnEighthOfAnEdgeThickIsSolid) {
    Mesh plate = make_wavy_cube({.resolution = 8, .amplitude = 0});
    for (Vec3f& p : plate.positions) p.z() /= 64;
    EXPECT_LT(affine_error(plate), 2e-3);
}

TEST(GradientFit, ASheetTurnsAndGrowsWithItsPlane) {
    const Mesh sheet = make_wavy_plane({.resolution = 10, .amplitude = 0});
    const GradientFit fit(sheet, kOneThread);
    const auto turned = mapped(sheet.positions, [](const Vec3d& p) { return Vec3d(kRotation * p); });
    const auto twice = mapped(sheet.positions, [](const Vec3d& p) { return Vec3d(2 * kRotation * p); });
    EXPECT_LT(largest_error(fit.fit(turned, kOneThread), kRotation), 1e-5);
    EXPECT_LT(largest_error(fit.fit(twice, kOneThread), 2 * kRotation), 1e-4);
    // The normal column grows with the root of the area, whatever the stretch's direction.
    const auto longer =
        mapped(sheet.positions, [](const Vec3d& p) { return Vec3d(kRotation * Vec3d(4 * p.x(), p.y(), p.z())); });
    EXPECT_LT(largest_error(fit.fit(longer, kOneThread), kRotation * Vec3d(4, 1, 2).asDiagonal()), 1e-4);
}

/// From a sheet to a plate, in steps of thickness: no gradient may jump from one step to the next.
TEST(GradientFit, TheNormalColumnTakesOverContinuously) {
    const Mesh cube = make_wavy_cube({.resolution = 8, .amplitude = 0});
    std::vector<Mat3f> previous;
    for (double thickness = 1e-5; thickness < 1e-2; thickness *= 1.05) {
        Mesh plate = cube;
        for (Vec3f& p : plate.positions) p.z() *= float(thickness);
        const GradientFit fit(plate, kOneThread);
        const auto moved = mapped(plate.positions, [](const Vec3d& p) { return Vec3d(p.x(), p.y(), 2 * p.z()); });
        const std::vector<Mat3f> now = fit.fit(moved, kOneThread);
        for (std::size_t v = 0; v < previous.size(); ++v)
            ASSERT_LT((now[v] - previous[v]).norm(), 0.1) << thickness << ' ' << v;
        previous = now;
    }
}

/// Points of two meshes, one after the other.
Mesh side_by_side(const Mesh& a, const Mesh& b) {
    Mesh both = a;
    both.positions.insert(both.positions.end(), b.positions.begin(), b.positions.end());
    for (std::size_t f = 0; f < b.face_count(); ++f) {
        std::vector<Index> face;
        for (Index v : b.face(f)) face.push_back(v + static_cast<Index>(a.vertex_count()));
        both.add_face(face);
    }
    return both;
}

TEST(GradientFit, PartsThatTouchSlideOnEachOther) {
    const Mesh lower = make_wavy_cube({.resolution = 8, .amplitude = 0});
    Mesh upper = lower;
    for (Vec3f& p : upper.positions) p += Vec3f(0.03f, 0.05f, 1); // on top of the lower
    const Mesh both = side_by_side(lower, upper);
    std::vector<Vec3f> moved = both.positions;
    for (std::size_t v = lower.vertex_count(); v < moved.size(); ++v)
        moved[v] = (kRotation * moved[v].cast<double>() + Vec3d(0.4, 0, 0)).cast<float>();
    const std::vector<Mat3f> a = GradientFit(both, kOneThread).fit(moved, kOneThread);
    EXPECT_LT(largest_error(std::span(a).first(lower.vertex_count()), Mat3d::Identity()), 1e-4);
    EXPECT_LT(largest_error(std::span(a).subspan(lower.vertex_count()), kRotation), 1e-4);
}

TEST(GradientFit, DoubledVerticesCountOnce) {
    const Mesh mesh = make_wavy_sphere({.resolution = 12});
    EXPECT_LT(affine_error(filigree_test::soup(mesh)), 1e-4);
    Mesh almost = side_by_side(mesh, mesh); // twice, and not quite at the same places
    for (std::size_t v = mesh.vertex_count(); v < almost.positions.size(); ++v) almost.positions[v] *= 1.000001f;
    EXPECT_LT(affine_error(almost), 1e-3);
}

TEST(GradientFit, NoiseIsAmplifiedTenfoldAtMost) {
    const Mesh mesh = make_wavy_sphere({.resolution = 32});
    const GradientFit fit(mesh, kOneThread);
    const double edge = (mesh.positions[mesh.face(0)[0]] - mesh.positions[mesh.face(0)[1]]).norm();
    std::vector<Vec3f> moved = mesh.positions;
    std::uint64_t counter = 0;
    for (Vec3f& p : moved)
        for (int k = 0; k < 3; ++k) p[k] += float(1e-3 * edge * (2 * random_unit(7, counter++) - 1));
    double squared = 0;
    const std::vector<Mat3f> a = fit.fit(moved, kOneThread);
    for (const Mat3f& gradient : a) squared += (gradient - Mat3f::Identity()).squaredNorm();
    EXPECT_LT(std::sqrt(squared / double(a.size())), 1e-2); // about seven thousandths, of one
}

TEST(GradientFit, PointsWithoutFacesHaveGradientsToo) {
    Mesh points;
    points.positions = make_wavy_sphere({.resolution = 12}).positions;
    EXPECT_LT(affine_error(points), 1e-4);
    Mesh line;
    for (int k = 0; k < 20; ++k) line.positions.emplace_back(0.1f * float(k), 0.05f * float(k), 0.0f);
    const GradientFit fit(line, kOneThread);
    const auto moved = mapped(line.positions, [](const Vec3d& p) { return Vec3d(2 * kRotation * p); });
    const Vec3d along = (line.positions[1] - line.positions[0]).cast<double>().normalized();
    for (const Mat3f& a : fit.fit(moved, kOneThread)) {
        EXPECT_LT((a.cast<double>() * along - 2 * kRotation * along).norm(), 1e-4);
        EXPECT_LT((a.transpose() * a - 4 * Mat3f::Identity()).norm(), 1e-3); // turned and scaled, in every direction
    }
}

TEST(GradientFit, LinesTurnByAnyAngle) {
    for (const Vec3d& way :
         {Vec3d(0.1, 0.05, 0), Vec3d(0.03, -0.07, 0.11), Vec3d(-0.2, 0.013, 0.007), Vec3d(0, 0, 0.1)})
        for (const double degrees : {0.0, 90.0, 179.0, 179.9, 179.98, 179.99, 180.0}) {
            SCOPED_TRACE(std::to_string(degrees) + " degrees");
            Mesh line;
            for (int k = 0; k < 20; ++k) line.positions.push_back((k * way).cast<float>());
            const GradientFit fit(line, kOneThread);
            const Eigen::AngleAxisd turn(degrees * std::numbers::pi / 180, way.unitOrthogonal());
            const auto moved = mapped(line.positions, [&](const Vec3d& p) { return Vec3d(turn * p); });
            for (const Mat3f& a : fit.fit(moved, kOneThread)) {
                ASSERT_LT((a.cast<double>() * way - turn * way).norm(), 1e-4 * way.norm());
                ASSERT_LT((a.transpose() * a - Mat3f::Identity()).norm(), 1e-3); // a rotation
                ASSERT_GT(a.determinant(), 0);
            }
        }
}

} // namespace
} // namespace filigree
