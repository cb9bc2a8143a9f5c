// A ball of jelly that is dropped, for tests.
#pragma once

#include "filigree/mesh.h"
#include "filigree/physics/material.h"
#include "filigree/scene/dropped_body.h"
#include "filigree/strip.h"

#include <algorithm>

namespace filigree_test {

using namespace filigree;

/// A ball of 2 model units.
inline std::shared_ptr<const Model> ball_model() {
    const Mesh ball = make_wavy_sphere({.resolution = 12, .amplitude = 0, .size = 2});
    return std::make_shared<const Model>(strip(ball, {.base = 100}, RunContext()).value().model);
}

inline DropOptions jelly() {
    DropOptions options;
    options.particles = 300;
    options.material = std::ranges::find(named_materials(), "jelly", &NamedMaterial::name)->material;
    return options;
}

inline std::shared_ptr<const DroppedBody> dropped(const DropOptions& options, const Vec3d& up = Vec3d::UnitY()) {
    return make_dropped_body(ball_model(), nullptr, {}, options, {}, up, RunContext()).value();
}

} // namespace filigree_test
