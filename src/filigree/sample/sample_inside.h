// Points inside a mesh: which way to ask, and asking.
#pragma once

#include "filigree/sample/inside_rays.h"
#include "filigree/sample/inside_scan.h"
#include "filigree/sample/winding.h"

#include <string>

namespace filigree {

/// automatic: scan for a mesh that is closed and consistently oriented (once vertices at one place are one), else
/// winding.
enum class InsideMethod { automatic, scan, rays, winding };

struct InsideOptions {
    InsideMethod method = InsideMethod::automatic;
    Overlap overlap = Overlap::parity;             ///< scan: what lies in two closed parts
    std::optional<Vec3d> eye = {};                 ///< rays: where they start, relative to the mesh's origin
    double accuracy = 0.01;                        ///< winding: largest error of a winding number, about
    std::size_t most_bytes = std::size_t{4} << 30; ///< for the bits of a lattice
};

/// How a mesh closes, with vertices at one place made one.
struct Closure {
    std::size_t open_edges = 0; ///< that an odd number of triangles share
    std::size_t unbalanced = 0; ///< that are not run along as often one way as the other
    std::array<Vec3f, 2> first_open = {Vec3f::Zero(), Vec3f::Zero()}; ///< ends of the first open edge
    bool is_closed() const { return open_edges == 0; }
    bool is_oriented() const { return unbalanced == 0; }
};

/// Triangles of a mesh over welded vertices, degenerate ones left out. Cost O(corners).
struct WeldedTriangles {
    std::vector<Triangle> triangles; ///< over the mesh's own positions
    Closure closure;
};
WeldedTriangles weld_triangles(const Mesh& mesh);

struct InsideReport {
    InsideMethod used = InsideMethod::automatic; ///< never automatic once filled
    Closure closure;
    ScanReport scan;
    RayParity::Count rays;
    WindingReport winding;
    double setup_seconds = 0; ///< welding, finding out how the mesh closes, building trees
    double seconds = 0;       ///< deciding about the points
};

/// Which of a lattice's points are inside. The same answer by scan and by rays on every closed mesh.
/// Errors: unsuitable (no faces; scan or rays of an open mesh: names an open edge and suggests winding; too large),
/// cancelled.
Result<Occupancy> sample_inside(const Mesh& mesh, const Lattice& lattice, const InsideOptions& options,
                                const RunContext& context, InsideReport* report = nullptr);

/// The same question about single points, again and again. scan is answered by rays, which agree with it.
class InsideTest {
public:
    /// Errors as sample_inside. Copies what it needs of the mesh. Cost O(F log F).
    static Result<InsideTest> create(const Mesh& mesh, const InsideOptions& options, const RunContext& context);
    InsideTest(InsideTest&&) noexcept;
    InsideTest& operator=(InsideTest&&) noexcept;
    ~InsideTest();

    /// point: relative to the mesh's origin. Safe from many threads.
    bool contains(const Vec3d& point) const;
    /// One 0 or 1 a point. Errors: cancelled.
    Result<std::vector<std::uint8_t>> contains(std::span<const Vec3d> points, const RunContext& context) const;
    InsideMethod used() const;

private:
    struct Content;
    explicit InsideTest(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

/// The spacing at which about `count` lattice points are inside, to a few percent where the mesh has volume.
/// Errors: as sample_inside; unsuitable (nothing is inside).
Result<double> spacing_for_count(const Mesh& mesh, std::size_t count, const InsideOptions& options,
                                 const RunContext& context);

/// How points are spread. jitter: each lattice point somewhere in its own cell. poisson: in random places, none closer
/// to another than 0.8 of the spacing. All of them inside; seeded by the context.
enum class Pattern { lattice, jitter, poisson };

/// Points inside, relative to the mesh's origin. Errors: as sample_inside.
Result<std::vector<Vec3d>> spread_inside(const Mesh& mesh, const Lattice& lattice, Pattern pattern,
                                         const InsideOptions& options, const RunContext& context,
                                         InsideReport* report = nullptr);

/// The report's lattice (2.2): points in a view frustum in regular steps across the picture and in depth.
struct Frustum {
    Vec3d eye, target, up = {0, 1, 0};
    double field_of_view_deg = 30, aspect = 1, near = 0, far = 0; ///< near and far: along the view, above 0
    std::array<std::size_t, 3> counts = {};                       ///< across, up, in depth
};
/// The points, by depth, row and column. Errors: usage (no extent, near not below far, more than 2^28 points).
Result<std::vector<Vec3d>> frustum_points(const Frustum& frustum);

} // namespace filigree
