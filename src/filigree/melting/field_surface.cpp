#include "filigree/melting/field_surface.h"

#include "filigree/core/parallel_for.h"
#include "filigree/melting/cell_loops.h"

#include <algorithm>
#include <array>
#include <bit>

namespace filigree {

namespace {

constexpr std::size_t kBlocksAtOnce = 8;

struct Counts {
    std::size_t crossings = 0, middles = 0, triangles = 0;
};

class FieldMesher {
public:
    FieldMesher(const ParticleField& field, const RunContext& context)
        : grid_(field.grid), field_(field), context_(context) {}

    Result<Mesh> run() {
        masks_.assign(grid_.slot_count(), 0);
        first_.assign(grid_.slot_count(), kNoIndex);
        std::vector<Counts> starts(grid_.block_count() + 1);
        for_blocks([&](std::size_t b) { starts[b + 1] = count(b); });
        if (context_.is_cancelled()) return cancelled_error();
        for (std::size_t b = 0; b < grid_.block_count(); ++b) {
            starts[b + 1].crossings += starts[b].crossings;
            starts[b + 1].middles += starts[b].middles;
            starts[b + 1].triangles += starts[b].triangles;
        }
        const Counts& all = starts.back();
        if (3 * all.triangles >= kNoIndex) // there are fewer vertices than corners
            return Error{ErrorCode::unsuitable, "The surface has too many triangles; ask for a larger cell."};
        mesh_.positions.resize(all.crossings + all.middles);
        mesh_.normals.values.resize(mesh_.positions.size());
        mesh_.corners.resize(3 * all.triangles);
        mesh_.face_offsets.resize(all.triangles + 1);
        for (std::size_t t = 0; t <= all.triangles; ++t) mesh_.face_offsets[t] = Index(3 * t);
        for_blocks([&](std::size_t b) { place_crossings(b, starts[b].crossings); });
        for_blocks([&](std::size_t b) { fill_cells(b, all.crossings + starts[b].middles, starts[b].triangles); });
        if (context_.is_cancelled()) return cancelled_error();
        return std::move(mesh_);
    }

private:
    template <class Work>
    void for_blocks(const Work& work) const {
        parallel_for(context_, grid_.block_count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end && !context_.is_cancelled(); ++b) work(b);
        });
    }

    bool is_inside(Index slot) const { return slot != kNoIndex && field_.values[slot] > 0; }

    Index corner(Index slot, int q) const { return grid_.step(slot, q & 1, q >> 1 & 1, q >> 2); }

    std::uint8_t inside_corners(Index slot) const {
        const std::array<Index, 8> corners = grid_.corners(slot);
        unsigned mask = 0;
        for (unsigned q = 0; q < 8; ++q) mask |= unsigned(is_inside(corners[q])) << q;
        return std::uint8_t(mask);
    }

    /// The axes along which the surface crosses the edge above a cell's first corner, a bit each.
    static unsigned crossed_axes(unsigned mask) {
        const unsigned first = mask & 1;
        return unsigned((mask >> 1 & 1) != first) | unsigned((mask >> 2 & 1) != first) << 1 |
               unsigned((mask >> 4 & 1) != first) << 2;
    }

    Counts count(std::size_t b) {
        Counts counts;
        for (std::size_t slot = b * BlockGrid::kNodes; slot < (b + 1) * BlockGrid::kNodes; ++slot) {
            const std::uint8_t mask = masks_[slot] = inside_corners(Index(slot));
            counts.crossings += std::size_t(std::popcount(crossed_axes(mask)));
            const CellLoops::Pattern& pattern = kCellLoops.patterns[mask];
            for (int l = 0; l < pattern.loop_count; ++l) {
                const std::size_t size = pattern.sizes[std::size_t(l)];
                counts.middles += size > 3;
                counts.triangles += size > 3 ? size : 1;
            }
        }
        return counts;
    }

    void place_crossings(std::size_t b, std::size_t vertex) {
        for (std::size_t slot = b * BlockGrid::kNodes; slot < (b + 1) * BlockGrid::kNodes; ++slot) {
            const unsigned crossed = crossed_axes(masks_[slot]);
            if (!crossed) continue;
            first_[slot] = Index(vertex);
            const Vec3d from = grid_.position(grid_.node(Index(slot)));
            const float here = field_.values[slot];
            for (int axis = 0; axis < 3; ++axis) {
                if (!(crossed >> axis & 1)) continue;
                const Index above = grid_.step(Index(slot), axis, 1);
                const float there = above == kNoIndex ? ParticleField::kOutside : field_.values[above];
                Vec3d at = from;
                // Not quite on nodes, where vertices of several edges would be at one place.
                at[axis] += grid_.cell() * std::clamp(double(here) / (double(here) - double(there)), 0.002, 0.998);
                set_vertex(vertex++, at.cast<float>());
            }
        }
    }

    void set_vertex(std::size_t vertex, const Vec3f& at) {
        const Vec3f normal = field_.normal(at);
        mesh_.positions[vertex] = at;
        mesh_.normals.values[vertex] = normal.isZero() ? Vec3f::UnitZ() : normal;
    }

    Index crossing(Index slot, int edge) const {
        const int axis = edge >> 3;
        const Index base = corner(slot, edge & 7);
        return first_[base] + Index(std::popcount(crossed_axes(masks_[base]) & ((1u << axis) - 1)));
    }

    void fill_cells(std::size_t b, std::size_t middle, std::size_t triangle) {
        const auto add = [&](Index p, Index q, Index r) {
            const std::array<Index, 3> corners = {p, q, r};
            std::copy(corners.begin(), corners.end(), mesh_.corners.begin() + std::ptrdiff_t(3 * triangle++));
        };
        for (std::size_t slot = b * BlockGrid::kNodes; slot < (b + 1) * BlockGrid::kNodes; ++slot) {
            const CellLoops::Pattern& pattern = kCellLoops.patterns[masks_[slot]];
            const std::uint8_t* edges = pattern.edges.data();
            for (int l = 0; l < pattern.loop_count; edges += pattern.sizes[std::size_t(l++)]) {
                const std::size_t size = pattern.sizes[std::size_t(l)];
                std::array<Index, 12> loop;
                Vec3f sum = Vec3f::Zero();
                for (std::size_t i = 0; i < size; ++i) {
                    loop[i] = crossing(Index(slot), edges[i]);
                    sum += mesh_.positions[loop[i]];
                }
                if (size == 3) {
                    add(loop[0], loop[1], loop[2]);
                    continue;
                }
                set_vertex(middle, sum / float(size));
                for (std::size_t i = 0; i < size; ++i) add(Index(middle), loop[i], loop[(i + 1) % size]);
                ++middle;
            }
        }
    }

    const BlockGrid& grid_;
    const ParticleField& field_;
    const RunContext& context_;
    std::vector<std::uint8_t> masks_; ///< of each cell: inside corners
    std::vector<Index> first_;        ///< of a slot's crossings, along x before y before z
    Mesh mesh_;
};

} // namespace

Result<Mesh> make_field_surface(const ParticleField& field, const RunContext& context) {
    return FieldMesher(field, context).run();
}

} // namespace filigree
