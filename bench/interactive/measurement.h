#pragma once

#include <string>

namespace filigree::bench {

/// A speed, a time or a ratio under its name, such as "restore.float" in "vertices/s".
struct Measurement {
    std::string name;
    double value;
    std::string unit;
};

} // namespace filigree::bench
