#include "filigree/blend/driver_search.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kFirstDriver = 1000;
constexpr double kOrder = 1.3;        // the error falls about as fast as this power of the driver's vertices grows
constexpr double kCloseEnough = 1.15; // ratio of the smallest driver that passed to the largest that did not

} // namespace

std::size_t DriverSearch::first() const { return static_cast<std::size_t>(std::min(double(kFirstDriver), most_)); }

void DriverSearch::add(std::size_t size, double error) {
    Tried& side = error <= goal_ ? passed_ : failed_;
    side = {double(size), std::max(error, 1e-12)};
}

bool DriverSearch::is_done() const {
    return passed_.size > 0 && (passed_.size <= double(kSmallest) || passed_.size / failed_.size < kCloseEnough);
}

std::size_t DriverSearch::next() const {
    double size;
    if (passed_.size > 0 && passed_.size < most_ && failed_.size > 0) {
        const double slope = math::log(passed_.error / failed_.error) / math::log(passed_.size / failed_.size);
        size = failed_.size * math::pow(0.9 * goal_ / failed_.error, 1 / std::min(slope, -0.1));
        size = std::clamp(size, failed_.size * 1.07, passed_.size / 1.07);
    } else { // the whole mesh has no error that a power law could go through
        const Tried& one = failed_.size > 0 ? failed_ : passed_;
        size = one.size * std::clamp(math::pow(one.error / (0.8 * goal_), 1 / kOrder), 0.1, 10.0);
        if (failed_.size > 0) size = std::max(size, failed_.size * 1.3);
        if (passed_.size > 0) size = std::min(size, passed_.size / (failed_.size > 0 ? 1.07 : 1.3));
    }
    return static_cast<std::size_t>(std::clamp(std::round(size), double(kSmallest), most_));
}

} // namespace filigree
