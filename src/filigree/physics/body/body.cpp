#include "filigree/physics/body.h"
#include "filigree/core/math.h"
#include "filigree/sample/closure.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/body/cell_shares.h"
#include "filigree/physics/body/embedding.h"
#include "filigree/physics/body/fields.h"
#include "filigree/physics/body/joined_parts.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/body/mesh_cells.h"
#include "filigree/physics/body/occupied_cells.h"
#include "filigree/physics/body/separate_parts.h"
#include "filigree/physics/body/surface_points.h"
#include "filigree/physics/simulation.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace filigree {

namespace {

/// Below this mean square of its neighbours' offsets along some direction, in spacings, a cell's particle has no
/// gradient in that direction.
constexpr float kLeastSpread = 0.01f;

constexpr double kFieldSpacing = 0.5; ///< spacings between the points of the distance field
constexpr double kMostFieldPoints = 0x1p25;
/// Spacings. Between points of its grid the field sees as little as a quarter of a spacing in a part that is one thick.
constexpr float kSheetDepth = 0.2f, kSheetRadius = 0.4f;

bool uses_centroids(MaterialModel model) { return model == MaterialModel::meshfree || model == MaterialModel::mpm; }

/// Particles at the corners: each cell gives an eighth of its mass to each of its corners.
void use_corners(Body& body) {
    const Cells& cells = body.cells;
    body.rest = Vectors(cells.corners.size());
    for (std::size_t c = 0; c < cells.corners.size(); ++c) {
        const auto& index = cells.corners[c];
        body.rest.set(c, (cells.origin + cells.spacing * Vec3d(index[0], index[1], index[2])).cast<float>());
    }
    const double eighth = cells.spacing * cells.spacing * cells.spacing / 8;
    std::vector<double> volume(cells.corners.size());
    for (std::size_t c = 0; c < cells.cells.size(); ++c)
        for (const Index corner : cells.cell_corners[c]) volume[corner] += cells.fraction[c] * eighth;
    body.volume.assign(volume.begin(), volume.end());
}

/// Whether the centroids around a cell's spread in all directions.
bool has_spread(const Cells& cells, std::size_t cell) {
    const auto& index = cells.cells[cell];
    Mat3f moment = Mat3f::Zero();
    int count = 0;
    for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i) {
                if (i == 0 && j == 0 && k == 0) continue;
                const Index neighbour = cells.find_cell(index[0] + i, index[1] + j, index[2] + k);
                if (neighbour == kNoIndex) continue;
                const Vec3f offset = (cells.centroid[neighbour] - cells.centroid[cell]) / float(cells.spacing);
                moment += offset * offset.transpose();
                ++count;
            }
    if (count < 3) return false;
    return symmetric_eigenvalues(moment / float(count))[0] >= kLeastSpread;
}

/// For each cell 1 where its particle will have a gradient.
std::vector<std::uint8_t> find_spread(const Cells& cells, const RunContext& context) {
    std::vector<std::uint8_t> spread(cells.cells.size());
    parallel_for(context, spread.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) spread[c] = has_spread(cells, c);
    });
    return spread;
}

/// One particle a cell, or eight where one would have no gradient. Returns how many cells have eight.
std::size_t use_centroids(Body& body, const RunContext& context) {
    const Cells& cells = body.cells;
    std::vector<std::uint8_t> spread(cells.cells.size(), 1);
    if (body.material.model == MaterialModel::meshfree) spread = find_spread(cells, context);
    const auto split = std::size_t(std::count(spread.begin(), spread.end(), 0));
    body.rest = Vectors(cells.cells.size() + 7 * split);
    body.volume.resize(body.rest.size());
    const double cube = cells.spacing * cells.spacing * cells.spacing;
    const auto quarter = float(cells.spacing / 4);
    std::size_t particle = 0;
    for (std::size_t c = 0; c < cells.cells.size(); ++c) {
        const unsigned parts = spread[c] ? 1 : 8;
        for (unsigned part = 0; part < parts; ++part, ++particle) {
            Vec3f position = cells.centroid[c];
            if (parts == 8)
                for (int axis = 0; axis < 3; ++axis) position[axis] += part >> axis & 1 ? quarter : -quarter;
            body.rest.set(particle, position);
            body.volume[particle] = float(cells.fraction[c] * cube / parts);
        }
    }
    return split;
}

/// Fills rest, volume, mass and corners. Returns how many cells were split.
std::size_t make_particles(Body& body, const RunContext& context) {
    std::size_t split = 0;
    if (uses_centroids(body.material.model))
        split = use_centroids(body, context);
    else
        use_corners(body);
    if (body.material.model == MaterialModel::meshfree) body.corners = embed_corners(body.cells, body.rest, context);
    set_masses(body);
    return split;
}

Embedding embed_surface(std::span<const Vec3f> points, const Body& body, const RunContext& context) {
    if (body.material.model == MaterialModel::mpm) return embed(points, body.rest, body.spacing(), context);
    const Embedding in_cells = embed_in_cells(points, body.cells, context);
    return body.corners.size() == 0 ? in_cells : carried_on(in_cells, body.corners);
}

/// What make_particles would make.
std::size_t count_particles(const Cells& cells, MaterialModel model, const RunContext& context) {
    if (model == MaterialModel::mpm) return cells.cells.size();
    if (model != MaterialModel::meshfree) return cells.corners.size();
    const std::vector<std::uint8_t> spread = find_spread(cells, context);
    return cells.cells.size() + 7 * std::size_t(std::count(spread.begin(), spread.end(), 0));
}

/// Spacings between points of the surface. A rigid body has no dents that few points would miss.
double point_spacing(const Material& material) { return material.model == MaterialModel::rigid ? 1 : 0.5; }

/// Calls visit(cell, axis, side) for the outer faces of whole cells; side: 0 towards lower coordinates, or 1.
template <class Visit>
void each_outer_face(const Cells& cells, const Visit& visit) {
    for (std::size_t c = 0; c < cells.cells.size(); ++c)
        for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 2; ++side) {
                std::array<int, 3> next = {cells.cells[c][0], cells.cells[c][1], cells.cells[c][2]};
                next[axis] += side ? 1 : -1;
                if (cells.find_cell(next[0], next[1], next[2]) == kNoIndex) visit(c, axis, side);
            }
}

/// The corners of a face of a cell, counter-clockwise from outside.
std::array<Index, 4> face_corners(const Cells& cells, std::size_t cell, int axis, int side) {
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
    const auto& corner = cells.cell_corners[cell];
    std::array<Index, 4> face = {corner[base], corner[base + u], corner[base + u + v], corner[base + v]};
    if (!side) std::swap(face[1], face[3]);
    return face;
}

/// Surface points at the middles of the quarters of outer faces; their normals and areas go into the body.
std::vector<Vec3f> points_on_faces(Body& body) {
    std::vector<Vec3f> points;
    const double h = body.spacing();
    each_outer_face(body.cells, [&](std::size_t c, int axis, int side) {
        const auto& cell = body.cells.cells[c];
        Vec3d normal = Vec3d::Zero();
        normal[axis] = side ? 1 : -1;
        const Vec3d centre = Vec3d(cell[0], cell[1], cell[2]) + Vec3d::Constant(0.5) + 0.5 * normal;
        for (int quarter = 0; quarter < 4; ++quarter) {
            Vec3d at = centre;
            at[(axis + 1) % 3] += quarter & 1 ? 0.25 : -0.25;
            at[(axis + 2) % 3] += quarter & 2 ? 0.25 : -0.25;
            points.push_back((body.cells.origin + h * at).cast<float>());
            body.surface.normals.push_back(normal.cast<float>());
            body.surface.areas.push_back(float(h * h / 4));
        }
    });
    return points;
}

/// The same at the corners of outer faces, one where several meet.
std::vector<Vec3f> points_at_corners(Body& body) {
    const auto quarter = float(body.spacing() * body.spacing() / 4);
    std::vector<Vec3f> normals(body.rest.size(), Vec3f::Zero());
    std::vector<float> areas(body.rest.size(), 0);
    each_outer_face(body.cells, [&](std::size_t c, int axis, int side) {
        for (const Index corner : face_corners(body.cells, c, axis, side)) {
            normals[corner][axis] += side ? 1.0f : -1.0f;
            areas[corner] += quarter;
        }
    });
    std::vector<Vec3f> points;
    for (std::size_t corner = 0; corner < body.rest.size(); ++corner) {
        if (!(areas[corner] > 0)) continue;
        points.push_back(body.rest[corner]);
        body.surface.normals.push_back(normals[corner].stableNormalized());
        body.surface.areas.push_back(areas[corner]);
    }
    return points;
}

/// The outer faces of whole cells.
Mesh outer_faces(const Cells& cells) {
    Mesh mesh;
    for (const auto& corner : cells.corners)
        mesh.positions.push_back((cells.origin + cells.spacing * Vec3d(corner[0], corner[1], corner[2])).cast<float>());
    each_outer_face(cells,
                    [&](std::size_t c, int axis, int side) { mesh.add_face(face_corners(cells, c, axis, side)); });
    return mesh;
}

/// m between points of the distance field: wider for very many cells, so that memory stays bounded.
double field_spacing(const Body& body) {
    Box box;
    for (const auto& corner : body.cells.corners) box.extend(Vec3d(corner[0], corner[1], corner[2]));
    const double points = (box.size().array() / kFieldSpacing + 1).prod();
    const double finer = body.cells.is_parted() ? 0.5 : 1; // so that it sees gaps of a quarter of a cell
    return finer * kFieldSpacing * body.spacing() * std::max(1.0, math::cbrt(points / kMostFieldPoints));
}

/// The distance from the surface at rest. A mesh whose inside is thinner than cells can see counts as a sheet.
Status add_field(Body& body, const Mesh& mesh, const RunContext& context) {
    if (body.material.model == MaterialModel::mpm) return Success{};
    RunContext quiet = context;
    quiet.progress = nullptr;
    Result<DistanceField> field = DistanceField::create(mesh, body.scale, field_spacing(body), quiet);
    if (!field) return field.error();
    float deepest = 0;
    for (const Vec3f& centroid : body.cells.centroid) deepest = std::max(deepest, -field->at(centroid).distance);
    if (deepest < kSheetDepth * float(body.spacing())) body.field_radius = kSheetRadius * float(body.spacing());
    body.field = std::make_shared<const DistanceField>(std::move(field).value());
    return Success{};
}

std::string warning_of(const Body& body, const BodyReport& report) {
    constexpr double kManyThin = 0.05; // of the cells; below, toes and ears that nobody sees bend too much
    std::string warning = outward_sentence(report.outward);
    const auto add = [&](const std::string& sentence) {
        if (!sentence.empty()) warning += (warning.empty() ? "" : " ") + sentence;
    };
    const CellReport& cells = report.cells;
    const bool bends = body.material.model != MaterialModel::rigid && cells.cells >= kFewestElasticCells;
    if (bends && double(cells.thin_cells) > kManyThin * double(cells.cells))
        add(std::to_string(cells.thin_cells) + " of " + std::to_string(cells.cells) +
            " cells lie in parts fewer than two cells across, which will be too soft or too stiff there; more "
            "particles make them right.");
    add(joined_sentence(report.joined, body.spacing(), body.particle_count()));
    if (report.joined.corners > 0 && body.material.model == MaterialModel::fem && !body.cells.is_parted())
        add("The option separate keeps them apart too.");
    add(fields_warning(body));
    return warning;
}

/// Metres a model unit. Errors: usage, unsuitable (a mesh without extent that is given a size).
Result<double> scale_of(const Mesh& mesh, const BodyOptions& options) {
    if (!options.size) return options.scale;
    if (options.scale != BodyOptions{}.scale) return Error{ErrorCode::usage, "Give scale or size, not both."};
    if (!std::isfinite(*options.size) || *options.size <= 0)
        return Error{ErrorCode::usage, "The size is " + mesh_cells::number(*options.size) +
                                           "; give the metres of the mesh's longest side, above 0."};
    const double longest = bounds(mesh).size().maxCoeff();
    if (!(longest > 0))
        return Error{ErrorCode::unsuitable, "The mesh has no extent, so there is nothing to give a size to."};
    return *options.size / longest;
}

/// Takes apart what cells join. Returns what the user should know of it, as a sentence, or "".
Result<std::string> keep_apart(const Mesh& mesh, const WeldedTriangles& welded, Body& body, BodyReport& report,
                               const RunContext& context) {
    const Result<std::optional<JoinedParts>> left =
        separate_parts(mesh.positions, welded, body.scale, body.cells, context);
    if (!left) return left.error();
    if (!*left)
        return std::string("The mesh is open, or its box has more than 2^24 cells, so no gaps are seen in it and "
                           "separate keeps nothing apart; close the mesh first.");
    report.joined = **left;
    const std::vector<Cells::LatticeIndex>& corners = body.cells.corners;
    for (std::size_t c = 1; c < corners.size(); ++c) report.separated_corners += corners[c] == corners[c - 1];
    return std::string();
}

bool joins_by_cells(MaterialModel model) { return model != MaterialModel::rigid && model != MaterialModel::mpm; }

} // namespace

Result<Body> make_body(const Mesh& mesh, const Material& material, const BodyOptions& options,
                       const RunContext& context, BodyReport* report) {
    if (std::string wrong = check_material(material); !wrong.empty()) return Error{ErrorCode::usage, std::move(wrong)};
    BodyReport ignored;
    BodyReport& found = report ? *report : ignored;
    found = {};
    const Result<double> scale = scale_of(mesh, options);
    if (!scale) return scale.error();
    const Result<WeldedTriangles> welded = weld_triangles(mesh, context);
    if (!welded) return welded.error();
    const auto count = [&](const Cells& cells) { return count_particles(cells, material.model, context); };
    Result<Cells> cells = make_cells(mesh, *welded, *scale, options.cells, count, context, &found.cells);
    if (!cells) return cells.error();

    Body body;
    body.material = material;
    body.scale = *scale;
    body.cells = std::move(cells).value();
    if (joins_by_cells(material.model)) {
        const Result<JoinedParts> joined = find_joined_parts(mesh.positions, *welded, *scale, body.cells, context);
        if (!joined) return joined.error();
        found.joined = *joined;
    }
    std::string not_told;
    if (options.separate) {
        if (material.model != MaterialModel::fem)
            return Error{ErrorCode::usage, "Only bodies of the model fem keep near parts apart (separate)."};
        Result<std::string> apart = keep_apart(mesh, *welded, body, found, context);
        if (!apart) return apart.error();
        not_told = std::move(*apart);
    }
    if (!uses_centroids(material.model)) share_with_neighbours(body.cells);
    found.split_cells = make_particles(body, context);
    SurfacePoints spread =
        spread_on_surface(mesh.positions, welded->triangles, *scale, point_spacing(material) * body.spacing());
    body.surface.normals = std::move(spread.normals);
    body.surface.areas = std::move(spread.areas);
    body.surface.points = embed_surface(spread.positions, body, context);
    if (Status added = add_field(body, mesh, context); !added) return added.error();
    if (Status spread_in = add_vertex_fields(body, mesh, options.fields, context); !spread_in) return spread_in.error();
    if (context.is_cancelled()) return cancelled_error();

    found.surface_points = body.surface.points.size();
    for (const float mass : body.mass) found.mass += mass;
    found.outward = welded->outward;
    found.warning = warning_of(body, found);
    if (!not_told.empty()) found.warning += (found.warning.empty() ? "" : " ") + not_told;
    return body;
}

Body bare_body(Cells cells, const Material& material) {
    Body body;
    body.material = material;
    body.cells = std::move(cells);
    make_particles(body, RunContext());
    return body;
}

Body make_body(Cells cells, const Material& material) {
    const RunContext context;
    Body body = bare_body(std::move(cells), material);
    const bool is_rigid = material.model == MaterialModel::rigid;
    const std::vector<Vec3f> points = is_rigid ? points_at_corners(body) : points_on_faces(body);
    body.surface.points = embed_surface(points, body, context);
    [[maybe_unused]] const Status added = add_field(body, outer_faces(body.cells), context);
    assert(added.ok());
    return body;
}

} // namespace filigree
