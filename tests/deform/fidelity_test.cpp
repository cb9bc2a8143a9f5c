#include "filigree/pose.h"

#include "filigree/deform/restored_error.h"
#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "hierarchy/part_meshes.h"
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

/// The rms error of each of some parts, bent by 120 degrees along z with gradients, as a fraction of the diagonal.
std::vector<double> errors_of_parts(const Mesh& mesh, const StripOptions& options, std::span<const std::size_t> ends) {
    const Model model = strip(mesh, options, kOneThread).value().model;
    const auto warp = make_bend(world_bounds(mesh), Axis::z, 120);
    const std::vector<Vec3f> truth = warp_positions(*warp, mesh.positions, mesh.origin, kOneThread);
    const Restorer restorer = Restorer::create(model, {}, kOneThread).value();
    const std::vector<Vec3f> back = restorer.positions(warp_pose(*warp, model, kOneThread), kOneThread).value();
    std::vector<double> errors;
    std::size_t v = 0;
    for (const std::size_t end : ends) {
        double sum = 0;
        const double count = double(end - v);
        for (; v < end; ++v) sum += double((back[v] - truth[v]).squaredNorm());
        errors.push_back(std::sqrt(sum / count) / bounds(truth).diagonal());
    }
    return errors;
}

/// The smooth part beside a detailed one was off by 3e-3 with any driver.
TEST(Fidelity, OfEveryPartFallsWithEveryFinerDriver) {
    const Mesh mesh = filigree_test::make_two_tubes(160, 150);
    const std::size_t half = mesh.vertex_count() / 2, ends[] = {half, 2 * half};
    for (const std::size_t one_piece : {600'000u, 10'000u}) { // the latter begins in clusters
        std::vector<double> coarser = {1e-3, 1e-3};
        for (const std::size_t base : {300u, 1'000u, 3'000u, 12'000u}) {
            StripOptions options;
            options.base = base;
            options.one_piece = one_piece;
            const std::vector<double> errors = errors_of_parts(mesh, options, ends);
            for (std::size_t part = 0; part < 2; ++part)
                EXPECT_LT(errors[part], coarser[part]) << base << ' ' << part << ' ' << one_piece;
            coarser = errors;
        }
        EXPECT_LT(std::max(coarser[0], coarser[1]), 1e-6);
    }
}

/// Rivets that the driver has no vertex of keep their size and ride on the ball.
TEST(Fidelity, LooseRivetsRideOnTheSurface) {
    Mesh mesh = make_ball(Vec3d::Zero(), 1);
    const std::size_t ball = mesh.vertex_count();
    std::vector<std::size_t> ends = {ball};
    const Mesh rivet = make_wavy_sphere({.resolution = 4, .amplitude = 0, .size = 2});
    for (unsigned k = 0; k < 60; ++k) {
        const double z = 1 - (k + 0.5) / 30, turn = 2.39996 * k, r = std::sqrt(1 - z * z); // a spiral
        filigree_test::add_part(mesh, rivet, 0.02f,
                                (1.015 * Vec3d(r * std::cos(turn), r * std::sin(turn), z)).cast<float>());
        ends.push_back(mesh.vertex_count());
    }
    StripOptions options;
    options.base = 400;
    EXPECT_GT(strip(mesh, options, kOneThread).value().report.across_gap, 1'000u);
    for (const double error : errors_of_parts(mesh, options, ends)) EXPECT_LT(error, 1e-3);
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
    StripOptions sized;
    sized.base = 20;
    for (const auto& result :
         {strip_to_fidelity(mesh, {}, {0, {}}, kOneThread), strip_to_fidelity(mesh, sized, {}, kOneThread)})
        EXPECT_EQ(result.error().code, ErrorCode::usage);
    RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(strip_to_fidelity(mesh, {}, {}, cancelled).error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
