#include "fit/made_animations.h"
#include "threads.h"

#include "filigree/fit.h"
#include "filigree/restore.h"

#include <gtest/gtest.h>

#include <limits>

namespace {

using namespace filigree;
using namespace filigree_test;

/// What the report says, measured again.
struct Measured {
    double rms = 0, max = 0;
    std::size_t frame = 0;
    Index vertex = 0;
};
Measured measure(const Fitted& fitted, const MeshAnimation& animation) {
    const Restorer restorer = Restorer::create(fitted.model).value();
    std::vector<Vec3f> truth(animation.rest->vertex_count());
    Measured measured;
    double squared = 0, most = -1;
    for (std::size_t frame = 0; frame < animation.frames; ++frame) {
        EXPECT_TRUE(animation.positions(frame, truth).ok());
        const std::vector<Vec3f> restored = restorer.positions(fitted.poses.frames[frame]).value();
        for (Index v = 0; v < truth.size(); ++v) {
            const double one = (restored[v].cast<double>() - truth[v].cast<double>()).squaredNorm();
            squared += one;
            if (one <= most) continue;
            most = one;
            measured.frame = frame;
            measured.vertex = v;
        }
    }
    measured.rms = std::sqrt(squared / double(truth.size() * animation.frames)) / fitted.report.diagonal;
    measured.max = std::sqrt(most) / fitted.report.diagonal;
    return measured;
}

std::string sentence(const MeshAnimation& animation, const FitOptions& options, ErrorCode code) {
    const Result<Fitted> fitted = fit_animation(animation, options);
    EXPECT_FALSE(fitted.ok());
    if (fitted) return {};
    EXPECT_EQ(fitted.error().code, code);
    return fitted.error().message;
}

TEST(Fit, AffineMotionsComeBackWithTheSmallestDriver) {
    const MadeAnimation made = affine(wavy_sphere(16), 8);
    const Fitted fitted = fit_animation(made.animation).value();
    EXPECT_EQ(fitted.report.driver_vertices, 12u);
    EXPECT_LT(fitted.report.rms, 1e-6);
    EXPECT_LT(fitted.report.max, 4e-6);
}

TEST(Fit, ErrorsAskedForAreReachedAndMeasured) {
    const struct {
        const char* name;
        MadeAnimation made;
        std::vector<double> errors;
    } cases[] = {{"flag", flag(100, 66, 12), {1e-3, 1e-4, 3e-5}},
                 {"rod", rod_in_tube(64, 60, 12), {1e-3, 1e-4, 3e-5}},
                 {"crumple", crumple(80, 54, 10), {3e-3, 1e-3}},
                 {"skin", skinned(wavy_sphere(36), 6, 10), {1e-3, 3e-4}},
                 {"bulges", bulges(wavy_sphere(36), 12, 10), {1e-3, 1e-4, 3e-5}}};
    for (const auto& [name, made, errors] : cases) {
        std::size_t last = 0;
        for (const double error : errors) {
            SCOPED_TRACE(std::string(name) + " " + std::to_string(error));
            const Result<Fitted> fitted = fit_animation(made.animation, {.error = error});
            ASSERT_TRUE(fitted.ok()) << fitted.error().message;
            const Measured measured = measure(*fitted, made.animation);
            EXPECT_LE(measured.rms, error);
            EXPECT_GE(measured.rms, fitted->report.driver_vertices > 110 ? 0.5 * error : 0); // no finer than needed
            EXPECT_NEAR(fitted->report.rms, measured.rms, 1e-6 * error);
            EXPECT_NEAR(fitted->report.max, measured.max, 1e-6 * error);
            EXPECT_EQ(fitted->report.max_frame, measured.frame);
            EXPECT_EQ(fitted->report.max_vertex, measured.vertex);
            EXPECT_EQ(fitted->report.driver_vertices, fitted->model.driver().vertices.size());
            EXPECT_GE(fitted->report.driver_vertices, last);
            last = fitted->report.driver_vertices;
            EXPECT_EQ(check_model(fitted->model), "");
            EXPECT_EQ(fitted->model.mesh.positions, made.rest->positions);
            ASSERT_EQ(fitted->poses.frames.size(), made.animation.frames);
        }
    }
}

TEST(Fit, TheLargestErrorIsAGoalToo) {
    const MadeAnimation made = flag(100, 66, 12);
    const Fitted loose = fit_animation(made.animation, {.error = 1e-3}).value();
    const Fitted strict = fit_animation(made.animation, {.error = 1e-3, .max_error = loose.report.max / 4}).value();
    EXPECT_LE(measure(strict, made.animation).max, loose.report.max / 4);
    EXPECT_GT(strict.report.driver_vertices, loose.report.driver_vertices);
}

TEST(Fit, ABaseIsTakenAsItIs) {
    const MadeAnimation made = flag(60, 40, 6);
    const Fitted fitted = fit_animation(made.animation, {.error = 1e-9, .base = 200}).value();
    EXPECT_EQ(fitted.report.driver_vertices, 200u);
    EXPECT_GT(fitted.report.rms, 1e-9);
    EXPECT_EQ(fitted.report.tries, 1u);
}

TEST(Fit, AFluidIsRefusedWithWhatIsReached) {
    const MadeAnimation made = fluid(wavy_sphere(24), 30);
    const std::string refused = sentence(made.animation, {}, ErrorCode::unsuitable);
    EXPECT_NE(refused.find("of the diagonal (rms)"), std::string::npos) << refused;
    EXPECT_NE(refused.find("a driver of 864 vertices"), std::string::npos) << refused; // a quarter
}

TEST(Fit, LevelsAreNested) {
    const MadeAnimation made = flag(200, 130, 4);
    const Fitted fitted = fit_animation(made.animation, {.base = 100}).value();
    const std::vector<Level>& levels = fitted.model.levels;
    ASSERT_GE(levels.size(), 3u);
    for (std::size_t k = 0; k + 1 < levels.size(); ++k) {
        EXPECT_LE(2 * levels[k].vertices.size(), levels[k + 1].vertices.size());
        EXPECT_TRUE(std::ranges::includes(levels[k + 1].vertices, levels[k].vertices));
    }
}

TEST(Fit, LargeMeshesAreTriedOnASample) {
    const MadeAnimation made = bulges(wavy_sphere(120), 8, 4); // 86,402 vertices
    ASSERT_GT(made.rest->vertex_count(), 65'536u);
    const Fitted fitted = fit_animation(made.animation, {.error = 2e-4}).value();
    EXPECT_LE(measure(fitted, made.animation).rms, 2e-4);
    EXPECT_GE(fitted.report.rms, 1e-4);
}

TEST(Fit, PartsThatTouchAtRestPart) {
    // Two sheets that share the places of a seam, and then move away from each other.
    Mesh mesh = sheet(30, 20);
    const std::size_t first = mesh.vertex_count();
    Mesh other = sheet(30, 20);
    for (Vec3f& p : other.positions) p.x() += 1.5f;
    append(mesh, other);
    const MadeAnimation made = animate(mesh, 5, [=, places = places_of(mesh)](std::size_t frame) {
        std::vector<Vec3d> moved = places;
        for (std::size_t v = first; v < moved.size(); ++v) moved[v] += Vec3d(0.2, 0, 0.1) * double(frame);
        return moved;
    });
    const Fitted fitted = fit_animation(made.animation, {.error = 1e-5}).value();
    EXPECT_EQ(fitted.report.parted, 21u);
    EXPECT_LE(measure(fitted, made.animation).rms, 1e-5);
    EXPECT_LT(fitted.report.driver_vertices, 120u);
}

TEST(Fit, CopiesThatStayTogetherAreOne) {
    Mesh mesh = sheet(30, 20);
    Mesh split; // every triangle with vertices of its own
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        std::vector<Index> face;
        for (const Index v : mesh.face(f)) {
            face.push_back(Index(split.vertex_count()));
            split.positions.push_back(mesh.positions[v]);
        }
        split.add_face(face);
    }
    const MadeAnimation made = animate(split, 6, [places = places_of(split)](std::size_t frame) {
        std::vector<Vec3d> moved = places;
        for (Vec3d& p : moved) p.z() += 0.02 * double(frame) * std::sin(3 * p.x());
        return moved;
    });
    const Fitted fitted = fit_animation(made.animation, {.error = 1e-4}).value();
    EXPECT_EQ(fitted.report.parted, 0u);
    EXPECT_LT(fitted.report.driver_vertices, 130u);
    // A cache has all 3,600 vertices, so a driver of more than a quarter of the 651 places is smaller still.
    const MadeAnimation rough = animate(split, 4, [places = places_of(split)](std::size_t frame) {
        std::vector<Vec3d> moved = places;
        for (Vec3d& p : moved) p.z() += 0.01 * std::sin(1e5 * (p.x() + 0.37) * (p.y() + 0.61) + 2 * double(frame));
        return moved;
    });
    EXPECT_GT(fit_animation(rough.animation).value().report.driver_vertices, 400u);
}

TEST(Fit, AFrameMayBeTheRest) {
    MadeAnimation made = flag(40, 26, 9);
    const auto wild = made.animation.positions;
    // Only frame 4 is unstretched.
    made.animation.positions = [wild](std::size_t frame, std::span<Vec3f> positions) -> Status {
        if (Status done = wild(0, positions); !done) return done;
        const float stretch = 1 + 0.5f * float(int(frame) - 4);
        for (Vec3f& p : positions) p.x() *= frame == 4 ? 1 : std::max(0.2f, stretch);
        return Success{};
    };
    const std::size_t rest = least_stretched_frame(made.animation).value();
    EXPECT_TRUE(rest == 4 || rest == 3 || rest == 5) << rest; // between the shortest and the longest
    const Fitted fitted = fit_animation(made.animation, {.rest_frame = rest}).value();
    std::vector<Vec3f> positions(made.rest->vertex_count());
    ASSERT_TRUE(made.animation.positions(rest, positions).ok());
    EXPECT_EQ(fitted.model.mesh.positions, positions);
    EXPECT_LE(measure(fitted, made.animation).rms, 1e-4);
}

TEST(Fit, BadAnimationsGetOneSentence) {
    MadeAnimation made = flag(60, 40, 6);
    const auto sound = made.animation.positions;
    const auto replaced = [&](std::size_t bad, const std::function<void(std::span<Vec3f>)>& spoil) {
        MeshAnimation animation = made.animation;
        animation.positions = [=](std::size_t frame, std::span<Vec3f> positions) -> Status {
            if (Status done = sound(frame, positions); !done) return done;
            if (frame == bad) spoil(positions);
            return Success{};
        };
        return animation;
    };
    const auto not_a_number =
        replaced(3, [](std::span<Vec3f> positions) { positions[17].y() = std::numeric_limits<float>::quiet_NaN(); });
    EXPECT_EQ(sentence(not_a_number, {}, ErrorCode::unsuitable),
              "Frame 4: the position of vertex 17 is not a finite number; export the animation again.");
    const auto shuffled = replaced(
        5, [](std::span<Vec3f> positions) { std::shuffle(positions.begin(), positions.end(), std::mt19937(1)); });
    const std::string order = sentence(shuffled, {}, ErrorCode::unsuitable);
    EXPECT_TRUE(order.starts_with("Frame 6: half of its edges")) << order;
    MadeAnimation coarse = flag(18, 12, 6);
    coarse.animation.positions = [draw = coarse.animation.positions](std::size_t frame, std::span<Vec3f> positions) {
        const Status done = draw(frame, positions);
        if (frame == 4) std::shuffle(positions.begin(), positions.end(), std::mt19937(1));
        return done;
    };
    const std::string of_coarse = sentence(coarse.animation, {}, ErrorCode::unsuitable);
    EXPECT_TRUE(of_coarse.starts_with("Frame 5: half of its edges")) << of_coarse;
    MeshAnimation empty = made.animation;
    empty.frames = 0;
    EXPECT_EQ(sentence(empty, {}, ErrorCode::unsuitable), "The animation has no frames: there is nothing to fit.");
    MeshAnimation broken = made.animation;
    broken.positions = [](std::size_t, std::span<Vec3f>) -> Status {
        return Error{ErrorCode::bad_file, "The disk is on fire."};
    };
    EXPECT_EQ(sentence(broken, {}, ErrorCode::bad_file), "The disk is on fire.");
    Mesh points = *made.rest;
    points.face_offsets = {0};
    points.corners.clear();
    MeshAnimation of_points = made.animation;
    of_points.rest = &points;
    EXPECT_NE(sentence(of_points, {}, ErrorCode::unsuitable).find("no faces"), std::string::npos);
    Mesh one_place = *made.rest;
    std::ranges::fill(one_place.positions, Vec3f::Zero());
    MeshAnimation of_one_place = made.animation;
    of_one_place.rest = &one_place;
    EXPECT_NE(sentence(of_one_place, {}, ErrorCode::unsuitable).find("at one place"), std::string::npos);
    Mesh unsound = *made.rest;
    unsound.corners[0] = 1'000'000;
    MeshAnimation of_unsound = made.animation;
    of_unsound.rest = &unsound;
    sentence(of_unsound, {}, ErrorCode::usage);

    sentence(made.animation, {.error = 0}, ErrorCode::usage);
    sentence(made.animation, {.error = 1.5}, ErrorCode::usage);
    sentence(made.animation, {.error = std::numeric_limits<double>::quiet_NaN()}, ErrorCode::usage);
    sentence(made.animation, {.max_error = -1}, ErrorCode::usage);
    sentence(made.animation, {.base = 3}, ErrorCode::usage);
    sentence(made.animation, {.base = 1'000'000}, ErrorCode::usage);
    sentence(made.animation, {.rest_frame = 6}, ErrorCode::usage);
}

TEST(Fit, TheSameBytesForAnyNumberOfThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const MadeAnimation made = rod_in_tube(64, 60, 6);
    const Fitted one = fit_animation(made.animation, {}, kOneThread).value();
    const Fitted two = fit_animation(made.animation, {}, kTwoThreads).value();
    EXPECT_EQ(write_model(one.model, one.poses), write_model(two.model, two.poses));
    EXPECT_EQ(one.report.rms, two.report.rms);
    EXPECT_EQ(one.report.normal_mean_deg, two.report.normal_mean_deg);
}

TEST(Fit, CanBeCancelledAnywhere) {
    const MadeAnimation made = rod_in_tube(48, 40, 6);
    std::size_t reports = 0;
    RunContext counting;
    counting.progress = [&](std::string_view, double fraction) {
        EXPECT_GE(fraction, 0);
        EXPECT_LE(fraction, 1);
        ++reports;
    };
    ASSERT_TRUE(fit_animation(made.animation, {}, counting).ok());
    ASSERT_GT(reports, 20u);
    for (std::size_t k = 1; k < reports - 1; k += reports / 12) {
        RunContext context;
        std::size_t left = k;
        context.progress = [&](std::string_view, double) {
            if (--left == 0) context.cancel();
            if (left == 0) left = reports * 10;
        };
        const Result<Fitted> fitted = fit_animation(made.animation, {}, context);
        ASSERT_FALSE(fitted.ok()) << k << " of " << reports;
        EXPECT_EQ(fitted.error().code, ErrorCode::cancelled);
    }
}

} // namespace
