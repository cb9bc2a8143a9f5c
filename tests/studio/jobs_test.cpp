#include "jobs.h"

#include <QSignalSpy>
#include <QTest>

#include <atomic>
#include <new>
#include <thread>

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

Result<int> until_cancelled(const RunContext& context) {
    while (!context.is_cancelled()) std::this_thread::yield();
    return cancelled_error();
}

TEST(Jobs, DeliverInTheMainThreadInOrder) {
    Jobs jobs;
    std::vector<int> delivered;
    const auto main_thread = std::this_thread::get_id();
    for (int k = 0; k < 5; ++k)
        jobs.start<int>(
            "Count", {},
            [k, main_thread](const RunContext&) -> Result<int> {
                EXPECT_NE(std::this_thread::get_id(), main_thread);
                return k;
            },
            [&](int value) {
                EXPECT_EQ(std::this_thread::get_id(), main_thread);
                delivered.push_back(value);
            });
    EXPECT_TRUE(jobs.is_busy());
    EXPECT_EQ(jobs.title(), "Count");
    EXPECT_TRUE(delivered.empty());
    jobs.wait_until_idle();
    EXPECT_EQ(delivered, (std::vector<int>{0, 1, 2, 3, 4}));
    EXPECT_EQ(jobs.title(), "");
}

TEST(Jobs, NewWorkOfATopicTakesThePlaceOfTheOld) {
    Jobs jobs;
    QSignalSpy cancelled(&jobs, &Jobs::cancelled), failed(&jobs, &Jobs::failed);
    std::vector<int> delivered;
    const auto deliver = [&](int value) { delivered.push_back(value); };
    jobs.start<int>("Old", "strip", until_cancelled, deliver);
    jobs.start<int>("Waiting", "strip", until_cancelled, deliver);
    jobs.start<int>(
        "Save", {}, [](const RunContext&) -> Result<int> { return 7; }, deliver);
    jobs.start<int>(
        "New", "strip", [](const RunContext&) -> Result<int> { return 1; }, deliver);
    jobs.wait_until_idle();
    EXPECT_EQ(delivered, (std::vector<int>{7, 1}));
    EXPECT_EQ(cancelled.count(), 0); // nobody asked for it
    EXPECT_EQ(failed.count(), 0);
}

TEST(Jobs, WhatIsDroppedEndsWithoutAWord) {
    Jobs jobs;
    QSignalSpy cancelled(&jobs, &Jobs::cancelled);
    std::vector<int> delivered;
    const auto deliver = [&](int value) { delivered.push_back(value); };
    jobs.start<int>("Measure", "error", until_cancelled, deliver);
    jobs.start<int>(
        "Open", "model", [](const RunContext&) -> Result<int> { return 2; }, deliver);
    jobs.drop("error");
    jobs.wait_until_idle();
    EXPECT_EQ(delivered, std::vector<int>{2});
    EXPECT_EQ(cancelled.count(), 0);
}

TEST(Jobs, CancelStopsAllAndDeliversNothing) {
    Jobs jobs;
    QSignalSpy cancelled(&jobs, &Jobs::cancelled);
    bool delivered = false;
    jobs.start<int>("Long", {}, until_cancelled, [&](int) { delivered = true; });
    jobs.start<int>(
        "Later", {}, [](const RunContext&) -> Result<int> { return 1; }, [&](int) { delivered = true; });
    EXPECT_TRUE(QTest::qWaitFor([&] { return jobs.title() == "Long"; }));
    jobs.cancel();
    jobs.wait_until_idle();
    EXPECT_FALSE(delivered);
    EXPECT_EQ(cancelled.count(), 2);
}

TEST(Jobs, WorkThatEndedWellIsDeliveredThoughItWasCancelled) {
    Jobs jobs;
    QSignalSpy cancelled(&jobs, &Jobs::cancelled);
    int delivered = 0;
    jobs.start<int>(
        "Save", "save",
        [](const RunContext& context) -> Result<int> {
            while (!context.is_cancelled()) std::this_thread::yield();
            return 3; // the file was written
        },
        [&](int value) { delivered = value; });
    EXPECT_TRUE(jobs.is_pending("save"));
    EXPECT_TRUE(QTest::qWaitFor([&] { return jobs.title() == "Save"; }));
    QSignalSpy started(&jobs, &Jobs::started);
    EXPECT_TRUE(started.count() > 0 || QTest::qWaitFor([&] { return started.count() > 0; }));
    jobs.cancel();
    EXPECT_FALSE(jobs.is_pending("save"));
    jobs.wait_until_idle();
    EXPECT_EQ(delivered, 3);
    EXPECT_EQ(cancelled.count(), 0);
}

TEST(Jobs, ErrorsAndExceptionsAreTold) {
    Jobs jobs;
    std::vector<Error> errors;
    QObject::connect(&jobs, &Jobs::failed, &jobs, [&](const Error& error) { errors.push_back(error); });
    const auto never = [](int) { FAIL(); };
    jobs.start<int>(
        "A", {},
        [](const RunContext&) -> Result<int> {
            return Error{ErrorCode::bad_file, "Bad."};
        },
        never);
    jobs.start<int>(
        "B", {}, [](const RunContext&) -> Result<int> { throw std::bad_alloc(); }, never);
    jobs.start<int>(
        "C", {}, [](const RunContext&) -> Result<int> { throw std::runtime_error("odd"); }, never);
    jobs.wait_until_idle();
    ASSERT_EQ(errors.size(), 3u);
    EXPECT_EQ(errors[0].message, "Bad.");
    EXPECT_EQ(errors[1].code, ErrorCode::out_of_memory);
    EXPECT_NE(errors[2].message.find("odd"), std::string::npos);
}

TEST(Jobs, ErrorsGoToWhoAsksForThemAndTheNextIsDone) {
    Jobs jobs("Choose less.");
    QSignalSpy failed(&jobs, &Jobs::failed);
    std::optional<Error> error;
    int delivered = 0;
    jobs.start<int>(
        "Memory", "memory", [](const RunContext&) -> Result<int> { throw std::bad_alloc(); }, [](int) { FAIL(); },
        {.failed = [&](const Error& of_work) { error = of_work; }});
    jobs.start<int>(
        "Good", "good", [](const RunContext&) -> Result<int> { return 1; }, [&](int value) { delivered = value; });
    jobs.finish_all();
    EXPECT_FALSE(jobs.is_busy());
    EXPECT_EQ(delivered, 1);
    EXPECT_EQ(failed.count(), 0);
    ASSERT_TRUE(error);
    EXPECT_EQ(error->code, ErrorCode::out_of_memory);
    EXPECT_EQ(error->message, "Memory: there is not enough memory for it. Choose less.");
}

TEST(Jobs, UrgentWorkIsDoneBeforeAllThatWaits) {
    Jobs jobs;
    std::vector<int> delivered;
    std::atomic<bool> may_end = false;
    const auto start = [&](int number, bool is_urgent) {
        jobs.start<int>(
            "Work", {},
            [&may_end, number](const RunContext&) -> Result<int> {
                while (!may_end) std::this_thread::yield();
                return number;
            },
            [&](int value) { delivered.push_back(value); }, {.is_urgent = is_urgent});
    };
    QSignalSpy started(&jobs, &Jobs::started);
    start(1, false);
    EXPECT_TRUE(QTest::qWaitFor([&] { return started.count() == 1; }));
    start(2, false);
    start(3, true);
    start(4, true);
    may_end = true;
    jobs.finish_all();
    EXPECT_EQ(delivered, (std::vector<int>{1, 4, 3, 2}));
}

TEST(Jobs, TellWhereTheyAre) {
    Jobs jobs;
    QSignalSpy started(&jobs, &Jobs::started), progressed(&jobs, &Jobs::progressed), finished(&jobs, &Jobs::finished);
    std::atomic<bool> was_seen = false;
    jobs.start<int>(
        "Work", {},
        [&](const RunContext& context) -> Result<int> {
            context.report("halving", 0.5);
            while (!was_seen) std::this_thread::yield();
            return 0;
        },
        [](int) {});
    EXPECT_TRUE(QTest::qWaitFor([&] { return jobs.phase() == "halving" && progressed.count() >= 1; }));
    EXPECT_EQ(jobs.fraction(), 0.5);
    was_seen = true;
    jobs.wait_until_idle();
    EXPECT_EQ(started.count(), 1);
    EXPECT_EQ(finished.count(), 1);
}

TEST(Jobs, ProgressIsNotToldMoreOftenThanItIsLookedAt) {
    Jobs jobs;
    QSignalSpy progressed(&jobs, &Jobs::progressed);
    jobs.start<int>(
        "Work", {},
        [](const RunContext& context) -> Result<int> {
            for (int k = 0; k < 1'000'000; ++k) context.report("counting", k / 1e6);
            return 0;
        },
        [](int) {});
    jobs.wait_until_idle();
    EXPECT_LT(progressed.count(), 1000);
}

TEST(Jobs, GoingAwayCancelsAndDeliversNothing) {
    bool delivered = false;
    std::atomic<bool> began = false, ended = false;
    {
        Jobs jobs;
        jobs.start<int>(
            "Long", {},
            [&](const RunContext& context) {
                began = true;
                const Result<int> result = until_cancelled(context);
                ended = true;
                return result;
            },
            [&](int) { delivered = true; });
        jobs.start<int>(
            "Later", {}, [](const RunContext&) -> Result<int> { return 1; }, [&](int) { delivered = true; });
        while (!began) std::this_thread::yield();
    }
    EXPECT_TRUE(ended);
    QCoreApplication::processEvents();
    EXPECT_FALSE(delivered);
}

TEST(Jobs, ADeliveryMayStartAndAwaitFurtherWork) {
    Jobs jobs;
    int sum = 0;
    const auto one = [](const RunContext&) -> Result<int> { return 1; };
    jobs.start<int>("First", {}, one, [&](int value) {
        sum += value;
        jobs.start<int>("Second", {}, one, [&](int further) { sum += 10 * further; });
        jobs.wait_until_idle();
        EXPECT_EQ(sum, 11);
    });
    jobs.wait_until_idle();
    EXPECT_EQ(sum, 11);
}

} // namespace
} // namespace filigree::studio
