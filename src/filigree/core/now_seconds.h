// The clock that reports of durations are taken from.
#pragma once

#include <chrono>

namespace filigree {

/// s, since some moment; never goes back.
inline double now_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

} // namespace filigree
