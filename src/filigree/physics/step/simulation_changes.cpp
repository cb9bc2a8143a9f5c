// A simulation's world changes between frames.
#include "filigree/physics/rigid/rigid_body.h"
#include "filigree/physics/simulation.h"
#include "filigree/physics/step/ray_cast.h"
#include "filigree/physics/step/run_time.h"

#include <cmath>

namespace filigree {

namespace {

constexpr double kWithin = 0.25; ///< spacings: an obstacle that was set so near where it stands does not jump

Error no_such(const char* what, std::size_t number, std::size_t count) {
    return {ErrorCode::usage, "There is no " + std::string(what) + " " + std::to_string(number) + "; there are " +
                                  std::to_string(count) + ", counted from 0."};
}

} // namespace

bool Simulation::has_body(std::size_t body) const { return state_->has(body); }

Status Simulation::check_body(std::size_t body) const {
    if (body >= body_count()) return no_such("body", body, body_count());
    if (!has_body(body)) return Error{ErrorCode::usage, "Body " + std::to_string(body) + " was removed."};
    return Success{};
}

Result<std::size_t> Simulation::add_body(const Actor& actor, const RunContext& context) {
    if (context.is_cancelled()) return cancelled_error();
    if (Status checked = check_actor(actor); !checked) return checked.error();
    return filigree::add_body(*state_, actor, context);
}

Status Simulation::remove_body(std::size_t body) {
    if (Status checked = check_body(body); !checked) return checked;
    filigree::remove_body(*state_, body);
    return Success{};
}

bool Simulation::has_attachment(std::size_t attachment) const {
    return attachment < state_->attachments.size() && state_->attachments[attachment].body != BodyState::kNobody;
}

Status Simulation::check_obstacle(std::size_t obstacle) const {
    const std::size_t count = state_->world.obstacles.size();
    if (obstacle >= count) return no_such("obstacle", obstacle, count);
    return Success{};
}

Status Simulation::set_obstacle(std::size_t obstacle, const Eigen::Isometry3d& pose, const Vec3d& velocity,
                                const Vec3d& spin) {
    if (Status checked = check_obstacle(obstacle); !checked) return checked;
    if (Status checked = check_obstacle_motion(pose, velocity, spin); !checked) return checked;
    const Obstacle& which = state_->world.obstacles[obstacle];
    const double now = time(), frame = state_->frame_seconds();
    const Eigen::Isometry3d stands = which.motion.at(now);
    const bool is_jump = way_between(stands, pose, state_->bodies) > kWithin * double(least_spacing(state_->bodies));
    const Course course{.from = is_jump ? pose : stands,
                        .to = moved_on(pose, pivot_of(which), velocity, spin, frame),
                        .velocity = velocity,
                        .spin = spin,
                        .turning = spin};
    filigree::set_obstacle(*state_, set_motion(which, obstacle, course, now, now + frame), is_jump);
    return Success{};
}

Status Simulation::move_obstacle(std::size_t obstacle, const Eigen::Isometry3d& pose) {
    if (Status checked = check_obstacle(obstacle); !checked) return checked;
    if (Status checked = check_obstacle_motion(pose, Vec3d::Zero(), Vec3d::Zero()); !checked) return checked;
    const Obstacle& which = state_->world.obstacles[obstacle];
    const double now = time();
    const Course course{.from = which.motion.at(now), .to = pose};
    filigree::set_obstacle(*state_, set_motion(which, obstacle, course, now, now + state_->frame_seconds()), false);
    return Success{};
}

Eigen::Isometry3d Simulation::obstacle_pose(std::size_t obstacle) const {
    return state_->world.obstacles[obstacle].motion.at(time());
}

const std::vector<ContactEvent>& Simulation::contact_events() const { return state_->contacts.events().of_frame(); }

Status Simulation::set_may_sleep(std::size_t body, bool may_sleep) {
    if (Status checked = check_body(body); !checked) return checked;
    BodyState& state = state_->body_of(body);
    state.may_sleep = may_sleep;
    for (std::size_t piece = 0; state.broken && piece < state.broken->pieces.size(); ++piece)
        state_->bodies[state.first_piece + piece].may_sleep = may_sleep;
    return may_sleep ? Success{} : wake(body);
}

bool Simulation::is_asleep(std::size_t body) const {
    const BodyState& state = std::as_const(*state_).body_of(body);
    return state.rigid && state.rigid->sleeps;
}

Status Simulation::wake(std::size_t body) {
    if (Status checked = check_body(body); !checked) return checked;
    if (!is_asleep(body)) return Success{};
    filigree::wake(state_->body_of(body));
    return Success{};
}

std::optional<WorldHit> Simulation::cast_ray(const Vec3d& origin, const Vec3d& direction,
                                             const RayOptions& options) const {
    const double length = direction.norm();
    if (!origin.allFinite() || !(length > 0) || !std::isfinite(length) || !(options.reach > 0)) return std::nullopt;
    return filigree::cast_ray({origin, direction / length, options.reach}, *state_, options.ignore);
}

} // namespace filigree
