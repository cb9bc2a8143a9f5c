// What walks over a WideTree share: eight children, or four triangles, in a register. Private to the layer.
#pragma once

#include "filigree/core/lanes.h"

namespace filigree {

using Float8 = LaneTypes<8>::Float;
using Int8 = LaneTypes<8>::Int;
using Float4 = LaneTypes<4>::Float;
using Double4 = DoubleLaneTypes<4>::Double;
using Long4 = DoubleLaneTypes<4>::Mask;

FILIGREE_INLINE Float8 load8(const float* p) { return *reinterpret_cast<const Float8*>(p); }
FILIGREE_INLINE Double4 load4(const float* p) {
    return __builtin_convertvector(*reinterpret_cast<const Float4*>(p), Double4);
}
FILIGREE_INLINE Double4 absolute(Double4 x) { return x < 0 ? -x : x; }
FILIGREE_INLINE Double4 larger(Double4 x, Double4 y) { return x > y ? x : y; }
FILIGREE_INLINE Double4 smaller(Double4 x, Double4 y) { return x < y ? x : y; }

template <class T>
FILIGREE_INLINE void prefetch(const T& object) {
    for (std::size_t byte = 0; byte < sizeof(T); byte += 64)
        __builtin_prefetch(reinterpret_cast<const char*>(&object) + byte);
}

/// A bit for each lane of a comparison. As an instruction, since GCC makes twenty out of the same in C++, and its own
/// function for it cannot be inlined into code for several processors.
template <bool Avx2>
FILIGREE_INLINE unsigned lane_bits(Int8 mask) {
    unsigned bits = 0;
#ifndef __clang__
    if constexpr (Avx2) {
        asm("vmovmskps %1, %0" : "=r"(bits) : "x"(mask));
        return bits;
    }
#endif
    for (int lane = 0; lane < 8; ++lane) bits |= (mask[lane] & 1u) << lane;
    return bits;
}
template <bool Avx2>
FILIGREE_INLINE unsigned lane_bits(Long4 mask) {
    unsigned bits = 0;
#ifndef __clang__
    if constexpr (Avx2) {
        asm("vmovmskpd %1, %0" : "=r"(bits) : "x"(mask));
        return bits;
    }
#endif
    for (int lane = 0; lane < 4; ++lane) bits |= static_cast<unsigned>(mask[lane] & 1) << lane;
    return bits;
}

} // namespace filigree
