// Based on: the report, 2.4 and 2.5.
#include "filigree/reference/reference_code.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/reference/reference_plan.h"

#include <cassert>
#include <cmath>

namespace filigree {
namespace {

using namespace reference;

// Points with larger coordinates in their basis are kept as loose points: the basis is a sliver, and when it opens it
// would throw them far off.
constexpr double kMaxCoordinate = 4;
// So are points that decode worse than this, as a fraction of the power of two above the extent.
constexpr float kMaxRoundTripError = 2.5e-7f;
constexpr std::size_t kRecordsPerTask = 16384;

Vec3d to_vector(const Point<float>& p) { return {p.x, p.y, p.z}; }

/// (v, w, h) of a point: the report's signed areas, eq. 2.10 to 2.13. They need no projection, since its height over
/// the plane drops out of the products with r. Not finite where the basis spans no plane.
Vec3d coordinates(const Basis<float>& basis, const Vec3d& point) {
    const Vec3d across = to_vector(basis.across), up = to_vector(basis.up), p = point - to_vector(basis.origin);
    const Vec3d r = across.cross(up);
    return {p.cross(up).dot(r) / r.squaredNorm(), across.cross(p).dot(r) / r.squaredNorm(), p.dot(r) / r.norm()};
}

/// Removes detail, one level after the other.
class Encoder {
public:
    Encoder(const Mesh& mesh, ReferenceDetail& detail, const RunContext& context)
        : mesh_(mesh), detail_(detail), context_(context), plan_(detail, HeightLaw::keep),
          exponent_(exponent_of(detail.extent)) {}

    Status encode() {
        for (const Index vertex : plan_.driver_vertices()) detail_.rest_driver.push_back(mesh_.positions[vertex]);
        const PlacedDriver placed = plan_.begin(detail_.rest_driver, true, work_.coarse);
        for (unsigned level = 0; level < detail_.patches.levels; ++level) {
            if (context_.is_cancelled()) return cancelled_error();
            context_.report("remove detail", static_cast<double>(level) / detail_.patches.levels);
            encode_level(placed.axes);
            if (level + 1 == detail_.patches.levels) break;
            plan_.fold_level(work_.coarse, context_);
            plan_.refine(level, placed, work_.coarse, work_.fine, work_.edges, context_);
            std::swap(work_.coarse, work_.fine);
        }
        return Success{};
    }

private:
    void encode_level(std::span<const Mat3f> axes) {
        const RegularPatches& patches = detail_.patches;
        const std::size_t m = work_.coarse.cells(), half_step = patches.side() / m / 2, first = detail_.records.size();
        detail_.records.resize(first + plan_.record_count(m));
        std::vector<std::uint8_t> loose(plan_.record_count(m), 0);
        const auto encode = [&](std::size_t number, Index vertex, const Basis<float>& basis, const Point<float>& from,
                                const Mat3f& base_axes) {
            loose[number] = !encode_point(basis, vertex, detail_.records[first + number]);
            if (loose[number]) encode_loose(from, base_axes, vertex, detail_.records[first + number]);
        };
        const BaseEdges& edges = plan_.edges();
        parallel_for(
            context_, edges.halves.size(), std::max<std::size_t>(1, kRecordsPerTask / m), [&](auto begin, auto end) {
                for (std::size_t edge = begin; edge < end; ++edge)
                    for (std::size_t k = 0; k < m; ++k) {
                        const References<float> r = side_references(work_.coarse, edges, edge, k);
                        const Index half = edges.halves[edge];
                        encode(plan_.edge_record(m, edge, k), side_vertex(patches, half, (2 * k + 1) * half_step),
                               edge_basis(references(), r, edges.twins[edge] != kNoIndex), r.ends[0], axes[half / 4]);
                    }
            });
        parallel_for(
            context_, patches.patch_count() * m, std::max<std::size_t>(1, kRecordsPerTask / m),
            [&](auto begin, auto end) {
                for (std::size_t row = begin; row < end; ++row)
                    for (std::size_t i = 0; i < m; ++i)
                        for (const CellPoint kind : {CellPoint::along, CellPoint::upwards, CellPoint::centre}) {
                            const std::size_t p = row / m, j = row % m;
                            if ((kind == CellPoint::along && j == 0) || (kind == CellPoint::upwards && i == 0))
                                continue;
                            const bool right = kind != CellPoint::upwards, up = kind != CellPoint::along;
                            encode(plan_.cell_record(m, p, i, j, kind),
                                   patches.at(p, (2 * i + right) * half_step, (2 * j + up) * half_step),
                                   cell_basis(references(), work_.coarse, kind, p, i, j),
                                   work_.coarse.at(p, i, j + !right), axes[p]);
                        }
            });
        for (std::size_t number = 0; number < loose.size(); ++number)
            if (loose[number]) detail_.loose.push_back(static_cast<Index>(first + number));
    }

    /// Whether the point decodes well from the record.
    bool encode_point(const Basis<float>& basis, Index vertex, Vec3f& record) const {
        const Vec3d target = scaled_position(vertex);
        const Vec3d c = coordinates(basis, target);
        if (!(std::abs(c.x()) <= kMaxCoordinate && std::abs(c.y()) <= kMaxCoordinate && c.allFinite())) return false;
        record = c.cast<float>();
        const Point<float> decoded = place(basis, {record.x(), record.y(), record.z()}, 0.0f, Scaling{});
        record.z() = std::ldexp(record.z(), exponent_);
        return (to_vector(decoded) - target).cwiseAbs().maxCoeff() <= kMaxRoundTripError;
    }

    void encode_loose(const Point<float>& from, const Mat3f& axes, Index vertex, Vec3f& record) const {
        const Vec3d offset = axes.cast<double>().transpose() * (scaled_position(vertex) - to_vector(from));
        for (Eigen::Index c = 0; c < 3; ++c) record[c] = std::ldexp(static_cast<float>(offset[c]), exponent_);
    }

    Vec3d scaled_position(Index vertex) const {
        return std::ldexp(1.0, -exponent_) * mesh_.positions[vertex].cast<double>();
    }
    int references() const { return static_cast<int>(detail_.references); }

    const Mesh& mesh_;
    ReferenceDetail& detail_;
    const RunContext& context_;
    Plan plan_;
    int exponent_;
    Work work_;
};

/// The number of levels whose driver comes closest to the vertices asked for.
unsigned levels_for(std::size_t vertices, std::size_t base) {
    const double levels = math::log2(double(std::max<std::size_t>(vertices, 1)) / double(base)) / 2;
    return static_cast<unsigned>(std::max(1L, std::lround(levels)));
}

} // namespace

Result<ReferenceDetail> encode_reference(const Mesh& mesh, const ReferenceOptions& options, const RunContext& context) {
    if (options.references != 3 && options.references != 4 && options.references != 6)
        return Error{ErrorCode::usage,
                     "The reference code takes 3, 4 or 6 references, not " + std::to_string(options.references) + "."};
    if (options.max_levels < 1 || options.max_levels > 16) return Error{ErrorCode::usage, "levels must be 1 to 16."};
    if (options.base && *options.base < 3) return Error{ErrorCode::usage, "base must be 3 or more vertices."};
    const unsigned most = options.base ? levels_for(mesh.vertex_count(), *options.base) : options.max_levels;
    auto patches = find_regular_patches(mesh, most, context);
    if (!patches) return patches.error();
    ReferenceDetail detail;
    detail.patches = std::move(*patches);
    detail.references = options.references;
    detail.extent = extent_of(mesh.positions);
    const Status status = Encoder(mesh, detail, context).encode();
    if (!status) return status.error();
    return detail;
}

/// The plan, and for each vertex its place in the finest grids.
struct ReferenceRestorer::State {
    State(const ReferenceDetail& detail, HeightLaw law) : plan(detail, law) {}

    Plan plan;
    std::vector<Index> places;
};

ReferenceRestorer::ReferenceRestorer(const ReferenceDetail& detail, HeightLaw law, const RunContext& context)
    : state_(std::make_unique<State>(detail, law)) {
    Plan& plan = state_->plan;
    Work work;
    const PlacedDriver rest = plan.begin(detail.rest_driver, !detail.loose.empty(), work.coarse);
    for (unsigned level = 0; level < detail.patches.levels; ++level) {
        plan.fold_level(work.coarse, context);
        // Without a law nobody asks what sizes were at rest.
        if (law == HeightLaw::keep || level + 1 == detail.patches.levels) continue;
        plan.refine(level, rest, work.coarse, work.fine, work.edges, context);
        std::swap(work.coarse, work.fine);
    }
    const std::vector<Index>& grid = detail.patches.grid;
    state_->places.resize(*std::max_element(grid.begin(), grid.end()) + std::size_t{1});
    for (std::size_t place = grid.size(); place-- > 0;) state_->places[grid[place]] = static_cast<Index>(place);
}

ReferenceRestorer::~ReferenceRestorer() = default;
ReferenceRestorer::ReferenceRestorer(ReferenceRestorer&&) noexcept = default;
ReferenceRestorer& ReferenceRestorer::operator=(ReferenceRestorer&&) noexcept = default;

std::vector<Index> ReferenceRestorer::level_vertices(unsigned level) const {
    const RegularPatches& patches = state_->plan.patches();
    assert(level <= patches.levels);
    const std::size_t step = patches.side() >> level;
    std::vector<bool> is_kept(state_->places.size(), false);
    for (std::size_t p = 0; p < patches.patch_count(); ++p)
        for (std::size_t j = 0; j <= patches.side(); j += step)
            for (std::size_t i = 0; i <= patches.side(); i += step) is_kept[patches.at(p, i, j)] = true;
    std::vector<Index> vertices;
    for (Index vertex = 0; vertex < is_kept.size(); ++vertex)
        if (is_kept[vertex]) vertices.push_back(vertex);
    return vertices;
}

std::vector<std::array<Index, 4>> ReferenceRestorer::level_quads(unsigned level) const {
    const RegularPatches& patches = state_->plan.patches();
    assert(level <= patches.levels);
    const std::size_t n = patches.side(), step = n >> level;
    std::vector<std::array<Index, 4>> quads;
    quads.reserve(patches.patch_count() << (2 * level));
    for (std::size_t p = 0; p < patches.patch_count(); ++p)
        for (std::size_t j = 0; j < n; j += step)
            for (std::size_t i = 0; i < n; i += step)
                quads.push_back({patches.at(p, i, j), patches.at(p, i + step, j), patches.at(p, i + step, j + step),
                                 patches.at(p, i, j + step)});
    return quads;
}

void ReferenceRestorer::restore(std::span<const Vec3f> driver, unsigned level, std::span<Vec3f> positions,
                                const RunContext& context) const {
    const RegularPatches& patches = state_->plan.patches();
    assert(positions.size() >= state_->places.size());
    const std::size_t pitch = patches.side() + 1, step = patches.side() >> level, side = (std::size_t{1} << level) + 1;
    auto work = state_->plan.take_work();
    work->grids.resize(patches.patch_count() * side * side);
    state_->plan.restore(driver, level, work->grids, *work, context);
    // Each vertex takes its own place; writing from the grids, two patches would meet at their border.
    parallel_for(context, state_->places.size(), kRecordsPerTask, [&](auto begin, auto end) {
        for (std::size_t vertex = begin; vertex < end; ++vertex) {
            const std::size_t place = state_->places[vertex], row = place / pitch, i = place % pitch;
            const std::size_t p = row / pitch, j = row % pitch;
            if (i % step || j % step) continue;
            positions[vertex] = work->grids[(p * side + j / step) * side + i / step];
        }
    });
    state_->plan.return_work(std::move(work));
}

void ReferenceRestorer::restore_grids(std::span<const Vec3f> driver, unsigned level, std::span<Vec3f> positions,
                                      const RunContext& context) const {
    auto work = state_->plan.take_work();
    state_->plan.restore(driver, level, positions, *work, context);
    state_->plan.return_work(std::move(work));
}

std::size_t ReferenceRestorer::code_bytes() const { return state_->plan.code_bytes(); }

} // namespace filigree
