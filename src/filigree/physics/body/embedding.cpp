#include "filigree/physics/body/embedding.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace filigree {

namespace {

/// Cells from the middle of its own that a point may be, where parts are kept apart.
constexpr double kOfPart = 1.5;

constexpr std::size_t kEmbeddingGrain = 2048; // points in a piece of parallel work
constexpr double kRadius = 1.75;       // spacings; smaller is sharper, and 1.75 always holds a cell's eight corners
constexpr double kRadiusGrowth = 1.25; // where the particles in it do not do
constexpr int kAttempts = 6;
constexpr double kLeastWeight = -0.5; // beyond, a weight makes more of the noise of its particle than of its motion
/// Least weight of what only follows: -0.05 to -0.3 are the nearest to a body of eight times the particles, and half
/// as far from what a driver restores as without a bound (docs/bodies-theory.md).
constexpr double kFollowingWeight = -0.05;
/// 27 det / trace^3 of the particles' covariance, 1 for a round cloud: below, they count as lying in a plane.
constexpr double kSpanning = 2e-3;
constexpr double kRoundedSpread = 1e-9; ///< radii squared: a mean square of offsets below it is rounding

/// Particles sorted into the boxes of a regular grid, those of a row of boxes one after the other. Those whose
/// positions are not finite are left out.
class ParticleGrid {
public:
    ParticleGrid(const Vectors& rest, double spacing) {
        Box box;
        for (std::size_t i = 0; i < rest.size(); ++i) {
            if (!rest[i].allFinite()) continue;
            particles_.push_back(Index(i));
            box.extend(rest[i].cast<double>());
        }
        if (particles_.empty()) return;
        low_ = box.min;
        step_ = spacing;
        const double most = 8.0 * double(particles_.size()) + 4096;
        const auto counts = [&] { return ((box.size() / step_).array().floor() + 1).eval(); };
        while (counts().prod() > most) step_ *= 1.25;
        for (int axis = 0; axis < 3; ++axis) counts_[axis] = int(counts()[axis]);

        std::vector<std::size_t> box_of(particles_.size());
        offsets_.assign(std::size_t(counts_[0]) * counts_[1] * counts_[2] + 1, 0);
        for (std::size_t p = 0; p < particles_.size(); ++p) {
            const Vec3d q = (rest[particles_[p]].cast<double>() - low_) / step_;
            box_of[p] = row(int(q[1]), int(q[2])) + std::size_t(int(q[0]));
            ++offsets_[box_of[p] + 1];
        }
        for (std::size_t b = 1; b < offsets_.size(); ++b) offsets_[b] += offsets_[b - 1];
        std::vector<Index> next(offsets_.begin(), offsets_.end() - 1);
        const std::vector<Index> unsorted = particles_;
        positions_.resize(unsorted.size());
        for (std::size_t p = 0; p < unsorted.size(); ++p) {
            const Index slot = next[box_of[p]]++;
            positions_[slot] = rest[unsorted[p]].cast<double>();
            particles_[slot] = unsorted[p];
        }
    }

    bool empty() const { return particles_.empty(); }

    struct Near {
        Index particle;
        Vec3d position;
        double squared_distance;
    };
    /// Particles closer than `radius`.
    void find(const Vec3d& point, double radius, std::vector<Near>& found) const {
        found.clear();
        std::array<int, 3> begin, end;
        for (int axis = 0; axis < 3; ++axis) {
            const double at = (point[axis] - low_[axis]) / step_, reach = radius / step_;
            begin[axis] = int(std::clamp(std::floor(at - reach), 0.0, double(counts_[axis])));
            end[axis] = int(std::clamp(std::floor(at + reach) + 1, 0.0, double(counts_[axis])));
        }
        if (begin[0] >= end[0]) return;
        for (int k = begin[2]; k < end[2]; ++k)
            for (int j = begin[1]; j < end[1]; ++j) {
                const Index last = offsets_[row(j, k) + std::size_t(end[0])];
                for (Index s = offsets_[row(j, k) + std::size_t(begin[0])]; s < last; ++s) {
                    const double d = (positions_[s] - point).squaredNorm();
                    if (d < radius * radius) found.push_back({particles_[s], positions_[s], d});
                }
            }
    }

private:
    std::size_t row(int j, int k) const { return (std::size_t(k) * counts_[1] + j) * counts_[0]; }

    Vec3d low_ = Vec3d::Zero();
    double step_ = 1;
    std::array<int, 3> counts_ = {};
    std::vector<Index> offsets_, particles_;
    std::vector<Vec3d> positions_;
};

/// What lies across a gap is near a point, but does not move with it.
class ReachedCorners {
public:
    explicit ReachedCorners(const Cells* cells) : cells_(cells) {}

    /// Leaves the corners of the point's own cell and of the 26 around it; everything where it is in no cell.
    void keep(const Vec3d& point, std::vector<ParticleGrid::Near>& near) const {
        if (!cells_) return;
        if (cells_->is_parted()) return keep_joined(point, near);
        const Vec3d at = ((point - cells_->origin) / cells_->spacing).array().floor();
        if ((at.array() < 0).any() || (at.array() > 65535).any()) return;
        const std::array<int, 3> low = {int(at[0]) - 1, int(at[1]) - 1, int(at[2]) - 1};
        std::array<bool, 64> reached = {}; // corners low .. low + 3 along each axis
        if (cells_->find_cell(low[0] + 1, low[1] + 1, low[2] + 1) == kNoIndex) return;
        for (int cell = 0; cell < 27; ++cell) {
            const int i = cell % 3, j = cell / 3 % 3, k = cell / 9;
            if (cells_->find_cell(low[0] + i, low[1] + j, low[2] + k) == kNoIndex) continue;
            for (int c = 0; c < 8; ++c) reached[number(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] = true;
        }
        std::erase_if(near, [&](const ParticleGrid::Near& particle) {
            const Cells::LatticeIndex& corner = cells_->corners[particle.particle];
            const int i = corner[0] - low[0], j = corner[1] - low[1], k = corner[2] - low[2];
            return std::min({i, j, k}) < 0 || std::max({i, j, k}) > 3 || !reached[number(i, j, k)];
        });
    }

private:
    /// The same where a lattice point has several corners.
    void keep_joined(const Vec3d& point, std::vector<ParticleGrid::Near>& near) const {
        const Vec3d place = (point - cells_->origin) / cells_->spacing;
        const Index own = nearest_cell(*cells_, place);
        const Cells::LatticeIndex& low = cells_->cells[own];
        if (((place - Vec3d(low[0], low[1], low[2])).array() - 0.5).abs().maxCoeff() > kOfPart) return;
        std::vector<Index> reached;
        for (int n = 0; n < 27; ++n) {
            const Index cell = cells_->find_cell(low[0] + n % 3 - 1, low[1] + n / 3 % 3 - 1, low[2] + n / 9 - 1);
            if (cell != kNoIndex && cells_->are_joined(own, cell))
                reached.insert(reached.end(), cells_->cell_corners[cell].begin(), cells_->cell_corners[cell].end());
        }
        std::erase_if(near, [&](const ParticleGrid::Near& particle) {
            return std::ranges::find(reached, Index(particle.particle)) == reached.end();
        });
    }

    static std::size_t number(int i, int j, int k) { return std::size_t(i + 4 * j + 16 * k); }

    const Cells* cells_;
};

/// The same for a corner of cells whose particles lie in them.
class ReachedCells {
public:
    explicit ReachedCells(const Cells& cells) : cells_(cells) {}

    /// Leaves the particles in the cells around the corner and in those next to these.
    void keep(const Vec3d& corner, std::vector<ParticleGrid::Near>& near) const {
        const Vec3d at = ((corner - cells_.origin) / cells_.spacing).array().round() - 2;
        const std::array<int, 3> low = {int(at[0]), int(at[1]), int(at[2])};
        std::array<bool, 64> exists, reached = {}; // cells low .. low + 3 along each axis
        for (int n = 0; n < 64; ++n)
            exists[n] = cells_.find_cell(low[0] + n % 4, low[1] + n / 4 % 4, low[2] + n / 16) != kNoIndex;
        for (int n = 0; n < 8; ++n) { // around the corner
            const int i = 1 + (n & 1), j = 1 + (n >> 1 & 1), k = 1 + (n >> 2);
            if (!exists[number(i, j, k)]) continue;
            for (int m = 0; m < 27; ++m) reached[number(i + m % 3 - 1, j + m / 3 % 3 - 1, k + m / 9 - 1)] = true;
        }
        std::erase_if(near, [&](const ParticleGrid::Near& particle) {
            const Vec3d cell = ((particle.position - cells_.origin) / cells_.spacing).array().floor();
            const int i = int(cell[0]) - low[0], j = int(cell[1]) - low[1], k = int(cell[2]) - low[2];
            if (std::min({i, j, k}) < 0 || std::max({i, j, k}) > 3) return true;
            return exists[number(i, j, k)] && !reached[number(i, j, k)]; // on a side it may count as beyond
        });
    }

private:
    static std::size_t number(int i, int j, int k) { return std::size_t(i + 4 * j + 16 * k); }

    const Cells& cells_;
};

struct WeightLimits {
    double floor = -std::numeric_limits<double>::infinity(); ///< linear only as far as no weight falls below
    double lowest = kLeastWeight; ///< weight with which a point that none can carry well is still carried linearly
};

/// What the weights of one point are made of.
struct Fit {
    WeightLimits limits;
    std::vector<ParticleGrid::Near> near;
    std::vector<double> weights;
    double least = 0; ///< weight

    /// Linearly precise weights at `point`. False where the particles do not span space; then, if `anyway`, weights
    /// that are linearly precise in the plane or line that they do span.
    bool solve(const Vec3d& point, double radius, bool anyway) {
        weights.resize(near.size());
        double sum = 0;
        Vec3d mean = Vec3d::Zero();
        for (std::size_t n = 0; n < near.size(); ++n) {
            const double s = 1 - near[n].squared_distance / (radius * radius);
            weights[n] = s * s * s;
            sum += weights[n];
            mean += weights[n] * (near[n].position - point);
        }
        if (!(sum > 0)) return false;
        mean /= sum;
        Mat3d covariance = Mat3d::Zero();
        for (std::size_t n = 0; n < near.size(); ++n) {
            const Vec3d d = near[n].position - point - mean;
            const Vec3d wd = weights[n] * d;
            covariance.col(0) += wd[0] * d;
            covariance.col(1) += wd[1] * d;
            covariance.col(2) += wd[2] * d;
        }
        const double trace = covariance.trace();
        Vec3d slope;
        if (near.size() >= 4 && 27 * covariance.determinant() > kSpanning * trace * trace * trace)
            slope = covariance.inverse() * -mean;
        else if (anyway)
            slope = within_span(covariance, -mean, kRoundedSpread * sum * radius * radius);
        else
            return false;
        slope *= part_above_floor(slope, point + mean, sum);
        least = 0;
        for (std::size_t n = 0; n < near.size(); ++n) {
            weights[n] *= 1 / sum + slope.dot(near[n].position - point - mean);
            least = std::min(least, weights[n]);
        }
        return true;
    }

private:
    /// The largest part of the slope, 0 to 1, with which no weight falls below the floor. It changes with the point
    /// without a jump.
    double part_above_floor(const Vec3d& slope, const Vec3d& middle, double sum) const {
        double part = 1;
        for (std::size_t n = 0; n < near.size(); ++n) {
            const double plain = weights[n] / sum, change = weights[n] * slope.dot(near[n].position - middle);
            if (plain + change < limits.floor) part = std::min(part, (plain - limits.floor) / -change);
        }
        return part;
    }

    /// least: an eigenvalue below it is rounding, as of a particle on its own.
    static Vec3d within_span(const Mat3d& covariance, const Vec3d& b, double least) {
        const SymmetricEigen<double, 3> eigen = symmetric_eigen(covariance);
        Vec3d slope = Vec3d::Zero();
        for (int i = 0; i < 3; ++i)
            if (eigen.values[i] > std::max(1e-2 * eigen.values[2], least))
                slope += eigen.vectors.col(i).dot(b) / eigen.values[i] * eigen.vectors.col(i);
        return slope;
    }
};

/// What one piece of parallel work finds.
struct Piece {
    std::vector<Index> counts, particles;
    std::vector<float> weights;
    EmbeddingReport report;
};

template <class Reached>
void embed_point(const Vec3d& point, const ParticleGrid& grid, const Reached& reached, double spacing, Fit& fit,
                 Piece& piece) {
    const auto find = [&](double radius) {
        grid.find(point, radius, fit.near);
        reached.keep(point, fit.near);
    };
    const auto accept = [&] {
        piece.counts.push_back(Index(fit.near.size()));
        for (std::size_t n = 0; n < fit.near.size(); ++n) {
            piece.particles.push_back(fit.near[n].particle);
            piece.weights.push_back(float(fit.weights[n]));
        }
        piece.report.least_weight = std::min(piece.report.least_weight, float(fit.least));
    };
    if (grid.empty() || !point.allFinite()) { // nothing to be had: any particle will do
        fit.near = {{0, point, 0}};
        fit.weights = {1};
        fit.least = 0;
        ++piece.report.far_points;
        return accept();
    }
    // Far points reach one spacing further than their nearest particle.
    double growth = 1;
    find(kRadius * spacing);
    for (double radius = kRadius * spacing; fit.near.empty(); find(radius)) radius *= kRadiusGrowth;
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& near : fit.near) nearest = std::min(nearest, std::sqrt(near.squared_distance));
    const bool far = nearest > kRadius * spacing;
    piece.report.far_points += far;
    const auto reach = [&] { return std::max(kRadius * spacing * growth, nearest + spacing * growth); };
    for (int attempt = 0; attempt < kAttempts; ++attempt, growth *= kRadiusGrowth) {
        const double radius = reach();
        if (attempt > 0 || radius > kRadius * spacing) find(radius);
        if (fit.solve(point, radius, false) && fit.least >= kLeastWeight) return accept();
    }
    // Not to be had: what can be had from those around the nearest particle, and no slope where that shoots too far.
    piece.report.far_points += !far;
    growth = fit.limits.lowest < kLeastWeight ? math::pow(kRadiusGrowth, kAttempts - 1) : 1;
    const double radius = reach();
    find(radius);
    fit.solve(point, radius, true);
    if (fit.least < fit.limits.lowest) {
        double sum = 0;
        for (std::size_t n = 0; n < fit.near.size(); ++n) {
            const double s = 1 - fit.near[n].squared_distance / (radius * radius);
            sum += fit.weights[n] = s * s * s;
        }
        for (double& weight : fit.weights) weight /= sum;
        fit.least = 0;
    }
    accept();
}

template <class Reached>
Embedding embed_points(std::span<const Vec3f> points, const Vectors& rest, double spacing, const Reached& reached,
                       const WeightLimits& limits, const RunContext& context, EmbeddingReport* report) {
    Embedding embedding;
    embedding.rest.assign(points.begin(), points.end());
    embedding.offsets.assign(points.size() + 1, 0);
    if (report) *report = {};
    if (points.empty() || rest.size() == 0) return embedding;

    const ParticleGrid grid(rest, spacing);
    std::vector<Piece> pieces((points.size() + kEmbeddingGrain - 1) / kEmbeddingGrain);
    parallel_for(context, points.size(), kEmbeddingGrain, [&](std::size_t begin, std::size_t end) {
        Piece& piece = pieces[begin / kEmbeddingGrain];
        Fit fit;
        fit.limits = limits;
        for (std::size_t p = begin; p < end; ++p)
            embed_point(points[p].cast<double>(), grid, reached, spacing, fit, piece);
    });

    std::size_t total = 0;
    for (const Piece& piece : pieces) total += piece.particles.size();
    embedding.particles.reserve(total);
    embedding.weights.reserve(total);
    std::size_t point = 0;
    for (Piece& piece : pieces) {
        for (const Index count : piece.counts) {
            embedding.offsets[point + 1] = embedding.offsets[point] + count;
            ++point;
        }
        embedding.particles.insert(embedding.particles.end(), piece.particles.begin(), piece.particles.end());
        embedding.weights.insert(embedding.weights.end(), piece.weights.begin(), piece.weights.end());
        if (report) {
            report->far_points += piece.report.far_points;
            report->least_weight = std::min(report->least_weight, piece.report.least_weight);
        }
        piece = {};
    }
    return embedding;
}

} // namespace

Embedding embed(std::span<const Vec3f> points, const Vectors& rest, double spacing, const RunContext& context,
                EmbeddingReport* report) {
    return embed_points(points, rest, spacing, ReachedCorners(nullptr), {}, context, report);
}

Embedding embed_to_follow(std::span<const Vec3f> points, const Vectors& rest, double spacing, const Cells* cells,
                          const RunContext& context) {
    return embed_points(points, rest, spacing, ReachedCorners(cells), {.floor = kFollowingWeight}, context, nullptr);
}

Embedding embed_corners(const Cells& cells, const Vectors& rest, const RunContext& context) {
    constexpr double kNearer = 0.7;         // radius: 1.2 spacings hold the particles of the cells around
    constexpr double kLowestOfCorners = -4; // corners that do not follow would deform their cells
    std::vector<Vec3f> corners;
    corners.reserve(cells.corners.size());
    for (const auto& index : cells.corners)
        corners.push_back((cells.origin + cells.spacing * Vec3d(index[0], index[1], index[2])).cast<float>());
    return embed_points(corners, rest, kNearer * cells.spacing, ReachedCells(cells), {.lowest = kLowestOfCorners},
                        context, nullptr);
}

Index nearest_cell(const Cells& cells, const Vec3d& at) {
    if (const Index cell = cells.find_cell(at); cell != kNoIndex) return cell;
    const Vec3d low = at.array().floor();
    const auto outside = [](double x, double begin, double end) { return std::max({begin - x, x - end, 0.0}); };
    double least = std::numeric_limits<double>::infinity();
    Index nearest = 0;
    for (const Cells::Run& run : cells.runs) {
        const auto& first = cells.cells[run.first_cell];
        const double z = outside(at[2], first[2], first[2] + 1.0);
        const double y = outside(at[1], first[1], first[1] + 1.0);
        if (z * z + y * y >= least) continue;
        const double x = outside(at[0], first[0], double(first[0]) + run.count);
        const double distance = z * z + y * y + x * x;
        if (distance >= least) continue;
        least = distance;
        nearest = run.first_cell + Index(std::clamp(low[0] - first[0], 0.0, run.count - 1.0));
    }
    if (!cells.is_parted()) return nearest;
    for (Index c = 0; c < cells.cells.size(); ++c) {
        double distance = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double away = outside(at[axis], cells.cells[c][axis], cells.cells[c][axis] + 1.0);
            distance += away * away;
        }
        if (distance >= least) continue;
        least = distance;
        nearest = c;
    }
    const Vec3d corner(cells.cells[nearest][0], cells.cells[nearest][1], cells.cells[nearest][2]);
    const Vec3d inside = at.cwiseMax(corner).cwiseMin(corner + Vec3d::Constant(1 - 1e-6));
    const Index there = cells.find_cell(inside);
    return there == kNoIndex ? nearest : there;
}

Embedding embed_in_cells(std::span<const Vec3f> points, const Cells& cells, const RunContext& context) {
    Embedding embedding;
    embedding.rest.assign(points.begin(), points.end());
    embedding.offsets.assign(points.size() + 1, 0);
    if (points.empty() || cells.cells.empty()) return embedding;
    for (std::size_t p = 0; p <= points.size(); ++p) embedding.offsets[p] = Index(8 * p);
    embedding.particles.resize(8 * points.size());
    embedding.weights.resize(8 * points.size());
    parallel_for(context, points.size(), kEmbeddingGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
            Vec3d at = (points[p].cast<double>() - cells.origin) / cells.spacing;
            if (!at.allFinite())
                at = Vec3d(cells.cells[0][0], cells.cells[0][1], cells.cells[0][2]); // anything will do
            const Index cell = nearest_cell(cells, at);
            const auto& index = cells.cells[cell];
            const Vec3d t = at - Vec3d(index[0], index[1], index[2]);
            // Trilinear in the cell, and linear beyond it: the products would shoot up there.
            const Vec3d inside = t.cwiseMax(0.0).cwiseMin(1.0), beyond = t - inside;
            for (unsigned corner = 0; corner < 8; ++corner) {
                double weight = 1, slope = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    const bool up = corner >> axis & 1;
                    weight *= up ? inside[axis] : 1 - inside[axis];
                    slope += up ? beyond[axis] : -beyond[axis];
                }
                embedding.particles[8 * p + corner] = cells.cell_corners[cell][corner];
                embedding.weights[8 * p + corner] = float(weight + slope / 4);
            }
        }
    });
    return embedding;
}

Embedding carried_on(const Embedding& points, const Embedding& carriers) {
    Embedding result;
    result.rest = points.rest;
    std::vector<std::pair<Index, float>> parts;
    for (std::size_t p = 0; p < points.size(); ++p) {
        parts.clear();
        for (Index k = points.offsets[p]; k < points.offsets[p + 1]; ++k)
            for (Index n = carriers.offsets[points.particles[k]]; n < carriers.offsets[points.particles[k] + 1]; ++n)
                if (const float weight = points.weights[k] * carriers.weights[n]; weight != 0)
                    parts.emplace_back(carriers.particles[n], weight);
        std::ranges::stable_sort(parts, {}, &std::pair<Index, float>::first);
        const std::size_t first = result.particles.size();
        for (const auto& [particle, weight] : parts) {
            if (result.particles.size() == first || result.particles.back() != particle) {
                result.particles.push_back(particle);
                result.weights.push_back(0);
            }
            result.weights.back() += weight;
        }
        result.offsets.push_back(Index(result.particles.size()));
    }
    return result;
}

namespace {

typedef float Float4 __attribute__((vector_size(16)));

Float4 load(const float* from) {
    Float4 values;
    __builtin_memcpy(&values, from, sizeof values);
    return values;
}

} // namespace

void move_embedded(const Embedding& embedding, const Vectors& rest, const Vectors& positions,
                   std::span<const Mat3f> particle_gradients, std::span<Vec3f> points, std::span<Mat3f> gradients,
                   const RunContext& context) {
    assert(points.size() == embedding.size() && (gradients.empty() || gradients.size() == points.size()));
    parallel_for(context, points.size(), kEmbeddingGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
            const Index first = embedding.offsets[p], last = embedding.offsets[p + 1];
            const Vec3f c = embedding.rest[p];
            if (first == last) { // no particles at all
                points[p] = c;
                if (!gradients.empty()) gradients[p] = Mat3f::Identity();
                continue;
            }
            // Relative to one of the particles: weights that sum to 1 up to rounding then do no harm far from the
            // origin. The fourth lane carries something and means nothing.
            const Vec3f base = positions[embedding.particles[first]];
            Float4 a0 = {}, a1 = {}, a2 = {}; // columns of A
            Float4 moved = {}, half = {}, arm = {};
            for (Index n = first; n < last; ++n) {
                const Index j = embedding.particles[n];
                const float w = embedding.weights[n];
                const float* f = particle_gradients[j].data();
                const Float4 tail =
                    load(f + 5); // f22 of the second column, and the third: nothing past the end is read
                const Float4 f0 = w * load(f), f1 = w * load(f + 3);
                const Float4 f2 = w * __builtin_shufflevector(tail, tail, 1, 2, 3, 0);
                const float dx = c.x() - rest.x[j], dy = c.y() - rest.y[j], dz = c.z() - rest.z[j];
                a0 += f0;
                a1 += f1;
                a2 += f2;
                half += f0 * dx + f1 * dy + f2 * dz;
                arm += w * Float4{dx, dy, dz, 0};
                moved += w * Float4{positions.x[j] - base.x(), positions.y[j] - base.y(), positions.z[j] - base.z(), 0};
            }
            const Float4 offset = moved + 0.5f * (half + a0 * arm[0] + a1 * arm[1] + a2 * arm[2]);
            points[p] = base + Vec3f(offset[0], offset[1], offset[2]);
            if (!gradients.empty()) gradients[p] << a0[0], a1[0], a2[0], a0[1], a1[1], a2[1], a0[2], a1[2], a2[2];
        }
    });
}

void fit_embedded(const Embedding& embedding, const Vectors& rest, const Vectors& positions, std::span<Vec3f> points,
                  std::span<Mat3f> gradients, const RunContext& context) {
    parallel_for(context, points.size(), kEmbeddingGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
            const std::span<const Index> around =
                std::span(embedding.particles)
                    .subspan(embedding.offsets[p], embedding.offsets[p + 1] - embedding.offsets[p]);
            points[p] = embedding.rest[p];
            gradients[p].setIdentity();
            if (around.empty()) continue;
            Vec3d from = Vec3d::Zero(), to = Vec3d::Zero();
            for (const Index j : around) {
                from += rest[j].cast<double>() / double(around.size());
                to += positions[j].cast<double>() / double(around.size());
            }
            Mat3d moments = Mat3d::Zero(), moved = Mat3d::Zero();
            for (const Index j : around) {
                const Vec3d arm = rest[j].cast<double>() - from;
                moments += arm * arm.transpose();
                moved += (positions[j].cast<double>() - to) * arm.transpose();
            }
            const double scale = moments.trace();
            Mat3d gradient = Mat3d::Identity();
            if (scale > 0 && moments.determinant() > 1e-6 * scale * scale * scale) gradient = moved * moments.inverse();
            gradients[p] = gradient.cast<float>();
            points[p] = (to + gradient * (embedding.rest[p].cast<double>() - from)).cast<float>();
        }
    });
}

} // namespace filigree
