#include "filigree/coding/level_writer.h"

#include "filigree/coding/coarsening.h"
#include "filigree/coding/level_walk.h"

#include <utility>

namespace filigree {

namespace {

/// Looks into a coarsening, and writes how to take it back.
class SplitWriter {
public:
    SplitWriter(const Coarsening& coarsening, std::span<const FinePlace> places, const WalkedMap& coarsest)
        : out(kLevelContexts), places_(places), collapse_of_(places.size(), nullptr),
          number_of_(places.size(), kNoIndex) {
        for (const Index v : coarsest.vertex) add_vertex(coarsening.vertex[v]);
        for (const Index h : coarsest.half_edge) { // of the base, which is numbered by triangles
            const Index first = coarsening.half_edge[h / 3];
            half_edges.push_back(first + h % 3);
        }
    }

    SymbolWriter out;
    std::vector<Index> vertices, half_edges; ///< of the walk's, which they were

    void begin_batch(std::span<const VertexCollapse> batch) {
        for (const VertexCollapse& c : batch) collapse_of_[c.onto] = &c;
    }
    bool is_damaged() const { return false; }
    bool splits(unsigned context, Index u) {
        now_ = collapse_of_[vertices[u]];
        out.symbol(context, now_ != nullptr);
        return now_ != nullptr;
    }
    std::size_t sector(unsigned context, const SplitRing&) {
        out.number(context, now_->triangles - 1);
        return now_->triangles;
    }
    std::size_t begin(unsigned context, const SplitRing& ring, std::size_t expected) {
        std::size_t begin = 0;
        while (begin < ring.size && !(vertices[ring.ends[begin]] == now_->left &&
                                      vertices[ring.ends[(begin + now_->triangles) % ring.size]] == now_->right))
            ++begin;
        auto further = std::int32_t(begin) - std::int32_t(expected);
        const auto size = std::int32_t(ring.size);
        if (2 * further > size) further -= size;
        if (2 * further <= -size) further += size;
        out.number_with_sign(context, further);
        return begin;
    }
    void did_split(Index u, Index, Index, Index) {
        collapse_of_[vertices[u]] = nullptr;
        add_vertex(now_->vertex);
        half_edges.push_back(now_->back);
        half_edges.push_back(ClosedMap::next(now_->there));
    }
    std::int32_t step(unsigned context, Index v, const Wide& expected, const Wide& axis, std::int64_t size) {
        const FinePlace& p = places_[vertices[v]];
        const auto steps = std::int32_t(divide(dot(Wide{p[0], p[1], p[2]} - expected, axis), size * kOne));
        out.number_with_sign(context, steps);
        return steps;
    }

private:
    void add_vertex(Index vertex) {
        number_of_[vertex] = static_cast<Index>(vertices.size());
        vertices.push_back(vertex);
    }

    std::span<const FinePlace> places_;
    std::vector<const VertexCollapse*> collapse_of_; ///< of each vertex, what goes onto it in this batch
    std::vector<Index> number_of_;
    const VertexCollapse* now_ = nullptr;
};

std::string code_refinement(std::span<const FinePlace> exact, std::span<const Index> vertices,
                            std::span<const RoughFrame> frames, std::span<FinePlace> read, SymbolWriter& out) {
    refine(frames, read, [&](std::size_t v, std::size_t k, const Wide& axis) {
        const FinePlace &p = exact[vertices[v]], &q = read[v];
        const std::int64_t along = dot({p[0] - q[0], p[1] - q[1], p[2] - q[2]}, axis);
        const std::int64_t quarter = divide(2 * along - kFine * kRoughOne, 2 * kFine * kRoughOne);
        const auto chosen = std::int32_t(std::clamp<std::int64_t>(quarter, -8, 7));
        out.number_with_sign(unsigned(k), chosen);
        return chosen;
    });
    return out.finish();
}

} // namespace

EncodedLevels encode_levels(const ClosedMap& map, std::span<const FinePlace> places, const LevelCodeOptions& options,
                            const RunContext& context) {
    const Coarsening coarsening = coarsen(map, places, options.fewest, context);
    EncodedLevels encoded;
    CodedLevels& code = encoded.code;
    SymbolWriter connectivity(kConnectivityContexts), base_places(kGeometryContexts);
    const WalkedMap coarsest = encode_connectivity(coarsening.base, connectivity);
    code.connectivity = connectivity.finish();
    SplitWriter writer(coarsening, places, coarsest);
    std::vector<FinePlace> places_there;
    for (const Index v : writer.vertices) places_there.push_back(places[v]);
    LevelWalk<SplitWriter> walk(writer, options.steps, options.is_refined);
    walk.begin(coarsest.map, encode_geometry(coarsest.map, places_there, {1, 1}, 0, base_places));
    code.places = base_places.finish();
    code.vertices = static_cast<std::uint32_t>(walk.map.vertex_count());
    code.triangles = static_cast<std::uint32_t>(walk.map.triangles.size());

    std::size_t begin = walk.map.vertex_count(); // of the level
    CodedLevel level;
    for (std::size_t i = coarsening.batches.size(); i-- > 0 && !context.is_cancelled();) {
        writer.begin_batch(coarsening.batches[i]);
        walk.run_batch(kNoIndex);
        ++level.batches;
        if (i > 0 && walk.map.vertex_count() < 2 * begin) continue;
        begin = walk.map.vertex_count();
        level.vertices = static_cast<std::uint32_t>(begin);
        level.triangles = static_cast<std::uint32_t>(walk.map.triangles.size());
        level.splits = writer.out.finish();
        code.levels.push_back(std::exchange(level, {}));
    }
    if (options.is_refined) {
        SymbolWriter out(kRefinementContexts);
        std::size_t from = code.vertices;
        for (CodedLevel& coded : code.levels) {
            const std::size_t count = coded.vertices - from;
            coded.refinement = code_refinement(places, std::span(writer.vertices).subspan(from, count),
                                               std::span(walk.frames).subspan(from - code.vertices, count),
                                               std::span(walk.places).subspan(from, count), out);
            from = coded.vertices;
        }
    }
    encoded.read = std::move(walk.places);
    encoded.walked = {std::move(walk.map), std::move(writer.vertices), std::move(writer.half_edges)};
    return encoded;
}

} // namespace filigree
