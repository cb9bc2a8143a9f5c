// How much of what takes long is tested.
#pragma once

#include <cstdlib>

/// Whether everything is wanted: all random cases, kills and actions, large meshes, the slow scene. Unless
/// FILIGREE_ALL_CASES is set (scripts/check cases does), a part of each.
inline bool all_cases() { return std::getenv("FILIGREE_ALL_CASES") != nullptr; }
