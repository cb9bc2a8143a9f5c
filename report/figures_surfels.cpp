// Our own figure of surfels: drawn to a surface of particles each step, as the report criticises, and carried.
#include "figures.h"
#include "figures_layout.h"

#include "filigree/core/text.h"
#include "filigree/hierarchy/blend_code.h"
#include "filigree/melting/particle_field.h"
#include "filigree/mesh.h"
#include "filigree/mesh/surfels.h"
#include "filigree/pose.h"
#include "filigree/restore.h"
#include "filigree/sample.h"
#include "filigree/strip.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace filigree::report {

namespace {

constexpr double kTurn = 90; // degrees, at the end
constexpr int kSteps = 30;

std::unique_ptr<SpaceWarp> warp_at(const Box& box, double share) {
    std::vector<std::unique_ptr<SpaceWarp>> warps;
    warps.push_back(make_twist(box, Axis::z, share * kTurn));
    warps.push_back(make_bend(box, Axis::z, share * kTurn));
    return make_chain(std::move(warps));
}

/// The matter of a mesh as particles at rest.
MatterParticles particles_of(const Mesh& mesh, std::size_t count, const RunContext& context) {
    const double spacing = spacing_for_count(mesh, count, {}, context).value();
    const Lattice lattice = make_lattice(world_bounds(mesh), {.spacing = spacing}).value();
    MatterParticles particles;
    particles.positions = points_inside(lattice, sample_inside(mesh, lattice, {}, context).value()).positions;
    particles.volumes.assign(particles.positions.size(), float(spacing * spacing * spacing));
    particles.spacing = float(spacing);
    return particles;
}

/// Surfels that go along with the matter and are then drawn to the surface of its particles, step by step, as Mueller
/// et al. 2004 do, facing as it does. The displacement of each step is exact: all of the error is the drawing's.
Surfels drawn_to_particles(const Mesh& mesh, Surfels surfels, const MatterParticles& rest, const RunContext& context) {
    const Box box = world_bounds(mesh);
    const std::vector<Vec3f> start = surfels.positions;
    std::vector<Vec3f> before = start;
    for (int step = 1; step <= kSteps; ++step) {
        const auto warp = warp_at(box, double(step) / kSteps);
        const std::vector<Vec3f> now = warp_positions(*warp, start, mesh.origin, context);
        MatterParticles particles = rest;
        particles.positions = warp_positions(*warp, rest.positions, mesh.origin, context);
        const ParticleField field = make_particle_field(particles, {}, context).value();
        for (std::size_t i = 0; i < surfels.size(); ++i) {
            Vec3f& place = surfels.positions[i];
            place += now[i] - before[i];
            Vec3f gradient;
            const float value = field.value(place, &gradient);
            if (!(gradient.squaredNorm() > 0)) continue;
            const Vec3f way = value / gradient.squaredNorm() * gradient; // one Newton step, at most a spacing
            place -= std::min(1.0f, particles.spacing / way.norm()) * way;
            const Vec3f normal = -gradient.normalized(), across = normal.unitOrthogonal();
            surfels.u[i] = surfels.rest_radius[i] * across;
            surfels.v[i] = surfels.rest_radius[i] * normal.cross(across);
        }
        before = now;
    }
    return surfels;
}

double rms(std::span<const Vec3f> a, std::span<const Vec3f> b) {
    double sum = 0;
    for (std::size_t v = 0; v < a.size(); ++v) sum += (a[v] - b[v]).cast<double>().squaredNorm();
    return std::sqrt(sum / double(a.size())) / bounds(b).diagonal();
}

} // namespace

Figure draw_surfels(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 196, kRmsRoom = 22;
    const RunContext& context = renderer.context();
    const Mesh cube = make_wavy_cube({.resolution = 64});
    const MatterParticles particles = particles_of(cube, 4000, context);
    const auto warp = warp_at(world_bounds(cube), 1);
    Mesh full = cube;
    full.positions = warp_positions(*warp, cube.positions, cube.origin, context);

    const Surfels rest = make_surfels(cube, context).value();
    const Surfels drawn = drawn_to_particles(cube, rest, particles, context);
    const std::vector<Vec3f> truth = warp_positions(*warp, rest.positions, cube.origin, context);

    const Model model = strip(cube, {.base = 1000}, context).value().model;
    const Pose pose = warp_pose(*warp, model, context);
    const Restorer restorer = Restorer::create(model, {}, context).value();
    const std::vector<Vec3f> restored = restorer.positions(pose, context).value();
    const Surfels carried =
        split_surfels(carried_surfels(rest, restored, vertex_gradients(model.detail, pose.gradients))).value();

    const double drawn_error = rms(drawn.positions, truth), carried_error = rms(restored, full.positions);
    Page page = captioned_page(
        content_height(1, kPanelHeight) + kRmsRoom, "Surfels",
        fmt::format(
            "The wavy cube as {} surfels, twisted and bent by {:.0f} degrees in {} steps. (ii) They go along with the "
            "matter and are drawn to the surface of {} particles each step, as Mueller et al. do: the waves "
            "are lost. (iii) They are carried by the positions and gradients of a driver of {} vertices, and "
            "split where they are stretched. Below, the distance from deforming every vertex (i).",
            with_commas(rest.size()), kTurn, kSteps, with_commas(particles.positions.size()),
            with_commas(model.driver().vertices.size())));
    const std::vector<Panel> panels = panels_in_rows(1, 3, kPanelHeight);
    const Mesh* all[] = {&full};
    const Camera camera = common_camera(all, Vec3d(0.45, -0.95, 0.42), panels[0]);
    const std::tuple<const char*, const char*, Mesh, double> parts[] = {
        {"i", "every vertex deformed", full, 0},
        {"ii", "surfels drawn to particles", surfel_polygons(drawn), drawn_error},
        {"iii", "surfels carried", surfel_polygons(carried), carried_error}};
    for (std::size_t k = 0; k < 3; ++k) {
        const auto& [number, text, mesh, error] = parts[k];
        draw_mesh(page, panels[k], renderer, mesh, {}, camera);
        subcaption(page, panels[k], number, text);
        if (error > 0)
            page.text("rms " + power_text(error),
                      {panels[k].centre().x(), panels[k].top_left.y() + kPanelHeight + kSubcaptionRoom + 14},
                      {.size = 12, .align = Align::centre});
    }
    return {std::move(page),
            {{"surfels", rest.size()},
             {"surfels_split", carried.size()},
             {"particles", particles.positions.size()},
             {"drawn_rms", drawn_error},
             {"carried_rms", carried_error},
             {"ratio", drawn_error / carried_error}}};
}

} // namespace filigree::report
