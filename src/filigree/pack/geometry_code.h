// Where the vertices of a map are: each is predicted from triangles that are known, best known first, and the
// difference is coded in the frame of the surface there, where its normal part is small. Every machine reads the same.
#pragma once

#include "filigree/pack/closed_map.h"
#include "filigree/pack/symbols.h"

#include <array>
#include <utility>

namespace filigree {

/// Contexts of a SymbolWriter that places take, from `first` on.
inline constexpr unsigned kGeometryContexts = 160;

/// A place in sixteenths of a step, 2^22 at most.
using FinePlace = std::array<std::int32_t, 3>;
inline constexpr std::int32_t kFine = 16;

struct GeometrySteps {
    std::int32_t normal = 1, tangential = 1; ///< sizes of the steps along the normal and across it
};

/// Calls encode(writer, is_turned), where is_turned says whether differences are along frames of the surface (scans) or
/// along the axes (what was laid out along them), keeps the shorter of the two, and tells readers by a bit in front.
template <class Encode>
std::vector<FinePlace> encode_shorter(GeometrySteps steps, SymbolWriter& out, const Encode& encode) {
    SymbolWriter turned = out, straight = out;
    turned.bits(true, 1);
    std::vector<FinePlace> read = encode(turned, true);
    if (steps.normal != steps.tangential) { // they are along the surface or across it
        out = std::move(turned);
        return read;
    }
    straight.bits(false, 1);
    std::vector<FinePlace> read_straight = encode(straight, false);
    const bool is_turned = turned.size() <= straight.size();
    out = std::move(is_turned ? turned : straight);
    return is_turned ? read : read_straight;
}

/// Writes places, of vertices that close no hole. Returns them as they will be read: half a step off at most, along
/// each axis of their own. Cost O(V).
std::vector<FinePlace> encode_geometry(const ClosedMap& map, std::span<const FinePlace> places, GeometrySteps steps,
                                       unsigned first_context, SymbolWriter& out);

std::vector<FinePlace> decode_geometry(const ClosedMap& map, GeometrySteps steps, unsigned first_context,
                                       SymbolReader& in);

} // namespace filigree
