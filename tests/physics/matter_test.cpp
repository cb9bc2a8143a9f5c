// Finding where points lie in a body's matter, and which cells are near.

#include "filigree/core/random.h"
#include "filigree/mesh.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/contact/cell_boxes.h"
#include "filigree/physics/contact/own_cells.h"
#include "filigree/physics/rigid/rigid_body.h"
#include "physics/test_bodies.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree {
namespace {

Vectors bent(const Body& body) {
    Vectors positions = body.rest;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const Vec3f p = positions[i];
        positions.set(i, {p.x() + 0.3f * p.y() * p.y(), 0.9f * p.y() - 0.2f * p.x(), p.z() * (1 + 0.3f * p.y())});
    }
    return positions;
}

TEST(Matter, FindsThePlaceOfAPoint) {
    const Body body = make_body(box_cells(6, 5, 4, 0.1), undamped(0.3));
    const Matter matter(body);
    const Vectors positions = bent(body);
    for (std::uint64_t n = 0; n < 500; ++n) {
        const Matter::Place truth{
            Index(random_unit(1, 4 * n) * double(body.cells.cells.size())),
            {float(random_unit(1, 4 * n + 1)), float(random_unit(1, 4 * n + 2)), float(random_unit(1, 4 * n + 3))}};
        const Vec3f point = matter.mean(truth, positions);
        const CellBoxes boxes(matter, positions, 0.01f);
        Matter::Place found{boxes.find(point).cell};
        ASSERT_NE(found.cell, kNoIndex);
        Mat3f inverse;
        ASSERT_TRUE(matter.locate(positions, point, found, inverse));
        EXPECT_LT((matter.rest_position(found) - matter.rest_position(truth)).norm(), 1e-4f);
    }
}

TEST(Matter, KnowsDepthAndDirectionInABodyThatTurnedAndStretched) {
    const Body body = make_body(box_cells(6, 6, 6, 0.1, Vec3d::Constant(-0.3)), undamped(0.3));
    const Matter matter(body);
    const Eigen::AngleAxisf turn(0.7f, Vec3f(1, 2, 3).normalized());
    Vectors positions = body.rest;
    for (std::size_t i = 0; i < positions.size(); ++i)
        positions.set(i, turn * Vec3f(1.5f * positions.x[i], positions.y[i], positions.z[i]));
    const Vec3f point = turn * Vec3f(0.4f, 0, 0);
    Matter::Place place{CellBoxes(matter, positions, 0).find(point).cell};
    Mat3f inverse;
    ASSERT_TRUE(matter.locate(positions, point, place, inverse));
    const auto depth = matter.depth(place, inverse, Vec3f::Zero());
    ASSERT_TRUE(depth);
    EXPECT_NEAR(depth->depth, 0.05f, 2e-3f);
    EXPECT_LT((depth->normal - turn * Vec3f::UnitX()).norm(), 0.02f);
}

TEST(Matter, CellsAcrossAGapAreNotTogether) {
    const Body body = make_body(fork(), undamped(0.3));
    const Matter matter(body);
    const auto cell = [&](int i, int j) { return body.cells.find_cell(i, j, 1); };
    EXPECT_TRUE(matter.are_together(cell(0, 10), cell(2, 9)));
    EXPECT_FALSE(matter.are_together(cell(2, 10), cell(4, 10)));
    EXPECT_TRUE(matter.are_together(cell(2, 3), cell(4, 3))) << "over the foot";
    EXPECT_FALSE(matter.are_together(cell(0, 10), cell(0, 7)));
}

TEST(CellBoxes, AGapIsNeverMoreThanTheDistanceOfAnyPoint) {
    const Body body = as_rigid(make_body(fork(), undamped(0.3)));
    const Matter matter(body);
    const auto turned_and_moved = [&](std::uint64_t seed, const Vec3f& by) {
        const Vec3d axis(random_unit(seed, 1) - 0.5, random_unit(seed, 2) - 0.5, random_unit(seed, 3) - 0.5);
        const Mat3f turn =
            Eigen::AngleAxisd(6 * random_unit(seed, 4), axis.normalized()).toRotationMatrix().cast<float>();
        Vectors positions = body.rest;
        for (std::size_t i = 0; i < positions.size(); ++i) positions.set(i, turn * body.rest[i] + by);
        return positions;
    };
    const float spacing = float(body.spacing());
    std::size_t apart = 0;
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        const Vectors one = turned_and_moved(2 * seed, Vec3f::Zero());
        const Vectors other = turned_and_moved(2 * seed + 1, {float(2 * random_unit(seed, 9)), 0.3f, -0.2f});
        const CellBoxes boxes(matter, one, 0.5f * spacing), others(matter, other, 0.5f * spacing);
        const TurnedBox around = others.rigid_box();
        const Mat3f into = around.half_axes.inverse();
        float nearest = std::numeric_limits<float>::infinity(); // of a point of the other to a cell of the one
        for (std::size_t s = 0; s < body.surface.points.size(); ++s) {
            const Vec3f point = embedded_point(body.surface.points, s, other);
            EXPECT_LT((into * (point - around.centre)).cwiseAbs().maxCoeff(), 1 + 1e-4f);
            for (const auto& corners : body.cells.cell_corners) {
                const Vec3f first = one[corners[0]];
                Vec3f beyond;
                for (int axis = 0; axis < 3; ++axis) {
                    const Vec3f along = (one[corners[1 << axis]] - first).normalized();
                    const float at = along.dot(point - first);
                    beyond[axis] = std::max({0.0f, -at, at - spacing});
                }
                nearest = std::min(nearest, beyond.norm());
            }
        }
        const float gap = boxes.gap_of_rigid(around);
        EXPECT_LE(gap, nearest + 1e-5f) << seed;
        apart += gap > 0.5f * nearest && gap > 0;
    }
    EXPECT_GT(apart, 15u);
}

TEST(CellBoxes, ARigidSheetIsMatterBeyondItsCells) {
    Material stone;
    stone.model = MaterialModel::rigid;
    const Mesh plate = make_wavy_plane({.resolution = 8, .amplitude = 0});
    const Body body = make_body(plate, stone, {.cells = {.spacing = 0.1}}, kOneThread).value();
    ASSERT_GT(body.field_radius, 0.1 * body.spacing());
    const Matter matter(body);
    const CellBoxes boxes(matter, body.rest, 0.01f * float(body.spacing()));
    const Box box = bounds(plate.positions);
    const auto beyond = [&](double spacings) { // the rim, by so much
        return Vec3d(box.max.x() + spacings * body.spacing(), box.centre().y(), box.centre().z()).cast<float>().eval();
    };
    const float radius = float(body.field_radius / body.spacing());
    EXPECT_NE(boxes.find(beyond(0.9 * radius)).cell, kNoIndex);
    EXPECT_EQ(boxes.find(beyond(1.5 * radius)).cell, kNoIndex);
    const float away = 5 * radius * float(body.spacing());
    EXPECT_LE(boxes.gap_of_rigid({beyond(5 * radius), Mat3f::Zero()}), away - 0.99f * float(body.field_radius));
}

/// The cell that holds a point or the nearest within reach, of those that count.
template <class Counts>
Index nearest_cell(const Body& body, const Vectors& positions, const Vec3f& point, float reach, const Counts& counts) {
    Index best = kNoIndex;
    float least = 1e9f;
    for (Index c = 0; c < body.cells.cells.size(); ++c) {
        if (!counts(c)) continue;
        Vec3f low = Vec3f::Constant(1e9f), high = -low, middle = Vec3f::Zero();
        for (const Index corner : body.cells.cell_corners[c]) {
            low = low.cwiseMin(positions[corner]);
            high = high.cwiseMax(positions[corner]);
            middle += positions[corner] / 8;
        }
        if (((point - low).array() < -reach).any() || ((point - high).array() > reach).any()) continue;
        if (const float away = (middle - point).squaredNorm(); away < least) {
            least = away;
            best = c;
        }
    }
    return best;
}

TEST(CellBoxes, FindsWhatBruteForceFinds) {
    const Body body = make_body(fork(), undamped(0.3));
    const Matter matter(body);
    const float reach = 0.03f;
    for (const float stretch : {1.0f, 4.0f}) { // as large cells as that lie in several boxes
        Vectors positions = bent(body);
        for (std::size_t i = 0; i < positions.size(); ++i) positions.y[i] *= 1 + (stretch - 1) * positions.y[i];
        const CellBoxes boxes(matter, positions, reach);
        std::size_t hits = 0;
        for (std::uint64_t n = 0; n < 2000; ++n) {
            const Vec3f point(float(1.6 * random_unit(2, 3 * n) - 0.6),
                              stretch * float(1.6 * random_unit(2, 3 * n + 1) - 0.2),
                              float(0.8 * random_unit(2, 3 * n + 2) - 0.4));
            const Index best = nearest_cell(body, positions, point, reach, [](Index) { return true; });
            EXPECT_EQ(boxes.find(point).cell, best) << n;
            hits += best != kNoIndex;
        }
        EXPECT_GT(hits, 200u);
        EXPECT_EQ(boxes.find(Vec3f::Constant(std::numeric_limits<float>::quiet_NaN())).cell, kNoIndex);
    }
}

TEST(LightParticles, AreThoseOfHardlyFilledCells) {
    Cells cells = box_cells(4, 4, 4, 0.1);
    const auto count = [](const Body& body) { return std::ranges::count(light_particles(body), 1); };
    EXPECT_EQ(count(bare_body(cells, undamped(0.3))), 0);
    for (std::size_t c = 0; c < cells.cells.size(); ++c)
        if (cells.cells[c][0] == 3) cells.fraction[c] = 0.01f;
    EXPECT_EQ(count(bare_body(cells, undamped(0.3))), 25); // the outer side of the hardly filled layer
    std::ranges::fill(cells.fraction, 0.01f);              // a sheet: no corner is lighter than the others
    EXPECT_EQ(count(bare_body(cells, undamped(0.3))), 0);
}

// A fork whose arms are pressed together, and a long bar that is rolled up through itself.
TEST(OwnCells, FindWhatBruteForceFinds) {
    const float reach = 0.03f;
    const auto compare = [&](const Body& body, const Vectors& positions) {
        const Matter matter(body);
        const OwnCells cells(matter);
        const std::vector<Index> found = cells.find(positions, {}, reach, nullptr, RunContext(2));
        Vectors points(found.size());
        for (Index s = 0; s < points.size(); ++s) points.set(s, embedded_point(body.surface.points, s, positions));
        std::size_t hits = 0;
        for (Index s = 0; s < found.size(); ++s) {
            const Index own = matter.cell_of_point(s);
            const Index best =
                nearest_cell(body, positions, points[s], reach, [&](Index cell) { return cells.are_far(own, cell); });
            EXPECT_EQ(found[s], best) << s;
            hits += best != kNoIndex;
        }
        return hits;
    };
    const Body arms = make_body(fork(), undamped(0.3));
    Vectors pressed = arms.rest;
    for (std::size_t i = 0; i < pressed.size(); ++i)
        if (pressed.y[i] > 0.3f) pressed.x[i] -= 0.2f * std::copysign(pressed.y[i] - 0.3f, pressed.x[i]);
    EXPECT_GT(compare(arms, pressed), 50u);
    EXPECT_EQ(compare(arms, arms.rest), 0u);

    const Body bar = make_body(box_cells(60, 3, 3, 0.1), undamped(0.3));
    Vectors rolled = bar.rest;
    for (std::size_t i = 0; i < rolled.size(); ++i) {
        const float angle = 1.3f * rolled.x[i], radius = 0.7f + rolled.y[i] + 0.01f * rolled.x[i];
        rolled.set(i, {radius * std::cos(angle), radius * std::sin(angle), rolled.z[i]});
    }
    EXPECT_GT(compare(bar, rolled), 200u);
}

// A bar that is folded in its middle until its halves lie in each other, and one in which a layer of cells has flipped,
// so that those on both its sides lie in each other the same way up.
/// A part too small for cells of its own, beside a body: what is looked at is no more than without it.
TEST(OwnCells, AFleckCostsNoMoreThanNone) {
    const auto candidates = [](bool with_fleck, MaterialModel model) {
        Mesh mesh = make_wavy_cube({.resolution = 24});
        if (with_fleck) {
            const auto first = Index(mesh.positions.size());
            for (const Vec3f& p : {Vec3f(0, 0, 0), Vec3f(0.01f, 0, 0), Vec3f(0, 0.01f, 0), Vec3f(0, 0, 0.01f)})
                mesh.positions.push_back(p + Vec3f(1.6f, 0.2f, 0.1f));
            for (const std::array<Index, 3>& face : {std::array<Index, 3>{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}})
                mesh.add_face(std::array{first + face[0], first + face[1], first + face[2]});
        }
        Material material = undamped(0.3);
        material.model = model;
        BodyReport report;
        const Body body = make_body(mesh, material, {.cells = {.count = 4000}}, kOneThread, &report).value();
        EXPECT_EQ(report.cells.loose_parts, with_fleck ? 1U : 0U);
        const Matter matter(body);
        for (std::size_t s = 0; s < body.surface.points.size(); ++s) {
            const Vec3f middle = matter.rest_position({matter.cell_of_point(s), Vec3f::Constant(0.5f)});
            const float away = (body.surface.points.rest[s] - middle).cwiseAbs().maxCoeff();
            EXPECT_TRUE(matter.is_loose(s) || away < 1.5f * float(body.spacing()));
            EXPECT_TRUE(!matter.is_loose(s) || away < 1.3f) << "carried by a cell that is near";
        }
        Vectors corners = body.rest;
        if (model == MaterialModel::meshfree) {
            corners = Vectors(body.corners.size());
            for (std::size_t c = 0; c < corners.size(); ++c) corners.set(c, body.corners.rest[c]);
        }
        return OwnCells(matter).candidates(corners, 0.3f * float(body.spacing()));
    };
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::meshfree})
        EXPECT_LT(double(candidates(true, model)), 1.1 * double(candidates(false, model)) + 100);
}

TEST(OwnCells, FindWhatIsFolded) {
    const Body bar = make_body(box_cells(16, 3, 3, 0.1), undamped(0.3));
    const Matter matter(bar);
    const OwnCells cells(matter);
    EXPECT_TRUE(cells.folds(bar.rest, 0, RunContext(2)).empty());
    const auto compare = [&](const Vectors& folded) {
        const OwnCells::Folds folds = cells.folds(folded, 0, RunContext(2));
        const std::vector<Index> found = cells.find(folded, folds, 0.01f, nullptr, RunContext(2));
        std::size_t hits = 0;
        for (Index s = 0; s < bar.surface.points.size(); ++s) {
            const Vec3f point = embedded_point(bar.surface.points, s, folded);
            bool is_in_fold = false;
            for (Index c = 0; c < bar.cells.cells.size(); ++c) {
                Matter::Place place{c};
                is_in_fold |= matter.are_together(matter.cell_of_point(s), c) &&
                              matter.locate_in_cell(folded, point, place) && matter.is_elsewhere(s, place, 0.5f);
            }
            if (!is_in_fold) continue;
            ++hits;
            EXPECT_NE(found[s], kNoIndex) << s << " at " << bar.surface.points.rest[s].transpose();
            EXPECT_TRUE(std::ranges::any_of(folds, [&](const auto& fold) { return fold.first == s; })) << s;
        }
        return hits;
    };
    const Box box = box_of(bar.rest);
    const auto middle = float(box.centre().x()), top = float(box.max.y());
    Vectors bent = bar.rest;
    for (std::size_t i = 0; i < bent.size(); ++i) {
        const float x = bent.x[i] - middle, y = bent.y[i] - top;
        const float angle = 1.66f * std::clamp(x / 0.1f, -1.0f, 1.0f); // a quarter turn is 1.57
        bent.x[i] = std::cos(angle) * x - std::sin(angle) * y;
        bent.y[i] = std::sin(angle) * x + std::cos(angle) * y;
    }
    EXPECT_GT(compare(bent), 10u);
    Vectors flipped = bar.rest;
    for (std::size_t i = 0; i < flipped.size(); ++i) {
        if (flipped.x[i] < middle + 0.05f) continue;
        flipped.x[i] -= 0.16f;
        flipped.y[i] += 0.04f;
    }
    EXPECT_GT(compare(flipped), 10u);
}

} // namespace
} // namespace filigree
