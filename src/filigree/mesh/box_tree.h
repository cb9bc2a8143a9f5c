// A tree of boxes for questions about what is near a point. Private to the library.
//
// Based on: [Wald 2007] for the split by the surface-area heuristic over bins; four children a node, whose boxes lie
// together so that one comparison of four lanes looks at all of them [Wald et al. 2008].
#pragma once

#include "filigree/context.h"
#include "filigree/core/lanes.h"
#include "filigree/types.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace filigree {

/// In float, so that a tree is half as large.
struct FloatBox {
    Vec3f low, high;
};

/// Finds the items whose boxes are within a radius of a point, about in the order of their distance. An item is a
/// number below the count of boxes. Built in O(N log N) on the context's threads; the tree does not depend on their
/// number. Questions from many threads at once are safe. The constructor throws std::bad_alloc when there is no memory.
class BoxTree {
public:
    BoxTree() = default;
    /// Boxes have finite corners with low <= high. Up to 2^31 - 1 of them.
    BoxTree(std::span<const FloatBox> boxes, const RunContext& context);

    bool is_empty() const { return nodes_.empty(); }

    /// Calls visit(item), which returns the square of the radius from then on: the same or less. Every item whose box
    /// is within the radius that is left is visited, and some that are further. `point` has to be finite.
    template <class Visit>
    void visit_near(const Vec3f& point, float squared_radius, const Visit& visit) const;

private:
    static constexpr int kWidth = 4, kDeepest = 96;  // levels: splits halve the items from level 48 on
    static constexpr std::uint32_t kItem = 1u << 31; // the child is an item

    using Lanes = LaneTypes<kWidth>::Float;
    struct Node {
        std::array<Lanes, 3> low, high; ///< of the children; boxes of nothing have low > high
        std::array<std::uint32_t, kWidth> child;
    };
    struct Builder;

    std::vector<Node> nodes_; ///< the root first
};

template <class Visit>
void BoxTree::visit_near(const Vec3f& point, float squared_radius, const Visit& visit) const {
    if (nodes_.empty()) return;
    struct Waiting {
        float squared_distance;
        std::uint32_t child;
    };
    std::array<Waiting, 3 * kDeepest + 1> stack;
    std::size_t count = 0;
    stack[count++] = {0, 0};
    const Lanes x = Lanes{} + point.x(), y = Lanes{} + point.y(), z = Lanes{} + point.z();
    const auto outside = [](Lanes low, Lanes high, Lanes at) {
        const Lanes below = low - at, above = at - high;
        const Lanes way = below > above ? below : above;
        return way > 0 ? way : Lanes{};
    };
    while (count > 0) {
        const Waiting next = stack[--count];
        if (!(next.squared_distance <= squared_radius)) continue;
        if ((next.child & kItem) != 0) {
            squared_radius = visit(next.child & ~kItem);
            continue;
        }
        const Node& node = nodes_[next.child];
        const Lanes dx = outside(node.low[0], node.high[0], x), dy = outside(node.low[1], node.high[1], y),
                    dz = outside(node.low[2], node.high[2], z);
        const Lanes squared = dx * dx + dy * dy + dz * dz;
        const std::size_t first = count; // the nearest child comes last, and is looked at first
        for (int k = 0; k < kWidth; ++k) {
            if (!(squared[k] <= squared_radius)) continue;
            const Waiting child{squared[k], node.child[k]};
            std::size_t place = count++;
            for (; place > first && stack[place - 1].squared_distance < child.squared_distance; --place)
                stack[place] = stack[place - 1];
            stack[place] = child;
        }
    }
}

} // namespace filigree
