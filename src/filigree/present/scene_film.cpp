#include "filigree/present/scene_film.h"

#include "filigree/file.h"
#include "filigree/present/film_frames.h"
#include "filigree/present/follow_camera.h"
#include "filigree/present/textured_look.h"
#include "filigree/render/surface_materials.h"
#include "filigree/restore.h"
#include "filigree/scene/melting_surface.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kRoom = 0.4; // obstacles so near to the motion, in its diagonals, are in the picture

std::vector<Vec3f> moved(std::span<const Vec3f> points, const Eigen::Isometry3d& motion) {
    std::vector<Vec3f> result;
    result.reserve(points.size());
    for (const Vec3f& p : points) result.push_back((motion * p.cast<double>()).cast<float>());
    return result;
}

void extend(Box& box, std::span<const Vec3f> points) {
    const Box other = bounds(points);
    if (other.empty()) return;
    box.extend(other.min);
    box.extend(other.max);
}

/// Throws BadResultAccess where something fails; film_scene returns its error.
class SceneFilm {
public:
    SceneFilm(const SceneFile& scene, const ReadyScene& ready, const Recording& recording, const RunContext& context)
        : scene_(scene), ready_(ready), recording_(recording), context_(context),
          frames_(recording.poses[0].frames.size()), quiet_(context) {
        quiet_.progress = nullptr; // the bar tells of frames
        actors_.reserve(ready.bodies.size());
        for (const ReadyBody& body : ready.bodies) prepare(body);
        if (!scene.picture.particles) prepare_melting();
        warnings.insert(warnings.end(), melting_.warnings.begin(), melting_.warnings.end());
        look_ahead();
        choose_ground();
        obstacles_.resize(ready.drawn.size());
    }

    Result<Picture> frame(std::size_t number, HeadlessRenderer& renderer) {
        Scene shown;
        for (std::size_t b = 0; b < actors_.size(); ++b)
            if (!melting_.has_body(b)) shown.objects.push_back(body_at(b, number));
        if (!melting_.is_empty()) {
            const CompositeSurface surface = melting_.frame(recording_, number, quiet_).value();
            SurfaceOptions options;
            options.materials = melting_materials_.materials;
            melting_drawable_ =
                Drawable::surface(melt_as_drawn(surface.mesh, options.materials).mesh, options, quiet_).value();
            shown.objects.push_back({&*melting_drawable_, {.own_colors = true}});
        }
        for (std::size_t k = 0; k < ready_.drawn.size() && scene_.picture.obstacles; ++k)
            if (const Drawable* drawable = obstacle_at(k, number))
                shown.objects.push_back({drawable, {.color = ready_.drawn[k].color, .gloss = 0.1f}});
        const ScenePicture& picture = scene_.picture;
        if (picture.background.top) shown.background.top = *picture.background.top;
        if (picture.background.bottom) shown.background.bottom = *picture.background.bottom;
        shown.up = picture.up;
        shown.ground = picture.ground;
        shown.fixed_ground = true;
        shown.ground_level = ground_level_;
        return renderer.picture(shown, cameras_[std::min(number, cameras_.size() - 1)],
                                {.width = picture.size[0], .height = picture.size[1], .passes = picture.passes},
                                quiet_);
    }
    std::size_t frames() const { return frames_; }
    std::vector<std::string> warnings;

private:
    struct ShownBody {
        const ReadyBody* body;
        SurfaceMaterials materials;
        RestoreOptions restore;
        std::optional<Drawable> drawable;
        float ball_radius = 0;
    };

    void prepare(const ReadyBody& body) {
        ShownBody& shown = actors_.emplace_back();
        shown.body = &body;
        // A model in pieces has no level between its driver, which has no detail, and all of it.
        if (body.pieces.empty()) shown.restore.level = level_within(body.model, scene_.picture.most_triangles);
        if (scene_.picture.particles) {
            shown.ball_radius = float(0.4 * body.body->spacing());
            return;
        }
        if (!body.mesh_path.empty()) {
            shown.materials = load_surface_materials(body.model.mesh, path_of(body.mesh_path));
            warnings.insert(warnings.end(), shown.materials.warnings.begin(), shown.materials.warnings.end());
        }
        SurfaceOptions surface;
        surface.materials = shown.materials.materials;
        shown.drawable = Drawable::model(body.model, shown.restore, surface, quiet_).value();
    }

    void prepare_melting() {
        const std::vector<BodyLook> looks = looks_of(ready_, warnings, quiet_).value();
        melting_ = MeltingSurface::create(ready_, looks, quiet_).value();
        melting_materials_ = decoded_materials(melting_.materials());
    }

    SceneObject body_at(std::size_t b, std::size_t frame) {
        ShownBody& shown = actors_[b];
        const Pose& pose = recording_.poses[b].frames[frame];
        if (scene_.picture.particles) {
            PointOptions points;
            points.radius = shown.ball_radius;
            shown.drawable = Drawable::points(recording_.particles[b][frame], Vec3d::Zero(), points, quiet_).value();
        } else {
            shown.drawable->set_pose(pose, quiet_).value();
        }
        return {&*shown.drawable, {.color = shown.body->color, .own_colors = shown.body->has_own_color}};
    }

    double time_of(std::size_t frame) const { return double(frame) / scene_.step.frames_per_second; }

    /// Null where the level ground of the picture stands for it.
    const Drawable* obstacle_at(std::size_t k, std::size_t frame) {
        const ShownObstacle& obstacle = ready_.drawn[k];
        if (is_level_ground(obstacle)) return nullptr;
        std::optional<Drawable>& drawable = obstacles_[k];
        if (drawable && !obstacle.moves) return &*drawable;
        Mesh mesh = obstacle.is_ground ? slab(obstacle.plane) : obstacle.mesh;
        mesh.positions = moved(mesh.positions, obstacle.motion.at(time_of(frame)));
        mesh.normals = {}; // of the mesh before it turned
        drawable = Drawable::surface(mesh, {}, quiet_).value();
        return &*drawable;
    }

    bool is_level_ground(const ShownObstacle& obstacle) const {
        return obstacle.is_ground && !obstacle.moves && obstacle.motion.angle.constant.isZero() &&
               obstacle.plane.normal.isApprox(up_vector(scene_.picture.up), 1e-9);
    }

    /// A plane as a plate below it, as large as the motion.
    Mesh slab(const HalfSpace& plane) const {
        const Vec3d middle = box_.centre() - plane.normal.dot(box_.centre() - plane.point) * plane.normal;
        const double half = 0.62 * box_.diagonal(), thickness = 0.02 * box_.diagonal();
        Vec3d side = plane.normal.cross(up_vector(scene_.picture.up));
        if (side.norm() < 1e-6) side = plane.normal.unitOrthogonal();
        side.normalize();
        const Vec3d along = plane.normal.cross(side);
        Mesh mesh;
        for (int k = 0; k < 8; ++k)
            mesh.positions.push_back((middle + half * ((k & 1 ? 1 : -1) * side + (k & 2 ? 1 : -1) * along) -
                                      (k & 4 ? 0 : thickness) * plane.normal)
                                         .cast<float>());
        const bool turns_right = side.cross(along).dot(plane.normal) > 0;
        for (std::array<Index, 4> face :
             {std::array<Index, 4>{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}) {
            if (!turns_right) std::reverse(face.begin(), face.end());
            mesh.add_face(face);
        }
        return mesh;
    }

    /// Where everything goes, and where the camera is.
    void look_ahead() {
        std::vector<std::vector<Vec3f>> seen(frames_);
        for (ShownBody& shown : actors_) {
            const std::size_t b = std::size_t(&shown - actors_.data());
            const Restorer restorer = Restorer::create(shown.body->model, shown.restore, quiet_).value();
            const std::size_t stride = 1 + restorer.vertex_count() * frames_ / 400'000;
            std::vector<Vec3f> positions(restorer.vertex_count());
            for (std::size_t frame = 0; frame < frames_; ++frame) {
                if (context_.is_cancelled()) throw BadResultAccess(cancelled_error());
                context_.report("looking ahead", double(frame) / double(frames_));
                if (melting_.has_body(b))
                    positions = recording_.matter[b][frame].positions;
                else
                    restorer.positions(recording_.poses[b].frames[frame], positions, quiet_).value();
                extend(box_, positions);
                for (std::size_t v = frame % stride; v < positions.size(); v += stride)
                    seen[frame].push_back(positions[v]);
            }
        }
        context_.report("looking ahead", 1);
        leave_out_strays(seen);
        const ScenePicture& picture = scene_.picture;
        if (!picture.follow || picture.eye) { // all at once
            for (std::size_t frame = 1; frame < frames_; ++frame) {
                seen[0].insert(seen[0].end(), seen[frame].begin(), seen[frame].end());
                seen[frame] = {};
            }
            seen.resize(1);
        }
        if (scene_.picture.obstacles) see_obstacles(seen);
        if (picture.eye) {
            Camera& camera = cameras_.emplace_back();
            camera.eye = *picture.eye - ready_.origin;
            camera.target = *picture.target - ready_.origin;
            camera.up = up_vector(picture.up);
            camera.field_of_view_deg = picture.field_of_view;
            camera.height = (camera.eye - camera.target).norm();
            return;
        }
        cameras_ = follow_cameras(seen, {.direction = view_direction(picture.view, picture.up),
                                         .up = up_vector(picture.up),
                                         .aspect = double(picture.size[0]) / picture.size[1],
                                         .field_of_view_deg = picture.field_of_view,
                                         .frames_per_second = scene_.step.frames_per_second});
    }

    /// A few points that leave the rest far behind (drops of a melt) are not what the picture is made for.
    void leave_out_strays(std::vector<std::vector<Vec3f>>& seen) {
        constexpr double kStrays = 0.001, kMargin = 0.25; // a part of all points; in diagonals of the others' box
        std::size_t count = 0;
        for (const std::vector<Vec3f>& frame : seen) count += frame.size();
        if (count < 1000) return;
        Box others;
        others.min = others.max = Vec3d::Zero();
        std::vector<float> values;
        values.reserve(count);
        for (int axis = 0; axis < 3; ++axis) {
            values.clear();
            for (const std::vector<Vec3f>& frame : seen)
                for (const Vec3f& p : frame) values.push_back(p[axis]);
            const auto at = [&](double part) {
                const auto place = values.begin() + std::ptrdiff_t(part * double(values.size() - 1));
                std::nth_element(values.begin(), place, values.end());
                return double(*place);
            };
            others.min[axis] = at(kStrays);
            others.max[axis] = at(1 - kStrays);
        }
        const double margin = kMargin * others.diagonal();
        others.min.array() -= margin;
        others.max.array() += margin;
        for (std::vector<Vec3f>& frame : seen)
            std::erase_if(frame, [&](const Vec3f& p) {
                return (p.cast<double>().array() < others.min.array()).any() ||
                       (p.cast<double>().array() > others.max.array()).any();
            });
        box_.min = box_.min.cwiseMax(others.min);
        box_.max = box_.max.cwiseMin(others.max);
    }

    /// Obstacles near the bodies: of each frame, or in all frames where there is one list for all.
    void see_obstacles(std::vector<std::vector<Vec3f>>& seen) {
        for (std::size_t k = 0; k < seen.size(); ++k) {
            Box near = bounds(seen[k]);
            const double room = kRoom * near.diagonal();
            near.min.array() -= room;
            near.max.array() += room;
            for (const ShownObstacle& obstacle : ready_.drawn) {
                const bool is_all = seen.size() == 1 && obstacle.moves;
                const std::size_t first = is_all ? 0 : k, last = is_all ? frames_ : k + 1;
                for (std::size_t frame = first; frame < last; frame += 1 + (last - first) / 32)
                    see_obstacle(obstacle, frame, near, seen[k]);
            }
        }
    }
    void see_obstacle(const ShownObstacle& obstacle, std::size_t frame, const Box& near, std::vector<Vec3f>& seen) {
        const Eigen::Isometry3d motion = obstacle.motion.at(time_of(frame));
        const std::size_t stride = 1 + obstacle.mesh.positions.size() / 2000;
        for (std::size_t v = 0; v < obstacle.mesh.positions.size(); v += stride) {
            const Vec3d p = motion * obstacle.mesh.positions[v].cast<double>();
            if ((p.array() < near.min.array()).any() || (p.array() > near.max.array()).any()) continue;
            seen.push_back(p.cast<float>());
            lowest_obstacle_ = std::min(lowest_obstacle_, p[axis()]);
        }
    }

    /// The level ground where there is one, else the lowest point of all.
    void choose_ground() {
        ground_level_ = std::min(box_.min[axis()], lowest_obstacle_) - 1e-4 * box_.diagonal();
        for (const ShownObstacle& obstacle : ready_.drawn) {
            if (is_level_ground(obstacle)) {
                // Deep enough not to cut off what rests on it by rounding.
                ground_level_ =
                    obstacle.motion.at(0).translation()[axis()] + obstacle.plane.point[axis()] - 1e-4 * box_.diagonal();
                return;
            }
            if (obstacle.is_ground && scene_.picture.obstacles)
                for (const Vec3f& p : slab(obstacle.plane).positions)
                    ground_level_ = std::min(ground_level_, double(p[axis()]));
        }
    }
    int axis() const { return static_cast<int>(scene_.picture.up); }

    const SceneFile& scene_;
    const ReadyScene& ready_;
    const Recording& recording_;
    const RunContext& context_;
    std::size_t frames_;
    RunContext quiet_;
    std::vector<ShownBody> actors_;
    std::vector<std::optional<Drawable>> obstacles_;
    MeltingSurface melting_;
    SurfaceMaterials melting_materials_;
    std::optional<Drawable> melting_drawable_;
    Box box_; ///< of the bodies, in all frames
    double lowest_obstacle_ = std::numeric_limits<double>::infinity(), ground_level_ = 0;
    std::vector<Camera> cameras_; ///< one, or one a frame
};

} // namespace

Result<std::vector<std::string>> film_scene(const SceneFile& scene, const ReadyScene& ready, const Recording& recording,
                                            HeadlessRenderer& renderer, std::span<FilmWriter> writers,
                                            const RunContext& context) {
    try {
        SceneFilm film(scene, ready, recording, context);
        const Status filmed = film_frames(
            film.frames(), [&](std::size_t frame, const RunContext&) { return film.frame(frame, renderer); }, writers,
            "filming " + std::to_string(film.frames()) + " frames", context);
        if (!filmed) return filmed.error();
        return std::move(film.warnings);
    } catch (const BadResultAccess& failure) {
        return failure.error();
    }
}

} // namespace filigree
