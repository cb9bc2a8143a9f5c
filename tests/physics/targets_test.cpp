// Bodies that follow the targets of an animation.
#include "filigree/core/math.h"
#include "filigree/physics/simulation.h"

#include "physics/simulation_scenes.h"
#include "physics/test_bodies.h"

#include <numbers>

namespace filigree {
namespace {

using namespace simulation_scenes;

constexpr float kHeld = std::numeric_limits<float>::infinity();
constexpr StepOptions kElastic = {.mode = StepMode::explicit_steps, .automatic_rigid = false};

/// Where an animation has a point of the body at rest, m.
using Motion = std::function<Vec3d(const Vec3d& rest, double time)>;

Vectors places(const Body& body, const Motion& motion, double time) {
    Vectors at(body.particle_count());
    for (std::size_t i = 0; i < at.size(); ++i) at.set(i, motion(body.rest[i].cast<double>(), time).cast<float>());
    return at;
}

/// A body that follows a motion: its lowest particles are held, the others pulled by `frequency`.
class Following {
public:
    Following(std::shared_ptr<const Body> body, Motion motion, float frequency, StepOptions options = kElastic,
              World world = free_space(), float held_below = -1e9f)
        : body_(std::move(body)), motion_(std::move(motion)), rate_(options.frames_per_second),
          simulation_(simulation(std::move(world), {actor(body_)}, options)) {
        for (std::size_t i = 0; i < body_->particle_count(); ++i)
            follow.frequency.push_back(body_->rest[i].y() < held_below ? kHeld : frequency);
    }

    /// Onto the targets of the start.
    void begin() {
        const Vectors start = at(0), speeds = velocities(0);
        ASSERT_TRUE(simulation_.set_positions(0, start).ok());
        ASSERT_TRUE(simulation_.set_velocities(0, speeds).ok());
        ASSERT_TRUE(simulation_.set_follow(0, follow, start, speeds).ok());
    }
    FrameReport step(unsigned threads = 1) {
        const double next = double(simulation_.frame() + 1) / rate_;
        EXPECT_TRUE(simulation_.set_targets(0, at(next), velocities(next)).ok());
        const Result<FrameReport> report = simulation_.advance(RunContext(threads));
        EXPECT_TRUE(report.ok());
        return *report;
    }
    Vectors at(double time) const { return places(*body_, motion_, time); }
    Vectors velocities(double time) const {
        return target_velocities(at(time - 1 / rate_), at(time), at(time + 1 / rate_), rate_);
    }
    Simulation& sim() { return simulation_; }
    const Body& body() const { return *body_; }
    /// Of the particle next to a point at rest.
    std::size_t near(const Vec3f& rest) const {
        std::size_t best = 0;
        for (std::size_t i = 0; i < body_->particle_count(); ++i)
            if ((body_->rest[i] - rest).norm() < (body_->rest[best] - rest).norm()) best = i;
        return best;
    }

    Follow follow;

private:
    std::shared_ptr<const Body> body_;
    Motion motion_;
    double rate_;
    Simulation simulation_;
};

Vec3d stands(const Vec3d& rest, double) { return rest; }

TEST(Targets, AWholeBodySwingsAboutThemAtItsFrequency) {
    Following one(block(3, 3, 3, 0.1, material(MaterialModel::fem, 1e4)), stands, 2);
    one.follow.damping = {1};
    one.follow.leash = {kHeld}; // none
    one.begin();
    Vectors aside = one.at(0);
    for (float& x : aside.x) x += 0.1f;
    ASSERT_TRUE(one.sim().set_positions(0, aside).ok());
    const double own = 2 * std::numbers::pi * 2, damped = std::sqrt(own * own - 0.25);
    for (int frame = 1; frame <= 60; ++frame) {
        one.step();
        const double t = frame / 60.0;
        const double theory = 0.1 * std::exp(-0.5 * t) * (std::cos(damped * t) + 0.5 / damped * std::sin(damped * t));
        EXPECT_NEAR(centre_of_mass(one.sim()).x(), theory, 2e-3) << frame;
    }
}

/// The lowest shear wave of a layer that stands on a base: f = sqrt(mu / density) / (4 thickness).
TEST(Targets, ALayerOnAHeldBaseJigglesAsTheorySays) {
    const Material soft = material(MaterialModel::fem, 1e4);
    const double h = 0.025, thickness = 0.1;
    StepOptions fine = kElastic;
    fine.frames_per_second = 240;
    Following slab(block(40, 4, 4, h, soft), stands, 0, fine, free_space(), -0.0499f);
    slab.follow.damping = {0};
    slab.begin();
    Vectors leans = slab.at(0);
    for (std::size_t i = 0; i < leans.size(); ++i)
        leans.x[i] += 0.002f * float(math::sin(0.5 * std::numbers::pi * (double(leans.y[i]) + 0.05) / thickness));
    ASSERT_TRUE(slab.sim().set_positions(0, leans).ok());
    const std::size_t top = slab.near({0, 0.05f, 0});
    std::vector<double> crossings;
    float before = 1;
    for (int frame = 1; frame <= 120; ++frame) {
        slab.step();
        const float now = slab.sim().positions(0)[top].x() - slab.body().rest[top].x();
        if (now * before < 0) crossings.push_back(frame - double(now / (now - before)));
        before = now;
    }
    ASSERT_GT(crossings.size(), 3u);
    const double found = 0.5 * double(crossings.size() - 1) / ((crossings.back() - crossings.front()) / 240);
    const double theory =
        std::sqrt(lame_parameters(soft.young_modulus, soft.poisson_ratio).mu / soft.density) / (4 * thickness);
    EXPECT_NEAR(found / theory, 1, 0.05);
}

/// An arm that is held at one end and swings.
Motion swinging(double turns_a_second, double radians) {
    return [=](const Vec3d& rest, double t) {
        const double angle = radians * math::sin(2 * std::numbers::pi * turns_a_second * t);
        return Vec3d(Eigen::AngleAxisd(angle, Vec3d::UnitZ()) * rest);
    };
}
std::shared_ptr<const Body> arm() { return block(2, 8, 2, 0.05, material(MaterialModel::fem, 2e4)); }

TEST(Targets, MotionIsTheSameForAnyFrameRate) {
    const auto after_half_a_second = [](double rate) {
        StepOptions options = kElastic;
        options.frames_per_second = rate;
        Following one(arm(), swinging(1, 0.5), 4, options, free_space(), -0.1f);
        one.begin();
        for (int frame = 0; frame < int(rate / 2); ++frame) one.step();
        return one.sim().positions(0);
    };
    const Vectors fine = after_half_a_second(240);
    for (const double rate : {24.0, 60.0}) {
        const Vectors coarse = after_half_a_second(rate);
        double sum = 0;
        for (std::size_t i = 0; i < fine.size(); ++i) sum += double((fine[i] - coarse[i]).squaredNorm());
        EXPECT_LT(std::sqrt(sum / double(fine.size())) / 0.42, 1e-3) << rate; // of the diagonal
    }
}

TEST(Targets, AFastArmStaysWhole) {
    Following one(arm(), swinging(4, 1), 4, kElastic, free_space(), -0.1f);
    one.begin();
    for (int frame = 0; frame < 60; ++frame) {
        const FrameReport report = one.step();
        EXPECT_EQ(report.clamped_particles, 0u);
        EXPECT_EQ(report.unstable_substeps, 0u);
        EXPECT_LT(report.substeps, 60u);
        EXPECT_GT(report.least_volume_ratio, 0) << frame;
    }
}

TEST(Targets, JumpsTakeTheBodyAlong) {
    const Motion teleports = [](const Vec3d& rest, double t) {
        const Vec3d turned = t > 0.3 ? Vec3d(-rest.x(), rest.y(), -rest.z()) : rest; // half a turn, in one frame
        return Vec3d(turned + Vec3d(t > 0.15 ? 3 : 0, 0, 0));
    };
    Following one(arm(), teleports, 4, kElastic, free_space(), -0.1f);
    one.begin();
    for (int frame = 0; frame < 30; ++frame) {
        const FrameReport report = one.step();
        EXPECT_EQ(report.clamped_particles, 0u);
        EXPECT_LT(report.substeps, 60u);
        EXPECT_GT(report.least_volume_ratio, 0.4f) << frame;
    }
    EXPECT_NEAR(centre_of_mass(one.sim()).x(), 3, 0.01);
}

TEST(Targets, StiffSpringsTakeNoMoreSubsteps) {
    const auto substeps = [](float frequency) {
        Following one(arm(), swinging(1, 0.3), frequency, kElastic, free_space(), -0.1f);
        one.begin();
        unsigned most = 0;
        for (int frame = 0; frame < 20; ++frame) {
            const FrameReport report = one.step();
            most = std::max(most, report.substeps);
            EXPECT_EQ(report.clamped_particles, 0u);
            EXPECT_GT(report.least_volume_ratio, 0.5f);
        }
        return most;
    };
    EXPECT_LE(substeps(1e5f), substeps(1) + 2);
}

TEST(Targets, SameBytesForAnyThreadsAndAfterARestore) {
    const auto begin = [] {
        Following one(arm(), swinging(4, 0.8), 4, kElastic, with_ground(), -0.1f);
        one.begin();
        return one;
    };
    Following alone = begin(), threaded = begin();
    for (int frame = 0; frame < 6; ++frame) alone.step(1), threaded.step(2);
    const std::string middle = alone.sim().save();
    EXPECT_TRUE(middle == threaded.sim().save());
    for (int frame = 0; frame < 6; ++frame) alone.step();
    Following resumed = begin();
    ASSERT_TRUE(resumed.sim().restore(middle).ok());
    for (int frame = 0; frame < 6; ++frame) resumed.step();
    EXPECT_TRUE(alone.sim().save() == resumed.sim().save());

    for (std::size_t at = 0; at < middle.size(); at += 211) {
        std::string flipped = middle;
        flipped[at] = char(flipped[at] ^ 0x20);
        EXPECT_FALSE(resumed.sim().restore(flipped).ok());
    }
    Simulation free = simulation(with_ground(), {actor(arm())}, kElastic);
    const Status refused = free.restore(middle);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::mismatch);
}

/// Springs, moving least squares, and cells that yield.
TEST(Targets, OtherElasticModelsFollowToo) {
    Material yielding = material(MaterialModel::fem, 2e4);
    yielding.yield_stress = 2e3;
    for (const Material& of :
         {material(MaterialModel::springs, 2e4), material(MaterialModel::meshfree, 2e4), yielding}) {
        const int model = int(of.model);
        Following swings(block(3, 3, 3, 0.1, of), stands, 2);
        swings.follow.damping = {0};
        swings.follow.leash = {kHeld};
        swings.begin();
        Vectors aside = swings.at(0);
        for (float& x : aside.x) x += 0.1f;
        ASSERT_TRUE(swings.sim().set_positions(0, aside).ok());
        for (int frame = 1; frame <= 30; ++frame) {
            swings.step();
            EXPECT_NEAR(centre_of_mass(swings.sim()).x(), 0.1 * std::cos(4 * std::numbers::pi * frame / 60), 2e-3)
                << model;
        }
        Following arm_swings(block(2, 8, 2, 0.05, of), swinging(2, 0.5), 6, kElastic, free_space(), -0.1f);
        arm_swings.begin();
        for (int frame = 1; frame <= 40; ++frame) {
            const FrameReport report = arm_swings.step();
            EXPECT_EQ(report.clamped_particles, 0u) << model;
            EXPECT_EQ(report.unstable_substeps, 0u) << model;
            const Vectors wanted = arm_swings.at(frame / 60.0), &found = arm_swings.sim().positions(0);
            for (std::size_t i = 0; i < found.size(); ++i)
                EXPECT_LT((wanted[i] - found[i]).norm(), arm_swings.follow.frequency[i] == kHeld ? 1e-6f : 0.1f)
                    << model;
        }
    }
}

TEST(Targets, WithoutAnEndTheyStop) {
    Following one(arm(), swinging(1, 0.5), kHeld);
    one.begin();
    one.step();
    const Vectors before = one.sim().positions(0);
    run(one.sim(), 2);
    const Vectors after = one.sim().positions(0);
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ((before[i] - after[i]).norm(), 0);
}

TEST(Targets, LettingGoGivesTheBodyBackToGravity) {
    World falls = free_space();
    falls.gravity = {0, -10, 0};
    Following one(arm(), stands, kHeld, kElastic, falls);
    one.begin();
    one.step();
    EXPECT_NEAR(centre_of_mass(one.sim()).y(), 0, 1e-6);
    ASSERT_TRUE(one.sim().set_follow(0, {}, {}, {}).ok());
    run(one.sim(), 60);
    EXPECT_NEAR(centre_of_mass(one.sim()).y(), -5, 0.01);
    EXPECT_FALSE(one.sim().set_targets(0, one.at(0), one.at(0)).ok());
}

TEST(Targets, RefusesWhatCannotFollow) {
    const auto code = [](const Status& status) { return status.ok() ? "" : status.error().message; };
    Following one(arm(), stands, 1);
    const Vectors at = one.at(0), fewer(3);
    EXPECT_NE(code(one.sim().set_targets(0, at, at)).find("set_follow"), std::string::npos);
    EXPECT_NE(code(one.sim().set_follow(1, one.follow, at, at)), "");
    EXPECT_NE(code(one.sim().set_follow(0, one.follow, fewer, at)).find("targets"), std::string::npos);
    Follow wrong = one.follow;
    wrong.frequency[2] = -1;
    EXPECT_NE(code(one.sim().set_follow(0, wrong, at, at)).find("frequency[2]"), std::string::npos);
    wrong = one.follow;
    wrong.damping = {1, 2};
    EXPECT_NE(code(one.sim().set_follow(0, wrong, at, at)).find("damping"), std::string::npos);
    wrong = one.follow;
    wrong.leash = {0};
    EXPECT_NE(code(one.sim().set_follow(0, wrong, at, at)).find("leash"), std::string::npos);
    wrong = one.follow;
    wrong.contact_gap = -1;
    EXPECT_NE(code(one.sim().set_follow(0, wrong, at, at)).find("contact_gap"), std::string::npos);
    wrong = one.follow;
    wrong.passing = {{0, 1}};
    EXPECT_NE(code(one.sim().set_follow(0, wrong, at, at)).find("groups"), std::string::npos);
    Vectors lost = at;
    lost.x[1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(code(one.sim().set_follow(0, one.follow, lost, at)).find("particle 1"), std::string::npos);
    for (const MaterialModel model : {MaterialModel::rigid, MaterialModel::mpm}) {
        Simulation other = simulation(free_space(), {actor(block(3, 3, 3, 0.1, material(model)))}, kElastic);
        const Vectors rest = other.body(0).rest;
        Follow all;
        all.frequency.assign(rest.size(), 1);
        EXPECT_NE(code(other.set_follow(0, all, rest, rest)), "");
    }
}

} // namespace
} // namespace filigree
