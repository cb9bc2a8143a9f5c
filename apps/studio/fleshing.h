// A character that joints move as soft matter, and what became of it.
#pragma once

#include "workbench.h"

namespace filigree::studio {

/// The state with the clip of its recording's animation as flesh: the bind pose is its mesh, a driver follows the
/// flesh, and the original is plain skinning. The animation is of a glTF with a skin. Errors: those of read_skin,
/// Flesh::create, simulate_flesh, fit_animation.
Result<State> fleshed_state(State state, const FleshSettings& settings, const RunContext& context);

/// Of a recording that is flesh: a sentence, and rows of names and values (rich text).
QString flesh_summary(const Recording& recording);
QString flesh_table(const Recording& recording);
/// What a user would change; "": nothing.
QString flesh_advice(const Recording& recording);

} // namespace filigree::studio
