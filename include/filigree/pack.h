// Models in few bytes: rounded (pack_model), bit for bit (pack_model_lossless), or as a stream of levels.
//
//     pack_model(model, {}, {.bits = 14}, "scan.fil");
//     pack_model_lossless(model, {}, "exact.fil");
//
// read_model (file.h) reads all of them. A packed model with PackOptions::levels is a stream: ModelStream reads it
// while it arrives and has a mesh at any time.
#pragma once

#include "filigree/strip.h"

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace filigree {

struct PackOptions {
    unsigned bits = 14; ///< of positions along the longest side of the box, 10 to 16
    /// Steps across the surface are four times as long as along its normal: smaller files, vertices slide in the
    /// surface.
    bool surface = false;
    bool keep_order = false; ///< vertices, faces and first corners keep their order
    bool levels = false;     ///< coarse to fine: every beginning of the file is a mesh
    /// The file holds how vertices are bound, as the C runtime needs it: reading binds nothing, and weights that were
    /// not found by binding stay. Without `surface`, `keep_order` and `levels`.
    bool records = false;
    /// How far restored vertices may be off through poses, fraction of the diagonal (rms); above 0.
    double clip_error = 1e-5;
    bool operator==(const PackOptions&) const = default;
};

/// What the parts of a packed model take, in bytes.
struct PackedBytes {
    std::uint64_t connectivity = 0, places = 0, attributes = 0, order = 0, driver = 0;
    std::uint64_t levels = 0, refinements = 0; ///< of a stream: its faces and positions
    std::uint64_t clips = 0;                   ///< the poses
    /// lossless: how vertices are bound to the driver; PackOptions::records: that, the mesh and the driver
    std::uint64_t records = 0;
};

/// A level of a stream.
struct PackedLevelMark {
    std::uint32_t vertices = 0;
    double error = 0;        ///< rms distance from the mesh, model units
    std::uint64_t bytes = 0; ///< from the beginning of the file to the end of the level
};

/// How a file is packed.
struct Packing {
    PackOptions options;
    double step = 0; ///< between positions along an axis, model units
    PackedBytes bytes;
    std::vector<PackedLevelMark> levels; ///< of a stream, coarse to fine
};

struct PackReport {
    double rms = 0, largest = 0; ///< distance of vertices from where they were, model units
    /// PackOptions::records: how far the points of the driver that vertices hang on moved, model units. The mesh at
    /// rest does not depend on them.
    double anchor_rms = 0, anchor_largest = 0;
    /// Vertices without a face, more than four boxes away from the others: they come back nearer.
    std::size_t out_of_reach = 0;
    /// Vertex i of the model that is read back is vertex vertex_order[i] of this one. Empty: the order is the same.
    std::vector<Index> vertex_order = {};
    PackedBytes bytes;
    /// Whether the file holds how vertices are bound: PackOptions::records, and without any of `surface`, `keep_order`
    /// and `levels` also a model whose weights are not those of binding, as those of fit_animation().
    bool has_records = false;
    bool loses_weights = false; ///< such weights are lost: the file is packed in another way
    /// The texture coordinates, colours and materials of a stream come with its last byte, as there are too many seams.
    bool lacks_level_attributes = false;
};

/// Writes a model in few bytes (docs/packing.md). Positions are rounded; vertices and faces get an order of their own
/// unless PackOptions::keep_order. The driver keeps its vertices and their order, so poses fit as before. Poses are
/// packed too, within PackOptions::clip_error (gradients 100 times that). Levels between the driver and the mesh are
/// dropped; reading binds the vertices anew. poses: may be empty. Cost O(size log size), about 0.6 processor seconds a
/// million vertices. Errors: usage (bits, clip_error), unsuitable (no vertices; a stream of a driver made elsewhere),
/// mismatch (a pose of another number of vertices), unwritable, out_of_memory, cancelled.
Result<PackReport> pack_model(const Model& model, const PoseSequence& poses, const PackOptions& options,
                              const std::filesystem::path& path, const RunContext& context = RunContext());

struct LosslessPackReport {
    PackedBytes bytes;
    std::uint64_t plain = 0; ///< bytes of the file that write_model writes
};

/// Writes a model and its poses in fewer bytes than write_model; every number comes back bit for bit, in its order.
/// Cost O(size), about 1.5 processor seconds a million vertices. Errors: mismatch (a pose of another number of
/// vertices), unwritable, out_of_memory, cancelled.
Result<LosslessPackReport> pack_model_lossless(const Model& model, const PoseSequence& poses,
                                               const std::filesystem::path& path,
                                               const RunContext& context = RunContext());

/// Reads a stream while its bytes arrive, and has the best mesh so far at any time.
class ModelStream {
public:
    /// name: for messages. most_bytes: a file that says it has more is refused.
    explicit ModelStream(std::string name, std::uint64_t most_bytes = std::uint64_t{1} << 36);
    ~ModelStream();
    ModelStream(ModelStream&&) noexcept;
    ModelStream& operator=(ModelStream&&) noexcept;

    /// Takes the next bytes of the file, as many as there are. Cost O(bytes) in all, about 0.5 processor seconds a
    /// million vertices. Errors: bad_file (damaged), unsuitable (not a stream), out_of_memory.
    Status feed(std::string_view bytes);

    /// Number of levels that are complete. Refinements come behind the last of them, as one more.
    std::size_t level_count() const;
    /// rms distance from the whole mesh, model units; infinity before the first level.
    double error() const;
    /// The finest complete level as triangles, with texture coordinates, colours and materials where it has them,
    /// without normals and pictures. Empty before the first level. Cost O(size).
    Mesh mesh() const;
    /// Where the next level ends, in bytes from the beginning of the file: what to ask a server for next. The size of
    /// the file when all levels are there; 0 before its table is.
    std::uint64_t next_level_end() const;

private:
    class Arrival;
    std::unique_ptr<Arrival> arrival_;
};

} // namespace filigree
