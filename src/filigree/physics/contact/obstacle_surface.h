// The triangles of an obstacle, as walls with two sides: what is closest, what a way meets first, and how a point that
// wants to go through is held on the side it came from. Private to the layer.
#pragma once

#include "filigree/mesh/closest_point.h"
#include "filigree/physics/world.h"

#include <optional>

namespace filigree {

/// Where a way meets a wall first.
struct WallCrossing {
    double at = 0;                ///< part of the way, 0 .. 1
    Vec3d normal = Vec3d::Zero(); ///< unit, of the wall's plane, to the side that the way comes from
    double plane = 0;             ///< normal.dot(x) of the plane's points
    Index triangle = kNoIndex;
};

/// The closest point of a surface.
struct ClosestWall {
    Index triangle = kNoIndex; ///< none: nothing is as near as was asked
    Vec3d position = Vec3d::Zero();
    double distance = std::numeric_limits<double>::infinity(); ///< m; below 0 inside a closed surface
    /// Unit, the mean of the faces there by their angles, as they run in the file or, of closed surfaces, outwards
    /// [Baerentzen 2005].
    Vec3d normal = Vec3d::Zero();
};

/// How a point touches a wall that it has gone through.
struct WallTouch {
    double depth = 0;             ///< m from the wall; 0: it touches nothing
    Vec3d normal = Vec3d::Zero(); ///< unit, back to the side that it came from
};

/// Built once an obstacle. Coordinates are the obstacle's own, m. Safe from many threads.
class ObstacleSurface {
public:
    /// Of a mesh with coordinates times `scale`, relative to the mesh's origin. All faces are walls: also those that
    /// are there twice, or lie between matter and matter. Errors: as make_surface; unsuitable (no face has an area).
    static Result<ObstacleSurface> create(const Mesh& mesh, double scale, const RunContext& context);
    explicit ObstacleSurface(const Cuboid& box);
    ObstacleSurface(ObstacleSurface&&) noexcept = default;

    /// No further than `reach`. Cost O(log F).
    ClosestWall closest(const Vec3d& point, double reach = std::numeric_limits<double>::infinity()) const;
    /// m: as far as this around a point there is no wall; at most `reach`. Cost O(log F), less where it is far.
    double clearance(const Vec3d& point, double reach) const;
    /// What stands between two points; from either side. Cost O(log F) for ways as short as triangles.
    std::optional<WallCrossing> first_crossing(const Vec3d& from, const Vec3d& to) const;
    /// Moves `place`, which stands free, towards `target`: straight as far as nothing is in the way, then along the
    /// walls to the closest point of them [Zilles 1995]. Where it gets there, nothing touches. A place never goes
    /// through a wall, however long the way, so whoever keeps it knows the side that a point came in from.
    WallTouch follow(Vec3d& place, const Vec3d& target) const;

    /// Whether it has an inside: no edge is open, and faces can be turned so that they all look outwards.
    bool is_closed() const { return is_closed_; }
    bool looked_inwards() const { return looked_inwards_; } ///< closed, and its faces ran so that they looked inwards
    /// Edges at which the surface ends or bends by more than 32 degrees, and, without length, the tips of spikes.
    struct Edge {
        Vec3d from, to;
    };
    std::span<const Edge> sharp_edges() const { return sharp_edges_; }
    const Box& box() const { return box_; }
    double margin() const { return margin_; } ///< m: how far places stay from walls
    std::span<const Vec3f> positions() const { return positions_; }
    std::span<const Triangle> triangles() const { return triangles_; }

private:
    friend struct WorldParts; // writes it to bytes
    ObstacleSurface() = default;
    void prepare();
    void find_sharp_edges();
    void find_spikes();
    template <class Visit>
    void each_near(const Vec3d& point, double radius, const Visit& visit) const;
    std::array<Vec3d, 3> corners(Index triangle) const;
    bool is_over(Index triangle, const Vec3d& point) const;
    std::optional<WallCrossing> crossing(Index triangle, const Vec3d& from, const Vec3d& to) const;

    struct Plane {
        Vec3d normal;
        double at; ///< normal.dot(x); not a number: the triangle has no area
    };
    std::vector<Vec3f> positions_;
    std::vector<Triangle> triangles_;
    std::vector<Plane> planes_;
    std::vector<Edge> sharp_edges_;
    Box box_;
    double margin_ = 0, edge_ = 0; ///< m; edge_: about as long as edges are
    bool is_closed_ = false, looked_inwards_ = false;
    std::unique_ptr<const ClosestPointTree> tree_; ///< null: there are so few that all are tried
};

} // namespace filigree
