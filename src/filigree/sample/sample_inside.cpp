#include "filigree/sample.h"
#include "filigree/sample/closure.h"
#include "filigree/sample/inside_rays.h"
#include "filigree/sample/inside_scan.h"
#include "filigree/sample/lattice_memory.h"
#include "filigree/sample/weld_for.h"
#include "filigree/sample/winding_inside.h"

#include "filigree/core/now_seconds.h"

#include <string>

namespace filigree {

namespace {

/// In the world; six decimals are enough to find the place.
std::string place(const Vec3f& p, const Vec3d& origin) {
    const Vec3d at = p.cast<double>() + origin;
    return "(" + std::to_string(at.x()) + ", " + std::to_string(at.y()) + ", " + std::to_string(at.z()) + ")";
}

Error not_closed(const Closure& closure, const Vec3d& origin) {
    return {ErrorCode::unsuitable, "The mesh is open (" + std::to_string(closure.open_edges) +
                                       " open edges, the first from " + place(closure.first_open[0], origin) + " to " +
                                       place(closure.first_open[1], origin) +
                                       "), so crossings do not tell inside from outside; use the method winding."};
}

Result<Occupancy> inside_by_rays(const RayParity& rays, const Lattice& lattice, const InsideOptions& options,
                                 const RunContext& context, RayParity::Count& count) {
    const auto [nx, ny, nz] = lattice.counts();
    Result<Occupancy> occupancy =
        make_occupancy(lattice, double(sizeof(Vec3d)) * double(nx) * double(ny), options.most_bytes);
    if (!occupancy) return occupancy;
    std::vector<Vec3d> layer(nx * ny);
    for (std::size_t k = 0; k < nz; ++k) {
        context.report("counting crossings", double(k) / double(nz));
        for (std::size_t j = 0; j < ny; ++j)
            for (std::size_t i = 0; i < nx; ++i) layer[j * nx + i] = lattice.point(i, j, k);
        const Result<std::vector<std::uint8_t>> inside =
            rays.contains(layer, context, &count, options.overlap == Overlap::merged);
        if (!inside) return inside.error();
        for (std::size_t j = 0; j < ny; ++j)
            for (std::size_t i = 0; i < nx; ++i)
                if ((*inside)[j * nx + i])
                    occupancy->bits[(k * ny + j) * occupancy->words_per_row + (i >> 6)] |= std::uint64_t{1} << (i & 63);
    }
    return occupancy;
}

} // namespace

namespace {

/// The place of the mesh's origin is for the sentence alone.
std::optional<Error> choose_method(InsideMethod& method, const WeldedTriangles& welded, const Vec3d& origin) {
    if (welded.triangles.empty())
        return Error{ErrorCode::unsuitable, "The mesh has no faces with an area, so nothing is inside."};
    const Closure& closure = welded.closure;
    if (method == InsideMethod::automatic)
        method = closure.is_closed() && closure.is_oriented() ? InsideMethod::scan : InsideMethod::winding;
    if (method != InsideMethod::winding && !closure.is_closed()) return not_closed(closure, origin);
    return std::nullopt;
}

} // namespace

Result<WeldedTriangles> weld_for(InsideMethod& method, const Mesh& mesh, const RunContext& context) {
    Result<WeldedTriangles> welded = weld_triangles(mesh, context);
    if (!welded) return welded;
    if (auto error = choose_method(method, *welded, mesh.origin)) return *error;
    return welded;
}

struct InsideSampler::Prepared {
    std::span<const Vec3f> positions;
    InsideOptions options;
    InsideMethod used = options.method;
    double start = now_seconds();
    WeldedTriangles own = {}; ///< where it was welded here
    const WeldedTriangles* welded = &own;
    std::optional<RayParity> rays = {};
    std::optional<WindingSampler> winding = {};
    double seconds = 0; ///< that preparing took

    ScanMesh triangles() const { return {positions, welded->triangles}; }
};

InsideSampler::InsideSampler(std::unique_ptr<Prepared> prepared) : prepared_(std::move(prepared)) {}
InsideSampler::InsideSampler(InsideSampler&&) noexcept = default;
InsideSampler& InsideSampler::operator=(InsideSampler&&) noexcept = default;
InsideSampler::~InsideSampler() = default;

InsideMethod InsideSampler::used() const { return prepared_->used; }

Result<InsideSampler> InsideSampler::create(const Mesh& mesh, const InsideOptions& options, const RunContext& context) {
    auto prepared = std::make_unique<Prepared>(Prepared{mesh.positions, options});
    Result<WeldedTriangles> welded = weld_for(prepared->used, mesh, context);
    if (!welded) return welded.error();
    prepared->own = std::move(welded).value();
    prepared->welded = &prepared->own;
    return prepare(std::move(prepared), context);
}

Result<InsideSampler> InsideSampler::create(std::span<const Vec3f> positions, const WeldedTriangles& welded,
                                            const InsideOptions& options, const RunContext& context) {
    auto prepared = std::make_unique<Prepared>(Prepared{positions, options});
    prepared->welded = &welded;
    if (auto error = choose_method(prepared->used, welded, Vec3d::Zero())) return *error;
    return prepare(std::move(prepared), context);
}

Result<InsideSampler> InsideSampler::prepare(std::unique_ptr<Prepared> prepared, const RunContext& context) {
    const InsideOptions& options = prepared->options;
    if (prepared->used == InsideMethod::rays) {
        Result<RayParity> rays =
            RayParity::create(prepared->positions, prepared->welded->triangles, options.eye, context);
        if (!rays) return rays.error();
        prepared->rays = std::move(rays).value();
    } else if (prepared->used == InsideMethod::winding) {
        Result<WindingSampler> winding =
            WindingSampler::create(prepared->triangles(), {options.accuracy, options.most_bytes}, context);
        if (!winding) return winding.error();
        prepared->winding = std::move(winding).value();
    }
    prepared->seconds = now_seconds() - prepared->start;
    return InsideSampler(std::move(prepared));
}

Result<Occupancy> InsideSampler::inside(const Lattice& lattice, const RunContext& context, InsideReport* report) const {
    const double start = now_seconds();
    const Prepared& p = *prepared_;
    InsideReport found;
    found.used = p.used;
    found.closure = p.welded->closure;
    found.outward = p.welded->outward;
    found.setup_seconds = p.seconds;
    Result<Occupancy> occupancy =
        p.rays ? inside_by_rays(*p.rays, lattice, p.options, context, found.rays)
        : p.winding
            ? p.winding->inside(lattice, context, &found.winding)
            : scan_inside(p.triangles(), lattice, {p.options.overlap, p.options.most_bytes}, context, &found.scan);
    found.seconds = now_seconds() - start;
    if (report) *report = found;
    return occupancy;
}

Result<Occupancy> sample_inside(const Mesh& mesh, const Lattice& lattice, const InsideOptions& options,
                                const RunContext& context, InsideReport* report) {
    const Result<InsideSampler> sampler = InsideSampler::create(mesh, options, context);
    if (!sampler) return sampler.error();
    return sampler->inside(lattice, context, report);
}

} // namespace filigree
