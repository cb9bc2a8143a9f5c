// Any mesh, with any attributes that a format holds, written and read back; and every pair of formats in a row.
#include "corpus.h"
#include "filigree/file.h"
#include "filigree/io/model_file.h"
#include "filigree/mesh.h"
#include "filigree/strip.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>

using namespace filigree;

namespace {

namespace gen = rc::gen;

/// Every float but those that are no number, each bit pattern as likely.
rc::Gen<float> any_float() {
    const auto bits = gen::resize(rc::kNominalSize, gen::arbitrary<std::uint32_t>());
    return gen::suchThat(gen::map(bits, [](std::uint32_t b) { return std::bit_cast<float>(b); }),
                         [](float x) { return std::isfinite(x); });
}

template <class Vector>
std::vector<Vector> any_vectors(std::size_t count) {
    std::vector<Vector> vectors(count);
    for (Vector& v : vectors)
        for (float& x : v) x = *any_float();
    return vectors;
}

/// Perhaps with UVs, normals and colours, one a vertex; colours sometimes in the steps of a byte.
Mesh any_mesh() {
    Mesh mesh;
    mesh.positions = any_vectors<Vec3f>(*gen::inRange<std::size_t>(1, 12));
    mesh.positions.push_back(-mesh.positions[0]); // around the origin, where positions stay as they are
    const std::size_t count = mesh.vertex_count();
    const std::size_t faces = *gen::inRange(0, 8);
    for (std::size_t f = 0; f < faces; ++f) {
        const auto size = *gen::inRange<std::size_t>(3, 7);
        mesh.add_face(*gen::container<std::vector<Index>>(size, gen::inRange<Index>(0, static_cast<Index>(count))));
    }
    // Those that faces use are around it as well.
    if (faces > 0) mesh.add_face(std::array<Index, 3>{0, static_cast<Index>(count - 1), 0});
    if (*gen::arbitrary<bool>()) mesh.uvs.values = any_vectors<Vec2f>(count);
    if (*gen::arbitrary<bool>()) mesh.normals.values = any_vectors<Vec3f>(count);
    if (*gen::arbitrary<bool>()) mesh.colors = any_vectors<Vec4f>(count);
    const bool in_bytes = *gen::arbitrary<bool>();
    for (Vec4f& color : mesh.colors)
        for (float& x : color)
            x = in_bytes ? static_cast<float>(*gen::inRange(0, 256)) / 255.0f
                         : std::min(x, 1.0f); // colours beyond 1 are read as 0 to 255
    return mesh;
}

MeshFile written_and_read(const Mesh& mesh, MeshFormat format, const WriteMeshOptions& options = {}) {
    std::string bytes;
    RC_ASSERT(write_mesh(mesh, format, bytes, options, RunContext()).ok());
    const Result<MeshFile> file = read_mesh(bytes, format == MeshFormat::obj ? "a.obj" : "a.ply", RunContext(1));
    RC_ASSERT(file.ok());
    return *file;
}

/// -0 and 0 count as the same.
void assert_same(const Mesh& a, const Mesh& b) {
    RC_ASSERT(a.origin == b.origin);
    RC_ASSERT(a.positions == b.positions);
    RC_ASSERT(a.face_offsets == b.face_offsets);
    RC_ASSERT(a.corners == b.corners);
    RC_ASSERT(a.uvs.values == b.uvs.values);
    RC_ASSERT(a.uvs.corners == b.uvs.corners);
    RC_ASSERT(a.normals.values == b.normals.values);
    RC_ASSERT(a.normals.corners == b.normals.corners);
    RC_ASSERT(a.colors == b.colors);
    RC_ASSERT(a.colors_have_alpha == b.colors_have_alpha);
}

} // namespace

RC_GTEST_PROP(MeshRoundTrip, ObjHoldsAnyMesh, ()) {
    Mesh mesh = any_mesh();
    for (Vec4f& color : mesh.colors) color.w() = 1; // OBJ has no alpha
    assert_same(written_and_read(mesh, MeshFormat::obj).mesh, mesh);
}

RC_GTEST_PROP(MeshRoundTrip, PlyHoldsAnyMeshWithScalarsOfAnyName, ()) {
    Mesh mesh = any_mesh();
    mesh.colors_have_alpha = !mesh.colors.empty() && *gen::arbitrary<bool>();
    for (Vec4f& color : mesh.colors)
        if (!mesh.colors_have_alpha) color.w() = 1;
    const std::vector<std::string> names = {"", "x", "nx", "s", "red", "quality", "a b", "a_b", "a_b_2", "end_header"};
    const std::size_t count = *gen::inRange(0, 6);
    for (std::size_t i = 0; i < count; ++i) {
        mesh.scalars.push_back({*gen::elementOf(names), {}});
        for (const auto& x : any_vectors<Vec2f>(mesh.vertex_count())) mesh.scalars.back().values.push_back(x.x());
    }
    const auto options =
        *gen::element(WriteMeshOptions{}, WriteMeshOptions{.big_endian = true}, WriteMeshOptions{.ascii = true});
    const Mesh back = written_and_read(mesh, MeshFormat::ply, options).mesh;
    assert_same(back, mesh);
    RC_ASSERT(back.scalars.size() == mesh.scalars.size());
    std::set<std::string> distinct;
    for (std::size_t i = 0; i < mesh.scalars.size(); ++i) {
        RC_ASSERT(back.scalars[i].values == mesh.scalars[i].values);
        RC_ASSERT(distinct.insert(back.scalars[i].name).second);
    }
}

// ------------------------------------------------------------------------------------- every pair of formats

namespace {

constexpr MeshFormat kFormats[] = {MeshFormat::obj, MeshFormat::ply, MeshFormat::stl, MeshFormat::off,
                                   MeshFormat::gltf};

std::string name_of(MeshFormat format) {
    constexpr const char* kNames[] = {"obj", "ply", "stl", "off", "glb"};
    return kNames[static_cast<std::size_t>(format)];
}

/// What docs/formats.md says a format holds.
struct Holds {
    bool order, polygons, corner_uvs, corner_normals, vertex_attributes, colors, scalars, groups, materials;
};
Holds holds(MeshFormat format) {
    switch (format) {
    case MeshFormat::obj:
        return {true, true, true, true, true, true, false, true, true};
    case MeshFormat::ply:
        return {true, true, true, false, true, true, true, false, false};
    case MeshFormat::stl:
        return {};
    case MeshFormat::off:
        return {true, true, false, false, true, true, false, false, false};
    case MeshFormat::gltf:
        return {true, false, true, true, true, true, true, false, true};
    }
    return {};
}

/// The mesh after a file of that format.
Mesh through(const Mesh& mesh, MeshFormat format) {
    std::string bytes;
    EXPECT_TRUE(write_mesh(mesh, format, bytes, {}, RunContext()).ok());
    const Result<MeshFile> file = read_mesh(bytes, "a." + name_of(format), RunContext(1));
    EXPECT_TRUE(file.ok()) << file.error().message;
    return file.ok() ? file->mesh : Mesh();
}

/// The same mesh in triangles, in the order in which GLB keeps faces: by material. Every corner keeps its values.
Mesh triangles_of(const Mesh& mesh) {
    Mesh cut = mesh;
    cut.face_offsets = {0};
    cut.corners.clear();
    cut.uvs.corners.clear();
    cut.normals.corners.clear();
    cut.materials.of_face.clear();
    cut.objects = {}, cut.groups = {}, cut.smoothing = {};
    const Triangulation triangulation = triangulate(mesh);
    std::vector<std::size_t> order(triangulation.triangles.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto material = [&](std::size_t t) {
        return mesh.materials.empty() ? kNoIndex : mesh.materials.of_face[triangulation.source_face[t]];
    };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return material(a) < material(b); });
    for (const std::size_t t : order) {
        const Index face = triangulation.source_face[t];
        for (const Index v : triangulation.triangles[t]) {
            std::size_t c = mesh.face_offsets[face];
            while (mesh.corners[c] != v) ++c;
            if (!mesh.uvs.per_vertex()) cut.uvs.corners.push_back(mesh.uvs.corners[c]);
            if (!mesh.normals.per_vertex()) cut.normals.corners.push_back(mesh.normals.corners[c]);
        }
        cut.add_face(triangulation.triangles[t]);
        if (!mesh.materials.empty()) cut.materials.of_face.push_back(material(t));
    }
    return cut;
}

template <class T>
std::optional<T> corner_value(const CornerAttribute<T>& attribute, const Mesh& mesh, std::size_t corner) {
    if (attribute.empty()) return {};
    if (attribute.per_vertex()) return attribute.values[mesh.corners[corner]];
    const Index i = attribute.corners[corner];
    return i == kNoIndex ? std::optional<T>() : attribute.values[i];
}

/// Whether one value a vertex says it all.
template <class T>
bool is_per_vertex(const CornerAttribute<T>& attribute, const Mesh& mesh) {
    if (attribute.per_vertex()) return true;
    std::map<Index, T> value_of;
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) {
        const std::optional<T> value = corner_value(attribute, mesh, c);
        if (!value || value_of.try_emplace(mesh.corners[c], *value).first->second != *value) return false;
    }
    return true;
}

/// Corners where the values differ by more than `tolerance` an axis.
template <class T>
std::size_t differing_corners(const CornerAttribute<T>& a, const Mesh& mesh_a, const CornerAttribute<T>& b,
                              const Mesh& mesh_b, float tolerance) {
    std::size_t differing = 0;
    for (std::size_t c = 0; c < mesh_a.corner_count(); ++c) {
        const std::optional<T> x = corner_value(a, mesh_a, c), y = corner_value(b, mesh_b, c);
        if (x.has_value() != y.has_value() || (x && (*x - *y).cwiseAbs().maxCoeff() > tolerance)) ++differing;
    }
    return differing;
}

/// The material of each face by name.
std::vector<std::string> face_materials(const Mesh& mesh) {
    std::vector<std::string> names;
    for (const Index m : mesh.materials.of_face) names.push_back(m == kNoIndex ? "" : mesh.materials.names[m]);
    return names;
}

/// All corners' places in the world, in the order of the faces: what STL keeps.
std::vector<Vec3f> corner_places(const Mesh& mesh) {
    std::vector<Vec3f> places;
    for (const Index v : mesh.corners) places.push_back(mesh.world_position(v).cast<float>());
    return places;
}

void expect_kept(const Mesh& before, const Mesh& after, MeshFormat first, MeshFormat second) {
    const Holds a = holds(first), b = holds(second);
    const bool glb = first == MeshFormat::gltf || second == MeshFormat::gltf;
    ASSERT_EQ(after.face_count(), before.face_count());
    if (!a.order || !b.order) {
        EXPECT_TRUE(corner_places(after) == corner_places(before));
        return;
    }
    EXPECT_TRUE(after.origin == before.origin);
    EXPECT_TRUE(after.positions == before.positions);
    EXPECT_TRUE(after.corners == before.corners);
    EXPECT_TRUE(after.face_offsets == before.face_offsets);
    const bool corner_uvs = a.corner_uvs && b.corner_uvs, corner_normals = a.corner_normals && b.corner_normals;
    if (!before.uvs.empty() && (corner_uvs || is_per_vertex(before.uvs, before))) {
        float largest = 1;
        for (const Vec2f& uv : before.uvs.values) largest = std::max(largest, std::abs(uv.y()) + 1);
        const float one_rounding = glb ? largest * 0x1p-24f : 0; // of 1 - v, on the way there and back
        EXPECT_EQ(differing_corners(before.uvs, before, after.uvs, after, 2 * one_rounding), 0u);
    }
    if (!before.normals.empty() && (corner_normals || is_per_vertex(before.normals, before))) {
        EXPECT_EQ(differing_corners(before.normals, before, after.normals, after, 0), 0u);
    }
    if (!before.colors.empty()) {
        float worst = 0;
        ASSERT_EQ(after.colors.size(), before.colors.size());
        for (std::size_t v = 0; v < before.colors.size(); ++v)
            worst = std::max(worst, (after.colors[v] - before.colors[v]).head<3>().cwiseAbs().maxCoeff());
        EXPECT_LE(worst, glb ? 1e-6f : 0); // through linear light
    }
    if (a.scalars && b.scalars) {
        ASSERT_EQ(after.scalars.size(), before.scalars.size());
        for (std::size_t i = 0; i < before.scalars.size(); ++i) {
            EXPECT_EQ(after.scalars[i].name, before.scalars[i].name);
            EXPECT_TRUE(after.scalars[i].values == before.scalars[i].values);
        }
    }
    if (a.materials && b.materials) {
        EXPECT_EQ(face_materials(after), face_materials(before));
    }
    if (a.groups && b.groups) {
        EXPECT_EQ(after.smoothing, before.smoothing);
        EXPECT_EQ(after.groups.of_face, before.groups.of_face);
    }
}

/// Through both formats, as polygons where both have them.
void expect_pairs_keep(const Mesh& mesh) {
    const Mesh triangles = triangles_of(mesh);
    for (const MeshFormat first : kFormats) {
        const Mesh polygons_once = holds(first).polygons ? through(mesh, first) : Mesh();
        const Mesh triangles_once = through(triangles, first);
        for (const MeshFormat second : kFormats) {
            SCOPED_TRACE(name_of(first) + " to " + name_of(second));
            const bool polygons = holds(first).polygons && holds(second).polygons;
            expect_kept(polygons ? mesh : triangles, through(polygons ? polygons_once : triangles_once, second), first,
                        second);
        }
    }
}

/// A strip of triangles and a quad with unit normals and UVs of corners, materials, colours and a number.
Mesh mesh_with_everything() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0.25f}, {1, 1, 0}, {0, 1, 0.1f}, {2, 0, 0.3f}, {2, 1, 1.0f / 3}};
    mesh.add_face(std::array<Index, 4>{0, 1, 2, 3});
    mesh.add_face(Triangle{1, 4, 2});
    mesh.add_face(Triangle{4, 5, 2});
    mesh.uvs.values = {{0, 0}, {0.1f, 0.7f}, {1, 1}, {-3, 5.3f}};
    mesh.normals.values = {{0, 0, 1}, {0.6f, 0, 0.8f}};
    for (Index c = 0; c < mesh.corner_count(); ++c) {
        mesh.uvs.corners.push_back(c % 4);
        mesh.normals.corners.push_back(c % 2);
    }
    mesh.scalars = {{"quality", {}}};
    for (int v = 0; v < 6; ++v) {
        mesh.colors.emplace_back(0.2f * static_cast<float>(v), 0.3f, static_cast<float>(v * 40) / 255.0f, 1.0f);
        mesh.scalars[0].values.push_back(0.1f * static_cast<float>(v));
    }
    mesh.groups = {{"left", "right"}, {0, 1, 0}};
    mesh.smoothing = {1, 0, 2};
    mesh.materials = {{"stone", "wood"}, {0, 0, 1}};
    return mesh;
}

} // namespace

TEST(MeshRoundTrip, EveryPairOfFormatsKeepsWhatBothHold) {
    expect_pairs_keep(mesh_with_everything());
    Mesh by_vertex = mesh_with_everything();
    by_vertex.uvs.corners.clear();
    by_vertex.normals.corners.clear();
    by_vertex.uvs.values.assign(6, Vec2f(0.3f, 0.9f));
    by_vertex.normals.values.assign(6, Vec3f(0, 0.6f, 0.8f));
    expect_pairs_keep(by_vertex);
}

TEST(MeshRoundTrip, EveryPairOfFormatsOverTheCorpus) {
    constexpr std::uintmax_t kLargest = 300'000; // bytes; larger ones go through each format once, below
    std::size_t tried = 0;
    for (const filigree_test::CorpusRow& row : filigree_test::read_corpus()) {
        if (!row.file.starts_with("good/") || std::filesystem::file_size(row.path) > kLargest) continue;
        SCOPED_TRACE(row.file);
        const Result<MeshFile> file = read_mesh(row.path, RunContext(1));
        if (!file.ok()) continue; // the corpus test tells
        expect_pairs_keep(file->mesh);
        ++tried;
    }
    if (tried == 0) GTEST_SKIP() << "no corpus";
}

TEST(MeshRoundTrip, LargeMeshesThroughEachFormat) {
    const std::filesystem::path path = filigree_test::corpus_folder() / "good/koala_100k.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no corpus";
    const Result<MeshFile> file = read_mesh(path, RunContext(1));
    ASSERT_TRUE(file.ok());
    const Mesh triangles = triangles_of(file->mesh);
    for (const MeshFormat format : kFormats) {
        SCOPED_TRACE(name_of(format));
        expect_kept(triangles, through(triangles, format), format, format);
    }
}

TEST(MeshRoundTrip, ObjectsComeBackFromGlbOverOneListOfVertices) {
    Mesh mesh = triangles_of(mesh_with_everything());
    mesh.objects = {{"front", "back"}, {0, 0, 1, 1}};
    const Mesh back = through(mesh, MeshFormat::gltf);
    EXPECT_TRUE(back.positions == mesh.positions);
    EXPECT_EQ(back.objects.names, mesh.objects.names);
    EXPECT_EQ(back.objects.of_face, mesh.objects.of_face);
    EXPECT_TRUE(back.corners == mesh.corners);
}

TEST(MeshRoundTrip, MaterialsComeBackFromGlbToTheBit) {
    Mesh mesh = triangles_of(mesh_with_everything());
    const std::string picture = "\x89PNG\r\n\x1a\n and so on";
    mesh.embedded_materials.resize(2);
    MeshMaterial &stone = mesh.embedded_materials[0], &wood = mesh.embedded_materials[1];
    stone.name = "stone";
    stone.color = {0.1f, 0.5f, 1};
    stone.opacity = 0.3f;
    stone.metallic = 0.7f;
    stone.picture_bytes = std::make_shared<const std::string>(picture);
    wood.name = "wood";
    wood.roughness = 0.4f;
    wood.double_sided = false;
    const Mesh back = through(mesh, MeshFormat::gltf);
    ASSERT_EQ(back.embedded_materials.size(), 2u);
    for (std::size_t m = 0; m < 2; ++m) {
        const MeshMaterial &a = mesh.embedded_materials[m], &b = back.embedded_materials[m];
        EXPECT_EQ(b.name, a.name);
        EXPECT_EQ(b.color, a.color);
        EXPECT_EQ(b.opacity, a.opacity);
        EXPECT_EQ(b.metallic, a.metallic);
        EXPECT_EQ(b.roughness, a.roughness);
        EXPECT_EQ(b.double_sided, a.double_sided);
        EXPECT_EQ(b.has_picture(), a.has_picture());
    }
    EXPECT_TRUE(*back.embedded_materials[0].picture_bytes == picture);
}

TEST(MeshRoundTrip, ModelFilesKeepAllOfTheMesh) {
    for (const Mesh& mesh : {mesh_with_everything(), triangles_of(mesh_with_everything())}) {
        const Result<Stripped> stripped = strip(mesh, {}, RunContext(1));
        ASSERT_TRUE(stripped.ok());
        const Result<Model> model = read_model(write_model(stripped->model), "a.fil", RunContext(1));
        ASSERT_TRUE(model.ok());
        const Mesh back = level_mesh(*model, model->finest_level());
        expect_kept(mesh, back, MeshFormat::obj, MeshFormat::obj);
        EXPECT_TRUE(back.scalars[0].values == mesh.scalars[0].values);
    }
}
