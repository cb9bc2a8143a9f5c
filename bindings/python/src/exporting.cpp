#include "models.h"

#include <filigree/file.h>
#include <filigree/io/animation/point_cache.h>

namespace filigree::python {

namespace {

namespace fs = std::filesystem;

/// What `export` does with an animation.
struct ExportOptions {
    bool as_skin = true;
    SkinOptions skin;
    MorphOptions morph;
};

py::dict said_of(const ExportReport& report, bool is_skin) {
    py::dict said;
    said["as"] = is_skin ? "skin" : "morph";
    said["bytes"] = report.bytes;
    said["vertices"] = report.vertices;
    said["joints"] = report.joints;
    said["keys"] = report.keys;
    said["seconds"] = report.seconds;
    said["error_at_keys"] = report.error_at_keys;
    said["error_between_keys"] = report.error_between_keys;
    said["rms_at_keys"] = report.rms_at_keys;
    said["rms_between_keys"] = report.rms_between_keys;
    said["moments_checked"] = report.moments_checked;
    said["normal_error_degrees"] = report.normal_error_degrees;
    return said;
}

py::dict said_of(std::size_t frames, double frames_per_second, std::size_t vertices) {
    py::dict said;
    said["frames"] = frames;
    said["frames_per_second"] = frames_per_second;
    said["vertices"] = vertices;
    return said;
}

/// Every frame by a function, into whatever the path names.
py::dict write_moving(const MeshAnimation& animation, const fs::path& path, const MorphOptions& morph,
                      const LongCall& call) {
    if (animation_format(path).value() == AnimationFormat::glb) {
        const ExportReport report =
            call([&](const RunContext& context) { return write_morph_glb(animation, morph, path, context).value(); });
        warn(report.warnings);
        return said_of(report, false);
    }
    warn(call([&](const RunContext& context) { return write_animation(animation, path, context).value(); }));
    return said_of(animation.frames, animation.frames_per_second, animation.rest->vertex_count());
}

py::dict export_poses(const Model& model, const PoseSequence& poses, const ExportOptions& options, const fs::path& path,
                      const LongCall& call) {
    const FrameSource<Pose> stream = frames_of(poses);
    const AnimationFormat format = animation_format(path).value();
    if (format == AnimationFormat::glb && options.as_skin) {
        const ExportReport report = call([&](const RunContext& context) {
            return write_skin_glb(model, stream, options.skin, path, context).value();
        });
        warn(report.warnings);
        return said_of(report, true);
    }
    const RunContext& silent = short_context(call.threads);
    const Restorer restorer =
        without_interpreter([&] { return Restorer::create(model, options.skin.restore, silent).value(); });
    if (format == AnimationFormat::numbered) {
        const auto mesh = [&](std::size_t frame) { return restorer.mesh(poses.frames[frame], silent); };
        warn(call([&](const RunContext& context) {
            return write_numbered_meshes({poses.frames.size(), poses.frames_per_second, mesh}, path, context).value();
        }));
        return said_of(poses.frames.size(), poses.frames_per_second, restorer.vertex_count());
    }
    const Mesh rest = level_mesh(model, restored_level(model, options.skin.restore).value());
    const MeshAnimation animation{&rest, poses.frames.size(), poses.frames_per_second,
                                  [&](std::size_t frame, std::span<Vec3f> positions) {
                                      return restorer.positions(poses.frames[frame], positions, silent);
                                  }};
    return write_moving(animation, path, options.morph, call);
}

py::dict export_model(const PyModel& self, const fs::path& path, const py::object& poses, double frames_per_second,
                      const std::optional<std::string>& as, std::optional<double> key_rate,
                      const std::string& interpolation, unsigned influences, bool full_precision, bool compress,
                      double key_error, bool all_levels, bool normals, bool morph_normals,
                      std::optional<unsigned> level, const fs::path& materials_beside, unsigned threads,
                      const py::object& progress) {
    const Model& model = *self.model;
    const LongCall call{threads, progress};
    if (poses.is_none()) {
        if (animation_format(path).value() != AnimationFormat::glb)
            refuse(ErrorCode::unsuitable, "A model at rest goes to .glb; give poses for " + path.string() + ".");
        warn(call([&](const RunContext& context) {
            return write_levels_glb(model, path, materials_beside, context).value();
        }));
        py::dict said;
        said["levels"] = model.finest_level() + 1;
        said["vertices"] = model.vertex_count();
        said["bytes"] = fs::file_size(path);
        return said;
    }
    ExportOptions options;
    options.as_skin = !as || value_of<bool>(*as, "motion", {{"skin", true}, {"morph", false}});
    options.skin.restore.level = level;
    options.skin.key_rate = key_rate;
    options.skin.interpolation = value_of<KeyInterpolation>(
        interpolation, "interpolation", {{"linear", KeyInterpolation::linear}, {"cubic", KeyInterpolation::cubic}});
    if (influences != 3 && influences != 6) refuse("influences has to be 3 or 6.");
    options.skin.influences = influences;
    options.skin.full_precision = full_precision;
    options.skin.compress = options.morph.compress = compress;
    options.skin.key_error = key_error;
    options.skin.all_levels = all_levels;
    options.skin.normals = options.morph.normals = normals ? ExportNormals::keep : ExportNormals::leave;
    options.morph.morph_normals = morph_normals;
    options.skin.materials_beside = options.morph.materials_beside = materials_beside;
    return export_poses(model, poses_of(poses, frames_per_second), options, path, call);
}

/// Positions of shape (f, n, 3), in the world.
py::dict write_positions(const py::object& given, const py::object& positions, const fs::path& path,
                         double frames_per_second, bool morph_normals, unsigned threads, const py::object& progress) {
    const MeshPtr mesh = mesh_of(given);
    if (!(frames_per_second > 0)) refuse("frames_per_second has to be above 0.");
    const Numbers<double> numbers = doubles_of(positions, "positions");
    const std::size_t count = mesh->vertex_count();
    if (numbers.ndim() != 3 || numbers.shape(1) != static_cast<py::ssize_t>(count) || numbers.shape(2) != 3)
        refuse(ErrorCode::mismatch,
               "positions has to be of shape (frames, " + std::to_string(count) + ", 3): one a vertex of the mesh.");
    const double* data = numbers.data();
    const MeshAnimation animation{
        mesh.get(), static_cast<std::size_t>(numbers.shape(0)), frames_per_second,
        [&](std::size_t frame, std::span<Vec3f> out) -> Status {
            const double* from = data + 3 * count * frame;
            for (std::size_t i = 0; i < count; ++i)
                out[i] = (Vec3d(from[3 * i], from[3 * i + 1], from[3 * i + 2]) - mesh->origin).cast<float>();
            return Success{};
        }};
    return write_moving(animation, path, {.morph_normals = morph_normals}, LongCall{threads, progress});
}

} // namespace

void add_exporting(py::module_& m) {
    m.def(
        "export", &export_model, py::arg("model"), py::arg("path"), py::arg("poses") = py::none(), py::kw_only(),
        py::arg("frames_per_second") = 60.0, py::arg("motion") = py::none(), py::arg("key_rate") = py::none(),
        py::arg("interpolation") = "linear", py::arg("influences") = 3, py::arg("full_precision") = false,
        py::arg("compress") = false, py::arg("key_error") = 1e-5, py::arg("all_levels") = false,
        py::arg("normals") = true, py::arg("morph_normals") = false, py::arg("level") = py::none(),
        py::arg("materials_beside") = "", py::arg("threads") = 0, py::arg("progress") = py::none(),
        R"(export(model, path, poses=None, *, frames_per_second=60.0, motion=None, key_rate=None, interpolation='linear', influences=3, full_precision=False, compress=False, key_error=1e-05, all_levels=False, normals=True, morph_normals=False, level=None, materials_beside='', threads=0, progress=None)
--

Write a model, moving or at rest, for other programs.

Parameters
----------
model : Model
path : path
    .glb, .pc2, .mdd, .usda, or NAME_####.ply; at rest .glb alone, with all levels.
poses : PoseSequence, array_like (f, d, 3), or sequence of Pose, optional
    None: at rest.
frames_per_second : float
    Of poses that are no PoseSequence.
motion : str, optional
    GLB: 'skin', one joint a driver vertex, or 'morph', every frame's positions. None: a skin.
key_rate : float, optional
    Skin: keys a second; None: one a frame.
interpolation : str
    Skin: 'linear', or 'cubic', which needs fewer keys, but Blender ignores it.
influences : int
    Skin: 3 joints a vertex, which plays in everything, or 6.
full_precision, all_levels : bool
    Skin: float rotations and weights; coarser levels too.
compress : bool
    GLB: packed with EXT_meshopt_compression and KHR_mesh_quantization, which viewers have to know.
key_error : float
    Skin with compress: how far rounded and fewer keys may move a vertex at a key, fraction of the diagonal.
normals : bool
    GLB: False leaves them out, and viewers shade flat.
morph_normals : bool
    Morph targets: normals of each frame too.
level : int, optional
    Restore up to this level; None: the finest.
materials_beside : path
    Where material libraries are looked for: the mesh's own path.

Returns
-------
dict
    What was written, and for GLB how far the file is from our own restore.

Raises
------
UnsuitableError, MismatchError, UsageError, UnwritableError, UnsupportedError, OutOfMemoryError, Cancelled

Examples
--------
>>> model = filigree.strip(filigree.make("bar", resolution=8))
>>> poses = [filigree.bend(model, "x", degrees)(model) for degrees in range(0, 90, 30)]
>>> filigree.export(model, "bar.glb", poses)["keys"]
3
)");
    m.def(
        "write_animation", &write_positions, py::arg("mesh"), py::arg("positions"), py::arg("path"), py::kw_only(),
        py::arg("frames_per_second") = 60.0, py::arg("morph_normals") = false, py::arg("threads") = 0,
        py::arg("progress") = py::none(),
        R"(write_animation(mesh, positions, path, *, frames_per_second=60.0, morph_normals=False, threads=0, progress=None)
--

Write a mesh that moves: a point cache (.pc2, .mdd), .usda, morph targets (.glb) or numbered meshes (NAME_####.ply).

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
positions : array_like, (f, n, 3)
    World coordinates of its vertices, frame by frame.
path : path
frames_per_second : float
    Above 0.
morph_normals : bool
    Morph targets: normals of each frame too.

Raises
------
MismatchError
    Another number of vertices.
UnsuitableError, UnwritableError, UnsupportedError, OutOfMemoryError, Cancelled
)");
}

} // namespace filigree::python
