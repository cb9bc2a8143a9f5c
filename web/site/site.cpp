// What the worker of the standing page calls: a mesh file's bytes in; out comes the file of a live page, as `filigree
// drop --page` writes it, and poses of the model while it is bent by hand. Compiled to WebAssembly (scripts/site), and
// natively to be compared.
#include "filigree/core/text.h"
#include "filigree/file.h"
#include "filigree/pose.h"
#include "filigree/restore.h"
#include "filigree/scene/drop_scene.h"
#include "filigree/scene/page_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

using namespace filigree;

#ifdef __wasm__
#define EXPORTED(name) __attribute__((export_name(#name))) site_##name
/// How far a phase is, 0 to 1.
extern "C" __attribute__((import_module("page"), import_name("progress"))) void
page_progress(const char* phase, unsigned length, double part);
#else
#define EXPORTED(name) site_##name
extern "C" void page_progress(const char* phase, unsigned length, double part);
#endif

std::string message; // of the last error; what ends the module leaves its sentence here too

namespace {

constexpr std::size_t kMostTriangles = 500'000;
constexpr const char* kScene = "page"; // what messages call the scene, and nobody sees

/// A bend in a plane that holds the axis, whatever way it looks.
class TurnedBend : public SpaceWarp {
public:
    TurnedBend(const Box& box, Axis axis, const Vec3d& direction, double degrees)
        : centre_(box.centre()),
          turn_(Eigen::Quaterniond::FromTwoVectors(Vec3d::Unit((int(axis) + 1) % 3), direction).toRotationMatrix()),
          bend_(make_bend(box, axis, degrees)) {}
    Vec3d position(const Vec3d& point) const override { return outside(bend_->position(inside(point))); }
    Warped warp(const Vec3d& point) const override {
        const Warped warped = bend_->warp(inside(point));
        return {outside(warped.position), turn_ * warped.gradient * turn_.transpose()};
    }

private:
    Vec3d inside(const Vec3d& point) const { return centre_ + turn_.transpose() * (point - centre_); }
    Vec3d outside(const Vec3d& point) const { return centre_ + turn_ * (point - centre_); }

    Vec3d centre_;
    Mat3d turn_;
    std::unique_ptr<SpaceWarp> bend_;
};

struct Made {
    ReadyScene ready;
    PageFile page;
    std::optional<Restorer> restorer;
    double diagonal = 0; ///< model units
    std::array<double, 4> bend = {};
    std::unique_ptr<SpaceWarp> warp;
    Pose pose;                 ///< model units
    std::vector<Vec3f> driver; ///< m, where the body starts
    std::vector<Mat3f> gradients;
    std::vector<float> errors; ///< of each vertex, fractions of the diagonal

    const Model& model() const { return ready.bodies.front().model; }
};

RunContext context_of_page() {
    RunContext context(1);
    context.progress = [](std::string_view phase, double part) {
        page_progress(phase.data(), unsigned(phase.size()), part);
    };
    return context;
}
const RunContext kContext = context_of_page(), kSilent(1);
std::string input, mesh_name;
Mesh mesh;
std::unique_ptr<Made> made;

std::string text_of(std::size_t length) { return input.substr(0, length); }

/// Without the line of a scene that nobody wrote.
Error plain(Error error) {
    if (const std::string place = std::string(kScene) + ":"; error.message.starts_with(place))
        if (const std::size_t end = error.message.find(": ", place.size()); end != std::string::npos)
            error.message.erase(0, end + 2);
    return error;
}

Status read_file_of_user(std::size_t name_length) {
    mesh_name = text_of(name_length);
    Result<MeshFile> file = read_mesh(std::string_view(input).substr(name_length), mesh_name, kContext);
    input = {};
    if (!file) return file.error();
    mesh = std::move(file->mesh);
    const std::size_t triangles = mesh.corners.size() - 2 * std::min(mesh.face_count(), mesh.corners.size() / 2);
    if (mesh.face_count() == 0)
        return Error{ErrorCode::unsuitable, mesh_name + " has points, and no triangles between them."};
    if (triangles > kMostTriangles)
        return Error{ErrorCode::unsuitable, mesh_name + " has " + with_commas(triangles) +
                                                " triangles, and this page takes up to " + with_commas(kMostTriangles) +
                                                ". The program takes any number of them."};
    return Success{};
}

/// Where this fails, the body that was there stays.
Status make_page(const DropSceneOptions& options) {
    const Result<std::string> text = drop_scene(mesh, mesh_name, options);
    if (!text) return text.error();
    const Result<SceneFile> scene = parse_scene(*text, kScene);
    if (!scene) return plain(scene.error());
    Result<ReadyScene> ready = set_up(*scene, kContext, {{mesh_name, mesh}});
    if (!ready) return plain(ready.error());
    Result<PageFile> page = write_page_file(*scene, *ready);
    if (!page) return page.error();
    auto next = std::make_unique<Made>();
    next->ready = std::move(*ready);
    next->page = std::move(*page);
    Result<Restorer> restorer = Restorer::create(next->model(), {}, kSilent);
    if (!restorer) return restorer.error();
    next->restorer.emplace(std::move(*restorer));
    next->diagonal = bounds(next->model().mesh).diagonal();
    made = std::move(next);
    return Success{};
}

/// How a model is bent: into an arc along its longest axis, in any plane that holds the axis, and along the axis.
struct Bend {
    Vec3d towards = Vec3d::Zero(); ///< across the axis, in the body's own axes; its length: degrees of the arc
    double stretch = 1;
};
constexpr double kMostDegrees = 200, kLeastStretch = 0.5, kMostStretch = 2;

/// The change that takes a point about this way. Both in model units.
Bend bend_of(const Box& box, const Vec3d& from, const Vec3d& way) {
    constexpr double kLeastArm = 0.3; // of the length
    const int axis = int(longest_axis(box));
    const double length = box.size()[axis], reach = from[axis] - box.centre()[axis];
    const double arm = std::max(std::abs(reach), kLeastArm * length);
    const Vec3d along = way[axis] * Vec3d::Unit(axis);
    // Of an arc, the place at `arm` is off its tangent by arm^2 / (2 radius), about.
    const double degrees = 2 * length / (arm * arm) * 180 / std::numbers::pi;
    return {degrees * (way - along), 1 + way[axis] * (reach < 0 ? -1 : 1) / arm};
}

std::unique_ptr<SpaceWarp> warp_of(const Box& box, const Bend& bend) {
    const Axis axis = longest_axis(box);
    const double stretch = std::clamp(bend.stretch, kLeastStretch, kMostStretch);
    std::vector<std::unique_ptr<SpaceWarp>> warps;
    warps.push_back(make_squeeze(box, axis, stretch).value());
    if (const double degrees = bend.towards.norm(); degrees > 1e-6) {
        // The arc is as long as the body is by now, and a hair longer: its curvature jumps at its ends, and there the
        // restored surface would be off.
        const int along = int(axis);
        const double half = 0.5 * (1 + 1e-9) * stretch * box.size()[along], centre = box.centre()[along];
        Box stretched = box;
        stretched.min[along] = centre - half;
        stretched.max[along] = centre + half;
        warps.push_back(
            std::make_unique<TurnedBend>(stretched, axis, bend.towards / degrees, std::min(degrees, kMostDegrees)));
    }
    return make_chain(std::move(warps));
}

Eigen::Isometry3d placement() { return made->ready.actors.front().placement; }
double scale() { return made->ready.bodies.front().scale; }

void bend_model(const Bend& bend) {
    made->warp = warp_of(bounds(made->model().mesh), bend);
    made->pose = warp_pose(*made->warp, made->model(), kSilent);
    made->driver.resize(made->pose.positions.size());
    made->gradients.resize(made->driver.size());
    const Eigen::Isometry3d place = placement();
    const Mat3f turn = place.linear().cast<float>();
    for (std::size_t v = 0; v < made->driver.size(); ++v) {
        made->driver[v] = (place * (scale() * made->pose.positions[v].cast<double>())).cast<float>();
        made->gradients[v] = turn * made->pose.gradients[v];
    }
}

Status measure_bend() {
    const std::span<const Vec3f> rest = made->model().positions();
    const std::vector<Vec3f> truth = warp_positions(*made->warp, rest, Vec3d::Zero(), kSilent);
    const Result<std::vector<Vec3f>> restored = made->restorer->positions(made->pose, kSilent);
    if (!restored) return restored.error();
    made->errors.resize(rest.size());
    for (std::size_t v = 0; v < rest.size(); ++v)
        made->errors[v] = float(((*restored)[v] - truth[v]).cast<double>().norm() / made->diagonal);
    return Success{};
}

/// 1; or 0, and text() says why.
int told(const Status& status) {
    message = status ? "" : status.error().message;
    return status ? 1 : 0;
}

} // namespace

extern "C" {

/// Room for what a call takes.
char* EXPORTED(take)(unsigned size) {
    input.resize(size);
    return input.data();
}
const char* EXPORTED(text)() { return message.c_str(); }

/// Reads a mesh file. Taken: its name in UTF-8, of so many bytes, and behind it the file.
int EXPORTED(read)(unsigned name_length) { return told(read_file_of_user(name_length)); }
/// A mesh that the library makes. Taken: its name, one of shape_names().
int EXPORTED(sample)(unsigned name_length, unsigned resolution, double frequency, double amplitude) {
    mesh_name = text_of(name_length);
    Result<Mesh> shape =
        make_shape(mesh_name, {.resolution = resolution, .frequency = frequency, .amplitude = amplitude});
    if (!shape) return told(shape.error());
    mesh = std::move(*shape);
    return told(Success{});
}
unsigned EXPORTED(vertex_count)() { return unsigned(mesh.vertex_count()); }
unsigned EXPORTED(triangle_count)() { return unsigned(mesh.corners.size() - 2 * mesh.face_count()); }

/// Makes a body of it and strips it. Taken: the material's name. young_modulus: Pa; 0: the material's. pieces: 0: it
/// does not break.
int EXPORTED(make)(unsigned material_length, double young_modulus, unsigned particles, unsigned pieces, double tilt) {
    DropSceneOptions options;
    options.material = text_of(material_length);
    options.particles = particles;
    options.pieces = pieces;
    options.tilt = tilt;
    if (young_modulus > 0) options.young_modulus = young_modulus;
    return told(make_page(options));
}
/// The bytes of model.live.
const char* EXPORTED(page)() { return made->page.bytes.data(); }
unsigned EXPORTED(page_size)() { return unsigned(made->page.bytes.size()); }
unsigned EXPORTED(driver_size)() { return unsigned(made->model().driver().vertices.size()); }
unsigned EXPORTED(model_vertices)() { return unsigned(made->model().vertex_count()); }

/// How a body has to be bent so that a point of it, at rest, goes about this way, m: three numbers towards where, of
/// which the length is in degrees, and how many times as long.
const double* EXPORTED(bend_of)(double x, double y, double z, double way_x, double way_y, double way_z) {
    const Vec3d way = placement().linear().transpose() * Vec3d(way_x, way_y, way_z) / scale();
    const Bend bend = bend_of(bounds(made->model().mesh), Vec3d(x, y, z) / scale(), way);
    made->bend = {bend.towards.x(), bend.towards.y(), bend.towards.z(), bend.stretch};
    return made->bend.data();
}
/// Bends the body where it starts.
void EXPORTED(bend)(double x, double y, double z, double stretch) { bend_model({{x, y, z}, stretch}); }
/// 3 numbers a driver vertex, m; and 9 of its gradient, column by column.
const float* EXPORTED(positions)() { return made->driver.data()->data(); }
const float* EXPORTED(gradients)() { return made->gradients.data()->data(); }
/// How far each restored vertex is from where the bend itself takes it, fractions of the diagonal.
int EXPORTED(measure)() { return told(measure_bend()); }
const float* EXPORTED(errors)() { return made->errors.data(); }

} // extern "C"
