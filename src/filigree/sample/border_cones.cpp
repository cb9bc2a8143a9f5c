#include "filigree/sample/border_cones.h"

#include "filigree/core/disjoint_sets.h"

namespace filigree {

BorderCones make_border_cones(std::span<const Vec3f> positions, std::span<const MissingSide> sides) {
    BorderCones cones;
    cones.open_edges = sides.size();
    cones.positions.assign(positions.begin(), positions.end());
    if (sides.empty()) return cones;
    DisjointSets borders(positions.size());
    for (const MissingSide& side : sides) borders.join(side.from, side.to);

    struct Tip {
        Vec3d sum = Vec3d::Zero();
        std::size_t count = 0;
        Index id = kNoIndex;
    };
    std::vector<Tip> tips;
    std::vector<Index> tip_of(positions.size(), kNoIndex); // of each root
    const auto tip_at = [&](Index v) -> Tip& {
        Index& tip = tip_of[borders.root(v)];
        if (tip == kNoIndex) {
            tip = static_cast<Index>(tips.size());
            tips.push_back({});
        }
        return tips[tip];
    };
    for (const MissingSide& side : sides) {
        Tip& tip = tip_at(side.from);
        tip.sum += positions[side.from].cast<double>() + positions[side.to].cast<double>();
        tip.count += 2;
    }
    for (Tip& tip : tips) {
        tip.id = static_cast<Index>(cones.positions.size());
        cones.positions.push_back((tip.sum / static_cast<double>(tip.count)).cast<float>());
    }
    for (const MissingSide& side : sides)
        for (int copy = 0; copy < side.missing; ++copy)
            cones.triangles.push_back({side.to, side.from, tip_at(side.from).id});
    return cones;
}

} // namespace filigree
