// Gradients of a driver from its positions alone.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <memory>

struct flg_fit; // runtime/rt_fit.h

namespace filigree {

/// The gradient at each driver vertex of the smoothest deformation that takes the vertices around it to where they are
/// now: of the triharmonic interpolant (kernel r^3, affine part free, quadratic part nearly so; Duchon 1977) of its
/// neighbours in space. The interpolant is linear in the positions, so each gradient is a sum of (c_j' - c_i') g_ij^T
/// with weights g_ij that are solved for once. Exact at rest and for affine maps. The code is the runtime's.
///
/// Neighbours are 24 of the nearest vertices in space, and 8 of every eighth vertex, which see past a flat place; fewer
/// where there are no more. There is none at the vertex's own place and at most one at any place. Other connected parts
/// count only where the vertex's own part has too few. A vertex across a gap does not count: the surface has to lead to
/// it nearby, or matter has to be between.
///
/// Where the neighbours lie in one plane, nothing says what happens off it: the normal column is s n', n' the deformed
/// normal and s the square root of the plane's area ratio. Sets up to six thousandths as thick as wide go over into
/// that gradually. Where they lie on one line, the other two columns turn with it. A vertex without neighbours has the
/// identity.
class GradientFit {
public:
    /// What a gradient is made of before directions without neighbours are completed: constant + the sum over
    /// neighbours of (c_j' - c_i') weight_j^T.
    struct Terms {
        std::vector<Index> vertices;
        std::vector<Vec3d> weights;
        Mat3f constant;
        Vec3f line, normal;           ///< in which the neighbours spread most, and least
        float beside_line, off_plane; ///< share of what is completed across `line`, and along `normal`: 0 to 1
    };

    /// driver: the driver at rest, not checked. Cost O(V) solves of 36 unknowns, and O(V log V) for the neighbours.
    GradientFit(const Mesh& driver, const RunContext& context);

    /// One gradient a vertex of the driver, whose vertices are now at `positions`. Cost O(V); same bytes for any thread
    /// count.
    std::vector<Mat3f> fit(std::span<const Vec3f> positions, const RunContext& context) const;

    Terms terms(Index vertex) const; ///< of a vertex of the driver

private:
    struct Free {
        void operator()(flg_fit* fit) const;
    };
    std::unique_ptr<flg_fit, Free> fit_; ///< null: there are no vertices
};

} // namespace filigree
