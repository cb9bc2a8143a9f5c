// Quads from any mesh: they are quads of a regular grid and sound, or a sentence says why there are none.
#include "fuzz.h"

#include "filigree/remesh.h"

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() { return mesh_seeds(4); }

} // namespace filigree_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    const unsigned how = bytes.byte();
    const Mesh mesh = mesh_of(bytes);
    const QuadRemeshOptions options{.quads = 6 + how % 64 * 8,
                                    .feature_angle_deg = how & 64 ? 40.0 : 180.0,
                                    .small_parts = how & 128 ? SmallParts::keep : SmallParts::remove,
                                    .wrap = WrapUse::never};
    const Result<QuadRemeshed> quads = quad_remesh(mesh, options, kContext);
    if (!is_sound(quads)) return 0;
    require(check_mesh(quads->mesh).empty(), "quads are a sound mesh");
    for (std::size_t f = 0; f < quads->mesh.face_count(); ++f)
        require(quads->mesh.face_size(f) == 4, "quads have four corners");
    for (const Vec3f& p : quads->mesh.positions) require(p.allFinite(), "quads are finite");
    return 0;
}
