// Scenes to pictures. Light is accumulated [Haeberli and Akeley 1990]: each pass moves the camera by a part of a pixel
// and lights the scene from one direction, with a shadow map. The average is an antialiased picture with soft shadows
// and ambient occlusion. A window shows the sum so far; a file takes all passes.
#pragma once

#include "filigree/render/camera.h"
#include "filigree/render/drawable.h"
#include "filigree/render/picture.h"

#include <memory>
#include <optional>
#include <vector>

namespace filigree {

/// What lies on the positive side of the plane is cut away: normal . p > offset (world).
struct ClipPlane {
    Vec3d normal = {0, 0, 1};
    double offset = 0;
};

/// How one object looks.
struct Appearance {
    Vec3f color = {0.78f, 0.76f, 0.72f}; ///< sRGB; where the drawable has no colours of its own
    bool own_colors = true;              ///< vertex colours, scalars and materials, where there are any
    bool surface = true;                 ///< false: edges alone
    bool edges = false;                  ///< the polygons' own edges (no diagonals), over the surface
    Vec3f edge_color = {0.08f, 0.09f, 0.11f};
    float edge_width = 1.2f; ///< pixels
    float gloss = 0.35f;     ///< 0 chalk .. 1 porcelain
    std::optional<ClipPlane> clip = {};
    /// 0 .. 1: the part of its pixels that is drawn, chosen by a pattern that changes from pass to pass. An object with
    /// f and another with -f (the complement) in the same place melt into each other: a change of level without a pop.
    float coverage = 1;
};

struct SceneObject {
    const Drawable* drawable = nullptr;
    Appearance appearance = {};
};

struct Background {
    Vec3f top = {0.96f, 0.965f, 0.97f}, bottom = {0.80f, 0.82f, 0.845f}; ///< sRGB
    bool transparent = false; ///< alpha 0 where nothing is; the ground's shadow keeps its darkness as alpha
};

struct Scene {
    std::vector<SceneObject> objects;
    Background background = {};
    UpAxis up = UpAxis::y;
    bool ground = true;      ///< catches the shadow, at the lowest point of all
    double ground_level = 0; ///< world, along `up`; only with fixed_ground
    bool fixed_ground = false;

    Box box() const; ///< of all objects
};

struct PictureOptions {
    unsigned width = 1280, height = 960;
    unsigned passes = 0; ///< 0: by the scene's size, from 40 (a quarter million triangles) down to 12 (3 M)
};

/// Draws scenes. Needs an OpenGL 4.3 core context to be current, the one its drawables were made in.
class Renderer {
public:
    /// Errors: unsupported (the context is too old).
    static Result<Renderer> create();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;
    ~Renderer();

    /// A picture of the scene. The same scene gives the same bytes on one machine.
    /// Errors: unsuitable (larger than the driver's limit, which is said), out_of_memory, cancelled.
    Result<Picture> picture(const Scene& scene, const Camera& camera, const PictureOptions& options,
                            const RunContext& context);

    /// For windows: starts over, with passes to come of `passes` in all; add_pass draws the next (false: all done);
    /// show puts the sum so far into `framebuffer` (an OpenGL name; 0 is the window) of that size. The scene's
    /// drawables must outlive the last add_pass. Errors of begin as of picture.
    Status begin(const Scene& scene, const Camera& camera, unsigned width, unsigned height, unsigned passes);
    bool add_pass();
    /// x, y: where the picture's lower left corner goes, pixels; what lies around it stays.
    void show(unsigned framebuffer, int x = 0, int y = 0) const;
    /// One pass that stands for all, for what moves: no shadow maps, the sky's light by the normal alone, a soft
    /// contact shadow on the ground left out. As bright as the whole picture. Errors as of begin. show() then shows it.
    Status preview(const Scene& scene, const Camera& camera, unsigned width, unsigned height);

private:
    struct Content;
    explicit Renderer(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
