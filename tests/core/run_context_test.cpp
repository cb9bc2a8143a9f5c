#include "filigree/context.h"

#include "filigree/core/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <optional>
#include <vector>

using namespace filigree;

namespace {

thread_local bool there_is_no_memory = false;

void* memory(std::size_t size) {
    if (there_is_no_memory) throw std::bad_alloc();
    if (void* const found = std::malloc(size > 0 ? size : 1)) return found;
    throw std::bad_alloc();
}

} // namespace

void* operator new(std::size_t size) { return memory(size); }
void operator delete(void* at) noexcept { std::free(at); }
void operator delete(void* at, std::size_t) noexcept { std::free(at); }

TEST(RunContext, ThreadsAreAsManyAsAskedForAndThere) {
    const unsigned processors = RunContext().threads();
    EXPECT_GE(processors, 1u);
    EXPECT_EQ(RunContext(1).threads(), 1u);
    EXPECT_EQ(RunContext(processors).threads(), processors);
    EXPECT_EQ(RunContext(processors + 1).threads(), processors);
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

TEST(RunContext, GoesWithoutMemory) {
    std::vector<std::optional<RunContext>> contexts(100);
    for (std::optional<RunContext>& context : contexts) context.emplace(2);
    there_is_no_memory = true;
    std::atomic<int> ran = 0;
    parallel_for(*contexts[0], 1000, 1, [&](std::size_t begin, std::size_t end) { ran += int(end - begin); });
    contexts.clear();
    there_is_no_memory = false;
    EXPECT_EQ(ran, 1000);
}
