// The driver that a body gets by default, what is said of another, and the errors that follow from both.
#include "filigree/scene/body_driver.h"

#include "filigree/io/model_file.h"
#include "filigree/scene/finer_check.h"
#include "scene/scenes.h"
#include "threads.h"

#include <cmath>

namespace filigree {
namespace {

Body body_of(const Mesh& mesh, std::size_t particles, MaterialModel model = MaterialModel::fem, double scale = 1) {
    Material material;
    material.model = model;
    BodyOptions options;
    options.scale = scale;
    options.cells.count = particles;
    return make_body(mesh, material, options, kOneThread).value();
}

Model stripped(const Mesh& mesh, const StripOptions& options) { return strip(mesh, options, kOneThread).value().model; }

TEST(BodyDriver, EdgesAreAboutASpacingAlsoOnFlatParts) {
    for (const std::string_view shape : {"bar", "wavy-cube", "torus"})
        for (const MaterialModel model : {MaterialModel::fem, MaterialModel::meshfree}) {
            SCOPED_TRACE(shape);
            const Mesh mesh = *make_shape(shape, {.resolution = 72});
            const Body body = body_of(mesh, 1500, model, 0.3);
            const Model ours = stripped(mesh, body_driver_options(mesh, body));
            const DriverEdges edges = measure_driver(ours, body);
            EXPECT_GT(edges.mean, 0.7);
            EXPECT_LT(edges.mean, 1.1);
            EXPECT_LE(edges.longest, kLongestDriverEdge);
            EXPECT_EQ(edges.on_long_edges, 0);
            EXPECT_FALSE(coarse_driver(edges, ours, body));
            EXPECT_GT(ours.mesh.vertex_count(), 4 * ours.driver().vertices.size());
            EXPECT_NEAR(edges.carried, 1 - double(ours.driver().vertices.size()) / double(ours.mesh.vertex_count()),
                        1e-12);
        }
}

TEST(BodyDriver, ASmallMeshIsAllDriver) {
    const Mesh mesh = *make_shape("bar", {.resolution = 8});
    const Body body = body_of(mesh, 2000);
    const Model model = stripped(mesh, body_driver_options(mesh, body));
    EXPECT_EQ(model.driver().vertices.size(), mesh.vertex_count());
    EXPECT_EQ(measure_driver(model, body).carried, 0);
}

TEST(BodyDriver, ACoarseOneIsToldWithWhatWouldDo) {
    const Mesh mesh = *make_shape("wavy-cube", {.resolution = 48});
    const Body body = body_of(mesh, 3000);
    const Model coarse = stripped(mesh, {.base = 150});
    const std::optional<CoarseDriver> told = coarse_driver(measure_driver(coarse, body), coarse, body);
    ASSERT_TRUE(told);
    EXPECT_GT(told->longest, kLongestDriverEdge);
    const std::string sentence = told->sentence();
    EXPECT_NE(sentence.find("% of the mesh hangs on driver triangles longer than 1.5 spacings"), std::string::npos);
    EXPECT_EQ(sentence.find("base"), std::string::npos) << "each program has its own words for that";
    const Model fine = stripped(mesh, {.base = told->base, .max_edge = told->max_edge});
    EXPECT_FALSE(coarse_driver(measure_driver(fine, body), fine, body));
}

TEST(BodyDriver, NothingIsExpectedOfAffineMotionAndMoreOfCoarserDrivers) {
    const Mesh mesh = *make_shape("bar", {.resolution = 24});
    const Body body = body_of(mesh, 2000, MaterialModel::fem, 0.5);
    const auto expected = [&](const Model& model, double bend) {
        PoseSequence poses{60, {}};
        for (int frame = 0; frame < 3; ++frame) {
            Pose& pose = poses.frames.emplace_back();
            pose.positions = driver_positions(model);
            for (const Vec3f& p : pose.positions) { // turned about z, the more the further along x
                const auto angle = float(bend * double(p.x()) + 0.3);
                pose.gradients.emplace_back(0.5f * Eigen::AngleAxisf(angle, Vec3f::UnitZ()).toRotationMatrix());
            }
        }
        return expected_error(poses, measure_driver(model, body), model, body);
    };
    const Model fine = stripped(mesh, {.base = 2000, .max_edge = 0.05}), coarse = stripped(mesh, {.base = 300});
    EXPECT_LT(expected(fine, 0).spacing, 1e-6);
    const ExpectedError of_fine = expected(fine, 0.5), of_coarse = expected(coarse, 0.5);
    EXPECT_GT(of_fine.spacing, 1e-5);
    EXPECT_NEAR(expected(fine, 1).spacing, 2 * of_fine.spacing, 0.05 * of_fine.spacing);
    EXPECT_NEAR(of_coarse.spacing, of_fine.spacing, 0.5 * of_fine.spacing); // it is the same motion
    EXPECT_GT(of_coarse.driver, 2 * of_fine.driver);
    EXPECT_EQ(expected_error({60, {}}, {}, fine, body).spacing, 0);
}

/// Scenes with what bodies get by default; frames enough to hit the ground, or to swing once.
constexpr const char* kFalls =
    "[simulation]\nframes = 24\n[[body]]\nname = \"cube\"\nshape = \"wavy-cube\"\nresolution = 40\nparticles = 1000\n"
    "young_modulus = 2e5\ncentre = [0, 0.75, 0]\nrotate = { axis = [1, 0, -1], degrees = 25 }\nvelocity = [0, -3, 0]\n"
    "[[obstacle]]\nshape = \"ground\"\n";
constexpr const char* kSags =
    "[simulation]\nframes = 20\n[[body]]\nshape = \"bar\"\nsize = 0.2\nlength = 5\nresolution = 24\nparticles = 800\n"
    "young_modulus = 1e6\npoisson_ratio = 0.3\n[[pin]]\nbox = { min = [-0.6, -1, -1], max = [-0.45, 1, 1] }\n";
constexpr const char* kPressed =
    "[simulation]\nframes = 24\n[[body]]\nshape = \"wavy-cube\"\nsize = 0.4\namplitude = 0.02\nresolution = 32\n"
    "material = \"clay\"\nparticles = 600\ncentre = [0, 0.21, 0]\n[[obstacle]]\nshape = \"ground\"\n[[obstacle]]\n"
    "shape = \"box\"\ncentre = [0, 0.46, 0]\nsize = [0.9, 0.08, 0.9]\nmove = [{ time = 0, value = [0, 0, 0] }, "
    "{ time = 0.4, value = [0, -0.1, 0] }]\n";

class BodyDriverScene : public filigree_test::Scenes {};

TEST_F(BodyDriverScene, AModelsOwnDriverIsJudged) {
    const auto warnings = [&](const StripOptions& options) {
        const auto path = std::filesystem::path(write("")).parent_path() / "cube.fil";
        EXPECT_TRUE(write_model(stripped(*make_shape("wavy-cube", {.resolution = 40}), options), path, kOneThread));
        return set_up(scene("[[body]]\nmesh = \"cube.fil\"\nparticles = 2000\n"), kOneThread).value().warnings;
    };
    EXPECT_TRUE(warnings({.base = 1600, .max_edge = 0.05}).empty());
    const std::vector<std::string> coarse = warnings({.base = 100});
    ASSERT_EQ(coarse.size(), 1U);
    EXPECT_TRUE(coarse[0].starts_with("body 'cube': ")) << coarse[0];
    EXPECT_NE(coarse[0].find("cannot follow the particles"), std::string::npos) << coarse[0];
}

struct TrueCase {
    const char* scene;
    double most_rms, most_normals, most_worst; ///< of the restored mesh from every vertex attached
    double most_ratio;                         ///< of the restored mesh's distance from the truth to the attached one's
};

class BodyTruth : public filigree_test::Scenes, public testing::WithParamInterface<TrueCase> {};

TEST_P(BodyTruth, RestoredIsAsNearToItAsEveryVertexAttached) {
    const SceneFile file = scene(GetParam().scene);
    const ReadyScene ready = set_up(file, kOneThread).value();
    const ReadyBody& body = ready.bodies[0];
    EXPECT_GT(body.driver.carried, 0.7);
    SceneRun run = SceneRun::create(file, ready, true, kOneThread).value();
    ASSERT_TRUE(run.advance_to(file.frames, kOneThread));
    const CheckTotals& check = run.recording().checks[0];
    const double mean = check.rms_sum / double(file.frames);
    EXPECT_LT(mean, GetParam().most_rms);
    EXPECT_LT(check.p95_sum / double(file.frames), GetParam().most_normals);
    EXPECT_LT(check.worst_max, GetParam().most_worst);

    const FinerCheck finer = check_against_finer(file, ready, file.frames, 6, kOneThread).value()[0];
    EXPECT_GT(finer.particles, 5 * body.body->particle_count());
    EXPECT_LE(finer.restored.rms, GetParam().most_ratio * finer.attached.rms);
    EXPECT_GT(finer.attached.rms, 0);
    const ExpectedError expected = expected_error(run.recording().poses[0], body.driver, body.model, *body.body);
    EXPECT_LT(std::abs(std::log(expected.driver / mean)), std::log(2.5)) << expected.driver << ' ' << mean;
    EXPECT_LT(std::abs(std::log(expected.spacing / finer.attached.rms)), std::log(6))
        << expected.spacing << ' ' << finer.attached.rms;
}

// A bar of whole cells is carried all but exactly, to 1e-4 of the diagonal, and simplification chamfers its corners by
// half an edge: there the restored mesh is a third further off.
void PrintTo(const TrueCase&, std::ostream*) {} // else its bytes, which are other ones in every run

INSTANTIATE_TEST_SUITE_P(Scenes, BodyTruth,
                         testing::Values(TrueCase{kFalls, 4e-4, 3, 8e-3, 1.1}, TrueCase{kSags, 4e-4, 3, 8e-3, 1.4},
                                         TrueCase{kPressed, 1e-3, 5, 2e-2, 1.1}),
                         [](const auto& test) {
                             return std::string(std::array{"Falls", "Sags", "Pressed"}[test.index]);
                         });

} // namespace
} // namespace filigree
