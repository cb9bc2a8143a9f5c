#include "filigree/mesh/orientation.h"

#include "filigree/mesh.h"
#include "filigree/mesh/surface.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
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

TEST(Orientation, WhatHasOneSideStays) {
    std::vector<Vec3f> positions; // a band with half a turn
    for (int i = 0; i < 12; ++i)
        for (const double side : {-0.3, 0.3}) {
            const double a = i * std::numbers::pi / 6, r = 1 + side * std::cos(a / 2);
            positions.push_back(Vec3d(r * std::cos(a), r * std::sin(a), side * std::sin(a / 2)).cast<float>());
        }
    std::vector<Triangle> band;
    for (Index i = 0; i < 12; ++i) {
        const Index a = 2 * i, b = a + 1, c = i == 11 ? 0 : b + 2, d = i == 11 ? 1 : a + 2;
        band.push_back({a, b, c});
        band.push_back({a, c, d});
    }
    turn(band, 0.3, 1);
    const std::vector<Triangle> before = band;
    EXPECT_EQ(orient(band, positions), 0u);
    EXPECT_EQ(band, before);
}

TEST(Orientation, AFaceThatIsThereTwiceStays) {
    const std::vector<Vec3f> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    std::vector<Triangle> twice = {{0, 1, 2}, {0, 1, 2}};
    EXPECT_EQ(orient(twice, positions), 0u);
}

} // namespace
} // namespace filigree
