// Points that go along with particles: which particles carry each, by which weights.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/physics/vectors.h"

#include <span>

namespace filigree {

struct Cells;

/// Point i is carried by particles[offsets[i] .. offsets[i + 1]) with weights that sum to 1 and reproduce linear
/// functions: sum w X = rest[i].
struct Embedding {
    std::vector<Vec3f> rest; ///< m
    std::vector<Index> offsets = {0};
    std::vector<Index> particles;
    std::vector<float> weights;

    std::size_t size() const { return rest.size(); }
};

struct EmbeddingReport {
    std::size_t far_points = 0; ///< with too few particles near; carried by the nearest ones
    float least_weight = 0;     ///< most negative
};

/// Linearly precise moving-least-squares weights over the particles within 1.75 spacings of each point; more of them
/// where those do not span space. Cost O(points log particles).
Embedding embed(std::span<const Vec3f> points, const Vectors& rest, double spacing, const RunContext& context,
                EmbeddingReport* report = nullptr);

/// Weights for move_embedded, whose Hermite form follows affine motion by any weights that sum to 1. They are as linear
/// as they can be with none below -0.05: weights that shoot out of the body make more of what single particles do than
/// of the motion, and differ from point to point. They change without a jump where those of `embed` reach further.
/// cells: whose corners the particles are, or null. Then only corners of a point's own cell and of the cells around it
/// carry it, not what lies across a gap.
Embedding embed_to_follow(std::span<const Vec3f> points, const Vectors& rest, double spacing, const Cells* cells,
                          const RunContext& context);

/// Trilinear weights in the cell that holds each point (or the nearest cell): positive inside, eight a point. For the
/// corners of cells.
Embedding embed_in_cells(std::span<const Vec3f> points, const Cells& cells, const RunContext& context);

/// Weights as those of `embed`, for the corners of cells whose particles lie in them; particles across a gap carry
/// none. Of the particles of the cells around each corner, and more where those do not span space.
Embedding embed_corners(const Cells& cells, const Vectors& rest, const RunContext& context);

/// Points that go along with others, which go along with particles: by which particles, then.
Embedding carried_on(const Embedding& points, const Embedding& carriers);

/// Where the points went, and the deformation gradients there, by the Hermite form of docs/bodies-theory.md:
///     A = sum w F_j,   c' = sum w (x_j + 1/2 (F_j + A) (c - X_j)).
/// An affine motion of the particles is followed exactly. `gradients` may be empty: not wanted. Cost O(weights).
void move_embedded(const Embedding& embedding, const Vectors& rest, const Vectors& positions,
                   std::span<const Mat3f> particle_gradients, std::span<Vec3f> points, std::span<Mat3f> gradients,
                   const RunContext& context);

/// The same from positions alone: the affine motion that fits those of each point's particles best. For particles that
/// have no gradients.
void fit_embedded(const Embedding& embedding, const Vectors& rest, const Vectors& positions, std::span<Vec3f> points,
                  std::span<Mat3f> gradients, const RunContext& context);

} // namespace filigree
