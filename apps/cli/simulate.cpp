#include "simulate.h"
#include "animation_output.h"
#include "commands.h"
#include "draft.h"
#include "drawing.h"
#include "simulate_report.h"

#include "filigree/io/animation/point_cache.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/numbered_name.h"
#include "filigree/scene/finer_check.h"
#include "filigree/scene/melting_surface.h"
#include "filigree/scene/scene_keys.h"
#include "filigree/scene/scene_run.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

constexpr double kMoltenKeys = 10; // a second of a GLB whose faces change in time

/// Where a run's results go, sorted by kind, and everything that can be refused before the work.
struct Outputs {
    std::vector<std::string> models, films, folders, animations;

    explicit Outputs(const std::vector<std::string>& paths) {
        for (std::size_t i = 0; i < paths.size(); ++i) {
            const std::string& path = paths[i];
            if (std::find(paths.begin(), paths.begin() + std::ptrdiff_t(i), path) != paths.begin() + std::ptrdiff_t(i))
                refuse(path + ": two outputs cannot go to one place.");
            std::error_code ignored;
            const bool is_folder = path.ends_with('/') || fs::is_directory(path_of(path), ignored);
            if (!is_folder) check_folder_of(path);
            if (is_folder)
                folders.push_back(path);
            else if (lower_extension(path_of(path)) == ".fil")
                models.push_back(path);
            else if (is_film(path))
                films.push_back(path);
            else if (is_animation_path(path))
                animations.push_back(path);
            else
                refuse(ErrorCode::unsupported,
                       path + ": is no name for a simulation's output; end it in .fil (a model with its poses), "
                              ".mp4, .gif or _%04d.png (a film), .glb, .pc2, .mdd or .usda (the detailed mesh "
                              "moving), or / (a folder of meshes).");
        }
    }
};

/// "out.fil", or "out_NAME.fil" where there are several bodies.
std::string model_path(const std::string& path, std::size_t bodies, const std::string& body) {
    if (bodies == 1) return path;
    const fs::path whole = path_of(path);
    return (whole.parent_path() /
            path_of(fmt::format("{}_{}{}", whole.stem().string(), body, whole.extension().string())))
        .string();
}

/// Two names of one file, whether it is there or not; both name something.
bool is_one_file(const fs::path& a, const fs::path& b) {
    std::error_code failed;
    if (fs::equivalent(a, b, failed) && !failed) return true; // links of all kinds
    return fs::weakly_canonical(fs::absolute(a), failed) == fs::weakly_canonical(fs::absolute(b), failed) && !failed;
}

/// "BODY_0001.ply" and so on.
NumberedName mesh_names(const fs::path& folder, const std::string& body) {
    return {folder.has_filename() ? folder : folder.parent_path(), body + "_", ".ply"};
}

/// Refuses outputs that would go over what the run reads, or over each other.
void check_places(const SimulateArguments& options, const SceneFile& scene, const Outputs& outputs) {
    std::vector<std::pair<fs::path, std::string>> taken;
    if (!options.scene.empty()) taken.emplace_back(path_of(options.scene), "the scene");
    const auto add_mesh = [&](const std::string& mesh) {
        if (!mesh.empty()) taken.emplace_back(path_of(mesh), "a mesh of the scene");
    };
    for (const SceneBody& body : scene.bodies) add_mesh(body.mesh);
    for (const SceneObstacle& obstacle : scene.obstacles) add_mesh(obstacle.mesh);
    const auto take = [&](const std::string& path, const std::string& what) {
        for (const auto& [file, is] : taken)
            if (is_one_file(path_of(path), file)) refuse(fmt::format("{}: is {} and would be overwritten.", path, is));
        taken.emplace_back(path_of(path), what);
    };
    std::vector<std::string> files_read;
    for (const auto& [file, is] : taken) files_read.push_back(file.string());
    if (!options.save.empty()) take(options.save, "where the state goes");
    if (!options.resume.empty())
        taken.emplace_back(path_of(options.resume), "the state to go on from"); // may be saved over
    for (const std::string& path : outputs.models)
        for (const SceneBody& body : scene.bodies) take(model_path(path, scene.bodies.size(), body.name), "an output");
    const auto take_numbered = [&](const std::string& path, const NumberedName& name) {
        for (const auto& [file, is] : taken)
            if (name.number_of(file.filename().string()) && is_one_file(file.parent_path() / ".", name.folder / "."))
                refuse(fmt::format("{}: {} is {} and would be overwritten.", path, file.string(), is));
    };
    for (const std::string& path : outputs.films) {
        if (const auto name = printf_numbered_name(path_of(path)); name && lower_extension(path_of(path)) == ".png")
            take_numbered(path, *name);
        take(path, "an output");
    }
    for (const std::string& path : outputs.animations)
        for (const SceneBody& body : scene.bodies) {
            const std::string place = model_path(path, scene.bodies.size(), body.name);
            check_not_input(place, files_read);
            take(place, "an output");
        }
    for (const std::string& path : outputs.folders) {
        for (const SceneBody& body : scene.bodies) take_numbered(path, mesh_names(path_of(path), body.name));
        take(path, "an output");
    }
}

/// With the scalar `origin`: which vertex of the bodies' meshes a vertex is, -1 for a new one.
Mesh with_origins(CompositeSurface surface, const Vec3d& origin) {
    VertexScalar& from = surface.mesh.scalars.emplace_back(VertexScalar{"origin", {}});
    for (const Index v : surface.origin) from.values.push_back(v == kNoIndex ? -1 : float(v));
    surface.mesh.origin = origin;
    return std::move(surface.mesh);
}

Result<Mesh> melting_mesh(MeltingSurface& melting, const Recording& recording, std::size_t frame, const Vec3d& origin,
                          bool as_surfels, const RunContext& context) {
    Result<CompositeSurface> surface = melting.frame(recording, frame, context);
    if (!surface) return surface.error();
    if (as_surfels) {
        const Result<Surfels> surfels = melting.surfels(*surface, recording, frame, context);
        if (!surfels) return surfels.error();
        Mesh points = surfel_points(*surfels);
        points.origin = origin;
        return points;
    }
    return with_origins(std::move(*surface), origin);
}

class Run {
public:
    Run(const SimulateArguments& options, SceneFile scene, Session& session)
        : options_(options), session_(session), scene_(std::move(scene)), outputs_(options.outputs) {
        check_places(options, scene_, outputs_);
        if (options.finer && !scene_.fractures.empty())
            refuse(ErrorCode::unsuitable, options.scene +
                                              ": --finer cannot judge bodies that break, as finer ones would "
                                              "break elsewhere; take [[fracture]] out of the scene.");
        if (options.frames) scene_.frames = options.frames;
        if (options.draft) {
            if (outputs_.films.empty()) refuse("--draft is of films; let -o end in .mp4, .gif or _%04d.png.");
            ScenePicture& picture = scene_.picture;
            picture.size = draft_size(picture.size);
            picture.passes = std::min(picture.passes, kDraftPasses);
            picture.most_triangles = std::min(picture.most_triangles, kDraftTriangles);
        }
        if (!outputs_.films.empty()) films_.emplace(outputs_.films, scene_);
        ready_ = require(set_up(scene_, session.context()));
        session.warn(ready_.warnings);
        run_.emplace(require(SceneRun::create(scene_, ready_, options.check, session.context())));
        if (!options.resume.empty()) require(run_->resume(require(read_file(path_of(options.resume))), options.resume));
        session.warn(run_->warnings()); // what is known before the work, such as a body that starts inside an obstacle
    }

    void simulate() {
        const std::size_t last = options_.stop_at ? std::min(options_.stop_at, scene_.frames) : scene_.frames;
        if (run_->frame() > last)
            refuse(
                fmt::format("{}: is at frame {} already, and {} is the last.", options_.resume, run_->frame(), last));
        const Status status = run_->advance_to(last, session_.context());
        session_.warn(run_->warnings());
        if (!status && status.error().code == ErrorCode::cancelled) cancelled();
        require(status);
        if (options_.finer)
            finer_ = require(check_against_finer(scene_, ready_, run_->frame(), kFinerMoments, session_.context()));
    }

    void write() {
        if (!options_.save.empty()) {
            session_.begin_writing(options_.save);
            save();
        }
        const double start = now_seconds();
        if (films_) {
            films_->write(scene_, ready_, run_->recording(), session_);
            film_seconds_ = now_seconds() - start;
        }
        for (std::size_t b = 0; b < ready_.bodies.size(); ++b) {
            ready_.bodies[b].model.mesh.origin = ready_.origin;
            leave_out_closed_cracks(ready_.bodies[b], run_->recording().poses[b].frames);
        }
        write_meshes();
        for (const std::string& path : outputs_.models)
            for (std::size_t b = 0; b < ready_.bodies.size(); ++b)
                session_.write_model(ready_.bodies[b].model,
                                     model_path(path, ready_.bodies.size(), ready_.bodies[b].name),
                                     run_->recording().poses[b]);
        warn_of_one_topology();
        write_animations();
        write_seconds_ = now_seconds() - start;
    }

    void report() const;
    /// Throws where what was written is not to be trusted.
    void doubt() const {
        if (const std::optional<std::string> why = run_->broke_down()) throw Doubt{*why};
    }

private:
    /// What has one topology cannot part and join.
    void warn_of_one_topology() {
        std::vector<std::string> paths = outputs_.models;
        for (const std::string& path : outputs_.animations)
            if (!holds_moments(path)) paths.push_back(path);
        if (paths.empty()) return;
        for (std::size_t b = 0; b < ready_.bodies.size(); ++b) {
            const auto& frames = run_->recording().matter[b];
            const auto is_new = [](const MatterParticles& matter) {
                return std::any_of(matter.renewal.begin(), matter.renewal.end(),
                                   [](float renewal) { return renewal > CompositeMesher::kFadeBegin; });
            };
            const auto first = std::find_if(frames.begin(), frames.end(), is_new);
            if (first == frames.end()) continue;
            session_.warn({fmt::format("{} holds one topology, so from frame {} on, where body '{}' flows, its mesh "
                                       "is stretched instead of parted; a folder of meshes (-o NAME/) or a film holds "
                                       "what parts and joins",
                                       fmt::join(paths, " and "), first - frames.begin(), ready_.bodies[b].name)});
        }
    }
    /// Formats that hold a mesh whose faces change in time.
    static bool holds_moments(const std::string& path) {
        const std::string ending = lower_extension(path_of(path));
        return ending == ".usda" || ending == ".glb";
    }

    MeltingSurface melting_surface() {
        const RunContext silent = session_.silent_context();
        if (!looks_) looks_ = looks_of_bodies(ready_, session_);
        return require(MeltingSurface::create(ready_, *looks_, silent));
    }

    /// What melts as one surface whose faces change in time: USD with velocities for motion blur, GLB as key frames.
    void write_melting(MeltingSurface& melting, const std::string& path) {
        const RunContext silent = session_.silent_context();
        const Recording& recording = run_->recording();
        const double rate = scene_.step.frames_per_second;
        const bool is_glb = lower_extension(path_of(path)) == ".glb";
        session_.warn(melting.warnings);
        const auto moment = [&](std::size_t frame) -> Result<MeshMoment> {
            Result<CompositeSurface> surface = melting.frame(recording, frame, silent);
            if (!surface) return surface.error();
            if (is_glb) // where textures are multiplied with colours
                return MeshMoment{with_materials_apart(with_origins(std::move(*surface), ready_.origin),
                                                       std::vector<Vec3f>(melting.materials().size(), Vec3f::Ones()))
                                      .mesh,
                                  {}};
            Result<std::vector<Vec3f>> velocities = melting.velocities(*surface, recording, frame, rate, silent);
            if (!velocities) return velocities.error();
            return MeshMoment{with_origins(std::move(*surface), ready_.origin), std::move(*velocities)};
        };
        std::vector<std::string> warnings;
        session_.begin_writing(path);
        const FrameSource<MeshMoment> moments{recording.poses[0].frames.size(), rate, moment};
        if (is_glb)
            require(write_glb_moments(moments, options_.animation.skin.key_rate.value_or(kMoltenKeys), path_of(path),
                                      session_.context()));
        else
            require(write_usda_moments(moments, path_of(path), warnings, session_.context()));
        session_.warn(warnings);
        Report report;
        report.set("output", path);
        animations_.push_back(report.json());
    }

    void write_animations() {
        for (const std::string& path : outputs_.animations) {
            MeltingSurface melting;
            if (holds_moments(path)) melting = melting_surface();
            if (!melting.is_empty()) write_melting(melting, model_path(path, ready_.bodies.size(), melting.name()));
            for (std::size_t b = 0; b < ready_.bodies.size(); ++b) {
                if (melting.has_body(b)) continue;
                Report report;
                FrameSource<Pose> poses = frames_of(run_->recording().poses[b]);
                poses.metres_per_unit = 1; // the world of scenes
                write_animation_output(ready_.bodies[b].model, poses, {}, options_.animation,
                                       model_path(path, ready_.bodies.size(), ready_.bodies[b].name),
                                       scene_.bodies[b].mesh, session_, report);
                animation_rows_.add_rows(report);
                animations_.push_back(report.json());
            }
        }
    }
    void save() { require(write_file(path_of(options_.save), run_->save())); }

    [[noreturn]] void cancelled() {
        if (options_.save.empty()) throw Failure{cancelled_error()};
        save();
        refuse(ErrorCode::cancelled, fmt::format("Cancelled after frame {} of {}; go on with --resume {}.",
                                                 run_->frame(), scene_.frames, options_.save));
    }

    /// A mesh a frame and body: all of a folder or none.
    void write_meshes() {
        const RunContext silent = session_.silent_context();
        for (const std::string& path : outputs_.folders) {
            std::vector<NumberedMeshes> parts;
            const std::size_t frames = run_->recording().poses[0].frames.size();
            const double rate = scene_.step.frames_per_second;
            MeltingSurface melting = melting_surface();
            session_.warn(melting.warnings);
            if (!melting.is_empty())
                parts.push_back({mesh_names(path_of(path), melting.name()),
                                 {frames, rate, [&](std::size_t frame) {
                                      return melting_mesh(melting, run_->recording(), frame, ready_.origin,
                                                          options_.as_surfels, silent);
                                  }}});
            for (std::size_t b = 0; b < ready_.bodies.size(); ++b)
                if (!melting.has_body(b))
                    parts.push_back(
                        {mesh_names(path_of(path), ready_.bodies[b].name),
                         {frames, rate, [&, b](std::size_t frame) { return run_->mesh(b, frame, silent); }}});
            session_.begin_writing(path);
            session_.warn(require(write_numbered_meshes(parts, session_.context())));
        }
    }

    const SimulateArguments& options_;
    Session& session_;
    SceneFile scene_;
    Outputs outputs_;
    std::optional<SceneFilms> films_;
    ReadyScene ready_;
    std::optional<SceneRun> run_;
    std::optional<std::vector<BodyLook>> looks_;
    std::vector<FinerCheck> finer_; ///< one a body where that was asked for
    Report animation_rows_;
    Json animations_ = Json::array();
    double film_seconds_ = 0, write_seconds_ = 0;
};

void Run::report() const {
    Report report;
    report.add("scene", scene_.path, "scene", scene_.path);
    report.set("outputs", options_.outputs);
    report_run(scene_, ready_, *run_, report);
    report_finer(ready_, finer_, report);
    const std::optional<std::string> doubt = run_->broke_down();
    report.set("doubt", doubt ? Json(*doubt) : Json());
    if (!options_.outputs.empty())
        report.row("written", fmt::format("{} in {}", fmt::join(options_.outputs, ", "), seconds_text(write_seconds_)));
    const ScenePicture& picture = scene_.picture;
    if (options_.draft)
        report.row("draft", fmt::format("{} x {} pixels, {} passes; leave out --draft for the film itself",
                                        picture.size[0], picture.size[1], picture.passes));
    if (films_) report.set("draft", options_.draft);
    if (!options_.save.empty()) report.row("state", options_.save);
    report.set("write_seconds", write_seconds_);
    report.set("film_seconds", film_seconds_);
    if (!animations_.empty()) report.set("animations", animations_);
    report.say(animation_rows_.text());
    session_.print(report);
}

void check(const SimulateArguments& options) {
    std::error_code ignored;
    if (fs::is_directory(path_of(options.save), ignored))
        refuse(ErrorCode::unwritable, options.save + ": cannot be written: it is a folder.");
    check_folder_of(options.save);
    if (options.scene.empty()) refuse("Give a scene: filigree simulate SCENE.toml -o OUT.");
    if (options.outputs.empty() && options.save.empty() && !options.check && !options.finer)
        refuse("Say where the motion goes: -o OUT.fil, -o OUT.glb, -o OUT.pc2, -o FILM.mp4 or -o FOLDER/; or give "
               "--save, --check or --finer.");
    if (options.stop_at && options.save.empty())
        refuse("--stop-at stops a run that goes on later; say where with --save.");
}

void run(const SimulateArguments& options, Session& session) {
    if (options.keys) return session.print(scene_manual(), {{"manual", scene_manual()}});
    check(options);
    run_scene(require(read_scene(options.scene)), options, session);
}

} // namespace

void run_scene(SceneFile scene, const SimulateArguments& options, Session& session) {
    check_animation_options(options.outputs, session);
    Run run(options, std::move(scene), session);
    run.simulate();
    run.write();
    run.report();
    run.doubt();
}

Command simulate_command() {
    const auto options = std::make_shared<SimulateArguments>();
    return {
        .name = "simulate",
        .text = "Simulate a scene: write a film, a model with poses, or meshes",
        .options =
            OptionList{
                Option("scene", options->scene, "Scene (.toml), see docs/scenes.md"),
                Option("-o,--output", options->outputs,
                       "Output: a model with its poses (.fil), a film (.mp4, .gif, NAME_%04d.png), the detailed mesh "
                       "in motion (.glb, .pc2, .mdd, .usda), or a folder of meshes (NAME/). May come several times")
                    .one_at_a_time(),
                Option("--surfels", options->as_surfels,
                       "Write surfels of mpm bodies into folders, not meshes: points with a normal and two half axes"),
                Option("--frames", options->frames, "Number of frames (default: that of the scene)").whole_from(1),
                Option("--draft", options->draft, kDraftHelp),
                Option("--check", options->check,
                       "Also move every vertex by the particles, and report how far the restored mesh is from that"),
                Option("--finer", options->finer,
                       "Also simulate with eight times the particles, and report how far the meshes are from those"),
                Option("--stop-at", options->stop_at, "Stop after this frame; --save keeps the state").whole_from(1),
                Option("--save", options->save, "Write the state at the end, or when cancelled, for --resume"),
                Option("--resume", options->resume, "Continue from a state that --save wrote")} +
            animation_options(options->animation) +
            OptionList{Option("--keys", options->keys, "Print every key that a scene can have, and the materials")},
        .examples = "  filigree simulate bounce.toml -o bounce.mp4 -o bounce.fil\n"
                    "  filigree simulate bounce.toml -o look.mp4 --draft\n"
                    "  filigree simulate bounce.toml -o bounce.glb -o bounce.pc2\n"
                    "  filigree simulate bounce.toml -o meshes/ --frames 60 --check\n"
                    "  filigree simulate long.toml --save state --stop-at 100\n"
                    "  filigree simulate long.toml --resume state -o long.mp4\n"
                    "  filigree simulate --keys",
        .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
