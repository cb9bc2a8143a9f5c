// Every edge is met from its lower vertex: the corners of a vertex, sorted by the neighbours they lead to, show its
// edges side by side, and joined over those edges, its fans. So one pass over vertices, in parallel, finds it all.
#include "filigree/mesh.h"

#include "filigree/core/atomic_ref.h"
#include "filigree/core/disjoint_sets.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/random.h"
#include "filigree/mesh/edges.h"
#include "filigree/mesh/normals.h"
#include "filigree/mesh/weld.h"

#include <algorithm>

namespace filigree {
namespace {

constexpr double kDegenerateArea = 1e-14;    // of the diagonal squared: float's rounding of the positions, squared
constexpr std::size_t kTopologyGrain = 8192; // vertices or faces a piece

void add(Finding& finding, std::initializer_list<Index> place) {
    if (finding.count++ < Finding::kPlaces) finding.places.emplace_back(place);
}

void append(Finding& finding, const Finding& later) {
    finding.count += later.count;
    const std::size_t room = Finding::kPlaces - finding.places.size();
    const auto end = later.places.begin() + static_cast<std::ptrdiff_t>(std::min(room, later.places.size()));
    finding.places.insert(finding.places.end(), later.places.begin(), end);
}

/// What the passes over vertices need to know of faces and corners.
struct Incidence {
    PolygonCorners polygons;
    IndexLists corners_at;                      ///< of each vertex
    std::vector<Index> lowest_vertex;           ///< of each face
    std::vector<std::uint64_t> vertex_set_hash; ///< of each face, whatever the order
    std::vector<std::uint8_t> collapsed;        ///< a face: fewer than three corners are left
    std::vector<std::uint8_t> degenerate;       ///< a face
};

/// Number of corners that differ from the one before them.
std::size_t distinct_corners(std::span<const Index> face) {
    std::size_t count = 0;
    Index previous = face.back();
    for (const Index vertex : face) {
        count += vertex != previous;
        previous = vertex;
    }
    return count;
}

Incidence gather_incidence(const Mesh& mesh, const RunContext& context) {
    const std::size_t faces = mesh.face_count();
    Incidence in;
    in.polygons = PolygonCorners(mesh.face_offsets);
    in.lowest_vertex.resize(faces);
    in.vertex_set_hash.resize(faces);
    in.collapsed.resize(faces);
    in.degenerate.resize(faces);
    parallel_for(context, faces, kTopologyGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) {
            std::uint64_t hash = 0;
            for (const Index vertex : mesh.face(f)) hash += random_bits(0, vertex);
            in.vertex_set_hash[f] = hash;
            in.lowest_vertex[f] = std::ranges::min(mesh.face(f));
            in.collapsed[f] = distinct_corners(mesh.face(f)) < 3;
        }
    });
    in.corners_at = corners_at_vertices(mesh.corners, mesh.vertex_count());
    return in;
}

/// What the vertices of one piece found.
struct VertexFindings {
    std::size_t edges = 0, used_vertices = 0;
    Finding open_edges, nonmanifold_edges, inconsistent_edges, nonmanifold_vertices, unused_vertices;
    std::vector<Index> duplicate_faces;
};

/// Looks at one vertex after another; keeps its working memory.
class VertexVisitor {
public:
    VertexVisitor(const Mesh& mesh, Incidence& incidence, DisjointSets& components)
        : mesh_(mesh), in_(incidence), components_(components) {}

    void visit(Index vertex, VertexFindings& found) {
        const std::span<const Index> corners = in_.corners_at[vertex];
        if (corners.empty()) return add(found.unused_vertices, {vertex});
        collect_sides(vertex, corners);
        find_duplicate_faces(vertex, corners, found);
        if (sides_.empty()) return;
        ++found.used_vertices;
        visit_edges(vertex, found);
        if (fan_count_ > 1) add(found.nonmanifold_vertices, {vertex});
    }

private:
    /// One side of a face's corner at the vertex: the half-edge to or from a neighbour.
    struct Side {
        Index neighbour, face;
        Index fan;     ///< which corner of the vertex it belongs to, then its set
        bool outgoing; ///< from the vertex to the neighbour
        bool operator<(const Side& other) const { return neighbour < other.neighbour; }
    };

    void collect_sides(Index vertex, std::span<const Index> corners) {
        sides_.clear();
        fan_parent_.clear();
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const Index face = in_.polygons.face(corners[i]);
            if (i > 0 && in_.polygons.face(corners[i - 1]) == face)
                atomic_ref(in_.degenerate[face]).store(1, std::memory_order_relaxed);
            if (in_.collapsed[face]) continue;
            const Index before = mesh_.corners[in_.polygons.previous(corners[i])];
            if (before == vertex) continue; // seen from the first of the corners that repeat one another
            Index after = corners[i];
            do after = in_.polygons.next(after);
            while (mesh_.corners[after] == vertex);
            const Index fan = static_cast<Index>(fan_parent_.size());
            fan_parent_.push_back(fan);
            sides_.push_back({before, face, fan, false});
            sides_.push_back({mesh_.corners[after], face, fan, true});
        }
        std::sort(sides_.begin(), sides_.end());
    }

    void visit_edges(Index vertex, VertexFindings& found) {
        fan_count_ = fan_parent_.size();
        for (auto begin = sides_.begin(); begin != sides_.end();) {
            auto end = begin + 1;
            while (end != sides_.end() && end->neighbour == begin->neighbour) {
                join_fans(begin->fan, end->fan);
                ++end;
            }
            if (vertex < begin->neighbour) visit_edge(vertex, std::span(begin, end), found);
            begin = end;
        }
    }

    void visit_edge(Index vertex, std::span<const Side> sides, VertexFindings& found) {
        const Index neighbour = sides[0].neighbour;
        ++found.edges;
        for (std::size_t i = 1; i < sides.size(); ++i) components_.join(sides[0].face, sides[i].face);
        if (sides.size() == 1)
            add(found.open_edges, {vertex, neighbour});
        else if (sides.size() > 2)
            add(found.nonmanifold_edges, {vertex, neighbour});
        else if (sides[0].outgoing == sides[1].outgoing)
            add(found.inconsistent_edges, {vertex, neighbour});
    }

    void join_fans(Index a, Index b) {
        a = fan_root(a);
        b = fan_root(b);
        if (a == b) return;
        fan_parent_[std::max(a, b)] = std::min(a, b);
        --fan_count_;
    }
    Index fan_root(Index i) {
        while (fan_parent_[i] != i) i = fan_parent_[i] = fan_parent_[fan_parent_[i]];
        return i;
    }

    /// Every face is looked at from its lowest vertex; equal hashes of the vertex sets are then compared in full.
    void find_duplicate_faces(Index vertex, std::span<const Index> corners, VertexFindings& found) {
        candidates_.clear();
        for (const Index c : corners) {
            const Index face = in_.polygons.face(c);
            if (in_.lowest_vertex[face] == vertex) candidates_.emplace_back(in_.vertex_set_hash[face], face);
        }
        if (candidates_.size() < 2) return;
        std::sort(candidates_.begin(), candidates_.end());
        const auto repeated = std::unique(candidates_.begin(), candidates_.end()); // one face, twice at this vertex
        candidates_.erase(repeated, candidates_.end());
        for (std::size_t i = 1; i < candidates_.size(); ++i) {
            const auto is_earlier_twin = [&](const auto& other) {
                return sorted(other.second) == sorted(candidates_[i].second);
            };
            const auto same_hash =
                std::ranges::equal_range(candidates_.begin(), candidates_.begin() + std::ptrdiff_t(i),
                                         candidates_[i].first, {}, [](const auto& c) { return c.first; });
            if (std::ranges::any_of(same_hash, is_earlier_twin)) found.duplicate_faces.push_back(candidates_[i].second);
        }
    }
    std::vector<Index> sorted(Index face) const {
        std::vector<Index> vertices(mesh_.face(face).begin(), mesh_.face(face).end());
        std::ranges::sort(vertices);
        return vertices;
    }

    const Mesh& mesh_;
    Incidence& in_;
    DisjointSets& components_;
    std::vector<Side> sides_;
    std::vector<Index> fan_parent_;
    std::size_t fan_count_ = 0;
    std::vector<std::pair<std::uint64_t, Index>> candidates_;
};

void analyse_vertices(const Mesh& mesh, Incidence& incidence, const RunContext& context, TopologyReport& report) {
    DisjointSets components(mesh.face_count());
    std::vector<VertexFindings> pieces((mesh.vertex_count() + kTopologyGrain - 1) / kTopologyGrain);
    parallel_for(context, mesh.vertex_count(), kTopologyGrain, [&](std::size_t begin, std::size_t end) {
        VertexVisitor visitor(mesh, incidence, components);
        for (std::size_t v = begin; v < end; ++v) visitor.visit(static_cast<Index>(v), pieces[begin / kTopologyGrain]);
    });

    std::size_t used_vertices = 0, live_faces = 0;
    std::vector<Index> duplicates;
    for (const VertexFindings& piece : pieces) {
        report.edges += piece.edges;
        used_vertices += piece.used_vertices;
        append(report.open_edges, piece.open_edges);
        append(report.nonmanifold_edges, piece.nonmanifold_edges);
        append(report.inconsistent_edges, piece.inconsistent_edges);
        append(report.nonmanifold_vertices, piece.nonmanifold_vertices);
        append(report.unused_vertices, piece.unused_vertices);
        duplicates.insert(duplicates.end(), piece.duplicate_faces.begin(), piece.duplicate_faces.end());
    }
    std::ranges::sort(duplicates);
    for (const Index face : duplicates) add(report.duplicate_faces, {face});
    for (Index f = 0; f < mesh.face_count(); ++f) {
        if (incidence.collapsed[f]) continue;
        ++live_faces;
        report.components += components.root(f) == f;
    }
    report.euler = std::int64_t(used_vertices) - std::int64_t(report.edges) + std::int64_t(live_faces);
}

void measure_faces(const Mesh& mesh, Incidence& incidence, const RunContext& context, TopologyReport& report) {
    const Box box = bounds(mesh);
    const double smallest = kDegenerateArea * box.diagonal() * box.diagonal();
    struct Sums {
        double area = 0, volume = 0; // volume: of tetrahedra over the box's centre, which keeps the digits
        Vec3d doubled_area = Vec3d::Zero();
    };
    std::vector<Sums> pieces((mesh.face_count() + kTopologyGrain - 1) / kTopologyGrain);
    parallel_for(context, mesh.face_count(), kTopologyGrain, [&](std::size_t begin, std::size_t end) {
        Sums& sums = pieces[begin / kTopologyGrain];
        for (std::size_t f = begin; f < end; ++f) {
            const std::span<const Index> face = mesh.face(f);
            const Vec3d doubled_area = doubled_area_vector(mesh.positions, face);
            const double area = 0.5 * doubled_area.norm();
            sums.volume += doubled_area.dot(mesh.positions[face[0]].cast<double>() - box.centre()) / 6;
            sums.doubled_area += doubled_area;
            sums.area += area;
            if (!(area > smallest)) incidence.degenerate[f] = 1;
        }
    });
    Vec3d doubled_area = Vec3d::Zero();
    for (const Sums& sums : pieces) {
        report.area += sums.area;
        report.volume += sums.volume;
        doubled_area += sums.doubled_area;
    }
    const bool encloses = report.is_closed() && report.is_oriented() && report.nonmanifold_edges.count == 0;
    if (!encloses) report.volume += doubled_area.dot(mesh.origin + box.centre()) / 6;
    for (Index f = 0; f < mesh.face_count(); ++f)
        if (incidence.degenerate[f]) add(report.degenerate_faces, {f});
}

} // namespace

TopologyReport analyse_topology(const Mesh& mesh, const RunContext& context) {
    TopologyReport report;
    report.vertices = mesh.vertex_count();
    report.faces = mesh.face_count();
    report.corners = mesh.corner_count();
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        report.triangles += mesh.face_size(f) == 3;
        report.quads += mesh.face_size(f) == 4;
    }
    report.polygons = report.faces - report.triangles - report.quads;
    report.box = bounds(mesh);
    if (!report.box.empty()) {
        report.box.min += mesh.origin;
        report.box.max += mesh.origin;
    }

    Incidence incidence = gather_incidence(mesh, context);
    analyse_vertices(mesh, incidence, context, report);
    measure_faces(mesh, incidence, context, report);
    const std::vector<Index> representative = weld_map(mesh.positions);
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        if (representative[v] != v) add(report.duplicate_vertices, {v});
    return report;
}

} // namespace filigree
