// Based on: quadric error metrics [Garland 1997], in two stages. meshoptimizer takes off the bulk at 2 M triangles a
// second; the last levels, which become the driver, are made by our own collapses, which spread their vertices evenly
// and are not held back by scraps, seams and non-manifold places. meshoptimizer counts triangles and we vertices, so
// its target is corrected by the ratio reached.
#include "filigree/levels/simplify.h"

#include "filigree/levels/edge_collapse.h"
#include "filigree/levels/roughen.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <meshoptimizer.h>

namespace filigree {

namespace {

/// Vertices from which our own collapses take over: they are an eighth as fast, so they only get what is left.
constexpr std::size_t kFinishFrom = 20'000;
/// Triangles at a vertex from which they do all: meshoptimizer takes quadratic time there, minutes from 100,000 on.
constexpr std::size_t kLargestBulkFan = 4096;

std::size_t count_vertices(std::span<const Triangle> triangles, std::size_t vertex_count) {
    std::vector<bool> seen(vertex_count, false);
    std::size_t count = 0;
    for (const Triangle& t : triangles)
        for (Index v : t) {
            count += !seen[v];
            seen[v] = true;
        }
    return count;
}

std::size_t largest_fan(std::span<const Triangle> triangles, std::size_t vertex_count) {
    std::vector<Index> counts(vertex_count, 0);
    for (const Triangle& t : triangles)
        for (Index v : t) ++counts[v];
    return counts.empty() ? 0 : *std::ranges::max_element(counts);
}

/// Edges longer than `limit`, ascending: the smaller end first.
std::vector<std::pair<Index, Index>> long_edges(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                                double limit) {
    std::vector<std::pair<Index, Index>> edges;
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) {
            const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
            if (double((positions[a] - positions[b]).squaredNorm()) > limit * limit) edges.emplace_back(a, b);
        }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
}

/// One call of meshoptimizer that leaves about `ratio` of the triangles; false when it could not go on.
bool collapse_bulk(std::span<const Vec3f> positions, double ratio, double max_error, Simplified& current) {
    if (largest_fan(current.triangles, positions.size()) > kLargestBulkFan) return false;
    const std::vector<Vec3f> rough = roughened(positions, current.triangles);
    const double longest_side = bounds(rough).size().maxCoeff();
    std::vector<Triangle> out(current.triangles.size());
    float relative_error = 0; // to the longest side
    const auto target = static_cast<std::size_t>(double(current.triangles.size()) * ratio);
    const std::size_t indices =
        meshopt_simplify(out.data()->data(), current.triangles.data()->data(), current.triangles.size() * 3,
                         rough.data()->data(), rough.size(), sizeof(Vec3f), target * 3,
                         static_cast<float>(std::min(max_error / longest_side, 1e6)), 0, &relative_error);
    if (indices == 0 || indices / 3 == current.triangles.size()) return false;
    out.resize(indices / 3);
    current.triangles = std::move(out);
    current.error = std::max(current.error, double(relative_error) * longest_side);
    current.vertex_count = count_vertices(current.triangles, positions.size());
    return true;
}

Simplified not_simplified(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
    Simplified whole;
    whole.triangles.assign(triangles.begin(), triangles.end());
    whole.vertex_count = count_vertices(triangles, positions.size());
    return whole;
}

/// meshoptimizer's part: down to about `target` vertices, or as far as it goes.
Simplified simplify_bulk(std::span<const Vec3f> positions, std::span<const Triangle> triangles, std::size_t target,
                         double max_error, const RunContext& context) {
    Simplified current = not_simplified(positions, triangles);
    for (int round = 0; round < 6 && current.vertex_count * 50 > target * 51 && !context.is_cancelled(); ++round)
        if (!collapse_bulk(positions, double(target) / double(current.vertex_count), max_error, current)) break;
    return current;
}

/// As far as it goes without an edge that is longer than max_edge (model units) and not in the input: half as far until
/// there is none.
Simplified simplify_bulk(std::span<const Vec3f> positions, std::span<const Triangle> triangles, std::size_t target,
                         double max_error, double max_edge, const RunContext& context) {
    const std::size_t whole = count_vertices(triangles, positions.size());
    const auto may_be_long = long_edges(positions, triangles, max_edge);
    for (; target < whole && !context.is_cancelled(); target *= 2) {
        Simplified bulk = simplify_bulk(positions, triangles, target, max_error, context);
        if (std::ranges::includes(may_be_long, long_edges(positions, bulk.triangles, max_edge))) return bulk;
    }
    return not_simplified(positions, triangles);
}

} // namespace

Simplified simplify(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                    const SimplifyOptions& options, const RunContext& context) {
    if (triangles.empty() || (!options.target_vertices && !options.max_error))
        return not_simplified(positions, triangles);

    const double diagonal = bounds(positions).diagonal();
    const double max_error = options.max_error.value_or(1e6) * diagonal;
    const std::size_t target = std::max<std::size_t>(options.target_vertices.value_or(3), 3);
    const std::size_t bulk_target = std::max(target, kFinishFrom);
    EdgeCollapseOptions collapse{.target_vertices = target};
    if (options.max_error) collapse.max_error = max_error;
    if (options.max_edge) collapse.max_edge = *options.max_edge * diagonal;
    Simplified current = collapse.max_edge
                             ? simplify_bulk(positions, triangles, bulk_target, max_error, *collapse.max_edge, context)
                             : simplify_bulk(positions, triangles, bulk_target, max_error, context);
    if (current.vertex_count * 50 > target * 51) {
        EdgeCollapseResult finished = collapse_edges(positions, current.triangles, collapse, context);
        current.triangles = std::move(finished.triangles);
        current.vertex_count = finished.vertex_count;
        current.error = std::max(current.error, finished.error);
        current.forced = finished.forced;
    }
    if (diagonal > 0) current.error /= diagonal; // else all is at one place, and nothing is off
    return current;
}

} // namespace filigree
