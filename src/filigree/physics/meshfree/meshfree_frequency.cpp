#include "filigree/physics/meshfree/meshfree_frequency.h"

#include "filigree/core/parallel_for.h"
#include "filigree/core/random.h"

#include <algorithm>
#include <cmath>

namespace filigree::meshfree {

namespace {

constexpr std::size_t kMeshfreeFrequencyGrain = 256;

} // namespace

float squared_frequency_over_stiffness(const Body& body, const MlsNeighbours& neighbours,
                                       std::span<const float> hourglass, LinearModuli moduli, int iterations,
                                       const RunContext& context) {
    const std::size_t n = body.particle_count();
    const float shear = moduli.shear, lambda = moduli.bulk - shear * (2 / 3.f);
    std::vector<Float4> motion(n), next(n);
    std::vector<Columns> stress(n);
    const auto component = [](std::size_t i, std::uint64_t c) { return float(random_unit(1, 3 * i + c) - 0.5); };
    for (std::size_t i = 0; i < n; ++i) motion[i] = Float4{component(i, 0), component(i, 1), component(i, 2), 0};

    const auto linear_stress = [&](std::size_t i) {
        Mat3f G = to_matrix(gather_gradient(neighbours, motion.data(), i));
        if (!neighbours.missing.empty()) G -= neighbours.missing[i];
        const Mat3f cauchy = shear * (G + G.transpose()) + lambda * G.trace() * Mat3f::Identity();
        const float z = hourglass[i] * shear;
        const auto& m = neighbours.inverse_moment[i];
        Mat3f M;
        M << m[0], m[3], m[4], m[3], m[1], m[5], m[4], m[5], m[2];
        Columns B = to_columns(body.volume[i] * cauchy * M - z * G);
        B.c[0][3] = z;
        return B;
    };
    double most = 0;
    for (int iteration = 0; iteration < iterations; ++iteration) {
        parallel_for(context, n, kMeshfreeFrequencyGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) stress[i] = linear_stress(i);
        });
        parallel_for(context, n, kMeshfreeFrequencyGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                next[i] = gather_force(neighbours, motion.data(), stress.data(), i);
        });
        double power = 0, mass = 0, largest = 0;
        for (std::size_t i = 0; i < n; ++i) {
            power -= double(dot3(next[i], motion[i]));
            mass += double(body.mass[i] * dot3(motion[i], motion[i]));
            next[i] /= -body.mass[i];
            for (int a = 0; a < 3; ++a) largest = std::max(largest, double(std::abs(next[i][a])));
        }
        if (mass > 0) most = std::max(most, power / mass);
        if (!(largest > 0)) break;
        for (std::size_t i = 0; i < n; ++i) motion[i] = next[i] * float(1 / largest);
    }
    return float(most / double(lambda + 2 * shear));
}

} // namespace filigree::meshfree
