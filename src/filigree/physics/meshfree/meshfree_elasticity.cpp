// Based on:
//   [Mueller 2004] Point based animation of elastic, plastic and melting objects: deformation gradients by moving least
//   squares, forces as the exact derivative of the particles' energies, plastic flow, melting by temperature.
//   [Smith 2018] Stable neo-Hookean flesh simulation: the energy, which recovers from collapse.
//
// Of each particle, with F its gradient relative to the reference positions and D what is stored, the elastic gradient
// is Fe = F D (D = Fp^-1 until neighbourhoods are renewed, then it also holds the elastic strain of that moment), and
//     E = V [mu_s/2 (I - 3) + L/2 (J - g0)^2 - mu_s/2 log((I + 1)/4)] - its value at rest
//         + z/2 sum_j s_ij |x_ij - F X_ij|^2,       I = |Fe|^2, J = det Fe.
// Moving least squares do not see a checkerboard; the last term does. It has the weights of F, so F is its minimum and
// its derivative through F vanishes. The force between two particles is then
//     f_ij = s_ij (B_i + B_j) X_ij + s_ij (z_i + z_j) x_ij,   B = V P D^T M^-1 - z F,
// which each particle sums up over its own neighbours: no scatter, and momentum to the last bit of each pair.
//
// Melts keep their bulk modulus. Their shear modulus falls, and shear stress relaxes with the time constant viscosity /
// shear modulus (Maxwell): for slow motion a fluid of that viscosity.
#include "filigree/core/parallel_for.h"
#include "filigree/physics/body.h"
#include "filigree/physics/body/elasticity.h"
#include "filigree/physics/meshfree/meshfree_flow.h"
#include "filigree/physics/meshfree/meshfree_frequency.h"
#include "filigree/physics/step/byte_stream.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace filigree {

using namespace meshfree;

namespace {

constexpr std::size_t kMeshfreeElasticityGrain = 256;
constexpr double kHourglass = 0.05; // of mu V / h^2
// Of the power iteration for the squared frequency. It comes from below: hence the margin, which also covers what a
// state changes beyond its largest stiffness. Tests compare with dense eigenvalues.
constexpr int kIterations = 30, kRenewedIterations = 12;
constexpr double kMargin = 1.4, kRenewedMargin = 1.55;
// A melt's particles are free to line up until their neighbours tell nothing of one direction. Those closer than
// kPacked repel each other a little, which keeps them as far apart every way.
constexpr double kPacked = 1;      // spacings
constexpr double kPacking = 4;     // of the melt's shear modulus times spacing
constexpr double kMostPacked = 14; // neighbours at a time, for the bound on the squared frequency

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
    MeshfreeElasticity(const Body& body, const RunContext& context) : body_(body), flow_(body), reference_(body.rest) {
        const LameParameters lame = lame_parameters(body.material.young_modulus, body.material.poisson_ratio);
        bulk_ = float(lame.lambda + 2 * lame.mu / 3);
        moduli_.resize(body.particle_count());
        find_neighbours(false, context);
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
                forces.set(i, to_vector(gather_force(neighbours_, packing_, position_.data(), columns_.data(), i)));
        });
        return report_of(found);
    }

    double energy(const Vectors& positions, const RunContext& context) const override {
        const std::size_t n = body_.particle_count();
        std::vector<Float4> position(n);
        gather(positions, position, context);
        std::vector<double> pieces((n + kMeshfreeElasticityGrain - 1) / kMeshfreeElasticityGrain);
        parallel_for(context, n, kMeshfreeElasticityGrain, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) sum += particle_energy(position.data(), i);
            pieces[begin / kMeshfreeElasticityGrain] = sum;
        });
        double sum = 0;
        for (const double piece : pieces) sum += piece;
        return sum;
    }

    const Vectors& reference() const override { return reference_; }

    void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext& context) const override {
        std::vector<Float4> position(body_.particle_count());
        gather(positions, position, context);
        parallel_for(context, position.size(), kMeshfreeElasticityGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                gradients[i] = to_matrix(gather_gradient(neighbours_, position.data(), i));
        });
    }

    void finish_substep(const Vectors& positions, float dt, const RunContext& context) override {
        if (!flow_.is_active()) return;
        if (body_.material.melts()) {
            flow_.move_heat(neighbours_, dt, context);
            for (std::size_t i = 0; i < body_.particle_count(); ++i) update_particle(i);
        }
        gather(positions, position_, context);
        wants_renewal_ = flow_.move_matter(neighbours_, position_.data(), dt, context);
    }

    bool wants_renewal() const override { return wants_renewal_; }

    void renew(const Vectors& positions, const RunContext& context) override {
        assert(flow_.is_active());
        wants_renewal_ = false;
        for (std::size_t i = 0; i < body_.particle_count(); ++i)
            if (!positions[i].allFinite()) return;
        gather(positions, position_, context);
        flow_.take_gradients(neighbours_, position_.data(), context);
        reference_ = positions;
        find_neighbours(true, context);
        flow_.begin_anew(neighbours_, context);
    }

    std::string state() const override {
        if (!flow_.is_active()) return {};
        const Flow::Memory memory = flow_.memory();
        ByteWriter writer;
        writer.value(std::uint64_t(wants_renewal_));
        writer.vectors(reference_);
        writer.array(std::span(memory.stored));
        writer.array(std::span(memory.renewed));
        writer.array(std::span(memory.temperature));
        return writer.take();
    }

    bool restore_state(std::string_view bytes) override {
        if (bytes.empty() || !flow_.is_active()) return bytes.empty() && !flow_.is_active();
        const std::size_t n = body_.particle_count();
        ByteReader reader(bytes);
        const auto wants = reader.value<std::uint64_t>();
        Vectors reference = reader.vectors(n);
        Flow::Memory memory;
        memory.stored = reader.array<Mat3f>();
        memory.renewed = reader.array<Mat3f>();
        memory.temperature = reader.array<float>();
        if (!reader.ok() || !reader.at_end() || wants > 1) return false;
        for (std::size_t i = 0; i < n; ++i)
            if (!reference[i].allFinite()) return false;
        if (!flow_.remember(std::move(memory))) return false;
        wants_renewal_ = wants != 0;
        const bool is_renewed =
            reference.x != body_.rest.x || reference.y != body_.rest.y || reference.z != body_.rest.z;
        reference_ = std::move(reference);
        find_neighbours(is_renewed, RunContext());
        return true;
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
                                 flow_.stored()};
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
        report.squared_frequency =
            stiffness * frequency_over_stiffness_ + (packing_.of_particle.empty() ? 0.f : packing_.squared_frequency);
        report.least_volume_ratio = least;
        report.most_stretch = std::sqrt(squared / 3);
        return report;
    }

    /// Everything that follows from reference_.
    void find_neighbours(bool is_renewed, const RunContext& context) {
        const std::size_t n = body_.particle_count();
        neighbours_ = find_mls_neighbours(reference_, body_.volume, body_.spacing(), context);
        position_.resize(n);
        columns_.resize(n);
        const double h = body_.spacing();
        hourglass_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            const float sum = neighbours_.weight_sum[i];
            hourglass_[i] = sum > 0 ? float(2 * kHourglass * double(body_.volume[i]) / (h * h)) / sum : 0.f;
        }
        prepare_packing();
        for (std::size_t i = 0; i < n; ++i) update_particle(i);
        find_frequency(is_renewed, context);
    }

    void find_frequency(bool is_renewed, const RunContext& context) {
        const int iterations = is_renewed ? kRenewedIterations : kIterations;
        const auto with_shear = [&](float shear) {
            return squared_frequency_over_stiffness(body_, neighbours_, hourglass_, packing_, {shear, bulk_},
                                                    iterations, context);
        };
        frequency_over_stiffness_ = with_shear(flow_.solid_shear());
        if (body_.material.melts())
            frequency_over_stiffness_ = std::max(frequency_over_stiffness_, with_shear(flow_.melt_shear()));
        frequency_over_stiffness_ *= float(is_renewed ? kRenewedMargin : kMargin);
    }

    double particle_energy(const Float4* position, std::size_t i) const {
        const Columns F = gather_gradient(neighbours_, position, i);
        Mat3d Fe = to_matrix(F).cast<double>();
        if (const Mat3f* stored = flow_.stored()) Fe = Fe * stored[i].cast<double>();
        const Moduli& m = moduli_[i];
        const double mu = double(m.mu), L = double(m.L), g0 = double(m.g0), I = Fe.squaredNorm(), J = Fe.determinant();
        double sum = double(body_.volume[i]) * (0.5 * mu * (I - 3 - std::log((I + 1) / 4)) +
                                                0.5 * L * ((J - g0) * (J - g0) - (1 - g0) * (1 - g0)));
        for (std::size_t k = neighbours_.offsets[i]; k < neighbours_.offsets[i + 1]; ++k) {
            const Float4 pair = neighbours_.pairs[k];
            const Float4 slip = pair[3] * (position[neighbours_.neighbours[k]] - position[i]) - times(F, pair);
            if (pair[3] > 0) sum += 0.5 * double(m.z * dot3(slip, slip) / pair[3]);
        }
        if (packing_.acts_on(i))
            packing_.for_overlaps(neighbours_, position, i,
                                  [&](Float4, float overlap, float k) { sum += 0.25 * double(k * overlap * overlap); });
        return sum;
    }

    /// What follows from a particle's temperature.
    void update_particle(std::size_t i) {
        const float shear = flow_.shear_modulus(i);
        moduli_[i] = moduli(bulk_, shear, hourglass_[i] * shear);
        if (!packing_.of_particle.empty()) packing_.of_particle[i] = packing_.scale * flow_.melted(i) * body_.volume[i];
    }

    void prepare_packing() {
        if (!body_.material.melts()) return;
        const double h = body_.spacing(), stiffness = kPacking * double(flow_.melt_shear()) * h; // of two whole cells
        packing_.of_particle.resize(body_.particle_count());
        packing_.distance = float(kPacked * h);
        packing_.scale = float(std::sqrt(stiffness) / (h * h * h));
        packing_.squared_frequency = float(2 * kMostPacked * stiffness / (body_.material.density * h * h * h));
    }

    const Body& body_;
    float bulk_;
    StressLoop stress_ = widest_stress();

    // State.
    Flow flow_;
    Vectors reference_;
    bool wants_renewal_ = false;

    // From the reference alone.
    MlsNeighbours neighbours_;
    std::vector<float> hourglass_;       // z over the shear modulus
    float frequency_over_stiffness_ = 0; // bound on the squared frequency over the largest stiffness

    // From the state.
    Packing packing_;
    std::vector<Moduli> moduli_;

    // Scratch.
    std::vector<Float4> position_;
    std::vector<Columns> columns_; // F, then B of the force loop
};

} // namespace

std::unique_ptr<Elasticity> make_meshfree_elasticity(const Body& body, const RunContext& context) {
    return std::make_unique<MeshfreeElasticity>(body, context);
}

} // namespace filigree
