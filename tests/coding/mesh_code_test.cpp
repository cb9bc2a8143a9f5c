// Coded meshes: the same faces, places within half a step along each axis, attributes; in any order, and in theirs;
// what was damaged is named, and never takes the program down.
#include "cases.h"
#include "filigree/coding/mesh_code.h"

#include "coded_size.h"
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"
#include "io/corpus.h"
#include "threads.h"

#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <numeric>
#include <random>

using namespace filigree;
using namespace filigree_test;

namespace {

/// A face by its vertices, beginning with the lowest: the same whatever corner was first.
std::vector<Index> turned(std::vector<Index> face) {
    std::ranges::rotate(face, std::ranges::min_element(face));
    return face;
}

std::map<std::vector<Index>, int> faces_of(const Mesh& mesh, std::span<const Index> vertex) {
    std::map<std::vector<Index>, int> faces;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        std::vector<Index> face;
        for (const Index v : mesh.face(f)) face.push_back(vertex.empty() ? v : vertex[v]);
        ++faces[turned(face)];
    }
    return faces;
}

struct Coded {
    PackedMesh code;
    PackedMeshReport report;
    Mesh mesh;
};

Coded coded(const Mesh& mesh, const PackOptions& options = {}) {
    Coded result;
    result.code = pack_mesh(mesh, options, &result.report, kOneThread).value();
    result.mesh = unpack_mesh(result.code, kOneThread).value();
    return result;
}

/// Faces and places, whatever the order.
void expect_same_surface(const Mesh& mesh, const PackOptions& options) {
    const Coded out = coded(mesh, options);
    ASSERT_EQ(out.mesh.vertex_count(), mesh.vertex_count());
    ASSERT_EQ(out.mesh.face_count(), mesh.face_count());
    const std::vector<Index> none;
    EXPECT_EQ(faces_of(out.mesh, options.keep_order ? none : out.report.vertex), faces_of(mesh, none));
    // Half a step along each axis of a frame, and what is rounded to sixteenths on the way; refinements' frames are
    // rougher.
    const double along = options.surface ? 4 : 1, rounded = options.levels && !options.surface ? 0.25 : 0.12,
                 most = (std::sqrt(0.25 * (1 + 2 * along * along)) + rounded) * out.code.step;
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        const Vec3f was = mesh.positions[options.keep_order ? v : out.report.vertex[v]];
        ASSERT_LT((out.mesh.positions[v] - was).cast<double>().norm(), most + 2e-7 * was.norm());
    }
}

void expect_same_in_order(const Mesh& mesh) {
    const Coded out = coded(mesh, {.keep_order = true});
    EXPECT_EQ(out.mesh.corners, mesh.corners);
    EXPECT_EQ(out.mesh.face_offsets, mesh.face_offsets);
    EXPECT_EQ(out.mesh.objects.of_face, mesh.objects.of_face);
    EXPECT_EQ(out.mesh.groups.of_face, mesh.groups.of_face);
    EXPECT_EQ(out.mesh.materials.of_face, mesh.materials.of_face);
    EXPECT_EQ(out.mesh.materials.names, mesh.materials.names);
    EXPECT_EQ(out.mesh.smoothing, mesh.smoothing);
    ASSERT_EQ(out.mesh.uvs.corners.size(), mesh.uvs.corners.size());
    const Box box = [&] {
        Box all;
        for (const Vec2f& uv : mesh.uvs.values) all.extend({uv[0], uv[1], 0});
        return all;
    }();
    const double step = mesh.uvs.empty() ? 0 : box.size().maxCoeff() / 4095;
    for (std::size_t c = 0; c < mesh.uvs.corners.size(); ++c) {
        const Index was = mesh.uvs.corners[c], is = out.mesh.uvs.corners[c];
        ASSERT_EQ(was == kNoIndex, is == kNoIndex);
        if (was == kNoIndex) continue;
        ASSERT_LT((out.mesh.uvs.values[is] - mesh.uvs.values[was]).cwiseAbs().maxCoeff(), 0.51 * step + 1e-6);
    }
}

Mesh random_mesh(std::mt19937& random) {
    Mesh mesh;
    const std::size_t vertices = 3 + random() % 30, faces = random() % 60;
    for (std::size_t v = 0; v < vertices; ++v)
        mesh.positions.emplace_back(float(random() % 1000), float(random() % 1000), float(random() % 1000));
    for (std::size_t f = 0; f < faces; ++f) {
        std::vector<Index> face(3 + random() % 4 * (random() % 3 == 0));
        for (Index& v : face) v = Index(random() % vertices); // some twice in one face
        mesh.add_face(face);
    }
    return mesh;
}

} // namespace

TEST(MeshCode, AStrayVertexSaysNothing) {
    Mesh torus = make_torus({.resolution = 32});
    const Coded alone = coded(torus);
    torus.positions.emplace_back(0.9f, 0, 0);
    EXPECT_EQ(coded(torus).report.out_of_reach, 0u);
    torus.positions.emplace_back(1e8f, 0, -1e30f);
    for (const bool levels : {false, true}) {
        const Coded out = coded(torus, {.levels = levels});
        EXPECT_EQ(out.code.step, alone.code.step);
        EXPECT_EQ(out.report.out_of_reach, 1u);
        EXPECT_LT(out.report.largest, 4 * alone.code.step);
        EXPECT_EQ(out.mesh.vertex_count(), torus.vertex_count());
    }
}

TEST(MeshCode, ShapesKeepTheirFacesAndPlaces) {
    for (const std::string_view name : shape_names()) {
        const Mesh mesh = *make_shape(name, {.resolution = 24});
        for (const unsigned bits : {10u, 12u, 16u}) expect_same_surface(mesh, {.bits = bits});
        expect_same_surface(mesh, {.surface = true});
        expect_same_surface(mesh, {.levels = true});
        expect_same_surface(mesh, {.surface = true, .levels = true});
        expect_same_in_order(mesh);
    }
}

TEST(MeshCode, AnyFacesAtAll) { // edges of many faces, faces that turn back, vertices twice in one face, loose ones
    for (unsigned seed = 0; seed < 3000; ++seed) {
        std::mt19937 random(seed);
        const Mesh mesh = random_mesh(random);
        SCOPED_TRACE(seed);
        expect_same_surface(mesh, {});
        if (seed % 4 == 0) expect_same_surface(mesh, {.bits = 10, .keep_order = true});
        if (seed % 4 == 1) expect_same_surface(mesh, {.keep_order = seed % 8 == 1, .levels = true});
        if (HasFailure()) break;
    }
}

TEST(MeshCode, Attributes) {
    Mesh mesh = make_wavy_sphere({.resolution = 16});
    std::mt19937 random(5);
    mesh.scalars.push_back({"heat", {}});
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        mesh.colors.emplace_back(float(random() % 256) / 255, 0.5f, float(v % 7) / 7, 1.0f);
        mesh.scalars[0].values.push_back(float(random()) * 1e-7f);
        mesh.normals.values.push_back(mesh.positions[v].normalized());
    }
    mesh.materials.names = {"gold", "jade"};
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        mesh.materials.of_face.push_back(f % 5 ? 0 : f % 3 ? 1 : kNoIndex);
    for (const PackOptions& options :
         {PackOptions{}, {.keep_order = true}, {.levels = true}, {.keep_order = true, .levels = true}}) {
        const bool keep_order = options.keep_order;
        const Coded out = coded(mesh, options);
        float normal_squares = 0;
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
            const Index was = keep_order ? Index(v) : out.report.vertex[v];
            ASSERT_EQ(out.mesh.scalars[0].values[v], mesh.scalars[0].values[was]);
            ASSERT_LT((out.mesh.colors[v] - mesh.colors[was]).cwiseAbs().maxCoeff(), 0.51f / 255);
            const float off = (out.mesh.normals.values[v] - mesh.normals.values[was]).norm();
            ASSERT_LT(off, 6.1e-3f); // half a step each way, where the octahedron's square is stretched most
            normal_squares += off * off;
        }
        EXPECT_LT(std::sqrt(normal_squares / float(mesh.vertex_count())),
                  2e-3f); // of directions that the shape does not tell
        EXPECT_EQ(out.mesh.scalars[0].name, "heat");
        EXPECT_EQ(std::ranges::count(out.mesh.materials.of_face, 1u), std::ranges::count(mesh.materials.of_face, 1u));
    }
    expect_same_in_order(mesh);
}

TEST(MeshCode, NormalsOfAnyLength) { // of vertices and of corners
    for (const bool is_indexed : {false, true}) {
        Mesh mesh = make_wavy_sphere({.resolution = 12});
        for (const Vec3f& p : mesh.positions) mesh.normals.values.push_back((1 + p.y()) * p);
        if (is_indexed) mesh.normals.corners = mesh.corners;
        const Coded out = coded(mesh, {.keep_order = true});
        for (std::size_t c = 0; c < mesh.corner_count(); ++c) {
            const Index was = mesh.corners[c], is = is_indexed ? out.mesh.normals.corners[c] : out.mesh.corners[c];
            const Vec3f off = out.mesh.normals.values[is] - mesh.normals.values[was];
            ASSERT_LT(off.cwiseAbs().maxCoeff(), 0.51f * 4 / 1023); // half a step of the box, at most 4 wide
        }
    }
}

TEST(MeshCode, NormalsOfAnyDirection) { // also those that look into the surface
    Mesh mesh = make_wavy_sphere({.resolution = 16});
    std::mt19937 random(6);
    std::normal_distribution<float> any;
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        mesh.normals.values.push_back(Vec3f(any(random), any(random), any(random)).normalized());
    const Coded out = coded(mesh, {.keep_order = true});
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        ASSERT_LT((out.mesh.normals.values[v] - mesh.normals.values[v]).norm(), 6.1e-3f) << v; // as in Attributes
}

/// Vertices, faces and first corners in any order.
Mesh shuffled(const Mesh& mesh, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<Index> vertex(mesh.vertex_count()), face(mesh.face_count());
    std::iota(vertex.begin(), vertex.end(), 0);
    std::iota(face.begin(), face.end(), 0);
    std::ranges::shuffle(vertex, random);
    std::ranges::shuffle(face, random);
    Mesh moved;
    moved.positions.resize(mesh.vertex_count());
    for (std::size_t v = 0; v < vertex.size(); ++v) moved.positions[vertex[v]] = mesh.positions[v];
    for (const Index f : face) {
        std::vector<Index> corners;
        for (const Index v : mesh.face(f)) corners.push_back(vertex[v]);
        std::ranges::rotate(corners, corners.begin() + std::ptrdiff_t(random() % corners.size()));
        moved.add_face(corners);
    }
    return moved;
}

TEST(MeshCode, SizesStay) {
    const Mesh quads = make_wavy_sphere({.resolution = 64});
    Mesh sphere; // of triangles, with either diagonal
    sphere.positions = quads.positions;
    std::mt19937 random(1);
    for (std::size_t f = 0; f < quads.face_count(); ++f) {
        const auto q = quads.face(f);
        const std::size_t k = random() % 2;
        sphere.add_face(std::array{q[k], q[k + 1], q[k + 2]});
        sphere.add_face(std::array{q[k], q[k + 2], q[(k + 3) % 4]});
    }
    Mesh with_normals = sphere, with_colors = sphere, with_uvs = sphere;
    with_normals.normals.values = vertex_normals(sphere, sphere.positions, kOneThread);
    for (const Vec3f& p : sphere.positions) {
        with_colors.colors.emplace_back(0.5f + 0.3f * p.x(), 0.5f + 0.3f * p.y(), p.z() > 0 ? 0.9f : 0.2f, 1.0f);
        with_uvs.uvs.values.emplace_back(0.5f + 0.4f * p.x(), 0.5f + 0.4f * p.y() * p.z());
    }
    const PackedMesh normals = coded(with_normals).code;
    expect_coded_size(normals.connectivity.size(), 6197, "connectivity");
    expect_coded_size(normals.places.size(), 39763, "places");
    expect_coded_size(normals.attributes.size(), 4214, "normals");
    expect_coded_size(coded(with_colors).code.attributes.size(), 9802, "colours");
    expect_coded_size(coded(with_uvs).code.attributes.size(), 13080, "texture coordinates");
    expect_coded_size(coded(shuffled(sphere, 3), {.keep_order = true}).code.order.size(), 157459, "order");
}

TEST(MeshCode, RegularMeshesInAnyOrder) {
    for (const std::string_view name : shape_names())
        for (const unsigned resolution : {4u, 6u, 16u, 40u}) {
            SCOPED_TRACE(std::string(name) + " " + std::to_string(resolution));
            const Mesh mesh = shuffled(*make_shape(name, {.resolution = resolution}), resolution);
            expect_same_surface(mesh, {});
            expect_same_surface(mesh, {.bits = 16, .surface = true});
            expect_same_in_order(mesh);
        }
}

TEST(MeshCode, RegularMeshesThatAreGluedOddly) {
    Mesh ring; // two patches that share two edges of their base: its faces are coded as any mesh's
    const Index around = 8, rows = 5;
    for (Index j = 0; j < rows; ++j)
        for (Index i = 0; i < around; ++i) {
            const float angle = float(i) * 0.785398f;
            ring.positions.emplace_back(std::cos(angle), std::sin(angle), float(j));
        }
    for (Index j = 0; j + 1 < rows; ++j)
        for (Index i = 0; i < around; ++i) {
            const Index right = (i + 1) % around;
            const std::array<Index, 4> face = {j * around + i, j * around + right, (j + 1) * around + right,
                                               (j + 1) * around + i};
            ring.add_face(face);
        }
    expect_same_surface(ring, {});
    Mesh pair = make_wavy_cube({.resolution = 8}); // two components, one of them moved
    const Mesh single = pair;
    for (const Vec3f& p : single.positions) pair.positions.push_back(p + Vec3f(5, 0, 0));
    for (std::size_t f = 0; f < single.face_count(); ++f) {
        std::vector<Index> face;
        for (const Index v : single.face(f)) face.push_back(v + Index(single.vertex_count()));
        pair.add_face(face);
    }
    expect_same_surface(shuffled(pair, 3), {});
}

TEST(MeshCode, PointsAndTinyMeshes) {
    Mesh points;
    std::mt19937 random(6);
    for (int i = 0; i < 500; ++i)
        points.positions.emplace_back(float(random() % 100), float(random() % 100), float(random() % 100));
    expect_same_surface(points, {});
    Mesh one;
    one.positions.emplace_back(1e9f, -3, 0);
    expect_same_surface(one, {});
    EXPECT_EQ(pack_mesh(Mesh(), {}, nullptr, kOneThread).error().code, ErrorCode::unsuitable);
    EXPECT_EQ(pack_mesh(one, {.bits = 9}, nullptr, kOneThread).error().code, ErrorCode::usage);
}

TEST(MeshCode, FewBits) {
    const auto bits = [](const Mesh& mesh, unsigned precision) {
        const PackedMesh code = coded(mesh, {.bits = precision}).code;
        return std::pair(8.0 * double(code.connectivity.size()) / double(mesh.vertex_count()),
                         8.0 * double(code.places.size()) / double(mesh.vertex_count()));
    };
    const auto [quads, waves] = bits(make_wavy_cube({.resolution = 416}), 14); // a million quads
    EXPECT_LT(quads, 0.01);                                                    // a base of 1,014
    EXPECT_LT(waves, 0.95);
    const auto [odd_quads, odd_waves] = bits(make_wavy_cube({.resolution = 129}), 14); // no row can go
    EXPECT_LT(odd_quads, 0.3);
    const std::filesystem::path koala = corpus_folder() / "good/koala_100k.obj";
    if (!std::filesystem::exists(koala)) GTEST_SKIP() << "no corpus";
    const auto [connectivity, places] = bits(read_mesh(koala, kOneThread).value().mesh, 12);
    EXPECT_LT(connectivity, 2.2);           // Draco: 2.3
    EXPECT_LT(connectivity + places, 15.0); // Draco at its best: 17.1
}

void expect_damage_named(const Mesh& mesh) {
    const PackedMesh code = coded(mesh, {.keep_order = true}).code;
    for (std::string PackedMesh::*part :
         {&PackedMesh::connectivity, &PackedMesh::places, &PackedMesh::attributes, &PackedMesh::order}) {
        for (std::size_t at = 0; at < (code.*part).size(); ++at)
            for (const int by : {1, 128, 255}) {
                PackedMesh damaged = code;
                (damaged.*part)[at] = char((damaged.*part)[at] ^ by);
                const Result<Mesh> read = unpack_mesh(damaged, kOneThread);
                if (read)
                    ASSERT_EQ(check_mesh(*read), "");
                else
                    ASSERT_EQ(read.error().code, ErrorCode::bad_file);
            }
        for (std::size_t length = 0; length < (code.*part).size(); length += 3) {
            PackedMesh cut = code;
            (cut.*part).resize(length);
            EXPECT_FALSE(unpack_mesh(cut, kOneThread).ok());
        }
    }
    for (std::uint64_t PackedMesh::*count : {&PackedMesh::vertices, &PackedMesh::faces, &PackedMesh::corners})
        for (const std::uint64_t wrong :
             {std::uint64_t{0}, code.*count + 1, std::uint64_t{1} << 31, ~std::uint64_t{0}}) {
            PackedMesh damaged = code;
            damaged.*count = wrong;
            EXPECT_FALSE(unpack_mesh(damaged, kOneThread).ok());
        }
}

TEST(MeshCode, EveryDamagedByteIsNamedOrHarmless) {
    expect_damage_named(make_wavy_sphere({.resolution = 7}));
    expect_damage_named(make_wavy_cube({.resolution = 8})); // regular
}

TEST(MeshCode, CorpusComesBack) {
    std::size_t tried = 0;
    for (const CorpusRow& row : read_corpus()) {
        const Result<MeshFile> file = read_mesh(row.path, kOneThread);
        if (!file || file->mesh.vertex_count() == 0 || file->mesh.corner_count() > (all_cases() ? 300'000 : 100'000))
            continue;
        SCOPED_TRACE(row.file);
        expect_same_in_order(file->mesh);
        if (std::isfinite(world_bounds(file->mesh).diagonal())) {
            expect_same_surface(file->mesh, {});
            expect_same_surface(file->mesh, {.levels = true});
        }
        ++tried;
    }
    if (tried == 0) GTEST_SKIP() << "no corpus";
}
