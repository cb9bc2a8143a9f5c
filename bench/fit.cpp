// Fits animations made by formulas: the smallest driver for an error, what is left of it, and what it costs.
//   fit_table [--error 1e-4] [--base N] [--choice rest|motion] [--weight-rounds N] [--frames 60] [--scan MESH]
//             [--threads N] [NAME...]
// A line each. Names: flag, rod, crumple, skin, bulges, fluid; scan-skin, scan-bulges and scan-warp move --scan MESH
// (scan-warp bends, twists and distorts it; from a .pc2 file, as large scans are). Default: all.
//   fit_table --animation FILE [--mesh REST] ...    fits a file: a glTF that moves, or a cache with its mesh
//   fit_table --most-megabytes M ...    leaves with 1 where the memory at its peak is above M
//   fit_table --write FOLDER NAME...    writes NAME.pc2 and NAME.obj there instead
#include "../tests/fit/made_animations.h"

#include "filigree/fit.h"
#include "filigree/pack.h"
#include "filigree/pose.h"

#include "spent.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include <unistd.h>

namespace {

using namespace filigree;
using namespace filigree_test;
namespace fs = std::filesystem;

struct Options {
    FitOptions fit;
    std::size_t frames = 60;
    unsigned threads = 0;
    std::string scan, folder, animation, mesh;
    double most_megabytes = 0; ///< 0: any
    std::vector<std::string> names;
};

Options read_options(int count, char** arguments) {
    Options options;
    for (int a = 1; a < count; ++a) {
        const std::string name = arguments[a];
        if (!name.starts_with("--")) {
            options.names.push_back(name);
            continue;
        }
        const std::string value = a + 1 < count ? arguments[++a] : "";
        if (name == "--error") options.fit.error = std::atof(value.c_str());
        if (name == "--max-error") options.fit.max_error = std::atof(value.c_str());
        if (name == "--base") options.fit.base = std::size_t(std::atol(value.c_str()));
        if (name == "--weight-rounds") options.fit.weight_rounds = unsigned(std::atoi(value.c_str()));
        if (name == "--frames") options.frames = std::size_t(std::atol(value.c_str()));
        if (name == "--threads") options.threads = unsigned(std::atoi(value.c_str()));
        if (name == "--scan") options.scan = value;
        if (name == "--animation") options.animation = value;
        if (name == "--mesh") options.mesh = value;
        if (name == "--most-megabytes") options.most_megabytes = std::atof(value.c_str());
        if (name == "--write") options.folder = value;
        if (name == "--choice")
            for (const DriverChoice choice : {DriverChoice::rest, DriverChoice::motion})
                if (name_of(choice) == value) options.fit.choice = choice;
    }
    if (!options.animation.empty()) options.names.push_back(fs::path(options.animation).stem().string());
    if (options.names.empty()) options.names = {"flag", "rod", "crumple", "skin", "bulges", "fluid"};
    return options;
}

/// A scan that is bent, twisted and distorted.
MadeAnimation warped(Mesh mesh, std::size_t frames) {
    const Box box = world_bounds(mesh);
    return animate(mesh, frames, [=](std::size_t frame) {
        const double s = std::sin(std::numbers::pi * double(frame) / double(frames)) + 1e-4;
        const auto bend = make_bend(box, Axis::x, 100 * s), twist = make_twist(box, Axis::x, 90 * s);
        const auto random = make_smooth_random(box, 0.1 * s, 1);
        std::vector<Vec3d> moved;
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
            moved.push_back(random->position(twist->position(bend->position(mesh.world_position(v)))) - mesh.origin);
        return moved;
    });
}

std::optional<MadeAnimation> make(const std::string& name, const Options& options) {
    const std::size_t frames = options.frames;
    if (name == "flag") return flag(250, 166, frames);
    if (name == "rod") return rod_in_tube(160, 150, frames);
    if (name == "crumple") return crumple(240, 160, std::min<std::size_t>(frames, 30));
    if (name == "skin") return skinned(wavy_sphere(84), 18, frames);
    if (name == "bulges") return bulges(wavy_sphere(84), 24, frames);
    if (name == "fluid") return fluid(wavy_sphere(90), std::min<std::size_t>(frames, 30));
    if (options.scan.empty()) return std::nullopt;
    Mesh scan = read_mesh(options.scan).value().mesh;
    if (name == "scan-skin") return skinned(std::move(scan), 18, frames);
    if (name == "scan-bulges") return bulges(std::move(scan), 24, frames);
    if (name == "scan-warp") return warped(std::move(scan), frames);
    return std::nullopt;
}

double peak_megabytes() { return peak_bytes() / double(1 << 20); }

double kilobytes(const fs::path& path) { return double(fs::file_size(path)) / 1000; }

void write(const MadeAnimation& made, const std::string& name, const fs::path& folder) {
    fs::create_directories(folder);
    (void)write_mesh(*made.rest, folder / (name + ".obj")).value();
    (void)write_animation(made.animation, folder / (name + ".pc2")).value();
}

/// The mesh at rest: of --mesh, or of the glTF itself.
MadeAnimation open_file(const Options& options) {
    const std::string& rest = options.mesh.empty() ? options.animation : options.mesh;
    MadeAnimation made{std::make_shared<Mesh>(read_mesh(rest).value().mesh), {}};
    made.animation = open_animation(options.animation, *made.rest).value();
    return made;
}

void run(const std::string& name, const Options& options) {
    const bool is_file = !options.animation.empty() && name == options.names.back();
    const std::optional<MadeAnimation> made = is_file ? open_file(options) : make(name, options);
    if (!made) {
        std::printf("%-12s needs --scan MESH, or is not known\n", name.c_str());
        return;
    }
    if (!options.folder.empty()) return write(*made, name, options.folder);
    const fs::path folder = fs::temp_directory_path() / ("fit_table_" + std::to_string(::getpid()));
    fs::create_directories(folder);
    const fs::path cache = folder / "cache.pc2";
    (void)write_animation(made->animation, cache).value();
    const Mesh rest = *made->rest;
    const MeshAnimation animation = open_animation(cache, rest).value();
    const RunContext context(options.threads);
    const Spent begin = now();
    const Result<Fitted> fitted = fit_animation(animation, options.fit, context);
    const Spent end = now();
    if (fitted) {
        const FitReport& report = fitted->report;
        const fs::path packed = folder / "packed.fil", glb = folder / "skin.glb";
        const unsigned bits = options.fit.error < 9e-5 ? 16 : 14;
        const PackReport packing =
            pack_model(fitted->model, fitted->poses, {.bits = bits, .records = report.has_free_weights}, packed)
                .value();
        const double of_packed =
            animation_error(read_model(packed).value(), read_poses(packed).value(), animation, packing.vertex_order)
                .value()
                .rms /
            report.diagonal;
        (void)write_skin_glb(fitted->model, frames_of(fitted->poses), {.compress = true, .key_error = report.rms}, glb)
            .value();
        std::printf(
            "%-12s %8zu x %-4zu %-6s %6zu  %8.2e %8.2e  %5.2f %5.2f  %9.0f %8.0f %8.0f %8.2e  %5.0f  %2zu  %6.1f %6.1f "
            "%5.0f\n",
            name.c_str(), report.vertices, report.frames, std::string(name_of(report.choice)).c_str(),
            report.driver_vertices, report.rms, report.max, report.normal_mean_deg, report.normal_p95_deg,
            kilobytes(cache), kilobytes(glb), kilobytes(packed), of_packed, kilobytes(cache) / kilobytes(packed),
            report.tries, end.wall - begin.wall, end.processor - begin.processor, peak_megabytes());
    } else {
        std::printf("%-12s %s (%.1f s)\n", name.c_str(), fitted.error().message.c_str(), end.wall - begin.wall);
    }
    std::fflush(stdout);
    fs::remove_all(folder);
}

} // namespace

int main(int count, char** arguments) {
    const Options options = read_options(count, arguments);
    if (options.folder.empty())
        std::printf("%-12s %8s   %-4s %-6s %6s  %8s %8s  %5s %5s  %9s %8s %8s %8s  %5s  %2s  %6s %6s %5s\n",
                    "animation", "vertices", "fr.", "choice", "driver", "rms", "max", "n.avg", "n.p95", "PC2 kB",
                    "GLB kB", "packed", "its rms", "times", "#", "s", "cpu s", "MB");
    for (const std::string& name : options.names) run(name, options);
    if (options.most_megabytes > 0 && peak_megabytes() > options.most_megabytes) {
        std::printf("%.0f MB at most are above %.0f\n", peak_megabytes(), options.most_megabytes);
        return 1;
    }
}
