// Fracture: a mesh in pieces that are closed along their cracks.
//
//     const FractureCells cells = make_fracture_cells(mesh, {.pieces = 20}).value();
//     FracturedMesh broken = fracture(mesh, cells).value();
//     explode(broken, 0.3);
//     write_mesh(broken.mesh, "broken.obj");
//
// make_fracture_cells says where to break: even pieces, an impact, slabs of wood, rays of glass, grains of stone. A
// body (physics/world.h) breaks along the same cells. Next: piece_mesh for single pieces, file.h to write them.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/sample.h"
#include "filigree/types.h"

#include <memory>
#include <optional>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Cells

class CrackWarp;
struct CellFace;
struct GridSeeds;

/// How cracks bend: fractal noise and a stretch of space. Lengths are in model units, points relative to the mesh's
/// origin.
struct CrackWarpOptions {
    Box box;                 ///< of the mesh or body that breaks
    double roughness = 0;    ///< 0: cracks are planes; 1: as rough as space may be bent without folding
    double wavelength = 0;   ///< of the coarsest bumps; above 0 where roughness is above 0
    Vec3d grain = {0, 0, 1}; ///< unit vector along which pieces are longer
    double stretch = 1;      ///< how many times longer, 1 or more
    std::uint64_t seed = 1;
};

/// Voronoi (power) cells of seeds in a warped space: what a body or a mesh breaks into. A mesh and a body that are
/// asked about the same point agree. Copies share the cells and have pieces of their own.
class FractureCells {
public:
    /// seeds: in model units, relative to the mesh's origin, inside options.box; where two fall on one point of the
    /// grid (1/500,000 of the box), the second gets no cell. weights: empty or one a seed, model units squared: a cell
    /// grows where its weight is above its neighbours'. Cost: O(N) a cell for distances and about 15 exact cuts, all of
    /// the N seeds for cells at the border. Errors: unsuitable (no seed, more than kMostSeeds, numbers that are not
    /// finite, weights beyond the box's extent squared), cancelled.
    static Result<FractureCells> create(std::span<const Vec3d> seeds, std::span<const double> weights,
                                        const CrackWarpOptions& options, const RunContext& context);
    ~FractureCells();
    FractureCells(const FractureCells&);
    FractureCells& operator=(const FractureCells&);
    FractureCells(FractureCells&&) noexcept;
    FractureCells& operator=(FractureCells&&) noexcept;

    /// Cells are named by their seeds; some may be empty.
    Index count() const;
    /// The cell that holds the point. near: where to begin, any cell, best one close by; the answer does not depend on
    /// it. Cost: a walk from cell to cell, about 15 products a step.
    Index cell_at(const Vec3d& point, Index near = kNoIndex) const { return cell_at(on_grid(point), near); }
    std::span<const Index> neighbours(Index cell) const;

    /// Makes cells pieces together: the number of each cell's piece, every number from 0 on taken by a cell or more.
    /// Until then each cell is a piece, with its own number. There are no cracks inside a piece. Errors: usage (not one
    /// a cell, a number left out).
    Status merge(std::vector<Index> piece_of_cell);
    Index pieces() const { return pieces_.empty() ? count() : piece_count_; }
    Index piece_of(Index cell) const { return pieces_.empty() ? cell : pieces_[cell]; }
    Index piece_at(const Vec3d& point) const { return piece_of(cell_at(point)); }

    static constexpr Index kMostSeeds = 100'000;

    // For fracture() itself: cells on the grid of integers on which all decisions are exact.
    using GridPoint = std::array<std::int64_t, 3>;
    Index cell_at(const GridPoint& point, Index near = kNoIndex) const;
    GridPoint on_grid(const Vec3d& point) const;
    const CrackWarp& warp() const;
    const GridSeeds& grid() const;
    const std::vector<CellFace>& cell(Index seed) const;

private:
    struct Diagram;
    explicit FractureCells(std::shared_ptr<const Diagram> diagram);

    std::shared_ptr<const Diagram> diagram_;
    std::vector<Index> pieces_; ///< of each cell; empty: its own number
    Index piece_count_ = 0;
};

// ---------------------------------------------------------------------------------------------------------------------
// Patterns

/// - even: pieces of about one size.
/// - impact: small pieces around the points that were hit, large pieces far away.
/// - slabs: long pieces along the grain, like wood.
/// - radial: rays and rings around a point, through the whole thickness, like glass.
/// - grains: small pieces in some places and large ones in others, like stone.
enum class FracturePatternKind { even, impact, slabs, radial, grains };

struct FracturePattern {
    FracturePatternKind kind = FracturePatternKind::even;
    Index pieces = 20; ///< number of pieces (radial: about); pieces x clump: 1 to FractureCells::kMostSeeds
    Index clump = 1;   ///< number of neighbouring cells that make one piece, 1 to kMostClump
    /// impact, radial: points that were hit, relative to the mesh's origin; radial takes the first. Empty: a corner of
    /// the mesh (impact), its middle (radial).
    std::vector<Vec3d> at = {};
    std::optional<Vec3d> grain = {}; ///< slabs: direction in which pieces are longer; unset: the mesh's longest axis
    double stretch = 6;              ///< slabs: how many times longer, 1 to 100
    double roughness = 0.5;          ///< of the cracks, 0 (planes) to 1

    static constexpr Index kMostClump = 100;
};

/// Makes the cells along whose borders a mesh breaks. Seeds are random points inside the mesh, or on its surface where
/// it has no inside; RunContext::seed draws them. even and slabs: three rounds of Lloyd's method make cells alike; the
/// smallest has about a third of the median volume. grains: cells per volume differ by a factor of e^4 at most. clump:
/// cells join neighbours, fewest first; a piece has at most three times `clump` cells where enough cells are connected.
/// Cost: 100 points a piece, and FractureCells::create. Errors: usage (a number out of range, a point that is not
/// finite; check_mesh refuses the mesh), unsuitable (no faces), cancelled.
Result<FractureCells> make_fracture_cells(const Mesh& mesh, const FracturePattern& pattern = {},
                                          const RunContext& context = RunContext());

// ---------------------------------------------------------------------------------------------------------------------
// Fracture

struct FractureOptions {
    /// Longest edge of the triangles inside, model units. Unset: a sixth of a piece, or a twentieth where cracks are
    /// rough. 0: no vertices but those of the outlines.
    std::optional<double> edge = {};
    /// Parts smaller than this fraction of the mean volume join the neighbour with which they share most.
    double smallest = 0.01;
    /// true: the pieces have the numbers of FractureCells::piece_of, also where a piece falls into several parts. For
    /// bodies that break along the same cells.
    bool pieces_are_cells = false;
};

/// A point on the surface of the mesh: weights of two or three vertices (kNoIndex: none) of one triangle.
struct FacePoint {
    std::array<Index, 3> vertices = {kNoIndex, kNoIndex, kNoIndex};
    std::array<double, 3> weights = {0, 0, 0}; ///< add up to 1
};

/// What fracture() did.
struct CutReport {
    std::size_t cells = 0;                        ///< cells that hold matter
    std::size_t islands = 0;                      ///< pieces beyond one a cell: unconnected parts of a cell
    std::size_t joined = 0;                       ///< parts too small to be pieces
    std::size_t facets = 0;                       ///< cracks between two cells
    std::size_t fan_facets = 0;                   ///< of these, filled by a fan of triangles
    std::size_t inside_faces = 0;                 ///< triangles of all facets, each counted once
    std::size_t open_edges = 0;                   ///< of the pieces; open borders of the mesh itself do not count
    std::size_t closing_triangles = 0;            ///< triangles that closed open borders of the mesh during the cut
    bool is_sheet = false;                        ///< the mesh has no inside: pieces are parts of its surface
    OutwardReport outward;                        ///< what was turned to make faces look outwards
    double volume = 0;                            ///< of the mesh with its borders closed; model units cubed
    double volume_error = 0;                      ///< |sum of the pieces' volumes / volume - 1|; 0 for sheets
    double smallest = 0, median = 0, largest = 0; ///< volumes of the pieces; areas where the mesh is a sheet
    double cut_seconds = 0, facet_seconds = 0, assemble_seconds = 0;
};

/// All pieces in one mesh. The vertices of the unbroken mesh come first, in their order and unchanged to the bit. Each
/// vertex belongs to one piece. Faces are ordered by piece; faces that no crack crosses are unchanged.
struct FracturedMesh {
    /// Objects and groups are named "piece_0" and so on. Materials are the mesh's and "inside". Corners outside have
    /// the mesh's normals, or normals of its faces, so that closed cracks are invisible; corners inside have UVs in
    /// model units. Each vertex has a scalar "piece".
    Mesh mesh;
    Index pieces = 0;
    std::vector<Index> piece_of_face, piece_of_vertex; ///< kNoIndex for vertices without a face
    std::vector<std::uint8_t> is_inside;               ///< for each face: 1 on a crack
    /// For each vertex that was added: its place on the surface of the unbroken mesh; all kNoIndex for vertices inside.
    std::vector<FacePoint> sources;
    /// For each vertex: a number that its copies in other pieces have too, and no other vertex.
    std::vector<Index> place;
    std::vector<Index> crack_of_face;                 ///< for each face; kNoIndex outside
    std::vector<std::array<Index, 2>> cells_of_crack; ///< for each crack: the two cells beside it, ascending
    CutReport report;
};

/// Breaks a mesh along the borders of cells. There are no tolerances: the pieces of a closed mesh are closed for any
/// seeds (restricted Voronoi diagram [Yan 2009] with exact signs). Cost O(F), and about 1 us for each part of a
/// triangle that is cut (bench/fracture_bench.cpp). Errors: usage (check_mesh refuses the mesh), unsuitable (no face
/// with three different corners), cancelled.
Result<FracturedMesh> fracture(const Mesh& mesh, const FractureCells& cells, const FractureOptions& options = {},
                               const RunContext& context = RunContext());

/// Moves the pieces apart: each by `distance` times the vector from the middle of the mesh to the middle of the piece.
void explode(FracturedMesh& fractured, double distance);

/// One piece as a mesh of its own. Cost O(mesh).
Mesh piece_mesh(const FracturedMesh& fractured, Index piece);

} // namespace filigree
