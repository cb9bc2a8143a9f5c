// Based on:
//   [Garland 1997] (quadric error), [Lee 1998] (independent of position: the map is recorded, not the error).
#include "filigree/remesh/base_triangles.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>

namespace filigree {

namespace {

constexpr double kLengthWeight = 1e-3;   // of (edge length)^2 x area, beside the quadric: spreads vertices
constexpr std::size_t kLargestStar = 60; // triangles; records count corners in bytes, and cost grows with them
constexpr double kFinestBefore = 3;      // triangles before the last decimation, at least, times those wanted
constexpr double kLongestEdge = 1.6;     // before it, in edges of the wanted triangles were they equilateral
constexpr std::size_t kMostRefined = 8;  // times those: where needles meet, splitting has to end
// A star that is poor already may get this much poorer: where tiny triangles lie among large ones, each collapse but
// the last leaves slivers. Without it the dragon's base stops at 7,100 triangles and comes to 1,562 through the last
// stages.
constexpr double kWorsening = 0.1;
constexpr double kSmallDetail = 0.5;                 // of a wanted triangle's area: what the area guard lets go
constexpr double kNeedle = 0.1, kManyNeedles = 0.05; // shape, and the part of all triangles
constexpr int kImprovingRounds = 8;
constexpr double kRelocationBound = 0.005; // of (star area)^2: how far a vertex may leave its quadric's planes
constexpr double kPositive = 1e-5;         // area in the plane, of the star's radius squared

/// What a collapse must satisfy; each stage asks for less than the one before.
struct Stage {
    double shape;  ///< 4 sqrt(3) area / sum of squared sides of each new triangle; see kWorsening
    double cosine; ///< of each new normal against the star's, or as good as the worst was
    Index valence;
    double cover; ///< area guard: original area over new area
};
constexpr std::array<Stage, 5> kStages = {
    {{0.3, 0.5, 9, 1.3}, {0.2, 0.2, 10, 1.7}, {0.1, 0.0, 11, 2.6}, {0.03, -0.5, 13, 5.2}, {0.0, -1.1, 16, 1e30}}};

struct Quadric {
    Eigen::Matrix<double, 6, 1> a = Eigen::Matrix<double, 6, 1>::Zero(); // xx xy xz yy yz zz
    Vec3d b = Vec3d::Zero();
    double c = 0;

    void add_plane(const Vec3d& n, const Vec3d& p, double weight) {
        const double d = -n.dot(p);
        a[0] += weight * n.x() * n.x();
        a[1] += weight * n.x() * n.y();
        a[2] += weight * n.x() * n.z();
        a[3] += weight * n.y() * n.y();
        a[4] += weight * n.y() * n.z();
        a[5] += weight * n.z() * n.z();
        b += weight * d * n;
        c += weight * d * d;
    }
    void operator+=(const Quadric& other) {
        a += other.a;
        b += other.b;
        c += other.c;
    }
    double at(const Vec3d& p) const {
        const double x = p.x(), y = p.y(), z = p.z();
        const double quadratic =
            a[0] * x * x + a[3] * y * y + a[5] * z * z + 2 * (a[1] * x * y + a[2] * x * z + a[4] * y * z);
        return std::max(0.0, quadratic + 2 * b.dot(p) + c);
    }
};

double cross_in_plane(const Vec2f& a, const Vec2f& b) { return double(a.x()) * b.y() - double(a.y()) * b.x(); }
double doubled_flat_area(const Vec2f& a, const Vec2f& b, const Vec2f& c) { return cross_in_plane(b - a, c - a); }

/// 1 for an equilateral triangle, 0 without an area.
double shape(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double sides = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    return sides > 0 ? 2 * std::sqrt(3.0) * (b - a).cross(c - a).norm() / sides : 0;
}

class BaseMaker {
public:
    BaseMaker(SurfaceMap& map, const RunContext& context) : map_(map), context_(context) {}

    Status run(std::size_t target) {
        double area = 0;
        for (Index s = 0; s < map_.slot_count(); ++s) area += map_.covered_area(s);
        small_detail_ = kSmallDetail * area / double(target);
        make_quadrics();
        if (is_poor()) flip_edges(4);
        const std::size_t fine = static_cast<std::size_t>(kFinestBefore * double(target));
        decimate_to(fine);
        refine(fine, kLongestEdge * std::sqrt(4 / std::sqrt(3.0) * area / double(target)));
        decimate_to(target);
        if (context_.is_cancelled()) return cancelled_error();
        for (int round = 0; round < kImprovingRounds; ++round) {
            flip_edges(2);
            relocate_vertices();
            if (context_.is_cancelled()) return cancelled_error();
        }
        remove_low_valences();
        flip_edges(2);
        return Success{};
    }

private:
    void decimate_to(std::size_t target) {
        for (std::size_t i = 0; i < kStages.size() && map_.triangle_count() > target && !context_.is_cancelled(); ++i)
            decimate(kStages[i], target);
    }

    /// Splits edges, the longest first, until none is longer than `longest` and there are enough triangles.
    void refine(std::size_t least_count, double longest) {
        const std::size_t most = kMostRefined * least_count;
        struct Long {
            double length;
            Index from, to, half_edge;
            bool operator<(const Long& other) const {
                return length != other.length ? length < other.length : half_edge > other.half_edge;
            }
        };
        std::priority_queue<Long> queue;
        const auto push = [&](Index h) {
            if (!map_.is_border(h) && map_.twin(h) < h) h = map_.twin(h);
            queue.push(
                {(map_.position(map_.from(h)) - map_.position(map_.to(h))).squaredNorm(), map_.from(h), map_.to(h), h});
        };
        for (Index h = 0; h < 3 * map_.slot_count(); ++h)
            if (!map_.is_removed(h / 3) && (map_.is_border(h) || h < map_.twin(h))) push(h);
        while (map_.triangle_count() < most && !queue.empty() && !context_.is_cancelled()) {
            const Long next = queue.top();
            queue.pop();
            if (map_.triangle_count() >= least_count && next.length <= longest * longest) break;
            if (map_.from(next.half_edge) != next.from || map_.to(next.half_edge) != next.to) continue;
            if (!(next.length > 0)) break;
            const Index middle = map_.split(next.half_edge);
            quadrics_.emplace_back();
            map_.star(middle, star_);
            for (const Index h : star_.half_edges) {
                add_planes(h / 3, middle);
                push(h);
                push(next_half_edge(h)); // as long as before, but its half-edge may be another now
            }
            if (star_.open) push(previous_half_edge(star_.half_edges.back()));
        }
    }

    void make_quadrics() {
        quadrics_.assign(map_.vertex_count(), {});
        for (Index s = 0; s < map_.slot_count(); ++s)
            for (const Index v : map_.triangle(s)) add_planes(s, v);
    }

    /// What a triangle means to one of its vertices: its plane, and those that stand on its features.
    void add_planes(Index slot, Index vertex) {
        const Vec3d normal = map_.normal(slot);
        const double doubled = normal.norm();
        if (!(doubled > 0)) return;
        quadrics_[vertex].add_plane(normal / doubled, map_.position(vertex), doubled / 6);
        for (Index h = 3 * slot; h < 3 * slot + 3; ++h) {
            if (!map_.is_feature(h) || (map_.from(h) != vertex && map_.to(h) != vertex)) continue;
            const Vec3d along = map_.position(map_.to(h)) - map_.position(map_.from(h)), side = along.cross(normal);
            const double length = side.norm();
            if (length > 0) quadrics_[vertex].add_plane(side / length, map_.position(vertex), along.squaredNorm() / 2);
        }
    }

    // --- decimation

    struct Candidate {
        double cost;
        Index from, to, stamp, rank;
        bool operator>(const Candidate& other) const {
            return cost != other.cost ? cost > other.cost : from > other.from;
        }
    };

    void decimate(const Stage& stage, std::size_t target) {
        stage_ = stage;
        stamps_.assign(map_.vertex_count(), 0);
        queue_ = {};
        for (Index v = 0; v < map_.vertex_count(); ++v) consider(v);
        const std::size_t start = map_.triangle_count();
        for (std::size_t step = 0; map_.triangle_count() > target && !queue_.empty(); ++step) {
            if (step % 4096 == 0) {
                if (context_.is_cancelled()) return;
                context_.report("decimating", double(start - map_.triangle_count()) / double(start - target));
            }
            const Candidate next = queue_.top();
            queue_.pop();
            if (next.stamp != stamps_[next.from]) continue;
            map_.star(next.from, star_);
            const std::size_t at =
                static_cast<std::size_t>(std::find(star_.ring.begin(), star_.ring.end(), next.to) - star_.ring.begin());
            if (at == star_.ring.size() || !map_.flatten(star_)) continue;
            measure_star();
            if (!may_collapse(at)) {
                push_candidate(next.from, next.rank + 1);
                continue;
            }
            changed_ = star_.ring;
            map_.collapse(star_, at);
            quadrics_[next.to] += quadrics_[next.from];
            ++stamps_[next.from];
            for (const Index v : changed_) {
                // all but the new edges of a very large fan: or every change would cost the whole fan
                if (v == next.to && map_.valence(v) > kLargestStar) continue;
                consider(v);
            }
        }
    }

    void consider(Index u) {
        ++stamps_[u];
        push_candidate(u, 0);
    }

    /// Puts the vertex's rank-th cheapest collapse into the queue, if it has so many. It is tried out when its turn
    /// comes: most never are.
    void push_candidate(Index u, Index rank) {
        if (map_.is_vertex_removed(u) || map_.kind(u) == VertexKind::corner || map_.valence(u) > kLargestStar) return;
        map_.star(u, star_);
        double area = 0;
        for (const Index h : star_.half_edges) area += map_.covered_area(h / 3);
        costs_.clear();
        const auto price = [&](std::size_t i) {
            const Index v = star_.ring[i];
            const Vec3d& p = map_.position(v);
            const double cost =
                quadrics_[u].at(p) + quadrics_[v].at(p) + kLengthWeight * (p - map_.position(u)).squaredNorm() * area;
            costs_.push_back({cost, v});
        };
        if (map_.kind(u) == VertexKind::curve) {
            price(star_.curve_a);
            price(star_.curve_b);
        } else {
            for (std::size_t i = 0; i < star_.ring.size(); ++i) price(i);
        }
        if (rank >= costs_.size()) return;
        std::nth_element(costs_.begin(), costs_.begin() + rank, costs_.end());
        queue_.push({costs_[rank].first, u, costs_[rank].second, stamps_[u], rank});
    }

    /// Normals, shapes and areas of the star as it is, apart for the two sides of a curve.
    void measure_star() {
        const bool curve = map_.kind(star_.centre) == VertexKind::curve;
        side_normal_ = {Vec3d::Zero(), Vec3d::Zero()};
        worst_shape_ = 1;
        covered_ = 0;
        for (std::size_t i = 0; i < star_.triangle_count(); ++i) {
            const Index s = star_.half_edges[i] / 3;
            side_normal_[curve && is_below(i)] += map_.normal(s);
            const Triangle& t = map_.triangle(s);
            worst_shape_ = std::min(worst_shape_, shape(map_.position(t[0]), map_.position(t[1]), map_.position(t[2])));
            covered_ += map_.covered_area(s);
        }
        worst_cosine_ = {1, 1};
        for (std::size_t i = 0; i < star_.triangle_count(); ++i) {
            const std::size_t side = curve && is_below(i);
            const Vec3d n = map_.normal(star_.half_edges[i] / 3);
            worst_cosine_[side] = std::min(worst_cosine_[side], cosine(n, side_normal_[side]));
        }
    }

    bool is_below(std::size_t i) const { return i < star_.curve_a || i >= star_.curve_b; }

    static double cosine(const Vec3d& a, const Vec3d& b) {
        const double lengths = a.norm() * b.norm();
        return lengths > 0 ? a.dot(b) / lengths : 0;
    }

    /// Whether the flat, measured star's centre may go to ring[target].
    bool may_collapse(std::size_t target) {
        const std::size_t n = star_.ring.size();
        const Index u = star_.centre, v = star_.ring[target];
        const bool first_open = star_.open && target == 0, last_open = star_.open && target + 1 == n;
        if (map_.valence(u) > 4 && map_.valence(u) + map_.valence(v) > stage_.valence + 4u) return false;
        if (!keeps_ends(target, first_open, last_open) || !is_linked(v, first_open || last_open ? 1 : 2)) return false;
        const bool curve = map_.kind(u) == VertexKind::curve;
        const Vec3d& p = map_.position(v);
        double area = 0;
        for (std::size_t i = 0; i < star_.triangle_count(); ++i) {
            if (i == target || star_.next(i) == target) continue;
            const std::size_t j = star_.next(i);
            if (doubled_flat_area(star_.flat[target], star_.flat[i], star_.flat[j]) < kPositive) return false;
            const Vec3d &a = map_.position(star_.ring[i]), &b = map_.position(star_.ring[j]);
            const Vec3d normal = (a - p).cross(b - p);
            area += 0.5 * normal.norm();
            if (shape(p, a, b) < std::min(stage_.shape, kWorsening * worst_shape_)) return false;
            const std::size_t side = curve && is_below(i);
            if (cosine(normal, side_normal_[side]) < std::min(stage_.cosine, worst_cosine_[side] - 1e-9)) return false;
        }
        return covered_ <= stage_.cover * area + small_detail_;
    }

    /// The two vertices beside the edge lose a triangle each: they must have enough left, and no two features merge.
    bool keeps_ends(std::size_t target, bool first_open, bool last_open) const {
        const std::size_t n = star_.ring.size();
        const auto keeps = [&](std::size_t beside, std::size_t triangle) {
            const Index w = star_.ring[beside], arm = star_.half_edges[triangle];
            // the sides of this triangle other than the edge that collapses
            const Index to_ring = next_half_edge(arm);
            const Index at_centre = beside == triangle ? arm : previous_half_edge(arm);
            if (map_.is_feature(at_centre) &&
                (map_.is_feature(to_ring) || map_.kind(star_.centre) != VertexKind::inside))
                return false;
            const Index at_w = beside == triangle ? to_ring : previous_half_edge(arm);
            const std::size_t left = map_.sector_size(at_w) - 1;
            switch (map_.kind(w)) {
            case VertexKind::inside:
                return left >= 3;
            case VertexKind::curve:
                return left >= 2;
            case VertexKind::corner:
                break;
            }
            return left >= 1;
        };
        if (!last_open && !keeps(star_.next(target), target)) return false;
        if (!first_open &&
            !keeps(target > 0 ? target - 1 : n - 1, target > 0 ? target - 1 : star_.triangle_count() - 1))
            return false;
        return true;
    }

    /// The link condition: the ends share no neighbours but those beside the edge.
    bool is_linked(Index v, std::size_t expected) {
        if (map_.valence(v) > kLargestStar)
            return static_cast<std::size_t>(std::count_if(star_.ring.begin(), star_.ring.end(), [&](Index w) {
                       return w != v && map_.are_neighbours(w, v);
                   })) == expected;
        if (marks_.size() < map_.vertex_count()) marks_.resize(map_.vertex_count(), 0);
        ++mark_;
        for (const Index w : star_.ring) marks_[w] = mark_;
        std::size_t shared = 0;
        const Index first = map_.out(v);
        Index h = first;
        do {
            shared += marks_[map_.to(h)] == mark_;
            const Index p = previous_half_edge(h);
            if (map_.is_border(p)) {
                shared += marks_[map_.from(p)] == mark_;
                break;
            }
            h = map_.twin(p);
        } while (h != first && shared <= expected);
        return shared == expected;
    }

    // --- shape and valence

    /// How far the triangles at h's first vertex are from what that sector should have; `change` are added.
    double valence_price(Index h, int change) const {
        const Index v = map_.from(h);
        if (map_.kind(v) == VertexKind::inside) {
            const double off = double(map_.valence(v)) + change - 6;
            return off * off + (off <= -2 ? 4 : 0); // 4 or fewer make poor quads
        }
        if (map_.sector_size(h) >= SurfaceMap::kMostCounted)
            return 0; // whatever it is, less is better: no collapse adds
        const int size = static_cast<int>(map_.sector_size(h)) + change;
        const double off = size - (map_.kind(v) == VertexKind::curve ? 3.0 : wanted_at_corner(h));
        const int least = map_.kind(v) == VertexKind::curve ? 2 : 1; // quads beside a curve need two
        return off * off + (size < least ? 100 : size == least && least == 2 ? 3 : 0);
    }

    double wanted_at_corner(Index half_edge) const {
        return std::max(1.0, std::round(map_.sector_angle(half_edge) / (std::numbers::pi / 3)));
    }

    /// Whether many triangles are needles, as in tessellated parts: flips first, as no collapse would pass its tests.
    bool is_poor() const {
        std::size_t needles = 0;
        for (Index s = 0; s < map_.slot_count(); ++s) {
            const Triangle& t = map_.triangle(s);
            needles += shape(map_.position(t[0]), map_.position(t[1]), map_.position(t[2])) < kNeedle;
        }
        return double(needles) > kManyNeedles * double(map_.triangle_count());
    }

    void flip_edges(int passes) {
        for (int pass = 0; pass < passes && !context_.is_cancelled(); ++pass) {
            std::size_t flips = 0;
            for (Index h = 0; h < 3 * map_.slot_count() && !(h % 65536 == 0 && context_.is_cancelled()); ++h)
                if (!map_.is_removed(h / 3) && !map_.is_feature(h) && h < map_.twin(h) && should_flip(h)) {
                    map_.flip(h);
                    ++flips;
                }
            if (flips == 0) return;
        }
    }

    bool can_flip(Index h) const {
        const Index g = map_.twin(h), a = map_.from(h), b = map_.to(h);
        const Index c = map_.from(previous_half_edge(h)), d = map_.from(previous_half_edge(g));
        if (c == d || map_.are_neighbours(c, d)) return false;
        for (const Index half : {h, g}) {
            const Index v = map_.from(half);
            if (map_.kind(v) == VertexKind::inside ? map_.valence(v) <= 3 : map_.sector_size(half) <= 1) return false;
        }
        const SurfaceMap::Unfolded flat = map_.unfold(h);
        const double size = flat.to.squaredNorm();
        if (doubled_flat_area(flat.above, Vec2f::Zero(), flat.below) < 1e-3 * size ||
            doubled_flat_area(flat.below, flat.to, flat.above) < 1e-3 * size)
            return false;
        const Vec3d &pa = map_.position(a), &pb = map_.position(b), &pc = map_.position(c), &pd = map_.position(d);
        const Vec3d n = (pa - pc).cross(pd - pc), m = (pb - pd).cross(pc - pd);
        const Vec3d before = map_.normal(h / 3) + map_.normal(g / 3);
        const double worst = std::min(cosine(map_.normal(h / 3), before), cosine(map_.normal(g / 3), before));
        if (std::min(cosine(n, before), cosine(m, before)) < std::min(0.7, worst)) return false;
        const double covered = map_.covered_area(h / 3) + map_.covered_area(g / 3);
        const double old_area = map_.area(h / 3) + map_.area(g / 3), new_area = 0.5 * (n.norm() + m.norm());
        return covered <= 1.5 * new_area + small_detail_ || new_area >= old_area;
    }

    bool should_flip(Index h) const {
        const Index g = map_.twin(h);
        const Vec3d &a = map_.position(map_.from(h)), &b = map_.position(map_.to(h));
        const Index at_c = previous_half_edge(h), at_d = previous_half_edge(g);
        const Vec3d &c = map_.position(map_.from(at_c)), &d = map_.position(map_.from(at_d));
        const double before = std::min(shape(a, b, c), shape(b, a, d)),
                     after = std::min(shape(c, a, d), shape(d, b, c));
        if (after < std::min(0.45, before)) return false;
        const double gain = valence_price(h, 0) + valence_price(g, 0) + valence_price(at_c, 0) +
                            valence_price(at_d, 0) - valence_price(h, -1) - valence_price(g, -1) -
                            valence_price(at_c, 1) - valence_price(at_d, 1);
        if (gain + 4 * (after - before) <= 0.5) return false;
        return can_flip(h);
    }

    void relocate_vertices() {
        for (Index v = 0; v < map_.vertex_count(); ++v)
            if (!map_.is_vertex_removed(v) && map_.kind(v) != VertexKind::corner && map_.valence(v) <= kLargestStar)
                relocate(v);
    }

    void relocate(Index v) {
        map_.star(v, star_);
        if (!map_.flatten(star_)) return;
        measure_star();
        Vec2f place = Vec2f::Zero();
        if (map_.kind(v) == VertexKind::curve) {
            place.x() = 0.5f * (star_.flat[star_.curve_a].x() + star_.flat[star_.curve_b].x());
        } else {
            double sum = 0;
            Vec2d weighted = Vec2d::Zero();
            for (std::size_t i = 0; i < star_.triangle_count(); ++i) {
                const Vec2f &a = star_.flat[i], &b = star_.flat[star_.next(i)];
                const double area = cross_in_plane(a, b);
                weighted += area * (a + b).cast<double>() / 3;
                sum += area;
            }
            place = (weighted / sum).cast<float>();
        }
        if (place.squaredNorm() < 1e-4f) return;
        double area = 0;
        for (const Index h : star_.half_edges) area += map_.area(h / 3);
        for (int attempt = 0; attempt < 3; ++attempt, place *= 0.5f)
            if (may_relocate(place, area)) {
                map_.relocate(star_, place);
                return;
            }
    }

    bool may_relocate(const Vec2f& place, double old_area) const {
        for (std::size_t i = 0; i < star_.triangle_count(); ++i)
            if (doubled_flat_area(place, star_.flat[i], star_.flat[star_.next(i)]) < 1e-3) return false;
        const Vec3d p = map_.original_position(map_.locate(star_, place));
        if (quadrics_[star_.centre].at(p) > kRelocationBound * old_area * old_area) return false;
        const bool curve = map_.kind(star_.centre) == VertexKind::curve;
        double area = 0, worst = 1;
        for (std::size_t i = 0; i < star_.triangle_count(); ++i) {
            const Vec3d &a = map_.position(star_.ring[i]), &b = map_.position(star_.ring[star_.next(i)]);
            const Vec3d normal = (a - p).cross(b - p);
            area += 0.5 * normal.norm();
            worst = std::min(worst, shape(p, a, b));
            const std::size_t side = curve && is_below(i);
            if (cosine(normal, side_normal_[side]) < std::min(0.5, worst_cosine_[side])) return false;
        }
        return worst >= std::min(worst_shape_, 0.5) && (covered_ <= 1.4 * area + small_detail_ || area >= old_area);
    }

    /// Vertices inside with three triangles make quads with a straight corner, whatever is paired.
    void remove_low_valences() {
        stage_ = {0.05, 0.0, 12, 1.8};
        for (Index v = 0; v < map_.vertex_count(); ++v) {
            if (map_.is_vertex_removed(v) || map_.kind(v) != VertexKind::inside || map_.valence(v) > 3) continue;
            map_.star(v, star_);
            if (!map_.flatten(star_)) continue;
            measure_star();
            for (std::size_t i = 0; i < star_.ring.size(); ++i)
                if (may_collapse(i)) {
                    quadrics_[star_.ring[i]] += quadrics_[v];
                    map_.collapse(star_, i);
                    break;
                }
        }
    }

    SurfaceMap& map_;
    const RunContext& context_;
    std::vector<Quadric> quadrics_;
    Stage stage_ = kStages[0];
    std::vector<Index> stamps_;
    std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue_;
    std::vector<std::pair<double, Index>> costs_;
    std::vector<Index> changed_;
    double small_detail_ = 0; ///< area that may go unnoticed
    std::vector<std::uint32_t> marks_;
    std::uint32_t mark_ = 0;

    Star star_; ///< the one in hand, and what is known of it
    std::array<Vec3d, 2> side_normal_;
    std::array<double, 2> worst_cosine_;
    double worst_shape_ = 1, covered_ = 0;
};

} // namespace

Status make_base_triangles(SurfaceMap& map, const BaseTrianglesOptions& options, const RunContext& context) {
    return BaseMaker(map, context).run(options.triangles);
}

} // namespace filigree
