#include "filigree/reference/reference_kernel.h"

#include <cstring>
#include <utility>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace filigree::reference {

// Vectors as wide as the processor's: wider ones would be taken apart in memory, five times slower.
using Lanes4 = LaneTypes<4>::Float;
using Lanes8 = LaneTypes<8>::Float;
using Lanes16 = LaneTypes<16>::Float;

namespace {

template <class F>
inline constexpr std::size_t kWidth = sizeof(F) / sizeof(float);

template <class F>
FILIGREE_INLINE F load(const float* from) {
    F lanes;
    std::memcpy(&lanes, from, sizeof lanes);
    return lanes;
}
template <class F>
FILIGREE_INLINE void store(const F& lanes, float* to) {
    std::memcpy(to, &lanes, sizeof lanes);
}
template <class F>
FILIGREE_INLINE Point<F> load(const float* from, std::size_t pitch) {
    return {load<F>(from), load<F>(from + pitch), load<F>(from + 2 * pitch)};
}

/// a0 b0 a1 b1 ...
template <class F, std::size_t... kLane>
FILIGREE_INLINE void store_zipped(const F& a, const F& b, float* to, std::index_sequence<kLane...>) {
    constexpr std::size_t kN = sizeof...(kLane);
    store(__builtin_shufflevector(a, b, int(kLane / 2 + kLane % 2 * kN)...), to);
    store(__builtin_shufflevector(a, b, int(kN / 2 + kLane / 2 + kLane % 2 * kN)...), to + kN);
}
template <class F>
FILIGREE_INLINE void store_zipped(const Point<F>& a, const Point<F>& b, float* to, std::size_t pitch) {
    constexpr auto lanes = std::make_index_sequence<kWidth<F>>();
    store_zipped(a.x, b.x, to, lanes);
    store_zipped(a.y, b.y, to + pitch, lanes);
    store_zipped(a.z, b.z, to + 2 * pitch, lanes);
}

// Floats ahead that records are asked for: they come from memory once and in order. Without it, half the speed.
constexpr std::size_t kPrefetch = 1024;

template <class F, int kReferences>
FILIGREE_INLINE void refine_lanes(const CellRow& row, const Scaling& scaling, const float* code, std::size_t width,
                                  std::size_t i) {
    const auto record = [&](std::size_t k) __attribute__((always_inline)) {
        return load<F>(code + 3 * k * width, width);
    };
    const auto size = [&](std::size_t k) __attribute__((always_inline)) {
        return scaling.law == HeightLaw::keep ? F{} : load<F>(code + (9 + k) * width);
    };
    const Point<F> a0 = load<F>(row.lower + i, row.pitch), a1 = load<F>(row.lower + i + 1, row.pitch);
    const Point<F> b0 = load<F>(row.upper + i, row.pitch), b1 = load<F>(row.upper + i + 1, row.pitch);
    References<F> along{{a0, a1}, {b0, b1}, {}}, upwards{{b0, a0}, {b1, a1}, {}};
    if constexpr (kReferences == 6) {
        along.behind[0] = load<F>(row.behind + i, row.pitch);
        along.behind[1] = load<F>(row.behind + i + 1, row.pitch);
        upwards.behind[0] = load<F>(row.upper + i - 1, row.pitch);
        upwards.behind[1] = load<F>(row.lower + i - 1, row.pitch);
    }
    const auto edge = place(edge_basis<kReferences>(along, true), record(0), size(0), scaling);
    store_zipped(a0, edge, row.even + 2 * i, row.fine_pitch);
    const auto side = place(edge_basis<kReferences>(upwards, true), record(1), size(1), scaling);
    const auto centre = place(centre_basis<kReferences>(along), record(2), size(kReferences == 6 ? 2 : 0), scaling);
    store_zipped(side, centre, row.odd + 2 * i, row.fine_pitch);
}

template <class F, int kReferences>
FILIGREE_INLINE void refine_row_of(const CellRow& row, const Scaling scaling) {
    const std::size_t width = block_width(row.cells), floats = cell_floats(kReferences, scaling.law);
    const float* code = row.code;
    for (std::size_t i = 0; i < row.cells; i += width, code += floats * width) {
        for (std::size_t line = 0; line < floats; ++line) __builtin_prefetch(code + kPrefetch + line * kLanes);
        for (std::size_t c = 0; c < 3; ++c) __builtin_prefetch(row.upper + (3 + c) * row.pitch + i);
        for (std::size_t lane = 0; lane < width; lane += kWidth<F>)
            refine_lanes<F, kReferences>(row, scaling, code + lane, width, i + lane);
    }
}

template <class F>
FILIGREE_INLINE void refine_row_of(const CellRow& row, int references, const Scaling& scaling) {
    if (references == 4) return refine_row_of<F, 4>(row, scaling);
    if (references == 6) return refine_row_of<F, 6>(row, scaling);
    // The report's own, with the law known to the compiler: 3 to 8 % faster.
    switch (scaling.law) {
    case HeightLaw::keep:
        return refine_row_of<F, 3>(row, {HeightLaw::keep, scaling.height, scaling.size});
    case HeightLaw::inverse:
        return refine_row_of<F, 3>(row, {HeightLaw::inverse, scaling.height, scaling.size});
    case HeightLaw::proportional:
        return refine_row_of<F, 3>(row, {HeightLaw::proportional, scaling.height, scaling.size});
    case HeightLaw::volume:
        return refine_row_of<F, 3>(row, {HeightLaw::volume, scaling.height, scaling.size});
    }
}

/// Element e of three interleaved vectors comes from coordinate e % 3 of point e / 3.
template <std::size_t kPart, class F, std::size_t... kLane>
FILIGREE_INLINE void store_interleaved(const Point<F>& p, float* to, std::index_sequence<kLane...>) {
    constexpr std::size_t kN = sizeof...(kLane), kFirst = kPart * kN;
    const F xy = __builtin_shufflevector(p.x, p.y, int(((kFirst + kLane) % 3 == 1 ? kN : 0) + (kFirst + kLane) / 3)...);
    store(__builtin_shufflevector(xy, p.z, int((kFirst + kLane) % 3 == 2 ? kN + (kFirst + kLane) / 3 : kLane)...),
          to + kFirst);
}

template <class F>
FILIGREE_INLINE void interleave_of(const float* row, std::size_t pitch, std::size_t count, float unit, float* out) {
    constexpr auto lanes = std::make_index_sequence<kWidth<F>>();
    for (std::size_t i = 0; i < count; i += kWidth<F>, out += 3 * kWidth<F>) {
        const Point<F> p = unit * load<F>(row + i, pitch);
        store_interleaved<0>(p, out, lanes);
        store_interleaved<1>(p, out, lanes);
        store_interleaved<2>(p, out, lanes);
    }
}

#if defined(FILIGREE_HAS_WIDTHS) && !defined(__clang__) // Clang 14 refuses vectors as arguments here, inlined or not
FILIGREE_AVX512 void refine_row_16(const CellRow& row, int references, const Scaling& scaling) {
    refine_row_of<Lanes16>(row, references, scaling);
}
FILIGREE_AVX2 void refine_row_8(const CellRow& row, int references, const Scaling& scaling) {
    refine_row_of<Lanes8>(row, references, scaling);
}
FILIGREE_AVX512 void interleave_16(const float* row, std::size_t pitch, std::size_t count, float unit, float* out) {
    interleave_of<Lanes16>(row, pitch, count, unit, out);
}
FILIGREE_AVX2 void interleave_8(const float* row, std::size_t pitch, std::size_t count, float unit, float* out) {
    interleave_of<Lanes8>(row, pitch, count, unit, out);
}
FILIGREE_AVX512 void stream_lines_16(const float* from, std::size_t lines, float* to) {
    for (std::size_t line = 0; line < lines; ++line)
        _mm512_stream_ps(to + kLanes * line, _mm512_loadu_ps(from + kLanes * line));
}
#define FILIGREE_WIDEST(with_16, with_8)                                                                               \
    if (widest_vectors() == VectorWidth::bytes64) return with_16;                                                      \
    if (widest_vectors() == VectorWidth::bytes32) return with_8
#else
#define FILIGREE_WIDEST(with_16, with_8)
#endif

} // namespace

void refine_row(const CellRow& row, int references, const Scaling& scaling) {
    FILIGREE_WIDEST(refine_row_16(row, references, scaling), refine_row_8(row, references, scaling));
    refine_row_of<Lanes4>(row, references, scaling);
}

void refine_edge(const EdgeRun& run, int references, const Scaling& scaling, float (&out)[3][kLanes]) {
    const float* from = run.references[0];
    const std::size_t next_coordinate = 6 * kLanes;
    for (std::size_t lane = 0; lane < run.count; lane += 4) {
        const auto point = [&](std::size_t k) { return load<Lanes4>(from + k * kLanes + lane, next_coordinate); };
        const References<Lanes4> r{{point(0), point(1)}, {point(2), point(3)}, {point(4), point(5)}};
        const Basis<Lanes4> basis = references == 3   ? edge_basis<3>(r, run.both_sides)
                                    : references == 4 ? edge_basis<4>(r, run.both_sides)
                                                      : edge_basis<6>(r, run.both_sides);
        const float* code = run.code + lane;
        const Lanes4 size = scaling.law == HeightLaw::keep ? Lanes4{} : load<Lanes4>(code + 3 * run.count);
        const Point<Lanes4> p = place(basis, load<Lanes4>(code, run.count), size, scaling);
        store(p.x, out[0] + lane);
        store(p.y, out[1] + lane);
        store(p.z, out[2] + lane);
    }
}

void interleave(const float* row, std::size_t pitch, std::size_t count, float unit, float* out) {
    FILIGREE_WIDEST(interleave_16(row, pitch, count, unit, out), interleave_8(row, pitch, count, unit, out));
    interleave_of<Lanes4>(row, pitch, count, unit, out);
}

void stream_lines(const float* from, std::size_t lines, float* to) {
#if defined(__x86_64__)
#if !defined(__clang__)
    if (widest_vectors() == VectorWidth::bytes64) return stream_lines_16(from, lines, to);
#endif
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
