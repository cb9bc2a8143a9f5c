// Based on: [Sterbenz 1974], when the difference of two floating-point numbers is exact (split_origin).
#include "filigree/mesh.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kFarInDiagonals = 2; // a box further than this from the world's origin gets an origin of its own

/// How far the world's origin is from the box; 0 inside.
double distance_to_world_origin(const Box& box) { return box.min.cwiseMax(-box.max).cwiseMax(0.0).norm(); }

/// Largest power of two that is not above `x`; 0 for 0.
double power_of_two_below(double x) { return x > 0 ? std::ldexp(1.0, std::ilogb(x)) : 0; }

Vec3d choose_origin(const Box& box) {
    const double diagonal = box.diagonal();
    Vec3d origin = Vec3d::Zero();
    if (box.empty() || !(distance_to_world_origin(box) > kFarInDiagonals * diagonal)) return origin;
    // On a power of two no coarser than the box, float input moves without rounding: p - o is exact where
    // o/2 <= p <= 2 o [Sterbenz 1974]. An axis on which that fails is less than twice its own size from zero, and
    // float keeps its digits as it stands.
    const double cell = power_of_two_below(diagonal);
    for (int axis = 0; axis < 3; ++axis) {
        const double centre = 0.5 * box.min[axis] + 0.5 * box.max[axis];
        const double rounded = cell > 0 ? std::round(centre / cell) * cell : centre;
        const double near = rounded > 0 ? box.min[axis] : -box.max[axis];
        const double far = rounded > 0 ? box.max[axis] : -box.min[axis];
        if (std::abs(rounded) <= 2 * near && far <= 2 * std::abs(rounded)) origin[axis] = rounded;
    }
    return origin;
}

/// Of the positions that corners name; of all where there are none.
template <class Vector>
Box used_box(std::span<const Vector> positions, std::span<const Index> corners) {
    Box box;
    for (const Index v : corners) box.extend(positions[v].template cast<double>());
    if (corners.empty())
        for (const Vector& p : positions) box.extend(p.template cast<double>());
    return box;
}

bool all_finite(std::span<const float> numbers) {
    bool finite = true; // without a branch, so that it vectorises
    for (const float x : numbers) finite &= std::abs(x) <= std::numeric_limits<float>::max();
    return finite;
}

template <class Vector>
bool all_finite(const std::vector<Vector>& vectors) {
    return vectors.empty() || all_finite(std::span(vectors.front().data(), vectors.size() * Vector::SizeAtCompileTime));
}

std::string number(std::size_t n) { return std::to_string(n); }

std::string check_faces(const Mesh& mesh) {
    if (mesh.vertex_count() >= kNoIndex) return "There are more vertices than 32-bit indices can name.";
    if (mesh.corner_count() >= kNoIndex) return "There are more corners than 32-bit indices can name.";
    if (mesh.face_offsets.empty()) // moved from
        return mesh.corners.empty() ? "" : "There are corners, and no face offsets.";
    if (mesh.face_offsets.front() != 0) return "The face offsets do not start with 0.";
    if (mesh.face_offsets.back() != mesh.corners.size()) return "The last face offset is not the number of corners.";
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        if (mesh.face_offsets[f + 1] < mesh.face_offsets[f]) return "The offsets of face " + number(f) + " descend.";
        if (mesh.face_size(f) < 3) return "Face " + number(f) + " has fewer than three corners.";
    }
    for (std::size_t c = 0; c < mesh.corners.size(); ++c)
        if (mesh.corners[c] >= mesh.vertex_count())
            return "Corner " + number(c) + " refers to a vertex that is not there.";
    return "";
}

template <class T>
std::string check_attribute(const CornerAttribute<T>& attribute, const Mesh& mesh, const std::string& name) {
    if (!all_finite(attribute.values)) return "Not all " + name + " are finite.";
    if (attribute.per_vertex()) {
        const bool fits = attribute.empty() || attribute.values.size() == mesh.vertex_count();
        return fits ? "" : "There is not one value a vertex in " + name + ".";
    }
    if (attribute.corners.size() != mesh.corner_count()) return "There is not one index a corner in " + name + ".";
    for (const Index i : attribute.corners)
        if (i >= attribute.values.size() && i != kNoIndex)
            return "A corner refers to a value that is not in " + name + ".";
    return "";
}

std::string check_labels(const FaceLabels& labels, const Mesh& mesh, const std::string& name) {
    if (!labels.empty() && labels.of_face.size() != mesh.face_count())
        return "There is not one label a face in " + name + ".";
    for (const Index i : labels.of_face)
        if (i >= labels.names.size() && i != kNoIndex) return "A face has a label that is not in " + name + ".";
    return "";
}

std::string check_materials(const Mesh& mesh) {
    if (mesh.embedded_materials.empty()) return "";
    if (mesh.embedded_materials.size() != mesh.materials.names.size())
        return "There is not one embedded material for each name.";
    for (const MeshMaterial& m : mesh.embedded_materials)
        for (const float x : {m.color[0], m.color[1], m.color[2], m.opacity, m.metallic, m.roughness})
            if (!(x >= 0 && x <= 1)) return "An embedded material has a number that is not from 0 to 1.";
    return "";
}

std::string check_vertex_data(const Mesh& mesh) {
    if (!mesh.origin.allFinite()) return "The origin is not finite.";
    if (!all_finite(mesh.positions)) return "Not all positions are finite.";
    if (!all_finite(mesh.colors)) return "Not all colours are finite.";
    if (!mesh.colors.empty() && mesh.colors.size() != mesh.vertex_count()) return "There is not one colour a vertex.";
    for (const VertexScalar& scalar : mesh.scalars) {
        if (scalar.values.size() != mesh.vertex_count())
            return "There is not one value a vertex in " + scalar.name + ".";
        if (!all_finite(std::span(scalar.values))) return "Not all values of " + scalar.name + " are finite.";
    }
    return "";
}

} // namespace

Box bounds(const Mesh& mesh) { return used_box(std::span<const Vec3f>(mesh.positions), mesh.corners); }

void split_origin(Mesh& mesh) {
    Vec3d origin = choose_origin(bounds(mesh));
    if (origin.isZero(0)) return;
    const auto moved = [&](const Vec3f& p) -> Vec3f { return (p.cast<double>() - origin).cast<float>(); };
    const auto stays = [&](const Vec3f& p) { return origin + moved(p).cast<double>() == p.cast<double>(); };
    // Moving what faces use is exact; a stray vertex must not lose digits either.
    if (!std::ranges::all_of(mesh.positions, stays)) origin = choose_origin(bounds(mesh.positions));
    for (Vec3f& p : mesh.positions) p = moved(p);
    mesh.origin = origin;
}

void split_origin(std::span<const Vec3d> world, Mesh& mesh) {
    if (world.empty()) return split_origin(mesh);
    mesh.origin = choose_origin(used_box(world, mesh.corners));
    mesh.positions.resize(world.size());
    for (std::size_t v = 0; v < world.size(); ++v) mesh.positions[v] = (world[v] - mesh.origin).cast<float>();
}

std::string check_mesh(const Mesh& mesh) {
    std::string problem = check_faces(mesh);
    if (problem.empty()) problem = check_vertex_data(mesh);
    if (problem.empty()) problem = check_attribute(mesh.uvs, mesh, "uvs");
    if (problem.empty()) problem = check_attribute(mesh.normals, mesh, "normals");
    if (problem.empty()) problem = check_labels(mesh.objects, mesh, "objects");
    if (problem.empty()) problem = check_labels(mesh.groups, mesh, "groups");
    if (problem.empty()) problem = check_labels(mesh.materials, mesh, "materials");
    if (problem.empty()) problem = check_materials(mesh);
    if (problem.empty() && !mesh.smoothing.empty() && mesh.smoothing.size() != mesh.face_count())
        problem = "There is not one smoothing group a face.";
    return problem;
}

std::optional<Error> mesh_error(const Mesh& mesh, std::string_view what) {
    const std::string problem = check_mesh(mesh);
    if (problem.empty()) return std::nullopt;
    return Error{ErrorCode::usage, std::string(what) + " is inconsistent: " + problem};
}

} // namespace filigree
