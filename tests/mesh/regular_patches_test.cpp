#include "filigree/file.h"
#include "filigree/mesh.h"

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <gtest/gtest.h>
#include <map>
#include <numeric>
#include <random>
#include <set>

namespace filigree {
namespace {

/// The same surface with vertices and faces in any order, and each face starting anywhere.
Mesh shuffled(const Mesh& mesh, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<Index> vertex(mesh.vertex_count()), face(mesh.face_count());
    std::iota(vertex.begin(), vertex.end(), Index{0});
    std::iota(face.begin(), face.end(), Index{0});
    std::shuffle(vertex.begin(), vertex.end(), random);
    std::shuffle(face.begin(), face.end(), random);
    Mesh result;
    result.positions.resize(mesh.vertex_count());
    for (std::size_t v = 0; v < vertex.size(); ++v) result.positions[vertex[v]] = mesh.positions[v];
    for (const Index f : face) {
        std::array<Index, 4> corners;
        for (unsigned c = 0; c < 4; ++c) corners[c] = vertex[mesh.face(f)[c]];
        std::rotate(corners.begin(), corners.begin() + random() % 4, corners.end());
        result.add_face(corners);
    }
    return result;
}

std::array<Index, 4> sorted(std::span<const Index> quad) {
    std::array<Index, 4> result;
    std::copy(quad.begin(), quad.end(), result.begin());
    std::rotate(result.begin(), std::min_element(result.begin(), result.end()), result.end());
    return result;
}

/// Every face of the mesh is a cell of the grids, turned the same way round, exactly once.
void expect_grids_are_the_mesh(const Mesh& mesh, const RegularPatches& patches) {
    std::multiset<std::array<Index, 4>> faces, cells;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) faces.insert(sorted(mesh.face(f)));
    const std::size_t n = patches.side();
    ASSERT_EQ(patches.grid.size(), patches.patch_count() * (n + 1) * (n + 1));
    for (std::size_t p = 0; p < patches.patch_count(); ++p) {
        const std::array<Index, 4> corners = {patches.at(p, 0, 0), patches.at(p, n, 0), patches.at(p, n, n),
                                              patches.at(p, 0, n)};
        EXPECT_EQ(patches.base[p], corners);
        for (std::size_t j = 0; j < n; ++j)
            for (std::size_t i = 0; i < n; ++i)
                cells.insert(sorted(std::array{patches.at(p, i, j), patches.at(p, i + 1, j),
                                               patches.at(p, i + 1, j + 1), patches.at(p, i, j + 1)}));
    }
    EXPECT_TRUE(faces == cells);
}

struct Case {
    const char* name;
    Mesh mesh;
    unsigned levels;
    std::size_t patches;
};

std::vector<Case> cases() {
    return {{"cube", make_wavy_cube({.resolution = 32}), 5, 6},
            {"cube 3 * 2^3", make_wavy_cube({.resolution = 24}), 3, 6 * 9},
            {"sphere", make_wavy_sphere({.resolution = 16}), 4, 6},
            {"plane", make_wavy_plane({.resolution = 16}), 4, 1},
            {"plane 12", make_wavy_plane({.resolution = 12}), 2, 9},
            {"bar", make_bar({.resolution = 8, .length = 3}), 3, 14},
            {"cylinder", make_cylinder({.resolution = 8, .length = 2}), 3, 10},
            {"torus", make_torus({.resolution = 24}), 3, 18}};
}

TEST(RegularPatches, FindsTheLevelsOfShapesInAnyOrder) {
    for (const Case& c : cases())
        for (const unsigned seed : {0u, 1u, 2u}) {
            SCOPED_TRACE(std::string(c.name) + ", seed " + std::to_string(seed));
            const Mesh mesh = seed == 0 ? c.mesh : shuffled(c.mesh, seed);
            const auto patches = find_regular_patches(mesh, 16, RunContext(1));
            ASSERT_TRUE(patches.ok()) << patches.error().message;
            EXPECT_EQ(patches->levels, c.levels);
            EXPECT_EQ(patches->patch_count(), c.patches);
            expect_grids_are_the_mesh(mesh, *patches);
        }
}

TEST(RegularPatches, StopsAtMaxLevels) {
    const Mesh mesh = make_wavy_cube({.resolution = 16});
    const auto patches = find_regular_patches(mesh, 2, RunContext(1));
    ASSERT_TRUE(patches.ok());
    EXPECT_EQ(patches->levels, 2u);
    EXPECT_EQ(patches->patch_count(), 6u * 16);
    expect_grids_are_the_mesh(mesh, *patches);
    EXPECT_EQ(find_regular_patches(mesh, 0, RunContext(1)).error().code, ErrorCode::usage);
}

TEST(RegularPatches, KeepsVertexZeroWhereItCan) {
    for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) { // a torus leaves the choice among four
        const Mesh mesh = shuffled(make_torus({.resolution = 8}), seed);
        const auto patches = find_regular_patches(mesh, 16, RunContext(1));
        ASSERT_TRUE(patches.ok());
        const bool kept = std::any_of(patches->base.begin(), patches->base.end(), [](const auto& quad) {
            return std::find(quad.begin(), quad.end(), Index{0}) != quad.end();
        });
        EXPECT_TRUE(kept) << seed;
    }
}

TEST(RegularPatches, TakesTheLevelsThatAllComponentsHave) {
    Mesh mesh = make_wavy_cube({.resolution = 16});
    const Mesh other = make_wavy_plane({.resolution = 4});
    const Index first = static_cast<Index>(mesh.vertex_count());
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (std::size_t f = 0; f < other.face_count(); ++f) {
        std::array<Index, 4> corners;
        for (unsigned c = 0; c < 4; ++c) corners[c] = first + other.face(f)[c];
        mesh.add_face(corners);
    }
    const auto patches = find_regular_patches(mesh, 16, RunContext(1));
    ASSERT_TRUE(patches.ok()) << patches.error().message;
    EXPECT_EQ(patches->levels, 2u);
    EXPECT_EQ(patches->patch_count(), 6u * 16 + 1);
    expect_grids_are_the_mesh(mesh, *patches);
}

std::string refusal(const Mesh& mesh) {
    const auto patches = find_regular_patches(mesh, 16, RunContext(1));
    if (patches.ok()) return "";
    EXPECT_EQ(patches.error().code, ErrorCode::unsuitable);
    return patches.error().message;
}

/// n x n quads over a grid of vertices, those faces left out for which skip(i, j) holds.
template <class Skip>
Mesh plane_without(unsigned n, const Skip& skip) {
    Mesh mesh = make_wavy_plane({.resolution = n});
    const Mesh whole = mesh;
    mesh.face_offsets = {0};
    mesh.corners.clear();
    for (unsigned f = 0; f < n * n; ++f)
        if (!skip(f % n, f / n)) mesh.add_face(whole.face(f));
    return mesh;
}

TEST(RegularPatches, SaysWhatIsInTheWay) {
    EXPECT_NE(refusal(Mesh{}).find("no faces"), std::string::npos);

    Mesh triangle;
    triangle.positions.resize(3, Vec3f::Zero());
    triangle.add_face(std::array<Index, 3>{0, 1, 2});
    EXPECT_NE(refusal(triangle).find("face 0 has 3 corners"), std::string::npos);

    EXPECT_NE(refusal(make_wavy_plane({.resolution = 7})).find("do not fit"), std::string::npos);
    EXPECT_NE(refusal(make_wavy_cube({.resolution = 1})).find("do not fit"), std::string::npos);

    Mesh turned = make_wavy_plane({.resolution = 4});
    std::reverse(turned.corners.begin() + 4 * 5, turned.corners.begin() + 4 * 6);
    EXPECT_NE(refusal(turned).find("turned against each other"), std::string::npos);

    Mesh third = make_wavy_plane({.resolution = 4});
    third.positions.resize(27, Vec3f::Zero());
    third.uvs = {};
    third.add_face(std::array<Index, 4>{6, 7, 25, 26});
    EXPECT_NE(refusal(third).find("More than two faces"), std::string::npos);

    Mesh unused = make_wavy_plane({.resolution = 4});
    unused.positions.resize(26, Vec3f::Zero());
    unused.uvs = {};
    EXPECT_NE(refusal(unused).find("vertex 25 is in no face"), std::string::npos);

    // Only the two quads at opposite sides of a vertex.
    const Mesh bowtie = plane_without(2, [](unsigned i, unsigned j) { return i != j; });
    EXPECT_NE(refusal(bowtie).find("no face"), std::string::npos);
    Mesh touching;
    touching.positions.resize(7, Vec3f::Zero());
    touching.add_face(std::array<Index, 4>{0, 1, 2, 3});
    touching.add_face(std::array<Index, 4>{2, 4, 5, 6});
    EXPECT_NE(refusal(touching).find("vertex 2 touch"), std::string::npos);
}

/// Walking around the middle once for each of its faces would take 3,600 million steps.
TEST(RegularPatches, AFanTakesNoQuadraticTime) {
    constexpr Index kFaces = 60'000;
    Mesh fan;
    fan.positions.resize(1 + 2 * kFaces, Vec3f::Zero());
    for (Index i = 0; i < kFaces; ++i)
        fan.add_face(std::array<Index, 4>{0, 1 + 2 * i, 2 + 2 * i, 1 + 2 * ((i + 1) % kFaces)});
    const std::clock_t start = std::clock();
    EXPECT_NE(refusal(fan).find("do not fit"), std::string::npos);
    EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 2);

    fan.positions.resize(1 + 2 * kFaces + 3, Vec3f::Zero()); // and a face that touches the middle alone
    fan.add_face(std::array<Index, 4>{0, 2 * kFaces + 1, 2 * kFaces + 2, 2 * kFaces + 3});
    EXPECT_NE(refusal(fan).find("vertex 0 touch there without sharing an edge"), std::string::npos);
}

TEST(RegularPatches, HolesMustLieOnEveryLevel) {
    // A hole of 4 x 4 quads at multiples of four leaves two levels, one of 2 x 2 at an odd place none.
    Mesh mesh = plane_without(12, [](unsigned i, unsigned j) { return i / 4 == 1 && j / 4 == 1; });
    // The hole's inner vertices are in no face any more.
    std::vector<Index> ids(mesh.vertex_count(), kNoIndex);
    std::vector<Vec3f> kept;
    for (Index& v : mesh.corners) {
        if (ids[v] == kNoIndex) {
            ids[v] = static_cast<Index>(kept.size());
            kept.push_back(mesh.positions[v]);
        }
        v = ids[v];
    }
    mesh.positions = kept;
    mesh.uvs = {}; // one a vertex, of which there are fewer now
    const auto patches = find_regular_patches(mesh, 16, RunContext(1));
    ASSERT_TRUE(patches.ok()) << patches.error().message;
    EXPECT_EQ(patches->levels, 2u);
    EXPECT_EQ(patches->patch_count(), 8u);
    expect_grids_are_the_mesh(mesh, *patches);

    const Mesh odd = plane_without(4, [](unsigned i, unsigned j) { return i == 1 && j == 1; });
    EXPECT_NE(refusal(odd).find("do not fit"), std::string::npos);
}

TEST(RegularPatches, TakesOrRefusesRealMeshesWithAReason) {
    const char* folder = std::getenv("FILIGREE_CORPUS");
    const std::filesystem::path corpus = folder ? folder : FILIGREE_ROOT "/../shared/corpus";
    if (!std::filesystem::exists(corpus / "good")) GTEST_SKIP() << "no corpus at " << corpus;
    std::size_t read = 0;
    for (const auto& entry : std::filesystem::directory_iterator(corpus / "good")) {
        if (entry.path().extension() != ".obj") continue;
        SCOPED_TRACE(entry.path().filename());
        const auto file = read_mesh(entry.path(), RunContext(1));
        ASSERT_TRUE(file.ok()) << file.error().message;
        const Mesh& mesh = file->mesh;
        ++read;
        const auto patches = find_regular_patches(mesh, 16, RunContext(1));
        bool all_quads = true;
        for (std::size_t f = 0; f < mesh.face_count(); ++f) all_quads &= mesh.face_size(f) == 4;
        if (patches.ok()) {
            EXPECT_TRUE(all_quads);
            expect_grids_are_the_mesh(mesh, *patches);
        } else {
            EXPECT_EQ(patches.error().code, ErrorCode::unsuitable);
            EXPECT_EQ(patches.error().message.find(" corners; ") == std::string::npos, all_quads)
                << patches.error().message;
            RecordProperty(entry.path().stem().string(), patches.error().message);
        }
    }
    EXPECT_GT(read, 0u);
}

TEST(RegularPatches, StopsWhenAsked) {
    const RunContext context(1);
    context.cancel();
    EXPECT_EQ(find_regular_patches(make_wavy_cube({.resolution = 4}), 16, context).error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
