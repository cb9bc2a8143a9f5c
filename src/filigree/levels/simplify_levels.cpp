#include "filigree/levels/simplify_levels.h"

#include "filigree/core/parallel_for.h"
#include "filigree/levels/nearest_sources.h"
#include "filigree/levels/simplify.h"
#include "filigree/mesh/morton.h"
#include "filigree/mesh/normals.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <unordered_map>

namespace filigree {

namespace {

constexpr double kFarthest = 1e15; // what no face uses may lie further off; its square has to be a float
constexpr double kLevelFactor = 4; // vertices of a level as a multiple of the next coarser one's, as in subdivision

std::size_t default_base(std::size_t vertices) {
    if (vertices >= 20'000) return 1'000;
    return std::min(vertices, std::max<std::size_t>(50, vertices / 20));
}

/// A driver for a mesh without a triangle: distinct points of it, evenly spread over their numbers, and no faces.
Level make_point_level(const WorkingMesh& work, std::size_t target) {
    std::vector<Index> distinct;
    for (Index v = 0; v < work.positions.size(); ++v)
        if (work.surface.representative[v] == v) distinct.push_back(v);
    Level level;
    const std::size_t count = std::min(target, distinct.size());
    for (std::size_t i = 0; i < count; ++i) level.vertices.push_back(distinct[i * distinct.size() / count]);
    return level;
}

/// How many vertices each level should have, coarse to fine, without the finest. vertices: distinct ones, as vertices
/// at one place are one here.
std::vector<std::size_t> level_targets(std::size_t vertices, const StripOptions& options) {
    std::vector<std::size_t> targets;
    if (options.levels) {
        double count = double(vertices);
        for (unsigned k = 0; k < *options.levels; ++k) {
            count /= kLevelFactor;
            targets.insert(targets.begin(), std::max<std::size_t>(3, static_cast<std::size_t>(count)));
        }
        return targets;
    }
    const double base = double(options.error ? 3 : std::min(vertices, options.base.value_or(default_base(vertices))));
    for (double count = base; targets.empty() || count * 2 < double(vertices); count *= kLevelFactor)
        targets.push_back(static_cast<std::size_t>(count));
    return targets;
}

constexpr double kAnyError = 1e6; // more than any

/// The mesh as it is taken down: first in clusters, over its own vertices, then in one piece.
class Descent {
public:
    Descent(const WorkingMesh& work, const StripOptions& options)
        : work_(work), options_(options), clusters_(work.positions),
          is_clustered_(!options.max_edge && work.surface.place_count > options.one_piece) {}

    /// False: nothing could be removed.
    bool go_to(std::size_t target, SimplifiedLevels& result, const RunContext& context) {
        std::optional<double> max_error; // how much further the driver may leave the mesh
        if (options_.error) max_error = *options_.error - result.error;
        if (max_error && *max_error <= 0 && !result.levels.empty()) return false;
        const std::size_t before = current().size();
        Simplified simplified = one_level(target, max_error, result, context);
        result.error += simplified.error;
        result.forced += simplified.forced;
        left_ = std::move(simplified.triangles);
        return current().size() < before;
    }

    /// What is left, over the mesh's vertices.
    std::vector<Triangle> triangles(const SimplifiedLevels& result) const {
        std::vector<Triangle> all(current().begin(), current().end());
        if (!result.piece_vertices.empty())
            for (Triangle& t : all)
                for (Index& v : t) v = result.piece_vertices[v];
        return all;
    }

private:
    std::span<const Triangle> current() const { return left_ ? *left_ : work_.surface.triangles; }

    Simplified one_level(std::size_t target, std::optional<double> max_error, SimplifiedLevels& result,
                         const RunContext& context) {
        if (is_clustered_) {
            std::optional<Simplified> simplified =
                clusters_.simplify(current(), target, max_error.value_or(kAnyError), context);
            is_clustered_ = simplified && simplified->vertex_count > options_.one_piece;
            if (!is_clustered_) {
                if (simplified) left_ = std::move(simplified->triangles);
                make_piece(result);
                if (simplified) simplified->triangles = *left_;
            }
            if (simplified) return std::move(*simplified);
        }
        const bool is_piece = !piece_positions_.empty();
        const std::span<const Vec3f> positions = is_piece ? piece_positions_ : work_.positions;
        return simplify(positions, current(),
                        {.target_vertices = target, .max_error = max_error, .max_edge = options_.max_edge}, context);
    }

    /// What the clusters left becomes a mesh over its own vertices.
    void make_piece(SimplifiedLevels& result) {
        if (!left_) return; // nothing was taken away
        result.removed = clusters_.take_removed();
        std::vector<Index> local(work_.positions.size(), kNoIndex);
        for (const Triangle& t : *left_)
            for (const Index v : t)
                if (std::exchange(local[v], 0) == kNoIndex) result.piece_vertices.push_back(v);
        sort_by_place(result.piece_vertices);
        for (const Index v : result.piece_vertices) {
            local[v] = static_cast<Index>(piece_positions_.size());
            piece_positions_.push_back(work_.positions[v]);
        }
        for (Triangle& t : *left_)
            for (Index& v : t) v = local[v];
        std::ranges::sort(*left_, [](const Triangle& a, const Triangle& b) {
            const Index first_a = *std::ranges::min_element(a), first_b = *std::ranges::min_element(b);
            return first_a != first_b ? first_a < first_b : a < b;
        });
        result.piece_triangles = *left_;
    }

    /// What is near in space comes near in memory: simplifying jumps from place to place.
    void sort_by_place(std::vector<Index>& vertices) const {
        const Box box = bounds(work_.positions);
        const MortonOrder order(box);
        std::vector<std::pair<std::uint32_t, Index>> keys;
        keys.reserve(vertices.size());
        for (const Index v : vertices) keys.emplace_back(order.key(work_.positions[v]), v);
        std::ranges::sort(keys);
        for (std::size_t i = 0; i < keys.size(); ++i) vertices[i] = keys[i].second;
    }

    const WorkingMesh& work_;
    const StripOptions& options_;
    ClusterSimplifier clusters_;
    std::optional<std::vector<Triangle>> left_; ///< over the piece's vertices, once there is one, else the mesh's
    bool is_clustered_;
    std::vector<Vec3f> piece_positions_;
};

std::vector<Index> nearest_of(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                              std::span<const Index> sources) {
    std::vector<bool> is_source(positions.size(), false);
    for (const Index v : sources) is_source[v] = true;
    return nearest_sources(positions, triangles, triangles_at_vertices(triangles, positions.size()), is_source);
}

/// Where what the clusters left fell apart, a part of it may have no driver vertex, though the mesh leads to one: from
/// the vertices beside.
void spread_to_rest(const WorkingMesh& work, std::vector<Index>& nearest) {
    std::vector<Index> global;
    std::vector<Triangle> triangles;
    std::vector<Vec3f> positions;
    std::vector<bool> is_source;
    std::unordered_map<Index, Index> local;
    for (const Triangle& t : work.surface.triangles) {
        if (std::ranges::none_of(t, [&](Index v) { return nearest[v] == kNoIndex; })) continue;
        Triangle& own = triangles.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [found, is_new] = local.try_emplace(t[k], Index(global.size()));
            own[k] = found->second;
            if (!is_new) continue;
            global.push_back(t[k]);
            positions.push_back(work.positions[t[k]]);
            is_source.push_back(nearest[t[k]] != kNoIndex);
        }
    }
    const std::vector<Index> beside =
        nearest_sources(positions, triangles, triangles_at_vertices(triangles, positions.size()), is_source);
    for (std::size_t i = 0; i < global.size(); ++i)
        if (!is_source[i] && beside[i] != kNoIndex) nearest[global[i]] = nearest[global[beside[i]]];
}

} // namespace

Level make_level(std::span<const Triangle> triangles, std::size_t vertex_count) {
    Level level;
    std::vector<Index> local(vertex_count, kNoIndex);
    for (const Triangle& t : triangles)
        for (Index v : t) local[v] = 0;
    for (Index v = 0; v < vertex_count; ++v)
        if (local[v] == 0) {
            local[v] = static_cast<Index>(level.vertices.size());
            level.vertices.push_back(v);
        }
    level.corners.reserve(triangles.size() * 3);
    level.face_offsets.reserve(triangles.size() + 1);
    for (const Triangle& t : triangles) {
        for (Index v : t) level.corners.push_back(local[v]);
        level.face_offsets.push_back(static_cast<Index>(level.corners.size()));
    }
    return level;
}

Result<WorkingMesh> make_working_mesh(const Mesh& mesh, const RunContext& context) {
    return make_working_mesh(mesh, weld_map(mesh.positions), context);
}

Result<WorkingMesh> make_working_mesh(const Mesh& mesh, std::vector<Index> representative, const RunContext& context) {
    WorkingMesh work;
    const Box box = bounds(mesh);
    const double diagonal = box.diagonal();
    const double scale = diagonal > 0 ? 1 / diagonal : 1;
    work.positions.resize(mesh.vertex_count());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        work.positions[v] = (scale * (mesh.positions[v].cast<double>() - box.centre()))
                                .cwiseMin(kFarthest)
                                .cwiseMax(-kFarthest)
                                .cast<float>();
    Result<Surface> surface = make_surface(mesh, std::move(representative), context);
    if (!surface) return surface.error();
    work.surface = std::move(*surface);
    work.normals = vertex_normals(work.surface.triangles, work.positions, context);
    return work;
}

SimplifiedLevels simplify_levels(const WorkingMesh& work, const StripOptions& options, const RunContext& context) {
    const std::vector<std::size_t> targets = level_targets(work.surface.place_count, options);
    SimplifiedLevels result;
    if (work.surface.triangles.empty()) {
        result.levels.push_back(make_point_level(work, targets.front()));
        return result;
    }
    Descent descent(work, options);
    for (std::size_t k = targets.size(); k-- > 0 && !context.is_cancelled();) {
        context.report("simplify", 1 - double(k + 1) / double(targets.size()));
        const bool has_left_some = descent.go_to(targets[k], result, context);
        const bool is_driver = k == 0 && result.levels.empty(); // without it there is no model
        if (!has_left_some && !is_driver) continue;             // a level that removes nothing is none
        result.levels.insert(result.levels.begin(), make_level(descent.triangles(result), work.positions.size()));
    }
    return result;
}

std::vector<Triangle> driver_cells(const Level& driver) {
    std::vector<Triangle> cells;
    for (std::size_t f = 0; f < driver.face_count(); ++f) {
        const Index* c = &driver.corners[driver.face_offsets[f]];
        cells.push_back({c[0], c[1], c[2]});
    }
    if (cells.empty()) // points: each is a cell of its own
        for (Index i = 0; i < driver.vertices.size(); ++i) cells.push_back({i, i, i});
    return cells;
}

namespace {

/// Loose parts look for a place on the mesh itself, or on a level where it has more triangles than these: the tree over
/// them takes about 150 bytes each.
constexpr std::size_t kMostBeside = std::size_t{1} << 20;

/// The triangles of the finest level that is small enough, over the mesh's vertices.
std::vector<Triangle> triangles_beside(const WorkingMesh& work, const SimplifiedLevels& simplified) {
    if (work.surface.triangles.size() <= kMostBeside) return work.surface.triangles;
    const auto& levels = simplified.levels;
    std::size_t k = levels.size() - 1;
    while (k > 0 && levels[k].face_count() > kMostBeside) --k;
    std::vector<Triangle> triangles;
    for (const Triangle& t : driver_cells(levels[k]))
        triangles.push_back({levels[k].vertices[t[0]], levels[k].vertices[t[1]], levels[k].vertices[t[2]]});
    return triangles;
}

std::vector<Index> nearest_along_surface(const WorkingMesh& work, const SimplifiedLevels& simplified,
                                         const RunContext& context) {
    std::span<const Triangle> triangles = work.surface.triangles;
    const std::vector<Index>& driver = simplified.levels.front().vertices;
    if (simplified.removed.empty()) return nearest_of(work.positions, triangles, driver);

    const std::vector<Index>& own = simplified.piece_vertices;
    std::vector<Vec3f> positions;
    std::vector<Index> local(work.positions.size(), kNoIndex), own_driver;
    for (const Index v : own) {
        local[v] = static_cast<Index>(positions.size());
        positions.push_back(work.positions[v]);
    }
    for (const Index v : driver) own_driver.push_back(local[v]);
    const std::vector<Index> nearest = nearest_of(positions, simplified.piece_triangles, own_driver);
    const std::vector<Index>& nearest_left = simplified.removed.nearest_left;
    std::vector<Index> result(work.positions.size(), kNoIndex);
    parallel_for(context, result.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            Index at = static_cast<Index>(v);
            while (local[at] == kNoIndex && nearest_left[at] != kNoIndex) at = nearest_left[at];
            if (local[at] != kNoIndex && nearest[local[at]] != kNoIndex) result[v] = own[nearest[local[at]]];
        }
    });
    spread_to_rest(work, result);
    return result;
}

} // namespace

NearestDriver nearest_driver_vertices(const WorkingMesh& work, const SimplifiedLevels& simplified,
                                      const RunContext& context) {
    std::vector<Index> source = nearest_along_surface(work, simplified, context);
    const Level& driver = simplified.levels.front();
    std::vector<Triangle> cells = driver_cells(driver);
    for (Triangle& cell : cells)
        for (Index& v : cell) v = driver.vertices[v];
    const bool has_loose = std::ranges::find(source, kNoIndex) != source.end();
    return hang_loose_parts(work.positions, work.surface,
                            has_loose ? triangles_beside(work, simplified) : std::vector<Triangle>(), cells,
                            std::move(source), context);
}

} // namespace filigree
