#include "filigree/core/run_context.h"

#include <gtest/gtest.h>

#include <oneapi/tbb/task_arena.h>

using namespace filigree;

TEST(RunContext, ThreadsAreAsManyAsAskedForAndThere) {
    const unsigned processors = RunContext().threads();
    EXPECT_GE(processors, 1u);
    EXPECT_EQ(RunContext(1).threads(), 1u);
    EXPECT_EQ(RunContext(processors).threads(), processors);
    EXPECT_EQ(RunContext(processors + 1).threads(), processors);
    int used = 0;
    RunContext(processors).execute([&] { used = tbb::this_task_arena::max_concurrency(); });
    EXPECT_EQ(used, static_cast<int>(processors));
}

TEST(RunContext, CopiesShareTheCancelFlag) {
    const RunContext context(1), other(1);
    const RunContext copy = context;
    EXPECT_FALSE(copy.is_cancelled());
    copy.cancel();
    EXPECT_TRUE(context.is_cancelled());
    EXPECT_FALSE(other.is_cancelled());
    EXPECT_EQ(cancelled_error().code, ErrorCode::cancelled);
}

TEST(RunContext, ReportsGoToTheCallerOrNowhere) {
    RunContext context(1);
    context.report("read", 0.5);
    std::string heard;
    context.progress = [&](std::string_view phase, double fraction) {
        heard = std::string(phase) + std::to_string(fraction);
    };
    context.report("read", 0.5);
    EXPECT_EQ(heard, "read0.500000");
}
