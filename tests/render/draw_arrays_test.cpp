// Meshes as the GPU draws them: what is shared, what is split, and which sides are edges.
#include "filigree/render/draw_arrays.h"

#include "filigree/mesh.h"
#include "threads.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

using namespace filigree;

namespace {

DrawArrays draw_arrays(const Mesh& mesh, const SurfaceOptions& options = {}) {
    EXPECT_EQ(check_mesh(mesh), "");
    Result<DrawArrays> made = make_draw_arrays(mesh, mesh.positions, options, kOneThread);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
    if (!made) return {};
    const DrawArrays& draw = *made;
    EXPECT_EQ(draw.normals.size(), draw.vertex.size());
    EXPECT_EQ(draw.uvs.size(), mesh.uvs.empty() ? 0 : draw.vertex.size());
    EXPECT_EQ(draw.edges.size(), draw.triangles.size());
    for (Index v : draw.vertex) EXPECT_LT(v, mesh.vertex_count());
    for (const Triangle& t : draw.triangles)
        for (Index v : t) EXPECT_LT(v, draw.vertex.size());
    for (const Vec3f& n : draw.normals) EXPECT_TRUE(n.isZero(0) || std::abs(n.norm() - 1) < 1e-5f) << n.transpose();
    Index next = 0;
    for (const DrawArrays::Part& part : draw.parts) {
        EXPECT_EQ(part.first, next);
        EXPECT_GT(part.count, 0u);
        next += part.count;
    }
    EXPECT_EQ(next, draw.triangles.size());
    return std::move(*made);
}

Mesh mesh_of(std::vector<Vec3f> positions, const std::vector<std::vector<Index>>& faces) {
    Mesh mesh;
    mesh.positions = std::move(positions);
    for (const std::vector<Index>& face : faces) mesh.add_face(face);
    return mesh;
}

Mesh cube() { return make_wavy_cube({.resolution = 1, .amplitude = 0}); }

/// A flat polygon in the plane z = 0.
Mesh polygon(const std::vector<Vec2f>& outline) {
    Mesh mesh;
    std::vector<Index> face;
    for (const Vec2f& p : outline) {
        face.push_back(static_cast<Index>(mesh.vertex_count()));
        mesh.positions.emplace_back(p.x(), p.y(), 0.0f);
    }
    mesh.add_face(face);
    return mesh;
}

using Side = std::pair<Index, Index>; ///< mesh vertices, the lower first

Side side(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

/// The sides of triangles that are marked as edges, or those that are not.
std::multiset<Side> sides(const DrawArrays& draw, bool marked) {
    std::multiset<Side> found;
    for (std::size_t t = 0; t < draw.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k)
            if (bool(draw.edges[t] >> k & 1) == marked)
                found.insert(side(draw.vertex[draw.triangles[t][k]], draw.vertex[draw.triangles[t][(k + 1) % 3]]));
    return found;
}

std::multiset<Side> polygon_sides(const Mesh& mesh) {
    std::multiset<Side> found;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (std::size_t k = 0; k < mesh.face_size(f); ++k)
            found.insert(side(mesh.face(f)[k], mesh.face(f)[(k + 1) % mesh.face_size(f)]));
    return found;
}

/// Different normals, up to rounding.
std::size_t normal_count(const DrawArrays& draw) {
    std::vector<Vec3f> seen;
    for (const Vec3f& n : draw.normals)
        if (std::none_of(seen.begin(), seen.end(), [&](const Vec3f& s) { return (s - n).norm() < 1e-5f; }))
            seen.push_back(n);
    return seen.size();
}

/// A mesh whose triangles share no vertex, as STL has them.
Mesh soup_of(const Mesh& mesh) {
    Mesh soup;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        std::vector<Index> face;
        for (Index v : mesh.face(f)) {
            face.push_back(static_cast<Index>(soup.vertex_count()));
            soup.positions.push_back(mesh.positions[v]);
        }
        soup.add_face(face);
    }
    return soup;
}

/// A cone of `count` triangles around a tip, vertex 0.
Mesh fan(Index count, float height) {
    Mesh mesh;
    mesh.positions.emplace_back(0.0f, 0.0f, height);
    for (Index i = 0; i < count; ++i) {
        const double angle = 2 * std::numbers::pi * i / count;
        mesh.positions.emplace_back(float(std::cos(angle)), float(std::sin(angle)), 0.0f);
    }
    for (Index i = 0; i < count; ++i) mesh.add_face(std::array<Index, 3>{0, 1 + i, 1 + (i + 1) % count});
    return mesh;
}

} // namespace

TEST(DrawArrays, QuadsKeepTheirEdgesAndLoseTheDiagonal) {
    const Mesh mesh = make_wavy_cube({.resolution = 8, .frequency = 2, .amplitude = 0.1});
    const DrawArrays draw = draw_arrays(mesh);
    EXPECT_EQ(draw.triangles.size(), 2 * mesh.face_count());
    EXPECT_EQ(sides(draw, true), polygon_sides(mesh));
    EXPECT_EQ(sides(draw, false).size(), 2 * mesh.face_count()); // each diagonal twice
    for (std::uint8_t e : draw.edges) EXPECT_EQ(std::popcount(e), 2);
}

TEST(DrawArrays, TrianglesAreAllEdges) {
    const DrawArrays draw = draw_arrays(fan(7, 1));
    for (std::uint8_t e : draw.edges) EXPECT_EQ(e, 7);
}

TEST(DrawArrays, PolygonsKeepTheirOutline) {
    std::vector<Vec2f> star, comb;
    for (int i = 0; i < 24; ++i) {
        const double angle = 2 * std::numbers::pi * i / 24, r = i % 2 ? 0.4 : 1;
        star.emplace_back(float(r * std::cos(angle)), float(r * std::sin(angle)));
    }
    for (int i = 0; i < 9; ++i) comb.emplace_back(float(i), 0.0f);
    for (int i = 9; i-- > 0;) comb.emplace_back(float(i), i % 2 ? 0.5f : 3.0f);
    const std::vector<Vec2f> arrow = {{0, 0}, {1, 1}, {0, 3}, {-1, 1}}, dart = {{0, 0}, {2, -1}, {0, 3}, {-2, -1}};
    for (const std::vector<Vec2f>& outline : {star, comb, arrow, dart}) {
        const Mesh mesh = polygon(outline);
        const DrawArrays draw = draw_arrays(mesh);
        EXPECT_EQ(draw.triangles.size(), outline.size() - 2);
        EXPECT_EQ(sides(draw, true), polygon_sides(mesh));
        for (const Vec3f& n : draw.normals) EXPECT_LT((n - Vec3f::UnitZ()).norm(), 1e-6f);
        EXPECT_EQ(draw.vertex.size(), outline.size());
    }
}

/// A square ring as one polygon whose outline runs over the same bridge twice.
TEST(DrawArrays, AnOutlineMayPassAVertexTwice) {
    const Mesh mesh = mesh_of({{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 3, 0}, {1, 1, 0}, {1, 2, 0}, {2, 2, 0}, {2, 1, 0}},
                              {{0, 1, 2, 3, 0, 4, 5, 6, 7, 4}});
    const DrawArrays draw = draw_arrays(mesh);
    EXPECT_EQ(draw.triangles.size(), 8u);
    const std::multiset<Side> marked = sides(draw, true);
    for (const Side& s :
         {side(0, 1), side(1, 2), side(2, 3), side(0, 3), side(4, 5), side(5, 6), side(6, 7), side(4, 7)})
        EXPECT_EQ(marked.count(s), 1u) << s.first << " " << s.second;
}

TEST(DrawArrays, ACubeIsSharpAndItsFacesAreFlat) {
    const DrawArrays draw = draw_arrays(cube());
    EXPECT_EQ(draw.vertex.size(), 24u);
    EXPECT_EQ(draw.triangles.size(), 12u);
    EXPECT_EQ(normal_count(draw), 6u);
    for (const Vec3f& n : draw.normals) EXPECT_NEAR(n.cwiseAbs().maxCoeff(), 1, 1e-6);
}

TEST(DrawArrays, TheCreaseAngleDecides) {
    for (const double angle : {10.0, 44.0, 46.0, 90.0, 170.0}) { // two squares that meet along an edge
        const double a = angle * std::numbers::pi / 180;
        const float c = float(std::cos(a)), s = float(std::sin(a));
        const Mesh mesh =
            mesh_of({{-1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {-1, 1, 0}, {c, 0, s}, {c, 1, s}}, {{0, 1, 2, 3}, {1, 4, 5, 2}});
        for (const double crease : {0.0, 5.0, 45.0, 120.0, 180.0}) {
            const DrawArrays draw = draw_arrays(mesh, {.crease_deg = crease});
            EXPECT_EQ(draw.vertex.size(), angle <= crease ? 6u : 8u) << angle << " " << crease;
            for (const Vec3f& n : draw.normals) EXPECT_FALSE(n.isZero(0)) << angle << " " << crease;
        }
    }
    EXPECT_EQ(draw_arrays(cube(), {.crease_deg = 89}).vertex.size(), 24u);
    EXPECT_EQ(draw_arrays(cube(), {.crease_deg = 91}).vertex.size(), 8u);
    EXPECT_EQ(draw_arrays(cube(), {.shading = Shading::smooth}).vertex.size(), 8u);
    EXPECT_EQ(draw_arrays(cube(), {.shading = Shading::flat}).vertex.size(), 24u);
}

TEST(DrawArrays, ASmoothSphereHasOneDrawVertexAVertex) {
    const Mesh sphere = make_wavy_sphere({.resolution = 16, .amplitude = 0});
    const DrawArrays draw = draw_arrays(sphere);
    ASSERT_EQ(draw.vertex.size(), sphere.vertex_count());
    for (std::size_t d = 0; d < draw.vertex.size(); ++d)
        EXPECT_GT(draw.normals[d].dot(sphere.positions[draw.vertex[d]].normalized()), 0.998f);
    EXPECT_EQ(normal_count(draw_arrays(sphere, {.shading = Shading::flat})), sphere.face_count());
}

TEST(DrawArrays, ASoupIsAsSmoothAsTheWeldedMesh) {
    const Mesh sphere = make_wavy_sphere({.resolution = 8}), soup = soup_of(sphere);
    const DrawArrays welded = draw_arrays(sphere), unwelded = draw_arrays(soup);
    EXPECT_EQ(unwelded.vertex.size(), soup.vertex_count()); // each stays itself: it may be coloured on its own
    std::vector<Vec3f> normals(sphere.vertex_count());
    for (std::size_t d = 0; d < welded.vertex.size(); ++d) normals[welded.vertex[d]] = welded.normals[d];
    for (std::size_t d = 0; d < unwelded.vertex.size(); ++d)
        EXPECT_LT((unwelded.normals[d] - normals[sphere.corners[unwelded.vertex[d]]]).norm(), 1e-5f);
    EXPECT_EQ(normal_count(draw_arrays(soup_of(cube()))), 6u);
}

TEST(DrawArrays, SeamsOfUvsSplitAndNothingElseDoes) {
    Mesh plane = make_wavy_plane({.resolution = 4, .amplitude = 0});
    ASSERT_TRUE(plane.uvs.per_vertex());
    EXPECT_EQ(draw_arrays(plane).vertex.size(), 25u);

    // The same UVs a corner, and then the left half of the faces (columns 0 and 1) with others.
    plane.uvs.corners = plane.corners;
    const DrawArrays whole = draw_arrays(plane);
    EXPECT_EQ(whole.vertex.size(), 25u);
    for (std::size_t d = 0; d < whole.vertex.size(); ++d) EXPECT_EQ(whole.uvs[d], plane.uvs.values[whole.vertex[d]]);
    const auto is_left = [&](std::size_t face) {
        float x = 0;
        for (Index v : plane.face(face)) x += plane.positions[v].x();
        return x < 0;
    };
    for (Index v = 0; v < 25; ++v) plane.uvs.values.push_back(plane.uvs.values[v] + Vec2f(10, 0));
    for (std::size_t f = 0; f < plane.face_count(); ++f)
        for (Index c = plane.face_offsets[f]; c < plane.face_offsets[f + 1]; ++c)
            if (is_left(f)) plane.uvs.corners[c] += 25;
    const DrawArrays split = draw_arrays(plane);
    EXPECT_EQ(split.vertex.size(), 30u); // the five on the seam twice
    EXPECT_EQ(normal_count(split), 1u);  // and as smooth as before
    for (const Triangle& t : split.triangles) {
        int left = 0;
        for (Index v : t) left += split.uvs[v].x() >= 10;
        EXPECT_TRUE(left == 0 || left == 3);
    }

    plane.uvs.corners[0] = kNoIndex; // one corner without
    const DrawArrays holed = draw_arrays(plane);
    for (const Vec2f& uv : holed.uvs) EXPECT_TRUE(uv.allFinite());
}

TEST(DrawArrays, MaterialsAreRunsInTheirOrderAndFacesWithoutComeLast) {
    Mesh plane = make_wavy_plane({.resolution = 4, .amplitude = 0});
    plane.materials.names = {"red", "unused", "blue"};
    for (std::size_t f = 0; f < plane.face_count(); ++f)
        plane.materials.of_face.push_back(f % 4 == 0 ? 0u : f % 4 == 1 ? 2u : kNoIndex);
    EXPECT_EQ(draw_arrays(plane).parts.size(), 1u); // nobody asked for materials
    const SurfaceOptions options{.materials = std::vector<SurfaceMaterial>(3)};
    const DrawArrays draw = draw_arrays(plane, options);
    ASSERT_EQ(draw.parts.size(), 3u);
    EXPECT_EQ(draw.parts[0].material, 0u);
    EXPECT_EQ(draw.parts[0].count, 8u);
    EXPECT_EQ(draw.parts[1].material, 2u);
    EXPECT_EQ(draw.parts[1].count, 8u);
    EXPECT_EQ(draw.parts[2].material, kNoIndex);
    EXPECT_EQ(draw.parts[2].count, 16u);
    EXPECT_EQ(draw.vertex.size(), 25u);
    EXPECT_EQ(sides(draw, true), polygon_sides(plane));

    // The triangles of a run are those of its faces.
    std::multiset<Index> drawn, expected;
    for (Index t = 0; t < 8; ++t)
        for (Index v : draw.triangles[t]) drawn.insert(draw.vertex[v]);
    for (std::size_t f = 0; f < plane.face_count(); f += 4)
        for (Index v : plane.face(f)) expected.insert(v);
    EXPECT_EQ(std::set<Index>(drawn.begin(), drawn.end()), std::set<Index>(expected.begin(), expected.end()));
}

TEST(DrawArrays, HiddenFacesAreLeftOutButStillSmooth) {
    const Mesh sphere = make_wavy_sphere({.resolution = 6, .amplitude = 0});
    SurfaceOptions options;
    options.hidden_faces.assign(sphere.face_count(), 0);
    std::multiset<Side> expected;
    for (std::size_t f = 0; f < sphere.face_count(); ++f) {
        options.hidden_faces[f] = f % 3 == 0;
        if (f % 3 == 0) continue;
        for (std::size_t k = 0; k < 4; ++k) expected.insert(side(sphere.face(f)[k], sphere.face(f)[(k + 1) % 4]));
    }
    const DrawArrays draw = draw_arrays(sphere, options), all = draw_arrays(sphere);
    EXPECT_EQ(sides(draw, true), expected);
    EXPECT_EQ(draw.normals.size(), all.normals.size());
    EXPECT_TRUE(std::equal(draw.normals.begin(), draw.normals.end(), all.normals.begin()));
    options.hidden_faces.assign(sphere.face_count(), 1);
    const DrawArrays none = draw_arrays(sphere, options);
    EXPECT_TRUE(none.triangles.empty());
    EXPECT_TRUE(none.parts.empty());
}

TEST(DrawArrays, TheFilesNormalsAreTakenAsTheyAre) {
    Mesh mesh = cube();
    for (const Vec3f& p : mesh.positions) mesh.normals.values.push_back(7 * p); // not of unit length
    const DrawArrays smooth = draw_arrays(mesh);
    ASSERT_EQ(smooth.vertex.size(), 8u);
    for (std::size_t d = 0; d < 8; ++d)
        EXPECT_LT((smooth.normals[d] - mesh.positions[smooth.vertex[d]].normalized()).norm(), 1e-6f);
    EXPECT_EQ(normal_count(draw_arrays(mesh, {.shading = Shading::flat})), 6u); // unless others are asked for

    // One normal for all corners, and one corner without.
    mesh.normals.values = {{0, 0, 1}};
    mesh.normals.corners.assign(mesh.corner_count(), 0);
    mesh.normals.corners[5] = kNoIndex;
    const DrawArrays corners = draw_arrays(mesh);
    EXPECT_EQ(corners.vertex.size(), 9u);
    EXPECT_EQ(std::count_if(corners.normals.begin(), corners.normals.end(), [](const Vec3f& n) { return n.isZero(0); }),
              1);
    mesh.normals.values = {{0, 0, 0}}; // a file may say so
    for (const Vec3f& n : draw_arrays(mesh).normals) EXPECT_TRUE(n.isZero(0));
}

TEST(DrawArrays, DegenerateFacesDisturbNobody) {
    // A square; a face of one point, a needle, a face that names a vertex twice, and one of no area out in the open.
    const Mesh mesh = mesh_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {5, 5, 5}, {6, 5, 5}, {7, 5, 5}},
                              {{0, 1, 2, 3}, {0, 0, 0}, {0, 1, 0}, {1, 1, 2, 3}, {4, 5, 6}});
    for (const Shading shading : {Shading::automatic, Shading::smooth, Shading::flat}) {
        const DrawArrays draw = draw_arrays(mesh, {.shading = shading});
        EXPECT_EQ(draw.triangles.size(), 2u + 1 + 1 + 2 + 1);
        for (Index t = 0; t < 2; ++t)
            for (Index v : draw.triangles[t]) EXPECT_LT((draw.normals[v] - Vec3f::UnitZ()).norm(), 1e-6f);
        for (std::size_t d = 0; d < draw.vertex.size(); ++d)
            EXPECT_TRUE(draw.vertex[d] <= 3 || draw.normals[d].isZero(0));
    }
}

TEST(DrawArrays, AFanOfAThousandFaces) {
    const Mesh flat = fan(1000, 0.1f), steep = fan(1000, 5);
    EXPECT_EQ(draw_arrays(flat).vertex.size(), 1001u);
    const DrawArrays tip = draw_arrays(steep); // too many to look at all pairs: smooth
    EXPECT_EQ(std::count(tip.vertex.begin(), tip.vertex.end(), 0u), 1);
    const DrawArrays cone = draw_arrays(fan(200, 5)); // few enough: the tip's normal leans to each side
    EXPECT_GT(std::count(cone.vertex.begin(), cone.vertex.end(), 0u), 50);
    const DrawArrays facets = draw_arrays(steep, {.shading = Shading::flat});
    EXPECT_EQ(facets.vertex.size(), 3000u);
}

TEST(DrawArrays, SizeDoesNotMatter) {
    const Mesh sphere = make_wavy_sphere({.resolution = 6});
    const DrawArrays expected = draw_arrays(sphere);
    for (const float scale : {1e-30f, 1e-12f, 1e12f, 1e30f}) {
        Mesh scaled = sphere;
        for (Vec3f& p : scaled.positions) p *= scale;
        const DrawArrays draw = draw_arrays(scaled);
        ASSERT_EQ(draw.vertex.size(), expected.vertex.size()) << scale;
        for (std::size_t d = 0; d < draw.vertex.size(); ++d)
            EXPECT_LT((draw.normals[d] - expected.normals[d]).norm(), 1e-4f) << scale;
    }
}

TEST(DrawArrays, ThreadsDoNotMatterAndCancellingDoes) {
    const Mesh sphere = make_wavy_sphere({.resolution = 40});
    const DrawArrays one = draw_arrays(sphere);
    const Result<DrawArrays> many = make_draw_arrays(sphere, sphere.positions, {}, RunContext(8));
    ASSERT_TRUE(many.ok());
    EXPECT_EQ(one.vertex, many->vertex);
    EXPECT_TRUE(std::equal(one.normals.begin(), one.normals.end(), many->normals.begin()));
    EXPECT_EQ(one.triangles, many->triangles);
    const RunContext cancelled(1);
    cancelled.cancel();
    const Result<DrawArrays> none = make_draw_arrays(sphere, sphere.positions, {}, cancelled);
    ASSERT_FALSE(none.ok());
    EXPECT_EQ(none.error().code, ErrorCode::cancelled);
}

TEST(DrawArrays, NothingIsNothing) {
    EXPECT_TRUE(draw_arrays(Mesh()).triangles.empty());
    Mesh points;
    points.positions = {{0, 0, 0}, {1, 0, 0}};
    EXPECT_TRUE(draw_arrays(points).vertex.empty());
}
