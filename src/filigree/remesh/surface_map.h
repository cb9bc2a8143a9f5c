// A triangle manifold under local changes, each recorded as a piecewise linear bijection: however far the surface is
// changed, every point of it knows its place on the surface it began as.
#pragma once

#include "filigree/mesh/edges.h"
#include "filigree/remesh/manifold_surface.h"

#include <cstdint>
#include <vector>

namespace filigree {

using Vec2d = Eigen::Vector2d;

/// A point of a triangle: barycentrics in the triangle's order, >= 0, of sum 1.
struct TrianglePoint {
    Index triangle = kNoIndex;
    Vec3d barycentric = Vec3d::Zero();
};

/// What a vertex may do. Borders count as curves.
enum class VertexKind : std::uint8_t {
    inside, ///< moves anywhere
    curve,  ///< moves along its feature curve
    corner, ///< stays
};

/// The triangles around a vertex, counter-clockwise. Triangle i lies between ring[i] and ring[i + 1] (the first again
/// after the last when closed); open stars, on borders, have one more ring vertex than triangles.
struct Star {
    Index centre = kNoIndex;
    bool open = false;
    std::vector<Index> half_edges; ///< one a triangle: from the centre to ring[i]
    std::vector<Index> ring;
    std::vector<Vec2f> flat; ///< `flatten`: the ring in the plane, centre at zero, the furthest at distance 1
    /// Where the feature curve leaves: positions in `ring`; only for curve vertices.
    std::size_t curve_a = 0, curve_b = 0;

    std::size_t triangle_count() const { return half_edges.size(); }
    std::size_t next(std::size_t i) const { return i + 1 == ring.size() ? 0 : i + 1; }
};

/// The surface that changes, and the records. Triangles live in slots, which are reused; half-edge 3 s + i runs from
/// corner i of slot s to its corner i + 1. Vertices keep their ids.
/// Method: [Lee 1998]; each record triangulates one polygon of the plane in two ways, so it is a bijection, and so is
/// any chain of them. Memory: about 200 bytes a change.
class SurfaceMap {
public:
    /// twins: opposite_half_edges of the surface, which must outlive the map. feature: 3 F, whether a half-edge's edge
    /// must stay an edge (alike on twins; borders always do). corner: V, whether a vertex must stay; vertices with
    /// other than none or two feature edges are made corners.
    SurfaceMap(const ManifoldSurface& surface, std::span<const Index> twins, std::span<const std::uint8_t> feature,
               std::span<const std::uint8_t> corner);

    std::size_t slot_count() const { return triangles_.size(); }
    std::size_t triangle_count() const { return triangle_count_; }
    std::size_t vertex_count() const { return positions_.size(); } ///< removed ones too
    bool is_removed(Index slot) const { return triangles_[slot][0] == kNoIndex; }
    bool is_vertex_removed(Index vertex) const { return out_[vertex] == kNoIndex; }
    const Triangle& triangle(Index slot) const { return triangles_[slot]; }
    const Vec3d& position(Index vertex) const { return positions_[vertex]; }
    VertexKind kind(Index vertex) const { return kind_[vertex]; }
    Index valence(Index vertex) const { return valence_[vertex]; } ///< triangles around it
    bool is_border(Index half_edge) const { return twin_[half_edge] == kNoIndex; }
    Index twin(Index half_edge) const { return twin_[half_edge]; }
    bool is_feature(Index half_edge) const { return feature_[half_edge] != 0; } ///< borders too
    Index from(Index half_edge) const { return triangles_[half_edge / 3][half_edge % 3]; }
    Index to(Index half_edge) const { return from(next_half_edge(half_edge)); }
    /// A half-edge that leaves the vertex; on borders the first, counter-clockwise.
    Index out(Index vertex) const { return out_[vertex]; }
    double area(Index slot) const;
    /// Twice the area long, out of the surface.
    Vec3d normal(Index slot) const;
    /// The area of the original surface that a triangle stands for.
    double covered_area(Index slot) const { return covered_[slot]; }
    bool are_neighbours(Index a, Index b) const;
    /// How many triangles lie at the half-edge's first vertex between two feature edges, this one's among them; all of
    /// them where there is no feature. On curves and at corners no further than kMostCounted are counted.
    static constexpr std::size_t kMostCounted = 64;
    std::size_t sector_size(Index half_edge) const;

    /// The angle of a half-edge's triangle where it starts, radians.
    double corner_angle(Index half_edge) const;
    /// The sum of those between two feature edges, this one's among them. Needs a feature at the half-edge's start.
    double sector_angle(Index half_edge) const;

    void star(Index vertex, Star& star) const;
    /// Lays the star out: distances to the centre as they are, angles scaled to a full turn, to half a turn on each
    /// side of a curve, so that the curve is straight. False when it cannot be (a curve with a single triangle at its
    /// side). Not for corners.
    bool flatten(Star& star) const;

    /// Moves everything at the star's centre to ring[target]. Needs: the link condition, a flat star, and that in the
    /// plane each triangle of the star without ring[target] stays positive with the centre put there.
    void collapse(const Star& star, std::size_t target);
    /// Moves the star's centre to `place` of the plane, inside the star's kernel; on a curve, along it (second
    /// coordinate 0, the curve runs from curve_a on the positive first axis to curve_b on the negative one).
    void relocate(const Star& star, const Vec2f& place);
    /// Where relocate would put the centre.
    TrianglePoint locate(const Star& star, const Vec2f& place) const;
    /// The two triangles of an edge unfolded, in edge lengths: from at zero, to at (1, 0), the half-edge's own opposite
    /// corner above, the twin's below.
    struct Unfolded {
        Vec2f to, above, below;
    };
    Unfolded unfold(Index half_edge) const;
    /// Turns the edge: it then joins the two opposite corners. Needs: no feature, those corners no neighbours, and the
    /// unfolded quad convex.
    void flip(Index half_edge);
    /// Puts a vertex at `share` of the way along the edge; it is a curve vertex on features. Returns its id.
    Index split(Index half_edge, double share = 0.5);

    /// The place on the original surface of a point of a slot. Cost: the number of records over it, 15 to 40.
    TrianglePoint trace(const TrianglePoint& point) const;
    /// A place on the original surface, in space.
    Vec3d original_position(const TrianglePoint& point) const;
    std::size_t record_count() const { return records_.size(); }

private:
    struct Record {
        std::uint32_t points, old_faces; ///< first of each
        std::uint8_t old_count;
    };
    struct OldFace {
        Index face;
        std::array<std::uint8_t, 3> local;
    };
    struct NewFace {
        std::uint32_t record;
        std::array<std::uint8_t, 3> local;
    };

    void begin_record(std::size_t points);
    void add_old(Index slot, std::array<std::uint8_t, 3> local);
    void add_new(Index slot, std::array<std::uint8_t, 3> local);
    void record_star(const Star& star);
    std::array<std::uint8_t, 3> star_corners(const Star& star, std::size_t i) const;
    std::array<std::uint8_t, 3> corners_among(const std::array<Index, 4>& points, Index slot) const;
    void link(Index a, Index b, bool feature);
    void hand_on_area(std::span<const Index> slots, std::span<const double> planar_areas, double total);

    const ManifoldSurface& surface_;
    std::vector<Vec3d> positions_;
    std::vector<Triangle> triangles_;
    std::vector<Index> twin_;
    std::vector<std::uint8_t> feature_;
    std::vector<Index> face_; ///< of each slot: its id in the chain of records
    std::vector<double> covered_;
    std::vector<Index> out_;
    std::vector<Index> valence_;
    std::vector<VertexKind> kind_;
    std::vector<std::uint8_t> on_border_;
    std::size_t triangle_count_ = 0;

    std::vector<Record> records_;
    std::vector<Vec2f> points_;
    std::vector<OldFace> old_faces_;
    std::vector<NewFace> new_faces_; ///< of face id - number of original triangles
};

} // namespace filigree
