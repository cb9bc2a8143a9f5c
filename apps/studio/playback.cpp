#include "playback.h"

#include "bell.h"

#include "filigree/scene/recording.h"

#include <QCoreApplication>
#include <QEventLoop>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <new>
#include <thread>

namespace filigree::studio {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostRecordedBytes = std::size_t{1} << 30;

std::size_t bytes_of(const Pose& pose) {
    return pose.positions.size() * sizeof(Vec3f) + pose.gradients.size() * sizeof(Mat3f);
}

/// Before anything has moved.
Moment start_of(const MadeBody& made) {
    Moment moment;
    moment.pose.positions = driver_positions(*made.model);
    moment.pose.gradients.assign(moment.pose.positions.size(), Mat3f::Identity());
    const Vectors& rest = made.body->rest;
    for (std::size_t i = 0; i < rest.size(); ++i) moment.particles.push_back(rest[i] / float(made.scale));
    return moment;
}

} // namespace

struct Playback::Worker {
    Worker(std::shared_ptr<const MadeBody> of, const Bell& rings) : made(std::move(of)), bell(rings) {
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
        std::vector<Pose> poses; ///< of all frames since the last time
        std::optional<Moment> moment;
        std::optional<Error> error;
    };

    const std::shared_ptr<const MadeBody> made;
    const Bell& bell;
    const RunContext life;         ///< of the worker: for what a pause must not break off
    std::size_t steps_awaited = 0; ///< main thread alone: asked for by step() and not delivered yet

    std::mutex mutex;
    std::condition_variable wake, parked;
    // Under the lock:
    RunContext context; ///< of the frame: another one after each cancel
    bool plays = false, quits = false, resets = false, shows_again = false, wants_full = false;
    bool is_idle = false;
    std::size_t steps = 0;
    std::optional<std::vector<Hand>> hands; ///< to be set before the next frame
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
        resets = true;
        wake.notify_one();
        parked.wait(lock, [&] { return is_idle && (!resets || quits); });
        outbox.poses.clear(); // an error is still to be told
        outbox.moment.reset();
    }

private:
    // The worker's own.
    std::optional<Simulation> simulation;
    std::size_t driver = 0;
    std::optional<std::size_t> all_vertices;
    std::string start;
    Pose last;

    void work() {
        Status status = Success{};
        try {
            status = simulate();
        } catch (const std::bad_alloc&) {
            status = Error{ErrorCode::out_of_memory,
                           "There is not enough memory to simulate this body: choose fewer particles."};
        } catch (const std::exception& error) {
            status = Error{ErrorCode::unsuitable, std::string("The simulation was stopped by an error of our own (") +
                                                      error.what() + "); please report it."};
        }
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

    Status begin() {
        Actor actor;
        actor.body = made->body;
        Result<Simulation> created = Simulation::create(made->world, {actor}, {}, life);
        if (!created) return created.error();
        simulation = std::move(*created);
        std::vector<Vec3f> points = driver_positions(*made->model);
        last.positions = points;
        last.gradients.assign(points.size(), Mat3f::Identity());
        for (Vec3f& p : points) p *= float(made->scale);
        driver = simulation->attach(0, points, life);
        start = simulation->save();
        return Success{};
    }

    Status simulate() {
        if (Status begun = begin(); !begun) return begun;
        Clock::time_point next = Clock::now();
        for (;;) {
            RunContext now;
            bool is_frame = false, with_full = false;
            std::optional<std::vector<Hand>> new_hands;
            {
                std::unique_lock lock(mutex);
                const auto has_work = [&] { return quits || plays || steps > 0 || resets || shows_again; };
                if (!has_work()) {
                    is_idle = true;
                    parked.notify_all();
                    wake.wait(lock, has_work);
                    next = Clock::now();
                }
                is_idle = false;
                if (quits) return cancelled_error();
                if (plays && steps == 0 && !resets) {
                    wake.wait_until(lock, next, [&] { return quits || !plays || steps > 0 || resets; });
                    if (quits || !plays || resets) continue;
                }
                if (resets) {
                    if (Status restored = simulation->restore(start); !restored) return restored.error();
                    if (Status let_go = simulation->set_hands({}, life); !let_go) return let_go.error();
                    last = start_of(*made).pose;
                    resets = false;
                    continue;
                }
                if (context.is_cancelled()) context = RunContext();
                now = context;
                is_frame = plays || steps > 0;
                with_full = wants_full;
                shows_again = false;
                new_hands = std::exchange(hands, std::nullopt);
            }
            const Clock::time_point begun = Clock::now();
            if (new_hands)
                if (Status seized = simulation->set_hands(std::move(*new_hands), life); !seized) return seized.error();
            Moment moment;
            if (is_frame) {
                const Result<FrameReport> report = simulation->advance(now);
                if (!report && report.error().code == ErrorCode::cancelled) continue;
                if (!report) return report.error();
                moment.report = *report;
            }
            look(moment, with_full);
            moment.milliseconds = std::chrono::duration<double, std::milli>(Clock::now() - begun).count();
            {
                const std::scoped_lock lock(mutex);
                if (is_frame) {
                    outbox.poses.push_back(moment.pose);
                    if (steps > 0) --steps;
                }
                outbox.moment = std::move(moment);
            }
            bell.ring();
            next = std::max(next + std::chrono::microseconds(16'667), Clock::now());
        }
    }

    void look(Moment& moment, bool with_full) {
        const RunContext always; // a frame that was simulated is delivered
        const float to_units = float(1 / made->scale);
        const auto far = static_cast<float>(kFarInAFrame * bounds(made->model->mesh.positions).diagonal());
        moment.frame = simulation->frame();
        moment.pose.positions.resize(last.positions.size());
        moment.pose.gradients.resize(last.positions.size());
        simulation->attached(driver, moment.pose.positions, moment.pose.gradients, always);
        for (Vec3f& p : moment.pose.positions) p *= to_units;
        hold_lost(last, moment.pose, far, float(kFarInAFrame));
        last = moment.pose;
        const Vectors& particles = simulation->positions(0);
        moment.particles.reserve(particles.size());
        for (std::size_t i = 0; i < particles.size(); ++i) moment.particles.push_back(to_units * particles[i]);
        if (!with_full) return;
        if (!all_vertices) {
            std::vector<Vec3f> points = made->model->mesh.positions;
            for (Vec3f& p : points) p *= float(made->scale);
            all_vertices = simulation->attach(0, points, always);
        }
        moment.full.resize(made->model->mesh.vertex_count());
        simulation->attached(*all_vertices, moment.full, {}, always);
        for (Vec3f& p : moment.full) p *= to_units;
    }
};

Playback::Playback(QObject* parent) : QObject(parent), bell_(std::make_unique<Bell>()) {
    connect(bell_.get(), &Bell::rung, this, &Playback::deliver);
}

Playback::~Playback() = default;

void Playback::put(std::shared_ptr<const MadeBody> made) {
    worker_.reset();
    made_ = std::move(made);
    is_playing_ = is_grabbed_ = false;
    moment_ = std::make_unique<Moment>(start_of(*made_));
    recording_ = {60, {moment_->pose}};
    worker_ = std::make_unique<Worker>(made_, *bell_);
    if (wants_full_) want_full(true);
    Q_EMIT state_changed();
    Q_EMIT moved();
}

void Playback::remove() {
    if (!has_body()) return;
    worker_.reset();
    made_ = nullptr;
    moment_ = nullptr;
    recording_ = {};
    is_playing_ = is_grabbed_ = false;
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
    const bool was_playing = std::exchange(is_playing_, false);
    is_grabbed_ = false;
    worker_->park();
    worker_->change([&] { worker_->hands.emplace(); });
    worker_->steps_awaited = 0;
    deliver();
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
    is_playing_ = is_grabbed_ = false;
    moment_ = std::make_unique<Moment>(start_of(*made_));
    recording_.frames = {moment_->pose};
    if (wants_full_) want_full(true);
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

void Playback::want_full(bool wanted) {
    wants_full_ = wanted;
    if (!has_body()) return;
    worker_->change([&] {
        worker_->shows_again |= wanted;
        worker_->wants_full = wanted;
    });
}

void Playback::deliver() {
    if (!has_body()) return;
    Worker::Outbox news;
    {
        const std::scoped_lock lock(worker_->mutex);
        news = std::exchange(worker_->outbox, {});
    }
    delivered_ += news.poses.size();
    worker_->steps_awaited -= std::min(worker_->steps_awaited, news.poses.size());
    for (Pose& pose : news.poses) recording_.frames.push_back(std::move(pose));
    if (news.error) {
        is_playing_ = is_grabbed_ = false;
        worker_->steps_awaited = 0;
        Q_EMIT failed(*news.error);
        return remove(); // nothing moves it any more
    }
    if (!news.moment) return;
    *moment_ = std::move(*news.moment);
    const bool is_full = recording_.frames.size() * bytes_of(moment_->pose) > kMostRecordedBytes;
    Q_EMIT moved();
    if (is_full && is_playing_) {
        pause();
        Q_EMIT failed({ErrorCode::unsuitable, "The recording is as long as memory allows: save it, then reset."});
    }
}

} // namespace filigree::studio
