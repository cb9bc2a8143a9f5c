// Models that are packed with the profile `runtime`: the runtime and the library read the same, and refuse what is
// damaged.
#include "runtime/opened.h"

#include "filigree/io/model/model_file.h"
#include "filigree/io/model/model_sections.h"
#include "filigree/pack.h"
#include "filigree/restore.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace filigree {
namespace {

using namespace filigree_test;

struct Packed {
    std::string bytes;
    PackReport report;
};

Packed pack_records(const Model& model, const PoseSequence& poses = {}, PackOptions options = {}) {
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("packed_test_" + std::to_string(::getpid()) + ".fil");
    options.records = true;
    Packed packed;
    packed.report = pack_model(model, poses, options, path, kOneThread).value();
    std::ifstream file(path, std::ios::binary);
    packed.bytes.assign((std::istreambuf_iterator<char>(file)), {});
    file.close();
    std::filesystem::remove(path);
    return packed;
}

/// Each face from its smallest vertex on, sorted. order: which vertex each is.
std::vector<std::vector<Index>> faces_of(const Mesh& mesh, std::span<const Index> order) {
    std::vector<std::vector<Index>> faces;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        std::vector<Index>& face = faces.emplace_back(mesh.face(f).begin(), mesh.face(f).end());
        for (Index& v : face) v = order.empty() ? v : order[v];
        std::ranges::rotate(face, std::ranges::min_element(face));
    }
    std::ranges::sort(faces);
    return faces;
}

/// The point of the driver that each vertex hangs on.
std::vector<Vec3d> anchors_of(const Model& model) {
    const std::vector<Vec3f> driver = driver_positions(model);
    std::vector<Vec3d> anchors(model.mesh.vertex_count());
    for (std::size_t c = 0; c < model.detail.cells.size(); ++c)
        for (Index r = model.detail.cell_offsets[c]; r < model.detail.cell_offsets[c + 1]; ++r) {
            const double u = double(model.detail.u[r]), v = double(model.detail.v[r]);
            const Triangle& cell = model.detail.cells[c];
            anchors[model.detail.order[r]] = (1 - u - v) * driver[cell[0]].cast<double>() +
                                             u * driver[cell[1]].cast<double>() + v * driver[cell[2]].cast<double>();
        }
    return anchors;
}

/// Weights that have nothing to do with where vertices are.
Model with_any_weights(Model model) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> any(0, 1);
    for (std::size_t r = 0; r < model.detail.order.size(); ++r) {
        model.detail.u[r] = any(random);
        model.detail.v[r] = (1 - model.detail.u[r]) * any(random);
    }
    return model;
}

TEST(RuntimePacked, KeepsMeshDriverAndRecords) {
    std::vector<NamedModel> models = models_of_every_kind();
    models.push_back(
        {"any weights", with_any_weights(stripped(make_wavy_cube({.resolution = 12}), {.base = 50}).model)});
    for (const auto& [name, model] : models) {
        SCOPED_TRACE(name);
        const Packed packed = pack_records(model);
        const Model read = read_model(packed.bytes, "the packed model", kOneThread).value();
        const std::span<const Index> order = packed.report.vertex_order;
        ASSERT_EQ(order.size(), model.vertex_count());
        EXPECT_EQ(faces_of(read.mesh, order), faces_of(model.mesh, {}));
        const double diagonal = bounds(model.mesh).diagonal(), size = diagonal > 0 ? diagonal : 1;
        const std::vector<Vec3d> anchors = anchors_of(model), read_anchors = anchors_of(read);
        for (Index v = 0; v < order.size(); ++v) {
            ASSERT_LE((read.mesh.positions[v] - model.mesh.positions[order[v]]).cast<double>().norm(), 1e-4 * size);
            // weights are kept to 1 / 1024 of a cell, which is as large as the mesh at most, and expected ones to a
            // step
            ASSERT_LE((read_anchors[v] - anchors[order[v]]).norm(), 2e-3 * size) << v;
        }
        const std::vector<Vec3f> driver = driver_positions(model), read_driver = driver_positions(read);
        ASSERT_EQ(read_driver.size(), driver.size());
        for (std::size_t i = 0; i < driver.size(); ++i)
            ASSERT_LE((read_driver[i] - driver[i]).cast<double>().norm(), 1e-4 * size);
        EXPECT_EQ(read.driver_is_behind, model.driver_is_behind);
        EXPECT_EQ(read.detail.across_gap.size(), model.detail.across_gap.size());
        EXPECT_EQ(read.detail.facing_away.size(), model.detail.facing_away.size());
        EXPECT_LE(packed.report.rms, packed.report.largest);
        EXPECT_LE(packed.report.largest, 1e-4 * size);
    }
}

TEST(RuntimePacked, IsOpenedAsTheLibraryReadsIt) {
    for (const auto& [name, model] : models_of_every_kind()) {
        SCOPED_TRACE(name);
        const std::string bytes = pack_records(model).bytes;
        const Model read = read_model(bytes, "the packed model", kOneThread).value();
        const std::string plain = write_model(read);
        const Opened packed = open_model(bytes), opened = open_model(plain);
        const flg_info info = info_of(packed);
        EXPECT_EQ(info.vertices, read.vertex_count());
        EXPECT_EQ(info.levels, 2u);
        EXPECT_EQ(info.normal_source, info_of(opened).normal_source);
        const Pose pose = random_pose(read, 5);
        const RuntimeMesh a = restore_all(packed, pose), b = restore_all(opened, pose);
        EXPECT_TRUE(a.positions == b.positions);
        EXPECT_TRUE(a.normals == b.normals);
        const Opened driver = open_model(bytes, options_of(0, 0));
        EXPECT_EQ(info_of(driver).vertices, read.driver().vertices.size());
        for (std::uint32_t k = 0; k < 3 * info.triangles; ++k)
            ASSERT_EQ(flg_triangles(packed.get())[k], flg_triangles(opened.get())[k]);
    }
}

/// Quads and triangles, with every attribute.
Mesh decorated() {
    Mesh mesh = make_wavy_cube({.resolution = 8});
    for (const Index v : {0u, 1u, 2u}) (void)v;
    mesh.add_face(std::array<Index, 3>{0, 1, 5});
    std::mt19937 random(3);
    std::uniform_real_distribution<float> any(0, 1);
    for (std::size_t f = 0; f < mesh.face_count(); ++f) { // islands of four faces
        for (std::size_t k = 0; k < mesh.face_size(f); ++k) {
            mesh.uvs.corners.push_back(f % 11 == 0 ? kNoIndex : static_cast<Index>(mesh.uvs.values.size()));
            mesh.uvs.values.push_back({any(random), 3 * any(random)});
        }
        mesh.objects.of_face.push_back(static_cast<Index>(f / 100));
        mesh.materials.of_face.push_back(f % 5 == 0 ? kNoIndex : static_cast<Index>(f % 2));
        mesh.smoothing.push_back(static_cast<Index>(f % 3));
    }
    for (Index k = 0; k * 100 < mesh.face_count(); ++k) mesh.objects.names.push_back("part " + std::to_string(k));
    mesh.materials.names = {"wood", "glass"};
    mesh.scalars.push_back({"heat", {}});
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        mesh.colors.push_back({any(random), any(random), any(random), any(random)});
        mesh.scalars[0].values.push_back(any(random) - 0.5f);
    }
    mesh.colors_have_alpha = true;
    return with_corner_normals(std::move(mesh));
}

TEST(RuntimePacked, KeepsAttributes) {
    const Model model = stripped(decorated(), {.base = 40}).model;
    const Packed packed = pack_records(model);
    const Model read = read_model(packed.bytes, "the packed model", kOneThread).value();
    const std::vector<Index>& order = packed.report.vertex_order;
    for (Index v = 0; v < order.size(); ++v) {
        EXPECT_LE((read.mesh.colors[v] - model.mesh.colors[order[v]]).cwiseAbs().maxCoeff(), 0.5f / 255 + 1e-6f);
        EXPECT_EQ(read.mesh.scalars[0].values[v], model.mesh.scalars[0].values[order[v]]); // bit for bit
    }
    EXPECT_EQ(read.mesh.scalars[0].name, "heat");
    EXPECT_TRUE(read.mesh.colors_have_alpha);
    EXPECT_EQ(read.mesh.materials.names, model.mesh.materials.names);
    // Faces by their vertices: what each has.
    std::map<std::vector<Index>, std::size_t> face_of;
    const auto key = [](std::vector<Index> face) {
        std::ranges::rotate(face, std::ranges::min_element(face));
        return face;
    };
    for (std::size_t f = 0; f < model.mesh.face_count(); ++f)
        face_of[key({model.mesh.face(f).begin(), model.mesh.face(f).end()})] = f;
    for (std::size_t f = 0; f < read.mesh.face_count(); ++f) {
        std::vector<Index> face(read.mesh.face(f).begin(), read.mesh.face(f).end());
        for (Index& v : face) v = order[v];
        const std::size_t source = face_of.at(key(face));
        EXPECT_EQ(read.mesh.objects.of_face[f], model.mesh.objects.of_face[source]);
        EXPECT_EQ(read.mesh.materials.of_face[f], model.mesh.materials.of_face[source]);
        EXPECT_EQ(read.mesh.smoothing[f], model.mesh.smoothing[source]);
        for (std::size_t k = 0; k < face.size(); ++k) {
            const std::size_t corner = read.mesh.face_offsets[f] + k;
            const auto at = std::ranges::find(model.mesh.face(source), face[k]);
            const std::size_t other =
                model.mesh.face_offsets[source] + std::size_t(at - model.mesh.face(source).begin());
            const Index uv = read.mesh.uvs.corners[corner], other_uv = model.mesh.uvs.corners[other];
            ASSERT_EQ(uv == kNoIndex, other_uv == kNoIndex);
            if (uv != kNoIndex) {
                EXPECT_LE((read.mesh.uvs.values[uv] - model.mesh.uvs.values[other_uv]).norm(), 1e-3f);
            }
            const Index normal = read.mesh.normals.corners[corner], other_normal = model.mesh.normals.corners[other];
            ASSERT_EQ(normal == kNoIndex, other_normal == kNoIndex);
            if (normal != kNoIndex) {
                EXPECT_LE(
                    (read.mesh.normals.values[normal] - model.mesh.normals.values[other_normal].normalized()).norm(),
                    2e-3f);
            }
        }
    }
    const Opened opened = open_model(packed.bytes);
    const void* items = nullptr;
    std::uint32_t item_size = 0;
    std::size_t count = 0;
    ASSERT_EQ(flg_find_decoded(opened.get(), "uv.val", 0, &items, &item_size, &count), FLG_OK);
    ASSERT_EQ(count, read.mesh.uvs.values.size());
    EXPECT_EQ(std::memcmp(items, read.mesh.uvs.values.data(), count * item_size), 0);
    EXPECT_EQ(flg_find_decoded(opened.get(), "mat.fac", 0, &items, &item_size, &count), FLG_OK);
    EXPECT_EQ(flg_find_decoded(opened.get(), "mesh.pos", 0, &items, &item_size, &count), FLG_MISSING);
    EXPECT_EQ(flg_find_decoded(nullptr, "uv.val", 0, &items, &item_size, &count), FLG_ARGUMENT);
    EXPECT_EQ(flg_find_section(packed.bytes.data(), packed.bytes.size(), "mat.nam", 0, &items, &item_size, &count),
              FLG_OK);
}

TEST(RuntimePacked, KeepsPoses) {
    const Model model = stripped(make_wavy_cube({.resolution = 10}), {.base = 40}).model;
    for (const bool with_gradients : {false, true}) {
        PoseSequence poses{25, {}};
        for (unsigned k = 0; k < 140; ++k) { // two blocks
            Pose pose = rest_pose(model);
            for (Vec3f& p : pose.positions) p += 0.3f * std::sin(0.1f * float(k)) * Vec3f(p[1], p[2], 1);
            if (with_gradients)
                pose.gradients.assign(pose.positions.size(), Mat3f::Identity() * (1 + 0.01f * float(k % 7)));
            poses.frames.push_back(pose);
        }
        const std::string bytes = pack_records(model, poses).bytes;
        const PoseSequence read = read_poses(bytes, "the packed model").value();
        ASSERT_EQ(read.frames.size(), poses.frames.size());
        EXPECT_EQ(read.frames_per_second, 25);
        const Opened opened = open_model(bytes);
        const flg_info info = info_of(opened);
        ASSERT_EQ(info.frames, read.frames.size());
        EXPECT_EQ(info.frames_per_second, 25);
        EXPECT_EQ(info.frames_have_gradients, with_gradients ? 1u : 0u);
        std::vector<Vec3f> positions(info.driver_vertices);
        std::vector<Mat3f> gradients(info.driver_vertices);
        for (const std::uint32_t frame : {0u, 77u, 139u}) {
            ASSERT_EQ(flg_read_frame(opened.get(), bytes.data(), bytes.size(), frame, floats(positions),
                                     with_gradients ? gradients[0].data() : nullptr),
                      FLG_OK);
            EXPECT_TRUE(positions == read.frames[frame].positions);
            if (with_gradients) {
                EXPECT_TRUE(gradients == read.frames[frame].gradients);
            }
            for (std::size_t i = 0; i < positions.size(); ++i)
                EXPECT_LE((positions[i] - poses.frames[frame].positions[i]).norm(), 1e-3f);
        }
        EXPECT_EQ(flg_read_frame(opened.get(), bytes.data(), bytes.size(), 140, floats(positions), nullptr),
                  FLG_MISSING);
    }
}

TEST(RuntimePacked, IsTheSameOnAnyNumberOfThreadsAndPackedAgain) {
    const Model model = stripped(make_wavy_sphere({.resolution = 12}), {.base = 60}).model;
    const std::string bytes = pack_records(model).bytes;
    EXPECT_EQ(pack_records(model).bytes, bytes);
    const Model read = read_model(bytes, "the packed model", kOneThread).value();
    const Packed again = pack_records(read);
    EXPECT_LE(again.report.anchor_largest, 3e-4 * bounds(model.mesh).diagonal());
}

TEST(RuntimePacked, ModelsWithFreeWeightsArePackedSoByThemselves) {
    const Model bound = stripped(make_wavy_cube({.resolution = 12}), {.base = 50}).model,
                free = with_any_weights(bound);
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("packed_test_free_" + std::to_string(::getpid()) + ".fil");
    EXPECT_FALSE(pack_model(bound, {}, {}, path, kOneThread).value().has_records);
    EXPECT_TRUE(pack_model(free, {}, {}, path, kOneThread).value().has_records);
    const PackReport in_order = pack_model(free, {}, {.keep_order = true}, path, kOneThread).value();
    EXPECT_FALSE(in_order.has_records);
    EXPECT_TRUE(in_order.loses_weights);
    EXPECT_EQ(pack_model(free, {}, {.levels = true, .records = true}, path, kOneThread).error().code, ErrorCode::usage);
    EXPECT_EQ(pack_model(free, {}, {.bits = 9, .records = true}, path, kOneThread).error().code, ErrorCode::usage);
    std::filesystem::remove(path);
}

TEST(RuntimePacked, DamageIsRefusedOrHarmless) {
    PoseSequence poses{24, {}};
    Mesh mesh = decorated();
    const Model model = stripped(std::move(mesh), {.base = 30}).model;
    poses.frames.assign(5, rest_pose(model));
    const std::string bytes = pack_records(model, poses).bytes;
    EXPECT_EQ(open_status(bytes.substr(0, bytes.size() / 2)), FLG_DAMAGED);
    std::mt19937 random(1);
    std::size_t refused = 0;
    const std::size_t tries = 300;
    for (std::size_t k = 0; k < tries; ++k) { // without checksums: what the code itself makes of it
        std::string damaged = bytes;
        for (int n = 0; n < 3; ++n) damaged[600 + random() % (bytes.size() - 600)] ^= char(1 << random() % 8);
        const flg_status status = open_status(damaged, options_of(FLG_WITHOUT_CHECKSUMS));
        EXPECT_TRUE(status == FLG_OK || status == FLG_DAMAGED || status == FLG_NEWER) << status;
        refused += status != FLG_OK;
        EXPECT_NE(open_status(damaged), FLG_NO_MEMORY);
        const Result<Model> read = read_model(damaged, "the file", kOneThread);
        EXPECT_FALSE(read.ok() && read->mesh.vertex_count() != model.mesh.vertex_count());
    }
    EXPECT_GT(refused, tries / 4);
}

} // namespace
} // namespace filigree
