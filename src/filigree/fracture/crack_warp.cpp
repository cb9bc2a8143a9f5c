#include "filigree/fracture/crack_warp.h"

#include "filigree/core/math.h"
#include "filigree/core/random.h"

#include <Eigen/LU>

namespace filigree {

namespace {

constexpr int kOctaves = 3; ///< of the map; finer ones only raise what lies on a crack
constexpr double kHurst = 0.8;
constexpr double kFineGain = 2.5; ///< heights may be steep where a map of space may not
constexpr double kSteepest = 5;   ///< sum of |gradient| of value_noise is below this (a test looks for more)
constexpr double kMostBending = 0.9;
constexpr double kGridShare = 0.98; ///< of the grid's half, so that rounding stays within

double gain_of(int octave) { return math::pow(2.0, -kHurst * octave); }

} // namespace

namespace {

/// With or without the gradient, which the compiler then leaves out.
template <bool with_gradient>
Vec3d value_noise_of(const Vec3d& point, std::uint64_t seed, Mat3d* gradient) {
    std::array<std::array<double, 2>, 3> weight, slope; // of the lower and upper lattice point, each axis
    std::array<std::array<std::uint64_t, 2>, 3> coordinate;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double at = point[static_cast<int>(axis)], floor = std::floor(at);
        const double x = at - floor, smooth = x * x * x * (x * (x * 6 - 15) + 10);
        weight[axis] = {1 - smooth, smooth};
        const double rise = 30 * x * x * (x - 1) * (x - 1);
        slope[axis] = {-rise, rise};
        for (std::size_t step = 0; step < 2; ++step)
            coordinate[axis][step] = ((static_cast<std::uint64_t>(static_cast<std::int64_t>(floor)) + step) & 0x1fffff)
                                     << (21 * axis);
    }
    Vec3d sum = Vec3d::Zero();
    if constexpr (with_gradient) gradient->setZero();
    for (std::size_t corner = 0; corner < 8; ++corner) {
        const std::size_t x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
        const std::uint64_t bits = random_bits(seed, coordinate[0][x] | coordinate[1][y] | coordinate[2][z]);
        constexpr double kUnit = 1.0 / (1 << 20);
        const Vec3d value(double(static_cast<std::int64_t>(bits & 0x1fffff)) * kUnit - 1,
                          double(static_cast<std::int64_t>(bits >> 21 & 0x1fffff)) * kUnit - 1,
                          double(static_cast<std::int64_t>(bits >> 42 & 0x1fffff)) * kUnit - 1);
        sum += weight[0][x] * weight[1][y] * weight[2][z] * value;
        if constexpr (with_gradient) {
            gradient->col(0) += slope[0][x] * weight[1][y] * weight[2][z] * value;
            gradient->col(1) += weight[0][x] * slope[1][y] * weight[2][z] * value;
            gradient->col(2) += weight[0][x] * weight[1][y] * slope[2][z] * value;
        }
    }
    return sum;
}

} // namespace

Vec3d value_noise(const Vec3d& point, std::uint64_t seed, Mat3d* gradient) {
    return gradient ? value_noise_of<true>(point, seed, gradient) : value_noise_of<false>(point, seed, nullptr);
}

CrackWarp::CrackWarp(const CrackWarpOptions& options) : centre_(options.box.centre()), seed_(options.seed) {
    if (options.roughness > 0) {
        double bending = 0;
        for (int octave = 0; octave < kOctaves; ++octave)
            bending += kSteepest * math::exp2(double(octave)) * gain_of(octave);
        const double amplitude = options.roughness * kMostBending / bending * options.wavelength;
        frequency_ = 1 / options.wavelength;
        for (int octave = 0; octave < kAllOctaves; ++octave)
            amplitude_[octave] = (octave < kOctaves ? 1 : kFineGain) * amplitude * gain_of(octave);
    }
    const Mat3d shrink = Mat3d::Identity() - (1 - 1 / options.stretch) * options.grain * options.grain.transpose();
    const Vec3d half = 0.5 * options.box.size() + Vec3d::Constant(reach());
    const double extent =
        std::max((shrink.cwiseAbs() * half).maxCoeff(), 1e-60); // all in one point; its third power has an inverse
    scale_ = kGridShare * kGridHalf / extent;
    to_linear_ = scale_ * shrink;
    from_linear_ = to_linear_.inverse();
    tolerance_ = 1e-12 * half.maxCoeff();
}

double CrackWarp::reach() const {
    double sum = 0;
    for (int octave = 0; octave < kOctaves; ++octave) sum += amplitude_[octave];
    return sum;
}

double CrackWarp::finest_wavelength() const { return is_rough() ? math::exp2(1.0 - kOctaves) / frequency_ : 0; }

Vec3d CrackWarp::noise(const Vec3d& point, Mat3d* gradient) const {
    Vec3d sum = Vec3d::Zero();
    if (gradient) gradient->setZero();
    for (int octave = 0; octave < kOctaves; ++octave) {
        const double frequency = frequency_ * (1 << octave), amplitude = amplitude_[octave];
        Mat3d slope;
        sum += amplitude *
               value_noise(frequency * point, seed_ + static_cast<std::uint64_t>(octave), gradient ? &slope : nullptr);
        if (gradient) *gradient += amplitude * frequency * slope;
    }
    return sum;
}

int CrackWarp::fine_octaves(double shortest) const {
    int octaves = 0;
    while (kOctaves + octaves < kAllOctaves && 1.0 / (1 << (kOctaves + octaves)) / frequency_ >= shortest) ++octaves;
    return octaves;
}

double CrackWarp::fine_height(const Vec3d& point, double shortest) const {
    double height = 0;
    for (int octave = kOctaves; octave < kOctaves + fine_octaves(shortest); ++octave)
        height += amplitude_[octave] * value_noise(frequency_ * (1 << octave) * (point - centre_),
                                                   seed_ + static_cast<std::uint64_t>(octave), nullptr)[0];
    return height;
}

double CrackWarp::fine_reach(double shortest) const {
    double sum = 0;
    for (int octave = kOctaves; octave < kOctaves + fine_octaves(shortest); ++octave) sum += amplitude_[octave];
    return sum;
}

Vec3d CrackWarp::to_grid(const Vec3d& point) const {
    const Vec3d from_centre = point - centre_;
    return to_linear_ * (is_rough() ? Vec3d(from_centre + noise(from_centre, nullptr)) : from_centre);
}

Vec3d CrackWarp::from_grid(const Vec3d& grid) const {
    const Vec3d target = from_linear_ * grid;
    if (!is_rough()) return centre_ + target;
    Vec3d x = target - noise(target, nullptr);
    constexpr int kMostSteps = 40;
    for (int step = 0; step < kMostSteps; ++step) {
        Mat3d gradient;
        const Vec3d off = x + noise(x, &gradient) - target;
        const double size = off.cwiseAbs().maxCoeff();
        if (size < tolerance_) break;
        // Far away Newton's step may not come nearer; the plain step always does, as the noise's steps are below 1.
        const bool near = size < 0.05 / frequency_;
        x -= near ? Vec3d((Mat3d::Identity() + gradient).inverse() * off) : off;
    }
    return centre_ + x;
}

} // namespace filigree
