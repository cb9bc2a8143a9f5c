// Based on:
//   [Gueziec 2001] (cutting along singular edges, then gluing what agrees). Where more than two triangles meet, we pair
//   the two sides of each solid wedge, so that bodies which touch along an edge come apart closed.
#include "filigree/remesh/manifold_surface.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh.h"
#include "filigree/mesh/edges.h"
#include "filigree/mesh/orientation.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <utility>

namespace filigree {
namespace {

constexpr double kNoArea = 1e-14;  // of the diagonal squared: float's rounding of the positions, squared
constexpr double kTinyArea = 1e-7; // of the whole surface's: of a component that is nothing but needles
constexpr std::size_t kManifoldSurfaceGrain = 32'768; // triangles a piece

/// Triangles over welded vertices, and the mesh corners and faces they come from.
struct Soup {
    std::vector<Triangle> triangles, corners;
    std::vector<Index> source_face;
    std::vector<std::uint8_t> doubled; ///< a triangle: whether it was there an even number of times

    void resize(std::size_t count) {
        triangles.resize(count);
        corners.resize(count);
        source_face.resize(count);
        doubled.resize(count);
    }
    /// Keeps the triangles that `keep` says true of.
    template <class Keep>
    void filter(const Keep& keep) {
        std::size_t kept = 0;
        for (std::size_t t = 0; t < triangles.size(); ++t) {
            if (!keep(t)) continue;
            triangles[kept] = triangles[t];
            corners[kept] = corners[t];
            doubled[kept] = doubled[t];
            source_face[kept++] = source_face[t];
        }
        resize(kept);
    }
};

double double_area(const Vec3d& a, const Vec3d& b, const Vec3d& c) { return (b - a).cross(c - a).norm(); }

double double_area(std::span<const Vec3d> positions, const Triangle& t) {
    return double_area(positions[t[0]], positions[t[1]], positions[t[2]]);
}

/// Faces of four corners or more over the same vertices as another.
std::vector<Index> repeated_polygons(const Mesh& mesh, std::span<const Index> welded) {
    std::vector<std::pair<std::uint64_t, Index>> keys; // alike for the same vertices in any order; rarely for others
    for (Index f = 0; f < mesh.face_count(); ++f) {
        if (mesh.face_size(f) < 4) continue;
        std::uint64_t key = mesh.face_size(f);
        for (const Index v : mesh.face(f)) key += (welded[v] + 1) * 0x9E3779B97F4A7C15u ^ (welded[v] + 1) >> 7;
        keys.emplace_back(key, f);
    }
    std::sort(keys.begin(), keys.end());
    std::vector<Index> repeated;
    for (std::size_t i = 0; i < keys.size(); ++i)
        if ((i > 0 && keys[i - 1].first == keys[i].first) ||
            (i + 1 < keys.size() && keys[i + 1].first == keys[i].first))
            repeated.push_back(keys[i].second);
    return repeated;
}

/// Triangles over corners: every corner is a vertex of its own, so that faces which repeat a vertex name the right one.
/// Polygons that are there twice begin at their lowest vertex, so that both get the same diagonals; all others are cut
/// as `triangulate` cuts them everywhere else.
Result<Triangulation> triangulate_corners(const Mesh& mesh, std::span<const Index> welded, const RunContext& context) {
    Mesh loose;
    loose.positions.resize(mesh.corner_count());
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) loose.positions[c] = mesh.positions[mesh.corners[c]];
    loose.face_offsets = mesh.face_offsets;
    loose.corners.resize(mesh.corner_count());
    std::iota(loose.corners.begin(), loose.corners.end(), Index{0});
    for (const Index f : repeated_polygons(mesh, welded)) {
        const auto face = std::span(loose.corners).subspan(mesh.face_offsets[f], mesh.face_size(f));
        const auto lowest = std::ranges::min_element(face, {}, [&](Index c) { return welded[mesh.corners[c]]; });
        std::ranges::rotate(face, lowest);
    }
    return triangulate(loose, context);
}

Result<Soup> triangle_soup(const Mesh& mesh, std::span<const Index> welded, const RunContext& context) {
    Soup soup;
    if (mesh.corner_count() == 3 * mesh.face_count()) {
        soup.resize(mesh.face_count());
        for (Index f = 0; f < mesh.face_count(); ++f) {
            soup.corners[f] = {3 * f, 3 * f + 1, 3 * f + 2};
            soup.source_face[f] = f;
        }
    } else {
        Result<Triangulation> triangulation = triangulate_corners(mesh, welded, context);
        if (!triangulation) return triangulation.error();
        soup.corners = std::move(triangulation->triangles);
        soup.source_face = std::move(triangulation->source_face);
    }
    soup.resize(soup.corners.size());
    for (std::size_t t = 0; t < soup.corners.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i) soup.triangles[t][i] = welded[mesh.corners[soup.corners[t][i]]];
    return soup;
}

void drop_degenerate(Soup& soup, CleanReport& report) {
    const std::size_t before = soup.triangles.size();
    soup.filter([&](std::size_t t) {
        const auto& [a, b, c] = soup.triangles[t];
        return a != b && b != c && c != a;
    });
    report.degenerate_faces += before - soup.triangles.size();
}

/// For each triangle the first one over the same vertices, in any order.
std::vector<Index> first_copies(std::span<const Triangle> triangles, const IndexLists& edges) {
    std::vector<Index> first(triangles.size());
    std::iota(first.begin(), first.end(), Index{0});
    std::vector<std::pair<Index, Index>> apexes; // and triangles, of one edge
    for (const std::span<const Index> edge : edges) {
        if (edge.size() < 2) continue;
        apexes.clear();
        for (const Index h : edge) apexes.emplace_back(half_edge_apex(triangles, h), h / 3);
        std::ranges::sort(apexes);
        for (std::size_t i = 1; i < apexes.size(); ++i)
            if (apexes[i].first == apexes[i - 1].first) first[apexes[i].second] = first[apexes[i - 1].second];
    }
    return first;
}

/// Which triangles belong to walls inside: patches of triangles that are doubled, where the surface goes on without
/// them all along their rim. The parts on both sides of a wall become one when it goes. first: from first_copies.
std::vector<std::uint8_t> triangles_of_walls(const Soup& soup, const IndexLists& edges, std::span<const Index> first) {
    const std::vector<Triangle>& triangles = soup.triangles;
    DisjointSets patches(triangles.size());
    std::vector<std::uint8_t> has_rim(triangles.size(), 0), is_loose(triangles.size(), 0);
    // twice: patches must be whole before what is found along them counts
    for (const bool joining : {true, false})
        for (const std::span<const Index> edge : edges) {
            std::size_t single_count = 0, doubled_count = 0, up_count = 0;
            Index doubled = kNoIndex;
            for (const Index h : edge) {
                const Index t = h / 3;
                if (first[t] != t) continue;
                if (!soup.doubled[t]) {
                    ++single_count;
                    up_count += runs_up(triangles, h);
                    continue;
                }
                ++doubled_count;
                if (joining && doubled != kNoIndex) patches.join(doubled, t);
                doubled = t;
            }
            if (joining || doubled == kNoIndex) continue;
            if (single_count > 0) has_rim[patches.root(doubled)] = 1;
            if (2 * up_count != single_count || single_count + doubled_count == 1) is_loose[patches.root(doubled)] = 1;
        }
    std::vector<std::uint8_t> of_wall(triangles.size(), 0);
    for (Index t = 0; t < triangles.size(); ++t) {
        const Index patch = patches.root(first[t]);
        of_wall[t] = soup.doubled[first[t]] && has_rim[patch] && !is_loose[patch];
    }
    return of_wall;
}

/// Drops later copies, and walls altogether. Returns whether there were any.
bool drop_duplicates(Soup& soup, const IndexLists& edges, CleanReport& report) {
    const std::vector<Index> first = first_copies(soup.triangles, edges);
    const auto is_first = [&](std::size_t t) { return first[t] == t; };
    const std::size_t before = soup.triangles.size();
    bool any = false;
    for (std::size_t t = 0; t < before && !any; ++t) any = !is_first(t);
    if (!any) return false;
    std::ranges::fill(soup.doubled, 1); // turned by each copy
    for (const Index t : first) soup.doubled[t] ^= 1;
    const std::vector<std::uint8_t> of_wall = triangles_of_walls(soup, edges, first);
    soup.filter([&](std::size_t t) { return is_first(t) && !of_wall[t]; });
    report.duplicate_faces += before - soup.triangles.size();
    return true;
}

/// The half-edges to glue along an edge: all of them, but where a sheet that was there twice meets a surface that goes
/// on without it, only that surface's. `buffer` may hold them.
std::span<const Index> sides_to_glue(const Soup& soup, std::span<const Index> edge, std::vector<Index>& buffer) {
    if (edge.size() < 3) return edge;
    buffer.clear();
    std::size_t up = 0;
    for (const Index h : edge) {
        if (soup.doubled[h / 3]) continue;
        buffer.push_back(h);
        up += runs_up(soup.triangles, h);
    }
    return !buffer.empty() && 2 * up == buffer.size() ? std::span<const Index>(buffer) : edge;
}

/// The opposite of each half-edge on edges with exactly two triangles, whichever way they run.
std::vector<Index> pair_neighbours(const Soup& soup, const IndexLists& edges) {
    std::vector<Index> neighbour(edges.items.size(), kNoIndex), buffer;
    for (const std::span<const Index> edge : edges) {
        const std::span<const Index> sides = sides_to_glue(soup, edge, buffer);
        if (sides.size() != 2) continue;
        neighbour[sides[0]] = sides[1];
        neighbour[sides[1]] = sides[0];
    }
    return neighbour;
}

/// Turns triangles over, and renumbers their half-edges: the edge i becomes the edge 2 - i.
void flip_triangles(Soup& soup, IndexLists& edges, std::span<const std::uint8_t> flip, CleanReport& report) {
    Index last_face = kNoIndex;
    for (std::size_t t = 0; t < flip.size(); ++t) {
        if (!flip[t]) continue;
        std::swap(soup.triangles[t][1], soup.triangles[t][2]);
        std::swap(soup.corners[t][1], soup.corners[t][2]);
        report.flipped_faces += soup.source_face[t] != last_face;
        last_face = soup.source_face[t];
    }
    for (Index& h : edges.items)
        if (flip[h / 3]) h = h / 3 * 3 + 2 - h % 3;
}

/// Glues the half-edges of oriented triangles, so that their fans make a manifold.
class Gluer {
public:
    Gluer(std::span<const Vec3d> positions, const Soup& soup, const IndexLists& edges)
        : positions_(positions), triangles_(soup.triangles), opposite_(edges.items.size(), kNoIndex) {
        std::vector<Index> buffer;
        for (const std::span<const Index> edge : edges) {
            if (edge.size() == 2 && run_apart(edge[0], edge[1])) {
                glue(edge[0], edge[1]);
                continue;
            }
            if (edge.size() < 2) continue;
            singular_.push_back(edge);
            pair_wedges(sides_to_glue(soup, edge, buffer));
            pair_wedges(edge); // what is still open: sheets that were there twice, among themselves
        }
        if (!singular_.empty()) mend();
    }

    void count(CleanReport& report) const {
        for (const auto& edge : singular_) {
            const bool closed = std::ranges::all_of(edge, [&](Index h) { return opposite_[h] != kNoIndex; });
            ++(closed ? report.separated_edges : report.cut_edges);
        }
    }

    std::span<const Index> opposite() const { return opposite_; }

private:
    bool run_apart(Index a, Index b) const { return half_edge_start(triangles_, a) != half_edge_start(triangles_, b); }
    void glue(Index a, Index b) {
        opposite_[a] = b;
        opposite_[b] = a;
    }
    void cut(Index a) {
        if (opposite_[a] == kNoIndex) return;
        opposite_[opposite_[a]] = kNoIndex;
        opposite_[a] = kNoIndex;
    }

    /// Around the edge, seen from its higher end, counter-clockwise: a triangle that runs down the edge has its inside
    /// ahead, one that runs up has it behind. So each one that runs down is glued to the next that runs up, as brackets
    /// are matched.
    void pair_wedges(std::span<const Index> edge) {
        const Index a = half_edge_start(triangles_, edge[0]), b = half_edge_end(triangles_, edge[0]);
        const Vec3d &low = positions_[std::min(a, b)], axis = (positions_[std::max(a, b)] - low).normalized();
        const Vec3d u = axis.unitOrthogonal(), v = axis.cross(u);
        around_.clear();
        for (const Index h : edge) {
            if (opposite_[h] != kNoIndex) continue;
            const Vec3d arm = positions_[half_edge_apex(triangles_, h)] - low;
            around_.emplace_back(math::atan2(v.dot(arm), u.dot(arm)), h);
        }
        std::ranges::sort(around_);
        open_.clear();
        for (int turn = 0; turn < 2; ++turn) // the second time for wedges over the angle where we began
            for (const auto& [angle, h] : around_) {
                if (opposite_[h] != kNoIndex) continue;
                const bool up = half_edge_start(triangles_, h) == std::min(a, b);
                if (!up && turn == 0) open_.push_back(h);
                if (!up || open_.empty()) continue;
                glue(open_.back(), h);
                open_.pop_back();
            }
    }

    /// Edges between the same two fans must be one. Where they are not, what was paired there is cut, which gives the
    /// fans fewer triangles, until each such edge is one pair, one border, or two borders that close on each other.
    void mend() {
        for (bool again = true; again;) {
            again = false;
            const Labels fan = fans(opposite_);
            for (const auto& edge : singular_)
                for_same_ends(edge, fan, [&](std::span<const Index> same) {
                    if (same.size() < 2 || (same.size() == 2 && (opposite_[same[0]] == same[1] || is_slit(same))))
                        return;
                    for (const Index h : same) {
                        again = again || opposite_[h] != kNoIndex;
                        cut(h);
                    }
                });
        }
        const Labels fan = fans(opposite_);
        for (const auto& edge : singular_)
            for_same_ends(edge, fan, [&](std::span<const Index> same) {
                if (same.size() == 2 && is_slit(same)) glue(same[0], same[1]);
            });
    }

    bool is_slit(std::span<const Index> same) const {
        return opposite_[same[0]] == kNoIndex && opposite_[same[1]] == kNoIndex && run_apart(same[0], same[1]);
    }

    /// Calls visit for the half-edges of `edge` that lie between the same two fans.
    template <class Visit>
    void for_same_ends(std::span<const Index> edge, const Labels& fan, const Visit& visit) const {
        const auto ends = [&](Index h) -> std::pair<Index, Index> {
            return std::minmax(fan.of[h], fan.of[next_half_edge(h)]);
        };
        std::vector<Index> grouped(edge.begin(), edge.end());
        std::ranges::stable_sort(grouped, {}, ends);
        for (std::size_t begin = 0; begin < grouped.size();) {
            std::size_t end = begin + 1;
            while (end < grouped.size() && ends(grouped[end]) == ends(grouped[begin])) ++end;
            visit(std::span<const Index>(grouped).subspan(begin, end - begin));
            begin = end;
        }
    }

    std::span<const Vec3d> positions_;
    std::span<const Triangle> triangles_;
    std::vector<Index> opposite_;
    std::vector<std::span<const Index>> singular_; ///< edges that are neither a border nor a plain pair
    std::vector<std::pair<double, Index>> around_; ///< angles and half-edges of one edge
    std::vector<Index> open_;
};

/// Gives each fan a vertex, in the order of the mesh's vertices, and within one in that of its first triangle.
ManifoldSurface split_into_fans(Soup soup, std::span<const Vec3d> positions, const Labels& fan) {
    std::vector<Index> place(fan.count); // the welded vertex of each fan
    for (Index h = 0; h < fan.of.size(); ++h) place[fan.of[h]] = half_edge_start(soup.triangles, h);
    std::vector<Index> next(positions.size() + 1, 0);
    for (const Index vertex : place) ++next[vertex + 1];
    std::inclusive_scan(next.begin(), next.end(), next.begin());
    ManifoldSurface surface;
    surface.positions.resize(fan.count);
    std::vector<Index> number(fan.count);
    for (std::size_t f = 0; f < fan.count; ++f) {
        number[f] = next[place[f]]++;
        surface.positions[number[f]] = positions[place[f]];
    }
    for (std::size_t h = 0; h < fan.of.size(); ++h) soup.triangles[h / 3][h % 3] = number[fan.of[h]];
    surface.triangles = std::move(soup.triangles);
    surface.source_corners = std::move(soup.corners);
    return surface;
}

std::vector<double> double_areas(std::span<const Vec3d> positions, std::span<const Triangle> triangles,
                                 const RunContext& context) {
    std::vector<double> areas(triangles.size());
    parallel_for(context, triangles.size(), kManifoldSurfaceGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) areas[t] = double_area(positions, triangles[t]);
    });
    return areas;
}

std::size_t used_count(std::span<const Triangle> triangles, std::size_t vertex_count) {
    std::vector<std::uint8_t> used(vertex_count, 0);
    for (const Triangle& t : triangles)
        for (const Index vertex : t) used[vertex] = 1;
    return static_cast<std::size_t>(std::ranges::count(used, 1));
}

} // namespace

Result<ManifoldSurface> make_manifold(const Mesh& mesh, CleanReport& report, const RunContext& context) {
    const auto step = [&](double fraction) {
        context.report("cleaning", fraction);
        return !context.is_cancelled();
    };
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    if (!step(0)) return cancelled_error();
    const std::vector<Index> welded = weld_map(mesh.positions);
    std::size_t places = 0;
    for (Index v = 0; v < welded.size(); ++v) places += welded[v] == v;
    Result<Soup> made = triangle_soup(mesh, welded, context);
    if (!made) return made.error();
    Soup soup = *std::move(made);
    drop_degenerate(soup, report);
    if (!step(0.2)) return cancelled_error();

    IndexLists edges = edges_of(soup.triangles, mesh.vertex_count());
    if (drop_duplicates(soup, edges, report)) edges = edges_of(soup.triangles, mesh.vertex_count());
    std::vector<Vec3d> positions(mesh.vertex_count());
    std::ranges::transform(mesh.positions, positions.begin(), [](const Vec3f& p) { return p.cast<double>(); });
    const std::vector<double> areas = double_areas(positions, soup.triangles, context);
    const double diagonal = bounds(mesh.positions).diagonal();
    if (!(std::reduce(areas.begin(), areas.end()) > kNoArea * diagonal * diagonal))
        return Error{ErrorCode::unsuitable, "The mesh has no face with an area; there is no surface to work on."};
    if (!step(0.5)) return cancelled_error();

    const std::vector<Index> neighbour = pair_neighbours(soup, edges);
    flip_triangles(soup, edges, triangles_to_turn(soup.triangles, neighbour, mesh.positions, OneSided::turned), report);
    if (!step(0.7)) return cancelled_error();
    const Gluer gluer(positions, soup, edges);
    const Labels fan = fans(gluer.opposite());
    const std::size_t used = used_count(soup.triangles, mesh.vertex_count());
    gluer.count(report);
    report.welded_vertices += mesh.vertex_count() - places;
    report.unused_vertices += places - used;
    report.split_vertices += fan.count - used;
    ManifoldSurface surface = split_into_fans(std::move(soup), positions, fan);
    if (!step(1)) return cancelled_error();
    return surface;
}

SurfaceTopology surface_topology(const ManifoldSurface& surface) {
    const std::vector<Index> opposite = opposite_half_edges(surface.triangles, surface.positions.size());
    SurfaceTopology topology;
    topology.components = components(opposite).count;
    std::vector<Index> next(surface.positions.size(), kNoIndex); // along the border
    for (Index h = 0; h < opposite.size(); ++h) {
        if (opposite[h] != kNoIndex) continue;
        ++topology.border_edges;
        assert(next[half_edge_start(surface.triangles, h)] == kNoIndex);
        next[half_edge_start(surface.triangles, h)] = half_edge_end(surface.triangles, h);
    }
    const std::size_t edges = (opposite.size() + topology.border_edges) / 2;
    topology.euler = std::int64_t(surface.positions.size()) - std::int64_t(edges) + std::int64_t(opposite.size() / 3);
    for (Index v = 0; v < next.size(); ++v) {
        if (next[v] == kNoIndex) continue;
        ++topology.border_loops;
        for (Index at = v; next[at] != kNoIndex;) at = std::exchange(next[at], kNoIndex);
    }
    return topology;
}

void remove_small_components(ManifoldSurface& surface, double smallest, CleanReport& report) {
    const Labels component = components(opposite_half_edges(surface.triangles, surface.positions.size()));
    if (component.count < 2) return;
    std::vector<Box> boxes(component.count);
    std::vector<double> areas(component.count, 0);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        areas[component.of[t]] += double_area(surface.positions, surface.triangles[t]);
        for (const Index vertex : surface.triangles[t]) boxes[component.of[t]].extend(surface.positions[vertex]);
    }
    const auto largest = static_cast<std::size_t>(std::ranges::max_element(areas) - areas.begin());
    const double all = std::reduce(areas.begin(), areas.end());
    std::vector<std::uint8_t> keep(component.count);
    double removed = 0;
    for (std::size_t c = 0; c < component.count; ++c) {
        keep[c] = c == largest || (areas[c] > kTinyArea * all && !(boxes[c].diagonal() < smallest));
        if (keep[c]) continue;
        ++report.removed_components;
        removed += areas[c];
    }
    if (all > 0) report.removed_area += removed / all;

    std::vector<Index> number(surface.positions.size(), kNoIndex);
    std::size_t kept = 0;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        if (!keep[component.of[t]]) continue;
        for (const Index vertex : surface.triangles[t]) number[vertex] = 0;
        surface.triangles[kept] = surface.triangles[t];
        if (!surface.source_corners.empty()) surface.source_corners[kept] = surface.source_corners[t];
        ++kept;
    }
    surface.triangles.resize(kept);
    if (!surface.source_corners.empty()) surface.source_corners.resize(kept);
    Index count = 0;
    for (std::size_t v = 0; v < number.size(); ++v) {
        if (number[v] == kNoIndex) continue;
        surface.positions[count] = surface.positions[v];
        number[v] = count++;
    }
    surface.positions.resize(count);
    for (Triangle& t : surface.triangles)
        for (Index& vertex : t) vertex = number[vertex];
}

} // namespace filigree
