// Squared distances from planes, added up [Garland and Heckbert 1997].
#pragma once

#include "filigree/types.h"

#include <algorithm>

namespace filigree {

/// p^T a p + 2 b^T p + c: the sum over planes, each with its weight. Model units.
struct Quadric {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Vec3d b = Vec3d::Zero();
    double c = 0, area = 0; ///< area: whatever its user adds up beside

    void add_plane(const Vec3d& unit_normal, const Vec3d& point, double weight) {
        const double d = -unit_normal.dot(point);
        a += weight * unit_normal * unit_normal.transpose();
        b += weight * d * unit_normal;
        c += weight * d * d;
    }
    Quadric& operator+=(const Quadric& other) {
        a += other.a;
        b += other.b;
        c += other.c;
        area += other.area;
        return *this;
    }
    double at(const Vec3d& p) const { return std::max(0.0, p.dot(a * p) + 2 * b.dot(p) + c); }
};

} // namespace filigree
