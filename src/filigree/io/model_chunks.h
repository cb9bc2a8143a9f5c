// A model that stays in its file, for meshes that are larger than memory: restored chunk by chunk.
#pragma once

#include "filigree/hierarchy/blend_code.h"
#include "filigree/io/file.h"
#include "filigree/io/point_cache.h"
#include "filigree/restore.h"

namespace filigree {

/// The driver of a model with the blend code, and its vertices in chunks that are read when they are asked for.
class ModelChunks {
public:
    /// The file is kept open. Errors: as read_model; unsuitable (a packed file or the reference code: those have no
    /// chunks).
    static Result<ModelChunks> open(FileReader file, const std::string& name, const RunContext& context);
    ModelChunks(ModelChunks&&) noexcept;
    ModelChunks& operator=(ModelChunks&&) noexcept;
    ~ModelChunks();

    /// The driver alone, as a model whose mesh is the driver's: for poses and their gradients.
    const Model& driver() const;
    std::size_t vertex_count() const;
    std::size_t count() const;
    /// The first vertex of chunk k, 0 <= k <= count(); of the last, vertex_count().
    std::size_t first_vertex(std::size_t k) const;
    /// Around the vertices of chunk k at rest, relative to the origin.
    Box box(std::size_t k) const;
    /// Restores the vertices of chunk k: item i is vertex first_vertex(k) + i. Errors: as read_model.
    Result<BlendRestorer> restorer(std::size_t k, const RunContext& context) const;

private:
    struct Content;
    explicit ModelChunks(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

/// Restores poses into a .pc2 without ever having the mesh in memory: the same bytes as write_animation. options: their
/// level is the finest. Memory: a chunk, the driver, and the driver's gradients in as many frames as 256 MB hold.
/// Errors: as write_animation and ModelChunks; mismatch (a pose of another driver); usage (a level).
Result<std::vector<std::string>> write_restored_chunks(const ModelChunks& model, const FrameSource<Pose>& poses,
                                                       const RestoreOptions& options, const std::filesystem::path& path,
                                                       const RunContext& context);

/// One part of the frames, as write_animation_chunk.
Result<ChunkReport> write_restored_chunks(const ModelChunks& model, const FrameSource<Pose>& poses,
                                          const RestoreOptions& options, const std::filesystem::path& path,
                                          const WorkChunk& chunk, const RunContext& context);

} // namespace filigree
