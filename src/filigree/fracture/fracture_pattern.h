// Where matter breaks: seeds for the cells of a fracture.
#pragma once

#include "filigree/fracture/fracture_cells.h"
#include "filigree/mesh/mesh.h"

#include <optional>

namespace filigree {

/// even: pieces of about one size. impact: small ones around points, large ones far away. slabs: long ones along the
/// grain, as of wood. radial: rays and rings around a point, through the whole thickness, as of glass. grains: small in
/// some places and large in others, by a noise, as of stone.
enum class FracturePatternKind { even, impact, slabs, radial, grains };

struct FracturePattern {
    FracturePatternKind kind = FracturePatternKind::even;
    Index pieces = 20;          ///< that hold matter; about as many for radial. pieces x clump: 1 to
                                ///< FractureCells::kMostSeeds
    Index clump = 1;            ///< cells that a piece is made of, neighbours all; 1 to kMostClump
    std::vector<Vec3d> at = {}; ///< impact and radial: points that were hit, relative to the mesh's origin; none: a
                                ///< corner of the mesh (impact), its middle (radial, which takes the first)
    std::optional<Vec3d> grain = {}; ///< slabs: along which pieces are longer (unset: the mesh's longest axis)
    double stretch = 6;              ///< slabs: how many times longer, 1 to 100
    double roughness = 0.5;          ///< of cracks, 0 (planes) to 1

    static constexpr Index kMostClump = 100;
};

/// Cells for a mesh. Seeds are drawn from points inside it (from its surface where it has no inside) by the context's
/// seed. Of `even` and `slabs`, cells are made alike by three rounds of Lloyd's method: the smallest has about a third
/// of the median volume; of `grains`, the noise makes cells per volume differ by a factor of e^4 at most. Clumps: the
/// one of the fewest cells joins a neighbour of the fewest until as many are left as pieces were asked for; none has
/// more than three times `clump` cells unless matter hangs together too little. Cost: 100 points a piece, and the
/// cells'. Errors: usage (counts and shares out of range, points that are not finite; check_mesh refuses the mesh),
/// unsuitable (no faces), cancelled.
Result<FractureCells> make_fracture_cells(const Mesh& mesh, const FracturePattern& pattern, const RunContext& context);

} // namespace filigree
