// What surfels cover of a surface that melts.
#include "cases.h"

#include "filigree/scene/melting_surface.h"
#include "filigree/scene/scene_run.h"
#include "render/rendered.h"
#include "render/surfel_coverage.h"

#include <filesystem>
#include <fstream>

using namespace filigree_test;

namespace {

constexpr const char* kScene = R"([simulation]
frames = 40
frames_per_second = 30
[world]
air_temperature = 310
air_heat_transfer = 60
heat_pace = 4000
[[body]]
shape = "wavy-cube"
size = 0.2
amplitude = 0.02
resolution = 32
material = "ice"
viscosity = 0.5
particles = 1500
centre = [0, 0.121, 0]
[[obstacle]]
shape = "ground"
temperature = 300
heat_transfer = 200
)";

} // namespace

TEST(MeltingSurfels, CoverOldFadingAndNewParts) {
    const std::string path = testing::TempDir() + "melting_surfels.toml";
    std::ofstream(path) << kScene;
    const SceneFile scene = read_scene(path).value();
    const ReadyScene ready = set_up(scene, kOneThread).value();
    SceneRun run = SceneRun::create(scene, ready, false, kOneThread).value();
    ASSERT_TRUE(run.advance_to(scene.frames, kOneThread).ok());
    MeltingSurface melting = MeltingSurface::create(ready, kOneThread).value();
    std::size_t new_vertices = 0;
    for (std::size_t frame = 0; frame <= scene.frames; frame += all_cases() ? 10 : 20) {
        const CompositeSurface surface = melting.frame(run.recording(), frame, kOneThread).value();
        const Surfels surfels = melting.surfels(surface, run.recording(), frame, kOneThread).value();
        for (const View view : {View::front, View::top, View::iso})
            EXPECT_LT(open_share(surface.mesh, surfels, camera_on(surface.mesh, view), 640, 480), 1e-3) << frame;
        new_vertices += std::size_t(std::count(surface.origin.begin(), surface.origin.end(), kNoIndex));
    }
    EXPECT_GT(new_vertices, 100u); // it did melt
    std::filesystem::remove(path);
}
