#include "filigree/mesh/defect_edges.h"

#include "filigree/mesh/edges.h"
#include "filigree/mesh/normals.h"

#include <algorithm>

namespace filigree {

std::vector<DefectEdge> defect_edges(const Mesh& mesh) {
    const double diagonal = bounds(mesh).diagonal(), least_area = 1e-14 * diagonal * diagonal;
    std::vector<std::array<Index, 2>> sides; // from one corner to the next
    sides.reserve(mesh.corner_count());
    std::vector<Index> flat, corners;
    for (std::size_t face = 0; face < mesh.face_count(); ++face) {
        corners.clear();
        for (const Index v : mesh.face(face))
            if (corners.empty() || corners.back() != v) corners.push_back(v);
        while (corners.size() > 1 && corners.front() == corners.back()) corners.pop_back();
        const double area = corners.size() > 2 ? 0.5 * doubled_area_vector(mesh.positions, corners).norm() : 0;
        std::vector<Index> once = corners;
        std::sort(once.begin(), once.end());
        const bool repeats = std::adjacent_find(once.begin(), once.end()) != once.end();
        if (!corners.empty() && (repeats || corners.size() != mesh.face(face).size() || !(area > least_area)))
            flat.push_back(corners[0]);
        for (std::size_t k = 0; corners.size() > 2 && k < corners.size(); ++k)
            sides.push_back({corners[k], corners[(k + 1) % corners.size()]});
    }
    const IndexLists edges = edges_from(mesh.vertex_count(), [&](const auto& add) {
        for (Index h = 0; h < sides.size(); ++h) add(sides[h][0], sides[h][1], h);
    });
    std::vector<DefectEdge> defects;
    for (const std::span<const Index> edge : edges) {
        const auto [a, b] = sides[edge[0]];
        const bool is_opposed = edge.size() == 2 && sides[edge[1]] == sides[edge[0]];
        if (edge.size() != 2 || is_opposed)
            defects.push_back({std::min(a, b), std::max(a, b), edge.size() == 1, is_opposed});
    }
    for (const Index v : flat) defects.push_back({v, v});
    return defects;
}

} // namespace filigree
