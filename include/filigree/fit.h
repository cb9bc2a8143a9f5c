// From any animated mesh to a small model: fit_animation() finds a driver and its poses.
//
//     const Fitted fitted = fit_animation(animation, {.error = 1e-4}).value();
//     write_model(fitted.model, fitted.poses, "flag.fil");
//
// A simulation, a vertex cache or a character becomes a model like any other: export it as a skin, pack it, restore it.
// An animation is read with open_animation (file.h), or its frames come from memory.
#pragma once

#include "filigree/context.h"
#include "filigree/file.h"
#include "filigree/strip.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace filigree {

/// How the vertices of a driver are chosen: by edge collapses that are priced by
enum class DriverChoice {
    rest,   ///< distances from the rest shape, and lengths
    motion, ///< distances from the rest shape and from the frames that are farthest from it and from each other
};
/// "rest", "motion".
std::string_view name_of(DriverChoice choice);

struct FitOptions {
    /// Largest error, fraction of the rest shape's diagonal: root of the mean squared distance of vertices over all
    /// frames.
    double error = 1e-4;
    /// Largest distance of any vertex in any frame, fraction of the diagonal; unset: any.
    std::optional<double> max_error = {};
    /// Number of driver vertices, about; 12 or more. error and max_error are then not asked for.
    std::optional<std::size_t> base = {};
    /// The frame whose positions are the rest shape; unset: the positions of the animation's mesh.
    std::optional<std::size_t> rest_frame = {};
    /// Unset: what has the least error on some frames.
    std::optional<DriverChoice> choice = {};
    /// Rounds, at most, in which weights of vertices are moved to where the mesh follows more closely; 0: weights stay
    /// as vertices were bound. Three rounds make the driver smaller: to two thirds for cloth, to a third for characters
    /// with sharp weights. Each takes three passes over the frames more. PackOptions::records keeps moved weights;
    /// other packed files lose them.
    unsigned weight_rounds = 0;
    /// Whether gradients stay near the driver's own motion, so that viewers, which turn the normals of a skin by them,
    /// shade it right. The errors that were measured are 1.1 to 1.6 times as large.
    bool sound_gradients = false;
};

/// Distances as fractions of the rest shape's diagonal.
struct FitReport {
    std::size_t vertices = 0, frames = 0, driver_vertices = 0;
    double diagonal = 0;       ///< of the rest shape, model units
    double rms = 0, max = 0;   ///< over all vertices and frames
    std::size_t max_frame = 0; ///< counts from 0
    Index max_vertex = kNoIndex;
    /// Angle between the vertex normals of the restored mesh and of the animation, degrees: the mean, and the worst
    /// 95th percentile, over 16 frames or all.
    double normal_mean_deg = 0, normal_p95_deg = 0;
    DriverChoice choice = DriverChoice::rest;
    /// Vertices that lie at one place at rest and part in some frame.
    std::size_t parted = 0;
    std::size_t tries = 0;         ///< drivers that were fitted to all frames
    bool has_free_weights = false; ///< whether weights are not those of binding
};

struct Fitted {
    Model model;
    PoseSequence poses; ///< one a frame, with gradients
    FitReport report;
};

/// How far a model's poses are from an animation of its mesh, over all vertices and frames.
struct AnimationError {
    double rms = 0, max = 0; ///< model units
    std::size_t max_frame = 0;
    Index max_vertex = kNoIndex; ///< of the model
};
/// Restores every pose and measures it against the animation's frame of the same number. order: vertex i of the model
/// is vertex order[i] of the animation; empty: the same. Cost O(V) a frame. Errors: mismatch (another number of
/// vertices or frames), cancelled, and those of the animation.
Result<AnimationError> animation_error(const Model& model, const PoseSequence& poses, const MeshAnimation& animation,
                                       std::span<const Index> order = {}, const RunContext& context = RunContext());

/// Finds the smallest driver whose restored mesh follows an animation within an error, and its poses by least squares.
/// The mesh of the model is the animation's, at rest, and keeps its order. The error is measured on every vertex of
/// every frame as Restorer gives it. A driver has 20,000 vertices at most, and a quarter of the mesh's (64 where the
/// mesh is smaller than that). Results are the same to the byte for any number of threads. Cost: three
/// passes over the frames or a few more, O(V) each: about 8 processor seconds for 120 frames of 440,000 vertices.
/// Memory: the mesh, a frame, 12 numbers a driver vertex and frame. Errors: usage (options that make no sense;
/// check_mesh refuses the mesh), unsuitable (no frames, no faces; a frame that is not finite, or of another order; the
/// error is not reached: the sentence says what is), out_of_memory, cancelled, and those of the animation.
Result<Fitted> fit_animation(const MeshAnimation& animation, const FitOptions& options = {},
                             const RunContext& context = RunContext());

/// The frame that makes the best rest shape where there is none: the one from which the edges of the others are
/// stretched least, of 32 frames at most. Errors: usage (check_mesh refuses the mesh), unsuitable (no frames; a number
/// that is not finite), cancelled, and those of the animation.
Result<std::size_t> least_stretched_frame(const MeshAnimation& animation, const RunContext& context = RunContext());

} // namespace filigree
