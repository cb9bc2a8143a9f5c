// What touches in a frame, and what a ray meets.
#include "filigree/mesh.h"
#include "physics/simulation_scenes.h"
#include "physics/test_bodies.h"
#include "threads.h"

namespace filigree {
namespace {

using namespace simulation_scenes;

double mass_of(const Simulation& simulation, std::size_t body) {
    double mass = 0;
    for (const float of_one : simulation.body(body).mass) mass += double(of_one);
    return mass;
}

class Events : public testing::TestWithParam<MaterialModel> {};
INSTANTIATE_TEST_SUITE_P(ContactEvents, Events,
                         testing::Values(MaterialModel::rigid, MaterialModel::fem, MaterialModel::springs,
                                         MaterialModel::meshfree));

/// A body that falls: began, with its speed; the impulses of all frames are what its momentum changed by.
TEST_P(Events, SayHowHardABodyLands) {
    Actor falls = actor(box(3, 3, 3, 0.1, material(GetParam(), 3e5)), {0, 0.02, 0});
    falls.velocity = {0, -2, 0};
    Simulation world = simulation(with_ground(), {falls});
    const double mass = mass_of(world, 0);
    double impulse = 0, first_speed = 0;
    const double before = world.momentum().linear.y();
    std::size_t began = 0;
    const int frames = 30;
    for (int frame = 0; frame < frames; ++frame) {
        run(world, 1);
        for (const ContactEvent& event : world.contact_events()) {
            EXPECT_EQ(event.body, 0u);
            ASSERT_TRUE(event.obstacle.has_value());
            EXPECT_EQ(*event.obstacle, 0u);
            EXPECT_FALSE(event.other.has_value());
            if (event.kind == ContactKind::ended) continue;
            if (event.kind == ContactKind::began && ++began == 1) first_speed = event.speed;
            EXPECT_NEAR(event.normal.y(), 1, 1e-3);
            EXPECT_NEAR(event.place.y(), 0, 0.05);
            EXPECT_NEAR(event.place.x(), 0.15, 0.05);
            impulse += event.impulse;
        }
    }
    EXPECT_GE(began, 1u);
    EXPECT_NEAR(first_speed, 2.1, 0.15);
    const double changed = world.momentum().linear.y() - before + mass * 9.81 * frames / 60;
    EXPECT_NEAR(impulse, changed, 0.03 * changed);
}

/// Two bodies in free flight: what one gets the other loses.
TEST_P(Events, OfTwoBodiesAreOne) {
    const auto body = box(3, 3, 3, 0.1, material(GetParam(), 3e5));
    Actor left = actor(body, {0, 0, 0}), right = actor(body, {0.32, 0.02, 0.03});
    right.velocity = {-2, 0, 0};
    Simulation world = simulation(free_space(), {left, right});
    double impulse = 0, speed = 0;
    std::vector<ContactKind> kinds;
    for (int frame = 0; frame < 30; ++frame) {
        run(world, 1);
        ASSERT_LE(world.contact_events().size(), 1u);
        for (const ContactEvent& event : world.contact_events()) {
            EXPECT_EQ(event.body, 0u);
            ASSERT_TRUE(event.other.has_value());
            EXPECT_EQ(*event.other, 1u);
            EXPECT_FALSE(event.obstacle.has_value());
            kinds.push_back(event.kind);
            if (event.kind == ContactKind::ended) continue;
            EXPECT_LT(event.normal.x(), -0.8); // towards the first
            EXPECT_NEAR(event.place.x(), 0.3, 0.06);
            impulse += event.impulse;
            speed = std::max(speed, event.speed);
        }
    }
    ASSERT_GE(kinds.size(), 2u);
    EXPECT_EQ(kinds.front(), ContactKind::began);
    EXPECT_EQ(kinds.back(), ContactKind::ended);
    EXPECT_NEAR(speed, 2, 0.25);
    Vec3d given = Vec3d::Zero();
    for (std::size_t i = 0; i < body->particle_count(); ++i)
        given += double(body->mass[i]) * world.velocities(0)[i].cast<double>();
    EXPECT_NEAR(impulse, given.norm(), 0.06 * given.norm());
}

TEST(ContactEvents, StayWhileWhatTouchesSleepsAndEndWithARemovedBody) {
    const auto block = box(2, 2, 2, 0.1, material(MaterialModel::rigid));
    Simulation pile = simulation(with_ground(), {actor(block), actor(block, {0, 0.2, 0})});
    run(pile, 120);
    ASSERT_TRUE(pile.is_asleep(0) && pile.is_asleep(1));
    ASSERT_EQ(pile.contact_events().size(), 2u);
    for (const ContactEvent& event : pile.contact_events()) {
        EXPECT_EQ(event.body, 0u);
        EXPECT_EQ(event.kind, ContactKind::stays);
        EXPECT_EQ(event.impulse, 0);
    }
    ASSERT_TRUE(pile.remove_body(0).ok());
    run(pile, 1);
    ASSERT_EQ(pile.contact_events().size(), 2u);
    for (const ContactEvent& event : pile.contact_events()) EXPECT_EQ(event.kind, ContactKind::ended);
    run(pile, 1);
    EXPECT_TRUE(pile.contact_events().empty());
}

/// Of a body at rest the impulse of a frame is its weight; pieces of one body are one.
TEST(ContactEvents, AtRestCarryTheWeight) {
    for (const MaterialModel model : {MaterialModel::rigid, MaterialModel::fem}) {
        Material heavy = material(model, 1e6);
        heavy.damping = 5;
        Actor rests = actor(box(3, 2, 3, 0.1, heavy));
        rests.may_sleep = false;
        Simulation world = simulation(with_ground(0), {rests});
        run(world, 120);
        double impulse = 0;
        for (int frame = 0; frame < 10; ++frame) {
            run(world, 1);
            ASSERT_EQ(world.contact_events().size(), 1u);
            EXPECT_EQ(world.contact_events()[0].kind, ContactKind::stays);
            EXPECT_LT(world.contact_events()[0].speed, 0.05);
            impulse += world.contact_events()[0].impulse;
        }
        const double weight = mass_of(world, 0) * 9.81 * 10 / 60;
        EXPECT_NEAR(impulse, weight, 0.02 * weight) << int(model);
    }
}

TEST(ContactEvents, AreTheSameForAnyThreadsAndAfterARestore) {
    const auto soft = box(3, 3, 3, 0.1, material(MaterialModel::fem, 1e5));
    const auto block = box(2, 2, 2, 0.1, material(MaterialModel::rigid));
    const auto begin = [&] {
        return simulation(with_ground(),
                          {actor(soft, {0, 0.01, 0}), actor(block, {0.05, 0.33, 0}), actor(block, {1, 0.1, 0})});
    };
    Simulation one = begin(), many = begin(), resumed = begin();
    const auto same = [](const Simulation& a, const Simulation& b) {
        const auto &left = a.contact_events(), &right = b.contact_events();
        ASSERT_EQ(left.size(), right.size());
        for (std::size_t k = 0; k < left.size(); ++k) {
            EXPECT_EQ(left[k].kind, right[k].kind);
            EXPECT_EQ(left[k].body, right[k].body);
            EXPECT_EQ(left[k].other, right[k].other);
            EXPECT_EQ(left[k].impulse, right[k].impulse);
            EXPECT_EQ(left[k].place, right[k].place);
            EXPECT_EQ(left[k].normal, right[k].normal);
        }
    };
    for (int frame = 0; frame < 30; ++frame) {
        run(one, 1, 1);
        run(many, 1, 4);
        same(one, many);
    }
    ASSERT_TRUE(resumed.restore(one.save()).ok());
    EXPECT_TRUE(resumed.contact_events().empty());
    run(one, 1);
    run(resumed, 1);
    same(one, resumed);
}

// Rays.

std::optional<WorldHit> down(const Simulation& world, double x, double z, const RayOptions& options = {}) {
    return world.cast_ray({x, 3, z}, {0, -2, 0}, options);
}

TEST(Ray, MeetsBodiesOfAllModels) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree,
                                      MaterialModel::rigid, MaterialModel::mpm}) {
        Actor turned = actor(box(4, 4, 4, 0.1, material(model, 3e4)), {0, 0.5, 0});
        Simulation world = simulation(with_ground(), {turned, actor(turned.body, {5, 0.5, 0})});
        const double near = model == MaterialModel::mpm ? 0.06 : 1e-3;
        const auto hit = down(world, 0.17, 0.23);
        ASSERT_TRUE(hit.has_value());
        ASSERT_TRUE(hit->body.has_value()) << int(model);
        EXPECT_EQ(*hit->body, 0u);
        EXPECT_FALSE(hit->obstacle.has_value());
        EXPECT_NEAR(hit->distance, 3 - 0.9, near) << int(model);
        EXPECT_NEAR(hit->place.y(), 0.9, near);
        EXPECT_LT((hit->rest - Vec3f(0.17f, 0.4f, 0.23f)).norm(), model == MaterialModel::mpm ? 0.1f : 2e-3f);
        EXPECT_GT(hit->normal.y(), model == MaterialModel::mpm ? 0.3 : 0.99);
        const auto past = down(world, 0.17, 0.23, {.ignore = 0});
        ASSERT_TRUE(past && past->obstacle);
        EXPECT_NEAR(past->distance, 3, 1e-9);
        EXPECT_EQ(past->normal, Vec3d(0, 1, 0));
        EXPECT_FALSE(down(world, 0.17, 0.23, {.reach = 1.9, .ignore = {}}).has_value());
        const auto beside = down(world, 0.45, 0.2);
        ASSERT_TRUE(beside.has_value());
        EXPECT_TRUE(beside->obstacle.has_value() || model == MaterialModel::mpm) << int(model);
        const auto inside = world.cast_ray({0.2, 0.7, 0.2}, {1, 0, 0});
        ASSERT_TRUE(inside && inside->body);
        EXPECT_NEAR(inside->distance, 0, near);
    }
}

/// As bodies are now: fallen, turned and pressed flat; the point at rest goes along with the matter.
TEST(Ray, MeetsBodiesAsTheyAreNow) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::meshfree, MaterialModel::rigid}) {
        Actor falls = actor(box(5, 5, 5, 0.06, material(model, 2e4)), {0, 0.3, 0});
        falls.spin = {1, 2, 0.5};
        Simulation world = simulation(with_ground(), {falls});
        run(world, 25);
        const Vec3d middle = centre_of_mass(world);
        std::size_t met = 0;
        for (const Vec3d& side : {Vec3d(1, 0, 0), Vec3d(-1, 0.3, 0), Vec3d(0, 1, 0), Vec3d(0.2, 0.4, -1)}) {
            const Vec3d from = middle + 2 * side.normalized();
            const auto hit = world.cast_ray(from, middle - from);
            ASSERT_TRUE(hit && hit->body) << int(model);
            EXPECT_NEAR((hit->place - from).norm(), hit->distance, 1e-9);
            EXPECT_GT(hit->normal.dot(side.normalized()), 0.4);
            // The matter of that point at rest is there now.
            const std::size_t attached = world.attach(0, std::span(&hit->rest, 1), kOneThread);
            std::vector<Vec3f> place(1);
            world.attached(attached, place, {}, kOneThread);
            // Without cells points go along with the particles around them, and the surface with its corners.
            const double near = model == MaterialModel::meshfree ? 0.03 : 3e-3;
            EXPECT_LT((place[0].cast<double>() - hit->place).norm(), near) << int(model);
            // And it is on the surface at rest, a cube.
            const Vec3d from_middle = (hit->rest.cast<double>() - Vec3d::Constant(0.15)).cwiseAbs();
            EXPECT_NEAR(from_middle.maxCoeff(), 0.15, 0.01);
            ++met;
        }
        EXPECT_EQ(met, 4u);
    }
}

TEST(Ray, MeetsObstaclesWhereTheyStand) {
    World world;
    world.gravity.setZero();
    world.obstacles.push_back({.shape = Ball{{0, 0, 0}, 0.5}, .motion = {}});
    world.obstacles.push_back({.shape = Cuboid{{3, 0, 0}, {1, 2, 1}}, .motion = {}});
    const Mesh sphere = make_ball({0, 0, 0}, 1);
    Obstacle mesh;
    mesh.shape = make_mesh_obstacle(sphere, 1, 0, kOneThread).value();
    std::get<MeshObstacle>(mesh.shape).offset = {0, 0, 10};
    world.obstacles.push_back(mesh);
    Simulation one = simulation(world, {actor(box(2, 2, 2, 0.1, material(MaterialModel::rigid)), {20, 0, 0})});
    auto hit = one.cast_ray({0.3, 4, 0}, {0, -1, 0});
    ASSERT_TRUE(hit && hit->obstacle);
    EXPECT_EQ(*hit->obstacle, 0u);
    EXPECT_NEAR(hit->distance, 3.6, 1e-9);
    EXPECT_NEAR(hit->normal.y(), 0.8, 1e-9);
    hit = one.cast_ray({6, 0.2, 0.1}, {-1, 0, 0});
    ASSERT_TRUE(hit && hit->obstacle);
    EXPECT_EQ(*hit->obstacle, 1u);
    EXPECT_NEAR(hit->distance, 2.5, 1e-9);
    EXPECT_NEAR(hit->normal.x(), 1, 1e-9);
    hit = one.cast_ray({0.05, 5, 10.1}, {0, -1, 0});
    ASSERT_TRUE(hit && hit->obstacle);
    EXPECT_EQ(*hit->obstacle, 2u);
    EXPECT_GT(hit->normal.y(), 0.3);
    // Through the sphere from within, too: its walls have two sides.
    const auto from_inside = one.cast_ray({0.05, 0, 10.1}, {0, 1, 0});
    ASSERT_TRUE(from_inside && from_inside->obstacle);
    EXPECT_NEAR(from_inside->place.y(), hit->place.y(), 1e-3);
    EXPECT_LT(from_inside->normal.y(), 0);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Vec3d(0, 1, 0);
    ASSERT_TRUE(one.set_obstacle(0, pose).ok());
    hit = one.cast_ray({0.3, 4, 0}, {0, -1, 0});
    ASSERT_TRUE(hit && hit->obstacle);
    EXPECT_NEAR(hit->distance, 2.6, 1e-9);
    EXPECT_FALSE(one.cast_ray({0.3, 4, 0}, {0, 1, 0}).has_value());
    EXPECT_FALSE(one.cast_ray({0.3, 4, 0}, {0, 0, 0}).has_value());
    EXPECT_FALSE(one.cast_ray({0.3, std::numeric_limits<double>::quiet_NaN(), 0}, {0, -1, 0}).has_value());
}

/// A ray's point at rest is what a hand takes hold of, also of a piece.
TEST(Ray, FindsWhatAHandSeizes) {
    Simulation world = simulation(free_space(), {actor(box(4, 4, 4, 0.1, material(MaterialModel::fem, 3e4)))});
    const auto hit = world.cast_ray({0.2, 0.2, 3}, {0, 0, -1});
    ASSERT_TRUE(hit && hit->body);
    Hand hand;
    hand.body = *hit->body;
    hand.point = hit->rest;
    hand.target.constant = hit->place + Vec3d(0, 0, 0.3);
    ASSERT_TRUE(world.set_hands({hand}, kOneThread).ok());
    run(world, 120);
    const auto again = world.cast_ray({0.2, 0.2, 3}, {0, 0, -1});
    ASSERT_TRUE(again && again->body);
    EXPECT_NEAR(again->place.z(), hit->place.z() + 0.3, 0.1);
}

} // namespace
} // namespace filigree
