// Every mesh of the corpus that can be read can be drawn.
#include "cases.h"
#include "filigree/file.h"
#include "filigree/render.h"
#include "io/corpus.h"

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree_test;

TEST(CorpusRender, EveryMeshThatCanBeReadIsDrawn) {
    const std::vector<CorpusRow> corpus = read_corpus();
    if (corpus.empty()) GTEST_SKIP() << "no corpus";
    Result<HeadlessContext> gl = HeadlessContext::create();
    if (!gl) GTEST_SKIP() << gl.error().message;
    Result<Renderer> renderer = Renderer::create();
    ASSERT_TRUE(renderer.ok());
    const RunContext context;
    const std::uintmax_t most_bytes =
        all_cases() ? 20'000'000 : 400'000; // the large ones hold nothing that the small ones lack
    std::size_t drawn = 0;
    for (const CorpusRow& row : corpus) {
        std::error_code missing;
        if (std::filesystem::file_size(row.path, missing) > most_bytes || missing) continue;
        Result<MeshFile> file = read_mesh(row.path, context);
        if (!file || file->mesh.vertex_count() == 0) continue;
        SCOPED_TRACE(row.file);
        const Mesh& mesh = file->mesh;
        const bool has_faces = mesh.face_count() > 0;
        Result<Drawable> drawable = has_faces ? Drawable::surface(mesh, {}, context)
                                              : Drawable::points(mesh.positions, mesh.origin, {}, context);
        ASSERT_TRUE(drawable.ok()) << drawable.error().message;
        const CameraPoints points{mesh.positions, mesh.origin};
        // From two sides: a flat mesh may be seen along its plane.
        bool is_seen = false;
        for (const View view : {View::iso, View::front, View::top}) {
            const Camera camera =
                fit_camera(std::span(&points, 1), view_direction(view, UpAxis::y), up_vector(UpAxis::y), 4.0 / 3);
            Scene scene;
            scene.objects.push_back({&*drawable, {.edges = true}});
            scene.background.transparent = true;
            scene.ground = false;
            const Result<Picture> picture =
                renderer->picture(scene, camera, {.width = 64, .height = 48, .passes = 1}, context);
            ASSERT_TRUE(picture.ok()) << picture.error().message;
            for (std::size_t i = 3; i < picture->rgba.size(); i += 4) is_seen = is_seen || picture->rgba[i] > 0;
            if (is_seen) break;
        }
        double area = 0; // of all faces; without any there is nothing to see
        for (std::size_t f = 0; f < mesh.face_count(); ++f)
            for (std::size_t k = 1; k + 1 < mesh.face_size(f); ++k) {
                const auto at = [&](std::size_t corner) { return mesh.world_position(mesh.face(f)[corner]); };
                area += (at(k) - at(0)).cross(at(k + 1) - at(0)).norm();
            }
        const double diagonal = world_bounds(mesh).diagonal();
        const bool is_denormal = diagonal < 1e-36; // which GPUs take for zero
        EXPECT_TRUE(is_seen || is_denormal || (has_faces && !(area > 1e-6 * diagonal * diagonal)))
            << area << " " << diagonal;
        ++drawn;
    }
    EXPECT_GT(drawn, 50u);
}
