#include "scene/scenes.h"

#include "filigree/scene/scene_keys.h"

#include <numbers>

namespace filigree {
namespace {

using SceneFileTest = filigree_test::Scenes;
using filigree_test::kDrop;

TEST_F(SceneFileTest, HoldsWhatIsWrittenAndTheDefaultsElse) {
    const SceneFile scene = this->scene(kDrop + "color = \"#ff0000\"\nmove = [{ time = 0, value = [0, 0, 0] }, "
                                                "{ time = 1, value = [0, 2, 0] }]\n[picture]\nup = \"z\"\n");
    EXPECT_EQ(scene.frames, 6U);
    ASSERT_EQ(scene.bodies.size(), 1U);
    EXPECT_EQ(scene.bodies[0].name, "cube");
    EXPECT_EQ(scene.bodies[0].driver, 60U);
    EXPECT_EQ(scene.bodies[0].centre, Vec3d(0, 0.62, 0));
    EXPECT_FALSE(scene.bodies[0].color);
    EXPECT_EQ(scene.gravity, Vec3d(0, -9.81, 0));
    ASSERT_EQ(scene.obstacles.size(), 1U);
    EXPECT_EQ(scene.obstacles[0].color, Vec3f(1, 0, 0));
    EXPECT_TRUE(scene.obstacles[0].motion.moves());
    EXPECT_EQ(scene.obstacles[0].motion.move.values[1], Vec3d(0, 2, 0));
    EXPECT_EQ(scene.picture.up, UpAxis::z);
}

TEST_F(SceneFileTest, TwoMomentsOfOneTimeAreAJump) {
    const auto turned = [&](const char* second) {
        return kDrop +
               "turn = [{ time = 0, value = [0, 350, 0] }, { time = 1, value = [0, 370, 0] }, { time = " + second +
               ", value = [0, 10, 0] }, { time = 2, value = [0, 30, 0] }]\n";
    };
    const Keyed<Vec3d> angle = scene(turned("1")).obstacles[0].motion.angle;
    const double degree = std::numbers::pi / 180;
    EXPECT_NEAR(angle.at(0.5).y(), 360 * degree, 1e-9);
    EXPECT_NEAR(angle.at(1.5).y(), 20 * degree, 1e-9);
    EXPECT_NE(refusal(turned("0.9")).find("must ascend"), std::string::npos);
}

TEST_F(SceneFileTest, RefusesWithLineAndSuggestion) {
    EXPECT_EQ(refusal("[[body]]\nshpe = \"bar\"\n"), "2: unknown key 'shpe' in [[body]]; did you mean 'shape'?");
    EXPECT_EQ(refusal("[bodi]\n"), "1: unknown table 'bodi'; did you mean [[body]]?");
    EXPECT_EQ(refusal("[[body]]\nshape = \"bar\"\nradius = 3\n"),
              "3: unknown key 'radius' in [[body]]; it belongs to [[obstacle]].");
    EXPECT_EQ(refusal("[[body]]\nshape = \"bar\"\ncolor = \"red\"\n"),
              "3: color: 'red' is no colour; write it as #rrggbb, such as #d04030.");
    EXPECT_EQ(refusal("[[body]]\nshape = \"bar\"\nsize = 0\n"),
              "3: 'size' in [[body]] must be a number, 1e-30 to 1e+30, and is 0.");
}

TEST_F(SceneFileTest, WhatCannotBreakIsToldWhatToWrite) {
    const std::string said = refusal("[[body]]\nname = \"statue\"\nshape = \"bar\"\nmaterial = \"stone\"\n"
                                     "[[fracture]]\npieces = 25\n");
    EXPECT_NE(said.find("'statue'"), std::string::npos) << said;
    EXPECT_NE(said.find("add model = \"fem\" and young_modulus = "), std::string::npos) << said;
    EXPECT_TRUE(read_scene(write("[[body]]\nname = \"statue\"\nshape = \"bar\"\nmaterial = \"stone\"\n"
                                 "model = \"fem\"\nyoung_modulus = 2e7\n[[fracture]]\npieces = 25\n")));
}

TEST_F(SceneFileTest, ValuesTakeThePlaceOfWhatIsWritten) {
    const std::string path = write(kDrop + "[[body]]\nshape = \"bar\"\n");
    const auto with = [&](std::vector<SceneValue> values) { return read_scene(path, values); };
    const auto said = [&](SceneValue value) {
        const auto scene = with({value});
        return scene ? "" : scene.error().message.substr(scene.error().message.find(".toml") + 5);
    };
    const SceneFile plain = read_scene(path).value();
    const SceneFile scene = with({{"body", "young_modulus", 0, "2e4"},
                                  {"body", "density", 2, "500"},
                                  {"world", "gravity", 0, "[0, -1, 0]"},
                                  {"body", "density", 2, "600"}})
                                .value();
    EXPECT_EQ(scene.bodies[0].material.young_modulus, 2e4);
    EXPECT_EQ(scene.bodies[1].material.young_modulus, 2e4);
    EXPECT_EQ(scene.bodies[0].material.density, plain.bodies[0].material.density);
    EXPECT_EQ(scene.bodies[1].material.density, 600) << "the last one holds";
    EXPECT_EQ(scene.gravity, Vec3d(0, -1, 0)) << "the file has no [world]";
    EXPECT_NE(scene.content, plain.content);
    EXPECT_EQ(with({{"body", "young_modulus", 1, "5e4"}}).value().content, plain.content) << "what it says already";
    EXPECT_EQ(said({"body", "yung", 0, "1"}),
              ": body.yung: a scene has no such key (docs/scenes.md lists what there is).");
    EXPECT_EQ(said({"body", "density", 3, "1"}), ": body.density: the scene has 2 [[body]].");
    EXPECT_EQ(said({"force", "newtons", 0, "1"}), ": force.newtons: the scene has no [[force]].");
    EXPECT_EQ(said({"world", "gravity", 1, "1"}), ": world.gravity: there is one [world] alone, without a number.");
    EXPECT_EQ(said({"body", "density", 0, "1\nother = 2"}),
              ": body.density: '1\nother = 2' is no value that TOML knows.");
    EXPECT_EQ(said({"body", "density", 0, "-1"}),
              ": 'density' in [[body]] must be a number, 1e-09 to 1e+06, and is -1.");
}

TEST_F(SceneFileTest, ReadsWhatBreaks) {
    const std::string fracture = "[[fracture]]\npieces = 7\npattern = \"radial\"\nstrength = 2e3\nseed = 5\n";
    const SceneFile scene = this->scene(kDrop + fracture + "[[crack]]\ntime = 0.5\npieces = [2]\n");
    ASSERT_EQ(scene.fractures.size(), 1U);
    EXPECT_EQ(scene.fractures[0].pattern.pieces, 7U);
    EXPECT_EQ(scene.fractures[0].pattern.kind, FracturePatternKind::radial);
    EXPECT_EQ(scene.fractures[0].material.strength, 2e3);
    EXPECT_EQ(scene.fractures[0].material.seed, 5U);
    EXPECT_FALSE(scene.fractures[0].energy);
    EXPECT_TRUE(scene.fractures[0].at.empty());
    const std::string hit = "[[fracture]]\npattern = \"impact\"\nkeep_closed = true\nat = ";
    EXPECT_EQ(this->scene(kDrop + hit + "[1, 2, 3]\n").fractures[0].at, std::vector<Vec3d>({Vec3d(1, 2, 3)}));
    const SceneFile twice = this->scene(kDrop + hit + "[[1, 2, 3], [0, 0, 1]]\n");
    EXPECT_EQ(twice.fractures[0].at, std::vector<Vec3d>({Vec3d(1, 2, 3), Vec3d(0, 0, 1)}));
    EXPECT_TRUE(twice.fractures[0].keep_closed);
    EXPECT_NE(refusal(kDrop + "[[fracture]]\npattern = \"radial\"\nat = [[1, 2, 3], [0, 0, 1]]\n").find("at one point"),
              std::string::npos);
    const std::string clay =
        "[[body]]\nshape = \"bar\"\nmaterial = \"clay\"\nmodel = \"fem\"\nyield_stress = 5e3\n[[fracture]]\n";
    const SceneFile tears =
        this->scene(clay + "pattern = \"grains\"\nclump = 4\npieces = 10\nplastic_opening = 0.02\n");
    EXPECT_EQ(tears.fractures[0].pattern.kind, FracturePatternKind::grains);
    EXPECT_EQ(tears.fractures[0].pattern.clump, 4U);
    EXPECT_EQ(tears.fractures[0].material.plastic_opening, 0.02);
    EXPECT_EQ(tears.fractures[0].material.strength, 15e3);
    EXPECT_NE(refusal(kDrop + "[[fracture]]\nplastic_opening = 0.02\n").find("yield_stress"), std::string::npos);
    ASSERT_EQ(scene.cracks.size(), 1U);
    EXPECT_EQ(scene.cracks[0].pieces, std::vector<Index>{2});
    EXPECT_NE(refusal("[[body]]\nshape = \"bar\"\nmaterial = \"clay\"\n[[fracture]]\n").find("only bodies"),
              std::string::npos);
    EXPECT_NE(refusal("[[body]]\nshape = \"bar\"\n[[crack]]\n").find("no [[fracture]]"), std::string::npos);
}

TEST_F(SceneFileTest, ContentIsTheMotionsAlone) {
    const std::string content = scene(kDrop).content;
    EXPECT_EQ(scene("# a comment\n" + kDrop + "[picture]\nview = \"top\"\n").content, content);
    EXPECT_NE(scene(kDrop + "friction = 0.1\n").content, content);
}

TEST_F(SceneFileTest, ErrorsInALineEndInOneFullStop) {
    const SceneFile scene = this->scene(kDrop);
    for (const char* what : {"no such thing", "no such thing.", "no such thing.."})
        EXPECT_EQ(scene_error(scene, 7, ErrorCode::mismatch, what).message, scene.path + ":7: no such thing.");
}

TEST(SceneKeys, EveryKeyIsInTheManual) {
    const std::string manual = scene_manual();
    for (const KeyRule& rule : scene_keys())
        EXPECT_NE(manual.find("| `" + std::string(rule.key) + "` |"), std::string::npos) << rule.key;
}

} // namespace
} // namespace filigree
