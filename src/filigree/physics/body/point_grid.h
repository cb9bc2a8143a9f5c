// Finding points near a place. Private to the layer.
#pragma once

#include "filigree/physics/body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace filigree {

/// Points sorted by the boxes of a grid.
class PointGrid {
public:
    /// points: finite.
    PointGrid(const Vectors& points, float box_size) : inverse_size_(1 / double(box_size)) {
        const std::size_t n = points.size();
        least_ = Vec3d::Constant(std::numeric_limits<double>::infinity());
        for (std::size_t i = 0; i < n; ++i) least_ = least_.cwiseMin(points[i].cast<double>());
        sorted_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            const auto at = box_of(points[i]);
            sorted_[i] = {key(at[0], at[1], at[2]), Index(i)};
        }
        std::sort(sorted_.begin(), sorted_.end());
    }

    /// Calls visit(index) for all points in boxes within `radius` of a point, and some more.
    template <class Visit>
    void near(const Vec3f& point, float radius, const Visit& visit) const {
        const auto low = box_of(point - Vec3f::Constant(radius)), high = box_of(point + Vec3f::Constant(radius));
        for (std::int64_t k = low[2]; k <= high[2]; ++k)
            for (std::int64_t j = low[1]; j <= high[1]; ++j) {
                const Entry first{key(low[0], j, k), 0};
                const std::uint64_t last = key(high[0], j, k);
                for (auto e = std::lower_bound(sorted_.begin(), sorted_.end(), first);
                     e != sorted_.end() && e->key <= last; ++e)
                    visit(e->index);
            }
    }

private:
    static constexpr std::int64_t kMostBoxes = (std::int64_t{1} << 21) - 1;
    struct Entry {
        std::uint64_t key;
        Index index;
        auto operator<=>(const Entry&) const = default;
    };

    std::array<std::int64_t, 3> box_of(const Vec3f& point) const {
        std::array<std::int64_t, 3> box;
        for (int a = 0; a < 3; ++a) {
            const double at = std::floor((double(point[a]) - least_[a]) * inverse_size_);
            box[std::size_t(a)] = std::int64_t(std::clamp(at, 0.0, double(kMostBoxes)));
        }
        return box;
    }
    static std::uint64_t key(std::int64_t i, std::int64_t j, std::int64_t k) {
        return (std::uint64_t(k) << 42) | (std::uint64_t(j) << 21) | std::uint64_t(i);
    }

    double inverse_size_;
    Vec3d least_;
    std::vector<Entry> sorted_;
};

} // namespace filigree
