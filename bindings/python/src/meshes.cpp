#include "meshes.h"

#include "calls.h"
#include "models.h"

#include <filigree/mesh.h>

namespace filigree::python {

namespace {

/// Also gives positions that are more precise than float, for split_origin.
std::vector<Vec3d> set_positions(const py::handle& vertices, Mesh& mesh) {
    const py::array array = py::array::ensure(vertices);
    if (array && array.dtype().kind() == 'f' && array.dtype().itemsize() <= 4) {
        mesh.positions = points_of(vertices, "vertices");
        return {};
    }
    std::vector<Vec3d> world = double_points_of(vertices, "vertices");
    for (const Vec3d& p : world) mesh.positions.push_back(p.cast<float>());
    return world;
}

void add_polygons(const py::sequence& polygons, Mesh& mesh) {
    std::size_t face = 0;
    for (const py::handle polygon : polygons) {
        const std::string name = "faces[" + std::to_string(face++) + "]";
        mesh.add_face(indices_of(polygon, name.c_str(), mesh.vertex_count()));
    }
}

void set_faces(const py::handle& faces, const py::handle& face_offsets, Mesh& mesh) {
    if (!face_offsets.is_none()) {
        mesh.corners = indices_of(faces, "faces", mesh.vertex_count());
        mesh.face_offsets = indices_of(face_offsets, "face_offsets", mesh.corners.size() + 1);
        return;
    }
    if (py::isinstance<py::list>(faces) || py::isinstance<py::tuple>(faces))
        return add_polygons(py::reinterpret_borrow<py::sequence>(faces), mesh);
    const Numbers<long long> numbers = integers_of(faces, "faces");
    if (numbers.size() == 0) return;
    if (numbers.ndim() != 2)
        refuse("faces has to be of shape (m, 3) or (m, 4), a list of polygons, or flat with face_offsets.");
    const auto width = static_cast<Index>(numbers.shape(1));
    mesh.corners = indices_of(py::array(numbers).reshape({-1}), "faces", mesh.vertex_count());
    for (Index end = width; end <= mesh.corners.size(); end += width) mesh.face_offsets.push_back(end);
}

template <class T>
void set_attribute(const py::handle& values, const py::handle& corners, const char* name, const char* corners_name,
                   int width, CornerAttribute<T>& attribute) {
    if (values.is_none()) return;
    const Numbers<float> numbers = floats_of(values, name);
    if (numbers.ndim() != 2 || numbers.shape(1) != width)
        refuse(std::string(name) + " has to be of shape (n, " + std::to_string(width) + ").");
    attribute.values.resize(static_cast<std::size_t>(numbers.shape(0)));
    for (std::size_t i = 0; i < attribute.values.size(); ++i)
        for (int k = 0; k < width; ++k) attribute.values[i][k] = numbers.at(static_cast<py::ssize_t>(i), k);
    if (!corners.is_none()) attribute.corners = indices_of(corners, corners_name, attribute.values.size());
}

void set_colors(const py::handle& colors, Mesh& mesh) {
    if (colors.is_none()) return;
    const Numbers<float> numbers = floats_of(colors, "colors");
    if (numbers.ndim() != 2 || (numbers.shape(1) != 3 && numbers.shape(1) != 4))
        refuse("colors has to be of shape (n, 3) or (n, 4), 0 to 1.");
    mesh.colors_have_alpha = numbers.shape(1) == 4;
    mesh.colors.resize(static_cast<std::size_t>(numbers.shape(0)), Vec4f::Ones());
    for (std::size_t i = 0; i < mesh.colors.size(); ++i)
        for (int k = 0; k < numbers.shape(1); ++k) mesh.colors[i][k] = numbers.at(static_cast<py::ssize_t>(i), k);
}

MeshPtr checked(MeshPtr mesh) {
    if (const std::string wrong = check_mesh(*mesh); !wrong.empty()) refuse(wrong);
    return mesh;
}

MeshPtr make_mesh(const py::object& vertices, const py::object& faces, const py::object& face_offsets,
                  const py::object& normals, const py::object& normal_corners, const py::object& uvs,
                  const py::object& uv_corners, const py::object& colors, const py::dict& scalars) {
    auto mesh = std::make_shared<Mesh>();
    const std::vector<Vec3d> world = set_positions(vertices, *mesh);
    set_faces(faces, face_offsets, *mesh);
    set_attribute(normals, normal_corners, "normals", "normal_corners", 3, mesh->normals);
    set_attribute(uvs, uv_corners, "uvs", "uv_corners", 2, mesh->uvs);
    set_colors(colors, *mesh);
    for (const auto& [name, values] : scalars)
        mesh->scalars.push_back({name.cast<std::string>(), values_of(values, "scalars")});
    mesh = checked(std::move(mesh));
    split_origin(world, *mesh);
    return mesh;
}

/// (m, k) where all faces have k corners; else None.
py::object faces_of(const py::object& self) {
    const Mesh& mesh = self.cast<const Mesh&>();
    const std::size_t count = mesh.face_count();
    const Index width = count > 0 ? mesh.face_size(0) : 3;
    for (std::size_t face = 1; face < count; ++face)
        if (mesh.face_size(face) != width) return py::none();
    return view(mesh.corners.data(), Shape{static_cast<py::ssize_t>(count), static_cast<py::ssize_t>(width)}, self);
}

template <class T, int width>
py::object values_of_attribute(const CornerAttribute<T>& attribute, const py::object& self) {
    if (attribute.empty()) return py::none();
    return view(attribute.values.front().data(), Shape{static_cast<py::ssize_t>(attribute.values.size()), width}, self);
}
template <class T>
py::object corners_of_attribute(const CornerAttribute<T>& attribute, const py::object& self) {
    return attribute.per_vertex() ? py::object(py::none()) : view(attribute.corners, self);
}

py::object colors_of(const py::object& self) {
    const Mesh& mesh = self.cast<const Mesh&>();
    if (mesh.colors.empty()) return py::none();
    return view(mesh.colors.front().data(), Shape{static_cast<py::ssize_t>(mesh.colors.size()), 4}, self);
}
py::dict scalars_of(const py::object& self) {
    py::dict scalars;
    for (const VertexScalar& scalar : self.cast<const Mesh&>().scalars)
        scalars[py::str(scalar.name)] = view(scalar.values, self);
    return scalars;
}

/// (names, ids) of labels, or None.
py::object labels_of(const FaceLabels& labels, const py::object& self) {
    if (labels.empty()) return py::none();
    return py::make_tuple(labels.names, view(labels.of_face, self));
}

MeshPtr with_vertices(const Mesh& mesh, const py::object& vertices) {
    auto moved = std::make_shared<Mesh>(mesh);
    moved->origin = Vec3d::Zero();
    moved->positions.clear();
    const std::vector<Vec3d> world = set_positions(vertices, *moved);
    if (moved->positions.size() != mesh.vertex_count())
        refuse(ErrorCode::mismatch, "The mesh has " + std::to_string(mesh.vertex_count()) + " vertices and was given " +
                                        std::to_string(moved->positions.size()) + ".");
    split_origin(world, *moved);
    return moved;
}

// Pickled meshes have every field, in this order; a new field makes a new version.
constexpr int kPickleVersion = 1;

template <class T>
py::bytes bytes_of(const std::vector<T>& values) {
    return py::bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}
template <class T>
void read_bytes(const py::handle& state, std::vector<T>& values) {
    const auto bytes = state.cast<std::string_view>();
    if (bytes.size() % sizeof(T) != 0) refuse(ErrorCode::bad_file, "The pickled mesh is damaged.");
    values.resize(bytes.size() / sizeof(T));
    if (!bytes.empty()) std::memcpy(static_cast<void*>(values.data()), bytes.data(), bytes.size());
}

py::tuple state_of(const Mesh& mesh) {
    const auto labels = [](const FaceLabels& l) { return py::make_tuple(l.names, bytes_of(l.of_face)); };
    py::list scalars, materials;
    for (const VertexScalar& scalar : mesh.scalars)
        scalars.append(py::make_tuple(scalar.name, bytes_of(scalar.values)));
    for (const MeshMaterial& m : mesh.embedded_materials)
        materials.append(py::make_tuple(
            m.name, std::array{m.color.x(), m.color.y(), m.color.z(), m.opacity, m.metallic, m.roughness},
            m.double_sided, m.picture.string(),
            m.picture_bytes ? py::object(py::bytes(*m.picture_bytes)) : py::none()));
    return py::make_tuple(kPickleVersion, bytes_of(mesh.positions),
                          std::array{mesh.origin.x(), mesh.origin.y(), mesh.origin.z()}, bytes_of(mesh.face_offsets),
                          bytes_of(mesh.corners), bytes_of(mesh.uvs.values), bytes_of(mesh.uvs.corners),
                          bytes_of(mesh.normals.values), bytes_of(mesh.normals.corners), bytes_of(mesh.colors),
                          mesh.colors_have_alpha, scalars, labels(mesh.objects), labels(mesh.groups),
                          labels(mesh.materials), bytes_of(mesh.smoothing), mesh.material_files, materials);
}

MeshPtr mesh_of_state(const py::tuple& state) {
    if (state.size() != 18 || state[0].cast<int>() != kPickleVersion)
        refuse(ErrorCode::bad_file, "The pickled mesh is of another version of Filigree.");
    auto mesh = std::make_shared<Mesh>();
    const auto labels = [](const py::handle& from, FaceLabels& to) {
        const auto pair = from.cast<py::tuple>();
        to.names = pair[0].cast<std::vector<std::string>>();
        read_bytes(pair[1], to.of_face);
    };
    read_bytes(state[1], mesh->positions);
    const auto origin = state[2].cast<std::array<double, 3>>();
    mesh->origin = {origin[0], origin[1], origin[2]};
    read_bytes(state[3], mesh->face_offsets);
    read_bytes(state[4], mesh->corners);
    read_bytes(state[5], mesh->uvs.values);
    read_bytes(state[6], mesh->uvs.corners);
    read_bytes(state[7], mesh->normals.values);
    read_bytes(state[8], mesh->normals.corners);
    read_bytes(state[9], mesh->colors);
    mesh->colors_have_alpha = state[10].cast<bool>();
    for (const py::handle entry : state[11].cast<py::list>()) {
        const auto scalar = entry.cast<py::tuple>();
        mesh->scalars.push_back({scalar[0].cast<std::string>(), {}});
        read_bytes(scalar[1], mesh->scalars.back().values);
    }
    labels(state[12], mesh->objects);
    labels(state[13], mesh->groups);
    labels(state[14], mesh->materials);
    read_bytes(state[15], mesh->smoothing);
    mesh->material_files = state[16].cast<std::vector<std::string>>();
    for (const py::handle entry : state[17].cast<py::list>()) {
        const auto from = entry.cast<py::tuple>();
        MeshMaterial& material = mesh->embedded_materials.emplace_back();
        material.name = from[0].cast<std::string>();
        const auto numbers = from[1].cast<std::array<float, 6>>();
        material.color = {numbers[0], numbers[1], numbers[2]};
        material.opacity = numbers[3];
        material.metallic = numbers[4];
        material.roughness = numbers[5];
        material.double_sided = from[2].cast<bool>();
        material.picture = from[3].cast<std::string>();
        if (!from[4].is_none()) material.picture_bytes = std::make_shared<std::string>(from[4].cast<std::string>());
    }
    return checked(std::move(mesh));
}

} // namespace

namespace {

const char* faces_word(const py::handle& given) {
    for (const char* word : {"faces", "triangles"})
        if (py::hasattr(given, "vertices") && py::hasattr(given, word)) return word;
    return nullptr;
}

/// (V, F): a tuple of two, of which the second has rows of whole numbers.
bool is_pair(const py::handle& given) {
    if (!py::isinstance<py::tuple>(given) || PyTuple_GET_SIZE(given.ptr()) != 2) return false;
    const auto pair = py::reinterpret_borrow<py::tuple>(given);
    for (const py::handle part : pair)
        if (py::isinstance<Mesh>(part) || faces_word(part)) return false; // two meshes
    const py::array vertices = py::array::ensure(pair[0]);
    if (!vertices || vertices.ndim() != 2) return false;
    PyErr_Clear();
    const py::array faces = py::array::ensure(pair[1]);
    PyErr_Clear(); // polygons of several sizes are no array
    const bool is_list = py::isinstance<py::list>(pair[1]) && py::len(pair[1]) > 0 &&
                         py::isinstance<py::sequence>(py::reinterpret_borrow<py::list>(pair[1])[0]);
    if (!faces || faces.dtype().kind() == 'O') return is_list;
    return faces.ndim() == 2 && (faces.dtype().kind() == 'i' || faces.dtype().kind() == 'u' || faces.shape(0) == 0);
}

} // namespace

bool is_mesh_like(const py::handle& given) {
    return py::isinstance<Mesh>(given) || faces_word(given) || is_pair(given);
}

MeshPtr mesh_of(const py::handle& given, const char* name) {
    if (py::isinstance<Mesh>(given)) return given.cast<MeshPtr>();
    const auto made = [](const py::object& vertices, const py::object& faces) {
        return make_mesh(vertices, faces, py::none(), py::none(), py::none(), py::none(), py::none(), py::none(), {});
    };
    if (const char* faces = faces_word(given)) return made(given.attr("vertices"), given.attr(faces));
    if (is_pair(given)) {
        const auto pair = py::reinterpret_borrow<py::tuple>(given);
        return made(pair[0], pair[1]);
    }
    throw py::type_error(std::string(name) +
                         " has to be a filigree.Mesh, a tuple (V, F), or an object that has vertices and " +
                         "faces or triangles; this is of type " + Py_TYPE(given.ptr())->tp_name + ".");
}

void warn_of_turns(const OutwardReport& outward) {
    if (const std::string sentence = outward_sentence(outward); !sentence.empty()) warn({sentence});
}

MeshPtr mesh_or_points_of(const py::handle& given, const char* name) {
    if (is_mesh_like(given)) return mesh_of(given, name);
    if (!py::isinstance<py::array>(given) && !py::isinstance<py::list>(given)) return mesh_of(given, name); // refuses
    auto points = std::make_shared<Mesh>();
    split_origin(double_points_of(given, name), *points);
    return points;
}

std::vector<Vec3d> world_points_of(const py::handle& given) {
    std::vector<Vec3d> points;
    const auto add = [&](const Mesh& mesh) {
        for (std::size_t i = 0; i < mesh.vertex_count(); ++i) points.push_back(mesh.world_position(i));
    };
    if (py::isinstance<PyModel>(given))
        add(given.cast<const PyModel&>().model->mesh);
    else if (is_mesh_like(given))
        add(*mesh_of(given, "box"));
    else
        points = double_points_of(given, "box");
    return points;
}

Box box_of(const py::handle& given) {
    if (py::isinstance<PyModel>(given)) return world_bounds(given.cast<const PyModel&>().model->mesh);
    if (is_mesh_like(given)) return world_bounds(*mesh_of(given, "box"));
    Box box;
    for (const Vec3d& point : double_points_of(given, "box")) box.extend(point);
    if (box.empty()) refuse("box has to hold a point.");
    return box;
}

void add_meshes(py::module_& m) {
    py::class_<Mesh, MeshPtr>(m, "Mesh", R"(Polygons over shared vertices. A mesh never changes.

Parameters
----------
vertices : array_like, (n, 3)
    Positions in model units, of any dtype, order and strides. float64 keeps its digits far from the world's origin.
faces : array_like of int, (m, 3) or (m, 4), or list of polygons, or flat with `face_offsets`
    Vertices of each face, counted from 0, counter-clockwise seen from outside.
face_offsets : array_like of int, (m + 1,), optional
    Where each face begins in a flat `faces`, and the end of the last.
normals, uvs : array_like, (k, 3) and (k, 2), optional
    One a vertex, or as many as `normal_corners` and `uv_corners` refer to: one id a corner.
colors : array_like, (n, 3) or (n, 4), optional
    sRGB, 0 to 1, one a vertex.
scalars : dict of str to array_like (n,), optional
    Further numbers a vertex.

Raises
------
UsageError
    Numbers that are not finite, ids that are not there, shapes that do not fit.

Examples
--------
>>> import filigree, numpy
>>> square = filigree.Mesh(numpy.eye(4, 3), [[0, 1, 2], [0, 2, 3]])
>>> square.faces.shape
(2, 3)
>>> square
<filigree.Mesh: 4 vertices, 2 faces>
)")
        .def(
            py::init(&make_mesh), py::arg("vertices"), py::arg("faces") = py::tuple(),
            py::arg("face_offsets") = py::none(), py::kw_only(), py::arg("normals") = py::none(),
            py::arg("normal_corners") = py::none(), py::arg("uvs") = py::none(), py::arg("uv_corners") = py::none(),
            py::arg("colors") = py::none(), py::arg("scalars") = py::dict(),
            R"(__init__(self, vertices, faces=(), face_offsets=None, *, normals=None, normal_corners=None, uvs=None, uv_corners=None, colors=None, scalars={})
--

)")
        .def_property_readonly(
            "vertices", [](const py::object& self) { return view(self.cast<const Mesh&>().positions, self); },
            "Positions, float32 (n, 3), relative to `origin`; read-only, of the mesh's own memory.")
        .def_property_readonly(
            "origin", [](const Mesh& mesh) { return array_of(mesh.origin); },
            "Added to every position, float64 (3,); not zero only far from the world's origin.")
        .def_property_readonly(
            "world_vertices",
            [](const Mesh& mesh) {
                std::vector<Vec3d> points(mesh.vertex_count());
                for (std::size_t i = 0; i < points.size(); ++i) points[i] = mesh.world_position(i);
                return take(std::move(points));
            },
            "Positions in the world, float64 (n, 3): `vertices` + `origin`.")
        .def_property_readonly("faces", &faces_of,
                               "Vertices of each face, uint32 (m, k), read-only; None where faces differ in size: then "
                               "`corners` and `face_offsets` say them.")
        .def_property_readonly(
            "corners", [](const py::object& self) { return view(self.cast<const Mesh&>().corners, self); },
            "Vertex of each corner, face after face, uint32 (c,), read-only.")
        .def_property_readonly(
            "face_offsets", [](const py::object& self) { return view(self.cast<const Mesh&>().face_offsets, self); },
            "Where each face begins in `corners`, and the end of the last, uint32 (m + 1,), read-only.")
        .def_property_readonly(
            "triangles",
            [](const MeshPtr& mesh) {
                auto cut = without_interpreter([&] { return triangulate(*mesh); });
                const auto count = static_cast<py::ssize_t>(cut.triangles.size());
                return take<Index>(std::move(cut.triangles), Shape{count, 3});
            },
            "The faces cut into triangles, uint32 (t, 3).")
        .def_property_readonly(
            "normals",
            [](const py::object& self) {
                return values_of_attribute<Vec3f, 3>(self.cast<const Mesh&>().normals, self);
            },
            "Normals as they came, float32 (k, 3), read-only; None where there are none.")
        .def_property_readonly(
            "normal_corners",
            [](const py::object& self) { return corners_of_attribute(self.cast<const Mesh&>().normals, self); },
            "Which of `normals` each corner has, uint32 (c,), read-only; None: one a vertex.")
        .def_property_readonly(
            "uvs",
            [](const py::object& self) { return values_of_attribute<Vec2f, 2>(self.cast<const Mesh&>().uvs, self); },
            "Texture coordinates, float32 (k, 2), read-only; None where there are none.")
        .def_property_readonly(
            "uv_corners",
            [](const py::object& self) { return corners_of_attribute(self.cast<const Mesh&>().uvs, self); },
            "Which of `uvs` each corner has, uint32 (c,), read-only; None: one a vertex.")
        .def_property_readonly("colors", &colors_of,
                               "sRGB and alpha a vertex, 0 to 1, float32 (n, 4), read-only; None where there are none.")
        .def_property_readonly("scalars", &scalars_of,
                               "Further numbers a vertex by name, dict of float32 (n,), read-only.")
        .def_property_readonly(
            "objects", [](const py::object& self) { return labels_of(self.cast<const Mesh&>().objects, self); },
            "Names of objects, and which of them each face is of (4294967295: none), uint32 (m,); None without.")
        .def_property_readonly(
            "groups", [](const py::object& self) { return labels_of(self.cast<const Mesh&>().groups, self); },
            "Names of groups, and which of them each face is of; None without.")
        .def_property_readonly(
            "materials", [](const py::object& self) { return labels_of(self.cast<const Mesh&>().materials, self); },
            "Names of materials, and which of them each face has; None without.")
        .def_property_readonly(
            "bounds",
            [](const Mesh& mesh) {
                const Box box = world_bounds(mesh);
                return take(std::vector<Vec3d>{box.min, box.max});
            },
            "Lowest and highest corner of the box in the world, float64 (2, 3); inf and -inf without vertices.")
        .def_property_readonly(
            "diagonal", [](const Mesh& mesh) { return world_bounds(mesh).diagonal(); },
            "Length of the box's diagonal, model units: what errors are fractions of.")
        .def("with_vertices", &with_vertices, py::arg("vertices"), R"(with_vertices(self, vertices)
--

The same mesh with its vertices elsewhere.

Parameters
----------
vertices : array_like, (n, 3)
    World coordinates, in the mesh's order. Normals stay as they are.

Raises
------
MismatchError
    Another number of vertices.
)")
        .def("__repr__",
             [](const Mesh& mesh) {
                 return "<filigree.Mesh: " + std::to_string(mesh.vertex_count()) + " vertices, " +
                        std::to_string(mesh.face_count()) + " faces>";
             })
        .def(py::pickle(&state_of, &mesh_of_state));

    m.def(
        "make",
        [](const std::string& shape, unsigned resolution, double frequency, double amplitude, double size,
           double length, double thickness) {
            const ShapeOptions options{resolution, frequency, amplitude, size, length, thickness};
            return without_interpreter([&] { return std::make_shared<Mesh>(make_shape(shape, options).value()); });
        },
        py::arg("shape"), py::kw_only(), py::arg("resolution") = 64, py::arg("frequency") = 5.0,
        py::arg("amplitude") = 0.04, py::arg("size") = 1.0, py::arg("length") = 4.0, py::arg("thickness") = 0.3,
        R"(make(shape, *, resolution=64, frequency=5.0, amplitude=0.04, size=1.0, length=4.0, thickness=0.3)
--

A built-in shape.

Parameters
----------
shape : str
    'wavy-cube', 'wavy-sphere', 'wavy-plane', 'wavy-plate', 'bar', 'cylinder' or 'torus'.
resolution : int
    Quads along a side, 1 to 8192.
frequency, amplitude : float
    Waves along a side, and their height as a fraction of the side or radius.
size : float
    Side or diameter, model units.
length : float
    Bar and cylinder: in sides or diameters.
thickness : float
    Torus: radius of the tube in radii of the ring. Wavy plate: in sides.

Raises
------
UsageError
    An unknown shape, or a number outside its range.

Examples
--------
>>> filigree.make("torus", resolution=8)
<filigree.Mesh: 128 vertices, 128 faces>
)");
}

} // namespace filigree::python
