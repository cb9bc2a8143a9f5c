#include "filigree/remesh/matching.h"

#include "prepared.h"

namespace filigree {
namespace {

using namespace filigree_test;

struct Dual {
    std::vector<Index> opposite;
    std::vector<double> weights;
    std::size_t size() const { return opposite.size() / 3; }
};

Dual with_random_weights(std::vector<Index> opposite, unsigned seed, unsigned forbidden_percent) {
    std::mt19937 random(seed);
    Dual dual{std::move(opposite), {}};
    dual.weights.assign(dual.opposite.size(), -1);
    for (Index h = 0; h < dual.opposite.size(); ++h) {
        if (dual.opposite[h] == kNoIndex || dual.opposite[h] < h) continue;
        // in steps that the matching's whole numbers hold exactly
        const double weight = random() % 100 < forbidden_percent ? -1 : double(random() % 1025) / 1024;
        dual.weights[h] = dual.weights[dual.opposite[h]] = weight;
    }
    return dual;
}

/// Some triangles of a small grid, chosen at random.
std::vector<Index> random_patch(unsigned seed) {
    std::mt19937 random(seed);
    constexpr Index n = 4;
    std::vector<Triangle> triangles;
    for (Index j = 0; j < n; ++j)
        for (Index i = 0; i < n; ++i) {
            const Index a = j * (n + 1) + i, b = a + 1, c = a + n + 2, d = a + n + 1;
            if (random() % 4 != 0) triangles.push_back({a, b, c});
            if (random() % 4 != 0) triangles.push_back({a, c, d});
        }
    if (triangles.size() > 18) triangles.resize(18);
    return opposite_half_edges(triangles, (n + 1) * (n + 1));
}

struct Worth {
    std::size_t pairs = 0;
    double weight = 0;
    bool operator<(const Worth& other) const {
        return pairs != other.pairs ? pairs < other.pairs : weight < other.weight;
    }
};

/// The best there is, by trying all.
Worth best_of_all(const Dual& dual, std::size_t first, std::vector<std::uint8_t>& taken) {
    while (first < dual.size() && taken[first]) ++first;
    if (first == dual.size()) return {};
    taken[first] = 1;
    Worth best = best_of_all(dual, first + 1, taken); // left alone
    for (std::size_t h = 3 * first; h < 3 * first + 3; ++h) {
        if (dual.opposite[h] == kNoIndex || dual.weights[h] < 0 || taken[dual.opposite[h] / 3]) continue;
        taken[dual.opposite[h] / 3] = 1;
        Worth with = best_of_all(dual, first + 1, taken);
        taken[dual.opposite[h] / 3] = 0;
        ++with.pairs;
        with.weight += dual.weights[h];
        best = std::max(best, with);
    }
    taken[first] = 0;
    return best;
}

/// What a matching is worth, with what must be true of every one checked.
Worth worth_of(const Dual& dual, const std::vector<Index>& partner) {
    Worth worth;
    EXPECT_EQ(partner.size(), dual.size());
    for (Index t = 0; t < partner.size(); ++t) {
        if (partner[t] == kNoIndex) continue;
        EXPECT_NE(partner[t], t);
        EXPECT_EQ(partner[partner[t]], t);
        double weight = -1; // the heaviest edge between the two
        for (Index h = 3 * t; h < 3 * t + 3; ++h)
            if (dual.opposite[h] != kNoIndex && dual.opposite[h] / 3 == partner[t])
                weight = std::max(weight, dual.weights[h]);
        EXPECT_GE(weight, 0) << "a pair that must not be";
        worth.pairs += t < partner[t];
        if (t < partner[t]) worth.weight += weight;
    }
    return worth;
}

TEST(MatchTriangles, IsTheBestOfAllOnSmallGraphs) {
    std::size_t left_over = 0;
    for (unsigned seed = 0; seed < 300; ++seed) {
        const Dual dual = with_random_weights(random_patch(seed), seed, seed % 3 == 0 ? 30 : 0);
        const Worth found = worth_of(dual, match_triangles(dual.opposite, dual.weights));
        std::vector<std::uint8_t> taken(dual.size(), 0);
        const Worth best = best_of_all(dual, 0, taken);
        EXPECT_EQ(found.pairs, best.pairs) << "seed " << seed;
        EXPECT_NEAR(found.weight, best.weight, 1e-9) << "seed " << seed;
        left_over += dual.size() - 2 * found.pairs;
    }
    EXPECT_GT(left_over, 100u); // the graphs were not all easy
}

TEST(MatchTriangles, LeavesNoneOverOnClosedMeshes) {
    for (const Mesh& mesh : {plain_cube(), machined_part(), bumpy_torus(), make_ball({0, 0, 0}, 1)}) {
        const Prepared on(mesh);
        const Dual dual = with_random_weights(on.twins, 11, 0);
        EXPECT_EQ(worth_of(dual, match_triangles(dual.opposite, dual.weights)).pairs, dual.size() / 2);
    }
}

TEST(MatchTriangles, PrefersMorePairsToHeavierOnes) {
    // four in a row: the heavy edge in the middle would leave both ends alone
    const std::vector<Triangle> row = {{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 5, 2}};
    Dual dual{opposite_half_edges(row, 6), {}};
    for (Index h = 0; h < 12; ++h) {
        const Index g = dual.opposite[h];
        const bool middle = g != kNoIndex && std::minmax(h / 3, g / 3) == std::pair<const Index&, const Index&>(1u, 2u);
        dual.weights.push_back(middle ? 1 : 0);
    }
    EXPECT_EQ(match_triangles(dual.opposite, dual.weights), (std::vector<Index>{1, 0, 3, 2}));
}

TEST(MatchTriangles, EdgeCases) {
    EXPECT_TRUE(match_triangles({}, {}).empty());
    EXPECT_EQ(match_triangles({kNoIndex, kNoIndex, kNoIndex}, {1, 1, 1}), std::vector<Index>{kNoIndex});
    EXPECT_EQ(match_triangles({3, kNoIndex, kNoIndex, 0, kNoIndex, kNoIndex}, {-1, -1, -1, -1, -1, -1}),
              (std::vector<Index>{kNoIndex, kNoIndex})); // forbidden
    // two triangles back to back share three edges
    EXPECT_EQ(match_triangles({3, 5, 4, 0, 2, 1}, {0.5, 0.5, 0.5, 0.5, 0.5, 0.5}), (std::vector<Index>{1, 0}));
}

TEST(MatchTriangles, StopsWhenItIsCancelled) {
    const Prepared on(make_wavy_sphere({.resolution = 40}));
    const Dual dual = with_random_weights(on.twins, 3, 0);
    int asked = 0;
    EXPECT_TRUE(match_triangles(dual.opposite, dual.weights, [&] { return ++asked == 2; }).empty());
    EXPECT_EQ(asked, 2);
}

} // namespace
} // namespace filigree
