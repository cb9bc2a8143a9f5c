// Simulation of a scene: it records each body's driver in every frame, and the reasons to doubt the motion.
#pragma once

#include "filigree/restore.h"
#include "filigree/scene/following.h"
#include "filigree/scene/recording.h"
#include "filigree/scene/world_setup.h"

#include <map>
#include <optional>
#include <string>

namespace filigree {

class SceneRun {
public:
    /// A run at its start. scene and ready must outlive it and stay where they are. checks: also carry every vertex by
    /// the particles, and compare the restored mesh with that (costs more time). Errors: as of
    /// Simulation::create and Restorer::create.
    static Result<SceneRun> create(const SceneFile& scene, const ReadyScene& ready, bool checks,
                                   const RunContext& context);
    /// Goes on from a state; name: what errors call it. Errors: as of unpack_state.
    Status resume(std::string_view state, const std::string& name);
    /// A state, for resume().
    std::string save() const;

    /// Simulates until frame `last` is done; progress: "simulating". Errors: as of Simulation::advance and
    /// Restorer::positions; what was recorded before is whole. Cancelled: the frame that was begun is left out.
    Status advance_to(std::uint64_t last, const RunContext& context);

    std::uint64_t frame() const { return recording_.totals.frames; }
    const Recording& recording() const { return recording_; }
    const RunTimes& times() const { return times_; }
    FractureReport fracture(std::size_t body) const { return simulation_.fracture(body); }
    Energy energy() const { return simulation_.energy(always_); }
    /// The body's mesh in one of the recorded poses, at the scene's origin. Errors: as of Restorer::mesh.
    Result<Mesh> mesh(std::size_t body, std::size_t frame, const RunContext& context) const;
    /// Reasons to doubt the motion so far, and where it differs from what the scene says: sentences.
    std::vector<std::string> warnings() const;
    /// A sentence where what is recorded is not to be trusted: motions were not finite or the driver went nowhere
    /// sensible, cells of fem or springs were inside out at the end of a frame, or energy came from nowhere. warnings()
    /// then say how much, where, and what to change.
    std::optional<std::string> broke_down() const;
    /// Facts that need no action: sentences.
    std::vector<std::string> notes() const;

private:
    /// What goes along with a body.
    struct Follower {
        std::size_t driver = 0;            ///< attachment
        std::optional<std::size_t> direct; ///< of every vertex, where that is checked
        Restorer restorer;
        std::vector<Vec3f> restored; ///< the latest frame
    };

    SceneRun(const SceneFile& scene, const ReadyScene& ready, Simulation simulation, unsigned threads);
    Status follow(bool checks);
    Status follow_characters();
    Status record_body(std::size_t body);
    void hold_lost_of(std::size_t body);
    void check_body(std::size_t body);
    void note_doubts(const FrameReport& report);
    bool is_inside_out() const;
    void note_flow(const FrameReport& report);
    void watch_energy();
    std::size_t fastest_body() const;
    Vec3f middle_of(std::size_t body) const;
    std::string place_text(const Vec3f& place) const;
    std::string unstable_warning(std::size_t body) const;
    std::string inversion_warning(std::size_t body) const;
    std::string flow_warning(std::size_t body) const;
    std::string loss_warning() const;
    std::string energy_warning() const;

    const SceneFile* scene_;
    const ReadyScene* ready_;
    RunContext always_; ///< not cancelled: what is recorded of a frame is whole
    Simulation simulation_;
    std::vector<Follower> followers_;
    std::vector<Following> following_; ///< of the bodies that follow a character
    Recording recording_;
    RunTimes times_;
};

} // namespace filigree
