#include "models.h"

#include <filigree/scene/melting_surface.h>
#include <filigree/scene/scene_run.h>

#include <mutex>

namespace filigree::python {

namespace {

/// A scene with all that its run refers to; one thread moves it at a time.
struct PyScene {
    SceneFile file;
    ReadyScene ready;
    std::optional<SceneRun> run;
    unsigned threads;
    std::mutex mutex = {};
    std::optional<MeltingSurface> melting = {}; ///< of what melts, and the frame that it made last
    std::optional<std::size_t> melted_frame = {};

    const ReadyBody& body(std::size_t number) const {
        if (number >= ready.bodies.size())
            refuse("There is no body " + std::to_string(number) + "; there are " + std::to_string(ready.bodies.size()) +
                   ", counted from 0.");
        return ready.bodies[number];
    }
};

std::unique_ptr<PyScene> make_scene(const std::filesystem::path& path, bool checks, unsigned threads,
                                    const py::object& progress) {
    auto scene = LongCall{threads, progress}([&](const RunContext& context) {
        auto made = std::unique_ptr<PyScene>(new PyScene{read_scene(path.string()).value(), {}, {}, threads});
        made->ready = set_up(made->file, context).value();
        made->run = SceneRun::create(made->file, made->ready, checks, context).value();
        return made;
    });
    warn(scene->ready.warnings);
    return scene;
}

/// Warns when the run becomes one that is not to be trusted.
void advance(PyScene& self, std::uint64_t frame, const py::object& progress) {
    std::vector<std::string> sentences;
    LongCall{self.threads, progress}([&](const RunContext& context) {
        const std::lock_guard lock(self.mutex);
        const bool was_sound = !self.run->broke_down();
        self.run->advance_to(frame, context).value();
        if (const std::optional<std::string> why = self.run->broke_down(); why && was_sound) {
            sentences = self.run->warnings();
            sentences.push_back(*why);
        }
        return Success{};
    });
    warn(sentences);
}

/// Frames before the one asked for are made as well, as what dies stays dead: once, where frames are asked for in
/// order.
MeshPtr melting_mesh(PyScene& self, std::size_t frame, const py::object& progress) {
    return LongCall{self.threads, progress}([&](const RunContext& context) {
        const std::lock_guard lock(self.mutex);
        if (frame > self.run->frame())
            refuse("There is no frame " + std::to_string(frame) + "; there are 0 to " +
                   std::to_string(self.run->frame()) + ".");
        if (!self.melting) self.melting = MeltingSurface::create(self.ready, context).value();
        if (self.melting->is_empty()) refuse("No body of the scene melts: none is of the model mpm and closed.");
        std::size_t next = self.melted_frame && *self.melted_frame < frame ? *self.melted_frame + 1 : 0;
        self.melted_frame.reset();
        CompositeSurface surface;
        for (; next <= frame; ++next) surface = self.melting->frame(self.run->recording(), next, context).value();
        self.melted_frame = frame;
        VertexScalar& origin = surface.mesh.scalars.emplace_back(VertexScalar{"origin", {}});
        for (const Index v : surface.origin) origin.values.push_back(v == kNoIndex ? -1 : float(v));
        surface.mesh.origin = self.ready.origin;
        return std::make_shared<Mesh>(std::move(surface.mesh));
    });
}

} // namespace

void add_scenes(py::module_& m) {
    py::class_<PyScene>(
        m, "SceneRun",
        R"(A scene of a TOML file (docs/scenes.md), set up and moved frame by frame; what `filigree simulate` runs.

Parameters
----------
path : path
checks : bool
    Also carry every vertex by the particles and compare: dearer.

Raises
------
NotFoundError, BadFileError
    With file and line.
UsageError, UnsuitableError, Cancelled

Warns
-----
FiligreeWarning
    What is hard to simulate; in `step` and `advance_to`, a motion that is not to be trusted (see `doubt`).
)")
        .def(py::init(&make_scene), py::arg("path"), py::kw_only(), py::arg("checks") = false, py::arg("threads") = 0,
             py::arg("progress") = py::none(),
             R"(__init__(self, path, *, checks=False, threads=0, progress=None)
--

)")
        .def(
            "step", [](PyScene& self, std::uint64_t frames) { advance(self, self.run->frame() + frames, py::none()); },
            py::arg("frames") = 1, R"(step(self, frames=1)
--

So many frames more.
)")
        .def("advance_to", &advance, py::arg("frame"), py::kw_only(), py::arg("progress") = py::none(),
             R"(advance_to(self, frame, *, progress=None)
--

Simulate until so many frames are done. What was recorded before an error or Ctrl-C is whole.
)")
        .def_property_readonly(
            "frame", [](const PyScene& self) { return self.run->frame(); }, "Frames done.")
        .def_property_readonly(
            "frames", [](const PyScene& self) { return self.file.frames; }, "As many as the file asks for.")
        .def_property_readonly(
            "bodies",
            [](const PyScene& self) {
                std::vector<std::string> names;
                for (const ReadyBody& body : self.ready.bodies) names.push_back(body.name);
                return names;
            },
            "Their names, a list of str.")
        .def_property_readonly(
            "origin", [](const PyScene& self) { return array_of(self.ready.origin); },
            "What poses and meshes are relative to, m, float64 (3,).")
        .def_property_readonly(
            "warnings",
            [](PyScene& self) {
                return without_interpreter([&] {
                    const std::lock_guard lock(self.mutex);
                    return self.run->warnings();
                });
            },
            "What makes the motion so far doubtful, a list of sentences.")
        .def_property_readonly(
            "doubt",
            [](PyScene& self) {
                return without_interpreter([&] {
                    const std::lock_guard lock(self.mutex);
                    return self.run->broke_down();
                });
            },
            "None, or why the motion so far is not to be trusted: a sentence. `warnings` say where and what to change.")
        .def(
            "model",
            [](const py::object& self, std::size_t body) {
                const PyScene& scene = self.cast<const PyScene&>();
                return PyModel{std::make_shared<const Model>(scene.body(body).model)};
            },
            py::arg("body"), R"(model(self, body)
--

The model of a body's mesh, a copy.
)")
        .def(
            "poses",
            [](PyScene& self, std::size_t body) {
                self.body(body);
                return without_interpreter([&] {
                    const std::lock_guard lock(self.mutex);
                    return self.run->recording().poses[body];
                });
            },
            py::arg("body"), R"(poses(self, body)
--

The driver's poses so far, in metres, the first of the start: a PoseSequence, a copy. `restore(model(body), pose)` gives the
mesh then, `write_model` a file that plays.
)")
        .def(
            "mesh",
            [](PyScene& self, std::size_t body, std::size_t frame) {
                self.body(body);
                if (frame > self.run->frame())
                    refuse("There is no frame " + std::to_string(frame) + "; there are 0 to " +
                           std::to_string(self.run->frame()) + ".");
                const RunContext& context = short_context(self.threads);
                return without_interpreter([&] {
                    const std::lock_guard lock(self.mutex);
                    return std::make_shared<Mesh>(self.run->mesh(body, frame, context).value());
                });
            },
            py::arg("body"), py::arg("frame"), R"(mesh(self, body, frame)
--

A body's mesh in one of the frames so far, 0 the start, metres.
)")
        .def("melting_mesh", &melting_mesh, py::arg("frame"), py::kw_only(), py::arg("progress") = py::none(),
             R"(melting_mesh(self, frame, *, progress=None)
--

The bodies of 'mpm' as one surface in one of the frames so far, which parts and joins, metres. The scalar 'origin' says which
vertex of their meshes a vertex is, -1 for a new one. Cheapest frame after frame, from the start on.

Raises
------
UsageError
    No such frame; no body that melts.
)")
        .def(
            "energy",
            [](PyScene& self) {
                const Energy energy = without_interpreter([&] {
                    const std::lock_guard lock(self.mutex);
                    return self.run->energy();
                });
                py::dict said;
                said["kinetic"] = energy.kinetic;
                said["elastic"] = energy.elastic;
                said["potential"] = energy.potential;
                return said;
            },
            R"(energy(self)
--

'kinetic', 'elastic' and 'potential', J.
)")
        .def(
            "save",
            [](PyScene& self) {
                return py::bytes(without_interpreter([&] {
                    const std::lock_guard lock(self.mutex);
                    return self.run->save();
                }));
            },
            R"(save(self)
--

The state as bytes, as `filigree simulate --state` writes it.
)")
        .def(
            "resume",
            [](PyScene& self, const py::bytes& state) {
                const std::string_view bytes(state);
                without_interpreter([&] {
                    const std::lock_guard lock(self.mutex);
                    return self.run->resume(bytes, "state").value();
                });
            },
            py::arg("state"), R"(resume(self, state)
--

Go on from a state of the same scene.

Raises
------
BadFileError
    Damaged.
MismatchError
    Of another scene.
UsageError
    Recorded with checks, and this run is without, or the other way round.
)");
}

} // namespace filigree::python
