#include "filigree/fit.h"

#include "filigree/blend/bind_levels.h"
#include "filigree/blend/driver_search.h"
#include "filigree/core/math.h"
#include "filigree/fit/animation_survey.h"
#include "filigree/fit/driver_family.h"
#include "filigree/fit/fitted_poses.h"
#include "filigree/fit/free_weights.h"
#include "filigree/mesh/normals.h"
#include "filigree/restore.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace filigree {

namespace {

constexpr std::size_t kFarthestFrames = 6, kSampleFrames = 16;
constexpr std::size_t kMostShare = 4; // a driver vertex costs 12 numbers a frame, a vertex of a cache 3
constexpr std::size_t kMostDriver = 20'000;
constexpr std::size_t kSmallMesh = 64;    // vertices that a driver may have however small the mesh
constexpr std::size_t kFirstDriver = 300; // with which choices are compared
constexpr std::size_t kMostSampleTries = 12, kMostTries = 6;
constexpr double kClearlyBetter = 0.95; // of the rest driver's error: what another choice has to be below
constexpr double kAim = 0.93;           // of the goal: what a new driver is sized for
constexpr double kCloseEnough = 1.15;   // in vertices: a driver that small a step above the least is taken
constexpr double kLeastSlope = 0.5, kMostSlope = 2, kUsualSlope = 1.2; // of log error over log vertices

Error unsuitable(const std::string& sentence) { return {ErrorCode::unsuitable, sentence}; }

std::string short_number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g", value);
    return text;
}

std::optional<Error> check_options(const MeshAnimation& animation, const FitOptions& options) {
    const auto usage = [](const std::string& sentence) { return Error{ErrorCode::usage, sentence}; };
    if (std::optional<Error> error = mesh_error(*animation.rest)) return error;
    if (!(options.error > 0 && options.error <= 1))
        return usage("error must be above 0 and at most 1: it is a fraction of the diagonal.");
    if (options.max_error && !(*options.max_error > 0 && *options.max_error <= 1))
        return usage("max_error must be above 0 and at most 1: it is a fraction of the diagonal.");
    if (options.base && *options.base < DriverSearch::kSmallest)
        return usage("base must be " + std::to_string(DriverSearch::kSmallest) + " or more.");
    if (animation.frames == 0) return unsuitable("The animation has no frames: there is nothing to fit.");
    if (options.rest_frame && *options.rest_frame >= animation.frames)
        return usage("rest_frame is " + std::to_string(*options.rest_frame) +
                     ", and the animation has the frames 0 to " + std::to_string(animation.frames - 1) + ".");
    if (animation.rest->face_count() == 0)
        return unsuitable("The mesh has no faces: a driver follows a surface. Give a mesh with faces.");
    return std::nullopt;
}

/// The mesh as a frame has it; its own where none is asked for.
Result<Mesh> rest_mesh(const MeshAnimation& animation, const FitOptions& options, const RunContext& context) {
    Mesh mesh = *animation.rest;
    if (!options.rest_frame) return mesh;
    if (Status read = animation.positions(*options.rest_frame, mesh.positions); !read) return read.error();
    if (!mesh.normals.empty()) mesh.normals = {vertex_normals(mesh, mesh.positions, context), {}};
    if (std::optional<Error> error = mesh_error(mesh, "Frame " + std::to_string(*options.rest_frame + 1)))
        return *error;
    return mesh;
}

/// Up to `most` frames, evenly spread.
std::vector<std::size_t> some_frames(std::size_t frames, std::size_t most) {
    const std::size_t count = std::min(frames, most);
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < count; ++i) chosen.push_back((2 * i + 1) * frames / (2 * count));
    return chosen;
}

/// The errors that were asked for, as one number: 1 or less is good enough.
struct Goal {
    double rms;                ///< model units
    std::optional<double> max; ///< model units

    double score(const AnimationError& error) const {
        return max ? std::max(error.rms / rms, error.max / *max) : error.rms / rms;
    }
};

PoseFitOptions pose_options(const FitOptions& options) { return {.refine = !options.sound_gradients}; }

/// Some frames of the family's sample, in memory, on which drivers are tried.
class Sample {
public:
    Sample(const DriverFamily& family) : family_(family) {}

    /// frames: which; Memory: all of them, of the sample's vertices.
    static Result<std::vector<std::vector<Vec3f>>> read(const DriverFamily& family, const MeshAnimation& animation,
                                                        std::span<const std::size_t> frames,
                                                        const RunContext& context) {
        std::vector<std::vector<Vec3f>> read;
        std::vector<Vec3f> positions(animation.rest->vertex_count());
        for (const std::size_t frame : frames) {
            if (Status done = animation.positions(frame, positions); !done) return done.error();
            std::vector<Vec3f>& some = read.emplace_back();
            some.reserve(family.sample_vertices().size());
            for (const Index v : family.sample_vertices()) some.push_back(positions[v]);
            if (context.is_cancelled()) return cancelled_error();
        }
        return read;
    }

    void set_frames(std::vector<std::vector<Vec3f>> frames) { frames_ = std::move(frames); }

    struct Tried {
        std::size_t vertices; ///< that the driver has
        AnimationError error;
    };
    Result<Tried> try_driver(DriverChoice choice, std::size_t vertices, const FitOptions& options,
                             const RunContext& context) const {
        Level driver = family_.sample_driver(choice, vertices);
        const std::size_t count = driver.vertices.size();
        std::vector<Level> levels;
        levels.push_back(std::move(driver));
        Result<Model> model = bind_to_levels(family_.sample_mesh(), std::move(levels), family_.sample_work(), context);
        if (!model) return model.error();
        const auto frame = [&](std::size_t k, std::span<Vec3f> positions) -> Status {
            std::ranges::copy(frames_[k], positions.begin());
            return Success{};
        };
        const Result<FittedPoses> fitted =
            fit_poses_and_weights(*model, frames_.size(), frame, options.weight_rounds, pose_options(options), context);
        if (!fitted) return fitted.error();
        return Tried{count, fitted->error};
    }

private:
    const DriverFamily& family_;
    std::vector<std::vector<Vec3f>> frames_;
};

/// The frames farthest from rest, about their middles and in units of the sample's diagonal, which is what a family
/// orders by.
std::vector<std::vector<Vec3f>> shapes_of(std::vector<std::vector<Vec3f>> frames, std::span<const Vec3d> middles,
                                          std::span<const std::size_t> numbers, double diagonal) {
    for (std::size_t k = 0; k < frames.size(); ++k)
        for (Vec3f& p : frames[k]) p = ((p.cast<double>() - middles[numbers[k]]) / diagonal).cast<float>();
    return frames;
}

/// One driver of a size and its error: what a search knows.
struct Known {
    double vertices = 0, score = 0;
};

/// log error over log vertices falls with this slope between two drivers.
double slope_between(const Known& a, const Known& b) {
    if (a.vertices == b.vertices || !(a.score > 0) || !(b.score > 0)) return kUsualSlope;
    const double slope = -math::log(b.score / a.score) / math::log(b.vertices / a.vertices);
    return std::clamp(slope, kLeastSlope, kMostSlope);
}

/// What the search for the driver works with.
class FitWork {
public:
    FitWork(const MeshAnimation& animation, const FitOptions& options, const RunContext& context)
        : animation_(animation), options_(options), context_(context) {
        silent_.progress = {};
    }

    Result<Fitted> run();

private:
    Status prepare();
    Status choose();
    Result<std::size_t> size_on_sample();
    Result<Fitted> fit_all(std::size_t vertices);
    Result<Fitted> search(std::size_t first);
    Status measure_normals(Fitted& fitted) const;
    Error not_reached(const AnimationError& error, std::size_t vertices, const std::string& where) const;
    double score_of(const FitReport& report) const {
        return goal_.score({report.rms * diagonal_, report.max * diagonal_, 0, 0});
    }

    const MeshAnimation& animation_;
    const FitOptions& options_;
    RunContext context_, silent_ = context_;
    Mesh mesh_;
    WorkingMesh work_;
    AnimationSurvey survey_;
    std::optional<DriverFamily> family_;
    std::optional<Sample> sample_;
    double diagonal_ = 0;
    std::size_t most_ = 0; ///< vertices of the largest driver
    Goal goal_{};
    DriverChoice choice_ = DriverChoice::rest;
    std::vector<Known> known_; ///< of the chosen kind, on the sample
    std::size_t tries_ = 0;
};

Status FitWork::prepare() {
    Result<Mesh> mesh = rest_mesh(animation_, options_, context_);
    if (!mesh) return mesh.error();
    mesh_ = std::move(*mesh);
    diagonal_ = bounds(mesh_).diagonal();
    if (!(diagonal_ > 0)) return unsuitable("All vertices of the mesh are at one place: errors have no measure there.");
    goal_.rms = options_.error * diagonal_;
    if (options_.max_error) goal_.max = *options_.max_error * diagonal_;
    Result<AnimationSurvey> survey = survey_animation(animation_, mesh_.positions, kFarthestFrames, context_);
    if (!survey) return survey.error();
    survey_ = std::move(*survey);
    Result<WorkingMesh> work = make_working_mesh(mesh_, std::move(survey_.representative), context_);
    if (!work) return work.error();
    work_ = std::move(*work);
    if (work_.surface.triangles.empty())
        return unsuitable("No face of the mesh has three different places: a driver follows a surface.");
    Result<DriverFamily> family = DriverFamily::create(mesh_, work_, context_);
    if (!family) return family.error();
    family_.emplace(std::move(*family));
    sample_.emplace(*family_);
    most_ = std::min(work_.surface.place_count, std::max(mesh_.vertex_count() / kMostShare, kSmallMesh));
    const std::size_t any = std::min(family_->most_vertices(), kMostDriver);
    most_ = std::min(most_, any);
    if (options_.base && *options_.base > any)
        return Error{ErrorCode::usage, "base is " + std::to_string(*options_.base) +
                                           ", and a fitted driver of this mesh has " + std::to_string(any) +
                                           " vertices at most."};
    return Success{};
}

/// Orders the vertices in each way that is allowed, and takes the one that is best on the sample.
Status FitWork::choose() {
    context_.report("choosing the driver", 0);
    Result<std::vector<std::vector<Vec3f>>> frames =
        Sample::read(*family_, animation_, some_frames(animation_.frames, kSampleFrames), context_);
    if (!frames) return frames.error();
    sample_->set_frames(std::move(*frames));
    Result<std::vector<std::vector<Vec3f>>> far = Sample::read(*family_, animation_, survey_.farthest, context_);
    if (!far) return far.error();
    const std::vector<std::vector<Vec3f>> shapes =
        shapes_of(std::move(*far), survey_.middles, survey_.farthest, bounds(family_->sample_mesh()).diagonal());
    const std::size_t size =
        options_.base.value_or(std::min(kFirstDriver, std::max(most_ / 2, DriverSearch::kSmallest)));
    std::vector<DriverChoice> choices = {DriverChoice::rest, DriverChoice::motion};
    if (options_.choice) choices = {*options_.choice};
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < choices.size(); ++k) {
        if (Status ordered = family_->order(choices[k], shapes, silent_); !ordered) return ordered.error();
        const Result<Sample::Tried> tried = sample_->try_driver(choices[k], size, options_, silent_);
        if (!tried) return tried.error();
        context_.report("choosing the driver", double(k + 1) / double(choices.size()));
        const double score = goal_.score(tried->error);
        if (score >= (k == 0 ? 1 : kClearlyBetter) * least) continue;
        least = score;
        choice_ = choices[k];
        known_ = {{double(tried->vertices), score}};
    }
    return Success{};
}

/// The smallest driver that is good enough on the sample.
Result<std::size_t> FitWork::size_on_sample() {
    DriverSearch search(most_, 1);
    search.add(std::size_t(known_.front().vertices), known_.front().score);
    std::size_t passed = known_.front().score <= 1 ? std::size_t(known_.front().vertices) : 0;
    for (std::size_t tries = 0; tries < kMostSampleTries && !search.is_done(); ++tries) {
        context_.report("choosing the size", double(tries) / double(kMostSampleTries));
        const std::size_t size = search.next();
        const Result<Sample::Tried> tried = sample_->try_driver(choice_, size, options_, silent_);
        if (!tried) return tried.error();
        const double score = goal_.score(tried->error);
        if (score > 1 && size >= most_)
            return not_reached(tried->error, tried->vertices,
                               " on " + std::to_string(std::min(animation_.frames, kSampleFrames)) + " frames");
        const bool is_least = passed > 0 && tried->vertices > size && score <= 1; // the parts keep no fewer
        known_.push_back({double(tried->vertices), score});
        search.add(size, score);
        if (score <= 1) passed = std::min(passed > 0 ? passed : size, size);
        if (is_least) break;
    }
    context_.report("choosing the size", 1);
    return passed > 0 ? passed : most_;
}

Result<Fitted> FitWork::fit_all(std::size_t vertices) {
    Result<Model> model = bind_to_levels(mesh_, family_->levels(choice_, vertices), work_, silent_);
    if (!model) return model.error();
    const std::vector<float> bound_u = model->detail.u, bound_v = model->detail.v;
    Result<FittedPoses> poses = fit_poses_and_weights(*model, animation_.frames, animation_.positions,
                                                      options_.weight_rounds, pose_options(options_), context_);
    if (!poses) return poses.error();
    ++tries_;
    Fitted fitted;
    FitReport& report = fitted.report;
    report.vertices = mesh_.vertex_count();
    report.frames = animation_.frames;
    report.driver_vertices = model->driver().vertices.size();
    report.diagonal = diagonal_;
    report.rms = poses->error.rms / diagonal_;
    report.max = poses->error.max / diagonal_;
    report.max_frame = poses->error.max_frame;
    report.max_vertex = poses->error.max_vertex;
    report.choice = choice_;
    report.parted = survey_.parted;
    report.has_free_weights = model->detail.u != bound_u || model->detail.v != bound_v;
    fitted.model = *std::move(model);
    fitted.poses = {animation_.frames_per_second, std::move(poses->poses)};
    return fitted;
}

/// From the size that the sample gives to the smallest that all frames pass with.
Result<Fitted> FitWork::search(std::size_t first) {
    std::optional<Fitted> best;
    Known passed, failed;
    const double slope = known_.size() > 1 ? slope_between(known_[known_.size() - 2], known_.back()) : kUsualSlope;
    std::size_t size = first;
    for (std::size_t tries = 1;; ++tries) {
        Result<Fitted> fitted = fit_all(size);
        if (!fitted) return fitted.error();
        const double score = score_of(fitted->report);
        const bool is_good = score <= 1;
        (is_good ? passed : failed) = {double(size), score};
        const std::size_t has = fitted->report.driver_vertices;
        if (!is_good && size >= most_)
            return not_reached({fitted->report.rms * diagonal_, fitted->report.max * diagonal_, 0, 0}, has, "");
        if (is_good) best = *std::move(fitted);
        double next = double(size) * math::pow(score / kAim, 1 / slope);
        if (passed.vertices > 0 && failed.vertices > 0) {
            const double between = slope_between(failed, passed);
            next = std::clamp(failed.vertices * math::pow(failed.score / kAim, 1 / between), failed.vertices * 1.05,
                              passed.vertices / 1.05);
        } else if (!is_good) {
            next = std::clamp(next, double(size) * 1.1, double(size) * 4);
        }
        next = std::clamp(std::round(next), double(DriverSearch::kSmallest), double(most_));
        if (best) {
            const double least = failed.vertices > 0 ? failed.vertices : next;
            const bool keeps_as_many = is_good && std::size_t(next) < has && has > size; // the parts' own vertices
            if (tries >= kMostTries || passed.vertices < least * kCloseEnough || keeps_as_many) return *std::move(best);
        }
        size = std::size_t(next);
    }
}

/// Vertex normals of what is restored against the animation's, on some frames.
Status FitWork::measure_normals(Fitted& fitted) const {
    const Result<Restorer> restorer = Restorer::create(fitted.model, {}, silent_);
    if (!restorer) return restorer.error();
    std::vector<Vec3f> truth(mesh_.vertex_count()), restored(mesh_.vertex_count());
    const std::vector<std::size_t> frames = some_frames(animation_.frames, kSampleFrames);
    for (std::size_t k = 0; k < frames.size(); ++k) {
        context_.report("measuring normals", double(k) / double(frames.size()));
        if (Status read = animation_.positions(frames[k], truth); !read) return read;
        if (Status done = restorer->positions(fitted.poses.frames[frames[k]], restored, silent_); !done) return done;
        const VertexDistance distance = vertex_distance(mesh_, restored, truth, silent_);
        fitted.report.normal_mean_deg += distance.normal_mean_deg / double(frames.size());
        fitted.report.normal_p95_deg = std::max(fitted.report.normal_p95_deg, distance.normal_p95_deg);
        if (context_.is_cancelled()) return cancelled_error();
    }
    context_.report("measuring normals", 1);
    return Success{};
}

Error FitWork::not_reached(const AnimationError& error, std::size_t vertices, const std::string& where) const {
    return unsuitable("The error is not reached: a driver of " + std::to_string(vertices) +
                      " vertices, the most that is " + "smaller than the animation itself, comes to " +
                      short_number(error.rms / diagonal_) + " of the diagonal (rms) and " +
                      short_number(error.max / diagonal_) + " at most" + where +
                      ". Allow a larger error, or keep the animation as it is (a vertex cache or morph targets).");
}

Result<Fitted> FitWork::run() {
    if (Status ready = prepare(); !ready) return ready.error();
    if (Status chosen = choose(); !chosen) return chosen.error();
    std::size_t first = options_.base.value_or(0);
    if (!options_.base) {
        const Result<std::size_t> size = size_on_sample();
        if (!size) return size.error();
        first = *size;
    }
    Result<Fitted> fitted = options_.base ? fit_all(first) : search(first);
    if (!fitted) return fitted;
    fitted->report.tries = tries_;
    if (Status measured = measure_normals(*fitted); !measured) return measured.error();
    return fitted;
}

} // namespace

Result<Fitted> fit_animation(const MeshAnimation& animation, const FitOptions& options, const RunContext& context) {
    if (std::optional<Error> error = check_options(animation, options)) return *error;
    return FitWork(animation, options, context).run();
}

} // namespace filigree
