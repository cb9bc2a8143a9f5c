// The command line, driven as a user drives it. The corpus goes through in corpus_restore_test.cpp.
#include "apps/program.h"
#include "io/corpus.h"

#include <algorithm>
#include <clocale>
#include <cmath>
#include <functional>
#include <locale.h>

using namespace filigree_test;

namespace {

const std::vector<std::string> kCommands = {"make",   "info",   "strip",    "level",   "deform", "restore",  "compare",
                                            "bench",  "demo",   "render",   "figures", "sample", "simulate", "sweep",
                                            "remesh", "export", "fracture", "pack",    "unpack"};

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

/// The lines of an OBJ without the numbers that a pose changes; colours behind a position stay.
std::string without_positions_and_normals(const std::string& obj) {
    std::string kept;
    for (const std::string& line : lines_of(obj)) {
        std::istringstream words(line);
        std::string word, rest;
        words >> word;
        if (word == "v" || word == "vn") {
            std::string number;
            words >> number >> number >> number;
            std::getline(words, rest);
            kept += word + rest + "\n";
        } else
            kept += line + "\n";
    }
    return kept;
}

/// An OBJ of quads without attributes as a text PLY whose vertices have the scalars f00 .. f22, all zero.
std::string ply_with_zero_gradients(const std::string& obj) {
    std::string vertices, faces;
    std::size_t vertex_count = 0, face_count = 0;
    for (const std::string& line : lines_of(obj)) {
        std::istringstream words(line);
        std::string word;
        if (words >> word && word == "v") {
            vertices += line.substr(2) + " 0 0 0 0 0 0 0 0 0\n";
            ++vertex_count;
        } else if (word == "f") {
            faces += "4";
            for (std::size_t v; words >> v;) faces += " " + std::to_string(v - 1);
            faces += "\n";
            ++face_count;
        }
    }
    std::string header = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertex_count) + "\n";
    for (const char* name : {"x", "y", "z", "f00", "f01", "f02", "f10", "f11", "f12", "f20", "f21", "f22"})
        header += std::string("property float ") + name + "\n";
    header += "element face " + std::to_string(face_count) + "\nproperty list uchar int vertex_indices\nend_header\n";
    return header + vertices + faces;
}

using Map = std::function<std::array<double, 3>(double, double, double)>;

/// An OBJ with every position mapped.
std::string mapped(const std::string& obj, const Map& map) {
    std::ostringstream out;
    out.precision(9);
    for (const std::string& line : lines_of(obj)) {
        std::istringstream words(line);
        std::string word;
        double x = 0, y = 0, z = 0;
        if (words >> word >> x >> y >> z && word == "v") {
            const auto [a, b, c] = map(x, y, z);
            out << "v " << a << ' ' << b << ' ' << c << '\n';
        } else
            out << line << '\n';
    }
    return out.str();
}

/// A wavy sheet of quads with everything an OBJ can carry.
std::string decorated_sheet() {
    constexpr int n = 16;
    std::ostringstream obj;
    obj << "mtllib paint.mtl\n";
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i)
            obj << "v " << i << ' ' << j << ' ' << 0.3 * std::sin(i + 0.7 * j) << ' ' << i / 16.0 << ' ' << j / 16.0
                << " 0.5\n";
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) obj << "vt " << i / 16.0 << ' ' << j / 16.0 << '\n';
    obj << "vn 0 0 1\nvn 0 1 0\no sheet\n"; // shared by all corners of a half
    for (int j = 0; j < n; ++j) {
        if (j == 0) obj << "g near\nusemtl red\ns 1\n";
        if (j == n / 2) obj << "g far\nusemtl blue\ns off\n";
        for (int i = 0; i < n; ++i) {
            obj << 'f';
            for (const int v : {j * (n + 1) + i, j * (n + 1) + i + 1, (j + 1) * (n + 1) + i + 1, (j + 1) * (n + 1) + i})
                obj << ' ' << v + 1 << '/' << v + 1 << '/' << (j < n / 2 ? 1 : 2);
            obj << '\n';
        }
    }
    return obj.str();
}

} // namespace

class Cli : public Program {
protected:
    /// A wavy cube of 6 n^2 + 2 vertices and its models; 1,538 vertices make every test quick.
    void make_cube(int resolution = 16) const {
        ok({"make", "wavy-cube", "-o", "cube.obj", "--resolution", std::to_string(resolution), "--frequency", "2"});
    }
    void make_model(const std::vector<std::string>& options = {}) const {
        make_cube();
        std::vector<std::string> words = {"strip", "cube.obj", "-o", "cube.fil"};
        words.insert(words.end(), options.begin(), options.end());
        ok(words);
        ok({"level", "cube.fil", "0", "-o", "driver.obj"});
    }
    double rms(const std::string& a, const std::string& b) const {
        return json({"compare", a, b, "--samples", "100"}).at("rms").get<double>();
    }
    double largest(const std::string& a, const std::string& b) const {
        return json({"compare", a, b, "--samples", "100"}).at("max").get<double>();
    }
};

TEST_F(Cli, EveryCommandHasHelpWithExamples) {
    EXPECT_NE(ok({"--help"}).out.find("Exit codes"), std::string::npos);
    EXPECT_TRUE(ok({"--version"}).out.starts_with("filigree "));
    for (const std::string& command : kCommands) {
        const std::string help = ok({command, "--help"}).out;
        EXPECT_NE(help.find("Examples:\n  filigree " + command), std::string::npos) << command;
        for (const char* option : {"--json", "--threads", "--quiet"})
            EXPECT_NE(help.find(option), std::string::npos) << command;
        EXPECT_NE(ok({"--help"}).out.find("\n  " + command), std::string::npos) << command;
        EXPECT_EQ(help.find("{false}"), std::string::npos) << command;
    }
}

TEST_F(Cli, InfoSaysWhatIsWrongAndWhere) {
    write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\n");
    const Json info = json({"info", "open.obj"});
    EXPECT_EQ(info.at("vertices"), 4);
    EXPECT_EQ(info.at("faces"), 1);
    EXPECT_EQ(info.at("components"), 1);
    EXPECT_EQ(info.at("closed"), false);
    EXPECT_EQ(info.at("manifold"), true);
    EXPECT_EQ(info.at("defects").at("open_edges").at("count"), 3);
    EXPECT_EQ(info.at("defects").at("unused_vertices").at("places"), Json::parse("[[3]]"));
    EXPECT_NE(ok({"info", "open.obj"}).out.find("open edges"), std::string::npos);

    make_model();
    EXPECT_EQ(json({"info", "cube.obj"}).at("euler"), 2);
    const Json model = json({"info", "cube.fil"});
    EXPECT_EQ(model.at("kind"), "model");
    EXPECT_EQ(model.at("bytes"), std::filesystem::file_size(path("cube.fil")));
    EXPECT_EQ(model.at("levels").back().at("vertices"), 1538);
}

TEST_F(Cli, StripSaysWhereAFidelityIsBelowRounding) {
    ok({"make", "bar", "-o", "bar.ply", "--resolution", "4", "--quiet"});
    const Json said = json({"strip", "bar.ply", "-o", "bar.fil", "--fidelity", "1e-10"});
    EXPECT_GT(said.at("fidelity").at("error").get<double>(), 1e-10);
    EXPECT_NE(said.at("warnings").dump().find("rounding"), std::string::npos);
}

TEST_F(Cli, WhatDoesNotFitInMemoryLiesBesideTheOutput) {
    ok({"make", "wavy-cube", "-o", "cube.ply", "--resolution", "256", "--quiet"});
    const Json whole = json({"strip", "cube.ply", "-o", "whole.fil"});
    const Json spilled = json({"strip", "cube.ply", "-o", "spilled.fil", "--memory", "10M"});
    if (!kSanitized) { // which keep memory to themselves
        EXPECT_GT(spilled.at("spilled_bytes").get<double>(), 1 << 24);
    }
    EXPECT_EQ(whole.at("spilled_bytes"), 0);
    EXPECT_EQ(bytes_of(path("whole.fil")), bytes_of(path("spilled.fil")));
    EXPECT_EQ(files().size(), 3u); // no file is left behind

    for (const char* size : {"8Q", "", "-3G", "0", "nan", "1e300G"})
        fails(2, {"strip", "cube.ply", "-o", "no.fil", std::string("--memory=") + size}, {"--memory"});
    const Ran full = run_shell("ulimit -f 20000; exec \"$0\" \"$@\"",
                               {"strip", "cube.ply", "-o", "no.fil", "--memory", "10M"}); // as a full disk is
    EXPECT_EQ(full.code, kSanitized ? 6 : 9) << full.err; // 6: the output itself is too large
    EXPECT_EQ(files().size(), 3u);
}

/// A cage's vertices are none of the mesh's: whatever is written has those of the mesh, and compares with it.
TEST_F(Cli, ADriverMadeElsewhereAddsNoVertices) {
    ok({"make", "wavy-sphere", "-o", "ball.ply", "--resolution", "24"});
    ok({"make", "wavy-sphere", "-o", "cage.obj", "--resolution", "8", "--amplitude", "0"});
    const auto vertices = [&](const std::string& file) { return json({"info", file})["vertices"]; };
    const Json count = vertices("ball.ply");
    const Json stripped = json({"strip", "ball.ply", "-o", "m.fil", "--driver", "cage.obj"});
    EXPECT_EQ(stripped["vertices"], count);
    EXPECT_EQ(json({"info", "m.fil"})["levels"].back()["vertices"], count);
    ok({"level", "m.fil", "1", "-o", "finest.ply"});
    ok({"restore", "m.fil", "--pose", "cage.obj", "-o", "back.obj"});
    ok({"deform", "m.fil", "-o", "bent.ply", "--bend", "40"});
    ok({"deform", "ball.ply", "-o", "truth.ply", "--bend", "40"});
    for (const char* file : {"finest.ply", "back.obj", "bent.ply"}) EXPECT_EQ(vertices(file), count) << file;
    EXPECT_LT(json({"compare", "ball.ply", "back.obj"})["rms"].get<double>(), 1e-3);
    EXPECT_LT(json({"compare", "truth.ply", "bent.ply"})["rms"].get<double>(), 1e-2);

    ok({"deform", "m.fil", "-o", "moving.pc2", "--bend", "40", "--frames", "3"});
    ok({"deform", "m.fil", "-o", "moving.glb", "--bend", "40", "--frames", "3"});
    EXPECT_EQ(std::filesystem::file_size(path("moving.pc2")), 32 + 3 * 12 * count.get<std::size_t>());
    EXPECT_EQ(vertices("moving.glb"), count);
    ok({"pack", "m.fil", "-o", "packed.fil", "--keep-order"});
    ok({"restore", "packed.fil", "--pose", "cage.obj", "-o", "packed.ply"});
    EXPECT_EQ(vertices("packed.ply"), count);
}

TEST_F(Cli, ReorderedVerticesAreWrittenInTheirOldOrder) {
    ok({"make", "wavy-sphere", "-o", "sphere.ply", "--resolution", "32", "--quiet"});
    ok({"strip", "sphere.ply", "-o", "sphere.fil", "--reorder", "--quiet"});
    ok({"level", "sphere.fil", "0", "-o", "driver.ply", "--quiet"});
    ok({"restore", "sphere.fil", "--pose", "driver.ply", "-o", "old.ply", "--input-order", "--quiet"});
    ok({"restore", "sphere.fil", "--pose", "driver.ply", "-o", "new.ply", "--quiet"});
    EXPECT_LT(json({"compare", "old.ply", "sphere.ply"}).at("max").get<double>(), 1e-6);
    EXPECT_GT(json({"compare", "new.ply", "sphere.ply"}).at("max").get<double>(), 0.1);
    fails(2, {"restore", "sphere.fil", "--pose", "driver.ply", "-o", "x.ply", "--input-order", "--level", "0"},
          {"--input-order"});
    fails(2, {"strip", "sphere.ply", "-o", "x.fil", "--reorder", "--code", "reference"}, {"reorder"});
}

TEST_F(Cli, InfoSaysWhatADriverIsGoodFor) {
    ok({"make", "wavy-sphere", "-o", "sphere.ply", "--resolution", "32", "--quiet"});
    double coarser = 1;
    for (const char* base : {"100", "400"}) {
        ok({"strip", "sphere.ply", "-o", "sphere.fil", "--base", base, "--quiet"});
        const Json fidelity = json({"info", "sphere.fil"}).at("fidelity");
        EXPECT_LT(fidelity.at("positions").get<double>(), coarser);
        EXPECT_GT(fidelity.at("positions").get<double>(), fidelity.at("gradients").get<double>());
        EXPECT_GT(fidelity.at("gradients").get<double>(), 1e-7);
        coarser = fidelity.at("positions");
    }
    EXPECT_NE(ok({"info", "sphere.fil"}).out.find("from positions"), std::string::npos);
    fails(2, {"info", "sphere.ply", "--fidelity"}, {"--fidelity", "models"});

    ok({"make", "wavy-cube", "-o", "cube.obj", "--resolution", "16", "--quiet"});
    ok({"strip", "cube.obj", "-o", "reference.fil", "--code", "reference", "--quiet"});
    EXPECT_FALSE(json({"info", "reference.fil"}).contains("fidelity"));
}

TEST_F(Cli, JsonKeysAreWordsInSnakeCase) {
    make_model();
    const std::function<void(const Json&)> check = [&](const Json& value) {
        if (value.is_object()) {
            for (const auto& [key, inner] : value.items())
                EXPECT_EQ(key.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_"), std::string::npos) << key;
        }
        if (!value.is_structured()) return;
        for (const Json& inner : value) check(inner);
    };
    for (const std::vector<std::string>& arguments :
         std::vector<std::vector<std::string>>{{"make", "bar", "-o", "bar.ply"},
                                               {"info", "cube.obj"},
                                               {"info", "cube.fil"},
                                               {"strip", "cube.obj", "-o", "again.fil"},
                                               {"level", "cube.fil", "0", "-o", "level.ply"},
                                               {"deform", "cube.fil", "-o", "bent.ply", "--bend", "30"},
                                               {"restore", "cube.fil", "--pose", "driver.obj", "-o", "restored.ply"},
                                               {"compare", "cube.obj", "cube.obj"}}) {
        SCOPED_TRACE(testing::PrintToString(arguments));
        const Json object = json(arguments);
        ASSERT_TRUE(object.is_object());
        EXPECT_TRUE(object.at("warnings").is_array());
        check(object);
    }
}

TEST_F(Cli, CompareGivesFractionsOfTheSecondDiagonalAndUnits) {
    write("a.obj", "v 0 0 0\nv 3 0 0\nv 0 4 0\nf 1 2 3\n");
    write("b.obj", "v 0 0 1\nv 3 0 1\nv 0 4 1\nf 1 2 3\n");
    const Json distance = json({"compare", "a.obj", "b.obj"});
    EXPECT_EQ(distance.at("diagonal_units"), 5.0);
    for (const std::string key : {"rms", "max", "hausdorff", "mean_distance"}) {
        EXPECT_NEAR(distance.at(key).get<double>(), 0.2, 1e-6) << key;
        EXPECT_NEAR(distance.at(key + "_units").get<double>(), 1, 1e-6) << key;
    }
    EXPECT_EQ(distance.at("normal_mean_deg"), 0);
    EXPECT_EQ(distance.at("normal_p95_deg"), 0);
}

TEST_F(Cli, UsageIsTwo) {
    make_cube();
    fails(2, {}, {"--help"});
    fails(2, {"bogus"}, {"bogus", "--help"});
    fails(2, {"strip", "cube.obj"}, {"--output", "filigree strip --help"});
    fails(2, {"make", "pyramid", "-o", "x.ply"}, {"pyramid", "wavy-cube"});
    fails(2, {"make", "bar", "-o", "x.ply", "--resolution", "0"}, {"resolution"});
    for (const char* base : {"2", "-5", "1.5", "many", ""})
        fails(2, {"strip", "cube.obj", "-o", "x.fil", std::string("--base=") + base}, {"--base"});
    for (const char* error : {"0", "-1", "nan", "inf", "0,1"})
        fails(2, {"strip", "cube.obj", "-o", "x.fil", "--error", error}, {"--error"});
    fails(2, {"strip", "cube.obj", "-o", "x.fil", "--base", "50", "--levels", "2"}, {"--base", "--levels"});
    fails(2, {"strip", "cube.obj", "-o", "x.fil", "--code", "magic"}, {"blend", "reference"});
    fails(2, {"strip", "cube.obj", "-o", "cube.obj"}, {"cube.obj", "overwritten"});
    fails(2, {"strip", "cube.obj", "-o", "other.obj"}, {"other.obj", "other.fil"});
    fails(2, {"deform", "cube.obj", "-o", "x.ply"}, {"--bend"});
    fails(2, {"deform", "cube.obj", "-o", "x.ply", "--bend", "nan"}, {"--bend"});
    fails(2, {"deform", "cube.obj", "-o", "x.ply", "--taper", "0"}, {"--taper"});
    fails(2, {"deform", "cube.obj", "-o", "x.ply", "--bend", "9", "--pose", "p.ply"}, {"--pose"});
    make_model();
    fails(2, {"level", "cube.fil", "99", "-o", "x.ply"}, {"cube.fil", "99"});
    fails(2, {"restore", "cube.fil", "--pose", "driver.obj", "-o", "x.ply", "--level", "99"}, {"99"});
    fails(2, {"restore", "cube.fil", "--pose", "driver.obj", "-o", "x.ply", "--law", "murphy"}, {"murphy", "keep"});
    for (const std::string& name : files()) EXPECT_FALSE(name.starts_with("x.")) << name;
}

TEST_F(Cli, FilesThatCannotBeReadOrWritten) {
    make_model();
    fails(3, {"info", "missing.obj"}, {"missing.obj"});
    fails(3, {"info", "."}, {"folder"});
    write("damaged.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    fails(4, {"info", "damaged.obj"}, {"damaged.obj"});
    write("short.fil", bytes_of(path("cube.fil")).substr(0, 1000));
    fails(4, {"info", "short.fil"}, {"short.fil"});
    fails(4, {"restore", "cube.obj", "--pose", "driver.obj", "-o", "x.ply"}, {"cube.obj", "filigree strip"});
    fails(4, {"strip", "cube.fil", "-o", "x.fil"}, {"cube.fil", "filigree level"});
    write("scene.xyz", "hello\n");
    fails(5, {"info", "scene.xyz"}, {"scene.xyz", ".obj"});
    fails(5, {"make", "bar", "-o", "x.xyz"}, {"x.xyz", ".obj"});
    fails(6, {"make", "bar", "-o", "no/such/folder.ply"}, {"no/such/folder.ply"});
    fails(6, {"strip", "cube.obj", "-o", "no/such/folder.fil"}, {"no/such/folder.fil"});
    fails(6, {"demo", "cube.obj", "-o", "cube.obj/out"}, {"cube.obj/out"});
    EXPECT_EQ(run_shell("\"$0\" info cube.obj > /dev/full").code, 6);
}

TEST_F(Cli, InputsThatDoNotFit) {
    make_model();
    ok({"deform", "driver.obj", "-o", "triangles.obj", "--stretch", "1"});
    fails(7, {"strip", "triangles.obj", "-o", "x.fil", "--code", "reference"}, {"blend"});
    write("empty.obj", "# nothing\n");
    EXPECT_NE(run({"strip", "empty.obj", "-o", "x.fil"}).code, 0);
    fails(7, {"deform", "cube.obj", "-o", "x.ply", "--stretch", "1e39"}, {"x.ply"});
    fails(8, {"restore", "cube.fil", "--pose", "cube.obj", "-o", "x.ply"}, {"1538", "filigree level"});
    for (const std::string& name : files()) EXPECT_FALSE(name.starts_with("x.")) << name;
}

TEST_F(Cli, InterruptLeavesNothing) {
    make_cube(256);
    const std::vector<std::string> demo = {"demo", "-o", "out"};
    const std::vector<std::string> strip = {"strip", "cube.obj", "-o", "x.fil", "--base", "200"};
    const double whole = run(strip).seconds;
    std::filesystem::remove(path("x.fil"));
    const auto before = files();
    for (const auto& [arguments, signal] :
         {std::pair{demo, SIGINT}, std::pair{strip, SIGINT}, std::pair{strip, SIGTERM}, std::pair{strip, SIGHUP}}) {
        const Ran ran = run(arguments, "/dev/null", 0.25, signal);
        SCOPED_TRACE(testing::PrintToString(arguments));
        EXPECT_EQ(ran.code, 130);
        EXPECT_LT(ran.seconds, 0.25 + std::max(3.0, whole)); // a second on an idle machine, of 2.5 for the whole
        EXPECT_EQ(ran.err, "filigree: Cancelled; nothing was written.\n");
        EXPECT_EQ(files().size(), before.size());
    }
}

TEST_F(Cli, InterruptEndsWaitingForInput) {
    ASSERT_EQ(run_shell("mkfifo pipe").code, 0);
    const int writer = ::open(path("pipe").c_str(), O_RDWR); // holds it open, writes nothing
    const Ran standard_input = run({"info", "-"}, path("pipe"), 0.3);
    const Ran pipe = run({"info", "pipe"}, "/dev/null", 0.3);
    ::close(writer);
    for (const Ran& ran : {standard_input, pipe}) {
        EXPECT_EQ(ran.code, 130);
        EXPECT_LT(ran.seconds, 2);
    }
}

TEST_F(Cli, SecondOutputsAreWholeOrNeitherIs) {
    make_model();
    for (const char* place : {"-", "x.ply"}) {
        fails(2, {"deform", "cube.fil", "-o", place, "--bend", "9", "--pose", place}, {"--pose", "-o"});
    }
    fails(2, {"deform", "cube.fil", "-o", "x.ply", "--bend", "9", "--pose", "x.obj", "--level", "99"}, {"99"});
    for (const std::string& name : files()) EXPECT_FALSE(name.starts_with("x.")) << name;
}

TEST_F(Cli, ScalarsOfTheMeshAreNoGradients) {
    // A mesh that holds f00 .. f22 of its own, all zero: restored with these every bump would be flat.
    make_cube();
    write("own.ply", ply_with_zero_gradients(bytes_of(path("cube.obj"))));
    ok({"strip", "own.ply", "-o", "own.fil"});
    ok({"level", "own.fil", "0", "-o", "driver.ply"});
    ok({"restore", "own.fil", "--pose", "driver.ply", "-o", "restored.ply"});
    EXPECT_LE(largest("restored.ply", "own.ply"), 1e-6);
    ok({"deform", "own.fil", "-o", "bent.ply", "--bend", "60", "--pose", "pose.ply"});
    ok({"restore", "own.fil", "--pose", "pose.ply", "-o", "again.ply"});
    EXPECT_EQ(bytes_of(path("again.ply")), bytes_of(path("bent.ply")));
}

TEST_F(Cli, PipelinesCarryMeshesAndModelsUnmixed) {
    make_model();
    const Ran piped = run_shell("\"$0\" make wavy-cube -o - --resolution 16 --frequency 2 | \"$0\" strip - -o - | "
                                "tee piped.fil | \"$0\" level - 0 -o - > driver.ply && "
                                "\"$0\" restore piped.fil --pose - -o - --json < driver.ply > restored.ply");
    EXPECT_EQ(piped.code, 0) << piped.err;
    ok({"make", "wavy-cube", "-o", "cube.ply", "--resolution", "16", "--frequency", "2"});
    EXPECT_LE(largest("restored.ply", "cube.ply"), 1e-6);
    ok({"strip", "cube.ply", "-o", "direct.fil"});
    EXPECT_EQ(bytes_of(path("piped.fil")), bytes_of(path("direct.fil")));
    EXPECT_EQ(run_shell("\"$0\" make wavy-cube -o - --resolution 100 | head -c 3").out, "ply");
}

TEST_F(Cli, UnmovedDriverGivesTheMeshBack) {
    const std::vector<std::vector<std::string>> ways = {{}, {"--base", "100"}, {"--levels", "2"}, {"--error", "0.01"}};
    for (const auto& way : ways) {
        SCOPED_TRACE(testing::PrintToString(way));
        make_model(way);
        ok({"restore", "cube.fil", "--pose", "driver.obj", "-o", "restored.obj"});
        EXPECT_LE(largest("restored.obj", "cube.obj"), 1e-6);
        EXPECT_EQ(without_positions_and_normals(bytes_of(path("restored.obj"))),
                  without_positions_and_normals(bytes_of(path("cube.obj"))));
    }
    for (const char* references : {"3", "4", "6"}) {
        make_model({"--code", "reference", "--references", references});
        ok({"restore", "cube.fil", "--pose", "driver.obj", "-o", "restored.obj"});
        EXPECT_LE(largest("restored.obj", "cube.obj"), 2e-7) << references;
    }
    EXPECT_EQ(json({"strip", "cube.obj", "-o", "x.fil", "--base", "100"}).at("driver_vertices"), 100);
    EXPECT_EQ(json({"strip", "cube.obj", "-o", "x.fil", "--levels", "2"}).at("levels").size(), 2u);
}

TEST_F(Cli, AttributesComeBack) {
    write("sheet.obj", decorated_sheet());
    ok({"deform", "sheet.obj", "-o", "as_read.obj", "--stretch", "1"});
    ok({"strip", "sheet.obj", "-o", "sheet.fil"});
    ok({"level", "sheet.fil", "0", "-o", "driver.ply"});
    ok({"restore", "sheet.fil", "--pose", "driver.ply", "-o", "restored.obj"});
    const std::string kept = without_positions_and_normals(bytes_of(path("restored.obj")));
    EXPECT_EQ(kept, without_positions_and_normals(bytes_of(path("as_read.obj"))));
    for (const char* word : {"mtllib paint.mtl", "g near", "g far", "usemtl red", "usemtl blue", "vt ", "o sheet"})
        EXPECT_NE(kept.find(word), std::string::npos) << word;
    EXPECT_LE(largest("restored.obj", "sheet.obj"), 1e-6);
}

TEST_F(Cli, DeformedDriverComesCloseToDeformingEveryVertex) {
    const auto koala = corpus_folder() / "good/koala_100k.obj";
    if (!std::filesystem::exists(koala)) GTEST_SKIP() << "no corpus at " << corpus_folder();
    ok({"strip", koala.string(), "-o", "koala.fil"});
    const std::vector<std::string> warp = {"--bend", "60", "--twist", "45"};
    const auto deform = [&](std::vector<std::string> words) {
        words.insert(words.end(), warp.begin(), warp.end());
        ok(words);
    };
    deform({"deform", koala.string(), "-o", "full.ply"});
    deform({"deform", "koala.fil", "-o", "restored.ply", "--pose", "pose.ply"});
    const Json difference = json({"compare", "restored.ply", "full.ply"});
    EXPECT_LT(difference.at("rms").get<double>(), 2e-5);           // measured 3.1e-6
    EXPECT_LT(difference.at("max").get<double>(), 2e-4);           // measured 4.2e-5
    EXPECT_LT(difference.at("normal_p95_deg").get<double>(), 0.1); // measured 0.024
    ok({"restore", "koala.fil", "--pose", "pose.ply", "-o", "again.ply"});
    EXPECT_EQ(bytes_of(path("again.ply")), bytes_of(path("restored.ply")));
}

TEST_F(Cli, WarpsApplyInTheOrderGiven) {
    make_model();
    ok({"deform", "cube.obj", "-o", "a.obj", "--bend", "60", "--stretch", "2", "--axis", "x"});
    ok({"deform", "cube.obj", "-o", "b.obj", "--stretch", "2", "--bend", "60", "--axis", "x"});
    EXPECT_GT(rms("a.obj", "b.obj"), 1e-3);
    ok({"deform", "cube.fil", "-o", "stretched.obj", "--squeeze", "0.5"});
    ok({"deform", "cube.obj", "-o", "full.obj", "--squeeze", "0.5"});
    EXPECT_LE(largest("stretched.obj", "full.obj"), 1e-6); // affine: exact
}

TEST_F(Cli, FidelityIsAskedForAndErrorsAreExpected) {
    ok({"make", "wavy-sphere", "-o", "sphere.ply", "--resolution", "48"});
    const Json found = json({"strip", "sphere.ply", "-o", "sphere.fil", "--fidelity", "1e-4"}).at("fidelity");
    EXPECT_LE(found.at("error").get<double>(), 1e-4);
    EXPECT_EQ(found.at("asked"), 1e-4);
    EXPECT_EQ(found.at("from"), "positions");
    ok({"deform", "sphere.ply", "-o", "full.ply", "--bend", "150"});
    ok({"deform", "sphere.fil", "-o", "bent.ply", "--bend", "150", "--pose", "pose.obj"});
    const Json fine = json({"restore", "sphere.fil", "--pose", "pose.obj", "-o", "fine.ply"});
    EXPECT_LT(fine.at("expected_error").get<double>(), 2e-4);
    EXPECT_GT(fine.at("expected_error").get<double>(), rms("fine.ply", "full.ply") / 2);
    EXPECT_TRUE(fine.at("warnings").empty());

    ok({"strip", "sphere.ply", "-o", "coarse.fil", "--base", "20"});
    const Json bent = json({"deform", "coarse.fil", "-o", "bent.ply", "--bend", "150", "--pose", "pose.obj"});
    const Json coarse = json({"restore", "coarse.fil", "--pose", "pose.obj", "-o", "coarse.ply"});
    ASSERT_EQ(coarse.at("warnings").size(), 1u);
    EXPECT_NE(coarse.at("warnings")[0].get<std::string>().find("more curved than the driver can follow"),
              std::string::npos);
    ASSERT_EQ(bent.at("warnings").size(), 2u); // OBJ holds no gradients; by them the mesh was less far off
    EXPECT_EQ(bent.at("warnings")[1].get<std::string>().substr(0, 24), "The pose is more curved ");
    EXPECT_LT(bent.at("expected_error").get<double>(), coarse.at("expected_error").get<double>());
    EXPECT_GT(bent.at("expected_error").get<double>(), 1e-3);

    EXPECT_EQ(run({"strip", "sphere.ply", "-o", "x.fil", "--fidelity", "1e-4", "--base", "50"}).code, 2);
    EXPECT_EQ(run({"strip", "sphere.ply", "-o", "x.fil", "--fidelity-from", "gradients"}).code, 2);
}

TEST_F(Cli, TheReferenceCodeHasLaws) {
    const Map twice = [](double x, double y, double z) { return std::array{2 * x, 2 * y, 2 * z}; };
    make_model({"--code", "reference"});
    for (const char* name : {"cube", "driver"})
        write(std::string("moved_") + name + ".obj", mapped(bytes_of(path(std::string(name) + ".obj")), twice));
    for (const std::string law : {"keep", "inverse", "proportional", "volume"})
        ok({"restore", "cube.fil", "--pose", "moved_driver.obj", "-o", law + ".obj", "--law", law});
    EXPECT_LT(rms("proportional.obj", "moved_cube.obj"), 1e-6);
    EXPECT_GT(rms("keep.obj", "moved_cube.obj"), 1e-4);
    EXPECT_GT(rms("inverse.obj", "moved_cube.obj"), rms("keep.obj", "moved_cube.obj"));
    ok({"restore", "cube.fil", "--pose", "moved_driver.obj", "-o", "default.obj"});
    EXPECT_EQ(bytes_of(path("default.obj")), bytes_of(path("inverse.obj")));

    ok({"deform", "cube.fil", "-o", "longer.obj", "--stretch", "2", "--axis", "x", "--pose", "longer_driver.obj"});
    ok({"restore", "cube.fil", "--pose", "longer_driver.obj", "-o", "again.obj"});
    EXPECT_LT(rms("again.obj", "longer.obj"), 1e-6); // OBJ rounds the driver's positions
    ok({"restore", "cube.fil", "--pose", "longer_driver.obj", "-o", "coarse.obj", "--level", "1"});
    EXPECT_EQ(json({"info", "coarse.obj"}).at("vertices"), json({"info", "cube.fil"}).at("levels")[1].at("vertices"));
}

TEST_F(Cli, WhatIsOfOneCodeIsRefusedWithTheOther) {
    make_model({"--code", "reference"});
    ok({"strip", "cube.obj", "-o", "blend.fil"});
    fails(2, {"restore", "blend.fil", "--pose", "driver.obj", "-o", "x.ply", "--law", "keep"}, {"--law", "blend"});
    fails(2, {"deform", "blend.fil", "-o", "x.ply", "--bend", "9", "--law", "keep"}, {"--law", "blend"});
    fails(7, {"restore", "cube.fil", "--pose", "driver.obj", "-o", "x.ply", "--surfels"}, {"--surfels"});
    fails(7, {"deform", "cube.fil", "-o", "x.fil", "--bend", "9", "--frames", "5"}, {"reference code", ".fil"});
    fails(7, {"export", "cube.fil", "-o", "x.glb"}, {"cube.fil", "reference code"});
    fails(7, {"pack", "cube.fil", "-o", "x.fil"}, {"cube.fil", "reference code"});
    for (const std::vector<std::string>& option : {std::vector<std::string>{"--error", "0.1"}, {"--max-edge", "0.1"}}) {
        std::vector<std::string> strip = {"strip", "cube.obj", "-o", "x.fil", "--code", "reference"};
        strip.insert(strip.end(), option.begin(), option.end());
        fails(2, strip, {option[0]});
    }
    for (const std::string& name : files()) EXPECT_FALSE(name.starts_with("x.")) << name;
}

TEST_F(Cli, IntermediateLevels) {
    make_model({"--levels", "3"});
    ok({"restore", "cube.fil", "--pose", "driver.obj", "-o", "one.obj", "--level", "1"});
    ok({"level", "cube.fil", "1", "-o", "level.obj"});
    EXPECT_LE(largest("one.obj", "level.obj"), 1e-6);
    ok({"level", "cube.fil", "3", "-o", "finest.obj"});
    EXPECT_EQ(bytes_of(path("finest.obj")), bytes_of(path("cube.obj")));
}

TEST_F(Cli, HandlesPullMeshesAndModels) {
    make_model({"--base", "300"});
    write("pull.json", R"({"handles": [
        {"name": "foot", "box": {"min": [-1, -1, -1], "max": [1, 1, -0.3]}},
        {"name": "head", "box": {"min": [-1, -1, 0.3], "max": [1, 1, 1]}, "move": [0, 0, 0.5],
         "axis": [0, 0, 1], "degrees": 20}]})");
    ok({"deform", "cube.obj", "-o", "full.obj", "--handles", "pull.json"});
    ok({"deform", "cube.fil", "-o", "restored.obj", "--handles", "pull.json"});
    EXPECT_GT(rms("full.obj", "cube.obj"), 0.05);
    EXPECT_LT(rms("restored.obj", "full.obj"), 0.02); // the solve over the driver differs, not the restore
    write("broken.json", "{\"handles\": [");
    fails(4, {"deform", "cube.fil", "-o", "x.obj", "--handles", "broken.json"}, {"broken.json"});
    write("wrong.json", R"({"handles": [{"vertices": [0], "mvoe": [1, 0, 0]}]})");
    fails(2, {"deform", "cube.fil", "-o", "x.obj", "--handles", "wrong.json"}, {"wrong.json", "mvoe"});
    for (const char* id : {"-1", "1.5", "4294967296", "\"0\""}) {
        write("ids.json", std::string(R"({"handles": [{"vertices": [)") + id + "]}]}");
        fails(2, {"deform", "cube.obj", "-o", "x.obj", "--handles", "ids.json"}, {"ids.json", "handle 1", id});
    }
    write("seam.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n");
    write("seam.json", R"({"handles": [{"vertices": [1]}, {"vertices": [3], "move": [0, 0, 1]}]})");
    fails(2, {"deform", "seam.obj", "-o", "x.obj", "--handles", "seam.json"}, {"seam.json", "vertices 1 and 3"});
    write("nowhere.json", R"({"handles": [{"sphere": {"centre": [9, 9, 9], "radius": 1}}]})");
    fails(2, {"deform", "cube.obj", "-o", "x.obj", "--handles", "nowhere.json"}, {"nowhere.json"});
}

TEST_F(Cli, LocaleAndThreadsChangeNoByte) {
    const locale_t german = ::newlocale(LC_ALL_MASK, "de_DE.UTF-8", nullptr);
    if (german) ::freelocale(german);
    make_cube(64);
    const std::string job = "\"$0\" strip cube.obj -o m.fil --quiet --threads $T && "
                            "\"$0\" deform m.fil -o r.obj --pose p.ply --bend 60.5 --quiet --threads $T && "
                            "\"$0\" info cube.obj --json --threads $T && "
                            "\"$0\" compare r.obj cube.obj --json --threads $T && cat m.fil r.obj p.ply";
    const Ran first = run_shell("T=1; " + job), second = run_shell("T=2; " + job);
    ASSERT_EQ(first.code, 0) << first.err;
    EXPECT_TRUE(first.out == second.out);
    if (!german) GTEST_SKIP() << "no locale de_DE.UTF-8 here: only threads were tried";
    const Ran translated = run_shell("T=1; export LC_ALL=de_DE.UTF-8; " + job);
    EXPECT_TRUE(first.out == translated.out);
}

TEST_F(Cli, AFileThatMayNotGrowIsRemoved) {
    const Ran ran = run_shell("ulimit -f 20; exec \"$0\" make wavy-cube --resolution 100 -o x.obj");
    EXPECT_EQ(ran.code, 6) << ran.err; // a signal (SIGXFSZ) would be -1
    EXPECT_NE(ran.err.find("x.obj"), std::string::npos) << ran.err;
    EXPECT_TRUE(files().empty()) << testing::PrintToString(files());
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) // sanitizers want far more address space
TEST_F(Cli, LittleAddressSpaceIsOutOfMemory) {
    make_cube(32);
    for (const int kilobytes : {40'000, 60'000, 80'000}) { // the first has no room for threads
        const Ran ran = run_shell("ulimit -v " + std::to_string(kilobytes) +
                                  "; exec \"$0\" remesh cube.obj -o quads.ply --threads 8");
        if (ran.code == 127) continue; // not even for the program's libraries
        EXPECT_EQ(ran.code, 9) << kilobytes << ": " << ran.err;
        EXPECT_EQ(lines_of(ran.err).size(), 1u) << ran.err;
        EXPECT_NE(ran.err.find("Out of memory"), std::string::npos) << ran.err;
    }
    for (int kilobytes = 250'000; kilobytes <= 500'000; kilobytes += 50'000) {
        const Ran ran = run_shell("ulimit -v " + std::to_string(kilobytes) +
                                  "; exec \"$0\" render cube.obj -o cube.png --size 64x64 --quiet");
        if (ran.err.find("LLVM ERROR") != std::string::npos) continue; // llvmpipe's compiler ends the process itself
        EXPECT_TRUE(ran.code == 0 || ran.code == 5 || ran.code == 9) << kilobytes << ": " << ran.code << ran.err;
    }
}
#endif

TEST_F(Cli, PackSaysWhatComesBackNearer) {
    ok({"make", "wavy-sphere", "-o", "ball.obj", "--resolution", "8"});
    std::ofstream(path("ball.obj"), std::ios::app) << "v 5000 0 0\n";
    EXPECT_NE(ok({"pack", "ball.obj", "-o", "ball.fil"}).err.find("1 unused vertex lies too far"), std::string::npos);
    EXPECT_EQ(ok({"pack", "ball.obj", "-o", "ball.fil", "--profile", "lossless"}).err.find("unused"),
              std::string::npos);
}

TEST_F(Cli, WarningsAreSaidOnceAndQuietlyNot) {
    write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    const Ran ran = ok({"compare", "points.obj", "points.obj"});
    EXPECT_EQ(lines_of(ran.err).size(), 1u) << ran.err;
    const Ran quiet = ok({"compare", "points.obj", "points.obj", "--quiet"});
    EXPECT_EQ(quiet.err, "");
    EXPECT_EQ(quiet.out, ran.out); // the answer is not what --quiet is about
    EXPECT_EQ(json({"compare", "points.obj", "points.obj"}).at("warnings").size(), 1u);
    EXPECT_EQ(ok({"make", "bar", "-o", "bar.ply", "--quiet"}).out, "");
}

TEST_F(Cli, ProgressBarOnlyOnATerminal) {
    make_cube(200);
    EXPECT_EQ(ok({"strip", "cube.obj", "-o", "cube.fil", "--threads", "1"}).err.find('\r'), std::string::npos);
}

TEST_F(Cli, DemoDoesTheMainJob) {
    make_cube();
    const Json demo = json({"demo", "cube.obj", "-o", "out"});
    EXPECT_LT(demo.at("rms").get<double>(), 2e-3); // measured 9.0e-4 with a driver of 76; without gradients 6.8e-3
    for (const char* key : {"rms", "max", "positions_only_rms"})
        EXPECT_GT(demo.at(std::string(key) + "_units").get<double>(), demo.at(key).get<double>()); // diagonal 1.9
    EXPECT_EQ(rms("out/mesh.ply", "cube.obj"), 0);
    if (demo.at("warnings").empty()) { // OpenGL and ffmpeg are there
        EXPECT_EQ(demo.at("pictures"), Json({"out/demo.png", "out/demo.mp4"}));
        for (const Json& name : demo.at("pictures")) EXPECT_TRUE(std::filesystem::exists(path(name))) << name;
    }
    for (const char* name : {"driver.ply", "driver_bent.ply", "restored.ply", "full_deformation.ply", "model.fil"})
        EXPECT_TRUE(std::filesystem::exists(path(std::string("out/") + name))) << name;
}

TEST_F(Cli, DemoKeepsWhatWasThere) {
    make_cube();
    std::filesystem::create_directories(path("out/driver.ply/holds")); // where the demo's second file cannot be written
    ok({"make", "bar", "-o", "out/mesh.ply"});
    write("out/model.fil", "mine");
    const std::string mesh = bytes_of(path("out/mesh.ply"));
    fails(2, {"demo", "out/mesh.ply", "-o", "out"}, {"out/mesh.ply", "-o"});
    EXPECT_EQ(bytes_of(path("out/model.fil")), "mine");
    fails(6, {"demo", "cube.obj", "-o", "out", "--no-pictures"}, {"out/driver.ply"});
    EXPECT_TRUE(std::filesystem::exists(path("out/model.fil")));
    EXPECT_EQ(bytes_of(path("out/mesh.ply")), mesh);
    std::filesystem::remove(path("out/model.fil"));
    fails(6, {"demo", "cube.obj", "-o", "out", "--no-pictures"}, {"out/driver.ply"});
    EXPECT_FALSE(std::filesystem::exists(path("out/model.fil"))); // this one was the demo's own
}

TEST_F(Cli, CorpusSampleThroughTheProgram) {
    if (read_corpus().empty()) GTEST_SKIP() << "no corpus at " << corpus_folder();
    constexpr std::size_t kEvery = 7; // the whole corpus is tried without the program
    std::size_t number = 0;
    for (const CorpusRow& row : read_corpus()) {
        if (number++ % kEvery != 0) continue;
        SCOPED_TRACE(row.file);
        const Ran info = run({"info", row.path.string()});
        EXPECT_LT(info.seconds, 20);
        if (info.code == 0) {
            ok({"strip", row.path.string(), "-o", "m.fil"});
            ok({"level", "m.fil", "0", "-o", "d.ply"});
            ok({"restore", "m.fil", "--pose", "d.ply", "-o", "r.ply"});
            EXPECT_LE(largest("r.ply", row.path.string()), 1e-6);
        } else {
            EXPECT_TRUE(info.code >= 3 && info.code <= 5) << info.code;
            EXPECT_EQ(std::count(info.err.begin(), info.err.end(), '\n'), 1) << info.err;
        }
    }
}
