#include "filigree/remesh/tips.h"

#include "filigree/remesh/manifold_surface.h"
#include <algorithm>
#include <queue>
#include <unordered_map>

namespace filigree {

namespace {

constexpr double kRegion = 0.5; // of the bound: what lies between tips further out than this is one region
constexpr double kReach = 1.5;  // of a tip's distance: the rest of its region that near follows when it is held

/// The vertices around each vertex of a surface.
class Neighbours {
public:
    Neighbours(const ManifoldSurface& surface, std::span<const Index> twins)
        : triangles_(surface.triangles), twins_(twins), out_(surface.positions.size(), kNoIndex) {
        for (Index h = 0; h < twins.size(); ++h)
            if (Index& out = out_[half_edge_start(triangles_, h)]; out == kNoIndex || twins[h] == kNoIndex) out = h;
    }

    /// A half-edge that leaves the vertex; on borders the first, counter-clockwise.
    Index out(Index vertex) const { return out_[vertex]; }

    /// Calls act(neighbour, a triangle of the two) for each.
    template <class Act>
    void for_each(Index vertex, const Act& act) const {
        Index h = out_[vertex];
        do {
            act(half_edge_end(triangles_, h), h / 3);
            const Index before = previous_half_edge(h);
            h = twins_[before];
            if (h == kNoIndex) {
                act(half_edge_start(triangles_, before), before / 3);
                return;
            }
        } while (h != out_[vertex]);
    }

private:
    std::span<const Triangle> triangles_;
    std::span<const Index> twins_;
    std::vector<Index> out_;
};

/// Shortest paths along edges from a vertex to the nearest vertex of a grid.
class NearestGridVertex {
public:
    NearestGridVertex(const ManifoldSurface& surface, const Neighbours& neighbours, const PatchGrid& grid)
        : surface_(surface), neighbours_(neighbours), grid_(grid) {
        for (Index v = 0; v < grid.positions.size(); ++v) in_triangle_[grid.source[v].triangle].push_back(v);
    }

    /// Of those inside that are not held; kNoIndex where there is none.
    Index from(Index start) {
        queue_ = {};
        reached_.clear();
        best_ = std::numeric_limits<double>::infinity();
        Index found = kNoIndex;
        reach(start, 0);
        while (!queue_.empty()) {
            const double distance = queue_.top().first;
            const Index vertex = queue_.top().second;
            queue_.pop();
            if (distance >= best_) break;
            if (distance > reached_[vertex]) continue;
            neighbours_.for_each(vertex, [&](Index next, Index triangle) {
                if (const Index v = closest_in(triangle, vertex, distance); v != kNoIndex) found = v;
                reach(next, distance + (surface_.positions[next] - surface_.positions[vertex]).norm());
            });
        }
        return found;
    }

private:
    using Entry = std::pair<double, Index>;

    void reach(Index vertex, double distance) {
        const auto [entry, fresh] = reached_.try_emplace(vertex, distance);
        if (!fresh && entry->second <= distance) return;
        entry->second = distance;
        queue_.emplace(distance, vertex);
    }

    /// The grid vertex in the triangle that is nearer than any before.
    Index closest_in(Index triangle, Index vertex, double distance) {
        Index found = kNoIndex;
        const auto here = in_triangle_.find(triangle);
        if (here == in_triangle_.end()) return found;
        for (const Index v : here->second) {
            if (grid_.kinds[v] != VertexKind::inside || grid_.held[v] > 0) continue;
            const double there = distance + (grid_.positions[v] - surface_.positions[vertex]).norm();
            if (!(there < best_)) continue;
            best_ = there;
            found = v;
        }
        return found;
    }

    const ManifoldSurface& surface_;
    const Neighbours& neighbours_;
    const PatchGrid& grid_;
    std::unordered_map<Index, std::vector<Index>> in_triangle_; ///< grid vertices, ascending
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
    std::unordered_map<Index, double> reached_;
    double best_ = 0;
};

} // namespace

std::vector<Index> find_tips(const ManifoldSurface& surface, std::span<const Index> twins,
                             std::span<const VertexKind> kinds, std::span<const float> distances, double bound) {
    if (std::ranges::none_of(distances, [&](float d) { return d > bound; })) return {};
    const Neighbours neighbours(surface, twins);
    std::vector<std::uint8_t> seen(surface.positions.size(), 0);
    std::vector<Index> tips, region;
    const auto visit = [&](Index v) {
        if (seen[v] || !(distances[v] > kRegion * bound)) return;
        seen[v] = 1;
        region.push_back(v);
    };
    for (Index start = 0; start < seen.size(); ++start) {
        if (!(distances[start] > bound)) continue;
        region.clear();
        visit(start);
        for (std::size_t i = 0; i < region.size(); ++i)
            neighbours.for_each(region[i], [&](Index v, Index) { visit(v); });
        std::ranges::sort(region, [&](Index a, Index b) {
            return distances[a] != distances[b] ? distances[a] > distances[b] : a < b;
        });
        const std::size_t first = tips.size();
        for (const Index v : region) {
            if (!(distances[v] > bound)) break;
            const auto follows = [&](Index tip) {
                return (surface.positions[tip] - surface.positions[v]).norm() < kReach * distances[tip];
            };
            if (kinds[v] == VertexKind::inside && std::ranges::none_of(std::span(tips).subspan(first), follows))
                tips.push_back(v);
        }
    }
    return tips;
}

std::size_t hold_tips(const ManifoldSurface& surface, std::span<const Index> twins, std::span<const Index> tips,
                      double leash, PatchGrid& grid) {
    const Neighbours neighbours(surface, twins);
    NearestGridVertex nearest(surface, neighbours, grid);
    std::size_t held = 0;
    for (const Index tip : tips) {
        const Index v = nearest.from(tip);
        if (v == kNoIndex) continue;
        const Index h = neighbours.out(tip);
        grid.positions[v] = surface.positions[tip];
        grid.source[v] = {h / 3, Vec3d::Unit(h % 3)};
        grid.held[v] = static_cast<float>(leash);
        ++held;
    }
    return held;
}

} // namespace filigree
