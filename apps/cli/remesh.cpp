#include "patch_drawing.h"
#include "session.h"
#include "stage.h"

#include "filigree/remesh/quad_remesh.h"

#include <filesystem>

namespace filigree::cli {

namespace {

constexpr double kShownSeconds = 0.005; // phases that would be written as 0.00 are left out

struct Options {
    std::string input, output, base, picture;
    QuadRemeshOptions remesh;
    View view = View::iso;
    UpAxis up = UpAxis::y;
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

/// What was changed, one line each; nothing for a mesh that was clean.
void add_clean_rows(const CleanReport& clean, Table& table) {
    const char* title = "cleaned";
    for (const Counted& counted : clean_counts(clean)) {
        if (counted.count == 0) continue;
        table.row(title, with_commas(counted.count) + " " + counted.text);
        title = "";
    }
}

Json clean_json(const CleanReport& clean) {
    Json json = Json::object();
    for (const Counted& counted : clean_counts(clean)) json[counted.key] = counted.count;
    json["removed_area"] = clean.removed_area;
    return json;
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

Table report_table(const QuadRemeshed& result, const RunSeconds& run) {
    const QuadRemeshReport& report = result.report;
    const QuadQuality& quality = report.quality;
    const std::size_t side = std::size_t{1} << report.levels;
    Table table;
    table.row("quads", fmt::format("{} over {} vertices", with_commas(result.mesh.face_count()),
                                   with_commas(result.mesh.vertex_count())));
    table.row("patches", fmt::format("{} of {} x {} quads ({} level{})", with_commas(report.patches), side, side,
                                     report.levels, report.levels == 1 ? "" : "s"));
    table.row("irregular vertices",
              fmt::format("{}, {:.2f} a patch", with_commas(quality.irregular_vertices),
                          double(quality.irregular_vertices) / double(std::max<std::size_t>(1, report.patches))));
    table.row("scaled Jacobian",
              fmt::format("{:.3f} at least, {:.3f} for 99 %, {:.3f} on average", quality.min_scaled_jacobian,
                          quality.low_scaled_jacobian, quality.mean_scaled_jacobian));
    table.row("quads to input", deviation_text(report.to_input, report.diagonal));
    table.row("input to quads", deviation_text(report.from_input, report.diagonal));
    add_clean_rows(report.clean, table);
    if (report.wrapped) table.row("wrapped", "the quads are those of a closed wrap around the input");
    table.row("input, cleaned", topology_text(report.input));
    table.row("output", topology_text(report.output));
    if (report.feature_edges) table.row("feature edges", with_commas(report.feature_edges));
    if (report.tries > 1) table.row("tries", fmt::format("{}; the last but one: {}", report.tries, report.retried));
    table.row("seconds", fmt::format("{:.2f}, and {:.2f} read, {:.2f} write", run.remesh, run.read, run.write));
    std::vector<std::string> phases;
    for (const PhaseSeconds& phase : report.seconds)
        if (phase.seconds >= kShownSeconds) phases.push_back(fmt::format("{:.2f} {}", phase.seconds, phase.phase));
    if (!phases.empty()) table.row("", fmt::format("{}", fmt::join(phases, ", ")));
    return table;
}

Json report_json(const QuadRemeshed& result, const RunSeconds& run) {
    const QuadRemeshReport& report = result.report;
    const QuadQuality& quality = report.quality;
    Json phases = Json::object();
    for (const PhaseSeconds& phase : report.seconds) phases[phase.phase] = phase.seconds;
    return {
        {"quads", result.mesh.face_count()},
        {"vertices", result.mesh.vertex_count()},
        {"patches", report.patches},
        {"levels", report.levels},
        {"irregular_vertices", quality.irregular_vertices},
        {"irregular_per_patch", double(quality.irregular_vertices) / double(std::max<std::size_t>(1, report.patches))},
        {"scaled_jacobian",
         {{"min", quality.min_scaled_jacobian},
          {"percentile_1", quality.low_scaled_jacobian},
          {"mean", quality.mean_scaled_jacobian}}},
        {"inverted", quality.inverted},
        {"diagonal_units", report.diagonal},
        {"to_input", deviation_json(report.to_input, report.diagonal)},
        {"from_input", deviation_json(report.from_input, report.diagonal)},
        {"max_distance", report.max_distance},
        {"clean", clean_json(report.clean)},
        {"topology", {{"input", topology_json(report.input)}, {"output", topology_json(report.output)}}},
        {"feature_edges", report.feature_edges},
        {"wrapped", report.wrapped},
        {"tries", report.tries},
        {"retried", report.retried},
        {"seconds", {{"read", run.read}, {"remesh", run.remesh}, {"write", run.write}, {"phases", phases}}}};
}

void draw_patches(const QuadRemeshed& result, const Options& options, Session& session) {
    const RunContext& context = session.context();
    Stage stage(session);
    const PatchDrawing drawing(result.mesh, result.patches, 0.8f, context);
    Scene scene;
    drawing.add_to(scene);
    scene.up = options.up;
    const CameraPoints all{result.mesh.positions, result.mesh.origin};
    const Camera camera =
        fit_camera(std::span(&all, 1), view_direction(options.view, options.up), up_vector(options.up), 4.0 / 3);
    session.begin_writing(options.picture);
    write_picture(stage.take(scene, camera, {.width = 1600, .height = 1200}), options.picture, session);
}

/// Before any work: what cannot be written.
void check_outputs(const Options& options) {
    if (options.output != "-") require(mesh_format(options.output));
    check_second_output("--base", options.base, options.output);
    if (options.picture.empty()) return;
    if (lower_ending(options.picture) != ".png")
        throw Failure{{ErrorCode::unsupported, options.picture + ": the picture is a PNG; let its name end in .png."}};
    check_picture_path(options.picture);
}

/// Formats that hold triangles only lose what the command is for.
void warn_of_triangles(const std::string& path, Session& session) {
    if (path == "-") return;
    const MeshFormat format = require(mesh_format(path));
    if (format == MeshFormat::stl || format == MeshFormat::gltf)
        session.warn(path + ": holds triangles only, so each quad is split in two; write .ply or .obj to keep quads.");
}

void run_remesh(const Options& options, Session& session) {
    check_outputs(options);
    const double start = now_seconds();
    const Mesh mesh = session.read_mesh(options.input);
    const double read = now_seconds();
    const QuadRemeshed result = require(quad_remesh(mesh, options.remesh, session.context()));
    const double remeshed = now_seconds();
    warn_of_triangles(options.output, session);
    session.write_mesh(result.mesh, options.output, options.input);
    if (!options.base.empty()) session.write_mesh(base_mesh(result), options.base);
    const double written = now_seconds();
    if (!options.picture.empty()) draw_patches(result, options, session);

    const RunSeconds seconds{read - start, remeshed - read, written - remeshed};
    Json json = {{"output", options.output}};
    if (!options.base.empty()) json["base"] = options.base;
    if (!options.picture.empty()) json["picture"] = options.picture;
    json.update(report_json(result, seconds));
    session.print(report_table(result, seconds).text(), json);
}

void add_remesh_options(CLI::App& command, const std::shared_ptr<Options>& options) {
    QuadRemeshOptions& remesh = options->remesh;
    command.add_option("--quads", remesh.quads, "About how many")->check(whole_number(1))->capture_default_str();
    command
        .add_option("--levels", remesh.levels,
                    "How often each patch is halved, 1 to 8 (unset: as leaves 500 patches or more)")
        ->check(CLI::Range(1, 8));
    command
        .add_option("--feature-angle", remesh.feature_angle_deg,
                    "Edges whose faces meet at more than this stay edges, degrees; 180: none")
        ->check(CLI::Range(0.0, 180.0))
        ->capture_default_str();
    add_choice<SmallParts>(
        command, "--small-parts", {{"remove", SmallParts::remove}, {"keep", SmallParts::keep}},
        [options](SmallParts parts) { options->remesh.small_parts = parts; },
        "Handles and components too small for the patches: remove (unset) or keep");
    add_choice<WrapUse>(
        command, "--wrap", {{"auto", WrapUse::automatic}, {"never", WrapUse::never}, {"always", WrapUse::always}},
        [options](WrapUse wrap) { options->remesh.wrap = wrap; },
        "A closed wrap around the mesh instead of itself: where nothing else works (unset: auto), never or always");
    command
        .add_option("--max-distance", remesh.max_distance,
                    "What both distances may reach, fraction of the diagonal (unset: a patch's side)")
        ->check(positive_number());
    command.add_flag("!--no-attributes", remesh.attributes, "Leave UVs, colours, normals and labels behind");
}

} // namespace

void add_remesh(CLI::App& app, Session& session) {
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("remesh", "Turn any mesh into quads: patches of a regular grid");
    command->add_option("mesh", options->input, "Mesh")->required();
    command->add_option("-o,--output", options->output, "Quads to write")->required();
    add_remesh_options(*command, options);
    command->add_option("--base", options->base, "Also write the patches' corners as a mesh, a quad each");
    command->add_option("--picture", options->picture, "Also draw the quads, their patches in colour (.png)");
    add_choice<View>(
        *command, "--view", {{"front", View::front}, {"side", View::side}, {"top", View::top}, {"iso", View::iso}},
        [options](View view) { options->view = view; }, "Where to look from in the picture (unset: iso)");
    add_choice<UpAxis>(
        *command, "--up", {{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}},
        [options](UpAxis up) { options->up = up; }, "Which axis is up in the picture (unset: y)");
    session.add_common_options(*command, "  filigree remesh scan.ply -o quads.ply\n"
                                         "  filigree remesh scan.ply -o quads.obj --quads 20000 --picture quads.png\n"
                                         "  filigree remesh part.stl -o quads.ply --feature-angle 30 --levels 3\n"
                                         "  filigree remesh scan.ply -o quads.ply && "
                                         "filigree strip quads.ply -o quads.fil --code reference");
    command->callback([options, &session] {
        session.begin();
        run_remesh(*options, session);
    });
}

} // namespace filigree::cli
