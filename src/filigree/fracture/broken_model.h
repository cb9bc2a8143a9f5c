// A model that breaks: it is bound once, as a whole, and moves piece by piece.
#pragma once

#include "filigree/fracture.h"
#include "filigree/strip.h"

namespace filigree {

/// A model of a mesh in pieces. Each piece has its own copies of the driver vertices that carry it. While copies are in
/// one place with one gradient, so is what they carry, to the bit: nothing shows until a crack opens.
struct BrokenModel {
    /// One level, the driver. Its vertices are vertices of the mesh: those of the unbroken model's driver in their own
    /// pieces, and loose ones, without a face, behind all others: copies for other pieces, and points on cracks.
    Model model;
    std::vector<Index> piece_of_driver;           ///< a driver vertex
    std::vector<std::uint8_t> driver_is_on_crack; ///< whether it is a point on a crack, and not of the unbroken driver
};

/// Breaks a model. fractured: its mesh, broken with pieces_are_cells. crack_spacing: distance between the driver's
/// points on cracks, model units; take about the edge length of the driver. Vertices of the unbroken mesh keep their
/// bonds. Crack points on the surface are bound like the first vertex of their edge. Crack points inside are bound to a
/// coarse triangulation of their crack, the same from both sides. Cost O(V). Errors: unsuitable (another mesh),
/// cancelled.
Result<BrokenModel> break_model(const Model& model, const FracturedMesh& fractured, const FractureCells& cells,
                                double crack_spacing, const RunContext& context);

/// One 0 or 1 for each of FracturedMesh::cells_of_crack, by the pieces of its cells, ascending: whether the driver's
/// points on it were ever further apart on its two sides than `apart`, in the poses' unit. A crack without such points
/// counts as open. piece_of_driver, driver_is_on_crack: as in BrokenModel. Cost O(cracks + frames x driver).
std::vector<std::uint8_t> open_cracks(const Model& broken, std::span<const Index> piece_of_driver,
                                      std::span<const std::uint8_t> driver_is_on_crack,
                                      std::span<const std::array<Index, 2>> pieces_of_crack,
                                      std::span<const Pose> frames, double apart);

/// Takes away the faces of cracks that never opened. The mesh is not checked. crack_of_face, is_open: of FracturedMesh
/// and open_cracks. Vertices stay, so that every frame has the same ones.
void drop_closed_cracks(Mesh& mesh, std::span<const Index> crack_of_face, std::span<const std::uint8_t> is_open);

} // namespace filigree
