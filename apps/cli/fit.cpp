#include "animation_output.h"
#include "commands.h"
#include "moving_input.h"
#include "web_page.h"

#include "filigree/fit.h"
#include "filigree/fit/packed_error.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/system/extension.h"
#include "filigree/pack.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

/// How a .fil is written.
enum class FitProfile { plain, compact, stream, runtime, lossless };

struct FitArguments {
    std::string input, mesh;
    std::vector<std::string> outputs;
    FitOptions fit;
    std::size_t rest = 0; ///< frame from 1; 0: not given
    bool web = false;
    FitProfile profile = FitProfile::plain;
    std::optional<unsigned> bits;
    bool keep_order = false;
    PoseFileOptions pose_file;
    AnimationOutput animation;

    bool bound_weights = false, free_weights = false;

    bool rounds() const {
        return profile == FitProfile::compact || profile == FitProfile::stream || profile == FitProfile::runtime;
    }
    /// Rounds in which weights move: none where a packed file would lose them, or be larger by them as it often is.
    unsigned weight_rounds() const {
        constexpr unsigned kRounds = 3;
        const bool packs_none = profile == FitProfile::compact || profile == FitProfile::stream;
        return bound_weights || (packs_none && !free_weights) ? 0 : kRounds;
    }
};

bool is_fil_path(const std::string& path) { return lower_extension(path_of(path)) == ".fil"; }
bool is_page(const std::string& path, const FitArguments& options) {
    return options.web && !is_fil_path(path) && require(animation_format(path_of(path))) == AnimationFormat::numbered;
}

void check(const FitArguments& options, const Session& session) {
    for (std::size_t k = 0; k < options.outputs.size(); ++k) {
        const std::string& path = options.outputs[k];
        for (std::size_t before = 0; before < k; ++before)
            if (path_of(path).lexically_normal() == path_of(options.outputs[before]).lexically_normal())
                refuse(path + ": two outputs cannot go to one place.");
        if (is_fil_path(path))
            check_folder_of(path);
        else
            check_animation_path(path);
        if (!is_page(path, options)) check_not_input(path, {options.input, options.mesh});
    }
    const auto none = [&](const auto& is_one) { return std::ranges::none_of(options.outputs, is_one); };
    if (options.web && none([&](const std::string& path) { return is_page(path, options); }))
        refuse("--web writes a folder with a page; give one with -o NAME/.");
    const std::string packing = session.first_given({"--profile", "--bits", "--keep-order"});
    if (!packing.empty() && none(is_fil_path)) refuse(packing + " belongs to a model file; give one with -o NAME.fil.");
    if (const std::string given = session.first_given({"--bits", "--keep-order"}); !given.empty() && !options.rounds())
        refuse(given + " belongs to --profile compact, stream or runtime, which round.");
    if (options.free_weights && (options.profile == FitProfile::stream || options.keep_order))
        refuse("--free-weights cannot go with --profile stream and --keep-order: such files bind vertices anew.");
    if (options.keep_order && options.profile == FitProfile::runtime)
        refuse("--keep-order belongs to --profile compact.");
    if (options.web) return;
    check_animation_options(options.outputs, session);
}

std::string error_text(double rms, double max, std::size_t frame, Index vertex) {
    return fmt::format("{:.2g} of the diagonal (rms), {:.2g} at most (frame {}, vertex {})", rms, max, frame + 1,
                       with_commas(vertex));
}

std::uint64_t bytes_at(const std::string& path) {
    return fs::is_regular_file(path_of(path)) ? std::uint64_t(fs::file_size(path_of(path))) : 0;
}

class FitOutputs {
public:
    FitOutputs(const FitArguments& options, const Fitted& fitted, const MeshAnimation& animation, Session& session)
        : options_(options), fitted_(fitted), animation_(animation), session_(session),
          cache_bytes_(std::uint64_t(fitted.report.frames) * fitted.report.vertices * sizeof(Vec3f)),
          motion_(options.animation) {
        // The keys' largest error; its rms is a tenth of it, which changes that of the fit by a hundredth.
        if (!motion_.key_error) motion_.key_error = std::clamp(fitted.report.rms, 1e-7, 0.1);
    }

    void write() {
        for (const std::string& path : options_.outputs) {
            Report one;
            if (is_fil_path(path))
                write_model(path, one);
            else if (is_page(path, options_))
                write_page(path, one);
            else
                write_animation_output(fitted_.model, frames_of(fitted_.poses), {}, motion_, path, materials_beside(),
                                       session_, one);
            if (const std::uint64_t bytes = bytes_at(path); bytes > 0) report_bytes(path, bytes, one);
            one.set("output", path);
            rows_.add_rows(one);
            outputs_.push_back(one.json());
        }
    }

    const Report& rows() const { return rows_; }
    const Json& json() const { return outputs_; }

private:
    const std::string& materials_beside() const { return options_.mesh.empty() ? options_.input : options_.mesh; }

    void report_bytes(const std::string& path, std::uint64_t bytes, Report& report) const {
        const double times = double(cache_bytes_) / double(bytes);
        report.row(path, fmt::format("{} bytes, {}", with_commas(bytes),
                                     times >= 1 ? fmt::format("{} times smaller than the positions of all frames",
                                                              times >= 100 ? with_commas(std::uint64_t(times))
                                                                           : fmt::format("{:.3g}", times))
                                                : std::string("larger than the positions of all frames")));
        report.set("bytes", bytes);
        report.set("times_smaller", times);
    }

    void write_model(const std::string& path, Report& report) {
        if (options_.profile == FitProfile::plain) return session_.write_model(fitted_.model, path, fitted_.poses);
        session_.begin_writing(path);
        if (options_.profile == FitProfile::lossless) {
            require(pack_model_lossless(fitted_.model, fitted_.poses, path_of(path), session_.context()));
            return;
        }
        PackOptions pack;
        pack.levels = options_.profile == FitProfile::stream;
        pack.records = options_.profile == FitProfile::runtime || fitted_.report.has_free_weights;
        pack.keep_order = options_.keep_order;
        pack.bits = options_.bits.value_or(bits_of_positions(options_.fit.error, fitted_.model.mesh));
        pack.clip_error = options_.fit.base ? pack.clip_error : error_of_poses(options_.fit.error);
        const PackReport packed =
            require(pack_model(fitted_.model, fitted_.poses, pack, path_of(path), session_.context()));
        measure_packed(path, packed, pack, report);
    }

    /// Packed models are rounded, and bound anew when they are read: what they come to is measured on the file.
    void measure_packed(const std::string& path, const PackReport& packed, const PackOptions& pack, Report& report) {
        PoseSequence poses;
        const Model model = session_.read_model(path, &poses);
        const AnimationError error =
            require(animation_error(model, poses, animation_, packed.vertex_order, session_.context()));
        const double diagonal = fitted_.report.diagonal, rms = error.rms / diagonal, max = error.max / diagonal;
        const Index vertex = packed.vertex_order.empty() ? error.max_vertex : packed.vertex_order[error.max_vertex];
        report.row("error when packed", error_text(rms, max, error.max_frame, vertex));
        report.set("rms", rms);
        report.set("max", max);
        report.set("bits", pack.bits);
        if (options_.fit.base) return;
        if (rms > options_.fit.error || max > options_.fit.max_error.value_or(max))
            session_.warn(fmt::format("{}: packed, the error is {:.2g} of the diagonal (rms) and {:.2g} at most; "
                                      "{} keeps what was fitted.",
                                      path, rms, max,
                                      pack.bits < 16 && fitted_.report.parted == 0 ? "--bits 16 or --profile lossless"
                                                                                   : "--profile lossless"));
    }

    void write_page(const std::string& path, Report& report) {
        OutputFolder folder(path_of(path), path_of(options_.input));
        WebPage page(folder, {.title = path_of(options_.input).stem().string(), .logo = {}, .poster = false},
                     WebModel::glb);
        AnimationOutput animation = motion_;
        animation.skin.all_levels = true;
        write_animation_output(fitted_.model, frames_of(fitted_.poses), {}, animation, page.model_path(),
                               materials_beside(), session_, report);
        const std::uint64_t bytes = bytes_at(page.model_path());
        page.write(session_);
        folder.keep();
        report_bytes((path_of(path) / "model.glb").string(), bytes, report);
        const std::string index = (path_of(path) / "index.html").string();
        report.add("page", index, "page", index);
    }

    const FitArguments& options_;
    const Fitted& fitted_;
    const MeshAnimation& animation_;
    Session& session_;
    std::uint64_t cache_bytes_;
    AnimationOutput motion_;
    Report rows_;
    Json outputs_ = Json::array();
};

void report_fit(const FitReport& fit, double seconds, Report& report) {
    report.add("animation", fmt::format("{} vertices, {} frames", with_commas(fit.vertices), with_commas(fit.frames)),
               "vertices", fit.vertices);
    report.set("frames", fit.frames);
    report.add("driver",
               fmt::format("{} vertices, chosen by the {}", with_commas(fit.driver_vertices),
                           fit.choice == DriverChoice::rest ? "rest shape" : "motion"),
               "driver_vertices", fit.driver_vertices);
    report.set("choice", std::string(name_of(fit.choice)));
    report.set("free_weights", fit.has_free_weights);
    report.row("error", error_text(fit.rms, fit.max, fit.max_frame, fit.max_vertex));
    report.set("rms", fit.rms);
    report.set("max", fit.max);
    report.set("max_frame", fit.max_frame + 1);
    report.set("max_vertex", fit.max_vertex);
    report.row("normals", fmt::format("{:.2g} degrees off on average, 95 % less than {:.2g}", fit.normal_mean_deg,
                                      fit.normal_p95_deg));
    report.set("normal_mean_degrees", fit.normal_mean_deg);
    report.set("normal_p95_degrees", fit.normal_p95_deg);
    report.set("parted_vertices", fit.parted);
    report.set("tries", fit.tries);
    report.add("fitted in", seconds_text(seconds), "fit_seconds", seconds);
}

void run(FitArguments options, Session& session) {
    check(options, session);
    MovingInput input;
    open_moving_input({options.input, options.mesh, options.pose_file}, session, input);
    if (options.rest > input.animation.frames)
        refuse(
            fmt::format("--rest {}: {} has the frames 1 to {}.", options.rest, options.input, input.animation.frames));
    if (options.rest > 0)
        options.fit.rest_frame = options.rest - 1;
    else if (input.needs_rest)
        options.fit.rest_frame = require(least_stretched_frame(input.animation, session.context()));
    const double start = now_seconds();
    FitOptions fit = options.fit;
    fit.weight_rounds = options.weight_rounds();
    if (options.rounds() && !fit.base) fit.error = error_of_fit(fit.error);
    const Fitted fitted = require(with_hint(fit_animation(input.animation, fit, session.context()), ErrorCode::mismatch,
                                            "--mesh and the animation belong to one object."));
    const double seconds = now_seconds() - start;
    Report report;
    report.set("outputs", options.outputs);
    if (options.fit.rest_frame)
        report.add("rest shape", fmt::format("frame {}", *options.fit.rest_frame + 1), "rest_frame",
                   *options.fit.rest_frame + 1);
    report_fit(fitted.report, seconds, report);
    if (input.joints > 0 && input.joints < fitted.report.driver_vertices)
        session.warn(fmt::format("{}: is a skin of {} joints, and the fit has {}. The file itself is smaller than an "
                                 "exported fit; a packed model (.fil) may be smaller still.",
                                 options.input, input.joints, with_commas(fitted.report.driver_vertices)));
    FitOutputs outputs(options, fitted, input.animation, session);
    outputs.write();
    report.add_rows(outputs.rows());
    report.set("written", outputs.json());
    session.print(report);
}

} // namespace

Command fit_command() {
    const auto options = std::make_shared<FitArguments>();
    return {
        .name = "fit",
        .text = "Fit a driver and its poses to any animated mesh: a small model that follows it",
        .options =
            OptionList{
                Option("animation", options->input,
                       "Animation: .pc2, .mdd, an animated glTF, .usda, a folder of numbered meshes or NAME_####.obj, "
                       "a model "
                       "with poses")
                    .is_read()
                    .required(),
                Option("--mesh", options->mesh, "Mesh that the animation moves, at rest; .pc2 and .mdd need it")
                    .is_read(),
                Option("-o,--output", options->outputs,
                       "Output: a model with its poses (.fil), the detailed mesh in motion (.glb, .pc2, .mdd, .usda), "
                       "a folder of meshes (NAME/), with --web a page. May come several times")
                    .is_written()
                    .one_at_a_time()
                    .required(),
                Option("--error", options->fit.error,
                       "Largest error: rms over vertices and frames, fraction of the diagonal")
                    .between(1e-9, 1.0)
                    .with_default(),
                Option("--max-error", options->fit.max_error,
                       "Largest error of any vertex in any frame, fraction of the diagonal (default: any)")
                    .above_zero(),
                Option("--base", options->fit.base, "Vertices of the driver; the error is then what it is")
                    .whole_from(12)
                    .excludes({"--error", "--max-error"}),
                Option("--rest", options->rest,
                       "Frame whose mesh is the rest shape, from 1 (default: --mesh, or that of the glTF; for "
                       "numbered meshes the frame from which others are stretched least)")
                    .whole_from(1)} +
            pose_file_options(options->pose_file) +
            OptionList{Option("--web", options->web, "Write folders as pages that show the model in a browser"),
                       choice<FitProfile>("--profile", options->profile,
                                          {{"compact", FitProfile::compact},
                                           {"stream", FitProfile::stream},
                                           {"runtime", FitProfile::runtime},
                                           {"lossless", FitProfile::lossless}},
                                          "Pack the .fil: compact (small), stream (coarse to fine), runtime (opens at "
                                          "once) or lossless. "
                                          "The error asked for holds for the packed file (default: a plain model)"),
                       Option("--bound-weights", options->bound_weights,
                              "Keep the weights that binding gives to vertices: a larger driver, a faster fit (default "
                              "with --profile compact and stream)"),
                       Option("--free-weights", options->free_weights,
                              "Move weights with --profile compact too: smaller for characters, larger for cloth")
                           .excludes({"--bound-weights"}),
                       Option("--sound-gradients", options->fit.sound_gradients,
                              "Keep gradients near the driver's own motion: better normals in viewers, less close"),
                       Option("--bits", options->bits,
                              "With --profile compact, stream or runtime: bits of a position (default: by the error)")
                           .between(10, 16),
                       Option("--keep-order", options->keep_order,
                              "With --profile compact: keep the order of vertices and faces")} +
            animation_options(options->animation),
        .examples = "  filigree fit cache.pc2 --mesh rest.obj --error 1e-4 -o out.glb -o out.fil\n"
                    "  filigree fit walk.glb --animation Run -o walk.fil --profile compact\n"
                    "  filigree fit frames_####.obj -o page/ --web\n"
                    "  filigree fit cache.pc2 --mesh rest.obj --base 300 -o out.fil",
        .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
