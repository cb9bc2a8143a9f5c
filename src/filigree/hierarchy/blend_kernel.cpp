// One body for every vector width: sixteen lanes with AVX-512, eight with AVX2, four elsewhere, chosen when the program
// runs. It holds no fused multiply-add (the build turns contraction off), so all three give the same bytes.
// Measured against a scalar loop of the same formula: `filigree bench restore`.
#include "filigree/hierarchy/blend_kernel.h"

#include "filigree/core/lanes.h"
#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <utility>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace filigree::blend_kernel {

namespace {

template <int N>
struct PointLanes : Lanes<N> {
    using typename LaneTypes<N>::Float;

    /// Stores x0 y0 z0 x1 y1 z1 ...: each third of the output takes its x and y in one shuffle and its z in a second.
    static FILIGREE_INLINE void store_interleaved(float* p, Float x, Float y, Float z) {
        interleave<0>(p, x, y, z, std::make_integer_sequence<int, N>{});
        interleave<1>(p, x, y, z, std::make_integer_sequence<int, N>{});
        interleave<2>(p, x, y, z, std::make_integer_sequence<int, N>{});
    }

private:
    template <int Third, int... I>
    static FILIGREE_INLINE void interleave(float* p, Float x, Float y, Float z, std::integer_sequence<int, I...>) {
        const Float xy = __builtin_shufflevector(x, y, ((Third * N + I) % 3 == 1 ? N : 0) + (Third * N + I) / 3 ...);
        Lanes<N>::store(p + Third * N,
                        __builtin_shufflevector(xy, z, ((Third * N + I) % 3 == 2 ? N + (Third * N + I) / 3 : I)...));
    }
};

/// The cell's transforms as a polynomial in (u, v): rows of base + u du + v dv.
struct alignas(64) CellTransform {
    float base[16], du[16], dv[16];
};

constexpr int kA = 3, kHalfRest = 12; // offsets in a VertexTransform

template <int N>
FILIGREE_INLINE void set_cell(CellTransform& cell, const Triangle& corners, const VertexTransform* transforms) {
    using L = Lanes<N>;
    for (int k = 0; k < 16; k += N) {
        const typename L::Float t0 = L::load(transforms[corners[0]].t + k);
        L::store(cell.base + k, t0);
        L::store(cell.du + k, L::load(transforms[corners[1]].t + k) - t0);
        L::store(cell.dv + k, L::load(transforms[corners[2]].t + k) - t0);
    }
}

/// Records ahead that are asked for early: five arrays are more than the processor follows by itself.
constexpr std::size_t kPrefetch = 512;

template <bool Int16>
FILIGREE_INLINE void prefetch(const Records& records, std::size_t r) {
    const auto ask = [&](const auto& array) __attribute__((always_inline)) { __builtin_prefetch(array.data() + r); };
    if constexpr (Int16) {
        ask(records.u16), ask(records.v16);
        for (const auto& offset : records.offset) ask(offset);
    } else {
        ask(records.u), ask(records.v);
        for (const auto& q : records.q) ask(q);
    }
}

/// Restores the records of one run; writes whole groups of N, so up to N - 1 points past the run's end.
template <int N, bool Int16, bool Positions, bool Normals>
FILIGREE_INLINE void restore_run(const Records& records, const Run& run, const CellTransform& cell, float* positions,
                                 float* normals) {
    using L = PointLanes<N>;
    using Float = typename L::Float;
    for (Index k = 0; k < run.count; k += N) {
        const std::size_t r = std::size_t{run.first} + k;
        prefetch<Int16>(records, r + kPrefetch);
        Float u, v;
        if constexpr (Int16) {
            u = L::load(&records.u16[r]) * (1.0f / 32767.0f);
            v = L::load(&records.v16[r]) * (1.0f / 32767.0f);
        } else {
            u = L::load(&records.u[r]);
            v = L::load(&records.v[r]);
        }
        const auto blend = [&](int row) __attribute__((always_inline)) {
            return cell.base[row] + u * cell.du[row] + v * cell.dv[row];
        };
        Float a[9];
        for (int i = 0; i < 9; ++i) a[i] = blend(kA + i);

        if constexpr (Positions) {
            Float q[3];
            for (int i = 0; i < 3; ++i) {
                if constexpr (Int16)
                    q[i] = L::load(&records.offset[i][r]) * records.scale[run.cell] + blend(kHalfRest + i);
                else
                    q[i] = L::load(&records.q[i][r]);
            }
            Float p[3];
            for (int i = 0; i < 3; ++i) p[i] = blend(i) + (a[i] * q[0] + a[3 + i] * q[1] + a[6 + i] * q[2]);
            L::store_interleaved(positions + 3 * k, p[0], p[1], p[2]);
        }
        if constexpr (Normals) {
            Float n[3];
            const Float rest[3] = {L::load(&records.normal[0][r]), L::load(&records.normal[1][r]),
                                   L::load(&records.normal[2][r])};
            for (int i = 0; i < 3; ++i) { // cofactor: columns a1 x a2, a2 x a0, a0 x a1
                const int j = (i + 1) % 3, l = (i + 2) % 3;
                n[i] = (a[3 + j] * a[6 + l] - a[3 + l] * a[6 + j]) * rest[0] +
                       (a[6 + j] * a[l] - a[6 + l] * a[j]) * rest[1] + (a[j] * a[3 + l] - a[l] * a[3 + j]) * rest[2];
            }
            const Float squared = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
            const Float tiny = Float{} + 1e-30f; // a zero normal stays zero
            const Float length = inverse_sqrt<Float>(squared > tiny ? squared : tiny);
            L::store_interleaved(normals + 3 * k, n[0] * length, n[1] * length, n[2] * length);
        }
    }
}

constexpr std::size_t kBuffer = 1024; ///< points; small enough to stay in the first-level cache

/// Copies past the caches where the processor can.
FILIGREE_INLINE void stream(float* to, const float* from, std::size_t count) {
#if defined(__SSE2__)
    while (count > 0 && reinterpret_cast<std::uintptr_t>(to) % 16 != 0) {
        *to++ = *from++;
        --count;
    }
    for (; count >= 4; count -= 4, to += 4, from += 4) _mm_stream_ps(to, _mm_loadu_ps(from));
#endif
    std::memcpy(to, from, count * sizeof(float));
}

struct Job {
    const Records& records;
    const VertexTransform* transforms;
    const Output& output;
    bool streaming;
};

FILIGREE_INLINE void flush(const Job& job, Vec3f* to, float* buffer, std::size_t first, std::size_t count,
                           float scale) {
    if (scale != 1)
        for (std::size_t k = 0; k < 3 * count; ++k) buffer[k] *= scale;
    if (job.output.in_order)
        for (std::size_t k = 0; k < count; ++k)
            std::memcpy(to[job.records.slot[first + k]].data(), buffer + 3 * k, sizeof(Vec3f));
    else if (job.streaming)
        stream(to[first].data(), buffer, 3 * count);
    else
        std::memcpy(to[first].data(), buffer, 3 * count * sizeof(float));
}

template <int N, bool Int16, bool Positions, bool Normals>
FILIGREE_INLINE void restore_runs(const Job& job, std::size_t run_begin, std::size_t run_end) {
    alignas(64) float positions[3 * (kBuffer + 16)];
    alignas(64) float normals[3 * (kBuffer + 16)];
    CellTransform cell;
    std::size_t first = job.records.runs[run_begin].first, filled = 0;
    for (std::size_t r = run_begin; r <= run_end; ++r) {
        if (r == run_end || filled + job.records.runs[r].count > kBuffer) {
            if constexpr (Positions) flush(job, job.output.positions, positions, first, filled, job.output.scale);
            if constexpr (Normals) flush(job, job.output.normals, normals, first, filled, 1);
            first += filled;
            filled = 0;
            if (r == run_end) return;
        }
        const Run& run = job.records.runs[r];
        set_cell<N>(cell, job.records.cells[run.cell], job.transforms);
        restore_run<N, Int16, Positions, Normals>(job.records, run, cell, positions + 3 * filled, normals + 3 * filled);
        filled += run.count;
    }
}

template <int N, bool Int16>
FILIGREE_INLINE void restore_chosen(const Job& job, std::size_t begin, std::size_t end) {
    if (job.output.positions && job.output.normals)
        restore_runs<N, Int16, true, true>(job, begin, end);
    else if (job.output.positions)
        restore_runs<N, Int16, true, false>(job, begin, end);
    else
        restore_runs<N, Int16, false, true>(job, begin, end);
}

template <int N>
FILIGREE_INLINE void restore_width(const Job& job, std::size_t begin, std::size_t end) {
    job.records.is_int16() ? restore_chosen<N, true>(job, begin, end) : restore_chosen<N, false>(job, begin, end);
}

using RestoreFunction = void (*)(const Job&, std::size_t, std::size_t);

#if defined(FILIGREE_HAS_WIDTHS)
FILIGREE_AVX512 void restore_avx512(const Job& job, std::size_t begin, std::size_t end) {
    restore_width<16>(job, begin, end);
}
FILIGREE_AVX2 void restore_avx2(const Job& job, std::size_t begin, std::size_t end) {
    restore_width<8>(job, begin, end);
}
#endif
void restore_plain(const Job& job, std::size_t begin, std::size_t end) { restore_width<4>(job, begin, end); }

RestoreFunction restore_function(int lanes) {
#if defined(FILIGREE_HAS_WIDTHS)
    if (lanes == 16) return restore_avx512;
    if (lanes == 8) return restore_avx2;
#endif
    assert(lanes == 4);
    return restore_plain;
}

} // namespace

std::span<const int> lane_counts() {
    static constexpr int kCounts[] = {4, 8, 16};
    return std::span(kCounts).first(vector_width_count());
}

void restore(const Records& records, std::span<const VertexTransform> transforms, const Output& output,
             const RunContext& context) {
    static const int lanes = lane_counts().back();
    restore(records, transforms, output, lanes, context);
}

void restore(const Records& records, std::span<const VertexTransform> transforms, const Output& output, int lanes,
             const RunContext& context) {
    const RestoreFunction restore_piece = restore_function(lanes);
    // Stores go past the caches when the output would not stay in them anyway.
    constexpr std::size_t kCacheBytes = std::size_t{16} << 20;
    const Job job{records, transforms.data(), output, !output.in_order && records.count * sizeof(Vec3f) > kCacheBytes};
    // Pieces of whole runs with about kPiece records: found by bisection, so that they depend on the records alone.
    constexpr std::size_t kPiece = 1 << 13;
    const auto run_at = [&](std::size_t record) {
        return static_cast<std::size_t>(
            std::lower_bound(records.runs.begin(), records.runs.end(), record,
                             [](const Run& run, std::size_t wanted) { return run.first < wanted; }) -
            records.runs.begin());
    };
    parallel_for(context, records.count, kPiece, [&](std::size_t begin, std::size_t end) {
        const std::size_t run_begin = run_at(begin), run_end = run_at(end);
        if (run_begin < run_end) restore_piece(job, run_begin, run_end);
#if defined(__SSE2__)
        if (job.streaming) _mm_sfence(); // on the thread that stored
#endif
    });
}

} // namespace filigree::blend_kernel
