// A driver as others move it: what is written of a pose is read back.
#include "filigree/hierarchy/pose_mesh.h"

#include "filigree/mesh.h"
#include "hierarchy/stripping.h"

using namespace filigree_test;

namespace {

Model model_with_misleading_scalars() {
    Mesh mesh = make_wavy_plane({.resolution = 16});
    mesh.scalars = {{"heat", std::vector<float>(mesh.vertex_count(), 1)},
                    {"f00", std::vector<float>(mesh.vertex_count(), 7)}}; // of the mesh's own, no gradient's
    mesh.normals.values.assign(mesh.vertex_count(), Vec3f::UnitZ());
    return stripped(std::move(mesh), {.base = 20}).model;
}

} // namespace

TEST(PoseMesh, GradientNamesAreTheNine) {
    for (const char* name : {"f00", "f12", "f22"}) EXPECT_TRUE(is_gradient_name(name)) << name;
    for (const char* name : {"", "f0", "f03", "f30", "g00", "f000", "quality"})
        EXPECT_FALSE(is_gradient_name(name)) << name;
}

TEST(PoseMesh, ADriverHasNoScalarsThatReadAsGradients) {
    const Model model = model_with_misleading_scalars();
    const Mesh driver = driver_mesh(model);
    ASSERT_EQ(driver.scalars.size(), 1u);
    EXPECT_EQ(driver.scalars[0].name, "heat");
    EXPECT_TRUE(pose_of_mesh(driver, model.mesh.origin).gradients.empty());
}

TEST(PoseMesh, APoseComesBack) {
    Model model = model_with_misleading_scalars();
    model.mesh.origin = {1000, 0, 0};
    Pose pose = rest_pose(model);
    for (Vec3f& p : pose.positions) p.z() += p.x() * p.y();
    for (std::size_t v = 0; v < pose.positions.size(); ++v)
        pose.gradients.push_back(Mat3f::Identity() + float(v) * Vec3f(1, 2, 3) * Vec3f(4, 5, 6).transpose());
    for (const bool with_gradients : {true, false}) {
        if (!with_gradients) pose.gradients.clear();
        const Mesh moved = posed_driver(model, pose);
        EXPECT_EQ(check_mesh(moved), "");
        EXPECT_TRUE(moved.normals.empty()); // those at rest are wrong now
        EXPECT_EQ(moved.corners, model.driver().corners);
        const Pose back = pose_of_mesh(moved, model.mesh.origin);
        EXPECT_TRUE(same_bytes(back.positions, pose.positions));
        EXPECT_EQ(back.gradients, pose.gradients);
        EXPECT_TRUE(pose_of_mesh(moved, Vec3d(999, 0, 0)).positions[0].isApprox(pose.positions[0] + Vec3f::UnitX()));
    }
}
