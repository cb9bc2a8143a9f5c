/* The blend code's inner loops, as the runtime and libfiligree use them. Not part of the interface.
 *
 *     p' = sum b t + (sum b A) q        n' = unit(cofactor(sum b A) n)
 *
 * docs/blend-code.md has the formula. Sums have one written order, whatever the width. */
#ifndef FILIGREE_RT_KERNEL_H
#define FILIGREE_RT_KERNEL_H

#include "rt_config.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What a driver vertex gives to every vertex it carries, in one cache line: t and the columns of A. */
typedef struct flg_transform {
#ifdef __cplusplus
    alignas(64)
#else
    _Alignas(64)
#endif
        float t[3];
    float a[9];
    float unused[4];
} flg_transform;

/* Records of one cell, end to end. */
typedef struct flg_run {
    uint32_t cell, first, count;
} flg_run;

enum {
    FLG_MAX_RUN = 512,   /* records of a run */
    FLG_PADDING = 16,    /* numbers behind each array of records that may be read */
    FLG_BLOCK = 1 << 15, /* records at a time when order is asked for: their points stay in the second-level cache */
    FLG_GROUP = 1024     /* records at a time whose normals stay in the first-level cache; a block's buffer has so
                          * many points more than a block */
};

/* Everything that does not change from pose to pose. */
typedef struct flg_records {
    const flg_run* runs;
    const uint32_t* cells;  /* 3 driver vertices each */
    const float *u, *v;     /* weights of the cell's second and third corner */
    const float* q[3];      /* p - m / 2 */
    const float* normal[3]; /* unit rest normals, where they are wanted */
} flg_records;

/* What restored points are multiplied with, powers of two: positions, and normals before they get length one. */
typedef struct flg_scales {
    float position, normal;
} flg_scales;

/* Where points go, NULL: not wanted; and how many may be written there. */
typedef struct flg_place {
    float* points;
    size_t room;
} flg_place;

/* Restores runs run_begin to run_end - 1 in the order of their records. A run's last lanes may be written past its
 * end, where there is room. */
typedef void (*flg_restore_runs)(const flg_records* records, const flg_transform* transforms, flg_scales scales,
                                 size_t run_begin, size_t run_end, flg_place positions, flg_place normals);

/* The inner loops of one width. */
typedef struct flg_kernel {
    int lanes; /* vertices at a time */
    flg_restore_runs restore_runs;
    /* to[k] -= factor * from[k] for `count` numbers, a multiple of 4. */
    void (*subtract_row)(double* to, const double* from, double factor, size_t count);
    /* Adds (position of vertices[k] - centre) times weights[k] for k = 0, 1, ...: three rows of three, and one more
     * that means nothing. weights: 4 each. */
    void (*sum_terms)(const double* weights, const uint32_t* vertices, size_t count, const float* positions,
                      const float* centre, double rows[12]);
} flg_kernel;

/* lanes: 0 for the most that this processor has. NULL: there is no such width. */
FLG_SHARED const flg_kernel* flg_kernel_of(uint32_t lanes);

/* What restore_block needs: floats of scratch memory. */
enum { FLG_BLOCK_ROOM = FLG_BLOCK + FLG_GROUP + FLG_PADDING, FLG_SCRATCH_FLOATS = 2 * 3 * FLG_BLOCK_ROOM };

/* Where a block's points go: to.points + k * stride for slot k of the block. Stride in floats. */
typedef struct flg_slots {
    float* points; /* NULL: not wanted */
    size_t stride;
} flg_slots;

/* Restores the runs of one block and puts them into the order of their slots. from: of each of `count` slots the record
 * of the block that goes there. streaming: past the caches, where the processor can; the thread then has to call
 * flg_end_streaming. */
FLG_SHARED void flg_restore_block(const flg_kernel* kernel, const flg_records* records, const flg_transform* transforms,
                                  flg_scales scales, size_t run_begin, size_t run_end, const uint16_t* from,
                                  size_t count, flg_slots positions, flg_slots normals, int streaming, float* scratch);
/* A buffer of FLG_BLOCK_ROOM points in scratch memory, or none. */
FLG_INLINE flg_place flg_buffer(int wanted, float* points) {
    flg_place place;
    place.points = wanted ? points : NULL;
    place.room = FLG_BLOCK_ROOM;
    return place;
}
/* rt_scatter.c: restores runs that are in no block. slot: where record r goes, or NULL: it goes to r. positions,
 * normals: of slot 0, packed. */
FLG_SHARED void flg_restore_scattered(const flg_kernel* kernel, const flg_records* records,
                                      const flg_transform* transforms, flg_scales scales, size_t run_begin,
                                      size_t run_end, const uint32_t* slot, float* positions, float* normals,
                                      int streaming, float* scratch);
FLG_SHARED void flg_end_streaming(void);

/* A power of two that keeps a driver's digits: both it and its inverse are floats, and so is what lies far from the
 * driver. 1 but for extreme sizes. driver, all: diagonals of the driver's vertices and of all, model units. */
FLG_SHARED double flg_inner_scale(double driver, double all);

/* The transforms of driver vertices begin to end - 1. rest: 3 a driver vertex, relative to the centre and times
 * inner_scale. positions: 3, gradients: 9 a driver vertex. */
FLG_SHARED void flg_make_transforms(const double* rest, double inner_scale, const float* positions,
                                    const float* gradients, size_t begin, size_t end, flg_transform* transforms);

/* What keeps normals within float's range: 1 unless the largest entry of all gradients is far from 1. */
FLG_SHARED float flg_normal_scale(const flg_transform* transforms, size_t count);

/* m, the point of a cell that a record hangs on. */
FLG_INLINE void flg_anchor(const float* corner0, const float* corner1, const float* corner2, double u, double v,
                           double m[3]) {
    for (int k = 0; k < 3; ++k)
        m[k] = (1 - u - v) * (double)corner0[k] + u * (double)corner1[k] + v * (double)corner2[k];
}

/* q of a record: p - m / 2, relative to the centre and times inner_scale. */
FLG_INLINE void flg_rest_offset(const float p[3], const double m[3], const double centre[3], double inner_scale,
                                float q[3]) {
    for (int k = 0; k < 3; ++k)
        q[k] = (float)(inner_scale * ((double)p[k] - centre[k]) - 0.5 * (inner_scale * (m[k] - centre[k])));
}

/* n with length 1; unchanged where that is 0. */
FLG_SHARED void flg_unit(float n[3]);

#ifdef __cplusplus
}
#endif
#endif
