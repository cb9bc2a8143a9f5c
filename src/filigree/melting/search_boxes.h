// Particles sorted into boxes, to find those around a place.
#pragma once

#include "filigree/melting/block_grid.h"

#include <algorithm>

namespace filigree {

/// Particles sorted into boxes as wide as the search.
struct SearchBoxes {
    struct Entry {
        std::uint64_t key;
        Index particle;
    };
    std::vector<Entry> entries;
    std::vector<std::size_t> starts; ///< of boxes, and the end
    BlockGrid lookup;                ///< a box is a block: entries are in the order of its keys

    explicit SearchBoxes(const std::vector<Vec3f>& positions, double width) {
        entries.resize(positions.size());
        std::vector<std::uint64_t> keys(positions.size());
        for (Index i = 0; i < positions.size(); ++i) {
            const Vec3d at = (positions[i].cast<double>() / width).array().floor();
            keys[i] = BlockGrid::key_of_block(std::int32_t(at[0]), std::int32_t(at[1]), std::int32_t(at[2]));
            entries[i] = {keys[i], i};
        }
        std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
            return a.key != b.key ? a.key < b.key : a.particle < b.particle;
        });
        lookup = BlockGrid(width, Vec3d::Zero(), std::move(keys));
        starts.reserve(lookup.block_count() + 1);
        for (std::size_t i = 0; i < entries.size(); ++i)
            if (i == 0 || entries[i].key != entries[i - 1].key) starts.push_back(i);
        starts.push_back(entries.size());
    }
};

} // namespace filigree
