#include "filigree/remesh/feature_curves.h"

#include "prepared.h"

namespace filigree {
namespace {

using namespace filigree_test;

/// Angle between the normals of a half-edge's two triangles, degrees; 0 on borders.
double angle_at(const Prepared& on, Index h) {
    if (on.twins[h] == kNoIndex) return 0;
    const auto normal = [&](Index t) {
        const auto& [a, b, c] = on.surface.triangles[t];
        const auto& p = on.surface.positions;
        return Vec3d((p[b] - p[a]).cross(p[c] - p[a])).normalized();
    };
    return std::acos(std::clamp(normal(h / 3).dot(normal(on.twins[h] / 3)), -1.0, 1.0)) * 180 / std::numbers::pi;
}

void expect_consistent(const Prepared& on, double angle_deg) {
    std::size_t marked = 0;
    for (Index h = 0; h < on.twins.size(); ++h) {
        if (!on.curves.half_edges[h]) continue;
        ++marked;
        ASSERT_NE(on.twins[h], kNoIndex) << "borders are not marked";
        EXPECT_TRUE(on.curves.half_edges[on.twins[h]]);
        EXPECT_GT(angle_at(on, h), angle_deg - 1e-3);
    }
    EXPECT_EQ(on.curves.edge_count, marked / 2);
    EXPECT_EQ(on.curves.corners.size(), on.surface.positions.size());
}

/// A square of side 1 with a crease along x = 0 that fades out both ways; half of it is about `reach` long.
Mesh creased_square(double reach) {
    Mesh mesh = make_wavy_plane({.resolution = 64, .amplitude = 0});
    for (Vec3f& p : mesh.positions) {
        const double x = p.x(), y = p.y() / reach;
        p.z() = float(0.6 * std::abs(x) * std::exp(-100 * x * x - y * y));
    }
    return mesh;
}

TEST(FeatureCurves, OfACubeAreItsTwelveEdges) {
    const Prepared on(plain_cube());
    expect_consistent(on, 40);
    EXPECT_EQ(on.curves.edge_count, 12u);
    for (Index h = 0; h < on.twins.size(); ++h) EXPECT_EQ(on.curves.half_edges[h] != 0, angle_at(on, h) > 45);
}

TEST(FeatureCurves, FollowTheAngle) {
    for (const double angle : {10.0, 30.0, 60.0, 89.0}) {
        const Prepared on(machined_part(), 100, angle);
        expect_consistent(on, angle);
        EXPECT_GT(on.curves.edge_count, 0u);
    }
    EXPECT_EQ(Prepared(machined_part(), 100, 180).curves.edge_count, 0u);
    EXPECT_EQ(Prepared(plain_cube(), 100, 91).curves.edge_count, 0u);
    EXPECT_EQ(Prepared(plain_cube(), 100, 89).curves.edge_count, 12u);
    EXPECT_EQ(Prepared(make_ball({0, 0, 0}, 1)).curves.edge_count, 0u);
}

TEST(FeatureCurves, OfAMachinedPartRunAroundItsSides) {
    const int arc = 24, layers = 12;
    const Prepared on(machined_part(arc, layers), 1000);
    const std::size_t outline = 4 + std::size_t(arc) + 1 + 1; // vertices of a layer
    // two rims; four sharp corners of the outline drawn out, and the inner one; both ends of the arc are smooth enough
    // to belong to it or not, by the angle: the step from (1.2, 0.7) up is straight, and (0, 1.5) to the arc too
    std::size_t upright = 0, rim = 0;
    for (Index h = 0; h < on.twins.size(); ++h) {
        if (!on.curves.half_edges[h]) continue;
        const Vec3d &a = on.surface.positions[half_edge_start(on.surface.triangles, h)],
                    &b = on.surface.positions[half_edge_end(on.surface.triangles, h)];
        (a.z() == b.z() ? rim : upright) += 1;
    }
    EXPECT_EQ(rim, 2 * 2 * outline);
    EXPECT_EQ(upright, 2 * 5 * std::size_t(layers)); // (0,0), (2,0), (2,0.7), (1.2,0.7), (0,1.5)
}

TEST(FeatureCurves, LeaveNoiseOut) {
    // the same short crease, with patches much larger and much smaller than it
    EXPECT_EQ(Prepared(creased_square(0.08), 25).curves.edge_count, 0u);
    const Prepared fine(creased_square(0.08), 40'000);
    expect_consistent(fine, 40);
    EXPECT_GT(fine.curves.edge_count, 4u);
    // one as sharp that is long
    EXPECT_GT(Prepared(creased_square(9), 25).curves.edge_count, 60u);
}

TEST(FeatureCurves, LeaveSpikesOut) {
    // its edges close rings, so none has a free end; all together they are shorter than a patch's side
    Mesh mesh = make_wavy_plane({.resolution = 32, .amplitude = 0});
    mesh.positions[16 * 33 + 16].z() += 0.1f;
    EXPECT_EQ(Prepared(mesh, 4).curves.edge_count, 0u);
    EXPECT_GT(Prepared(mesh, 40'000).curves.edge_count, 0u);
}

TEST(FeatureCurves, LeaveShortSpursOut) {
    Mesh mesh = creased_square(9);
    for (Vec3f& p : mesh.positions)
        p.z() += float(0.6 * std::abs(p.y()) * std::exp(-100 * p.y() * p.y() - 150 * p.x() * p.x()));
    const auto spur_edges = [](const Prepared& on) {
        std::size_t count = 0;
        for (Index h = 0; h < on.twins.size(); ++h) {
            const Vec3d &a = on.surface.positions[half_edge_start(on.surface.triangles, h)],
                        &b = on.surface.positions[half_edge_end(on.surface.triangles, h)];
            count += on.curves.half_edges[h] && a.y() == 0 && b.y() == 0;
        }
        return count;
    };
    EXPECT_EQ(spur_edges(Prepared(mesh, 25)), 0u);
    EXPECT_GT(spur_edges(Prepared(mesh, 40'000)), 0u);
    EXPECT_GT(Prepared(mesh, 25).curves.edge_count, 40u); // the ridge stays
}

TEST(FeatureCurves, TurnsAreCorners) {
    // the border of a square: its four corners and no others
    const Prepared square(make_wavy_plane({.resolution = 16, .amplitude = 0}));
    std::set<Index> found;
    for (Index v = 0; v < square.curves.corners.size(); ++v)
        if (square.curves.corners[v]) found.insert(v);
    ASSERT_EQ(found.size(), 4u);
    for (const Index v : found) {
        EXPECT_NEAR(std::abs(square.surface.positions[v].x()), 0.5, 1e-6);
        EXPECT_NEAR(std::abs(square.surface.positions[v].y()), 0.5, 1e-6);
    }
    // a circle has none
    Mesh disc;
    disc.positions.push_back(Vec3f::Zero());
    for (int i = 0; i < 64; ++i) {
        const double angle = 2 * std::numbers::pi * i / 64;
        disc.positions.push_back(Vec3d(std::cos(angle), std::sin(angle), 0).cast<float>());
    }
    for (Index i = 0; i < 64; ++i) disc.add_face(Triangle{0, 1 + i, 1 + (i + 1) % 64});
    const Prepared round(disc);
    EXPECT_EQ(std::ranges::count(round.curves.corners, 1), 0);
}

TEST(FeatureCurves, EdgeCases) {
    const Prepared triangle(triangle_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}));
    EXPECT_EQ(triangle.curves.edge_count, 0u);
    EXPECT_EQ(triangle.curves.corners.size(), 3u);
    // a triangle without an area has no normal, so its edges are not sharp
    const Prepared flat(triangle_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}}, {{0, 1, 2}, {1, 0, 3}}));
    EXPECT_EQ(flat.curves.edge_count, 0u);
    // folded right back: as sharp as can be
    const Prepared folded(triangle_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2f, 1, 0}}, {{0, 1, 2}, {1, 0, 3}}), 2);
    EXPECT_LE(folded.curves.edge_count, 1u);
}

} // namespace
} // namespace filigree
