#include "filigree/fit/free_weights.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr std::size_t kRecordGrain = 4096;
constexpr double kDamping = 1e-9;     // of the trace: keeps the step small where no frame says anything
constexpr double kWorthARound = 0.97; // of the error before: what a round has to reach for another one
constexpr double kLeastGain = 0.03;   // of a vertex's mean squared error: weights that win less stay, and cost no bits

/// What a driver vertex gives to the vertices that it carries.
struct Carrier {
    Vec3d shift; ///< c' - A c / 2
    Mat3d gradient;
};

std::vector<Carrier> carriers_of(std::span<const Vec3d> rest, const Pose& pose) {
    std::vector<Carrier> carriers;
    for (std::size_t i = 0; i < rest.size(); ++i) {
        const Mat3d gradient = pose.gradients[i].cast<double>();
        carriers.push_back({pose.positions[i].cast<double>() - 0.5 * (gradient * rest[i]), gradient});
    }
    return carriers;
}

/// A record's cell, with its vertex at rest.
struct Hang {
    const Triangle& cell;
    Vec3d at; ///< the vertex
    std::array<Vec3d, 3> corner;
};

Vec3d restored(const Hang& hang, const std::vector<Carrier>& carriers, double u, double v) {
    const std::array<double, 3> b = {1 - u - v, u, v};
    Vec3d sum = Vec3d::Zero(), middle = Vec3d::Zero();
    Mat3d gradient = Mat3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
        sum += b[k] * carriers[hang.cell[k]].shift;
        gradient += b[k] * carriers[hang.cell[k]].gradient;
        middle += b[k] * hang.corner[k];
    }
    return sum + gradient * (hang.at - 0.5 * middle);
}

/// Squares of a vertex's error as a function of its weights, near where they are.
struct Quadratic {
    double uu = 0, uv = 0, vv = 0, ur = 0, vr = 0;
    double here = 0; ///< where they are

    /// What is to be added to the error where the weights move so far.
    double at(double du, double dv) const {
        return uu * du * du + 2 * uv * du * dv + vv * dv * dv - 2 * (ur * du + vr * dv);
    }
};

/// The least of a quadratic on a triangle's edge from (u0, v0) to (u1, v1), counted from the weights (u, v).
std::array<double, 2> least_on_edge(const Quadratic& q, double u, double v, std::array<double, 2> from,
                                    std::array<double, 2> to) {
    const double du = to[0] - from[0], dv = to[1] - from[1], x = from[0] - u, y = from[1] - v;
    const double bend = q.uu * du * du + 2 * q.uv * du * dv + q.vv * dv * dv;
    const double slope = q.uu * x * du + q.uv * (x * dv + y * du) + q.vv * y * dv - (q.ur * du + q.vr * dv);
    const double t = bend > 0 ? std::clamp(-slope / bend, 0.0, 1.0) : 0.0;
    return {from[0] + t * du, from[1] + t * dv};
}

std::array<double, 2> least_in_triangle(Quadratic q, double u, double v) {
    const double damping = kDamping * (q.uu + q.vv);
    q.uu += damping;
    q.vv += damping;
    const double determinant = q.uu * q.vv - q.uv * q.uv;
    if (!(determinant > 0)) return {u, v};
    const double du = (q.vv * q.ur - q.uv * q.vr) / determinant, dv = (q.uu * q.vr - q.uv * q.ur) / determinant;
    if (u + du >= 0 && v + dv >= 0 && u + du + v + dv <= 1) return {u + du, v + dv};
    std::array<double, 2> least = {u, v};
    double least_value = 0; // where they are
    constexpr std::array<std::array<double, 2>, 3> kCorners = {{{0, 0}, {1, 0}, {0, 1}}};
    for (std::size_t k = 0; k < 3; ++k) {
        const std::array<double, 2> on_edge = least_on_edge(q, u, v, kCorners[k], kCorners[(k + 1) % 3]);
        const double value = q.at(on_edge[0] - u, on_edge[1] - v);
        if (value >= least_value) continue;
        least = on_edge;
        least_value = value;
    }
    return least;
}

/// Calls work(record, its cell) for all records, on all threads.
template <class Work>
void each_record(const Model& model, std::span<const Index> cell_of, const std::vector<Vec3d>& rest,
                 const RunContext& context, const Work& work) {
    const BlendDetail& detail = model.detail;
    parallel_for(context, detail.order.size(), kRecordGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r) {
            const Triangle& cell = detail.cells[cell_of[r]];
            work(r, Hang{cell,
                         model.mesh.positions[detail.order[r]].cast<double>(),
                         {rest[cell[0]], rest[cell[1]], rest[cell[2]]}});
        }
    });
}

} // namespace

Result<std::size_t> move_weights(Model& model, std::span<const Pose> poses, const FrameReader& frame,
                                 const RunContext& context) {
    BlendDetail& detail = model.detail;
    const std::size_t records = detail.order.size(), vertices = model.vertex_count();
    std::vector<Vec3d> rest;
    for (const Index v : model.driver().vertices) rest.push_back(model.mesh.positions[v].cast<double>());
    std::vector<Index> cell_of(records);
    for (Index c = 0; c < detail.cells.size(); ++c)
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) cell_of[r] = c;
    std::vector<Vec3f> truth(vertices);
    std::vector<Quadratic> sums(records);
    for (std::size_t k = 0; k < poses.size(); ++k) {
        if (Status read = frame(k, truth); !read) return read.error();
        const std::vector<Carrier> carriers = carriers_of(rest, poses[k]);
        each_record(model, cell_of, rest, context, [&](std::size_t r, const Hang& hang) {
            if (detail.order[r] >= vertices) return; // of a driver that is behind the mesh
            const double u = double(detail.u[r]), v = double(detail.v[r]);
            const std::array<double, 3> b = {1 - u - v, u, v};
            Vec3d middle = Vec3d::Zero();
            Mat3d gradient = Mat3d::Zero();
            for (std::size_t j = 0; j < 3; ++j) {
                middle += b[j] * hang.corner[j];
                gradient += b[j] * carriers[hang.cell[j]].gradient;
            }
            const Vec3d q = hang.at - 0.5 * middle;
            const Carrier& first = carriers[hang.cell[0]];
            const auto along = [&](std::size_t j) -> Vec3d {
                const Carrier& other = carriers[hang.cell[j]];
                return other.shift - first.shift + (other.gradient - first.gradient) * q -
                       0.5 * (gradient * (hang.corner[j] - hang.corner[0]));
            };
            const Vec3d du = along(1), dv = along(2),
                        off = truth[detail.order[r]].cast<double>() - restored(hang, carriers, u, v);
            Quadratic& sum = sums[r];
            sum.uu += du.squaredNorm();
            sum.uv += du.dot(dv);
            sum.vv += dv.squaredNorm();
            sum.ur += du.dot(off);
            sum.vr += dv.dot(off);
            sum.here += off.squaredNorm();
        });
        if (context.is_cancelled()) return cancelled_error();
    }
    std::vector<std::array<float, 2>> tried(records);
    each_record(model, cell_of, rest, context, [&](std::size_t r, const Hang&) {
        const std::array<double, 2> least = least_in_triangle(sums[r], double(detail.u[r]), double(detail.v[r]));
        const float u = std::clamp(float(least[0]), 0.0f, 1.0f);
        tried[r] = {u, std::clamp(float(least[1]), 0.0f, 1.0f - u)};
    });
    std::vector<double> won(records); // in squares
    for (std::size_t k = 0; k < poses.size(); ++k) {
        if (Status read = frame(k, truth); !read) return read.error();
        const std::vector<Carrier> carriers = carriers_of(rest, poses[k]);
        each_record(model, cell_of, rest, context, [&](std::size_t r, const Hang& hang) {
            if (detail.order[r] >= vertices) return;
            const Vec3d wanted = truth[detail.order[r]].cast<double>();
            won[r] += (restored(hang, carriers, double(detail.u[r]), double(detail.v[r])) - wanted).squaredNorm() -
                      (restored(hang, carriers, double(tried[r][0]), double(tried[r][1])) - wanted).squaredNorm();
        });
        if (context.is_cancelled()) return cancelled_error();
    }
    double squares = 0;
    for (const Quadratic& sum : sums) squares += sum.here;
    const double least = kLeastGain * squares / double(std::max<std::size_t>(vertices, 1));
    std::size_t moved = 0;
    for (std::size_t r = 0; r < records; ++r) {
        if (!(won[r] > least)) continue;
        detail.u[r] = tried[r][0];
        detail.v[r] = tried[r][1];
        ++moved;
    }
    return moved;
}

Result<FittedPoses> fit_poses_and_weights(Model& model, std::size_t frames, const FrameReader& frame, unsigned rounds,
                                          const PoseFitOptions& options, const RunContext& context) {
    Result<FittedPoses> best = fit_poses(model, frames, frame, options, context);
    for (unsigned round = 0; best && round < rounds; ++round) {
        const std::vector<float> u = model.detail.u, v = model.detail.v;
        const Result<std::size_t> moved = move_weights(model, best->poses, frame, context);
        if (!moved) return moved.error();
        Result<FittedPoses> again = fit_poses(model, frames, frame, options, context);
        if (!again) return again.error();
        const bool is_better = again->error.rms < best->error.rms;
        const bool goes_on = again->error.rms < kWorthARound * best->error.rms;
        if (is_better) {
            *best = std::move(*again);
        } else {
            model.detail.u = u;
            model.detail.v = v;
        }
        if (!goes_on) break;
    }
    return best;
}

} // namespace filigree
