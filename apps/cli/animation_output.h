// Animated outputs, which restore, deform, simulate and export share.
#pragma once

#include "session.h"

#include "filigree/hierarchy/restore.h"
#include "filigree/io/gltf_export.h"
#include "filigree/io/point_cache.h"

namespace filigree::cli {

/// How an animation leaves.
struct AnimationOutput {
    /// GLB: morph targets or a skin because --as says so; neither: a skin where the model's code makes one.
    bool as_morph = false, as_skin = false;
    SkinOptions skin;
    MorphOptions morph;
    std::vector<std::string> given; ///< the options' names, as the user wrote them
};

/// Adds --as, --key-rate, --interpolation, --influences, --full-precision, --all-levels, --no-normals and
/// --morph-normals.
void add_animation_options(CLI::App& command, AnimationOutput& output);

/// Whether a name stands for an animation: .pc2, .mdd, .usda, .glb, a folder (ends in '/' or is there) or
/// NAME_####.ply.
bool is_animation_path(const std::string& path);

/// Refuses, before any work, what cannot be written: an unknown ending, a folder that is not there, standard output.
void check_animation_path(const std::string& path);
/// Refuses options of animated GLB where none is written.
void check_animation_options(const AnimationOutput& output, const std::vector<std::string>& paths);

/// Refuses an output that would go over an input, under whatever name, numbered meshes too. The first input names
/// meshes in an output folder.
void check_not_input(const std::string& output, const std::vector<std::string>& inputs);

/// Adds --frame-rate and --animation: how a file of poses is read.
void add_pose_file_options(CLI::App& command, PoseFileOptions& options);

/// The poses of a file, one frame in memory where it allows that, or the model's own, which `own` keeps.
PoseStream poses_of(const std::string& poses, const PoseFileOptions& options, const Model& model,
                    const PoseSequence& own, const std::string& model_path, Session& session);

/// Writes a model's poses to `path`: .glb as a skin (or morph targets), everything else restored frame by frame, one in
/// memory at a time. Adds rows and keys that say what was written. materials_beside: the model's or mesh's own path.
void write_animation_output(const Model& model, const PoseStream& poses, const RestoreOptions& restore,
                            const AnimationOutput& output, const std::string& path, const std::string& materials_beside,
                            Session& session, Table& table, Json& json);

/// The same for any mesh that moves: .glb as morph targets, everything else as it is.
void write_animation_output(const MeshAnimation& animation, const AnimationOutput& output, const std::string& path,
                            const std::string& materials_beside, Session& session, Table& table, Json& json);

} // namespace filigree::cli
