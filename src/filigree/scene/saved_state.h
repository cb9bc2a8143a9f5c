// The file that a stopped run goes on from.
#pragma once

#include "filigree/scene/recording.h"

#include <string>
#include <string_view>

namespace filigree {

/// Everything that a run needs to go on. hash: of the scene (ReadyScene). Equal runs give equal bytes.
std::string pack_state(const Recording& recording, const Simulation& simulation, std::uint64_t hash);

/// Puts a run where it was saved. On an error, recording and simulation stay as they are. recording: of a run of this
/// scene at its start. name: what errors call the state. Errors: bad_file (damaged, no state, of an older version),
/// mismatch (of another scene), usage (recorded with checks, and this run is without, or the other way round).
Status unpack_state(std::string_view bytes, const std::string& name, std::uint64_t hash, Recording& recording,
                    Simulation& simulation);

} // namespace filigree
