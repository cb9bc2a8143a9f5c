// How an error asked for is shared between a fit and the rounding of its packed model. Errors are fractions of the
// diagonal (rms), and add up as squares. Private to the library and its programs.
#pragma once

#include "filigree/mesh.h"

namespace filigree {

/// What is left for the fit (FitOptions::error): positions take a quarter of the error, poses a third.
double error_of_fit(double error);
/// What poses take (PackOptions::clip_error).
double error_of_poses(double error);
/// Bits of a position that round it to its share (PackOptions::bits): 12 to 16.
unsigned bits_of_positions(double error, const Mesh& mesh);

} // namespace filigree
