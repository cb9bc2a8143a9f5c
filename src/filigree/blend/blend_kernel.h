// The inner loops of the blend code, on all threads. They are the runtime's: runtime/rt_kernel.h.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include "runtime/rt_kernel.h"

namespace filigree::blend_kernel {

/// What a driver vertex gives to every vertex it carries: t, the columns of A, and half its rest position.
using VertexTransform = flg_transform;

/// Records of one cell, end to end.
using Run = flg_run;

/// Arrays are padded so that 16 values can be read from any record; `runs` have at most kMaxRun records each.
inline constexpr Index kMaxRun = FLG_MAX_RUN;
inline constexpr std::size_t kPadding = FLG_PADDING;
/// Slots that are restored at a time when order is asked for: their points stay in the second-level cache.
inline constexpr Index kBlock = FLG_BLOCK;

/// Everything about the records that does not change from pose to pose.
struct Records {
    std::vector<Run> runs;
    std::vector<Triangle> cells;  ///< of driver vertices
    std::vector<float> u, v;      ///< weights of the cell's second and third corner
    std::vector<float> q[3];      ///< p - m / 2
    std::vector<float> normal[3]; ///< empty or unit rest normals
    std::vector<Index> slot;      ///< where record r goes when order is asked for
    /// Where the mesh's order allows it, records come block by block of kBlock slots, and in a block by cell. Else
    /// none.
    std::vector<Index> block_runs;   ///< the first run of each block, and the end
    std::vector<std::uint16_t> from; ///< of each slot: which record of its block goes there

    std::size_t count = 0;
};

/// Where results go. Null pointers: not wanted. in_order: record r is written to slot[r], else to r.
struct Output {
    Vec3f* positions = nullptr;
    Vec3f* normals = nullptr;
    bool in_order = false;
    float scale = 1; ///< multiplies positions; a power of two
    /// Multiplies normals before they get length one; a power of two. For gradients about 1 none is needed; see
    /// normal_scale.
    float normal_scale = 1;
};

/// What keeps normals within float's range: 1 unless the largest entry of all gradients is far from 1.
float normal_scale(std::span<const VertexTransform> transforms);

/// p' = sum b t + (sum b A) q for every record, and n' = unit(cofactor(sum b A) n). Same bytes for any thread count and
/// any processor. Cost: bounded by memory.
void restore(const Records& records, std::span<const VertexTransform> transforms, const Output& output,
             const RunContext& context);

/// Vertices at a time that this processor has an implementation for, ascending; restore takes the last.
std::span<const int> lane_counts();
/// restore by one of them, so that tests can hold them against each other.
void restore(const Records& records, std::span<const VertexTransform> transforms, const Output& output, int lanes,
             const RunContext& context);

} // namespace filigree::blend_kernel
