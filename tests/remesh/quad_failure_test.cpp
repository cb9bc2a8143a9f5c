#include "filigree/remesh/quad_failure.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(QuadFailure, EveryKindHasASentenceWithItsNumbersAndAnAdvice) {
    using Kind = QuadFailure::Kind;
    for (const Kind kind : {Kind::too_many_patches, Kind::too_few_quads, Kind::feature_corners, Kind::feature_quads,
                            Kind::inverted, Kind::topology, Kind::distance}) {
        QuadFailure failure{kind, 123, 456, 1, 1, -2, 4, 0.031, 0.02};
        const std::string text = sentence(failure);
        EXPECT_EQ(text.back(), '.') << text;
        EXPECT_NE(text.find(kind == Kind::topology   ? "please report"
                            : kind == Kind::distance ? "0.031 of the diagonal"
                                                     : "123"),
                  std::string::npos)
            << text;
        EXPECT_NE(text.find("; "), std::string::npos) << text;
    }
}

TEST(QuadFailure, OnePartAndOneLevelAreNotPlural) {
    QuadFailure failure{QuadFailure::Kind::too_few_quads, 64, 0, 1, 1};
    EXPECT_EQ(sentence(failure), "The mesh needs at least 64 quads at 1 level; ask for more quads.");
    failure.parts = 3;
    failure.levels = 2;
    EXPECT_EQ(sentence(failure), "The mesh has 3 separate parts, which need at least 64 quads at 2 levels; ask for "
                                 "more quads, or for a wrap around them.");
}

} // namespace
} // namespace filigree
