#include "filigree/hierarchy/law.h"

#include <algorithm>
#include <cmath>

namespace filigree {

double law_scale(Law law, double rest_area, double area) {
    if (!(rest_area > 0)) return 1;
    const double ratio = area / rest_area;
    const auto bounded = [](double s) {
        return std::clamp(s, 1.0 / kMaxLawScale, double{kMaxLawScale}); // also for ratio = 0, where s is infinite
    };
    switch (law) {
    case Law::keep:
        return 1;
    case Law::inverse:
        return bounded(1 / std::sqrt(ratio));
    case Law::proportional:
        return std::sqrt(ratio);
    case Law::volume:
        return bounded(1 / ratio);
    }
    return 1;
}

} // namespace filigree
