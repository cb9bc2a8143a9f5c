#include "filigree/io/pose_match.h"

#include "filigree/file.h"
#include "filigree/io/file.h"
#include "filigree/io/point_cache.h"
#include "filigree/mesh.h"
#include "io/gltf_text.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <filesystem>

using namespace filigree;

namespace pose_match_test {

namespace {

/// Every corner a vertex of its own, as flat shading makes them.
Mesh split(const Mesh& mesh) {
    Mesh flat;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        std::vector<Index> corners;
        for (const Index v : mesh.face(f)) {
            corners.push_back(static_cast<Index>(flat.positions.size()));
            flat.positions.push_back(mesh.positions[v]);
        }
        flat.add_face(corners);
    }
    return flat;
}

Mesh cage() { return make_wavy_sphere({.resolution = 6}); }

std::vector<Vec3f> driver_of(const VertexMatch& match, const std::vector<Vec3f>& file) {
    std::vector<Vec3f> out(match.source.size());
    const Status done = match.apply(file, out, "cage.glb");
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
    return out;
}

std::vector<Vec3f> turned(std::vector<Vec3f> points, int axis) { // by a quarter about an axis
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (Vec3f& p : points) {
        const float y = p[b];
        p[b] = -p[c];
        p[c] = y;
    }
    return points;
}

class CageFiles : public testing::Test {
protected:
    CageFiles() {
        folder_ = std::filesystem::path(testing::TempDir()) /
                  ("filigree_cage_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
        std::filesystem::create_directories(folder_);
    }
    ~CageFiles() override { std::filesystem::remove_all(folder_); }

    std::string put(const std::string& name, const std::string& bytes) const {
        EXPECT_TRUE(write_file(folder_ / name, bytes).ok());
        return (folder_ / name).string();
    }
    Result<FrameSource<Pose>> open(const std::string& path, std::vector<std::string>& warnings,
                                   std::optional<UpAxis> up = {}) const {
        return open_poses(path, rest_.size(), Vec3d::Zero(),
                          {.frames_per_second = 10, .animation = {}, .up = up, .rest = rest_, .warnings = &warnings},
                          kOneThread);
    }

    std::filesystem::path folder_;
    std::vector<Vec3f> rest_ = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {1, 2, 1}};
};

} // namespace

TEST(PoseMatch, SplitVerticesAreMatchedByTheirPlacesAtRest) {
    const Mesh driver = cage(), flat = split(driver);
    const auto match = match_by_place(driver.positions, flat.positions);
    ASSERT_TRUE(match);
    EXPECT_FALSE(match->is_plain());
    std::vector<Vec3f> moved = flat.positions;
    for (Vec3f& p : moved) p = Vec3f(p.x() + p.y(), p.y(), 2 * p.z());
    const std::vector<Vec3f> back = driver_of(*match, moved);
    for (std::size_t v = 0; v < back.size(); ++v) {
        const Vec3f& p = driver.positions[v];
        EXPECT_EQ(back[v], Vec3f(p.x() + p.y(), p.y(), 2 * p.z()));
    }
    moved.back().x() += 0.1f; // one corner leaves its twins
    std::vector<Vec3f> out(driver.vertex_count());
    const Status parted = match->apply(moved, out, "cage.glb");
    ASSERT_FALSE(parted.ok());
    EXPECT_EQ(parted.error().code, ErrorCode::mismatch);
    EXPECT_NE(parted.error().message.find("Shade Smooth"), std::string::npos);
}

TEST(PoseMatch, AnotherOrderIsPutRightAndAnotherMeshIsNone) {
    const Mesh driver = cage();
    std::vector<Vec3f> reversed(driver.positions.rbegin(), driver.positions.rend());
    const auto match = match_by_place(driver.positions, reversed);
    ASSERT_TRUE(match);
    EXPECT_EQ(driver_of(*match, reversed), driver.positions);
    EXPECT_TRUE(match_by_place(driver.positions, driver.positions)->is_plain());
    reversed[3].x() += 0.5f;
    EXPECT_FALSE(match_by_place(driver.positions, reversed));
    reversed.pop_back();
    EXPECT_FALSE(match_by_place(driver.positions, reversed));
}

TEST(PoseMatch, DriverVerticesThatShareAPlaceStayApart) {
    const std::vector<Vec3f> rest = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {3, 0, 0}}; // two layers touch
    EXPECT_TRUE(match_by_place(rest, rest)->is_plain());
    const auto match = match_by_place(rest, std::vector<Vec3f>{{3, 0, 0}, {1, 0, 0}, {0, 0, 0}, {1, 0, 0}});
    ASSERT_TRUE(match);
    EXPECT_EQ(match->source, (std::vector<Index>{2, 1, 3, 0}));
}

TEST(PoseMatch, AMovedMeshIsWeldedWhereItsFacesAreTheDrivers) {
    Mesh driver = cage(), flat = split(driver);
    for (Vec3f& p : flat.positions) p = Vec3f(p.x(), p.y() + p.x() * p.x(), p.z());
    // corners come by the driver's vertices, as exporters write them
    std::vector<Index> order;
    for (Index v = 0; v < driver.vertex_count(); ++v)
        for (std::size_t c = 0; c < driver.corner_count(); ++c)
            if (driver.corners[c] == v) order.push_back(static_cast<Index>(c));
    Mesh sorted;
    std::vector<Index> place(order.size());
    for (Index i = 0; i < order.size(); ++i) {
        place[order[i]] = i;
        sorted.positions.push_back(flat.positions[order[i]]);
    }
    for (std::size_t f = 0; f < flat.face_count(); ++f) {
        std::vector<Index> corners;
        for (const Index c : flat.face(f)) corners.push_back(place[c]);
        sorted.add_face(corners);
    }
    const auto match = match_by_faces(driver, sorted);
    ASSERT_TRUE(match);
    const std::vector<Vec3f> back = driver_of(*match, sorted.positions);
    for (std::size_t v = 0; v < back.size(); ++v) {
        const Vec3f& p = driver.positions[v];
        EXPECT_EQ(back[v], Vec3f(p.x(), p.y() + p.x() * p.x(), p.z()));
    }
    std::reverse(driver.positions.begin(), driver.positions.end()); // as many, joined otherwise
    for (Index& corner : driver.corners) corner = static_cast<Index>(driver.vertex_count() - 1 - corner);
    EXPECT_FALSE(match_by_faces(driver, sorted));
}

TEST_F(CageFiles, AnimatedGlbWithSplitVerticesMovesTheDriver) {
    filigree_test::GltfText file;
    // vertices of the driver: 1, 0, 2 and 2, 1, 3
    file.add({1, 0, 0, 0, 0, 0, 0, 2, 0, 0, 2, 0, 1, 0, 0, 1, 2, 1}, "VEC3");
    file.add({0.0f, 1.0f}, "SCALAR");
    file.add({0, 0, 0, 0, 0, 3}, "VEC3");
    file.add({0.0f, 1.0f}, "SCALAR");
    const auto scene = [&](const std::string& more) {
        return put("cage.gltf",
                   file.text(R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0})" + more +
                             R"(}]}],"animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}],
                             "samplers":[{"input":1,"output":2}]}])"));
    };
    std::vector<std::string> warnings;
    const auto poses = open(scene(""), warnings);
    ASSERT_TRUE(poses.ok()) << poses.error().message;
    EXPECT_EQ(poses->frame(0)->positions, rest_);
    EXPECT_EQ(poses->frame(10)->positions[3], Vec3f(1, 2, 4));
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("6 vertices were split"), std::string::npos) << warnings[0];
    rest_[0].x() = -4; // another cage
    const auto other = open(scene(""), warnings);
    ASSERT_FALSE(other.ok());
    EXPECT_NE(other.error().message.find("Shade Smooth"), std::string::npos) << other.error().message;
}

TEST_F(CageFiles, NumberedMeshesWithSplitVerticesMoveTheDriver) {
    for (int frame = 1; frame <= 2; ++frame) {
        const std::string z = std::to_string(frame - 1);
        put("cage_000" + std::to_string(frame) + ".obj", "v 0 2 " + z + "\nv 1 0 " + z + "\nv 0 0 " + z + "\nv 1 2 " +
                                                             std::to_string(frame) + "\nv 1 0 " + z + "\nv 0 2 " + z +
                                                             "\nf 1 2 3\nf 4 5 6\n");
    }
    std::vector<std::string> warnings;
    const auto poses = open((folder_ / "cage_####.obj").string(), warnings);
    ASSERT_TRUE(poses.ok()) << poses.error().message;
    EXPECT_EQ(poses->frame(0)->positions, rest_);
    EXPECT_EQ(poses->frame(1)->positions[2], Vec3f(0, 2, 1));
    EXPECT_EQ(warnings.size(), 1u);
}

TEST_F(CageFiles, ACacheThatLiesOnItsFaceIsToldOfAndTurnedBack) {
    Mesh rest;
    rest.positions = rest_;
    const auto save = [&](const std::vector<Vec3f>& first, const std::string& name) {
        const MeshAnimation animation{&rest, 2, 24, [&](std::size_t frame, std::span<Vec3f> out) -> Status {
                                          for (std::size_t v = 0; v < out.size(); ++v)
                                              out[v] = first[v] * (1 + 0.5f * float(frame));
                                          return Success{};
                                      }};
        EXPECT_TRUE(write_animation(animation, folder_ / name, kOneThread).ok());
        return (folder_ / name).string();
    };
    for (const std::string name : {"z.mdd", "z.pc2"}) {
        std::vector<std::string> warnings;
        const std::string z_up = save(turned(rest_, 0), name);
        ASSERT_TRUE(open(z_up, warnings).ok());
        ASSERT_EQ(warnings.size(), 1u);
        EXPECT_NE(warnings[0].find("turned by 90 degrees about x"), std::string::npos) << warnings[0];
        EXPECT_NE(warnings[0].find("pose-up z"), std::string::npos) << warnings[0];
        warnings.clear();
        const auto back = open(z_up, warnings, UpAxis::z);
        EXPECT_TRUE(warnings.empty());
        EXPECT_EQ(back->frame(0)->positions, rest_);
    }
    std::vector<std::string> warnings;
    ASSERT_TRUE(open(save(turned(rest_, 1), "y.pc2"), warnings).ok());
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("about y"), std::string::npos);
    ASSERT_TRUE(open(save(turned(turned(turned(rest_, 0), 0), 0), "down.pc2"), warnings).ok());
    EXPECT_NE(warnings.back().find("pose-up y"), std::string::npos);
    warnings.clear();
    ASSERT_TRUE(open(save(rest_, "rest.pc2"), warnings).ok());
    EXPECT_TRUE(warnings.empty());
}

} // namespace pose_match_test
