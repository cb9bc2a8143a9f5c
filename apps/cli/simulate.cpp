#include "animation_output.h"
#include "commands.h"
#include "output_folder.h"
#include "stage.h"

#include "filigree/io/file.h"
#include "filigree/present/scene_film.h"
#include "filigree/scene/scene_keys.h"
#include "filigree/scene/scene_run.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

struct SimulateArguments {
    std::string scene, save, resume;
    std::vector<std::string> outputs;
    std::size_t frames = 0, stop_at = 0; ///< 0: as the scene says; not before the end
    bool check = false, keys = false;
    AnimationOutput animation;
};

/// Where a run's results go, sorted by kind, and everything that can be refused before the work.
struct Outputs {
    std::vector<std::string> models, films, folders, animations;

    explicit Outputs(const std::vector<std::string>& paths) {
        for (std::size_t i = 0; i < paths.size(); ++i) {
            const std::string& path = paths[i];
            if (std::find(paths.begin(), paths.begin() + std::ptrdiff_t(i), path) != paths.begin() + std::ptrdiff_t(i))
                refuse(path + ": two outputs cannot go to one place.");
            std::error_code ignored;
            const fs::path folder = fs::path(path).parent_path();
            const bool is_folder = path.ends_with('/') || fs::is_directory(path, ignored);
            if (!is_folder && !folder.empty() && !fs::is_directory(folder, ignored))
                throw Failure{{ErrorCode::unwritable, path + ": cannot be written: there is no such folder."}};
            if (is_folder)
                folders.push_back(path);
            else if (lower_ending(path) == ".fil")
                models.push_back(path);
            else if (is_film_path(path))
                films.push_back(path);
            else if (is_animation_path(path))
                animations.push_back(path);
            else
                throw Failure{{ErrorCode::unsupported,
                               path +
                                   ": is no name for a simulation's output; end it in .fil (a model with its poses), "
                                   ".mp4, .gif or _%04d.png (a film), .glb, .pc2, .mdd or .usda (the detailed mesh "
                                   "moving), or / (a folder of meshes)."}};
        }
    }
};

/// "out.fil", or "out_NAME.fil" where there are several bodies.
std::string model_path(const std::string& path, std::size_t bodies, const std::string& body) {
    if (bodies == 1) return path;
    const fs::path whole(path);
    return (whole.parent_path() / fmt::format("{}_{}{}", whole.stem().string(), body, whole.extension().string()))
        .string();
}

/// Two names of one file, whether it is there or not; both name something.
bool is_one_file(const fs::path& a, const fs::path& b) {
    std::error_code failed;
    if (fs::equivalent(a, b, failed) && !failed) return true; // links of all kinds
    return fs::weakly_canonical(fs::absolute(a), failed) == fs::weakly_canonical(fs::absolute(b), failed) && !failed;
}

/// Whether `file` lies in `folder` and its name is digits between `before` and `after`.
bool is_numbered(const fs::path& file, const fs::path& folder, const std::string& before, const std::string& after) {
    const std::string name = file.filename().string();
    if (name.size() <= before.size() + after.size() || !name.starts_with(before) || !name.ends_with(after))
        return false;
    const std::string_view number =
        std::string_view(name).substr(before.size(), name.size() - before.size() - after.size());
    return number.find_first_not_of("0123456789") == std::string_view::npos &&
           is_one_file(file.parent_path() / ".", folder / ".");
}

/// Refuses outputs that would go over what the run reads, or over each other.
void check_places(const SimulateArguments& options, const SceneFile& scene, const Outputs& outputs) {
    std::vector<std::pair<fs::path, std::string>> taken = {{options.scene, "the scene"}};
    const auto add_mesh = [&](const std::string& mesh) {
        if (!mesh.empty()) taken.emplace_back(mesh, "a mesh of the scene");
    };
    for (const SceneBody& body : scene.bodies) add_mesh(body.mesh);
    for (const SceneObstacle& obstacle : scene.obstacles) add_mesh(obstacle.mesh);
    const auto take = [&](const std::string& path, const std::string& what) {
        for (const auto& [file, is] : taken)
            if (is_one_file(path, file)) refuse(fmt::format("{}: is {} and would be overwritten.", path, is));
        taken.emplace_back(path, what);
    };
    std::vector<std::string> files_read;
    for (const auto& [file, is] : taken) files_read.push_back(file.string());
    if (!options.save.empty()) take(options.save, "where the state goes");
    if (!options.resume.empty()) taken.emplace_back(options.resume, "the state to go on from"); // may be saved over
    for (const std::string& path : outputs.models)
        for (const SceneBody& body : scene.bodies) take(model_path(path, scene.bodies.size(), body.name), "an output");
    const auto take_numbered = [&](const std::string& path, const fs::path& folder, const std::string& before,
                                   const std::string& after) {
        for (const auto& [file, is] : taken)
            if (is_numbered(file, folder, before, after))
                refuse(fmt::format("{}: {} is {} and would be overwritten.", path, file.string(), is));
    };
    for (const std::string& path : outputs.films) {
        const std::string name = fs::path(path).filename().string();
        const std::size_t from = name.find('%'), until = name.find('d', std::min(from, name.size()));
        if (lower_ending(path) == ".png" && until != std::string::npos)
            take_numbered(path, fs::path(path).parent_path(), name.substr(0, from), name.substr(until + 1));
        take(path, "an output");
    }
    for (const std::string& path : outputs.animations)
        for (const SceneBody& body : scene.bodies) {
            const std::string place = model_path(path, scene.bodies.size(), body.name);
            check_not_input(place, files_read);
            take(place, "an output");
        }
    for (const std::string& path : outputs.folders) {
        for (const SceneBody& body : scene.bodies) take_numbered(path, path, body.name + "_", ".ply");
        take(path, "an output");
    }
}

class Run {
public:
    Run(const SimulateArguments& options, Session& session)
        : options_(options), session_(session), scene_(require(read_scene(options.scene))), outputs_(options.outputs) {
        check_places(options, scene_, outputs_);
        if (options.frames) scene_.frames = options.frames;
        open_outputs();
        ready_ = require(set_up(scene_, session.context()));
        for (const std::string& warning : ready_.warnings) session.warn(warning);
        run_.emplace(require(SceneRun::create(scene_, ready_, options.check, session.context())));
        if (!options.resume.empty()) require(run_->resume(require(read_file(options.resume)), options.resume));
    }

    void simulate() {
        const std::size_t last = options_.stop_at ? std::min(options_.stop_at, scene_.frames) : scene_.frames;
        if (run_->frame() > last)
            refuse(
                fmt::format("{}: is at frame {} already, and {} is the last.", options_.resume, run_->frame(), last));
        const Status status = run_->advance_to(last, session_.context());
        for (const std::string& warning : run_->warnings()) session_.warn(warning);
        if (!status && status.error().code == ErrorCode::cancelled) cancelled();
        require(status);
    }

    void write() {
        if (!options_.save.empty()) {
            session_.begin_writing(options_.save);
            save();
        }
        const double start = now_seconds();
        if (!films_.empty()) {
            film();
            for (const std::string& path : outputs_.films) session_.begin_writing(path);
            for (FilmWriter& film : films_) require(film.finish());
        }
        for (ReadyBody& body : ready_.bodies) body.model.mesh.origin = ready_.origin;
        write_meshes();
        for (const std::string& path : outputs_.models)
            for (std::size_t b = 0; b < ready_.bodies.size(); ++b)
                session_.write_model(ready_.bodies[b].model,
                                     model_path(path, ready_.bodies.size(), ready_.bodies[b].name),
                                     run_->recording().poses[b]);
        write_animations();
        write_seconds_ = now_seconds() - start;
    }

    void report() const;

private:
    void report_bodies(Table& table, Json& json) const;
    void report_frames(Table& table, Json& json) const;
    void report_checks(Table& table, Json& json) const;

    void write_animations() {
        for (const std::string& path : outputs_.animations)
            for (std::size_t b = 0; b < ready_.bodies.size(); ++b) {
                Report report;
                write_animation_output(ready_.bodies[b].model, stream_of(run_->recording().poses[b]), {},
                                       options_.animation,
                                       model_path(path, ready_.bodies.size(), ready_.bodies[b].name),
                                       scene_.bodies[b].mesh, session_, report);
                animation_rows_.append(report.table());
                animations_.push_back(report.json());
            }
    }
    void film() {
        const double start = now_seconds();
        for (const std::string& warning :
             require(film_scene(scene_, ready_, run_->recording(), *renderer_, films_, session_.context())))
            session_.warn(warning);
        film_seconds_ = now_seconds() - start;
    }
    void open_outputs() {
        if (!outputs_.films.empty()) renderer_.emplace(require(HeadlessRenderer::create()));
        for (const std::string& path : outputs_.films)
            films_.push_back(require(
                FilmWriter::create(path, scene_.picture.width, scene_.picture.height, scene_.step.frames_per_second)));
    }

    void save() { require(write_file(options_.save, run_->save())); }

    [[noreturn]] void cancelled() {
        if (options_.save.empty()) throw Failure{cancelled_error()};
        save();
        throw Failure{{ErrorCode::cancelled, fmt::format("Cancelled after frame {} of {}; go on with --resume {}.",
                                                         run_->frame(), scene_.frames, options_.save)}};
    }

    /// A mesh a frame and body.
    void write_meshes() {
        for (const std::string& path : outputs_.folders) {
            OutputFolder folder(path, options_.scene);
            std::vector<std::vector<std::string>> files(ready_.bodies.size());
            for (std::size_t b = 0; b < files.size(); ++b)
                for (std::size_t frame = 0; frame < run_->recording().poses[b].frames.size(); ++frame)
                    files[b].push_back(folder.file(fmt::format("{}_{:04}.ply", ready_.bodies[b].name, frame + 1)));
            RunContext silent = session_.context();
            silent.progress = nullptr;
            for (std::size_t frame = 0; frame < files[0].size(); ++frame) {
                session_.context().report("writing meshes", double(frame) / double(files[0].size()));
                for (std::size_t b = 0; b < files.size(); ++b)
                    session_.write_mesh(require(run_->mesh(b, frame, silent)), files[b][frame]);
            }
            session_.context().report("writing meshes", 1);
            folder.keep();
        }
    }

    const SimulateArguments& options_;
    Session& session_;
    SceneFile scene_;
    Outputs outputs_;
    std::optional<HeadlessRenderer> renderer_;
    std::vector<FilmWriter> films_;
    ReadyScene ready_;
    std::optional<SceneRun> run_;
    Table animation_rows_;
    Json animations_ = Json::array();
    double film_seconds_ = 0, write_seconds_ = 0;
};

Json energy_json(const Energy& energy) {
    return {{"kinetic", energy.kinetic}, {"elastic", energy.elastic}, {"potential", energy.potential}};
}

std::string energy_text(const Energy& e) {
    return fmt::format("{:.4g} J  (kinetic {:.4g}, elastic {:.4g}, potential {:.4g})", e.total(), e.kinetic, e.elastic,
                       e.potential);
}

void Run::report_bodies(Table& table, Json& json) const {
    for (std::size_t b = 0; b < ready_.bodies.size(); ++b) {
        const ReadyBody& body = ready_.bodies[b];
        const std::size_t elements = body.body->cells.cells.size(), vertices = body.model.mesh.vertex_count(),
                          driver = body.model.driver().vertices.size();
        table.row(body.name,
                  fmt::format("{} particles, {} cells of {:.3g} m; {:.4g} kg, {:.4g} m^3; {} vertices by a "
                              "driver of {}",
                              with_commas(body.body->particle_count()), with_commas(elements), body.body->spacing(),
                              body.report.mass, body.report.cells.volume, with_commas(vertices), with_commas(driver)));
        json["bodies"].push_back({{"name", body.name},
                                  {"particles", body.body->particle_count()},
                                  {"elements", elements},
                                  {"spacing_m", body.body->spacing()},
                                  {"mass_kg", body.report.mass},
                                  {"volume_m3", body.report.cells.volume},
                                  {"thin_cells", body.report.cells.thin_cells},
                                  {"loose_parts", body.report.cells.loose_parts},
                                  {"vertices", vertices},
                                  {"driver_vertices", driver}});
    }
}

void Run::report_frames(Table& table, Json& json) const {
    const RunTotals& t = run_->recording().totals;
    const RunTimes& times = run_->times();
    const double frames = double(std::max<std::uint64_t>(t.frames, 1));
    const Energy end = run_->energy();
    const auto ms = [&](double seconds) { return 1e3 * seconds / double(std::max<std::uint64_t>(times.frames, 1)); };
    table.row("frames",
              fmt::format("{} of {}, at {} a second", t.frames, scene_.frames, scene_.step.frames_per_second));
    const std::uint64_t least = t.frames ? t.least_substeps : 0;
    table.row("substeps",
              fmt::format("{} to {} a frame, {:.3g} on average; {} frames explicit, {} by descent", least,
                          t.most_substeps, double(t.substeps) / frames, t.explicit_frames, t.descent_frames));
    const double seconds = times.elastic + times.contact + times.other;
    table.row("time a frame", fmt::format("{:.3g} ms elastic, {:.3g} contacts, {:.3g} other, {:.3g} driver, {:.3g} "
                                          "restore: {:.3g} in all",
                                          ms(times.elastic), ms(times.contact), ms(times.other), ms(times.coupling),
                                          ms(times.restore), ms(seconds + times.coupling + times.restore)));
    table.row("cells",
              fmt::format("{:.3g} of their volume at least, stretched {:.3g} times at most{}", t.least_volume_ratio,
                          t.most_stretch, t.least_volume_ratio <= 0 ? "; some were inside out" : ""));
    table.row("contacts",
              fmt::format("{} points at most, {:.3g} m deep at most", with_commas(t.most_contacts), t.deepest_contact));
    table.row("energy at the start", energy_text(t.start));
    table.row("and at the end", energy_text(end));
    if (t.clamped_particles) table.row("clamped", with_commas(t.clamped_particles) + " motions of particles");
    json["frames"] = t.frames;
    json["frames_per_second"] = scene_.step.frames_per_second;
    json["explicit_frames"] = t.explicit_frames;
    json["descent_frames"] = t.descent_frames;
    json["substeps"] = {{"min", least}, {"mean", double(t.substeps) / frames}, {"max", t.most_substeps}};
    json["ms_a_frame"] = {{"elastic", ms(times.elastic)},
                          {"contacts", ms(times.contact)},
                          {"other", ms(times.other)},
                          {"driver", ms(times.coupling)},
                          {"restore", ms(times.restore)}};
    json["least_volume_ratio"] = t.least_volume_ratio;
    json["most_stretch"] = t.most_stretch;
    json["most_contacts"] = t.most_contacts;
    json["deepest_contact_m"] = t.deepest_contact;
    json["clamped_particles"] = t.clamped_particles;
    json["energy_start"] = energy_json(t.start);
    json["energy_end"] = energy_json(end);
}

void Run::report_checks(Table& table, Json& json) const {
    const RunTimes& times = run_->times();
    const double frames = double(std::max<std::uint64_t>(run_->frame(), 1));
    const std::vector<CheckTotals>& checks = run_->recording().checks;
    for (std::size_t b = 0; b < checks.size(); ++b) {
        const CheckTotals& check = checks[b];
        table.row(ready_.bodies[b].name + ", restored",
                  fmt::format("rms {:.2e} of the diagonal from all attached (worst frame {:.2e}, worst vertex {:.2e}); "
                              "95 % of normals within {:.3g} degrees (worst frame {:.3g})",
                              check.rms_sum / frames, check.worst_rms, check.worst_max, check.p95_sum / frames,
                              check.worst_p95));
        json["bodies"].at(b)["check"] = {{"rms_mean", check.rms_sum / frames},
                                         {"rms_worst", check.worst_rms},
                                         {"max_worst", check.worst_max},
                                         {"normal_p95_deg_mean", check.p95_sum / frames},
                                         {"normal_p95_deg_worst", check.worst_p95}};
    }
    if (!checks.empty() && times.frames) {
        const double ratio = times.direct / (times.coupling + times.restore);
        table.row("attached directly", fmt::format("{:.3g} ms a frame: {:.3g} times the driver and the restore",
                                                   1e3 * times.direct / double(times.frames), ratio));
        json["direct_ms_a_frame"] = 1e3 * times.direct / double(times.frames);
        json["direct_ratio"] = ratio;
    }
}

void Run::report() const {
    Table table;
    Json json = {{"scene", options_.scene}, {"outputs", options_.outputs}, {"bodies", Json::array()}};
    table.row("scene", options_.scene);
    report_bodies(table, json);
    report_frames(table, json);
    report_checks(table, json);
    if (!options_.outputs.empty())
        table.row("written", fmt::format("{} in {}", fmt::join(options_.outputs, ", "), seconds_text(write_seconds_)));
    if (!options_.save.empty()) table.row("state", options_.save);
    json["write_seconds"] = write_seconds_;
    json["film_seconds"] = film_seconds_;
    if (!animations_.empty()) json["animations"] = animations_;
    session_.print(table.text() + animation_rows_.text(), json);
}

void check(const SimulateArguments& options, const Session& session) {
    std::error_code ignored;
    const fs::path folder = fs::path(options.save).parent_path();
    if (fs::is_directory(options.save, ignored) || (!folder.empty() && !fs::is_directory(folder, ignored)))
        throw Failure{{ErrorCode::unwritable, options.save + ": cannot be written: it is a folder, or in none."}};
    if (options.scene.empty()) refuse("Give a scene: filigree simulate SCENE.toml -o OUT.");
    if (options.outputs.empty() && options.save.empty() && !options.check)
        refuse("Say where the motion goes: -o OUT.fil, -o OUT.glb, -o OUT.pc2, -o FILM.mp4 or -o FOLDER/; or give "
               "--save or "
               "--check.");
    check_animation_options(options.outputs, session);
    if (options.stop_at && options.save.empty())
        refuse("--stop-at stops a run that goes on later; say where with --save.");
}

void run(const SimulateArguments& options, Session& session) {
    if (options.keys) return session.print(scene_manual(), {{"manual", scene_manual()}});
    check(options, session);
    Run run(options, session);
    run.simulate();
    run.write();
    run.report();
}

} // namespace

Command simulate_command() {
    const auto options = std::make_shared<SimulateArguments>();
    return {.name = "simulate",
            .text = "Let the bodies of a scene move: a film, a model with poses, or meshes",
            .options =
                OptionList{
                    Option("scene", options->scene, "Scene (.toml), see docs/scenes.md"),
                    Option("-o,--output", options->outputs,
                           "A model with its poses (.fil), a film (.mp4, .gif, NAME_%04d.png), the detailed mesh "
                           "moving (.glb, .pc2, .mdd, .usda), or a folder of meshes (NAME/); may come several times")
                        .one_at_a_time(),
                    Option("--frames", options->frames, "Frames to compute (unset: as the scene says)").whole_from(1),
                    Option("--check", options->check,
                           "Also carry every vertex by the particles, and say how far the restored mesh is from that"),
                    Option("--stop-at", options->stop_at, "Stop after this frame, to go on later; with --save")
                        .whole_from(1),
                    Option("--save", options->save, "Write the state at the end, or when cancelled, to go on from"),
                    Option("--resume", options->resume, "Go on from a state that --save wrote")} +
                animation_options(options->animation) +
                OptionList{Option("--keys", options->keys, "Print every key that a scene can have, and the materials")},
            .examples = "  filigree simulate bounce.toml -o bounce.mp4 -o bounce.fil\n"
                        "  filigree simulate bounce.toml -o bounce.glb -o bounce.pc2\n"
                        "  filigree simulate bounce.toml -o meshes/ --frames 60 --check\n"
                        "  filigree simulate long.toml --save state --stop-at 100\n"
                        "  filigree simulate long.toml --resume state -o long.mp4\n"
                        "  filigree simulate --keys",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
