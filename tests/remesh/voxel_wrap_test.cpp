#include "filigree/remesh/manifold_surface.h"
#include "filigree/remesh/voxel_wrap.h"

#include "filigree/file.h"
#include "filigree/mesh.h"
#include "io/corpus.h"
#include "threads.h"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace filigree {
namespace {

std::vector<Vec3d> positions_of(const Mesh& mesh) {
    std::vector<Vec3d> positions;
    for (const Vec3f& p : mesh.positions) positions.push_back(p.cast<double>());
    return positions;
}

Mesh mesh_of(const ManifoldSurface& surface) {
    Mesh mesh;
    for (const Vec3d& p : surface.positions) mesh.positions.push_back(p.cast<float>());
    for (const Triangle& t : surface.triangles) mesh.add_face(t);
    return mesh;
}

/// A wrap as a mesh, with what must be true of every one checked.
Mesh wrapped(const Mesh& mesh, const WrapOptions& options = {.resolution = 48}) {
    const auto wrap = voxel_wrap(positions_of(mesh), triangulate(mesh).triangles, options, kOneThread);
    EXPECT_TRUE(wrap.ok());
    if (!wrap.ok()) return {};
    EXPECT_TRUE(wrap->source_corners.empty());
    const Mesh result = mesh_of(*wrap);
    EXPECT_EQ(check_mesh(result), "");
    const TopologyReport report = analyse_topology(result, kOneThread);
    EXPECT_TRUE(report.is_closed());
    EXPECT_TRUE(report.is_manifold());
    EXPECT_TRUE(report.is_oriented());
    EXPECT_EQ(report.unused_vertices.count, 0u);
    EXPECT_EQ(report.duplicate_faces.count, 0u);
    EXPECT_GT(report.volume, 0);
    return result;
}

Mesh joined(const Mesh& a, const Mesh& b) {
    Mesh mesh = a;
    mesh.positions.insert(mesh.positions.end(), b.positions.begin(), b.positions.end());
    for (std::size_t f = 0; f < b.face_count(); ++f) {
        std::vector<Index> face(b.face(f).begin(), b.face(f).end());
        for (Index& v : face) v += Index(a.vertex_count());
        mesh.add_face(face);
    }
    return mesh;
}

Mesh moved(Mesh mesh, const Vec3d& by) {
    for (Vec3f& p : mesh.positions) p += by.cast<float>();
    return mesh;
}

Mesh without_face(const Mesh& mesh, std::size_t face) {
    Mesh open;
    open.positions = mesh.positions;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        if (f != face) open.add_face(mesh.face(f));
    return open;
}

Mesh triangles_at_random(std::size_t count, float size, unsigned seed) {
    std::mt19937 random(seed);
    const auto coordinate = [&] { return float(random() % 100000) / 100000; };
    const auto point = [&] { return Vec3f(coordinate(), coordinate(), coordinate()); };
    Mesh soup;
    for (Index t = 0; t < count; ++t) {
        const Vec3f centre = point();
        for (int k = 0; k < 3; ++k) soup.positions.push_back(centre + size * point());
        soup.add_face(Triangle{3 * t, 3 * t + 1, 3 * t + 2});
    }
    return soup;
}

TopologyReport topology(const Mesh& mesh) { return analyse_topology(mesh, kOneThread); }

/// In voxels.
SurfaceDistance distance(const Mesh& wrap, const Mesh& input, unsigned resolution) {
    SurfaceDistance d = *mesh_distance(wrap, input, 20000, kOneThread)->surfaces;
    const double voxel = bounds(input.positions).size().maxCoeff() / resolution;
    for (double* x : {&d.rms_a_to_b, &d.rms_b_to_a, &d.max_a_to_b, &d.max_b_to_a}) *x /= voxel;
    return d;
}

TEST(VoxelWrap, OfClosedShapesHasTheirVolumeAndTopology) {
    struct Case {
        Mesh mesh;
        std::int64_t euler;
    };
    for (const auto& [mesh, euler] : {Case{make_box({3, 2, 1}, {1, 1, 1}), 2}, Case{make_ball({0, 0, 0}, 2), 2},
                                      Case{make_torus({.resolution = 32, .amplitude = 0}), 0}}) {
        const Mesh wrap = wrapped(mesh);
        const TopologyReport report = topology(wrap), input = topology(mesh);
        EXPECT_EQ(report.components, 1u);
        EXPECT_EQ(report.euler, euler);
        EXPECT_NEAR(report.volume, input.volume, 0.02 * input.volume);
        EXPECT_LT(distance(wrap, mesh, 48).rms_a_to_b, 0.15);
        EXPECT_LT(distance(wrap, mesh, 48).max_a_to_b, 0.9);
        EXPECT_LT(distance(wrap, mesh, 48).max_b_to_a, 0.9);
    }
}

TEST(VoxelWrap, OfInterpenetratingBallsIsTheirUnion) {
    const Mesh wrap = wrapped(joined(make_ball({0, 0, 0}, 1), make_ball({1, 0, 0}, 1)), {.resolution = 64});
    const TopologyReport report = topology(wrap);
    EXPECT_EQ(report.components, 1u);
    EXPECT_EQ(report.euler, 2);
    const double ball = 4 * std::numbers::pi / 3, lens = 5 * std::numbers::pi / 12; // at distance 1
    EXPECT_NEAR(report.volume, 2 * ball - lens, 0.01 * ball);
}

TEST(VoxelWrap, LosesCavitiesAndKeepsWhatIsApart) {
    Mesh inner = make_ball({0, 0, 0}, 0.5);
    const TopologyReport nested = topology(wrapped(joined(make_ball({0, 0, 0}, 1), inner)));
    EXPECT_EQ(nested.components, 1u);
    EXPECT_NEAR(nested.volume, 4 * std::numbers::pi / 3, 0.1);
    const TopologyReport apart = topology(wrapped(joined(make_ball({0, 0, 0}, 1), moved(inner, {3, 0, 0}))));
    EXPECT_EQ(apart.components, 2u);
    EXPECT_EQ(apart.euler, 4);
}

TEST(VoxelWrap, EntersOpeningsThatTheClosingLeaves) {
    const Mesh box = make_box(Vec3d::Zero(), Vec3d::Ones());
    const TopologyReport open = topology(wrapped(without_face(box, 0)));
    EXPECT_EQ(open.components, 1u);
    EXPECT_EQ(open.euler, 2);
    EXPECT_LT(open.volume, 0.1); // a shell
    const Mesh fine = make_wavy_cube({.resolution = 32, .amplitude = 0});
    const Mesh hole = without_face(fine, 16 * 32 + 16); // 1/32 of the side, in the middle of one
    EXPECT_NEAR(topology(wrapped(hole, {.resolution = 32, .closing = 2})).volume, 1, 0.05);
    EXPECT_LT(topology(wrapped(hole, {.resolution = 128, .closing = 0})).volume, 0.1);
    EXPECT_NEAR(topology(wrapped(hole, {.resolution = 128, .closing = 6})).volume, 1, 0.05);
}

TEST(VoxelWrap, ClosingDoesNotFatten) {
    const Mesh torus = make_torus({.resolution = 32, .amplitude = 0});
    for (const unsigned closing : {0u, 1u, 4u}) {
        const Mesh wrap = wrapped(torus, {.resolution = 64, .closing = closing});
        EXPECT_EQ(topology(wrap).euler, 0) << closing;
        EXPECT_LT(distance(wrap, torus, 64).rms_a_to_b, 0.1) << closing;
    }
}

TEST(VoxelWrap, OfSheetsIsAShell) {
    Mesh moebius; // as wide as a third of its length
    constexpr Index kAround = 40;
    for (Index i = 0; i < kAround; ++i)
        for (const double side : {-0.3, 0.3}) {
            const double t = 2 * std::numbers::pi * i / kAround;
            const double r = 1 + side * std::cos(t / 2);
            moebius.positions.push_back(Vec3d(r * std::cos(t), r * std::sin(t), side * std::sin(t / 2)).cast<float>());
        }
    for (Index i = 0; i < kAround; ++i) {
        const bool last = i + 1 == kAround; // turned over
        const Index a = 2 * i, b = last ? 1 : 2 * i + 2, c = last ? 0 : 2 * i + 3;
        moebius.add_face(std::array<Index, 4>{a, b, c, 2 * i + 1});
    }
    EXPECT_EQ(topology(wrapped(moebius)).euler, 0); // the shell of a ring

    const Mesh plane = make_wavy_plane({.resolution = 20});
    const Mesh wrap = wrapped(plane);
    EXPECT_EQ(topology(wrap).euler, 2);
    EXPECT_LT(distance(wrap, plane, 48).rms_a_to_b, 0.3);
    EXPECT_LT(distance(wrap, plane, 48).max_b_to_a, 1);
    EXPECT_NEAR(topology(wrap).area, 2 * topology(plane).area, 0.3);
}

TEST(VoxelWrap, OfAFanOfNeedlesIsThatOfItsCone) {
    constexpr Index kNeedles = 5000;
    Mesh cone;
    cone.positions.emplace_back(0.0f, 0.0f, 1.0f);
    for (Index i = 0; i < kNeedles; ++i) {
        const double t = 2 * std::numbers::pi * i / kNeedles;
        cone.positions.push_back(Vec3d(std::cos(t), std::sin(t), 0).cast<float>());
    }
    for (Index i = 0; i < kNeedles; ++i) cone.add_face(Triangle{0, i + 1, (i + 1) % kNeedles + 1});
    const Mesh open = wrapped(cone);
    EXPECT_EQ(topology(open).euler, 2);
    EXPECT_LT(distance(open, cone, 48).rms_a_to_b, 0.35); // a shell
    std::vector<Index> base(kNeedles);
    for (Index i = 0; i < kNeedles; ++i) base[i] = kNeedles - i;
    cone.add_face(base);
    const Mesh closed = wrapped(cone);
    EXPECT_NEAR(topology(closed).volume, std::numbers::pi / 3, 0.03);
    EXPECT_LT(distance(closed, cone, 48).rms_a_to_b, 0.15);
}

TEST(VoxelWrap, OfOneTriangleALineAndTwoPoints) {
    Mesh triangle;
    triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.add_face(Triangle{0, 1, 2});
    EXPECT_EQ(topology(wrapped(triangle)).euler, 2);
    Mesh line = triangle; // no area, but an extent
    line.positions[2] = {0.5f, 0, 0};
    EXPECT_EQ(topology(wrapped(line)).euler, 2);
    Mesh points; // two triangles, each a point
    points.positions = {{0, 0, 0}, {1, 2, 3}};
    points.add_face(Triangle{0, 0, 0});
    points.add_face(Triangle{1, 1, 1});
    EXPECT_EQ(topology(wrapped(points)).components, 2u);
}

TEST(VoxelWrap, OfSoupIsAlwaysAClosedManifold) {
    for (const auto& [count, size] : {std::pair<std::size_t, float>(30, 1), {400, 0.2f}, {5000, 0.05f}})
        for (const unsigned resolution : {16u, 45u})
            for (const unsigned closing : {0u, 1u})
                wrapped(triangles_at_random(count, size, unsigned(count) + resolution),
                        {.resolution = resolution, .closing = closing});
}

TEST(VoxelWrap, TakesDiagonalVoxelsForOnePart) {
    const Mesh box = make_box(Vec3d::Zero(), Vec3d::Ones());
    for (const Vec3d& by : {Vec3d(1, 1, 0), Vec3d(1, 1, 1), Vec3d(1.02, 1.02, 0), Vec3d(1, 1.03, 1.03)})
        EXPECT_NEAR(topology(wrapped(joined(box, moved(box, by)))).volume, 2, 0.15); // at an edge, at a corner
}

TEST(VoxelWrap, FollowsTheKoala) {
    const auto path = filigree_test::corpus_folder() / "good/koala_100k.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no corpus";
    const Mesh koala = read_mesh(path, kOneThread)->mesh;
    const Mesh wrap = wrapped(koala, {.resolution = 96});
    EXPECT_EQ(topology(wrap).euler, 2);
    EXPECT_NEAR(topology(wrap).volume, topology(koala).volume, 0.01 * topology(koala).volume);
    const SurfaceDistance d = distance(wrap, koala, 96);
    EXPECT_LT(d.rms_a_to_b, 0.05);
    EXPECT_LT(d.rms_b_to_a, 0.05);
    EXPECT_LT(d.max_a_to_b, 1);
    EXPECT_LT(d.max_b_to_a, 1);
}

TEST(VoxelWrap, OfEveryBadMeshOfTheCorpusIsAClosedManifold) {
    const auto corpus = filigree_test::read_corpus();
    if (corpus.empty()) GTEST_SKIP() << "no corpus";
    std::size_t count = 0;
    for (const auto& row : corpus) {
        if (row.file.starts_with("good")) continue;
        const auto read = read_mesh(row.path, kOneThread);
        if (!read.ok() || !(bounds(read->mesh.positions).diagonal() > 0) || read->mesh.face_count() == 0) continue;
        SCOPED_TRACE(row.file);
        const auto triangles = triangulate(read->mesh).triangles;
        const auto wrap = voxel_wrap(positions_of(read->mesh), triangles, {.resolution = 32}, kOneThread);
        if (!wrap.ok()) continue;     // faces without extent
        Mesh scaled = mesh_of(*wrap); // to where floats keep neighbours apart
        const Box box = bounds(read->mesh.positions);
        for (std::size_t v = 0; v < scaled.vertex_count(); ++v)
            scaled.positions[v] = ((wrap->positions[v] - box.centre()) / box.diagonal()).cast<float>();
        const TopologyReport report = topology(scaled);
        EXPECT_TRUE(report.is_closed() && report.is_manifold() && report.is_oriented());
        EXPECT_GT(report.volume, 0);
        ++count;
    }
    EXPECT_GT(count, 20u);
}

TEST(VoxelWrap, DoesNotDependOnScaleOrPlace) {
    const Mesh mesh = make_wavy_sphere({.resolution = 16});
    const std::vector<Vec3d> positions = positions_of(mesh);
    const auto triangles = triangulate(mesh).triangles;
    const ManifoldSurface expected = *voxel_wrap(positions, triangles, {.resolution = 20}, kOneThread);
    for (const double scale : {0x1p-100, 0x1p100}) { // exact in binary
        std::vector<Vec3d> scaled = positions;
        for (Vec3d& p : scaled) p *= scale;
        const ManifoldSurface wrap = *voxel_wrap(scaled, triangles, {.resolution = 20}, kOneThread);
        EXPECT_EQ(wrap.triangles, expected.triangles);
        for (std::size_t v = 0; v < wrap.positions.size(); ++v)
            EXPECT_LT((wrap.positions[v] / scale - expected.positions[v]).norm(), 1e-12);
    }
}

TEST(VoxelWrap, IsIndependentOfThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh mesh = triangles_at_random(300, 0.3f, 5);
    const auto triangles = triangulate(mesh).triangles;
    const ManifoldSurface one = *voxel_wrap(positions_of(mesh), triangles, {.resolution = 80}, kOneThread);
    const ManifoldSurface two = *voxel_wrap(positions_of(mesh), triangles, {.resolution = 80}, RunContext(2));
    EXPECT_EQ(one.positions, two.positions);
    EXPECT_EQ(one.triangles, two.triangles);
}

TEST(VoxelWrap, RefusesWhatHasNoExtentAndCanBeCancelled) {
    const std::vector<Vec3d> positions = {{1, 2, 3}, {4, 5, 6}};
    const std::vector<Triangle> point = {{0, 0, 0}}, none;
    EXPECT_EQ(voxel_wrap(positions, point, {}, kOneThread).error().code, ErrorCode::unsuitable);
    EXPECT_EQ(voxel_wrap(positions, none, {}, kOneThread).error().code, ErrorCode::unsuitable);
    const RunContext context(1);
    context.cancel();
    const std::vector<Triangle> line = {{0, 1, 1}};
    EXPECT_EQ(voxel_wrap(positions, line, {}, context).error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
