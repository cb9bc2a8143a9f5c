// Where an animation wants the particles of a body, within a frame. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/simulation.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filigree {

/// The targets at the start and at the end of the frame that comes.
struct TargetsMemory {
    std::uint64_t actor = 0;
    std::uint64_t is_set = 0;                              ///< 1: the end is known; else the targets stop at `from`
    Vectors from, from_velocities, to, to_velocities;      ///< m, m/s
    Vectors accelerations;                                 ///< m/s^2 that are felt on the way; or empty
    std::vector<RestStretch> from_stretches, to_stretches; ///< of the rest shape; empty: as the body is
};

struct Targets {
    /// positions and velocities: now. spacing: the body's, m.
    Targets(std::size_t actor, Follow follow, const Vectors& positions, const Vectors& velocities, double spacing);

    void set(const Vectors& positions, const Vectors& velocities, const Vectors& accelerations,
             std::vector<RestStretch> stretches);
    /// Whether a saved memory is of these targets, and sound.
    bool takes(const TargetsMemory& saved) const;
    void end_frame();

    TargetsMemory memory;
    std::vector<Index> held;     ///< particles on their targets, ascending
    std::vector<float> pulls;    ///< 1/s^2, of each particle's spring; 0 where it is held
    std::vector<float> dampings; ///< 1/s
    std::vector<float> leashes;  ///< m
    float leash_pull = 0;        ///< 1/s^2
    float leash_damping = 0;     ///< 1/s
    float most_acceleration = 0; ///< m/s^2
    float jump = 0;              ///< m: what a target may travel beside its velocities

    /// Of the frame that is being made, by begin_frame: velocities that overshoot nowhere, and what is felt.
    struct Course {
        Vectors from_velocities, to_velocities;
        Vectors felt; ///< m/s^2, in addition to gravity; or empty
    } course;
    /// Works out the course; seconds: of a frame. Moves `from` where targets jump. Returns how far each jumps, m; empty
    /// where none does.
    Vectors begin_frame(float seconds);

    /// The weights of from, to, their velocities: of the place and of the velocity at a part of the frame.
    struct Weights {
        float from, to, from_velocity, to_velocity;      ///< of the place
        float way, from_velocity_rate, to_velocity_rate; ///< of the velocity; way: of (to - from)
        Weights(float part, float seconds);
    };
};

/// The first thing wrong, as a sentence, or "". count: particles of the body.
std::string check_follow(const Follow& follow, std::size_t count);
std::string check_stretches(std::span<const Mat3f> stretches, std::size_t count);
std::vector<RestStretch> rest_stretches(std::span<const Mat3f> stretches);

struct SimulationState;
/// Lets go of particles that are held on targets; those that are pinned stay pinned.
void release_targets(SimulationState& state, BodyState& body);

} // namespace filigree
