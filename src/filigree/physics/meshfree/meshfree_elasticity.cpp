// Based on:
//   [Mueller 2004] Point based animation of elastic, plastic and melting objects: deformation gradients by moving least
//   squares, forces as the exact derivative of the particles' energies, plastic flow by strain. Theirs also melts.
//   [Smith 2018] Stable neo-Hookean flesh simulation: the energy, which recovers from collapse.
//
// Of each particle, with F its gradient from the body at rest and D = Fp^-1 the inverse of its plastic one, the elastic
// gradient is Fe = F D, and
//     E = V [mu_s/2 (I - 3) + L/2 (J - g0)^2 - mu_s/2 log((I + 1)/4)] - its value at rest
//         + z/2 sum_j s_ij |x_ij - F X_ij|^2,       I = |Fe|^2, J = det Fe.
// Moving least squares do not see a checkerboard; the last term does. It has the weights of F, so F is its minimum and
// its derivative through F vanishes. The force between two particles is then
//     f_ij = s_ij (B_i + B_j) X_ij + s_ij (z_i + z_j) x_ij,   B = V P D^T M^-1 - z F,
// which each particle sums up over its own neighbours: no scatter, and momentum to the last bit of each pair.
// Neighbours are those at rest for ever: strain is bounded (kMostFlowed), and what flows further is mpm's.
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/parallel_sum.h"
#include "filigree/physics/body.h"
#include "filigree/physics/body/elasticity.h"
#include "filigree/physics/meshfree/meshfree_frequency.h"
#include "filigree/physics/meshfree/meshfree_plastic.h"
#include "filigree/physics/step/byte_stream.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree {

using namespace meshfree;

namespace {

constexpr std::size_t kMeshfreeElasticityGrain = 256;
constexpr double kHourglass = 0.05; // of mu V / h^2
// Of the power iteration for the squared frequency. It comes from below: hence the margin, which also covers what a
// state changes beyond its largest stiffness. Tests compare with dense eigenvalues.
constexpr int kIterations = 30;
constexpr double kFrequencyMargin = 1.4;

/// Moduli for a bulk modulus K and a shear modulus: L = lambda + 5/6 mu.
Moduli moduli(float K, float shear, float z) {
    const float mu = shear * (4 / 3.f), L = K + shear * (1 / 6.f);
    return {mu, L, 1 + 0.75f * mu / L, z};
}

/// The larger bound of each lane; NaN stays.
void take_extremes(BlockResult& all, const BlockResult& result) {
    all.stiffness = result.stiffness <= all.stiffness ? all.stiffness : result.stiffness;
    all.volume_ratio = result.volume_ratio >= all.volume_ratio ? all.volume_ratio : result.volume_ratio;
    all.squared = result.squared <= all.squared ? all.squared : result.squared;
}

class MeshfreeElasticity final : public Elasticity {
public:
    MeshfreeElasticity(const Body& body, const RunContext& context)
        : body_(body), plastic_(body),
          neighbours_(find_mls_neighbours(body.rest, body.volume, body.spacing(), context)),
          position_(body.particle_count()), columns_(body.particle_count()) {
        const LameParameters lame = lame_parameters(body.material.young_modulus, body.material.poisson_ratio);
        const auto shear = float(lame.mu), bulk = float(lame.lambda + 2 * lame.mu / 3);
        const double h = body.spacing();
        std::vector<float> hourglass(body.particle_count()); // z over the shear modulus
        for (std::size_t i = 0; i < hourglass.size(); ++i) {
            const float sum = neighbours_.weight_sum[i];
            hourglass[i] = sum > 0 ? float(2 * kHourglass * double(body.volume[i]) / (h * h)) / sum : 0.f;
            moduli_.push_back(moduli(bulk, shear, hourglass[i] * shear));
        }
        frequency_over_stiffness_ =
            float(kFrequencyMargin) *
            squared_frequency_over_stiffness(body, neighbours_, hourglass, {shear, bulk}, kIterations, context);
    }

    ElasticReport forces(const Vectors& positions, Vectors& forces, const RunContext& context) override {
        const std::size_t n = body_.particle_count();
        gather(positions, position_, context);
        std::vector<BlockResult> found((n + kMeshfreeElasticityGrain - 1) / kMeshfreeElasticityGrain);
        parallel_for(context, n, kMeshfreeElasticityGrain, [&](std::size_t begin, std::size_t end) {
            found[begin / kMeshfreeElasticityGrain] = find_stresses(begin, end);
        });
        parallel_for(context, n, kMeshfreeElasticityGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                forces.set(i, to_vector(gather_force(neighbours_, position_.data(), columns_.data(), i)));
        });
        return report_of(found);
    }

    double energy(const Vectors& positions, const RunContext& context) const override {
        const std::size_t n = body_.particle_count();
        std::vector<Float4> position(n);
        gather(positions, position, context);
        return parallel_sum(context, n, kMeshfreeElasticityGrain,
                            [&](std::size_t i) { return particle_energy(position.data(), i); });
    }

    void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext& context) const override {
        std::vector<Float4> position(body_.particle_count());
        gather(positions, position, context);
        parallel_for(context, position.size(), kMeshfreeElasticityGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                gradients[i] = to_matrix(gather_gradient(neighbours_, position.data(), i));
        });
    }

    void finish_substep(const Vectors& positions, float dt, const RunContext& context) override {
        if (!plastic_.is_active()) return;
        gather(positions, position_, context);
        plastic_.yield(neighbours_, position_.data(), dt, context);
    }

    std::size_t flowed_out() const override { return plastic_.flowed_out(); }

    std::string state() const override {
        if (!plastic_.is_active()) return {};
        ByteWriter writer;
        writer.array(plastic_.memory());
        return writer.take();
    }

    bool restore_state(std::string_view bytes) override {
        if (bytes.empty() || !plastic_.is_active()) return bytes.empty() && !plastic_.is_active();
        ByteReader reader(bytes);
        std::vector<Mat3f> inverse = reader.array<Mat3f>();
        return reader.ok() && reader.at_end() && plastic_.remember(std::move(inverse));
    }

private:
    static void gather(const Vectors& positions, std::vector<Float4>& position, const RunContext& context) {
        parallel_for(context, position.size(), 4 * kMeshfreeElasticityGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) position[i] = load3(positions, i);
        });
    }

    /// B of particles [begin, end) into columns_.
    BlockResult find_stresses(std::size_t begin, std::size_t end) {
        const BlockArrays arrays{body_.volume.data(), moduli_.data(), neighbours_.inverse_moment.data(),
                                 plastic_.inverse()};
        BlockResult all;
        for (std::size_t i = begin; i < end; i += kStressBlock) {
            const std::size_t count = std::min(kStressBlock, end - i);
            for (std::size_t l = 0; l < count; ++l)
                columns_[i + l] = gather_gradient(neighbours_, position_.data(), i + l);
            BlockResult result;
            stress_(arrays, i, count, &columns_[i], result);
            for (std::size_t l = count; l < kStressBlock; ++l) { // lanes without a particle
                result.stiffness[l] = result.stiffness[0];
                result.volume_ratio[l] = result.volume_ratio[0];
                result.squared[l] = result.squared[0];
            }
            if (i == begin) all = result;
            take_extremes(all, result);
        }
        return all;
    }

    ElasticReport report_of(std::span<const BlockResult> found) const {
        float stiffness = 0, squared = 0, least = std::numeric_limits<float>::infinity();
        for (const BlockResult& piece : found)
            for (std::size_t l = 0; l < kStressBlock; ++l) {
                stiffness = piece.stiffness[l] <= stiffness ? stiffness : piece.stiffness[l];
                squared = piece.squared[l] <= squared ? squared : piece.squared[l];
                least = piece.volume_ratio[l] >= least ? least : piece.volume_ratio[l];
            }
        ElasticReport report;
        report.squared_frequency = stiffness * frequency_over_stiffness_;
        report.least_volume_ratio = least;
        report.most_stretch = std::sqrt(squared / 3);
        return report;
    }

    double particle_energy(const Float4* position, std::size_t i) const {
        const Columns F = gather_gradient(neighbours_, position, i);
        Mat3d Fe = to_matrix(F).cast<double>();
        if (const Mat3f* inverse = plastic_.inverse()) Fe = Fe * inverse[i].cast<double>();
        const Moduli& m = moduli_[i];
        const double mu = double(m.mu), L = double(m.L), g0 = double(m.g0), I = Fe.squaredNorm(), J = Fe.determinant();
        double sum = double(body_.volume[i]) * (0.5 * mu * (I - 3 - math::log((I + 1) / 4)) +
                                                0.5 * L * ((J - g0) * (J - g0) - (1 - g0) * (1 - g0)));
        for (std::size_t k = neighbours_.offsets[i]; k < neighbours_.offsets[i + 1]; ++k) {
            const Float4 pair = neighbours_.pairs[k];
            const Float4 slip = pair[3] * (position[neighbours_.neighbours[k]] - position[i]) - times(F, pair);
            if (pair[3] > 0) sum += 0.5 * double(m.z * dot3(slip, slip) / pair[3]);
        }
        return sum;
    }

    const Body& body_;
    const StressLoop stress_ = widest_stress();
    PlasticParticles plastic_; // state
    const MlsNeighbours neighbours_;
    std::vector<Moduli> moduli_;
    float frequency_over_stiffness_ = 0; // bound on the squared frequency over the largest stiffness

    // Scratch.
    std::vector<Float4> position_;
    std::vector<Columns> columns_; // F, then B of the force loop
};

} // namespace

std::unique_ptr<Elasticity> make_meshfree_elasticity(const Body& body, const RunContext& context) {
    return std::make_unique<MeshfreeElasticity>(body, context);
}

} // namespace filigree
