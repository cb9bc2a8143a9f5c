#include "filigree/present/follow_camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr double kAhead = 0.75;  // s that a camera looks ahead and back
constexpr double kPart = 0.25;   // of a short film that it looks ahead and back: else it would see all of it at once
constexpr double kCloser = 1.35; // by so much the picture has to gain, else the camera stands still

double distance_of(const Camera& camera) { return (camera.eye - camera.target).norm(); }

} // namespace

std::vector<Camera> follow_cameras(std::span<const std::vector<Vec3f>> points, const FollowOptions& options) {
    std::vector<CameraPoints> of_frames;
    for (const std::vector<Vec3f>& frame : points) of_frames.push_back({frame});
    const auto fitted = [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        const auto begin = std::size_t(std::max<std::ptrdiff_t>(first, 0));
        const auto end = std::min(std::size_t(last) + 1, of_frames.size());
        return fit_camera(std::span(of_frames).subspan(begin, end - begin), options.direction, options.up,
                          options.aspect, options.field_of_view_deg);
    };
    const auto frames = std::ptrdiff_t(points.size());
    const auto ahead =
        std::max<std::ptrdiff_t>(1, std::lround(std::min(kAhead * options.frames_per_second, kPart * double(frames))));
    const Camera still = fitted(0, frames - 1);
    if (frames == 1) return {still};

    std::vector<Camera> wide; // each sees all that happens around its frame
    for (std::ptrdiff_t frame = 0; frame < frames; ++frame) wide.push_back(fitted(frame - ahead, frame + ahead));
    std::vector<double> distances;
    for (const Camera& camera : wide) distances.push_back(distance_of(camera));
    std::nth_element(distances.begin(), distances.begin() + frames / 2, distances.end());
    if (distance_of(still) < kCloser * distances[std::size_t(frames / 2)]) return {still};

    // Eyes that look along one direction and see a point are a convex set, so the mean of cameras that see a frame sees
    // it too.
    std::vector<Camera> smooth;
    for (std::ptrdiff_t frame = 0; frame < frames; ++frame) {
        Camera mean = still;
        mean.eye = mean.target = Vec3d::Zero();
        mean.height = 0;
        double sum = 0;
        for (std::ptrdiff_t k = -ahead; k <= ahead; ++k) {
            const Camera& camera = wide[std::size_t(std::clamp<std::ptrdiff_t>(frame + k, 0, frames - 1))];
            const double weight = 1 + std::cos(std::numbers::pi * double(k) / double(ahead + 1));
            mean.eye += weight * camera.eye;
            mean.target += weight * camera.target;
            mean.height += weight * camera.height;
            sum += weight;
        }
        mean.eye /= sum;
        mean.target /= sum;
        mean.height /= sum;
        smooth.push_back(mean);
    }
    return smooth;
}

} // namespace filigree
