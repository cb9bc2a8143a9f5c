#include "filigree/mesh/defect_edges.h"

#include "filigree/mesh/normals.h"

#include <algorithm>

namespace filigree {

std::vector<DefectEdge> defect_edges(const Mesh& mesh) {
    struct Side {
        Index a, b;
        bool is_forward;
        auto operator<=>(const Side&) const = default;
    };
    const double diagonal = bounds(mesh).diagonal(), least_area = 1e-14 * diagonal * diagonal;
    std::vector<Side> sides;
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
        for (std::size_t k = 0; corners.size() > 2 && k < corners.size(); ++k) {
            const Index a = corners[k], b = corners[(k + 1) % corners.size()];
            sides.push_back({std::min(a, b), std::max(a, b), a < b});
        }
    }
    std::sort(sides.begin(), sides.end());
    std::vector<DefectEdge> defects;
    for (std::size_t i = 0, j = 0; i < sides.size(); i = j) {
        while (j < sides.size() && sides[j].a == sides[i].a && sides[j].b == sides[i].b) ++j;
        const bool is_opposed = j - i == 2 && sides[i] == sides[i + 1];
        if (j - i != 2 || is_opposed) defects.push_back({sides[i].a, sides[i].b, j - i == 1, is_opposed});
    }
    for (const Index v : flat) defects.push_back({v, v});
    return defects;
}

} // namespace filigree
