// A body and its model that break along the same cells.
#pragma once

#include "filigree/fracture.h"
#include "filigree/fracture/broken_model.h"
#include "filigree/physics/world.h"

#include <memory>

namespace filigree {

/// Which piece carries what, of a body that breaks. Pieces are named by their cells.
struct CarriedByPieces {
    std::vector<Index> driver, vertices;               ///< the piece of each
    std::vector<std::uint8_t> driver_is_on_crack;      ///< see BrokenModel
    std::vector<Index> crack_of_face;                  ///< kNoIndex: a face of the surface
    std::vector<std::array<Index, 2>> pieces_of_crack; ///< ascending

    bool empty() const { return driver.empty(); }
};

/// A model whose mesh is in pieces, which nobody sees until they part.
struct ModelInPieces {
    Model model;
    CarriedByPieces carried;
    CutReport report;
};

/// whole: a blend model. crack_spacing: as of break_model. Cost, errors: as of fracture and break_model.
Result<ModelInPieces> cut_model(const Model& whole, const FractureCells& cells, double crack_spacing,
                                const RunContext& context);

/// How the body breaks. cells: in model units; scale: metres a model unit. Cost, errors: as of break_body.
Result<Fracture> make_fracture(std::shared_ptr<const Body> body, const std::shared_ptr<const FractureCells>& cells,
                               double scale, const FractureMaterial& material, const RunContext& context,
                               BrokenBodyReport* report = nullptr);

/// J/m^2: what a crack costs where nothing else is said. diagonal: of the body at rest, m.
double usual_fracture_energy(double strength, double young_modulus, double diagonal);

} // namespace filigree
