#include "animation_output.h"
#include "commands.h"
#include "output_folder.h"
#include "simulate_film.h"
#include "simulate_recording.h"

#include "filigree/hierarchy/restore.h"
#include "filigree/io/file.h"
#include "filigree/mesh/normals.h"

#include <algorithm>
#include <filesystem>
#include <numbers>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

struct Options {
    std::string scene, save, resume;
    std::vector<std::string> outputs;
    std::size_t frames = 0, stop_at = 0; ///< 0: as the scene says; not before the end
    bool check = false, keys = false;
    AnimationOutput animation;
};

[[noreturn]] void refuse(const std::string& sentence) { throw Failure{{ErrorCode::usage, sentence}}; }

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
void check_places(const Options& options, const SceneFile& scene, const Outputs& outputs) {
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

double percentile_95(std::vector<float>& values) {
    if (values.empty()) return 0;
    const auto place = values.begin() + std::ptrdiff_t(0.95 * double(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

class Run {
public:
    Run(const Options& options, Session& session)
        : options_(options), session_(session), scene_(read_scene(options.scene)), outputs_(options.outputs),
          always_(session.threads) {
        check_places(options, scene_, outputs_);
        if (options.frames) scene_.frames = options.frames;
        open_outputs();
        ready_ = set_up(scene_, session);
        simulation_ = require(Simulation::create(ready_.world, ready_.actors, scene_.step, session.context()));
        prepare();
        if (options.resume.empty())
            start();
        else
            require(unpack_state(require(read_file(options.resume)), options.resume, ready_.hash, recording_,
                                 *simulation_));
    }

    void simulate() {
        const std::size_t last = options_.stop_at ? std::min(options_.stop_at, scene_.frames) : scene_.frames;
        if (recording_.totals.frames > last)
            refuse(fmt::format("{}: is at frame {} already, and {} is the last.", options_.resume,
                               recording_.totals.frames, last));
        const std::size_t first = recording_.totals.frames;
        RunContext silent = session_.context(); // the bar tells of frames
        silent.progress = nullptr;
        for (std::size_t frame = first; frame < last; ++frame) {
            session_.context().report("simulating", double(frame - first) / double(last - first));
            const Result<FrameReport> report = simulation_->advance(silent);
            if (!report && report.error().code == ErrorCode::cancelled) cancelled(frame);
            record(require(report));
        }
        session_.context().report("simulating", 1);
        warn_of_trouble();
    }

    void write() {
        if (!options_.save.empty()) {
            session_.begin_writing(options_.save);
            save();
        }
        const double start = now_seconds();
        if (!films_.empty()) {
            film_seconds_ = film_scene(scene_, ready_, recording_, *stage_, films_, session_);
            for (const std::string& path : outputs_.films) session_.begin_writing(path);
            for (FilmWriter& film : films_) require(film.finish());
        }
        for (SetUpBody& body : ready_.bodies) body.model.mesh.origin = ready_.origin;
        write_meshes();
        for (const std::string& path : outputs_.models)
            for (std::size_t b = 0; b < ready_.bodies.size(); ++b)
                session_.write_model(ready_.bodies[b].model,
                                     model_path(path, ready_.bodies.size(), ready_.bodies[b].name),
                                     recording_.poses[b]);
        write_animations();
        write_seconds_ = now_seconds() - start;
    }

    void report() const;

private:
    void write_animations() {
        for (const std::string& path : outputs_.animations)
            for (std::size_t b = 0; b < ready_.bodies.size(); ++b) {
                Report report;
                write_animation_output(ready_.bodies[b].model, stream_of(recording_.poses[b]), {}, options_.animation,
                                       model_path(path, ready_.bodies.size(), ready_.bodies[b].name),
                                       scene_.bodies[b].mesh, session_, report);
                animation_rows_.append(report.table());
                animations_.push_back(report.json());
            }
    }
    void open_outputs() {
        if (!outputs_.films.empty()) stage_.emplace(session_);
        for (const std::string& path : outputs_.films)
            films_.push_back(require(
                FilmWriter::create(path, scene_.picture.width, scene_.picture.height, scene_.step.frames_per_second)));
    }

    void prepare() {
        for (std::size_t b = 0; b < ready_.bodies.size(); ++b) {
            const SetUpBody& body = ready_.bodies[b];
            const auto attach = [&](std::vector<Vec3f> points) {
                for (Vec3f& p : points) p *= float(body.scale);
                return simulation_->attach(b, points, always_);
            };
            drivers_.push_back(attach(driver_positions(body.model)));
            restorers_.push_back(require(Restorer::create(body.model, {}, always_)));
            restored_.emplace_back(body.model.mesh.vertex_count());
            if (options_.check) direct_.push_back(attach(body.model.mesh.positions));
        }
        recording_.poses.assign(ready_.bodies.size(), {scene_.step.frames_per_second, {}});
        if (scene_.picture.particles) recording_.particles.resize(ready_.bodies.size());
        if (options_.check) recording_.checks.resize(ready_.bodies.size());
    }

    void start() {
        recording_.totals.start = simulation_->energy(always_);
        for (std::size_t b = 0; b < ready_.bodies.size(); ++b) record_body(b);
        recording_.totals.coupling_seconds = recording_.totals.restore_seconds = 0; // the start is no frame
        for (CheckTotals& check : recording_.checks) check = {};
    }

    void record(const FrameReport& report) {
        recording_.totals.add(report);
        last_volume_ratio_ = report.least_volume_ratio;
        for (std::size_t b = 0; b < ready_.bodies.size(); ++b) record_body(b);
    }

    /// The driver's pose in metres, the mesh that follows from it, and how far that is from the truth.
    void record_body(std::size_t b) {
        const double start = now_seconds();
        const SetUpBody& body = ready_.bodies[b];
        Pose& pose = recording_.poses[b].frames.emplace_back();
        pose.positions.resize(body.model.driver().vertices.size());
        pose.gradients.resize(pose.positions.size());
        simulation_->attached(drivers_[b], pose.positions, pose.gradients, always_);
        for (Mat3f& gradient : pose.gradients) gradient *= float(body.scale);
        const double moved = now_seconds();
        hold_lost(b);
        require(restorers_[b].positions(pose, restored_[b], always_));
        recording_.totals.coupling_seconds += moved - start;
        recording_.totals.restore_seconds += now_seconds() - moved;
        if (options_.check) check_body(b);
        if (recording_.particles.empty()) return;
        const Vectors& particles = simulation_->positions(b);
        std::vector<Vec3f>& drawn = recording_.particles[b].emplace_back();
        for (std::size_t i = 0; i < particles.size(); ++i) drawn.push_back(particles[i]);
    }

    /// Driver vertices that went nowhere sensible in a frame stay where they were, so that one does not spoil all.
    void hold_lost(std::size_t b) {
        constexpr double kFar = 1e4; // diagonals a frame
        std::vector<Pose>& frames = recording_.poses[b].frames;
        if (frames.size() < 2) return;
        const SetUpBody& body = ready_.bodies[b];
        const Pose& before = frames[frames.size() - 2];
        Pose& now = frames.back();
        const auto far = static_cast<float>(kFar * body.scale * bounds(body.model.mesh.positions).diagonal());
        const float most_gradient = float(kFar * body.scale);
        std::size_t lost = 0;
        for (std::size_t v = 0; v < now.positions.size(); ++v) {
            const bool is_near = (now.positions[v] - before.positions[v]).norm() <= far;
            if (is_near && now.gradients[v].norm() <= most_gradient) continue; // false for what is not a number
            now.positions[v] = before.positions[v];
            now.gradients[v] = before.gradients[v];
            ++lost;
        }
        if (lost > 0)
            session_.warn(fmt::format("body '{}': the motion broke down at some of its surface, first in frame {}; "
                                      "parts of the driver were held where they were",
                                      body.name, first_lost(b)));
    }
    std::size_t first_lost(std::size_t b) { return lost_.try_emplace(b, recording_.totals.frames).first->second; }

    /// What makes the motion doubtful, or other than the scene says.
    void warn_of_trouble() {
        const Totals& t = recording_.totals;
        if (t.clamped_particles > 0)
            session_.warn(fmt::format("{} motions of particles were not finite or had to be limited: the motion is not "
                                      "to be trusted",
                                      with_commas(t.clamped_particles)));
        if (last_volume_ratio_ <= 0)
            session_.warn("some cells are inside out at the end: the bodies were pressed or pulled too hard");
        if (t.frames > 0 && is_left_alone()) warn_of_energy();
        const bool is_deadened = std::any_of(scene_.bodies.begin(), scene_.bodies.end(),
                                             [](const SceneBody& body) { return body.material.internal_damping > 0; });
        const bool is_springy = std::any_of(scene_.obstacles.begin(), scene_.obstacles.end(),
                                            [](const SceneObstacle& obstacle) { return obstacle.sets_restitution; });
        if (t.descent_frames > 0 && (is_deadened || is_springy))
            session_.warn(fmt::format("{} frames were computed by descent, whose own damping takes the place of {}; "
                                      "mode = \"explicit\" heeds {}",
                                      with_commas(t.descent_frames),
                                      !is_springy    ? "internal_damping"
                                      : !is_deadened ? "restitution"
                                                     : "internal_damping and restitution",
                                      is_deadened && is_springy ? "them" : "it"));
    }

    /// Whether nothing in the scene does work on the bodies but gravity.
    bool is_left_alone() const {
        return scene_.pins.empty() && scene_.hands.empty() && scene_.forces.empty() && scene_.wind.times.empty() &&
               scene_.wind.constant.isZero() &&
               std::none_of(scene_.obstacles.begin(), scene_.obstacles.end(),
                            [](const SceneObstacle& obstacle) { return obstacle.motion.moves(); });
    }

    void warn_of_energy() {
        constexpr double kGrowth = 0.05, kNoise = 1e-8; // the latter: elastic energy of a strain of 1e-4
        const Energy &start = recording_.totals.start, end = simulation_->energy(always_);
        double least = 0; // J, below which energies are rounding
        for (const SetUpBody& body : ready_.bodies)
            least += kNoise * body.body->material.young_modulus * body.report.cells.volume;
        // The potential has no zero of its own: what counts is how much of it came or went.
        const double had = start.kinetic + start.elastic + std::abs(end.potential - start.potential);
        const double grown = end.total() - start.total();
        if (grown <= kGrowth * had + least) return;
        session_.warn(fmt::format("the energy grew by {:.3g} J although nothing did work: bodies start inside "
                                  "something, or the motion is not to be trusted",
                                  grown));
    }

    void check_body(std::size_t b) {
        const SetUpBody& body = ready_.bodies[b];
        const std::vector<Vec3f>& restored = restored_[b];
        std::vector<Vec3f> direct(restored.size());
        const double start = now_seconds();
        simulation_->attached(direct_[b], direct, {}, always_);
        const double seconds = now_seconds() - start;
        double squares = 0, most = 0;
        for (std::size_t v = 0; v < direct.size(); ++v) {
            const double distance = (direct[v] - restored[v]).cast<double>().norm();
            squares += distance * distance;
            most = std::max(most, distance);
        }
        const std::vector<Vec3f> ours = vertex_normals(body.model.mesh, restored, always_),
                                 theirs = vertex_normals(body.model.mesh, direct, always_);
        std::vector<float> angles;
        for (std::size_t v = 0; v < ours.size(); ++v)
            if (!ours[v].isZero() && !theirs[v].isZero())
                angles.push_back(std::atan2(ours[v].cross(theirs[v]).norm(), ours[v].dot(theirs[v])) * 180 /
                                 std::numbers::pi_v<float>);
        const double diagonal = body.scale * bounds(body.model.mesh.positions).diagonal(), p95 = percentile_95(angles);
        const double rms = std::sqrt(squares / double(direct.size())) / diagonal;
        CheckTotals& check = recording_.checks[b];
        check.rms_sum += rms;
        check.worst_rms = std::max(check.worst_rms, rms);
        check.worst_max = std::max(check.worst_max, most / diagonal);
        check.p95_sum += p95;
        check.worst_p95 = std::max(check.worst_p95, p95);
        check.direct_seconds += seconds;
    }

    void save() { require(write_file(options_.save, pack_state(recording_, *simulation_, ready_.hash))); }

    [[noreturn]] void cancelled(std::size_t frame) {
        if (options_.save.empty()) throw Failure{cancelled_error()};
        save();
        throw Failure{{ErrorCode::cancelled, fmt::format("Cancelled after frame {} of {}; go on with --resume {}.",
                                                         frame, scene_.frames, options_.save)}};
    }

    /// A mesh a frame and body.
    void write_meshes() {
        for (const std::string& path : outputs_.folders) {
            OutputFolder folder(path, options_.scene);
            std::vector<std::vector<std::string>> files(ready_.bodies.size());
            for (std::size_t b = 0; b < files.size(); ++b)
                for (std::size_t frame = 0; frame < recording_.poses[b].frames.size(); ++frame)
                    files[b].push_back(folder.file(fmt::format("{}_{:04}.ply", ready_.bodies[b].name, frame + 1)));
            RunContext silent = session_.context();
            silent.progress = nullptr;
            for (std::size_t frame = 0; frame < files[0].size(); ++frame) {
                session_.context().report("writing meshes", double(frame) / double(files[0].size()));
                for (std::size_t b = 0; b < files.size(); ++b) {
                    Mesh mesh = require(restorers_[b].mesh(recording_.poses[b].frames[frame], silent));
                    mesh.origin = ready_.origin;
                    session_.write_mesh(std::move(mesh), files[b][frame]);
                }
            }
            session_.context().report("writing meshes", 1);
            folder.keep();
        }
    }

    const Options& options_;
    Session& session_;
    SceneFile scene_;
    Outputs outputs_;
    RunContext always_; ///< not cancelled: what is recorded of a frame is whole
    std::optional<Stage> stage_;
    std::vector<FilmWriter> films_;
    SetUpScene ready_;
    std::optional<Simulation> simulation_;
    std::vector<std::size_t> drivers_, direct_; ///< attachments
    std::vector<Restorer> restorers_;
    std::vector<std::vector<Vec3f>> restored_;
    Recording recording_;
    std::map<std::size_t, std::size_t> lost_; ///< by body: the first frame that hold_lost met
    float last_volume_ratio_ = 1;
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

void Run::report() const {
    const Totals& t = recording_.totals;
    const double frames = double(std::max<std::uint64_t>(t.frames, 1));
    const Energy end = simulation_->energy(always_);
    Table table;
    Json json = {{"scene", options_.scene}, {"outputs", options_.outputs}, {"bodies", Json::array()}};
    table.row("scene", options_.scene);
    for (std::size_t b = 0; b < ready_.bodies.size(); ++b) {
        const SetUpBody& body = ready_.bodies[b];
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
    table.row("frames",
              fmt::format("{} of {}, at {} a second", t.frames, scene_.frames, scene_.step.frames_per_second));
    const std::uint64_t least = t.frames ? t.least_substeps : 0;
    table.row("substeps",
              fmt::format("{} to {} a frame, {:.3g} on average; {} frames explicit, {} by descent", least,
                          t.most_substeps, double(t.substeps) / frames, t.explicit_frames, t.descent_frames));
    const auto ms = [&](double seconds) { return 1e3 * seconds / frames; };
    const double seconds = t.elastic_seconds + t.contact_seconds + t.other_seconds;
    table.row("time a frame",
              fmt::format("{:.3g} ms elastic, {:.3g} contacts, {:.3g} other, {:.3g} driver, {:.3g} "
                          "restore: {:.3g} in all",
                          ms(t.elastic_seconds), ms(t.contact_seconds), ms(t.other_seconds), ms(t.coupling_seconds),
                          ms(t.restore_seconds), ms(seconds + t.coupling_seconds + t.restore_seconds)));
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
    json["ms_a_frame"] = {{"elastic", ms(t.elastic_seconds)},
                          {"contacts", ms(t.contact_seconds)},
                          {"other", ms(t.other_seconds)},
                          {"driver", ms(t.coupling_seconds)},
                          {"restore", ms(t.restore_seconds)}};
    json["least_volume_ratio"] = t.least_volume_ratio;
    json["most_stretch"] = t.most_stretch;
    json["most_contacts"] = t.most_contacts;
    json["deepest_contact_m"] = t.deepest_contact;
    json["clamped_particles"] = t.clamped_particles;
    json["energy_start"] = energy_json(t.start);
    json["energy_end"] = energy_json(end);
    double direct = 0;
    for (std::size_t b = 0; b < recording_.checks.size(); ++b) {
        const CheckTotals& check = recording_.checks[b];
        direct += check.direct_seconds;
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
    if (!recording_.checks.empty() && t.frames) {
        const double ratio = direct / (t.coupling_seconds + t.restore_seconds);
        table.row("attached directly",
                  fmt::format("{:.3g} ms a frame: {:.3g} times the driver and the restore", ms(direct), ratio));
        json["direct_ms_a_frame"] = ms(direct);
        json["direct_ratio"] = ratio;
    }
    if (!options_.outputs.empty())
        table.row("written", fmt::format("{} in {}", fmt::join(options_.outputs, ", "), seconds_text(write_seconds_)));
    if (!options_.save.empty()) table.row("state", options_.save);
    json["write_seconds"] = write_seconds_;
    json["film_seconds"] = film_seconds_;
    if (!animations_.empty()) json["animations"] = animations_;
    session_.print(table.text() + animation_rows_.text(), json);
}

void check(const Options& options, const Session& session) {
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

void run(const Options& options, Session& session) {
    if (options.keys) return session.print(scene_manual(), {{"manual", scene_manual()}});
    check(options, session);
    Run run(options, session);
    run.simulate();
    run.write();
    run.report();
}

} // namespace

Command simulate_command() {
    const auto options = std::make_shared<Options>();
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
