// Ways to make a pose: warps of space, as-rigid-as-possible handles, pulling by hand. And how exact a driver is.
//
//     const auto bend = make_bend(world_bounds(mesh), Axis::z, 90);
//     const Pose pose = warp_pose(*bend, model);
//
// A pose of your own needs the positions of the driver's vertices alone. Give gradients where you know them: restored
// meshes are then more exact. Next: restore.h.
//
// Warps act in the world: points, boxes, centres and displacements are world coordinates. The box of a mesh is
// world_bounds(mesh). So one warp serves a mesh, its model and everything beside them, however far from the world's
// origin they are.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/strip.h"

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Warps

/// Where a point went, and the gradient of the warp there: gradient(r, c) = d position_r / d point_c.
struct Warped {
    Vec3d position;
    Mat3d gradient;
};

/// A deformation of space, from world points to world points. Derive from it to make a warp of your own; its functions
/// are called from many threads.
class SpaceWarp {
public:
    virtual ~SpaceWarp() = default;
    /// The position alone, where nobody needs the gradient.
    virtual Vec3d position(const Vec3d& point) const = 0;
    virtual Warped warp(const Vec3d& point) const = 0;
};

/// The axis along which a box is longest; the first of equal ones.
Axis longest_axis(const Box& box);

// Bend, twist and taper act between the two ends of the box along the axis. Beyond an end, positions continue smoothly;
// gradients jump at the end (a point on it has the gradient of the inside). Along an axis without length (below 1e-9 of
// the diagonal) they are the identity.

/// Scales by `factor` along the axis, about the centre of the box. Errors: usage (a factor of 0, or not finite).
Result<std::unique_ptr<SpaceWarp>> make_stretch(const Box& box, Axis axis, double factor);
/// Scales by `factor` along the axis and by 1 / sqrt(factor) across it: the volume stays.
/// Errors: usage (a factor that is not above 0).
Result<std::unique_ptr<SpaceWarp>> make_squeeze(const Box& box, Axis axis, double factor);
/// Bends the axis into an arc of `degrees` over the length of the box, towards the next axis (x to y to z to x). The
/// centre line keeps its length, the middle of the box stays in place, and space beyond the ends continues straight.
std::unique_ptr<SpaceWarp> make_bend(const Box& box, Axis axis, double degrees);
/// Turns cross-sections about the axis through the centre of the box, by -degrees/2 at the low end to +degrees/2 at the
/// high end, and rigidly beyond.
std::unique_ptr<SpaceWarp> make_twist(const Box& box, Axis axis, double degrees);
/// Scales cross-sections linearly along the axis, from 1 at the low end to `factor` at the high end; constant beyond.
/// Errors: usage (a factor that is not above 0).
Result<std::unique_ptr<SpaceWarp>> make_taper(const Box& box, Axis axis, double factor);
/// A sum of eight Gaussian bumps (standard deviation 0.35 diagonals) with random centres in the box and random
/// displacements. amplitude: the longest displacement, fraction of the diagonal.
std::unique_ptr<SpaceWarp> make_smooth_random(const Box& box, double amplitude, std::uint64_t seed);
/// Moves each centre by its displacement, and space around smoothly: cubic radial basis functions with an affine part
/// [Carr 2001]. Affine displacements are reproduced everywhere. displacements: one a centre. Centres may be few or
/// coplanar; centres at the same place get the mean of their displacements. Cost O(n^3) once, then O(n) a point.
std::unique_ptr<SpaceWarp> make_rbf(std::span<const Vec3d> centres, std::span<const Vec3d> displacements);
/// Applies warps one after the other. Without warps: the identity.
std::unique_ptr<SpaceWarp> make_chain(std::vector<std::unique_ptr<SpaceWarp>> warps);

/// The pose of a model's driver after a warp, with gradients.
Pose warp_pose(const SpaceWarp& warp, const Model& model, const RunContext& context = RunContext());
/// Warps positions that are relative to the origin of their mesh: warp(origin + positions[i]) - origin.
std::vector<Vec3f> warp_positions(const SpaceWarp& warp, std::span<const Vec3f> positions, const Vec3d& origin,
                                  const RunContext& context = RunContext());
/// The pose after a warp of a driver that stands at `positions`, with gradients.
Pose warp_pose(const SpaceWarp& warp, std::span<const Vec3f> positions, const Vec3d& origin,
               const RunContext& context = RunContext());
/// Warps every vertex of a mesh; normals turn by the cofactor of the gradient and have unit length. A normal that
/// several vertices share becomes one value for each of them. The mesh is not checked.
void warp_mesh(const SpaceWarp& warp, Mesh& mesh, const RunContext& context = RunContext());

// ---------------------------------------------------------------------------------------------------------------------
// Handles

struct HandleOptions {
    unsigned iterations = 200; ///< most local-global rounds
    double tolerance = 1e-5;   ///< stop when no vertex moves more in a round; fraction of the diagonal
    /// Resistance to bending: the length over which a sharp bend spreads, fraction of the diagonal. Results then do not
    /// depend on how fine the mesh is. 0: the plain method, in which fine surfaces fold sharply.
    double smoothness = 0.03;
};

struct HandleResult {
    Pose pose;               ///< positions; the rotations of the vertices are the gradients
    unsigned iterations = 0; ///< rounds done
    double last_move = 0;    ///< largest motion in the last round, fraction of the diagonal
};

/// As-rigid-as-possible deformation [Sorkine 2007]: some vertices are put somewhere, the others follow with as little
/// strain as possible. A solver is for one shape at rest and one set of handles; its matrix (cotangent weights, clamped
/// to be non-negative) is factored once. Rotations start from the round before [Mueller 2016] and are drawn to those of
/// neighbours [Levi 2015]; they never mirror. Rounds have momentum, and the energy never rises.
class HandleSolver {
public:
    /// positions: V points at rest. triangles: over them, of any quality. handles: the vertices whose positions are
    /// given, each once. A vertex that is connected to no handle stays where it is. Cost: a sparse factorisation.
    /// Errors: usage (a handle out of range or repeated; no handles), unsuitable (more than 20 million vertices),
    /// out_of_memory, cancelled (before or after the factorisation).
    static Result<HandleSolver> create(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                       std::span<const Index> handles, const RunContext& context = RunContext());
    HandleSolver(HandleSolver&&) noexcept;
    HandleSolver& operator=(HandleSolver&&) noexcept;
    ~HandleSolver();

    /// targets: one position a handle, in the order of `handles`. Starts from the last solution, moved rigidly with the
    /// handles: dragging is cheap, and a rigid motion is exact. The same bytes for any number of threads. Cost
    /// O(iterations (V + fill)). Errors: mismatch (another number of targets), usage (a target that is not finite),
    /// cancelled (the last solution stays).
    Result<HandleResult> solve(std::span<const Vec3f> targets, const HandleOptions& options = {},
                               const RunContext& context = RunContext());
    /// Forgets the last solution: the next solve starts at rest.
    void reset();

private:
    struct Solver;
    explicit HandleSolver(std::unique_ptr<Solver> solver);
    std::unique_ptr<Solver> solver_;
};

// ---------------------------------------------------------------------------------------------------------------------
// Handles over regions

/// Vertices that move together: they are rotated about `centre`, then moved. Name them, or give a box or a sphere.
struct HandleRegion {
    std::string name = {};                               ///< for messages; empty: messages say its number
    std::vector<Index> vertices = {};                    ///< vertices of the mesh
    std::optional<Box> box = {};                         ///< and all vertices inside, world
    std::optional<std::pair<Vec3d, double>> sphere = {}; ///< and all vertices inside: centre and radius, world
    Vec3d move = Vec3d::Zero();                          ///< model units
    Eigen::AngleAxisd rotation = Eigen::AngleAxisd::Identity();
    std::optional<Vec3d> centre = {}; ///< world; unset: the mean of the vertices

    /// The same region with a part of its motion: 0 (at rest) to 1 (all of it).
    HandleRegion part(double fraction) const;
};

/// Deforms every vertex of a mesh by handles, with one solve over all of them; normals turn along. Vertices at the same
/// place move together. Errors: usage (check_mesh refuses the mesh; a handle without a vertex, a vertex that does not
/// exist or is in two handles: the sentence begins with the handle), and those of HandleSolver.
Result<Mesh> move_by_handles(Mesh mesh, std::span<const HandleRegion> handles,
                             const RunContext& context = RunContext());

/// The pose of a model's driver under handles, with a solve over its vertices alone. The driver vertex nearest to a
/// named vertex of the mesh takes its place. Errors: usage (as for move_by_handles), and those of HandleSolver.
Result<Pose> pose_by_handles(const Model& model, std::span<const HandleRegion> handles,
                             const RunContext& context = RunContext());

// ---------------------------------------------------------------------------------------------------------------------
// Pulling by hand

/// Vertices of a driver: those that a pull grips, and those that are held where they are. Ascending and disjoint.
struct PullRegion {
    std::vector<Index> grip, held;
};

/// The region of a pull at a point. It grips driver vertices within `grip` of the point (at least the nearest), and
/// holds those beyond `reach` of it and all pinned ones. grip, reach: model units, straight lines at rest. rest_point:
/// relative to the mesh's origin. pinned: driver vertices, ascending. vertex: a vertex of the mesh that has to come
/// along; the driver vertices that carry it are gripped too. Cost O(driver).
PullRegion pull_region(const Model& model, std::span<const Index> pinned, const Vec3f& rest_point, double grip,
                       double reach, std::optional<Index> vertex = {});

/// A pull that was made, with all that is needed to repeat it at another resolution.
struct Pull {
    PullRegion region;
    Vec3f centre = Vec3f::Zero(); ///< the point that was gripped, at rest, relative to the mesh's origin
    double grip = 0, reach = 0;   ///< model units, at rest
    Vec3f move = Vec3f::Zero();   ///< motion of the gripped vertices
};

/// The positions of all vertices of the mesh after some pulls, relative to the mesh's origin. Vertices at the same
/// place move together. Cost: a HandleSolver over all vertices for each pull: seconds for several hundred thousand.
/// Errors: those of HandleSolver.
Result<std::vector<Vec3f>> pull_every_vertex(const Model& model, std::span<const Pull> pulls,
                                             const RunContext& context = RunContext());

/// Multiplies the gradients of a pose by those of the pose that the motion began at. start: null, or without gradients:
/// the motion began at rest.
void follow_start(Pose& pose, const Pose* start);

/// One pull while it is dragged: each step is a few rounds of as-rigid-as-possible solving from the last solution. The
/// gripped part turns a little while it is pulled; its vertices are moved further to make up for it, by up to half of
/// the motion, so that the grabbed vertex follows the pointer.
class PullSolver {
public:
    /// start: the pose to begin at; null: at rest. It and the model must outlive the solver. grabbed: the vertex of the
    /// mesh that has to follow; ignored where `start` has no gradients. Errors: those of HandleSolver::create.
    static Result<PullSolver> create(const Model& model, const Pose* start, const PullRegion& region,
                                     std::optional<Index> grabbed, const RunContext& context = RunContext());
    PullSolver(PullSolver&&) noexcept;
    PullSolver& operator=(PullSolver&&) noexcept;
    ~PullSolver();

    /// A few more rounds towards the motion `way` from the start. tolerance: fraction of the diagonal. Errors: those of
    /// HandleSolver::solve.
    Result<Pose> step(const Vec3f& way, double tolerance, const RunContext& context = RunContext());
    /// How far the last step moved the grip.
    const Vec3f& applied() const;
    /// Whether the last step changed at most `tolerance` (fraction of the diagonal) and the grabbed vertex is where it
    /// should be, or 400 rounds have not brought it there.
    bool has_arrived(double tolerance) const;

private:
    struct Solver;
    explicit PullSolver(std::unique_ptr<Solver> solver);
    std::unique_ptr<Solver> solver_;
};

// ---------------------------------------------------------------------------------------------------------------------
// Fidelity

/// A warp of the family over which fidelity is measured.
struct NamedWarp {
    std::string name;
    bool affine;
    std::unique_ptr<SpaceWarp> warp;
};

/// The family, along the longest side of the box. Affine: stretches by 2 and by 0.5, a squeeze by 2. Curved: bends of
/// 90 and 180 degrees, a twist of 180 degrees, a taper to 0.5, smooth random displacements of 10 and 25 %.
std::vector<NamedWarp> fidelity_warps(const Box& box);

/// What poses of the driver have: positions alone, or gradients too.
enum class PoseSource { positions, gradients };

/// The fidelity of a model: the largest error over the curved warps of the family. The error of a warp is the rms
/// distance between the mesh restored from the warped driver and the mesh itself warped, fraction of its diagonal.
/// Cost: six restores. Errors: cancelled.
Result<double> fidelity(const Model& model, PoseSource source, const RunContext& context = RunContext());

/// Fidelity from positions alone, and with gradients.
struct DriverFidelity {
    double positions = 0, gradients = 0;
};

/// Both fidelities, over at most 65,536 vertices: within a few per cent of all. Cost: an estimate of gradients, and
/// twelve restores of these vertices. Errors: cancelled.
Result<DriverFidelity> driver_fidelity(const Model& model, const RunContext& context = RunContext());

struct FidelityGoal {
    double error = 1e-4; ///< fidelity to reach, above 0
    PoseSource source = PoseSource::positions;
};

struct StrippedToFidelity {
    Stripped stripped;
    double error = 0;   ///< fidelity that was reached
    unsigned tried = 0; ///< number of drivers that were tried
};

/// Strips with the smallest driver, to within 15 % of its vertices, whose fidelity is 1.4 times better than the goal:
/// then other warps that are no more curved meet the goal too (`filigree bench goals`). Where no smaller driver does,
/// the driver is the whole mesh, and `error` may be above a goal that is below the rounding of float. options: without
/// base, levels and error. Cost: about six times strip and fidelity. Errors: those of strip; usage (options that say
/// how coarse, a goal that is not above 0).
Result<StrippedToFidelity> strip_to_fidelity(const Mesh& mesh, const StripOptions& options, const FidelityGoal& goal,
                                             const RunContext& context = RunContext());

} // namespace filigree
