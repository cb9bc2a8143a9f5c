// Moving points over a surface: to the closest place that can be reached from where they are.
#pragma once

#include "filigree/remesh/manifold_surface.h"
#include "filigree/remesh/surface_map.h"

namespace filigree {

/// Steps from triangle to triangle downhill in distance, so that a point never jumps to another sheet that happens to
/// be near. Features and borders are not crossed. Views: everything must outlive it. Safe from many threads at once.
class SurfaceWalk {
public:
    /// twins, features (borders too): of the surface's half-edges; kinds: of its vertices.
    SurfaceWalk(const ManifoldSurface& surface, std::span<const Index> twins, std::span<const std::uint8_t> features,
                std::span<const VertexKind> kinds)
        : surface_(surface), twins_(twins), features_(features), kinds_(kinds) {}

    const ManifoldSurface& surface() const { return surface_; }
    std::span<const Index> twins() const { return twins_; }
    std::span<const VertexKind> kinds() const { return kinds_; }

    struct Place {
        TrianglePoint point;
        Vec3d position = Vec3d::Zero();
    };
    /// From `start` towards the place closest to `target`. Cost: the triangles between.
    Place walk(const TrianglePoint& start, const Vec3d& target) const;
    /// The same along the feature curve that `start` lies on; stops at corners.
    Place slide(const TrianglePoint& start, const Vec3d& target) const;

    Vec3d position(const TrianglePoint& point) const;
    /// Unit normal of the point's triangle; zero where it has no area.
    Vec3d normal(const TrianglePoint& point) const;

private:
    Index from(Index h) const { return surface_.triangles[h / 3][h % 3]; }
    Index to(Index h) const { return from(next_half_edge(h)); }
    Index curve_at(const TrianglePoint& point) const;
    Index onward(Index half_edge) const;

    const ManifoldSurface& surface_;
    std::span<const Index> twins_;
    std::span<const std::uint8_t> features_;
    std::span<const VertexKind> kinds_;
};

} // namespace filigree
