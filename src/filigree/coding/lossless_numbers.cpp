#include "filigree/coding/lossless_numbers.h"

#include "filigree/coding/symbols.h"
#include "filigree/mesh/edges.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace filigree {

namespace {

constexpr unsigned kMostColumns = 16, kLengths = 34; // a difference has 0 to 33 bits
constexpr unsigned kFront = 0, kColumn = 2;          // contexts: palettes, then as many a column as there are lengths
constexpr unsigned kLongestPalette = 1u << 16;

/// Floats as integers in the same order, and back.
std::uint32_t ordered(std::uint32_t bits) { return bits >> 31 ? ~bits : bits | 0x80000000u; }
std::uint32_t unordered(std::uint32_t value) { return value >> 31 ? value & 0x7fffffffu : ~value; }

int exponent_of(std::uint32_t bits) { return int(bits >> 23 & 255); }

/// near + across - behind, rounded once; `near` where that is no finite number.
std::uint32_t parallelogram(std::uint32_t near, std::uint32_t across, std::uint32_t behind) {
    const auto real = [](std::uint32_t bits) { return double(std::bit_cast<float>(bits)); };
    const float expected = static_cast<float>(real(near) + (real(across) - real(behind)));
    return std::isfinite(expected) ? std::bit_cast<std::uint32_t>(expected) : near;
}

/// How long differences of a column were of late, in eighths of bits, as if all floats had the exponent 0.
struct RecentLength {
    int eighths = 0;
    void add(int length) { eighths += (8 * length - eighths) / 4; }
};

/// Both sides of the code: `Code` writes or reads numbers.
template <class Code>
class Numbers {
public:
    Numbers(Code& code, WordLayout layout, std::span<const Expectation> expected)
        : code_(code), layout_(layout), expected_(expected) {}

    /// words: of known items, then those that are written, or are to be read. False: damaged.
    bool run(std::vector<std::uint32_t>& words, std::size_t known, std::size_t items) {
        const unsigned columns = layout_.columns;
        for (unsigned c = 0; c < columns; ++c)
            if (!palette(words, known, c)) return false;
        for (std::size_t i = known; i < known + items; ++i) {
            const Expectation from = expectation(i, known);
            int before = 0; // length of the column before
            for (unsigned c = 0; c < columns; ++c) {
                if constexpr (!Code::writes) words.push_back(0);
                const int exponent = step(words, i, c, from, before);
                if (exponent < 0) return false;
            }
        }
        return true;
    }

private:
    Expectation expectation(std::size_t i, std::size_t known) const {
        Expectation from = i - known < expected_.size() ? expected_[i - known] : Expectation();
        if (from.near >= i) {
            from = {i > 0 ? static_cast<Index>(i - 1) : kNoIndex, kNoIndex, kNoIndex};
            if (layout_.second_order && i > 1) from = {from.near, from.near, static_cast<Index>(i - 2)};
        }
        if (from.across >= i || from.behind >= i) from.across = from.behind = kNoIndex;
        return from;
    }

    /// Codes word c of item i. Less than 0: damaged.
    int step(std::vector<std::uint32_t>& words, std::size_t i, unsigned c, const Expectation& from, int& before) {
        const unsigned columns = layout_.columns;
        const std::vector<std::uint32_t>& palette = palettes_[c];
        const auto word = [&](Index item) { return words[std::size_t(item) * columns + c]; };
        const bool is_over = from.across != kNoIndex;
        std::uint32_t expected = 0;
        int exponent = 0;
        if (!palette.empty()) {
            const auto rank = [&](Index item) { return std::int64_t(rank_of(palette, word(item))); };
            std::int64_t at = from.near == kNoIndex ? 0 : rank(from.near);
            if (is_over) at += rank(from.across) - rank(from.behind);
            expected = static_cast<std::uint32_t>(std::clamp<std::int64_t>(at, 0, std::int64_t(palette.size()) - 1));
        } else if (from.near != kNoIndex) {
            expected = word(from.near);
            if (layout_.are_floats) {
                if (is_over) expected = parallelogram(expected, word(from.across), word(from.behind));
                exponent = exponent_of(expected);
                expected = ordered(expected);
            } else if (is_over)
                expected += word(from.across) - word(from.behind);
        }
        RecentLength& recent = recent_[c][is_over];
        const int guess = (c == 0 ? recent.eighths : (recent.eighths + 8 * before) / 2) / 8 - exponent;
        const auto context = kColumn + c * kLengths + unsigned(std::clamp(guess, 0, int(kLengths) - 1));
        std::uint32_t& own = words[i * columns + c];
        std::int32_t difference = 0;
        if constexpr (Code::writes) {
            const std::uint32_t value = !palette.empty()     ? rank_of(palette, own)
                                        : layout_.are_floats ? ordered(own)
                                                             : own;
            difference = std::int32_t(value - expected);
        }
        code_.difference(context, difference);
        if constexpr (!Code::writes) {
            if (code_.is_damaged()) return -1;
            const std::uint32_t value = expected + std::uint32_t(difference);
            if (!palette.empty() && value >= palette.size()) return -1;
            own = !palette.empty() ? palette[value] : layout_.are_floats ? unordered(value) : value;
        }
        const auto magnitude = difference < 0 ? ~std::uint32_t(difference) : std::uint32_t(difference);
        before = std::bit_width(magnitude) + exponent;
        recent.add(before);
        return exponent;
    }

    /// Columns with few values, such as colours and rounded coordinates, are numbers of a list of these.
    bool palette(const std::vector<std::uint32_t>& words, std::size_t known, unsigned c) {
        std::vector<std::uint32_t>& palette = palettes_[c];
        if constexpr (Code::writes)
            if (known == 0) palette = palette_of(words, c);
        auto size = static_cast<std::uint32_t>(palette.size());
        code_.number(kFront, size);
        if (code_.is_damaged() || size > kLongestPalette) return false;
        palette.reserve(size);
        std::uint32_t before = 0;
        for (std::uint32_t k = 0; k < size; ++k) {
            std::uint32_t gap = Code::writes ? key(palette[k]) - before : 0;
            code_.number(kFront + 1, gap);
            if (code_.is_damaged()) return false;
            before += gap;
            if constexpr (!Code::writes) palette.push_back(layout_.are_floats ? unordered(before) : before);
        }
        return true;
    }
    std::uint32_t key(std::uint32_t word) const { return layout_.are_floats ? ordered(word) : word; }
    std::uint32_t rank_of(const std::vector<std::uint32_t>& palette, std::uint32_t word) const {
        const auto at = std::lower_bound(palette.begin(), palette.end(), key(word),
                                         [&](std::uint32_t p, std::uint32_t k) { return key(p) < k; });
        return static_cast<std::uint32_t>(at - palette.begin());
    }
    std::vector<std::uint32_t> palette_of(const std::vector<std::uint32_t>& words, unsigned c) const {
        constexpr std::size_t kUses = 4; // of each value, where a list pays
        std::vector<std::uint32_t> values;
        for (std::size_t i = c; i < words.size(); i += layout_.columns) values.push_back(key(words[i]));
        const std::size_t items = values.size();
        std::ranges::sort(values);
        const auto rest = std::ranges::unique(values);
        values.erase(rest.begin(), rest.end());
        if (values.size() * kUses > items || values.size() > kLongestPalette || values.size() < 2) return {};
        if (!layout_.are_floats && values.back() - values.front() < 2 * values.size())
            return {}; // they are near already
        if (layout_.are_floats)
            for (std::uint32_t& value : values) value = unordered(value);
        return values;
    }

    Code& code_;
    WordLayout layout_;
    std::span<const Expectation> expected_;
    std::array<std::vector<std::uint32_t>, kMostColumns> palettes_;
    std::array<std::array<RecentLength, 2>, kMostColumns> recent_; ///< without and with a parallelogram
};

unsigned contexts_of(WordLayout layout) { return kColumn + layout.columns * kLengths; }

struct LosslessWriter {
    static constexpr bool writes = true;
    SymbolWriter out;
    void number(unsigned context, std::uint32_t value) { out.number(context, value); }
    void difference(unsigned context, std::int32_t value) { out.number_with_sign(context, value); }
    bool is_damaged() const { return false; }
};

struct LosslessReader {
    static constexpr bool writes = false;
    SymbolReader in;
    void number(unsigned context, std::uint32_t& value) { value = in.number(context); }
    void difference(unsigned context, std::int32_t& value) { value = in.number_with_sign(context); }
    bool is_damaged() const { return in.is_damaged(); }
};

} // namespace

std::string encode_numbers(std::span<const std::uint32_t> known, std::span<const std::uint32_t> words,
                           WordLayout layout, std::span<const Expectation> expected) {
    std::vector<std::uint32_t> all(known.begin(), known.end());
    all.insert(all.end(), words.begin(), words.end());
    LosslessWriter code{SymbolWriter(contexts_of(layout))};
    Numbers<LosslessWriter>(code, layout, expected)
        .run(all, known.size() / layout.columns, words.size() / layout.columns);
    return code.out.finish();
}

std::optional<std::vector<std::uint32_t>> decode_numbers(std::string_view stream, std::span<const std::uint32_t> known,
                                                         std::size_t items, WordLayout layout,
                                                         std::span<const Expectation> expected) {
    std::vector<std::uint32_t> all(known.begin(), known.end());
    LosslessReader code{SymbolReader(stream, contexts_of(layout))};
    if (!Numbers<LosslessReader>(code, layout, expected).run(all, known.size() / layout.columns, items)) return {};
    all.erase(all.begin(), all.begin() + std::ptrdiff_t(known.size()));
    return all;
}

namespace {

/// For each corner of a triangle the vertex beyond the edge across from it, in the first triangle that runs back along
/// that edge; kNoIndex: there is none, or an end of the edge is not below `vertices`.
std::vector<Index> vertices_beyond(const PolygonCorners& polygons, std::span<const Index> corners,
                                   std::size_t vertices) {
    const auto from = [&](Index c) { return corners[polygons.next(c)]; };
    const auto to = [&](Index c) { return corners[polygons.previous(c)]; };
    const IndexLists edges = edges_from(vertices, [&](const auto& add) { // named by the corner across
        for (Index c = 0; c < polygons.count(); ++c)
            if (polygons.size(c) == 3 && std::max(from(c), to(c)) < vertices) add(from(c), to(c), c);
    });
    std::vector<Index> beyond(corners.size(), kNoIndex);
    for (const std::span<const Index> edge : edges) {
        const Index end = to(edge[0]);
        const auto runs_back = [&](Index c) { return to(c) != end || from(c) == end; };
        const auto back = std::ranges::find_if(edge, runs_back);
        for (const Index c : edge)
            if (const auto first = to(c) == end ? back : edge.begin(); first != edge.end()) beyond[c] = corners[*first];
    }
    return beyond;
}

} // namespace

std::vector<Expectation> vertex_expectations(std::span<const Index> face_offsets, std::span<const Index> corners,
                                             std::size_t vertices, std::size_t block) {
    std::vector<Expectation> expected(vertices);
    if (face_offsets.size() < 2) return expected;
    const PolygonCorners polygons(face_offsets);
    const std::vector<Index> beyond = vertices_beyond(polygons, corners, vertices);
    const IndexLists at = make_lists<Index>(vertices, [&](const auto& add) {
        for (Index c = 0; c < polygons.count(); ++c)
            if (corners[c] < vertices) add(corners[c], c);
    });
    for (Index v = 0; v < vertices; ++v) {
        const auto is_known = [&](Index u) { return u < v && u / block == v / block; };
        Expectation& best = expected[v];
        for (const Index c : at[v]) {
            const Index to = corners[polygons.next(c)], from = corners[polygons.previous(c)];
            if (is_known(to) && (best.near == kNoIndex || to > best.near)) best.near = to;
            if (is_known(from) && (best.near == kNoIndex || from > best.near)) best.near = from;
            if (!is_known(to) || !is_known(from) || polygons.size(c) > 4) continue;
            const Index behind = polygons.size(c) == 4 ? corners[polygons.next(polygons.next(c))] : beyond[c];
            if (is_known(behind)) best = {from, to, behind};
            if (best.across != kNoIndex) break;
        }
    }
    return expected;
}

} // namespace filigree
