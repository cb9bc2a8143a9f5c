#include "filigree/physics/grid/mpm_kernel.h"

namespace filigree::mpm {

namespace {

/// A node's eight numbers in registers of N.
template <int N>
struct Eight {
    using L = Lanes<N>;
    using Float = typename L::Float;
    static constexpr int kParts = 8 / N;
    Float part[kParts];

    static FILIGREE_INLINE Eight of(float a, float b, float c, float d, float e, float f, float g, float h) {
        if constexpr (N == 8)
            return {Float{a, b, c, d, e, f, g, h}};
        else
            return {Float{a, b, c, d}, Float{e, f, g, h}};
    }
    static FILIGREE_INLINE Eight zero() { return of(0, 0, 0, 0, 0, 0, 0, 0); }
    static FILIGREE_INLINE Eight load(const float* from) {
        Eight eight = zero();
        for (int i = 0; i < kParts; ++i) eight.part[i] = L::load(from + N * i);
        return eight;
    }
    FILIGREE_INLINE void store(float* to) const {
        for (int i = 0; i < kParts; ++i) L::store(to + N * i, part[i]);
    }
    FILIGREE_INLINE void operator+=(const Eight& other) {
        for (int i = 0; i < kParts; ++i) part[i] += other.part[i];
    }
    FILIGREE_INLINE Eight operator+(const Eight& other) const {
        Eight sum = *this;
        sum += other;
        return sum;
    }
    FILIGREE_INLINE Eight operator*(float factor) const {
        Eight product = zero();
        for (int i = 0; i < kParts; ++i) product.part[i] = part[i] * factor;
        return product;
    }
};

constexpr std::size_t kAhead = 4; ///< particles that memory is asked for before they are needed

FILIGREE_INLINE void fetch(const Particle* particles, std::span<const std::uint32_t> numbers, std::size_t i) {
    if (i >= numbers.size()) return;
    const auto* const lines = reinterpret_cast<const char*>(particles + numbers[i]);
    __builtin_prefetch(lines);
    __builtin_prefetch(lines + 64);
}

template <int N>
FILIGREE_INLINE void scatter(std::span<const std::uint32_t> numbers, const Particle* particles, const Matter& matter,
                             float h, float dt, Node* tile, const BehindWalls& behind) {
    using E = Eight<N>;
    const float moment = 4 / (h * h); // the inverse moment of the weights
    const float k = -dt * moment, conductivity = matter.heat_conductivity();
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        fetch(particles, numbers, i + kAhead);
        const Particle& p = particles[numbers[i]];
        const Stencil at(p.x, h);
        float s[6];
        matter.stress(p, s);
        const float flow = k * p.volume * p.volume_ratio() * conductivity;
        const E value = E::of(p.mass * p.v[0], p.mass * p.v[1], p.mass * p.v[2], p.mass,
                              p.mass * matter.temperature(p.enthalpy()), 0, p.mass * p.melted, p.mass * p.renewal);
        const E along_x = E::of(p.mass * p.c[0][0] + k * s[0], p.mass * p.c[0][1] + k * s[3],
                                p.mass * p.c[0][2] + k * s[4], 0, 0, flow * p.warming[0], 0, 0);
        const E along_y = E::of(p.mass * p.c[1][0] + k * s[3], p.mass * p.c[1][1] + k * s[1],
                                p.mass * p.c[1][2] + k * s[5], 0, 0, flow * p.warming[1], 0, 0);
        const E along_z = E::of(p.mass * p.c[2][0] + k * s[4], p.mass * p.c[2][1] + k * s[5],
                                p.mass * p.c[2][2] + k * s[2], 0, 0, flow * p.warming[2], 0, 0);
        const std::ptrdiff_t first = Grid::tile_index(at.base);
        const std::uint32_t hidden = behind.hidden.empty() ? 0 : behind.hidden[numbers[i]];
        for (int z = 0; z < 3; ++z)
            for (int y = 0; y < 3; ++y) {
                const float wy = at.weight[2][z] * at.weight[1][y];
                const float dy = at.first_way[1] + float(y) * h, dz = at.first_way[2] + float(z) * h;
                const E row = value + along_y * dy + along_z * dz;
                const std::ptrdiff_t nodes = first + (z * kTileSide + y) * kTileSide;
                for (int x = 0; x < 3; ++x) {
                    const float w = wy * at.weight[0][x], dx = at.first_way[0] + float(x) * h;
                    Node* const side = hidden >> (9 * z + 3 * y + x) & 1 ? behind.tile : tile;
                    auto* const node = reinterpret_cast<float*>(&side[nodes + x]);
                    E sum = E::load(node);
                    sum += (row + along_x * dx) * w;
                    sum.store(node);
                }
            }
    }
}

template <int N>
FILIGREE_INLINE void gather(std::span<const std::uint32_t> numbers, const Particle* particles, float h,
                            const Node* tile, AtParticle* out) {
    using E = Eight<N>;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        fetch(particles, numbers, i + kAhead);
        const Stencil at(particles[numbers[i]].x, h);
        E value = E::zero(), along_x = E::zero(), along_y = E::zero(), along_z = E::zero();
        const Node* const first = tile + Grid::tile_index(at.base);
        for (int z = 0; z < 3; ++z)
            for (int y = 0; y < 3; ++y) {
                const float wy = at.weight[2][z] * at.weight[1][y];
                const float dy = at.first_way[1] + float(y) * h, dz = at.first_way[2] + float(z) * h;
                const Node* const nodes = first + (z * kTileSide + y) * kTileSide;
                E row = E::zero();
                for (int x = 0; x < 3; ++x) {
                    const float w = wy * at.weight[0][x], dx = at.first_way[0] + float(x) * h;
                    const E part = E::load(reinterpret_cast<const float*>(&nodes[x])) * w;
                    row += part;
                    along_x += part * dx;
                }
                value += row;
                along_y += row * dy;
                along_z += row * dz;
            }
        value.store(out->value);
        along_x.store(out->slope[0]);
        along_y.store(out->slope[1]);
        along_z.store(out->slope[2]);
        ++out;
    }
}

#ifdef FILIGREE_HAS_WIDTHS
FILIGREE_AVX2 void scatter_wide(std::span<const std::uint32_t> numbers, const Particle* particles, const Matter& matter,
                                float h, float dt, Node* tile, const BehindWalls& behind) {
    scatter<8>(numbers, particles, matter, h, dt, tile, behind);
}
FILIGREE_AVX2 void gather_wide(std::span<const std::uint32_t> numbers, const Particle* particles, float h,
                               const Node* tile, AtParticle* out) {
    gather<8>(numbers, particles, h, tile, out);
}
#endif

} // namespace

void scatter_particles(std::span<const std::uint32_t> numbers, const Particle* particles, const Matter& matter,
                       float spacing, float dt, Node* tile, VectorWidth width, const BehindWalls& behind) {
#ifdef FILIGREE_HAS_WIDTHS
    if (width != VectorWidth::bytes16) return scatter_wide(numbers, particles, matter, spacing, dt, tile, behind);
#endif
    scatter<4>(numbers, particles, matter, spacing, dt, tile, behind);
}

void gather_at_particles(std::span<const std::uint32_t> numbers, const Particle* particles, float spacing,
                         const Node* tile, AtParticle* out, VectorWidth width) {
#ifdef FILIGREE_HAS_WIDTHS
    if (width != VectorWidth::bytes16) return gather_wide(numbers, particles, spacing, tile, out);
#endif
    gather<4>(numbers, particles, spacing, tile, out);
}

} // namespace filigree::mpm
