#include "filigree/remesh/feature_curves.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/math.h"
#include "filigree/mesh/edges.h"
#include "filigree/remesh/manifold_surface.h"
#include "filigree/types.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr double kCornerTurn = radians(45); // between chords of kCornerReach
constexpr int kMostSteps = 512;             // along a curve, however densely its vertices lie
constexpr double kCornerReach = 0.25;       // patch sides, to either side of a vertex
// Noise makes short curves that are hardly sharp. In patch sides, for chains with a free end and for closed ones: what
// is too short in any case, and from where on a curve need not be clearly sharp.
constexpr double kShortestChain = 1, kLongChain = 3;
constexpr double kShortestLoop = 0.5, kLongLoop = 3;
constexpr int kPruningRounds = 4;
constexpr double kSmallNetwork = 1.5;         // patch sides, of all its edges together
constexpr double kClearlySharp = radians(20); // beyond the asked angle, on average along the curve

struct Curves {
    const ManifoldSurface& surface;
    /// An edge from a vertex, along a curve.
    struct Edge {
        Index end;
        float angle; ///< radians
    };
    Lists<Edge> edges; ///< of each vertex: sharp ones and borders

    std::size_t degree(Index v) const { return edges[v].size(); }
    double length(Index a, Index b) const { return (surface.positions[a] - surface.positions[b]).norm(); }
    double angle(Index from, Index to) const {
        if (degree(to) < degree(from)) std::swap(from, to); // the ends of spokes know them sooner than the hub
        return std::ranges::find(edges[from], to, &Edge::end)->angle;
    }
    /// The neighbour of a curve vertex that is not `from`.
    Index onward(Index v, Index from) const { return edges[v][edges[v][0].end == from ? 1 : 0].end; }
};

/// marked: the angle of half-edges that are sharp, else 0; each edge counts once.
Curves collect(const ManifoldSurface& surface, std::span<const Index> twins, std::span<const float> marked) {
    return {surface, make_lists<Curves::Edge>(surface.positions.size(), [&](const auto& add) {
                for (Index h = 0; h < twins.size(); ++h) {
                    if (twins[h] != kNoIndex && !(marked[h] > 0 && h < twins[h])) continue;
                    const Index a = half_edge_start(surface.triangles, h), b = half_edge_end(surface.triangles, h);
                    add(a, {b, marked[h]});
                    add(b, {a, marked[h]});
                }
            })};
}

struct Chain {
    std::vector<Index> vertices; ///< end to end; a closed one repeats its first
    double length = 0;
    double angle = 0; ///< of its edges, the mean by length
};

/// Chains between vertices of degree other than two, then closed ones.
std::vector<Chain> chains_of(const Curves& curves) {
    std::vector<Chain> chains;
    const std::size_t vertex_count = curves.surface.positions.size();
    std::vector<std::uint8_t> seen(vertex_count, 0);
    const auto walk = [&](Index start, Index second) {
        Chain chain;
        chain.vertices = {start};
        Index from = start, at = second;
        for (;;) {
            chain.vertices.push_back(at);
            const double step = curves.length(from, at);
            chain.length += step;
            chain.angle += step * curves.angle(from, at);
            if (curves.degree(at) != 2 || at == start) {
                if (chain.length > 0) chain.angle /= chain.length;
                return chain;
            }
            seen[at] = 1;
            const Index onward = curves.onward(at, from);
            from = at;
            at = onward;
        }
    };
    for (Index v = 0; v < vertex_count; ++v) {
        if (curves.degree(v) == 0 || curves.degree(v) == 2) continue;
        for (const auto& [w, angle] : curves.edges[v]) {
            if (curves.degree(w) == 2 && seen[w]) continue;
            if (curves.degree(w) != 2 && w < v) continue; // a single edge between two nodes, from its other end
            chains.push_back(walk(v, w));
        }
    }
    for (Index v = 0; v < vertex_count; ++v)
        if (curves.degree(v) == 2 && !seen[v]) {
            seen[v] = 1;
            chains.push_back(walk(v, curves.edges[v][0].end));
        }
    return chains;
}

/// Takes short loose ends and tiny loops off. What goes may leave others with a loose end, so this is done up to
/// kPruningRounds times. Borders never go.
void prune(const ManifoldSurface& surface, std::span<const Index> twins, const FeatureOptions& options,
           std::vector<float>& marked) {
    const double clear = radians(options.angle_deg) + kClearlySharp;
    const auto is_noise = [&](const Chain& chain, double shortest, double longest) {
        const double length = chain.length / options.patch_side;
        return length < shortest || (length < longest && chain.angle < clear);
    };
    for (int round = 0; round < kPruningRounds; ++round) {
        const Curves curves = collect(surface, twins, marked);
        std::vector<std::uint8_t> gone(surface.positions.size(), 0); // inner vertices of chains that go
        std::vector<std::pair<Index, Index>> single;                 // chains of one edge
        for (const Chain& chain : chains_of(curves)) {
            const Index first = chain.vertices.front(), last = chain.vertices.back();
            const bool closed = first == last && curves.degree(first) == 2;
            const bool loose = curves.degree(first) == 1 || curves.degree(last) == 1;
            if (!(closed && is_noise(chain, kShortestLoop, kLongLoop)) &&
                !(loose && is_noise(chain, kShortestChain, kLongChain)))
                continue;
            if (chain.vertices.size() == 2) single.push_back(std::minmax(first, last));
            for (std::size_t i = 1; i + 1 < chain.vertices.size(); ++i) gone[chain.vertices[i]] = 1;
            if (closed) gone[first] = 1;
        }
        std::sort(single.begin(), single.end());
        bool changed = false;
        for (Index h = 0; h < marked.size(); ++h) {
            if (marked[h] == 0) continue;
            const Index a = half_edge_start(surface.triangles, h), b = half_edge_end(surface.triangles, h);
            if (gone[a] || gone[b] ||
                std::binary_search(single.begin(), single.end(), std::pair<Index, Index>(std::minmax(a, b)))) {
                marked[h] = 0;
                changed = true;
            }
        }
        if (!changed) return;
    }
}

/// Takes networks of sharp edges off that are small all together: spikes of noise, too small for patches of their own.
void drop_small_networks(const ManifoldSurface& surface, double patch_side, std::vector<float>& marked) {
    DisjointSets networks(surface.positions.size());
    const auto ends = [&](Index h) {
        return std::pair(half_edge_start(surface.triangles, h), half_edge_end(surface.triangles, h));
    };
    for (Index h = 0; h < marked.size(); ++h)
        if (marked[h] > 0) networks.join(ends(h).first, ends(h).second);
    std::vector<double> length(surface.positions.size(), 0);
    for (Index h = 0; h < marked.size(); ++h)
        if (marked[h] > 0) {
            const auto [a, b] = ends(h);
            length[networks.root(a)] +=
                0.5 * (surface.positions[a] - surface.positions[b]).norm(); // met from both sides
        }
    for (Index h = 0; h < marked.size(); ++h)
        if (marked[h] > 0 && length[networks.root(ends(h).first)] < kSmallNetwork * patch_side) marked[h] = 0;
}

/// The vertex `reach` further along, and how far that is.
Vec3d chord(const Curves& curves, Index from, Index first, double reach) {
    Index before = from, at = first;
    double gone = curves.length(from, first);
    for (int i = 0; i < kMostSteps && gone < reach && curves.degree(at) == 2 && at != from; ++i) {
        const Index onward = curves.onward(at, before);
        gone += curves.length(at, onward);
        before = at;
        at = onward;
    }
    return curves.surface.positions[at] - curves.surface.positions[from];
}

/// Vertices where a curve turns most within `reach` to both sides, and by enough.
std::vector<std::uint8_t> find_corners(const Curves& curves, double reach) {
    const std::size_t vertex_count = curves.surface.positions.size();
    std::vector<float> turn(vertex_count, 0);
    for (Index v = 0; v < vertex_count; ++v) {
        if (curves.degree(v) != 2) continue;
        const Index a = curves.edges[v][0].end, b = curves.edges[v][1].end;
        if (a == b) continue;
        const Vec3d to_a = chord(curves, v, a, reach), to_b = chord(curves, v, b, reach);
        turn[v] = static_cast<float>(std::numbers::pi - math::atan2(to_a.cross(to_b).norm(), to_a.dot(to_b)));
    }
    std::vector<std::uint8_t> corners(vertex_count, 0);
    for (Index v = 0; v < vertex_count; ++v) {
        if (turn[v] < kCornerTurn) continue;
        bool largest = true;
        for (const Curves::Edge& edge : curves.edges[v]) {
            if (!largest) break;
            Index before = v, at = edge.end;
            double gone = curves.length(v, at);
            for (int k = 0; k < kMostSteps && gone < reach && curves.degree(at) == 2 && at != v && largest; ++k) {
                largest = turn[at] < turn[v] || (turn[at] == turn[v] && at > v);
                const Index onward = curves.onward(at, before);
                gone += curves.length(at, onward);
                before = at;
                at = onward;
            }
        }
        corners[v] = largest;
    }
    return corners;
}

} // namespace

FeatureCurves find_feature_curves(const ManifoldSurface& surface, std::span<const Index> twins,
                                  const FeatureOptions& options) {
    FeatureCurves result;
    result.half_edges.assign(twins.size(), 0);
    std::vector<Vec3d> normals;
    normals.reserve(surface.triangles.size());
    for (const Triangle& t : surface.triangles) {
        const Vec3d& a = surface.positions[t[0]];
        normals.push_back((surface.positions[t[1]] - a).cross(surface.positions[t[2]] - a).normalized());
    }
    const double least = radians(options.angle_deg);
    std::vector<float> angles(twins.size(), 0);
    if (options.angle_deg < 180)
        for (Index h = 0; h < twins.size(); ++h) {
            if (twins[h] == kNoIndex) continue;
            const Vec3d &n = normals[h / 3], &m = normals[twins[h] / 3];
            // a triangle without an area has no normal, and its edges are not sharp
            const double angle =
                n.squaredNorm() > 0 && m.squaredNorm() > 0 ? math::atan2(n.cross(m).norm(), n.dot(m)) : 0;
            if (angle > least) angles[h] = static_cast<float>(angle);
        }
    prune(surface, twins, options, angles);
    drop_small_networks(surface, options.patch_side, angles);
    result.corners = find_corners(collect(surface, twins, angles), kCornerReach * options.patch_side);
    for (Index h = 0; h < twins.size(); ++h) result.half_edges[h] = angles[h] > 0;
    result.edge_count = static_cast<std::size_t>(std::count(result.half_edges.begin(), result.half_edges.end(), 1)) / 2;
    return result;
}

} // namespace filigree
