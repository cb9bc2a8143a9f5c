#include "filigree/fracture/crack_surfaces.h"

#include "filigree/core/lists.h"
#include "filigree/core/parallel_for.h"
#include "filigree/fracture/planar_fill.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>

namespace filigree {

namespace {

constexpr double kSpreadKept = 0.85; ///< of a border's offset, from one ring of points to the next
constexpr int kSpreadRounds = 8;
constexpr double kBumpSlope = 1.0 / 6; ///< finer bumps are no higher than this share of the way to the border

using Line = std::array<Index, 3>;   ///< three cells that meet along it, ascending
using Corner = std::array<Index, 4>; ///< four cells that meet at it, ascending

Corner corner_of(Index cell, const CellCorner& others) {
    Corner corner = {cell, others[0], others[1], others[2]};
    std::sort(corner.begin(), corner.end());
    return corner;
}

/// A stretch of a line inside the body, along gradient(i, j) x gradient(i, k).
struct LinePart {
    Index from, to;
    int winding; ///< of the surface around it
};

/// The lines on which three cells meet: where they run, and which stretches are inside.
class CrackLines {
public:
    CrackLines(CutSurface& cut, const FractureCells& cells, double edge)
        : cut_(cut), cells_(cells), seeds_(cells.grid()), edge_(edge) {
        find_lines();
        find_windings();
        for (auto& [name, line] : lines_) make_parts(line);
    }

    /// From one corner of a facet's outline to the next, as seen from `cell`.
    void append(Index cell, const CellFace& face, std::size_t corner, std::vector<PlanarSegment>& segments) const {
        const CellCorner &a = face.corners[corner], &b = face.corners[(corner + 1) % face.corners.size()];
        const Line name = line_between(cell, face.neighbour, a, b);
        const auto found = lines_.find(name);
        if (found == lines_.end()) return;
        const bool is_along = found->second.tail == corner_of(cell, a);
        for (const LinePart& part : found->second.parts)
            segments.push_back(is_along ? PlanarSegment{part.from, part.to, part.winding}
                                        : PlanarSegment{part.to, part.from, part.winding});
    }

private:
    struct Crossing {
        double along;
        Index vertex;
        int sign;
    };
    struct LineInside {
        Corner tail{}, head{};
        Vec3d direction;
        std::vector<Crossing> crossings;
        std::vector<LinePart> parts;
    };

    /// The line of an outline's side: the third cell is the one that both corners share.
    static Line line_between(Index cell, Index neighbour, const CellCorner& a, const CellCorner& b) {
        Line line = {cell, neighbour, kNoIndex};
        for (const Index other : a)
            if (other != neighbour && std::find(b.begin(), b.end(), other) != b.end()) line[2] = other;
        std::sort(line.begin(), line.end());
        return line;
    }

    void find_lines() {
        for (Index i = 0; i < cells_.count(); ++i)
            for (const CellFace& face : cells_.cell(i)) {
                if (face.neighbour < i || seeds_.is_ghost(face.neighbour)) continue;
                for (std::size_t k = 0; k < face.corners.size(); ++k) {
                    const CellCorner &a = face.corners[k], &b = face.corners[(k + 1) % face.corners.size()];
                    const Line name = line_between(i, face.neighbour, a, b);
                    if (seeds_.is_ghost(name[2])) continue;
                    const auto [at, is_new] = lines_.try_emplace(name);
                    if (is_new) orient(name, corner_of(i, a), corner_of(i, b), at->second);
                }
            }
        for (const LineCrossing& crossing : cut_.crossings) {
            LineInside& line = lines_.at(crossing.cells);
            line.crossings.push_back(
                {line.direction.dot(cut_.vertices.plane(crossing.vertex)), crossing.vertex, crossing.sign});
        }
    }

    void orient(const Line& name, const Corner& a, const Corner& b, LineInside& line) const {
        const GridPoint j = seeds_.gradient(name[0], name[1]), k = seeds_.gradient(name[0], name[2]);
        line.direction = to_double(j).cross(to_double(k));
        // The line leaves a corner into where the corner's fourth cell is not.
        const Index fourth = *std::find_if(
            a.begin(), a.end(), [&](Index cell) { return std::find(name.begin(), name.end(), cell) == name.end(); });
        const bool starts_at_a = determinant(j, k, seeds_.gradient(name[0], fourth)) > 0;
        line.tail = starts_at_a ? a : b;
        line.head = starts_at_a ? b : a;
    }

    /// Winding numbers of the corners, from those at ghosts inwards.
    void find_windings() {
        std::map<Corner, std::vector<const LineInside*>> at;
        for (const auto& [name, line] : lines_) {
            at[line.tail].push_back(&line);
            at[line.head].push_back(&line);
        }
        std::queue<Corner> waiting;
        for (const auto& [corner, lines] : at)
            if (seeds_.is_ghost(corner[3])) {
                winding_[corner] = 0;
                waiting.push(corner);
            }
        for (; !waiting.empty(); waiting.pop()) {
            const Corner corner = waiting.front();
            for (const LineInside* line : at[corner]) {
                int gain = 0; // towards the head
                for (const Crossing& crossing : line->crossings) gain -= crossing.sign;
                const bool is_tail = line->tail == corner;
                const Corner& other = is_tail ? line->head : line->tail;
                if (winding_.try_emplace(other, winding_[corner] + (is_tail ? gain : -gain)).second)
                    waiting.push(other);
            }
        }
    }

    Index vertex_of(const Corner& corner) {
        const auto [known, is_new] = vertices_.try_emplace(corner, kNoIndex);
        if (is_new) known->second = add(voronoi_vertex(seeds_, corner[0], corner[1], corner[2], corner[3]));
        return known->second;
    }
    Index add(const Vec3d& plane) { return cut_.vertices.add(cells_.warp().from_grid(plane).cast<float>(), plane, {}); }

    void make_parts(LineInside& line) {
        std::stable_sort(line.crossings.begin(), line.crossings.end(),
                         [](const Crossing& a, const Crossing& b) { return a.along < b.along; });
        int winding = winding_[line.tail];
        Index at = winding ? vertex_of(line.tail) : kNoIndex;
        for (const Crossing& crossing : line.crossings) {
            if (winding) add_parts(line, at, crossing.vertex, winding);
            winding -= crossing.sign;
            at = crossing.vertex;
        }
        if (winding) add_parts(line, at, vertex_of(line.head), winding);
    }

    void add_parts(LineInside& line, Index from, Index to, int winding) {
        const Vec3d a = cut_.vertices.plane(from), b = cut_.vertices.plane(to);
        const double length = cells_.warp().unstretched(b - a).norm();
        const int count = edge_ > 0 ? std::max(1, static_cast<int>(std::ceil(length / edge_))) : 1;
        for (int k = 1; k <= count; ++k) {
            const Index next = k == count ? to : add(a + double(k) / count * (b - a));
            if (next != from) line.parts.push_back({from, next, winding});
            from = next;
        }
    }

    CutSurface& cut_;
    const FractureCells& cells_;
    const GridSeeds& seeds_;
    double edge_;
    std::map<Line, LineInside> lines_;
    std::map<Corner, int> winding_;
    std::map<Corner, Index> vertices_;
};

struct AddedPoint {
    Vec3f position;
    Vec3d plane;
};

/// A facet's triangles before its new points have indices.
struct FilledFacet {
    std::vector<Index> outline; ///< vertices that local indices stand for
    std::vector<AddedPoint> added;
    std::vector<Triangle> triangles;
    bool is_fan = false;
};

/// Neighbours of each local point, each once or twice.
IndexLists neighbours_of(std::span<const Triangle> triangles, std::size_t points) {
    return make_lists<Index>(points, [&](const auto& add) {
        for (const Triangle& t : triangles)
            for (std::size_t k = 0; k < 3; ++k) {
                add(t[k], t[(k + 1) % 3]);
                add(t[k], t[(k + 2) % 3]);
            }
    });
}

/// Places the points inside a rough facet: on the crack, carried along by where the outline really is, with finer
/// bumps.
void place_rough(const CutSurface& cut, const FractureCells& cells, const FacetFrame& frame, double edge,
                 FilledFacet& facet) {
    const CrackWarp& warp = cells.warp();
    const std::size_t border = facet.outline.size(), count = border + facet.added.size();
    const IndexLists neighbours = neighbours_of(facet.triangles, count);
    std::vector<Vec3d> place(count), offset(count, Vec3d::Zero());
    for (std::size_t v = 0; v < border; ++v) {
        place[v] = cut.vertices.position(facet.outline[v]).cast<double>();
        offset[v] = place[v] - warp.from_grid(cut.vertices.plane(facet.outline[v]));
    }
    for (std::size_t v = border; v < count; ++v) place[v] = warp.from_grid(facet.added[v - border].plane);
    for (int round = 0; round < kSpreadRounds; ++round)
        for (std::size_t v = border; v < count; ++v) {
            if (neighbours[v].empty()) continue;
            Vec3d sum = Vec3d::Zero();
            for (const Index other : neighbours[v]) sum += offset[other];
            offset[v] = kSpreadKept / double(neighbours[v].size()) * sum;
        }

    std::vector<double> inward(count,
                               std::numeric_limits<double>::infinity()); // distance from the outline, along edges
    using Entry = std::pair<double, Index>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> waiting;
    for (std::size_t v = 0; v < border; ++v) {
        inward[v] = 0;
        waiting.emplace(0.0, static_cast<Index>(v));
    }
    while (!waiting.empty()) {
        const auto [distance, v] = waiting.top();
        waiting.pop();
        if (distance > inward[v]) continue;
        for (const Index other : neighbours[v]) {
            const double further = distance + (place[other] - place[v]).norm();
            if (further >= inward[other]) continue;
            inward[other] = further;
            waiting.emplace(further, other);
        }
    }
    const double shortest = 2 * edge, reach = warp.fine_reach(shortest);
    for (std::size_t v = border; v < count; ++v) {
        Vec3d p = place[v] + offset[v];
        if (reach > 0)
            p += std::min(1.0, kBumpSlope * inward[v] / reach) * warp.fine_height(place[v], shortest) * frame.z;
        facet.added[v - border].position = p.cast<float>();
    }
}

FilledFacet fill_facet(const CutSurface& cut, const FractureCells& cells, const FacetFrame& frame,
                       std::vector<PlanarSegment> segments, double edge) {
    FilledFacet facet;
    for (const PlanarSegment& s : segments) facet.outline.insert(facet.outline.end(), {s.from, s.to});
    std::sort(facet.outline.begin(), facet.outline.end());
    facet.outline.erase(std::unique(facet.outline.begin(), facet.outline.end()), facet.outline.end());
    const auto local = [&](Index vertex) {
        return static_cast<Index>(std::lower_bound(facet.outline.begin(), facet.outline.end(), vertex) -
                                  facet.outline.begin());
    };
    for (PlanarSegment& s : segments) s = {local(s.from), local(s.to), s.multiplicity};
    const auto in_model = [&](Index vertex) { return cells.warp().unstretched(cut.vertices.plane(vertex)); };
    const Vec3d origin = in_model(facet.outline[0]);
    std::vector<Vec2d> points;
    for (const Index vertex : facet.outline) {
        const Vec3d p = in_model(vertex) - origin;
        points.emplace_back(p.dot(frame.x), p.dot(frame.y));
    }
    PlanarFill fill = fill_plane(points, segments, {.edge = edge});
    facet.triangles = std::move(fill.triangles);
    facet.is_fan = fill.is_fan;
    for (const Vec2d& p : fill.added) {
        const Vec3d plane = cells.warp().stretched(origin + p[0] * frame.x + p[1] * frame.y);
        facet.added.push_back({Vec3f::Zero(), plane});
    }
    if (cells.warp().is_rough())
        place_rough(cut, cells, frame, edge, facet);
    else
        for (AddedPoint& point : facet.added) point.position = cells.warp().from_grid(point.plane).cast<float>();
    return facet;
}

} // namespace

FacetFrame facet_frame(const FractureCells& cells, Index i, Index j) {
    const Vec3d gradient = to_double(cells.grid().gradient(j, i));
    FacetFrame frame;
    frame.z = Vec3d(gradient.dot(cells.warp().stretched(Vec3d::UnitX())),
                    gradient.dot(cells.warp().stretched(Vec3d::UnitY())),
                    gradient.dot(cells.warp().stretched(Vec3d::UnitZ())))
                  .normalized();
    frame.x = frame.z.unitOrthogonal();
    frame.y = frame.z.cross(frame.x);
    return frame;
}

Result<CrackSurfaces> crack_surfaces(CutSurface& cut, const FractureCells& cells, double edge,
                                     const RunContext& context) {
    const CrackLines lines(cut, cells, edge);
    std::stable_sort(cut.segments.begin(), cut.segments.end(), [](const CrackSegment& a, const CrackSegment& b) {
        return std::pair(a.i, a.j) < std::pair(b.i, b.j);
    });
    // Outlines: along the surface, the other way round than the surface's own parts, and along the lines inside.
    CrackSurfaces result;
    std::vector<std::vector<PlanarSegment>> outlines;
    auto segment = cut.segments.begin();
    for (Index i = 0; i < cells.count(); ++i) {
        std::vector<const CellFace*> faces;
        for (const CellFace& face : cells.cell(i))
            if (face.neighbour > i && !cells.grid().is_ghost(face.neighbour)) faces.push_back(&face);
        std::sort(faces.begin(), faces.end(),
                  [](const CellFace* a, const CellFace* b) { return a->neighbour < b->neighbour; });
        for (const CellFace* face : faces) {
            std::vector<PlanarSegment> outline;
            for (; segment != cut.segments.end() && segment->i == i && segment->j == face->neighbour; ++segment)
                outline.push_back({segment->to, segment->from, 1});
            for (std::size_t k = 0; k < face->corners.size(); ++k) lines.append(i, *face, k, outline);
            if (outline.empty() || cells.piece_of(i) == cells.piece_of(face->neighbour)) continue;
            result.facets.push_back({i, face->neighbour, 0, 0, false});
            outlines.push_back(std::move(outline));
        }
    }

    std::vector<FilledFacet> filled(outlines.size());
    parallel_for(context, filled.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end && !context.is_cancelled(); ++k) {
            const CrackSurface& facet = result.facets[k];
            filled[k] = fill_facet(cut, cells, facet_frame(cells, facet.i, facet.j), std::move(outlines[k]), edge);
        }
    });
    if (context.is_cancelled()) return cancelled_error();

    for (std::size_t k = 0; k < filled.size(); ++k) {
        CrackSurface& facet = result.facets[k];
        std::vector<Index> vertex = std::move(filled[k].outline);
        for (const AddedPoint& point : filled[k].added)
            vertex.push_back(cut.vertices.add(point.position, point.plane, {}));
        facet.first = static_cast<Index>(result.triangles.size());
        facet.is_fan = filled[k].is_fan;
        for (const Triangle& t : filled[k].triangles) {
            const Triangle named = {vertex[t[0]], vertex[t[1]], vertex[t[2]]};
            if (named[0] != named[1] && named[1] != named[2] && named[2] != named[0]) result.triangles.push_back(named);
        }
        facet.count = static_cast<Index>(result.triangles.size()) - facet.first;
    }
    return result;
}

} // namespace filigree
