// Everything that moves in a simulation, as one struct and as bytes. Private to the layer.
#pragma once

#include "filigree/physics/breaking/cracks.h"
#include "filigree/physics/contact/contact.h"
#include "filigree/physics/rigid/rigid_pairs.h"
#include "filigree/physics/step/made_for.h"
#include "filigree/physics/step/set_motion.h"
#include "filigree/physics/step/targets.h"
#include "filigree/result.h"

#include <string>
#include <string_view>

namespace filigree {

struct SavedBody {
    Vectors positions, velocities;
    std::string elasticity; ///< Elasticity::state
    float rubbed_seconds = 0;
    BodyHit hit;
    std::optional<RigidPose> rigid;
};

struct SavedState {
    MadeFor made_for;
    std::uint64_t frame = 0;
    std::vector<SetMotion> set_motions; ///< of obstacles that were set
    std::vector<SavedBody> bodies;
    Contacts::Memory contacts;
    RigidPairs::Memory rigid_pairs;
    std::string grid;                   ///< mpm::Bodies::state
    std::vector<TargetsMemory> targets; ///< of bodies that follow
    std::vector<CrackMemory> cracks;    ///< of bodies that break
};

/// Values and arrays end to end after the version's name; no padding, so that equal states are equal bytes.
std::string write_saved_state(const SavedState& state);
/// Errors: bad_file (damaged, or of another version).
Result<SavedState> read_saved_state(std::string_view bytes);

} // namespace filigree
