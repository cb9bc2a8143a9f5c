// Some of a model's vertices restored, where an error is wanted and a few per cent do.
#pragma once

#include "filigree/hierarchy/blend_code.h"
#include "filigree/strip.h"

namespace filigree {

/// Restores vertices of a blend model: all of them, or one at random from each of `most` equal pieces of their order,
/// so that no regular grid is met always in the same column. Needs nothing of the model later on.
class SampledRestorer {
public:
    /// Cost O(V).
    SampledRestorer(const Model& model, std::size_t most, const RunContext& context);

    /// Where the vertices are at rest, relative to the mesh's origin.
    const std::vector<Vec3f>& rest() const { return rest_; }
    /// Root of the mean squared distance from `truth`, model units. driver, gradients: one a driver vertex; truth: one
    /// a vertex of rest(). 0 where there are none.
    double rms_distance(std::span<const Vec3f> driver, std::span<const Mat3f> gradients, std::span<const Vec3f> truth,
                        const RunContext& context) const;

private:
    static std::vector<BlendRestorer::Item> sample(std::size_t all, std::size_t most);

    std::vector<BlendRestorer::Item> items_;
    std::vector<Vec3f> rest_;
    BlendRestorer restorer_;
};

} // namespace filigree
