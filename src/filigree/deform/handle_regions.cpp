#include "filigree/pose.h"

#include "filigree/core/math.h"
#include "filigree/mesh.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/normals.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <functional>
#include <map>

namespace filigree {

namespace {

constexpr std::size_t kVerticesBetweenLooks = 8192; // at the cancel flag

/// Where each vertex that a handle holds goes to, in the world.
using Targets = std::map<Index, Vec3d>;

Error wrong_handle(const std::string& sentence) { return {ErrorCode::usage, sentence}; }

std::string said_name(const HandleRegion& handle, std::size_t number) {
    return handle.name.empty() ? "handle " + std::to_string(number + 1) : "handle '" + handle.name + "'";
}

/// What handles choose their vertices from.
struct Candidates {
    std::vector<Vec3d> world;                 ///< a place each
    std::function<Index(Index)> standing_for; ///< which of them stands for a vertex of the mesh
    std::size_t named_count;                  ///< vertices of the mesh
};

/// A driver's vertices, asked again and again which of them is the nearest.
class NearestVertices {
public:
    explicit NearestVertices(const Mesh& driver, const RunContext& context) : positions_(driver.positions) {
        points_.reserve(positions_.size());
        for (Index v = 0; v < positions_.size(); ++v) points_.push_back({v, v, v});
        tree_.emplace(positions_, points_, context);
    }
    /// The lowest of equally near ones.
    Index operator()(const Vec3f& place) const {
        const Index found = tree_->closest(place).triangle;
        return found == kNoIndex ? by_trying_all(place) : found;
    }

private:
    Index by_trying_all(const Vec3f& place) const { // so far away that the tree finds none
        const auto distance = [&](Index v) { return (positions_[v] - place).cast<double>().squaredNorm(); };
        Index best = 0;
        for (Index v = 1; v < positions_.size(); ++v)
            if (distance(v) < distance(best)) best = v;
        return best;
    }

    std::span<const Vec3f> positions_;
    std::vector<Triangle> points_;
    std::optional<ClosestPointTree> tree_;
};

/// The vertices that a handle holds, ascending.
Result<std::vector<Index>> held_vertices(const HandleRegion& handle, const std::string& name, const Candidates& from,
                                         const RunContext& context) {
    std::vector<Index> held;
    for (std::size_t i = 0; i < handle.vertices.size(); ++i) {
        if (i % kVerticesBetweenLooks == 0 && context.is_cancelled()) return cancelled_error();
        const Index id = handle.vertices[i];
        if (id >= from.named_count)
            return wrong_handle(name + " names vertex " + std::to_string(id) + ", and there are " +
                                std::to_string(from.named_count) + ".");
        held.push_back(from.standing_for(id));
    }
    for (Index v = 0; v < from.world.size(); ++v) {
        const Vec3d& place = from.world[v];
        const bool in_box = handle.box && (place.array() >= handle.box->min.array()).all() &&
                            (place.array() <= handle.box->max.array()).all();
        const bool in_sphere = handle.sphere && (place - handle.sphere->first).norm() <= handle.sphere->second;
        if (in_box || in_sphere) held.push_back(v);
    }
    std::sort(held.begin(), held.end());
    held.erase(std::unique(held.begin(), held.end()), held.end());
    if (held.empty())
        return wrong_handle(name + " holds no vertex of what is moved: make its region larger, or strip with a larger "
                                   "base for a finer driver.");
    return held;
}

Result<Targets> handle_targets(std::span<const HandleRegion> handles, const Candidates& from,
                               const RunContext& context) {
    Targets targets;
    for (std::size_t number = 0; number < handles.size(); ++number) {
        if (context.is_cancelled()) return cancelled_error();
        const HandleRegion& handle = handles[number];
        const std::string name = said_name(handle, number);
        const Result<std::vector<Index>> held = held_vertices(handle, name, from, context);
        if (!held) return held.error();
        Vec3d centre = Vec3d::Zero();
        for (const Index v : *held) centre += from.world[v] / double(held->size());
        centre = handle.centre.value_or(centre);
        const Mat3d turn = math::matrix(handle.rotation);
        for (const Index v : *held)
            if (!targets.emplace(v, centre + turn * (from.world[v] - centre) + handle.move).second)
                return wrong_handle(name + " shares a vertex with an earlier handle: keep their regions apart.");
    }
    return targets;
}

Result<Pose> solve_targets(std::span<const Vec3f> positions, std::span<const Triangle> triangles, const Vec3d& origin,
                           const Targets& targets, const RunContext& context) {
    std::vector<Index> vertices;
    std::vector<Vec3f> places;
    for (const auto& [vertex, target] : targets) {
        vertices.push_back(vertex);
        places.push_back((target - origin).cast<float>());
    }
    Result<HandleSolver> solver = HandleSolver::create(positions, triangles, vertices, context);
    if (!solver) return solver.error();
    Result<HandleResult> result = solver->solve(places, {}, context);
    if (!result) return result.error();
    return std::move(result->pose);
}

std::vector<Vec3d> places_in_world(const Mesh& mesh) {
    std::vector<Vec3d> places;
    for (const Vec3f& p : mesh.positions) places.push_back(mesh.origin + p.cast<double>());
    return places;
}

/// The targets of the first vertex at each place.
Result<Targets> welded_targets(const Targets& targets, std::span<const Index> representative) {
    Targets welded;
    for (const auto& [vertex, target] : targets)
        if (const auto known = welded.emplace(representative[vertex], target).first; known->second != target)
            return wrong_handle("two handles move vertices " + std::to_string(known->first) + " and " +
                                std::to_string(vertex) +
                                ", which lie at one place, to different places: name them in one handle.");
    return welded;
}

} // namespace

HandleRegion HandleRegion::part(double fraction) const {
    HandleRegion part = *this;
    part.move *= fraction;
    part.rotation.angle() *= fraction;
    return part;
}

Result<Mesh> move_by_handles(Mesh mesh, std::span<const HandleRegion> handles, const RunContext& context) {
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    const std::vector<Index> representative = weld_map(mesh.positions);
    const Result<Targets> targets =
        handle_targets(handles, {places_in_world(mesh), [](Index v) { return v; }, mesh.vertex_count()}, context);
    if (!targets) return targets.error();
    const Result<Targets> welded = welded_targets(*targets, representative);
    if (!welded) return welded.error();
    Result<Triangulation> triangulation = triangulate(mesh, context);
    if (!triangulation) return triangulation.error();
    std::vector<Triangle>& triangles = triangulation->triangles;
    for (Triangle& triangle : triangles)
        for (Index& v : triangle) v = representative[v];
    const Result<Pose> pose = solve_targets(mesh.positions, triangles, mesh.origin, *welded, context);
    if (!pose) return pose.error();
    const std::vector<Index> vertex_of_normal = split_shared_normals(mesh);
    for (std::size_t i = 0; i < vertex_of_normal.size(); ++i)
        if (vertex_of_normal[i] != kNoIndex)
            mesh.normals.values[i] = pose->gradients[representative[vertex_of_normal[i]]] * mesh.normals.values[i];
    for (Index v = 0; v < mesh.vertex_count(); ++v) mesh.positions[v] = pose->positions[representative[v]];
    return mesh;
}

Result<Pose> pose_by_handles(const Model& model, std::span<const HandleRegion> handles, const RunContext& context) {
    const Mesh driver = level_mesh(model, 0);
    if (driver.vertex_count() == 0) return Error{ErrorCode::unsuitable, "The driver has no vertices to take hold of."};
    std::optional<NearestVertices> nearest; // only where vertices are named
    const auto standing_for = [&](Index id) {
        if (!nearest) nearest.emplace(driver, context);
        return (*nearest)(model.mesh.positions[id]);
    };
    const Result<Targets> targets =
        handle_targets(handles, {places_in_world(driver), standing_for, model.vertex_count()}, context);
    if (!targets) return targets.error();
    const Result<Triangulation> triangulation = triangulate(driver, context);
    if (!triangulation) return triangulation.error();
    return solve_targets(driver.positions, triangulation->triangles, driver.origin, *targets, context);
}

} // namespace filigree
