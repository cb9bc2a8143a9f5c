// Built-in shapes: closed where they should be, exact at shared borders, quads unless said.
#pragma once

#include "filigree/core/result.h"
#include "filigree/mesh/mesh.h"

#include <string_view>

namespace filigree {

/// Settings of the built-in shapes; each uses those its own comment names.
struct ShapeOptions {
    unsigned resolution = 64; ///< quads along a side, 1 to 8192
    double frequency = 5;     ///< full waves along a side (or around), 0 and up
    double amplitude = 0.04;  ///< height of the waves as a fraction of the shape's side or radius
    double size = 1;          ///< side or diameter, model units
    double length = 4;        ///< bar, cylinder: length as a multiple of the side or diameter
    double thickness = 0.3;   ///< torus: tube radius as a fraction of the ring's; wavy-plate: as a fraction of the side
    bool operator==(const ShapeOptions&) const = default;
};

/// The report's cube (eq. 2.1, figure 2.1): each face carries z = amplitude sin(2 pi frequency u) sin(2 pi frequency v)
/// outwards, u and v in 0 to 1 over the face; the ring of quads along the cube's edges is flat (the two outermost rows
/// of vertices have no height), so the faces meet without crack or hole. 6 n^2 + 2 vertices, 6 n^2 quads, n =
/// resolution; centred on the origin.
Mesh make_wavy_cube(const ShapeOptions& options);
/// A sphere from the cube's grid, spread to equal angles, with radial waves: a gyroid's field, smooth everywhere for
/// every frequency; 6 n^2 + 2 vertices.
Mesh make_wavy_sphere(const ShapeOptions& options);
/// The open square with waves in z; (n + 1)^2 vertices, with UVs.
Mesh make_wavy_plane(const ShapeOptions& options);
/// A closed square plate across z, both of its sides with the plane's waves; n x n quads a side, round(n thickness),
/// one at least, through it.
Mesh make_wavy_plate(const ShapeOptions& options);
/// A closed box along x, `length` sides long; n quads across a side and round(n length) along.
Mesh make_bar(const ShapeOptions& options);
/// A closed cylinder along x: 4 n quads around, round(n length) along, caps of a square grid of n x n quads.
Mesh make_cylinder(const ShapeOptions& options);
/// A torus about z with waves on its tube; 2 n around the ring, n around the tube, n at least 3. The frequency is
/// rounded to whole waves, so that they meet themselves; amplitude and thickness are fractions of the ring's radius.
Mesh make_torus(const ShapeOptions& options);

/// Plain ones to draw what is not a mesh itself: a box of six quads; a smooth ball of 6 * 48^2 quads. Positions in
/// float, so not far from the world's origin.
Mesh make_box(const Vec3d& centre, const Vec3d& size);
Mesh make_ball(const Vec3d& centre, double radius);

/// The shape called `name`: wavy-cube, wavy-sphere, wavy-plane, wavy-plate, bar, cylinder or torus. Errors: usage, for
/// an unknown name or an option outside its range.
Result<Mesh> make_shape(std::string_view name, const ShapeOptions& options);
/// The names make_shape knows.
std::span<const std::string_view> shape_names();

} // namespace filigree
