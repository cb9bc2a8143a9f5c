// Based on:
//   [Mueller 2004] Point based animation of elastic, plastic and melting objects: deformation gradients by moving least
//   squares, forces as the exact derivative of the particles' energies, plastic flow, melting by temperature.
//   [Smith 2018] Stable neo-Hookean flesh simulation: the energy, which recovers from collapse.
//   [Chen 2024] Vertex block descent.
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
#include "filigree/physics/elasticity.h"

#include "filigree/core/lanes.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/random.h"
#include "filigree/physics/body.h"
#include "filigree/physics/byte_stream.h"
#include "filigree/physics/mls_neighbours.h"
#include "filigree/physics/plasticity.h"
#include "filigree/physics/vertex_block.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace filigree {
namespace {

constexpr std::size_t kGrain = 256, kBlock = 8; // particles; stresses are computed for kBlock at a time
constexpr double kHourglass = 0.05;             // of mu V / h^2
constexpr int kRateIterations = 30, kRenewedRateIterations = 12;
constexpr double kRateMargin = 1.4, kRenewedRateMargin = 1.55;
// A neighbourhood in a point or on a line has no cofactor and so no force that opens it: sweeps take it for a thin box.
constexpr float kLeastCofactor = 1e-3f; // |cof F|^2
constexpr float kThinBox = 0.1f;        // added to F's diagonal
// Growing out of a collapse by leaps leaves particles on the wrong side of each other.
constexpr float kCollapsed = 0.5f;      // |F|^2
constexpr float kCollapsedStep = 0.05f; // spacings a sweep
// Corners folded inwards are held by nothing but their hourglass term, in states of equilibrium: sweeps harden it where
// a neighbour has slipped far from where F says. No ordinary motion does that.
constexpr float kFolded = 0.3f; // spacings
constexpr float kMostHardening = 20;

constexpr float kFlowToRenew = 0.5f;       // |G|^2 - 3 of the flow G since the last renewal: a stretch by 1.45
constexpr float kMostFlow = 2.5f;          // ... of any single particle
constexpr float kSlipToRenew = 0.5f;       // spacings: of a neighbour from where F says
constexpr std::size_t kShareToRenew = 100; // renew when one particle of this many is distorted
constexpr double kMostHeatSteps = 16;
// A melt's particles are free to line up until their neighbours tell nothing of one direction. Those closer than
// kPacked repel each other a little, which keeps them as far apart every way.
constexpr double kPacked = 1;            // spacings
constexpr double kPacking = 4;           // of the melt's shear modulus times spacing
constexpr double kMostPacked = 14;       // neighbours at a time, for the bound of the rate
constexpr float kLeastMelt = 0.8f;       // volume ratio: below it a renewed melt forgets its shape
constexpr float kMostCorrection = 0.02f; // of a volume ratio, a renewal

struct Columns {
    Float4 c[3]; // of a matrix; the fourth lane is unused or holds something else
};

FILIGREE_INLINE Float4 load3(const Vectors& v, std::size_t i) { return Float4{v.x[i], v.y[i], v.z[i], 0}; }
FILIGREE_INLINE Float4 times(const Columns& m, Float4 v) { return m.c[0] * v[0] + m.c[1] * v[1] + m.c[2] * v[2]; }
FILIGREE_INLINE Float4 cross(Float4 a, Float4 b) {
    const Float4 a1 = __builtin_shufflevector(a, a, 1, 2, 0, 3), b1 = __builtin_shufflevector(b, b, 1, 2, 0, 3);
    const Float4 c = a * b1 - a1 * b;
    return __builtin_shufflevector(c, c, 1, 2, 0, 3);
}
FILIGREE_INLINE float dot3(Float4 a, Float4 b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
FILIGREE_INLINE float squared_norm(const Columns& m) {
    return dot3(m.c[0], m.c[0]) + dot3(m.c[1], m.c[1]) + dot3(m.c[2], m.c[2]);
}
FILIGREE_INLINE Vec3f to_vector(Float4 a) { return {a[0], a[1], a[2]}; }
FILIGREE_INLINE Float4 to_lanes(const Vec3f& a) { return Float4{a.x(), a.y(), a.z(), 0}; }
FILIGREE_INLINE Mat3f to_matrix(const Columns& m) {
    Mat3f result;
    for (int a = 0; a < 3; ++a) result.col(a) = to_vector(m.c[a]);
    return result;
}
FILIGREE_INLINE Columns to_columns(const Mat3f& m) {
    Columns result;
    for (int a = 0; a < 3; ++a) result.c[a] = to_lanes(m.col(a));
    return result;
}

/// Elastic moduli of one particle.
struct Moduli {
    float mu, L, g0; // mu_s, L and g0 of [Smith 2018]
    float z;         // of the hourglass term
};

/// Moduli for a bulk modulus K and a shear modulus: L = lambda + 5/6 mu.
Moduli moduli(float K, float shear, float z) {
    const float mu = shear * (4 / 3.f), L = K + shear * (1 / 6.f);
    return {mu, L, 1 + 0.75f * mu / L, z};
}

using Lanes = float __attribute__((vector_size(4 * kBlock)));
FILIGREE_INLINE Lanes greater(Lanes a, Lanes b) { return a > b ? a : b; }
FILIGREE_INLINE Lanes square_root(Lanes x) { // x >= 0
    typedef std::int32_t Ints __attribute__((vector_size(4 * kBlock)));
    x += 1e-30f;
    Lanes y = (Lanes)(0x5f3759df - ((Ints)x >> 1));
    for (int step = 0; step < 3; ++step) y = y * (1.5f - 0.5f * x * y * y);
    return x * y;
}

/// Matrices of kBlock particles, [row][column].
struct LaneMatrix {
    Lanes m[3][3];
};
FILIGREE_INLINE LaneMatrix product(const LaneMatrix& a, const LaneMatrix& b) {
    LaneMatrix r;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) r.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
    return r;
}
FILIGREE_INLINE LaneMatrix cofactor(const LaneMatrix& a) {
    LaneMatrix r;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            r.m[i][j] = a.m[(i + 1) % 3][(j + 1) % 3] * a.m[(i + 2) % 3][(j + 2) % 3] -
                        a.m[(i + 1) % 3][(j + 2) % 3] * a.m[(i + 2) % 3][(j + 1) % 3];
    return r;
}
/// A bound of the largest eigenvalue of A^T A: of numbers with mean m and variance v none is above m + sqrt(2 v).
FILIGREE_INLINE Lanes largest_square(const LaneMatrix& a) {
    Lanes diagonal[3], off = {};
    for (int i = 0; i < 3; ++i) {
        diagonal[i] = a.m[0][i] * a.m[0][i] + a.m[1][i] * a.m[1][i] + a.m[2][i] * a.m[2][i];
        const int j = (i + 1) % 3;
        const Lanes o = a.m[0][i] * a.m[0][j] + a.m[1][i] * a.m[1][j] + a.m[2][i] * a.m[2][j];
        off += o * o;
    }
    const Lanes mean = (diagonal[0] + diagonal[1] + diagonal[2]) * (1 / 3.f);
    Lanes spread = 2 * off;
    for (const Lanes& d : diagonal) spread += (d - mean) * (d - mean);
    return mean + square_root(spread * (2 / 3.f));
}

/// Where what a block of particles has is found; arrays are padded to whole blocks.
struct BlockArrays {
    const float* volume;
    const Moduli* moduli;
    const std::array<float, 6>* inverse_moment;
    const Mat3f* stored; // D; null: the identity
};
struct BlockResult {
    Lanes stiffness, volume_ratio, squared; // bound of dP/dF over rank-one changes, J, |Fe|^2
};

/// From F of a block's particles to B, in place.
FILIGREE_INLINE BlockResult stress_block(const BlockArrays& arrays, std::size_t first, std::size_t count,
                                         Columns* gradients) {
    LaneMatrix F{}, D{}, M{};
    Lanes volume = {}, mu = {}, L = {}, g0 = {}, z = {};
    for (std::size_t l = 0; l < count; ++l) {
        const std::size_t i = first + l;
        for (int a = 0; a < 3; ++a)
            for (int r = 0; r < 3; ++r) F.m[r][a][l] = gradients[l].c[a][r];
        if (arrays.stored)
            for (int a = 0; a < 3; ++a)
                for (int r = 0; r < 3; ++r) D.m[r][a][l] = arrays.stored[i](r, a);
        const auto& m = arrays.inverse_moment[i];
        constexpr int kPlace[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
        for (int a = 0; a < 3; ++a)
            for (int r = 0; r < 3; ++r) M.m[r][a][l] = m[std::size_t(kPlace[r][a])];
        volume[l] = arrays.volume[i];
        mu[l] = arrays.moduli[i].mu;
        L[l] = arrays.moduli[i].L;
        g0[l] = arrays.moduli[i].g0;
        z[l] = arrays.moduli[i].z;
    }
    const LaneMatrix Fe = arrays.stored ? product(F, D) : F;
    const LaneMatrix cof = cofactor(Fe);
    const Lanes J = Fe.m[0][0] * cof.m[0][0] + Fe.m[0][1] * cof.m[0][1] + Fe.m[0][2] * cof.m[0][2];
    Lanes I = {};
    for (int r = 0; r < 3; ++r)
        for (int a = 0; a < 3; ++a) I += Fe.m[r][a] * Fe.m[r][a];
    const Lanes inverse = 1 / (I + 1);
    const Lanes shear = mu * (1 - inverse), pressure = L * (J - g0);
    LaneMatrix P;
    for (int r = 0; r < 3; ++r)
        for (int a = 0; a < 3; ++a) P.m[r][a] = volume * (shear * Fe.m[r][a] + pressure * cof.m[r][a]);
    if (arrays.stored) {
        LaneMatrix transposed;
        for (int r = 0; r < 3; ++r)
            for (int a = 0; a < 3; ++a) transposed.m[r][a] = D.m[a][r];
        P = product(P, transposed);
    }
    const LaneMatrix A = product(P, M);
    for (std::size_t l = 0; l < count; ++l)
        for (int a = 0; a < 3; ++a) {
            Float4 column = {};
            for (int r = 0; r < 3; ++r) column[r] = A.m[r][a][l] - z[l] * F.m[r][a][l];
            column[3] = z[l];
            gradients[l].c[a] = column;
        }

    // For changes v g^T: shear (g.g') I and pressure [F (g x g')] are a rotation's parts, so the larger counts; then
    // L (cof g)(cof g')^T, and what the logarithm adds.
    const Lanes zero = {};
    const Lanes stretch = largest_square(Fe);
    const Lanes size = pressure > zero ? pressure : -pressure;
    Lanes stiffness =
        greater(shear, size * square_root(stretch)) + L * largest_square(cof) + 2 * mu * inverse * inverse * stretch;
    if (arrays.stored) stiffness *= largest_square(D);
    return {stiffness, J, I};
}

using StressLoop = void (*)(const BlockArrays&, std::size_t, std::size_t, Columns*, BlockResult&);
void stress_plain(const BlockArrays& arrays, std::size_t first, std::size_t count, Columns* gradients,
                  BlockResult& result) {
    result = stress_block(arrays, first, count, gradients);
}
#if defined(__x86_64__)
__attribute__((target("avx2"))) void stress_avx2(const BlockArrays& arrays, std::size_t first, std::size_t count,
                                                 Columns* gradients, BlockResult& result) {
    result = stress_block(arrays, first, count, gradients);
}
#endif
StressLoop widest_stress() {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) return stress_avx2;
#endif
    return stress_plain;
}

/// slip: weighted, as `allowed` is.
FILIGREE_INLINE float hardening(Float4 slip, float allowed) {
    const float squared = dot3(slip, slip);
    return squared > allowed ? std::min(squared / allowed, kMostHardening) : 1.f;
}

float smoothstep(double from, double to, double x) {
    if (x >= to) return 1;
    if (x <= from) return 0;
    const double t = (x - from) / (to - from);
    return float(t * t * (3 - 2 * t));
}

class MeshfreeElasticity final : public Elasticity {
public:
    MeshfreeElasticity(const Body& body, const RunContext& context)
        : body_(body), flows_(body.material.is_plastic() || body.material.melts()), reference_(body.rest) {
        const std::size_t n = body.particle_count();
        const Material& material = body.material;
        const LameParameters lame = lame_parameters(material.young_modulus, material.poisson_ratio);
        shear_ = float(lame.mu);
        bulk_ = float(lame.lambda + 2 * lame.mu / 3);
        // Stress of the melt relaxes within a few substeps, not within one: then the stepper follows its viscosity.
        melt_shear_ = float(std::clamp(material.viscosity / 2e-3, 0.003 * lame.mu, 0.1 * lame.mu));
        if (flows_) {
            stored_.assign(n, Mat3f::Identity());
            renewed_ = stored_;
            temperature_.assign(n, float(material.temperature));
        }
        slip_allowed_ = float(double(kFolded * kFolded) * body.spacing() * body.spacing());
        moduli_.resize(n);
        find_neighbours(false, context);
    }

    ElasticReport forces(const Vectors& positions, Vectors& forces, const RunContext& context) override {
        const std::size_t n = body_.particle_count();
        gather_positions(positions, context);
        const std::size_t pieces = (n + kGrain - 1) / kGrain;
        std::vector<BlockResult> found(pieces);
        parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
            const BlockArrays arrays{body_.volume.data(), moduli_.data(), neighbours_.inverse_moment.data(),
                                     flows_ ? stored_.data() : nullptr};
            BlockResult all;
            for (std::size_t i = begin; i < end; i += kBlock) {
                const std::size_t count = std::min(kBlock, end - i);
                for (std::size_t l = 0; l < count; ++l) columns_[i + l] = gradient(i + l);
                BlockResult result;
                stress_(arrays, i, count, &columns_[i], result);
                for (std::size_t l = count; l < kBlock; ++l) { // lanes without a particle
                    result.stiffness[l] = result.stiffness[0];
                    result.volume_ratio[l] = result.volume_ratio[0];
                    result.squared[l] = result.squared[0];
                }
                if (i == begin) all = result;
                all.stiffness = result.stiffness <= all.stiffness ? all.stiffness : result.stiffness; // NaN stays
                all.volume_ratio = result.volume_ratio >= all.volume_ratio ? all.volume_ratio : result.volume_ratio;
                all.squared = result.squared <= all.squared ? all.squared : result.squared;
            }
            found[begin / kGrain] = all;
        });
        parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) forces.set(i, to_vector(gather_force(i)));
        });

        ElasticReport report;
        float stiffness = 0, squared = 0, least = std::numeric_limits<float>::infinity();
        for (const BlockResult& piece : found)
            for (std::size_t l = 0; l < kBlock; ++l) {
                stiffness = piece.stiffness[l] <= stiffness ? stiffness : piece.stiffness[l];
                squared = piece.squared[l] <= squared ? squared : piece.squared[l];
                least = piece.volume_ratio[l] >= least ? least : piece.volume_ratio[l];
            }
        report.rate = stiffness * unit_rate_ + (packing_.empty() ? 0.f : packing_rate_);
        report.least_volume_ratio = least;
        report.most_stretch = std::sqrt(squared / 3);
        return report;
    }

    void sweep(Vectors& positions, const Descent& descent, const RunContext& context) override {
        if (colors_.empty()) find_colors();
        gather_positions(positions, context);
        parallel_for(context, body_.particle_count(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) columns_[i] = gradient(i);
        });
        for (const std::vector<Index>& color : colors_)
            parallel_for(context, color.size(), kGrain / 16, [&](std::size_t begin, std::size_t end) {
                for (std::size_t k = begin; k < end; ++k) move_particle(positions, descent, color[k]);
            });
    }

    double energy(const Vectors& positions, const RunContext& context) override {
        const std::size_t n = body_.particle_count();
        gather_positions(positions, context);
        std::vector<double> pieces((n + kGrain - 1) / kGrain);
        parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) sum += particle_energy(i);
            pieces[begin / kGrain] = sum;
        });
        double sum = 0;
        for (const double piece : pieces) sum += piece;
        return sum;
    }

    const Vectors& reference() const override { return reference_; }

    void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext& context) override {
        gather_positions(positions, context);
        parallel_for(context, body_.particle_count(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) gradients[i] = to_matrix(gradient(i));
        });
    }

    void finish_substep(const Vectors& positions, float dt, const RunContext& context) override {
        if (!flows_) return;
        if (body_.material.melts()) move_heat(dt, context);
        gather_positions(positions, context);
        const std::size_t n = body_.particle_count();
        std::vector<std::array<std::size_t, 2>> distorted((n + kGrain - 1) / kGrain);
        parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
            std::array<std::size_t, 2> counts = {0, 0};
            for (std::size_t i = begin; i < end; ++i) {
                const float amount = flow_particle(i, dt);
                counts[0] += amount > kFlowToRenew;
                counts[1] += amount > kMostFlow;
            }
            distorted[begin / kGrain] = counts;
        });
        std::array<std::size_t, 2> total = {0, 0};
        for (const auto& counts : distorted)
            for (std::size_t a = 0; a < 2; ++a) total[a] += counts[a];
        wants_renewal_ = total[0] > n / kShareToRenew || total[1] > 0;
    }

    bool wants_renewal() const override { return wants_renewal_; }

    void renew(const Vectors& positions, const RunContext& context) override {
        wants_renewal_ = false;
        const std::size_t n = body_.particle_count();
        for (std::size_t i = 0; i < n; ++i)
            if (!positions[i].allFinite()) return;
        gather_positions(positions, context);
        if (flows_)
            parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) stored_[i] = to_matrix(gradient(i)) * stored_[i];
            });
        else { // a body that only stretches: what it is stored as from now on
            stored_.resize(n);
            for (std::size_t i = 0; i < n; ++i) stored_[i] = to_matrix(gradient(i));
            temperature_.assign(n, float(body_.material.temperature));
            flows_ = true;
        }
        reference_ = positions;
        find_neighbours(true, context);
        if (body_.material.melts()) correct_volume(context);
        renewed_ = stored_;
    }

    std::string state() const override {
        if (!flows_) return {};
        ByteWriter writer;
        writer.value(std::uint64_t(wants_renewal_));
        writer.vectors(reference_);
        writer.array(std::span(stored_));
        writer.array(std::span(renewed_));
        writer.array(std::span(temperature_));
        return writer.take();
    }

    bool restore_state(std::string_view bytes) override {
        const std::size_t n = body_.particle_count();
        if (bytes.empty()) return !flows_;
        ByteReader reader(bytes);
        const auto wants = reader.value<std::uint64_t>();
        Vectors reference = reader.vectors(n);
        std::vector<Mat3f> stored = reader.array<Mat3f>(), renewed = reader.array<Mat3f>();
        std::vector<float> temperature = reader.array<float>();
        if (!reader.ok() || !reader.at_end() || wants > 1 || stored.size() != n || renewed.size() != n ||
            temperature.size() != n)
            return false;
        for (std::size_t i = 0; i < n; ++i)
            if (!reference[i].allFinite()) return false;
        stored_ = std::move(stored);
        renewed_ = std::move(renewed);
        temperature_ = std::move(temperature);
        flows_ = true;
        wants_renewal_ = wants != 0;
        const bool is_renewed =
            reference.x != body_.rest.x || reference.y != body_.rest.y || reference.z != body_.rest.z;
        reference_ = std::move(reference);
        find_neighbours(is_renewed, RunContext());
        return true;
    }

private:
    void gather_positions(const Vectors& positions, const RunContext& context) {
        parallel_for(context, position_.size(), 4 * kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) position_[i] = load3(positions, i);
        });
    }

    /// F from position_.
    FILIGREE_INLINE Columns gradient(std::size_t i) const {
        const Float4 x = position_[i];
        Columns sum = {};
        for (std::size_t k = neighbours_.offsets[i]; k < neighbours_.offsets[i + 1]; ++k) {
            const Float4 pair = neighbours_.pairs[k], d = position_[neighbours_.neighbours[k]] - x;
            for (int a = 0; a < 3; ++a) sum.c[a] += d * pair[a];
        }
        const auto& m = neighbours_.inverse_moment[i];
        Columns F = {{sum.c[0] * m[0] + sum.c[1] * m[3] + sum.c[2] * m[4],
                      sum.c[0] * m[3] + sum.c[1] * m[1] + sum.c[2] * m[5],
                      sum.c[0] * m[4] + sum.c[1] * m[5] + sum.c[2] * m[2]}};
        if (!neighbours_.missing.empty())
            for (int a = 0; a < 3; ++a) F.c[a] += to_lanes(neighbours_.missing[i].col(a));
        return F;
    }

    /// The force on a particle, from B in columns_ and position_.
    FILIGREE_INLINE Float4 gather_force(std::size_t i) const {
        const Columns here = columns_[i];
        const Float4 x = position_[i];
        Float4 force = {};
        for (std::size_t k = neighbours_.offsets[i]; k < neighbours_.offsets[i + 1]; ++k) {
            const Index j = neighbours_.neighbours[k];
            const Float4 pair = neighbours_.pairs[k];
            const Columns& there = columns_[j];
            const Float4 first = here.c[0] + there.c[0]; // and z_i + z_j in the last lane
            force += first * pair[0] + (here.c[1] + there.c[1]) * pair[1] + (here.c[2] + there.c[2]) * pair[2] +
                     (position_[j] - x) * (first[3] * pair[3]);
        }
        if (!packing_.empty() && packing_[i] > 0)
            for_overlaps(i, [&](Float4 away, float overlap, float stiffness) { force += stiffness * overlap * away; });
        return force;
    }

    /// Calls visit(unit vector away from the neighbour, m of overlap, N/m) for the neighbours that a melted particle
    /// is closer to than kPacked.
    template <class Visit>
    FILIGREE_INLINE void for_overlaps(std::size_t i, const Visit& visit) const {
        for (std::size_t k = neighbours_.offsets[i]; k < neighbours_.offsets[i + 1]; ++k) {
            const Index j = neighbours_.neighbours[k];
            const Float4 d = position_[i] - position_[j];
            const float squared = dot3(d, d);
            const float stiffness = packing_[i] * packing_[j];
            if (!(squared < packed_ * packed_ && squared > 1e-12f * packed_ * packed_ && stiffness > 0)) continue;
            const float length = std::sqrt(squared);
            visit(d * (1 / length), packed_ - length, stiffness);
        }
    }

    /// Everything that follows from reference_: neighbours, hourglass stiffness, the bound of the rate.
    void find_neighbours(bool is_renewed, const RunContext& context) {
        const std::size_t n = body_.particle_count();
        neighbours_ = find_mls_neighbours(reference_, body_.volume, body_.spacing(), context);
        position_.resize(n);
        columns_.resize(n);
        colors_.clear();
        const double h = body_.spacing();
        hourglass_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            const float sum = neighbours_.weight_sum[i];
            hourglass_[i] = sum > 0 ? float(2 * kHourglass * double(body_.volume[i]) / (h * h)) / sum : 0.f;
        }
        find_packing();
        for (std::size_t i = 0; i < n; ++i) update_particle(i);
        find_rate(is_renewed, context);
    }

    /// Largest eigenvalue of M^-1 K at rest (hourglass term included) by power iteration, over the stiffness that
    /// stress_block finds at rest. Rayleigh quotients approach it from below: hence the margin, which also has to
    /// cover what a state changes beyond its largest stiffness. Tests compare with dense eigenvalues.
    void find_rate(bool is_renewed, const RunContext& context) {
        const int iterations = is_renewed ? kRenewedRateIterations : kRateIterations;
        unit_rate_ = unit_rate(shear_, iterations, context);
        if (body_.material.melts()) unit_rate_ = std::max(unit_rate_, unit_rate(melt_shear_, iterations, context));
        unit_rate_ *= float(is_renewed ? kRenewedRateMargin : kRateMargin);
    }
    float unit_rate(float shear, int iterations, const RunContext& context) {
        const std::size_t n = body_.particle_count();
        const float lambda = bulk_ - shear * (2 / 3.f);
        const auto component = [](std::size_t i, std::uint64_t c) { return float(random_unit(1, 3 * i + c) - 0.5); };
        for (std::size_t i = 0; i < n; ++i) position_[i] = Float4{component(i, 0), component(i, 1), component(i, 2), 0};
        double rate = 0;
        std::vector<Float4> next(n);
        for (int iteration = 0; iteration < iterations; ++iteration) {
            parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    Mat3f G = to_matrix(gradient(i));
                    if (!neighbours_.missing.empty()) G -= neighbours_.missing[i];
                    const Mat3f stress = shear * (G + G.transpose()) + lambda * G.trace() * Mat3f::Identity();
                    const float z = hourglass_[i] * shear;
                    const auto& m = neighbours_.inverse_moment[i];
                    Mat3f M;
                    M << m[0], m[3], m[4], m[3], m[1], m[5], m[4], m[5], m[2];
                    columns_[i] = to_columns(body_.volume[i] * stress * M - z * G);
                    columns_[i].c[0][3] = z;
                }
            });
            parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) next[i] = gather_force(i);
            });
            double power = 0, mass = 0, largest = 0;
            for (std::size_t i = 0; i < n; ++i) {
                power -= double(dot3(next[i], position_[i]));
                mass += double(body_.mass[i] * dot3(position_[i], position_[i]));
                next[i] /= -body_.mass[i];
                for (int a = 0; a < 3; ++a) largest = std::max(largest, double(std::abs(next[i][a])));
            }
            if (mass > 0) rate = std::max(rate, power / mass);
            if (!(largest > 0)) break;
            for (std::size_t i = 0; i < n; ++i) position_[i] = next[i] * float(1 / largest);
        }
        return float(rate / double(lambda + 2 * shear));
    }

    /// Greedily, so that no two particles of a color have a neighbour in common, nor are neighbours.
    void find_colors() {
        const std::size_t n = body_.particle_count();
        std::vector<std::uint32_t> color(n, kNoIndex), seen;
        const auto neighbours = [&](std::size_t i) {
            return std::span(neighbours_.neighbours)
                .subspan(neighbours_.offsets[i], neighbours_.offsets[i + 1] - neighbours_.offsets[i]);
        };
        for (std::size_t i = 0; i < n; ++i) {
            const auto mark = [&](Index j) {
                if (color[j] != kNoIndex) seen[color[j]] = std::uint32_t(i + 1);
            };
            for (const Index j : neighbours(i)) {
                mark(j);
                for (const Index k : neighbours(j)) mark(k);
            }
            std::uint32_t c = 0;
            while (c < seen.size() && seen[c] == i + 1) ++c;
            if (c == seen.size()) {
                seen.push_back(0);
                colors_.emplace_back();
            }
            color[i] = c;
            colors_[c].push_back(Index(i));
        }
    }

    /// Adds force and block of the energy of particle p, whose F changes by dx g^T.
    FILIGREE_INLINE void add_energy_of(std::size_t p, Float4 g, Float4& force, Symmetric3& block) const {
        Columns F = columns_[p];
        if (flows_) {
            const Columns D = to_columns(stored_[p]);
            F = {{times(F, D.c[0]), times(F, D.c[1]), times(F, D.c[2])}};
            g = Float4{dot3(D.c[0], g), dot3(D.c[1], g), dot3(D.c[2], g), 0};
        }
        Columns cofactor = {{cross(F.c[1], F.c[2]), cross(F.c[2], F.c[0]), cross(F.c[0], F.c[1])}};
        if (squared_norm(cofactor) < kLeastCofactor) {
            for (int a = 0; a < 3; ++a) F.c[a][a] += kThinBox;
            cofactor = {{cross(F.c[1], F.c[2]), cross(F.c[2], F.c[0]), cross(F.c[0], F.c[1])}};
        }
        const float I = squared_norm(F);
        const Float4 cof = times(cofactor, g);
        const float J = dot3(F.c[0], cofactor.c[0]), V = body_.volume[p];
        const Moduli& m = moduli_[p];
        const float inverse = 1 / (I + 1), shear = m.mu * (1 - inverse);
        const Float4 Fg = times(F, g);
        force -= V * (shear * Fg + m.L * (J - m.g0) * cof);
        block.add_scaled_identity(V * shear * dot3(g, g));
        block.add_outer(to_vector(cof), V * m.L);
        block.add_outer(to_vector(Fg), V * 2 * m.mu * inverse * inverse);
    }

    void move_particle(Vectors& positions, const Descent& descent, Index i) {
        if (descent.fixed[i]) return;
        const Float4 x = position_[i];
        const float inertia = descent.inertia[i];
        Float4 force = inertia * (load3(descent.target, i) - x);
        Symmetric3 block;
        block.add_scaled_identity(inertia);
        const Float4 self = to_lanes(neighbours_.self_gradient[i]);
        add_energy_of(i, self, force, block);
        float stiffness = 0;
        const Columns& here = columns_[i];
        for (std::size_t k = neighbours_.offsets[i]; k < neighbours_.offsets[i + 1]; ++k) {
            const Index p = neighbours_.neighbours[k];
            const Float4 pair = neighbours_.pairs[k];
            add_energy_of(p, to_lanes(neighbours_.gradient(p, -to_vector(pair))), force, block);
            const Float4 offset = pair[3] * (position_[p] - x);
            const Float4 slip_here = offset - times(here, pair), slip_there = offset - times(columns_[p], pair);
            const float allowed = pair[3] * pair[3] * slip_allowed_;
            const float zi = moduli_[i].z * hardening(slip_here, allowed);
            const float zp = moduli_[p].z * hardening(slip_there, allowed);
            force += zi * slip_here + zp * slip_there;
            stiffness += (zi + zp) * pair[3];
        }
        block.add_scaled_identity(stiffness);
        if (!packing_.empty() && packing_[i] > 0)
            for_overlaps(i, [&](Float4 away, float overlap, float k) {
                force += k * overlap * away;
                block.add_outer(to_vector(away), k);
            });
        Vec3f total = to_vector(force);
        if (descent.touched[i] && descent.external) descent.external->add(i, positions, total, block);
        Vec3f solved = block.solve(total);
        const float most = kCollapsedStep * float(body_.spacing()), length = solved.norm();
        if (length > most && squared_norm(here) < kCollapsed) solved *= most / length;
        const Float4 step = to_lanes(solved);
        positions.add(i, to_vector(step));
        position_[i] += step;
        for (int a = 0; a < 3; ++a) columns_[i].c[a] += step * self[a];
        for (std::size_t k = neighbours_.offsets[i]; k < neighbours_.offsets[i + 1]; ++k) {
            const Index p = neighbours_.neighbours[k];
            const Vec3f g = neighbours_.gradient(p, -to_vector(neighbours_.pairs[k]));
            for (int a = 0; a < 3; ++a) columns_[p].c[a] += step * g[a];
        }
    }

    double particle_energy(std::size_t i) const {
        const Columns F = gradient(i);
        Mat3d Fe = to_matrix(F).cast<double>();
        if (flows_) Fe = Fe * stored_[i].cast<double>();
        const Moduli& m = moduli_[i];
        const double mu = double(m.mu), L = double(m.L), g0 = double(m.g0), I = Fe.squaredNorm(), J = Fe.determinant();
        double sum = double(body_.volume[i]) * (0.5 * mu * (I - 3 - std::log((I + 1) / 4)) +
                                                0.5 * L * ((J - g0) * (J - g0) - (1 - g0) * (1 - g0)));
        for (std::size_t k = neighbours_.offsets[i]; k < neighbours_.offsets[i + 1]; ++k) {
            const Float4 pair = neighbours_.pairs[k];
            const Float4 slip = pair[3] * (position_[neighbours_.neighbours[k]] - position_[i]) - times(F, pair);
            if (pair[3] > 0) sum += 0.5 * double(m.z * dot3(slip, slip) / pair[3]);
        }
        if (!packing_.empty() && packing_[i] > 0)
            for_overlaps(i, [&](Float4, float overlap, float k) { sum += 0.25 * double(k * overlap * overlap); });
        return sum;
    }

    float melted(std::size_t i) const {
        const Material& material = body_.material;
        return material.melts() ? smoothstep(material.melting_from, material.melting_to, double(temperature_[i])) : 0;
    }
    float shear_modulus(float melted_part) const { return shear_ + melted_part * (melt_shear_ - shear_); }
    Moduli particle_moduli(std::size_t i) const {
        const float shear = flows_ ? shear_modulus(melted(i)) : shear_;
        return moduli(bulk_, shear, hourglass_[i] * shear);
    }

    void update_particle(std::size_t i) {
        moduli_[i] = particle_moduli(i);
        if (!packing_.empty()) packing_[i] = packing_scale_ * melted(i) * body_.volume[i];
    }
    void find_packing() {
        if (!flows_ || !body_.material.melts()) return;
        const double h = body_.spacing(), stiffness = kPacking * double(melt_shear_) * h; // of two whole cells
        packing_.resize(body_.particle_count());
        packed_ = float(kPacked * h);
        packing_scale_ = float(std::sqrt(stiffness) / (h * h * h));
        packing_rate_ = float(2 * kMostPacked * stiffness / (body_.material.density * h * h * h));
    }

    /// Flow of one particle; how far it has flowed since the last renewal, |G|^2 - 3.
    float flow_particle(std::size_t i, float dt) {
        const Material& material = body_.material;
        const float part = melted(i), shear = shear_modulus(part);
        FlowLaw law{std::numeric_limits<float>::infinity(), 1, 0};
        if (material.is_plastic()) {
            law.yield_strain = float(std::sqrt(2 / 3.) * material.yield_stress / (2 * double(shear)));
            if (material.creep_time > 0) law.yield_rate = float(-std::expm1(-double(dt) / material.creep_time));
        }
        if (part > 0) law.relaxation = float(-std::expm1(-double(dt) * double(part * shear) / material.viscosity));
        const Columns F = gradient(i);
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
        for (std::size_t k = neighbours_.offsets[i]; k < neighbours_.offsets[i + 1] && part > 0; ++k) {
            const Float4 pair = neighbours_.pairs[k];
            const Float4 slip = pair[3] * (position_[neighbours_.neighbours[k]] - position_[i]) - times(F, pair);
            const float most = kSlipToRenew * float(body_.spacing()) * pair[3];
            if (dot3(slip, slip) > most * most) amount = std::max(amount, 1.01f * kFlowToRenew);
        }
        return std::isfinite(amount) ? amount : 0;
    }

    /// Heating of the surface, conduction between neighbours (which keeps the sum of volume times temperature), and
    /// the moduli that follow.
    void move_heat(float dt, const RunContext& context) {
        const std::size_t n = body_.particle_count();
        const Material& material = body_.material;
        std::vector<float> next(n);
        double steps = 1;
        if (material.conductivity > 0) {
            // On a lattice the second moment of the weights makes the sum below at most about 6 / h^2 a particle.
            const double limit = 0.1 * body_.spacing() * body_.spacing() / material.conductivity;
            steps = std::min(std::ceil(double(dt) / limit), kMostHeatSteps);
            const float step = float(std::min(double(dt) / steps, limit) * material.conductivity);
            for (int s = 0; s < int(steps); ++s) {
                parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
                    for (std::size_t i = begin; i < end; ++i) {
                        double gain = 0;
                        for (std::size_t k = neighbours_.offsets[i]; k < neighbours_.offsets[i + 1]; ++k) {
                            const Index j = neighbours_.neighbours[k];
                            gain += double(conductance(i, k) * (temperature_[j] - temperature_[i]));
                        }
                        next[i] = temperature_[i] + step * float(gain) / body_.volume[i];
                    }
                });
                temperature_.swap(next);
            }
        }
        for (std::size_t i = 0; i < n; ++i) {
            temperature_[i] += float(material.heating * double(dt)) * neighbours_.exposure[i];
            update_particle(i);
        }
    }

    /// Of a pair, m: V / sum of weights over the mean square of offsets is the Laplacian's scale; both ends' mean.
    float conductance(std::size_t i, std::size_t k) const {
        const auto scale = [&](std::size_t p) {
            const auto& m = neighbours_.inverse_moment[p];
            return body_.volume[p] * (m[0] + m[1] + m[2]) * (2 / 3.f);
        };
        return 0.5f * neighbours_.pairs[k][3] * (scale(i) + scale(neighbours_.neighbours[k]));
    }

    /// The product of gradients over many renewals drifts from the volume there is. Inside, and wherever particles are
    /// denser than at the start, the kernel's sum tells how far. At its surface a melt bears no tension (drops come
    /// apart), and a neighbourhood that was turned inside out is a round one from now on.
    void correct_volume(const RunContext& context) {
        parallel_for(context, body_.particle_count(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const float part = melted(i);
                if (!(part > 0)) continue;
                const float exposure = neighbours_.exposure[i], J = stored_[i].determinant();
                float there = std::clamp(1 / neighbours_.density[i], kLeastMelt, 1 / kLeastMelt);
                if (exposure > 0) there = std::min(there, 1.f);
                if (!(J > kLeastMelt)) {
                    stored_[i] = Mat3f::Identity() * std::cbrt(there);
                    continue;
                }
                if (there > J && exposure > 0) there = std::min(J, 1.f);
                const float change = std::clamp(there - J, -kMostCorrection, kMostCorrection);
                stored_[i] *= std::cbrt((J + part * change) / J);
            }
        });
    }

    const Body& body_;
    bool flows_; // whether stored_ and so on are there
    float shear_, bulk_, melt_shear_;
    float slip_allowed_; // m^2
    StressLoop stress_ = widest_stress();

    // From the reference alone.
    MlsNeighbours neighbours_;
    std::vector<float> hourglass_; // z over the shear modulus
    std::vector<std::vector<Index>> colors_;
    float unit_rate_ = 0; // rate over the largest stiffness

    // State.
    Vectors reference_;
    std::vector<Mat3f> stored_, renewed_; // D, and D at the last renewal
    std::vector<float> temperature_;      // K
    bool wants_renewal_ = false;

    // Of melts; empty for others.
    std::vector<float> packing_; // the product of two is a pair's stiffness, N/m
    float packed_ = 0, packing_scale_ = 0, packing_rate_ = 0;

    // Scratch and what follows from the state.
    std::vector<Moduli> moduli_;
    std::vector<Float4> position_;
    std::vector<Columns> columns_; // F, then B of the force loop
};

} // namespace

std::unique_ptr<Elasticity> make_meshfree_elasticity(const Body& body, const RunContext& context) {
    return std::make_unique<MeshfreeElasticity>(body, context);
}

} // namespace filigree
