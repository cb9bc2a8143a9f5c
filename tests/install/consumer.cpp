// Uses the installed library as a stranger would: strips a cube, restores it from its own driver, and it is the cube.
#include <filigree/filigree.h>

int main() {
    const filigree::Mesh cube = filigree::make_wavy_cube({.resolution = 16});
    const auto stripped = filigree::strip(cube, {.base = 100});
    if (!stripped) return 1;
    const filigree::Model& model = stripped->model;
    const auto restorer = filigree::Restorer::create(model);
    if (!restorer) return 1;
    const auto restored = restorer->positions(filigree::rest_pose(model));
    if (!restored || restored->size() != cube.vertex_count()) return 1;
    for (std::size_t i = 0; i < cube.vertex_count(); ++i)
        if (((*restored)[i] - cube.positions[i]).norm() > 1e-5f) return 1;
    return 0;
}
