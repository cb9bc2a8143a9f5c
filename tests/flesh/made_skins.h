// Skins made by formulas, for tests and for bench/flesh.cpp.
#pragma once

#include "filigree/core/math.h"
#include "filigree/flesh.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace filigree_test {

using namespace filigree;

inline double smooth(double t) {
    t = std::clamp(t, 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

/// Angles of the second joint at a moment: about z (an elbow) and about x (a twist), radians.
using TubeMotion = std::function<std::pair<double, double>(double seconds)>;

/// A cylinder along x, 1 m long and 0.2 m thick, with a joint at its left end and one in its middle. Its weights blend
/// over 0.2 m. `root` moves all of it.
inline SkinnedMesh tube(
    unsigned resolution, double seconds, TubeMotion motion,
    std::function<Eigen::Affine3d(double)> root = [](double) { return Eigen::Affine3d::Identity(); }) {
    SkinnedMesh skin;
    skin.mesh = make_cylinder({.resolution = resolution, .size = 0.2, .length = 5});
    skin.joints = {{.name = "upper", .place = {-0.5, 0, 0}}, {.name = "lower", .parent = 0, .place = {0, 0, 0}}};
    for (const Vec3f& p : skin.mesh.positions) {
        const auto lower = float(smooth((double(p.x()) + 0.1) / 0.2));
        if (lower < 1) skin.weights.joints.push_back(0), skin.weights.weights.push_back(1 - lower);
        if (lower > 0) skin.weights.joints.push_back(1), skin.weights.weights.push_back(lower);
        skin.weights.first.push_back(Index(skin.weights.joints.size()));
    }
    skin.clips = {{"bend", seconds}};
    skin.transforms = [=](std::size_t, double t, std::span<Eigen::Affine3d> out) {
        const auto [bend, twist] = motion(std::min(t, seconds));
        out[0] = root(std::min(t, seconds));
        out[1] = out[0] * Eigen::Affine3d(math::matrix(Eigen::AngleAxisd(bend, Vec3d::UnitZ())) *
                                          math::matrix(Eigen::AngleAxisd(twist, Vec3d::UnitX())));
    };
    return skin;
}

/// An elbow that bends by so many degrees in the first three quarters of the time, and is held.
inline TubeMotion elbow(double degrees, double seconds) {
    return [=](double t) { return std::pair(radians(degrees) * smooth(t / (0.75 * seconds)), 0.0); };
}
inline TubeMotion twist(double degrees, double seconds) {
    return [=](double t) { return std::pair(0.0, radians(degrees) * smooth(t / (0.75 * seconds))); };
}
/// To and fro, so often a second.
inline TubeMotion waving(double degrees, double hertz) {
    return [=](double t) { return std::pair(radians(degrees) * math::sin(2 * std::numbers::pi * hertz * t), 0.0); };
}

} // namespace filigree_test
