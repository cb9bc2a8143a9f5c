// Every soft preset falls from 1.5 times its own height onto the ground and onto a cuboid's edge.
//   soft_falls [--sizes 0.05,0.2,1,2] [--presets a,b] [--particles N] [--seconds S] MESH...
// A line each: the smallest volume ratio of a cell (its mean gradient's, in any substep, and its corners', at the end
// of a frame), in how many frames cells were inverted, energy at its most over that before the hit, and what a frame
// costs. Ends with 1 if a cell was inverted.
#include "filigree/core/now_seconds.h"
#include "filigree/io/mesh_file.h"
#include "filigree/physics/named_materials.h"
#include "filigree/physics/simulation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <sstream>
#include <string>

namespace {

using namespace filigree;

struct Options {
    std::vector<double> sizes = {0.05, 0.2, 1, 2}; ///< m, longest side
    std::vector<std::string> presets;              ///< empty: all that are soft
    std::size_t particles = 8000;
    double seconds = 0.75; ///< after the hit, and as long as a fall from the body's height takes
    std::vector<std::filesystem::path> meshes;
};

std::vector<std::string> split(const std::string& text) {
    std::vector<std::string> parts;
    std::istringstream in(text);
    for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
    return parts;
}

Options read_options(int count, char** arguments) {
    Options options;
    for (int a = 1; a < count; ++a) {
        const std::string name = arguments[a];
        const auto value = [&] { return a + 1 < count ? std::string(arguments[++a]) : std::string(); };
        if (name == "--sizes") {
            options.sizes.clear();
            for (const std::string& size : split(value())) options.sizes.push_back(std::atof(size.c_str()));
        } else if (name == "--presets") {
            options.presets = split(value());
        } else if (name == "--particles") {
            options.particles = std::size_t(std::atol(value().c_str()));
        } else if (name == "--seconds") {
            options.seconds = std::atof(value().c_str());
        } else {
            options.meshes.emplace_back(name);
        }
    }
    return options;
}

/// Wood and metal are too stiff to be stepped as elastic at most sizes.
bool is_soft(const Material& material) {
    return (material.model == MaterialModel::fem || material.model == MaterialModel::springs) &&
           material.young_modulus < 1e8;
}

Box box_of(const Vectors& points) {
    Box box;
    for (std::size_t i = 0; i < points.size(); ++i) box.extend(points[i].cast<double>());
    return box;
}

World world_of(bool has_edge, double height) {
    World world;
    Obstacle ground;
    ground.shape = HalfSpace{};
    if (has_edge) {
        Obstacle edge;
        const double half = height / std::sqrt(2.0); // its highest edge at the origin, along z
        edge.shape = Cuboid{{0, -half, 0}, {height, height, 4 * height}};
        edge.motion.centre = {0, -half, 0};
        edge.motion.angle.constant = {0, 0, std::numbers::pi / 4};
        world.obstacles.push_back(edge);
        ground.shape = HalfSpace{{0, -height, 0}};
    }
    world.obstacles.push_back(ground);
    return world;
}

/// The smallest volume ratio at a corner of a cell; how many cells are inverted at a corner, and in the mean.
struct Corners {
    double least = 1;
    std::size_t inverted = 0, inverted_means = 0;
};
Corners corners_of(const Cells& cells, const Vectors& positions) {
    Corners found;
    for (const auto& corners : cells.cell_corners) {
        std::array<Vec3d, 8> p;
        for (std::size_t c = 0; c < 8; ++c) p[c] = positions[corners[c]].cast<double>();
        const double cube = cells.spacing * cells.spacing * cells.spacing;
        double least = 1;
        Mat3d mean = Mat3d::Zero();
        for (std::size_t c = 0; c < 8; ++c) {
            Mat3d edges;
            for (int axis = 0; axis < 3; ++axis) {
                const std::size_t bit = std::size_t{1} << axis;
                edges.col(axis) = p[c | bit] - p[c & ~bit];
            }
            least = std::min(least, edges.determinant() / cube);
            mean += edges / 8;
        }
        found.least = std::min(found.least, least);
        found.inverted += least <= 0 ? 1 : 0;
        found.inverted_means += mean.determinant() <= 0 ? 1 : 0;
    }
    return found;
}

/// Whether all went well.
bool fall(const std::string& preset, const std::shared_ptr<const Body>& body, const std::string& shape, double size,
          bool has_edge, double seconds) {
    const RunContext context(1);
    const Box box = box_of(body->rest);
    const double height = box.size().y(), g = 9.81;
    Actor actor;
    actor.body = body;
    actor.placement.translation() = -Vec3d(box.centre().x(), box.min.y() - 0.02 * height, box.centre().z());
    actor.velocity = {0, -std::sqrt(2 * g * 1.5 * height), 0};
    Simulation falling =
        Simulation::create(world_of(has_edge, height), {actor}, {.automatic_rigid = false}, context).value();
    const double start = falling.energy(context).total(), zero = start - falling.energy(context).kinetic;
    const auto frames = std::size_t(60 * (seconds + std::sqrt(3 * height / g)));
    double least = 1, most_energy = 0, most_stretch = 1;
    Corners worst;
    std::size_t bad = 0, bad_ends = 0, bad_corners = 0, substeps = 0, most_substeps = 0;
    const double began = now_seconds();
    for (std::size_t frame = 0; frame < frames; ++frame) {
        const FrameReport report = falling.advance(context).value();
        const Corners corners = corners_of(body->cells, falling.positions(0));
        least = std::min(least, double(report.least_volume_ratio));
        most_stretch = std::max(most_stretch, double(report.most_stretch));
        bad += report.least_volume_ratio > 0 ? 0 : 1;
        bad_ends += corners.inverted_means > 0 ? 1 : 0;
        bad_corners += corners.inverted > 0 ? 1 : 0;
        worst.inverted = std::max(worst.inverted, corners.inverted);
        worst.least = std::min(worst.least, corners.least);
        substeps += report.substeps;
        most_substeps = std::max<std::size_t>(most_substeps, report.substeps);
        most_energy = std::max(most_energy, (falling.energy(context).total() - zero) / (start - zero));
    }
    const double spent = now_seconds() - began;
    std::printf("%-11s %5.2f %-14s %-6s %6.3f %4zu %4zu %7.3f %4zu %6zu %6.3f %5.2f %5zu %7.1f %7.2f %zu\n",
                preset.c_str(), size, shape.c_str(), has_edge ? "edge" : "ground", least, bad, bad_ends, worst.least,
                bad_corners, worst.inverted, most_energy, most_stretch, most_substeps,
                double(substeps) / double(frames), 1e3 * spent / double(frames), frames);
    std::fflush(stdout);
    return bad == 0;
}

} // namespace

int main(int count, char** arguments) {
    const Options options = read_options(count, arguments);
    std::printf(
        "preset       size shape          onto    least  bad ends corners  bad  cells energy  str. steps    mean "
        "ms/frm frames\n");
    bool is_good = true;
    for (const auto& path : options.meshes) {
        const Result<MeshFile> file = read_mesh(path, RunContext());
        if (!file) {
            std::fprintf(stderr, "%s\n", file.error().message.c_str());
            return 2;
        }
        Box box;
        for (const Vec3f& p : file->mesh.positions) box.extend(p.cast<double>());
        for (const NamedMaterial& named : named_materials()) {
            const std::string preset(named.name);
            if (options.presets.empty() ? !is_soft(named.material)
                                        : std::ranges::find(options.presets, preset) == options.presets.end())
                continue;
            for (const double size : options.sizes) {
                BodyOptions made{.scale = size / box.size().maxCoeff(),
                                 .cells = {.spacing = 0, .count = options.particles}};
                Result<Body> body = make_body(file->mesh, named.material, made, RunContext());
                if (!body) {
                    std::fprintf(stderr, "%s: %s\n", path.c_str(), body.error().message.c_str());
                    break;
                }
                const auto shared = std::make_shared<const Body>(*std::move(body));
                for (const bool has_edge : {false, true})
                    is_good &= fall(preset, shared, path.stem().string(), size, has_edge, options.seconds);
            }
        }
    }
    return is_good ? 0 : 1;
}
