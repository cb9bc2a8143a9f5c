#include "scene/scenes.h"

#include "filigree/scene/scene_keys.h"

#include <cmath>
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
    EXPECT_EQ(scene.world.gravity, Vec3d(0, -9.81, 0));
    ASSERT_EQ(scene.obstacles.size(), 1U);
    EXPECT_EQ(scene.obstacles[0].color, Vec3f(1, 0, 0));
    EXPECT_TRUE(scene.obstacles[0].obstacle.motion.moves());
    EXPECT_EQ(scene.obstacles[0].obstacle.motion.move.values[1], Vec3d(0, 2, 0));
    EXPECT_EQ(scene.picture.up, UpAxis::z);
}

TEST_F(SceneFileTest, TwoMomentsOfOneTimeAreAJump) {
    const auto turned = [&](const char* second) {
        return kDrop +
               "turn = [{ time = 0, value = [0, 350, 0] }, { time = 1, value = [0, 370, 0] }, { time = " + second +
               ", value = [0, 10, 0] }, { time = 2, value = [0, 30, 0] }]\n";
    };
    const Keyed<Vec3d> angle = scene(turned("1")).obstacles[0].obstacle.motion.angle;
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

TEST_F(SceneFileTest, AWordOfOlderVersionsIsReadWithAWarning) {
    const std::string mode = "[simulation]\nmode = \"descent\"\n" + kDrop.substr(kDrop.find("frames"));
    const SceneFile scene = this->scene(mode);
    EXPECT_EQ(scene.step.mode, StepMode::automatic);
    ASSERT_EQ(scene.warnings.size(), 1U);
    EXPECT_NE(scene.warnings[0].find(":2: mode 'descent' is a word of older versions; 'auto' takes its place"),
              std::string::npos)
        << scene.warnings[0];
    EXPECT_TRUE(this->scene(kDrop).warnings.empty());
}

TEST_F(SceneFileTest, WhatCannotBreakIsToldWhatToWrite) {
    const std::string said = refusal("[[body]]\nname = \"statue\"\nshape = \"bar\"\nmaterial = \"stone\"\n"
                                     "[[fracture]]\npieces = 25\n");
    EXPECT_NE(said.find("'statue'"), std::string::npos) << said;
    EXPECT_NE(said.find("add model = \"fem\" and young_modulus = "), std::string::npos) << said;
    EXPECT_NE(said.find("brittle-stone, glass, plaster"), std::string::npos) << said;
    EXPECT_TRUE(read_scene(write("[[body]]\nname = \"statue\"\nshape = \"bar\"\nmaterial = \"stone\"\n"
                                 "model = \"fem\"\nyoung_modulus = 2e7\n[[fracture]]\npieces = 25\n")));
}

TEST_F(SceneFileTest, WhatBreaksKnowsItsStrength) {
    const auto fracture_of = [&](const std::string& more, const std::string& said = "") {
        return scene("[[body]]\nshape = \"bar\"\nmaterial = \"brittle-stone\"\n" + more + "[[fracture]]\n" + said)
            .fractures[0];
    };
    EXPECT_EQ(fracture_of("").material.strength, 1e5);
    EXPECT_EQ(fracture_of("").energy, 20);
    EXPECT_NEAR(fracture_of("young_modulus = 4e7\n").material.strength, 2e5, 1e-6) << "at the same strain";
    EXPECT_EQ(fracture_of("", "strength = 7\nenergy = 3\n").material.strength, 7);
    EXPECT_EQ(fracture_of("", "strength = 7\nenergy = 3\n").energy, 3);
}

TEST_F(SceneFileTest, ARepeatedBodyIsMany) {
    const std::string stone = "[[body]]\nname = \"stone\"\nshape = \"wavy-cube\"\ncentre = [1, 2, 3]\n";
    const SceneFile plain =
        scene(stone + "repeat = { count = [5, 2, 1], step = [1, 10, 100] }\n[[body]]\nshape = \"bar\"\n");
    ASSERT_EQ(plain.bodies.size(), 11U);
    EXPECT_EQ(plain.bodies[0].name, "stone.1");
    EXPECT_EQ(plain.bodies[9].name, "stone.10");
    EXPECT_EQ(plain.bodies[9].group, "stone");
    EXPECT_EQ(plain.bodies[10].name, "bar");
    EXPECT_EQ(plain.bodies[0].aside, Vec3d::Zero());
    EXPECT_EQ(plain.bodies[9].aside, Vec3d(4, 10, 0));
    const SceneFile row = scene(stone + "repeat = { count = 3, step = [1, 10, 100] }\n");
    ASSERT_EQ(row.bodies.size(), 3U);
    EXPECT_EQ(row.bodies[2].aside, Vec3d(2, 20, 200));
    // Jitter and turns are bounded, differ, and are the same in every run.
    const std::string shaken = "repeat = { count = 40, jitter = 0.1, turn = 30";
    const SceneFile first = scene(stone + shaken + " }\n"), again = scene(stone + shaken + " }\n"),
                    other = scene(stone + shaken + ", seed = 2 }\n");
    double most = 0, turned = 0;
    for (std::size_t b = 0; b < 40; ++b) {
        EXPECT_EQ(first.bodies[b].aside, again.bodies[b].aside);
        EXPECT_NE(first.bodies[b].aside, other.bodies[b].aside);
        most = std::max(most, first.bodies[b].aside.cwiseAbs().maxCoeff());
        turned = std::max(turned, std::abs(first.bodies[b].rotation.angle()));
    }
    EXPECT_LE(most, 0.1);
    EXPECT_GT(most, 0.08);
    EXPECT_LE(turned, 30 * std::numbers::pi / 180 + 1e-12);
    EXPECT_GT(turned, 20 * std::numbers::pi / 180);
}

TEST_F(SceneFileTest, RepeatedBodiesAreNamedOneOrAll) {
    const std::string stones = "[[body]]\nname = \"stone\"\nshape = \"wavy-cube\"\nrepeat = { count = 12 }\n";
    const std::string bar = "[[body]]\nname = \"bar\"\nshape = \"bar\"\n";
    const auto pair = [&](const std::string& first) {
        return scene(stones + bar + "[[pair]]\nfirst = \"" + first + "\"\nsecond = \"bar\"\nfriction = 1\n")
            .world.group_pairs[0]
            .first;
    };
    EXPECT_EQ(pair("stone").size(), 12U);
    EXPECT_EQ(pair("stone.3"), std::vector<std::size_t>{2});
    EXPECT_EQ(pair("stone.1*"), (std::vector<std::size_t>{0, 9, 10, 11}));
    EXPECT_EQ(pair("*").size(), 13U);
    EXPECT_EQ(pair("rubber").size(), 13U) << "the material";
    EXPECT_EQ(scene(stones + bar + "[[force]]\nbody = \"stone\"\n").forces.size(), 12U);
    EXPECT_EQ(scene(stones + bar + "[[force]]\nbody = \"stone.2\"\n").forces[0].body, 1U);
    EXPECT_EQ(scene(stones + "[[pin]]\n").pins.size(), 12U) << "the only one";
    EXPECT_EQ(scene(stones + bar + "[[fracture]]\nbody = \"stone\"\n").fractures.size(), 12U);
    const std::string hand = "[[hand]]\nvertex = 0\ntarget = [0, 0, 0]\nbody = ";
    EXPECT_EQ(scene(stones + bar + hand + "\"stone.12\"\n").hands[0].body, 11U);
    EXPECT_NE(
        refusal(stones + bar + hand + "\"stone\"\n").find("'stone' is repeated; name one of them, such as 'stone.1'"),
        std::string::npos);
    EXPECT_NE(refusal(stones + bar + hand + "\"stune\"\n").find("there are stone, bar."), std::string::npos);
    EXPECT_NE(refusal(stones + stones).find("two bodies are called 'stone'"), std::string::npos);
}

TEST_F(SceneFileTest, WrongRepeatsAreRefused) {
    const auto said = [&](const std::string& repeat) {
        return refusal("[[body]]\nshape = \"bar\"\nrepeat = " + repeat + "\n");
    };
    EXPECT_NE(said("3").find("3: 'repeat' in [[body]] must be a table such as { count = "), std::string::npos)
        << said("3");
    EXPECT_NE(said("{ step = [1, 0, 0] }").find("a table such as"), std::string::npos);
    EXPECT_NE(said("{ count = 0 }").find("repeat.count"), std::string::npos);
    EXPECT_NE(said("{ count = [1, 2] }").find("one whole number or three"), std::string::npos);
    EXPECT_NE(said("{ count = [100, 100, 2] }").find("these are 20000 bodies"), std::string::npos);
    EXPECT_NE(said("{ count = 2, jitter = -1 }").find("repeat.jitter"), std::string::npos);
    EXPECT_NE(said("{ count = 2, stp = [1, 0, 0] }").find("did you mean 'step'?"), std::string::npos);
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
    EXPECT_EQ(scene.world.gravity, Vec3d(0, -1, 0)) << "the file has no [world]";
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

TEST_F(SceneFileTest, ReadsMaps) {
    const std::string map = "[[map]]\nof = \"density\"\nfrom = \"color.g\"\n";
    const SceneFile scene = this->scene(kDrop + map + "range = [2, 0.5]\nvalues = [0.2, 0.8]\n");
    ASSERT_EQ(scene.maps.size(), 1U);
    EXPECT_EQ(scene.maps[0].of, FieldOf::density);
    EXPECT_EQ(scene.maps[0].from, "color.g");
    EXPECT_EQ(scene.maps[0].range, (std::array<double, 2>{2, 0.5}));
    EXPECT_EQ(scene.maps[0].values, (std::array<double, 2>{0.2, 0.8}));
    EXPECT_EQ(this->scene(kDrop + map).maps[0].range, (std::array<double, 2>{0.1, 1}));
    const auto says = [&](const std::string& text, const char* what) {
        const std::string said = refusal(kDrop + text);
        EXPECT_NE(said.find(what), std::string::npos) << said;
    };
    says("[[map]]\nfrom = \"color.g\"\n", "14: [[map]] needs `of`: what varies.");
    says("[[map]]\nof = \"density\"\n", "14: [[map]] needs `from`");
    says("[[map]]\nof = \"mass\"\nfrom = \"color.g\"\n",
         "15: 'of' in [[map]] must be one of stiffness, density, damping, yield_stress, strength, and is \"mass\".");
    says("[[map]]\nof = \"density\"\nfrom = \"colour\"\n", "16: 'colour' names no numbers of a mesh");
    says(map + "range = [0, 1]\n", "17: 'range' in [[map]] must be a number, 0.001 to 1000, and is 0.");
    says(map + "values = [1, 1]\n", "17: the two values of 'values' are the same.");
    says(map + map, "18: a body has one [[map]] of density at most.");
    says(map + "body = \"ball\"\n", "there is no body 'ball'");
    says("[[map]]\nof = \"yield_stress\"\nfrom = \"color.g\"\n", "is for a body with a yield_stress");
    says("[[map]]\nof = \"strength\"\nfrom = \"color.g\"\n", "is for a body with a [[fracture]]");
    EXPECT_NE(refusal("[[body]]\nshape = \"bar\"\nmodel = \"springs\"\n" + map).find("models fem and rigid"),
              std::string::npos);
    const std::string many = "[[body]]\nname = \"a\"\nshape = \"bar\"\nrepeat = { count = 3, step = [1, 0, 0] }\n";
    EXPECT_EQ(this->scene(many + map).maps.size(), 3U);
    EXPECT_NE(refusal(many + map + "body = \"a.2\"\n").find("are alike; name 'a'"), std::string::npos);
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

TEST_F(SceneFileTest, AKeyOfAnotherModelIsRefusedWithItsModels) {
    const auto said = [&](const std::string& model, const std::string& key) {
        return refusal("[[body]]\nshape = \"bar\"\nmodel = \"" + model + "\"\n" + key + " = 0.1\n");
    };
    EXPECT_EQ(said("springs", "yield_stress"), "4: 'yield_stress' in [[body]] is for model = \"fem\", \"meshfree\" or "
                                               "\"mpm\", and this body's is \"springs\".");
    EXPECT_EQ(said("fem", "bending"),
              "4: 'bending' in [[body]] is for model = \"springs\", and this body's is \"fem\".");
}

TEST(SceneKeys, WithoutAKeyTheFreshStructHolds) {
    const auto unset = [](const char* table, const char* key) { return unset_text(*find_key(table, key)); };
    EXPECT_EQ(unset("world", "body_friction"), "0.3");
    EXPECT_EQ(unset("world", "gravity"), "[0, -9.81, 0]");
    EXPECT_EQ(unset("world", "air_temperature"), "293");
    EXPECT_EQ(unset("simulation", "mode"), "auto");
    EXPECT_EQ(unset("fracture", "pattern"), "even");
    EXPECT_EQ(unset("obstacle", "visible"), "true");
    EXPECT_EQ(unset("picture", "size"), "[960, 720]");
    EXPECT_EQ(unset("body", "density"), "by the material") << "words where the struct does not say it";
}

TEST(SceneKeys, AMemberIsOfTheOwnerThatIsGiven) {
    World one, other;
    const SceneKey& key = *find_key("world", "air_density");
    *std::get<double*>(key.place(&one)) = 3;
    EXPECT_EQ(one.air_density, 3);
    EXPECT_EQ(other.air_density, 0);
    EXPECT_EQ(*std::get<double*>(key.fresh_place()), 0);
    ScenePicture picture;
    EXPECT_TRUE(key.is_in(&one));
    EXPECT_FALSE(key.is_in(&picture));
}

TEST(SceneKeys, TheNumbersOfAMaterialAreAllOfThem) {
    Material material;
    double next = 1;
    for (const SceneKey* key : material_numbers()) number_in(material, *key) = next++;
    EXPECT_EQ(material.density, 1);
    EXPECT_EQ(material.young_modulus, 2);
    EXPECT_EQ(sizeof(Material), sizeof(double) * std::size_t(next)) << "all but the model";
}

TEST(SceneKeys, EveryKeyIsInTheManual) {
    const std::string manual = scene_manual();
    for (const SceneKey& key : scene_keys())
        EXPECT_NE(manual.find("| `" + std::string(key.name) + "` |"), std::string::npos) << key.name;
}

} // namespace
} // namespace filigree
