#include "filigree/render/level_choice.h"

#include <algorithm>
#include <utility>

namespace filigree {

unsigned level_by_size(std::span<const LevelFacts> levels, unsigned finest, unsigned now, double pixels_a_unit) {
    const auto coarsest_below = [&](double pixels) {
        for (unsigned level = 0; level < finest; ++level)
            if (levels[level].deviation && *levels[level].deviation * pixels_a_unit <= pixels) return level;
        return finest;
    };
    const unsigned wanted = coarsest_below(kUnseenPixels);
    if (now >= finest || wanted <= now) return wanted; // coarser is taken as soon as it is as good
    return coarsest_below(kUnseenPixels * kHysteresis) <= now ? now : wanted;
}

void DrawingCost::Line::learn(double ms, double amount) {
    constexpr double kNew = 0.25;
    const double weight = known ? kNew : 1;
    milliseconds += weight * (ms - milliseconds);
    millions += weight * (amount - millions);
    known = true;
}

double DrawingCost::Line::at(double amount) const {
    // Some of the time is the picture's, whatever it shows: of the pictures seen so far, that much.
    constexpr double kLeastMillions = 0.02;
    if (!known) return 0;
    return milliseconds * (amount + kLeastMillions) / (millions + kLeastMillions);
}

void DrawingCost::learn_drawing(double milliseconds, std::size_t triangles) {
    drawing_.learn(milliseconds, 1e-6 * static_cast<double>(triangles));
}
void DrawingCost::learn_restoring(double milliseconds, std::size_t vertices) {
    restoring_.learn(milliseconds, 1e-6 * static_cast<double>(vertices));
}

double DrawingCost::expected(const LevelFacts& level, bool pose_changes) const {
    return drawing_.at(1e-6 * static_cast<double>(level.triangles)) +
           (pose_changes ? restoring_.at(1e-6 * static_cast<double>(level.vertices)) : 0);
}

unsigned level_to_keep_up(std::span<const LevelFacts> levels, unsigned finest, unsigned now, const DrawingCost& cost,
                          bool pose_changes, double budget) {
    unsigned fitting = finest;
    while (fitting > 0 && cost.expected(levels[fitting], pose_changes) > budget) --fitting;
    if (now <= finest && fitting < now && cost.expected(levels[now], pose_changes) <= kHysteresis * budget) return now;
    return fitting;
}

void LevelChange::start(unsigned to, double now) {
    if (to == to_) return;
    if (from_ && *from_ == to) { // back again: the same way
        std::swap(*from_, to_);
        part_ = 1 - part_;
        started_ = now - part_ * kSeconds;
        return;
    }
    if (!from_ || part_ >= 0.5) from_ = to_;
    to_ = to;
    part_ = 0;
    started_ = now;
}

void LevelChange::set(unsigned level) {
    to_ = level;
    from_.reset();
    part_ = 1;
}

bool LevelChange::advance(double now) {
    if (!from_) return false;
    const double next = part_ + kMostStep;
    part_ = std::clamp((now - started_) / kSeconds, 0.0, 1.0);
    if (part_ > next) {
        part_ = next;
        started_ = now - part_ * kSeconds;
    }
    if (part_ >= 1) from_.reset();
    return from_.has_value();
}

} // namespace filigree
