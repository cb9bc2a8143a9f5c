// Figures 2.1, 2.5, 2.9, 2.10, 3.1 and our own: meshes as the renderer draws them.
#include "figures.h"
#include "figures_layout.h"

#include "filigree/core/text.h"
#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/reference.h"
#include "filigree/render.h"
#include "filigree/restore.h"
#include "filigree/sample.h"
#include "filigree/sample/closure.h"
#include "filigree/sample/inside_rays.h"
#include "filigree/strip.h"

#include "interactive/fidelity.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace filigree::report {

struct FigureRenderer::Graphics {
    HeadlessContext gl = HeadlessContext::create().value();
    Renderer renderer = Renderer::create().value();
};

FigureRenderer::FigureRenderer(double scale, unsigned passes, std::optional<Mesh> scan, const RunContext& context)
    : scale_(scale), passes_(passes), scan_(std::move(scan)), context_(context) {}
FigureRenderer::~FigureRenderer() = default;

namespace {

/// Lets what is not solid, the ground's shadow, run out towards the picture's borders, so that no box is seen.
void fade_borders(Picture& picture) {
    const double w = picture.width, h = picture.height, reach = 0.16 * std::min(w, h);
    for (unsigned y = 0; y < picture.height; ++y)
        for (unsigned x = 0; x < picture.width; ++x) {
            std::uint8_t& alpha = picture.pixel(x, y)[3];
            if (alpha == 255) continue;
            const double inside = std::min({x + 0.5, w - x - 0.5, y + 0.5, h - y - 0.5}) / reach;
            const double t = std::min(1.0, inside);
            alpha = static_cast<std::uint8_t>(std::lround(alpha * t * t * (3 - 2 * t)));
        }
}

} // namespace

void FigureRenderer::start() {
    if (!graphics_) graphics_ = std::make_unique<Graphics>();
}

Picture FigureRenderer::picture(const Mesh& mesh, const Look& look, const Camera& camera, double width, double height) {
    start();
    const Drawable drawable = Drawable::surface(mesh, look.surface, context()).value();
    Scene scene;
    scene.objects.push_back({&drawable, look.appearance});
    scene.objects.back().appearance.edge_width *= static_cast<float>(scale_);
    scene.fixed_ground = look.ground_level.has_value();
    scene.ground_level = look.ground_level.value_or(0);
    return picture(std::move(scene), camera, width, height);
}

Picture FigureRenderer::picture(Scene scene, const Camera& camera, double width, double height) {
    start();
    scene.background.transparent = true; // the page is white
    scene.up = UpAxis::z;
    PictureOptions options;
    options.width = static_cast<unsigned>(std::lround(scale_ * width));
    options.height = static_cast<unsigned>(std::lround(scale_ * height));
    options.passes = passes_;
    Picture picture = graphics_->renderer.picture(scene, camera, options, context_).value();
    fade_borders(picture);
    return picture;
}

using Look = FigureRenderer::Look;

Look with_edges(float width) {
    Look look;
    look.surface.shading = Shading::flat;
    look.appearance.edges = true;
    look.appearance.edge_width = width;
    return look;
}

Camera common_camera(std::span<const Mesh* const> meshes, const Vec3d& direction, const Panel& panel) {
    std::vector<CameraPoints> points;
    for (const Mesh* mesh : meshes) points.push_back({mesh->positions, mesh->origin});
    return fit_camera(points, direction, Vec3d::UnitZ(), panel.width / panel.height, 26, 0.04);
}

void draw_mesh(Page& page, const Panel& panel, FigureRenderer& renderer, const Mesh& mesh, const Look& look,
               const Camera& camera) {
    page.picture(renderer.picture(mesh, look, camera, panel.width, panel.height), panel.top_left, panel.width,
                 panel.height);
}

namespace {

const Vec3d kFromCorner(0.62, -0.86, 0.52); // over the cube's front right edge

Model stripped_model(const Mesh& mesh, const StripOptions& options, const RunContext& context) {
    return strip(mesh, options, context).value().model;
}

/// Mean distance of the vertices of a cube's upper side along an axis from the plane that their rim is in. The
/// outermost rows are left out: the waves of the neighbouring sides reach as far.
double mean_height(const Mesh& rest, const Mesh& now, Eigen::Index axis, double plane) {
    double sum = 0, count = 0;
    for (std::size_t v = 0; v < rest.vertex_count(); ++v) {
        const Vec3f& p = rest.positions[v];
        if (p[axis] < 0.45f || std::abs(p[(axis + 1) % 3]) > 0.45f || std::abs(p[(axis + 2) % 3]) > 0.45f) continue;
        sum += std::abs(double(now.positions[v][axis]) - plane);
        ++count;
    }
    return sum / count;
}

} // namespace

Figure draw_wavy_cube(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 400;
    const ShapeOptions shape{.resolution = 264};
    const Mesh cube = make_wavy_cube(shape);
    Page page = captioned_page(
        content_height(1, kPanelHeight) - kSubcaptionRoom, "Figure 2.1",
        fmt::format(
            "The object of the figures that follow: a cube of {} quads whose sides carry the waves of eq.\u00a02.1, "
            "{:.0f} along each side. The quads along its edges are flat, so that the sides meet without a gap.",
            with_commas(cube.face_count()), shape.frequency));
    const Panel panel{{100, kFigureMargin}, kFigureWidth - 200, kPanelHeight};
    const Mesh* meshes[] = {&cube};
    draw_mesh(page, panel, renderer, cube, {}, common_camera(meshes, kFromCorner, panel));
    return {std::move(page),
            {{"vertices", cube.vertex_count()}, {"faces", cube.face_count()}, {"frequency", shape.frequency}}};
}

Figure draw_inside_points(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 400;
    const RunContext& context = renderer.context();
    const Mesh cube = make_wavy_cube({.resolution = 96});
    const Box box = bounds(cube.positions);
    const double spacing = spacing_for_count(cube, 6000, {}, context).value();
    const Lattice lattice = make_lattice(box, {.spacing = spacing}).value();
    InsideReport report;
    const Occupancy inside = sample_inside(cube, lattice, {}, context, &report).value();
    const LatticePoints points = points_inside(lattice, inside);

    Page page = captioned_page(
        content_height(1, kPanelHeight) - kSubcaptionRoom, "Figure 2.5",
        fmt::format(
            "The points of a regular lattice that lie inside the cube, {} of {}. The front of the surface is left "
            "out. Each row of the lattice crosses the surface {:.1f} times on average.",
            with_commas(points.positions.size()), with_commas(static_cast<std::size_t>(lattice.point_count())),
            double(report.scan.crossings) / (double(lattice.counts()[1]) * double(lattice.counts()[2]))));
    const Panel panel{{100, kFigureMargin}, kFigureWidth - 200, kPanelHeight};
    renderer.start();
    const Drawable surface = Drawable::surface(cube, {}, context).value();
    const Drawable balls =
        Drawable::points(points.positions, cube.origin, {.radius = static_cast<float>(0.3 * lattice.spacing)}, context)
            .value();
    Appearance red, blue;
    red.color = {0.80f, 0.22f, 0.18f};
    blue.color = {0.20f, 0.42f, 0.80f};
    const double front = box.min.y() + 0.12 * box.size().y(); // behind the waves of the front side
    red.clip = ClipPlane{-Vec3d::UnitY(), -front};
    Scene scene;
    scene.objects = {{&surface, red}, {&balls, blue}};
    const Mesh* meshes[] = {&cube};
    const Camera camera = common_camera(meshes, Vec3d(0.32, -0.94, 0.34), panel);
    page.picture(renderer.picture(std::move(scene), camera, panel.width, panel.height), panel.top_left, panel.width,
                 panel.height);
    return {std::move(page),
            {{"inside", points.positions.size()}, {"lattice", lattice.counts()}, {"crossings", report.scan.crossings}}};
}

/// The cases of figures 2.3 and 2.4, each asked from an eye that makes the ray meet the cube exactly there.
Figure draw_border_rays(FigureRenderer& renderer) {
    struct Case {
        const char* name;
        Vec3d through, direction;
    };
    const Case cases[] = {
        {"a vertex of four quads", {0, -0.5, 0.25}, {0.25, 1, -0.25}},
        {"a corner of three quads", {-0.5, -0.5, 0.5}, {1, 1, -1}},
        {"an edge of two quads", {0.125, -0.5, 0.25}, {0.25, 1, -0.5}},
        {"a corner, touched", {-0.5, -0.5, 0.5}, {1, -1, 0.25}},
        {"an edge, touched", {0.125, -0.5, 0.5}, {0.25, 1, 1}},
        {"along an edge", {0, -0.5, 0.5}, {1, 0, 0}},
    };
    constexpr double kPanelHeight = 200;
    constexpr float kRadius = 0.035f;
    const RunContext& context = renderer.context();
    const Mesh cube = make_wavy_cube({.resolution = 4, .amplitude = 0});
    const std::vector<Triangle> triangles = weld_triangles(cube, context).value().triangles;
    Page page = captioned_page(content_height(2, kPanelHeight), "Rays at the border",
                               "Points on rays that meet a cube of quads exactly at a vertex or an edge, told by the "
                               "parity of crossings from an eye on "
                               "the same line. Blue points are inside, grey ones outside. Piercing counts once and "
                               "touching not at all, without a list "
                               "of cases: the point counts as moved by an infinitely small step.");
    const std::vector<Panel> panels = panels_in_rows(2, 3, kPanelHeight);
    renderer.start();
    const Drawable wires = Drawable::surface(cube, {}, context).value();
    Json values = Json::array();
    for (std::size_t c = 0; c < std::size(cases); ++c) {
        const Case& shown = cases[c];
        const Vec3d eye = shown.through - 4 * shown.direction;
        const RayParity rays = RayParity::create(cube.positions, triangles, eye, context).value();
        std::vector<Vec3f> inside, outside;
        std::size_t wrong = 0;
        for (int step = -5; step <= 9; ++step) {
            const Vec3d p = shown.through + step / 8.0 * shown.direction;
            const bool is_inside = rays.contains(p);
            (is_inside ? inside : outside).push_back(p.cast<float>());
            const double depth = 0.5 - p.cwiseAbs().maxCoeff(); // below the cube's surface; 0 is on it
            wrong += depth != 0 && is_inside != (depth > 0);
        }
        Scene scene;
        Appearance wire, blue, grey;
        wire.surface = false;
        wire.edge_width = 1.2f;
        blue.color = {0.20f, 0.42f, 0.80f};
        grey.color = {0.62f, 0.63f, 0.65f};
        scene.objects.push_back({&wires, wire});
        std::vector<Drawable> balls;
        balls.reserve(2);
        for (const auto& [points, look] : {std::pair(&inside, blue), std::pair(&outside, grey)}) {
            if (points->empty()) continue;
            balls.push_back(Drawable::points(*points, Vec3d::Zero(), {.radius = kRadius}, context).value());
            scene.objects.push_back({&balls.back(), look});
        }
        scene.ground = false;
        const CameraPoints all[] = {
            {cube.positions, cube.origin}, {inside, Vec3d::Zero(), kRadius}, {outside, Vec3d::Zero(), kRadius}};
        const Panel& panel = panels[c];
        const Camera camera =
            fit_camera(all, Vec3d(0.42, -0.9, 0.36), Vec3d::UnitZ(), panel.width / panel.height, 26, 0.04);
        page.picture(renderer.picture(std::move(scene), camera, panel.width, panel.height), panel.top_left, panel.width,
                     panel.height);
        constexpr const char* kNumbers[] = {"i", "ii", "iii", "iv", "v", "vi"};
        subcaption(page, panel, kNumbers[c], shown.name);
        values.push_back(
            {{"case", shown.name}, {"inside", inside.size()}, {"outside", outside.size()}, {"wrong", wrong}});
    }
    return {std::move(page), {{"cases", values}}};
}

Figure draw_removed_detail(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 310;
    const Mesh cube = make_wavy_cube({.resolution = 64});
    const ReferenceModel model = strip_to_reference(cube, {.max_levels = 3}, renderer.context()).value();
    const Mesh meshes[] = {level_mesh(model, 2), level_mesh(model, 0)};
    Page page = captioned_page(
        content_height(1, kPanelHeight), "Figure 2.9",
        fmt::format("The cube of {} quads after one and after three rounds of removing every second row and column. "
                    "One round keeps the waves; after three, eight quads along a side are too few for them.",
                    with_commas(cube.face_count())));
    const std::vector<Panel> panels = panels_in_rows(1, 2, kPanelHeight);
    const Mesh* all[] = {&cube};
    const Camera camera = common_camera(all, kFromCorner, panels[0]);
    for (std::size_t k = 0; k < 2; ++k) {
        draw_mesh(page, panels[k], renderer, meshes[k], with_edges(k == 0 ? 0.4f : 0.6f), camera);
        subcaption(page, panels[k], k == 0 ? "left" : "right",
                   fmt::format("{}: {} vertices", k == 0 ? "1 iteration" : "3 iterations",
                               with_commas(meshes[k].vertex_count())));
    }
    return {std::move(page), {{"vertices", {meshes[0].vertex_count(), meshes[1].vertex_count()}}}};
}

Figure draw_deformation_process(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 220, kStretch = 2.5;
    const RunContext& context = renderer.context();
    const Mesh cube = make_wavy_cube({.resolution = 64});
    const ReferenceModel model = strip_to_reference(cube, {.max_levels = 5}, context).value();
    const auto warp = make_stretch(world_bounds(cube), Axis::x, kStretch).value();
    const Mesh low = level_mesh(model, 0);
    Mesh stretched = low;
    stretched.positions = warp_positions(*warp, low.positions, model.mesh.origin, context);
    const Mesh returned = restore_reference(model, stretched.positions, {}, context).value();

    const double before = mean_height(cube, cube, 2, 0.5), after = mean_height(cube, returned, 2, 0.5),
                 ends = mean_height(cube, returned, 0, 0.5 * kStretch);
    Page page = captioned_page(
        content_height(2, kPanelHeight), "Figure 2.10",
        fmt::format(
            "The cube through the whole process: five levels of detail are removed, the {} vertices that are "
            "left are stretched to {:.1f} times the length, and the detail is returned by the inverse law (eq.\u00a0"
            "2.14). The waves of the four stretched sides come back with {:.0f}\u00a0% of their mean height, those "
            "of the two ends with {:.0f}\u00a0%.",
            with_commas(low.vertex_count()), kStretch, 100 * after / before, 100 * ends / before));
    const std::vector<Panel> panels = panels_in_rows(2, 2, kPanelHeight);
    const Mesh* all[] = {&cube, &returned};
    const Camera camera = common_camera(all, kFromCorner, panels[0]);
    const std::tuple<const char*, const char*, const Mesh*, Look> parts[] = {
        {"i", "original", &cube, {}},
        {"ii", "low detail", &low, with_edges(0.6f)},
        {"iii", "stretched with low detail", &stretched, with_edges(0.6f)},
        {"iv", "detail returned", &returned, {}}};
    for (std::size_t k = 0; k < 4; ++k) {
        const auto& [number, text, mesh, look] = parts[k];
        draw_mesh(page, panels[k], renderer, *mesh, look, camera);
        subcaption(page, panels[k], number, fmt::format("{}, {} vertices", text, with_commas(mesh->vertex_count())));
    }
    return {std::move(page),
            {{"stretch", kStretch},
             {"driver_vertices", low.vertex_count()},
             {"mean_height", before},
             {"mean_height_returned", after},
             {"mean_height_of_ends", ends}}};
}

Figure draw_extreme_deformation(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 220;
    const RunContext& context = renderer.context();
    const Mesh face = make_wavy_plane({.resolution = 64});
    const ReferenceModel model = strip_to_reference(face, {}, context).value();
    const Mesh corners = level_mesh(model, 0);
    Mesh moved = corners;
    for (Vec3f& p : moved.positions) { // by hand: one corner up and out, its opposite down, the others pulled apart
        const bool right = p.x() > 0, back = p.y() > 0;
        p = right ? (back ? Vec3f(0.80f, 0.55f, 0.45f) : Vec3f(0.45f, -0.75f, -0.20f))
                  : (back ? Vec3f(-0.50f, 0.90f, -0.05f) : Vec3f(-0.70f, -0.35f, 0.25f));
    }
    const Mesh returned = restore_reference(model, moved.positions, {}, context).value();

    Page page = captioned_page(
        content_height(2, kPanelHeight), "Figure 3.1",
        fmt::format("An extreme deformation of one face. Of the {} vertices only the {} corners are moved, each "
                    "somewhere else; all others are put back from their records, level by level.",
                    with_commas(face.vertex_count()), corners.vertex_count()));
    const std::vector<Panel> panels = panels_in_rows(2, 2, kPanelHeight);
    const Mesh* all[] = {&face, &returned, &moved};
    const double floor = std::min(world_bounds(returned).min.z(), world_bounds(moved).min.z()) - 0.05;
    const Camera camera = common_camera(all, Vec3d(0.25, -0.85, 0.62), panels[0]);
    const std::tuple<const char*, const char*, const Mesh*, Look> parts[] = {
        {"i", "original face", &face, {}},
        {"ii", "all detail removed", &corners, with_edges(1.0f)},
        {"iii", "the corners moved", &moved, with_edges(1.0f)},
        {"iv", "detail returned", &returned, {}}};
    for (std::size_t k = 0; k < 4; ++k) {
        auto [number, text, mesh, look] = parts[k];
        look.ground_level = floor;
        draw_mesh(page, panels[k], renderer, *mesh, look, camera);
        subcaption(page, panels[k], number, fmt::format("{}, {} vertices", text, with_commas(mesh->vertex_count())));
    }
    return {std::move(page), {{"vertices", face.vertex_count()}, {"moved_vertices", corners.vertex_count()}}};
}

Figure draw_fidelity(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 196, kPanelWidth = 162, kGap = 10, kRmsRoom = 22, kTurn = 60;
    const RunContext& context = renderer.context();
    const Mesh cube = make_wavy_cube({.resolution = 64});
    const Box box = world_bounds(cube);
    std::vector<std::unique_ptr<SpaceWarp>> warps;
    warps.push_back(make_twist(box, Axis::z, kTurn));
    warps.push_back(make_bend(box, Axis::z, kTurn));
    const auto warp = make_chain(std::move(warps));
    Mesh full = cube;
    full.positions = warp_positions(*warp, cube.positions, cube.origin, context);

    const ReferenceModel reference = strip_to_reference(cube, {.max_levels = 2}, context).value();
    const std::size_t driver_count = reference.driver().vertices.size();
    const Model blend = stripped_model(cube, {.base = driver_count}, context);
    const std::vector<Vec3f> reference_pose = warp_positions(*warp, driver_positions(reference), cube.origin, context);
    const Pose blend_pose = warp_pose(*warp, driver_positions(blend), cube.origin, context);
    const Restorer blend_restorer = Restorer::create(blend, {}, context).value();
    const std::pair<const char*, std::vector<Vec3f>> methods[] = {
        {"reference code", restore_reference(reference, reference_pose, {}, context).value().positions},
        {"wrap deformer", bench::wrap_positions(blend, blend_pose, context)},
        {"blend code", blend_restorer.positions(blend_pose, context).value()}};

    Page page = captioned_page(
        kFigureMargin + 2 * kPanelHeight + kSubcaptionRoom + kRmsRoom + 10, "Codes compared",
        fmt::format(
            "The wavy cube, {} vertices, twisted and bent by {:.0f} degrees. (i) Every vertex is deformed. (ii) to "
            "(iv) Only a driver of about {} vertices is, and the rest follows: by the report’s records, "
            "carried along in the frames of the driver’s triangles, and by the blend code with the gradients "
            "of the deformation. Below, how far each vertex is from where (i) has it.",
            with_commas(cube.vertex_count()), kTurn, with_commas(driver_count)));
    const auto panel_at = [&](std::size_t row, std::size_t column) {
        return Panel{{kFigureMargin + double(column) * (kPanelWidth + kGap),
                      kFigureMargin + double(row) * (kPanelHeight + kSubcaptionRoom + 6)},
                     kPanelWidth,
                     kPanelHeight};
    };
    const Mesh* all[] = {&full};
    const Camera camera = common_camera(all, Vec3d(0.45, -0.95, 0.42), panel_at(0, 0));
    draw_mesh(page, panel_at(0, 0), renderer, full, {}, camera);
    subcaption(page, panel_at(0, 0), "i", "every vertex");

    const ValueRange decades{-6, -2};
    const char* numbers[] = {"ii", "iii", "iv"};
    Json values = Json::object();
    for (std::size_t k = 0; k < 3; ++k) {
        Mesh mesh = full;
        mesh.positions = methods[k].second;
        draw_mesh(page, panel_at(0, k + 1), renderer, mesh, {}, camera);
        subcaption(page, panel_at(0, k + 1), numbers[k], methods[k].first);

        const MeshDistance distance = mesh_distance(mesh, full, 0, context).value();
        const VertexDistance& d = *distance.vertices;
        std::vector<float> exponents;
        for (const float units : d.per_vertex)
            exponents.push_back(static_cast<float>(std::log10(std::max(1e-12, distance.relative(double(units))))));
        Look heat;
        heat.surface.scalars = {exponents, ColorMap::sequential, decades};
        heat.appearance.gloss = 0;
        const Panel panel = panel_at(1, k + 1);
        draw_mesh(page, panel, renderer, mesh, heat, camera);
        page.text("rms " + power_text(distance.relative(d.rms)),
                  {panel.centre().x(), panel.top_left.y() + panel.height + 16}, {.size = 12, .align = Align::centre});
        values[methods[k].first] = {{"rms", distance.relative(d.rms)}, {"max", distance.relative(d.max)}};
    }
    const Panel key = panel_at(1, 0);
    page.legend(ColorMap::sequential, decades, "distance / diagonal", key.top_left + Point(30, 12), kPanelHeight - 20,
                LegendScale::powers_of_ten);
    return {std::move(page),
            {{"vertices", cube.vertex_count()}, {"driver_vertices", driver_count}, {"methods", values}}};
}

} // namespace filigree::report
