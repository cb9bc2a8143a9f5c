#include "playback.h"

#include "bell.h"
#include "jobs.h"
#include "pieces.h"
#include "pins.h"
#include "softness.h"

#include "filigree/present/textured_look.h"
#include "filigree/render.h"

#include <QCoreApplication>
#include <QEventLoop>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace filigree::studio {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostRecordedBytes = std::size_t{1} << 30;

std::size_t bytes_of(const Pose& pose) {
    return pose.positions.size() * sizeof(Vec3f) + pose.gradients.size() * sizeof(Mat3f);
}

std::size_t bytes_of(const Mesh& mesh) {
    return (mesh.positions.size() + mesh.normals.values.size()) * sizeof(Vec3f) + mesh.colors.size() * sizeof(Vec4f) +
           (mesh.corners.size() + mesh.face_offsets.size() + mesh.normals.corners.size()) * sizeof(Index);
}

} // namespace

Result<std::shared_ptr<const DroppedBody>> make_body_of(const State& state, const Vec3d& up,
                                                        const RunContext& context) {
    const auto breaking = state.source->pieces ? state.source->pieces->breaking : nullptr;
    BodyLook look;
    const Material& material = state.body.material;
    if (material.model == MaterialModel::mpm && material.melts()) {
        constexpr double kPart = 0.5; // of the particles' spacing
        const Vec3d size = bounds(state.model->mesh.positions).size();
        const double spacing = std::cbrt(size.prod() / double(state.body.particles));
        std::vector<std::string> warnings; // that were said when the mesh was opened
        Result<BodyLook> found =
            textured_look(level_mesh(*state.model, state.model->finest_level()), state.source->path,
                          kPart * std::max(spacing, 1e-6 * size.maxCoeff()), Appearance().color, warnings, context);
        if (!found) return found.error();
        look = std::move(*found);
    }
    auto made = make_dropped_body(state.model, breaking, look, state.body, pinned_vertices(state.handles), up, context);
    return made ? softened(std::move(*made), state, context) : made;
}

struct Playback::Worker {
    Worker(std::shared_ptr<const DroppedBody> of, const Bell& rings) : made(std::move(of)), bell(rings) {
        thread = std::thread([this] { work(); });
    }
    ~Worker() {
        {
            const std::scoped_lock lock(mutex);
            quits = true;
            life.cancel();
            context.cancel();
        }
        wake.notify_one();
        thread.join();
    }

    /// What the main thread gets the next time it looks.
    struct Outbox {
        struct Frame {
            Pose pose;
            std::shared_ptr<const Mesh> surface;
        };
        std::vector<Frame> frames; ///< all since the last time
        std::optional<Moment> moment;
        std::optional<Error> error;
    };

    const std::shared_ptr<const DroppedBody> made;
    const Bell& bell;
    const RunContext life;         ///< of the worker: for what a pause must not break off
    std::size_t steps_awaited = 0; ///< main thread alone: asked for by step() and not delivered yet

    std::mutex mutex;
    std::condition_variable wake, parked;
    // Under the lock:
    RunContext context; ///< of the frame: another one after each cancel
    bool plays = false, quits = false, resets = false, shows_again = false;
    MomentWishes wishes;
    bool is_idle = false;
    std::size_t steps = 0;
    // To be set before the next frame:
    std::optional<std::vector<Hand>> hands;
    std::optional<std::vector<HeatSource>> heat_sources;
    std::optional<double> air_temperature; ///< K
    Outbox outbox;

    std::thread thread;

    void change(const std::function<void()>& what) {
        {
            const std::scoped_lock lock(mutex);
            what();
        }
        wake.notify_one();
    }

    /// Stops at once, in the middle of a frame too, and returns when the other thread rests.
    void park() {
        std::unique_lock lock(mutex);
        plays = false;
        steps = 0;
        context.cancel();
        wake.notify_one();
        parked.wait(lock, [&] { return is_idle; });
    }
    void rewind() {
        park();
        std::unique_lock lock(mutex);
        hands.reset();
        heat_sources.reset();
        resets = true;
        wake.notify_one();
        parked.wait(lock, [&] { return is_idle && (!resets || quits); });
        outbox.frames.clear(); // an error is still to be told
        outbox.moment.reset();
    }

private:
    /// What the worker is to do next, as it was asked for when it looked.
    struct Order {
        RunContext context = RunContext(); ///< of the frame
        bool is_frame = false, rewinds = false;
        MomentWishes wishes = {};
        std::optional<std::vector<Hand>> hands = {};
        std::optional<std::vector<HeatSource>> heat_sources = {};
        std::optional<double> air_temperature = {};
    };

    void work() {
        const Status status =
            run_guarded("The simulation", "Choose fewer particles.", [this]() -> Status { return simulate(); });
        {
            const std::scoped_lock lock(mutex);
            is_idle = true;
            quits = true;
            resets = false;
            if (!status && status.error().code != ErrorCode::cancelled) outbox.error = status.error();
        }
        parked.notify_all();
        bell.ring();
    }

    /// Rests while there is nothing to do, and until it is time for the next frame. Errors: cancelled, to quit.
    Result<Order> next_order() {
        std::unique_lock lock(mutex);
        for (;;) {
            const auto has_work = [&] { return quits || plays || steps > 0 || resets || shows_again; };
            if (!has_work()) {
                is_idle = true;
                parked.notify_all();
                wake.wait(lock, has_work);
                next = Clock::now();
            }
            is_idle = false;
            if (quits) return cancelled_error();
            if (resets) return Order{.rewinds = true};
            if (plays && steps == 0) {
                wake.wait_until(lock, next, [&] { return quits || !plays || steps > 0 || resets; });
                if (quits || !plays || resets) continue;
            }
            if (context.is_cancelled()) context = RunContext();
            shows_again = false;
            return Order{.context = context,
                         .is_frame = plays || steps > 0,
                         .wishes = wishes,
                         .hands = std::exchange(hands, std::nullopt),
                         .heat_sources = std::exchange(heat_sources, std::nullopt),
                         .air_temperature = std::exchange(air_temperature, std::nullopt)};
        }
    }

    Status simulate() {
        Result<BodyMotion> motion = BodyMotion::create(made, life);
        if (!motion) return motion.error();
        for (;;) {
            Result<Order> order = next_order();
            if (!order) return order.error();
            const Status done = order->rewinds ? go_to_start(*motion) : show(*motion, *order);
            if (!done) return done;
        }
    }

    Status go_to_start(BodyMotion& motion) {
        const Status rewound = motion.rewind(life);
        const std::scoped_lock lock(mutex);
        resets = false;
        return rewound;
    }

    /// The next frame, or another look at this one.
    Status show(BodyMotion& motion, Order& order) {
        const Clock::time_point begun = Clock::now();
        if (order.hands)
            if (Status seized = motion.set_hands(std::move(*order.hands), life); !seized) return seized;
        if (order.heat_sources)
            if (Status lit = motion.set_heat_sources(std::move(*order.heat_sources)); !lit) return lit;
        if (order.air_temperature)
            if (Status warmed = motion.set_air_temperature(*order.air_temperature); !warmed) return warmed;
        FrameReport report;
        if (order.is_frame) {
            const Result<FrameReport> advanced = motion.advance(order.context);
            if (!advanced && advanced.error().code == ErrorCode::cancelled) return Success{};
            if (!advanced) return advanced.error();
            report = *advanced;
        }
        Moment moment = motion.look(order.wishes);
        moment.report = report;
        moment.milliseconds = std::chrono::duration<double, std::milli>(Clock::now() - begun).count();
        {
            const std::scoped_lock lock(mutex);
            if (order.is_frame) {
                outbox.frames.push_back({moment.pose, moment.surface});
                if (steps > 0) --steps;
            }
            outbox.moment = std::move(moment);
        }
        bell.ring();
        next = std::max(next + std::chrono::microseconds(16'667), Clock::now());
        return Success{};
    }

    Clock::time_point next = Clock::now(); ///< when the next frame is due; the worker's own
};

Playback::Playback(QObject* parent) : QObject(parent), bell_(std::make_unique<Bell>()) {
    connect(bell_.get(), &Bell::rung, this, &Playback::deliver);
}

Playback::~Playback() = default;

void Playback::put(std::shared_ptr<const DroppedBody> made) {
    worker_.reset();
    made_ = std::move(made);
    worker_ = std::make_unique<Worker>(made_, *bell_);
    begin_anew();
    Q_EMIT state_changed();
    Q_EMIT moved();
}

/// The recording holds the start alone, and nothing moves.
void Playback::begin_anew() {
    is_playing_ = is_grabbed_ = has_torch_ = false;
    moment_ = std::make_unique<Moment>(start_of(*made_));
    recording_ = {60, {}};
    surfaces_.clear();
    recorded_bytes_ = 0;
    record(moment_->pose, nullptr);
    want(wishes_);
}

void Playback::record(const Pose& pose, std::shared_ptr<const Mesh> surface) {
    recorded_bytes_ += bytes_of(pose) + (surface ? bytes_of(*surface) : 0);
    recording_.frames.push_back(pose);
    surfaces_.push_back(std::move(surface));
}

void Playback::remove() {
    if (!has_body()) return;
    worker_.reset();
    made_ = nullptr;
    moment_ = nullptr;
    recording_ = {};
    surfaces_.clear();
    is_playing_ = is_grabbed_ = has_torch_ = false;
    Q_EMIT state_changed();
}

void Playback::play() {
    if (!has_body() || is_playing_) return;
    is_playing_ = true;
    worker_->change([&] { worker_->plays = true; });
    Q_EMIT state_changed();
}

void Playback::pause() {
    if (!has_body()) return;
    const bool was_playing = std::exchange(is_playing_, false), was_stepping = is_stepping();
    is_grabbed_ = has_torch_ = false;
    worker_->park();
    worker_->change([&] {
        worker_->hands.emplace();
        worker_->heat_sources.emplace();
    });
    worker_->steps_awaited = 0;
    deliver();
    if (was_stepping) Q_EMIT stepped();
    if (was_playing) Q_EMIT state_changed();
}

void Playback::step() {
    if (!has_body()) return;
    if (is_playing_) pause();
    ++worker_->steps_awaited;
    worker_->change([&] { ++worker_->steps; });
}

bool Playback::is_stepping() const { return has_body() && worker_->steps_awaited > 0; }

void Playback::reset() {
    if (!has_body()) return;
    worker_->rewind();
    worker_->steps_awaited = 0;
    begin_anew();
    Q_EMIT state_changed();
    Q_EMIT moved();
}

void Playback::wait_for_frames(std::size_t frames) {
    const std::size_t until = delivered_ + frames;
    while (has_body() && ((is_playing_ && delivered_ < until) || worker_->steps_awaited > 0))
        QCoreApplication::processEvents(QEventLoop::WaitForMoreEvents);
}

void Playback::grab(const Vec3f& rest_point, const Vec3d& target) {
    if (!has_body()) return;
    is_grabbed_ = true;
    grabbed_ = rest_point;
    pull(target);
    play();
}

void Playback::pull(const Vec3d& target) {
    if (!is_grabbed_ || !target.allFinite()) return;
    Hand hand;
    hand.point = float(made_->scale) * grabbed_;
    hand.target.constant = made_->scale * target;
    worker_->change([&] { worker_->hands = std::vector<Hand>{hand}; });
}

void Playback::let_go() {
    if (!std::exchange(is_grabbed_, false)) return;
    worker_->change([&] { worker_->hands.emplace(); });
}

void Playback::want(const MomentWishes& wishes) {
    wishes_ = wishes;
    if (!has_body()) return;
    worker_->change([&] {
        worker_->shows_again |= wishes.full || wishes.temperatures;
        worker_->wishes = wishes;
    });
}

void Playback::set_air_temperature(double kelvins) {
    if (has_body()) worker_->change([&] { worker_->air_temperature = kelvins; });
}

void Playback::hold_torch(const Vec3d& place, const Torch& torch) {
    if (!has_body() || !can_melt(*made_) || !place.allFinite()) return;
    has_torch_ = true;
    worker_->change([&] { worker_->heat_sources = std::vector<HeatSource>{torch_at(*made_, place, torch)}; });
    play();
}

void Playback::put_out_torch() {
    if (!std::exchange(has_torch_, false)) return;
    worker_->change([&] { worker_->heat_sources.emplace(); });
}

void Playback::deliver() {
    if (!has_body()) return;
    Worker::Outbox news;
    {
        const std::scoped_lock lock(worker_->mutex);
        news = std::exchange(worker_->outbox, {});
    }
    delivered_ += news.frames.size();
    const bool was_stepping = is_stepping();
    worker_->steps_awaited -= std::min(worker_->steps_awaited, news.frames.size());
    for (Worker::Outbox::Frame& frame : news.frames) record(frame.pose, std::move(frame.surface));
    if (news.error) {
        is_playing_ = is_grabbed_ = has_torch_ = false;
        worker_->steps_awaited = 0;
        Q_EMIT failed(*news.error);
        return remove(); // nothing moves it any more
    }
    if (!news.moment) return;
    *moment_ = std::move(*news.moment);
    const bool is_full = recorded_bytes_ > kMostRecordedBytes;
    Q_EMIT moved();
    if (was_stepping && !is_stepping()) Q_EMIT stepped();
    if (is_full && is_playing_) {
        pause();
        Q_EMIT failed({ErrorCode::unsuitable, "The recording is as long as memory allows: save it, then reset."});
    }
}

} // namespace filigree::studio
