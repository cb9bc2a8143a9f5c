// Based on:
//   [Erickson 2005] (tree-cotree decompositions; which loops are boundaries, from the edges they cross)
//   [Guskov 2001] (topological noise: cut the shortest loop of a handle, fill both sides)
// A tree-cotree decomposition leaves two edges a handle, which lie close behind it, and with them one number an edge:
// the exclusive or of those along a loop is zero where the loop bounds a piece of the surface. So, unlike in [Guskov
// 2001], a short walk around each of these edges finds the handle's shortest loop, and no region is grown everywhere.
#include "filigree/core/disjoint_sets.h"
#include "filigree/core/random.h"
#include "filigree/mesh/edges.h"
#include "filigree/remesh/manifold_surface.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

namespace filigree {
namespace {

/// Closed walks up to this many times the longest loop are looked for. What is not found says more than that no loop
/// passes the vertex: none passes its neighbours either, up to half the difference away. With 2 the searches that cover
/// a stretch of the surface cost least.
constexpr double kWalk = 2;
constexpr int kShorten = 8;                 ///< times a loop is tried to become shorter, from vertices of its own
constexpr std::size_t kBetweenLooks = 1024; ///< vertices of a search, from one look at `cancel` to the next

/// A surface without borders: each border loop has a vertex of its own, joined to all of the loop by triangles that are
/// not there. They come after the real vertices and triangles.
struct CappedSurface {
    std::vector<Triangle> triangles;
    std::vector<Index> opposite;
    std::vector<Index> leaving; ///< a half-edge of each vertex
    std::size_t real_vertices = 0, real_triangles = 0;
    std::int64_t genus = 0;

    Index start(Index h) const { return half_edge_start(triangles, h); }
    Index end(Index h) const { return half_edge_end(triangles, h); }
    /// The next half-edge that leaves the same vertex, counter-clockwise.
    Index turn(Index h) const { return opposite[previous_half_edge(h)]; }
    bool is_real(Index vertex) const { return vertex < real_vertices; }
};

/// Adds triangles (b, a, vertex) for each border half-edge a -> b.
void cap_borders(CappedSurface& capped) {
    std::vector<Index> cap(capped.real_vertices, kNoIndex); // the triangle behind the border half-edge from a vertex
    std::vector<Index> border;
    for (Index h = 0; h < capped.opposite.size(); ++h) {
        if (capped.opposite[h] != kNoIndex) continue;
        cap[capped.start(h)] = static_cast<Index>(capped.real_triangles + border.size());
        border.push_back(h);
    }
    capped.opposite.resize(capped.opposite.size() + 3 * border.size());
    for (const Index h : border) {
        const Index t = cap[capped.start(h)];
        capped.opposite[h] = 3 * t;
        capped.opposite[3 * t] = h;
        capped.opposite[3 * t + 2] = 3 * cap[capped.end(h)] + 1;
        capped.opposite[3 * cap[capped.end(h)] + 1] = 3 * t + 2;
    }
    capped.triangles.resize(capped.real_triangles + border.size(), {kNoIndex, kNoIndex, kNoIndex});
    Index vertex = static_cast<Index>(capped.real_vertices);
    for (const Index first : border) {
        if (capped.triangles[cap[capped.start(first)]][2] != kNoIndex) continue;
        for (Index h = first; capped.triangles[cap[capped.start(h)]][2] == kNoIndex;) {
            capped.triangles[cap[capped.start(h)]] = {capped.end(h), capped.start(h), vertex};
            h = border[cap[capped.end(h)] - capped.real_triangles];
        }
        ++vertex;
    }
    capped.leaving.resize(vertex);
}

CappedSurface cap_surface(const ManifoldSurface& surface) {
    CappedSurface capped;
    capped.triangles = surface.triangles;
    capped.opposite = opposite_half_edges(surface.triangles, surface.positions.size());
    capped.real_vertices = surface.positions.size();
    capped.real_triangles = surface.triangles.size();
    cap_borders(capped);
    for (Index h = 0; h < capped.opposite.size(); ++h) capped.leaving[capped.start(h)] = h;
    const std::int64_t euler = std::int64_t(capped.leaving.size()) - std::int64_t(capped.triangles.size() / 2);
    capped.genus = (2 * std::int64_t(components(capped.opposite).count) - euler) / 2;
    return capped;
}

/// What a tree-cotree decomposition says about loops.
struct Homology {
    std::vector<Index> generators; ///< a half-edge of each edge in neither tree: two a handle
    /// Of each half-edge, alike on both of an edge. The exclusive or along a loop is zero if the loop bounds a piece of
    /// the surface, and, but for a chance of 2^-64, only if.
    std::vector<std::uint64_t> signature;
};

enum class Role : std::uint8_t { none, tree, cotree };

/// Spanning trees of breadth-first search, the first root at or after vertex `root`. Returns each vertex's depth.
std::vector<Index> grow_tree(const CappedSurface& surface, Index root, std::vector<Role>& role) {
    const std::size_t count = surface.leaving.size();
    std::vector<Index> depth(count, kNoIndex), queue;
    queue.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const Index seed = static_cast<Index>((root + i) % count);
        if (depth[seed] != kNoIndex) continue;
        depth[seed] = 0;
        queue.push_back(seed);
        for (std::size_t next = queue.size() - 1; next < queue.size(); ++next) {
            const Index vertex = queue[next], first = surface.leaving[vertex];
            Index h = first;
            do {
                const Index other = surface.end(h);
                if (depth[other] == kNoIndex) {
                    depth[other] = depth[vertex] + 1;
                    queue.push_back(other);
                    role[h] = role[surface.opposite[h]] = Role::tree;
                }
                h = surface.turn(h);
            } while (h != first);
        }
    }
    return depth;
}

/// A spanning tree of the triangles that crosses no edge of the tree, and rather those that the search met late: what
/// is left over are the edges whose loops are short. Returns one half-edge of each.
std::vector<Index> grow_cotree(const CappedSurface& surface, std::span<const Index> depth, std::vector<Role>& role) {
    const auto key = [&](Index h) { return depth[surface.start(h)] + depth[surface.end(h)]; };
    const auto is_candidate = [&](Index h) { return h < surface.opposite[h] && role[h] == Role::none; };
    const IndexLists sorted = make_lists<Index>(2 * std::ranges::max(depth) + 1, [&](const auto& add) {
        for (Index h = 0; h < role.size(); ++h)
            if (is_candidate(h)) add(key(h), h);
    });
    std::vector<Index> left_over;
    DisjointSets sets(surface.triangles.size());
    for (auto h = sorted.items.rbegin(); h != sorted.items.rend(); ++h) {
        if (sets.join(*h / 3, surface.opposite[*h] / 3))
            role[*h] = role[surface.opposite[*h]] = Role::cotree;
        else
            left_over.push_back(*h);
    }
    return left_over;
}

/// Each generator has a loop through the cotree; an edge's signature is the exclusive or of the random numbers of
/// those that cross it. In the cotree these are the generators with one end in the subtree that hangs on the edge.
std::vector<std::uint64_t> sign_edges(const CappedSurface& surface, std::span<const Index> generators,
                                      std::span<const Role> role) {
    std::vector<std::uint64_t> signature(role.size(), 0), subtree(surface.triangles.size(), 0);
    for (const Index h : generators) {
        const Index back = surface.opposite[h];
        signature[h] = signature[back] = random_bits(0, h);
        subtree[h / 3] ^= signature[h];
        subtree[back / 3] ^= signature[h];
    }
    std::vector<Index> up(surface.triangles.size(), kNoIndex), order; // half-edge towards the root
    std::vector<std::uint8_t> seen(surface.triangles.size(), 0);
    order.reserve(surface.triangles.size());
    for (Index root = 0; root < seen.size(); ++root) {
        if (seen[root]) continue;
        seen[root] = 1;
        order.push_back(root);
        for (std::size_t next = order.size() - 1; next < order.size(); ++next)
            for (Index h = 3 * order[next]; h < 3 * order[next] + 3; ++h) {
                const Index other = surface.opposite[h] / 3;
                if (role[h] != Role::cotree || seen[other]) continue;
                seen[other] = 1;
                up[other] = surface.opposite[h];
                order.push_back(other);
            }
    }
    for (auto t = order.rbegin(); t != order.rend(); ++t) {
        const Index h = up[*t];
        if (h == kNoIndex) continue;
        signature[h] = signature[surface.opposite[h]] = subtree[*t];
        subtree[surface.opposite[h] / 3] ^= subtree[*t];
    }
    return signature;
}

Homology decompose(const CappedSurface& surface, Index root) {
    std::vector<Role> role(surface.opposite.size(), Role::none);
    const std::vector<Index> depth = grow_tree(surface, root, role);
    Homology homology;
    homology.generators = grow_cotree(surface, depth, role);
    homology.signature = sign_edges(surface, homology.generators, role);
    assert(std::int64_t(homology.generators.size()) == 2 * surface.genus);
    return homology;
}

/// A closed walk that meets no vertex twice.
struct Loop {
    std::vector<Index> half_edges; ///< each starts where the one before it ends
    double length = 0;
};

/// Finds shortest loops that bound nothing, by Dijkstra's algorithm around one vertex after another.
class LoopSearch {
public:
    LoopSearch(const CappedSurface& surface, const Homology& homology, std::span<const Vec3d> positions, double longest,
               const RunContext& context)
        : context_(context), surface_(surface), signature_(homology.signature), positions_(positions),
          longest_(longest), nodes_(surface.real_vertices), done_(surface.real_vertices, 0) {}

    /// The shortest loop near `vertex`, if there is one no longer than the longest asked for. Not found: none passes
    /// the vertex. Vertices where the answer is known already are passed over.
    std::optional<Loop> shortest_near(Index vertex) {
        if (done_[vertex]) return std::nullopt;
        double walk = kWalk * longest_;
        std::optional<Loop> loop = shortest_through(vertex, walk);
        // a loop of length l at a distance d from here is a walk of l + 2 d; where one was found, one is enough
        const double known = walk > longest_ ? 0.5 * (walk - longest_) : 0.5 * longest_;
        for (const Index v : settled_)
            if (nodes_[v].distance < known) done_[v] = 1;
        if (loop) shorten(*loop);
        if (!loop || !(loop->length <= longest_)) return std::nullopt;
        return loop;
    }

private:
    /// The shortest closed walk through `vertex` that bounds nothing, if it is shorter than `limit`, which becomes its
    /// length; without the part that it goes both out and back.
    std::optional<Loop> shortest_through(Index vertex, double& limit) {
        ++search_;
        heap_.clear();
        settled_.clear();
        reach(vertex, 0, kNoIndex, 0);
        Index closing = kNoIndex;
        while (!heap_.empty()) {
            std::ranges::pop_heap(heap_, std::greater{});
            const auto [distance, at] = heap_.back();
            heap_.pop_back();
            if (2 * distance >= limit) break;
            if (settled_.size() % kBetweenLooks == 0 && context_.is_cancelled()) break;
            if (nodes_[at].settled) continue;
            nodes_[at].settled = true;
            settled_.push_back(at);
            settle(at, limit, closing);
        }
        if (closing == kNoIndex) return std::nullopt;
        return trimmed(closing);
    }

    void shorten(Loop& loop) {
        for (int i = 0; i < kShorten; ++i) {
            // the golden ratio spreads the vertices tried, however often the loop changes
            const double place = 0.6180339887 * i - std::floor(0.6180339887 * i);
            const Index h = loop.half_edges[static_cast<std::size_t>(place * double(loop.half_edges.size()))];
            double limit = loop.length;
            std::optional<Loop> shorter = shortest_through(surface_.start(h), limit);
            if (shorter && shorter->length < loop.length) loop = std::move(*shorter);
        }
    }

    struct Node {
        double distance = 0;
        std::uint64_t signature = 0; ///< of the way from the vertex searched from
        Index arrival = kNoIndex;    ///< half-edge that ends here
        std::uint32_t search = 0;    ///< the search that the rest belongs to
        bool settled = false;
    };

    void reach(Index vertex, double distance, Index arrival, std::uint64_t signature) {
        Node& node = nodes_[vertex];
        if (node.search == search_ && !(distance < node.distance)) return;
        node = {distance, signature, arrival, search_, false};
        heap_.emplace_back(distance, vertex);
        std::ranges::push_heap(heap_, std::greater{});
    }

    /// Looks along the edges of a vertex whose distance is known: on to new vertices, or to others that are known,
    /// which closes a walk.
    void settle(Index at, double& limit, Index& closing) {
        const Index first = surface_.leaving[at];
        Index h = first;
        do {
            const Index other = surface_.end(h);
            if (surface_.is_real(other)) visit(at, other, h, limit, closing);
            h = surface_.turn(h);
        } while (h != first);
    }

    void visit(Index at, Index other, Index h, double& limit, Index& closing) {
        const double length = (positions_[other] - positions_[at]).norm();
        const std::uint64_t signature = nodes_[at].signature ^ signature_[h];
        const Node& node = nodes_[other];
        if (node.search != search_ || !node.settled) {
            reach(other, nodes_[at].distance + length, h, signature);
        } else if (signature != node.signature && nodes_[at].distance + length + node.distance < limit) {
            limit = nodes_[at].distance + length + node.distance;
            closing = h;
        }
    }

    /// The loop over the half-edge `closing` and the ways to its two ends, up to where these meet.
    Loop trimmed(Index closing) const {
        std::vector<Index> to_start, to_end; // from the ends backwards
        for (Index v = surface_.start(closing); nodes_[v].arrival != kNoIndex; v = surface_.start(nodes_[v].arrival))
            to_start.push_back(nodes_[v].arrival);
        for (Index v = surface_.end(closing); nodes_[v].arrival != kNoIndex; v = surface_.start(nodes_[v].arrival))
            to_end.push_back(nodes_[v].arrival);
        while (!to_start.empty() && !to_end.empty() && to_start.back() == to_end.back()) {
            to_start.pop_back();
            to_end.pop_back();
        }
        Loop loop;
        loop.half_edges.assign(to_start.rbegin(), to_start.rend());
        loop.half_edges.push_back(closing);
        for (const Index h : to_end) loop.half_edges.push_back(surface_.opposite[h]);
        for (const Index h : loop.half_edges)
            loop.length += (positions_[surface_.end(h)] - positions_[surface_.start(h)]).norm();
        return loop;
    }

    const RunContext& context_;
    const CappedSurface& surface_;
    std::span<const std::uint64_t> signature_;
    std::span<const Vec3d> positions_;
    double longest_;
    std::vector<Node> nodes_;
    std::vector<std::uint8_t> done_; ///< a vertex: whether no loop passes it, or one was found close by
    std::vector<std::pair<double, Index>> heap_;
    std::vector<Index> settled_;
    std::uint32_t search_ = 0;
};

/// Loops that share no vertex, the shorter first.
std::vector<Loop> disjoint_loops(const CappedSurface& surface, std::vector<Loop> loops) {
    std::ranges::stable_sort(loops, {}, &Loop::length);
    std::vector<std::uint8_t> taken(surface.real_vertices, 0);
    std::erase_if(loops, [&](const Loop& loop) {
        const auto is_taken = [&](Index h) { return taken[surface.start(h)] != 0; };
        if (std::ranges::any_of(loop.half_edges, is_taken)) return true;
        for (const Index h : loop.half_edges) taken[surface.start(h)] = 1;
        return false;
    });
    return loops;
}

/// Leaves out loops, longer ones first, until cutting the others takes no component apart: each loop left out joins
/// two pieces again.
void keep_connected(const CappedSurface& surface, std::vector<Loop>& loops) {
    if (loops.size() < 2) return; // one that bounds nothing separates nothing
    std::vector<Index> opposite = surface.opposite;
    for (const Loop& loop : loops)
        for (const Index h : loop.half_edges) opposite[h] = opposite[surface.opposite[h]] = kNoIndex;
    const Labels piece = components(opposite);
    DisjointSets sets(piece.count);
    std::vector<Loop> kept;
    for (auto loop = loops.rbegin(); loop != loops.rend(); ++loop) {
        const Index h = loop->half_edges.front();
        if (!sets.join(piece.of[h / 3], piece.of[surface.opposite[h] / 3])) kept.push_back(std::move(*loop));
    }
    loops = std::move(kept);
}

/// Fills one side of a cut: a triangle where that closes it, else a fan around the middle, whose edges are all new (a
/// diagonal might be an edge already). outline: counter-clockwise seen from outside.
std::size_t fill(ManifoldSurface& surface, std::span<const Index> outline) {
    const std::size_t before = surface.triangles.size();
    if (outline.size() == 3) {
        surface.triangles.push_back({outline[0], outline[1], outline[2]});
    } else {
        Vec3d middle = Vec3d::Zero();
        for (const Index vertex : outline) middle += surface.positions[vertex];
        const Index centre = static_cast<Index>(surface.positions.size());
        surface.positions.push_back(middle / double(outline.size()));
        for (std::size_t i = 0; i < outline.size(); ++i)
            surface.triangles.push_back({outline[i], outline[(i + 1) % outline.size()], centre});
    }
    if (!surface.source_corners.empty())
        surface.source_corners.resize(surface.triangles.size(), {kNoIndex, kNoIndex, kNoIndex});
    return surface.triangles.size() - before;
}

/// Gives the left side of the loop vertices of its own, and fills both sides.
void cut_and_fill(ManifoldSurface& surface, const CappedSurface& capped, const Loop& loop, CleanReport& report) {
    const std::size_t count = loop.half_edges.size();
    std::vector<Index> left(count), right(count);
    for (std::size_t i = 0; i < count; ++i) {
        const Index outgoing = loop.half_edges[i], incoming = loop.half_edges[(i + count - 1) % count];
        right[i] = capped.start(outgoing);
        left[i] = static_cast<Index>(surface.positions.size());
        surface.positions.push_back(Vec3d(surface.positions[right[i]]));
        for (Index h = outgoing; h != capped.opposite[incoming]; h = capped.turn(h))
            if (h / 3 < capped.real_triangles) surface.triangles[h / 3][h % 3] = left[i];
    }
    std::ranges::reverse(left);
    report.filled_triangles += fill(surface, left) + fill(surface, right);
    ++report.closed_handles;
}

/// Short loops near the generators; if there is none, near any vertex on an edge with a signature. Every loop that
/// bounds nothing has such an edge, so if there is none again, the surface has none.
std::vector<Loop> find_loops(const CappedSurface& surface, const Homology& homology, LoopSearch& search,
                             const RunContext& context) {
    std::vector<Loop> loops;
    const auto look = [&](Index h) {
        if (context.is_cancelled() || !surface.is_real(surface.start(h))) return;
        if (auto loop = search.shortest_near(surface.start(h))) loops.push_back(std::move(*loop));
    };
    for (const Index h : homology.generators) {
        look(h);
        look(surface.opposite[h]);
    }
    if (!loops.empty()) return loops;
    for (Index h = 0; h < surface.opposite.size(); ++h)
        if (homology.signature[h] != 0) look(h);
    return loops;
}

/// One round with new trees. Returns how many handles it closed.
std::size_t close_round(ManifoldSurface& surface, const CappedSurface& capped, double longest_loop, std::uint64_t round,
                        CleanReport& report, const RunContext& context) {
    const Index root = static_cast<Index>(random_bits(0, context.seed + round) % capped.leaving.size());
    const Homology homology = decompose(capped, root);
    LoopSearch search(capped, homology, surface.positions, longest_loop, context);
    std::vector<Loop> loops = disjoint_loops(capped, find_loops(capped, homology, search, context));
    if (context.is_cancelled()) return 0;
    keep_connected(capped, loops);
    for (const Loop& loop : loops) cut_and_fill(surface, capped, loop, report);
    return loops.size();
}

} // namespace

Status close_handles(ManifoldSurface& surface, double longest_loop, CleanReport& report, const RunContext& context) {
    std::int64_t first_genus = 0;
    for (std::uint64_t round = 0;; ++round) {
        if (context.is_cancelled()) return cancelled_error();
        const CappedSurface capped = cap_surface(surface);
        if (round == 0) first_genus = capped.genus;
        if (capped.genus == 0) break;
        context.report("closing handles", 1 - double(capped.genus) / double(first_genus));
        const std::size_t closed = close_round(surface, capped, longest_loop, round, report, context);
        if (context.is_cancelled()) return cancelled_error();
        if (closed == 0) break;
    }
    context.report("closing handles", 1);
    return Success{};
}

} // namespace filigree
