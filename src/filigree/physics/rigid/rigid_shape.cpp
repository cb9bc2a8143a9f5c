#include "filigree/physics/rigid/rigid_shape.h"

#include <cmath>
#include <limits>
#include <numeric>

namespace filigree {

namespace {

constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN(); ///< in no box
constexpr float kTurnedFromEntry = -0.2f; ///< cosine between the entry and a normal that is not its side's
constexpr int kEntrySteps = 12, kTouchSteps = 12;
constexpr float kTouched = 0.02f; ///< spacings

} // namespace

RigidShape::RigidShape(const Body& body) : body_(body) {
    const std::vector<Vec3f>& points = body.surface.points.rest;
    Box box;
    for (const auto& corner : body.cells.corners)
        box.extend(body.cells.origin + body.cells.spacing * Vec3d(corner[0], corner[1], corner[2]));
    for (const Vec3f& point : points) box.extend(point.cast<double>());
    if (box.empty()) return;
    centre_ = box.centre().cast<float>();
    half_ = (0.5 * box.size()).cast<float>().array() + body.field_radius;
    std::vector<Index> numbers(points.size());
    std::iota(numbers.begin(), numbers.end(), Index{0});
    if (!numbers.empty()) add_node(numbers);
}

/// Halves sets of points along their longest side.
void RigidShape::add_node(std::span<Index> numbers) {
    const std::vector<Vec3f>& points = body_.surface.points.rest;
    Box box;
    for (const Index k : numbers) box.extend(points[k].cast<double>());
    const std::size_t number = nodes_.size();
    const Vec3f centre = box.centre().cast<float>();
    float radius = 0;
    for (const Index k : numbers) radius = std::max(radius, (points[k] - centre).norm());
    nodes_.push_back({centre, radius, Index(blocks_.size()), 0});
    if (numbers.size() > kBlock) {
        int axis = 0;
        box.size().maxCoeff(&axis);
        std::ranges::stable_sort(numbers, {}, [&](Index k) { return points[k][axis]; });
        add_node(numbers.first(numbers.size() / 2));
        add_node(numbers.subspan(numbers.size() / 2));
    } else {
        Block& block = blocks_.emplace_back();
        for (std::size_t k = 0; k < kBlock; ++k) {
            const Vec3f point = k < numbers.size() ? points[numbers[k]] : Vec3f::Constant(kNowhere);
            block.x[k] = point.x();
            block.y[k] = point.y();
            block.z[k] = point.z();
            block.numbers[k] = k < numbers.size() ? numbers[k] : kNoIndex;
        }
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
