#include "playback.h"

#include "studio/materials.h"

#include "filigree/physics/material.h"

#include <QSignalSpy>
#include <QTest>

#include <algorithm>

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

State ball_state(const BodySettings& body = {}) {
    State state;
    ShapeOptions options;
    options.resolution = 12;
    options.amplitude = 0;
    options.size = 2; // model units
    auto source = std::make_shared<Source>();
    source->mesh = make_wavy_sphere(options);
    state.model = std::make_shared<const Model>(strip(source->mesh, {.base = 100}, RunContext()).value().model);
    state.source = source;
    state.restore.level = state.model->finest_level();
    state.body = body;
    state.body.particles = 300;
    state.body.material = material_named("jelly");
    return state;
}

std::shared_ptr<const DroppedBody> made_of(const State& state) {
    return make_body_of(state, Vec3d::UnitY(), RunContext()).value();
}

float lowest(const Pose& pose) {
    float y = 1e9f;
    for (const Vec3f& p : pose.positions) y = std::min(y, p.y());
    return y;
}

TEST(Playback, StartsAtRestWithARecordingOfTheStart) {
    Playback playback;
    QSignalSpy changed(&playback, &Playback::state_changed);
    EXPECT_EQ(playback.moment(), nullptr);
    const State state = ball_state();
    playback.put(made_of(state));
    EXPECT_TRUE(playback.has_body());
    EXPECT_FALSE(playback.is_playing());
    ASSERT_NE(playback.moment(), nullptr);
    EXPECT_TRUE(playback.moment()->pose.positions == driver_positions(*state.model));
    EXPECT_EQ(playback.recording().frames.size(), 1u);
    EXPECT_EQ(changed.count(), 1);
    playback.remove();
    EXPECT_FALSE(playback.has_body());
    EXPECT_EQ(playback.moment(), nullptr);
}

TEST(Playback, FallsAndRecordsEveryFrame) {
    Playback playback;
    playback.put(made_of(ball_state()));
    const float start = lowest(playback.moment()->pose);
    playback.play();
    EXPECT_TRUE(playback.is_playing());
    playback.wait_for_frames(12);
    playback.pause();
    EXPECT_FALSE(playback.is_playing());
    const std::size_t frames = playback.recording().frames.size();
    EXPECT_GE(frames, 13u);
    EXPECT_EQ(playback.moment()->frame + 1, frames);
    // Free fall in model units: the ball of 1 m is 2 units.
    const double time = double(playback.moment()->frame) / 60;
    if (time < 0.3) {
        EXPECT_NEAR(start - lowest(playback.moment()->pose), 2 * 0.5 * 9.81 * time * time, 0.05);
    }
    for (std::size_t f = 1; f < 12; ++f)
        EXPECT_LT(lowest(playback.recording().frames[f]), lowest(playback.recording().frames[f - 1]));
    QCoreApplication::processEvents();
    EXPECT_EQ(playback.recording().frames.size(), frames); // a pause is a pause
}

TEST(Playback, StepsOneFrameAtATime) {
    Playback playback;
    playback.put(made_of(ball_state()));
    playback.step();
    playback.wait_for_frames(0);
    EXPECT_EQ(playback.moment()->frame, 1u);
    playback.step();
    playback.step();
    playback.wait_for_frames(0);
    EXPECT_EQ(playback.moment()->frame, 3u);
    EXPECT_EQ(playback.recording().frames.size(), 4u);
}

TEST(Playback, ResetGoesBackToTheSameStart) {
    Playback playback;
    playback.put(made_of(ball_state()));
    for (int k = 0; k < 5; ++k) playback.step();
    playback.wait_for_frames(0);
    const std::vector<Pose> first = playback.recording().frames;
    playback.reset();
    EXPECT_EQ(playback.recording().frames.size(), 1u);
    EXPECT_EQ(playback.moment()->frame, 0u);
    for (int k = 0; k < 5; ++k) playback.step();
    playback.wait_for_frames(0);
    ASSERT_EQ(playback.recording().frames.size(), first.size());
    for (std::size_t f = 0; f < first.size(); ++f)
        EXPECT_TRUE(playback.recording().frames[f].positions == first[f].positions) << "frame " << f;
}

TEST(Playback, AHandPullsThePointItTook) {
    BodySettings settings;
    settings.gravity = settings.ground = false;
    const State state = ball_state(settings);
    Playback playback;
    playback.put(made_of(state));
    const std::vector<Vec3f> rest = driver_positions(*state.model);
    const auto top = std::max_element(rest.begin(), rest.end(), [](auto& a, auto& b) { return a.y() < b.y(); });
    playback.grab(*top, top->cast<double>());
    EXPECT_TRUE(playback.is_grabbed());
    EXPECT_TRUE(playback.is_playing());
    playback.pull(top->cast<double>() + Vec3d(0, 1, 0));
    playback.wait_for_frames(30);
    const Index grabbed = Index(top - rest.begin());
    EXPECT_GT(playback.moment()->pose.positions[grabbed].y(), top->y() + 0.2f);
    playback.let_go();
    EXPECT_FALSE(playback.is_grabbed());
    playback.pull(Vec3d(std::nan(""), 0, 0)); // ignored
    playback.wait_for_frames(2);
    EXPECT_TRUE(playback.moment()->pose.positions[grabbed].allFinite());
}

TEST(Playback, EveryVertexWhenAskedFor) {
    const State state = ball_state();
    Playback playback;
    playback.put(made_of(state));
    EXPECT_TRUE(playback.moment()->full.empty());
    playback.want({.full = true}); // shows the same moment again
    EXPECT_TRUE(QTest::qWaitFor([&] { return !playback.moment()->full.empty(); }));
    ASSERT_EQ(playback.moment()->full.size(), state.model->mesh.vertex_count());
    EXPECT_EQ(playback.recording().frames.size(), 1u);
    for (std::size_t v = 0; v < playback.moment()->full.size(); ++v)
        EXPECT_LT((playback.moment()->full[v] - state.model->mesh.positions[v]).norm(), 1e-4f);
}

State wax_state() {
    BodySettings body;
    body.drop = 0;
    State state = ball_state(body);
    state.body.material = material_named("wax");
    return state;
}

TEST(Playback, ATorchMeltsWhatItIsHeldToAndTheSurfaceFollows) {
    const State state = wax_state();
    Playback playback;
    playback.put(made_of(state));
    playback.want({.temperatures = true});
    playback.step();
    playback.wait_for_frames(0);
    ASSERT_EQ(playback.moment()->temperatures.size(), state.model->mesh.vertex_count());
    EXPECT_EQ(playback.moment()->surface, nullptr) << "all of it is as it was";
    const auto hottest = [&] { return *std::ranges::max_element(playback.moment()->temperatures); };
    const float before = hottest();
    EXPECT_NEAR(before, 293, 1);

    const Vec3d top = {0, 1, 0};
    playback.hold_torch(top, {});
    EXPECT_TRUE(playback.is_playing());
    EXPECT_TRUE(QTest::qWaitFor([&] { return hottest() > float(state.body.material.melting_to); }, 60'000));
    ASSERT_NE(playback.moment()->surface, nullptr);
    const Mesh& surface = *playback.moment()->surface;
    EXPECT_EQ(playback.moment()->temperatures.size(), surface.vertex_count());
    EXPECT_TRUE(analyse_topology(surface, RunContext()).is_closed());
    playback.put_out_torch();
    playback.pause();
    EXPECT_EQ(playback.surface(0), nullptr);
    EXPECT_EQ(playback.surface(playback.recording().frames.size() - 1), playback.moment()->surface);

    playback.reset();
    EXPECT_EQ(playback.moment()->surface, nullptr);
    for (int k = 0; k < 3; ++k) playback.step();
    playback.wait_for_frames(0);
    EXPECT_EQ(playback.moment()->surface, nullptr) << "the torch is out";
    EXPECT_NEAR(hottest(), 293, 1);
}

TEST(Playback, AirMeltsAndFreezes) {
    State state = wax_state();
    state.body.melting_time = 1;
    Playback playback;
    playback.put(made_of(state));
    playback.want({.temperatures = true});
    playback.set_air_temperature(state.body.material.melting_to + 60);
    playback.play();
    EXPECT_TRUE(QTest::qWaitFor([&] { return playback.moment()->surface != nullptr; }, 60'000));
    playback.set_air_temperature(200);
    const auto coldest = [&] { return *std::ranges::min_element(playback.moment()->temperatures); };
    EXPECT_TRUE(QTest::qWaitFor([&] { return coldest() < 250; }, 60'000));
    playback.pause();
}

TEST(Playback, PinnedVerticesHoldTheBody) {
    State state = ball_state();
    const std::vector<Vec3f> rest = driver_positions(*state.model);
    Handle pins;
    pins.pinned = true;
    for (Index v = 0; v < rest.size(); ++v)
        if (rest[v].y() > 0.7f) pins.vertices.push_back(v);
    ASSERT_FALSE(pins.vertices.empty());
    state.handles.push_back(pins);
    Playback playback;
    playback.put(made_of(state));
    for (int k = 0; k < 20; ++k) playback.step();
    playback.wait_for_frames(0);
    const Pose& pose = playback.moment()->pose;
    for (const Index v : pins.vertices) EXPECT_NEAR(pose.positions[v].y(), rest[v].y(), 0.1f);
    EXPECT_LT(lowest(pose), -1.01f); // the rest hangs
}

TEST(Playback, ABodyThatCannotBeSimulatedIsToldAndRemoved) {
    auto made = std::make_shared<DroppedBody>(*made_of(ball_state()));
    made->world.obstacles[0].stiffness = 2; // refused
    for (const bool resets : {false, true}) {
        Playback playback;
        QSignalSpy failed(&playback, &Playback::failed);
        playback.put(made);
        playback.play();
        if (resets) playback.reset(); // at work or not: it returns
        EXPECT_TRUE(QTest::qWaitFor([&] { return failed.count() > 0; }));
        EXPECT_FALSE(playback.has_body());
        EXPECT_FALSE(playback.is_playing());
        playback.reset();
        playback.play();
        playback.step();
        EXPECT_FALSE(playback.is_playing() || playback.is_stepping());
    }
}

TEST(Playback, GoesAwayInTheMiddleOfAFrame) {
    BodySettings settings;
    State state = ball_state(settings);
    state.body.particles = 30000;
    state.body.material.young_modulus = 1e9; // hundreds of substeps
    const auto made = made_of(state);
    for (int k = 0; k < 2; ++k) {
        Playback playback;
        playback.put(made);
        playback.play();
        QCoreApplication::processEvents();
        if (k == 0) playback.pause();
        playback.play();
    }
}

} // namespace
} // namespace filigree::studio
