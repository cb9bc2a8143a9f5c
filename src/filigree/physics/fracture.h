// How and when matter breaks.
#pragma once

#include "filigree/physics/broken_body.h"

#include <limits>
#include <string>

namespace filigree {

/// What a crack needs to begin and to grow.
struct FractureMaterial {
    double strength = 1e6; ///< Pa: the traction at which two pieces let go of each other, above 0
    double scatter = 0;    ///< 0 .. 1: relative standard deviation of the strengths of pairs of pieces (Weibull), about
    double energy = 10;    ///< J/m^2 of crack, above 0
    /// m, above 0: of matter that yields, how far a layer a cell thick may have opened for good before it lets go
    double plastic_opening = std::numeric_limits<double>::infinity();
    std::uint64_t seed = 0; ///< of the scatter
};

/// Pieces that let go at a time, whatever pulls them.
struct FractureEvent {
    double time = 0;              ///< s
    std::vector<Index> pieces;    ///< of the partition: what holds these to others; empty: any
    std::vector<Index> particles; ///< of the whole body: only there; empty: everywhere
};

/// That an actor's body breaks.
struct Fracture {
    std::shared_ptr<const BrokenBody> body; ///< of the actor's body
    FractureMaterial material;
    std::vector<FractureEvent> events;
};

/// How far a body is broken.
struct FractureReport {
    bool breaks = false; ///< it can
    std::size_t pieces = 0;
    std::size_t parts = 0;                                  ///< that hang together
    double first = std::numeric_limits<double>::infinity(); ///< s: when the first crack began
    double crack_area = 0;                                  ///< m^2 between pieces
    double broken_area = 0;                                 ///< m^2 of it that does not hold at its strength any more
    double dissipated = 0;                                  ///< J
    std::vector<double> broke;                              ///< s, of each piece with matter: when it began to come off
};

/// The first thing wrong, as a sentence that names the quantity, or "".
std::string check_fracture(const FractureMaterial& material);

} // namespace filigree
