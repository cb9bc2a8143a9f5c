// Patches of regular quads as colours: which face belongs to which patch, and the finest level drawn that way.
#pragma once

#include "filigree/hierarchy/model.h"
#include "filigree/render/drawable.h"

#include <cstdint>
#include <memory>

namespace filigree::studio {

/// A label a face, its patch's, as few as tell neighbours apart where eight can; their names are empty.
/// most_levels, errors: as of find_regular_patches.
Result<FaceLabels> patch_labels(const Mesh& mesh, unsigned most_levels, const RunContext& context);

/// The processor's half of a surface whose patches have colours.
struct PatchData {
    std::shared_ptr<const Model> model; ///< as drawn: what is in graphics memory refers to it
    DrawData data;

    /// The finest level of `model`. Errors: as of patch_labels and DrawData::model.
    static Result<PatchData> make(const Model& model, RestoreOptions restore, unsigned most_levels, RestoreOn where,
                                  const RunContext& context);
};

/// The same in graphics memory.
struct PatchSurface {
    std::shared_ptr<const Model> model;
    Drawable drawable;
    std::uint64_t pose = 0; ///< which pose it has; 0: at rest
};

} // namespace filigree::studio
