// Models that stay in their files: chunk by chunk the same bytes as the whole.
#include "filigree/io/model/model_chunks.h"
#include "filigree/io/system/file.h"

#include "filigree/io/model/model_file.h"
#include "filigree/io/model/reference_file.h"
#include "filigree/mesh.h"
#include "filigree/strip.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <filesystem>

#include <unistd.h>

using namespace filigree;
namespace fs = std::filesystem;

namespace {

Model model_of(const Vec3d& origin = Vec3d::Zero()) {
    Mesh mesh = make_wavy_cube({.resolution = 220}); // two chunks
    mesh.origin = origin;
    return std::move(strip(mesh, {.base = 200}, kTwoThreads)->model);
}

PoseSequence bent_poses(const Model& model, bool with_gradients) {
    PoseSequence poses{24, {}};
    for (int frame = 0; frame < 3; ++frame) {
        Pose& pose = poses.frames.emplace_back(rest_pose(model));
        for (Vec3f& p : pose.positions) {
            Mat3f gradient = Mat3f::Identity();
            gradient(0, 1) = 0.2f * float(frame) * p.y();
            if (with_gradients) pose.gradients.push_back(gradient);
            p.x() += 0.1f * float(frame) * p.y() * p.y();
        }
    }
    return poses;
}

std::string bytes_of(const fs::path& path) {
    Result<std::string> bytes = read_file(path);
    EXPECT_TRUE(bytes.ok()) << (bytes.ok() ? "" : bytes.error().message);
    return bytes.ok() ? *bytes : "";
}

class ModelChunksTest : public testing::Test {
protected:
    ModelChunksTest() {
        std::string name = (fs::temp_directory_path() / "filigree-XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
    }
    ~ModelChunksTest() override { fs::remove_all(folder_); }

    Result<ModelChunks> open(const Model& model, const PoseSequence& poses = {}) {
        EXPECT_TRUE(write_model(model, poses, path("m.fil"), kTwoThreads).ok());
        return ModelChunks::open(*FileReader::open(path("m.fil")), "m.fil", kTwoThreads);
    }
    /// By way of the whole mesh.
    std::string whole(const PoseSequence& poses) {
        const Model model = *read_model(path("m.fil"), kTwoThreads);
        const Restorer restorer = *Restorer::create(model, {}, kTwoThreads);
        const Mesh rest = level_mesh(model, model.finest_level());
        const MeshAnimation animation{&rest, poses.frames.size(), 24, [&](std::size_t frame, std::span<Vec3f> out) {
                                          return restorer.positions(poses.frames[frame], out, kTwoThreads);
                                      }};
        EXPECT_TRUE(write_animation(animation, path("whole.pc2"), kTwoThreads).ok());
        return bytes_of(path("whole.pc2"));
    }
    fs::path path(const std::string& name) const { return folder_ / name; }

    fs::path folder_;
};

TEST_F(ModelChunksTest, RestoreTheSameBytesAsTheWhole) {
    for (const bool with_gradients : {false, true}) {
        const Model model = model_of();
        const PoseSequence poses = bent_poses(model, with_gradients);
        const Result<ModelChunks> chunks = open(model);
        ASSERT_TRUE(chunks.ok()) << chunks.error().message;
        EXPECT_EQ(chunks->count(), 2u);
        EXPECT_EQ(chunks->vertex_count(), model.mesh.vertex_count());
        for (std::size_t k = 0; k < 2; ++k) {
            const Box box = chunks->box(k);
            Box own;
            for (std::size_t v = chunks->first_vertex(k); v < chunks->first_vertex(k + 1); ++v)
                own.extend(model.mesh.positions[v].cast<double>());
            EXPECT_EQ(box.min, own.min);
            EXPECT_EQ(box.max, own.max);
        }
        const auto written = write_restored_chunks(*chunks, frames_of(poses), {}, path("chunks.pc2"), kTwoThreads);
        ASSERT_TRUE(written.ok()) << written.error().message;
        EXPECT_TRUE(written->empty());
        EXPECT_TRUE(bytes_of(path("chunks.pc2")) == whole(poses));
    }
}

/// One whose vertices end behind a chunk's beginning, and one whose mesh ends there while the driver's vertices go on.
TEST_F(ModelChunksTest, HaveNoVerticesOfADriverMadeElsewhere) {
    const Mesh ball = make_wavy_sphere({.resolution = 8, .amplitude = 0});
    Mesh even = make_wavy_cube({.resolution = 180});
    ASSERT_LT(even.vertex_count(), std::size_t{262'144});
    even.positions.resize(262'144 - 10, Vec3f(0.1f, 0.2f, 0.3f)); // vertices that no face has
    for (const Mesh& mesh : {make_wavy_cube({.resolution = 220}), even}) {
        const Model model = strip_to_driver(mesh, ball, kTwoThreads)->model;
        const PoseSequence poses = bent_poses(model, false);
        const Result<ModelChunks> chunks = open(model);
        ASSERT_TRUE(chunks.ok()) << chunks.error().message;
        EXPECT_EQ(chunks->vertex_count(), mesh.vertex_count());
        const ModelOutline outline = *read_model_outline(*FileReader::open(path("m.fil")), "m.fil", kTwoThreads);
        EXPECT_EQ(outline.levels.back().vertices, mesh.vertex_count());
        ASSERT_TRUE(write_restored_chunks(*chunks, frames_of(poses), {}, path("chunks.pc2"), kTwoThreads).ok());
        EXPECT_EQ(fs::file_size(path("chunks.pc2")), 32 + 3 * 12 * mesh.vertex_count());
        EXPECT_TRUE(bytes_of(path("chunks.pc2")) == whole(poses));
    }
}

TEST_F(ModelChunksTest, AreSharedByProcesses) {
    const Model model = model_of();
    const PoseSequence poses = bent_poses(model, false);
    const Result<ModelChunks> chunks = open(model);
    for (std::size_t part = 1; part <= 2; ++part) {
        const auto report = write_restored_chunks(*chunks, frames_of(poses), {}, path("shared.pc2"),
                                                  WorkChunk{part, 2, "job"}, kTwoThreads);
        ASSERT_TRUE(report.ok()) << report.error().message;
        EXPECT_EQ(report->is_whole, part == 2);
    }
    EXPECT_TRUE(bytes_of(path("shared.pc2")) == whole(poses));
}

TEST_F(ModelChunksTest, FarFromTheOriginLostDigitsAreSaid) {
    const Model model = model_of({1e6, 0, 0});
    const PoseSequence poses = bent_poses(model, false);
    const auto written = write_restored_chunks(*open(model), frames_of(poses), {}, path("chunks.pc2"), kTwoThreads);
    ASSERT_TRUE(written.ok());
    EXPECT_EQ(written->size(), 1u);
    EXPECT_TRUE(bytes_of(path("chunks.pc2")) == whole(poses));
}

TEST_F(ModelChunksTest, DamageIsSeenWhereItIsRead) {
    const Model model = model_of();
    const PoseSequence poses = bent_poses(model, false);
    ASSERT_TRUE(open(model).ok());
    std::string bytes = bytes_of(path("m.fil"));
    const Vec3f& last = model.mesh.positions.back();
    const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(&last), sizeof last));
    ASSERT_NE(at, std::string::npos);
    bytes[at] ^= 1;
    ASSERT_TRUE(write_file(path("m.fil"), bytes).ok());
    const Result<ModelChunks> chunks = ModelChunks::open(*FileReader::open(path("m.fil")), "m.fil", kTwoThreads);
    ASSERT_TRUE(chunks.ok());
    EXPECT_TRUE(chunks->restorer(0, RunContext()).ok());
    EXPECT_EQ(chunks->restorer(1, RunContext()).error().code, ErrorCode::bad_file);
    const auto written = write_restored_chunks(*chunks, frames_of(poses), {}, path("c.pc2"), kTwoThreads);
    EXPECT_EQ(written.error().code, ErrorCode::bad_file);
    EXPECT_NE(written.error().message.find("mesh.pos"), std::string::npos) << written.error().message;
    EXPECT_FALSE(fs::exists(path("c.pc2")));
}

TEST_F(ModelChunksTest, WhatHasNoneIsRefused) {
    const std::string reference =
        write_reference_model(*strip_to_reference(make_wavy_cube({.resolution = 8}), {}, kTwoThreads));
    EXPECT_EQ(ModelChunks::open(FileReader(std::string_view(reference)), "a", kTwoThreads).error().code,
              ErrorCode::unsuitable);
    const Model model = model_of();
    const Result<ModelChunks> chunks = open(model);
    const PoseSequence poses = bent_poses(model, false);
    const auto code = [&](const PoseSequence& given, const RestoreOptions& options, const char* name) {
        return write_restored_chunks(*chunks, frames_of(given), options, path(name), kTwoThreads).error().code;
    };
    EXPECT_EQ(code(poses, {.level = 1}, "a.pc2"), ErrorCode::usage);
    EXPECT_EQ(code(poses, {}, "a.mdd"), ErrorCode::usage);
    EXPECT_EQ(code({}, {}, "a.pc2"), ErrorCode::unsuitable);
    PoseSequence other = poses;
    other.frames[1].positions.pop_back();
    EXPECT_EQ(code(other, {}, "a.pc2"), ErrorCode::mismatch);
    RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(write_restored_chunks(*chunks, frames_of(poses), {}, path("a.pc2"), cancelled).error().code,
              ErrorCode::cancelled);
    EXPECT_FALSE(fs::exists(path("a.pc2")));
}

} // namespace
