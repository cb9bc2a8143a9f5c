// Files: meshes (OBJ, PLY, STL, OFF, glTF), models (.fil), animations (PC2, MDD, USD, glTF, numbered meshes).
//
//     const MeshFile file = read_mesh("scan.ply").value();
//     write_model(model, "scan.fil");
//     write_mesh(restored, "bent.obj");
//
// Nothing in a file is trusted. A file is written beside its place and then renamed, so `path` is whole or unchanged.
// What a format cannot hold comes back as warnings, one sentence each. "-" is standard input or output where a function
// says so.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Names and bytes

/// The path that a text in UTF-8 names. Needed on Windows, where std::filesystem::path takes the bytes of a
/// std::string for characters of the C locale; elsewhere the bytes are kept as they are.
std::filesystem::path path_of(std::string_view utf8);

/// The bytes of a file; "-" is standard input. Errors: not_found (missing, a directory, no permission), out_of_memory.
Result<std::string> read_file(const std::filesystem::path& path);

/// Replaces a file. `path` is unchanged after an error, and when the process dies on the way. "-" is standard output.
/// Devices and pipes are written in place. Symbolic links are followed; an existing file keeps its permissions. Errors:
/// unwritable.
Status write_file(const std::filesystem::path& path, std::string_view bytes);

// ---------------------------------------------------------------------------------------------------------------------
// Meshes

enum class MeshFormat { obj, ply, stl, off, gltf };

/// A mesh, and one sentence for each thing that was left out or repaired.
struct MeshFile {
    Mesh mesh;
    std::vector<std::string> warnings;
};

/// What a program says of a format: in messages, in file dialogs.
struct MeshFormatInfo {
    MeshFormat format;
    std::string_view name;            ///< "PLY"
    std::string_view extension;       ///< ".ply": of a file that is written
    std::string_view other_extension; ///< ".gltf": is read only; empty: none
};

/// All formats, in the order in which programs list them.
std::span<const MeshFormatInfo> mesh_formats();

/// The format that the extension of a path names (any case). Errors: unsupported, with the list of formats.
Result<MeshFormat> mesh_format(const std::filesystem::path& path);

/// Reads a mesh; "-" is standard input. The content decides about the format, or the extension where it cannot.
/// Vertices and faces keep the order of the file. A file without faces gives points and a warning. The mesh passes
/// check_mesh. Cost: one pass; memory a small multiple of the file. Errors: not_found, bad_file ("cow.obj:214: ..."),
/// unsupported, out_of_memory, cancelled.
Result<MeshFile> read_mesh(const std::filesystem::path& path, const RunContext& context = RunContext());

/// Reads a mesh from bytes. name: for messages; its extension counts where the content does not tell the format.
/// Errors: bad_file, unsupported, out_of_memory, cancelled.
Result<MeshFile> read_mesh(std::string_view bytes, const std::string& name, const RunContext& context = RunContext());

struct WriteMeshOptions {
    std::optional<MeshFormat> format = std::nullopt; ///< unset: by the extension of the path
    bool ascii = false;                              ///< PLY, STL: text instead of binary
    bool big_endian = false;                         ///< PLY: binary with the most significant byte first
    /// GLB: the path that the mesh came from. Material libraries and textures beside it are embedded. Empty: none.
    std::filesystem::path materials_beside = {};
};

/// Writes a mesh; "-" is standard output and needs options.format. Embedded materials go beside an OBJ x.obj as x.mtl
/// and x_NAME.png or .jpg; they do not replace files of others (x_2.mtl). Returns warnings: one sentence that lists
/// what the format cannot hold, and one for each texture that is missing. Errors: unsuitable (check_mesh refuses the
/// mesh: deformed too far), unsupported, unwritable, out_of_memory, cancelled.
Result<std::vector<std::string>> write_mesh(const Mesh& mesh, const std::filesystem::path& path,
                                            const WriteMeshOptions& options = {},
                                            const RunContext& context = RunContext());
/// Writes a mesh into `bytes`, in the given format (options.format does not count). Returns the same warnings. Errors:
/// usage (check_mesh refuses the mesh), unsupported, out_of_memory, cancelled.
Result<std::vector<std::string>> write_mesh(const Mesh& mesh, MeshFormat format, std::string& bytes,
                                            const WriteMeshOptions& options = {},
                                            const RunContext& context = RunContext());

// ---------------------------------------------------------------------------------------------------------------------
// Models

/// Whether these are the first bytes of a model file (.fil, docs/fil-format.md).
bool is_model_file(std::string_view bytes);

/// Reads a model, plain or packed; "-" is standard input. Sizes are compared with the length of the file before memory
/// is allocated (packed parts may have 1,024 times its bytes, or 256 MiB); every section has a checksum; the model
/// passes check_model. Errors: not_found, bad_file (truncated, damaged, of another version, not a model), unsuitable (a
/// file of the reference code), out_of_memory, cancelled.
Result<Model> read_model(const std::filesystem::path& path, const RunContext& context = RunContext());
/// Reads a model from bytes. name: for messages.
Result<Model> read_model(std::string_view bytes, const std::string& name, const RunContext& context = RunContext());

/// The poses in a model file; no frames where it has none. Errors: those of read_model.
Result<PoseSequence> read_poses(const std::filesystem::path& path, const RunContext& context = RunContext());
/// Reads poses from bytes. name: for messages.
Result<PoseSequence> read_poses(std::string_view bytes, const std::string& name,
                                const RunContext& context = RunContext());

/// Writes a model; "-" is standard output. The same model gives the same bytes. Smaller files: pack.h. Errors:
/// unwritable, out_of_memory, cancelled.
Status write_model(const Model& model, const std::filesystem::path& path, const RunContext& context = RunContext());
/// The bytes of the file.
std::string write_model(const Model& model);

/// Writes a model with poses of its driver. Errors: mismatch (a pose of another number of vertices; gradients in some
/// frames only; a number that is not finite; a rate that is not above 0), unwritable, out_of_memory, cancelled.
Status write_model(const Model& model, const PoseSequence& poses, const std::filesystem::path& path,
                   const RunContext& context = RunContext());
/// The bytes of the file. The poses are not checked.
std::string write_model(const Model& model, const PoseSequence& poses);

// ---------------------------------------------------------------------------------------------------------------------
// Animations

/// A mesh whose vertices move. Positions of a frame are written where the caller wants them: memory for one frame.
struct MeshAnimation {
    const Mesh* rest = nullptr; ///< faces, attributes, and the origin of all positions
    std::size_t frames = 0;
    double frames_per_second = 60;
    /// Writes the positions of frame 0 .. frames - 1, one a vertex, relative to rest->origin. Frames may be asked for
    /// in any order, and more than once.
    std::function<Status(std::size_t frame, std::span<Vec3f> positions)> positions;
    double metres_per_unit = 0; ///< 0: unknown. Formats that have a place for it say it
};

enum class AnimationFormat {
    pc2,      ///< .pc2 (PointCache 2): little-endian float
    mdd,      ///< .mdd (Motion Designer): big-endian float, with times
    numbered, ///< a folder of NAME_0001.ply and so on, or a path with #### for the number
    usda,     ///< .usda, text with time samples: for small cases
    glb,      ///< .glb, morph targets
};

/// The format that a path names: by its extension; numbered where it ends in '/', is a folder, or has #### or %04d
/// before the extension of a mesh. Errors: unsupported, with the list of formats.
Result<AnimationFormat> animation_format(const std::filesystem::path& path);

struct PoseFileOptions {
    /// The rate of files that do not say one (PC2, numbered; unset: 60), and instead of the rate of an MDD or a .fil. A
    /// PC2's sample rate divides it. glTF, USD: how many frames a second to take.
    std::optional<double> frames_per_second = {};
    std::string animation = {}; ///< glTF: name of the animation; empty: the first
    /// The axis that is up in the file, y or z, where it is the other one in the model: poses are turned.
    std::optional<Axis> up = {};
    /// The driver at rest, relative to the mesh's origin. With it, vertices of glTF and numbered meshes that were split
    /// for normals or UVs, or are in another order, are matched by their positions at rest (numbered: in the first
    /// mesh). Copies have to stay together in every frame; if not, fetching that frame is a mismatch.
    std::span<const Vec3f> rest = {};
    /// If given, gets sentences: what was matched, and that the first frame is the driver lying on its face.
    std::vector<std::string>* warnings = nullptr;
};

/// Opens poses of a driver that another program moved: PC2, MDD, numbered meshes (with gradients where a PLY has f00 ..
/// f22), an animated glTF, USD text, or the poses of a .fil. Frames are read when they are asked for; one is in memory
/// (.fil: all). An MDD with uneven times needs a frame rate. Numbered meshes after the first are checked when they are
/// fetched. points: number of the driver's vertices. origin: the mesh's. Errors: not_found, bad_file, mismatch (another
/// number of points), unsupported (also a pipe), usage (no such animation; several sequences in a folder).
Result<FrameSource<Pose>> open_poses(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                                     const PoseFileOptions& options = {}, const RunContext& context = RunContext());

/// Opens any of these as the animation of `rest`, which must outlive the result and is not checked. Errors: those of
/// open_poses.
Result<MeshAnimation> open_animation(const std::filesystem::path& path, const Mesh& rest,
                                     const PoseFileOptions& options = {}, const RunContext& context = RunContext());

/// Writes all frames, or nothing. Point caches hold world coordinates (the origin is added) in 32-bit floats; a warning
/// says when digits are lost. USD and glTF have a place for the origin. Numbered meshes are PLY, or the format after
/// ####, and count from 1; they have the attributes of `rest`, and normals of their own where it has normals. They
/// replace files but no symbolic links, all or none, also when the process is killed. Memory: one frame. Returns
/// warnings. Errors: those of write_mesh; unsuitable (a position that is not finite; no frames), cancelled.
Result<std::vector<std::string>> write_animation(const MeshAnimation& animation, const std::filesystem::path& path,
                                                 const RunContext& context = RunContext());

/// Writes numbered meshes, of any faces: every frame is a mesh of its own. Otherwise like write_animation.
Result<std::vector<std::string>> write_numbered_meshes(const FrameSource<Mesh>& meshes,
                                                       const std::filesystem::path& path,
                                                       const RunContext& context = RunContext());

/// A mesh whose faces change in time, at one moment.
struct MeshMoment {
    Mesh mesh;
    std::vector<Vec3f> velocities; ///< model units a second: one a vertex, or empty
};

/// Writes a .usda whose faces change in time: for every frame points, extent, faces, normals, and colours, velocities
/// and the scalar `origin` (as a primvar) where the mesh has them; in metres. Each frame is asked for once and in
/// order. Memory: one frame; the disk needs room for the file twice. Whole or not at all. Adds to `warnings`. Errors:
/// unsuitable (no frames; a frame lacks what the first has), unwritable, cancelled, and those of `moments`.
Status write_usda_moments(const FrameSource<MeshMoment>& moments, const std::filesystem::path& path,
                          std::vector<std::string>& warnings, const RunContext& context = RunContext());

/// Writes a .glb of key frames that every viewer of glTF plays: each key is a mesh that is scaled to nothing except
/// between its time and the next key's. keys_per_second: about; the first and the last frame are among the keys. The
/// file says {"export": "key frames", "keys", "seconds"} in asset.extras.filigree. Memory: all keys. Errors: usage
/// (keys_per_second), unsuitable (no frames), unwritable, unsupported (4 GiB), out_of_memory, cancelled, and those of
/// `moments`.
Status write_glb_moments(const FrameSource<MeshMoment>& moments, double keys_per_second,
                         const std::filesystem::path& path, const RunContext& context = RunContext());

// ---------------------------------------------------------------------------------------------------------------------
// Animated glTF

enum class ExportNormals {
    keep,  ///< the mesh's own, or computed from its faces
    leave, ///< none: viewers shade flat, which stays right when the mesh is stretched
};

/// What an exported file holds, and how far it is from Filigree's own result when a viewer plays it.
struct ExportReport {
    std::size_t bytes = 0, vertices = 0, joints = 0, keys = 0;
    double seconds = 0; ///< length of the animation
    /// Largest and rms distance between the file, played by a viewer, and our restored mesh; fractions of the diagonal
    /// at the first key. Between keys: at the frames of the poses, or half way where there are no frames between keys.
    double error_at_keys = 0, error_between_keys = 0;
    double rms_at_keys = 0, rms_between_keys = 0;
    std::size_t moments = 0;         ///< keys, and moments between them
    std::size_t moments_checked = 0; ///< of these, how many were measured: all, unless there are very many
    /// How far normals are off in viewers that turn them with the skin matrix (three.js, Babylon.js), degrees: the 95th
    /// percentile over driver vertices and keys of atan r - atan(1/r), where r is the stretch ratio.
    double normal_error_degrees = 0;
    std::vector<std::string> warnings;
};

struct MorphOptions {
    ExportNormals normals = ExportNormals::keep;
    bool morph_normals = false; ///< normals for every frame too: right shading, twice the size
    bool compress = false;      ///< EXT_meshopt_compression and KHR_mesh_quantization; the whole file is in memory then
    std::filesystem::path materials_beside = {}; ///< path of the mesh: material libraries are looked for beside it
};

/// Writes any mesh animation as morph targets, one a frame. Memory: a few frames. Errors: unsuitable (no frames),
/// unwritable, unsupported (4 GiB), out_of_memory, cancelled, and those of the animation.
Result<ExportReport> write_morph_glb(const MeshAnimation& animation, const MorphOptions& options,
                                     const std::filesystem::path& path, const RunContext& context = RunContext());

enum class KeyInterpolation { linear, cubic };

struct SkinOptions {
    RestoreOptions restore = {};
    /// Keys a second; unset: the rate of the poses. Poses between frames are interpolated linearly.
    std::optional<double> key_rate = {};
    KeyInterpolation interpolation = KeyInterpolation::linear; ///< Blender ignores cubic
    /// 3: plays everywhere; the rest shape has its detail doubled. 6: one joint more for each edge of the driver, and
    /// the true rest shape; for Blender (three.js drops the last two influences).
    unsigned influences = 3;
    bool full_precision = false; ///< float rotations and weights; else int16 and uint16, 3e-6 of the diagonal
    bool compress = false;       ///< EXT_meshopt_compression and KHR_mesh_quantization, which viewers have to know
    /// With compress, linear keys and without full_precision: how far a vertex may be moved at a key by rounding the
    /// keys and leaving keys out, fraction of the driver's diagonal; above 0, at most 0.1.
    double key_error = 1e-5;
    bool all_levels = false; ///< coarser levels too, as MSFT_lod, on the same joints
    ExportNormals normals = ExportNormals::keep;
    std::filesystem::path materials_beside = {}; ///< path of the mesh or model: libraries are looked for beside it
    /// Path of a glTF whose nodes, without their meshes, and cameras are put beside the skin, with what its animations
    /// of the same names do to them: sockets and programs that ask for its joints go on. Empty: none.
    std::filesystem::path skeleton_of = {};
};

/// Writes a model's animation as a plain glTF 2.0 skin (docs/exchange.md), without extensions; the mesh is at rest
/// while nothing plays. The error is measured on the bytes of the file and stored in asset.extras.filigree. Cost: a few
/// restores a key. Memory: the file once, and what its reader makes of it. Errors: unsuitable (no frames), mismatch (a
/// pose of another driver), usage (level, rates), unwritable, unsupported (4 GiB), out_of_memory, cancelled.
Result<ExportReport> write_skin_glb(const Model& model, const FrameSource<Pose>& poses, const SkinOptions& options,
                                    const std::filesystem::path& path, const RunContext& context = RunContext());

/// Writes the levels of a model at rest as nodes that MSFT_lod names, finest first: programs choose by the size on the
/// screen. materials_beside: path of the mesh or model; libraries are looked for beside it. Returns warnings. Errors:
/// unwritable, unsupported (4 GiB), out_of_memory, cancelled.
Result<std::vector<std::string>> write_levels_glb(const Model& model, const std::filesystem::path& path,
                                                  const std::filesystem::path& materials_beside,
                                                  const RunContext& context = RunContext());

} // namespace filigree
