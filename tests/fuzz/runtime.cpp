// The C runtime opens damaged models, and what it opens it restores as the library does. Checksums are mended first.
#include "fuzz.h"
#include "model_sums.h"

#include "filigree/io/model/model_file.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include "filigree_rt.h"

#include <cstring>

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() {
    const Mesh mesh = make_wavy_sphere({.resolution = 3});
    Mesh smooth = mesh, faceted = mesh;
    smooth.normals.values.assign(mesh.vertex_count(), {0, 0, 2});
    faceted.normals.values = {{1, 0, 0}, {0, 1, 0}};
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) faceted.normals.corners.push_back(Index(c % 2));
    Mesh points;
    points.positions = mesh.positions;
    std::vector<std::string> all;
    for (const Mesh* each : std::initializer_list<const Mesh*>{&mesh, &smooth, &faceted, &points}) {
        const Model model = strip(*each, {.base = 12}, kContext).value().model;
        PoseSequence poses;
        poses.frames = {rest_pose(model), rest_pose(model)};
        all.push_back(write_model(model, each == &mesh ? poses : PoseSequence()));
    }
    all.push_back(write_model(
        strip_to_driver(faceted, make_wavy_cube({.resolution = 1, .amplitude = 0}), kContext).value().model));
    return all;
}

} // namespace filigree_fuzz

namespace {

/// Restores the driver at rest with other gradients than the unit, in memory of exactly the size that was asked for.
void restore(const flg_model* model, const std::string& bytes) {
    flg_info info;
    info.struct_size = sizeof info;
    require(flg_get_info(model, &info) == FLG_OK, "an opened model tells about itself");
    std::vector<Vec3f> driver(info.driver_vertices), positions(info.vertices), normals(info.normals);
    std::memcpy(driver[0].data(), flg_driver_rest(model), driver.size() * sizeof(Vec3f));
    const std::vector<Mat3f> gradients(driver.size(), Mat3f(Vec3f(1, 2, 0.5f).asDiagonal()));
    std::vector<std::max_align_t> pose(flg_pose_bytes(model) / sizeof(std::max_align_t) + 1),
        scratch(flg_scratch_bytes(model) / sizeof(std::max_align_t) + 1);
    require(flg_set_pose(model, driver[0].data(), gradients[0].data(), info.driver_vertices, pose.data()) == FLG_OK,
            "a pose that fits is taken");
    require(flg_restore(model, pose.data(), positions.empty() ? nullptr : positions[0].data(),
                        normals.empty() ? nullptr : normals[0].data(), scratch.data()) == FLG_OK,
            "an opened model is restored");
    const Result<Model> same = read_model(bytes, "fuzz", kContext);
    if (!same) return; // for what the runtime does not read
    const Result<Restorer> restorer = Restorer::create(*same, {}, kContext);
    const Result<std::vector<Vec3f>> wanted = restorer->positions(Pose{driver, gradients}, kContext);
    require(wanted.ok() && wanted->size() == positions.size(), "both have the same vertices");
    require(positions.empty() || std::memcmp(wanted->data(), positions.data(), positions.size() * sizeof(Vec3f)) == 0,
            "both restore the same bytes");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string bytes = with_sums(std::string(reinterpret_cast<const char*>(data), size));
    flg_model* model = nullptr;
    const flg_status status = flg_open(bytes.data(), bytes.size(), nullptr, &model);
    require((status == FLG_OK) == (model != nullptr), "there is a model or an error");
    if (status != FLG_OK) {
        const bool has_poses = read_poses(bytes, "fuzz", kContext).ok();
        const Result<Model> other = read_model(bytes, "fuzz", kContext);
        require(status == FLG_UNSUITABLE || !other || !has_poses, "what the library reads the runtime opens");
        return 0;
    }
    restore(model, bytes);
    flg_close(model);
    return 0;
}
