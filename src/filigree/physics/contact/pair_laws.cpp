#include "filigree/physics/contact/pair_laws.h"

#include <algorithm>
#include <map>

namespace filigree {

namespace {

std::uint64_t key_of(std::size_t body, std::size_t other) {
    return std::uint64_t(std::min(body, other)) << 32 | std::uint64_t(std::max(body, other));
}

} // namespace

PairLaws::PairLaws(const World& world, std::size_t bodies)
    : usual_{world.body_friction, world.body_restitution}, class_of_(bodies, 0) {
    for (const BodyPair& pair : world.body_pairs) pairs_.emplace_back(key_of(pair.first, pair.second), pair.contact);
    std::ranges::stable_sort(pairs_, {}, &decltype(pairs_)::value_type::first);
    const auto again = std::ranges::unique(pairs_, {}, &decltype(pairs_)::value_type::first); // the first one holds
    pairs_.erase(again.begin(), again.end());

    std::vector<std::vector<Index>> groups(bodies); // of each body: numbers of the lists it is in, ascending
    const auto enter = [&](std::span<const std::size_t> members, Index list) {
        for (const std::size_t body : members)
            if (groups[body].empty() || groups[body].back() != list) groups[body].push_back(list);
    };
    for (std::size_t g = 0; g < world.group_pairs.size(); ++g) {
        enter(world.group_pairs[g].first, Index(2 * g));
        enter(world.group_pairs[g].second, Index(2 * g + 1));
    }
    std::map<std::vector<Index>, Index> classes = {{{}, 0}};
    std::vector<const std::vector<Index>*> lists = {&classes.begin()->first}; // of each class
    for (std::size_t b = 0; b < bodies; ++b) {
        const auto [at, is_new] = classes.emplace(groups[b], Index(classes.size()));
        if (is_new) lists.push_back(&at->first);
        class_of_[b] = at->second;
    }
    class_count_ = classes.size();
    of_classes_.assign(class_count_ * class_count_, usual_);
    const auto is_in = [&](std::size_t c, std::size_t list) { return std::ranges::binary_search(*lists[c], list); };
    for (std::size_t g = world.group_pairs.size(); g-- > 0;) // an earlier one holds
        for (std::size_t a = 0; a < class_count_; ++a)
            for (std::size_t b = 0; b < class_count_; ++b)
                if ((is_in(a, 2 * g) && is_in(b, 2 * g + 1)) || (is_in(b, 2 * g) && is_in(a, 2 * g + 1)))
                    of_classes_[a * class_count_ + b] = world.group_pairs[g].contact;
}

PairContact PairLaws::of(std::size_t body, std::size_t other) const {
    const std::uint64_t key = key_of(body, other);
    const auto pair = std::ranges::lower_bound(pairs_, key, {}, &decltype(pairs_)::value_type::first);
    if (pair != pairs_.end() && pair->first == key) return pair->second;
    return of_classes_[class_of(body) * class_count_ + class_of(other)];
}

} // namespace filigree
