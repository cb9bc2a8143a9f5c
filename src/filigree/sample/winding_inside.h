// Which points of a lattice are inside a mesh that is open, crosses itself or has triangles that face the wrong way.
#pragma once

#include "filigree/sample/inside_scan.h"
#include "filigree/sample/winding_tree.h"

namespace filigree {

/// How sure a classification by winding numbers is.
struct WindingReport {
    std::size_t open_edges = 0; ///< edges at which triangles do not cancel; cones close the mesh there
    double near_half = 0;       ///< share of points with a winding number within 0.1 of 1/2 (or of another half)
    double seconds = 0;
};

struct WindingOptions {
    double accuracy = 0.01;                     ///< as WindingTree
    std::size_t most_bytes = kMostLatticeBytes; ///< for all that is kept of a lattice
};

/// Points of a lattice with a winding number of at least 1/2. They are found as exact crossings row by row
/// (scan_winding) of the mesh and of cones that close it, less the winding numbers of the cones, which alone need a
/// tree; blocks of points far from a decision are filled whole. For a closed, consistently oriented mesh this is the
/// scan alone, with overlaps merged.
class WindingSampler {
public:
    /// mesh: triangles over welded vertices, else all edges are open; has to outlive the sampler.
    /// Cost O(V + F), and 1 us a triangle of the cones. Errors: cancelled.
    static Result<WindingSampler> create(const ScanMesh& mesh, const WindingOptions& options,
                                         const RunContext& context);

    /// Errors: as scan_inside and scan_winding.
    Result<Occupancy> inside(const Lattice& lattice, const RunContext& context, WindingReport* report = nullptr) const;

private:
    WindingSampler(const ScanMesh& mesh, const WindingOptions& options) : mesh_(mesh), options_(options) {}

    ScanMesh mesh_;
    WindingOptions options_;
    std::size_t open_edges_ = 0;
    std::vector<Vec3f> positions_;     ///< the mesh's, and the tips of the cones
    std::vector<Triangle> triangles_;  ///< the mesh's, and the cones'
    std::optional<WindingTree> cones_; ///< none: the mesh is closed
};

/// One lattice. Errors: as WindingSampler.
Result<Occupancy> winding_inside(const ScanMesh& mesh, const Lattice& lattice, const WindingOptions& options,
                                 const RunContext& context, WindingReport* report = nullptr);

} // namespace filigree
