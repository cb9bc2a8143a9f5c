// Rays along x from points just behind faces, all of them in one pass over the triangles: the points lie in a grid of
// buckets over y and z, and each triangle asks the buckets that it covers.
#include "filigree/sample/nesting.h"

#include "filigree/core/lists.h"
#include "filigree/sample/exact_sign.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kMostPlaces = 16, kPlacesInAll = std::size_t{1} << 18; // of a part; about
constexpr std::size_t kComparedParts = 512; // up to so many, boxes are compared with each other first
constexpr double kBehind = 1e-4;            // of the root of a triangle's area: how far behind it a point lies
constexpr double kNestingRounding = 1e-6;   // of the coordinates: at least so far

struct Place {
    Vec3d point;
    Index part;
};

bool holds(const Box& outer, const Box& inner) {
    return (outer.min.array() <= inner.min.array()).all() && (outer.max.array() >= inner.max.array()).all();
}

/// Buckets over y and z.
class PlaceGrid {
public:
    explicit PlaceGrid(std::vector<Place> places) : places_(std::move(places)) {
        for (const Place& place : places_) box_.extend(place.point);
        side_ = std::clamp<std::size_t>(std::size_t(std::sqrt(double(places_.size()))), 1, 1024);
        buckets_ = make_lists<Index>(side_ * side_, [&](const auto& add) {
            for (Index i = 0; i < places_.size(); ++i)
                add(row(places_[i].point, 2) * side_ + row(places_[i].point, 1), i);
        });
    }

    std::size_t size() const { return places_.size(); }
    const Place& operator[](std::size_t i) const { return places_[i]; }

    /// Calls visit(place's number) for places whose ray along x may meet something in a box.
    template <class Visit>
    void visit_before(const Box& box, const Visit& visit) const {
        for (int axis = 0; axis < 3; ++axis)
            if (box.max[axis] < box_.min[axis] || (axis > 0 && box.min[axis] > box_.max[axis])) return;
        for (std::size_t z = row(box.min, 2); z <= row(box.max, 2); ++z)
            for (std::size_t b = z * side_ + row(box.min, 1); b <= z * side_ + row(box.max, 1); ++b)
                for (const Index i : buckets_[b]) {
                    const Vec3d& p = places_[i].point;
                    if (p[0] <= box.max[0] && p[1] >= box.min[1] && p[1] <= box.max[1] && p[2] >= box.min[2] &&
                        p[2] <= box.max[2])
                        visit(i);
                }
    }

private:
    std::size_t row(const Vec3d& point, int axis) const {
        const double size = box_.max[axis] - box_.min[axis];
        const double at = size > 0 ? (point[axis] - box_.min[axis]) / size * double(side_) : 0;
        return std::size_t(std::clamp(at, 0.0, double(side_ - 1)));
    }

    std::vector<Place> places_;
    Box box_;
    std::size_t side_ = 1;
    IndexLists buckets_;
};

std::array<Vec3d, 3> corners_of(const Triangle& t, std::span<const Vec3f> positions) {
    return {positions[t[0]].cast<double>(), positions[t[1]].cast<double>(), positions[t[2]].cast<double>()};
}

Box box_of(const std::array<Vec3d, 3>& corners) {
    Box box;
    for (const Vec3d& corner : corners) box.extend(corner);
    return box;
}

/// Which parts may lie in another, by their boxes.
std::vector<std::uint8_t> may_be_inside(const std::vector<Box>& boxes) {
    std::vector<std::uint8_t> may(boxes.size(), boxes.size() > kComparedParts);
    if (boxes.size() <= kComparedParts)
        for (std::size_t a = 0; a < boxes.size(); ++a)
            for (std::size_t b = 0; b < boxes.size() && !may[a]; ++b)
                may[a] = a != b && !boxes[a].empty() && !boxes[b].empty() && holds(boxes[b], boxes[a]);
    return may;
}

std::vector<Place> places_behind_faces(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                       std::span<const Index> part, const std::vector<Box>& boxes,
                                       const std::vector<std::uint8_t>& may,
                                       std::span<const std::uint8_t> looks_inwards) {
    std::vector<std::size_t> left(boxes.size(), 0), seen(boxes.size(), 0); // triangles of each part
    for (const Index p : part)
        if (p != kNoIndex) ++left[p];
    const std::size_t asked = std::size_t(std::ranges::count(may, 1));
    const std::size_t most = std::clamp<std::size_t>(kPlacesInAll / std::max<std::size_t>(asked, 1), 1, kMostPlaces);
    std::vector<Place> places;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const Index p = part[t];
        if (p == kNoIndex || !may[p]) continue;
        const std::size_t stride = std::max<std::size_t>(1, left[p] / most);
        if (seen[p]++ % stride != 0) continue;
        const auto [a, b, c] = corners_of(triangles[t], positions);
        const Vec3d normal = (b - a).cross(c - a);
        const double area = normal.norm();
        if (!(area > 0)) {
            --seen[p]; // the next one instead
            continue;
        }
        const double largest = std::max(boxes[p].min.cwiseAbs().maxCoeff(), boxes[p].max.cwiseAbs().maxCoeff());
        const double behind = std::max(kBehind * std::sqrt(area), kNestingRounding * largest);
        const double way = (!looks_inwards.empty() && looks_inwards[p] ? behind : -behind) / area;
        places.push_back({(a + b + c) / 3 + way * normal, p});
    }
    return places;
}

} // namespace

std::vector<Index> nesting_depths(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                  std::span<const Index> part, std::size_t part_count,
                                  std::span<const std::uint8_t> looks_inwards) {
    std::vector<Index> depths(part_count, 0);
    if (part_count < 2) return depths;
    std::vector<Box> boxes(part_count);
    for (std::size_t t = 0; t < triangles.size(); ++t)
        if (part[t] != kNoIndex)
            for (const Vec3d& corner : corners_of(triangles[t], positions)) boxes[part[t]].extend(corner);
    const std::vector<std::uint8_t> may = may_be_inside(boxes);
    if (std::ranges::find(may, 1) == may.end()) return depths;
    const PlaceGrid grid(places_behind_faces(positions, triangles, part, boxes, may, looks_inwards));

    std::vector<std::array<Index, 3>> crossings; // the place's part, the part crossed, the place
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const Index other = part[t];
        if (other == kNoIndex) continue;
        const std::array<Vec3d, 3> p = corners_of(triangles[t], positions);
        grid.visit_before(box_of(p), [&](Index i) {
            const Place& place = grid[i];
            if (place.part != other && holds(boxes[other], boxes[place.part]) &&
                exact::crosses_along_x(p[0], p[1], p[2], place.point) != 0)
                crossings.push_back({place.part, other, i});
        });
    }
    std::ranges::sort(crossings);
    std::vector<std::size_t> places_of(part_count, 0);
    for (std::size_t i = 0; i < grid.size(); ++i) ++places_of[grid[i].part];
    for (std::size_t begin = 0; begin < crossings.size();) {
        std::size_t inside = 0, end = begin; // places of one part in one other
        while (end < crossings.size() && crossings[end][0] == crossings[begin][0] &&
               crossings[end][1] == crossings[begin][1]) {
            std::size_t same = end;
            while (same < crossings.size() && crossings[same] == crossings[end]) ++same;
            inside += (same - end) % 2;
            end = same;
        }
        depths[crossings[begin][0]] += inside == places_of[crossings[begin][0]];
        begin = end;
    }
    return depths;
}

} // namespace filigree
