#include "deformation.h"

#include "bell.h"
#include "jobs.h"
#include "pins.h"

#include "filigree/pose.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace filigree::studio {

Pose deformed_pose(const State& state, const RunContext& context) {
    if (!state.model) return {};
    const Mesh& mesh = state.model->mesh;
    const auto warp = make_warp(state.warps, world_bounds(mesh));
    if (!warp) return state.handle_pose ? *state.handle_pose : Pose{};
    const std::vector<Vec3f> start = state.handle_pose ? state.handle_pose->positions : driver_positions(*state.model);
    Pose pose = warp_pose(*warp, start, mesh.origin, context);
    follow_start(pose, state.handle_pose.get());
    return pose;
}

Result<std::vector<Vec3f>> full_deformation(const State& state, const RunContext& context) {
    if (state.pose_from_file)
        return Error{ErrorCode::unsuitable, "The shape began with a pose from a file, and where that would take every "
                                            "vertex is not known; reset the deformation to measure what you do."};
    std::vector<Pull> pulls;
    for (const Handle& handle : state.handles)
        if (!handle.pinned)
            pulls.push_back({{handle.vertices, handle.held}, handle.centre, handle.grip, handle.reach, handle.move});
    Result<std::vector<Vec3f>> pulled = pull_every_vertex(*state.model, pulls, context);
    if (!pulled) return pulled.error();
    if (context.is_cancelled()) return cancelled_error();
    const Mesh& mesh = state.model->mesh;
    const auto warp = make_warp(state.warps, world_bounds(mesh));
    return warp ? warp_positions(*warp, *pulled, mesh.origin, context) : std::move(*pulled);
}

PullRegion pull_region(const State& state, const Vec3f& rest_point, double grip, double reach,
                       std::optional<Index> vertex) {
    return pull_region(*state.model, pinned_vertices(state.handles), rest_point, grip, reach, vertex);
}

struct HandleDrag::Impl {
    Impl(std::shared_ptr<const Model> of, std::shared_ptr<const Pose> from, Handle by, std::optional<Index> held,
         const Bell& rings)
        : model(std::move(of)), start(std::move(from)), pull(std::move(by)), grabbed(held), bell(rings) {}

    std::shared_ptr<const Model> model;
    std::shared_ptr<const Pose> start;
    Handle pull;
    std::optional<Index> grabbed;
    RunContext context;
    const Bell& bell;
    std::thread thread;

    std::mutex mutex;
    std::condition_variable wake;
    // Under the lock:
    Vec3f way = Vec3f::Zero();
    std::uint64_t way_number = 1; ///< of the last move
    bool is_ending = false, stops = false;
    std::shared_ptr<const Pose> pose;
    Vec3f applied = Vec3f::Zero(); ///< in that pose
    double milliseconds = 0;
    std::optional<Error> error;
    bool is_new = false, rests = false, has_ended = false;

    static constexpr double kTolerance = 1e-4, kFinalTolerance = 1e-5; ///< while the mouse moves, once it rests
    static constexpr std::chrono::milliseconds kLongestEnding{250};    ///< a large driver is let go a little early
    static constexpr std::chrono::seconds kLongestFinish{3};           ///< preparing included

    void work() {
        const Status status = run_guarded("The pull", "Strip to fewer vertices.", [this] { return solve(); });
        {
            const std::scoped_lock lock(mutex);
            has_ended = rests = true;
            if (!status && status.error().code != ErrorCode::cancelled) {
                error = status.error();
                pose = nullptr;
            }
        }
        wake.notify_all();
        bell.ring();
    }

    /// What is asked for next.
    struct Order {
        Vec3f way = Vec3f::Zero();
        double tolerance = kTolerance;
    };

    /// Waits until there is something to do; none: the drag is over, as asked for.
    Result<std::optional<Order>> next_order(const PullSolver& solver) {
        std::unique_lock lock(mutex);
        const auto has_arrived = [&] { return solver.has_arrived(is_ending ? kFinalTolerance : kTolerance); };
        const auto has_work = [&] { return stops || is_ending || way_number != solved || !has_arrived(); };
        if (!has_work()) {
            rests = true;
            bell.ring();
            wake.wait(lock, has_work);
            rests = false;
        }
        if (stops) return cancelled_error();
        if (is_ending && !ending_since) ending_since = std::chrono::steady_clock::now();
        const bool is_late = ending_since && std::chrono::steady_clock::now() - *ending_since > kLongestEnding;
        if (is_ending && way_number == solved && (has_arrived() || is_late)) return std::optional<Order>();
        solved = way_number;
        return std::optional(Order{way, is_ending ? kFinalTolerance : kTolerance});
    }

    Status solve() {
        Result<PullSolver> solver =
            PullSolver::create(*model, start.get(), {pull.vertices, pull.held}, grabbed, context);
        if (!solver) return solver.error();
        for (;;) {
            const Result<std::optional<Order>> order = next_order(*solver);
            if (!order) return order.error();
            if (!*order) return Success{};
            const auto begin = std::chrono::steady_clock::now();
            Result<Pose> solution = solver->step((*order)->way, (*order)->tolerance, context);
            if (!solution) return solution.error();
            const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
            auto next = std::make_shared<const Pose>(std::move(*solution));
            {
                const std::scoped_lock lock(mutex);
                pose = std::move(next);
                applied = solver->applied();
                milliseconds = took.count();
                is_new = true;
            }
            bell.ring();
        }
    }

private:
    // Of the thread alone.
    std::uint64_t solved = 0;                                          ///< the last move that was solved for
    std::optional<std::chrono::steady_clock::time_point> ending_since; ///< asked to end
};

HandleDrag::HandleDrag(QObject* parent) : QObject(parent), bell_(std::make_unique<Bell>()) {
    connect(bell_.get(), &Bell::rung, this, &HandleDrag::listen);
}
HandleDrag::~HandleDrag() {
    stop();
    for (const auto& content : retired_) content->thread.join();
}

void HandleDrag::begin(std::shared_ptr<const Model> model, std::shared_ptr<const Pose> start, Handle pull,
                       std::optional<Index> grabbed) {
    stop();
    impl_ = std::make_shared<Impl>(std::move(model), std::move(start), std::move(pull), grabbed, *bell_);
    impl_->thread = std::thread([content = impl_.get()] { content->work(); });
}

void HandleDrag::move(const Vec3f& way) {
    if (!impl_) return;
    {
        const std::scoped_lock lock(impl_->mutex);
        if (way == impl_->way) return;
        impl_->way = way;
        ++impl_->way_number;
        impl_->rests = false;
    }
    impl_->wake.notify_all();
}

Result<std::shared_ptr<const Pose>> HandleDrag::finish() {
    if (!impl_) return std::shared_ptr<const Pose>();
    std::shared_ptr<const Pose> pose;
    std::optional<Error> error;
    {
        std::unique_lock lock(impl_->mutex);
        impl_->is_ending = true;
        impl_->wake.notify_all();
        impl_->wake.wait_for(lock, Impl::kLongestFinish, [&] { return impl_->has_ended; });
        pose = impl_->pose;
        applied_ = impl_->applied;
        error = impl_->error;
    }
    stop();
    if (!error) return pose;
    Q_EMIT failed(*error);
    return *error;
}

void HandleDrag::stop() {
    if (!impl_) return;
    {
        const std::scoped_lock lock(impl_->mutex);
        impl_->stops = true;
    }
    impl_->context.cancel();
    impl_->wake.notify_all();
    retired_.push_back(std::move(impl_));
    impl_ = nullptr;
    retire();
}

/// Joins the threads that have ended. Preparing a solver cannot be broken off, and nobody is to wait for it.
void HandleDrag::retire() {
    std::erase_if(retired_, [](const std::shared_ptr<Impl>& content) {
        {
            const std::scoped_lock lock(content->mutex);
            if (!content->has_ended) return false;
        }
        content->thread.join();
        return true;
    });
}

bool HandleDrag::is_active() const { return impl_ != nullptr; }

bool HandleDrag::is_busy() const {
    if (!impl_) return false;
    const std::scoped_lock lock(impl_->mutex);
    return !impl_->rests || impl_->is_new;
}

void HandleDrag::listen() {
    retire();
    if (!impl_) return;
    std::shared_ptr<const Pose> pose;
    std::optional<Error> error;
    double milliseconds = 0;
    {
        const std::scoped_lock lock(impl_->mutex);
        if (std::exchange(impl_->is_new, false)) pose = impl_->pose;
        milliseconds = impl_->milliseconds;
        error = impl_->error;
    }
    if (error) {
        stop();
        Q_EMIT failed(*error);
    } else if (pose) {
        Q_EMIT solved(std::move(pose), milliseconds);
    }
}

} // namespace filigree::studio
