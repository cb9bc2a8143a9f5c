// Models in files: .fil, described byte for byte in docs/fil-format.md.
#pragma once

#include "filigree/pack.h"

#include "filigree/context.h"
#include "filigree/io/system/file.h"
#include "filigree/pack/mesh_code.h"
#include "filigree/result.h"
#include "filigree/strip.h"

#include <filesystem>
#include <string>

namespace filigree {

/// Whether a file's first bytes are those of a model.
bool is_model_file(const FileReader& file);

/// Reads a model from a file that is open. name: for messages. Errors: those of read_model in file.h.
Result<Model> read_model(const FileReader& file, const std::string& name, const RunContext& context);

/// What a model file says of its model.
struct ModelOutline {
    std::vector<LevelCounts> levels;            ///< coarse to fine, with the finest
    bool driver_is_behind = false;              ///< see Model; of a coded file false
    std::vector<Index> across_gap, facing_away; ///< as in BlendDetail
    unsigned references = 0;                    ///< 3, 4 or 6: a file of the reference code (io/model/reference_file.h)
    std::size_t patches = 0;                    ///< of the reference code
    std::size_t frames = 0;                     ///< poses
    double frames_per_second = 0;
    bool has_gradients = false;               ///< in the poses
    std::optional<Packing> coding = {};       ///< of a coded file
    std::optional<PackedBytes> lossless = {}; ///< of one whose sections are coded bit for bit
    std::uint64_t bytes = 0;                  ///< of the file
};
/// Reads the outline alone: as fast for a large model as for a small one. read_model finds out whether all sections fit
/// together. Errors: those of read_model.
Result<ModelOutline> read_model_outline(const FileReader& file, const std::string& name, const RunContext& context);
/// Reads the part of the file that a level needs. The same mesh as level_mesh. Positions and attributes are read in
/// part, so their checksums are not compared. Errors: those of read_model, usage (no such level).
Result<Mesh> read_model_level(const FileReader& file, unsigned level, const std::string& name,
                              const RunContext& context);

/// Reads the poses of a file that is open.
Result<PoseSequence> read_poses(const FileReader& file, const std::string& name, const RunContext& context);

} // namespace filigree
