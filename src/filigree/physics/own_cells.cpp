#include "filigree/physics/own_cells.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>

namespace filigree {

namespace {

constexpr std::size_t kOwnCellsGrain = 16, kClusterCells = 8;
constexpr float kClusterBoxSize = 2.5f;                          ///< spacings
constexpr double kMostClusterBoxes = 8, kFewClusterBoxes = 4096; ///< a cluster, and whatever their number
constexpr double kTangledClusters = 512;   ///< boxes, and near clusters, a cluster of a body crushed or mixed
constexpr std::size_t kTangledPoints = 16; ///< near points a point of such a body

} // namespace

OwnCells::OwnCells(const Matter& matter) : matter_(matter), points_(matter.body().surface.points) {
    const Cells& cells = matter.body().cells;
    std::map<Key, std::vector<Index>> by_key;
    for (Index c = 0; c < cells.cells.size(); ++c)
        by_key[{cells.cells[c][0] / 2, cells.cells[c][1] / 2, cells.cells[c][2] / 2}].push_back(c);
    std::vector<std::vector<Index>> points_of(cells.cells.size());
    const auto spacing = float(cells.spacing);
    for (Index s = 0; s < points_.size(); ++s) {
        const Index cell = matter.cell_of_point(s);
        points_of[cell].push_back(s);
        const Vec3f middle = matter.rest_position({cell, Vec3f::Constant(0.5f)});
        overhang_ = std::max(overhang_, (points_.rest[s] - middle).cwiseAbs().maxCoeff() - 0.5f * spacing);
    }
    for (const auto& [at, members] : by_key) {
        clusters_.push_back({at, 0, Index(cells_.size()), Index(corners_.size()), 0});
        std::vector<Index> corners;
        for (const Index cell : members) {
            cells_.push_back(cell);
            point_offsets_.push_back(Index(surface_points_.size()));
            corners.insert(corners.end(), cells.cell_corners[cell].begin(), cells.cell_corners[cell].end());
            surface_points_.insert(surface_points_.end(), points_of[cell].begin(), points_of[cell].end());
        }
        std::ranges::sort(corners);
        corners.erase(std::ranges::unique(corners).begin(), corners.end());
        corners_.insert(corners_.end(), corners.begin(), corners.end());
    }
    clusters_.push_back({{}, 0, Index(cells_.size()), Index(corners_.size()), 0});
    point_offsets_.push_back(Index(surface_points_.size()));

    auto cluster = clusters_.begin();
    for (const auto& [at, members] : by_key) {
        cluster->first_far = Index(far_cells_.size());
        for (int n = 0; n < 27; ++n) {
            const auto other = by_key.find({at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1});
            if (other == by_key.end()) continue;
            std::uint64_t far = 0;
            for (std::size_t j = 0; j < other->second.size(); ++j)
                for (std::size_t i = 0; i < members.size(); ++i)
                    far |= std::uint64_t{are_far(members[i], other->second[j])} << (i + kClusterCells * j);
            if (far == 0) continue;
            cluster->far_near |= 1u << n;
            far_cells_.push_back(far);
        }
        ++cluster;
    }
}

/// As far_cells_, of any two clusters that have such cells.
std::uint64_t OwnCells::far_cells(Index cluster, Index other) const {
    const int n = neighbour(cluster, other);
    if (n < 0) return ~std::uint64_t{0};
    const std::uint32_t before = clusters_[cluster].far_near & ((1u << n) - 1);
    return far_cells_[clusters_[cluster].first_far + Index(std::popcount(before))];
}

/// Which of the 3^3 clusters around a cluster is b; -1: none.
int OwnCells::neighbour(Index a, Index b) const {
    const Key &from = clusters_[a].at, &to = clusters_[b].at;
    const int i = to[0] - from[0] + 1, j = to[1] - from[1] + 1, k = to[2] - from[2] + 1;
    return std::min({i, j, k}) < 0 || std::max({i, j, k}) > 2 ? -1 : i + 3 * j + 9 * k;
}

bool OwnCells::are_far(Index cell, Index other) const {
    const auto &from = matter_.body().cells.cells[cell], &to = matter_.body().cells.cells[other];
    const bool neighbours = std::abs(from[0] / 2 - to[0] / 2) <= 1 && std::abs(from[1] / 2 - to[1] / 2) <= 1 &&
                            std::abs(from[2] / 2 - to[2] / 2) <= 1;
    return !(neighbours ? matter_.are_in_three_steps(cell, other) : matter_.are_together(cell, other));
}

OwnCells::Extent OwnCells::extent_of(std::span<const Index> members, const Vectors& places) {
    Extent extent{.low = {}, .high = {}, .centre = {}, .radius = -1};
    if (members.empty()) return extent;
    extent.low = extent.high = places[members[0]];
    for (const Index member : members) {
        const Vec3f p = places[member];
        extent.low = extent.low.cwiseMin(p);
        extent.high = extent.high.cwiseMax(p);
    }
    extent.centre = 0.5f * (extent.low + extent.high);
    float squared = 0;
    for (const Index member : members) squared = std::max(squared, (places[member] - extent.centre).squaredNorm());
    extent.radius = std::sqrt(squared);
    return extent;
}

std::vector<OwnCells::Extent> OwnCells::extents(const Vectors& positions) const {
    std::vector<Extent> extents(clusters_.size() - 1);
    for (std::size_t k = 0; k < extents.size(); ++k)
        extents[k] = extent_of(std::span(corners_).subspan(clusters_[k].first_corner,
                                                           clusters_[k + 1].first_corner - clusters_[k].first_corner),
                               positions);
    return extents;
}

/// Pairs of clusters that come within `around` of each other and have cells that are far; ascending, both ways round.
/// None where there are more than `most` boxes or pairs.
std::vector<std::pair<Index, Index>> OwnCells::near_clusters(std::span<const Extent> extents, float around,
                                                             double most) const {
    Vec3f low = Vec3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
    for (const Extent& extent : extents) {
        if (extent.radius < 0) continue;
        if (!(extent.high - extent.low).allFinite()) return {}; // the frame is done again
        low = low.cwiseMin(extent.low);
        high = high.cwiseMax(extent.high);
    }
    if (!(high - low).allFinite()) return {};
    const float half = 0.5f * around;
    low.array() -= half;
    high.array() += half;
    float step = kClusterBoxSize * float(matter_.body().spacing());
    const auto boxes = [&] { return ((high - low) / step).array().floor().cast<double>() + 1; };
    while (boxes().prod() > kMostClusterBoxes * double(extents.size()) + kFewClusterBoxes) step *= 1.25f;
    const Eigen::Array3i counts = boxes().cast<int>();
    const auto boxes_of = [&](const Extent& extent) {
        Eigen::Array3i from, to;
        for (int axis = 0; axis < 3; ++axis) {
            from[axis] = int((extent.low[axis] - half - low[axis]) / step);
            to[axis] = std::min(int((extent.high[axis] + half - low[axis]) / step), counts[axis] - 1);
        }
        return std::pair(from, to);
    };
    const auto each_box = [&](const Extent& extent, const auto& visit) {
        if (extent.radius < 0) return;
        const auto [from, to] = boxes_of(extent);
        for (int k = from[2]; k <= to[2]; ++k)
            for (int j = from[1]; j <= to[1]; ++j)
                for (int i = from[0]; i <= to[0]; ++i) visit((std::size_t(k) * counts[1] + j) * counts[0] + i);
    };
    double in_boxes = 0;
    for (const Extent& extent : extents) {
        if (extent.radius < 0) continue;
        const auto [from, to] = boxes_of(extent);
        in_boxes += (to - from + 1).cast<double>().prod();
    }
    if (in_boxes > most) return {};
    std::vector<std::pair<Index, Index>> near;
    std::vector<Index> offsets(std::size_t(counts.cast<double>().prod()) + 1, 0);
    for (const Extent& extent : extents) each_box(extent, [&](std::size_t box) { ++offsets[box + 1]; });
    for (std::size_t box = 1; box < offsets.size(); ++box) offsets[box] += offsets[box - 1];
    std::vector<Index> entries(offsets.back()), next(offsets.begin(), offsets.end() - 1);
    for (Index k = 0; k < extents.size(); ++k) each_box(extents[k], [&](std::size_t box) { entries[next[box]++] = k; });

    struct ClusterBall { // and what else decides most pairs, side by side in memory
        Vec3f centre;
        float radius;
        Key at;
        Index cluster;
        std::uint32_t far_near;
    };
    const auto come_near = [&](const ClusterBall& a, const ClusterBall& b) {
        const int i = b.at[0] - a.at[0] + 1, j = b.at[1] - a.at[1] + 1, k = b.at[2] - a.at[2] + 1;
        if (unsigned(i) <= 2 && unsigned(j) <= 2 && unsigned(k) <= 2)
            return (a.far_near >> (i + 3 * j + 9 * k) & 1) != 0;
        const float far = a.radius + b.radius + around;
        if ((a.centre - b.centre).squaredNorm() > far * far) return false;
        const Extent &one = extents[a.cluster], &other = extents[b.cluster];
        return (one.low.array() - around <= other.high.array()).all() &&
               (other.low.array() - around <= one.high.array()).all();
    };
    std::vector<ClusterBall> balls;
    for (std::size_t box = 0; box + 1 < offsets.size(); ++box) {
        balls.clear();
        for (Index k = offsets[box]; k < offsets[box + 1]; ++k) {
            const Index c = entries[k];
            balls.push_back({extents[c].centre, extents[c].radius, clusters_[c].at, c, clusters_[c].far_near});
        }
        for (std::size_t p = 0; p < balls.size(); ++p) {
            if (double(near.size()) > most) return {};
            for (std::size_t q = p; q < balls.size(); ++q) {
                if (!come_near(balls[p], balls[q])) continue;
                near.emplace_back(balls[p].cluster, balls[q].cluster);
                if (p != q) near.emplace_back(balls[q].cluster, balls[p].cluster);
            }
        }
    }
    std::ranges::sort(near);
    near.erase(std::ranges::unique(near).begin(), near.end());
    return near;
}

/// Of cells_; of the clusters in `near` alone.
std::vector<OwnCells::CellBox> OwnCells::cell_boxes(std::span<const std::pair<Index, Index>> near,
                                                    const Vectors& positions, const RunContext& context) const {
    std::vector<std::uint8_t> is_near(clusters_.size() - 1, 0);
    for (const auto& [cluster, other] : near) is_near[cluster] = is_near[other] = 1;
    std::vector<CellBox> boxes(cells_.size());
    parallel_for(context, is_near.size(), kOwnCellsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            if (!is_near[k]) continue;
            for (Index c = clusters_[k].first_cell; c < clusters_[k + 1].first_cell; ++c) {
                const auto& corners = matter_.corners(cells_[c]);
                Vec3f low = positions[corners[0]], high = low, centre = low;
                for (int corner = 1; corner < 8; ++corner) {
                    const Vec3f p = positions[corners[corner]];
                    low = low.cwiseMin(p);
                    high = high.cwiseMax(p);
                    centre += p;
                }
                boxes[c] = {low, high, centre / 8};
            }
        }
    });
    return boxes;
}

/// near: a cluster with those whose cells its points might lie in.
void OwnCells::look_into(std::span<const std::pair<Index, Index>> near, std::span<const Extent> extents,
                         std::span<const CellBox> boxes, const Vectors& positions, float reach,
                         std::vector<Index>& found) const {
    const Index cluster = near[0].first, begin = clusters_[cluster].first_cell, end = clusters_[cluster + 1].first_cell;
    struct Point {
        Vec3f place;
        Index number;
        float least;
    };
    std::array<std::vector<Point>, kClusterCells> points; // of each cell, once any is asked for
    const auto come_near = [](const auto& a, const auto& b, float around) {
        return a.low.x() - around <= b.high.x() && b.low.x() - around <= a.high.x() &&
               a.low.y() - around <= b.high.y() && b.low.y() - around <= a.high.y() &&
               a.low.z() - around <= b.high.z() && b.low.z() - around <= a.high.z();
    };
    const float around = reach + 2 * overhang_; // as in find
    for (const auto& [own, other] : near) {
        std::array<Index, kClusterCells> cells; // that have points near the other cluster
        std::size_t count = 0;
        for (Index c = begin; c < end; ++c)
            if (point_offsets_[c] < point_offsets_[c + 1] && come_near(boxes[c], extents[other], around))
                cells[count++] = c;
        if (count == 0) continue;
        const std::uint64_t far = far_cells(own, other);
        const Index first = clusters_[other].first_cell;
        for (Index j = first; j < clusters_[other + 1].first_cell; ++j) {
            const Vec3f low = boxes[j].low.array() - reach, high = boxes[j].high.array() + reach;
            for (std::size_t k = 0; k < count; ++k) {
                const Index i = cells[k];
                if (!(far >> (i - begin + kClusterCells * (j - first)) & 1)) continue;
                if (!come_near(boxes[i], boxes[j], around)) continue;
                std::vector<Point>& inside = points[i - begin];
                if (inside.empty())
                    for (const Index s : points_of_cells(i, i + 1))
                        inside.push_back(
                            {embedded_point(points_, s, positions), s, std::numeric_limits<float>::infinity()});
                for (Point& point : inside) {
                    const Vec3f& p = point.place;
                    if (!(p.x() >= low.x() && p.x() <= high.x() && p.y() >= low.y() && p.y() <= high.y() &&
                          p.z() >= low.z() && p.z() <= high.z()))
                        continue;
                    const float away = (boxes[j].centre - p).squaredNorm();
                    if (away >= point.least) continue;
                    point.least = away;
                    found[point.number] = cells_[j];
                }
            }
        }
    }
}

std::vector<Index> OwnCells::find(const Vectors& positions, float reach, const RunContext& context) const {
    std::vector<Index> found(points_.size(), kNoIndex);
    if (clusters_.size() < 2) return found;
    const std::vector<Extent> around = extents(positions);
    const auto near = near_clusters(around, reach + 2 * overhang_, // twice: matter that is stretched
                                    std::numeric_limits<double>::infinity());
    const std::vector<CellBox> boxes = cell_boxes(near, positions, context);
    std::vector<std::size_t> starts;
    for (std::size_t k = 0; k < near.size(); ++k)
        if (k == 0 || near[k].first != near[k - 1].first) starts.push_back(k);
    starts.push_back(near.size());
    parallel_for(context, starts.size() - 1, kOwnCellsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            look_into(std::span(near).subspan(starts[k], starts[k + 1] - starts[k]), around, boxes, positions, reach,
                      found);
    });
    return found;
}

std::vector<std::pair<Index, Index>> OwnCells::near_points(const Vectors& places, float far) const {
    std::vector<std::pair<Index, Index>> found;
    if (clusters_.size() < 2 || points_.size() == 0) return found;
    std::vector<Extent> extents(clusters_.size() - 1);
    for (Index k = 0; k < extents.size(); ++k) extents[k] = extent_of(points_of(k), places);
    std::vector<Index> inside;
    for (const auto& [cluster, other] : near_clusters(extents, far, kTangledClusters * double(extents.size()))) {
        if (cluster > other) continue;
        if (found.size() > kTangledPoints * points_.size()) return {};
        const Eigen::Array3f low = extents[other].low.array() - far, high = extents[other].high.array() + far;
        inside.clear();
        for (const Index s : points_of(cluster))
            if ((places[s].array() >= low).all() && (places[s].array() <= high).all()) inside.push_back(s);
        for (const Index s : inside)
            for (const Index t : points_of(other)) {
                if ((cluster == other && t <= s) || (places[t] - places[s]).squaredNorm() >= far * far) continue;
                if (!matter_.are_in_three_steps(matter_.cell_of_point(s), matter_.cell_of_point(t)))
                    found.emplace_back(std::min(s, t), std::max(s, t));
            }
    }
    return found;
}

} // namespace filigree
