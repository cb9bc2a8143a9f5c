// Stripping any mesh: the driver is a subset, the levels are nested, and at rest everything comes back.
#include "filigree/strip.h"

#include "blend/stripping.h"
#include "filigree/levels/vertex_order.h"
#include "filigree/mesh.h"
#include "threads.h"

#include <numbers>
#include <random>

using namespace filigree_test;

namespace {

Mesh points_only(std::size_t count) {
    Mesh mesh;
    std::mt19937 random(1);
    std::uniform_real_distribution<float> any(-1, 1);
    for (std::size_t i = 0; i < count; ++i) mesh.positions.emplace_back(any(random), any(random), any(random));
    return mesh;
}

Mesh with_faces(std::vector<Vec3f> positions, const std::vector<Triangle>& triangles) {
    Mesh mesh;
    mesh.positions = std::move(positions);
    for (const Triangle& t : triangles) mesh.add_face(t);
    return mesh;
}

const std::vector<Vec3f> kCorners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

std::vector<std::pair<std::string, Mesh>> tiny_meshes() {
    Mesh repeated = with_faces(kCorners, {{0, 1, 2}, {0, 0, 0}, {1, 1, 3}});
    return {
        {"one triangle", with_faces(kCorners, {{0, 1, 2}})}, // and a loose vertex
        {"two triangles", with_faces(kCorners, {{0, 1, 2}, {1, 3, 2}})},
        {"tetrahedron", with_faces(kCorners, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}})},
        {"back to back", with_faces(kCorners, {{0, 1, 2}, {0, 2, 1}})},
        {"one vertex", with_faces({{3, 4, 5}}, {})},
        {"two points", with_faces({{3, 4, 5}, {3, 4, 6}}, {})},
        {"points", points_only(200)},
        {"the same point", with_faces(std::vector<Vec3f>(9, Vec3f(1, 1, 1)), {})},
        {"a face of one point", with_faces(std::vector<Vec3f>(3, Vec3f(1, 1, 1)), {{0, 1, 2}})},
        {"a line", with_faces({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, {{0, 1, 2}, {1, 2, 3}})},
        {"repeated corners", repeated},
        {"soup", soup(make_wavy_plane({.resolution = 12}))},
        {"three at an edge",
         with_faces({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}}, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}})},
    };
}

std::vector<std::pair<std::string, Mesh>> all_shapes() {
    std::vector<std::pair<std::string, Mesh>> shapes;
    for (const std::string_view name : shape_names()) shapes.emplace_back(name, *make_shape(name, {.resolution = 64}));
    return shapes;
}

Mesh scaled(Mesh mesh, float by) {
    for (Vec3f& p : mesh.positions) p *= by;
    return mesh;
}

} // namespace

TEST(Strip, ShapesComeBack) {
    for (const auto& [name, mesh] : all_shapes()) {
        const Model model = stripped(mesh, {}).model;
        EXPECT_LE(distance(restored(model, rest_pose(model)), mesh.positions).max, 1e-6) << name;
        EXPECT_LT(model.driver().vertices.size(), mesh.vertex_count());
    }
}

TEST(Strip, TinyMeshesComeBackFromEveryBase) {
    for (const auto& [name, mesh] : tiny_meshes())
        for (const std::size_t base : {3u, 4u, 100u}) {
            const Model model = stripped(mesh, {.base = base}).model;
            ASSERT_FALSE(model.levels.empty()) << name;
            EXPECT_LE(distance(restored(model, rest_pose(model)), mesh.positions).max, 1e-6) << name << ' ' << base;
            // And something finite wherever the driver goes.
            Pose pose = rest_pose(model);
            for (Vec3f& p : pose.positions) p = Vec3f(p.y() * p.y(), p.x() - p.z(), 0);
            for (const Vec3f& p : restored(model, pose)) ASSERT_TRUE(p.allFinite()) << name;
        }
}

TEST(Strip, ExtremeSizesComeBack) {
    for (const float size : {1e-42f, 1e-38f, 1e-20f, 1e-10f, 1e10f, 1e30f, 1e38f})
        for (const Mesh& shape : {make_wavy_cube({.resolution = 16}), points_only(100)}) {
            const Mesh mesh = scaled(shape, size);
            const Model model = stripped(mesh, {}).model;
            // The smallest floats are steps of 1.4e-45, up to one of which is lost on each axis.
            const double steps =
                2 * double(std::numeric_limits<float>::denorm_min()) / bounds(mesh.positions).diagonal();
            const double most = shape.face_count() > 0 ? 2e-6 : 1e-5; // far from their drivers: points the most
            EXPECT_LE(distance(restored(model, rest_pose(model)), mesh.positions).max, most + steps)
                << size << ' ' << shape.face_count();
        }
}

/// A vertex that no face uses may be anywhere: it has a place, and the others keep their digits.
TEST(Strip, AStrayVertexMayBeAnywhere) {
    for (const float far : {1e30f, -3e38f, 1e7f}) {
        std::vector<Vec3f> positions = kCorners;
        for (Vec3f& p : positions) p *= 1e-10f;
        positions.emplace_back(far, 0, 0);
        const Mesh mesh = with_faces(positions, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
        const Model model = stripped(mesh).model;
        const std::vector<Vec3f> back = restored(model, rest_pose(model));
        for (std::size_t v = 0; v < 4; ++v)
            EXPECT_LT((back[v] - positions[v]).norm(), 1e-16f) << far << ' ' << v << ' ' << back[v].transpose();
        EXPECT_NEAR(back[4].x() / far, 1, 1e-6) << far;
    }
}

TEST(Strip, MillimetresAtHalfAThousandKilometres) {
    Mesh mesh = make_wavy_plane({.resolution = 64, .frequency = 20, .amplitude = 0.001}); // a metre, with waves of 1 mm
    const Mesh near = mesh;
    std::vector<Vec3d> world;
    for (const Vec3f& p : mesh.positions) world.push_back(p.cast<double>() + Vec3d(500000, -4500000, 300));
    split_origin(world, mesh);
    const Model model = stripped(mesh).model;
    const Result<Mesh> back = restorer_of(model).mesh(rest_pose(model), kOneThread);
    for (std::size_t v = 0; v < world.size(); ++v)
        ASSERT_LT((back->world_position(v) - world[v]).norm(), 1e-6) << v; // a thousandth of the waves
}

TEST(Strip, LevelsAreNestedAndHoldTheDriver) {
    for (const auto& [name, mesh] : all_shapes()) {
        const Model model = stripped(mesh, {.levels = 3}).model;
        ASSERT_EQ(model.finest_level(), 3u) << name;
        for (unsigned k = 0; k < 3; ++k) {
            const std::vector<Index>& here = model.levels[k].vertices;
            EXPECT_NEAR(double(here.size()), double(mesh.vertex_count()) / std::pow(4.0, 3 - k),
                        0.02 * double(here.size()) + 1)
                << name << ' ' << k;
            if (k == 2) continue;
            const std::vector<Index>& next = model.levels[k + 1].vertices;
            EXPECT_TRUE(std::includes(next.begin(), next.end(), here.begin(), here.end())) << name << ' ' << k;
        }
    }
}

TEST(Strip, BaseIsReachedWithinTwoPercent) {
    const Mesh cube = make_wavy_cube({.resolution = 64});
    for (const std::size_t base : {3u, 8u, 50u, 500u, 5000u}) {
        const std::size_t count = stripped(cube, {.base = base}).model.driver().vertices.size();
        EXPECT_LE(std::abs(double(count) - double(base)), std::max(1.0, 0.02 * double(base))) << base;
    }
}

TEST(Strip, ErrorBoundsTheDriversDistance) {
    const Mesh mesh = make_wavy_sphere({.resolution = 48});
    for (const double error : {0.01, 0.003}) {
        const Model model = stripped(mesh, {.error = error}).model;
        const Result<MeshDistance> apart = mesh_distance(level_mesh(model, 0), mesh, 20000, kOneThread);
        // Quadrics measure root mean squares of the planes that met; a single point may stick out a little further.
        EXPECT_LT(apart->surfaces->rms_distance, error * apart->diagonal) << error;
        EXPECT_LT(apart->surfaces->hausdorff, 3 * error * apart->diagonal) << error;
        EXPECT_LT(model.driver().vertices.size(), mesh.vertex_count() / 2);
    }
}

TEST(Strip, TheMeshIsLeftAsItCame) {
    Mesh mesh = make_wavy_plane({.resolution = 16});
    mesh.scalars = {{"heat", std::vector<float>(mesh.vertex_count(), 0.25f)}};
    mesh.groups = {{"all"}, std::vector<Index>(mesh.face_count(), 0)};
    const Model model = stripped(mesh).model;
    EXPECT_TRUE(same_bytes(model.mesh.positions, mesh.positions));
    EXPECT_EQ(model.mesh.corners, mesh.corners);
    const Result<Mesh> back = restorer_of(model).mesh(rest_pose(model), kOneThread);
    EXPECT_EQ(back->corners, mesh.corners);
    EXPECT_EQ(back->face_offsets, mesh.face_offsets);
    EXPECT_EQ(back->uvs.values, mesh.uvs.values);
    EXPECT_EQ(back->scalars[0].values, mesh.scalars[0].values);
    EXPECT_EQ(back->groups.of_face, mesh.groups.of_face);
}

TEST(Strip, DuplicatesStayTogether) {
    const Mesh mesh = soup(make_wavy_plane({.resolution = 10}));
    const Stripped result = stripped(mesh, {.base = 12});
    EXPECT_EQ(result.report.welded_vertices, 400u - 121u);
    Pose pose = rest_pose(result.model);
    for (Vec3f& p : pose.positions) p.z() += p.x() * p.y();
    const std::vector<Vec3f> moved = restored(result.model, pose);
    for (std::size_t a = 0; a < mesh.vertex_count(); ++a)
        for (std::size_t b = 0; b < a; ++b)
            ASSERT_TRUE(mesh.positions[a] != mesh.positions[b] || moved[a] == moved[b]) << a << ' ' << b;
}

/// Flat-shaded: as many vertices as corners, and a quarter as many places.
TEST(Strip, LevelsCountPlacesNotVertices) {
    const Mesh shared = make_wavy_sphere({.resolution = 24});
    const Mesh flat = soup(shared);
    ASSERT_GT(flat.vertex_count(), 3 * shared.vertex_count());
    for (const StripOptions& options : {StripOptions{}, StripOptions{.levels = 2}, StripOptions{.base = 60}}) {
        const Model one = stripped(shared, options).model, other = stripped(flat, options).model;
        ASSERT_EQ(one.levels.size(), other.levels.size());
        for (std::size_t k = 0; k < one.levels.size(); ++k)
            EXPECT_NEAR(double(one.levels[k].vertices.size()), double(other.levels[k].vertices.size()), 2) << k;
        EXPECT_LT(other.levels.back().vertices.size(), shared.vertex_count()); // the first level loses some
    }
    const Model quarter = stripped(flat, {.levels = 1}).model;
    EXPECT_NEAR(double(quarter.driver().vertices.size()), double(shared.vertex_count()) / 4,
                0.02 * double(shared.vertex_count()));
}

TEST(Strip, ALevelThatRemovesNothingIsNotKept) {
    Mesh mesh = make_wavy_plane({.resolution = 8}); // 81 vertices
    mesh.uvs = {};
    for (int i = 0; i < 2000; ++i) mesh.positions.emplace_back(float(i), 5.0f, 5.0f); // loose ones: in no level
    const Model model = stripped(mesh, {.base = 40}).model;                           // 40, 160 and 640 of 2,081
    ASSERT_EQ(model.levels.size(), 1u);
    EXPECT_LE(model.driver().vertices.size(), 41u);
}

TEST(Strip, SameBytesForAnyThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh mesh = make_wavy_cube({.resolution = 80});
    const StripOptions options{.base = 500};
    const Model one = stripped(mesh, options).model, two = stripped(mesh, options, RunContext(2)).model;
    const BlendDetail &a = one.detail, &b = two.detail;
    EXPECT_EQ(a.order, b.order);
    EXPECT_EQ(a.cells, b.cells);
    EXPECT_EQ(a.u, b.u);
    EXPECT_EQ(a.v, b.v);
    EXPECT_TRUE(same_bytes(restored(one, rest_pose(one)), restored(two, rest_pose(two), {}, RunContext(2))));
}

TEST(Strip, OptionsThatMakeNoSenseAreRefused) {
    const Mesh mesh = make_wavy_plane({.resolution = 8});
    const auto code = [&](const Mesh& m, const StripOptions& options) {
        const Result<Stripped> result = strip(m, options, kOneThread);
        return result.ok() ? std::optional<ErrorCode>() : result.error().code;
    };
    EXPECT_EQ(code(mesh, {.base = 2}), ErrorCode::usage);
    EXPECT_EQ(code(mesh, {.base = 10, .levels = 2}), ErrorCode::usage);
    EXPECT_EQ(code(mesh, {.levels = 0}), ErrorCode::usage);
    EXPECT_EQ(code(mesh, {.levels = 17}), ErrorCode::usage);
    EXPECT_EQ(code(mesh, {.error = 0}), ErrorCode::usage);
    EXPECT_EQ(code(mesh, {.error = NAN}), ErrorCode::usage);
    EXPECT_EQ(code(mesh, {.max_edge = 0}), ErrorCode::usage);
    EXPECT_EQ(code(mesh, {.max_edge = NAN}), ErrorCode::usage);
    EXPECT_EQ(code(Mesh{}, {}), ErrorCode::unsuitable);
    const RunContext cancelled(1);
    cancelled.cancel();
    const Result<Stripped> result = strip(mesh, {}, cancelled);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::cancelled);
}

/// On the waves along a cube's edges a cell may be closer than all around it, and far from the closest. One vertex that
/// is bound there was off by 1.2 % of the diagonal.
TEST(Strip, NoVertexIsBoundFarFromTheClosestCell) {
    const Model model = stripped(make_wavy_cube({.resolution = 48}), {.base = 400}).model;
    const Deformation twist{[](const Vec3d& p) {
                                const double c = std::cos(std::numbers::pi * p[2]),
                                             s = std::sin(std::numbers::pi * p[2]);
                                return Vec3d(c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]);
                            },
                            [](const Vec3d&) { return Mat3d(Mat3d::Identity()); }};
    const std::vector<Vec3f> moved = restored(model, without_gradients(pose_by(twist, model)));
    EXPECT_LT(distance(moved, deformed(twist, model.mesh.positions)).max, 9e-3);
}

TEST(Strip, VerticesInAnotherOrderComeBackInTheirOwn) {
    Mesh mesh = make_wavy_sphere({.resolution = 48});
    std::mt19937 random(7);
    std::vector<Index> shuffled(mesh.vertex_count());
    std::iota(shuffled.begin(), shuffled.end(), Index{0});
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    mesh.scalars.push_back({"number", {}});
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) mesh.scalars[0].values.push_back(float(v));
    mesh = with_vertex_order(std::move(mesh), shuffled, kOneThread);

    const Model model = strip(mesh, {.reorder = true}, kOneThread).value().model;
    EXPECT_EQ(check_model(model), "");
    const auto far_steps = [](const Mesh& m) { // how far it is from vertex to vertex
        double sum = 0;
        for (std::size_t v = 1; v < m.vertex_count(); ++v) sum += (m.positions[v] - m.positions[v - 1]).norm();
        return sum;
    };
    EXPECT_LT(far_steps(model.mesh), far_steps(mesh) / 10);
    const Mesh back = with_vertex_order(model.mesh, inverse_order(model.source_order), kOneThread);
    EXPECT_EQ(back.positions, mesh.positions);
    EXPECT_EQ(back.corners, mesh.corners);
    EXPECT_EQ(back.scalars[0].values, mesh.scalars[0].values);

    Model wrong = model;
    wrong.source_order[0] = wrong.source_order[1];
    EXPECT_NE(check_model(wrong), "");
}
