// Points inside a mesh: on a lattice, jittered or as Poisson samples; and whether single points are inside.
//
//     const Lattice lattice = make_lattice(bounds(mesh), {.spacing = 0.01}).value();
//     const std::vector<Vec3d> points = spread_inside(mesh, lattice, Pattern::poisson).value();
//
//     const InsideTest test = InsideTest::create(mesh).value();
//     const bool is_inside = test.contains({0, 0, 0});
//
// Closed meshes are decided exactly, without tolerances. Open meshes, and meshes that cross themselves, are decided by
// winding numbers. Faces that look the wrong way are turned first, and reports say how many. All points are relative to
// the mesh's origin, in model units.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/result.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Lattices

/// Points along an axis at most: lower bounds on them, 0 to count, then fit into 16 bits.
inline constexpr std::size_t kMostLowerBounds = 65534;

/// The points (x[i], y[j], z[k]). The stored doubles are the points: every decision about them is exact.
struct Lattice {
    std::array<std::vector<double>, 3> coordinates; ///< x, y and z; ascending, `spacing` apart up to rounding
    double spacing = 0;                             ///< model units

    std::array<std::size_t, 3> counts() const {
        return {coordinates[0].size(), coordinates[1].size(), coordinates[2].size()};
    }
    double point_count() const { ///< a double, as it may not fit into an integer
        return double(coordinates[0].size()) * double(coordinates[1].size()) * double(coordinates[2].size());
    }
    Vec3d point(std::size_t i, std::size_t j, std::size_t k) const {
        return {coordinates[0][i], coordinates[1][j], coordinates[2][k]};
    }
};

struct LatticeOptions {
    double spacing = 0; ///< model units, above 0
    /// A point of the lattice. Unset: half a spacing inside the lowest corner of the box, which centres the lattice in
    /// its cells.
    std::optional<Vec3d> origin = {};
};

/// The lattice over a box. Spacing and origin are rounded by less than 2^-24 of the spacing, so that most ties can be
/// decided in integers. Without an origin, an axis shorter than the spacing gets one layer, in its middle.
/// Errors: usage (a spacing that is not finite, not above 0 or larger than the box; a box without extent), unsuitable
/// (more than 65,534 points on an axis, or none; a spacing below the resolution of the coordinates: the sentence says
/// what works).
Result<Lattice> make_lattice(const Box& box, const LatticeOptions& options);

/// One bit a lattice point. Bit i & 63 of word i >> 6 of row (j, k) is point (i, j, k).
struct Occupancy {
    std::array<std::size_t, 3> counts = {};
    std::size_t words_per_row = 0;
    std::vector<std::uint64_t> bits;

    bool contains(std::size_t i, std::size_t j, std::size_t k) const {
        return bits[(k * counts[1] + j) * words_per_row + (i >> 6)] >> (i & 63) & 1;
    }
    std::size_t count() const; ///< number of points inside
};

/// Calls visit(i, j, k) for each point inside, in the order of k, then j, then i.
template <class Visit>
void for_each_inside(const Occupancy& occupancy, const Visit& visit) {
    std::size_t word = 0;
    for (std::size_t k = 0; k < occupancy.counts[2]; ++k)
        for (std::size_t j = 0; j < occupancy.counts[1]; ++j)
            for (std::size_t w = 0; w < occupancy.words_per_row; ++w, ++word)
                for (std::uint64_t rest = occupancy.bits[word]; rest != 0; rest &= rest - 1)
                    visit(64 * w + std::size_t(std::countr_zero(rest)), j, k);
}

/// Points of a lattice, in the order of k, then j, then i.
struct LatticePoints {
    std::vector<std::array<std::uint16_t, 3>> indices; ///< i, j, k
    std::vector<Vec3f> positions;                      ///< rounded to float
};
/// The points of a lattice that are inside.
LatticePoints points_inside(const Lattice& lattice, const Occupancy& occupancy);

// ---------------------------------------------------------------------------------------------------------------------
// What is inside

/// How points are decided.
/// - automatic: scan for a mesh that is closed and consistently oriented, after vertices at the same place are welded
///   and faces are turned to agree with their neighbours; else winding. InsideTest takes rays in place of scan.
/// - scan: whole rows of a lattice at a time, exact.
/// - rays: the parity of crossings of a ray from an eye to the point, exact. It agrees with scan.
/// - winding: winding number of at least 1/2. For open meshes.
enum class InsideMethod { automatic, scan, rays, winding };

/// Where closed parts overlap: parity makes the overlap outside, merged makes it inside.
enum class Overlap { parity, merged };

/// Most memory for decisions about a lattice, unless InsideOptions says otherwise: 4 GiB, 512 MiB on 32 bits.
inline constexpr std::size_t kMostLatticeBytes = std::size_t{1} << (sizeof(std::size_t) > 4 ? 32 : 29);

struct InsideOptions {
    InsideMethod method = InsideMethod::automatic;
    Overlap overlap = Overlap::parity;          ///< scan, rays
    std::optional<Vec3d> eye = {};              ///< rays: where they start; unset: far outside the box
    double accuracy = 0.01;                     ///< winding: largest error of a winding number, about
    std::size_t most_bytes = kMostLatticeBytes; ///< most memory for a lattice
};

/// How a mesh closes, once vertices at the same place are welded.
struct Closure {
    std::size_t open_edges = 0; ///< edges with an odd number of triangles
    std::size_t unbalanced = 0; ///< edges whose triangles do not run along them equally often both ways
    std::size_t turned = 0;     ///< of these, edges of two triangles that run the same way
    std::array<Vec3f, 2> first_open = {Vec3f::Zero(), Vec3f::Zero()}; ///< ends of the first open edge
    bool is_closed() const { return open_edges == 0; }
    bool is_oriented() const { return unbalanced == 0; }
};

/// What counts differently than the file has it, so that faces look outwards. A part is a set of faces that are
/// connected over edges.
struct OutwardReport {
    std::size_t parts = 0;
    std::size_t inward_parts = 0;    ///< parts that looked inwards: turned
    std::size_t cavities = 0;        ///< parts inside others that looked outwards: turned, as they bound a hollow
    std::size_t turned_faces = 0;    ///< triangles that did not agree with the rest of their part: turned
    std::size_t inner_faces = 0;     ///< triangles left out: walls inside matter, and faces that are there twice
    std::size_t one_sided_parts = 0; ///< like a Moebius strip: unchanged, as nothing tells their inside

    bool is_as_it_was() const { return inward_parts + cavities + turned_faces + inner_faces + one_sided_parts == 0; }
};
/// The report as sentences; "" where nothing was changed.
std::string outward_sentence(const OutwardReport& report);

/// How many exact decisions the fast filter in double could not make.
struct ExactDecisions {
    std::uint64_t integers = 0;   ///< made in 128-bit integers
    std::uint64_t expansions = 0; ///< made by floating-point expansions [Shewchuk 1997]
};

struct ScanReport {
    std::uint64_t crossings = 0; ///< of lattice rows with triangles
    ExactDecisions tally;
    double seconds = 0;
};
struct RayReport {
    std::uint64_t crossings = 0, triangles_tested = 0;
    std::int64_t net = 0; ///< crossings against the normals less crossings along them
    ExactDecisions tally;
};
struct WindingReport {
    std::size_t open_edges = 0; ///< edges at which triangles do not cancel
    double near_half = 0;       ///< share of points with a winding number within 0.1 of the decision
    double seconds = 0;
};

struct InsideReport {
    InsideMethod used = InsideMethod::automatic; ///< the method that decided; never automatic
    Closure closure;
    OutwardReport outward;
    ScanReport scan;
    RayReport rays;
    WindingReport winding;
    double setup_seconds = 0; ///< welding, turning, building trees
    double seconds = 0;       ///< deciding
};

struct WeldedTriangles;

/// Decides about lattices, one after the other. The mesh is prepared once.
class InsideSampler {
public:
    /// The mesh must outlive the sampler. Cost O(V + F) for scan, O(F log F) for rays and winding. Errors: usage
    /// (check_mesh refuses the mesh), unsuitable (no faces; scan or rays of an open mesh: the sentence names an open
    /// edge; the eye lies on the surface), cancelled.
    static Result<InsideSampler> create(const Mesh& mesh, const InsideOptions& options = {},
                                        const RunContext& context = RunContext());
    static Result<InsideSampler> create(const Mesh&& mesh, const InsideOptions& = {},
                                        const RunContext& = RunContext()) = delete;
    /// For bodies: takes what weld_triangles (sample/closure.h) made. Both must outlive the sampler.
    static Result<InsideSampler> create(std::span<const Vec3f> positions, const WeldedTriangles& welded,
                                        const InsideOptions& options, const RunContext& context);
    InsideSampler(InsideSampler&&) noexcept;
    InsideSampler& operator=(InsideSampler&&) noexcept;
    ~InsideSampler();

    /// Which points of the lattice are inside. Scan and rays give the same answer for every closed mesh.
    /// Errors: unsuitable (more memory than InsideOptions::most_bytes: the sentence says how much), cancelled.
    Result<Occupancy> inside(const Lattice& lattice, const RunContext& context = RunContext(),
                             InsideReport* report = nullptr) const;
    InsideMethod used() const; ///< the method that decides; never automatic

private:
    struct Prepared;
    static Result<InsideSampler> prepare(std::unique_ptr<Prepared> prepared, const RunContext& context);
    explicit InsideSampler(std::unique_ptr<Prepared> prepared);
    std::unique_ptr<Prepared> prepared_;
};

/// Decides about one lattice. Errors: those of InsideSampler.
Result<Occupancy> sample_inside(const Mesh& mesh, const Lattice& lattice, const InsideOptions& options = {},
                                const RunContext& context = RunContext(), InsideReport* report = nullptr);

// ---------------------------------------------------------------------------------------------------------------------
// Spreading points

/// - lattice: the points of the lattice.
/// - jitter: each point of the lattice, moved to a random place in its own cell.
/// - poisson: random points, none closer to another than 0.8 of the spacing.
enum class Pattern { lattice, jitter, poisson };

/// Points inside a mesh. RunContext::seed draws them. Memory: a bit a lattice point; 24 bytes a point, about 100 for
/// poisson. Cost: sample_inside, and one to eight questions of InsideTest for each point of jitter and poisson. Errors:
/// those of InsideSampler.
Result<std::vector<Vec3d>> spread_inside(const Mesh& mesh, const Lattice& lattice, Pattern pattern,
                                         const InsideOptions& options = {}, const RunContext& context = RunContext(),
                                         InsideReport* report = nullptr);

/// The spacing at which about `count` lattice points are inside: within a few per cent, except in boxes that are a few
/// spacings thin, where single layers count. Asks up to four lattices. Errors: those of InsideSampler; unsuitable
/// (nothing is inside, or hardly a point of 1.6 million; more than 60,000 points along an axis).
Result<double> spacing_for_count(const Mesh& mesh, std::size_t count, const InsideOptions& options = {},
                                 const RunContext& context = RunContext());

// ---------------------------------------------------------------------------------------------------------------------
// Single points

/// Decides about single points, again and again.
class InsideTest {
public:
    /// Copies what it needs of the mesh. Cost O(F log F). Errors: those of InsideSampler::create.
    static Result<InsideTest> create(const Mesh& mesh, const InsideOptions& options = {},
                                     const RunContext& context = RunContext());
    InsideTest(InsideTest&&) noexcept;
    InsideTest& operator=(InsideTest&&) noexcept;
    ~InsideTest();

    /// Whether a point is inside. Safe from many threads. Cost O(log F).
    bool contains(const Vec3d& point) const;
    /// One 0 or 1 a point. Errors: cancelled.
    Result<std::vector<std::uint8_t>> contains(std::span<const Vec3d> points,
                                               const RunContext& context = RunContext()) const;
    InsideMethod used() const; ///< rays or winding
    const OutwardReport& outward() const;
    const Closure& closure() const;

private:
    struct Content;
    explicit InsideTest(std::unique_ptr<const Content> content);
    std::unique_ptr<const Content> content_;
};

/// Those of the points that are inside. InsideMethod::automatic means rays here. Errors: those of InsideTest.
Result<std::vector<Vec3d>> points_inside(const Mesh& mesh, std::span<const Vec3d> points, InsideOptions options = {},
                                         const RunContext& context = RunContext(), InsideReport* report = nullptr);

/// The volume inside a mesh, once it is welded and turned.
struct InsideVolume {
    std::optional<double> volume; ///< model units cubed; overlaps count twice. Empty: the mesh is open, or one-sided
    OutwardReport outward;
};
/// Cost O(F log F). Errors: usage (check_mesh refuses the mesh), unsuitable (no faces), cancelled.
Result<InsideVolume> inside_volume(const Mesh& mesh, const RunContext& context = RunContext());

} // namespace filigree
