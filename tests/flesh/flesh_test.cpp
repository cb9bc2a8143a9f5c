// Skins that become soft matter.
#include "filigree/flesh.h"

#include "filigree/flesh/skin_map.h"

#include "flesh/made_skins.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <numeric>

namespace filigree {
namespace {

using namespace filigree_test;

constexpr unsigned kCoarse = 6;
const FleshOptions kSmall = {.particles = 400, .material = {.young_modulus = 2e4, .poisson_ratio = 0.45, .damping = 0}};
const FleshClipOptions kThirty = {.frames_per_second = 30};

FleshMeasure measure(const Flesh& flesh, const FleshClip& clip) { return measure_flesh(flesh, clip, 0).value(); }

TEST(Flesh, AnElbowKeepsItsVolumeWhereTheSkinLosesIt) {
    const Flesh flesh = Flesh::create(tube(kCoarse, 1, elbow(110, 1)), kSmall).value();
    EXPECT_GT(flesh.report().held, 10u);
    EXPECT_LT(flesh.report().held, flesh.body()->particle_count() / 2);
    const FleshClip clip = simulate_flesh(flesh, 0, kThirty).value();
    ASSERT_EQ(clip.frames.size(), 31u);
    EXPECT_EQ(clip.clamped_particles, 0u);
    const FleshMeasure m = measure(flesh, clip);
    EXPECT_TRUE(m.is_closed);
    EXPECT_LT(m.skin_least_volume, 0.97);
    EXPECT_GT(m.least_volume, m.skin_least_volume + 0.01);
    EXPECT_LT(m.most_volume, 1.02);
}

TEST(Flesh, AnElbowLiesOnItself) {
    FleshOptions options = kSmall;
    options.particles = 1500;
    const Flesh flesh = Flesh::create(tube(16, 1, elbow(110, 1)), options).value();
    const FleshMeasure m = measure_flesh(flesh, simulate_flesh(flesh, 0, kThirty).value(), 6).value();
    EXPECT_GT(m.skin_overlap, 1e-2);
    EXPECT_LT(m.overlap, 1e-4);
}

TEST(Flesh, ATwistKeepsItsVolume) {
    const Flesh flesh = Flesh::create(tube(kCoarse, 1, twist(170, 1)), kSmall).value();
    const FleshMeasure m = measure(flesh, simulate_flesh(flesh, 0, kThirty).value());
    EXPECT_LT(m.skin_least_volume, 0.92);
    EXPECT_GT(m.least_volume, 0.985);
}

TEST(Flesh, AtRestNothingSagsUnlessItIsAskedTo) {
    const TubeMotion still = [](double) { return std::pair(0.0, 0.0); };
    FleshOptions options = kSmall;
    const Flesh sculpted = Flesh::create(tube(kCoarse, 0.5, still), options).value();
    options.sculpted_gravity = false;
    const Flesh sagging = Flesh::create(tube(kCoarse, 0.5, still), options).value();
    EXPECT_LT(measure(sculpted, simulate_flesh(sculpted, 0, kThirty).value()).furthest, 1e-4);
    EXPECT_GT(measure(sagging, simulate_flesh(sagging, 0, kThirty).value()).furthest, 1e-3);
}

TEST(Flesh, ALoopEndsAsItBegins) {
    const Flesh flesh = Flesh::create(tube(kCoarse, 0.77, waving(40, 1 / 0.77)), kSmall).value();
    const FleshClip clip = simulate_flesh(flesh, 0, {.frames_per_second = 30, .loop = true}).value();
    EXPECT_TRUE(clip.is_loop);
    EXPECT_GE(clip.cycles, 2u);
    EXPECT_NEAR(double(clip.frames.size() - 1) / clip.frames_per_second, 0.77, 1e-9);
    EXPECT_LT(clip.loop_rms, 0.01);
    const Vectors &first = clip.frames.front(), &last = clip.frames.back();
    for (std::size_t i = 0; i < first.size(); ++i) ASSERT_EQ(first[i], last[i]) << i;
}

TEST(Flesh, FastTeleportingAndTurningMotionStaysWhole) {
    const auto root = [](double t) {
        Eigen::Affine3d at = Eigen::Affine3d::Identity();
        if (t > 0.2) at.translation() = Vec3d(3, 0, 0);
        if (t > 0.4) at.linear() = Eigen::AngleAxisd(std::numbers::pi, Vec3d::UnitY()).toRotationMatrix();
        return at;
    };
    const Flesh flesh = Flesh::create(tube(kCoarse, 0.6, waving(60, 6), root), kSmall).value();
    const FleshClip clip = simulate_flesh(flesh, 0).value();
    EXPECT_EQ(clip.clamped_particles, 0u);
    EXPECT_EQ(clip.unstable_substeps, 0u);
    EXPECT_LT(clip.most_substeps, 60u);
    EXPECT_EQ(clip.inverted_cells, 0u);
    EXPECT_LT(measure(flesh, clip).furthest, 0.2);
}

TEST(Flesh, SizeDoesNotMatterBesideTheScale) {
    const auto furthest = [](double size) {
        SkinnedMesh skin = tube(kCoarse, 0.4, waving(40, 2.5));
        for (Vec3f& p : skin.mesh.positions) p *= float(size);
        for (SkinJoint& joint : skin.joints) joint.place *= size;
        const auto unit = skin.transforms;
        skin.transforms = [unit, size](std::size_t clip, double t, std::span<Eigen::Affine3d> out) {
            unit(clip, t, out);
            for (Eigen::Affine3d& joint : out) joint.translation() *= size;
        };
        const Flesh flesh = Flesh::create(std::move(skin), kSmall).value();
        EXPECT_NEAR(flesh.scale() * size, 1, 1e-9);
        return measure(flesh, simulate_flesh(flesh, 0, kThirty).value()).furthest;
    };
    const double one = furthest(1);
    EXPECT_NEAR(furthest(100), one, 1e-3);
    EXPECT_NEAR(furthest(0.01), one, 1e-3);
}

TEST(Flesh, SoftJointsHoldLess) {
    FleshOptions options = kSmall;
    const Flesh firm = Flesh::create(tube(kCoarse, 0.5, waving(40, 2)), options).value();
    options.soft = {{"low*", 0.02}};
    const Flesh loose = Flesh::create(tube(kCoarse, 0.5, waving(40, 2)), options).value();
    EXPECT_EQ(loose.report().soft, std::vector<std::string>{"lower"});
    EXPECT_LT(loose.report().held, firm.report().held);
    EXPECT_GT(measure(loose, simulate_flesh(loose, 0, kThirty).value()).furthest,
              3 * measure(firm, simulate_flesh(firm, 0, kThirty).value()).furthest);
}

TEST(Flesh, AJointMayHaveACoreAndSpringsOfItsOwn) {
    FleshOptions options = kSmall;
    options.soft = {
        {.pattern = "lower", .strength = 1, .core = 0, .frequency = 3, .surface_frequency = 3, .damping = 7}};
    const Flesh flesh = Flesh::create(tube(kCoarse, 0.5, waving(40, 2)), options).value();
    bool some_held = false;
    for (std::size_t i = 0; i < flesh.body()->particle_count(); ++i) {
        const float x = flesh.body()->rest[i].x(), frequency = flesh.follow().frequency[i];
        some_held |= x < -0.15f && std::isinf(frequency);
        if (x < 0.35f) continue; // all of the lower joint's
        EXPECT_NEAR(frequency, 3, 1e-4f);
        EXPECT_NEAR(flesh.follow().damping[i], 7, 1e-4f);
    }
    EXPECT_TRUE(some_held);
    options.soft[0].core = 2;
    EXPECT_FALSE(Flesh::create(tube(kCoarse, 0.5, waving(40, 2)), options).ok());
}

TEST(Flesh, PaintedPlacesAreLoose) {
    const auto skin = [] { return tube(kCoarse, 0.5, waving(40, 2)); };
    FleshOptions options = kSmall;
    for (const Vec3f& p : skin().mesh.positions) options.loose.push_back(p.x() > 0 ? 1.0f : 0.0f);
    const Flesh painted = Flesh::create(skin(), options).value();
    for (std::size_t i = 0; i < painted.body()->particle_count(); ++i) {
        const float x = painted.body()->rest[i].x();
        if (x < 0.2f) continue;
        EXPECT_LT(painted.follow().frequency[i], 2) << x; // 10 Hz sqrt(0.02)
        EXPECT_TRUE(std::isinf(painted.follow().leash[i]));
    }
    EXPECT_GT(painted.report().held, 5u);
    options.loose.pop_back();
    EXPECT_NE(Flesh::create(skin(), options).error().message.find("vertices"), std::string::npos);
}

TEST(Flesh, JointsAreNumbersOfTheVertices) {
    const SkinnedMesh skin = tube(8, 1, elbow(90, 1));
    const std::vector<float> lower = skin_map(skin, "joint low*").value(), all = skin_map(skin, "joint upper").value();
    for (std::size_t v = 0; v < lower.size(); ++v) {
        const double x = skin.mesh.positions[v].x();
        EXPECT_NEAR(lower[v], smooth((x + 0.1) / 0.2), 1e-6);
        EXPECT_NEAR(all[v], 1, 1e-6); // the lower joint hangs below the upper one
    }
    EXPECT_EQ(skin_map(skin, "joint tail").error().message,
              "The mesh has nothing for 'joint tail'; it has the joints upper, lower.");
    EXPECT_EQ(skin_map(skin, "color.r").error().code, ErrorCode::unsuitable);
}

/// Beside its skin, in which two boxes end half in each other: a quarter of the volume.
FleshMeasure falling_box(std::vector<JointContact> contacts) {
    SkinnedMesh skin;
    skin.mesh = make_box({0, 0, 0}, {0.6, 0.2, 0.2});
    const Mesh other = make_box({0, 0.5, 0}, {0.6, 0.2, 0.2});
    const auto first = Index(skin.mesh.vertex_count());
    skin.mesh.positions.insert(skin.mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (std::size_t f = 0; f < other.face_count(); ++f) {
        std::vector<Index> face(other.face(f).begin(), other.face(f).end());
        for (Index& v : face) v += first;
        skin.mesh.add_face(face);
    }
    skin.joints = {{.name = "below"}, {.name = "above", .parent = 0, .place = {0, 0.5, 0}}};
    for (Index v = 0; v < skin.mesh.vertex_count(); ++v) {
        skin.weights.joints.push_back(v < first ? 0 : 1);
        skin.weights.weights.push_back(1);
        skin.weights.first.push_back(v + 1);
    }
    skin.clips = {{"falls", 0.5}};
    skin.transforms = [](std::size_t, double t, std::span<Eigen::Affine3d> out) {
        out[0] = Eigen::Affine3d::Identity();
        out[1] = Eigen::Affine3d(Eigen::Translation3d(Vec3d(0, -0.8 * std::min(t, 0.5), 0)));
    };
    FleshOptions options = kSmall;
    options.contacts = std::move(contacts);
    const Flesh flesh = Flesh::create(skin, options).value();
    return measure_flesh(flesh, simulate_flesh(flesh, 0, kThirty).value(), 16).value();
}

TEST(Flesh, LimbsPassThroughEachOtherWhereTheyShould) {
    const auto furthest = [](std::vector<JointContact> contacts) { return falling_box(std::move(contacts)).furthest; };
    EXPECT_GT(furthest({}), 0.03);
    EXPECT_LT(furthest({{"below", "above"}}), 0.01);
    EXPECT_LT(furthest({{.first = "bel*", .second = "above"}}), 0.01);
    EXPECT_GT(furthest({{"*", "*"}, {.first = "below", .second = "above", .touch = true}}), 0.03);
    FleshOptions options = kSmall;
    options.contacts = {{"upper", "hand"}};
    EXPECT_NE(Flesh::create(tube(kCoarse, 0.2, waving(40, 2)), options).error().message.find("'hand'"),
              std::string::npos);
}

TEST(Flesh, OverlapsAreMeasured) {
    const FleshMeasure touching = falling_box({}), passing = falling_box({{"below", "above"}});
    EXPECT_NEAR(touching.skin_overlap, 0.25, 2e-3);
    EXPECT_NEAR(passing.overlap, 0.25, 0.02);
    EXPECT_LT(touching.overlap, 0.1); // their cores are held
}

/// The tube's skin, as a surface that moves by itself.
MovingSurface surface_of(const SkinnedMesh& skin) {
    return {
        .rest = skin.mesh, .clips = skin.clips, .positions = [skin](std::size_t clip, double t, std::span<Vec3f> out) {
            return clip_positions(skin, clip, t, out);
        }};
}

TEST(Flesh, ASurfaceWithoutJointsIsFollowedToo) {
    const SkinnedMesh tubes = tube(kCoarse, 0.5, waving(40, 2));
    SkinnedMesh skin = skin_of_surface(surface_of(tubes), 100).value();
    EXPECT_FALSE(skin.has_bones);
    EXPECT_EQ(check_skin(skin), "");
    std::vector<Eigen::Affine3d> transforms(skin.joints.size());
    std::vector<Vec3f> found(skin.mesh.vertex_count()), wanted(found.size());
    for (const double t : {0.0, 0.07, 0.125, 0.5}) { // patches carry the surface nearly as it goes
        skin.transforms(0, t, transforms);
        skin_positions(skin, transforms, found);
        ASSERT_TRUE(clip_positions(skin, 0, t, wanted).ok());
        double sum = 0;
        for (std::size_t v = 0; v < found.size(); ++v) sum += double((found[v] - wanted[v]).squaredNorm());
        EXPECT_LT(std::sqrt(sum / double(found.size())), t == 0 ? 1e-6 : 5e-3) << t;
    }
    FleshOptions options = kSmall;
    const Flesh flesh = Flesh::create(skin, options).value();
    EXPECT_GT(flesh.report().held, 5u);
    EXPECT_LT(flesh.report().held, flesh.body()->particle_count() / 2);
    const FleshClip clip = simulate_flesh(flesh, 0, kThirty).value();
    EXPECT_EQ(clip.clamped_particles, 0u);
    const FleshMeasure m = measure(flesh, clip);
    EXPECT_GT(m.furthest, 1e-3);
    EXPECT_LT(m.furthest, 0.15);
    options.soft = {{"Tail*"}};
    EXPECT_NE(Flesh::create(skin, options).error().message.find("without joints"), std::string::npos);
    MovingSurface lost = surface_of(tubes);
    lost.positions = [](std::size_t, double, std::span<Vec3f> out) -> Status {
        std::ranges::fill(out, Vec3f::Constant(std::numeric_limits<float>::infinity()));
        return Success{};
    };
    EXPECT_NE(skin_of_surface(std::move(lost), 100).error().message.find("not finite"), std::string::npos);
}

/// A flag encloses nothing.
TEST(Flesh, ASheetHasNoVolume) {
    const Mesh sheet = make_shape("wavy-plane", {.resolution = 16, .amplitude = 0}).value();
    MovingSurface surface{.rest = sheet, .clips = {{"waves", 0.2}}, .positions = {}};
    surface.positions = [&](std::size_t, double t, std::span<Vec3f> out) -> Status {
        for (std::size_t v = 0; v < out.size(); ++v)
            out[v] = sheet.positions[v] + Vec3f(0, 0, float(0.1 * math::sin(5 * double(sheet.positions[v].x()) + t)));
        return Success{};
    };
    const Flesh flesh = Flesh::create(skin_of_surface(std::move(surface), 40).value(), kSmall).value();
    const FleshMeasure m = measure_flesh(flesh, simulate_flesh(flesh, 0, kThirty).value(), 2).value();
    EXPECT_FALSE(m.is_closed);
    EXPECT_EQ(m.least_volume, 1);
    EXPECT_EQ(m.skin_most_volume, 1);
    EXPECT_EQ(m.overlap, 0);
    EXPECT_GT(m.furthest, 0);
}

/// A blink is finer than the particles: it lies on top of them, and turns with them.
TEST(Flesh, WhatASurfaceDoesBetweenParticlesLiesOnTop) {
    const Mesh rest = tube(kCoarse, 1, waving(0, 1)).mesh;
    const auto is_lid = [&](Index v) { return rest.positions[v].x() > 0.2f && rest.positions[v].x() < 0.3f; };
    const auto root = [](double t) { return Eigen::AngleAxisd(2 * t, Vec3d::UnitZ()).toRotationMatrix(); };
    MovingSurface surface{.rest = rest, .clips = {{"blinks", 0.5}}, .positions = {}};
    surface.positions = [=](std::size_t, double t, std::span<Vec3f> out) -> Status {
        for (Index v = 0; v < out.size(); ++v) {
            Vec3d p = rest.positions[v].cast<double>();
            if (is_lid(v)) p.x() += 0.1 * t;
            out[v] = (root(t) * p).cast<float>();
        }
        return Success{};
    };
    const Flesh flesh = Flesh::create(skin_of_surface(std::move(surface), 12).value(), kSmall).value();
    const FleshClip clip = simulate_flesh(flesh, 0, kThirty).value();
    std::vector<Index> all(rest.vertex_count());
    std::iota(all.begin(), all.end(), Index{0});
    FleshCarrier carrier = FleshCarrier::create(flesh, all).value();
    std::vector<Vec3f> first(all.size()), last(all.size());
    carrier.at(clip, 0, first, {});
    carrier.at(clip, clip.frames.size() - 1, last, {});
    double along = 0, count = 0;
    for (const Index v : all) {
        EXPECT_LT((first[v] - rest.positions[v]).norm(), 1e-4f);
        if (!is_lid(v)) continue;
        const Vec3d back = root(0.5).transpose() * last[v].cast<double>() - rest.positions[v].cast<double>();
        along += back.x();
        ++count;
    }
    ASSERT_GT(count, 8);
    EXPECT_NEAR(along / count, 0.05, 0.015);
}

/// Cells that the skin turns inside out at the start would fly apart.
TEST(Flesh, AFoldedStartIsSettled) {
    const auto folded = [](double) { return std::pair(radians(150), 0.0); };
    const Flesh flesh = Flesh::create(tube(kCoarse, 0.2, folded), kSmall).value();
    std::vector<Eigen::Affine3d> transforms(2);
    flesh.skin().transforms(0, 0, transforms);
    Vectors targets;
    flesh.targets(transforms, Vec3d::Zero(), targets, nullptr);
    const auto least = [&](const Vectors& at) {
        Simulation simulation =
            Simulation::create(
                {}, {{.body = flesh.body()}},
                {.mode = StepMode::explicit_steps, .contacts_within_bodies = false, .automatic_rigid = false})
                .value();
        EXPECT_TRUE(simulation.set_positions(0, at).ok());
        return simulation.inverted(0).least;
    };
    const Vectors settled = flesh.settled(targets);
    EXPECT_LT(least(targets), 0.2f);
    EXPECT_GT(least(settled), least(targets) + 0.1f);
    for (std::size_t i = 0; i < targets.size(); ++i)
        EXPECT_TRUE(!std::isinf(flesh.follow().frequency[i]) || settled[i] == targets[i]);
}

/// The rest shape grows with its joint; joints that vanish or are mirrored carry no flesh.
TEST(Flesh, MatterGrowsWithItsJoint) {
    const auto scaled = [](const Vec3d& by) {
        SkinnedMesh skin = tube(kCoarse, 0.5, waving(20, 2));
        const auto plain = skin.transforms;
        skin.transforms = [plain, by](std::size_t clip, double t, std::span<Eigen::Affine3d> out) {
            plain(clip, t, out);
            out[1] = out[1] * Eigen::Scaling(Vec3d(Vec3d::Ones() + (t / 0.5) * (by - Vec3d::Ones())));
        };
        return skin;
    };
    const Flesh plain = Flesh::create(scaled({1, 1, 1}), kSmall).value();
    EXPECT_TRUE(plain.report().scaled.empty());
    std::vector<Eigen::Affine3d> transforms(2);
    plain.skin().transforms(0, 0.5, transforms);
    EXPECT_TRUE(plain.stretches(transforms).empty());
    for (const Vec3d& by : {Vec3d(1.5, 1.5, 1.5), Vec3d(1, 1.4, 1.4), Vec3d(0.7, 0.7, 0.7), Vec3d(1.3, 0.9, 0.9)}) {
        const Flesh grown = Flesh::create(scaled(by), kSmall).value();
        EXPECT_EQ(grown.report().scaled, std::vector<std::string>{"lower"});
        EXPECT_EQ(grown.report().left_out_vertices, 0u);
        EXPECT_LT(grown.report().held, grown.body()->particle_count() / 2); // it is as soft as any
        grown.skin().transforms(0, 0.5, transforms);
        const std::vector<Mat3f> stretches = grown.stretches(transforms);
        ASSERT_EQ(stretches.size(), grown.body()->particle_count());
        for (std::size_t i = 0; i < stretches.size(); ++i) {
            const float x = grown.body()->rest[i].x();
            const Mat3f wanted = x < 0 ? Mat3f(Mat3f::Identity()) : Mat3f(by.cast<float>().asDiagonal());
            EXPECT_TRUE(std::abs(x) < 0.25f || (stretches[i] - wanted).norm() < 1e-3f) << x;
        }
        const FleshClip clip = simulate_flesh(grown, 0, kThirty).value();
        EXPECT_EQ(clip.clamped_particles, 0u);
        EXPECT_EQ(clip.unstable_substeps, 0u);
        EXPECT_GT(clip.least_volume_ratio, 0.5f); // beside the volume that it has grown to
        const FleshMeasure m = measure(grown, clip);
        EXPECT_LT(m.furthest, 0.1);
        // As large as the skin, which loses little in so small a bend.
        EXPECT_NEAR(m.most_volume, m.skin_most_volume, 0.03) << by.transpose();
        EXPECT_NEAR(m.least_volume, m.skin_least_volume, 0.03) << by.transpose();
    }
    for (const Vec3d& by : {Vec3d(1e-3, 1e-3, 1e-3), Vec3d(-1, 1, 1)}) {
        const Flesh cut = Flesh::create(scaled(by), kSmall).value();
        EXPECT_EQ(cut.report().left_out, std::vector<std::string>{"lower"});
        EXPECT_GT(cut.report().left_out_vertices, cut.skin().mesh.vertex_count() / 4);
        EXPECT_FALSE(cut.report().warnings.empty());
        EXPECT_EQ(simulate_flesh(cut, 0, kThirty).value().clamped_particles, 0u);
    }
}

/// One model follows all clips; clips of one name get numbers, and a loop ends with its first pose.
TEST(Flesh, AllClipsBecomeOneModel) {
    SkinnedMesh skin = tube(kCoarse, 0.5, waving(30, 2));
    skin.clips = {{"waves", 0.5}, {"waves", 0.25}};
    const Flesh flesh = Flesh::create(skin, kSmall).value();
    std::vector<FleshClip> clips;
    for (const std::size_t clip : {0u, 1u})
        clips.push_back(simulate_flesh(flesh, clip, {.frames_per_second = 30, .loop = clip == 0}).value());
    const FittedFlesh fitted = fit_flesh(flesh, clips, 60).value();
    EXPECT_EQ(fitted.names, (std::vector<std::string>{"waves", "waves 2"}));
    ASSERT_EQ(fitted.poses.size(), 2u);
    EXPECT_EQ(fitted.poses[0].frames.size(), clips[0].frames.size());
    EXPECT_EQ(fitted.poses[1].frames.size(), clips[1].frames.size());
    EXPECT_EQ(fitted.poses[0].frames.front().positions, fitted.poses[0].frames.back().positions);
    EXPECT_EQ(fitted.report.frames, clips[0].frames.size() + clips[1].frames.size());
    EXPECT_LT(fitted.report.rms, 5e-3);
    for (const PoseSequence& poses : fitted.poses) // viewers turn normals by the gradients
        for (const Pose& pose : poses.frames)
            for (const Mat3f& gradient : pose.gradients) EXPECT_GT(gradient.determinant(), 0.2f);
    EXPECT_EQ(fitted.animations()[1].name, "waves 2");
    EXPECT_EQ(fit_flesh(flesh, {}, 60).error().code, ErrorCode::usage);
    EXPECT_EQ(fit_flesh(flesh, clips, 3).error().code, ErrorCode::usage);
}

TEST(Flesh, LimbsThatACellGluesAreTold) {
    const auto limbs = [](float gap) {
        SkinnedMesh skin;
        skin.mesh = make_box({0, 0, 0}, {0.6, 0.2, 0.2});
        const Mesh other = make_box({0, 0.2 + double(gap), 0}, {0.6, 0.2, 0.2});
        const auto first = Index(skin.mesh.vertex_count());
        skin.mesh.positions.insert(skin.mesh.positions.end(), other.positions.begin(), other.positions.end());
        for (std::size_t f = 0; f < other.face_count(); ++f) {
            std::vector<Index> face(other.face(f).begin(), other.face(f).end());
            for (Index& v : face) v += first;
            skin.mesh.add_face(face);
        }
        skin.joints = {{.name = "one"}, {"a", 0}, {"b", 1}, {"c", 2}, {"two", 3}};
        for (Index v = 0; v < skin.mesh.vertex_count(); ++v) {
            skin.weights.joints.push_back(v < first ? 0 : 4);
            skin.weights.weights.push_back(1);
            skin.weights.first.push_back(v + 1);
        }
        skin.clips = {{"still", 1}};
        skin.transforms = [](std::size_t, double, std::span<Eigen::Affine3d> out) {
            std::ranges::fill(out, Eigen::Affine3d::Identity());
        };
        const std::vector<std::string> said = Flesh::create(skin, kSmall).value().report().warnings;
        return std::ranges::any_of(
            said, [](const std::string& sentence) { return sentence.starts_with("'one' and 'two' are closer"); });
    };
    EXPECT_TRUE(limbs(0.01f));
    EXPECT_FALSE(limbs(0.3f));
}

TEST(Flesh, TheSameBytesForAnyThreads) {
    const auto frames = [](unsigned threads) {
        const RunContext context(threads);
        const Flesh flesh = Flesh::create(tube(kCoarse, 0.2, waving(40, 2)), kSmall, {}, context).value();
        return simulate_flesh(flesh, 0, kThirty, context).value().frames;
    };
    const std::vector<Vectors> one = frames(1), two = frames(2);
    ASSERT_EQ(one.size(), two.size());
    for (std::size_t f = 0; f < one.size(); ++f)
        for (std::size_t i = 0; i < one[f].size(); ++i) ASSERT_EQ(one[f][i], two[f][i]);
}

TEST(Flesh, CarriesAnyVerticesWithGradients) {
    const Flesh flesh = Flesh::create(tube(kCoarse, 0.2, waving(40, 2)), kSmall).value();
    const FleshClip clip = simulate_flesh(flesh, 0, kThirty).value();
    const std::vector<Index> some = {0, 17, 5};
    std::vector<Vec3f> positions(3);
    std::vector<Mat3f> gradients(3);
    FleshCarrier carrier = FleshCarrier::create(flesh, some).value();
    carrier.at(clip, 0, positions, gradients);
    for (std::size_t k = 0; k < some.size(); ++k) {
        EXPECT_LT((positions[k] - flesh.skin().mesh.positions[some[k]]).norm(), 1e-4f);
        EXPECT_LT((gradients[k] - Mat3f::Identity()).norm(), 1e-2f);
    }
    EXPECT_FALSE(FleshCarrier::create(flesh, std::vector<Index>{1000000}).ok());
}

TEST(Flesh, RefusesWhatMakesNoSense) {
    const auto refused = [](FleshOptions options) {
        const Result<Flesh> made = Flesh::create(tube(kCoarse, 0.2, waving(40, 2)), options);
        return made.ok() ? std::string() : made.error().message;
    };
    FleshOptions options = kSmall;
    options.core = 1.5;
    EXPECT_NE(refused(options).find("core"), std::string::npos);
    options.core = 1;
    EXPECT_NE(refused(options).find("held"), std::string::npos);
    options = kSmall;
    options.soft = {{"Tail*"}};
    EXPECT_NE(refused(options).find("'upper', 'lower'"), std::string::npos);
    options = kSmall;
    options.leash = 0;
    EXPECT_NE(refused(options), "");
    options = kSmall;
    options.material.model = MaterialModel::springs;
    EXPECT_NE(refused(options), "");
    SkinnedMesh broken = tube(kCoarse, 0.2, waving(40, 2));
    broken.weights.weights[0] = 0.5f;
    EXPECT_FALSE(Flesh::create(broken, kSmall).ok());
    const Flesh flesh = Flesh::create(tube(kCoarse, 0.2, waving(40, 2)), kSmall).value();
    EXPECT_FALSE(simulate_flesh(flesh, 1).ok());
    EXPECT_FALSE(simulate_flesh(flesh, 0, {.frames_per_second = 0}).ok());
    const auto far = [](double t) { return Eigen::Affine3d(Eigen::Translation3d(Vec3d(0, 0, 5000 * t))); };
    const Flesh runs = Flesh::create(tube(kCoarse, 1, waving(40, 2), far), kSmall).value();
    EXPECT_NE(simulate_flesh(runs, 0).error().message.find("travels"), std::string::npos);
}

TEST(Flesh, UnitsAreGuessedByTheSize) {
    EXPECT_EQ(flesh_scale(1.7), 1);
    EXPECT_EQ(flesh_scale(0.12), 1);
    EXPECT_NEAR(flesh_scale(155), 0.01, 1e-12);
    EXPECT_NEAR(flesh_scale(1700), 0.001, 1e-12);
    EXPECT_NEAR(flesh_scale(0.017), 100, 1e-9);
    EXPECT_EQ(flesh_scale(0), 1);
}

} // namespace
} // namespace filigree
