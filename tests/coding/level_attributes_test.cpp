// Texture coordinates, materials and colours in levels: every corner of every level has those of the surface, seams
// stay seams, and the whole is what was written.
#include "filigree/coding/mesh_code.h"
#include "filigree/coding/mesh_levels.h"
#include "filigree/mesh.h"
#include "threads.h"

#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace level_attributes_test {

using namespace filigree;

namespace {

constexpr Index kAround = 60, kRings = 50;
constexpr float kMiddle = 25;

/// Its lower half of one material, its upper of another; the texture's ends meet along one line.
Mesh tube(bool has_colors = true) {
    Mesh mesh;
    for (Index ring = 0; ring <= kRings; ++ring)
        for (Index i = 0; i < kAround; ++i) {
            const float angle = 2 * std::numbers::pi_v<float> * float(i) / kAround;
            const float radius = 10 + std::sin(0.4f * float(ring) + 3 * angle);
            mesh.positions.emplace_back(radius * std::cos(angle), float(ring), radius * std::sin(angle));
            if (has_colors) mesh.colors.emplace_back(float(ring) / kRings, float(i) / kAround, 0.5f, 1.0f);
        }
    for (Index ring = 0; ring <= kRings; ++ring)
        for (Index i = 0; i <= kAround; ++i) mesh.uvs.values.emplace_back(float(i) / kAround, float(ring) / kRings);
    mesh.materials.names = {"red", "blue"};
    for (Index ring = 0; ring < kRings; ++ring)
        for (Index i = 0; i < kAround; ++i) {
            const auto at = [&](Index up, Index along) { return (ring + up) * kAround + (i + along) % kAround; };
            mesh.add_face(std::array{at(0, 0), at(1, 0), at(1, 1), at(0, 1)});
            for (const auto& [up, along] : {std::pair(0u, 0u), {1u, 0u}, {1u, 1u}, {0u, 1u}})
                mesh.uvs.corners.push_back((ring + up) * (kAround + 1) + i + along);
            mesh.materials.of_face.push_back(float(ring) < kMiddle ? 0 : 1);
        }
    return mesh;
}

PackedMesh frames_of(const Mesh& mesh) {
    return pack_mesh(mesh, {.keep_order = true, .levels = true}, nullptr, kTwoThreads).value();
}

LevelReader reader_of(const PackedMesh& code) {
    const LevelCodeOptions options = level_options(code.options);
    LevelReader reader(options.steps, options.is_refined, std::size_t{1} << 24);
    EXPECT_TRUE(reader.read_coarsest(code.levels.connectivity, code.levels.places, code.levels.attributes));
    return reader;
}

Vec2f uv_at(const Mesh& mesh, std::size_t corner) {
    if (mesh.uvs.per_vertex()) return mesh.uvs.values[mesh.corners[corner]];
    return mesh.uvs.corners[corner] == kNoIndex ? Vec2f(-1, -1) : mesh.uvs.values[mesh.uvs.corners[corner]];
}

void expect_same_attributes(const Mesh& mesh, const Mesh& read) {
    ASSERT_EQ(read.corners, mesh.corners);
    ASSERT_EQ(read.uvs.empty(), mesh.uvs.empty());
    for (std::size_t c = 0; c < mesh.corner_count() && !mesh.uvs.empty(); ++c)
        ASSERT_LT((uv_at(read, c) - uv_at(mesh, c)).norm(), 1.0f / 4095) << c;
    if (!mesh.uvs.empty() && mesh.uvs.per_vertex()) { // those of vertices without faces too
        ASSERT_TRUE(read.uvs.per_vertex());
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
            ASSERT_LT((read.uvs.values[v] - mesh.uvs.values[v]).norm(), 1.0f / 4095);
    }
    EXPECT_EQ(read.materials.of_face, mesh.materials.of_face);
    ASSERT_EQ(read.colors.size(), mesh.colors.size());
    EXPECT_EQ(read.colors_have_alpha, mesh.colors_have_alpha);
    for (std::size_t v = 0; v < mesh.colors.size(); ++v)
        ASSERT_LT((read.colors[v] - mesh.colors[v]).cwiseAbs().maxCoeff(), 0.51f / 255);
}

void expect_round_trip(const Mesh& mesh) {
    const PackedMesh code = frames_of(mesh);
    EXPECT_FALSE(code.levels.attributes.empty());
    expect_same_attributes(mesh, unpack_mesh(code, kTwoThreads).value());
}

} // namespace

TEST(LevelAttributes, TheWholeIsWhatWasWritten) {
    Mesh mesh = tube();
    expect_round_trip(mesh);
    mesh.uvs = {};
    expect_round_trip(mesh);
    mesh.materials = {};
    expect_round_trip(mesh);
    for (const Vec3f& p : mesh.positions) mesh.uvs.values.emplace_back(0.05f * p[0], 0.02f * p[1]);
    mesh.colors_have_alpha = true;
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) mesh.colors[v][3] = float(v % 7) / 7;
    expect_round_trip(mesh);
}

TEST(LevelAttributes, EveryLevelHasThoseOfTheSurface) {
    const PackedMesh code = frames_of(tube());
    LevelReader reader = reader_of(code);
    for (std::size_t k = 0; k <= code.levels.levels.size(); ++k) {
        const Mesh level = mesh_of_levels(reader, code);
        ASSERT_EQ(check_mesh(level), "");
        ASSERT_EQ(level.materials.of_face.size(), level.face_count());
        for (std::size_t f = 0; f < level.face_count(); ++f) {
            float low = 1, high = 0, lowest = kRings, highest = 0;
            for (Index c = level.face_offsets[f]; c < level.face_offsets[f + 1]; ++c) {
                const Vec3f p = level.positions[level.corners[c]];
                const Vec2f uv = uv_at(level, c);
                const float angle = std::atan2(p[2], p[0]) / (2 * std::numbers::pi_v<float>);
                EXPECT_NEAR(uv[1], p[1] / kRings, 2e-3);
                EXPECT_NEAR(std::remainder(uv[0] - angle, 1.0f), 0, 2e-3);
                low = std::min(low, uv[0]);
                high = std::max(high, uv[0]);
                lowest = std::min(lowest, p[1]);
                highest = std::max(highest, p[1]);
            }
            EXPECT_LT(high - low, 0.5f) << "a triangle goes over the seam";
            EXPECT_TRUE(lowest > kMiddle - 0.1f || highest < kMiddle + 0.1f) << "one goes over both materials";
            EXPECT_EQ(level.materials.of_face[f], lowest > kMiddle - 0.1f ? 1u : 0u);
        }
        for (std::size_t v = 0; v < level.vertex_count(); ++v)
            EXPECT_NEAR(level.colors[v][0], level.positions[v][1] / kRings, 5e-3);
        if (k == code.levels.levels.size()) break;
        ASSERT_TRUE(reader.read_level(code.levels.levels[k].splits, code.levels.levels[k].batches));
    }
}

TEST(LevelAttributes, WhatLiesInNoSurfaceKeepsItsOwn) {
    Mesh mesh = tube();
    mesh.add_face(std::array<Index, 4>{0, 5, 0, 70}); // names a vertex twice
    mesh.materials.of_face.push_back(kNoIndex);
    for (const Index value : {3u, kNoIndex, 900u, 40u}) mesh.uvs.corners.push_back(value);
    for (std::size_t c = 8; c < 12; ++c) mesh.uvs.corners[c] = kNoIndex; // a face without a texture
    mesh.positions.emplace_back(1.0f, 2.0f, 3.0f);
    mesh.colors.emplace_back(0.2f, 0.4f, 0.6f, 1.0f);
    expect_round_trip(mesh);
    mesh.uvs = {};
    for (const Vec3f& p : mesh.positions) mesh.uvs.values.emplace_back(0.05f * p[0], 0.02f * p[1]);
    expect_round_trip(mesh);
}

TEST(LevelAttributes, SeamsEverywhereLeaveTheLevelsWithout) {
    Mesh mesh = tube(false);
    mesh.uvs.values.clear();
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) { // each face lies elsewhere in the texture
        mesh.uvs.corners[c] = static_cast<Index>(c);
        mesh.uvs.values.emplace_back(float(c / 4 % 50) / 50 + 0.01f * float(c % 2), float(c / 200) / 60);
    }
    const PackedMesh code = frames_of(mesh);
    EXPECT_TRUE(code.levels.attributes.empty());
    EXPECT_LT(code.levels.vertices, 600u);
    expect_same_attributes(mesh, unpack_mesh(code, kTwoThreads).value());
}

TEST(LevelAttributes, AMeshWithoutAnyIsCodedWithoutThem) {
    EXPECT_TRUE(frames_of(make_wavy_sphere({.resolution = 24})).levels.attributes.empty());
}

TEST(LevelAttributes, DamageIsNamedOrHarmless) {
    const PackedMesh code = frames_of(tube());
    std::mt19937 random(5);
    const auto try_it = [&](const PackedMesh& damaged) {
        const Result<Mesh> read = unpack_mesh(damaged, kTwoThreads);
        if (read)
            EXPECT_EQ(check_mesh(*read), "");
        else
            EXPECT_EQ(read.error().code, ErrorCode::bad_file);
        const LevelCodeOptions options = level_options(damaged.options);
        LevelReader reader(options.steps, options.is_refined, 20'000);
        if (!reader.read_coarsest(damaged.levels.connectivity, damaged.levels.places, damaged.levels.attributes))
            return;
        EXPECT_EQ(check_mesh(mesh_of_levels(reader, damaged)), "");
        for (const PackedLevel& level : damaged.levels.levels) {
            if (!reader.read_level(level.splits, level.batches)) return;
            EXPECT_EQ(check_mesh(mesh_of_levels(reader, damaged)), "");
        }
    };
    const auto change = [&](std::string& bytes) { bytes[random() % bytes.size()] ^= char(1 + random() % 255); };
    for (int k = 0; k < 300; ++k) {
        PackedMesh damaged = code;
        change(k % 3 == 0   ? damaged.levels.attributes
               : k % 3 == 1 ? damaged.levels.levels[std::size_t(k) % code.levels.levels.size()].splits
                            : damaged.attributes);
        try_it(damaged);
    }
    for (const std::size_t size : {std::size_t{1}, code.levels.attributes.size() / 2}) {
        PackedMesh cut = code;
        cut.levels.attributes.resize(size);
        EXPECT_FALSE(unpack_mesh(cut, kTwoThreads).ok());
    }
    PackedMesh other = code; // of another mesh
    other.levels.attributes = frames_of(tube(false)).levels.attributes;
    try_it(other);
}

} // namespace level_attributes_test
