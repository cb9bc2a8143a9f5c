// A dropped body in motion, moment by moment.
#pragma once

#include "filigree/hierarchy/pose.h"
#include "filigree/physics/simulation.h"
#include "filigree/scene/dropped_body.h"

#include <optional>
#include <string>
#include <vector>

namespace filigree {

/// One moment of a body, in model units relative to the model's origin.
struct Moment {
    std::size_t frame = 0; ///< frames since the start; 0 is the start
    Pose pose;             ///< of the driver, with gradients
    std::vector<Vec3f> particles;
    std::vector<Vec3f> full; ///< every vertex as the particles carry it; only when asked for
    FrameReport report;
    FractureReport fracture; ///< of a body that breaks
    double milliseconds = 0; ///< of the simulation and the driver together
};

/// Before anything has moved.
Moment start_of(const DroppedBody& dropped);

/// The simulation of one body, 60 frames a second, and its driver that goes along.
class BodyMotion {
public:
    /// Errors: as of Simulation::create.
    static Result<BodyMotion> create(std::shared_ptr<const DroppedBody> dropped, const RunContext& context);

    /// Back to the start, with no hands. Errors: as of Simulation::restore.
    Status rewind(const RunContext& context);
    /// Hands that pull from the next frame on, in metres. Errors: as of Simulation::set_hands.
    Status set_hands(std::vector<Hand> hands, const RunContext& context);
    /// One frame. Errors: as of Simulation::advance; a cancelled frame is not begun.
    Result<FrameReport> advance(const RunContext& context);
    /// As it is now; report and milliseconds are left to the caller. Parts of the driver that went nowhere sensible
    /// stay where the last look saw them. with_full: every vertex too, which is dearer.
    Moment look(bool with_full);

private:
    BodyMotion(std::shared_ptr<const DroppedBody> dropped, Simulation simulation);
    std::size_t attach(std::vector<Vec3f> points, std::span<const Index> pieces);

    std::shared_ptr<const DroppedBody> dropped_;
    Simulation simulation_;
    std::size_t driver_ = 0;
    std::optional<std::size_t> all_vertices_;
    std::string start_;
    Pose last_;
};

} // namespace filigree
