// The grid of the material point method: blocks of nodes where there is matter, each body's apart. Private to the
// layer.
#pragma once

#include "filigree/context.h"
#include "filigree/physics/grid/mpm_particle.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace filigree::mpm {

inline constexpr int kBlockSide = 4, kBlockNodes = kBlockSide * kBlockSide * kBlockSide;
inline constexpr int kTileSide = kBlockSide + 2, kTileNodes = kTileSide * kTileSide * kTileSide;

/// What is gathered at nodes. Scattered: momentum and mass; mass times temperature, heat, mass that has melted, mass
/// times renewal. After the update: velocity and mass; temperature, heat by mass, share that has melted, renewal.
struct Node {
    Float4 motion = {}, matter = {};
};
inline Vec3f velocity_of(const Node& node) { return {node.motion[0], node.motion[1], node.motion[2]}; }
inline void set_velocity(Node& node, const Vec3f& velocity) {
    for (int k = 0; k < 3; ++k) node.motion[k] = velocity[k];
}

/// With a body's number: of its matter that a wall hides a node from, in a place of its own.
inline constexpr std::uint32_t kBehind = 1u << 31;

/// Where a block is, and whose.
struct BlockPlace {
    std::int32_t x, y, z; ///< its first node, in blocks
    std::uint32_t body;   ///< or one with kBehind
    auto operator<=>(const BlockPlace&) const = default;
};

/// Quadratic B-splines about a point.
struct Stencil {
    std::array<int, 3> base;        ///< the first of three nodes along each axis
    float weight[3][3];             ///< [axis][node]
    std::array<float, 3> first_way; ///< m, from the point to the first node
    FILIGREE_INLINE Stencil(const float point[3], float spacing);
};

/// Places farther than this many blocks from the origin are brought nearer.
inline constexpr int kFarthestBlock = 1 << 20;

FILIGREE_INLINE Stencil::Stencil(const float point[3], float spacing) {
    for (int axis = 0; axis < 3; ++axis) {
        constexpr float kFarthest = float(kFarthestBlock * kBlockSide);
        float at = point[axis] / spacing;
        at = at > -kFarthest ? at : -kFarthest; // of what is no number, too
        at = at < kFarthest ? at : kFarthest;
        base[axis] = int(at - 0.5f);
        base[axis] -= float(base[axis]) > at - 0.5f; // downwards, without a call
        const float off = at - float(base[axis]);
        weight[axis][0] = 0.5f * (1.5f - off) * (1.5f - off);
        weight[axis][1] = 0.75f - (off - 1) * (off - 1);
        weight[axis][2] = 0.5f * (off - 0.5f) * (off - 0.5f);
        first_way[axis] = -off * spacing;
    }
}

class Grid {
public:
    explicit Grid(float spacing) : spacing_(spacing) {}

    /// Sorts particles into blocks, and makes the blocks that they reach; all nodes are zero. bodies: of each particle.
    /// hidden: of each, what of its nodes is behind walls; none: nothing of any.
    void begin(std::span<const Particle> particles, std::span<const std::uint32_t> bodies,
               std::span<const std::uint32_t> hidden, const RunContext& context);

    float spacing() const { return spacing_; }
    std::size_t block_count() const { return places_.size(); }
    const BlockPlace& place(std::size_t block) const { return places_[block]; } ///< ascending
    Node* nodes(std::size_t block) { return nodes_.data() + block * kBlockNodes; }
    const Node* nodes(std::size_t block) const { return nodes_.data() + block * kBlockNodes; }
    /// Particles whose stencils begin in the block.
    std::span<const std::uint32_t> particles(std::size_t block) const {
        return std::span(order_).subspan(first_particle_[block], first_particle_[block + 1] - first_particle_[block]);
    }
    /// Blocks with particles, in eight groups: those of one group share no node with each other's tiles.
    const std::array<std::vector<std::uint32_t>, 8>& groups() const { return groups_; }
    /// Of a block with particles: the block behind walls, kNoIndex where nothing is hidden.
    Index behind(std::size_t block) const { return has_behind_ ? behind_[block] : kNoIndex; }
    bool has_behind() const { return has_behind_; }
    /// The block, kNoIndex where there is none.
    Index find(const BlockPlace& place) const;

    /// The number of a node of a body, block by block; kNoNode where there is none.
    std::size_t node_index(const std::array<int, 3>& node, std::uint32_t body) const {
        const Index block = find(block_of(node, body));
        if (block == kNoIndex) return kNoNode;
        return std::size_t(block) * kBlockNodes +
               std::size_t(((node[2] & 3) * kBlockSide + (node[1] & 3)) * kBlockSide + (node[0] & 3));
    }
    const Node& node(std::size_t index) const { return nodes_[index]; }
    static constexpr std::size_t kNoNode = ~std::size_t{0};

    /// A block and the first two layers of those after it, as one array [z][y][x].
    void read_tile(std::size_t block, Node* tile) const;
    void add_tile(std::size_t block, const Node* tile);
    /// Of a stencil's base, where it begins in the tile of its block.
    static int tile_index(const std::array<int, 3>& base) {
        constexpr int kMask = kBlockSide - 1;
        return ((base[2] & kMask) * kTileSide + (base[1] & kMask)) * kTileSide + (base[0] & kMask);
    }
    static BlockPlace block_of(const std::array<int, 3>& base, std::uint32_t body);

private:
    template <class Visit>
    void each_part(std::size_t block, const Visit& visit) const;
    std::size_t slot(const BlockPlace& place) const;
    std::uint32_t insert(const BlockPlace& place);
    std::vector<std::uint8_t> insert_around(std::span<const std::uint32_t> hidden);
    std::array<Index, 8> blocks_around(const BlockPlace& place) const;

    float spacing_;
    std::vector<BlockPlace> places_;
    std::vector<Node> nodes_;
    std::vector<std::array<Index, 8>> around_; ///< of blocks with particles: those one further along x, y, z
    std::vector<std::uint32_t> order_, first_particle_, block_of_particle_;
    std::array<std::vector<std::uint32_t>, 8> groups_;
    std::vector<BlockPlace> found_;
    std::vector<Index> behind_;
    bool has_behind_ = false;
    std::vector<std::uint32_t> table_; ///< open addressing, of places_; kNoIndex: free
};

} // namespace filigree::mpm
