// The poses of a driver that come closest to a mesh as it moves.
#pragma once

#include "filigree/blend/gradient_fit.h"
#include "filigree/context.h"
#include "filigree/result.h"
#include "filigree/strip.h"

#include <memory>
#include <span>
#include <vector>

namespace filigree {

/// How much a pose that fits is drawn to the driver's own motion, where the mesh says nothing of it.
struct PoseFitOptions {
    /// Weight of the gradients' prior: of a squared deviation times the vertices bound there and their squared edges.
    /// 1e-4 follows clean animations 10 % more closely, 1e-3 noisy ones.
    double prior = 1e-3;
    /// Weight of the positions' prior beside it: large numbers hold positions where the animation has them.
    double hold = 1e-3;
    /// Whether to go on without the prior as long as the animation is followed clearly better.
    bool refine = true;
};

/// Restoring is linear in the driver's positions and gradients, p' = sum b_i [c_i' + A_i d_i] with d_i = p - (m +
/// c_i) / 2, and its matrix M depends on the rest shape alone. So one factorisation of M^T M + R gives the
/// least-squares pose of every frame. R, the prior's weight, decides where M says nothing, as off a flat place.
class PoseFit {
public:
    /// The model must outlive the fit; Cost O(V), and the sparse factorisation of four
    /// unknowns a driver vertex: 0.02 s for 1,000, 0.2 s for 3,000. Errors: unsuitable (a number that is not finite),
    /// cancelled.
    static Result<PoseFit> create(const Model& model, const PoseFitOptions& options, const RunContext& context);
    PoseFit(PoseFit&&) noexcept;
    PoseFit& operator=(PoseFit&&) noexcept;
    ~PoseFit();

    /// The pose whose restored mesh is closest to `positions`, one a vertex of the model, finite and relative to the
    /// mesh's origin. Its prior: the driver where the mesh has it, with gradients estimated from these positions, and
    /// then the same of the positions fitted. Cost O(V), and a few substitutions. Same bytes for any thread count.
    /// Errors: cancelled.
    Result<Pose> fit(std::span<const Vec3f> positions, const RunContext& context) const;

private:
    struct Content;
    explicit PoseFit(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
