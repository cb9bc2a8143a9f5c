// The tree that finds closest points beside Embree's point queries, which get the same boxes and the same exact
// distance. FILIGREE_BENCH_MESH=FILE takes that mesh in place of a wavy sphere of 786,432 triangles. Seconds are of one
// thread. Without Embree (Debian: libembree-dev) only ours is measured. "wrong" counts queries whose answers differ.
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/triangle_point.h"

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <iostream>
#include <random>

#ifdef FILIGREE_BENCH_EMBREE
#if FILIGREE_BENCH_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#endif

using namespace filigree;

namespace {

struct Case {
    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;
    std::vector<Vec3f> queries; ///< one a second vertex, off the surface by about 1 % of the diagonal
};

const Case& the_case() {
    static const Case made = [] {
        Mesh mesh;
        if (const char* path = std::getenv("FILIGREE_BENCH_MESH"))
            mesh = read_mesh(path, RunContext()).value().mesh;
        else
            mesh = make_wavy_sphere({.resolution = 256});
        Case one{mesh.positions, triangulate(mesh).triangles, {}};
        std::mt19937 random(1);
        const double reach = 0.01 * bounds(mesh.positions).diagonal();
        const auto offset = [&] { return float(reach * (double(random()) / double(std::mt19937::max()) * 2 - 1)); };
        for (std::size_t v = 0; v < mesh.positions.size(); v += 2)
            one.queries.push_back(mesh.positions[v] + Vec3f(offset(), offset(), offset()));
        return one;
    }();
    return made;
}

std::array<Vec3d, 3> corners(const Case& of, Index triangle) {
    const auto& [a, b, c] = of.triangles[triangle];
    return {of.positions[a].cast<double>(), of.positions[b].cast<double>(), of.positions[c].cast<double>()};
}

void ours_build(benchmark::State& state) {
    const Case& of = the_case();
    for (auto _ : state) benchmark::DoNotOptimize(ClosestPointTree(of.positions, of.triangles, RunContext(1)));
}

void ours_query(benchmark::State& state) {
    const Case& of = the_case();
    const ClosestPointTree tree(of.positions, of.triangles, RunContext(1));
    for (auto _ : state)
        for (const Vec3f& query : of.queries) benchmark::DoNotOptimize(tree.closest(query));
    state.SetItemsProcessed(std::int64_t(of.queries.size()) * std::int64_t(state.iterations()));
}

#ifdef FILIGREE_BENCH_EMBREE
class EmbreeTree {
public:
    explicit EmbreeTree(const Case& of) : of_(of), device_(rtcNewDevice("threads=1")), scene_(rtcNewScene(device_)) {
        const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry, unsigned(of.triangles.size()));
        rtcSetGeometryUserData(geometry, this);
        rtcSetGeometryBoundsFunction(geometry, bound, nullptr);
        rtcCommitGeometry(geometry);
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    EmbreeTree(const EmbreeTree&) = delete;
    EmbreeTree& operator=(const EmbreeTree&) = delete;
    ~EmbreeTree() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }

    double closest(const Vec3f& at) const {
        Search search{of_, at.cast<double>()};
        RTCPointQuery query{at.x(), at.y(), at.z(), 0, std::numeric_limits<float>::infinity()};
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        rtcPointQuery(scene_, &query, &context, visit, &search);
        return search.distance;
    }

private:
    struct Search {
        const Case& of;
        Vec3d at;
        double distance = std::numeric_limits<double>::infinity();
    };
    static void bound(const RTCBoundsFunctionArguments* args) {
        const Case& of = static_cast<const EmbreeTree*>(args->geometryUserPtr)->of_;
        Vec3f low = of.positions[of.triangles[args->primID][0]], high = low;
        for (const Index v : of.triangles[args->primID]) {
            low = low.cwiseMin(of.positions[v]);
            high = high.cwiseMax(of.positions[v]);
        }
        *args->bounds_o = {low.x(), low.y(), low.z(), 0, high.x(), high.y(), high.z(), 0};
    }
    static bool visit(RTCPointQueryFunctionArguments* args) {
        Search& search = *static_cast<Search*>(args->userPtr);
        const double found =
            std::sqrt(closest_on_triangle(search.at, corners(search.of, args->primID)).squared_distance);
        if (!(found < search.distance)) return false;
        search.distance = found;
        args->query->radius = float(found * (1 + 1e-6));
        return true;
    }

    const Case& of_;
    RTCDevice device_;
    RTCScene scene_;
};

void embree_build(benchmark::State& state) {
    const Case& of = the_case();
    for (auto _ : state) benchmark::DoNotOptimize(EmbreeTree(of).closest(Vec3f::Zero()));
}

void embree_query(benchmark::State& state) {
    const Case& of = the_case();
    const EmbreeTree tree(of);
    const ClosestPointTree ours(of.positions, of.triangles, RunContext(1));
    int wrong = 0;
    for (const Vec3f& query : of.queries) wrong += tree.closest(query) != ours.closest(query).distance;
    for (auto _ : state)
        for (const Vec3f& query : of.queries) benchmark::DoNotOptimize(tree.closest(query));
    state.SetItemsProcessed(std::int64_t(of.queries.size()) * std::int64_t(state.iterations()));
    state.counters["wrong"] = wrong;
}
BENCHMARK(embree_build)->Unit(benchmark::kMillisecond);
BENCHMARK(embree_query)->Unit(benchmark::kMillisecond);
#endif
BENCHMARK(ours_build)->Unit(benchmark::kMillisecond);
BENCHMARK(ours_query)->Unit(benchmark::kMillisecond);

} // namespace
