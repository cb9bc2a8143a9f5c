// Many lists end to end in one array, and orders.
#pragma once

#include "filigree/types.h"

#include <cassert>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace filigree {

/// Lists of items, end to end in one array. Offset: an integer that can count all items.
template <class T, class Offset = Index>
struct Lists {
    std::vector<Offset> offsets = {0}; ///< where each list begins; one more than there are lists, ascending
    std::vector<T> items;

    std::size_t size() const { return offsets.empty() ? 0 : offsets.size() - 1; }
    std::span<const T> operator[](std::size_t list) const {
        return std::span(items).subspan(offsets[list], offsets[list + 1] - offsets[list]);
    }

    /// For loops over the lists.
    struct Iterator {
        const Lists* lists;
        std::size_t at;
        std::span<const T> operator*() const { return (*lists)[at]; }
        Iterator& operator++() {
            ++at;
            return *this;
        }
        bool operator==(const Iterator& other) const { return at == other.at; }
    };
    Iterator begin() const { return {this, 0}; }
    Iterator end() const { return {this, size()}; }
};
using IndexLists = Lists<Index>;

/// Sorts items into `count` lists by counting. In each list, items keep the order they are given in. for_each(add)
/// calls add(list, item) for every item; it is called twice and has to give the same items both times.
/// Cost O(count + items).
template <class T, class Offset = Index, class ForEach>
Lists<T, Offset> make_lists(std::size_t count, const ForEach& for_each) {
    Lists<T, Offset> lists;
    std::vector<Offset>& offsets = lists.offsets;
    offsets.assign(count + 2, 0); // shifted by one, so that filling moves each begin to where it belongs
    [[maybe_unused]] std::size_t items = 0;
    for_each([&](std::size_t list, const T&) {
        ++offsets[list + 2];
        assert(++items <= std::numeric_limits<Offset>::max());
    });
    std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
    lists.items.resize(offsets.back());
    for_each([&](std::size_t list, const T& item) { lists.items[offsets[list + 1]++] = item; });
    offsets.pop_back();
    return lists;
}

/// Where each item went: inverse[order[i]] is i. order: a permutation of 0 to its size - 1.
inline std::vector<Index> inverse_order(std::span<const Index> order) {
    std::vector<Index> inverse(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) inverse[order[i]] = static_cast<Index>(i);
    return inverse;
}

} // namespace filigree
