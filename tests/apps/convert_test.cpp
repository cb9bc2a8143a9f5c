// filigree convert, as a user runs it: meshes and motions from format to format.
#include "apps/program.h"

#include "filigree/file.h"
#include "filigree/mesh.h"

using namespace filigree_test;
using namespace filigree;

namespace {

class Convert : public Program {
protected:
    void SetUp() override {
        ok({"make", "bar", "-o", "bar.obj", "--resolution", "4"});
        ok({"strip", "bar.obj", "-o", "bar.fil", "--base", "40"});
        write("drop.toml", "[simulation]\nframes = 3\n[[body]]\nmesh = \"bar.fil\"\nparticles = 60\n"
                           "centre = [0, 1, 0]\nvelocity = [1, 0, 0]\n");
        ok({"simulate", "drop.toml", "-o", "moving.fil"});
    }
    Mesh mesh(const std::string& name) const { return read_mesh(path(name)).value().mesh; }
    void refused(const std::vector<std::string>& words, int code, const std::string& needle) const {
        std::vector<std::string> all = {"convert"};
        all.insert(all.end(), words.begin(), words.end());
        const Ran ran = run(all);
        EXPECT_EQ(ran.code, code) << ran.err;
        EXPECT_NE(ran.err.find(needle), std::string::npos) << ran.err;
    }
};

} // namespace

TEST_F(Convert, TakesAMeshFromFormatToFormat) {
    for (const std::string name : {"a.ply", "a.off", "a.glb", "a.stl"}) {
        ok({"convert", "bar.obj", name});
        EXPECT_EQ(mesh(name).face_count() > 0, true) << name;
    }
    EXPECT_EQ(mesh("a.ply").positions, mesh("bar.obj").positions);
    ok({"convert", "bar.fil", "b.ply"});
    EXPECT_EQ(mesh("b.ply").vertex_count(), mesh("bar.obj").vertex_count());
}

/// Through four formats and back: the same places in the last frame.
TEST_F(Convert, KeepsAMotion) {
    ok({"convert", "moving.fil", "a.pc2"});
    ok({"convert", "a.pc2", "b.mdd", "--mesh", "bar.obj"});
    ok({"convert", "b.mdd", "c.glb", "--mesh", "bar.obj"});
    ok({"convert", "b.mdd", "d_####.ply", "--mesh", "bar.obj"});
    ok({"convert", "d_####.ply", "e.pc2"});
    EXPECT_EQ(bytes_of(path("e.pc2")), bytes_of(path("a.pc2")));
    ok({"convert", "moving.fil", "last.ply", "--frame", "4"});
    ok({"convert", "e.pc2", "also.ply", "--frame", "4", "--mesh", "bar.obj"});
    const Mesh last = mesh("last.ply"), also = mesh("also.ply"), rest = mesh("bar.obj");
    ASSERT_EQ(last.vertex_count(), also.vertex_count());
    for (std::size_t v = 0; v < last.vertex_count(); ++v)
        EXPECT_LT((last.positions[v] - also.positions[v]).norm(), 1e-5);
    EXPECT_GT((last.positions[0] - rest.positions[0]).norm(), 0.5);
}

TEST_F(Convert, SaysWhatIsLeftOutAndRefusesWhatMakesNoSense) {
    const Ran ran = run({"convert", "moving.fil", "rest.obj"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_NE(ran.err.find("--frame N writes another frame"), std::string::npos) << ran.err;
    refused({"bar.obj", "x.pc2"}, 7, "does not move");
    refused({"bar.obj", "x.fil"}, 5, "'filigree strip' makes a model");
    refused({"bar.obj", "x.ply", "--frame", "2"}, 2, "does not");
    refused({"moving.fil", "x.ply", "--frame", "9"}, 2, "has the frames 1 to 4");
    ok({"convert", "moving.fil", "a.pc2"});
    refused({"a.pc2", "x.glb"}, 2, "--mesh FILE");
    refused({"bar.obj", "bar.obj"}, 2, "bar.obj");
}
