// A body on its way: what the stepper and contacts change. Private to the layer.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/physics/elasticity.h"

namespace filigree {

struct BodyState {
    std::shared_ptr<const Body> body;
    std::unique_ptr<Elasticity> elasticity;
    Vectors positions, velocities;   ///< world, m and m/s
    Vectors forces;                  ///< N, of the last evaluation
    std::vector<float> inverse_mass; ///< 0: pinned
    std::vector<std::uint8_t> fixed; ///< 1: pinned
    float rest_rate = 0;             ///< ElasticReport::rate at rest

    // Contact: skin points against obstacles; balls just below the skin against other bodies.
    Embedding skin, balls;
    std::vector<float> skin_stiffness; ///< N/m
    float ball_radius = 0;             ///< m
};

/// Where an embedded point is, by its weights alone.
inline Vec3f embedded_point(const Embedding& embedding, std::size_t point, const Vectors& values) {
    Vec3f sum = Vec3f::Zero();
    for (Index k = embedding.offsets[point]; k < embedding.offsets[point + 1]; ++k)
        sum += embedding.weights[k] * values[embedding.particles[k]];
    return sum;
}

inline void add_to_particles(const Embedding& embedding, std::size_t point, const Vec3f& value, Vectors& values) {
    for (Index k = embedding.offsets[point]; k < embedding.offsets[point + 1]; ++k)
        values.add(embedding.particles[k], embedding.weights[k] * value);
}

} // namespace filigree
