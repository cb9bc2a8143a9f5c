// Why a try at quads failed, and the sentence for it.
#pragma once

#include "filigree/types.h"

#include <string>

namespace filigree {

/// What a try failed by. Numbers that a kind does not name are 0.
struct QuadFailure {
    enum class Kind {
        too_many_patches, ///< count: patches; most
        too_few_quads,    ///< parts; count: quads that they need at `levels`
        feature_corners,  ///< count: corners of sharp edges; most: patches
        feature_quads,    ///< count: quads that features and handles need at `levels`
        inverted,         ///< count: inverted quads; most: all quads
        topology,         ///< euler, expected_euler
        distance,         ///< furthest, allowed: fractions of the diagonal
    };
    Kind kind;
    std::size_t count = 0, most = 0, parts = 0;
    unsigned levels = 0;
    std::int64_t euler = 0, expected_euler = 0;
    double furthest = 0, allowed = 0;
    bool by_features = false; ///< with fewer features, or none, it may not fail
};

/// What happened, and what to ask for instead.
std::string sentence(const QuadFailure& failure);

} // namespace filigree
