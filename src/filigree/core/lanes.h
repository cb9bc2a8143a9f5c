// Many numbers in one register, for loops that are compiled for several vector widths and choose when they run. Every
// width does the same operations in the same order, so all give the same bytes. Private to the library.
#pragma once

#include <cstddef>
#include <cstdint>

#define FILIGREE_INLINE inline __attribute__((always_inline))

// What a function is compiled for; the loops inside are FILIGREE_INLINE, and so compiled for the same.
#if defined(__x86_64__)
#define FILIGREE_HAS_WIDTHS
#define FILIGREE_AVX2 __attribute__((target("avx2")))
#define FILIGREE_AVX512 __attribute__((target("avx512f,avx512vl,avx512dq,avx512bw")))
#endif

namespace filigree {

/// N numbers in a register. Loose is for reading and writing anywhere.
template <int N>
struct LaneTypes; ///< N = 4, 8, 16: floats
template <int N>
struct DoubleLaneTypes; ///< N = 2, 4, 8: doubles
/// The integers of the same shape as F, one float or double or a register of them.
template <class F>
struct IntOf;
template <>
struct IntOf<float> {
    using type = std::int32_t;
};
#define FILIGREE_LANE_TYPES(N)                                                                                         \
    template <>                                                                                                        \
    struct LaneTypes<N> {                                                                                              \
        typedef float Float __attribute__((vector_size(N * 4)));                                                       \
        typedef float Loose __attribute__((vector_size(N * 4), aligned(4), may_alias));                                \
        typedef std::int32_t Int __attribute__((vector_size(N * 4)));                                                  \
        typedef std::int16_t LooseShort __attribute__((vector_size(N * 2), aligned(2), may_alias));                    \
    };                                                                                                                 \
    template <>                                                                                                        \
    struct IntOf<LaneTypes<N>::Float> {                                                                                \
        using type = LaneTypes<N>::Int;                                                                                \
    };
#define FILIGREE_DOUBLE_LANE_TYPES(N)                                                                                  \
    template <>                                                                                                        \
    struct DoubleLaneTypes<N> {                                                                                        \
        typedef double Double __attribute__((vector_size(N * 8)));                                                     \
        typedef double Loose __attribute__((vector_size(N * 8), aligned(8), may_alias));                               \
        typedef float LooseFloat __attribute__((vector_size(N * 4), aligned(4), may_alias));                           \
        typedef std::int64_t Mask __attribute__((vector_size(N * 8)));                                                 \
        typedef std::int32_t Int __attribute__((vector_size(N * 4)));                                                  \
    };
FILIGREE_LANE_TYPES(4)
FILIGREE_LANE_TYPES(8)
FILIGREE_LANE_TYPES(16)
FILIGREE_DOUBLE_LANE_TYPES(2)
FILIGREE_DOUBLE_LANE_TYPES(4)
FILIGREE_DOUBLE_LANE_TYPES(8)
#undef FILIGREE_LANE_TYPES
#undef FILIGREE_DOUBLE_LANE_TYPES

/// A vector of three; F: one float, or a register of them, for a vector a lane.
template <class F>
struct LaneVector {
    F x, y, z;
};
template <class F>
FILIGREE_INLINE LaneVector<F> operator+(const LaneVector<F>& a, const LaneVector<F>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class F>
FILIGREE_INLINE LaneVector<F> operator-(const LaneVector<F>& a, const LaneVector<F>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class F, class S>
FILIGREE_INLINE LaneVector<F> operator*(S s, const LaneVector<F>& a) {
    return {s * a.x, s * a.y, s * a.z};
}
template <class F>
FILIGREE_INLINE LaneVector<F> cross(const LaneVector<F>& a, const LaneVector<F>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class F>
FILIGREE_INLINE F dot(const LaneVector<F>& a, const LaneVector<F>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// Reads and writes of N floats.
template <int N>
struct Lanes : LaneTypes<N> {
    using typename LaneTypes<N>::Float;
    using typename LaneTypes<N>::Loose;

    static FILIGREE_INLINE Float load(const float* p) { return *reinterpret_cast<const Loose*>(p); }
    static FILIGREE_INLINE Float load(const std::int16_t* p) {
        return __builtin_convertvector(*reinterpret_cast<const typename LaneTypes<N>::LooseShort*>(p), Float);
    }
    static FILIGREE_INLINE void store(float* p, Float x) { *reinterpret_cast<Loose*>(p) = x; }
};

/// Reads of N doubles, also from floats.
template <int N>
struct DoubleLanes : DoubleLaneTypes<N> {
    using typename DoubleLaneTypes<N>::Double;

    static FILIGREE_INLINE Double load(const double* p) {
        return *reinterpret_cast<const typename DoubleLaneTypes<N>::Loose*>(p);
    }
    static FILIGREE_INLINE Double load(const float* p) {
        return __builtin_convertvector(*reinterpret_cast<const typename DoubleLaneTypes<N>::LooseFloat*>(p), Double);
    }
};

/// 1 / sqrt(x) for x > 0 to float precision: a first guess from the exponent and three Newton steps, each of which
/// doubles the digits. Plain arithmetic instead of an instruction, since those are not the same everywhere.
template <class Float>
FILIGREE_INLINE Float inverse_sqrt(Float x) {
    using Int = typename IntOf<Float>::type;
    static_assert(sizeof(Float) > sizeof(float), "a cast of one float to an integer would not keep its bits");
    Float y = (Float)(0x5f3759df - ((Int)x >> 1));
    for (int step = 0; step < 3; ++step) y = y * (1.5f - 0.5f * x * y * y);
    return y;
}

/// Widths of a register: 16, 32 (AVX2) and 64 bytes (AVX-512 F, VL, DQ, BW).
enum class VectorWidth { bytes16, bytes32, bytes64 };

/// The widest that this processor has; asked once.
inline VectorWidth widest_vectors() {
#if defined(FILIGREE_HAS_WIDTHS)
    static const VectorWidth widest = [] {
        if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
            __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
            return VectorWidth::bytes64;
        return __builtin_cpu_supports("avx2") ? VectorWidth::bytes32 : VectorWidth::bytes16;
    }();
    return widest;
#else
    return VectorWidth::bytes16;
#endif
}

/// How many of the widths this processor has.
inline std::size_t vector_width_count() { return static_cast<std::size_t>(widest_vectors()) + 1; }

} // namespace filigree
