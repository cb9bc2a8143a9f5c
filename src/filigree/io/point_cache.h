// Point caches: positions of a mesh's vertices, frame after frame, without its faces. PC2, MDD, numbered meshes.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/core/view.h"
#include "filigree/hierarchy/pose.h"
#include "filigree/io/numbered_name.h"
#include "filigree/io/shared_work.h"
#include "filigree/mesh/mesh_animation.h"

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

enum class AnimationFormat {
    pc2,      ///< .pc2 (PointCache 2): little-endian float
    mdd,      ///< .mdd (Motion Designer): big-endian float, with times
    numbered, ///< a folder of NAME_0001.ply and so on, or a path with #### for the number
    usda,     ///< .usda, text with time samples: for small cases
    glb,      ///< .glb, morph targets
};

/// The format that an output's or input's name stands for: its extension, a folder (ends in '/' or is there), or ####
/// or %04d before a mesh's extension. Errors: unsupported, with the list.
Result<AnimationFormat> animation_format(const std::filesystem::path& path);

/// The files that are there under such a name: itself, those of a numbered sequence, or all in a folder.
std::vector<std::filesystem::path> animation_files(const std::filesystem::path& path);

struct PoseFileOptions {
    /// Of files that do not say (PC2, numbered; unset: 60), and instead of what an MDD or a .fil says. A PC2's sample
    /// rate divides it. glTF: frames to take a second.
    std::optional<double> frames_per_second = {};
    std::string animation = {}; ///< glTF: by name; empty: the first
    /// Which of y and z is up in the file, where it is the other one in the model: what is read is turned.
    std::optional<UpAxis> up = {};
    /// The driver at rest, relative to the mesh's origin. With it, vertices of glTF and numbered meshes that were split
    /// for normals or UVs, or are in another order, are matched by their places at rest (of a sequence: in its first
    /// mesh). They have to stay together in every frame, else fetching one is a mismatch. Looked at when opened.
    std::span<const Vec3f> rest = {};
    /// Gets what was matched so, and that the first frame is the driver turned over.
    std::vector<std::string>* warnings = nullptr;
};

/// Poses of a driver that another program moved, opened for reading frame by frame: PC2, MDD, numbered meshes (with
/// gradients where a PLY has f00 .. f22), an animated glTF sampled at the frame rate, or the poses of a .fil. Sizes are
/// held against the file's length when it is opened; only one frame is in memory (a .fil: all). An MDD whose times are
/// not even needs a rate. Of numbered meshes the first is looked at; the others must be as many points and have
/// gradients as it has, which is found when they are fetched.
/// points: the driver's vertices; origin: the mesh's. Errors: not_found, bad_file, mismatch (other number of points),
/// unsupported (pipes too: frames are fetched in any order), usage (no such animation, several sequences in a folder).
Result<FrameSource<Pose>> open_poses(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                                     const PoseFileOptions& options, const RunContext& context);

/// Any of those as the animation of `rest`, which must outlive it and is not checked.
Result<MeshAnimation> open_animation(const std::filesystem::path& path, const Mesh& rest,
                                     const PoseFileOptions& options, const RunContext& context);

/// Writes every frame, one in memory at a time, whole or not at all. Point caches hold world coordinates (the origin is
/// added) in 32-bit floats, and a warning says when that loses digits; USD and glTF have a place for the origin.
/// Numbered meshes are PLY in a folder (under its name), or what the
/// #### name ends in, counted from 1; they have the rest's attributes, and where it has normals, normals of their own.
/// They replace files, whose permissions they keep, but no symbolic links: all or none, also when the process is killed
/// (io/file_batch.h). A sequence whose placing was interrupted is not read until it is written again.
/// Same errors as write_mesh, unsuitable (a position that is not finite; no frames), and cancelled. Cost: writing;
/// memory one frame.
Result<std::vector<std::string>> write_animation(const MeshAnimation& animation, const std::filesystem::path& path,
                                                 const RunContext& context);

struct ChunkReport {
    std::size_t first_frame = 0, frames = 0; ///< of this chunk
    bool was_done = false;                   ///< before: nothing was written
    std::size_t chunks_done = 0;             ///< of all, this one too
    bool is_whole = false;                   ///< the file is in its place
};

/// Writes a chunk's frames into a .pc2 (frames are shared out evenly). The frames of all gather in the folder
/// PATH.chunks; whoever writes the last one puts the file into its place and removes the folder. PATH.plan says what
/// the file is made of, and stays. Each chunk may be written again, at the same time too: it writes the same bytes. A
/// process that is killed at any moment leaves a chunk to be written again, and what stood at `path` as it was.
/// Errors: usage (a number beyond the count, a name that does not end in .pc2), mismatch (another job is at work
/// there), unsuitable, unwritable, cancelled. Cost: the chunk's frames; memory one frame.
Result<ChunkReport> write_animation_chunk(const MeshAnimation& animation, const std::filesystem::path& path,
                                          const WorkChunk& chunk, const RunContext& context);

/// Writes numbered meshes as write_animation does, of any faces: each frame is a mesh of its own.
Result<std::vector<std::string>> write_numbered_meshes(const FrameSource<Mesh>& meshes,
                                                       const std::filesystem::path& path, const RunContext& context);
/// Meshes that are numbered under one name.
struct NumberedMeshes {
    NumberedName name;
    FrameSource<Mesh> meshes;
};
/// Writes several sequences side by side into one folder, all or none. parts: one or more, all with the first one's
/// folder and number of frames.
Result<std::vector<std::string>> write_numbered_meshes(std::span<const NumberedMeshes> parts,
                                                       const RunContext& context);

/// A mesh as it is at one moment.
struct MeshMoment {
    Mesh mesh;
    std::vector<Vec3f> velocities; ///< model units a second, one a vertex; or none
};

/// Writes a .usda whose faces change in time: for every frame points, extent, faces, normals, colours, velocities, and
/// the mesh's scalar `origin` as a primvar where they are there; in metres (metersPerUnit = 1). moments: each
/// is asked for once and in order. One frame in memory; as much room as the file again beside it while it
/// is written. Whole or not at all. Errors: unsuitable (no frames; a frame lacks what the first has), unwritable,
/// cancelled, and what `moments` gives.
Status write_usda_moments(const FrameSource<MeshMoment>& moments, const std::filesystem::path& path,
                          std::vector<std::string>& warnings, const RunContext& context);

/// The same as a .glb of key frames, which any viewer of glTF plays: about so many keys a second, each a node that is
/// scaled to nothing but from its time to the next one's. The first and the last frame are among them. moments: as
/// above. asset.extras.filigree says {"export": "key frames", "keys", "seconds"}. All keys are in memory. Errors: usage
/// (keys_per_second), unsuitable, unwritable, unsupported (4 GiB), out_of_memory, cancelled, and what `moments` gives.
Status write_glb_moments(const FrameSource<MeshMoment>& moments, double keys_per_second,
                         const std::filesystem::path& path, const RunContext& context);

} // namespace filigree
