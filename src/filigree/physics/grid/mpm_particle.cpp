#include "filigree/physics/grid/mpm_particle.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace filigree::mpm {

namespace {

constexpr float kElasticStep = 0.4f;     ///< of the time in which a pressure wave crosses a cell
constexpr float kViscousStep = 0.12f;    ///< of density spacing^2 / viscosity
constexpr float kConductionStep = 0.15f; ///< of spacing^2 / diffusivity
constexpr float kViscousShare = 4;       ///< how many times shorter than elasticity's viscosity may make steps
constexpr float kRenewedStrain = 0.8f;   ///< plastic strain from which on matter counts as new
constexpr float kRenewedLiquid = 1.25f;  ///< per fluid part
constexpr float kLeastVolumeRatio = 0.1f, kMostVolumeRatio = 4;

/// Many particles' numbers, one a lane.
template <int N>
struct ParticleLanes {
    using Float = typename Lanes<N>::Float;
    using Int = typename Lanes<N>::Int;
    using Symmetric = Float[6];

    static FILIGREE_INLINE Float all(float x) { return Float{} + x; }
    static FILIGREE_INLINE Float most(Float a, Float b) { return a < b ? b : a; }
    static FILIGREE_INLINE Float clamped(Float x, float least, float most) {
        x = x < all(least) ? all(least) : x;
        return x > all(most) ? all(most) : x;
    }

    /// 1 / x^(1/3) for x > 0 to float precision, by plain arithmetic: a guess from the exponent, and Newton's steps,
    /// each of which doubles the digits.
    static FILIGREE_INLINE Float inverse_cube_root(Float x) {
        const Float third = __builtin_convertvector((Int)x, Float) * (1.0f / 3);
        Float y = (Float)(0x54a21d2a - __builtin_convertvector(third, Int));
        for (int step = 0; step < 3; ++step) y += y * (1 - x * y * y * y) * (1.0f / 3);
        return y;
    }

    static FILIGREE_INLINE Float norm(const Symmetric& s) {
        const Float squared = s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + 2 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]);
        return squared * inverse_sqrt(squared);
    }

    static FILIGREE_INLINE Float determinant(const Symmetric& s) {
        return s[0] * (s[1] * s[2] - s[5] * s[5]) - s[3] * (s[3] * s[2] - s[5] * s[4]) +
               s[4] * (s[3] * s[5] - s[1] * s[4]);
    }

    /// f b f^T, with f's columns.
    static FILIGREE_INLINE void push_forward(const Float (&f)[3][3], const Symmetric& b, Symmetric& out) {
        Float fb[3][3]; // rows
        for (int r = 0; r < 3; ++r) {
            fb[r][0] = f[0][r] * b[0] + f[1][r] * b[3] + f[2][r] * b[4];
            fb[r][1] = f[0][r] * b[3] + f[1][r] * b[1] + f[2][r] * b[5];
            fb[r][2] = f[0][r] * b[4] + f[1][r] * b[5] + f[2][r] * b[2];
        }
        constexpr int kRow[6] = {0, 1, 2, 0, 0, 1}, kColumn[6] = {0, 1, 2, 1, 2, 2};
        for (int i = 0; i < 6; ++i) {
            const int r = kRow[i], c = kColumn[i];
            out[i] = fb[r][0] * f[0][c] + fb[r][1] * f[1][c] + fb[r][2] * f[2][c];
        }
    }

    /// d + I t with determinant 1, for a deviator d: two Newton steps from the mean there was.
    static FILIGREE_INLINE void make_determinant_one(Symmetric& d, Float mean) {
        for (int step = 0; step < 2; ++step) {
            const Symmetric b = {d[0] + mean, d[1] + mean, d[2] + mean, d[3], d[4], d[5]};
            const Float slope = b[0] * b[1] + b[1] * b[2] + b[2] * b[0] - b[3] * b[3] - b[4] * b[4] - b[5] * b[5];
            mean -= (determinant(b) - 1) / most(slope, all(1e-3f));
        }
        for (int i = 0; i < 3; ++i) d[i] += mean;
    }
};

/// The numbers of a particle that deform reads and writes, of several particles.
template <int N>
struct alignas(64) Deforming {
    float c[9][N], b[6][N], ratio[N], strain[N], enthalpy[N], renewal[N], melted[N];

    FILIGREE_INLINE void read(int lane, const Particle& p) {
        for (int k = 0; k < 9; ++k) c[k][lane] = p.c[k / 3][k % 3];
        for (int k = 0; k < 6; ++k) b[k][lane] = p.b[k];
        ratio[lane] = p.volume_ratio();
        strain[lane] = p.plastic_strain();
        enthalpy[lane] = p.enthalpy();
        renewal[lane] = p.renewal;
        melted[lane] = p.melted;
    }
    FILIGREE_INLINE void write(int lane, Particle& p) const {
        for (int k = 0; k < 6; ++k) p.b[k] = b[k][lane];
        p.volume_ratio() = ratio[lane];
        p.plastic_strain() = strain[lane];
        p.renewal = renewal[lane];
        p.melted = melted[lane];
    }
};

} // namespace

bool Particle::is_sound() const {
    const auto* const numbers = reinterpret_cast<const float*>(this);
    const auto is_finite = [](float number) { return std::isfinite(number); };
    return std::all_of(numbers, numbers + sizeof(Particle) / sizeof(float), is_finite) &&
           volume_ratio() >= kLeastVolumeRatio && volume_ratio() <= kMostVolumeRatio && enthalpy() >= 0;
}

Matter::Matter(const Material& material, double heat_pace)
    : density_(float(material.density)), yield_(float(material.yield_stress)), viscosity_(float(material.viscosity)),
      damping_(float(material.damping)), melting_from_(float(material.melting_from)),
      melting_to_(float(material.melting_to)), specific_heat_(float(material.specific_heat)),
      latent_heat_(float(material.latent_heat)), diffusivity_(float(material.conductivity * heat_pace)),
      heating_(float(material.heating * heat_pace)), melts_(material.melts()) {
    const LameParameters lame = lame_parameters(material.young_modulus, material.poisson_ratio);
    shear_ = float(lame.mu);
    bulk_ = float(lame.lambda + 2 * lame.mu / 3);
    if (melts_) yield_ = std::min(yield_, shear_); // so that it fades to nothing as it melts
    has_heat_ = melts_ || diffusivity_ > 0 || heating_ != 0;
}

float Matter::enthalpy(float temperature) const {
    const float sensible = specific_heat_ * temperature;
    if (!melts_ || temperature <= melting_from_) return sensible;
    if (temperature >= melting_to_) return sensible + latent_heat_;
    return sensible + latent_heat_ * (temperature - melting_from_) / (melting_to_ - melting_from_);
}

float Matter::liquid(float enthalpy) const {
    if (!melts_) return 0;
    const float from = specific_heat_ * melting_from_, to = specific_heat_ * melting_to_ + latent_heat_;
    return to > from ? std::clamp((enthalpy - from) / (to - from), 0.0f, 1.0f) : enthalpy >= to ? 1.0f : 0.0f;
}

float Matter::temperature(float enthalpy) const {
    const float l = liquid(enthalpy);
    if (l <= 0) return enthalpy / specific_heat_;
    if (l >= 1) return (enthalpy - latent_heat_) / specific_heat_;
    return melting_from_ + l * (melting_to_ - melting_from_);
}

float Matter::longest_elastic_step(float grid_spacing) const {
    return kElasticStep * grid_spacing / std::sqrt((bulk_ + 4.0f / 3 * shear_) / density_);
}

float Matter::longest_step(float grid_spacing) const {
    float step = longest_elastic_step(grid_spacing);
    if (melts_) step = std::min(step, kViscousStep * density_ * grid_spacing * grid_spacing / viscosity_);
    if (diffusivity_ > 0) step = std::min(step, kConductionStep * grid_spacing * grid_spacing / diffusivity_);
    return step;
}

void Matter::limit_viscosity(float grid_spacing) {
    const float shortest = longest_elastic_step(grid_spacing) / kViscousShare;
    viscosity_ = std::min(viscosity_, kViscousStep * density_ * grid_spacing * grid_spacing / shortest);
}

void Matter::stress(const Particle& p, float stress[6]) const {
    const float l = liquid(p.enthalpy()), j = p.volume_ratio();
    const float mean = (p.b[0] + p.b[1] + p.b[2]) / 3, shear = shear_ * (1 - l);
    float pressure = 0.5f * bulk_ * (j * j - 1);
    if (j > 1) pressure *= 1 - l; // melt does not pull
    for (int i = 0; i < 6; ++i) stress[i] = shear * p.b[i];
    for (int i = 0; i < 3; ++i) stress[i] += pressure - shear * mean;
    if (l > 0) {
        const float viscous = 2 * viscosity_ * l * j;
        const float divergence = (p.c[0][0] + p.c[1][1] + p.c[2][2]) / 3;
        for (int i = 0; i < 3; ++i) stress[i] += viscous * (p.c[i][i] - divergence);
        stress[3] += viscous * 0.5f * (p.c[1][0] + p.c[0][1]);
        stress[4] += viscous * 0.5f * (p.c[2][0] + p.c[0][2]);
        stress[5] += viscous * 0.5f * (p.c[2][1] + p.c[1][2]);
    }
    for (int i = 0; i < 6; ++i) stress[i] *= p.volume;
}

template <int N>
FILIGREE_INLINE void Matter::deform_lanes(std::span<const std::uint32_t> numbers, Particle* particles, float dt) const {
    using P = ParticleLanes<N>;
    using L = Lanes<N>;
    using Float = typename L::Float;
    const float from = specific_heat_ * melting_from_, to = specific_heat_ * melting_to_ + latent_heat_;
    const float most_solid = std::sqrt(2.0f / 3) * yield_ / shear_;
    for (std::size_t first = 0; first < numbers.size(); first += N) {
        const auto count = int(std::min<std::size_t>(N, numbers.size() - first));
        Deforming<N> at;
        for (int lane = 0; lane < N; ++lane)
            at.read(lane, particles[numbers[first + std::size_t(std::min(lane, count - 1))]]);

        Float f[3][3];
        for (int k = 0; k < 9; ++k) f[k / 3][k % 3] = dt * L::load(at.c[k]) + (k % 4 == 0 ? 1.0f : 0.0f);
        const Float det = f[0][0] * (f[1][1] * f[2][2] - f[2][1] * f[1][2]) -
                          f[1][0] * (f[0][1] * f[2][2] - f[2][1] * f[0][2]) +
                          f[2][0] * (f[0][1] * f[1][2] - f[1][1] * f[0][2]);
        L::store(at.ratio,
                 P::clamped(L::load(at.ratio) * P::clamped(det, 0.3f, 3.0f), kLeastVolumeRatio, kMostVolumeRatio));
        Float before[6], b[6];
        for (int i = 0; i < 6; ++i) before[i] = L::load(at.b[i]);
        P::push_forward(f, before, b);
        const Float shrink =
            P::inverse_cube_root(P::clamped(P::determinant(b), 0.03f, 30.0f)); // by its own: rounding adds up
        for (Float& entry : b) entry *= shrink;

        Float l = {};
        const Float enthalpy = L::load(at.enthalpy);
        if (melts_ && to > from) l = P::clamped((enthalpy - from) / (to - from), 0, 1);
        if (melts_ && !(to > from)) l = enthalpy >= P::all(to) ? P::all(1) : P::all(0);
        const Float mean = (b[0] + b[1] + b[2]) / 3;
        Float d[6] = {b[0] - mean, b[1] - mean, b[2] - mean, b[3], b[4], b[5]};
        const Float size = P::norm(d), most = most_solid * (1 - l);
        const auto keeps = size <= most && size < P::all(10);
        const Float kept = size < P::all(1e6f) ? most / size : P::all(0);
        for (Float& entry : d) entry *= kept;
        const Float flowed = std::sqrt(2.0f / 3) * 0.5f * (size - most) / P::most(mean, P::all(1));
        const Float strain = L::load(at.strain);
        const Float strained = keeps || l > P::all(0) ? strain : strain + flowed;
        P::make_determinant_one(d, P::most(mean * kept, P::all(1)));
        for (int i = 0; i < 6; ++i) L::store(at.b[i], keeps ? b[i] : d[i]);
        L::store(at.strain, strained);
        const Float renewed = P::clamped(P::most(kRenewedLiquid * l, strained - kRenewedStrain), 0, 1);
        L::store(at.renewal, P::most(L::load(at.renewal), renewed));
        L::store(at.melted, l >= P::all(1) ? P::all(1) : L::load(at.melted));
        for (int lane = 0; lane < count; ++lane) at.write(lane, particles[numbers[first + std::size_t(lane)]]);
    }
}

#ifdef FILIGREE_HAS_WIDTHS
FILIGREE_AVX2 void Matter::deform_wide(std::span<const std::uint32_t> numbers, Particle* particles, float dt) const {
    deform_lanes<8>(numbers, particles, dt);
}
#endif

void Matter::deform(std::span<const std::uint32_t> numbers, Particle* particles, float dt, VectorWidth width) const {
#ifdef FILIGREE_HAS_WIDTHS
    if (width != VectorWidth::bytes16) return deform_wide(numbers, particles, dt);
#endif
    deform_lanes<4>(numbers, particles, dt);
}

double Matter::energy(const Particle& p) const {
    const double j = double(p.volume_ratio()), l = double(liquid(p.enthalpy()));
    const double trace = double(p.b[0] + p.b[1] + p.b[2]) - 3;
    double volumetric = 0.5 * double(bulk_) * (0.5 * (j * j - 1) - math::log(j));
    if (j > 1) volumetric *= 1 - l;
    return double(p.volume) * (0.5 * double(shear_) * (1 - l) * trace + volumetric);
}

} // namespace filigree::mpm
