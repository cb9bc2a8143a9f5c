#include "filigree/physics/rigid/rigid_shape.h"

#include <cmath>
#include <numeric>

namespace filigree {

namespace {

constexpr Index kLeafPoints = 8;
constexpr float kTurnedFromEntry = -0.2f; ///< cosine between the entry and a normal that is not its side's
constexpr int kEntrySteps = 12, kTouchSteps = 12;
constexpr float kTouched = 0.02f; ///< spacings

} // namespace

RigidShape::RigidShape(const Body& body) : body_(body), points_(body.surface.points.rest), numbers_(points_.size()) {
    std::iota(numbers_.begin(), numbers_.end(), Index{0});
    Box box;
    for (const auto& corner : body.cells.corners)
        box.extend(body.cells.origin + body.cells.spacing * Vec3d(corner[0], corner[1], corner[2]));
    for (const Vec3f& point : points_) box.extend(point.cast<double>());
    if (box.empty()) return;
    centre_ = box.centre().cast<float>();
    half_ = (0.5 * box.size()).cast<float>().array() + body.field_radius;
    if (!points_.empty()) add_node(0, Index(points_.size()));
}

/// Halves sets of points along their longest side.
void RigidShape::add_node(Index first, Index last) {
    Box box;
    for (Index k = first; k < last; ++k) box.extend(points_[k].cast<double>());
    const std::size_t number = nodes_.size();
    nodes_.push_back({box.centre().cast<float>(), 0, first, last, 0});
    float radius = 0;
    for (Index k = first; k < last; ++k) radius = std::max(radius, (points_[k] - nodes_[number].centre).norm());
    nodes_[number].radius = radius;
    if (last - first > kLeafPoints) {
        int axis = 0;
        box.size().maxCoeff(&axis);
        std::vector<Index> order(last - first);
        std::iota(order.begin(), order.end(), first);
        std::ranges::stable_sort(order, {}, [&](Index k) { return points_[k][axis]; });
        std::vector<Vec3f> points;
        std::vector<Index> numbers;
        for (const Index k : order) {
            points.push_back(points_[k]);
            numbers.push_back(numbers_[k]);
        }
        std::ranges::copy(points, points_.begin() + first);
        std::ranges::copy(numbers, numbers_.begin() + first);
        const Index middle = first + (last - first) / 2;
        add_node(first, middle);
        add_node(middle, last);
    }
    nodes_[number].next = Index(nodes_.size());
}

DistanceField::Sample RigidShape::surface(const Vec3f& at, const Vec3f& entry) const {
    const DistanceField::Sample nearest = surface(at);
    if (!(nearest.distance < 0) || !(nearest.normal.dot(entry) < kTurnedFromEntry)) return nearest;
    float way = 0;
    for (int step = 0; step < kEntrySteps; ++step) {
        const float left = -distance(at + way * entry);
        if (!(left > 1e-3f * float(body_.spacing()))) break;
        way += left;
    }
    return {-way, entry};
}

float RigidShape::first_touch(const Vec3f& from, const Vec3f& way) const {
    const float length = way.norm();
    float gone = 0;
    for (int step = 0; step < kTouchSteps && gone <= length; ++step) {
        const float left = distance(from + gone / length * way);
        if (!(left > kTouched * float(body_.spacing()))) break;
        gone += left;
    }
    return length > 0 ? gone / length : 2;
}

} // namespace filigree
