/* What a compiler and a processor have, for the sources of the runtime. Included first by each of them. */
#ifndef FILIGREE_RT_CONFIG_H
#define FILIGREE_RT_CONFIG_H

#include <float.h>
#include <stddef.h>
#include <stdint.h>

/* The same bytes everywhere need plain IEEE arithmetic. */
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || defined(_M_FP_FAST) ||  \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "filigree_rt gives the same bytes everywhere, which -ffast-math and its parts prevent: compile it without them."
#endif
#if FLT_EVAL_METHOD != 0 || FLT_RADIX != 2 || FLT_MANT_DIG != 24 || DBL_MANT_DIG != 53
#error                                                                                                                 \
    "filigree_rt needs float and double of IEEE 754, not evaluated in a wider type: for 32-bit x86 compile with -msse2 -mfpmath=sse."
#endif
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "filigree_rt reads model files as the processor keeps numbers, and they are little-endian."
#endif

/* No fused multiply-add: it rounds once where others round twice. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#endif

#if defined(__GNUC__)
#define FLG_INLINE static inline __attribute__((always_inline))
#define FLG_APART static __attribute__((noinline)) /* one copy of it is enough */
#if defined(__clang__)
#define FLG_COLD __attribute__((cold, minsize)) /* small rather than fast */
#else
#define FLG_COLD __attribute__((cold))
#endif
#define FLG_RESTRICT __restrict__
#define FLG_PREFETCH(p) __builtin_prefetch(p)
#else
#define FLG_INLINE static inline
#define FLG_APART static
#define FLG_COLD
#define FLG_RESTRICT
#define FLG_PREFETCH(p) ((void)0)
#endif

/* Functions of one source that others of the runtime use, and libfiligree; not part of the interface. */
#if defined(__GNUC__) && !defined(_WIN32)
#define FLG_SHARED __attribute__((visibility("hidden")))
#else
#define FLG_SHARED
#endif

/* Parts that a program may leave out. FLG_NO_PACKED: packed models, which are then refused as unsuitable. FLG_NO_FIT:
 * estimating gradients; every pose then needs them. */
#if defined(FLG_NO_PACKED)
#define FLG_HAS_PACKED 0
#else
#define FLG_HAS_PACKED 1
#endif
#if defined(FLG_NO_FIT)
#define FLG_HAS_FIT 0
#else
#define FLG_HAS_FIT 1
#endif

/* Vector extensions, and a processor with vectors. FLG_NO_VECTORS: leave them out, one vertex at a time. */
#if !defined(FLG_NO_VECTORS) && defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector) && __has_builtin(__builtin_convertvector) &&                                \
    (defined(__SSE2__) || defined(__ARM_NEON) || defined(__wasm_simd128__) || defined(__VSX__))
#define FLG_HAS_VECTORS 1
#if defined(__x86_64__) && !defined(FLG_NO_WIDE_VECTORS)
#define FLG_HAS_WIDE_VECTORS 1 /* AVX2 and AVX-512, where the processor has them */
#endif
#if defined(__SSE2__)
#define FLG_HAS_STREAMING 1 /* stores past the caches */
#endif
#endif
#endif

#endif
