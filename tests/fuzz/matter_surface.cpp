// The surface of any particles: closed, and the same each time.
#include "fuzz.h"

#include "filigree/melting/field_surface.h"
#include "filigree/mesh.h"

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() { return mesh_seeds(); }

} // namespace filigree_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    MatterParticles particles;
    particles.spacing = 1;
    const unsigned count = bytes.byte() % 200, grid = 1 + bytes.byte() % 32;
    for (unsigned k = 0; k < count && !bytes.empty(); ++k) {
        const unsigned a = bytes.byte(), b = bytes.byte(), c = bytes.byte();
        particles.positions.emplace_back(float(a % grid) * 0.7f, float(b % grid) * 0.7f, float(c % grid) * 0.7f);
        particles.volumes.push_back(0.2f + float(a / 16) / 16);
        particles.temperatures.push_back(300);
        particles.liquid.push_back(float(b / 16) / 16);
        particles.renewal.push_back(float(c / 16) / 16);
    }
    const Result<ParticleField> field = make_particle_field(particles, {}, kContext);
    if (!is_sound(field)) return 0;
    const Result<Mesh> surface = make_field_surface(*field, kContext);
    if (!is_sound(surface)) return 0;
    require(check_mesh(*surface).empty(), "the surface is a sound mesh");
    if (surface->face_count() == 0) return 0;
    const TopologyReport topology = analyse_topology(*surface, kContext);
    require(topology.is_closed() && topology.is_manifold() && topology.is_oriented(), "the surface is closed");
    return 0;
}
