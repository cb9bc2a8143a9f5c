#include "filigree/sample/outward.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/math.h"
#include "filigree/core/text.h"
#include "filigree/mesh/edges.h"
#include "filigree/mesh/orientation.h"
#include "filigree/sample/border_cones.h"
#include "filigree/sample/face_spaces.h"
#include "filigree/sample/nesting.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kMostOpen = 0.6;       // of a part's area: with larger cones it has no inside of its own
constexpr double kOpenTogether = 0.25;  // the sum of normals, of the area: what is more closed encloses something
constexpr double kLeastEnclosed = 1e-3; // volume, of the area's power 3/2: a ball has 0.094

/// Sums over triangles.
struct Extent {
    double area = 0, turned_area = 0; ///< twice
    double volume = 0;                ///< six times, from an apex
    Vec3d normals = Vec3d::Zero();    ///< twice the area vectors
};

class Outward {
public:
    Outward(std::span<const Triangle> triangles, std::span<const Index> faces, std::span<const Vec3f> positions,
            OutwardReport& report)
        : given_(triangles), faces_(faces), positions_(positions), report_(report),
          turns_(triangles.size(), FaceTurn::kept) {}

    std::vector<FaceTurn> run() {
        leave_out_repeated();
        close_borders();
        find_patches();
        look_outwards();
        face_together();
        nest();
        count();
        return std::move(turns_);
    }

private:
    Vec3d at(Index vertex) const { return positions_[vertex].cast<double>(); }
    Index part_of(std::size_t triangle) const { return patches_.part[patches_.of[triangle]]; }
    void turn_over(Triangle& t) const { std::swap(t[1], t[2]); }

    void leave_out_repeated() {
        edges_ = edges_of(given_, positions_.size());
        bool is_crowded = false;
        for (const std::span<const Index> edge : edges_)
            is_crowded |= edge.size() > 2 || is_one_face_twice(given_, edge);
        RepeatedFaces repeated;
        std::vector<std::int8_t> signs;
        if (is_crowded) {
            repeated = repeated_faces(given_, faces_, edges_);
            signs = winding_signs(positions_, given_, edges_);
        }
        for (Index t = 0; t < given_.size(); ++t) {
            const bool is_solid = is_crowded && signs[t] != 0 && !repeated.all_of_part[t];
            if (is_crowded && !is_solid && repeated.left_out[t]) {
                turns_[t] = FaceTurn::left_out;
                continue;
            }
            triangles_.push_back(given_[t]);
            source_.push_back(t);
            solid_sign_.push_back(is_solid ? signs[t] : std::int8_t{0});
        }
        if (triangles_.size() < given_.size()) edges_ = edges_of(triangles_, positions_.size());
    }

    /// Cones over the open edges of parts that are nearly closed: they are faces like others from here on.
    void close_borders() {
        DisjointSets parts(triangles_.size());
        std::vector<MissingSide> sides;
        std::vector<Index> beside; // the triangle at each side
        for (const std::span<const Index> edge : edges_) {
            for (const Index h : edge) parts.join(edge[0] / 3, h / 3);
            if (edge.size() != 1) continue;
            sides.push_back({half_edge_start(triangles_, edge[0]), half_edge_end(triangles_, edge[0]), 1});
            beside.push_back(edge[0] / 3);
        }
        if (sides.empty()) return;
        const BorderCones cones = make_border_cones(positions_, sides);
        const auto area = [&](const Triangle& t, std::span<const Vec3f> positions) {
            const Vec3d a = positions[t[0]].cast<double>(), b = positions[t[1]].cast<double>();
            return (b - a).cross(positions[t[2]].cast<double>() - a).norm();
        };
        std::vector<double> own(triangles_.size(), 0), missing(triangles_.size(), 0); // of parts
        for (Index t = 0; t < triangles_.size(); ++t) own[parts.root(t)] += area(triangles_[t], positions_);
        for (std::size_t s = 0; s < sides.size(); ++s)
            missing[parts.root(beside[s])] += area(cones.triangles[s], cones.positions);
        std::vector<Triangle> closing;
        for (std::size_t s = 0; s < sides.size(); ++s)
            if (const Index part = parts.root(beside[s]); missing[part] <= kMostOpen * own[part])
                closing.push_back(cones.triangles[s]);
        if (closing.empty()) return;
        closed_positions_ = std::move(cones.positions);
        positions_ = closed_positions_;
        triangles_.insert(triangles_.end(), closing.begin(), closing.end());
        solid_sign_.resize(triangles_.size(), 0);
        edges_ = edges_of(triangles_, positions_.size());
    }

    void find_patches() {
        const std::vector<Index> neighbour = neighbour_half_edges(triangles_, edges_);
        DisjointSets parts(triangles_.size());
        for (const std::span<const Index> edge : edges_)
            for (const Index h : edge) parts.join(edge[0] / 3, h / 3);
        turned_ = triangles_to_turn(triangles_, neighbour, positions_, OneSided::left);
        for (std::size_t t = 0; t < triangles_.size(); ++t)
            if (turned_[t]) turn_over(triangles_[t]);
        if (std::ranges::find(turned_, 1) != turned_.end()) edges_ = edges_of(triangles_, positions_.size());
        Labels patches = components(neighbour);
        patches_.of = std::move(patches.of);
        patches_.count = patches.count;
        number_parts(parts);
        describe_parts();
    }

    void number_parts(DisjointSets& parts) {
        std::vector<Index> number(triangles_.size(), kNoIndex);
        patches_.part.assign(patches_.count, kNoIndex);
        for (Index t = 0; t < triangles_.size(); ++t) {
            Index& of_root = number[parts.root(t)];
            if (of_root == kNoIndex) of_root = part_count_++;
            patches_.part[patches_.of[t]] = of_root;
        }
    }

    void describe_parts() {
        patches_.part_is_open.assign(part_count_, 0);
        patches_.part_is_odd.assign(part_count_, 0);
        patches_.part_is_simple.assign(part_count_, 1);
        is_one_sided_.assign(part_count_, 0);
        for (const std::span<const Index> edge : edges_) {
            const Index part = part_of(edge[0] / 3);
            if (edge.size() == 1) patches_.part_is_open[part] = 1;
            if (edge.size() % 2 == 1) patches_.part_is_odd[part] = 1;
            if (edge.size() > 2) patches_.part_is_simple[part] = 0;
            if (edge.size() == 2 && half_edge_start(triangles_, edge[0]) == half_edge_start(triangles_, edge[1]))
                is_one_sided_[part] = 1;
        }
    }

    /// Six times the volume of each part's cone from its first corner.
    std::vector<double> volumes() const {
        std::vector<double> volume(part_count_, 0);
        std::vector<Index> first(part_count_, kNoIndex);
        for (std::size_t t = 0; t < triangles_.size(); ++t) {
            const Index part = part_of(t);
            if (first[part] == kNoIndex) first[part] = triangles_[t][0];
            const Vec3d from = at(first[part]);
            const auto corner = [&](std::size_t k) -> Vec3d { return at(triangles_[t][k]) - from; };
            volume[part] += corner(0).dot(corner(1).cross(corner(2)));
        }
        return volume;
    }

    /// Turns what looks inwards in parts whose inside is known, and finds walls between matter and matter.
    void look_outwards() {
        const std::vector<double> volume = volumes();
        std::vector<std::int8_t> solid(part_count_, 0);
        for (std::size_t t = 0; t < triangles_.size(); ++t) solid[part_of(t)] |= solid_sign_[t];
        is_known_.assign(part_count_, 0);
        is_wall_.assign(triangles_.size(), 0);
        std::vector<std::uint8_t> turns(patches_.count, 0), walls(patches_.count, 0);
        PatchSides sides;
        const bool has_crowded = std::ranges::find(patches_.part_is_simple, 0) != patches_.part_is_simple.end();
        if (has_crowded) sides = sides_of_patches(positions_, triangles_, edges_, patches_);
        for (Index p = 0; p < patches_.count; ++p) {
            const Index part = patches_.part[p];
            if (is_one_sided_[part] || patches_.part_is_open[part]) continue;
            if (solid[part] != 0) {
                is_known_[part] = 1;
                turns[p] = solid[part] < 0;
            } else if (patches_.part_is_simple[part]) {
                is_known_[part] = volume[part] != 0;
                turns[p] = volume[part] < 0;
            } else if (sides.part_is_known[part]) {
                is_known_[part] = 1;
                turns[p] = sides.before[p] && !sides.behind[p];
                walls[p] = sides.before[p] && sides.behind[p];
            }
        }
        for (std::size_t t = 0; t < triangles_.size(); ++t) {
            is_wall_[t] = walls[patches_.of[t]];
            if (turns[patches_.of[t]]) flip(t);
        }
    }

    void flip(std::size_t t) {
        turn_over(triangles_[t]);
        turned_[t] ^= 1;
    }

    /// Sheets and soups that enclose something together, and look inwards.
    void face_together() {
        Extent all;
        Vec3d middle = Vec3d::Zero();
        const auto for_each_unknown = [&](const auto& visit) {
            for (std::size_t t = 0; t < triangles_.size(); ++t)
                if (const Index part = part_of(t); !is_known_[part] && !is_one_sided_[part]) {
                    const Vec3d a = at(triangles_[t][0]), b = at(triangles_[t][1]), c = at(triangles_[t][2]);
                    visit(t, a, Vec3d((b - a).cross(c - a)));
                }
        };
        for_each_unknown([&](std::size_t, const Vec3d& a, const Vec3d& normal) {
            all.area += normal.norm();
            middle += normal.norm() * a;
            all.normals += normal;
        });
        if (!(all.area > 0) || all.normals.norm() > kOpenTogether * all.area) return;
        middle /= all.area;
        for_each_unknown(
            [&](std::size_t, const Vec3d& a, const Vec3d& normal) { all.volume += normal.dot(a - middle); });
        if (all.volume / 6 > -kLeastEnclosed * math::pow(all.area / 2, 1.5)) return;
        for_each_unknown([&](std::size_t t, const Vec3d&, const Vec3d&) { flip(t); });
    }

    void nest() {
        std::vector<Index> part(triangles_.size(), kNoIndex);
        for (std::size_t t = 0; t < triangles_.size(); ++t)
            if (is_known_[part_of(t)] && !is_wall_[t]) part[t] = part_of(t);
        depth_ = nesting_depths(positions_, triangles_, part, part_count_);
        for (std::size_t t = 0; t < triangles_.size(); ++t)
            if (depth_[part_of(t)] % 2 == 1) flip(t);
    }

    /// Fills turns_ and the report: a part counts as turned as most of its area is.
    void count() {
        std::vector<Extent> extents(part_count_);
        const auto area = [&](std::size_t t) {
            const Vec3d a = at(triangles_[t][0]);
            return (at(triangles_[t][1]) - a).cross(at(triangles_[t][2]) - a).norm();
        };
        for (std::size_t t = 0; t < source_.size(); ++t) {
            if (is_wall_[t]) continue;
            (turned_[t] ? extents[part_of(t)].turned_area : extents[part_of(t)].area) += area(t);
        }
        report_.parts = part_count_;
        std::vector<std::uint8_t> is_turned(part_count_, 0);
        for (std::size_t part = 0; part < part_count_; ++part) {
            is_turned[part] = extents[part].turned_area > extents[part].area;
            if (is_turned[part]) ++(depth_[part] % 2 == 1 ? report_.cavities : report_.inward_parts);
            report_.one_sided_parts += is_one_sided_[part];
        }
        for (std::size_t t = 0; t < source_.size(); ++t) {
            if (is_wall_[t]) {
                turns_[source_[t]] = FaceTurn::left_out;
                continue;
            }
            if (turned_[t]) turns_[source_[t]] = FaceTurn::turned;
            report_.turned_faces += turned_[t] != is_turned[part_of(t)];
        }
        report_.inner_faces = std::size_t(std::ranges::count(turns_, FaceTurn::left_out));
    }

    std::span<const Triangle> given_;
    std::span<const Index> faces_;     ///< of given_
    std::span<const Vec3f> positions_; ///< the mesh's; with tips of cones, closed_positions_
    OutwardReport& report_;
    std::vector<FaceTurn> turns_; ///< of given_

    std::vector<Triangle> triangles_;     ///< those that count, then cones
    std::vector<Index> source_;           ///< of each but the cones, in given_
    std::vector<std::int8_t> solid_sign_; ///< 1, -1: its part is solids that touch or cross (winding_signs)
    std::vector<std::uint8_t> turned_;    ///< beside what they were
    std::vector<std::uint8_t> is_wall_;   ///< with matter on both sides
    IndexLists edges_;                    ///< the half-edges of each
    std::vector<Vec3f> closed_positions_; ///< where there are cones
    Patches patches_;
    Index part_count_ = 0;
    std::vector<std::uint8_t> is_one_sided_, is_known_; ///< of each part; known: it has an inside
    std::vector<Index> depth_;
};

std::string times(std::size_t count, const char* one, const char* many) {
    return with_commas(count) + " " + (count == 1 ? one : many);
}

} // namespace

std::vector<FaceTurn> outward_turns(std::span<const Triangle> triangles, std::span<const Index> faces,
                                    std::span<const Vec3f> positions, OutwardReport& report) {
    report = {};
    return Outward(triangles, faces, positions, report).run();
}

std::string outward_sentence(const OutwardReport& r) {
    std::string text;
    const auto add = [&](std::size_t count, const std::string& sentence) {
        if (count > 0) text += (text.empty() ? "" : " ") + sentence;
    };
    const std::string looking =
        r.parts == 1          ? "The mesh looks inwards (it is inside out); its faces"
        : r.inward_parts == 1 ? "1 of " + with_commas(r.parts) + " parts looks inwards (it is inside out); its faces"
                              : with_commas(r.inward_parts) + " of " + with_commas(r.parts) +
                                    " parts look inwards (they are inside out); their faces";
    add(r.inward_parts, looking + " count as turned outwards.");
    add(r.cavities, times(r.cavities, "part lies inside another and counts as a hollow; its faces count as turned.",
                          "parts lie inside others and count as hollows; their faces count as turned."));
    add(r.turned_faces, times(r.turned_faces, "triangle runs against its neighbours and counts as turned.",
                              "triangles run against their neighbours and count as turned."));
    add(r.inner_faces, times(r.inner_faces, "triangle is a wall inside the body, or there twice, and does not count.",
                             "triangles are walls inside the body, or there twice, and do not count."));
    add(r.one_sided_parts,
        times(r.one_sided_parts, "part has only one side, as a Moebius band: nothing tells its inside.",
              "parts have only one side, as a Moebius band: nothing tells their inside."));
    return text;
}

} // namespace filigree
