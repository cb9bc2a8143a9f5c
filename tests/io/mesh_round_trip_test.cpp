// Any mesh, with any attributes that a format holds, written and read back.
#include "filigree/io/mesh_file.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
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
    RC_ASSERT(write_mesh(mesh, format, bytes, options).ok());
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
