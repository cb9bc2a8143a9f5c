// The matter of particles as a field: smooth, above 0 inside, and of the particles' volume.
#pragma once

#include "filigree/context.h"
#include "filigree/melting/block_grid.h"
#include "filigree/physics/simulation.h"

namespace filigree {

struct ParticleFieldOptions {
    double cell = 0.8;                ///< of the grid, in spacings of particles; 0.2 to 4
    Vec3d shift = {0.37, 0.41, 0.29}; ///< of the grid, in cells
};

struct ParticleField {
    static constexpr float kOutside = -0.5f; ///< value where no block is
    BlockGrid grid;
    std::vector<float> values; ///< a slot; about 0.5 deep inside, kOutside far outside, 0 on the surface
    double offset = 0;         ///< m, by which the surface was moved outward so that its volume is the particles'
    double volume = 0;         ///< m^3, of the particles

    float value(const Vec3f& at, Vec3f* gradient = nullptr) const {
        return interpolate(grid, values, kOutside, at.cast<double>(), gradient);
    }
    /// Outward, unit; zero where the field is flat.
    Vec3f normal(const Vec3f& at) const;
};

/// Anisotropic kernels [Yu and Turk 2013] over a block grid; then the surface is moved along its normals until it
/// encloses the particles' volume, as kernels alone lose a tenth. A few particles alone are balls. No particles: an
/// empty field. The same bytes for any number of threads. Cost: O(particles), docs/melting.md has it.
/// Errors: usage (arrays of different lengths, numbers that are not finite or not above 0, a cell out of range),
/// unsuitable (particles so far away that their coordinates do not tell spacings apart), cancelled.
Result<ParticleField> make_particle_field(const MatterParticles& particles, const ParticleFieldOptions& options,
                                          const RunContext& context);

} // namespace filigree
