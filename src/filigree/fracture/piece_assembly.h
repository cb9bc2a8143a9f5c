// Pieces put together as one mesh, with the attributes of the mesh they are of.
#pragma once

#include "filigree/fracture.h"
#include "filigree/fracture/cell_parts.h"
#include "filigree/mesh/surface.h"

namespace filigree {

/// triangles, piece_of_part: of cell_triangles and find_pieces. Cracks inside a piece are left out; of a sheet all are.
/// Fills in all but the report, of which it counts the faces inside. Cost O(mesh).
FracturedMesh assemble_pieces(const Mesh& mesh, const Surface& surface, const CutSurface& cut,
                              const CrackSurfaces& facets, const FractureCells& cells,
                              std::span<const CellTriangle> triangles, std::span<const Index> piece_of_part,
                              bool is_sheet, const RunContext& context);

} // namespace filigree
