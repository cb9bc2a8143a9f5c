#include "filigree/physics/contact/folded_cells.h"

#include "filigree/core/parallel_for.h"
#include "filigree/physics/contact/cell_normals.h"
#include "filigree/physics/fem/plastic_cells.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr std::size_t kRunsGrain = 64, kNeighboursGrain = 1024;
constexpr float kBehind = 0.8f; ///< spacings that such cells may lie behind each other, along both normals together

/// As Neighbours::fold_cosine; rest: their cosine at rest.
float fold_cosine(float rest) { return 0.7f * rest - 0.5f; }

} // namespace

FoldedCells::FoldedCells(const Matter& matter) : matter_(matter) {
    const Cells& cells = matter.body().cells;
    const BodySurface& surface = matter.body().surface;
    rest_normals_ = Vectors(cells.cells.size());
    for (Index s = 0; s < surface.points.size(); ++s)
        if (!matter.is_loose(s)) rest_normals_.add(matter.cell_of_point(s), surface.normals[s]);
    for (Index cell = 0; cell < cells.cells.size(); ++cell) {
        const Vec3f normal = rest_normals_[cell];
        rest_normals_.set(cell, normal.norm() > 0 ? normal.normalized() : Vec3f::Zero());
    }
    for (Index one = 0; one < cells.cells.size(); ++one)
        for (int axis = 0; axis < 3; ++axis) {
            std::array<int, 3> at = {cells.cells[one][0], cells.cells[one][1], cells.cells[one][2]};
            ++at[std::size_t(axis)];
            const Index other = matter.cell_at(at[0], at[1], at[2]);
            if (other == kNoIndex || !cells.are_joined(one, other)) continue;
            const Vec3f normal = rest_normals_[one], other_normal = rest_normals_[other];
            if (normal.isZero(0) || other_normal.isZero(0)) continue;
            if (Matter::are_sides_of_thin_part(normal, other_normal, Vec3f::Unit(axis))) continue; // they do not meet
            const float most = fold_cosine(normal.dot(other_normal));
            if (most > -1) neighbours_.push_back({one, other, most});
        }
}

/// As turn_cell_normals, where corners have copies.
void FoldedCells::turn_by_cells(const Vectors& positions, Vectors& normals) const {
    for (Index cell = 0; cell < normals.size(); ++cell) {
        const CellSums X = cell_sums(positions, matter_.corners(cell));
        const Vec3f rest = rest_normals_[cell];
        const Vec3f area = rest.x() * X[2].cross(X[4]) + rest.y() * X[4].cross(X[1]) + rest.z() * X[1].cross(X[2]);
        normals.set(cell, area.norm() > 0 ? area.normalized() : Vec3f::Zero());
    }
}

std::vector<Index> FoldedCells::find(const Vectors& positions, const RunContext& context) const {
    const std::span<const Cells::Run> runs = matter_.body().cells.runs;
    Vectors normals(rest_normals_.size());
    if (matter_.body().cells.is_parted()) turn_by_cells(positions, normals);
    parallel_for(context, runs.size(), kRunsGrain, [&](std::size_t begin, std::size_t end) {
        turn_cell_normals(runs.subspan(begin, end - begin), positions, rest_normals_, normals);
    });
    const float behind = kBehind * float(matter_.body().spacing());
    const auto is_fold = [&](const Neighbours& cells) {
        const Vec3f one = normals[cells.one], other = normals[cells.other];
        if (!(one.dot(other) < cells.fold_cosine)) return false;
        return (matter_.mean({cells.other}, positions) - matter_.mean({cells.one}, positions)).dot(one - other) >
               -behind;
    };
    std::vector<std::vector<Index>> parts((neighbours_.size() + kNeighboursGrain - 1) / kNeighboursGrain);
    parallel_for(context, parts.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t part = begin; part < end; ++part)
            for (std::size_t k = part * kNeighboursGrain;
                 k < std::min(neighbours_.size(), (part + 1) * kNeighboursGrain); ++k)
                if (is_fold(neighbours_[k]))
                    parts[part].insert(parts[part].end(), {neighbours_[k].one, neighbours_[k].other});
    });
    std::vector<Index> folded;
    for (const std::vector<Index>& part : parts) folded.insert(folded.end(), part.begin(), part.end());
    std::ranges::sort(folded);
    folded.erase(std::ranges::unique(folded).begin(), folded.end());
    return folded;
}

} // namespace filigree
