// Has a type and an inline function whose names mesh/two.h has too: scripts/unique-names has to notice.
#pragma once

namespace filigree {

struct Twin {
    double a = 0;
};

inline double measure(const Twin& twin) { return twin.a; }
inline double measure(double other) { return other; } // other parameters: another function

} // namespace filigree
