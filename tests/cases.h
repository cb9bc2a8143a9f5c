// How much of what takes long is tested.
#pragma once

#include <cstdlib>

/// Whether all random cases, kills, actions, large meshes and slow scenes are tried (FILIGREE_ALL_CASES is set, as
/// scripts/check cases does), or a part of them.
inline bool all_cases() { return std::getenv("FILIGREE_ALL_CASES") != nullptr; }
