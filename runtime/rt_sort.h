/* Sorting, and faces as arrays. Not part of the interface. */
#ifndef FILIGREE_RT_SORT_H
#define FILIGREE_RT_SORT_H

#include "rt_config.h"

#ifdef __cplusplus
extern "C" {
#endif

static const uint32_t FLG_NONE = 0xffffffffu;

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

#ifdef __cplusplus
}
#endif
#endif
