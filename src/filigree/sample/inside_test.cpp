#include "filigree/sample/inside_test.h"

#include <chrono>

namespace filigree {

namespace {

constexpr double kInside = 0.5; // winding number: half way from outside to inside

} // namespace

Result<InsideTest> InsideTest::create(const Mesh& mesh, const InsideOptions& options, const RunContext& context) {
    InsideMethod method = options.method;
    const Result<WeldedTriangles> welded = weld_for(method, mesh, context);
    if (!welded) return welded.error();
    InsideTest test;
    if (method == InsideMethod::winding) {
        Result<WindingTree> winding = WindingTree::create(mesh.positions, welded->triangles, options.accuracy, context);
        if (!winding) return winding.error();
        test.winding_ = std::move(winding).value();
    } else {
        Result<RayParity> rays = RayParity::create(mesh.positions, welded->triangles, options.eye, context);
        if (!rays) return rays.error();
        test.rays_ = std::move(rays).value();
    }
    return test;
}

bool InsideTest::contains(const Vec3d& point) const {
    return rays_ ? rays_->contains(point) : winding_->winding(point) >= kInside;
}

Result<std::vector<std::uint8_t>> InsideTest::contains(std::span<const Vec3d> points, const RunContext& context) const {
    if (rays_) return rays_->contains(points, context);
    const Result<std::vector<float>> windings = winding_->winding(points, context);
    if (!windings) return windings.error();
    std::vector<std::uint8_t> inside(points.size());
    for (std::size_t i = 0; i < inside.size(); ++i) inside[i] = (*windings)[i] >= float(kInside);
    return inside;
}

Result<std::vector<Vec3d>> points_inside(const Mesh& mesh, std::span<const Vec3d> points, InsideOptions options,
                                         const RunContext& context, InsideReport* report) {
    using Clock = std::chrono::steady_clock;
    if (options.method == InsideMethod::automatic) options.method = InsideMethod::rays;
    const Clock::time_point begin = Clock::now();
    const Result<InsideTest> test = InsideTest::create(mesh, options, context);
    if (!test) return test.error();
    const Clock::time_point prepared = Clock::now();
    const Result<std::vector<std::uint8_t>> inside = test->contains(points, context);
    if (!inside) return inside.error();
    if (report) {
        report->used = test->used();
        report->setup_seconds = std::chrono::duration<double>(prepared - begin).count();
        report->seconds = std::chrono::duration<double>(Clock::now() - prepared).count();
    }
    std::vector<Vec3d> chosen;
    for (std::size_t i = 0; i < points.size(); ++i)
        if ((*inside)[i]) chosen.push_back(points[i]);
    return chosen;
}

} // namespace filigree
