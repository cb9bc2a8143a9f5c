#include "filigree/strip.h"

#include "filigree/blend/bind_levels.h"
#include "filigree/blend/blend_code.h"
#include "filigree/core/now_seconds.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/text.h"
#include "filigree/levels/simplify_levels.h"
#include "filigree/levels/vertex_order.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/normals.h"
#include "filigree/mesh/surface.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace filigree {

namespace {

constexpr double kInsideOut = 0.2; // of a mesh's vertices, bound to backs: with a driver the right way round few are
constexpr double kFarReach = 1000; // of the mesh and a driver together, in mesh diagonals: three digits of seven

/// The driver's cells over its own vertices, and as triangles over the mesh's.
struct Cells {
    std::vector<Triangle> local;
    std::vector<Triangle> global;
};

Cells make_cells(const Level& driver) {
    Cells cells{.local = driver_cells(driver), .global = {}};
    for (const Triangle& cell : cells.local)
        cells.global.push_back({driver.vertices[cell[0]], driver.vertices[cell[1]], driver.vertices[cell[2]]});
    return cells;
}

/// The driver's vertices as vertices of the mesh, behind its own, where no face uses them. Colours are white, texture
/// coordinates and other numbers 0.
void append_driver(Mesh& mesh, const Mesh& driver, std::span<const Vec3f> driver_normals) {
    for (std::size_t v = 0; v < driver.vertex_count(); ++v)
        mesh.positions.push_back((driver.world_position(v) - mesh.origin).cast<float>());
    const std::size_t count = mesh.vertex_count();
    if (!mesh.normals.empty() && mesh.normals.per_vertex())
        mesh.normals.values.insert(mesh.normals.values.end(), driver_normals.begin(), driver_normals.end());
    if (!mesh.uvs.empty() && mesh.uvs.per_vertex()) mesh.uvs.values.resize(count, Vec2f::Zero());
    if (!mesh.colors.empty()) mesh.colors.resize(count, Vec4f::Ones());
    for (VertexScalar& scalar : mesh.scalars) scalar.values.resize(count, 0);
}

/// Threads between each driver vertex and the corners of the mesh's triangle that is closest to it and faces the same
/// way: along them the driver's vertices find the part of the mesh that is theirs.
std::vector<Triangle> link_driver(const WorkingMesh& work, std::size_t first_driver_vertex, const RunContext& context) {
    std::vector<Triangle> links;
    const std::span<const Triangle> triangles = work.surface.triangles;
    if (triangles.empty()) return links;
    const ClosestPointTree tree(work.positions, triangles, context);
    const std::size_t count = work.positions.size() - first_driver_vertex;
    links.resize(2 * count);
    parallel_for(context, count, 1 << 10, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto v = static_cast<Index>(first_driver_vertex + i);
            SurfacePoint point =
                tree.closest(work.positions[v], std::numeric_limits<double>::infinity(), work.normals[v]);
            if (point.triangle == kNoIndex) point = tree.closest(work.positions[v]);
            const Triangle& t = triangles[point.triangle];
            links[2 * i] = {v, t[0], t[1]};
            links[2 * i + 1] = {v, t[1], t[2]};
        }
    });
    return links;
}

/// The driver as a level: `count` vertices of the mesh from `first` on.
Level make_driver_level(std::size_t first, std::size_t count, std::span<const Triangle> triangles) {
    Level level;
    for (std::size_t i = 0; i < count; ++i) level.vertices.push_back(static_cast<Index>(first + i));
    for (const Triangle& t : triangles) {
        level.corners.insert(level.corners.end(), t.begin(), t.end());
        level.face_offsets.push_back(static_cast<Index>(level.corners.size()));
    }
    return level;
}

std::optional<Error> check_driver(const Mesh& mesh, const Mesh& driver) {
    if (std::optional<Error> error = mesh_error(mesh)) return error;
    if (std::optional<Error> error = mesh_error(driver, "The driver")) return error;
    if (mesh.vertex_count() == 0) return Error{ErrorCode::unsuitable, "The mesh has no vertices: nothing to bind."};
    if (driver.vertex_count() == 0)
        return Error{ErrorCode::unsuitable, "The driver has no vertices: nothing to bind to."};
    if (mesh.vertex_count() + driver.vertex_count() >= kNoIndex)
        return Error{ErrorCode::unsuitable, "The mesh and its driver have more vertices than 32-bit indices can name."};
    return std::nullopt;
}

/// A driver of the mesh's own vertices.
std::optional<Error> check_level(const Mesh& mesh, const Level& driver) {
    Mesh as_mesh; // what check_mesh says of faces over as many vertices
    as_mesh.positions.assign(driver.vertices.size(), Vec3f::Zero());
    as_mesh.face_offsets = driver.face_offsets;
    as_mesh.corners = driver.corners;
    if (std::optional<Error> error = mesh_error(as_mesh, "The driver")) return error;
    const bool ascend = std::ranges::adjacent_find(driver.vertices, std::greater_equal{}) == driver.vertices.end();
    if (!ascend || driver.vertices.back() >= mesh.vertex_count())
        return Error{ErrorCode::usage,
                     "The driver is inconsistent: Its vertices are not vertices of the mesh, ascending."};
    if (driver.corners.size() != 3 * driver.face_count())
        return Error{ErrorCode::usage, "The driver is inconsistent: It has faces that are no triangles."};
    return std::nullopt;
}

/// The errors of strip that are known before any work.
std::optional<Error> check_strip(const Mesh& mesh, const StripOptions& options) {
    if (std::optional<Error> error = mesh_error(mesh)) return error;
    if (int(options.base.has_value()) + int(options.levels.has_value()) + int(options.error.has_value()) > 1)
        return Error{ErrorCode::usage,
                     "Give at most one of base, levels and error: each says how coarse the driver is."};
    if (options.base && *options.base < 3) return Error{ErrorCode::usage, "base must be 3 or more vertices."};
    if (options.levels && (*options.levels < 1 || *options.levels > 16))
        return Error{ErrorCode::usage, "levels must be 1 to 16."};
    if (options.error && !(*options.error > 0 && *options.error <= 1))
        return Error{ErrorCode::usage, "error must be above 0 and at most 1: it is a fraction of the diagonal."};
    if (options.max_edge && !(*options.max_edge > 0 && *options.max_edge <= 1))
        return Error{ErrorCode::usage, "max_edge must be above 0 and at most 1: it is a fraction of the diagonal."};
    if (mesh.vertex_count() == 0) return Error{ErrorCode::unsuitable, "The mesh has no vertices: nothing to strip."};
    return std::nullopt;
}

/// positions: the mesh's first, `own` of them, then the driver's.
std::vector<std::string> driver_warnings(std::span<const Vec3f> positions, std::size_t own, std::size_t facing_away) {
    std::vector<std::string> warnings;
    if (double(facing_away) > kInsideOut * double(own))
        warnings.push_back("The driver seems to be inside out, as " + with_commas(facing_away) +
                           " vertices are bound to the backs of its faces: turn its faces over.");
    const double size = bounds(positions.first(own)).diagonal(), reach = bounds(positions).diagonal();
    if (reach > kFarReach * size && size > 0)
        warnings.push_back("The driver reaches " + with_commas(std::uint64_t(std::min(reach / size, 1e18))) +
                           " times as far as the mesh is large, and 32-bit numbers lose as much: put it around the "
                           "mesh.");
    return warnings;
}

} // namespace

Result<Stripped> strip_to_driver(Mesh mesh, const Mesh& driver, const RunContext& context) {
    if (std::optional<Error> error = check_driver(mesh, driver)) return *error;
    const double bind_start = now_seconds();
    Result<Surface> driver_surface = make_surface(driver, context);
    if (!driver_surface) return driver_surface.error();
    split_shared_normals(mesh);
    const std::size_t own = mesh.vertex_count();
    const std::vector<Vec3f> driver_normals = vertex_normals(driver_surface->triangles, driver.positions, context);
    append_driver(mesh, driver, driver_normals);
    Result<WorkingMesh> work = make_working_mesh(mesh, context);
    if (!work) return work.error();
    // Not welded to the mesh, though a driver's vertex may lie on one of its.
    for (std::size_t i = 0; i < driver.vertex_count(); ++i)
        work->surface.representative[own + i] = static_cast<Index>(own + driver_surface->representative[i]);
    std::copy(driver_normals.begin(), driver_normals.end(), work->normals.begin() + static_cast<std::ptrdiff_t>(own));
    const std::vector<Triangle> links = link_driver(*work, own, context), beside = work->surface.triangles;
    work->surface.triangles.insert(work->surface.triangles.end(), links.begin(), links.end());

    Level level = make_driver_level(own, driver.vertex_count(), driver_surface->triangles);
    Cells cells = make_cells(level);
    Result<Binding> binding =
        bind_to_driver(work->positions, work->surface, work->normals, cells.global, beside, context);
    if (!binding) return binding.error();
    const auto drop_drivers = [own](std::vector<Index>& ids) {
        ids.erase(std::lower_bound(ids.begin(), ids.end(), own), ids.end());
    };
    drop_drivers(binding->across_gap);
    drop_drivers(binding->facing_away);

    Stripped result;
    result.report.across_gap = binding->across_gap.size();
    result.report.facing_away = binding->facing_away.size();
    result.report.bind_seconds = now_seconds() - bind_start;
    result.report.warnings = driver_warnings(mesh.positions, own, binding->facing_away.size());
    result.model.detail = encode_blend(std::move(cells.local), *binding);
    result.model.levels.push_back(std::move(level));
    result.model.mesh = std::move(mesh);
    result.model.driver_is_behind = true;
    return result;
}

Result<Model> bind_to_own_driver(Mesh mesh, Level driver, const RunContext& context) {
    if (driver.vertices.empty()) return Error{ErrorCode::unsuitable, "The driver has no vertices: nothing to bind to."};
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    if (std::optional<Error> error = check_level(mesh, driver)) return *error;
    const Result<WorkingMesh> work = make_working_mesh(mesh, context);
    if (!work) return work.error();
    std::vector<Level> levels;
    levels.push_back(std::move(driver));
    return bind_to_levels(std::move(mesh), std::move(levels), *work, context);
}

Result<Model> bind_to_levels(Mesh mesh, std::vector<Level> levels, const WorkingMesh& work, const RunContext& context) {
    const Level& driver = levels.front();
    Cells cells = make_cells(driver);
    std::vector<Triangle> over_places = cells.global; // a driver's vertex may lie where an earlier one does
    for (Triangle& cell : over_places)
        for (Index& v : cell) v = work.surface.representative[v];
    const Result<Binding> binding =
        bind_to_driver(work.positions, work.surface, work.normals, over_places, work.surface.triangles, context);
    if (!binding) return binding.error();
    Model model;
    model.detail = encode_blend(std::move(cells.local), *binding);
    model.levels = std::move(levels);
    model.mesh = std::move(mesh);
    split_shared_normals(model.mesh);
    return model;
}

Result<Stripped> strip(Mesh mesh, const StripOptions& options, const RunContext& context) {
    if (std::optional<Error> error = check_strip(mesh, options)) return *error;
    Stripped result;
    const double simplify_start = now_seconds();
    if (options.reorder) {
        result.model.source_order = order_by_place(mesh, context);
        mesh = with_vertex_order(std::move(mesh), result.model.source_order, context);
    }
    const Result<WorkingMesh> work = make_working_mesh(mesh, context);
    if (!work) return work.error();
    result.report.welded_vertices = mesh.vertex_count() - work->surface.place_count;
    SimplifiedLevels simplified = simplify_levels(*work, options, context);
    if (context.is_cancelled()) return cancelled_error();
    std::vector<Level>& levels = simplified.levels;
    result.report.simplify_error = simplified.error;
    result.report.forced_collapses = simplified.forced;
    result.report.simplify_seconds = now_seconds() - simplify_start;

    const double bind_start = now_seconds();
    Cells cells = make_cells(levels.front());
    const NearestDriver nearest = nearest_driver_vertices(*work, simplified, context);
    Result<Binding> binding = bind_to_driver(work->positions, work->surface, work->normals, cells.global, nearest,
                                             simplified.removed, context);
    if (!binding) return binding.error();
    result.report.across_gap = binding->across_gap.size();
    result.report.facing_away = binding->facing_away.size();
    result.report.bind_seconds = now_seconds() - bind_start;

    const double encode_start = now_seconds();
    result.model.detail = encode_blend(std::move(cells.local), *binding);
    result.model.levels = std::move(levels);
    result.model.mesh = std::move(mesh);
    split_shared_normals(result.model.mesh);
    result.report.encode_seconds = now_seconds() - encode_start;
    return result;
}

} // namespace filigree
