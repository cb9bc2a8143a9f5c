// The first thing that a ray meets. Private to the layer.
#pragma once

#include "filigree/physics/simulation.h"
#include "filigree/physics/step/simulation_state.h"

namespace filigree {

struct Ray {
    Vec3d origin, direction; ///< direction: unit
    double reach = 0;        ///< m
    Vec3d at(double distance) const { return origin + distance * direction; }
};

/// As Simulation::cast_ray.
std::optional<WorldHit> cast_ray(const Ray& ray, const SimulationState& state, std::optional<std::size_t> ignore);

} // namespace filigree
