#include "filigree/physics/step/inverted_cells.h"

#include "filigree/core/math.h"

#include <cmath>

namespace filigree {

namespace {

bool has_cells(const BodyState& body) {
    const MaterialModel model = body.body->material.model;
    return !body.is_absent && !body.rigid && (model == MaterialModel::fem || model == MaterialModel::springs);
}

void look_at_cells(const BodyState& body, InvertedCells& found) {
    const Cells& cells = body.body->cells;
    const double rest = 64 * math::pow(cells.spacing, 3); // of the sums below
    for (const std::array<Index, 8>& corners : cells.cell_corners) {
        Mat3d sides = Mat3d::Zero(); // four times the mean side along each axis
        Vec3d middle = Vec3d::Zero();
        for (unsigned c = 0; c < 8; ++c) {
            const Vec3d at = body.positions[corners[c]].cast<double>();
            middle += at / 8;
            for (unsigned axis = 0; axis < 3; ++axis) sides.col(axis) += c >> axis & 1 ? at : Vec3d(-at);
        }
        const auto ratio = float(sides.determinant() / rest);
        found.count += ratio <= 0;
        if (!(ratio < found.least)) continue;
        found.least = ratio;
        found.place = middle.cast<float>();
    }
}

} // namespace

InvertedCells inverted_cells(const SimulationState& state, std::size_t actor) {
    InvertedCells found;
    for (const BodyState& body : state.bodies)
        if (body.actor == actor && has_cells(body)) look_at_cells(body, found);
    return found;
}

} // namespace filigree
