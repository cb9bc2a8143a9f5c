// What contacts ask of many boxes or particles at once gives what asking one by one gives.
#include "filigree/core/random.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/contact/box_sweep.h"
#include "filigree/physics/contact/cell_normals.h"
#include "filigree/physics/contact/extremes_kernel.h"
#include "filigree/physics/fem/cofactor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

namespace filigree {
namespace {

/// In [low, high).
float draw(std::uint64_t seed, std::uint64_t& counter, double low, double high) {
    return float(low + (high - low) * random_unit(seed, counter++));
}

std::set<std::pair<Index, Index>> near_one_by_one(std::span<const BoxSweep::Bounds> boxes, float around) {
    std::set<std::pair<Index, Index>> near;
    for (Index a = 0; a < boxes.size(); ++a)
        for (Index b = a; b < boxes.size(); ++b) {
            const Vec3f gap = (boxes[a].low - boxes[b].high).cwiseMax(boxes[b].low - boxes[a].high);
            if (gap.maxCoeff() <= around) near.emplace(a, b);
        }
    return near;
}

std::set<std::pair<Index, Index>> near_by_sweep(std::span<const BoxSweep::Bounds> boxes, float around) {
    const BoxSweep sweep(boxes);
    std::vector<std::uint16_t> room;
    std::set<std::pair<Index, Index>> near;
    for (std::size_t a = 0; a < boxes.size(); ++a) {
        std::size_t before = 0;
        sweep.each_near(a, around, room, [&](std::size_t b) {
            EXPECT_TRUE(b == a || b > before);
            before = b;
            const auto [low, high] = std::minmax(sweep.order()[a], sweep.order()[b]);
            EXPECT_TRUE(near.emplace(low, high).second);
        });
    }
    return near;
}

TEST(BoxSweep, FindsWhatComparingAllFinds) {
    for (const std::size_t count : {0u, 1u, 2u, 15u, 16u, 17u, 100u})
        for (std::uint64_t seed = 0; seed < 4; ++seed) {
            std::uint64_t counter = 0;
            const Vec3f stretched = seed % 3 == 0 ? Vec3f(8, 1, 1) : seed % 3 == 1 ? Vec3f(1, 1, 8) : Vec3f(2, 2, 2);
            std::vector<BoxSweep::Bounds> boxes;
            for (std::size_t k = 0; k < count; ++k) {
                Vec3f low, size;
                for (int axis = 0; axis < 3; ++axis) {
                    low[axis] = stretched[axis] * draw(seed, counter, -1, 1);
                    size[axis] = seed == 3 ? 0 : draw(seed, counter, 0, 0.5);
                }
                boxes.push_back({low, low + size});
            }
            for (const float around : {0.0f, 0.1f, 30.0f}) {
                SCOPED_TRACE(testing::Message() << count << " boxes, seed " << seed << ", around " << around);
                EXPECT_EQ(near_by_sweep(boxes, around), near_one_by_one(boxes, around));
            }
        }
}

TEST(BoxSweep, TakesBoxesAtOnePlaceAndAsFarApartAsFloatsGo) {
    const BoxSweep::Bounds here{Vec3f::Constant(1), Vec3f::Constant(1)};
    const float most = std::numeric_limits<float>::max();
    const std::vector<BoxSweep::Bounds> same(40, here);
    EXPECT_EQ(near_by_sweep(same, 0).size(), 40u * 41 / 2);
    const std::vector<BoxSweep::Bounds> far{
        {Vec3f::Constant(-most), Vec3f::Constant(-most)}, here, {Vec3f::Constant(most), Vec3f::Constant(most)}};
    EXPECT_EQ(near_by_sweep(far, 1).size(), 3u);
}

TEST(Extremes, AreThoseOfWhatCounts) {
    for (const std::size_t count : {1u, 15u, 16u, 33u, 1000u})
        for (const bool has_from : {false, true}) {
            SCOPED_TRACE(testing::Message() << count << " particles" << (has_from ? ", less others" : ""));
            std::uint64_t counter = 0;
            Vectors values(count), from(count);
            std::vector<float> counts((count + kExtremesPadding - 1) / kExtremesPadding * kExtremesPadding, 0.0f);
            const Index usual = Index(count / 2);
            Extremes expected{Vec3f::Constant(1e30f), Vec3f::Constant(-1e30f)};
            for (std::size_t i = 0; i < count; ++i) {
                counts[i] = i == usual || draw(1, counter, 0, 1) < 0.7f;
                for (const auto axis : kVectorAxes) {
                    // Quarters, of which sums are exact; what does not count goes beyond all that does.
                    (values.*axis)[i] = std::round(draw(1, counter, -40, 40)) / 4 + (counts[i] == 0 ? 100.0f : 0.0f);
                    (from.*axis)[i] = std::round(draw(1, counter, -40, 40)) / 4;
                }
                const Vec3f value = has_from ? Vec3f(values[i] - from[i]) : values[i];
                if (counts[i] != 0) expected = expected.with({value, value});
            }
            const Extremes found = extremes_of(values, has_from ? &from : nullptr, counts, usual);
            EXPECT_EQ(found.least, expected.least);
            EXPECT_EQ(found.most, expected.most);
        }
}

// Runs of all lengths up to two registers, an inverted layer, a crushed cell and cells without a normal.
TEST(CellNormals, AreTurnedByCofactors) {
    std::uint64_t counter = 0;
    std::vector<Cells::LatticeIndex> indices;
    for (std::uint16_t j = 0; j < 34; ++j)
        for (std::uint16_t i = 0; i <= j; ++i) indices.push_back({i, j, 0});
    const Cells cells = lattice_cells(indices, 0.1, Vec3d::Zero());
    const std::size_t count = cells.cells.size();
    Vectors positions(cells.corners.size()), at_rest(count), turned(count);
    for (std::size_t c = 0; c < positions.size(); ++c) {
        const Vec3f moved(draw(3, counter, -0.03, 0.03), draw(3, counter, -0.03, 0.03), draw(3, counter, -0.03, 0.03));
        const auto& at = cells.corners[c];
        positions.set(c, 0.1f * Vec3f(at[0] < 20 ? at[0] : 40 - at[0], at[1], at[2]) + moved);
    }
    for (std::size_t cell = 0; cell < count; ++cell)
        if (cell % 5 != 0)
            at_rest.set(cell,
                        Vec3f(draw(3, counter, -1, 1), draw(3, counter, -1, 1), draw(3, counter, -1, 1)).normalized());
    for (const Index corner : cells.cell_corners[7]) positions.set(corner, Vec3f(1, 2, 3));
    turn_cell_normals(cells.runs, positions, at_rest, turned);
    std::size_t inverted = 0;
    for (std::size_t cell = 0; cell < count; ++cell) {
        const auto& corner = cells.cell_corners[cell];
        Mat3f slope = Mat3f::Zero();
        for (int c = 0; c < 8; ++c)
            for (int axis = 0; axis < 3; ++axis)
                slope.col(axis) += (c >> axis & 1 ? 2.5f : -2.5f) * positions[corner[std::size_t(c)]];
        inverted += slope.determinant() < 0;
        const Vec3f area = cofactor(slope) * at_rest[cell];
        const Vec3f expected = area.norm() > 1e-6f ? Vec3f(area.normalized()) : Vec3f::Zero();
        EXPECT_LT((turned[cell] - expected).norm(), 1e-4f) << cell;
    }
    EXPECT_GT(inverted, 50u);
    EXPECT_TRUE(turned[7].isZero(0));
}

} // namespace
} // namespace filigree
