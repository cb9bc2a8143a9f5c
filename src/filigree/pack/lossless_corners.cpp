#include "filigree/pack/lossless_corners.h"

#include "filigree/pack/symbols.h"

#include <algorithm>
#include <array>

namespace filigree {

namespace {

/// The last few different items, the latest first.
template <class T, unsigned kMost>
class Recent {
public:
    static constexpr unsigned kNone = kMost;
    unsigned place_of(const T& item) const {
        for (unsigned k = 0; k < count_; ++k)
            if (items_[k] == item) return k;
        return kNone;
    }
    unsigned count() const { return count_; }
    const T& operator[](unsigned k) const { return items_[k]; }
    /// Puts it in front; place: where it is, or kNone.
    void add(const T& item, unsigned place) {
        const unsigned end = place < count_ ? place : std::min(count_, kMost - 1);
        std::copy_backward(items_.begin(), items_.begin() + end, items_.begin() + end + 1);
        items_[0] = item;
        if (place >= count_) count_ = std::min(count_ + 1, kMost);
    }
    void remove(unsigned place) {
        std::copy(items_.begin() + place + 1, items_.begin() + count_, items_.begin() + place);
        --count_;
    }

private:
    std::array<T, kMost> items_{};
    unsigned count_ = 0;
};

struct ListWriter {
    static constexpr bool writes = true;
    SymbolWriter out;
    void symbol(unsigned context, unsigned& value) { out.symbol(context, value); }
    void number(unsigned context, std::uint32_t& value) { out.number(context, value); }
    void difference(unsigned context, Index& value, Index expected) {
        out.number_with_sign(context, std::int32_t(value - expected));
    }
    bool is_damaged() const { return false; }
};

struct ListReader {
    static constexpr bool writes = false;
    SymbolReader in;
    void symbol(unsigned context, unsigned& value) { value = in.symbol(context); }
    void number(unsigned context, std::uint32_t& value) { value = in.number(context); }
    void difference(unsigned context, Index& value, Index expected) {
        value = expected + Index(in.number_with_sign(context));
    }
    bool is_damaged() const { return in.is_damaged(); }
};

// --- Faces --------------------------------------------------------------------------------------------------------

/// Both sides of the faces' code.
template <class Code>
class Corners {
public:
    Corners(Code& code, std::size_t corners) : code_(code), most_(corners) {}

    /// Codes a face; false: damaged.
    bool face(std::span<Index> face) {
        const auto size = static_cast<unsigned>(face.size());
        if (size == 0) return true;
        unsigned mode = kAlone, turn = 0;
        if constexpr (Code::writes) choose(face, mode, turn);
        code_.symbol(kMode + std::min(last_mode_, kModeContexts - 1), mode);
        last_mode_ = mode;
        unsigned known = 0; // corners from `turn` on
        if (mode == kMoved) {
            if (before_.size() != size) return false;
            for (unsigned k = 0; k < size; ++k) face[k] = before_[k] + stride_;
            known = size;
        } else if (mode >= kEdge) {
            if (mode - kEdge >= edges_.count() || size < 2) return false;
            code_.number(kTurn, turn);
            if (turn >= size) return false;
            const Edge edge = edges_[mode - kEdge];
            face[turn] = edge[0];
            face[(turn + 1) % size] = edge[1];
            known = 2;
        }
        for (; known < size; ++known) {
            Index& v = face[(turn + known) % size];
            const Index behind = known > 0 ? face[(turn + known - 1) % size] : expected_first_;
            vertex(v, behind, mode >= kEdge ? face[turn] : kNoIndex, mode >= kEdge);
            if (code_.is_damaged()) return false;
        }
        remember(face);
        return !code_.is_damaged();
    }

private:
    using Edge = std::array<Index, 2>; ///< as the face on its other side would have it
    // Modes: the face before, moved by as much as that one was; a face with no known edge; an edge of a recent face.
    static constexpr unsigned kMoved = 0, kAlone = 1, kEdge = 2, kEdges = 48;
    // Vertices: the first that never came, one along the border to either side, a recent one, any.
    static constexpr unsigned kNext = 0, kAfter = 1, kBefore = 2, kRecent = 3, kRecentCount = 40,
                              kAny = SymbolModel::kSymbols - 1;
    static constexpr unsigned kModeContexts = 8, kMode = 0, kTurn = kModeContexts, kVertex = kTurn + 1,
                              kDifference = kVertex + 8;

public:
    static constexpr unsigned kContexts = kDifference + 2;

private:
    void choose(std::span<const Index> face, unsigned& mode, unsigned& turn) const {
        bool is_moved = before_.size() == face.size();
        for (std::size_t k = 0; is_moved && k < face.size(); ++k) is_moved = face[k] == before_[k] + stride_;
        if (is_moved) {
            mode = kMoved;
            return;
        }
        unsigned best = kEdges;
        for (unsigned k = 0; k < face.size() && face.size() > 1; ++k) {
            const unsigned place = edges_.place_of({face[k], face[(k + 1) % face.size()]});
            if (place >= best) continue;
            best = place;
            turn = k;
        }
        if (best < kEdges) mode = kEdge + best;
    }

    /// Codes a vertex behind `behind`. first: where the face's known edge begins.
    void vertex(Index& v, Index behind, Index first, bool has_edge) {
        const Index after = border(after_, behind), before = has_edge ? border(before_vertex_, first) : kNoIndex;
        unsigned kind = kAny;
        if constexpr (Code::writes) {
            if (v == next_)
                kind = kNext;
            else if (v == after && after != kNoIndex)
                kind = kAfter;
            else if (v == before && before != kNoIndex)
                kind = kBefore;
            else if (const unsigned place = vertices_.place_of(v); place < kRecentCount)
                kind = kRecent + place;
        }
        code_.symbol(kVertex + 4 * has_edge + std::min(last_kind_, 3u), kind);
        last_kind_ = kind;
        if (kind == kNext)
            v = next_;
        else if (kind == kAfter)
            v = after;
        else if (kind == kBefore)
            v = before;
        else if (kind < kRecent + vertices_.count())
            v = vertices_[kind - kRecent];
        else
            code_.difference(kDifference + has_edge, v, behind);
        vertices_.add(v, vertices_.place_of(v));
        if (v >= next_) next_ = v + 1;
    }

    Index border(const std::vector<Index>& beside, Index v) const { return v < beside.size() ? beside[v] : kNoIndex; }
    void set_border(std::vector<Index>& beside, Index v, Index to) {
        if (v >= most_) return; // more vertices than corners: not worth the memory
        if (v >= beside.size()) beside.resize(v + 1, kNoIndex);
        beside[v] = to;
    }

    void remember(std::span<const Index> face) {
        for (std::size_t k = 0; k < face.size(); ++k) {
            const Edge edge{face[(k + 1) % face.size()], face[k]};
            if (const unsigned known = edges_.place_of({edge[1], edge[0]}); known < kEdges) {
                edges_.remove(known); // both its sides are here now
                continue;
            }
            edges_.add(edge, edges_.place_of(edge));
            set_border(after_, edge[0], edge[1]);
            set_border(before_vertex_, edge[1], edge[0]);
        }
        stride_ = before_.empty() ? 0 : face[0] - before_[0];
        before_.assign(face.begin(), face.end());
        expected_first_ = face[0];
    }

    Code& code_;
    std::size_t most_;
    Recent<Edge, kEdges> edges_;
    Recent<Index, kRecentCount> vertices_;
    std::vector<Index> after_, before_vertex_; ///< of each vertex, its neighbours along edges with one face so far
    std::vector<Index> before_;                ///< the face before
    Index stride_ = 0, next_ = 0, expected_first_ = 0;
    unsigned last_mode_ = kAlone, last_kind_ = kNext;
};

// --- Values of corners --------------------------------------------------------------------------------------------

/// Codes the value of each corner, and has `values` as long as they are known.
template <class Code>
bool code_values(Code& code, std::span<const Index> corners, std::vector<Index>& values) {
    constexpr unsigned kSame = 0, kNext = 1, kNone = 2, kRecent = 3, kRecentCount = 24, kOther = 63;
    constexpr unsigned kDifference = 3;
    std::vector<Index> latest; // value of each vertex
    Recent<Index, kRecentCount> recent;
    Index next = 0, before = 0;
    for (std::size_t c = 0; c < corners.size(); ++c) {
        const Index vertex = corners[c];
        const Index last = vertex < latest.size() ? latest[vertex] : kNoIndex;
        if constexpr (!Code::writes) values.push_back(kNoIndex);
        Index& value = values[c];
        unsigned kind = kOther;
        if constexpr (Code::writes) {
            if (value == kNoIndex)
                kind = kNone;
            else if (value == last)
                kind = kSame;
            else if (value == next)
                kind = kNext;
            else if (const unsigned place = recent.place_of(value); place < kRecentCount)
                kind = kRecent + place;
        }
        code.symbol(last == kNoIndex ? 0 : before == last ? 1 : 2, kind);
        if (kind == kNone)
            value = kNoIndex;
        else if (kind == kSame)
            value = last;
        else if (kind == kNext)
            value = next;
        else if (kind < kRecent + recent.count())
            value = recent[kind - kRecent];
        else
            code.difference(kDifference, value, before);
        if (code.is_damaged()) return false;
        if (value == kNoIndex) continue;
        recent.add(value, recent.place_of(value));
        next = std::max(next, value + 1);
        before = value;
        if (vertex >= corners.size()) continue;
        if (vertex >= latest.size()) latest.resize(vertex + 1, kNoIndex);
        latest[vertex] = value;
    }
    return true;
}

// --- Records of blocks --------------------------------------------------------------------------------------------

template <class Code>
bool code_records(Code& code, std::span<const std::uint32_t> runs, std::size_t block, std::size_t vertices,
                  std::span<const Index> near, std::vector<std::uint16_t>& records) {
    constexpr unsigned kNear = 0, kRecent = 1, kRecentCount = 32, kOther = 63, kDifference = 2;
    std::vector<Index> run_of; // of each vertex
    std::size_t run = 0;
    for (std::size_t begin = 0; begin < vertices; begin += block) {
        const std::size_t end = std::min(begin + block, vertices);
        std::vector<std::uint32_t> starts, next; // of the block's runs
        const std::size_t first = run;
        std::uint64_t sum = 0;
        for (; run < runs.size() && sum < end - begin; ++run) {
            starts.push_back(static_cast<std::uint32_t>(sum));
            sum += runs[run];
        }
        next = starts;
        Recent<Index, kRecentCount> recent;
        Index before = 0;
        for (std::size_t v = begin; v < end; ++v) {
            if constexpr (!Code::writes) records.push_back(0);
            Index record = records[v];
            const Index from = v < near.size() ? near[v] : kNoIndex;
            const Index beside = from < v && from >= begin ? run_of[from] : kNoIndex;
            unsigned kind = kOther;
            if constexpr (Code::writes) {
                if (beside != kNoIndex && next[beside - first] == record)
                    kind = kNear;
                else
                    for (unsigned k = recent.count(); k-- > 0;)
                        if (next[recent[k] - first] == record) kind = kRecent + k;
            }
            code.symbol(beside != kNoIndex, kind);
            if (kind == kNear && beside != kNoIndex)
                record = next[beside - first];
            else if (kind >= kRecent && kind - kRecent < recent.count())
                record = next[recent[kind - kRecent] - first];
            else
                code.difference(kDifference, record, before);
            if (code.is_damaged()) return false;
            records[v] = static_cast<std::uint16_t>(record);
            before = record;
            const auto at = std::upper_bound(starts.begin(), starts.end(), record);
            run_of.push_back(kNoIndex);
            if (at == starts.begin()) continue;
            const auto own = static_cast<Index>(first + std::size_t(at - starts.begin()) - 1);
            run_of.back() = own;
            next[own - first] = record + 1;
            recent.add(own, recent.place_of(own));
        }
    }
    return true;
}

constexpr unsigned kValueContexts = 4, kRecordContexts = 3;

} // namespace

std::string encode_corners(std::span<const Index> face_offsets, std::span<const Index> corners) {
    ListWriter code{SymbolWriter(Corners<ListWriter>::kContexts)};
    Corners<ListWriter> faces(code, corners.size());
    std::vector<Index> face;
    for (std::size_t f = 0; f + 1 < face_offsets.size(); ++f) {
        face.assign(corners.begin() + face_offsets[f], corners.begin() + face_offsets[f + 1]);
        faces.face(face);
    }
    return code.out.finish();
}

std::optional<std::vector<Index>> decode_corners(std::string_view stream, std::span<const Index> face_offsets) {
    ListReader code{SymbolReader(stream, Corners<ListReader>::kContexts)};
    std::vector<Index> corners;
    Corners<ListReader> faces(code, face_offsets.empty() ? 0 : face_offsets.back());
    for (std::size_t f = 0; f + 1 < face_offsets.size(); ++f) {
        corners.resize(face_offsets[f + 1], 0);
        if (!faces.face(std::span(corners).subspan(face_offsets[f]))) return {};
    }
    return corners;
}

std::string encode_values(std::span<const Index> corners, std::span<const Index> values) {
    ListWriter code{SymbolWriter(kValueContexts)};
    std::vector<Index> known(values.begin(), values.end());
    code_values(code, corners.first(values.size()), known);
    return code.out.finish();
}

std::optional<std::vector<Index>> decode_values(std::string_view stream, std::span<const Index> corners) {
    ListReader code{SymbolReader(stream, kValueContexts)};
    std::vector<Index> values;
    if (!code_values(code, corners, values)) return {};
    return values;
}

std::string encode_records(std::span<const std::uint16_t> records, std::span<const std::uint32_t> runs,
                           std::size_t block, std::span<const Index> near) {
    ListWriter code{SymbolWriter(kRecordContexts)};
    std::vector<std::uint16_t> known(records.begin(), records.end());
    code_records(code, runs, block, records.size(), near, known);
    return code.out.finish();
}

std::optional<std::vector<std::uint16_t>> decode_records(std::string_view stream, std::size_t vertices,
                                                         std::span<const std::uint32_t> runs, std::size_t block,
                                                         std::span<const Index> near) {
    ListReader code{SymbolReader(stream, kRecordContexts)};
    std::vector<std::uint16_t> records;
    if (!code_records(code, runs, block, vertices, near, records)) return {};
    return records;
}

} // namespace filigree
