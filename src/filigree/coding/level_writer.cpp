#include "filigree/coding/level_writer.h"

#include "filigree/coding/coarsening.h"
#include "filigree/coding/level_walk.h"

#include <algorithm>
#include <utility>

namespace filigree {

namespace {

constexpr double kDenseSeams = 0.25; // of the vertices, that the coarsest level has: it is none

/// Looks into a coarsening, and writes how to take it back.
class SplitWriter {
public:
    static constexpr bool writes = true;

    SplitWriter(const Coarsening& coarsening, std::span<const FinePlace> places, const SurfaceAttributes& attributes,
                const WalkedMap& coarsest)
        : out(kLevelContexts), places_(places), attributes_(attributes), collapse_of_(places.size(), nullptr),
          number_of_(places.size(), kNoIndex), came_by_(coarsest.vertex.size(), nullptr) {
        for (const Index v : coarsest.vertex) add_vertex(coarsening.vertex[v]);
    }

    SymbolWriter out;
    std::vector<Index> vertices; ///< of the walk's, which they were

    void begin_batch(std::span<const VertexCollapse> batch) {
        for (const VertexCollapse& c : batch) collapse_of_[c.onto] = &c;
    }
    bool is_damaged() const { return false; }
    bool splits(unsigned context, Index u) {
        const bool splits = collapse_of_[vertices[u]] != nullptr;
        out.symbol(context, splits);
        return splits;
    }
    std::size_t sector(unsigned context, Index u) {
        now_ = std::exchange(collapse_of_[vertices[u]], nullptr);
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
    void did_split(Index) {
        add_vertex(now_->vertex);
        if (!attributes_.empty()) came_by_.push_back(now_);
    }
    std::int32_t step(unsigned context, Index v, const Reals& expected, const Reals& axis, double size) {
        const std::int32_t steps = nearest_step(places_[vertices[v]], expected, axis, size);
        out.number_with_sign(context, steps);
        return steps;
    }

    // What LevelWedges asks.
    Index source(Index wedge) const { return wedge_sources_[wedge]; }
    void add_wedge(Index source) { wedge_sources_.push_back(source); }
    const Wedge& source_wedge(Index source) const { return attributes_.wedges[source]; }
    const ByteColor& source_color(Index v) const { return attributes_.colors[vertices[v]]; }
    Index child(Index v, Index parent) const {
        const VertexCollapse& c = *came_by_[v];
        return c.at_left.onto == source(parent) ? c.at_left.own : c.at_right.own;
    }
    bool moves(unsigned context, Index v, bool is_left) {
        const bool moves = (is_left ? came_by_[v]->at_left : came_by_[v]->at_right).moves;
        out.symbol(context, moves);
        return moves;
    }
    std::int32_t number_with_sign(unsigned context, std::int32_t number) {
        out.number_with_sign(context, number);
        return number;
    }

private:
    void add_vertex(Index vertex) {
        number_of_[vertex] = static_cast<Index>(vertices.size());
        vertices.push_back(vertex);
    }

    std::span<const FinePlace> places_;
    const SurfaceAttributes& attributes_;
    std::vector<const VertexCollapse*> collapse_of_; ///< of each vertex, what goes onto it in this batch
    std::vector<Index> number_of_;
    std::vector<const VertexCollapse*> came_by_; ///< of each of the walk's, where there are attributes
    std::vector<Index> wedge_sources_;           ///< of each of the walk's wedges, which one it was
    const VertexCollapse* now_ = nullptr;
};

/// Of the coarsest level.
struct BaseWriter {
    SymbolWriter out{kBaseContexts};
    const Coarsening& coarsening;
    const WalkedMap& coarsest;

    bool is_damaged() const { return false; }
    Index wedge_at(Index half_edge) const {
        Index source = coarsest.half_edge[half_edge / 3];
        for (Index k = 0; k < half_edge % 3; ++k) source = next_half_edge(source);
        return coarsening.wedge_at[source];
    }
    std::uint32_t bits(std::uint32_t value, unsigned count) {
        out.bits(value, count);
        return value;
    }
    std::uint32_t number(unsigned context, std::uint32_t number) {
        out.number(context, number);
        return number;
    }
    std::int32_t number_with_sign(unsigned context, std::int32_t number) {
        out.number_with_sign(context, number);
        return number;
    }
};

std::string code_refinement(std::span<const FinePlace> exact, std::span<const Index> vertices,
                            std::span<const RoughFrame> frames, std::size_t begin, VertexRings& rings,
                            SymbolWriter& out) {
    refine(frames, rings, begin, [&](std::size_t v, const std::array<Reals, 3>& axes) {
        const Reals left = reals(exact[vertices[v]]) - reals(rings.place(static_cast<Index>(v)));
        std::array<std::int32_t, 3> quarters{};
        for (std::size_t k = 0; k < 3; ++k) {
            const double along = dot(left, axes[k]) / dot(axes[k], axes[k]);
            quarters[k] = std::clamp(to_fine(along - 0.5), -2, 1);
            out.bits(std::uint32_t(quarters[k] + 2), kQuarterBits);
        }
        return quarters;
    });
    return out.finish();
}

/// Of each of the walk's triangles the source's half-edge from its first corner to its second. It is looked for around
/// the first corner, unless many triangles meet there: then around the one of the three where fewest do.
std::vector<Index> find_half_edges(std::span<const Triangle> triangles, std::span<const Index> vertices,
                                   const ClosedMap& map) {
    constexpr Index kManyTriangles = 32; // at a vertex
    std::vector<Index> spokes(map.vertex_count(), kNoIndex), around(map.vertex_count(), 0), found;
    std::vector<bool> is_taken(map.triangles.size(), false);
    for (Index h = 0; h < map.opposite.size(); ++h) {
        spokes[map.origin(h)] = h;
        ++around[map.origin(h)];
    }
    for (const Triangle& t : triangles) {
        const Triangle of_source = {vertices[t[0]], vertices[t[1]], vertices[t[2]]};
        std::size_t k = 0; // the corner to turn around
        if (around[of_source[0]] > kManyTriangles)
            k = std::size_t(std::ranges::min_element(of_source, {}, [&](Index v) { return around[v]; }) -
                            of_source.begin());
        const Index to = of_source[(k + 1) % 3], third = of_source[(k + 2) % 3];
        Index h = spokes[of_source[k]];
        while (is_taken[h / 3] || map.origin(next_half_edge(h)) != to || map.origin(previous_half_edge(h)) != third)
            h = map.turn_clockwise(h);
        is_taken[h / 3] = true;
        for (; k > 0; --k) h = previous_half_edge(h); // back to the first corner
        found.push_back(h);
    }
    return found;
}

} // namespace

EncodedLevels encode_levels(const ClosedMap& map, std::span<const FinePlace> places,
                            const SurfaceAttributes& attributes, const LevelCodeOptions& options,
                            const RunContext& context) {
    const Coarsening coarsening = coarsen(map, places, attributes, options.fewest, context);
    const double most = std::max(4 * double(options.fewest), kDenseSeams * double(map.vertex_count()));
    if (!attributes.empty() && double(coarsening.vertex.size()) > most && !context.is_cancelled())
        return encode_levels(map, places, {}, options, context);
    EncodedLevels encoded;
    PackedLevels& code = encoded.code;
    SymbolWriter connectivity(kConnectivityContexts), base_places(kGeometryContexts);
    const WalkedMap coarsest = encode_connectivity(coarsening.base, connectivity);
    code.connectivity = connectivity.finish();
    SplitWriter writer(coarsening, places, attributes, coarsest);
    std::vector<FinePlace> places_there;
    for (const Index v : writer.vertices) places_there.push_back(places[v]);
    LevelWalk<SplitWriter> walk(writer, options.steps, options.is_refined);
    walk.begin(coarsest.map, encode_geometry(coarsest.map, places_there, {1, 1}, 0, base_places));
    code.places = base_places.finish();
    if (!attributes.empty()) {
        BaseWriter base{.coarsening = coarsening, .coarsest = coarsest};
        walk.wedges.outline = attributes.outline;
        walk.wedges.begin(coarsest.map, base);
        code.attributes = base.out.finish();
    }
    code.vertices = static_cast<std::uint32_t>(walk.rings.vertex_count());
    code.triangles = static_cast<std::uint32_t>(coarsest.map.triangles.size());

    std::size_t begin = walk.rings.vertex_count(); // of the level
    PackedLevel level;
    for (std::size_t i = coarsening.batches.size(); i-- > 0 && !context.is_cancelled();) {
        writer.begin_batch(coarsening.batches[i]);
        if (!walk.run_batch(kNoIndex)) // two triangles of three same vertices: which has which wedge cannot be said
            return encode_levels(map, places, {}, options, context);
        ++level.batches;
        if (i > 0 && walk.rings.vertex_count() < 2 * begin) continue;
        begin = walk.rings.vertex_count();
        level.vertices = static_cast<std::uint32_t>(begin);
        level.triangles = static_cast<std::uint32_t>(code.triangles + 2 * (begin - code.vertices));
        level.splits = writer.out.finish();
        code.levels.push_back(std::exchange(level, {}));
    }
    if (options.is_refined) {
        SymbolWriter out(0);
        std::size_t from = code.vertices;
        for (PackedLevel& coded : code.levels) {
            const std::size_t count = coded.vertices - from;
            coded.refinement =
                code_refinement(places, writer.vertices, std::span(walk.frames).subspan(from - code.vertices, count),
                                from, walk.rings, out);
            from = coded.vertices;
        }
    }
    for (Index v = 0; v < walk.rings.vertex_count(); ++v) encoded.read.push_back(walk.rings.place(v));
    encoded.walked.map = map_of(walk.rings.triangles(), walk.rings.closes_hole());
    encoded.walked.half_edge = find_half_edges(encoded.walked.map.triangles, writer.vertices, map);
    encoded.walked.vertex = std::move(writer.vertices);
    return encoded;
}

} // namespace filigree
