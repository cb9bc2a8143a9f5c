#include "filigree/deform/fidelity.h"

#include "filigree/deform/restored_error.h"
#include "filigree/mesh/shapes.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(Fidelity, FallsWithEveryFinerDriver) {
    for (const Mesh& mesh :
         {make_wavy_sphere({.resolution = 80}), make_torus({.resolution = 80}), make_wavy_plane({.resolution = 120}),
          make_cylinder({.resolution = 20}), make_bar({.resolution = 20})})
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

TEST(Fidelity, OfADriverIsMeasuredOnSomeVertices) {
    const Mesh mesh = make_wavy_sphere({.resolution = 128}); // 98,306 vertices: not all are taken
    StripOptions options;
    options.base = 800;
    const Model model = strip(mesh, options, kOneThread).value().model;
    const DriverFidelity some = driver_fidelity(model, kOneThread).value();
    const double positions = fidelity(model, PoseSource::positions, kOneThread).value();
    const double gradients = fidelity(model, PoseSource::gradients, kOneThread).value();
    EXPECT_NEAR(some.positions, positions, 0.03 * positions);
    EXPECT_NEAR(some.gradients, gradients, 0.03 * gradients);
    const DriverFidelity again = driver_fidelity(model, RunContext(2)).value();
    EXPECT_EQ(some.positions, again.positions); // same bytes
    EXPECT_EQ(some.gradients, again.gradients);
    RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(driver_fidelity(model, cancelled).error().code, ErrorCode::cancelled);
}

TEST(Fidelity, OfAReferenceModelHasNoUseForGradients) {
    StripOptions options;
    options.code = DetailCode::reference;
    const Model model = strip(make_wavy_cube({.resolution = 32}), options, kOneThread).value().model;
    const DriverFidelity measured = driver_fidelity(model, kOneThread).value();
    EXPECT_EQ(measured.positions, fidelity(model, PoseSource::positions, kOneThread).value());
    EXPECT_EQ(measured.positions, measured.gradients);
}

using WarpList = std::vector<std::unique_ptr<SpaceWarp>>;

double largest_error(const Model& model, const WarpList& warps, PoseSource source) {
    double largest = 0;
    for (const auto& warp : warps) {
        Pose pose = warp_pose(*warp, model, kOneThread);
        if (source == PoseSource::positions) pose.gradients.clear();
        const auto truth = warp_positions(*warp, model.mesh.positions, model.mesh.origin, kOneThread);
        const double error = restored_error(model, {}, pose, truth, kOneThread).value().rms;
        largest = std::max(largest, error / bounds(truth).diagonal());
    }
    return largest;
}

/// Warps of other axes, angles and seeds than those of the family.
double error_of_others(const Model& model) {
    const Box box = world_bounds(model.mesh);
    WarpList others;
    others.push_back(make_bend(box, Axis::y, 120));
    others.push_back(make_twist(box, Axis::z, 150));
    others.push_back(make_taper(box, Axis::y, 0.6).value());
    others.push_back(make_smooth_random(box, 0.2, 77));
    return largest_error(model, others, PoseSource::positions);
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

TEST(Fidelity, MeshesSmallerThanTheFirstDriverAreStrippedToo) {
    const Mesh mesh = make_torus({.resolution = 20}); // 800 vertices
    const StrippedToFidelity result = strip_to_fidelity(mesh, {}, {3e-3, PoseSource::positions}, kOneThread).value();
    EXPECT_LE(result.error, 3e-3);
    EXPECT_LT(result.stripped.model.driver().vertices.size(), 200u);
    EXPECT_LT(result.tried, 12u);
}

/// Ten warps that are nowhere more curved than the family's: along every axis, over a shorter side less.
double error_of_others_along_all_axes(const Model& model, PoseSource source) {
    const Box box = world_bounds(model.mesh);
    WarpList others;
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
        const double part = box.size()[static_cast<int>(axis)] / box.size().maxCoeff();
        others.push_back(make_bend(box, axis, 160 * part));
        others.push_back(make_taper(box, axis, 1 - 0.45 * part).value());
    }
    others.push_back(make_twist(box, longest_axis(box), -150));
    for (const std::uint64_t seed : {5, 6, 7}) others.push_back(make_smooth_random(box, 0.2, seed));
    return largest_error(model, others, source);
}

TEST(Fidelity, FineGoalsAreReachedOnFiveMeshes) {
    const Mesh meshes[] = {make_wavy_cube({.resolution = 32}), make_wavy_sphere({.resolution = 40}),
                           make_wavy_plane({.resolution = 80}), make_cylinder({.resolution = 20}),
                           make_torus({.resolution = 60})};
    for (const Mesh& mesh : meshes)
        for (const double goal : {1e-4, 1e-5}) {
            const PoseSource source = goal < 5e-5 ? PoseSource::gradients : PoseSource::positions;
            const StrippedToFidelity result = strip_to_fidelity(mesh, {}, {goal, source}, kOneThread).value();
            EXPECT_LE(result.error, goal);
            EXPECT_LE(error_of_others_along_all_axes(result.stripped.model, source), goal);
            EXPECT_LT(result.stripped.model.driver().vertices.size(), mesh.vertex_count());
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
