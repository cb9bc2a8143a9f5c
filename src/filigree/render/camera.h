// Where a picture is taken from.
#pragma once

#include "filigree/core/view.h"
#include "filigree/mesh/mesh.h"

#include <Eigen/Geometry>

namespace filigree {

/// A camera in the world. Right-handed; looks from `eye` to `target`.
struct Camera {
    Vec3d eye = {0, 0, 1}, target = {0, 0, 0}, up = {0, 1, 0}; ///< up need not be at right angles to the view
    double field_of_view_deg = 30; ///< the vertical angle of view, below 180; 0: parallel projection
    double height = 1;             ///< parallel projection: model units from the bottom to the top of the picture

    /// Columns right, up and back of the camera: unit, at right angles. A view along `up` takes another up, so that
    /// what is in front (as View has it) stays at the bottom of the picture from above, and at the top from below.
    Mat3d basis() const;
    /// World to camera space: x right, y up, z towards the viewer.
    Vec3d to_camera(const Vec3d& world) const { return basis().transpose() * (world - eye); }
    /// Camera space to clip space; depth -1 at `near` and 1 at `far` (distances along the view, 0 < near < far).
    Eigen::Matrix4d projection(double aspect, double near, double far) const;
    /// Where a world point falls on a picture of that size, in pixels from the top left; z: distance along the view (a
    /// perspective has no place for points where it is not above 0).
    Vec3d project(const Vec3d& world, double width, double height) const;
    /// The ray through a pixel (from the top left, fractions allowed): where it starts, and its unit direction. The
    /// inverse of project.
    struct Ray {
        Vec3d origin, direction;
    };
    Ray ray(double x, double y, double width, double height) const;
};

/// What fit_camera needs to know of an object: its points in the world.
struct CameraPoints {
    std::span<const Vec3f> positions;
    Vec3d origin = Vec3d::Zero();
    double radius = 0; ///< of balls around them, model units
};

/// The positions that a mesh's faces use; all where there are no faces. Into `room`, which has to stay, where some
/// vertices are unused: a stray one far away would make the picture empty. The mesh is not checked.
CameraPoints points_of_faces(const Mesh& mesh, std::vector<Vec3f>& room, double radius = 0);

/// The camera that looks along -direction and shows all points as large as they fit in a picture of that aspect (width
/// / height) with `margin` (a fraction of the picture's height, on every side). Exact, also in perspective: for each
/// side of the frustum the point furthest out decides; only that the eye stays a thousandth of the points' box in front
/// of them. The target is in the middle of the picture, half way between the nearest and the furthest point. Points
/// without extent are seen from one unit away; no points: the unit cube about the origin. Cost O(points).
Camera fit_camera(std::span<const CameraPoints> points, const Vec3d& direction, const Vec3d& up, double aspect,
                  double field_of_view_deg = 30, double margin = 0.06);

/// The camera turned by an angle about the axis `up` through its target.
Camera turned(const Camera& camera, double degrees);

} // namespace filigree
