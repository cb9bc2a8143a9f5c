// What hits an obstacle faster than its own waves run is crushed flat, and its inside would go on through the surface
// that was stopped: the particles themselves are held then. Private to the layer.
#pragma once

#include "filigree/physics/contact/contact_pair.h"
#include "filigree/physics/contact/obstacle_motion.h"
#include "filigree/physics/contact/obstacle_trace.h"

#include <map>
#include <memory>

namespace filigree {

class CrushedParticles {
public:
    static constexpr float kCrushing = 0.5f; ///< spacings: what touches deeper may be crushed inside

    /// Moves particles of pair's body out of the obstacle that are deeper in it than at rest below the surface.
    /// outwards: of the obstacle's surface where the body is in it; particles that are past its middle stay.
    void push_out(BodyState& body, const ContactPair& pair, const ObstacleShape& shape, const Vec3f& outwards,
                  const ObstaclePoses& poses, const RunContext& context);
    void forget(const std::shared_ptr<const Body>& body) { depths_.erase(body); } ///< there is none of it any more

private:
    struct Depths {                      ///< of each particle
        std::vector<float> most;         ///< m that it may go into an obstacle
        std::vector<Index> near_surface; ///< the surface point that is about the closest at rest
    };
    std::map<std::shared_ptr<const Body>, Depths> depths_;
};

} // namespace filigree
