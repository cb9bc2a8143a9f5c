// A simulation at its start as bytes: bodies with their particles and distance fields, how they break, obstacles, and
// the points that go along. Whoever reads them needs no mesh, no lattice and no search: a web page, where the library
// is compiled without them (web/live).
#pragma once

#include "filigree/physics/simulation.h"

#include <string>
#include <string_view>
#include <vector>

namespace filigree {

/// Points that go along with a body: Simulation::attach.
struct AttachedPoints {
    std::size_t body = 0;
    std::vector<Vec3f> points; ///< m, on the body at rest
    std::vector<Index> pieces; ///< of a body that breaks, one a point; else empty
};

struct LiveWorld {
    World world;
    std::vector<Actor> actors;
    StepOptions options;
    std::vector<AttachedPoints> attached;
};

/// Where a body breaks, the function of its Partition is left out: whoever reads the bytes gets one that gives a point
/// to the piece whose surface is nearest. Errors: unsuitable (a body of mpm). Cost O(bytes).
Result<std::string> write_live_world(const LiveWorld& live);
/// Shared bodies are shared again. Errors: bad_file (damaged, or of another version).
Result<LiveWorld> read_live_world(std::string_view bytes);

} // namespace filigree
