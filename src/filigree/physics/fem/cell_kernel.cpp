// What the loops of cell_forces.cpp want to know of a body.
#include "filigree/physics/fem/cell_kernel.h"

#include "filigree/core/lanes.h"
#include "filigree/physics/fem/cell_lanes.h"

#include <algorithm>

namespace filigree::cell_kernel {

namespace {

constexpr std::size_t kCellsPerSlab = 512; ///< at least: with fewer, adding slabs up takes more than it gains

/// Fills layer_starts, run_layers and slabs.
void plan_slabs(Plan& plan) {
    const Cells& cells = *plan.cells;
    for (std::size_t c = 0; c < cells.corners.size(); ++c)
        if (c == 0 || cells.corners[c][2] != cells.corners[c - 1][2]) plan.layer_starts.push_back(c);
    plan.layer_starts.push_back(cells.corners.size());
    const auto layer_of = [&](Index corner) {
        return static_cast<std::size_t>(std::upper_bound(plan.layer_starts.begin(), plan.layer_starts.end(), corner) -
                                        plan.layer_starts.begin()) -
               1;
    };
    std::size_t cell_count = 0;
    for (std::size_t r = 0; r < cells.runs.size(); ++r) {
        plan.run_layers.push_back(layer_of(cells.runs[r].rows[0]));
        const bool new_layer = r == 0 || plan.run_layers[r] != plan.run_layers[r - 1];
        if (r == 0 || (new_layer && cell_count >= kCellsPerSlab)) {
            plan.slabs.push_back({r, r, plan.run_layers[r], 0});
            cell_count = 0;
        }
        cell_count += cells.runs[r].count;
        plan.slabs.back().last_run = r + 1;
        plan.slabs.back().last_layer = plan.run_layers[r] + 1;
    }
}

} // namespace

CellMaterial cell_material(const Material& material, double spacing) {
    const auto [lambda, mu] = lame_parameters(material.young_modulus, material.poisson_ratio);
    const double shear = 4.0 / 3.0 * mu, bulk = lambda + 5.0 / 6.0 * mu;
    return {static_cast<float>(spacing),
            static_cast<float>(material.density),
            static_cast<float>(shear),
            static_cast<float>(bulk),
            static_cast<float>(1 + 0.75 * shear / bulk),
            static_cast<float>(double(kCrushStiffness) * (1 + shear / bulk))};
}

Plan make_plan(const Body& body) {
    Plan plan;
    plan.cells = &body.cells;
    plan.material = cell_material(body.material, body.cells.spacing);
    plan.fraction = body.cells.fraction;
    plan.fraction.resize(plan.fraction.size() + kPadding);
    if (const BodyFields& fields = body.fields; !fields.stiffness.empty() || !fields.density.empty()) {
        const std::size_t count = body.cells.cells.size();
        plan.stiffness.assign(count, 1);
        if (!fields.stiffness.empty()) plan.stiffness = fields.stiffness;
        plan.pace = plan.stiffness;
        // A corner's mass is the sum of what its cells give it, so no cell swings faster than by itself.
        if (!fields.density.empty())
            for (std::size_t c = 0; c < count; ++c) plan.pace[c] /= fields.density[c];
        plan.stiffness.resize(count + kPadding);
        plan.pace.resize(count + kPadding);
    }
    plan_slabs(plan);
    return plan;
}

std::span<const int> lane_counts() {
    static constexpr int kCounts[] = {4, 8, 16};
    return std::span(kCounts).first(vector_width_count());
}

} // namespace filigree::cell_kernel
