// What DrawData and Drawable hold, for the renderer. Only for this layer's own sources.
#pragma once

#include "filigree/blend/blend_code.h"
#include "filigree/render/draw_arrays.h"
#include "filigree/render/gl_objects.h"
#include "filigree/render/gpu_restore.h"
#include "filigree/render/pose_box.h"

namespace filigree {

/// Vertex inputs of the shaders; 4 and 5 belong to GpuRestorer.
namespace vertex_input {
inline constexpr GLuint kPosition = 0, kNormal = 1, kUv = 2, kColor = 3, kScalar = 6;
}

using ColorBytes = std::array<std::uint8_t, 4>;

/// What moves a model's vertices, from pose to pose.
struct ModelMotion {
    const Model* model = nullptr;
    std::optional<Restorer> restorer; ///< of the driver, for its gradients

    // Restored by the vertex shader.
    std::optional<GpuRestorer> on_gpu;
    std::optional<PoseBox> pose_box;

    // Restored by the processor, in the order of drawing.
    std::optional<BlendRestorer> on_cpu;
    std::vector<Vec3f> positions, normals; ///< kept from pose to pose, as making arrays takes time
    bool turns_out = false;                ///< as turns_out said of the gradients
};

/// Whether a pose with these gradients turns the inside out somewhere.
bool turns_out(std::span<const Mat3f> gradients);

/// Scalars of the mesh's vertices as draw vertices have them: the place in their range, and far below for none.
std::vector<float> scalar_places(const ScalarColors& scalars, std::span<const Index> vertex, const RunContext& context);

std::vector<ColorBytes> color_bytes(std::span<const Vec4f> colors, std::span<const Index> vertex,
                                    const RunContext& context);

/// The processor's half of Drawable::set_pose, where the vertex shader does not restore: a pose of `count` draw
/// vertices into motion.positions and motion.normals. Errors as there.
Status move_vertices(ModelMotion& motion, const Pose& pose, std::size_t count, const RunContext& context);
/// From there to where OpenGL reads them, normals octahedral. The box is relative to the mesh's origin.
Box write_moved(const ModelMotion& motion, std::span<Vec3f> positions, std::span<std::uint32_t> normals,
                const RunContext& context);

struct DrawData::Content {
    struct Part {
        Index first = 0, count = 0; ///< triangles
        Vec3f color = {1, 1, 1};
        bool has_color = false;
        std::optional<Picture> picture; ///< rows from the bottom, as UVs count
    };

    // One a draw vertex, in the order of the vertex buffer; empty: none, and positions where the shader restores them.
    std::vector<Vec3f> positions;
    std::vector<std::uint32_t> normals; ///< octahedral
    std::vector<Vec2f> uvs;
    std::vector<ColorBytes> colors;
    std::vector<float> scalars;
    std::vector<Index> vertex; ///< of the mesh or level

    std::vector<Triangle> triangles;
    std::vector<Triangle> shadow_triangles; ///< fewer, for shadow maps; empty: the same
    std::vector<std::uint8_t> edges;
    std::vector<Part> parts;
    ColorMap map = ColorMap::sequential;
    std::size_t mesh_vertex_count = 0;
    bool is_solid = false; ///< solid.h
    Vec3d origin = Vec3d::Zero();
    Box box;
    ModelMotion motion;
};

struct Drawable::Content {
    struct Part {
        Index first = 0, count = 0; ///< triangles
        Vec3f color = {1, 1, 1};
        bool has_color = false;
        gl::Texture picture;
    };

    gl::VertexArray arrays;
    gl::Buffer positions, normals, uvs, colors, scalars, triangles, shadow_triangles, edge_flags;
    gl::Texture edge_texture, scalar_colors;
    std::vector<Part> parts;
    bool has_colors = false, has_scalars = false, has_uvs = false;

    Vec3d origin = Vec3d::Zero();
    Box box;
    std::size_t triangle_count = 0, shadow_triangle_count = 0;
    bool is_solid = false;      ///< at rest
    bool is_turned_out = false; ///< by the present pose: somewhere its inside may be outside
    std::vector<Index> vertex;  ///< of the mesh or level, of each draw vertex
    std::size_t mesh_vertex_count = 0;
    ModelMotion motion;

    // points
    std::size_t point_count = 0;
    float radius = 0; ///< model units

    const GpuRestorer* restorer() const { return motion.on_gpu ? &*motion.on_gpu : nullptr; }
    Status upload_arrays(const DrawData::Content& data);
    Status upload_parts(std::vector<DrawData::Content::Part> data_parts);
    Status upload_scalars(std::span<const float> places, ColorMap map, GLuint divisor);
};

} // namespace filigree
