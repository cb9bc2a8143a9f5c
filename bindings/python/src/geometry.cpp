// Questions about surfaces for filigree/_geometry.py: the closest point, winding numbers, normals.
#include "calls.h"
#include "meshes.h"

#include <filigree/core/disjoint_sets.h>
#include <filigree/core/parallel_for.h>
#include <filigree/mesh/closest_point.h>
#include <filigree/mesh/normals.h>
#include <filigree/sample/winding_tree.h>

namespace filigree::python {

namespace {

std::vector<Vec3d> points_from_origin(const py::object& given, const Mesh& mesh) {
    std::vector<Vec3d> points = double_points_of(given, "points");
    for (Vec3d& point : points) point -= mesh.origin;
    return points;
}

struct Closest {
    std::vector<Vec3d> points, barycentric;
    std::vector<double> distances;
    std::vector<Index> triangles, faces;
};

py::tuple closest_points(const py::object& given, const py::object& asked, unsigned threads) {
    const MeshPtr mesh = mesh_of(given);
    if (mesh->face_count() == 0) refuse(ErrorCode::unsuitable, "The mesh has no faces, so no point of it is closest.");
    const std::vector<Vec3d> points = points_from_origin(asked, *mesh);
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!points[i].cast<float>().allFinite())
            refuse("points[" + std::to_string(i) + "] is not finite as a 32-bit number.");
    Closest found = LongCall{threads}([&](const RunContext& context) {
        const Triangulation cut = triangulate(*mesh);
        const ClosestPointTree tree(mesh->positions, cut.triangles, context);
        const std::size_t count = points.size();
        Closest all{std::vector<Vec3d>(count), std::vector<Vec3d>(count), std::vector<double>(count),
                    std::vector<Index>(count), std::vector<Index>(count)};
        parallel_for(context, count, 256, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const SurfacePoint point = tree.closest(points[i].cast<float>());
                all.barycentric[i] = point.barycentric.cast<double>();
                all.points[i] = mesh->origin + point.position.cast<double>();
                all.distances[i] = point.distance;
                all.triangles[i] = point.triangle;
                all.faces[i] = cut.source_face[point.triangle];
            }
        });
        return all;
    });
    return py::make_tuple(take(std::move(found.points)), take(std::move(found.distances)), take(std::move(found.faces)),
                          take(std::move(found.triangles)), take(std::move(found.barycentric)));
}

py::array_t<float> winding_numbers(const py::object& given, const py::object& asked, double accuracy,
                                   unsigned threads) {
    const MeshPtr mesh = mesh_of(given);
    if (!(accuracy >= 1e-4 && accuracy <= 0.1)) refuse("accuracy has to be from 0.0001 to 0.1.");
    const std::vector<Vec3d> points = points_from_origin(asked, *mesh);
    return take(LongCall{threads}([&](const RunContext& context) {
        const Triangulation cut = triangulate(*mesh);
        return WindingTree::create(mesh->positions, cut.triangles, accuracy, context)
            .value()
            .winding(points, context)
            .value();
    }));
}

py::array_t<float> vertex_normals_of(const py::object& given) {
    const MeshPtr mesh = mesh_of(given);
    const RunContext& context = short_context(0);
    return take(without_interpreter([&] { return vertex_normals(*mesh, mesh->positions, context); }));
}

/// Of each vertex the lowest vertex of its part: faces hang together where they share a vertex.
py::array_t<Index> parts_of(const py::object& given) {
    const MeshPtr mesh = mesh_of(given);
    return take(without_interpreter([&] {
        DisjointSets sets(mesh->vertex_count());
        for (std::size_t face = 0; face < mesh->face_count(); ++face)
            for (const Index corner : mesh->face(face)) sets.join(mesh->face(face)[0], corner);
        std::vector<Index> parts(mesh->vertex_count());
        for (Index v = 0; v < parts.size(); ++v) parts[v] = sets.root(v);
        return parts;
    }));
}

/// The area vector of each face.
py::array_t<double> area_vectors_of(const py::object& given) {
    const MeshPtr mesh = mesh_of(given);
    return take(without_interpreter([&] {
        std::vector<Vec3d> vectors(mesh->face_count(), Vec3d::Zero());
        for (std::size_t face = 0; face < vectors.size(); ++face)
            if (mesh->face_size(face) >= 3)
                vectors[face] = 0.5 * doubled_area_vector(mesh->positions, mesh->face(face));
        return vectors;
    }));
}

} // namespace

void add_geometry(py::module_& m) {
    m.def(
        "_mesh_of", [](const py::object& given, const char* name) { return mesh_of(given, name); }, py::arg("mesh"),
        py::arg("name") = "mesh");
    m.def("_closest_points", &closest_points, py::arg("mesh"), py::arg("points"), py::arg("threads"));
    m.def("_winding_numbers", &winding_numbers, py::arg("mesh"), py::arg("points"), py::arg("accuracy"),
          py::arg("threads"));
    m.def("_parts", &parts_of, py::arg("mesh"));
    m.def("_vertex_normals", &vertex_normals_of, py::arg("mesh"));
    m.def("_area_vectors", &area_vectors_of, py::arg("mesh"));
}

} // namespace filigree::python
