#include "timing.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <vector>

namespace filigree::bench {

double median_seconds(const std::function<void()>& work) {
    std::vector<double> seconds;
    const double start = now_seconds();
    while (seconds.size() < 5 || (now_seconds() - start < 0.4 && seconds.size() < 1000)) {
        const double begin = now_seconds();
        work();
        seconds.push_back(now_seconds() - begin);
    }
    std::nth_element(seconds.begin(), seconds.begin() + std::ptrdiff_t(seconds.size() / 2), seconds.end());
    return seconds[seconds.size() / 2];
}

double least_seconds(const std::function<void()>& work) {
    double least = std::numeric_limits<double>::infinity();
    const double start = now_seconds();
    for (int call = 0; call < 5 || now_seconds() - start < 0.2; ++call) {
        const double begin = now_seconds();
        work();
        least = std::min(least, now_seconds() - begin);
    }
    return least;
}

} // namespace filigree::bench
