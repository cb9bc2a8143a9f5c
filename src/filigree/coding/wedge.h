// What a surface has besides places while it grows: wedges of vertices, and what their numbers mean.
#pragma once

#include "filigree/types.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace filigree {

/// What corners of one vertex have in common that lie beside each other and agree [wedges, Hoppe 1998].
struct Wedge {
    Index vertex = kNoIndex;
    Index parent = kNoIndex; ///< the wedge that it went onto, of the vertex that its vertex went onto; else itself
    Index material = kNoIndex;
    bool has_uv = false;
    std::array<std::int32_t, 2> uv{}; ///< steps
};

inline constexpr unsigned kUvBits = 12; ///< of texture coordinates, along the longer side of their box

using ByteColor = std::array<std::uint8_t, 4>;

/// A channel of 0 to 1 as a byte; what is outside is moved to the nearer end.
inline std::uint8_t color_byte(float channel) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(channel, 0.0f, 1.0f) * 255));
}

/// What wedges and colours mean.
struct AttributeOutline {
    bool has_uvs = false, uvs_per_vertex = false, has_materials = false, has_colors = false, has_alpha = false;
    Vec2f uv_low = Vec2f::Zero(); ///< texture coordinates at steps of 0
    float uv_step = 0;

    bool empty() const { return !has_uvs && !has_materials && !has_colors; }
    unsigned channels() const { return has_alpha ? 4 : 3; } ///< of colours
    Vec2f uv(const Wedge& wedge) const { return uv_low + uv_step * Vec2f(float(wedge.uv[0]), float(wedge.uv[1])); }
    static Vec4f color(const ByteColor& c) { return Vec4f(c[0], c[1], c[2], c[3]) / 255; }
};

} // namespace filigree
