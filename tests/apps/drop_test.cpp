// filigree drop, as a user runs it: a mesh and no scene.
#include "apps/program.h"

#include "filigree/scene.h"

using namespace filigree_test;
using namespace filigree;

namespace {

class Drop : public Program {
protected:
    void SetUp() override {
        ok({"make", "wavy-cube", "-o", "cube.ply", "--resolution", "8", "--amplitude", "0", "--size", "20"});
    }
    /// The lowest point of the body at its start, along an axis, and the obstacles' number.
    static double start_height(const SceneFile& scene, const Mesh& mesh, int axis) {
        const SceneBody& body = scene.bodies[0];
        const Box box = bounds(mesh);
        const double scale = *body.body.size / box.size().maxCoeff();
        double lowest = 1e9;
        for (const Vec3f& p : mesh.positions)
            lowest =
                std::min(lowest, (*body.centre + body.rotation * (scale * (p.cast<double>() - box.centre())))[axis]);
        return lowest;
    }
};

} // namespace

TEST_F(Drop, WritesAModelThatFellAndTheSceneOfIt) {
    ok({"drop", "cube.ply", "-o", "fell.fil", "--scene", "fell.toml", "--material", "soft-rubber", "--size", "0.4",
        "--height", "0.1", "--tilt", "30", "--particles", "100", "--duration", "0.1"});
    EXPECT_TRUE(std::filesystem::exists(path("fell.fil")));
    const SceneFile scene = read_scene(path("fell.toml")).value();
    const Mesh mesh = read_mesh(path("cube.ply")).value().mesh;
    EXPECT_NEAR(start_height(scene, mesh, 1), 0.1, 1e-5);
    ASSERT_EQ(scene.obstacles.size(), 1u);
    EXPECT_EQ(scene.bodies[0].material_name, "soft-rubber");
    ok({"simulate", "fell.toml", "-o", "again.fil"});
    EXPECT_EQ(bytes_of(path("again.fil")), bytes_of(path("fell.fil")));
}

TEST_F(Drop, PutsObstaclesUnderTheBodyWhateverIsUp) {
    const Mesh mesh = read_mesh(path("cube.ply")).value().mesh;
    for (const std::string obstacle : {"ball", "step", "slope"})
        for (const auto& [up, axis] : {std::pair<std::string, int>{"x", 0}, {"y", 1}, {"z", 2}}) {
            ok({"drop", "cube.ply", "--scene", "s.toml", "--obstacle", obstacle, "--up", up, "--size", "2"});
            const SceneFile scene = read_scene(path("s.toml")).value();
            ASSERT_EQ(scene.obstacles.size(), 2u);
            EXPECT_GT(start_height(scene, mesh, axis), 1) << obstacle << up; // half of the size above it
            EXPECT_LT(scene.world.gravity[axis], -9);
            EXPECT_NEAR(scene.world.gravity.norm(), 9.81, 1e-6);
        }
}

TEST_F(Drop, NamesTheMeshFromTheFolderOfTheScene) {
    std::filesystem::create_directory(path("scenes"));
    ok({"drop", "cube.ply", "--scene", "scenes/s.toml", "--material", "glass"});
    const SceneFile scene = read_scene(path("scenes/s.toml")).value();
    EXPECT_EQ(std::filesystem::weakly_canonical(scene.bodies[0].mesh), std::filesystem::canonical(path("cube.ply")));
    EXPECT_EQ(scene.fractures.size(), 1u);
}

TEST_F(Drop, RefusesInOneSentence) {
    const auto refused = [&](const std::vector<std::string>& words, int code, const std::string& needle) {
        std::vector<std::string> all = {"drop", "cube.ply"};
        all.insert(all.end(), words.begin(), words.end());
        const Ran ran = run(all);
        EXPECT_EQ(ran.code, code) << ran.err;
        EXPECT_NE(ran.err.find(needle), std::string::npos) << ran.err;
        EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
    };
    refused({}, 2, "Say where the motion goes");
    refused({"-o", "x.fil", "--material", "ruber"}, 2, "there is no material 'ruber'");
    refused({"-o", "x.fil", "--material", "wax", "--pieces", "3"}, 7, "does not break");
    refused({"-o", "x.txt"}, 5, "is no name for a simulation's output");
    refused({"-o", "cube.ply"}, 5, "is no name for a simulation's output");
    EXPECT_EQ(files(), std::vector<std::string>{"cube.ply"});
}
