// Which cubes of a regular grid a mesh occupies: the steps from a mesh to its cells. Private to the layer. Everything
// here is in model units.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/sample/closure.h"

#include <optional>
#include <string>

namespace filigree::mesh_cells {

inline constexpr double kMostCells = 0x1p26;

/// A regular grid of cubes around the mesh.
struct Grid {
    double spacing = 0;
    Vec3d origin;
    std::array<std::size_t, 3> counts;

    std::size_t index(std::size_t i, std::size_t j, std::size_t k) const { return (k * counts[1] + j) * counts[0] + i; }
};

/// The grid with this spacing, centred on the box; sides that are whole numbers of cells get just those. scale: metres
/// a model unit, for the error's sentence. Errors: unsuitable (too many cells).
Result<Grid> make_grid(const Box& box, double spacing, double scale);

/// Points at the centres of the n^3 cubes of each cell, layers k_begin .. k_end - 1 of cells. Rounded to few bits, so
/// that the scan's exact decisions are quick.
Lattice sample_points(const Grid& grid, unsigned n, std::size_t k_begin, std::size_t k_end);

/// Four digits of a number, for sentences.
std::string number(double x);

/// An occupied cell, before its neighbours are known.
struct Draft {
    Cells::LatticeIndex index;
    float fraction;
    Vec3f centroid;
    bool added = false;
};

/// A mesh and what all its grids have in common.
struct MeshToFill {
    std::span<const Vec3f> positions;
    const WeldedTriangles& welded;
    std::vector<std::uint8_t> used; ///< vertices of faces
    Box box;                        ///< of those
    double longest_edge = 0;

    std::array<Vec3d, 3> corners_of(const Triangle& triangle) const {
        return {positions[triangle[0]].cast<double>(), positions[triangle[1]].cast<double>(),
                positions[triangle[2]].cast<double>()};
    }
};
MeshToFill find_mesh_to_fill(const Mesh& mesh, const WeldedTriangles& welded);

Error too_many_cells(const Grid& grid, double count, double scale);

/// Cells with samples inside the mesh, in the order of Cells. scale: as above. Errors: unsuitable, cancelled.
Result<std::vector<Draft>> sample_cells(const MeshToFill& mesh, const Grid& grid, double scale,
                                        const RunContext& context);
/// The volume inside, where it is known exactly: of a closed mesh that does not cross itself. Model units cubed.
/// Errors: unsuitable, cancelled.
Result<std::optional<double>> exact_volume(const MeshToFill& mesh, const RunContext& context);
/// Makes the fractions of cells that are not whole larger or smaller by one factor, so that all cells together have
/// this volume (in cells' volumes), as far as limits of fractions let them: samples are few where a sheet is thin.
void match_volume(std::vector<Draft>& cells, double volume);
/// Adds cells for vertices and large triangles that no sampled cell holds; keeps the order of Cells.
void add_surface_cells(const MeshToFill& mesh, const Grid& grid, std::vector<Draft>& cells);

/// Whether each cell stays: those of unconnected groups that are not much smaller than the largest.
std::vector<std::uint8_t> without_loose_parts(const Cells& cells, std::size_t& loose_parts);
/// How many cells have no neighbour on either side along some axis.
std::size_t count_thin(const Cells& cells, const RunContext& context);

} // namespace filigree::mesh_cells
