// A character that joints move as soft matter, and what became of it.
#pragma once

#include "workbench.h"

namespace filigree::studio {

/// The state with all clips of its recording's file as flesh: the bind pose is its mesh, one driver follows the flesh
/// of all, and the original is plain skinning. The recording is that of the clip shown. The animation is of a glTF with
/// a skin. Errors: those of read_skin, Flesh::create, simulate_flesh, fit_flesh.
Result<State> fleshed_state(State state, const FleshSettings& settings, const RunContext& context);

/// The recording of another of the clips, by its number in the file; null: it does not move, and has no flesh.
std::shared_ptr<const Recording> recording_of_clip(const std::shared_ptr<const FleshedClips>& clips,
                                                   std::size_t number);

/// Of a recording that is flesh: a sentence, and rows of names and values (rich text).
QString flesh_summary(const Recording& recording);
QString flesh_table(const Recording& recording);
/// What a user would change; "": nothing.
QString flesh_advice(const Recording& recording);

} // namespace filigree::studio
