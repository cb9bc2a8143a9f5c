// Deforming by numbers and by hand.
#include "workbench_impl.h"

#include "pins.h"
#include "words.h"

#include <chrono>
#include <cmath>

namespace filigree::studio {

namespace {

/// Numbers that the library's functions take, whatever a control came up with.
Warps within_range(Warps warps, const Warps& otherwise) {
    for (const WarpInfo& info : warp_infos()) {
        if (info.amount == nullptr) continue;
        double& amount = warps.*info.amount;
        if (!std::isfinite(amount) || (info.is_factor && amount <= 0)) amount = otherwise.*info.amount;
    }
    return warps;
}

} // namespace

void Workbench::set_warps(const Warps& wanted, const std::string& merge) {
    const Warps warps = within_range(wanted, state().warps);
    set_mode(Mode::deform);
    document_.edit(
        name_of_change(state().warps, warps), [&](State& next) { next.warps = warps; }, merge);
}

void Workbench::reset_deformation() {
    set_mode(Mode::deform);
    document_.edit("Reset the deformation", [](State& next) {
        next.warps = {.axis = next.warps.axis};
        next.handles.clear();
        next.handle_pose = nullptr;
        next.pose_from_file = false;
    });
}

void Workbench::pin(std::span<const Index> driver_vertices) {
    State next = state();
    const std::vector<Vec3f> places = next.handle_pose ? next.handle_pose->positions : driver_positions(*next.model);
    const std::size_t count = studio::pin(next.handles, driver_vertices, places);
    if (count == 0) return;
    document_.change("Pin " + counted(count, "vertex", "vertices"), std::move(next));
    if (playback_.has_body()) Q_EMIT told("New pins hold the body once it is made again.", false, "body.make");
}

void Workbench::unpin(std::span<const Index> driver_vertices) {
    State next = state();
    const std::size_t count = studio::unpin(next.handles, driver_vertices, next.model->driver().vertices.size());
    if (count == 0) return;
    document_.change("Unpin " + counted(count, "vertex", "vertices"), std::move(next));
    if (playback_.has_body()) Q_EMIT told("The body is free there once it is made again.", false, "body.make");
}

void Workbench::unpin_all() { unpin(pinned_vertices(state().handles)); }

void Workbench::begin_pull(Index vertex, const Vec3d& at) {
    if (is_pulling()) end_pull();
    const Mesh& mesh = state().model->mesh;
    if (vertex >= mesh.vertex_count() || !at.allFinite()) return;
    const Vec3f rest = mesh.positions[vertex];
    if (mode_ == Mode::body) {
        if (!playback_.has_body())
            return Q_EMIT told("A recording cannot be pulled, but its body can.", false, "body.make");
        impl_->replay.stop();
        show_last_frame();
        return playback_.grab(rest, at - mesh.origin);
    }
    if (state().source->pieces)
        return Q_EMIT told("What is in pieces is pulled as a body, until it breaks.", false, "body.make");
    const double diagonal = bounds(mesh).diagonal();
    Handle pull{.centre = rest,
                .grip = view_.settings().grip * diagonal,
                .reach = std::max(view_.settings().reach, view_.settings().grip) * diagonal};
    PullRegion region = pull_region(state(), rest, pull.grip, pull.reach, vertex);
    if (region.grip.empty()) return Q_EMIT told("Everything here is pinned.", false, "edit.unpin_all");
    pull.vertices = std::move(region.grip);
    pull.held = std::move(region.held);
    impl_->warp = make_warp(state().warps, world_bounds(mesh));
    impl_->grabbed = impl_->warp ? unwarped(*impl_->warp, at, mesh.world_position(vertex)) : at;
    impl_->pull = pull;
    drag_.begin(state().model, state().handle_pose, std::move(pull), vertex);
}

void Workbench::pull_to(const Vec3d& target) {
    if (!is_pulling() || !target.allFinite()) return;
    if (playback_.is_grabbed()) return playback_.pull(target - state().model->mesh.origin);
    const Vec3d place =
        impl_->warp ? unwarped(*impl_->warp, target, impl_->grabbed + impl_->pull.move.cast<double>()) : target;
    impl_->pull.move = (place - impl_->grabbed).cast<float>();
    drag_.move(impl_->pull.move);
}

/// The driver as it is dragged, before it becomes a step.
void Workbench::show_drag(const std::shared_ptr<const Pose>& pose, double milliseconds) {
    if (mode_ != Mode::deform) return;
    const auto begin = std::chrono::steady_clock::now();
    State dragged = state();
    dragged.handle_pose = pose;
    pose_ = deformed_pose(dragged, impl_->context);
    driver_milliseconds_ = milliseconds + milliseconds_since(begin);
    pose_is_new();
}

void Workbench::end_pull() {
    if (playback_.is_grabbed()) return playback_.let_go();
    if (!drag_.is_active()) return;
    Result<std::shared_ptr<const Pose>> finished = drag_.finish();
    if (!finished) return; // it failed, and that was told
    std::shared_ptr<const Pose> pose = std::move(finished).value();
    if (!pose) Q_EMIT told("The driver is large: hold it until it follows, then let go.", false);
    Handle& pull = impl_->pull;
    if (!pose || pull.move.isZero(0)) return show_pose();
    pull.move = drag_.applied();
    State next = state();
    for (const Index v : pull.vertices) pull.targets.push_back(pose->positions[v]);
    next.handles.push_back(std::move(pull));
    next.handle_pose = std::move(pose);
    document_.change("Pull", std::move(next));
}

void Workbench::cancel_pull() {
    if (playback_.is_grabbed()) return end_pull();
    if (!drag_.is_active()) return;
    drag_.stop();
    show_pose();
}

} // namespace filigree::studio
