// How fine a body's driver is, seen from its particles: the one it gets by default, what is wrong with another, and the
// error to expect.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/strip.h"

#include <string>

namespace filigree {

/// Spacings: a driver triangle with a longer edge does not follow what the particles do between its corners.
inline constexpr double kLongestDriverEdge = 1.5;

/// A driver's edges in spacings of the body that moves it.
struct DriverEdges {
    double mean = 0, longest = 0;
    /// Of the mesh's vertices that are not the driver's, the part on a face with an edge above kLongestDriverEdge.
    double on_long_edges = 0;
    double carried = 0; ///< part of the mesh's vertices that are not the driver's
};

/// How a body's driver is stripped where nothing else is asked for: edges of 0.8 spacings on average, none that
/// simplification makes longer than 1.2. A mesh with fewer than four times as many vertices is all driver.
/// mesh: what the body was made of; not checked.
StripOptions body_driver_options(const Mesh& mesh, const Body& body);

/// Cost O(vertices).
DriverEdges measure_driver(const Model& model, const Body& body);

/// A driver that is too coarse to follow the body's particles, and how to strip one that does.
struct CoarseDriver {
    double on_long_edges = 0, longest = 0; ///< as in DriverEdges
    std::size_t base = 0;                  ///< StripOptions of a driver that does
    double max_edge = 0;
    std::string sentence() const; ///< without a full stop
};
/// None: it is fine enough.
std::optional<CoarseDriver> coarse_driver(const DriverEdges& edges, const Model& model, const Body& body);

/// Root mean square distances to expect, in diagonals at rest, means over the moving frames.
struct ExpectedError {
    double spacing = 0; ///< of what the particles carry from the same motion of eight times the particles
    double driver = 0;  ///< of the restored mesh from every vertex carried by the particles
};

/// Both grow with how much gradients differ along the driver's edges, the former with the spacing's square, the latter
/// with the edges'. Measured on six scenes (docs/bodies-theory.md): the former is right within a factor of 3, but for a
/// bar whose cells lie along its surface (4.5 too large), the latter within 2. poses: in metres, with gradients; the
/// first is the start. Cost O(frames x driver).
ExpectedError expected_error(const PoseSequence& poses, const DriverEdges& edges, const Model& model, const Body& body);

} // namespace filigree
