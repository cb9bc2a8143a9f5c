// Memory for decisions about a lattice.
#pragma once

#include "filigree/sample.h"

namespace filigree {

/// Whether so many bytes for a lattice are no more than allowed. Errors: unsuitable (says how much).
Status check_lattice_bytes(const Lattice& lattice, double bytes, std::size_t most_bytes);

/// An occupancy with no point inside. other_bytes: what the caller needs beside the bits.
/// Errors: unsuitable (bits and other bytes are more than most_bytes: says how much).
Result<Occupancy> make_occupancy(const Lattice& lattice, double other_bytes = 0,
                                 std::size_t most_bytes = kMostLatticeBytes);

} // namespace filigree
