// Strip and restore on any mesh: the model is sound, the rest pose gives the mesh, an affine pose the affine mesh, two
// threads the same bytes as one.
#include "fuzz.h"

#include "filigree/restore.h"
#include "filigree/strip.h"

#include <cmath>

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() { return mesh_seeds(); }

} // namespace filigree_fuzz

namespace {

const RunContext kTwoThreads(2);

/// As far off as the rounding of records may be, in model units.
double allowed(double diagonal) { return 2e-5 * (1 + diagonal); }

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    const unsigned options = bytes.byte();
    const Mesh mesh = mesh_of(bytes);
    const StripOptions how{.base = 3 + options % 16, .reorder = (options & 64) != 0};
    const Result<Stripped> stripped = strip(mesh, how, kContext);
    if (!is_sound(stripped)) return 0;
    const Model& model = stripped->model;
    require(check_model(model).empty(), "the model is sound");
    const Result<Stripped> other = strip(mesh, how, kTwoThreads);
    require(other.ok() && other->model.driver().vertices == model.driver().vertices &&
                other->model.detail.order == model.detail.order,
            "two threads give what one does");

    const Restorer restorer = Restorer::create(model, {}, kContext).value();
    Pose pose = rest_pose(model);
    const double most = allowed(world_bounds(mesh).diagonal());
    const std::vector<Vec3f> rest = restorer.positions(pose, kContext).value();
    for (std::size_t v = 0; v < rest.size(); ++v)
        require((rest[v] - model.mesh.positions[v]).norm() <= most, "the rest pose gives the mesh");
    Mat3f map;
    map << 0.8f, -0.5f, 0.1f, 0.4f, 0.9f, 0.2f, 0, -0.3f, 1.1f;
    for (Vec3f& p : pose.positions) p = (map * p + Vec3f(1, 2, 3)).eval();
    pose.gradients.assign(pose.positions.size(), map);
    const std::vector<Vec3f> moved = restorer.positions(pose, kContext).value();
    for (std::size_t v = 0; v < moved.size(); ++v)
        require((moved[v] - (map * model.mesh.positions[v] + Vec3f(1, 2, 3))).norm() <= 4 * most,
                "an affine pose with gradients gives the affine mesh");
    return 0;
}
