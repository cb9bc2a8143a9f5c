/* XXH3, 64 bits, seed 0, as model files have it for a checksum. The algorithm and its constants are Yann Collet's
 * (xxHash 0.8, https://github.com/Cyan4973/xxHash/blob/dev/doc/xxhash_spec.md). */
#ifndef FILIGREE_RT_HASH_H
#define FILIGREE_RT_HASH_H

#include "rt_config.h"

#include <string.h>

enum { FLG_SECRET = 192, FLG_STRIPE = 64, FLG_STRIPES = (FLG_SECRET - FLG_STRIPE) / 8 }; /* stripes of a block */
static const unsigned char flg_secret[FLG_SECRET] = {
    0xb8, 0xfe, 0x6c, 0x39, 0x23, 0xa4, 0x4b, 0xbe, 0x7c, 0x01, 0x81, 0x2c, 0xf7, 0x21, 0xad, 0x1c, 0xde, 0xd4,
    0x6d, 0xe9, 0x83, 0x90, 0x97, 0xdb, 0x72, 0x40, 0xa4, 0xa4, 0xb7, 0xb3, 0x67, 0x1f, 0xcb, 0x79, 0xe6, 0x4e,
    0xcc, 0xc0, 0xe5, 0x78, 0x82, 0x5a, 0xd0, 0x7d, 0xcc, 0xff, 0x72, 0x21, 0xb8, 0x08, 0x46, 0x74, 0xf7, 0x43,
    0x24, 0x8e, 0xe0, 0x35, 0x90, 0xe6, 0x81, 0x3a, 0x26, 0x4c, 0x3c, 0x28, 0x52, 0xbb, 0x91, 0xc3, 0x00, 0xcb,
    0x88, 0xd0, 0x65, 0x8b, 0x1b, 0x53, 0x2e, 0xa3, 0x71, 0x64, 0x48, 0x97, 0xa2, 0x0d, 0xf9, 0x4e, 0x38, 0x19,
    0xef, 0x46, 0xa9, 0xde, 0xac, 0xd8, 0xa8, 0xfa, 0x76, 0x3f, 0xe3, 0x9c, 0x34, 0x3f, 0xf9, 0xdc, 0xbb, 0xc7,
    0xc7, 0x0b, 0x4f, 0x1d, 0x8a, 0x51, 0xe0, 0x4b, 0xcd, 0xb4, 0x59, 0x31, 0xc8, 0x9f, 0x7e, 0xc9, 0xd9, 0x78,
    0x73, 0x64, 0xea, 0xc5, 0xac, 0x83, 0x34, 0xd3, 0xeb, 0xc3, 0xc5, 0x81, 0xa0, 0xff, 0xfa, 0x13, 0x63, 0xeb,
    0x17, 0x0d, 0xdd, 0x51, 0xb7, 0xf0, 0xda, 0x49, 0xd3, 0x16, 0x55, 0x26, 0x29, 0xd4, 0x68, 0x9e, 0x2b, 0x16,
    0xbe, 0x58, 0x7d, 0x47, 0xa1, 0xfc, 0x8f, 0xf8, 0xb8, 0xd1, 0x7a, 0xd0, 0x31, 0xce, 0x45, 0xcb, 0x3a, 0x8f,
    0x95, 0x16, 0x04, 0x28, 0xaf, 0xd7, 0xfb, 0xca, 0xbb, 0x4b, 0x40, 0x7e,
};
static const uint64_t FLG_PRIME32_1 = 0x9e3779b1u, FLG_PRIME32_2 = 0x85ebca77u, FLG_PRIME32_3 = 0xc2b2ae3du;
static const uint64_t FLG_PRIME64_1 = 0x9e3779b185ebca87u, FLG_PRIME64_2 = 0xc2b2ae3d27d4eb4fu,
                      FLG_PRIME64_3 = 0x165667b19e3779f9u, FLG_PRIME64_4 = 0x85ebca77c2b2ae63u,
                      FLG_PRIME64_5 = 0x27d4eb2f165667c5u;
static const uint64_t FLG_MIX_1 = 0x165667919e3779f9u, FLG_MIX_2 = 0x9fb21c651e98df25u;

static uint64_t hash_read64(const unsigned char* p) {
    uint64_t x;
    memcpy(&x, p, sizeof x);
    return x;
}
static uint64_t hash_read32(const unsigned char* p) {
    uint32_t x;
    memcpy(&x, p, sizeof x);
    return x;
}
static uint64_t hash_rotate(uint64_t x, int bits) { return x << bits | x >> (64 - bits); }
static uint64_t hash_swap_bytes(uint64_t x) {
    x = (x << 8 & 0xff00ff00ff00ff00u) | (x >> 8 & 0x00ff00ff00ff00ffu);
    x = (x << 16 & 0xffff0000ffff0000u) | (x >> 16 & 0x0000ffff0000ffffu);
    return x << 32 | x >> 32;
}
/* The two halves of the product of 128 bits, one on the other. */
static uint64_t hash_fold(uint64_t a, uint64_t b) {
    const uint64_t a0 = a & 0xffffffffu, a1 = a >> 32, b0 = b & 0xffffffffu, b1 = b >> 32;
    const uint64_t low = a0 * b0, middle = a1 * b0 + (low >> 32), cross = (middle & 0xffffffffu) + a0 * b1;
    return ((middle >> 32) + (cross >> 32) + a1 * b1) ^ (cross << 32 | (low & 0xffffffffu));
}
static uint64_t hash_mix16(const unsigned char* p, size_t secret) {
    return hash_fold(hash_read64(p) ^ hash_read64(flg_secret + secret),
                     hash_read64(p + 8) ^ hash_read64(flg_secret + secret + 8));
}
static uint64_t hash_avalanche(uint64_t h) {
    h = (h ^ h >> 37) * FLG_MIX_1;
    return h ^ h >> 32;
}
static uint64_t hash_short_avalanche(uint64_t h) {
    h = (h ^ h >> 33) * FLG_PRIME64_2;
    h = (h ^ h >> 29) * FLG_PRIME64_3;
    return h ^ h >> 32;
}

static FLG_COLD uint64_t hash_to_16(const unsigned char* p, size_t size) {
    if (size > 8) {
        const uint64_t low = hash_read64(p) ^ hash_read64(flg_secret + 24) ^ hash_read64(flg_secret + 32),
                       high = hash_read64(p + size - 8) ^ hash_read64(flg_secret + 40) ^ hash_read64(flg_secret + 48);
        return hash_avalanche(size + hash_swap_bytes(low) + high + hash_fold(low, high));
    }
    if (size >= 4) {
        uint64_t h = (hash_read32(p + size - 4) + (hash_read32(p) << 32)) ^ hash_read64(flg_secret + 8) ^
                     hash_read64(flg_secret + 16);
        h = (h ^ hash_rotate(h, 49) ^ hash_rotate(h, 24)) * FLG_MIX_2;
        h = (h ^ ((h >> 35) + size)) * FLG_MIX_2;
        return h ^ h >> 28;
    }
    if (size > 0) {
        const uint64_t bytes =
            (uint64_t)p[0] << 16 | (uint64_t)p[size / 2] << 24 | (uint64_t)p[size - 1] | (uint64_t)size << 8;
        return hash_short_avalanche(bytes ^ hash_read32(flg_secret) ^ hash_read32(flg_secret + 4));
    }
    return hash_short_avalanche(hash_read64(flg_secret + 56) ^ hash_read64(flg_secret + 64));
}

static FLG_COLD uint64_t hash_to_240(const unsigned char* p, size_t size) {
    uint64_t h = (uint64_t)size * FLG_PRIME64_1;
    if (size <= 128) {
        for (size_t k = (size - 1) / 32 + 1; k-- > 0;)
            h += hash_mix16(p + 16 * k, 32 * k) + hash_mix16(p + size - 16 * (k + 1), 32 * k + 16);
        return hash_avalanche(h);
    }
    for (size_t k = 0; k < 8; ++k) h += hash_mix16(p + 16 * k, 16 * k);
    h = hash_avalanche(h);
    for (size_t k = 8; k < size / 16; ++k) h += hash_mix16(p + 16 * k, 16 * (k - 8) + 3);
    return hash_avalanche(h + hash_mix16(p + size - 16, 136 - 17));
}

static void hash_stripe(uint64_t sums[8], const unsigned char* FLG_RESTRICT p, size_t secret) {
    for (size_t k = 0; k < 8; ++k) {
        const uint64_t x = hash_read64(p + 8 * k), keyed = x ^ hash_read64(flg_secret + secret + 8 * k);
        sums[k ^ 1] += x;
        sums[k] += (keyed & 0xffffffffu) * (keyed >> 32);
    }
}

static uint64_t hash_long(const unsigned char* p, size_t size) {
    const size_t block = FLG_STRIPE * FLG_STRIPES, blocks = (size - 1) / block, last = FLG_SECRET - FLG_STRIPE;
    uint64_t sums[8] = {FLG_PRIME32_3, FLG_PRIME64_1, FLG_PRIME64_2, FLG_PRIME64_3,
                        FLG_PRIME64_4, FLG_PRIME32_2, FLG_PRIME64_5, FLG_PRIME32_1};
    uint64_t h = (uint64_t)size * FLG_PRIME64_1;
    for (size_t b = 0; b < blocks; ++b) {
        for (size_t s = 0; s < FLG_STRIPES; ++s) hash_stripe(sums, p + b * block + s * FLG_STRIPE, 8 * s);
        for (size_t k = 0; k < 8; ++k)
            sums[k] = (sums[k] ^ sums[k] >> 47 ^ hash_read64(flg_secret + last + 8 * k)) * FLG_PRIME32_1;
    }
    for (size_t s = 0; s < (size - 1 - blocks * block) / FLG_STRIPE; ++s)
        hash_stripe(sums, p + blocks * block + s * FLG_STRIPE, 8 * s);
    hash_stripe(sums, p + size - FLG_STRIPE, last - 7);
    for (size_t k = 0; k < 4; ++k)
        h += hash_fold(sums[2 * k] ^ hash_read64(flg_secret + 11 + 16 * k),
                       sums[2 * k + 1] ^ hash_read64(flg_secret + 19 + 16 * k));
    return hash_avalanche(h);
}

static uint64_t hash_of(const unsigned char* p, size_t size) {
    return size <= 16 ? hash_to_16(p, size) : size <= 240 ? hash_to_240(p, size) : hash_long(p, size);
}

#endif
