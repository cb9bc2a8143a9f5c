// Which points of a lattice are inside a closed mesh: row by row, exactly.
//
// p is inside when p + (e, e^2, e^3), e -> 0+, has odd crossing parity. The point is perturbed and not the mesh, along
// a direction that lies in no plane and on no line of the mesh. So there are no special cases, and the answer does not
// depend on the order of triangles, on threads or on the processor. A box of n^3 cells on the lattice gets n^3 points;
// bodies that share a face share no point and miss none.
#pragma once

#include "filigree/context.h"
#include "filigree/sample.h"
#include "filigree/sample/exact_sign.h"

namespace filigree {

/// Triangles as the scan takes them. Only coordinates count: vertices need not be shared, nor triangles turn the same
/// way (but for `merged` and scan_winding).
struct ScanMesh {
    std::span<const Vec3f> positions;
    std::span<const Triangle> triangles;
};

struct ScanOptions {
    Overlap overlap = Overlap::parity;
    std::size_t most_bytes = kMostLatticeBytes; ///< for all that the scan keeps
};

/// Bits of all lattice points. Does not look whether the mesh is closed: with an open one, rows may be filled to their
/// end. Memory: a bit a point, 4 bytes a vertex, and for `merged` 32 MiB (or a layer of 2 bytes a point, if that is
/// more); three times that where more than 32,767 surfaces lie between two points of a row. Uses AVX-512 or AVX2 where
/// the processor has them; the same bits without. Cost O(V + F + crossings + points / 64).
/// Errors: unsuitable (does not fit into `most_bytes`: says how much it would take; more than 65,534 points on an
/// axis), usage (coordinates that are not evenly spaced), cancelled.
Result<Occupancy> scan_inside(const ScanMesh& mesh, const Lattice& lattice, const ScanOptions& options,
                              const RunContext& context, ScanReport* report = nullptr);

/// Net signed crossings before each point (winding numbers for closed, oriented meshes), for the layers first_k ..
/// first_k + layers - 1 (as far as there are any): one int16 a point, rows along x without padding.
/// Errors: as scan_inside; unsuitable (a number does not fit: more than 32,767 surfaces, one within the other; the
/// layers take more than `most_bytes`: says how much).
Result<std::vector<std::int16_t>> scan_winding(const ScanMesh& mesh, const Lattice& lattice, std::size_t first_k,
                                               std::size_t layers, const RunContext& context,
                                               ScanReport* report = nullptr,
                                               std::size_t most_bytes = kMostLatticeBytes);

/// Vector widths this processor has an implementation for (2, 4 or 8 doubles), ascending, so that tests can hold them
/// against each other; scan_inside takes the last.
std::span<const int> scan_lane_counts();
Result<Occupancy> scan_inside_with_lanes(const ScanMesh& mesh, const Lattice& lattice, int lanes,
                                         const RunContext& context);

} // namespace filigree
