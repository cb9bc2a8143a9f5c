#include "rt_kernel.h"

#include <math.h>
#include <string.h>

#if defined(FLG_HAS_STREAMING)
#include <emmintrin.h>
#endif

/* A cell's transforms as a polynomial in (u, v): rows of base + u du + v dv. */
typedef struct flg_cell {
#ifdef __cplusplus
    alignas(64)
#else
    _Alignas(64)
#endif
        float base[16];
    float du[16], dv[16];
} flg_cell;

/* Normals before they have length one, an array a coordinate. */
typedef struct flg_long_normals {
    float at[3][FLG_GROUP + FLG_PADDING];
} flg_long_normals;

FLG_APART void scale_points(float* points, size_t count, float scale) {
    for (size_t k = 0; k < 3 * count; ++k) points[k] *= scale;
}

/* Records ahead that are asked for early: five arrays are more than the processor follows by itself. */
enum { FLG_AHEAD = 512 };

#if defined(FLG_HAS_VECTORS)
#define FLG_TARGET
#define FLG_N 4
#include "rt_lanes.h"
#undef FLG_N
#undef FLG_TARGET
#if defined(FLG_HAS_WIDE_VECTORS)
#define FLG_TARGET __attribute__((target("avx2")))
#define FLG_N 8
#include "rt_lanes.h"
#undef FLG_N
#undef FLG_TARGET
#define FLG_TARGET __attribute__((target("avx512f,avx512vl,avx512dq,avx512bw")))
#define FLG_N 16
#include "rt_lanes.h"
#undef FLG_N
#undef FLG_TARGET
#endif
#else
#define FLG_TARGET
#define FLG_N 1
#include "rt_lanes.h"
#undef FLG_N
#undef FLG_TARGET
#endif

const flg_kernel* flg_kernel_of(uint32_t lanes) {
#if defined(FLG_HAS_WIDE_VECTORS)
    if ((lanes == 0 || lanes == 16) && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
        return &kernel_16;
    if ((lanes == 0 || lanes == 8) && __builtin_cpu_supports("avx2")) return &kernel_8;
#endif
#if defined(FLG_HAS_VECTORS)
    if (lanes == 0 || lanes == 4) return &kernel_4;
#else
    if (lanes <= 1) return &kernel_1;
#endif
    return NULL;
}

void flg_end_streaming(void) {
#if defined(FLG_HAS_STREAMING)
    _mm_sfence();
#endif
}

/* Puts a block's points into the order of their slots, four at a time: `from` says which one comes next. Reads a float
 * past the last point. */
static void put_in_order(const float* points, const uint16_t* from, size_t count, int streaming, float* to) {
    size_t k = 0;
#if defined(FLG_HAS_VECTORS)
    typedef float four __attribute__((vector_size(16)));
    typedef float loose_four __attribute__((vector_size(16), aligned(4), may_alias));
#if defined(FLG_HAS_STREAMING)
    streaming = streaming && (uintptr_t)to % 16 == 0;
#endif
    for (; k + 4 <= count; k += 4, to += 12) {
        const four p0 = (four) * (const loose_four*)(points + 3 * (size_t)from[k]),
                   p1 = (four) * (const loose_four*)(points + 3 * (size_t)from[k + 1]),
                   p2 = (four) * (const loose_four*)(points + 3 * (size_t)from[k + 2]),
                   p3 = (four) * (const loose_four*)(points + 3 * (size_t)from[k + 3]);
        const four first = __builtin_shufflevector(p0, p1, 0, 1, 2, 4),
                   second = __builtin_shufflevector(p1, p2, 1, 2, 4, 5),
                   third = __builtin_shufflevector(p2, p3, 2, 4, 5, 6);
#if defined(FLG_HAS_STREAMING)
        if (streaming) {
            _mm_stream_ps(to, (__m128)first);
            _mm_stream_ps(to + 4, (__m128)second);
            _mm_stream_ps(to + 8, (__m128)third);
            continue;
        }
#endif
        *(loose_four*)to = first;
        *(loose_four*)(to + 4) = second;
        *(loose_four*)(to + 8) = third;
    }
#endif
    (void)streaming;
    for (; k < count; ++k, to += 3) memcpy(to, points + 3 * (size_t)from[k], 3 * sizeof(float));
}

static void put_in_slots(const float* points, const uint16_t* from, size_t count, int streaming, flg_slots to) {
    if (to.stride == 3) {
        put_in_order(points, from, count, streaming, to.points);
        return;
    }
    for (size_t k = 0; k < count; ++k)
        memcpy(to.points + k * to.stride, points + 3 * (size_t)from[k], 3 * sizeof(float));
}

void flg_restore_block(const flg_kernel* kernel, const flg_records* records, const flg_transform* transforms,
                       flg_scales scales, size_t run_begin, size_t run_end, const uint16_t* from, size_t count,
                       flg_slots positions, flg_slots normals, int streaming, float* scratch) {
    const flg_place at = flg_buffer(positions.points != NULL, scratch),
                    normals_at = flg_buffer(normals.points != NULL, scratch + 3 * (size_t)FLG_BLOCK_ROOM);
    kernel->restore_runs(records, transforms, scales, run_begin, run_end, at, normals_at);
    if (at.points) put_in_slots(at.points, from, count, streaming, positions);
    if (normals_at.points) put_in_slots(normals_at.points, from, count, streaming, normals);
}

/* The power of two of x > 0, finite: 2^e <= x < 2^(e + 1). */
static int exponent_of(double x) {
    uint64_t bits;
    int lower = 0;
    if (x < DBL_MIN) {            /* subnormal */
        x *= 18014398509481984.0; /* 2^54 */
        lower = 54;
    }
    memcpy(&bits, &x, sizeof bits);
    return (int)(bits >> 52 & 0x7ff) - 1023 - lower;
}

/* 2^e for a normal number. */
static double power_of_two(int e) {
    const uint64_t bits = (uint64_t)(e + 1023) << 52;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

double flg_inner_scale(double driver, double all) {
    const double small_size = 1e-15, large_size = 1e15, largest = 1e30;
    const double size = driver > 0 ? driver : all, most = all / largest;
    int wanted, least, e;
    if (!(size > 0) || (size >= small_size && size <= large_size && all <= largest)) return 1;
    e = exponent_of(size);
    /* the nearer power of two, by ratio: sqrt(2) is not reached by any double */
    wanted = (size / power_of_two(e)) * (size / power_of_two(e)) < 2 ? e : e + 1;
    least = exponent_of(most);
    if (most > power_of_two(least)) ++least;
    if (wanted < least) wanted = least;
    return power_of_two(-(wanted < 127 ? wanted : 127));
}

void flg_make_transforms(const double* rest, double inner_scale, const float* positions, const float* gradients,
                         size_t begin, size_t end, flg_transform* transforms) {
    for (size_t i = begin; i < end; ++i) {
        const double* r = rest + 3 * i;
        const float *p = positions + 3 * i, *a = gradients + 9 * i;
        const double h0 = 0.5 * r[0], h1 = 0.5 * r[1], h2 = 0.5 * r[2];
        flg_transform* to = transforms + i;
        for (int k = 0; k < 3; ++k) {
            const double turned = (double)a[k] * h0 + ((double)a[3 + k] * h1 + (double)a[6 + k] * h2);
            to->t[k] = (float)(inner_scale * (double)p[k] - turned);
        }
        memset(to->unused, 0, sizeof to->unused);
        memcpy(to->a, a, sizeof to->a);
    }
}

float flg_normal_scale(const flg_transform* transforms, size_t count) {
    const int usual = 10, most = 60; /* powers of two */
    float largest = 0;
    int power;
    for (size_t i = 0; i < count; ++i)
        for (int k = 0; k < 9; ++k) {
            const float entry = transforms[i].a[k], size = entry < 0 ? -entry : entry;
            if (size > largest) largest = size;
        }
    if (!(largest > 0) || !(largest <= FLT_MAX)) return 1;
    power = exponent_of((double)largest);
    if (power > most) power = most;
    if (power < -most) power = -most;
    return power > usual || power < -usual ? (float)power_of_two(-2 * power) : 1.0f; /* a cofactor has two factors */
}

void flg_unit(float n[3]) {
    const double x = (double)n[0], y = (double)n[1], z = (double)n[2], squared = x * x + (y * y + z * z);
    double length;
    if (!(squared > 0)) return;
    length = sqrt(squared);
    n[0] = (float)(x / length);
    n[1] = (float)(y / length);
    n[2] = (float)(z / length);
}
