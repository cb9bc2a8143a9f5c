// Uses the installed library as a stranger would: a cube from the library has the vertices its header promises.
#include <filigree/mesh/shapes.h>

int main() {
    const filigree::Result<filigree::Mesh> cube = filigree::make_shape("wavy-cube", {.resolution = 8});
    return cube && cube->vertex_count() == 6 * 8 * 8 + 2 && filigree::check_mesh(*cube).empty() ? 0 : 1;
}
