#include "filigree/blend/blend_code.h"

#include "filigree/blend/blend_kernel.h"
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree {

namespace {

/// m: the point of the cell that a record hangs on.
Vec3d anchor(const Triangle& cell, double u, double v, std::span<const Vec3f> positions,
             std::span<const Index> driver) {
    Vec3d m;
    flg_anchor(positions[driver[cell[0]]].data(), positions[driver[cell[1]]].data(), positions[driver[cell[2]]].data(),
               u, v, m.data());
    return m;
}

} // namespace

BlendDetail encode_blend(std::vector<Triangle> cells, const Binding& binding) {
    BlendDetail detail;
    detail.cells = std::move(cells);
    detail.across_gap = binding.across_gap;
    detail.facing_away = binding.facing_away;

    detail.cell_offsets.assign(detail.cells.size() + 1, 0);
    const std::size_t count = binding.bonds.size();
    for (const Bond& bond : binding.bonds) ++detail.cell_offsets[bond.cell + 1];
    for (std::size_t c = 0; c < detail.cells.size(); ++c) detail.cell_offsets[c + 1] += detail.cell_offsets[c];
    std::vector<Index> next(detail.cell_offsets.begin(), detail.cell_offsets.end() - 1);
    detail.order.resize(count);
    detail.u.resize(count);
    detail.v.resize(count);
    for (Index vertex = 0; vertex < count; ++vertex) {
        const Bond& bond = binding.bonds[vertex];
        const Index r = next[bond.cell]++;
        detail.order[r] = vertex;
        detail.u[r] = bond.u;
        detail.v[r] = bond.v;
    }
    return detail;
}

std::vector<Mat3f> vertex_gradients(const BlendDetail& detail, std::span<const Mat3f> driver_gradients) {
    std::vector<Mat3f> gradients(detail.order.size());
    for (std::size_t c = 0; c < detail.cells.size(); ++c) {
        const Triangle& cell = detail.cells[c];
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
            const float u = detail.u[r], v = detail.v[r];
            gradients[detail.order[r]] =
                (1 - u - v) * driver_gradients[cell[0]] + u * driver_gradients[cell[1]] + v * driver_gradients[cell[2]];
        }
    }
    return gradients;
}

struct BlendRestorer::Content {
    blend_kernel::Records records;
    std::vector<Vec3d> rest; ///< of the driver's vertices, relative to the centre and scaled
    double scale = 1;        ///< of everything inside; a power of two, other than 1 only for extreme sizes
};

namespace {

constexpr std::size_t kRestorerGrain = 16384;

struct WantedRecord {
    Index cell, record, item;
};

/// Sorts records by block of slots, then as they were, where every slot is there once and that leaves runs long enough.
/// Cost O(items).
bool sort_into_blocks(std::span<const BlendRestorer::Item> items, std::vector<WantedRecord>& wanted) {
    // A run costs a cell's transform: with fewer records than these each, scattered writes are as fast.
    constexpr std::size_t kShortMeanRun = 16;
    if (items.empty() || wanted.size() != items.size()) return false;
    const std::size_t blocks = (items.size() + blend_kernel::kBlock - 1) / blend_kernel::kBlock;
    std::vector<bool> is_there(items.size(), false);
    std::vector<std::size_t> starts(blocks + 1, 0);
    std::vector<Index> last_cell(blocks, kNoIndex);
    std::size_t runs = 0, runs_in_blocks = 0;
    for (std::size_t k = 0; k < wanted.size(); ++k) {
        const Index cell = wanted[k].cell, slot = items[wanted[k].item].slot;
        if (slot >= items.size() || is_there[slot]) return false;
        is_there[slot] = true;
        const std::size_t block = slot / blend_kernel::kBlock;
        ++starts[block + 1];
        runs += k == 0 || wanted[k - 1].cell != cell;
        runs_in_blocks += std::exchange(last_cell[block], cell) != cell;
    }
    if (runs_in_blocks * kShortMeanRun > items.size() && 2 * runs_in_blocks > 3 * runs) return false;
    for (std::size_t b = 0; b < blocks; ++b) starts[b + 1] += starts[b];
    std::vector<WantedRecord> sorted(wanted.size());
    for (const WantedRecord& record : wanted) sorted[starts[items[record.item].slot / blend_kernel::kBlock]++] = record;
    wanted = std::move(sorted);
    return true;
}

/// Which records are wanted, in record order, and by which items (a vertex may have several).
std::vector<WantedRecord> wanted_records(const BlendDetail& detail, std::size_t vertices,
                                         std::span<const BlendRestorer::Item> items) {
    std::vector<Index> first_item(vertices, kNoIndex), next_item(items.size(), kNoIndex);
    for (Index i = static_cast<Index>(items.size()); i-- > 0;) {
        next_item[i] = first_item[items[i].vertex];
        first_item[items[i].vertex] = i;
    }
    std::vector<WantedRecord> wanted;
    wanted.reserve(items.size());
    for (Index c = 0; c < detail.cells.size(); ++c)
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r)
            for (Index i = first_item[detail.order[r]]; i != kNoIndex; i = next_item[i]) wanted.push_back({c, r, i});
    return wanted;
}

void make_room(const BlendDetail& detail, std::size_t items, bool has_normals, blend_kernel::Records& records) {
    records.count = items;
    records.cells = detail.cells;
    const std::size_t padded = items + blend_kernel::kPadding;
    records.u.assign(padded, 0);
    records.v.assign(padded, 0);
    for (auto& q : records.q) q.assign(padded, 0);
    if (has_normals)
        for (auto& n : records.normal) n.assign(padded, 0);
}

/// Slots, and runs of records with one cell.
void add_runs(std::span<const BlendRestorer::Item> items, std::span<const WantedRecord> wanted, bool in_blocks,
              blend_kernel::Records& records) {
    records.slot.reserve(items.size());
    for (const auto& [c, r, i] : wanted) {
        const Index at = static_cast<Index>(records.slot.size());
        const bool begins_block = in_blocks && at % blend_kernel::kBlock == 0;
        if (begins_block) records.block_runs.push_back(static_cast<Index>(records.runs.size()));
        if (records.runs.empty() || begins_block || records.runs.back().cell != c ||
            records.runs.back().count == blend_kernel::kMaxRun)
            records.runs.push_back({c, at, 0});
        ++records.runs.back().count;
        records.slot.push_back(items[i].slot);
    }
    if (!in_blocks) return;
    records.block_runs.push_back(static_cast<Index>(records.runs.size()));
    records.from.resize(items.size());
    for (std::size_t at = 0; at < records.slot.size(); ++at)
        records.from[records.slot[at]] = static_cast<std::uint16_t>(at % blend_kernel::kBlock);
}

} // namespace

BlendRestorer::BlendRestorer(BlendRestorer&&) noexcept = default;
BlendRestorer& BlendRestorer::operator=(BlendRestorer&&) noexcept = default;
BlendRestorer::~BlendRestorer() = default;

BlendRestorer::BlendRestorer(const BlendDetail& detail, std::span<const Vec3f> positions, std::span<const Index> driver,
                             std::span<const Item> items, std::span<const Vec3f> normals, const RunContext& context)
    : content_(std::make_unique<Content>()) {
    Box box; // the driver's
    for (Index v : driver) box.extend(positions[v].cast<double>());
    const Vec3d centre = box.centre();
    content_->scale = flg_inner_scale(box.diagonal(), bounds(positions).diagonal());
    const double scale = content_->scale;
    for (Index v : driver) content_->rest.push_back(scale * (positions[v].cast<double>() - centre));

    std::vector<WantedRecord> wanted = wanted_records(detail, positions.size(), items);
    const bool in_blocks = sort_into_blocks(items, wanted);
    blend_kernel::Records& records = content_->records;
    make_room(detail, items.size(), !normals.empty(), records);
    add_runs(items, wanted, in_blocks, records);
    // Every record has a place of its own by now.
    parallel_for(context, wanted.size(), kRestorerGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t at = begin; at < end; ++at) {
            const auto& [c, r, i] = wanted[at];
            if (!normals.empty())
                for (int k = 0; k < 3; ++k) records.normal[k][at] = normals[i][k];
            records.u[at] = detail.u[r];
            records.v[at] = detail.v[r];
            const Vec3d m = anchor(detail.cells[c], detail.u[r], detail.v[r], positions, driver);
            Vec3f q;
            flg_rest_offset(positions[detail.order[r]].data(), m.data(), centre.data(), scale, q.data());
            for (int k = 0; k < 3; ++k) records.q[k][at] = q[k];
        }
    });
}

std::span<const Index> BlendRestorer::slots() const { return content_->records.slot; }

const blend_kernel::Records& BlendRestorer::records() const { return content_->records; }

float BlendRestorer::output_scale() const { return static_cast<float>(1 / content_->scale); }

std::vector<blend_kernel::VertexTransform> BlendRestorer::transforms(std::span<const Vec3f> driver_positions,
                                                                     std::span<const Mat3f> gradients,
                                                                     const RunContext& context) const {
    const std::vector<Vec3d>& rest = content_->rest;
    std::vector<blend_kernel::VertexTransform> transforms(rest.size());
    parallel_for(context, rest.size(), 4096, [&](std::size_t begin, std::size_t end) {
        flg_make_transforms(rest.front().data(), content_->scale, driver_positions.front().data(),
                            gradients.front().data(), begin, end, transforms.data());
    });
    return transforms;
}

void BlendRestorer::restore(std::span<const Vec3f> driver_positions, std::span<const Mat3f> gradients,
                            std::span<Vec3f> out_positions, std::span<Vec3f> out_normals, bool in_order,
                            const RunContext& context) const {
    blend_kernel::Output output;
    if (!out_positions.empty()) output.positions = out_positions.data();
    if (!out_normals.empty()) output.normals = out_normals.data();
    output.in_order = in_order;
    output.scale = output_scale();
    if (!output.positions && !output.normals) return;
    const std::vector<blend_kernel::VertexTransform> moved = transforms(driver_positions, gradients, context);
    if (output.normals) output.normal_scale = blend_kernel::normal_scale(moved);
    blend_kernel::restore(content_->records, moved, output, context);
}

} // namespace filigree
