#include "filigree/core/hash.h"

#include <gtest/gtest.h>

#include <bit>
#include <set>

namespace filigree_test {
namespace {

using filigree::hash_words;

TEST(Hash, LowBitsDependOnEveryWordAndTheirOrder) {
    std::set<std::uint64_t> slots;
    for (int i = -8; i < 8; ++i)
        for (int j = -8; j < 8; ++j)
            for (int k = -8; k < 8; ++k) slots.insert(hash_words(i, j, k) & 0xffff);
    EXPECT_GT(slots.size(), 3800u); // of 4,096 keys in 65,536 slots, 3,970 were random
    EXPECT_NE(hash_words(1, 2), hash_words(2, 1));
}

} // namespace
} // namespace filigree_test
