// Which triangles a closed map has, by the degrees of its vertices [Touma and Gotsman 1998; Alliez and Desbrun 2001]:
// about two bits a vertex for scans, next to none for regular meshes.
#pragma once

#include "filigree/pack/closed_map.h"
#include "filigree/pack/symbols.h"

#include <optional>

namespace filigree {

/// Contexts of a SymbolWriter that connectivity takes, from 0 on.
inline constexpr unsigned kConnectivityContexts = 34;

/// A map in the order in which it is decoded.
struct WalkedMap {
    ClosedMap map;
    std::vector<Index> vertex;    ///< of each vertex: which one it was before; of an encoder alone
    std::vector<Index> half_edge; ///< of each triangle: its first half-edge before; of an encoder alone
};

/// Writes the connectivity. Cost O(F).
WalkedMap encode_connectivity(const ClosedMap& map, SymbolWriter& out);

/// Reads it. None: damaged, or it has more than `most_triangles`, those that close holes included. Cost O(F).
std::optional<WalkedMap> decode_connectivity(SymbolReader& in, std::size_t most_triangles);

} // namespace filigree
