// What is seen of textured meshes, and of what melts of them.
#include "filigree/present/textured_look.h"

#include "filigree/core/srgb.h"
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/render.h"
#include "filigree/scene/melting_surface.h"
#include "filigree/scene/scene_run.h"
#include "threads.h"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <unistd.h>

namespace filigree {
namespace {

const Vec3f kGrey(0.5f, 0.5f, 0.5f);

/// Left half red, right half black and white by columns of texels.
std::shared_ptr<const std::string> picture_bytes() {
    Picture picture(64, 64);
    for (unsigned y = 0; y < 64; ++y)
        for (unsigned x = 0; x < 64; ++x)
            for (unsigned c = 0; c < 4; ++c)
                picture.pixel(x, y)[c] = std::uint8_t(c == 3 ? 255 : x < 32 ? (c == 0 ? 255 : 0) : x % 2 ? 255 : 0);
    return std::make_shared<const std::string>(encode_png(picture));
}

/// A square of one quad with the picture on it, and a triangle without a material.
Mesh textured_square() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5f, 2, 0}};
    mesh.add_face(std::array<Index, 4>{0, 1, 2, 3});
    mesh.add_face(std::array<Index, 3>{3, 2, 4});
    mesh.uvs = {{{0.1f, 0.1f}, {0.9f, 0.1f}, {0.9f, 0.9f}, {0.1f, 0.9f}}, {0, 1, 2, 3, kNoIndex, kNoIndex, kNoIndex}};
    mesh.materials = {{"skin"}, {0, kNoIndex}};
    MeshMaterial& skin = mesh.embedded_materials.emplace_back();
    skin.name = "skin";
    skin.color = Vec3f::Ones();
    skin.picture_bytes = picture_bytes();
    return mesh;
}

TEST(TexturedLook, PlacesHaveWhatIsSeenAroundThem) {
    std::vector<std::string> warnings;
    const Mesh mesh = textured_square();
    const BodyLook look = textured_look(mesh, "", 0.05, kGrey, warnings, kOneThread).value();
    EXPECT_TRUE(warnings.empty());
    ASSERT_EQ(look.materials.size(), 1u);
    ASSERT_EQ(look.vertex_colors.size(), mesh.vertex_count());
    EXPECT_EQ(look.vertex_colors[0], Vec4f(1, 0, 0, 1));
    EXPECT_EQ(look.vertex_colors[4], Vec4f(0.5f, 0.5f, 0.5f, 1)); // of no face with a material
    ASSERT_EQ(look.places.size(), look.place_colors.size());
    EXPECT_GT(look.places.size(), 400u); // a square of 20 x 20
    // Black and white columns, narrower than the places are apart, are half as bright as white.
    const float half = float(srgb_from_linear(0.5));
    const auto is_near = [](const Vec4f& a, const Vec4f& b) { return (a - b).norm() < 0.05f; };
    for (std::size_t i = 0; i < look.places.size(); ++i) {
        const Vec3f& at = look.places[i];
        const Vec4f& seen = look.place_colors[i];
        EXPECT_TRUE(at.y() < 1 || seen == Vec4f(0.5f, 0.5f, 0.5f, 1));
        EXPECT_TRUE(at.y() > 1 || at.x() < 0.1f || at.x() > 0.4f || is_near(seen, {1, 0, 0, 1})) << at.transpose();
        EXPECT_TRUE(at.y() > 1 || at.x() < 0.6f || at.x() > 0.9f || is_near(seen, {half, half, half, 1}))
            << at.transpose() << ": " << seen.transpose();
    }
}

TEST(TexturedLook, WithoutMaterialsOrWithColoursThereIsNone) {
    std::vector<std::string> warnings;
    Mesh mesh = textured_square();
    mesh.colors.assign(mesh.vertex_count(), Vec4f::Ones());
    EXPECT_TRUE(textured_look(mesh, "", 0.05, kGrey, warnings, kOneThread)->empty());
    EXPECT_TRUE(textured_look(make_wavy_cube({.resolution = 2}), "", 0.05, kGrey, warnings, kOneThread)->empty());
    mesh = textured_square();
    mesh.embedded_materials[0].picture_bytes = std::make_shared<const std::string>("no picture");
    EXPECT_FALSE(textured_look(mesh, "", 0.05, kGrey, warnings, kOneThread)->empty());
    EXPECT_EQ(warnings.size(), 1u);
    const RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(textured_look(mesh, "", 0.05, kGrey, warnings, cancelled).error().code, ErrorCode::cancelled);
}

/// A cube that is red below and blue above stands on a hot plate: its melt is red, its top keeps its texture.
TEST(TexturedLook, MeltHasTheColoursOfWhatMelted) {
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("filigree_textured_look_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    Mesh cube = make_wavy_cube({.resolution = 12, .amplitude = 0});
    Picture picture(4, 16);
    for (unsigned y = 0; y < 16; ++y)
        for (unsigned x = 0; x < 4; ++x) {
            const bool is_above = y < 8;
            picture.pixel(x, y)[0] = is_above ? 0 : 255;
            picture.pixel(x, y)[2] = is_above ? 255 : 0;
            picture.pixel(x, y)[3] = 255;
        }
    const Box box = bounds(cube.positions);
    cube.uvs = {}, cube.colors.clear(), cube.normals = {};
    for (const Vec3f& at : cube.positions)
        cube.uvs.values.emplace_back(0.5f, float((double(at.y()) - box.min.y()) / box.size().y()) * 0.9f + 0.05f);
    cube.materials = {{"skin"}, std::vector<Index>(cube.face_count(), 0)};
    MeshMaterial& skin = cube.embedded_materials.emplace_back();
    skin.name = "skin";
    skin.color = Vec3f::Ones();
    skin.picture_bytes = std::make_shared<const std::string>(encode_png(picture));
    ASSERT_TRUE(write_mesh(cube, folder / "cube.glb", {}, kOneThread).ok());
    std::ofstream(folder / "scene.toml") << R"([simulation]
frames = 12
frames_per_second = 30
[world]
air_temperature = 280
heat_pace = 3000
[[body]]
mesh = "cube.glb"
scale = 0.2
material = "wax"
particles = 1000
centre = [0, 0.101, 0]
[[obstacle]]
shape = "ground"
temperature = 420
heat_transfer = 400
)";
    const SceneFile scene = read_scene((folder / "scene.toml").string()).value();
    const ReadyScene ready = set_up(scene, kOneThread).value();
    SceneRun run = SceneRun::create(scene, ready, false, kOneThread).value();
    ASSERT_TRUE(run.advance_to(scene.frames, kOneThread).ok());
    std::vector<std::string> warnings;
    const std::vector<BodyLook> looks = looks_of(ready, warnings, kOneThread).value();
    ASSERT_EQ(looks.size(), 1u);
    MeltingSurface melting = MeltingSurface::create(ready, looks, kOneThread).value();
    ASSERT_EQ(melting.materials().size(), 1u);
    const CompositeSurface start = melting.frame(run.recording(), 0, kOneThread).value();
    EXPECT_EQ(start.mesh.uvs.values.size(), cube.uvs.values.size());
    EXPECT_EQ(start.mesh.materials.of_face, std::vector<Index>(start.mesh.face_count(), 0));
    for (std::size_t frame = 1; frame < scene.frames; ++frame)
        ASSERT_TRUE(melting.frame(run.recording(), frame, kOneThread).ok());
    const CompositeSurface end = melting.frame(run.recording(), scene.frames, kOneThread).value();
    const Mesh& mesh = end.mesh;
    EXPECT_EQ(check_mesh(mesh), "");
    EXPECT_TRUE(analyse_topology(mesh, kOneThread).is_closed());
    std::size_t kept = 0, melt = 0, red = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        if (mesh.materials.of_face[f] == 0) {
            ++kept;
            continue;
        }
        for (const Index v : mesh.face(f)) {
            if (end.origin[v] != kNoIndex || mesh.positions[v].y() > 0.03f) continue; // the middle has sunk to 0.05
            ++melt;
            red += mesh.colors[v][0] > 0.9f && mesh.colors[v][2] < 0.1f;
        }
    }
    EXPECT_GT(kept, 200u);
    EXPECT_GT(melt, 200u);
    EXPECT_GT(double(red), 0.98 * double(melt));
    // Drawn with the texture, kept faces are white of their own.
    const Mesh drawn = with_materials_apart(mesh, std::array{Vec3f(Vec3f::Ones())}).mesh;
    EXPECT_GT(drawn.vertex_count(), mesh.vertex_count());
    for (std::size_t f = 0; f < drawn.face_count(); ++f)
        for (const Index v : drawn.face(f))
            EXPECT_TRUE(drawn.materials.of_face[f] != 0 || drawn.colors[v] == Vec4f::Ones());
    std::filesystem::remove_all(folder);
}

} // namespace
} // namespace filigree
