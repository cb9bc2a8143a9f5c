// The distortion of space that makes cracks rough: what is a plane on the grid is a rough surface in space.
#pragma once

#include "filigree/fracture.h"

#include <array>
#include <cstdint>

namespace filigree {

/// q = scale A (p + n(p) - centre), where A shrinks along the grain and n is value noise of three octaves, Hurst
/// exponent 0.8. The steps of n are bounded such that the map has an inverse at any roughness from 0 to 1.
class CrackWarp {
public:
    explicit CrackWarp(const CrackWarpOptions& options);

    /// On the grid, within +-kGridHalf for points of the box. Cost: 24 hashes, none without roughness.
    Vec3d to_grid(const Vec3d& point) const;
    /// The way back, to 1e-12 of the box. Cost: about four times to_grid (Newton's method).
    Vec3d from_grid(const Vec3d& grid) const;
    /// A point of the grid with the stretch and the scale taken back, but not the noise: cracks are still planes.
    Vec3d unstretched(const Vec3d& grid) const { return from_linear_ * grid; }
    Vec3d stretched(const Vec3d& unstretched) const { return to_linear_ * unstretched; }
    /// Bumps finer than those of the map, down to those of `shortest` length, as a height over a crack's surface; model
    /// units. They go on as the map's do; `fine_reach` is the highest there can be.
    double fine_height(const Vec3d& point, double shortest) const;
    double fine_reach(double shortest) const;

    /// Grid units in a model unit, across the grain.
    double scale() const { return scale_; }
    bool is_rough() const { return amplitude_[0] > 0; }
    /// How far from its plane a crack may be, and the length of the finest bumps; model units.
    double reach() const;
    double finest_wavelength() const;

    static constexpr double kGridHalf = 1 << 18;

private:
    Vec3d noise(const Vec3d& point, Mat3d* gradient) const;
    int fine_octaves(double shortest) const;

    Vec3d centre_;
    Mat3d to_linear_, from_linear_;
    static constexpr int kAllOctaves = 8;
    double scale_, tolerance_, frequency_ = 0;
    std::array<double, kAllOctaves> amplitude_ = {};
    std::uint64_t seed_;
};

/// Value noise of one octave at a point of the unit lattice: three numbers of -1 to 1, smooth to the second
/// derivative, with their gradient (row: component) if asked for.
Vec3d value_noise(const Vec3d& point, std::uint64_t seed, Mat3d* gradient);

} // namespace filigree
