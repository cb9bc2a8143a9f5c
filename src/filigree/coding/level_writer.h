// Writes a map level by level, as level_reader.h reads it.
#pragma once

#include "filigree/coding/coded_levels.h"
#include "filigree/coding/connectivity_code.h"
#include "filigree/coding/geometry_code.h"
#include "filigree/coding/level_attributes.h"
#include "filigree/context.h"

namespace filigree {

struct LevelCodeOptions {
    std::size_t fewest = 500; ///< vertices of the coarsest level, or more where none can go
    GeometrySteps steps;      ///< of the levels
    bool is_refined = false;  ///< whether quarters of the steps follow, which are four then
};

struct EncodedLevels {
    PackedLevels code;
    WalkedMap walked;                 ///< the whole map, as a reader will have it
    std::vector<FinePlace> read = {}; ///< its places
};

/// attributes: of the map. Where seams are so dense that the coarsest level would not be coarse, levels go without.
/// Cost O(V log V), about 3 processor seconds a million vertices.
EncodedLevels encode_levels(const ClosedMap& map, std::span<const FinePlace> places,
                            const SurfaceAttributes& attributes, const LevelCodeOptions& options,
                            const RunContext& context);

} // namespace filigree
