// The inner loops of the scan: lower bounds of vertices, and crossings of triangles with lattice rows, two, four or
// eight at a time.
#pragma once

#include "filigree/mesh.h"
#include "filigree/sample/exact_sign.h"

#include <atomic>
#include <span>
#include <vector>

namespace filigree::scan_kernel {

/// The lattice's coordinates on one axis, evenly spaced up to less than a quarter of the spacing. `values` is padded,
/// so that a whole vector can be read from any index.
struct Axis {
    std::vector<double> values;
    std::size_t count = 0;
    double first = 0, step = 0, inverse_step = 0;
    bool computable = false; ///< values[i] == first + i * step, to the bit

    static constexpr std::size_t kPadding = 8;
};

/// What all pieces of a scan share. A triangle's crossing with row (j, k) goes to entry I = first point at or beyond
/// it: in `bits` (toggled) or in `crossings` (plus one where the row enters, minus one where it leaves), whichever is
/// not null; entries begin at layer first_k.
struct Job {
    const Vec3f* positions = nullptr;
    const Triangle* triangles = nullptr;
    const std::uint32_t* codes = nullptr; ///< of vertices: see encode
    Axis axes[3];
    std::size_t first_k = 0, end_k = 0;
    std::size_t row_entries = 0; ///< from one row to the next
    std::uint64_t* bits = nullptr;
    std::int16_t* crossings = nullptr;
    std::atomic<bool>* has_wrapped = nullptr; ///< beside `crossings`: set where one of them went past 16 bits
    bool shared = false;                      ///< several threads write
};

/// Layers [k_begin, k_end) of a triangle with many rows, left for later so that threads can share it.
struct LargeTriangle {
    Index triangle;
    std::uint32_t k_begin, k_end;
};

/// What one piece of the work counts and leaves.
struct Piece {
    std::uint64_t crossings = 0;
    exact::Tally tally;
    std::vector<LargeTriangle> large;
};

/// Loops for one vector width. Their results never differ.
struct Loops {
    /// codes[v] = J | K << 16 for vertices begin .. end - 1: the first row at or above the vertex in y, the first layer
    /// in z.
    void (*encode)(const Job&, std::uint32_t* codes, std::size_t begin, std::size_t end);
    void (*scan_triangles)(const Job&, std::size_t begin, std::size_t end, Piece&);
    void (*scan_large)(const Job&, std::span<const LargeTriangle>, Piece&);
};

/// Doubles at a time that this processor has an implementation for, ascending.
std::span<const int> lane_counts();
Loops loops(int lanes);

} // namespace filigree::scan_kernel
