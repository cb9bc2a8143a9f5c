// Generalised winding numbers [Jacobson et al. 2013], for meshes that are open, cross themselves or turn about.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/sample/lattice.h"

#include <memory>

namespace filigree {

/// Winding numbers of points by a tree of dipoles [Barill et al. 2018]; exact sums near by.
class WindingTree {
public:
    /// accuracy: largest error of a winding number, about, from 0.0001 to 0.1 (measured: a third of it). Copies what it
    /// needs. Cost O(F log F), 1 us a triangle. When cancelled or without triangles, all winding numbers are 0.
    WindingTree(std::span<const Vec3f> positions, std::span<const Triangle> triangles, double accuracy,
                const RunContext& context);
    WindingTree(WindingTree&&) noexcept;
    WindingTree& operator=(WindingTree&&) noexcept;
    ~WindingTree();

    /// Of point + (e, e^2, e^3) where it lies on a triangle, as everywhere in `sample`.
    double winding(const Vec3d& point) const;
    /// Errors: cancelled.
    Result<std::vector<float>> winding(std::span<const Vec3d> points, const RunContext& context) const;

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

/// How sure a classification by winding numbers is.
struct WindingReport {
    std::size_t open_edges = 0; ///< edges whose faces do not cancel, which the cones were put over
    double near_half = 0;       ///< share of points with a winding number within 0.1 of 1/2 (or of another half)
    double seconds = 0;
};

/// Points of a lattice with a winding number of at least 1/2. Exact crossings row by row (scan_winding) plus the part
/// that cones over the open edges add, which only a tree over those cones has to say, to `accuracy`; blocks far from a
/// decision are filled whole. triangles: over welded vertices, else all edges are open. For a closed, consistently
/// oriented mesh this is the scan alone, with overlaps merged. Errors: as scan_inside.
Result<Occupancy> winding_inside(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                 const Lattice& lattice, double accuracy, const RunContext& context,
                                 WindingReport* report = nullptr);

} // namespace filigree
