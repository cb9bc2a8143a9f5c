// Deformations of space with their exact gradients: stretch, squeeze, bend, twist, taper, smooth random, and chains.
//
// Space is the world: points, boxes, centres and displacements are world coordinates. The box of a mesh is
// world_bounds(mesh), and warp_pose and warp_mesh add the mesh's origin before they ask a warp. So one warp serves a
// mesh, its model and everything beside them, however far from the world's origin they lie.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/core/view.h"
#include "filigree/hierarchy/model.h"
#include "filigree/mesh/mesh.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace filigree {

/// Where a point went, and how its neighbourhood was deformed: gradient(r, c) = d position_r / d point_c.
struct Warped {
    Vec3d position;
    Mat3d gradient;
};

/// A deformation of space, from world points to world points. Implementations are pure functions: safe from many
/// threads.
class SpaceWarp {
public:
    virtual ~SpaceWarp() = default;
    virtual Vec3d position(const Vec3d& point) const = 0;
    virtual Warped warp(const Vec3d& point) const = 0;
};

/// The axis along which the box is longest; the first of those that are equal.
Axis longest_axis(const Box& box);

// Bend, twist and taper vary between the ends of the box. Positions go on smoothly beyond an end, but gradients jump
// there; a point exactly on an end has the gradient of the inside. Along an axis in which the box has no length
// (below 1e-9 of its diagonal) these three are the identity.

/// Scales by `factor` along the axis about the box's centre. Errors: usage (a factor of 0, or not finite).
Result<std::unique_ptr<SpaceWarp>> make_stretch(const Box& box, Axis axis, double factor);
/// Scales by `factor` along the axis and by 1 / sqrt(factor) across it, so that volume stays.
/// Errors: usage (a factor that is not above 0).
Result<std::unique_ptr<SpaceWarp>> make_squeeze(const Box& box, Axis axis, double factor);
/// Bends the axis into an arc of `degrees` over the box's length, keeping the length of its centre line; the box's
/// middle stays where it is. Beyond the box's ends the body continues straight. Towards the next axis (x to y to z to
/// x).
std::unique_ptr<SpaceWarp> make_bend(const Box& box, Axis axis, double degrees);
/// Turns cross-sections about the axis through the box's centre, by -degrees/2 to +degrees/2 from end to end, and
/// rigidly beyond.
std::unique_ptr<SpaceWarp> make_twist(const Box& box, Axis axis, double degrees);
/// Scales cross-sections linearly along the axis, from 1 at the low end to `factor` at the high end; constant beyond.
/// Errors: usage (a factor that is not above 0).
Result<std::unique_ptr<SpaceWarp>> make_taper(const Box& box, Axis axis, double factor);
/// A sum of eight Gaussian bumps with random centres in the box and random displacements, the longest of which is
/// `amplitude` times the box's diagonal; the bumps' standard deviation is 0.35 diagonals. Seeded.
std::unique_ptr<SpaceWarp> make_smooth_random(const Box& box, double amplitude, std::uint64_t seed);
/// Moves each centre by its displacement and everything else smoothly along: cubic radial basis functions and an
/// affine part [Carr 2001], so affine displacements are reproduced everywhere. One displacement a centre; few or
/// coplanar centres are fine, coincident ones get the mean of their displacements. Cost O(n^3) once, then O(n) a point.
std::unique_ptr<SpaceWarp> make_rbf(std::span<const Vec3d> centres, std::span<const Vec3d> displacements);
/// The warps one after the other; the gradient by the chain rule. None at all: the identity.
std::unique_ptr<SpaceWarp> make_chain(std::vector<std::unique_ptr<SpaceWarp>> warps);

/// The pose that the warp gives a model's driver, with its gradients.
Pose warp_pose(const SpaceWarp& warp, const Model& model, const RunContext& context);
/// Positions relative to `origin` (of the mesh that they belong to), warped: out[i] = warp(mesh.origin + positions[i])
/// - mesh.origin, on all threads.
std::vector<Vec3f> warp_positions(const SpaceWarp& warp, std::span<const Vec3f> positions, const Vec3d& origin,
                                  const RunContext& context);
/// The same with gradients: the pose of a driver that starts from these positions instead of its model's.
Pose warp_pose(const SpaceWarp& warp, std::span<const Vec3f> positions, const Vec3d& origin, const RunContext& context);
/// Deforms every vertex of a mesh, and its normals by the cofactor of the gradient, to unit vectors. A normal that
/// several vertices share becomes one value for each of them, the further ones at the end of normals.values. The mesh
/// is not checked.
void warp_mesh(const SpaceWarp& warp, Mesh& mesh, const RunContext& context);

} // namespace filigree
