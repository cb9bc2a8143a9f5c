// Based on: [Edmonds 1965] (blossoms), in LEMON's implementation [Dezso 2011].
#include "filigree/remesh/matching.h"

#include <lemon/matching.h>
#include <lemon/smart_graph.h>

#include <cmath>

namespace filigree {

namespace {

constexpr std::uint32_t kNone = 0xffffffff;      // kNoIndex
constexpr std::int64_t kUnit = 4096;             // of a weight's 0 to 1: whole numbers keep the algorithm exact
constexpr unsigned kReadsBetweenLooks = 1 << 16; // weights read from one look at is_cancelled to the next

struct Cancelled {};

/// The weights as LEMON reads them, all the time it works: the one place from which it can be stopped, by an exception.
/// It frees what it holds in its destructors.
class StoppableWeights {
public:
    using Key = lemon::SmartGraph::Edge;
    using Value = std::int64_t;

    StoppableWeights(const lemon::SmartGraph& graph, const std::function<bool()>& is_cancelled)
        : weights_(graph), is_cancelled_(is_cancelled) {}
    void set(Key edge, Value weight) { weights_[edge] = weight; }
    Value operator[](Key edge) const {
        if (++reads_ % kReadsBetweenLooks == 0 && is_cancelled_()) throw Cancelled();
        return weights_[edge];
    }

private:
    lemon::SmartGraph::EdgeMap<Value> weights_;
    const std::function<bool()>& is_cancelled_;
    mutable unsigned reads_ = 0;
};

} // namespace

std::vector<std::uint32_t> match_triangles(const std::vector<std::uint32_t>& opposite,
                                           const std::vector<double>& weights,
                                           const std::function<bool()>& is_cancelled) {
    const std::size_t triangle_count = opposite.size() / 3;
    lemon::SmartGraph graph;
    graph.reserveNode(static_cast<int>(triangle_count));
    for (std::size_t t = 0; t < triangle_count; ++t) graph.addNode();
    StoppableWeights worth(graph, is_cancelled); // grows with the graph
    // More than all weights together can gain, so that no pair is ever given up for better ones.
    const std::int64_t any_pair = kUnit * static_cast<std::int64_t>(triangle_count + 1);
    for (std::size_t h = 0; h < opposite.size(); ++h) {
        if (opposite[h] == kNone || opposite[h] < h || weights[h] < 0) continue;
        const auto edge = graph.addEdge(graph.nodeFromId(static_cast<int>(h / 3)),
                                        graph.nodeFromId(static_cast<int>(opposite[h] / 3)));
        worth.set(edge, any_pair + std::llround(weights[h] * kUnit));
    }
    lemon::MaxWeightedMatching<lemon::SmartGraph, StoppableWeights> matching(graph, worth);
    try {
        matching.run();
    } catch (const Cancelled&) {
        return {};
    }
    std::vector<std::uint32_t> partner(triangle_count, kNone);
    for (std::size_t t = 0; t < triangle_count; ++t) {
        const auto mate = matching.mate(graph.nodeFromId(static_cast<int>(t)));
        if (mate != lemon::INVALID) partner[t] = static_cast<std::uint32_t>(graph.id(mate));
    }
    return partner;
}

} // namespace filigree
