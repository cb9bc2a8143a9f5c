// One vertex of a descent sweep: the solution of its 3x3 system.
#pragma once

#include "filigree/physics/body/elasticity.h"

namespace filigree {

/// x of (a + 1e-6 trace(a) I) x = b by LDL^T. T: float, or a vector of floats with one system a lane. Never checks:
/// what cannot be solved comes out infinite or NaN.
template <class T>
[[gnu::always_inline]] inline void solve_block(T xx, T yy, T zz, T xy, T xz, T yz, T& bx, T& by, T& bz) {
    const T shift = 1e-6f * (xx + yy + zz);
    const T d0 = xx + shift;
    const T lx = xy / d0, lz = xz / d0;
    const T d1 = (yy + shift) - lx * xy;
    const T rest = yz - lx * xz;
    const T ly = rest / d1;
    const T d2 = ((zz + shift) - lz * xz) - ly * rest;
    const T c1 = by - lx * bx;
    const T c2 = (bz - lz * bx) - ly * c1;
    const T z = c2 / d2;
    const T y = c1 / d1 - ly * z;
    bx = (bx / d0 - lx * y) - lz * z;
    by = y;
    bz = z;
}

inline Vec3f Symmetric3::solve(const Vec3f& b) const {
    Vec3f d = b;
    solve_block(xx, yy, zz, xy, xz, yz, d.x(), d.y(), d.z());
    return d.allFinite() ? d : Vec3f::Zero();
}

} // namespace filigree
