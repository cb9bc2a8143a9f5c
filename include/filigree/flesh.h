// Flesh: a character that joints move becomes soft matter. What is near its bones follows the animation; the rest has
// inertia, weight and contact.
//
//     const Flesh flesh = Flesh::create(read_skin("fox.glb").value()).value();
//     const FleshClip clip = simulate_flesh(flesh, 0).value();              // the first clip of the file
//     FleshCarrier carrier = FleshCarrier::create(flesh, vertices).value(); // vertices of the mesh, such as a driver's
//     carrier.at(clip, 10, positions, gradients);
//     const FittedFlesh small = fit_flesh(flesh, std::span(&clip, 1)).value(); // a model and its poses, for export
//
// docs/flesh.md says what to change when.
#pragma once

#include "filigree/fit.h"
#include "filigree/physics/simulation.h"
#include "filigree/skin.h"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

/// Soft tissue, chosen for how it moves: 1,000 kg/m^3, 15 kPa, Poisson's ratio 0.47. Damping is FleshOptions::damping.
Material flesh_material();

/// Joints that hold otherwise than the rest, with all joints below them.
struct SoftJoints {
    std::string pattern;    ///< name of a joint; * stands for any characters, ? for one
    double strength = 0.02; ///< 0 .. 1: factor of the springs' stiffness; below 0.75 nothing is held fast
    /// As those of FleshOptions, which count where these are unset.
    std::optional<double> core = {}, frequency = {}, surface_frequency = {}, damping = {};
};

/// Whether limbs touch each other: what the joints of one pattern carry, with all joints below them, and those of
/// another.
struct JointContact {
    std::string first, second; ///< names or patterns, as SoftJoints::pattern
    bool touch = false;
};

struct FleshOptions {
    double scale = 0;             ///< metres a model unit, above 0; 0: chosen by flesh_scale
    std::size_t particles = 5000; ///< about
    Material material = flesh_material();
    /// 0 .. 1: how far the held core reaches from a bone to the skin. 0: nothing is held, 1: all is.
    double core = 0.5;
    double frequency = 10;                   ///< Hz, 0 or more: of the springs at the edge of the core
    double surface_frequency = 1;            ///< Hz, 0 or more: of the springs at the skin
    double damping = 3;                      ///< 1/s, 0 or more: against the animation
    std::optional<double> leash = {};        ///< m, above 0: Follow::leash; unset: two spacings
    double most_acceleration = 100;          ///< m/s^2, above 0: Follow::most_acceleration
    std::vector<SoftJoints> soft = {};       ///< the first pattern that fits counts
    std::vector<JointContact> contacts = {}; ///< the last that fits two joints counts; without one they touch
    /// One a vertex, 0 .. 1, or empty: how loose the matter there is. 0 holds as the joints say, 1 with loose_strength
    /// of it; carried inwards harmonically.
    std::vector<float> loose = {};
    double loose_strength = 0.02;         ///< 0 .. 1
    std::optional<double> spacing = {};   ///< m, above 0: of the particles, in place of their number
    std::vector<VertexField> fields = {}; ///< BodyOptions::fields
    bool separate = false;                ///< BodyOptions::separate
    Vec3d gravity = {0, -9.81, 0};        ///< m/s^2
    /// Whether the mesh has its shape under gravity: in the bind pose nothing sags.
    bool sculpted_gravity = true;
};

/// A mesh that moves without joints: a point cache, morph targets, anything.
struct MovingSurface {
    Mesh rest;
    std::vector<SkinClip> clips;
    /// Where a clip has the vertices, one each, relative to the mesh's origin. seconds: from the clip's start.
    std::function<Status(std::size_t clip, double seconds, std::span<Vec3f> positions)> positions;
    double samples_per_second = 60; ///< above 0: how often the joints are worked out; cubic in between
};

/// A moving surface as a skin: patches of it become joints, which move and stretch as the surface does. Matter is then
/// soft by its depth, as there are no bones. patches: about, 12 or more; no more than a quarter of the mesh's vertices
/// (64 where it is smaller than that). Cost O(V) for each sample. Memory: the mesh, and 12 numbers a patch and sample.
/// Errors: usage (check_mesh refuses the mesh; no clip; a number out of range), unsuitable (no faces; fewer than 12
/// places; positions that are not finite), cancelled, and those of `positions`.
Result<SkinnedMesh> skin_of_surface(MovingSurface surface, std::size_t patches = 400,
                                    const RunContext& context = RunContext());

struct CharacterOptions {
    /// The mesh at rest, for files that have positions alone: point caches, numbered meshes. Vertices of glTF and of
    /// numbered meshes are matched to it by their places.
    const Mesh* rest = nullptr;
    bool by_joints = true; ///< false: skins are taken as moving surfaces too, so that their morph targets move as well
    std::optional<double> frames_per_second = {}; ///< of files that do not say it; unset: 60
    std::size_t patches = 400;                    ///< of skin_of_surface
};

/// Reads any file that moves as a skin: an animated glTF by its joints (read_skin), or by its surface where it has no
/// skin; a model with poses (.fil); with `rest` all that open_animation reads. Errors: those of read_skin,
/// skin_of_surface, open_animation and read_model; unsuitable (nothing moves; positions alone, and no mesh at rest).
Result<SkinnedMesh> read_character(const std::filesystem::path& path, const CharacterOptions& options = {},
                                   const RunContext& context = RunContext());

/// Metres a model unit: the power of ten that makes a character between 0.3 m and 3 m tall; 1 where it already is
/// between 0.1 m and 10 m. size: longest side of its box, model units.
double flesh_scale(double size);

/// What moves a particle: a few joints.
struct FleshWeights {
    static constexpr std::size_t kMost = 6;
    std::array<Index, kMost> joints;
    std::array<float, kMost> weights; ///< sum to 1; 0 behind the last
};

struct FleshReport {
    BodyReport body;
    std::size_t held = 0;              ///< particles on the skin
    std::size_t thin = 0;              ///< particles of thin parts, which follow as a whole
    std::size_t left_out_vertices = 0; ///< vertices that follow their joints as before and have no flesh
    std::vector<std::string> scaled;   ///< joints that change their size or stretch: what they move grows with them
    std::vector<std::string> left_out; ///< joints that are mirrored, or scaled beyond 1/2 and 2
    std::vector<std::string> soft;     ///< joints that SoftJoints name
    std::vector<std::string> warnings; ///< sentences
};

/// A body of a skinned mesh, and how its particles follow the joints. It does not change while it moves.
class Flesh {
public:
    /// clips: whose joints are looked at for scales; empty: all. Cost: make_body, and a linear system over the
    /// particles for each joint (2 s for 5,000 particles and 24 joints). Errors: usage (check_skin, an option out of
    /// range, a pattern that fits no joint), unsuitable (nothing is left to soften), and those of make_body.
    static Result<Flesh> create(SkinnedMesh skin, const FleshOptions& options = {},
                                std::span<const std::size_t> clips = {}, const RunContext& context = RunContext());

    const SkinnedMesh& skin() const { return *skin_; }
    const FleshOptions& options() const { return options_; }
    double scale() const { return options_.scale; } ///< metres a model unit
    const std::shared_ptr<const Body>& body() const { return body_; }
    const Follow& follow() const { return follow_; } ///< with FleshOptions::contacts
    const FleshReport& report() const { return report_; }
    /// Of each particle: 0 on a bone, 1 at the skin.
    std::span<const float> softness() const { return softness_; }
    std::span<const FleshWeights> weights() const { return weights_; } ///< of each particle
    /// Of each vertex of the mesh: 1 where it has no flesh and follows its joints.
    std::span<const std::uint8_t> left_out() const { return left_out_; }
    /// The faces that have flesh, as a mesh over all vertices.
    const Mesh& surface() const { return surface_; }

    /// Where the joints want the particles: by dual quaternions [Kavan 2007], of matter that has grown with the joints;
    /// linear where these are patches. In metres relative to the mesh's origin, less `offset`. transforms: of
    /// SkinnedMesh::transforms. accelerations: if given, what Simulation::set_targets takes: what undoes gravity in the
    /// bind pose. Cost O(particles).
    void targets(std::span<const Eigen::Affine3d> transforms, const Vec3d& offset, Vectors& positions,
                 Vectors* accelerations, const RunContext& context = RunContext()) const;
    /// The rest shape of the matter where joints change their size or stretch, one matrix a particle, as
    /// Simulation::set_targets takes it; empty where none does.
    std::vector<Mat3f> stretches(std::span<const Eigen::Affine3d> transforms,
                                 const RunContext& context = RunContext()) const;
    /// Targets, with the cells that the joints crush there open again as far as what is held lets them: where a
    /// simulation starts, as crushed cells would fly apart. Cost: 60 passes over those cells.
    Vectors settled(const Vectors& targets) const;

private:
    Flesh() = default;
    friend class FleshMaker;
    std::shared_ptr<const SkinnedMesh> skin_;
    FleshOptions options_;
    std::shared_ptr<const Body> body_;
    Follow follow_;
    FleshReport report_;
    std::vector<float> softness_;
    std::vector<FleshWeights> weights_;
    std::vector<std::uint8_t> grows_; ///< of joints that change their size or stretch; empty: none does
    std::vector<std::uint8_t> left_out_;
    Mesh surface_;
};

struct FleshClipOptions {
    double frames_per_second = 60; ///< above 0
    /// Whether the clip is a cycle: it is repeated until it is periodic, and what is left is faded out over the last
    /// quarter, so that the last frame is the first. The rate is changed a little, to whole frames in a cycle.
    bool loop = false;
    unsigned most_cycles = 6; ///< of a loop, 2 or more
    bool ground = false;      ///< a plane at the lowest point of the clip
    bool self_contact = true; ///< whether parts of the body touch each other
};

/// The flesh of a clip, frame by frame.
struct FleshClip {
    std::size_t clip = 0;
    std::string name;
    double frames_per_second = 60;
    std::vector<Vectors> frames;  ///< particles, m, relative to the mesh's origin, less `offset`
    Vec3d offset = Vec3d::Zero(); ///< m
    bool is_loop = false;
    unsigned cycles = 1;               ///< that were simulated
    double loop_rms = 0, loop_max = 0; ///< the last cycle beside the one before, fractions of the body's diagonal
    double skin_gap = 0;               ///< the skin's own last frame beside its first, largest, the same
    unsigned most_substeps = 0, unstable_substeps = 0;
    std::size_t clamped_particles = 0;
    float least_volume_ratio = 1;                ///< FrameReport's, over all frames
    std::size_t inverted_cells = 0;              ///< at the end
    double step_seconds = 0, target_seconds = 0; ///< of a frame, mean
};

/// Simulates a clip of the skin, from its first frame on: particles begin on their targets. Errors: usage (no such
/// clip, an option out of range), unsuitable (the clip has one moment only, or travels more than 2 km), cancelled.
Result<FleshClip> simulate_flesh(const Flesh& flesh, std::size_t clip, const FleshClipOptions& options = {},
                                 const RunContext& context = RunContext());

/// Carries vertices of the mesh with the particles.
class FleshCarrier {
public:
    /// vertices: of the mesh. The flesh must outlive it.
    static Result<FleshCarrier> create(const Flesh& flesh, std::span<const Index> vertices,
                                       const RunContext& context = RunContext());
    FleshCarrier(FleshCarrier&&) noexcept;
    FleshCarrier& operator=(FleshCarrier&&) noexcept;
    ~FleshCarrier();
    /// Where the vertices are in a frame, model units relative to the mesh's origin, and the deformation gradients of
    /// the matter there. What a surface without joints does between the particles, such as a blink, is added.
    /// gradients: as many, or empty.
    void at(const FleshClip& clip, std::size_t frame, std::span<Vec3f> positions, std::span<Mat3f> gradients,
            const RunContext& context = RunContext());

private:
    struct Content;
    explicit FleshCarrier(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

/// The flesh of clips as one small model, and its poses in each of them.
struct FittedFlesh {
    Model model;
    std::vector<std::string> names;          ///< of the clips; those of one name get numbers
    std::vector<PoseSequence> poses;         ///< of each clip; a loop ends with the pose that it begins with
    FitReport report;                        ///< over the frames of all clips
    std::vector<SkinMorph> morphs;           ///< of the skin, on top of the flesh
    std::vector<MorphWeights> morph_weights; ///< of each clip, or empty

    /// For write_skin_glb (skin.h): valid while this stays where it is.
    std::vector<NamedPoses> animations() const;
};
/// Fits a driver of about so many joints to all clips at once, with fit_animation. joints: 12 or more. Cost: that of
/// fit_animation. Errors: usage (no clips; fewer joints), unsuitable (faces with fewer than 12 places), and those of
/// fit_animation.
Result<FittedFlesh> fit_flesh(const Flesh& flesh, std::span<const FleshClip> clips, std::size_t joints = 300,
                              const RunContext& context = RunContext());

/// What became of a clip, beside its skin alone.
struct FleshMeasure {
    /// Volumes over that in the bind pose, of the faces that have flesh: the least and the most of all frames.
    double least_volume = 1, most_volume = 1, skin_least_volume = 1, skin_most_volume = 1;
    /// Volume that the surface encloses twice, over that in the bind pose, beyond what it does there; the most of a few
    /// frames.
    double overlap = 0, skin_overlap = 0, bind_overlap = 0;
    double furthest = 0; ///< of a vertex from the skin, fraction of the diagonal
    std::size_t furthest_frame = 0;
    Index furthest_joint = kNoIndex; ///< that carries most of that vertex
    /// Volumes of an open surface are those of the cones from a point of it; of one that encloses nothing, such as a
    /// sheet, they stay 1 and overlaps 0.
    bool is_closed = true;
};
/// overlap_frames: how many frames are looked at for overlaps, 0: none. Cost O(V) a frame. Errors: cancelled.
Result<FleshMeasure> measure_flesh(const Flesh& flesh, const FleshClip& clip, std::size_t overlap_frames = 4,
                                   const RunContext& context = RunContext());

} // namespace filigree
