#include "deformation.h"

#include "bell.h"
#include "jobs.h"
#include "pins.h"

#include "filigree/mesh/triangulate.h"
#include "filigree/mesh/weld.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace filigree::studio {

namespace {

std::vector<Vec3f> start_positions(const Model& model, const Pose* start) {
    return start ? start->positions : driver_positions(model);
}

std::vector<Triangle> driver_triangles(const Model& model) {
    Mesh mesh; // the faces alone: triangulating looks at the positions at rest
    mesh.positions = driver_positions(model);
    mesh.face_offsets = model.driver().face_offsets;
    mesh.corners = model.driver().corners;
    return triangulate(mesh).triangles;
}

/// Those of a pull and those it holds, in the order that the solver is told their places.
struct PullSolver {
    HandleSolver solver;
    std::vector<Vec3f> targets; ///< of the pulled ones, then of those held: where they start
    std::size_t pulled;

    static Result<PullSolver> create(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                     std::span<const Index> grip, std::span<const Index> held,
                                     const RunContext& context) {
        std::vector<Index> handles(grip.begin(), grip.end());
        handles.insert(handles.end(), held.begin(), held.end());
        Result<HandleSolver> solver = HandleSolver::create(positions, triangles, handles, context);
        if (!solver) return solver.error();
        std::vector<Vec3f> targets;
        for (const Index v : handles) targets.push_back(positions[v]);
        return PullSolver{std::move(*solver), std::move(targets), grip.size()};
    }
    Result<HandleResult> solve(const Vec3f& way, const HandleOptions& options, const RunContext& context) {
        std::vector<Vec3f> places = targets;
        for (std::size_t i = 0; i < pulled; ++i) places[i] += way;
        return solver.solve(places, options, context);
    }
};

/// One vertex of the finest mesh, restored from pose after pose.
class GrabbedVertex {
public:
    GrabbedVertex(const Model& model, Index vertex, const Pose* start)
        : restorer_(std::get<BlendDetail>(model.detail), model.mesh.positions, model.driver().vertices,
                    std::array{BlendRestorer::Item{vertex, 0}}),
          start_(model.mesh.positions[vertex]) {
        if (start) start_ = place(*start);
    }
    /// From where it started.
    Vec3f way(const Pose& pose) const { return place(pose) - start_; }

private:
    Vec3f place(const Pose& pose) const {
        Vec3f place;
        restorer_.restore(pose.positions, pose.gradients, std::span(&place, 1), {}, true, RunContext());
        return place;
    }
    BlendRestorer restorer_;
    Vec3f start_;
};

/// The driver vertices that carry a vertex of the finest mesh, ascending; none for the reference code.
std::vector<Index> carriers(const Model& model, Index vertex) {
    const auto* detail = std::get_if<BlendDetail>(&model.detail);
    if (!detail) return {};
    const auto record = std::find(detail->order.begin(), detail->order.end(), vertex) - detail->order.begin();
    const auto next = std::upper_bound(detail->cell_offsets.begin(), detail->cell_offsets.end(), record);
    const auto cell = static_cast<std::size_t>(next - detail->cell_offsets.begin() - 1);
    if (cell >= detail->cells.size()) return {};
    std::vector<Index> result(detail->cells[cell].begin(), detail->cells[cell].end());
    std::sort(result.begin(), result.end());
    return result;
}

/// The rotations of a pull that began at `start` (null: at rest) follow the gradients there.
void follow_start(Pose& pose, const Pose* start) {
    if (!start || start->gradients.empty()) return;
    for (std::size_t v = 0; v < pose.gradients.size(); ++v) pose.gradients[v] *= start->gradients[v];
}

/// One pull of the driver done again, over every vertex of the mesh. Vertices at one place move as one.
Status pull_all(const State& state, const Handle& pull, std::span<const Index> representative,
                std::span<const Triangle> triangles, std::vector<Vec3f>& positions, const RunContext& context) {
    const std::vector<Vec3f>& rest = state.model->mesh.positions;
    std::vector<char> is_held(rest.size());
    for (const Index v : pull.held) is_held[representative[state.model->driver().vertices[v]]] = 1;
    std::vector<Index> grip, held;
    for (const Index v : pull.vertices) is_held[representative[state.model->driver().vertices[v]]] = 2;
    for (Index v = 0; v < rest.size(); ++v) {
        if (representative[v] != v) continue;
        const double distance = (rest[v] - pull.centre).norm();
        if (is_held[v] == 2 || (!is_held[v] && distance <= pull.grip))
            grip.push_back(v);
        else if (is_held[v] || distance > pull.reach)
            held.push_back(v);
    }
    Result<PullSolver> solver = PullSolver::create(positions, triangles, grip, held, context);
    if (!solver) return solver.error();
    Result<HandleResult> result = solver->solve(pull.move, {}, context);
    if (!result) return result.error();
    positions = std::move(result->pose.positions);
    return Success{};
}

} // namespace

std::unique_ptr<SpaceWarp> make_warp(const Warps& warps, const Box& rest_box) {
    if (warps.none() || rest_box.empty()) return nullptr;
    std::vector<std::unique_ptr<SpaceWarp>> steps;
    if (warps.stretch != 1) steps.push_back(make_stretch(rest_box, warps.axis, warps.stretch));
    if (warps.squeeze != 1) steps.push_back(make_squeeze(rest_box, warps.axis, warps.squeeze));
    if (warps.bend != 0) steps.push_back(make_bend(rest_box, warps.axis, warps.bend));
    if (warps.twist != 0) steps.push_back(make_twist(rest_box, warps.axis, warps.twist));
    if (warps.taper != 1) steps.push_back(make_taper(rest_box, warps.axis, warps.taper));
    return make_chain(std::move(steps));
}

Pose deformed_pose(const State& state, const RunContext& context) {
    if (!state.model) return {};
    const Mesh& mesh = state.model->mesh;
    const auto warp = make_warp(state.warps, world_bounds(mesh));
    if (!warp) return state.handle_pose ? *state.handle_pose : Pose{};
    Pose pose = warp_pose(*warp, start_positions(*state.model, state.handle_pose.get()), mesh.origin, context);
    follow_start(pose, state.handle_pose.get());
    return pose;
}

Result<std::vector<Vec3f>> full_deformation(const State& state, const RunContext& context) {
    if (state.pose_from_file)
        return Error{ErrorCode::unsuitable, "The shape began with a pose from a file, and where that would take every "
                                            "vertex is not known; reset the deformation to measure what you do."};
    const Mesh& mesh = state.model->mesh;
    std::vector<Vec3f> positions = mesh.positions;
    const auto is_pull = [](const Handle& handle) { return !handle.pinned; };
    const auto pulls = std::count_if(state.handles.begin(), state.handles.end(), is_pull);
    if (pulls > 0) {
        const std::vector<Index> representative = weld_map(mesh.positions);
        std::vector<Triangle> triangles = triangulate(mesh).triangles;
        for (Triangle& triangle : triangles)
            for (Index& vertex : triangle) vertex = representative[vertex];
        std::ptrdiff_t done = 0;
        for (const Handle& handle : state.handles) {
            if (!is_pull(handle)) continue;
            context.report("pulling every vertex", double(done++) / double(pulls));
            if (context.is_cancelled()) return cancelled_error();
            const Status status = pull_all(state, handle, representative, triangles, positions, context);
            if (!status) return status.error();
        }
        for (Index v = 0; v < positions.size(); ++v) positions[v] = positions[representative[v]];
    }
    if (context.is_cancelled()) return cancelled_error();
    const auto warp = make_warp(state.warps, world_bounds(mesh));
    return warp ? warp_positions(*warp, positions, mesh.origin, context) : positions;
}

PullRegion pull_region(const State& state, const Vec3f& rest_point, double grip, double reach,
                       std::optional<Index> vertex) {
    const std::vector<Index> carried_by = vertex ? carriers(*state.model, *vertex) : std::vector<Index>();
    const std::vector<Vec3f> rest = driver_positions(*state.model);
    const VertexSet pinned(rest.size(), pinned_vertices(state.handles));
    PullRegion region;
    Index nearest = kNoIndex;
    for (Index v = 0; v < rest.size(); ++v) {
        if (pinned.contains(v)) continue;
        const float distance = (rest[v] - rest_point).norm();
        if (nearest == kNoIndex || distance < (rest[nearest] - rest_point).norm()) nearest = v;
        if (distance <= grip || std::binary_search(carried_by.begin(), carried_by.end(), v)) region.grip.push_back(v);
    }
    if (region.grip.empty() && nearest != kNoIndex) region.grip.push_back(nearest);
    for (Index v = 0; v < rest.size(); ++v)
        if (pinned.contains(v) ||
            ((rest[v] - rest_point).norm() > reach && !std::binary_search(region.grip.begin(), region.grip.end(), v)))
            region.held.push_back(v);
    return region;
}

Vec3d unwarped(const SpaceWarp& warp, const Vec3d& place, const Vec3d& guess) {
    constexpr int kSteps = 20;
    Vec3d point = guess;
    Warped now = warp.warp(point);
    double distance = (place - now.position).norm();
    for (int step = 0; step < kSteps; ++step) {
        const Eigen::FullPivLU<Mat3d> gradient(now.gradient);
        if (!gradient.isInvertible()) break;
        Vec3d way = gradient.solve(place - now.position);
        bool is_nearer = false;
        for (int halving = 0; halving < 8 && !is_nearer; ++halving, way *= 0.5) {
            const Warped next = warp.warp(point + way);
            const double next_distance = (place - next.position).norm();
            if (!(next_distance < distance)) continue;
            point += way;
            now = next;
            distance = next_distance;
            is_nearer = true;
            break;
        }
        if (!is_nearer) break;
    }
    return point;
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

    // A few rounds a picture while the mouse moves; the rest while it rests.
    static constexpr unsigned kRounds = 8;
    static constexpr double kTolerance = 1e-4, kFinalTolerance = 1e-5;
    static constexpr unsigned kMostRounds = 400;                    ///< without a move
    static constexpr double kOffPointer = 3e-4;                     ///< of the diagonal: a fraction of a pixel
    static constexpr float kMostCorrection = 0.5f;                  ///< of the way: pins may hold what carries it
    static constexpr std::chrono::milliseconds kLongestEnding{250}; ///< a large driver is let go a little early
    static constexpr std::chrono::seconds kLongestFinish{3};        ///< preparing included

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

    Status solve() {
        const std::vector<Vec3f> positions = start_positions(*model, start.get());
        Result<PullSolver> solver =
            PullSolver::create(positions, driver_triangles(*model), pull.vertices, pull.held, context);
        if (!solver) return solver.error();
        std::optional<GrabbedVertex> vertex;
        const bool is_known = model->code() == DetailCode::blend && (!start || !start->gradients.empty());
        if (grabbed && is_known) vertex.emplace(*model, *grabbed, start.get());
        const double off_pointer = kOffPointer * bounds(model->mesh.positions).diagonal();
        Vec3f correction = Vec3f::Zero();
        std::uint64_t solved = 0;
        double last_move = 1, distance = 0; // of the vertex that was grabbed from where it should be
        unsigned rounds = 0;
        std::optional<std::chrono::steady_clock::time_point> ending_since;
        for (;;) {
            Vec3f to;
            double tolerance = kTolerance;
            {
                std::unique_lock lock(mutex);
                const auto settled = [&] {
                    return (last_move <= (is_ending ? kFinalTolerance : kTolerance) && distance <= off_pointer) ||
                           rounds >= kMostRounds;
                };
                const auto has_work = [&] { return stops || is_ending || way_number != solved || !settled(); };
                if (!has_work()) {
                    rests = true;
                    bell.ring();
                    wake.wait(lock, has_work);
                    rests = false;
                }
                if (stops) return cancelled_error();
                if (is_ending && !ending_since) ending_since = std::chrono::steady_clock::now();
                const bool is_late = ending_since && std::chrono::steady_clock::now() - *ending_since > kLongestEnding;
                if (is_ending && way_number == solved && (settled() || is_late)) return Success{};
                if (way_number != solved) rounds = 0;
                solved = way_number;
                to = way;
                if (is_ending) tolerance = kFinalTolerance;
            }
            const auto begin = std::chrono::steady_clock::now();
            const Vec3f applying = to + correction;
            Result<HandleResult> result =
                solver->solve(applying, {.iterations = kRounds, .tolerance = tolerance}, context);
            if (!result) return result.error();
            rounds += std::max(1u, result->iterations);
            last_move = result->last_move;
            follow_start(result->pose, start.get());
            if (vertex) {
                const Vec3f rest = to - vertex->way(result->pose);
                distance = double(rest.norm());
                correction += rest;
                const float most = kMostCorrection * to.norm();
                if (correction.norm() > most) correction *= most / correction.norm();
            }
            const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
            auto next = std::make_shared<const Pose>(std::move(result->pose));
            {
                const std::scoped_lock lock(mutex);
                pose = std::move(next);
                applied = applying;
                milliseconds = took.count();
                is_new = true;
            }
            bell.ring();
        }
    }
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

std::shared_ptr<const Pose> HandleDrag::finish() {
    if (!impl_) return nullptr;
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
    if (error) Q_EMIT failed(*error);
    return pose;
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
