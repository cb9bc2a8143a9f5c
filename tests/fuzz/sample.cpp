// Points inside any mesh: by scan and by rays the same, where the mesh is closed.
#include "fuzz.h"

#include "filigree/sample.h"

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() { return mesh_seeds(); }

} // namespace filigree_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    const double spacing = 0.2 + bytes.byte() / 64.0;
    const Mesh mesh = mesh_of(bytes);
    const Result<Lattice> lattice = make_lattice(bounds(mesh.positions), {.spacing = spacing});
    if (!is_sound(lattice) || lattice->point_count() > 1e5) return 0;
    const Result<Occupancy> scan = sample_inside(mesh, *lattice, {.method = InsideMethod::scan}, kContext),
                            rays = sample_inside(mesh, *lattice, {.method = InsideMethod::rays}, kContext);
    is_sound(sample_inside(mesh, *lattice, {.method = InsideMethod::winding}, kContext));
    if (is_sound(scan) && is_sound(rays)) require(scan->bits == rays->bits, "scan and rays agree");
    return 0;
}
