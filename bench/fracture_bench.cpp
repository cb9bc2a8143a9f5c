// What breaking a mesh costs, and how good what comes out is. FILIGREE_SCAN names the mesh; a wavy sphere unless said.
// One thread. Times are of the cut: the surface, and what lies inside; reading, welding and naming pieces are apart.
#include "filigree/file.h"
#include "filigree/fracture.h"
#include "filigree/mesh.h"

#include <benchmark/benchmark.h>

#include <Eigen/LU>
#include <algorithm>
#include <cstdlib>
#include <numbers>
#include <unordered_map>

namespace {

using namespace filigree;

const RunContext kOneThread(1);

const Mesh& scan() {
    static const Mesh mesh = [] {
        const char* path = std::getenv("FILIGREE_SCAN");
        return path ? read_mesh(path, kOneThread).value().mesh : make_wavy_sphere({.resolution = 192});
    }();
    return mesh;
}

/// Smallest angles of the triangles on cracks, degrees, ascending.
std::vector<double> smallest_angles(const FracturedMesh& f) {
    std::vector<double> angles;
    for (std::size_t k = 0; k < f.mesh.face_count(); ++k) {
        if (!f.is_inside[k]) continue;
        double least = 180;
        const auto at = [&](std::size_t c) { return f.mesh.positions[f.mesh.face(k)[c % 3]].cast<double>().eval(); };
        for (std::size_t c = 0; c < 3; ++c) {
            const Vec3d u = at(c + 1) - at(c), v = at(c + 2) - at(c);
            least = std::min(least, std::atan2(u.cross(v).norm(), u.dot(v)) * 180 / std::numbers::pi);
        }
        angles.push_back(least);
    }
    std::sort(angles.begin(), angles.end());
    return angles;
}

/// Whether the segment a b goes through the triangle.
bool pierces(const Vec3d& a, const Vec3d& b, const std::array<Vec3d, 3>& t) {
    const Vec3d u = t[1] - t[0], v = t[2] - t[0], d = b - a, p = d.cross(v);
    const double det = u.dot(p);
    if (det == 0) return false;
    const Vec3d s = a - t[0], q = s.cross(u);
    const double x = s.dot(p) / det, y = d.dot(q) / det, along = v.dot(q) / det;
    return x > 0 && y > 0 && x + y < 1 && along > 0 && along < 1;
}

/// Pairs of triangles that cross and share no corner's place, each surface inside counted once.
std::size_t crossing_pairs(const FracturedMesh& f) {
    struct Entry {
        std::array<Vec3d, 3> corners;
    };
    std::vector<Entry> all;
    double edges = 0;
    const Triangulation triangles = triangulate(f.mesh);
    for (std::size_t k = 0; k < triangles.triangles.size(); ++k) {
        const Index face = triangles.source_face[k], crack = f.crack_of_face[face];
        if (crack != kNoIndex && f.piece_of_face[face] != f.cells_of_crack[crack][0]) continue;
        Entry entry;
        for (std::size_t c = 0; c < 3; ++c)
            entry.corners[c] = f.mesh.positions[triangles.triangles[k][c]].cast<double>();
        edges += (entry.corners[1] - entry.corners[0]).norm();
        all.push_back(entry);
    }
    const double side = 2 * edges / double(all.size());
    std::unordered_map<std::uint64_t, std::vector<Index>> boxes;
    const auto for_boxes = [&](const Entry& entry, const auto& visit) {
        const Vec3d lo = entry.corners[0].cwiseMin(entry.corners[1]).cwiseMin(entry.corners[2]) / side;
        const Vec3d hi = entry.corners[0].cwiseMax(entry.corners[1]).cwiseMax(entry.corners[2]) / side;
        for (std::int64_t x = std::int64_t(std::floor(lo[0])); x <= std::int64_t(std::floor(hi[0])); ++x)
            for (std::int64_t y = std::int64_t(std::floor(lo[1])); y <= std::int64_t(std::floor(hi[1])); ++y)
                for (std::int64_t z = std::int64_t(std::floor(lo[2])); z <= std::int64_t(std::floor(hi[2])); ++z)
                    visit((std::uint64_t(x) & 0x1fffff) << 42 | (std::uint64_t(y) & 0x1fffff) << 21 |
                          (std::uint64_t(z) & 0x1fffff));
    };
    std::size_t pairs = 0;
    for (Index k = 0; k < all.size(); ++k) {
        std::vector<Index> near;
        for_boxes(all[k], [&](std::uint64_t box) {
            std::vector<Index>& in_box = boxes[box];
            near.insert(near.end(), in_box.begin(), in_box.end());
            in_box.push_back(k);
        });
        std::sort(near.begin(), near.end());
        near.erase(std::unique(near.begin(), near.end()), near.end());
        for (const Index other : near) {
            const auto &a = all[k].corners, &b = all[other].corners;
            bool touch = false, cross = false;
            for (const Vec3d& p : a)
                for (const Vec3d& q : b) touch |= p == q;
            for (std::size_t c = 0; c < 3 && !touch && !cross; ++c)
                cross = pierces(a[c], a[(c + 1) % 3], b) || pierces(b[c], b[(c + 1) % 3], a);
            pairs += cross;
        }
    }
    return pairs;
}

/// range(0): pieces; range(1): roughness in hundredths.
void cut(benchmark::State& state) {
    const Mesh& mesh = scan();
    const FracturePattern pattern{.pieces = Index(state.range(0)), .roughness = double(state.range(1)) / 100};
    const FractureCells cells = make_fracture_cells(mesh, pattern, kOneThread).value();
    std::optional<FracturedMesh> made;
    double assemble = 0;
    for (auto _ : state) {
        made = fracture(mesh, cells, {}, kOneThread).value();
        state.SetIterationTime(made->report.cut_seconds + made->report.facet_seconds);
        assemble = made->report.assemble_seconds;
    }
    const CutReport& report = made->report;
    const std::vector<double> angles = smallest_angles(*made);
    state.counters["pieces_s"] = assemble;
    state.counters["triangles"] = double(made->mesh.face_count());
    state.counters["inside"] = double(report.inside_faces);
    state.counters["fans"] = double(report.fan_facets);
    state.counters["open"] = double(report.open_edges);
    state.counters["volume_error"] = report.volume_error;
    if (!angles.empty()) {
        state.counters["angle_1pc"] = angles[angles.size() / 100];
        state.counters["angle_med"] = angles[angles.size() / 2];
    }
    FracturedMesh unbroken;
    unbroken.mesh = mesh;
    unbroken.crack_of_face.assign(mesh.face_count(), kNoIndex);
    state.counters["crossing"] = double(crossing_pairs(*made));
    state.counters["crossing_before"] = double(crossing_pairs(unbroken));
}
BENCHMARK(cut)
    ->ArgNames({"pieces", "roughness"})
    ->Args({20, 0})
    ->Args({20, 50})
    ->Args({200, 50})
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond)
    ->Iterations(3);

} // namespace
