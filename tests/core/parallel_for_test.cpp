#include "filigree/core/parallel_for.h"

#include "threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#if defined(__unix__)
#include <sys/wait.h>
#include <unistd.h>
#endif

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

TEST(ParallelFor, LoopsInsideLoopsShareTheContextsThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const RunContext context(2);
    std::atomic<int> at_work = 0, most = 0, sum = 0;
    parallel_for(context, 20, 1, [&](std::size_t, std::size_t) {
        parallel_for(context, 50, 1, [&](std::size_t begin, std::size_t) {
            const int now = ++at_work;
            for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
            }
            sum += int(begin);
            --at_work;
        });
    });
    EXPECT_EQ(sum, 20 * 49 * 50 / 2);
    EXPECT_LE(most, 2);
}

TEST(ParallelFor, AnExceptionStopsTheLoopAndComesOut) {
    for (const unsigned threads : {1u, 2u}) {
        const RunContext context(threads);
        std::atomic<int> ran = 0;
        const auto body = [&](std::size_t begin, std::size_t) {
            ++ran;
            if (begin == 3) throw std::runtime_error("three");
        };
        EXPECT_THROW(parallel_for(context, 1 << 20, 1, body), std::runtime_error);
        EXPECT_LT(ran, 1 << 20);
        int after = 0; // the pool goes on
        parallel_for(context, 1, 1, [&](std::size_t, std::size_t) { ++after; });
        EXPECT_EQ(after, 1);
    }
}

TEST(ParallelFor, ManyCallersAtOnceFinish) {
    std::vector<std::thread> callers;
    std::atomic<std::size_t> sum = 0;
    for (int caller = 0; caller < 8; ++caller)
        callers.emplace_back([&] {
            const RunContext context;
            for (int i = 0; i < 300; ++i)
                parallel_for(context, 64, 1, [&](std::size_t begin, std::size_t end) { sum += end - begin; });
        });
    for (std::thread& caller : callers) caller.join();
    EXPECT_EQ(sum, 8u * 300 * 64);
}

#if defined(__unix__)
TEST(ParallelFor, AForkedProcessHasAPoolOfItsOwn) {
    const RunContext context;
    std::atomic<std::size_t> sum = 0;
    const auto add = [&](std::size_t begin, std::size_t end) { sum += end - begin; };
    parallel_for(context, 1000, 1, add);
    const pid_t child = fork();
    if (child == 0) {
        parallel_for(context, 1000, 1, add);
        _exit(sum == 2000 ? 0 : 1);
    }
    int status = 1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
}
#endif
