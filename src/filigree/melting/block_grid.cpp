#include "filigree/melting/block_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace filigree {

namespace {

std::size_t first_place(std::uint64_t key, std::size_t mask) {
    return std::size_t((key * 0x9E3779B97F4A7C15u) >> 32) & mask;
}

} // namespace

BlockGrid::BlockGrid(double cell, const Vec3d& shift, std::vector<std::uint64_t> keys)
    : cell_(cell), shift_(shift), keys_(std::move(keys)) {
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
    table_.assign(std::bit_ceil(2 * keys_.size() + 1), kNoIndex);
    for (Index b = 0; b < keys_.size(); ++b) {
        std::size_t place = first_place(keys_[b], table_.size() - 1);
        while (table_[place] != kNoIndex) place = (place + 1) & (table_.size() - 1);
        table_[place] = b;
    }
    neighbours_.resize(keys_.size());
    for (Index b = 0; b < keys_.size(); ++b) {
        const GridNode corner = block_corner(b);
        for (int n = 0; n < 27; ++n)
            neighbours_[b][std::size_t(n)] = block(key_of_block(
                (corner[0] >> 3) + n % 3 - 1, (corner[1] >> 3) + n / 3 % 3 - 1, (corner[2] >> 3) + n / 9 - 1));
    }
}

Index BlockGrid::block(std::uint64_t key) const {
    if (table_.empty()) return kNoIndex;
    for (std::size_t place = first_place(key, table_.size() - 1);; place = (place + 1) & (table_.size() - 1)) {
        const Index b = table_[place];
        if (b == kNoIndex || keys_[b] == key) return b;
    }
}

GridNode BlockGrid::block_corner(Index block) const {
    const auto coordinate = [&](int bits) {
        return (std::int32_t(keys_[block] >> bits & 0x1FFFFF) - kFarthest / kSide) * kSide;
    };
    return {coordinate(0), coordinate(21), coordinate(42)};
}

GridNode BlockGrid::node(Index slot) const {
    const GridNode corner = block_corner(slot >> 9);
    return {corner[0] + int(slot & 7), corner[1] + int(slot >> 3 & 7), corner[2] + int(slot >> 6 & 7)};
}

Index BlockGrid::slot(const GridNode& node) const {
    const Index b = block(key_of_block(node[0] >> 3, node[1] >> 3, node[2] >> 3));
    return b == kNoIndex ? b : b * kNodes + Index((node[0] & 7) | (node[1] & 7) << 3 | (node[2] & 7) << 6);
}

GridNode BlockGrid::node_below(const Vec3d& at) const {
    GridNode node;
    for (int a = 0; a < 3; ++a) {
        const double scaled = std::clamp((at[a] - shift_[a]) / cell_, -double(kFarthest), double(kFarthest));
        std::int32_t n = std::int32_t(std::ceil(scaled)) - 1;
        if (std::abs(n) >= kFarthest - 1) {
            node[std::size_t(a)] = n;
            continue;
        }
        while (n * cell_ + shift_[a] >= at[a]) --n; // what the division rounded
        while ((n + 1) * cell_ + shift_[a] < at[a]) ++n;
        node[std::size_t(a)] = n;
    }
    return node;
}

float interpolate(const BlockGrid& grid, const std::vector<float>& values, float outside, const Vec3d& at,
                  Vec3f* gradient) {
    const Vec3d scaled = (at - grid.shift()) / grid.cell();
    const Vec3d low = scaled.array().floor();
    const Vec3f f = (scaled - low).cast<float>();
    const Index base = grid.slot({std::int32_t(low[0]), std::int32_t(low[1]), std::int32_t(low[2])});
    float c[8];
    for (int q = 0; q < 8; ++q) {
        Index slot = kNoIndex;
        if (base != kNoIndex)
            slot = grid.step(base, q & 1, q >> 1 & 1, q >> 2);
        else
            slot = grid.slot(
                {std::int32_t(low[0]) + (q & 1), std::int32_t(low[1]) + (q >> 1 & 1), std::int32_t(low[2]) + (q >> 2)});
        c[q] = slot == kNoIndex ? outside : values[slot];
    }
    const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
    const float x00 = mix(c[0], c[1], f[0]), x10 = mix(c[2], c[3], f[0]);
    const float x01 = mix(c[4], c[5], f[0]), x11 = mix(c[6], c[7], f[0]);
    const float y0 = mix(x00, x10, f[1]), y1 = mix(x01, x11, f[1]);
    if (gradient) {
        const float dx = mix(mix(c[1] - c[0], c[3] - c[2], f[1]), mix(c[5] - c[4], c[7] - c[6], f[1]), f[2]);
        *gradient = Vec3f(dx, mix(x10 - x00, x11 - x01, f[2]), y1 - y0) / float(grid.cell());
    }
    return mix(y0, y1, f[2]);
}

Vec3f smooth_gradient(const BlockGrid& grid, const std::vector<float>& values, float outside, const Vec3d& at) {
    const Vec3d scaled = (at - grid.shift()) / grid.cell();
    const Vec3d low = scaled.array().floor();
    const Vec3f part = (scaled - low).cast<float>();
    const GridNode node = {std::int32_t(low[0]), std::int32_t(low[1]), std::int32_t(low[2])};
    const Index base = grid.slot(node);
    const auto value = [&](int x, int y, int z) {
        const Index slot =
            base != kNoIndex ? grid.step(base, x, y, z) : grid.slot({node[0] + x, node[1] + y, node[2] + z});
        return slot == kNoIndex ? outside : values[slot];
    };
    Vec3f gradient = Vec3f::Zero();
    for (int q = 0; q < 8; ++q) {
        const int x = q & 1, y = q >> 1 & 1, z = q >> 2;
        const float weight = (x ? part[0] : 1 - part[0]) * (y ? part[1] : 1 - part[1]) * (z ? part[2] : 1 - part[2]);
        gradient += weight * Vec3f(value(x + 1, y, z) - value(x - 1, y, z), value(x, y + 1, z) - value(x, y - 1, z),
                                   value(x, y, z + 1) - value(x, y, z - 1));
    }
    return gradient / float(2 * grid.cell());
}

} // namespace filigree
