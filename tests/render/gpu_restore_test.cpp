// Restoring in the vertex shader gives what the CPU gives.
#include "filigree/render/gpu_restore.h"

#include "blend/stripping.h"
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"
#include "filigree/pose.h"
#include "filigree/render.h"
#include "io/corpus.h"

#include <algorithm>
#include <numbers>
#include <numeric>

namespace gpu_restore_test {

using namespace filigree_test;

namespace {

class GpuRestore : public testing::Test {
protected:
    void SetUp() override {
        Result<HeadlessContext> context = HeadlessContext::create();
        if (context) {
            context_.emplace(std::move(*context));
            return;
        }
        ASSERT_EQ(context.error().code, ErrorCode::unsupported) << context.error().message;
        GTEST_SKIP() << context.error().message;
    }

private:
    std::optional<HeadlessContext> context_;
};

Mesh with_normals(Mesh mesh) {
    mesh.normals.values = vertex_normals(mesh, mesh.positions, kOneThread);
    return mesh;
}

GpuRestorer gpu_restorer(const Model& model, std::span<const Index> vertices, std::span<const Vec3f> normals,
                         const RestoreOptions& options = {}) {
    Result<GpuRestorer> restorer = GpuRestorer::create(model, vertices, normals, options, kOneThread);
    EXPECT_TRUE(restorer.ok()) << (restorer.ok() ? "" : restorer.error().message);
    return std::move(*restorer);
}

GpuRestorer::ReadBack read_back(GpuRestorer& restorer, const Pose& pose) {
    const Status set = restorer.set_pose(pose, kOneThread);
    EXPECT_TRUE(set.ok()) << (set.ok() ? "" : set.error().message);
    Result<GpuRestorer::ReadBack> result = restorer.read_back();
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
    return std::move(*result);
}

/// Angles between two lists of unit vectors, in degrees; 180 where only one of two is zero.
struct Angles {
    double max = 0, of_99_percent = 0;
};
Angles angles(std::span<const Vec3f> a, std::span<const Vec3f> b) {
    EXPECT_EQ(a.size(), b.size());
    if (a.size() != b.size() || a.empty()) return {180, 180};
    std::vector<double> all;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double half = 0.5 * (a[i].cast<double>() - b[i].cast<double>()).norm();
        if (a[i].isZero() != b[i].isZero() || !(half < 1))
            all.push_back(180);
        else
            all.push_back(2 * std::asin(half) * 180 / std::numbers::pi);
    }
    std::sort(all.begin(), all.end());
    return {all.back(), all[(all.size() - 1) * 99 / 100]};
}

std::unique_ptr<SpaceWarp> bend_and_twist(const Model& model) {
    const Box box = bounds(model.mesh.positions);
    std::vector<std::unique_ptr<SpaceWarp>> warps;
    warps.push_back(make_twist(box, Axis::x, 90));
    warps.push_back(make_bend(box, Axis::x, 60));
    return make_chain(std::move(warps));
}

Pose bent_and_twisted(const Model& model) {
    return warp_pose(*bend_and_twist(model), driver_positions(model), Vec3d::Zero(), kOneThread);
}

Pose mirrored(const Model& model) {
    Mat3d mirror = Eigen::AngleAxisd(0.7, Vec3d(1, 2, -1).normalized()).toRotationMatrix();
    mirror.col(1) *= -1.5;
    return pose_by(affine(mirror, Vec3d(0.3, -0.2, 0.5)), model);
}

/// Holds the GPU against the CPU at one level, normals (the mesh needs one a vertex) and all.
void expect_same(const Model& model, const Pose& pose, const RestoreOptions& options = {}) {
    const unsigned level = options.level.value_or(model.finest_level());
    const std::vector<Index> vertices =
        level == model.finest_level() ? all_vertices(model) : model.levels[level].vertices;
    const Mesh rest = level_mesh(model, level);
    ASSERT_EQ(rest.normals.values.size(), vertices.size());
    const Result<Mesh> expected = restorer_of(model, options).mesh(pose, kOneThread);
    ASSERT_TRUE(expected.ok());
    GpuRestorer restorer = gpu_restorer(model, vertices, rest.normals.values, options);
    const GpuRestorer::ReadBack found = read_back(restorer, pose);
    EXPECT_LT(distance(found.positions, expected->positions).max, 2e-6) << "level " << level;
    // Rest normals are rounded by up to 0.003 degrees, which grows where the pose flattens space.
    const Angles off = angles(found.normals, expected->normals.values);
    EXPECT_LT(off.of_99_percent, 0.01) << "level " << level;
    EXPECT_LT(off.max, 0.2) << "level " << level;

    GpuRestorer positions_alone = gpu_restorer(model, vertices, {}, options);
    const GpuRestorer::ReadBack again = read_back(positions_alone, pose);
    EXPECT_TRUE(again.normals.empty());
    EXPECT_LT(distance(again.positions, expected->positions).max, 2e-6) << "level " << level;
}

} // namespace

TEST_F(GpuRestore, IsTheCpuOnEveryShapePoseAndLevel) {
    for (const Mesh& mesh : {make_wavy_cube({.resolution = 24}), make_wavy_sphere({.resolution = 24}),
                             make_wavy_plane({.resolution = 40})}) {
        const Model model = stripped(with_normals(mesh), {.levels = 3}).model;
        const Pose bent = bent_and_twisted(model);
        for (const Pose& pose : {rest_pose(model), bent, without_gradients(bent), mirrored(model)})
            for (unsigned level = 0; level <= model.finest_level(); ++level) expect_same(model, pose, {.level = level});
    }
}

TEST_F(GpuRestore, IsTheCpuOnTheKoala) {
    const auto path = corpus_folder() / "good/koala_100k.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no corpus at " << corpus_folder();
    Result<MeshFile> file = read_mesh(path, kOneThread);
    ASSERT_TRUE(file.ok()) << file.error().message;
    const Mesh koala = with_normals(std::move(file->mesh));
    const Model model = stripped(koala, {}).model;
    expect_same(model, bent_and_twisted(model));
}

/// Nearly each record has a cell of its own.
TEST_F(GpuRestore, IsTheCpuOnLargeDrivers) {
    const Mesh mesh = with_normals(make_wavy_cube({.resolution = 128}));
    const Model model = stripped(mesh, {.base = 75000}).model;
    expect_same(model, bent_and_twisted(model));
}

TEST_F(GpuRestore, RestsBeforeThePoseIsSet) {
    const Model model = stripped(with_normals(make_torus({.resolution = 32})), {}).model;
    const GpuRestorer restorer = gpu_restorer(model, all_vertices(model), model.mesh.normals.values);
    const Result<GpuRestorer::ReadBack> found = restorer.read_back();
    ASSERT_TRUE(found.ok());
    EXPECT_LT(distance(found->positions, model.mesh.positions).max, 2e-6);
    EXPECT_LT(angles(found->normals, model.mesh.normals.values).max, 0.005);
}

TEST_F(GpuRestore, ItemsMayShareAVertexAndComeInAnyOrder) {
    const Model model = stripped(make_wavy_cube({.resolution = 16}), {}).model;
    std::vector<Index> vertices;
    std::vector<Vec3f> normals;
    for (Index v = 0; v < 900; v += 3)
        for (const Vec3f& normal : {Vec3f(1, 0, 0), Vec3f(0, -1, 0), Vec3f(0, 0, -1), Vec3f(0, 0, 0)}) {
            vertices.push_back(899 - v);
            normals.push_back(normal);
        }
    vertices.push_back(vertices.front());
    normals.push_back(Vec3f(-1, 2, -3).normalized());
    const Mat3d turn = Eigen::AngleAxisd(1, Vec3d(3, 1, 2).normalized()).toRotationMatrix();
    const Pose pose = pose_by(affine(turn, Vec3d(1, 2, 3)), model);
    GpuRestorer restorer = gpu_restorer(model, vertices, normals);
    ASSERT_EQ(restorer.item_count(), vertices.size());
    const GpuRestorer::ReadBack found = read_back(restorer, pose);

    const std::vector<Vec3f> moved = restored(model, pose);
    std::vector<Vec3f> positions, turned;
    for (const Index v : vertices) positions.push_back(moved[v]);
    for (const Vec3f& n : normals) turned.push_back((turn * n.cast<double>()).cast<float>());
    EXPECT_LT(distance(found.positions, positions).max, 2e-6);
    EXPECT_LT(angles(found.normals, turned).max, 0.005);

    std::vector<Index> places(restorer.drawn_at().begin(), restorer.drawn_at().end());
    std::sort(places.begin(), places.end());
    for (Index i = 0; i < places.size(); ++i) ASSERT_EQ(places[i], i);
}

TEST_F(GpuRestore, SizesFarFromOne) {
    for (const double size : {1e-20, 1e-3, 1e6, 1e20}) {
        Mesh mesh = with_normals(make_wavy_cube({.resolution = 16}));
        for (Vec3f& p : mesh.positions) p = (size * p.cast<double>()).cast<float>();
        const Model model = stripped(std::move(mesh), {}).model;
        const Mat3d turn = Eigen::AngleAxisd(1, Vec3d(3, 1, 2).normalized()).toRotationMatrix();
        expect_same(model, pose_by(affine(turn, size * Vec3d(1, 2, 3)), model));
        expect_same(model, without_gradients(pose_by(affine(turn, size * Vec3d(1, 2, 3)), model)));
    }
}

/// A driver without faces: cells of one vertex, and gradients only where they are given.
TEST_F(GpuRestore, PointCloudsToo) {
    Mesh points;
    points.positions = make_wavy_sphere({.resolution = 16}).positions;
    points.normals.values = points.positions;
    for (Vec3f& n : points.normals.values) n.normalize();
    const Model model = stripped(points, {}).model;
    expect_same(model, bent_and_twisted(model));
    expect_same(model, without_gradients(bent_and_twisted(model)));
}

TEST_F(GpuRestore, NothingToRestoreIsFine) {
    const Model model = stripped(make_wavy_plane({.resolution = 8})).model;
    GpuRestorer restorer = gpu_restorer(model, {}, {});
    EXPECT_EQ(restorer.item_count(), 0u);
    EXPECT_TRUE(read_back(restorer, rest_pose(model)).positions.empty());
}

TEST_F(GpuRestore, SaysWhatItTakesOfTheGpu) {
    const Model model = stripped(with_normals(make_wavy_cube({.resolution = 64})), {.base = 100}).model;
    const std::size_t record = 28, count = model.mesh.vertex_count();
    const GpuRestorer restorer = gpu_restorer(model, all_vertices(model), model.mesh.normals.values);
    EXPECT_TRUE(restorer.has_normals());
    EXPECT_GT(restorer.bytes(), record * count);
    EXPECT_LT(restorer.bytes(), record * count + 20000); // a hundred driver vertices are next to nothing
}

TEST_F(GpuRestore, WhatDoesNotBelongTogetherIsRefused) {
    const Model model = stripped(make_wavy_plane({.resolution = 16})).model;
    const std::vector<Index> all = all_vertices(model);
    GpuRestorer restorer = gpu_restorer(model, all, {});
    const std::vector<Vec3f> at_rest = read_back(restorer, rest_pose(model)).positions;
    const auto refused = [&](const Pose& pose) {
        const Status status = restorer.set_pose(pose, kOneThread);
        return status.ok() ? std::optional<ErrorCode>() : status.error().code;
    };
    Pose pose = bent_and_twisted(model);
    pose.gradients.pop_back();
    EXPECT_EQ(refused(pose), ErrorCode::mismatch);
    pose = without_gradients(pose);
    pose.positions.pop_back();
    EXPECT_EQ(refused(pose), ErrorCode::mismatch);
    EXPECT_TRUE(same_bytes(restorer.read_back()->positions, at_rest)); // the last good pose stays

    const auto error = [&](std::span<const Index> vertices, std::span<const Vec3f> normals,
                           const RestoreOptions& options = {}) {
        const Result<GpuRestorer> made = GpuRestorer::create(model, vertices, normals, options, kOneThread);
        return made.ok() ? Error{ErrorCode::usage, "it was made"} : made.error();
    };
    const Error level = error(all, {}, {.level = 17});
    EXPECT_EQ(level.code, ErrorCode::usage);
    EXPECT_NE(level.message.find("there is no level 17"), std::string::npos) << level.message;
    const Index beyond[] = {0, static_cast<Index>(all.size())};
    EXPECT_EQ(error(beyond, {}).code, ErrorCode::mismatch);
    const Vec3f one_normal[] = {Vec3f(0, 0, 1)};
    EXPECT_EQ(error(all, one_normal).code, ErrorCode::mismatch);
}

TEST_F(GpuRestore, CanBeCancelled) {
    const Model model = stripped(make_wavy_plane({.resolution = 16})).model;
    RunContext cancelled(1);
    GpuRestorer restorer = gpu_restorer(model, all_vertices(model), {});
    cancelled.cancel();
    EXPECT_EQ(restorer.set_pose(rest_pose(model), cancelled).error().code, ErrorCode::cancelled);
    EXPECT_EQ(GpuRestorer::create(model, all_vertices(model), {}, {}, cancelled).error().code, ErrorCode::cancelled);
}

} // namespace gpu_restore_test
