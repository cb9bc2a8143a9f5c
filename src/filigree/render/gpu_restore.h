// Restoring on the GPU: the records are uploaded once, a frame uploads the driver's pose, the vertex shader does the rest.
#pragma once

#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/restore.h"

#include <memory>

namespace filigree {

/// A blend model at one level in GPU memory. Everything here needs the OpenGL context it was made in to be current.
class GpuRestorer {
public:
    /// What to restore: for each item a vertex of the finest mesh and its unit rest normal (`normals` empty: none).
    /// Several items may share a vertex (with different normals). The model must outlive the restorer.
    /// Records are float or int16 as the model's are: 20 or 12 bytes an item, and 4 for its normal.
    /// Errors: usage (no such level), unsuitable (a reference model: restore it on the CPU),
    /// out_of_memory (more than the GPU takes in one buffer).
    static Result<GpuRestorer> create(const Model& model, std::span<const Index> vertices,
                                      std::span<const Vec3f> normals, const RestoreOptions& options,
                                      const RunContext& context);
    GpuRestorer(GpuRestorer&&) noexcept;
    GpuRestorer& operator=(GpuRestorer&&) noexcept;
    ~GpuRestorer();

    /// Uploads a pose: 64 bytes a driver vertex, nothing else. Errors: mismatch (as Restorer::positions).
    Status set_pose(const Pose& pose, const RunContext& context);

    std::size_t item_count() const;
    /// The place of each item in the order they are drawn in (records are sorted by driver triangle): what an index
    /// buffer has to go through.
    std::span<const Index> drawn_at() const;
    /// GLSL functions `vec3 restored_position(int record)` and `vec3 restored_normal(int record)`, and the buffers they
    /// read (storage bindings 0 to 2), to go into a vertex shader after its #version line.
    static const char* shader_source(Precision precision);
    Precision precision() const;
    bool has_normals() const;
    /// Binds the buffers that shader_source reads.
    void bind() const;

    /// What the vertex shader computes, read back through transform feedback, by item; normals empty where there are
    /// none. For tests and exact checks: drawing never reads back.
    struct ReadBack {
        std::vector<Vec3f> positions, normals;
    };
    Result<ReadBack> read_back() const;

    /// Bytes of GPU memory: records, cells, transforms.
    std::size_t bytes() const;

private:
    struct Content;
    explicit GpuRestorer(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
