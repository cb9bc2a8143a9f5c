// Any mesh as quads with subdivision levels: remeshed, stripped with the report's code, restored.
#include <filigree/filigree.h>
#include <filigree/reference.h>

#include <algorithm>
#include <cstdio>

using namespace filigree;

int main() {
    const RunContext context;
    const Mesh torus = make_torus({.resolution = 48, .frequency = 3, .amplitude = 0.02});
    Mesh triangles; // without a trace of the grid it came from
    triangles.positions = torus.positions;
    for (const Triangle& t : triangulate(torus).triangles) triangles.add_face(t);

    const QuadRemeshed quads = quad_remesh(triangles, {.quads = 20'000}, context).value();
    const QuadRemeshReport& report = quads.report;
    std::printf("%zu patches of %zu x %zu quads, worst scaled Jacobian %.2f, at most %.1e of the diagonal off\n",
                report.patches, quads.patches.side(), quads.patches.side(), report.quality.min_scaled_jacobian,
                std::max(report.to_input.max, report.from_input.max));

    // The levels are found again from the mesh alone.
    const ReferenceModel model = strip_to_reference(quads.mesh, {}, context).value();
    std::printf("%u levels below the finest\n", model.finest_level());
    const std::vector<Vec3f> restored =
        restore_reference(model, driver_positions(model), {}, context).value().positions;
    float error = 0;
    for (std::size_t v = 0; v < restored.size(); ++v)
        error = std::max(error, (restored[v] - quads.mesh.positions[v]).norm());
    std::printf("restored to %.1e\n", error);
    return report.quality.inverted == 0 && model.finest_level() >= report.levels && error < 1e-5f ? 0 : 1;
}
