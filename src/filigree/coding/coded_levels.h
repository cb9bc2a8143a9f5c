// A map level by level, as streams: what LevelReader reads.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace filigree {

struct PackedLevel {
    std::uint32_t batches = 0, vertices = 0, triangles = 0; ///< the map's after it, those that close holes included
    std::string splits = {}, refinement = {};
};

struct PackedLevels {
    std::uint32_t vertices = 0, triangles = 0;                   ///< the coarsest's
    std::string connectivity = {}, places = {}, attributes = {}; ///< attributes: where levels have any
    std::vector<PackedLevel> levels = {}; ///< each about twice as many vertices as the one before
};

} // namespace filigree
