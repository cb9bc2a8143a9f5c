#include "filigree/coding/geometry_code.h"

#include "filigree/coding/integer_frame.h"

#include <algorithm>
#include <cstdlib>

namespace filigree {

namespace {

constexpr unsigned kSizeClasses = 16, kSupport = 3;
static_assert(3 * kSizeClasses * kSupport <= kGeometryContexts);

/// Visits vertices, best known first. `Coder` says where each is, given what is expected.
template <class Coder>
class Traversal {
public:
    Traversal(const ClosedMap& map, GeometrySteps steps, bool is_turned, Coder& coder)
        : map_(map), coder_(coder), is_turned_(is_turned), steps_{steps.normal, steps.tangential, steps.tangential},
          places_(map.vertex_count()), sizes_(map.vertex_count(), 0), expected_(map.vertex_count()),
          is_known_(map.vertex_count(), false), spoke_(map.vertex_count(), kNoIndex),
          known_corners_(map.triangles.size(), 0) {
        for (Index h = 0; h < map.opposite.size(); ++h) spoke_[map.origin(h)] = h;
        for (std::size_t t = 0; t < map.triangles.size(); ++t)
            if (!map.is_own(map.triangles[t])) known_corners_[t] = kClosesHole;
    }

    std::vector<FinePlace> run() {
        Index last = kNoIndex;
        for (Index v = 0; v < map_.vertex_count(); ++v) {
            if (is_known_[v] || map_.closes_hole[v]) continue;
            visit_first(v, last);
            last = v;
            for (Index w = next_vertex(); w != kNoIndex; w = next_vertex()) {
                visit(w);
                last = w;
            }
            if (coder_.is_damaged()) break;
        }
        return std::move(places_);
    }

private:
    static constexpr std::size_t kTurns = 4;
    static constexpr std::uint8_t kClosesHole = 4; // instead of a triangle's known corners

    /// What the known triangles beside a vertex say of it, added up. Places that make sense do not leave 32 bits.
    struct alignas(64) Expectation {
        Wide normal{};
        std::array<std::uint32_t, 3> sum{}, ahead{};
        std::uint32_t size = 0, count = 0;
    };
    static constexpr std::uint32_t kMostSupport = 200;

    static Wide wide(const std::array<std::uint32_t, 3>& a) {
        return {std::int32_t(a[0]), std::int32_t(a[1]), std::int32_t(a[2])};
    }
    Wide at(Index v) const { return {places_[v][0], places_[v][1], places_[v][2]}; }

    Index next_vertex() {
        for (std::size_t turn = kTurns; turn-- > 1;)
            while (!turns_[turn].empty()) {
                const Index v = turns_[turn].back();
                turns_[turn].pop_back();
                if (!is_known_[v] && std::min<std::size_t>(expected_[v].count, kTurns - 1) == turn) return v;
            }
        return kNoIndex;
    }

    /// One that no known triangle lies beside: it goes by a known neighbour, or by the one before.
    void visit_first(Index v, Index last) {
        Wide expected{};
        Index near = last;
        for (Index h = spoke_[v];;) {
            const Index w = map_.origin(ClosedMap::next(h));
            if (is_known_[w]) near = w;
            h = map_.turn_clockwise(h);
            if (h == spoke_[v]) break;
        }
        if (near != kNoIndex) expected = at(near);
        code(v, expected, Frame(), near != kNoIndex ? sizes_[near] : 0, 0);
    }

    void visit(Index v) {
        const Expectation& e = expected_[v];
        Wide expected{};
        for (std::size_t k = 0; k < 3; ++k) expected[k] = divide(std::int32_t(e.sum[k]), e.count);
        code(v, expected, is_turned_ ? Frame(e.normal, wide(e.ahead)) : Frame(), std::int32_t(e.size / (3 * e.count)),
             std::min<unsigned>(e.count, kSupport) - 1);
    }

    void code(Index v, const Wide& expected, const Frame& frame, std::int32_t size, unsigned support) {
        std::array<std::int32_t, 3> steps{};
        std::int64_t so_far = size; // what differences to expect, in quarters of a step
        for (std::size_t k = 0; k < 3; ++k) {
            const unsigned size_context = unsigned(size_class(std::uint32_t(so_far), kSizeClasses));
            steps[k] = coder_.step(v, expected, frame.axes[k], std::int64_t{steps_[k]} * kFine,
                                   unsigned(k * kSizeClasses + size_context) * kSupport + support);
            const std::int64_t own = 4 * std::int64_t{std::abs(steps[k])};
            so_far = k == 0 ? (3 * so_far + 2 * own) / 4 : (so_far + own) / 2;
        }
        std::int64_t all = 0;
        Wide place = expected;
        for (std::size_t k = 0; k < 3; ++k) {
            all += std::abs(std::int64_t{steps[k]});
            for (std::size_t j = 0; j < 3; ++j)
                place[j] += divide_by_one(std::int64_t{steps[k]} * steps_[k] * kFine * frame.axes[k][j]);
        }
        for (std::size_t j = 0; j < 3; ++j)
            places_[v][j] = std::int32_t(std::clamp<std::int64_t>(place[j], -kFarthest, kFarthest));
        sizes_[v] = std::int32_t(std::min<std::int64_t>(4 * all / 3, 1 << 20));
        is_known_[v] = true;
        tell_neighbours(v);
    }

    /// The triangles that are known through v are beside others.
    void tell_neighbours(Index v) {
        for (Index h = spoke_[v];;) {
            std::uint8_t& known = known_corners_[h / 3];
            if (known != kClosesHole && ++known == 3) tell_beside(h / 3);
            h = map_.turn_clockwise(h);
            if (h == spoke_[v]) break;
        }
    }

    void tell_beside(Index triangle) {
        const Triangle& t = map_.triangles[triangle];
        const std::array<Wide, 3> corner = {at(t[0]), at(t[1]), at(t[2])};
        const Wide normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
        const auto size = std::uint32_t(sizes_[t[0]] + sizes_[t[1]] + sizes_[t[2]]);
        for (Index k = 0; k < 3; ++k) {
            const Index across = map_.opposite[3 * triangle + k];
            const Index w = map_.origin(ClosedMap::previous(across));
            if (is_known_[w] || known_corners_[across / 3] == kClosesHole) continue;
            const Wide &a = corner[k], &b = corner[(k + 1) % 3], &c = corner[(k + 2) % 3];
            Expectation& e = expected_[w];
            if (e.count >= kMostSupport) continue;
            for (std::size_t j = 0; j < 3; ++j) {
                e.sum[j] += std::uint32_t(a[j] + b[j] - c[j]);
                e.ahead[j] += std::uint32_t(a[j] + b[j] - 2 * c[j]);
                e.normal[j] += normal[j];
            }
            e.size += size;
            ++e.count;
            turns_[std::min<std::size_t>(e.count, kTurns - 1)].push_back(w);
        }
    }

    const ClosedMap& map_;
    Coder& coder_;
    bool is_turned_;
    std::array<std::int32_t, 3> steps_;
    std::vector<FinePlace> places_;
    std::vector<std::int32_t> sizes_; ///< of each vertex's difference, quarters of a step
    std::vector<Expectation> expected_;
    std::vector<bool> is_known_;
    std::vector<Index> spoke_;                ///< a half-edge from each vertex
    std::vector<std::uint8_t> known_corners_; ///< of each triangle
    std::array<std::vector<Index>, kTurns> turns_;
};

class PlaceWriter {
public:
    PlaceWriter(std::span<const FinePlace> places, unsigned first, SymbolWriter& out)
        : places_(places), first_(first), out_(out) {}
    bool is_damaged() const { return false; }
    std::int32_t step(Index v, const Wide& expected, const Wide& axis, std::int64_t size, unsigned context) {
        const Wide place = {places_[v][0], places_[v][1], places_[v][2]};
        const auto steps = std::int32_t(divide(dot(place - expected, axis), size * kOne));
        out_.number_with_sign(first_ + context, steps);
        return steps;
    }

private:
    std::span<const FinePlace> places_;
    unsigned first_;
    SymbolWriter& out_;
};

class PlaceReader {
public:
    PlaceReader(unsigned first, SymbolReader& in) : first_(first), in_(in) {}
    bool is_damaged() const { return in_.is_damaged(); }
    std::int32_t step(Index, const Wide&, const Wide&, std::int64_t, unsigned context) {
        return std::clamp(in_.number_with_sign(first_ + context), -kFarthest, kFarthest);
    }

private:
    unsigned first_;
    SymbolReader& in_;
};

} // namespace

std::vector<FinePlace> encode_geometry(const ClosedMap& map, std::span<const FinePlace> places, GeometrySteps steps,
                                       unsigned first_context, SymbolWriter& out) {
    return encode_shorter(steps, out, [&](SymbolWriter& trial, bool is_turned) {
        PlaceWriter writer(places, first_context, trial);
        return Traversal<PlaceWriter>(map, steps, is_turned, writer).run();
    });
}

std::vector<FinePlace> decode_geometry(const ClosedMap& map, GeometrySteps steps, unsigned first_context,
                                       SymbolReader& in) {
    const bool is_turned = in.bits(1) != 0;
    PlaceReader reader(first_context, in);
    return Traversal<PlaceReader>(map, steps, is_turned, reader).run();
}

} // namespace filigree
