#include "coding_report.h"
#include "commands.h"
#include "session.h"

#include "filigree/io/model/model_file.h"
#include "filigree/io/system/file.h"
#include "filigree/pack.h"
#include "filigree/strip.h"

#include <fmt/format.h>

namespace filigree::cli {

namespace {

enum class Profile { compact, stream, lossless, runtime };

struct PackArguments {
    std::string input, output;
    std::optional<std::size_t> base;
    Profile profile = Profile::compact;
    PackOptions code;
};

std::uint64_t size_of(const std::string& path) {
    return std::filesystem::is_regular_file(path_of(path)) ? std::uint64_t(std::filesystem::file_size(path_of(path)))
                                                           : 0;
}

void report_coding(const Model& model, const PackReport& coding, const PackArguments& options, double seconds,
                   Report& report) {
    const double diagonal = world_bounds(model.mesh).diagonal();
    const double share = diagonal > 0 ? 1 / diagonal : 0;
    const std::uint64_t bytes = size_of(options.output);
    report.set("output", options.output);
    report.count("vertices", "vertices", model.vertex_count());
    report.count("driver", "driver_vertices", model.driver().vertices.size());
    add_coding_shares(coding.bytes, model.vertex_count(), bytes, report);
    report.add("vertex error",
               fmt::format("{:.2g} of the diagonal (rms), {:.2g} at most", coding.rms * share, coding.largest * share),
               "vertex_error", {{"rms", coding.rms * share}, {"max", coding.largest * share}});
    if (coding.has_records)
        report.add("weights",
                   fmt::format("points on the driver moved by {:.2g} of the diagonal (rms), {:.2g} at most",
                               coding.anchor_rms * share, coding.anchor_largest * share),
                   "anchor_error", {{"rms", coding.anchor_rms * share}, {"max", coding.anchor_largest * share}});
    report.count("bytes", "bytes", bytes);
    report.set("seconds", seconds);
}

/// Reads the file back, and says how far its surface is off.
void report_surface(const Model& model, const PackArguments& options, Session& session, Report& report) {
    if (model.mesh.face_count() == 0) return;
    const RunContext context = session.silent_context();
    const double start = now_seconds();
    const FileReader file = require(FileReader::open(path_of(options.output)));
    const Mesh read = require(read_model(file, options.output, context)).mesh;
    const double seconds = now_seconds() - start;
    add_stream_marks(require(read_model_outline(file, options.output, context)), report);
    constexpr std::size_t kSamples = 100'000;
    const MeshDistance distance = require(mesh_distance(read, model.mesh, kSamples, context));
    if (!distance.surfaces) return;
    report.add("surface error",
               fmt::format("{:.2g} of the diagonal (rms)", distance.relative(distance.surfaces->rms_distance)),
               "surface_error",
               {{"rms", distance.relative(distance.surfaces->rms_distance)},
                {"hausdorff", distance.relative(distance.surfaces->hausdorff)}});
    report.add("reads in", seconds_text(seconds), "read_seconds", seconds);
}

/// A model as it is, a mesh stripped.
Model model_of(const PackArguments& options, Session& session, PoseSequence& poses) {
    const FileReader file = session.open(options.input);
    if (is_model_file(file)) {
        if (options.base) refuse("--base is for meshes: the model has its driver.");
        return session.read_model(file, options.input, &poses);
    }
    Mesh mesh = session.parse_mesh(require(file.read_all()), options.input);
    return require(strip(std::move(mesh), {.base = options.base}, session.context())).model;
}

/// Codes the model bit for bit, reads it back, and says how much smaller it became.
void pack_lossless(const Model& model, const PoseSequence& poses, const PackArguments& options, Session& session) {
    const double start = now_seconds();
    const LosslessPackReport coding =
        require(pack_model_lossless(model, poses, path_of(options.output), session.context()));
    const double seconds = now_seconds() - start;
    const std::uint64_t bytes = size_of(options.output);
    Report report;
    report.set("output", options.output);
    report.count("vertices", "vertices", model.vertex_count());
    report.count("driver", "driver_vertices", model.driver().vertices.size());
    add_coding_shares(coding.bytes, model.vertex_count(), bytes, report);
    report.count("bytes", "bytes", bytes);
    report.set("seconds", seconds);
    if (options.output == "-") return session.print(report);
    const RunContext context = session.silent_context();
    const double read_start = now_seconds();
    const FileReader file = require(FileReader::open(path_of(options.output)));
    require(read_model(file, options.output, context)); // held against the plain sections' checksums
    require(read_poses(file, options.output, context));
    const double read_seconds = now_seconds() - read_start;
    report.add("plain model",
               fmt::format("{} bytes, {:.2f} times as many; every number came back", with_commas(coding.plain),
                           double(coding.plain) / double(std::max<std::uint64_t>(bytes, 1))),
               "plain_bytes", coding.plain);
    report.add("reads in", seconds_text(read_seconds), "read_seconds", read_seconds);
    session.print(report);
}

void run(PackArguments options, Session& session) {
    if (mesh_format(path_of(options.output)).ok())
        refuse(options.output + ": is the name of a mesh; give the model another, such as NAME.fil.");
    if (options.profile == Profile::runtime && (options.code.surface || options.code.keep_order))
        refuse("--surface and --keep-order are for --profile compact and stream.");
    options.code.levels = options.profile == Profile::stream;
    options.code.records = options.profile == Profile::runtime;
    if (options.profile == Profile::lossless && options.code != PackOptions())
        refuse("--bits, --surface and --keep-order are for what rounds; --profile lossless keeps every number and "
               "their order.");
    PoseSequence poses;
    const Model model = model_of(options, session, poses);
    session.begin_writing(options.output);
    if (options.profile == Profile::lossless) return pack_lossless(model, poses, options, session);
    const double start = now_seconds();
    const PackReport coding =
        require(pack_model(model, poses, options.code, path_of(options.output), session.context()));
    Report report;
    report_coding(model, coding, options, now_seconds() - start, report);
    if (coding.has_records && !options.code.records)
        session.warn("The weights of the model were fitted; it is packed with --profile runtime, which keeps them.");
    if (coding.loses_weights)
        session.warn("The weights of the model were fitted, and this profile binds vertices anew: poses lose the fit. "
                     "--profile runtime keeps the weights.");
    if (coding.lacks_level_attributes) session.warn(kLevelsLackAttributes);
    if (coding.out_of_reach > 0)
        session.warn(fmt::format("{} unused {} too far from the mesh to be packed there, and {} back nearer; --profile "
                                 "lossless keeps every place.",
                                 with_commas(coding.out_of_reach),
                                 coding.out_of_reach == 1 ? "vertex lies" : "vertices lie",
                                 coding.out_of_reach == 1 ? "comes" : "come"));
    if (options.output != "-") report_surface(model, options, session, report);
    session.print(report);
}

struct UnpackArguments {
    std::string input, output;
    std::optional<std::size_t> bytes;
};

/// The mesh that the first bytes of a stream give.
void unpack_beginning(const UnpackArguments& options, Session& session) {
    const FileReader file = session.open(options.input);
    std::string beginning(std::min<std::uint64_t>(*options.bytes, file.size()), '\0');
    require(file.read(0, beginning));
    ModelStream stream(options.input);
    require(stream.feed(beginning));
    if (stream.level_count() == 0)
        refuse(ErrorCode::unsuitable,
               fmt::format("{}: its first {} bytes hold no level yet{}.", options.input, with_commas(beginning.size()),
                           stream.next_level_end() > 0
                               ? fmt::format("; the first is whole at {}", with_commas(stream.next_level_end()))
                               : std::string()));
    const Mesh mesh = stream.mesh();
    session.begin_writing(options.output);
    session.write_mesh(mesh, options.output);
    const double diagonal = world_bounds(mesh).diagonal();
    Report report;
    report.say(fmt::format("{}: {} vertices, off by {:.2g} of the diagonal (rms)\n", options.output,
                           with_commas(mesh.vertex_count()), stream.error() / diagonal));
    report.set("output", options.output);
    report.set("vertices", mesh.vertex_count());
    report.set("levels", stream.level_count());
    report.set("error", stream.error() / diagonal);
    report.set("next_level_bytes", stream.next_level_end());
    session.print(report);
}

void run_unpack(const UnpackArguments& options, Session& session) {
    if (options.bytes) return unpack_beginning(options, session);
    PoseSequence poses;
    const Model model = session.read_model(session.open_model(options.input), options.input, &poses);
    session.begin_writing(options.output);
    const Status written = write_model(model, poses, path_of(options.output), session.context());
    if (!written) throw Failure{written.error()};
    Report report;
    report.say(fmt::format("{}: {} vertices, a driver of {}\n", options.output, with_commas(model.vertex_count()),
                           with_commas(model.driver().vertices.size())));
    report.set("output", options.output);
    report.set("vertices", model.vertex_count());
    report.set("driver_vertices", model.driver().vertices.size());
    session.print(report);
}

} // namespace

Command pack_command() {
    const auto options = std::make_shared<PackArguments>();
    return {
        .name = "pack",
        .text = "Pack a mesh or a model into few bytes: a model file that every command reads",
        .options = {Option("input", options->input, "Mesh or model").is_read().required(),
                    output_option(options->output, "Model file to write (.fil)"),
                    choice<Profile>(
                        "--profile", options->profile,
                        {{"compact", Profile::compact},
                         {"stream", Profile::stream},
                         {"runtime", Profile::runtime},
                         {"lossless", Profile::lossless}},
                        "compact (default): the smallest file; stream: coarse to fine, so that the first bytes show "
                        "the whole shape; runtime: for the C runtime and the npm package, opens at once; lossless: "
                        "keeps every number"),
                    Option("--bits", options->code.bits, "Bits of a position, along the longest side of the box")
                        .between(10, 16)
                        .with_default(),
                    Option("--surface", options->code.surface,
                           "Keep the surface, not the vertices: vertices may slide along it four times as far"),
                    Option("--keep-order", options->code.keep_order,
                           "Keep the order of vertices and faces; the file is then 2 to 5 times as large"),
                    Option("--base", options->base, "For a mesh: vertices of the driver (default: as for strip)")
                        .whole_from(3)},
        .examples = "  filigree pack scan.ply -o scan.fil\n"
                    "  filigree pack scan.fil -o small.fil --bits 12 --surface\n"
                    "  filigree pack shot.fil -o small.fil --keep-order\n"
                    "  filigree pack scan.ply -o scan.fil --profile stream\n"
                    "  filigree pack shot.fil -o shot-small.fil --profile lossless",
        .run = [options](Session& session) { run(*options, session); }};
}

Command unpack_command() {
    const auto options = std::make_shared<UnpackArguments>();
    return {.name = "unpack",
            .text = "Write a packed model as a plain model, which is read faster",
            .options = {Option("model", options->input, "Packed model").is_read().required(),
                        output_option(options->output, "Model file to write (.fil), or a mesh with --bytes"),
                        Option("--bytes", options->bytes,
                               "Write the mesh that the first N bytes of a stream give; the file may end there")},
            .examples = "  filigree unpack small.fil -o plain.fil\n"
                        "  filigree unpack stream.fil -o early.ply --bytes 20000",
            .run = [options](Session& session) { run_unpack(*options, session); }};
}

} // namespace filigree::cli
