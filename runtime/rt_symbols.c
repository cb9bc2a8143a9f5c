#include "rt_symbols.h"

#if FLG_HAS_PACKED

enum { FLG_LONGEST_PAUSE = 2048 };
#define FLG_PAIR(e)                                                                                                    \
    {2u << ((e)-1), (e)-1}, { 3u << ((e)-1), (e)-1 }
#define FLG_DIRECT(s)                                                                                                  \
    {s, 0}, {(s) + 1, 0}, {(s) + 2, 0}, { (s) + 3, 0 }
const flg_number_symbol flg_number_symbols[FLG_SYMBOLS] = {
    FLG_DIRECT(0), FLG_DIRECT(4), FLG_DIRECT(8), FLG_DIRECT(12), FLG_PAIR(4),  FLG_PAIR(5),  FLG_PAIR(6),  FLG_PAIR(7),
    FLG_PAIR(8),   FLG_PAIR(9),   FLG_PAIR(10),  FLG_PAIR(11),   FLG_PAIR(12), FLG_PAIR(13), FLG_PAIR(14), FLG_PAIR(15),
    FLG_PAIR(16),  FLG_PAIR(17),  FLG_PAIR(18),  FLG_PAIR(19),   FLG_PAIR(20), FLG_PAIR(21), FLG_PAIR(22), FLG_PAIR(23),
    FLG_PAIR(24),  FLG_PAIR(25),  FLG_PAIR(26),  {2u << 25, 25}, /* damage */
    {0, 32}};
#undef FLG_PAIR
#undef FLG_DIRECT

void flg_shares_begin(flg_shares* shares) {
    for (uint32_t s = 0; s < FLG_SYMBOLS; ++s) shares->counts[s] = 1 + (24u >> (s / 6));
    shares->starts[FLG_SYMBOLS] = FLG_SHARES;
    shares->pause = 4;
    flg_shares_update(shares);
    shares->pause = shares->until_update = 4;
}

void flg_shares_update(flg_shares* shares) {
    uint32_t total = 0, cell = 0;
    uint64_t before = 0;
    double one;
    for (uint32_t s = 0; s < FLG_SYMBOLS; ++s) total += shares->counts[s];
    /* One share for each, the others by their counts, rounded down: the half keeps what comes out whole from the
     * rounding of the quotient. */
    one = 1.0 / total;
    for (uint32_t s = 0; s < FLG_SYMBOLS; ++s) {
        const double share = (double)(before * (FLG_SHARES - FLG_SYMBOLS)) + 0.5;
        shares->starts[s] = (uint16_t)(s + (uint32_t)(share * one));
        before += shares->counts[s];
    }
    for (uint32_t s = 0; s < FLG_SYMBOLS; ++s)
        for (const uint32_t end = (shares->starts[s + 1] + (1u << FLG_COARSE) - 1) >> FLG_COARSE; cell < end; ++cell)
            shares->first[cell] = (uint8_t)s;
    if (total > (uint32_t)FLG_COUNT_STEP << 15) /* what came long ago counts less */
        for (uint32_t s = 0; s < FLG_SYMBOLS; ++s) shares->counts[s] = shares->counts[s] / 2 + 1;
    shares->pause = 2 * shares->pause < FLG_LONGEST_PAUSE ? 2 * shares->pause : (uint32_t)FLG_LONGEST_PAUSE;
    shares->until_update = shares->pause;
}

void flg_symbols_begin(flg_symbols* in, const void* stream, size_t size) {
    const unsigned char* bytes = (const unsigned char*)stream;
    uint32_t words = 0;
    memset(in, 0, sizeof *in);
    if (size >= FLG_STREAM_HEAD) memcpy(&words, bytes, sizeof words);
    if (size < FLG_STREAM_HEAD || words > (size - FLG_STREAM_HEAD) / 2) {
        in->is_damaged = 1;
        for (int k = 0; k < 4; ++k) in->states[k] = FLG_LOWEST_STATE;
        return;
    }
    memcpy(in->states, bytes + 4, sizeof in->states);
    in->word = bytes + FLG_STREAM_HEAD;
    in->words_end = in->bit = in->word + 2 * (size_t)words;
    in->bits_end = bytes + size;
}

/* Byte by byte, where fewer than eight are left. */
void flg_fetch_last_bits(flg_symbols* in, uint32_t count) {
    while (in->pending_count < count) {
        if (in->bit == in->bits_end) {
            in->is_damaged = 1;
            in->pending_count += 32;
            return;
        }
        in->pending |= (uint64_t)*in->bit++ << in->pending_count;
        in->pending_count += 8;
    }
}

#endif
