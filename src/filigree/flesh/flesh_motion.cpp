// A clip of a skin, simulated as flesh.
#include "filigree/core/dense_solve.h"
#include "filigree/core/now_seconds.h"
#include "filigree/core/parallel_for.h"
#include "filigree/flesh.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace filigree {

namespace {

constexpr double kSameAgain = 5e-4;       ///< of the diagonal, rms: a loop is periodic
constexpr double kFadeFrom = 0.75;        ///< of the cycle
constexpr double kFarthestTravel = 2000;  ///< m, in a clip: 32-bit floats are too coarse beyond half of it
constexpr float kSamePlace = 1e-4f;       ///< spacings: where a loop begins again
constexpr double kLongestStep = 1.0 / 24; ///< s: a clip of two frames is no cycle
constexpr std::size_t kDetailGrain = 512; // vertices
constexpr double kSmallDetail = 1e-4;     ///< spacings
constexpr double kFlat = 0.05;            ///< of a volume: what no turn is told from

Error misused(std::string sentence) { return {ErrorCode::usage, std::move(sentence)}; }

/// Where the joints want the particles at whole frames of a clip, before and behind it as well.
class ClipTargets {
public:
    ClipTargets(const Flesh& flesh, std::size_t clip, double rate, long last, bool loops, const Vec3d& offset,
                const RunContext& context)
        : flesh_(flesh), context_(context), clip_(clip), rate_(rate), last_(last), loops_(loops), offset_(offset),
          seconds_(flesh.skin().clips[clip].seconds), transforms_(flesh.skin().joints.size()),
          grows_(!flesh.body()->material.is_plastic()) {}

    /// 0 .. last.
    const Vectors& at(long frame) {
        const auto known = std::ranges::find(kept_, frame, &Kept::frame);
        if (known != kept_.end()) return known->positions;
        Kept& room = kept_[next_];
        next_ = (next_ + 1) % kept_.size();
        room.frame = frame;
        set_transforms(frame);
        flesh_.targets(transforms_, offset_, room.positions, nullptr, context_);
        return room.positions;
    }
    Vectors velocities(long frame) {
        const Vectors now = at(frame);
        return target_velocities(beside(now, frame, -1), now, beside(now, frame, 1), rate_);
    }
    /// Undoes gravity; empty where that is not wanted.
    Vectors accelerations(long frame) {
        Vectors felt;
        if (!flesh_.options().sculpted_gravity) return felt;
        set_transforms(frame);
        Vectors unused;
        flesh_.targets(transforms_, offset_, unused, &felt, context_);
        return felt;
    }

    /// Of the rest shape; empty where no joint changes its size.
    std::vector<Mat3f> stretches(long frame) {
        set_transforms(frame);
        return grows_ ? flesh_.stretches(transforms_, context_) : std::vector<Mat3f>();
    }

private:
    void set_transforms(long frame) {
        flesh_.skin().transforms(clip_, std::min(double(frame) / rate_, seconds_), transforms_);
    }
    /// The frame before (-1) or behind (1): beyond an end a loop goes on, anything else as straight as it came.
    Vectors beside(const Vectors& now, long frame, long step) {
        const long other = frame + step;
        if (other >= 0 && other <= last_) return at(other);
        const long end = step < 0 ? last_ : 0; // of a loop, the same moment as `frame`
        const Vectors from = loops_ ? at(end) : at(frame - step), to = loops_ ? at(end + step) : now;
        Vectors sum(now.size());
        for (std::size_t i = 0; i < now.size(); ++i) sum.set(i, now[i] + (to[i] - from[i]));
        return sum;
    }

    struct Kept {
        long frame = -1;
        Vectors positions;
    };
    const Flesh& flesh_;
    const RunContext& context_;
    std::size_t clip_;
    double rate_;
    long last_;
    bool loops_;
    Vec3d offset_;
    double seconds_;
    std::vector<Eigen::Affine3d> transforms_;
    bool grows_;
    std::array<Kept, 6> kept_;
    std::size_t next_ = 0;
};

struct Apart {
    double rms = 0, max = 0;
};
Apart apart(const Vectors& a, const Vectors& b, double diagonal) {
    double sum = 0, most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const auto squared = double((a[i] - b[i]).squaredNorm());
        sum += squared;
        most = std::max(most, squared);
    }
    return {std::sqrt(sum / double(a.size())) / diagonal, std::sqrt(most) / diagonal};
}

/// The box of a clip's surface, m, relative to the mesh's origin.
Box clip_box(const Flesh& flesh, std::size_t clip, double rate, long last, const RunContext& context) {
    const SkinnedMesh& skin = flesh.skin();
    std::vector<Eigen::Affine3d> transforms(skin.joints.size());
    std::vector<Vec3f> positions(skin.mesh.vertex_count());
    Box box;
    for (long frame = 0; frame <= last; ++frame) {
        skin.transforms(clip, std::min(double(frame) / rate, skin.clips[clip].seconds), transforms);
        skin_positions(skin, transforms, positions, context);
        for (std::size_t v = 0; v < positions.size(); ++v)
            if (!flesh.left_out()[v]) box.extend(flesh.scale() * positions[v].cast<double>());
    }
    return box;
}

class ClipRun {
public:
    ClipRun(const Flesh& flesh, std::size_t clip, const FleshClipOptions& options, const RunContext& context)
        : flesh_(flesh), options_(options), context_(context) {
        const double seconds = flesh.skin().clips[clip].seconds;
        made_.clip = clip;
        made_.name = flesh.skin().clips[clip].name;
        made_.is_loop = options.loop && seconds > 2 * kLongestStep;
        last_ = std::max(1L, made_.is_loop ? std::lround(seconds * options.frames_per_second)
                                           : long(std::floor(seconds * options.frames_per_second * (1 + 1e-9))));
        made_.frames_per_second = made_.is_loop ? double(last_) / seconds : options.frames_per_second;
        diagonal_ = bounds(flesh.surface()).diagonal() * flesh.scale();
    }

    Result<FleshClip> run() {
        if (!(flesh_.skin().clips[made_.clip].seconds > 0))
            return Error{ErrorCode::unsuitable, "Clip '" + made_.name + "' is a single pose and does not move."};
        const Box box = clip_box(flesh_, made_.clip, made_.frames_per_second, last_, context_);
        const Vec3d travel = box.size();
        if (travel.maxCoeff() > kFarthestTravel)
            return Error{ErrorCode::unsuitable,
                         "Clip '" + made_.name + "' travels " + std::to_string(long(travel.maxCoeff())) +
                             " m, and flesh is simulated within 2,000 m; cut the clip, or set the right scale."};
        made_.offset = Vec3d(box.centre().x(), 0, box.centre().z());
        if (std::abs(box.centre().y()) > travel.y()) made_.offset.y() = box.min.y();
        World world;
        world.gravity = flesh_.options().gravity;
        if (options_.ground)
            world.obstacles.emplace_back().shape = HalfSpace{.point = {0, box.min.y() - made_.offset.y(), 0}};
        Result<Simulation> made = Simulation::create(world, {{.body = flesh_.body()}},
                                                     {.frames_per_second = made_.frames_per_second,
                                                      .mode = StepMode::explicit_steps,
                                                      .contacts_within_bodies = options_.self_contact,
                                                      .automatic_rigid = false},
                                                     context_);
        if (!made) return made.error();
        simulation_.emplace(std::move(*made));
        targets_.emplace(flesh_, made_.clip, made_.frames_per_second, last_, made_.is_loop, made_.offset, context_);
        made_.skin_gap = apart(targets_->at(0), targets_->at(last_), diagonal_).max;
        if (Status begun = begin(flesh_.settled(targets_->at(0)), true); !begun) return begun.error();
        std::vector<Vectors> before;
        const unsigned most = made_.is_loop ? std::max(options_.most_cycles, 2U) : 1;
        for (unsigned cycle = 1; cycle <= most; ++cycle) {
            made_.cycles = cycle;
            if (Status done = one_cycle(cycle, most); !done) return done.error();
            if (!made_.is_loop) break;
            if (cycle > 1) {
                const Apart left = apart(made_.frames.back(), before.back(), diagonal_);
                made_.loop_rms = left.rms;
                made_.loop_max = left.max;
                if (left.rms < kSameAgain || cycle == most) break;
            }
            before = std::move(made_.frames);
            if (Status again = begin_again(before.back()); !again) return again.error();
        }
        if (made_.is_loop) fade(before);
        made_.inverted_cells = simulation_->inverted(0).count;
        const double frames = double(last_) * made_.cycles;
        made_.step_seconds /= frames;
        made_.target_seconds /= frames;
        return std::move(made_);
    }

private:
    Status begin(const Vectors positions, bool at_skin) { // a copy: what the targets keep is written over
        const Vectors start = targets_->at(0), velocities = targets_->velocities(0);
        if (Status set = simulation_->set_positions(0, positions); !set) return set;
        if (at_skin)
            if (Status set = simulation_->set_velocities(0, velocities); !set) return set;
        return simulation_->set_follow(0, flesh_.follow(), start, velocities, targets_->stretches(0));
    }

    /// From the last frame of a cycle to the first of the next: as the joints go there, in no time.
    Status begin_again(const Vectors& end) {
        const Vectors first = targets_->at(0), last = targets_->at(last_);
        const float same = kSamePlace * float(flesh_.body()->spacing());
        Vectors again = end;
        bool moves = false;
        for (std::size_t i = 0; i < end.size(); ++i)
            if (const Vec3f way = first[i] - last[i]; way.norm() > same) {
                again.add(i, way);
                moves = true;
            }
        if (moves) return begin(again, false);
        return simulation_->set_follow(0, flesh_.follow(), first, targets_->velocities(0), targets_->stretches(0));
    }

    Status one_cycle(unsigned cycle, unsigned most) {
        made_.frames.assign(1, simulation_->positions(0));
        for (long frame = 1; frame <= last_; ++frame) {
            if (context_.is_cancelled()) return cancelled_error();
            context_.report("flesh of '" + made_.name + "'",
                            (double(cycle - 1) * double(last_) + double(frame)) / (double(most) * double(last_)));
            const double start = now_seconds();
            const Vectors at = targets_->at(frame), velocities = targets_->velocities(frame),
                          felt = targets_->accelerations(frame);
            const std::vector<Mat3f> stretches = targets_->stretches(frame);
            const double middle = now_seconds();
            if (Status set = simulation_->set_targets(0, at, velocities, felt, stretches); !set) return set;
            const Result<FrameReport> report = simulation_->advance(silent());
            if (!report) return report.error();
            made_.target_seconds += middle - start;
            made_.step_seconds += now_seconds() - middle;
            made_.most_substeps = std::max(made_.most_substeps, report->substeps);
            made_.unstable_substeps += report->unstable_substeps;
            made_.clamped_particles += report->clamped_particles;
            made_.least_volume_ratio = std::min(made_.least_volume_ratio, report->least_volume_ratio);
            made_.frames.push_back(simulation_->positions(0));
        }
        return Success{};
    }

    /// Over its last part the cycle becomes the one before, which ends where this one began.
    void fade(const std::vector<Vectors>& before) {
        std::vector<Vectors>& frames = made_.frames;
        for (long k = long(std::ceil(kFadeFrom * double(last_))); k <= last_; ++k) {
            const double part = (double(k) / double(last_) - kFadeFrom) / (1 - kFadeFrom);
            const auto w = float(part * part * (3 - 2 * part));
            Vectors& now = frames[std::size_t(k)];
            const Vectors& old = before[std::size_t(k)];
            if (k == last_)
                now = old;
            else
                for (std::size_t i = 0; i < now.size(); ++i) now.set(i, now[i] + w * (old[i] - now[i]));
        }
    }

    RunContext silent() const {
        RunContext quiet = context_;
        quiet.progress = {};
        return quiet;
    }

    const Flesh& flesh_;
    const FleshClipOptions& options_;
    const RunContext& context_;
    FleshClip made_;
    long last_ = 1; ///< number of the last frame
    double diagonal_ = 1;
    std::optional<Simulation> simulation_;
    std::optional<ClipTargets> targets_;
};

} // namespace

Result<FleshClip> simulate_flesh(const Flesh& flesh, std::size_t clip, const FleshClipOptions& options,
                                 const RunContext& context) {
    if (clip >= flesh.skin().clips.size())
        return misused("There is no clip " + std::to_string(clip) + "; the skin has " +
                       std::to_string(flesh.skin().clips.size()) + ".");
    if (!(options.frames_per_second > 0 && std::isfinite(options.frames_per_second)))
        return misused("The number of frames a second must be above 0.");
    return ClipRun(flesh, clip, options, context).run();
}

struct FleshCarrier::Content {
    const Flesh& flesh;
    std::vector<Index> vertices, carried, left_out; ///< the last two: places in the first
    Simulation simulation;
    std::vector<Vec3f> points;
    std::vector<Mat3f> gradients;
    std::vector<Eigen::Affine3d> transforms;

    double seconds(const FleshClip& clip, std::size_t frame) const {
        const bool closes = clip.is_loop && frame + 1 == clip.frames.size();
        const double at = double(closes ? 0 : frame) / clip.frames_per_second;
        return std::min(at, flesh.skin().clips[clip.clip].seconds);
    }
    void add_detail(const FleshClip& clip, std::size_t frame, const RunContext& context);
};

/// What a surface without joints does between particles, such as a blink: the way from where the particles would carry
/// a vertex, were they all on their targets, to where the surface has it. It turns with the matter.
void FleshCarrier::Content::add_detail(const FleshClip& clip, std::size_t frame, const RunContext& context) {
    const SkinnedMesh& skin = flesh.skin();
    std::vector<Vec3f> surface(skin.mesh.vertex_count()), on_targets(points.size());
    std::vector<Mat3f> gradients_there(points.size()), gradients_here(points.size());
    if (!clip_positions(skin, clip.clip, seconds(clip, frame), surface, context)) return; // it was read before
    Vectors targets;
    skin.transforms(clip.clip, seconds(clip, frame), transforms);
    flesh.targets(transforms, clip.offset, targets, nullptr, context);
    simulation.attached(0, points, gradients_here, context);
    if (!simulation.set_positions(0, targets)) return;
    simulation.attached(0, on_targets, gradients_there, context);
    const double scale = flesh.scale();
    const auto least = float(kSmallDetail * flesh.body()->spacing());
    parallel_for(context, points.size(), kDetailGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const Vec3d wanted = scale * surface[vertices[carried[k]]].cast<double>() - clip.offset;
            const Vec3f detail = wanted.cast<float>() - on_targets[k];
            if (!(detail.norm() > least)) continue;
            const Mat3d there = gradients_there[k].cast<double>();
            const bool turns = std::abs(there.determinant()) > kFlat;
            const Mat3d turn =
                turns ? nearest_rotation(gradients_here[k].cast<double>() * there.inverse()) : Mat3d(Mat3d::Identity());
            points[k] += turn.cast<float>() * detail;
        }
    });
}

FleshCarrier::FleshCarrier(std::unique_ptr<Content> content) : content_(std::move(content)) {}
FleshCarrier::FleshCarrier(FleshCarrier&&) noexcept = default;
FleshCarrier& FleshCarrier::operator=(FleshCarrier&&) noexcept = default;
FleshCarrier::~FleshCarrier() = default;

Result<FleshCarrier> FleshCarrier::create(const Flesh& flesh, std::span<const Index> vertices,
                                          const RunContext& context) {
    Result<Simulation> made = Simulation::create(
        {}, {{.body = flesh.body()}},
        {.mode = StepMode::explicit_steps, .contacts_within_bodies = false, .automatic_rigid = false}, context);
    if (!made) return made.error();
    auto content = std::make_unique<Content>(
        Content{flesh, {vertices.begin(), vertices.end()}, {}, {}, std::move(*made), {}, {}, {}});
    std::vector<Vec3f> rest;
    for (Index p = 0; p < vertices.size(); ++p) {
        if (vertices[p] >= flesh.skin().mesh.vertex_count())
            return misused("There is no vertex " + std::to_string(vertices[p]) + " in the mesh.");
        if (flesh.left_out()[vertices[p]]) {
            content->left_out.push_back(p);
            continue;
        }
        content->carried.push_back(p);
        rest.push_back((flesh.scale() * flesh.skin().mesh.positions[vertices[p]].cast<double>()).cast<float>());
    }
    content->simulation.attach(0, rest, context);
    content->points.resize(rest.size());
    content->gradients.resize(rest.size());
    content->transforms.resize(flesh.skin().joints.size());
    return FleshCarrier(std::move(content));
}

void FleshCarrier::at(const FleshClip& clip, std::size_t frame, std::span<Vec3f> positions, std::span<Mat3f> gradients,
                      const RunContext& context) {
    Content& c = *content_;
    const SkinnedMesh& skin = c.flesh.skin();
    if (c.simulation.set_positions(0, clip.frames[frame]))
        c.simulation.attached(0, c.points, gradients.empty() ? std::span<Mat3f>() : std::span(c.gradients), context);
    if (skin.surface) c.add_detail(clip, frame, context);
    const double scale = c.flesh.scale();
    for (std::size_t k = 0; k < c.carried.size(); ++k) {
        positions[c.carried[k]] = ((c.points[k].cast<double>() + clip.offset) / scale).cast<float>();
        if (!gradients.empty()) gradients[c.carried[k]] = c.gradients[k];
    }
    if (c.left_out.empty()) return;
    skin.transforms(clip.clip, std::min(double(frame) / clip.frames_per_second, skin.clips[clip.clip].seconds),
                    c.transforms);
    for (const Index p : c.left_out) {
        const Index v = c.vertices[p];
        const Eigen::Affine3d blend = blended_transform(skin, c.transforms, v);
        positions[p] = (blend * skin.mesh.positions[v].cast<double>()).cast<float>();
        if (!gradients.empty()) gradients[p] = blend.linear().cast<float>();
    }
}

} // namespace filigree
