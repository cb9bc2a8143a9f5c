// filigree fracture: pieces as one mesh or as files, and the report about them.
#include "apps/program.h"
#include "threads.h"

#include "filigree/io/animation/point_cache.h"
#include "filigree/io/model/model_file.h"

using namespace filigree;
using namespace filigree_test;

namespace {

class FractureCommand : public Program {
protected:
    /// In triangles: the volume of quads that are not flat depends on how they are cut.
    void make_cube() {
        ok({"make", "wavy-cube", "-o", "cube.stl", "--resolution", "16", "--quiet"});
        ok({"deform", "cube.stl", "-o", "cube.obj", "--stretch", "1.2", "--quiet"});
    }
    std::vector<std::vector<Vec3f>> frames_of(const std::string& cache, const Mesh& mesh) const {
        const MeshAnimation animation = open_animation(path(cache), mesh, {}, kAllThreads).value();
        std::vector<std::vector<Vec3f>> frames(animation.frames, std::vector<Vec3f>(mesh.vertex_count()));
        for (std::size_t f = 0; f < frames.size(); ++f) EXPECT_TRUE(animation.positions(f, frames[f]).ok());
        return frames;
    }
};

} // namespace

TEST_F(FractureCommand, ReportIsWhatInfoMeasures) {
    make_cube();
    const Json report = json({"fracture", "cube.obj", "-o", "broken.ply", "--pieces", "12"});
    EXPECT_EQ(report.at("pieces"), 12);
    EXPECT_EQ(report.at("open_edges"), 0);
    EXPECT_EQ(report.at("cone_facets"), 0);
    EXPECT_LT(report.at("volume_error"), 1e-9);
    const Json info = json({"info", "broken.ply"});
    EXPECT_EQ(info.at("faces"), report.at("faces"));
    EXPECT_EQ(info.at("vertices"), report.at("vertices"));
    EXPECT_NEAR(info.at("volume").get<double>() / report.at("volume").get<double>(), 1, 1e-6);
    EXPECT_EQ(report.at("warnings"), Json::array());
}

TEST_F(FractureCommand, ClumpsAndGrains) {
    make_cube();
    const Json clumps = json({"fracture", "cube.obj", "-o", "broken.ply", "--pieces", "6", "--clump", "5"});
    EXPECT_EQ(clumps.at("pieces"), 6);
    EXPECT_EQ(clumps.at("open_edges"), 0);
    EXPECT_LT(clumps.at("volume_error"), 1e-9);
    const Json grains = json({"fracture", "cube.obj", "-o", "broken.ply", "--pieces", "40", "--pattern", "grains"});
    const Json even = json({"fracture", "cube.obj", "-o", "broken.ply", "--pieces", "40"});
    EXPECT_LT(grains.at("smallest"), 0.7 * even.at("smallest").get<double>());
    EXPECT_GT(grains.at("largest"), even.at("largest").get<double>());
    fails(2, {"fracture", "cube.obj", "-o", "x.ply", "--clump", "0"}, {"--clump"});
}

TEST_F(FractureCommand, EveryPointThatWasHitCounts) {
    make_cube();
    const auto broken = [&](const std::vector<std::string>& at) {
        std::vector<std::string> words = {"fracture",  "cube.obj", "-o",       "x.ply",
                                          "--pattern", "impact",   "--pieces", "40"};
        words.insert(words.end(), at.begin(), at.end());
        ok(words);
        return bytes_of(path("x.ply"));
    };
    const std::string one = broken({"--at", "1,1,1"}), other = broken({"--at", "-1,-1,-1"});
    const std::string both = broken({"--at", "1,1,1", "--at", "-1,-1,-1"});
    EXPECT_NE(both, one);
    EXPECT_NE(both, other);
    EXPECT_EQ(both, broken({"--at", "1", "1", "1", "--at=-1,-1,-1"}));
    fails(2, {"fracture", "cube.obj", "-o", "x.ply", "--pattern", "impact", "--at", "1,1,1,1", "--at", "1,1,1"},
          {"--at takes a point X,Y,Z"});
}

TEST_F(FractureCommand, SentencesSayWhatToDoNext) {
    make_cube();
    fails(5, {"fracture", "cube.obj", "-o", "pieces"}, {"pieces:", "(pieces/) for a file a piece"});
    EXPECT_NE(ok({"fracture", "cube.obj", "-o", "x.ply"}).out.find("--explode 0.3"), std::string::npos);
    EXPECT_EQ(ok({"fracture", "cube.obj", "-o", "x.ply", "--explode", "0.2"}).out.find("--explode"), std::string::npos);
}

TEST_F(FractureCommand, ObjectsThatPiecesReplaceAreNoWarning) {
    make_cube();
    ASSERT_EQ(run_shell("sed '0,/^f /s//o cube\\nf /' cube.obj > named.obj").code, 0);
    EXPECT_EQ(json({"fracture", "named.obj", "-o", "broken.obj", "--pieces", "5"}).at("warnings"), Json::array());
    EXPECT_NE(ok({"fracture", "named.obj", "-o", "broken.obj", "--pieces", "5"}).out.find("replaced by the pieces"),
              std::string::npos);
}

TEST_F(FractureCommand, PiecesAreNamedInEveryFormat) {
    make_cube();
    for (const char* file : {"broken.obj", "broken.glb", "broken.ply", "broken.stl"})
        EXPECT_EQ(json({"fracture", "cube.obj", "-o", file, "--pieces", "5"}).at("warnings"), Json::array()) << file;
    const std::string obj = bytes_of(path("broken.obj"));
    for (int piece = 0; piece < 5; ++piece) {
        const std::string name = "piece_" + std::to_string(piece);
        EXPECT_NE(obj.find("\ng " + name + "\n"), std::string::npos);
        EXPECT_EQ(obj.find("\no " + name + "\n"), obj.rfind("\no " + name + "\n")); // each piece stands in one place
        EXPECT_NE(bytes_of(path("broken.glb")).find("\"" + name + "\""), std::string::npos);
    }
    EXPECT_NE(obj.find("usemtl inside"), std::string::npos);
    EXPECT_NE(bytes_of(path("broken.ply")).substr(0, 1000).find("piece"), std::string::npos);
}

TEST_F(FractureCommand, AFolderGetsAFileAPiece) {
    make_cube();
    const Json report = json({"fracture", "cube.obj", "-o", "pieces/", "--pieces", "4", "--roughness", "0"});
    ASSERT_EQ(report.at("files").size(), 4u);
    double volume = 0;
    for (const Json& file : report.at("files")) {
        const Json info = json({"info", file.get<std::string>()});
        EXPECT_EQ(info.at("closed"), true);
        EXPECT_EQ(info.at("manifold"), true);
        volume += info.at("volume").get<double>();
    }
    EXPECT_NEAR(volume / report.at("volume").get<double>(), 1, 1e-6);
}

TEST_F(FractureCommand, SeedsAndThreadsDecideAsTheyShould) {
    make_cube();
    const auto bytes = [&](const std::string& name, std::vector<std::string> options) {
        options.insert(options.begin(), {"fracture", "cube.obj", "-o", name, "--pieces", "6", "--quiet"});
        ok(options);
        return bytes_of(path(name));
    };
    const std::string first = bytes("a.ply", {"--threads", "1"});
    EXPECT_TRUE(bytes("b.ply", {"--threads", "2"}) == first);
    EXPECT_FALSE(bytes("c.ply", {"--seed", "2"}) == first);
}

TEST_F(FractureCommand, AFilmOfPiecesIsTheSameInACacheASkinAndMorphTargets) {
    write("fall.toml", "[simulation]\nframes = 24\n[[body]]\nshape = \"wavy-cube\"\nresolution = 16\n"
                       "material = \"soft-rubber\"\nsize = 0.3\nparticles = 400\ncentre = [0, 0.3, 0]\n"
                       "velocity = [0, -4, 0]\n[[fracture]]\npieces = 6\nstrength = 2e3\n"
                       "[[obstacle]]\nshape = \"ground\"\n");
    const Json report = json({"simulate", "fall.toml", "-o", "fall.fil", "-o", "fall.pc2"});
    EXPECT_GT(report.at("bodies").at(0).at("fracture").at("parts"), 1);
    const Mesh mesh = read_model(bytes_of(path("fall.fil")), "fall.fil", kAllThreads).value().mesh;
    ok({"export", "fall.fil", "-o", "skin.glb", "--full-precision", "--quiet"});
    ok({"export", "fall.fil", "-o", "morph.glb", "--as", "morph", "--quiet"});
    const std::vector<std::vector<Vec3f>> cache = frames_of("fall.pc2", mesh);
    ASSERT_EQ(cache.size(), 25u);
    const double diagonal = bounds(cache[0]).diagonal();
    for (const std::string name : {"skin", "morph"}) {
        ok({"export", name + ".glb", "-o", name + ".pc2", "--quiet"});
        const std::vector<std::vector<Vec3f>> other = frames_of(name + ".pc2", mesh);
        ASSERT_EQ(other.size(), cache.size());
        double worst = 0;
        for (std::size_t f = 0; f < cache.size(); ++f) {
            for (std::size_t v = 0; v < cache[f].size(); ++v)
                worst = std::max(worst, double((other[f][v] - cache[f][v]).norm()));
        }
        EXPECT_LT(worst / diagonal, 1e-5) << name;
    }
}

TEST_F(FractureCommand, RefusesWhatItCannotDo) {
    make_cube();
    fails(2, {"fracture", "cube.obj", "-o", "x.ply", "--pieces", "0"}, {"--pieces"});
    fails(2, {"fracture", "cube.obj", "-o", "x.ply", "--pattern", "straight"}, {"--pattern"});
    fails(2, {"fracture", "cube.obj", "-o", "x.ply", "--at", "1,2"}, {"--at"});
    fails(5, {"fracture", "cube.obj", "-o", "x.txt"}, {"x.txt"});
    fails(2, {"fracture", "cube.obj", "-o", "cube.obj"}, {"cube.obj"});
    write("points.obj", "v 0 0 0\nv 1 0 0\n");
    const Ran points = run({"fracture", "points.obj", "-o", "x.ply"});
    EXPECT_EQ(points.code, 7);
    EXPECT_NE(points.err.find("there is nothing to break"), std::string::npos);
    EXPECT_EQ(bytes_of(path("x.ply")), "");
}
