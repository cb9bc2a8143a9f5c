#include "filigree/coding/vertex_rings.h"

#include <algorithm>

namespace filigree {

VertexRings::VertexRings(const ClosedMap& map, std::span<const FinePlace> places, std::int32_t difference) {
    const std::size_t count = map.vertex_count();
    std::vector<Index> spokes(count, kNoIndex);
    std::vector<std::uint32_t> degrees(count, 0);
    for (Index h = 0; h < map.opposite.size(); ++h) {
        spokes[map.origin(h)] = h;
        ++degrees[map.origin(h)];
    }
    add(count);
    for (Index v = 0; v < count; ++v) {
        vertices_[v].place = places[v];
        vertices_[v].difference = difference;
        if (map.closes_hole[v] || degrees[v] > kLongest) {
            sizes_[v] = std::uint8_t(map.closes_hole[v] ? kHole : kTooLong);
            continue;
        }
        LongRing ring;
        Index h = spokes[v];
        for (std::size_t i = 0; i < degrees[v]; ++i, h = map.turn_clockwise(h)) ring[i] = map.origin(next_half_edge(h));
        if (degrees[v] > 0) set(v, ring[0], ring.data() + 1, degrees[v] - 1);
    }
    for (const Triangle& t : map.triangles)
        if (std::ranges::none_of(t, [&](Index v) { return is_kept(v); })) between_.push_back(t);
}

void VertexRings::add(std::size_t more) {
    sizes_.resize(sizes_.size() + more, 0);
    vertices_.resize(sizes_.size());
}

// Rings of up to kShort are moved whole, in loops of a fixed length: how long they are cannot be guessed.

void VertexRings::set(Index v, Index first, const Index* others, std::size_t count) {
    sizes_[v] = std::uint8_t(count + 1);
    if (count < kShort) {
        ShortRing& ring = vertices_[v].ring;
        ring.fill(kNoIndex);
        ring[0] = first;
        std::copy_n(others, count, ring.data() + 1);
        return;
    }
    if (free_.empty()) {
        free_.push_back(static_cast<Index>(long_.size()));
        long_.emplace_back();
    }
    vertices_[v].ring[0] = free_.back();
    free_.pop_back();
    own_ends(v)[0] = first;
    std::copy_n(others, count, own_ends(v) + 1);
}

bool VertexRings::split(Index u, Index v, std::size_t begin, std::size_t sector) {
    const std::size_t size = sizes_[u];
    std::array<Index, 2 * kLongest + kShort> twice; // so that u's ring goes on from `begin`, and `begin` comes again
    std::copy_n(ends(u), size, twice.data());
    std::copy_n(ends(u), size, twice.data() + size);
    if (size > kShort) free_.push_back(vertices_[u].ring[0]);
    const Index* around = twice.data() + begin;
    const Index left = around[0], right = around[sector];
    set(v, u, around, sector + 1);
    set(u, v, around + sector, size - sector + 1);
    for (std::size_t k = 1; k < sector; ++k)
        if (!replace(around[k], u, v)) return false;
    if (!insert(left, u, v, false) || !insert(right, u, v, true)) return false;
    for (const Index w : {u, v, left, right})
        if (sizes_[w] == kLongest + 1) give_up(w);
    return true;
}

/// Where a ring has a vertex; somewhere else where it has not.
std::size_t VertexRings::find(Index v, Index end) const {
    if (sizes_[v] > kShort) return std::size_t(std::find(ends(v), ends(v) + sizes_[v] - 1, end) - ends(v));
    const ShortRing& ring = vertices_[v].ring;
    unsigned at = 0;
    for (unsigned i = 0; i < kShort; ++i) at += ring[i] == end ? i : 0;
    return std::min(at, kShort - 1);
}

bool VertexRings::replace(Index v, Index end, Index by) {
    if (!is_kept(v)) return true;
    Index& found = own_ends(v)[find(v, end)];
    if (found != end) return false;
    found = by;
    return true;
}

bool VertexRings::insert(Index v, Index beside, Index end, bool is_behind) {
    if (!is_kept(v)) return true;
    std::size_t at = find(v, beside);
    const std::size_t size = sizes_[v];
    if (ends(v)[at] != beside || size > kLongest) return false;
    at += is_behind;
    if (size < kShort) {
        std::array<Index, kShort + 1> before;
        ShortRing& ring = vertices_[v].ring;
        std::copy_n(ring.data(), kShort, before.data() + 1);
        before[0] = end;
        for (std::size_t i = 0; i < kShort; ++i) ring[i] = i < at ? before[i + 1] : i == at ? end : before[i];
        sizes_[v] = std::uint8_t(size + 1);
        return true;
    }
    LongRing longer;
    std::copy_n(ends(v), at, longer.data());
    longer[at] = end;
    std::copy_n(ends(v) + at, size - at, longer.data() + at + 1);
    if (size > kShort) free_.push_back(vertices_[v].ring[0]);
    set(v, longer[0], longer.data() + 1, size);
    return true;
}

/// It has become too long to split.
void VertexRings::give_up(Index v) {
    const std::size_t size = sizes_[v];
    const Index place = vertices_[v].ring[0];
    const LongRing& ring = long_[place];
    sizes_[v] = kTooLong;
    for (std::size_t i = 0; i < size; ++i) {
        const Index a = ring[(i + 1) % size], b = ring[i];
        if (!is_kept(a) && !is_kept(b)) between_.push_back({v, a, b});
    }
    free_.push_back(place);
}

std::vector<Triangle> VertexRings::triangles() const {
    std::vector<Triangle> triangles;
    triangles.reserve(2 * vertex_count());
    for (Index v = 0; v < vertex_count(); ++v) {
        if (!is_kept(v) || sizes_[v] == 0) continue;
        const std::size_t size = sizes_[v];
        const Index* ring = ends(v);
        Index before = ring[size - 1];
        for (std::size_t i = 0; i < size; ++i) {
            const Index end = ring[i];
            if (is_lowest_kept(v, end) && is_lowest_kept(v, before)) triangles.push_back({v, end, before});
            before = end;
        }
    }
    triangles.insert(triangles.end(), between_.begin(), between_.end());
    return triangles;
}

std::vector<bool> VertexRings::closes_hole() const {
    std::vector<bool> closes(vertex_count());
    for (Index v = 0; v < closes.size(); ++v) closes[v] = closes_hole(v);
    return closes;
}

} // namespace filigree
