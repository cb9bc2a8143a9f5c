// How much of what takes long is tested.
#pragma once

#include <cstdlib>
#include <string_view>

/// Whether all random cases and all large meshes are wanted, or a part of them: FILIGREE_CASES=all scripts/test
inline bool all_cases() {
    const char* const wanted = std::getenv("FILIGREE_CASES");
    return wanted && std::string_view(wanted) == "all";
}
