#include "filigree/fracture/planar_fill.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/math.h"
#include "filigree/fracture/constrained_delaunay.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace filigree {

namespace {

constexpr double kWorstRadiusToEdge = 1.5; ///< circumradius to shortest edge: 19.5 degrees
constexpr double kLargestRadius = 0.75;    ///< of the edge wanted; equilateral ones have 0.58
constexpr double kGrading = 0.3;           ///< how much longer edges are wanted a unit of length further in
constexpr double kShortestShare = 0.03;    ///< of the outline's mean length: what is shorter is not refined around

/// How often edges run from their lower to their higher end, less how often back.
class EdgeSum {
public:
    void add(Index a, Index b, int times) {
        if (a == b) return;
        int& sum = sums_[std::minmax(a, b)];
        sum += a < b ? times : -times;
        if (sum == 0) sums_.erase(std::minmax(a, b));
    }
    const std::map<std::pair<Index, Index>, int>& sums() const { return sums_; }

private:
    std::map<std::pair<Index, Index>, int> sums_;
};

/// Fans that close what is left of the outline: each connected part from its lowest point.
void add_fans(const EdgeSum& rest, std::size_t points, std::vector<Triangle>& triangles) {
    if (rest.sums().empty()) return;
    DisjointSets parts(points);
    for (const auto& [edge, times] : rest.sums()) parts.join(edge.first, edge.second);
    std::map<Index, Index> lowest;
    for (const auto& [edge, times] : rest.sums()) lowest.try_emplace(parts.root(edge.first), edge.first);
    for (const auto& [edge, times] : rest.sums()) {
        const Index centre = lowest[parts.root(edge.first)];
        if (centre == edge.first || centre == edge.second) continue;
        const Triangle t =
            times > 0 ? Triangle{centre, edge.first, edge.second} : Triangle{centre, edge.second, edge.first};
        triangles.insert(triangles.end(), static_cast<std::size_t>(std::abs(times)), t);
    }
}

/// Points as integers of the triangulation's plane.
struct PlaneGrid {
    Vec2d centre;
    double scale;

    explicit PlaneGrid(std::span<const Vec2d> points) {
        Vec2d lo = points[0], hi = points[0];
        for (const Vec2d& p : points) {
            lo = lo.cwiseMin(p);
            hi = hi.cwiseMax(p);
        }
        centre = 0.5 * (lo + hi);
        const double half = 0.5 * (hi - lo).maxCoeff();
        scale = half > 1e-290 ? 0.95 * double(ConstrainedDelaunay::kPlaneHalf) / half : 1.0; // else all in one point
    }
    PlanePoint to_grid(const Vec2d& p) const {
        return {std::llround((p[0] - centre[0]) * scale), std::llround((p[1] - centre[1]) * scale)};
    }
    Vec2d from_grid(const PlanePoint& p) const { return centre + Vec2d(double(p[0]), double(p[1])) / scale; }
};

/// A curve that visits all parts of the plane, so that points that follow each other are near each other.
std::vector<Index> along_rows(std::span<const Vec2d> points, const PlaneGrid& grid) {
    const double rows = std::max(1.0, std::sqrt(double(points.size()) / 4));
    std::vector<std::pair<std::pair<int, double>, Index>> keys(points.size());
    for (Index k = 0; k < points.size(); ++k) {
        const Vec2d unit = (points[k] - grid.centre) * grid.scale / double(ConstrainedDelaunay::kPlaneHalf);
        const int row = static_cast<int>((unit[1] + 1) * 0.5 * rows);
        keys[k] = {{row, row % 2 ? -unit[0] : unit[0]}, k};
    }
    std::sort(keys.begin(), keys.end());
    std::vector<Index> order(points.size());
    for (std::size_t k = 0; k < keys.size(); ++k) order[k] = keys[k].second;
    return order;
}

/// Delaunay refinement inside the outlines, which stay as they are.
class Refinement {
public:
    Refinement(ConstrainedDelaunay& mesh, double longest) : mesh_(mesh), longest_(longest) {
        std::vector<int> edges(mesh.vertex_count());
        size_.assign(mesh.vertex_count(), 0);
        double sum = 0;
        std::size_t count = 0;
        for (std::size_t k = 0; k < mesh.face_count(); ++k)
            for (int e = 0; e < 3; ++e) {
                const auto& face = mesh.face(k);
                if (face.net[e] == 0) continue;
                const Index a = face.vertices[e], b = face.vertices[(e + 1) % 3];
                const double length = distance(a, b);
                sum += length;
                ++count;
                for (const Index v : {a, b}) {
                    size_[v] += length;
                    ++edges[v];
                }
            }
        const double mean = count ? sum / double(count) : longest;
        shortest_ = kShortestShare * std::min(mean, longest);
        for (std::size_t v = 0; v < size_.size(); ++v)
            size_[v] = std::clamp(edges[v] ? size_[v] / edges[v] : longest, shortest_, longest);
    }

    void run() {
        std::vector<Index> waiting(mesh_.face_count());
        std::iota(waiting.begin(), waiting.end(), Index{0});
        // A face is looked at again whenever it changed. Points keep their distance, so this ends; the bound is for
        // safety.
        const std::size_t most = 50 * mesh_.vertex_count() + 200'000;
        for (std::size_t at = 0; at < waiting.size() && mesh_.vertex_count() < most; ++at) {
            const Index face = waiting[at];
            if (mesh_.face(face).winding == 0 || is_good(face)) continue;
            const double size = wanted(face) + kGrading * circumradius(face);
            const std::optional<Index> vertex = mesh_.insert_circumcentre(face, waiting);
            if (!vertex) continue;
            size_.resize(mesh_.vertex_count(), longest_);
            size_[*vertex] = std::min(longest_, size);
        }
    }

private:
    double distance(Index a, Index b) const {
        const PlanePoint &p = mesh_.point(a), &q = mesh_.point(b);
        return math::hypot(double(p[0] - q[0]), double(p[1] - q[1]));
    }
    double wanted(Index face) const {
        const auto& v = mesh_.face(face).vertices;
        return (size_[v[0]] + size_[v[1]] + size_[v[2]]) / 3;
    }
    double shortest_edge(Index face) const {
        const auto& v = mesh_.face(face).vertices;
        return std::min({distance(v[0], v[1]), distance(v[1], v[2]), distance(v[2], v[0])});
    }
    double circumradius(Index face) const {
        const auto& v = mesh_.face(face).vertices;
        const PlanePoint &a = mesh_.point(v[0]), &b = mesh_.point(v[1]), &c = mesh_.point(v[2]);
        const double area = double(b[0] - a[0]) * double(c[1] - a[1]) - double(b[1] - a[1]) * double(c[0] - a[0]);
        return distance(v[0], v[1]) * distance(v[1], v[2]) * distance(v[2], v[0]) / (2 * area);
    }
    bool is_good(Index face) const {
        const double radius = circumradius(face);
        return radius <= kLargestRadius * wanted(face) &&
               radius <= kWorstRadiusToEdge * std::max(shortest_edge(face), shortest_);
    }

    ConstrainedDelaunay& mesh_;
    double longest_, shortest_;
    std::vector<double> size_; ///< of edges wanted at each vertex
};

} // namespace

PlanarFill fill_plane(std::span<const Vec2d> points, std::span<const PlanarSegment> segments,
                      const PlanarFillOptions& options) {
    PlanarFill fill;
    EdgeSum outline;
    for (const PlanarSegment& s : segments) outline.add(s.from, s.to, s.multiplicity);
    if (outline.sums().empty()) return fill;

    const PlaneGrid grid(points);
    ConstrainedDelaunay mesh;
    std::vector<Index> vertex(points.size());
    std::vector<Index> point_of(3, kNoIndex);
    for (const Index k : along_rows(points, grid)) {
        vertex[k] = mesh.insert(grid.to_grid(points[k]));
        if (vertex[k] == point_of.size()) point_of.push_back(k);
    }
    bool is_sound = true;
    for (const auto& [edge, times] : outline.sums())
        is_sound = is_sound && mesh.constrain(vertex[edge.first], vertex[edge.second], times);
    is_sound = is_sound && mesh.find_windings();
    if (is_sound && options.edge > 0) Refinement(mesh, options.edge * grid.scale).run();
    if (is_sound) {
        while (point_of.size() < mesh.vertex_count()) {
            const Index added = static_cast<Index>(point_of.size());
            point_of.push_back(static_cast<Index>(points.size() + fill.added.size()));
            fill.added.push_back(grid.from_grid(mesh.point(added)));
        }
        for (std::size_t k = 0; k < mesh.face_count(); ++k) {
            const auto& face = mesh.face(k);
            if (face.winding == 0) continue;
            Triangle t = {point_of[face.vertices[0]], point_of[face.vertices[1]], point_of[face.vertices[2]]};
            if (face.winding < 0) std::swap(t[1], t[2]);
            fill.triangles.insert(fill.triangles.end(), static_cast<std::size_t>(std::abs(face.winding)), t);
        }
    }
    fill.is_fan = !is_sound;
    // What rounding joined or divided: thin triangles between the outline and what was filled.
    EdgeSum rest = outline;
    for (std::size_t k = 0; is_sound && k < mesh.face_count(); ++k)
        for (int e = 0; e < 3; ++e) {
            const auto& face = mesh.face(k);
            const Index a = point_of[face.vertices[e]], b = point_of[face.vertices[(e + 1) % 3]];
            if (face.net[e] > 0) rest.add(a, b, -face.net[e]);
        }
    add_fans(rest, points.size() + fill.added.size(), fill.triangles);
    return fill;
}

std::vector<Triangle> delaunay_triangles(std::span<const Vec2d> points) {
    std::vector<Triangle> triangles;
    if (points.empty()) return triangles;
    const PlaneGrid grid(points);
    ConstrainedDelaunay mesh;
    std::vector<Index> point_of(3, kNoIndex);
    for (Index k = 0; k < points.size(); ++k)
        if (mesh.insert(grid.to_grid(points[k])) == point_of.size()) point_of.push_back(k);
    for (std::size_t k = 0; k < mesh.face_count(); ++k) {
        const auto& v = mesh.face(k).vertices;
        if (std::none_of(v.begin(), v.end(), ConstrainedDelaunay::is_outer))
            triangles.push_back({point_of[v[0]], point_of[v[1]], point_of[v[2]]});
    }
    return triangles;
}

} // namespace filigree
