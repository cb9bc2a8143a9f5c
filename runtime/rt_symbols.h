/* Symbols in as few bits as their frequencies allow: range asymmetric numeral systems [Duda 2013], four states in turn.
 * Frequencies are counted while coding, on both sides alike, so that no tables are stored. The runtime and libfiligree
 * read with this code; src/filigree/pack/symbols.h writes. Not part of the interface. */
#ifndef FILIGREE_RT_SYMBOLS_H
#define FILIGREE_RT_SYMBOLS_H

#include "rt_config.h"

#include <string.h>

/* libfiligree's inner headers read symbols inline, so its tests and programs need these functions too. */
#if defined(FLG_WITH_WRITER) || defined(FLG_OF_LIBRARY)
#define FLG_OFFERED
#else
#define FLG_OFFERED FLG_SHARED
#endif

#ifdef __cplusplus
extern "C" {
#endif

enum {
    FLG_SYMBOLS = 64,
    FLG_SHARE_BITS = 14,
    FLG_SHARES = 1 << FLG_SHARE_BITS,
    FLG_COARSE = 6,      /* bits of a share's place that flg_shares.first leaves out */
    FLG_COUNT_STEP = 24, /* what a symbol counts */
    FLG_STREAM_HEAD = 20 /* bytes: the number of words, and four states */
};

/* How often each symbol of one context came so far, as shares of 2^14. */
typedef struct flg_shares {
    uint16_t starts[FLG_SYMBOLS + 1];
    uint8_t first[FLG_SHARES >> FLG_COARSE]; /* the symbol at the start of every 64 shares */
    uint32_t counts[FLG_SYMBOLS];
    uint32_t pause, until_update;
} flg_shares;

FLG_OFFERED void flg_shares_begin(flg_shares* shares);
FLG_OFFERED void flg_shares_update(flg_shares* shares);

FLG_INLINE void flg_shares_count(flg_shares* shares, uint32_t symbol) {
    shares->counts[symbol] += FLG_COUNT_STEP;
    if (--shares->until_update == 0) flg_shares_update(shares);
}

/* A stream that is read. Damaged bytes give wrong symbols, and past their end is_damaged. */
typedef struct flg_symbols {
    uint32_t states[4];
    uint32_t turn;
    uint32_t pending_count;
    uint64_t pending;
    const unsigned char *word, *words_end; /* what is left of the words of 16 bits */
    const unsigned char *bit, *bits_end;   /* and of the bytes of plain bits */
    int is_damaged;
} flg_symbols;

FLG_OFFERED void flg_symbols_begin(flg_symbols* in, const void* stream, size_t size);
FLG_OFFERED void flg_fetch_last_bits(flg_symbols* in, uint32_t count);

/* States are this to 2^32 - 1. */
static const uint32_t FLG_LOWEST_STATE = 1u << 16;

/* Symbols cannot be guessed, and neither can branches that depend on them: so there are none but at the stream's end.
 */
FLG_INLINE uint32_t flg_read_symbol(flg_symbols* in, flg_shares* shares) {
    uint32_t* state = in->states + in->turn++ % 4;
    const uint32_t place = *state & (FLG_SHARES - 1);
    uint32_t symbol = shares->first[place >> FLG_COARSE], next;
    uint16_t word = 0;
    int wants_word;
    while (shares->starts[symbol + 1] <= place) ++symbol;
    next = ((uint32_t)shares->starts[symbol + 1] - shares->starts[symbol]) * (*state >> FLG_SHARE_BITS) + place -
           shares->starts[symbol];
    wants_word = next < FLG_LOWEST_STATE;
    if (in->word != in->words_end) {
        memcpy(&word, in->word, sizeof word);
        in->word += wants_word ? sizeof word : 0;
    } else {
        in->is_damaged |= wants_word;
    }
    *state = wants_word ? next << 16 | word : next;
    flg_shares_count(shares, symbol);
    return symbol;
}

/* The next bits as they are, 32 at most. */
FLG_INLINE uint32_t flg_read_bits(flg_symbols* in, uint32_t count) {
    uint64_t more = 0;
    uint32_t value;
    if (in->bits_end - in->bit >= (ptrdiff_t)sizeof more) { /* as many whole bytes as there is room for */
        memcpy(&more, in->bit, sizeof more);
        in->pending |= more << in->pending_count;
        in->bit += (63 - in->pending_count) / 8;
        in->pending_count |= 56;
    } else {
        flg_fetch_last_bits(in, count);
    }
    value = (uint32_t)(in->pending & (((uint64_t)1 << count) - 1));
    in->pending >>= count;
    in->pending_count -= count;
    return value;
}

/* What a symbol of a number stands for: `first` and what `bits` plain bits add to it. 0 to 15 are themselves, then two
 * symbols a power of two; the last is for the rest. */
typedef struct flg_number_symbol {
    uint32_t first, bits;
} flg_number_symbol;
FLG_OFFERED extern const flg_number_symbol flg_number_symbols[FLG_SYMBOLS];

FLG_INLINE uint32_t flg_read_number(flg_symbols* in, flg_shares* shares) {
    const flg_number_symbol of = flg_number_symbols[flg_read_symbol(in, shares)];
    return of.first | flg_read_bits(in, of.bits);
}

FLG_INLINE int32_t flg_with_sign(uint32_t value) { return (int32_t)(value >> 1) ^ -(int32_t)(value & 1); }
FLG_INLINE uint32_t flg_without_sign(int32_t value) { return ((uint32_t)value << 1) ^ (value < 0 ? 0xffffffffu : 0u); }

/* Bits that name one of `count`. */
FLG_INLINE uint32_t flg_bits_to_name(uint64_t count) {
    uint32_t bits = 0;
    while (bits < 32 && count > (uint64_t)1 << bits) ++bits;
    return bits;
}

#ifdef __cplusplus
}
#endif
#endif
