#include "filigree/physics/contact/own_cells.h"

#include "filigree/core/bits.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/body/embedding.h"
#include "filigree/physics/contact/box_sweep.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace filigree {

namespace {

constexpr std::size_t kOwnCellsGrain = 16, kClusterCells = 8;
constexpr std::size_t kFoldsGrain = 256, kFoldedGrain = 8;
constexpr float kAstray = 0.5f; ///< cells that a place in a deformed cell may be from where its middle's slope says

/// Of bodies whose particles are the corners none: these have theirs.
Embedding points_in_cells(const Body& body) {
    if (body.corners.size() == 0) return {};
    return embed_in_cells(body.surface.points.rest, body.cells, RunContext());
}

} // namespace

OwnCells::Passing::Passing(const Body& body, std::span<const std::uint16_t> group,
                           std::span<const std::array<std::uint16_t, 2>> pairs) {
    groups_ = std::size_t{*std::ranges::max_element(group)} + 1;
    passes_.assign(groups_ * groups_, 0);
    for (const auto& [a, b] : pairs)
        if (a < groups_ && b < groups_) passes_[a * groups_ + b] = passes_[b * groups_ + a] = 1;
    const auto heaviest = [&](const Embedding& in, std::size_t point) { // of the particles that carry it
        Index best = in.offsets[point];
        for (Index k = best; k < in.offsets[point + 1]; ++k)
            if (in.weights[k] > in.weights[best]) best = k;
        return group[in.particles[best]];
    };
    const Embedding &points = body.surface.points, &own_corners = body.corners;
    for (std::size_t s = 0; s < points.size(); ++s) of_point_.push_back(heaviest(points, s));
    std::vector<unsigned> counts(groups_);
    for (const auto& corners : body.cells.cell_corners) {
        std::uint16_t most = 0;
        std::ranges::fill(counts, 0u);
        for (const Index corner : corners) {
            const std::uint16_t of = own_corners.size() == 0 ? group[corner] : heaviest(own_corners, corner);
            ++counts[of];
            if (counts[of] > counts[most] || (counts[of] == counts[most] && of < most)) most = of;
        }
        of_cell_.push_back(most);
    }
}

OwnCells::OwnCells(const Matter& matter)
    : matter_(matter), in_cells_(points_in_cells(matter.body())),
      points_(in_cells_.size() == 0 ? matter.body().surface.points : in_cells_), folded_cells_(matter) {
    const Cells& cells = matter.body().cells;
    std::map<Key, std::vector<Index>> by_key;
    for (Index c = 0; c < cells.cells.size(); ++c)
        by_key[{cells.cells[c][0] / 2, cells.cells[c][1] / 2, cells.cells[c][2] / 2}].push_back(c);
    std::vector<std::vector<Index>> points_of(cells.cells.size());
    const auto spacing = float(cells.spacing);
    for (Index s = 0; s < points_.size(); ++s) {
        if (matter.is_loose(s)) continue; // as far from its cell as may be: everything would be near it
        const Index cell = matter.cell_of_point(s);
        points_of[cell].push_back(s);
        const Vec3f middle = matter.rest_position({cell, Vec3f::Constant(0.5f)});
        overhang_ = std::max(overhang_, (points_.rest[s] - middle).cwiseAbs().maxCoeff() - 0.5f * spacing);
    }
    numbers_.resize(cells.cells.size());
    for (const auto& [at, members] : by_key) {
        clusters_.push_back({at, 0, Index(cells_.size()), Index(corners_.size()), 0});
        std::vector<Index> corners;
        for (const Index cell : members) {
            numbers_[cell] = Index(cells_.size());
            cells_.push_back(cell);
            cell_corners_.push_back(cells.cell_corners[cell]);
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
    const int n = direction(clusters_[cluster].at, clusters_[other].at);
    if (n < 0) return ~std::uint64_t{0};
    const std::uint32_t before = clusters_[cluster].far_near & ((1u << n) - 1);
    return far_cells_[clusters_[cluster].first_far + Index(std::popcount(before))];
}

/// Which of the 3^3 clusters around that at `from` is at `to`; -1: none.
int OwnCells::direction(const Key& from, const Key& to) {
    const auto i = unsigned(to[0] - from[0] + 1), j = unsigned(to[1] - from[1] + 1), k = unsigned(to[2] - from[2] + 1);
    return i > 2 || j > 2 || k > 2 ? -1 : int(i + 3 * j + 9 * k);
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
std::vector<std::pair<Index, Index>> OwnCells::near_clusters(std::span<const Extent> extents, float around) const {
    struct ClusterBall { // and what else decides about two whose boxes are near, side by side in memory
        Vec3f centre;
        float radius;
        Key at;
        Index cluster;
        std::uint32_t far_near;
    };
    std::vector<Index> clusters;
    std::vector<BoxSweep::Bounds> boxes;
    for (Index k = 0; k < extents.size(); ++k) {
        if (extents[k].radius < 0) continue;
        if (!(extents[k].high - extents[k].low).allFinite()) return {}; // the frame is done again
        clusters.push_back(k);
        boxes.push_back({extents[k].low, extents[k].high});
    }
    const BoxSweep sweep(boxes);
    std::vector<ClusterBall> balls;
    balls.reserve(clusters.size());
    for (const Index number : sweep.order()) {
        const Index k = clusters[number];
        balls.push_back({extents[k].centre, extents[k].radius, clusters_[k].at, k, clusters_[k].far_near});
    }
    const auto may_touch = [around](const ClusterBall& one, const ClusterBall& other) {
        if (const int n = direction(one.at, other.at); n >= 0) return (one.far_near >> n & 1) != 0;
        const float far = one.radius + other.radius + around;
        return (one.centre - other.centre).squaredNorm() <= far * far;
    };
    std::vector<std::pair<Index, Index>> near;
    std::vector<Index> offsets(extents.size() + 1, 0);
    std::vector<std::uint16_t> room;
    for (std::size_t a = 0; a < balls.size(); ++a) {
        sweep.each_near(a, around, room, [&](std::size_t b) {
            if (!may_touch(balls[a], balls[b])) return;
            near.emplace_back(balls[a].cluster, balls[b].cluster);
            ++offsets[balls[a].cluster + 1];
            if (a == b) return;
            near.emplace_back(balls[b].cluster, balls[a].cluster);
            ++offsets[balls[b].cluster + 1];
        });
    }
    std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
    std::vector<std::pair<Index, Index>> ascending(near.size());
    std::vector<Index> next(offsets.begin(), offsets.end() - 1);
    for (const auto& pair : near) ascending[next[pair.first]++] = pair;
    for (std::size_t k = 0; k + 1 < offsets.size(); ++k)
        std::sort(ascending.begin() + offsets[k], ascending.begin() + offsets[k + 1]);
    return ascending;
}

/// Of the clusters in `near` alone.
OwnCells::NearBoxes OwnCells::cell_boxes(std::span<const std::pair<Index, Index>> near, const Vectors& positions,
                                         const RunContext& context) const {
    NearBoxes boxes;
    boxes.first.assign(clusters_.size() - 1, kNoIndex);
    std::vector<Index> clusters;
    Index count = 0;
    for (const auto& [cluster, other] : near) { // each of them comes first in some pair
        if (boxes.first[cluster] != kNoIndex) continue;
        clusters.push_back(cluster);
        boxes.first[cluster] = count;
        count += clusters_[cluster + 1].first_cell - clusters_[cluster].first_cell;
    }
    boxes.boxes.resize(count);
    parallel_for(context, clusters.size(), kOwnCellsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            CellBox* box = &boxes.boxes[boxes.first[clusters[k]]];
            for (Index c = clusters_[clusters[k]].first_cell; c < clusters_[clusters[k] + 1].first_cell; ++c)
                *box++ = CellBox(cell_corners_[c], positions);
        }
    });
    return boxes;
}

/// near: a cluster with those whose cells its points might lie in.
void OwnCells::look_into(std::span<const std::pair<Index, Index>> near, std::span<const Extent> extents,
                         const NearBoxes& boxes, const Vectors& positions, float reach, const Passing* passing,
                         std::vector<Index>& found) const {
    const float around = reach + 2 * overhang_; // as in find
    struct Point {
        Vec3f place;
        Index number;
        float least;
    };
    const Index cluster = near[0].first, first = clusters_[cluster].first_cell;
    const Index count = clusters_[cluster + 1].first_cell - first;
    const CellBox* own_boxes = &boxes.boxes[boxes.first[cluster]];
    std::uint64_t has_points = 0; // bits of cells
    for (Index i = 0; i < count; ++i)
        if (!points_of_cells(first + i, first + i + 1).empty()) has_points |= std::uint64_t{1} << i;
    if (has_points == 0) return;
    std::array<std::vector<Point>, kClusterCells> points; // of each cell, once any is asked for
    const auto points_in = [&](Index i) -> std::vector<Point>& {
        if (!points[i].empty()) return points[i];
        const std::span<const Index> numbers = points_of_cells(first + i, first + i + 1);
        for (const Index s : numbers) read_ahead(points_, s);
        for (const Index s : numbers)
            points[i].push_back({embedded_point(points_, s, positions), s, std::numeric_limits<float>::infinity()});
        return points[i];
    };
    for (const auto& [own, other] : near) {
        const std::uint64_t far = far_cells(own, other);
        std::uint64_t of_some = far | far >> 32;
        of_some |= of_some >> 16;
        of_some |= of_some >> 8;
        std::uint64_t asked = 0; // bits of the cells that have points near the other cluster
        for_each_bit(of_some & has_points, [&](int i) {
            if (own_boxes[i].meets(extents[other].low, extents[other].high, around)) asked |= std::uint64_t{1} << i;
        });
        if (asked == 0) continue;
        const Index others = clusters_[other + 1].first_cell - clusters_[other].first_cell;
        for (Index j = 0; j < others; ++j) {
            const CellBox& box = boxes.boxes[boxes.first[other] + j];
            for_each_bit(asked & far >> kClusterCells * j, [&](int bit) {
                const auto i = Index(bit);
                if (!own_boxes[i].meets(box.low, box.high, around)) return;
                for (Point& point : points_in(i)) {
                    if (!box.holds(point.place, reach)) continue;
                    const float away = (box.centre - point.place).squaredNorm();
                    if (away >= point.least) continue;
                    const Index cell = cells_[clusters_[other].first_cell + j];
                    if (passing && passing->holds(point.number, cell)) continue;
                    point.least = away;
                    found[point.number] = cell;
                }
            });
        }
    }
}

/// Of the points of a folded cell. They may lie in any cell that is not far: also under the one that has folded onto
/// theirs.
void OwnCells::add_folds(Index own, std::span<const CellBox> boxes, const Vectors& positions, float reach,
                         Folds& folds) const {
    struct Point {
        Vec3f place;
        Index number, cell = kNoIndex;
        float away = std::numeric_limits<float>::infinity();
    };
    std::vector<Point> points;
    for (const Index s : points_of_cells(numbers_[own], numbers_[own] + 1))
        points.push_back({.place = embedded_point(points_, s, positions), .number = s});
    Vec3f low = points[0].place, high = low;
    for (const Point& point : points) {
        low = low.cwiseMin(point.place);
        high = high.cwiseMax(point.place);
    }
    const float around = reach / float(matter_.body().spacing());
    matter_.each_together(own, [&](Index cell, const Vec3f&) {
        const CellBox& box = boxes[cell];
        if (!box.meets(low, high, reach)) return;
        std::optional<Matter::Linear> linear; // says of most points that they are out of the cell, or where they belong
        for (Point& point : points) {
            const float away = (box.centre - point.place).squaredNorm();
            if (!(away < point.away) || !box.holds(point.place, reach)) continue;
            if (!linear) linear = matter_.linear(positions, cell);
            Matter::Place place{cell, linear->local(point.place)};
            if (!((place.local.array() - 0.5f).abs().maxCoeff() < 0.5f + around + kAstray)) continue;
            if (!matter_.is_elsewhere(point.number, place, Matter::kStillElsewhere)) continue;
            if (!matter_.locate_in_cell(positions, point.place, place, around)) continue;
            if (!matter_.is_elsewhere(point.number, place, Matter::kStillElsewhere)) continue;
            point.cell = cell;
            point.away = away;
        }
    });
    for (const Point& point : points)
        if (point.cell != kNoIndex) folds.emplace_back(point.number, point.cell);
}

OwnCells::Folds OwnCells::folds(const Vectors& positions, float reach, const RunContext& context) const {
    const std::vector<Index> folded = folded_cells_.find(positions, context);
    if (folded.empty()) return {};
    std::vector<CellBox> boxes(cells_.size());
    std::vector<std::uint8_t> is_asked(boxes.size(), 0);
    for (const Index own : folded) matter_.each_together(own, [&](Index cell, const Vec3f&) { is_asked[cell] = 1; });
    parallel_for(context, boxes.size(), kFoldsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c)
            if (is_asked[c]) boxes[c] = CellBox(matter_.corners(Index(c)), positions);
    });
    std::vector<Folds> parts((folded.size() + kFoldedGrain - 1) / kFoldedGrain);
    parallel_for(context, parts.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t part = begin; part < end; ++part)
            for (std::size_t k = part * kFoldedGrain; k < std::min(folded.size(), (part + 1) * kFoldedGrain); ++k)
                add_folds(folded[k], boxes, positions, reach, parts[part]);
    });
    Folds folds;
    for (const Folds& part : parts) folds.insert(folds.end(), part.begin(), part.end());
    return folds;
}

std::vector<std::pair<Index, Index>> OwnCells::near_of_find(std::span<const Extent> extents, float reach) const {
    return near_clusters(extents, reach + 2 * overhang_); // twice: matter that is stretched
}

std::size_t OwnCells::candidates(const Vectors& positions, float reach) const {
    return clusters_.size() < 2 ? 0 : near_of_find(extents(positions), reach).size();
}

std::vector<Index> OwnCells::find(const Vectors& positions, const Folds& folds, float reach, const Passing* passing,
                                  const RunContext& context) const {
    std::vector<Index> found(points_.size(), kNoIndex);
    if (clusters_.size() < 2) return found;
    const std::vector<Extent> around = extents(positions);
    const auto near = near_of_find(around, reach);
    const NearBoxes boxes = cell_boxes(near, positions, context);
    std::vector<std::size_t> starts;
    for (std::size_t k = 0; k < near.size(); ++k)
        if (k == 0 || near[k].first != near[k - 1].first) starts.push_back(k);
    starts.push_back(near.size());
    parallel_for(context, starts.size() - 1, kOwnCellsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            look_into(std::span(near).subspan(starts[k], starts[k + 1] - starts[k]), around, boxes, positions, reach,
                      passing, found);
    });
    for (const auto& [s, cell] : folds) {
        if (passing && passing->holds(s, cell)) continue;
        const auto away = [&, p = embedded_point(points_, s, positions)](Index held_by) {
            return (CellBox(matter_.corners(held_by), positions).centre - p).squaredNorm();
        };
        if (found[s] == kNoIndex || away(cell) < away(found[s])) found[s] = cell;
    }
    return found;
}

} // namespace filigree
