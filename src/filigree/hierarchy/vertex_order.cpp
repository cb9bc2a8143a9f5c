#include "filigree/hierarchy/vertex_order.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/morton.h"

#include <tbb/parallel_sort.h>

namespace filigree {

namespace {

template <class T>
void put_in_order(std::vector<T>& values, std::span<const Index> order, const RunContext& context) {
    if (values.size() != order.size()) return;
    std::vector<T> moved(values.size());
    parallel_for(context, order.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) moved[i] = values[order[i]];
    });
    values = std::move(moved);
}

} // namespace

std::vector<Index> order_by_place(const Mesh& mesh, const RunContext& context) {
    const MortonOrder places(bounds(mesh.positions));
    std::vector<std::uint64_t> keys(mesh.vertex_count()); // the place, then the vertex
    parallel_for(context, keys.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) keys[v] = std::uint64_t(places.key(mesh.positions[v])) << 32 | v;
    });
    context.execute([&] { tbb::parallel_sort(keys.begin(), keys.end()); });
    std::vector<Index> order(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) order[i] = static_cast<Index>(keys[i]);
    return order;
}

Mesh with_vertex_order(Mesh mesh, std::span<const Index> order, const RunContext& context) {
    put_in_order(mesh.positions, order, context);
    if (mesh.uvs.per_vertex()) put_in_order(mesh.uvs.values, order, context);
    if (mesh.normals.per_vertex()) put_in_order(mesh.normals.values, order, context);
    put_in_order(mesh.colors, order, context);
    for (VertexScalar& scalar : mesh.scalars) put_in_order(scalar.values, order, context);
    const std::vector<Index> place = inverse_order(order);
    parallel_for(context, mesh.corners.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) mesh.corners[c] = place[mesh.corners[c]];
    });
    return mesh;
}

} // namespace filigree
