// The report's method on a mesh of regular quads: strip it level by level, restore it from a moved driver.
#pragma once

#include "filigree/hierarchy/model.h"
#include "filigree/reference/reference_code.h"

namespace filigree {

/// A mesh stripped by the reference code.
struct ReferenceModel {
    Mesh mesh;                 ///< the finest level, as it came in
    std::vector<Level> levels; ///< coarse to fine, without the finest; levels[0] is the driver
    ReferenceDetail detail;

    /// The number of the finest level; levels 0 .. finest_level() exist.
    unsigned finest_level() const { return static_cast<unsigned>(levels.size()); }
    const Level& driver() const { return levels.front(); }
};

/// Takes the detail off a mesh. It must consist of quads with subdivision connectivity (mesh/regular_patches.h).
/// Errors: as encode_reference: usage (options; check_mesh refuses the mesh), unsuitable (no subdivision connectivity),
/// cancelled. Cost O(V). Same bytes for any number of threads.
Result<ReferenceModel> strip_to_reference(Mesh mesh, const ReferenceOptions& options, const RunContext& context);

struct ReferenceRestoreOptions {
    HeightLaw law = HeightLaw::inverse;
    std::optional<unsigned> level = {}; ///< restore up to this level; unset: the finest
};

/// The mesh of a level, restored from its driver's positions (in the order of driver().vertices, relative to the mesh's
/// origin). Attributes come as they came in; normals are computed anew where the mesh had some. Cost O(V): for pose
/// after pose prepare a ReferenceRestorer.
/// Errors: usage (no such level), mismatch (another number of positions than driver vertices), cancelled.
Result<Mesh> restore_reference(const ReferenceModel& model, std::span<const Vec3f> driver,
                               const ReferenceRestoreOptions& options, const RunContext& context);

/// Level k as a mesh of its own at rest, 0 <= k <= finest_level(). Cost O(size of the mesh).
Mesh level_mesh(const ReferenceModel& model, unsigned level);
/// The driver's rest positions, in the driver's order.
std::vector<Vec3f> driver_positions(const ReferenceModel& model);

/// The first thing wrong with a model, as a sentence, or "" when it can be restored. Cost O(size).
std::string check_model(const ReferenceModel& model);

} // namespace filigree
