// A camera that follows what moves, frame by frame, without a jerk.
#pragma once

#include "filigree/render.h"
#include "filigree/types.h"

#include <span>
#include <vector>

namespace filigree {

struct FollowOptions {
    Vec3d direction = Vec3d::UnitZ(); ///< from what is seen to the viewer; the camera never turns
    Vec3d up = Vec3d::UnitY();
    double aspect = 4.0 / 3, field_of_view_deg = 30; ///< as of fit_camera
    double frames_per_second = 60;
};

/// One camera a frame: each sees all points of its frame, and moves as evenly as a second and a half around the frame
/// allow, or half of a film of less than three seconds. One camera for all frames where a following one would come
/// hardly closer. points: of each frame, at least one frame. Cost O(frames of a second and a half times all points).
std::vector<Camera> follow_cameras(std::span<const std::vector<Vec3f>> points, const FollowOptions& options);

} // namespace filigree
