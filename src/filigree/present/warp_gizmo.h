// Handles in a view for the warps that have a slider: where they are, and what dragging them does.
#pragma once

#include "filigree/deform/warp_steps.h"
#include "filigree/render/camera_navigation.h"

#include <optional>
#include <span>
#include <vector>

namespace filigree {

/// One handle, in the world: a line (an arrow or an arc) with the knob that is dragged.
struct GizmoShape {
    WarpKind part;
    std::vector<Vec3d> line;
    Vec3d knob;
    bool has_tip = false; ///< the line ends as an arrow at the knob
};

/// The handles around a mesh as warped, on its sides towards the viewer; none for an empty box. rest_box: the mesh's at
/// rest, in the world.
std::vector<GizmoShape> gizmo_shapes(const Warps& warps, const Box& rest_box,
                                     const Vec3d& towards_viewer = Vec3d::Zero());

/// The handle whose knob is within `radius` pixels of a point, the nearest to it.
std::optional<WarpKind> gizmo_at(std::span<const GizmoShape> shapes, const Camera& camera, double x, double y,
                                 const PictureSize& size, double radius);

/// A handle that is held. The values stay in the ranges that Warps names.
class GizmoDrag {
public:
    GizmoDrag(WarpKind part, const Warps& start, const Box& rest_box, const Camera& camera, double x, double y,
              const PictureSize& size);
    WarpKind part() const { return part_; }
    /// The warps with the pointer there.
    Warps moved_to(double x, double y);

private:
    void look_at_circle(double angle, double radius); ///< of the knob
    double angle_at(double x, double y) const;
    double distance_at(double x, double y) const;

    WarpKind part_;
    Warps start_;
    Camera camera_;
    PictureSize size_;
    Vec3d centre_, along_, across_; ///< of the line that is followed, or of the circle (from along_ towards across_)
    double length_ = 1;             ///< from the centre to the knob
    double grabbed_ = 0;            ///< distance or angle where it was taken
    double last_angle_ = 0, turned_ = 0;
    bool is_seen_from_side_ = false; ///< the circle: the pointer's way along the knob's is followed instead
    Vec3d tangent_ = Vec3d::Zero();  ///< of the knob on screen, pixels a radian
    double press_x_ = 0, press_y_ = 0;
};

} // namespace filigree
