#include "pins.h"

#include <chrono>

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

std::vector<Index> first_indices(Index count) {
    std::vector<Index> result(count);
    for (Index v = 0; v < count; ++v) result[v] = v;
    return result;
}

TEST(VertexSet, TakesEachVertexOnce) {
    VertexSet set(4);
    EXPECT_TRUE(set.add(2));
    EXPECT_TRUE(set.add(0));
    EXPECT_FALSE(set.add(2));
    EXPECT_FALSE(set.add(4)); // no vertex
    EXPECT_FALSE(set.add(kNoIndex));
    EXPECT_TRUE(set.contains(0));
    EXPECT_FALSE(set.contains(1));
    EXPECT_FALSE(set.contains(kNoIndex));
    EXPECT_EQ(set.members(), (std::vector<Index>{2, 0}));
}

TEST(Pins, HoldEachVertexOnceWhereItIs) {
    const std::vector<Vec3f> driver = {Vec3f(0, 0, 0), Vec3f(1, 0, 0), Vec3f(2, 0, 0)};
    std::vector<Handle> handles;
    EXPECT_FALSE(has_pins(handles));
    EXPECT_EQ(pin(handles, std::vector<Index>{2, 1, 2, kNoIndex}, driver), 2u);
    EXPECT_EQ(pin(handles, std::vector<Index>{1}, driver), 0u);
    ASSERT_EQ(handles.size(), 1u);
    EXPECT_EQ(handles[0].vertices, (std::vector<Index>{1, 2}));
    EXPECT_TRUE(handles[0].targets[1] == driver[2]);
    handles.push_back({.vertices = {0}, .targets = {driver[0]}}); // a pull
    EXPECT_EQ(pinned_vertices(handles), (std::vector<Index>{1, 2}));
    EXPECT_EQ(unpin(handles, std::vector<Index>{0, 1}, driver.size()), 1u);
    EXPECT_EQ(handles[0].vertices, std::vector<Index>{2});
    EXPECT_EQ(unpin(handles, std::vector<Index>{2}, driver.size()), 1u);
    ASSERT_EQ(handles.size(), 1u) << "the pull stays";
    EXPECT_FALSE(handles[0].pinned);
}

/// A search through all pins for each pin would take a minute.
TEST(Pins, HalfAMillionGoAndComeAtOnce) {
    constexpr Index kCount = 500'000;
    const std::vector<Vec3f> driver(kCount, Vec3f::Zero());
    const auto begin = std::chrono::steady_clock::now();
    std::vector<Handle> handles;
    EXPECT_EQ(pin(handles, first_indices(kCount), driver), kCount);
    EXPECT_EQ(unpin(handles, first_indices(kCount / 2), kCount), kCount / 2);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

} // namespace
} // namespace filigree::studio
