#include "filigree/fracture/constrained_delaunay.h"

#include <algorithm>
#include <cmath>
#include <deque>

namespace filigree {

namespace {

using Int128 = __int128;

constexpr int next_corner(int k) { return k == 2 ? 0 : k + 1; }
constexpr int previous_corner(int k) { return k == 0 ? 2 : k - 1; }

/// Sign of the turn a, b, c; above zero is counter-clockwise. Products of 29 bits fit 64.
int turn(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
    const std::int64_t d = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    return (d > 0) - (d < 0);
}

/// Whether d lies inside the circle through a, b, c (counter-clockwise).
bool in_circle(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c, const PlanePoint& d) {
    const std::int64_t ax = a[0] - d[0], ay = a[1] - d[1], bx = b[0] - d[0], by = b[1] - d[1], cx = c[0] - d[0],
                       cy = c[1] - d[1];
    const std::int64_t aa = ax * ax + ay * ay, bb = bx * bx + by * by, cc = cx * cx + cy * cy;
    const std::int64_t bc = bx * cy - by * cx, ac = ax * cy - ay * cx, ab = ax * by - ay * bx;
    const double about = double(aa) * double(bc) - double(bb) * double(ac) + double(cc) * double(ab);
    const double bound = 1e-14 * (double(aa) * std::abs(double(bc)) + double(bb) * std::abs(double(ac)) +
                                  double(cc) * std::abs(double(ab)));
    if (std::abs(about) > bound) return about > 0;
    return Int128(aa) * bc - Int128(bb) * ac + Int128(cc) * ab > 0;
}

} // namespace

ConstrainedDelaunay::ConstrainedDelaunay() {
    constexpr std::int64_t kFar = 2 * kPlaneHalf;
    points_ = {{-3 * kFar, -3 * kFar}, {3 * kFar, -3 * kFar}, {0, 3 * kFar}};
    faces_.push_back({{0, 1, 2}, {kNoIndex, kNoIndex, kNoIndex}, {0, 0, 0}});
    face_at_ = {0, 0, 0};
}

int ConstrainedDelaunay::side(Index a, Index b, Index c) const { return turn(points_[a], points_[b], points_[c]); }

int ConstrainedDelaunay::corner_of(Index face, Index vertex) const {
    const auto& v = faces_[face].vertices;
    return v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2;
}

int ConstrainedDelaunay::edge_to(Index face, Index other) const {
    const auto& n = faces_[face].across;
    return n[0] == other ? 0 : n[1] == other ? 1 : 2;
}

std::pair<Index, int> ConstrainedDelaunay::find_edge(Index a, Index b) const {
    // Around a counter-clockwise, and the other way where the outside ends that.
    const Index first = face_at_[a];
    for (const bool is_back : {false, true}) {
        for (Index face = first; face != kNoIndex;) {
            const int k = corner_of(face, a);
            if (faces_[face].vertices[next_corner(k)] == b) return {face, k};
            face = faces_[face].across[is_back ? k : previous_corner(k)];
            if (face == first) return {kNoIndex, 0};
        }
    }
    return {kNoIndex, 0};
}

Index ConstrainedDelaunay::add_vertex(const PlanePoint& point) {
    points_.push_back(point);
    face_at_.push_back(kNoIndex);
    return static_cast<Index>(points_.size() - 1);
}

void ConstrainedDelaunay::relink(Index face, Index from, Index to) {
    if (face != kNoIndex) faces_[face].across[edge_to(face, from)] = to;
}

ConstrainedDelaunay::Place ConstrainedDelaunay::locate(const PlanePoint& point) {
    Index face = last_;
    for (bool moved = true; moved;) {
        moved = false;
        ++turn_;
        for (unsigned step = 0; step < 3; ++step) {
            const int k = static_cast<int>((step + turn_) % 3);
            const Face& f = faces_[face];
            if (turn(points_[f.vertices[k]], points_[f.vertices[next_corner(k)]], point) < 0) {
                face = f.across[k];
                moved = true;
                break;
            }
        }
    }
    last_ = face;
    Place place{face, -1, kNoIndex};
    for (int k = 0; k < 3; ++k) {
        const Face& f = faces_[face];
        if (points_[f.vertices[k]] == point) place.vertex = f.vertices[k];
        if (turn(points_[f.vertices[k]], points_[f.vertices[next_corner(k)]], point) == 0) place.edge = k;
    }
    return place;
}

void ConstrainedDelaunay::split_face(Index face, Index vertex) {
    const Face old = faces_[face];
    const auto [a, b, c] = old.vertices;
    const Index second = static_cast<Index>(faces_.size()), third = second + 1;
    faces_[face] = {{a, b, vertex}, {old.across[0], second, third}, {old.net[0], 0, 0}, old.winding};
    faces_.push_back({{b, c, vertex}, {old.across[1], third, face}, {old.net[1], 0, 0}, old.winding});
    faces_.push_back({{c, a, vertex}, {old.across[2], face, second}, {old.net[2], 0, 0}, old.winding});
    relink(old.across[1], face, second);
    relink(old.across[2], face, third);
    face_at_[a] = face_at_[b] = face_at_[vertex] = face;
    face_at_[c] = second;
    stack_.insert(stack_.end(), {face, second, third});
    legalize(vertex);
}

ConstrainedDelaunay::EdgeSides ConstrainedDelaunay::both_sides(Index face, int edge) const {
    const Index other = faces_[face].across[edge];
    const int back = edge_to(other, face);
    const Face &f = faces_[face], &g = faces_[other];
    return {other,
            f,
            g,
            f.vertices[edge],
            f.vertices[next_corner(edge)],
            f.vertices[previous_corner(edge)],
            g.vertices[previous_corner(back)],
            next_corner(edge),
            previous_corner(edge),
            next_corner(back),
            previous_corner(back)};
}

void ConstrainedDelaunay::split_edge(Index face, int edge, Index vertex) {
    // (a, b, c) and (b, a, d) become (a, v, c), (v, b, c), (b, v, d), (v, a, d).
    const auto [other, f, g, a, b, c, d, bc, ca, ad, db] = both_sides(face, edge);
    const Index second = static_cast<Index>(faces_.size()), fourth = second + 1;
    const int net = f.net[edge];
    faces_[face] = {{a, vertex, c}, {fourth, second, f.across[ca]}, {net, 0, f.net[ca]}, f.winding};
    faces_[other] = {{b, vertex, d}, {second, fourth, g.across[db]}, {-net, 0, g.net[db]}, g.winding};
    faces_.push_back({{vertex, b, c}, {other, f.across[bc], face}, {net, f.net[bc], 0}, f.winding});
    faces_.push_back({{vertex, a, d}, {face, g.across[ad], other}, {-net, g.net[ad], 0}, g.winding});
    relink(f.across[bc], face, second);
    relink(g.across[ad], other, fourth);
    face_at_[a] = face_at_[c] = face_at_[vertex] = face;
    face_at_[b] = face_at_[d] = other;
    stack_.insert(stack_.end(), {face, second, other, fourth});
    legalize(vertex);
}

bool ConstrainedDelaunay::can_split_edge(Index face, int edge, const PlanePoint& p) const {
    const Index other = faces_[face].across[edge];
    if (other == kNoIndex) return false;
    const auto at = [&](Index f, int k) { return points_[faces_[f].vertices[k]]; };
    const int back = edge_to(other, face);
    const PlanePoint a = at(face, edge), b = at(face, next_corner(edge)), c = at(face, previous_corner(edge)),
                     d = at(other, previous_corner(back));
    return turn(a, p, c) > 0 && turn(p, b, c) > 0 && turn(b, p, d) > 0 && turn(p, a, d) > 0;
}

void ConstrainedDelaunay::flip(Index face, int edge) {
    // (a, b, c) and (b, a, d) become (c, a, d) and (d, b, c).
    const auto [other, f, g, a, b, c, d, bc, ca, ad, db] = both_sides(face, edge);
    faces_[face] = {{c, a, d}, {f.across[ca], g.across[ad], other}, {f.net[ca], g.net[ad], 0}, f.winding};
    faces_[other] = {{d, b, c}, {g.across[db], f.across[bc], face}, {g.net[db], f.net[bc], 0}, g.winding};
    relink(g.across[ad], other, face);
    relink(f.across[bc], face, other);
    face_at_[a] = face_at_[c] = face_at_[d] = face;
    face_at_[b] = other;
}

bool ConstrainedDelaunay::is_delaunay(Index face, int edge) const {
    const Face& f = faces_[face];
    const Index other = f.across[edge];
    if (other == kNoIndex || f.net[edge] != 0) return true;
    const Index d = faces_[other].vertices[previous_corner(edge_to(other, face))];
    return !in_circle(points_[f.vertices[0]], points_[f.vertices[1]], points_[f.vertices[2]], points_[d]);
}

/// Flips until the faces of stack_, all at the new vertex, are Delaunay again.
void ConstrainedDelaunay::legalize(Index vertex) {
    while (!stack_.empty()) {
        const Index face = stack_.back();
        stack_.pop_back();
        const int edge = next_corner(corner_of(face, vertex));
        if (faces_[face].vertices[previous_corner(edge)] != vertex || is_delaunay(face, edge)) continue;
        const Index other = faces_[face].across[edge];
        flip(face, edge);
        stack_.push_back(face);
        stack_.push_back(other);
    }
}

Index ConstrainedDelaunay::insert(const PlanePoint& point) {
    const Place place = locate(point);
    if (place.vertex != kNoIndex) return place.vertex;
    const Index vertex = add_vertex(point);
    if (place.edge >= 0)
        split_edge(place.face, place.edge, vertex);
    else
        split_face(place.face, vertex);
    return vertex;
}

void ConstrainedDelaunay::add_net(Index a, Index b, int multiplicity) {
    const auto [face, edge] = find_edge(a, b);
    faces_[face].net[edge] += multiplicity;
    const Index other = faces_[face].across[edge];
    faces_[other].net[edge_to(other, face)] -= multiplicity;
}

bool ConstrainedDelaunay::constrain(Index from, Index to, int multiplicity) {
    // The last of `route` is where the segment still has to go; crossings put a stop before it.
    std::vector<Index> route = {to};
    constexpr int kMostSteps = 100'000;
    for (int step = 0; step < kMostSteps && route.size() < 1'000; ++step) {
        while (!route.empty() && route.back() == from) route.pop_back();
        if (route.empty()) return true;
        const Index goal = route.back();
        // Around `from`: an edge that leads there, or the face that the segment enters.
        Index reached = kNoIndex, face = face_at_[from];
        int edge = -1;
        for (const Index first = face;;) {
            const int k = corner_of(face, from);
            const Index u = faces_[face].vertices[next_corner(k)], w = faces_[face].vertices[previous_corner(k)];
            const int right = side(from, u, goal), left = side(from, w, goal);
            const auto ahead = [&](Index v) {
                const PlanePoint &o = points_[from], &p = points_[v], &g = points_[goal];
                return (p[0] - o[0]) * (g[0] - o[0]) + (p[1] - o[1]) * (g[1] - o[1]) > 0;
            };
            if (u == goal || (right == 0 && ahead(u))) {
                reached = u;
                break;
            }
            if (right > 0 && left < 0) {
                edge = next_corner(k);
                break;
            }
            face = faces_[face].across[previous_corner(k)];
            if (face == kNoIndex || face == first) return false;
        }
        if (reached != kNoIndex) {
            add_net(from, reached, multiplicity);
            from = reached;
            continue;
        }
        // Through the faces until a vertex lies on the segment, or another segment does.
        std::vector<std::pair<Index, Index>> crossed;
        for (;;) {
            const Face& f = faces_[face];
            const Index u = f.vertices[edge], w = f.vertices[next_corner(edge)];
            if (f.net[edge] != 0) {
                const PlanePoint a = points_[from], b = points_[goal], c = points_[u], d = points_[w];
                const double cx = double(d[0] - c[0]), cy = double(d[1] - c[1]);
                const double above =
                    double(b[0] - a[0]) * double(c[1] - a[1]) - double(b[1] - a[1]) * double(c[0] - a[0]);
                const double below =
                    double(b[0] - a[0]) * double(d[1] - a[1]) - double(b[1] - a[1]) * double(d[0] - a[0]);
                const double t = above / (above - below);
                const PlanePoint crossing = {c[0] + std::llround(t * cx), c[1] + std::llround(t * cy)};
                Index stop = t < 0.5 ? u : w;
                if (can_split_edge(face, edge, crossing)) {
                    stop = add_vertex(crossing);
                    split_edge(face, edge, stop);
                }
                route.push_back(stop);
                break;
            }
            crossed.emplace_back(u, w);
            const Index other = f.across[edge];
            if (other == kNoIndex) return false;
            const int back = edge_to(other, face);
            const Index d = faces_[other].vertices[previous_corner(back)];
            const int where = d == goal ? 0 : side(from, goal, d);
            if (where == 0) {
                if (!constrain_between(from, d, std::move(crossed))) return false;
                add_net(from, d, multiplicity);
                from = d;
                break;
            }
            face = other;
            edge = where > 0 ? next_corner(back) : previous_corner(back); // u stays on the right, w on the left
        }
    }
    return false;
}

/// Flips the crossed edges away, until an edge runs from `from` to `to` [Sloan 1993], then makes the others Delaunay.
bool ConstrainedDelaunay::constrain_between(Index from, Index to, std::vector<std::pair<Index, Index>> crossed) {
    std::deque<std::pair<Index, Index>> waiting(crossed.begin(), crossed.end());
    std::vector<std::pair<Index, Index>> made;
    std::size_t budget = 64 + 8 * waiting.size() * waiting.size();
    while (!waiting.empty()) {
        if (budget-- == 0) return false;
        const auto [u, w] = waiting.front();
        waiting.pop_front();
        const auto [face, edge] = find_edge(u, w);
        if (face == kNoIndex) return false;
        const Index other = faces_[face].across[edge];
        const Index c = faces_[face].vertices[previous_corner(edge)];
        const Index d = faces_[other].vertices[previous_corner(edge_to(other, face))];
        if (side(c, u, d) <= 0 || side(d, w, c) <= 0) { // not convex
            waiting.emplace_back(u, w);
            continue;
        }
        flip(face, edge);
        const bool crosses = c != from && c != to && d != from && d != to && side(from, to, c) * side(from, to, d) < 0;
        if (crosses)
            waiting.emplace_back(c, d);
        else
            made.emplace_back(c, d);
    }
    std::size_t flips = 64 + 8 * made.size() * made.size();
    while (!made.empty() && flips-- > 0) {
        const auto [u, w] = made.back();
        made.pop_back();
        if ((u == from && w == to) || (u == to && w == from)) continue;
        const auto [face, edge] = find_edge(u, w);
        if (face == kNoIndex || is_delaunay(face, edge)) continue;
        const Index other = faces_[face].across[edge];
        const Index c = faces_[face].vertices[previous_corner(edge)];
        const Index d = faces_[other].vertices[previous_corner(edge_to(other, face))];
        flip(face, edge);
        for (const auto& [a, b] : {std::pair(u, c), std::pair(c, w), std::pair(w, d), std::pair(d, u)})
            made.emplace_back(a, b);
    }
    return find_edge(from, to).first != kNoIndex;
}

bool ConstrainedDelaunay::find_windings() {
    constexpr int kUnknown = std::numeric_limits<int>::min();
    for (Face& face : faces_) face.winding = kUnknown;
    std::vector<Index> waiting = {face_at_[0]};
    faces_[face_at_[0]].winding = 0;
    while (!waiting.empty()) {
        const Index at = waiting.back();
        waiting.pop_back();
        for (int k = 0; k < 3; ++k) {
            const Index other = faces_[at].across[k];
            if (other == kNoIndex) continue;
            const int winding = faces_[at].winding - faces_[at].net[k]; // a segment has more on its left
            if (faces_[other].winding == kUnknown) {
                faces_[other].winding = winding;
                waiting.push_back(other);
            } else if (faces_[other].winding != winding) {
                return false;
            }
        }
    }
    return true;
}

std::optional<Index> ConstrainedDelaunay::insert_circumcentre(Index face, std::vector<Index>& changed) {
    const Face& f = faces_[face];
    const PlanePoint &a = points_[f.vertices[0]], &b = points_[f.vertices[1]], &c = points_[f.vertices[2]];
    const double bx = double(b[0] - a[0]), by = double(b[1] - a[1]), cx = double(c[0] - a[0]), cy = double(c[1] - a[1]);
    const double d = 2 * (bx * cy - by * cx), bb = bx * bx + by * by, cc = cx * cx + cy * cy;
    const double x = (cy * bb - by * cc) / d, y = (bx * cc - cx * bb) / d;
    constexpr double kFarthest = 4.0 * kPlaneHalf;
    if (!(std::abs(x) < kFarthest && std::abs(y) < kFarthest)) return std::nullopt;
    const PlanePoint centre = {a[0] + std::llround(x), a[1] + std::llround(y)};
    // Walk there; a segment in the way forbids it.
    Index at = face;
    for (int step = 0;; ++step) {
        if (step > 10'000) return std::nullopt;
        int leave = -1;
        for (int k = 0; k < 3 && leave < 0; ++k) {
            const int edge = (k + step) % 3;
            if (turn(points_[faces_[at].vertices[edge]], points_[faces_[at].vertices[next_corner(edge)]], centre) < 0)
                leave = edge;
        }
        if (leave < 0) break;
        if (faces_[at].net[leave] != 0 || faces_[at].across[leave] == kNoIndex) return std::nullopt;
        at = faces_[at].across[leave];
    }
    const auto encroaches = [&](Index of) {
        for (int k = 0; k < 3; ++k) {
            if (faces_[of].net[k] == 0) continue;
            const PlanePoint &p = points_[faces_[of].vertices[k]], &q = points_[faces_[of].vertices[next_corner(k)]];
            if ((p[0] - centre[0]) * (q[0] - centre[0]) + (p[1] - centre[1]) * (q[1] - centre[1]) <= 0) return true;
        }
        return false;
    };
    if (faces_[at].winding == 0 || encroaches(at)) return std::nullopt;
    for (const Index other : faces_[at].across)
        if (other == kNoIndex || encroaches(other)) return std::nullopt;
    last_ = at;
    const std::size_t before = points_.size();
    const Index vertex = insert(centre);
    if (points_.size() == before) return std::nullopt;
    const Index first = face_at_[vertex];
    for (Index around = first;;) {
        changed.push_back(around);
        around = faces_[around].across[previous_corner(corner_of(around, vertex))];
        if (around == first) break;
    }
    return vertex;
}

} // namespace filigree
