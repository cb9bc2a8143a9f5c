#include "fidelity.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/restore.h"

#include <cmath>
#include <functional>

namespace filigree::bench {

namespace {

/// Orthonormal frame of a triangle: along its first edge, across, and its normal.
Mat3d triangle_frame(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    Mat3d frame;
    frame.col(0) = (b - a).normalized();
    frame.col(2) = (b - a).cross(c - a).normalized();
    frame.col(1) = frame.col(2).cross(frame.col(0));
    return frame;
}

/// What the baselines share: each record's cell, weights and offset in double.
using MoveVertex = std::function<Vec3d(const std::array<Vec3d, 3>& rest, const std::array<Vec3d, 3>& now,
                                       const std::array<Mat3d, 3>& gradients, const Vec3d& weights, const Vec3d& p)>;

std::vector<Vec3f> move_with_cells(const Model& model, const Pose& pose, const MoveVertex& move,
                                   const RunContext& context) {
    const BlendDetail& detail = model.detail;
    const std::vector<Vec3f> rest = driver_positions(model);
    std::vector<Vec3f> out(model.mesh.vertex_count());
    parallel_for(context, detail.cells.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) {
            std::array<Vec3d, 3> r, n;
            std::array<Mat3d, 3> a;
            for (int k = 0; k < 3; ++k) {
                r[k] = rest[detail.cells[c][k]].cast<double>();
                n[k] = pose.positions[detail.cells[c][k]].cast<double>();
                a[k] = pose.gradients.empty() ? Mat3d::Identity()
                                              : Mat3d(pose.gradients[detail.cells[c][k]].cast<double>());
            }
            for (Index i = detail.cell_offsets[c]; i < detail.cell_offsets[c + 1]; ++i) {
                const Vec3d weights(1 - detail.u[i] - detail.v[i], detail.u[i], detail.v[i]);
                const Vec3d p = model.mesh.positions[detail.order[i]].cast<double>();
                out[detail.order[i]] = move(r, n, a, weights, p).cast<float>();
            }
        }
    });
    return out;
}

/// A wrap deformer: the offset from the bound point, carried along in the triangle's frame.
Vec3d move_wrap(const std::array<Vec3d, 3>& rest, const std::array<Vec3d, 3>& now, const std::array<Mat3d, 3>&,
                const Vec3d& weights, const Vec3d& p) {
    const Vec3d m = weights[0] * rest[0] + weights[1] * rest[1] + weights[2] * rest[2];
    const Vec3d moved = weights[0] * now[0] + weights[1] * now[1] + weights[2] * now[2];
    return moved +
           triangle_frame(now[0], now[1], now[2]) * triangle_frame(rest[0], rest[1], rest[2]).transpose() * (p - m);
}

/// Plain linear-blend skinning with the same gradients as bone matrices.
Vec3d move_skinning(const std::array<Vec3d, 3>& rest, const std::array<Vec3d, 3>& now,
                    const std::array<Mat3d, 3>& gradients, const Vec3d& weights, const Vec3d& p) {
    Vec3d sum = Vec3d::Zero();
    for (int k = 0; k < 3; ++k) sum += weights[k] * (now[k] + gradients[k] * (p - rest[k]));
    return sum;
}

class Comparison {
public:
    Comparison(const Mesh& rest, const NamedWarp& warp, std::vector<FidelityRow>& rows, const RunContext& context)
        : warp_(warp), rows_(rows), context_(context) {
        truth_.face_offsets = restored_.face_offsets = rest.face_offsets;
        truth_.corners = restored_.corners = rest.corners;
        truth_.positions = warp_positions(*warp.warp, rest.positions, rest.origin, context);
    }

    /// Nothing where the method failed or was cancelled.
    void add(const char* method, Result<std::vector<Vec3f>> positions) {
        if (!positions) return;
        restored_.positions = *std::move(positions);
        const Result<MeshDistance> distance = mesh_distance(restored_, truth_, 0, context_);
        if (!distance || !distance->vertices) return;
        const VertexDistance& d = *distance->vertices;
        rows_.push_back(
            {method, warp_.name, warp_.affine, distance->relative(d.rms), distance->relative(d.max), d.normal_p95_deg});
    }

private:
    const NamedWarp& warp_;
    std::vector<FidelityRow>& rows_;
    const RunContext& context_;
    Mesh truth_, restored_;
};

} // namespace

std::vector<Vec3f> wrap_positions(const Model& model, const Pose& pose, const RunContext& context) {
    return move_with_cells(model, pose, move_wrap, context);
}

std::vector<FidelityRow> measure_fidelity(const Model& model, const ReferenceModel* reference,
                                          const RunContext& context) {
    std::vector<FidelityRow> rows;
    const Box box = world_bounds(model.mesh);
    const Result<Restorer> restorer = Restorer::create(model, {}, context);
    if (!restorer) return rows;

    for (const NamedWarp& warp : fidelity_warps(box)) {
        if (context.is_cancelled()) return rows;
        Comparison comparison(model.mesh, warp, rows, context);
        const Pose pose = warp_pose(*warp.warp, model, context);
        comparison.add("wrap", wrap_positions(model, pose, context));
        comparison.add("skinning", move_with_cells(model, pose, move_skinning, context));
        if (reference) {
            const std::vector<Vec3f> driver =
                warp_positions(*warp.warp, driver_positions(*reference), reference->mesh.origin, context);
            Result<Mesh> restored = restore_reference(*reference, driver, {}, context);
            if (!restored) return rows;
            comparison.add("reference", std::move(restored->positions));
        }
        const Pose positions_only{pose.positions, {}};
        comparison.add("blend_positions", restorer->positions(positions_only, context));
        comparison.add("blend_gradients", restorer->positions(pose, context));
    }
    return rows;
}

std::vector<FidelitySummary> summarise(const std::vector<FidelityRow>& rows) {
    std::vector<FidelitySummary> summaries;
    for (const FidelityRow& row : rows) {
        bool known = false;
        for (const FidelitySummary& summary : summaries) known |= summary.method == row.method;
        if (!known) summaries.push_back({row.method});
    }
    for (FidelitySummary& summary : summaries) {
        double affine = 0, curved = 0, normals = 0;
        int affine_count = 0, curved_count = 0;
        for (const FidelityRow& row : rows) {
            if (row.method != summary.method) continue;
            if (row.affine) {
                affine += std::log(std::max(row.rms, 1e-7));
                ++affine_count;
            } else {
                curved += std::log(std::max(row.rms, 1e-7));
                normals += std::log(std::max(row.normal_p95_deg, 1e-6));
                ++curved_count;
            }
        }
        summary.affine_rms = affine_count ? std::exp(affine / affine_count) : 0;
        summary.curved_rms = curved_count ? std::exp(curved / curved_count) : 0;
        summary.curved_normal_p95_deg = curved_count ? std::exp(normals / curved_count) : 0;
    }
    return summaries;
}

} // namespace filigree::bench
