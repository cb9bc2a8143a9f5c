#include "filigree/pack/level_reader.h"

#include "filigree/pack/connectivity_code.h"
#include "filigree/pack/level_walk.h"

namespace filigree {

namespace {

class SplitReader {
public:
    static constexpr bool writes = false;
    SymbolReader in{{}, kLevelContexts};

    bool is_damaged() const { return in.is_damaged(); }
    bool splits(unsigned context, Index) { return in.symbol(context) != 0; }
    std::size_t sector(unsigned context, Index) { return std::size_t{in.number(context)} + 1; }
    std::size_t begin(unsigned context, const SplitRing& ring, std::size_t expected) {
        const auto size = std::int64_t(ring.size);
        const std::int64_t begin = std::int64_t(expected) + in.number_with_sign(context);
        return begin < -size ? ring.size : std::size_t((begin + 2 * size) % size);
    }
    void did_split(Index) {}
    std::int32_t step(unsigned context, Index, const Reals&, const Reals&, double) {
        return std::clamp(in.number_with_sign(context), -kFarthest, kFarthest);
    }
    bool moves(unsigned context, Index, bool) { return in.symbol(context) != 0; }
    std::int32_t number_with_sign(unsigned context, std::int32_t) { return in.number_with_sign(context); }
};

/// Of the coarsest level.
struct BaseReader {
    SymbolReader in;

    bool is_damaged() const { return in.is_damaged(); }
    std::uint32_t bits(std::uint32_t, unsigned count) { return in.bits(count); }
    std::uint32_t number(unsigned context, std::uint32_t) { return in.number(context); }
    std::int32_t number_with_sign(unsigned context, std::int32_t) { return in.number_with_sign(context); }
};

} // namespace

class LevelReader::Reading {
public:
    Reading(GeometrySteps steps, bool is_refined, std::size_t most)
        : walk(reader, steps, is_refined), most_vertices(most) {}

    SplitReader reader;
    LevelWalk<SplitReader> walk;
    SymbolReader refinement{{}, 0};
    std::size_t most_vertices;
    std::vector<std::size_t> level_ends; ///< vertices after the coarsest and each level
    std::size_t refined_levels = 0;
};

LevelReader::LevelReader(GeometrySteps steps, bool is_refined, std::size_t most_vertices)
    : reading_(std::make_unique<Reading>(steps, is_refined, most_vertices)) {}
LevelReader::~LevelReader() = default;
LevelReader::LevelReader(LevelReader&&) noexcept = default;
LevelReader& LevelReader::operator=(LevelReader&&) noexcept = default;

bool LevelReader::read_coarsest(std::string_view connectivity, std::string_view places, std::string_view attributes) {
    SymbolReader in(connectivity, kConnectivityContexts), places_in(places, kGeometryContexts);
    std::optional<WalkedMap> walked = decode_connectivity(in, 2 * reading_->most_vertices);
    if (!walked || walked->map.vertex_count() > reading_->most_vertices) return false;
    std::vector<FinePlace> there = decode_geometry(walked->map, {1, 1}, 0, places_in);
    if (places_in.is_damaged()) return false;
    reading_->level_ends.push_back(walked->map.vertex_count());
    reading_->walk.begin(walked->map, there);
    if (attributes.empty()) return true;
    BaseReader base{SymbolReader(attributes, kBaseContexts)};
    return reading_->walk.wedges.begin(walked->map, base);
}

bool LevelReader::read_level(std::string_view splits, std::uint32_t batches) {
    reading_->reader.in.read_next(splits);
    for (std::uint32_t k = 0; k < batches; ++k)
        if (!reading_->walk.run_batch(reading_->most_vertices)) return false;
    reading_->level_ends.push_back(reading_->walk.rings.vertex_count());
    return true;
}

bool LevelReader::refine_level(std::string_view refinement) {
    Reading& r = *reading_;
    if (r.refined_levels + 1 >= r.level_ends.size()) return false;
    r.refinement.read_next(refinement);
    const std::size_t begin = r.level_ends[r.refined_levels], count = r.level_ends[r.refined_levels + 1] - begin;
    if (r.walk.frames.size() < begin - r.level_ends[0] + count) return false;
    refine(
        std::span(r.walk.frames).subspan(begin - r.level_ends[0], count), r.walk.rings, begin,
        [&](std::size_t, const std::array<Reals, 3>&) {
            const std::uint32_t bits = r.refinement.bits(3 * kQuarterBits);
            return std::array{std::int32_t(bits & 3) - 2, std::int32_t(bits >> 2 & 3) - 2, std::int32_t(bits >> 4) - 2};
        });
    ++r.refined_levels;
    return !r.refinement.is_damaged();
}

std::vector<Triangle> LevelReader::triangles() const { return reading_->walk.rings.triangles(); }
std::vector<bool> LevelReader::closes_hole() const { return reading_->walk.rings.closes_hole(); }
ClosedMap LevelReader::map() const { return map_of(triangles(), closes_hole()); }
FinePlace LevelReader::place(Index vertex) const { return reading_->walk.rings.place(vertex); }
std::size_t LevelReader::vertex_count() const { return reading_->walk.rings.vertex_count(); }
std::span<const Index> LevelReader::parents() const { return reading_->walk.parents; }
const AttributeOutline& LevelReader::outline() const { return reading_->walk.wedges.outline; }
std::span<const Wedge> LevelReader::wedges() const { return reading_->walk.wedges.wedges; }
std::span<const ByteColor> LevelReader::colors() const { return reading_->walk.wedges.colors; }
std::vector<Index> LevelReader::corner_wedges(std::span<const Triangle> triangles) const {
    return reading_->walk.wedges.of_corners(triangles, reading_->walk.rings);
}

} // namespace filigree
