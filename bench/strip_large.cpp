// Stripping large meshes in clusters against stripping them in one piece: what each costs, and how good its levels and
// drivers are.
//   strip_large time RESOLUTION...   wavy cubes of about 6 R^2 vertices, in clusters, a line each
//   strip_large against RESOLUTION   the same once in clusters, once in one piece
//   strip_large quality MESH [N]     the largest part of a mesh, its triangles cut in four N times, and made rough
#include "filigree/core/disjoint_sets.h"
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/restore.h"

#include "spent.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <random>
#include <string_view>

namespace {

using namespace filigree;

constexpr std::size_t kNever = std::numeric_limits<std::size_t>::max();

double peak_gib() { return peak_bytes() / double(1 << 30); }

Stripped stripped(Mesh mesh, std::size_t one_piece, std::size_t base = 1000) {
    StripOptions options;
    options.base = base;
    options.one_piece = one_piece;
    return strip(std::move(mesh), options, RunContext()).value();
}

Spent print_time(const char* how, unsigned resolution, std::size_t one_piece) {
    Mesh mesh = make_wavy_cube({.resolution = resolution});
    const double millions = 1e-6 * double(mesh.vertex_count());
    const Spent begin = now();
    const Stripped result = stripped(std::move(mesh), one_piece);
    const Spent end = now();
    const Spent spent{end.wall - begin.wall, end.processor - begin.processor};
    std::printf("%-10s %6.2f M vertices: %6.1f s, %6.1f processor s, %.2f a million; simplify %.1f, bind %.1f s; peak "
                "of the program %.2f GiB\n",
                how, millions, spent.wall, spent.processor, spent.processor / millions, result.report.simplify_seconds,
                result.report.bind_seconds, peak_gib());
    std::fflush(stdout);
    return spent;
}

/// The part with the most vertices: scraps of a scan that float inside it hang on either side by chance, and the error
/// of all of it is then theirs.
Mesh largest_part(const Mesh& mesh) {
    DisjointSets parts(mesh.vertex_count());
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (const Index v : mesh.face(f)) parts.join(mesh.face(f)[0], v);
    std::vector<Index> sizes(mesh.vertex_count(), 0), local(mesh.vertex_count(), kNoIndex);
    for (Index v = 0; v < sizes.size(); ++v) ++sizes[parts.root(v)];
    const auto largest = Index(std::ranges::max_element(sizes) - sizes.begin());
    Mesh part;
    part.origin = mesh.origin;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        if (parts.root(mesh.face(f)[0]) != largest) continue;
        std::vector<Index> face(mesh.face(f).begin(), mesh.face(f).end());
        for (Index& v : face) {
            if (local[v] == kNoIndex) {
                local[v] = Index(part.positions.size());
                part.positions.push_back(mesh.positions[v]);
            }
            v = local[v];
        }
        part.add_face(face);
    }
    return part;
}

/// Every triangle cut in four.
Mesh cut_in_four(const Mesh& mesh) {
    Mesh finer;
    finer.positions = mesh.positions;
    std::map<std::pair<Index, Index>, Index> middles;
    const auto middle = [&](Index a, Index b) {
        const auto [found, is_new] = middles.try_emplace(std::minmax(a, b), Index(finer.positions.size()));
        if (is_new) finer.positions.push_back((mesh.positions[a] + mesh.positions[b]) / 2);
        return found->second;
    };
    for (const Triangle& t : triangulate(mesh).triangles) {
        const Index ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
        for (const Triangle& part : {Triangle{t[0], ab, ca}, {t[1], bc, ab}, {t[2], ca, bc}, {ab, bc, ca}})
            finer.add_face(part);
    }
    return finer;
}

void roughen(Mesh& mesh) {
    const auto height = float(2e-5 * bounds(mesh.positions).diagonal());
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0, height);
    for (Vec3f& p : mesh.positions) p += Vec3f(noise(random), noise(random), noise(random));
}

void compare_levels(const Mesh& mesh) {
    const Stripped clusters = stripped(mesh, mesh.vertex_count() / 16), one = stripped(mesh, kNever);
    const double diagonal = bounds(mesh.positions).diagonal();
    const auto rms = [&](const Model& model, unsigned level) {
        const std::vector<float> far = distances_to_surface(mesh, level_mesh(model, level), RunContext()).value();
        double sum = 0;
        for (const float d : far) sum += double(d) * double(d);
        return std::sqrt(sum / double(far.size())) / diagonal;
    };
    for (unsigned level = one.model.finest_level(); level-- > 1;) {
        const double a = rms(clusters.model, level), b = rms(one.model, level);
        std::printf("level of %zu (one piece: %zu) vertices: the mesh is %.2e off, one piece %.2e; ratio %.2f\n",
                    clusters.model.levels[level].vertices.size(), one.model.levels[level].vertices.size(), a, b, a / b);
        std::fflush(stdout);
    }
}

/// Of each curved warp of fidelity_warps: the rms, and what 99.9 % of the vertices are within, of the mesh restored
/// with gradients.
struct WarpErrors {
    std::vector<double> rms, most;
};

WarpErrors errors_of(const Model& model) {
    const Restorer restorer = Restorer::create(model, {}, RunContext()).value();
    const std::vector<Vec3f>& rest = model.mesh.positions;
    WarpErrors errors;
    for (const NamedWarp& named : fidelity_warps(bounds(rest))) {
        if (named.affine) continue;
        Pose pose;
        for (const Vec3f& p : driver_positions(model)) {
            const Warped warped = named.warp->warp(p.cast<double>());
            pose.positions.push_back(warped.position.cast<float>());
            pose.gradients.push_back(warped.gradient.cast<float>());
        }
        const std::vector<Vec3f> restored = restorer.positions(pose, RunContext()).value();
        std::vector<double> far;
        double sum = 0;
        for (std::size_t v = 0; v < rest.size(); ++v) {
            far.push_back((restored[v].cast<double>() - named.warp->position(rest[v].cast<double>())).norm());
            sum += far.back() * far.back();
        }
        const auto place = far.begin() + std::ptrdiff_t(0.999 * double(far.size()));
        std::nth_element(far.begin(), place, far.end());
        errors.rms.push_back(std::sqrt(sum / double(far.size())));
        errors.most.push_back(*place);
    }
    return errors;
}

double mean_ratio(std::span<const double> a, std::span<const double> b) {
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += std::log(a[k] / b[k]);
    return std::exp(sum / double(a.size()));
}

void compare_drivers(const Mesh& mesh) {
    std::vector<double> rms, most;
    for (const unsigned base : {500u, 700u, 1000u, 1400u, 2000u, 2800u, 4000u, 5600u, 8000u}) {
        const WarpErrors a = errors_of(stripped(mesh, mesh.vertex_count() / 16, base).model);
        const WarpErrors b = errors_of(stripped(mesh, kNever, base).model);
        rms.push_back(mean_ratio(a.rms, b.rms));
        most.push_back(mean_ratio(a.most, b.most));
        std::printf("driver of %u: curved warps, ratio to one piece: rms %.2f, 99.9 %% of the vertices %.2f\n", base,
                    rms.back(), most.back());
        std::fflush(stdout);
    }
    const std::vector<double> one(rms.size(), 1);
    std::printf("geometric means: %.3f and %.3f\n", mean_ratio(rms, one), mean_ratio(most, one));
}

} // namespace

int main(int argc, char** argv) {
    const std::string_view what = argc > 2 ? argv[1] : "";
    if (what == "time") {
        for (int k = 2; k < argc; ++k) print_time("clusters", unsigned(std::atoi(argv[k])), StripOptions().one_piece);
    } else if (what == "against") {
        const auto resolution = unsigned(std::atoi(argv[2]));
        const Spent clusters = print_time("clusters", resolution, StripOptions().one_piece);
        const Spent one = print_time("one piece", resolution, kNever);
        std::printf("clusters take %.2f of the time and %.2f of the processor's\n", clusters.wall / one.wall,
                    clusters.processor / one.processor);
    } else if (what == "quality") {
        Mesh mesh = std::string_view(argv[2]) == "cube" ? make_wavy_cube({.resolution = 512})
                                                        : read_mesh(argv[2], RunContext()).value().mesh;
        mesh = largest_part(mesh);
        for (int k = argc > 3 ? std::atoi(argv[3]) : 1; k-- > 0;) mesh = cut_in_four(mesh);
        roughen(mesh);
        std::printf("%zu vertices\n", mesh.vertex_count());
        compare_levels(mesh);
        compare_drivers(mesh);
    } else {
        std::fprintf(stderr, "usage: strip_large time|against RESOLUTION... | quality MESH|cube [TIMES CUT]\n");
        return 2;
    }
}
