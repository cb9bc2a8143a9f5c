// Models in files: .fil, described byte for byte in docs/fil-format.md.
#pragma once

#include "filigree/coding/mesh_code.h"
#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/pose.h"
#include "filigree/io/file.h"

#include <filesystem>
#include <string>

namespace filigree {

/// Whether a file's first bytes are those of a model.
bool is_model_file(std::string_view bytes);
bool is_model_file(const FileReader& file);

/// Reads a model; "-" is standard input. Nothing in the file is trusted: sizes are held against the file's length
/// before anything is allocated (packed parts may come to 1,024 times its bytes, or 256 MiB), every section has a
/// checksum, and what comes back passes check_model. Errors: not_found, bad_file (truncated, damaged, of another
/// version, not a model), unsuitable (the reference code, see io/reference_file.h), out_of_memory, cancelled.
Result<Model> read_model(const std::filesystem::path& path, const RunContext& context);
/// The same from a file that is open, or from bytes in memory; `name` stands in messages.
Result<Model> read_model(const FileReader& file, const std::string& name, const RunContext& context);
Result<Model> read_model(std::string_view bytes, const std::string& name, const RunContext& context);

/// What a coded model takes, in bytes.
struct CodedBytes {
    std::uint64_t connectivity = 0, places = 0, attributes = 0, order = 0, driver = 0;
    std::uint64_t levels = 0, refinements = 0; ///< of a stream, whose map and places these are
    std::uint64_t clips = 0;                   ///< the poses
    std::uint64_t records = 0;                 ///< of a lossless file: how vertices hang on the driver
};
/// What has arrived at a byte of a stream.
struct CodedLevelMark {
    std::uint32_t vertices = 0;
    double error = 0;        ///< rms distance from the mesh's surface, model units
    std::uint64_t bytes = 0; ///< of the file, from its beginning
};
struct Coding {
    MeshCodeOptions options;
    double step = 0; ///< between places along an axis, model units
    CodedBytes bytes;
    std::vector<CodedLevelMark> levels; ///< of a stream, coarse to fine
};

/// What a model file says of its model.
struct ModelOutline {
    std::vector<LevelCounts> levels; ///< coarse to fine, with the finest
    bool driver_is_behind = false;   ///< see Model; of a coded file false
    Precision precision = Precision::float32;
    std::vector<Index> across_gap, facing_away; ///< as in BlendDetail
    unsigned references = 0;                    ///< 3, 4 or 6: a file of the reference code (io/reference_file.h)
    std::size_t patches = 0;                    ///< of the reference code
    std::size_t frames = 0;                     ///< poses
    double frames_per_second = 0;
    bool has_gradients = false;              ///< in the poses
    std::optional<Coding> coding = {};       ///< of a coded file
    std::optional<CodedBytes> lossless = {}; ///< of one whose sections are coded bit for bit
    std::uint64_t bytes = 0;                 ///< of the file
};
/// Reads that alone: as quick for a large model as for a small one. Whether all sections fit together is known when
/// the model is read. Errors: as read_model.
Result<ModelOutline> read_model_outline(const FileReader& file, const std::string& name, const RunContext& context);
/// Reads a level's own part of the file (int16 records: all of it, for they hold the positions). The same mesh as
/// level_mesh. Of positions and attributes, which are read in part, no checksum is held. Errors: as read_model, usage
/// (no such level).
Result<Mesh> read_model_level(const FileReader& file, unsigned level, const std::string& name,
                              const RunContext& context);

/// The poses that a model file holds beside its model; no frames where there are none. Errors: as read_model (a frame
/// missing or of another number of vertices than the driver, numbers that are not finite).
Result<PoseSequence> read_poses(const std::filesystem::path& path, const RunContext& context);
Result<PoseSequence> read_poses(const FileReader& file, const std::string& name, const RunContext& context);
Result<PoseSequence> read_poses(std::string_view bytes, const std::string& name, const RunContext& context);

/// Writes a model through a temporary file and a rename; "-" is standard output. Errors: unwritable,
/// out_of_memory, cancelled.
Status write_model(const Model& model, const std::filesystem::path& path, const RunContext& context);
/// The bytes of the file. The same model gives the same bytes.
std::string write_model(const Model& model);

/// The same with poses of its driver. Errors: mismatch as well (a pose of another number of vertices, gradients in some
/// frames alone, numbers or a rate that are not finite and the rate above 0), which is found before anything is
/// written. No frames: the file of the model alone.
Status write_model(const Model& model, const PoseSequence& poses, const std::filesystem::path& path,
                   const RunContext& context);
std::string write_model(const Model& model, const PoseSequence& poses);

/// How a coded model came out. Distances in model units.
struct CodingReport {
    double rms = 0, largest = 0;  ///< of the vertices
    std::size_t out_of_reach = 0; ///< as MeshCodeReport::out_of_reach
    CodedBytes bytes;
    /// A stream's texture coordinates, colours and materials come with its last byte: seams are too dense for levels.
    bool lacks_level_attributes = false;
};
/// Writes a model in few bits (docs/coding.md): its mesh rounded and in an order of the code's own, its driver with the
/// same vertices in the same order, so that poses fit as before. Poses are coded too: 1e-5 of the diagonal off (rms),
/// gradients a thousandth. Levels between are dropped; vertices are bound to the
/// driver anew when the file is read. Errors: as write_model, and as encode_mesh; unsuitable (streams of a driver made
/// elsewhere).
Result<CodingReport> write_coded_model(const Model& model, const PoseSequence& poses, const MeshCodeOptions& options,
                                       const std::filesystem::path& path, const RunContext& context);
struct LosslessReport {
    CodedBytes bytes;
    std::uint64_t plain = 0; ///< bytes of the plain file
};
/// Writes any model and its poses in fewer bytes, and every number comes back bit for bit, in its order: the file that
/// is read is the one that write_model would have written. Cost O(size), about 1.5 processor seconds a million
/// vertices; reading asks for no more sections than a plain file's reader does. Errors: as write_model, cancelled.
Result<LosslessReport> write_lossless_model(const Model& model, const PoseSequence& poses,
                                            const std::filesystem::path& path, const RunContext& context);

} // namespace filigree
