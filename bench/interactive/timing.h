// How long a call takes.
#pragma once

#include "filigree/core/now_seconds.h"

#include <functional>

namespace filigree::bench {

/// Median seconds of a call: at least five, for about 0.4 seconds.
double median_seconds(const std::function<void()>& work);
/// Seconds of a call at its quickest, of five or more in 0.2 seconds: what the machine can do when nothing else wants
/// it.
double least_seconds(const std::function<void()>& work);

} // namespace filigree::bench
