// Sine, exponential and the like with the same bits on every processor, compiler and operating system.
// The standard library's functions differ between systems in their last bits, and IEEE 754 leaves them free. These use
// additions, multiplications, divisions and square roots alone, in a written order. They are right to 3 units in the
// last place, and slower than glibc's. Layers below `render` call no others; scripts/layers looks.
#pragma once

#include <Eigen/Geometry>

namespace filigree::math {

/// Radians. Beyond 10^6 the argument is first reduced by a rounded 2 pi, an error below the argument's own rounding.
double sin(double x);
double cos(double x);
double tan(double x);
double asin(double x);
double acos(double x);
double atan(double x);
double atan2(double y, double x);

double exp(double x);
double exp2(double x);
double expm1(double x);
double log(double x);
double log2(double x);
double log10(double x);
double log1p(double x);
double pow(double x, double y);
/// Exact up to 10^22; below 1, the double that is nearest.
double power_of_ten(int n);
double cbrt(double x);
double hypot(double x, double y);
/// Of x > 0, to 1e-13 of itself.
double gamma(double x);

/// In double, and rounded once.
inline float sin(float x) { return static_cast<float>(sin(double{x})); }
inline float cos(float x) { return static_cast<float>(cos(double{x})); }
inline float tan(float x) { return static_cast<float>(tan(double{x})); }
inline float acos(float x) { return static_cast<float>(acos(double{x})); }
inline float atan2(float y, float x) { return static_cast<float>(atan2(double{y}, double{x})); }
inline float exp(float x) { return static_cast<float>(exp(double{x})); }
inline float exp2(float x) { return static_cast<float>(exp2(double{x})); }
inline float log(float x) { return static_cast<float>(log(double{x})); }
inline float log1p(float x) { return static_cast<float>(log1p(double{x})); }
inline float pow(float x, float y) { return static_cast<float>(pow(double{x}, double{y})); }
inline float cbrt(float x) { return static_cast<float>(cbrt(double{x})); }

// What Eigen computes with the standard library's functions.

/// The rotation by an angle about a unit axis.
Eigen::Quaterniond quaternion(const Eigen::AngleAxisd& rotation);
Eigen::Matrix3d matrix(const Eigen::AngleAxisd& rotation);
/// The angle is between 0 and pi.
Eigen::AngleAxisd angle_axis(const Eigen::Quaterniond& rotation);
Eigen::AngleAxisd angle_axis(const Eigen::Matrix3d& rotation);
/// Between two unit quaternions, the short way.
Eigen::Quaterniond slerp(const Eigen::Quaterniond& from, double fraction, const Eigen::Quaterniond& to);

} // namespace filigree::math
