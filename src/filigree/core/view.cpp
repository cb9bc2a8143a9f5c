#include "filigree/types.h"

namespace filigree {

namespace {

/// Turns directions of a world with y up.
Mat3d turn_from_y(UpAxis up) {
    switch (up) {
    case UpAxis::x:
        return (Mat3d() << 0, 1, 0, -1, 0, 0, 0, 0, 1).finished();
    case UpAxis::z:
        return (Mat3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();
    default:
        return Mat3d::Identity();
    }
}

} // namespace

Vec3d up_vector(UpAxis up) { return turn_from_y(up) * Vec3d::UnitY(); }

Vec3d view_direction(View view, UpAxis up) {
    const auto from = [&](const Vec3d& direction) -> Vec3d { return turn_from_y(up) * direction.normalized(); };
    switch (view) {
    case View::front:
        return from({0, 0, 1});
    case View::side:
        return from({1, 0, 0});
    case View::top:
        return from({0, 1, 0});
    default:
        return from({1, 1, 1});
    }
}

} // namespace filigree
