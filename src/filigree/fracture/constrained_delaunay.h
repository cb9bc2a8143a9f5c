// A constrained Delaunay triangulation of integer points in the plane, with winding numbers.
#pragma once

#include "filigree/types.h"

#include <array>
#include <optional>

namespace filigree {

using PlanePoint = std::array<std::int64_t, 2>; ///< within +-kPlaneHalf

/// Points come one by one, then directed segments with a multiplicity. Every decision is exact.
class ConstrainedDelaunay {
public:
    static constexpr std::int64_t kPlaneHalf = 1 << 25;

    /// A triangle, counter-clockwise. Edge k runs from vertices[k] to the next one.
    struct Face {
        std::array<Index, 3> vertices;
        std::array<Index, 3> across; ///< the face at edge k; kNoIndex outside all
        std::array<int, 3> net;      ///< how often segments run along edge k, less how often they run back
        int winding = 0;
    };

    ConstrainedDelaunay();

    /// The vertex at the point, a new one unless there is one.
    Index insert(const PlanePoint& point);
    /// Adds a segment; it runs over vertices that lie on it, and crosses other segments in vertices that are added at
    /// the rounded crossing. False: rounding left no way, and the triangulation is of no use any more.
    bool constrain(Index from, Index to, int multiplicity);
    /// Fills in Face::winding from the segments. False: they do not close.
    bool find_windings();
    /// Once windings are known: a vertex at the circumcentre of a face, unless a segment is in the way or close to it.
    /// New faces go to `changed`.
    std::optional<Index> insert_circumcentre(Index face, std::vector<Index>& changed);

    std::size_t face_count() const { return faces_.size(); }
    const Face& face(std::size_t k) const { return faces_[k]; }
    const PlanePoint& point(Index vertex) const { return points_[vertex]; }
    std::size_t vertex_count() const { return points_.size(); }
    /// The first three vertices are corners of a triangle around everything.
    static bool is_outer(Index vertex) { return vertex < 3; }

private:
    struct Place {
        Index face;
        int edge;     ///< the point lies on this edge; -1: inside
        Index vertex; ///< the point is this vertex; kNoIndex: none
    };
    /// The faces (a, b, c) and (b, a, d) at an edge a b, and the numbers of their other edges.
    struct EdgeSides {
        Index other; ///< the second of the two
        Face first, second;
        Index a, b, c, d;
        int bc, ca, ad, db;
    };
    EdgeSides both_sides(Index face, int edge) const;
    Place locate(const PlanePoint& point);
    int side(Index a, Index b, Index c) const;
    int corner_of(Index face, Index vertex) const;
    int edge_to(Index face, Index other) const;
    /// The face and edge that run from a to b; kNoIndex: none does.
    std::pair<Index, int> find_edge(Index a, Index b) const;
    Index add_vertex(const PlanePoint& point);
    void relink(Index face, Index from, Index to);
    void split_face(Index face, Index vertex);
    void split_edge(Index face, int edge, Index vertex);
    bool can_split_edge(Index face, int edge, const PlanePoint& point) const;
    void flip(Index face, int edge);
    void legalize(Index vertex);
    bool is_delaunay(Index face, int edge) const;
    bool constrain_between(Index from, Index to, std::vector<std::pair<Index, Index>> crossed);
    void add_net(Index a, Index b, int multiplicity);

    std::vector<PlanePoint> points_;
    std::vector<Face> faces_;
    std::vector<Index> face_at_; ///< one of each vertex
    std::vector<Index> stack_;   ///< of legalize
    Index last_ = 0;             ///< where the last search ended
    unsigned turn_ = 0;          ///< walks begin with another edge each step, so that none goes round for ever
};

} // namespace filigree
