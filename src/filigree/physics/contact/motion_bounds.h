// Bounds on how far and how fast bodies move. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/contact/extremes_kernel.h"

#include <memory>

namespace filigree {

/// By the corners of a body's cells, but for light ones, which hardly move the surface.
class MotionBounds {
public:
    /// A body is at this number; like: one of its kind that is there already, or itself.
    void set_body(std::size_t number, const BodyState& body, std::size_t like);
    void remove_body(std::size_t number);

    /// Bodies have moved for dt, s. A rigid one may have moved by other velocities than it has now: contacts correct
    /// depths by velocities that they take away again.
    void find_speeds(std::span<const BodyState> bodies, float dt, const RunContext& context);
    /// How far bodies are from where they were when shifts were last counted from there.
    void find_shifts(std::span<const BodyState> bodies, const RunContext& context);
    /// sleepers: also of what sleeps, where something else may have moved it.
    void count_from_here(std::span<const BodyState> bodies, bool sleepers);

    const Extremes& velocities(std::size_t body) const { return velocities_[body]; } ///< m/s, after find_speeds
    const Extremes& shifts(std::size_t body) const { return shifts_[body]; }         ///< m, after find_shifts
    float speed(std::size_t body) const { return furthest(velocities_[body]); }
    /// Of what a body's particles have, the most in length ...
    static float furthest(const Extremes& of) { return of.least.cwiseAbs().cwiseMax(of.most.cwiseAbs()).norm(); }
    /// ... and the most along a direction of length 1; at least 0.
    static float furthest_along(const Extremes& of, const Vec3f& direction) {
        const float most = of.least.cwiseProduct(direction).cwiseMax(of.most.cwiseProduct(direction)).sum();
        return most < 0 ? 0 : most; // not a number: the frame is done again
    }
    /// Whether surface points lie outside of the box of the cells; unknown of a rigid body.
    bool has_points_outside(std::size_t body) const { return followed_[body]->has_points_outside; }

private:
    struct Followed {              ///< corners whose motion is looked at
        std::vector<float> counts; ///< of each, as extremes_of wants them
        Index heaviest = 0;
        std::vector<Index> corners; ///< of a rigid body, instead: those that all others lie between
        bool has_points_outside = false;
    };
    static Followed followed(const BodyState& body);
    void add_motion(std::size_t body, const Vectors& positions, float dt);
    Extremes extremes(std::size_t body, const Vectors& values, const Vectors* from) const;

    std::vector<std::shared_ptr<const Followed>> followed_; ///< bodies of one kind share theirs
    std::vector<Extremes> velocities_, shifts_;
    std::vector<Vectors> places_;          ///< of corners, where shifts are counted from
    std::vector<std::vector<Vec3f>> last_; ///< of a rigid body: where the corners that are followed were
};

} // namespace filigree
