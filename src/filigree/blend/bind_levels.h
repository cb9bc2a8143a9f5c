// A model of levels that were chosen elsewhere.
#pragma once

#include "filigree/levels/simplify_levels.h"
#include "filigree/strip.h"

namespace filigree {

/// Binds a mesh to the coarsest of its levels. levels: one or more, coarse to fine, of triangles; nothing is checked.
/// work: of the mesh, welded as the model should see it. Cost O(V log V). Errors: unsuitable (more triangles than
/// kMostListedTriangles), cancelled.
Result<Model> bind_to_levels(Mesh mesh, std::vector<Level> levels, const WorkingMesh& work, const RunContext& context);

} // namespace filigree
