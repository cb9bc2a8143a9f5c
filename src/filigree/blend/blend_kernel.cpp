// One body for every vector width: sixteen lanes with AVX-512, eight with AVX2, four elsewhere, chosen when the program
// runs. It holds no fused multiply-add (the build turns contraction off), so all three give the same bytes.
// Measured against a scalar loop of the same formula: `filigree bench restore`.
#include "filigree/blend/blend_kernel.h"

#include "filigree/core/lanes.h"
#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
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

constexpr std::size_t kBuffer = 1024; ///< points; small enough to stay in the first-level cache

/// Normals before they have length one, an array a coordinate.
struct NormalBuffer {
    alignas(64) float at[3][kBuffer + 16];
};

/// Restores the records of one run; writes whole groups of N, so up to N - 1 points past the run's end. Normals go to
/// `normals` from `first` on.
template <int N, bool Int16, bool Positions, bool Normals>
FILIGREE_INLINE void restore_run(const Records& records, const Run& run, const CellTransform& cell, float* positions,
                                 NormalBuffer& normals, std::size_t first) {
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
            const Float rest[3] = {L::load(&records.normal[0][r]), L::load(&records.normal[1][r]),
                                   L::load(&records.normal[2][r])};
            for (int i = 0; i < 3; ++i) { // cofactor: columns a1 x a2, a2 x a0, a0 x a1
                const int j = (i + 1) % 3, l = (i + 2) % 3;
                L::store(normals.at[i] + first + k, (a[3 + j] * a[6 + l] - a[3 + l] * a[6 + j]) * rest[0] +
                                                        (a[6 + j] * a[l] - a[6 + l] * a[j]) * rest[1] +
                                                        (a[j] * a[3 + l] - a[l] * a[3 + j]) * rest[2]);
            }
        }
    }
}

/// Where points go, and how many may be written there: a run's last lanes write past its end.
struct Place {
    float* points;
    std::size_t room;
};

/// Gives normals length one, in a loop of its own: the root's latency is long, and here several are under way at once.
template <int N>
FILIGREE_INLINE void store_unit(const NormalBuffer& normals, std::size_t count, float scale, const Place& to) {
    using L = PointLanes<N>;
    using Float = typename L::Float;
    for (std::size_t k = 0; k < count; k += N) {
        const Float n[3] = {scale * L::load(normals.at[0] + k), scale * L::load(normals.at[1] + k),
                            scale * L::load(normals.at[2] + k)};
        const Float squared = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
        const Float tiny = Float{} + std::numeric_limits<float>::min(); // a zero normal stays zero
        const Float length = inverse_sqrt<Float>(squared > tiny ? squared : tiny);
        float rest[3 * N];
        const bool fits = k + N <= to.room;
        L::store_interleaved(fits ? to.points + 3 * k : rest, n[0] * length, n[1] * length, n[2] * length);
        if (!fits) std::memcpy(to.points + 3 * k, rest, (count - k) * sizeof(Vec3f));
    }
}

struct Job {
    const Records& records;
    const VertexTransform* transforms;
    const Output& output;
    bool in_blocks, streaming;
};

/// Runs that were restored together, and their records.
struct Group {
    std::size_t run_end, count;
};

/// Restores runs from run_begin on, as many as a buffer holds.
template <int N, bool Int16, bool Positions, bool Normals>
FILIGREE_INLINE Group restore_group(const Job& job, std::size_t run_begin, std::size_t run_end, const Place& positions,
                                    const Place& normals) {
    NormalBuffer lengthy;
    float last[Positions ? 3 * (kMaxRun + 16) : 1];
    CellTransform cell;
    Group group{run_begin, 0};
    for (; group.run_end < run_end; ++group.run_end) {
        const Run& run = job.records.runs[group.run_end];
        if (group.count + run.count > kBuffer) break;
        set_cell<N>(cell, job.records.cells[run.cell], job.transforms);
        float* const to = positions.points + 3 * group.count;
        const bool fits = group.count + run.count + N - 1 <= positions.room;
        restore_run<N, Int16, Positions, Normals>(job.records, run, cell, !Positions || fits ? to : last, lengthy,
                                                  group.count);
        if (Positions && !fits) std::memcpy(to, last, run.count * sizeof(Vec3f));
        group.count += run.count;
    }
    if constexpr (Normals) store_unit<N>(lengthy, group.count, job.output.normal_scale, normals);
    if (Positions && job.output.scale != 1)
        for (std::size_t k = 0; k < 3 * group.count; ++k) positions.points[k] *= job.output.scale;
    return group;
}

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

FILIGREE_INLINE void flush(const Job& job, Vec3f* to, const float* points, std::size_t first, std::size_t count) {
    if (job.output.in_order)
        for (std::size_t k = 0; k < count; ++k)
            std::memcpy(to[job.records.slot[first + k]].data(), points + 3 * k, sizeof(Vec3f));
    else
        stream(to[first].data(), points, 3 * count);
}

/// Runs whose points go straight to where they stay: the lanes past a run's end are overwritten by the next run.
template <int N, bool Int16, bool Positions, bool Normals>
FILIGREE_INLINE void restore_in_place(const Job& job, std::size_t run_begin, std::size_t run_end) {
    std::size_t first = job.records.runs[run_begin].first;
    const Run& last = job.records.runs[run_end - 1];
    while (run_begin < run_end) {
        const std::size_t room = std::size_t{last.first} + last.count - first; // what follows is another thread's
        const Group group = restore_group<N, Int16, Positions, Normals>(
            job, run_begin, run_end, {Positions ? job.output.positions[first].data() : nullptr, room},
            {Normals ? job.output.normals[first].data() : nullptr, room});
        first += group.count;
        run_begin = group.run_end;
    }
}

/// Room for the points of a block, which stay in the second-level cache.
template <bool Positions, bool Normals>
class BlockBuffers {
public:
    static constexpr std::size_t kRoom = kBlock + kBuffer + 16;
    BlockBuffers() : floats_((Positions + Normals) * 3 * kRoom) {}
    float* positions() { return floats_.data(); }
    float* normals() { return floats_.data() + (Positions ? 3 * kRoom : 0); }

private:
    std::vector<float> floats_;
};

/// Restores runs from run_begin on, until about a block of records is done.
template <int N, bool Int16, bool Positions, bool Normals>
FILIGREE_INLINE Group restore_block(const Job& job, std::size_t run_begin, std::size_t run_end,
                                    BlockBuffers<Positions, Normals>& buffers) {
    Group done{run_begin, 0};
    while (done.run_end < run_end && done.count < kBlock) {
        const std::size_t room = buffers.kRoom - done.count;
        const Group group = restore_group<N, Int16, Positions, Normals>(job, done.run_end, run_end,
                                                                        {buffers.positions() + 3 * done.count, room},
                                                                        {buffers.normals() + 3 * done.count, room});
        done = {group.run_end, done.count + group.count};
    }
    return done;
}

template <int N, bool Int16, bool Positions, bool Normals>
FILIGREE_INLINE void restore_through_buffer(const Job& job, std::size_t run_begin, std::size_t run_end) {
    thread_local BlockBuffers<Positions, Normals> buffers;
    std::size_t first = job.records.runs[run_begin].first;
    while (run_begin < run_end) {
        const Group done = restore_block<N, Int16, Positions, Normals>(job, run_begin, run_end, buffers);
        if constexpr (Positions) flush(job, job.output.positions, buffers.positions(), first, done.count);
        if constexpr (Normals) flush(job, job.output.normals, buffers.normals(), first, done.count);
        first += done.count;
        run_begin = done.run_end;
    }
}

/// Puts a block's points into the mesh's order, four at a time: `from` says which one comes next. Reads a float past
/// the last point.
FILIGREE_INLINE void put_in_order(const float* points, std::span<const std::uint16_t> from, bool streaming, float* to) {
    using L = Lanes<4>;
    using Float = L::Float;
    streaming = streaming && reinterpret_cast<std::uintptr_t>(to) % 16 == 0;
    const auto store = [&](float* p, Float value) __attribute__((always_inline)) {
#if defined(__SSE2__)
        if (streaming) return _mm_stream_ps(p, __m128(value));
#endif
        L::store(p, value);
    };
    std::size_t k = 0;
    for (; k + 4 <= from.size(); k += 4, to += 12) {
        const Float p0 = L::load(points + 3 * from[k]), p1 = L::load(points + 3 * from[k + 1]),
                    p2 = L::load(points + 3 * from[k + 2]), p3 = L::load(points + 3 * from[k + 3]);
        store(to, __builtin_shufflevector(p0, p1, 0, 1, 2, 4));
        store(to + 4, __builtin_shufflevector(p1, p2, 1, 2, 4, 5));
        store(to + 8, __builtin_shufflevector(p2, p3, 2, 4, 5, 6));
    }
    for (; k < from.size(); ++k, to += 3) std::memcpy(to, points + 3 * from[k], sizeof(Vec3f));
}

/// Blocks of slots, each restored in record order and then put into the mesh's.
template <int N, bool Int16, bool Positions, bool Normals>
FILIGREE_INLINE void restore_blocks(const Job& job, std::size_t begin, std::size_t end) {
    thread_local BlockBuffers<Positions, Normals> buffers;
    for (std::size_t block = begin; block < end; ++block) {
        const Group done = restore_block<N, Int16, Positions, Normals>(job, job.records.block_runs[block],
                                                                       job.records.block_runs[block + 1], buffers);
        const std::size_t first = block * kBlock;
        const std::span from = std::span(job.records.from).subspan(first, done.count);
        if constexpr (Positions)
            put_in_order(buffers.positions(), from, job.streaming, job.output.positions[first].data());
        if constexpr (Normals) put_in_order(buffers.normals(), from, job.streaming, job.output.normals[first].data());
    }
}

/// begin, end: runs, or blocks where the mesh's order is asked for and the records allow it.
template <int N, bool Int16, bool Positions, bool Normals>
FILIGREE_INLINE void restore_part(const Job& job, std::size_t begin, std::size_t end) {
    if (job.in_blocks)
        restore_blocks<N, Int16, Positions, Normals>(job, begin, end);
    else if (job.output.in_order || job.streaming)
        restore_through_buffer<N, Int16, Positions, Normals>(job, begin, end);
    else
        restore_in_place<N, Int16, Positions, Normals>(job, begin, end);
}

template <int N, bool Int16>
FILIGREE_INLINE void restore_chosen(const Job& job, std::size_t begin, std::size_t end) {
    if (job.output.positions && job.output.normals)
        restore_part<N, Int16, true, true>(job, begin, end);
    else if (job.output.positions)
        restore_part<N, Int16, true, false>(job, begin, end);
    else
        restore_part<N, Int16, false, true>(job, begin, end);
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

float normal_scale(std::span<const VertexTransform> transforms) {
    constexpr int kUsual = 10, kMost = 60; // powers of two
    float largest = 0;
    for (const VertexTransform& transform : transforms)
        for (const float entry : transform.a) largest = std::max(largest, std::abs(entry));
    if (!(largest > 0) || !std::isfinite(largest)) return 1;
    const int power = std::clamp(std::ilogb(largest), -kMost, kMost);
    return std::abs(power) <= kUsual ? 1.0f : std::ldexp(1.0f, -2 * power); // a cofactor has two factors
}

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
    const bool in_blocks = output.in_order && !records.block_runs.empty();
    const Job job{records, transforms.data(), output, in_blocks,
                  (in_blocks || !output.in_order) && records.count * sizeof(Vec3f) > kCacheBytes};
    if (in_blocks) {
        parallel_for(context, records.block_runs.size() - 1, 1, [&](std::size_t begin, std::size_t end) {
            restore_piece(job, begin, end);
#if defined(__SSE2__)
            if (job.streaming) _mm_sfence(); // on the thread that stored
#endif
        });
        return;
    }
    // Pieces of whole runs: found by bisection, so that they depend on the records alone. Past the caches, long bursts
    // of stores are faster than short ones.
    const std::size_t piece = job.streaming ? kBlock : std::size_t{1} << 13;
    const auto run_at = [&](std::size_t record) {
        return static_cast<std::size_t>(
            std::lower_bound(records.runs.begin(), records.runs.end(), record,
                             [](const Run& run, std::size_t wanted) { return run.first < wanted; }) -
            records.runs.begin());
    };
    parallel_for(context, records.count, piece, [&](std::size_t begin, std::size_t end) {
        const std::size_t run_begin = run_at(begin), run_end = run_at(end);
        if (run_begin < run_end) restore_piece(job, run_begin, run_end);
#if defined(__SSE2__)
        if (job.streaming) _mm_sfence(); // on the thread that stored
#endif
    });
}

} // namespace filigree::blend_kernel
