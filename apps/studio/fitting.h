// A driver that is fitted to an animation, and what that comes to.
#pragma once

#include "document.h"

namespace filigree::studio {

/// The state with the smallest driver whose restored mesh, also from a packed file, follows the recording's animation
/// within an error (rms, fraction of the diagonal). The state's source is the animation's mesh. Errors: those of
/// fit_animation and pack_model.
Result<State> fitted_state(State state, double error, const RunContext& context);

/// Fits a driver to any animation: the state gets the model and the recording. packed_error: rms that packing may add,
/// fraction of the diagonal. Errors: those of fit_animation and pack_model.
Result<FittedMotion> fit_to(const MeshAnimation& animation, const FitOptions& options, double packed_error,
                            State& state, const RunContext& context);

/// Packs a model with its poses, and measures it against the animation that they follow. Errors: those of pack_model.
Status pack_motion(const Model& model, const PoseSequence& poses, const MeshAnimation& animation, double error,
                   FittedMotion& fitted, const RunContext& context);

/// Of a recording that is fitted: a sentence, and rows of names and values (rich text).
QString fit_summary(const Recording& recording);
QString fit_table(const Recording& recording);

} // namespace filigree::studio
