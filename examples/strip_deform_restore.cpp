// The main job: strip a mesh to a light driver, bend the driver, restore the detail. The README shows its first part.
// [README]
#include <filigree/filigree.h>

#include <cstdio>

using namespace filigree;

Status bend(const char* input, const char* output) {
    const Result<MeshFile> file = read_mesh(input);
    if (!file) return file.error(); // a code and one sentence
    const Mesh& mesh = file->mesh;

    const Model model = strip(mesh, {.base = 1000}).value().model; // value() throws what error() says
    const Restorer restorer = Restorer::create(model).value();     // once

    const auto warp = make_bend(world_bounds(mesh), Axis::z, 90);
    const Pose pose = warp_pose(*warp, model); // or positions from anywhere, one a driver vertex

    const Mesh bent = restorer.mesh(pose).value();
    const auto written = write_mesh(bent, output);
    if (!written) return written.error();
    for (const std::string& warning : *written) std::fprintf(stderr, "%s\n", warning.c_str());
    return Success{};
}
// [/README]

int main() {
    Mesh full = make_wavy_sphere({.resolution = 96});
    if (!write_mesh(full, "sphere.ply")) return 1;
    if (const Status missing = bend("nosuch.ply", "bent.ply"); missing || missing.error().code != ErrorCode::not_found)
        return 1;
    if (const Status bent = bend("sphere.ply", "bent.ply"); !bent) {
        std::fprintf(stderr, "%s\n", bent.error().message.c_str());
        return static_cast<int>(bent.error().code);
    }
    const Mesh restored = read_mesh("bent.ply").value().mesh;

    // The long way: every vertex. Nobody can tell the difference.
    warp_mesh(*make_bend(world_bounds(full), Axis::z, 90), full);
    const MeshDistance distance = mesh_distance(restored, full, 0).value();
    std::printf("rms %.1e of the diagonal, 95 %% of normals within %.2f degrees\n",
                distance.vertices->rms / distance.diagonal, distance.vertices->normal_p95_deg);
    return distance.vertices->rms < 1e-4 * distance.diagonal && distance.vertices->normal_p95_deg < 1 ? 0 : 1;
}
