// Grids over prepared surfaces, the way remeshing gets them.
#pragma once

#include "filigree/remesh/base_triangles.h"
#include "filigree/remesh/manifold_surface.h"
#include "prepared.h"
#include "threads.h"

namespace filigree_test {

inline PatchGrid sampled_grid(const Prepared& on, std::size_t patches, unsigned levels, const RunContext& context) {
    SurfaceMap map = on.map();
    EXPECT_TRUE(make_base_triangles(map, {.triangles = 2 * patches}, context).ok());
    const auto base = make_base_quads(map, false, context);
    EXPECT_TRUE(base.ok());
    return sample_patches(map, *base, on.walk(), levels, context);
}

/// Of quads, each cut in two.
inline SurfaceTopology topology_of_quads(const Mesh& mesh) {
    ManifoldSurface surface;
    surface.positions.resize(mesh.vertex_count());
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const auto quad = mesh.face(f);
        surface.triangles.push_back({quad[0], quad[1], quad[2]});
        surface.triangles.push_back({quad[0], quad[2], quad[3]});
    }
    return surface_topology(surface);
}

} // namespace filigree_test
