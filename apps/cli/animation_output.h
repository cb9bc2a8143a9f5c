// Animated outputs, which restore, deform, simulate and export share.
#pragma once

#include "session.h"

#include "filigree/file.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/model/model_chunks.h"
#include "filigree/restore.h"

namespace filigree::cli {

/// What moves in an animated GLB. automatic: a skin where the model's code makes one, else morph targets.
enum class GlbMotion { automatic, skin, morph };

/// How an animation leaves.
struct AnimationOutput {
    GlbMotion glb = GlbMotion::automatic;
    bool no_normals = false, compress = false;
    std::optional<double> key_error; ///< of SkinOptions
    SkinOptions skin;                ///< its normals as no_normals says
    MorphOptions morph;
};

/// --as, --key-rate, --interpolation, --influences, --full-precision, --compress, --key-error, --all-levels,
/// --no-normals and --morph-normals.
OptionList animation_options(AnimationOutput& output);
/// The first of these options that was given; empty: none was.
std::string given_animation_option(const Session& session);

/// Whether a name stands for an animation: .pc2, .mdd, .usda, .glb, a folder (ends in '/' or is there) or
/// NAME_####.ply.
bool is_animation_path(const std::string& path);

/// Refuses, before any work, what cannot be written: an unknown ending, a folder that is not there, standard output.
void check_animation_path(const std::string& path);
/// Refuses options of animated GLB where none is written.
void check_animation_options(const std::vector<std::string>& paths, const Session& session);

/// Refuses an output that would go over an input, under whatever name, numbered meshes too. The first input names
/// meshes in an output folder.
void check_not_input(const std::string& output, const std::vector<std::string>& inputs);

/// --pose-up: of poses from a program with another axis up.
Option pose_up_option(PoseFileOptions& options);
/// --frame-rate, --animation and --pose-up: how a file of poses is read.
OptionList pose_file_options(PoseFileOptions& options);

/// The poses of a file, one frame in memory where it allows that, or the model's own, which `own` keeps.
FrameSource<Pose> poses_of(const std::string& poses, const PoseFileOptions& options, const Model& model,
                           const PoseSequence& own, const std::string& model_path, Session& session);

/// Restores one chunk of the frames into `path`, a .pc2 that other processes write too.
ChunkReport write_chunk_output(const Model& model, const FrameSource<Pose>& poses, const RestoreOptions& restore,
                               const WorkChunk& chunk, const std::string& path, Session& session);

/// Restores the poses into `path`, a .pc2, while the model stays in its file. Reports as write_animation_output.
void write_chunks_output(const ModelChunks& model, const FrameSource<Pose>& poses, const RestoreOptions& restore,
                         const std::string& path, Session& session, Report& report);

/// Writes a model's poses to `path`: .glb as a skin (or morph targets), everything else restored frame by frame, one in
/// memory at a time. Reports what was written. materials_beside: the model's or mesh's own path.
void write_animation_output(const Model& model, const FrameSource<Pose>& poses, const RestoreOptions& restore,
                            const AnimationOutput& output, const std::string& path, const std::string& materials_beside,
                            Session& session, Report& report);

/// The same for any mesh that moves: .glb as morph targets, everything else as it is.
void write_animation_output(const MeshAnimation& animation, const AnimationOutput& output, const std::string& path,
                            const std::string& materials_beside, Session& session, Report& report);

} // namespace filigree::cli
