// A polygon mesh as plain arrays: what every file is read into and every algorithm takes.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/types.h"

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

/// Values that corners refer to. Corner c has values[corners[c]], as in OBJ, or none where corners[c] is kNoIndex;
/// when `corners` is empty there is one value a vertex, in vertex order.
template <class T>
struct CornerAttribute {
    std::vector<T> values;
    std::vector<Index> corners;

    bool empty() const { return values.empty(); }
    bool per_vertex() const { return corners.empty(); }
};

/// A name for each face, such as its group or its material. `of_face` is empty or holds one index into `names` a
/// face, kNoIndex where a face has none.
struct FaceLabels {
    std::vector<std::string> names;
    std::vector<Index> of_face;

    bool empty() const { return of_face.empty(); }
};

/// One number a vertex, under the name a file gave it ("quality", "confidence", "f00").
struct VertexScalar {
    std::string name;
    std::vector<float> values;
};

/// How a surface looks: what we use of a file's material.
struct MeshMaterial {
    std::string name;
    /// Base colour, sRGB 0 to 1; multiplied with the picture. (OBJ: Kd; white beside a texture when the file says
    /// nothing or black, as some programs do.)
    Vec3f color = {0.8f, 0.8f, 0.8f};
    float opacity = 1, metallic = 0, roughness = 1; ///< 0 to 1
    bool double_sided = true;
    std::filesystem::path picture; ///< base colour texture, ready to be opened; empty: none, or `picture_bytes`
    /// The same as its PNG or JPEG file's bytes, where it came inside the mesh's file; materials may share it.
    std::shared_ptr<const std::string> picture_bytes = {};

    bool has_picture() const { return picture_bytes || !picture.empty(); }
};

/// Polygons over shared vertices. Face f has the corners face_offsets[f] .. face_offsets[f + 1] - 1, each at least
/// three, counter-clockwise seen from outside. Vertex and face order is the file's and is never changed.
/// What holds between the arrays is said by `check_mesh`: calls that return a Result or a Status refuse a mesh that it
/// refuses (usage), others have to be given a sound one. A mesh that was moved from is an empty mesh.
struct Mesh {
    std::vector<Vec3f> positions;          ///< model units, relative to `origin`
    Vec3d origin = Vec3d::Zero();          ///< added to every position; not zero only far from the world's origin
    std::vector<Index> face_offsets = {0}; ///< F + 1 offsets into `corners`, ascending
    std::vector<Index> corners;            ///< vertex of each corner

    CornerAttribute<Vec2f> uvs;
    CornerAttribute<Vec3f> normals;    ///< as the file has them: not always of unit length
    std::vector<Vec4f> colors;         ///< empty or one RGBA a vertex, 0 to 1
    bool colors_have_alpha = false;    ///< whether the fourth channel came with the file
    std::vector<VertexScalar> scalars; ///< further numbers a vertex
    FaceLabels objects, groups, materials;
    std::vector<Index> smoothing;            ///< empty or one smoothing group a face; 0 is "off"
    std::vector<std::string> material_files; ///< names of material libraries, as the file gave them
    /// Materials that came inside the mesh's own file (glTF): empty, or one for each of materials.names, with pictures
    /// as bytes. They go before material_files.
    std::vector<MeshMaterial> embedded_materials;

    std::size_t vertex_count() const { return positions.size(); }
    std::size_t face_count() const { return face_offsets.empty() ? 0 : face_offsets.size() - 1; }
    std::size_t corner_count() const { return corners.size(); }
    Index face_size(std::size_t face) const { return face_offsets[face + 1] - face_offsets[face]; }
    std::span<const Index> face(std::size_t face) const {
        return std::span(corners).subspan(face_offsets[face], face_size(face));
    }
    /// Position in the world, in double.
    Vec3d world_position(std::size_t vertex) const { return origin + positions[vertex].cast<double>(); }

    void add_face(std::span<const Index> face_corners) {
        if (face_offsets.empty()) face_offsets.push_back(0); // moved from
        corners.insert(corners.end(), face_corners.begin(), face_corners.end());
        face_offsets.push_back(static_cast<Index>(corners.size()));
    }
};

/// The box of a mesh's positions: of the vertices that faces use, or of all where there is no face. A stray vertex far
/// away says nothing about a mesh's size. Cost O(V + corners).
Box bounds(const Mesh& mesh);
/// The same in the world.
inline Box world_bounds(const Mesh& mesh) {
    Box box = bounds(mesh);
    box.min += mesh.origin;
    box.max += mesh.origin;
    return box;
}

/// Splits the origin off, so that float keeps the digits of positions far from the world's origin: moves mesh.positions
/// and sets mesh.origin (which must be zero). The origin is zero unless the mesh's box (see bounds) is more than twice
/// its own diagonal away; then it is the box's centre (0 on axes where the box is close), rounded so that every
/// position keeps all its digits. Cost O(V + corners).
void split_origin(Mesh& mesh);
/// The same, of positions in double, which become mesh.positions; the mesh's own where there are none. A vertex that no
/// face uses gets float's precision beside that origin.
void split_origin(std::span<const Vec3d> world, Mesh& mesh);

/// The first thing wrong with the arrays, as a sentence, or "" when all that `Mesh` promises holds: offsets ascend,
/// faces have three corners or more, every index is in range, attribute sizes fit, all numbers are finite, and
/// there are fewer vertices and corners than indices. Cost O(size).
std::string check_mesh(const Mesh& mesh);
/// The same as an error of usage, none for a sound mesh. what: the mesh's name, with which the sentence begins.
std::optional<Error> mesh_error(const Mesh& mesh, std::string_view what = "The mesh");

} // namespace filigree
