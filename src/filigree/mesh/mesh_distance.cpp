#include "filigree/core/math.h"
#include "filigree/mesh.h"
#include "filigree/mesh/measured_surface.h"

#include "filigree/core/parallel_for.h"
#include "filigree/core/random.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/normals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>

namespace filigree {

/// A mesh's triangles, in the frame of the mesh that it is measured against.
struct PlacedTriangles {
    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;
};

namespace {

constexpr std::size_t kMeshDistanceGrain = 1024; // queries a piece
constexpr std::size_t kBatch = 131072;           // queries between looks at the cancel flag
constexpr double kPercentile = 0.95;

/// Smallest value that at least `fraction` of all are not above; values is reordered and not empty.
double percentile(std::vector<double>& values, double fraction) {
    const auto rank = static_cast<std::ptrdiff_t>(std::ceil(fraction * double(values.size()))) - 1;
    const auto place = values.begin() + std::max<std::ptrdiff_t>(rank, 0);
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

double angle_deg(const Vec3d& a, const Vec3d& b) {
    return math::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi; // exact near 0, where acos is not
}

void compare_normals(std::span<const Vec3f> normals_a, std::span<const Vec3f> normals_b, VertexDistance& result) {
    std::vector<double> angles;
    angles.reserve(normals_a.size());
    for (std::size_t v = 0; v < normals_a.size(); ++v)
        if (!normals_a[v].isZero(0) && !normals_b[v].isZero(0))
            angles.push_back(angle_deg(normals_a[v].cast<double>(), normals_b[v].cast<double>()));
    if (angles.empty()) return;
    result.normal_mean_deg = std::accumulate(angles.begin(), angles.end(), 0.0) / double(angles.size());
    result.normal_max_deg = std::ranges::max(angles);
    result.normal_p95_deg = percentile(angles, kPercentile);
}

/// between_origins: a's less b's. World positions would lose the digits.
VertexDistance compare_positions(std::span<const Vec3f> a, std::span<const Vec3f> b, const Vec3d& between_origins) {
    VertexDistance result;
    result.per_vertex.reserve(a.size());
    double sum_of_squares = 0;
    for (std::size_t v = 0; v < a.size(); ++v) {
        const Vec3d offset = a[v].cast<double>() - b[v].cast<double>() + between_origins;
        const double distance = offset.norm();
        sum_of_squares += offset.squaredNorm();
        result.per_vertex.push_back(static_cast<float>(distance));
        if (result.max_vertex == kNoIndex || distance > result.max) {
            result.max = distance;
            result.max_vertex = static_cast<Index>(v);
        }
    }
    if (!a.empty()) result.rms = std::sqrt(sum_of_squares / double(a.size()));
    return result;
}

std::vector<Vec3f> shifted(std::vector<Vec3f> positions, const Vec3d& shift) {
    if (!shift.isZero(0))
        for (Vec3f& p : positions) p = (p.cast<double>() + shift).cast<float>();
    return positions;
}

std::optional<Error> either_mesh_error(const Mesh& a, const Mesh& b) {
    if (std::optional<Error> error = mesh_error(a, "The first mesh")) return error;
    return mesh_error(b, "The second mesh");
}

Result<PlacedTriangles> place_triangles(const Mesh& mesh, const Vec3d& shift, const RunContext& context) {
    Result<Triangulation> triangulation = triangulate(mesh, context);
    if (!triangulation) return triangulation.error();
    return PlacedTriangles{shifted(mesh.positions, shift), std::move(triangulation->triangles)};
}

/// The vertices of faces, then `count` points: one at random in each of as many equal shares of the area.
std::vector<Vec3f> sample_surface(const PlacedTriangles& surface, std::size_t count, std::uint64_t seed) {
    std::vector<std::uint8_t> used(surface.positions.size());
    for (const Triangle& triangle : surface.triangles)
        for (const Index vertex : triangle) used[vertex] = 1;
    std::vector<Vec3f> samples;
    for (std::size_t v = 0; v < used.size(); ++v)
        if (used[v]) samples.push_back(surface.positions[v]);

    const auto corner = [&](std::size_t t, std::size_t k) {
        return Vec3d(surface.positions[surface.triangles[t][k]].cast<double>());
    };
    std::vector<double> area_up_to(surface.triangles.size());
    double total = 0;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
        area_up_to[t] = total += (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).norm();
    if (total == 0) return samples; // no area to spread points over
    std::size_t t = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const double area = (double(i) + random_unit(seed, 3 * i)) / double(count) * total;
        while (t + 1 < area_up_to.size() && area_up_to[t] <= area) ++t;
        const double r = std::sqrt(random_unit(seed, 3 * i + 1)), s = random_unit(seed, 3 * i + 2);
        const Vec3d p = (1 - r) * corner(t, 0) + r * (1 - s) * corner(t, 1) + r * s * corner(t, 2);
        samples.push_back(p.cast<float>());
    }
    return samples;
}

/// The distances of `samples`, into `result`. The triangle that is closest to one sample bounds how far the next,
/// mostly its neighbour, has to search: up to a third less time, and the same distances to the bit.
void search_in_turn(std::span<const Vec3f> samples, const PlacedTriangles& to, const ClosestPointTree& tree,
                    std::span<double> result) {
    Index last = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const auto& [a, b, c] = to.triangles[last];
        const double bound =
            closest_point_on_triangle(samples[i], to.positions[a], to.positions[b], to.positions[c]).distance;
        const SurfacePoint found = tree.closest(samples[i], bound);
        if (found.triangle != kNoIndex) last = found.triangle;
        result[i] = std::min(found.distance, bound); // from very far out, the tree may find none within the bound
    }
}

/// The distance of every sample to a surface; fewer when cancelled.
std::vector<double> distances(std::span<const Vec3f> samples, const PlacedTriangles& to, const ClosestPointTree& tree,
                              const RunContext& context) {
    std::vector<double> result(samples.size());
    for (std::size_t done = 0; done < samples.size(); done += kBatch) {
        if (context.is_cancelled()) return {};
        context.report("measuring distances", double(done) / double(samples.size()));
        parallel_for(context, std::min(kBatch, samples.size() - done), kMeshDistanceGrain,
                     [&](std::size_t begin, std::size_t end) {
                         search_in_turn(samples.subspan(done + begin, end - begin), to, tree,
                                        std::span(result).subspan(done + begin, end - begin));
                     });
    }
    return result;
}

/// The same, with a tree for this alone.
std::vector<double> distances(std::span<const Vec3f> samples, const PlacedTriangles& to, const RunContext& context) {
    return distances(samples, to, ClosestPointTree(to.positions, to.triangles, context), context);
}

SurfaceDistance surface_distance(const std::vector<double>& there, const std::vector<double>& back) {
    SurfaceDistance result;
    double sum = 0, sum_of_squares = 0;
    const auto add = [&](const std::vector<double>& way, double& max, double& rms) {
        double squares = 0;
        for (const double distance : way) {
            max = std::max(max, distance);
            sum += distance;
            squares += distance * distance;
            sum_of_squares += distance * distance;
        }
        rms = std::sqrt(squares / std::max(1.0, double(way.size())));
    };
    add(there, result.max_a_to_b, result.rms_a_to_b);
    add(back, result.max_b_to_a, result.rms_b_to_a);
    const double count = std::max(1.0, double(there.size() + back.size()));
    result.mean_distance = sum / count;
    result.rms_distance = std::sqrt(sum_of_squares / count);
    result.hausdorff = std::max(result.max_a_to_b, result.max_b_to_a);
    return result;
}

} // namespace

Result<VertexDistance> vertex_distance(const Mesh& a, const Mesh& b, const RunContext& context) {
    if (std::optional<Error> error = either_mesh_error(a, b)) return *error;
    if (a.vertex_count() != b.vertex_count())
        return Error{ErrorCode::mismatch, "The meshes have " + std::to_string(a.vertex_count()) + " and " +
                                              std::to_string(b.vertex_count()) +
                                              " vertices; vertex by vertex, only meshes with as many can be compared."};
    VertexDistance result = compare_positions(a.positions, b.positions, a.origin - b.origin);
    compare_normals(vertex_normals(a, a.positions, context), vertex_normals(b, b.positions, context), result);
    return result;
}

VertexDistance vertex_distance(const Mesh& mesh, std::span<const Vec3f> a, std::span<const Vec3f> b,
                               const RunContext& context) {
    assert(a.size() == mesh.vertex_count() && b.size() == mesh.vertex_count());
    VertexDistance result = compare_positions(a, b, Vec3d::Zero());
    compare_normals(vertex_normals(mesh, a, context), vertex_normals(mesh, b, context), result);
    return result;
}

struct MeasuredSurface::Content {
    PlacedTriangles surface;
    Vec3d origin;
    std::size_t sample_count;
    std::vector<Vec3f> samples;
    std::optional<ClosestPointTree> tree; ///< made when it is asked for the first time
};

MeasuredSurface::MeasuredSurface(std::unique_ptr<Content> content) : content_(std::move(content)) {}
MeasuredSurface::MeasuredSurface(MeasuredSurface&&) noexcept = default;
MeasuredSurface& MeasuredSurface::operator=(MeasuredSurface&&) noexcept = default;
MeasuredSurface::~MeasuredSurface() = default;

Result<MeasuredSurface> MeasuredSurface::create(const Mesh& mesh, std::size_t samples, const RunContext& context) {
    Result<PlacedTriangles> placed = place_triangles(mesh, Vec3d::Zero(), context);
    if (!placed) return placed.error();
    auto content = std::make_unique<Content>();
    content->surface = std::move(*placed);
    content->origin = mesh.origin;
    content->sample_count = samples;
    content->samples = sample_surface(content->surface, samples, context.seed);
    return MeasuredSurface(std::move(content));
}

Result<SurfaceDistance> MeasuredSurface::distance_of(const Mesh& other, const RunContext& context) {
    Content& own = *content_;
    const Result<PlacedTriangles> placed = place_triangles(other, other.origin - own.origin, context);
    if (!placed) return placed.error();
    const std::vector<Vec3f> samples = sample_surface(*placed, own.sample_count, context.seed);
    if (!own.tree) own.tree.emplace(own.surface.positions, own.surface.triangles, context);
    const std::vector<double> there = distances(samples, own.surface, *own.tree, context);
    const std::vector<double> back = distances(own.samples, *placed, context);
    if (context.is_cancelled()) return cancelled_error();
    return surface_distance(there, back);
}

Result<MeshDistance> mesh_distance(const Mesh& a, const Mesh& b, std::size_t samples, const RunContext& context) {
    if (std::optional<Error> error = either_mesh_error(a, b)) return *error;
    MeshDistance result;
    result.diagonal = bounds(b).diagonal();
    if (a.vertex_count() == b.vertex_count()) result.vertices = vertex_distance(a, b, context).value();
    if (a.face_count() > 0 && b.face_count() > 0) {
        Result<MeasuredSurface> surface = MeasuredSurface::create(b, samples, context);
        if (!surface) return surface.error();
        Result<SurfaceDistance> surfaces = surface->distance_of(a, context);
        if (!surfaces) return surfaces.error();
        result.surfaces = *surfaces;
    }
    if (context.is_cancelled()) return cancelled_error();
    return result;
}

Result<std::vector<float>> distances_to_surface(const Mesh& a, const Mesh& b, const RunContext& context) {
    if (std::optional<Error> error = either_mesh_error(a, b)) return *error;
    if (b.face_count() == 0)
        return Error{ErrorCode::unsuitable, "The mesh to measure against has no faces; give one with a surface."};
    const Result<PlacedTriangles> surface = place_triangles(b, Vec3d::Zero(), context);
    if (!surface) return surface.error();
    const std::vector<double> found = distances(shifted(a.positions, a.origin - b.origin), *surface, context);
    if (context.is_cancelled()) return cancelled_error();
    return std::vector<float>(found.begin(), found.end());
}

Result<std::vector<float>> edge_strains(const Mesh& a, const Mesh& rest) {
    if (std::optional<Error> error = either_mesh_error(a, rest)) return *error;
    if (a.vertex_count() != rest.vertex_count() || a.face_offsets != rest.face_offsets || a.corners != rest.corners)
        return Error{ErrorCode::mismatch, "Strain is measured between two poses of one mesh, and these two do not have "
                                          "the same vertices and faces."};
    std::vector<double> sums(a.vertex_count());
    std::vector<Index> counts(a.vertex_count());
    for (std::size_t f = 0; f < a.face_count(); ++f) {
        const std::span<const Index> corners = a.face(f);
        for (std::size_t k = 0; k < corners.size(); ++k) {
            const Index i = corners[k], j = corners[(k + 1) % corners.size()];
            const double before = (rest.positions[i] - rest.positions[j]).cast<double>().norm();
            if (!(before > 0)) continue;
            const double change = std::abs((a.positions[i] - a.positions[j]).cast<double>().norm() / before - 1);
            for (const Index v : {i, j}) {
                sums[v] += change;
                ++counts[v];
            }
        }
    }
    std::vector<float> strains(sums.size());
    for (std::size_t v = 0; v < sums.size(); ++v)
        strains[v] = counts[v] ? static_cast<float>(sums[v] / counts[v]) : 0.0f;
    return strains;
}

} // namespace filigree
