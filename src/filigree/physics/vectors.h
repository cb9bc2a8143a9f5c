// Positions, velocities and forces of particles: an array a coordinate, so that loops run over many at once.
#pragma once

#include "filigree/core/types.h"

namespace filigree {

/// Three coordinates of many particles. Each array has kPadding zeros past its end, so that a whole vector register can
/// be read from any particle on.
struct Vectors {
    static constexpr std::size_t kPadding = 32;

    Vectors() = default;
    explicit Vectors(std::size_t count) : x(count + kPadding), y(count + kPadding), z(count + kPadding) {}

    std::size_t size() const { return x.empty() ? 0 : x.size() - kPadding; }
    Vec3f operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
    void set(std::size_t i, const Vec3f& value) {
        x[i] = value.x();
        y[i] = value.y();
        z[i] = value.z();
    }
    void add(std::size_t i, const Vec3f& value) {
        x[i] += value.x();
        y[i] += value.y();
        z[i] += value.z();
    }

    std::vector<float> x, y, z;
};

/// Whether all are numbers.
inline bool is_finite(const Vectors& values) {
    float sum = 0; // one NaN or infinity makes the sum so
    for (std::size_t i = 0; i < values.size(); ++i) sum += 0 * values.x[i] + 0 * values.y[i] + 0 * values.z[i];
    return sum == 0;
}

inline constexpr std::array kVectorAxes = {&Vectors::x, &Vectors::y, &Vectors::z};

} // namespace filigree
