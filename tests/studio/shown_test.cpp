// Things that are drawn are made when another key is wanted, and only then.
#include "shown.h"

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

struct ShownTest : testing::Test {
    bool has_opengl = true;
    int changes = 0, makes = 0;
    Workshop shop{[this](const std::function<void()>& work) {
                      if (has_opengl) work();
                  },
                  [this] { ++changes; }};
    Shown<int, std::string> shown{shop, "topic"};

    bool update(int key) {
        return shown.update(key, [&](const std::optional<std::string>& before) -> Result<std::string> {
            ++makes;
            return before.value_or("") + std::to_string(key);
        });
    }
    bool update_later(int key, bool keeps = false) {
        const auto plan = [this, key] {
            ++makes;
            return [key](const RunContext&) -> Result<int> {
                if (key < 0) return Error{ErrorCode::unsuitable, "below zero"};
                return key;
            };
        };
        return shown.update_later(
            key, plan, [](int made) -> Result<std::string> { return std::to_string(made); }, keeps);
    }
    std::string value() const { return shown ? *shown.get() : "none"; }
};

TEST_F(ShownTest, IsMadeWhenAnotherKeyIsWanted) {
    EXPECT_FALSE(update(0)) << "nothing is wanted, and nothing is there";
    EXPECT_EQ(shown.stamp(), 0u);
    EXPECT_TRUE(update(1));
    EXPECT_FALSE(update(1));
    EXPECT_EQ(makes, 1);
    EXPECT_EQ(value(), "1");
    const std::uint64_t stamp = shown.stamp();
    EXPECT_TRUE(update(2));
    EXPECT_EQ(value(), "12") << "the value before is there to be changed";
    EXPECT_GT(shown.stamp(), stamp);
    EXPECT_EQ(shown.made_of(), 2);
    EXPECT_TRUE(update(0));
    EXPECT_FALSE(shown);
    EXPECT_EQ(shown.stamp(), 0u);
    EXPECT_EQ(makes, 2);
}

TEST_F(ShownTest, IsMadeOnceThereIsOpenGl) {
    has_opengl = false;
    update(1);
    EXPECT_FALSE(shown);
    has_opengl = true;
    EXPECT_TRUE(update(1));
    EXPECT_EQ(value(), "1");
}

TEST_F(ShownTest, ComesFromTheBackground) {
    EXPECT_TRUE(update_later(1));
    EXPECT_FALSE(update_later(1)) << "it is on its way";
    EXPECT_FALSE(shown);
    shop.background.finish_all();
    EXPECT_EQ(value(), "1");
    EXPECT_EQ(changes, 1);
    EXPECT_FALSE(update_later(1));
    EXPECT_EQ(makes, 1);

    update_later(2);
    EXPECT_FALSE(shown) << "that of the key before";
    update_later(3, true);
    shop.background.finish_all();
    EXPECT_EQ(value(), "3");
    const std::uint64_t stamp = shown.stamp();
    update_later(4, true);
    EXPECT_EQ(value(), "3") << "it is kept until the next one is there";
    EXPECT_EQ(shown.made_of(), 3);
    EXPECT_EQ(shown.stamp(), stamp);
    shop.background.finish_all();
    EXPECT_EQ(value(), "4");

    update_later(5);
    update_later(0);
    shop.background.finish_all();
    EXPECT_FALSE(shown) << "it is not wanted any more";
}

TEST_F(ShownTest, WhatWasDroppedOnItsWayIsMadeAgain) {
    update_later(1);
    shop.background.drop_all();
    EXPECT_TRUE(update_later(1));
    update_later(2, true);
    shop.background.finish_all();
    update_later(3, true);
    shop.background.drop_all();
    EXPECT_TRUE(update_later(3, true)) << "what is there is of another key";
    shop.background.finish_all();
    EXPECT_EQ(value(), "3");
}

TEST_F(ShownTest, FailsOnceAKey) {
    update_later(-1);
    shop.background.finish_all();
    ASSERT_TRUE(shown.problem());
    EXPECT_EQ(shown.problem()->message, "below zero");
    EXPECT_FALSE(shown);
    EXPECT_FALSE(update_later(-1)) << "it would fail again";
    update_later(1);
    EXPECT_FALSE(shown.problem());
    shop.background.finish_all();
    EXPECT_EQ(value(), "1");
    EXPECT_EQ(changes, 2);
}

} // namespace
} // namespace filigree::studio
