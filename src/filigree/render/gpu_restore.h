// Restoring on the GPU: the records are uploaded once, a frame uploads the driver's pose, the vertex shader does the
// rest.
#pragma once

#include "filigree/restore.h"
#include "filigree/strip.h"

#include <memory>

namespace filigree {

/// Vertices of a blend model in GPU memory. Everything here needs the OpenGL context it was made in to be current.
class GpuRestorer {
public:
    /// What to restore: for each item a vertex of the finest mesh and its unit rest normal (`normals` empty: none; a
    /// zero normal stays zero). Several items may share a vertex (with different normals). The model must outlive the
    /// restorer. Starts at rest. Of the options a level is only checked: the items say what is restored.
    /// A record has 24 bytes an item, and 4 for its normal.
    /// Errors: usage (no such level), mismatch (no such vertex, or another number of normals), unsupported (no storage
    /// buffers in vertex shaders), out_of_memory, cancelled.
    static Result<GpuRestorer> create(const Model& model, std::span<const Index> vertices,
                                      std::span<const Vec3f> normals, const RestoreOptions& options,
                                      const RunContext& context);
    /// create in two halves. prepare needs no OpenGL, so any thread will do, and does not say unsupported or
    /// out_of_memory; of what it gives only drawn_at, item_count, has_normals and upload may be asked.
    static Result<GpuRestorer> prepare(const Model& model, std::span<const Index> vertices,
                                       std::span<const Vec3f> normals, const RestoreOptions& options,
                                       const RunContext& context);
    Status upload();
    GpuRestorer(GpuRestorer&&) noexcept;
    GpuRestorer& operator=(GpuRestorer&&) noexcept;
    ~GpuRestorer();

    /// Uploads a pose: 64 bytes a driver vertex, nothing else. Errors: mismatch (as Restorer::positions), cancelled.
    Status set_pose(const Pose& pose, const RunContext& context);

    std::size_t item_count() const;
    /// The place of each item in the order they are drawn in (records are sorted by driver triangle): what an index
    /// buffer has to go through.
    std::span<const Index> drawn_at() const;

    /// GLSL to go into a vertex shader after its #version line (430 or later):
    ///     vec3 restored_position();                            model units, as the mesh's positions
    ///     vec3 restored_normal();                              unit; only with has_normals()
    ///     void restore_vertex(out vec3 position, out vec3 normal);   both for little more than the price of one
    /// It takes the vertex inputs 4 and 5, the storage bindings 0 to 2, and names that begin with restore. gl_VertexID
    /// has to be the place of the item: do not draw with another base vertex.
    static std::string shader_source();
    bool has_normals() const;
    /// Binds what shader_source reads: vertex inputs 4 and 5 into the current vertex array, and the storage buffers.
    void bind() const;

    /// What the vertex shader computes, read back through transform feedback, by item; normals empty where there are
    /// none. For tests and exact checks: drawing never reads back. Leaves no program and no vertex array bound.
    /// Errors: out_of_memory.
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
