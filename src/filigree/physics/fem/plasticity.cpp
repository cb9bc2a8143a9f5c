// Based on:
//   [Simo 1992] Algorithms for static and dynamic multiplicative plasticity that preserve the classical return mapping
//   schemes of the infinitesimal theory: the return map in logarithms of the principal stretches. Ours needs the right
//   stretch alone: with Fe = U s V^T, the flow multiplies Fe from the right by V (s' / s) V^T.
#include "filigree/physics/fem/plasticity.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>

namespace filigree {

FlowLaw yield_law(const Material& material, float dt) {
    const double shear = lame_parameters(material.young_modulus, material.poisson_ratio).mu;
    FlowLaw law{float(std::sqrt(2 / 3.) * material.yield_stress / (2 * shear)), 1};
    if (material.creep_time > 0) law.yield_rate = float(-math::expm1(-double(dt) / material.creep_time));
    return law;
}

void symmetric_eigen(const Mat3f& matrix, Vec3f& values, Mat3f& vectors) {
    constexpr int kMostSweeps = 8;       // 4 are usual
    constexpr float kConverged = 1e-14f; // squares off the diagonal over those on it
    float a[3][3], v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) a[i][j] = matrix(i, j);
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
        const float off = a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2];
        const float on = a[0][0] * a[0][0] + a[1][1] * a[1][1] + a[2][2] * a[2][2];
        if (!(off > kConverged * on)) break;
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (a[p][q] == 0) continue;
                const float theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const float t = (theta >= 0 ? 1.f : -1.f) / (std::abs(theta) + std::sqrt(theta * theta + 1));
                const float c = 1 / std::sqrt(t * t + 1), s = t * c;
                const int r = 3 - p - q;
                const float rp = a[r][p], rq = a[r][q], pq = a[p][q];
                a[p][p] -= t * pq;
                a[q][q] += t * pq;
                a[p][q] = a[q][p] = 0;
                a[r][p] = a[p][r] = c * rp - s * rq;
                a[r][q] = a[q][r] = s * rp + c * rq;
                for (auto& row : v) {
                    const float vp = row[p], vq = row[q];
                    row[p] = c * vp - s * vq;
                    row[q] = s * vp + c * vq;
                }
            }
    }
    for (int i = 0; i < 3; ++i) {
        values[i] = a[i][i];
        for (int j = 0; j < 3; ++j) vectors(i, j) = v[i][j];
    }
}

bool flow(const Mat3f& elastic, const FlowLaw& law, Mat3f& R, float* kept_part) {
    const Mat3f C = elastic.transpose() * elastic;
    if (!(C.squaredNorm() < 1e18f)) return false; // not finite, or beyond what floats can square again

    // |dev log s| is half of |dev log C|, and log is no steeper than at C's least eigenvalue.
    const float mean = C.trace() / 3;
    const float deviation = (C - mean * Mat3f::Identity()).norm();
    const float least = mean - deviation * 0.8165f; // of three numbers with this mean and deviation
    const float yields_at =
        law.beside > 0 ? std::sqrt(std::max(law.yield_strain * law.yield_strain - law.beside, 0.0f)) : law.yield_strain;
    if (least > 0 && deviation < 2 * least * yields_at && least > kLeastStretch * kLeastStretch) return false;

    Vec3f values;
    Mat3f V;
    symmetric_eigen(C, values, V);
    Vec3f log_old, log_new;
    for (int a = 0; a < 3; ++a) {
        log_old[a] = 0.5f * math::log(std::max(values[a], 1e-12f));
        log_new[a] = std::max(log_old[a], math::log(kLeastStretch));
    }
    const float volume = log_new.sum() / 3;
    Vec3f deviator = log_new - Vec3f::Constant(volume);
    const float size = std::sqrt(deviator.squaredNorm() + law.beside);
    float kept = 1;
    if (size > law.yield_strain) kept *= 1 - law.yield_rate * (1 - law.yield_strain / size);
    if (kept == 1 && log_new == log_old) return false;
    if (kept_part) *kept_part = kept;
    deviator *= kept;
    Vec3f ratio;
    for (int a = 0; a < 3; ++a) ratio[a] = math::exp(volume + deviator[a] - log_old[a]);
    R = V * ratio.asDiagonal() * V.transpose();
    return true;
}

} // namespace filigree
