#include "filigree/mesh/orientation.h"

#include "filigree/mesh/shapes.h"
#include "filigree/mesh/surface.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace filigree {
namespace {

double volume(std::span<const Triangle> triangles, std::span<const Vec3f> positions) {
    double six = 0;
    for (const Triangle& t : triangles)
        six += positions[t[0]].cast<double>().dot(positions[t[1]].cast<double>().cross(positions[t[2]].cast<double>()));
    return six / 6;
}

/// Some of the faces, by chance.
void turn(std::vector<Triangle>& triangles, double part, unsigned seed) {
    std::mt19937 random(seed);
    for (Triangle& t : triangles)
        if (double(random() % 1000) < 1000 * part) std::swap(t[1], t[2]);
}

TEST(Orientation, AFewTurnedFacesAreTurnedBack) {
    const Mesh mesh = make_wavy_sphere({.resolution = 8});
    const std::vector<Triangle> right = make_surface(mesh, kAllThreads)->triangles;
    for (const bool is_hollow : {false, true}) { // a hollow's faces look inwards, and stay so
        std::vector<Triangle> whole = right;
        if (is_hollow)
            for (Triangle& t : whole) std::swap(t[1], t[2]);
        std::vector<Triangle> some = whole;
        turn(some, 0.2, 1);
        EXPECT_GT(orient(some, mesh.positions), 0u);
        EXPECT_NEAR(volume(some, mesh.positions), volume(whole, mesh.positions), 1e-9);
        EXPECT_EQ(orient(some, mesh.positions), 0u);
    }
}

TEST(Orientation, WhereNoWayPrevailsFacesLookOutwards) {
    const Mesh mesh = make_wavy_sphere({.resolution = 8});
    const std::vector<Triangle> right = make_surface(mesh, kAllThreads)->triangles;
    for (unsigned seed = 0; seed < 6; ++seed) {
        std::vector<Triangle> some = right;
        turn(some, 0.5, seed);
        orient(some, mesh.positions);
        EXPECT_NEAR(volume(some, mesh.positions), volume(right, mesh.positions), 1e-9);
    }
}

TEST(Orientation, AFaceThatIsThereTwiceStays) {
    const std::vector<Vec3f> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    std::vector<Triangle> twice = {{0, 1, 2}, {0, 1, 2}};
    EXPECT_EQ(orient(twice, positions), 0u);
}

} // namespace
} // namespace filigree
