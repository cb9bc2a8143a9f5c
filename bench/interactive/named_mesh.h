// The meshes that benchmarks measure with, and the sizes of their drivers.
#pragma once

#include "filigree/mesh.h"

#include <string>

namespace filigree::bench {

constexpr std::size_t kDriverSizes[] = {250, 1000, 4000}; ///< that meshes are measured with
constexpr std::size_t kSmallestMesh = 200;                ///< vertices; smaller meshes need no driver
constexpr double kRounding = 2e-7;                        ///< of the diagonal: smaller errors are nothing

struct NamedMesh {
    std::string name;
    Mesh mesh;
};

/// Built-in shapes of 10,000 to 25,000 vertices: closed and open, smooth and bumpy, thick and thin.
std::vector<NamedMesh> built_in_meshes();

} // namespace filigree::bench
