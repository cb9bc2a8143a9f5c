#include "filigree/physics/rigid/contact_manifold.h"

#include <algorithm>
#include <array>
#include <limits>

namespace filigree {

namespace {

constexpr std::size_t kMostKept = 4; ///< of a group
constexpr float kSimilar = 0.9f;     ///< cosine between the normals of a group and its deepest point's
constexpr float kKeptBefore = 1.1f;  ///< a point that pushed counts as so much further out ...
constexpr float kKeptDeeper = 0.1f;  ///< ... and as so much of the margin deeper

/// The points of one group, and which of them are kept.
class Group {
public:
    Group(std::span<ManifoldPoint> points, const std::vector<Index>& members, float margin)
        : points_(points), members_(members), margin_(margin) {}

    void reduce() {
        if (members_.size() <= kMostKept) {
            for (const Index k : members_) points_[k].is_kept = true;
            return;
        }
        const Vec3f first = keep(members_[0]);
        const auto keep_best = [&](const auto& score) {
            Index best = kNoIndex;
            float most = 0;
            for (const Index k : members_) {
                if (points_[k].is_kept) continue;
                const float rank = score(points_[k].place) * weight(points_[k]);
                if (!(rank > most)) continue;
                most = rank;
                best = k;
            }
            return best;
        };
        const Index far = keep_best([&](const Vec3f& p) { return (p - first).squaredNorm(); });
        if (far == kNoIndex) return give_forces();
        const Vec3f second = keep(far), normal = points_[members_[0]].normal;
        const auto beside = [&](const Vec3f& p) { return (second - first).cross(p - first).dot(normal); };
        const Index left = keep_best([&](const Vec3f& p) { return beside(p); });
        const Index right = keep_best([&](const Vec3f& p) { return -beside(p); });
        for (const Index k : {left, right})
            if (k != kNoIndex) keep(k);
        give_forces();
    }

private:
    Vec3f keep(Index k) {
        points_[k].is_kept = true;
        return points_[k].place;
    }
    /// What hardly comes near counts for less.
    float weight(const ManifoldPoint& point) const {
        const float near = 1 - 0.5f * std::clamp(point.separation / std::max(margin_, 1e-12f), 0.0f, 1.0f);
        return point.force.isZero(0) ? near : kKeptBefore * near;
    }
    void give_forces() {
        for (const Index k : members_) {
            ManifoldPoint& point = points_[k];
            if (point.is_kept || point.force.isZero(0)) continue;
            Index nearest = kNoIndex;
            float least = std::numeric_limits<float>::infinity();
            for (const Index other : members_) {
                const float away = (points_[other].place - point.place).squaredNorm();
                if (!points_[other].is_kept || !(away < least)) continue;
                least = away;
                nearest = other;
            }
            if (nearest != kNoIndex) points_[nearest].force += point.force;
            point.force = Vec3f::Zero();
        }
    }

    std::span<ManifoldPoint> points_;
    const std::vector<Index>& members_;
    const float margin_;
};

} // namespace

void reduce_manifold(std::span<ManifoldPoint> points, float margin) {
    if (points.size() <= kMostKept) {
        for (ManifoldPoint& point : points) point.is_kept = true;
        return;
    }
    std::vector<Index> left(points.size()), members, others;
    for (Index k = 0; k < left.size(); ++k) left[k] = k;
    while (!left.empty()) {
        const Index deepest = *std::ranges::min_element(left, {}, [&](Index k) {
            return points[k].separation - (points[k].force.isZero(0) ? 0 : kKeptDeeper * margin);
        });
        members = {deepest};
        others.clear();
        for (const Index k : left) {
            if (k == deepest) continue;
            const bool is_similar = points[k].normal.dot(points[deepest].normal) > kSimilar;
            (is_similar ? members : others).push_back(k);
        }
        Group(points, members, margin).reduce();
        left.swap(others);
    }
}

} // namespace filigree
