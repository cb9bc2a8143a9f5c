// Small scenes, and how the tests of the stepper run them.
#pragma once

#include "filigree/core/dense_solve.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

namespace filigree::simulation_scenes {

inline Material material(MaterialModel model, double young_modulus = 1e5) {
    Material material;
    material.model = model;
    material.young_modulus = young_modulus;
    material.damping = 0;
    return material;
}

inline std::shared_ptr<const Body> box(std::size_t nx, std::size_t ny, std::size_t nz, double spacing,
                                       const Material& of) {
    return std::make_shared<Body>(make_body(box_cells(nx, ny, nz, spacing), of));
}

inline World free_space() {
    World world;
    world.gravity.setZero();
    return world;
}

inline World with_ground(double restitution = 0.5) {
    World world;
    Obstacle ground;
    ground.shape = HalfSpace{};
    ground.restitution = restitution;
    world.obstacles.push_back(ground);
    return world;
}

inline Simulation simulation(World world, std::vector<Actor> actors, StepOptions options = {}, unsigned threads = 1) {
    Result<Simulation> made = Simulation::create(std::move(world), std::move(actors), options, RunContext(threads));
    EXPECT_TRUE(made.ok()) << (made ? "" : made.error().message);
    return *std::move(made);
}

inline Actor actor(std::shared_ptr<const Body> body, const Vec3d& at = Vec3d::Zero()) {
    Actor actor;
    actor.body = std::move(body);
    actor.placement.translation() = at;
    return actor;
}

inline FrameReport run(Simulation& simulation, std::size_t frames, unsigned threads = 1) {
    const RunContext context(threads);
    FrameReport last;
    for (std::size_t f = 0; f < frames; ++f) {
        Result<FrameReport> report = simulation.advance(context);
        EXPECT_TRUE(report.ok());
        last = *report;
    }
    return last;
}

inline bool all_finite(const Vectors& values) {
    for (std::size_t i = 0; i < values.size(); ++i)
        if (!values[i].allFinite()) return false;
    return true;
}

/// Largest distance of a particle from the rigid motion that fits the body's start best.
inline double shape_error(const Simulation& simulation, std::size_t body = 0) {
    const Vectors &rest = simulation.body(body).rest, &now = simulation.positions(body);
    Vec3d from = Vec3d::Zero(), to = Vec3d::Zero(); // the means
    for (std::size_t i = 0; i < rest.size(); ++i) {
        from += rest[i].cast<double>() / double(rest.size());
        to += now[i].cast<double>() / double(rest.size());
    }
    Mat3d covariance = Mat3d::Zero();
    for (std::size_t i = 0; i < rest.size(); ++i)
        covariance += (now[i].cast<double>() - to) * (rest[i].cast<double>() - from).transpose();
    const auto [u, v, s, converged] = singular_values(covariance);
    const Vec3d handed(1, 1, u.determinant() * v.determinant() < 0 ? -1 : 1); // never a reflection
    const Mat3d turn = u * handed.asDiagonal() * v.transpose();
    double largest = converged ? 0 : std::numeric_limits<double>::infinity(); // where something is not finite
    for (std::size_t i = 0; i < rest.size(); ++i)
        largest = std::max(largest, (turn * (rest[i].cast<double>() - from) - (now[i].cast<double>() - to)).norm());
    return largest;
}

inline const auto kModels = testing::Values(MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree);
inline std::string model_name(const testing::TestParamInfo<MaterialModel>& info) {
    return std::array{"fem", "springs", "meshfree"}[std::size_t(info.param)];
}

} // namespace filigree::simulation_scenes
