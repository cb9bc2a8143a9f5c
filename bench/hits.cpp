// Every elastic preset hits a plane, an edge, a terrain of triangles and its equal, without gravity.
//   hits [--speeds 1,4,10,30,60] [--presets a,b] [--restitutions 0,0.5,1] [--onto plane,edge,terrain,body] [--size M]
//        [--particles N] [--shapes cube,ball]
// A line each: speed and energy after the hit as parts of those before, the most energy at the end of any frame, and
// the smallest volume ratio of a cell. Ends with 1 if energy grew by more than 1 % in any.
#include "filigree/core/now_seconds.h"
#include "filigree/mesh.h"
#include "filigree/physics/material.h"
#include "filigree/physics/simulation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <sstream>
#include <string>

namespace {

using namespace filigree;

struct Options {
    std::vector<double> speeds = {1, 4, 10, 30, 60}, restitutions = {0, 0.5, 1};
    std::vector<std::string> presets, onto = {"plane", "edge", "terrain", "body"}, shapes = {"cube", "ball"};
    double size = 0.2; ///< m
    std::size_t particles = 200;
};

std::vector<std::string> split(const std::string& text) {
    std::vector<std::string> parts;
    std::istringstream in(text);
    for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
    return parts;
}

std::vector<double> numbers_of(const std::string& text) {
    std::vector<double> numbers;
    for (const std::string& part : split(text)) numbers.push_back(std::atof(part.c_str()));
    return numbers;
}

Options read_options(int count, char** arguments) {
    Options options;
    for (int a = 1; a + 1 < count; a += 2) {
        const std::string name = arguments[a], value = arguments[a + 1];
        if (name == "--speeds") options.speeds = numbers_of(value);
        if (name == "--restitutions") options.restitutions = numbers_of(value);
        if (name == "--presets") options.presets = split(value);
        if (name == "--onto") options.onto = split(value);
        if (name == "--shapes") options.shapes = split(value);
        if (name == "--size") options.size = std::atof(value.c_str());
        if (name == "--particles") options.particles = std::size_t(std::atol(value.c_str()));
    }
    return options;
}

bool is_elastic(const Material& material) {
    return material.model != MaterialModel::rigid && material.model != MaterialModel::mpm &&
           material.young_modulus < 1e9;
}

/// Of length 1 across, around the origin.
Mesh shape_of(const std::string& name) {
    if (name == "cube") return make_box(Vec3d::Zero(), Vec3d::Ones());
    Mesh ball = make_wavy_cube({.resolution = 12});
    for (Vec3f& p : ball.positions) p *= 0.5f / p.norm();
    return ball;
}

/// A sheet of hills, a tenth of `size` high, whose highest place is the origin.
Mesh terrain(double size) {
    Mesh mesh;
    const int n = 12;
    for (int i = 0; i <= n; ++i)
        for (int k = 0; k <= n; ++k) {
            const double x = (double(i) / n - 0.5) * 4 * size, z = (double(k) / n - 0.5) * 4 * size;
            const double y = 0.05 * size * (std::cos(5 * x / size) + std::cos(5 * z / size) - 2);
            mesh.positions.push_back(Vec3d(x, y, z).cast<float>());
        }
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < n; ++k) {
            const Index a = Index(i * (n + 1) + k), b = a + 1, c = a + Index(n) + 1, d = c + 1;
            for (const Index corner : {a, b, c, b, d, c}) mesh.corners.push_back(corner);
            for (int face = 0; face < 2; ++face) mesh.face_offsets.push_back(mesh.face_offsets.back() + 3);
        }
    return mesh;
}

World world_of(const std::string& onto, double size, double restitution) {
    World world;
    world.gravity.setZero();
    world.body_restitution = restitution;
    if (onto == "body") return world;
    Obstacle& obstacle = world.obstacles.emplace_back();
    obstacle.restitution = restitution;
    if (onto == "plane") obstacle.shape = HalfSpace{};
    if (onto == "edge") {
        obstacle.shape = Cuboid{{0, -size, 0}, {std::numbers::sqrt2 * size, std::numbers::sqrt2 * size, 8 * size}};
        obstacle.motion.centre = {0, -size, 0};
        obstacle.motion.angle.constant = {0, 0, std::numbers::pi / 4};
    }
    if (onto == "terrain") obstacle.shape = make_mesh_obstacle(terrain(size), 1, 0, RunContext(1)).value();
    return world;
}

struct Hit {
    std::string preset, shape, onto;
    double size, speed, restitution;
};

/// Whether energy did not grow.
bool run(const Hit& hit, const std::shared_ptr<const Body>& body) {
    const RunContext context(1);
    Actor first;
    first.body = body;
    first.placement.translation() = Vec3d(0.03, 0.505, 0.02) * hit.size;
    first.velocity = {0, -hit.speed, 0};
    std::vector<Actor> actors = {first};
    if (hit.onto == "body") {
        Actor other = first;
        other.placement.translation() = Vec3d(-0.03, -0.505, -0.02) * hit.size;
        other.velocity = {0, hit.speed, 0};
        actors.push_back(other);
    }
    Simulation hitting =
        Simulation::create(world_of(hit.onto, hit.size, hit.restitution), actors, {.automatic_rigid = false}, context)
            .value();
    const double start = hitting.energy(context).total();
    double most = 0, least = 1, mass = 0, up = 0;
    std::size_t substeps = 0, frames = 0;
    const double began = now_seconds();
    for (; frames < 20; ++frames) {
        const FrameReport report = hitting.advance(context).value();
        most = std::max(most, hitting.energy(context).total() / start);
        least = std::min(least, double(report.least_volume_ratio));
        substeps += report.substeps;
    }
    for (Index i = 0; i < body->particle_count(); ++i) {
        mass += double(body->mass[i]);
        up += double(body->mass[i]) * double(hitting.velocities(0)[i].y());
    }
    const Energy after = hitting.energy(context);
    std::printf("%-13s %-5s %-8s %4.0f %4.2f speed %6.3f energy %6.3f most %7.4f volume %6.3f %6zu steps %6.2f s%s\n",
                hit.preset.c_str(), hit.shape.c_str(), hit.onto.c_str(), hit.speed, hit.restitution,
                up / mass / hit.speed, after.total() / start, most, least, substeps / frames, now_seconds() - began,
                most > 1.01 ? " GROWS" : "");
    std::fflush(stdout);
    return !(most > 1.01);
}

} // namespace

int main(int count, char** arguments) {
    const Options options = read_options(count, arguments);
    bool is_good = true;
    for (const NamedMaterial& named : named_materials()) {
        const std::string preset(named.name);
        if (options.presets.empty() ? !is_elastic(named.material)
                                    : std::ranges::find(options.presets, preset) == options.presets.end())
            continue;
        for (const std::string& shape : options.shapes) {
            Material material = named.material;
            if (material.model == MaterialModel::rigid) material.model = MaterialModel::fem;
            const BodyOptions made{.scale = options.size, .cells = {.spacing = 0, .count = options.particles}};
            const auto body =
                std::make_shared<const Body>(make_body(shape_of(shape), material, made, RunContext(1)).value());
            for (const std::string& onto : options.onto)
                for (const double speed : options.speeds)
                    for (const double restitution : options.restitutions)
                        is_good &= run({preset, shape, onto, options.size, speed, restitution}, body);
        }
    }
    return is_good ? 0 : 1;
}
