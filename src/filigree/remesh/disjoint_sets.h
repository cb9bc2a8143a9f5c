// Which things belong together, as pairs of them are joined.
#pragma once

#include "filigree/core/types.h"

#include <algorithm>
#include <numeric>

namespace filigree {

/// Sets of the numbers below `count`, each alone at first. The root of a set is its lowest member. Almost O(1) a call.
class DisjointSets {
public:
    explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), Index{0}); }

    Index root(Index i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]]; // halves the path
        return i;
    }
    /// Whether a and b were in different sets.
    bool join(Index a, Index b) {
        a = root(a);
        b = root(b);
        if (a == b) return false;
        parent_[std::max(a, b)] = std::min(a, b);
        return true;
    }

private:
    std::vector<Index> parent_;
};

} // namespace filigree
