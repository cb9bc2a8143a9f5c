// Which points of a lattice are inside a mesh: which way to ask, and asking.
#pragma once

#include "filigree/sample/closure.h"
#include "filigree/sample/inside_rays.h"
#include "filigree/sample/inside_scan.h"
#include "filigree/sample/winding_inside.h"

#include <optional>

namespace filigree {

/// automatic: scan for a mesh that is closed and consistently oriented (once vertices at one place are one, and faces
/// agree with their neighbours), else winding.
enum class InsideMethod { automatic, scan, rays, winding };

struct InsideOptions {
    InsideMethod method = InsideMethod::automatic;
    Overlap overlap = Overlap::parity;          ///< scan, rays: what lies in two closed parts
    std::optional<Vec3d> eye = {};              ///< rays: where they start, relative to the mesh's origin
    double accuracy = 0.01;                     ///< winding: largest error of a winding number, about
    std::size_t most_bytes = kMostLatticeBytes; ///< for all that is kept of a lattice
};

struct InsideReport {
    InsideMethod used = InsideMethod::automatic; ///< never automatic once filled
    Closure closure;
    OutwardReport outward; ///< what of the mesh counts as turned
    ScanReport scan;
    RayParity::Count rays;
    WindingReport winding;
    double setup_seconds = 0; ///< welding, finding out how the mesh closes, building trees
    double seconds = 0;       ///< deciding about the points
};

/// A mesh prepared once, for lattice after lattice.
class InsideSampler {
public:
    /// mesh: has to outlive the sampler. Cost O(V + F) for scan, O(F log F) for rays and winding.
    /// Errors: usage (check_mesh refuses the mesh), unsuitable (no faces; scan or rays of an open mesh: names an open
    /// edge and suggests winding; the eye lies on the surface), cancelled.
    static Result<InsideSampler> create(const Mesh& mesh, const InsideOptions& options, const RunContext& context);
    static Result<InsideSampler> create(const Mesh&& mesh, const InsideOptions&, const RunContext&) = delete;
    /// The same of what weld_triangles made; both have to outlive the sampler.
    static Result<InsideSampler> create(std::span<const Vec3f> positions, const WeldedTriangles& welded,
                                        const InsideOptions& options, const RunContext& context);
    InsideSampler(InsideSampler&&) noexcept;
    InsideSampler& operator=(InsideSampler&&) noexcept;
    ~InsideSampler();

    /// Which of the lattice's points are inside. The same answer by scan and by rays on every closed mesh.
    /// Errors: unsuitable (too large), cancelled.
    Result<Occupancy> inside(const Lattice& lattice, const RunContext& context, InsideReport* report = nullptr) const;
    InsideMethod used() const; ///< never automatic

private:
    struct Prepared;
    static Result<InsideSampler> prepare(std::unique_ptr<Prepared> prepared, const RunContext& context);
    explicit InsideSampler(std::unique_ptr<Prepared> prepared);
    std::unique_ptr<Prepared> prepared_;
};

/// One lattice. Errors: as InsideSampler.
Result<Occupancy> sample_inside(const Mesh& mesh, const Lattice& lattice, const InsideOptions& options,
                                const RunContext& context, InsideReport* report = nullptr);

/// Welds, chooses the method where it is automatic, and refuses what that method cannot do.
/// Errors: unsuitable, as InsideSampler; cancelled.
Result<WeldedTriangles> weld_for(InsideMethod& method, const Mesh& mesh, const RunContext& context);

} // namespace filigree
