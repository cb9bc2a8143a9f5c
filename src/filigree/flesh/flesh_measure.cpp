// Volumes, overlaps and distances of flesh beside its skin.
#include "filigree/core/parallel_for.h"
#include "filigree/flesh.h"
#include "filigree/sample.h"
#include "filigree/sample/winding_tree.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace filigree {

namespace {

constexpr double kOverlapStep = 0.5; ///< spacings, between the points that are looked at for overlaps
constexpr double kTwice = 1.5;       ///< winding number
constexpr double kAccuracy = 0.05;   ///< of winding numbers

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

/// Volume that is enclosed twice or more, model units.
Result<double> overlap_of(std::span<const Vec3f> positions, std::span<const Triangle> triangles, double step,
                          const RunContext& context) {
    const Result<WindingTree> tree = WindingTree::create(positions, triangles, kAccuracy, context);
    if (!tree) return tree.error();
    Box box;
    for (const Triangle& t : triangles)
        for (const Index v : t) box.extend(positions[v].cast<double>());
    const Result<Lattice> lattice = make_lattice(box, {.spacing = step});
    if (!lattice) return 0.0; // flat
    const auto [nx, ny, nz] = lattice->counts();
    std::vector<std::size_t> twice(ny * nz);
    parallel_for(context, twice.size(), 4, [&, nx = nx, ny = ny](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end && !context.is_cancelled(); ++row)
            for (std::size_t i = 0; i < nx; ++i)
                twice[row] += std::abs(tree->winding(lattice->point(i, row % ny, row / ny))) > kTwice;
    });
    if (context.is_cancelled()) return cancelled_error();
    return double(std::accumulate(twice.begin(), twice.end(), std::size_t{0})) * step * step * step;
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
    measure.least_volume = measure.skin_least_volume = 1e9;
    measure.most_volume = measure.skin_most_volume = -1e9;
    double bind = 0;
    if (overlap_frames > 0) {
        const Result<double> found = overlap_of(flesh.surface().positions, triangles, step, context);
        if (!found) return found.error();
        bind = *found;
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
        const double now = volume_of(soft, triangles) / rest, of_skin = volume_of(plain, triangles) / rest;
        measure.least_volume = std::min(measure.least_volume, now);
        measure.most_volume = std::max(measure.most_volume, now);
        measure.skin_least_volume = std::min(measure.skin_least_volume, of_skin);
        measure.skin_most_volume = std::max(measure.skin_most_volume, of_skin);
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
            const Result<double> found = overlap_of(*positions, triangles, step, context);
            if (!found) return found.error();
            *overlap = std::max(*overlap, (*found - bind) / std::abs(rest));
        }
    }
    return measure;
}

} // namespace filigree
