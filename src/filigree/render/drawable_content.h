// What a Drawable holds, for the renderer. Only for this layer's own sources.
#pragma once

#include "filigree/render/draw_arrays.h"
#include "filigree/render/gl_objects.h"
#include "filigree/render/gpu_restore.h"
#include "filigree/render/pose_box.h"

namespace filigree {

/// Vertex inputs of the shaders; 4 and 5 belong to GpuRestorer.
namespace vertex_input {
inline constexpr GLuint kPosition = 0, kNormal = 1, kUv = 2, kColor = 3, kScalar = 6;
}

struct Drawable::Content {
    struct Part {
        Index first = 0, count = 0; ///< triangles
        Vec3f color = {1, 1, 1};
        bool has_color = false;
        gl::Texture picture;
    };

    gl::VertexArray arrays;
    gl::Buffer positions, normals, uvs, colors, scalars, triangles, edge_flags;
    gl::Texture edge_texture, scalar_colors;
    std::vector<Part> parts;
    bool has_colors = false, has_scalars = false, has_uvs = false;

    Vec3d origin = Vec3d::Zero();
    Box box;
    std::size_t triangle_count = 0;

    // points
    std::size_t point_count = 0;
    float radius = 0; ///< model units

    // models
    const Model* model = nullptr;
    RestoreOptions restore;
    SurfaceOptions options;            ///< for reference models, which are uploaded anew for each pose
    std::optional<Restorer> restorer;  ///< reference models: the level; blend models: the driver, for its gradients
    std::optional<GpuRestorer> on_gpu; ///< blend models
    std::optional<PoseBox> pose_box;

    Status upload_surface(const Mesh& mesh, std::span<const Vec3f> mesh_positions, const SurfaceOptions& surface,
                          const DrawArrays& draw, std::span<const Index> drawn_at);
};

} // namespace filigree
