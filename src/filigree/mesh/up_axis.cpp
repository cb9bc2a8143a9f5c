#include "filigree/mesh/up_axis.h"

#include "filigree/core/text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace filigree {

namespace {

constexpr double kThickness = 0.01;   // of the box's height: what lies in the lowest plane
constexpr double kLeastBase = 0.1;    // of the box's side: a smaller base may be chance
constexpr double kLeastAdvantage = 2; // over the bases of the other axes

/// a x b along `axis`.
double cross(const Vec3d& a, const Vec3d& b, int axis) {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    return a[i] * b[j] - a[j] * b[i];
}

/// Area of the faces that lie in the box's lowest plane along `axis` (side 1) or in its highest (side -1), and of the
/// openings there.
double flat_area(const Mesh& mesh, const Box& box, int axis, double side) {
    const double plane = side > 0 ? box.min[axis] : box.max[axis];
    const double thickness = kThickness * box.size()[axis];
    // Summed over the sides of all faces, what is shared by two faces cancels, however the vertices are welded: in the
    // plane the rims of openings are left.
    double faces = 0, openings = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const std::span<const Index> face = mesh.face(f);
        double twice_area = 0; // seen from inside the box
        std::size_t sides_in_plane = 0;
        for (std::size_t k = 0; k < face.size(); ++k) {
            const Vec3d a = mesh.positions[face[k]].cast<double>();
            const Vec3d b = mesh.positions[face[(k + 1) % face.size()]].cast<double>();
            if (std::abs(a[axis] - plane) > thickness || std::abs(b[axis] - plane) > thickness) continue;
            ++sides_in_plane;
            twice_area += side * cross(a - box.min, b - box.min, axis);
        }
        openings += 0.5 * twice_area;
        if (sides_in_plane == face.size()) faces += std::max(0.0, -0.5 * twice_area); // its front is outside
    }
    return faces + std::max(0.0, openings);
}

} // namespace

UpAxis find_up_axis(const Mesh& mesh, UpAxis usual) {
    const Box box = bounds(mesh);
    if (box.empty()) return usual;
    std::array<double, 3> base = {}, box_side = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (box.size()[int(axis)] == 0) return usual; // a sheet without thickness: a picture, more often than a floor
        base[axis] = flat_area(mesh, box, int(axis), 1);
        box_side[axis] = box.size()[int(axis + 1) % 3] * box.size()[int(axis + 2) % 3];
    }
    const auto up = static_cast<std::size_t>(std::max_element(base.begin(), base.end()) - base.begin());
    const double others = std::max(base[(up + 1) % 3], base[(up + 2) % 3]);
    if (base[up] <= kLeastBase * box_side[up] || base[up] < kLeastAdvantage * others) return usual;
    // A bar or a log has two ends alike and may as well lie; a plate lies.
    const bool has_two_ends = flat_area(mesh, box, int(up), -1) > 0.5 * base[up];
    const bool is_plate = box_side[up] >= std::max(box_side[(up + 1) % 3], box_side[(up + 2) % 3]);
    return has_two_ends && !is_plate ? usual : static_cast<UpAxis>(up);
}

UpAxis usual_up_axis(std::string_view path) {
    return lower_case(path.substr(std::max<std::size_t>(path.size(), 4) - 4)) == ".stl" ? UpAxis::z : UpAxis::y;
}

} // namespace filigree
