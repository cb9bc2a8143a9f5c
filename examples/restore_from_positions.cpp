// Another program moved the driver and handed back positions alone: the gradients are estimated from them.
#include <filigree/filigree.h>

#include <cstdio>

using namespace filigree;

int main() {
    const Mesh mesh = make_wavy_sphere({.resolution = 96});
    const Model model = strip(mesh, {.base = 1000}).value().model;
    const Restorer restorer = Restorer::create(model).value();

    // A bend stands for the other program.
    const auto bend = make_bend(world_bounds(mesh), Axis::z, 90);
    const Pose with_gradients = warp_pose(*bend, model);
    const Pose positions_alone{with_gradients.positions, {}};

    Mesh bent = mesh; // the long way: every vertex
    warp_mesh(*bend, bent);
    const auto error = [&](const Pose& pose) {
        const VertexDistance distance = vertex_distance(restorer.mesh(pose).value(), bent).value();
        return distance.rms / bounds(bent).diagonal();
    };
    const double exact = error(with_gradients), estimated = error(positions_alone);
    std::printf("rms error, fraction of the diagonal: %.1e with gradients, %.1e from positions alone\n", exact,
                estimated);

    // PoseError says so without the long way.
    const auto gradients = restorer.gradients(positions_alone).value();
    const PoseError::Estimate estimate = PoseError(model).estimate(positions_alone, gradients).value();
    std::printf("estimated from the pose: %.1e\n", estimate.share());
    return exact < 5e-5 && estimated < 1e-4 && !estimate.is_too_curved() ? 0 : 1;
}
