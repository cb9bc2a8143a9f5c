// Wall-clock time of a block of code, added to a sum. Private to the layer.
#pragma once

#include "filigree/core/now_seconds.h"

namespace filigree {

class Stopwatch {
public:
    explicit Stopwatch(double& seconds) : seconds_(seconds) {}
    ~Stopwatch() { seconds_ += now_seconds() - start_; }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& seconds_;
    double start_ = now_seconds();
};

} // namespace filigree
