// Softness that is painted on a mesh: where it is 1, the body's stiffness is multiplied by a number.
#pragma once

#include "document.h"

namespace filigree::studio {

/// The scalar of a mesh that holds it in files, 0 .. 1; scenes take it by `from = "scalar softness"`.
inline constexpr const char* kSoftnessScalar = "softness";

/// Of the state's mesh, one a vertex; null: none is painted, or it was of another mesh.
std::shared_ptr<const std::vector<float>> softness_of(const State& state);
/// What a mesh of a file says; null: nothing.
std::shared_ptr<const std::vector<float>> softness_in(const Mesh& mesh);
/// The mesh with the state's softness as a scalar, where it has as many vertices or more; they have 0.
Mesh with_softness(Mesh mesh, const State& state);

/// One stroke of the brush: more within `radius` of a vertex, most in its middle; or, taken away, less.
std::vector<float> painted(const Mesh& mesh, std::vector<float> softness, Index vertex, double radius, bool takes_away);

/// The body with the state's softness in it. Errors: those of spread_inwards.
Result<std::shared_ptr<const DroppedBody>> softened(std::shared_ptr<const DroppedBody> made, const State& state,
                                                    const RunContext& context);

} // namespace filigree::studio
