#include "filigree/sample.h"

#include "filigree/mesh.h"
#include "sample/bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace filigree {
namespace {

TEST(SampleInside, AutomaticTakesScanForClosedAndWindingForOpen) {
    const Mesh cube = make_wavy_cube({.resolution = 16});
    InsideReport report;
    ASSERT_TRUE(sample_inside(cube, lattice_over(cube, 0.05), {}, kAllThreads, &report));
    EXPECT_EQ(report.used, InsideMethod::scan);
    EXPECT_GT(report.scan.crossings, 0u);
    const Mesh open = without_faces(cube, cube.face_count() - 3);
    ASSERT_TRUE(sample_inside(open, lattice_over(open, 0.05), {}, kAllThreads, &report));
    EXPECT_EQ(report.used, InsideMethod::winding);
    EXPECT_GT(report.closure.open_edges, 0u);
}

TEST(SampleInside, ThreeWaysAgreeOnClosedMeshes) {
    for (const Mesh& mesh :
         {make_wavy_cube({.resolution = 20}), make_wavy_sphere({.resolution = 12}), make_torus({.resolution = 12})}) {
        const Lattice lattice = lattice_over(mesh, bounds(mesh.positions).diagonal() / 31);
        const Occupancy scan = sample_inside(mesh, lattice, by(InsideMethod::scan), kAllThreads).value();
        const Occupancy rays = sample_inside(mesh, lattice, by(InsideMethod::rays), kAllThreads).value();
        const Occupancy winding = sample_inside(mesh, lattice, by(InsideMethod::winding), kAllThreads).value();
        EXPECT_GT(scan.count(), 500u);
        EXPECT_EQ(scan.bits, rays.bits);
        EXPECT_EQ(scan.bits, winding.bits);
    }
}

TEST(SampleInside, FacesMayRunEitherWay) {
    Mesh mesh = make_wavy_sphere({.resolution = 12});
    const Lattice lattice = lattice_over(mesh, bounds(mesh.positions).diagonal() / 31);
    const Occupancy right = sample_inside(mesh, lattice, {}, kAllThreads).value();
    std::mt19937 random(3);
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        if (random() % 2 == 0)
            std::reverse(mesh.corners.begin() + mesh.face_offsets[f], mesh.corners.begin() + mesh.face_offsets[f + 1]);
    InsideReport report;
    EXPECT_EQ(sample_inside(mesh, lattice, {}, kAllThreads, &report).value().bits, right.bits);
    EXPECT_EQ(report.used, InsideMethod::scan);
    const Mesh open = without_faces(mesh, mesh.face_count() - 1); // winding numbers need the way
    const Occupancy nearly = sample_inside(open, lattice, {}, kAllThreads, &report).value();
    EXPECT_EQ(report.used, InsideMethod::winding);
    EXPECT_NEAR(double(nearly.count()) / double(right.count()), 1, 0.01);
}

TEST(SampleInside, AnOpenMeshIsNotScanned) {
    const Mesh cube = make_wavy_cube({.resolution = 8});
    const Mesh open = without_faces(cube, cube.face_count() - 1);
    for (InsideMethod method : {InsideMethod::scan, InsideMethod::rays}) {
        const auto refused = sample_inside(open, lattice_over(open, 0.1), by(method), kAllThreads);
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
    const double closed = double(sample_inside(cube, lattice, {}, kAllThreads)->count());
    const double with_hole = double(sample_inside(open, lattice, {}, kAllThreads)->count());
    EXPECT_NEAR(with_hole / closed, 1, 0.01);
}

TEST(SampleInside, EmptyMeshIsRefused) {
    const auto refused = sample_inside(Mesh{}, Lattice{}, {}, kAllThreads);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
}

TEST(SampleInside, OnePreparationServesManyLattices) {
    const Mesh cube = make_wavy_cube({.resolution = 10});
    const Mesh open = without_faces(cube, cube.face_count() - 3);
    for (const InsideMethod method : {InsideMethod::scan, InsideMethod::rays, InsideMethod::winding}) {
        const Mesh& mesh = method == InsideMethod::winding ? open : cube;
        const InsideSampler sampler = InsideSampler::create(mesh, by(method), kAllThreads).value();
        EXPECT_EQ(sampler.used(), method);
        for (const double spacing : {0.21, 0.11, 0.21})
            EXPECT_EQ(sampler.inside(lattice_over(mesh, spacing), kAllThreads)->bits,
                      sample_inside(mesh, lattice_over(mesh, spacing), by(method), kAllThreads)->bits);
    }
}

TEST(SampleInside, AllMethodsKeepToTheMemoryAllowed) {
    const Mesh cube = make_wavy_cube({.resolution = 10});
    const Mesh open = without_faces(cube, cube.face_count() - 3);
    for (const InsideMethod method : {InsideMethod::scan, InsideMethod::rays, InsideMethod::winding}) {
        InsideOptions options = by(method);
        options.most_bytes = 1000;
        const auto refused = sample_inside(method == InsideMethod::winding ? open : cube, lattice_over(cube, 0.05),
                                           options, kAllThreads);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
        EXPECT_NE(refused.error().message.find("larger spacing"), std::string::npos) << refused.error().message;
    }
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
