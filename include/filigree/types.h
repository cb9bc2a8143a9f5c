// Indices, vectors, boxes and axes: the types that all other headers use.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

namespace filigree {

using Index = std::uint32_t; ///< number of a vertex, a face or a corner
inline constexpr Index kNoIndex = std::numeric_limits<Index>::max();

using Triangle = std::array<Index, 3>;

using Vec2f = Eigen::Vector2f;
using Vec3f = Eigen::Vector3f;
using Vec4f = Eigen::Matrix<float, 4, 1, Eigen::DontAlign>;
using Vec3d = Eigen::Vector3d;
using Mat3f = Eigen::Matrix3f; ///< a deformation gradient; column-major in memory, row-major in files
using Mat3d = Eigen::Matrix3d;

/// Axis-aligned bounding box. Empty until it is extended.
struct Box {
    Vec3d min = Vec3d::Constant(std::numeric_limits<double>::infinity());
    Vec3d max = Vec3d::Constant(-std::numeric_limits<double>::infinity());

    bool empty() const { return !(min.array() <= max.array()).all(); }
    void extend(const Vec3d& p) {
        min = min.cwiseMin(p);
        max = max.cwiseMax(p);
    }
    Vec3d size() const { return empty() ? Vec3d::Zero() : Vec3d(max - min); }
    Vec3d centre() const { return empty() ? Vec3d::Zero() : Vec3d(0.5 * (min + max)); }
    double diagonal() const { return size().norm(); }
};

/// The bounding box of positions; empty where there are none. Cost O(V).
inline Box bounds(std::span<const Vec3f> positions) {
    Vec3f lo = Vec3f::Constant(std::numeric_limits<float>::infinity()), hi = -lo;
    for (const Vec3f& p : positions) {
        lo = lo.cwiseMin(p);
        hi = hi.cwiseMax(p);
    }
    Box box;
    box.min = lo.cast<double>();
    box.max = hi.cast<double>();
    return box;
}

enum class Axis { x, y, z };
using UpAxis = Axis; ///< the axis that points up

/// Directions to look from. With y up: front looks along -z, side along -x (from the right), top along -y, iso from the
/// front, right and above. With z up, front looks along +y.
enum class View { front, side, top, iso };

/// The unit vector of an up axis.
Vec3d up_vector(UpAxis up);
constexpr double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// The unit vector from the object to the viewer.
Vec3d view_direction(View view, UpAxis up);

} // namespace filigree
