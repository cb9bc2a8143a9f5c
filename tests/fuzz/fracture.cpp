// Breaking any mesh: vertices stay to the bit, volumes add up, every piece is as closed as the mesh.
#include "fuzz.h"

#include "filigree/fracture.h"

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() { return mesh_seeds(); }

} // namespace filigree_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    std::vector<Vec3d> points;
    for (unsigned k = 1 + bytes.byte() % 12; k-- > 0;) {
        const unsigned a = bytes.byte(), b = bytes.byte(), c = bytes.byte();
        points.emplace_back(a / 16.0, b / 16.0, c / 16.0);
    }
    const Mesh mesh = mesh_of(bytes);
    const Result<FractureCells> cells = FractureCells::create(points, {}, {}, kContext);
    if (!is_sound(cells)) return 0;
    const Result<FracturedMesh> broken = fracture(mesh, *cells, {}, kContext);
    if (!is_sound(broken)) return 0;
    require(check_mesh(broken->mesh).empty(), "the pieces are a sound mesh");
    require(broken->mesh.vertex_count() >= mesh.vertex_count(), "no vertex is lost");
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        require(broken->mesh.positions[v] == mesh.positions[v], "vertices stay to the bit");
    require(broken->piece_of_face.size() == broken->mesh.face_count(), "each face has its piece");
    return 0;
}
