#include "filigree/melting/particle_field.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/melting/field_surface.h"
#include "filigree/melting/particle_kernels.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace filigree {

namespace {

constexpr std::size_t kBlockGrain = 8;
constexpr double kFarthestOffset = 0.8; // spacings: beyond it the field's gradient says nothing
constexpr double kEnough = 3e-3;        // of the volume
constexpr int kHalvings = 11, kMostMeshes = 4;

Status check_matter(const MatterParticles& particles, const ParticleFieldOptions& options) {
    const auto usage = [](std::string message) { return Error{ErrorCode::usage, std::move(message)}; };
    if (particles.volumes.size() != particles.positions.size())
        return usage("There is not one volume for each particle.");
    if (!(options.cell >= 0.2 && options.cell <= 4)) return usage("The surface's cell must be 0.2 to 4 spacings.");
    if (!options.shift.allFinite() || options.shift.cwiseAbs().maxCoeff() > 1)
        return usage("The grid's shift must be at most one cell.");
    if (!(std::isfinite(particles.spacing) && particles.spacing > 0))
        return usage("The particles' spacing must be above 0.");
    float farthest = 0;
    for (Index i = 0; i < particles.positions.size(); ++i) {
        const float volume = particles.volumes[i];
        if (!particles.positions[i].allFinite() || !std::isfinite(volume) || !(volume > 0))
            return usage("Particle " + std::to_string(i) + " has a position that is not finite or no volume.");
        farthest = std::max(farthest, particles.positions[i].cwiseAbs().maxCoeff());
    }
    // A float has 24 bits; a spacing wants the last seven of them.
    if (farthest > particles.spacing * float(1 << 17))
        return Error{ErrorCode::unsuitable, "The particles are so far from the origin that their coordinates hardly "
                                            "tell them apart; move them nearer."};
    return Success{};
}

struct NodeRange {
    GridNode low, high; ///< both included
};

/// Nodes that a kernel reaches.
NodeRange reached_nodes(const ParticleKernel& kernel, const BlockGrid& grid) {
    NodeRange range;
    for (int a = 0; a < 3; ++a) {
        const double centre = (double(kernel.centre[a]) - grid.shift()[a]) / grid.cell();
        const double reach = double(kernel.reach[a]) / grid.cell();
        range.low[std::size_t(a)] = std::int32_t(std::ceil(centre - reach));
        range.high[std::size_t(a)] = std::int32_t(std::floor(centre + reach));
    }
    return range;
}

template <class Visit>
void for_blocks(const NodeRange& range, int margin, const Visit& visit) {
    const auto low = [&](std::size_t a) { return (range.low[a] - margin) >> 3; };
    const auto high = [&](std::size_t a) { return (range.high[a] + margin) >> 3; };
    for (std::int32_t z = low(2); z <= high(2); ++z)
        for (std::int32_t y = low(1); y <= high(1); ++y)
            for (std::int32_t x = low(0); x <= high(0); ++x) visit(BlockGrid::key_of_block(x, y, z));
}

void add_kernel(const ParticleKernel& kernel, const BlockGrid& grid, const GridNode& corner, float* values) {
    NodeRange range = reached_nodes(kernel, grid);
    for (std::size_t a = 0; a < 3; ++a) {
        range.low[a] = std::max(range.low[a] - corner[a], 0);
        range.high[a] = std::min(range.high[a] - corner[a], BlockGrid::kSide - 1);
    }
    const Vec3f from = (grid.position(corner) - kernel.centre.cast<double>()).cast<float>();
    const float cell = float(grid.cell());
    const auto& g = kernel.shape;
    for (int z = range.low[2]; z <= range.high[2]; ++z)
        for (int y = range.low[1]; y <= range.high[1]; ++y) {
            const float dy = from[1] + float(y) * cell, dz = from[2] + float(z) * cell;
            const Vec3f across(g[1] * dy + g[2] * dz, g[3] * dy + g[4] * dz, g[4] * dy + g[5] * dz);
            float* row = values + 64 * z + 8 * y;
            for (int x = range.low[0]; x <= range.high[0]; ++x) {
                const float dx = from[0] + float(x) * cell;
                const float a = across[0] + g[0] * dx, b = across[1] + g[1] * dx, c = across[2] + g[2] * dx;
                const float left = std::max(1 - (a * a + b * b + c * c), 0.0f);
                row[x] += kernel.weight * left * left * left;
            }
        }
}

/// What the kernels add up to at every node, less the level of the surface.
Status add_kernels(const std::vector<ParticleKernel>& kernels, ParticleField& field, const RunContext& context) {
    const BlockGrid& grid = field.grid;
    std::vector<std::size_t> starts(grid.block_count() + 1, 0);
    const auto for_kernel_blocks = [&](const ParticleKernel& kernel, const auto& visit) {
        for_blocks(reached_nodes(kernel, grid), 0, [&](std::uint64_t key) { visit(grid.block(key)); });
    };
    for (const ParticleKernel& kernel : kernels) for_kernel_blocks(kernel, [&](Index b) { ++starts[b + 1]; });
    std::partial_sum(starts.begin(), starts.end(), starts.begin());
    std::vector<Index> of_block(starts.back());
    std::vector<std::size_t> next(starts.begin(), starts.end() - 1);
    for (Index k = 0; k < kernels.size(); ++k) for_kernel_blocks(kernels[k], [&](Index b) { of_block[next[b]++] = k; });
    field.values.assign(grid.slot_count(), ParticleField::kOutside);
    parallel_for(context, grid.block_count(), kBlockGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end && !context.is_cancelled(); ++b)
            for (std::size_t i = starts[b]; i < starts[b + 1]; ++i)
                add_kernel(kernels[of_block[i]], grid, grid.block_corner(Index(b)),
                           &field.values[b * BlockGrid::kNodes]);
    });
    if (context.is_cancelled()) return cancelled_error();
    return Success{};
}

/// A node that the moved surface may pass near to: with all nodes around it, and a gradient.
struct NodeNearSurface {
    Index slot;
    Vec3f inward; ///< unit
};

/// The gradient times the cell; zero where a node around is missing.
Vec3f gradient_at(const BlockGrid& grid, const std::vector<float>& values, Index slot) {
    Vec3f gradient;
    for (int a = 0; a < 3; ++a) {
        const Index below = grid.step(slot, a, -1), above = grid.step(slot, a, 1);
        if (below == kNoIndex || above == kNoIndex) return Vec3f::Zero();
        gradient[a] = 0.5f * (values[above] - values[below]);
    }
    return gradient;
}

std::vector<NodeNearSurface> nodes_near_surface(const ParticleField& field, const RunContext& context) {
    constexpr float kDeep = 0.9f; // above the level: no surface comes so far
    std::vector<std::vector<NodeNearSurface>> of_block(field.grid.block_count());
    parallel_for(context, of_block.size(), kBlockGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t slot = begin * BlockGrid::kNodes; slot < end * BlockGrid::kNodes; ++slot) {
            if (field.values[slot] > kDeep) continue;
            const Vec3f gradient = gradient_at(field.grid, field.values, Index(slot));
            const float length = gradient.norm();
            if (length > 1e-4f) of_block[slot / BlockGrid::kNodes].push_back({Index(slot), gradient / length});
        }
    });
    std::vector<NodeNearSurface> nodes;
    for (const auto& part : of_block) nodes.insert(nodes.end(), part.begin(), part.end());
    return nodes;
}

/// The field with its surface `offset` further out.
std::vector<float> moved_field(const ParticleField& field, std::span<const NodeNearSurface> nodes, double offset,
                               const RunContext& context) {
    std::vector<float> moved = field.values;
    parallel_for(context, nodes.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3d at = field.grid.position(field.grid.node(nodes[i].slot));
            moved[nodes[i].slot] = interpolate(field.grid, field.values, ParticleField::kOutside,
                                               at + offset * nodes[i].inward.cast<double>());
        }
    });
    return moved;
}

/// Inside the surface: a node's cube is cut by a plane at the distance that value and gradient say. m^3.
double enclosed_volume(const BlockGrid& grid, const std::vector<float>& values, const RunContext& context) {
    std::vector<double> of_block(grid.block_count(), 0);
    parallel_for(context, of_block.size(), kBlockGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t slot = begin * BlockGrid::kNodes; slot < end * BlockGrid::kNodes; ++slot) {
            const float value = values[slot];
            if (value == ParticleField::kOutside) continue;
            // Along the plane's normal a cube is as wide as the gradient's sum of components, over its length.
            const float width = gradient_at(grid, values, Index(slot)).cwiseAbs().sum();
            of_block[slot / BlockGrid::kNodes] +=
                width > 0 ? std::clamp(0.5f + value / width, 0.0f, 1.0f) : float(value > 0);
        }
    });
    return std::accumulate(of_block.begin(), of_block.end(), 0.0) * math::pow(grid.cell(), 3);
}

/// Of a closed mesh of triangles.
double mesh_volume(const Mesh& mesh) {
    if (mesh.positions.empty()) return 0;
    const Vec3f from = mesh.positions.front();
    double sum = 0;
    for (std::size_t c = 0; c < mesh.corners.size(); c += 3) {
        const auto at = [&](std::size_t k) { return (mesh.positions[mesh.corners[c + k]] - from).eval(); };
        sum += double(at(0).dot(at(1).cross(at(2))));
    }
    return sum / 6;
}

/// The offset at which enclosed_volume says `volume`, by bisection, as that grows with the offset.
double offset_for(const ParticleField& field, std::span<const NodeNearSurface> nodes, double volume, double spacing,
                  const RunContext& context) {
    double low = -kFarthestOffset * spacing, high = -low;
    for (int i = 0; i < kHalvings && !context.is_cancelled(); ++i) {
        const double middle = 0.5 * (low + high);
        const double there = enclosed_volume(field.grid, moved_field(field, nodes, middle, context), context);
        (there < volume ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

/// Moves the surface until its mesh encloses field.volume. Cutting cubes is quick and a few hundredths off, by much
/// the same part for all offsets; so meshes say by how much.
Status keep_volume(ParticleField& field, double spacing, const RunContext& context) {
    const std::vector<NodeNearSurface> nodes = nodes_near_surface(field, context);
    ParticleField moved = field;
    double wanted = field.volume;
    for (int i = 0; i < kMostMeshes; ++i) {
        moved.offset = offset_for(field, nodes, wanted, spacing, context);
        moved.values = moved_field(field, nodes, moved.offset, context);
        const Result<Mesh> mesh = make_field_surface(moved, context);
        if (!mesh) return mesh.error();
        const double volume = mesh_volume(*mesh);
        if (volume <= 0 || std::abs(volume - field.volume) < kEnough * field.volume) break;
        wanted *= std::clamp(field.volume / volume, 0.5, 2.0);
    }
    field = std::move(moved);
    return Success{};
}

} // namespace

Vec3f ParticleField::normal(const Vec3f& at) const {
    constexpr float kFlat = 0.02f; // change over a cell
    const Vec3f gradient = smooth_gradient(grid, values, kOutside, at.cast<double>());
    const float length = gradient.norm();
    return length * float(grid.cell()) > kFlat ? Vec3f(-gradient / length) : Vec3f::Zero();
}

Result<ParticleField> make_particle_field(const MatterParticles& particles, const ParticleFieldOptions& options,
                                          const RunContext& context) {
    if (const Status checked = check_matter(particles, options); !checked) return checked.error();
    ParticleField field;
    if (particles.positions.empty()) return field;
    const Result<std::vector<ParticleKernel>> kernels = make_particle_kernels(particles, context);
    if (!kernels) return kernels.error();
    const double cell = options.cell * double(particles.spacing);
    const BlockGrid empty(cell, options.shift * cell, {});
    // The surface moves outward, and nodes' gradients look one node further.
    const int margin = int(std::ceil(kFarthestOffset / options.cell)) + 2;
    std::vector<std::uint64_t> keys;
    for (const ParticleKernel& kernel : *kernels)
        for_blocks(reached_nodes(kernel, empty), margin, [&](std::uint64_t key) {
            if (keys.empty() || keys.back() != key) keys.push_back(key);
        });
    field.grid = BlockGrid(cell, options.shift * cell, std::move(keys));
    for (const float volume : particles.volumes) field.volume += double(volume);
    if (const Status added = add_kernels(*kernels, field, context); !added) return added.error();
    if (const Status kept = keep_volume(field, double(particles.spacing), context); !kept) return kept.error();
    return field;
}

} // namespace filigree
