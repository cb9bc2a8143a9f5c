// What is not finite goes back to where it belongs.
#include "filigree/physics/body/make_cells.h"
#include "physics/simulation_scenes.h"
#include "physics/test_bodies.h"

#include <limits>

namespace filigree::lost_particles_test {
namespace {

using namespace simulation_scenes;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinite = std::numeric_limits<float>::infinity();

std::shared_ptr<const Body> cube(MaterialModel model) {
    const Cells cells = box_cells(5, 4, 3, 0.1);
    return std::make_shared<Body>(make_body(cells, material(model, 1e5)));
}

Actor far_and_turned(MaterialModel model) {
    Actor actor;
    actor.body = cube(model);
    actor.placement = Eigen::Translation3d(5, 7, 0) * Eigen::AngleAxisd(1.2, Vec3d(1, 2, 3).normalized());
    actor.velocity = {0.5, 0, 0};
    actor.spin = {0, 0.3, 0};
    return actor;
}

class LostParticles : public testing::TestWithParam<MaterialModel> {};
INSTANTIATE_TEST_SUITE_P(
    Simulation, LostParticles,
    testing::Values(MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree, MaterialModel::rigid,
                    MaterialModel::mpm),
    [](const auto& model) {
        return std::string(std::array{"fem", "springs", "meshfree", "rigid", "mpm"}[std::size_t(model.param)]);
    });

TEST_P(LostParticles, ReturnBesideTheOthers) {
    for (const float lost : {kNan, kInfinite, -kInfinite}) {
        const StepOptions options{.mode = StepMode::explicit_steps, .automatic_rigid = false};
        Simulation hurt = simulation(free_space(), {far_and_turned(GetParam())}, options);
        Simulation whole = simulation(free_space(), {far_and_turned(GetParam())}, options);
        run(hurt, 3);
        run(whole, 3);
        Vectors positions = hurt.positions(0), velocities = hurt.velocities(0);
        for (const std::size_t i : {std::size_t{3}, std::size_t{17}, positions.size() - 1}) {
            positions.y[i] = lost;
            velocities.x[i - 1] = lost;
        }
        ASSERT_TRUE(hurt.set_positions(0, positions).ok());
        ASSERT_TRUE(hurt.set_velocities(0, velocities).ok());
        run(hurt, 10);
        run(whole, 10);
        ASSERT_TRUE(all_finite(hurt.positions(0)) && all_finite(hurt.velocities(0)));
        EXPECT_LT((centre_of_mass(hurt) - centre_of_mass(whole)).norm(), 2e-3);
        for (std::size_t i = 0; i < positions.size(); ++i)
            EXPECT_LT((hurt.positions(0)[i] - whole.positions(0)[i]).norm(), 0.02f) << i;
    }
}

TEST_P(LostParticles, ABodyWithoutAnyNumberStandsWhereItWasPut) {
    const StepOptions options{.automatic_rigid = false};
    Simulation hurt = simulation(free_space(), {far_and_turned(GetParam())}, options);
    const Vec3d before = centre_of_mass(hurt);
    Vectors positions = hurt.positions(0);
    for (std::size_t i = 0; i < positions.size(); ++i) positions.set(i, Vec3f::Constant(kNan));
    ASSERT_TRUE(hurt.set_positions(0, positions).ok());
    const FrameReport report = run(hurt, 1);
    EXPECT_LT((centre_of_mass(hurt) - before).norm(), 0.05);
    EXPECT_LT(shape_error(hurt), 0.02);
    if (GetParam() != MaterialModel::rigid) { // that one is repaired where it is set
        EXPECT_EQ(report.clamped_particles, positions.size());
    }
}

} // namespace
} // namespace filigree::lost_particles_test
