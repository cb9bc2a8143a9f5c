// Poses in model files: they come back to the bit, other programs' readers pass over them, and damage is refused.
#include "filigree/io/model_file.h"

#include "filigree/mesh.h"
#include "filigree/strip.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>

#include <unistd.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

namespace model_poses_test {

using namespace filigree;

namespace {

Model small_model() { return strip(make_wavy_plane({.resolution = 6}), {.base = 9}, kOneThread).value().model; }

PoseSequence moving(const Model& model, bool gradients, std::size_t frames = 3) {
    PoseSequence poses{24, {}};
    for (std::size_t k = 0; k < frames; ++k) {
        Pose& pose = poses.frames.emplace_back();
        for (const Vec3f& p : driver_positions(model)) pose.positions.push_back(p + Vec3f(0, 0.5f * float(k), 0));
        if (!gradients) continue;
        for (std::size_t v = 0; v < pose.positions.size(); ++v)
            pose.gradients.push_back(
                (Mat3f() << 1, float(k), 2, 3, 4, 5, 6, 7, 8 + float(v)).finished()); // not symmetric
    }
    return poses;
}

std::string error_of(const std::string& bytes) {
    const Result<PoseSequence> poses = read_poses(bytes, "a.fil", kOneThread);
    EXPECT_FALSE(poses.ok());
    if (poses.ok()) return "";
    EXPECT_EQ(poses.error().code, ErrorCode::bad_file);
    EXPECT_TRUE(poses.error().message.starts_with("a.fil ") && poses.error().message.ends_with("."));
    return poses.error().message;
}

struct TestSection {
    char name[8];
    std::uint32_t index, item_size;
    std::uint64_t offset, count, hash;
};

/// Changes the entry number `frame` of sections called `name`, and makes the table's checksum right again.
template <class Change>
std::string changed(std::string bytes, std::string_view name, std::uint32_t frame, const Change& change) {
    std::uint32_t count;
    std::memcpy(&count, bytes.data() + 12, 4);
    for (std::uint32_t s = 0; s < count; ++s) {
        TestSection section;
        char* const at = bytes.data() + 32 + s * sizeof section;
        std::memcpy(&section, at, sizeof section);
        if (name != std::string_view(section.name, strnlen(section.name, 8)) || section.index != frame) continue;
        change(section, bytes.data() + section.offset);
        section.hash = XXH3_64bits(bytes.data() + section.offset, section.count * section.item_size);
        std::memcpy(at, &section, sizeof section);
        const std::uint64_t hash = XXH3_64bits(bytes.data() + 32, count * sizeof section);
        std::memcpy(bytes.data() + 24, &hash, 8);
        return bytes;
    }
    ADD_FAILURE() << "no section " << name;
    return bytes;
}

} // namespace

TEST(ModelPoses, ComeBackToTheBit) {
    const Model model = small_model();
    for (const bool gradients : {true, false}) {
        const PoseSequence poses = moving(model, gradients);
        const std::string bytes = write_model(model, poses);
        const Result<PoseSequence> back = read_poses(bytes, "a.fil", kOneThread);
        ASSERT_TRUE(back.ok()) << back.error().message;
        EXPECT_EQ(back->frames_per_second, 24);
        ASSERT_EQ(back->frames.size(), poses.frames.size());
        for (std::size_t k = 0; k < poses.frames.size(); ++k) {
            EXPECT_EQ(back->frames[k].positions, poses.frames[k].positions);
            EXPECT_EQ(back->frames[k].gradients, poses.frames[k].gradients);
        }
        const Result<Model> same = read_model(bytes, "a.fil", kOneThread); // as readers that know no poses do
        ASSERT_TRUE(same.ok()) << same.error().message;
        EXPECT_EQ(write_model(*same), write_model(model));
    }
}

TEST(ModelPoses, GradientsLieRowByRow) {
    const Model model = small_model();
    const std::string bytes = write_model(model, moving(model, true));
    changed(bytes, "pose.grd", 1, [](const TestSection& section, const char* items) {
        EXPECT_EQ(section.item_size, 36u);
        float first[9];
        std::memcpy(first, items, sizeof first);
        const float expected[9] = {1, 1, 2, 3, 4, 5, 6, 7, 8};
        EXPECT_TRUE(std::equal(first, first + 9, expected));
    });
}

TEST(ModelPoses, AModelAtRestHasNone) {
    const Model model = small_model();
    const Result<PoseSequence> none = read_poses(write_model(model), "a.fil", kOneThread);
    ASSERT_TRUE(none.ok());
    EXPECT_TRUE(none->empty());
    EXPECT_EQ(write_model(model, PoseSequence()), write_model(model));
}

TEST(ModelPoses, EveryCutAndEveryFlippedBitIsSeenOrHarmless) {
    const Model model = small_model();
    const PoseSequence poses = moving(model, true);
    const std::string bytes = write_model(model, poses);
    for (std::size_t size = 0; size < bytes.size(); ++size) error_of(bytes.substr(0, size));
    for (std::size_t at = 0; at < bytes.size(); ++at) {
        std::string damaged = bytes;
        damaged[at] = static_cast<char>(damaged[at] ^ (1 << at % 8));
        const Result<PoseSequence> back = read_poses(damaged, "a.fil", kOneThread);
        if (!back.ok()) continue; // else the bit is padding, or belongs to the mesh
        ASSERT_EQ(write_model(model, *back), bytes) << at;
    }
}

TEST(ModelPoses, WhatDoesNotFitTogetherIsRefused) {
    const Model model = small_model();
    const std::string bytes = write_model(model, moving(model, true));
    const auto renamed = [](TestSection& section, char*) { section.name[0] = 'x'; };
    EXPECT_NE(error_of(changed(bytes, "pose.pos", 1, renamed)).find("lacks one of its poses"), std::string::npos);
    EXPECT_NE(error_of(changed(bytes, "pose.pos", 2, renamed)).find("some of its poses"), std::string::npos);
    EXPECT_NE(error_of(changed(bytes, "pose.grd", 2, renamed)).find("some of its poses"), std::string::npos);
    EXPECT_NE(error_of(changed(bytes, "pose.fps", 0, renamed)).find("pose.fps"), std::string::npos);
    for (const char* const name : {"pose.pos", "pose.grd"})
        for (const std::uint32_t index : {0u, 3u, 0x7fffffffu, 0xffffffffu})
            error_of(changed(bytes, name, 2, [&](TestSection& section, char*) { section.index = index; }));
    const std::string fewer =
        error_of(changed(bytes, "pose.pos", 1, [](TestSection& section, char*) { section.count -= 1; }));
    EXPECT_NE(fewer.find("pose 2 has 8 vertices and the driver 9"), std::string::npos) << fewer;
    error_of(changed(bytes, "pose.grd", 1, [](TestSection& section, char*) { section.count -= 1; }));
    error_of(changed(bytes, "pose.grd", 1, [](TestSection& section, char*) { section.item_size = 12; }));
    for (const char* const name : {"pose.pos", "pose.grd"})
        for (const float x : {NAN, INFINITY})
            error_of(changed(bytes, name, 2, [&](TestSection&, char* items) { std::memcpy(items + 8, &x, 4); }));
    for (const double rate : {0.0, -1.0, double{NAN}, double{INFINITY}})
        error_of(changed(bytes, "pose.fps", 0, [&](TestSection&, char* items) { std::memcpy(items, &rate, 8); }));
    error_of("ply\n");
}

TEST(ModelPoses, PosesOfAnotherModelAreNotWritten) {
    const Model model = small_model();
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("filigree-poses-" + std::to_string(::getpid()) + ".fil");
    const auto refused = [&](const PoseSequence& poses) {
        const Status status = write_model(model, poses, path, kOneThread);
        EXPECT_FALSE(status.ok());
        EXPECT_FALSE(std::filesystem::exists(path));
        return status.ok() ? ErrorCode::usage : status.error().code;
    };
    PoseSequence poses = moving(model, true);
    poses.frames[1].positions.pop_back();
    EXPECT_EQ(refused(poses), ErrorCode::mismatch);
    poses = moving(model, true);
    poses.frames[2].gradients.clear();
    EXPECT_EQ(refused(poses), ErrorCode::mismatch);
    poses = moving(model, false);
    poses.frames[2].positions[3].x() = NAN;
    EXPECT_EQ(refused(poses), ErrorCode::mismatch);
    poses = moving(model, false);
    poses.frames_per_second = 0;
    EXPECT_EQ(refused(poses), ErrorCode::mismatch);
    ASSERT_TRUE(write_model(model, moving(model, true), path, kOneThread).ok());
    EXPECT_EQ(read_poses(path, kOneThread)->frames.size(), 3u);
    std::filesystem::remove(path);
    EXPECT_EQ(read_poses(path, kOneThread).error().code, ErrorCode::not_found);
}

} // namespace model_poses_test
