#include "filigree/hierarchy/cluster_simplify.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/hash.h"
#include "filigree/core/parallel_for.h"
#include "filigree/hierarchy/nearest_sources.h"
#include "filigree/hierarchy/roughen.h"
#include "filigree/mesh/morton.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include <meshoptimizer.h>

namespace filigree {

namespace {

constexpr std::size_t kClusterTriangles = std::size_t{1} << 17; // about; half as many double the borders
constexpr std::size_t kMostClusterTriangles = 8 * kClusterTriangles;
constexpr std::size_t kStripe = std::size_t{1} << 20;  // triangles that are sorted at a time
constexpr std::size_t kCounted = std::size_t{1} << 20; // triangles for which a count of all places, 8 MiB, is worth it
constexpr std::size_t kLargestFan = 4096;              // triangles at a vertex; more take meshoptimizer quadratic time
constexpr std::uint32_t kLatticeBits = 7, kLattice = 1u << kLatticeBits; // places an axis that are counted
constexpr std::uint8_t kMany = 255;                                      // triangles at a vertex, or more

/// Cuts a mesh into clusters of triangles that are near each other.
class Partition {
public:
    Partition(std::span<const Vec3f> positions, std::span<const Triangle> triangles, unsigned round)
        : positions_(positions), triangles_(triangles), order_(bounds(positions)) {
        // Parts of the lattice far from halves and from each other, so that no border comes back soon.
        constexpr std::array kShift = {0u, 45u, 97u, 21u, 71u, 117u, 33u};
        for (std::uint32_t axis = 0; axis < 3; ++axis) {
            const std::uint32_t shift = kShift[(round + 2 * axis * (round > 0)) % kShift.size()];
            for (std::uint32_t k = 0; k < kLattice; ++k)
                spread_[axis][k] = static_cast<std::uint32_t>(spread_bits((k + shift) % kLattice) << axis);
        }
    }

    /// The triangles of each cluster, ascending. Cost O(F).
    struct Clusters {
        std::vector<std::size_t> begins; ///< of the clusters in `triangles`, and the end
        std::vector<Index> triangles;
        std::size_t size() const { return begins.size() - 1; }
        std::span<const Index> operator[](std::size_t c) const {
            return std::span(triangles).subspan(begins[c], begins[c + 1] - begins[c]);
        }
    };
    Clusters clusters(const RunContext& context) const {
        const std::size_t count = triangles_.size(), stripes = (count + kStripe - 1) / kStripe;
        std::vector<Index> cluster_of = cluster_of_place(context);
        const std::size_t clusters = cluster_of.empty() ? 0 : 1 + *std::ranges::max_element(cluster_of);
        std::vector<std::size_t> next(stripes * clusters, 0); // of each stripe and cluster: how many, then where
        parallel_for(context, stripes, 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s)
                for (std::size_t t = s * kStripe; t < std::min(count, (s + 1) * kStripe); ++t)
                    ++next[s * clusters + cluster_of[place_of(t)]];
        });
        Clusters result;
        std::size_t at = 0;
        for (std::size_t c = 0; c < clusters; ++c) {
            result.begins.push_back(at);
            for (std::size_t s = 0; s < stripes; ++s) at += std::exchange(next[s * clusters + c], at);
        }
        result.begins.push_back(at);
        result.triangles.resize(count);
        parallel_for(context, stripes, 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s)
                for (std::size_t t = s * kStripe; t < std::min(count, (s + 1) * kStripe); ++t)
                    result.triangles[next[s * clusters + cluster_of[place_of(t)]]++] = static_cast<Index>(t);
        });
        return result;
    }

private:
    std::uint32_t place_of(std::size_t triangle) const {
        const Triangle& t = triangles_[triangle];
        const Vec3f centre = (positions_[t[0]] + positions_[t[1]] + positions_[t[2]]) / 3;
        const auto [x, y, z] = order_.steps(centre);
        constexpr std::uint32_t kFiner = MortonOrder::kBits - kLatticeBits;
        return spread_[0][x >> kFiner] | spread_[1][y >> kFiner] | spread_[2][z >> kFiner];
    }

    /// Runs of places that hold about kClusterTriangles together.
    std::vector<Index> cluster_of_place(const RunContext& context) const {
        const std::size_t parts = std::clamp<std::size_t>(triangles_.size() / kCounted, 1, 16); // counted, then added
        std::vector<std::vector<Index>> counts(parts);
        const std::size_t part = (triangles_.size() + parts - 1) / parts;
        parallel_for(context, parts, 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t p = begin; p < end; ++p) {
                counts[p].assign(std::size_t{1} << (3 * kLatticeBits), 0);
                for (std::size_t t = p * part; t < std::min(triangles_.size(), (p + 1) * part); ++t)
                    ++counts[p][place_of(t)];
            }
        });
        std::vector<Index> cluster(counts[0].size());
        std::size_t before = 0;
        for (std::size_t place = 0; place < cluster.size(); ++place) {
            std::size_t here = 0;
            for (const std::vector<Index>& count : counts) here += count[place];
            cluster[place] = static_cast<Index>((before + here / 2) / kClusterTriangles);
            before += here;
        }
        return cluster;
    }

    std::span<const Vec3f> positions_;
    std::span<const Triangle> triangles_;
    MortonOrder order_;
    std::array<std::array<std::uint32_t, kLattice>, 3> spread_{};
};

/// Numbers of a cluster's own for the vertices of its triangles, in the order in which they come.
class LocalVertices {
public:
    explicit LocalVertices(std::size_t triangles) {
        std::size_t size = 64;
        while (size < 4 * triangles) size *= 2;
        table_.assign(size, kNoIndex);
    }
    Index local(Index vertex) {
        std::size_t slot = hash_words(vertex) & (table_.size() - 1);
        for (;; slot = (slot + 1) & (table_.size() - 1)) {
            if (table_[slot] == kNoIndex) {
                table_[slot] = static_cast<Index>(global.size());
                global.push_back(vertex);
                return table_[slot];
            }
            if (global[table_[slot]] == vertex) return table_[slot];
        }
    }
    std::vector<Index> global;

private:
    std::vector<Index> table_; ///< of local numbers
};

/// How many of the cluster's triangles are at each of its vertices.
std::vector<Index> triangles_here(const ClusterMesh& mesh) {
    std::vector<Index> here(mesh.vertices.size(), 0);
    for (const Triangle& t : mesh.triangles)
        for (const Index v : t) ++here[v];
    return here;
}

/// Marks vertices that triangles elsewhere use too, and those of small parts.
void find_locked(ClusterMesh& mesh, std::span<const std::uint8_t> triangle_counts) {
    const std::size_t count = mesh.vertices.size();
    const std::vector<Index> here = triangles_here(mesh);
    DisjointSets parts(count);
    for (const Triangle& t : mesh.triangles) {
        parts.join(t[0], t[1]);
        parts.join(t[1], t[2]);
    }
    mesh.locked.assign(count, 0);
    std::vector<Index> part_sizes(count, 0);
    std::vector<std::uint8_t> goes_on(count, 0); // elsewhere
    for (Index v = 0; v < count; ++v) {
        const std::uint8_t everywhere = triangle_counts[mesh.vertices[v]];
        mesh.locked[v] = everywhere == kMany || here[v] < everywhere;
        const Index part = parts.root(v);
        ++part_sizes[part];
        goes_on[part] |= mesh.locked[v];
    }
    for (Index v = 0; v < count; ++v) {
        const Index part = parts.root(v);
        if (!goes_on[part] && part_sizes[part] < ClusterSimplifier::kSmallPart) mesh.locked[v] = 1;
    }
}

/// Takes a cluster down.
class Reduction {
public:
    explicit Reduction(const ClusterMesh& mesh) : mesh_(mesh), free_count_(mesh.free_count()) {
        for (const Index triangles : triangles_here(mesh))
            largest_fan_ = std::max<std::size_t>(largest_fan_, triangles);
    }

    ReducedCluster reduce(double share, double max_error) {
        ReducedCluster result;
        result.triangles = mesh_.triangles;
        if (largest_fan_ <= kLargestFan && free_count_ > 0) collapse(share, max_error, result.error, result.triangles);
        find_followed(result);
        for (Triangle& t : result.triangles)
            for (Index& v : t) v = mesh_.vertices[v];
        return result;
    }

private:
    /// What meshoptimizer sees. Version 0.18 locks a vertex of which there are three at one place; those it is given
    /// twice more are in no triangle.
    std::vector<Vec3f> rough_places(std::span<const Triangle> triangles) const {
        std::vector<Vec3f> places = roughened(mesh_.positions, triangles, mesh_.vertices, mesh_.locked);
        for (Index v = 0; v < mesh_.vertices.size(); ++v)
            if (mesh_.locked[v]) places.insert(places.end(), 2, mesh_.positions[v]);
        return places;
    }

    void collapse(double share, double max_error, double& error, std::vector<Triangle>& left) {
        const std::size_t count = mesh_.vertices.size();
        const double wanted = share * double(free_count_) + double(locked_count());
        std::size_t now = count;
        std::vector<Triangle> out(left.size());
        constexpr double kNear = 1.02;
        for (int call = 0; call < 4 && double(now) > kNear * wanted; ++call) {
            const std::vector<Vec3f> places = rough_places(left);
            const double longest = bounds(places).size().maxCoeff();
            if (!(longest > 0)) return;
            const auto limit = static_cast<float>(std::min(max_error / longest, 1e6));
            float relative = 0;
            const std::size_t target = triangles_of(left.size(), now, wanted);
            const std::size_t indices =
                meshopt_simplify(out.data()->data(), left.data()->data(), left.size() * 3, places.data()->data(),
                                 places.size(), sizeof(Vec3f), target * 3, limit, 0, &relative);
            if (indices / 3 == left.size()) break;
            left.assign(out.begin(), out.begin() + std::ptrdiff_t(indices / 3));
            error = std::max(error, double(relative) * longest);
            now = used(left);
        }
    }

    /// How many triangles belong to so many vertices, as of a disk: two a vertex, one less for each on its border. Of
    /// those the locked ones stay.
    std::size_t triangles_of(std::size_t triangles, std::size_t vertices, double wanted) const {
        const double share = wanted / double(vertices), locked = double(locked_count());
        const double open = std::max(0.0, 2 * double(vertices) - double(triangles) - locked); // the mesh's own border
        const double by_share = share * double(triangles);
        return static_cast<std::size_t>(std::clamp(2 * wanted - share * open - locked, 0.5 * by_share, by_share));
    }

    std::size_t used(std::span<const Triangle> left) {
        is_used_.assign(mesh_.vertices.size(), false);
        std::size_t count = 0;
        for (const Triangle& t : left)
            for (const Index v : t) {
                count += !is_used_[v];
                is_used_[v] = true;
            }
        return count;
    }

    void find_followed(ReducedCluster& result) {
        if (used(result.triangles) == mesh_.vertices.size()) return;
        const std::size_t count = mesh_.vertices.size();
        const std::vector<Index> nearest =
            nearest_sources(mesh_.positions, mesh_.triangles, triangles_at_vertices(mesh_.triangles, count), is_used_);
        for (Index v = 0; v < count; ++v) {
            if (is_used_[v]) continue;
            if (!mesh_.locked[v] && nearest[v] != kNoIndex)
                result.followed.push_back({mesh_.vertices[v], mesh_.vertices[nearest[v]]});
            else
                result.dropped.push_back(mesh_.vertices[v]);
        }
    }

    std::size_t locked_count() const { return mesh_.vertices.size() - free_count_; }

    const ClusterMesh& mesh_;
    std::vector<bool> is_used_;
    std::size_t free_count_ = 0, largest_fan_ = 0;
};

} // namespace

std::size_t ClusterMesh::free_count() const { return std::size_t(std::ranges::count(locked, 0)); }

ReducedCluster reduce_cluster(const ClusterMesh& cluster, double share, double max_error) {
    return Reduction(cluster).reduce(share, max_error);
}

struct ClusterRound::Content {
    std::span<const Vec3f> positions;
    std::span<const Triangle> triangles;
    std::vector<std::uint8_t> triangle_counts;
    Partition::Clusters clusters;
};

ClusterRound::ClusterRound(std::span<const Vec3f> positions, std::span<const Triangle> triangles, unsigned round,
                           const RunContext& context)
    : content_(std::make_unique<Content>(Content{positions, triangles, count_triangles(triangles, positions.size()),
                                                 Partition(positions, triangles, round).clusters(context)})) {}
ClusterRound::~ClusterRound() = default;

std::size_t ClusterRound::size() const { return content_->clusters.size(); }

std::span<const std::uint8_t> ClusterRound::triangle_counts() const { return content_->triangle_counts; }

ClusterMesh ClusterRound::cluster(std::size_t number) const {
    const std::span<const Index> own = content_->clusters[number];
    ClusterMesh mesh;
    LocalVertices local(own.size());
    mesh.triangles.reserve(own.size());
    for (const Index t : own) {
        Triangle& triangle = mesh.triangles.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) triangle[k] = local.local(content_->triangles[t][k]);
    }
    mesh.vertices = std::move(local.global);
    mesh.positions.reserve(mesh.vertices.size());
    for (const Index v : mesh.vertices) mesh.positions.push_back(content_->positions[v]);
    find_locked(mesh, content_->triangle_counts);
    return mesh;
}

std::optional<double> ClusterRound::share_left(std::size_t free_vertices, std::size_t target) const {
    for (std::size_t c = 0; c < size(); ++c)
        if (content_->clusters[c].size() > kMostClusterTriangles) return std::nullopt;
    // How many vertices stay whatever is done; one in several clusters counts once.
    const std::size_t locked = used_vertices(content_->triangle_counts) - free_vertices;
    if (2 * locked > target || free_vertices == 0) return std::nullopt;
    return double(target - locked) / double(free_vertices);
}

std::vector<std::uint8_t> count_triangles(std::span<const Triangle> triangles, std::size_t vertices) {
    std::vector<std::uint8_t> counts(vertices, 0);
    for (const Triangle& t : triangles)
        for (const Index v : t) counts[v] = std::uint8_t(counts[v] + (counts[v] < kMany));
    return counts;
}

std::size_t used_vertices(std::span<const std::uint8_t> triangle_counts) {
    return triangle_counts.size() - std::size_t(std::ranges::count(triangle_counts, 0));
}

void follow_neighbours(std::span<const Vec3f> positions, std::span<const Triangle> before,
                       std::span<const std::uint8_t> counts_left, std::vector<Index>& nearest_left) {
    const auto is_lost = [&](Index v) { return counts_left[v] == 0 && nearest_left[v] == kNoIndex; };
    std::vector<std::pair<Index, Index>> found; // lost, and where to: of all neighbours the nearest
    for (const Triangle& t : before)
        for (const Index v : t)
            if (is_lost(v))
                for (const Index w : t) {
                    const Index to = counts_left[w] > 0 ? w : nearest_left[w];
                    if (w != v && to != kNoIndex) found.emplace_back(v, to);
                }
    std::ranges::sort(found, [&](const auto& a, const auto& b) {
        if (a.first != b.first) return a.first < b.first;
        const float to_a = (positions[a.second] - positions[a.first]).squaredNorm();
        const float to_b = (positions[b.second] - positions[b.first]).squaredNorm();
        return to_a != to_b ? to_a < to_b : a.second < b.second;
    });
    for (std::size_t i = found.size(); i-- > 0;) nearest_left[found[i].first] = found[i].second;
}

std::optional<Simplified> ClusterSimplifier::simplify(std::span<const Triangle> triangles, std::size_t target,
                                                      double max_error, const RunContext& context) {
    if (removed_.empty()) {
        removed_.nearest_left.assign(positions_.size(), kNoIndex);
        removed_.removed.assign(positions_.size(), 0);
    }
    const ClusterRound clusters(positions_, triangles, round_, context);
    std::vector<std::size_t> free(clusters.size());
    parallel_for(context, clusters.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end && !context.is_cancelled(); ++c) free[c] = clusters.cluster(c).free_count();
    });
    const std::optional<double> share =
        clusters.share_left(std::accumulate(free.begin(), free.end(), std::size_t{0}), target);
    if (!share) return std::nullopt;

    std::vector<ReducedCluster> left(clusters.size());
    parallel_for(context, clusters.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end && !context.is_cancelled(); ++c) {
            left[c] = reduce_cluster(clusters.cluster(c), *share, max_error);
            for (const auto& [vertex, to] : std::exchange(left[c].followed, {})) removed_.nearest_left[vertex] = to;
        }
    });
    if (context.is_cancelled()) return std::nullopt;

    Simplified result;
    std::size_t total = 0;
    for (const ReducedCluster& part : left) {
        total += part.triangles.size();
        result.error = std::max(result.error, part.error);
    }
    result.triangles.reserve(total);
    for (ReducedCluster& part : left) {
        result.triangles.insert(result.triangles.end(), part.triangles.begin(), part.triangles.end());
        part.triangles = std::vector<Triangle>(); // {} would keep the memory
    }
    const std::span<const std::uint8_t> counts = clusters.triangle_counts();
    const std::vector<std::uint8_t> counts_left = count_triangles(result.triangles, positions_.size());
    result.vertex_count = used_vertices(counts_left);
    const bool has_lost = std::ranges::any_of(left, [&](const ReducedCluster& part) {
        return std::ranges::any_of(part.dropped, [&](Index v) { return counts_left[v] == 0; });
    });
    if (has_lost) follow_neighbours(positions_, triangles, counts_left, removed_.nearest_left);
    removed_.rounds = ++round_;
    for (std::size_t v = 0; v < counts.size(); ++v)
        if (counts[v] > 0 && counts_left[v] == 0) removed_.removed[v] = round_;
    return result;
}

} // namespace filigree
