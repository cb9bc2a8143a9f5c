#include "filigree/mesh.h"
#include "filigree/mesh/measured_surface.h"

#include "filigree/mesh/closest_point.h"
#include "threads.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

namespace filigree {
namespace {

MeshDistance distance(const Mesh& a, const Mesh& b, std::size_t samples = 1000) {
    return *mesh_distance(a, b, samples, RunContext(1));
}

Mesh square(double side, double z) {
    Mesh mesh = make_wavy_plane({.resolution = 4, .amplitude = 0, .size = side});
    for (Vec3f& p : mesh.positions) p.z() = float(z);
    return mesh;
}

TEST(MeshDistance, ToItselfIsZero) {
    const Mesh mesh = make_wavy_cube({.resolution = 16});
    const MeshDistance d = distance(mesh, mesh);
    EXPECT_EQ(d.vertices->rms, 0);
    EXPECT_EQ(d.vertices->max, 0);
    EXPECT_EQ(d.vertices->normal_max_deg, 0);
    EXPECT_EQ(d.vertices->per_vertex, std::vector<float>(mesh.vertex_count()));
    EXPECT_LT(d.surfaces->hausdorff, 1e-7); // samples are rounded to float
    EXPECT_NEAR(d.diagonal, std::sqrt(3), 0.2);
}

TEST(MeshDistance, OfParallelSquaresInAnyScale) {
    for (const double scale : {1e-30, 1.0, 1e30}) {
        const MeshDistance d = distance(square(scale, 0), square(scale, scale / 4));
        EXPECT_NEAR(d.vertices->rms / scale, 0.25, 1e-7);
        EXPECT_NEAR(d.vertices->max / scale, 0.25, 1e-7);
        EXPECT_EQ(d.vertices->normal_max_deg, 0);
        EXPECT_NEAR(d.surfaces->hausdorff / scale, 0.25, 1e-7);
        EXPECT_NEAR(d.surfaces->mean_distance / scale, 0.25, 1e-7);
        EXPECT_NEAR(d.surfaces->rms_distance / scale, 0.25, 1e-7);
        EXPECT_NEAR(d.diagonal / scale, std::sqrt(2), 1e-6);
    }
}

TEST(VertexDistance, IsThatOfTheWholeComparison) {
    const Mesh a = make_wavy_sphere({.resolution = 8});
    Mesh b = a;
    for (Vec3f& p : b.positions) p.x() *= 1.5f;
    const RunContext context(1);
    const VertexDistance expected = *distance(a, b).vertices;
    for (const VertexDistance& d :
         {vertex_distance(a, b, context).value(), vertex_distance(a, a.positions, b.positions, context)}) {
        EXPECT_EQ(d.rms, expected.rms);
        EXPECT_EQ(d.max, expected.max);
        EXPECT_EQ(d.max_vertex, expected.max_vertex);
        EXPECT_EQ(d.normal_p95_deg, expected.normal_p95_deg);
        EXPECT_EQ(d.per_vertex, expected.per_vertex);
    }
    EXPECT_GT(expected.rms, 0.01);
    b.origin.y() += 2; // the shapes alone know no origin
    EXPECT_GT(vertex_distance(a, b, context)->rms, 1.9);
}

TEST(VertexDistance, NeedsAsManyVertices) {
    const Result<VertexDistance> d =
        vertex_distance(make_wavy_plane({.resolution = 4}), make_wavy_plane({.resolution = 5}), RunContext(1));
    ASSERT_FALSE(d.ok());
    EXPECT_EQ(d.error().code, ErrorCode::mismatch);
    EXPECT_NE(d.error().message.find("25 and 36"), std::string::npos) << d.error().message;
}

TEST(MeshDistance, SaysOnlyWhatItLookedAt) {
    Mesh points; // as many vertices as the other mesh, and no faces
    points.positions = make_wavy_plane({.resolution = 4}).positions;
    const auto d = distances_to_surface(make_wavy_plane({.resolution = 4}), points, RunContext(1));
    EXPECT_EQ(d.error().code, ErrorCode::unsuitable);
    EXPECT_EQ(d.error().message.find("same number"), std::string::npos) << d.error().message;
}

TEST(MeshDistance, IsNotTheSameBothWays) {
    const MeshDistance d = distance(square(1, 0), square(3, 0)); // the small one lies in the large one
    EXPECT_LT(d.surfaces->max_a_to_b, 1e-7);
    EXPECT_LT(d.surfaces->rms_a_to_b, 1e-7);
    EXPECT_GT(d.surfaces->rms_b_to_a, 0.1);
    EXPECT_NEAR(d.surfaces->max_b_to_a, std::sqrt(2), 1e-6); // corner to corner
    EXPECT_EQ(d.surfaces->hausdorff, d.surfaces->max_b_to_a);
}

TEST(MeshDistance, OfSamplesConvergesToTheIntegral) {
    // a square turned about one side by the angle of 3-4-5: what is t from that side is 3/5 t from the other square,
    // both ways, since every foot lies within
    const Mesh flat = square(2, 0);
    Mesh turned = flat;
    for (Vec3f& p : turned.positions) p = Vec3f(0.8f * (p.x() + 1) - 1, p.y(), 0.6f * (p.x() + 1));
    const MeshDistance d = distance(turned, flat, 100000);
    EXPECT_NEAR(d.surfaces->max_a_to_b, 1.2, 1e-6);
    EXPECT_NEAR(d.surfaces->max_b_to_a, 1.2, 1e-6);
    EXPECT_NEAR(d.surfaces->mean_distance, 0.6, 1e-3);
    EXPECT_NEAR(d.surfaces->rms_distance, 1.2 / std::sqrt(3), 1e-3);
    EXPECT_NEAR(d.surfaces->rms_a_to_b, 1.2 / std::sqrt(3), 1e-3);
    EXPECT_NEAR(d.surfaces->rms_b_to_a, 1.2 / std::sqrt(3), 1e-3);
    EXPECT_NEAR(d.vertices->normal_mean_deg, 36.8698976, 1e-5);
    EXPECT_NEAR(d.vertices->normal_p95_deg, 36.8698976, 1e-5);
}

TEST(MeshDistance, PercentileAndWorstVertex) {
    Mesh a = square(1, 0);
    Mesh b = a;
    b.positions[7].z() += 0.5f;
    b.positions[9].z() -= 0.25f;
    const VertexDistance d = *distance(a, b).vertices;
    EXPECT_EQ(d.max, 0.5);
    EXPECT_EQ(d.max_vertex, 7u);
    EXPECT_EQ(d.per_vertex[9], 0.25f);
    EXPECT_NEAR(d.rms, std::sqrt((0.25 + 0.0625) / 25), 1e-12);
    EXPECT_GE(d.normal_max_deg, d.normal_p95_deg);
    EXPECT_GT(d.normal_p95_deg, d.normal_mean_deg);
}

TEST(MeshDistance, RespectsOrigins) {
    Mesh a = make_wavy_sphere({.resolution = 8}), b = a;
    a.origin = Vec3d(500000, 4000000, 100);
    b.origin = a.origin + Vec3d(0.001, 0, 0);
    EXPECT_NEAR(distance(a, b).vertices->max, 0.001, 1e-9);
    EXPECT_NEAR(distance(a, b).vertices->rms, 0.001, 1e-9);
    EXPECT_NEAR(distance(a, b).surfaces->hausdorff, 0.001, 1e-5);
    // the same place said in two ways
    b.origin = a.origin + Vec3d(2, 0, 0);
    for (Vec3f& p : b.positions) p.x() -= 2;
    EXPECT_LT(distance(a, b).vertices->max, 1e-6);
    EXPECT_LT(distance(a, b).surfaces->hausdorff, 1e-6);
}

TEST(MeshDistance, LeavesOutWhatDoesNotApply) {
    const Mesh sphere = make_wavy_sphere({.resolution = 4}), finer = make_wavy_sphere({.resolution = 8});
    EXPECT_FALSE(distance(sphere, finer).vertices);
    EXPECT_TRUE(distance(sphere, finer).surfaces);
    Mesh points;
    points.positions = {{0, 0, 0}, {3, 4, 0}};
    EXPECT_FALSE(distance(points, sphere).surfaces);
    EXPECT_EQ(distance(points, points).vertices->normal_max_deg, 0);
    EXPECT_EQ(distance(points, points).relative(2.5), 0.5);
    EXPECT_EQ(distance(points, Mesh{}).relative(2.5), 0); // no extent to take a fraction of
    EXPECT_EQ(distance(Mesh{}, Mesh{}).vertices->rms, 0);
    EXPECT_EQ(distance(Mesh{}, Mesh{}).vertices->max_vertex, kNoIndex);
    EXPECT_EQ(distance(Mesh{}, sphere).diagonal, distance(sphere, sphere).diagonal);
    Mesh collapsed = sphere; // faces, but no area
    for (Vec3f& p : collapsed.positions) p.setZero();
    EXPECT_NEAR(distance(collapsed, sphere).surfaces->max_b_to_a, 0.52, 0.02);
}

TEST(MeshDistance, OfTheTwoWaysGivesTheWhole) {
    const Mesh a = make_wavy_cube({.resolution = 12}), b = make_wavy_sphere({.resolution = 12}); // as many vertices
    const SurfaceDistance d = *distance(a, b, 5000).surfaces;
    const double both = (d.rms_a_to_b * d.rms_a_to_b + d.rms_b_to_a * d.rms_b_to_a) / 2;
    EXPECT_NEAR(d.rms_distance, std::sqrt(both), 1e-12);
    EXPECT_GT(std::abs(d.rms_a_to_b - d.rms_b_to_a), 1e-3); // corners stand out of a ball
    const SurfaceDistance back = *distance(b, a, 5000).surfaces;
    EXPECT_NEAR(back.rms_a_to_b, d.rms_b_to_a, 1e-6);
    EXPECT_NEAR(back.rms_b_to_a, d.rms_a_to_b, 1e-6);
}

TEST(MeshDistance, OfManyVerticesIsThatOfEachOne) { // the search goes from sample to sample
    const Mesh a = make_wavy_cube({.resolution = 20}), b = make_wavy_sphere({.resolution = 6});
    const std::vector<Triangle> triangles = triangulate(b).triangles;
    double max = 0, squares = 0;
    for (const Vec3f& p : a.positions) {
        double closest = std::numeric_limits<double>::infinity();
        for (const auto& [i, j, k] : triangles)
            closest = std::min(closest,
                               closest_point_on_triangle(p, b.positions[i], b.positions[j], b.positions[k]).distance);
        max = std::max(max, closest);
        squares += closest * closest;
    }
    const SurfaceDistance d = *distance(a, b, 0).surfaces;
    EXPECT_EQ(d.max_a_to_b, max);
    EXPECT_EQ(d.rms_a_to_b, std::sqrt(squares / double(a.vertex_count())));
}

TEST(MeshDistance, IsSeededAndIndependentOfThreads) {
    const Mesh a = make_wavy_cube({.resolution = 24}), b = make_wavy_sphere({.resolution = 24});
    const auto mean = [&](unsigned threads, std::uint64_t seed) {
        RunContext context(threads);
        context.seed = seed;
        return mesh_distance(a, b, 5000, context)->surfaces->mean_distance;
    };
    EXPECT_NE(mean(1, 1), mean(1, 2));
    EXPECT_NEAR(mean(1, 1), mean(1, 2), 1e-3);
    FILIGREE_NEEDS_TWO_THREADS();
    EXPECT_EQ(mean(1, 1), mean(2, 1));
}

TEST(MeshDistance, AMeasuredSurfaceGivesTheSameToTheBitAgainAndAgain) {
    const Mesh whole = make_wavy_sphere({.resolution = 20});
    MeasuredSurface surface = MeasuredSurface::create(whole, 500, RunContext(1)).value();
    for (const unsigned resolution : {4u, 30u, 8u, 60u}) { // fewer and more samples than triangles
        Mesh other = make_wavy_sphere({.resolution = resolution});
        other.origin = Vec3d(0.01, 0, 0);
        const SurfaceDistance again = surface.distance_of(other, RunContext(1)).value();
        const SurfaceDistance fresh = *mesh_distance(other, whole, 500, RunContext(1))->surfaces;
        EXPECT_EQ(again.rms_distance, fresh.rms_distance);
        EXPECT_EQ(again.hausdorff, fresh.hausdorff);
        EXPECT_EQ(again.max_b_to_a, fresh.max_b_to_a);
    }
}

TEST(MeshDistance, CanBeCancelled) {
    const Mesh mesh = make_wavy_cube({.resolution = 8});
    const RunContext context(1);
    context.cancel();
    EXPECT_EQ(mesh_distance(mesh, mesh, 100, context).error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
