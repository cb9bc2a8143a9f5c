/* Poses of a driver as a few curves in time, and how much of each a vertex follows [principal components; Alexa and
 * Mueller 2000]. The runtime and libfiligree read with this code; src/filigree/pack/clip_code.h writes. Not part of the
 * interface. */
#ifndef FILIGREE_RT_CLIP_H
#define FILIGREE_RT_CLIP_H

#include "rt_base.h"
#include "rt_symbols.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    FLG_CLIP_FRAMES = 128, /* of a block, at most */
    FLG_CLIP_NUMBERS = 12, /* of a vertex, at most */
    FLG_CURVE_CONTEXTS =
        40, /* curves that matter less have smaller numbers: so has each its own, the last ones share */
    FLG_CURVE_ENTRY = 2,
    FLG_COEFFICIENT = 4,
    FLG_CLIP_CONTEXTS = FLG_COEFFICIENT + 3 * FLG_CURVE_CONTEXTS,
    FLG_CURVE_ONE = 1 << 19, /* entries of curves are shares of it: fine enough for whole positions */
    FLG_LARGEST_COEFFICIENT = 1 << 25
};

/* Positions are one kind of numbers, gradients' diagonals another, the rest of them a third. */
FLG_INLINE uint32_t flg_coefficient_context(size_t curve, size_t number) {
    const uint32_t kind = number < 3 ? 0 : (number - 3) % 4 == 0 ? 1 : 2;
    return FLG_COEFFICIENT + 3 * (uint32_t)(curve < FLG_CURVE_CONTEXTS ? curve : FLG_CURVE_CONTEXTS - 1) + kind;
}

/* In which order a clip has its vertices: neighbours by neighbours. corners: of all faces. vertex, beside: an item a
 * vertex; beside: one that came before, 0xffffffff for the first of a part. scratch: 4 * corners keys and vertices + 1
 * numbers. */
FLG_SHARED void flg_clip_order(const flg_faces* faces, uint32_t corners, uint32_t vertices, uint32_t* vertex,
                               uint32_t* beside, flg_key* keys, uint32_t* starts);

/* The frames of a block; 0: it is damaged. */
FLG_SHARED uint32_t flg_clip_frames(const void* stream, size_t size);

/* Memory for reading a block of so many numbers (vertices times those of each). */
FLG_SHARED size_t flg_clip_scratch_bytes(size_t all_numbers);

/* Reads a block. frames: of so many vertices times `numbers` (3 or 12) each, flg_clip_frames of them; scratch: aligned
 * as malloc's. 0: it is damaged. */
FLG_SHARED int flg_read_clip(const void* stream, size_t size, uint32_t numbers, const uint32_t* vertex,
                             const uint32_t* beside, uint32_t vertices, float* frames, void* scratch);

#ifdef __cplusplus
}
#endif
#endif
