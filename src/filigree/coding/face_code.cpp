#include "filigree/coding/face_code.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace filigree {

namespace {

constexpr unsigned kPlain = kConnectivityContexts, kCut = kPlain + 1, kCopies = kCut + 6, kCopyAt = kCopies + 1,
                   kOddFaces = kCopyAt + 1, kOddSize = kOddFaces + 1;
static_assert(kOddSize < kFaceContexts);

/// Bits that name one of `count`.
unsigned bits_for(std::size_t count) { return count > 1 ? unsigned(std::bit_width(count - 1)) : 0; }

/// Faces as triangles: a fan from the first corner of each.
struct FanTriangles {
    std::vector<Triangle> triangles;
    std::vector<Index> face, place; ///< of each triangle: its face; its second corner there

    Index corner(Index half_edge) const {
        const Index t = half_edge / 3, k = half_edge % 3;
        return k == 0 ? 0 : place[t] + k - 1;
    }
};

struct FaceSpans {
    std::span<const Index> offsets, corners;
    std::size_t size() const { return offsets.empty() ? 0 : offsets.size() - 1; }
    std::span<const Index> operator[](std::size_t f) const {
        return corners.subspan(offsets[f], offsets[f + 1] - offsets[f]);
    }
};

bool repeats_a_vertex(std::span<const Index> face) {
    std::vector<Index> sorted(face.begin(), face.end());
    std::ranges::sort(sorted);
    return std::ranges::adjacent_find(sorted) != sorted.end();
}

FanTriangles fans_of(const FaceSpans& faces, const std::vector<bool>& is_odd) {
    FanTriangles fans;
    for (Index f = 0; f < faces.size(); ++f) {
        if (is_odd[f]) continue;
        const auto face = faces[f];
        for (Index k = 1; k + 1 < face.size(); ++k) {
            fans.triangles.push_back({face[0], face[k], face[k + 1]});
            fans.face.push_back(f);
            fans.place.push_back(k);
        }
    }
    return fans;
}

/// Whether a half-edge is a cut through its face: its own triangle's neighbour in the fan is behind it.
bool is_cut(const FanTriangles& fans, const ClosedMap& map, Index half_edge) {
    const Index behind = map.opposite[half_edge] / 3, t = half_edge / 3;
    return behind < fans.triangles.size() && fans.face[behind] == fans.face[t] &&
           (half_edge % 3 == 0 ? fans.place[behind] + 1 == fans.place[t]
                               : half_edge % 3 == 2 && fans.place[behind] == fans.place[t] + 1);
}

/// The surface of the faces that lie in one; the others become odd.
ClosedSurface surface_of(const FaceSpans& faces, std::vector<bool>& is_odd, FanTriangles& fans) {
    for (;;) {
        fans = fans_of(faces, is_odd);
        ClosedSurface surface = make_closed_surface(fans.triangles);
        bool is_changed = false;
        for (Index t = 0; t < fans.triangles.size(); ++t) {
            const Index f = fans.face[t];
            const bool has_next = fans.place[t] + 2 < faces[f].size();
            if (has_next && !is_cut(fans, surface.map, 3 * t + 2)) is_odd[f] = is_changed = true;
        }
        if (!is_changed) return surface;
    }
}

/// Polygons out of triangles: what lies between cuts, in the order of their first triangles.
class Polygons {
public:
    /// cuts: of each half-edge, both sides; empty: none. False: that is no set of polygons.
    static bool assemble(const ClosedMap& map, const std::vector<bool>& cuts, WalkedFaces& walked) {
        if (cuts.empty()) return triangles(map, walked);
        std::vector<bool> is_done(map.triangles.size(), false);
        walked.corners.reserve(3 * map.triangles.size());
        walked.half_edges.reserve(3 * map.triangles.size());
        walked.face_offsets.reserve(map.triangles.size() + 1);
        for (Index t = 0; t < map.triangles.size(); ++t) {
            if (is_done[t] || !map.is_own(map.triangles[t])) continue;
            Index start = 3 * t;
            while (start < 3 * t + 3 && cuts[start]) ++start;
            if (start == 3 * t + 3) { // cut on all sides: the outline starts at a neighbour's
                start = outline_near(map, cuts, 3 * t);
                if (start == kNoIndex) return false;
            }
            const std::size_t begin = walked.corners.size();
            for (Index h = start;;) {
                is_done[h / 3] = true;
                walked.corners.push_back(walked.number[map.origin(h)]);
                walked.half_edges.push_back(h);
                if (walked.corners.size() - begin > 3 * map.triangles.size()) return false;
                for (h = next_half_edge(h); cuts[h]; h = next_half_edge(map.opposite[h])) {
                    is_done[map.opposite[h] / 3] = true;
                    if (h == start) return false;
                }
                if (h == start) break;
            }
            if (walked.corners.size() - begin < 3) return false;
            walked.face_offsets.push_back(static_cast<Index>(walked.corners.size()));
        }
        return true;
    }

private:
    static bool triangles(const ClosedMap& map, WalkedFaces& walked) {
        walked.corners.reserve(3 * map.triangles.size());
        walked.half_edges.reserve(3 * map.triangles.size());
        walked.face_offsets.reserve(map.triangles.size() + 1);
        for (Index t = 0; t < map.triangles.size(); ++t) {
            const Triangle& triangle = map.triangles[t];
            if (!map.is_own(triangle)) continue;
            for (const Index v : triangle) walked.corners.push_back(walked.number[v]);
            walked.half_edges.insert(walked.half_edges.end(), {3 * t, 3 * t + 1, 3 * t + 2});
            walked.face_offsets.push_back(static_cast<Index>(walked.corners.size()));
        }
        return true;
    }
    static Index outline_near(const ClosedMap& map, const std::vector<bool>& cuts, Index half_edge) {
        Index h = half_edge;
        for (std::size_t turn = 0; turn < map.opposite.size(); ++turn) {
            if (!cuts[h]) return h;
            h = next_half_edge(map.opposite[h]);
        }
        return kNoIndex;
    }
};

/// Whether an edge is expected to be a cut: in a grid a triangle and its neighbour are each other turned by half a
/// turn, so their cuts lie alike beside the edge that they share. 0: it is, 1: it is not, 2: no neighbour tells.
unsigned expectation(const ClosedMap& map, const std::vector<bool>& cuts, Index half_edge) {
    for (const Index shared : {next_half_edge(half_edge), previous_half_edge(half_edge)}) {
        const Index other = map.opposite[shared];
        if (other > half_edge || !map.is_own(map.triangles[other / 3])) continue; // not known yet, or of a hole
        if (cuts[next_half_edge(other)]) return next_half_edge(shared) == half_edge ? 0 : 1;
        if (cuts[previous_half_edge(other)]) return previous_half_edge(shared) == half_edge ? 0 : 1;
    }
    return 2;
}

/// Which edges are cuts, an edge once, from the side that is walked first. `code` writes or reads.
template <class Code>
std::vector<bool> code_cuts(const ClosedMap& map, const Code& code) {
    std::vector<bool> cuts(map.opposite.size(), false);
    std::vector<std::uint8_t> joined(map.triangles.size(), 0);
    for (Index h = 0; h < map.opposite.size(); ++h) {
        const Index o = map.opposite[h];
        if (o < h || !map.is_own(map.triangles[h / 3]) || !map.is_own(map.triangles[o / 3])) continue;
        std::uint8_t &a = joined[h / 3], &b = joined[o / 3];
        const bool cut = code(kCut + (a + b > 0 ? 2 + std::min(unsigned(a + b), 3u) : expectation(map, cuts, h)), h);
        if (!cut) continue;
        cuts[h] = cuts[o] = true;
        a = std::min<std::uint8_t>(a + 1, 2);
        b = std::min<std::uint8_t>(b + 1, 2);
    }
    return cuts;
}

} // namespace

std::vector<std::size_t> WalkedFaces::first_with_number() const {
    std::vector<std::size_t> first(met, number.size());
    for (std::size_t w = number.size(); w-- > 0;)
        if (number[w] != kNoIndex) first[number[w]] = w;
    return first;
}

EncodedFaces encode_faces(std::span<const Index> face_offsets, std::span<const Index> corners, std::size_t vertices,
                          SymbolWriter& out) {
    const MapCode in_one_piece = [&](const ClosedSurface& surface, const FaceCorner&) {
        return encode_connectivity(surface.map, out);
    };
    return encode_faces(face_offsets, corners, vertices, in_one_piece, out);
}

EncodedFaces encode_faces(std::span<const Index> face_offsets, std::span<const Index> corners, std::size_t vertices,
                          const MapCode& code_map, SymbolWriter& out) {
    const FaceSpans faces{face_offsets, corners};
    std::vector<bool> is_odd(faces.size());
    bool all_triangles = true;
    for (std::size_t f = 0; f < faces.size(); ++f) {
        is_odd[f] = repeats_a_vertex(faces[f]);
        all_triangles = all_triangles && faces[f].size() == 3;
    }
    FanTriangles fans;
    const ClosedSurface surface = surface_of(faces, is_odd, fans);
    WalkedMap walk = code_map(
        surface, [&](Index half_edge) { return face_offsets[fans.face[half_edge / 3]] + fans.corner(half_edge); });

    EncodedFaces encoded;
    WalkedFaces& walked = encoded.walked;
    const auto source_of = [&](Index half_edge) { // in the surface's map
        Index source = walk.half_edge[half_edge / 3];
        for (Index k = 0; k < half_edge % 3; ++k) source = next_half_edge(source);
        return source;
    };
    out.symbol(kPlain, all_triangles);
    std::vector<bool> cuts; // none: all are triangles
    if (!all_triangles)
        cuts = code_cuts(walk.map, [&](unsigned context, Index h) {
            const bool cut = is_cut(fans, surface.map, source_of(h));
            out.symbol(context, cut);
            return cut;
        });

    // Numbers, in the order of the walk; who had one before is a copy.
    std::vector<Index> number_of(vertices, kNoIndex);
    std::vector<std::pair<Index, Index>> copies; // the map's vertex, and its number
    walked.number.assign(walk.vertex.size(), kNoIndex);
    for (Index w = 0; w < walk.vertex.size(); ++w) {
        const Index v = surface.source[walk.vertex[w]];
        if (v == kNoIndex) continue;
        if (number_of[v] != kNoIndex) {
            copies.emplace_back(w, number_of[v]);
        } else {
            number_of[v] = static_cast<Index>(encoded.vertex.size());
            encoded.vertex.push_back(v);
        }
        walked.number[w] = number_of[v];
    }
    walked.met = encoded.vertex.size();
    out.number(kCopies, static_cast<std::uint32_t>(copies.size()));
    Index before = 0;
    for (const auto& [w, number] : copies) {
        out.number(kCopyAt, w - std::exchange(before, w));
        out.bits(number, bits_for(vertices));
    }
    for (Index v = 0; v < vertices; ++v)
        if (number_of[v] == kNoIndex) {
            number_of[v] = static_cast<Index>(encoded.vertex.size());
            encoded.vertex.push_back(v);
        }

    Polygons::assemble(walk.map, cuts, walked);
    for (std::size_t f = 0; f + 1 < walked.face_offsets.size(); ++f) {
        const Index source = source_of(walked.half_edges[walked.face_offsets[f]]);
        encoded.face.push_back(fans.face[source / 3]);
        encoded.first_corner.push_back(fans.corner(source));
    }
    out.number(kOddFaces, static_cast<std::uint32_t>(std::ranges::count(is_odd, true)));
    for (Index f = 0; f < faces.size(); ++f) {
        if (!is_odd[f]) continue;
        out.number(kOddSize, static_cast<std::uint32_t>(faces[f].size()));
        for (const Index v : faces[f]) {
            out.bits(number_of[v], bits_for(vertices));
            walked.corners.push_back(number_of[v]);
        }
        walked.face_offsets.push_back(static_cast<Index>(walked.corners.size()));
        encoded.face.push_back(f);
        encoded.first_corner.push_back(0);
    }
    walked.map = std::move(walk.map);
    return encoded;
}

std::optional<WalkedFaces> decode_faces(SymbolReader& in, std::size_t vertices, std::size_t corners) {
    std::optional<WalkedMap> walk = decode_connectivity(in, most_triangles(corners));
    if (!walk) return std::nullopt;
    return decode_faces(std::move(walk->map), in, vertices, corners);
}

std::optional<WalkedFaces> decode_faces(ClosedMap map, SymbolReader& in, std::size_t vertices, std::size_t corners) {
    WalkedFaces walked;
    walked.map = std::move(map);
    std::vector<bool> cuts;
    if (in.symbol(kPlain) == 0) {
        if (walked.map.opposite.empty())
            walked.map = map_of(std::move(walked.map.triangles), std::move(walked.map.closes_hole));
        if (std::ranges::find(walked.map.opposite, kNoIndex) != walked.map.opposite.end()) return std::nullopt;
        cuts = code_cuts(walked.map, [&](unsigned context, Index) { return in.symbol(context) != 0; });
    }

    std::vector<Index> copy_of(walked.map.vertex_count(), kNoIndex);
    const std::uint32_t copies = in.number(kCopies);
    for (std::uint64_t k = 0, at = 0; k < copies; ++k) {
        at += in.number(kCopyAt);
        if (at >= copy_of.size() || in.is_damaged()) return std::nullopt;
        copy_of[at] = in.bits(bits_for(vertices));
    }
    walked.number.assign(walked.map.vertex_count(), kNoIndex);
    for (std::size_t w = 0; w < walked.number.size(); ++w) {
        if (walked.map.closes_hole[w]) continue;
        if (copy_of[w] != kNoIndex && copy_of[w] >= walked.met) return std::nullopt;
        walked.number[w] = copy_of[w] != kNoIndex ? copy_of[w] : static_cast<Index>(walked.met++);
    }
    if (walked.met > vertices || !Polygons::assemble(walked.map, cuts, walked)) return std::nullopt;
    const std::uint32_t odd_faces = in.number(kOddFaces);
    for (std::uint32_t f = 0; f < odd_faces; ++f) {
        const std::uint32_t size = in.number(kOddSize);
        if (size < 3 || size > corners || in.is_damaged()) return std::nullopt;
        for (std::uint32_t k = 0; k < size && !in.is_damaged(); ++k) {
            walked.corners.push_back(in.bits(bits_for(vertices)));
            if (walked.corners.back() >= vertices) return std::nullopt;
        }
        walked.face_offsets.push_back(static_cast<Index>(walked.corners.size()));
    }
    if (in.is_damaged() || walked.corners.size() != corners) return std::nullopt;
    return walked;
}

} // namespace filigree
