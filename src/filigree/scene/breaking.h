// A body and its model that break along the same cells.
#pragma once

#include "filigree/fracture.h"
#include "filigree/fracture/broken_model.h"
#include "filigree/physics/world.h"

#include <memory>

namespace filigree {

/// The piece that carries each vertex of a body that breaks. Pieces are numbered as their cells are.
struct CarriedByPieces {
    std::vector<Index> driver, vertices;               ///< piece of each vertex of the driver, of the mesh
    std::vector<std::uint8_t> driver_is_on_crack;      ///< see BrokenModel
    std::vector<Index> crack_of_face;                  ///< kNoIndex: a face of the surface
    std::vector<std::array<Index, 2>> pieces_of_crack; ///< ascending

    bool empty() const { return driver.empty(); }
};

/// A model whose mesh is cut into pieces. The cracks are closed until pieces part.
struct ModelInPieces {
    Model model;
    CarriedByPieces carried;
    CutReport report;
};

/// Cuts a blend model along cells. crack_spacing: see break_model, as do cost and errors.
Result<ModelInPieces> cut_model(const Model& whole, const FractureCells& cells, double crack_spacing,
                                const RunContext& context);

/// How the body breaks along cells. cells: in model units. scale: metres a model unit. Cost and errors: see break_body.
Result<Fracture> make_fracture(std::shared_ptr<const Body> body, const std::shared_ptr<const FractureCells>& cells,
                               double scale, const FractureMaterial& material, const RunContext& context,
                               BrokenBodyReport* report = nullptr);

/// Energy of a crack by its area where the user gives none, J/m^2. diagonal: of the body at rest, m.
double usual_fracture_energy(double strength, double young_modulus, double diagonal);

} // namespace filigree
