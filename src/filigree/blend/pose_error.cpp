#include "filigree/restore.h"

#include "filigree/blend/gradient_fit.h"
#include "filigree/blend/sampled_restorer.h"
#include "filigree/core/math.h"
#include "filigree/core/random.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

namespace filigree {

namespace {

// The share of what gradients differ by, in shares of what positions miss; both are scaled by what is measured. Of 0.1,
// 0.23 and 0.46 it is the best: `filigree bench estimate` prints 96 to 100 % with it, and 89 to 98 % with the others.
constexpr double kShareOfGradients = 0.23;
constexpr std::size_t kSampled = 16384; // vertices that are measured
constexpr std::uint64_t kWaves = 8;     // displacements that are measured
// Their amplitudes, in diagonals. Restoring is linear where gradients are given: large ones keep the errors away from
// rounding. In flat places the height law, by which positions tell gradients, is not.
constexpr double kLinearAmplitude = 1, kAmplitude = 0.1;
constexpr double kWithRounding = 2e-7; // of the diagonal: in smaller errors rounding counts
constexpr double kUsualFactor = 0.2;   // where all are smaller

/// A displacement by one sine wave across the mesh, half to a whole wave a diagonal, drawn from the number.
struct Wave {
    Vec3d direction, wave;
    double phase;

    Wave(std::uint64_t number, double diagonal, double amplitude) {
        const auto between = [&](std::uint64_t k, double low, double high) {
            return low + (high - low) * random_unit(number, k);
        };
        const auto unit = [&](std::uint64_t k) {
            const double z = between(k, -1, 1), angle = between(k + 1, 0, 2 * std::numbers::pi);
            const double r = std::sqrt(1 - z * z);
            return Vec3d(r * math::cos(angle), r * math::sin(angle), z);
        };
        direction = amplitude * diagonal * unit(0);
        wave = between(2, 1, 2) * std::numbers::pi / diagonal * unit(3);
        phase = between(5, 0, 2 * std::numbers::pi);
    }
    Vec3f position(const Vec3f& p) const {
        return (p.cast<double>() + math::sin(wave.dot(p.cast<double>()) + phase) * direction).cast<float>();
    }
    Mat3f gradient(const Vec3f& p) const {
        const double slope = math::cos(wave.dot(p.cast<double>()) + phase);
        return (Mat3d::Identity() + slope * direction * wave.transpose()).cast<float>();
    }
};

} // namespace

/// What estimates are multiplied with: the geometric mean of error over estimate for some waves.
struct PoseError::Calibration {
    SampledRestorer restorer;
    Mesh driver;
    double diagonal;
    unsigned threads;
    std::once_flag from_positions_made, with_gradients_made;
    double from_positions = 1, with_gradients = 1;

    Calibration(const Model& model, const RunContext& context)
        : restorer(model, kSampled, context), driver(level_mesh(model, 0)), diagonal(bounds(model.mesh).diagonal()),
          threads(context.threads()) {}

    double factor(const PoseError& error, bool has_gradients) {
        std::call_once(has_gradients ? with_gradients_made : from_positions_made,
                       [&] { (has_gradients ? with_gradients : from_positions) = measured(error, has_gradients); });
        return has_gradients ? with_gradients : from_positions;
    }

private:
    double measured(const PoseError& error, bool has_gradients) const {
        if (!(diagonal > 0)) return 1;
        const RunContext context(threads);
        std::optional<GradientFit> fit;
        if (!has_gradients) fit.emplace(driver, context);
        double logarithms = 0, count = 0;
        for (std::uint64_t number = 1; number <= kWaves; ++number) {
            const Wave wave(number, diagonal, has_gradients ? kLinearAmplitude : kAmplitude);
            std::vector<Vec3f> moved, truth;
            std::vector<Mat3f> gradients;
            for (const Vec3f& p : driver.positions) moved.push_back(wave.position(p));
            for (const Vec3f& p : restorer.rest()) truth.push_back(wave.position(p));
            if (fit)
                gradients = fit->fit(moved, context);
            else
                for (const Vec3f& p : driver.positions) gradients.push_back(wave.gradient(p));
            const double true_error = restorer.rms_distance(moved, gradients, truth, context);
            const double estimate = error.estimate_unscaled(moved, gradients).rms;
            if (std::min(true_error, estimate) < kWithRounding * diagonal) continue;
            logarithms += math::log(true_error / estimate);
            ++count;
        }
        return count > 0 ? math::exp(logarithms / count) : kUsualFactor;
    }
};

PoseError::PoseError(PoseError&&) noexcept = default;
PoseError& PoseError::operator=(PoseError&&) noexcept = default;
PoseError::~PoseError() = default;

PoseError::PoseError(const Model& model, const RunContext& context) : rest_(driver_positions(model)) {
    const BlendDetail& detail = model.detail;
    calibration_ = std::make_unique<Calibration>(model, context);
    cells_ = detail.cells;
    for (std::size_t c = 0; c < cells_.size(); ++c) {
        Load load{};
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
            const double u = double(detail.u[r]), v = double(detail.v[r]);
            const double b[] = {1 - u - v, u, v};
            Vec3d foot = Vec3d::Zero();
            for (int k = 0; k < 3; ++k) foot += b[k] * rest_[cells_[c][k]].cast<double>();
            const double height = (model.mesh.positions[detail.order[r]].cast<double>() - foot).squaredNorm();
            for (int k = 0; k < 3; ++k) {
                const double between = 4 * b[k] * b[(k + 1) % 3];
                load.vertices[k] += between * between;
                load.heights[k] += between * between * height;
            }
            ++load.count;
        }
        loads_.push_back(load);
    }
}

Result<PoseError::Estimate> PoseError::estimate(const Pose& pose, std::span<const Mat3f> gradients) const {
    if (Status fits = check_pose(rest_.size(), pose); !fits) return fits.error();
    if (gradients.size() != rest_.size())
        return Error{ErrorCode::mismatch, "There are " + std::to_string(gradients.size()) + " gradients for " +
                                              std::to_string(rest_.size()) + " driver vertices."};
    Estimate result = estimate_unscaled(pose.positions, gradients);
    const double factor = calibration_->factor(*this, !pose.gradients.empty());
    result.rms *= factor;
    for (float& error : result.local) error = float(double(error) * factor);
    return result;
}

PoseError::Estimate PoseError::estimate_unscaled(std::span<const Vec3f> positions,
                                                 std::span<const Mat3f> gradients) const {
    const auto error_of_edge = [&](Index a, Index b, double vertices, double heights) {
        const Mat3d at_a = gradients[a].cast<double>(), at_b = gradients[b].cast<double>();
        const Vec3d told = 0.5 * (at_a + at_b) * (rest_[b] - rest_[a]).cast<double>();
        const Vec3d missed = (positions[b] - positions[a]).cast<double>() - told;
        return vertices * missed.squaredNorm() +
               kShareOfGradients * kShareOfGradients * heights * (at_b - at_a).squaredNorm();
    };
    std::vector<double> squared(rest_.size(), 0), counts(rest_.size(), 0);
    double sum = 0, count = 0;
    for (std::size_t c = 0; c < cells_.size(); ++c) {
        double of_cell = 0;
        for (int k = 0; k < 3; ++k)
            of_cell += error_of_edge(cells_[c][k], cells_[c][(k + 1) % 3], loads_[c].vertices[k], loads_[c].heights[k]);
        for (Index corner : cells_[c]) {
            squared[corner] += of_cell;
            counts[corner] += loads_[c].count;
        }
        sum += of_cell;
        count += loads_[c].count;
    }
    Estimate result;
    result.diagonal = bounds(positions).diagonal();
    result.rms = std::sqrt(sum / std::max(count, 1.0));
    for (std::size_t i = 0; i < rest_.size(); ++i)
        result.local.push_back(float(std::sqrt(squared[i] / std::max(counts[i], 1.0))));
    return result;
}

std::vector<float> vertex_errors(const Model& model, std::span<const float> local) {
    const BlendDetail& detail = model.detail;
    std::vector<float> errors(model.mesh.vertex_count());
    for (std::size_t c = 0; c < detail.cells.size(); ++c) {
        const auto& [i, j, k] = detail.cells[c];
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
            const float u = detail.u[r], v = detail.v[r];
            errors[detail.order[r]] = (1 - u - v) * local[i] + u * local[j] + v * local[k];
        }
    }
    errors.resize(model.vertex_count());
    return errors;
}

} // namespace filigree
