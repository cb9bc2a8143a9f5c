// Particles' values (temperature, renewal) at points between them.
#pragma once

#include "filigree/core/parallel_for.h"
#include "filigree/mesh.h"

#include <array>
#include <span>
#include <vector>

namespace filigree {

/// The four nearest particles of each point, and their weights. Never changes once made.
class MatterAtPoints {
public:
    MatterAtPoints() = default;
    /// spacing: between particles, above 0. A point farther than 60 spacings from all has no value. Cancelled, the
    /// points left over have none. Cost O(points + particles).
    MatterAtPoints(std::span<const Vec3f> points, const std::vector<Vec3f>& particles, double spacing,
                   const RunContext& context);

    std::size_t size() const { return near_.size(); }
    /// The weighted mean of the values of its particles. values: one a particle. nowhere: returned where a point has
    /// no particles.
    template <class T>
    T at(std::size_t point, std::span<const T> values, T nowhere) const {
        const Near& near = near_[point];
        T sum = nowhere * 0.0f;
        for (std::size_t k = 0; k < 4; ++k) sum += near.shares[k] * values[near.particles[k]];
        return near.shares[0] > 0 ? sum : nowhere;
    }

private:
    struct Near {
        std::array<Index, 4> particles{};
        std::array<float, 4> shares{};
    };
    std::vector<Near> near_;
};

/// The colour of each particle: of the mesh's vertices nearest to it; none where the mesh has no colours. The mesh
/// is not checked. points: its vertices where the particles are.
std::vector<Vec4f> matter_colors(const Mesh& mesh, const std::vector<Vec3f>& points, std::span<const Vec3f> particles,
                                 double spacing, const RunContext& context);

} // namespace filigree
