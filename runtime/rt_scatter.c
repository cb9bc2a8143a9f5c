/* Records that are in no block: of libfiligree alone, the runtime has blocks. */
#include "rt_kernel.h"

#include <string.h>

#if defined(FLG_HAS_STREAMING)
#include <emmintrin.h>
#endif

/* Copies past the caches where the processor can. */
static void stream_floats(float* to, const float* from, size_t count) {
#if defined(FLG_HAS_STREAMING)
    while (count > 0 && (uintptr_t)to % 16 != 0) {
        *to++ = *from++;
        --count;
    }
    for (; count >= 4; count -= 4, to += 4, from += 4) _mm_stream_ps(to, _mm_loadu_ps(from));
#endif
    memcpy(to, from, count * sizeof(float));
}

static void put_anywhere(const float* points, size_t first, size_t count, const uint32_t* slot, float* to) {
    if (slot)
        for (size_t k = 0; k < count; ++k) memcpy(to + 3 * (size_t)slot[first + k], points + 3 * k, 3 * sizeof(float));
    else
        stream_floats(to + 3 * first, points, 3 * count);
}

void flg_restore_scattered(const flg_kernel* kernel, const flg_records* records, const flg_transform* transforms,
                           flg_scales scales, size_t run_begin, size_t run_end, const uint32_t* slot, float* positions,
                           float* normals, int streaming, float* scratch) {
    size_t first;
    if (run_begin >= run_end) return;
    first = records->runs[run_begin].first;
    if (!slot && !streaming) { /* straight to where they stay; what follows them is another thread's */
        const flg_run* last = records->runs + run_end - 1;
        flg_place at, normals_at;
        at.room = normals_at.room = (size_t)last->first + last->count - first;
        at.points = positions ? positions + 3 * first : NULL;
        normals_at.points = normals ? normals + 3 * first : NULL;
        kernel->restore_runs(records, transforms, scales, run_begin, run_end, at, normals_at);
        return;
    }
    while (run_begin < run_end) {
        const flg_place at = flg_buffer(positions != NULL, scratch),
                        normals_at = flg_buffer(normals != NULL, scratch + 3 * (size_t)FLG_BLOCK_ROOM);
        size_t end = run_begin, count = 0;
        while (end < run_end && count < FLG_BLOCK) count += records->runs[end++].count;
        kernel->restore_runs(records, transforms, scales, run_begin, end, at, normals_at);
        if (at.points) put_anywhere(at.points, first, count, slot, positions);
        if (normals_at.points) put_anywhere(normals_at.points, first, count, slot, normals);
        first += count;
        run_begin = end;
    }
}
