// One body for every vector width: eight doubles with AVX-512, four with AVX2, two elsewhere, chosen when the program
// runs. Doubles only propose. What they cannot certify (a value nearer to a decision than its error bound) is decided
// by exact signs, so widths, threads and the order of triangles cannot show in the result.
//
// The error bounds are in units of u = 2^-53 and were derived for plain rounding of every operation; they are generous
// by about two, so terms of second order need no care.
#include "filigree/sample/inside_scan_kernel.h"

#include "filigree/core/atomic_ref.h"
#include "filigree/core/lanes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <utility>

namespace filigree::scan_kernel {

namespace {

constexpr double kUnit = 0x1p-53;
constexpr double kOrientError = 3.4e-16;      // of the permanent, for a determinant of differences [Shewchuk 1997]
constexpr double kEdgeError = 8 * kUnit;      // of |a.y| + |b.y|, for a point between a and b
constexpr double kPlaneError = 20 * kUnit;    // of the plane's permanents over |n.x|
constexpr double kOffsetError = 4 * kUnit;    // of |a.x| and of the offset from it
constexpr double kNormalTrusted = 16 * kUnit; // of n.x's permanent: above, n.x has the right sign and a few right bits

constexpr double kRound = 0x1.8p52; // added and taken off again, it rounds to an integer

constexpr std::uint32_t kSmallWidth = 4;  // rows and layers a triangle may span to be handled beside others
constexpr std::uint64_t kLargeRows = 512; // beyond, a triangle is left for later

using Point = std::array<double, 3>;

Vec3d vec(const Point& p) { return {p[0], p[1], p[2]}; }

// ---- one value at a time

/// Smallest i with values[i] >= v. The nearest index is at most one off, as values are evenly spaced.
FILIGREE_INLINE std::uint32_t lower_bound(const Axis& axis, double v) {
    double t = (v - axis.first) * axis.inverse_step;
    t = t > 0 ? t : 0;
    const double last = double(axis.count - 1);
    t = t < last ? t : last;
    const std::uint32_t nearest = std::uint32_t(t + 0.5);
    return nearest + (axis.values[nearest] < v);
}

/// The same for a v known up to `error` only, or -1 where that leaves two answers.
FILIGREE_INLINE int lower_bound(const Axis& axis, double v, double error) {
    const std::uint32_t bound = lower_bound(axis, v);
    // compared with what is stored: both neighbours of the answer have to be farther than the error
    const bool certain =
        (bound == 0 || v - axis.values[bound - 1] > error) && (bound == axis.count || axis.values[bound] - v > error);
    return certain ? int(bound) : -1;
}

/// A triangle in double, with the bounds of its vertices.
struct Corners {
    Point p[3];
    std::uint32_t y[3], z[3];

    Corners(const Job& job, Index triangle) {
        for (int v = 0; v < 3; ++v) {
            const Index vertex = job.triangles[triangle][v];
            for (int axis = 0; axis < 3; ++axis) p[v][axis] = double(job.positions[vertex][axis]);
            y[v] = job.codes[vertex] & 0xffff;
            z[v] = job.codes[vertex] >> 16;
        }
    }
};

/// Smallest value in [low, high] from which `is_reached` holds; it does at `high` and beyond. Looks near `guess` first.
template <class IsReached>
std::uint32_t first_reached(std::uint32_t low, std::uint32_t high, std::uint32_t guess, const IsReached& is_reached) {
    guess = std::clamp(guess, low, high);
    for (std::uint32_t probe : {guess, guess + 1, guess - 1}) {
        if (probe < low || probe >= high) continue; // guess - 1 may have wrapped round
        is_reached(probe) ? high = probe : low = probe + 1;
    }
    while (low < high) {
        const std::uint32_t middle = low + (high - low) / 2;
        is_reached(middle) ? high = middle : low = middle + 1;
    }
    return low;
}

/// The rows of layer k on the far side of an edge begin here: smallest j with (Y[j], Z[k]) on it or beyond in y.
/// The edge spans the layer, a below or in it and b above.
std::uint32_t edge_bound(const Job& job, const Corners& corners, int a, int b, double z, exact::Tally& tally) {
    const std::uint32_t low = std::min(corners.y[a], corners.y[b]), high = std::max(corners.y[a], corners.y[b]);
    if (low == high) return low;
    const Axis& axis = job.axes[1];
    const Point &pa = corners.p[a], &pb = corners.p[b];
    const double y = pa[1] + (z - pa[2]) * (pb[1] - pa[1]) / (pb[2] - pa[2]);
    const int certain = lower_bound(axis, y, kEdgeError * (std::abs(pa[1]) + std::abs(pb[1])));
    if (certain >= 0) return std::uint32_t(certain);
    return first_reached(low, high, lower_bound(axis, y), [&](std::uint32_t j) {
        // (Y - a.y)(b.z - a.z) - (Z - a.z)(b.y - a.y), that is orient2d in (z, y) order
        return exact::orient2d({pa[2], pa[1]}, {pb[2], pb[1]}, {z, axis.values[j]}, &tally) >= 0;
    });
}

/// The plane over (y, z): x = a.x + gy (y - a.y) + gz (z - a.z), and how far off that can be.
struct Plane {
    double gy, gz, error_y, error_z;
    bool is_trusted; ///< else n.x is lost in rounding
    bool leaves;     ///< n.x > 0: rows go out of the body here; valid where trusted
};

Plane plane_of(const Corners& corners) {
    const Point &a = corners.p[0], &b = corners.p[1], &c = corners.p[2];
    double normal[3], permanent[3];
    for (int axis = 0; axis < 3; ++axis) {
        const int i = (axis + 1) % 3, j = (axis + 2) % 3;
        const double plus = (b[i] - a[i]) * (c[j] - a[j]), minus = (b[j] - a[j]) * (c[i] - a[i]);
        normal[axis] = plus - minus;
        permanent[axis] = std::abs(plus) + std::abs(minus);
    }
    Plane plane;
    const double inverse = 1 / normal[0], size = std::abs(inverse) * kPlaneError;
    plane.gy = -normal[1] * inverse;
    plane.gz = -normal[2] * inverse;
    plane.error_y = size * (permanent[1] + std::abs(plane.gy) * permanent[0]);
    plane.error_z = size * (permanent[2] + std::abs(plane.gz) * permanent[0]);
    plane.is_trusted = std::abs(normal[0]) > kNormalTrusted * permanent[0];
    plane.leaves = normal[0] > 0;
    return plane;
}

/// First point of row (y, z) on the triangle's plane or beyond, exactly. `guess` is where to look first.
std::uint32_t plane_bound(const Job& job, const Corners& corners, double y, double z, double x, int sign,
                          exact::Tally& tally) {
    const Axis& axis = job.axes[0];
    std::uint32_t low = std::uint32_t(axis.count), high = 0;
    for (const Point& p : corners.p) {
        const std::uint32_t bound = lower_bound(axis, p[0]);
        low = std::min(low, bound);
        high = std::max(high, bound);
    }
    if (low >= high) return low;
    const Vec3d a = vec(corners.p[0]), b = vec(corners.p[1]), c = vec(corners.p[2]);
    return first_reached(low, high, lower_bound(axis, x), [&](std::uint32_t i) {
        return sign * exact::orient3d(a, b, c, {axis.values[i], y, z}, &tally) >= 0;
    });
}

void put(const Job& job, std::size_t entry, bool leaves) {
    if (job.bits) {
        std::uint64_t& word = job.bits[entry >> 6];
        const std::uint64_t bit = std::uint64_t{1} << (entry & 63);
        if (job.shared)
            atomic_ref(word).fetch_xor(bit, std::memory_order_relaxed);
        else
            word ^= bit;
    } else {
        std::int16_t& sum = job.crossings[entry];
        const std::int16_t change = leaves ? -1 : 1;
        std::int16_t before;
        if (job.shared)
            before = atomic_ref(sum).fetch_add(change, std::memory_order_relaxed);
        else {
            before = sum;
            sum = std::int16_t(sum + change);
        }
        if (before == (leaves ? INT16_MIN : INT16_MAX)) [[unlikely]]
            job.has_wrapped->store(true, std::memory_order_relaxed);
    }
}

std::size_t row_entry(const Job& job, std::size_t j, std::size_t k) {
    return ((k - job.first_k) * job.axes[1].count + j) * job.row_entries;
}

/// Row (j, k) and a triangle, by exact signs alone: for the few that the filters leave open.
[[gnu::noinline]] void scan_row_exactly(const Job& job, Index triangle, std::uint32_t j, std::uint32_t k,
                                        Piece& piece) {
    const Corners corners(job, triangle);
    const double y = job.axes[1].values[j], z = job.axes[2].values[k];
    bool crosses = false;
    for (int e = 0; e < 3; ++e) {
        int a = e, b = (e + 1) % 3;
        if (corners.z[a] > corners.z[b]) std::swap(a, b);
        if (corners.z[a] <= k && k < corners.z[b]) crosses ^= j >= edge_bound(job, corners, a, b, z, piece.tally);
    }
    if (!crosses) return;
    ++piece.crossings;
    const Plane plane = plane_of(corners);
    const Point& a = corners.p[0];
    const int sign = plane.is_trusted
                         ? (plane.leaves ? 1 : -1)
                         : exact::normal_signs(vec(a), vec(corners.p[1]), vec(corners.p[2]), &piece.tally)[0];
    const double x = a[0] + (plane.gy * (y - a[1]) + plane.gz * (z - a[2]));
    const std::uint32_t i = plane_bound(job, corners, y, z, x, sign, piece.tally);
    if (i < job.axes[0].count) put(job, row_entry(job, j, k) + i, sign > 0);
}

// ---- N values at a time

template <int N>
struct ScanLanes : DoubleLanes<N> {
    using typename DoubleLaneTypes<N>::Double;

    static FILIGREE_INLINE Double all(double x) { return Double{} + x; }
    static FILIGREE_INLINE Double abs(Double x) { return x < 0 ? -x : x; }

    /// values[i] for whole numbers i.
    static FILIGREE_INLINE Double at(const Axis& axis, Double i) {
        if (axis.computable) return axis.first + i * axis.step;
        Double result = {};
        for (int l = 0; l < N; ++l) result[l] = axis.values[std::size_t(i[l])];
        return result;
    }
    static FILIGREE_INLINE Double nearest(const Axis& axis, Double v) {
        Double t = (v - axis.first) * axis.inverse_step;
        t = t > 0 ? t : Double{}; // and NaN becomes 0
        const Double last = all(double(axis.count - 1));
        t = t < last ? t : last;
        return (t + kRound) - kRound;
    }
    static FILIGREE_INLINE Double lower_bound(const Axis& axis, Double v) {
        const Double i = nearest(axis, v);
        return i + (at(axis, i) < v ? all(1) : Double{});
    }

    /// Coordinate `axis` of N positions end to end.
    static FILIGREE_INLINE Double coordinate(const float* positions, int axis) {
        Double result = {};
        for (int l = 0; l < N; ++l) result[l] = double(positions[3 * l + axis]);
        return result;
    }
};

template <int N>
FILIGREE_INLINE void encode_lanes(const Job& job, std::uint32_t* codes, std::size_t begin, std::size_t end) {
    using L = ScanLanes<N>;
    std::size_t v = begin;
    for (; v + N <= end; v += N) {
        const float* const p = job.positions[v].data();
        // J + 65536 K is a whole number far below 2^53
        const auto code = L::lower_bound(job.axes[1], L::coordinate(p, 1)) +
                          L::lower_bound(job.axes[2], L::coordinate(p, 2)) * 65536.0;
        const auto shifted = __builtin_convertvector(code - 0x1p31, typename L::Int); // to the range of a signed int
        for (int l = 0; l < N; ++l) codes[v + std::size_t(l)] = std::uint32_t(shifted[l]) + 0x80000000u;
    }
    for (; v < end; ++v)
        codes[v] = lower_bound(job.axes[1], double(job.positions[v][1])) |
                   lower_bound(job.axes[2], double(job.positions[v][2])) << 16;
}

/// Entries to be written, end to end.
struct Entries {
    static constexpr std::size_t kRoom = 8 * kSmallWidth * kSmallWidth;
    double entry[kRoom + 8];
    double leaves[kRoom + 8];
    std::size_t count = 0;

    template <int N, bool Signed>
    FILIGREE_INLINE void append(typename ScanLanes<N>::Double e, typename ScanLanes<N>::Double side,
                                typename ScanLanes<N>::Mask wanted) {
        alignas(64) double all_e[N], all_side[N];
        alignas(64) std::int64_t all_wanted[N];
        std::memcpy(all_e, &e, sizeof e);
        std::memcpy(all_wanted, &wanted, sizeof wanted);
        if constexpr (Signed) std::memcpy(all_side, &side, sizeof side);
        for (int l = 0; l < N; ++l) { // without a branch: whether a lane crosses cannot be foreseen
            entry[count] = all_e[l];
            if constexpr (Signed) leaves[count] = all_side[l];
            count -= std::size_t(all_wanted[l]);
        }
    }
    template <bool Signed>
    FILIGREE_INLINE void write(const Job& job) {
        for (std::size_t n = 0; n < count; ++n) put(job, std::size_t(entry[n]), Signed && leaves[n] > 0);
        count = 0;
    }
};

/// Small triangles that span the same number of rows and layers, so that lanes have the same work.
struct SmallTriangles {
    static constexpr std::size_t kRoom = 64;
    Index triangle[kRoom];
    std::uint16_t j[kRoom], k[kRoom];
    std::size_t count = 0;
};

template <int N>
FILIGREE_INLINE bool any(typename ScanLanes<N>::Mask mask) {
    std::int64_t result = 0;
    for (int l = 0; l < N; ++l) result |= mask[l];
    return result != 0;
}

/// All rows of a shape against all of its triangles. What is not certain goes to scan_row_exactly.
template <int N, bool Signed>
FILIGREE_INLINE void scan_small(const Job& job, SmallTriangles& small, std::uint32_t width_j, std::uint32_t width_k,
                                Piece& piece) {
    using L = ScanLanes<N>;
    using Double = typename L::Double;
    using Mask = typename L::Mask;
    constexpr std::size_t kRoom = SmallTriangles::kRoom;
    alignas(64) float corner[3][3][kRoom];
    alignas(64) double row_j[kRoom], row_k[kRoom];
    const std::size_t padded = (small.count + N - 1) / N * N;
    for (std::size_t t = 0; t < padded; ++t) {
        const std::size_t s = t < small.count ? t : 0;
        row_j[t] = small.j[s];
        row_k[t] = small.k[s];
        const Triangle& triangle = job.triangles[small.triangle[s]];
        for (int v = 0; v < 3; ++v) {
            // past the end: a single point, which no row crosses
            const float* const p = job.positions[triangle[t < small.count ? v : 0]].data();
            for (int axis = 0; axis < 3; ++axis) corner[v][axis][t] = p[axis];
        }
    }

    const Axis &axis_x = job.axes[0], &axis_y = job.axes[1], &axis_z = job.axes[2];
    const double layer_entries = double(axis_y.count) * double(job.row_entries), row_entries = double(job.row_entries);
    Entries entries;
    Mask crossings = {};
    for (std::size_t t = 0; t < padded; t += N) {
        Double p[3][3];
        for (int v = 0; v < 3; ++v)
            for (int axis = 0; axis < 3; ++axis) p[v][axis] = L::load(&corner[v][axis][t]);
        Double edge_y[3], edge_z[3];
        for (int e = 0; e < 3; ++e) {
            edge_y[e] = p[(e + 1) % 3][1] - p[e][1];
            edge_z[e] = p[(e + 1) % 3][2] - p[e][2];
        }
        // the plane, as in plane_of
        const Double edge_x[2] = {p[1][0] - p[0][0], p[2][0] - p[0][0]};
        const Double far_y = p[2][1] - p[0][1], far_z = p[2][2] - p[0][2];
        const Double x1 = edge_y[0] * far_z, x2 = edge_z[0] * far_y, y1 = edge_z[0] * edge_x[1], y2 = edge_x[0] * far_z,
                     z1 = edge_x[0] * far_y, z2 = edge_y[0] * edge_x[1];
        const Double normal_x = x1 - x2, permanent_x = L::abs(x1) + L::abs(x2);
        const Double inverse = 1.0 / normal_x, size = L::abs(inverse) * kPlaneError;
        const Double gy = (y2 - y1) * inverse, gz = (z2 - z1) * inverse;
        const Double error_y = size * (L::abs(y1) + L::abs(y2) + L::abs(gy) * permanent_x);
        const Double error_z = size * (L::abs(z1) + L::abs(z2) + L::abs(gz) * permanent_x);
        const Double error_a = kOffsetError * L::abs(p[0][0]);
        const Mask trusted = L::abs(normal_x) > kNormalTrusted * permanent_x;

        const Double j0 = L::load(row_j + t), k0 = L::load(row_k + t);
        const Double first_entry = (k0 - double(job.first_k)) * layer_entries + j0 * row_entries;
        Mask open[kSmallWidth * kSmallWidth];
        Mask any_open = {};
        for (std::uint32_t dk = 0; dk < width_k; ++dk) {
            const Double z = L::at(axis_z, k0 + double(dk));
            Double from_z[3];
            for (int v = 0; v < 3; ++v) from_z[v] = z - p[v][2];
            Mask spans[3];
            for (int e = 0; e < 3; ++e) spans[e] = (from_z[e] >= 0) ^ (from_z[(e + 1) % 3] >= 0);
            for (std::uint32_t dj = 0; dj < width_j; ++dj) {
                const Double y = L::at(axis_y, j0 + double(dj));
                Mask crosses = {}, unsure = {};
                for (int e = 0; e < 3; ++e) {
                    // positive where the row is beyond an edge that goes up in z
                    const Double beyond = (y - p[e][1]) * edge_z[e], below = from_z[e] * edge_y[e];
                    const Double side = beyond - below;
                    crosses ^= spans[e] & ((side >= 0) ^ (edge_z[e] < 0));
                    unsure |= spans[e] & (L::abs(side) <= kOrientError * (L::abs(beyond) + L::abs(below)));
                }
                const Double from_y = y - p[0][1];
                const Double offset = gy * from_y + gz * from_z[0], x = p[0][0] + offset;
                const Double error =
                    error_y * L::abs(from_y) + error_z * L::abs(from_z[0]) + kOffsetError * L::abs(offset) + error_a;
                const Double nearest = L::nearest(axis_x, x), gap = x - L::at(axis_x, nearest);
                const Mask certain = trusted & (L::abs(gap) > error);
                const Double i = nearest + (gap > 0 ? L::all(1) : Double{});
                unsure |= crosses & ~certain;
                crosses &= ~unsure;
                crossings -= crosses;
                any_open |= unsure;
                open[dk * width_j + dj] = unsure;
                const Double entry = first_entry + (double(dk) * layer_entries + double(dj) * row_entries) + i;
                entries.append<N, Signed>(entry, normal_x, crosses & (i < double(axis_x.count)));
            }
        }
        entries.write<Signed>(job);
        if (any<N>(any_open)) [[unlikely]]
            for (std::uint32_t row = 0; row < width_k * width_j; ++row)
                for (std::size_t l = 0; l < N; ++l)
                    if (open[row][l] && t + l < small.count)
                        scan_row_exactly(job, small.triangle[t + l], small.j[t + l] + row % width_j,
                                         small.k[t + l] + row / width_j, piece);
    }
    for (int l = 0; l < N; ++l) piece.crossings += std::uint64_t(crossings[l]);
    small.count = 0;
}

/// A triangle that spans many rows: layer by layer, N rows at a time.
template <int N, bool Signed>
FILIGREE_INLINE void scan_layers(const Job& job, Index triangle, std::uint32_t k_begin, std::uint32_t k_end,
                                 Piece& piece) {
    using L = ScanLanes<N>;
    using Double = typename L::Double;
    using Mask = typename L::Mask;
    const Corners corners(job, triangle);
    const Plane plane = plane_of(corners);
    const Point& a = corners.p[0];
    const Axis &axis_x = job.axes[0], &axis_y = job.axes[1];
    const std::uint32_t bounds[3] = {lower_bound(axis_x, a[0]), lower_bound(axis_x, corners.p[1][0]),
                                     lower_bound(axis_x, corners.p[2][0])};
    const bool same_bound = bounds[0] == bounds[1] && bounds[0] == bounds[2];
    Double lane;
    for (int l = 0; l < N; ++l) lane[l] = l;
    Entries entries;

    for (std::uint32_t k = k_begin; k < k_end; ++k) {
        const double z = job.axes[2].values[k], from_z = z - a[2];
        std::uint32_t j_begin = 0, j_end = 0;
        bool first = true, leaves = false;
        for (int e = 0; e < 3; ++e) {
            int from = e, to = (e + 1) % 3;
            const bool up = corners.z[from] <= corners.z[to];
            if (!up) std::swap(from, to);
            if (corners.z[from] > k || k >= corners.z[to]) continue;
            const std::uint32_t j = edge_bound(job, corners, from, to, z, piece.tally);
            if (first) {
                j_begin = j_end = j;
                leaves = !up;
            } else if (j < j_begin) {
                j_begin = j;
                leaves = !up;
            } else {
                j_end = j;
            }
            first = false;
        }
        if (j_begin >= j_end) continue;
        piece.crossings += j_end - j_begin;
        const std::size_t row = row_entry(job, 0, k);
        if (same_bound) {
            if (bounds[0] < axis_x.count)
                for (std::uint32_t j = j_begin; j < j_end; ++j) put(job, row + j * job.row_entries + bounds[0], leaves);
            continue;
        }
        const double error_z = plane.error_z * std::abs(from_z) + kOffsetError * std::abs(a[0]);
        for (std::uint32_t j = j_begin; j < j_end; j += N) {
            const Double from_y = L::load(&axis_y.values[j]) - a[1];
            const Double offset = plane.gy * from_y + plane.gz * from_z, x = a[0] + offset;
            const Double error = plane.error_y * L::abs(from_y) + kOffsetError * L::abs(offset) + error_z;
            const Double nearest = L::nearest(axis_x, x), gap = x - L::at(axis_x, nearest);
            const Double i = nearest + (gap > 0 ? L::all(1) : Double{});
            const Mask in_range = lane < double(j_end - j);
            const Mask certain = plane.is_trusted ? L::abs(gap) > error : Mask{};
            const Mask unsure = in_range & ~certain;
            const Double entry = double(row) + (lane + double(j)) * double(job.row_entries) + i;
            entries.append<N, Signed>(entry, L::all(leaves ? 1 : -1), in_range & certain & (i < double(axis_x.count)));
            entries.write<Signed>(job);
            if (any<N>(unsure)) [[unlikely]]
                for (std::uint32_t l = 0; l < N; ++l)
                    if (unsure[l]) {
                        const std::uint32_t bound =
                            plane_bound(job, corners, axis_y.values[j + l], z, x[l], leaves ? 1 : -1, piece.tally);
                        if (bound < axis_x.count) put(job, row + (j + l) * job.row_entries + bound, leaves);
                    }
        }
    }
}

/// Triangles that a row may cross, and the rows and layers they span.
struct Candidates {
    static constexpr std::size_t kRoom = 1024;
    Index triangle[kRoom];
    std::uint32_t j[kRoom], j_end[kRoom], k[kRoom], k_end[kRoom];
    std::size_t count = 0;
};

/// Finds them without a branch: triangles between two rows or two layers, and most are, are crossed by none. In a slab,
/// also those wholly below or above it.
template <bool Slab>
[[gnu::noinline]] void find_candidates(const Job& job, std::size_t begin, std::size_t end, Candidates& found) {
    const std::uint32_t first_k = std::uint32_t(job.first_k), end_k = std::uint32_t(job.end_k);
    // K is in the upper half of a code, so whole codes are in its order
    const auto lowest = [](auto a, auto b, auto c) { return std::min(std::min(a, b), c); };
    const auto highest = [](auto a, auto b, auto c) { return std::max(std::max(a, b), c); };
    found.count = 0;
    for (std::size_t t = begin; t < end; ++t) {
        const Triangle& triangle = job.triangles[t];
        const std::uint32_t a = job.codes[triangle[0]], b = job.codes[triangle[1]], c = job.codes[triangle[2]];
        const std::uint32_t differ = (a ^ b) | (a ^ c);
        std::size_t wanted = std::size_t((differ & 0xffff) != 0) & std::size_t(differ >> 16 != 0);
        if constexpr (Slab)
            wanted &= std::size_t(lowest(a, b, c) >> 16 < end_k) & std::size_t(highest(a, b, c) >> 16 > first_k);
        found.triangle[found.count] = Index(t);
        found.j[found.count] = a;
        found.k[found.count] = b;
        found.k_end[found.count] = c;
        found.count += wanted;
    }
    for (std::size_t n = 0; n < found.count; ++n) {
        const std::uint32_t a = found.j[n], b = found.k[n], c = found.k_end[n];
        found.j[n] = lowest(a & 0xffff, b & 0xffff, c & 0xffff);
        found.j_end[n] = highest(a & 0xffff, b & 0xffff, c & 0xffff);
        found.k[n] = std::max(lowest(a, b, c) >> 16, first_k);
        found.k_end[n] = std::min(highest(a, b, c) >> 16, end_k);
    }
}

template <int N, bool Signed>
FILIGREE_INLINE void scan_triangles_lanes(const Job& job, std::size_t begin, std::size_t end, Piece& piece) {
    Candidates found;
    SmallTriangles small[kSmallWidth][kSmallWidth]; // by layers - 1 and rows - 1
    const bool is_slab = job.first_k > 0 || job.end_k < job.axes[2].count;
    for (std::size_t block = begin; block < end; block += Candidates::kRoom) {
        (is_slab ? find_candidates<true> : find_candidates<false>)(job, block, std::min(end, block + Candidates::kRoom),
                                                                   found);
        for (std::size_t n = 0; n < found.count; ++n) {
            const Index triangle = found.triangle[n];
            const std::uint32_t width_j = found.j_end[n] - found.j[n], width_k = found.k_end[n] - found.k[n];
            if (width_j <= kSmallWidth && width_k <= kSmallWidth) {
                SmallTriangles& shape = small[width_k - 1][width_j - 1];
                shape.triangle[shape.count] = triangle;
                shape.j[shape.count] = std::uint16_t(found.j[n]);
                shape.k[shape.count] = std::uint16_t(found.k[n]);
                if (++shape.count == SmallTriangles::kRoom) scan_small<N, Signed>(job, shape, width_j, width_k, piece);
            } else if (std::uint64_t{width_j} * width_k <= kLargeRows) {
                scan_layers<N, Signed>(job, triangle, found.k[n], found.k_end[n], piece);
            } else {
                const std::uint32_t layers = std::uint32_t(std::max<std::uint64_t>(1, 8 * kLargeRows / width_j));
                for (std::uint32_t k = found.k[n]; k < found.k_end[n]; k += layers)
                    piece.large.push_back({triangle, k, std::min(k + layers, found.k_end[n])});
            }
        }
    }
    for (std::uint32_t k = 0; k < kSmallWidth; ++k)
        for (std::uint32_t j = 0; j < kSmallWidth; ++j)
            if (small[k][j].count > 0) scan_small<N, Signed>(job, small[k][j], j + 1, k + 1, piece);
}

template <int N>
FILIGREE_INLINE void scan_triangles_any(const Job& job, std::size_t begin, std::size_t end, Piece& piece) {
    job.bits ? scan_triangles_lanes<N, false>(job, begin, end, piece)
             : scan_triangles_lanes<N, true>(job, begin, end, piece);
}

template <int N>
FILIGREE_INLINE void scan_large_any(const Job& job, std::span<const LargeTriangle> large, Piece& piece) {
    for (const LargeTriangle& t : large)
        job.bits ? scan_layers<N, false>(job, t.triangle, t.k_begin, t.k_end, piece)
                 : scan_layers<N, true>(job, t.triangle, t.k_begin, t.k_end, piece);
}

#define FILIGREE_LOOPS(NAME, N, TARGET)                                                                                \
    TARGET void encode_##NAME(const Job& job, std::uint32_t* codes, std::size_t begin, std::size_t end) {              \
        encode_lanes<N>(job, codes, begin, end);                                                                       \
    }                                                                                                                  \
    TARGET void scan_triangles_##NAME(const Job& job, std::size_t begin, std::size_t end, Piece& piece) {              \
        scan_triangles_any<N>(job, begin, end, piece);                                                                 \
    }                                                                                                                  \
    TARGET void scan_large_##NAME(const Job& job, std::span<const LargeTriangle> large, Piece& piece) {                \
        scan_large_any<N>(job, large, piece);                                                                          \
    }                                                                                                                  \
    constexpr Loops k_##NAME = {encode_##NAME, scan_triangles_##NAME, scan_large_##NAME};

#if defined(FILIGREE_HAS_WIDTHS)
FILIGREE_LOOPS(avx512, 8, FILIGREE_AVX512)
FILIGREE_LOOPS(avx2, 4, FILIGREE_AVX2)
#endif
FILIGREE_LOOPS(plain, 2, )

} // namespace

std::span<const int> lane_counts() {
    static constexpr int kCounts[] = {2, 4, 8};
    return std::span(kCounts).first(vector_width_count());
}

Loops loops(int lanes) {
#if defined(FILIGREE_HAS_WIDTHS)
    if (lanes == 8) return k_avx512;
    if (lanes == 4) return k_avx2;
#endif
    assert(lanes == 2);
    return k_plain;
}

} // namespace filigree::scan_kernel
