// Pictures and films of meshes and models, with OpenGL 4.3, with or without a window. Link filigree::render.
//
//     const HeadlessContext gl = HeadlessContext::create().value();   // or the context of your window
//     const Drawable drawable = Drawable::surface(mesh).value();
//     std::vector<Vec3f> room;
//     const CameraPoints points = points_of_faces(mesh, room);
//     const Camera camera = fit_camera({&points, 1}, view_direction(View::iso, UpAxis::y), up_vector(UpAxis::y), 4.0 /
//     3); const Picture picture = Renderer::create().value().picture({{{&drawable}}}, camera).value();
//     write_file("mesh.png", encode_png(picture));
//
// Drawable::model draws a stripped model: its pose is all that is sent to the graphics card each frame. FilmWriter
// makes films. Light is accumulated over passes [Haeberli and Akeley 1990]: each pass moves the camera by a part of a
// pixel and lights the scene from one direction, with a shadow map; the mean is antialiased, with soft shadows.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/result.h"
#include "filigree/strip.h"
#include "filigree/types.h"

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
// Pictures

/// Pixels, row by row from the top left: four bytes a pixel, sRGB with straight alpha.
struct Picture {
    unsigned width = 0, height = 0;
    std::vector<std::uint8_t> rgba; ///< 4 * width * height

    Picture() = default;
    Picture(unsigned w, unsigned h) : width(w), height(h), rgba(std::size_t{4} * w * h) {}

    std::uint8_t* pixel(unsigned x, unsigned y) { return rgba.data() + 4 * (std::size_t{width} * y + x); }
    const std::uint8_t* pixel(unsigned x, unsigned y) const { return rgba.data() + 4 * (std::size_t{width} * y + x); }
};

/// Decodes a PNG (of any kind, to 8 bits) or a JPEG; the content decides which. name: for messages.
/// Errors: bad_file (damaged), unsupported (neither), out_of_memory (more than 2^28 pixels are refused unread).
Result<Picture> decode_picture(std::string_view bytes, const std::string& name);
/// Reads a PNG or JPEG file. Errors: not_found, bad_file, unsupported, out_of_memory.
Result<Picture> read_picture(const std::filesystem::path& path);

/// The bytes of a PNG file: RGB where all pixels are opaque, else RGBA. The same picture gives the same bytes. Empty
/// for a picture without pixels.
std::string encode_png(const Picture& picture);

/// The bytes of a JPEG file, quality 90, without chroma subsampling; transparent parts become white. Empty for a
/// picture without pixels.
std::string encode_jpeg(const Picture& picture);

/// Root mean square difference of two pictures over all channels, 0 to 255; infinite when their sizes differ.
double picture_distance(const Picture& a, const Picture& b);

// ---------------------------------------------------------------------------------------------------------------------
// Colour maps

/// - sequential: dark to bright, for amounts (an error, a strain).
/// - diverging: two hues from a pale middle, for signed amounts.
/// - categorical: the colours of category_colors(), an eighth of the range each, for things without an order.
/// The first two are made in OKLab [Ottosson 2020]: equal steps of the number look like equal steps of colour, and
/// lightness alone tells the number, so they survive a grey print.
enum class ColorMap { sequential, diverging, categorical };

/// Eight colours, sRGB, equally light and equally strong (OKLab lightness 0.80, chroma 0.095), so that none stands out.
inline constexpr std::size_t kCategoryCount = 8;
const std::array<Vec3f, kCategoryCount>& category_colors();

/// The colour at t, 0 to 1 (clamped; NaN gives a neutral grey): sRGB, 0 to 1. Cost: a look-up in a table.
Vec3f color_at(ColorMap map, float t);

/// The table behind color_at: 256 sRGB colours, evenly spaced from t = 0 to t = 1.
std::span<const Vec3f> color_table(ColorMap map);

/// sRGB (0 to 1) to OKLab: lightness 0 to 1, a and b. Distances in OKLab say how different two colours look.
Vec3f srgb_to_oklab(const Vec3f& srgb);

/// sRGB (0 to 1) to linear light.
Vec3f srgb_to_linear(const Vec3f& srgb);

struct ValueRange {
    float least = 0, most = 1;
};
/// The range that a legend for `values` shows. Its ends are round numbers (1, 2 or 5 times a power of ten) that just
/// cover all finite values; {0, 1} where there are none. from_zero: the range starts at 0, and lower values do not
/// count.
ValueRange legend_range(std::span<const float> values, bool from_zero);

/// Errors as colours; dark means no error. heat_map divides `values` (model units) by `diagonal`. The range covers 99.5
/// % of them; larger errors have the brightest colour.
struct HeatMap {
    std::vector<float> values;
    ValueRange range;
};
HeatMap heat_map(std::vector<float> values, double diagonal);

/// Numbers to write beside a legend: round, ascending, inside the range, about `count` (2 or more) and not more.
std::vector<double> legend_ticks(const ValueRange& range, unsigned count);

// ---------------------------------------------------------------------------------------------------------------------
// Cameras

/// A camera in the world. Right-handed; looks from `eye` to `target`.
struct Camera {
    Vec3d eye = {0, 0, 1}, target = {0, 0, 0}, up = {0, 1, 0}; ///< up need not be at right angles to the view
    double field_of_view_deg = 30; ///< the vertical angle of view, below 180; 0: parallel projection
    double height = 1;             ///< parallel projection: model units from the bottom to the top of the picture

    /// Columns: the camera's right, up and back; unit vectors at right angles. A view along `up` takes another up
    /// vector: the front side (View::front) is then at the bottom of the picture from above, and at the top from below.
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

/// The points of an object, for fit_camera.
struct CameraPoints {
    std::span<const Vec3f> positions;
    Vec3d origin = Vec3d::Zero();
    double radius = 0; ///< model units: radius of balls around the points
};

/// The positions that the faces of a mesh use, or all positions where there are no faces. room: memory for them where
/// some vertices are unused; keep it as long as the result. The mesh is not checked.
CameraPoints points_of_faces(const Mesh& mesh, std::vector<Vec3f>& room, double radius = 0);

/// A camera that looks along -direction and shows all points as large as possible in a picture of the given aspect
/// (width / height). margin: free border on every side, fraction of the picture's height. The fit is exact, also in
/// perspective. The target is in the middle of the picture, half way between the nearest and the furthest point. A
/// single point is seen from one unit away; without points the camera shows the unit cube about the origin. Cost
/// O(points).
Camera fit_camera(std::span<const CameraPoints> points, const Vec3d& direction, const Vec3d& up, double aspect,
                  double field_of_view_deg = 30, double margin = 0.06);

/// The camera, turned about the axis `up` through its target.
Camera turned(const Camera& camera, double degrees);

// ---------------------------------------------------------------------------------------------------------------------
// Drawables: surfaces, models and points in graphics memory

/// Where normals come from. automatic: the mesh's own; where it has none, edges are sharp above `crease_deg`.
enum class Shading { automatic, smooth, flat };

/// Numbers shown as colours.
struct ScalarColors {
    std::span<const float> values = {}; ///< one a vertex; empty: not shown
    ColorMap map = ColorMap::sequential;
    ValueRange range = {};
};

/// Colour and texture of the faces of one material.
struct SurfaceMaterial {
    Vec3f color = {1, 1, 1};          ///< sRGB, multiplies the picture
    const Picture* picture = nullptr; ///< placed by the mesh's UVs; null: none
};

struct SurfaceOptions {
    Shading shading = Shading::automatic;
    double crease_deg = 45; ///< faces that meet at a larger angle keep a sharp edge (automatic shading)
    ScalarColors scalars = {};
    std::vector<SurfaceMaterial> materials = {}; ///< empty, or one for each name in mesh.materials
    std::vector<char> hidden_faces = {}; ///< empty, or one a face: faces with a value other than 0 are not drawn
};

struct PointOptions {
    float radius = 0; ///< model units; 0: 0.48 of the typical distance to the sixth neighbour
    ScalarColors scalars = {};
    std::span<const Vec4f> colors = {}; ///< empty or RGBA a point
};

/// Where the vertices of a model are restored. gpu: in the vertex shader; only the pose is uploaded. cpu: positions and
/// normals are uploaded with each pose. Take cpu for software renderers, which would restore again in each pass.
enum class RestoreOn { gpu, cpu };

/// The part of a drawable that needs no OpenGL: make it in any thread, while a window goes on drawing, and upload it
/// then. Errors of both: unsuitable (nothing to draw), usage (no such level; check_mesh refuses the mesh), cancelled.
class DrawData {
public:
    static Result<DrawData> surface(const Mesh& mesh, const SurfaceOptions& options = {},
                                    const RunContext& context = RunContext());
    /// Prepares Drawable::model. The model, and what the options point to, must outlive the data and the drawable.
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

/// Something in graphics memory. Make it and draw it with the same OpenGL context current.
class Drawable {
public:
    /// Copies prepared data to graphics memory. Errors: out_of_memory (graphics memory), unsupported.
    static Result<Drawable> upload(DrawData data);

    /// Errors of all three: out_of_memory (graphics memory), unsuitable (nothing to draw), usage (check_mesh refuses
    /// the mesh), cancelled.
    static Result<Drawable> surface(const Mesh& mesh, const SurfaceOptions& options = {},
                                    const RunContext& context = RunContext());
    static Result<Drawable> points(std::span<const Vec3f> positions, const Vec3d& origin,
                                   const PointOptions& options = {}, const RunContext& context = RunContext());
    /// A level of a model; the vertex shader restores it, or the processor where that draws as well. Normals belong to
    /// the rest shape and turn with the gradients. It is at rest until set_pose. The model, and what the options point
    /// to, must outlive the drawable.
    static Result<Drawable> model(const Model& model, const RestoreOptions& restore, const SurfaceOptions& options = {},
                                  const RunContext& context = RunContext());
    Drawable(Drawable&&) noexcept;
    Drawable& operator=(Drawable&&) noexcept;
    ~Drawable();

    /// Poses a model. Errors: mismatch (the pose has another number of vertices than the driver; not a model).
    Status set_pose(const Pose& pose, const RunContext& context);
    /// Changes the colours of a model or a surface: one number a vertex of the level or the mesh; empty: no such
    /// colours. Errors: mismatch (another number of values), out_of_memory.
    Status set_scalars(const ScalarColors& scalars);
    /// Moves points. positions: as many as before. Errors: mismatch.
    Status set_positions(std::span<const Vec3f> positions);

    const Box& box() const; ///< in the world; of a posed model: contains it
    std::size_t triangle_count() const;
    std::size_t point_count() const;
    float point_radius() const; ///< model units, of the balls; 0 for surfaces

    struct Content;
    const Content& content() const { return *content_; }

private:
    explicit Drawable(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

// ---------------------------------------------------------------------------------------------------------------------
// Rendering

/// Cuts away everything on the positive side of a plane: normal . p > offset, in the world.
struct ClipPlane {
    Vec3d normal = {0, 0, 1};
    double offset = 0;
};

/// How one object looks.
struct Appearance {
    Vec3f color = {0.78f, 0.76f, 0.72f}; ///< sRGB; where the drawable has no colours
    bool own_colors = true;              ///< use the drawable's vertex colours, scalars and materials
    bool surface = true;                 ///< false: edges alone
    bool edges = false;                  ///< the polygons' own edges (no diagonals), over the surface
    Vec3f edge_color = {0.08f, 0.09f, 0.11f};
    float edge_width = 1.2f; ///< pixels
    float gloss = 0.35f;     ///< 0 chalk .. 1 porcelain
    std::optional<ClipPlane> clip = {};
    /// 0 .. 1: the part of the pixels that is drawn; a pattern that changes from pass to pass chooses them. -f draws
    /// the other pixels. So two levels with f and -f at the same place blend: a level changes without a pop.
    float coverage = 1;
};

struct SceneObject {
    const Drawable* drawable = nullptr;
    Appearance appearance = {};
};

struct Background {
    Vec3f top = {0.96f, 0.965f, 0.97f}, bottom = {0.80f, 0.82f, 0.845f}; ///< sRGB
    bool transparent = false; ///< alpha 0 where nothing is drawn; the shadow on the ground becomes dark alpha
};

struct Scene {
    std::vector<SceneObject> objects;
    Background background = {};
    UpAxis up = UpAxis::y;
    bool ground = true;      ///< a floor at the lowest point, which catches the shadow
    double ground_level = 0; ///< world, along `up`; used with fixed_ground
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

    /// Draws the scene. The same scene gives the same bytes on the same machine.
    /// Errors: unsuitable (larger than the driver's limit, which is said), out_of_memory, cancelled.
    Result<Picture> picture(const Scene& scene, const Camera& camera, const PictureOptions& options = {},
                            const RunContext& context = RunContext());

    /// Starts a picture that a window shows while it becomes better. passes: how many there will be. The drawables of
    /// the scene must outlive the last add_pass. Errors: unsuitable (larger than the limit of the driver),
    /// out_of_memory.
    Status begin(const Scene& scene, const Camera& camera, unsigned width, unsigned height, unsigned passes);
    /// Draws the next pass; false when all are drawn.
    bool add_pass();
    /// Copies the mean of the passes so far to `framebuffer` (an OpenGL name; 0 is the window). x, y: pixels, where the
    /// lower left corner of the picture goes; pixels around the picture stay.
    void show(unsigned framebuffer, int x = 0, int y = 0) const;
    /// Draws one pass that looks like the whole picture without shadows, for motion; show() copies it. Errors: those of
    /// begin.
    Status preview(const Scene& scene, const Camera& camera, unsigned width, unsigned height);

private:
    struct Content;
    explicit Renderer(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

// ---------------------------------------------------------------------------------------------------------------------
// OpenGL without a window

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

    /// The name of what draws, from OpenGL: "llvmpipe (LLVM 15.0.6, 256 bits)".
    const std::string& renderer_name() const;

private:
    struct Content;
    explicit HeadlessContext(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

// ---------------------------------------------------------------------------------------------------------------------
// Films

/// Whether a path names a film: .mp4, .gif, or a .png with a place for a number ("frame_%04d.png").
bool is_film_path(const std::filesystem::path& path);

/// Writes a film frame by frame. `path` is unchanged until finish(). A writer that is destroyed before removes its
/// temporary files and stops the ffmpeg that it started. Numbered pictures count from 1. Transparent parts become white
/// in .mp4 and .gif. A symbolic link to a film is followed; numbered pictures replace files but no links. A process
/// that is killed leaves `.filigree-X.tmp` beside an .mp4 or .gif, which may be deleted.
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
    /// Puts the film into its place: all numbered pictures, or none. Errors: unsuitable (no frames), unwritable.
    Status finish();

    unsigned frame_count() const;

private:
    struct Content;
    explicit FilmWriter(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
