// The walk that a writer and a reader of levels do alike: over vertices that may split, and what is known of each.
#pragma once

#include "filigree/pack/geometry_code.h"
#include "filigree/pack/level_wedges.h"
#include "filigree/pack/surface_frame.h"
#include "filigree/pack/vertex_rings.h"

#include <algorithm>
#include <array>

namespace filigree {

// Contexts. Whether a vertex splits, and how, goes with its degree.
inline constexpr unsigned kDegrees = 10, kRingSizes = 12, kLevelSizeClasses = 16;
inline constexpr unsigned kWhich = 0, kSector = kWhich + kDegrees, kBegin = kSector + kRingSizes,
                          kPlace = kBegin + kRingSizes, kFirstOfWedges = kPlace + 3 * kLevelSizeClasses,
                          kLevelContexts = kFirstOfWedges + kSplitContexts;
inline constexpr unsigned kQuarterBits = 2;    // of refinements, along each axis
inline constexpr std::int32_t kRoughOne = 127; // length of a rough frame's axes
inline constexpr std::int32_t kUnknownSize = 256;

/// The neighbours of a vertex, clockwise, and how it lies among them.
struct SplitRing {
    const Index* ends;
    std::size_t size;
    std::size_t ahead; ///< the neighbour farthest towards their middle: there the vertex that comes is expected
};

/// A frame for what is more precise than steps: the first axes, in bytes.
struct RoughFrame {
    std::array<std::array<std::int8_t, 3>, 2> axes;

    RoughFrame() = default;
    explicit RoughFrame(const SurfaceFrame& frame) {
        for (std::size_t k = 0; k < 2; ++k)
            for (std::size_t j = 0; j < 3; ++j) axes[k][j] = std::int8_t(to_fine(frame.axes[k][j] * kRoughOne));
    }
    /// All three, as long as a quarter of a step is.
    std::array<Reals, 3> quarters() const {
        constexpr double kQuarter = double(kFine) / kRoughOne;
        const Reals a{double(axes[0][0]), double(axes[0][1]), double(axes[0][2])};
        const Reals b{double(axes[1][0]), double(axes[1][1]), double(axes[1][2])};
        return {a * kQuarter, b * kQuarter, cross(a, b) * (kQuarter / kRoughOne)};
    }
};

/// A surface that grows by splits. `Coder` writes them, looking into a map, or reads them.
template <class Coder>
class LevelWalk {
public:
    LevelWalk(Coder& with, GeometrySteps steps, bool is_refined)
        : coder(with), steps_{double(steps.normal * kFine), double(steps.tangential * kFine),
                              double(steps.tangential * kFine)},
          keeps_frames_(is_refined) {}

    VertexRings rings;
    std::vector<Index> parents;
    std::vector<RoughFrame> frames; ///< of each vertex but the coarsest's, where levels are refined
    Coder& coder;
    LevelWedges<Coder> wedges{coder, kFirstOfWedges}; ///< none where the surface has no attributes

    void begin(const ClosedMap& coarsest, std::span<const FinePlace> coarsest_places) {
        rings = VertexRings(coarsest, coarsest_places, kUnknownSize);
        for (Index v = 0; v < rings.vertex_count(); ++v) parents.push_back(v);
        order_ = parents;
    }

    /// Which vertices split, how, and where the new ones are: one after the other, for all of the batch. False:
    /// damaged.
    bool run_batch(std::size_t most_vertices) {
        known_ = rings.vertex_count();
        find_splits();
        if (coder.is_damaged() || known_ + splitting_.size() > most_vertices) return false;
        make_room();
        around_.clear();
        for (std::size_t i = 0; i < splitting_.size(); ++i) {
            if (i + 2 * kAhead < splitting_.size()) {
                rings.fetch(splitting_[i + 2 * kAhead]);
                rings.fetch_ring(splitting_[i + kAhead]);
            }
            if (!split(splitting_[i], static_cast<Index>(known_ + i))) return false;
        }
        if (coder.is_damaged()) return false;
        place_new();
        if (wedges.has_any() && !wedges.run_batch(rings, static_cast<Index>(known_))) return false;
        return !coder.is_damaged();
    }

private:
    static constexpr std::size_t kAhead = 6; // so many splits ahead memory is asked for

    void find_splits() {
        order_before_.swap(order_);
        order_.resize(2 * known_ + 2);
        splitting_.resize(known_ + 1);
        std::size_t count = 0, at = 0;
        for (const Index u : order_before_) {
            const std::uint32_t degree = rings.size(u);
            const bool splits =
                degree <= VertexRings::kLongest && degree >= 2 && coder.splits(which_context(degree), u);
            order_[at] = splitting_[count] = u; // what does not split is overwritten: which it is cannot be guessed
            order_[at + 1] = static_cast<Index>(known_ + count);
            at += splits ? 2 : 1;
            count += splits;
        }
        order_.resize(at);
        splitting_.resize(count);
    }
    static unsigned which_context(std::uint32_t degree) { return kWhich + std::clamp(degree, 3u, kDegrees + 2) - 3; }

    /// For what splits bring.
    void make_room() {
        const std::size_t more = splitting_.size();
        rings.add(more);
        parents.insert(parents.end(), splitting_.begin(), splitting_.end());
        if (keeps_frames_) frames.resize(frames.size() + more);
    }

    /// False: damaged.
    bool split(Index u, Index v) {
        if (!rings.is_kept(u)) return false;
        const SplitRing ring = ring_of(u);
        const std::size_t size_class = std::min<std::size_t>(ring.size, kRingSizes + 1) - 2;
        const std::size_t sector = coder.sector(kSector + unsigned(size_class), u);
        if (sector == 0 || sector >= ring.size) return false;
        const std::size_t expected = (ring.ahead + ring.size - sector / 2) % ring.size;
        const std::size_t begin = coder.begin(kBegin + unsigned(size_class), ring, expected);
        if (begin >= ring.size) return false;
        note_around(u, ring, begin, sector);
        if (wedges.has_any()) wedges.note_split(u, ring.ends, ring.size, begin, sector);
        coder.did_split(v);
        return rings.split(u, v, begin, sector);
    }

    SplitRing ring_of(Index u) const {
        SplitRing ring{rings.ends(u), rings.size(u), 0};
        std::array<FinePlace, VertexRings::kLongest> arms;
        FinePlace middle{};
        const FinePlace from = rings.place(u);
        for (std::size_t i = 0; i < ring.size; ++i) {
            const Index end = ring.ends[i];
            const bool counts = end < known_ && !rings.closes_hole(end); // where what is new is comes later
            for (std::size_t k = 0; k < 3; ++k) {
                arms[i][k] = counts ? rings.place(end)[k] - from[k] : 0;
                middle[k] += arms[i][k];
            }
        }
        std::int64_t farthest = along(arms[0], middle);
        for (std::size_t i = 1; i < ring.size; ++i) {
            const std::int64_t far = along(arms[i], middle);
            ring.ahead = far > farthest ? i : ring.ahead;
            farthest = std::max(far, farthest);
        }
        return ring;
    }
    static std::int64_t along(const FinePlace& a, const FinePlace& b) {
        return std::int64_t{a[0]} * b[0] + std::int64_t{a[1]} * b[1] + std::int64_t{a[2]} * b[2];
    }

    /// For place(): how many neighbours the new vertex has that close no hole, and which.
    void note_around(Index u, const SplitRing& ring, std::size_t begin, std::size_t sector) {
        const std::size_t at = around_.size();
        around_.resize(at + sector + 3);
        Index* next = around_.data() + at + 1;
        *next++ = u;
        for (std::size_t k = 0, i = begin; k <= sector; ++k, i = i + 1 < ring.size ? i + 1 : 0) {
            *next = ring.ends[i];
            next += !rings.closes_hole(ring.ends[i]);
        }
        around_[at] = static_cast<Index>(next - (around_.data() + at + 1));
        around_.resize(std::size_t(next - around_.data()));
    }

    void place_new() {
        const Index *ring = around_.data(), *asked = ring, *const end = ring + around_.size();
        for (std::size_t i = 0; i < splitting_.size() + kAhead; ++i) {
            if (asked != end) asked = ask_for(asked);
            if (i >= kAhead) ring = place(static_cast<Index>(known_ + i - kAhead), ring);
        }
    }
    /// Asks for memory that place() of this ring wants. Returns the next ring.
    const Index* ask_for(const Index* ring) const {
        const std::size_t count = *ring++;
        for (std::size_t i = 0; i < count; ++i) rings.fetch(ring[i]);
        return ring + count;
    }

    /// Where a new vertex is: in the middle of its neighbours, and so many steps from there. Returns the next ring.
    const Index* place(Index v, const Index* ring) {
        const std::size_t count = *ring++;
        const FinePlace from = rings.place(ring[0]);
        auto size = std::uint32_t(rings.difference(ring[0]));
        Reals sum{}, normal{}, before{};
        for (std::size_t i = 1; i < count; ++i) {
            const FinePlace& p = rings.place(ring[i]);
            const Reals arm = {double(p[0] - from[0]), double(p[1] - from[1]), double(p[2] - from[2])};
            const Reals part = cross(before, arm);
            for (std::size_t k = 0; k < 3; ++k) {
                sum[k] += arm[k];
                normal[k] += part[k];
            }
            before = arm;
            size += std::uint32_t(rings.difference(ring[i]));
        }
        const Reals ahead = sum * kOneOf[count];
        const Reals expected = {from[0] + ahead[0], from[1] + ahead[1], from[2] + ahead[2]};
        const SurfaceFrame frame(normal, ahead);
        if (keeps_frames_) frames[frames.size() - (known_ + splitting_.size() - v)] = RoughFrame(frame);
        const SteppedPlace stepped = step_to_place<kLevelSizeClasses>(
            expected, frame, steps_, size / std::uint32_t(count), [&](std::size_t k, unsigned size_class) {
                const unsigned context = kPlace + unsigned(k) * kLevelSizeClasses + size_class;
                return coder.step(context, v, expected, frame.axes[k], steps_[k]);
            });
        rings.place(v) = stepped.place;
        rings.difference(v) = stepped.size;
        return ring + count;
    }

    Reals steps_; ///< sizes along the frame's axes, in sixteenths
    bool keeps_frames_;
    std::size_t known_ = 0; ///< vertices before the batch
    /// Vertices, each behind the one that it came from: neighbours are near each other in it, and in what comes of it.
    std::vector<Index> order_, order_before_;
    std::vector<Index> splitting_, around_; ///< of the batch: what splits; the new vertices' neighbours, for place()
};

/// Makes places from `begin` on more precise by a quarter of what the levels' steps leave open, along each axis: two
/// bits. `code(vertex, axes)` is which quarters, -2 to 1.
template <class Code>
void refine(std::span<const RoughFrame> frames, VertexRings& rings, std::size_t begin, const Code& code) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const std::array<Reals, 3> axes = frames[i].quarters();
        FinePlace& fine = rings.place(static_cast<Index>(begin + i));
        const std::array<std::int32_t, 3> quarters = code(begin + i, axes);
        Reals place = reals(fine);
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t j = 0; j < 3; ++j) place[j] += (quarters[k] + 0.5) * axes[k][j];
        fine = {to_fine(place[0]), to_fine(place[1]), to_fine(place[2])};
    }
}

} // namespace filigree
