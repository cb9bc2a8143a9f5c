#include "filigree/reference/height_law.h"

#include <algorithm>
#include <cmath>

namespace filigree {

double height_law_scale(HeightLaw law, double rest_area, double area) {
    if (!(rest_area > 0)) return 1;
    const double ratio = area / rest_area;
    const auto bounded = [](double s) {
        return std::clamp(s, 1.0 / kMaxHeightScale, double{kMaxHeightScale}); // also for ratio = 0, where s is infinite
    };
    switch (law) {
    case HeightLaw::keep:
        return 1;
    case HeightLaw::inverse:
        return bounded(1 / std::sqrt(ratio));
    case HeightLaw::proportional:
        return std::sqrt(ratio);
    case HeightLaw::volume:
        return bounded(1 / ratio);
    }
    return 1;
}

} // namespace filigree
