#include "filigree/fit/pose_fit.h"

#include "fit/made_animations.h"
#include "threads.h"

#include "filigree/fit/fitted_poses.h"
#include "filigree/pose.h"
#include "filigree/restore.h"

#include <gtest/gtest.h>

namespace {

using namespace filigree;
using namespace filigree_test;

double diagonal(const Model& model) { return bounds(model.mesh).diagonal(); }

/// The model's own restored mesh comes back from a fit on its own driver.
void expect_back(const Model& model, const Pose& pose, double tolerance) {
    const Restorer restorer = Restorer::create(model).value();
    const std::vector<Vec3f> positions = restorer.positions(pose).value();
    const PoseFit fit = PoseFit::create(model, {}, kAllThreads).value();
    const std::vector<Vec3f> back = restorer.positions(fit.fit(positions, kAllThreads).value()).value();
    double squared = 0;
    for (std::size_t v = 0; v < back.size(); ++v) squared += double((back[v] - positions[v]).squaredNorm());
    EXPECT_LT(std::sqrt(squared / double(back.size())), tolerance * diagonal(model));
}

TEST(PoseFit, RestoredMeshesComeBack) {
    const Model model = strip(wavy_sphere(24), {.base = 150}).value().model;
    const Box box = world_bounds(model.mesh);
    const auto bend = make_bend(box, Axis::x, 120), twist = make_twist(box, Axis::y, 150);
    for (const auto* warp : {bend.get(), twist.get()}) {
        Pose pose = warp_pose(*warp, model);
        expect_back(model, pose, 1e-6); // gradients that are not those of its positions
        pose.gradients.clear();
        expect_back(model, pose, 1e-6);
    }
}

TEST(PoseFit, FarFromTheOriginToo) {
    Model model = strip(wavy_sphere(16), {.base = 80}).value().model;
    Pose pose = warp_pose(*make_bend(world_bounds(model.mesh), Axis::x, 90), model);
    for (Vec3f& p : pose.positions) p += Vec3f(100, -50, 20);
    expect_back(model, pose, 2e-6 + 100 * 6e-8); // as far as floats hold a walk
}

/// Fitting more is never worse: the driver's own motion with estimated gradients, gradients fitted, both fitted.
TEST(PoseFit, BothAreNoWorseThanGradientsAndTheseThanEstimates) {
    const MadeAnimation all[] = {flag(60, 40, 8),
                                 rod_in_tube(48, 40, 8),
                                 crumple(60, 40, 8),
                                 skinned(wavy_sphere(24), 6, 8),
                                 bulges(wavy_sphere(24), 8, 8),
                                 fluid(wavy_sphere(20), 8)};
    for (const MadeAnimation& made : all)
        for (const std::size_t base : {60u, 300u}) {
            const Model model = strip(*made.rest, {.base = base}).value().model;
            const Restorer restorer = Restorer::create(model).value();
            const auto rms = [&](const PoseFitOptions& options) {
                return fit_poses(model, made.animation.frames, made.animation.positions, options, kAllThreads)
                    .value()
                    .error.rms;
            };
            double squared = 0;
            std::vector<Vec3f> truth(model.vertex_count());
            for (std::size_t frame = 0; frame < made.animation.frames; ++frame) {
                ASSERT_TRUE(made.animation.positions(frame, truth).ok());
                Pose given;
                for (const Index v : model.driver().vertices) given.positions.push_back(truth[v]);
                const std::vector<Vec3f> restored = restorer.positions(given).value();
                for (std::size_t v = 0; v < truth.size(); ++v)
                    squared += double((restored[v] - truth[v]).squaredNorm());
            }
            const double estimated = std::sqrt(squared / double(truth.size() * made.animation.frames));
            const double gradients = rms({.hold = 1e9, .refine = false}), both = rms({});
            const double rounding = 1e-7 * diagonal(model);
            EXPECT_LE(both, gradients + rounding) << base << ' ' << made.rest->vertex_count();
            EXPECT_LE(gradients, estimated + rounding) << base;
            EXPECT_LT(both, 0.9 * estimated + rounding) << base;
        }
}

TEST(PoseFit, APriorHoldsWhatTheMeshSaysNothingOf) {
    // A flat sheet that stays flat says nothing of what happens across it: gradients stay those of a rotation.
    const Model model = strip(sheet(40, 26), {.base = 60}).value().model;
    const Mat3f turn = Eigen::AngleAxisf(0.7f, Vec3f(1, 2, 0.5f).normalized()).toRotationMatrix();
    std::vector<Vec3f> turned;
    for (const Vec3f& p : model.mesh.positions) turned.push_back(turn * p + Vec3f(5, 0, 0));
    const Pose pose = PoseFit::create(model, {}, kAllThreads).value().fit(turned, kAllThreads).value();
    for (const Mat3f& gradient : pose.gradients) EXPECT_LT((gradient - turn).norm(), 1e-4f);
}

TEST(PoseFit, GradientsStaySoundWherePartsComeApart) {
    // Two balls at one place; one of them leaves.
    Mesh mesh = wavy_sphere(10);
    const std::size_t first = mesh.vertex_count();
    append(mesh, wavy_sphere(10));
    const Model model = strip(mesh, {.base = 60}).value().model;
    std::vector<Vec3f> moved = mesh.positions;
    for (std::size_t v = first; v < moved.size(); ++v) moved[v] += Vec3f(4, 0, 0);
    const Pose pose = PoseFit::create(model, {}, kAllThreads).value().fit(moved, kAllThreads).value();
    for (const Mat3f& gradient : pose.gradients) {
        EXPECT_TRUE(gradient.allFinite());
        EXPECT_LT(gradient.norm(), 30.f);
    }
}

} // namespace
