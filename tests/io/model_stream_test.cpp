// Streams: the mesh gets better with every byte, however the bytes come; the whole file is a model with its poses.
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/file.h"
#include "filigree/pack.h"

#include "filigree/mesh.h"
#include "filigree/strip.h"
#include "new_folder.h"
#include "threads.h"

#include <algorithm>
#include <gtest/gtest.h>

namespace model_stream_test {

using namespace filigree;

namespace {

Model wavy_model() { return strip(make_wavy_sphere({.resolution = 40}), {.base = 200}, kTwoThreads)->model; }

/// The driver turned and drawn out, with gradients.
PoseSequence turning(const Model& model, std::size_t frames) {
    PoseSequence poses{30, {}};
    for (std::size_t t = 0; t < frames; ++t) {
        Pose& pose = poses.frames.emplace_back(rest_pose(model));
        const float angle = 0.05f * float(t);
        Mat3f turn = Eigen::AngleAxisf(angle, Vec3f::UnitY()).toRotationMatrix();
        turn *= 1 + 0.01f * float(t);
        for (Vec3f& p : pose.positions) p = turn * p;
        pose.gradients.assign(pose.positions.size(), turn);
    }
    return poses;
}

std::string frames_of(const Model& model, const PoseSequence& poses) {
    const std::filesystem::path folder = new_folder(), path = folder / "stream.fil";
    pack_model(model, poses, {.levels = true}, path, kTwoThreads).value();
    std::string bytes = read_file(path).value();
    std::filesystem::remove_all(folder);
    return bytes;
}

} // namespace

TEST(ModelStream, BetterWithEveryLevel) {
    const Model model = wavy_model();
    const std::string bytes = frames_of(model, {});
    const ModelOutline outline = read_model_outline(FileReader(bytes), "it", kTwoThreads).value();
    const std::vector<PackedLevelMark>& marks = outline.coding->levels;
    ASSERT_GE(marks.size(), 4u);
    EXPECT_LT(marks[0].bytes, bytes.size() / 4);
    for (const std::size_t piece : {std::size_t{1}, std::size_t{97}, bytes.size()}) {
        ModelStream stream("it");
        EXPECT_EQ(stream.mesh().vertex_count(), 0u);
        std::size_t levels = 0;
        for (std::size_t at = 0; at < bytes.size(); at += piece) {
            ASSERT_TRUE(stream.feed(std::string_view(bytes).substr(at, piece)).ok());
            const std::uint64_t there = std::min(at + piece, bytes.size());
            for (; levels < stream.level_count(); ++levels) EXPECT_GE(there, marks[levels].bytes);
            const std::uint64_t next = stream.next_level_end();
            ASSERT_TRUE(next == 0 || levels == marks.size() || next == marks[levels].bytes);
            if (levels == 0 || piece == 1) continue;
            EXPECT_EQ(stream.error(), marks[levels - 1].error);
            ASSERT_EQ(stream.mesh().vertex_count(), marks[levels - 1].vertices);
        }
        EXPECT_EQ(levels, marks.size());
        EXPECT_EQ(stream.mesh().vertex_count(), model.mesh.vertex_count());
    }
}

TEST(ModelStream, TheWholeFileIsAModelWithItsPoses) {
    const Model model = wavy_model();
    const PoseSequence poses = turning(model, 300); // more than a block
    const std::string bytes = frames_of(model, poses);
    const Model back = read_model(bytes, "it", kTwoThreads).value();
    EXPECT_EQ(back.mesh.face_count(), model.mesh.face_count());
    EXPECT_EQ(back.driver().vertices.size(), model.driver().vertices.size());
    const PoseSequence read = read_poses(bytes, "it", kTwoThreads).value();
    ASSERT_EQ(read.frames.size(), poses.frames.size());
    EXPECT_EQ(read.frames_per_second, 30);
    const float diagonal = float(world_bounds(model.mesh).diagonal());
    for (std::size_t t = 0; t < poses.frames.size(); t += 37)
        for (std::size_t v = 0; v < poses.frames[t].positions.size(); ++v) {
            ASSERT_LT((read.frames[t].positions[v] - poses.frames[t].positions[v]).norm(), 1e-4f * diagonal);
            ASSERT_LT((read.frames[t].gradients[v] - poses.frames[t].gradients[v]).norm(), 1e-2f);
        }
    const ModelOutline outline = read_model_outline(FileReader(bytes), "it", kTwoThreads).value();
    EXPECT_EQ(outline.frames, 300u);
    EXPECT_TRUE(outline.has_gradients);
}

TEST(ModelStream, LevelsHaveTexturesMaterialsAndColours) {
    Mesh mesh = make_wavy_sphere({.resolution = 40});
    mesh.materials.names = {"front", "back"};
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        mesh.materials.of_face.push_back(mesh.positions[mesh.face(f)[0]][2] < 0);
    for (const Vec3f& p : mesh.positions) {
        mesh.uvs.values.emplace_back(p[0], p[1]);
        mesh.colors.emplace_back(0.5f, 0.25f, std::clamp(p[2], 0.0f, 1.0f), 1.0f);
    }
    for (const char* name : {"front", "back"}) {
        MeshMaterial& material = mesh.embedded_materials.emplace_back();
        material.name = name;
        material.picture_bytes = std::make_shared<const std::string>(5000, 'p');
    }
    const Model model = strip(mesh, {.base = 200}, kTwoThreads)->model;
    const std::string bytes = frames_of(model, {});
    ModelStream stream("it");
    for (const char byte : bytes) {
        ASSERT_TRUE(stream.feed(std::string_view(&byte, 1)).ok());
        if (stream.level_count() == 1) break;
    }
    ASSERT_EQ(stream.level_count(), 1u);
    EXPECT_LT(stream.mesh().vertex_count(), mesh.vertex_count() / 4);
    const Mesh first = stream.mesh();
    ASSERT_EQ(check_mesh(first), "");
    EXPECT_EQ(first.materials.names, mesh.materials.names);
    EXPECT_EQ(first.embedded_materials.size(), 2u) << "their pictures come later";
    ASSERT_EQ(first.uvs.corners.size(), first.corner_count());
    for (std::size_t c = 0; c < first.corner_count(); ++c) {
        const Vec3f& p = first.positions[first.corners[c]];
        ASSERT_LT((first.uvs.values[first.uvs.corners[c]] - p.head<2>()).norm(), 2e-3f);
        ASSERT_NEAR(first.colors[first.corners[c]][2], std::clamp(p[2], 0.0f, 1.0f), 5e-3f);
    }
    const Model back = read_model(bytes, "it", kTwoThreads).value();
    EXPECT_EQ(std::ranges::count(back.mesh.materials.of_face, 1u), std::ranges::count(mesh.materials.of_face, 1u));
    ASSERT_EQ(back.mesh.uvs.values.size(), mesh.vertex_count());
    ASSERT_EQ(back.mesh.embedded_materials.size(), 2u);
    EXPECT_EQ(back.mesh.embedded_materials[1].picture_bytes->size(), 5000u);
}

TEST(ModelStream, OtherFilesAndDamageAreNamed) {
    const Model model = wavy_model();
    ModelStream plain("plain.fil");
    EXPECT_EQ(plain.feed(write_model(model)).error().code, ErrorCode::unsuitable);
    ModelStream text("it.txt");
    EXPECT_EQ(text.feed(std::string(100, 'x')).error().code, ErrorCode::bad_file);
    const std::string bytes = frames_of(model, {});
    for (std::size_t at = 0; at < bytes.size(); at += 11) {
        std::string damaged = bytes;
        damaged[at] = char(damaged[at] ^ 0x41);
        ModelStream stream("it");
        const Status fed = stream.feed(damaged);
        if (fed)
            EXPECT_EQ(check_mesh(stream.mesh()), "");
        else
            EXPECT_EQ(fed.error().code, ErrorCode::bad_file) << fed.error().message;
    }
}

} // namespace model_stream_test
