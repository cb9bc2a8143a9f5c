#include "filigree/sample/sample_inside.h"

#include "filigree/mesh/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace filigree {
namespace {

const RunContext kContext;

Lattice lattice_over(const Mesh& mesh, double spacing) {
    return make_lattice(bounds(mesh.positions), {.spacing = spacing}).value();
}

Mesh without_faces(Mesh mesh, std::size_t kept) {
    mesh.corners.resize(mesh.face_offsets[kept]);
    mesh.face_offsets.resize(kept + 1);
    return mesh;
}

InsideOptions by(InsideMethod method) {
    InsideOptions options;
    options.method = method;
    return options;
}

TEST(SampleInside, AutomaticTakesScanForClosedAndWindingForOpen) {
    const Mesh cube = make_wavy_cube({.resolution = 16});
    InsideReport report;
    ASSERT_TRUE(sample_inside(cube, lattice_over(cube, 0.05), {}, kContext, &report));
    EXPECT_EQ(report.used, InsideMethod::scan);
    EXPECT_GT(report.scan.crossings, 0u);
    const Mesh open = without_faces(cube, cube.face_count() - 3);
    ASSERT_TRUE(sample_inside(open, lattice_over(open, 0.05), {}, kContext, &report));
    EXPECT_EQ(report.used, InsideMethod::winding);
    EXPECT_GT(report.closure.open_edges, 0u);
}

TEST(SampleInside, ThreeWaysAgreeOnClosedMeshes) {
    for (const Mesh& mesh :
         {make_wavy_cube({.resolution = 20}), make_wavy_sphere({.resolution = 12}), make_torus({.resolution = 12})}) {
        const Lattice lattice = lattice_over(mesh, bounds(mesh.positions).diagonal() / 31);
        const Occupancy scan = sample_inside(mesh, lattice, by(InsideMethod::scan), kContext).value();
        const Occupancy rays = sample_inside(mesh, lattice, by(InsideMethod::rays), kContext).value();
        const Occupancy winding = sample_inside(mesh, lattice, by(InsideMethod::winding), kContext).value();
        EXPECT_GT(scan.count(), 500u);
        EXPECT_EQ(scan.bits, rays.bits);
        EXPECT_EQ(scan.bits, winding.bits);
    }
}

TEST(SampleInside, AnOpenMeshIsNotScanned) {
    const Mesh cube = make_wavy_cube({.resolution = 8});
    const Mesh open = without_faces(cube, cube.face_count() - 1);
    for (InsideMethod method : {InsideMethod::scan, InsideMethod::rays}) {
        const auto refused = sample_inside(open, lattice_over(open, 0.1), by(method), kContext);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
        EXPECT_NE(refused.error().message.find("4 open edges"), std::string::npos) << refused.error().message;
        EXPECT_NE(refused.error().message.find("winding"), std::string::npos);
    }
}

TEST(SampleInside, ASmallHoleChangesLittle) {
    const Mesh cube = make_wavy_cube({.resolution = 24});
    const Mesh open = without_faces(cube, cube.face_count() - 4);
    const Lattice lattice = lattice_over(cube, 0.04);
    const double closed = double(sample_inside(cube, lattice, {}, kContext)->count());
    const double with_hole = double(sample_inside(open, lattice, {}, kContext)->count());
    EXPECT_NEAR(with_hole / closed, 1, 0.01);
}

TEST(SampleInside, EmptyMeshIsRefused) {
    const auto refused = sample_inside(Mesh{}, Lattice{}, {}, kContext);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
}

TEST(SampleInside, SinglePointsGetTheLatticesAnswers) {
    const Mesh mesh = make_wavy_sphere({.resolution = 10});
    const Mesh open = without_faces(mesh, mesh.face_count() - 2);
    for (const Mesh* m : {&mesh, &open}) {
        const Lattice lattice = lattice_over(*m, 0.13);
        const Occupancy occupancy = sample_inside(*m, lattice, {}, kContext).value();
        const InsideTest test = InsideTest::create(*m, {}, kContext).value();
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
        const auto many = test.contains(points, kContext).value();
        for (std::size_t p = 0; p < points.size(); ++p) ASSERT_EQ(many[p] != 0, test.contains(points[p]));
    }
}

TEST(SampleInside, SpacingForACount) {
    const Mesh torus = make_torus({.resolution = 32});
    for (std::size_t wanted : {500u, 20'000u, 300'000u}) {
        const double spacing = spacing_for_count(torus, wanted, {}, kContext).value();
        const double found = double(sample_inside(torus, lattice_over(torus, spacing), {}, kContext)->count());
        EXPECT_NEAR(found / double(wanted), 1, 0.05) << wanted;
    }
    EXPECT_FALSE(spacing_for_count(make_wavy_plane({.resolution = 8, .amplitude = 0}), 100, by(InsideMethod::winding),
                                   kContext));
}

TEST(SampleInside, JitteredPointsStayInTheirCellsAndInside) {
    const Mesh mesh = make_wavy_cube({.resolution = 24});
    const Lattice lattice = lattice_over(mesh, 0.06);
    const auto regular = spread_inside(mesh, lattice, Pattern::lattice, {}, kContext).value();
    const auto jittered = spread_inside(mesh, lattice, Pattern::jitter, {}, kContext).value();
    ASSERT_EQ(regular.size(), jittered.size());
    const InsideTest test = InsideTest::create(mesh, {}, kContext).value();
    std::size_t moved = 0;
    for (std::size_t p = 0; p < regular.size(); ++p) {
        EXPECT_LE((jittered[p] - regular[p]).cwiseAbs().maxCoeff(), lattice.spacing / 2);
        EXPECT_TRUE(test.contains(jittered[p]));
        moved += jittered[p] != regular[p];
    }
    EXPECT_GT(moved, regular.size() * 9 / 10);
    RunContext other;
    other.seed = 2;
    EXPECT_NE(spread_inside(mesh, lattice, Pattern::jitter, {}, other).value(), jittered);
    EXPECT_EQ(spread_inside(mesh, lattice, Pattern::jitter, {}, RunContext(1)).value(), jittered);
}

TEST(SampleInside, PoissonPointsKeepTheirDistanceAndFillTheBody) {
    const Mesh mesh = make_wavy_sphere({.resolution = 16});
    const Lattice lattice = lattice_over(mesh, 0.1);
    const auto points = spread_inside(mesh, lattice, Pattern::poisson, {}, kContext).value();
    const InsideTest test = InsideTest::create(mesh, {}, kContext).value();
    for (std::size_t p = 0; p < points.size(); ++p) {
        EXPECT_TRUE(test.contains(points[p]));
        for (std::size_t q = 0; q < p; ++q) ASSERT_GE((points[p] - points[q]).norm(), 0.8 * lattice.spacing);
    }
    const auto regular = spread_inside(mesh, lattice, Pattern::lattice, {}, kContext).value();
    EXPECT_GT(points.size(), regular.size() * 7 / 10);
    for (const Vec3d& p : regular) { // no hole is left that a point would fit into
        double nearest = 1e9;
        for (const Vec3d& q : points) nearest = std::min(nearest, (p - q).norm());
        EXPECT_LT(nearest, 1.5 * lattice.spacing);
    }
}

TEST(SampleInside, FrustumPointsInsideAreThoseThatRaysFind) {
    const Mesh cube = make_wavy_cube({.resolution = 16});
    Frustum frustum{.eye = {0.3, 0.2, 4}, .target = {0, 0, 0}, .near = 2.5, .far = 5.5, .counts = {20, 20, 20}};
    const auto points = frustum_points(frustum).value();
    ASSERT_EQ(points.size(), 8000u);
    InsideOptions options = by(InsideMethod::rays);
    options.eye = frustum.eye;
    const auto from_eye = InsideTest::create(cube, options, kContext)->contains(points, kContext).value();
    const auto from_elsewhere =
        InsideTest::create(cube, by(InsideMethod::rays), kContext)->contains(points, kContext).value();
    EXPECT_EQ(from_eye, from_elsewhere);
    EXPECT_GT(std::count(from_eye.begin(), from_eye.end(), 1), 200);
    frustum.near = 6;
    EXPECT_EQ(frustum_points(frustum).error().code, ErrorCode::usage);
}

TEST(SampleInside, Cancelled) {
    const Mesh mesh = make_wavy_cube({.resolution = 64});
    for (InsideMethod method : {InsideMethod::scan, InsideMethod::rays, InsideMethod::winding}) {
        RunContext context;
        context.cancel();
        const auto result = sample_inside(mesh, lattice_over(mesh, 0.02), by(method), context);
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().code, ErrorCode::cancelled);
    }
}

} // namespace
} // namespace filigree
