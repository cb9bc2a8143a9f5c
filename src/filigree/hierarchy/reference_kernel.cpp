#include "filigree/hierarchy/reference_kernel.h"

#include <cstring>
#include <type_traits>
#include <utility>

#if defined(__x86_64__)
#include <immintrin.h>
#endif
#if defined(__x86_64__) && !defined(__clang__) // Clang 14 refuses vectors as arguments here, inlined or not
// The loader picks the widest one that the processor has.
#define FILIGREE_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define FILIGREE_CLONES
#endif

namespace filigree::reference {
namespace {

FILIGREE_INLINE Lanes load(const float* from) {
    Lanes lanes;
    std::memcpy(&lanes, from, sizeof lanes);
    return lanes;
}
FILIGREE_INLINE void store(const Lanes& lanes, float* to) { std::memcpy(to, &lanes, sizeof lanes); }
FILIGREE_INLINE Point<Lanes> load(const float* from, std::size_t pitch) {
    return {load(from), load(from + pitch), load(from + 2 * pitch)};
}

/// a0 b0 a1 b1 ...
FILIGREE_INLINE void store_zipped(const Lanes& a, const Lanes& b, float* to) {
    store(__builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23), to);
    store(__builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31), to + kLanes);
}
FILIGREE_INLINE void store_zipped(const Point<Lanes>& a, const Point<Lanes>& b, float* to, std::size_t pitch) {
    store_zipped(a.x, b.x, to);
    store_zipped(a.y, b.y, to + pitch);
    store_zipped(a.z, b.z, to + 2 * pitch);
}

// Floats ahead that records are asked for: they come from memory once and in order.
constexpr std::size_t kPrefetch = 1024;

template <int kReferences>
FILIGREE_INLINE void refine_row_of(const CellRow& row, const Scaling scaling) {
    const std::size_t width = block_width(row.cells);
    const std::size_t floats = cell_floats(kReferences, scaling.law) * width;
    const float* code = row.code;
    for (std::size_t i = 0; i < row.cells; i += width, code += floats) {
        for (std::size_t line = 0; line < cell_floats(kReferences, scaling.law); ++line)
            __builtin_prefetch(code + kPrefetch + line * kLanes);
        for (std::size_t c = 0; c < 3; ++c) __builtin_prefetch(row.upper + (3 + c) * row.pitch + i);
        const auto record = [&](std::size_t k) { return load(code + 3 * k * width, width); };
        const auto size = [&](std::size_t k) {
            return scaling.law == Law::keep ? Lanes{} : load(code + (9 + k) * width);
        };
        const Point<Lanes> a0 = load(row.lower + i, row.pitch), a1 = load(row.lower + i + 1, row.pitch);
        const Point<Lanes> b0 = load(row.upper + i, row.pitch), b1 = load(row.upper + i + 1, row.pitch);
        References<Lanes> along{{a0, a1}, {b0, b1}, {}}, upwards{{b0, a0}, {b1, a1}, {}};
        if constexpr (kReferences == 6) {
            along.behind[0] = load(row.behind + i, row.pitch);
            along.behind[1] = load(row.behind + i + 1, row.pitch);
            upwards.behind[0] = load(row.upper + i - 1, row.pitch);
            upwards.behind[1] = load(row.lower + i - 1, row.pitch);
        }
        const auto edge = place(edge_frame<kReferences>(along, true), record(0), size(0), scaling);
        store_zipped(a0, edge, row.even + 2 * i, row.fine_pitch);
        const auto side = place(edge_frame<kReferences>(upwards, true), record(1), size(1), scaling);
        const auto centre = place(centre_frame<kReferences>(along), record(2), size(kReferences == 6 ? 2 : 0), scaling);
        store_zipped(side, centre, row.odd + 2 * i, row.fine_pitch);
    }
}

/// Element e of three interleaved vectors comes from coordinate e % 3 of point e / 3.
template <std::size_t kPart, std::size_t... kLane>
FILIGREE_INLINE void store_interleaved(const Point<Lanes>& p, float* to, std::index_sequence<kLane...>) {
    const Lanes xy = __builtin_shufflevector(
        p.x, p.y, int((16 * kPart + kLane) % 3 == 1 ? 16 + (16 * kPart + kLane) / 3 : (16 * kPart + kLane) / 3)...);
    store(
        __builtin_shufflevector(xy, p.z, int((16 * kPart + kLane) % 3 == 2 ? 16 + (16 * kPart + kLane) / 3 : kLane)...),
        to + kPart * kLanes);
}

} // namespace

FILIGREE_CLONES void refine_row(const CellRow& row, int references, const Scaling& scaling) {
    if (references == 4) return refine_row_of<4>(row, scaling);
    if (references == 6) return refine_row_of<6>(row, scaling);
    // The report's own, with the law known to the compiler: 3 to 8 % faster.
    const auto with_law = [&](Law law) { return Scaling{law, scaling.height, scaling.size}; };
    switch (scaling.law) {
    case Law::keep:
        return refine_row_of<3>(row, with_law(Law::keep));
    case Law::inverse:
        return refine_row_of<3>(row, with_law(Law::inverse));
    case Law::proportional:
        return refine_row_of<3>(row, with_law(Law::proportional));
    case Law::volume:
        return refine_row_of<3>(row, with_law(Law::volume));
    }
}

FILIGREE_CLONES void refine_edge(const EdgeRun& run, int references, const Scaling& scaling, Point<Lanes>& out) {
    const Frame<Lanes> frame = references == 3   ? edge_frame<3>(run.references, run.both_sides)
                               : references == 4 ? edge_frame<4>(run.references, run.both_sides)
                                                 : edge_frame<6>(run.references, run.both_sides);
    const Lanes size = scaling.law == Law::keep ? Lanes{} : load(run.code + 3 * run.count);
    out = place(frame, load(run.code, run.count), size, scaling);
}

FILIGREE_CLONES void interleave(const float* row, std::size_t pitch, std::size_t count, float unit, float* out) {
    constexpr auto lanes = std::make_index_sequence<kLanes>();
    for (std::size_t i = 0; i < count; i += kLanes, out += 3 * kLanes) {
        const Point<Lanes> p = unit * load(row + i, pitch);
        store_interleaved<0>(p, out, lanes);
        store_interleaved<1>(p, out, lanes);
        store_interleaved<2>(p, out, lanes);
    }
}

#if defined(__x86_64__)
__attribute__((target("avx512f"))) static void stream_lines_avx512(const float* from, std::size_t lines, float* to) {
    for (std::size_t line = 0; line < lines; ++line)
        _mm512_stream_ps(to + kLanes * line, _mm512_loadu_ps(from + kLanes * line));
}
#endif

void stream_lines(const float* from, std::size_t lines, float* to) {
#if defined(__x86_64__)
    static const bool has_avx512 = __builtin_cpu_supports("avx512f");
    if (has_avx512) return stream_lines_avx512(from, lines, to);
    for (std::size_t quarter = 0; quarter < 4 * lines; ++quarter)
        _mm_stream_ps(to + 4 * quarter, _mm_loadu_ps(from + 4 * quarter));
#else
    std::memcpy(to, from, lines * kLanes * sizeof(float));
#endif
}

void finish_streaming() {
#if defined(__x86_64__)
    _mm_sfence();
#endif
}

} // namespace filigree::reference
