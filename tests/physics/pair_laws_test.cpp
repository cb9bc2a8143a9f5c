#include "filigree/physics/contact/pair_laws.h"

#include "filigree/core/random.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(PairLaws, SayWhatTheWorldSaysOfEachTwo) {
    constexpr std::size_t kBodies = 23;
    for (std::uint64_t seed = 1; seed < 20; ++seed) {
        std::uint64_t asked = 0;
        const auto below = [&](std::size_t count) {
            return std::min(count - 1, std::size_t(random_unit(seed, asked++) * double(count)));
        };
        World world;
        for (std::size_t k = below(6); k > 0; --k)
            world.body_pairs.push_back({below(kBodies), below(kBodies), {.friction = random_unit(seed, asked++)}});
        for (std::size_t k = below(6); k > 0; --k) {
            GroupPair pair;
            pair.contact.friction = random_unit(seed, asked++);
            for (std::size_t n = below(9); n > 0; --n) pair.first.push_back(below(kBodies));
            for (std::size_t n = below(9); n > 0; --n) pair.second.push_back(below(kBodies));
            world.group_pairs.push_back(pair);
        }
        const PairLaws laws(world, kBodies);
        for (std::size_t a = 0; a < kBodies; ++a)
            for (std::size_t b = 0; b < kBodies; ++b)
                ASSERT_EQ(laws.of(a, b).friction, world.contact_of(a, b).friction) << seed << " " << a << " " << b;
    }
}

TEST(PairLaws, ARuleOfTwoMaterialsIsOfTwoClasses) {
    World world;
    GroupPair pair;
    for (std::size_t b = 0; b < 10'000; ++b) (b % 2 ? pair.first : pair.second).push_back(b);
    pair.contact = {.friction = 0.9, .restitution = 0.1};
    world.group_pairs = {pair};
    const PairLaws laws(world, 10'001);
    EXPECT_EQ(laws.class_count(), 3U);
    EXPECT_EQ(laws.of(7, 9998).friction, 0.9);
    EXPECT_EQ(laws.of(7, 9).friction, PairContact{}.friction);
    EXPECT_EQ(laws.of(7, 10'000).restitution, PairContact{}.restitution);
}

} // namespace
} // namespace filigree
