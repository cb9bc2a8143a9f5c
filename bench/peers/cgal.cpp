// CGAL: a scan deformed as rigidly as possible with every vertex in the solve, and simplified to 1,000 vertices.
#include "peer.h"

#include <memory>
#include <optional>

#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_deformation.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_policies.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
namespace pmp = CGAL::Polygon_mesh_processing;
namespace sms = CGAL::Surface_mesh_simplification;

constexpr std::size_t kDriverVertices = 1000;
constexpr double kHeldEnd = 0.05; // of the box, at either end of its longest axis
constexpr int kRounds = 5;

// The scan's largest part as a manifold mesh, which is what CGAL can work on.
Mesh make_mesh(const peer::Triangles& scan) {
    std::vector<Kernel::Point_3> points;
    std::vector<std::vector<std::size_t>> faces;
    for (const auto& [x, y, z] : scan.positions) points.emplace_back(x, y, z);
    for (const auto& face : scan.faces) faces.emplace_back(face.begin(), face.end());
    pmp::repair_polygon_soup(points, faces);
    pmp::orient_polygon_soup(points, faces);
    Mesh mesh;
    pmp::polygon_soup_to_polygon_mesh(points, faces, mesh);
    pmp::keep_largest_connected_components(mesh, 1);
    mesh.collect_garbage();
    return mesh;
}

void report_arap(Mesh mesh) {
    CGAL::Bbox_3 box;
    for (const auto vertex : mesh.vertices()) box += mesh.point(vertex).bbox();
    int axis = 0;
    for (const int other : {1, 2})
        if (box.max(other) - box.min(other) > box.max(axis) - box.min(axis)) axis = other;
    const double margin = kHeldEnd * (box.max(axis) - box.min(axis));

    using Deformation = CGAL::Surface_mesh_deformation<Mesh, CGAL::Default, CGAL::Default, CGAL::ORIGINAL_ARAP>;
    std::unique_ptr<Deformation> deformation;
    std::vector<Mesh::Vertex_index> moved;
    const double setup_time = peer::seconds([&] {
        deformation = std::make_unique<Deformation>(mesh);
        const auto [begin, end] = mesh.vertices();
        deformation->insert_roi_vertices(begin, end);
        for (const auto vertex : mesh.vertices()) {
            const double at = mesh.point(vertex)[axis];
            if (at > box.max(axis) - margin) moved.push_back(vertex);
            if (at < box.min(axis) + margin || at > box.max(axis) - margin) deformation->insert_control_vertex(vertex);
        }
        if (!deformation->preprocess()) peer::give_up("CGAL could not factor the system");
    });
    peer::report("cgal.arap_setup", setup_time, "s");

    const Kernel::Vector_3 shift(margin, 2 * margin, margin);
    for (const auto vertex : moved) deformation->set_target_position(vertex, mesh.point(vertex) + shift);
    peer::report("cgal.arap_iteration", peer::median_seconds(kRounds, [&] { deformation->deform(1, 0.0); }), "s");
}

// Policies: Lindstrom-Turk is CGAL's default; Garland-Heckbert is bound to the mesh it works on.
template <class MakeParameters>
void report_simplify(const char* name, Mesh mesh, const MakeParameters& make_parameters) {
    const sms::Count_stop_predicate<Mesh> stop(3 * kDriverVertices); // edges: three a vertex on a closed mesh
    peer::report(name, peer::seconds([&] { sms::edge_collapse(mesh, stop, make_parameters(mesh)); }), "s");
}

} // namespace

int main(int argc, char** argv) {
    const Mesh mesh = make_mesh(peer::read_argument(argc, argv));
    peer::report("cgal.vertices", double(mesh.number_of_vertices()), "vertices");
    report_arap(mesh);
    report_simplify("cgal.simplify_lindstrom_turk", mesh, [](Mesh&) { return CGAL::parameters::default_values(); });
    std::optional<sms::GarlandHeckbert_plane_policies<Mesh, Kernel>> quadrics;
    report_simplify("cgal.simplify_garland_heckbert", mesh, [&](Mesh& copy) {
        quadrics.emplace(copy);
        return CGAL::parameters::get_cost(quadrics->get_cost()).get_placement(quadrics->get_placement());
    });
}
