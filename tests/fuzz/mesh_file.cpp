// Readers of meshes: whatever the bytes, a sound mesh or a sentence; what was read is written and read again the same.
#include "fuzz.h"

#include "filigree/file.h"
#include "filigree/mesh.h"

using namespace filigree_fuzz;

namespace {

constexpr const char* kNames[] = {"f.obj", "f.ply", "f.stl", "f.off", "f.gltf", "f.glb"};
constexpr MeshFormat kFormats[] = {MeshFormat::obj, MeshFormat::ply, MeshFormat::stl, MeshFormat::off};

} // namespace

namespace filigree_fuzz {

/// The first byte is the format that the name says.
std::vector<std::string> seeds() {
    std::vector<std::string> all;
    for (const Mesh& mesh : {make_wavy_sphere({.resolution = 2}), *make_shape("torus", {.resolution = 3})})
        for (char k = 0; k < 4; ++k)
            for (const bool ascii : {false, true}) {
                std::string bytes;
                if (write_mesh(mesh, kFormats[std::size_t(k)], bytes, {.ascii = ascii}, kContext))
                    all.push_back(k + bytes);
            }
    all.push_back(std::string("\4") +
                  R"({"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
                  R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],)"
                  R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":)"
                  R"("data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})");
    return all;
}

} // namespace filigree_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    const char* const name = kNames[bytes.byte() % std::size(kNames)];
    const Result<MeshFile> file = read_mesh(bytes.rest(), name, kContext);
    if (!is_sound(file)) return 0;
    require(check_mesh(file->mesh).empty(), "what was read is a sound mesh");
    if (file->mesh.vertex_count() > 2'000 || file->mesh.corner_count() > 20'000) return 0;
    std::string ply;
    if (!is_sound(write_mesh(file->mesh, MeshFormat::ply, ply, {}, kContext))) return 0;
    const Result<MeshFile> again = read_mesh(ply, "again.ply", kContext);
    require(again.ok(), "a PLY of ours is read");
    require(again->mesh.vertex_count() == file->mesh.vertex_count() && again->mesh.corners == file->mesh.corners,
            "a PLY of ours has the same faces");
    return 0;
}
