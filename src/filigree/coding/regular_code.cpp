#include "filigree/coding/regular_code.h"

#include "filigree/coding/face_code.h"
#include "filigree/coding/integer_frame.h"
#include "filigree/mesh.h"

#include <algorithm>
#include <cstdlib>

namespace filigree {

namespace {

constexpr unsigned kMostLevels = 15, kGridClasses = 12;
/// Three symbols a vertex, each of log2(2^14 / (2^14 - 63)) bits or more.
constexpr std::size_t kMostVerticesPerByte = 512;
enum GridKind : unsigned { on_base_edge, on_line, at_centre }; // of a vertex that a level adds

/// The numbers of a grid's vertices: the base's, then those on each of its edges, then those inside each patch, row by
/// row.
class GridNumbers {
public:
    GridNumbers(std::span<const Index> base, std::size_t base_vertices, unsigned levels)
        : base_(base), base_vertices_(base_vertices), side_(std::size_t{1} << levels) {
        for (std::size_t h = 0; h < base.size(); ++h) edges_.push_back(ends(h));
        std::ranges::sort(edges_);
        edges_.erase(std::ranges::unique(edges_).begin(), edges_.end());
        for (std::size_t h = 0; h < base.size(); ++h)
            edge_of_.push_back(static_cast<Index>(std::ranges::lower_bound(edges_, ends(h)) - edges_.begin()));
    }

    std::size_t side() const { return side_; } ///< columns of a patch
    std::size_t patch_count() const { return base_.size() / 4; }
    std::size_t edge_count() const { return edges_.size(); }
    std::size_t vertex_count() const {
        return base_vertices_ + edges_.size() * (side_ - 1) + patch_count() * (side_ - 1) * (side_ - 1);
    }

    /// Step k of edge e, from its end with the lower number.
    Index on_edge(std::size_t e, std::size_t k) const {
        if (k == 0) return edges_[e].first;
        if (k == side_) return edges_[e].second;
        return static_cast<Index>(base_vertices_ + e * (side_ - 1) + k - 1);
    }
    /// Column i, row j of patch p.
    Index at(std::size_t p, std::size_t i, std::size_t j) const {
        if (j == 0) return on_side(4 * p, i);
        if (i == side_) return on_side(4 * p + 1, j);
        if (j == side_) return on_side(4 * p + 2, side_ - i);
        if (i == 0) return on_side(4 * p + 3, side_ - j);
        return static_cast<Index>(base_vertices_ + edges_.size() * (side_ - 1) +
                                  (p * (side_ - 1) + j - 1) * (side_ - 1) + i - 1);
    }

private:
    std::pair<Index, Index> ends(std::size_t h) const {
        return std::minmax(base_[h], base_[h % 4 == 3 ? h - 3 : h + 1]);
    }
    Index on_side(std::size_t h, std::size_t k) const {
        const std::size_t e = edge_of_[h];
        return on_edge(e, base_[h] == edges_[e].first ? k : side_ - k);
    }

    std::span<const Index> base_;
    std::size_t base_vertices_, side_;
    std::vector<std::pair<Index, Index>> edges_;
    std::vector<Index> edge_of_; ///< of each side of each patch
};

/// Visits the vertices of all levels, coarse to fine. `Coder` says how many steps each is from where it is expected.
template <class Coder>
class GridTraversal {
public:
    GridTraversal(const GridNumbers& numbers, GeometrySteps steps, bool is_turned, std::vector<FinePlace> base,
                  Coder& coder)
        : numbers_(numbers), steps_(steps), is_turned_(is_turned), coder_(coder), places_(std::move(base)),
          sizes_(numbers.vertex_count(), 0) {
        places_.resize(numbers.vertex_count());
    }

    /// False: damaged, or cancelled.
    bool run(const RunContext& context) {
        for (std::size_t step = numbers_.side() / 2; step > 0; step /= 2) {
            for (std::size_t e = 0; e < numbers_.edge_count(); ++e) visit_edge(e, step);
            for (std::size_t p = 0; p < numbers_.patch_count(); ++p) {
                visit_patch(p, step);
                if (coder_.is_damaged() || context.is_cancelled()) return false;
            }
        }
        return true;
    }
    std::vector<FinePlace> take_places() { return std::move(places_); }

private:
    Wide at(Index v) const { return {places_[v][0], places_[v][1], places_[v][2]}; }

    /// Sixteen times where the line says that its vertex k is, from those at even multiples of `step`.
    template <class Line>
    Wide on_cubic(const Line& line, std::size_t k, std::size_t step) const {
        const std::size_t last = numbers_.side() - k;
        const bool is_near_start = k < 3 * step, is_near_end = last < 3 * step;
        if (!is_near_start && !is_near_end)
            return weighted({-1, 9, 9, -1}, {line(k - 3 * step), line(k - step), line(k + step), line(k + 3 * step)});
        if (is_near_start && is_near_end) return weighted({8, 8, 0, 0}, {line(k - step), line(k + step), 0, 0});
        const auto from_end = [&](std::size_t steps) { // of the end that is near
            return is_near_start ? line(steps * step) : line(numbers_.side() - steps * step);
        };
        if (numbers_.side() < 6 * step) return weighted({6, 12, -2, 0}, {from_end(0), from_end(2), from_end(4), 0});
        return weighted({5, 15, -5, 1}, {from_end(0), from_end(2), from_end(4), from_end(6)});
    }
    Wide weighted(const std::array<std::int64_t, 4>& weights, const std::array<Index, 4>& vertices) const {
        Wide sum{};
        for (std::size_t k = 0; k < 4; ++k)
            for (std::size_t j = 0; j < 3 && weights[k] != 0; ++j) sum[j] += weights[k] * places_[vertices[k]][j];
        return sum;
    }

    void visit_edge(std::size_t e, std::size_t step) {
        const auto line = [&](std::size_t k) { return numbers_.on_edge(e, k); };
        for (std::size_t k = step; k < numbers_.side(); k += 2 * step) {
            const std::uint32_t size = k > step ? 2 * sizes_[line(k - 2 * step)] : 0;
            code(line(k), on_cubic(line, k, step), 16, Frame(), {1, 1}, on_base_edge, size);
        }
    }

    void visit_patch(std::size_t p, std::size_t step) {
        const auto vertex = [&](std::size_t i, std::size_t j) { return numbers_.at(p, i, j); };
        const auto turned = [&](std::size_t i, std::size_t j) { return numbers_.at(p, j, i); };
        visit_lines(vertex, step);
        visit_lines(turned, step);
        for (std::size_t j = step; j < numbers_.side(); j += 2 * step)
            for (std::size_t i = step; i < numbers_.side(); i += 2 * step) {
                const Index left = vertex(i - step, j), right = vertex(i + step, j), below = vertex(i, j - step),
                            above = vertex(i, j + step);
                Wide expected = on_cubic([&](std::size_t k) { return vertex(k, j); }, i, step);
                const Wide across = on_cubic([&](std::size_t k) { return vertex(i, k); }, j, step);
                for (std::size_t k = 0; k < 3; ++k) expected[k] += across[k];
                const Wide along_row = at(right) - at(left), along_column = at(above) - at(below);
                code(vertex(i, j), expected, 32, frame(along_row, along_column), steps_, at_centre,
                     (sizes_[left] + sizes_[right] + sizes_[below] + sizes_[above]) / 2);
            }
    }

    /// Those between two that are known, along one direction, on every second line of the other.
    template <class Vertex>
    void visit_lines(const Vertex& vertex, std::size_t step) {
        for (std::size_t j = 2 * step; j < numbers_.side(); j += 2 * step)
            for (std::size_t i = step; i < numbers_.side(); i += 2 * step) {
                const auto line = [&](std::size_t k) { return vertex(k, j); };
                const Wide along = at(line(i + step)) - at(line(i - step));
                Wide across{};
                for (const std::size_t k : {i - step, i + step})
                    for (std::size_t c = 0; c < 3; ++c)
                        across[c] += places_[vertex(k, j + 2 * step)][c] - places_[vertex(k, j - 2 * step)][c];
                const Index before = i > step ? line(i - 2 * step) : vertex(i, j - 2 * step);
                code(line(i), on_cubic(line, i, step), 16, frame(along, across), steps_, on_line,
                     sizes_[before] + sizes_[vertex(i, j - 2 * step)]);
            }
    }

    Frame frame(const Wide& along, const Wide& across) const {
        return is_turned_ ? Frame(cross(along, across), along) : Frame();
    }

    /// sum: `weight` times where it is expected. size: of two differences that are known.
    void code(Index v, const Wide& sum, std::int64_t weight, const Frame& frame, GeometrySteps size_of_steps,
              GridKind kind, std::uint32_t size) {
        Wide expected{};
        for (std::size_t k = 0; k < 3; ++k) expected[k] = divide(sum[k], weight);
        Wide place = expected;
        std::uint32_t all = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int64_t step = std::int64_t{k == 0 ? size_of_steps.normal : size_of_steps.tangential} * kFine;
            const unsigned context = (kind * 3 + unsigned(k)) * kGridClasses + size_class(size + all, kGridClasses);
            const std::int64_t steps = coder_.steps(v, expected, frame.axes[k], step, kGeometryContexts + context);
            all += static_cast<std::uint32_t>(std::abs(steps));
            for (std::size_t j = 0; j < 3; ++j) place[j] += divide_by_one(steps * step * frame.axes[k][j]);
        }
        for (std::size_t k = 0; k < 3; ++k)
            places_[v][k] = std::int32_t(std::clamp<std::int64_t>(place[k], -kFarthest, kFarthest));
        sizes_[v] = static_cast<std::uint16_t>(std::min<std::uint32_t>(all, 1000));
    }

    const GridNumbers& numbers_;
    GeometrySteps steps_;
    bool is_turned_;
    Coder& coder_;
    std::vector<FinePlace> places_;
    std::vector<std::uint16_t> sizes_; ///< of each vertex's difference, steps
};

class GridWriter {
public:
    GridWriter(std::span<const FinePlace> places, std::span<const Index> vertex, SymbolWriter& out)
        : places_(places), vertex_(vertex), out_(out) {}
    bool is_damaged() const { return false; }
    std::int64_t steps(Index v, const Wide& expected, const Wide& axis, std::int64_t step, unsigned context) {
        const FinePlace& place = places_[vertex_[v]];
        const Wide from_expected = Wide{place[0], place[1], place[2]} - expected;
        const auto steps = std::int32_t(divide(dot(from_expected, axis), step * kOne));
        out_.number_with_sign(context, steps);
        return steps;
    }

private:
    std::span<const FinePlace> places_;
    std::span<const Index> vertex_;
    SymbolWriter& out_;
};

class GridReader {
public:
    explicit GridReader(SymbolReader& in) : in_(in) {}
    bool is_damaged() const { return in_.is_damaged(); }
    std::int64_t steps(Index, const Wide&, const Wide&, std::int64_t, unsigned context) {
        return std::clamp(in_.number_with_sign(context), -kFarthest, kFarthest);
    }

private:
    SymbolReader& in_;
};

/// Patch by patch, row by row.
void append_faces(const GridNumbers& numbers, CodedShape& mesh) {
    for (std::size_t p = 0; p < numbers.patch_count(); ++p)
        for (std::size_t j = 0; j < numbers.side(); ++j)
            for (std::size_t i = 0; i < numbers.side(); ++i) {
                for (const auto& [column, row] : {std::pair(i, j), {i + 1, j}, {i + 1, j + 1}, {i, j + 1}})
                    mesh.corners.push_back(numbers.at(p, column, row));
                mesh.face_offsets.push_back(static_cast<Index>(mesh.corners.size()));
            }
}

/// The place of each vertex of a base, of those that its map has.
std::vector<FinePlace> places_of_numbers(const WalkedFaces& base, std::span<const FinePlace> of_map) {
    std::vector<FinePlace> places;
    for (const std::size_t w : base.first_with_number()) places.push_back(of_map[w]);
    return places;
}

/// Which vertex each number is. None: where the code has one vertex the mesh has two, or the other way round.
std::optional<std::vector<Index>> vertices_of(const RegularPatches& patches, const EncodedFaces& base,
                                              const GridNumbers& numbers, std::size_t vertices) {
    if (numbers.vertex_count() != vertices) return std::nullopt;
    const std::size_t n = numbers.side();
    std::vector<Index> vertex(vertices, kNoIndex);
    for (std::size_t q = 0; q < numbers.patch_count(); ++q)
        for (std::size_t j = 0; j <= n; ++j)
            for (std::size_t i = 0; i <= n; ++i) { // the patch was turned so that another corner is first
                const std::array<std::pair<std::size_t, std::size_t>, 4> turned = {
                    {{i, j}, {n - j, i}, {n - i, n - j}, {j, n - i}}};
                const auto [column, row] = turned[base.first_corner[q]];
                const Index v = patches.at(base.face[q], column, row);
                Index& known = vertex[numbers.at(q, i, j)];
                if (known != kNoIndex && known != v) return std::nullopt;
                known = v;
            }
    std::vector<bool> is_named(vertices, false);
    for (const Index v : vertex) {
        if (v == kNoIndex || is_named[v]) return std::nullopt;
        is_named[v] = true;
    }
    return vertex;
}

/// Finds which faces of the mesh the code's are. False: one is none.
bool find_faces(const Mesh& mesh, EncodedRegular& encoded) {
    std::vector<Index> number(mesh.vertex_count());
    for (Index k = 0; k < encoded.vertex.size(); ++k) number[encoded.vertex[k]] = k;
    const auto lowest_of = [&](std::size_t f) { // its corner with the lowest number
        const auto face = mesh.face(f);
        return std::ranges::min(face, {}, [&](Index v) { return number[v]; });
    };
    std::vector<Index> offsets(mesh.vertex_count() + 1, 0), faces(mesh.face_count());
    for (std::size_t f = 0; f < mesh.face_count(); ++f) ++offsets[number[lowest_of(f)] + 1];
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) offsets[v + 1] += offsets[v];
    std::vector<Index> next = offsets;
    for (Index f = 0; f < mesh.face_count(); ++f) faces[next[number[lowest_of(f)]]++] = f;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const auto coded = std::span(encoded.read.corners).subspan(4 * f, 4);
        const Index lowest = std::ranges::min(coded);
        bool is_found = false;
        for (Index k = offsets[lowest]; k < offsets[lowest + 1] && !is_found; ++k)
            for (Index first = 0; first < 4 && !is_found; ++first) {
                const auto face = mesh.face(faces[k]);
                is_found = true;
                for (Index c = 0; c < 4; ++c) is_found = is_found && number[face[(first + c) % 4]] == coded[c];
                if (!is_found) continue;
                encoded.face.push_back(faces[k]);
                encoded.first_corner.push_back(first);
            }
        if (!is_found) return false;
    }
    return true;
}

} // namespace

std::optional<EncodedRegular> encode_regular(const Mesh& mesh, std::span<const FinePlace> places, GeometrySteps steps,
                                             SymbolWriter& faces_out, SymbolWriter& places_out,
                                             const RunContext& context) {
    RunContext silent = context;
    silent.progress = {};
    const Result<RegularPatches> patches = find_regular_patches(mesh, kMostLevels, silent);
    if (!patches) return std::nullopt;
    std::vector<Index> base_vertices, corners, offsets = {0};
    for (const auto& patch : patches->base) base_vertices.insert(base_vertices.end(), patch.begin(), patch.end());
    std::ranges::sort(base_vertices);
    base_vertices.erase(std::ranges::unique(base_vertices).begin(), base_vertices.end());
    for (const auto& patch : patches->base) {
        for (const Index v : patch)
            corners.push_back(static_cast<Index>(std::ranges::lower_bound(base_vertices, v) - base_vertices.begin()));
        offsets.push_back(static_cast<Index>(corners.size()));
    }
    faces_out.bits(patches->levels, 4);
    faces_out.bits(static_cast<std::uint32_t>(base_vertices.size()), 32);
    const EncodedFaces base = encode_faces(offsets, corners, base_vertices.size(), faces_out);
    if (base.walked.met != base_vertices.size()) return std::nullopt;
    const GridNumbers numbers(base.walked.corners, base_vertices.size(), patches->levels);
    std::optional<std::vector<Index>> vertex = vertices_of(*patches, base, numbers, mesh.vertex_count());
    if (!vertex) return std::nullopt;
    EncodedRegular encoded;
    encoded.vertex = std::move(*vertex);
    append_faces(numbers, encoded.read);
    if (!find_faces(mesh, encoded)) return std::nullopt;

    std::vector<FinePlace> of_map(base.walked.number.size());
    for (std::size_t w = 0; w < of_map.size(); ++w)
        if (base.walked.number[w] != kNoIndex) of_map[w] = places[encoded.vertex[base.walked.number[w]]];
    const std::vector<FinePlace> read = encode_geometry(base.walked.map, of_map, steps, 0, places_out);
    encoded.read.places = encode_shorter(steps, places_out, [&](SymbolWriter& trial, bool is_turned) {
        GridWriter writer(places, encoded.vertex, trial);
        GridTraversal<GridWriter> traversal(numbers, steps, is_turned, places_of_numbers(base.walked, read), writer);
        traversal.run(context);
        return traversal.take_places();
    });
    if (context.is_cancelled()) return std::nullopt;
    return encoded;
}

std::optional<CodedShape> decode_regular(SymbolReader& faces_in, SymbolReader& places_in, GeometrySteps steps,
                                         std::size_t vertices, std::size_t corners) {
    const unsigned levels = faces_in.bits(4);
    const std::size_t base_vertices = faces_in.bits(32), quads = std::size_t{1} << (2 * levels);
    if (levels == 0 || faces_in.is_damaged() || base_vertices > vertices || corners % (4 * quads) != 0 ||
        vertices > kMostVerticesPerByte * (places_in.size() + 64))
        return std::nullopt;
    const std::optional<WalkedFaces> base = decode_faces(faces_in, base_vertices, corners / quads);
    if (!base || base->met != base_vertices) return std::nullopt;
    for (std::size_t f = 0; f + 1 < base->face_offsets.size(); ++f)
        if (base->face_offsets[f + 1] - base->face_offsets[f] != 4) return std::nullopt;
    const GridNumbers numbers(base->corners, base_vertices, levels);
    if (numbers.vertex_count() != vertices) return std::nullopt;
    const std::vector<FinePlace> of_map = decode_geometry(base->map, steps, 0, places_in);
    const bool is_turned = places_in.bits(1) != 0;
    GridReader reader(places_in);
    GridTraversal<GridReader> traversal(numbers, steps, is_turned, places_of_numbers(*base, of_map), reader);
    if (!traversal.run(RunContext())) return std::nullopt;
    CodedShape mesh;
    append_faces(numbers, mesh);
    mesh.places = traversal.take_places();
    return mesh;
}

} // namespace filigree
