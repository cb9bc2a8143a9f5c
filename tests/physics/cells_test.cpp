#include "filigree/physics/body.h"

#include "filigree/core/random.h"
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/physics/body/make_cells.h"
#include "io/corpus.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace filigree {
namespace {

void append(Mesh& mesh, const Mesh& other, const Vec3f& offset) {
    const auto first = Index(mesh.vertex_count());
    for (const Vec3f& p : other.positions) mesh.positions.push_back(p + offset);
    for (std::size_t f = 0; f < other.face_count(); ++f) {
        std::vector<Index> face(other.face(f).begin(), other.face(f).end());
        for (Index& v : face) v += first;
        mesh.add_face(face);
    }
}

/// Whether a point lies in a cell, or on one's border up to rounding.
bool is_covered(const Cells& cells, const Vec3d& point) {
    const Vec3d at = (point - cells.origin) / cells.spacing;
    for (int n = 0; n < 8; ++n) {
        const Vec3d nudge(n & 1 ? 1e-4 : -1e-4, n & 2 ? 1e-4 : -1e-4, n & 4 ? 1e-4 : -1e-4);
        const Vec3d index = (at + nudge).array().floor();
        if (cells.find_cell(int(index[0]), int(index[1]), int(index[2])) != kNoIndex) return true;
    }
    return false;
}

std::size_t uncovered_vertices(const Mesh& mesh, const Cells& cells, double scale = 1) {
    std::size_t count = 0;
    for (const Index vertex : mesh.corners) count += !is_covered(cells, mesh.positions[vertex].cast<double>() * scale);
    return count;
}

TEST(Cells, RunsCornersAndCellsAgreeOnRandomSets) {
    for (std::uint64_t set = 0; set < 60; ++set) {
        const double density = random_unit(7, set);
        const int side = 2 + int(set % 9);
        std::vector<Cells::LatticeIndex> indices;
        for (int n = 0; n < side * side * side; ++n)
            if (random_unit(set, std::uint64_t(n)) < density)
                indices.push_back({std::uint16_t(n / side / side), std::uint16_t(n / side % side),
                                   std::uint16_t(n % side)}); // not in their order
        const Cells cells = lattice_cells(indices, 0.5, Vec3d(1, 2, 3));
        ASSERT_EQ(cells.cells.size(), indices.size());

        const auto before = [](const Cells::LatticeIndex& a, const Cells::LatticeIndex& b) {
            return std::tie(a[2], a[1], a[0]) < std::tie(b[2], b[1], b[0]);
        };
        ASSERT_TRUE(std::is_sorted(cells.cells.begin(), cells.cells.end(), before));
        ASSERT_TRUE(std::is_sorted(cells.corners.begin(), cells.corners.end(), before));
        ASSERT_EQ(std::adjacent_find(cells.corners.begin(), cells.corners.end()), cells.corners.end());

        std::vector<int> used(cells.corners.size());
        for (std::size_t c = 0; c < cells.cells.size(); ++c) {
            const auto& cell = cells.cells[c];
            ASSERT_EQ(cells.find_cell(cell[0], cell[1], cell[2]), Index(c));
            for (unsigned n = 0; n < 8; ++n) {
                const Cells::LatticeIndex corner = {std::uint16_t(cell[0] + (n & 1)),
                                                    std::uint16_t(cell[1] + (n >> 1 & 1)),
                                                    std::uint16_t(cell[2] + (n >> 2))};
                ASSERT_EQ(cells.corners[cells.cell_corners[c][n]], corner);
                used[cells.cell_corners[c][n]] = 1;
            }
        }
        ASSERT_EQ(std::count(used.begin(), used.end(), 0), 0);

        Index next = 0;
        for (const Cells::Run& run : cells.runs) {
            ASSERT_EQ(run.first_cell, next);
            next += run.count;
            for (Index c = 0; c < run.count; ++c)
                for (unsigned n = 0; n < 8; ++n)
                    ASSERT_EQ(cells.cell_corners[run.first_cell + c][n], run.rows[n >> 1] + c + (n & 1));
            const auto& last = cells.cells[next - 1];
            ASSERT_EQ(cells.find_cell(last[0] + 1, last[1], last[2]), kNoIndex);
        }
        ASSERT_EQ(next, cells.cells.size());
    }
}

TEST(Cells, CellsThatAreNotThereAreNotFound) {
    const Cells cells = box_cells(3, 2, 4, 0.1);
    EXPECT_EQ(cells.find_cell(0, 0, 0), 0u);
    EXPECT_EQ(cells.find_cell(2, 1, 3), 23u);
    for (const auto& [i, j, k] : {std::array{-1, 0, 0}, {3, 0, 0}, {0, 2, 0}, {0, 0, 4}, {65536, 0, 0}, {0, 0, -70000}})
        EXPECT_EQ(cells.find_cell(i, j, k), kNoIndex);
}

TEST(Cells, GradientsOfAnAffineMotionAreItsMatrix) {
    Cells cells = box_cells(5, 4, 6, 0.1);
    for (std::size_t c = 0; c < cells.fraction.size(); ++c) cells.fraction[c] = float(0.1 + 0.9 * random_unit(3, c));
    Mat3f matrix;
    matrix << 1.2f, 0.3f, -0.1f, 0.5f, 0.8f, 0.2f, -0.3f, 0.1f, 1.5f;
    Vectors positions(cells.corners.size());
    for (std::size_t c = 0; c < cells.corners.size(); ++c) {
        const auto& corner = cells.corners[c];
        positions.set(c, matrix * Vec3f(corner[0] * 0.1f, corner[1] * 0.1f, corner[2] * 0.1f) + Vec3f(1, 2, 3));
    }
    std::vector<Mat3f> gradients(cells.corners.size());
    corner_gradients(cells, positions, gradients, kAllThreads);
    for (const Mat3f& gradient : gradients) EXPECT_LT((gradient - matrix).cwiseAbs().maxCoeff(), 2e-5f);
}

TEST(Cells, ABarIsFilledExactly) {
    const Mesh bar = make_bar({.resolution = 8, .size = 0.2, .length = 5});
    CellReport report;
    const auto cells = make_cells(bar, 1, {.spacing = 0.05}, kAllThreads, &report);
    ASSERT_TRUE(cells) << cells.error().message;
    EXPECT_EQ(cells->cells.size(), 20u * 4 * 4);
    EXPECT_EQ(cells->corners.size(), 21u * 5 * 5);
    EXPECT_EQ(report.whole_cells, 320u);
    EXPECT_EQ(report.added_cells, 0u);
    EXPECT_EQ(report.thin_cells, 0u);
    EXPECT_NEAR(report.volume, 0.04, 1e-12);
    EXPECT_LT((cells->origin - Vec3d(-0.5, -0.1, -0.1)).norm(), 1e-7);
    EXPECT_LT((cells->centroid[0] - Vec3f(-0.475f, -0.075f, -0.075f)).norm(), 1e-6f);
    // The same in millimetres.
    const Mesh large = make_bar({.resolution = 8, .size = 200, .length = 5});
    EXPECT_EQ(make_cells(large, 1e-3, {.spacing = 0.05}, kAllThreads)->cells, cells->cells);
}

TEST(Cells, SpacingComesFromTheCountAndFitsTheShortestSide) {
    const Mesh bar = make_bar({.resolution = 8, .size = 0.2, .length = 5});
    const Mesh sphere = make_wavy_sphere({.resolution = 24});
    for (const std::size_t count : {600u, 3000u, 20000u}) {
        for (const Mesh* mesh : {&bar, &sphere}) {
            const auto cells = make_cells(*mesh, 2, {.count = count}, kAllThreads);
            ASSERT_TRUE(cells) << cells.error().message;
            EXPECT_NEAR(double(cells->cells.size()) / double(count), 1, 0.16);
        }
        const auto cells = make_cells(bar, 2, {.count = count}, kAllThreads);
        const double across = 0.4 / cells->spacing;
        EXPECT_NEAR(across, std::round(across), 1e-5);
    }
    EXPECT_EQ(make_cells(sphere, 1, {.count = 1}, kAllThreads)->cells.size(), 1u);
}

TEST(Cells, VolumeIsTheMeshsOwn) {
    CellReport report;
    const double pi = 3.14159265358979;
    const Mesh sphere = make_wavy_sphere({.resolution = 64, .amplitude = 0});
    ASSERT_TRUE(make_cells(sphere, 3, {.count = 30000}, kAllThreads, &report));
    EXPECT_NEAR(report.volume / (27 * pi / 6), 1, 0.01);
}

TEST(Cells, AThinSheetIsCoveredWithoutHoles) {
    const Mesh plane = make_wavy_plane({.resolution = 3, .amplitude = 0}); // triangles much larger than cells
    CellReport report;
    const auto cells = make_cells(plane, 1, {.spacing = 0.05}, kAllThreads, &report);
    ASSERT_TRUE(cells) << cells.error().message;
    EXPECT_EQ(cells->cells.size(), 400u);
    EXPECT_EQ(report.thin_cells, 400u);
}

TEST(Cells, SmallLoosePartsAreLeftOut) {
    Mesh mesh = make_wavy_cube({.resolution = 8, .amplitude = 0});
    append(mesh, make_wavy_cube({.resolution = 2, .amplitude = 0, .size = 0.1}), Vec3f(3, 0, 0));
    append(mesh, make_wavy_cube({.resolution = 2, .amplitude = 0, .size = 0.6}), Vec3f(0, 3, 0));
    CellReport report;
    const auto cells = make_cells(mesh, 1, {.spacing = 0.1}, kAllThreads, &report);
    ASSERT_TRUE(cells) << cells.error().message;
    EXPECT_EQ(report.loose_parts, 1u);
    EXPECT_FALSE(is_covered(*cells, Vec3d(3, 0, 0)));
    EXPECT_TRUE(is_covered(*cells, Vec3d(0, 3, 0)));
}

TEST(Cells, EveryVertexOfTheCorpusLiesInACell) {
    std::size_t meshes = 0;
    for (const auto& row : filigree_test::read_corpus()) {
        const std::string name = row.path.filename().string();
        if (name != "koala_100k.obj" && name != "plane_holes.obj" && name != "sword_quad_dominant.obj" &&
            name != "mountain_open.obj" && name != "penguin.obj" && name != "featuretype.STL")
            continue;
        const auto read = read_mesh(row.path, kAllThreads);
        ASSERT_TRUE(read) << read.error().message;
        ++meshes;
        CellReport report;
        const auto cells = make_cells(read->mesh, 1, {.count = 1500}, kAllThreads, &report);
        ASSERT_TRUE(cells) << name << ": " << cells.error().message;
        EXPECT_EQ(report.loose_parts, 0u) << name;
        EXPECT_EQ(uncovered_vertices(read->mesh, *cells), 0u) << name;
        EXPECT_NEAR(double(cells->cells.size()) / 1500, 1, 0.16) << name;
    }
    if (meshes == 0) GTEST_SKIP() << "no corpus";
}

TEST(Cells, ThreadsDoNotMatter) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh sphere = make_wavy_sphere({.resolution = 20});
    const Cells one = *make_cells(sphere, 1, {.count = 3000}, RunContext(1));
    const Cells two = *make_cells(sphere, 1, {.count = 3000}, RunContext(2));
    EXPECT_EQ(one.spacing, two.spacing);
    EXPECT_EQ(one.cells, two.cells);
    EXPECT_EQ(one.fraction, two.fraction);
    EXPECT_EQ(one.centroid, two.centroid);

    Vectors positions(one.corners.size());
    for (std::size_t c = 0; c < positions.size(); ++c)
        positions.set(c, Vec3f(float(random_unit(1, c)), float(random_unit(2, c)), float(random_unit(3, c))));
    std::vector<Mat3f> a(positions.size()), b(positions.size());
    corner_gradients(one, positions, a, RunContext(1));
    corner_gradients(one, positions, b, RunContext(2));
    EXPECT_EQ(a, b);
}

TEST(Cells, BadRequestsAreRefused) {
    const Mesh cube = make_wavy_cube({.resolution = 4});
    const auto code = [&](const Mesh& mesh, double scale, const CellOptions& options) {
        const auto cells = make_cells(mesh, scale, options, kAllThreads);
        return cells ? ErrorCode{} : cells.error().code;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(code(cube, 0, {}), ErrorCode::usage);
    EXPECT_EQ(code(cube, -1, {}), ErrorCode::usage);
    EXPECT_EQ(code(cube, nan, {}), ErrorCode::usage);
    EXPECT_EQ(code(cube, 1e300, {}), ErrorCode::usage);
    EXPECT_EQ(code(cube, 1, {.spacing = -0.1}), ErrorCode::usage);
    EXPECT_EQ(code(cube, 1, {.spacing = nan}), ErrorCode::usage);
    EXPECT_EQ(code(cube, 1, {.spacing = 5}), ErrorCode::usage);
    EXPECT_EQ(code(cube, 1, {.count = 0}), ErrorCode::usage);
    EXPECT_EQ(code(cube, 1, {.spacing = 1e-5}), ErrorCode::unsuitable);
    EXPECT_EQ(code(Mesh{}, 1, {}), ErrorCode::unsuitable);
    Mesh point;
    point.positions.assign(3, Vec3f(1, 2, 3));
    point.add_face(std::array<Index, 3>{0, 1, 2});
    EXPECT_EQ(code(point, 1, {}), ErrorCode::unsuitable);

    const RunContext cancelled;
    cancelled.cancel();
    const auto cells = make_cells(cube, 1, {}, cancelled);
    ASSERT_FALSE(cells);
    EXPECT_EQ(cells.error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
