// Cells of a mesh, counted as a body counts its particles.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/sample/closure.h"

#include <functional>

namespace filigree {

/// make_cells over triangles that are there already. `count_particles` says what options.count is a count of.
Result<Cells> make_cells(const Mesh& mesh, const WeldedTriangles& welded, double scale, const CellOptions& options,
                         const std::function<std::size_t(const Cells&)>& count_particles, const RunContext& context,
                         CellReport* report);

} // namespace filigree
