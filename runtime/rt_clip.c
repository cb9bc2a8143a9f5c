#include "rt_clip.h"

#include <string.h>

#if FLG_HAS_PACKED

FLG_COLD void flg_clip_order(const flg_faces* faces, uint32_t corners, uint32_t vertices, uint32_t* vertex,
                             uint32_t* beside, flg_key* keys, uint32_t* starts) {
    const uint32_t none = 0xffffffffu;
    size_t pairs = 0, at = 0;
    uint32_t known = 0;
    for (size_t f = 0; f < faces->count; ++f) {
        const uint32_t begin = faces->offsets ? faces->offsets[f] : (uint32_t)(3 * f),
                       end = faces->offsets ? faces->offsets[f + 1] : begin + 3;
        for (uint32_t c = begin; c < end; ++c) {
            const uint64_t a = faces->corners[c], b = faces->corners[c + 1 < end ? c + 1 : begin];
            keys[pairs].key = a << 32 | b;
            keys[pairs++].value = 0;
            keys[pairs].key = b << 32 | a;
            keys[pairs++].value = 0;
        }
    }
    flg_sort(keys, keys + 2 * (size_t)corners, pairs);
    for (uint32_t v = 0; v <= vertices; ++v) {
        while (at < pairs && keys[at].key >> 32 < v) ++at;
        starts[v] = (uint32_t)at;
    }
    /* vertex: those that are known; until it is known, a vertex has itself beside it. */
    for (uint32_t v = 0; v < vertices; ++v) beside[v] = v;
    for (uint32_t start = 0; start < vertices; ++start) {
        uint32_t next = known;
        if (beside[start] != start) continue;
        beside[start] = none;
        vertex[known++] = start;
        for (; next < known; ++next)
            for (uint32_t k = starts[vertex[next]]; k < starts[vertex[next] + 1]; ++k) {
                const uint32_t v = (uint32_t)keys[k].key;
                if (beside[v] != v || v == vertex[next]) continue;
                beside[v] = vertex[next];
                vertex[known++] = v;
            }
    }
}

static FLG_COLD float read_real(flg_symbols* in) {
    const uint32_t bits = flg_read_bits(in, 32);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

typedef struct flg_clip_scratch {
    flg_shares shares[FLG_CLIP_CONTEXTS];
    float curves[FLG_CLIP_FRAMES][FLG_CLIP_FRAMES];
} flg_clip_scratch;

size_t flg_clip_scratch_bytes(size_t all_numbers) { return sizeof(flg_clip_scratch) + all_numbers * sizeof(int32_t); }

FLG_COLD uint32_t flg_clip_frames(const void* stream, size_t size) {
    flg_symbols in;
    flg_shares shares;
    uint32_t count;
    flg_shares_begin(&shares);
    flg_symbols_begin(&in, stream, size);
    count = flg_read_number(&in, &shares);
    return in.is_damaged || count > FLG_CLIP_FRAMES ? 0 : count;
}

FLG_COLD int flg_read_clip(const void* stream, size_t size, uint32_t numbers, const uint32_t* vertex,
                           const uint32_t* beside, uint32_t vertices, float* frames, void* scratch) {
    flg_clip_scratch* s = (flg_clip_scratch*)scratch;
    int32_t* steps = (int32_t*)(void*)(s + 1);
    const size_t all = (size_t)vertices * numbers;
    flg_symbols in;
    uint32_t count, curves;
    float step, share[FLG_CLIP_NUMBERS];
    for (int k = 0; k < FLG_CLIP_CONTEXTS; ++k) flg_shares_begin(s->shares + k);
    flg_symbols_begin(&in, stream, size);
    count = flg_read_number(&in, s->shares);
    curves = flg_read_number(&in, s->shares);
    if (in.is_damaged || count == 0 || count > FLG_CLIP_FRAMES || curves > count || numbers > FLG_CLIP_NUMBERS)
        return 0;
    step = read_real(&in);
    for (uint32_t k = 0; k < numbers; ++k) {
        const float most = FLT_MAX / (float)(1 << 30);
        share[k] = read_real(&in) * step;
        if (!(share[k] <= most && share[k] >= -most)) return 0;
    }
    for (uint32_t c = 0; c < curves; ++c) {
        int32_t before = 0, slope = 0;
        for (uint32_t t = 0; t < count; ++t) {
            const uint32_t code = flg_read_number(&in, s->shares + FLG_CURVE_ENTRY + (t > 0));
            const int64_t entry = (int64_t)before + slope + flg_with_sign(code);
            if (entry > 2 * FLG_CURVE_ONE || entry < -2 * FLG_CURVE_ONE) return 0;
            slope = t > 0 ? (int32_t)entry - before : 0;
            before = (int32_t)entry;
            s->curves[c][t] = (float)before / (float)FLG_CURVE_ONE;
        }
    }
    for (size_t k = 0; k < count * all; ++k) frames[k] = 0;
    memset(steps, 0, all * sizeof *steps);
    for (uint32_t c = 0; c < curves; ++c) {
        for (uint32_t i = 0; i < vertices; ++i)
            for (uint32_t k = 0; k < numbers; ++k) {
                const uint32_t code = flg_read_number(&in, s->shares + flg_coefficient_context(c, k));
                const int64_t expected =
                                  beside[vertex[i]] != 0xffffffffu ? steps[(size_t)beside[vertex[i]] * numbers + k] : 0,
                              value = expected + flg_with_sign(code);
                if (value > FLG_LARGEST_COEFFICIENT || value < -FLG_LARGEST_COEFFICIENT || in.is_damaged) return 0;
                steps[(size_t)vertex[i] * numbers + k] = (int32_t)value;
            }
        for (uint32_t t = 0; t < count; ++t) {
            float* frame = frames + t * all;
            for (size_t v = 0; v < vertices; ++v)
                for (uint32_t k = 0; k < numbers; ++k)
                    frame[v * numbers + k] += s->curves[c][t] * share[k] * (float)steps[v * numbers + k];
        }
    }
    return 1;
}

#endif
