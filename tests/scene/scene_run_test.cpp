#include "flesh/skinned_gltf.h"
#include "scene/scenes.h"
#include "threads.h"

#include "filigree/file.h"
#include "filigree/mesh/mesh_map.h"
#include "filigree/scene/particles_near.h"
#include "filigree/scene/saved_state.h"

namespace filigree {
namespace {

class SceneRunTest : public filigree_test::Scenes {
protected:
    /// A scene and its run, which refers to it.
    struct Made {
        SceneFile scene;
        ReadyScene ready;
        std::optional<SceneRun> run;
    };
    std::unique_ptr<Made> made(const std::string& text = filigree_test::kDrop, bool checks = false) const {
        auto made = std::make_unique<Made>();
        made->scene = scene(text);
        made->ready = set_up(made->scene, kOneThread).value();
        made->run.emplace(SceneRun::create(made->scene, made->ready, checks, kOneThread).value());
        return made;
    }
    static std::string state_after(Made& made, std::uint64_t frame) {
        EXPECT_TRUE(made.run->advance_to(frame, kOneThread));
        return made.run->save();
    }
};

TEST_F(SceneRunTest, ASceneInOneCallMovesAsARunFrameByFrame) {
    const SceneFile dropped = scene(filigree_test::kDrop);
    const SceneMotion motion = simulate_scene(dropped, kOneThread).value();
    const auto run = made();
    ASSERT_TRUE(run->run->advance_to(dropped.frames, kOneThread));
    ASSERT_EQ(motion.bodies.size(), run->ready.bodies.size());
    const PoseSequence& moved = motion.bodies[0].poses;
    ASSERT_EQ(moved.frames.size(), dropped.frames + 1); // with the start
    EXPECT_EQ(moved.frames.back().positions, run->run->recording().poses[0].frames.back().positions);
    EXPECT_EQ(motion.bodies[0].name, run->ready.bodies[0].name);
    EXPECT_FALSE(motion.broke_down);
    RunContext cancelled;
    cancelled.cancel();
    EXPECT_EQ(simulate_scene(dropped, cancelled).error().code, ErrorCode::cancelled);
}

/// Up, and to the side where it is put.
TEST_F(SceneRunTest, ABodyFollowsACharacter) {
    ASSERT_TRUE(write_file(beside("tube.gltf"), filigree_test::skinned_tube()).ok());
    const std::string text = "[simulation]\nframes = 30\nframes_per_second = 30\n[[body]]\nmesh = \"tube.gltf\"\n"
                             "material = \"jelly\"\nparticles = 300\ncentre = [5, 1, 0]\n"
                             "rotate = { axis = [0, 1, 0], degrees = 90 }\n[[follow]]\nclip = \"Bend\"\n";
    const auto run = made(text + "[[follow.joint]]\nname = \"low*\"\nfrequency = 8\n"
                                 "[[follow.contact]]\nfirst = \"upper\"\nsecond = \"lower\"\n");
    EXPECT_EQ(run->scene.follows[0].joints[0].soft.strength, 1);
    EXPECT_FALSE(run->scene.follows[0].contacts[0].limbs.touch);
    ASSERT_TRUE(run->run->advance_to(15, kOneThread));
    const std::string state = run->run->save();
    ASSERT_TRUE(run->run->advance_to(30, kOneThread));
    EXPECT_FALSE(run->run->broke_down());
    // The lower half turns up by a quarter, about the middle of the tube.
    const Mesh last = run->run->mesh(0, 30, kOneThread).value();
    const Mesh& rest = run->ready.bodies[0].model.mesh;
    for (std::size_t v = 0; v < last.vertex_count(); ++v) {
        const Vec3f at = rest.positions[v];
        if (std::abs(at.x()) < 0.2f) continue;
        const Vec3f wanted =
            at.x() < 0 ? Vec3f(5 + at.z(), 1 + at.y(), -at.x()) : Vec3f(5 + at.z(), 1 + at.x(), at.y());
        EXPECT_LT((last.positions[v] - wanted).norm(), 0.12f) << at.transpose();
    }
    const auto resumed = made(text + "[[follow.joint]]\nname = \"low*\"\nfrequency = 8\n"
                                     "[[follow.contact]]\nfirst = \"upper\"\nsecond = \"lower\"\n");
    ASSERT_TRUE(resumed->run->resume(state, "state").ok());
    ASSERT_TRUE(resumed->run->advance_to(30, kOneThread));
    EXPECT_TRUE(resumed->run->save() == run->run->save());

    const auto refused = [&](const std::string& scene_text) {
        const Result<SceneFile> read = read_scene(write(scene_text));
        if (!read) return read.error().message;
        const Result<ReadyScene> ready = set_up(*read, kOneThread);
        return ready ? std::string() : ready.error().message;
    };
    EXPECT_NE(refused(text + "core = 3\n").find(":12:"), std::string::npos);
    EXPECT_NE(refused(text + "[[follow.joint]]\nname = \"hand\"\n").find("'upper', 'lower'"), std::string::npos);
    EXPECT_NE(refused(text + "[[follow.joint]]\nstrong = 1\n").find("[[follow.joint]]"), std::string::npos);
    EXPECT_NE(refused(text + "[[follow.limb]]\nname = \"hand\"\n").find("limb"), std::string::npos);
    EXPECT_NE(refused(text + "[[fracture]]\n").find("[[fracture]]"), std::string::npos);
    EXPECT_NE(refused("[[body]]\nshape = \"bar\"\n[[follow]]\n").find("animation"), std::string::npos);
    EXPECT_NE(refused("[[body]]\nmesh = \"tube.gltf\"\nmaterial = \"wax\"\n[[follow]]\n").find("fem"),
              std::string::npos);
    EXPECT_NE(refused("[[body]]\nmesh = \"tube.gltf\"\n[[follow]]\nclip = \"Run\"\n").find("'Run'"), std::string::npos);
}

TEST_F(SceneRunTest, MapsSayWhatVariesInABody) {
    Mesh mesh = make_bar({.resolution = 4, .length = 3});
    for (const Vec3f& p : mesh.positions) mesh.colors.push_back({p.x() > 0 ? 1.0f : 0.0f, 0, 0, 1});
    ASSERT_TRUE(write_mesh(mesh, beside("bar.ply")).ok());
    const std::string body = "[simulation]\nframes = 6\n[[body]]\nmesh = \"bar.ply\"\nsize = 0.3\nparticles = 400\n";
    const std::string map = "[[map]]\nof = \"stiffness\"\nfrom = \"color.r\"\nrange = [0.2, 1]\n"
                            "[[map]]\nof = \"density\"\nfrom = \"color.r\"\nrange = [3, 1]\n";
    const auto plain = made(body), varied = made(body + map);
    const Body& found = *varied->ready.bodies[0].body;
    for (std::size_t c = 0; c < found.cells.cells.size(); ++c) {
        const float x = found.cells.centroid[c].x();
        if (std::abs(x) < 0.09f) continue;
        EXPECT_NEAR(found.fields.stiffness[c], x > 0 ? 1 : 0.2, 0.02) << x;
        EXPECT_NEAR(found.fields.density[c], x > 0 ? 1 : 3, 0.05) << x;
    }
    EXPECT_NEAR(varied->ready.bodies[0].report.mass / plain->ready.bodies[0].report.mass, 2, 0.1);
    EXPECT_NE(varied->ready.hash, plain->ready.hash);
    const std::string half = state_after(*varied, 3), through = state_after(*made(body + map), 6);
    const auto resumed = made(body + map);
    ASSERT_TRUE(resumed->run->resume(half, "half"));
    EXPECT_EQ(state_after(*resumed, 6), through);
    EXPECT_FALSE(plain->run->resume(half, "half").ok());
    // Other colours in the same file are another scene.
    for (Vec4f& color : mesh.colors) color[0] *= 0.5f;
    ASSERT_TRUE(write_mesh(mesh, beside("bar.ply")).ok());
    EXPECT_NE(made(body + map)->ready.hash, varied->ready.hash);

    const SceneFile lacks = scene(body + "[[map]]\nof = \"density\"\nfrom = \"scalar wax\"\n");
    const std::string said = set_up(lacks, kOneThread).error().message;
    EXPECT_NE(said.find("scene.toml:7: The mesh has nothing for 'scalar wax'; it has no scalars."), std::string::npos)
        << said;
}

TEST(MeshMap, TakesColoursScalarsAndLabels) {
    Mesh mesh;
    mesh.positions.resize(5, Vec3f::Zero());
    mesh.add_face(std::array<Index, 3>{0, 1, 2});
    mesh.add_face(std::array<Index, 3>{2, 1, 3});
    mesh.colors = {{0, 0.1f, 0.2f, 1}, {1, 1, 1, 1}, {0, 0, 0, 0}, {0, 0.5f, 0, 1}, {0, 0, 0, 1}};
    mesh.scalars = {{"fat", {1, 2, 3, 4, 5}}};
    mesh.groups = {{"left_arm", "left_leg", "head"}, {1, 2}};
    mesh.materials = {{"skin"}, {0, kNoIndex}};
    using Values = std::vector<float>;
    EXPECT_EQ(mesh_map(mesh, "color.g").value(), (Values{0.1f, 1, 0, 0.5f, 0}));
    EXPECT_EQ(mesh_map(mesh, "color.a").value(), (Values{1, 1, 0, 1, 1}));
    EXPECT_EQ(mesh_map(mesh, "scalar fat").value(), (Values{1, 2, 3, 4, 5}));
    EXPECT_EQ(mesh_map(mesh, "group left_*").value(), (Values{1, 0.5f, 0.5f, 0, 0}));
    EXPECT_EQ(mesh_map(mesh, "material skin").value(), (Values{1, 0.5f, 0.5f, 0, 0}));
    EXPECT_EQ(mesh_map(mesh, "group tail").error().message,
              "The mesh has nothing for 'group tail'; it has the groups left_arm, left_leg, head.");
    EXPECT_EQ(mesh_map(mesh, "object a").error().message, "The mesh has nothing for 'object a'; it has no objects.");
    EXPECT_EQ(mesh_map(mesh, "joint tail").error().code, ErrorCode::unsuitable);
    EXPECT_EQ(mesh_map(mesh, "colour.r").error().code, ErrorCode::usage);
    EXPECT_EQ(in_range({1, 2, 3, 9}, {1, 3}, {10, 0.5}), (Values{10, 5.25f, 0.5f, 0.5f}));
    EXPECT_EQ(in_range({0, 1}, {1, 0}, {0.1, 1}), (Values{1, 0.1f})) << "the other way round";
}

TEST_F(SceneRunTest, EqualRunsSaveEqualBytes) {
    EXPECT_EQ(state_after(*made(), 4), state_after(*made(), 4));
    EXPECT_EQ(state_after(*made(filigree_test::kDrop, true), 4), state_after(*made(filigree_test::kDrop, true), 4));
}

TEST_F(SceneRunTest, AResumedRunSavesWhatOneThatWentThroughSaves) {
    const std::string half = state_after(*made(), 3), through = state_after(*made(), 6);
    const auto resumed = made();
    ASSERT_TRUE(resumed->run->resume(half, "half"));
    EXPECT_EQ(resumed->run->frame(), 3U);
    EXPECT_EQ(state_after(*resumed, 6), through);
    EXPECT_EQ(resumed->run->times().frames, 3U);
}

/// Soft, and thrown at the ground: crushed, at last inside out.
TEST_F(SceneRunTest, AResumedRunKnowsWhatMadeItDoubtful) {
    const std::string text = "[simulation]\nframes = 30\nmost_substeps = 20\n[[body]]\nname = \"jelly\"\n"
                             "shape = \"wavy-cube\"\nresolution = 8\nsize = 0.3\nparticles = 64\ndriver = 60\n"
                             "young_modulus = 2e3\ncentre = [0, 0.3, 0]\nvelocity = [0, -12, 0]\n"
                             "[[obstacle]]\nshape = \"ground\"\n";
    const auto through = made(text), resumed = made(text);
    const std::string half = state_after(*through, 12);
    ASSERT_TRUE(resumed->run->resume(half, "half"));
    EXPECT_EQ(resumed->run->warnings(), through->run->warnings());
    EXPECT_FALSE(resumed->run->warnings().empty());
    EXPECT_EQ(state_after(*resumed, 30), state_after(*through, 30));
    EXPECT_EQ(resumed->run->warnings(), through->run->warnings());
    EXPECT_EQ(resumed->run->broke_down(), through->run->broke_down());
}

TEST_F(SceneRunTest, ABodyThatCannotCarryItselfIsToldBeforeTheWork) {
    const auto said = [&](const std::string& body, const std::string& world = "") {
        const ReadyScene ready =
            set_up(scene(world + "[[body]]\nname = \"koala\"\nresolution = 8\n" + body), kOneThread).value();
        std::string all;
        for (const std::string& warning : ready.warnings)
            if (warning.find("cannot carry itself") != std::string::npos) all += warning;
        return all;
    };
    const std::string cube = "shape = \"wavy-cube\"\nparticles = 100\nmaterial = \"soft-rubber\"\n";
    const std::string large = said(cube + "scale = 20\n");
    EXPECT_NE(large.find("body 'koala' is 2"), std::string::npos) << large;
    EXPECT_NE(large.find(" t; soft-rubber of that size cannot carry itself: scale = "), std::string::npos) << large;
    EXPECT_EQ(said(cube + "scale = 0.5\n"), "");
    EXPECT_EQ(said(cube + "scale = 20\nmodel = \"rigid\"\n"), "");
    EXPECT_EQ(said(cube + "scale = 20\n", "[world]\ngravity = [0, 0, 0]\n"), "");
    EXPECT_EQ(said(cube + "scale = 20\nyoung_modulus = 1e9\n"), "");
    // A bar that lies is as high as it is thick.
    const std::string bar = "shape = \"bar\"\nlength = 40\nparticles = 500\nmaterial = \"soft-rubber\"\n";
    EXPECT_EQ(said(bar), "");
    EXPECT_NE(said(bar + "rotate = { axis = [0, 0, 1], degrees = 90 }\n"), "");
}

TEST_F(SceneRunTest, WhatWouldDoIsASizeWhereTheSceneGivesOne) {
    const std::string mesh = (std::filesystem::temp_directory_path() / "filigree_weight_test.ply").generic_string();
    ASSERT_TRUE(write_mesh(make_wavy_cube({.resolution = 8}), mesh, {}, kOneThread));
    const auto said = [&](const std::string& body) {
        const ReadyScene ready =
            set_up(scene("[[body]]\nmesh = \"" + mesh + "\"\nparticles = 100\n" + body), kOneThread).value();
        return ready.warnings.empty() ? std::string() : ready.warnings.front();
    };
    EXPECT_NE(said("material = \"jelly\"\n").find("scale = 0."), std::string::npos);
    EXPECT_NE(said("material = \"jelly\"\nsize = 3\n").find("size = 0."), std::string::npos);
    EXPECT_EQ(said("material = \"jelly\"\nsize = 0.3\n"), "");
    EXPECT_EQ(said("material = \"lava\"\nsize = 30\n"), "") << "it flows";
    std::filesystem::remove(mesh);
}

TEST_F(SceneRunTest, SizeIsTheLongestSideOfAMesh) {
    const std::string mesh = (std::filesystem::temp_directory_path() / "filigree_size_test.ply").generic_string();
    ASSERT_TRUE(write_mesh(make_wavy_cube({.resolution = 8, .size = 9.3}), mesh, {}, kOneThread));
    const std::string body = "[[body]]\nmesh = \"" + mesh + "\"\nparticles = 200\ndriver = 60\n";
    const ReadyScene ready = set_up(scene(body + "size = 0.5\n"), kOneThread).value();
    const Box box = bounds(ready.bodies[0].model.mesh);
    EXPECT_NEAR(ready.bodies[0].scale * box.size().maxCoeff(), 0.5, 1e-6);
    EXPECT_EQ(ready.bodies[0].body->scale, ready.bodies[0].scale);
    EXPECT_NE(refusal(body + "size = 0.5\nscale = 2\n").find("give one of size and scale"), std::string::npos);
    std::filesystem::remove(mesh);
}

TEST_F(SceneRunTest, BodiesBreakAndGoOnFromTheMiddle) {
    const std::string text = filigree_test::kDrop +
                             "[[fracture]]\npieces = 4\nstrength = 1e9\nenergy = 1e6\nroughness = 0\n"
                             "[[crack]]\ntime = 0.04\npieces = [0]\n";
    const auto through = made(text);
    const std::string half = state_after(*through, 4);
    EXPECT_EQ(through->run->fracture(0).parts, 2U);
    EXPECT_NEAR(through->run->fracture(0).first, 0.04, 0.01);
    const auto resumed = made(text);
    ASSERT_TRUE(resumed->run->resume(half, "half"));
    EXPECT_EQ(state_after(*resumed, 6), state_after(*through, 6));
    // Until it broke, the motion is that of a body that cannot break, and nothing shows.
    const auto whole = made();
    ASSERT_TRUE(whole->run->advance_to(2, kOneThread));
    const auto begun = made(text);
    ASSERT_TRUE(begun->run->advance_to(2, kOneThread));
    EXPECT_EQ(begun->run->energy().total(), whole->run->energy().total());
    const Mesh unbroken = whole->run->mesh(0, 2, kOneThread).value(),
               before = through->run->mesh(0, 2, kOneThread).value();
    ASSERT_GT(before.vertex_count(), unbroken.vertex_count());
    for (std::size_t v = 0; v < unbroken.vertex_count(); ++v)
        EXPECT_LT((unbroken.positions[v] - before.positions[v]).norm(), 1e-6f);
}

TEST_F(SceneRunTest, PiecesAreRestoredWhereTheirParticlesCarryThem) {
    const auto run =
        made(filigree_test::kDrop + "[[fracture]]\npieces = 4\nstrength = 1e9\nenergy = 1e6\nroughness = 0.5\n"
                                    "[[crack]]\ntime = 0.03\npieces = [0]\n",
             true);
    ASSERT_TRUE(run->run->advance_to(6, kOneThread));
    const auto whole = made(filigree_test::kDrop, true);
    ASSERT_TRUE(whole->run->advance_to(6, kOneThread));
    EXPECT_LT(run->run->recording().checks[0].worst_rms, 1.5 * whole->run->recording().checks[0].worst_rms);
    // Only the cracks around the piece that came off are left.
    ReadyBody& body = run->ready.bodies[0];
    const auto inside = [&] {
        return std::count_if(body.pieces.crack_of_face.begin(), body.pieces.crack_of_face.end(),
                             [](Index crack) { return crack != kNoIndex; });
    };
    const auto all = inside();
    leave_out_closed_cracks(body, run->run->recording().poses[0].frames);
    EXPECT_LT(inside(), all);
    EXPECT_GT(inside(), 0);
    ASSERT_EQ(body.model.mesh.face_count(), body.pieces.crack_of_face.size());
    for (const Index crack : body.pieces.crack_of_face)
        if (crack != kNoIndex) {
            EXPECT_EQ(body.pieces.pieces_of_crack[crack][0], 0u);
        }
    EXPECT_EQ(check_model(body.model), "");
}

TEST_F(SceneRunTest, StatesThatDoNotFitAreRefusedAndChangeNothing) {
    const auto run = made();
    const std::string state = state_after(*run, 2);
    const auto code = [&](const std::string& bytes) { return run->run->resume(bytes, "state").error().code; };
    EXPECT_EQ(code("nonsense"), ErrorCode::bad_file);
    std::string older = state;
    older[7] = '1';
    EXPECT_NE(run->run->resume(older, "state").error().message.find("another version"), std::string::npos);
    for (std::size_t size = 0; size < state.size(); size += 97)
        EXPECT_EQ(code(state.substr(0, size)), ErrorCode::bad_file);
    for (std::size_t at = 8; at < state.size(); at += state.size() / 23) {
        std::string damaged = state;
        damaged[at] = char(damaged[at] ^ 0x40);
        EXPECT_EQ(code(damaged), ErrorCode::bad_file) << at;
    }
    EXPECT_EQ(made(filigree_test::kDrop + "friction = 0.1\n")->run->resume(state, "state").error().code,
              ErrorCode::mismatch);
    EXPECT_EQ(made(filigree_test::kDrop, true)->run->resume(state, "state").error().code, ErrorCode::usage);
    EXPECT_EQ(run->run->save(), state);
}

TEST_F(SceneRunTest, CancelledLeavesWholeFrames) {
    const auto run = made();
    RunContext context(1);
    context.progress = [&](std::string_view, double fraction) {
        if (fraction >= 0.5) context.cancel();
    };
    const Status status = run->run->advance_to(4, context);
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::cancelled);
    EXPECT_EQ(run->run->frame(), 2U);
    EXPECT_EQ(run->run->recording().poses[0].frames.size(), 3U);
    EXPECT_EQ(run->run->save(), state_after(*made(), 2));
}

TEST_F(SceneRunTest, ChecksFindTheRestoredMeshNear) {
    const auto run = made(filigree_test::kDrop, true);
    ASSERT_TRUE(run->run->advance_to(3, kOneThread));
    ASSERT_EQ(run->run->recording().checks.size(), 1U);
    const CheckTotals& check = run->run->recording().checks[0];
    EXPECT_GT(check.worst_rms, 0);
    EXPECT_LT(check.worst_rms, 1e-2);
    EXPECT_LE(check.rms_sum, 3 * check.worst_rms);
    EXPECT_TRUE(run->run->warnings().empty());
}

std::string all_of(const std::vector<std::string>& sentences) {
    std::string all;
    for (const std::string& sentence : sentences) all += sentence + "\n";
    return all;
}

TEST_F(SceneRunTest, BodiesThatStartInsideSomethingAreDoubted) {
    const std::string sunk = "[[body]]\nname = \"sunk\"\nshape = \"wavy-cube\"\nresolution = 8\nparticles = 200\n"
                             "driver = 60\n[[obstacle]]\nshape = \"ground\"\n";
    const auto run = made(sunk);
    ASSERT_TRUE(run->run->advance_to(5, kOneThread));
    const std::string said = all_of(run->run->warnings());
    EXPECT_NE(said.find("the energy grew by"), std::string::npos) << said;
    EXPECT_NE(said.find("first in frame 1 "), std::string::npos) << said;
    EXPECT_NE(said.find("body 'sunk', near ("), std::string::npos) << said;
    EXPECT_NE(run->run->broke_down().value_or("").find("energy came from nowhere"), std::string::npos);
    // It came earlier than the state, and is known after it.
    const std::string half = run->run->save();
    const auto resumed = made(sunk);
    ASSERT_TRUE(resumed->run->resume(half, "half"));
    EXPECT_EQ(all_of(resumed->run->warnings()), said);
}

/// What gives energy that the scene asks for is no doubt, nor is what bodies do by themselves.
TEST_F(SceneRunTest, WorkThatTheSceneDoesIsNoDoubt) {
    const std::string cube = "[simulation]\nframes = 30\n[[body]]\nname = \"cube\"\nshape = \"wavy-cube\"\n"
                             "resolution = 8\nparticles = 100\ndriver = 60\nsize = 0.3\ncentre = [0, 0.4, 0]\n";
    const std::string ground = "[[obstacle]]\nshape = \"ground\"\n";
    for (const std::string& work :
         {std::string("[[force]]\nnewtons = [0, 400, 0]\n"), std::string("[world]\nwind = [30, 0, 0]\n"),
          std::string("[[force]]\nnewtons = [{ time = 0, value = [0, 900, 0] }, { time = 0.2, value = [0, 0, 0] }]\n"),
          std::string("[[hand]]\npoint = [0, 0.6, 0]\ntarget = [0, 0.9, 0]\nuntil = 0.3\n"),
          std::string("[[pin]]\nball = { centre = [0, 0.6, 0], radius = 0.15 }\nmove = [{ time = 0, value = [0, 0, 0] "
                      "}, { time = 0.3, value = [0, 0.5, 0] }]\n"),
          ground + "move = [{ time = 0, value = [0, 0, 0] }, { time = 0.3, value = [0, 0.6, 0] }]\n",
          ground + "restitution = 1\n", ground + "[[pin]]\nball = { centre = [0, 0.6, 0], radius = 0.15 }\n"}) {
        const auto run = made(cube + work);
        ASSERT_TRUE(run->run->advance_to(30, kOneThread));
        EXPECT_EQ(run->run->broke_down(), std::nullopt) << work << all_of(run->run->warnings());
        EXPECT_EQ(all_of(run->run->warnings()), "") << work;
    }
}

/// The lower half is held, the upper one goes down through it: no law of elasticity can help that.
TEST_F(SceneRunTest, CellsThatAreInsideOutAtAFramesEndAreDoubted) {
    const auto run =
        made("[simulation]\nframes = 12\n[world]\ngravity = [0, 0, 0]\n[[body]]\nname = \"bar\"\n"
             "shape = \"wavy-cube\"\namplitude = 0\nresolution = 8\nparticles = 300\ndriver = 60\n"
             "young_modulus = 1e4\ncentre = [0, 0, 0]\n"
             "[[pin]]\nbox = { min = [-1, -1, -1], max = [1, -0.3, 1] }\n"
             "[[pin]]\nbox = { min = [-1, 0.3, -1], max = [1, 1, 1] }\nmove = [{ time = 0, value = [0, 0, 0] "
             "}, { time = 0.1, value = [0, -1.5, 0] }, { time = 0.11, value = [0, 0, 0] }]\n");
    ASSERT_TRUE(run->run->advance_to(12, kOneThread));
    const std::string said = all_of(run->run->warnings());
    EXPECT_NE(said.find("body 'bar': cells were inside out at the end of "), std::string::npos) << said;
    EXPECT_NE(said.find(" of the frames "), std::string::npos) << said;
    EXPECT_NE(said.find(", the worst near ("), std::string::npos) << said;
    EXPECT_NE(said.find("stiffer (young_modulus; it has 1e+04)"), std::string::npos) << said;
    EXPECT_NE(run->run->broke_down().value_or("").find("cells were inside out"), std::string::npos);
    const std::optional<Inversion>& inversion = run->run->recording().doubts[0].inversion;
    ASSERT_TRUE(inversion);
    EXPECT_GT(inversion->cells, 0U);
    EXPECT_LE(inversion->least, 0);
    EXPECT_GE(inversion->first, 1U);
    EXPECT_LE(inversion->last, 12U);
    EXPECT_GE(inversion->worst, inversion->first);
    EXPECT_GT(inversion->frames, 1U);
    EXPECT_LT(std::abs(inversion->place.y()), 2.0f);
}

/// Waves cross its cells 60,000 times a frame.
TEST_F(SceneRunTest, FramesThatNeedMoreSubstepsThanThereAreAreDoubted) {
    const std::string text = "[simulation]\nframes = 2\nautomatic_rigid = false\n[world]\ngravity = [0, 0, 0]\n"
                             "[[body]]\nname = \"plate\"\nshape = \"wavy-cube\"\namplitude = 0\nresolution = 8\n"
                             "spacing = 0.5\ndriver = 60\nyoung_modulus = 1e9\ndensity = 1e-3\ninternal_damping = "
                             "1e-9\n";
    const auto run = made(text), resumed = made(text);
    const std::string half = state_after(*run, 1);
    ASSERT_TRUE(resumed->run->resume(half, "half"));
    EXPECT_EQ(resumed->run->warnings(), run->run->warnings());
    ASSERT_TRUE(run->run->advance_to(2, kOneThread));
    const std::string said = all_of(run->run->warnings());
    EXPECT_NE(said.find(" substeps of 2 frames, first in frame 1, were longer than is stable, as a frame has 20,000"),
              std::string::npos)
        << said;
    EXPECT_NE(said.find("young_modulus (it has 1e+09), internal_damping (it has 1e-09), fewer particles or more "
                        "frames_per_second"),
              std::string::npos)
        << said;
    EXPECT_NE(run->run->broke_down().value_or("").find("frames were not stepped stably"), std::string::npos);
}

TEST_F(SceneRunTest, RepeatedBodiesShareWhatTheyAreMadeOf) {
    const std::string text = "[simulation]\nframes = 3\n[[body]]\nname = \"stone\"\nshape = \"wavy-cube\"\n"
                             "resolution = 8\nsize = 0.2\nmaterial = \"stone\"\nparticles = 27\n"
                             "repeat = { count = [2, 1, 3], step = [0.5, 0, 0.4] }\nmay_sleep = false\n";
    const auto run = made(text);
    ASSERT_EQ(run->ready.bodies.size(), 6U);
    for (std::size_t b = 0; b < 6; ++b) {
        EXPECT_EQ(run->ready.bodies[b].name, "stone." + std::to_string(b + 1));
        EXPECT_EQ(run->ready.bodies[b].body, run->ready.bodies[0].body);
        EXPECT_FALSE(run->ready.actors[b].may_sleep);
        const Vec3d aside = run->ready.actors[b].placement.translation() - run->ready.actors[0].placement.translation();
        EXPECT_NEAR((aside - Vec3d(0.5 * double(b % 2), 0, 0.4 * double(b / 2))).norm(), 0, 1e-9) << b;
    }
    ASSERT_TRUE(run->run->advance_to(3, kOneThread));
    EXPECT_EQ(run->run->recording().poses.size(), 6U);
    // As if each had been written.
    std::string written;
    for (const char* centre : {"0, 0, 0", "0.5, 0, 0", "0, 0, 0.4", "0.5, 0, 0.4", "0, 0, 0.8", "0.5, 0, 0.8"})
        written += "[[body]]\nshape = \"wavy-cube\"\nresolution = 8\nsize = 0.2\nmaterial = \"stone\"\n"
                   "particles = 27\ncentre = [" +
                   std::string(centre) + "]\n";
    const auto each = made("[simulation]\nframes = 3\n" + written);
    ASSERT_TRUE(each->run->advance_to(3, kOneThread));
    for (std::size_t b = 0; b < 6; ++b)
        EXPECT_EQ(run->run->recording().poses[b].frames[3].positions,
                  each->run->recording().poses[b].frames[3].positions);
}

/// The presets that break: they stand, they break when they fall from a table, and nothing in that goes wrong.
TEST_F(SceneRunTest, MaterialsThatBreakDoSo) {
    for (const std::string material : {"brittle-stone", "glass", "plaster"}) {
        const auto scene_of = [&](double height) {
            return "[simulation]\nframes = 45\n[[body]]\nshape = \"wavy-cube\"\nresolution = 12\nsize = 0.4\n"
                   "particles = 700\ndriver = 60\nmaterial = \"" +
                   material + "\"\ncentre = [0, " + std::to_string(height) +
                   ", 0]\n[[fracture]]\npieces = 8\n[[obstacle]]\nshape = \"ground\"\n";
        };
        const auto stands = made(scene_of(0.217)), falls = made(scene_of(1));
        EXPECT_EQ(all_of(falls->ready.warnings), "") << material;
        ASSERT_TRUE(stands->run->advance_to(10, kOneThread));
        ASSERT_TRUE(falls->run->advance_to(45, kOneThread));
        EXPECT_EQ(stands->run->fracture(0).parts, 1U) << material;
        EXPECT_GT(falls->run->fracture(0).parts, 1U) << material;
        EXPECT_EQ(falls->run->broke_down(), std::nullopt) << material << all_of(falls->run->warnings());
        EXPECT_LE(falls->run->recording().totals.substeps, 45 * 256U) << material;
    }
}

TEST_F(SceneRunTest, PinsFindTheirParticles) {
    const auto pinned = [&](const std::string& region) {
        return set_up(scene(filigree_test::kDrop + "[[pin]]\n" + region + "\n"), kOneThread);
    };
    const Result<ReadyScene> all = pinned("");
    const std::size_t count = all->bodies[0].body->particle_count();
    EXPECT_EQ(all->world.pins[0].particles.size(), count);
    const Result<ReadyScene> near = pinned("vertices = [0, 1]");
    EXPECT_GE(near->world.pins[0].particles.size(), 1U);
    EXPECT_LT(near->world.pins[0].particles.size(), count / 4);
    const Result<ReadyScene> none = pinned("box = { min = [9, 9, 9], max = [10, 10, 10] }");
    ASSERT_FALSE(none);
    EXPECT_NE(none.error().message.find("holds no particle of 'cube'"), std::string::npos);
    EXPECT_NE(pinned("vertices = [123456]").error().message.find("there is no vertex 123456"), std::string::npos);
}

TEST_F(SceneRunTest, ParticlesNearAPointAreThoseWithinHalfACellAndTheNearest) {
    const auto run = made();
    const Body& body = *run->ready.bodies[0].body;
    const std::vector<Vec3f> there = {body.rest[5]}, far = {Vec3f(100, 0, 0)};
    const std::vector<Index> near = particles_near(body, there);
    EXPECT_TRUE(std::binary_search(near.begin(), near.end(), 5U));
    for (const Index i : near) EXPECT_LE((body.rest[i] - there[0]).norm(), 0.88 * body.spacing());
    EXPECT_EQ(particles_near(body, far).size(), 1U);
    EXPECT_TRUE(particles_near(body, {}).empty());
    // As trying every particle would say, near and far.
    for (const float away : {0.0f, 0.3f, 2.0f, 40.0f}) {
        const std::vector<Vec3f> at = {body.rest[3] + Vec3f(away, 0.3f * away, 0), Vec3f(away, 0.1f, -away)};
        std::vector<Index> wanted;
        for (const Vec3f& point : at) {
            Index nearest = 0;
            for (Index i = 0; i < body.rest.size(); ++i) {
                if ((body.rest[i] - point).norm() <= float(0.87 * body.spacing())) wanted.push_back(i);
                if ((body.rest[i] - point).norm() < (body.rest[nearest] - point).norm()) nearest = i;
            }
            wanted.push_back(nearest);
        }
        std::sort(wanted.begin(), wanted.end());
        wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
        EXPECT_EQ(particles_near(body, at), wanted) << away;
    }
}

TEST(HoldLost, HoldsWhatIsFarOrNoNumber) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<Mat3f> still(4, Mat3f::Identity());
    const Pose before{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, still};
    Pose now{{{0.5f, 0, 0}, {100, 0, 0}, {nan, 0, 0}, {3.5f, 0, 0}}, still};
    now.gradients[3] = 1000 * Mat3f::Identity();
    EXPECT_EQ(hold_lost(before, now, 10, 100), 3U);
    EXPECT_EQ(now.positions, (std::vector<Vec3f>{{0.5f, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}));
    EXPECT_EQ(now.gradients, still);
}

} // namespace
} // namespace filigree
