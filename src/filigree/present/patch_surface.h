// The finest level of a model, its patches of regular quads in colours.
#pragma once

#include "filigree/render.h"
#include "filigree/strip.h"

#include <cstdint>
#include <memory>

namespace filigree {

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

} // namespace filigree
