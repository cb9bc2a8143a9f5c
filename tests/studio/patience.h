// How long a test of the studio waits for what has to come.
#pragma once

namespace filigree::studio {

inline constexpr int kPatience = 20'000; // ms

} // namespace filigree::studio
