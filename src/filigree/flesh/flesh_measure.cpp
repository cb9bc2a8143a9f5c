// Volumes, overlaps and distances of flesh beside its skin.
#include "filigree/core/parallel_for.h"
#include "filigree/flesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

namespace filigree {

namespace {

constexpr double kLeastVolume = 1e-4;  ///< of the diagonal's cube: an open surface of less encloses nothing
constexpr double kOverlapStep = 0.125; ///< spacings, between the lines that are looked at for overlaps

/// Of the cones from a point near by, so that it keeps its digits.
double volume_of(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
    if (triangles.empty()) return 0;
    const Vec3d from = positions[triangles[0][0]].cast<double>();
    double sum = 0;
    for (const auto& [a, b, c] : triangles)
        sum += (positions[a].cast<double>() - from)
                   .dot((positions[b].cast<double>() - from).cross(positions[c].cast<double>() - from));
    return sum / 6;
}

/// Where a line goes through the surface.
struct Crossing {
    std::uint32_t line;
    float at;
    std::int8_t in; ///< 1: inwards, -1: out
};

/// Volume that is enclosed twice or more, model units: the mean of three sums, each over lines along an axis, so far
/// apart as step. Exact along a line. Lines that end inside, as through the holes of an open surface, count nothing.
double overlap_of(std::span<const Vec3f> positions, std::span<const Triangle> triangles, double step,
                  const RunContext& context) {
    Box box;
    for (const Triangle& t : triangles)
        for (const Index v : t) box.extend(positions[v].cast<double>());
    std::array<double, 3> sums{};
    parallel_for(context, 3, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t axis = begin; axis < end; ++axis) {
            const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
            // Between the lines of anything regular.
            const double first_u = box.min[u] + 0.4142 * step, first_v = box.min[v] + 0.7321 * step;
            const auto count = [&](std::size_t k) { return std::size_t(box.size()[k] / step) + 1; };
            const std::size_t lines_u = count(u), lines_v = count(v);
            std::vector<Crossing> crossings;
            for (const Triangle& t : triangles) {
                if (context.is_cancelled()) return;
                std::array<Vec3d, 3> p; // u, v, along
                for (int k = 0; k < 3; ++k) {
                    const Vec3d q = positions[t[k]].cast<double>();
                    p[k] = {q[u], q[v], q[axis]};
                }
                const auto cross = [](const Vec3d& a, const Vec3d& b, double x, double y) {
                    return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
                };
                const double area = cross(p[0], p[1], p[2].x(), p[2].y());
                if (area == 0) continue;
                // On an edge, a line goes through one of its two triangles.
                const auto is_left = [&](const Vec3d& a, const Vec3d& b, double x, double y) {
                    const bool forth = a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
                    return forth ? cross(a, b, x, y) >= 0 : cross(b, a, x, y) < 0;
                };
                const auto range = [&](int k, double first, std::size_t lines) {
                    const auto [low, high] = std::minmax({p[0][k], p[1][k], p[2][k]});
                    const auto from = std::max(0.0, std::ceil((low - first) / step));
                    const auto to = std::min(double(lines), std::floor((high - first) / step) + 1);
                    return std::array{std::size_t(from), std::size_t(std::max(from, to))};
                };
                const auto [i0, i1] = range(0, first_u, lines_u);
                const auto [j0, j1] = range(1, first_v, lines_v);
                for (std::size_t j = j0; j < j1; ++j)
                    for (std::size_t i = i0; i < i1; ++i) {
                        const double x = first_u + double(i) * step, y = first_v + double(j) * step;
                        const bool left = is_left(p[0], p[1], x, y);
                        if (is_left(p[1], p[2], x, y) != left || is_left(p[2], p[0], x, y) != left) continue;
                        if (left != (area > 0)) continue;
                        const double b1 = cross(p[2], p[0], x, y) / area, b2 = cross(p[0], p[1], x, y) / area;
                        const double at = p[0].z() + b1 * (p[1].z() - p[0].z()) + b2 * (p[2].z() - p[0].z());
                        crossings.push_back({std::uint32_t(i + j * lines_u), float(at), std::int8_t(left ? -1 : 1)});
                    }
            }
            std::ranges::sort(crossings, [](const Crossing& a, const Crossing& b) {
                return std::tuple(a.line, a.at, -a.in) < std::tuple(b.line, b.at, -b.in);
            });
            for (std::size_t k = 0; k < crossings.size();) {
                int depth = 0;
                double twice = 0;
                std::size_t next = k;
                for (; next < crossings.size() && crossings[next].line == crossings[k].line; ++next) {
                    if (std::abs(depth) > 1) twice += double(crossings[next].at) - double(crossings[next - 1].at);
                    depth += crossings[next].in;
                }
                if (depth == 0) sums[axis] += twice;
                k = next;
            }
        }
    });
    return (sums[0] + sums[1] + sums[2]) / 3 * step * step;
}

bool is_closed(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
    std::map<std::array<float, 3>, Index> places;
    std::vector<Index> at(positions.size());
    for (const Triangle& t : triangles)
        for (const Index v : t)
            at[v] = places.try_emplace({positions[v].x(), positions[v].y(), positions[v].z()}, Index(places.size()))
                        .first->second;
    std::map<std::pair<Index, Index>, int> edges;
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) {
            const Index a = at[t[k]], b = at[t[(k + 1) % 3]];
            if (a != b) edges[std::minmax(a, b)] += a < b ? 1 : -1;
        }
    return std::ranges::all_of(edges, [](const auto& edge) { return edge.second == 0; });
}

} // namespace

Result<FleshMeasure> measure_flesh(const Flesh& flesh, const FleshClip& clip, std::size_t overlap_frames,
                                   const RunContext& context) {
    const SkinnedMesh& skin = flesh.skin();
    const std::size_t count = skin.mesh.vertex_count();
    std::vector<Index> all(count);
    std::iota(all.begin(), all.end(), Index{0});
    Result<FleshCarrier> carrier = FleshCarrier::create(flesh, all, context);
    if (!carrier) return carrier.error();
    const Result<Triangulation> cut = triangulate(flesh.surface(), context);
    if (!cut) return cut.error();
    const std::span<const Triangle> triangles = cut->triangles;
    std::vector<Vec3f> soft(count), plain(count);
    const double rest = volume_of(flesh.surface().positions, triangles);
    const double diagonal = bounds(flesh.surface()).diagonal();
    const double step = kOverlapStep * flesh.body()->spacing() / flesh.scale();
    FleshMeasure measure;
    measure.is_closed = is_closed(flesh.surface().positions, triangles);
    const bool has_volume = measure.is_closed || std::abs(rest) > kLeastVolume * diagonal * diagonal * diagonal;
    if (has_volume) {
        measure.least_volume = measure.skin_least_volume = 1e9;
        measure.most_volume = measure.skin_most_volume = -1e9;
    }
    if (!has_volume) overlap_frames = 0;
    double bind = 0;
    if (overlap_frames > 0) {
        bind = overlap_of(flesh.surface().positions, triangles, step, context);
        measure.bind_overlap = bind / std::abs(rest);
    }
    const std::size_t frames = clip.frames.size();
    const std::size_t every = overlap_frames > 0 ? std::max<std::size_t>(1, frames / overlap_frames) : frames;
    for (std::size_t frame = 0; frame < frames; ++frame) {
        if (context.is_cancelled()) return cancelled_error();
        context.report("measuring '" + clip.name + "'", double(frame) / double(frames));
        carrier->at(clip, frame, soft, {}, context);
        const double seconds = std::min(double(frame) / clip.frames_per_second, skin.clips[clip.clip].seconds);
        if (Status placed = clip_positions(skin, clip.clip, seconds, plain, context); !placed) return placed.error();
        if (has_volume) {
            const double now = volume_of(soft, triangles) / rest, of_skin = volume_of(plain, triangles) / rest;
            measure.least_volume = std::min(measure.least_volume, now);
            measure.most_volume = std::max(measure.most_volume, now);
            measure.skin_least_volume = std::min(measure.skin_least_volume, of_skin);
            measure.skin_most_volume = std::max(measure.skin_most_volume, of_skin);
        }
        for (std::size_t v = 0; v < count; ++v) {
            if (flesh.left_out()[v]) continue;
            const double way = double((soft[v] - plain[v]).norm()) / diagonal;
            if (!(way > measure.furthest)) continue;
            measure.furthest = way;
            measure.furthest_frame = frame;
            const SkinWeights& w = skin.weights;
            Index most = w.first[v];
            for (Index i = w.first[v]; i < w.first[v + 1]; ++i)
                if (w.weights[i] > w.weights[most]) most = i;
            measure.furthest_joint = w.joints[most];
        }
        if (overlap_frames == 0 || frame % every != every / 2) continue;
        for (const auto& [positions, overlap] :
             {std::pair(&soft, &measure.overlap), std::pair(&plain, &measure.skin_overlap)}) {
            const double found = overlap_of(*positions, triangles, step, context);
            *overlap = std::max(*overlap, (found - bind) / std::abs(rest));
        }
    }
    return measure;
}

} // namespace filigree
