// The report's experiment: remove the detail of the wavy cube level by level down to its corners, stretch what is left,
// return the detail.
#include <filigree/mesh.h>
#include <filigree/reference.h>

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
    const ReferenceModel model = strip_to_reference(cube, {}, context).value();
    for (unsigned k = 0; k <= model.finest_level(); ++k)
        std::printf("level %u: %zu vertices\n", k, level_mesh(model, k).vertex_count());

    // At rest the cube comes back, to float's rounding.
    std::vector<Vec3f> driver = driver_positions(model);
    const std::vector<Vec3f> at_rest = restore_reference(model, driver, {}, context).value().positions;
    float error = 0;
    for (std::size_t v = 0; v < at_rest.size(); ++v) error = std::max(error, (at_rest[v] - cube.positions[v]).norm());

    // Stretched both ways, the waves of the upper face get lower (eq. 2.14); a law that keeps heights leaves them.
    for (Vec3f& p : driver) p.x() *= 2, p.z() *= 2;
    const auto height_with = [&](HeightLaw law) {
        return wave_height(cube, restore_reference(model, driver, {.law = law}, context).value().positions);
    };
    const double rest = wave_height(cube, at_rest);
    const double inverse = height_with(HeightLaw::inverse), keep = height_with(HeightLaw::keep);
    std::printf("round trip %.1e; height at rest %.4f, stretched %.4f, with law keep %.4f\n", double(error), rest,
                inverse, keep);
    return error < 1e-6f && inverse < 0.8 * rest && std::abs(keep / rest - 1) < 0.1 ? 0 : 1;
}
