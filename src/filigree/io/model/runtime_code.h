// Models of the profile `runtime`: mesh and records as symbols, in the order in which the runtime reads them.
#pragma once

#include "filigree/io/model/model_code.h"

#include <string>
#include <vector>

namespace filigree {

/// A model packed for the runtime: its streams, and the rest of the mesh, which stays as it is.
struct RuntimeCode {
    std::string sizes; ///< the section "rt.par"
    std::string mesh;
    std::string attributes;              ///< the section "rt.att"
    std::vector<std::string> values;     ///< a stream an attribute
    std::vector<Vec3f> driver_positions; ///< of a driver made elsewhere; else empty
    std::vector<Index> across_gap, facing_away;
    Mesh rest;
    PackedModel poses; ///< its clips alone
    PackReport report;
    double unpacked_bytes = 0; ///< that readers need
};

/// Errors: as pack_model.
Result<RuntimeCode> code_for_runtime(const Model& model, const PoseSequence& poses, const PackOptions& options,
                                     const RunContext& context);
void write_runtime_code(SectionWriter& out, const RuntimeCode& coded);

/// Whether vertices hang elsewhere than at the closest point of their cell, as weights that were fitted do. Reading
/// another packed file would bind them anew. Cost O(V).
bool has_free_weights(const Model& model);

/// What a file of the profile takes.
Packing runtime_coding_of(const SectionReader& in);

} // namespace filigree
