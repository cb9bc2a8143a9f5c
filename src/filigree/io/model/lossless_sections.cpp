#include "filigree/io/model/lossless_sections.h"

#include "filigree/io/model/model_records.h"
#include "filigree/io/model/model_sections.h"
#include "filigree/pack/lossless_corners.h"

#include <array>
#include <set>

namespace filigree {

namespace {

enum class Way : char { plain, numbers, second_order, corners, values, records };

constexpr std::uint32_t kPoseBlock = 32; ///< frames that are expected from the one before; the first of them is not

bool holds_floats(const std::string& name) {
    static const std::set<std::string_view> kNames = {"mesh.pos", "uv.val", "nrm.val", "col.val",  "scal.val",
                                                      "ck.box",   "bl.u",   "bl.v",    "pose.pos", "pose.grd"};
    return kNames.contains(name);
}

// What is coded by faces or runs: only these, as a code that asks for itself would have no end.
bool holds_records(const std::string& name) { return name == "bl.from"; }
bool holds_faces(const std::string& name) { return name == "mesh.cor" || name == "lev.cor" || name == "bl.cell"; }
bool holds_values(const std::string& name) { return name == "uv.cor" || name == "nrm.cor"; }
bool is_of_poses(const std::string& name) { return name == "pose.pos" || name == "pose.grd"; }

/// Words of four bytes from items of two or four bytes a number.
std::vector<std::uint32_t> words_of(std::string_view bytes, std::size_t size) {
    std::vector<std::uint32_t> words(bytes.size() / size);
    for (std::size_t i = 0; i < words.size(); ++i) std::memcpy(&words[i], bytes.data() + i * size, size);
    if (size == 2) // with their signs, so that small ones are near each other
        for (std::uint32_t& word : words) word = std::uint32_t(std::int32_t(std::int16_t(word)));
    return words;
}

std::string bytes_of(std::span<const std::uint32_t> words, std::size_t size) {
    std::string bytes(words.size() * size, '\0');
    for (std::size_t i = 0; i < words.size(); ++i) std::memcpy(bytes.data() + i * size, &words[i], size);
    return bytes;
}

/// How a section's items are numbers; no columns: they are bytes, doubles, or too long.
struct NumberItems {
    unsigned columns = 0;
    std::size_t size = 4; ///< bytes of a number
};
NumberItems number_items(const FileSection& section) {
    constexpr unsigned kMostColumns = 16;
    const std::string name = name_of(section);
    if (name == "mesh.org" || name == "mesh.num" || name == "pose.fps") return {};
    const std::size_t size = section.item_size % 4 == 0 ? 4 : 2;
    if (section.item_size % size != 0 || section.item_size / size > kMostColumns) return {};
    return {static_cast<unsigned>(section.item_size / size), size};
}

/// A chunk's records: their runs, which record each vertex has, and back.
struct ChunkRecords {
    std::vector<std::uint32_t> cells, counts;
    std::vector<std::uint16_t> records;
};

ChunkRecords runs_of(const SectionGuide& guide, std::uint32_t k) {
    ChunkRecords chunk;
    const std::vector<std::uint32_t> runs = guide.words("bl.run", k);
    for (std::size_t i = 0; i + 1 < runs.size(); i += 2) {
        chunk.cells.push_back(runs[i]);
        chunk.counts.push_back(runs[i + 1]);
    }
    return chunk;
}

/// Where the vertices of chunk k are expected, counted from its first.
std::vector<Expectation> chunk_expectations(const SectionGuide& guide, std::uint32_t k, std::size_t items) {
    const std::vector<Expectation>& all = guide.vertices();
    const std::size_t begin = std::min(all.size(), std::size_t(k) * kChunkVertices);
    std::vector<Expectation> expected(std::min({items, all.size() - begin, kChunkVertices}));
    for (std::size_t i = 0; i < expected.size(); ++i) {
        const auto counted = [&](Index v) { return v == kNoIndex ? kNoIndex : v - static_cast<Index>(begin); };
        const Expectation& of = all[begin + i];
        expected[i] = {counted(of.near), counted(of.across), counted(of.behind)};
    }
    return expected;
}

std::vector<Index> near_of(std::span<const Expectation> expected) {
    std::vector<Index> near;
    for (const Expectation& e : expected) near.push_back(e.near);
    return near;
}

/// Where records are expected: where their vertices are, as long as these hang on the same cell.
std::vector<Expectation> record_expectations(const SectionGuide& guide, std::uint32_t k, std::size_t items) {
    const std::string bytes = guide.bytes("bl.from", k);
    if (bytes.size() != items * sizeof(std::uint16_t)) return {};
    std::vector<Expectation> expected(items);
    ChunkRecords chunk = runs_of(guide, k);
    std::vector<std::uint32_t> cell_of;
    for (std::size_t i = 0; i < chunk.counts.size() && cell_of.size() < items; ++i)
        cell_of.resize(std::min<std::size_t>(cell_of.size() + chunk.counts[i], items), chunk.cells[i]);
    cell_of.resize(items, kNoIndex);
    const std::vector<Expectation> vertices = chunk_expectations(guide, k, items);
    const auto record_of = [&](Index v) {
        std::uint16_t in_block = 0;
        std::memcpy(&in_block, bytes.data() + v * sizeof in_block, sizeof in_block);
        return static_cast<Index>(v / kBlockVertices * kBlockVertices + in_block);
    };
    for (Index v = 0; v < vertices.size(); ++v) {
        const Index own = record_of(v);
        if (own >= items) continue;
        const auto beside = [&](Index u) { // the record of a vertex that hangs on the same cell
            if (u == kNoIndex) return kNoIndex;
            const Index record = record_of(u);
            return record < own && cell_of[record] == cell_of[own] ? record : kNoIndex;
        };
        const Expectation& of = vertices[v];
        Expectation& e = expected[own];
        e = {beside(of.near), beside(of.across), beside(of.behind)};
        if (e.near == kNoIndex) e.near = e.across;
        if (e.across == kNoIndex || e.behind == kNoIndex || e.near == e.across) e.across = e.behind = kNoIndex;
    }
    return expected;
}

/// Of a pose: from the frame before, which stands before it, and what its neighbour did since.
std::vector<Expectation> pose_expectations(const SectionGuide& guide, std::size_t items) {
    const std::vector<Expectation>& driver = guide.driver();
    std::vector<Expectation> expected(items);
    const auto count = static_cast<Index>(items);
    for (Index i = 0; i < count; ++i) {
        Index beside = i < driver.size() ? driver[i].near : kNoIndex;
        if (beside >= i) beside = i > 0 ? i - 1 : kNoIndex;
        expected[i] = beside == kNoIndex ? Expectation{i, kNoIndex, kNoIndex} : Expectation{i, count + beside, beside};
    }
    return expected;
}

struct NumberPlan {
    std::vector<std::uint32_t> known;
    std::vector<Expectation> expected;
};

NumberPlan plan_of(const FileSection& section, const SectionGuide& guide) {
    const std::string name = name_of(section);
    const auto items = static_cast<std::size_t>(section.count);
    if (name == "mesh.pos") return {{}, chunk_expectations(guide, section.index, items)};
    if (name == "uv.val" || name == "nrm.val") {
        const std::string corners = name.substr(0, name.size() - 3) + "cor";
        std::vector<Expectation> expected = guide.values(corners, items);
        if (!expected.empty()) return {{}, std::move(expected)};
    }
    if (name == "uv.val" || name == "nrm.val" || name == "col.val" || name == "scal.val") {
        return {{}, guide.vertices()};
    }
    if (name == "bl.u" || name == "bl.v") return {{}, record_expectations(guide, section.index, items)};
    if (is_of_poses(name) && section.index % kPoseBlock != 0) {
        std::vector<std::uint32_t> before = guide.words(name, section.index - 1);
        if (before.size() * sizeof(std::uint32_t) == section.count * section.item_size)
            return {std::move(before), pose_expectations(guide, items)};
    }
    return {};
}

/// The most items that a byte of a stream can make, as a symbol has no more than all shares but 63.
constexpr std::size_t kMostItemsAByte = 2048;

bool may_hold(std::string_view stream, std::uint64_t items) { return items / kMostItemsAByte <= stream.size(); }

} // namespace

std::vector<std::uint32_t> SectionGuide::words(std::string_view name, std::uint32_t index) const {
    return words_of(fetch_(name, index), sizeof(std::uint32_t));
}

std::vector<Index> SectionGuide::face_offsets(const std::string& name, std::uint32_t index, std::size_t corners) const {
    const std::vector<Index> size = words(name + ".siz", index);
    std::vector<Index> offsets;
    if (size.size() == 1 && size[0] > 0 && corners % size[0] == 0 && corners < kNoIndex) {
        for (std::size_t c = 0; c <= corners; c += size[0]) offsets.push_back(static_cast<Index>(c));
        return offsets;
    }
    offsets = words(name + ".off", index);
    if (offsets.empty() || offsets.front() != 0 || offsets.back() != corners || !std::ranges::is_sorted(offsets))
        return {};
    return offsets;
}

const std::vector<Expectation>& SectionGuide::vertices() const {
    std::call_once(vertices_once_, [&] {
        const std::vector<Index> corners = words("mesh.cor");
        const std::vector<Index> offsets = face_offsets("mesh", 0, corners.size());
        if (offsets.empty()) return;
        Index vertices = 0;
        for (const Index v : corners)
            if (v < corners.size()) vertices = std::max(vertices, v + 1); // more than corners: of no use
        vertices_ = vertex_expectations(offsets, corners, vertices, kChunkVertices);
    });
    return vertices_;
}

const std::vector<Expectation>& SectionGuide::driver() const {
    std::call_once(driver_once_, [&] {
        const std::vector<Index> corners = words("lev.cor");
        const std::vector<Index> offsets = face_offsets("lev", 0, corners.size());
        if (!offsets.empty()) driver_ = vertex_expectations(offsets, corners, corners.size(), kNoIndex);
    });
    return driver_;
}

std::vector<Expectation> SectionGuide::values(const std::string& corners, std::size_t count) const {
    const std::vector<Index> of_corner = words(corners);
    const std::vector<Index> offsets = face_offsets("mesh", 0, of_corner.size());
    if (offsets.empty() || count > of_corner.size()) return {};
    return vertex_expectations(offsets, of_corner, count, kNoIndex);
}

std::string encode_section(const FileSection& section, std::string_view bytes, const SectionGuide& guide) {
    const std::string name = name_of(section);
    std::string best = static_cast<char>(Way::plain) + std::string(bytes);
    const auto offer = [&](Way way, const std::string& stream) {
        if (stream.size() + 1 < best.size()) best = static_cast<char>(way) + stream;
    };
    const NumberItems numbers = number_items(section);
    constexpr std::size_t kWorthwhile = 64; // bytes
    if (numbers.columns == 0 || bytes.size() < kWorthwhile) return best;
    if (holds_records(name)) {
        std::vector<std::uint16_t> records(bytes.size() / sizeof(std::uint16_t));
        std::memcpy(records.data(), bytes.data(), bytes.size());
        const std::vector<Expectation> expected = chunk_expectations(guide, section.index, records.size());
        offer(Way::records,
              encode_records(records, runs_of(guide, section.index).counts, kBlockVertices, near_of(expected)));
        return best;
    }
    const std::vector<std::uint32_t> words = words_of(bytes, numbers.size);
    if (holds_faces(name)) {
        std::vector<Index> offsets;
        if (name == "bl.cell")
            for (Index c = 0; c <= words.size(); c += 3) offsets.push_back(c);
        else
            offsets = guide.face_offsets(name.substr(0, name.size() - 4), section.index, words.size());
        if (!offsets.empty()) {
            offer(Way::corners, encode_corners(offsets, words));
            return best;
        }
    }
    if (holds_values(name)) {
        const std::vector<Index> corners = guide.words("mesh.cor");
        if (corners.size() == words.size()) {
            offer(Way::values, encode_values(corners, words));
            return best;
        }
    }
    const WordLayout layout{numbers.columns, holds_floats(name)};
    const NumberPlan plan = plan_of(section, guide);
    offer(Way::numbers, encode_numbers(plan.known, words, layout, plan.expected));
    if (plan.expected.empty() && !layout.are_floats)
        offer(Way::second_order, encode_numbers({}, words, {numbers.columns, false, true}, {}));
    return best;
}

std::optional<std::string> decode_section(const FileSection& section, std::string_view code,
                                          const SectionGuide& guide) {
    const std::string name = name_of(section);
    const auto items = static_cast<std::size_t>(section.count);
    if (code.empty()) return {};
    const auto way = static_cast<Way>(code[0]);
    const std::string_view stream = code.substr(1);
    if (way == Way::plain) {
        if (stream.size() != section.count * section.item_size) return {};
        return std::string(stream);
    }
    const NumberItems numbers = number_items(section);
    if (numbers.columns == 0 || !may_hold(stream, section.count)) return {};
    std::optional<std::vector<std::uint32_t>> words;
    if (way == Way::records) {
        if (!holds_records(name) || numbers.size != sizeof(std::uint16_t)) return {};
        const std::vector<Expectation> expected = chunk_expectations(guide, section.index, items);
        const std::optional<std::vector<std::uint16_t>> records =
            decode_records(stream, items, runs_of(guide, section.index).counts, kBlockVertices, near_of(expected));
        if (!records) return {};
        words.emplace(records->begin(), records->end());
    } else if (way == Way::corners) {
        std::vector<Index> offsets;
        const std::size_t corners = items * numbers.columns;
        if (name == "bl.cell")
            for (std::size_t c = 0; c <= corners; c += 3) offsets.push_back(static_cast<Index>(c));
        else if (holds_faces(name))
            offsets = guide.face_offsets(name.substr(0, name.size() - 4), section.index, corners);
        if (offsets.empty()) return {};
        words = decode_corners(stream, offsets);
    } else if (way == Way::values) {
        if (!holds_values(name)) return {};
        const std::vector<Index> corners = guide.words("mesh.cor");
        if (corners.size() != items) return {};
        words = decode_values(stream, corners);
    } else if (way == Way::numbers || way == Way::second_order) {
        const WordLayout layout{numbers.columns, holds_floats(name), way == Way::second_order};
        const NumberPlan plan = way == Way::numbers ? plan_of(section, guide) : NumberPlan();
        words = decode_numbers(stream, plan.known, items, layout, plan.expected);
    }
    if (!words || words->size() != items * numbers.columns) return {};
    return bytes_of(*words, numbers.size);
}

} // namespace filigree
