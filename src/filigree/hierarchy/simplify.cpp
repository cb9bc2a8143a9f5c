// Based on: quadric error metrics [Garland 1997], as meshoptimizer implements them. It counts triangles; we want
// vertices, so the triangle target is corrected by the ratio reached. Where it gets stuck (many small parts,
// non-manifold places), small parts are dropped first, and what is still too much is clustered.
#include "filigree/hierarchy/simplify.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <meshoptimizer.h>

namespace filigree {

namespace {

std::size_t count_vertices(std::span<const Triangle> triangles, std::vector<Index>& last_seen, Index& stamp) {
    ++stamp;
    std::size_t count = 0;
    for (const Triangle& t : triangles)
        for (Index v : t) {
            count += last_seen[v] != stamp;
            last_seen[v] = stamp;
        }
    return count;
}

/// meshoptimizer's two simplifiers over the same arrays, with vertices counted after each call.
class Collapser {
public:
    Collapser(std::span<const Vec3f> positions, Simplified start)
        : positions_(positions), current_(std::move(start)), last_seen_(positions.size(), 0),
          // meshoptimizer measures relative to the box's longest side, we relative to its diagonal
          to_diagonal_(bounds(positions).diagonal() > 0
                           ? bounds(positions).size().maxCoeff() / bounds(positions).diagonal()
                           : 1) {
        recount();
    }

    Simplified& current() { return current_; }

    void collapse(std::size_t target_triangles, double max_error) {
        std::vector<Triangle> out(current_.triangles.size());
        float error = 0;
        const std::size_t indices =
            meshopt_simplify(out.data()->data(), current_.triangles.data()->data(), current_.triangles.size() * 3,
                             positions_.data()->data(), positions_.size(), sizeof(Vec3f), target_triangles * 3,
                             static_cast<float>(std::min(max_error / to_diagonal_, 1e6)), 0, &error);
        accept(std::move(out), indices / 3, error);
    }

    void cluster(std::size_t target_triangles) {
        std::vector<Triangle> out(current_.triangles.size());
        float error = 0;
        const std::size_t indices = meshopt_simplifySloppy(
            out.data()->data(), current_.triangles.data()->data(), current_.triangles.size() * 3,
            positions_.data()->data(), positions_.size(), sizeof(Vec3f), target_triangles * 3, 1e6f, &error);
        current_.clustered = true;
        accept(std::move(out), indices / 3, error);
    }

    void replace(std::vector<Triangle> triangles) {
        current_.triangles = std::move(triangles);
        current_.clustered = true;
        recount();
    }

private:
    void accept(std::vector<Triangle> out, std::size_t count, float error) {
        if (count == 0) return; // a driver needs something to hang on
        out.resize(count);
        current_.triangles = std::move(out);
        current_.error = std::max(current_.error, error * to_diagonal_);
        recount();
    }
    void recount() { current_.vertex_count = count_vertices(current_.triangles, last_seen_, stamp_); }

    std::span<const Vec3f> positions_;
    Simplified current_;
    std::vector<Index> last_seen_;
    Index stamp_ = 0;
    double to_diagonal_;
};

/// The parts with the largest area that together have at most `vertices` vertices; always the largest one.
std::vector<Triangle> largest_parts(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                    std::size_t vertices) {
    std::vector<Index> parent(positions.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](Index v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const Triangle& t : triangles)
        for (int k = 1; k < 3; ++k) parent[std::max(root(t[0]), root(t[k]))] = std::min(root(t[0]), root(t[k]));

    struct Part {
        double area = 0;
        std::size_t vertices = 0;
        bool keep = false;
    };
    std::vector<Part> parts(positions.size());
    std::vector<bool> seen(positions.size());
    std::vector<Index> roots;
    for (const Triangle& t : triangles) {
        Part& part = parts[root(t[0])];
        if (part.vertices == 0) roots.push_back(root(t[0]));
        const Vec3d a = positions[t[0]].cast<double>();
        part.area += (positions[t[1]].cast<double>() - a).cross(positions[t[2]].cast<double>() - a).norm();
        for (Index v : t) {
            part.vertices += !seen[v];
            seen[v] = true;
        }
    }
    std::stable_sort(roots.begin(), roots.end(), [&](Index a, Index b) { return parts[a].area > parts[b].area; });
    std::size_t kept = 0;
    for (Index r : roots) {
        if (kept > 0 && kept + parts[r].vertices > vertices) break;
        kept += parts[r].vertices;
        parts[r].keep = true;
    }
    std::vector<Triangle> result;
    for (const Triangle& t : triangles)
        if (parts[root(t[0])].keep) result.push_back(t);
    return result;
}

} // namespace

Simplified simplify(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                    const SimplifyOptions& options) {
    Simplified start;
    start.triangles.assign(triangles.begin(), triangles.end());
    Collapser collapser(positions, std::move(start));
    Simplified& current = collapser.current();
    if (triangles.empty() || (!options.target_vertices && !options.max_error)) return std::move(current);
    const double max_error = options.max_error.value_or(1e6);
    if (!options.target_vertices) {
        collapser.collapse(0, max_error);
        return std::move(current);
    }

    const std::size_t target = std::max<std::size_t>(*options.target_vertices, 3);
    const auto reached = [&] { return current.vertex_count * 50 <= target * 51; };
    const auto triangles_for_target = [&] {
        return static_cast<std::size_t>(double(target) * double(current.triangles.size()) / double(current.vertex_count));
    };
    // Each round aims at what the ratio of the last one says; two are usually enough.
    for (int round = 0; round < 6 && !reached(); ++round) {
        const std::size_t before = current.triangles.size();
        collapser.collapse(triangles_for_target(), max_error);
        if (current.triangles.size() == before) break;
    }
    if (options.max_error || reached()) return std::move(current);

    // Stuck: parts too small to collapse further are dropped while that alone is enough for half of the target ...
    const std::vector<Triangle> parts = largest_parts(positions, current.triangles, target);
    std::vector<Index> last_seen(positions.size(), 0);
    Index stamp = 0;
    const std::size_t left = count_vertices(parts, last_seen, stamp);
    if (left <= target && left * 2 >= target) collapser.replace(parts);
    // ... and else vertices are clustered, ever coarser.
    for (double factor = 1; !reached() && factor > 0.01; factor *= 0.7)
        collapser.cluster(static_cast<std::size_t>(double(triangles_for_target()) * factor));
    return std::move(current);
}

} // namespace filigree
