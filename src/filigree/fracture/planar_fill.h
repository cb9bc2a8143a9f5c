// Triangles that fill outlines in a plane, and always close with them.
#pragma once

#include "filigree/mesh.h"
#include "filigree/types.h"

namespace filigree {

using Vec2d = Eigen::Vector2d;

/// Part of an outline; what it goes round counter-clockwise is inside.
struct PlanarSegment {
    Index from, to;
    int multiplicity = 1;
};

struct PlanarFillOptions {
    double edge = 0; ///< longest edges wanted inside, in the points' unit; 0: no points are added for their sake
};

struct PlanarFill {
    std::vector<Vec2d> added;        ///< points beside those given; their indices follow them
    std::vector<Triangle> triangles; ///< counter-clockwise where outlines wind that way; as often as they wind
    bool is_fan = false;             ///< nothing better than a fan over the outline was found
};

/// segments: closed, that is, as many leave each point as arrive (with multiplicity); they may cross and overlap.
/// The triangles' edges cancel but for the segments, exactly and always. Outlines are not divided; inside, triangles
/// grow from the outline's lengths to options.edge. Cost: about 2 us a triangle.
PlanarFill fill_plane(std::span<const Vec2d> points, std::span<const PlanarSegment> segments,
                      const PlanarFillOptions& options);

/// Delaunay triangles of points, counter-clockwise; points that round to one place count once, and points on a line
/// give none. Where points are almost on a line the hull may lack thin triangles. Cost: about 1 us a point.
std::vector<Triangle> delaunay_triangles(std::span<const Vec2d> points);

} // namespace filigree
