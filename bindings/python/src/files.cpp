#include "models.h"

#include <filigree/file.h>
#include <filigree/io/animation/point_cache.h>
#include <filigree/io/model/model_file.h>

namespace filigree::python {

namespace {

namespace fs = std::filesystem;

/// "-" is the program's standard input and output, and Python has its own.
void refuse_pipe(const fs::path& path) {
    if (path == "-") refuse("'-' is standard input or output for the program alone; give a file's name.");
}

MeshPtr read_mesh_file(const fs::path& path, unsigned threads, const py::object& progress) {
    refuse_pipe(path);
    MeshFile file =
        LongCall{threads, progress}([&](const RunContext& context) { return read_mesh(path, context).value(); });
    warn(file.warnings);
    return std::make_shared<Mesh>(std::move(file.mesh));
}

std::optional<MeshFormat> format_of(const std::optional<std::string>& name) {
    if (!name) return {};
    std::vector<std::pair<std::string_view, MeshFormat>> words;
    for (const MeshFormatInfo& info : mesh_formats())
        for (const std::string_view extension : {info.extension, info.other_extension})
            if (!extension.empty()) words.emplace_back(extension.substr(1), info.format);
    return value_of<MeshFormat>(*name, "format", words);
}

void write_mesh_file(const py::object& given, const fs::path& path, const std::optional<std::string>& format,
                     bool ascii, bool big_endian, const fs::path& materials_beside, unsigned threads,
                     const py::object& progress) {
    refuse_pipe(path);
    const MeshPtr mesh = mesh_of(given);
    const WriteMeshOptions options{format_of(format), ascii, big_endian, materials_beside};
    warn(LongCall{threads, progress}(
        [&](const RunContext& context) { return write_mesh(*mesh, path, options, context).value(); }));
}

PyModel read_model_file(const fs::path& path, unsigned threads, const py::object& progress) {
    refuse_pipe(path);
    return {LongCall{threads, progress}(
        [&](const RunContext& context) { return std::make_shared<const Model>(read_model(path, context).value()); })};
}

void write_model_file(const PyModel& model, const fs::path& path, const py::object& poses, unsigned threads,
                      const py::object& progress) {
    refuse_pipe(path);
    const PoseSequence sequence = poses.is_none() ? PoseSequence{} : poses_of(poses, 60);
    LongCall{threads, progress}(
        [&](const RunContext& context) { return write_model(*model.model, sequence, path, context).value(); });
}

py::dict pack_model_file(const PyModel& model, const fs::path& path, unsigned bits, bool surface, bool keep_order,
                         const std::string& profile, const py::object& poses, unsigned threads,
                         const py::object& progress) {
    refuse_pipe(path);
    const PoseSequence sequence = poses.is_none() ? PoseSequence{} : poses_of(poses, 60);
    enum class Profile { compact, stream, runtime, lossless };
    const auto chosen = value_of<Profile>(profile, "profile",
                                          {{"compact", Profile::compact},
                                           {"stream", Profile::stream},
                                           {"runtime", Profile::runtime},
                                           {"lossless", Profile::lossless}});
    const PackReport report = LongCall{threads, progress}([&](const RunContext& context) {
        if (chosen == Profile::lossless)
            return PackReport{.bytes = pack_model_lossless(*model.model, sequence, path, context).value().bytes};
        const PackOptions options{bits, surface, keep_order, chosen == Profile::stream, chosen == Profile::runtime};
        return pack_model(*model.model, sequence, options, path, context).value();
    });
    const double diagonal = world_bounds(model.model->mesh).diagonal();
    py::dict said, bytes;
    said["rms"] = diagonal > 0 ? report.rms / diagonal : 0.0;
    said["max"] = diagonal > 0 ? report.largest / diagonal : 0.0;
    bytes["connectivity"] = report.bytes.connectivity;
    bytes["places"] = report.bytes.places;
    bytes["attributes"] = report.bytes.attributes;
    bytes["order"] = report.bytes.order;
    bytes["levels"] = report.bytes.levels;
    bytes["refinements"] = report.bytes.refinements;
    bytes["clips"] = report.bytes.clips;
    bytes["driver"] = report.bytes.driver;
    bytes["records"] = report.bytes.records;
    said["bytes"] = bytes;
    return said;
}

PoseSequence read_pose_file(const fs::path& path, const py::object& model, std::optional<double> frames_per_second,
                            const std::string& animation, const std::string& up, unsigned threads,
                            const py::object& progress) {
    const LongCall call{threads, progress};
    if (!up.empty() && up != "y" && up != "z")
        throw BadResultAccess({ErrorCode::usage, "up is 'y' or 'z', of files in which that axis is up."});
    if (model.is_none()) return call([&](const RunContext& context) { return read_poses(path, context).value(); });
    const auto of = model_of(model);
    std::vector<std::string> warnings;
    PoseSequence read = call([&](const RunContext& context) {
        const std::vector<Vec3f> rest = driver_positions(*of);
        const PoseFileOptions options{.frames_per_second = frames_per_second,
                                      .animation = animation,
                                      .up = up == "z"   ? std::optional(UpAxis::z)
                                            : up == "y" ? std::optional(UpAxis::y)
                                                        : std::nullopt,
                                      .rest = rest,
                                      .warnings = &warnings};
        const FrameSource<Pose> stream = open_poses(path, rest.size(), of->mesh.origin, options, context).value();
        PoseSequence poses{stream.frames_per_second, {}};
        for (std::size_t frame = 0; frame < stream.frames; ++frame) {
            if (context.is_cancelled()) throw BadResultAccess(cancelled_error());
            context.report("reading poses", double(frame) / double(stream.frames));
            poses.frames.push_back(stream.frame(frame).value());
        }
        return poses;
    });
    warn(warnings);
    return read;
}

} // namespace

void add_files(py::module_& m) {
    m.def("read_mesh", &read_mesh_file, py::arg("path"), py::kw_only(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(read_mesh(path, *, threads=0, progress=None)
--

Read a mesh: OBJ, PLY, STL, OFF, glTF (.gltf, .glb).

Vertex and face order are the file's. What could not be kept or had to be mended is said as a `FiligreeWarning`.

Raises
------
NotFoundError, BadFileError, UnsupportedError, OutOfMemoryError, Cancelled

Examples
--------
>>> filigree.write_mesh(filigree.make("torus", resolution=8), "torus.ply")
>>> filigree.read_mesh("torus.ply")
<filigree.Mesh: 128 vertices, 128 faces>
)");
    m.def(
        "write_mesh", &write_mesh_file, py::arg("mesh"), py::arg("path"), py::kw_only(), py::arg("format") = py::none(),
        py::arg("ascii") = false, py::arg("big_endian") = false, py::arg("materials_beside") = "",
        py::arg("threads") = 0, py::arg("progress") = py::none(),
        R"(write_mesh(mesh, path, *, format=None, ascii=False, big_endian=False, materials_beside='', threads=0, progress=None)
--

Write a mesh whole, or leave `path` untouched.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
path : path
    .obj, .ply, .stl, .off or .glb.
format : str, optional
    'obj', 'ply', 'stl', 'off' or 'glb'; None: by the extension of the path.
ascii : bool
    PLY and STL: text.
big_endian : bool
    PLY: most significant byte first.
materials_beside : path
    GLB: where the mesh came from; colours and textures of the material libraries beside it are embedded.

Raises
------
UnwritableError, UnsupportedError, UnsuitableError, OutOfMemoryError, Cancelled

Warns
-----
FiligreeWarning
    What the format cannot hold.
)");
    m.def("read_model", &read_model_file, py::arg("path"), py::kw_only(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(read_model(path, *, threads=0, progress=None)
--

Read a model (.fil). Its poses, where it holds some, `read_poses` gives.

Raises
------
NotFoundError, BadFileError, OutOfMemoryError, Cancelled
)");
    m.def("write_model", &write_model_file, py::arg("model"), py::arg("path"), py::kw_only(),
          py::arg("poses") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(write_model(model, path, *, poses=None, threads=0, progress=None)
--

Write a model (.fil) whole, or leave `path` untouched; with poses of its driver where there are any.

Parameters
----------
model : Model
path : path
poses : PoseSequence, array_like (f, d, 3), or sequence of Pose, optional
    Gradients in all frames or in none; arrays are 60 frames a second.

Raises
------
MismatchError
    A pose of another number of vertices than the driver.
UnwritableError, OutOfMemoryError, Cancelled

Examples
--------
>>> model = filigree.strip(filigree.make("bar", resolution=8))
>>> filigree.write_model(model, "bar.fil", poses=[model.driver.vertices] * 3)
>>> filigree.read_model("bar.fil"), filigree.read_poses("bar.fil")
(<filigree.Model: 1154 vertices on a driver of 57>, <filigree.PoseSequence: 3 frames>)
)");
    m.def(
        "pack", &pack_model_file, py::arg("model"), py::arg("path"), py::kw_only(), py::arg("bits") = 14,
        py::arg("surface") = false, py::arg("keep_order") = false, py::arg("profile") = "compact",
        py::arg("poses") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
        R"(pack(model, path, *, bits=14, surface=False, keep_order=False, profile='compact', poses=None, threads=0, progress=None)
--

Write a model in few bits (.fil): `read_model` reads it as any other, with the driver as it was and the mesh rounded.

Levels between driver and mesh are dropped. The driver has the same vertices in the same order, so its poses fit.

Parameters
----------
model : Model
    With the blend code, and a driver of the mesh's own vertices.
path : path
bits : int
    Of positions along the longest side of the box, 10 to 16.
surface : bool
    Steps across the surface are four times as long: vertices slide in it.
keep_order : bool
    Vertices and faces come back in their order, at 20 to 50 bits a vertex.
profile : str
    'compact', the fewest bits; 'stream': coarse to fine, so that every beginning of the file is a mesh; 'runtime': with
    the bindings, for the C runtime and the npm package, without `surface` and `keep_order`; 'lossless':
    any model, levels included, and every number comes back bit for bit, whatever `bits`, `surface` and `keep_order`.
poses : PoseSequence, array_like (f, d, 3), or sequence of Pose, optional
    As of `write_model`; packed too, 1e-5 of the diagonal off (rms).

Returns
-------
dict
    `rms` and `max`, how far vertices are off, fractions of the diagonal; `bytes` by part.

Raises
------
UsageError
    `bits`.
UnsuitableError
    The reference code, or a stream of a driver made elsewhere.
MismatchError, UnwritableError, OutOfMemoryError, Cancelled

Examples
--------
>>> model = filigree.strip(filigree.make("bar", resolution=8))
>>> filigree.pack(model, "bar.fil", bits=12)["max"] < 3e-4
True
>>> filigree.read_model("bar.fil")
<filigree.Model: 1154 vertices on a driver of 57>
)");
    m.def("read_poses", &read_pose_file, py::arg("path"), py::arg("model") = py::none(), py::kw_only(),
          py::arg("frames_per_second") = py::none(), py::arg("animation") = "", py::arg("up") = "",
          py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(read_poses(path, model=None, *, frames_per_second=None, animation='', up='', threads=0, progress=None)
--

Read the poses that a model's file holds, or with `model` those of a driver that another program moved.

Parameters
----------
path : path
    .fil; with `model` also .pc2, .mdd, a folder of numbered meshes or NAME_####.ply, an animated glTF.
model : Model, optional
    Whose driver was moved.
frames_per_second : float, optional
    Of files that do not say it; glTF: frames to take a second.
animation : str
    Of a glTF with several; empty: the first.
up : str
    'y' or 'z': the axis that is up in the file, where it is the other one in the model. Poses are turned.

Returns
-------
PoseSequence
    Vertices that another program split for normals or UVs (glTF, numbered meshes) are matched to the driver's by their
    places at rest. That, and a first frame that is the driver turned over, is said as a `FiligreeWarning`.

Raises
------
NotFoundError, BadFileError, MismatchError, UnsupportedError, UsageError, Cancelled
)");
}

} // namespace filigree::python
