// Meshfree bodies touch as others do: by points of their surface, in cells whose corners their particles carry.
#include "filigree/core/random.h"
#include "filigree/mesh.h"
#include "filigree/physics/body/body_state.h"
#include "filigree/physics/body/make_cells.h"
#include "physics/test_bodies.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree::meshfree_contact_test {
namespace {

Material matter(MaterialModel model, double young_modulus = 1e6, double damping = 0) {
    Material material;
    material.model = model;
    material.young_modulus = young_modulus;
    material.damping = damping;
    return material;
}
constexpr MaterialModel kFem = MaterialModel::fem, kMeshfree = MaterialModel::meshfree;

Actor put(std::shared_ptr<const Body> body, const Vec3d& at, double degrees = 0,
          const Vec3d& velocity = Vec3d::Zero()) {
    Actor actor{.body = std::move(body), .velocity = velocity};
    actor.placement = Eigen::Translation3d(at) * Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3d::UnitZ());
    return actor;
}

Simulation begin(World world, std::vector<Actor> actors, bool touches_itself = true) {
    return Simulation::create(std::move(world), std::move(actors),
                              {.mode = StepMode::explicit_steps, .contacts_within_bodies = touches_itself}, kOneThread)
        .value();
}

/// Returns the deepest that something lay in matter, m.
double run(Simulation& simulation, int frames, unsigned threads = 1) {
    double deepest = 0;
    for (int frame = 0; frame < frames; ++frame)
        deepest = std::max(deepest, simulation.advance(RunContext(threads)).value().deepest_in_matter);
    return deepest;
}

World free_space() {
    World world;
    world.gravity.setZero();
    return world;
}

World on_ground(double friction = 0.5) {
    World world;
    Obstacle& ground = world.obstacles.emplace_back();
    ground.shape = HalfSpace{};
    ground.friction = friction;
    return world;
}

std::vector<Body> bodies_of_all_kinds() {
    const Material soft = matter(kMeshfree);
    std::vector<Body> bodies;
    for (const auto& [x, y, z] : {std::array{4, 4, 4}, {6, 1, 1}, {6, 5, 1}, {1, 1, 1}, {6, 2, 2}})
        bodies.push_back(make_body(box_cells(std::size_t(x), std::size_t(y), std::size_t(z), 0.1), soft));
    bodies.push_back(make_body(fork(), soft));
    const Mesh ball = make_wavy_sphere({.resolution = 24, .frequency = 2, .amplitude = 0.15});
    bodies.push_back(make_body(ball, soft, {.scale = 0.7, .cells = {.count = 2000}}, kAllThreads).value());
    return bodies;
}

// An affine motion of the particles is the corners', and so the surface's: contact sees no strain that is not there.
TEST(MeshfreeContact, CornersAndSurfaceFollowAffineMotions) {
    Mat3f turn = Eigen::AngleAxisf(1, Vec3f(1, 2, 3).normalized()).toRotationMatrix();
    turn.col(1) *= 1.3f;
    for (const Body& body : bodies_of_all_kinds()) {
        ASSERT_EQ(body.corners.size(), body.cells.corners.size());
        ASSERT_NE(body.field, nullptr);
        Vectors moved(body.particle_count());
        for (std::size_t i = 0; i < moved.size(); ++i) moved.set(i, turn * body.rest[i] + Vec3f(1, 2, 3));
        for (const Embedding* points : {&body.corners, &body.surface.points}) {
            float worst = 0;
            for (std::size_t p = 0; p < points->size(); ++p)
                worst = std::max(worst,
                                 (embedded_point(*points, p, moved) - turn * points->rest[p] - Vec3f(1, 2, 3)).norm());
            EXPECT_LT(worst, 1e-4f * float(body.spacing())) << body.particle_count();
        }
    }
}

TEST(MeshfreeContact, NothingIsCarriedAcrossAGap) {
    const Body arms = make_body(fork(), matter(kMeshfree));
    for (std::size_t corner = 0; corner < arms.corners.size(); ++corner) {
        const Vec3f at = arms.corners.rest[corner];
        if (at.y() < 0.45f) continue; // of the foot, or beside it
        for (Index k = arms.corners.offsets[corner]; k < arms.corners.offsets[corner + 1]; ++k)
            EXPECT_GT(at.x() * arms.rest.x[arms.corners.particles[k]], 0) << at.transpose();
    }
}

TEST(MeshfreeContact, ForcesOnCornersKeepForceAndTorque) {
    for (const Body& body : bodies_of_all_kinds()) {
        ContactCorners corners(body.corners, body.particle_count());
        Vectors positions(body.particle_count()), forces(body.particle_count());
        const auto random = [](std::uint64_t n) {
            return Vec3f(float(random_unit(5, 3 * n) - 0.5), float(random_unit(5, 3 * n + 1) - 0.5),
                         float(random_unit(5, 3 * n + 2) - 0.5));
        };
        for (std::size_t i = 0; i < positions.size(); ++i)
            positions.set(i, body.rest[i] + 0.2f * float(body.spacing()) * random(i));
        corners.place(positions, Vectors(positions.size()), kOneThread);
        Vec3d force = Vec3d::Zero(), torque = Vec3d::Zero();
        double size = 0;
        const auto add = [&](const Vec3f& at, const Vec3f& f, double sign) {
            force += sign * f.cast<double>();
            torque += sign * at.cast<double>().cross(f.cast<double>());
            size += double(f.norm());
        };
        for (std::size_t c = 0; c < body.corners.size(); ++c) {
            corners.forces().set(c, random(1000 + c));
            add(corners.positions()[c], random(1000 + c), 1);
        }
        corners.give_forces(forces, kOneThread);
        for (std::size_t i = 0; i < forces.size(); ++i) add(positions[i], forces[i], -1);
        EXPECT_LT(force.norm(), 1e-6 * size);
        EXPECT_LT(torque.norm(), 1e-6 * size);
        EXPECT_EQ(corners.forces()[0].norm(), 0) << "they are given once";
    }
}

TEST(MeshfreeContact, CubesRestOnEachOther) {
    for (const auto& [below, above] :
         {std::pair(kFem, kMeshfree), std::pair(kMeshfree, kFem), std::pair(kMeshfree, kMeshfree)}) {
        const auto lower = block(4, 4, 4, 0.1, matter(below, 1e6, 4)),
                   upper = block(4, 4, 4, 0.1, matter(above, 1e6, 4));
        Simulation stack = begin(on_ground(), {put(lower, {0, 0.2, 0}), put(upper, {0.02, 0.61, 0.03})});
        EXPECT_LT(run(stack, 240), 0.2 * 0.1);
        const Vec3d before = centre_of_mass(stack, 1);
        EXPECT_LT(run(stack, 60), 0.05 * 0.1);
        EXPECT_LT((centre_of_mass(stack, 1) - before).norm(), 1e-4) << int(below) << " below " << int(above);
        EXPECT_NEAR(centre_of_mass(stack, 1).y(), 0.6, 0.01);
        EXPECT_NEAR(centre_of_mass(stack, 0).y(), 0.2, 0.01);
    }
}

TEST(MeshfreeContact, AStackOfThreeStands) {
    const auto cube = block(3, 3, 3, 0.4 / 3, matter(kMeshfree, 1e6, 0.5));
    std::vector<Actor> actors;
    for (int i = 0; i < 3; ++i) actors.push_back(put(cube, {0, 0.2 + 0.4 * i, 0}));
    Simulation stack = begin(on_ground(), actors);
    run(stack, 900);
    std::vector<Vec3d> before;
    for (std::size_t b = 0; b < 3; ++b) before.push_back(centre_of_mass(stack, b));
    run(stack, 240);
    for (std::size_t b = 0; b < 3; ++b) {
        EXPECT_LT((centre_of_mass(stack, b) - before[b]).norm() / 4, 1e-5) << "m/s, of body " << b;
        EXPECT_NEAR(centre_of_mass(stack, b).y(), 0.2 + 0.4 * double(b), 0.03);
    }
}

TEST(MeshfreeContact, HitsKeepMomentumAndGainNoEnergy) {
    const double wave_speed = pressure_wave_speed(matter(kMeshfree));
    for (const auto& [one, other] : {std::pair(kFem, kMeshfree), std::pair(kMeshfree, kMeshfree)})
        for (const double speed : {1.0, 5.0, wave_speed / 2}) {
            const auto left = block(6, 6, 6, 0.4 / 6, matter(one)), right = block(6, 6, 6, 0.4 / 6, matter(other));
            Simulation meeting = begin(free_space(), {put(left, {-0.3, 0, 0}, 0, {speed / 2, 0, 0}),
                                                      put(right, {0.3, 0.05, 0.03}, 0, {-speed / 2, 0, 0})});
            const double energy = meeting.energy(kOneThread).total();
            const Momentum momentum = meeting.momentum();
            double nearest = 1;
            for (int frame = 0; frame < 45; ++frame) {
                run(meeting, 1);
                nearest = std::min(nearest, centre_of_mass(meeting, 1).x() - centre_of_mass(meeting, 0).x());
                EXPECT_LT(meeting.energy(kOneThread).total(), 1.01 * energy) << speed << " " << int(one);
            }
            EXPECT_LT(nearest, 0.42);
            EXPECT_GT(nearest, 0.2);
            const Momentum after = meeting.momentum();
            EXPECT_LT((after.angular - momentum.angular).norm(), 1e-5 * momentum.angular.norm()) << speed;
            EXPECT_LT((after.linear - momentum.linear).norm(), 1e-5 * 64 * speed) << speed;
        }
}

/// A block on a long one that is held fast on a slope; both are moved along and turned with it.
struct Slope {
    double degrees;
    Vec3d normal, down;

    explicit Slope(double the_degrees) : degrees(the_degrees) {
        const double angle = degrees * std::numbers::pi / 180;
        normal = Vec3d(-std::sin(angle), std::cos(angle), 0);
        down = Vec3d(-std::cos(angle), -std::sin(angle), 0);
    }
    Simulation begin_with(MaterialModel below, MaterialModel above, double damping, double up, double speed) const {
        World world;
        world.body_friction = 0.5;
        const auto plane = block(30, 2, 8, 0.05, matter(below, 1e6, damping));
        Pin pin;
        for (Index i = 0; i < plane->particle_count(); ++i) pin.particles.push_back(i);
        world.pins.push_back(pin);
        const auto cube = block(4, 4, 4, 0.05, matter(above, 1e6, damping));
        return begin(world, {put(plane, -0.05 * normal, degrees),
                             put(cube, 0.1002 * normal - up * down, degrees, speed * down)});
    }
};

TEST(MeshfreeContact, FrictionHoldsBelowItsAngle) {
    for (const auto& [below, above] :
         {std::pair(kFem, kMeshfree), std::pair(kMeshfree, kFem), std::pair(kMeshfree, kMeshfree)})
        for (const double degrees : {10.0, 20.0, 30.0}) {
            const Slope slope(degrees);
            Simulation resting = slope.begin_with(below, above, 0.5, 0.2, 0);
            run(resting, 120);
            const Vec3d before = centre_of_mass(resting, 1);
            run(resting, 60);
            const double speed = (centre_of_mass(resting, 1) - before).norm();
            if (degrees < 26)
                EXPECT_LT(speed, 1e-4) << degrees << " " << int(below) << " " << int(above);
            else
                EXPECT_GT(speed, 0.1) << degrees << " " << int(below) << " " << int(above);
        }
}

TEST(MeshfreeContact, SlidingFollowsCoulomb) {
    for (const auto& [below, above] : {std::pair(kFem, kMeshfree), std::pair(kMeshfree, kMeshfree)})
        for (const double degrees : {30.0, 40.0}) {
            const Slope slope(degrees);
            Simulation sliding = slope.begin_with(below, above, 0, 0.6, 1);
            std::vector<double> way;
            for (int frame = 0; frame < 33; ++frame) {
                run(sliding, 1);
                way.push_back(centre_of_mass(sliding, 1).dot(slope.down));
            }
            const double first = (way[7] - way[2]) * 12, last = (way[32] - way[27]) * 12; // m/s
            const double angle = degrees * std::numbers::pi / 180, acceleration = (last - first) / (25.0 / 60);
            const double friction = (9.81 * std::sin(angle) - acceleration) / (9.81 * std::cos(angle));
            EXPECT_NEAR(friction, 0.5, 0.015) << degrees << " " << int(below);
        }
}

TEST(MeshfreeContact, SavedWhileTouchingItGoesOnTheSameForAnyThreads) {
    const auto cube = block(4, 4, 4, 0.1, matter(kMeshfree, 1e5, 0.5)),
               hard = block(4, 4, 4, 0.1, matter(kFem, 1e5, 0.5));
    Material clay = matter(kMeshfree, 5e4);
    clay.yield_stress = 1e3;
    const std::vector<Actor> actors = {put(cube, {0, 0.2, 0}), put(hard, {0.1, 0.62, 0.05}, 10),
                                       put(std::make_shared<Body>(make_body(fork(), clay)), {0, 0.9, 0})};
    Simulation one = begin(on_ground(), actors), other = begin(on_ground(), actors);
    EXPECT_GT(run(one, 40), 0);
    ASSERT_TRUE(other.restore(one.save()).ok());
    EXPECT_TRUE(one.save() == other.save());
    run(one, 20);
    run(other, 20, 2);
    EXPECT_TRUE(one.save() == other.save());
}

TEST(MeshfreeContact, APairHasItsOwnRestitution) {
    const auto cube = block(3, 3, 3, 0.1, matter(kMeshfree, 1e5));
    std::array<double, 2> parting;
    for (const bool hard : {false, true}) {
        World world = free_space();
        world.body_pairs.push_back({1, 0, {.friction = 0, .restitution = hard ? 1.0 : 0.0}});
        Simulation meeting =
            begin(world, {put(cube, {-0.2, 0, 0}, 0, {0.5, 0, 0}), put(cube, {0.2, 0, 0}, 0, {-0.5, 0, 0})});
        run(meeting, 40);
        parting[hard] = centre_of_mass(meeting, 1).x() - centre_of_mass(meeting, 0).x();
    }
    EXPECT_GT(parting[1], parting[0] + 0.02);
}

/// The arms are pressed together by a palm on each side.
Simulation fork_between_palms(bool touches_itself) {
    World world = free_space();
    for (const int side : {-1, 1}) {
        Obstacle& palm = world.obstacles.emplace_back();
        palm.shape = Cuboid{Vec3d(side * 0.5, 1.2, 0), Vec3d(0.2, 0.3, 1)};
        palm.motion.move = {{0, 1}, {Vec3d::Zero(), Vec3d(-side * 0.16, 0, 0)}, Vec3d::Zero()};
        palm.friction = 0;
    }
    const auto body = std::make_shared<Body>(make_body(fork(), matter(kMeshfree, 1e5, 2)));
    return begin(std::move(world), {put(body, Vec3d::Zero())}, touches_itself);
}

TEST(MeshfreeContact, ABodyMeetsItself) {
    std::array<double, 2> past = {-1, -1}; // m that one arm's inner face went past the other's
    for (const bool touches_itself : {false, true}) {
        Simulation pressed = fork_between_palms(touches_itself);
        std::vector<Vec3f> faces;
        for (const float side : {-0.05f, 0.05f})
            for (const float z : {-0.1f, 0.0f, 0.1f}) faces.emplace_back(side, 1.2f, z);
        const std::size_t attachment = pressed.attach(0, faces, kOneThread);
        const double deepest = run(pressed, 90);
        EXPECT_LT(deepest, 0.3 * 0.1);
        EXPECT_EQ(deepest > 0, touches_itself);
        pressed.attached(attachment, faces, {}, kOneThread);
        for (std::size_t k = 0; k < 3; ++k)
            past[touches_itself] = std::max(past[touches_itself], double(faces[k].x() - faces[k + 3].x()));
    }
    EXPECT_LT(past[1], 0.03);
    EXPECT_GT(past[0], 0.06) << "the scene asks nothing of contact";
}

TEST(MeshfreeContact, ABodySavedWhileItMeetsItselfGoesOnTheSameForAnyThreads) {
    Simulation whole = fork_between_palms(true), again = fork_between_palms(true);
    EXPECT_GT(run(whole, 60), 0);
    ASSERT_TRUE(again.restore(whole.save()).ok());
    run(whole, 3);
    run(again, 3, 3);
    EXPECT_TRUE(again.save() == whole.save());
}

// What lies beside each other in one piece of matter does not touch where it is squeezed.
TEST(MeshfreeContact, ABodyInOnePieceDoesNotMeetItself) {
    const auto drop = [&](bool touches_itself) {
        Simulation dropped =
            begin(on_ground(), {put(block(6, 6, 6, 0.05, matter(kMeshfree, 1e5, 0.5)), {0, 0.2, 0}, 0, {0, -5, 0})},
                  touches_itself);
        double least = 1;
        for (int frame = 0; frame < 12; ++frame) {
            run(dropped, 1);
            const Vectors& at = dropped.positions(0);
            const auto [low, high] = std::minmax_element(at.y.begin(), at.y.begin() + std::ptrdiff_t(at.size()));
            least = std::min(least, double(*high - *low));
        }
        return std::pair(least, std::vector(dropped.positions(0).x));
    };
    const auto [height, with] = drop(true);
    EXPECT_LT(height, 0.8 * 0.25) << "the block is squeezed";
    EXPECT_TRUE(with == drop(false).second);
}

} // namespace
} // namespace filigree::meshfree_contact_test
