// The main job: strip a mesh to a light driver, bend the driver, restore the detail. The README shows its middle.
#include <filigree/deform/space_warp.h>
#include <filigree/hierarchy/restore.h>
#include <filigree/hierarchy/strip.h>
#include <filigree/io/mesh_file.h>
#include <filigree/mesh/mesh_distance.h>
#include <filigree/mesh/shapes.h>

#include <cstdio>

using namespace filigree;

Mesh bend_through_driver(const char* input, const char* output) {
    // [README]
    const RunContext context; // all threads
    const Mesh mesh = read_mesh(input, context).value().mesh;
    const Model model = strip(mesh, {.base = 1000}, context).value().model;
    const Restorer restorer = Restorer::create(model, {}, context).value();

    const auto bend = make_bend(world_bounds(mesh), Axis::z, 90);
    const Pose pose = warp_pose(*bend, model, context);

    const Mesh restored = restorer.mesh(pose, context).value();
    const auto warnings = write_mesh(restored, output, {}, context).value();
    // [/README]
    for (const std::string& warning : warnings) std::fprintf(stderr, "%s\n", warning.c_str());
    return restored;
}

int main() {
    const RunContext context;
    Mesh full = make_wavy_sphere({.resolution = 96});
    if (!write_mesh(full, "sphere.ply", {}, context)) return 1;
    const Mesh restored = bend_through_driver("sphere.ply", "bent.ply");

    // The long way: every vertex. Nobody can tell the difference.
    warp_mesh(*make_bend(world_bounds(full), Axis::z, 90), full, context);
    const MeshDistance distance = mesh_distance(restored, full, 0, context).value();
    std::printf("rms %.1e of the diagonal, 95 %% of normals within %.2f degrees\n",
                distance.vertices->rms / distance.diagonal, distance.vertices->normal_p95_deg);
    return distance.vertices->rms < 1e-4 * distance.diagonal && distance.vertices->normal_p95_deg < 1 ? 0 : 1;
}
