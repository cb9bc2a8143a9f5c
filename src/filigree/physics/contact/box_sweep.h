// Which of many boxes come near each other. Private to the layer.
#pragma once

#include "filigree/core/bits.h"
#include "filigree/types.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace filigree {

/// Boxes as they are swept along the longest side of them all. Same results on any processor.
class BoxSweep {
public:
    struct Bounds {
        Vec3f low, high; ///< finite
    };
    explicit BoxSweep(std::span<const Bounds> boxes); ///< cost O(boxes)

    std::span<const Index> order() const { return order_; } ///< numbers of boxes as they are swept
    /// Calls visit(b) for the boxes from the a-th on that come within `around` of it, itself too: places in order(),
    /// ascending. room: overwritten. Cost O(boxes that begin before the a-th ends).
    template <class Visit>
    void each_near(std::size_t a, float around, std::vector<std::uint16_t>& room, const Visit& visit) const {
        const std::size_t groups = find_near(a, around, room);
        for (std::size_t group = 0; group < groups; ++group)
            for_each_bit(room[group], [&](int k) { visit(a + kAtOnce * group + std::size_t(k)); });
    }

private:
    static constexpr std::size_t kAtOnce = 16; // so that the compiler uses vectors
    std::size_t find_near(std::size_t a, float around, std::vector<std::uint16_t>& near) const;
    struct FindNear;
    void sort(std::span<const Bounds> boxes, int along, float low, float high);

    std::vector<Index> order_;
    std::array<std::vector<float>, 3> low_, high_; ///< along the sweep, and along the others; infinite at the end
    std::vector<float> slabs_;                     ///< no box from here on begins before; infinite at the end
};

} // namespace filigree
