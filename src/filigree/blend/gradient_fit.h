// Gradients of a driver from its positions alone.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/mesh/edges.h"

namespace filigree {

/// The gradient at each driver vertex of the smoothest deformation that takes the vertices around it to where they are
/// now: of the triharmonic interpolant (kernel r^3, affine part free, quadratic part nearly so; Duchon 1977) of its
/// neighbours in space (space_neighbours.h). The interpolant is linear in the positions, so each gradient is a sum of
/// (c_j' - c_i') g_ij^T with weights g_ij that are solved for once. Exact at rest and for affine maps.
///
/// Where the neighbours lie in one plane, nothing says what happens off it: the normal column is s n', n' the deformed
/// normal and s the square root of the plane's area ratio. Sets up to six thousandths as thick as wide go over into
/// that gradually. Where they lie on one line, the other two columns turn with it. A vertex without neighbours has the
/// identity.
class GradientFit {
public:
    /// driver: the driver at rest, not checked. Cost O(V) solves of 36 unknowns, and O(V log V) for the neighbours.
    GradientFit(const Mesh& driver, const RunContext& context);

    /// One gradient a vertex of the driver, whose vertices are now at `positions`. Cost O(V); same bytes for any thread
    /// count.
    std::vector<Mat3f> fit(std::span<const Vec3f> positions, const RunContext& context) const;

private:
    /// One term of a vertex's sum.
    struct Term {
        Index vertex;
        Vec3d weight;
    };
    /// Directions in which a vertex's neighbours do not spread, and the share of what is completed there, 0 to 1.
    struct Flatness {
        Vec3f line, normal; ///< along which they spread most, and least
        float beside_line = 0, off_plane = 0;
    };
    void solve(Index vertex, const IndexLists& neighbours);
    static Mat3f complete(const Mat3f& gradient, const Flatness& flatness);
    std::vector<Mat3f> sum(std::span<const Vec3f> positions, const RunContext& context) const;

    std::vector<Vec3f> rest_;
    std::vector<Index> term_offsets_;
    std::vector<Term> terms_;
    std::vector<Flatness> flatness_;
    /// What the sum misses at rest: rounding, and everything where there are no neighbours.
    std::vector<Mat3f> rest_error_;
};

} // namespace filigree
