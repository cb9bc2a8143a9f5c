#include "filigree/fracture/fracture.h"

#include "filigree/core/random.h"
#include "filigree/fracture/fracture_pattern.h"
#include "filigree/mesh/shapes.h"
#include "filigree/mesh/surface.h"
#include "filigree/mesh/topology.h"

#include <cstring>
#include <gtest/gtest.h>
#include <map>
#include <set>

namespace filigree {
namespace {

Mesh box_mesh(const Vec3d& lo, const Vec3d& hi) { return make_box(0.5 * (lo + hi), hi - lo); }

void append(Mesh& mesh, const Mesh& other, bool is_turned) {
    const Index first = static_cast<Index>(mesh.vertex_count());
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (std::size_t f = 0; f < other.face_count(); ++f) {
        std::vector<Index> corners(other.face(f).begin(), other.face(f).end());
        for (Index& c : corners) c += first;
        if (is_turned) std::reverse(corners.begin(), corners.end());
        mesh.add_face(corners);
    }
}

/// A ball whose triangles are of all sizes.
Mesh ball(std::size_t rings, std::uint64_t seed) {
    Mesh mesh;
    mesh.positions.emplace_back(0, 0, -1);
    const std::size_t sectors = 2 * rings;
    for (std::size_t r = 1; r < rings; ++r)
        for (std::size_t s = 0; s < sectors; ++s) {
            const double polar = 3.14159265 * double(r) / double(rings), turn = 6.2831853 * double(s) / double(sectors);
            const double radius = 1 + 0.3 * (random_unit(seed, r * sectors + s) - 0.5);
            mesh.positions.push_back(
                (radius * Vec3d(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), -std::cos(polar)))
                    .cast<float>());
        }
    mesh.positions.emplace_back(0, 0, 1);
    const Index top = static_cast<Index>(mesh.vertex_count() - 1);
    const auto at = [&](std::size_t r, std::size_t s) {
        return static_cast<Index>(1 + (r - 1) * sectors + s % sectors);
    };
    for (std::size_t s = 0; s < sectors; ++s) {
        mesh.add_face(std::array<Index, 3>{0, at(1, s + 1), at(1, s)});
        mesh.add_face(std::array<Index, 3>{top, at(rings - 1, s), at(rings - 1, s + 1)});
        for (std::size_t r = 1; r + 1 < rings; ++r)
            mesh.add_face(std::array<Index, 4>{at(r, s), at(r, s + 1), at(r + 1, s + 1), at(r + 1, s)});
    }
    return mesh;
}

/// What holds for every closed mesh and any seeds.
void expect_sound(const Mesh& mesh, const FracturedMesh& f) {
    ASSERT_EQ(check_mesh(f.mesh), "");
    EXPECT_EQ(f.report.open_edges, 0u);
    // Crack points on the surface are rounded to float: each moves by half a bit at most, and so does the surface.
    const double rounding = 0x1p-25 * std::sqrt(3.0) * bounds(mesh.positions).diagonal();
    EXPECT_LT(f.report.volume_error,
              1e-9 + rounding * analyse_topology(mesh, RunContext(1)).area / std::abs(f.report.volume));
    ASSERT_GE(f.mesh.vertex_count(), mesh.vertex_count());
    EXPECT_EQ(std::memcmp(f.mesh.positions.data(), mesh.positions.data(), mesh.vertex_count() * sizeof(Vec3f)), 0);
    // Closed by index, as written: a piece's faces cancel at every edge, and no vertex is of two pieces.
    std::map<std::pair<Index, Index>, int> edges;
    for (std::size_t k = 0; k < f.mesh.face_count(); ++k) {
        const auto face = f.mesh.face(k);
        for (std::size_t c = 0; c < face.size(); ++c) {
            EXPECT_EQ(f.piece_of_vertex[face[c]], f.piece_of_face[k]);
            const Index a = face[c], b = face[(c + 1) % face.size()];
            edges[std::minmax(a, b)] += a < b ? 1 : -1;
        }
    }
    std::size_t open = 0;
    for (const auto& [edge, sum] : edges) open += sum != 0;
    EXPECT_EQ(open, 0u);
}

FracturedMesh broken(const Mesh& mesh, std::span<const Vec3d> seeds, double roughness,
                     const FractureOptions& options = {}) {
    const Box box = bounds(mesh.positions);
    const CrackWarpOptions warp{.box = box, .roughness = roughness, .wavelength = 0.3 * box.diagonal()};
    const RunContext context(1);
    return fracture(mesh, FractureCells::create(seeds, {}, warp, context).value(), options, context).value();
}

std::vector<Vec3d> random_seeds(const Box& box, std::size_t count, std::uint64_t seed) {
    std::vector<Vec3d> seeds;
    for (std::size_t k = 0; k < count; ++k)
        seeds.push_back(box.min + box.size().cwiseProduct(Vec3d(random_unit(seed, 3 * k), random_unit(seed, 3 * k + 1),
                                                                random_unit(seed, 3 * k + 2))));
    return seeds;
}

std::vector<Vec3d> lattice_seeds(const Box& box, int side) {
    std::vector<Vec3d> seeds;
    for (int x = 0; x < side; ++x)
        for (int y = 0; y < side; ++y)
            for (int z = 0; z < side; ++z)
                seeds.push_back(box.min + box.size().cwiseProduct((Vec3d(x, y, z) + Vec3d::Constant(0.5)) / side));
    return seeds;
}

/// Random closed meshes and seeds, among them lattices of seeds over boxes, where cracks run through vertices, along
/// edges and in faces.
void break_random_cases(std::uint64_t first, std::uint64_t count) {
    for (std::uint64_t seed = first; seed < first + count; ++seed) {
        SCOPED_TRACE(seed);
        const auto pick = [&](std::uint64_t which, std::uint64_t below) {
            return random_bits(seed, 1000 + which) % below;
        };
        Mesh mesh;
        switch (pick(0, 5)) {
        case 0:
            mesh = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
            break;
        case 1: // hollow
            mesh = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
            append(mesh, box_mesh(Vec3d(-0.5, -0.5, -0.5), Vec3d(0.5, 0.5, 0.5)), true);
            break;
        case 2: // overlapping
            mesh = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
            append(mesh, box_mesh(Vec3d(0, 0, 0), Vec3d(2, 1.5, 1)), false);
            break;
        case 3:
            mesh = ball(3 + pick(1, 6), seed);
            break;
        default:
            mesh = box_mesh(Vec3d(0, 0, 0), Vec3d(4, 1, 1));
            break;
        }
        const Box box = bounds(mesh.positions);
        std::vector<Vec3d> seeds;
        switch (pick(2, 3)) {
        case 0:
            seeds = lattice_seeds(box, 1 + static_cast<int>(pick(3, 3)));
            break;
        case 1: // on vertices and half-way between them
            for (std::uint64_t k = 0; k < 2 + pick(3, 6); ++k) {
                const auto vertex = [&](std::uint64_t which) {
                    return mesh.positions[pick(which, mesh.vertex_count())].cast<double>().eval();
                };
                seeds.push_back(0.5 * (vertex(100 + 2 * k) + vertex(101 + 2 * k)));
            }
            break;
        default:
            seeds = random_seeds(box, 1 + pick(3, 12), seed);
            break;
        }
        const FracturedMesh f = broken(mesh, seeds, pick(4, 3) == 0 ? 0.8 : 0, {.edge = pick(5, 2) ? 0.7 : 0.0});
        expect_sound(mesh, f);
        EXPECT_EQ(f.report.fan_facets, 0u);
        if (::testing::Test::HasFailure()) return;
    }
}

TEST(Fracture, RandomCasesPart1) { break_random_cases(0, 2'500); }
TEST(Fracture, RandomCasesPart2) { break_random_cases(2'500, 2'500); }
TEST(Fracture, RandomCasesPart3) { break_random_cases(5'000, 2'500); }
TEST(Fracture, RandomCasesPart4) { break_random_cases(7'500, 2'500); }

TEST(Fracture, CubeInHalvesIsTwoBoxes) {
    const Mesh cube = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    const FracturedMesh f = broken(cube, std::vector<Vec3d>{{-0.5, 0, 0}, {0.5, 0, 0}}, 0, {.edge = 0});
    expect_sound(cube, f);
    ASSERT_EQ(f.pieces, 2u);
    EXPECT_NEAR(f.report.smallest, 4, 1e-6);
    EXPECT_NEAR(f.report.largest, 4, 1e-6);
    EXPECT_EQ(f.report.inside_faces, 6u); // four corners, and the middles of two quads' diagonals
    for (Index piece = 0; piece < 2; ++piece) {
        const TopologyReport topology = analyse_topology(piece_mesh(f, piece), RunContext{});
        EXPECT_TRUE(topology.is_closed() && topology.is_manifold() && topology.is_oriented());
        EXPECT_EQ(topology.euler, 2);
        EXPECT_NEAR(topology.volume, 4, 1e-6);
    }
}

TEST(Fracture, FacesThatNoCrackCrossesStayAsTheyWere) {
    const Mesh mesh = make_wavy_cube({});
    const FracturedMesh f = broken(mesh, random_seeds(bounds(mesh.positions), 6, 5), 0);
    std::set<std::vector<Index>> faces;
    for (std::size_t k = 0; k < f.mesh.face_count(); ++k) faces.insert({f.mesh.face(k).begin(), f.mesh.face(k).end()});
    std::size_t kept = 0;
    for (std::size_t k = 0; k < mesh.face_count(); ++k)
        kept += faces.contains({mesh.face(k).begin(), mesh.face(k).end()});
    EXPECT_GT(double(kept), 0.9 * double(mesh.face_count()));
}

} // namespace
} // namespace filigree
