// The walk that a writer and a reader of levels do alike: over vertices that may split, and what is known of each.
#pragma once

#include "filigree/coding/geometry_code.h"
#include "filigree/coding/integer_frame.h"

#include <algorithm>
#include <array>

namespace filigree {

// Contexts. Whether a vertex splits, and how, goes with its degree.
inline constexpr unsigned kDegrees = 10, kRingSizes = 12, kLevelSizeClasses = 16;
inline constexpr unsigned kWhich = 0, kSector = kWhich + kDegrees, kBegin = kSector + kRingSizes,
                          kPlace = kBegin + kRingSizes, kLevelContexts = kPlace + 3 * kLevelSizeClasses;
inline constexpr unsigned kRefinementContexts = 3;
inline constexpr std::int32_t kRoughOne = 127;       // length of a rough frame's axes
inline constexpr std::size_t kLongestSplitRing = 48; // of a vertex that may split
inline constexpr std::int32_t kUnknownSize = 256;

/// The half-edges from a vertex, clockwise, and how it lies among its neighbours.
struct SplitRing {
    std::array<Index, kLongestSplitRing> half_edges, ends;
    std::size_t size = 0;
    std::size_t ahead = 0; ///< the neighbour farthest towards their middle: there the vertex that comes is expected
};

/// A frame for what is more precise than steps: the first axes, in bytes.
struct RoughFrame {
    std::array<std::array<std::int8_t, 3>, 2> axes;

    explicit RoughFrame(const Frame& frame) {
        for (std::size_t k = 0; k < 2; ++k)
            for (std::size_t j = 0; j < 3; ++j) axes[k][j] = std::int8_t(divide(frame.axes[k][j] * kRoughOne, kOne));
    }
    Wide axis(std::size_t k) const {
        const Wide a{axes[0][0], axes[0][1], axes[0][2]}, b{axes[1][0], axes[1][1], axes[1][2]};
        if (k < 2) return k == 0 ? a : b;
        Wide third = cross(a, b);
        for (std::int64_t& x : third) x = divide(x, kRoughOne);
        return third;
    }
};

/// A surface that grows by splits. `Coder` writes them, looking into a map, or reads them.
template <class Coder>
class LevelWalk {
public:
    LevelWalk(Coder& with, GeometrySteps steps, bool is_refined)
        : coder(with), steps_{steps.normal, steps.tangential, steps.tangential}, keeps_frames_(is_refined) {}

    ClosedMap map;
    std::vector<FinePlace> places;
    std::vector<Index> parents;
    std::vector<RoughFrame> frames; ///< of each vertex but the coarsest's, where levels are refined
    Coder& coder;

    void begin(ClosedMap coarsest, std::vector<FinePlace> coarsest_places) {
        map = std::move(coarsest);
        places = std::move(coarsest_places);
        spokes_.assign(map.vertex_count(), kNoIndex);
        sizes_.assign(map.vertex_count(), kUnknownSize);
        degrees_.assign(map.vertex_count(), 0);
        for (Index h = 0; h < map.opposite.size(); ++h) {
            spokes_[map.origin(h)] = h;
            ++degrees_[map.origin(h)];
        }
        for (Index v = 0; v < map.vertex_count(); ++v) parents.push_back(v);
    }

    /// False: damaged.
    bool run_batch(std::size_t most_vertices) {
        const auto count = static_cast<Index>(map.vertex_count());
        SplitRing ring;
        for (Index u = 0; u < count; ++u) {
            if (map.closes_hole[u] || degrees_[u] > kLongestSplitRing || degrees_[u] < 2) continue;
            if (!coder.splits(which_context(u), u)) continue;
            if (map.vertex_count() >= most_vertices) return false;
            read_ring(u, ring);
            const std::size_t size_class = std::min<std::size_t>(ring.size, kRingSizes + 1) - 2;
            const std::size_t sector = coder.sector(kSector + unsigned(size_class), ring);
            if (sector == 0 || sector >= ring.size) return false;
            const std::size_t expected = (ring.ahead + ring.size - sector / 2) % ring.size;
            const std::size_t begin = coder.begin(kBegin + unsigned(size_class), ring, expected);
            if (begin >= ring.size || coder.is_damaged()) return false;
            split(u, ring, begin, sector);
        }
        return !coder.is_damaged();
    }

private:
    Wide at(Index v) const { return {places[v][0], places[v][1], places[v][2]}; }

    void read_ring(Index u, SplitRing& ring) const {
        ring.size = 0;
        Wide middle{};
        std::array<Wide, kLongestSplitRing> arms;
        const Wide from = at(u);
        for (Index h = spokes_[u]; ring.size < degrees_[u]; h = map.turn_clockwise(h)) {
            const Index end = map.origin(ClosedMap::next(h));
            Wide& arm = arms[ring.size];
            arm = map.closes_hole[end] ? Wide{} : at(end) - from;
            for (std::size_t k = 0; k < 3; ++k) middle[k] += arm[k];
            ring.half_edges[ring.size] = h;
            ring.ends[ring.size++] = end;
        }
        std::int64_t farthest = dot(arms[0], middle);
        ring.ahead = 0;
        for (std::size_t k = 1; k < ring.size; ++k) {
            const std::int64_t far = dot(arms[k], middle);
            if (far > farthest) {
                farthest = far;
                ring.ahead = k;
            }
        }
    }

    unsigned which_context(Index u) const { return kWhich + std::clamp(degrees_[u], 3u, kDegrees + 2) - 3; }

    /// The `sector` triangles from the ring's half-edge `begin` on become the new vertex's.
    void split(Index u, const SplitRing& ring, std::size_t begin, std::size_t sector) {
        const auto v = static_cast<Index>(map.vertex_count());
        const std::size_t end = (begin + sector) % ring.size;
        const Index left = ring.ends[begin], right = ring.ends[end];
        const Index out_left = ring.half_edges[begin], in_left = map.opposite[out_left];
        const Index out_right = ring.half_edges[end], in_right = map.opposite[out_right];
        for (std::size_t k = 1; k <= sector; ++k) {
            const Index h = ring.half_edges[(begin + k) % ring.size];
            map.triangles[h / 3][h % 3] = v;
        }
        const auto a = static_cast<Index>(3 * map.triangles.size()), b = a + 3;
        map.triangles.push_back({u, v, left});
        map.triangles.push_back({u, right, v});
        map.opposite.resize(map.opposite.size() + 6);
        glue(a, b + 2);
        glue(a + 1, in_left);
        glue(a + 2, out_left);
        glue(b, in_right);
        glue(b + 1, out_right);
        spokes_[u] = a;
        spokes_.push_back(b + 2);
        degrees_[u] = static_cast<std::uint32_t>(ring.size - sector + 2);
        degrees_.push_back(static_cast<std::uint32_t>(sector + 2));
        ++degrees_[left];
        ++degrees_[right];
        map.closes_hole.push_back(false);
        parents.push_back(u);
        coder.did_split(u, v, a, b);
        place(u, v, ring, begin, sector);
    }
    void glue(Index a, Index b) {
        map.opposite[a] = b;
        map.opposite[b] = a;
    }

    /// Where the new vertex is: in the middle of its neighbours, and so many steps from there.
    void place(Index u, Index v, const SplitRing& ring, std::size_t begin, std::size_t sector) {
        std::array<Wide, kLongestSplitRing + 1> around;
        std::size_t count = 0;
        std::int64_t size = 0;
        const auto meet = [&](Index w) {
            if (map.closes_hole[w]) return;
            around[count++] = at(w);
            size += sizes_[w];
        };
        meet(u);
        for (std::size_t k = 0; k <= sector; ++k) meet(ring.ends[(begin + k) % ring.size]);
        Wide expected{}, normal{};
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t k = 0; k < 3; ++k) expected[k] += around[i][k];
        for (std::int64_t& x : expected) x = divide(x, std::int64_t(count));
        for (std::size_t i = 0; i < count; ++i) {
            const Wide part = cross(around[i] - expected, around[(i + 1) % count] - expected);
            for (std::size_t k = 0; k < 3; ++k) normal[k] += part[k];
        }
        const Frame frame(normal, expected - at(u));
        if (keeps_frames_) frames.emplace_back(frame);

        std::array<std::int32_t, 3> steps{};
        std::int64_t so_far = size / std::int64_t(count), all = 0; // quarters of a step
        Wide place = expected;
        for (std::size_t k = 0; k < 3; ++k) {
            const unsigned context =
                kPlace + unsigned(k) * kLevelSizeClasses + size_class(std::uint32_t(so_far), kLevelSizeClasses);
            steps[k] = coder.step(context, v, expected, frame.axes[k], std::int64_t{steps_[k]} * kFine);
            const std::int64_t own = 4 * std::int64_t{std::abs(steps[k])};
            so_far = k == 0 ? (3 * so_far + 2 * own) / 4 : (so_far + own) / 2;
            all += own;
            for (std::size_t j = 0; j < 3; ++j)
                place[j] += divide_by_one(std::int64_t{steps[k]} * steps_[k] * kFine * frame.axes[k][j]);
        }
        for (std::int64_t& x : place) x = std::clamp<std::int64_t>(x, -kFarthest, kFarthest);
        places.push_back({std::int32_t(place[0]), std::int32_t(place[1]), std::int32_t(place[2])});
        sizes_.push_back(std::int32_t(std::min<std::int64_t>(all / 3, 1 << 20)));
    }

    std::array<std::int32_t, 3> steps_;
    bool keeps_frames_;
    std::vector<Index> spokes_;          ///< a half-edge from each vertex
    std::vector<std::int32_t> sizes_;    ///< of each vertex's difference, quarters of a step
    std::vector<std::uint32_t> degrees_; ///< of each vertex
};

/// Makes places more precise by a quarter of what the levels' steps leave open, along each axis: two bits.
/// `code(axis, place, along, size)` is which quarter, -2 to 1.
template <class Code>
void refine(std::span<const RoughFrame> frames, std::span<FinePlace> places, const Code& code) {
    for (std::size_t v = 0; v < places.size(); ++v) {
        Wide shift{};
        for (std::size_t k = 0; k < 3; ++k) {
            const Wide axis = frames[v].axis(k);
            const std::int64_t quarter = std::clamp<std::int64_t>(code(v, k, axis), -8, 7);
            for (std::size_t j = 0; j < 3; ++j) shift[j] += (2 * quarter + 1) * axis[j];
        }
        for (std::size_t j = 0; j < 3; ++j)
            places[v][j] = std::int32_t(std::clamp<std::int64_t>(places[v][j] + divide(shift[j] * kFine, 2 * kRoughOne),
                                                                 -kFarthest, kFarthest));
    }
}

} // namespace filigree
