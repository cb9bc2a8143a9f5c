#include "filigree/core/lists.h"

#include <gtest/gtest.h>
#include <string>

namespace filigree_test {
namespace {

using namespace filigree;

TEST(Lists, KeepTheOrderOfTheirItems) {
    const std::vector<std::pair<std::size_t, std::string>> given = {{2, "c"}, {0, "a"}, {2, "b"}, {4, "d"}, {2, "a"}};
    const auto lists = make_lists<std::string>(5, [&](const auto& add) {
        for (const auto& [list, item] : given) add(list, item);
    });
    ASSERT_EQ(lists.size(), 5u);
    EXPECT_EQ(lists.items, (std::vector<std::string>{"a", "c", "b", "a", "d"}));
    EXPECT_EQ(lists.offsets, (std::vector<Index>{0, 1, 1, 4, 4, 5}));
    EXPECT_EQ(lists[2].size(), 3u);
    EXPECT_EQ(lists[2][1], "b");
    std::size_t count = 0;
    for (const std::span<const std::string> list : lists) count += list.size();
    EXPECT_EQ(count, given.size());
}

TEST(Lists, OfNothing) {
    EXPECT_EQ(IndexLists{}.size(), 0u);
    IndexLists moved_from;
    moved_from.offsets.clear();
    EXPECT_EQ(moved_from.size(), 0u);
    const auto lists = make_lists<Index, std::size_t>(3, [](const auto&) {});
    EXPECT_EQ(lists.size(), 3u);
    EXPECT_TRUE(lists[2].empty());
    EXPECT_EQ(make_lists<Index>(0, [](const auto&) {}).size(), 0u);
}

TEST(Lists, TheInverseOfAnOrderUndoesIt) {
    const std::vector<Index> order = {3, 0, 2, 1};
    EXPECT_EQ(inverse_order(order), (std::vector<Index>{1, 3, 2, 0}));
    EXPECT_EQ(inverse_order(inverse_order(order)), order);
    EXPECT_TRUE(inverse_order({}).empty());
}

} // namespace
} // namespace filigree_test
