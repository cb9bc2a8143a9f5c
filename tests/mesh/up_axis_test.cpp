#include "filigree/mesh/up_axis.h"

#include "filigree/mesh.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

namespace filigree {
namespace {

constexpr std::array kAxes = {UpAxis::x, UpAxis::y, UpAxis::z};

/// The mesh with its y axis along `up`.
Mesh turned(Mesh mesh, UpAxis up) {
    for (Vec3f& p : mesh.positions)
        for (int turns = (static_cast<int>(up) + 2) % 3; turns > 0; --turns) p = Vec3f(p.z(), p.x(), p.y());
    return mesh;
}

/// A dome over the xz plane, with y up: 24 by 8 quads. With a base of one polygon, or open below.
Mesh dome(bool has_base) {
    Mesh mesh;
    constexpr int kAround = 24, kRows = 8;
    for (int row = 0; row <= kRows; ++row)
        for (int k = 0; k < kAround; ++k) {
            const double angle = 2 * std::numbers::pi * k / kAround, height = 0.48 * std::numbers::pi * row / kRows;
            mesh.positions.emplace_back(float(std::cos(height) * std::cos(angle)), float(2 * std::sin(height)),
                                        float(-std::cos(height) * std::sin(angle)));
        }
    const auto id = [](int row, int k) { return Index(row * kAround + k % kAround); };
    for (int row = 0; row < kRows; ++row)
        for (int k = 0; k < kAround; ++k)
            mesh.add_face(std::array{id(row, k), id(row, k + 1), id(row + 1, k + 1), id(row + 1, k)});
    std::vector<Index> bottom;
    for (int k = kAround; k-- > 0;) bottom.push_back(id(0, k));
    if (has_base) mesh.add_face(bottom);
    return mesh;
}

/// No vertex is shared.
Mesh unwelded(const Mesh& mesh) {
    Mesh result;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        std::vector<Index> face;
        for (const Index v : mesh.face(f)) {
            face.push_back(Index(result.positions.size()));
            result.positions.push_back(mesh.positions[v]);
        }
        result.add_face(face);
    }
    return result;
}

TEST(UpAxisTest, AFlatBaseIsBelow) {
    for (const UpAxis up : kAxes)
        for (const UpAxis usual : kAxes)
            for (const bool has_base : {true, false}) {
                const Mesh mesh = turned(dome(has_base), up);
                EXPECT_EQ(find_up_axis(mesh, usual), up) << has_base;
                EXPECT_EQ(find_up_axis(unwelded(mesh), usual), up) << has_base;
            }
}

TEST(UpAxisTest, WithoutAClearBaseItIsTheUsualOne) {
    for (const UpAxis usual : kAxes) {
        EXPECT_EQ(find_up_axis({}, usual), usual);
        EXPECT_EQ(find_up_axis(make_ball(Vec3d::Zero(), 1), usual), usual);
        EXPECT_EQ(find_up_axis(make_box(Vec3d::Zero(), Vec3d::Ones()), usual), usual);
        for (const Vec3d& column : {Vec3d(3, 1, 1), Vec3d(1, 3, 1), Vec3d(1, 1, 3)}) // stands or lies
            EXPECT_EQ(find_up_axis(make_box(Vec3d::Zero(), column), usual), usual);
        Mesh upside_down = dome(true);
        for (Vec3f& p : upside_down.positions) p = Vec3f(p.x(), -p.y(), -p.z());
        EXPECT_EQ(find_up_axis(upside_down, usual), usual);
        Mesh sheet;
        sheet.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
        sheet.add_face(std::array<Index, 4>{0, 1, 2, 3});
        EXPECT_EQ(find_up_axis(sheet, usual), usual);
        Mesh points;
        points.positions = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
        EXPECT_EQ(find_up_axis(points, usual), usual);
    }
}

TEST(UpAxisTest, APlateLies) { EXPECT_EQ(find_up_axis(make_box(Vec3d::Zero(), {3, 4, 0.2}), UpAxis::y), UpAxis::z); }

TEST(UpAxisTest, FilesHaveTheirHabits) {
    EXPECT_EQ(usual_up_axis("part.stl"), UpAxis::z);
    EXPECT_EQ(usual_up_axis("a/PART.STL"), UpAxis::z);
    for (const char* path : {"scan.ply", "a.obj", "b.glb", "stl", "-", ""}) EXPECT_EQ(usual_up_axis(path), UpAxis::y);
}

} // namespace
} // namespace filigree
