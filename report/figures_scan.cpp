// Figures 2.9, 2.10 and 3.1 on a mesh that comes as triangles without any regularity.
#include "figures.h"
#include "figures_layout.h"

#include "filigree/core/text.h"
#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/present/patch_drawing.h"
#include "filigree/reference.h"
#include "filigree/remesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <cmath>

#include <fmt/format.h>

namespace filigree::report {

namespace {

constexpr double kPanelHeight = 200;
constexpr std::size_t kQuads = 50'000;
constexpr unsigned kLevels = 3;           // as in the report's figure 2.9, unless triangles are left over
constexpr double kFeatureAngle = 180;     // none: what is sharp on a scan is noise
constexpr double kStretch = 1.6;          // upwards
constexpr double kTwist = 80, kBend = 60; // degrees, about and of the longest axis
const Vec3d kFromFront(0.42, -0.90, 0.30);

/// Stands in for a scan: a wavy sphere whose vertices a simplification has picked, in triangles of any valence.
Mesh irregular_shape(const RunContext& context) {
    const Mesh sphere = make_wavy_sphere({.resolution = 128, .frequency = 4, .amplitude = 0.07});
    const Stripped stripped = strip(sphere, {.base = 25'000}, context).value();
    return level_mesh(stripped.model, 0);
}

struct Views {
    Camera rest, stretched, twisted;
};

/// One warp of the driver, and what is put back on it.
struct Returned {
    Mesh driver, mesh;
    double rms; ///< from where a warp of every vertex puts them, fraction of the diagonal
};

/// Beside the rest mesh with every vertex warped.
Returned compared(Returned result, const Mesh& rest, const SpaceWarp& warp, const RunContext& context) {
    Mesh direct = rest;
    direct.positions = warp_positions(warp, rest.positions, rest.origin, context);
    const MeshDistance distance = mesh_distance(result.mesh, direct, 0, context).value();
    result.rms = distance.relative(distance.vertices->rms);
    return result;
}

Returned put_back(const Model& model, const SpaceWarp& warp, const RunContext& context) {
    Returned result{level_mesh(model, 0), model.mesh, 0};
    const Pose pose = warp_pose(warp, model, context);
    result.driver.positions = pose.positions;
    result.mesh.positions = Restorer::create(model, {}, context).value().positions(pose, context).value();
    return compared(std::move(result), model.mesh, warp, context);
}

Returned put_back(const ReferenceModel& model, const SpaceWarp& warp, const RunContext& context) {
    Returned result{level_mesh(model, 0), model.mesh, 0};
    result.driver.positions = warp_positions(warp, result.driver.positions, model.mesh.origin, context);
    result.mesh.positions = restore_reference(model, result.driver.positions, {}, context).value().positions;
    return compared(std::move(result), model.mesh, warp, context);
}

std::unique_ptr<SpaceWarp> extreme_warp(const Box& box) {
    const Axis axis = longest_axis(box);
    std::vector<std::unique_ptr<SpaceWarp>> warps;
    warps.push_back(make_twist(box, axis, kTwist));
    warps.push_back(make_bend(box, axis, kBend));
    return make_chain(std::move(warps));
}

void draw_patched(Page& page, const Panel& panel, FigureRenderer& renderer, const QuadRemeshed& remeshed,
                  const Camera& camera) {
    renderer.start();
    const PatchDrawing drawing =
        PatchDrawing::create(remeshed.mesh, remeshed.patches, renderer.pixels(0.25), renderer.context()).value();
    Scene scene;
    drawing.add_to(scene);
    page.picture(renderer.picture(std::move(scene), camera, panel.width, panel.height), panel.top_left, panel.width,
                 panel.height);
}

} // namespace

Figure draw_remeshed_scan(FigureRenderer& renderer) {
    const RunContext& context = renderer.context();
    const Mesh scan = renderer.scan() ? *renderer.scan() : irregular_shape(context);
    QuadRemeshed remeshed =
        quad_remesh(scan, {.quads = kQuads, .levels = kLevels, .feature_angle_deg = kFeatureAngle, .attributes = false},
                    context)
            .value();
    const unsigned levels = remeshed.patches.levels;
    const ReferenceModel reference = strip_to_reference(remeshed.mesh, {.max_levels = levels}, context).value();
    const std::size_t driver_count = reference.driver().vertices.size();
    const Model blend = strip(remeshed.mesh, {.base = driver_count}, context).value().model;

    const Box box = world_bounds(remeshed.mesh);
    const auto stretch = make_stretch(box, Axis::z, kStretch).value(), extreme = extreme_warp(box);
    const Returned stretched = put_back(reference, *stretch, context);
    const Returned twisted = put_back(reference, *extreme, context), blended = put_back(blend, *extreme, context);
    const Mesh once = level_mesh(reference, levels - 1), coarsest = level_mesh(reference, 0);

    const QuadRemeshReport& report = remeshed.report;
    Page page = captioned_page(
        content_height(3, kPanelHeight), "The report’s process on a scan",
        fmt::format(
            "{} (i) becomes {} quads (ii): {} patches, each a grid of {} by {}; it is {} "
            "of its diagonal (rms) away from them. As in figure 2.9, one round (iii) and {} rounds (iv) of removing "
            "every second row and column. As in 2.10, what is left is stretched to {:.1f} times the height (v), "
            "and the detail returned by the inverse law (vi). As in 3.1, an extreme deformation: the same driver "
            "twisted and bent (vii), detail returned by the report’s code (viii), and by the blend "
            "code with a driver as large (ix).",
            renderer.scan() ? fmt::format("A scan of {} triangles", with_commas(scan.face_count()))
                            : fmt::format("A built-in shape in {} irregular triangles, in place of a scan,",
                                          with_commas(scan.face_count())),
            with_commas(remeshed.mesh.face_count()), with_commas(report.patches), remeshed.patches.side(),
            remeshed.patches.side(), power_text(report.from_input.rms), levels, kStretch));
    const std::vector<Panel> panels = panels_in_rows(3, 3, kPanelHeight);
    const Mesh *rest[] = {&scan}, *tall[] = {&stretched.mesh, &stretched.driver},
               *turned[] = {&twisted.mesh, &twisted.driver, &blended.mesh};
    const Views views{common_camera(rest, kFromFront, panels[0]), common_camera(tall, kFromFront, panels[0]),
                      common_camera(turned, kFromFront, panels[0])};
    struct Part {
        const char* number;
        std::string text;
        const Mesh* mesh;
        const Camera* camera;
        bool edges;
    };
    const auto vertices = [](const char* text, const Mesh& mesh) {
        return fmt::format("{}, {} vertices", text, with_commas(mesh.vertex_count()));
    };
    const Part parts[] = {
        {"i", vertices("original", scan), &scan, &views.rest, false},
        {"ii", vertices("quads", remeshed.mesh), nullptr, &views.rest, false},
        {"iii", vertices("1 iteration", once), &once, &views.rest, true},
        {"iv", vertices(fmt::format("{} iterations", levels).c_str(), coarsest), &coarsest, &views.rest, true},
        {"v", "stretched", &stretched.driver, &views.stretched, true},
        {"vi", "detail returned", &stretched.mesh, &views.stretched, false},
        {"vii", "twisted and bent", &twisted.driver, &views.twisted, true},
        {"viii", "detail returned, report’s code", &twisted.mesh, &views.twisted, false},
        {"ix", "detail returned, blend code", &blended.mesh, &views.twisted, false}};
    for (std::size_t k = 0; k < std::size(parts); ++k) {
        const Part& part = parts[k];
        if (part.mesh)
            draw_mesh(page, panels[k], renderer, *part.mesh, part.edges ? with_edges(0.5f) : FigureRenderer::Look{},
                      *part.camera);
        else
            draw_patched(page, panels[k], renderer, remeshed, *part.camera);
        subcaption(page, panels[k], part.number, part.text);
    }
    return {std::move(page),
            {{"input_faces", scan.face_count()},
             {"quads", remeshed.mesh.face_count()},
             {"patches", report.patches},
             {"levels", report.levels},
             {"vertices", {remeshed.mesh.vertex_count(), once.vertex_count(), coarsest.vertex_count()}},
             {"min_scaled_jacobian", report.quality.min_scaled_jacobian},
             {"rms_from_input", report.from_input.rms},
             {"rms_stretched", stretched.rms},
             {"rms_twisted", {{"reference code", twisted.rms}, {"blend code", blended.rms}}}}};
}

} // namespace filigree::report
