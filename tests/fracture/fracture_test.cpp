#include "filigree/fracture.h"

#include "cases.h"
#include "filigree/core/random.h"
#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"
#include "filigree/mesh/surface.h"

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

double area_of(const Mesh& mesh) {
    double sum = 0;
    for (const Triangle& t : triangulate(mesh).triangles) sum += 0.5 * doubled_area_vector(mesh.positions, t).norm();
    return sum;
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
                     const FractureOptions& options = {}, double wavelength = 0.3) {
    const Box box = bounds(mesh.positions);
    const CrackWarpOptions warp{.box = box, .roughness = roughness, .wavelength = wavelength * box.diagonal()};
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

/// Cells made pieces together by chance, whether they touch or not.
std::vector<Index> random_clumps(std::size_t cells, std::uint64_t seed) {
    std::vector<Index> piece(cells), number(cells, kNoIndex);
    Index pieces = 0;
    for (std::size_t c = 0; c < cells; ++c) {
        Index& of = number[random_bits(seed, c) % (1 + cells / 3)];
        if (of == kNoIndex) of = pieces++;
        piece[c] = of;
    }
    return piece;
}

/// Random closed meshes and seeds, among them lattices of seeds over boxes, where cracks run through vertices, along
/// edges and in faces.
TEST(Fracture, RandomCases) {
    const std::uint64_t count = all_cases() ? 10'000 : 1'250;
    for (std::uint64_t seed = 0; seed < count; ++seed) {
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
        const FracturedMesh f = broken(mesh, seeds, pick(4, 3) == 0 ? 0.8 : 0, {.edge = pick(5, 2) ? 0.7 : 0.0}, 0.8);
        expect_sound(mesh, f);
        EXPECT_EQ(f.report.fan_facets, 0u);
        if (pick(6, 4) == 0) {
            const RunContext context(1);
            FractureCells cells = FractureCells::create(seeds, {}, {.box = box}, context).value();
            ASSERT_TRUE(cells.merge(random_clumps(seeds.size(), seed)).ok());
            const FracturedMesh clumps = fracture(mesh, cells, {}, context).value();
            expect_sound(mesh, clumps);
            EXPECT_LE(clumps.pieces - clumps.report.islands, cells.pieces());
        }
        if (::testing::Test::HasFailure()) return;
    }
}

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

/// A strip of two quads with UVs, a colour ramp and one corner that has another normal.
Mesh decorated_box() {
    Mesh mesh = box_mesh(Vec3d(0, 0, 0), Vec3d(2, 1, 1));
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) {
        const Vec3f& p = mesh.positions[mesh.corners[c]];
        mesh.uvs.corners.push_back(static_cast<Index>(c));
        mesh.uvs.values.emplace_back(3 * p[0] + p[1], p[2] - p[1]);
    }
    for (const Vec3f& p : mesh.positions) mesh.colors.emplace_back(p[0] / 2, p[1], p[2], 1);
    mesh.scalars.push_back({"height", {}});
    for (const Vec3f& p : mesh.positions) mesh.scalars[0].values.push_back(p[0] + 10 * p[2]);
    mesh.materials.names = {"skin"};
    mesh.materials.of_face.assign(mesh.face_count(), 0);
    return mesh;
}

TEST(Fracture, AttributesAreThoseOfTheSurface) {
    const Mesh mesh = decorated_box();
    const FracturedMesh f = broken(mesh, random_seeds(bounds(mesh.positions), 7, 3), 0);
    expect_sound(mesh, f);
    std::size_t inside = 0;
    for (std::size_t k = 0; k < f.mesh.face_count(); ++k) {
        inside += f.is_inside[k];
        EXPECT_EQ(f.mesh.materials.of_face[k], f.is_inside[k]); // "skin", and "inside" behind it
        if (f.is_inside[k]) continue;
        for (Index c = f.mesh.face_offsets[k]; c < f.mesh.face_offsets[k + 1]; ++c) {
            const Vec3f& p = f.mesh.positions[f.mesh.corners[c]];
            const Vec2f uv = f.mesh.uvs.values[f.mesh.uvs.corners[c]];
            EXPECT_NEAR(uv[0], 3 * p[0] + p[1], 1e-5);
            EXPECT_NEAR(uv[1], p[2] - p[1], 1e-5);
            EXPECT_NEAR(f.mesh.colors[f.mesh.corners[c]][0], p[0] / 2, 1e-5);
            EXPECT_NEAR(f.mesh.scalars[0].values[f.mesh.corners[c]], p[0] + 10 * p[2], 1e-4);
        }
    }
    EXPECT_EQ(inside, 2 * f.report.inside_faces);
    EXPECT_EQ(f.mesh.materials.names, (std::vector<std::string>{"skin", "inside"}));
    EXPECT_EQ(f.mesh.scalars.back().name, "piece");
}

TEST(Fracture, CracksAreMeasuredInModelUnits) {
    const Mesh cube = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    const FracturedMesh f = broken(cube, std::vector<Vec3d>{{-0.5, 0, 0}, {0.5, 0, 0}}, 0, {.edge = 0.3});
    double area = 0, uv_area = 0;
    for (std::size_t k = 0; k < f.mesh.face_count(); ++k) {
        if (!f.is_inside[k]) continue;
        const Index c = f.mesh.face_offsets[k];
        const auto at = [&](Index n) { return f.mesh.positions[f.mesh.corners[c + n]]; };
        const auto uv = [&](Index n) { return f.mesh.uvs.values[f.mesh.uvs.corners[c + n]]; };
        const Vec3f cross = (at(1) - at(0)).cross(at(2) - at(0));
        area += 0.5 * double(cross.norm());
        const Vec2f a = uv(1) - uv(0), b = uv(2) - uv(0);
        uv_area += 0.5 * std::abs(double(a[0] * b[1] - a[1] * b[0]));
        const Vec3f normal = f.mesh.normals.values[f.mesh.normals.corners[c]];
        EXPECT_GT(normal.dot(cross.normalized()), 0.999f); // out of the piece
    }
    EXPECT_NEAR(area, 8, 1e-4); // both sides
    EXPECT_NEAR(uv_area, 8, 1e-4);
}

TEST(Fracture, OpenBordersStayOpenAndNothingElseIs) {
    Mesh mesh = make_wavy_sphere({.resolution = 24});
    Mesh holed = mesh;
    holed.face_offsets = {0};
    holed.corners.clear();
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        if (f % 97 != 0) holed.add_face(mesh.face(f));
    const FracturedMesh f = broken(holed, random_seeds(bounds(mesh.positions), 8, 3), 0.5);
    EXPECT_EQ(f.report.open_edges, 0u);
    EXPECT_GT(f.report.closing_triangles, 0u);
    EXPECT_FALSE(f.report.is_sheet);
    double surface = 0;
    for (std::size_t k = 0; k < f.mesh.face_count(); ++k)
        if (!f.is_inside[k]) surface += 0.5 * doubled_area_vector(f.mesh.positions, f.mesh.face(k)).norm();
    EXPECT_NEAR(surface / analyse_topology(holed, RunContext(1)).area, 1, 2e-3); // cones are not in it
}

TEST(Fracture, SheetsBreakIntoPartsOfTheirSurface) {
    const Mesh plane = make_wavy_plane({.resolution = 32});
    const FracturedMesh f = broken(plane, random_seeds(bounds(plane.positions), 9, 3), 0);
    EXPECT_TRUE(f.report.is_sheet);
    EXPECT_EQ(f.report.inside_faces, 0u);
    EXPECT_GE(f.pieces, 7u);
    EXPECT_NEAR(area_of(f.mesh) / area_of(plane), 1, 1e-5);
    std::vector<double> areas(f.pieces, 0); // which stand for the volumes that sheets do not have
    for (std::size_t k = 0; k < f.mesh.face_count(); ++k)
        for (Index c = 1; c + 1 < f.mesh.face_size(k); ++c) {
            const auto face = f.mesh.face(k);
            const std::array<Index, 3> fan = {face[0], face[c], face[c + 1]};
            areas[f.piece_of_face[k]] += 0.5 * doubled_area_vector(f.mesh.positions, fan).norm();
        }
    std::ranges::sort(areas);
    EXPECT_GT(areas.front(), 0); // no piece without faces
    EXPECT_NEAR(f.report.smallest / areas.front(), 1, 1e-2);
    EXPECT_NEAR(f.report.median / areas[areas.size() / 2], 1, 1e-2);
    EXPECT_NEAR(f.report.largest / areas.back(), 1, 1e-2);
}

TEST(Fracture, IslandsArePiecesAndSplintersAreNot) {
    Mesh mesh = box_mesh(Vec3d(0, 0, 0), Vec3d(1, 1, 1)); // two bodies in one cell
    append(mesh, box_mesh(Vec3d(3, 0, 0), Vec3d(4, 1, 1)), false);
    const std::vector<Vec3d> one = {{2, 0.5, 0.5}};
    EXPECT_EQ(broken(mesh, one, 0).pieces, 2u);
    EXPECT_EQ(broken(mesh, one, 0, {.pieces_are_cells = true}).pieces, 1u);
    // A cell that cuts a corner off, of a ten-thousandth of the volume.
    const Mesh cube = box_mesh(Vec3d(0, 0, 0), Vec3d(1, 1, 1));
    const std::vector<Vec3d> corner = {{0.95, 0.95, 0.95}, {0.998, 0.998, 0.998}};
    const FracturedMesh whole = broken(cube, corner, 0);
    EXPECT_EQ(whole.pieces, 1u);
    EXPECT_EQ(whole.report.joined, 1u);
    EXPECT_EQ(whole.report.inside_faces, 0u);
    expect_sound(cube, whole);
    EXPECT_EQ(broken(cube, corner, 0, {.smallest = 0}).pieces, 2u);
    // Whichever corner is cut off, so also one that is the first of all parts.
    for (int k = 0; k < 8; ++k) {
        const Vec3d way(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1), middle(0.5, 0.5, 0.5);
        EXPECT_EQ(broken(cube, std::vector<Vec3d>{middle + 0.45 * way, middle + 0.498 * way}, 0).pieces, 1u);
    }
}

// Slabs of 3, 6 and 91 parts in a hundred: the first two together are still too small.
TEST(Fracture, SplintersThatJoinAreOneSplinter) {
    const Mesh cube = box_mesh(Vec3d(0, 0, 0), Vec3d(1, 1, 1));
    std::vector<double> along = {0.01, 0.05, 0.13};
    do {
        std::vector<Vec3d> seeds;
        for (const double x : along) seeds.emplace_back(x, 0.5, 0.5);
        const FracturedMesh whole = broken(cube, seeds, 0, {.smallest = 0.3});
        EXPECT_EQ(whole.pieces, 1u);
        EXPECT_EQ(whole.report.joined, 2u);
        EXPECT_EQ(broken(cube, seeds, 0, {.smallest = 0.25}).pieces, 2u);
    } while (std::ranges::next_permutation(along).found);
}

TEST(Fracture, ThreadsDoNotMatter) {
    const Mesh mesh = make_wavy_sphere({.resolution = 48});
    const auto run = [&](unsigned threads) {
        RunContext context(threads);
        const FractureCells cells = make_fracture_cells(mesh, {.pieces = 25}, context).value();
        return fracture(mesh, cells, {}, context).value();
    };
    const FracturedMesh one = run(1), two = run(2);
    EXPECT_TRUE(one.mesh.positions == two.mesh.positions);
    EXPECT_TRUE(one.mesh.corners == two.mesh.corners);
    EXPECT_TRUE(one.piece_of_face == two.piece_of_face);
}

TEST(Fracture, ExplodeMovesWholePieces) {
    const Mesh cube = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    FracturedMesh f = broken(cube, std::vector<Vec3d>{{-0.5, 0, 0}, {0.5, 0, 0}}, 0, {.edge = 0});
    explode(f, 1);
    EXPECT_NEAR(bounds(f.mesh.positions).size()[0], 3, 1e-6); // their middles were half a unit from the whole's
    for (Index piece = 0; piece < 2; ++piece) EXPECT_NEAR(bounds(piece_mesh(f, piece).positions).size()[0], 1, 1e-6);
}

TEST(FracturePattern, EvenPiecesAreOfOneSize) {
    const Mesh cube = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    const RunContext context(1);
    for (const Index pieces : {1u, 2u, 40u}) {
        const FracturedMesh f =
            fracture(cube, make_fracture_cells(cube, {.pieces = pieces}, context).value(), {}, context).value();
        EXPECT_EQ(f.pieces, pieces);
        EXPECT_EQ(f.report.islands, 0u);
        EXPECT_GT(f.report.smallest, 0.3 * f.report.median);
        EXPECT_LT(f.report.largest, 2.5 * f.report.median);
        expect_sound(cube, f);
    }
}

/// Volumes of pieces, ascending.
std::vector<double> volumes_of(const FracturedMesh& f) {
    std::vector<double> volumes;
    for (Index piece = 0; piece < f.pieces; ++piece)
        volumes.push_back(analyse_topology(piece_mesh(f, piece), RunContext(1)).volume);
    std::sort(volumes.begin(), volumes.end());
    return volumes;
}

TEST(FracturePattern, GrainsAreSmallHereAndLargeThere) {
    const Mesh cube = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    const RunContext context(1);
    const auto broken = [&](FracturePatternKind kind) {
        return fracture(cube, make_fracture_cells(cube, {.kind = kind, .pieces = 100}, context).value(), {}, context)
            .value();
    };
    const FracturedMesh grains = broken(FracturePatternKind::grains), even = broken(FracturePatternKind::even);
    expect_sound(cube, grains);
    EXPECT_EQ(grains.pieces, 100u);
    const auto spread = [](const FracturedMesh& f) { // of the tenth largest and the tenth smallest
        const std::vector<double> v = volumes_of(f);
        return v[90] / v[9];
    };
    EXPECT_GT(spread(grains), 2.5 * spread(even));
    EXPECT_LT(spread(grains), 60); // e^4
    // Small ones have small neighbours: of a piece's two nearest, sizes go together.
    std::vector<std::pair<Vec3d, double>> pieces;
    for (Index piece = 0; piece < grains.pieces; ++piece) {
        const Mesh mesh = piece_mesh(grains, piece);
        pieces.emplace_back(bounds(mesh.positions).centre(), std::log(analyse_topology(mesh, context).volume));
    }
    double mean = 0, together = 0, apart = 0;
    for (const auto& [centre, size] : pieces) mean += size / double(pieces.size());
    for (const auto& [centre, size] : pieces) {
        const auto* nearest = &pieces[0];
        for (const auto& other : pieces)
            if (other.first != centre &&
                ((other.first - centre).norm() < (nearest->first - centre).norm() || nearest->first == centre))
                nearest = &other;
        together += (size - mean) * (nearest->second - mean);
        apart += (size - mean) * (size - mean);
    }
    EXPECT_GT(together, 0.2 * apart);
}

TEST(FracturePattern, ClumpsAreCellsThatTouch) {
    const RunContext context(1);
    for (const double roughness : {0.0, 0.5})
        for (const FracturePatternKind kind : {FracturePatternKind::even, FracturePatternKind::grains,
                                               FracturePatternKind::slabs, FracturePatternKind::impact}) {
            const Mesh cube = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
            const FracturePattern pattern{.kind = kind, .pieces = 12, .clump = 5, .roughness = roughness};
            const FractureCells cells = make_fracture_cells(cube, pattern, context).value();
            EXPECT_EQ(cells.pieces(), 12u);
            EXPECT_EQ(cells.count(), 60u);
            std::vector<Index> cells_of(12, 0);
            for (Index c = 0; c < cells.count(); ++c) ++cells_of[cells.piece_of(c)];
            EXPECT_GE(*std::min_element(cells_of.begin(), cells_of.end()), 2u);
            EXPECT_LE(*std::max_element(cells_of.begin(), cells_of.end()), 15u);
            const FractureOptions all{.smallest = 0}; // where it was hit clumps are small
            const FracturedMesh f = fracture(cube, cells, all, context).value();
            EXPECT_EQ(f.pieces, 12u);
            EXPECT_EQ(f.report.islands, 0u);
            expect_sound(cube, f);
            for (const auto& [i, j] : f.cells_of_crack) EXPECT_NE(cells.piece_of(i), cells.piece_of(j));
            const FracturedMesh again =
                fracture(cube, make_fracture_cells(cube, pattern, RunContext(2)).value(), all, RunContext(2)).value();
            EXPECT_EQ(again.mesh.positions, f.mesh.positions);
            EXPECT_EQ(again.mesh.corners, f.mesh.corners);
        }
}

TEST(FracturePattern, ClumpsDoNotReachAcrossGaps) {
    Mesh mesh = box_mesh(Vec3d(-1, -1, -1), Vec3d(-0.05, 1, 1));
    append(mesh, box_mesh(Vec3d(0.05, -1, -1), Vec3d(1, 1, 1)), false);
    const RunContext context(1);
    const FractureCells cells = make_fracture_cells(mesh, {.pieces = 6, .clump = 8}, context).value();
    const FracturedMesh f = fracture(mesh, cells, {}, context).value();
    EXPECT_EQ(f.pieces, 6u + f.report.islands);
    expect_sound(mesh, f);
    for (Index piece = 0; piece < f.pieces; ++piece) {
        const Box box = bounds(piece_mesh(f, piece).positions);
        EXPECT_TRUE(box.max.x() < 0 || box.min.x() > 0) << piece;
    }
}

TEST(FracturePattern, WhatIsInsideOutBreaksAlike) {
    const RunContext context(1);
    const auto breaks = [&](const Mesh& mesh, Index pieces) {
        const FracturedMesh f =
            fracture(mesh, make_fracture_cells(mesh, {.pieces = pieces}, context).value(), {}, context).value();
        EXPECT_EQ(f.pieces, pieces + f.report.islands);
        EXPECT_LT(f.report.volume_error, 1e-6);
        EXPECT_GT(f.report.smallest, 0.1 * f.report.median);
        EXPECT_EQ(f.report.open_edges, 0u);
        return f.pieces;
    };
    Mesh turned;
    append(turned, box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1)), true);
    EXPECT_EQ(breaks(turned, 6), 6u);
    Mesh both = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    append(both, box_mesh(Vec3d(2, -1, -1), Vec3d(4, 1, 1)), true);
    EXPECT_GE(breaks(both, 6), 6u);
    Mesh hollow; // all of it inside out, the cavity too
    append(hollow, box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1)), true);
    append(hollow, box_mesh(Vec3d(-0.1, -0.1, -0.1), Vec3d(0.1, 0.1, 0.1)), false);
    EXPECT_EQ(breaks(hollow, 1), 1u) << "the cavity goes along with what is around it";
}

TEST(FracturePattern, PartsApartAreNoPiece) {
    Mesh mesh;
    for (int n = 0; n < 64; ++n) {
        const Vec3d at(n % 4, n / 4 % 4, n / 16);
        append(mesh, box_mesh(at, at + Vec3d::Constant(0.5)), false);
    }
    const RunContext context(1);
    for (const double roughness : {0.0, 0.5}) {
        const FracturePattern pattern{.pieces = 6, .roughness = roughness};
        const FracturedMesh f =
            fracture(mesh, make_fracture_cells(mesh, pattern, context).value(), {}, context).value();
        EXPECT_GE(f.pieces, 64u);
        expect_sound(mesh, f);
        for (Index piece = 0; piece < f.pieces; ++piece)
            EXPECT_LT(bounds(piece_mesh(f, piece)).size().maxCoeff(), 0.51) << piece;
    }
}

TEST(FracturePattern, ImpactBreaksSmallWhereItHit) {
    const Mesh cube = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    const RunContext context(1);
    const Vec3d hit(1, 1, 1);
    const FracturedMesh f =
        fracture(cube,
                 make_fracture_cells(cube, {.kind = FracturePatternKind::impact, .pieces = 40, .at = {hit}}, context)
                     .value(),
                 {}, context)
            .value();
    std::size_t near = 0;
    for (Index piece = 0; piece < f.pieces; ++piece) {
        const Box box = bounds(piece_mesh(f, piece).positions);
        near += (box.centre() - hit).norm() < 1;
    }
    EXPECT_GT(near, f.pieces / 2); // in an eighth of the volume
}

TEST(FracturePattern, SlabsAreLongAlongTheGrain) {
    const Mesh cube = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    const RunContext context(1);
    const FracturedMesh f =
        fracture(cube,
                 make_fracture_cells(cube, {.kind = FracturePatternKind::slabs, .pieces = 30, .grain = Vec3d(0, 2, 0)},
                                     context)
                     .value(),
                 {}, context)
            .value();
    Vec3d sum = Vec3d::Zero();
    for (Index piece = 0; piece < f.pieces; ++piece) sum += bounds(piece_mesh(f, piece).positions).size();
    EXPECT_GT(sum[1], 2.5 * sum[0]);
    EXPECT_GT(sum[1], 2.5 * sum[2]);
}

TEST(FracturePattern, RaysOfGlassGoThroughItsThickness) {
    const Mesh plate = box_mesh(Vec3d(-1, -1, -0.02), Vec3d(1, 1, 0.02));
    const RunContext context(1);
    const FracturedMesh f =
        fracture(
            plate,
            make_fracture_cells(plate, {.kind = FracturePatternKind::radial, .pieces = 30, .roughness = 0}, context)
                .value(),
            {}, context)
            .value();
    EXPECT_GE(f.pieces, 30u);
    for (Index piece = 0; piece < f.pieces; ++piece)
        EXPECT_NEAR(bounds(piece_mesh(f, piece).positions).size()[2], 0.04, 1e-5);
}

TEST(FracturePattern, RefusesWhatMakesNoSense) {
    const Mesh cube = box_mesh(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    const RunContext context(1);
    const auto code = [&](const FracturePattern& pattern) {
        return make_fracture_cells(cube, pattern, context).error().code;
    };
    EXPECT_EQ(code({.pieces = 0}), ErrorCode::usage);
    EXPECT_EQ(code({.clump = 0}), ErrorCode::usage);
    EXPECT_EQ(code({.clump = 101}), ErrorCode::usage);
    EXPECT_EQ(code({.pieces = 50'000, .clump = 3}), ErrorCode::usage);
    EXPECT_EQ(code({.roughness = 1.5}), ErrorCode::usage);
    EXPECT_EQ(code({.at = {Vec3d(NAN, 0, 0)}}), ErrorCode::usage);
    EXPECT_EQ(code({.kind = FracturePatternKind::slabs, .grain = Vec3d::Zero()}), ErrorCode::usage);
    EXPECT_EQ(make_fracture_cells(Mesh{}, {}, context).error().code, ErrorCode::unsuitable);
}

} // namespace
} // namespace filigree
