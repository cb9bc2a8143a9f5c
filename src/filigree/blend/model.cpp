#include "filigree/strip.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

/// The first vertices of a mesh, where no face has one of the others.
Mesh first_vertices(Mesh mesh, std::size_t count) {
    mesh.positions.resize(count);
    if (!mesh.normals.empty() && mesh.normals.per_vertex()) mesh.normals.values.resize(count);
    if (!mesh.uvs.empty() && mesh.uvs.per_vertex()) mesh.uvs.values.resize(count);
    if (!mesh.colors.empty()) mesh.colors.resize(count);
    for (VertexScalar& scalar : mesh.scalars) scalar.values.resize(count);
    return mesh;
}

} // namespace

Mesh level_mesh(const Model& model, unsigned level) {
    if (level >= model.finest_level()) return first_vertices(model.mesh, model.vertex_count());
    return level_mesh(model.mesh, model.levels[level]);
}

Mesh level_mesh(const Mesh& full, const Level& source) {
    Mesh mesh;
    mesh.origin = full.origin;
    mesh.face_offsets = source.face_offsets;
    mesh.corners = source.corners;
    const auto pick = [&](const auto& from, auto& to) {
        to.reserve(source.vertices.size());
        for (Index v : source.vertices) to.push_back(from[v]);
    };
    pick(full.positions, mesh.positions);
    if (!full.uvs.empty() && full.uvs.per_vertex()) pick(full.uvs.values, mesh.uvs.values);
    if (!full.normals.empty() && full.normals.per_vertex()) pick(full.normals.values, mesh.normals.values);
    if (!full.colors.empty()) pick(full.colors, mesh.colors);
    mesh.colors_have_alpha = full.colors_have_alpha;
    for (const VertexScalar& scalar : full.scalars) {
        mesh.scalars.push_back({scalar.name, {}});
        pick(scalar.values, mesh.scalars.back().values);
    }
    return mesh;
}

LevelCounts level_counts(const Model& model, unsigned level) {
    if (level >= model.finest_level())
        return {model.vertex_count(), model.mesh.face_count(), model.mesh.corner_count()};
    const Level& counted = model.levels[level];
    return {counted.vertices.size(), counted.face_count(), counted.corners.size()};
}

std::vector<float> vertex_levels(const Model& model, unsigned level) {
    std::vector<float> levels(model.mesh.vertex_count(), static_cast<float>(model.finest_level()));
    for (unsigned k = model.finest_level(); k-- > 0;)
        for (Index v : model.levels[k].vertices) levels[v] = static_cast<float>(k);
    if (level == model.finest_level()) {
        levels.resize(model.vertex_count());
        return levels;
    }
    std::vector<float> chosen;
    for (Index v : model.levels[level].vertices) chosen.push_back(levels[v]);
    return chosen;
}

std::vector<Vec3f> driver_positions(const Model& model) {
    std::vector<Vec3f> positions;
    positions.reserve(model.driver().vertices.size());
    for (Index v : model.driver().vertices) positions.push_back(model.mesh.positions[v]);
    return positions;
}

Pose rest_pose(const Model& model) { return {driver_positions(model), {}}; }

namespace {

bool ascending_below(std::span<const Index> ids, std::size_t limit) {
    for (std::size_t i = 0; i < ids.size(); ++i)
        if (ids[i] >= limit || (i > 0 && ids[i] <= ids[i - 1])) return false;
    return true;
}

} // namespace

std::string check_level(const Level& level, std::size_t vertex_count) {
    if (level.vertices.empty()) return "a level has no vertices";
    if (!ascending_below(level.vertices, vertex_count)) return "a level's vertices are not ascending ids of the mesh";
    Mesh mesh; // borrowed for its own checks
    mesh.positions.resize(level.vertices.size(), Vec3f::Zero());
    mesh.face_offsets = level.face_offsets;
    mesh.corners = level.corners;
    return check_mesh(mesh);
}

namespace {

/// What the gradient fit's cost is bounded by: it pairs the corners of each face.
bool all_triangles(const Level& level) {
    for (std::size_t f = 0; f < level.face_count(); ++f)
        if (level.face_offsets[f + 1] - level.face_offsets[f] != 3) return false;
    return true;
}

std::string check_blend(const BlendDetail& detail, std::size_t vertex_count, std::size_t driver_count) {
    if (detail.cells.empty() || detail.cell_offsets.size() != detail.cells.size() + 1)
        return "cells and offsets differ";
    for (const Triangle& cell : detail.cells)
        for (Index v : cell)
            if (v >= driver_count) return "a cell names a driver vertex that is not there";
    if (detail.cell_offsets.front() != 0 || detail.cell_offsets.back() != vertex_count) return "records are missing";
    for (std::size_t c = 0; c < detail.cells.size(); ++c)
        if (detail.cell_offsets[c] > detail.cell_offsets[c + 1]) return "the cells' offsets do not ascend";
    if (detail.order.size() != vertex_count || detail.u.size() != vertex_count || detail.v.size() != vertex_count)
        return "there is not one record a vertex";
    std::vector<bool> seen(vertex_count, false);
    for (Index v : detail.order) {
        if (v >= vertex_count || seen[v]) return "the records' order is no permutation";
        seen[v] = true;
    }
    for (std::size_t r = 0; r < vertex_count; ++r)
        if (!(std::abs(detail.u[r]) <= 1 && std::abs(detail.v[r]) <= 1)) return "a weight is out of range";
    if (!ascending_below(detail.across_gap, vertex_count) || !ascending_below(detail.facing_away, vertex_count))
        return "a list of vertices is not ascending";
    return "";
}

/// Whether it is empty or has each of so many vertices once.
bool is_order(std::span<const Index> order, std::size_t vertices) {
    if (order.empty()) return true;
    if (order.size() != vertices) return false;
    std::vector<bool> is_named(vertices);
    for (const Index v : order) {
        if (v >= vertices || is_named[v]) return false;
        is_named[v] = true;
    }
    return true;
}

/// The first thing wrong with a driver that is said to be behind the mesh's own vertices, or "".
std::string check_driver_behind(const Model& model) {
    const std::vector<Index>& driver = model.driver().vertices;
    if (model.levels.size() != 1 || driver.size() > model.mesh.vertex_count() ||
        driver.front() != model.mesh.vertex_count() - driver.size())
        return "a driver made elsewhere is not behind the mesh's own vertices";
    if (std::ranges::any_of(model.mesh.corners, [&](Index v) { return v >= driver.front(); }))
        return "faces have vertices of a driver made elsewhere";
    return "";
}

} // namespace

std::string check_model(const Model& model) {
    if (std::string wrong = check_mesh(model.mesh); !wrong.empty()) return wrong;
    if (!is_order(model.source_order, model.mesh.vertex_count()))
        return "the vertices' order in the source does not name each of them once";
    if (model.levels.empty()) return "there is no driver";
    for (const Level& level : model.levels)
        if (std::string wrong = check_level(level, model.mesh.vertex_count()); !wrong.empty()) return wrong;
    if (model.driver_is_behind)
        if (std::string wrong = check_driver_behind(model); !wrong.empty()) return wrong;
    if (!all_triangles(model.driver())) return "the driver has faces that are not triangles";
    return check_blend(model.detail, model.mesh.vertex_count(), model.driver().vertices.size());
}

} // namespace filigree
