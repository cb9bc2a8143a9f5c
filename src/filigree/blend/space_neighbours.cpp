#include "filigree/blend/space_neighbours.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh/morton.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <memory>
#include <nanoflann.hpp>

namespace filigree {

namespace {

constexpr std::size_t kNear = 24, kFar = 8; // neighbours among all vertices, and among some
constexpr std::size_t kThinning = 8;        // one in so many vertices is in the sparse tree
constexpr std::size_t kTried = 3;           // candidates for each neighbour wanted
constexpr float kAcross = 0.2f;             // cosine from which a vertex is in front of the surface
constexpr std::size_t kSmallestPart = 32;   // places; smaller parts see all others

/// Some of a mesh's vertices, as nanoflann sees them.
class PointTree {
public:
    PointTree(std::span<const Vec3f> positions, std::vector<Index> vertices)
        : positions_(positions), vertices_(std::move(vertices)), tree_(3, *this, {10}) {}
    PointTree(const PointTree&) = delete;

    /// The `count` vertices nearest to a point, ascending in distance, of equally far ones the lowest first.
    void nearest(const Vec3f& point, std::size_t count, std::vector<std::pair<double, Index>>& found) const {
        std::vector<Index> slots(std::min(count, vertices_.size()));
        std::vector<double> distances(slots.size());
        const std::size_t got = tree_.knnSearch(point.data(), slots.size(), slots.data(), distances.data());
        found.clear();
        for (std::size_t k = 0; k < got; ++k) found.emplace_back(distances[k], vertices_[slots[k]]);
        std::sort(found.begin(), found.end());
    }

    std::size_t kdtree_get_point_count() const { return vertices_.size(); }
    double kdtree_get_pt(std::size_t slot, std::size_t axis) const {
        return double(positions_[vertices_[slot]][static_cast<Eigen::Index>(axis)]);
    }
    template <class Bounds>
    bool kdtree_get_bbox(Bounds&) const {
        return false;
    }

private:
    using Metric = nanoflann::L2_Simple_Adaptor<float, PointTree, double>;
    std::span<const Vec3f> positions_;
    std::vector<Index> vertices_;
    nanoflann::KDTreeSingleIndexAdaptor<Metric, PointTree, 3, Index> tree_;
};

/// One in kThinning of the vertices, spread evenly: every so many along a Morton curve.
std::vector<Index> thinned(std::span<const Vec3f> positions, std::span<const Index> vertices) {
    Box box;
    for (Index v : vertices) box.extend(positions[v].cast<double>());
    const double side = std::max(box.size().maxCoeff(), std::numeric_limits<double>::min());
    std::vector<std::pair<std::uint64_t, Index>> curve;
    for (Index v : vertices) {
        const Vec3d q = (positions[v].cast<double>() - box.min) / side * double((1 << 21) - 1);
        curve.emplace_back(morton_key(std::uint64_t(q.x()), std::uint64_t(q.y()), std::uint64_t(q.z())), v);
    }
    std::sort(curve.begin(), curve.end());
    std::vector<Index> some;
    for (std::size_t k = kThinning / 2; k < curve.size(); k += kThinning) some.push_back(curve[k].second);
    return some;
}

/// A connected part's vertices, all of them and some.
struct Part {
    PointTree all, some;
    Part(std::span<const Vec3f> positions, const std::vector<Index>& vertices)
        : all(positions, vertices), some(positions, thinned(positions, vertices)) {}
};

class Search {
public:
    Search(const Mesh& mesh, std::span<const Vec3f> normals)
        : mesh_(mesh), normals_(normals), place_(weld_map(mesh.positions)) {
        link_places();
        split_into_parts();
    }

    /// What a thread needs for itself.
    struct Scratch {
        std::vector<std::pair<double, Index>> candidates;
        std::vector<Index> to_visit;
        std::vector<std::size_t> mark; ///< of each vertex: twice the round it was a candidate in, and one if reached
        std::size_t round = 0;
    };

    void find(Index vertex, std::vector<Index>& found, Scratch& scratch) const {
        found.clear();
        const Index own = place_[vertex];
        const Part& part = *parts_[part_of_[own]];
        part.all.nearest(mesh_.positions[own], kTried * kNear, scratch.candidates);
        reach(own, scratch);
        const auto is_reached = [&](Index v) { return scratch.mark[v] == 2 * scratch.round + 1; };
        for (const auto& [distance, v] : scratch.candidates) {
            if (found.size() == kNear) break;
            if (v != own && (is_reached(v) || has_matter_between(own, v))) found.push_back(v);
        }
        const std::size_t near_count = found.size();
        part.some.nearest(mesh_.positions[own], kTried * kFar + kNear, scratch.candidates);
        for (const auto& [distance, v] : scratch.candidates) {
            if (found.size() == near_count + kFar) break;
            const auto near_end = found.begin() + static_cast<std::ptrdiff_t>(near_count);
            if (v != own && std::find(found.begin(), near_end, v) == near_end &&
                (is_reached(v) || has_matter_between(own, v)))
                found.push_back(v);
        }
    }

    std::size_t vertex_count() const { return place_.size(); }

private:
    void link_places() {
        std::vector<std::pair<Index, Index>> edges;
        for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
            const std::span<const Index> face = mesh_.face(f);
            for (std::size_t k = 0; k < face.size(); ++k) {
                const Index a = place_[face[k]], b = place_[face[(k + 1) % face.size()]];
                if (a != b) edges.emplace_back(a, b), edges.emplace_back(b, a);
            }
        }
        std::sort(edges.begin(), edges.end());
        edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
        links_ = make_lists<Index>(vertex_count(), [&](const auto& add) {
            for (const auto& [from, to] : edges) add(from, to);
        });
    }

    void split_into_parts() {
        DisjointSets sets(vertex_count());
        for (Index v = 0; v < vertex_count(); ++v)
            for (Index w : links_[v]) sets.join(v, w);
        std::vector<std::vector<Index>> members(vertex_count());
        std::vector<Index> everything;
        for (Index v = 0; v < vertex_count(); ++v) {
            if (place_[v] != v) continue;
            members[sets.root(v)].push_back(v);
            everything.push_back(v);
        }
        part_of_.assign(vertex_count(), 0);
        parts_.push_back(std::make_unique<Part>(mesh_.positions, everything));
        for (const std::vector<Index>& part : members) {
            if (part.size() < kSmallestPart || part.size() == everything.size()) continue;
            for (Index v : part) part_of_[v] = static_cast<Index>(parts_.size());
            parts_.push_back(std::make_unique<Part>(mesh_.positions, part));
        }
    }

    /// Marks the candidates that edges between candidates connect with `own`.
    void reach(Index own, Scratch& scratch) const {
        scratch.mark.resize(vertex_count(), 0);
        ++scratch.round;
        for (const auto& [distance, v] : scratch.candidates) scratch.mark[v] = 2 * scratch.round;
        scratch.mark[own] = 2 * scratch.round + 1;
        scratch.to_visit = {own};
        while (!scratch.to_visit.empty()) {
            const Index v = scratch.to_visit.back();
            scratch.to_visit.pop_back();
            for (Index w : links_[v])
                if (scratch.mark[w] == 2 * scratch.round) {
                    ++scratch.mark[w];
                    scratch.to_visit.push_back(w);
                }
        }
    }

    /// Not so where one lies in front of the other's surface. Vertices without a face have no front.
    bool has_matter_between(Index a, Index b) const {
        const Vec3f way = mesh_.positions[b] - mesh_.positions[a];
        const float across = kAcross * way.norm();
        return normals_[a].dot(way) <= across && normals_[b].dot(way) >= -across;
    }

    const Mesh& mesh_;
    std::span<const Vec3f> normals_;
    std::vector<Index> place_; ///< of each vertex: the lowest vertex there
    IndexLists links_;         ///< the edges at each place
    std::vector<Index> part_of_;
    std::vector<std::unique_ptr<Part>> parts_; ///< the first holds everything
};

} // namespace

IndexLists space_neighbours(const Mesh& mesh, std::span<const Vec3f> normals, const RunContext& context) {
    const Search search(mesh, normals);
    std::vector<std::vector<Index>> lists(search.vertex_count());
    const std::size_t grain = std::max<std::size_t>(256, lists.size() / 64); // each piece marks all vertices once
    parallel_for(context, lists.size(), grain, [&](std::size_t begin, std::size_t end) {
        Search::Scratch scratch;
        for (std::size_t v = begin; v < end; ++v) search.find(static_cast<Index>(v), lists[v], scratch);
    });
    IndexLists result;
    for (const std::vector<Index>& list : lists) {
        result.items.insert(result.items.end(), list.begin(), list.end());
        result.offsets.push_back(static_cast<Index>(result.items.size()));
    }
    return result;
}

} // namespace filigree
