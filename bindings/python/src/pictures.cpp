#include "models.h"

#include <filigree/io/system/file.h>
#include <filigree/mesh/up_axis.h>
#include <filigree/present/headless_renderer.h>
#include <filigree/render.h>
#include <filigree/types.h>

#include <mutex>

namespace filigree::python {

namespace {

py::array_t<std::uint8_t> take_picture(Picture&& picture) {
    const Shape shape{static_cast<py::ssize_t>(picture.height), static_cast<py::ssize_t>(picture.width), 4};
    return take<std::uint8_t>(std::move(picture.rgba), shape);
}

Picture picture_of(const py::object& given) {
    const auto pixels = py::array_t<std::uint8_t, py::array::c_style>::ensure(given);
    if (!pixels || pixels.ndim() != 3 || (pixels.shape(2) != 3 && pixels.shape(2) != 4) ||
        !py::isinstance<py::array_t<std::uint8_t>>(given))
        refuse("A picture has to be an array of uint8 of shape (height, width, 4) or (height, width, 3).");
    Picture picture(static_cast<unsigned>(pixels.shape(1)), static_cast<unsigned>(pixels.shape(0)));
    const std::size_t count = picture.rgba.size() / 4, channels = static_cast<std::size_t>(pixels.shape(2));
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < 4; ++k)
            picture.rgba[4 * i + k] = k < channels ? pixels.data()[channels * i + k] : std::uint8_t{255};
    return picture;
}

/// What is drawn: a mesh with faces, or points.
struct Subject {
    MeshPtr mesh;
    std::vector<float> values = {};
};

Subject subject_of(const py::handle& given) {
    if (py::isinstance<PyModel>(given)) return {finest_mesh(model_of(given))};
    if (is_mesh_like(given)) return {mesh_of(given)};
    auto points = std::make_shared<Mesh>();
    split_origin(double_points_of(given, "points"), *points);
    return {points};
}

Vec3f color_of(const py::object& given, const char* name) {
    const Vec3d color = vector_of(given, name);
    if ((color.array() < 0).any() || (color.array() > 1).any()) refuse(std::string(name) + " has to be from 0 to 1.");
    return color.cast<float>();
}

UpAxis up_axis_of(const std::optional<std::string>& up, const Mesh& mesh) {
    if (!up) return find_up_axis(mesh, UpAxis::y);
    return value_of<UpAxis>(*up, "up", {{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}});
}

/// OpenGL contexts are made one at a time.
std::mutex& one_renderer() {
    static std::mutex mutex;
    return mutex;
}

py::array_t<std::uint8_t> render(const py::object& what, unsigned width, unsigned height, const std::string& view_name,
                                 const std::optional<std::string>& up_name, const py::object& eye,
                                 const py::object& target, double field_of_view, const py::object& color,
                                 const py::object& background, bool transparent, bool ground, bool edges, bool surface,
                                 double point_radius, const py::object& scalars, const py::object& range,
                                 const std::string& map, unsigned passes, unsigned threads,
                                 const py::object& progress) {
    std::vector<Subject> subjects;
    if (py::isinstance<py::list>(what) || (py::isinstance<py::tuple>(what) && !is_mesh_like(what)))
        for (const py::handle one : what) subjects.push_back(subject_of(one));
    else
        subjects.push_back(subject_of(what));
    if (subjects.empty()) refuse("There is nothing to draw.");
    if (width == 0 || height == 0) refuse("width and height have to be 1 or more.");
    if (!(field_of_view >= 0 && field_of_view < 180)) refuse("field_of_view has to be from 0 to below 180.");

    ValueRange shown;
    if (!scalars.is_none()) {
        if (subjects.size() != 1) refuse("scalars belong to one object; draw it alone.");
        subjects[0].values = values_of(scalars, "scalars");
        if (subjects[0].values.size() != subjects[0].mesh->vertex_count())
            refuse(ErrorCode::mismatch, "There are " + std::to_string(subjects[0].values.size()) + " scalars for " +
                                            std::to_string(subjects[0].mesh->vertex_count()) + " vertices.");
        shown = legend_range(subjects[0].values, false);
        if (!range.is_none()) {
            const std::vector<float> ends = values_of(range, "range");
            if (ends.size() != 2 || !(ends[0] < ends[1])) refuse("range has to be two numbers, the smaller first.");
            shown = {ends[0], ends[1]};
        }
    }
    const auto colors =
        value_of<ColorMap>(map, "map", {{"sequential", ColorMap::sequential}, {"diverging", ColorMap::diverging}});

    Scene scene;
    scene.up = up_axis_of(up_name, *subjects[0].mesh);
    scene.ground = ground;
    scene.background.transparent = transparent;
    if (!background.is_none()) scene.background.top = scene.background.bottom = color_of(background, "background");
    const auto view = value_of<View>(
        view_name, "view", {{"front", View::front}, {"side", View::side}, {"top", View::top}, {"iso", View::iso}});
    std::vector<CameraPoints> points;
    for (const Subject& subject : subjects) points.push_back({subject.mesh->positions, subject.mesh->origin});
    Camera camera =
        fit_camera(points, view_direction(view, scene.up), up_vector(scene.up), double(width) / height, field_of_view);
    if (const auto at = optional_vector_of(target, "target")) camera.target = *at;
    if (const auto from = optional_vector_of(eye, "eye")) camera.eye = *from;
    if (!((camera.eye - camera.target).norm() > 0)) refuse("eye and target are the same point.");
    Appearance look;
    look.edges = edges;
    look.surface = surface;
    if (!color.is_none()) {
        look.color = color_of(color, "color");
        look.own_colors = !scalars.is_none();
    }

    return take_picture(LongCall{threads, progress}([&](const RunContext& context) {
        const std::lock_guard alone(one_renderer());
        HeadlessRenderer renderer = HeadlessRenderer::create().value();
        std::vector<Drawable> drawables;
        for (const Subject& subject : subjects) {
            const ScalarColors shades{subject.values, colors, shown};
            if (subject.mesh->face_count() == 0 || point_radius > 0)
                drawables.push_back(Drawable::points(subject.mesh->positions, subject.mesh->origin,
                                                     {static_cast<float>(point_radius), shades, subject.mesh->colors},
                                                     context)
                                        .value());
            else
                drawables.push_back(Drawable::surface(*subject.mesh, {.scalars = shades}, context).value());
        }
        for (const Drawable& drawable : drawables) scene.objects.push_back({&drawable, look});
        return renderer.picture(scene, camera, {width, height, passes}, context).value();
    }));
}

} // namespace

void add_pictures(py::module_& m) {
    m.def(
        "render", &render, py::arg("what"), py::kw_only(), py::arg("width") = 960, py::arg("height") = 720,
        py::arg("view") = "iso", py::arg("up") = py::none(), py::arg("eye") = py::none(),
        py::arg("target") = py::none(), py::arg("field_of_view") = 30.0, py::arg("color") = py::none(),
        py::arg("background") = py::none(), py::arg("transparent") = false, py::arg("ground") = true,
        py::arg("edges") = false, py::arg("surface") = true, py::arg("point_radius") = 0.0,
        py::arg("scalars") = py::none(), py::arg("range") = py::none(), py::arg("map") = "sequential",
        py::arg("passes") = 0, py::arg("threads") = 0, py::arg("progress") = py::none(),
        R"(render(what, *, width=960, height=720, view='iso', up=None, eye=None, target=None, field_of_view=30.0, color=None, background=None, transparent=False, ground=True, edges=False, surface=True, point_radius=0.0, scalars=None, range=None, map='sequential', passes=0, threads=0, progress=None)
--

Draw meshes, points and models: a picture as an array.

Parameters
----------
what : Mesh, Model, object with vertices and faces, array_like (n, 3), or a list of them
    All stand where they are, in one picture.
width, height : int
    Pixels.
view : str
    Where to look from: 'front', 'side', 'top' or 'iso'.
up : str, optional
    'x', 'y' or 'z'; None: found from the first object.
eye, target : array_like, (3,), optional
    World coordinates, in place of those that show everything.
field_of_view : float
    Vertical, degrees, below 180; 0: parallel projection.
color, background : array_like, (3,), optional
    sRGB, 0 to 1.
transparent : bool
    Alpha 0 where nothing is.
ground : bool
    Catches the shadow.
edges, surface : bool
    Draw the polygons' edges; leave the surface out.
point_radius : float
    Above 0: draw the vertices as balls of this radius, model units.
scalars : array_like, (n,), optional
    A number a vertex, shown as colour, from the first to the second of `range`.
map : str
    'sequential' for amounts, 'diverging' for signed amounts.
passes : int
    Light directions that are averaged; 0: by the size of the mesh.

Returns
-------
ndarray of uint8, (height, width, 4)
    Rows from the top, sRGB, straight alpha.

Raises
------
UnsupportedError
    No OpenGL.
UsageError, UnsuitableError, MismatchError, Cancelled

Examples
--------
>>> filigree.render(filigree.make("torus", resolution=16), width=64, height=48, passes=2).shape
(48, 64, 4)
)");
    m.def(
        "read_picture",
        [](const std::filesystem::path& path) {
            return take_picture(without_interpreter([&] { return read_picture(path).value(); }));
        },
        py::arg("path"), R"(read_picture(path)
--

A PNG or JPEG as an array of uint8, (height, width, 4).

Raises
------
NotFoundError, BadFileError, UnsupportedError, OutOfMemoryError
)");
    m.def(
        "write_picture",
        [](const py::object& picture, const std::filesystem::path& path) {
            const Picture pixels = picture_of(picture);
            without_interpreter([&] { return write_file(path, encode_png(pixels)).value(); });
        },
        py::arg("picture"), py::arg("path"), R"(write_picture(picture, path)
--

Write an array of uint8, (height, width, 4) or (height, width, 3), as PNG.

Raises
------
UsageError, UnwritableError
)");
}

} // namespace filigree::python
