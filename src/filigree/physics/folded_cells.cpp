#include "filigree/physics/folded_cells.h"

#include "filigree/core/parallel_for.h"
#include "filigree/physics/cell_normals.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr std::size_t kRunsGrain = 64, kSurfaceCellsGrain = 256;
constexpr float kBehind = 0.8f; ///< spacings that such cells may lie behind each other, along both normals together

/// As Beside::fold_cosine; rest: their cosine at rest.
float fold_cosine(float rest) { return 0.7f * rest - 0.5f; }

} // namespace

FoldedCells::FoldedCells(const Matter& matter) : matter_(matter) {
    const std::size_t count = matter.body().cells.cells.size();
    const BodySurface& surface = matter.body().surface;
    rest_normals_ = Vectors(count);
    std::vector<Index> number_of_cell(count, kNoIndex);
    for (Index s = 0; s < surface.points.size(); ++s) rest_normals_.add(matter.cell_of_point(s), surface.normals[s]);
    for (Index cell = 0; cell < count; ++cell) {
        const Vec3f normal = rest_normals_[cell];
        const bool has_normal = normal.norm() > 0;
        rest_normals_.set(cell, has_normal ? normal.normalized() : Vec3f::Zero());
        if (!has_normal) continue;
        number_of_cell[cell] = Index(surface_cells_.size());
        surface_cells_.push_back(cell);
    }
    beside_offsets_.push_back(0);
    for (const Index cell : surface_cells_) { // both sides of a thin part do not meet
        const Vec3f normal = rest_normals_[cell];
        matter.each_together(cell, [&](Index other, const Vec3f& way) {
            const Vec3f other_normal = rest_normals_[other];
            if (other <= cell || way.squaredNorm() > 1 || other_normal.isZero(0)) return;
            if (Matter::are_sides_of_thin_part(normal, other_normal, way)) return;
            const float most = fold_cosine(normal.dot(other_normal));
            if (most > -1) beside_.push_back({number_of_cell[other], most});
        });
        beside_offsets_.push_back(Index(beside_.size()));
    }
}

/// Of two surface cells whose normals have turned towards each other.
bool FoldedCells::may_touch(const Vectors& positions, Index one, Index other, const Vec3f& turned) const {
    const auto spacing = float(matter_.body().spacing());
    const Vec3f way = matter_.mean({surface_cells_[other]}, positions) - matter_.mean({surface_cells_[one]}, positions);
    return way.dot(turned) > -kBehind * spacing;
}

std::vector<Index> FoldedCells::find(const Vectors& positions, const RunContext& context) const {
    const std::span<const Cells::Run> runs = matter_.body().cells.runs;
    Vectors turned(rest_normals_.size());
    parallel_for(context, runs.size(), kRunsGrain, [&](std::size_t begin, std::size_t end) {
        turn_cell_normals(runs.subspan(begin, end - begin), positions, rest_normals_, turned);
    });
    const std::size_t count = surface_cells_.size();
    std::vector<Eigen::Vector4f> normals(count); // of surface cells alone, each in one load
    parallel_for(context, count, kSurfaceCellsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t a = begin; a < end; ++a) {
            const Index cell = surface_cells_[a];
            normals[a] = {turned.x[cell], turned.y[cell], turned.z[cell], 0};
        }
    });
    std::vector<std::vector<Index>> parts((count + kSurfaceCellsGrain - 1) / kSurfaceCellsGrain);
    parallel_for(context, parts.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t part = begin; part < end; ++part)
            for (std::size_t a = part * kSurfaceCellsGrain; a < std::min(count, (part + 1) * kSurfaceCellsGrain); ++a) {
                const Eigen::Vector4f normal = normals[a];
                const Beside* const last = beside_.data() + beside_offsets_[a + 1];
                for (const Beside* beside = beside_.data() + beside_offsets_[a]; beside != last; ++beside) {
                    const Index b = beside->other;
                    if (normal.dot(normals[b]) < beside->fold_cosine &&
                        may_touch(positions, Index(a), b, (normal - normals[b]).head<3>()))
                        parts[part].insert(parts[part].end(), {surface_cells_[a], surface_cells_[b]});
                }
            }
    });
    std::vector<Index> folded;
    for (const std::vector<Index>& part : parts) folded.insert(folded.end(), part.begin(), part.end());
    std::ranges::sort(folded);
    folded.erase(std::ranges::unique(folded).begin(), folded.end());
    return folded;
}

} // namespace filigree
