#include "filigree/physics/folded_cells.h"

#include "filigree/core/parallel_for.h"
#include "filigree/physics/cell_normals.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr std::size_t kRunsGrain = 64, kFoldsGrain = 256;
constexpr float kBehind = 0.8f; ///< spacings that such cells may lie behind each other, along both normals together

/// As Beside::fold_cosine; rest: their cosine at rest.
float fold_cosine(float rest) { return 0.7f * rest - 0.5f; }

} // namespace

FoldedCells::FoldedCells(const Matter& matter) : matter_(matter) {
    const std::size_t count = matter.body().cells.cells.size();
    const BodySurface& surface = matter.body().surface;
    rest_normals_ = Vectors(count);
    for (Index s = 0; s < surface.points.size(); ++s) rest_normals_.add(matter.cell_of_point(s), surface.normals[s]);
    for (Index cell = 0; cell < count; ++cell) {
        const Vec3f normal = rest_normals_[cell];
        const bool has_normal = normal.norm() > 0;
        rest_normals_.set(cell, has_normal ? normal.normalized() : Vec3f::Zero());
        if (has_normal) surface_cells_.push_back(cell);
    }
    beside_offsets_.push_back(0);
    for (const Index cell : surface_cells_) { // both sides of a thin part do not meet
        const Vec3f normal = rest_normals_[cell];
        matter.each_together(cell, [&](Index other, const Vec3f& way) {
            const Vec3f other_normal = rest_normals_[other];
            if (other <= cell || way.cwiseAbs().maxCoeff() > 1 || other_normal.isZero(0)) return;
            if (Matter::are_sides_of_thin_part(normal, other_normal, way)) return;
            const float most = fold_cosine(normal.dot(other_normal));
            if (most > -1) beside_.push_back({other, most});
        });
        beside_offsets_.push_back(Index(beside_.size()));
    }
}

/// Of two cells whose normals have turned towards each other.
bool FoldedCells::may_touch(const Vectors& positions, const Vectors& normals, Index cell, Index other) const {
    const auto spacing = float(matter_.body().spacing());
    const Vec3f way = matter_.mean({other}, positions) - matter_.mean({cell}, positions);
    return way.dot(normals[cell] - normals[other]) > -kBehind * spacing;
}

std::vector<Index> FoldedCells::find(const Vectors& positions, const RunContext& context) const {
    const std::span<const Cells::Run> runs = matter_.body().cells.runs;
    Vectors normals(rest_normals_.size());
    parallel_for(context, runs.size(), kRunsGrain, [&](std::size_t begin, std::size_t end) {
        turn_cell_normals(runs.subspan(begin, end - begin), positions, rest_normals_, normals);
    });
    std::vector<std::vector<Index>> parts((surface_cells_.size() + kFoldsGrain - 1) / kFoldsGrain);
    parallel_for(context, parts.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t part = begin; part < end; ++part)
            for (std::size_t a = part * kFoldsGrain; a < std::min(surface_cells_.size(), (part + 1) * kFoldsGrain);
                 ++a) {
                const Index cell = surface_cells_[a];
                const Vec3f normal = normals[cell];
                const Beside* const last = beside_.data() + beside_offsets_[a + 1];
                for (const Beside* beside = beside_.data() + beside_offsets_[a]; beside != last; ++beside)
                    if (normal.dot(normals[beside->other]) < beside->fold_cosine &&
                        may_touch(positions, normals, cell, beside->other))
                        parts[part].insert(parts[part].end(), {cell, beside->other});
            }
    });
    std::vector<Index> folded;
    for (const std::vector<Index>& part : parts) folded.insert(folded.end(), part.begin(), part.end());
    std::ranges::sort(folded);
    folded.erase(std::ranges::unique(folded).begin(), folded.end());
    return folded;
}

} // namespace filigree
