#include "filigree/coding/geometry_code.h"

#include "filigree/coding/surface_frame.h"

#include <algorithm>
#include <memory>

namespace filigree {

namespace {

constexpr unsigned kSizeClasses = 16, kSupport = 3;
static_assert(3 * kSizeClasses * kSupport <= kGeometryContexts);

/// Visits vertices, best known first. `Coder` says where each is, given what is expected.
template <class Coder>
class Traversal {
public:
    Traversal(const ClosedMap& map, GeometrySteps steps, bool is_turned, Coder& coder)
        : map_(map), coder_(coder),
          is_turned_(is_turned), steps_{double(steps.normal * kFine), double(steps.tangential * kFine),
                                        double(steps.tangential * kFine)},
          known_(map.vertex_count()), is_known_(map.vertex_count(), false), around_(map.vertex_count()),
          spoke_(map.vertex_count(), kNoIndex) {
        for (Index h = 0; h < map.opposite.size(); ++h) spoke_[map.origin(h)] = h;
        for (std::size_t v = 0; v < is_known_.size(); ++v) is_known_[v] = map.closes_hole[v]; // they are not visited
        for (auto& turn : turns_) turn = std::make_unique_for_overwrite<Index[]>(map.opposite.size() + 1);
    }

    std::vector<FinePlace> run() {
        Index last = kNoIndex;
        for (Index v = 0; v < map_.vertex_count(); ++v) {
            if (is_known_[v]) continue;
            visit_first(v, last);
            last = v;
            for (Index w = next_vertex(); w != kNoIndex; w = next_vertex()) {
                visit(w);
                last = w;
            }
            if (coder_.is_damaged()) break;
        }
        std::vector<FinePlace> places;
        places.reserve(known_.size());
        for (const SteppedPlace& v : known_) places.push_back(v.place);
        return places;
    }

private:
    static constexpr std::size_t kTurns = 4, kMostBeside = 7;

    /// The known triangles beside a vertex, by the half-edges that face it: the first ones, and the last.
    struct alignas(32) Beside {
        std::array<Index, kMostBeside> half_edges;
        std::uint32_t count = 0; ///< kMostBeside where there are more
    };

    Index next_vertex() {
        for (std::size_t turn = kTurns; turn-- > 1;)
            while (turn_sizes_[turn] > 0) {
                const Index v = turns_[turn][--turn_sizes_[turn]];
                if (!is_known_[v] && std::min<std::size_t>(around_[v].count, kTurns - 1) == turn) return v;
            }
        return kNoIndex;
    }

    /// One that no known triangle lies beside: it goes by a known neighbour, or by the one before.
    void visit_first(Index v, Index last) {
        Index near = last;
        for (Index h = spoke_[v];;) {
            if (is_own(next_half_edge(h))) near = map_.origin(next_half_edge(h));
            h = map_.turn_clockwise(h);
            if (h == spoke_[v]) break;
        }
        const SteppedPlace from = near != kNoIndex ? known_[near] : SteppedPlace{};
        code(v, reals(from.place), SurfaceFrame(), std::uint32_t(from.size), 0);
        for (Index h = spoke_[v];;) {
            if (is_own(next_half_edge(h)) && is_own(previous_half_edge(h)))
                for (Index k = 0; k < 3; ++k) tell_across(h / 3 * 3 + k);
            h = map_.turn_clockwise(h);
            if (h == spoke_[v]) break;
        }
    }
    bool is_own(Index half_edge) const {
        const Index v = map_.origin(half_edge);
        return is_known_[v] && !map_.closes_hole[v];
    }

    /// It is expected in the middle of what the known triangles beside it say.
    void visit(Index v) {
        const Beside& beside = around_[v];
        FinePlace sum{}, ahead{};
        Reals normal{};
        std::uint32_t size = 0;
        for (std::uint32_t i = 0; i < beside.count; ++i) {
            const Index h = beside.half_edges[i], triangle = h / 3, k = h % 3;
            const Triangle& t = map_.triangles[triangle];
            const SteppedPlace &from = known_[t[k]], &to = known_[t[(k + 1) % 3]], &behind = known_[t[(k + 2) % 3]];
            Reals out, back;
            for (std::size_t j = 0; j < 3; ++j) {
                const std::int32_t along = to.place[j] - from.place[j], away = behind.place[j] - from.place[j];
                sum[j] += to.place[j] - away;
                ahead[j] += along - 2 * away;
                out[j] = along;
                back[j] = away;
            }
            const Reals part = cross(out, back);
            for (std::size_t j = 0; j < 3; ++j) normal[j] += part[j];
            size += std::uint32_t(from.size + to.size + behind.size);
        }
        const std::uint32_t mean = std::uint32_t(double(size) * (kOneOf[3 * beside.count]));
        code(v, reals(sum) * kOneOf[beside.count], is_turned_ ? SurfaceFrame(normal, reals(ahead)) : SurfaceFrame(),
             mean, std::min<unsigned>(beside.count, kSupport) - 1);
        for (std::uint32_t i = 0; i < beside.count; ++i) { // between each of them and v there is one that is known now
            const Index h = map_.opposite[beside.half_edges[i]];
            tell_across(next_half_edge(h));
            tell_across(previous_half_edge(h));
        }
    }

    void code(Index v, const Reals& expected, const SurfaceFrame& frame, std::uint32_t size, unsigned support) {
        known_[v] =
            step_to_place<kSizeClasses>(expected, frame, steps_, size, [&](std::size_t k, unsigned size_context) {
                return coder_.step(v, expected, frame.axes[k], steps_[k],
                                   unsigned(k * kSizeClasses + size_context) * kSupport + support);
            });
        is_known_[v] = true;
    }

    /// What lies across a half-edge of a triangle that has become known. What is known itself is told in vain, and its
    /// place in the turns taken by the next: which it is cannot be guessed.
    void tell_across(Index half_edge) {
        const Index w = map_.origin(previous_half_edge(map_.opposite[half_edge]));
        Beside& beside = around_[w];
        beside.half_edges[std::min<std::size_t>(beside.count, kMostBeside - 1)] = half_edge;
        beside.count = std::min<std::uint32_t>(beside.count + 1, kMostBeside);
        const std::size_t turn = std::min<std::size_t>(beside.count, kTurns - 1);
        turns_[turn][turn_sizes_[turn]] = w;
        turn_sizes_[turn] = std::min(turn_sizes_[turn] + !is_known_[w], map_.opposite.size());
    }

    const ClosedMap& map_;
    Coder& coder_;
    bool is_turned_;
    Reals steps_;                                        ///< sizes along the frame's axes, in sixteenths
    std::vector<SteppedPlace> known_;                    ///< of each vertex that is
    std::vector<std::uint8_t> is_known_;                 ///< or closes a hole
    std::vector<Beside> around_;                         ///< of each vertex
    std::vector<Index> spoke_;                           ///< a half-edge from each vertex
    std::array<std::unique_ptr<Index[]>, kTurns> turns_; ///< vertices by how many known triangles are beside them
    std::array<std::size_t, kTurns> turn_sizes_{};
};

class PlaceWriter {
public:
    PlaceWriter(std::span<const FinePlace> places, unsigned first, SymbolWriter& out)
        : places_(places), first_(first), out_(out) {}
    bool is_damaged() const { return false; }
    std::int32_t step(Index v, const Reals& expected, const Reals& axis, double size, unsigned context) {
        const std::int32_t steps = nearest_step(places_[v], expected, axis, size);
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
    std::int32_t step(Index, const Reals&, const Reals&, double, unsigned context) {
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
