#include "motion_cameras.h"

#include "filigree/present/follow_camera.h"

namespace filigree::studio {

std::vector<Camera> motion_cameras(const Workbench& workbench, std::size_t first, std::size_t last, const Camera& like,
                                   double aspect) {
    std::vector<std::vector<Vec3f>> corners; // relative to the middle of the first frame, so that floats do
    const Vec3d origin = workbench.motion_box(first).centre();
    for (std::size_t frame = first; frame < last; ++frame) {
        const Box box = workbench.motion_box(frame);
        std::vector<Vec3f>& of_frame = corners.emplace_back();
        for (int k = 0; k < 8; ++k)
            of_frame.push_back((Vec3d(k & 1 ? box.max.x() : box.min.x(), k & 2 ? box.max.y() : box.min.y(),
                                      k & 4 ? box.max.z() : box.min.z()) -
                                origin)
                                   .cast<float>());
    }
    FollowOptions options;
    options.direction = like.eye - like.target;
    options.up = like.up;
    options.aspect = aspect;
    options.field_of_view_deg = like.field_of_view_deg;
    options.frames_per_second = workbench.frames_per_second();
    std::vector<Camera> cameras = follow_cameras(corners, options);
    for (Camera& camera : cameras) {
        camera.eye += origin;
        camera.target += origin;
    }
    return cameras;
}

} // namespace filigree::studio
