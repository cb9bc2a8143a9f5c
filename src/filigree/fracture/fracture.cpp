#include "filigree/fracture.h"

#include "filigree/core/math.h"
#include "filigree/core/now_seconds.h"
#include "filigree/fracture/piece_assembly.h"
#include "filigree/sample/closure.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace filigree {

namespace {

constexpr double kSheetShare = 0.25; ///< of closing area beside the mesh's: above, there is no inside worth the name
constexpr double kPlanarEdge = 1.0 / 6, kRoughEdge = 1.0 / 20; ///< of a piece's size

/// How far a piece of average volume is across.
double piece_size(const CutSurface& cut, Index cells) {
    const double thinnest = 1e-3 * math::pow(cut.box.diagonal(), 3);
    return math::cbrt(std::max(std::abs(cut.volume), thinnest) / double(cells));
}

/// The pieces' sizes, and how far they are from adding up.
void report_sizes(const CutSurface& cut, std::span<const CellTriangle> triangles, std::span<const Index> piece_of_part,
                  Index pieces, CutReport& report) {
    const Vec3d middle = cut.box.centre();
    std::vector<double> volume(pieces, 0), area(pieces, 0);
    for (const CellTriangle& t : triangles) {
        const auto at = [&](std::size_t k) -> Vec3d {
            return cut.vertices.position(t.vertices[k]).cast<double>() - middle;
        };
        const Vec3d a = at(0), cross = (at(1) - a).cross(at(2) - a);
        volume[piece_of_part[t.part]] += a.dot(cross) / 6;
        if (t.facet == kNoIndex && cut.triangles[t.uncut].source != kNoIndex)
            area[piece_of_part[t.part]] += 0.5 * cross.norm();
    }
    report.volume = cut.volume;
    double sum = 0, of_all = 0; // which are not the same where parts are inside out
    for (const double v : volume) {
        sum += v;
        of_all += std::abs(v);
    }
    if (!report.is_sheet && of_all > 0) report.volume_error = std::abs(sum - report.volume) / of_all;
    std::vector<double>& size = report.is_sheet ? area : volume;
    for (double& v : size) v = std::abs(v);
    std::sort(size.begin(), size.end());
    if (size.empty()) return;
    report.smallest = size.front();
    report.median = size[size.size() / 2];
    report.largest = size.back();
}

/// Turns a face's corners over, the first of them staying the first.
void turn_face(Mesh& mesh, Index face) {
    const auto turn = [&](std::vector<Index>& corners) {
        if (!corners.empty())
            std::reverse(corners.begin() + mesh.face_offsets[face] + 1, corners.begin() + mesh.face_offsets[face + 1]);
    };
    turn(mesh.corners);
    turn(mesh.uvs.corners);
    turn(mesh.normals.corners);
}

/// The mesh with the faces turned that look inwards; nothing where there is none.
std::optional<Mesh> turned_outwards(const Mesh& mesh, const Surface& surface, OutwardReport& outward) {
    const std::vector<FaceTurn> turns = turns_of(surface, mesh.positions, outward);
    if (std::ranges::find(turns, FaceTurn::turned) == turns.end()) return std::nullopt;
    Mesh turned = mesh;
    for (std::size_t t = 0; t < turns.size(); ++t) {
        const bool is_first = t == 0 || surface.source_face[t] != surface.source_face[t - 1];
        if (is_first && turns[t] == FaceTurn::turned) turn_face(turned, surface.source_face[t]);
    }
    return turned;
}

Result<FracturedMesh> fracture_outward(const Mesh& mesh, const Surface& surface, const FractureCells& cells,
                                       const FractureOptions& options, CutReport report, const RunContext& context) {
    double start = now_seconds();
    const auto lap = [&start] {
        const double before = start;
        return (start = now_seconds()) - before;
    };
    Result<CutSurface> cut = cut_surface(mesh, surface, cells, context);
    if (!cut) return cut.error();
    report.cut_seconds = lap();
    report.closing_triangles = cut->closing_triangles;
    report.is_sheet = cut->closing_area > kSheetShare * cut->area;

    const double edge =
        options.edge.value_or((cells.warp().is_rough() ? kRoughEdge : kPlanarEdge) * piece_size(*cut, cells.count()));
    const Result<CrackSurfaces> facets = report.is_sheet ? CrackSurfaces{} : crack_surfaces(*cut, cells, edge, context);
    if (!facets) return facets.error();
    report.facet_seconds = lap();
    report.facets = facets->facets.size();
    for (const CrackSurface& facet : facets->facets) report.fan_facets += facet.is_fan;
    context.report("putting pieces together", 0.8);

    std::vector<CellTriangle> triangles = cell_triangles(*cut, *facets, cells);
    if (report.is_sheet) // what closed it is no matter: a cell that holds nothing else is no piece
        std::erase_if(triangles, [&](const CellTriangle& t) { return cut->triangles[t.uncut].source == kNoIndex; });
    const std::optional<double> smallest =
        options.pieces_are_cells ? std::nullopt : std::optional<double>(options.smallest);
    const PartPieces parts = find_pieces(*cut, triangles, smallest, report.is_sheet);
    report.cells = parts.cells;
    report.islands = parts.islands;
    report.joined = parts.joined;
    FracturedMesh result =
        assemble_pieces(mesh, surface, *cut, *facets, cells, triangles, parts.piece, report.is_sheet, context);
    report.inside_faces = result.report.inside_faces;
    report.assemble_seconds = lap();
    if (!report.is_sheet) report.open_edges = count_open_edges(*cut, triangles, parts.piece);
    report_sizes(*cut, triangles, parts.piece, result.pieces, report);
    result.report = report;
    if (context.is_cancelled()) return cancelled_error();
    return result;
}

} // namespace

Result<FracturedMesh> fracture(const Mesh& mesh, const FractureCells& cells, const FractureOptions& options,
                               const RunContext& context) {
    if (mesh.face_count() == 0)
        return Error{ErrorCode::unsuitable, "The mesh has no faces: there is nothing to break."};
    Result<Surface> surface = make_surface(mesh, context);
    if (!surface) return surface.error();
    if (surface->triangles.empty())
        return Error{ErrorCode::unsuitable,
                     "No face of the mesh has three different corners: there is nothing to break."};
    CutReport report;
    const std::optional<Mesh> turned = turned_outwards(mesh, *surface, report.outward);
    if (turned) surface = make_surface(*turned, context);
    if (!surface) return surface.error();
    return fracture_outward(turned ? *turned : mesh, *surface, cells, options, std::move(report), context);
}

void explode(FracturedMesh& fractured, double distance) {
    Mesh& mesh = fractured.mesh;
    const Vec3d middle = bounds(mesh).centre();
    std::vector<Box> boxes(fractured.pieces);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        if (fractured.piece_of_vertex[v] != kNoIndex)
            boxes[fractured.piece_of_vertex[v]].extend(mesh.positions[v].cast<double>());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        if (const Index piece = fractured.piece_of_vertex[v]; piece != kNoIndex)
            mesh.positions[v] += (distance * (boxes[piece].centre() - middle)).cast<float>();
}

Mesh piece_mesh(const FracturedMesh& fractured, Index piece) {
    const Mesh& all = fractured.mesh;
    Mesh mesh;
    mesh.origin = all.origin;
    mesh.colors_have_alpha = all.colors_have_alpha;
    mesh.material_files = all.material_files;
    mesh.embedded_materials = all.embedded_materials;
    for (const VertexScalar& scalar : all.scalars) mesh.scalars.push_back({scalar.name, {}});
    std::vector<Index> renamed(all.vertex_count(), kNoIndex);
    for (std::size_t v = 0; v < all.vertex_count(); ++v) {
        if (fractured.piece_of_vertex[v] != piece) continue;
        renamed[v] = static_cast<Index>(mesh.positions.size());
        mesh.positions.push_back(all.positions[v]);
        if (!all.colors.empty()) mesh.colors.push_back(all.colors[v]);
        for (std::size_t k = 0; k < all.scalars.size(); ++k) mesh.scalars[k].values.push_back(all.scalars[k].values[v]);
    }
    const auto copy_corner = [](const auto& from, auto& to, Index corner) {
        if (from.empty()) return;
        const Index value = from.corners[corner];
        to.corners.push_back(value == kNoIndex ? kNoIndex : static_cast<Index>(to.values.size()));
        if (value != kNoIndex) to.values.push_back(from.values[value]);
    };
    mesh.materials.names = all.materials.names;
    for (std::size_t f = 0; f < all.face_count(); ++f) {
        if (fractured.piece_of_face[f] != piece) continue;
        std::vector<Index> corners;
        for (Index c = all.face_offsets[f]; c < all.face_offsets[f + 1]; ++c) {
            corners.push_back(renamed[all.corners[c]]);
            copy_corner(all.uvs, mesh.uvs, c);
            copy_corner(all.normals, mesh.normals, c);
        }
        mesh.add_face(corners);
        if (!all.materials.empty()) mesh.materials.of_face.push_back(all.materials.of_face[f]);
        if (!all.smoothing.empty()) mesh.smoothing.push_back(all.smoothing[f]);
    }
    return mesh;
}

} // namespace filigree
