#include "filigree/remesh/transfer_attributes.h"

#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/closest_point.h"
#include "io/corpus.h"
#include "threads.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <gtest/gtest.h>
#include <numbers>

namespace filigree {
namespace {

/// The closest point of `from` for each vertex of `to`.
std::vector<CornerPoint> points_on(const Mesh& from, const Mesh& to) {
    const Triangulation cut = triangulate(from);
    const ClosestPointTree tree(from.positions, cut.triangles);
    std::vector<CornerPoint> points;
    for (const Vec3f& p : to.positions) {
        const SurfacePoint closest = tree.closest(p);
        CornerPoint& point = points.emplace_back();
        point.barycentric = closest.barycentric;
        const Index face = cut.source_face[closest.triangle];
        for (int k = 0; k < 3; ++k) {
            const auto corners = from.face(face);
            point.corners[k] = from.face_offsets[face] +
                               Index(std::ranges::find(corners, cut.triangles[closest.triangle][k]) - corners.begin());
        }
    }
    return points;
}

Vec3d position(const Mesh& from, const CornerPoint& point) {
    Vec3d p = Vec3d::Zero();
    for (int k = 0; k < 3; ++k)
        p += double(point.barycentric[k]) * from.positions[from.corners[point.corners[k]]].cast<double>();
    return p;
}

Mesh transferred(const Mesh& from, const Mesh& to, const RunContext& context = kOneThread) {
    Mesh result = to;
    EXPECT_TRUE(transfer_attributes(from, points_on(from, to), result, context).ok());
    EXPECT_EQ(check_mesh(result), "");
    EXPECT_EQ(result.positions, to.positions);
    EXPECT_EQ(result.corners, to.corners);
    return result;
}

template <class T>
Index value_index(const Mesh& mesh, const CornerAttribute<T>& attribute, Index corner) {
    return attribute.per_vertex() ? mesh.corners[corner] : attribute.corners[corner];
}
Vec2f uv_at(const Mesh& mesh, Index corner) { return mesh.uvs.values[value_index(mesh, mesh.uvs, corner)]; }
Vec3f normal_at(const Mesh& mesh, Index corner) { return mesh.normals.values[value_index(mesh, mesh.normals, corner)]; }

/// The longer side of the box of a face's UVs.
float uv_extent(const Mesh& mesh, std::size_t face) {
    Vec2f low = Vec2f::Constant(1e30f), high = -low;
    for (Index c = mesh.face_offsets[face]; c < mesh.face_offsets[face + 1]; ++c) {
        low = low.cwiseMin(uv_at(mesh, c));
        high = high.cwiseMax(uv_at(mesh, c));
    }
    return (high - low).maxCoeff();
}

Vec2f affine_uv(const Vec3d& p) {
    return Eigen::Vector2d(0.3 * p.x() - 0.2 * p.y() + 0.7 * p.z() + 0.5, 0.1 * p.x() + 0.4 * p.y() + 0.25)
        .cast<float>();
}

/// The island of a side of the cube from -1/2 to 1/2, by the axis it faces (0 to 2) and its sign.
Vec2f island_uv(const Vec3d& p, int axis, bool positive) {
    const Eigen::Vector2d in_plane(p[(axis + 1) % 3], p[(axis + 2) % 3]);
    return (Eigen::Vector2d(axis + 0.5, positive ? 0.5 : 1.5) + 0.8 * in_plane).cast<float>();
}

int main_axis(const Vec3d& v) {
    int axis = 0;
    v.cwiseAbs().maxCoeff(&axis);
    return axis;
}

Vec3d face_centre(const Mesh& mesh, std::size_t face) {
    Vec3d centre = Vec3d::Zero();
    for (const Index v : mesh.face(face)) centre += mesh.positions[v].cast<double>() / mesh.face_size(face);
    return centre;
}

/// A cube of six sides with an island each, and flat normals.
Mesh cube_with_islands() {
    Mesh cube = make_box(Vec3d::Zero(), Vec3d::Ones());
    for (std::size_t f = 0; f < cube.face_count(); ++f) {
        const Vec3d centre = face_centre(cube, f);
        const int axis = main_axis(centre);
        for (const Index v : cube.face(f)) {
            cube.uvs.corners.push_back(Index(cube.uvs.values.size()));
            cube.uvs.values.push_back(island_uv(cube.positions[v].cast<double>(), axis, centre[axis] > 0));
            cube.normals.corners.push_back(Index(f));
        }
        cube.normals.values.push_back((2 * centre).cast<float>());
    }
    return cube;
}

/// The same surface with a vertex for each corner, as glTF has it.
Mesh with_vertex_per_corner(const Mesh& mesh) {
    Mesh split;
    for (Index c = 0; c < mesh.corner_count(); ++c) {
        split.positions.push_back(mesh.positions[mesh.corners[c]]);
        split.uvs.values.push_back(uv_at(mesh, c));
        split.normals.values.push_back(normal_at(mesh, c));
        split.corners.push_back(c);
    }
    split.face_offsets = mesh.face_offsets;
    return split;
}

/// An open tube about z of radius 1, `columns` around, with u once around from a seam at angle `start` on.
Mesh tube(unsigned columns, unsigned rows, double start) {
    Mesh mesh;
    for (unsigned y = 0; y <= rows; ++y)
        for (unsigned x = 0; x < columns; ++x) {
            const double angle = start + 2 * std::numbers::pi * x / columns;
            mesh.positions.push_back(Vec3d(std::cos(angle), std::sin(angle), 2.0 * y / rows - 1).cast<float>());
        }
    for (unsigned y = 0; y < rows; ++y)
        for (unsigned x = 0; x < columns; ++x) {
            const unsigned next = (x + 1) % columns;
            mesh.add_face(std::array<Index, 4>{y * columns + x, y * columns + next, (y + 1) * columns + next,
                                               (y + 1) * columns + x});
            for (const auto& [i, j] : {std::pair(x, y), {x + 1, y}, {x + 1, y + 1}, {x, y + 1}}) {
                mesh.uvs.corners.push_back(Index(mesh.uvs.values.size()));
                mesh.uvs.values.emplace_back(float(i) / float(columns), float(j) / float(rows));
            }
        }
    return mesh;
}

Mesh without_attributes(const Mesh& mesh) {
    Mesh plain;
    plain.positions = mesh.positions;
    plain.corners = mesh.corners;
    plain.face_offsets = mesh.face_offsets;
    return plain;
}

TEST(TransferAttributes, KeepsAnAffineField) {
    Mesh from = make_wavy_plane({.resolution = 12});
    for (std::size_t v = 0; v < from.vertex_count(); ++v)
        from.uvs.values[v] = affine_uv(from.positions[v].cast<double>());
    for (const unsigned resolution : {5u, 37u}) { // coarser and finer
        const Mesh to = without_attributes(make_wavy_plane({.resolution = resolution}));
        const Mesh result = transferred(from, to);
        ASSERT_TRUE(result.uvs.per_vertex()); // no seam was, so none becomes
        const auto points = points_on(from, to);
        for (std::size_t v = 0; v < to.vertex_count(); ++v)
            EXPECT_LT((result.uvs.values[v] - affine_uv(position(from, points[v]))).norm(), 1e-6f);
    }
}

TEST(TransferAttributes, GivesEachSideOfACubeItsIsland) {
    const unsigned n = 6; // a grid whose lines run along the cube's edges
    const Mesh to = without_attributes(make_wavy_cube({.resolution = n, .amplitude = 0}));
    for (const Mesh& from : {cube_with_islands(), with_vertex_per_corner(cube_with_islands())}) {
        const Mesh result = transferred(from, to);
        EXPECT_EQ(result.uvs.values.size(), 6 * (n + 1) * (n + 1)); // shared within a side, never across
        for (std::size_t f = 0; f < to.face_count(); ++f) {
            const Vec3d centre = face_centre(to, f);
            const int axis = main_axis(centre);
            for (Index c = to.face_offsets[f]; c < to.face_offsets[f + 1]; ++c) {
                const Vec3d p = to.positions[to.corners[c]].cast<double>();
                EXPECT_LT((uv_at(result, c) - island_uv(p, axis, centre[axis] > 0)).norm(), 1e-6f);
                EXPECT_LT((normal_at(result, c) - Vec3f(2 * Vec3f::Unit(axis) * float(centre[axis]))).norm(), 1e-6f);
            }
        }
    }
}

TEST(TransferAttributes, StretchesNoFaceAcrossACubesEdges) {
    const Mesh from = cube_with_islands();
    const Eigen::AngleAxisf turn(0.5f, Vec3f(1, 2, 3).normalized());
    for (const unsigned resolution : {4u, 9u, 20u}) {
        Mesh to = without_attributes(make_wavy_sphere({.resolution = resolution, .amplitude = 0}));
        for (Vec3f& p : to.positions) p = turn * p; // its lines cross the edges anywhere
        const auto points = points_on(from, to);
        for (std::size_t v = 0; v < to.vertex_count(); ++v) to.positions[v] = position(from, points[v]).cast<float>();
        const Mesh result = transferred(from, to);
        std::size_t crossing = 0;
        for (std::size_t f = 0; f < to.face_count(); ++f) {
            float size = 0;
            for (const Index v : to.face(f))
                size = std::max(size, (to.positions[v] - to.positions[to.face(f)[0]]).norm());
            EXPECT_LT(uv_extent(result, f), 1.6f * size); // islands are 0.8 of the cube's size
            const Vec3d centre = face_centre(to, f);
            std::array<float, 3> off = {}; // from the island of the side that faces along each axis, continued
            for (Index c = to.face_offsets[f]; c < to.face_offsets[f + 1]; ++c) {
                const Vec3d p = to.positions[to.corners[c]].cast<double>();
                crossing += main_axis(p) != main_axis(centre);
                for (int axis = 0; axis < 3; ++axis)
                    off[axis] = std::max(off[axis], (uv_at(result, c) - island_uv(p, axis, centre[axis] > 0)).norm());
            }
            EXPECT_LT(std::ranges::min(off), 1e-5f);
        }
        EXPECT_GT(crossing, 20u);
    }
}

TEST(TransferAttributes, CrossesTheSeamOfATubeOnce) {
    const double half_column = std::numbers::pi / 24;
    struct Case {
        unsigned from_columns, to_columns;
        double start;
    };
    for (const Case& c : {Case{24, 60, 0}, {24, 24, 0.9 * half_column}, {96, 12, 0.2}, {12, 12, 0}, {24, 7, 0.1}}) {
        const Mesh from = tube(c.from_columns, c.from_columns / 3, 0);
        const Mesh to = without_attributes(tube(c.to_columns, 10, c.start));
        const Mesh result = transferred(from, to);
        for (std::size_t f = 0; f < to.face_count(); ++f) {
            EXPECT_LT(uv_extent(result, f), 1.5f / float(std::min(c.to_columns, 10u))) << c.from_columns;
            for (Index corner = to.face_offsets[f]; corner < to.face_offsets[f + 1]; ++corner) {
                const Vec3f& p = to.positions[to.corners[corner]];
                const double turns = std::atan2(p.y(), p.x()) / (2 * std::numbers::pi);
                const double off = double(uv_at(result, corner).x()) - turns;
                EXPECT_NEAR(off, std::round(off), 0.25 / std::min(c.to_columns, c.from_columns));
            }
        }
        // one seam: a row of vertices with two values
        EXPECT_EQ(result.uvs.values.size(), to.vertex_count() + 11) << c.to_columns;
    }
}

TEST(TransferAttributes, KeepsTheUvsOfTheFox) {
    const auto path = filigree_test::corpus_folder() / "good/gltf/Fox/Fox.gltf";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
    const Mesh from = read_mesh(path, kOneThread)->mesh;
    ASSERT_FALSE(from.uvs.empty());
    Mesh to; // each triangle as three quads
    to.positions = from.positions;
    const std::vector<Triangle> triangles = triangulate(from).triangles;
    const auto add_point = [&](std::initializer_list<Index> of) {
        Vec3f sum = Vec3f::Zero();
        for (const Index v : of) sum += from.positions[v];
        to.positions.push_back(sum / float(of.size()));
        return Index(to.positions.size() - 1);
    };
    std::vector<CornerPoint> points(from.vertex_count());
    for (std::size_t f = 0; f < triangles.size(); ++f) {
        const auto& [a, b, c] = triangles[f];
        const Index ab = add_point({a, b}), bc = add_point({b, c}), ca = add_point({c, a}), m = add_point({a, b, c});
        to.add_face(std::array<Index, 4>{a, ab, m, ca});
        to.add_face(std::array<Index, 4>{b, bc, m, ab});
        to.add_face(std::array<Index, 4>{c, ca, m, bc});
        const Triangle corners = {Index(3 * f), Index(3 * f + 1), Index(3 * f + 2)};
        ASSERT_EQ(from.corners[3 * f + 1], b);
        const Vec3f units[] = {Vec3f::UnitX(), Vec3f::UnitY(), Vec3f::UnitZ()};
        points[a] = {corners, units[0]};
        points[b] = {corners, units[1]};
        points[c] = {corners, units[2]};
        points.push_back({corners, (units[0] + units[1]) / 2});
        points.push_back({corners, (units[1] + units[2]) / 2});
        points.push_back({corners, (units[2] + units[0]) / 2});
        points.push_back({corners, Vec3f::Constant(1.0f / 3)});
    }
    Mesh result = to;
    ASSERT_TRUE(transfer_attributes(from, points, result, kOneThread).ok());
    ASSERT_EQ(check_mesh(result), "");
    ASSERT_FALSE(result.uvs.empty());
    EXPECT_EQ(result.embedded_materials.size(), from.embedded_materials.size());
    double area_from = 0, area_to = 0, worst = 0;
    const auto doubled = [](const Vec2f& a, const Vec2f& b) {
        return std::abs(double(a.x()) * b.y() - double(a.y()) * b.x());
    };
    for (std::size_t f = 0; f < triangles.size(); ++f) {
        const Vec2f a = uv_at(from, Index(3 * f)), b = uv_at(from, Index(3 * f + 1)), c = uv_at(from, Index(3 * f + 2));
        area_from += doubled(b - a, c - a);
        for (std::size_t q = 3 * f; q < 3 * f + 3; ++q) {
            const Index first = to.face_offsets[q];
            area_to += doubled(uv_at(result, first + 2) - uv_at(result, first),
                               uv_at(result, first + 3) - uv_at(result, first + 1));
            const Vec2f expected = (a + b + c) / 3;
            worst = std::max(worst, double((uv_at(result, first + 2) - expected).norm()));
        }
    }
    EXPECT_LT(worst, 1e-6);
    EXPECT_NEAR(area_to, area_from, 1e-4 * area_from); // every quad has its third of a triangle's texture
}

TEST(TransferAttributes, InterpolatesColorsScalarsAndSmoothNormals) {
    Mesh from = make_wavy_sphere({.resolution = 20, .amplitude = 0});
    from.scalars.push_back({"height", {}});
    for (const Vec3f& p : from.positions) {
        from.colors.emplace_back(p.x() + 0.5f, p.y() + 0.5f, p.z() + 0.5f, 0.5f);
        from.scalars[0].values.push_back(2 * p.z());
        from.normals.values.push_back(5 * p); // not of unit length
    }
    from.colors_have_alpha = true;
    const Mesh to = make_wavy_sphere({.resolution = 13, .amplitude = 0});
    const auto points = points_on(from, to);
    const Mesh result = transferred(from, to);
    ASSERT_EQ(result.scalars.size(), 1u);
    EXPECT_EQ(result.scalars[0].name, "height");
    EXPECT_TRUE(result.colors_have_alpha);
    ASSERT_TRUE(result.normals.per_vertex());
    for (std::size_t v = 0; v < to.vertex_count(); ++v) {
        const Vec3f p = position(from, points[v]).cast<float>();
        EXPECT_LT((result.colors[v].head<3>() - p - Vec3f::Constant(0.5f)).norm(), 1e-6f);
        EXPECT_FLOAT_EQ(result.colors[v][3], 0.5f);
        EXPECT_NEAR(result.scalars[0].values[v], 2 * p.z(), 1e-6);
        EXPECT_NEAR(result.normals.values[v].norm(), 1, 1e-6);
        EXPECT_GT(result.normals.values[v].dot(p.normalized()), 0.999f);
    }
}

TEST(TransferAttributes, GivesFacesTheLabelsUnderTheirCentres) {
    Mesh from = make_wavy_plane({.resolution = 10, .amplitude = 0});
    from.materials.names = {"left", "right"};
    from.groups.names = {"all"};
    for (std::size_t f = 0; f < from.face_count(); ++f) {
        const bool right = face_centre(from, f).x() > 0;
        from.materials.of_face.push_back(right);
        from.groups.of_face.push_back(right ? 0 : kNoIndex);
        from.smoothing.push_back(right ? 7 : 0);
    }
    from.material_files = {"two.mtl"};
    from.embedded_materials.resize(2);
    from.embedded_materials[1].name = "right";
    for (const unsigned resolution : {7u, 33u}) { // odd: a column of centres is on the border
        Mesh to = without_attributes(make_wavy_plane({.resolution = resolution, .amplitude = 0}));
        for (Vec3f& p : to.positions) p.x() += 0.002f * (0.25f - p.x() * p.x()); // off it
        const Mesh result = transferred(from, to);
        ASSERT_EQ(result.materials.of_face.size(), to.face_count());
        for (std::size_t f = 0; f < to.face_count(); ++f) {
            const bool right = face_centre(to, f).x() > 0;
            EXPECT_EQ(result.materials.of_face[f], Index(right));
            EXPECT_EQ(result.groups.of_face[f], right ? 0 : kNoIndex);
            EXPECT_EQ(result.smoothing[f], right ? 7u : 0u);
        }
        EXPECT_EQ(result.materials.names, from.materials.names);
        EXPECT_EQ(result.material_files, from.material_files);
        EXPECT_EQ(result.embedded_materials.at(1).name, "right");
        EXPECT_TRUE(result.objects.empty());
    }
}

TEST(TransferAttributes, LeavesOutWhatTheInputHasNot) {
    Mesh from = cube_with_islands();
    const Mesh to = make_wavy_cube({.resolution = 5, .amplitude = 0});
    for (Index c = from.face_offsets[2]; c < from.face_offsets[3]; ++c) from.uvs.corners[c] = kNoIndex; // one side
    Mesh result = transferred(from, to);
    const auto without = std::ranges::count(result.uvs.corners, kNoIndex);
    EXPECT_EQ(without, 4 * 25);
    from = without_attributes(from);
    result = transferred(from, to);
    EXPECT_TRUE(result.uvs.empty());
    EXPECT_TRUE(result.normals.empty());
    EXPECT_TRUE(result.colors.empty());
    EXPECT_TRUE(result.materials.empty());
    EXPECT_TRUE(result.smoothing.empty());
}

TEST(TransferAttributes, FillsWhatWasFilledInFromItsNeighbours) {
    Mesh from = make_wavy_plane({.resolution = 8, .amplitude = 0});
    for (const Vec3f& p : from.positions) from.colors.emplace_back(p.x() + 0.5f, p.y() + 0.5f, 0.25f, 1.0f);
    from.materials = {{"paper"}, std::vector<Index>(from.face_count(), 0)};
    Mesh to = without_attributes(make_wavy_plane({.resolution = 8, .amplitude = 0}));
    std::vector<CornerPoint> points = points_on(from, to);
    for (Index v = 0; v < to.vertex_count(); ++v) // a patch in the middle, five vertices wide
        if (to.positions[v].head<2>().cwiseAbs().maxCoeff() < 0.3f) points[v] = {};
    ASSERT_EQ(std::ranges::count(points, kNoIndex, [](const CornerPoint& p) { return p.corners[0]; }), 25);
    const std::array<Index, 4> apart = {Index(to.vertex_count()), Index(to.vertex_count() + 1),
                                        Index(to.vertex_count() + 2), Index(to.vertex_count() + 3)};
    for (int k = 0; k < 4; ++k) to.positions.emplace_back(5.0f + float(k % 2), float(k / 2), 0.0f);
    to.add_face(apart); // nothing is known of it at all
    points.resize(to.vertex_count());
    ASSERT_TRUE(transfer_attributes(from, points, to, kOneThread).ok());
    ASSERT_EQ(check_mesh(to), "");
    for (Index v = 0; v < apart[0]; ++v) {
        EXPECT_EQ(to.colors[v][2], 0.25f);
        EXPECT_LE((to.colors[v].head<2>() - to.positions[v].head<2>() - Vec2f(0.5f, 0.5f)).norm(), 0.6f);
    }
    EXPECT_TRUE(to.colors[apart[0]].isZero(0));
    EXPECT_EQ(to.materials.of_face.front(), 0u);
    EXPECT_EQ(to.materials.of_face.back(), kNoIndex);
    EXPECT_EQ(std::ranges::count(to.uvs.corners, kNoIndex), 4);
}

TEST(TransferAttributes, SurvivesDegenerateInput) {
    Mesh from; // a needle, a point, and three faces at one edge, with a UV for every corner
    from.positions = {{0, 0, 0}, {1, 0, 0}, {0.5f, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}};
    for (const auto& t : {Triangle{0, 1, 2}, {0, 0, 0}, {0, 1, 3}, {0, 1, 4}, {1, 0, 5}}) from.add_face(t);
    for (Index c = 0; c < from.corner_count(); ++c) {
        from.uvs.corners.push_back(c);
        from.uvs.values.emplace_back(float(c), float(c % 4));
    }
    from.normals.values.assign(6, Vec3f::Zero());
    Mesh to = without_attributes(make_wavy_plane({.resolution = 9, .size = 3}));
    EXPECT_TRUE(transferred(from, to).normals.empty());
    Mesh none;
    EXPECT_TRUE(transfer_attributes(from, {}, none, kOneThread).ok());
    EXPECT_TRUE(transfer_attributes(Mesh(), std::vector<CornerPoint>(to.vertex_count()), to, kOneThread).ok());
    EXPECT_EQ(check_mesh(to), "");
}

TEST(TransferAttributes, IsIndependentOfThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh from = cube_with_islands(), to = make_wavy_sphere({.resolution = 30});
    const Mesh one = transferred(from, to), two = transferred(from, to, RunContext(2));
    EXPECT_EQ(one.uvs.values, two.uvs.values);
    EXPECT_EQ(one.uvs.corners, two.uvs.corners);
    EXPECT_EQ(one.normals.values, two.normals.values);
    EXPECT_EQ(one.normals.corners, two.normals.corners);
}

TEST(TransferAttributes, CanBeCancelled) {
    const Mesh from = cube_with_islands();
    Mesh to = make_wavy_sphere({.resolution = 4});
    const auto points = points_on(from, to);
    const RunContext context(1);
    context.cancel();
    EXPECT_EQ(transfer_attributes(from, points, to, context).error().code, ErrorCode::cancelled);
}

/// Quads near the rim of a round polygon, and the processor seconds that their attributes take.
struct Rim {
    Mesh copies;
    double seconds = 0;
};

Rim transferred_from_polygon(Index corners) {
    Mesh polygon;
    std::vector<Index> face;
    for (Index c = 0; c < corners; ++c) {
        const double angle = 2 * std::numbers::pi * c / corners;
        polygon.positions.push_back(Vec3d(std::cos(angle), std::sin(angle), 0).cast<float>());
        polygon.uvs.values.push_back(affine_uv(polygon.positions.back().cast<double>()));
        face.push_back(c);
    }
    polygon.add_face(face);
    Rim rim;
    std::vector<CornerPoint> points;
    for (Index c = 1; c + 1 < corners; c += 50) {
        face.clear();
        for (const Vec3f& weights : {Vec3f(1, 0, 0), Vec3f(0.5f, 0.5f, 0), Vec3f(0, 1, 0), Vec3f(0, 0, 1)}) {
            face.push_back(Index(points.size()));
            points.push_back({{c, c + 1, c - 1}, weights});
            rim.copies.positions.push_back(position(polygon, points.back()).cast<float>());
        }
        rim.copies.add_face(face);
    }
    const std::clock_t start = std::clock();
    EXPECT_TRUE(transfer_attributes(polygon, points, rim.copies, kOneThread).ok());
    rim.seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
    return rim;
}

TEST(TransferAttributes, APolygonOfManyCornersTakesLinearTime) {
    const double quarter = transferred_from_polygon(50'000).seconds;
    const Rim rim = transferred_from_polygon(200'000);
    EXPECT_LT(rim.seconds, 10 * quarter); // 16 times where each triangle looks through the face
    EXPECT_EQ(rim.copies.uvs.values.size(), rim.copies.vertex_count());
    EXPECT_LT((rim.copies.uvs.values[7] - affine_uv(rim.copies.positions[7].cast<double>())).norm(), 1e-5f);
}

} // namespace
} // namespace filigree
