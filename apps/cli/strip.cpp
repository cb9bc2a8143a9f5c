#include "session.h"

#include "filigree/hierarchy/strip.h"

#include <filesystem>

namespace filigree::cli {

namespace {

/// A model under a mesh's name is a slip, and could be the end of the mesh.
void refuse_mesh_name(const std::string& path) {
    if (path != "-" && mesh_format(path).ok())
        throw Failure{{ErrorCode::usage, path + ": is the name of a mesh; give the model another, such as " +
                                             std::filesystem::path(path).stem().string() + ".fil."}};
}

} // namespace

void add_strip(CLI::App& app, Session& session) {
    struct Options {
        std::string input, output;
        StripOptions strip;
    };
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("strip", "Take the detail off a mesh: make a model with a light driver");
    command->add_option("mesh", options->input, "Mesh to strip")->required();
    command->add_option("-o,--output", options->output, "Model file to write (.fil)")->required();
    StripOptions& strip_options = options->strip;
    auto* base =
        command
            ->add_option("--base", strip_options.base, "Vertices of the driver (unset: 1,000, fewer for small meshes)")
            ->check(whole_number(3));
    auto* levels =
        command->add_option("--levels", strip_options.levels, "Levels to remove, each leaves a quarter of the vertices")
            ->check(whole_number(1));
    auto* error = command
                      ->add_option("--error", strip_options.error,
                                   "How far the driver may leave the mesh (rms), fraction of the diagonal")
                      ->check(positive_number());
    base->excludes(levels)->excludes(error);
    levels->excludes(error);
    add_choice<DetailCode>(
        *command, "--code", {{"blend", DetailCode::blend}, {"reference", DetailCode::reference}},
        [options](DetailCode code) { options->strip.code = code; },
        "blend: any mesh (default); reference: the report's, for regular quads");
    add_choice<Precision>(
        *command, "--precision", {{"float", Precision::float32}, {"int16", Precision::int16}},
        [options](Precision precision) { options->strip.precision = precision; },
        "Of the blend code: float, 20 bytes a vertex (default), or int16, 10 bytes");
    command
        ->add_option("--references", strip_options.references,
                     "Of the reference code: coarse points that a point refers to")
        ->check(CLI::IsMember({3, 4, 6}))
        ->capture_default_str();
    session.add_common_options(*command, "  filigree strip scan.ply -o scan.fil\n"
                                         "  filigree strip scan.ply -o scan.fil --base 5000 --precision int16\n"
                                         "  filigree strip cube.obj -o cube.fil --code reference");
    command->callback([options, &session] {
        session.begin();
        refuse_mesh_name(options->output);
        const double start = now_seconds();
        Mesh mesh = session.read_mesh(options->input);
        const double read = now_seconds();
        const Stripped stripped = require(strip(std::move(mesh), options->strip, session.context()));
        const double stripped_at = now_seconds();
        session.write_model(stripped.model, options->output);
        const double write_seconds = now_seconds() - stripped_at;
        const Model& model = stripped.model;
        const StripReport& report = stripped.report;

        Table table;
        Json levels_json = Json::array();
        table.row("vertices", with_commas(model.mesh.vertex_count()));
        for (const Level& level : model.levels) levels_json.push_back(level.vertices.size());
        table.row("driver", fmt::format("{} vertices, {} faces", with_commas(model.driver().vertices.size()),
                                        with_commas(model.driver().face_count())));
        table.row("levels", fmt::format("{} + the finest", model.levels.size()));
        if (report.welded_vertices) table.row("vertices at one place", with_commas(report.welded_vertices));
        if (report.forced_collapses)
            table.row("forced collapses", with_commas(report.forced_collapses) + " (scraps and handles dropped)");
        if (report.across_gap)
            table.row("bound across gaps", with_commas(report.across_gap) + " (parts without a driver of their own)");
        if (report.facing_away) table.row("bound facing away", with_commas(report.facing_away));
        table.row("seconds",
                  fmt::format("{:.3f} read, {:.3f} simplify, {:.3f} bind, {:.3f} encode, {:.3f} write", read - start,
                              report.simplify_seconds, report.bind_seconds, report.encode_seconds, write_seconds));
        session.print(table.text(),
                      {{"output", options->output},
                       {"vertices", model.mesh.vertex_count()},
                       {"driver_vertices", model.driver().vertices.size()},
                       {"driver_faces", model.driver().face_count()},
                       {"levels", levels_json},
                       {"welded_vertices", report.welded_vertices},
                       {"forced_collapses", report.forced_collapses},
                       {"across_gap", report.across_gap},
                       {"facing_away", report.facing_away},
                       {"simplify_error", report.simplify_error},
                       {"simplify_error_units", report.simplify_error * world_bounds(model.mesh).diagonal()},
                       {"seconds",
                        {{"read", read - start},
                         {"simplify", report.simplify_seconds},
                         {"bind", report.bind_seconds},
                         {"encode", report.encode_seconds},
                         {"strip", stripped_at - read},
                         {"write", write_seconds}}}});
    });
}

} // namespace filigree::cli
