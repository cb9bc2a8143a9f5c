#include "rt_base.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void* take_from_heap(void* user, size_t bytes) {
    (void)user;
    return malloc(bytes);
}
static void give_to_heap(void* user, void* memory) {
    (void)user;
    free(memory);
}
flg_allocator flg_default_allocator(void) {
    flg_allocator heap;
    heap.allocate = take_from_heap;
    heap.release = give_to_heap;
    heap.user = NULL;
    return heap;
}
void* flg_allocate(const flg_allocator* from, uint64_t count, size_t item) {
    if (count > (uint64_t)(PTRDIFF_MAX / 2) / item) return NULL;
    return from->allocate(from->user, count > 0 ? (size_t)count * item : 1);
}
void flg_release(const flg_allocator* to, void* memory) {
    if (memory) to->release(to->user, memory);
}

void flg_cross(const double a[3], const double b[3], double out[3]) {
    const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/* Twice the area vector of a face, Newell's formula, from the first corner so that a small face far from the origin
 * keeps its digits. */
static void doubled_area_vector(const float* positions, const uint32_t* corners, size_t count, double sum[3]) {
    const float* first = positions + 3 * (size_t)corners[0];
    double previous[3], current[3], turned[3];
    for (int k = 0; k < 3; ++k) {
        sum[k] = 0;
        previous[k] = (double)positions[3 * (size_t)corners[1] + (size_t)k] - (double)first[k];
    }
    for (size_t i = 2; i < count; ++i) {
        for (int k = 0; k < 3; ++k)
            current[k] = (double)positions[3 * (size_t)corners[i] + (size_t)k] - (double)first[k];
        flg_cross(previous, current, turned);
        for (int k = 0; k < 3; ++k) {
            sum[k] += turned[k];
            previous[k] = current[k];
        }
    }
}

void flg_vertex_normals(const float* positions, size_t count, const flg_faces* faces, double* sums, float* normals) {
    memset(sums, 0, 3 * count * sizeof *sums);
    for (size_t f = 0; f < faces->count; ++f) {
        const size_t begin = faces->offsets ? faces->offsets[f] : 3 * f,
                     end = faces->offsets ? faces->offsets[f + 1] : begin + 3;
        double normal[3];
        doubled_area_vector(positions, faces->corners + begin, end - begin, normal);
        for (size_t c = begin; c < end; ++c)
            for (size_t k = 0; k < 3; ++k) sums[3 * (size_t)faces->corners[c] + k] += normal[k];
    }
    for (size_t v = 0; v < count; ++v) {
        const double *s = sums + 3 * v, length = sqrt(s[0] * s[0] + (s[1] * s[1] + s[2] * s[2]));
        for (size_t k = 0; k < 3; ++k) normals[3 * v + k] = length > 0 ? (float)(s[k] / length) : 0;
    }
}

void flg_sort(flg_key* keys, flg_key* other, size_t count) {
    enum { PIECE = 8 };
    flg_key *from = keys, *to = other;
    for (size_t begin = 0; begin < count; begin += PIECE) { /* short pieces by insertion, then longer ones by merging */
        const size_t end = count - begin < PIECE ? count : begin + PIECE;
        for (size_t k = begin + 1; k < end; ++k) {
            const flg_key moved = keys[k];
            size_t at = k;
            for (; at > begin && flg_comes_first(&moved, keys + at - 1); --at) keys[at] = keys[at - 1];
            keys[at] = moved;
        }
    }
    for (size_t length = PIECE; length < count; length *= 2) {
        flg_key* swapped = from;
        for (size_t begin = 0; begin < count; begin += 2 * length) {
            const size_t middle = count - begin < length ? count : begin + length,
                         end = count - begin < 2 * length ? count : begin + 2 * length;
            const flg_key *a = from + begin, *a_end = from + middle, *b = a_end, *b_end = from + end;
            flg_key* next = to + begin;
            while (a < a_end && b < b_end) { /* without a branch that nobody can foresee */
                const int right = flg_comes_first(b, a);
                *next++ = *(right ? b : a);
                a += !right;
                b += right;
            }
            memcpy(next, a, (size_t)(a_end - a) * sizeof *a);
            memcpy(next + (a_end - a), b, (size_t)(b_end - b) * sizeof *b);
        }
        from = to;
        to = swapped;
    }
    if (from != keys) memcpy(keys, from, count * sizeof *keys);
}
