// A map level by level: the coarsest, then splits of vertices that make it finer, best first [Hoppe 1996, in batches as
// Pajarola and Rossignac 2000], then what makes places more precise. Every stream's beginning is a mesh.
#pragma once

#include "filigree/coding/closed_map.h"
#include "filigree/coding/geometry_code.h"
#include "filigree/coding/wedge.h"

#include <memory>
#include <string_view>

namespace filigree {

/// Takes the streams of PackedLevels one after the other: the coarsest, levels, refinements. Every machine reads the
/// same; memory is what has been read.
class LevelReader {
public:
    LevelReader(GeometrySteps steps, bool is_refined, std::size_t most_vertices);
    ~LevelReader();
    LevelReader(LevelReader&&) noexcept;
    LevelReader& operator=(LevelReader&&) noexcept;

    /// False, of each: it is damaged, and so is what this reader holds.
    /// attributes: empty where levels have none.
    bool read_coarsest(std::string_view connectivity, std::string_view places, std::string_view attributes = {});
    bool read_level(std::string_view splits, std::uint32_t batches);
    /// Makes the places of levels more precise, in their order, when all levels are read. The coarsest is precise.
    bool refine_level(std::string_view refinement);

    /// Those that close holes included. Cost O(size).
    std::vector<Triangle> triangles() const;
    std::vector<bool> closes_hole() const; ///< of each vertex
    ClosedMap map() const;                 ///< of the same triangles. Cost O(size)
    FinePlace place(Index vertex) const;
    std::size_t vertex_count() const;
    /// Of each vertex, one that was there before it and is beside it; of the coarsest's, itself.
    std::span<const Index> parents() const;

    const AttributeOutline& outline() const;   ///< of attributes; empty where levels have none
    std::span<const Wedge> wedges() const;     ///< those of coarser levels first
    std::span<const ByteColor> colors() const; ///< of each vertex, or none
    /// Of each corner of triangles(): its wedge; kNoIndex beside holes.
    std::vector<Index> corner_wedges(std::span<const Triangle> triangles) const;

private:
    class Reading;
    std::unique_ptr<Reading> reading_;
};

} // namespace filigree
