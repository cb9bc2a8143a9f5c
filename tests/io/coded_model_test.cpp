// Models packed in few bits and read again.
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace filigree {
namespace {

Model bound_elsewhere() {
    const Mesh ball = make_wavy_sphere({.resolution = 8, .amplitude = 0});
    return strip_to_driver(make_wavy_sphere({.resolution = 48}), ball, kTwoThreads).value().model;
}

std::filesystem::path packed_path() {
    return std::filesystem::temp_directory_path() /
           ("filigree_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".fil");
}

Pose squeezed(const Model& model) {
    Pose pose = rest_pose(model);
    for (Vec3f& p : pose.positions) p.y() *= 0.5f + 0.2f * p.x();
    return pose;
}

TEST(PackedModel, ADriverMadeElsewhereComesBack) {
    const Model model = bound_elsewhere();
    const std::filesystem::path path = packed_path();
    for (const bool keep_order : {false, true}) {
        const PoseSequence poses{24, {squeezed(model), rest_pose(model)}};
        const Result<PackReport> report =
            pack_model(model, poses, {.bits = 14, .keep_order = keep_order}, path, kTwoThreads);
        ASSERT_TRUE(report.ok()) << report.error().message;
        EXPECT_LT(std::filesystem::file_size(path), sizeof(Vec3f) * model.mesh.vertex_count() / 2);
        const ModelOutline outline = read_model_outline(FileReader::open(path).value(), "packed", kTwoThreads).value();
        EXPECT_EQ(outline.levels.back().vertices, model.vertex_count());
        const Model back = read_model(path, kTwoThreads).value();
        EXPECT_EQ(back.mesh.vertex_count(), model.mesh.vertex_count());
        EXPECT_EQ(back.vertex_count(), model.vertex_count());
        EXPECT_EQ(back.mesh.face_count(), model.mesh.face_count());
        EXPECT_EQ(driver_positions(back), driver_positions(model)) << "to the bit";
        EXPECT_EQ(back.driver().vertices, model.driver().vertices);
        EXPECT_EQ(read_poses(path, kTwoThreads).value().frames.size(), 2u);
        if (!keep_order) continue;
        const Pose pose = squeezed(model);
        const auto restored = [&](const Model& of) {
            return Restorer::create(of, {}, kTwoThreads).value().mesh(pose, kTwoThreads).value().positions;
        };
        const std::vector<Vec3f> expected = restored(model), found = restored(back);
        double largest = 0;
        for (std::size_t v = 0; v < expected.size(); ++v)
            largest = std::max(largest, double((expected[v] - found[v]).norm()));
        EXPECT_LT(largest, 2 * report->largest + 1e-4);
    }
    std::filesystem::remove(path);
}

TEST(PackedModel, AStreamOfADriverMadeElsewhereIsRefused) {
    const std::filesystem::path path = packed_path();
    const Result<PackReport> report = pack_model(bound_elsewhere(), {}, {.levels = true}, path, kTwoThreads);
    ASSERT_FALSE(report.ok());
    EXPECT_EQ(report.error().code, ErrorCode::unsuitable);
    EXPECT_FALSE(std::filesystem::exists(path));
}

} // namespace
} // namespace filigree
