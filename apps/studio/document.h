// What the studio works on: one state after the other, each a value, and the undo stack between them.
#pragma once

#include "filigree/deform/warp_steps.h"
#include "filigree/fit.h"
#include "filigree/flesh.h"
#include "filigree/mesh.h"
#include "filigree/render/surface_materials.h"
#include "filigree/restore.h"
#include "filigree/scene/dropped_body.h"
#include "filigree/strip.h"

#include <QObject>
#include <QUndoStack>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filigree::studio {

struct MadeQuads;
struct MadePieces;

/// A mesh as it came and what is known of it. Never changes once made.
struct Source {
    Mesh mesh;
    std::string path;     ///< "" for a built-in shape
    std::string name;     ///< what the window calls it
    Box box;              ///< of the mesh, in the world
    std::string contents; ///< what else its file holds: "a skin of 24 joints"; "": nothing
    std::vector<std::string> warnings;
    TopologyReport topology;
    SurfaceMaterials materials;
    std::shared_ptr<const MadeQuads> quads; ///< how they were made, when the mesh is quads of another; null: it is not
    std::shared_ptr<const MadePieces> pieces; ///< how they were cut, when the mesh is in pieces; null: it is whole
};

/// A source of a mesh and a name for it, with what is to be known of it. path: "" for a built-in shape. Warnings are
/// the caller's, also those of the materials.
std::shared_ptr<Source> source_of(Mesh mesh, const std::string& path, const std::string& name,
                                  const RunContext& context);

/// A built-in shape and its settings.
struct Shape {
    std::string name = "wavy-cube"; ///< one of shape_names()
    ShapeOptions options;
    bool operator==(const Shape&) const = default;
};

/// A pin, or a pull that was made. Each pull starts from the shape that the ones before it left, so nothing jumps when
/// the next one begins. Places are in model units, relative to the mesh's origin, before the warps.
struct Handle {
    std::vector<Index> vertices = {}; ///< of the driver, ascending; in no other pin
    std::vector<Vec3f> targets = {};  ///< one each: where they are held, or where the pull left them
    bool pinned = false;              ///< by the user, and so shown as a pin: pulls leave it where it is
    // Of a pull, all that is needed to do it again on another resolution:
    std::vector<Index> held = {}; ///< of the driver, ascending: stayed where they were
    Vec3f centre = Vec3f::Zero(); ///< what was taken hold of, at rest
    double grip = 0, reach = 0;   ///< model units about it, at rest
    Vec3f move = Vec3f::Zero();   ///< of what is within the grip, as it was moved: see HandleDrag::applied()
    bool operator==(const Handle&) const = default;
};

/// How a body is made, and the world it is put in.
struct BodySettings : DropOptions {
    double softest = 0.1; ///< stiffness where the painted softness is 1, as a multiple of the material's
    std::string preset =
        "soft-rubber"; ///< of named_materials(); "custom" once the material, which starts so, was changed
    bool operator==(const BodySettings&) const = default;
};

/// Whether the body of one is that of the other: what may change around it while it moves is not compared.
bool is_same_body(BodySettings a, const BodySettings& b);

/// An animation of another program: what poses are to follow. Shared, and never changes.
struct MovingMesh {
    std::string path;
    std::vector<std::string> clips;       ///< of a glTF, as they are shown
    std::size_t clip = 0;                 ///< that the frames are of
    std::vector<std::string> joints = {}; ///< names, of a skin that flesh can be made of
    double frames_per_second = 60;
    std::vector<std::vector<Vec3f>> frames =
        {}; ///< positions relative to the origin, one a vertex of the source's mesh
};

/// What became of a character as flesh.
struct FleshedMotion {
    FleshReport made;
    FleshMeasure measure;
    std::string furthest_joint; ///< that carries the vertex that is farthest from the skin
    std::size_t particles = 0;
    double spacing = 0, step_seconds = 0; ///< m, s a frame
    unsigned most_substeps = 0;
    bool is_loop = false;
    double loop_rms = 0;  ///< of the diagonal, before the fade
    bool is_sound = true; ///< the motion was finite, and no substep was too long
};

/// What a fit came to. Shared, and never changes.
struct FittedMotion {
    FitReport report;
    std::string packed;                    ///< the bytes of a compact model file
    double packed_rms = 0, packed_max = 0; ///< the error of that file, fractions of the diagonal
    /// The poses follow flesh, and the original is its skin.
    std::optional<FleshedMotion> flesh = {};
};

/// All clips of a character as flesh: one model, and what became of each clip. Shared, and never changes.
struct FleshedClips {
    struct Clip {
        std::shared_ptr<const MovingMesh> original; ///< plain skinning
        std::shared_ptr<const FittedMotion> fitted;
    };
    FittedFlesh fitted;
    std::vector<Clip> clips; ///< as those of `fitted`; the number in the file is original->clip
};

/// What a body did, for the driver. Frames are shared between the steps of the history, so a longer recording costs its
/// new frames alone.
struct Recording {
    double frames_per_second = 60;
    std::vector<std::shared_ptr<const Pose>> frames; ///< the first is the start; none is null
    /// One a frame, of a body that melts: what there is in place of the restored mesh; null: nothing. Beyond the end:
    /// null.
    std::vector<std::shared_ptr<const Mesh>> surfaces;
    /// What the poses follow; null: nothing. As many frames.
    std::shared_ptr<const MovingMesh> original;
    std::shared_ptr<const FittedMotion> fitted; ///< how well they do; null, with an original: they do not yet, all rest
    std::shared_ptr<const FleshedClips> clips;  ///< of which this is one; null: it stands alone

    bool has_poses() const { return !original || fitted; }
    std::shared_ptr<const Mesh> surface(std::size_t frame) const {
        return frame < surfaces.size() ? surfaces[frame] : nullptr;
    }
    /// Adds the frames of `poses` that are beyond those there are, and their surfaces.
    void follow(const PoseSequence& poses, std::span<const std::shared_ptr<const Mesh>> surfaces_of_all = {});
    PoseSequence poses() const; ///< a copy, for files
};

/// Everything that is saved, undone and redone. Cheap to copy: what is large is shared and never changes. Equal states
/// share it.
struct State {
    std::shared_ptr<const Source> source;
    std::optional<Shape> shape; ///< when the source is a built-in shape
    StripOptions strip;         ///< what the model was made with
    StripReport strip_report;
    std::shared_ptr<const Model> model; ///< its mesh is the source's
    RestoreOptions restore;             ///< level: the one shown, always set
    Warps warps;
    std::vector<Handle> handles;
    std::shared_ptr<const Pose> handle_pose; ///< the driver as the pulls left it; null: at rest
    bool pose_from_file = false;             ///< the first pull began at a pose that a file held, not at rest
    BodySettings body;
    /// Painted, 0 .. 1, one a vertex of the source's mesh; null: none. Of another count: of a mesh before.
    std::shared_ptr<const std::vector<float>> softness;
    std::shared_ptr<const Recording> recording; ///< null: none

    unsigned level() const { return *restore.level; }
    bool operator==(const State&) const = default;
};

/// What the history calls a change: "Bend", "Frequency 7", "Gravity off".
QString name_of_change(const Warps& before, const Warps& after);
QString name_of_change(const Shape& before, const Shape& after);
QString name_of_change(const StripOptions& before, const StripOptions& after);
QString name_of_change(const BodySettings& before, const BodySettings& after);

/// The state and its history. Lives in the main thread.
class Document : public QObject {
    Q_OBJECT
public:
    explicit Document(QObject* parent = nullptr);

    const State& state() const { return state_; }
    QUndoStack& undo_stack() { return undo_stack_; }

    /// The next state, as a step with that name in the history ("Bend"). Steps in a row with one `merge` key that is
    /// not empty become one (a slider that is dragged), until end_merge().
    void change(const QString& name, State next, const std::string& merge = {});
    /// The state as `edit(state)` leaves it, as the next step; no step when it leaves it as it was.
    template <class Edit>
    void edit(const QString& name, Edit&& edit, const std::string& merge = {}) {
        State next = state_;
        std::forward<Edit>(edit)(next);
        if (!(next == state_)) change(name, std::move(next), merge);
    }
    void end_merge() { ++merge_run_; }
    /// The key as it is now, for a change that comes later (from the background): end_merge() does not cut it off.
    std::string merge_key(const std::string& merge) const;
    /// A fresh start: no history, nothing unsaved.
    void replace(State next);

    bool is_modified() const { return !undo_stack_.isClean(); }
    void set_saved() { undo_stack_.setClean(); }
    /// The same number means the same state, also after undo and redo.
    std::uint64_t state_id() const { return state_id_; }

Q_SIGNALS:
    /// The state is another one now; what differs can be seen by comparing.
    void changed(const State& before);

private:
    friend class StateChange; ///< the undo command
    void go_to(const State& next, std::uint64_t id);
    void set(State next, std::uint64_t id);

    State state_;
    QUndoStack undo_stack_;
    unsigned merge_run_ = 0;
    std::uint64_t state_id_ = 0, last_id_ = 0;
};

} // namespace filigree::studio
