// The entropy coder: what goes in comes out, in as few bits as its frequencies say; damage is noticed.
#include "filigree/pack/symbols.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

using namespace filigree;

namespace {

/// One of each kind of thing that can be written, with its context.
struct Item {
    unsigned kind, context, count;
    std::uint32_t value;
};

std::vector<Item> random_items(std::size_t count, std::mt19937& random) {
    std::vector<Item> items;
    for (std::size_t i = 0; i < count; ++i) {
        Item item{unsigned(random() % 4), unsigned(random() % 5), 1 + unsigned(random() % 32), 0};
        const std::uint32_t any = std::uint32_t(random()) >> (random() % 32);
        item.value = item.kind == 0   ? any % SymbolModel::kSymbols
                     : item.kind == 1 ? any & std::uint32_t((std::uint64_t{1} << item.count) - 1)
                                      : any;
        items.push_back(item);
    }
    return items;
}

std::string written(const std::vector<Item>& items) {
    SymbolWriter out(5);
    for (const Item& item : items) switch (item.kind) {
        case 0:
            out.symbol(item.context, item.value);
            break;
        case 1:
            out.bits(item.value, item.count);
            break;
        case 2:
            out.number(item.context, item.value);
            break;
        default:
            out.number_with_sign(item.context, std::int32_t(item.value));
        }
    return out.finish();
}

std::uint32_t read_item(SymbolReader& in, const Item& item) {
    switch (item.kind) {
    case 0:
        return in.symbol(item.context);
    case 1:
        return in.bits(item.count);
    case 2:
        return in.number(item.context);
    default:
        return std::uint32_t(in.number_with_sign(item.context));
    }
}

} // namespace

TEST(Symbols, WhatGoesInComesOut) {
    std::mt19937 random(1);
    for (const std::size_t count : {0, 1, 3, 100, 5000, 100000}) {
        const std::vector<Item> items = random_items(count, random);
        const std::string stream = written(items);
        SymbolReader in(stream, 5);
        for (const Item& item : items) ASSERT_EQ(read_item(in, item), item.value);
        EXPECT_FALSE(in.is_damaged());
    }
}

TEST(Symbols, LargestAndSmallestNumbers) {
    SymbolWriter out(1);
    const std::vector<std::int32_t> numbers = {0, -1, 1, 15, -16, 16, 1 << 26, 1 << 27, INT32_MAX, INT32_MIN};
    for (const std::int32_t n : numbers) out.number_with_sign(0, n);
    const std::string stream = out.finish();
    SymbolReader in(stream, 1);
    for (const std::int32_t n : numbers) EXPECT_EQ(in.number_with_sign(0), n);
}

TEST(Symbols, TakeAsManyBitsAsTheirFrequenciesSay) {
    std::mt19937 random(2);
    std::geometric_distribution<unsigned> rare(0.4);
    std::vector<unsigned> symbols, counts(64);
    for (int i = 0; i < 200'000; ++i) {
        symbols.push_back(std::min(rare(random), 63u));
        ++counts[symbols.back()];
    }
    double entropy = 0;
    for (const unsigned count : counts)
        if (count) entropy -= count * std::log2(count / 200'000.0);
    SymbolWriter out(1);
    for (const unsigned s : symbols) out.symbol(0, s);
    EXPECT_LT(double(out.finish().size()) * 8, 1.012 * entropy); // 0.4 % are shares of what never comes

    SymbolWriter same(1);
    for (int i = 0; i < 200'000; ++i) same.symbol(0, 7);
    EXPECT_LT(same.finish().size(), 250u);
}

TEST(Symbols, DamageIsNoticedOrHarmless) {
    std::mt19937 random(3);
    const std::vector<Item> items = random_items(3000, random);
    const std::string stream = written(items);
    for (int trial = 0; trial < 2000; ++trial) {
        std::string bytes = stream;
        if (trial % 2)
            bytes.resize(random() % bytes.size());
        else
            bytes[random() % bytes.size()] ^= char(1u << random() % 8);
        SymbolReader in(bytes, 5);
        for (const Item& item : items) {
            const std::uint32_t value = read_item(in, item);
            const std::uint64_t end = item.kind == 0   ? SymbolModel::kSymbols
                                      : item.kind == 1 ? std::uint64_t{1} << item.count
                                                       : std::uint64_t{1} << 32;
            ASSERT_LT(value, end);
        }
        EXPECT_TRUE(in.is_damaged() || trial % 2 == 0);
    }
}
