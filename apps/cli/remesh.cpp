#include "commands.h"
#include "drawing.h"
#include "session.h"

#include "filigree/remesh.h"

#include <fmt/format.h>

namespace filigree::cli {

namespace {

constexpr double kShownSeconds = 0.005; // phases that would be written as 0.00 are left out

struct RemeshArguments {
    std::string input, output, base, picture;
    QuadRemeshOptions remesh;
    bool no_attributes = false;
    View view = View::iso;
    std::optional<UpAxis> up;
};

/// A count of a report: its key in JSON, and what it counts, said after the number.
struct Counted {
    const char* key;
    std::size_t count;
    const char* text;
};

std::vector<Counted> clean_counts(const CleanReport& clean) {
    return {{"welded_vertices", clean.welded_vertices, "vertices at one place"},
            {"unused_vertices", clean.unused_vertices, "unused vertices"},
            {"degenerate_faces", clean.degenerate_faces, "degenerate faces"},
            {"duplicate_faces", clean.duplicate_faces, "duplicate faces"},
            {"flipped_faces", clean.flipped_faces, "faces turned"},
            {"cut_edges", clean.cut_edges, "edges cut"},
            {"separated_edges", clean.separated_edges, "edges where bodies touched came apart"},
            {"split_vertices", clean.split_vertices, "vertices split"},
            {"removed_components", clean.removed_components, "small components removed"},
            {"closed_handles", clean.closed_handles, "small handles closed"},
            {"filled_triangles", clean.filled_triangles, "triangles filled in"}};
}

Json clean_json(const CleanReport& clean) {
    Json json = Json::object();
    for (const Counted& counted : clean_counts(clean)) json[counted.key] = counted.count;
    json["removed_area"] = clean.removed_area;
    return json;
}

/// What was changed, one line each; nothing for a mesh that was clean.
void report_clean(const CleanReport& clean, Report& report) {
    const char* title = "cleaned";
    for (const Counted& counted : clean_counts(clean)) {
        if (counted.count == 0) continue;
        report.row(title, with_commas(counted.count) + " " + counted.text);
        title = "";
    }
    report.set("clean", clean_json(clean));
}

std::string topology_text(const SurfaceTopology& t) {
    std::string text = fmt::format("{} component{}, Euler number {}, {} handle{}", with_commas(t.components),
                                   t.components == 1 ? "" : "s", t.euler, t.genus(), t.genus() == 1 ? "" : "s");
    if (t.border_loops == 0) return text + ", closed";
    return text + fmt::format(", {} open border{} ({} edges)", with_commas(t.border_loops),
                              t.border_loops == 1 ? "" : "s", with_commas(t.border_edges));
}

Json topology_json(const SurfaceTopology& t) {
    return {{"components", t.components},
            {"border_edges", t.border_edges},
            {"border_loops", t.border_loops},
            {"euler", t.euler},
            {"handles", t.genus()}};
}

std::string deviation_text(const Deviation& deviation, double diagonal) {
    return fmt::format("rms {:.2e}, max {:.2e} of the diagonal ({:.3g} and {:.3g} units)", deviation.rms, deviation.max,
                       deviation.rms * diagonal, deviation.max * diagonal);
}

Json deviation_json(const Deviation& deviation, double diagonal) {
    return {{"rms", deviation.rms},
            {"max", deviation.max},
            {"rms_units", deviation.rms * diagonal},
            {"max_units", deviation.max * diagonal}};
}

/// Seconds of the whole run, and of reading and writing.
struct RunSeconds {
    double read, remesh, write;
};

void report_quality(const QuadRemeshed& result, Report& report) {
    const QuadQuality& quality = result.report.quality;
    const double per_patch =
        double(quality.irregular_vertices) / double(std::max<std::size_t>(1, result.report.patches));
    report.add("irregular vertices",
               fmt::format("{}, {:.2f} a patch", with_commas(quality.irregular_vertices), per_patch),
               "irregular_vertices", quality.irregular_vertices);
    report.set("irregular_per_patch", per_patch);
    report.add("scaled Jacobian",
               fmt::format("{:.3f} at least, {:.3f} for 99 %, {:.3f} on average", quality.min_scaled_jacobian,
                           quality.low_scaled_jacobian, quality.mean_scaled_jacobian),
               "scaled_jacobian",
               {{"min", quality.min_scaled_jacobian},
                {"percentile_1", quality.low_scaled_jacobian},
                {"mean", quality.mean_scaled_jacobian}});
    report.set("inverted", quality.inverted);
}

void report_seconds(const QuadRemeshReport& remesh, const RunSeconds& run, Report& report) {
    Json phases = Json::object();
    std::vector<std::string> shown;
    for (const PhaseSeconds& phase : remesh.seconds) {
        phases[phase.phase] = phase.seconds;
        if (phase.seconds >= kShownSeconds) shown.push_back(fmt::format("{:.2f} {}", phase.seconds, phase.phase));
    }
    report.add("seconds", fmt::format("{:.2f}, and {:.2f} read, {:.2f} write", run.remesh, run.read, run.write),
               "seconds", {{"read", run.read}, {"remesh", run.remesh}, {"write", run.write}, {"phases", phases}});
    if (!shown.empty()) report.row("", fmt::format("{}", fmt::join(shown, ", ")));
}

void report_remesh(const QuadRemeshed& result, const RunSeconds& run, Report& report) {
    const QuadRemeshReport& remesh = result.report;
    const std::size_t side = std::size_t{1} << remesh.levels;
    report.add("quads",
               fmt::format("{} over {} vertices", with_commas(result.mesh.face_count()),
                           with_commas(result.mesh.vertex_count())),
               "quads", result.mesh.face_count());
    report.set("vertices", result.mesh.vertex_count());
    report.add("patches",
               fmt::format("{} of {} x {} quads ({} level{})", with_commas(remesh.patches), side, side, remesh.levels,
                           remesh.levels == 1 ? "" : "s"),
               "patches", remesh.patches);
    report.set("levels", remesh.levels);
    report_quality(result, report);
    report.set("diagonal_units", remesh.diagonal);
    report.add("quads to input", deviation_text(remesh.to_input, remesh.diagonal), "to_input",
               deviation_json(remesh.to_input, remesh.diagonal));
    report.add("input to quads", deviation_text(remesh.from_input, remesh.diagonal), "from_input",
               deviation_json(remesh.from_input, remesh.diagonal));
    report.set("max_distance", remesh.max_distance);
    report.set("max_distance_from_input", remesh.max_distance_from_input);
    report_clean(remesh.clean, report);
    if (remesh.wrapped) report.row("wrapped", "the quads are those of a closed wrap around the input");
    report.row("input, cleaned", topology_text(remesh.input));
    report.row("output", topology_text(remesh.output));
    report.set("topology", {{"input", topology_json(remesh.input)}, {"output", topology_json(remesh.output)}});
    if (remesh.feature_edges) report.row("feature edges", with_commas(remesh.feature_edges));
    report.set("feature_edges", remesh.feature_edges);
    report.set("wrapped", remesh.wrapped);
    if (remesh.tries > 1) report.row("tries", fmt::format("{}; the last but one: {}", remesh.tries, remesh.retried));
    report.set("tries", remesh.tries);
    report.set("retried", remesh.retried);
    report_seconds(remesh, run, report);
}

/// Before any work: what cannot be written.
void check_outputs(const RemeshArguments& options) {
    if (options.output != "-") require(mesh_format(path_of(options.output)));
    check_second_output("--base", options.base, options.output);
    if (!options.picture.empty()) check_png_path(options.picture);
}

void run(RemeshArguments options, Session& session) {
    check_outputs(options);
    const double start = now_seconds();
    const Mesh mesh = session.read_mesh(options.input);
    const double read = now_seconds();
    options.remesh.attributes = !options.no_attributes;
    const QuadRemeshed result = require(quad_remesh(mesh, options.remesh, session.context()));
    const double remeshed = now_seconds();
    session.write_mesh(result.mesh, options.output, options.input);
    if (!options.base.empty()) session.write_mesh(base_mesh(result), options.base);
    const double written = now_seconds();
    const UpAxis up = up_of(options.up, mesh, options.input);
    if (!options.picture.empty()) draw_quads(result, options.view, up, options.picture, session);

    Report report;
    report.set("output", options.output);
    if (!options.base.empty()) report.set("base", options.base);
    if (!options.picture.empty()) report_picture(options.picture, up, report);
    report_remesh(result, {read - start, remeshed - read, written - remeshed}, report);
    session.print(report);
}

OptionList remesh_options(QuadRemeshOptions& remesh) {
    return {Option("--quads", remesh.quads, "Approximate number of quads").whole_from(1).with_default(),
            Option("--levels", remesh.levels,
                   "Number of times that each patch is halved, 1 to 8 (default: as many as leave 500 patches or more)")
                .between(1, 8),
            Option("--feature-angle", remesh.feature_angle_deg,
                   "Edges whose faces meet at more than this angle stay sharp, degrees; 180: none")
                .between(0.0, 180.0)
                .with_default(),
            choice<SmallParts>("--small-parts", remesh.small_parts,
                               {{"remove", SmallParts::remove}, {"keep", SmallParts::keep}},
                               "Tunnels and components too small for the patches: remove (default) or keep"),
            choice<WrapUse>("--wrap", remesh.wrap,
                            {{"auto", WrapUse::automatic}, {"never", WrapUse::never}, {"always", WrapUse::always}},
                            "Remesh a closed wrap around the mesh, not the mesh itself: auto (default: only if nothing "
                            "else works), never or always"),
            Option("--max-distance", remesh.max_distance,
                   "Largest distance allowed in both directions, fraction of the diagonal (default: the side of a "
                   "patch; from mesh to quads at most 6e-3 for 20,000 quads and more)")
                .above_zero()};
}

} // namespace

Command remesh_command() {
    const auto options = std::make_shared<RemeshArguments>();
    return {
        .name = "remesh",
        .text = "Turn any mesh into quads, in patches of a regular grid",
        .options =
            OptionList{Option("mesh", options->input, "Mesh").is_read().required(),
                       output_option(options->output, "Mesh file to write")} +
            remesh_options(options->remesh) +
            OptionList{
                Option("--no-attributes", options->no_attributes, "Do not carry over UVs, colours, normals and labels"),
                Option("--base", options->base, "Also write a mesh with one quad for each patch").is_written(),
                Option("--picture", options->picture, "Also draw the quads, with a colour for each patch (.png)")
                    .is_written(),
                view_option(options->view, "View direction of the picture (default: iso)"),
                found_up_option(options->up)},
        .examples = "  filigree remesh scan.ply -o quads.ply\n"
                    "  filigree remesh scan.ply -o quads.obj --quads 20000 --picture quads.png\n"
                    "  filigree remesh part.stl -o quads.ply --feature-angle 30 --levels 3\n"
                    "  filigree remesh scan.ply -o quads.ply && "
                    "filigree strip quads.ply -o quads.fil --code reference",
        .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
