// The recording as GLB, PC2 and MDD.
#include "workbench_fixture.h"

#include "filigree/file.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/system/file.h"

#include <cmath>
#include <filesystem>

namespace filigree::studio {
namespace {

namespace fs = std::filesystem;

class Export : public WorkbenchTest {
protected:
    /// Where the restored mesh is in a recorded frame, relative to the origin.
    std::vector<Vec3f> restored(std::size_t frame) {
        return Restorer::create(*state().model, state().restore)->positions(*state().recording->frames[frame]).value();
    }
    double furthest(std::span<const Vec3f> a, std::span<const Vec3f> b) {
        EXPECT_EQ(a.size(), b.size());
        double most = 0;
        for (std::size_t v = 0; v < std::min(a.size(), b.size()); ++v)
            most = std::max(most, double((a[v] - b[v]).norm()));
        return most;
    }
    bool is_told(const std::string& words) { return !notes.empty() && notes.back().find(words) != std::string::npos; }
};

TEST_F(Export, CachesHoldTheRestoredMesh) {
    make_small_shape();
    simulate(3);
    for (const char* const name : {"a.pc2", "a.mdd"}) {
        bench.export_animation(path(name));
        bench.wait_until_idle();
        ASSERT_TRUE(errors.empty()) << errors[0];
        EXPECT_TRUE(is_told("Saved " + std::string(name))) << notes.back();
        EXPECT_TRUE(is_told("kB, in " + folder.path().toStdString())) << notes.back();
        const Mesh rest = level_mesh(*state().model, state().level());
        const Result<MeshAnimation> read = open_animation(path(name), rest);
        ASSERT_TRUE(read) << read.error().message;
        ASSERT_EQ(read->frames, bench.frame_count());
        std::vector<Vec3f> positions(rest.vertex_count());
        for (const std::size_t frame : {std::size_t{0}, read->frames - 1}) {
            ASSERT_TRUE(read->positions(frame, positions));
            EXPECT_LT(furthest(positions, restored(frame)), 1e-6) << name << " " << frame;
        }
    }
}

TEST_F(Export, AGlbPlaysWhatIsShownAndSaysItsError) {
    make_small_shape();
    simulate(8);
    bench.set_glb_settings({.keys = 0});
    bench.export_animation(path("a.glb"));
    bench.wait_until_idle();
    ASSERT_TRUE(errors.empty()) << errors[0];
    EXPECT_TRUE(is_told("joints")) << notes.back();
    EXPECT_TRUE(is_told("of the diagonal off at most at keys")) << notes.back();
    const GltfScene scene = GltfScene::read(path("a.glb"), RunContext()).value();
    ASSERT_EQ(scene.animations().size(), 1u);
    const std::size_t last = bench.frame_count() - 1;
    std::vector<Vec3f> positions(scene.mesh().vertex_count());
    ASSERT_TRUE(scene.positions(0, double(last) / 60, positions, RunContext()));
    Box played, expected; // its vertices are split at seams
    for (const Vec3f& p : positions) played.extend(p.cast<double>() + scene.mesh().origin);
    for (const Vec3f& p : restored(last)) expected.extend(p.cast<double>() + state().model->mesh.origin);
    EXPECT_LT((played.min - expected.min).norm() + (played.max - expected.max).norm(), 1e-4 * expected.diagonal());

    const auto whole = fs::file_size(path("a.glb"));
    bench.set_glb_settings({.keys = 10, .compress = true});
    bench.export_animation(path("b.glb"));
    bench.wait_until_idle();
    ASSERT_TRUE(errors.empty()) << errors[0];
    EXPECT_LT(double(fs::file_size(path("b.glb"))), 0.7 * double(whole));
}

TEST_F(Export, RefusalsLeaveNoFile) {
    make_small_shape();
    bench.export_animation(path("a.glb"));
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_EQ(offers.back(), "body.play");
    simulate(2);
    bench.export_animation(path("a.txt"));
    ASSERT_EQ(errors.size(), 2u);
    EXPECT_NE(errors[1].find("a.txt"), std::string::npos) << errors[1];
    bench.export_animation(path("a.pc2"));
    bench.jobs().cancel();
    bench.wait_until_idle();
    EXPECT_EQ(errors.size(), 2u);
    EXPECT_TRUE(fs::is_empty(folder.path().toStdString()));
}

} // namespace
} // namespace filigree::studio
