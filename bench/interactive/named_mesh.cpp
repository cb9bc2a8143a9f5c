#include "named_mesh.h"

#include "filigree/mesh.h"

namespace filigree::bench {

std::vector<NamedMesh> built_in_meshes() {
    std::vector<NamedMesh> meshes;
    const auto add = [&](const char* name, const ShapeOptions& options) {
        meshes.push_back({name, make_shape(name, options).value()});
    };
    add("wavy-cube", {.resolution = 56});
    add("wavy-sphere", {.resolution = 64});
    add("wavy-plane", {.resolution = 130});
    add("bar", {.resolution = 30});
    add("cylinder", {.resolution = 32});
    add("torus", {.resolution = 96});
    return meshes;
}

} // namespace filigree::bench
