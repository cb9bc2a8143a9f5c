#include "filigree/fracture/crack_warp.h"

#include "filigree/core/random.h"

#include <Eigen/LU>

namespace filigree {

namespace {

constexpr int kOctaves = 3;
constexpr double kHurst = 0.8;
constexpr double kSteepest = 5; ///< sum of |gradient| of value_noise is below this (a test looks for more)
constexpr double kMostBending = 0.9;
constexpr double kGridShare = 0.98; ///< of the grid's half, so that rounding stays within

double octave_gain(int octave) { return std::pow(2.0, -kHurst * octave); }

} // namespace

Vec3d value_noise(const Vec3d& point, std::uint64_t seed, Mat3d* gradient) {
    const Vec3d floor = point.array().floor();
    const Vec3d t = point - floor;
    std::array<std::array<double, 2>, 3> weight, slope; // of the lower and upper lattice point, each axis
    for (int axis = 0; axis < 3; ++axis) {
        const double x = t[axis], smooth = x * x * x * (x * (x * 6 - 15) + 10);
        weight[axis] = {1 - smooth, smooth};
        const double rise = 30 * x * x * (x - 1) * (x - 1);
        slope[axis] = {-rise, rise};
    }
    const auto coordinate = [&](int axis, int step) {
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(floor[axis]) + step) & 0x1fffff;
    };
    Vec3d sum = Vec3d::Zero();
    if (gradient) gradient->setZero();
    for (int corner = 0; corner < 8; ++corner) {
        const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
        const std::uint64_t bits =
            random_bits(seed, coordinate(0, x) | coordinate(1, y) << 21 | coordinate(2, z) << 42);
        constexpr double kUnit = 1.0 / (1 << 20);
        const Vec3d value(double(bits & 0x1fffff) * kUnit - 1, double(bits >> 21 & 0x1fffff) * kUnit - 1,
                          double(bits >> 42 & 0x1fffff) * kUnit - 1);
        sum += weight[0][x] * weight[1][y] * weight[2][z] * value;
        if (gradient) {
            gradient->col(0) += slope[0][x] * weight[1][y] * weight[2][z] * value;
            gradient->col(1) += weight[0][x] * slope[1][y] * weight[2][z] * value;
            gradient->col(2) += weight[0][x] * weight[1][y] * slope[2][z] * value;
        }
    }
    return sum;
}

CrackWarp::CrackWarp(const CrackWarpOptions& options) : centre_(options.box.centre()), seed_(options.seed) {
    if (options.roughness > 0) {
        double bending = 0;
        for (int octave = 0; octave < kOctaves; ++octave)
            bending += kSteepest * std::exp2(octave) * octave_gain(octave);
        amplitude_ = options.roughness * kMostBending / bending * options.wavelength;
        frequency_ = 1 / options.wavelength;
    }
    const Mat3d shrink = Mat3d::Identity() - (1 - 1 / options.stretch) * options.grain * options.grain.transpose();
    const Vec3d half = 0.5 * options.box.size() + Vec3d::Constant(reach());
    const double extent = std::max((shrink.cwiseAbs() * half).maxCoeff(), 1e-300);
    scale_ = kGridShare * kGridHalf / extent;
    to_linear_ = scale_ * shrink;
    from_linear_ = to_linear_.inverse();
    tolerance_ = 1e-12 * half.maxCoeff();
}

double CrackWarp::reach() const {
    double sum = 0;
    for (int octave = 0; octave < kOctaves; ++octave) sum += amplitude_ * octave_gain(octave);
    return sum;
}

double CrackWarp::finest_wavelength() const { return is_rough() ? std::exp2(1 - kOctaves) / frequency_ : 0; }

Vec3d CrackWarp::noise(const Vec3d& point, Mat3d* gradient) const {
    Vec3d sum = Vec3d::Zero();
    if (gradient) gradient->setZero();
    for (int octave = 0; octave < kOctaves; ++octave) {
        const double frequency = frequency_ * std::exp2(octave), amplitude = amplitude_ * octave_gain(octave);
        Mat3d slope;
        sum += amplitude *
               value_noise(frequency * point, seed_ + static_cast<std::uint64_t>(octave), gradient ? &slope : nullptr);
        if (gradient) *gradient += amplitude * frequency * slope;
    }
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
