// Based on: quadric error metrics [Garland 1997], in two stages. meshoptimizer takes off the bulk at 2 M triangles a
// second; the last levels, which become the driver, are made by our own collapses, which spread their vertices evenly
// and are not held back by scraps, seams and non-manifold places. Large meshes are cut into pieces that are simplified
// at the same time with their borders kept. meshoptimizer counts triangles and we vertices, so its target is corrected
// by the ratio reached.
#include "filigree/hierarchy/simplify.h"

#include "filigree/core/parallel_for.h"
#include "filigree/hierarchy/edge_collapse.h"

#include <algorithm>
#include <numeric>

#include <meshoptimizer.h>

namespace filigree {

namespace {

/// Vertices from which our own collapses take over: they are an eighth as fast, so they only get what is left.
constexpr std::size_t kFinishFrom = 20'000;

std::size_t count_vertices(std::span<const Triangle> triangles, std::size_t vertex_count) {
    std::vector<bool> seen(vertex_count, false);
    std::size_t count = 0;
    for (const Triangle& t : triangles)
        for (Index v : t) {
            count += !seen[v];
            seen[v] = true;
        }
    return count;
}

/// Triangles of one piece of a mesh over vertex ids of its own, so that a piece costs no more than its share.
struct Piece {
    std::vector<Triangle> triangles;
    std::vector<Vec3f> positions;
    std::vector<Index> source; ///< of each local vertex
};

constexpr std::size_t kPieceTriangles = 1'000'000;

/// The mesh cut along its longest side into pieces of equal size; one piece where it is small. Depends on the mesh
/// alone.
std::vector<Piece> cut_into_pieces(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
    const std::size_t count = std::clamp<std::size_t>(triangles.size() / kPieceTriangles, 1, 16);
    int axis = 0;
    bounds(positions).size().maxCoeff(&axis);
    std::vector<Index> order(triangles.size());
    std::iota(order.begin(), order.end(), 0);
    const auto key = [&](Index t) {
        return std::pair(
            positions[triangles[t][0]][axis] + positions[triangles[t][1]][axis] + positions[triangles[t][2]][axis], t);
    };
    const auto piece_begin = [&](std::size_t p) {
        return order.begin() + static_cast<std::ptrdiff_t>(triangles.size() * p / count);
    };
    for (std::size_t p = 1; p < count; ++p)
        std::nth_element(piece_begin(p - 1), piece_begin(p), order.end(),
                         [&](Index a, Index b) { return key(a) < key(b); });
    std::vector<Piece> pieces(count);
    std::vector<Index> local(positions.size(), kNoIndex);
    for (std::size_t p = 0; p < count; ++p) {
        Piece& piece = pieces[p];
        std::sort(piece_begin(p), piece_begin(p + 1)); // the file's order keeps neighbours near in memory
        for (auto it = piece_begin(p); it != piece_begin(p + 1); ++it) {
            Triangle t = triangles[*it];
            for (Index& v : t) {
                if (local[v] == kNoIndex) {
                    local[v] = static_cast<Index>(piece.source.size());
                    piece.source.push_back(v);
                    piece.positions.push_back(positions[v]);
                }
                v = local[v];
            }
            piece.triangles.push_back(t);
        }
        for (Index v : piece.source) local[v] = kNoIndex;
    }
    return pieces;
}

/// meshoptimizer on one piece, back over the mesh's vertex ids. Returns the error, model units.
double collapse_piece(Piece& piece, double ratio, double max_error, bool lock_border) {
    const double longest_side = bounds(piece.positions).size().maxCoeff();
    std::vector<Triangle> out(piece.triangles.size());
    float relative_error = 0; // to the longest side
    const auto target = static_cast<std::size_t>(double(piece.triangles.size()) * ratio);
    const std::size_t indices =
        meshopt_simplify(out.data()->data(), piece.triangles.data()->data(), piece.triangles.size() * 3,
                         piece.positions.data()->data(), piece.positions.size(), sizeof(Vec3f), target * 3,
                         longest_side > 0 ? static_cast<float>(std::min(max_error / longest_side, 1e6)) : 1e6f,
                         lock_border ? unsigned{meshopt_SimplifyLockBorder} : 0u, &relative_error);
    out.resize(indices / 3);
    for (Triangle& t : out)
        for (Index& v : t) v = piece.source[v];
    piece.triangles = std::move(out);
    return double(relative_error) * longest_side;
}

/// One round of meshoptimizer over all pieces at the same time; borders between pieces stay until a later round, whose
/// mesh is one piece. False when it could not go on.
bool collapse_bulk(std::span<const Vec3f> positions, double ratio, double max_error, Simplified& current,
                   const RunContext& context) {
    std::vector<Piece> pieces = cut_into_pieces(positions, current.triangles);
    std::vector<double> errors(pieces.size());
    parallel_for(context, pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p)
            errors[p] = collapse_piece(pieces[p], ratio, max_error, pieces.size() > 1);
    });
    std::vector<Triangle> out;
    for (const Piece& piece : pieces) out.insert(out.end(), piece.triangles.begin(), piece.triangles.end());
    if (out.empty() || out.size() == current.triangles.size()) return false;
    current.triangles = std::move(out);
    current.error = std::max(current.error, *std::max_element(errors.begin(), errors.end()));
    current.vertex_count = count_vertices(current.triangles, positions.size());
    return true;
}

} // namespace

Simplified simplify(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                    const SimplifyOptions& options, const RunContext& context) {
    Simplified current;
    current.triangles.assign(triangles.begin(), triangles.end());
    current.vertex_count = count_vertices(triangles, positions.size());
    if (triangles.empty() || (!options.target_vertices && !options.max_error)) return current;

    const double diagonal = bounds(positions).diagonal();
    const double max_error = options.max_error.value_or(1e6) * diagonal;
    const std::size_t target = std::max<std::size_t>(options.target_vertices.value_or(3), 3);
    const std::size_t bulk_target = std::max(target, kFinishFrom);
    for (int round = 0; round < 6 && current.vertex_count * 50 > bulk_target * 51 && !context.is_cancelled(); ++round)
        if (!collapse_bulk(positions, double(bulk_target) / double(current.vertex_count), max_error, current, context))
            break;
    if (current.vertex_count * 50 > target * 51) {
        EdgeCollapseResult finished = collapse_edges(
            positions, current.triangles, target, options.max_error ? std::optional(max_error) : std::nullopt, context);
        current.triangles = std::move(finished.triangles);
        current.vertex_count = finished.vertex_count;
        current.error = std::max(current.error, finished.error);
        current.forced = finished.forced;
    }
    current.error /= diagonal;
    return current;
}

} // namespace filigree
