#include "filigree/physics/fem/plastic_cells.h"

#include "filigree/core/math.h"
#include "filigree/physics/breaking/crack_law.h"
#include "filigree/physics/fem/cell_kernel.h"

#include <Eigen/LU>
#include <cmath>

namespace filigree {

namespace {

Mat3f linear_part(const CellSums& sums) {
    Mat3f linear;
    for (int a = 0; a < 3; ++a) linear.col(a) = sums[kLinearSums[a]];
    return linear;
}

} // namespace

CellSums cell_sums(const Vectors& positions, const std::array<Index, 8>& corners) {
    CellSums X;
    const Vec3f base = positions[corners[0]]; // so that a body far away loses no digits
    for (int c = 0; c < 8; ++c) X[c] = positions[corners[c]] - base;
    cell_kernel::transform_corners(X);
    return X;
}

CellSums PlasticCell::elastic(const CellSums& sums) const {
    const Mat3f linear = linear_part(sums), left = linear * inverse;
    CellSums result = sums;
    for (int a = 0; a < 3; ++a) result[kLinearSums[a]] = left.col(a);
    for (int b = 0; b < 4; ++b) result[kBentSums[b]] -= linear * bent[b];
    return result;
}

bool PlasticCell::is_sound() const {
    for (const Vec3f& b : bent)
        if (!b.allFinite()) return false;
    return inverse.allFinite() && std::abs(inverse.determinant() - 1) < 0.1f;
}

void yield(PlasticCell& cell, const CellSums& sums, float size, const FlowLaw& law) {
    const CellSums elastic = cell.elastic(sums);
    const Mat3f gradient = linear_part(elastic) / size;
    if (!(gradient.determinant() > kLeastYielding)) return;
    FlowLaw all = law;
    all.beside = 0;
    for (const int m : kBentSums) all.beside += 0.5f * kSumShares[m] * elastic[m].squaredNorm() / (size * size);
    Mat3f R;
    float kept = 1;
    if (!std::isfinite(all.beside) || !flow(gradient, all, R, &kept)) return;
    PlasticCell after = cell;
    after.inverse *= R;
    after.inverse /= math::cbrt(after.inverse.determinant());
    const Mat3f back = linear_part(sums).inverse();
    for (int b = 0; b < 4; ++b) after.bent[b] += (1 - kept) * (back * elastic[kBentSums[b]]);
    if (!after.is_sound()) return;
    if (flowed(after.inverse) > kMostFlowed && flowed(after.inverse) > flowed(cell.inverse)) return;
    cell = after;
}

float plastic_opening(const PlasticCell& cell, const Vec3f& normal, float spacing) {
    // With Fp the plastic gradient, a unit of the normal becomes Fp N, over a plane whose normal is along Fp^-T N.
    const Vec3f across = cell.inverse.inverse() * normal;
    const Vec3f away = (cell.inverse.transpose() * normal).stableNormalized();
    const Vec3f opened = across - away;
    return spacing * crack_law::split_traction(opened, away).size;
}

} // namespace filigree
