// Bodies: the particles inside a mesh, what they weigh, how they hang together, and the surface that touches others.
//
//     const auto body = std::make_shared<const Body>(make_body(mesh, Material{}, {.size = 0.3}).value());   // 30 cm
//
// A Body does not change while it moves, so one may take part in many simulations. SI units. Next: physics/world.h.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/physics/material.h"
#include "filigree/result.h"
#include "filigree/sample.h"
#include "filigree/types.h"

#include <array>
#include <memory>
#include <optional>
#include <span>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Vectors of particles

/// Positions, velocities or forces of particles: one array a coordinate. Each array has kPadding zeros behind its end,
/// so that loops may read a whole vector register from any particle on.
struct Vectors {
    static constexpr std::size_t kPadding = 32;

    Vectors() = default;
    explicit Vectors(std::size_t count) : x(count + kPadding), y(count + kPadding), z(count + kPadding) {}

    std::size_t size() const { return x.empty() ? 0 : x.size() - kPadding; }
    Vec3f operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
    void set(std::size_t i, const Vec3f& value) {
        x[i] = value.x();
        y[i] = value.y();
        z[i] = value.z();
    }
    void add(std::size_t i, const Vec3f& value) {
        x[i] += value.x();
        y[i] += value.y();
        z[i] += value.z();
    }

    std::vector<float> x, y, z;
};

/// Whether all coordinates are finite.
inline bool is_finite(const Vectors& values) {
    float sum = 0; // one NaN or infinity makes the sum so
    for (std::size_t i = 0; i < values.size(); ++i) sum += 0 * values.x[i] + 0 * values.y[i] + 0 * values.z[i];
    return sum == 0;
}

inline constexpr std::array kVectorAxes = {&Vectors::x, &Vectors::y, &Vectors::z};

// ---------------------------------------------------------------------------------------------------------------------
// Embedded points

/// Points that follow particles. Particles particles[offsets[i]] .. particles[offsets[i + 1] - 1] carry point i; their
/// weights sum to 1 and reproduce linear functions: sum w X = rest[i].
struct Embedding {
    std::vector<Vec3f> rest; ///< m
    std::vector<Index> offsets = {0};
    std::vector<Index> particles;
    std::vector<float> weights;

    std::size_t size() const { return rest.size(); }
};

// ---------------------------------------------------------------------------------------------------------------------
// Cells

/// The cubes of a regular lattice that a mesh occupies. Cell (i, j, k) reaches from origin + spacing (i, j, k) to
/// origin + spacing (i + 1, j + 1, k + 1). Cells and corners ascend by k, then j, then i: neighbours along x are
/// neighbours in memory. Where parts are kept apart (BodyOptions::separate), a point of the lattice has a corner for
/// each part around it, one after the other, and `runs` is empty.
struct Cells {
    using LatticeIndex = std::array<std::uint16_t, 3>;

    double spacing = 0;           ///< m
    Vec3d origin = Vec3d::Zero(); ///< m, relative to the mesh's (scaled) origin
    std::vector<LatticeIndex> cells;
    std::vector<LatticeIndex> corners;
    std::vector<std::array<Index, 8>> cell_corners; ///< corner with bits x = 1, y = 2, z = 4
    std::vector<float> fraction;                    ///< occupied part of each cell's volume, kLeastFraction .. 1;
                                                    ///< above 1 where neighbours have shared theirs (cell_shares.h)
    std::vector<Vec3f> centroid;                    ///< of the occupied part, m, relative to the mesh's origin

    /// Below this a cell counts as this full: emptier ones would be all stiffness noise and no mass.
    static constexpr float kLeastFraction = 0.1f;

    /// Cells first_cell .. first_cell + count - 1, one beside the other along x. Their corners lie in four rows, of
    /// count + 1 consecutive corners each, that begin at rows[0] (j, k), rows[1] (j + 1, k), rows[2] (j, k + 1) and
    /// rows[3] (j + 1, k + 1).
    struct Run {
        Index first_cell, count;
        std::array<Index, 4> rows;
    };
    std::vector<Run> runs; ///< ascending by cell

    static constexpr int kHomesAlong = 4;
    /// Of a body whose parts are kept apart: some of the 4^3 cubes of a place of the lattice (bits x + 4 y + 16 z) hold
    /// another part than the cell there, or there is no cell; points in them go with `cell`.
    struct Home {
        LatticeIndex at;
        std::uint64_t cubes;
        Index cell;
    };
    std::vector<Home> homes; ///< ascending by place
    /// Whether parts are kept apart in it.
    bool is_parted() const { return runs.empty() && !cells.empty(); }

    /// Cell with these indices, kNoIndex where there is none. Cost O(log cells).
    Index find_cell(int i, int j, int k) const;
    /// The cell that a point goes with, kNoIndex where there is none. at: in spacings, from the origin. Cost as
    /// find_cell.
    Index find_cell(const Vec3d& at) const;
    /// Whether neighbouring cells hang together: they share a corner. True of all neighbours unless parts are kept
    /// apart.
    bool are_joined(Index cell, Index neighbour) const;
};

struct CellOptions {
    double spacing = 0; ///< m; 0: chosen so that about `count` cells are occupied, and fitted so that the
                        ///< shortest side of the box is a whole number of cells
    std::size_t count = 8000;
};

struct CellReport {
    std::size_t cells = 0, whole_cells = 0;
    std::size_t added_cells = 0; ///< that no sample found occupied, and a part of the surface passes through
    std::size_t thin_cells = 0;  ///< of parts with fewer than two cells across
    std::size_t loose_parts =
        0;             ///< small unconnected groups of cells that were left out; their vertices follow the body
    double volume = 0; ///< m^3, occupied by the cells
};

// ---------------------------------------------------------------------------------------------------------------------
// What varies within a body

/// A quantity of the material that may vary from cell to cell.
enum class FieldOf { stiffness, density, damping, yield_stress, strength };

/// Multiples of the material's quantities: one number a cell, kLeast .. kMost; or empty: 1 everywhere. For the models
/// fem and rigid. A field costs no time by itself, but the stiffest and lightest cell sets the step: ten times as stiff
/// takes 3.2 times as many substeps.
struct BodyFields {
    static constexpr float kLeast = 1e-3f, kMost = 1e3f;
    /// Stiffness that varies by more than this, either way, earns a warning.
    static constexpr float kMostUsual = 10;

    std::vector<float> stiffness = {};    ///< of Young's modulus; Poisson's ratio is the same everywhere
    std::vector<float> density = {};      ///< of Material::density
    std::vector<float> damping = {};      ///< of Material::damping; a rigid body takes the mean by mass
    std::vector<float> yield_stress = {}; ///< of Material::yield_stress
    /// Of FractureMaterial::strength, also in front of a crack, and of its plastic_opening. The energy stays.
    std::vector<float> strength = {};

    bool empty() const {
        return stiffness.empty() && density.empty() && damping.empty() && yield_stress.empty() && strength.empty();
    }
    std::vector<float>& of(FieldOf quantity);
    const std::vector<float>& of(FieldOf quantity) const;
};

/// A field by the vertices of the body's mesh: one multiple a vertex, BodyFields::kLeast .. kMost. It is spread inwards
/// as spread_inwards does.
struct VertexField {
    FieldOf of = FieldOf::stiffness;
    std::vector<float> values;
};

// ---------------------------------------------------------------------------------------------------------------------
// Distance fields

/// Signed distance from a mesh: values at the points of a regular grid, negative inside, trilinear in between.
class DistanceField {
public:
    struct Sample {
        float distance; ///< m, negative inside
        Vec3f normal;   ///< unit, outward: the direction in which the distance grows
    };

    /// scale: metres a model unit. spacing: m, between grid points; 0: a 64th of the longest side. Coordinates are
    /// relative to the mesh's origin. Overlapping parts count as merged; open meshes are decided by winding numbers.
    /// outward: if given, gets what was turned to make faces look outwards. Errors: usage (check_mesh refuses the
    /// mesh), unsuitable (no faces; more than 2^27 grid points), cancelled.
    static Result<DistanceField> create(const Mesh& mesh, double scale, double spacing, const RunContext& context,
                                        OutwardReport* outward = nullptr);

    /// Distance and normal at a point, m. Outside the grid the distance is a lower bound.
    Sample at(const Vec3f& point) const;
    float distance(const Vec3f& point) const; ///< faster than at(point), the same up to rounding
    const Box& box() const { return box_; }   ///< of the grid
    /// Keeps the part that is also inside another field's surface plus `radius`: takes the larger of both distances.
    void cut(const DistanceField& other, float radius);

private:
    friend struct WorldParts; // writes it to bytes
    Box box_;
    Vec3f corner_;
    float spacing_ = 0;
    std::array<std::size_t, 3> counts_ = {};
    std::vector<float> distances_;
};

// ---------------------------------------------------------------------------------------------------------------------
// Bodies

/// Points of the surface: they touch obstacles and other bodies, and feel wind. About half a spacing apart; a spacing
/// for rigid bodies.
struct BodySurface {
    Embedding points;           ///< on the surface of the mesh
    std::vector<Vec3f> normals; ///< unit, outward, at rest
    std::vector<float> areas;   ///< m^2, each point's share of the surface
};

/// What stays the same while a body moves. Rest positions are in metres along the axes of the mesh, relative to the
/// mesh's origin times the scale.
struct Body {
    Material material;
    double scale = 1; ///< metres a model unit
    Cells cells;
    /// Particles at rest, m. fem, springs: the corners of the cells. meshfree, mpm: one particle a cell, at the
    /// centroid of its occupied part; meshfree has eight in a cell whose neighbours lie in a plane or a line.
    Vectors rest;
    std::vector<float> mass;   ///< kg
    std::vector<float> volume; ///< m^3: occupied volume, distributed like the mass
    /// meshfree: the corners of the cells, embedded in the particles. They carry the surface points, and other bodies
    /// touch them. Empty for other models, whose particles are the corners.
    Embedding corners;
    BodySurface surface;
    /// Distance from the surface at rest, m, on a grid of half a spacing (wider for millions of cells): how deep others
    /// are inside this body. Null for bodies of mpm.
    std::shared_ptr<const DistanceField> field;
    float field_radius = 0; ///< m: half the thickness that counts for a sheet without thickness; else 0
    BodyFields fields;      ///< what varies within the body; set_fields changes it

    double spacing() const { return cells.spacing; }
    std::size_t particle_count() const { return rest.size(); }
};

struct BodyOptions {
    double scale = 1;                     ///< metres a model unit, above 0; give this or `size`
    std::optional<double> size = {};      ///< m, above 0: longest side of the mesh's box
    CellOptions cells;                    ///< cells.count: about how many particles
    std::vector<VertexField> fields = {}; ///< what varies within the body; each quantity once at most
    /// Whether parts of a closed mesh that are nearer to each other than two particles move apart, from gaps of a
    /// quarter of a cell on. Of the model fem; such a body does not break.
    bool separate = false;
};

/// Parts of a closed mesh that are so close to each other that one cell holds both: they move as one, unless
/// BodyOptions::separate keeps them apart.
struct JoinedParts {
    std::size_t corners = 0;     ///< corners of such cells; 0: none, or too few to matter
    Vec3f place = Vec3f::Zero(); ///< m, on the body at rest: where the gap is narrowest
    double gap = 0;              ///< m, about: the median over these corners
};

struct BodyReport {
    CellReport cells;
    std::size_t split_cells = 0; ///< meshfree: cells with eight particles
    std::size_t surface_points = 0;
    double mass = 0;                   ///< kg
    OutwardReport outward;             ///< what was turned to make faces look outwards
    JoinedParts joined;                ///< fem, springs, meshfree; of separate parts those that are joined still
    std::size_t separated_corners = 0; ///< BodyOptions::separate: copies of corners that keep parts apart
    std::string warning;               ///< sentences for the user: thin, joined or turned parts; or ""
};

/// Makes a body from a mesh: cells that cover it, particles, surface points and a distance field. Closed or open
/// meshes. Cost O(F log F), and a distance at each point of a grid of half a spacing. Errors: usage (check_mesh or
/// check_material refuses its input; scale or size out of range, or both given; a field of another number of values
/// than vertices, or what set_fields refuses), unsuitable (no faces; more than 2^26 cells: the sentence says a spacing
/// that works), cancelled.
Result<Body> make_body(const Mesh& mesh, const Material& material, const BodyOptions& options = {},
                       const RunContext& context = RunContext(), BodyReport* report = nullptr);

/// Carries values of a surface inwards: one value a cell of the body. A cell that the surface passes through has the
/// mean of the surface in it, by area; inside, each cell is the mean of its neighbours (harmonic), so nothing lies
/// outside of what the surface has. mesh: the mesh that the body was made of. at_vertices: one finite number a vertex.
/// Errors: usage (check_mesh refuses the mesh; another number of values; a value that is not finite), unsuitable (the
/// surface meets no cell of the body), cancelled. Cost O(surface / spacing^2 + cells x cells across).
Result<std::vector<float>> spread_inwards(const Body& body, const Mesh& mesh, std::span<const float> at_vertices,
                                          const RunContext& context = RunContext());

/// Replaces the fields of a body, and its masses by them. A simulation keeps the bodies that it was made with. Errors:
/// usage (another number of values than cells; a value out of range; a model other than fem and rigid); the body is
/// unchanged then. Cost O(cells).
Status set_fields(Body& body, BodyFields fields);
/// What the user should know of a body's fields, as a sentence: stiffness that varies so much that steps become short.
/// "": nothing.
std::string fields_warning(const Body& body);

} // namespace filigree
