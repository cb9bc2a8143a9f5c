// Which things belong together, as pairs of them are joined.
#pragma once

#include "filigree/core/atomic_ref.h"
#include "filigree/types.h"

#include <numeric>
#include <utility>

namespace filigree {

/// Sets of the numbers below `count`, each alone at first. The root of a set is its lowest member, whatever the order
/// of the joins. Many threads may call root and join at once; the roots are final when all joins are done. Almost O(1)
/// a call.
class DisjointSets {
public:
    explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), Index{0}); }

    Index root(Index i) {
        for (;;) {
            const Index parent = load(i);
            if (parent == i) return i;
            const Index above = load(parent);
            // Halve the path. A slower thread may put an older ancestor back, which only keeps the path longer.
            if (above != parent) atomic_ref(parent_[i]).store(above, std::memory_order_relaxed);
            i = above;
        }
    }

    /// Whether a and b were in different sets.
    bool join(Index a, Index b) {
        for (;;) {
            a = root(a);
            b = root(b);
            if (a == b) return false;
            if (a > b) std::swap(a, b);
            Index expected = b;
            if (atomic_ref(parent_[b]).compare_exchange_strong(expected, a, std::memory_order_relaxed)) return true;
        }
    }

private:
    Index load(Index i) { return atomic_ref(parent_[i]).load(std::memory_order_relaxed); }
    std::vector<Index> parent_; ///< never above the index itself; once below it, never back
};

} // namespace filigree
