// Labels spread along shortest paths over the mesh's edges, so that a vertex is near its label along the surface,
// not through it. The walk compares a triangle with all that share a corner with it, and before it ends far from the
// surface with those around these.
#include "filigree/blend/bind.h"

#include "filigree/core/parallel_for.h"
#include "filigree/levels/nearest_sources.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/edges.h"

#include <algorithm>
#include <optional>

namespace filigree {

namespace {

/// How well a vertex could be bound; see Binding.
enum class BondKind : std::uint8_t { good, away, gap };

/// What rules a cell out quickly: its normal (any length) and a sphere around it.
struct CellShape {
    Vec3f normal, centre;
    float radius;
};

CellShape cell_shape(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    const Vec3f centre = (a + b + c) / 3;
    const float radius = std::max({(a - centre).norm(), (b - centre).norm(), (c - centre).norm()});
    return {(b - a).cross(c - a), centre, radius * 1.0001f};
}

/// How much closer a cell that faces away has to be than one that does not. Without a limit, steep detail whose own
/// cell leans the other way ends up on a cell far off; without a preference, on the other side of thin parts.
constexpr double kAwayCost = 4;
constexpr double kAwayStart = 0.25; // and how far off it counts where it touches, in radii of the cell

/// From which distance on, in radii of the cell, the walk looks one ring further before it ends: on a bent driver a
/// cell may be closer than all around it, and far from the closest.
constexpr double kFarStart = 0.3;

/// The walk of one vertex over the driver's triangles.
class Walk {
public:
    Walk(std::span<const Vec3f> positions, std::span<const Triangle> cells, const IndexLists& around,
         std::span<const CellShape> shapes)
        : positions_(positions), cells_(cells), around_(around), shapes_(shapes), visited_(cells.size(), 0) {}

    struct Found {
        SurfacePoint point;
        bool faces_away = false;
        double cost = std::numeric_limits<double>::infinity(); ///< distance, more when facing away
    };

    /// start: some vertices of cells.
    Found closest(const Vec3f& p, const Vec3f& normal, std::span<const Index> start) {
        if (++stamp_ == 0) {
            std::fill(visited_.begin(), visited_.end(), 0);
            stamp_ = 1;
        }
        Found best;
        for (const Index vertex : start) visit_ring(vertex, p, normal, best);
        for (Index at = kNoIndex; at != best.point.triangle;) {
            at = best.point.triangle;
            for (Index corner : cells_[at]) visit_ring(corner, p, normal, best);
            if (best.point.triangle == at && best.cost > kFarStart * double(shapes_[at].radius))
                for (Index corner : cells_[at])
                    for (Index t : around_[corner])
                        for (Index beyond : cells_[t]) visit_ring(beyond, p, normal, best);
        }
        return best;
    }

private:
    void visit_ring(Index vertex, const Vec3f& p, const Vec3f& normal, Found& best) {
        for (Index t : around_[vertex]) {
            if (visited_[t] == stamp_) continue;
            visited_[t] = stamp_;
            const CellShape& shape = shapes_[t];
            const bool faces_away = shape.normal.dot(normal) < 0;
            const double factor = faces_away ? kAwayCost : 1;
            const double start = faces_away ? kAwayStart * double(shape.radius) : 0;
            const double reach = std::max(0.0, best.cost - start) / factor + double(shape.radius);
            if (double((p - shape.centre).squaredNorm()) > reach * reach) continue;
            SurfacePoint point = closest_point_on_triangle(p, positions_[cells_[t][0]], positions_[cells_[t][1]],
                                                           positions_[cells_[t][2]]);
            const double cost = start + factor * point.distance;
            const bool better = cost != best.cost               ? cost < best.cost
                                : faces_away != best.faces_away ? !faces_away
                                                                : t < best.point.triangle;
            if (!better) continue;
            point.triangle = t;
            best = {point, faces_away, cost};
        }
    }

    std::span<const Vec3f> positions_;
    std::span<const Triangle> cells_;
    const IndexLists& around_;
    std::span<const CellShape> shapes_;
    std::vector<unsigned> visited_;
    unsigned stamp_ = 0;
};

Bond bond_at(const SurfacePoint& point) { return {point.triangle, point.barycentric[1], point.barycentric[2]}; }

std::vector<Index> nearest_driver_vertices(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                           std::span<const Triangle> cells) {
    std::vector<bool> in_driver(positions.size(), false);
    for (const Triangle& cell : cells)
        for (Index v : cell) in_driver[v] = true;
    return nearest_sources(positions, triangles, triangles_at_vertices(triangles, positions.size()), in_driver);
}

/// Bonds of the representatives by a walk from the driver vertex near them, or from the cell of the vertex they were
/// removed beside. The normals of loose parts do not count: such a part lies on one side of the surface.
void walk_to_bonds(std::span<const Vec3f> positions, std::span<const Triangle> cells, std::span<const Vec3f> normals,
                   std::span<const Index> representative, const NearestDriver& nearest, const RemovedVertices& removed,
                   std::span<Bond> bonds, std::span<BondKind> kinds, const RunContext& context) {
    const IndexLists around = triangles_at_vertices(cells, positions.size());
    std::vector<CellShape> shapes;
    for (const Triangle& cell : cells)
        shapes.push_back(cell_shape(positions[cell[0]], positions[cell[1]], positions[cell[2]]));
    const auto start_of = [&](Index v) -> std::span<const Index> {
        const Index beside = removed.empty() ? kNoIndex : removed.nearest_left[v];
        if (beside != kNoIndex && bonds[beside].cell != kNoIndex) return cells[bonds[beside].cell];
        if (nearest.vertex[v] != kNoIndex) return std::span(nearest.vertex).subspan(v, 1);
        return {};
    };
    const auto walk_round = [&](std::uint8_t round) {
        parallel_for(context, positions.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
            if (context.is_cancelled()) return;
            Walk walk(positions, cells, around, shapes);
            for (std::size_t v = begin; v < end; ++v) {
                if (representative[v] != v) continue;
                if (!removed.empty() && removed.removed[v] != round) continue;
                const std::span<const Index> start = start_of(Index(v));
                const bool is_loose = start.empty() || nearest.loose(v);
                if (is_loose) kinds[v] = BondKind::gap;
                if (start.empty()) continue;
                const Vec3f normal = is_loose ? Vec3f(Vec3f::Zero()) : normals[v];
                const Walk::Found found = walk.closest(positions[v], normal, start);
                bonds[v] = bond_at(found.point);
                if (found.faces_away) kinds[v] = BondKind::away;
            }
        });
    };
    walk_round(0); // what was left last first: the others hang near it
    for (std::uint8_t round = removed.rounds; round > 0; --round) walk_round(round);
}

/// Bonds of what nothing is near, as in a mesh without triangles: the closest cell.
void bind_to_closest(std::span<const Vec3f> positions, std::span<const Triangle> cells,
                     std::span<const Index> representative, std::span<Bond> bonds, const RunContext& context) {
    const auto is_unbound = [&](Index v) { return representative[v] == v && bonds[v].cell == kNoIndex; };
    Index first = 0;
    while (first < positions.size() && !is_unbound(first)) ++first;
    if (first == positions.size()) return;
    const ClosestPointTree tree(positions, cells, context);
    parallel_for(context, positions.size(), 1 << 12, [&](std::size_t begin, std::size_t end) {
        if (context.is_cancelled()) return;
        for (Index v = Index(begin); v < end; ++v)
            if (is_unbound(v)) bonds[v] = bond_at(tree.closest(positions[v]));
    });
}

std::optional<Error> check_size(const Surface& surface, std::span<const Triangle> cells) {
    if (std::max(surface.triangles.size(), cells.size()) <= kMostListedTriangles) return std::nullopt;
    return Error{ErrorCode::unsuitable, "The mesh has more triangles than 32-bit indices can list (" +
                                            std::to_string(kMostListedTriangles) + "); split it into parts."};
}

} // namespace

Result<Binding> bind_to_driver(std::span<const Vec3f> positions, const Surface& surface, std::span<const Vec3f> normals,
                               std::span<const Triangle> cells, std::span<const Triangle> beside,
                               const RunContext& context) {
    context.report("bind", 0);
    if (std::optional<Error> error = check_size(surface, cells)) return *error;
    const NearestDriver nearest = hang_loose_parts(
        positions, surface, beside, cells, nearest_driver_vertices(positions, surface.triangles, cells), context);
    if (context.is_cancelled()) return cancelled_error();
    context.report("bind", 0.4);
    return bind_to_driver(positions, surface, normals, cells, nearest, {}, context);
}

Result<Binding> bind_to_driver(std::span<const Vec3f> positions, const Surface& surface, std::span<const Vec3f> normals,
                               std::span<const Triangle> cells, const NearestDriver& nearest,
                               const RemovedVertices& removed, const RunContext& context) {
    if (std::optional<Error> error = check_size(surface, cells)) return *error;
    Binding binding{.bonds = std::vector<Bond>(positions.size()), .across_gap = {}, .facing_away = {}};
    std::vector<BondKind> kinds(positions.size(), BondKind::good);
    const std::span<const Index> representative = surface.representative;
    walk_to_bonds(positions, cells, normals, representative, nearest, removed, binding.bonds, kinds, context);
    if (context.is_cancelled()) return cancelled_error();
    bind_to_closest(positions, cells, representative, binding.bonds, context);
    if (context.is_cancelled()) return cancelled_error();
    for (Index v = 0; v < representative.size(); ++v) {
        const Index r = representative[v];
        binding.bonds[v] = binding.bonds[r];
        if (kinds[r] == BondKind::gap) binding.across_gap.push_back(v);
        if (kinds[r] == BondKind::away) binding.facing_away.push_back(v);
    }
    context.report("bind", 1);
    return binding;
}

} // namespace filigree
