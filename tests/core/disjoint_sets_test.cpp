#include "filigree/core/disjoint_sets.h"

#include "filigree/core/parallel_for.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(DisjointSets, TheRootIsTheLowestMember) {
    DisjointSets sets(6);
    EXPECT_EQ(sets.root(3), 3u);
    EXPECT_TRUE(sets.join(5, 3));
    EXPECT_TRUE(sets.join(4, 1));
    EXPECT_TRUE(sets.join(5, 4));
    EXPECT_FALSE(sets.join(1, 3)); // they were in one
    for (const Index i : {1u, 3u, 4u, 5u}) EXPECT_EQ(sets.root(i), 1u) << i;
    EXPECT_EQ(sets.root(0), 0u);
    EXPECT_EQ(sets.root(2), 2u);
}

TEST(DisjointSets, ManyThreadsJoin) {
    FILIGREE_NEEDS_TWO_THREADS();
    constexpr Index kCount = 200'000, kSets = 7; // i and i + 7 belong together
    DisjointSets sets(kCount);
    std::atomic<Index> joined = 0;
    parallel_for(RunContext(2), kCount - kSets, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) joined += sets.join(Index(i), Index(i) + kSets);
    });
    EXPECT_EQ(joined, kCount - kSets); // each join was the first of its two sets, in whatever order
    for (Index i = 0; i < kCount; ++i) ASSERT_EQ(sets.root(i), i % kSets) << i;
}

} // namespace
} // namespace filigree
