#include "filigree/levels/loose_parts.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/edges.h"

#include <algorithm>
#include <optional>
#include <unordered_map>

namespace filigree {

namespace {

/// How far from the place where it hangs a part stays together, in mean edges of the driver. A rivet or a blade of
/// grass follows one neighbourhood as a whole; the far end of a hose follows what it passes there.
constexpr float kTogether = 1;

/// The loose vertices, numbered, and the edges between them.
class LooseVertices {
public:
    LooseVertices(const Surface& surface, std::span<const Index> source) {
        for (Index v = 0; v < source.size(); ++v)
            if (source[v] == kNoIndex && surface.representative[v] == v) {
                local_.emplace(v, Index(vertices_.size()));
                vertices_.push_back(v);
            }
        for (const Triangle& t : surface.triangles) {
            if (source[t[0]] != kNoIndex || source[t[1]] != kNoIndex || source[t[2]] != kNoIndex) continue;
            triangles_.push_back({local_.at(t[0]), local_.at(t[1]), local_.at(t[2])});
        }
        around_ = triangles_at_vertices(triangles_, vertices_.size());
    }

    std::size_t size() const { return vertices_.size(); }
    Index operator[](Index local) const { return vertices_[local]; }

    /// Calls visit(vertex, neighbour) for the vertices of the part of `first`, breadth first, which must be new: each
    /// with a neighbour that came before it. is_seen: of all loose vertices.
    template <class Visit>
    void spread_from(Index first, std::vector<bool>& is_seen, const Visit& visit) const {
        std::vector<Index> order = {first};
        is_seen[first] = true;
        for (std::size_t at = 0; at < order.size(); ++at)
            for (const Index t : around_[order[at]])
                for (const Index next : triangles_[t]) {
                    if (is_seen[next]) continue;
                    is_seen[next] = true;
                    visit(next, order[at]);
                    order.push_back(next);
                }
    }

private:
    std::vector<Index> vertices_; ///< ascending
    std::unordered_map<Index, Index> local_;
    std::vector<Triangle> triangles_; ///< over local numbers
    IndexLists around_;
};

/// Driver vertices that share a cell.
class DriverGraph {
public:
    DriverGraph(std::span<const Vec3f> positions, std::span<const Triangle> cells) : positions_(positions) {
        for (const Triangle& cell : cells)
            for (const Index v : cell)
                for (const Index w : cell)
                    if (w != v) neighbours_[v].push_back(w);
    }

    /// From `start` to a neighbour that is closer to `point`, as long as there is one.
    Index descend(Index start, const Vec3f& point) const {
        Index at = start;
        float best = (positions_[at] - point).squaredNorm();
        for (bool has_moved = true; has_moved;) {
            has_moved = false;
            const auto found = neighbours_.find(at);
            if (found == neighbours_.end()) break;
            for (const Index next : found->second) {
                const float distance = (positions_[next] - point).squaredNorm();
                if (!(distance < best)) continue;
                best = distance;
                at = next;
                has_moved = true;
            }
        }
        return at;
    }

private:
    std::span<const Vec3f> positions_;
    std::unordered_map<Index, std::vector<Index>> neighbours_;
};

/// Mean length of the edges of cells.
float mean_edge(std::span<const Vec3f> positions, std::span<const Triangle> cells) {
    double sum = 0;
    for (const Triangle& t : cells)
        for (std::size_t k = 0; k < 3; ++k) sum += double((positions[t[(k + 1) % 3]] - positions[t[k]]).norm());
    return float(sum / double(3 * std::max<std::size_t>(cells.size(), 1)));
}

/// The closest of some triangles, as the corner of it that is nearest to the closest point.
class ClosestCorner {
public:
    ClosestCorner(std::span<const Vec3f> positions, std::span<const Triangle> triangles, const RunContext& context)
        : triangles_(triangles), tree_(positions, triangles, context) {}
    struct Found {
        double distance = std::numeric_limits<double>::infinity();
        Index vertex = kNoIndex;
    };
    Found find(const Vec3f& point) const {
        const SurfacePoint closest = tree_.closest(point);
        if (closest.triangle == kNoIndex) return {};
        Eigen::Index corner = 0;
        closest.barycentric.maxCoeff(&corner);
        return {closest.distance, triangles_[closest.triangle][std::size_t(corner)]};
    }

private:
    std::span<const Triangle> triangles_;
    ClosestPointTree tree_;
};

std::vector<ClosestCorner::Found> nearest_beside(std::span<const Vec3f> positions, const LooseVertices& loose,
                                                 std::span<const Triangle> beside, const RunContext& context) {
    const ClosestCorner closest(positions, beside, context);
    std::vector<ClosestCorner::Found> nearest(loose.size());
    parallel_for(context, loose.size(), 1 << 10, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end && !context.is_cancelled(); ++i)
            nearest[i] = closest.find(positions[loose[Index(i)]]);
    });
    return nearest;
}

/// The vertices of each part of which none has been seen, the one closest to the rest of the mesh first.
std::vector<Index> closest_of_parts(const LooseVertices& loose, std::span<const ClosestCorner::Found> nearest) {
    std::vector<Index> firsts;
    std::vector<bool> is_seen(loose.size(), false);
    for (Index i = 0; i < loose.size(); ++i) {
        if (is_seen[i]) continue;
        Index closest = i;
        loose.spread_from(i, is_seen, [&](Index next, Index) {
            if (nearest[next].distance < nearest[closest].distance) closest = next;
        });
        firsts.push_back(closest);
    }
    return firsts;
}

} // namespace

NearestDriver hang_loose_parts(std::span<const Vec3f> positions, const Surface& surface,
                               std::span<const Triangle> beside, std::span<const Triangle> cells,
                               std::vector<Index> source, const RunContext& context) {
    NearestDriver result{.vertex = std::move(source), .is_loose = {}};
    std::vector<Index>& driver = result.vertex;
    const LooseVertices loose(surface, driver);
    if (loose.size() == 0) return result;
    result.is_loose.assign(driver.size(), 0);
    for (Index i = 0; i < loose.size(); ++i) result.is_loose[loose[i]] = 1;

    std::vector<Triangle> bound;
    for (const Triangle& t : beside)
        if (std::ranges::none_of(t, [&](Index v) { return driver[v] == kNoIndex; })) bound.push_back(t);
    if (bound.empty()) return result;
    const std::vector<ClosestCorner::Found> nearest = nearest_beside(positions, loose, bound, context);
    if (context.is_cancelled()) return result;
    const DriverGraph graph(positions, cells);
    const ClosestCorner over_cells(positions, cells, context);
    const float reach = kTogether * mean_edge(positions, cells);
    std::vector<bool> is_seen(loose.size(), false);
    for (const Index first : closest_of_parts(loose, nearest)) {
        if (nearest[first].vertex == kNoIndex) continue;
        driver[loose[first]] = graph.descend(driver[nearest[first].vertex], positions[loose[first]]);
        const Vec3f& anchor = positions[loose[first]];
        loose.spread_from(first, is_seen, [&](Index next, Index before) {
            const Vec3f& point = positions[loose[next]];
            const bool is_near = (point - anchor).squaredNorm() <= reach * reach;
            driver[loose[next]] = is_near ? graph.descend(driver[loose[before]], point) : over_cells.find(point).vertex;
        });
    }
    return result;
}

} // namespace filigree
