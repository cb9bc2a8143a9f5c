// What can be drawn: surfaces, models and points in GPU memory.
#pragma once

#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/pose.h"
#include "filigree/hierarchy/restore.h"
#include "filigree/render/color_map.h"
#include "filigree/render/picture.h"

#include <memory>
#include <optional>

namespace filigree {

/// Where normals come from. automatic: the mesh's own; without any, smooth within `crease_deg` and sharp beyond.
enum class Shading { automatic, smooth, flat };

/// One number a vertex, shown as colour.
struct ScalarColors {
    std::span<const float> values = {}; ///< empty: not shown; else one a vertex
    ColorMap map = ColorMap::sequential;
    ValueRange range = {};
};

/// A colour and a texture for the faces of one material.
struct SurfaceMaterial {
    Vec3f color = {1, 1, 1};          ///< sRGB, multiplies the picture
    const Picture* picture = nullptr; ///< drawn by the mesh's UVs; null: none
};

struct SurfaceOptions {
    Shading shading = Shading::automatic;
    double crease_deg = 45; ///< faces that meet at a larger angle keep a sharp edge (automatic shading)
    ScalarColors scalars = {};
    std::vector<SurfaceMaterial> materials = {}; ///< empty or one a name in mesh.materials
    std::vector<char> hidden_faces = {};         ///< empty or one a face: not zero leaves it out
};

struct PointOptions {
    float radius = 0; ///< model units; 0: 0.48 of the typical distance to the sixth neighbour
    ScalarColors scalars = {};
    std::span<const Vec4f> colors = {}; ///< empty or RGBA a point
};

/// Where a model's vertices are restored. gpu: in the vertex shader, nothing but the driver's pose is uploaded. cpu:
/// positions and normals are uploaded with each pose; for software renderers, which would restore again in each pass.
enum class RestoreOn { gpu, cpu };

/// The processor's half of a drawable: all that needs no OpenGL, and so can be made in any thread while a window goes
/// on drawing. Errors of both: unsuitable (nothing to draw), usage (no such level; check_mesh refuses the mesh),
/// cancelled.
class DrawData {
public:
    static Result<DrawData> surface(const Mesh& mesh, const SurfaceOptions& options, const RunContext& context);
    /// As Drawable::model. The model must outlive the data and the drawable; so must what the options point to.
    static Result<DrawData> model(const Model& model, const RestoreOptions& restore, const SurfaceOptions& options,
                                  RestoreOn where, const RunContext& context);
    DrawData(DrawData&&) noexcept;
    DrawData& operator=(DrawData&&) noexcept;
    ~DrawData();

    struct Content;

private:
    friend class Drawable;
    explicit DrawData(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

/// Something in GPU memory. Made and drawn with one OpenGL context current.
class Drawable {
public:
    /// The graphics card's half: copies what was prepared. Errors: out_of_memory (graphics memory), unsupported.
    static Result<Drawable> upload(DrawData data);

    /// Errors of all three: out_of_memory (graphics memory), unsuitable (nothing to draw), usage (check_mesh refuses
    /// the mesh), cancelled.
    static Result<Drawable> surface(const Mesh& mesh, const SurfaceOptions& options, const RunContext& context);
    static Result<Drawable> points(std::span<const Vec3f> positions, const Vec3d& origin, const PointOptions& options,
                                   const RunContext& context);
    /// A model at a level, restored by the vertex shader. Normals belong to the rest shape and turn with the gradients.
    /// Starts unposed. The model must outlive the drawable, and so must what the options point to.
    static Result<Drawable> model(const Model& model, const RestoreOptions& restore, const SurfaceOptions& options,
                                  const RunContext& context);
    Drawable(Drawable&&) noexcept;
    Drawable& operator=(Drawable&&) noexcept;
    ~Drawable();

    /// Models only. Errors: mismatch (the pose has another number of vertices than the driver).
    Status set_pose(const Pose& pose, const RunContext& context);
    /// Models and surfaces: other colours by numbers, one a vertex of the level (of the mesh); none: no such colours.
    /// Errors: mismatch (another number of values), out_of_memory.
    Status set_scalars(const ScalarColors& scalars);
    /// Points: moved, as many as before. Errors: mismatch.
    Status set_positions(std::span<const Vec3f> positions);

    const Box& box() const; ///< of what is drawn, in the world; for a posed model not smaller than it
    std::size_t triangle_count() const;
    std::size_t point_count() const;
    float point_radius() const; ///< of the balls, model units; 0 for surfaces

    struct Content;
    const Content& content() const { return *content_; }

private:
    explicit Drawable(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
