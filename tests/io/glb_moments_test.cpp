// Key frames of a mesh whose faces change, as plain glTF.
#include "filigree/io/file.h"
#include "filigree/io/point_cache.h"
#include "filigree/mesh.h"
#include "threads.h"

#include <cstring>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filigree {
namespace {

using Json = nlohmann::json;

Result<MeshMoment> moment(std::size_t frame) {
    return MeshMoment{make_wavy_sphere({.resolution = unsigned(2 + frame)}), {}};
}

struct MomentsGlb {
    Json json;
    std::string data;

    explicit MomentsGlb(const std::string& bytes) {
        std::uint32_t length = 0;
        std::memcpy(&length, bytes.data() + 12, 4);
        json = Json::parse(bytes.substr(20, length));
        data = bytes.substr(28 + length);
    }
    std::vector<float> floats(std::size_t accessor) const {
        const Json& a = json["accessors"][accessor];
        const Json& view = json["bufferViews"][a["bufferView"].get<std::size_t>()];
        std::vector<float> values(a["count"].get<std::size_t>() * (a["type"] == "VEC3" ? 3 : 1));
        const std::size_t begin = view.value("byteOffset", std::size_t{0}) + a.value("byteOffset", std::size_t{0});
        std::memcpy(values.data(), data.data() + begin, 4 * values.size());
        return values;
    }
};

/// The scale of key k's node at a time, by steps.
float scale_at(const MomentsGlb& glb, std::size_t k, float time) {
    const Json& animation = glb.json["animations"][0];
    const Json& sampler = animation["samplers"][animation["channels"][k]["sampler"].get<std::size_t>()];
    const std::vector<float> times = glb.floats(sampler["input"]), values = glb.floats(sampler["output"]);
    EXPECT_EQ(sampler["interpolation"], "STEP");
    float scale = values[0];
    for (std::size_t i = 0; i < times.size(); ++i)
        if (times[i] <= time) scale = values[3 * i];
    return scale;
}

TEST(GlbMoments, OneKeyIsShownAtATime) {
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "filigree_moments.glb";
    ASSERT_TRUE(write_glb_moments({8, 24, moment}, 8, path, kOneThread).ok()); // frames 0, 3, 6 and the last
    const MomentsGlb glb(read_file(path).value());
    ASSERT_EQ(glb.json["meshes"].size(), 4u);
    ASSERT_EQ(glb.json["scenes"][0]["nodes"].size(), 4u);
    const Json& report = glb.json["asset"]["extras"]["filigree"];
    EXPECT_EQ(report["export"], "key frames");
    EXPECT_EQ(report["keys"], 4);
    EXPECT_DOUBLE_EQ(report["seconds"].get<double>(), 7.0 / 24);
    for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t frame = std::min<std::size_t>(3 * k, 7);
        const std::size_t position = glb.json["meshes"][k]["primitives"][0]["attributes"]["POSITION"];
        EXPECT_EQ(glb.json["accessors"][position]["count"], moment(frame)->mesh.vertex_count());
        const std::size_t node = glb.json["scenes"][0]["nodes"][k];
        EXPECT_EQ(glb.json["nodes"][node]["scale"][0], k == 0 ? 1 : 0);
        EXPECT_EQ(glb.json["animations"][0]["channels"][k]["target"]["node"], node);
    }
    for (int t = 0; t < 40; ++t) {
        const float time = float(t) / 96;
        float shown = 0;
        for (std::size_t k = 0; k < 4; ++k) shown += scale_at(glb, k, time);
        EXPECT_EQ(shown, 1) << time;
        const std::size_t key = time >= 7.0f / 24 ? 3 : time >= 6.0f / 24 ? 2 : time >= 3.0f / 24 ? 1 : 0;
        EXPECT_EQ(scale_at(glb, key, time), 1) << time;
    }
    std::filesystem::remove(path);
}

TEST(GlbMoments, FacesWithoutAMaterialMayComeLater) {
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "filigree_moments_skin.glb";
    const auto skinned = [](std::size_t frame) -> Result<MeshMoment> {
        MeshMoment now = moment(frame).value();
        now.mesh.materials = {{"skin"}, std::vector<Index>(now.mesh.face_count(), 0)};
        now.mesh.embedded_materials.resize(1);
        now.mesh.embedded_materials[0].name = "skin";
        if (frame == 2) now.mesh.materials.of_face[3] = kNoIndex;
        return now;
    };
    ASSERT_TRUE(write_glb_moments({3, 24, skinned}, 24, path, kOneThread).ok());
    const MomentsGlb glb(read_file(path).value());
    ASSERT_EQ(glb.json["materials"].size(), 2u);
    EXPECT_EQ(glb.json["materials"][0]["name"], "skin");
    EXPECT_EQ(glb.json["materials"][1]["name"], "none");
    EXPECT_EQ(glb.json["meshes"][0]["primitives"].size(), 1u);
    ASSERT_EQ(glb.json["meshes"][2]["primitives"].size(), 2u);
    EXPECT_EQ(glb.json["meshes"][2]["primitives"][0]["material"], 0);
    EXPECT_EQ(glb.json["meshes"][2]["primitives"][1]["material"], 1);
    std::filesystem::remove(path);
}

TEST(GlbMoments, OneFrameStandsStillAndNoneIsRefused) {
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "filigree_moment.glb";
    ASSERT_TRUE(write_glb_moments({1, 24, moment}, 8, path, kOneThread).ok());
    EXPECT_FALSE(MomentsGlb(read_file(path).value()).json.contains("animations"));
    std::filesystem::remove(path);
    EXPECT_EQ(write_glb_moments({0, 24, moment}, 8, path, kOneThread).error().code, ErrorCode::unsuitable);
    EXPECT_EQ(write_glb_moments({4, 24, moment}, 0, path, kOneThread).error().code, ErrorCode::usage);
    const RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(write_glb_moments({4, 24, moment}, 8, path, cancelled).error().code, ErrorCode::cancelled);
    EXPECT_FALSE(std::filesystem::exists(path));
}

} // namespace
} // namespace filigree
