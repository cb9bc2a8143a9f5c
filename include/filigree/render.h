// Pictures and films of meshes and models, with OpenGL 4.3, with or without a window. Link filigree::render.
//
//     const HeadlessContext gl = HeadlessContext::create().value();
//     const Drawable mesh = Drawable::surface(bent, {}).value();
//     const Picture picture = Renderer::create()->picture({{{&mesh}}}, camera, {}).value();
//     write_file("bent.png", encode_png(picture));
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/core/types.h"
#include "filigree/core/view.h"
#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/pose.h"
#include "filigree/hierarchy/restore.h"
#include "filigree/mesh/mesh.h"

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Pictures: pixels, and the PNG and JPEG files they are kept in.

/// Pixels by rows from the top left: four bytes each, sRGB and straight alpha.
struct Picture {
    unsigned width = 0, height = 0;
    std::vector<std::uint8_t> rgba; ///< 4 * width * height

    Picture() = default;
    Picture(unsigned w, unsigned h) : width(w), height(h), rgba(std::size_t{4} * w * h) {}

    std::uint8_t* pixel(unsigned x, unsigned y) { return rgba.data() + 4 * (std::size_t{width} * y + x); }
    const std::uint8_t* pixel(unsigned x, unsigned y) const { return rgba.data() + 4 * (std::size_t{width} * y + x); }
};

/// Decodes a PNG (of any kind, to 8 bits) or a JPEG, told by the content; `name` stands in messages.
/// Errors: bad_file (damaged), unsupported (neither), out_of_memory (more than 2^28 pixels are refused unread).
Result<Picture> decode_picture(std::string_view bytes, const std::string& name);
/// The same from a file. Errors: not_found as well.
Result<Picture> read_picture(const std::filesystem::path& path);

/// The bytes of a PNG file: RGB where every pixel is opaque, else RGBA. The same picture gives the same bytes; none
/// when there are no pixels.
std::string encode_png(const Picture& picture);

/// How far two pictures of one size are from each other: root mean square over all channels, 0 to 255; infinite when
/// their sizes differ.
double picture_distance(const Picture& a, const Picture& b);

// ---------------------------------------------------------------------------------------------------------------------
// Numbers as colours.

/// sequential: dark to bright, for amounts (an error, a strain). diverging: two hues from a pale middle, for signed
/// amounts. Both are made in OKLab [Ottosson 2020] so that equal steps of the number look like equal steps of colour;
/// lightness rises steadily in the first and is symmetric in the second, so they survive a grey print. categorical:
/// category_colors(), each an eighth, for things without an order.
enum class ColorMap { sequential, diverging, categorical };

/// sRGB: eight hues, evenly around OKLab's circle of lightness 0.80 and chroma 0.095, so that none stands out.
inline constexpr std::size_t kCategoryCount = 8;
const std::array<Vec3f, kCategoryCount>& category_colors();

/// sRGB, 0 to 1, for t in [0, 1] (clamped; NaN gives a neutral grey). Cost: a few multiplications (a table inside).
Vec3f color_at(ColorMap map, float t);

/// The table behind it: 256 sRGB colours, evenly from t = 0 to t = 1.
std::span<const Vec3f> color_table(ColorMap map);

/// sRGB (0 to 1) to OKLab: lightness 0 to 1, and a, b. Distances in it are how different two colours look.
Vec3f srgb_to_oklab(const Vec3f& srgb);

/// sRGB (0 to 1) to amounts of light, which add up.
Vec3f srgb_to_linear(const Vec3f& srgb);

/// A range a legend would show for `values`: finite ones only, the ends as round numbers (multiples of 1, 2 or 5 times
/// a power of ten, no further out than they must), never empty, {0, 1} when there are no values. With `from_zero` it
/// starts at 0, and values below do not count.
struct ValueRange {
    float least = 0, most = 1;
};
ValueRange legend_range(std::span<const float> values, bool from_zero);

/// Errors as colours: dark is none. `values` in model units become fractions of `diagonal`; the range covers 99.5 % of
/// them, and what is above has the brightest colour.
struct HeatMap {
    std::vector<float> values;
    ValueRange range;
};
HeatMap heat_map(std::vector<float> values, double diagonal);

/// Numbers to write beside a legend: round, ascending, inside the range, at most `count` of them (from two up) and
/// about so many.
std::vector<double> legend_ticks(const ValueRange& range, unsigned count);

// ---------------------------------------------------------------------------------------------------------------------
// Where a picture is taken from.

/// A camera in the world. Right-handed; looks from `eye` to `target`.
struct Camera {
    Vec3d eye = {0, 0, 1}, target = {0, 0, 0}, up = {0, 1, 0}; ///< up need not be at right angles to the view
    double field_of_view_deg = 30; ///< the vertical angle of view, below 180; 0: parallel projection
    double height = 1;             ///< parallel projection: model units from the bottom to the top of the picture

    /// Columns right, up and back of the camera: unit, at right angles. A view along `up` takes another up, so that
    /// what is in front (as View has it) stays at the bottom of the picture from above, and at the top from below.
    Mat3d basis() const;
    /// World to camera space: x right, y up, z towards the viewer.
    Vec3d to_camera(const Vec3d& world) const { return basis().transpose() * (world - eye); }
    /// Camera space to clip space; depth -1 at `near` and 1 at `far` (distances along the view, 0 < near < far).
    Eigen::Matrix4d projection(double aspect, double near, double far) const;
    /// Where a world point falls on a picture of that size, in pixels from the top left; z: distance along the view (a
    /// perspective has no place for points where it is not above 0).
    Vec3d project(const Vec3d& world, double width, double height) const;
    /// The ray through a pixel (from the top left, fractions allowed): where it starts, and its unit direction. The
    /// inverse of project.
    struct Ray {
        Vec3d origin, direction;
    };
    Ray ray(double x, double y, double width, double height) const;
};

/// What fit_camera needs to know of an object: its points in the world.
struct CameraPoints {
    std::span<const Vec3f> positions;
    Vec3d origin = Vec3d::Zero();
    double radius = 0; ///< of balls around them, model units
};

/// The positions that a mesh's faces use; all where there are no faces. Into `room`, which has to stay, where some
/// vertices are unused: a stray one far away would make the picture empty. The mesh is not checked.
CameraPoints points_of_faces(const Mesh& mesh, std::vector<Vec3f>& room, double radius = 0);

/// The camera that looks along -direction and shows all points as large as they fit in a picture of that aspect (width
/// / height) with `margin` (a fraction of the picture's height, on every side). Exact, also in perspective: for each
/// side of the frustum the point furthest out decides; only that the eye stays a thousandth of the points' box in front
/// of them. The target is in the middle of the picture, half way between the nearest and the furthest point. Points
/// without extent are seen from one unit away; no points: the unit cube about the origin. Cost O(points).
Camera fit_camera(std::span<const CameraPoints> points, const Vec3d& direction, const Vec3d& up, double aspect,
                  double field_of_view_deg = 30, double margin = 0.06);

/// The camera turned by an angle about the axis `up` through its target.
Camera turned(const Camera& camera, double degrees);

// ---------------------------------------------------------------------------------------------------------------------
// What can be drawn: surfaces, models and points in GPU memory.

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
    /// A model at a level, restored by the vertex shader (reference models: on the CPU, then uploaded). Normals
    /// belong to the rest shape and turn with the gradients. Starts unposed. The model must outlive the drawable, and
    /// so must what the options point to.
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

// ---------------------------------------------------------------------------------------------------------------------
// Scenes to pictures. Light is accumulated [Haeberli and Akeley 1990]: each pass moves the camera by a part of a pixel
// and lights the scene from one direction, with a shadow map. The average is an antialiased picture with soft shadows
// and ambient occlusion. A window shows the sum so far; a file takes all passes.

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

// ---------------------------------------------------------------------------------------------------------------------
// OpenGL without a window.

/// An OpenGL 4.3 core context through EGL: on a GPU where there is one, else on Mesa's software renderer. Needs no
/// display and no rights. Drawing happens in the thread that made the context current.
class HeadlessContext {
public:
    /// Makes a context and makes it current in this thread.
    /// Errors: unsupported (no EGL or no OpenGL 4.3: says what to install), out_of_memory (too little address space).
    static Result<HeadlessContext> create();
    HeadlessContext(HeadlessContext&&) noexcept;
    HeadlessContext& operator=(HeadlessContext&&) noexcept;
    ~HeadlessContext();

    /// What draws, as OpenGL names itself: "llvmpipe (LLVM 15.0.6, 256 bits)".
    const std::string& renderer_name() const;

private:
    struct Content;
    explicit HeadlessContext(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

// ---------------------------------------------------------------------------------------------------------------------
// Films: pictures one after the other into an .mp4, a .gif, or numbered PNG files.

/// Whether a name stands for a film: .mp4, .gif, or a .png whose name holds a number pattern ("frame_%04d.png").
bool is_film_path(const std::filesystem::path& path);

/// Writes a film frame by frame. Nothing stands at `path` until finish(); a writer that goes away before takes its
/// unfinished files (temporary ones beside the target) and the ffmpeg that it started with it, also when it was
/// cancelled. Numbers of pictures count from 1. Transparent parts of .mp4 and .gif become white. A symbolic link to a
/// film is followed; numbered pictures replace files, but no links (io/file_batch.h says what holds when the process is
/// killed). A killed process leaves `.filigree-X.tmp` of an .mp4 or .gif, which may be deleted.
class FilmWriter {
public:
    /// .mp4 (H.264, yuv420p; odd sizes are padded by a row or column of the last pixel) and .gif (a palette of its own)
    /// need the program ffmpeg; numbered PNGs do not. A .gif is kept in memory (by ffmpeg) until its palette is known.
    /// Errors: usage (no film's name, no pixels, no such rate), unsupported (ffmpeg is missing: says what to install),
    /// unwritable.
    static Result<FilmWriter> create(const std::filesystem::path& path, unsigned width, unsigned height,
                                     double frames_per_second);
    FilmWriter(FilmWriter&&) noexcept;
    FilmWriter& operator=(FilmWriter&&) noexcept;
    ~FilmWriter();

    /// Errors: mismatch (another size), unwritable (disk full, ffmpeg failed: with its last words).
    Status add(const Picture& frame);
    /// Puts the film in place: all numbered pictures or none. Errors: unsuitable (no frames), unwritable.
    Status finish();

    unsigned frame_count() const;

private:
    struct Content;
    explicit FilmWriter(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
