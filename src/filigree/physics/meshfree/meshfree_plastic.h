// How the particles of a meshfree body yield. Private to the layer.
#pragma once

#include "filigree/context.h"
#include "filigree/physics/body.h"
#include "filigree/physics/meshfree/meshfree_gather.h"

namespace filigree::meshfree {

/// Of each particle the inverse D of its plastic gradient, of determinant 1. Bodies that do not yield have none.
class PlasticParticles {
public:
    explicit PlasticParticles(const Body& body);

    bool is_active() const { return !inverse_.empty(); }
    const Mat3f* inverse() const { return inverse_.empty() ? nullptr : inverse_.data(); } ///< D; null: the identity
    std::span<const Mat3f> memory() const { return inverse_; }
    /// False where it is of another body, or no plastic gradients.
    bool remember(std::vector<Mat3f> inverse);

    /// Yields over a substep, as the particles' gradients are. Crushed particles (below kLeastYielding of their volume)
    /// and those at the limit kMostFlowed keep what they have.
    void yield(const MlsNeighbours& neighbours, const Float4* position, float dt, const RunContext& context);
    std::size_t flowed_out() const; ///< particles at that limit

private:
    const Body& body_;
    std::vector<Mat3f> inverse_;
};

} // namespace filigree::meshfree
