// Many numbers in one register: types for loops that are compiled for several vector widths and choose when they run.
#pragma once

#include <cstddef>
#include <cstdint>

#define FILIGREE_INLINE inline __attribute__((always_inline))

namespace filigree {

/// N floats or ints in a register; Loose is for reading and writing floats anywhere.
template <int N>
struct LaneTypes;
#define FILIGREE_LANE_TYPES(N)                                                                                         \
    template <>                                                                                                        \
    struct LaneTypes<N> {                                                                                              \
        typedef float Float __attribute__((vector_size(N * 4)));                                                       \
        typedef float Loose __attribute__((vector_size(N * 4), aligned(4), may_alias));                                \
        typedef std::int32_t Int __attribute__((vector_size(N * 4)));                                                  \
    };
FILIGREE_LANE_TYPES(4)
FILIGREE_LANE_TYPES(8)
FILIGREE_LANE_TYPES(16)
#undef FILIGREE_LANE_TYPES

/// How many of the widths 16, 32 (AVX2) and 64 bytes (AVX-512 F, VL, DQ, BW) this processor has.
inline std::size_t vector_width_count() {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512bw"))
        return 3;
    if (__builtin_cpu_supports("avx2")) return 2;
#endif
    return 1;
}

} // namespace filigree
