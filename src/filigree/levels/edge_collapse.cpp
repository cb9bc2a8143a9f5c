// Based on: quadric error metrics [Garland 1997], half-edge form. Where we differ: quadrics are weighted by area, and
// nothing is forbidden, only priced, so that every mesh can be brought to any count.
//
// Three prices beside the quadric's, as the restored mesh is only as good as its worst place:
// - length: a collapse costs the square of its length, so that flat parts keep vertices too;
// - a least area: a thin tip has hardly any, and would go for nothing;
// - height: planes of steep sides pass near a tip's axis, and their quadric does not see the tip go. So each vertex
//   remembers the point that stands out most of those merged into it, and a collapse whose turn has come is priced
//   again by how far that point will be from the triangles left.
//
// Hubs, vertices of very many triangles (the middle of a fan), would make it quadratic: every collapse next to one
// would look at all of them. So removed triangles stay in the lists until these are half empty, what two vertices share
// is looked for at the one with fewer triangles, and a collapse into a hub prices only what it changed. The hub's other
// edges are priced again when they come up; a quadric only grows, so until then they stand where they are too early,
// never too late.
#include "filigree/levels/edge_collapse.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/edges.h"
#include "filigree/mesh/quadric.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <utility>

namespace filigree {

namespace {

constexpr double kBorderWeight = 1; // of the planes that stand on open edges, so that outlines keep their shape
constexpr double kLeastArea = 0.2;  // what merges counts as this large at least, in mean areas of the driver's vertices
constexpr std::size_t kMostTakenDown = 32; // vertices a vertex that is left, as far as mean areas go
constexpr double kHeightWeight = 0.3;      // of (height of what stands out)^2 x area
constexpr double kFarthestPoint = 3;       // times the largest error: how far off a single point may be left
constexpr double kTellingHeight = 0.2; // a height that makes a collapse dearer by less than this share changes no order
constexpr double kMinCosine = 0.2;     // a triangle that turns further than this in a collapse counts as turned over
constexpr std::size_t kHub = 1024;     // triangles at a vertex from which it counts as a hub
constexpr std::size_t kWideFan = 64;   // triangles at a vertex from which heights are not looked at: they cost so many
constexpr std::size_t kFewTriangles = 8; // a list this long is no trouble even when all of it is gone
constexpr double kHubSlack =
    1.5; // an edge of a hub may have become this much dearer since it was priced: 1.2 in distance
constexpr double kLargePart = 0.05;          // of the diagonal: parts from here on keep vertices of their own
constexpr std::size_t kMostKeptByParts = 16; // all parts together keep this share at most

struct Collapse {
    double cost;  ///< what it is sorted by
    double error; ///< the part of the cost that is distance from the surface
    Index from, to;
    Index stamp; ///< of both ends together when it was priced; older entries are void
    bool forced;
    bool has_height = false; ///< whether the height is in the cost

    bool operator>(const Collapse& other) const {
        if (cost != other.cost) return cost > other.cost;
        return from != other.from ? from > other.from : to > other.to;
    }
};

/// The triangles at a vertex.
struct TriangleList {
    std::vector<Index> all; ///< those that are left in their order, and some that are gone
    std::size_t left = 0;

    void add(Index triangle) {
        all.push_back(triangle);
        ++left;
    }
};

/// Another shape of the mesh that is simplified.
struct OtherShape {
    std::vector<Vec3d> points;
    std::vector<Quadric> quadrics;
};

} // namespace

/// Writes down what happens to triangles and vertices, in local numbers; ids are given when all is done.
class CollapseRecorder {
public:
    void begin(std::span<const Triangle> triangles, std::size_t vertices) {
        order_.triangles_.assign(triangles.begin(), triangles.end());
        order_.gone_at_.assign(triangles.size(), kNoIndex);
        order_.merged_into_.assign(vertices, kNoIndex);
        order_.merged_at_.assign(vertices, kNoIndex);
        add_step(vertices, 0, 0);
    }
    void remove(Index triangle) { order_.gone_at_[triangle] = step(); }
    void merge(Index from, Index to) {
        order_.merged_into_[from] = to;
        order_.merged_at_[from] = step();
    }
    void add_step(std::size_t vertices, double error, std::size_t forced) {
        order_.counts_.push_back(vertices);
        order_.errors_.push_back(error);
        order_.forced_.push_back(forced);
    }
    /// source: the id of each local vertex; count: of ids.
    CollapseOrder take(std::span<const Index> source, std::size_t count) {
        std::vector<Index> into(count, kNoIndex), at(count, kNoIndex);
        for (std::size_t v = 0; v < source.size(); ++v) {
            if (order_.merged_into_[v] == kNoIndex) continue;
            into[source[v]] = source[order_.merged_into_[v]];
            at[source[v]] = order_.merged_at_[v];
        }
        order_.merged_into_ = std::move(into);
        order_.merged_at_ = std::move(at);
        for (Triangle& t : order_.triangles_)
            for (Index& v : t) v = source[v];
        return std::move(order_);
    }

private:
    Index step() const { return static_cast<Index>(order_.counts_.size()); } ///< the one that is going on
    CollapseOrder order_;
};

namespace {

class Collapser {
public:
    Collapser(std::span<const Vec3f> positions, std::span<const Triangle> triangles, const EdgeCollapseOptions& options)
        : ids_(positions.size()), length_weight_(options.length_weight) {
        std::vector<Index> local(positions.size(), kNoIndex);
        for (const Triangle& t : triangles)
            for (Index v : t) local[v] = 0;
        Vec3d centre = Vec3d::Zero();
        for (Index v = 0; v < positions.size(); ++v)
            if (local[v] == 0) {
                local[v] = static_cast<Index>(points_.size());
                points_.push_back(positions[v].cast<double>());
                source_.push_back(v);
                centre += points_.back();
            }
        for (Vec3d& p : points_) p -= centre / double(std::max<std::size_t>(points_.size(), 1));
        for (const Triangle& t : triangles) triangles_.push_back({local[t[0]], local[t[1]], local[t[2]]});
        around_.resize(points_.size());
        for (Index t = 0; t < triangles_.size(); ++t)
            for (Index v : triangles_[t]) around_[v].add(t);
        stamp_.assign(points_.size(), 0);
        stands_out_.assign(points_.size(), kNoIndex);
        was_hub_.assign(points_.size(), false);
        vertex_count_ = points_.size();
        triangle_count_ = triangles_.size();
        quadrics_ = quadrics_of(points_);
        for (const std::vector<Vec3f>& shape : options.other_shapes) {
            OtherShape& other = others_.emplace_back();
            for (const Index v : source_) other.points.push_back(shape[v].cast<double>());
            other.quadrics = quadrics_of(other.points);
        }
        if (options.least_of_part > 0) find_parts(options.least_of_part);
        record_.begin(triangles_, points_.size());
    }

    void run(const EdgeCollapseOptions& options, const RunContext& context) {
        set_least_area(options.target_vertices);
        for (Index v = 0; v < points_.size(); ++v) {
            const std::vector<Index> neighbours = neighbours_of(v);
            for (Index w : neighbours) price(v, w);
        }
        while (vertex_count_ > options.target_vertices && !queue_.empty() && !context.is_cancelled()) {
            Collapse next = queue_.top();
            queue_.pop();
            if (next.stamp != stamp_of(next.from, next.to) && !renew(next)) continue;
            if (shared_triangles(next.from, next.to) == triangle_count_) continue; // something has to be left
            if (!may_lose_vertices(next.from)) continue;
            if (options.max_edge && stretches(next.from, next.to, *options.max_edge)) continue;
            if (!next.forced && !is_clean(next.from, next.to)) {
                queue_.push(forced(next));
                continue;
            }
            if (waits_for_height(next, options.max_error)) continue;
            const double area = quadrics_[next.from].area + quadrics_[next.to].area;
            const double distance = area > 0 ? std::sqrt(next.error / area) : 0;
            if (options.max_error && distance > *options.max_error) break;
            error_ = std::max(error_, distance);
            forced_ += next.forced;
            apply(next.from, next.to);
            record_.add_step(vertex_count_, error_, forced_);
        }
    }

    CollapseOrder order() { return record_.take(source_, ids_); }

    EdgeCollapseResult result() const {
        EdgeCollapseResult result;
        for (const Triangle& t : triangles_)
            if (t[0] != kNoIndex) result.triangles.push_back({source_[t[0]], source_[t[1]], source_[t[2]]});
        result.vertex_count = vertex_count_;
        result.error = error_;
        result.forced = forced_;
        return result;
    }

private:
    static Vec3d normal(const Triangle& t, std::span<const Vec3d> points) { // twice the area long
        return (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
    }
    Vec3d normal(const Triangle& t) const { return normal(t, points_); }

    std::vector<Quadric> quadrics_of(std::span<const Vec3d> points) const {
        std::vector<Quadric> quadrics(points.size());
        std::vector<bool> is_open(3 * triangles_.size(), true); // half-edges of edges that have not two triangles
        for (const std::span<const Index> edge : edges_of(triangles_, points_.size()))
            for (const Index h : edge) is_open[h] = edge.size() != 2;
        for (Index t = 0; t < triangles_.size(); ++t) {
            const Vec3d n = normal(triangles_[t], points);
            const double area = 0.5 * n.norm();
            for (int k = 0; k < 3; ++k) {
                Quadric& quadric = quadrics[triangles_[t][k]];
                if (area > 0) quadric.add_plane(n.normalized(), points[triangles_[t][k]], area / 3);
                quadric.area += area / 3;
            }
        }
        for (Index t = 0; t < triangles_.size(); ++t)
            for (int k = 0; k < 3; ++k) {
                if (!is_open[3 * t + Index(k)]) continue;
                const Index a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
                const Vec3d along = points[b] - points[a];
                const Vec3d side = along.cross(normal(triangles_[t], points));
                if (side.squaredNorm() == 0) continue;
                for (Index v : {a, b})
                    quadrics[v].add_plane(side.normalized(), points[a], kBorderWeight * along.squaredNorm() / 2);
            }
        return quadrics;
    }

    /// Which vertices edges connect, and how many a part may not go below.
    void find_parts(std::size_t least) {
        DisjointSets sets(points_.size());
        for (const Triangle& t : triangles_)
            for (const std::size_t k : {std::size_t{1}, std::size_t{2}}) sets.join(t[0], t[k]);
        part_.resize(points_.size());
        std::vector<Box> boxes(points_.size());
        left_of_part_.assign(points_.size(), 0);
        Box whole;
        for (Index v = 0; v < points_.size(); ++v) {
            part_[v] = sets.root(v);
            boxes[part_[v]].extend(points_[v]);
            whole.extend(points_[v]);
            ++left_of_part_[part_[v]];
        }
        std::vector<Index> large;
        for (Index v = 0; v < points_.size(); ++v)
            if (part_[v] == v && boxes[v].diagonal() >= kLargePart * whole.diagonal()) large.push_back(v);
        least_of_part_.assign(points_.size(), 0);
        if (large.size() < 2) return;
        for (const Index v : large)
            least_of_part_[v] = std::min(least, points_.size() / (kMostKeptByParts * large.size()));
    }
    bool may_lose_vertices(Index v) const {
        return part_.empty() || left_of_part_[part_[v]] > least_of_part_[part_[v]];
    }
    /// A vertex lost its last triangle (-1), or got its first one (1).
    void count_vertex(Index v, int change) {
        vertex_count_ += static_cast<std::size_t>(change);
        if (!part_.empty()) left_of_part_[part_[v]] += static_cast<std::size_t>(change);
    }

    std::vector<Index> neighbours_of(Index v) const {
        std::vector<Index> neighbours;
        for (Index t : around_[v].all)
            for (Index w : triangles_[t])
                if (w != v && is_left(t)) neighbours.push_back(w);
        std::sort(neighbours.begin(), neighbours.end());
        neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
        return neighbours;
    }

    bool is_left(Index triangle) const { return triangles_[triangle][0] != kNoIndex; }
    bool is_hub(Index v) const { return around_[v].left >= kHub; }
    bool is_wide(Index v) const { return around_[v].left >= kWideFan; }
    Index fewer_triangles(Index a, Index b) const { return around_[b].left < around_[a].left ? b : a; }
    Index stamp_of(Index from, Index to) const { return stamp_[from] + stamp_[to]; }

    Collapse priced(Index from, Index to) const {
        double along = (points_[to] - points_[from]).squaredNorm();
        double error = quadrics_[from].at(points_[to]) + quadrics_[to].at(points_[to]);
        for (const auto& [points, quadrics] : others_) {
            along += (points[to] - points[from]).squaredNorm();
            error += quadrics[from].at(points[to]) + quadrics[to].at(points[to]);
        }
        along /= double(1 + others_.size());
        error /= double(1 + others_.size());
        const double area = quadrics_[from].area + quadrics_[to].area;
        const double counted = area > 0 ? error * std::max(1.0, least_area_ / area) : error;
        const double cost = counted + length_weight_ * along * counted_area(from);
        return {cost, error, from, to, stamp_of(from, to), false};
    }
    double counted_area(Index v) const { return std::max(quadrics_[v].area, least_area_); }
    void price(Index from, Index to) { queue_.push(priced(from, to)); }

    /// An entry with an old stamp is void, for whatever changed its ends has priced the edge again; but not all edges
    /// of a hub. Whether such an edge's turn is now; if not, it is priced again and waits.
    bool renew(Collapse& next) {
        if (!was_hub_[next.from] && !was_hub_[next.to]) return false;
        if (shared_triangles(next.from, next.to) == 0) return false;
        Collapse now = priced(next.from, next.to);
        if (next.forced && !is_clean(next.from, next.to)) now = forced(now);
        const bool is_due = now.cost <= kHubSlack * next.cost;
        next = now;
        if (!is_due) queue_.push(now);
        return is_due;
    }

    void set_least_area(std::size_t target) {
        double area = 0;
        for (const Quadric& quadric : quadrics_) area += quadric.area;
        const std::size_t left = std::max({target, points_.size() / kMostTakenDown, std::size_t{3}});
        least_area_ = kLeastArea * area / double(left);
    }

    /// Whether a collapse waits again, as it loses more height than it was priced for, or is dropped, as with a largest
    /// error a point would be left too far off; it comes back when one of its ends is priced again.
    bool waits_for_height(Collapse& collapse, const std::optional<double>& max_error) {
        if (collapse.forced || collapse.has_height || is_wide(collapse.from) || is_wide(collapse.to)) return false;
        const auto [from, to] = std::pair(collapse.from, collapse.to);
        double height = squared_height(from, from, to);
        if (stands_out_[from] != kNoIndex) height = std::max(height, squared_height(stands_out_[from], from, to));
        if (max_error && height > kFarthestPoint * kFarthestPoint * *max_error * *max_error) return true;
        const double loss = kHeightWeight * height * counted_area(from);
        if (loss <= kTellingHeight * collapse.cost) return false;
        collapse.cost += loss;
        collapse.has_height = true;
        queue_.push(collapse);
        return true;
    }

    /// Of a point from the triangles that are at `to` once `from` has gone there. from: kNoIndex when it has.
    double squared_height(Index point, Index from, Index to) const {
        const Vec3f p = points_[point].cast<float>();
        double least = std::numeric_limits<double>::infinity();
        const auto look_at = [&](const Triangle& t) {
            const SurfacePoint closest = closest_point_on_triangle(
                p, points_[t[0]].cast<float>(), points_[t[1]].cast<float>(), points_[t[2]].cast<float>());
            least = std::min(least, closest.distance * closest.distance);
        };
        for (const Index t : around_[to].all)
            if (is_left(t) && (from == kNoIndex || !has(triangles_[t], from))) look_at(triangles_[t]);
        if (from != kNoIndex)
            for (const Index t : around_[from].all) {
                Triangle moved = triangles_[t];
                if (!is_left(t) || has(moved, to)) continue;
                std::ranges::replace(moved, from, to);
                look_at(moved);
            }
        return std::isfinite(least) ? least : 0;
    }

    /// Of what was merged into `to`, now that `from` was too, the point that stands out most.
    void remember_height(Index from, Index to) {
        if (is_wide(to)) return;
        double most = -1;
        Index highest = kNoIndex;
        for (const Index point : {from, stands_out_[from], stands_out_[to]}) {
            if (point == kNoIndex) continue;
            const double height = squared_height(point, kNoIndex, to);
            if (height > most) {
                most = height;
                highest = point;
            }
        }
        stands_out_[to] = highest;
    }

    /// What a collapse that is not clean is taken to lose: everything around `from`, moved by the edge's length.
    Collapse forced(Collapse collapse) const {
        const double loss =
            (points_[collapse.to] - points_[collapse.from]).squaredNorm() * quadrics_[collapse.from].area;
        collapse.cost += loss;
        collapse.error += loss;
        collapse.forced = true;
        return collapse;
    }

    static bool has(const Triangle& t, Index v) { return t[0] == v || t[1] == v || t[2] == v; }

    std::size_t shared_triangles(Index a, Index b) const {
        const Index fewer = fewer_triangles(a, b), other = fewer == a ? b : a;
        const std::vector<Index>& around = around_[fewer].all; // none that is gone has the other
        return static_cast<std::size_t>(
            std::count_if(around.begin(), around.end(), [&](Index t) { return has(triangles_[t], other); }));
    }

    std::size_t common_neighbours(Index a, Index b) const {
        const Index fewer = fewer_triangles(a, b), other = fewer == a ? b : a;
        std::size_t count = 0;
        for (Index w : neighbours_of(fewer)) count += w != other && shared_triangles(w, other) > 0;
        return count;
    }

    /// Whether an edge becomes longer than `limit` and than it was. The collapse is then dropped; it comes back when
    /// one of its ends is priced again.
    bool stretches(Index from, Index to, double limit) const {
        for (const Index t : around_[from].all) {
            if (!is_left(t) || has(triangles_[t], to)) continue;
            for (const Index w : triangles_[t]) {
                const double after = (points_[to] - points_[w]).squaredNorm();
                if (w != from && after > limit * limit && after > (points_[from] - points_[w]).squaredNorm())
                    return true;
            }
        }
        return false;
    }

    /// No triangle turns over, and the two ends have no common neighbour but those of the triangles between them.
    bool is_clean(Index from, Index to) const {
        const std::size_t shared = shared_triangles(from, to);
        if (around_[from].left == shared) return false; // nothing would be left of it
        for (Index t : around_[from].all) {
            Triangle moved = triangles_[t];
            if (!is_left(t) || has(moved, to)) continue;
            const Vec3d before = normal(moved);
            std::replace(moved.begin(), moved.end(), from, to);
            const Vec3d after = normal(moved);
            if (after.dot(before) <= kMinCosine * after.norm() * before.norm()) return false;
        }
        return common_neighbours(from, to) <= shared;
    }

    void remove(Index triangle) {
        const Triangle corners = std::exchange(triangles_[triangle], {kNoIndex, kNoIndex, kNoIndex});
        record_.remove(triangle);
        for (Index v : corners) {
            TriangleList& around = around_[v];
            if (--around.left == 0) count_vertex(v, -1);
            if (around.all.size() > 2 * around.left + kFewTriangles)
                std::erase_if(around.all, [&](Index t) { return !is_left(t); });
        }
        --triangle_count_;
    }

    void apply(Index from, Index to) {
        const std::vector<Index> ring = around_[from].all;
        for (Index t : ring)
            if (has(triangles_[t], to)) remove(t);
        if (around_[from].left > 0) {
            if (around_[to].left == 0) count_vertex(to, 1); // it had lost its last one, and gets new ones
            count_vertex(from, -1);
        }
        record_.merge(from, to);
        std::vector<Index> moved;
        for (Index t : ring)
            if (is_left(t)) moved.push_back(t);
        for (Index t : moved) {
            std::replace(triangles_[t].begin(), triangles_[t].end(), from, to);
            around_[to].add(t);
        }
        around_[from] = {};
        quadrics_[to] += quadrics_[from];
        for (OtherShape& other : others_) other.quadrics[to] += other.quadrics[from];
        remember_height(from, to);
        ++stamp_[from];
        ++stamp_[to];
        const std::vector<Index> changed = is_hub(to) ? other_corners(moved, to) : std::vector<Index>{};
        was_hub_[to] = was_hub_[to] || is_hub(to);
        remove_folded(is_hub(to) ? twins_of(moved, to) : around_[to].all);
        for (Index w : is_hub(to) ? changed : neighbours_of(to)) {
            if (is_hub(to) && shared_triangles(to, w) == 0) continue; // it went with what was folded
            price(to, w);
            price(w, to);
        }
    }

    /// The corners of triangles at v, but for v, ascending.
    std::vector<Index> other_corners(std::span<const Index> triangles, Index v) const {
        std::vector<Index> corners;
        for (Index t : triangles)
            for (Index w : triangles_[t])
                if (w != v) corners.push_back(w);
        std::sort(corners.begin(), corners.end());
        corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
        return corners;
    }

    /// These triangles at v, and all over the same three vertices as one of them.
    std::vector<Index> twins_of(std::span<const Index> triangles, Index v) const {
        std::vector<Index> twins(triangles.begin(), triangles.end());
        for (Index t : triangles) {
            std::array<Index, 2> others;
            std::copy_if(triangles_[t].begin(), triangles_[t].end(), others.begin(), [&](Index w) { return w != v; });
            const Index fewer = fewer_triangles(others[0], others[1]);
            for (Index s : around_[fewer].all)
                if (has(triangles_[s], v) && has(triangles_[s], others[0]) && has(triangles_[s], others[1]))
                    twins.push_back(s);
        }
        std::sort(twins.begin(), twins.end());
        twins.erase(std::unique(twins.begin(), twins.end()), twins.end());
        return twins;
    }

    /// Of the ring's triangles over the same three vertices, one is kept when they face the same way or are all there
    /// is, none when they are back to back.
    void remove_folded(std::vector<Index> ring) {
        const auto key = [&](Index t) {
            std::array<Index, 3> k = triangles_[t];
            std::sort(k.begin(), k.end());
            return k;
        };
        std::erase_if(ring, [&](Index t) { return !is_left(t); });
        std::sort(ring.begin(), ring.end(), [&](Index s, Index t) {
            const auto a = key(s), b = key(t);
            return a != b ? a < b : s < t;
        });
        for (std::size_t i = 0; i + 1 < ring.size();) {
            if (key(ring[i]) != key(ring[i + 1])) {
                ++i;
                continue;
            }
            const bool back_to_back =
                triangle_count_ > 2 && normal(triangles_[ring[i]]).dot(normal(triangles_[ring[i + 1]])) < 0;
            remove(ring[i + 1]);
            if (back_to_back) remove(ring[i]);
            ring.erase(ring.begin() + std::ptrdiff_t(i + 1));
            if (back_to_back) ring.erase(ring.begin() + std::ptrdiff_t(i));
        }
    }

    std::size_t ids_; ///< number of the caller's vertices
    double length_weight_;
    std::vector<Vec3d> points_;
    std::vector<Index> source_; ///< the caller's vertex of each
    std::vector<OtherShape> others_;
    std::vector<Index> part_;                               ///< of each vertex; empty: parts do not matter
    std::vector<std::size_t> left_of_part_, least_of_part_; ///< by the part's number
    CollapseRecorder record_;
    std::vector<Triangle> triangles_; ///< removed: kNoIndex
    std::vector<TriangleList> around_;
    std::vector<Quadric> quadrics_;
    double least_area_ = 0;
    std::vector<Index> stands_out_; ///< of what was merged into each vertex, the point that stands out most
    std::vector<Index> stamp_;
    std::vector<bool> was_hub_; ///< whether a collapse into it left edges that are not priced again
    std::priority_queue<Collapse, std::vector<Collapse>, std::greater<>> queue_;
    std::size_t vertex_count_ = 0, triangle_count_ = 0, forced_ = 0;
    double error_ = 0;
};

} // namespace

Index CollapseOrder::resolve(Index vertex, Index step) const {
    while (merged_into_[vertex] != kNoIndex && merged_at_[vertex] <= step) vertex = merged_into_[vertex];
    return vertex;
}

EdgeCollapseResult CollapseOrder::at(std::size_t target_vertices) const {
    Index step = 0;
    while (step + 1 < counts_.size() && counts_[step] > target_vertices) ++step;
    EdgeCollapseResult result;
    for (std::size_t t = 0; t < triangles_.size(); ++t)
        if (gone_at_[t] > step)
            result.triangles.push_back(
                {resolve(triangles_[t][0], step), resolve(triangles_[t][1], step), resolve(triangles_[t][2], step)});
    result.vertex_count = counts_[step];
    result.error = errors_[step];
    result.forced = forced_[step];
    return result;
}

EdgeCollapseResult collapse_edges(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                  const EdgeCollapseOptions& options, const RunContext& context) {
    Collapser collapser(positions, triangles, options);
    collapser.run(options, context);
    return collapser.result();
}

CollapseOrder order_collapses(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                              const EdgeCollapseOptions& options, const RunContext& context) {
    Collapser collapser(positions, triangles, options);
    collapser.run(options, context);
    return collapser.order();
}

} // namespace filigree
