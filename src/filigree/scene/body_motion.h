// A dropped body in motion, moment by moment.
#pragma once

#include "filigree/physics/simulation.h"
#include "filigree/scene/dropped_body.h"
#include "filigree/strip.h"

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
    /// Of a body that melts: its surface, once the restored mesh is not all of it. Null: it is.
    std::shared_ptr<const Mesh> surface;
    std::vector<float> temperatures; ///< K, one a vertex of `surface` (of the model's mesh); only when asked for
    FrameReport report;
    FractureReport fracture; ///< of a body that breaks
    double milliseconds = 0; ///< of the simulation and the driver together
};

/// Parts of a moment that cost more time.
struct MomentWishes {
    bool full = false, temperatures = false;
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
    /// The air, and what warms the body, in metres, from the next frame on; the air stays through a rewind. Errors: as
    /// of Simulation's.
    Status set_air_temperature(double kelvins);
    Status set_heat_sources(std::vector<HeatSource> sources);
    /// One frame. Errors: as of Simulation::advance; a cancelled frame is not begun.
    Result<FrameReport> advance(const RunContext& context);
    /// The body as it is now; report and milliseconds are left to the caller. Parts of the driver that went nowhere
    /// sensible stay where the last look saw them. Cost: of a body that melts O(mesh + particles), else O(driver).
    Moment look(const MomentWishes& wishes);

private:
    BodyMotion(std::shared_ptr<const DroppedBody> dropped, Simulation simulation);
    std::size_t attach(std::vector<Vec3f> points, std::span<const Index> pieces);
    void look_at_melt(const MomentWishes& wishes, Moment& moment);

    std::shared_ptr<const DroppedBody> dropped_;
    Simulation simulation_;
    std::size_t driver_ = 0;
    std::optional<std::size_t> all_vertices_;
    std::string start_;
    Pose last_;
    std::vector<std::uint8_t> dead_; ///< vertices of a body that melts, so far
    std::size_t surface_frame_ = 0;  ///< of surface_
    std::shared_ptr<const Mesh> surface_;
};

} // namespace filigree
