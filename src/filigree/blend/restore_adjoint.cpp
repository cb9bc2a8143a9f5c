#include "filigree/blend/restore_adjoint.h"

#include "filigree/core/lanes.h"
#include "filigree/core/lists.h"
#include "filigree/core/parallel_for.h"
#include "filigree/restore.h"

#include <algorithm>
#include <array>

namespace filigree {

namespace {

constexpr std::size_t kAdjointGrain = 16; // cells
constexpr int kSide = 16;                 // sums side by side, whatever the registers hold: the same bytes everywhere
using Sixteen = Lanes<kSide>::Float;

/// What is summed over a cell: b_k v (1, q^T), corner k by corner, then v's coordinate, then 1 and q's coordinates.
struct CellSum {
    std::array<float, 36> at;
    float of(std::size_t corner, std::size_t coordinate, std::size_t term) const {
        return at[12 * corner + 4 * coordinate + term];
    }
};

/// The vertices of cells, in an order of their own. Numbers of a cell begin at a multiple of sixteen, and zeros follow
/// those of its vertices.
struct AdjointRecords {
    std::vector<std::size_t> starts = {0}; ///< of each cell, and the end
    std::vector<Index> counts;             ///< of each cell's vertices
    std::vector<Index> slots;              ///< of each vertex in the level
    std::vector<float> u, v, x, y, z;      ///< (x, y, z) = p - o - (m - o) / 2, o the cell's first corner
    std::size_t longest = 0;               ///< numbers of a cell
};

/// Halves are added, again and again: the same order for every width of registers.
FILIGREE_INLINE float sum_of(Sixteen lanes) {
    const Lanes<8>::Float eight = __builtin_shufflevector(lanes, lanes, 0, 1, 2, 3, 4, 5, 6, 7) +
                                  __builtin_shufflevector(lanes, lanes, 8, 9, 10, 11, 12, 13, 14, 15);
    const Lanes<4>::Float four =
        __builtin_shufflevector(eight, eight, 0, 1, 2, 3) + __builtin_shufflevector(eight, eight, 4, 5, 6, 7);
    return (four[0] + four[2]) + (four[1] + four[3]);
}

/// gathered: room for three times the numbers of the longest cell.
FILIGREE_INLINE void sum_cell(const AdjointRecords& records, std::size_t cell, const Vec3f* vertices, float* gathered,
                              CellSum& sum) {
    using L = Lanes<kSide>;
    const std::size_t begin = records.starts[cell], padded = records.starts[cell + 1] - begin;
    const Index* const slots = records.slots.data() + begin;
    const std::size_t count = records.counts[cell];
    // All first: loads of sixteen do not wait for stores of one then.
    float* const values[3] = {gathered, gathered + padded, gathered + 2 * padded};
    constexpr std::size_t kAhead = 2 * kSide; // within the padding of slots
    for (std::size_t k = 0; k < count; ++k) {
        __builtin_prefetch(vertices + slots[k + kAhead]);
        const Vec3f& vertex = vertices[slots[k]];
        for (int axis = 0; axis < 3; ++axis) values[axis][k] = vertex[axis];
    }
    for (std::size_t k = count; k < padded; ++k)
        for (int axis = 0; axis < 3; ++axis) values[axis][k] = 0;
    // A pass an axis: twelve sums stay in registers, where 36 would not.
    for (std::size_t axis = 0; axis < 3; ++axis) {
        Sixteen sums[12] = {};
        for (std::size_t r = 0; r < padded; r += kSide) {
            const Sixteen value = L::load(values[axis] + r);
            const Sixteen u = L::load(records.u.data() + begin + r), v = L::load(records.v.data() + begin + r);
            const Sixteen b[3] = {((1.0f - u) - v) * value, u * value, v * value};
            const Sixteen x = L::load(records.x.data() + begin + r), y = L::load(records.y.data() + begin + r),
                          z = L::load(records.z.data() + begin + r);
            for (int corner = 0; corner < 3; ++corner) {
                sums[4 * corner] = sums[4 * corner] + b[corner];
                sums[4 * corner + 1] = sums[4 * corner + 1] + b[corner] * x;
                sums[4 * corner + 2] = sums[4 * corner + 2] + b[corner] * y;
                sums[4 * corner + 3] = sums[4 * corner + 3] + b[corner] * z;
            }
        }
        for (std::size_t corner = 0; corner < 3; ++corner)
            for (std::size_t term = 0; term < 4; ++term)
                sum.at[12 * corner + 4 * axis + term] = sum_of(sums[4 * corner + term]);
    }
}

struct AdjointJob {
    const AdjointRecords& records;
    const Vec3f* vertices;
    float* gathered; ///< of a thread
    std::vector<CellSum>& sums;
};

FILIGREE_INLINE void sum_cells_of(const AdjointJob& job, std::size_t begin, std::size_t end) {
    for (std::size_t cell = begin; cell < end; ++cell)
        sum_cell(job.records, cell, job.vertices, job.gathered, job.sums[cell]);
}
#if defined(FILIGREE_HAS_WIDTHS)
FILIGREE_AVX512 void sum_cells_avx512(const AdjointJob& job, std::size_t begin, std::size_t end) {
    sum_cells_of(job, begin, end);
}
FILIGREE_AVX2 void sum_cells_avx2(const AdjointJob& job, std::size_t begin, std::size_t end) {
    sum_cells_of(job, begin, end);
}
#endif
void sum_cells_plain(const AdjointJob& job, std::size_t begin, std::size_t end) { sum_cells_of(job, begin, end); }

void sum_cells(const AdjointJob& job, std::size_t begin, std::size_t end) {
#if defined(FILIGREE_HAS_WIDTHS)
    if (widest_vectors() == VectorWidth::bytes64) return sum_cells_avx512(job, begin, end);
    if (widest_vectors() == VectorWidth::bytes32) return sum_cells_avx2(job, begin, end);
#endif
    sum_cells_plain(job, begin, end);
}

struct CellCornerOfDriver {
    Index cell, corner;
};

} // namespace

VertexBonds vertex_bonds(const Model& model) {
    const BlendDetail& detail = model.detail;
    const std::size_t count = model.mesh.vertex_count();
    std::vector<Vec3d> driver;
    for (const Vec3f& c : driver_positions(model)) driver.push_back(c.cast<double>());
    VertexBonds bonds{std::vector<Triangle>(count), std::vector<std::array<double, 3>>(count),
                      std::vector<std::array<Vec3d, 3>>(count)};
    for (std::size_t c = 0; c < detail.cells.size(); ++c)
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
            const Index vertex = detail.order[r];
            const double u = detail.u[r], v = detail.v[r];
            const std::array<double, 3> b = {1 - u - v, u, v};
            Vec3d m = Vec3d::Zero();
            for (std::size_t k = 0; k < 3; ++k) m += b[k] * driver[detail.cells[c][k]];
            bonds.cells[vertex] = detail.cells[c];
            bonds.weights[vertex] = b;
            for (std::size_t k = 0; k < 3; ++k)
                bonds.offsets[vertex][k] =
                    model.mesh.positions[vertex].cast<double>() - 0.5 * (m + driver[detail.cells[c][k]]);
        }
    bonds.cells.resize(model.vertex_count());
    bonds.weights.resize(model.vertex_count());
    bonds.offsets.resize(model.vertex_count());
    return bonds;
}

struct RestoreAdjoint::Content {
    std::size_t vertices = 0;
    std::vector<Triangle> cells;
    std::vector<std::array<Vec3d, 3>> corners; ///< of each cell at rest, from its first corner on
    AdjointRecords records;
    Lists<CellCornerOfDriver> cells_of; ///< of each driver vertex
    std::size_t driver_vertices = 0;
};

RestoreAdjoint::RestoreAdjoint(std::unique_ptr<Content> content) : content_(std::move(content)) {}
RestoreAdjoint::RestoreAdjoint(RestoreAdjoint&&) noexcept = default;
RestoreAdjoint& RestoreAdjoint::operator=(RestoreAdjoint&&) noexcept = default;
RestoreAdjoint::~RestoreAdjoint() = default;

std::size_t RestoreAdjoint::vertex_count() const { return content_->vertices; }

Result<RestoreAdjoint> RestoreAdjoint::create(const Model& model, std::optional<unsigned> level,
                                              const RunContext& context) {
    const Result<unsigned> chosen = restored_level(model, {.level = level});
    if (!chosen) return chosen.error();
    auto content = std::make_unique<Content>();
    const BlendDetail& detail = model.detail;
    const bool is_finest = chosen.value() == model.finest_level();
    content->vertices = is_finest ? model.vertex_count() : model.levels[chosen.value()].vertices.size();
    std::vector<Index> slot_of(model.mesh.vertex_count(), kNoIndex); // of each vertex of the mesh in the level
    for (Index k = 0; k < content->vertices; ++k) slot_of[is_finest ? k : model.levels[chosen.value()].vertices[k]] = k;

    std::vector<Vec3d> driver;
    for (const Vec3f& c : driver_positions(model)) driver.push_back(c.cast<double>());
    content->driver_vertices = driver.size();
    content->cells = detail.cells;
    AdjointRecords& records = content->records;
    for (std::size_t c = 0; c < detail.cells.size(); ++c) {
        const Triangle& cell = detail.cells[c];
        const Vec3d origin = driver[cell[0]];
        content->corners.push_back({Vec3d::Zero(), Vec3d(driver[cell[1]] - origin), Vec3d(driver[cell[2]] - origin)});
        const std::array<Vec3d, 3>& corners = content->corners.back();
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
            const Index slot = slot_of[detail.order[r]];
            if (slot == kNoIndex) continue;
            const double u = detail.u[r], v = detail.v[r];
            const Vec3d p = model.mesh.positions[detail.order[r]].cast<double>() - origin;
            const Vec3f q = (p - 0.5 * (u * corners[1] + v * corners[2])).cast<float>();
            records.slots.push_back(slot);
            records.u.push_back(detail.u[r]);
            records.v.push_back(detail.v[r]);
            records.x.push_back(q.x());
            records.y.push_back(q.y());
            records.z.push_back(q.z());
        }
        records.counts.push_back(static_cast<Index>(records.slots.size() - records.starts.back()));
        const std::size_t padded = (records.slots.size() + kSide - 1) / kSide * kSide;
        records.slots.resize(padded, 0);
        for (std::vector<float>* numbers : {&records.u, &records.v, &records.x, &records.y, &records.z})
            numbers->resize(padded, 0);
        records.longest = std::max(records.longest, padded - records.starts.back());
        records.starts.push_back(padded);
    }
    records.slots.resize(records.slots.size() + 2 * kSide, 0); // what is asked for ahead
    content->cells_of = make_lists<CellCornerOfDriver>(driver.size(), [&](const auto& add) {
        for (Index c = 0; c < detail.cells.size(); ++c)
            for (Index k = 0; k < 3; ++k) add(detail.cells[c][k], CellCornerOfDriver{c, k});
    });
    if (context.is_cancelled()) return cancelled_error();
    return RestoreAdjoint(std::move(content));
}

Result<PoseDerivative> RestoreAdjoint::apply(std::span<const Vec3f> vertices, const RunContext& context) const {
    const Content& content = *content_;
    if (vertices.size() != content.vertices)
        return Error{ErrorCode::mismatch, "The derivative is of " + std::to_string(vertices.size()) +
                                              " vertices, and the restored level has " +
                                              std::to_string(content.vertices) + "."};
    std::vector<CellSum> sums(content.cells.size());
    parallel_for(context, content.cells.size(), kAdjointGrain, [&](std::size_t begin, std::size_t end) {
        thread_local std::vector<float> gathered;
        gathered.resize(std::max(gathered.size(), 3 * content.records.longest));
        sum_cells({content.records, vertices.data(), gathered.data(), sums}, begin, end);
    });
    if (context.is_cancelled()) return cancelled_error();

    PoseDerivative derivative{std::vector<Vec3f>(content.driver_vertices), std::vector<Mat3f>(content.driver_vertices)};
    parallel_for(context, content.driver_vertices, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Vec3d position = Vec3d::Zero();
            Mat3d gradient = Mat3d::Zero();
            for (const CellCornerOfDriver& at : content.cells_of[i]) {
                const Vec3d& corner = content.corners[at.cell][at.corner];
                for (std::size_t row = 0; row < 3; ++row) {
                    const double of_position = double(sums[at.cell].of(at.corner, row, 0));
                    position[Eigen::Index(row)] += of_position;
                    for (std::size_t column = 0; column < 3; ++column) // d = q - c / 2
                        gradient(Eigen::Index(row), Eigen::Index(column)) +=
                            double(sums[at.cell].of(at.corner, row, column + 1)) -
                            0.5 * corner[Eigen::Index(column)] * of_position;
                }
            }
            derivative.positions[i] = position.cast<float>();
            derivative.gradients[i] = gradient.cast<float>();
        }
    });
    return derivative;
}

} // namespace filigree
