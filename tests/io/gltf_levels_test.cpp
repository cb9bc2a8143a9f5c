#include "filigree/file.h"
#include "filigree/io/file.h"
#include "filigree/mesh.h"
#include "filigree/strip.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstring>

#include <unistd.h>

using namespace filigree;
using Json = nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// The JSON of the levels of a wavy mesh whose lower half is of one material and whose upper half of another.
Json levels_of(bool with_materials, std::vector<std::string>& warnings) {
    Mesh mesh = make_wavy_cube({.resolution = 20});
    if (with_materials) {
        mesh.materials.names = {"low", "high"};
        for (std::size_t f = 0; f < mesh.face_count(); ++f)
            mesh.materials.of_face.push_back(f < mesh.face_count() / 2 ? 0 : 1);
        mesh.embedded_materials.resize(2);
    }
    const Result<Stripped> stripped = strip(mesh, {.base = 100}, RunContext(1));
    EXPECT_TRUE(stripped.ok());
    const fs::path path = fs::temp_directory_path() / ("filigree-levels-" + std::to_string(::getpid()) + ".glb");
    const Result<std::vector<std::string>> written = write_levels_glb(stripped->model, path, {}, RunContext(1));
    EXPECT_TRUE(written.ok());
    warnings = *written;
    const Result<std::string> bytes = read_file(path);
    fs::remove(path);
    std::uint32_t json_bytes = 0;
    std::memcpy(&json_bytes, bytes->data() + 12, 4);
    Json json = Json::parse(bytes->substr(20, json_bytes));
    json["levels"] = stripped->model.levels.size() + 1; // for the tests
    json["driver_vertices"] = stripped->model.driver().vertices.size();
    return json;
}

} // namespace

TEST(GltfLevels, CoarserLevelsAreAlternativesOfTheFinest) {
    std::vector<std::string> warnings;
    const Json json = levels_of(false, warnings);
    EXPECT_EQ(json["extensionsUsed"], Json({"MSFT_lod"}));
    ASSERT_EQ(json["scenes"][0]["nodes"].size(), 1u);
    const Json& first = json["nodes"][json["scenes"][0]["nodes"][0].get<std::size_t>()];
    const Json& ids = first["extensions"]["MSFT_lod"]["ids"];
    ASSERT_EQ(ids.size() + 1, json["levels"]);
    const Json& coverages = first["extras"]["MSFT_screencoverage"];
    ASSERT_EQ(coverages.size(), json["levels"]);
    EXPECT_EQ(coverages.back(), 0.0);
    EXPECT_TRUE(std::is_sorted(coverages.rbegin(), coverages.rend()));
    const auto vertices = [&](const Json& node) {
        const Json& mesh = json["meshes"][node["mesh"].get<std::size_t>()];
        return json["accessors"][mesh["primitives"][0]["attributes"]["POSITION"].get<std::size_t>()]["count"];
    };
    const Json& last = json["nodes"][ids.back().get<std::size_t>()];
    EXPECT_EQ(vertices(last), json["driver_vertices"]);
    EXPECT_EQ(last["name"], "level 0");
}

TEST(GltfLevels, CoarserLevelsTakeTheMaterialsNearby) {
    std::vector<std::string> warnings;
    const Json json = levels_of(true, warnings);
    for (const Json& mesh : json["meshes"]) EXPECT_EQ(mesh["primitives"].size(), 2u);
    EXPECT_EQ(json["materials"].size(), 2u); // shared
}
