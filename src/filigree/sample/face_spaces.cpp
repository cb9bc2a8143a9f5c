#include "filigree/sample/face_spaces.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/math.h"
#include "filigree/mesh/edges.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace filigree {

namespace {

constexpr double kSameAngle = 1e-9; // closer, faces lie on one another

/// A face that may be there again: its triangles follow each other.
struct SuspectFace {
    std::vector<Index> corners; ///< ascending
    Index first, count;         ///< triangles
    bool operator<(const SuspectFace& other) const {
        return corners != other.corners ? corners < other.corners : first < other.first;
    }
};

/// Faces with a suspect triangle, those of the same corners side by side, in the order of faces.
std::vector<SuspectFace> suspect_faces(std::span<const Triangle> triangles, std::span<const Index> faces,
                                       std::span<const std::uint8_t> is_suspect) {
    std::vector<SuspectFace> suspects;
    for (Index begin = 0; begin < triangles.size();) {
        Index end = begin;
        bool is_any = false;
        for (; end < triangles.size() && faces[end] == faces[begin]; ++end) is_any |= is_suspect[end] != 0;
        if (is_any) {
            SuspectFace face{{}, begin, end - begin};
            for (Index t = begin; t < end; ++t)
                face.corners.insert(face.corners.end(), triangles[t].begin(), triangles[t].end());
            std::ranges::sort(face.corners);
            face.corners.erase(std::unique(face.corners.begin(), face.corners.end()), face.corners.end());
            suspects.push_back(std::move(face));
        }
        begin = end;
    }
    std::sort(suspects.begin(), suspects.end());
    return suspects;
}

/// A face seen along one of its edges, by its angle around it.
struct FaceAtEdge {
    double angle;
    Index before, after; ///< nodes of the spaces at lower and at higher angles
    std::int64_t layer;  ///< among faces at one angle
    bool operator<(const FaceAtEdge& other) const {
        return angle != other.angle ? angle < other.angle : layer < other.layer;
    }
};

/// The spaces that patches divide: node 2 p is the side before patch p, where its normals point; 2 p + 1 behind it.
class Spaces {
public:
    Spaces(std::span<const Vec3f> positions, std::span<const Triangle> triangles, const Patches& patches)
        : positions_(positions), triangles_(triangles), patches_(patches), nodes_(2 * patches.count),
          known_(patches.part_is_open.size(), 0) {
        for (std::size_t p = 0; p < known_.size(); ++p)
            known_[p] = !patches.part_is_open[p] && !patches.part_is_simple[p];
    }

    void join_around(const IndexLists& edges) {
        std::vector<FaceAtEdge> faces;
        for (const std::span<const Index> edge : edges) {
            const Index part = part_of(edge[0] / 3);
            if (!known_[part] || edge.size() < 2) continue;
            if (edge.size() == 2 && patches_.of[edge[0] / 3] == patches_.of[edge[1] / 3]) continue;
            look_along(edge, faces);
            for (std::size_t i = 0; i < faces.size(); ++i) {
                const FaceAtEdge& next = faces[(i + 1) % faces.size()];
                nodes_.join(faces[i].after, next.before);
            }
        }
    }

    PatchSides sides() {
        const std::vector<Index> outside = outer_nodes();
        std::vector<std::uint8_t> inside(2 * patches_.count, kUnknown); // of roots
        for (std::size_t part = 0; part < known_.size(); ++part)
            if (known_[part] && outside[part] != kNoIndex)
                inside[nodes_.root(outside[part])] = kOutside;
            else
                known_[part] = 0;
        count_through(inside);
        PatchSides sides;
        sides.before.resize(patches_.count);
        sides.behind.resize(patches_.count);
        for (Index p = 0; p < patches_.count; ++p) {
            if (!known_[patches_.part[p]]) continue;
            const auto at = [&](Index node) {
                const std::uint8_t space = inside[nodes_.root(node)];
                return patches_.part_is_odd[patches_.part[p]] ? space != kOutside : space == kInside;
            };
            sides.before[p] = at(2 * p);
            sides.behind[p] = at(2 * p + 1);
        }
        sides.part_is_known = std::move(known_);
        return sides;
    }

    /// Of each part that is known: see winding_signs.
    std::vector<std::int8_t> winding_signs() {
        const std::vector<Index> outside = outer_nodes();
        const std::vector<Door> doors = all_doors();
        constexpr int kUncounted = std::numeric_limits<int>::min();
        std::vector<int> winding(2 * patches_.count, kUncounted); // of roots
        std::vector<std::int8_t> signs(known_.size(), 0);
        std::vector<std::array<std::uint8_t, 2>> has(known_.size()); // numbers below 0, above 0
        for (Index part = 0; part < known_.size(); ++part) {
            if (!known_[part] || outside[part] == kNoIndex) continue;
            bool agree = true;
            std::vector<Index> waiting = {nodes_.root(outside[part])};
            winding[waiting[0]] = 0;
            while (!waiting.empty()) {
                const Index space = waiting.back();
                waiting.pop_back();
                has[part][winding[space] > 0] |= winding[space] != 0;
                for (const Door& door : doors_of(doors, space))
                    for (const bool is_before : {true, false}) {
                        const Index here = nodes_.root(2 * door.patch + !is_before);
                        const Index other = nodes_.root(2 * door.patch + is_before);
                        if (here != space) continue;
                        const int wanted = winding[space] + (is_before ? 1 : -1);
                        agree = agree && (winding[other] == kUncounted || winding[other] == wanted);
                        if (winding[other] == kUncounted) waiting.push_back(other);
                        winding[other] = wanted;
                    }
                if (!agree) break;
            }
            if (agree && has[part][0] != has[part][1]) signs[part] = has[part][1] ? 1 : -1;
        }
        return signs;
    }

private:
    enum : std::uint8_t { kUnknown, kOutside, kInside };

    /// A space's root, and a patch beside it.
    struct Door {
        Index space, patch;
        auto operator<=>(const Door&) const = default;
    };
    std::vector<Door> all_doors() {
        std::vector<Door> doors;
        for (Index p = 0; p < patches_.count; ++p)
            if (known_[patches_.part[p]])
                for (const Index node : {2 * p, 2 * p + 1}) doors.push_back({nodes_.root(node), p});
        std::sort(doors.begin(), doors.end());
        return doors;
    }
    static std::span<const Door> doors_of(std::span<const Door> doors, Index space) {
        const auto found = std::ranges::equal_range(doors, space, {}, &Door::space);
        return {found.begin(), found.end()};
    }

    Index part_of(Index triangle) const { return patches_.part[patches_.of[triangle]]; }
    Vec3d at(Index vertex) const { return positions_[vertex].cast<double>(); }

    void look_along(std::span<const Index> edge, std::vector<FaceAtEdge>& faces) const {
        const Index a = half_edge_start(triangles_, edge[0]), b = half_edge_end(triangles_, edge[0]);
        const Index low = std::min(a, b), high = std::max(a, b);
        const Vec3d axis = (at(high) - at(low)).normalized();
        const auto across = [&](Index h) -> Vec3d {
            const Vec3d way = at(half_edge_start(triangles_, previous_half_edge(h))) - at(low);
            return way - way.dot(axis) * axis;
        };
        const Vec3d x = across(edge[0]).normalized(), y = axis.cross(x);
        faces.clear();
        for (const Index h : edge) {
            const Index before = 2 * patches_.of[h / 3], behind = before + 1;
            const Vec3d way = across(h);
            // Multiples of kSameAngle, so that faces on one another are at one angle; from 0 to below a full turn.
            double angle = h == edge[0] ? 0 : std::round(math::atan2(way.dot(y), way.dot(x)) / kSameAngle);
            if (angle < 0) angle += std::round(2 * std::numbers::pi / kSameAngle);
            // Of faces on one another the first patch lies lowest, as seen from one side of their plane at all edges.
            const Vec3d up = axis.cross(way);
            const double side = up.x() != 0 ? up.x() : up.y() != 0 ? up.y() : up.z();
            const auto layer = std::int64_t(patches_.of[h / 3]) * (side > 0 ? 1 : -1);
            if (half_edge_start(triangles_, h) == low) // its normal points to higher angles
                faces.push_back({angle, behind, before, layer});
            else
                faces.push_back({angle, before, behind, layer});
        }
        std::sort(faces.begin(), faces.end());
    }

    /// For each part the node outside of it: before or behind the last triangle that a line along x meets.
    std::vector<Index> outer_nodes() const {
        std::vector<Index> widest(known_.size(), kNoIndex), outside(known_.size(), kNoIndex);
        std::vector<double> most(known_.size(), 0), last(known_.size(), -std::numeric_limits<double>::infinity());
        const auto normal_of = [&](const Triangle& t) -> Vec3d {
            return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
        };
        for (Index t = 0; t < triangles_.size(); ++t) {
            const Index part = part_of(t);
            if (!known_[part]) continue;
            const double seen = std::abs(normal_of(triangles_[t]).x());
            if (seen <= most[part]) continue;
            most[part] = seen;
            widest[part] = t;
        }
        for (Index t = 0; t < triangles_.size(); ++t) {
            const Index part = part_of(t);
            if (widest[part] == kNoIndex) continue;
            const Triangle& from = triangles_[widest[part]];
            const Vec3d line = (at(from[0]) + at(from[1]) + at(from[2])) / 3, normal = normal_of(triangles_[t]);
            if (!meets(triangles_[t], line, normal.x())) continue;
            const Vec3d way = at(triangles_[t][0]) - line;
            const double x = line.x() + way.dot(normal) / normal.x();
            if (x <= last[part]) continue;
            last[part] = x;
            outside[part] = 2 * patches_.of[t] + (normal.x() < 0);
        }
        return outside;
    }

    /// Whether a line along x meets a triangle.
    bool meets(const Triangle& t, const Vec3d& line, double facing) const {
        if (facing == 0) return false;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d a = at(t[k]) - line, b = at(t[(k + 1) % 3]) - line;
            if ((a.y() * b.z() - a.z() * b.y()) * facing < 0) return false;
        }
        return true;
    }

    /// From outside through patch after patch: a space behind each patch before which one is known. A part where two
    /// ways disagree is not known.
    void count_through(std::vector<std::uint8_t>& inside) {
        const std::vector<Door> doors = all_doors();
        std::vector<Index> waiting;
        for (Index node = 0; node < inside.size(); ++node)
            if (inside[node] != kUnknown) waiting.push_back(node);
        while (!waiting.empty()) {
            const Index space = waiting.back();
            waiting.pop_back();
            for (const Door& door : doors_of(doors, space)) {
                const Index p = door.patch, part = patches_.part[p];
                if (patches_.part_is_odd[part]) continue;
                const Index other = nodes_.root(2 * p) == space ? nodes_.root(2 * p + 1) : nodes_.root(2 * p);
                const std::uint8_t wanted = inside[space] == kOutside ? kInside : kOutside;
                if (inside[other] == kUnknown) {
                    inside[other] = wanted;
                    waiting.push_back(other);
                } else if (inside[other] != wanted) {
                    known_[part] = 0;
                }
            }
        }
    }

    std::span<const Vec3f> positions_;
    std::span<const Triangle> triangles_;
    const Patches& patches_;
    DisjointSets nodes_;
    std::vector<std::uint8_t> known_; ///< of each part
};

} // namespace

RepeatedFaces repeated_faces(std::span<const Triangle> triangles, std::span<const Index> faces,
                             const IndexLists& edges) {
    RepeatedFaces found;
    found.left_out.assign(triangles.size(), 0);
    found.all_of_part.assign(triangles.size(), 0);
    std::vector<std::uint8_t> is_odd(triangles.size(), 0), is_suspect(triangles.size(), 0);
    DisjointSets parts(triangles.size());
    for (const std::span<const Index> edge : edges) {
        for (const Index h : edge) parts.join(edge[0] / 3, h / 3);
        if (edge.size() > 2 || is_one_face_twice(triangles, edge))
            for (const Index h : edge) is_suspect[h / 3] = 1;
    }
    std::vector<SuspectFace> suspects = suspect_faces(triangles, faces, is_suspect);
    if (suspects.empty()) return found;
    for (const std::span<const Index> edge : edges) {
        if (edge.size() % 2 == 1) is_odd[parts.root(edge[0] / 3)] = 1;
    }
    std::vector<std::size_t> in_groups(triangles.size(), 0), common(triangles.size(), 0), of_part(triangles.size(), 0);
    const auto for_each_group = [&](const auto& visit) {
        for (std::size_t begin = 0; begin < suspects.size();) {
            std::size_t end = begin + 1;
            while (end < suspects.size() && suspects[end].corners == suspects[begin].corners) ++end;
            if (end - begin > 1)
                visit(std::span(suspects).subspan(begin, end - begin), parts.root(suspects[begin].first));
            begin = end;
        }
    };
    for (Index t = 0; t < triangles.size(); ++t) ++of_part[parts.root(t)];
    for_each_group([&](std::span<const SuspectFace> group, Index part) {
        for (const SuspectFace& face : group) in_groups[part] += face.count;
        common[part] = std::gcd(common[part], group.size());
    });
    for (Index t = 0; t < triangles.size(); ++t) {
        const Index part = parts.root(t);
        found.all_of_part[t] = in_groups[part] == of_part[part] && common[part] > 1;
    }
    for_each_group([&](std::span<const SuspectFace> group, Index part) {
        const std::size_t times = group.size() / (in_groups[part] == of_part[part] ? common[part] : 1);
        const bool keeps_one = is_odd[part] || times % 2 == 1;
        for (const SuspectFace& face : group.subspan(keeps_one ? 1 : 0))
            std::fill_n(found.left_out.begin() + face.first, face.count, std::uint8_t{1});
    });
    return found;
}

std::vector<std::int8_t> winding_signs(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                       const IndexLists& edges) {
    DisjointSets joined(triangles.size());
    std::vector<std::uint8_t> is_unfit(triangles.size(), 0), is_crowded(triangles.size(), 0); // of parts
    for (const std::span<const Index> edge : edges) {
        for (const Index h : edge) joined.join(edge[0] / 3, h / 3);
    }
    for (const std::span<const Index> edge : edges) {
        const Index part = joined.root(edge[0] / 3);
        if (edge_balance(triangles, edge) != 0) is_unfit[part] = 1;
        if (edge.size() > 2) is_crowded[part] = 1;
    }
    const std::vector<Index> neighbour = neighbour_half_edges(triangles, edges);
    Patches patches;
    Labels labels = components(neighbour);
    patches.of = std::move(labels.of);
    patches.count = labels.count;
    patches.part.resize(patches.count);
    std::vector<Index> number(triangles.size(), kNoIndex);
    for (Index t = 0; t < triangles.size(); ++t) {
        const Index root = joined.root(t);
        if (number[root] == kNoIndex) {
            number[root] = Index(patches.part_is_open.size());
            patches.part_is_open.push_back(is_unfit[root]);
            patches.part_is_simple.push_back(!is_crowded[root]);
            patches.part_is_odd.push_back(0);
        }
        patches.part[patches.of[t]] = number[root];
    }
    Spaces spaces(positions, triangles, patches);
    spaces.join_around(edges);
    const std::vector<std::int8_t> of_part = spaces.winding_signs();
    std::vector<std::int8_t> signs(triangles.size());
    for (Index t = 0; t < triangles.size(); ++t) signs[t] = of_part[patches.part[patches.of[t]]];
    return signs;
}

PatchSides sides_of_patches(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                            const IndexLists& edges, const Patches& patches) {
    Spaces spaces(positions, triangles, patches);
    spaces.join_around(edges);
    return spaces.sides();
}

} // namespace filigree
