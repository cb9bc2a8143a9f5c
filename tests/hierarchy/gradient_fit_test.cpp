#include "filigree/hierarchy/gradient_fit.h"

#include "filigree/mesh/normals.h"
#include "filigree/mesh/shapes.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

const RunContext kOneThread(1);
constexpr HeightLaw kLaws[] = {HeightLaw::keep, HeightLaw::inverse, HeightLaw::proportional, HeightLaw::volume};

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
        for (const HeightLaw law : kLaws)
            for (const NormalColumn column : {NormalColumn::fitted, NormalColumn::shell})
                EXPECT_LT(largest_error(fit.fit(mesh.positions, column, law, kOneThread), Mat3d::Identity()), 1e-6)
                    << m << ' ' << height_law_name(law);
        const auto ghosts = fit.rest_ghosts(); // of float length: a tenth of an edge has a digit less
        EXPECT_LT(largest_error(fit.fit_to_ghosts(mesh.positions, ghosts, kOneThread), Mat3d::Identity()), 1e-5) << m;
    }
}

TEST(GradientFit, RigidMotionsAndProportionalScaleAreExact) {
    const Mat3d turn = Eigen::AngleAxisd(2, Vec3d(1, -1, 0.5).normalized()).toRotationMatrix();
    const Mesh mesh = make_wavy_sphere({.resolution = 16});
    const GradientFit fit(mesh, kOneThread);
    for (const double scale : {0.1, 1.0, 50.0}) {
        const auto moved =
            mapped(mesh.positions, [&](const Vec3d& p) { return Vec3d(scale * turn * (p + Vec3d(1, 2, 3))); });
        for (const NormalColumn column : {NormalColumn::fitted, NormalColumn::shell})
            EXPECT_LT(largest_error(fit.fit(moved, column, HeightLaw::proportional, kOneThread), scale * turn),
                      1e-4 * scale);
    }
}

TEST(GradientFit, ShellsHaveTheLawsNormalColumn) {
    const Mesh mesh = make_wavy_plane({.resolution = 8, .amplitude = 0});
    const GradientFit fit(mesh, kOneThread);
    const auto moved = mapped(mesh.positions, [](const Vec3d& p) { return Vec3d(2 * p.x(), p.y(), p.z()); });
    const double expected[] = {1, 1 / std::sqrt(2.0), std::sqrt(2.0), 0.5};
    for (const HeightLaw law : kLaws) {
        const Mat3d a = Vec3d(2, 1, expected[static_cast<int>(law)]).asDiagonal();
        EXPECT_LT(largest_error(fit.fit(moved, NormalColumn::shell, law, kOneThread), a), 1e-3) << height_law_name(law);
        // Given gradients keep their plane part, and get the same column.
        std::vector<Mat3f> given(mesh.vertex_count(), Mat3f(Vec3f(2, 1, 7).asDiagonal()));
        fit.make_shell(given, law);
        EXPECT_LT(largest_error(given, a), 1e-5) << height_law_name(law);
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
        const auto a = fit.fit(moved, NormalColumn::fitted, HeightLaw::proportional, kOneThread);
        const auto with_ghosts = fit.fit_to_ghosts(moved, mapped(fit.rest_ghosts(), f), kOneThread);
        double in_plane = 0, whole = 0;
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
            const Vec3d p = mesh.positions[v].cast<double>(), n = rest_normals[v].cast<double>();
            Mat3d g = Mat3d::Identity();
            g(0, 0) += p.y(), g(0, 1) += p.x(), g(1, 0) += p.x(), g(2, 0) += p.y(), g(2, 1) += p.x();
            in_plane = std::max(in_plane, ((a[v].cast<double>() - g) * (Mat3d::Identity() - n * n.transpose())).norm());
            whole = std::max(whole, (with_ghosts[v].cast<double>() - g).norm());
        }
        return std::pair(in_plane, whole);
    };
    const auto coarse = error_at(8), fine = error_at(32);
    EXPECT_LT(fine.first, coarse.first / 2);
    EXPECT_LT(fine.second, coarse.second / 2);
    EXPECT_LT(fine.first, 0.05);
    EXPECT_LT(fine.second, 0.05);
}

TEST(GradientFit, LawsAreBoundedWhereTheyHaveToBe) {
    EXPECT_EQ(height_law_scale(HeightLaw::keep, 1, 100), 1);
    EXPECT_DOUBLE_EQ(height_law_scale(HeightLaw::inverse, 1, 4), 0.5);
    EXPECT_DOUBLE_EQ(height_law_scale(HeightLaw::proportional, 1, 4), 2);
    EXPECT_DOUBLE_EQ(height_law_scale(HeightLaw::volume, 1, 2), 0.5);
    for (const HeightLaw law : {HeightLaw::inverse, HeightLaw::volume}) {
        EXPECT_DOUBLE_EQ(height_law_scale(law, 1, 0), kMaxHeightScale);
        EXPECT_DOUBLE_EQ(height_law_scale(law, 1, 1e12), 1 / kMaxHeightScale);
    }
    EXPECT_EQ(height_law_scale(HeightLaw::proportional, 1, 0), 0);
    for (const HeightLaw law : kLaws) EXPECT_EQ(height_law_scale(law, 0, 5), 1); // nothing to compare with
}

TEST(GradientFit, CollapsedDriversGiveFiniteGradients) {
    const Mesh mesh = make_wavy_cube({.resolution = 8});
    const GradientFit fit(mesh, kOneThread);
    for (const float squash : {0.0f, 1e-20f}) {
        const auto moved =
            mapped(mesh.positions, [&](const Vec3d& p) { return Vec3d(squash * p.x(), squash * p.y(), 0); });
        for (const HeightLaw law : kLaws)
            for (const NormalColumn column : {NormalColumn::fitted, NormalColumn::shell})
                for (const Mat3f& a : fit.fit(moved, column, law, kOneThread))
                    ASSERT_TRUE(a.allFinite()) << height_law_name(law);
    }
}

TEST(GradientFit, NoThreadChangesAByte) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh mesh = make_wavy_sphere({.resolution = 32});
    const auto moved =
        mapped(mesh.positions, [](const Vec3d& p) { return Vec3d(p.x() * p.y(), p.y(), p.z() + p.x()); });
    const auto one =
        GradientFit(mesh, kOneThread).fit(moved, NormalColumn::fitted, HeightLaw::proportional, kOneThread);
    const RunContext two(2);
    EXPECT_EQ(GradientFit(mesh, two).fit(moved, NormalColumn::fitted, HeightLaw::proportional, two), one);
}

} // namespace
} // namespace filigree
