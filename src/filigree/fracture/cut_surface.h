// A surface cut along the borders of cells.
#pragma once

#include "filigree/fracture.h"
#include "filigree/fracture/crack_warp.h"
#include "filigree/fracture/voronoi.h"
#include "filigree/mesh/surface.h"

#include <array>
#include <unordered_map>

namespace filigree {

/// The mesh's vertices and, behind them, those that the cut adds. Vertices at one place, to the bit, are one.
class CutVertices {
public:
    CutVertices(std::span<const Vec3f> mesh_positions, std::vector<GridPoint> grid);

    Index mesh_count() const { return mesh_count_; }
    Index count() const { return static_cast<Index>(positions_.size()); }
    const Vec3f& position(Index vertex) const { return positions_[vertex]; }
    std::span<const Vec3f> positions() const { return positions_; }
    /// On the grid, where cracks are planes.
    Vec3d plane(Index vertex) const {
        return vertex < grid_.size() ? to_double(grid_[vertex]) : planes_[vertex - grid_.size()];
    }
    const GridPoint& grid(Index vertex) const { return grid_[vertex]; } ///< of those that triangles had before the cut
    /// Of a vertex that the cut added; all kNoIndex inside the body.
    const FacePoint& source(Index vertex) const { return sources_[vertex - mesh_count_]; }
    /// The mesh's own vertex, or an added vertex's source.
    FacePoint surface_point(Index vertex) const;

    /// Before the cut: a vertex of refined or closing triangles.
    Index add_corner(const Vec3f& position, const GridPoint& grid, const FacePoint& source);
    /// Makes this vertex known to those that are added at its place.
    void register_place(Index vertex) { places_.try_emplace(key_of(positions_[vertex]), vertex); }
    /// From the cut on: the vertex at the place, a new one unless there is one.
    Index add(const Vec3f& position, const Vec3d& plane, const FacePoint& source);

private:
    struct PlaceHash {
        std::size_t operator()(const std::array<std::uint32_t, 3>& key) const;
    };
    static std::array<std::uint32_t, 3> key_of(const Vec3f& p);

    Index mesh_count_;
    std::vector<Vec3f> positions_;
    std::vector<GridPoint> grid_;
    std::vector<Vec3d> planes_; ///< of vertices behind those in grid_
    std::vector<FacePoint> sources_;
    std::unordered_map<std::array<std::uint32_t, 3>, Index, PlaceHash> places_;
};

/// A triangle of the surface before the cut.
struct UncutTriangle {
    Triangle vertices;
    Index source; ///< triangle of the Surface; kNoIndex: it closes an open border and is not of the mesh
};

/// Part of a triangle in one cell, convex, with the triangle's orientation.
struct CutPolygon {
    Index cell, triangle; ///< triangle: of CutSurface::triangles
    Index first, count;   ///< its vertices, in CutSurface::polygon_vertices
};

/// A piece of a crack line on the surface: the border of cell i against cell j, as cell i's polygon runs along it.
struct CrackSegment {
    Index i, j; ///< i < j
    Index from, to;
};

/// Where the line on which three cells meet goes through the surface.
struct LineCrossing {
    std::array<Index, 3> cells; ///< ascending
    Index vertex;
    int sign; ///< of the surface's normal along gradient(i, j) x gradient(i, k)
};

struct CutSurface {
    explicit CutSurface(CutVertices uncut) : vertices(std::move(uncut)) {}

    CutVertices vertices;
    std::vector<UncutTriangle> triangles;
    std::vector<Index> cell_of_triangle; ///< kNoIndex: it is cut
    std::vector<CutPolygon> polygons;    ///< of triangles that are cut, in their order
    std::vector<Index> polygon_vertices;
    std::vector<CrackSegment> segments;
    std::vector<LineCrossing> crossings;
    std::size_t closing_triangles = 0; ///< the last ones: cones over open borders
    double closing_area = 0, area = 0; ///< of those, and of the mesh's own; model units squared
    double volume = 0;                 ///< of the mesh, its borders closed; model units cubed
    Box box;                           ///< of the triangles
};

/// Cuts a mesh's surface. Open borders are closed by cones; where cracks are rough, triangles near them are divided
/// until their edges follow. All signs are exact (cell_signs.h). Cost: 24 hashes a vertex where cracks are rough, about
/// 15 products a vertex, 1 us a part of a cut triangle. Errors: cancelled.
Result<CutSurface> cut_surface(const Mesh& mesh, const Surface& surface, const FractureCells& cells,
                               const RunContext& context);

} // namespace filigree
