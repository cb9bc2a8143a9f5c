// Meshes: plain arrays, built-in shapes, checks, triangles, topology and distances.
//
//     Mesh mesh;
//     mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
//     mesh.add_face(std::array<Index, 3>{0, 1, 2});
//     if (const std::string wrong = check_mesh(mesh); !wrong.empty()) std::cerr << wrong << '\n';
//
// Any mesh is welcome: polygons, several parts, holes, non-manifold edges. Other ways to a mesh: file.h reads one, a
// make_ function makes a shape. Next: strip.h takes its detail off.
#pragma once

#include "filigree/context.h"
#include "filigree/result.h"
#include "filigree/types.h"

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// The mesh

/// Values of corners or of vertices. Corner c has values[corners[c]], as in OBJ, or no value where corners[c] is
/// kNoIndex. Where `corners` is empty, there is one value a vertex.
template <class T>
struct CornerAttribute {
    std::vector<T> values;
    std::vector<Index> corners;

    bool empty() const { return values.empty(); }
    bool per_vertex() const { return corners.empty(); }
};

/// Names of faces, such as groups or materials. of_face: empty, or one index into `names` a face; kNoIndex: no name.
struct FaceLabels {
    std::vector<std::string> names;
    std::vector<Index> of_face;

    bool empty() const { return of_face.empty(); }
};

/// One number a vertex, with its name in the file ("quality", "confidence", "f00").
struct VertexScalar {
    std::string name;
    std::vector<float> values;
};

/// How a surface looks: the part of a file's material that Filigree uses.
struct MeshMaterial {
    std::string name;
    /// Base colour, sRGB 0 to 1; it multiplies the picture. OBJ: Kd; white beside a texture where the file has no Kd or
    /// black, as some programs write it.
    Vec3f color = {0.8f, 0.8f, 0.8f};
    float opacity = 1, metallic = 0, roughness = 1; ///< 0 to 1
    bool double_sided = true;
    std::filesystem::path picture; ///< path of the base colour texture; empty: none, or picture_bytes
    /// The bytes of the texture (PNG or JPEG), where it came inside the mesh's file. Materials may share it.
    std::shared_ptr<const std::string> picture_bytes = {};

    bool has_picture() const { return picture_bytes || !picture.empty(); }
};

/// Polygons over shared vertices, as arrays. Face f has the corners face_offsets[f] .. face_offsets[f + 1] - 1, three
/// or more, counter-clockwise seen from outside. Vertices and faces keep the order of the file. Calls that return a
/// Result or a Status check their meshes with check_mesh (error: usage); other calls expect a sound mesh. A mesh that
/// was moved from is empty.
struct Mesh {
    std::vector<Vec3f> positions; ///< model units, relative to `origin`
    Vec3d origin = Vec3d::Zero(); ///< added to every position; zero unless the mesh is far from the world's origin
    std::vector<Index> face_offsets = {0}; ///< F + 1 offsets into `corners`, ascending
    std::vector<Index> corners;            ///< vertex of each corner

    CornerAttribute<Vec2f> uvs;
    CornerAttribute<Vec3f> normals;    ///< as in the file: not always of unit length
    std::vector<Vec4f> colors;         ///< empty, or one RGBA a vertex, 0 to 1
    bool colors_have_alpha = false;    ///< whether the file had the fourth channel
    std::vector<VertexScalar> scalars; ///< more numbers, one a vertex
    FaceLabels objects, groups, materials;
    std::vector<Index> smoothing;            ///< empty, or one smoothing group a face; 0 is "off"
    std::vector<std::string> material_files; ///< names of material libraries, as in the file
    /// Materials that came inside the mesh's file (glTF): empty, or one for each of materials.names, with pictures as
    /// bytes. They count before material_files.
    std::vector<MeshMaterial> embedded_materials;

    std::size_t vertex_count() const { return positions.size(); }
    std::size_t face_count() const { return face_offsets.empty() ? 0 : face_offsets.size() - 1; }
    std::size_t corner_count() const { return corners.size(); }
    Index face_size(std::size_t face) const { return face_offsets[face + 1] - face_offsets[face]; }
    std::span<const Index> face(std::size_t face) const {
        return std::span(corners).subspan(face_offsets[face], face_size(face));
    }
    /// Position of a vertex in the world.
    Vec3d world_position(std::size_t vertex) const { return origin + positions[vertex].cast<double>(); }

    void add_face(std::span<const Index> face_corners) {
        if (face_offsets.empty()) face_offsets.push_back(0); // moved from
        corners.insert(corners.end(), face_corners.begin(), face_corners.end());
        face_offsets.push_back(static_cast<Index>(corners.size()));
    }
};

/// The bounding box of the vertices that faces use, relative to the origin; of all vertices where there are no faces. A
/// stray vertex far away does not count. Cost O(V + corners).
Box bounds(const Mesh& mesh);
/// The bounding box in the world.
inline Box world_bounds(const Mesh& mesh) {
    Box box = bounds(mesh);
    box.min += mesh.origin;
    box.max += mesh.origin;
    return box;
}

/// Moves mesh.positions near zero and sets mesh.origin, so that floats keep the digits of positions far from the
/// world's origin. mesh.origin must be zero before. It stays zero unless the mesh is more than twice its diagonal away.
/// Else it becomes the centre of the box (0 on axes where the box is close), rounded so that positions keep all their
/// digits. Cost O(V + corners).
void split_origin(Mesh& mesh);
/// Sets mesh.positions and mesh.origin from positions in double. world: one a vertex; empty: uses mesh.positions.
/// Vertices that no face uses get the precision of float beside that origin.
void split_origin(std::span<const Vec3d> world, Mesh& mesh);

/// The first thing wrong with a mesh, as a sentence, or "" when it is sound: offsets ascend, faces have three corners
/// or more, indices are in range, attributes have the right sizes, numbers are finite, and there are fewer than 2^32 -
/// 1 vertices and corners. Cost O(size).
std::string check_mesh(const Mesh& mesh);
/// What check_mesh says, as an error of usage; none for a sound mesh. what: the sentence begins with it.
std::optional<Error> mesh_error(const Mesh& mesh, std::string_view what = "The mesh");

// ---------------------------------------------------------------------------------------------------------------------
// Shapes

/// Settings of the built-in shapes; each shape uses some of them.
struct ShapeOptions {
    unsigned resolution = 64; ///< quads along a side, 1 to 8192
    double frequency = 5;     ///< full waves along a side (or around), 0 and up
    double amplitude = 0.04;  ///< height of the waves as a fraction of the shape's side or radius
    double size = 1;          ///< side or diameter, model units
    double length = 4;        ///< bar, cylinder: length as a multiple of the side or diameter
    double thickness = 0.3;   ///< torus: tube radius as a fraction of the ring's; wavy-plate: as a fraction of the side
    bool operator==(const ShapeOptions&) const = default;
};

/// A cube with waves on its faces: height amplitude sin(2 pi frequency u) sin(2 pi frequency v), u and v from 0 to 1
/// over a face. The two outermost rows of vertices of each face have no height, so the cube is closed. 6 n^2 + 2
/// vertices and 6 n^2 quads, n = resolution; centred on the origin. It is the cube of the student's report
/// (docs/reference-code.md).
Mesh make_wavy_cube(const ShapeOptions& options = {});
/// A sphere with radial waves, smooth everywhere. It has the grid of a cube, spread to equal angles: 6 n^2 + 2
/// vertices.
Mesh make_wavy_sphere(const ShapeOptions& options = {});
/// An open square with waves in z and UVs; (n + 1)^2 vertices.
Mesh make_wavy_plane(const ShapeOptions& options = {});
/// A closed square plate across z with the waves of make_wavy_plane on both sides: n x n quads a side, and round(n
/// thickness), at least one, through it.
Mesh make_wavy_plate(const ShapeOptions& options = {});
/// A closed box along x, `length` sides long; n quads across a side and round(n length) along.
Mesh make_bar(const ShapeOptions& options = {});
/// A closed cylinder along x: 4 n quads around, round(n length) along, caps of a square grid of n x n quads.
Mesh make_cylinder(const ShapeOptions& options = {});
/// A torus about z with waves on its tube; 2 n around the ring, n around the tube, n at least 3. The frequency is
/// rounded to whole waves, so that they meet themselves; amplitude and thickness are fractions of the ring's radius.
Mesh make_torus(const ShapeOptions& options = {});

/// Plain shapes, to draw things that are not meshes: a box of six quads, a smooth ball of 6 * 48^2 quads. Positions are
/// floats, so not far from the world's origin. size: side lengths; radius: model units.
Mesh make_box(const Vec3d& centre, const Vec3d& size);
Mesh make_ball(const Vec3d& centre, double radius);

/// The shape with a name: wavy-cube, wavy-sphere, wavy-plane, wavy-plate, bar, cylinder or torus. Errors: usage (an
/// unknown name, an option outside its range).
Result<Mesh> make_shape(std::string_view name, const ShapeOptions& options = {});
/// The names that make_shape knows.
std::span<const std::string_view> shape_names();

// ---------------------------------------------------------------------------------------------------------------------
// Triangles

struct Triangulation {
    std::vector<Triangle> triangles;
    std::vector<Index> source_face; ///< for each triangle: its face; ascending
};

/// The error (unsuitable) of a mesh that comes to more triangles than kMostListedTriangles (mesh/edges.h); none for
/// others.
std::optional<Error> too_many_triangles(std::size_t count);

/// Cuts faces into triangles: a face of n corners becomes n - 2 triangles over its own vertices, with its orientation.
/// Quads are cut along the diagonal that keeps both halves facing the normal of the quad (the shorter one where both
/// do); larger faces by ear clipping in the plane of their normal, and by a fan where no ear is left (outlines that
/// cross themselves). The mesh is not checked. Cost O(corners) for triangles and quads, O(n r) for a face of n corners
/// of which r are reflex; after 1024 n tests the rest of a face becomes a fan. Errors: unsuitable (more than 2^32 / 3
/// triangles), cancelled.
Result<Triangulation> triangulate(const Mesh& mesh, const RunContext& context);
/// For small meshes: cannot be cancelled, and throws BadResultAccess in place of an error.
Triangulation triangulate(const Mesh& mesh);

// ---------------------------------------------------------------------------------------------------------------------
// Topology

/// How often something was found, and where first: lowest index first.
struct Finding {
    static constexpr std::size_t kPlaces = 5; ///< at most this many are kept
    std::size_t count = 0;
    std::vector<std::vector<Index>> places; ///< each: two vertices of an edge, or one vertex, or one face
};

/// What a mesh consists of, and its defects. Edges are pairs of vertices; nothing is welded. A corner that repeats the
/// corner before it is ignored. A face with fewer than three corners then counts as degenerate and has no edges.
struct TopologyReport {
    std::size_t vertices = 0, faces = 0, triangles = 0, quads = 0, polygons = 0; ///< polygons: five corners or more
    std::size_t edges = 0, corners = 0;
    std::size_t components = 0;   ///< sets of faces that are connected through edges
    std::int64_t euler = 0;       ///< vertices in use - edges + faces
    Finding open_edges;           ///< edges with one face
    Finding nonmanifold_edges;    ///< edges with three faces or more
    Finding inconsistent_edges;   ///< edges that two faces run along in the same direction
    Finding nonmanifold_vertices; ///< vertices whose faces form more than one fan
    Finding degenerate_faces;     ///< faces that repeat a vertex, or with an area below 1e-14 of the diagonal squared
    Finding duplicate_faces;      ///< faces with the same vertices as an earlier face, in any order
    Finding unused_vertices;      ///< vertices in no face
    Finding duplicate_vertices;   ///< vertices at exactly the position of an earlier one
    Box box;                      ///< in the world
    double area = 0;              ///< model units squared
    double volume = 0;            ///< signed; of an open mesh: of the cones from the world's origin

    bool is_closed() const { return faces > 0 && open_edges.count == 0; }
    bool is_manifold() const { return nonmanifold_edges.count == 0 && nonmanifold_vertices.count == 0; }
    bool is_oriented() const { return inconsistent_edges.count == 0; }
};

/// Analyses a mesh, which is not checked. Cost O(corners), and O(n log n) at a vertex of n faces. The same result for
/// any number of threads.
TopologyReport analyse_topology(const Mesh& mesh, const RunContext& context = RunContext());

// ---------------------------------------------------------------------------------------------------------------------
// Distances

/// Distance between vertex i of one mesh and vertex i of the other, model units.
struct VertexDistance {
    double rms = 0, max = 0;
    Index max_vertex = kNoIndex;
    /// Angle between the vertex normals of the two, degrees. Normals are computed from positions; vertices without a
    /// normal do not count.
    double normal_mean_deg = 0, normal_p95_deg = 0, normal_max_deg = 0;
    std::vector<float> per_vertex; ///< distance of each vertex, for heat maps
};

/// Distance between two surfaces, both ways, at samples: all vertices of faces, and points spread by area.
struct SurfaceDistance {
    double hausdorff = 0;                       ///< the larger of the two largest distances
    double mean_distance = 0, rms_distance = 0; ///< both ways together
    double max_a_to_b = 0, max_b_to_a = 0;
    double rms_a_to_b = 0, rms_b_to_a = 0; ///< one way
};

struct MeshDistance {
    std::optional<VertexDistance> vertices;  ///< where both have the same number of vertices
    std::optional<SurfaceDistance> surfaces; ///< where both have faces
    double diagonal = 0;                     ///< of b's box

    /// A distance (model units) as a fraction of the diagonal; 0 where b has no extent.
    double relative(double units) const { return diagonal > 0 ? units / diagonal : 0.0; }
};

/// The distance vertex by vertex, in the world. Cost O(V + corners). Errors: usage (check_mesh refuses a mesh),
/// mismatch (another number of vertices).
Result<VertexDistance> vertex_distance(const Mesh& a, const Mesh& b, const RunContext& context = RunContext());
/// The distance between two shapes of one mesh. a, b: positions of the vertices of `mesh`. Nothing is checked.
VertexDistance vertex_distance(const Mesh& mesh, std::span<const Vec3f> a, std::span<const Vec3f> b,
                               const RunContext& context = RunContext());

/// The distance between two meshes in the world, vertex by vertex and surface to surface. samples: points on each
/// surface besides its vertices; RunContext::seed draws them. Cost O((V + samples) log F). Errors: usage (check_mesh
/// refuses a mesh), cancelled.
Result<MeshDistance> mesh_distance(const Mesh& a, const Mesh& b, std::size_t samples,
                                   const RunContext& context = RunContext());

/// For each vertex of a: the distance from the surface of b, model units. Cost O(V log F). Errors: usage (check_mesh
/// refuses a mesh), unsuitable (b has no faces), cancelled.
Result<std::vector<float>> distances_to_surface(const Mesh& a, const Mesh& b, const RunContext& context = RunContext());

/// For each vertex: the mean of |length in a / length in rest - 1| over the edges at it. Cost O(corners). Errors: usage
/// (check_mesh refuses a mesh), mismatch (the meshes do not have the same faces).
Result<std::vector<float>> edge_strains(const Mesh& a, const Mesh& rest);

// ---------------------------------------------------------------------------------------------------------------------
// Patches of quad meshes

/// A quad mesh as patches: each is a grid of (n + 1)^2 vertices of the mesh, n = 2^levels. Neighbouring patches share
/// the vertices on their border.
struct RegularPatches {
    unsigned levels = 0;                    ///< how often every second row and column can be removed
    std::vector<std::array<Index, 4>> base; ///< corners of each patch: vertices of the mesh, oriented like its faces
    /// Vertices, patch by patch and row by row: column i, row j of patch p is grid[(p (n + 1) + j) (n + 1) + i].
    /// base[p] = { (0, 0), (n, 0), (n, n), (0, n) }.
    std::vector<Index> grid;

    std::size_t patch_count() const { return base.size(); }
    std::size_t side() const { return std::size_t{1} << levels; } ///< n
    Index at(std::size_t patch, std::size_t i, std::size_t j) const {
        return grid[(patch * (side() + 1) + j) * (side() + 1) + i];
    }
};

/// Finds the patches of a quad mesh: undoes subdivision (each quad into four) as often as all components allow, at most
/// max_levels times. Where there is a choice (a torus), vertex 0 of each component is kept. Open borders are fine. Cost
/// O(V + F). Errors: usage (check_mesh refuses the mesh), unsuitable (a face that is no quad, a non-manifold edge, not
/// even one level; the sentence says where), cancelled.
Result<RegularPatches> find_regular_patches(const Mesh& mesh, unsigned max_levels,
                                            const RunContext& context = RunContext());

} // namespace filigree
