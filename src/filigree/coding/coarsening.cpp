#include "filigree/coding/coarsening.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/quadric.h"

#include <algorithm>
#include <limits>

namespace filigree {

namespace {

constexpr double kLengthWeight = 0.02; // of (edge length)^2 x area: spreads vertices evenly
constexpr double kLeastCosine = 0.2;   // a triangle that turns further than this counts as turned over
constexpr std::size_t kLongestRing = 24;
constexpr double kPricedShare = 0.45; // of the vertices, those that cost least: of them a batch is taken
constexpr double kLargestBatch = 0.25, kSmallestBatch = 0.01;
constexpr std::size_t kGrain = 512;

/// A ring of half-edges from a vertex, clockwise.
struct Ring {
    std::array<Index, kLongestRing> half_edges, ends;
    std::size_t size = 0;

    bool has(Index vertex) const { return std::find(ends.begin(), ends.begin() + size, vertex) != ends.begin() + size; }
};

struct PricedCollapse {
    double cost;
    Index vertex, half_edge; ///< the half-edge to where it goes
    bool operator<(const PricedCollapse& other) const {
        return cost != other.cost ? cost < other.cost : vertex < other.vertex;
    }
};

class Coarsener {
public:
    Coarsener(ClosedMap map, std::span<const FinePlace> places, const SurfaceAttributes& attributes)
        : map_(std::move(map)), wedges_(attributes.wedges), wedge_at_(attributes.wedge_at),
          is_alive_(map_.triangles.size(), true), spoke_(map_.vertex_count(), kNoIndex),
          quadrics_(map_.vertex_count()) {
        points_.reserve(places.size());
        for (const FinePlace& p : places) points_.emplace_back(p[0], p[1], p[2]);
        for (Index h = 0; h < map_.opposite.size(); ++h) spoke_[map_.origin(h)] = h;
        for (Index v = 0; v < map_.vertex_count(); ++v)
            if (!map_.closes_hole[v]) left_.push_back(v);
        for (Index t = 0; t < map_.triangles.size(); ++t) add_planes(t);
        for (Index h = 0; h < wedge_at_.size(); ++h) // where a seam lies shows as much as where a border does
            if (wedge_at_[h] != kNoIndex && wedge_at_[map_.opposite[h]] != kNoIndex && attributes.is_seam(map_, h))
                add_border(map_.opposite[h]);
    }

    Coarsening run(std::size_t fewest, const RunContext& context) {
        Coarsening coarsening;
        const double whole = std::max<double>(1, double(left_.size()));
        while (left_.size() > fewest && !context.is_cancelled()) {
            std::vector<VertexCollapse> batch = next_batch(fewest, context);
            if (batch.empty()) break;
            const bool is_last = double(batch.size()) < kSmallestBatch * double(left_.size());
            coarsening.batches.push_back(std::move(batch));
            std::erase_if(left_, [&](Index v) { return spoke_[v] == kNoIndex; });
            context.report("coarsening", 1 - double(left_.size()) / whole);
            if (is_last) break;
        }
        number_base(coarsening);
        return coarsening;
    }

private:
    void add_planes(Index triangle) {
        const Triangle& t = map_.triangles[triangle];
        for (Index k = 0; k < 3; ++k) // a border's edge stands on a plane of its own
            if (map_.closes_hole[t[k]]) return add_border(next_half_edge(3 * triangle + k));
        const Vec3d normal = normal_of(t);
        const double area = normal.norm() / 2;
        if (area <= 0) return;
        for (const Index v : t) {
            quadrics_[v].add_plane(normal / (2 * area), points_[v], area / 3);
            quadrics_[v].area += area / 3;
        }
    }
    void add_border(Index half_edge) {
        const Index a = map_.origin(half_edge), b = map_.origin(next_half_edge(half_edge));
        const Vec3d along = points_[b] - points_[a];
        const Vec3d across = along.cross(normal_of(map_.triangles[map_.opposite[half_edge] / 3]));
        const double length = across.norm();
        if (length <= 0) return;
        for (const Index v : {a, b}) quadrics_[v].add_plane(across / length, points_[v], along.squaredNorm() / 2);
    }
    Vec3d normal_of(const Triangle& t) const {
        return (points_[t[1]] - points_[t[0]]).cross(points_[t[2]] - points_[t[0]]);
    }

    /// False: it is too long.
    bool read_ring(Index vertex, Ring& ring) const {
        ring.size = 0;
        for (Index h = spoke_[vertex];;) {
            if (ring.size == kLongestRing) return false;
            ring.half_edges[ring.size] = h;
            ring.ends[ring.size++] = map_.origin(next_half_edge(h));
            h = map_.turn_clockwise(h);
            if (h == spoke_[vertex]) return true;
        }
    }
    bool is_longer_than(Index vertex, std::size_t size) const {
        Index h = spoke_[vertex];
        for (std::size_t k = 0; k < size; ++k) {
            h = map_.turn_clockwise(h);
            if (h == spoke_[vertex]) return false;
        }
        return true;
    }
    static bool repeats(const Ring& ring) {
        for (std::size_t i = 1; i < ring.size; ++i)
            for (std::size_t j = 0; j < i; ++j)
                if (ring.ends[i] == ring.ends[j]) return true;
        return false;
    }

    /// What the collapse of a ring's vertex along one of its half-edges costs; infinity where it may not be.
    double price(Index vertex, const Ring& ring, std::size_t to) const {
        constexpr double kNever = std::numeric_limits<double>::infinity();
        const Index onto = ring.ends[to];
        if (map_.closes_hole[onto]) return kNever;
        const Index left = ring.ends[(to + ring.size - 1) % ring.size], right = ring.ends[(to + 1) % ring.size];
        for (std::size_t i = 0; i < ring.size; ++i) // it stays on the border that it lies on
            if (map_.closes_hole[ring.ends[i]] && ring.ends[i] != left && ring.ends[i] != right) return kNever;
        const Vec3d &from = points_[vertex], &target = points_[onto];
        for (std::size_t i = 0; i < ring.size; ++i) {
            const std::size_t j = (i + 1) % ring.size;
            if (i == to || j == to || map_.closes_hole[ring.ends[i]] || map_.closes_hole[ring.ends[j]]) continue;
            const Vec3d &a = points_[ring.ends[j]], edge = points_[ring.ends[i]] - a;
            const Vec3d before = edge.cross(from - a), after = edge.cross(target - a);
            const double cosine = before.dot(after);
            if (before.isZero()) continue; // it has no side to turn over to
            if (cosine <= 0 ||
                cosine * cosine < kLeastCosine * kLeastCosine * before.squaredNorm() * after.squaredNorm())
                return kNever;
        }
        const Quadric& quadric = quadrics_[vertex];
        return quadric.at(target) + kLengthWeight * quadric.area * (target - from).squaredNorm();
    }

    /// Whether the two have no neighbours in common but the two beside the edge, and the mesh stays a surface.
    bool may_collapse(const Ring& ring, std::size_t to) const {
        const Index onto = ring.ends[to];
        Ring other;
        if (!read_ring(onto, other) || ring.size + other.size - 4 > kLongestRing) return false;
        if (ring.size < 3 || other.size < 3 || repeats(ring) || repeats(other)) return false;
        std::size_t common = 0;
        for (std::size_t i = 0; i < ring.size; ++i) common += other.has(ring.ends[i]);
        const Index left = ring.ends[(to + ring.size - 1) % ring.size], right = ring.ends[(to + 1) % ring.size];
        if (common != 2 || !other.has(left) || !other.has(right) || !is_longer_than(left, 3) ||
            !is_longer_than(right, 3))
            return false;
        CollapsedWedges at_left, at_right;
        return wedge_at_.empty() || collapse_wedges(ring, to, at_left, at_right);
    }

    /// What a collapse does to wedges. False: some would have nowhere to go, or could not be told from each other
    /// later.
    bool collapse_wedges(const Ring& ring, std::size_t to, CollapsedWedges& at_left, CollapsedWedges& at_right) const {
        const Index there = ring.half_edges[to], back = map_.opposite[there];
        const Index left_moves = map_.opposite[next_half_edge(back)], // from the left neighbour to the vertex
            left_stays = map_.opposite[previous_half_edge(back)],
                    right_moves = map_.opposite[previous_half_edge(there)],
                    right_stays = map_.opposite[next_half_edge(there)];
        const auto side = [&](Index own, Index onto, Index third, std::array<Index, 2> moved,
                              std::array<Index, 2> stayed,
                              CollapsedWedges& wedges) { // corners of the triangle; then those of the ones beside it
            wedges = {wedge_at_[own], wedge_at_[onto]};
            if (wedges.own == kNoIndex) return true;
            wedges.moves = wedge_at_[moved[0]] == wedges.own && wedge_at_[moved[1]] == wedge_at_[third];
            const Wedge &a = wedges_[wedges.own], &b = wedges_[wedges.onto];
            return a.material == b.material && a.has_uv == b.has_uv &&
                   (wedges.moves || (wedge_at_[stayed[0]] == wedges.onto && wedge_at_[stayed[1]] == wedge_at_[third]));
        };
        if (!side(next_half_edge(back), back, previous_half_edge(back), {next_half_edge(left_moves), left_moves},
                  {left_stays, next_half_edge(left_stays)}, at_left) ||
            !side(there, next_half_edge(there), previous_half_edge(there), {right_moves, next_half_edge(right_moves)},
                  {next_half_edge(right_stays), right_stays}, at_right))
            return false;
        if (at_left.own == kNoIndex && at_right.own == kNoIndex) return false;
        if (at_left.own != kNoIndex && at_right.own != kNoIndex &&
            (at_left.own == at_right.own) != (at_left.onto == at_right.onto))
            return false;
        return std::all_of(ring.half_edges.begin(), ring.half_edges.begin() + ring.size, [&](Index h) {
            return wedge_at_[h] == kNoIndex || wedge_at_[h] == at_left.own || wedge_at_[h] == at_right.own;
        });
    }

    std::vector<VertexCollapse> next_batch(std::size_t fewest, const RunContext& context) {
        std::vector<PricedCollapse> priced(left_.size());
        parallel_for(context, left_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) priced[i] = cheapest(left_[i]);
        });
        std::erase_if(priced, [](const PricedCollapse& p) { return p.half_edge == kNoIndex; });
        const std::size_t count = std::min(priced.size(), std::size_t(kPricedShare * double(left_.size())) + 1);
        std::nth_element(priced.begin(), priced.begin() + std::ptrdiff_t(count) - (count > 0), priced.end());
        std::sort(priced.begin(), priced.begin() + std::ptrdiff_t(count));
        const std::size_t most = std::min(std::size_t(kLargestBatch * double(left_.size())) + 1, left_.size() - fewest);
        std::vector<VertexCollapse> batch;
        std::vector<bool> stays(map_.vertex_count(), false), took(map_.vertex_count(), false);
        Ring ring;
        for (std::size_t i = 0; i < count && batch.size() < most; ++i) {
            const PricedCollapse& next = priced[i];
            if (stays[next.vertex] || !read_ring(next.vertex, ring)) continue;
            std::size_t to = 0;
            while (ring.half_edges[to] != next.half_edge) ++to;
            if (took[ring.ends[to]] || !may_collapse(ring, to)) continue;
            for (std::size_t k = 0; k < ring.size; ++k) stays[ring.ends[k]] = true;
            took[ring.ends[to]] = true;
            batch.push_back(collapse(next.vertex, ring, to));
        }
        return batch;
    }

    PricedCollapse cheapest(Index vertex) const {
        PricedCollapse best{std::numeric_limits<double>::infinity(), vertex, kNoIndex};
        Ring ring;
        if (!read_ring(vertex, ring)) return best;
        for (std::size_t k = 0; k < ring.size; ++k) {
            const double cost = price(vertex, ring, k);
            if (cost < best.cost && may_collapse(ring, k)) best = {cost, vertex, ring.half_edges[k]};
        }
        return best;
    }

    VertexCollapse collapse(Index vertex, const Ring& ring, std::size_t to) {
        const Index there = ring.half_edges[to], back = map_.opposite[there];
        const Index onto = ring.ends[to];
        VertexCollapse made{vertex,
                            onto,
                            map_.origin(previous_half_edge(back)),
                            map_.origin(previous_half_edge(there)),
                            static_cast<Index>(ring.size - 2),
                            there,
                            back};
        if (!wedge_at_.empty()) {
            collapse_wedges(ring, to, made.at_left, made.at_right);
            for (std::size_t k = 0; k < ring.size; ++k) {
                Index& wedge = wedge_at_[ring.half_edges[k]];
                if (wedge != kNoIndex) wedge = wedge == made.at_left.own ? made.at_left.onto : made.at_right.onto;
            }
        }
        for (std::size_t k = 0; k < ring.size; ++k)
            map_.triangles[ring.half_edges[k] / 3][ring.half_edges[k] % 3] = onto;
        const Index right_in = map_.opposite[next_half_edge(there)],
                    right_out = map_.opposite[previous_half_edge(there)], left_in = map_.opposite[next_half_edge(back)],
                    left_out = map_.opposite[previous_half_edge(back)];
        glue(right_in, right_out);
        glue(left_in, left_out);
        is_alive_[there / 3] = is_alive_[back / 3] = false;
        spoke_[onto] = left_out;
        spoke_[made.left] = left_in;
        spoke_[made.right] = right_in;
        spoke_[vertex] = kNoIndex;
        quadrics_[onto] += quadrics_[vertex];
        return made;
    }
    void glue(Index a, Index b) {
        map_.opposite[a] = b;
        map_.opposite[b] = a;
    }

    void number_base(Coarsening& coarsening) const {
        std::vector<Index> number(map_.vertex_count(), kNoIndex), number_of(map_.triangles.size(), kNoIndex);
        for (Index t = 0; t < map_.triangles.size(); ++t) {
            if (!is_alive_[t]) continue;
            number_of[t] = static_cast<Index>(coarsening.half_edge.size());
            coarsening.half_edge.push_back(3 * t);
        }
        ClosedMap& base = coarsening.base;
        for (const Index first : coarsening.half_edge) {
            Triangle triangle = map_.triangles[first / 3];
            for (Index& v : triangle) {
                if (number[v] == kNoIndex) {
                    number[v] = static_cast<Index>(coarsening.vertex.size());
                    coarsening.vertex.push_back(v);
                    base.closes_hole.push_back(map_.closes_hole[v]);
                }
                v = number[v];
            }
            base.triangles.push_back(triangle);
            for (Index k = 0; k < 3; ++k) {
                const Index other = map_.opposite[first + k];
                base.opposite.push_back(3 * number_of[other / 3] + other % 3);
                if (!wedge_at_.empty()) coarsening.wedge_at.push_back(wedge_at_[first + k]);
            }
        }
    }

    ClosedMap map_;
    std::span<const Wedge> wedges_;
    std::vector<Index> wedge_at_; ///< of each half-edge, where there are attributes
    std::vector<bool> is_alive_;  ///< of each triangle
    std::vector<Index> spoke_;    ///< a half-edge from each vertex; kNoIndex where it went
    std::vector<Vec3d> points_;
    std::vector<Quadric> quadrics_;
    std::vector<Index> left_; ///< vertices that are left
};

} // namespace

Coarsening coarsen(ClosedMap map, std::span<const FinePlace> places, const SurfaceAttributes& attributes,
                   std::size_t fewest, const RunContext& context) {
    return Coarsener(std::move(map), places, attributes).run(fewest, context);
}

} // namespace filigree
