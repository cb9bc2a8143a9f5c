/* What several sources of the runtime use: memory, sorting, faces as arrays and their normals. Not part of the
 * interface. */
#ifndef FILIGREE_RT_BASE_H
#define FILIGREE_RT_BASE_H

#include "rt_config.h"

#ifdef __cplusplus
extern "C" {
#endif

static const uint32_t FLG_NONE = 0xffffffffu;

/* Where memory comes from. allocate gives NULL where there is none. */
typedef struct flg_allocator {
    void* (*allocate)(void* user, size_t bytes);
    void (*release)(void* user, void* memory);
    void* user;
} flg_allocator;
/* malloc and free */
FLG_SHARED flg_allocator flg_default_allocator(void);
/* count items of so many bytes. NULL: there is no memory, or the product is no size_t. */
FLG_SHARED void* flg_allocate(const flg_allocator* from, uint64_t count, size_t item);
FLG_SHARED void flg_release(const flg_allocator* to, void* memory);

/* What is sorted: by key, of equal keys the lower value first. */
typedef struct flg_key {
    uint64_t key;
    uint32_t value;
} flg_key;
FLG_INLINE int flg_comes_first(const flg_key* a, const flg_key* b) {
    return (a->key < b->key) | ((a->key == b->key) & (a->value < b->value));
}
/* other: scratch memory for as many. */
FLG_SHARED void flg_sort(flg_key* keys, flg_key* other, size_t count);

/* Faces of a driver or a mesh. */
typedef struct flg_faces {
    const uint32_t* corners;
    const uint32_t* offsets; /* count + 1, ascending; NULL: triangles */
    size_t count;
} flg_faces;

FLG_SHARED void flg_cross(const double a[3], const double b[3], double out[3]); /* out may be a or b */

/* Unit normals, 3 floats a vertex: the sum of its faces' area vectors; zero without a face of positive area. sums: 3
 * doubles a vertex of scratch memory. */
FLG_SHARED void flg_vertex_normals(const float* positions, size_t count, const flg_faces* faces, double* sums,
                                   float* normals);

#ifdef __cplusplus
}
#endif
#endif
