// Animations of other programs: opened, played, fitted, compared and saved.
#include "coloring.h"
#include "flesh/skinned_gltf.h"
#include "workbench_fixture.h"

#include "filigree/file.h"
#include "filigree/fit.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/system/file.h"
#include "filigree/skin.h"

#include <cmath>
#include <filesystem>

namespace filigree::studio {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFrames = 12;

/// A sheet, and where a wave through it has its vertices.
Mesh sheet() { return make_shape("wavy-plane", {.resolution = 24, .amplitude = 0}).value(); }

std::vector<Vec3f> waving(const Mesh& mesh, std::size_t frame) {
    std::vector<Vec3f> positions = mesh.positions;
    for (Vec3f& p : positions) p.z() += 0.1f * std::sin(5 * p.x() - 0.5f * float(frame));
    return positions;
}

MeshAnimation wave_of(const Mesh& mesh) {
    return {&mesh, kFrames, 24, [&mesh](std::size_t frame, std::span<Vec3f> out) -> Status {
                std::ranges::copy(waving(mesh, frame), out.begin());
                return Success{};
            }};
}

class Motion : public WorkbenchTest {
protected:
    Motion() {
        EXPECT_TRUE(write_mesh(mesh, path("sheet.ply")));
        EXPECT_TRUE(write_animation(wave_of(mesh), path("sheet.pc2")));
    }
    void open_cache() {
        bench.open(path("sheet.ply"));
        bench.wait_until_idle();
        bench.open(path("sheet.pc2"));
        bench.wait_until_idle();
        ASSERT_TRUE(errors.empty()) << errors[0];
    }
    void fit(double error) {
        FitSettings settings = bench.fit_settings();
        settings.error = error;
        bench.set_fit_settings(settings);
        bench.fit();
        bench.wait_until_idle();
        ASSERT_TRUE(errors.empty()) << errors[0];
        ASSERT_TRUE(state().recording->fitted);
    }

    Mesh mesh = sheet();
};

TEST_F(Motion, ACachePlaysOnTheMeshThatIsOpen) {
    open_cache();
    EXPECT_EQ(bench.frame_count(), kFrames);
    EXPECT_EQ(bench.mode(), Mode::body);
    EXPECT_EQ(offers.back(), "fit.make");
    bench.go_to_frame(5);
    ASSERT_TRUE(bench.shows_original());
    EXPECT_EQ(bench.melt_surface()->positions, waving(state().source->mesh, 5));
    EXPECT_TRUE(undo_stack().canUndo()); // the mesh was there before
    bench.save_mesh(path("frame.ply"));
    bench.wait_until_idle();
    EXPECT_EQ(read_mesh(path("frame.ply"))->mesh.positions, waving(state().source->mesh, 5));
    // What moves by itself leaves no poses.
    bench.export_animation(path("out.glb"));
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_EQ(offers.back(), "fit.make");
    bench.save_model(path("rest.fil"));
    bench.wait_until_idle();
    EXPECT_NE(notes.back().find("without the animation"), std::string::npos) << notes.back();
    EXPECT_TRUE(read_poses(path("rest.fil"))->empty());
}

TEST_F(Motion, AFitFollowsWithinTheErrorAndIsCompared) {
    open_cache();
    fit(1e-3);
    const FitReport& report = state().recording->fitted->report;
    EXPECT_LE(report.rms, 1e-3);
    EXPECT_EQ(state().model->driver().vertices.size(), report.driver_vertices);
    EXPECT_LE(state().recording->fitted->packed_rms, 1e-3);
    EXPECT_NE(notes.back().find("times smaller"), std::string::npos) << notes.back();

    // Every vertex is known in every frame: the error is that of the report.
    bench.want_full(true);
    double squares = 0;
    for (std::size_t frame = 0; frame < kFrames; ++frame) {
        bench.go_to_frame(frame);
        ASSERT_EQ(std::vector(bench.full().begin(), bench.full().end()), waving(state().source->mesh, frame));
        bench.measure_error();
        bench.wait_until_idle();
        ASSERT_TRUE(bench.error());
        squares += bench.error()->rms * bench.error()->rms / kFrames;
    }
    EXPECT_NEAR(std::sqrt(squares) / report.diagonal, report.rms, 0.02 * report.rms);

    // The original can be looked at in its place.
    bench.view().edit([](ViewSettings& view) { view.original = true; });
    EXPECT_TRUE(bench.melt_surface());
    bench.view().edit([](ViewSettings& view) { view.original = false; });
    EXPECT_FALSE(bench.melt_surface());

    // Another error fits again, and a step back is the fit before.
    const std::size_t coarse = report.driver_vertices;
    FitSettings settings = bench.fit_settings();
    settings.error = 2e-4;
    bench.set_fit_settings(settings);
    bench.wait_until_idle();
    EXPECT_GT(state().model->driver().vertices.size(), coarse);
    undo_stack().undo();
    EXPECT_EQ(state().model->driver().vertices.size(), coarse);
    bench.set_fit_settings({});
}

TEST_F(Motion, AFitLeavesAsAPackedModelAndAGlb) {
    open_cache();
    fit(1e-3);
    bench.save_packed(path("small.fil"));
    bench.export_animation(path("out.glb"));
    bench.wait_until_idle();
    ASSERT_TRUE(errors.empty()) << errors[0];
    EXPECT_TRUE(fs::exists(path("out.glb")));
    EXPECT_EQ(fs::file_size(path("small.fil")), state().recording->fitted->packed.size());
    const Model model = read_model(path("small.fil")).value();
    EXPECT_EQ(read_poses(path("small.fil"))->frames.size(), kFrames);
    EXPECT_EQ(model.vertex_count(), mesh.vertex_count());
}

TEST_F(Motion, AnAnimatedGlbSaysWhatItHolds) {
    const MeshAnimation wave = wave_of(mesh);
    ASSERT_TRUE(write_morph_glb(wave, {}, path("sheet.glb")));
    bench.open(path("sheet.glb"));
    bench.wait_until_idle();
    ASSERT_TRUE(errors.empty()) << errors[0];
    EXPECT_NE(notes.back().find("12 morph targets and 1 clip"), std::string::npos) << notes.back();
    EXPECT_EQ(offers.back(), "panel.fit");
    ASSERT_TRUE(bench.can_fit());
    // At the rate of the window, 11 intervals of 1/24 s.
    EXPECT_EQ(bench.frame_count(), std::size_t(std::lround(11.0 / 24 * 30)) + 1);
    bench.set_fit_settings({.frames_per_second = 24});
    bench.wait_until_idle();
    ASSERT_EQ(bench.frame_count(), kFrames);
    bench.go_to_frame(7);
    const Box shown = bounds(bench.melt_surface()->positions), expected = bounds(waving(mesh, 7));
    EXPECT_LT((shown.size() - expected.size()).norm(), 1e-4);
    bench.set_fit_settings({});
}

TEST_F(Motion, NumberedMeshesAreOneAnimation) {
    ASSERT_TRUE(write_animation(wave_of(mesh), path("frame_####.ply")));
    bench.open_motion(path("frame_0003.ply"));
    bench.wait_until_idle();
    ASSERT_TRUE(errors.empty()) << errors[0];
    EXPECT_EQ(bench.frame_count(), kFrames);
    bench.go_to_frame(4);
    EXPECT_EQ(bench.melt_surface()->positions, waving(mesh, 4));
    bench.open(path("frame_0003.ply")); // opened as a mesh it is one
    bench.wait_until_idle();
    EXPECT_EQ(bench.frame_count(), 0u);
}

TEST_F(Motion, WhatDoesNotMoveTheMeshIsRefused) {
    const State before = state();
    bench.open(path("sheet.pc2")); // the document's mesh is a cube
    bench.wait_until_idle();
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_NE(errors[0].find("sheet.pc2"), std::string::npos) << errors[0];
    EXPECT_NE(errors[0].find("Open the mesh"), std::string::npos) << errors[0];
    bench.open_motion(path("sheet.ply"));
    bench.wait_until_idle();
    ASSERT_EQ(errors.size(), 2u);
    EXPECT_NE(errors[1].find("no animation"), std::string::npos) << errors[1];
    bench.fit();
    EXPECT_EQ(errors.size(), 3u);
    EXPECT_TRUE(state() == before);
    // A fit that is called off leaves all as it was.
    bench.open(path("sheet.ply"));
    bench.wait_until_idle();
    bench.open(path("sheet.pc2"));
    bench.wait_until_idle();
    const State moving = state();
    bench.fit();
    bench.jobs().cancel();
    bench.wait_until_idle();
    EXPECT_TRUE(state() == moving);
}

TEST_F(Motion, ASkinBecomesFleshBesideItself) {
    ASSERT_TRUE(write_file(path("tube.gltf"), filigree_test::skinned_tube()));
    bench.open(path("tube.gltf"));
    bench.wait_until_idle();
    ASSERT_TRUE(errors.empty()) << errors[0];
    EXPECT_NE(notes.back().find("Flesh makes it soft"), std::string::npos) << notes.back();
    ASSERT_TRUE(bench.can_make_flesh());
    EXPECT_EQ(state().recording->original->joints, (std::vector<std::string>{"upper", "lower"}));
    FleshSettings settings;
    settings.particles = 300;
    settings.joints = 40;
    settings.soft = {"lower"};
    bench.set_flesh_settings(settings);
    bench.make_flesh();
    bench.wait_until_idle();
    ASSERT_TRUE(errors.empty()) << errors[0];
    ASSERT_TRUE(state().recording->fitted && state().recording->fitted->flesh);
    const FleshedMotion& flesh = *state().recording->fitted->flesh;
    EXPECT_TRUE(flesh.is_sound);
    EXPECT_GT(flesh.measure.furthest, 0);
    EXPECT_FALSE(bench.can_fit()) << "its original is the skin";
    EXPECT_EQ(bench.frame_count(), state().recording->original->frames.size());
    // The original is plain skinning, and the distance from it is what colours show.
    const SkinnedMesh skin = read_skin(path("tube.gltf")).value();
    std::vector<Eigen::Affine3d> transforms(skin.joints.size());
    std::vector<Vec3f> skinned(skin.mesh.vertex_count());
    const std::size_t last = bench.frame_count() - 1;
    skin.transforms(0, double(last) / bench.frames_per_second(), transforms);
    skin_positions(skin, transforms, skinned);
    EXPECT_EQ(state().recording->original->frames[last], skinned);
    bench.go_to_frame(last);
    bench.measure_error();
    bench.wait_until_idle();
    ASSERT_TRUE(bench.error());
    EXPECT_GT(bench.error()->max, 0);
    // All clips that move are there, and leave together.
    bench.export_animation(path("soft.glb"));
    bench.wait_until_idle();
    EXPECT_TRUE(errors.empty()) << errors[0];
    const GltfScene soft = GltfScene::read(path("soft.glb"), RunContext()).value();
    ASSERT_EQ(soft.animations().size(), 2u);
    EXPECT_EQ(soft.animations()[1].name, "Wave");
    bench.show_clip(2);
    EXPECT_EQ(state().recording->original->clip, 2u);
    EXPECT_TRUE(state().recording->fitted->flesh);
    EXPECT_EQ(bench.frame_count(), state().recording->original->frames.size());
    const PoseSequence& waves = state().recording->clips->fitted.poses[1];
    EXPECT_EQ(state().recording->frames.back()->positions, waves.frames.back().positions);
    EXPECT_TRUE(errors.empty());
    bench.show_clip(1); // a single pose
    EXPECT_EQ(state().recording->original->clip, 2u);
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_NE(errors[0].find("'Still' is a single pose"), std::string::npos) << errors[0];
    errors.clear();
    undo_stack().undo();
    EXPECT_EQ(state().recording->original->clip, 0u);
    undo_stack().undo();
    EXPECT_TRUE(bench.can_fit());
    settings.soft = {"tail"};
    bench.set_flesh_settings(settings);
    bench.make_flesh();
    bench.wait_until_idle();
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_NE(errors[0].find("tail"), std::string::npos) << errors[0];
    bench.set_flesh_settings({});
}

} // namespace
} // namespace filigree::studio
