#include "filigree/melting/particle_kernels.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/lanes.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/smoothstep.h"
#include "filigree/melting/search_boxes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr float kSearch = 2.6f; // spacings around a particle that its shape is told from
constexpr float kSupport = 2;   // spacings a kernel reaches without a shape
constexpr float kFlattest = 0.4f, kLongest = 1.25f, kAlone = 0.6f; // factors to that
constexpr float kSmoothing = 0.9f;                                 // how far centres go to the mean of their neighbours
constexpr float kFullVariance = 1.0f / 7;                          // of neighbours all around, in squared search radii

using Four = Lanes<4>::Float;

float sum(Four v) { return (v[0] + v[1]) + (v[2] + v[3]); }

/// The particles in a box and those around it, relative to its middle, ready for four at once.
struct Neighbourhood {
    std::vector<float> x, y, z;
    void add(const Vec3f& p) {
        x.push_back(p[0]);
        y.push_back(p[1]);
        z.push_back(p[2]);
    }
    void clear() {
        x.clear();
        y.clear();
        z.clear();
    }
    void fill_up() {
        while (x.size() % 4 != 0) add(Vec3f::Constant(1e15f)); // beyond every search
    }
};

struct Moments {
    float weight = 0;
    Vec3f mean = Vec3f::Zero(); ///< of the neighbours, from the particle
    Mat3f variance = Mat3f::Zero();
};

Moments moments_around(const Neighbourhood& around, const Vec3f& at, float radius) {
    Four w{}, wx{}, wy{}, wz{}, xx{}, xy{}, xz{}, yy{}, yz{}, zz{};
    const float scale = 1 / (radius * radius);
    for (std::size_t i = 0; i < around.x.size(); i += 4) {
        const Four dx = Lanes<4>::load(&around.x[i]) - at[0], dy = Lanes<4>::load(&around.y[i]) - at[1],
                   dz = Lanes<4>::load(&around.z[i]) - at[2];
        Four weight = 1 - (dx * dx + dy * dy + dz * dz) * scale;
        weight = weight > 0 ? weight : Four{};
        w += weight;
        const Four a = weight * dx, b = weight * dy, c = weight * dz;
        wx += a;
        wy += b;
        wz += c;
        xx += a * dx;
        xy += a * dy;
        xz += a * dz;
        yy += b * dy;
        yz += b * dz;
        zz += c * dz;
    }
    Moments m;
    m.weight = sum(w);
    m.mean = Vec3f(sum(wx), sum(wy), sum(wz)) / m.weight;
    m.variance << sum(xx), sum(xy), sum(xz), sum(xy), sum(yy), sum(yz), sum(xz), sum(yz), sum(zz);
    m.variance = m.variance / m.weight - m.mean * m.mean.transpose();
    return m;
}

/// spacing: that of the particles. The weight makes the sum of kernels of evenly spaced particles 1.
ParticleKernel kernel_of(const Vec3f& at, float volume, const Moments& m, float spacing) {
    ParticleKernel kernel;
    const float support = kSupport * spacing, radius = kSearch * spacing;
    // Alone, a particle is a ball of its own; with as many around it as an edge of matter has, it is part of that.
    const float together = float(smoothstep(3, 8, m.weight));
    Vec3f axes = Vec3f::Ones();
    Mat3f turn = Mat3f::Identity();
    if (m.mean.squaredNorm() > 0.01f * spacing * spacing) { // else it is deep inside, and round
        const SymmetricEigen<float, 3> eigen = symmetric_eigen(m.variance);
        turn = eigen.vectors;
        axes = (eigen.values / (kFullVariance * radius * radius)).cwiseMax(kFlattest).cwiseMin(kLongest);
    }
    axes = Vec3f::Constant(kAlone) + together * (axes - Vec3f::Constant(kAlone));
    kernel.centre = at + together * kSmoothing * m.mean;
    const Mat3f g = turn * (support * axes).cwiseInverse().asDiagonal() * turn.transpose();
    kernel.shape = {g(0, 0), g(0, 1), g(0, 2), g(1, 1), g(1, 2), g(2, 2)};
    kernel.reach = support * ((turn * axes.asDiagonal()).rowwise().norm());
    kernel.weight = volume * float(315 / (64 * std::numbers::pi)) / (support * support * support * axes.prod());
    return kernel;
}

} // namespace

Result<std::vector<ParticleKernel>> make_particle_kernels(const MatterParticles& particles, const RunContext& context) {
    const float radius = kSearch * particles.spacing;
    const SearchBoxes boxes(particles.positions, radius);
    std::vector<ParticleKernel> kernels(particles.positions.size());
    parallel_for(context, boxes.lookup.block_count(), 16, [&](std::size_t begin, std::size_t end) {
        Neighbourhood around;
        for (std::size_t box = begin; box < end && !context.is_cancelled(); ++box) {
            const Vec3f middle = particles.positions[boxes.entries[boxes.starts[box]].particle];
            around.clear();
            for (const Index other : boxes.lookup.around(Index(box)))
                if (other != kNoIndex)
                    for (std::size_t i = boxes.starts[other]; i < boxes.starts[other + 1]; ++i)
                        around.add(particles.positions[boxes.entries[i].particle] - middle);
            around.fill_up();
            for (std::size_t i = boxes.starts[box]; i < boxes.starts[box + 1]; ++i) {
                const Index p = boxes.entries[i].particle;
                const Vec3f& at = particles.positions[p];
                kernels[i] =
                    kernel_of(at, particles.volumes[p], moments_around(around, at - middle, radius), particles.spacing);
            }
        }
    });
    if (context.is_cancelled()) return cancelled_error();
    return kernels;
}

} // namespace filigree
