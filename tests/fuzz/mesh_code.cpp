// Coding of meshes: any mesh comes back with its faces and near its places, in order and not; damaged streams are
// refused or give a sound mesh.
#include "fuzz.h"

#include "filigree/coding/mesh_code.h"

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() { return mesh_seeds(); }

} // namespace filigree_fuzz

namespace {

/// Changes a byte of one of its streams, and reads what became of it.
void damage(const CodedMesh& coded, std::string& stream, Bytes& bytes) {
    if (stream.empty() || bytes.empty()) return;
    const std::size_t at = (bytes.byte() * 256 + bytes.byte()) % stream.size();
    stream[at] = char(stream[at] ^ bytes.byte());
    const Result<Mesh> damaged = decode_mesh(coded, kContext);
    if (is_sound(damaged)) require(check_mesh(*damaged).empty(), "a damaged code gives a sound mesh or none");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    const unsigned options = bytes.byte();
    const Mesh mesh = mesh_of(bytes);
    const MeshCodeOptions how{10 + options % 7, (options & 64) != 0, (options & 128) != 0, (options & 32) != 0};
    MeshCodeReport report;
    CodedMesh coded = encode_mesh(mesh, how, &report, kContext).value();
    const Mesh read = decode_mesh(coded, kContext).value();
    require(read.vertex_count() == mesh.vertex_count() && read.face_count() == mesh.face_count(), "nothing is lost");
    require(!how.keep_order || read.corners == mesh.corners, "faces come back in their order");
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        const Vec3f was = mesh.positions[how.keep_order ? v : report.vertex[v]];
        require((read.positions[v] - was).norm() <= float(coded.step * (how.surface ? 3.1 : 1.0)) + 1e-5f,
                "places are near");
    }
    for (std::string CodedMesh::*part :
         {&CodedMesh::connectivity, &CodedMesh::places, &CodedMesh::attributes, &CodedMesh::order})
        damage(coded, coded.*part, bytes);
    damage(coded, coded.levels.connectivity, bytes);
    damage(coded, coded.levels.places, bytes);
    for (CodedLevel& level : coded.levels.levels) {
        damage(coded, level.splits, bytes);
        damage(coded, level.refinement, bytes);
    }
    return 0;
}
