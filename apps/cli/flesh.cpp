#include "animation_output.h"
#include "commands.h"
#include "moving_input.h"

#include "filigree/flesh.h"
#include "filigree/flesh/skin_map.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/numbered_name.h"
#include "filigree/mesh/mesh_map.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

constexpr double kDefaultKeyRate = 30; // a second
constexpr double kFarFromSkin = 0.1;   // of the diagonal
constexpr double kMuchOverlap = 1e-3;  // of the volume
constexpr double kRestlessLoop = 5e-3; // of the diagonal
constexpr double kAlreadyLoops = 0.01; // of the diagonal
constexpr double kMuchVolumeLost = 0.95;
constexpr std::size_t kOverlapFrames = 4;

struct FleshArguments {
    std::string input, mesh;
    std::vector<std::string> outputs, clips, soft, through;
    std::string soft_from;
    std::vector<double> soft_values;
    std::optional<double> input_rate;
    std::size_t patches = CharacterOptions{}.patches;
    bool by_surface = false, keep_skeleton = false;
    double strength = SoftJoints{}.strength;
    FleshOptions flesh;
    FleshClipOptions clip;
    bool no_self_contact = false, sags = false, no_check = false;
    std::size_t joints = 300;
    AnimationOutput animation;
};

bool is_glb(const std::string& path) { return lower_extension(path_of(path)) == ".glb"; }
bool is_fil(const std::string& path) { return lower_extension(path_of(path)) == ".fil"; }

void check_outputs(const FleshArguments& options, const Session& session) {
    for (std::size_t k = 0; k < options.outputs.size(); ++k) {
        const std::string& path = options.outputs[k];
        for (std::size_t before = 0; before < k; ++before)
            if (options.outputs[before] == path) refuse(path + ": two outputs cannot go to one place.");
        if (is_fil(path))
            check_folder_of(path);
        else
            check_animation_path(path);
        check_not_input(path, {options.input, options.mesh});
    }
    if (options.keep_skeleton && std::ranges::none_of(options.outputs, is_glb))
        refuse("--keep-skeleton is for a .glb; give one with -o NAME.glb.");
    if (const std::string extension = lower_extension(path_of(options.input));
        options.keep_skeleton && extension != ".glb" && extension != ".gltf")
        refuse("--keep-skeleton: " + options.input + " is no glTF and has no skeleton.");
    if (!options.soft_values.empty() && options.soft_from.empty())
        refuse("--soft-values belongs to --soft-from, which names the numbers.");
    if (options.soft_values.size() == 2 && options.soft_values[0] == options.soft_values[1])
        refuse("--soft-values: the two numbers are the same.");
    check_animation_options(options.outputs, session);
    if (options.animation.glb == GlbMotion::morph)
        refuse("--as morph is for meshes; flesh leaves as a skin. Write a .fil and export that.");
}

std::string list_of_clips(const SkinnedMesh& skin) {
    std::string list;
    for (const SkinClip& clip : skin.clips) list += (list.empty() ? "'" : ", '") + clip.name + "'";
    return list;
}

/// The clips that --clip names, or all that move.
std::vector<std::size_t> chosen_clips(const FleshArguments& options, const SkinnedMesh& skin, Session& session) {
    std::vector<std::size_t> chosen;
    for (const std::string& name : options.clips) {
        const auto found = std::ranges::find(skin.clips, name, &SkinClip::name);
        if (found == skin.clips.end())
            refuse(fmt::format("{}: has no clip '{}', but {}.", options.input, name, list_of_clips(skin)));
        const auto number = std::size_t(found - skin.clips.begin());
        if (!(found->seconds > 0))
            refuse(ErrorCode::unsuitable,
                   fmt::format("{}: clip '{}' is a single pose and does not move.", options.input, name));
        if (std::ranges::find(chosen, number) == chosen.end()) chosen.push_back(number);
    }
    if (!chosen.empty()) return chosen;
    std::string poses;
    for (std::size_t c = 0; c < skin.clips.size(); ++c) {
        if (skin.clips[c].seconds > 0)
            chosen.push_back(c);
        else
            poses += (poses.empty() ? "'" : ", '") + skin.clips[c].name + "'";
    }
    if (chosen.empty())
        refuse(ErrorCode::unsuitable, options.input + ": its clips are single poses, and nothing moves.");
    if (!poses.empty()) session.warn("Clips that are a single pose were left out: " + poses + ".");
    return chosen;
}

class FleshCommand {
public:
    FleshCommand(const FleshArguments& options, Session& session)
        : options_(options), session_(session), flesh_(make_flesh()) {}

    void run() {
        const double start = now_seconds();
        for (const std::size_t clip : clip_numbers_) {
            clips_.push_back(require(simulate_flesh(flesh_, clip, clip_options(), session_.context())));
            measures_.push_back(require(
                measure_flesh(flesh_, clips_.back(), options_.no_check ? 0 : kOverlapFrames, session_.context())));
        }
        const double simulated = now_seconds();
        fitted_ = require(of_input(fit_flesh(flesh_, clips_, options_.joints, session_.context())));
        report_flesh();
        for (std::size_t c = 0; c < clips_.size(); ++c) report_clip(c);
        write();
        report_.row("time", fmt::format("simulating {}, writing {}", seconds_text(simulated - start),
                                        seconds_text(now_seconds() - simulated)));
        report_.set("simulate_seconds", simulated - start);
        advise();
        session_.print(report_);
        doubt();
    }

private:
    Flesh make_flesh() {
        check_outputs(options_, session_);
        SkinnedMesh skin = read_input();
        session_.warn(skin.warnings);
        clip_numbers_ = chosen_clips(options_, skin, session_);
        for (const std::string& path : options_.outputs)
            if (!is_glb(path) && clip_numbers_.size() > 1)
                refuse(fmt::format("{}: holds one clip, and {} has {}; name one with --clip, or write a .glb.", path,
                                   options_.input, list_of_clips(skin)));
        FleshOptions options = options_.flesh;
        options.sculpted_gravity = !options_.sags;
        for (const std::string& pattern : options_.soft) options.soft.push_back({pattern, options_.strength});
        for (const std::string& pair : options_.through) {
            const std::size_t comma = pair.find(',');
            if (comma == 0 || comma == std::string::npos || comma + 1 == pair.size())
                refuse("--through takes two joints with a comma between them, such as \"*Hand,Spine*\".");
            options.contacts.push_back({pair.substr(0, comma), pair.substr(comma + 1)});
        }
        if (!options_.soft_from.empty()) {
            const std::vector<double>& ends = options_.soft_values;
            const Result<std::vector<float>> numbers = skin_map(skin, options_.soft_from);
            if (!numbers) throw Failure{{numbers.error().code, options_.input + ": " + numbers.error().message}};
            options.loose =
                in_range(*numbers, ends.empty() ? std::array{0.0, 1.0} : std::array{ends[0], ends[1]}, {0, 1});
            options.loose_strength = options_.strength;
        }
        Result<Flesh> made = Flesh::create(std::move(skin), options, clip_numbers_, session_.context());
        if (!made) throw Failure{{made.error().code, options_.input + ": " + made.error().message}};
        session_.warn(made->report().warnings);
        return std::move(*made);
    }

    SkinnedMesh read_input() {
        CharacterOptions character;
        character.by_joints = !options_.by_surface;
        character.frames_per_second = options_.input_rate;
        character.patches = options_.patches;
        Mesh rest;
        if (!options_.mesh.empty()) {
            rest = session_.read_mesh(options_.mesh);
            character.rest = &rest;
        }
        std::error_code ignored;
        const bool has_meshes =
            numbered_name(path_of(options_.input)).has_value() || fs::is_directory(path_of(options_.input), ignored);
        if (options_.mesh.empty() && has_meshes) {
            rest = first_mesh(options_.input, session_);
            character.rest = &rest;
        }
        const std::string extension = lower_extension(path_of(options_.input));
        if (!character.rest && (extension == ".pc2" || extension == ".mdd" || extension == ".usda"))
            refuse(options_.input + ": has positions alone; --mesh FILE gives the mesh that it moves.");
        return require(of_input(read_character(path_of(options_.input), character, session_.context())));
    }

    /// Says which file it is that does not suit.
    template <class T>
    Result<T> of_input(Result<T> result) const {
        if (!result && result.error().code == ErrorCode::unsuitable &&
            !result.error().message.starts_with(options_.input))
            return Error{result.error().code, options_.input + ": " + result.error().message};
        return result;
    }

    FleshClipOptions clip_options() const {
        FleshClipOptions options = options_.clip;
        options.self_contact = !options_.no_self_contact;
        return options;
    }

    void write() {
        if (!fitted_.morphs.empty() && !std::ranges::all_of(options_.outputs, is_glb))
            session_.warn("The file's morph targets are in a .glb alone; elsewhere the mesh stays as they have it at "
                          "rest. --by-surface moves it with them.");
        for (const std::string& path : options_.outputs) {
            if (is_fil(path)) {
                session_.write_model(fitted_.model, path, fitted_.poses[0]);
                report_.row("file", path);
                continue;
            }
            if (!is_glb(path)) {
                Report of_file;
                FrameSource<Pose> poses = frames_of(fitted_.poses[0]);
                poses.metres_per_unit = flesh_.scale();
                write_animation_output(fitted_.model, poses, {}, options_.animation, path, options_.input, session_,
                                       of_file);
                report_.add_rows(of_file);
                continue;
            }
            SkinOptions skin = options_.animation.skin;
            skin.normals = options_.animation.no_normals ? ExportNormals::leave : ExportNormals::keep;
            skin.compress = options_.animation.compress;
            skin.materials_beside = path_of(options_.mesh.empty() ? options_.input : options_.mesh);
            if (options_.keep_skeleton) skin.skeleton_of = path_of(options_.input);
            if (!skin.key_rate) skin.key_rate = kDefaultKeyRate;
            session_.begin_writing(path);
            const ExportReport written = require(write_skin_glb(fitted_.model, fitted_.animations(), fitted_.morphs,
                                                                skin, path_of(path), session_.context()));
            session_.warn(written.warnings);
            report_.add("file",
                        fmt::format("{}, {:.3g} MB: {} joints, {} clips, {} keys, error {:.1e} of the diagonal at them",
                                    path, double(written.bytes) / 1e6, with_commas(written.joints),
                                    fitted_.names.size(), with_commas(written.keys), written.error_at_keys),
                        "output", path);
            report_.set("bytes", written.bytes);
            report_.set("error_at_keys", written.error_at_keys);
        }
    }

    void report_flesh() {
        const FleshReport& made = flesh_.report();
        const Body& body = *flesh_.body();
        const double size = bounds(flesh_.skin().mesh).size().maxCoeff();
        report_.add(
            "size",
            fmt::format("{:.3g} m: {:.3g} model units at {:.3g} m each", size * flesh_.scale(), size, flesh_.scale()),
            "scale", flesh_.scale());
        report_.add("flesh",
                    fmt::format("{} particles, {:.2g} cm apart: {} held by bones, {} in thin parts",
                                with_commas(body.particle_count()), 100 * body.spacing(), with_commas(made.held),
                                with_commas(made.thin)),
                    "particles", body.particle_count());
        if (made.left_out_vertices > 0)
            report_.row("left out", fmt::format("{} of {} vertices follow their joints without flesh",
                                                with_commas(made.left_out_vertices),
                                                with_commas(flesh_.skin().mesh.vertex_count())));
        if (!made.scaled.empty()) {
            constexpr std::size_t kMostNames = 4;
            const std::size_t named = std::min(made.scaled.size(), kMostNames);
            std::string names = fmt::format("'{}'", fmt::join(std::span(made.scaled).first(named), "', '"));
            if (made.scaled.size() > named) names += fmt::format(" and {} more", made.scaled.size() - named);
            report_.row("grows", "with the joints that change their size or stretch: " + names);
        }
        report_.set("scaled", made.scaled);
        report_.set("spacing", body.spacing());
        report_.set("held", made.held);
        report_.set("left_out_vertices", made.left_out_vertices);
        report_.add("joints",
                    fmt::format("{}, which follow the flesh to {:.1e} of the diagonal (rms; worst {:.1e})",
                                with_commas(fitted_.report.driver_vertices), fitted_.report.rms, fitted_.report.max),
                    "joints", fitted_.report.driver_vertices);
        report_.set("fit_rms", fitted_.report.rms);
        report_.set("fit_max", fitted_.report.max);
    }

    void report_clip(std::size_t c) {
        const FleshClip& clip = clips_[c];
        const FleshMeasure& m = measures_[c];
        const std::string& joint =
            m.furthest_joint == kNoIndex ? fitted_.names[c] : flesh_.skin().joints[m.furthest_joint].name;
        report_.row("clip", fmt::format("'{}', {} frames at {:.4g} a second, {} a frame, {} substeps at most",
                                        fitted_.names[c], clip.frames.size(), clip.frames_per_second,
                                        seconds_text(clip.step_seconds + clip.target_seconds), clip.most_substeps));
        const bool has_volume = m.is_closed || m.most_volume > m.least_volume;
        if (!has_volume)
            report_.row("  volume", "none: the surface is open and encloses nothing");
        else
            report_.row("  volume",
                        fmt::format("{:.3f} .. {:.3f} of the bind pose's; the skin alone: {:.3f} .. {:.3f}",
                                    m.least_volume, m.most_volume, m.skin_least_volume, m.skin_most_volume));
        if (!options_.no_check && has_volume)
            report_.row("  overlap", fmt::format("{:.1e} of the volume; the skin alone: {:.1e}",
                                                 std::max(0.0, m.overlap), std::max(0.0, m.skin_overlap)));
        report_.row("  from the skin", fmt::format("{:.3f} of the diagonal at most, at '{}' in frame {}", m.furthest,
                                                   joint, m.furthest_frame));
        if (clip.is_loop)
            report_.row("  loop", fmt::format("{:.1e} of the diagonal between cycles (worst {:.1e}) after {}, faded "
                                              "to none",
                                              clip.loop_rms, clip.loop_max, clip.cycles));
        Json of = Json::object();
        of["name"] = fitted_.names[c];
        of["frames"] = clip.frames.size();
        of["frames_per_second"] = clip.frames_per_second;
        of["step_seconds"] = clip.step_seconds;
        of["target_seconds"] = clip.target_seconds;
        of["most_substeps"] = clip.most_substeps;
        of["least_volume_ratio"] = clip.least_volume_ratio;
        of["inverted_cells"] = clip.inverted_cells;
        of["clamped_particles"] = clip.clamped_particles;
        of["volume"] = {m.least_volume, m.most_volume};
        of["skin_volume"] = {m.skin_least_volume, m.skin_most_volume};
        of["overlap"] = m.overlap;
        of["skin_overlap"] = m.skin_overlap;
        of["furthest"] = m.furthest;
        of["furthest_joint"] = joint;
        of["is_loop"] = clip.is_loop;
        of["loop_rms"] = clip.loop_rms;
        of["loop_max"] = clip.loop_max;
        of["cycles"] = clip.cycles;
        report_.set("clips").push_back(std::move(of));
    }

    /// What a user would change.
    void advise() {
        for (std::size_t c = 0; c < clips_.size(); ++c) {
            const FleshClip& clip = clips_[c];
            const FleshMeasure& m = measures_[c];
            const std::string of = "Clip '" + fitted_.names[c] + "': ";
            if (!clip.is_loop && !options_.clip.loop && clip.skin_gap < kAlreadyLoops)
                session_.warn(of + "it ends as it begins; with --loop its flesh does so too.");
            if (clip.is_loop && clip.skin_gap > kAlreadyLoops)
                session_.warn(of + "its joints end elsewhere than they begin; its flesh is a loop beside them.");
            if (clip.is_loop && clip.loop_rms > kRestlessLoop)
                session_.warn(of + "the flesh does not settle into a cycle; raise --damping.");
            if (options_.flesh.frequency > clip.frames_per_second / 2)
                session_.warn(of + "springs of more than half the frame rate look slower than they are; raise "
                                   "--frame-rate or lower --frequency.");
            if (m.furthest > kFarFromSkin && options_.soft.empty())
                session_.warn(fmt::format("{}the flesh is {:.0f} % of the diagonal away from its skin; raise "
                                          "--surface-frequency, --frequency or --stiffness to hold it.",
                                          of, 100 * m.furthest));
            if (m.overlap > kMuchOverlap && m.overlap > m.skin_overlap)
                session_.warn(of + "parts of the body overlap more than in the skin; take more --particles, or a "
                                   "larger --core.");
            if (m.is_closed && m.least_volume < kMuchVolumeLost && flesh_.report().scaled.empty())
                session_.warn(fmt::format("{}the body loses {:.0f} % of its volume; a smaller --core lets the joints "
                                          "keep it.",
                                          of, 100 * (1 - m.least_volume)));
            if (clip.inverted_cells > 0)
                session_.warn(fmt::format("{}{} cells are inside out at the end, where the skin folds; a smaller "
                                          "--core or more --particles help.",
                                          of, with_commas(clip.inverted_cells)));
        }
    }

    void doubt() const {
        for (std::size_t c = 0; c < clips_.size(); ++c)
            if (clips_[c].clamped_particles > 0 || clips_[c].unstable_substeps > 0)
                throw Doubt{fmt::format("Clip '{}' cannot be trusted: the motion of {} particles was not finite, and "
                                        "{} substeps were too long; raise --frame-rate, or lower --stiffness.",
                                        fitted_.names[c], clips_[c].clamped_particles, clips_[c].unstable_substeps)};
    }

    const FleshArguments& options_;
    Session& session_;
    std::vector<std::size_t> clip_numbers_;
    Flesh flesh_;
    std::vector<FleshClip> clips_;
    std::vector<FleshMeasure> measures_;
    FittedFlesh fitted_;
    Report report_;
};

} // namespace

Command flesh_command() {
    const auto options = std::make_shared<FleshArguments>();
    return {
        .name = "flesh",
        .text = "Make soft matter of a character that joints move, and write it as a skin again",
        .options =
            OptionList{
                Option("character", options->input,
                       "Animated glTF (.glb, .gltf), by its skin or its morph targets; a model with poses (.fil); with "
                       "--mesh also .pc2, .mdd, .usda or numbered meshes")
                    .is_read()
                    .required(),
                Option("--mesh", options->mesh, "The mesh at rest, for an input that has positions alone").is_read(),
                Option("--by-surface", options->by_surface,
                       "Follow the surface of a skin, with its morph targets, and not its joints"),
                Option(
                    "--patches", options->patches,
                    "Of a surface without joints: so many patches move its matter; what it does beside them, such as "
                    "a blink, lies on top")
                    .whole_from(12)
                    .with_default(),
                Option("--input-rate", options->input_rate,
                       "Frames a second of an input that does not say it (default: 60)")
                    .above_zero(),
                Option("-o,--output", options->outputs,
                       "Output: a skin with all clips (.glb), or one clip as a model (.fil), .pc2, .mdd, .usda or a "
                       "folder of meshes (NAME/). May come several times")
                    .is_written()
                    .one_at_a_time()
                    .required(),
                Option("--clip", options->clips, "Clip by its name (default: all). May come several times")
                    .one_at_a_time()
                    .named("NAME"),
                Option("--loop", options->clip.loop,
                       "Clips are cycles: repeat each until its flesh is periodic, and end as it begins"),
                Option("--soft", options->soft,
                       "Joints that hold little, with all below them, such as \"Tail*\". May come several times")
                    .one_at_a_time()
                    .named("PATTERN"),
                Option("--soft-from", options->soft_from,
                       "Numbers of the mesh's vertices that say how loose it is: color.r (g, b, a), \"scalar NAME\", "
                       "\"group NAME\", \"object NAME\", \"material NAME\" or \"joint NAME\"")
                    .named("NUMBERS"),
                Option("--soft-values", options->soft_values,
                       "Two of these numbers: where it holds as ever, and where it is loose (default: 0 1)")
                    .values(2),
                Option("--strength", options->strength, "How strong the joints of --soft hold, and loose places, of 1")
                    .between(0.0, 1.0)
                    .with_default(),
                Option("--through", options->through,
                       "Two joints whose limbs pass through each other, with all below them, such as "
                       "\"*Hand,Spine*\". May come several times")
                    .one_at_a_time()
                    .named("PAIR"),
                Option("--ground", options->clip.ground, "A floor at the lowest point of each clip"),
                Option("--joints", options->joints, "Joints of the output, about").whole_from(12).with_default(),
                Option("--stiffness", options->flesh.material.young_modulus, "Young's modulus of the flesh, Pa")
                    .above_zero()
                    .with_default(),
                Option("--poisson-ratio", options->flesh.material.poisson_ratio,
                       "How well the flesh keeps its volume while it is pressed: 0.49 does so best and takes twice as "
                       "long")
                    .between(0.0, 0.49)
                    .with_default(),
                Option("--density", options->flesh.material.density, "Density of the flesh, kg/m^3")
                    .above_zero()
                    .with_default(),
                Option("--core", options->flesh.core,
                       "How far from the bones to the skin all is held: 0 nothing, 1 everything")
                    .between(0.0, 1.0)
                    .with_default(),
                Option("--frequency", options->flesh.frequency, "Hz, of the springs at the edge of the core")
                    .between(0.0, 1e6)
                    .with_default(),
                Option("--surface-frequency", options->flesh.surface_frequency, "Hz, of the springs at the skin")
                    .between(0.0, 1e6)
                    .with_default(),
                Option("--damping", options->flesh.damping, "1/s, of motion beside the animation")
                    .between(0.0, 1e6)
                    .with_default(),
                Option("--particles", options->flesh.particles, "Particles of the flesh, about")
                    .whole_from(64)
                    .with_default(),
                Option("--scale", options->flesh.scale,
                       "Metres a unit of the file (default: 1, or the power of ten that makes 0.3 to 3 m of it)")
                    .above_zero(),
                Option("--frame-rate", options->clip.frames_per_second, "Frames a second that are simulated")
                    .above_zero()
                    .with_default(),
                Option("--sags", options->sags, "Gravity bends the bind pose too (default: it is sculpted in)"),
                Option("--separate", options->flesh.separate,
                       "Part what is nearer to each other than two particles, such as fingers; takes longer"),
                Option(
                    "--keep-skeleton", options->keep_skeleton,
                    "Keep the file's own joints, nodes and cameras beside the new joints, moving as they did (.glb)"),
                Option("--no-self-contact", options->no_self_contact, "Parts of the body pass through each other"),
                Option("--no-check", options->no_check, "Do not look for overlaps, which takes seconds")} +
            animation_options(options->animation),
        .examples = "  filigree flesh fox.glb -o soft.glb\n"
                    "  filigree flesh fox.glb -o soft.glb --loop --soft \"b_Tail*\"\n"
                    "  filigree flesh walk.glb -o soft.glb --clip Walk --stiffness 8000 --ground\n"
                    "  filigree flesh walk.glb -o soft.fil --clip Walk --joints 1000\n"
                    "  filigree flesh flag.pc2 --mesh flag.obj -o soft.glb --soft-from color.r",
        .run = [options](Session& session) { FleshCommand(*options, session).run(); }};
}

} // namespace filigree::cli
