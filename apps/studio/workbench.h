// The studio without its window: everything a user can do, as functions. Panels, actions, mouse and scripts call these.
#pragma once

#include "deformation.h"
#include "document.h"
#include "expected_error.h"
#include "jobs.h"
#include "pieces.h"
#include "playback.h"
#include "view.h"

#include "filigree/mesh.h"
#include "filigree/remesh.h"

namespace filigree::studio {

/// Which pose of the driver is shown: the deformation, or the body's motion.
enum class Mode { deform, body };

struct FilmSettings {
    unsigned width = 960, height = 720, passes = 8;
};

/// How a recording leaves as an animated GLB.
struct GlbSettings {
    double keys = 30;        ///< a second; 0: one a frame
    bool compress = false;   ///< for viewers that know EXT_meshopt_compression
    bool all_levels = false; ///< coarser levels too
    bool six_joints = false; ///< a vertex: the true rest shape, for Blender
    bool normals = true;
    bool operator==(const GlbSettings&) const = default;
};

/// How a driver is fitted to an animation.
struct FitSettings {
    double error = 1e-4;           ///< rms, fraction of the diagonal, also of the packed file
    double frames_per_second = 30; ///< of files that do not say one
    bool operator==(const FitSettings&) const = default;
};

/// How a character becomes flesh.
struct FleshSettings {
    double stiffness = flesh_material().young_modulus; ///< Pa
    double core = 0.5;                                 ///< FleshOptions::core
    double damping = 3;                                ///< 1/s
    std::size_t particles = 3000, joints = 300;        ///< about; of the flesh, of the result
    std::vector<std::string> soft = {};                ///< joints that hold little, with all below them
    double strength = SoftJoints().strength;           ///< of these
    bool loop = false, ground = false;
    bool operator==(const FleshSettings&) const = default;
};

/// The files that stand where an export of so many pictures or meshes to "frame_%04d.obj" would write; of a path
/// without a number the file itself, if it is there. For whoever asks before they are replaced.
std::vector<std::string> existing_outputs(const std::string& pattern, std::size_t frames);

/// What a new window shows: the wavy cube.
State first_state();

class Workbench : public QObject {
    Q_OBJECT
public:
    explicit Workbench(State start = first_state());
    ~Workbench() override;

    Document& document() { return document_; }
    const State& state() const { return document_.state(); }
    Jobs& jobs() { return jobs_; }
    Playback& playback() { return playback_; }
    ViewState& view() { return view_; }
    Mode mode() const { return mode_; }
    void set_mode(Mode mode);

    // Files. All in the background; errors come through told().
    /// Mesh or model, told by the content; history starts anew. Of a large stream the first levels are there at once,
    /// and can be warped while the rest is read.
    void open(const std::string& path);
    /// .fil with the recording, or with the pose; the document counts as saved when the file holds its whole shape.
    void save_model(const std::string& path);
    /// What of the document a model file does not hold, as it would be said: "the pins". None: it holds all.
    std::vector<QString> left_out_of_model() const;
    void save_mesh(const std::string& path);        ///< the level shown, as it is posed now
    void save_driver(const std::string& path);      ///< as posed, with gradients
    void export_meshes(const std::string& pattern); ///< a mesh a frame of the recording, "frame_%04d.obj"
    void export_film(const std::string& path, const FilmSettings& settings); ///< of the recording, by the view's camera
    /// The recording at the level shown: .glb, .pc2, .mdd or .usda. What is told has the size and the error.
    void export_animation(const std::string& path);
    const GlbSettings& glb_settings() const; ///< of the next export; no part of the document
    void set_glb_settings(const GlbSettings& settings);

    // Model
    void make_shape(const Shape& shape, const std::string& merge = {});
    /// The shape that is being made, else the one there is: where the next change starts from.
    const std::optional<Shape>& wanted_shape() const;
    // Quads
    const QuadRemeshOptions& quad_options() const; ///< of the quads made next; no part of the document
    void set_quad_options(const QuadRemeshOptions& options);
    void make_quads(); ///< the mesh becomes quads, in the background; quads again: of the mesh before
    // Fracture
    const PieceOptions& piece_options() const; ///< of the pieces cut next; no part of the document
    void set_piece_options(const PieceOptions& options);
    void cut_pieces(); ///< the mesh becomes pieces, in the background; again: of the whole mesh
    void make_whole(); ///< the mesh before it was cut
    // Animations of other programs
    const FitSettings& fit_settings() const; ///< of the next fit; no part of the document
    void set_fit_settings(const FitSettings& settings);
    /// An animated glTF becomes the document, at a clip; so do numbered meshes, of which one is named. The frames of a
    /// .pc2 or .mdd move the mesh there is.
    void open_motion(const std::string& path, std::size_t clip = 0);
    void fit();                                  ///< a driver and poses that follow the animation, in the background
    bool can_fit() const;                        ///< an animation is there, and it is no skin of flesh
    const FleshSettings& flesh_settings() const; ///< of the flesh made next; no part of the document
    void set_flesh_settings(const FleshSettings& settings);
    void make_flesh(); ///< of all clips, in the background; again: of the skin
    /// Another clip of the file that is open: its flesh where there is some, else the file's motion.
    void show_clip(std::size_t clip);
    bool can_make_flesh() const;
    void save_packed(const std::string& path); ///< the fitted model, in few bytes
    // Detail
    void set_strip(const StripOptions& options, const std::string& merge = {}); ///< strips again
    const StripOptions& wanted_strip() const;                                   ///< as being stripped, else as it is
    void set_level(unsigned level, const std::string& merge = {});
    void remove_detail(); ///< one level coarser
    void add_detail();    ///< one level finer
    // Deform
    void set_warps(const Warps& wanted, const std::string& merge = {});
    void reset_deformation(); ///< warps and handles
    void pin(std::span<const Index> driver_vertices);
    void unpin(std::span<const Index> driver_vertices);
    void unpin_all();
    /// Pulls a point of the surface (vertex of the finest mesh). Points are in the world, as shown. In body mode the
    /// body is grabbed instead.
    void begin_pull(Index vertex, const Vec3d& at);
    void pull_to(const Vec3d& target);
    void end_pull();
    void cancel_pull(); ///< the shape is what it was before; a body is let go
    bool is_pulling() const { return drag_.is_active() || playback_.is_grabbed(); }
    // Softness, painted on the surface
    void paint_softness(Index vertex, double radius, bool takes_away); ///< of the finest mesh; a stroke is one step
    void end_painting();
    void set_softness(std::shared_ptr<const std::vector<float>> softness);
    // Body
    void set_body(const BodySettings& settings, const std::string& merge = {}); ///< a body that was made is made again
    void make_body();
    /// Strips to a driver as fine as the body's particles, and makes the body again. Needs a body.
    void fit_driver();
    /// What is wrong with the body there is; "" when nothing is.
    QString body_warning() const;
    void play(); ///< replays from the frame shown, then goes on simulating; makes the body where there is none
    void pause();
    void step();
    void reset();
    void animate(); ///< the report's button: drops the mesh on the ground and plays
    bool is_playing() const;
    /// Warms what is near a place on the surface (in the world, as shown), and plays; cools: freezes it. Of a body that
    /// melts; of others it says so, once.
    void hold_torch(const Vec3d& at, bool cools);
    void put_out_torch();
    /// The air so warm that the body melts, or so cold that it freezes; plays, and makes the body where there is none.
    void melt();
    void freeze();
    bool can_melt() const; ///< the material of the body, or of the one to be made
    /// What is shown in place of the restored mesh: of a body that melts; null: nothing.
    std::shared_ptr<const Mesh> melt_surface() const;
    bool shows_original() const;         ///< that is the animation as it was opened
    void want_temperatures(bool wanted); ///< as the playback's moment tells them
    // Timeline
    std::size_t frame_count() const; ///< recorded frames, the start included; 0: none
    std::size_t frame() const;       ///< shown, 0 .. frame_count() - 1
    double frames_per_second() const;
    void go_to_frame(std::size_t frame);
    /// About what a recorded frame fills, in the world: the driver's box, and as much around it as the detail needs at
    /// rest; of what melts its surface's. frame: below frame_count(). Cost O(driver).
    Box motion_box(std::size_t frame) const;

    /// Measures what is shown against the full deformation, in the background; error_measured() tells.
    void measure_error();
    const std::optional<VertexDistance>& error() const { return error_; } ///< of the pose shown, if it was measured

    /// What the pose shown is expected to be off by, without measuring.
    ExpectedError& expected_error() { return expected_error_; }
    const ExpectedError& expected_error() const { return expected_error_; }

    /// The driver's pose as shown; null: at rest. It stays until the next pose_changed().
    const Pose* pose() const { return pose_.positions.empty() ? nullptr : &pose_; }
    /// All vertices of the finest mesh as fully deformed, if known for the pose shown; empty else. The split view and
    /// the error's colours ask for it by want_full.
    std::span<const Vec3f> full() const { return full_; }
    void want_full(bool wanted);
    double driver_milliseconds() const { return driver_milliseconds_; }

    /// Makes points inside the mesh at rest (model units, relative to its origin); inside_points_ready() tells.
    void sample_inside_points(std::size_t count);
    std::span<const Vec3f> inside_points() const { return inside_points_; }

    /// No job, a pull has arrived where it was pulled to, and what stands still is judged: for tests and scripts.
    void wait_until_idle();

Q_SIGNALS:
    void pose_changed();
    void full_changed();
    void mode_changed();
    void timeline_changed(); ///< playing, frame, frame count
    void error_measured();
    void inside_points_ready();
    void quad_options_changed();
    void fit_settings_changed();
    void flesh_settings_changed();
    void piece_options_changed();
    void opened();                       ///< another mesh or model than before
    void opened_motion();                ///< an animation of the mesh there is
    void saved(const std::string& path); ///< by save_model
    /// For the window's message bar. action: the name of one that settles it with a click; "": none.
    void told(const QString& sentence, bool is_error, const QString& action = {});
    void withdrawn(const QString& sentence); ///< what was told is not so any more

private:
    struct Impl;
    enum class After { nothing, play, step };

    void open_whole(const std::string& path, std::shared_ptr<const Source> look);
    void replace_document(State state);
    void follow_document(const State& before);
    void follow_playback();
    void show_pose();
    bool is_apart() const; ///< pieces are shown apart
    void pose_is_new();
    void find_full();
    void ask_for_every_vertex();
    bool is_to_measure() const; ///< the error of the pose shown, once every vertex of it is delivered
    bool is_of_body(const State& state) const;
    void forget_measuring();
    void full_is_new();
    void show_drag(const std::shared_ptr<const Pose>& pose, double milliseconds);
    void make_model(const QString& title, std::optional<Shape> shape, const StripOptions& strip,
                    const std::string& merge);
    void take_model(State& now, const State& made) const;
    void change_source(const QString& title, const QString& name,
                       std::function<Result<State>(State, const RunContext&)> make,
                       std::function<void(const Source&)> then);
    void change_level(unsigned level, const QString& name, const std::string& merge);
    void make_body_then(After then);
    void set_air(double kelvins);
    void put_body(std::shared_ptr<const DroppedBody> made);
    bool is_refused(const std::string& topic, const QString& sentence);
    const Pose& recorded_pose(std::size_t frame) const; ///< the body's, else the document's
    bool is_live_frame() const;                         ///< what is shown is where the body is now
    bool is_compared_with_original() const;             ///< every vertex of the frame shown is known
    void show_last_frame();
    void replay_frame();
    void commit_recording(const QString& name = {}, const std::string& merge = {});
    std::shared_ptr<const Mesh> original_surface() const;
    bool is_refused_without_poses();
    void change_motion(const QString& title, const QString& name,
                       std::function<Result<State>(State, const RunContext&)> make,
                       std::function<QString(const Recording&)> summary);
    void save(const QString& title, const std::string& path, std::function<Result<QString>(const RunContext&)> work,
              std::function<void()> then = {});

    Document document_;
    Jobs jobs_;
    Playback playback_;
    ViewState view_;
    HandleDrag drag_;
    Mode mode_ = Mode::deform;
    Pose pose_;
    std::vector<Vec3f> full_, inside_points_;
    std::optional<VertexDistance> error_;
    double driver_milliseconds_ = 0;
    bool wants_full_ = false;
    std::size_t frame_ = 0;
    std::unique_ptr<Impl> impl_;
    ExpectedError expected_error_{*this};
};

} // namespace filigree::studio
