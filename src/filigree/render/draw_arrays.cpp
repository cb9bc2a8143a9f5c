#include "filigree/render/draw_arrays.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh.h"
#include "filigree/mesh/edges.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

namespace filigree {

namespace {

constexpr std::size_t kMostCreased = 256; // faces at a vertex whose pairs are all looked at

/// Twice the face's area, along its normal [Newell], of the mesh scaled: float holds no areas of the very small and the
/// very large.
Vec3f newell(const Mesh& mesh, std::span<const Vec3f> positions, std::size_t face, double scale) {
    const std::span<const Index> corners = mesh.face(face);
    const Vec3d base = positions[corners[0]].cast<double>(); // differences keep digits, and cannot overflow early
    const auto from_base = [&](Index corner) { return Vec3d(scale * (positions[corner].cast<double>() - base)); };
    Vec3d sum = Vec3d::Zero();
    for (std::size_t k = 1; k + 1 < corners.size(); ++k) sum += from_base(corners[k]).cross(from_base(corners[k + 1]));
    return sum.cast<float>();
}

/// newell of all faces.
std::vector<Vec3f> face_areas(const Mesh& mesh, std::span<const Vec3f> positions, const RunContext& context) {
    std::vector<Vec3f> areas(mesh.face_count());
    const double diagonal = bounds(positions).diagonal(), scale = diagonal > 0 ? 1 / diagonal : 1;
    parallel_for(context, mesh.face_count(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) areas[f] = newell(mesh, positions, f, scale);
    });
    return areas;
}

Vec3f unit(const Vec3f& v) { return v.cast<double>().stableNormalized().cast<float>(); }

IndexLists corners_at_places(const Mesh& mesh, std::span<const Index> place) {
    return make_lists<Index>(place.size(), [&](const auto& add) {
        for (Index c = 0; c < mesh.corner_count(); ++c) add(place[mesh.corners[c]], c);
    });
}

/// Normals of the corners at one place.
class CornerNormals {
public:
    CornerNormals(const Mesh& mesh, std::span<const Vec3f> positions, const SurfaceOptions& options,
                  const RunContext& context)
        : mesh_(mesh), shading_(options.shading),
          least_cosine_(static_cast<float>(std::cos(options.crease_deg * std::numbers::pi / 180))) {
        if (shading_ == Shading::automatic && !mesh.normals.empty()) return;
        areas_ = face_areas(mesh, positions, context);
    }

    /// faces: the face of each corner.
    void at(std::span<const Index> corners, std::span<const Index> faces, std::vector<Vec3f>& normals) {
        normals.resize(corners.size());
        if (shading_ == Shading::automatic && !mesh_.normals.empty()) {
            for (std::size_t i = 0; i < corners.size(); ++i) {
                const Index at =
                    mesh_.normals.per_vertex() ? mesh_.corners[corners[i]] : mesh_.normals.corners[corners[i]];
                normals[i] = at == kNoIndex ? Vec3f(Vec3f::Zero()) : unit(mesh_.normals.values[at]);
            }
            return;
        }
        if (shading_ == Shading::flat) {
            for (std::size_t i = 0; i < corners.size(); ++i) normals[i] = unit(areas_[faces[i]]);
            return;
        }
        Vec3f sum = Vec3f::Zero();
        for (Index f : faces) sum += areas_[f];
        const Vec3f smooth = unit(sum);
        std::fill(normals.begin(), normals.end(), smooth);
        if (shading_ == Shading::smooth || corners.size() > kMostCreased) return;

        units_.clear();
        bool is_smooth = true;
        for (Index f : faces) {
            units_.push_back(unit(areas_[f]));
            // Twice half the angle is the whole: then every pair is within it.
            const float half = std::sqrt(std::max(0.0f, 0.5f + 0.5f * least_cosine_));
            is_smooth = is_smooth && (units_.back().isZero() || units_.back().dot(smooth) >= half);
        }
        if (is_smooth) return;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            sum = Vec3f::Zero();
            for (std::size_t j = 0; j < corners.size(); ++j)
                if (are_smooth(i, j)) sum += areas_[faces[j]];
            normals[i] = units_[i].isZero() ? smooth : unit(sum);
        }
    }

private:
    bool are_smooth(std::size_t i, std::size_t j) const { return i == j || units_[i].dot(units_[j]) >= least_cosine_; }

    const Mesh& mesh_;
    Shading shading_;
    float least_cosine_;
    std::vector<Vec3f> areas_, units_;
};

/// The vertices that are drawn: the corners at one place fall together where vertex, normal and UV agree.
class DrawVertices {
public:
    DrawVertices(const Mesh& mesh, DrawArrays& arrays) : of_corner(mesh.corner_count()), mesh_(mesh), arrays_(arrays) {}

    std::vector<Index> of_corner; ///< which of them a corner has

    /// For the corners at one place, with the normal of each.
    void add(std::span<const Index> corners, std::span<const Vec3f> normals) {
        const std::size_t first = arrays_.vertex.size();
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const Index vertex = mesh_.corners[corners[i]];
            const Index uv = mesh_.uvs.empty() ? kNoIndex : uv_index(corners[i]);
            std::size_t d = std::max(first, arrays_.vertex.size() - std::min(arrays_.vertex.size(), kMostCreased));
            while (d < arrays_.vertex.size() && !(arrays_.vertex[d] == vertex && arrays_.normals[d] == normals[i] &&
                                                  (mesh_.uvs.empty() || uv_of_draw_[d] == uv)))
                ++d;
            of_corner[corners[i]] = static_cast<Index>(d);
            if (d < arrays_.vertex.size()) continue;
            arrays_.vertex.push_back(vertex);
            arrays_.normals.push_back(normals[i]);
            if (mesh_.uvs.empty()) continue;
            uv_of_draw_.push_back(uv);
            arrays_.uvs.push_back(uv == kNoIndex ? Vec2f(Vec2f::Zero()) : mesh_.uvs.values[uv]);
        }
    }

private:
    Index uv_index(Index corner) const {
        return mesh_.uvs.per_vertex() ? mesh_.corners[corner] : mesh_.uvs.corners[corner];
    }

    const Mesh& mesh_;
    DrawArrays& arrays_;
    std::vector<Index> uv_of_draw_;
};

/// Which corners of a face its triangles have, and which of their sides are the polygon's.
class PolygonSides {
public:
    explicit PolygonSides(const Mesh& mesh) : mesh_(mesh), corner_of_vertex_(mesh.vertex_count(), kNoIndex) {}

    void go_to(Index face) {
        if (face == face_) return;
        face_ = face;
        begin_ = mesh_.face_offsets[face];
        size_ = mesh_.face_size(face);
        bool passes_twice = false;
        for (Index c = begin_; c < begin_ + size_; ++c) {
            Index& corner = corner_of_vertex_[mesh_.corners[c]];
            passes_twice = passes_twice || (corner != kNoIndex && corner >= begin_);
            corner = c;
        }
        outline_.clear();
        for (Index k = 0; passes_twice && k < size_; ++k)
            outline_.emplace(mesh_.corners[begin_ + k], mesh_.corners[begin_ + (k + 1) % size_]);
    }
    Index corner(Index vertex) const { return corner_of_vertex_[vertex]; }
    bool is_side(Index a, Index b) const {
        if (!outline_.empty()) return outline_.contains({a, b});
        return corner(b) - begin_ == (corner(a) - begin_ + 1) % size_;
    }

private:
    const Mesh& mesh_;
    std::vector<Index> corner_of_vertex_;
    std::set<std::pair<Index, Index>> outline_; ///< vertices of the sides of a face that passes some vertex twice
    Index face_ = kNoIndex, begin_ = 0, size_ = 0;
};

/// Triangles by material; those without one come last.
void add_triangles(const Mesh& mesh, const Triangulation& cut, const SurfaceOptions& options,
                   std::span<const Index> draw_vertex, DrawArrays& arrays) {
    const bool by_material = !options.materials.empty() && !mesh.materials.empty();
    const auto slot_of = [&](Index face) {
        const Index m = by_material ? mesh.materials.of_face[face] : kNoIndex;
        return m == kNoIndex ? mesh.materials.names.size() : m;
    };
    const auto is_hidden = [&](Index face) { return !options.hidden_faces.empty() && options.hidden_faces[face]; };
    std::vector<Index> next(mesh.materials.names.size() + 2, 0);
    for (Index f : cut.source_face)
        if (!is_hidden(f)) ++next[slot_of(f) + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    for (std::size_t m = 0; m + 1 < next.size(); ++m)
        if (next[m] < next[m + 1])
            arrays.parts.push_back(
                {m == mesh.materials.names.size() ? kNoIndex : static_cast<Index>(m), next[m], next[m + 1] - next[m]});
    arrays.triangles.resize(next.back());
    arrays.edges.resize(next.back());
    PolygonSides polygon(mesh);
    for (std::size_t t = 0; t < cut.triangles.size(); ++t) {
        const Index f = cut.source_face[t];
        if (is_hidden(f)) continue;
        polygon.go_to(f);
        const Index slot = next[slot_of(f)]++;
        std::uint8_t edges = 0;
        for (int k = 0; k < 3; ++k) {
            const Index a = cut.triangles[t][k], b = cut.triangles[t][(k + 1) % 3];
            arrays.triangles[slot][k] = draw_vertex[polygon.corner(a)];
            if (polygon.is_side(a, b)) edges |= static_cast<std::uint8_t>(1 << k);
        }
        arrays.edges[slot] = edges;
    }
}

} // namespace

Result<DrawArrays> make_draw_arrays(const Mesh& mesh, std::span<const Vec3f> positions, const SurfaceOptions& options,
                                    const RunContext& context) {
    DrawArrays arrays;
    const std::vector<Index> place = weld_map(positions);
    const PolygonCorners polygons(mesh.face_offsets);
    const IndexLists at = corners_at_places(mesh, place);
    if (context.is_cancelled()) return cancelled_error();
    CornerNormals corner_normals(mesh, positions, options, context);
    DrawVertices vertices(mesh, arrays);
    std::vector<Vec3f> normals;
    std::vector<Index> faces;
    for (std::size_t p = 0; p < place.size(); ++p) {
        if (p % (1 << 18) == 0) {
            if (context.is_cancelled()) return cancelled_error();
            context.report("preparing to draw", double(p) / double(place.size()));
        }
        const std::span corners = at[p];
        if (corners.empty()) continue;
        faces.clear();
        for (Index c : corners) faces.push_back(polygons.face(c));
        corner_normals.at(corners, faces, normals);
        vertices.add(corners, normals);
    }
    const Result<Triangulation> cut = triangulate(mesh, context);
    if (!cut) return cut.error();
    add_triangles(mesh, *cut, options, vertices.of_corner, arrays);
    return arrays;
}

} // namespace filigree
