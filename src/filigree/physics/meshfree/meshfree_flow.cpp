#include "filigree/physics/meshfree/meshfree_flow.h"

#include "filigree/core/parallel_for.h"
#include "filigree/core/smoothstep.h"
#include "filigree/physics/fem/plasticity.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace filigree::meshfree {

namespace {

constexpr std::size_t kMeshfreeFlowGrain = 256;
constexpr float kFlowToRenew = 0.5f;       // |G|^2 - 3 of the flow G since the last renewal: a stretch by 1.45
constexpr float kMostFlowMeasured = 2.5f;  // ... of any single particle
constexpr float kSlipToRenew = 0.5f;       // spacings: of a neighbour from where F says
constexpr std::size_t kShareToRenew = 100; // renew when one particle of this many is distorted
constexpr double kMostHeatSteps = 16;
constexpr float kLeastSolid = 0.2f;      // volume ratio: below it what is renewed forgets its shape ...
constexpr float kLeastMelt = 0.8f;       // ... and a melt does
constexpr float kMostCorrection = 0.02f; // of a volume ratio, a renewal

/// Of a pair, m: V / sum of weights over the mean square of offsets is the Laplacian's scale; both ends' mean.
float conductance(const Body& body, const MlsNeighbours& neighbours, std::size_t i, std::size_t k) {
    const auto scale = [&](std::size_t p) {
        const auto& m = neighbours.inverse_moment[p];
        return body.volume[p] * (m[0] + m[1] + m[2]) * (2 / 3.f);
    };
    return 0.5f * neighbours.pairs[k][3] * (scale(i) + scale(neighbours.neighbours[k]));
}

} // namespace

Flow::Flow(const Body& body) : body_(body) {
    const Material& material = body.material;
    const LameParameters lame = lame_parameters(material.young_modulus, material.poisson_ratio);
    shear_ = float(lame.mu);
    // Stress of the melt relaxes within a few substeps, not within one: then the stepper follows its viscosity.
    melt_shear_ = float(std::clamp(material.viscosity / 2e-3, 0.003 * lame.mu, 0.1 * lame.mu));
    if (!material.is_plastic() && !material.melts()) return;
    stored_.assign(body.particle_count(), Mat3f::Identity());
    renewed_ = stored_;
    temperature_.assign(body.particle_count(), float(material.temperature));
}

float Flow::melted(std::size_t i) const {
    const Material& material = body_.material;
    return material.melts() ? float(smoothstep(material.melting_from, material.melting_to, double(temperature_[i])))
                            : 0;
}

float Flow::shear_modulus(std::size_t i) const { return is_active() ? shear_modulus_of(melted(i)) : shear_; }

void Flow::move_heat(const MlsNeighbours& neighbours, float dt, const RunContext& context) {
    const std::size_t n = body_.particle_count();
    const Material& material = body_.material;
    if (!material.melts()) return;
    if (material.conductivity > 0) {
        std::vector<float> next(n);
        // On a lattice the second moment of the weights makes the sum below at most about 6 / h^2 a particle.
        const double limit = 0.1 * body_.spacing() * body_.spacing() / material.conductivity;
        const double steps = std::min(std::ceil(double(dt) / limit), kMostHeatSteps);
        const float step = float(std::min(double(dt) / steps, limit) * material.conductivity);
        for (int s = 0; s < int(steps); ++s) {
            parallel_for(context, n, kMeshfreeFlowGrain, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    double gain = 0;
                    for (std::size_t k = neighbours.offsets[i]; k < neighbours.offsets[i + 1]; ++k) {
                        const Index j = neighbours.neighbours[k];
                        gain += double(conductance(body_, neighbours, i, k) * (temperature_[j] - temperature_[i]));
                    }
                    next[i] = temperature_[i] + step * float(gain) / body_.volume[i];
                }
            });
            temperature_.swap(next);
        }
    }
    for (std::size_t i = 0; i < n; ++i)
        temperature_[i] += float(material.heating * double(dt)) * neighbours.exposure[i];
}

bool Flow::move_matter(const MlsNeighbours& neighbours, const Float4* position, float dt, const RunContext& context) {
    const std::size_t n = body_.particle_count();
    std::vector<std::array<std::size_t, 2>> distorted((n + kMeshfreeFlowGrain - 1) / kMeshfreeFlowGrain);
    parallel_for(context, n, kMeshfreeFlowGrain, [&](std::size_t begin, std::size_t end) {
        std::array<std::size_t, 2> counts = {0, 0};
        for (std::size_t i = begin; i < end; ++i) {
            const float amount = flow_particle(neighbours, position, i, dt);
            counts[0] += amount > kFlowToRenew;
            counts[1] += amount > kMostFlowMeasured;
        }
        distorted[begin / kMeshfreeFlowGrain] = counts;
    });
    std::array<std::size_t, 2> total = {0, 0};
    for (const auto& counts : distorted)
        for (std::size_t a = 0; a < 2; ++a) total[a] += counts[a];
    return total[0] > n / kShareToRenew || total[1] > 0;
}

/// Flow of one particle; how far it has flowed since the last renewal, |G|^2 - 3.
float Flow::flow_particle(const MlsNeighbours& neighbours, const Float4* position, std::size_t i, float dt) {
    const Material& material = body_.material;
    const float part = melted(i), shear = shear_modulus_of(part);
    FlowLaw law{std::numeric_limits<float>::infinity(), 1, 0};
    if (material.is_plastic()) {
        law.yield_strain = float(std::sqrt(2 / 3.) * material.yield_stress / (2 * double(shear)));
        if (material.creep_time > 0) law.yield_rate = float(-std::expm1(-double(dt) / material.creep_time));
    }
    if (part > 0) law.relaxation = float(-std::expm1(-double(dt) * double(part * shear) / material.viscosity));
    const Columns F = gather_gradient(neighbours, position, i);
    Mat3f R;
    if (!filigree::flow(to_matrix(F) * stored_[i], law, R)) return 0;
    const float before = stored_[i].determinant();
    Mat3f after = stored_[i] * R;
    const float change = R.determinant(); // 1 but for rounding, which would add up; or a stretch was clamped
    if (std::abs(change - 1) < 1e-3f) {
        const float ratio = before / after.determinant();
        if (std::isfinite(ratio)) after *= std::cbrt(ratio);
    }
    if (!after.allFinite()) return 0;
    stored_[i] = after;
    const Mat3f G = renewed_[i].inverse() * after;
    float amount = G.squaredNorm() / std::pow(std::abs(G.determinant()), 2 / 3.f) - 3;
    for (std::size_t k = neighbours.offsets[i]; k < neighbours.offsets[i + 1] && part > 0; ++k) {
        const Float4 pair = neighbours.pairs[k];
        const Float4 slip = pair[3] * (position[neighbours.neighbours[k]] - position[i]) - times(F, pair);
        const float most = kSlipToRenew * float(body_.spacing()) * pair[3];
        if (dot3(slip, slip) > most * most) amount = std::max(amount, 1.01f * kFlowToRenew);
    }
    return std::isfinite(amount) ? amount : 0;
}

void Flow::take_gradients(const MlsNeighbours& neighbours, const Float4* position, const RunContext& context) {
    parallel_for(context, stored_.size(), kMeshfreeFlowGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            stored_[i] = to_matrix(gather_gradient(neighbours, position, i)) * stored_[i];
    });
}

void Flow::begin_anew(const MlsNeighbours& neighbours, const RunContext& context) {
    correct_volume(neighbours, context);
    renewed_ = stored_;
}

/// A neighbourhood that was crushed flat or turned inside out is a round one from now on: remembered as it was, it
/// would push its neighbours away for ever. And of melts the product of gradients over many renewals drifts from the
/// volume there is. Inside, and wherever particles are denser than at the start, the kernel's sum tells how far. At its
/// surface a melt bears no tension (drops come apart).
void Flow::correct_volume(const MlsNeighbours& neighbours, const RunContext& context) {
    parallel_for(context, body_.particle_count(), kMeshfreeFlowGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const float part = melted(i), exposure = neighbours.exposure[i], J = stored_[i].determinant();
            const bool is_solid = !(part > 0);
            if (is_solid && J > kLeastSolid) continue;
            float there = std::clamp(1 / neighbours.density[i], kLeastMelt, 1 / kLeastMelt);
            if (exposure > 0) there = std::min(there, 1.f);
            if (is_solid || !(J > kLeastMelt)) {
                stored_[i] = Mat3f::Identity() * std::cbrt(there);
                continue;
            }
            if (there > J && exposure > 0) there = std::min(J, 1.f);
            const float change = std::clamp(there - J, -kMostCorrection, kMostCorrection);
            stored_[i] *= std::cbrt((J + part * change) / J);
        }
    });
}

bool Flow::remember(Memory memory) {
    const std::size_t n = stored_.size();
    if (memory.stored.size() != n || memory.renewed.size() != n || memory.temperature.size() != n) return false;
    stored_ = std::move(memory.stored);
    renewed_ = std::move(memory.renewed);
    temperature_ = std::move(memory.temperature);
    return true;
}

} // namespace filigree::meshfree
