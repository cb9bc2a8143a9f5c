// A mesh in pieces.
#pragma once

#include "filigree/fracture/fracture_cells.h"
#include "filigree/mesh/mesh.h"
#include "filigree/sample/outward.h"

#include <optional>

namespace filigree {

struct FractureOptions {
    /// Longest edges wanted inside, model units; unset: a sixth of a piece, a twentieth where cracks are rough. 0: none
    /// but the outlines'.
    std::optional<double> edge = {};
    /// Parts below this share of the mean volume become one with the neighbour that they share most with.
    double smallest = 0.01;
    /// Each cell that holds matter is one piece and the piece has FractureCells::piece_of's number; islands and small
    /// parts stay with it.
    bool pieces_are_cells = false;
};

/// Where a vertex that the fracture added to the surface is: weights of two or three of the mesh's vertices (kNoIndex:
/// none), all corners of one triangle.
struct FacePoint {
    std::array<Index, 3> vertices = {kNoIndex, kNoIndex, kNoIndex};
    std::array<double, 3> weights = {0, 0, 0}; ///< add up to 1
};

struct CutReport {
    std::size_t cells = 0;        ///< that hold matter
    std::size_t islands = 0;      ///< pieces beyond one a cell: parts of a cell that do not hang together
    std::size_t joined = 0;       ///< parts too small to be pieces
    std::size_t facets = 0;       ///< cracks between two cells
    std::size_t fan_facets = 0;   ///< of those, filled by a fan alone
    std::size_t inside_faces = 0; ///< all facets' triangles, counted once
    std::size_t open_edges = 0;   ///< of pieces, where edges do not cancel; the mesh's own open borders count as closed
    std::size_t closing_triangles = 0; ///< that closed those borders while it was cut
    bool is_sheet = false;   ///< the mesh has no inside: pieces are parts of its surface, without inner surfaces
    OutwardReport outward;   ///< what of the mesh was turned first
    double volume = 0;       ///< of the mesh, its borders closed; model units cubed
    double volume_error = 0; ///< |sum of the pieces' volumes / volume - 1|; 0 for sheets
    double smallest = 0, median = 0, largest = 0; ///< volumes of pieces (areas of a sheet's)
    double cut_seconds = 0, facet_seconds = 0, assemble_seconds = 0;
};

/// Pieces in one mesh. Vertices of the mesh that was broken come first, in their order and to the bit; each vertex
/// belongs to one piece. Faces that no crack crosses are as they were; all stand in the order of their pieces.
struct FracturedMesh {
    /// Objects and groups: "piece_0" and so on. Materials: the mesh's, and "inside". Corners have normals: outside the
    /// mesh's own, or what its faces give where it has none, so that closed cracks cannot be seen. Inside they have UVs
    /// in model units. A scalar "piece" a vertex.
    Mesh mesh;
    Index pieces = 0;
    std::vector<Index> piece_of_face, piece_of_vertex; ///< vertices without a face: kNoIndex
    std::vector<std::uint8_t> is_inside;               ///< a face: whether it lies on a crack
    /// Of vertices behind the unbroken mesh's: where on its surface they are; all kNoIndex inside.
    std::vector<FacePoint> sources;
    /// Of every vertex: a number that it shares with its copies in other pieces, and with nothing else.
    std::vector<Index> place;
    std::vector<Index> crack_of_face;                 ///< kNoIndex outside
    std::vector<std::array<Index, 2>> cells_of_crack; ///< the two cells that each crack lies between, ascending
    CutReport report;
};

/// Breaks a mesh along the borders of cells. Nothing rests on a tolerance: each piece is closed wherever the mesh is,
/// at any place of the seeds (restricted Voronoi diagram, [Yan 2009], with exact signs). Cost: cut_surface and
/// crack_surfaces; on one core about 0.1 s for 900,000 triangles and 20 planar cells. Errors: usage (check_mesh refuses
/// the mesh), unsuitable (no face with three different corners), cancelled.
Result<FracturedMesh> fracture(const Mesh& mesh, const FractureCells& cells, const FractureOptions& options,
                               const RunContext& context);

/// Moves the pieces apart: each by `distance` times the way from the mesh's middle to its own.
void explode(FracturedMesh& fractured, double distance);

/// One piece as a mesh of its own. Cost O(mesh).
Mesh piece_mesh(const FracturedMesh& fractured, Index piece);

} // namespace filigree
