#include "filigree/physics/body.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/sample.h"
#include "filigree/sample/closure.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace filigree {

namespace {

constexpr int kBandMargin = 3; // spacings around the box, and as far from the surface distances are exact
constexpr double kMostPoints = 0x1p27;

std::string short_number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", x);
    return text;
}

/// The points of a regular grid, x fastest.
struct DistanceGrid {
    Vec3d corner = Vec3d::Zero();
    double spacing = 0;
    std::array<std::size_t, 3> counts = {};

    std::size_t size() const { return counts[0] * counts[1] * counts[2]; }
    std::size_t index(std::size_t i, std::size_t j, std::size_t k) const { return (k * counts[1] + j) * counts[0] + i; }
    Vec3d point(std::size_t i, std::size_t j, std::size_t k) const {
        return corner + spacing * Vec3d(double(i), double(j), double(k));
    }
};

/// 1 for points within kBandMargin steps, along each axis, of the box of grid cubes around some part of a triangle.
std::vector<std::uint8_t> find_band(const DistanceGrid& grid, std::span<const Vec3f> positions,
                                    std::span<const Triangle> triangles) {
    std::vector<std::uint8_t> band(grid.size(), 0);
    const auto place = [&](double x, int axis) {
        return std::size_t(
            std::clamp(std::floor((x - grid.corner[axis]) / grid.spacing), 0.0, double(grid.counts[axis] - 1)));
    };
    // Large triangles are halved until they fit into a few cubes.
    std::vector<std::array<Vec3d, 3>> parts;
    for (const Triangle& triangle : triangles) {
        parts.push_back({positions[triangle[0]].cast<double>(), positions[triangle[1]].cast<double>(),
                         positions[triangle[2]].cast<double>()});
        while (!parts.empty()) {
            const std::array<Vec3d, 3> part = parts.back();
            parts.pop_back();
            int longest = 0;
            double length = 0;
            for (int side = 0; side < 3; ++side)
                if (const double l = (part[(side + 1) % 3] - part[side]).norm(); l > length) {
                    length = l;
                    longest = side;
                }
            if (length > 2 * grid.spacing) {
                const Vec3d a = part[longest], b = part[(longest + 1) % 3], c = part[(longest + 2) % 3];
                const Vec3d middle = 0.5 * (a + b);
                parts.push_back({a, middle, c});
                parts.push_back({middle, b, c});
                continue;
            }
            Box box;
            for (const Vec3d& corner : part) box.extend(corner);
            for (std::size_t k = place(box.min[2], 2); k <= place(box.max[2], 2); ++k)
                for (std::size_t j = place(box.min[1], 1); j <= place(box.max[1], 1); ++j)
                    for (std::size_t i = place(box.min[0], 0); i <= place(box.max[0], 0); ++i)
                        band[grid.index(i, j, k)] = 1;
        }
    }
    // A mark is a cube's lowest corner: spread it from kBandMargin - 1 below to kBandMargin above, axis by axis.
    const std::array<std::size_t, 3> strides = {1, grid.counts[0], grid.counts[0] * grid.counts[1]};
    for (int axis = 0; axis < 3; ++axis) {
        const std::vector<std::uint8_t> before = band;
        const std::size_t stride = strides[axis];
        for (std::size_t p = 0; p < band.size(); ++p) {
            if (!before[p]) continue;
            const std::size_t at = p / stride % grid.counts[axis];
            const std::size_t down = std::min<std::size_t>(at, kBandMargin - 1);
            const std::size_t up = std::min<std::size_t>(grid.counts[axis] - 1 - at, kBandMargin);
            for (std::size_t n = p - down * stride; n <= p + up * stride; n += stride) band[n] = 1;
        }
    }
    return band;
}

/// For points outside the band the best of the closest points that their neighbours have, swept over the grid in all
/// eight directions [Danielsson 1980]: distances to points of the surface, so never too small, and hardly too large.
class Spreader {
public:
    Spreader(const DistanceGrid& grid, std::vector<Vec3f>& closest, std::vector<float>& distances)
        : grid_(grid), closest_(closest), distances_(distances) {}

    void sweep(bool down_x, bool down_y, bool down_z) {
        const auto [nx, ny, nz] = grid_.counts;
        const auto dx = std::ptrdiff_t(1), dy = std::ptrdiff_t(nx), dz = std::ptrdiff_t(nx * ny);
        for (std::size_t c = 0; c < nz; ++c)
            for (std::size_t b = 0; b < ny; ++b)
                for (std::size_t a = 0; a < nx; ++a) {
                    const std::size_t i = down_x ? nx - 1 - a : a, j = down_y ? ny - 1 - b : b;
                    const std::size_t k = down_z ? nz - 1 - c : c;
                    const auto p = std::ptrdiff_t(grid_.index(i, j, k));
                    const Vec3f point = grid_.point(i, j, k).cast<float>();
                    if (a > 0) take(p, p + (down_x ? dx : -dx), point);
                    if (b > 0) take(p, p + (down_y ? dy : -dy), point);
                    if (c > 0) take(p, p + (down_z ? dz : -dz), point);
                }
    }

private:
    void take(std::ptrdiff_t to, std::ptrdiff_t from, const Vec3f& point) {
        if (!(distances_[from] < std::numeric_limits<float>::infinity())) return;
        const float distance = (closest_[from] - point).norm();
        if (distance >= distances_[to]) return;
        distances_[to] = distance;
        closest_[to] = closest_[from];
    }

    const DistanceGrid& grid_;
    std::vector<Vec3f>& closest_;
    std::vector<float>& distances_;
};

/// The grid around a box, all in model units.
Result<DistanceGrid> make_distance_grid(const Box& box, double spacing, double scale) {
    DistanceGrid grid;
    grid.spacing = spacing;
    double points = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const double cubes = std::ceil(box.size()[axis] / spacing) + 2 * kBandMargin;
        points *= cubes + 1;
        grid.counts[axis] = std::size_t(std::min(cubes + 1, 1e9));
        grid.corner[axis] = box.centre()[axis] - 0.5 * cubes * spacing;
    }
    const std::size_t most = *std::max_element(grid.counts.begin(), grid.counts.end());
    if (points > kMostPoints || most > 65534) {
        const double coarser = std::max(math::cbrt(points / kMostPoints), double(most) / 65534);
        return Error{ErrorCode::unsuitable, "A distance field with a spacing of " + short_number(spacing * scale) +
                                                " m has more than 2^27 points; give at least " +
                                                short_number(1.05 * coarser * spacing * scale) + " m."};
    }
    return grid;
}

} // namespace

Result<DistanceField> DistanceField::create(const Mesh& mesh, double scale, double spacing, const RunContext& context,
                                            OutwardReport* outward) {
    if (!std::isfinite(scale) || scale <= 0)
        return Error{ErrorCode::usage, "The scale is " + short_number(scale) + "; give metres a model unit, above 0."};
    if (!std::isfinite(spacing) || spacing < 0)
        return Error{ErrorCode::usage,
                     "The spacing is " + short_number(spacing) + "; give metres, above 0 (or 0 to have it chosen)."};
    Result<WeldedTriangles> welded_triangles = weld_triangles(mesh, context);
    if (!welded_triangles) return welded_triangles.error();
    WeldedTriangles welded = *std::move(welded_triangles);
    if (outward) *outward = welded.outward;
    const bool has_inside = !welded.triangles.empty();
    if (!has_inside) { // faces that are all there twice enclose nothing, and are there
        Result<Surface> surface = make_surface(mesh, context);
        if (!surface) return surface.error();
        welded.triangles = std::move(surface->triangles);
    }
    if (welded.triangles.empty())
        return Error{ErrorCode::unsuitable, "The mesh has no faces with an area, so nothing has a distance from it."};
    Box box;
    for (const Triangle& triangle : welded.triangles)
        for (const Index v : triangle) box.extend(mesh.positions[v].cast<double>());
    const double longest = box.size().maxCoeff();
    if (!(longest * scale > 1e-9) || longest * scale > 1e9)
        return Error{ErrorCode::usage, "With a scale of " + short_number(scale) + " the mesh is " +
                                           short_number(longest * scale) +
                                           " m long; give a scale that makes it 1e-9 to 1e9 m."};
    const Result<DistanceGrid> made = make_distance_grid(box, spacing > 0 ? spacing / scale : longest / 64, scale);
    if (!made) return made.error();
    const DistanceGrid& grid = *made;

    const std::vector<std::uint8_t> band = find_band(grid, mesh.positions, welded.triangles);
    std::vector<float> distances(grid.size(), std::numeric_limits<float>::infinity());
    std::vector<Vec3f> closest(grid.size());
    const ClosestPointTree tree(mesh.positions, welded.triangles, context);
    parallel_for(context, grid.counts[1] * grid.counts[2], 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end && !context.is_cancelled(); ++row)
            for (std::size_t i = 0; i < grid.counts[0]; ++i) {
                const std::size_t p = row * grid.counts[0] + i;
                if (!band[p]) continue;
                const Vec3d point = grid.point(i, row % grid.counts[1], row / grid.counts[1]);
                // No further than its neighbour's and one step; which makes the search short.
                double reach = std::numeric_limits<double>::infinity();
                if (i > 0 && band[p - 1]) reach = 1.001 * (distances[p - 1] + grid.spacing);
                const SurfacePoint found = tree.closest(point.cast<float>(), reach);
                distances[p] = float(found.distance);
                closest[p] = found.position;
            }
    });
    if (context.is_cancelled()) return cancelled_error();
    Spreader spreader(grid, closest, distances);
    for (int sweep = 0; sweep < 8; ++sweep) spreader.sweep(sweep & 1, sweep & 2, sweep & 4);

    Lattice lattice;
    lattice.spacing = grid.spacing;
    for (int axis = 0; axis < 3; ++axis)
        for (std::size_t i = 0; i < grid.counts[axis]; ++i)
            lattice.coordinates[axis].push_back(grid.corner[axis] + double(i) * grid.spacing);
    const Result<InsideSampler> sampler =
        InsideSampler::create(mesh.positions, welded, {.overlap = Overlap::merged}, context);
    if (!sampler) return sampler.error();
    const Result<Occupancy> inside = sampler->inside(lattice, context);
    if (!inside) return inside.error();

    DistanceField field;
    field.spacing_ = float(grid.spacing * scale);
    field.corner_ = (grid.corner * scale).cast<float>();
    field.counts_ = grid.counts;
    field.box_.min = grid.corner * scale;
    field.box_.max = grid.point(grid.counts[0] - 1, grid.counts[1] - 1, grid.counts[2] - 1) * scale;
    for (std::size_t k = 0; k < grid.counts[2]; ++k)
        for (std::size_t j = 0; j < grid.counts[1]; ++j)
            for (std::size_t i = 0; i < grid.counts[0]; ++i) {
                float& distance = distances[grid.index(i, j, k)];
                distance = float(distance * scale);
                if (has_inside && inside->contains(i, j, k)) distance = -distance;
            }
    field.distances_ = std::move(distances);
    return field;
}

void DistanceField::cut(const DistanceField& other, float radius) {
    std::size_t at = 0;
    for (std::size_t k = 0; k < counts_[2]; ++k)
        for (std::size_t j = 0; j < counts_[1]; ++j)
            for (std::size_t i = 0; i < counts_[0]; ++i, ++at) {
                const Vec3f point = corner_ + spacing_ * Vec3f(float(i), float(j), float(k));
                distances_[at] = std::max(distances_[at], other.at(point).distance - radius);
            }
}

float DistanceField::distance(const Vec3f& point) const {
    const Vec3f low = box_.min.cast<float>(), high = box_.max.cast<float>();
    const Vec3f within = point.cwiseMax(low).cwiseMin(high), x = (within - corner_) * (1 / spacing_);
    std::size_t cube[3];
    float t[3];
    for (int axis = 0; axis < 3; ++axis) {
        const float last = float(counts_[axis] - 2), whole = std::min(x[axis] > 0 ? x[axis] : 0.0f, last);
        cube[axis] = std::size_t(std::int32_t(whole));
        t[axis] = std::min(x[axis] - float(std::int32_t(whole)), 1.0f);
    }
    const std::size_t dy = counts_[0], dz = counts_[0] * counts_[1];
    const float* d = &distances_[cube[2] * dz + cube[1] * dy + cube[0]];
    const auto mix = [](float a, float b, float s) { return a + s * (b - a); };
    const float y0 = mix(mix(d[0], d[1], t[0]), mix(d[dy], d[dy + 1], t[0]), t[1]);
    const float y1 = mix(mix(d[dz], d[dz + 1], t[0]), mix(d[dz + dy], d[dz + dy + 1], t[0]), t[1]);
    const float inside = mix(y0, y1, t[2]), beyond = (point - within).squaredNorm();
    if (beyond == 0) return inside;
    const float way = std::sqrt(beyond);
    return std::max(way, inside - way);
}

DistanceField::Sample DistanceField::at(const Vec3f& point) const {
    const Vec3f up = Vec3f::UnitY();
    if (!point.allFinite()) return {std::numeric_limits<float>::infinity(), up};
    const Vec3f low = box_.min.cast<float>(), high = box_.max.cast<float>();
    const Vec3f within = point.cwiseMax(low).cwiseMin(high);
    std::array<std::size_t, 3> cube;
    Vec3f t;
    for (int axis = 0; axis < 3; ++axis) {
        const float x = std::max(0.0f, (within[axis] - corner_[axis]) / spacing_);
        cube[axis] = std::min(std::size_t(x), counts_[axis] - 2);
        t[axis] = std::min(x - float(cube[axis]), 1.0f);
    }
    const std::size_t dy = counts_[0], dz = counts_[0] * counts_[1];
    const float* d = &distances_[cube[2] * dz + cube[1] * dy + cube[0]];
    const auto mix = [](float a, float b, float s) { return a + s * (b - a); };
    const float x00 = mix(d[0], d[1], t.x()), x10 = mix(d[dy], d[dy + 1], t.x());
    const float x01 = mix(d[dz], d[dz + 1], t.x()), x11 = mix(d[dy + dz], d[dy + dz + 1], t.x());
    const float y0 = mix(x00, x10, t.y()), y1 = mix(x01, x11, t.y());
    const float slope_x = mix(mix(d[1] - d[0], d[dy + 1] - d[dy], t.y()),
                              mix(d[dz + 1] - d[dz], d[dy + dz + 1] - d[dy + dz], t.y()), t.z());
    const Vec3f slope(slope_x, mix(x10 - x00, x11 - x01, t.z()), y1 - y0);

    Sample sample{mix(y0, y1, t.z()), up};
    const float length = slope.norm();
    if (length > 1e-6f * spacing_) sample.normal = slope / length;
    if (const Vec3f beyond = point - within; !beyond.isZero(0)) {
        // As from the surface point that the grid's border is nearest to.
        const Vec3f away = std::max(sample.distance, 0.0f) * sample.normal + beyond;
        const float way = beyond.stableNorm();
        sample.distance = std::max(way, sample.distance - way);
        if (const float far = away.stableNorm(); far > 0) sample.normal = away / far;
    }
    return sample;
}

} // namespace filigree
