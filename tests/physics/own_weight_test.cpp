#include "filigree/physics/body/own_weight.h"

#include "filigree/mesh.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/material.h"
#include "filigree/physics/simulation.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

namespace filigree::own_weight_test {
namespace {

const Vec3d kDown(0, -9.81, 0);

Material named(std::string_view name) {
    return std::ranges::find(named_materials(), name, &NamedMaterial::name)->material;
}

Body body_of(const Material& material, double size) {
    BodyOptions options;
    options.size = size;
    options.cells.count = 200;
    return make_body(make_bar({.resolution = 4, .length = 2}), material, options, kOneThread).value();
}

TEST(OwnWeight, IsDensityTimesGravityTimesHeightByStiffness) {
    const Body body = body_of(named("soft-rubber"), 1); // lies: 1 x 0.5 x 0.5 m
    const OwnWeight lies = own_weight(body, Mat3d::Identity(), kDown);
    EXPECT_NEAR(lies.height, 0.5, 0.02);
    EXPECT_NEAR(lies.mass, 1100 * 0.25, 5);
    EXPECT_NEAR(lies.strain, 1100 * 9.81 * 0.5 / 1e5, 0.003);
    EXPECT_FALSE(lies.is_too_much());
    const Mat3d upright = Eigen::AngleAxisd(std::numbers::pi / 2, Vec3d::UnitZ()).toRotationMatrix();
    EXPECT_NEAR(own_weight(body, upright, kDown).height, 1, 0.03);
    EXPECT_EQ(own_weight(body, upright, Vec3d::Zero()).strain, 0);
}

TEST(OwnWeight, BeyondAFifthWhatWouldDoIsSaid) {
    const auto of = [](const Material& material, double size) {
        return own_weight(body_of(material, size), Mat3d::Identity(), kDown);
    };
    const Material jelly = named("jelly");
    const double limit = 0.2 * 2e4 / (1000 * 9.81); // m high
    EXPECT_EQ(of(jelly, 2 * 0.95 * limit).sentence("it"), "");
    EXPECT_TRUE(of(jelly, 2 * 1.05 * limit).is_too_much());
    const OwnWeight large = of(jelly, 4);
    EXPECT_EQ(large.sentence("it"), "is 2 m high and weighs 16 t; it of that size cannot carry itself");
    // What is proposed holds.
    EXPECT_FALSE(of(jelly, large.size_that_does(4)).is_too_much());
    Material stiffer = jelly;
    stiffer.young_modulus = large.modulus_that_does();
    EXPECT_FALSE(of(stiffer, 4).is_too_much());
}

TEST(OwnWeight, WhatIsRigidOrFlowsIsNotAsked) {
    for (const char* name : {"stone", "lava"})
        EXPECT_FALSE(own_weight(body_of(named(name), 100), Mat3d::Identity(), kDown).is_too_much()) << name;
    Material cold = named("lava");
    cold.temperature = 900;
    EXPECT_TRUE(own_weight(body_of(cold, 100), Mat3d::Identity(), kDown).is_too_much());
    for (const MaterialModel model :
         {MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree, MaterialModel::mpm}) {
        Material soft = named("jelly");
        soft.model = model;
        EXPECT_TRUE(own_weight(body_of(soft, 10), Mat3d::Identity(), kDown).is_too_much());
    }
}

TEST(BodySize, IsTheLongestSideAndNotBesideAScale) {
    const Body body = body_of(named("rubber"), 0.3);
    EXPECT_NEAR(body.scale, 0.3 / 2, 1e-7);
    const auto refused = [](double scale, double size, const Mesh& mesh) {
        BodyOptions options;
        options.scale = scale;
        options.size = size;
        const Result<Body> made = make_body(mesh, {}, options, kOneThread);
        return made ? std::string() : made.error().message;
    };
    const Mesh bar = make_bar({.resolution = 2});
    EXPECT_NE(refused(2, 1, bar).find("scale or size, not both"), std::string::npos);
    for (const double size : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::nan("")})
        EXPECT_NE(refused(1, size, bar).find("above 0"), std::string::npos) << size;
}

/// A cube of which some cells are turned inside out by hand.
TEST(InvertedCells, AreCountedWithTheWorstOnesPlace) {
    const auto body = std::make_shared<const Body>(make_body(box_cells(4, 4, 4, 0.25), named("rubber")));
    World world;
    world.gravity = Vec3d::Zero();
    Simulation simulation = Simulation::create(world, {Actor{body}}, {}, kOneThread).value();
    EXPECT_EQ(simulation.inverted(0).count, 0U);
    EXPECT_NEAR(simulation.inverted(0).least, 1, 1e-5);
    Vectors positions = simulation.positions(0);
    for (std::size_t i = 0; i < positions.size(); ++i) {
        Vec3f p = positions[i];
        if (p.x() > 0.9f) p.x() = 0.5f; // beyond the layer of corners at 0.75
        positions.set(i, p);
    }
    ASSERT_TRUE(simulation.set_positions(0, positions));
    const InvertedCells found = simulation.inverted(0);
    EXPECT_EQ(found.count, 16U);
    EXPECT_NEAR(found.least, -1, 1e-4);
    EXPECT_NEAR(double(found.place.x()), 0.625, 1e-5);
}

TEST(ClampedParticles, AreReportedWithBodyAndPlace) {
    const auto body = std::make_shared<const Body>(make_body(box_cells(2, 2, 2, 0.25), named("rubber")));
    Actor far{body};
    far.placement.translation() = Vec3d(5, 7, 0);
    World world;
    world.gravity = Vec3d::Zero();
    StepOptions options;
    options.mode = StepMode::explicit_steps;
    Simulation simulation = Simulation::create(world, {Actor{body}, far}, options, kOneThread).value();
    EXPECT_EQ(simulation.advance(kOneThread)->clamped_particles, 0U);
    Vectors positions = simulation.positions(1);
    positions.set(3, Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
    ASSERT_TRUE(simulation.set_positions(1, positions));
    const FrameReport report = simulation.advance(kOneThread).value();
    EXPECT_GE(report.clamped_particles, 1U);
    EXPECT_EQ(report.clamped_body, 1U);
    EXPECT_LT((report.clamped_at - Vec3f(5, 7, 0)).norm(), 1.0f);
    EXPECT_EQ(simulation.advance(kOneThread)->clamped_particles, 0U);
}

} // namespace
} // namespace filigree::own_weight_test
