// The runtime restores what the library restores, to the byte.
#include "runtime/opened.h"

#include "filigree/blend/blend_code.h"

#include <array>
#include <cstring>
#include <thread>

namespace filigree {
namespace {

using namespace filigree_test;

/// What the library gives: a mesh whose normals are the file's, or those of the faces at rest.
RuntimeMesh library_mesh(const Model& model, const Pose& pose, unsigned level) {
    const Restorer restorer = restorer_of(model, {.level = level});
    const Mesh restored = restorer.mesh(pose, kOneThread).value();
    RuntimeMesh out{restored.positions, restored.normals.values};
    const Mesh rest = level_mesh(model, level);
    if (!rest.normals.empty()) return out;
    const std::vector<Mat3f> gradients = restorer.gradients(pose, kOneThread).value();
    std::vector<BlendRestorer::Item> items(rest.vertex_count());
    for (Index i = 0; i < items.size(); ++i)
        items[i] = {level < model.finest_level() ? model.levels[level].vertices[i] : i, i};
    out.normals.resize(items.size());
    BlendRestorer(model.detail, model.mesh.positions, model.driver().vertices, items,
                  vertex_normals(rest, rest.positions, kOneThread), kOneThread)
        .restore(pose.positions, gradients, {}, out.normals, true, kOneThread);
    return out;
}

/// Normals that no corner uses mean nothing.
std::vector<bool> normals_in_use(const Opened& model) {
    const flg_info info = info_of(model);
    std::vector<bool> used(info.normals, info.normal_source != FLG_NORMALS_CORNER);
    if (const std::uint32_t* corners = flg_triangle_normals(model.get()))
        for (std::size_t k = 0; k < 3 * std::size_t{info.triangles}; ++k)
            if (corners[k] != kNoIndex) used[corners[k]] = true;
    return used;
}

void expect_same(const Opened& model, const RuntimeMesh& got, const RuntimeMesh& wanted) {
    EXPECT_TRUE(same_bytes(got.positions, wanted.positions));
    ASSERT_EQ(got.normals.size(), wanted.normals.size());
    const std::vector<bool> used = normals_in_use(model);
    for (std::size_t i = 0; i < used.size(); ++i)
        ASSERT_TRUE(!used[i] || std::memcmp(&got.normals[i], &wanted.normals[i], sizeof(Vec3f)) == 0) << i;
}

TEST(RuntimeRestore, GivesTheLibrarysBytes) {
    for (const auto& [name, model] : models_of_every_kind()) {
        const std::string bytes = write_model(model);
        Pose pose = random_pose(model, 1);
        for (unsigned level = 0; level <= model.finest_level(); ++level)
            for (const bool estimated : {false, true})
                for (const std::uint32_t lanes : {0u, 1u, 4u, 8u, 16u}) {
                    SCOPED_TRACE(name + ", level " + std::to_string(level) + ", lanes " + std::to_string(lanes));
                    const flg_options options = options_of(0, level, lanes);
                    if (open_status(bytes, options) == FLG_ARGUMENT) continue; // no such width here
                    const Opened opened = open_model(bytes, options);
                    ASSERT_TRUE(opened);
                    ASSERT_TRUE(lanes == 0 || info_of(opened).lanes == lanes);
                    const Pose given = estimated ? without_gradients(pose) : pose;
                    expect_same(opened, restore_all(opened, given), library_mesh(model, given, level));
                }
    }
}

/// More than one block of vertices and of normals, and a last block that is not full.
const Model& large_model() {
    static const Model model = stripped(with_corner_normals(make_wavy_sphere({.resolution = 96})), {.base = 200}).model;
    return model;
}

TEST(RuntimeRestore, PartsOnThreadsAreTheWhole) {
    const std::string bytes = write_model(large_model());
    const Opened opened = open_model(bytes);
    const flg_info info = info_of(opened);
    ASSERT_GT(info.parts, 2u);
    const Pose pose = random_pose(large_model(), 2);
    const RuntimeMesh whole = restore_all(opened, pose);
    expect_same(opened, whole, library_mesh(large_model(), pose, large_model().finest_level()));
    const SetPose set(opened, pose);
    RuntimeMesh parts{std::vector<Vec3f>(info.vertices), std::vector<Vec3f>(info.normals)};
    std::vector<std::thread> threads;
    for (std::uint32_t part = 0; part < info.parts; ++part)
        threads.emplace_back([&, part] {
            Scratch scratch(opened);
            EXPECT_EQ(flg_restore_parts(opened.get(), set.get(), part, 1, floats(parts.positions), 12,
                                        floats(parts.normals), 12, scratch.get()),
                      FLG_OK);
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_TRUE(same_bytes(parts.positions, whole.positions));
    EXPECT_TRUE(same_bytes(parts.normals, whole.normals));
}

TEST(RuntimeRestore, APartWritesItsOwnAlone) {
    const Opened opened = open_model(write_model(large_model()));
    const flg_info info = info_of(opened);
    const SetPose set(opened, random_pose(large_model(), 3));
    Scratch scratch(opened);
    std::uint64_t all_vertices = 0, all_normals = 0;
    for (std::uint32_t part = 0; part < info.parts; ++part) {
        RuntimeMesh out{std::vector<Vec3f>(info.vertices, Vec3f::Constant(7)),
                        std::vector<Vec3f>(info.normals, Vec3f::Constant(7))};
        ASSERT_EQ(flg_restore_parts(opened.get(), set.get(), part, 1, floats(out.positions), 12, floats(out.normals),
                                    12, scratch.get()),
                  FLG_OK);
        std::uint32_t first, count, first_normal, normals;
        ASSERT_EQ(flg_get_part(opened.get(), part, &first, &count, &first_normal, &normals), FLG_OK);
        EXPECT_EQ(first, std::min<std::uint64_t>(all_vertices, info.vertices));
        EXPECT_EQ(first_normal, std::min<std::uint64_t>(all_normals, info.normals));
        for (std::uint32_t v = 0; v < info.vertices; ++v)
            ASSERT_EQ(out.positions[v] == Vec3f(Vec3f::Constant(7)), v < first || v >= first + count) << v;
        for (std::uint32_t n = 0; n < info.normals; ++n)
            ASSERT_EQ(out.normals[n] == Vec3f(Vec3f::Constant(7)), n < first_normal || n >= first_normal + normals)
                << n;
        all_vertices += count, all_normals += normals;
    }
    EXPECT_EQ(all_vertices, info.vertices);
    EXPECT_EQ(all_normals, info.normals);
}

TEST(RuntimeRestore, StridesLeaveWhatIsBetween) {
    const Model model = stripped(with_vertex_normals(make_wavy_cube({.resolution = 20})), {.base = 80}).model;
    const Opened opened = open_model(write_model(model));
    const flg_info info = info_of(opened);
    const Pose pose = random_pose(model, 4);
    const RuntimeMesh packed = restore_all(opened, pose);
    const SetPose set(opened, pose);
    Scratch scratch(opened);
    std::vector<float> vertices(std::size_t{8} * info.vertices, 7); // position, one, normal, one
    ASSERT_EQ(flg_restore_parts(opened.get(), set.get(), 0, info.parts, vertices.data(), 32, vertices.data() + 4, 32,
                                scratch.get()),
              FLG_OK);
    for (std::size_t v = 0; v < info.vertices; ++v) {
        ASSERT_EQ(std::memcmp(&vertices[8 * v], &packed.positions[v], 12), 0);
        ASSERT_EQ(std::memcmp(&vertices[8 * v + 4], &packed.normals[v], 12), 0);
        ASSERT_EQ(vertices[8 * v + 3], 7);
        ASSERT_EQ(vertices[8 * v + 7], 7);
    }
}

TEST(RuntimeRestore, PositionsAndNormalsAloneAreTheSame) {
    for (const auto& [name, model] : models_of_every_kind()) {
        SCOPED_TRACE(name);
        const Opened opened = open_model(write_model(model));
        const flg_info info = info_of(opened);
        const Pose pose = random_pose(model, 5);
        const RuntimeMesh both = restore_all(opened, pose);
        const SetPose set(opened, pose);
        Scratch scratch(opened);
        RuntimeMesh alone{std::vector<Vec3f>(info.vertices), std::vector<Vec3f>(info.normals)};
        ASSERT_EQ(flg_restore(opened.get(), set.get(), floats(alone.positions), nullptr, scratch.get()), FLG_OK);
        ASSERT_EQ(flg_restore(opened.get(), set.get(), nullptr, floats(alone.normals), scratch.get()), FLG_OK);
        EXPECT_TRUE(same_bytes(alone.positions, both.positions));
        EXPECT_TRUE(same_bytes(alone.normals, both.normals));
        EXPECT_EQ(flg_restore(opened.get(), set.get(), nullptr, nullptr, scratch.get()), FLG_OK);
    }
}

TEST(RuntimeRestore, NotANumberStaysWhereItIsUsed) {
    const Model model = stripped(make_wavy_cube({.resolution = 16}), {.base = 60}).model;
    const Opened opened = open_model(write_model(model));
    Pose pose = random_pose(model, 6);
    pose.positions[5] = Vec3f::Constant(NAN);
    const RuntimeMesh out = restore_all(opened, pose);
    std::size_t lost = 0;
    for (const Vec3f& p : out.positions) lost += !p.allFinite();
    EXPECT_GT(lost, 0u);
    EXPECT_LT(lost, out.positions.size() / 2);
    const RuntimeMesh estimated = restore_all(opened, without_gradients(pose));
    lost = 0;
    for (const Vec3f& p : estimated.positions) lost += !p.allFinite();
    EXPECT_GT(lost, 0u);
    EXPECT_LE(lost, out.positions.size());
}

TEST(RuntimeRestore, ACollapsedDriverGivesFiniteNumbers) {
    const Model model = stripped(with_vertex_normals(make_wavy_cube({.resolution = 16})), {.base = 60}).model;
    const Opened opened = open_model(write_model(model));
    Pose pose = rest_pose(model);
    for (Vec3f& p : pose.positions) p = Vec3f(1, 2, 3);
    const RuntimeMesh out = restore_all(opened, pose);
    for (const Vec3f& p : out.positions) ASSERT_TRUE(p.allFinite());
    for (const Vec3f& n : out.normals) ASSERT_TRUE(n.allFinite());
}

TEST(RuntimeSkin, IsARestore) {
    for (const auto& [name, model] : models_of_every_kind())
        for (const std::uint32_t level : {FLG_FINEST, 0u}) {
            SCOPED_TRACE(name + (level == 0 ? ", driver" : ""));
            const Opened opened = open_model(write_model(model), options_of(0, level));
            const flg_info info = info_of(opened);
            const Pose pose = random_pose(model, 5);
            const SetPose set(opened, pose);
            std::vector<std::array<float, 16>> matrices(info.driver_vertices);
            ASSERT_EQ(flg_skin_matrices(opened.get(), set.get(), matrices[0].data()), FLG_OK);
            std::vector<std::array<std::uint32_t, 3>> drivers(info.vertices);
            std::vector<Vec3f> weights(info.vertices), points(info.vertices), moved(info.vertices);
            const std::uint32_t half = info.vertices / 2;
            ASSERT_EQ(flg_skin(opened.get(), 0, half, drivers[0].data(), floats(weights), floats(points)), FLG_OK);
            ASSERT_EQ(flg_skin(opened.get(), half, info.vertices - half, drivers[half].data(), weights[half].data(),
                               points[half].data()),
                      FLG_OK);
            for (std::uint32_t v = 0; v < info.vertices; ++v) {
                Vec3d sum = Vec3d::Zero();
                for (int k = 0; k < 3; ++k) {
                    ASSERT_LT(drivers[v][k], info.driver_vertices);
                    const Eigen::Map<const Eigen::Matrix4f> matrix(matrices[drivers[v][k]].data());
                    ASSERT_EQ(matrix.row(3), Eigen::RowVector4f(0, 0, 0, 1));
                    sum += double(weights[v][k]) *
                           (matrix.cast<double>() * points[v].cast<double>().homogeneous()).head<3>();
                }
                moved[v] = sum.cast<float>();
                EXPECT_NEAR(weights[v].sum(), 1, 1e-6);
            }
            EXPECT_LT(distance(moved, restore_all(opened, pose).positions).max, 1e-6);
        }
}

TEST(RuntimeGradients, AreTheLibrarysInAnyRange) {
    for (const auto& [name, model] : models_of_every_kind()) {
        SCOPED_TRACE(name);
        const Opened opened = open_model(write_model(model));
        const auto drivers = static_cast<std::uint32_t>(model.driver().vertices.size());
        const Pose pose = without_gradients(random_pose(model, 7));
        const std::vector<Mat3f> wanted = restorer_of(model).gradients(pose, kOneThread).value();
        std::vector<Mat3f> got(drivers, Mat3f::Constant(7));
        ASSERT_EQ(flg_gradients(opened.get(), floats(pose.positions), drivers, 0, drivers / 2, got[0].data()), FLG_OK);
        for (std::uint32_t i = drivers / 2; i < drivers; ++i) ASSERT_EQ(got[i], Mat3f(Mat3f::Constant(7)));
        ASSERT_EQ(flg_gradients(opened.get(), floats(pose.positions), drivers, drivers / 2, drivers - drivers / 2,
                                got[0].data()),
                  FLG_OK);
        EXPECT_EQ(std::memcmp(got.data(), wanted.data(), drivers * sizeof(Mat3f)), 0);
        EXPECT_EQ(flg_gradients(opened.get(), floats(pose.positions), drivers, drivers, 0, got[0].data()), FLG_OK);
    }
}

} // namespace
} // namespace filigree
