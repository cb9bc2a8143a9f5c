#include "filigree/physics/contact/cell_boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree {

namespace {

constexpr float kBoxSize = 1, kUsualCell = 1.25f;  ///< spacings
constexpr double kMostBoxes = 8, kFewBoxes = 4096; ///< a cell, and whatever their number

} // namespace

CellBoxes::CellBoxes(const Matter& matter, const Vectors& positions, float reach) : matter_(matter) {
    const Cells& cells = matter.body().cells;
    if (matter.is_rigid()) {
        inverse_ = matter.inverse_derivative(positions, {0, Vec3f::Zero()});
        corner_ = positions[matter.corners(0)[0]];
        reach_ = reach;
        low_ = matter.rigid_low();
        high_ = matter.rigid_high();
        return;
    }
    std::vector<Extent> extents(cells.cells.size());
    Vec3f high = Vec3f::Constant(-std::numeric_limits<float>::max());
    low_ = -high;
    bool is_finite = true; // least and most pass over what is no number
    for (Index c = 0; c < extents.size(); ++c) {
        Extent& extent = extents[c];
        extent = {CellBox(cells.cell_corners[c], positions), c};
        extent.low.array() -= reach;
        extent.high.array() += reach;
        is_finite &= (extent.high - extent.low).allFinite();
        low_ = low_.cwiseMin(extent.low);
        high = high.cwiseMax(extent.high);
    }
    if (!is_finite || !(high - low_).allFinite()) return; // the frame is done again
    float step = kBoxSize * float(matter.body().spacing());
    around_ = 0.5f * kUsualCell * float(matter.body().spacing()) + reach;
    const auto boxes = [&] { return ((high - low_) / step).array().floor().cast<double>() + 1; };
    while (boxes().prod() > kMostBoxes * double(extents.size()) + kFewBoxes) step *= 1.25f;
    for (int axis = 0; axis < 3; ++axis) counts_[axis] = int(boxes()[axis]);
    boxes_a_metre_ = 1 / step;

    const auto each_box = [&](const Extent& extent, const auto& visit) {
        const Vec3f middle = 0.5f * (extent.low + extent.high);
        const auto [from, to] = range((extent.low.array() + around_).cwiseMin(middle.array()),
                                      (extent.high.array() - around_).cwiseMax(middle.array()));
        for (int k = from[2]; k <= to[2]; ++k)
            for (int j = from[1]; j <= to[1]; ++j)
                for (int i = from[0]; i <= to[0]; ++i) visit((std::size_t(k) * counts_[1] + j) * counts_[0] + i);
    };
    offsets_.assign(std::size_t(counts_[0]) * counts_[1] * counts_[2] + 1, 0);
    for (const Extent& extent : extents) each_box(extent, [&](std::size_t box) { ++offsets_[box + 1]; });
    for (std::size_t box = 1; box < offsets_.size(); ++box) offsets_[box] += offsets_[box - 1];
    extents_.resize(offsets_.back());
    std::vector<Index> next(offsets_.begin(), offsets_.end() - 1);
    for (const Extent& extent : extents) each_box(extent, [&](std::size_t box) { extents_[next[box]++] = extent; });
}

CellBoxes::Near CellBoxes::find_rigid(const Vec3f& point) const {
    const Vec3f local = inverse_ * (point - corner_);
    const float around = reach_ / float(matter_.body().spacing());
    if ((local.array() < low_.array() - around).any() || (local.array() > high_.array() + around).any()) return {};
    const Vec3f rest = matter_.rest_position({0, local});
    const float distance = matter_.body().field->at(rest).distance - matter_.body().field_radius;
    return {distance < reach_ ? 0 : kNoIndex, std::max(0.0f, distance)};
}

TurnedBox CellBoxes::rigid_box() const {
    const auto spacing = float(matter_.body().spacing());
    const Mat3f axes = spacing * spacing * inverse_.transpose(); // of a cell
    return {corner_ + axes * (0.5f * (low_ + high_)), axes * (0.5f * (high_ - low_)).asDiagonal()};
}

float CellBoxes::gap_of_rigid(const TurnedBox& box) const {
    const Vec3f centre = inverse_ * (box.centre - corner_),
                half = (inverse_ * box.half_axes).cwiseAbs().rowwise().sum();
    const Vec3f gap = (low_ - centre - half).cwiseMax(centre - half - high_).cwiseMax(0);
    return gap.norm() * float(matter_.body().spacing());
}

CellBoxes::Near CellBoxes::find(const Vec3f& point) const {
    if (matter_.is_rigid()) return find_rigid(point);
    if (extents_.empty() || !point.allFinite()) return {};
    const auto [from, to] = range(point.array() - around_, point.array() + around_);
    Near found;
    float least = std::numeric_limits<float>::infinity();
    for (int k = from[2]; k <= to[2]; ++k)
        for (int j = from[1]; j <= to[1]; ++j) {
            const std::size_t row = (std::size_t(k) * counts_[1] + j) * counts_[0];
            for (Index e = offsets_[row + from[0]]; e < offsets_[row + to[0] + 1]; ++e) {
                const Extent& extent = extents_[e];
                if ((point.array() < extent.low.array()).any() || (point.array() > extent.high.array()).any()) continue;
                const float away = (extent.centre - point).squaredNorm();
                if (away >= least) continue;
                least = away;
                found.cell = extent.cell;
            }
        }
    return found;
}

} // namespace filigree
