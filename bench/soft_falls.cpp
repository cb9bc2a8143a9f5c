// Soft presets fall from 1.5 times their own height onto the ground and onto a cuboid's edge.
//   soft_falls [--presets a,b:springs] [--sizes 0.05,0.2,0.5,1,2] [--onto ground,edge] [--particles N] [--seconds S]
//   MESH...
// Without --presets all that are soft; NAME:MODEL makes another model of one. A line a fall: the smallest volume ratio
// of a cell at the ends of frames and in any substep, how many cells were inverted at the end of the worst frame and in
// how many frames, the greatest stretch, energy at its most over that before the hit, substeps a frame (mean and most),
// frames that were not stepped stably, and seconds. Then what all falls together did. Ends with 1 if a cell was
// inverted at the end of a frame, with 2 if a mesh could not be read.
#include "filigree/core/now_seconds.h"
#include "filigree/file.h"
#include "filigree/physics/material.h"
#include "filigree/physics/simulation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <numbers>
#include <sstream>
#include <string>

namespace {

using namespace filigree;

struct Options {
    std::vector<double> sizes = {0.05, 0.2, 0.5, 1, 2}; ///< m, longest side
    std::vector<std::string> presets;                   ///< empty: all that are soft
    std::vector<std::string> onto = {"ground", "edge"};
    std::size_t particles = CellOptions().count;
    double seconds = 0.75; ///< after the hit, and as long as a fall from the body's height takes
    std::vector<std::filesystem::path> meshes;
};

std::vector<std::string> split(const std::string& text, char at = ',') {
    std::vector<std::string> parts;
    std::istringstream in(text);
    for (std::string part; std::getline(in, part, at);) parts.push_back(part);
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
        } else if (name == "--onto") {
            options.onto = split(value());
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

struct Preset {
    std::string name;
    Material material;
};

/// Wood and metal are too stiff to be stepped as elastic at most sizes.
bool is_soft(const Material& material) {
    return (material.model == MaterialModel::fem || material.model == MaterialModel::springs) &&
           material.young_modulus < 1e8;
}

std::vector<Preset> presets_of(const Options& options) {
    static const std::map<std::string, MaterialModel> kNames = {
        {"fem", MaterialModel::fem}, {"springs", MaterialModel::springs}, {"meshfree", MaterialModel::meshfree}};
    std::vector<Preset> presets;
    if (options.presets.empty())
        for (const NamedMaterial& named : named_materials())
            if (is_soft(named.material)) presets.push_back({std::string(named.name), named.material});
    for (const std::string& asked : options.presets) {
        const std::vector<std::string> parts = split(asked, ':');
        const auto found = std::ranges::find(named_materials(), std::string_view(parts[0]), &NamedMaterial::name);
        const auto model = parts.size() > 1 ? kNames.find(parts[1]) : kNames.end();
        if (found == named_materials().end() || (parts.size() > 1 && model == kNames.end())) {
            std::fprintf(stderr, "--presets: no such preset or model: %s\n", asked.c_str());
            std::exit(2);
        }
        presets.push_back({asked, found->material});
        if (model != kNames.end()) presets.back().material.model = model->second;
    }
    return presets;
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
        const double half = height / std::numbers::sqrt2; // its highest edge at the origin, along z
        edge.shape = Cuboid{{0, -half, 0}, {height, height, 4 * height}};
        edge.motion.centre = {0, -half, 0};
        edge.motion.angle.constant = {0, 0, std::numbers::pi / 4};
        world.obstacles.push_back(edge);
        ground.shape = HalfSpace{{0, -height, 0}};
    }
    world.obstacles.push_back(ground);
    return world;
}

struct Fall {
    double least_at_ends = 1, least = 1, stretch = 1, energy = 0; ///< volume ratios; |F| / sqrt(3); of that before
    std::size_t most_inverted = 0, inverted_frames = 0, substeps = 0, most_substeps = 0, frames = 0;
    double seconds = 0;
};

Fall fall(const std::shared_ptr<const Body>& body, bool has_edge, double seconds) {
    const RunContext context(1);
    const Box box = box_of(body->rest);
    const double height = box.size().y(), g = 9.81;
    Actor actor;
    actor.body = body;
    actor.placement.translation() = -Vec3d(box.centre().x(), box.min.y() - 0.02 * height, box.centre().z());
    actor.velocity = {0, -std::sqrt(2 * g * 1.5 * height), 0};
    Simulation falling =
        Simulation::create(world_of(has_edge, height), {actor}, {.automatic_rigid = false}, context).value();
    const double start = falling.energy(context).total(), moving = falling.energy(context).kinetic;
    Fall found;
    found.frames = std::size_t(60 * (seconds + std::sqrt(3 * height / g)));
    const double began = now_seconds();
    for (std::size_t frame = 0; frame < found.frames; ++frame) {
        const FrameReport report = falling.advance(context).value();
        const InvertedCells cells = falling.inverted(0);
        found.least_at_ends = std::min(found.least_at_ends, double(cells.least));
        found.least = std::min(found.least, double(report.least_volume_ratio));
        found.stretch = std::max(found.stretch, double(report.most_stretch));
        found.energy = std::max(found.energy, 1 + (falling.energy(context).total() - start) / moving);
        found.most_inverted = std::max(found.most_inverted, cells.count);
        found.inverted_frames += cells.count > 0 ? 1 : 0;
        found.substeps += report.substeps;
        found.most_substeps = std::max<std::size_t>(found.most_substeps, report.substeps);
    }
    found.seconds = now_seconds() - began;
    return found;
}

/// All falls, or those of a preset.
struct Sum {
    std::size_t falls = 0, inverted = 0, inverted_in_substeps = 0, substeps = 0, frames = 0;
    double least = 1, least_at_ends = 1, energy = 0, seconds = 0;
    void add(const Fall& fall) {
        ++falls;
        inverted += fall.inverted_frames > 0 ? 1 : 0;
        inverted_in_substeps += fall.least > 0 ? 0 : 1;
        least = std::min(least, fall.least);
        least_at_ends = std::min(least_at_ends, fall.least_at_ends);
        energy = std::max(energy, fall.energy);
        substeps += fall.substeps;
        frames += fall.frames;
        seconds += fall.seconds;
    }
    void print(const char* name) const {
        std::printf("%-20s %5zu %8zu %11zu %7.4f %7.4f %6.3f %8.1f %7.0f\n", name, falls, inverted,
                    inverted_in_substeps, least_at_ends, least, energy,
                    double(substeps) / double(std::max<std::size_t>(frames, 1)), seconds);
    }
};

void print(const Preset& preset, const std::string& shape, double size, const std::string& onto, const Fall& fall) {
    std::printf("%-20s %-14s %5.2f %-6s %7.4f %7.4f %5zu %4zu %6.2f %6.3f %7.1f %6zu %7.1f\n", preset.name.c_str(),
                shape.c_str(), size, onto.c_str(), fall.least_at_ends, fall.least, fall.most_inverted,
                fall.inverted_frames, fall.stretch, fall.energy, double(fall.substeps) / double(fall.frames),
                fall.most_substeps, fall.seconds);
    std::fflush(stdout);
}

} // namespace

int main(int count, char** arguments) {
    const Options options = read_options(count, arguments);
    const std::vector<Preset> presets = presets_of(options);
    std::printf("preset               scan            size onto   at ends   least cells  bad stretch energy   steps   "
                "most seconds\n");
    std::map<std::string, Sum> of_preset;
    Sum all;
    for (const auto& path : options.meshes) {
        const Result<MeshFile> file = read_mesh(path, RunContext());
        if (!file) {
            std::fprintf(stderr, "%s\n", file.error().message.c_str());
            return 2;
        }
        Box box;
        for (const Vec3f& p : file->mesh.positions) box.extend(p.cast<double>());
        for (const Preset& preset : presets)
            for (const double size : options.sizes) {
                BodyOptions made{.scale = size / box.size().maxCoeff(),
                                 .cells = {.spacing = 0, .count = options.particles}};
                Result<Body> body = make_body(file->mesh, preset.material, made, RunContext());
                if (!body) {
                    std::fprintf(stderr, "%s: %s\n", path.c_str(), body.error().message.c_str());
                    return 2;
                }
                const auto shared = std::make_shared<const Body>(*std::move(body));
                for (const std::string& onto : options.onto) {
                    const Fall one = fall(shared, onto == "edge", options.seconds);
                    print(preset, path.stem().string(), size, onto, one);
                    of_preset[preset.name].add(one);
                    all.add(one);
                }
            }
    }
    std::printf("\n                     falls inverted in substeps at ends   least energy    steps seconds\n");
    for (const Preset& preset : presets) of_preset[preset.name].print(preset.name.c_str());
    all.print("all");
    return all.inverted > 0 ? 1 : 0;
}
