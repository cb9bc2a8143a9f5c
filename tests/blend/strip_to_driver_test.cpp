// Drivers of somebody else's: they need not share a vertex with the mesh.
#include "blend/stripping.h"
#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"
#include "filigree/pose.h"
#include "filigree/restore.h"
#include "threads.h"

#include <numbers>

namespace strip_to_driver_test {

using namespace filigree_test;

namespace {

Stripped bound(Mesh mesh, const Mesh& driver, const RunContext& context = kOneThread) {
    Result<Stripped> result = strip_to_driver(std::move(mesh), driver, context);
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
    if (!result.ok()) return {};
    EXPECT_EQ(check_model(result->model), "");
    return std::move(*result);
}

/// A ball without waves, of other vertices than the wavy one's.
Mesh smooth_ball(unsigned resolution) { return make_wavy_sphere({.resolution = resolution, .amplitude = 0}); }

bool mentions(const std::vector<std::string>& sentences, const char* words) {
    return std::ranges::any_of(sentences, [&](const std::string& s) { return s.find(words) != std::string::npos; });
}

/// Two sheets that face away from each other, `gap` apart.
Mesh two_sheets(unsigned resolution, float amplitude, float gap) {
    const Mesh sheet = make_wavy_plane({.resolution = resolution, .frequency = 3, .amplitude = amplitude});
    Mesh mesh = sheet;
    mesh.uvs = {};
    const auto count = static_cast<Index>(sheet.vertex_count());
    for (const Vec3f& p : sheet.positions) mesh.positions.push_back(p - Vec3f(0, 0, gap));
    for (std::size_t f = 0; f < sheet.face_count(); ++f) {
        std::vector<Index> face(sheet.face(f).rbegin(), sheet.face(f).rend());
        for (Index& v : face) v += count;
        mesh.add_face(face);
    }
    return mesh;
}

Deformation bend(double curvature) {
    const auto position = [=](const Vec3d& p) {
        const double angle = curvature * p.x(), radius = 1 / curvature - p.z();
        return Vec3d(radius * std::sin(angle), p.y(), 1 / curvature - radius * std::cos(angle));
    };
    return {position, {}};
}

} // namespace

TEST(StripToDriver, PosesAreArraysOfTheDriversPositions) {
    const Mesh mesh = make_wavy_sphere({.resolution = 48}), driver = smooth_ball(8);
    const Model model = bound(mesh, driver).model;
    EXPECT_TRUE(same_bytes(driver_positions(model), driver.positions));
    EXPECT_EQ(model.mesh.vertex_count(), mesh.vertex_count() + driver.vertex_count());
    EXPECT_EQ(model.mesh.corners, mesh.corners);
    EXPECT_LT(distance(restored(model, rest_pose(model)), mesh.positions).max, 3e-7);
    Mat3d a;
    a << 1.2, 0.3, -0.1, 0.2, 0.8, 0.4, -0.3, 0.1, 1.1;
    const Deformation moved = affine(a, {1, 2, 3});
    const Pose pose{deformed(moved, driver.positions), {}};
    EXPECT_LT(distance(restored(model, pose), deformed(moved, mesh.positions)).max, 5e-6);
}

/// The driver's vertices are the driver's: a level, a restored mesh, counts and errors have the mesh's own alone.
TEST(StripToDriver, WhatIsRestoredHasTheMeshsOwnVerticesAlone) {
    Mesh mesh = make_wavy_sphere({.resolution = 24});
    mesh.normals.values = vertex_normals(mesh, mesh.positions, kOneThread);
    mesh.uvs.values.assign(mesh.vertex_count(), Vec2f(0.5f, 0.25f));
    mesh.colors.assign(mesh.vertex_count(), Vec4f(1, 0, 0, 1));
    mesh.scalars.push_back({"weight", std::vector<float>(mesh.vertex_count(), 2)});
    const Mesh driver = smooth_ball(8);
    const Model model = strip_to_driver(mesh, driver, kOneThread)->model;
    EXPECT_EQ(model.vertex_count(), mesh.vertex_count());
    EXPECT_EQ(level_counts(model, 1).vertices, mesh.vertex_count());
    EXPECT_EQ(level_counts(model, 0).vertices, driver.vertex_count());
    EXPECT_EQ(vertex_levels(model, 1), std::vector<float>(mesh.vertex_count(), 1));
    EXPECT_EQ(vertex_errors(model, std::vector<float>(driver.vertex_count(), 1)).size(), mesh.vertex_count());
    EXPECT_EQ(make_skin(model, 1, 3, false)->positions.size(), mesh.vertex_count());
    const Restorer restorer = *Restorer::create(model, {}, kOneThread);
    EXPECT_EQ(restorer.vertex_count(), mesh.vertex_count());
    for (const Mesh& finest : {level_mesh(model, 1), *restorer.mesh(rest_pose(model), kOneThread)}) {
        EXPECT_LT(distance(finest.positions, mesh.positions).max, 3e-7);
        EXPECT_EQ(finest.corners, mesh.corners);
        EXPECT_EQ(finest.normals.values.size(), mesh.vertex_count());
        EXPECT_EQ(finest.uvs.values, mesh.uvs.values);
        EXPECT_EQ(finest.colors, mesh.colors);
        EXPECT_EQ(finest.scalars[0].values, mesh.scalars[0].values);
        EXPECT_EQ(check_mesh(finest), "");
    }
}

TEST(StripToDriver, AModelThatSaysSoWronglyIsNoticed) {
    const Mesh mesh = make_wavy_sphere({.resolution = 24});
    Model model = bound(mesh, smooth_ball(8)).model;
    model.mesh.corners[0] = static_cast<Index>(mesh.vertex_count());
    EXPECT_NE(check_model(model), "");
    Model own = stripped(mesh, {.base = 100}).model;
    own.driver_is_behind = true;
    EXPECT_NE(check_model(own), "");
}

/// A smooth driver has all of the waves to carry, so its error is of second order in their height. From positions alone
/// nothing says what happens off a perfect ball: any deformation of space may have a multiple of |p|^2 - r^2 added.
TEST(StripToDriver, CurvedPosesAreFollowed) {
    const Mesh mesh = make_wavy_sphere({.resolution = 64}), driver = smooth_ball(10);
    const Model model = bound(mesh, driver).model;
    const auto warp = make_bend(world_bounds(mesh), Axis::z, 90);
    Mesh bent = mesh;
    warp_mesh(*warp, bent, kOneThread);
    const Pose pose = warp_pose(*warp, model, kOneThread);
    const auto error = [&](const Pose& at) { return distance(restored(model, at), bent.positions).rms; };
    EXPECT_LT(error(pose), 1e-4);
    EXPECT_LT(error({pose.positions, {}}), 2.5e-3);
}

TEST(StripToDriver, ThinPartsHangOnTheirOwnSide) {
    for (const float gap : {0.05f, 1e-3f}) {
        const Mesh mesh = two_sheets(60, 0.03f, gap), driver = two_sheets(12, 0, gap);
        const Stripped result = bound(mesh, driver);
        EXPECT_EQ(result.report.across_gap, 0u);
        // The lower half of the driver goes away; so must the lower half of the mesh, and nothing else.
        std::vector<Vec3f> moved = driver.positions;
        for (std::size_t v = moved.size() / 2; v < moved.size(); ++v) moved[v].z() -= 5;
        const std::vector<Vec3f> all = restored(result.model, {moved, {}});
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
            const float down = mesh.positions[v].z() - all[v].z();
            EXPECT_NEAR(down, v < mesh.vertex_count() / 2 ? 0.0f : 5.0f, 0.05f) << gap << ' ' << v;
        }
    }
}

TEST(StripToDriver, VerticesOfTheDriverMayLieOnTheMesh) {
    const Mesh mesh = make_wavy_cube({.resolution = 24});
    const Model own = stripped(mesh, {.base = 100}).model;
    const Mesh driver = level_mesh(own, 0);
    const Stripped result = bound(mesh, driver);
    const Deformation warp = bend(1);
    const std::vector<Vec3f> there = deformed(warp, driver.positions);
    const std::vector<Vec3f> all = restored(result.model, {there, {}}), before = restored(own, {there, {}});
    EXPECT_LT(distance(all, before).rms, 2e-3);
}

TEST(StripToDriver, AnythingBinds) {
    Mesh points;
    for (int i = 0; i < 50; ++i) points.positions.emplace_back(float(i % 5), float(i / 5 % 5), float(i / 25));
    Mesh flat = points; // triangles without area
    flat.add_face(std::array<Index, 3>{0, 0, 1});
    flat.add_face(std::array<Index, 3>{0, 1, 2});
    Mesh attributes = make_wavy_plane({.resolution = 8});
    attributes.colors.assign(attributes.vertex_count(), Vec4f::Ones());
    attributes.scalars.push_back({"weight", std::vector<float>(attributes.vertex_count(), 2)});
    Mesh one;
    one.positions = {{1, 2, 3}};
    const Mesh far = [] {
        Mesh mesh = make_wavy_sphere({.resolution = 8});
        for (Vec3f& p : mesh.positions) p += Vec3f(1000, 0, 0);
        return mesh;
    }();
    for (const Mesh& mesh : {points, flat, attributes, one, far, soup(attributes)})
        for (const Mesh& driver : {points, flat, attributes, one, far, soup(attributes)}) {
            const Stripped result = bound(mesh, driver);
            const std::vector<Vec3f> rest = restored(result.model, rest_pose(result.model));
            EXPECT_LT(distance(rest, mesh.positions).max, 3e-7);
        }
}

TEST(StripToDriver, SameBytesForAnyThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh mesh = make_wavy_sphere({.resolution = 96}), driver = smooth_ball(12);
    const Model one = bound(mesh, driver).model, two = bound(mesh, driver, RunContext(2)).model;
    const BlendDetail &a = one.detail, &b = two.detail;
    EXPECT_EQ(a.order, b.order);
    EXPECT_EQ(a.u, b.u);
    EXPECT_EQ(a.v, b.v);
}

TEST(StripToDriver, NothingIsRefusedWithASentence) {
    const Mesh mesh = make_wavy_plane({.resolution = 8});
    const auto code = [](const Mesh& m, const Mesh& driver, const RunContext& context) {
        const Result<Stripped> result = strip_to_driver(m, driver, context);
        return result.ok() ? std::optional<ErrorCode>() : result.error().code;
    };
    EXPECT_EQ(code(Mesh{}, mesh, kOneThread), ErrorCode::unsuitable);
    EXPECT_EQ(code(mesh, Mesh{}, kOneThread), ErrorCode::unsuitable);
    EXPECT_EQ(code(mesh, mesh, kOneThread), std::nullopt);
    const RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(code(mesh, mesh, cancelled), ErrorCode::cancelled);
}

TEST(StripToDriver, SaysWhatMakesADriverABadOne) {
    const Mesh ball = make_wavy_sphere({.resolution = 16});
    Mesh cage = smooth_ball(6);
    EXPECT_TRUE(bound(ball, cage).report.warnings.empty());
    Mesh over = cage;
    for (std::size_t f = 0; f < over.face_count(); ++f)
        std::reverse(over.corners.begin() + over.face_offsets[f], over.corners.begin() + over.face_offsets[f + 1]);
    EXPECT_TRUE(mentions(bound(ball, over).report.warnings, "inside out"));
    for (Vec3f& p : cage.positions) p.x() += 1e6f;
    EXPECT_TRUE(mentions(bound(ball, cage).report.warnings, "times as far"));
}

} // namespace strip_to_driver_test
