// The report's experiment: remove the detail of the wavy cube level by level down to its corners, stretch what is left,
// return the detail.
#include <filigree/hierarchy/restore.h>
#include <filigree/hierarchy/strip.h>
#include <filigree/mesh/shapes.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

using namespace filigree;

/// Mean height of the waves on the cube's upper face.
double wave_height(const Mesh& cube, std::span<const Vec3f> positions) {
    double sum = 0, count = 0;
    for (std::size_t v = 0; v < positions.size(); ++v) {
        if (cube.positions[v].y() < 0.45f) continue;
        sum += double(std::abs(positions[v].y() - 0.5f));
        ++count;
    }
    return sum / count;
}

int main() {
    const RunContext context;
    const Mesh cube = make_wavy_cube({.resolution = 64});
    const Model model = strip(cube, {.code = DetailCode::reference}, context).value().model;
    for (unsigned k = 0; k <= model.finest_level(); ++k)
        std::printf("level %u: %zu vertices\n", k, level_mesh(model, k).vertex_count());

    // At rest the cube comes back, to float's rounding.
    const Restorer restorer = Restorer::create(model, {.law = HeightLaw::inverse}, context).value();
    Pose pose = rest_pose(model);
    const std::vector<Vec3f> at_rest = restorer.positions(pose, context).value();
    float error = 0;
    for (std::size_t v = 0; v < at_rest.size(); ++v) error = std::max(error, (at_rest[v] - cube.positions[v]).norm());

    // Stretched both ways, the waves of the upper face get lower (eq. 2.14); a law that keeps heights leaves them.
    for (Vec3f& p : pose.positions) p.x() *= 2, p.z() *= 2;
    const Restorer keeper = Restorer::create(model, {.law = HeightLaw::keep}, context).value();
    const double rest = wave_height(cube, at_rest);
    const double inverse = wave_height(cube, restorer.positions(pose, context).value());
    const double keep = wave_height(cube, keeper.positions(pose, context).value());
    std::printf("round trip %.1e; height at rest %.4f, stretched %.4f, with law keep %.4f\n", double(error), rest,
                inverse, keep);
    return error < 1e-6f && inverse < 0.8 * rest && std::abs(keep / rest - 1) < 0.1 ? 0 : 1;
}
