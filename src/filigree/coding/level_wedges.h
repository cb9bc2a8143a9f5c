// Wedges and colours of a surface that grows by splits: which ones come with a vertex follows from where it comes from,
// and on seams from a bit; what values they have is expected from their neighbours' [compare Hoppe 1998].
#pragma once

#include "filigree/coding/surface_frame.h"
#include "filigree/coding/vertex_rings.h"
#include "filigree/coding/wedge.h"

#include <bit>
#include <cmath>
#include <span>
#include <vector>

namespace filigree {

// Contexts of the coarsest level's attributes, and of those that splits bring.
inline constexpr unsigned kWedgeSizes = 12;
inline constexpr unsigned kBaseFlags = 0, kBaseWedge = 1, kBaseSame = 2, kBaseMaterial = 3, kBaseHasUv = 4, kBaseUv = 5,
                          kBaseColor = 7, kBaseContexts = kBaseColor + 4;
inline constexpr unsigned kSplitSide = 0, kSplitUv = 2, kSplitColor = kSplitUv + 2 * kWedgeSizes,
                          kSplitContexts = kSplitColor + 4 * kWedgeSizes;

/// `Coder` writes, looking into the source, or reads. `BaseCoder` does the same with the coarsest level's stream.
template <class Coder>
class LevelWedges {
public:
    explicit LevelWedges(Coder& with, unsigned first_context) : coder(with), first_context_(first_context) {}

    Coder& coder;
    AttributeOutline outline;
    std::vector<Wedge> wedges;
    std::vector<ByteColor> colors; ///< of each vertex, where there are any

    bool has_any() const { return !at_vertex_.empty(); }

    /// The coarsest level's. False: damaged.
    template <class BaseCoder>
    bool begin(const ClosedMap& map, BaseCoder& base) {
        if (!code_outline(base)) return false;
        std::vector<Index> wedge_at(map.opposite.size(), kNoIndex);
        std::vector<std::vector<Index>> at(map.vertex_count()); // the one met last at the end
        Wedge last{.parent = 0};
        for (Index h = 0; h < map.opposite.size(); ++h) {
            if (!map.is_own(map.triangles[h / 3])) continue;
            const Index v = map.origin(h);
            std::uint32_t pick = 0; // back from the one met last
            Index source = kNoIndex;
            if constexpr (Coder::writes) {
                source = base.wedge_at(h);
                const auto found =
                    std::find_if(at[v].rbegin(), at[v].rend(), [&](Index w) { return coder.source(w) == source; });
                pick = static_cast<std::uint32_t>(found - at[v].rbegin());
            }
            if (!at[v].empty()) pick = base.number(kBaseWedge, pick);
            if (pick > at[v].size() || base.is_damaged()) return false;
            if (pick == at[v].size()) {
                code_base_wedge(base, last, source);
                last.vertex = v;
                last.parent = static_cast<Index>(wedges.size());
                wedges.push_back(last);
                sizes_.push_back(kUnknownDifference);
                if constexpr (Coder::writes) coder.add_wedge(source);
                at[v].push_back(last.parent);
            } else
                std::rotate(at[v].end() - 1 - pick, at[v].end() - pick, at[v].end());
            wedge_at[h] = at[v].back();
            if (wedges[wedge_at[h]].has_uv) last.uv = wedges[wedge_at[h]].uv;
        }
        code_base_colors(map, base);
        if (base.is_damaged()) return false;
        note_rings(map, at, wedge_at);
        return true;
    }

    /// To be called before the rings split.
    void note_split(Index u, const Index* ring, std::size_t size, std::size_t begin, std::size_t sector) {
        splits_.push_back({u, static_cast<Index>(ends_.size()), static_cast<Index>(sector)});
        for (std::size_t k = 0; k <= sector; ++k) ends_.push_back(ring[(begin + k) % size]);
    }

    /// What the splits since the last time bring, the first of them the vertex `first`. False: damaged.
    bool run_batch(const VertexRings& rings, Index first) {
        at_vertex_.resize(first + splits_.size(), kNoIndex);
        if (outline.has_colors) {
            colors.resize(at_vertex_.size(), {0, 0, 0, 255});
            color_sizes_.resize(at_vertex_.size(), 0);
        }
        for (std::size_t i = 0; i < splits_.size(); ++i) {
            const auto v = static_cast<Index>(first + i);
            const Split& split = splits_[i];
            const std::span<const Index> around = std::span(ends_).subspan(split.begin, split.sector + 1);
            if (!this->split(split.u, v, around, rings)) return false;
            if (outline.has_colors) code_color(split.u, v, around, rings);
        }
        splits_.clear();
        ends_.clear();
        return !coder.is_damaged();
    }

    /// Of each corner of the surface's triangles: its wedge; kNoIndex beside holes.
    std::vector<Index> of_corners(std::span<const Triangle> triangles, const VertexRings& rings) const {
        std::vector<Index> found;
        found.reserve(3 * triangles.size());
        for (const Triangle& t : triangles) {
            const bool is_own = !rings.closes_hole(t[0]) && !rings.closes_hole(t[1]) && !rings.closes_hole(t[2]);
            for (std::size_t k = 0; k < 3; ++k)
                found.push_back(is_own ? wedge_between(t[k], t[(k + 2) % 3], t[(k + 1) % 3]) : kNoIndex);
        }
        return found;
    }

private:
    static constexpr std::uint16_t kUnknownDifference = 64;
    static constexpr Index kSeveral = Index{1} << 31; // of at_vertex_: behind it a ring's number

    /// The neighbours of a vertex with several wedges, clockwise: the triangle from this end to the next one has the
    /// wedge, kNoIndex where it closes a hole.
    struct RingCorner {
        Index end, wedge;
    };
    using WedgeRing = std::vector<RingCorner>;
    struct Split {
        Index u, begin, sector;
    };
    struct Sample {
        Index vertex, wedge;
    };

    // --- The coarsest level ---------------------------------------------------------------------------------------

    template <class BaseCoder>
    bool code_outline(BaseCoder& base) {
        std::uint32_t flags = 0;
        if constexpr (Coder::writes)
            flags = std::uint32_t{outline.has_uvs} | std::uint32_t{outline.uvs_per_vertex} << 1 |
                    std::uint32_t{outline.has_materials} << 2 | std::uint32_t{outline.has_colors} << 3 |
                    std::uint32_t{outline.has_alpha} << 4;
        flags = base.number(kBaseFlags, flags);
        if (flags > 31) return false;
        outline.has_uvs = flags & 1;
        outline.uvs_per_vertex = flags >> 1 & 1;
        outline.has_materials = flags >> 2 & 1;
        outline.has_colors = flags >> 3 & 1;
        outline.has_alpha = flags >> 4 & 1;
        if (!outline.has_uvs) return true;
        for (float* real : {&outline.uv_low[0], &outline.uv_low[1], &outline.uv_step}) {
            *real = std::bit_cast<float>(base.bits(std::bit_cast<std::uint32_t>(*real), 32));
            constexpr float kLargest = 1e30f; // so that no coordinate becomes infinite
            if (!(std::abs(*real) < kLargest)) return false;
        }
        return true;
    }

    /// last: the one before; becomes the new one.
    template <class BaseCoder>
    void code_base_wedge(BaseCoder& base, Wedge& last, Index source) {
        Wedge wedge;
        if constexpr (Coder::writes) wedge = coder.source_wedge(source);
        if (outline.has_materials) {
            const bool is_same = base.number(kBaseSame, wedge.material == last.material) != 0;
            last.material = is_same ? last.material : base.number(kBaseMaterial, wedge.material + 1) - 1;
        }
        if (!outline.has_uvs) return;
        last.has_uv = base.number(kBaseHasUv, wedge.has_uv) != 0;
        for (unsigned k = 0; k < 2 && last.has_uv; ++k) last.uv[k] = value(base, kBaseUv + k, wedge.uv[k], last.uv[k]);
    }

    template <class BaseCoder>
    void code_base_colors(const ClosedMap& map, BaseCoder& base) {
        if (!outline.has_colors) return;
        ByteColor last{0, 0, 0, 255};
        for (Index v = 0; v < map.vertex_count(); ++v) {
            if (!map.closes_hole[v]) {
                ByteColor color{};
                if constexpr (Coder::writes) color = coder.source_color(v);
                for (unsigned k = 0; k < outline.channels(); ++k)
                    last[k] = std::uint8_t(value(base, kBaseColor + k, color[k], last[k]));
            }
            colors.push_back(last);
            color_sizes_.push_back(kUnknownDifference);
        }
    }

    void note_rings(const ClosedMap& map, const std::vector<std::vector<Index>>& at,
                    const std::vector<Index>& wedge_at) {
        std::vector<Index> spokes(map.vertex_count(), kNoIndex);
        for (Index h = 0; h < map.opposite.size(); ++h) spokes[map.origin(h)] = h;
        at_vertex_.assign(map.vertex_count(), kNoIndex);
        for (Index v = 0; v < map.vertex_count(); ++v) {
            if (at[v].size() == 1) at_vertex_[v] = at[v][0];
            if (at[v].size() < 2) continue;
            WedgeRing ring;
            Index h = spokes[v];
            do {
                const Index next = map.turn_clockwise(h);
                ring.push_back({map.origin(next_half_edge(h)), wedge_at[next]});
                h = next;
            } while (h != spokes[v]);
            set_ring(v, std::move(ring));
        }
    }

    // --- Splits ---------------------------------------------------------------------------------------------------

    bool has_several(Index v) const { return at_vertex_[v] != kNoIndex && at_vertex_[v] >= kSeveral; }
    WedgeRing& ring(Index v) { return rings_[at_vertex_[v] - kSeveral]; }
    const WedgeRing& ring(Index v) const { return rings_[at_vertex_[v] - kSeveral]; }
    void set_ring(Index v, WedgeRing ring) {
        if (!has_several(v)) {
            at_vertex_[v] = kSeveral + static_cast<Index>(rings_.size());
            rings_.emplace_back();
        }
        this->ring(v) = std::move(ring);
    }
    /// Where a ring goes on from one neighbour to the next; its size: nowhere.
    static std::size_t place_of(const WedgeRing& ring, Index from, Index to) {
        std::size_t i = 0;
        while (i < ring.size() && !(ring[i].end == from && ring[(i + 1) % ring.size()].end == to)) ++i;
        return i;
    }
    /// The wedge of v in the triangle that lies clockwise between two neighbours.
    Index wedge_between(Index v, Index from, Index to) const {
        if (!has_several(v)) return at_vertex_[v];
        const std::size_t i = place_of(ring(v), from, to);
        return i < ring(v).size() ? ring(v)[i].wedge : kNoIndex;
    }

    /// A triangle of the new edge: which wedges its corners have.
    struct Side {
        Index at_u = kNoIndex, at_third = kNoIndex, at_v = kNoIndex;
        bool closes_hole = false;
    };

    /// At its third corner, what the triangles have that go over and that stay.
    struct Choice {
        Index u_moves, u_stays, third_moves, third_stays;
    };
    bool choose(Index v, bool is_left, const Choice& choice, Side& side) {
        const bool may_move = choice.u_moves != kNoIndex && choice.third_moves != kNoIndex,
                   may_stay = choice.u_stays != kNoIndex && choice.third_stays != kNoIndex;
        if (!may_move && !may_stay) return false;
        bool moves = may_move;
        if (may_move && may_stay && (choice.u_moves != choice.u_stays || choice.third_moves != choice.third_stays))
            moves = coder.moves(first_context_ + kSplitSide + is_left, v, is_left);
        side.at_u = moves ? choice.u_moves : choice.u_stays;
        side.at_third = moves ? choice.third_moves : choice.third_stays;
        return true;
    }

    bool split(Index u, Index v, std::span<const Index> around, const VertexRings& rings) {
        const std::size_t sector = around.size() - 1;
        const Index left = around[0], right = around[sector];
        const bool several = has_several(u);
        WedgeRing turned; // u's ring from `left` on
        if (several) {
            const WedgeRing& old = ring(u);
            const std::size_t at = place_of(old, left, around[1]);
            if (at == old.size() || old.size() <= sector) return false;
            for (std::size_t k = 0; k < old.size(); ++k) turned.push_back(old[(at + k) % old.size()]);
            for (std::size_t k = 0; k <= sector; ++k)
                if (turned[k].end != around[k]) return false;
        }
        const auto at_u = [&](std::size_t k) { return several ? turned[k].wedge : at_vertex_[u]; };
        const std::size_t last = several ? turned.size() - 1 : 0;

        Side l, r;
        l.closes_hole = rings.closes_hole(left);
        r.closes_hole = rings.closes_hole(right);
        if (l.closes_hole && r.closes_hole) return false;
        if (!l.closes_hole) {
            Choice choice{at_u(0), at_u(last), at_vertex_[left], at_vertex_[left]};
            if (has_several(left)) {
                const WedgeRing& there = ring(left);
                const std::size_t i = place_of(there, around[1], u);
                if (i == there.size()) return false;
                choice.third_moves = there[i].wedge;
                choice.third_stays = there[(i + 1) % there.size()].wedge;
            }
            if (!choose(v, true, choice, l)) return false;
        }
        if (!r.closes_hole) {
            Choice choice{at_u(sector - 1), at_u(several ? sector : 0), at_vertex_[right], at_vertex_[right]};
            if (has_several(right)) {
                const WedgeRing& there = ring(right);
                const std::size_t i = place_of(there, u, around[sector - 1]);
                if (i == there.size()) return false;
                choice.third_moves = there[i].wedge;
                choice.third_stays = there[(i + there.size() - 1) % there.size()].wedge;
            }
            if (!choose(v, false, choice, r)) return false;
        }

        // A new wedge for each of u's that the triangles beside the new edge have: others cannot come out of it.
        const Index parents[2] = {l.closes_hole ? r.at_u : l.at_u, r.at_u};
        const auto first = static_cast<Index>(wedges.size());
        const std::size_t count = r.closes_hole || parents[0] == parents[1] ? 1 : 2;
        const auto child = [&](Index parent) {
            for (Index k = 0; k < count; ++k)
                if (parents[k] == parent) return first + k;
            return kNoIndex;
        };
        std::vector<Index>& at_v = at_v_; // of each triangle that goes over
        at_v.resize(sector);
        for (std::size_t k = 0; k < sector; ++k) {
            at_v[k] = at_u(k) == kNoIndex ? kNoIndex : child(at_u(k));
            if (at_v[k] == kNoIndex && at_u(k) != kNoIndex) return false;
        }
        if (!several) // whether they close holes is not in a ring
            for (std::size_t k = 0; k < sector; ++k)
                if (rings.closes_hole(around[k]) || rings.closes_hole(around[k + 1])) at_v[k] = kNoIndex;
        if (!l.closes_hole) l.at_v = child(l.at_u);
        if (!r.closes_hole) r.at_v = child(r.at_u);
        if (wedges.size() + count >= kSeveral) return false;
        for (std::size_t k = 0; k < count; ++k)
            add_child(v, parents[k], samples(u, around, l, r, first + Index(k)), rings);

        if (several) {
            WedgeRing rest = {{v, r.at_u}};
            rest.insert(rest.end(), turned.begin() + std::ptrdiff_t(sector), turned.end());
            rest.push_back({left, l.at_u});
            ring(u) = std::move(rest);
        }
        if (count == 1)
            at_vertex_[v] = first;
        else {
            WedgeRing own = {{u, l.at_v}};
            for (std::size_t k = 0; k < sector; ++k) own.push_back({around[k], at_v[k]});
            own.push_back({right, r.at_v});
            set_ring(v, std::move(own));
        }
        for (std::size_t k = 1; k < sector; ++k)
            if (has_several(around[k]))
                for (RingCorner& corner : ring(around[k])) corner.end = corner.end == u ? v : corner.end;
        if (has_several(left)) {
            WedgeRing& there = ring(left);
            const std::size_t i = place_of(there, around[1], u);
            if (i == there.size()) return false; // a damaged ring has a neighbour twice
            there.insert(there.begin() + std::ptrdiff_t((i + 1) % there.size()), {v, l.at_third});
        }
        if (has_several(right)) {
            WedgeRing& there = ring(right);
            const std::size_t i = place_of(there, u, around[sector - 1]);
            if (i == there.size()) return false;
            const Index moved = there[i].wedge;
            there[i].wedge = r.at_third;
            there.insert(there.begin() + std::ptrdiff_t(i) + 1, {v, moved});
        }
        return true;
    }

    /// Neighbours of a new vertex with their wedges, in the triangles that have one of its wedges. Those in two such
    /// triangles count twice. To be called while the rings of neighbours are those from before the split.
    std::span<const Sample> samples(Index u, std::span<const Index> around, const Side& l, const Side& r, Index wedge) {
        samples_.clear();
        const auto add = [&](Index vertex, Index w) {
            if (w != kNoIndex && wedges[w].has_uv) samples_.push_back({vertex, w});
        };
        const std::size_t sector = around.size() - 1;
        if (!outline.has_uvs) return samples_;
        if (l.at_v == wedge) {
            add(u, l.at_u);
            add(around[0], l.at_third);
        }
        for (std::size_t k = 0; k < sector; ++k) {
            if (at_v_[k] != wedge) continue;
            add(around[k], wedge_between(around[k], around[k + 1], u));
            add(around[k + 1], wedge_between(around[k + 1], u, around[k]));
        }
        if (r.at_v == wedge) {
            add(around[sector], r.at_third);
            add(u, r.at_u);
        }
        return samples_;
    }

    void add_child(Index v, Index parent, std::span<const Sample> near, const VertexRings& rings) {
        Wedge wedge{v, parent, wedges[parent].material, wedges[parent].has_uv, {}};
        [[maybe_unused]] Index source = kNoIndex;
        std::array<std::int32_t, 2> known{};
        if constexpr (Coder::writes) {
            source = coder.child(v, parent);
            known = coder.source_wedge(source).uv;
            coder.add_wedge(source);
        }
        std::uint32_t off = 0;
        if (wedge.has_uv) {
            const std::array<std::int32_t, 2> expected = expected_uv(v, wedges[parent], near, rings);
            std::uint32_t size = 0;
            for (const Sample& sample : near) size += sizes_[sample.wedge];
            size = near.empty() ? kUnknownDifference : size / static_cast<std::uint32_t>(near.size());
            for (unsigned k = 0; k < 2; ++k) {
                const unsigned context = first_context_ + kSplitUv + k * kWedgeSizes + size_class(size, kWedgeSizes);
                wedge.uv[k] = value(coder, context, known[k], expected[k]);
                const auto own = static_cast<std::uint32_t>(std::abs(wedge.uv[k] - expected[k]));
                size = (size + 2 * own) / 2;
                off += own;
            }
        }
        wedges.push_back(wedge);
        sizes_.push_back(static_cast<std::uint16_t>(std::min(off, 4000u)));
    }

    /// Where the neighbours' texture coordinates, as a linear map of the surface, have the vertex.
    std::array<std::int32_t, 2> expected_uv(Index v, const Wedge& parent, std::span<const Sample> near,
                                            const VertexRings& rings) const {
        if (near.empty()) return parent.uv;
        const Reals from = reals(rings.place(v));
        Reals normal{};
        for (std::size_t i = 0; i + 1 < near.size(); ++i) {
            const Reals part =
                cross(reals(rings.place(near[i].vertex)) - from, reals(rings.place(near[i + 1].vertex)) - from);
            for (std::size_t k = 0; k < 3; ++k) normal[k] += part[k];
        }
        const SurfaceFrame frame(normal, reals(rings.place(near[0].vertex)) - from);
        double x_sum = 0, y_sum = 0, xx = 0, xy = 0, yy = 0;
        std::array<double, 2> sum{}, x_uv{}, y_uv{};
        for (const Sample& sample : near) {
            const Reals arm = reals(rings.place(sample.vertex)) - from;
            const double x = dot(arm, frame.axes[1]), y = dot(arm, frame.axes[2]);
            x_sum += x;
            y_sum += y;
            xx += x * x;
            xy += x * y;
            yy += y * y;
            for (std::size_t k = 0; k < 2; ++k) {
                const double uv = wedges[sample.wedge].uv[k];
                sum[k] += uv;
                x_uv[k] += x * uv;
                y_uv[k] += y * uv;
            }
        }
        const double share = 1 / double(near.size());
        xx -= x_sum * x_sum * share;
        xy -= x_sum * y_sum * share;
        yy -= y_sum * y_sum * share;
        constexpr double kLeast = 1e-3; // of the square of the spread: below, they lie in a line
        const double determinant = xx * yy - xy * xy, spread = xx + yy;
        std::array<std::int32_t, 2> expected{};
        for (std::size_t k = 0; k < 2; ++k) {
            const double mean = sum[k] * share;
            double there = mean;
            if (determinant > kLeast * (spread * spread)) {
                const double a = x_uv[k] - x_sum * mean, b = y_uv[k] - y_sum * mean;
                const double along_x = (a * yy - b * xy) / determinant, along_y = (b * xx - a * xy) / determinant;
                there = mean - (along_x * x_sum + along_y * y_sum) * share;
            }
            expected[k] = to_fine(there);
        }
        return expected;
    }

    void code_color(Index u, Index v, std::span<const Index> around, const VertexRings& rings) {
        std::array<std::uint32_t, 4> sum{};
        std::uint32_t count = 0, size = 0;
        const auto add = [&](Index near) {
            if (rings.closes_hole(near)) return;
            for (std::size_t k = 0; k < 4; ++k) sum[k] += colors[near][k];
            size += color_sizes_[near];
            ++count;
        };
        add(u);
        for (const Index near : around) add(near);
        ByteColor known{};
        if constexpr (Coder::writes) known = coder.source_color(v);
        size /= count; // u closes no hole
        std::uint32_t off = 0;
        for (unsigned k = 0; k < outline.channels(); ++k) {
            const auto expected = std::int32_t((sum[k] + count / 2) / count);
            const unsigned context = first_context_ + kSplitColor + k * kWedgeSizes + size_class(size, kWedgeSizes);
            const std::int32_t there = value(coder, context, known[k], expected);
            colors[v][k] = std::uint8_t(there);
            const auto own = static_cast<std::uint32_t>(std::abs(std::int32_t(colors[v][k]) - expected));
            size = (size + own) / 2;
            off += own;
        }
        color_sizes_[v] = static_cast<std::uint16_t>(off / 2);
    }

    /// A value by how far it is from where it is expected.
    template <class Numbers>
    static std::int32_t value(Numbers& numbers, unsigned context, std::int32_t known, std::int32_t expected) {
        const auto off = std::int32_t(numbers.number_with_sign(context, known - expected));
        constexpr std::int32_t kMost = kFarthest - 1;
        return std::clamp(std::int32_t(std::uint32_t(expected) + std::uint32_t(off)), -kMost, kMost);
    }

    unsigned first_context_;
    std::vector<Index> at_vertex_; ///< of each vertex: its wedge, or its ring of several; kNoIndex: it has none
    std::vector<WedgeRing> rings_;
    std::vector<std::uint16_t> sizes_, color_sizes_; ///< of differences: of each wedge, of each vertex
    std::vector<Split> splits_;
    std::vector<Index> ends_; ///< of the splits: neighbours of what comes, from the left to the right
    std::vector<Index> at_v_; ///< of the split that is taken
    std::vector<Sample> samples_;
};

} // namespace filigree
