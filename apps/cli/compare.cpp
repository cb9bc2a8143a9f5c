#include "commands.h"
#include "drawing.h"

#include <cmath>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

struct CompareArguments {
    std::string a, b, picture;
    std::optional<UpAxis> up;
    std::size_t samples = 100'000;
};

/// The distances: fractions of the diagonal under a key, model units under the key with "_units".
void report_distances(const MeshDistance& distance, Report& report) {
    const auto add = [&](const std::string& key, const char* title, double units) {
        report.add(title, distance_text(distance, units), key, distance.relative(units));
        report.set(key + "_units", units);
    };
    const auto add_angle = [&](const char* key, const char* title, double degrees) {
        report.add(title, fmt::format("{:.3g} degrees", degrees), key, degrees);
    };
    if (const auto& v = distance.vertices) {
        add("rms", "rms, vertex to vertex", v->rms);
        add("max", "max, vertex to vertex", v->max);
        if (v->max_vertex != kNoIndex) report.set("max_vertex", v->max_vertex);
        add_angle("normal_mean_deg", "normals, mean", v->normal_mean_deg);
        add_angle("normal_p95_deg", "normals, 95 %", v->normal_p95_deg);
    }
    if (const auto& s = distance.surfaces) {
        add("hausdorff", "Hausdorff distance", s->hausdorff);
        add("mean_distance", "mean surface distance", s->mean_distance);
        add("rms_a_to_b", "rms, first to second", s->rms_a_to_b);
        add("max_a_to_b", "max, first to second", s->max_a_to_b);
        add("rms_b_to_a", "rms, second to first", s->rms_b_to_a);
        add("max_b_to_a", "max, second to first", s->max_b_to_a);
    }
}

void run(const CompareArguments& options, Session& session) {
    if (!options.picture.empty()) check_picture_path(options.picture);
    const Mesh a = session.read_mesh(options.a), b = session.read_mesh(options.b);
    const MeshDistance distance = require(mesh_distance(a, b, options.samples, session.context()));
    if (!distance.vertices)
        session.warn(fmt::format("The meshes have {} and {} vertices, so only their surfaces are compared.",
                                 with_commas(a.vertex_count()), with_commas(b.vertex_count())));
    Report report;
    report.set("a", options.a);
    report.set("b", options.b);
    report.set("diagonal_units", distance.diagonal);
    report_distances(distance, report);
    if (!options.picture.empty()) {
        const UpAxis up = up_of(options.up, a, options.a);
        draw_distances(a, b, {file_name(options.a), file_name(options.b)}, distance, up, options.picture, session);
        report.row("picture", options.picture);
        report_picture(options.picture, up, report);
    }
    session.print(report);
}

} // namespace

Command compare_command() {
    const auto options = std::make_shared<CompareArguments>();
    return {
        .name = "compare",
        .text = "Measure how far one mesh is from another",
        .options = {Option("a", options->a, "Mesh").is_read().required(),
                    Option("b", options->b, "Mesh to compare with; relative distances are fractions of its diagonal")
                        .is_read()
                        .required(),
                    Option("--samples", options->samples, "Sample points on each surface, in addition to the vertices")
                        .whole_from(0)
                        .with_default(),
                    Option("--picture", options->picture,
                           "Also draw the first mesh, coloured by its distance from the second (.png, .svg, .pdf)")
                        .is_written(),
                    found_up_option(options->up)},
        .examples = "  filigree compare restored.ply full.ply\n"
                    "  filigree compare restored.ply full.ply --picture heat.png\n"
                    "  filigree compare driver.ply scan.ply --json",
        .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
