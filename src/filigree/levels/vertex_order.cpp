#include "filigree/levels/vertex_order.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/morton.h"

#include <array>
#include <numeric>

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

constexpr unsigned kDigit = 10; // bits; three of them are a place along Morton's curve

/// Stable, so that vertices at one place stay as they come.
std::vector<Index> sorted_by_place(std::span<const std::uint32_t> places) {
    std::vector<Index> order(places.size()), sorted(places.size());
    std::iota(order.begin(), order.end(), Index{0});
    for (unsigned shift = 0; shift < 3 * kDigit; shift += kDigit) {
        const auto digit = [&](Index v) { return places[v] >> shift & ((1u << kDigit) - 1); };
        std::array<Index, (1u << kDigit) + 1> begin{};
        for (const Index v : order) ++begin[digit(v) + 1];
        std::partial_sum(begin.begin(), begin.end(), begin.begin());
        for (const Index v : order) sorted[begin[digit(v)]++] = v;
        order.swap(sorted);
    }
    return order;
}

} // namespace

std::vector<Index> order_by_place(const Mesh& mesh, const RunContext& context) {
    const MortonOrder places(bounds(mesh.positions));
    std::vector<std::uint32_t> at(mesh.vertex_count());
    parallel_for(context, at.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) at[v] = places.key(mesh.positions[v]);
    });
    return sorted_by_place(at);
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
