// Based on:
// [Taubin 2002] Detecting and reconstructing subdivision connectivity: a mesh is subdivided when its faces can be
// gathered around every second vertex. We do it for quads, where what one face keeps decides for its whole component,
// so that one pass follows all four guesses.
#include "filigree/mesh.h"

#include "filigree/mesh/edges.h"

#include <algorithm>
#include <optional>

namespace filigree {
namespace {

/// Quads and their neighbours. Half-edge h = 4 f + c runs from corner c of quad f to the next corner; it also stands
/// for that corner.
struct Quads {
    std::vector<Index> corners; ///< vertex that half-edge h starts at
    std::vector<Index> twins;   ///< half-edge on the other side, kNoIndex on the border

    std::size_t face_count() const { return corners.size() / 4; }
};

Index turned(Index h, Index steps) { return (h & ~Index{3}) | ((h + steps) & 3); }
Index next(Index h) { return turned(h, 1); }
Index opposite(Index h) { return h ^ 2; }
Index face_of(Index h) { return h / 4; }

/// How a vertex restricts what it can be in a subdivided mesh.
enum class VertexKind : std::uint8_t {
    inside,    ///< four quads around: kept, on an edge or a centre
    border,    ///< two quads on a straight border: kept or on an edge
    irregular, ///< anything else: kept
};

/// One subdivision undone: coarse quad k was made of the fine quads at the half-edges children[4 k + c], each standing
/// for the corner that was kept, in the coarse quad's order.
struct Undone {
    Quads coarse;
    std::vector<Index> children;
};

Error unsuitable(std::string reason) {
    return {ErrorCode::unsuitable, std::move(reason) + "; the reference code needs quads that come from subdivision, "
                                                       "so use the blend code or remesh first."};
}
std::string name_of(const char* what, std::size_t index) { return std::string(what) + ' ' + std::to_string(index); }

std::optional<Error> check_quads(const Mesh& mesh) {
    if (mesh.face_count() == 0) return unsuitable("The mesh has no faces");
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        if (mesh.face_size(f) != 4)
            return unsuitable("The mesh's " + name_of("face", f) + " has " + std::to_string(mesh.face_size(f)) +
                              " corners");
        const auto face = mesh.face(f);
        for (unsigned c = 0; c < 4; ++c)
            if (face[c] == face[(c + 1) % 4] || face[c] == face[(c + 2) % 4])
                return unsuitable("The mesh's " + name_of("face", f) + " has the same vertex twice");
    }
    return std::nullopt;
}

/// Pairs the half-edges that run along the same two vertices in opposite directions.
std::optional<Error> match_twins(Quads& quads, std::size_t vertex_count) {
    const IndexLists edges = edges_from(vertex_count, [&](const auto& add) {
        for (Index h = 0; h < quads.corners.size(); ++h) add(quads.corners[h], quads.corners[next(h)], h);
    });
    quads.twins.assign(quads.corners.size(), kNoIndex);
    for (const std::span<const Index> edge : edges) {
        if (edge.size() == 1) continue;
        const Index a = edge[0], b = edge[1];
        const auto place = [&] {
            const auto [low, high] = std::minmax(quads.corners[a], quads.corners[next(a)]);
            return "the edge between vertices " + std::to_string(low) + " and " + std::to_string(high);
        };
        if (quads.corners[a] == quads.corners[b])
            return unsuitable("The faces " + std::to_string(face_of(a)) + " and " + std::to_string(face_of(b)) +
                              " are turned against each other at " + place());
        if (edge.size() > 2) return unsuitable("More than two faces meet at " + place());
        quads.twins[a] = b;
        quads.twins[b] = a;
    }
    return std::nullopt;
}

/// Quads met when walking around the vertex of half-edge h, both ways from it.
std::size_t fan_size(const Quads& quads, Index h) {
    std::size_t size = 1;
    Index walk = h;
    while ((walk = quads.twins[turned(walk, 3)]) != kNoIndex) {
        if (walk == h) return size;
        ++size;
    }
    walk = h;
    while (quads.twins[walk] != kNoIndex) {
        walk = next(quads.twins[walk]);
        ++size;
    }
    return size;
}

/// Kinds of all vertices. Subdivision keeps the kind of the vertices it starts from, so they serve every level.
Result<std::vector<VertexKind>> vertex_kinds(const Quads& quads, std::size_t vertex_count) {
    std::vector<Index> faces(vertex_count, 0);
    std::vector<std::uint8_t> border(vertex_count, 0);
    for (std::size_t h = 0; h < quads.corners.size(); ++h) {
        ++faces[quads.corners[h]];
        if (quads.twins[h] != kNoIndex) continue;
        for (const Index v : {quads.corners[h], quads.corners[next(static_cast<Index>(h))]})
            border[v] = static_cast<std::uint8_t>(std::min(border[v] + 1, 255));
    }
    std::vector<VertexKind> kinds(vertex_count);
    for (std::size_t v = 0; v < vertex_count; ++v) {
        if (faces[v] == 0) return unsuitable("The mesh's " + name_of("vertex", v) + " is in no face");
        kinds[v] = faces[v] == 4 && border[v] == 0   ? VertexKind::inside
                   : faces[v] == 2 && border[v] == 2 ? VertexKind::border
                                                     : VertexKind::irregular;
    }
    std::vector<bool> is_walked(vertex_count, false); // once a vertex: its first fan has all faces, or it has several
    for (std::size_t h = 0; h < quads.corners.size(); ++h) {
        const Index v = quads.corners[h];
        if (kinds[v] != VertexKind::irregular || is_walked[v]) continue;
        is_walked[v] = true;
        if (fan_size(quads, static_cast<Index>(h)) != faces[v])
            return unsuitable("The faces at " + name_of("vertex", v) + " touch there without sharing an edge");
    }
    return kinds;
}

constexpr std::uint8_t kUnlabelled = 0xff;

/// Follows four guesses at once: guess g keeps corner g of a component's first face. A corner's label is the guess that
/// keeps it; across an edge labels continue as in a mirror. Opposite corners have labels l and l ^ 3, and under any
/// other guess both lie on edges.
class KeptCorners {
public:
    KeptCorners(const Quads& quads, std::span<const VertexKind> kinds)
        : quads_(quads), kinds_(kinds), vertex_labels_(kinds.size(), kUnlabelled),
          corner_labels_(quads.face_count(), {kUnlabelled}) {
        queue_.reserve(quads.face_count());
    }

    /// For each face the half-edge of the corner that is kept.
    Result<std::vector<Index>> find(const RunContext& context) && {
        std::vector<Index> kept(quads_.face_count());
        for (Index f = 0; f < quads_.face_count(); ++f) {
            if (is_visited(f)) continue;
            if (context.is_cancelled()) return cancelled_error();
            const std::size_t begin = queue_.size();
            follow_component(f);
            if (guesses_ == 0)
                return unsuitable("Every second row of quads cannot go: the rows do not fit at " +
                                  name_of("vertex", misfit_));
            const std::uint8_t guess = choose_guess();
            for (std::size_t q = begin; q < queue_.size(); ++q)
                for (Index c = 0; c < 4; ++c)
                    if (corner_labels_[queue_[q]][c] == guess) kept[queue_[q]] = 4 * queue_[q] + c;
        }
        return kept;
    }

private:
    using Labels = std::array<std::uint8_t, 4>;

    bool is_visited(Index face) const { return corner_labels_[face][0] != kUnlabelled; }

    void follow_component(Index first) {
        guesses_ = 0b1111;
        lowest_.fill(kNoIndex);
        std::size_t head = queue_.size();
        visit(first, {0, 1, 3, 2});
        for (; head < queue_.size() && guesses_ != 0; ++head)
            for (Index c = 0; c < 4; ++c) {
                const Index twin = quads_.twins[4 * queue_[head] + c];
                if (twin == kNoIndex || is_visited(face_of(twin))) continue;
                const Labels& labels = corner_labels_[queue_[head]];
                Labels mirrored;
                mirrored[turned(twin, 0) % 4] = labels[(c + 1) % 4];
                mirrored[turned(twin, 1) % 4] = labels[c];
                mirrored[turned(twin, 2) % 4] = labels[(c + 3) % 4];
                mirrored[turned(twin, 3) % 4] = labels[(c + 2) % 4];
                visit(face_of(twin), mirrored);
            }
    }

    void visit(Index face, const Labels& labels) {
        corner_labels_[face] = labels;
        queue_.push_back(face);
        for (Index c = 0; c < 4; ++c) restrict_guesses(quads_.corners[4 * face + c], labels[c]);
    }

    /// Drops the guesses under which the vertex would be what it cannot be, or two things.
    void restrict_guesses(Index vertex, std::uint8_t label) {
        const unsigned keeps = 1u << label, centres = 1u << (label ^ 3); // guesses under which it is kept, is a centre
        std::uint8_t& known = vertex_labels_[vertex];
        unsigned possible = 0b1111;
        if (known == kUnlabelled) {
            known = label;
            lowest_[label] = std::min(lowest_[label], vertex);
            if (kinds_[vertex] == VertexKind::border) possible = ~centres;
            if (kinds_[vertex] == VertexKind::irregular) possible = keeps;
        } else if (known != label) {
            possible = known == (label ^ 3) ? ~(keeps | centres) : 0;
        }
        if (guesses_ != 0 && (guesses_ & possible) == 0) misfit_ = vertex;
        guesses_ &= possible;
    }

    /// Of the guesses left, the one that keeps the lowest vertex.
    std::uint8_t choose_guess() const {
        std::uint8_t best = 4;
        for (std::uint8_t guess = 0; guess < 4; ++guess)
            if ((guesses_ >> guess & 1) && (best == 4 || lowest_[guess] < lowest_[best])) best = guess;
        return best;
    }

    const Quads& quads_;
    std::span<const VertexKind> kinds_;
    std::vector<std::uint8_t> vertex_labels_; ///< as the first of its faces has it
    std::vector<Labels> corner_labels_;       ///< of each face
    std::vector<Index> queue_;                ///< faces in the order they are reached
    // Of the current component: guesses left (a bit each), the lowest vertex of each label, where the last guess
    // failed.
    unsigned guesses_ = 0;
    std::array<Index, 4> lowest_{};
    Index misfit_ = kNoIndex;
};

/// Gathers the fine quads around every centre; coarse quads stand in the order of their first fine quad.
Result<Undone> undo_subdivision(const Quads& fine, std::span<const VertexKind> kinds, const RunContext& context) {
    auto kept = KeptCorners(fine, kinds).find(context);
    if (!kept) return kept.error();
    Undone undone;
    undone.children.reserve(fine.face_count());
    std::vector<Index> slots(fine.face_count(), kNoIndex); // where a fine quad stands in children
    for (std::size_t f = 0; f < fine.face_count(); ++f) {
        if (slots[f] != kNoIndex) continue;
        Index corner = (*kept)[f];
        for (Index c = 0; c < 4; ++c) {
            if (slots[face_of(corner)] != kNoIndex) // two fans of two quads: no disc around the centre
                return unsuitable("The faces around " + name_of("vertex", fine.corners[opposite(corner)]) +
                                  " do not close");
            slots[face_of(corner)] = static_cast<Index>(undone.children.size());
            undone.children.push_back(corner);
            // On to the next quad around the centre; its twin half-edge starts at the centre.
            corner = opposite(fine.twins[next(corner)]);
        }
    }
    Quads& coarse = undone.coarse;
    coarse.corners.reserve(undone.children.size());
    for (const Index child : undone.children) coarse.corners.push_back(fine.corners[child]);
    for (std::size_t k = 0; k < coarse.face_count(); ++k) {
        std::array<Index, 4> quad;
        std::copy_n(coarse.corners.begin() + 4 * k, 4, quad.begin());
        std::sort(quad.begin(), quad.end());
        if (const auto twice = std::adjacent_find(quad.begin(), quad.end()); twice != quad.end())
            return unsuitable("Without every second row the quad at " + name_of("vertex", *twice) +
                              " would have it for two corners");
    }
    coarse.twins.reserve(undone.children.size());
    for (const Index child : undone.children) {
        const Index twin = fine.twins[child]; // ends at the child's corner, which is where the coarse twin ends
        coarse.twins.push_back(twin == kNoIndex ? kNoIndex : turned(slots[face_of(twin)], 3));
    }
    return undone;
}

/// Lays out the vertices of the finest quads patch by patch, descending through the children of every level.
std::vector<Index> lay_out_grid(std::span<const Undone> levels, const Quads& finest, std::size_t patch_count) {
    // Per patch a square of half-edges, each the lower left corner of a quad.
    std::vector<Index> cells(patch_count);
    for (std::size_t p = 0; p < patch_count; ++p) cells[p] = static_cast<Index>(4 * p);
    std::size_t side = 1;
    for (auto level = levels.rbegin(); level != levels.rend(); ++level, side *= 2) {
        std::vector<Index> finer(4 * cells.size());
        for (std::size_t cell = 0; cell < cells.size(); ++cell) {
            const std::size_t row = cell / side, i = cell % side; // row counts through all patches
            for (Index c = 0; c < 4; ++c) {
                const std::size_t right = c == 1 || c == 2, up = c >= 2;
                const Index child = level->children[turned(cells[cell], c)];
                finer[(2 * row + up) * 2 * side + 2 * i + right] = turned(child, 4 - c);
            }
        }
        cells = std::move(finer);
    }
    std::vector<Index> grid;
    grid.reserve(patch_count * (side + 1) * (side + 1));
    const auto add_row = [&](const Index* row, Index left, Index right) {
        for (std::size_t i = 0; i < side; ++i) grid.push_back(finest.corners[turned(row[i], left)]);
        grid.push_back(finest.corners[turned(row[side - 1], right)]);
    };
    for (std::size_t p = 0; p < patch_count; ++p) {
        const Index* rows = cells.data() + p * side * side;
        for (std::size_t j = 0; j < side; ++j) add_row(rows + j * side, 0, 1);
        add_row(rows + (side - 1) * side, 3, 2);
    }
    return grid;
}

} // namespace

Result<RegularPatches> find_regular_patches(const Mesh& mesh, unsigned max_levels, const RunContext& context) {
    if (auto error = mesh_error(mesh)) return *error;
    if (auto error = check_quads(mesh)) return *error;
    if (mesh.corners.size() >= kNoIndex) return unsuitable("The mesh has more than a thousand million faces");
    Quads finest;
    finest.corners = mesh.corners;
    if (auto error = match_twins(finest, mesh.vertex_count())) return *error;
    const auto kinds = vertex_kinds(finest, mesh.vertex_count());
    if (!kinds) return kinds.error();

    std::vector<Undone> levels;
    while (levels.size() < max_levels) {
        context.report("find rows and columns", static_cast<double>(levels.size()) / max_levels);
        auto undone = undo_subdivision(levels.empty() ? finest : levels.back().coarse, *kinds, context);
        if (!undone && (levels.empty() || undone.error().code == ErrorCode::cancelled)) return undone.error();
        if (!undone) break;
        levels.push_back(std::move(*undone));
    }
    if (levels.empty()) return Error{ErrorCode::usage, "At least one level has to be undone; max_levels is 0."};

    RegularPatches patches;
    patches.levels = static_cast<unsigned>(levels.size());
    const Quads& base = levels.back().coarse;
    patches.base.resize(base.face_count());
    for (std::size_t h = 0; h < base.corners.size(); ++h) patches.base[h / 4][h % 4] = base.corners[h];
    patches.grid = lay_out_grid(levels, finest, base.face_count());
    return patches;
}

} // namespace filigree
