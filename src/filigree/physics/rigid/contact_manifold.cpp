#include "filigree/physics/rigid/contact_manifold.h"

#include <algorithm>
#include <limits>

namespace filigree {

namespace {

constexpr float kLeastManifoldWeight = 0.01f;
constexpr float kSimilar = 0.9f;    ///< cosine between the normals of a group and its deepest point's
constexpr float kKeptBefore = 1.1f; ///< a point that pushed counts as so much further out ...
constexpr float kKeptDeeper = 0.1f; ///< ... and as so much of the scale deeper

/// The points of one group, and which of them are kept.
class Group {
public:
    Group(std::span<ManifoldPoint> points, std::size_t deepest, Index number, float scale)
        : points_(points), deepest_(points[deepest]), number_(number), scale_(scale) {}

    void reduce() {
        deepest_.is_kept = true;
        ManifoldPoint* far = keep_best([&](const Vec3f& p) { return (p - deepest_.place).squaredNorm(); });
        if (!far) return;
        const Vec3f side = deepest_.normal.cross(far->place - deepest_.place);
        for (const float sign : {1.0f, -1.0f})
            keep_best([&](const Vec3f& p) { return sign * side.dot(p - deepest_.place); });
        give_forces();
    }

private:
    bool has(const ManifoldPoint& point) const { return point.group == number_; }
    /// What comes less near counts for less.
    float weight(const ManifoldPoint& point) const {
        const float further = point.separation - deepest_.separation;
        const float near = std::max(kLeastManifoldWeight, 1 - further / std::max(scale_, 1e-12f));
        return point.force.isZero(0) ? near : kKeptBefore * near;
    }
    /// Null where nothing scores.
    template <class Score>
    ManifoldPoint* keep_best(const Score& score) {
        ManifoldPoint* best = nullptr;
        float most = 0;
        for (ManifoldPoint& point : points_) {
            if (!has(point) || point.is_kept) continue;
            const float rank = score(point.place) * weight(point);
            if (!(rank > most)) continue;
            most = rank;
            best = &point;
        }
        if (best) best->is_kept = true;
        return best;
    }
    void give_forces() {
        for (ManifoldPoint& point : points_) {
            if (!has(point) || point.is_kept || point.force.isZero(0)) continue;
            ManifoldPoint* nearest = &deepest_;
            float least = std::numeric_limits<float>::infinity();
            for (ManifoldPoint& other : points_) {
                const float away = (other.place - point.place).squaredNorm();
                if (!has(other) || !other.is_kept || !(away < least)) continue;
                least = away;
                nearest = &other;
            }
            nearest->force += point.force;
            point.force = Vec3f::Zero();
        }
    }

    std::span<ManifoldPoint> points_;
    ManifoldPoint& deepest_;
    const Index number_;
    const float scale_;
};

} // namespace

void reduce_manifold(std::span<ManifoldPoint> points, float scale) {
    if (points.size() <= kMostInManifold) {
        for (ManifoldPoint& point : points) point.is_kept = true;
        return;
    }
    for (Index group = 1;; ++group) {
        std::size_t deepest = points.size();
        float least = std::numeric_limits<float>::infinity();
        for (std::size_t k = 0; k < points.size(); ++k) {
            const float depth = points[k].separation - (points[k].force.isZero(0) ? 0 : kKeptDeeper * scale);
            if (points[k].group != 0 || !(depth < least)) continue;
            least = depth;
            deepest = k;
        }
        if (deepest == points.size()) return;
        for (ManifoldPoint& point : points)
            if (point.group == 0 && point.normal.dot(points[deepest].normal) > kSimilar) point.group = group;
        points[deepest].group = group; // also where its normal is not a number
        Group(points, deepest, group, scale).reduce();
    }
}

} // namespace filigree
