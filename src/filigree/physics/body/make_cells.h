// Makes cells: of a mesh, of a list of indices, of a box; and bodies of such cells for tests and benchmarks.
#pragma once

#include "filigree/physics/body.h"

namespace filigree {

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

/// A body of whole cells without a mesh: surface points at the centres of its outer faces, split in four, or at their
/// corners if it is rigid. For tests and benchmarks.
Body make_body(Cells cells, const Material& material);
/// The same with particles alone: no surface, no field.
Body bare_body(Cells cells, const Material& material);

} // namespace filigree
