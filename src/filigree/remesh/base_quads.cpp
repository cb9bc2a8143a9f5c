#include "filigree/remesh/base_quads.h"

#include "filigree/remesh/matching.h"
#include "filigree/remesh/quad_quality.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <unordered_map>

namespace filigree {

namespace {

constexpr double kWideAngle = 0.75 * std::numbers::pi; // a sector this wide needs two quads: one would be near straight
constexpr double kTipAngle = 1.6 * std::numbers::pi;   // of a cone's triangles together: below it, its tip stays
constexpr double kConvex = 0.15; // sine of the unfolded quad's corners, below which it is laid out as a square instead

double cross(const Vec2d& a, const Vec2d& b) { return a.x() * b.y() - a.y() * b.x(); }

Vec3d weights_in(const std::array<Vec2d, 3>& t, const Vec2d& p) {
    const double whole = cross(t[1] - t[0], t[2] - t[0]);
    const double b = cross(p - t[0], t[2] - t[0]) / whole, c = cross(t[1] - t[0], p - t[0]) / whole;
    return {1 - b - c, b, c};
}

class Pairing {
public:
    Pairing(SurfaceMap& map, bool halve) : map_(map) { result_.halved = halve; }

    Result<BaseQuads> run(const RunContext& context) {
        context.report("pairing", 0);
        widen_sectors();
        make_regions_even();
        widen_sectors();
        match(context);
        if (context.is_cancelled()) return cancelled_error();
        remove_doublets();
        return collect();
    }

private:
    template <class Act>
    void for_each_half_edge(const Act& act) const {
        for (Index h = 0; h < 3 * map_.slot_count(); ++h)
            if (!map_.is_removed(h / 3)) act(h);
    }

    bool needs_two(Index half_edge) const {
        const VertexKind kind = map_.kind(map_.from(half_edge));
        if (kind == VertexKind::inside) return false;
        return kind == VertexKind::curve || map_.sector_angle(half_edge) > kWideAngle;
    }

    /// Sectors of one triangle that should be two quads get a second one: the edge across is flipped, or split.
    void widen_sectors() {
        for (Index h = 0; h < 3 * map_.slot_count(); ++h) {
            if (map_.is_removed(h / 3) || !map_.is_feature(h) || !map_.is_feature(previous_half_edge(h)) ||
                !needs_two(h))
                continue;
            const Index across = next_half_edge(h);
            if (!map_.is_feature(across) && flips_well(across))
                map_.flip(across);
            else
                map_.split(across);
        }
    }

    bool flips_well(Index h) const {
        const Index g = map_.twin(h);
        const Index c = map_.from(previous_half_edge(h)), d = map_.from(previous_half_edge(g));
        if (c == d || map_.are_neighbours(c, d)) return false;
        for (const Index half : {h, g}) {
            const VertexKind kind = map_.kind(map_.from(half));
            if (map_.sector_size(half) <= (kind == VertexKind::inside ? 4u : kind == VertexKind::curve ? 2u : 1u))
                return false;
        }
        const SurfaceMap::Unfolded flat = map_.unfold(h);
        const Vec2d to = flat.to.cast<double>(), above = flat.above.cast<double>(), below = flat.below.cast<double>();
        const double least = 0.3 * to.squaredNorm();
        return cross(-above, below - above) > least && cross(to - below, above - below) > least;
    }

    // --- regions between features

    std::vector<Index> find_regions(std::size_t& count) const {
        std::vector<Index> region(map_.slot_count(), kNoIndex), stack;
        count = 0;
        for (Index s = 0; s < map_.slot_count(); ++s) {
            if (map_.is_removed(s) || region[s] != kNoIndex) continue;
            region[s] = static_cast<Index>(count);
            stack.push_back(s);
            while (!stack.empty()) {
                const Index t = stack.back();
                stack.pop_back();
                for (Index h = 3 * t; h < 3 * t + 3; ++h) {
                    if (map_.is_feature(h)) continue;
                    const Index other = map_.twin(h) / 3;
                    if (region[other] != kNoIndex) continue;
                    region[other] = static_cast<Index>(count);
                    stack.push_back(other);
                }
            }
            ++count;
        }
        return region;
    }

    static std::uint64_t key(Index a, Index b) { return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

    /// The longest feature edge between each two neighbouring regions, by key. The outside of borders is region
    /// `outside`.
    std::unordered_map<std::uint64_t, Index> edges_between(std::span<const Index> region, Index outside) const {
        std::unordered_map<std::uint64_t, Index> between;
        const auto length = [&](Index h) {
            return (map_.position(map_.from(h)) - map_.position(map_.to(h))).squaredNorm();
        };
        for_each_half_edge([&](Index h) {
            if (!map_.is_feature(h)) return;
            const Index a = region[h / 3], b = map_.is_border(h) ? outside : region[map_.twin(h) / 3];
            if (a == b) return;
            const auto [entry, fresh] = between.try_emplace(key(a, b), h);
            if (!fresh && length(h) > length(entry->second)) entry->second = h;
        });
        return between;
    }

    /// The pairs of regions that chains from each odd region to another, or to the outside, cross. The chains are
    /// shortest, by breadth-first search.
    static std::vector<std::pair<Index, Index>> chains_between_odd(std::vector<std::uint8_t> odd, Index outside,
                                                                   std::span<const std::vector<Index>> neighbours) {
        std::vector<std::pair<Index, Index>> crossed;
        std::vector<Index> before(outside + 1), reached(outside + 1, kNoIndex); // from which start a region was reached
        for (Index start = 0; start < outside; ++start) {
            if (!odd[start]) continue;
            std::queue<Index> front;
            front.push(start);
            reached[start] = start;
            Index end = kNoIndex;
            while (!front.empty() && end == kNoIndex) {
                const Index at = front.front();
                front.pop();
                for (const Index r : neighbours[at]) {
                    if (reached[r] == start) continue;
                    reached[r] = start;
                    before[r] = at;
                    if (r == outside || odd[r]) {
                        end = r;
                        break;
                    }
                    front.push(r);
                }
            }
            if (end == kNoIndex) continue; // the matching will leave one over
            odd[start] = 0;
            if (end != outside) odd[end] = 0;
            for (Index r = end; r != start; r = before[r]) crossed.push_back(std::minmax(r, before[r]));
        }
        return crossed;
    }

    /// A region with an odd number of triangles cannot be paired. Splitting a feature edge adds one to both its sides,
    /// so a chain of splits from one odd region to another, or to a border, mends both ends.
    void make_regions_even() {
        std::size_t count = 0;
        const std::vector<Index> region = find_regions(count);
        const Index outside = static_cast<Index>(count);
        std::vector<std::uint8_t> odd(count + 1, 0);
        for (const Index r : region)
            if (r != kNoIndex) odd[r] ^= 1;
        if (std::none_of(odd.begin(), odd.end(), [](auto o) { return o != 0; })) return;
        const std::unordered_map<std::uint64_t, Index> between = edges_between(region, outside);
        std::vector<std::vector<Index>> neighbours(count + 1);
        for (const auto& [k, h] : between) {
            neighbours[k >> 32].push_back(static_cast<Index>(k & 0xffffffffu));
            neighbours[k & 0xffffffffu].push_back(static_cast<Index>(k >> 32));
        }
        for (auto& list : neighbours) std::sort(list.begin(), list.end());
        std::vector<std::pair<Index, Index>> crossed = chains_between_odd(std::move(odd), outside, neighbours);
        // by their ends, as a split before may give an edge another half-edge
        std::unordered_map<std::uint64_t, std::pair<Index, Index>> ends;
        for (const auto& [k, h] : between) ends[k] = {map_.from(h), map_.to(h)};
        // two chains over the same border cancel each other
        std::sort(crossed.begin(), crossed.end());
        for (std::size_t i = 0; i < crossed.size();) {
            std::size_t j = i;
            while (j < crossed.size() && crossed[j] == crossed[i]) ++j;
            if ((j - i) % 2 == 1) {
                const auto [from, to] = ends.at(key(crossed[i].first, crossed[i].second));
                if (const Index h = find_edge(from, to); h != kNoIndex) map_.split(h);
            }
            i = j;
        }
    }

    /// A half-edge between the two, in either direction.
    Index find_edge(Index from, Index to) const {
        Index h = map_.out(from);
        do {
            if (map_.to(h) == to) return h;
            const Index p = previous_half_edge(h);
            if (map_.from(p) == to) return p;
            if (map_.is_border(p)) return kNoIndex;
            h = map_.twin(p);
        } while (h != map_.out(from));
        return kNoIndex;
    }

    // --- matching

    /// What losing an edge is worth to the half-edge's first vertex; less than -1: it must not.
    double valence_worth(Index h) const {
        const Index v = map_.from(h);
        if (map_.kind(v) == VertexKind::inside) {
            switch (map_.valence(v)) {
            case 3:
                return -3;
            case 4:
                return -0.8;
            case 5:
                return -0.1;
            case 6:
                return 0.2;
            default:
                return 0.5;
            }
        }
        const double size = double(map_.sector_size(h));
        if (size <= 2 && needs_two(h)) return -10;
        const double wanted = std::max(1.0, std::round(map_.sector_angle(h) / (std::numbers::pi / 2)));
        return size > wanted ? 0.4 : -0.8;
    }

    void match(const RunContext& context) {
        std::vector<Index> dense(map_.slot_count(), kNoIndex), slots;
        for (Index s = 0; s < map_.slot_count(); ++s)
            if (!map_.is_removed(s)) {
                dense[s] = static_cast<Index>(slots.size());
                slots.push_back(s);
            }
        std::vector<Index> opposite(3 * slots.size(), kNoIndex);
        std::vector<double> weights(3 * slots.size(), -1);
        for (Index t = 0; t < slots.size(); ++t)
            for (Index k = 0; k < 3; ++k) {
                const Index h = 3 * slots[t] + k;
                if (map_.is_feature(h)) continue;
                const Index g = map_.twin(h);
                opposite[3 * t + k] = 3 * dense[g / 3] + g % 3;
                const double worth = valence_worth(h) + valence_worth(g);
                if (worth < -9) continue;
                const double jacobian =
                    scaled_jacobian(map_.position(map_.from(h)), map_.position(map_.from(previous_half_edge(g))),
                                    map_.position(map_.to(h)), map_.position(map_.from(previous_half_edge(h))));
                weights[3 * t + k] = std::clamp((jacobian + 0.6 * worth + 4.6) / 6.2, 0.0, 1.0);
            }
        const std::vector<Index> pairs = match_triangles(opposite, weights, [&] { return context.is_cancelled(); });
        partner_.assign(map_.slot_count(), kNoIndex);
        if (pairs.empty()) return; // cancelled
        for (Index t = 0; t < slots.size(); ++t)
            if (pairs[t] != kNoIndex) partner_[slots[t]] = slots[pairs[t]];
    }

    bool is_diagonal(Index h) const { return !map_.is_border(h) && partner_[h / 3] == map_.twin(h) / 3; }

    /// A vertex inside with two quads cannot have positive corners: it goes, and the two become one.
    void remove_doublets() {
        Star star;
        for (bool changed = true; changed;) {
            changed = false;
            for (Index v = 0; v < map_.vertex_count(); ++v) {
                if (map_.is_vertex_removed(v) || map_.kind(v) != VertexKind::inside || map_.valence(v) > 4) continue;
                map_.star(v, star);
                const auto diagonals = std::count_if(star.half_edges.begin(), star.half_edges.end(),
                                                     [&](Index h) { return is_diagonal(h); });
                if (std::ptrdiff_t(star.triangle_count()) - diagonals == 2 && merge_around(star)) changed = true;
            }
        }
    }

    bool merge_around(Star& star) {
        if (!map_.flatten(star)) return false;
        Index outer = kNoIndex; // the partner of the one triangle whose partner is not at the vertex
        for (const Index h : star.half_edges)
            if (!is_diagonal(h) && !is_diagonal(previous_half_edge(h))) outer = partner_[h / 3];
        for (std::size_t target = 0; target < star.ring.size(); ++target) {
            const Index v = star.ring[target];
            bool possible = true;
            std::vector<Index> left;
            for (std::size_t i = 0; i < star.triangle_count(); ++i) {
                if (i == target || star.next(i) == target) continue;
                const Vec2d p = star.flat[target].cast<double>();
                possible &= cross(star.flat[i].cast<double>() - p, star.flat[star.next(i)].cast<double>() - p) > 1e-3;
                left.push_back(star.half_edges[i] / 3);
            }
            if (star.ring.size() == 4) possible &= !map_.are_neighbours(v, star.ring[(target + 2) % 4]);
            for (const std::size_t beside : {star.next(target), (target + star.ring.size() - 1) % star.ring.size()})
                possible &=
                    map_.valence(star.ring[beside]) > (map_.kind(star.ring[beside]) == VertexKind::inside ? 3u : 2u);
            if (!possible) continue;
            map_.collapse(star, target);
            if (left.size() == 2) {
                partner_[left[0]] = left[1];
                partner_[left[1]] = left[0];
            } else {
                partner_[left[0]] = outer;
                if (outer != kNoIndex) partner_[outer] = left[0];
            }
            return true;
        }
        return false;
    }

    // --- patches

    BaseQuads collect() {
        vertex_.assign(map_.vertex_count(), kNoIndex);
        for (Index v = 0; v < map_.vertex_count(); ++v)
            if (!map_.is_vertex_removed(v)) vertex_[v] = add_vertex(is_tip(v) ? VertexKind::corner : map_.kind(v));
        for (Index s = 0; s < map_.slot_count(); ++s)
            if (!map_.is_removed(s) && partner_[s] == kNoIndex) result_.halved = true;
        for (Index s = 0; s < map_.slot_count(); ++s) {
            if (map_.is_removed(s)) continue;
            if (partner_[s] == kNoIndex)
                add_triangle(s);
            else if (s < partner_[s])
                add_pair(s);
        }
        return std::move(result_);
    }

    /// Whether the triangles at a vertex inside make a sharp cone: the end of a thin part, which would be lost if the
    /// vertex slid down from it.
    bool is_tip(Index v) const {
        if (map_.kind(v) != VertexKind::inside) return false;
        double angle = 0;
        Index h = map_.out(v);
        do {
            angle += map_.corner_angle(h);
            h = map_.twin(previous_half_edge(h));
        } while (h != map_.out(v));
        return angle < kTipAngle;
    }

    Index add_vertex(VertexKind kind) {
        result_.kinds.push_back(kind);
        return static_cast<Index>(result_.kinds.size() - 1);
    }

    Index middle_of(Index h) {
        const Index g = map_.is_border(h) ? h : std::min(h, map_.twin(h));
        const auto [entry, fresh] = middles_.try_emplace(g, kNoIndex);
        if (fresh) entry->second = add_vertex(map_.is_feature(g) ? VertexKind::curve : VertexKind::inside);
        return entry->second;
    }

    void add_pair(Index s) {
        Index h = 3 * s;
        while (map_.is_border(h) || map_.twin(h) / 3 != partner_[s]) ++h;
        const Index g = map_.twin(h);
        const SurfaceMap::Unfolded flat = map_.unfold(h);
        std::array<Vec2d, 4> outline = {Vec2d::Zero(), flat.below.cast<double>(), flat.to.cast<double>(),
                                        flat.above.cast<double>()};
        if (!is_convex(outline)) outline = {Vec2d(0, 0), Vec2d(1, 0), Vec2d(1, 1), Vec2d(0, 1)};
        BaseQuad quad;
        quad.slots = {s, g / 3};
        const auto corner = [&](int slot, Index half, std::size_t place) {
            quad.corners[slot][half % 3] = outline[place];
        };
        corner(0, h, 0);
        corner(0, next_half_edge(h), 2);
        corner(0, previous_half_edge(h), 3);
        corner(1, g, 2);
        corner(1, next_half_edge(g), 0);
        corner(1, previous_half_edge(g), 1);
        // sides from a to d, d to b, b to c, c to a
        add(quad, outline, {next_half_edge(g), previous_half_edge(g), next_half_edge(h), previous_half_edge(h)});
    }

    void add_triangle(Index s) {
        BaseQuad quad;
        quad.slots = {s, kNoIndex};
        const std::array<Vec2d, 3> outline = {Vec2d(0, 0), Vec2d(1, 0), Vec2d(0.5, 0.866)};
        quad.corners.fill(outline);
        const std::array<Index, 3> sides = {3 * s, 3 * s + 1, 3 * s + 2};
        add(quad, outline, sides);
    }

    /// One patch, or, when all are halved, one at each corner.
    template <std::size_t N>
    void add(BaseQuad quad, const std::array<Vec2d, N>& outline, const std::array<Index, N>& sides) {
        if constexpr (N == 4)
            if (!result_.halved) {
                quad.places = outline;
                for (std::size_t i = 0; i < N; ++i) {
                    quad.vertices[i] = vertex_[map_.from(sides[i])];
                    quad.features[i] = map_.is_feature(sides[i]);
                }
                result_.quads.push_back(quad);
                return;
            }
        const Index centre = add_vertex(VertexKind::inside);
        Vec2d middle = Vec2d::Zero();
        for (const Vec2d& p : outline) middle += p / double(N);
        for (std::size_t i = 0; i < N; ++i) {
            const std::size_t before = (i + N - 1) % N;
            quad.vertices = {vertex_[map_.from(sides[i])], middle_of(sides[i]), centre, middle_of(sides[before])};
            quad.places = {outline[i], 0.5 * (outline[i] + outline[(i + 1) % N]), middle,
                           0.5 * (outline[i] + outline[before])};
            quad.features = {map_.is_feature(sides[i]), false, false, map_.is_feature(sides[before])};
            result_.quads.push_back(quad);
        }
    }

    static bool is_convex(const std::array<Vec2d, 4>& outline) {
        for (std::size_t i = 0; i < 4; ++i) {
            const Vec2d a = outline[(i + 1) % 4] - outline[i], b = outline[(i + 2) % 4] - outline[(i + 1) % 4];
            if (cross(a, b) < kConvex * a.norm() * b.norm()) return false;
        }
        return true;
    }

    SurfaceMap& map_;
    std::vector<Index> partner_; ///< of each slot
    BaseQuads result_;
    std::vector<Index> vertex_; ///< of the base, for each of the map's
    std::unordered_map<Index, Index> middles_;
};

} // namespace

TrianglePoint BaseQuad::at(double s, double t) const {
    const Vec2d p = (1 - t) * ((1 - s) * places[0] + s * places[1]) + t * ((1 - s) * places[3] + s * places[2]);
    TrianglePoint point{slots[0], weights_in(corners[0], p)};
    if (slots[1] != kNoIndex) {
        const Vec3d other = weights_in(corners[1], p);
        if (other.minCoeff() > point.barycentric.minCoeff()) point = {slots[1], other};
    }
    point.barycentric = point.barycentric.cwiseMax(0.0);
    point.barycentric /= point.barycentric.sum();
    return point;
}

Result<BaseQuads> make_base_quads(SurfaceMap& map, bool halve, const RunContext& context) {
    return Pairing(map, halve).run(context);
}

} // namespace filigree
