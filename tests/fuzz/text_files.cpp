// Readers of what people write: handles, scenes, materials. A sentence, or something sound.
#include "fuzz.h"
#include "temporary.h"

#include "filigree/io/animation/handles_file.h"
#include "filigree/io/mesh/material_file.h"
#include "filigree/scene.h"

using namespace filigree_fuzz;

namespace filigree_fuzz {

/// The first byte says what the text is.
std::vector<std::string> seeds() {
    std::vector<std::string> all = {
        std::string(1, 0) + R"({"handles": [{"name": "foot", "box": {"min": [-9, -9, -9], "max": [-1.3, 9, 9]}},
 {"sphere": {"centre": [1.5, 0, 0], "radius": 0.6}, "axis": [1, 0, 0], "degrees": 60, "move": [0.3, 0, 0.5]},
 {"vertices": [0, 1, 2], "centre": [0, 0, 0], "axis": [0, 0, 1], "degrees": 5, "comment": null}]})",
        std::string(1, 2) +
            "# library\nnewmtl gold\nKd 0.8 0.6 0.1\nKa 0 0 0\nd 0.5\nTr 0.5\nmap_Kd -s 1 1 1 gold.png\n"
            "newmtl jade\nKd 0 1 0\nillum 2\nPr 0.3\nPm 1\n",
    };
    for (const auto& entry : std::filesystem::directory_iterator(FILIGREE_ROOT "/examples/scenes")) {
        std::ifstream scene(entry.path(), std::ios::binary);
        if (entry.path().extension() == ".toml")
            all.push_back(std::string(1, 1) + std::string(std::istreambuf_iterator<char>(scene), {}));
    }
    return all;
}

} // namespace filigree_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    switch (bytes.byte() % 3) {
    case 0: {
        const TemporaryFile file(".json");
        file.write(bytes.rest());
        const Result<std::vector<HandleRegion>> handles = read_handles(file.path());
        if (is_sound(handles)) require(!handles->empty(), "a file of handles has one");
        break;
    }
    case 1: {
        const TemporaryFile file(".toml");
        file.write(bytes.rest());
        is_sound(read_scene(file.path().string()));
        break;
    }
    default: {
        const TemporaryFile file(".mtl");
        file.write(bytes.rest());
        Mesh mesh;
        mesh.materials.names = {"gold", "jade", ""};
        mesh.material_files = {file.path().filename().string()};
        const MeshMaterials read = read_materials(mesh, file.path().parent_path() / "mesh.obj");
        require(read.materials.size() == 3, "there is a material for each name");
    }
    }
    return 0;
}
