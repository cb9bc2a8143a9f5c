#include "filigree/sample.h"
#include "filigree/sample/closure.h"
#include "filigree/sample/inside_rays.h"
#include "filigree/sample/inside_scan.h"
#include "filigree/sample/weld_for.h"
#include "filigree/sample/winding_inside.h"

#include "filigree/core/now_seconds.h"
#include "filigree/core/parallel_for.h"

#include <algorithm>

namespace filigree {

struct InsideTest::Content {
    RayParity rays; ///< of the mesh, with cones where it is open
    std::optional<WindingTree> cones = {};
    bool by_parity = true;
    InsideMethod used = InsideMethod::rays;
    OutwardReport outward = {};
    Closure closure = {};
};

InsideTest::InsideTest(std::unique_ptr<const Content> content) : content_(std::move(content)) {}
InsideTest::InsideTest(InsideTest&&) noexcept = default;
InsideTest& InsideTest::operator=(InsideTest&&) noexcept = default;
InsideTest::~InsideTest() = default;

InsideMethod InsideTest::used() const { return content_->used; }
const OutwardReport& InsideTest::outward() const { return content_->outward; }
const Closure& InsideTest::closure() const { return content_->closure; }

Result<InsideTest> InsideTest::create(const Mesh& mesh, const InsideOptions& options, const RunContext& context) {
    InsideMethod method = options.method;
    const Result<WeldedTriangles> welded = weld_for(method, mesh, context);
    if (!welded) return welded.error();
    const bool by_winding = method == InsideMethod::winding;
    ScanMesh surface{mesh.positions, welded->triangles};
    ClosedByCones closed;
    if (by_winding) {
        Result<ClosedByCones> made = close_by_cones(surface, options.accuracy, context);
        if (!made) return made.error();
        closed = std::move(made).value();
        if (closed.cones) surface = {closed.positions, closed.triangles};
    }
    Result<RayParity> rays =
        RayParity::create(surface.positions, surface.triangles, by_winding ? std::nullopt : options.eye, context);
    if (!rays) return rays.error();
    return InsideTest(std::make_unique<const Content>(
        Content{std::move(rays).value(), std::move(closed.cones), !by_winding && options.overlap == Overlap::parity,
                by_winding ? InsideMethod::winding : InsideMethod::rays, welded->outward, welded->closure}));
}

bool InsideTest::contains(const Vec3d& point) const {
    const RayParity::Crossings crossings = content_->rays.crossings(point);
    if (content_->by_parity) return crossings.is_odd;
    const std::optional<WindingTree>& cones = content_->cones;
    return crossings.winding >= (cones ? ClosedByCones::least_winding(cones->winding(point)) : 1);
}

Result<std::vector<std::uint8_t>> InsideTest::contains(std::span<const Vec3d> points, const RunContext& context) const {
    constexpr std::size_t kGrain = 64, kBetweenReports = std::size_t{1} << 16;
    if (content_->by_parity) return content_->rays.contains(points, context);
    std::vector<std::uint8_t> inside(points.size());
    for (std::size_t first = 0; first < points.size(); first += kBetweenReports) {
        context.report("inside", static_cast<double>(first) / static_cast<double>(points.size()));
        const std::size_t count = std::min(kBetweenReports, points.size() - first);
        parallel_for(context, count, kGrain, [&](std::size_t begin, std::size_t end) {
            if (context.is_cancelled()) return;
            for (std::size_t i = first + begin; i < first + end; ++i) inside[i] = contains(points[i]);
        });
        if (context.is_cancelled()) return cancelled_error();
    }
    return inside;
}

Result<std::vector<Vec3d>> points_inside(const Mesh& mesh, std::span<const Vec3d> points, InsideOptions options,
                                         const RunContext& context, InsideReport* report) {
    if (options.method == InsideMethod::automatic) options.method = InsideMethod::rays;
    const double begin = now_seconds();
    const Result<InsideTest> test = InsideTest::create(mesh, options, context);
    if (!test) return test.error();
    const double prepared = now_seconds();
    const Result<std::vector<std::uint8_t>> inside = test->contains(points, context);
    if (!inside) return inside.error();
    if (report) {
        report->used = test->used();
        report->closure = test->closure();
        report->outward = test->outward();
        report->setup_seconds = prepared - begin;
        report->seconds = now_seconds() - prepared;
    }
    std::vector<Vec3d> chosen;
    for (std::size_t i = 0; i < points.size(); ++i)
        if ((*inside)[i]) chosen.push_back(points[i]);
    return chosen;
}

} // namespace filigree
