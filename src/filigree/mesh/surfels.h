// A surface as oriented discs that overlap, without edges: surfels [Pfister et al. 2000].
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <optional>

namespace filigree {

/// One entry a surfel in each array. A surfel is the ellipse of the points position + a u + b v with a^2 + b^2 <= 1;
/// it faces along u x v.
struct Surfels {
    std::vector<Vec3f> positions; ///< relative to `origin`
    Vec3d origin = Vec3d::Zero();
    std::vector<Vec3f> u, v;        ///< half axes, model units; a disc's are across each other and equally long
    std::vector<Vec4f> colors;      ///< empty, or RGBA, 0 to 1
    std::vector<float> rest_radius; ///< of the disc that it was made as
    std::vector<Triangle> corners;  ///< vertices of the mesh that it was made of, between which it lies; a vertex's
                                    ///< own surfel names it three times
    std::vector<Vec3f> weights;     ///< of the three, of sum 1

    std::size_t size() const { return positions.size(); }
};

/// A disc at each vertex that has a face, across the vertex normal, and further ones in triangles much larger than
/// others. Each is a fifth larger than it takes to cover its share of the triangles around it, seen along their
/// normals: discs together leave no gap in the surface, seen obliquely hardly one. Colours come along. Cost O(V +
/// corners + surfels). Errors: usage (check_mesh refuses the mesh), cancelled.
Result<Surfels> make_surfels(const Mesh& mesh, const RunContext& context);

/// Surfels moved with what is around them: each goes with its vertex (between three, with the triangle), and its axes
/// are taken along by the deformation's gradient there, so that an affine map moves them exactly. positions, gradients:
/// one a vertex of the mesh that the surfels were made of. Cost O(surfels).
Surfels carried_surfels(const Surfels& rest, std::span<const Vec3f> positions, std::span<const Mat3f> gradients);

inline constexpr std::size_t kMostSplitSurfels = 20'000'000; ///< 2 GB
/// Surfels longer than kMostStretch of their disc's radius become two, each 0.62 as long, and so on: one flat ellipse
/// cannot follow the surface that it has been drawn over. At most a million from one. Cost O(surfels made).
/// Errors: unsuitable (more than `most` in all).
Result<Surfels> split_surfels(const Surfels& surfels, std::size_t most = kMostSplitSurfels);
inline constexpr float kMostStretch = 1.9f;

/// As a point set that files hold: normals, colours, and the scalars ux uy uz vx vy vz.
Mesh surfel_points(const Surfels& surfels);
/// Back from such a point set; nothing where it lacks the scalars. The mesh is not checked.
std::optional<Surfels> surfels_of_points(const Mesh& mesh);
/// To be drawn: an octagon around each ellipse, with its normal and its colour.
Mesh surfel_polygons(const Surfels& surfels);

} // namespace filigree
