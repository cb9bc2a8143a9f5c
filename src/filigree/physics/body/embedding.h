// Embeds points in a body: which particles carry each point, with which weights; and where the points go.
#pragma once

#include "filigree/physics/body.h"

namespace filigree {

struct EmbeddingReport {
    std::size_t far_points = 0; ///< points with too few particles near; the nearest ones carry them
    float least_weight = 0;     ///< most negative
};

/// Embeds points by moving least squares over the particles within 1.75 spacings of each point, and over more particles
/// where those do not span space. Weights reproduce linear functions. Cost O(points log particles).
Embedding embed(std::span<const Vec3f> points, const Vectors& rest, double spacing, const RunContext& context,
                EmbeddingReport* report = nullptr);

/// Embeds points for move_embedded, whose Hermite form follows affine motion with any weights that sum to 1. Weights
/// are as linear as possible without one below -0.05: large weights of both signs would follow single particles more
/// than the motion. Weights change continuously from point to point. cells: the cells whose corners the particles are,
/// or null. With cells, only corners of a point's own cell and of the 26 cells around it carry the point, so that
/// nothing across a gap does.
Embedding embed_to_follow(std::span<const Vec3f> points, const Vectors& rest, double spacing, const Cells* cells,
                          const RunContext& context);

/// The cell that a point goes with (Cells::find_cell), else the nearest. at: in spacings, from the cells' origin.
Index nearest_cell(const Cells& cells, const Vec3d& at);

/// Trilinear weights in the cell that holds each point (or the nearest cell): positive inside, eight a point. For the
/// corners of cells.
Embedding embed_in_cells(std::span<const Vec3f> points, const Cells& cells, const RunContext& context);

/// Embeds the corners of cells in the particles that lie in the cells, with linear weights. The particles of the cells
/// around a corner carry it, and more of them where those do not span space; particles across a gap do not.
Embedding embed_corners(const Cells& cells, const Vectors& rest, const RunContext& context);

/// Embeds points in particles, where the points are embedded in carriers and the carriers in particles.
Embedding carried_on(const Embedding& points, const Embedding& carriers);

/// Where the points went, and the deformation gradients there, by the Hermite form of docs/bodies-theory.md:
///     A = sum w F_j,   c' = sum w (x_j + 1/2 (F_j + A) (c - X_j)).
/// An affine motion of the particles is followed exactly. `gradients` may be empty: not wanted. Cost O(weights).
void move_embedded(const Embedding& embedding, const Vectors& rest, const Vectors& positions,
                   std::span<const Mat3f> particle_gradients, std::span<Vec3f> points, std::span<Mat3f> gradients,
                   const RunContext& context);

/// Moves points from positions alone, for particles that have no gradients: by the affine motion that fits each point's
/// particles best. gradients: one a point, or empty when not wanted.
void fit_embedded(const Embedding& embedding, const Vectors& rest, const Vectors& positions, std::span<Vec3f> points,
                  std::span<Mat3f> gradients, const RunContext& context);

} // namespace filigree
