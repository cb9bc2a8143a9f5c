#include "filigree/core/parallel_for.h"

#include "threads.h"

#include <gtest/gtest.h>

#include <mutex>
#include <set>
#include <vector>

using namespace filigree;

namespace {

using Pieces = std::set<std::pair<std::size_t, std::size_t>>;

Pieces pieces_of(std::size_t count, std::size_t grain, const RunContext& context) {
    Pieces pieces;
    std::mutex mutex;
    parallel_for(context, count, grain, [&](std::size_t begin, std::size_t end) {
        const std::lock_guard lock(mutex);
        EXPECT_TRUE(pieces.insert({begin, end}).second) << "piece at " << begin << " ran twice";
    });
    return pieces;
}

} // namespace

TEST(ParallelFor, PiecesCoverTheRangeOnce) {
    const RunContext context(1);
    EXPECT_EQ(pieces_of(0, 4, context), (Pieces{}));
    EXPECT_EQ(pieces_of(3, 4, context), (Pieces{{0, 3}}));
    EXPECT_EQ(pieces_of(8, 4, context), (Pieces{{0, 4}, {4, 8}}));
    EXPECT_EQ(pieces_of(9, 4, context), (Pieces{{0, 4}, {4, 8}, {8, 9}}));
}

TEST(ParallelFor, PiecesDoNotDependOnThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    EXPECT_EQ(pieces_of(1001, 10, RunContext(2)), pieces_of(1001, 10, RunContext(1)));
}
