// Steps of a work: each task is made once, whoever comes; what is being made elsewhere is waited for.
#include "filigree/io/shared_steps.h"

#include "filigree/io/file.h"

#include <atomic>
#include <chrono>
#include <gtest/gtest.h>
#include <thread>
#include <unistd.h>

namespace filigree {
namespace {

namespace fs = std::filesystem;

class Steps : public testing::Test {
protected:
    Steps() {
        fs::remove_all(root_);
        fs::create_directory(root_);
        EXPECT_FALSE(folder_.begin().value());
    }
    ~Steps() override { fs::remove_all(root_); }

    SharedStep step(std::size_t tasks, const std::function<Status(std::size_t)>& make) const {
        SharedStep step{.names = {}, .phase = "making", .make = {}};
        for (std::size_t k = 0; k < tasks; ++k) step.names.push_back("task-" + std::to_string(k));
        step.make = [this, make](std::size_t task) -> Status {
            if (Status made = make(task); !made) return made;
            return write_file(folder_.file("task-" + std::to_string(task)), "done");
        };
        return step;
    }

    fs::path root_ = fs::temp_directory_path() / ("filigree-steps-" + std::to_string(::getpid()) +
                                                  testing::UnitTest::GetInstance()->current_test_info()->name());
    SharedFolder folder_{root_ / "whole", "a plan\n", [this] { return fs::exists(root_ / "whole"); }};
};

TEST_F(Steps, OwnTasksComeFirstThenTheOthers) {
    std::vector<std::size_t> order;
    const WorkChunk chunk{.number = 2, .count = 3, .job = ""};
    SharedSteps steps(folder_, chunk);
    const SharedStep six = step(6, [&](std::size_t task) {
        order.push_back(task);
        return Success{};
    });
    EXPECT_FALSE(steps.take(six, RunContext(1)).value());
    EXPECT_EQ(order, (std::vector<std::size_t>{2, 3, 4, 5, 0, 1}));
    EXPECT_EQ(steps.made(), 6u);
    SharedSteps later(folder_, chunk);
    EXPECT_FALSE(later.take(six, RunContext(1)).value());
    EXPECT_EQ(later.made(), 0u);
    EXPECT_EQ(later.tasks(), 6u);
    EXPECT_EQ(later.seconds().size(), 1u);
}

TEST_F(Steps, EachTaskIsMadeOnceHoweverManyCome) {
    std::atomic<std::size_t> calls = 0, made = 0;
    const SharedStep tasks = step(40, [&](std::size_t) {
        ++calls;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        return Success{};
    });
    std::vector<std::jthread> processes;
    for (std::size_t k = 1; k <= 4; ++k)
        processes.emplace_back([&, k] {
            const WorkChunk chunk{.number = k, .count = 4, .job = ""};
            SharedSteps steps(folder_, chunk);
            EXPECT_FALSE(steps.take(tasks, RunContext(2)).value());
            EXPECT_GT(steps.made(), 0u);
            made += steps.made();
        });
    processes.clear();
    EXPECT_EQ(calls, 40u);
    EXPECT_EQ(made, 40u);
}

TEST_F(Steps, WhatFailedIsSaidAndTheRestGoesOnLater) {
    const WorkChunk chunk;
    SharedSteps steps(folder_, chunk);
    bool fails = true;
    const SharedStep tasks = step(5, [&](std::size_t task) -> Status {
        if (task == 3 && fails) return Error{ErrorCode::unsuitable, "not this one"};
        return Success{};
    });
    const Result<bool> first = steps.take(tasks, RunContext(1));
    ASSERT_FALSE(first);
    EXPECT_EQ(first.error().message, "not this one");
    EXPECT_EQ(steps.made(), 3u);
    fails = false;
    EXPECT_FALSE(steps.take(tasks, RunContext(1)).value());
    EXPECT_EQ(steps.made(), 5u);
}

TEST_F(Steps, AFinishedWorkEndsThem) {
    const WorkChunk chunk;
    SharedSteps steps(folder_, chunk);
    ASSERT_TRUE(write_file(root_ / "whole", "all of it"));
    ASSERT_TRUE(folder_.end());
    EXPECT_TRUE(steps.take(step(3, [](std::size_t) { return Success{}; }), RunContext(1)).value());
    EXPECT_EQ(steps.made(), 0u);
    const RunContext cancelled(1);
    cancelled.cancel();
    fs::remove(root_ / "whole.plan");
    EXPECT_EQ(steps.take(step(3, [](std::size_t) { return Success{}; }), cancelled).error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
