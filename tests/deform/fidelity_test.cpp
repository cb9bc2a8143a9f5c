#include "filigree/deform/fidelity.h"

#include "filigree/deform/restored_error.h"
#include "filigree/mesh/shapes.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

const RunContext kOneThread(1);

TEST(Fidelity, FallsWithEveryFinerDriver) {
    for (const Mesh& mesh :
         {make_wavy_sphere({.resolution = 80}), make_torus({.resolution = 80}), make_wavy_plane({.resolution = 120})})
        for (const PoseSource source : {PoseSource::positions, PoseSource::gradients}) {
            double coarser = 1;
            for (const std::size_t base : {250, 1000, 4000}) {
                StripOptions options;
                options.base = base;
                const double error =
                    fidelity(strip(mesh, options, kOneThread).value().model, source, kOneThread).value();
                EXPECT_LT(error, coarser);
                coarser = error;
            }
        }
}

/// Warps of other axes, angles and seeds than those of the family.
double error_of_others(const Model& model) {
    const Box box = world_bounds(model.mesh);
    std::vector<std::unique_ptr<SpaceWarp>> others;
    others.push_back(make_bend(box, Axis::y, 120));
    others.push_back(make_twist(box, Axis::z, 150));
    others.push_back(make_taper(box, Axis::y, 0.6));
    others.push_back(make_smooth_random(box, 0.2, 77));
    double largest = 0;
    for (const auto& warp : others) {
        Pose pose = warp_pose(*warp, model, kOneThread);
        pose.gradients.clear();
        const auto truth = warp_positions(*warp, model.mesh.positions, model.mesh.origin, kOneThread);
        const double error = restored_error(model, {}, pose, truth, kOneThread).value().rms;
        largest = std::max(largest, error / bounds(truth).diagonal());
    }
    return largest;
}

TEST(Fidelity, AskedAndReachedAlsoByOtherWarps) {
    const Mesh mesh = make_wavy_sphere({.resolution = 96});
    std::size_t coarser = 0;
    for (const double goal : {1e-3, 1e-4, 2e-5}) {
        const StrippedToFidelity result =
            strip_to_fidelity(mesh, {}, {goal, PoseSource::positions}, kOneThread).value();
        EXPECT_LE(result.error, goal);
        EXPECT_LE(error_of_others(result.stripped.model), goal) << goal;
        const std::size_t driver = result.stripped.model.driver().vertices.size();
        EXPECT_GT(driver, coarser); // and no finer than it has to be
        EXPECT_LT(result.tried, 12u);
        coarser = driver;
    }
}

TEST(Fidelity, WholeMeshWhereNothingLessWillDo) {
    const Mesh mesh = make_wavy_sphere({.resolution = 8});
    const StrippedToFidelity result = strip_to_fidelity(mesh, {}, {1e-9, PoseSource::gradients}, kOneThread).value();
    EXPECT_EQ(result.stripped.model.driver().vertices.size(), mesh.vertex_count());
}

TEST(Fidelity, RefusesWhatMakesNoSense) {
    const Mesh mesh = make_wavy_sphere({.resolution = 8});
    StripOptions reference, sized;
    reference.code = DetailCode::reference;
    sized.base = 20;
    for (const auto& result :
         {strip_to_fidelity(mesh, {}, {0, {}}, kOneThread), strip_to_fidelity(mesh, reference, {}, kOneThread),
          strip_to_fidelity(mesh, sized, {}, kOneThread)})
        EXPECT_EQ(result.error().code, ErrorCode::usage);
    RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(strip_to_fidelity(mesh, {}, {}, cancelled).error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
