#include "filigree/mesh/normals.h"

#include "filigree/core/parallel_for.h"

#include <cassert>
#include <numeric>
#include <unordered_map>

namespace filigree {
namespace {

constexpr std::size_t kNormalsGrain = 16384;

/// Adds twice the area vector of a face to the sums of its vertices.
void add_face(std::span<const Index> face, std::span<const Vec3f> positions, std::vector<Vec3d>& sums) {
    const Vec3d normal = doubled_area_vector(positions, face);
    for (const Index vertex : face) sums[vertex] += normal;
}

std::vector<Vec3f> normalised(const std::vector<Vec3d>& sums, const RunContext& context) {
    std::vector<Vec3f> normals(sums.size());
    parallel_for(context, sums.size(), kNormalsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const double length = sums[v].norm();
            normals[v] = length > 0 ? Vec3f((sums[v] / length).cast<float>()) : Vec3f::Zero();
        }
    });
    return normals;
}

} // namespace

// The sums are made on one thread: they wait for memory, and gathering by vertex needs a table that costs more.

std::vector<Vec3f> vertex_normals(const Mesh& mesh, std::span<const Vec3f> positions, const RunContext& context) {
    assert(positions.size() == mesh.vertex_count());
    std::vector<Vec3d> sums(positions.size(), Vec3d::Zero());
    for (std::size_t f = 0; f < mesh.face_count(); ++f) add_face(mesh.face(f), positions, sums);
    return normalised(sums, context);
}

std::vector<Vec3f> vertex_normals(std::span<const Triangle> triangles, std::span<const Vec3f> positions,
                                  const RunContext& context) {
    std::vector<Vec3d> sums(positions.size(), Vec3d::Zero());
    for (const Triangle& triangle : triangles) add_face(triangle, positions, sums);
    return normalised(sums, context);
}

std::vector<Index> split_shared_normals(Mesh& mesh) {
    CornerAttribute<Vec3f>& normals = mesh.normals;
    std::vector<Index> vertex_of(normals.values.size(), kNoIndex);
    if (normals.per_vertex()) {
        std::iota(vertex_of.begin(), vertex_of.end(), 0);
        return vertex_of;
    }
    std::unordered_map<std::uint64_t, Index> copies; // (value, vertex) to the copy made for it
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) {
        const Index value = normals.corners[c], vertex = mesh.corners[c];
        if (value == kNoIndex) continue; // this corner has no normal
        if (vertex_of[value] == kNoIndex) vertex_of[value] = vertex;
        if (vertex_of[value] == vertex) continue;
        const auto [copy, is_new] =
            copies.try_emplace(std::uint64_t{value} << 32 | vertex, static_cast<Index>(normals.values.size()));
        if (is_new) {
            normals.values.push_back(Vec3f(normals.values[value]));
            vertex_of.push_back(vertex);
        }
        normals.corners[c] = copy->second;
    }
    return vertex_of;
}

} // namespace filigree
