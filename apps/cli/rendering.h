// Meshes and models as `filigree render` draws them: read, coloured, posed, put into a scene.
#pragma once

#include "picture_files.h"
#include "restore_options.h"

#include "filigree/io/system/file.h"
#include "filigree/mesh/surfels.h"
#include "filigree/present/film_extent.h"
#include "filigree/present/page.h"

#include <memory>

namespace filigree::cli {

struct PictureSize {
    unsigned width = 0, height = 0;
};

struct ClipOption {
    int axis = 2;
    bool keeps_far_side = false; ///< cuts away what is below, not above
    double fraction = 0.5;       ///< of the object's box
};

/// What a surface is drawn as.
enum class DrawnAs { polygons, surfels };

struct RenderOptions {
    std::vector<std::string> files, poses, captions;
    std::string output;
    std::string motion; ///< an animation of the driver, in the place of the model's own poses
    PictureSize size;
    View view = View::iso;
    std::optional<UpAxis> up;
    std::vector<double> camera;
    double field_of_view = 30;
    bool shared_camera = false;
    std::string background, color, edge_color;
    Shading shading = Shading::automatic;
    bool edges = false, wireframe = false, points = false, no_ground = false, no_captions = false;
    double point_radius = 0;
    DrawnAs as = DrawnAs::polygons;
    std::optional<ClipOption> clip;
    std::string scalar, against, unit;
    std::vector<double> range;
    ColorMap map = ColorMap::sequential;
    unsigned passes = 0;
    bool turntable = false, draft = false;
    std::string chunk; ///< K/N: of numbered pictures; empty: all
    unsigned frames = 90;
    std::size_t frame = 0;                   ///< of the model's own poses, from 1; 0: all in a film, else none
    std::optional<double> frames_per_second; ///< unset: the poses' own, or 30
    RestoreOptions restore;
};

constexpr double kLegendWidth = 120; // pixels
inline constexpr const char* kPosesWithoutScalars = "With poses (--poses, --frame or the model's own) only --scalar "
                                                    "level can be shown: they are restored where nothing "
                                                    "is measured.";

/// Something to draw, and where the camera has to look.
struct Subject {
    std::optional<Model> model; ///< the drawable refers to it
    PoseSequence poses;         ///< of the model's file
    Mesh mesh;                  ///< as it is drawn; for a model the rest shape of its level
    SurfaceMaterials materials;
    std::vector<float> scalars; ///< one a vertex, or empty
    std::string scalar_title;
    std::optional<Restorer> restorer; ///< of the level, where there are poses
    std::optional<Surfels> surfels;   ///< at rest, where they are drawn
    std::vector<Mat3f> gradients;     ///< of the pose, one a vertex, where surfels are drawn
    std::optional<Drawable> drawable;
};

/// What stills and films share.
class Rendering {
public:
    Rendering(const RenderOptions& options, Session& session) : options_(options), session_(session) {
        if (!options.against.empty()) against_ = session.read_mesh(options.against);
    }

protected:
    const RunContext& context() const { return session_.context(); }
    std::unique_ptr<Subject> read(const std::string& path);
    /// A level of a model that does not move: its own part of the file is enough.
    bool is_level_at_rest(const FileReader& file, const std::string& path) const;
    /// What any mesh needs before it is drawn.
    void finish(Subject& subject, const std::string& path);
    void choose_scalars(Subject& subject, const std::string& path);
    void choose_surfels(Subject& subject, const std::string& path);
    void upload(Subject& subject);
    void upload_surfels(Subject& subject);
    /// The frames of options.motion.
    PoseSequence read_motion(const Model& model, const std::string& path);
    Pose read_pose(const Subject& subject, const std::string& path) const {
        return pose_of_mesh(session_.read_mesh(path), subject.model->mesh.origin);
    }
    /// Poses a model; its vertices' places are left in subject.mesh.
    void set_pose(Subject& subject, const Pose& pose, bool on_screen);
    Scene scene_of(const Subject& subject) const;
    /// What the camera has to show of a subject; as points_of_faces.
    CameraPoints shown_points(const Subject& subject, std::vector<Vec3f>& room, double radius = 0) const;
    Camera camera_for(std::span<const CameraPoints> points, double aspect) const;
    PictureOptions picture_options(unsigned width, unsigned height) const {
        return {.width = width, .height = height, .passes = options_.passes};
    }
    bool has_scalars() const { return !options_.scalar.empty(); }
    ValueRange range_of(std::span<const float> values) const;
    /// frames: empty, or what the text says of them before the size.
    void report(const std::string& frames, const PictureSize& size, std::size_t frame_count, double seconds) const;

    const RenderOptions& options_;
    Session& session_;
    HeadlessRenderer renderer_ = require(HeadlessRenderer::create());
    std::optional<Mesh> against_;
    UpAxis up_ = UpAxis::y; ///< as asked for, else as the first file has it
    bool up_known_ = false;
    Box clip_box_;          ///< films: of all moments, so that the plane stands still
    float film_radius_ = 0; ///< films: of the balls, as in the first frame
    ValueRange range_;      ///< of the scalars shown; fixed by --range or by what is drawn first
    bool range_known_ = false;
    std::size_t triangles_ = 0, points_ = 0;
};

/// One picture of one or several files, side by side.
void render_still(const RenderOptions& options, Session& session);
/// A film of one file, or of several one after the other.
void render_film(const RenderOptions& options, Session& session);

} // namespace filigree::cli
