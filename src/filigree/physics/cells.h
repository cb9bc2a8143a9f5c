// A mesh as cubes of a regular lattice: which are occupied, how much of each, and how they hang together.
#pragma once

#include "filigree/physics/vectors.h"
#include "filigree/sample/sample_inside.h"

#include <array>

namespace filigree {

/// Cells (i, j, k), the cube from origin + spacing (i, j, k) to origin + spacing (i + 1, j + 1, k + 1), and their
/// corners. Both ascend by k, then j, then i, so that neighbours along x follow each other in memory.
struct Cells {
    using LatticeIndex = std::array<std::uint16_t, 3>;

    double spacing = 0;           ///< m
    Vec3d origin = Vec3d::Zero(); ///< m, relative to the mesh's (scaled) origin
    std::vector<LatticeIndex> cells;
    std::vector<LatticeIndex> corners;
    std::vector<std::array<Index, 8>> cell_corners; ///< corner with bits x = 1, y = 2, z = 4
    std::vector<float> fraction;                    ///< occupied part of each cell's volume, kLeastFraction .. 1;
                                                    ///< above 1 where neighbours have shared theirs (cell_shares.h)
    std::vector<Vec3f> centroid;                    ///< of the occupied part, m, relative to the mesh's origin

    /// Below this a cell counts as this full: emptier ones would be all stiffness noise and no mass.
    static constexpr float kLeastFraction = 0.1f;

    /// Cells first_cell .. first_cell + count - 1, one beside the other along x. Their corners lie in four rows, of
    /// count + 1 consecutive corners each, that begin at rows[0] (j, k), rows[1] (j + 1, k), rows[2] (j, k + 1) and
    /// rows[3] (j + 1, k + 1).
    struct Run {
        Index first_cell, count;
        std::array<Index, 4> rows;
    };
    std::vector<Run> runs; ///< ascending by cell

    /// Cell with these indices, kNoIndex where there is none. Cost O(log cells).
    Index find_cell(int i, int j, int k) const;
};

struct CellOptions {
    double spacing = 0; ///< m; 0: chosen so that about `count` cells are occupied, and fitted so that the
                        ///< shortest side of the box is a whole number of cells
    std::size_t count = 8000;
};

struct CellReport {
    std::size_t cells = 0, whole_cells = 0;
    std::size_t added_cells = 0; ///< that no sample found occupied, and a part of the surface passes through
    std::size_t thin_cells = 0;  ///< of parts with fewer than two cells across
    std::size_t loose_parts =
        0;             ///< small unconnected groups of cells that were left out; their vertices follow the body
    double volume = 0; ///< m^3, occupied by the cells
};

/// Cells of a mesh whose coordinates are multiplied by `scale` (metres a model unit). A cell's fraction comes from 4^3
/// samples (open meshes, by winding numbers: 2^3, or one of very many cells); cells that only the surface passes
/// through are added, so that every vertex lies in a cell (but those of loose parts: groups with fewer than 2 % of the
/// largest group's cells). Errors: as sample_inside; usage (spacing; check_mesh refuses the mesh); unsuitable (no
/// faces; more than 2^26 cells: says a spacing that would do), cancelled.
Result<Cells> make_cells(const Mesh& mesh, double scale, const CellOptions& options, const RunContext& context,
                         CellReport* report = nullptr);

/// Whole cells at these indices, in any order. Cost O(n log n).
Cells lattice_cells(std::vector<Cells::LatticeIndex> indices, double spacing, const Vec3d& origin);

/// Cells of a solid box of nx * ny * nz cells, for tests and benchmarks; corner (0, 0, 0) at `origin`.
Cells box_cells(std::size_t nx, std::size_t ny, std::size_t nz, double spacing, const Vec3d& origin = Vec3d::Zero());

/// Deformation gradients at the corners: means over the cells around, weighted by their fractions. `rest` is the
/// lattice itself. One a corner. Cost O(cells).
void corner_gradients(const Cells& cells, const Vectors& positions, std::span<Mat3f> gradients,
                      const RunContext& context);

} // namespace filigree
