#include "filigree/pack/attribute_code.h"

#include "filigree/core/math.h"
#include "filigree/mesh/edges.h"
#include "filigree/pack/integer_frame.h"
#include "filigree/pack/wedge.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace filigree {

namespace {

struct AttributeDamage {};

/// Contexts. kUv: how it is expected, axis, size of differences nearby. kNormal: what it is expected from, axis, size.
constexpr unsigned kSizes = 12, kCount = 0, kPlainValue = kCount + 1, kKind = kPlainValue + 3, kOlderValue = kKind + 17,
                   kColorStep = kOlderValue + 1, kScalarBits = kColorStep + 4, kLabel = kScalarBits + 1,
                   kUv = kLabel + 2, kNormalGuess = kUv + 3 * 2 * kSizes, kNormal = kNormalGuess + 4,
                   kAttributeEnd = kNormal + 3 * 2 * kSizes;
static_assert(kAttributeEnd <= kAttributeContexts);

constexpr unsigned kPlainBits = 10;
constexpr double kGuessBits = 4;          // what it takes to expect a normal from something else than the last one
constexpr std::int64_t kOctahedron = 352; // steps from the middle of an octahedron's square to its border

Wide wide(const FinePlace& place) { return {place[0], place[1], place[2]}; }

/// A quotient in 65,536ths, of numbers that doubles hold exactly. Alike on every machine: one quotient, and a product
/// with a power of two.
std::int64_t fixed_quotient(double value, double by) {
    return std::int64_t(std::clamp(value / by, -64.0, 64.0) * 65536.0);
}

/// Of numbers below 2^50: one root, as every machine rounds it.
double length_of(Wide v) {
    const std::int64_t largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    const int shift = std::max(0, int(std::bit_width(std::uint64_t(largest))) - 25);
    for (std::int64_t& x : v) x /= std::int64_t{1} << shift;
    return std::ldexp(std::sqrt(double(dot(v, v))), shift);
}

/// A frame around a direction that has no other.
Frame frame_around(const Wide& direction) {
    std::size_t least = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (std::abs(direction[k]) < std::abs(direction[least])) least = k;
    Wide ahead{};
    ahead[least] = kOne;
    return {direction, ahead};
}

/// Steps on an octahedron's square around the frame's first axis [Meyer et al. 2010].
std::array<std::int32_t, 2> octahedral(const Vec3f& normal, const Frame& frame) {
    std::array<double, 3> along{};
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t j = 0; j < 3; ++j) along[k] += double(normal[int(j)]) * double(frame.axes[k][j]);
        sum += std::abs(along[k]);
    }
    double u = along[1] / sum, v = along[2] / sum;
    if (along[0] < 0) {
        const double folded = std::copysign(1 - std::abs(v), u);
        v = std::copysign(1 - std::abs(u), v);
        u = folded;
    }
    return {static_cast<std::int32_t>(std::lround(u * kOctahedron)),
            static_cast<std::int32_t>(std::lround(v * kOctahedron))};
}

Wide from_octahedral(std::int64_t u, std::int64_t v, const Frame& frame) {
    const std::int64_t w = kOctahedron - std::abs(u) - std::abs(v);
    if (w < 0) {
        const std::int64_t unfolded = (kOctahedron - std::abs(v)) * (u < 0 ? -1 : 1);
        v = (kOctahedron - std::abs(u)) * (v < 0 ? -1 : 1);
        u = unfolded;
    }
    Wide sum{};
    for (std::size_t j = 0; j < 3; ++j) sum[j] = w * frame.axes[0][j] + u * frame.axes[1][j] + v * frame.axes[2][j];
    normalise(sum);
    return sum;
}

/// `Code` writes or reads numbers; what it is given is what a reader will have.
template <class Code>
class Attributes {
public:
    Attributes(Code& code, Mesh& mesh, std::span<const FinePlace> places) : code_(code), mesh_(mesh), places_(places) {}

    void run() {
        uvs();
        normals();
        colors();
        for (VertexScalar& scalar : mesh_.scalars) scalars(scalar.values);
        labels(mesh_.objects.of_face);
        labels(mesh_.groups.of_face);
        labels(mesh_.materials.of_face);
        labels(mesh_.smoothing);
    }

private:
    using Steps = std::array<std::int32_t, 3>;

    // --- Values at corners -----------------------------------------------------------------------------------------

    /// Where a value is met first.
    struct Fresh {
        std::size_t face, corner;     ///< the corner's place in its face; no face: a vertex of none
        std::span<const Index> known; ///< of each corner of the face its value, kNoIndex where it is not known yet
        Index before;                 ///< another value that is known, kNoIndex: none is
    };
    /// An edge's ends, as corners of another face; kNoIndex: there is none.
    struct Edge {
        Index from = kNoIndex, to = kNoIndex;
    };
    static constexpr std::size_t kNoFace = ~std::size_t{0};

    /// Says which value each corner has, and calls code_value(value, fresh) once for each, in the reader's order:
    /// in each face first the corners of vertices that have one.
    template <class T, class CodeValue>
    void walk(CornerAttribute<T>& attribute, bool is_indexed, const CodeValue& code_value) {
        if (behind_.empty()) {
            polygons_ = PolygonCorners(mesh_.face_offsets);
            find_behind();
        }
        const auto count = static_cast<Index>(attribute.values.size());
        std::vector<Index> latest(mesh_.vertex_count(), kNoIndex), known, order;
        Index next = 0, before = kNoIndex;
        for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
            const auto face = mesh_.face(f);
            known.assign(face.size(), kNoIndex);
            known_first(face, latest, order);
            find_edges(f);
            for (const Index k : order) {
                Index& last = latest[face[k]];
                Index value = face[k];
                bool is_new = last == kNoIndex;
                if (is_indexed) {
                    Index& named = attribute.corners[mesh_.face_offsets[f] + k];
                    const Candidate candidate = candidate_at(k, last, known, attribute.corners);
                    std::uint32_t kind = named == kNoIndex          ? kNone
                                         : named == candidate.value ? kCandidate
                                         : named == next            ? kNew
                                         : named == last            ? kLast
                                                                    : kOlder;
                    code_.number(kKind + candidate.context, kind);
                    is_new = kind == kNew && next < count;
                    value = is_new               ? next++
                            : kind == kCandidate ? candidate.value
                            : kind == kLast      ? last
                            : kind == kNone      ? kNoIndex
                                                 : older(named, next);
                    if (kind != kNone && value == kNoIndex) throw AttributeDamage();
                    named = value;
                }
                if (is_new) code_value(value, Fresh{f, k, known, before});
                if (value != kNoIndex) known[k] = last = before = value;
                code_.check();
            }
        }
        for (Index v = 0; v < mesh_.vertex_count() && !is_indexed; ++v) {
            if (latest[v] != kNoIndex) continue;
            code_value(v, Fresh{kNoFace, 0, {}, before});
            before = v;
        }
        if (is_indexed && next != count) throw AttributeDamage();
    }
    /// Which value a corner has: the one that is expected, a new one, none, an older one, or its vertex's last one.
    enum ValueKind : std::uint32_t { kCandidate, kNew, kNone, kOlder, kLast };

    /// The value that a corner is expected to have, and how sure that is.
    struct Candidate {
        Index value;
        unsigned context;
    };
    /// Edges on whose other end the face and the one behind agree are no seams.
    Candidate candidate_at(Index k, Index last, std::span<const Index> known, const std::vector<Index>& values) const {
        if (last == kNoIndex) return {kNoIndex, 16};
        const std::size_t n = known.size(), k_before = (k + n - 1) % n, k_after = (k + 1) % n;
        const auto state = [&](Index here, Index there) { // 0: nothing behind, 1: not known, 2: they agree, 3: a seam
            return there == kNoIndex ? 0u : here == kNoIndex ? 1u : here == values[there] ? 2u : 3u;
        };
        const Edge &before = edges_[k_before], &after = edges_[k];
        const unsigned by_before = state(known[k_before], before.from), by_after = state(known[k_after], after.to);
        Candidate candidate{last, 4 * by_before + by_after};
        for (const unsigned wanted : {1u, 2u}) { // the surest last
            if (by_before == wanted && values[before.to] != kNoIndex) candidate.value = values[before.to];
            if (by_after == wanted && values[after.from] != kNoIndex) candidate.value = values[after.from];
        }
        return candidate;
    }

    /// For each corner, the last corner of an earlier face to which its face comes along the same edge from the other
    /// end; kNoIndex: there is none.
    void find_behind() {
        const auto vertex_before = [&](Index corner) { return mesh_.corners[polygons_.previous(corner)]; };
        const IndexLists edges = edges_from(mesh_.vertex_count(), [&](const auto& add) {
            for (Index c = 0; c < mesh_.corner_count(); ++c) add(vertex_before(c), mesh_.corners[c], c);
        });
        behind_.assign(mesh_.corner_count(), kNoIndex);
        for (const std::span<const Index> edge : edges) {
            const Index to = mesh_.corners[edge[0]];
            const bool is_loop = to == vertex_before(edge[0]);
            // the last corner at `to`, and at the other end: of earlier faces, and of the face at hand
            std::array<Index, 2> last = {kNoIndex, kNoIndex}, own = last;
            for (std::size_t i = 0; i < edge.size(); ++i) {
                if (i > 0 && polygons_.face(edge[i]) != polygons_.face(edge[i - 1]))
                    for (std::size_t end = 0; end < 2; ++end)
                        if (own[end] != kNoIndex) last[end] = std::exchange(own[end], kNoIndex);
                const std::size_t end = mesh_.corners[edge[i]] != to;
                behind_[edge[i]] = last[is_loop ? end : 1 - end];
                own[end] = edge[i];
            }
        }
    }

    /// Finds, for each edge of a face, its ends as corners of an earlier face: the last one.
    void find_edges(std::size_t f) {
        const auto face = mesh_.face(f);
        edges_.assign(face.size(), {});
        for (std::size_t k = 0; k < face.size(); ++k)
            if (const Index corner = behind_[mesh_.face_offsets[f] + (k + 1) % face.size()]; corner != kNoIndex)
                edges_[k] = {corner, polygons_.previous(corner)};
    }

    /// A face's corners: those of vertices that have a value, then the others.
    static void known_first(std::span<const Index> face, const std::vector<Index>& latest, std::vector<Index>& order) {
        order.clear();
        for (const bool is_late : {false, true})
            for (Index k = 0; k < face.size(); ++k)
                if ((latest[face[k]] == kNoIndex) == is_late) order.push_back(k);
    }
    /// Numbers values in the order in which a walk meets them; those that no corner names are dropped.
    template <class T>
    void number_values(CornerAttribute<T>& attribute) const {
        std::vector<Index> number(attribute.values.size(), kNoIndex), latest(mesh_.vertex_count(), kNoIndex), order;
        std::vector<T> values;
        for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
            const auto face = mesh_.face(f);
            known_first(face, latest, order);
            for (const Index k : order) {
                Index& value = attribute.corners[mesh_.face_offsets[f] + k];
                if (value == kNoIndex) continue;
                if (number[value] == kNoIndex) {
                    number[value] = static_cast<Index>(values.size());
                    values.push_back(attribute.values[value]);
                }
                latest[face[k]] = value = number[value];
            }
        }
        attribute.values = std::move(values);
        if (attribute.values.empty()) attribute.corners.clear();
    }
    Index older(Index named, Index next) {
        std::uint32_t back = next - 1 - named;
        code_.number(kOlderValue, back);
        if (back >= next) throw AttributeDamage();
        return next - 1 - back;
    }

    /// False: there are none. Sizes the attribute for a reader.
    template <class T>
    bool counted(CornerAttribute<T>& attribute, bool& is_indexed) {
        if (code_.writes && !attribute.per_vertex()) number_values(attribute);
        auto count = static_cast<std::uint32_t>(attribute.values.size());
        std::uint32_t indexed = !attribute.per_vertex();
        code_.number(kCount, count);
        if (count == 0) return false;
        code_.number(kCount, indexed);
        is_indexed = indexed != 0;
        if (is_indexed ? count > mesh_.corner_count() : count != mesh_.vertex_count()) throw AttributeDamage();
        attribute.values.resize(count);
        if (is_indexed) attribute.corners.resize(mesh_.corner_count(), kNoIndex);
        return true;
    }

    /// Rounds `values` to so many bits along their longest side.
    template <class T>
    std::vector<Steps> quantised(std::vector<T>& values, unsigned bits, T& low, float& step) {
        constexpr int n = int(T::RowsAtCompileTime);
        std::vector<Steps> steps(values.size());
        low = T::Zero();
        step = 0;
        if (code_.writes) {
            low = values[0];
            T high = low;
            for (const T& v : values) {
                low = low.cwiseMin(v);
                high = high.cwiseMax(v);
            }
            step = std::max((high - low).maxCoeff(), 1e-30f) / float((1u << bits) - 1);
            for (std::size_t i = 0; i < values.size(); ++i)
                for (int k = 0; k < n; ++k)
                    steps[i][std::size_t(k)] = static_cast<std::int32_t>(std::lround((values[i][k] - low[k]) / step));
        }
        for (int k = 0; k < n; ++k) code_.real(low[k]);
        code_.real(step);
        return steps;
    }
    template <class T>
    static void fill(std::vector<T>& values, const std::vector<Steps>& steps, const T& low, float step) {
        for (std::size_t i = 0; i < values.size(); ++i)
            for (int k = 0; k < int(T::RowsAtCompileTime); ++k)
                values[i][k] = low[k] + step * float(steps[i][std::size_t(k)]);
    }

    // --- Texture coordinates ---------------------------------------------------------------------------------------

    /// Where a value is expected.
    struct Guess {
        unsigned kind = 0; ///< 0: at another one, 1: as in space beside an edge, 2: as in the face behind the edge
        std::array<std::int64_t, 2> steps{};
        std::uint32_t size = 0; ///< of differences nearby
    };

    void uvs() {
        bool is_indexed = false;
        if (!counted(mesh_.uvs, is_indexed)) return;
        Vec2f low;
        float step = 0;
        std::vector<Steps> steps = quantised(mesh_.uvs.values, kUvBits, low, step);
        std::vector<std::uint16_t> sizes(steps.size(), 0);
        walk(mesh_.uvs, is_indexed, [&](Index value, const Fresh& fresh) {
            const Guess guess = expected_uv(fresh, steps, sizes);
            std::uint32_t size = 0;
            for (unsigned k = 0; k < 2; ++k) {
                std::int32_t& s = steps[value][k];
                const auto expected = std::int32_t(std::clamp<std::int64_t>(guess.steps[k], -1 << 20, 1 << 20));
                code_.difference(kUv + (guess.kind * 2 + k) * kSizes + size_class(guess.size + 2 * size, kSizes), s,
                                 expected);
                s = std::clamp(s, -(1 << 24), 1 << 24);
                size += static_cast<std::uint32_t>(std::abs(s - expected));
            }
            sizes[value] = static_cast<std::uint16_t>(std::min<std::uint32_t>(size, 4000));
        });
        fill(mesh_.uvs.values, steps, low, step);
    }

    Guess expected_uv(const Fresh& fresh, const std::vector<Steps>& steps,
                      const std::vector<std::uint16_t>& sizes) const {
        Guess guess;
        if (fresh.before != kNoIndex) {
            guess.steps = {steps[fresh.before][0], steps[fresh.before][1]};
            guess.size = sizes[fresh.before];
        }
        const std::size_t n = fresh.known.size();
        for (const auto& [to_a, to_b] : {std::pair<std::size_t, std::size_t>(1, 2), {n - 2, n - 1}, {1, n - 1}}) {
            if (fresh.face == kNoFace) break;
            const std::size_t a = (fresh.corner + to_a) % n, b = (fresh.corner + to_b) % n;
            if (fresh.known[a] == kNoIndex || fresh.known[b] == kNoIndex) continue;
            Guess beside = guess;
            if (!expect_beside(fresh, a, b, steps, beside)) continue;
            beside.size = (std::uint32_t(sizes[fresh.known[a]]) + sizes[fresh.known[b]]) / 2;
            if (beside.kind == 2) return beside;
            if (guess.kind == 0) guess = beside;
        }
        if (guess.kind == 0)
            for (const Index value : fresh.known)
                if (value != kNoIndex) guess.steps = {steps[value][0], steps[value][1]};
        return guess;
    }

    /// By the edge from corner a to corner b of its face, which it lies to the left of.
    bool expect_beside(const Fresh& fresh, std::size_t a, std::size_t b, const std::vector<Steps>& steps,
                       Guess& guess) const {
        const auto face = mesh_.face(fresh.face);
        const Wide origin = wide(places_[face[a]]), edge = wide(places_[face[b]]) - origin,
                   to_v = wide(places_[face[fresh.corner]]) - origin;
        const double square = double(dot(edge, edge));
        if (square == 0) return false;
        const Index value_a = fresh.known[a], value_b = fresh.known[b];
        const std::array<std::int64_t, 2> from = {steps[value_a][0], steps[value_a][1]},
                                          along = {steps[value_b][0] - from[0], steps[value_b][1] - from[1]};
        const double height = length_of(cross(edge, to_v));
        std::int64_t ahead = fixed_quotient(double(dot(edge, to_v)), square);
        const auto [other, other_value] =
            b == (a + 1) % face.size() ? behind(a, value_a, value_b) : std::pair(kNoIndex, kNoIndex);
        const Wide to_other = other != kNoIndex ? wide(places_[other]) - origin : Wide{};
        const double depth = length_of(cross(edge, to_other));
        if (depth > 0 && height <= 8 * depth) { // the faces unfolded into a plane, and mapped as the one behind is
            const std::int64_t across = fixed_quotient(height, depth);
            ahead += across * fixed_quotient(double(dot(edge, to_other)), square) / 65536;
            for (std::size_t k = 0; k < 2; ++k)
                guess.steps[k] =
                    from[k] + (ahead * along[k] - across * (steps[other_value][k] - from[k]) + 32768) / 65536;
            guess.kind = 2;
        } else {
            const std::int64_t across = fixed_quotient(height, square);
            guess.steps[0] = from[0] + (ahead * along[0] - across * along[1] + 32768) / 65536;
            guess.steps[1] = from[1] + (ahead * along[1] + across * along[0] + 32768) / 65536;
            guess.kind = 1;
        }
        return true;
    }

    /// In the face behind the edge from corner a to the next one, where the values are the same: its other vertex
    /// beside the edge, and that one's value.
    std::pair<Index, Index> behind(std::size_t a, Index value_a, Index value_b) const {
        const auto [corner_a, corner_b] = edges_[a];
        if (corner_a == kNoIndex || value_at(corner_a) != value_a || value_at(corner_b) != value_b)
            return {kNoIndex, kNoIndex};
        const Index g = polygons_.face(corner_a), begin = mesh_.face_offsets[g], size = mesh_.face_size(g);
        const Index other = begin + (corner_a - begin + 1) % size;
        if (value_at(other) == kNoIndex) return {kNoIndex, kNoIndex};
        return {mesh_.corners[other], value_at(other)};
    }
    Index value_at(Index corner) const {
        return mesh_.uvs.per_vertex() ? mesh_.corners[corner] : mesh_.uvs.corners[corner];
    }

    // --- Normals ---------------------------------------------------------------------------------------------------

    void normals() {
        bool is_indexed = false;
        if (!counted(mesh_.normals, is_indexed)) return;
        std::uint32_t is_unit = std::ranges::all_of(
            mesh_.normals.values, [](const Vec3f& n) { return std::abs(n.squaredNorm() - 1) < 0.01f; });
        code_.number(kCount, is_unit);
        if (is_unit == 0) return plain_vectors(is_indexed);
        std::vector<Wide> at_vertex(mesh_.vertex_count()), of_value(mesh_.normals.values.size());
        for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
            const Wide normal = face_normal(f);
            for (const Index v : mesh_.face(f)) add(at_vertex[v], normal);
        }
        std::uint32_t size = 0;
        walk(mesh_.normals, is_indexed, [&](Index value, const Fresh& fresh) {
            std::array<Wide, 3> guesses{}; // the vertex's, the face's, that of what is known
            if (fresh.face != kNoFace) {
                guesses[0] = at_vertex[mesh_.face(fresh.face)[fresh.corner]];
                guesses[1] = is_indexed ? face_normal(fresh.face) : guesses[0];
            }
            for (const Index other : fresh.known)
                if (other != kNoIndex) add(guesses[2], of_value[other]);
            if (guesses[2] == Wide{} && fresh.before != kNoIndex) guesses[2] = of_value[fresh.before];
            of_value[value] = coded_normal(mesh_.normals.values[value], guesses, size);
            for (int k = 0; k < 3; ++k)
                mesh_.normals.values[value][k] = float(of_value[value][std::size_t(k)]) / float(kOne);
        });
    }

    /// size: of what was left lately.
    Wide coded_normal(const Vec3f& normal, const std::array<Wide, 3>& guesses, std::uint32_t& size) {
        std::uint32_t best = 0;
        double fewest = 1e30; // bits, about
        for (std::uint32_t g = 0; g < guesses.size() && code_.writes; ++g) {
            Wide guess = guesses[g];
            if (!normalise(guess)) continue;
            double along = 0;
            for (std::size_t k = 0; k < 3; ++k) along += double(normal[int(k)]) * double(guess[k]) / double(kOne);
            const double angle = math::acos(std::clamp(along, -1.0, 1.0));
            const double bits = 2 * math::log2(1 + double(kOctahedron) * angle) + (g == last_guess_ ? 0 : kGuessBits);
            if (bits >= fewest) continue;
            fewest = bits;
            best = g;
        }
        code_.number(kNormalGuess + last_guess_, best);
        if (best >= guesses.size()) throw AttributeDamage();
        last_guess_ = best;
        const Frame frame = frame_around(guesses[best]);
        const std::uint32_t near = (size / 2 + rounding_of_normal(guesses[0])) / 2;
        std::array<std::int32_t, 2> steps{};
        if (code_.writes) steps = octahedral(normal, frame);
        std::uint32_t all = 0;
        for (unsigned k = 0; k < 2; ++k) {
            code_.difference(kNormal + (best * 2 + k) * kSizes + size_class(near + all, kSizes), steps[k], 0);
            steps[k] = std::clamp<std::int32_t>(steps[k], -kOctahedron, kOctahedron);
            all += static_cast<std::uint32_t>(std::abs(steps[k]));
        }
        size = (3 * size + 2 * all + 2) / 4;
        return from_octahedral(steps[0], steps[1], frame);
    }

    /// How far rounded places turn a normal, steps: the smaller the area around, the farther.
    static std::uint32_t rounding_of_normal(const Wide& sum_of_areas) {
        const double side = std::sqrt(length_of(sum_of_areas)); // sixteenths of a step
        return static_cast<std::uint32_t>(double(kOctahedron * kFine) / std::max(side, 8.0));
    }

    /// Its length grows with the face's area.
    Wide face_normal(std::size_t f) const {
        const auto face = mesh_.face(f);
        const Wide origin = wide(places_[face[0]]);
        Wide sum{};
        for (std::size_t k = 1; k + 1 < face.size(); ++k)
            add(sum, cross(wide(places_[face[k]]) - origin, wide(places_[face[k + 1]]) - origin));
        return sum;
    }
    static void add(Wide& sum, const Wide& more) {
        constexpr std::int64_t most = std::int64_t{1} << 60;
        for (std::size_t k = 0; k < 3; ++k) sum[k] = std::clamp(sum[k] + more[k], -most, most);
    }

    /// Normals of any length.
    void plain_vectors(bool is_indexed) {
        Vec3f low;
        float step = 0;
        std::vector<Steps> steps = quantised(mesh_.normals.values, kPlainBits, low, step);
        walk(mesh_.normals, is_indexed, [&](Index value, const Fresh& fresh) {
            for (unsigned k = 0; k < 3; ++k)
                code_.difference(kPlainValue + k, steps[value][k],
                                 fresh.before != kNoIndex ? steps[fresh.before][k] : 0);
        });
        fill(mesh_.normals.values, steps, low, step);
    }

    // --- What vertices and faces have -------------------------------------------------------------------------------

    void colors() {
        std::uint32_t count = static_cast<std::uint32_t>(mesh_.colors.size());
        std::uint32_t has_alpha = mesh_.colors_have_alpha;
        code_.number(kCount, count);
        if (count == 0) return;
        if (count != mesh_.vertex_count()) throw AttributeDamage();
        code_.number(kCount, has_alpha);
        mesh_.colors_have_alpha = has_alpha != 0;
        mesh_.colors.resize(count, Vec4f::Ones());
        const std::vector<Index> neighbour = last_neighbours();
        std::vector<std::array<std::int32_t, 4>> steps(count);
        for (std::size_t v = 0; v < count; ++v)
            for (int k = 0; k < 3 + int(has_alpha != 0); ++k) {
                std::int32_t& step = steps[v][std::size_t(k)];
                step = color_byte(mesh_.colors[v][k]);
                const Index near = neighbour[v];
                code_.difference(kColorStep + unsigned(k), step, near != kNoIndex ? steps[near][std::size_t(k)] : 0);
                mesh_.colors[v][k] = float(step) / 255;
            }
    }

    /// Of each vertex the last of those before it on its faces' edges.
    std::vector<Index> last_neighbours() const {
        std::vector<Index> neighbour(mesh_.vertex_count(), kNoIndex);
        for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
            const auto face = mesh_.face(f);
            for (std::size_t k = 0; k < face.size(); ++k) {
                const auto [low, high] = std::minmax(face[k], face[(k + 1) % face.size()]);
                if (low != high && (neighbour[high] == kNoIndex || low > neighbour[high])) neighbour[high] = low;
            }
        }
        return neighbour;
    }

    /// Bit for bit: the difference of the numbers that floats are as integers.
    void scalars(std::vector<float>& values) {
        values.resize(mesh_.vertex_count());
        std::uint32_t before = 0;
        for (float& value : values) {
            std::int32_t difference = std::int32_t(std::bit_cast<std::uint32_t>(value) - before);
            code_.difference(kScalarBits, difference, 0);
            before += std::uint32_t(difference);
            value = std::bit_cast<float>(before);
        }
    }

    void labels(std::vector<Index>& of_face) {
        std::uint32_t count = static_cast<std::uint32_t>(of_face.size());
        code_.number(kCount, count);
        if (count == 0) return;
        if (count != mesh_.face_count()) throw AttributeDamage();
        of_face.resize(count, 0);
        Index before = 0;
        for (Index& label : of_face) {
            std::uint32_t is_new = label != before;
            code_.number(kLabel, is_new);
            if (is_new)
                code_.number(kLabel + 1, label);
            else
                label = before;
            before = label;
            code_.check();
        }
    }

    Code& code_;
    Mesh& mesh_;
    std::span<const FinePlace> places_;
    PolygonCorners polygons_;
    std::vector<Index> behind_; ///< see find_behind
    std::vector<Edge> edges_;   ///< of the face that a walk is at
    std::uint32_t last_guess_ = 0;
};

struct NumberWriter {
    static constexpr bool writes = true;
    SymbolWriter& out;
    void number(unsigned context, std::uint32_t& value) { out.number(context, value); }
    void difference(unsigned context, std::int32_t& value, std::int32_t expected) {
        out.number_with_sign(context, std::int32_t(std::uint32_t(value) - std::uint32_t(expected)));
    }
    void real(float& value) { out.bits(std::bit_cast<std::uint32_t>(value), 32); }
    void check() const {}
};

struct NumberReader {
    static constexpr bool writes = false;
    SymbolReader& in;
    void number(unsigned context, std::uint32_t& value) {
        value = in.number(context);
        check();
    }
    void difference(unsigned context, std::int32_t& value, std::int32_t expected) {
        value = std::int32_t(std::uint32_t(in.number_with_sign(context)) + std::uint32_t(expected));
        check();
    }
    void real(float& value) {
        value = std::bit_cast<float>(in.bits(32));
        if (!std::isfinite(value)) throw AttributeDamage();
    }
    void check() const {
        if (in.is_damaged()) throw AttributeDamage();
    }
};

} // namespace

void encode_attributes(Mesh& mesh, std::span<const FinePlace> places, SymbolWriter& out) {
    NumberWriter numbers{out};
    Attributes<NumberWriter>(numbers, mesh, places).run();
}

bool decode_attributes(Mesh& mesh, std::span<const FinePlace> places, SymbolReader& in) {
    try {
        NumberReader numbers{in};
        Attributes<NumberReader>(numbers, mesh, places).run();
        return true;
    } catch (const AttributeDamage&) {
        return false;
    }
}

} // namespace filigree
