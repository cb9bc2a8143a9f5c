#include "filigree/physics/contact/obstacle_surface.h"

#include "filigree/core/math.h"
#include "filigree/mesh/surface.h"
#include "filigree/mesh/triangle_point.h"
#include "filigree/sample/closure.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kWallMargin = 1e-9;      // of the largest coordinate: rounding of doubles is far below it
constexpr std::size_t kFewTriangles = 32; // to try all of them
constexpr double kPieceEdges = 4;         // a long way is looked at in pieces of so many edges
constexpr double kMostWayPieces = 256;
constexpr double kStraight = 0.85;     ///< cosine: faces that bend less at an edge go on
constexpr double kSpike = 0.75;        ///< length of the mean of unit ways along a tip's edges; more is sharp
constexpr int kMostSlides = 8;         // along the walls, one way after the other
constexpr std::size_t kMostPlanes = 6; // that bound one way

/// Half-spaces that a place has to stay in.
class WallPlanes {
public:
    void clear() { count_ = 0; }
    std::size_t size() const { return count_; }
    const Vec3d& normal(std::size_t k) const { return normals_[k]; }
    void add(const Vec3d& normal, double at) {
        normals_[count_] = normal;
        at_[count_++] = at;
    }
    bool is_full() const { return count_ == kMostPlanes; }

    /// Their point closest to `target`: that of one, two or three planes which lies in all. None: they leave no room.
    std::optional<Vec3d> closest(const Vec3d& target, double slack) const {
        std::optional<Vec3d> best;
        double least = std::numeric_limits<double>::infinity();
        const auto take = [&](const Vec3d& point) {
            const double distance = (point - target).squaredNorm();
            if (!(distance < least)) return;
            for (std::size_t k = 0; k < count_; ++k)
                if (!(normals_[k].dot(point) >= at_[k] - slack)) return;
            least = distance;
            best = point;
        };
        take(target);
        for (std::size_t i = 0; i < count_; ++i) {
            take(target + missing(i, target) * normals_[i]);
            for (std::size_t j = 0; j < i; ++j) {
                take_edge(i, j, target, take);
                for (std::size_t k = 0; k < j; ++k) take_corner(i, j, k, target, take);
            }
        }
        return best;
    }

private:
    static constexpr double kParallel = 1e-9; // squared sine

    double missing(std::size_t k, const Vec3d& point) const { return at_[k] - normals_[k].dot(point); }
    template <class Take>
    void take_edge(std::size_t i, std::size_t j, const Vec3d& target, const Take& take) const {
        const double cosine = normals_[i].dot(normals_[j]), squared_sine = 1 - cosine * cosine;
        if (!(squared_sine > kParallel)) return;
        const double a = missing(i, target), b = missing(j, target);
        take(target + ((a - cosine * b) * normals_[i] + (b - cosine * a) * normals_[j]) / squared_sine);
    }
    template <class Take>
    void take_corner(std::size_t i, std::size_t j, std::size_t k, const Vec3d& target, const Take& take) const {
        Mat3d normals;
        normals << normals_[i].transpose(), normals_[j].transpose(), normals_[k].transpose();
        if (!(normals.determinant() * normals.determinant() > kParallel)) return;
        const Vec3d far(missing(i, target), missing(j, target), missing(k, target));
        take(target + normals.inverse() * far);
    }

    std::array<Vec3d, kMostPlanes> normals_;
    std::array<double, kMostPlanes> at_;
    std::size_t count_ = 0;
};

/// The part of a way within a box, or none.
std::optional<std::array<double, 2>> part_within(const Box& box, const Vec3d& from, const Vec3d& way) {
    double begin = 0, end = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = box.min[axis] - from[axis], high = box.max[axis] - from[axis];
        if (way[axis] == 0) {
            if (low > 0 || high < 0) return std::nullopt;
            continue;
        }
        const double a = low / way[axis], b = high / way[axis];
        begin = std::max(begin, std::min(a, b));
        end = std::min(end, std::max(a, b));
    }
    if (!(begin <= end)) return std::nullopt;
    return std::array{begin, end};
}

Box widened(const Box& box, double by) {
    Box wide;
    wide.min = box.min - Vec3d::Constant(by);
    wide.max = box.max + Vec3d::Constant(by);
    return wide;
}

} // namespace

Result<ObstacleSurface> ObstacleSurface::create(const Mesh& mesh, double scale, const RunContext& context) {
    Result<Surface> surface = make_surface(mesh, context);
    if (!surface) return surface.error();
    OutwardReport report;
    const std::vector<FaceTurn> turns = turns_of(*surface, mesh.positions, report);
    const Result<WeldedTriangles> welded = weld_triangles(mesh, context);
    if (!welded) return welded.error();
    ObstacleSurface made;
    made.is_closed_ = !welded->triangles.empty() && welded->closure.is_closed() && welded->closure.is_oriented();
    made.looked_inwards_ = made.is_closed_ && report.inward_parts > 0;
    made.triangles_ = std::move(surface->triangles);
    for (std::size_t t = 0; t < turns.size(); ++t)
        if (turns[t] == FaceTurn::turned) std::swap(made.triangles_[t][1], made.triangles_[t][2]);
    for (const Vec3f& p : mesh.positions) made.positions_.push_back((scale * p.cast<double>()).cast<float>());
    made.prepare();
    if (std::ranges::none_of(made.planes_, [](const Plane& plane) { return std::isfinite(plane.at); }))
        return Error{ErrorCode::unsuitable, "The mesh has no faces with an area, so nothing can touch it."};
    return made;
}

ObstacleSurface::ObstacleSurface(const Cuboid& box) : is_closed_(true) {
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3d side(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
        positions_.push_back((box.centre + side.cwiseProduct(box.size)).cast<float>());
    }
    for (const std::array<Index, 4>& f :
         {std::array<Index, 4>{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}) {
        triangles_.push_back({f[0], f[1], f[2]});
        triangles_.push_back({f[0], f[2], f[3]});
    }
    prepare();
    // A face's plane is that of the box, also where floats round its corners.
    for (std::size_t t = 0; t < planes_.size(); ++t) {
        const int axis = int(t / 4);
        const double sign = t / 2 % 2 == 0 ? -1 : 1;
        planes_[t] = {sign * Vec3d::Unit(axis), sign * box.centre[axis] + 0.5 * box.size[axis]};
    }
}

void ObstacleSurface::prepare() {
    double largest = 0, edges = 0;
    for (const Triangle& triangle : triangles_)
        for (const Index v : triangle) {
            box_.extend(positions_[v].cast<double>());
            largest = std::max(largest, double(positions_[v].cwiseAbs().maxCoeff()));
        }
    margin_ = kWallMargin * largest;
    for (Index t = 0; t < triangles_.size(); ++t) {
        const auto [a, b, c] = corners(t);
        const Vec3d normal = (b - a).cross(c - a), unit = normal.stableNormalized();
        const double nothing = std::numeric_limits<double>::quiet_NaN();
        planes_.push_back({unit, normal.squaredNorm() > 0 ? unit.dot(a) : nothing});
        edges += (b - a).norm() + (c - b).norm() + (a - c).norm();
    }
    edge_ = edges / double(3 * std::max<std::size_t>(1, triangles_.size()));
    find_sharp_edges();
    find_spikes();
    if (triangles_.size() > kFewTriangles) tree_ = std::make_unique<const ClosestPointTree>(positions_, triangles_);
}

/// An edge is not sharp if its faces go on straight beyond it, however many lie on one another.
void ObstacleSurface::find_sharp_edges() {
    struct Side {
        Index low, high, triangle;
        auto operator<=>(const Side&) const = default;
    };
    std::vector<Side> sides;
    for (Index t = 0; t < triangles_.size(); ++t)
        for (std::size_t k = 0; k < 3 && std::isfinite(planes_[t].at); ++k) {
            const Index a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
            sides.push_back({std::min(a, b), std::max(a, b), t});
        }
    std::ranges::sort(sides);
    for (auto first = sides.begin(); first != sides.end();) {
        const auto last = std::find_if(
            first, sides.end(), [&](const Side& side) { return side.low != first->low || side.high != first->high; });
        const Vec3d from = positions_[first->low].cast<double>(), to = positions_[first->high].cast<double>();
        const auto inwards = [&](const Side& side) -> Vec3d { // from the edge into its face
            const std::array<Vec3d, 3> of = corners(side.triangle);
            const Vec3d out = planes_[side.triangle].normal.cross(to - from).normalized();
            return out.dot((of[0] + of[1] + of[2]) / 3 - from) < 0 ? Vec3d(-out) : out;
        };
        const Vec3d along = inwards(*first);
        bool goes_on = false, bends = false;
        for (auto side = first; side != last; ++side) {
            const double cosine = inwards(*side).dot(along);
            goes_on |= cosine < -kStraight;
            bends |= std::abs(cosine) < kStraight;
        }
        if (!goes_on || bends) sharp_edges_.push_back({from, to});
        first = last;
    }
}

/// A spike's tip, whose edges all go to one side.
void ObstacleSurface::find_spikes() {
    std::vector<Vec3d> sums(positions_.size(), Vec3d::Zero());
    std::vector<double> counts(positions_.size(), 0);
    for (const Triangle& triangle : triangles_)
        for (std::size_t k = 0; k < 3; ++k)
            for (const std::size_t other : {(k + 1) % 3, (k + 2) % 3}) {
                const Vec3d way = (positions_[triangle[other]] - positions_[triangle[k]]).cast<double>();
                if (!(way.norm() > 0)) continue;
                sums[triangle[k]] += way.normalized();
                ++counts[triangle[k]];
            }
    for (std::size_t v = 0; v < sums.size(); ++v)
        if (counts[v] > 0 && sums[v].norm() > kSpike * counts[v])
            sharp_edges_.push_back({positions_[v].cast<double>(), positions_[v].cast<double>()});
}

std::array<Vec3d, 3> ObstacleSurface::corners(Index triangle) const {
    const auto& [a, b, c] = triangles_[triangle];
    return {positions_[a].cast<double>(), positions_[b].cast<double>(), positions_[c].cast<double>()};
}

template <class Visit>
void ObstacleSurface::each_near(const Vec3d& point, double radius, const Visit& visit) const {
    if (tree_) return tree_->each_near(point.cast<float>(), radius + 1e-6 * point.cwiseAbs().maxCoeff(), visit);
    for (Index t = 0; t < triangles_.size(); ++t) visit(t);
}

/// Whether a point, moved along the triangle's normal, comes to lie in it; or a quarter of the margin beside it, so
/// that nothing slips through between two, and places that go over an edge do not catch on the wall below it.
bool ObstacleSurface::is_over(Index triangle, const Vec3d& point) const {
    const std::array<Vec3d, 3> of = corners(triangle);
    const Vec3d& normal = planes_[triangle].normal;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d edge = of[(k + 1) % 3] - of[k];
        const double within = normal.cross(edge).dot(point - of[k]);
        if (within < 0 && within * within > 0.0625 * margin_ * margin_ * edge.squaredNorm()) return false;
    }
    return true;
}

/// A wall counts as met already half a margin before it, so that no place lies on one, where its side would be
/// doubtful.
std::optional<WallCrossing> ObstacleSurface::crossing(Index triangle, const Vec3d& from, const Vec3d& to) const {
    const auto& [normal, plane] = planes_[triangle];
    const double side = normal.dot(from) - plane < 0 ? -1 : 1;
    const double begin = side * (normal.dot(from) - plane), end = side * (normal.dot(to) - plane);
    if (!(end < 0.5 * margin_ && end < begin)) return std::nullopt; // also without an area
    const double at = end < 0 ? begin / (begin - end) : 1;
    if (!is_over(triangle, from + at * (to - from))) return std::nullopt;
    return WallCrossing{at, side * normal, side * plane, triangle};
}

std::optional<WallCrossing> ObstacleSurface::first_crossing(const Vec3d& from, const Vec3d& to) const {
    std::optional<WallCrossing> first;
    const Vec3d way = to - from;
    const auto part = part_within(widened(box_, 2 * margin_), from, way);
    if (!part) return first;
    const auto visit = [&](Index triangle) {
        const std::optional<WallCrossing> met = crossing(triangle, from, to);
        if (!met) return;
        if (!first || met->at < first->at || (met->at == first->at && triangle < first->triangle)) first = met;
    };
    const auto [begin, end] = *part;
    const double length = (end - begin) * way.norm();
    const double pieces = tree_ ? std::clamp(std::ceil(length / (kPieceEdges * edge_)), 1.0, kMostWayPieces) : 1;
    for (double piece = 0; piece < pieces; ++piece) {
        const double middle = begin + (end - begin) * (piece + 0.5) / pieces;
        each_near(from + middle * way, 0.5 * length / pieces + 2 * margin_, visit);
        if (first && first->at <= begin + (end - begin) * (piece + 1) / pieces) break;
    }
    return first;
}

WallTouch ObstacleSurface::follow(Vec3d& place, const Vec3d& target) const {
    WallPlanes planes;
    for (int slide = 0; slide < kMostSlides; ++slide) {
        planes.clear();
        Vec3d goal = target;
        Index wall = kNoIndex;
        std::optional<WallCrossing> met;
        while ((met = first_crossing(place, goal)) && !planes.is_full()) {
            wall = met->triangle;
            planes.add(met->normal, met->plane + margin_);
            goal = planes.closest(target, 0.01 * margin_).value_or(place);
            if (goal == place) break;
        }
        if (!met && planes.size() == 0) {
            place = target;
            return {};
        }
        if (met && goal != place) goal = place; // too many at once: it waits where it is
        const double way = (goal - place).norm();
        place = goal;
        if (!(way > margin_) || (planes.size() == 1 && is_over(wall, place))) break;
    }
    const Vec3d back = place - target;
    const double length = back.norm();
    if (planes.size() == 1) {
        const double depth = planes.normal(0).dot(back);
        if (depth > 0.99 * length) return {std::max(0.0, depth - margin_), planes.normal(0)};
    }
    if (!(length > 4 * margin_)) return {std::max(0.0, length - margin_), planes.normal(0)};
    return {length - margin_, back / length};
}

ClosestWall ObstacleSurface::closest(const Vec3d& point, double reach) const {
    ClosestWall found;
    double least = reach;
    const auto take = [&](Index triangle) {
        const ClosestTrianglePoint on = closest_on_triangle(point, corners(triangle));
        const double distance = std::sqrt(on.squared_distance);
        if (distance > least || (distance == least && triangle > found.triangle)) return;
        least = distance;
        found = {triangle, on.position, distance, Vec3d::Zero()};
    };
    if (tree_) {
        const SurfacePoint on = tree_->closest(point.cast<float>(), reach);
        if (on.triangle != kNoIndex) take(on.triangle);
    } else {
        for (Index t = 0; t < triangles_.size(); ++t) take(t);
    }
    if (found.triangle == kNoIndex) return found;
    // Each triangle counts by the angle under which the point sees it: a face by 2 pi, an edge by pi, a corner by its
    // own.
    const double beside = 1e-6 * (edge_ + found.position.cwiseAbs().maxCoeff());
    each_near(found.position, beside, [&](Index triangle) {
        if (!std::isfinite(planes_[triangle].at)) return;
        const std::array<Vec3d, 3> of = corners(triangle);
        if (closest_on_triangle(found.position, of).squared_distance > beside * beside) return;
        double angle = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d a = of[k] - found.position, b = of[(k + 1) % 3] - found.position;
            if (a.norm() > beside && b.norm() > beside) angle += math::atan2(a.cross(b).norm(), a.dot(b));
        }
        found.normal += angle * planes_[triangle].normal;
    });
    found.normal = found.normal.norm() > 0 ? Vec3d(found.normal.normalized()) : planes_[found.triangle].normal;
    if (is_closed_ && found.normal.dot(point - found.position) < 0) found.distance = -found.distance;
    return found;
}

double ObstacleSurface::clearance(const Vec3d& point, double reach) const {
    const Vec3d beyond = (box_.min - point).cwiseMax(point - box_.max).cwiseMax(0);
    if (const double far = beyond.norm(); far >= reach) return reach;
    double least = reach;
    if (tree_) {
        const SurfacePoint on = tree_->closest(point.cast<float>(), reach);
        if (on.triangle == kNoIndex) return reach;
        least = std::min(reach, on.distance);
    } else {
        for (Index t = 0; t < triangles_.size(); ++t)
            least = std::min(least, std::sqrt(closest_on_triangle(point, corners(t)).squared_distance));
    }
    return std::max(0.0, least - 4 * margin_ - 1e-7 * point.cwiseAbs().maxCoeff());
}

Result<MeshObstacle> make_mesh_obstacle(const Mesh& mesh, double scale, double spacing, const RunContext& context,
                                        OutwardReport* outward) {
    Result<DistanceField> field = DistanceField::create(mesh, scale, spacing, context, outward);
    if (!field) return field.error();
    Result<ObstacleSurface> surface = ObstacleSurface::create(mesh, scale, context);
    if (!surface) return surface.error();
    MeshObstacle obstacle;
    obstacle.field = std::make_shared<const DistanceField>(*std::move(field));
    obstacle.surface = std::make_shared<const ObstacleSurface>(*std::move(surface));
    return obstacle;
}

} // namespace filigree
