#include "commands.h"
#include "reference.h"
#include "session.h"
#include "spill.h"

#include "filigree/pose.h"

#include <filesystem>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

struct StripCommandOptions {
    std::string input, output, driver;
    StripOptions strip;
    bool with_reference_code = false;
    unsigned references = 3;
    std::string memory;
    std::optional<double> fidelity;
    PoseSource fidelity_from = PoseSource::positions;
};

struct StripSeconds {
    double read, strip, write;
};

/// A model under a mesh's name is a slip, and could be the end of the mesh.
void refuse_mesh_name(const std::string& path) {
    if (path != "-" && mesh_format(path_of(path)).ok())
        refuse(path + ": is the name of a mesh; give the model another, such as " + path_of(path).stem().string() +
               ".fil.");
}

/// Counts of what did not go as hoped: a row where there is any.
void report_doubts(const StripReport& strip, std::size_t vertices, Report& report) {
    const auto add = [&](const char* title, const char* key, std::size_t count, const char* note) {
        if (count > 0) report.row(title, with_commas(count) + note);
        report.set(key, count);
    };
    add("vertices at one place", "welded_vertices", strip.welded_vertices, "");
    add("forced collapses", "forced_collapses", strip.forced_collapses, " (small components and tunnels removed)");
    add("bound across gaps", "across_gap", strip.across_gap, " (vertices of parts that have no driver vertex)");
    // Few of them do no harm that can be seen.
    if (strip.facing_away * 100 > vertices)
        report.row("bound poorly",
                   fmt::format("{} vertices ({:.2g} %), in folds that the driver is too coarse for; a "
                               "larger --base leaves fewer",
                               with_commas(strip.facing_away), 100 * double(strip.facing_away) / double(vertices)));
    report.set("facing_away", strip.facing_away);
}

Report make_report(const Stripped& stripped, const std::string& output, const StripSeconds& seconds) {
    const Model& model = stripped.model;
    const StripReport& strip = stripped.report;
    const Level& driver = model.driver();
    Json levels = Json::array();
    for (const Level& level : model.levels) levels.push_back(level.vertices.size());

    Report report;
    report.set("output", output);
    report.count("vertices", "vertices", model.vertex_count());
    report.row("driver", fmt::format("{} vertices, {} faces", with_commas(driver.vertices.size()),
                                     with_commas(driver.face_count())));
    report.set("driver_vertices", driver.vertices.size());
    report.set("driver_faces", driver.face_count());
    report.add("levels", fmt::format("{} + the finest", model.levels.size()), "levels", levels);
    report_doubts(strip, model.vertex_count(), report);
    report.set("simplify_error", strip.simplify_error);
    report.set("simplify_error_units", strip.simplify_error * world_bounds(model.mesh).diagonal());
    report.add("seconds",
               fmt::format("{:.3f} read, {:.3f} simplify, {:.3f} bind, {:.3f} encode, {:.3f} write", seconds.read,
                           strip.simplify_seconds, strip.bind_seconds, strip.encode_seconds, seconds.write),
               "seconds",
               {{"read", seconds.read},
                {"simplify", strip.simplify_seconds},
                {"bind", strip.bind_seconds},
                {"encode", strip.encode_seconds},
                {"strip", seconds.strip},
                {"write", seconds.write}});
    return report;
}

void report_fidelity(const StrippedToFidelity& result, const StripCommandOptions& options, Report& report) {
    const char* from = options.fidelity_from == PoseSource::positions ? "positions" : "gradients";
    report.add(
        "fidelity", fmt::format("{:.2g} of the diagonal from {} ({} drivers tried)", result.error, from, result.tried),
        "fidelity", {{"error", result.error}, {"asked", *options.fidelity}, {"from", from}, {"tried", result.tried}});
}

/// Arrays beyond the memory that may be used go into a file beside the output.
void bound_memory(const StripCommandOptions& options) {
    const bool is_asked = !options.memory.empty();
    const std::uint64_t limit = is_asked ? parse_memory_size(options.memory) : memory_to_use();
    if (limit == 0) refuse("--memory: '" + options.memory + "' is not a size; give one such as 8G or 500M.");
    const std::filesystem::path folder = path_of(options.output).parent_path();
    spill_beyond(limit, folder);
    if (is_asked && !can_spill())
        refuse(ErrorCode::unwritable, options.output + ": no file can be made and mapped beside it for what exceeds " +
                                          options.memory + "; give no --memory, or write to another disk.");
}

void run(const StripCommandOptions& options, Session& session) {
    refuse_mesh_name(options.output);
    bound_memory(options);
    if (!options.fidelity && !session.first_given({"--fidelity-from"}).empty())
        refuse("--fidelity-from belongs to --fidelity.");
    if (options.with_reference_code) {
        ReferenceOptions reference{.references = options.references, .base = options.strip.base};
        if (options.strip.levels) reference.max_levels = *options.strip.levels;
        return strip_with_reference_code(options.input, options.output, reference, session);
    }
    const double start = now_seconds();
    Mesh mesh = session.read_mesh(options.input);
    const double read = now_seconds();
    StrippedToFidelity result;
    if (!options.driver.empty())
        result.stripped =
            require(strip_to_driver(std::move(mesh), session.read_mesh(options.driver), session.context()));
    else if (options.fidelity)
        result = require(
            strip_to_fidelity(mesh, options.strip, {*options.fidelity, options.fidelity_from}, session.context()));
    else
        result.stripped = require(strip(std::move(mesh), options.strip, session.context()));
    const double done = now_seconds();
    session.write_model(result.stripped.model, options.output);
    Report report = make_report(result.stripped, options.output, {read - start, done - read, now_seconds() - done});
    const std::uint64_t spilled = most_spilled();
    if (spilled > 0) report.row("beside the output", fmt::format("{} MiB that did not fit in memory", spilled >> 20));
    report.set("spilled_bytes", spilled);
    if (options.fidelity) report_fidelity(result, options, report);
    for (const std::string& warning : result.stripped.report.warnings) session.warn(warning);
    if (options.fidelity && result.error > *options.fidelity)
        session.warn(
            fmt::format("No driver restores to {:.2g} of the diagonal: with every vertex in it the error is {:.2g}, "
                        "the rounding of 32-bit numbers.",
                        *options.fidelity, result.error));
    session.print(report);
}

} // namespace

Command strip_command() {
    const auto options = std::make_shared<StripCommandOptions>();
    StripOptions& strip = options->strip;
    return {
        .name = "strip",
        .text = "Take the detail off a mesh: write a model with a light driver",
        .options =
            {Option("mesh", options->input, "Mesh to strip").is_read().required(),
             output_option(options->output, "Model file to write (.fil)"),
             Option("--base", strip.base, "Vertices of the driver (default: 1,000, fewer for small meshes)")
                 .whole_from(3)
                 .excludes({"--levels", "--error", "--fidelity"}),
             Option("--driver", options->driver, "Use this mesh as the driver: poses have its vertices, in their order")
                 .is_read()
                 .excludes({"--base", "--levels", "--error", "--fidelity", "--fidelity-from", "--max-edge", "--code",
                            "--references"}),
             Option("--levels", strip.levels,
                    "Number of levels below the finest; each has a quarter of the vertices of the next finer level")
                 .whole_from(1)
                 .excludes({"--error", "--fidelity"}),
             Option("--error", strip.error,
                    "Coarsest driver within this distance of the mesh (rms), fraction of the diagonal")
                 .above_zero()
                 .excludes({"--fidelity"}),
             Option("--fidelity", options->fidelity,
                    "Smallest driver that restores bends, twists, tapers and random deformations with this rms error "
                    "or less, fraction of the diagonal")
                 .above_zero(),
             choice<PoseSource>("--fidelity-from", options->fidelity_from,
                                {{"positions", PoseSource::positions}, {"gradients", PoseSource::gradients}},
                                "For --fidelity: poses have only positions (default), or gradients too"),
             Option(
                 "--max-edge", strip.max_edge,
                 "Longest edge that simplification makes, fraction of the diagonal; flat parts then keep more vertices")
                 .above_zero(),
             choice<bool>("--code", options->with_reference_code, {{"blend", false}, {"reference", true}},
                          "blend: for any mesh (default); reference: the method of the report Detail-Preserving "
                          "Animation, for regular quads"),
             Option("--reorder", strip.reorder,
                    "Renumber vertices so that neighbours lie together: a mesh in random order restores faster. "
                    "'restore --input-order' writes the old order")
                 .excludes({"--driver"}),
             Option("--memory", options->memory,
                    "Memory for arrays, such as 8G; further arrays go to a temporary file beside the output (default: "
                    "three quarters of the free memory)")
                 .named("SIZE"),
             Option("--references", options->references,
                    "Reference code: number of coarse points that a point refers to")
                 .one_of({"3", "4", "6"})
                 .with_default()},
        .examples = "  filigree strip scan.ply -o scan.fil\n"
                    "  filigree strip scan.ply -o scan.fil --base 5000\n"
                    "  filigree strip scan.ply -o scan.fil --fidelity 1e-5\n"
                    "  filigree strip scan.ply -o scan.fil --driver cage.obj\n"
                    "  filigree strip cube.obj -o cube.fil --code reference",
        .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
