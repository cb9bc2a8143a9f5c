// Which points of a lattice are inside a mesh that is open, crosses itself or has triangles that face the wrong way.
#pragma once

#include "filigree/sample/inside_scan.h"
#include "filigree/sample/winding_tree.h"

#include <cmath>
#include <optional>

namespace filigree {

struct WindingOptions {
    double accuracy = 0.01;                     ///< as WindingTree
    std::size_t most_bytes = kMostLatticeBytes; ///< for all that is kept of a lattice
};

/// A mesh that is open or whose triangles do not cancel at some edges, closed by cones over those edges. Its winding
/// number around a point is that of the closed mesh, a whole number, less that of the cones, by a tree.
struct ClosedByCones {
    std::size_t open_edges = 0;
    std::vector<Vec3f> positions;     ///< the mesh's, and the tips; empty without cones
    std::vector<Triangle> triangles;  ///< the mesh's, and the cones'; empty without cones
    std::optional<WindingTree> cones; ///< none: the mesh is closed

    /// How often the closed mesh has to go round a point that is inside: winding numbers of 1/2 and more are.
    int least_winding(const Vec3d& point) const { return cones ? least_winding(cones->winding(point)) : 1; }
    static int least_winding(double of_cones) { return static_cast<int>(std::ceil(of_cones + 0.5)); }
};
/// Cost O(V + F), and 1 us a triangle of the cones. Errors: cancelled.
Result<ClosedByCones> close_by_cones(const ScanMesh& mesh, double accuracy, const RunContext& context);

/// Points of a lattice with a winding number of at least 1/2. They are found as exact crossings row by row
/// (scan_winding) of the mesh closed by cones, less the winding numbers of the cones; blocks of points far from a
/// decision are filled whole. For a closed, consistently oriented mesh this is the scan alone, with overlaps merged.
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
    ClosedByCones closed_;
};

/// One lattice. Errors: as WindingSampler.
Result<Occupancy> winding_inside(const ScanMesh& mesh, const Lattice& lattice, const WindingOptions& options,
                                 const RunContext& context, WindingReport* report = nullptr);

} // namespace filigree
