#include "filigree/file.h"
#include "filigree/io/system/file.h"
#include "io/sample_meshes.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <bit>
#include <clocale>
#include <cstring>

#include <unistd.h>

using namespace filigree;
using namespace filigree_test;

namespace {

std::string to_bytes(const Mesh& mesh, MeshFormat format, const WriteMeshOptions& options = {}) {
    std::string bytes;
    EXPECT_TRUE(write_mesh(mesh, format, bytes, options, RunContext()).ok());
    return bytes;
}

MeshFile from_bytes(const std::string& bytes, const std::string& name) {
    Result<MeshFile> file = read_mesh(bytes, name, kOneThread);
    EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().message);
    if (!file.ok()) return {};
    EXPECT_EQ(check_mesh(file->mesh), "");
    return std::move(*file);
}

std::string error_of(const std::string& bytes, const std::string& name) {
    const Result<MeshFile> file = read_mesh(bytes, name, kOneThread);
    EXPECT_FALSE(file.ok()) << name;
    return file.ok() ? "" : file.error().message;
}

template <class Vector>
bool same_bits(const std::vector<Vector>& a, const std::vector<Vector>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Vector)) == 0);
}

void expect_same_surface(const Mesh& a, const Mesh& b) {
    EXPECT_TRUE(same_bits(a.positions, b.positions));
    EXPECT_EQ(a.origin, b.origin);
    EXPECT_EQ(a.face_offsets, b.face_offsets);
    EXPECT_EQ(a.corners, b.corners);
}

/// The label of each face, "" for none: names may come in another order.
std::vector<std::string> label_names(const FaceLabels& labels) {
    std::vector<std::string> names;
    for (const Index label : labels.of_face) names.push_back(label == kNoIndex ? "" : labels.names[label]);
    return names;
}

const std::vector<std::pair<const char*, WriteMeshOptions>> kPlyKinds = {
    {"little", {}}, {"big", {.big_endian = true}}, {"ascii", {.ascii = true}}};

} // namespace

TEST(MeshFile, WhatNumbersCannotHoldIsNotWritten) {
    Mesh mesh = make_plain_mesh();
    mesh.positions[0].x() = std::numeric_limits<float>::infinity();
    const std::filesystem::path path = std::filesystem::temp_directory_path() / "filigree_too_far.ply";
    std::filesystem::remove(path);
    const auto written = write_mesh(mesh, path, {}, kOneThread);
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::unsuitable);
    EXPECT_EQ(
        written.error().message.find(path.string() + ": not written: the result is beyond what numbers can hold ("),
        0u);
    EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(MeshFile, SurfacesComeBackBitByBit) {
    for (const Mesh& mesh : {make_plain_mesh(), make_far_mesh()}) {
        expect_same_surface(from_bytes(to_bytes(mesh, MeshFormat::obj), "a.obj").mesh, mesh);
        expect_same_surface(from_bytes(to_bytes(mesh, MeshFormat::off), "a.off").mesh, mesh);
        for (const auto& [kind, options] : kPlyKinds) {
            SCOPED_TRACE(kind);
            expect_same_surface(from_bytes(to_bytes(mesh, MeshFormat::ply, options), "a.ply").mesh, mesh);
        }
    }
}

TEST(MeshFile, PlyKeepsWhatVerticesHave) {
    const Mesh mesh = make_vertex_attribute_mesh();
    for (const auto& [kind, options] : kPlyKinds) {
        SCOPED_TRACE(kind);
        std::string bytes;
        EXPECT_TRUE(write_mesh(mesh, MeshFormat::ply, bytes, options, RunContext())->empty());
        EXPECT_NE(bytes.find("property uchar alpha"), std::string::npos); // they are bytes
        const MeshFile file = from_bytes(bytes, "a.ply");
        EXPECT_TRUE(file.warnings.empty());
        expect_same_surface(file.mesh, mesh);
        EXPECT_TRUE(same_bits(file.mesh.uvs.values, mesh.uvs.values));
        EXPECT_TRUE(same_bits(file.mesh.normals.values, mesh.normals.values));
        EXPECT_TRUE(same_bits(file.mesh.colors, mesh.colors));
        EXPECT_TRUE(file.mesh.colors_have_alpha);
        ASSERT_EQ(file.mesh.scalars.size(), 2u);
        for (std::size_t i = 0; i < 2; ++i) {
            EXPECT_EQ(file.mesh.scalars[i].name, mesh.scalars[i].name);
            EXPECT_EQ(file.mesh.scalars[i].values, mesh.scalars[i].values);
        }
    }
}

TEST(MeshFile, PlyKeepsUvsOfCorners) {
    const Mesh mesh = make_corner_attribute_mesh();
    for (const auto& [kind, options] : kPlyKinds) {
        SCOPED_TRACE(kind);
        const MeshFile file = from_bytes(to_bytes(mesh, MeshFormat::ply, options), "a.ply");
        ASSERT_EQ(file.mesh.uvs.corners.size(), mesh.corner_count());
        for (std::size_t f = 0; f < mesh.face_count(); ++f)
            for (std::size_t c = mesh.face_offsets[f]; c < mesh.face_offsets[f + 1]; ++c) {
                const Index uv = file.mesh.uvs.corners[c];
                if (f == 1)
                    EXPECT_EQ(uv, kNoIndex); // a corner of this face has none
                else
                    EXPECT_EQ(file.mesh.uvs.values.at(uv), mesh.uvs.values[mesh.uvs.corners[c]]);
            }
    }
}

TEST(MeshFile, ObjKeepsCornersAndLabels) {
    const Mesh mesh = make_corner_attribute_mesh();
    std::string bytes;
    EXPECT_TRUE(write_mesh(mesh, MeshFormat::obj, bytes, {}, RunContext())->empty());
    const MeshFile file = from_bytes(bytes, "a.obj");
    EXPECT_TRUE(file.warnings.empty());
    expect_same_surface(file.mesh, mesh);
    EXPECT_TRUE(same_bits(file.mesh.uvs.values, mesh.uvs.values));
    EXPECT_EQ(file.mesh.uvs.corners, mesh.uvs.corners);
    EXPECT_TRUE(same_bits(file.mesh.normals.values, mesh.normals.values));
    EXPECT_EQ(file.mesh.normals.corners, mesh.normals.corners);
    EXPECT_TRUE(same_bits(file.mesh.colors, mesh.colors));
    EXPECT_EQ(label_names(file.mesh.objects), label_names(mesh.objects));
    EXPECT_EQ(label_names(file.mesh.groups), label_names(mesh.groups));
    EXPECT_EQ(label_names(file.mesh.materials), label_names(mesh.materials));
    EXPECT_EQ(file.mesh.smoothing, mesh.smoothing);
    EXPECT_EQ(file.mesh.material_files, mesh.material_files);
    EXPECT_EQ(to_bytes(file.mesh, MeshFormat::obj), bytes);
}

TEST(MeshFile, OffKeepsWhatVerticesHave) {
    const Mesh mesh = make_vertex_attribute_mesh();
    for (const bool alpha : {true, false}) {
        Mesh written = mesh;
        written.colors_have_alpha = alpha;
        const MeshFile file = from_bytes(to_bytes(written, MeshFormat::off), "a.off");
        EXPECT_TRUE(file.warnings.empty());
        EXPECT_TRUE(same_bits(file.mesh.uvs.values, mesh.uvs.values));
        EXPECT_TRUE(same_bits(file.mesh.normals.values, mesh.normals.values));
        EXPECT_EQ(file.mesh.colors_have_alpha, alpha);
        EXPECT_EQ(file.mesh.colors[3].head<3>(), mesh.colors[3].head<3>());
    }
}

TEST(MeshFile, StlIsClosedAgainAfterWelding) {
    Mesh cube;
    for (int v = 0; v < 8; ++v)
        cube.positions.emplace_back(v & 1 ? 1.0f : -0.0f, v & 2 ? 1.0f : 0.0f, v & 4 ? 1.0f : 0.0f);
    for (const auto& quad :
         {std::array<Index, 4>{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}})
        cube.add_face(quad);
    for (const bool ascii : {false, true}) {
        std::string bytes;
        const auto warnings = write_mesh(cube, MeshFormat::stl, bytes, {.ascii = ascii}, RunContext());
        ASSERT_EQ(warnings->size(), 1u); // quads are cut
        const MeshFile file = from_bytes(bytes, "a.stl");
        EXPECT_EQ(file.mesh.vertex_count(), 8u);
        EXPECT_EQ(file.mesh.face_count(), 12u);
    }
}

TEST(MeshFile, OneWarningListsWhatAFormatCannotHold) {
    const Mesh mesh = make_corner_attribute_mesh();
    std::string bytes;
    const auto warnings = write_mesh(mesh, MeshFormat::stl, bytes, {}, RunContext());
    ASSERT_EQ(warnings->size(), 1u);
    for (const char* lost :
         {"UVs", "normals", "colours", "objects", "groups", "materials", "smoothing", "three corners"})
        EXPECT_NE(warnings->front().find(lost), std::string::npos) << lost << ": " << warnings->front();
    const Mesh scalars = make_vertex_attribute_mesh();
    EXPECT_NE(write_mesh(scalars, MeshFormat::obj, bytes, {}, RunContext())->front().find("'quality'"),
              std::string::npos);
    EXPECT_NE(write_mesh(make_far_mesh(), MeshFormat::stl, bytes, {}, RunContext())->front().find("digits"),
              std::string::npos);
}

TEST(MeshFile, ContentDecidesTheFormat) {
    const Mesh mesh = make_plain_mesh();
    for (const MeshFormat format : {MeshFormat::obj, MeshFormat::ply, MeshFormat::stl, MeshFormat::off})
        EXPECT_EQ(from_bytes(to_bytes(mesh, format), "standard input").mesh.face_count() > 0, true);
    EXPECT_EQ(from_bytes(to_bytes(mesh, MeshFormat::ply), "wrong.obj").mesh.face_count(), 4u);
    EXPECT_EQ(from_bytes("\xef\xbb\xbf" + to_bytes(mesh, MeshFormat::off), "bom.off").mesh.face_count(), 4u);
}

TEST(MeshFile, ForeignContentIsNamed) {
    EXPECT_NE(error_of("\x1f\x8b\x08 and so on", "a.ply").find("gzip"), std::string::npos);
    EXPECT_NE(error_of("\x89PNG\r\n", "a.obj").find("PNG"), std::string::npos);
    EXPECT_NE(error_of(std::string("\xff\xfev\0 \0", 6), "a.obj").find("UTF-16"), std::string::npos);
    EXPECT_NE(error_of(std::string("v\0 \0001\0", 6), "a.obj").find("UTF-16"), std::string::npos);
    EXPECT_NE(error_of("{\"asset\": 2}", "a.gltf").find("has no \"asset\""), std::string::npos);
    EXPECT_NE(error_of("<html>", "a.obj").find("web page"), std::string::npos);
    EXPECT_NE(error_of("hello", "a.xyz").find(".obj, .ply, .stl, .off or .glb"), std::string::npos);
    EXPECT_NE(error_of("", "a.obj").find("empty"), std::string::npos);
    EXPECT_NE(error_of("# nothing\n", "a.obj").find("no vertices"), std::string::npos);
    EXPECT_NE(error_of("hello\nthere 1\n", "a.obj").find("the first: 'hello' in line 1"), std::string::npos);
}

TEST(MeshFile, EndingsNameFormatsInAnyCase) {
    EXPECT_EQ(*mesh_format("A.OBJ"), MeshFormat::obj);
    EXPECT_EQ(*mesh_format("x.y/b.Ply"), MeshFormat::ply);
    for (const MeshFormatInfo& info : mesh_formats())
        for (const std::string_view extension : {info.extension, info.other_extension}) {
            if (extension.empty()) continue;
            EXPECT_EQ(*mesh_format("mesh" + std::string(extension)), info.format) << extension;
        }
    EXPECT_EQ(mesh_format("model.fbx").error().code, ErrorCode::unsupported);
    EXPECT_EQ(mesh_format("model").error().code, ErrorCode::unsupported);
}

TEST(MeshFile, FilesOnDiskComeBack) {
    const auto path = std::filesystem::temp_directory_path() / ("filigree_mesh_" + std::to_string(::getpid()) + ".PLY");
    ASSERT_TRUE(write_mesh(make_plain_mesh(), path, {}, kOneThread).ok());
    expect_same_surface(read_mesh(path, kOneThread)->mesh, make_plain_mesh());
    ASSERT_TRUE(write_mesh(make_plain_mesh(), path, {.format = MeshFormat::off}, kOneThread).ok());
    EXPECT_EQ(read_file(path)->substr(0, 3), "OFF");
    std::filesystem::remove(path);
    EXPECT_EQ(read_mesh(path, kOneThread).error().code, ErrorCode::not_found);
    EXPECT_EQ(write_mesh(make_plain_mesh(), "-", {}, kOneThread).error().code, ErrorCode::unsupported);
}

TEST(MeshFile, CancelStopsReadingAndWriting) {
    const RunContext context(1);
    context.cancel();
    const std::string bytes = to_bytes(make_plain_mesh(), MeshFormat::obj);
    EXPECT_EQ(read_mesh(bytes, "a.obj", context).error().code, ErrorCode::cancelled);
    const auto path = std::filesystem::temp_directory_path() / "filigree_never_written.obj";
    EXPECT_EQ(write_mesh(make_plain_mesh(), path, {}, context).error().code, ErrorCode::cancelled);
    EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(MeshFile, NoLocaleChangesAByte) {
    const std::string bytes = to_bytes(make_far_mesh(), MeshFormat::obj);
    if (!std::setlocale(LC_ALL, "de_DE.UTF-8")) GTEST_SKIP() << "locale de_DE.UTF-8 is not installed";
    const std::string german = to_bytes(make_far_mesh(), MeshFormat::obj);
    const Mesh mesh = from_bytes(bytes, "a.obj").mesh;
    std::setlocale(LC_ALL, "C");
    EXPECT_EQ(german, bytes);
    expect_same_surface(mesh, make_far_mesh());
}

TEST(MeshFile, AttributesThatAreNotFiniteBecomeZero) {
    const MeshFile file = from_bytes("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn nan 0 1\nvt 0 inf\nf 1/1/1 2/1/1 3/1/1\n", "a.obj");
    EXPECT_EQ(file.mesh.normals.values[0], Vec3f::Zero());
    EXPECT_EQ(file.mesh.uvs.values[0], Vec2f::Zero());
    EXPECT_EQ(file.warnings.size(), 2u);
}
