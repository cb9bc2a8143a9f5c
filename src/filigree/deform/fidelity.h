// How close a driver's restored poses come to deforming the whole mesh, and the smallest driver that comes close
// enough.
#pragma once

#include "filigree/deform/space_warp.h"
#include "filigree/hierarchy/strip.h"

#include <string>

namespace filigree {

struct NamedWarp {
    std::string name;
    bool affine;
    std::unique_ptr<SpaceWarp> warp;
};

/// The family of deformations that fidelity is measured over, along the longest side of the box. Affine: stretches by 2
/// and by 0.5, a squeeze by 2. Curved: bends of 90 and 180 degrees, a twist of 180, a taper to 0.5, smooth random
/// displacements of 10 and 25 %.
std::vector<NamedWarp> fidelity_warps(const Box& box);

/// What a pose of the driver comes with.
enum class PoseSource { positions, gradients };

/// The largest error over the family's curved warps: rms over the vertices, of the mesh restored from the warped driver
/// against the mesh itself warped, as a fraction of the latter's diagonal. Errors: cancelled. Cost: six restores.
Result<double> fidelity(const Model& model, PoseSource source, const RunContext& context);

/// What a driver is good for: fidelity from positions alone, and with gradients.
struct DriverFidelity {
    double positions = 0, gradients = 0;
};

/// fidelity() from both sources, over all vertices or 65,536 drawn evenly from more: within a few per cent then.
/// Errors: cancelled. Cost: a GradientFit of the driver, and twelve restores of the vertices that are drawn.
Result<DriverFidelity> driver_fidelity(const Model& model, const RunContext& context);

struct FidelityGoal {
    double error = 1e-4; ///< as of fidelity(), above 0
    PoseSource source = PoseSource::positions;
};

struct StrippedToFidelity {
    Stripped stripped;
    double error = 0;   ///< reached
    unsigned tried = 0; ///< drivers
};

/// Strips with the smallest driver, to within 15 % of its vertices, whose fidelity is 1.4 times as good as the goal:
/// so other warps that are nowhere more curved are restored as well as asked too (`filigree bench goals`). The whole
/// mesh where nothing less will do; then `error` may be above the goal, which is below float's rounding. options: none
/// that says how coarse. Errors: as of strip; usage (a size given, a goal that is not above 0). Cost: about six times
/// strip and fidelity.
Result<StrippedToFidelity> strip_to_fidelity(const Mesh& mesh, const StripOptions& options, const FidelityGoal& goal,
                                             const RunContext& context);

} // namespace filigree
