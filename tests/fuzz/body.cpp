// Bodies of any mesh and material, ten frames onto the ground: they stay finite, and so does what goes along.
#include "fuzz.h"

#include "filigree/physics/simulation.h"

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() { return mesh_seeds(4); }

} // namespace filigree_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    const unsigned how = bytes.byte(), stiffness = bytes.byte(), speed = bytes.byte();
    const Mesh mesh = mesh_of(bytes);
    Material material;
    material.model = static_cast<MaterialModel>(how % 5);
    const unsigned stiffest = material.model == MaterialModel::mpm ? 10 : 20; // its steps are as short as that asks
    material.young_modulus = 1e2 * double(1 << stiffness % stiffest);
    if (how & 32) material.yield_stress = 100;
    const Result<Body> body = make_body(mesh, material, {.scale = 0.01, .cells = {.count = 30}}, kContext);
    if (!is_sound(body) || body->particle_count() > 500) return 0;
    World world;
    world.obstacles.push_back({HalfSpace{{0, -0.02, 0}, {0, 1, 0}}, {}});
    Actor actor{std::make_shared<const Body>(*body)};
    actor.velocity = {0, -double(speed) / 8, double(speed % 16)};
    Result<Simulation> simulation = Simulation::create(world, {actor}, {.most_substeps = 40}, kContext);
    if (!is_sound(simulation)) return 0;
    const std::size_t points = simulation->attach(0, mesh.positions, kContext);
    for (int frame = 0; frame < 10; ++frame)
        if (!is_sound(simulation->advance(kContext))) return 0;
    const Vectors& positions = simulation->positions(0);
    for (std::size_t k = 0; k < positions.size(); ++k) require(positions[k].allFinite(), "particles stay finite");
    std::vector<Vec3f> carried(mesh.vertex_count());
    simulation->attached(points, carried, {}, kContext);
    for (const Vec3f& p : carried) require(p.allFinite(), "points that go along stay finite");
    return 0;
}
