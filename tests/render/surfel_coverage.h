// How much of a surface its surfels leave open, by depth: what shows through a hole lies behind.
#pragma once

#include "filigree/mesh/surfels.h"
#include "filigree/render.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <limits>
#include <vector>

namespace filigree_test {

/// The distance along the view to what is nearest at each pixel's middle; infinite where nothing is. in_face: one for
/// each vertex of a face of `mesh`, or none; where their sum of squares within a face is above 1, nothing is.
inline std::vector<double> depths(const filigree::Mesh& mesh, const std::vector<Eigen::Vector2d>& in_face,
                                  const filigree::Camera& camera, int width, int height) {
    using filigree::Index, filigree::Vec3d;
    std::vector<Vec3d> at;
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        at.push_back(camera.project(mesh.world_position(v), width, height));
    std::vector<double> nearest(std::size_t(width) * std::size_t(height), std::numeric_limits<double>::infinity());
    const auto draw = [&](Index i, Index j, Index k) {
        const Vec3d &a = at[i], &b = at[j], &c = at[k];
        const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
        if (area == 0) return;
        const auto [left, right] = std::minmax({a.x(), b.x(), c.x()});
        const auto [top, bottom] = std::minmax({a.y(), b.y(), c.y()});
        for (int y = std::max(0, int(top - 0.5)); y < std::min(height, int(bottom + 1.5)); ++y)
            for (int x = std::max(0, int(left - 0.5)); x < std::min(width, int(right + 1.5)); ++x) {
                const double px = x + 0.5, py = y + 0.5;
                const double v = ((px - a.x()) * (c.y() - a.y()) - (py - a.y()) * (c.x() - a.x())) / area;
                const double w = ((b.x() - a.x()) * (py - a.y()) - (b.y() - a.y()) * (px - a.x())) / area;
                if (v < 0 || w < 0 || v + w > 1) continue;
                const double depth = 1 / ((1 - v - w) / a.z() + v / b.z() + w / c.z());
                if (!in_face.empty()) {
                    const Eigen::Vector2d place =
                        depth * ((1 - v - w) / a.z() * in_face[i] + v / b.z() * in_face[j] + w / c.z() * in_face[k]);
                    if (place.squaredNorm() > 1) continue;
                }
                double& known = nearest[std::size_t(y) * std::size_t(width) + std::size_t(x)];
                known = std::min(known, depth);
            }
    };
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const auto face = mesh.face(f);
        for (std::size_t k = 1; k + 1 < face.size(); ++k) draw(face[0], face[k], face[k + 1]);
    }
    return nearest;
}

/// The share of the pixels of `mesh` at which no ellipse lies on its surface or before it, to two mean radii.
inline double open_share(const filigree::Mesh& mesh, const filigree::Surfels& surfels, const filigree::Camera& camera,
                         int width, int height) {
    const filigree::Mesh polygons = surfel_polygons(surfels); // octagons around the ellipses
    std::vector<Eigen::Vector2d> in_face(polygons.vertex_count());
    double radius = 0;
    for (std::size_t i = 0; i < surfels.size(); ++i) {
        Eigen::Matrix<double, 3, 2> axes;
        axes << surfels.u[i].cast<double>(), surfels.v[i].cast<double>();
        const Eigen::Matrix<double, 2, 3> into = (axes.transpose() * axes).inverse() * axes.transpose();
        for (const filigree::Index v : polygons.face(i))
            in_face[v] = into * (polygons.positions[v] - surfels.positions[i]).cast<double>();
        radius += double(surfels.rest_radius[i]) / double(surfels.size());
    }
    const std::vector<double> wanted = depths(mesh, {}, camera, width, height);
    const std::vector<double> found = depths(polygons, in_face, camera, width, height);
    std::size_t open = 0, all = 0;
    for (std::size_t p = 0; p < wanted.size(); ++p) {
        if (!std::isfinite(wanted[p])) continue;
        ++all;
        open += found[p] > wanted[p] + 2 * radius;
    }
    return double(open) / double(std::max<std::size_t>(all, 1));
}

} // namespace filigree_test
