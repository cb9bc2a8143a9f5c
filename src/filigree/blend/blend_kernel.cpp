// The runtime's inner loops (runtime/rt_kernel.h) on all threads.
#include "filigree/blend/blend_kernel.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <cassert>

namespace filigree::blend_kernel {

namespace {

flg_records view_of(const Records& records) {
    flg_records view{};
    view.runs = records.runs.data();
    view.cells = records.cells.empty() ? nullptr : records.cells.front().data();
    view.u = records.u.data();
    view.v = records.v.data();
    for (int k = 0; k < 3; ++k) {
        view.q[k] = records.q[k].data();
        view.normal[k] = records.normal[k].data();
    }
    return view;
}

/// Room for the points of a block, which stay in the second-level cache.
float* scratch_of_this_thread() {
    thread_local std::vector<float> scratch(FLG_SCRATCH_FLOATS);
    return scratch.data();
}

} // namespace

float normal_scale(std::span<const VertexTransform> transforms) {
    return flg_normal_scale(transforms.data(), transforms.size());
}

std::span<const int> lane_counts() {
    static const std::vector<int> counts = [] {
        std::vector<int> there;
        for (const std::uint32_t lanes : {1u, 4u, 8u, 16u})
            if (flg_kernel_of(lanes)) there.push_back(int(lanes));
        return there;
    }();
    return counts;
}

void restore(const Records& records, std::span<const VertexTransform> transforms, const Output& output,
             const RunContext& context) {
    static const int lanes = flg_kernel_of(0)->lanes;
    restore(records, transforms, output, lanes, context);
}

void restore(const Records& records, std::span<const VertexTransform> transforms, const Output& output, int lanes,
             const RunContext& context) {
    const flg_kernel* kernel = flg_kernel_of(std::uint32_t(lanes));
    assert(kernel);
    const flg_records view = view_of(records);
    const flg_scales scales{output.scale, output.normal_scale};
    float* const positions = output.positions ? output.positions->data() : nullptr;
    float* const normals = output.normals ? output.normals->data() : nullptr;
    // Stores go past the caches when the output would not stay in them anyway.
    constexpr std::size_t kCacheBytes = std::size_t{16} << 20;
    const bool in_blocks = output.in_order && !records.block_runs.empty();
    const bool streaming = (in_blocks || !output.in_order) && records.count * sizeof(Vec3f) > kCacheBytes;
    if (in_blocks) {
        parallel_for(context, records.block_runs.size() - 1, 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t block = begin; block < end; ++block) {
                const std::size_t first = block * kBlock, count = std::min<std::size_t>(kBlock, records.count - first);
                const auto slots = [&](float* points) { return flg_slots{points ? points + 3 * first : nullptr, 3}; };
                flg_restore_block(kernel, &view, transforms.data(), scales, records.block_runs[block],
                                  records.block_runs[block + 1], records.from.data() + first, count, slots(positions),
                                  slots(normals), streaming, scratch_of_this_thread());
            }
            if (streaming) flg_end_streaming(); // on the thread that stored
        });
        return;
    }
    // Pieces of whole runs: found by bisection, so that they depend on the records alone. Past the caches, long bursts
    // of stores are faster than short ones.
    const std::size_t piece = streaming ? kBlock : std::size_t{1} << 13;
    const auto run_at = [&](std::size_t record) {
        return static_cast<std::size_t>(
            std::lower_bound(records.runs.begin(), records.runs.end(), record,
                             [](const Run& run, std::size_t wanted) { return run.first < wanted; }) -
            records.runs.begin());
    };
    parallel_for(context, records.count, piece, [&](std::size_t begin, std::size_t end) {
        flg_restore_scattered(kernel, &view, transforms.data(), scales, run_at(begin), run_at(end),
                              output.in_order ? records.slot.data() : nullptr, positions, normals, streaming,
                              scratch_of_this_thread());
        if (streaming) flg_end_streaming(); // on the thread that stored
    });
}

} // namespace filigree::blend_kernel
