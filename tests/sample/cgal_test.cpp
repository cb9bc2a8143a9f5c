// Held against CGAL's exact test, where CGAL is installed (scripts/bench-peers installs it; nothing here needs it).
#include <gtest/gtest.h>

#if __has_include(<CGAL/Side_of_triangle_mesh.h>)

#define CGAL_DISABLE_GMP 1 // headers alone: no further library
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

#include "filigree/mesh.h"
#include "filigree/sample.h"

#include <numbers>

namespace filigree {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

/// Lattice points whose answer differs from CGAL's, and how many lie exactly on the surface.
std::array<std::size_t, 2> compare(const Mesh& mesh, const Lattice& lattice) {
    CGAL::Surface_mesh<Kernel::Point_3> peer;
    std::vector<CGAL::Surface_mesh<Kernel::Point_3>::Vertex_index> ids;
    for (const Vec3f& p : mesh.positions) ids.push_back(peer.add_vertex(Kernel::Point_3(p.x(), p.y(), p.z())));
    for (const Triangle& t : triangulate(mesh).triangles) peer.add_face(ids[t[0]], ids[t[1]], ids[t[2]]);
    const CGAL::Side_of_triangle_mesh<decltype(peer), Kernel> side(peer);
    const Occupancy ours = sample_inside(mesh, lattice, {}, RunContext()).value();
    std::array<std::size_t, 2> found = {};
    const auto [nx, ny, nz] = lattice.counts();
    for (std::size_t k = 0; k < nz; ++k)
        for (std::size_t j = 0; j < ny; ++j)
            for (std::size_t i = 0; i < nx; ++i) {
                const Vec3d p = lattice.point(i, j, k);
                const CGAL::Bounded_side answer = side(Kernel::Point_3(p.x(), p.y(), p.z()));
                found[1] += answer == CGAL::ON_BOUNDARY;
                if (answer != CGAL::ON_BOUNDARY)
                    found[0] += (answer == CGAL::ON_BOUNDED_SIDE) != ours.contains(i, j, k);
            }
    return found;
}

TEST(AgainstCgal, NoPointDiffersOffTheSurface) {
    for (Mesh mesh : {make_wavy_cube({.resolution = 12}), make_wavy_sphere({.resolution = 8}),
                      make_torus({.resolution = 8}), make_wavy_cube({.resolution = 8, .amplitude = 0})}) {
        const double h = bounds(mesh.positions).size().maxCoeff() / 16;
        for (int turn = 0; turn < 3; ++turn) {
            const Lattice lattice = make_lattice(bounds(mesh.positions), {.spacing = h}).value();
            EXPECT_EQ(compare(mesh, lattice)[0], 0u);
            const Eigen::AngleAxisf by(0.7f, Vec3f(1, 2, 3).normalized());
            for (Vec3f& p : mesh.positions) p = by * p;
        }
    }
}

TEST(AgainstCgal, NorWhereRaysRunThroughVerticesAndAlongEdges) {
    const Mesh cube = make_wavy_cube({.resolution = 8, .amplitude = 0}); // flat quads of a regular grid
    const Box box = bounds(cube.positions);
    const Lattice lattice = make_lattice(box, {.spacing = box.size().x() / 8, .origin = box.min}).value();
    const auto [different, on_surface] = compare(cube, lattice);
    EXPECT_EQ(different, 0u);
    EXPECT_GT(on_surface, 300u);
    EXPECT_EQ(sample_inside(cube, lattice, {}, RunContext())->count(), 512u); // half open: 8 x 8 x 8
}

} // namespace
} // namespace filigree

#endif
