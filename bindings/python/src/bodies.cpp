#include "bodies.h"

#include "calls.h"

#include <filigree/physics/body/fields.h>
#include <filigree/physics/material.h>
#include <filigree/scene/particles_near.h>
#include <filigree/scene/scene_keys.h>

namespace filigree::python {

namespace {

/// The models by name, in the order of MaterialModel.
std::vector<std::string> model_names() {
    std::vector<std::string> names;
    each_word(find_key("body", "model")->values.words, [&](std::string_view word) { names.emplace_back(word); });
    return names;
}
std::string model_name(MaterialModel model) { return model_names()[static_cast<std::size_t>(model)]; }
MaterialModel model_of_name(const std::string& name) {
    const std::vector<std::string> names = model_names();
    const auto found = std::ranges::find(names, name);
    std::string list;
    for (const std::string& known : names) list += (list.empty() ? "'" : ", '") + known + "'";
    if (found == names.end()) refuse("model is '" + name + "', and has to be one of " + list + ".");
    return static_cast<MaterialModel>(found - names.begin());
}

Material make_material(const std::string& name, const py::kwargs& changes) {
    std::string known;
    for (const NamedMaterial& named : named_materials()) {
        known += (known.empty() ? "'" : ", '") + std::string(named.name) + "'";
        if (named.name != name) continue;
        Material material = named.material;
        for (const auto& [key, value] : changes) {
            const auto word = key.cast<std::string>();
            if (word == "model") {
                material.model = model_of_name(value.cast<std::string>());
                continue;
            }
            const SceneKey* quantity = find_key("body", word);
            if (!quantity || !quantity->is_in(&material)) refuse("A material has no '" + word + "'.");
            number_in(material, *quantity) = value.cast<double>();
        }
        if (const std::string wrong = check_material(material); !wrong.empty()) refuse(wrong);
        return material;
    }
    refuse("There is no material '" + name + "'; there are " + known + ".");
}

FieldOf field_of_name(const std::string& name) {
    std::vector<std::pair<std::string_view, FieldOf>> words;
    for (const FieldOf field : kFields) words.emplace_back(name_of(field), field);
    return value_of(name, "A field's name", words);
}

/// Calls visit(field, its numbers) for each field of a dict.
template <class Visit>
void each_field(const py::dict& fields, const Visit& visit) {
    for (const auto& [key, value] : fields) {
        const auto name = py::cast<std::string>(py::str(key));
        visit(field_of_name(name), values_of(value, name.c_str()));
    }
}

PyBody make_one(const py::object& given, const py::object& material, std::optional<std::size_t> particles,
                std::optional<double> spacing, double scale, std::optional<double> size, const py::dict& fields,
                bool separate, unsigned threads, const py::object& progress) {
    const MeshPtr mesh = mesh_of(given);
    const Material of = material_of(material);
    BodyOptions options;
    options.scale = scale;
    options.size = size;
    if (particles && spacing) refuse("Give particles or spacing, not both.");
    options.cells.count = particles.value_or(options.cells.count);
    if (spacing && !(*spacing > 0)) refuse("spacing has to be above 0.");
    options.cells.spacing = spacing.value_or(0);
    options.separate = separate;
    each_field(fields, [&](FieldOf field, std::vector<float> values) {
        options.fields.push_back({field, std::move(values)});
    });
    PyBody made{nullptr, mesh->origin};
    made.body = LongCall{threads, progress}([&](const RunContext& context) {
        return std::make_shared<const Body>(make_body(*mesh, of, options, context, &made.report).value());
    });
    if (!made.report.warning.empty()) warn({made.report.warning});
    return made;
}

PyBody with_fields(const PyBody& self, const py::dict& fields) {
    Body body = *self.body;
    BodyFields all = body.fields;
    each_field(fields, [&](FieldOf of, std::vector<float> values) { all.of(of) = std::move(values); });
    if (const Status set = set_fields(body, std::move(all)); !set) refuse(set.error().code, set.error().message);
    if (const std::string warning = fields_warning(body); !warning.empty()) warn({warning});
    PyBody changed = self;
    changed.report.mass = 0;
    for (const float mass : body.mass) changed.report.mass += double(mass);
    changed.body = std::make_shared<const Body>(std::move(body));
    return changed;
}

py::dict fields_of(const py::object& self) {
    py::dict fields;
    for (const FieldOf of : kFields)
        if (const std::vector<float>& field = self.cast<const PyBody&>().body->fields.of(of); !field.empty())
            fields[py::str(std::string(name_of(of)))] = view(field, self);
    return fields;
}

py::dict body_report(const PyBody& self) {
    const BodyReport& report = self.report;
    py::dict said;
    said["cells"] = report.cells.cells;
    said["whole_cells"] = report.cells.whole_cells;
    said["added_cells"] = report.cells.added_cells;
    said["thin_cells"] = report.cells.thin_cells;
    said["loose_parts"] = report.cells.loose_parts;
    said["volume"] = report.cells.volume;
    said["joined_corners"] = report.joined.corners;
    said["separated_corners"] = report.separated_corners;
    said["surface_points"] = report.surface_points;
    said["mass"] = report.mass;
    said["warning"] = report.warning;
    return said;
}

} // namespace

Material material_of(const py::handle& given) {
    if (py::isinstance<Material>(given)) return given.cast<Material>();
    if (!py::isinstance<py::str>(given)) throw py::type_error("material has to be a filigree.Material or a name.");
    return make_material(given.cast<std::string>(), {});
}

void add_bodies(py::module_& m) {
    py::class_<Material> material(m, "Material", R"(What a body is made of, in SI units.

Parameters
----------
name : str
    What to begin with: one of `materials()`.
**changes : float or str
    What is otherwise: model ('fem', 'springs', 'meshfree', 'rigid' or 'mpm'), density (kg/m^3), young_modulus (Pa),
    poisson_ratio (0 to 0.49), damping (1/s), internal_damping (s), bending; of 'fem', 'meshfree' and 'mpm' yield_stress (Pa);
    of 'fem' and 'meshfree' creep_time (s); of 'mpm' temperature, melting_from and melting_to (K), viscosity (Pa s), heating
    (K/s), conductivity (m^2/s), specific_heat (J/(kg K)), latent_heat (J/kg).

Raises
------
UsageError
    No such material or quantity; a number outside its range.

Examples
--------
>>> filigree.Material("jelly", density=1200).density
1200.0
)");
    material
        .def(py::init(&make_material), py::arg("name") = "rubber",
             R"(__init__(self, name='rubber', **changes)
--

)")
        .def_property_readonly(
            "model", [](const Material& self) { return model_name(self.model); },
            "'fem', 'springs', 'meshfree', 'rigid' or 'mpm'.")
        .def(
            "__eq__", [](const Material& self, const Material& other) { return self == other; }, py::is_operator())
        .def(py::pickle(
            [](Material self) {
                py::dict state;
                state["model"] = model_name(self.model);
                for (const SceneKey* key : material_numbers())
                    state[py::str(std::string(key->name))] = number_in(self, *key);
                return state;
            },
            [](const py::dict& state) { return make_material("rubber", py::kwargs(state)); }));
    for (const SceneKey* key : material_numbers()) {
        const std::string unit = key->unit.empty() ? "" : std::string(key->unit) + ": ";
        material.def_property_readonly(
            std::string(key->name).c_str(), [key](Material self) { return number_in(self, *key); },
            py::doc((unit + std::string(key->text) + ".").c_str()));
    }
    m.def(
        "materials",
        [] {
            py::dict names;
            for (const NamedMaterial& named : named_materials()) names[py::str(std::string(named.name))] = named.text;
            return names;
        },
        R"(materials()
--

The materials by name, with what they do: dict of str to str.
)");

    py::class_<PyBody>(m, "Body",
                       R"(Matter inside a mesh: particles, what they weigh, how they hang together. Never changes.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
material : Material or str
particles : int, optional
    About how many: 8000, unless `spacing` is given.
spacing : float, optional
    Between them, m; in place of `particles`.
scale : float
    Metres a model unit, above 0.
size : float, optional
    m, above 0: the longest side of the mesh's box; in place of `scale`.
fields : dict of str to array_like, (v,)
    What varies within the body: 'stiffness', 'density', 'damping', 'yield_stress' (of the material) or 'strength' (of its
    fracture). One multiple of the material's value a vertex of the mesh, 0.001 to 1000; they are spread inwards. For the
    models 'fem' and 'rigid'.
separate : bool
    Whether parts that are nearer to each other than two particles (fingers, lips) move apart: from gaps of a quarter of
    the spacing on. For the model 'fem'; such a body does not break.

Raises
------
UsageError, UnsuitableError, Cancelled

Warns
-----
FiligreeWarning
    Parts thinner than two cells, or so near each other that they are joined; stiffness beyond 0.1 to 10 times the
    material's.

Examples
--------
>>> body = filigree.Body(filigree.make("bar", resolution=4), "jelly", spacing=0.25)
>>> len(body), body.mass.sum()
(425, 4000.0)
)")
        .def(
            py::init(&make_one), py::arg("mesh"), py::arg("material") = "rubber", py::kw_only(),
            py::arg("particles") = py::none(), py::arg("spacing") = py::none(), py::arg("scale") = 1.0,
            py::arg("size") = py::none(), py::arg("fields") = py::dict(), py::arg("separate") = false,
            py::arg("threads") = 0, py::arg("progress") = py::none(),
            R"(__init__(self, mesh, material='rubber', *, particles=None, spacing=None, scale=1.0, size=None, fields={}, separate=False, threads=0, progress=None)
--

)")
        .def_property_readonly(
            "material", [](const PyBody& self) { return self.body->material; }, "What it is made of.")
        .def_property_readonly(
            "scale", [](const PyBody& self) { return self.body->scale; }, "Metres a model unit.")
        .def_property_readonly(
            "spacing", [](const PyBody& self) { return self.body->spacing(); }, "Between particles, m.")
        .def_property_readonly(
            "rest", [](const PyBody& self) { return array_of(self.body->rest); },
            "Particles at rest, m, relative to the mesh's origin, a copy, float32 (p, 3).")
        .def_property_readonly(
            "mass", [](const py::object& self) { return view(self.cast<const PyBody&>().body->mass, self); },
            "Of each particle, kg, float32 (p,), read-only.")
        .def_property_readonly(
            "volume", [](const py::object& self) { return view(self.cast<const PyBody&>().body->volume, self); },
            "Of each particle, m^3, float32 (p,), read-only.")
        .def_property_readonly(
            "cell_centres",
            [](const py::object& self) { return view(self.cast<const PyBody&>().body->cells.centroid, self); },
            "Of each cell, the middle of what it holds of the body at rest, m, float32 (c, 3), read-only.")
        .def_property_readonly("fields", &fields_of,
                               "What varies: by name one multiple a cell, float32 (c,), read-only. A copy of the dict.")
        .def("with_fields", &with_fields, py::arg("fields"), R"(with_fields(self, fields)
--

The same body with other fields.

Parameters
----------
fields : dict of str to array_like, (c,)
    As of `Body`, but one multiple a cell (`cell_centres` says where they are). Others stay; an empty array takes one away.

Returns
-------
Body
    A new one. Simulations keep the bodies that they were made with.

Raises
------
UsageError
    Another number of values than cells; a value outside 0.001 to 1000; a model other than 'fem' and 'rigid'.

Examples
--------
>>> body = filigree.Body(filigree.make("bar", resolution=4), "jelly", spacing=0.25)
>>> body = body.with_fields({"density": 1 + 2 * (body.cell_centres[:, 0] > 0)})
>>> body.mass.sum()
8000.0
)")
        .def_property_readonly("report", &body_report, "What it took: counts, 'volume' (m^3), 'mass' (kg), 'warning'.")
        .def(
            "particles_near",
            [](const PyBody& self, const py::object& points) {
                const std::vector<Vec3f> at = points_of(points, "points");
                return take(without_interpreter([&] { return particles_near(*self.body, at); }));
            },
            py::arg("points"), R"(particles_near(self, points)
--

Particles at a place of the body: those within half a cell's diagonal of any of the points, and the nearest to each.

Parameters
----------
points : array_like, (n, 3)
    Of the body at rest, m.

Returns
-------
ndarray of uint32
    Ascending ids.
)")
        .def("__len__", [](const PyBody& self) { return self.body->particle_count(); })
        .def("__repr__", [](const PyBody& self) {
            return "<filigree.Body: " + std::to_string(self.body->particle_count()) + " particles>";
        });
}

} // namespace filigree::python
