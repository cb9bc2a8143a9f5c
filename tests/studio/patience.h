// How long a test of the studio waits for what has to come, and how much drawing it waits for.
#pragma once

namespace filigree::studio {

inline constexpr int kPatience = 20'000; // ms
inline constexpr unsigned kPasses = 6;   // of a still picture: enough to look at, soon drawn by the processor

} // namespace filigree::studio
