#include "random_warps.h"

#include "filigree/core/random.h"

#include <cmath>
#include <optional>

namespace filigree::bench {

namespace {

/// Numbers of one seed, one after the other.
class Draw {
public:
    explicit Draw(std::uint64_t seed) : seed_(seed) {}
    double between(double low, double high) { return low + (high - low) * random_unit(seed_, counter_++); }
    std::size_t below(std::size_t count) { return random_bits(seed_, counter_++) % count; }
    Vec3d in(const Box& box) {
        Vec3d p;
        for (int k = 0; k < 3; ++k) p[k] = between(box.min[k], box.max[k]);
        return p;
    }

private:
    std::uint64_t seed_, counter_ = 0;
};

/// p + strength g(|p - centre|) (p - centre), g a Gaussian. One to one for strengths of -1 to 2.
class Swell final : public SpaceWarp {
public:
    Swell(const Vec3d& centre, double deviation, double strength)
        : centre_(centre), variance_(deviation * deviation), strength_(strength) {}

    Vec3d position(const Vec3d& point) const override { return warp(point).position; }
    Warped warp(const Vec3d& point) const override {
        const Vec3d d = point - centre_;
        const double g = strength_ * std::exp(-d.squaredNorm() / (2 * variance_));
        return {point + g * d, (1 + g) * Mat3d::Identity() - g / variance_ * d * d.transpose()};
    }

private:
    Vec3d centre_;
    double variance_, strength_;
};

std::unique_ptr<SpaceWarp> scribble(const Box& box, Draw& draw) {
    const double longest = draw.between(0.005, 0.05) * box.diagonal();
    std::vector<Vec3d> centres, moves;
    for (int i = 0; i < 12; ++i) {
        centres.push_back(draw.in(box));
        Vec3d move;
        for (int k = 0; k < 3; ++k) move[k] = draw.between(-1, 1);
        moves.push_back(longest * move / std::max(1.0, move.norm()));
    }
    return make_rbf(centres, moves);
}

} // namespace

RandomWarp random_warp(const Box& box, std::uint64_t seed) {
    Draw draw(seed);
    const std::size_t kind = draw.below(6);
    const auto axis = static_cast<Axis>(draw.below(3));
    switch (kind) {
    case 0:
        return {"bend", make_bend(box, axis, draw.between(10, 200))};
    case 1:
        return {"twist", make_twist(box, axis, draw.between(10, 300))};
    case 2:
        return {"taper", make_taper(box, axis, draw.between(0.3, 2)).value()};
    case 3: {
        const Vec3d centre = draw.in(box);
        const double deviation = draw.between(0.1, 0.4) * box.diagonal();
        return {"swell", std::make_unique<Swell>(centre, deviation, draw.between(-0.5, 1))};
    }
    case 4:
        return {"smooth", make_smooth_random(box, draw.between(0.02, 0.3), seed)};
    default:
        return {"scribble", scribble(box, draw)};
    }
}

} // namespace filigree::bench
