#include "bodies.h"
#include "calls.h"
#include "models.h"

#include <filigree/flesh.h>

#include <numeric>

namespace filigree::python {

namespace {

using SkinPtr = std::shared_ptr<const SkinnedMesh>;

struct PySkin {
    SkinPtr skin;
    MeshPtr mesh;
    std::filesystem::path path; ///< of the file that it was read from
};

struct PyFlesh {
    std::shared_ptr<const Flesh> flesh;
    PyBody body;
    std::filesystem::path path; ///< of the skin
};

/// A clip by its name or its number.
std::size_t clip_of(const SkinnedMesh& skin, const py::handle& given) {
    if (py::isinstance<py::str>(given)) {
        const auto name = given.cast<std::string>();
        std::string list;
        for (std::size_t c = 0; c < skin.clips.size(); ++c) {
            if (skin.clips[c].name == name) return c;
            list += (list.empty() ? "'" : ", '") + skin.clips[c].name + "'";
        }
        refuse("There is no clip '" + name + "'; there are " + list + ".");
    }
    const auto number = given.cast<std::size_t>();
    if (number >= skin.clips.size())
        refuse("There is no clip " + std::to_string(number) + "; there are " + std::to_string(skin.clips.size()) +
               ", counted from 0.");
    return number;
}

std::vector<Eigen::Affine3d> transforms_of(const SkinnedMesh& skin, const py::handle& clip, double seconds) {
    std::vector<Eigen::Affine3d> transforms(skin.joints.size());
    skin.transforms(clip_of(skin, clip), seconds, transforms);
    return transforms;
}

std::vector<Vec3d> in_world(std::span<const Vec3f> positions, const Vec3d& origin) {
    std::vector<Vec3d> world;
    for (const Vec3f& p : positions) world.push_back(p.cast<double>() + origin);
    return world;
}

PySkin read(const std::filesystem::path& path, const py::object& mesh, bool by_surface,
            std::optional<double> frames_per_second, std::size_t patches, unsigned threads,
            const py::object& progress) {
    const MeshPtr rest = mesh.is_none() ? nullptr : mesh_of(mesh);
    const CharacterOptions options{
        .rest = rest.get(), .by_joints = !by_surface, .frames_per_second = frames_per_second, .patches = patches};
    SkinnedMesh skin = LongCall{threads, progress}(
        [&](const RunContext& context) { return read_character(path, options, context).value(); });
    warn(skin.warnings);
    const auto kept = std::make_shared<const SkinnedMesh>(std::move(skin));
    return {kept, std::make_shared<Mesh>(kept->mesh), path};
}

/// World to world, (j, 4, 4).
py::array_t<double> skin_transforms(const PySkin& self, const py::object& clip, double seconds) {
    const std::vector<Eigen::Affine3d> transforms = transforms_of(*self.skin, clip, seconds);
    const Vec3d origin = self.skin->mesh.origin;
    std::vector<double> numbers;
    for (Eigen::Affine3d joint : transforms) {
        joint.translation() += origin - joint.linear() * origin;
        for (int row = 0; row < 4; ++row)
            for (int column = 0; column < 4; ++column) numbers.push_back(joint.matrix()(row, column));
    }
    return take<double>(std::move(numbers), Shape{static_cast<py::ssize_t>(transforms.size()), 4, 4});
}

py::array_t<double> plain_positions(const PySkin& self, const py::object& clip, double seconds) {
    std::vector<Vec3f> positions(self.skin->mesh.vertex_count());
    if (Status placed = clip_positions(*self.skin, clip_of(*self.skin, clip), seconds, positions, short_context(1));
        !placed)
        throw BadResultAccess(placed.error());
    return take(in_world(positions, self.skin->mesh.origin));
}

PyFlesh make_flesh(const PySkin& skin, std::size_t particles, double stiffness, double poisson_ratio, double density,
                   double core, double frequency, double surface_frequency, double damping, const py::object& soft,
                   double strength, const py::object& loose, const py::object& through, bool separate,
                   std::optional<double> scale, bool sculpted_gravity, const py::object& clips, unsigned threads,
                   const py::object& progress) {
    FleshOptions options;
    options.particles = particles;
    options.material.young_modulus = stiffness;
    options.material.poisson_ratio = poisson_ratio;
    options.material.density = density;
    options.core = core;
    options.frequency = frequency;
    options.surface_frequency = surface_frequency;
    options.damping = damping;
    options.sculpted_gravity = sculpted_gravity;
    if (scale) {
        if (!(*scale > 0)) refuse("scale has to be above 0, in metres a model unit.");
        options.scale = *scale;
    }
    for (const py::handle pattern : py::list(soft)) options.soft.push_back({pattern.cast<std::string>(), strength});
    if (!loose.is_none()) options.loose = values_of(loose, "loose");
    options.loose_strength = strength;
    for (const py::handle pair : py::list(through)) {
        const auto names = pair.cast<std::pair<std::string, std::string>>();
        options.contacts.push_back({names.first, names.second});
    }
    options.separate = separate;
    std::vector<std::size_t> numbers;
    if (!clips.is_none())
        for (const py::handle clip : py::list(clips)) numbers.push_back(clip_of(*skin.skin, clip));
    Flesh made = LongCall{threads, progress}(
        [&](const RunContext& context) { return Flesh::create(*skin.skin, options, numbers, context).value(); });
    warn(made.report().warnings);
    const auto kept = std::make_shared<const Flesh>(std::move(made));
    return {kept, PyBody{kept->body(), skin.skin->mesh.origin, kept->report().body}, skin.path};
}

py::tuple targets(const PyFlesh& self, const py::object& clip, double seconds) {
    Vectors positions, felt;
    self.flesh->targets(transforms_of(self.flesh->skin(), clip, seconds), Vec3d::Zero(), positions, &felt,
                        short_context(1));
    return py::make_tuple(array_of(positions), array_of(felt));
}

py::dict said_of(const FleshClip& clip, const FleshMeasure& measure) {
    py::dict said;
    said["frames_per_second"] = clip.frames_per_second;
    said["most_substeps"] = clip.most_substeps;
    said["clamped_particles"] = clip.clamped_particles;
    said["inverted_cells"] = clip.inverted_cells;
    said["loop_rms"] = clip.loop_rms;
    said["cycles"] = clip.cycles;
    said["volume"] = py::make_tuple(measure.least_volume, measure.most_volume);
    said["skin_volume"] = py::make_tuple(measure.skin_least_volume, measure.skin_most_volume);
    said["furthest"] = measure.furthest;
    return said;
}

py::tuple simulate(const PyFlesh& self, const py::object& clip, bool loop, bool ground, bool self_contact,
                   double frames_per_second, unsigned threads, const py::object& progress) {
    const Flesh& flesh = *self.flesh;
    const std::size_t number = clip_of(flesh.skin(), clip);
    FleshClipOptions options;
    options.loop = loop;
    options.ground = ground;
    options.self_contact = self_contact;
    options.frames_per_second = frames_per_second;
    const std::size_t count = flesh.skin().mesh.vertex_count();
    std::vector<Vec3d> world;
    FleshMeasure measure;
    FleshClip made = LongCall{threads, progress}([&](const RunContext& context) {
        FleshClip found = simulate_flesh(flesh, number, options, context).value();
        measure = measure_flesh(flesh, found, 0, context).value();
        std::vector<Index> all(count);
        std::iota(all.begin(), all.end(), Index{0});
        FleshCarrier carrier = FleshCarrier::create(flesh, all, context).value();
        std::vector<Vec3f> positions(count);
        for (std::size_t frame = 0; frame < found.frames.size(); ++frame) {
            carrier.at(found, frame, positions, {}, context);
            for (const Vec3f& p : positions) world.push_back(p.cast<double>() + flesh.skin().mesh.origin);
        }
        return found;
    });
    const Shape shape{static_cast<py::ssize_t>(made.frames.size()), static_cast<py::ssize_t>(count), 3};
    return py::make_tuple(take<double>(std::move(world), shape), said_of(made, measure));
}

/// The clips that are named, or all that move.
std::vector<std::size_t> clips_of(const SkinnedMesh& skin, const py::object& given) {
    std::vector<std::size_t> numbers;
    if (given.is_none()) {
        for (std::size_t c = 0; c < skin.clips.size(); ++c)
            if (skin.clips[c].seconds > 0) numbers.push_back(c);
    } else {
        for (const py::handle clip : py::list(given)) numbers.push_back(clip_of(skin, clip));
    }
    return numbers;
}

/// All clips as one file.
py::tuple export_flesh(const PyFlesh& self, const std::filesystem::path& path, const py::object& clips, bool loop,
                       bool ground, bool self_contact, double frames_per_second, std::size_t joints,
                       std::optional<double> key_rate, bool compress, unsigned threads, const py::object& progress) {
    const Flesh& flesh = *self.flesh;
    const std::vector<std::size_t> numbers = clips_of(flesh.skin(), clips);
    FleshClipOptions options;
    options.loop = loop;
    options.ground = ground;
    options.self_contact = self_contact;
    options.frames_per_second = frames_per_second;
    SkinOptions skin;
    skin.key_rate = key_rate;
    skin.compress = compress;
    skin.materials_beside = self.path;
    std::vector<FleshClip> made;
    std::vector<FleshMeasure> measures;
    ExportReport written;
    FittedFlesh fitted = LongCall{threads, progress}([&](const RunContext& context) {
        for (const std::size_t number : numbers) {
            made.push_back(simulate_flesh(flesh, number, options, context).value());
            measures.push_back(measure_flesh(flesh, made.back(), 0, context).value());
        }
        FittedFlesh of_all = fit_flesh(flesh, made, joints, context).value();
        written = write_skin_glb(of_all.model, of_all.animations(), of_all.morphs, skin, path, context).value();
        return of_all;
    });
    warn(written.warnings);
    py::dict poses, said;
    for (std::size_t c = 0; c < made.size(); ++c) {
        said[py::str(fitted.names[c])] = said_of(made[c], measures[c]);
        poses[py::str(fitted.names[c])] = py::cast(std::move(fitted.poses[c]));
    }
    py::dict report;
    report["rms"] = fitted.report.rms;
    report["max"] = fitted.report.max;
    report["driver_vertices"] = fitted.report.driver_vertices;
    report["frames"] = fitted.report.frames;
    return py::make_tuple(PyModel{std::make_shared<const Model>(std::move(fitted.model)), std::move(report)}, poses,
                          said);
}

} // namespace

void add_flesh(py::module_& m) {
    m.def(
        "target_velocities",
        [](const py::object& before, const py::object& now, const py::object& after, double frames_per_second) {
            const Vectors a = vectors_of(before, "before"), b = vectors_of(now, "now"), c = vectors_of(after, "after");
            if (a.size() != b.size() || b.size() != c.size())
                refuse(ErrorCode::mismatch, "before, now and after have to be of one shape.");
            if (!(frames_per_second > 0)) refuse("frames_per_second has to be above 0.");
            return array_of(target_velocities(a, b, c, frames_per_second));
        },
        py::arg("before"), py::arg("now"), py::arg("after"), py::arg("frames_per_second"),
        R"(target_velocities(before, now, after, frames_per_second)
--

Velocities of targets, (p, 3), m/s, from their places in three frames, for Simulation.set_targets.

Parameters
----------
before, now, after : array_like, (p, 3)
    m.
frames_per_second : float
    Above 0.

>>> filigree.target_velocities([[0, 0, 0]], [[1, 0, 0]], [[2, 0, 0]], 30)
array([[30.,  0.,  0.]], dtype=float32)
)");
    py::class_<PySkin>(
        m, "Skin",
        R"(A mesh, the joints that carry its vertices, and the clips that move the joints; `read_skin` reads one.
)")
        .def_property_readonly(
            "mesh", [](const PySkin& self) { return self.mesh; }, "In the bind pose: a Mesh.")
        .def_property_readonly(
            "joints",
            [](const PySkin& self) {
                std::vector<std::string> names;
                for (const SkinJoint& joint : self.skin->joints) names.push_back(joint.name);
                return names;
            },
            "Names of the joints.")
        .def_property_readonly(
            "parents",
            [](const PySkin& self) {
                std::vector<std::optional<Index>> parents;
                for (const SkinJoint& joint : self.skin->joints)
                    parents.push_back(joint.parent == kNoIndex ? std::nullopt : std::optional(joint.parent));
                return parents;
            },
            "Number of the joint above each joint; None: there is none.")
        .def_property_readonly(
            "clips",
            [](const PySkin& self) {
                py::list clips;
                for (const SkinClip& clip : self.skin->clips) clips.append(py::make_tuple(clip.name, clip.seconds));
                return clips;
            },
            "Of each clip its name and its seconds.")
        .def("transforms", &skin_transforms, py::arg("clip"), py::arg("seconds"), R"(transforms(self, clip, seconds)
--

What the joints do to the bind pose at a moment of a clip (its name or number): (j, 4, 4), world to world.
)")
        .def("positions", &plain_positions, py::arg("clip"), py::arg("seconds"), R"(positions(self, clip, seconds)
--

Where plain skinning has the vertices at a moment of a clip (its name or number): (n, 3), world.
)");
    m.def(
        "read_skin", &read, py::arg("path"), py::kw_only(), py::arg("mesh") = py::none(), py::arg("by_surface") = false,
        py::arg("frames_per_second") = py::none(), py::arg("patches") = 400, py::arg("threads") = 0,
        py::arg("progress") = py::none(),
        R"(read_skin(path, *, mesh=None, by_surface=False, frames_per_second=None, patches=400, threads=0, progress=None)
--

Read any file that moves as a Skin, for `Flesh`: an animated glTF by its skins, which become one, or by its morph
targets where it has no skin; a model with poses (.fil); with `mesh` a point cache or numbered meshes.

Parameters
----------
path : str or Path
mesh : Mesh, optional
    At rest, for files that have positions alone.
by_surface : bool
    Take a skin as a moving surface too, so that its morph targets move as well.
frames_per_second : float, optional
    Of files that do not say it; None: 60.
patches : int
    Of a surface without joints: so many patches, about, move its matter; what it does beside them, such as a blink, lies
    on top. A face wants few (24).

Raises
------
UnsuitableError
    Nothing moves in it.
)");
    py::class_<PyFlesh>(
        m, "Flesh",
        R"(Soft matter of a skin: what is near the bones follows them, the rest has inertia, weight and contact.

docs/flesh.md says what to change when. `simulate` makes the motion; `fit` makes a small model of it. For a simulation of
your own, give `body` to a Simulation and drive it with `targets`, `frequency`, Simulation.set_follow and set_targets.

Parameters
----------
skin : Skin
particles : int
    About.
stiffness : float
    Young's modulus, Pa.
poisson_ratio : float
    0 to 0.49: how well the flesh keeps its volume while it is pressed. 0.49 does so best and takes twice as long.
density : float
    kg/m^3.
core : float
    0 to 1: how far from the bones to the skin all is held.
frequency, surface_frequency : float
    Hz, of the springs at the edge of the core and at the skin.
damping : float
    1/s, of motion beside the animation.
soft : sequence of str
    Patterns of joints that hold little, with all below them: ["Tail*"].
strength : float
    0 to 1: how strongly these hold, and loose places.
loose : array_like, (n,), optional
    0 to 1, of the vertices of the skin's mesh: how loose the matter is.
through : sequence of (str, str)
    Pairs of joints whose limbs pass through each other, with all below them.
separate : bool
    Part what is nearer to each other than two particles, such as fingers.
scale : float, optional
    Metres a model unit; None: 1, or the power of ten that makes 0.3 to 3 m.
sculpted_gravity : bool
    Whether the bind pose does not sag.
clips : sequence of str or int, optional
    Whose joints are looked at for scales and folds; None: all.
)")
        .def(
            py::init(&make_flesh), py::arg("skin"), py::kw_only(), py::arg("particles") = 5000,
            py::arg("stiffness") = 1.5e4, py::arg("poisson_ratio") = 0.47, py::arg("density") = 1000.0,
            py::arg("core") = 0.5, py::arg("frequency") = 10.0, py::arg("surface_frequency") = 1.0,
            py::arg("damping") = 3.0, py::arg("soft") = py::tuple(), py::arg("strength") = 0.02,
            py::arg("loose") = py::none(), py::arg("through") = py::tuple(), py::arg("separate") = false,
            py::arg("scale") = py::none(), py::arg("sculpted_gravity") = true, py::arg("clips") = py::none(),
            py::arg("threads") = 0, py::arg("progress") = py::none(),
            R"(__init__(self, skin, *, particles=5000, stiffness=15000.0, poisson_ratio=0.47, density=1000.0, core=0.5, frequency=10.0, surface_frequency=1.0, damping=3.0, soft=(), strength=0.02, loose=None, through=(), separate=False, scale=None, sculpted_gravity=True, clips=None, threads=0, progress=None)
--

)")
        .def_property_readonly(
            "body", [](const PyFlesh& self) { return self.body; }, "The matter: a Body.")
        .def_property_readonly(
            "scale", [](const PyFlesh& self) { return self.flesh->scale(); }, "Metres a model unit.")
        .def_property_readonly(
            "softness",
            [](const PyFlesh& self) {
                return take(std::vector<float>(self.flesh->softness().begin(), self.flesh->softness().end()));
            },
            "Of each particle: 0 on a bone, 1 at the skin.")
        .def_property_readonly(
            "frequency", [](const PyFlesh& self) { return take(std::vector<float>(self.flesh->follow().frequency)); },
            "Hz, of each particle's spring; inf: it is held. Simulation.set_follow takes it.")
        .def_property_readonly(
            "leash", [](const PyFlesh& self) { return take(std::vector<float>(self.flesh->follow().leash)); },
            "m, of each particle; inf: none. Simulation.set_follow takes it.")
        .def("targets", &targets, py::arg("clip"), py::arg("seconds"), R"(targets(self, clip, seconds)
--

Where the joints want the particles at a moment of a clip, (p, 3), m, and what undoes gravity in the bind pose, (p, 3),
m/s^2: Simulation.set_targets takes both.
)")
        .def(
            "stretches",
            [](const PyFlesh& self, const py::object& clip, double seconds) -> py::object {
                std::vector<Mat3f> found =
                    self.flesh->stretches(transforms_of(self.flesh->skin(), clip, seconds), short_context(1));
                if (found.empty()) return py::none();
                return take(std::move(found));
            },
            py::arg("clip"), py::arg("seconds"), R"(stretches(self, clip, seconds)
--

How the rest shape is stretched where joints change their size, (p, 3, 3), for Simulation.set_follow and set_targets;
None where none does.
)")
        .def(
            "export", &export_flesh, py::arg("path"), py::arg("clips") = py::none(), py::kw_only(),
            py::arg("loop") = false, py::arg("ground") = false, py::arg("self_contact") = true,
            py::arg("frames_per_second") = 60.0, py::arg("joints") = 300, py::arg("key_rate") = 30.0,
            py::arg("compress") = false, py::arg("threads") = 0, py::arg("progress") = py::none(),
            R"(export(self, path, clips=None, *, loop=False, ground=False, self_contact=True, frames_per_second=60.0, joints=300, key_rate=30.0, compress=False, threads=0, progress=None)
--

Simulate clips, fit one small model to all of them, and write it as a skin (.glb) with an animation each. Materials and
morph targets of the file are kept.

Parameters
----------
path : str or Path
    .glb.
clips : sequence of str or int, optional
    None: all that move.
joints : int
    Of the file, about; 12 or more.
key_rate : float, optional
    Keys a second; None: one a frame.
compress : bool
    EXT_meshopt_compression and KHR_mesh_quantization, which viewers have to know.

Returns the model, a dict of poses by the names of the clips, and a dict of what `simulate` says of each.
)")
        .def(
            "simulate", &simulate, py::arg("clip"), py::kw_only(), py::arg("loop") = false, py::arg("ground") = false,
            py::arg("self_contact") = true, py::arg("frames_per_second") = 60.0, py::arg("threads") = 0,
            py::arg("progress") = py::none(),
            R"(simulate(self, clip, *, loop=False, ground=False, self_contact=True, frames_per_second=60.0, threads=0, progress=None)
--

Simulate a clip (its name or number).

Returns the vertices of the skin's mesh in every frame, (f, n, 3), world, and a dict: 'frames_per_second' (a loop changes
it a little), 'volume' and 'skin_volume' (least and most, over the bind pose's), 'furthest' (from the skin, of the
diagonal), 'loop_rms', 'cycles', 'most_substeps', 'inverted_cells', 'clamped_particles'.
)");
}

} // namespace filigree::python
