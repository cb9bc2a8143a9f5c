// Coding of meshes: any mesh comes back with its faces and near its places, in order and not; damaged streams are
// refused or give a sound mesh.
#include "fuzz.h"

#include "filigree/coding/mesh_code.h"
#include "filigree/mesh.h"

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() {
    std::vector<std::string> all;
    for (const std::string& mesh : mesh_seeds(12))
        for (const int kind : {0, 1, 6, 11, 24, 56}) all.push_back(char(kind) + mesh);
    return all;
}

} // namespace filigree_fuzz

namespace {

/// Any faces, or a regular mesh whose vertices were moved.
Mesh any_mesh(Bytes& bytes, unsigned kind) {
    if (kind % 5 != 1) return mesh_of(bytes);
    Mesh mesh = kind & 128 ? make_wavy_sphere({.resolution = 2 + kind / 8 % 8})
                           : make_wavy_cube({.resolution = 2 + kind / 8 % 8});
    for (unsigned k = 0; k < 20 && !bytes.empty(); ++k)
        mesh.positions[(bytes.byte() * 256 + bytes.byte()) % mesh.vertex_count()] *= float(bytes.byte()) / 64;
    return mesh;
}

/// Values one a vertex, or named by corners in any way.
template <class T>
void add_values(CornerAttribute<T>& attribute, const Mesh& mesh, Bytes& bytes, bool is_indexed) {
    const std::size_t count = is_indexed ? 1 + bytes.byte() % 20 : mesh.vertex_count();
    for (std::size_t k = 0; k < count; ++k) {
        T value;
        for (float& x : value) x = float(bytes.byte()) / 16 - 8;
        attribute.values.push_back(value);
    }
    for (std::size_t c = 0; is_indexed && c < mesh.corner_count(); ++c) {
        const std::size_t named = bytes.byte() % (count + 1);
        attribute.corners.push_back(named == count ? kNoIndex : Index(named));
    }
}

/// Changes a byte of one of its streams, and reads what became of it.
void damage(const PackedMesh& coded, std::string& stream, Bytes& bytes) {
    if (stream.empty() || bytes.empty()) return;
    const std::size_t at = (bytes.byte() * 256 + bytes.byte()) % stream.size();
    stream[at] = char(stream[at] ^ bytes.byte());
    const Result<Mesh> damaged = unpack_mesh(coded, kContext);
    if (is_sound(damaged)) require(check_mesh(*damaged).empty(), "a damaged code gives a sound mesh or none");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    const unsigned kind = bytes.byte(), options = bytes.byte();
    Mesh mesh = any_mesh(bytes, kind);
    if (kind & 2 && mesh.corner_count() > 0) add_values(mesh.uvs, mesh, bytes, kind & 4);
    if (kind & 8 && mesh.corner_count() > 0) {
        add_values(mesh.normals, mesh, bytes, kind & 16);
        if (kind & 32)
            for (Vec3f& n : mesh.normals.values) n = n.norm() > 0 ? n.normalized() : Vec3f(0, 0, 1);
    }
    const float uv_step = mesh.uvs.empty() ? 0 : 16.0f / 4095;
    const PackOptions how{10 + options % 7, (options & 64) != 0, (options & 128) != 0, (options & 32) != 0};
    PackedMeshReport report;
    PackedMesh coded = pack_mesh(mesh, how, &report, kContext).value();
    const Mesh read = unpack_mesh(coded, kContext).value();
    require(read.vertex_count() == mesh.vertex_count() && read.face_count() == mesh.face_count(), "nothing is lost");
    require(!how.keep_order || read.corners == mesh.corners, "faces come back in their order");
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        const Vec3f was = mesh.positions[how.keep_order ? v : report.vertex[v]];
        require((read.positions[v] - was).norm() <= float(coded.step * (how.surface ? 3.1 : 1.0)) + 1e-5f,
                "places are near");
    }
    for (std::size_t c = 0; how.keep_order && c < mesh.uvs.corners.size(); ++c) {
        const Index was = mesh.uvs.corners[c], is = read.uvs.corners[c];
        require((was == kNoIndex) == (is == kNoIndex), "corners without a value stay without");
        if (was != kNoIndex)
            require((read.uvs.values[is] - mesh.uvs.values[was]).cwiseAbs().maxCoeff() <= uv_step,
                    "texture coordinates are near");
    }
    for (std::string PackedMesh::*part :
         {&PackedMesh::connectivity, &PackedMesh::places, &PackedMesh::attributes, &PackedMesh::order})
        damage(coded, coded.*part, bytes);
    damage(coded, coded.levels.connectivity, bytes);
    damage(coded, coded.levels.places, bytes);
    for (PackedLevel& level : coded.levels.levels) {
        damage(coded, level.splits, bytes);
        damage(coded, level.refinement, bytes);
    }
    return 0;
}
