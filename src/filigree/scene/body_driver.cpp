#include "filigree/scene/body_driver.h"

#include "filigree/core/text.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace filigree {

namespace {

/// Surface points for one driver vertex. There are about four to a square of one spacing, and a triangle mesh with
/// edges of 0.85 spacings has 1.6 vertices there.
constexpr double kSurfacePointsPerVertex = 2.7;
constexpr double kLongestEdgeMade = 1.2; ///< spacings
/// Times the driver's vertices: below, stripping saves less than it costs, as small meshes have edges of a spacing.
constexpr double kWorthStripping = 4;
/// Part of the mesh on long edges from which a driver is called too coarse: scraps and slivers are always there.
constexpr double kFewOnLongEdges = 0.05;
// Measured by scripts/bench-bodies on the example scenes: errors over kappa h^2 and kappa e^2.
constexpr double kSpacingError = 0.35, kDriverError = 0.115;

std::size_t default_base(const Body& body) {
    return std::max<std::size_t>(
        3, std::size_t(std::lround(double(body.surface.points.size()) / kSurfacePointsPerVertex)));
}

double default_max_edge(const Mesh& mesh, const Body& body) {
    return std::min(1.0, kLongestEdgeMade * body.spacing() / (body.scale * bounds(mesh).diagonal()));
}

/// For each of the driver's faces how many other vertices of the mesh hang on it: cells are the faces.
std::vector<std::size_t> vertices_on_faces(const Model& model) {
    std::vector<std::size_t> carried(model.driver().face_count(), 1);
    const BlendDetail& detail = model.detail;
    std::vector<bool> is_driver(model.mesh.vertex_count());
    for (const Index v : model.driver().vertices) is_driver[v] = true;
    for (std::size_t f = 0; f < carried.size(); ++f)
        carried[f] = std::size_t(std::count_if(detail.order.begin() + detail.cell_offsets[f],
                                               detail.order.begin() + detail.cell_offsets[f + 1],
                                               [&](Index v) { return !is_driver[v]; }));
    return carried;
}

} // namespace

StripOptions body_driver_options(const Mesh& mesh, const Body& body) {
    StripOptions options;
    options.base = default_base(body);
    if (double(mesh.vertex_count()) < kWorthStripping * double(*options.base))
        options.base = std::max<std::size_t>(3, mesh.vertex_count());
    else
        options.max_edge = default_max_edge(mesh, body);
    return options;
}

DriverEdges measure_driver(const Model& model, const Body& body) {
    const std::vector<Vec3f> positions = driver_positions(model);
    const Level& driver = model.driver();
    const std::vector<std::size_t> carried = vertices_on_faces(model);
    DriverEdges edges;
    double sum = 0;
    std::size_t hanging = 0, on_long_edges = 0;
    for (std::size_t f = 0; f < driver.face_count(); ++f) {
        const Index first = driver.face_offsets[f], last = driver.face_offsets[f + 1];
        double longest = 0;
        for (Index c = first; c < last; ++c) {
            const Index next = c + 1 < last ? c + 1 : first;
            const double edge = double((positions[driver.corners[c]] - positions[driver.corners[next]]).norm()) *
                                body.scale / body.spacing();
            longest = std::max(longest, edge);
            sum += edge;
        }
        edges.longest = std::max(edges.longest, longest);
        hanging += carried[f];
        on_long_edges += longest > kLongestDriverEdge ? carried[f] : 0;
    }
    if (!driver.corners.empty()) edges.mean = sum / double(driver.corners.size());
    if (hanging > 0) edges.on_long_edges = double(on_long_edges) / double(hanging);
    edges.carried = 1 - double(driver.vertices.size()) / double(std::max<std::size_t>(model.mesh.vertex_count(), 1));
    return edges;
}

std::optional<CoarseDriver> coarse_driver(const DriverEdges& edges, const Model& model, const Body& body) {
    if (edges.on_long_edges <= kFewOnLongEdges) return std::nullopt;
    return CoarseDriver{edges.on_long_edges, edges.longest, default_base(body), default_max_edge(model.mesh, body)};
}

std::string CoarseDriver::sentence() const {
    return fmt::format("{:.0f} % of the mesh hangs on driver triangles longer than {} spacings ({:.1f} at most), which "
                       "cannot follow the particles; a driver of about {} vertices does",
                       100 * on_long_edges, kLongestDriverEdge, longest, with_commas(base));
}

ExpectedError expected_error(const PoseSequence& poses, const DriverEdges& edges, const Model& model,
                             const Body& body) {
    const std::vector<Vec3f> rest = driver_positions(model);
    const Level& driver = model.driver();
    double sum = 0; // of the frames' kappa, 1/m
    for (std::size_t frame = 1; frame < poses.frames.size(); ++frame) {
        const std::vector<Mat3f>& gradients = poses.frames[frame].gradients;
        double squares = 0;
        std::size_t count = 0;
        for (std::size_t f = 0; f < driver.face_count(); ++f)
            for (Index c = driver.face_offsets[f]; c < driver.face_offsets[f + 1]; ++c) {
                const Index a = driver.corners[c],
                            b = driver.corners[c + 1 < driver.face_offsets[f + 1] ? c + 1 : driver.face_offsets[f]];
                const double length = body.scale * double((rest[a] - rest[b]).norm());
                if (length == 0) continue;
                const double change = double((gradients[a] - gradients[b]).norm()) / (body.scale * length);
                squares += change * change;
                ++count;
            }
        if (count > 0) sum += std::sqrt(squares / double(count));
    }
    if (poses.frames.size() < 2) return {};
    const double h = body.spacing(), diagonal = body.scale * bounds(model.mesh).diagonal();
    const double bend = sum / double(poses.frames.size() - 1) * h * h / diagonal;
    return {kSpacingError * bend, kDriverError * bend * edges.mean * edges.mean * edges.carried};
}

} // namespace filigree
