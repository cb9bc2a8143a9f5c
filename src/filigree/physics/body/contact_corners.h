// Corners of cells that are not particles: of meshfree bodies, whose particles lie in the middle of their cells.
// Contact sees them as it sees the corners of others. Private to the layer.
#pragma once

#include "filigree/context.h"
#include "filigree/physics/body.h"

namespace filigree {

class ContactCorners {
public:
    /// carried: the corners (Body::corners), by so many particles; outlives this.
    ContactCorners(const Embedding& carried, std::size_t particles);

    const Vectors& positions() const { return positions_; }
    const Vectors& velocities() const { return velocities_; }
    Vectors& forces() { return forces_; } ///< N; what is added here goes to the particles with give_forces

    /// Where the particles have them. Cost O(weights).
    void place(const Vectors& positions, const Vectors& velocities, const RunContext& context);
    /// The same after one particle was moved by `way`, and became faster by `velocity`.
    void follow(Index particle, const Vec3f& way, const Vec3f& velocity);
    /// Adds the corners' forces to those of the particles, by the same weights, so that momentum and angular momentum
    /// stay what they were; and forgets them.
    void give_forces(Vectors& to, const RunContext& context);

private:
    const Embedding* carried_;
    Vectors positions_, velocities_, forces_;
    std::vector<Index> offsets_, corners_; ///< of each particle: the corners that it carries, ascending ...
    std::vector<float> weights_;           ///< ... and how far
};

} // namespace filigree
