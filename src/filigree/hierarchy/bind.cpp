// Labels spread by Dijkstra's algorithm over the mesh's edges, so that a vertex is near its label along the surface,
// not through it. The walk compares a triangle with all that share a corner with it.
#include "filigree/hierarchy/bind.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/closest_point.h"

#include <algorithm>
#include <queue>

namespace filigree {

namespace {

/// Lists of numbers, one list an id, end to end.
struct Lists {
    std::vector<Index> offsets, items;
    std::span<const Index> operator[](Index id) const {
        return std::span(items).subspan(offsets[id], offsets[id + 1] - offsets[id]);
    }
};

/// For each vertex the triangles that use it, ascending.
Lists triangles_around(std::size_t vertex_count, std::span<const Triangle> triangles) {
    Lists lists;
    lists.offsets.assign(vertex_count + 1, 0);
    for (const Triangle& t : triangles)
        for (Index v : t) ++lists.offsets[v + 1];
    for (std::size_t v = 0; v < vertex_count; ++v) lists.offsets[v + 1] += lists.offsets[v];
    lists.items.resize(triangles.size() * 3);
    std::vector<Index> next(lists.offsets.begin(), lists.offsets.end() - 1);
    for (Index t = 0; t < triangles.size(); ++t)
        for (Index v : triangles[t]) lists.items[next[v]++] = t;
    return lists;
}

/// For each vertex the nearest vertex with `is_source`, by the length of the shortest path over edges; kNoIndex where
/// there is none. Ties go to the path found first, which depends on the mesh alone.
std::vector<Index> nearest_sources(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                   const Lists& around, const std::vector<bool>& is_source) {
    struct Entry {
        float distance;
        Index vertex;
        bool operator>(const Entry& other) const {
            return distance != other.distance ? distance > other.distance : vertex > other.vertex;
        }
    };
    std::vector<float> distance(positions.size(), std::numeric_limits<float>::infinity());
    std::vector<Index> source(positions.size(), kNoIndex);
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    for (Index v = 0; v < positions.size(); ++v)
        if (is_source[v]) {
            distance[v] = 0;
            source[v] = v;
            queue.push({0, v});
        }
    while (!queue.empty()) {
        const auto [d, v] = queue.top();
        queue.pop();
        if (d > distance[v]) continue;
        for (Index t : around[v])
            for (Index w : triangles[t]) {
                const float through = d + (positions[w] - positions[v]).norm();
                if (through < distance[w]) {
                    distance[w] = through;
                    source[w] = source[v];
                    queue.push({through, w});
                }
            }
    }
    return source;
}

/// The walk of one vertex over the driver's triangles.
class Walk {
public:
    Walk(std::span<const Vec3f> positions, std::span<const Triangle> cells, const Lists& around,
         std::span<const Vec3f> cell_normals)
        : positions_(positions), cells_(cells), around_(around), cell_normals_(cell_normals), visited_(cells.size(), 0) {}

    struct Found {
        SurfacePoint point;
        bool faces_away = true;
    };

    Found closest(const Vec3f& p, const Vec3f& normal, Index start) {
        if (++stamp_ == 0) {
            std::fill(visited_.begin(), visited_.end(), 0);
            stamp_ = 1;
        }
        Found best;
        visit_ring(start, p, normal, best);
        for (Index at = kNoIndex; at != best.point.triangle;) {
            at = best.point.triangle;
            for (Index corner : cells_[at]) visit_ring(corner, p, normal, best);
        }
        return best;
    }

private:
    void visit_ring(Index vertex, const Vec3f& p, const Vec3f& normal, Found& best) {
        for (Index t : around_[vertex]) {
            if (visited_[t] == stamp_) continue;
            visited_[t] = stamp_;
            const bool faces_away = cell_normals_[t].dot(normal) < 0;
            if (faces_away && !best.faces_away) continue;
            SurfacePoint point = closest_point_on_triangle(p, positions_[cells_[t][0]], positions_[cells_[t][1]],
                                                           positions_[cells_[t][2]]);
            const bool better = faces_away != best.faces_away
                                    ? !faces_away
                                    : point.distance < best.point.distance ||
                                          (point.distance == best.point.distance && t < best.point.triangle);
            if (!better) continue;
            point.triangle = t;
            best = {point, faces_away};
        }
    }

    std::span<const Vec3f> positions_;
    std::span<const Triangle> cells_;
    const Lists& around_;
    std::span<const Vec3f> cell_normals_;
    std::vector<unsigned> visited_;
    unsigned stamp_ = 0;
};

Bond bond_at(const SurfacePoint& point) { return {point.triangle, point.barycentric[1], point.barycentric[2]}; }

} // namespace

Result<Binding> bind_to_driver(std::span<const Vec3f> positions, std::span<const Index> representative,
                               std::span<const Triangle> triangles, std::span<const Vec3f> normals,
                               std::span<const Triangle> cells, const RunContext& context) {
    context.report("bind", 0);
    const std::size_t count = positions.size();
    std::vector<bool> in_driver(count, false);
    for (const Triangle& cell : cells)
        for (Index v : cell) in_driver[v] = true;
    const std::vector<Index> source =
        nearest_sources(positions, triangles, triangles_around(count, triangles), in_driver);
    if (context.is_cancelled()) return cancelled_error();
    context.report("bind", 0.4);

    const Lists around = triangles_around(count, cells);
    std::vector<Vec3f> cell_normals(cells.size());
    for (std::size_t c = 0; c < cells.size(); ++c) {
        const Vec3f& a = positions[cells[c][0]];
        cell_normals[c] = (positions[cells[c][1]] - a).cross(positions[cells[c][2]] - a);
    }

    enum : std::uint8_t { good, away, gap };
    Binding binding;
    binding.bonds.resize(count);
    std::vector<std::uint8_t> kind(count, good);
    parallel_for(context, count, 1 << 14, [&](std::size_t begin, std::size_t end) {
        if (context.is_cancelled()) return;
        Walk walk(positions, cells, around, cell_normals);
        for (std::size_t v = begin; v < end; ++v) {
            if (representative[v] != v) continue;
            if (source[v] == kNoIndex) {
                kind[v] = gap;
                continue;
            }
            const Walk::Found found = walk.closest(positions[v], normals[v], source[v]);
            binding.bonds[v] = bond_at(found.point);
            if (found.faces_away) kind[v] = away;
        }
    });
    if (context.is_cancelled()) return cancelled_error();

    if (std::find(kind.begin(), kind.end(), gap) != kind.end()) {
        const ClosestPointTree tree(positions, cells);
        parallel_for(context, count, 1 << 12, [&](std::size_t begin, std::size_t end) {
            for (std::size_t v = begin; v < end; ++v) {
                if (kind[v] != gap || representative[v] != v) continue;
                SurfacePoint point = tree.closest(positions[v], std::numeric_limits<double>::infinity(), normals[v]);
                if (point.triangle == kNoIndex) point = tree.closest(positions[v]);
                binding.bonds[v] = bond_at(point);
            }
        });
    }
    for (Index v = 0; v < count; ++v) {
        const Index r = representative[v];
        binding.bonds[v] = binding.bonds[r];
        if (kind[r] == gap) binding.across_gap.push_back(v);
        if (kind[r] == away) binding.facing_away.push_back(v);
    }
    context.report("bind", 1);
    return binding;
}

} // namespace filigree
