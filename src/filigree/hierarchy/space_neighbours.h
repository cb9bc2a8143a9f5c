// For each vertex of a driver the vertices around it in space that tell how the matter there is deformed.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/mesh/incidence.h"

namespace filigree {

struct SpaceNeighbourOptions {
    std::size_t near = 24;      ///< so many of the nearest vertices
    std::size_t far = 8;        ///< and so many of every eighth vertex, which see past a flat place
    bool along_surface = false; ///< only those that are reached along the surface from nearby: cloth and skin
};

/// Lists of at most near + far vertices, ascending in distance within both kinds, none at the vertex's own place and at
/// most one a place. From other connected parts only where the vertex's own has too few; and none that lies across a
/// gap, where the surface neither leads to it nearby nor has matter between. normals: one a vertex, zero where it has
/// no face. Same lists for any thread count. Cost O(V log V).
IndexLists space_neighbours(const Mesh& mesh, std::span<const Vec3f> normals, const SpaceNeighbourOptions& options,
                            const RunContext& context);

} // namespace filigree
