// What the fem material's loops are measured on, and their rival: the same forces in a plain loop.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/fem/cell_kernel.h"

#include <algorithm>
#include <random>

namespace filigree {

/// A box, a metre along x, with its corners shaken by a tenth of the spacing.
struct ShakenBox {
    Body body;
    Vectors positions;

    explicit ShakenBox(const std::array<std::size_t, 3>& corners) {
        const double h = 1.0 / static_cast<double>(corners[0] - 1);
        body.cells = box_cells(corners[0] - 1, corners[1] - 1, corners[2] - 1, h);
        const std::size_t count = body.cells.corners.size();
        body.rest = positions = Vectors(count);
        std::mt19937 random(1);
        std::uniform_real_distribution<float> shift(-0.1f, 0.1f);
        for (std::size_t i = 0; i < count; ++i) {
            const auto& at = body.cells.corners[i];
            const Vec3f rest = float(h) * Vec3f(at[0], at[1], at[2]);
            body.rest.set(i, rest);
            positions.set(i, rest + float(h) * Vec3f(shift(random), shift(random), shift(random)));
        }
    }
    std::size_t cell_count() const { return body.cells.cells.size(); }
};

/// Cell by cell and corner by corner, as one writes it first.
inline void plain_forces(const ShakenBox& box, Vectors& result) {
    const Body& body = box.body;
    const cell_kernel::CellMaterial m = cell_kernel::cell_material(body.material, body.cells.spacing);
    const float h = m.spacing, size = 4 * h, size3 = size * size * size;
    constexpr float kappa[] = {0, 1, 1, 2.0f / 3, 1, 2.0f / 3, 2.0f / 3, 1.0f / 3};
    for (auto* axis : {&result.x, &result.y, &result.z}) std::fill(axis->begin(), axis->end(), 0.0f);
    const auto sign = [](unsigned m_, unsigned corner) {
        return ((m_ & ~corner & 1) + (m_ & ~corner & 2) / 2 + (m_ & ~corner & 4) / 4) % 2 ? -1.0f : 1.0f;
    };
    for (std::size_t cell = 0; cell < body.cells.cells.size(); ++cell) {
        const auto& corners = body.cells.cell_corners[cell];
        Vec3f X[8];
        for (unsigned k = 1; k < 8; ++k) {
            X[k] = Vec3f::Zero();
            for (unsigned c = 0; c < 8; ++c) X[k] += sign(k, c) * box.positions[corners[c]];
        }
        float I = 0, I_bent = 0;
        for (unsigned k = 1; k < 8; ++k) {
            const float part = kappa[k] * X[k].squaredNorm() / (size * size);
            I += part;
            if (kappa[k] < 1) I_bent += part;
        }
        const float over = std::clamp(I_bent - cell_kernel::kBentFrom, 0.0f, cell_kernel::kBentMost);
        const float bent = cell_kernel::kBentStiffness * over * over; // twice the slope of bent_energy
        const Vec3f cofactor[3] = {X[2].cross(X[4]), X[4].cross(X[1]), X[1].cross(X[2])};
        const float J = X[1].dot(cofactor[0]) / size3;
        const float shear = body.cells.fraction[cell] * m.shear * h / 16, linear = shear * (1 - 1 / (I + 1));
        const float volume = body.cells.fraction[cell] * m.bulk * (J - m.rest_ratio) / 64;
        for (unsigned c = 0; c < 8; ++c) {
            Vec3f gradient = Vec3f::Zero();
            for (unsigned k = 1; k < 8; ++k)
                gradient += sign(k, c) * (linear + (kappa[k] < 1 ? shear * bent : 0)) * kappa[k] * X[k];
            for (unsigned axis = 0; axis < 3; ++axis) gradient += sign(1u << axis, c) * volume * cofactor[axis];
            result.add(corners[c], -gradient);
        }
    }
}

} // namespace filigree
