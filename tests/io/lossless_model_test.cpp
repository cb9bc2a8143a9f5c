// Lossless model files: byte for byte the plain file, whatever the model; parts of it are read as from a plain one.
#include "coded_size.h"
#include "corpus.h"
#include "new_folder.h"
#include "sample_meshes.h"
#include "threads.h"

#include "filigree/file.h"
#include "filigree/io/model/model_chunks.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/model/model_sections.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <gtest/gtest.h>

using namespace filigree;

namespace {

PoseSequence bending(const Model& model, std::size_t frames, bool with_gradients) {
    PoseSequence poses{24, {}};
    for (std::size_t t = 0; t < frames; ++t) {
        Pose& pose = poses.frames.emplace_back(rest_pose(model));
        for (Vec3f& p : pose.positions) p.x() += 0.01f * float(t) * std::sin(3 * p.y());
        if (with_gradients)
            for (const Vec3f& p : pose.positions) pose.gradients.push_back(Mat3f::Identity() * (1 + 0.01f * p.x()));
    }
    return poses;
}

std::string lossless_file(const Model& model, const PoseSequence& poses, std::uint64_t* plain = nullptr) {
    const std::filesystem::path folder = new_folder(), path = folder / "it.fil";
    const LosslessPackReport report = pack_model_lossless(model, poses, path, kTwoThreads).value();
    if (plain) *plain = report.plain;
    std::string bytes = read_file(path).value();
    std::filesystem::remove_all(folder);
    return bytes;
}

/// Bytes of the lossless file, which gives the plain one again.
std::size_t expect_same(const Model& model, const PoseSequence& poses) {
    std::uint64_t plain_bytes = 0;
    const std::string coded = lossless_file(model, poses, &plain_bytes), plain = write_model(model, poses);
    EXPECT_EQ(plain_bytes, plain.size());
    const Result<Model> read = read_model(coded, "it", kTwoThreads);
    EXPECT_TRUE(read.ok()) << (read ? "" : read.error().message);
    EXPECT_TRUE(read && write_model(*read, read_poses(coded, "it", kTwoThreads).value()) == plain);
    return coded.size();
}

} // namespace

TEST(LosslessModel, EveryKindComesBackByteForByte) {
    const Mesh sphere = make_wavy_sphere({.resolution = 12}), cube = make_wavy_cube({.resolution = 8});
    const Model model = strip(sphere, {.base = 40}, kTwoThreads)->model;
    expect_same(model, {});
    expect_same(model, bending(model, 70, true));
    expect_same(model, bending(model, 3, false));
    expect_same(strip(cube, {.base = 30, .reorder = true}, kTwoThreads)->model, {});
    for (const Mesh& mesh : {filigree_test::make_vertex_attribute_mesh(), filigree_test::make_corner_attribute_mesh(),
                             filigree_test::make_far_mesh()})
        expect_same(strip(mesh, {.base = 3}, kTwoThreads)->model, {});
}

TEST(LosslessModel, SeveralChunksAndSmaller) {
    const Mesh mesh = make_wavy_cube({.resolution = 220}); // 290,402 vertices
    const Model model = strip(mesh, {.base = 500}, kTwoThreads)->model;
    const PoseSequence poses = bending(model, 2, true);
    const std::size_t bytes = expect_same(model, poses);
    EXPECT_LT(double(bytes), 0.45 * double(write_model(model, poses).size()));
}

TEST(LosslessModel, SizesStay) {
    Mesh mesh = make_wavy_sphere({.resolution = 60});
    const auto size_of = [&](const StripOptions& options, std::size_t frames = 0) {
        const Model model = strip(mesh, options, kTwoThreads)->model;
        return expect_same(model, bending(model, frames, true));
    };
    expect_coded_size(size_of({.base = 100}), 278016, "places and details");
    expect_coded_size(size_of({.base = 100}, 20), 299992, "with 20 poses");
    expect_coded_size(size_of({.base = 100, .reorder = true}), 343296, "in the order of places");
    mesh.normals.values = vertex_normals(mesh, mesh.positions, kTwoThreads);
    for (const Vec3f& p : mesh.positions) {
        mesh.uvs.values.emplace_back(0.5f + 0.4f * p.x(), 0.5f + 0.4f * p.y() * p.z());
        mesh.colors.emplace_back(0.5f + 0.3f * p.x(), 0.5f + 0.3f * p.y(), p.z() > 0 ? 0.9f : 0.2f, 1.0f);
    }
    expect_coded_size(size_of({.base = 100}), 566296, "with normals, texture coordinates and colours");
}

TEST(LosslessModel, PartsAreReadAsFromAPlainFile) {
    const Model model = strip(make_wavy_sphere({.resolution = 30}), {.base = 100}, kTwoThreads)->model;
    const PoseSequence poses = bending(model, 40, true);
    const std::string coded = lossless_file(model, poses), plain = write_model(model, poses);
    const FileReader one(coded), other(plain);
    const ModelOutline outline = read_model_outline(one, "it", kTwoThreads).value();
    ASSERT_TRUE(outline.lossless.has_value());
    EXPECT_GT(outline.lossless->places, 0u);
    EXPECT_GT(outline.lossless->clips, 0u);
    EXPECT_FALSE(outline.coding.has_value());
    EXPECT_EQ(outline.frames, 40u);
    ASSERT_EQ(outline.levels.size(), model.levels.size() + 1);
    for (unsigned k = 0; k < outline.levels.size(); ++k) {
        const Mesh a = read_model_level(one, k, "it", kTwoThreads).value();
        const Mesh b = read_model_level(other, k, "it", kTwoThreads).value();
        EXPECT_EQ(a.positions, b.positions);
        EXPECT_EQ(a.corners, b.corners);
    }
    const ModelChunks chunks = ModelChunks::open(FileReader(coded), "it", kTwoThreads).value();
    EXPECT_EQ(chunks.vertex_count(), model.mesh.vertex_count());
    EXPECT_TRUE(chunks.restorer(0, RunContext()).ok());
    const SectionReader in(one); // any frame, in any order
    const SectionReader flat(other);
    for (const std::uint32_t frame : {39u, 0u, 31u, 32u, 33u, 5u})
        EXPECT_EQ(in.array<Vec3f>("pose.pos", frame), flat.array<Vec3f>("pose.pos", frame));
}

TEST(LosslessModel, EveryChangedByteIsNamed) {
    const Model model = strip(filigree_test::make_corner_attribute_mesh(), {.base = 3}, kTwoThreads)->model;
    const std::string coded = lossless_file(model, bending(model, 2, false)), plain = write_model(model);
    std::size_t named = 0;
    for (std::size_t at = 0; at < coded.size(); ++at) {
        std::string damaged = coded;
        damaged[at] = char(damaged[at] ^ 0x41);
        const Result<Model> read = read_model(damaged, "it", kTwoThreads);
        if (!read) {
            ++named;
            EXPECT_FALSE(read.error().message.empty());
        } else
            EXPECT_TRUE(write_model(*read) == plain) << at; // bytes between sections, and poses
    }
    EXPECT_GT(named, coded.size() / 2);
    EXPECT_FALSE(read_model(coded.substr(0, coded.size() - 1), "it", kTwoThreads).ok());
}

TEST(LosslessModel, GoodMeshesOfTheCorpus) {
    const auto rows = filigree_test::read_corpus();
    if (rows.empty()) GTEST_SKIP() << "there is no corpus beside the project";
    std::size_t tried = 0;
    for (const filigree_test::CorpusRow& row : rows) {
        if (!row.file.starts_with("good/")) continue;
        Result<MeshFile> mesh = read_mesh(row.path, kTwoThreads);
        if (!mesh) continue;
        SCOPED_TRACE(row.file);
        const auto stripped = strip(std::move(mesh->mesh), {}, kTwoThreads);
        if (!stripped) continue;
        expect_same(stripped->model, bending(stripped->model, 3, true));
        ++tried;
    }
    EXPECT_GT(tried, 10u);
}
