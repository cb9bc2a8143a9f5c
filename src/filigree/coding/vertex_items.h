// Which of a vertex's items is like another, in constant time however many the vertex has.
#pragma once

#include "filigree/core/hash.h"
#include "filigree/types.h"

#include <unordered_map>

namespace filigree {

/// Items 0, 1, 2 ... each with a vertex and a key that no other item of that vertex has. A vertex's first few are
/// looked at one by one, as most have no more; those behind them are found by a hash.
class VertexItems {
public:
    using Key = std::array<std::int32_t, 4>;

    explicit VertexItems(std::size_t vertices) : newest_(vertices, kNoIndex), counts_(vertices, 0) {}

    /// kNoIndex: there is none.
    Index find(Index vertex, const Key& key) const {
        for (Index item = newest_[vertex]; item != kNoIndex; item = before_[item])
            if (keys_[item] == key) return item;
        if (counts_[vertex] < kFewItems) return kNoIndex;
        const auto found = further_.find({vertex, key});
        return found == further_.end() ? kNoIndex : found->second;
    }
    /// The number of the new item.
    Index add(Index vertex, const Key& key) {
        const auto item = static_cast<Index>(keys_.size());
        keys_.push_back(key);
        before_.push_back(newest_[vertex]);
        if (counts_[vertex] < kFewItems) {
            newest_[vertex] = item;
            ++counts_[vertex];
        } else {
            further_.emplace(Named{vertex, key}, item);
        }
        return item;
    }

private:
    static constexpr std::uint8_t kFewItems = 8;
    struct Named {
        Index vertex;
        Key key;
        bool operator==(const Named&) const = default;
    };
    struct Hash {
        std::size_t operator()(const Named& named) const {
            const auto& [a, b, c, d] = named.key;
            return hash_words(named.vertex, a, b, c, d);
        }
    };

    std::vector<Index> newest_, before_; ///< of each vertex, of its first few; of each item, the one before it
    std::vector<std::uint8_t> counts_;   ///< of each vertex: its first few
    std::vector<Key> keys_;
    std::unordered_map<Named, Index, Hash> further_;
};

} // namespace filigree
