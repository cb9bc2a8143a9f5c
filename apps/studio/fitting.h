// A driver that is fitted to an animation, and what that comes to.
#pragma once

#include "document.h"

namespace filigree::studio {

/// The state with the smallest driver whose restored mesh, also from a packed file, follows the recording's animation
/// within an error (rms, fraction of the diagonal). The state's source is the animation's mesh. Errors: those of
/// fit_animation and pack_model.
Result<State> fitted_state(State state, double error, const RunContext& context);

/// Of a recording that is fitted: a sentence, and rows of names and values (rich text).
QString fit_summary(const Recording& recording);
QString fit_table(const Recording& recording);

} // namespace filigree::studio
