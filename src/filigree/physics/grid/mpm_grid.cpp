#include "filigree/physics/grid/mpm_grid.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <cmath>

namespace filigree::mpm {

namespace {

constexpr std::size_t kParticleGrain = 4096, kBlockGrain = 16;

std::uint64_t mixed(const BlockPlace& p) {
    std::uint64_t h = std::uint64_t(std::uint32_t(p.x)) * 0x9e3779b97f4a7c15u;
    h ^= std::uint64_t(std::uint32_t(p.y)) * 0xc2b2ae3d27d4eb4fu;
    h ^= std::uint64_t(std::uint32_t(p.z)) * 0x165667b19e3779f9u;
    h ^= std::uint64_t(p.body) * 0xd6e8feb86659fd93u;
    h ^= h >> 32;
    h *= 0x9e3779b97f4a7c15u;
    return h ^ h >> 29;
}

} // namespace

BlockPlace Grid::block_of(const std::array<int, 3>& base, std::uint32_t body) {
    return {base[0] >> 2, base[1] >> 2, base[2] >> 2, body};
}

std::size_t Grid::slot(const BlockPlace& place) const {
    const std::size_t mask = table_.size() - 1;
    std::size_t at = mixed(place) & mask;
    while (table_[at] != kNoIndex && places_[table_[at]] != place) at = (at + 1) & mask;
    return at;
}

Index Grid::find(const BlockPlace& place) const { return table_.empty() ? kNoIndex : table_[slot(place)]; }

/// While blocks are collected, places_ is in the order of their coming.
std::uint32_t Grid::insert(const BlockPlace& place) {
    if (2 * (places_.size() + 1) > table_.size()) {
        table_.assign(std::max<std::size_t>(1024, 2 * table_.size()), kNoIndex);
        for (std::uint32_t b = 0; b < places_.size(); ++b) table_[slot(places_[b])] = b;
    }
    std::uint32_t& entry = table_[slot(place)];
    if (entry == kNoIndex) {
        entry = std::uint32_t(places_.size());
        places_.push_back(place);
    }
    return entry;
}

/// The blocks that particles' stencils reach. Returns 1 for each that there was from whose particles a node is hidden.
std::vector<std::uint8_t> Grid::insert_around(std::span<const std::uint32_t> hidden) {
    const std::size_t with_particles = places_.size();
    std::vector<std::uint8_t> hides(with_particles, 0);
    for (std::size_t p = 0; p < hidden.size(); ++p) hides[block_of_particle_[p]] |= hidden[p] != 0;
    has_behind_ = std::ranges::count(hides, 1) > 0;
    for (std::size_t b = 0; b < with_particles; ++b)
        for (int k = 0; k < 8; ++k) {
            BlockPlace next = places_[b];
            next.x += k & 1;
            next.y += k >> 1 & 1;
            next.z += k >> 2 & 1;
            if (k > 0) insert(next);
            next.body |= kBehind;
            if (hides[b]) insert(next);
        }
    return hides;
}

std::array<Index, 8> Grid::blocks_around(const BlockPlace& place) const {
    std::array<Index, 8> around;
    for (int k = 0; k < 8; ++k)
        around[std::size_t(k)] = find({place.x + (k & 1), place.y + (k >> 1 & 1), place.z + (k >> 2 & 1), place.body});
    return around;
}

void Grid::begin(std::span<const Particle> particles, std::span<const std::uint32_t> bodies,
                 std::span<const std::uint32_t> hidden, const RunContext& context) {
    found_.resize(particles.size());
    parallel_for(context, particles.size(), kParticleGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p)
            found_[p] = block_of(Stencil(particles[p].x, spacing_).base, bodies[p]);
    });
    places_.clear();
    std::fill(table_.begin(), table_.end(), kNoIndex);
    block_of_particle_.resize(particles.size());
    for (std::size_t p = 0; p < particles.size(); ++p)
        block_of_particle_[p] = p > 0 && found_[p] == found_[p - 1] ? block_of_particle_[p - 1] : insert(found_[p]);
    const std::vector<std::uint8_t> hides = insert_around(hidden);

    std::vector<std::uint32_t> sorted(places_.size()), rank(places_.size());
    for (std::uint32_t b = 0; b < sorted.size(); ++b) sorted[b] = b;
    std::ranges::sort(sorted, {}, [&](std::uint32_t b) { return places_[b]; });
    for (std::uint32_t b = 0; b < sorted.size(); ++b) rank[sorted[b]] = b;
    for (std::uint32_t& entry : table_)
        if (entry != kNoIndex) entry = rank[entry];
    std::ranges::sort(places_);

    first_particle_.assign(places_.size() + 1, 0);
    for (std::uint32_t& block : block_of_particle_) ++first_particle_[(block = rank[block]) + 1];
    for (std::size_t b = 0; b < places_.size(); ++b) first_particle_[b + 1] += first_particle_[b];
    order_.resize(particles.size());
    std::vector<std::uint32_t> next(first_particle_.begin(), first_particle_.end() - 1);
    for (std::uint32_t p = 0; p < particles.size(); ++p) order_[next[block_of_particle_[p]]++] = p;

    around_.resize(places_.size());
    if (has_behind_) behind_.assign(places_.size(), kNoIndex);
    for (auto& group : groups_) group.clear();
    for (std::uint32_t b = 0; b < places_.size(); ++b) {
        if (first_particle_[b] == first_particle_[b + 1]) continue;
        const BlockPlace& place = places_[b];
        groups_[(place.x & 1) + 2 * (place.y & 1) + 4 * (place.z & 1)].push_back(b);
        around_[b] = blocks_around(place);
        if (!hides[sorted[b]]) continue;
        const BlockPlace hiding = {place.x, place.y, place.z, place.body | kBehind};
        behind_[b] = find(hiding);
        around_[behind_[b]] = blocks_around(hiding);
    }
    nodes_.resize(places_.size() * kBlockNodes);
    parallel_for(context, places_.size(), kBlockGrain, [&](std::size_t begin, std::size_t end) {
        std::fill(nodes_.begin() + std::ptrdiff_t(begin * kBlockNodes),
                  nodes_.begin() + std::ptrdiff_t(end * kBlockNodes), Node{});
    });
}

/// Calls visit(block's row, tile's row, nodes along x) for all rows of a tile.
template <class Visit>
void Grid::each_part(std::size_t block, const Visit& visit) const {
    for (int z = 0; z < kTileSide; ++z)
        for (int y = 0; y < kTileSide; ++y)
            for (int half = 0; half < 2; ++half) {
                const int k = half + 2 * (y / kBlockSide) + 4 * (z / kBlockSide);
                const std::size_t row = std::size_t(around_[block][k]) * kBlockNodes +
                                        std::size_t(((z % kBlockSide) * kBlockSide + y % kBlockSide) * kBlockSide);
                visit(row, (z * kTileSide + y) * kTileSide + half * kBlockSide, half ? 2 : kBlockSide);
            }
}

void Grid::read_tile(std::size_t block, Node* tile) const {
    each_part(block, [&](std::size_t row, int at, int count) { std::copy_n(&nodes_[row], count, tile + at); });
}

void Grid::add_tile(std::size_t block, const Node* tile) {
    each_part(block, [&](std::size_t row, int at, int count) {
        for (int i = 0; i < count; ++i) {
            nodes_[row + std::size_t(i)].motion += tile[at + i].motion;
            nodes_[row + std::size_t(i)].matter += tile[at + i].matter;
        }
    });
}

} // namespace filigree::mpm
