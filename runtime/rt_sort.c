#include "rt_sort.h"

#include <string.h>

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
