// How each two bodies touch, made ready to be asked often. Private to the layer.
#pragma once

#include "filigree/physics/world.h"

#include <utility>

namespace filigree {

/// World::contact_of of all bodies. Bodies that stand in the same groups are of one class, and classes have a matrix,
/// so that a rule of two materials takes no more room and time the more bodies there are.
class PairLaws {
public:
    PairLaws(const World& world, std::size_t bodies);

    /// Cost O(log(pairs of single bodies)). Bodies that came later than the world was made are in no group.
    PairContact of(std::size_t body, std::size_t other) const;
    std::size_t class_count() const { return class_count_; }

private:
    std::size_t class_of(std::size_t body) const { return body < class_of_.size() ? class_of_[body] : 0; }

    PairContact usual_;
    std::vector<std::pair<std::uint64_t, PairContact>> pairs_; ///< of single bodies, ascending by both
    std::vector<Index> class_of_;                              ///< of each body
    std::size_t class_count_ = 1;
    std::vector<PairContact> of_classes_; ///< row by row
};

} // namespace filigree
