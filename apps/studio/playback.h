// A body in motion: the simulation in a thread of its own, and the recording it leaves.
#pragma once

#include "document.h"

#include "filigree/scene/body_motion.h"

#include <QObject>

namespace filigree::studio {

class Bell;

/// The state's model as a body, its pinned vertices held. Errors: as of make_dropped_body.
Result<std::shared_ptr<const DroppedBody>> make_body_of(const State& state, const Vec3d& up, const RunContext& context);

/// Lives in the main thread.
class Playback : public QObject {
    Q_OBJECT
public:
    explicit Playback(QObject* parent = nullptr);
    ~Playback() override; ///< stops, wherever it is

    /// A body at its start. Replaces whatever was there.
    void put(std::shared_ptr<const DroppedBody> made);
    void remove();
    bool has_body() const { return made_ != nullptr; }
    std::shared_ptr<const DroppedBody> made() const { return made_; }

    void play();  ///< from the last frame simulated, as fast as 60 frames a second
    void pause(); ///< at once, in the middle of a frame too: the frames delivered by then are all there are
    void step();  ///< one frame
    void reset(); ///< to the start; the recording is emptied
    bool is_playing() const { return is_playing_; }
    bool is_stepping() const; ///< frames asked for by step() are still to come
    /// Returns when the frames asked for by play() or step() so far have been delivered, or after `frames` more.
    void wait_for_frames(std::size_t frames);

    /// Takes hold of a point of the surface (at rest, model units relative to the origin) and pulls it to `target` (as
    /// now). Plays, if it did not.
    void grab(const Vec3f& rest_point, const Vec3d& target);
    void pull(const Vec3d& target);
    void let_go();
    bool is_grabbed() const { return is_grabbed_; }

    /// What each moment is to tell besides: dearer.
    void want(const MomentWishes& wishes);
    const MomentWishes& wishes() const { return wishes_; }

    /// Of the air around a body that melts, from the next frame on.
    void set_air_temperature(double kelvins);
    /// Warms or cools what is near a place, model units relative to the origin, until put_out_torch(). Plays, if it
    /// did not. Of a body that melts.
    void hold_torch(const Vec3d& place, const Torch& torch);
    void put_out_torch();

    /// The latest moment delivered; null without a body.
    const Moment* moment() const { return moment_.get(); }
    /// Poses since the start, the first is the start itself; grows by a frame a moment.
    const PoseSequence& recording() const { return recording_; }
    /// Of a body that melts: what there is in place of the restored mesh. Null: nothing.
    std::shared_ptr<const Mesh> surface(std::size_t frame) const { return surfaces_[frame]; }
    std::span<const std::shared_ptr<const Mesh>> surfaces() const { return surfaces_; } ///< one a frame

Q_SIGNALS:
    void moved();                    ///< another moment
    void stepped();                  ///< the frames asked for by step() are there, or will not come
    void state_changed();            ///< body there or not, playing or not
    void failed(const Error& error); ///< of the simulation: the body is removed after this

private:
    struct Worker;
    void deliver();
    void record(const Pose& pose, std::shared_ptr<const Mesh> surface);
    void begin_anew();

    std::shared_ptr<const DroppedBody> made_;
    std::unique_ptr<Moment> moment_;
    PoseSequence recording_;
    std::vector<std::shared_ptr<const Mesh>> surfaces_; ///< one a frame of the recording
    std::size_t recorded_bytes_ = 0;
    MomentWishes wishes_;
    bool is_playing_ = false, is_grabbed_ = false, has_torch_ = false;
    Vec3f grabbed_ = Vec3f::Zero();
    std::size_t delivered_ = 0; ///< frames, in all
    std::unique_ptr<Bell> bell_;
    std::unique_ptr<Worker> worker_; ///< of the body; null: none
};

} // namespace filigree::studio
