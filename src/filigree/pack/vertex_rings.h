// A closed map that grows by splits, as the neighbours of each vertex, side by side in memory, where half-edges would
// have to be followed from one to the next. Where a vertex is lies with them: a split asks for all of it.
#pragma once

#include "filigree/pack/closed_map.h"
#include "filigree/pack/geometry_code.h"

#include <array>
#include <cstdint>
#include <span>

namespace filigree {

/// Rings of the vertices that may split still. Others need none, however long theirs would be: those that close holes,
/// and those with more neighbours than kLongest, which never have fewer again.
class VertexRings {
public:
    static constexpr std::uint32_t kLongest = 56;

    VertexRings() = default;
    /// map: every half-edge has its opposite.
    VertexRings(const ClosedMap& map, std::span<const FinePlace> places, std::int32_t difference);

    std::size_t vertex_count() const { return sizes_.size(); }
    FinePlace& place(Index v) { return vertices_[v].place; }
    const FinePlace& place(Index v) const { return vertices_[v].place; }
    /// How large the difference was that the vertex was coded with, quarters of a step.
    std::int32_t& difference(Index v) { return vertices_[v].difference; }
    std::int32_t difference(Index v) const { return vertices_[v].difference; }
    bool closes_hole(Index v) const { return sizes_[v] == kHole; }
    bool is_kept(Index v) const { return sizes_[v] < kTooLong; }
    /// How many neighbours; more than kLongest where no ring is kept.
    std::uint32_t size(Index v) const { return sizes_[v]; }
    /// Clockwise, size(v) of them. Of a vertex whose ring is kept.
    const Index* ends(Index v) const {
        const ShortRing& ring = vertices_[v].ring;
        return sizes_[v] <= kShort ? ring.data() : long_[ring[0]].data();
    }
    /// Asks the processor for what lies at a vertex, or at its neighbours.
    void fetch(Index v) const { __builtin_prefetch(&vertices_[v]); }
    void fetch_ring(Index v) const {
        for (std::size_t i = 0; i < 8; ++i)
            if (const Index end = vertices_[v].ring[i]; end < vertices_.size()) fetch(end);
    }

    /// Room for vertices that splits bring.
    void add(std::size_t more);
    /// The triangles between neighbours `begin` to `begin` + `sector` of u, in its ring's order, become v's, which has
    /// no ring yet. False: the rings contradict each other. 0 < sector < size(u), begin < size(u).
    bool split(Index u, Index v, std::size_t begin, std::size_t sector);

    /// The map's, in an order that follows from the rings. Cost O(V).
    std::vector<Triangle> triangles() const;
    std::vector<bool> closes_hole() const; ///< of each vertex

private:
    static constexpr std::uint32_t kShort = 12, kTooLong = 254, kHole = 255;
    using ShortRing = std::array<Index, kShort>; ///< kNoIndex behind its end
    using LongRing = std::array<Index, kLongest + 1>;
    struct alignas(64) Vertex {
        FinePlace place{};
        std::int32_t difference = 0;
        ShortRing ring{}; ///< a longer one's number in long_ alone
    };

    bool is_lowest_kept(Index v, Index other) const { return other > v || !is_kept(other); }
    Index* own_ends(Index v) { return const_cast<Index*>(ends(v)); }
    void set(Index v, Index first, const Index* others, std::size_t count);
    std::size_t find(Index v, Index end) const;
    bool replace(Index v, Index end, Index by);
    bool insert(Index v, Index beside, Index end, bool is_behind);
    void give_up(Index v);

    std::vector<std::uint8_t> sizes_;
    std::vector<Vertex> vertices_;
    std::vector<LongRing> long_;
    std::vector<Index> free_;       ///< of long_
    std::vector<Triangle> between_; ///< those of three vertices without rings
};

} // namespace filigree
