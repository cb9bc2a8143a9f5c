#include "filigree/mesh/incidence.h"

#include <cassert>
#include <numeric>

namespace filigree {
namespace {

/// Counting sort: item_of(c) goes to the list of corners[c].
template <class ItemOf>
IndexLists lists_by_vertex(std::span<const Index> corners, std::size_t vertex_count, const ItemOf& item_of) {
    IndexLists lists;
    lists.offsets.assign(vertex_count + 1, 0);
    for (const Index vertex : corners) ++lists.offsets[vertex + 1];
    std::inclusive_scan(lists.offsets.begin(), lists.offsets.end(), lists.offsets.begin());
    lists.items.resize(corners.size());
    std::vector<Index> next(lists.offsets.begin(), lists.offsets.end() - 1);
    for (Index c = 0; c < corners.size(); ++c) lists.items[next[corners[c]]++] = item_of(c);
    return lists;
}

} // namespace

std::optional<Error> too_many_triangles(std::size_t count) {
    if (count <= kMostListedTriangles) return std::nullopt;
    return Error{ErrorCode::unsuitable, "The mesh has more triangles than 32-bit indices can list (" +
                                            std::to_string(kMostListedTriangles) + "); split it into parts."};
}

IndexLists corners_at_vertices(std::span<const Index> corners, std::size_t vertex_count) {
    assert(corners.size() < kNoIndex);
    return lists_by_vertex(corners, vertex_count, [](Index corner) { return corner; });
}

IndexLists triangles_at_vertices(std::span<const Triangle> triangles, std::size_t vertex_count) {
    assert(triangles.size() <= kMostListedTriangles);
    if (triangles.empty()) return lists_by_vertex({}, vertex_count, [](Index corner) { return corner; });
    const std::span<const Index> corners(triangles.front().data(), 3 * triangles.size());
    return lists_by_vertex(corners, vertex_count, [](Index corner) { return corner / 3; });
}

} // namespace filigree
