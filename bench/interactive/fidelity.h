// How close restored detail comes to deforming the whole mesh, beside what others do with the same driver.
#pragma once

#include "filigree/reference.h"
#include "filigree/strip.h"

#include <string>
#include <vector>

namespace filigree::bench {

/// One method under one warp, against warping every vertex.
struct FidelityRow {
    std::string method; ///< wrap, skinning, reference, blend_positions or blend_gradients
    std::string warp;
    bool affine = false;
    double rms = 0, max = 0;   ///< fractions of the deformed mesh's diagonal
    double normal_p95_deg = 0; ///< angle between vertex normals, 95th percentile
};

/// Geometric means over the affine or the curved warps of one method; errors below 1e-7 count as 1e-7.
struct FidelitySummary {
    std::string method;
    double affine_rms = 0, curved_rms = 0, curved_normal_p95_deg = 0;
};

/// reference: null, or a model of the same mesh by the report's method. The warps are those of
/// docs/benchmarks.md, along the longest side of the box. When cancelled, the rows so far.
std::vector<FidelityRow> measure_fidelity(const Model& model, const ReferenceModel* reference,
                                          const RunContext& context);
/// What a wrap deformer makes of a blend model's driver: each vertex carried along in the frame of its cell.
std::vector<Vec3f> wrap_positions(const Model& model, const Pose& pose, const RunContext& context);
std::vector<FidelitySummary> summarise(const std::vector<FidelityRow>& rows);

} // namespace filigree::bench
