// Based on:
//   [Sorkine 2007] As-rigid-as-possible surface modeling: the energy, sum over edges of
//   w_ij |x_i - x_j - R_i (p_i - p_j)|^2, and its minimisation by turns over rotations R and positions x.
//   [Levi 2015] Smooth rotation enhanced as-rigid-as-possible mesh animation: the further term
//   w_ij k^2 |R_i - R_j|^2 / 2. Without it a surface has no stiffness against bending but what its edges' length gives,
//   and a finely meshed bar folds like a drinking straw. Ours weights it by cotangents, so that k is a length that does
//   not depend on the mesh, and holds a vertex to its own last rotation as much as to its neighbours': then all
//   vertices can turn at the same time and the energy still never rises. [Mueller 2016] A robust method to extract the
//   rotational part of deformations: rotations start from those of the round before, so flat and inverted
//   neighbourhoods keep a sensible one. Ours takes Newton's step where the energy is convex, which on flat
//   neighbourhoods needs 2 steps where the paper's step halves the error, and leaves the saddle points (half turns) by
//   [Kabsch 1976] A solution for the best rotation to relate two sets of vectors.
//   [Nesterov 1983], [O'Donoghue 2015] Momentum: a round starts from where the last ones were heading, and where that
//   raises the energy it is undone and the momentum starts anew. A third to a tenth of the rounds.
// New solves start from the last solution moved by the best rigid motion of the handles, so a rigid motion is exact.
#include "filigree/pose.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/parallel_for.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <new>
#include <numeric>
#include <string>

namespace filigree {
namespace {

constexpr std::size_t kHandlesGrain = 512;
constexpr std::size_t kMaxVertices = 20'000'000; // the sparse matrices count their entries in int

// Cotangents have no unit, so these hold for any mesh. The floor ties vertices together that only degenerate or obtuse
// triangles connect; the ceiling (an angle of 0.06 degrees) keeps slivers from drowning everything else.
constexpr double kMinWeight = 1e-6;
constexpr double kMaxCotangent = 1e3;
constexpr double kMinArea = 1e-12; // of a triangle, over its longest edge squared: below it has no angles

constexpr int kRotationSteps = 20;          // 1 or 2 are usual
constexpr double kRotationTolerance = 1e-5; // radians; Newton's next step would be the square of it
constexpr double kDefinite = 1e-9;          // of the covariance's norm: curvature above it counts as positive

using SparseMatrix = Eigen::SparseMatrix<double>;
using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Half the cotangents at the corners opposite of each edge, summed; symmetric, one row a vertex. [Pinkall 1993]
SparseMatrix edge_weights(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(6 * triangles.size());
    for (const Triangle& t : triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = t[(k + 1) % 3], b = t[(k + 2) % 3];
            if (a == b) continue;
            const Vec3d apex = positions[t[k]].cast<double>();
            const Vec3d u = positions[a].cast<double>() - apex, v = positions[b].cast<double>() - apex;
            const double area2 = u.cross(v).norm();
            const double longest = std::max({u.squaredNorm(), v.squaredNorm(), (u - v).squaredNorm()});
            const bool degenerate = !(area2 > kMinArea * longest);
            const double weight = degenerate ? 0 : 0.5 * std::clamp(u.dot(v) / area2, -kMaxCotangent, kMaxCotangent);
            entries.emplace_back(static_cast<int>(a), static_cast<int>(b), weight);
            entries.emplace_back(static_cast<int>(b), static_cast<int>(a), weight);
        }
    const auto n = static_cast<Eigen::Index>(positions.size());
    SparseMatrix weights(n, n);
    weights.setFromTriplets(entries.begin(), entries.end());
    for (Eigen::Index k = 0; k < weights.nonZeros(); ++k)
        weights.valuePtr()[k] = std::max(weights.valuePtr()[k], kMinWeight);
    return weights;
}

/// The rotation R with the largest trace(R^T A), near `start`, which decides where A leaves a choice (a flat, thin or
/// collapsed neighbourhood). With B = A R^T, turning R by a small omega gains omega . g - omega . H omega / 2, g the
/// axial part of B.
Eigen::Quaterniond closest_rotation(const Mat3d& A, const Eigen::Quaterniond& start) {
    const double scale = A.norm();
    if (!(scale > 0)) return start;
    Eigen::Quaterniond q = start;
    for (int step = 0; step < kRotationSteps; ++step) {
        const Mat3d B = A * q.toRotationMatrix().transpose();
        const Vec3d g(B(2, 1) - B(1, 2), B(0, 2) - B(2, 0), B(1, 0) - B(0, 1));
        const double floor = kDefinite * scale;
        const Mat3d H = (B.trace() + floor) * Mat3d::Identity() - 0.5 * (B + B.transpose());
        // Positive definite by its leading minors, cofactors first: the inverse needs them anyway.
        const Vec3d row(H(1, 1) * H(2, 2) - H(1, 2) * H(1, 2), H(0, 2) * H(1, 2) - H(0, 1) * H(2, 2),
                        H(0, 1) * H(1, 2) - H(0, 2) * H(1, 1));
        const double minor = H(0, 0) * H(1, 1) - H(0, 1) * H(0, 1), determinant = H.row(0).dot(row);
        const bool convex = H(0, 0) > 0 && minor > 0 && determinant > 0;
        Vec3d omega;
        if (convex) {
            const double yz = H(0, 1) * H(0, 2) - H(0, 0) * H(1, 2);
            Mat3d adjugate;
            adjugate << row.transpose(), row[1], H(0, 0) * H(2, 2) - H(0, 2) * H(0, 2), yz, row[2], yz, minor;
            omega = adjugate * g / determinant;
        } else {
            omega = g / (std::abs(B.trace()) + floor);
        }
        const double turn = omega.norm();
        q = (Eigen::Quaterniond(1, 0.5 * omega.x(), 0.5 * omega.y(), 0.5 * omega.z()) * q).normalized();
        if (turn > kRotationTolerance) continue;
        if (convex) return q;
        break; // at rest, but not at the top: a saddle
    }
    return Eigen::Quaterniond(nearest_rotation(A));
}

/// Where what turned from `before` to `now` would be after turning further by `momentum` times as much.
Eigen::Quaterniond ahead(const Eigen::Quaterniond& before, const Eigen::Quaterniond& now, double momentum) {
    const double sign = before.dot(now) < 0 ? -1 : 1; // q and -q are the same rotation
    return Eigen::Quaterniond((1 + momentum) * now.coeffs() - sign * momentum * before.coeffs()).normalized();
}

void to_matrices(std::span<const Eigen::Quaterniond> rotations, std::span<Mat3d> matrices, const RunContext& context) {
    parallel_for(context, rotations.size(), kHandlesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) matrices[i] = rotations[i].toRotationMatrix();
    });
}

} // namespace

struct HandleSolver::Solver {
    enum class Role : std::uint8_t { loose, handle, free }; // loose: connected to no handle

    /// What a solve changes, kept as the start of the next.
    struct State {
        std::vector<Vec3d> positions;
        std::vector<Eigen::Quaterniond> rotations;
        std::vector<Vec3d> targets;
    };

    std::vector<Vec3d> rest;
    double diagonal = 1;
    SparseMatrix weights;
    std::vector<Index> handles;
    std::vector<Role> role;
    std::vector<Index> part; // of each vertex that is not loose; connected vertices form a part
    std::size_t part_count = 0;
    std::vector<Index> free; // the free vertices in the order of elimination: row r is vertex free[r]
    Eigen::SimplicialLDLT<SparseMatrix, Eigen::Lower> factor;
    State state;

    Solver(std::span<const Vec3f> positions, std::span<const Triangle> triangles, std::span<const Index> given);
    void find_parts();
    bool factorise();
    State rest_state() const;
    State extrapolate(const State& before, const State& now, double momentum) const;

    void follow_handles(State& s, std::span<const Vec3f> targets) const;
    void local_step(State& s, std::vector<Mat3d>& rotations, double smoothness, const RunContext& context) const;
    void global_step(State& s, std::span<const Mat3d> rotations, Rows3& x, const RunContext& context) const;
    void substitute(Rows3& x) const;
    double energy(const State& s, std::span<const Mat3d> rotations, double smoothness, const RunContext& context) const;
    double largest_move(const State& from, const State& to) const;
};

HandleSolver::Solver::Solver(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                             std::span<const Index> given)
    : weights(edge_weights(positions, triangles)), handles(given.begin(), given.end()),
      role(positions.size(), Role::loose), part(positions.size(), kNoIndex) {
    for (const Vec3f& p : positions) rest.push_back(p.cast<double>());
    if (const double d = bounds(positions).diagonal(); d > 0) diagonal = d;
    find_parts();
}

/// Spreads from the handles along edges.
void HandleSolver::Solver::find_parts() {
    for (const Index handle : handles) role[handle] = Role::handle;
    std::vector<Index> stack;
    for (const Index handle : handles) {
        if (part[handle] != kNoIndex) continue;
        part[handle] = static_cast<Index>(part_count);
        stack.push_back(handle);
        while (!stack.empty()) {
            const Index i = stack.back();
            stack.pop_back();
            for (SparseMatrix::InnerIterator edge(weights, i); edge; ++edge) {
                const auto j = static_cast<Index>(edge.index());
                if (part[j] != kNoIndex) continue;
                part[j] = part[i];
                if (role[j] == Role::loose) role[j] = Role::free;
                stack.push_back(j);
            }
        }
        ++part_count;
    }
}

/// Factors the Laplacian of the free vertices, which is positive definite as each part has a handle.
bool HandleSolver::Solver::factorise() {
    std::vector<int> row(rest.size(), -1);
    int rows = 0;
    for (std::size_t i = 0; i < rest.size(); ++i)
        if (role[i] == Role::free) row[i] = rows++;
    if (rows == 0) return true;

    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(static_cast<std::size_t>(rows + weights.nonZeros() / 2));
    for (std::size_t i = 0; i < rest.size(); ++i) {
        if (row[i] < 0) continue;
        double sum = 0;
        for (SparseMatrix::InnerIterator edge(weights, static_cast<Eigen::Index>(i)); edge; ++edge) {
            sum += edge.value();
            if (const int j = row[edge.index()]; j >= 0 && j < row[i]) entries.emplace_back(row[i], j, -edge.value());
        }
        entries.emplace_back(row[i], row[i], sum);
    }
    SparseMatrix laplacian(rows, rows);
    laplacian.setFromTriplets(entries.begin(), entries.end());
    factor.compute(laplacian);

    free.resize(static_cast<std::size_t>(rows));
    for (std::size_t i = 0; i < rest.size(); ++i)
        if (row[i] >= 0) free[factor.permutationP().indices()[row[i]]] = static_cast<Index>(i);
    return factor.info() == Eigen::Success;
}

HandleSolver::Solver::State HandleSolver::Solver::rest_state() const {
    State s{rest, std::vector<Eigen::Quaterniond>(rest.size(), Eigen::Quaterniond::Identity()), {}};
    for (const Index handle : handles) s.targets.push_back(rest[handle]);
    return s;
}

HandleSolver::Solver::State HandleSolver::Solver::extrapolate(const State& before, const State& now,
                                                              double momentum) const {
    State next = now;
    for (std::size_t i = 0; momentum > 0 && i < rest.size(); ++i) {
        next.positions[i] += momentum * (now.positions[i] - before.positions[i]);
        next.rotations[i] = ahead(before.rotations[i], now.rotations[i], momentum);
    }
    return next;
}

/// Moves each part by the rigid motion that brings its handles closest to the new targets, and its handles onto them.
void HandleSolver::Solver::follow_handles(State& s, std::span<const Vec3f> targets) const {
    struct Motion {
        Vec3d from = Vec3d::Zero(), to = Vec3d::Zero();
        double count = 0;
        Mat3d covariance = Mat3d::Zero();
        Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    };
    std::vector<Motion> motions(part_count);
    for (std::size_t h = 0; h < handles.size(); ++h) {
        Motion& m = motions[part[handles[h]]];
        m.from += s.targets[h];
        m.to += targets[h].cast<double>();
        ++m.count;
    }
    for (Motion& m : motions) {
        m.from /= m.count;
        m.to /= m.count;
    }
    for (std::size_t h = 0; h < handles.size(); ++h) {
        Motion& m = motions[part[handles[h]]];
        m.covariance += (targets[h].cast<double>() - m.to) * (s.targets[h] - m.from).transpose();
    }
    for (Motion& m : motions) m.rotation = closest_rotation(m.covariance, m.rotation);
    for (std::size_t i = 0; i < rest.size(); ++i) {
        if (role[i] == Role::loose) continue;
        const Motion& m = motions[part[i]];
        s.positions[i] = m.to + m.rotation * (s.positions[i] - m.from);
        s.rotations[i] = (m.rotation * s.rotations[i]).normalized();
    }
    for (std::size_t h = 0; h < handles.size(); ++h) s.positions[handles[h]] = s.targets[h] = targets[h].cast<double>();
}

/// Better rotations for the positions as they are (the best, when smoothness is 0). rotations: those of s as matrices.
void HandleSolver::Solver::local_step(State& s, std::vector<Mat3d>& rotations, double smoothness,
                                      const RunContext& context) const {
    const double k = smoothness * diagonal, k2 = k * k;
    parallel_for(context, rest.size(), kHandlesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (role[i] == Role::loose) continue;
            Mat3d covariance = Mat3d::Zero(), around = Mat3d::Zero();
            double sum = 0;
            for (SparseMatrix::InnerIterator edge(weights, static_cast<Eigen::Index>(i)); edge; ++edge) {
                const auto j = static_cast<std::size_t>(edge.index());
                covariance += (edge.value() * (s.positions[i] - s.positions[j])) * (rest[i] - rest[j]).transpose();
                around += edge.value() * rotations[j];
                sum += edge.value();
            }
            s.rotations[i] = closest_rotation(covariance + k2 * (around + sum * rotations[i]), s.rotations[i]);
        }
    });
    to_matrices(s.rotations, rotations, context);
}

/// The best positions for the rotations as they are. x: room for the right-hand sides.
void HandleSolver::Solver::global_step(State& s, std::span<const Mat3d> rotations, Rows3& x,
                                       const RunContext& context) const {
    parallel_for(context, free.size(), kHandlesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r) {
            const Index i = free[r];
            Vec3d turned = Vec3d::Zero(), edges = Vec3d::Zero(), known = Vec3d::Zero();
            for (SparseMatrix::InnerIterator edge(weights, i); edge; ++edge) {
                const auto j = static_cast<std::size_t>(edge.index());
                const Vec3d weighted = 0.5 * edge.value() * (rest[i] - rest[j]);
                edges += weighted;
                turned += rotations[j] * weighted;
                if (role[j] == Role::handle) known += edge.value() * s.positions[j];
            }
            x.row(static_cast<Eigen::Index>(r)) = (rotations[i] * edges + turned + known).transpose();
        }
    });
    substitute(x);
    for (std::size_t r = 0; r < free.size(); ++r)
        s.positions[free[r]] = x.row(static_cast<Eigen::Index>(r)).transpose();
}

/// Solves L D L^T x = b in place, three right-hand sides in one sweep: Eigen's own solve reads L three times.
void HandleSolver::Solver::substitute(Rows3& x) const {
    if (free.empty()) return;
    const auto& L = factor.matrixL().nestedExpression();
    const auto D = factor.vectorD();
    const int* column = L.outerIndexPtr();
    const int* row = L.innerIndexPtr();
    const double* value = L.valuePtr();
    double* const data = x.data();
    for (Eigen::Index c = 0; c < L.cols(); ++c) {
        const double x0 = data[3 * c], x1 = data[3 * c + 1], x2 = data[3 * c + 2];
        for (int k = column[c]; k < column[c + 1]; ++k) {
            double* const target = data + 3 * static_cast<std::ptrdiff_t>(row[k]);
            target[0] -= value[k] * x0;
            target[1] -= value[k] * x1;
            target[2] -= value[k] * x2;
        }
    }
    for (Eigen::Index c = L.cols(); c-- > 0;) {
        double x0 = data[3 * c] / D[c], x1 = data[3 * c + 1] / D[c], x2 = data[3 * c + 2] / D[c];
        for (int k = column[c]; k < column[c + 1]; ++k) {
            const double* const source = data + 3 * static_cast<std::ptrdiff_t>(row[k]);
            x0 -= value[k] * source[0];
            x1 -= value[k] * source[1];
            x2 -= value[k] * source[2];
        }
        data[3 * c] = x0;
        data[3 * c + 1] = x1;
        data[3 * c + 2] = x2;
    }
}

/// What the rounds lower. The pieces' sums are added in order, so it does not depend on threads.
double HandleSolver::Solver::energy(const State& s, std::span<const Mat3d> rotations, double smoothness,
                                    const RunContext& context) const {
    const double k = smoothness * diagonal, k2 = 0.5 * k * k;
    std::vector<double> sums(rest.size() / kHandlesGrain + 1);
    parallel_for(context, rest.size(), kHandlesGrain, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
            if (role[i] == Role::loose) continue;
            for (SparseMatrix::InnerIterator edge(weights, static_cast<Eigen::Index>(i)); edge; ++edge) {
                const auto j = static_cast<std::size_t>(edge.index());
                const Vec3d strain = s.positions[i] - s.positions[j] - rotations[i] * (rest[i] - rest[j]);
                sum += edge.value() * (strain.squaredNorm() + k2 * (rotations[i] - rotations[j]).squaredNorm());
            }
        }
        sums[begin / kHandlesGrain] = sum;
    });
    return std::accumulate(sums.begin(), sums.end(), 0.0);
}

double HandleSolver::Solver::largest_move(const State& from, const State& to) const {
    double largest = 0;
    for (const Index i : free) largest = std::max(largest, (to.positions[i] - from.positions[i]).squaredNorm());
    return std::sqrt(largest) / diagonal;
}

HandleSolver::HandleSolver(std::unique_ptr<Solver> solver) : solver_(std::move(solver)) {}
HandleSolver::HandleSolver(HandleSolver&&) noexcept = default;
HandleSolver& HandleSolver::operator=(HandleSolver&&) noexcept = default;
HandleSolver::~HandleSolver() = default;

Result<HandleSolver> HandleSolver::create(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                          std::span<const Index> handles, const RunContext& context) {
    if (handles.empty()) return Error{ErrorCode::usage, "There is no handle; give at least one vertex a target."};
    if (positions.size() > kMaxVertices)
        return Error{ErrorCode::unsuitable, "Handles move at most " + std::to_string(kMaxVertices) +
                                                " vertices; strip the mesh and move its driver."};
    std::vector<bool> is_handle(positions.size());
    for (const Index handle : handles) {
        const std::string name = "Handle vertex " + std::to_string(handle);
        if (handle >= positions.size())
            return Error{ErrorCode::usage, name + " does not exist; there are " + std::to_string(positions.size()) +
                                               " vertices, counted from 0."};
        if (is_handle[handle]) return Error{ErrorCode::usage, name + " is given twice; name each handle once."};
        is_handle[handle] = true;
    }
    try {
        context.report("factoring", 0);
        auto solver = std::make_unique<Solver>(positions, triangles, handles);
        if (context.is_cancelled()) return cancelled_error();
        if (!solver->factorise())
            return Error{ErrorCode::out_of_memory, "The handles' system could not be factored; use a smaller driver."};
        if (context.is_cancelled()) return cancelled_error();
        solver->state = solver->rest_state();
        return HandleSolver(std::move(solver));
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, "Not enough memory for the handles' system; use a smaller driver."};
    }
}

Result<HandleResult> HandleSolver::solve(std::span<const Vec3f> targets, const HandleOptions& options,
                                         const RunContext& context) {
    const Solver& solver = *solver_;
    if (targets.size() != solver.handles.size())
        return Error{ErrorCode::mismatch, std::to_string(targets.size()) + " targets for " +
                                              std::to_string(solver.handles.size()) + " handles; give one for each."};
    for (const Vec3f& target : targets)
        if (!target.allFinite()) return Error{ErrorCode::usage, "A handle's target is not a finite position."};

    Solver::State state = solver.state; // a copy, so that cancelling leaves nothing half-done
    solver.follow_handles(state, targets);
    std::vector<Mat3d> rotations(state.rotations.size());
    to_matrices(state.rotations, rotations, context);
    Rows3 x(static_cast<Eigen::Index>(solver.free.size()), 3);
    solver.global_step(state, rotations, x, context);

    HandleResult result;
    Solver::State before = state;
    double energy = solver.energy(state, rotations, options.smoothness, context);
    double age = 1; // of the momentum, by [Nesterov 1983]
    while (result.iterations < options.iterations) {
        if (context.is_cancelled()) return cancelled_error();
        context.report("handles", static_cast<double>(result.iterations) / options.iterations);
        const double next_age = 0.5 * (1 + std::sqrt(1 + 4 * age * age)), momentum = (age - 1) / next_age;
        Solver::State trial = solver.extrapolate(before, state, momentum);
        to_matrices(trial.rotations, rotations, context);
        solver.local_step(trial, rotations, options.smoothness, context);
        solver.global_step(trial, rotations, x, context);
        ++result.iterations;
        const double trial_energy = solver.energy(trial, rotations, options.smoothness, context);
        if (momentum > 0 && trial_energy > energy) {
            age = 1; // uphill: stay, and start without momentum
            continue;
        }
        result.last_move = solver.largest_move(state, trial);
        before = std::move(state);
        state = std::move(trial);
        energy = trial_energy;
        age = next_age;
        if (result.last_move <= options.tolerance) break;
    }
    to_matrices(state.rotations, rotations, context);
    solver.local_step(state, rotations, options.smoothness, context); // rotations that belong to the last positions
    for (std::size_t i = 0; i < rotations.size(); ++i) {
        result.pose.positions.push_back(state.positions[i].cast<float>());
        result.pose.gradients.push_back(rotations[i].cast<float>());
    }
    solver_->state = std::move(state);
    return result;
}

void HandleSolver::reset() { solver_->state = solver_->rest_state(); }

} // namespace filigree
