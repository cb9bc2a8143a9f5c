// The loops between particles and nodes: what they keep, and the same bytes in every vector width.
#include "filigree/core/random.h"
#include "filigree/physics/grid/mpm_kernel.h"
#include "filigree/physics/material.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <string>

namespace filigree::mpm {
namespace {

constexpr float kCell = 0.1f, kStep = 1e-4f;

/// In the block of the grid's first nodes, moving and warm.
std::vector<Particle> some_particles() {
    std::vector<Particle> particles(300);
    std::uint64_t rolls = 0;
    const auto roll = [&] { return float(random_unit(7, rolls++)); };
    for (Particle& p : particles) {
        p = {};
        for (float& x : p.x) x = kCell * (0.5f + 3.99f * roll());
        p.mass = 1 + roll();
        p.volume = 1e-3f;
        for (float& v : p.v) v = roll() - 0.5f;
        for (auto& column : p.c)
            for (int r = 0; r < 3; ++r) column[r] = roll() - 0.5f;
        for (int k = 0; k < 6; ++k) p.b[k] = (k < 3 ? 1.0f : 0.0f) + 0.1f * roll();
        p.volume_ratio() = 0.9f + 0.2f * roll();
        p.enthalpy() = 8e5f + 2e5f * roll();
        p.renewal = roll();
        for (float& slope : p.warming) slope = roll();
    }
    return particles;
}

Matter wax() {
    const auto materials = named_materials();
    return Matter(std::ranges::find(materials, "wax", &NamedMaterial::name)->material, 10);
}

std::vector<std::uint32_t> all_of(const std::vector<Particle>& particles) {
    std::vector<std::uint32_t> numbers(particles.size());
    std::iota(numbers.begin(), numbers.end(), 0u);
    return numbers;
}

std::vector<Node> scattered(VectorWidth width) {
    const std::vector<Particle> particles = some_particles();
    std::vector<Node> tile(kTileNodes);
    scatter_particles(all_of(particles), particles.data(), wax(), kCell, kStep, tile.data(), width);
    return tile;
}

std::vector<AtParticle> gathered(const std::vector<Node>& tile, VectorWidth width) {
    const std::vector<Particle> particles = some_particles();
    std::vector<AtParticle> found(particles.size());
    gather_at_particles(all_of(particles), particles.data(), kCell, tile.data(), found.data(), width);
    return found;
}

TEST(MpmKernel, NodesHaveTheParticlesMassMomentumAndHeat) {
    double sums[8] = {}, wanted[8] = {};
    for (const Node& node : scattered(widest_vectors()))
        for (int k = 0; k < 4; ++k) {
            sums[k] += double(node.motion[k]);
            sums[4 + k] += double(node.matter[k]);
        }
    const Matter matter = wax();
    for (const Particle& p : some_particles()) {
        const auto mass = double(p.mass);
        for (int k = 0; k < 3; ++k) wanted[k] += mass * double(p.v[k]);
        wanted[3] += mass;
        wanted[4] += mass * double(matter.temperature(p.enthalpy()));
        wanted[7] += mass * double(p.renewal);
    }
    for (int k = 0; k < 8; ++k) EXPECT_NEAR(sums[k], wanted[k], 1e-5 * std::max(wanted[3], std::abs(wanted[k]))) << k;
}

TEST(MpmKernel, AffineNodesComeBackExactly) {
    std::vector<Node> tile(kTileNodes);
    for (int n = 0; n < kTileNodes; ++n) {
        const float x = kCell * float(n % kTileSide), y = kCell * float(n / kTileSide % kTileSide),
                    z = kCell * float(n / (kTileSide * kTileSide));
        tile[std::size_t(n)].motion = Float4{1 + 2 * x - y, 3 * z, x + y + z, 5};
        tile[std::size_t(n)].matter = Float4{300 + 10 * y, 0, 0.25f, 0.5f};
    }
    const std::vector<Particle> particles = some_particles();
    const std::vector<AtParticle> found = gathered(tile, widest_vectors());
    const float moment = 4 / (kCell * kCell);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const Particle& p = particles[i];
        EXPECT_NEAR(found[i].value[0], 1 + 2 * p.x[0] - p.x[1], 1e-5);
        EXPECT_NEAR(found[i].value[1], 3 * p.x[2], 1e-5);
        EXPECT_NEAR(found[i].value[4], 300 + 10 * p.x[1], 1e-3);
        EXPECT_NEAR(moment * found[i].slope[0][0], 2, 1e-3);
        EXPECT_NEAR(moment * found[i].slope[1][0], -1, 1e-3);
        EXPECT_NEAR(moment * found[i].slope[2][1], 3, 1e-3);
        EXPECT_NEAR(moment * found[i].slope[1][4], 10, 0.05);
    }
}

TEST(MpmKernel, EveryWidthGivesTheSameBytes) {
    const std::vector<Node> tile = scattered(VectorWidth::bytes16);
    const std::vector<AtParticle> found = gathered(tile, VectorWidth::bytes16);
    for (std::size_t w = 1; w < vector_width_count(); ++w) {
        const std::vector<Node> wide = scattered(VectorWidth(w));
        EXPECT_EQ(std::memcmp(wide.data(), tile.data(), tile.size() * sizeof(Node)), 0) << w;
        const std::vector<AtParticle> wide_found = gathered(tile, VectorWidth(w));
        EXPECT_EQ(std::memcmp(wide_found.data(), found.data(), found.size() * sizeof(AtParticle)), 0) << w;
    }
}

TEST(MpmKernel, DeformGivesTheSameBytesInEveryWidthAndGrouping) {
    const Matter matter = wax();
    std::vector<Particle> one = some_particles();
    one.resize(299); // the last lanes stay empty
    for (std::size_t i = 0; i < one.size(); i += 3)
        for (int k = 0; k < 6; ++k) one[i].b[k] *= 1 + 0.3f * float(i % 7); // some yield
    const std::vector<Particle> start = one;
    const auto bytes = [](const std::vector<Particle>& particles) {
        return std::string(reinterpret_cast<const char*>(particles.data()), particles.size() * sizeof(Particle));
    };
    const std::vector<std::uint32_t> numbers = all_of(one);
    matter.deform(numbers, one.data(), 0.01f, VectorWidth::bytes16);
    for (std::size_t w = 0; w < vector_width_count(); ++w) {
        std::vector<Particle> other = start;
        matter.deform(numbers, other.data(), 0.01f, VectorWidth(w));
        EXPECT_TRUE(bytes(other) == bytes(one)) << w;
        other = start;
        for (const std::uint32_t number : numbers)
            matter.deform(std::span(&number, 1), other.data(), 0.01f, VectorWidth(w));
        EXPECT_TRUE(bytes(other) == bytes(one)) << w << ", one by one";
    }
    for (const Particle& p : one) {
        const double b[6] = {p.b[0], p.b[1], p.b[2], p.b[3], p.b[4], p.b[5]};
        const double determinant = b[0] * (b[1] * b[2] - b[5] * b[5]) - b[3] * (b[3] * b[2] - b[5] * b[4]) +
                                   b[4] * (b[3] * b[5] - b[1] * b[4]);
        EXPECT_NEAR(determinant, 1, 2e-3);
    }
}

TEST(MpmKernel, StencilsBeginBelowTheirPointWhereverItIs) {
    for (const float x : {-7.3f, -0.5f, -0.04f, 0.0f, 0.05f, 0.149f, 0.15f, 12.34f}) {
        const float point[3] = {x, 0, 0};
        const Stencil at(point, kCell);
        EXPECT_EQ(at.base[0], int(std::floor(x / kCell - 0.5f))) << x;
        EXPECT_NEAR(at.weight[0][0] + at.weight[0][1] + at.weight[0][2], 1, 1e-6) << x;
        for (const float weight : at.weight[0]) EXPECT_GE(weight, 0) << x;
    }
    for (const float x : {1e30f, -1e30f, std::numeric_limits<float>::quiet_NaN()}) {
        const float point[3] = {x, 0, 0};
        EXPECT_LE(std::abs(Stencil(point, kCell).base[0]), kFarthestBlock * kBlockSide + 1) << x;
    }
}

} // namespace
} // namespace filigree::mpm
