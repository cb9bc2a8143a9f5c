// Parts of a mesh that have a gap between them, and whether a body says that it joins them.
#include "filigree/mesh.h"
#include "filigree/physics/body.h"
#include "joined_fingers.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <cmath>

namespace filigree::joined_parts_test {
namespace {

using joined_fingers::add_box, joined_fingers::fork;

BodyReport report_of(const Mesh& mesh, double spacing, MaterialModel model = MaterialModel::fem) {
    Material material;
    material.model = model;
    BodyOptions options;
    options.cells.spacing = spacing;
    BodyReport report;
    EXPECT_TRUE(make_body(mesh, material, options, kOneThread, &report));
    return report;
}

TEST(JoinedParts, FingersCloserThanTwoCellsAreTold) {
    for (const double gap : {0.015, 0.03, 0.05, 0.07}) {
        const BodyReport report = report_of(fork(gap), 0.0487);
        EXPECT_GT(report.joined.corners, 40U) << gap;
        EXPECT_NEAR(report.joined.gap, gap, 1.5 * 0.0487 / 4);
        EXPECT_GT(report.joined.place.x(), 0.0f);
        EXPECT_NEAR(double(report.joined.place.y()), 0.2 + gap / 2, 0.06);
        EXPECT_NE(report.warning.find("move as one"), std::string::npos) << report.warning;
        EXPECT_NE(report.warning.find(" particles) parts most of them."), std::string::npos) << report.warning;
    }
}

TEST(JoinedParts, TheSpacingThatIsProposedPartsThem) {
    for (const double gap : {0.03, 0.05, 0.07}) {
        const BodyReport coarse = report_of(fork(gap), 0.0487);
        ASSERT_GT(coarse.joined.corners, 0U);
        const BodyReport finer = report_of(fork(gap), coarse.joined.gap / 2 * 0.9);
        EXPECT_EQ(finer.joined.corners, 0U) << gap << ": " << finer.warning;
    }
}

TEST(JoinedParts, OnlyWhatHangsOnCellsIsAsked) {
    for (const MaterialModel model : {MaterialModel::springs, MaterialModel::meshfree})
        EXPECT_GT(report_of(fork(0.03), 0.05, model).joined.corners, 0U);
    for (const MaterialModel model : {MaterialModel::rigid, MaterialModel::mpm})
        EXPECT_EQ(report_of(fork(0.03), 0.05, model).joined.corners, 0U);
}

TEST(JoinedParts, WhatIsWholeIsNotTold) {
    for (const Mesh& mesh : {make_wavy_cube({.resolution = 32}), make_torus({.resolution = 48, .thickness = 0.2}),
                             make_wavy_plate({.resolution = 32, .thickness = 0.03}), fork(0.3)})
        for (const double cells : {8.0, 16.0, 27.0}) {
            const BodyReport report = report_of(mesh, bounds(mesh).size().maxCoeff() / cells);
            EXPECT_EQ(report.joined.corners, 0U) << cells << ": " << report.warning;
        }
}

/// Two legs that part at an angle are joined just below where they meet, at any spacing: a crease, not two parts.
TEST(JoinedParts, ACreaseIsNotTold) {
    Mesh mesh;
    for (const double side : {-1.0, 1.0})
        for (int k = 0; k < 40; ++k) {
            const double at = 0.05 * k;
            add_box(mesh, {side * at * 0.7 - 0.15, -at - 0.1, -0.2}, {side * at * 0.7 + 0.15, -at + 0.1, 0.2});
        }
    for (const double spacing : {0.05, 0.08, 0.1}) {
        const BodyReport report = report_of(mesh, spacing);
        EXPECT_EQ(report.joined.corners, 0U) << spacing << ": " << report.warning;
    }
}

TEST(JoinedParts, TheSameForAnyNumberOfThreads) {
    Material material;
    BodyOptions options;
    options.cells.spacing = 0.05;
    std::vector<JoinedParts> found;
    for (const unsigned threads : {1u, 3u}) {
        BodyReport report;
        ASSERT_TRUE(make_body(fork(0.03), material, options, RunContext(threads), &report));
        found.push_back(report.joined);
    }
    EXPECT_EQ(found[0].corners, found[1].corners);
    EXPECT_EQ(found[0].place, found[1].place);
    EXPECT_EQ(found[0].gap, found[1].gap);
}

} // namespace
} // namespace filigree::joined_parts_test
