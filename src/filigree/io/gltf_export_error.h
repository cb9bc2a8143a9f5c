// How far an exported animation is from our own restore, at its keys and between them.
#pragma once

#include "filigree/context.h"
#include "filigree/file.h"
#include "filigree/strip.h"

#include <functional>
#include <span>

namespace filigree {

/// Poses at any moment: the stream's frames, linearly interpolated in between.
class PoseSampler {
public:
    /// check: asked of every frame before it is used. The stream must outlive the sampler.
    PoseSampler(const FrameSource<Pose>& stream, std::function<Status(const Pose&)> check);
    /// seconds: 0 .. (frames - 1) / frames_per_second; held at the ends.
    Result<Pose> at(double seconds);

private:
    struct Kept {
        std::size_t frame;
        Pose pose;
    };
    const FrameSource<Pose>& stream_;
    std::function<Status(const Pose&)> check_;
    std::vector<Kept> kept_; ///< the last two frames asked for

    Result<const Pose*> frame(std::size_t number);
};

/// Positions at a moment into `out`.
using PositionsAt = std::function<Status(double seconds, std::span<Vec3f> out)>;

/// Sets the errors of `report`: the first `restored_count` of the played vertices against the restored ones, as
/// fractions of the restored mesh's diagonal at the first key (a pose may be in other units than the rest shape).
/// Looked at are all keys (in seconds) and all frames between them, or the middle of two keys where no frame lies
/// between; of very many some, evenly chosen, so that about 10^8 vertices are.
Status measure_animation(const PositionsAt& played, std::size_t played_count, const PositionsAt& restored,
                         std::size_t restored_count, std::span<const double> keys, double frames_per_second,
                         ExportReport& report, const RunContext& context);

} // namespace filigree
