// Based on: [Lee 1998] (MAPS: a parametrisation kept through vertex removals). Where we differ: half-edge collapses,
// flips, relocations and splits all make one kind of record, and feature curves are straight lines in every one of
// them.
#include "filigree/remesh/surface_map.h"

#include "filigree/core/math.h"
#include "filigree/remesh/manifold_surface.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace filigree {

namespace {

constexpr double kSmallestAngle = 1e-3;                   // radians; needles get at least so much of the turn
constexpr double kLargestAngle = 0.92 * std::numbers::pi; // no triangle takes half a turn
constexpr double kSmallestRadius = 1e-3;                  // of the largest in a star
constexpr double kSmallestHeight = 1e-3;                  // of an edge's length, when it is unfolded

/// Of the triangle of the origin, a and b.
double doubled_area(const Vec2f& a, const Vec2f& b) { return double(a.x()) * b.y() - double(a.y()) * b.x(); }
double doubled_area(const Vec2f& a, const Vec2f& b, const Vec2f& c) { return doubled_area(b - a, c - a); }

/// Scales the angles to a sum of `turn`; none may reach half a turn.
void scale_angles(std::span<double> angles, double turn) {
    double sum = 0;
    for (double& a : angles) sum += a = std::max(a, kSmallestAngle);
    for (double& a : angles) a *= turn / sum;
    const auto largest = std::max_element(angles.begin(), angles.end());
    if (*largest <= kLargestAngle) return;
    const double rest = turn - *largest;
    for (double& a : angles)
        if (&a != &*largest) a *= (turn - kLargestAngle) / rest;
    *largest = kLargestAngle;
    // three triangles, two of them needles: the second largest may be too large now
    for (double& a : angles)
        if (a > kLargestAngle) {
            for (double& b : angles) b = turn / double(angles.size());
            return;
        }
}

} // namespace

SurfaceMap::SurfaceMap(const ManifoldSurface& surface, std::span<const Index> twins,
                       std::span<const std::uint8_t> feature, std::span<const std::uint8_t> corner)
    : surface_(surface), positions_(surface.positions), triangles_(surface.triangles),
      twin_(twins.begin(), twins.end()), feature_(feature.begin(), feature.end()),
      triangle_count_(surface.triangles.size()) {
    face_.resize(triangles_.size());
    covered_.resize(triangles_.size());
    out_.assign(positions_.size(), kNoIndex);
    valence_.assign(positions_.size(), 0);
    kind_.assign(positions_.size(), VertexKind::inside);
    on_border_.assign(positions_.size(), 0);
    std::vector<std::uint8_t> curve_edges(positions_.size(), 0);
    const auto count = [&](Index v) { curve_edges[v] = static_cast<std::uint8_t>(std::min(curve_edges[v] + 1, 3)); };
    for (Index s = 0; s < triangles_.size(); ++s) {
        face_[s] = s;
        covered_[s] = area(s);
        for (Index h = 3 * s; h < 3 * s + 3; ++h) {
            if (is_border(h)) {
                feature_[h] = 1;
                on_border_[from(h)] = on_border_[to(h)] = 1;
            }
            ++valence_[from(h)];
            if (out_[from(h)] == kNoIndex || is_border(h)) out_[from(h)] = h;
            if (is_feature(h)) {
                count(from(h));
                if (is_border(h)) count(to(h)); // a feature inside counts from both its half-edges
            }
        }
    }
    for (Index v = 0; v < positions_.size(); ++v)
        if (curve_edges[v] != 0) kind_[v] = curve_edges[v] == 2 && !corner[v] ? VertexKind::curve : VertexKind::corner;
}

Vec3d SurfaceMap::normal(Index slot) const {
    const Triangle& t = triangles_[slot];
    return (positions_[t[1]] - positions_[t[0]]).cross(positions_[t[2]] - positions_[t[0]]);
}

double SurfaceMap::area(Index slot) const { return 0.5 * normal(slot).norm(); }

bool SurfaceMap::are_neighbours(Index a, Index b) const {
    if (valence_[b] < valence_[a]) std::swap(a, b);
    Index h = out_[a];
    do {
        if (to(h) == b) return true;
        const Index p = previous_half_edge(h);
        if (is_border(p)) return from(p) == b;
        h = twin_[p];
    } while (h != out_[a]);
    return false;
}

std::size_t SurfaceMap::sector_size(Index half_edge) const {
    if (kind_[from(half_edge)] == VertexKind::inside) return valence_[from(half_edge)];
    std::size_t size = 1;
    Index h = half_edge;
    while (!is_feature(previous_half_edge(h)) && size < kMostCounted) { // counter-clockwise
        h = twin_[previous_half_edge(h)];
        if (h == half_edge) return size;
        ++size;
    }
    h = half_edge;
    while (!is_feature(h) && size < kMostCounted) {
        h = next_half_edge(twin_[h]);
        ++size;
    }
    return size;
}

double SurfaceMap::corner_angle(Index half_edge) const {
    const Vec3d& p = positions_[from(half_edge)];
    const Vec3d a = positions_[to(half_edge)] - p, b = positions_[from(previous_half_edge(half_edge))] - p;
    return math::atan2(a.cross(b).norm(), a.dot(b));
}

double SurfaceMap::sector_angle(Index half_edge) const {
    Index h = half_edge;
    while (!is_feature(h)) h = next_half_edge(twin_[h]);
    double angle = corner_angle(h);
    while (!is_feature(previous_half_edge(h))) {
        h = twin_[previous_half_edge(h)];
        angle += corner_angle(h);
    }
    return angle;
}

void SurfaceMap::star(Index vertex, Star& star) const {
    star.centre = vertex;
    star.open = false;
    star.half_edges.clear();
    star.ring.clear();
    star.flat.clear();
    std::array<std::size_t, 2> curve = {0, 0};
    std::size_t curves = 0;
    const Index first = out_[vertex];
    Index h = first;
    do {
        if (is_feature(h) && curves < 2) curve[curves++] = star.ring.size();
        star.half_edges.push_back(h);
        star.ring.push_back(to(h));
        const Index p = previous_half_edge(h);
        if (is_border(p)) {
            star.open = true;
            if (curves < 2) curve[curves++] = star.ring.size();
            star.ring.push_back(from(p));
            break;
        }
        h = twin_[p];
    } while (h != first);
    star.curve_a = curve[0];
    star.curve_b = curve[1];
}

bool SurfaceMap::flatten(Star& star) const {
    const std::size_t n = star.triangle_count(), ring = star.ring.size();
    const Vec3d& centre = positions_[star.centre];
    thread_local std::vector<double> angles, radii;
    thread_local std::vector<Vec3d> arms;
    angles.resize(n);
    radii.resize(ring);
    arms.resize(ring);
    double longest = 0;
    for (std::size_t i = 0; i < ring; ++i) {
        arms[i] = positions_[star.ring[i]] - centre;
        longest = std::max(longest, radii[i] = arms[i].norm());
    }
    if (!(longest > 0)) longest = 1;
    for (double& r : radii) r = std::max(r / longest, kSmallestRadius);
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3d &a = arms[i], &b = arms[star.next(i)];
        angles[i] = math::atan2(a.cross(b).norm(), a.dot(b));
    }
    star.flat.resize(ring);
    const auto place = [&](std::size_t i, double angle) {
        star.flat[i] = Vec2d(radii[i] * math::cos(angle), radii[i] * math::sin(angle)).cast<float>();
    };
    constexpr double pi = std::numbers::pi;
    if (kind_[star.centre] == VertexKind::inside) {
        scale_angles(angles, 2 * pi);
        double angle = 0;
        for (std::size_t i = 0; i < n; ++i) {
            place(i, angle);
            angle += angles[i];
        }
        return true;
    }
    // A curve: half a turn on each side. Triangles curve_a .. curve_b - 1 lie above it, the others below.
    const std::size_t above = star.curve_b - star.curve_a, below = n - above;
    if (above < 2 || (!star.open && below < 2)) return false;
    std::rotate(angles.begin(), angles.begin() + std::ptrdiff_t(star.curve_a), angles.end());
    scale_angles(std::span(angles).first(above), pi);
    if (below > 0) scale_angles(std::span(angles).subspan(above), pi);
    double angle = 0;
    for (std::size_t k = 0; k < n + (star.open ? 1 : 0); ++k) {
        const std::size_t i = (star.curve_a + k) % ring;
        if (k == above) angle = pi;
        place(i, angle);
        if (k < n) angle += angles[k];
    }
    star.flat[star.curve_a].y() = 0;
    star.flat[star.curve_b].y() = 0;
    return true;
}

void SurfaceMap::begin_record(std::size_t points) {
    records_.push_back({static_cast<std::uint32_t>(points_.size()), static_cast<std::uint32_t>(old_faces_.size()), 0});
    points_.resize(points_.size() + points);
}

void SurfaceMap::add_old(Index slot, std::array<std::uint8_t, 3> local) {
    old_faces_.push_back({face_[slot], local});
    ++records_.back().old_count;
}

void SurfaceMap::add_new(Index slot, std::array<std::uint8_t, 3> local) {
    face_[slot] = static_cast<Index>(surface_.triangles.size() + new_faces_.size());
    new_faces_.push_back({static_cast<std::uint32_t>(records_.size() - 1), local});
}

/// Corners of triangle i of the star as points of its record: the ring, then the centre; in the slot's own order.
std::array<std::uint8_t, 3> SurfaceMap::star_corners(const Star& star, std::size_t i) const {
    const Index h = star.half_edges[i];
    std::array<std::uint8_t, 3> local;
    local[h % 3] = static_cast<std::uint8_t>(star.ring.size());
    local[next_half_edge(h) % 3] = static_cast<std::uint8_t>(i);
    local[previous_half_edge(h) % 3] = static_cast<std::uint8_t>(star.next(i));
    return local;
}

/// Corners of the triangle as points of a record: their places in `points`, else the one after those.
std::array<std::uint8_t, 3> SurfaceMap::corners_among(const std::array<Index, 4>& points, Index slot) const {
    std::array<std::uint8_t, 3> local;
    for (std::size_t k = 0; k < 3; ++k)
        local[k] = static_cast<std::uint8_t>(std::ranges::find(points, triangles_[slot][k]) - points.begin());
    return local;
}

/// The star as it is, centre at zero. One more point is free: the last.
void SurfaceMap::record_star(const Star& star) {
    begin_record(star.ring.size() + 2);
    const std::size_t first = records_.back().points;
    std::copy(star.flat.begin(), star.flat.end(), points_.begin() + std::ptrdiff_t(first));
    points_[first + star.ring.size()] = Vec2f::Zero();
    for (std::size_t i = 0; i < star.triangle_count(); ++i) add_old(star.half_edges[i] / 3, star_corners(star, i));
}

void SurfaceMap::link(Index a, Index b, bool feature) {
    if (a != kNoIndex) {
        twin_[a] = b;
        feature_[a] = feature || b == kNoIndex;
    }
    if (b != kNoIndex) {
        twin_[b] = a;
        feature_[b] = feature || a == kNoIndex;
    }
}

void SurfaceMap::hand_on_area(std::span<const Index> slots, std::span<const double> planar_areas, double total) {
    double sum = 0;
    for (const double a : planar_areas) sum += a;
    for (std::size_t i = 0; i < slots.size(); ++i) covered_[slots[i]] = total * planar_areas[i] / sum;
}

void SurfaceMap::collapse(const Star& star, std::size_t target) {
    const Index u = star.centre, v = star.ring[target];
    record_star(star);
    const std::size_t points = records_.back().points;
    double covered = 0;
    for (const Index h : star.half_edges) covered += covered_[h / 3];
    thread_local std::vector<Index> slots;
    thread_local std::vector<double> areas;
    slots.clear();
    areas.clear();
    std::array<Index, 2> gone = {kNoIndex, kNoIndex};
    for (std::size_t i = 0; i < star.triangle_count(); ++i) {
        const Index h = star.half_edges[i], slot = h / 3;
        if (i == target || star.next(i) == target) {
            gone[gone[0] == kNoIndex ? 0 : 1] = slot;
            continue;
        }
        std::array<std::uint8_t, 3> local = star_corners(star, i);
        local[h % 3] = static_cast<std::uint8_t>(target);
        add_new(slot, local);
        slots.push_back(slot);
        areas.push_back(
            doubled_area(points_[points + local[0]], points_[points + local[1]], points_[points + local[2]]));
        triangles_[slot][h % 3] = v;
    }
    hand_on_area(slots, areas, covered);

    Index start = kNoIndex;
    for (const Index slot : gone) {
        if (slot == kNoIndex) continue;
        // the triangle's two sides other than u v become one edge
        Index at_u = kNoIndex, at_v = kNoIndex, apex = kNoIndex;
        for (Index h = 3 * slot; h < 3 * slot + 3; ++h) {
            const Index a = from(h), b = to(h);
            if ((a == u && b == v) || (a == v && b == u)) continue;
            (a == u || b == u ? at_u : at_v) = h;
            apex = a == u || a == v ? b : a;
        }
        const bool feature = (is_feature(at_u) && !is_border(at_u)) || (is_feature(at_v) && !is_border(at_v));
        const Index outer_u = twin_[at_u], outer_v = twin_[at_v];
        link(outer_u, outer_v, feature);
        --valence_[apex];
        // half-edges that leave the apex and v along the edge that is left; kept only where theirs has gone
        for (const Index outer : {outer_u, outer_v}) {
            if (outer == kNoIndex) continue;
            for (const Index leaving : {outer, next_half_edge(outer)}) {
                const Index vertex = from(leaving);
                if (vertex == apex && out_[apex] / 3 == slot) out_[apex] = leaving;
                if (vertex == v) start = leaving;
            }
        }
        triangles_[slot] = {kNoIndex, kNoIndex, kNoIndex};
        --triangle_count_;
    }
    const Index sides = static_cast<Index>(gone[1] != kNoIndex) + 1;
    valence_[v] += valence_[u] - 2 * sides;
    if (is_removed(out_[v] / 3) || from(out_[v]) != v) out_[v] = start;
    out_[u] = kNoIndex;
    valence_[u] = 0;
    // on borders the first, counter-clockwise: clockwise until there is no further
    const auto to_border = [&](Index vertex) {
        if (!on_border_[vertex]) return;
        while (!is_border(out_[vertex])) out_[vertex] = next_half_edge(twin_[out_[vertex]]);
    };
    to_border(v);
    const std::size_t n = star.ring.size();
    if (!star.open || target + 1 < n) to_border(star.ring[star.next(target)]);
    if (!star.open || target > 0) to_border(star.ring[target > 0 ? target - 1 : n - 1]);
}

TrianglePoint SurfaceMap::locate(const Star& star, const Vec2f& place) const {
    double best = -std::numeric_limits<double>::infinity();
    TrianglePoint found;
    for (std::size_t i = 0; i < star.triangle_count(); ++i) {
        const Vec2f &a = star.flat[i], &b = star.flat[star.next(i)];
        const double whole = doubled_area(a, b), at_a = doubled_area(place, b), at_b = doubled_area(a, place);
        const Vec3d weights = Vec3d(whole - at_a - at_b, at_a, at_b) / whole;
        if (weights.minCoeff() <= best) continue;
        best = weights.minCoeff();
        const Index h = star.half_edges[i];
        found.triangle = h / 3;
        found.barycentric[h % 3] = weights[0];
        found.barycentric[next_half_edge(h) % 3] = weights[1];
        found.barycentric[previous_half_edge(h) % 3] = weights[2];
    }
    found.barycentric = found.barycentric.cwiseMax(0.0);
    found.barycentric /= found.barycentric.sum();
    return trace(found);
}

void SurfaceMap::relocate(const Star& star, const Vec2f& place) {
    const Vec3d moved = original_position(locate(star, place));
    record_star(star);
    const std::size_t points = records_.back().points, centre = star.ring.size();
    points_[points + centre + 1] = place;
    double covered = 0;
    thread_local std::vector<Index> slots;
    thread_local std::vector<double> areas;
    slots.clear();
    areas.clear();
    for (std::size_t i = 0; i < star.triangle_count(); ++i) {
        const Index slot = star.half_edges[i] / 3;
        covered += covered_[slot];
        std::array<std::uint8_t, 3> local = star_corners(star, i);
        local[star.half_edges[i] % 3] = static_cast<std::uint8_t>(centre + 1);
        add_new(slot, local);
        slots.push_back(slot);
        areas.push_back(doubled_area(place, star.flat[i], star.flat[star.next(i)]));
    }
    hand_on_area(slots, areas, covered);
    positions_[star.centre] = moved;
}

SurfaceMap::Unfolded SurfaceMap::unfold(Index half_edge) const {
    const Vec3d& origin = positions_[from(half_edge)];
    Vec3d along = positions_[to(half_edge)] - origin;
    double length = along.norm();
    if (!(length > 0)) {
        along = Vec3d::UnitX();
        length = 1;
    }
    const Vec3d direction = along / length;
    const auto place = [&](Index half, double sign) {
        const Vec3d arm = positions_[from(previous_half_edge(half))] - origin;
        const double x = arm.dot(direction);
        const double y = std::max((arm - x * direction).norm(), kSmallestHeight * length);
        return Vec2d(x / length, sign * y / length).cast<float>().eval();
    };
    return {Vec2f(1, 0), place(half_edge, 1),
            is_border(half_edge) ? Vec2f::Zero().eval() : place(twin_[half_edge], -1)};
}

void SurfaceMap::flip(Index half_edge) {
    const Index other = twin_[half_edge], s = half_edge / 3, t = other / 3;
    const Index a = from(half_edge), b = to(half_edge), c = from(previous_half_edge(half_edge)),
                d = from(previous_half_edge(other));
    const Unfolded flat = unfold(half_edge);
    begin_record(4);
    const std::size_t points = records_.back().points;
    points_[points] = Vec2f::Zero();
    points_[points + 1] = flat.to;
    points_[points + 2] = flat.above;
    points_[points + 3] = flat.below;
    const auto corners = [&](Index slot) { return corners_among({a, b, c, d}, slot); };
    add_old(s, corners(s));
    add_old(t, corners(t));
    const double covered = covered_[s] + covered_[t];
    const Index bc = twin_[next_half_edge(half_edge)], ca = twin_[previous_half_edge(half_edge)];
    const Index ad = twin_[next_half_edge(other)], db = twin_[previous_half_edge(other)];
    const bool bc_feature = feature_[next_half_edge(half_edge)], ca_feature = feature_[previous_half_edge(half_edge)];
    const bool ad_feature = feature_[next_half_edge(other)], db_feature = feature_[previous_half_edge(other)];
    triangles_[s] = {c, a, d};
    triangles_[t] = {d, b, c};
    link(3 * s, ca, ca_feature);
    link(3 * s + 1, ad, ad_feature);
    link(3 * t, db, db_feature);
    link(3 * t + 1, bc, bc_feature);
    link(3 * s + 2, 3 * t + 2, false);
    add_new(s, corners(s));
    add_new(t, corners(t));
    const std::array<Index, 2> slots = {s, t};
    const std::array<double, 2> areas = {std::abs(doubled_area(flat.above, Vec2f::Zero(), flat.below)),
                                         std::abs(doubled_area(flat.below, flat.to, flat.above))};
    hand_on_area(slots, areas, covered);
    --valence_[a];
    --valence_[b];
    ++valence_[c];
    ++valence_[d];
    // half-edges out of each, the first on a border
    const auto leave = [&](Index vertex, Index candidate) {
        const Index old = out_[vertex];
        if (from(old) == vertex && old / 3 != s && old / 3 != t) return; // untouched, and first already
        out_[vertex] = candidate;
        if (!on_border_[vertex]) return;
        while (!is_border(out_[vertex])) out_[vertex] = next_half_edge(twin_[out_[vertex]]);
    };
    leave(a, 3 * s + 1);
    leave(b, 3 * t + 1);
    leave(c, 3 * s);
    leave(d, 3 * t);
}

Index SurfaceMap::split(Index half_edge, double share) {
    const Index other = twin_[half_edge];
    const Index a = from(half_edge), b = to(half_edge), c = from(previous_half_edge(half_edge));
    const Index d = other == kNoIndex ? kNoIndex : from(previous_half_edge(other));
    const bool feature = is_feature(half_edge);
    const Unfolded flat = unfold(half_edge);
    const Index m = static_cast<Index>(positions_.size());
    TrianglePoint middle{half_edge / 3, Vec3d::Zero()};
    middle.barycentric[half_edge % 3] = 1 - share;
    middle.barycentric[next_half_edge(half_edge) % 3] = share;
    positions_.push_back(original_position(trace(middle)));
    kind_.push_back(feature ? VertexKind::curve : VertexKind::inside);
    on_border_.push_back(other == kNoIndex);
    out_.push_back(kNoIndex);
    valence_.push_back(other == kNoIndex ? 2 : 4);

    begin_record(5);
    const std::size_t points = records_.back().points;
    points_[points] = Vec2f::Zero();
    points_[points + 1] = flat.to;
    points_[points + 2] = flat.above;
    points_[points + 3] = flat.below;
    points_[points + 4] = static_cast<float>(share) * flat.to;
    const auto corners = [&](Index slot) { return corners_among({a, b, c, d}, slot); };
    add_old(half_edge / 3, corners(half_edge / 3));
    if (other != kNoIndex) add_old(other / 3, corners(other / 3));

    // Each old triangle (x, y, apex) becomes (x, m, apex) in its slot and (m, y, apex) in a new one.
    const auto halve = [&](Index h, double first_share) {
        const Index slot = h / 3, y = to(h), apex = from(previous_half_edge(h)), far = next_half_edge(h);
        const Index fresh = static_cast<Index>(triangles_.size());
        const Index far_twin = twin_[far];
        const bool far_feature = feature_[far];
        triangles_.push_back({m, y, apex});
        twin_.insert(twin_.end(), 3, kNoIndex);
        feature_.insert(feature_.end(), 3, 0);
        face_.push_back(kNoIndex);
        covered_.push_back(covered_[slot] * (1 - first_share));
        covered_[slot] *= first_share;
        triangles_[slot][next_half_edge(h) % 3] = m;
        link(3 * fresh + 1, far_twin, far_feature);
        link(far, 3 * fresh + 2, false);
        ++valence_[apex];
        ++triangle_count_;
        if (out_[y] / 3 == slot) out_[y] = 3 * fresh + 1; // its half-edge has moved
        add_new(slot, corners(slot));
        add_new(fresh, corners(fresh));
        return 3 * fresh; // m to y
    };
    const Index first = half_edge;                // now a to m
    const Index second = halve(half_edge, share); // m to b
    if (other == kNoIndex) {
        link(first, kNoIndex, true);
        link(second, kNoIndex, true);
        out_[m] = second;
    } else {
        const Index back = halve(other, 1 - share); // m to a; `other` is now b to m
        link(first, back, feature);
        link(second, other, feature);
        out_[m] = second;
    }
    return m;
}

TrianglePoint SurfaceMap::trace(const TrianglePoint& point) const {
    Index face = face_[point.triangle];
    Vec3d b = point.barycentric;
    const Index originals = static_cast<Index>(surface_.triangles.size());
    while (face >= originals) {
        const NewFace& now = new_faces_[face - originals];
        const Record& record = records_[now.record];
        const Vec2f* points = &points_[record.points];
        const Vec2d p = b[0] * points[now.local[0]].cast<double>() + b[1] * points[now.local[1]].cast<double>() +
                        b[2] * points[now.local[2]].cast<double>();
        double best = -std::numeric_limits<double>::infinity();
        face = old_faces_[record.old_faces].face; // if no number means anything, at least this ends
        b.setConstant(1.0 / 3);
        for (std::size_t i = 0; i < record.old_count && best < 0; ++i) {
            const OldFace& old = old_faces_[record.old_faces + i];
            const Vec2d x = points[old.local[0]].cast<double>() - p, y = points[old.local[1]].cast<double>() - p,
                        z = points[old.local[2]].cast<double>() - p;
            const Vec3d areas(y.x() * z.y() - y.y() * z.x(), z.x() * x.y() - z.y() * x.x(),
                              x.x() * y.y() - x.y() * y.x());
            const Vec3d weights = areas / areas.sum();
            if (!(weights.minCoeff() > best)) continue;
            best = weights.minCoeff();
            face = old.face;
            b = weights;
        }
        if (best < 0) { // rounding
            b = b.cwiseMax(0.0);
            b /= b.sum();
        }
    }
    return {face, b};
}

Vec3d SurfaceMap::original_position(const TrianglePoint& point) const {
    const Triangle& t = surface_.triangles[point.triangle];
    return point.barycentric[0] * surface_.positions[t[0]] + point.barycentric[1] * surface_.positions[t[1]] +
           point.barycentric[2] * surface_.positions[t[2]];
}

} // namespace filigree
