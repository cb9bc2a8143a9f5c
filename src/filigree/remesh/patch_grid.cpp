#include "filigree/remesh/patch_grid.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/edges.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr std::size_t kPatchGridGrain = 1024;

/// Which side of which patch is which; sides have one direction, that of the patch that came first.
struct Sides {
    struct Side {
        std::size_t id;
        bool reversed;
    };
    std::vector<std::array<Side, 4>> of_patch;
    std::size_t count = 0;
};

Sides number_sides(std::span<const std::array<Index, 4>> base) {
    const auto corner = [&](Index h) { return base[h / 4][h % 4]; };
    const auto end = [&](Index h) { return base[h / 4][(h + 1) % 4]; };
    Index vertices = 0;
    for (const std::array<Index, 4>& patch : base) vertices = std::max(vertices, std::ranges::max(patch) + 1);
    std::vector<Index> first(4 * base.size()); // of each half-edge, the first of its edge
    for (const std::span<const Index> edge : edges_from(vertices, [&](const auto& add) {
             for (Index h = 0; h < first.size(); ++h) add(corner(h), end(h), h);
         }))
        for (const Index h : edge) first[h] = edge[0];
    Sides sides{std::vector<std::array<Sides::Side, 4>>(base.size())};
    for (Index h = 0; h < first.size(); ++h) {
        const std::size_t id = first[h] == h ? sides.count++ : sides.of_patch[first[h] / 4][first[h] % 4].id;
        sides.of_patch[h / 4][h % 4] = {id, corner(h) > end(h)};
    }
    return sides;
}

/// Vertex ids of all grids: corners keep their numbers, sides follow, then the insides.
RegularPatches number_vertices(std::span<const std::array<Index, 4>> base, const Sides& sides, std::size_t corners,
                               unsigned levels) {
    RegularPatches patches;
    patches.levels = levels;
    patches.base.assign(base.begin(), base.end());
    const std::size_t n = patches.side(), inner = n - 1;
    patches.grid.resize(base.size() * (n + 1) * (n + 1));
    for (std::size_t p = 0; p < base.size(); ++p) {
        Index* grid = &patches.grid[p * (n + 1) * (n + 1)];
        const auto at = [&](std::size_t i, std::size_t j) -> Index& { return grid[j * (n + 1) + i]; };
        at(0, 0) = base[p][0];
        at(n, 0) = base[p][1];
        at(n, n) = base[p][2];
        at(0, n) = base[p][3];
        for (std::size_t i = 1; i < n; ++i) {
            const auto on = [&](std::size_t k) {
                const Sides::Side side = sides.of_patch[p][k];
                return static_cast<Index>(corners + side.id * inner + (side.reversed ? n - i : i) - 1);
            };
            at(i, 0) = on(0);
            at(n, i) = on(1);
            at(n - i, n) = on(2);
            at(0, n - i) = on(3);
        }
        const std::size_t first = corners + sides.count * inner + p * inner * inner;
        for (std::size_t j = 1; j < n; ++j)
            for (std::size_t i = 1; i < n; ++i) at(i, j) = static_cast<Index>(first + (j - 1) * inner + i - 1);
    }
    return patches;
}

/// Grid vertices of side k, from its first corner to its second.
template <class Act>
void for_each_on_side(const RegularPatches& patches, std::size_t p, std::size_t k, const Act& act) {
    const std::size_t n = patches.side();
    for (std::size_t i = 0; i <= n; ++i)
        act(k == 0   ? patches.at(p, i, 0)
            : k == 1 ? patches.at(p, n, i)
            : k == 2 ? patches.at(p, n - i, n)
                     : patches.at(p, 0, n - i));
}

/// For each place of the grids, whether its vertex is there for the first time: vertices that patches share, the first
/// `shared`, are made by the first patch that has them.
std::vector<std::uint8_t> first_uses(const RegularPatches& patches, std::size_t shared) {
    std::vector<std::uint8_t> taken(shared, 0), first(patches.grid.size(), 1);
    for (std::size_t i = 0; i < first.size(); ++i) {
        const Index v = patches.grid[i];
        if (v < shared) first[i] = !std::exchange(taken[v], 1);
    }
    return first;
}

/// Kinds and neighbours of the vertices on curves, from the patches' sides.
void mark_curves(PatchGrid& grid) {
    grid.along.assign(grid.kinds.size(), {kNoIndex, kNoIndex});
    const auto join = [&](Index v, Index w) {
        auto& [first, second] = grid.along[v];
        (first == kNoIndex || first == w ? first : second) = w;
    };
    for (std::size_t p = 0; p < grid.patches.patch_count(); ++p)
        for (std::size_t k = 0; k < 4; ++k) {
            if (!grid.features[p][k]) continue;
            Index before = kNoIndex;
            for_each_on_side(grid.patches, p, k, [&](Index v) {
                if (grid.kinds[v] == VertexKind::inside) grid.kinds[v] = VertexKind::curve;
                if (before != kNoIndex) {
                    join(v, before);
                    join(before, v);
                }
                before = v;
            });
        }
}

} // namespace

std::vector<std::array<Index, 4>> PatchGrid::quads() const {
    const std::size_t n = patches.side();
    std::vector<std::array<Index, 4>> quads;
    quads.reserve(patches.patch_count() * n * n);
    for (std::size_t p = 0; p < patches.patch_count(); ++p)
        for (std::size_t j = 0; j < n; ++j)
            for (std::size_t i = 0; i < n; ++i)
                quads.push_back({patches.at(p, i, j), patches.at(p, i + 1, j), patches.at(p, i + 1, j + 1),
                                 patches.at(p, i, j + 1)});
    return quads;
}

PatchGrid sample_patches(const SurfaceMap& map, const BaseQuads& base, const SurfaceWalk& walk, unsigned levels,
                         const RunContext& context) {
    std::vector<std::array<Index, 4>> corners;
    for (const BaseQuad& quad : base.quads) corners.push_back(quad.vertices);
    const Sides sides = number_sides(corners);
    PatchGrid grid;
    grid.patches = number_vertices(corners, sides, base.kinds.size(), levels);
    const std::size_t n = grid.patches.side(), inner = n - 1;
    const std::size_t count = base.kinds.size() + sides.count * inner + corners.size() * inner * inner;
    grid.positions.resize(count);
    grid.source.resize(count);
    grid.kinds.assign(count, VertexKind::inside);
    grid.held.assign(count, 0);

    const std::vector<std::uint8_t> mine = first_uses(grid.patches, base.kinds.size() + sides.count * inner);
    parallel_for(context, corners.size(), 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end && !context.is_cancelled(); ++p)
            for (std::size_t j = 0; j <= n; ++j)
                for (std::size_t i = 0; i <= n; ++i) {
                    const std::size_t at = (p * (n + 1) + j) * (n + 1) + i;
                    if (!mine[at]) continue;
                    const Index v = grid.patches.grid[at];
                    grid.source[v] = map.trace(base.quads[p].at(double(i) / double(n), double(j) / double(n)));
                    grid.positions[v] = walk.position(grid.source[v]);
                }
    });
    std::copy(base.kinds.begin(), base.kinds.end(), grid.kinds.begin());
    for (const BaseQuad& quad : base.quads) grid.features.push_back(quad.features);
    mark_curves(grid);
    return grid;
}

PatchGrid halve_grid(const PatchGrid& coarse, const SurfaceWalk& walk, const RunContext& context) {
    const std::size_t n = coarse.patches.side(), fine = 2 * n;
    const Sides sides = number_sides(coarse.patches.base);
    Index corners = 0;
    for (const auto& patch : coarse.patches.base)
        for (const Index v : patch) corners = std::max(corners, v + 1);
    PatchGrid grid;
    grid.patches = number_vertices(coarse.patches.base, sides, corners, coarse.patches.levels + 1);
    const std::size_t inner = fine - 1;
    const std::size_t count = corners + sides.count * inner + coarse.patches.patch_count() * inner * inner;
    grid.positions.resize(count);
    grid.source.resize(count);
    grid.kinds.assign(count, VertexKind::inside);
    grid.held.assign(count, 0);
    grid.features = coarse.features;
    const std::vector<std::uint8_t> mine = first_uses(grid.patches, corners + sides.count * inner);
    parallel_for(context, coarse.patches.patch_count(), 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end && !context.is_cancelled(); ++p)
            for (std::size_t j = 0; j <= fine; ++j)
                for (std::size_t i = 0; i <= fine; ++i) {
                    const std::size_t at = (p * (fine + 1) + j) * (fine + 1) + i;
                    if (!mine[at]) continue;
                    const Index v = grid.patches.grid[at];
                    const Index a = coarse.patches.at(p, i / 2, j / 2);
                    const Index b = coarse.patches.at(p, (i + 1) / 2, j / 2),
                                c = coarse.patches.at(p, i / 2, (j + 1) / 2);
                    const Index d = coarse.patches.at(p, (i + 1) / 2, (j + 1) / 2);
                    if (i % 2 == 0 && j % 2 == 0) {
                        grid.positions[v] = coarse.positions[a];
                        grid.source[v] = coarse.source[a];
                        grid.kinds[v] = coarse.kinds[a];
                        grid.held[v] = coarse.held[a];
                        continue;
                    }
                    const Vec3d middle =
                        0.25 * (coarse.positions[a] + coarse.positions[b] + coarse.positions[c] + coarse.positions[d]);
                    const bool straight = i % 2 == 0 || j % 2 == 0; // between a and d, which then is b or c
                    const std::array<bool, 4>& sides_kept = coarse.features[p];
                    const bool on_curve = straight && ((j == 0 && sides_kept[0]) || (i == fine && sides_kept[1]) ||
                                                       (j == fine && sides_kept[2]) || (i == 0 && sides_kept[3]));
                    SurfaceWalk::Place place;
                    if (on_curve) {
                        // a corner lies on several curves, so the one between is found from the other end
                        place = walk.slide(coarse.source[coarse.kinds[a] == VertexKind::corner ? d : a], middle);
                    } else {
                        Index start = a; // inside where possible: points of a curve see one of its sides only
                        for (const Index x : {a, b, c, d})
                            if (coarse.kinds[x] == VertexKind::inside) start = x;
                        place = walk.walk(coarse.source[start], middle);
                    }
                    grid.positions[v] = place.position;
                    grid.source[v] = place.point;
                }
    });
    mark_curves(grid);
    return grid;
}

Mesh grid_mesh(const PatchGrid& grid, const Vec3d& origin) {
    Mesh mesh;
    mesh.origin = origin;
    mesh.positions.reserve(grid.positions.size());
    for (const Vec3d& p : grid.positions) mesh.positions.push_back(p.cast<float>());
    const std::vector<std::array<Index, 4>> quads = grid.quads();
    mesh.corners.reserve(4 * quads.size());
    mesh.face_offsets.reserve(quads.size() + 1);
    for (const auto& quad : quads) mesh.add_face(quad);
    return mesh;
}

} // namespace filigree
