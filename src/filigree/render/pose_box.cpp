#include "filigree/render/pose_box.h"

namespace filigree {

PoseBox::PoseBox(const Model& model, std::span<const Index> vertices) {
    const BlendDetail& detail = model.detail;
    for (Index v : model.driver().vertices) rest_.push_back(model.mesh.positions[v].cast<double>());
    std::vector<char> is_wanted(model.mesh.vertex_count(), 0);
    for (Index v : vertices) is_wanted[v] = 1;
    for (std::size_t c = 0; c < detail.cells.size(); ++c) {
        Cell cell{detail.cells[c], {}};
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
            if (!is_wanted[detail.order[r]]) continue;
            const double u = detail.u[r], v = detail.v[r];
            const Vec3d m =
                (1 - u - v) * rest_[cell.corners[0]] + u * rest_[cell.corners[1]] + v * rest_[cell.corners[2]];
            cell.q.extend(model.mesh.positions[detail.order[r]].cast<double>() - 0.5 * m);
        }
        if (!cell.q.empty()) cells_.push_back(cell);
    }
}

Box PoseBox::at(std::span<const Vec3f> positions, std::span<const Mat3f> gradients) const {
    Box box;
    for (const Cell& cell : cells_)
        for (Index i : cell.corners) {
            const Mat3d a = gradients[i].cast<double>();
            const Vec3d middle = positions[i].cast<double>() + a * (cell.q.centre() - 0.5 * rest_[i]);
            const Vec3d reach = 0.5 * a.cwiseAbs() * cell.q.size();
            box.extend(middle - reach);
            box.extend(middle + reach);
        }
    return box;
}

} // namespace filigree
