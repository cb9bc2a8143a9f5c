#include "filigree/scene/recording.h"

#include <algorithm>

namespace filigree {

void RunTotals::add(const FrameReport& report) {
    ++frames;
    substeps += report.substeps;
    least_substeps = std::min<std::uint64_t>(least_substeps, report.substeps);
    most_substeps = std::max<std::uint64_t>(most_substeps, report.substeps);
    clamped_particles += report.clamped_particles;
    most_contacts = std::max<std::uint64_t>(most_contacts, report.contacts);
    deepest_contact = std::max(deepest_contact, report.deepest_contact);
    deepest_in_matter = std::max(deepest_in_matter, report.deepest_in_matter);
    least_volume_ratio = std::min(least_volume_ratio, report.least_volume_ratio);
    most_stretch = std::max(most_stretch, report.most_stretch);
}

void RunTimes::add(const FrameReport& report) {
    ++frames;
    elastic += report.elastic_seconds;
    contact += report.contact_seconds;
    other += report.other_seconds;
}

std::size_t hold_lost(const Pose& before, Pose& now, float far, float most_gradient) {
    std::size_t held = 0;
    for (std::size_t v = 0; v < now.positions.size(); ++v) {
        const bool is_near = (now.positions[v] - before.positions[v]).norm() <= far;
        if (is_near && now.gradients[v].norm() <= most_gradient) continue; // false for what is not a number
        now.positions[v] = before.positions[v];
        now.gradients[v] = before.gradients[v];
        ++held;
    }
    return held;
}

} // namespace filigree
