// The least and the most of what particles have, many at a time. Private to the layer.
#pragma once

#include "filigree/physics/body.h"

#include <span>

namespace filigree {

struct Extremes { ///< along each axis
    Vec3f least = Vec3f::Zero(), most = Vec3f::Zero();

    /// Bound on what particles of two bodies, or of one, have beside each other.
    static float between(const Extremes& one, const Extremes& other) {
        return (one.most - other.least).cwiseMax(other.most - one.least).norm();
    }
    Extremes with(const Extremes& other) const { return {least.cwiseMin(other.least), most.cwiseMax(other.most)}; }
};

inline constexpr std::size_t kExtremesPadding = 16;

/// Of the values of particles that count, less `from` unless that is null. counts: of each particle, 1 or 0, padded by
/// zeros to a multiple of kExtremesPadding; `usual` is one that counts. Same bytes on any processor. Cost O(particles).
Extremes extremes_of(const Vectors& values, const Vectors* from, std::span<const float> counts, Index usual);

} // namespace filigree
