// Based on:
//   [Barr 1984] Global and local deformations of solid primitives: twist, taper and bend with their Jacobians, and
//   normals by the cofactor matrix. Ours differ in that the bend's arc is written by its chord, which needs one sine
//   and cosine and stays exact as the angle goes to zero. [Carr 2001] Reconstruction and representation of 3D objects
//   with radial basis functions: the kernel r^3. The affine part is split off by a QR factorisation, so that centres on
//   a plane or a line need no special case.
#include "filigree/pose.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh/normals.h"

#include <Eigen/Geometry>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <random>

namespace filigree {
namespace {

constexpr std::size_t kSpaceWarpGrain = 4096; // points a piece: long enough to hide the cost of a task
constexpr double kThin = 1e-9;                // of the diagonal; a box shorter than this has no length to bend along
constexpr double kBumpDeviation = 0.35;       // of the diagonal

/// A warp from one formula for position and gradient. Where only the position is asked for, the compiler drops the
/// rest.
template <class Formula>
class FormulaWarp final : public SpaceWarp {
public:
    explicit FormulaWarp(const Formula& formula) : formula_(formula) {}
    Vec3d position(const Vec3d& point) const override { return formula_(point).position; }
    Warped warp(const Vec3d& point) const override { return formula_(point); }

private:
    Formula formula_;
};

template <class Formula>
std::unique_ptr<SpaceWarp> make_warp(const Formula& formula) {
    return std::make_unique<FormulaWarp<Formula>>(formula);
}

std::unique_ptr<SpaceWarp> make_identity() {
    return make_warp([](const Vec3d& p) { return Warped{p, Mat3d::Identity()}; });
}

/// A box along one of its axes: `along`, and the two axes across it in cyclic order.
struct AxisBasis {
    int along, across, across2;
    Vec3d centre;
    double low, high, length;
    bool thin;

    AxisBasis(const Box& box, Axis axis)
        : along(static_cast<int>(axis)), across((along + 1) % 3), across2((along + 2) % 3), centre(box.centre()),
          low(box.min[along]), high(box.max[along]), length(box.size()[along]),
          thin(!(length > kThin * box.diagonal())) {}

    bool contains(double x) const { return low <= x && x <= high; }
    double clamp(double x) const { return std::clamp(x, low, high); }
};

/// Scales about the centre of the basis's box.
std::unique_ptr<SpaceWarp> make_scale(const AxisBasis& basis, double along, double across) {
    Vec3d scale = Vec3d::Constant(across);
    scale[basis.along] = along;
    return make_warp([scale, centre = basis.centre](const Vec3d& p) {
        return Warped{centre + scale.cwiseProduct(p - centre), scale.asDiagonal()};
    });
}

/// A double in [0, 1) from the generator's upper 53 bits; std::uniform_real_distribution differs between libraries.
double uniform(std::mt19937_64& generator) { return static_cast<double>(generator() >> 11) * 0x1p-53; }

Vec3d uniform3(std::mt19937_64& generator) {
    const double x = uniform(generator), y = uniform(generator), z = uniform(generator);
    return {x, y, z};
}

class ChainWarp final : public SpaceWarp {
public:
    explicit ChainWarp(std::vector<std::unique_ptr<SpaceWarp>> warps) : warps_(std::move(warps)) {}

    Vec3d position(const Vec3d& point) const override {
        Vec3d p = point;
        for (const auto& warp : warps_) p = warp->position(p);
        return p;
    }
    Warped warp(const Vec3d& point) const override {
        Warped result{point, Mat3d::Identity()};
        for (const auto& warp : warps_) {
            const Warped next = warp->warp(result.position);
            result = {next.position, next.gradient * result.gradient};
        }
        return result;
    }

private:
    std::vector<std::unique_ptr<SpaceWarp>> warps_;
};

/// p + sum of w_i |u - c_i|^3 + affine (u, 1), u = (p - centre) / radius.
class RbfWarp final : public SpaceWarp {
public:
    RbfWarp(std::span<const Vec3d> centres, std::span<const Vec3d> displacements) {
        for (const Vec3d& c : centres) centre_ += c / static_cast<double>(centres.size());
        for (const Vec3d& c : centres) radius_ = std::max(radius_, (c - centre_).norm());
        if (radius_ == 0) radius_ = 1; // one place: any scale will do
        solve(centres, displacements);
    }

    Vec3d position(const Vec3d& point) const override { return evaluate<false>(point).position; }
    Warped warp(const Vec3d& point) const override { return evaluate<true>(point); }

private:
    // A fixed number of partial sums, so that the order of additions is fixed too. With two, the gradient's twelve sums
    // stay in registers: 1.35 times as fast as four for 200 centres.
    using Lanes = Eigen::Array2d;
    static constexpr Eigen::Index kLanes = 2;
    struct Block {
        std::array<Lanes, 3> centre, weight; // kLanes centres; the last block is filled up with zero weights
    };

    void solve(std::span<const Vec3d> centres, std::span<const Vec3d> displacements);
    template <bool with_gradient>
    Warped evaluate(const Vec3d& point) const;

    Vec3d centre_ = Vec3d::Zero();
    double radius_ = 0;
    std::vector<Block> blocks_;
    Mat3d linear_ = Mat3d::Zero();
    Vec3d constant_ = Vec3d::Zero();
};

/// The weights are orthogonal to the affine functions on the centres, w = Z y with Z from a QR factorisation; there the
/// kernel matrix is positive definite. The affine part takes what is left, with the smallest coefficients that do.
void RbfWarp::solve(std::span<const Vec3d> centres, std::span<const Vec3d> displacements) {
    const auto n = static_cast<Eigen::Index>(centres.size());
    Eigen::MatrixX3d u(n, 3), d(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
        u.row(i) = (centres[i] - centre_).transpose() / radius_;
        d.row(i) = displacements[i].transpose();
    }
    Eigen::MatrixXd kernel(n, n), affine(n, 4);
    for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index j = 0; j < n; ++j) kernel(i, j) = math::pow((u.row(i) - u.row(j)).norm(), 3);
    affine << u, Eigen::VectorXd::Ones(n);

    const Eigen::MatrixXd z = orthogonal_complement(affine);
    Eigen::MatrixX3d weights = Eigen::MatrixX3d::Zero(n, 3);
    if (z.cols() > 0) // else so few centres that an affine map does it
        weights = z * least_squares(z.transpose() * kernel * z, z.transpose() * d);
    const Eigen::MatrixX3d coefficients = least_squares(affine, d - kernel * weights);
    linear_ = coefficients.topRows(3).transpose();
    constant_ = coefficients.row(3).transpose();

    blocks_.assign(static_cast<std::size_t>((n + kLanes - 1) / kLanes),
                   {{Lanes::Zero(), Lanes::Zero(), Lanes::Zero()}, {Lanes::Zero(), Lanes::Zero(), Lanes::Zero()}});
    for (Eigen::Index i = 0; i < n; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            blocks_[i / kLanes].centre[k][i % kLanes] = u(i, k);
            blocks_[i / kLanes].weight[k][i % kLanes] = weights(i, k);
        }
}

template <bool with_gradient>
Warped RbfWarp::evaluate(const Vec3d& point) const {
    const Vec3d u = (point - centre_) / radius_;
    std::array<Lanes, 3> sum;
    std::array<std::array<Lanes, 3>, 3> slope; // slope[r][c]: of component r in direction c
    sum.fill(Lanes::Zero());
    if constexpr (with_gradient) slope.fill(sum);
    for (const Block& block : blocks_) {
        const std::array<Lanes, 3> d = {u.x() - block.centre[0], u.y() - block.centre[1], u.z() - block.centre[2]};
        const Lanes squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        const Lanes r = squared.sqrt(), cubed = r * squared;
        for (std::size_t i = 0; i < 3; ++i) {
            sum[i] += block.weight[i] * cubed;
            if constexpr (with_gradient) {
                const Lanes weighted = block.weight[i] * r;
                for (std::size_t k = 0; k < 3; ++k) slope[i][k] += weighted * d[k];
            }
        }
    }
    const Vec3d bent(sum[0].sum(), sum[1].sum(), sum[2].sum());
    Warped result{point + bent + linear_ * u + constant_, Mat3d::Identity()};
    if constexpr (with_gradient)
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t k = 0; k < 3; ++k) // d |u|^3 / du = 3 |u| u
                result.gradient(i, k) += (3 * slope[i][k].sum() + linear_(i, k)) / radius_;
    return result;
}

void warp_normals(const SpaceWarp& warp, Mesh& mesh, const RunContext& context) {
    const std::vector<Index> vertex_of = split_shared_normals(mesh);
    parallel_for(context, vertex_of.size(), kSpaceWarpGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (vertex_of[i] == kNoIndex) continue;
            Vec3f& normal = mesh.normals.values[i];
            const Mat3d A = warp.warp(mesh.world_position(vertex_of[i])).gradient;
            const Vec3d turned = cofactor(A) * normal.cast<double>();
            const double length = turned.norm();
            if (length > 0) normal = (turned / length).cast<float>(); // else no direction: keep what there is
        }
    });
}

std::optional<Error> check_factor(const std::string& what, double factor) {
    if (factor > 0 && std::isfinite(factor)) return std::nullopt;
    return Error{ErrorCode::usage, "The factor of a " + what + " has to be a number above 0."};
}

} // namespace

Result<std::unique_ptr<SpaceWarp>> make_stretch(const Box& box, Axis axis, double factor) {
    if (factor == 0 || !std::isfinite(factor))
        return Error{ErrorCode::usage, "The factor of a stretch has to be a number other than 0."};
    return make_scale(AxisBasis(box, axis), factor, 1);
}

Result<std::unique_ptr<SpaceWarp>> make_squeeze(const Box& box, Axis axis, double factor) {
    if (std::optional<Error> error = check_factor("squeeze", factor)) return *error;
    return make_scale(AxisBasis(box, axis), factor, 1 / std::sqrt(factor));
}

std::unique_ptr<SpaceWarp> make_bend(const Box& box, Axis axis, double degrees) {
    const AxisBasis f(box, axis);
    if (f.thin) return make_identity();
    return make_warp([f, curvature = radians(degrees) / f.length](const Vec3d& p) {
        const double x = f.clamp(p[f.along]) - f.centre[f.along], beyond = p[f.along] - f.centre[f.along] - x;
        const double y = p[f.across] - f.centre[f.across];
        // An arc of length x that turns by 2 h has a chord of length x sin(h) / h in the direction h.
        const double h = 0.5 * curvature * x, sin_h = math::sin(h), cos_h = math::cos(h);
        const double chord = h == 0 ? x : x * sin_h / h;
        const double sine = 2 * sin_h * cos_h, cosine = 1 - 2 * sin_h * sin_h;
        const double stretch = f.contains(p[f.along]) ? 1 - curvature * y : 1;

        Warped result{p, Mat3d::Identity()};
        result.position[f.along] = f.centre[f.along] + chord * cos_h + beyond * cosine - y * sine;
        result.position[f.across] = f.centre[f.across] + chord * sin_h + beyond * sine + y * cosine;
        result.gradient(f.along, f.along) = stretch * cosine;
        result.gradient(f.across, f.along) = stretch * sine;
        result.gradient(f.along, f.across) = -sine;
        result.gradient(f.across, f.across) = cosine;
        return result;
    });
}

std::unique_ptr<SpaceWarp> make_twist(const Box& box, Axis axis, double degrees) {
    const AxisBasis f(box, axis);
    if (f.thin) return make_identity();
    return make_warp([f, rate = radians(degrees) / f.length](const Vec3d& p) {
        const double angle = rate * (f.clamp(p[f.along]) - f.centre[f.along]);
        const double sine = math::sin(angle), cosine = math::cos(angle);
        const double y = p[f.across] - f.centre[f.across], z = p[f.across2] - f.centre[f.across2];
        const double turned_y = cosine * y - sine * z, turned_z = sine * y + cosine * z;
        const double slope = f.contains(p[f.along]) ? rate : 0;

        Warped result{p, Mat3d::Identity()};
        result.position[f.across] = f.centre[f.across] + turned_y;
        result.position[f.across2] = f.centre[f.across2] + turned_z;
        result.gradient(f.across, f.across) = result.gradient(f.across2, f.across2) = cosine;
        result.gradient(f.across, f.across2) = -sine;
        result.gradient(f.across2, f.across) = sine;
        result.gradient(f.across, f.along) = -slope * turned_z;
        result.gradient(f.across2, f.along) = slope * turned_y;
        return result;
    });
}

Result<std::unique_ptr<SpaceWarp>> make_taper(const Box& box, Axis axis, double factor) {
    if (std::optional<Error> error = check_factor("taper", factor)) return *error;
    const AxisBasis f(box, axis);
    if (f.thin) return make_identity();
    return make_warp([f, rate = (factor - 1) / f.length](const Vec3d& p) {
        const double scale = 1 + rate * (f.clamp(p[f.along]) - f.low);
        const double slope = f.contains(p[f.along]) ? rate : 0;
        Warped result{p, Mat3d::Identity()};
        for (const int k : {f.across, f.across2}) {
            result.position[k] = f.centre[k] + scale * (p[k] - f.centre[k]);
            result.gradient(k, k) = scale;
            result.gradient(k, f.along) = slope * (p[k] - f.centre[k]);
        }
        return result;
    });
}

std::unique_ptr<SpaceWarp> make_smooth_random(const Box& box, double amplitude, std::uint64_t seed) {
    struct Bump {
        Vec3d centre, displacement;
    };
    if (!(box.diagonal() > 0)) return make_identity();
    std::mt19937_64 generator(seed);
    std::array<Bump, 8> bumps;
    double longest = 0;
    for (Bump& bump : bumps) {
        bump.centre = box.min + uniform3(generator).cwiseProduct(box.size());
        bump.displacement = 2 * uniform3(generator) - Vec3d::Ones();
        longest = std::max(longest, bump.displacement.norm());
    }
    for (Bump& bump : bumps) bump.displacement *= amplitude * box.diagonal() / longest;

    const double inverse_variance = 1 / math::pow(kBumpDeviation * box.diagonal(), 2);
    return make_warp([bumps, inverse_variance](const Vec3d& p) {
        Warped result{p, Mat3d::Identity()};
        for (const Bump& bump : bumps) {
            const Vec3d d = p - bump.centre;
            const double height = math::exp(-0.5 * inverse_variance * d.squaredNorm());
            result.position += height * bump.displacement;
            result.gradient -= bump.displacement * (inverse_variance * height * d).transpose();
        }
        return result;
    });
}

std::unique_ptr<SpaceWarp> make_rbf(std::span<const Vec3d> centres, std::span<const Vec3d> displacements) {
    assert(centres.size() == displacements.size());
    if (centres.empty()) return make_identity();
    return std::make_unique<RbfWarp>(centres, displacements);
}

Axis longest_axis(const Box& box) {
    int longest = 0;
    box.size().maxCoeff(&longest);
    return static_cast<Axis>(longest);
}

std::unique_ptr<SpaceWarp> make_chain(std::vector<std::unique_ptr<SpaceWarp>> warps) {
    return std::make_unique<ChainWarp>(std::move(warps));
}

std::vector<Vec3f> warp_positions(const SpaceWarp& warp, std::span<const Vec3f> positions, const Vec3d& origin,
                                  const RunContext& context) {
    std::vector<Vec3f> warped(positions.size());
    parallel_for(context, positions.size(), kSpaceWarpGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            warped[i] = (warp.position(origin + positions[i].cast<double>()) - origin).cast<float>();
    });
    return warped;
}

Pose warp_pose(const SpaceWarp& warp, std::span<const Vec3f> positions, const Vec3d& origin,
               const RunContext& context) {
    Pose pose;
    pose.positions.resize(positions.size());
    pose.gradients.resize(positions.size());
    parallel_for(context, positions.size(), kSpaceWarpGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Warped warped = warp.warp(origin + positions[i].cast<double>());
            pose.positions[i] = (warped.position - origin).cast<float>();
            pose.gradients[i] = warped.gradient.cast<float>();
        }
    });
    return pose;
}

Pose warp_pose(const SpaceWarp& warp, const Model& model, const RunContext& context) {
    return warp_pose(warp, driver_positions(model), model.mesh.origin, context);
}

void warp_mesh(const SpaceWarp& warp, Mesh& mesh, const RunContext& context) {
    warp_normals(warp, mesh, context); // first: it needs the rest positions
    mesh.positions = warp_positions(warp, mesh.positions, mesh.origin, context);
}

} // namespace filigree
