#include "filigree/fracture/piece_assembly.h"

#include "filigree/mesh/normals.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>

namespace filigree {

namespace {

constexpr float kCreaseCosine = 0.8f; ///< 37 degrees

/// Copies of an attribute's values at corners of the new mesh, interpolated where there was no corner.
template <class T>
class CornerCopier {
public:
    CornerCopier(const CornerAttribute<T>& from, CornerAttribute<T>& to) : from_(from), to_(to) {
        to_.values = from.values;
        to_.corners.clear();
    }
    /// A corner of the old mesh, whose vertex is `vertex`.
    void copy(Index corner, Index vertex) { to_.corners.push_back(value_at(corner, vertex)); }
    /// A place between corners (kNoIndex: none) of one face.
    void blend(const std::array<Index, 3>& corners, const std::array<Index, 3>& vertices,
               const std::array<double, 3>& weights) {
        T sum = T::Zero();
        for (std::size_t k = 0; k < 3; ++k) {
            if (corners[k] == kNoIndex) continue;
            const Index value = value_at(corners[k], vertices[k]);
            if (value == kNoIndex) return none();
            sum += static_cast<float>(weights[k]) * from_.values[value];
        }
        add(sum);
    }
    void add(const T& value) {
        to_.corners.push_back(static_cast<Index>(to_.values.size()));
        to_.values.push_back(value);
    }
    void none() { to_.corners.push_back(kNoIndex); }

private:
    Index value_at(Index corner, Index vertex) const {
        return from_.empty() ? kNoIndex : from_.per_vertex() ? vertex : from_.corners[corner];
    }
    const CornerAttribute<T>& from_;
    CornerAttribute<T>& to_;
};

/// Puts faces in the order of their pieces, which then follow each other in files; within a piece order stays.
void sort_by_piece(FracturedMesh& fractured) {
    Mesh& mesh = fractured.mesh;
    std::vector<Index> order(mesh.face_count());
    std::iota(order.begin(), order.end(), Index{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](Index a, Index b) { return fractured.piece_of_face[a] < fractured.piece_of_face[b]; });
    const auto sort_faces = [&](auto& values) {
        if (values.empty()) return;
        const auto before = values;
        for (std::size_t k = 0; k < order.size(); ++k) values[k] = before[order[k]];
    };
    const std::vector<Index> offsets = std::move(mesh.face_offsets);
    mesh.face_offsets = {0};
    for (const Index face : order)
        mesh.face_offsets.push_back(mesh.face_offsets.back() + offsets[face + 1] - offsets[face]);
    const auto sort_corners = [&](std::vector<Index>& values) {
        if (values.empty()) return;
        const std::vector<Index> before = values;
        std::size_t to = 0;
        for (const Index face : order)
            for (Index c = offsets[face]; c < offsets[face + 1]; ++c) values[to++] = before[c];
    };
    sort_corners(mesh.corners);
    sort_corners(mesh.uvs.corners);
    sort_corners(mesh.normals.corners);
    sort_faces(mesh.materials.of_face);
    sort_faces(mesh.smoothing);
    sort_faces(fractured.piece_of_face);
    sort_faces(fractured.is_inside);
    sort_faces(fractured.crack_of_face);
}

/// Puts pieces together from the cut's triangles.
class Assembly {
public:
    Assembly(const Mesh& mesh, const Surface& surface, const CutSurface& cut, const CrackSurfaces& facets,
             const FractureCells& cells, const RunContext& context)
        : mesh_(mesh), surface_(surface), cut_(cut), facets_(facets), cells_(cells), normals_(normals_of(context)),
          uv_(mesh.uvs, out_.mesh.uvs), normal_(normals_, out_.mesh.normals) {}

    FracturedMesh run(std::span<const CellTriangle> triangles, std::span<const Index> piece_of_part, bool is_sheet) {
        Mesh& out = out_.mesh;
        out.origin = mesh_.origin;
        out.positions = mesh_.positions;
        out.colors = mesh_.colors;
        out.colors_have_alpha = mesh_.colors_have_alpha;
        out.scalars = mesh_.scalars;
        out.material_files = mesh_.material_files;
        out.embedded_materials = mesh_.embedded_materials;
        out.materials.names = mesh_.materials.names;
        inside_material_ = static_cast<Index>(out.materials.names.size());
        out_.piece_of_vertex.assign(mesh_.vertex_count(), kNoIndex);
        out_.place.resize(mesh_.vertex_count());
        std::iota(out_.place.begin(), out_.place.end(), Index{0});
        for (const CrackSurface& facet : facets_.facets) out_.cells_of_crack.push_back({facet.i, facet.j});
        for (const Index piece : piece_of_part) out_.pieces = std::max(out_.pieces, piece + 1);

        std::size_t at = 0;
        while (at < triangles.size() && triangles[at].facet == kNoIndex) {
            const Index source = cut_.triangles[triangles[at].uncut].source;
            if (source == kNoIndex) {
                ++at;
                continue;
            }
            const Index face = surface_.source_face[source];
            std::size_t end = at;
            bool is_whole = true;
            const Index piece = piece_of_part[triangles[at].part];
            for (; end < triangles.size() && triangles[end].facet == kNoIndex; ++end) {
                const Index other = cut_.triangles[triangles[end].uncut].source;
                if (other == kNoIndex || surface_.source_face[other] != face) break;
                is_whole &= piece_of_part[triangles[end].part] == piece;
                for (const Index v : triangles[end].vertices) is_whole &= v < mesh_.vertex_count();
            }
            if (is_whole)
                add_face(face, piece);
            else
                for (; at < end; ++at)
                    add_surface_triangle(triangles[at].vertices, face, piece_of_part[triangles[at].part]);
            at = end;
        }
        if (!is_sheet)
            for (; at + 1 < triangles.size(); at += 2) {
                const CellTriangle &a = triangles[at], &b = triangles[at + 1];
                const Index piece = piece_of_part[a.part], other = piece_of_part[b.part];
                if (piece == other) continue;
                ++out_.report.inside_faces;
                add_inside_triangle(a, piece);
                add_inside_triangle(b, other);
            }
        finish();
        return std::move(out_);
    }

private:
    CornerAttribute<Vec3f> normals_of(const RunContext& context) const {
        if (!mesh_.normals.empty()) return mesh_.normals;
        // Smooth but where a face turns away from the smooth normal by more than kCreaseCosine: there the face's own.
        CornerAttribute<Vec3f> normals;
        normals.values = vertex_normals(surface_.triangles, mesh_.positions, context);
        for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
            const Vec3f of_face = doubled_area_vector(mesh_.positions, mesh_.face(f)).normalized().cast<float>();
            Index own = kNoIndex;
            for (const Index vertex : mesh_.face(f)) {
                const Index smooth = surface_.representative[vertex];
                if (normals.values[smooth].dot(of_face) >= kCreaseCosine) {
                    normals.corners.push_back(smooth);
                    continue;
                }
                if (own == kNoIndex) {
                    own = static_cast<Index>(normals.values.size());
                    normals.values.push_back(of_face);
                }
                normals.corners.push_back(own);
            }
        }
        return normals;
    }

    /// The vertex of the new mesh that stands for one of the cut's in a piece; `own`: the old mesh's vertex at its
    /// place that the face itself has.
    Index vertex_in(Index vertex, Index own, Index piece) {
        if (own != kNoIndex) {
            Index& owner = out_.piece_of_vertex[own];
            if (owner == kNoIndex) owner = piece;
            if (owner == piece) return own;
        }
        const auto [known, is_new] = copies_.try_emplace(std::uint64_t(own == kNoIndex ? vertex : own) << 32 | piece,
                                                         static_cast<Index>(out_.mesh.positions.size()));
        if (is_new) {
            out_.mesh.positions.push_back(cut_.vertices.position(vertex));
            out_.piece_of_vertex.push_back(piece);
            const FacePoint source = cut_.vertices.surface_point(vertex);
            out_.sources.push_back(source);
            out_.place.push_back(own == kNoIndex ? vertex : own);
            if (!out_.mesh.colors.empty()) out_.mesh.colors.push_back(color_at(source));
            for (std::size_t k = 0; k < out_.mesh.scalars.size(); ++k)
                out_.mesh.scalars[k].values.push_back(scalar_at(mesh_.scalars[k], source));
        }
        return known->second;
    }

    Vec4f color_at(const FacePoint& p) const {
        if (p.vertices[0] == kNoIndex) return Vec4f(0.75f, 0.75f, 0.75f, 1);
        Vec4f sum = Vec4f::Zero();
        for (std::size_t k = 0; k < 3; ++k)
            if (p.vertices[k] != kNoIndex) sum += static_cast<float>(p.weights[k]) * mesh_.colors[p.vertices[k]];
        return sum;
    }
    static float scalar_at(const VertexScalar& scalar, const FacePoint& p) {
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k)
            if (p.vertices[k] != kNoIndex) sum += p.weights[k] * double(scalar.values[p.vertices[k]]);
        return static_cast<float>(sum);
    }

    void label(Index old_face, Index piece, Index crack) {
        const bool is_inside = crack != kNoIndex;
        out_.crack_of_face.push_back(crack);
        out_.piece_of_face.push_back(piece);
        out_.is_inside.push_back(is_inside);
        const Index old_material = is_inside || mesh_.materials.empty() ? kNoIndex : mesh_.materials.of_face[old_face];
        out_.mesh.materials.of_face.push_back(is_inside ? inside_material_ : old_material);
        if (!mesh_.smoothing.empty()) out_.mesh.smoothing.push_back(is_inside ? 0 : mesh_.smoothing[old_face]);
    }

    void add_face(Index face, Index piece) {
        std::vector<Index> corners;
        for (Index c = mesh_.face_offsets[face]; c < mesh_.face_offsets[face + 1]; ++c) {
            const Index vertex = mesh_.corners[c];
            corners.push_back(vertex_in(surface_.representative[vertex], vertex, piece));
            uv_.copy(c, vertex);
            normal_.copy(c, vertex);
        }
        out_.mesh.add_face(corners);
        label(face, piece, kNoIndex);
    }

    /// The corner of an old face at a place; the first, where there are several.
    Index corner_at(Index face, Index representative) {
        if (face != corners_of_) {
            corners_of_ = face;
            corner_at_.clear();
            for (Index c = mesh_.face_offsets[face]; c < mesh_.face_offsets[face + 1]; ++c)
                corner_at_.try_emplace(surface_.representative[mesh_.corners[c]], c);
        }
        const auto found = corner_at_.find(representative);
        return found == corner_at_.end() ? kNoIndex : found->second;
    }

    void add_surface_triangle(const Triangle& triangle, Index face, Index piece) {
        std::array<Index, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            const FacePoint point = cut_.vertices.surface_point(triangle[k]);
            std::array<Index, 3> at = {kNoIndex, kNoIndex, kNoIndex}, own = at;
            for (std::size_t s = 0; s < 3; ++s)
                if (point.vertices[s] != kNoIndex && (at[s] = corner_at(face, point.vertices[s])) != kNoIndex)
                    own[s] = mesh_.corners[at[s]];
            const bool is_old = triangle[k] < mesh_.vertex_count();
            corners[k] = vertex_in(triangle[k], is_old ? own[0] : kNoIndex, piece);
            if (is_old && at[0] != kNoIndex) {
                uv_.copy(at[0], own[0]);
                normal_.copy(at[0], own[0]);
            } else {
                uv_.blend(at, own, point.weights);
                normal_.blend(at, own, point.weights);
            }
        }
        out_.mesh.add_face(corners);
        label(face, piece, kNoIndex);
    }

    void add_inside_triangle(const CellTriangle& triangle, Index piece) {
        const CrackSurface& facet = facets_.facets[triangle.facet];
        if (triangle.facet != frame_of_) {
            frame_of_ = triangle.facet;
            frame_ = facet_frame(cells_, facet.i, facet.j);
            inside_normals_ = facet_normals(facet);
        }
        std::array<Index, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            const Index vertex = triangle.vertices[k];
            corners[k] = vertex_in(vertex, vertex < mesh_.vertex_count() ? vertex : kNoIndex, piece);
            const Vec3d p = cells_.warp().unstretched(cut_.vertices.plane(vertex));
            uv_.add(Vec2f(static_cast<float>(p.dot(frame_.x)), static_cast<float>(p.dot(frame_.y))));
            const Vec3f normal = inside_normals_[vertex];
            normal_.add(triangle.cell == cells_.piece_of(facet.i) ? normal : Vec3f(-normal));
        }
        out_.mesh.add_face(corners);
        label(kNoIndex, piece, triangle.facet);
    }

    std::unordered_map<Index, Vec3f> facet_normals(const CrackSurface& facet) const {
        std::unordered_map<Index, Vec3f> normals;
        for (Index k = 0; k < facet.count; ++k) {
            const Triangle& t = facets_.triangles[facet.first + k];
            const Vec3f a = cut_.vertices.position(t[0]);
            const Vec3f cross = (cut_.vertices.position(t[1]) - a).cross(cut_.vertices.position(t[2]) - a);
            for (const Index v : t) normals.try_emplace(v, Vec3f::Zero()).first->second += cross;
        }
        for (auto& [vertex, normal] : normals) normal.stableNormalize();
        return normals;
    }

    void finish() {
        Mesh& out = out_.mesh;
        if (out_.report.inside_faces > 0) {
            out.materials.names.push_back("inside");
            if (out.embedded_materials.size() + 1 == out.materials.names.size())
                out.embedded_materials.emplace_back().name = "inside";
        } else if (mesh_.materials.empty()) {
            out.materials.of_face.clear();
        }
        sort_by_piece(out_);
        out.groups.of_face = out_.piece_of_face;
        for (Index p = 0; p < out_.pieces; ++p) out.groups.names.push_back("piece_" + std::to_string(p));
        out.objects = out.groups;
        VertexScalar piece{"piece", {}};
        for (const Index p : out_.piece_of_vertex)
            piece.values.push_back(p == kNoIndex ? -1.0f : static_cast<float>(p));
        out.scalars.push_back(std::move(piece));
    }

    const Mesh& mesh_;
    const Surface& surface_;
    const CutSurface& cut_;
    const CrackSurfaces& facets_;
    const FractureCells& cells_;
    FracturedMesh out_;
    CornerAttribute<Vec3f> normals_; ///< the unbroken mesh's
    std::unordered_map<std::uint64_t, Index> copies_;
    CornerCopier<Vec2f> uv_;
    CornerCopier<Vec3f> normal_;
    Index corners_of_ = kNoIndex; ///< the face whose corners are in ...
    std::unordered_map<Index, Index> corner_at_;
    Index inside_material_ = 0;
    Index frame_of_ = kNoIndex;
    FacetFrame frame_;
    std::unordered_map<Index, Vec3f> inside_normals_;
};

} // namespace

FracturedMesh assemble_pieces(const Mesh& mesh, const Surface& surface, const CutSurface& cut,
                              const CrackSurfaces& facets, const FractureCells& cells,
                              std::span<const CellTriangle> triangles, std::span<const Index> piece_of_part,
                              bool is_sheet, const RunContext& context) {
    return Assembly(mesh, surface, cut, facets, cells, context).run(triangles, piece_of_part, is_sheet);
}

} // namespace filigree
