// Soft presets fall from 1.5 times their own height, and keep their cells the right way round. All presets, sizes and
// scans: bench/soft_falls.cpp.
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/physics/material.h"
#include "filigree/physics/simulation.h"
#include "io/corpus.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace filigree {
namespace {

using filigree_test::corpus_folder;

struct Fall {
    const char* preset;
    const char* shape; ///< one of make_shape, or a scan of the corpus
    double size;       ///< m, longest side
    bool has_edge;
};

std::ostream& operator<<(std::ostream& out, const Fall& fall) {
    return out << fall.preset << " " << fall.shape << " " << fall.size << (fall.has_edge ? " edge" : " ground");
}

Material preset(std::string_view name) {
    for (const NamedMaterial& named : named_materials())
        if (named.name == name) return named.material;
    ADD_FAILURE() << name;
    return {};
}

bool is_scan(const Fall& fall) { return std::string_view(fall.shape).ends_with(".obj"); }
std::filesystem::path scan_of(const Fall& fall) { return corpus_folder() / "good" / fall.shape; }

/// A shape stands on end, so that it falls far.
Mesh mesh_of(const Fall& fall) {
    if (is_scan(fall)) return read_mesh(scan_of(fall), RunContext(1)).value().mesh;
    const ShapeOptions options{.resolution = 12, .frequency = 2, .amplitude = 0.1};
    Mesh mesh = make_shape(fall.shape, options).value();
    for (Vec3f& p : mesh.positions) p = Vec3f(p.z(), p.x(), p.y());
    return mesh;
}

std::shared_ptr<const Body> body_of(const Fall& fall) {
    const Mesh mesh = mesh_of(fall);
    const double scale = fall.size / bounds(mesh.positions).size().maxCoeff();
    const BodyOptions made{.scale = scale, .cells = {.spacing = 0, .count = 500}};
    return std::make_shared<const Body>(make_body(mesh, preset(fall.preset), made, RunContext(1)).value());
}

World world_of(const Fall& fall, double height) {
    World world;
    Obstacle ground;
    if (fall.has_edge) {
        const double half = height / std::numbers::sqrt2; // its highest edge passes through the origin, along z
        Obstacle edge;
        edge.shape = Cuboid{{0, -half, 0}, {height, height, 4 * height}};
        edge.motion.centre = {0, -half, 0};
        edge.motion.angle.constant = {0, 0, std::numbers::pi / 4};
        world.obstacles.push_back(edge);
    }
    ground.shape = HalfSpace{{0, fall.has_edge ? -height : 0, 0}};
    world.obstacles.push_back(ground);
    return world;
}

class SoftFalls : public testing::TestWithParam<Fall> {};

INSTANTIATE_TEST_SUITE_P(Physics, SoftFalls,
                         testing::Values(Fall{"jelly", "torus", 2, false}, Fall{"jelly", "bar", 2, true},
                                         Fall{"soft-rubber", "penguin.obj", 2, true},
                                         Fall{"lattice", "penguin.obj", 2, true},
                                         Fall{"soft-rubber", "wavy-sphere", 2, true},
                                         Fall{"soft-rubber", "torus", 2, false}, Fall{"foam", "torus", 2, true},
                                         Fall{"foam", "wavy-sphere", 0.2, false}, Fall{"lattice", "torus", 2, true},
                                         Fall{"lattice", "wavy-sphere", 2, false}, Fall{"rubber", "bar", 2, false},
                                         Fall{"soft-rubber", "koala_100k.obj", 1, true},
                                         Fall{"lattice", "spot_low.obj", 1, false}));

TEST_P(SoftFalls, NoCellIsInvertedAndNoEnergyIsGained) {
    if (is_scan(GetParam()) && !std::filesystem::exists(scan_of(GetParam()))) GTEST_SKIP() << scan_of(GetParam());
    const std::shared_ptr<const Body> body = body_of(GetParam());
    Vec3f low = body->rest[0], high = low;
    for (std::size_t i = 0; i < body->rest.size(); ++i) {
        low = low.cwiseMin(body->rest[i]);
        high = high.cwiseMax(body->rest[i]);
    }
    const double height = double(high.y() - low.y()), g = 9.81;
    Actor actor;
    actor.body = body;
    const Vec3d middle = 0.5 * (low + high).cast<double>();
    actor.placement.translation() = Vec3d(-middle.x(), 0.02 * height - double(low.y()), -middle.z());
    actor.velocity = {0, -std::sqrt(3 * g * height), 0};
    const RunContext context(1);
    Simulation falling =
        Simulation::create(world_of(GetParam(), height), {actor}, {.automatic_rigid = false}, context).value();
    const double before = falling.energy(context).total();
    const double kinetic = falling.energy(context).kinetic;
    for (int frame = 0; frame < 40; ++frame) {
        const FrameReport report = falling.advance(context).value();
        ASSERT_GT(report.least_volume_ratio, 0) << GetParam() << ", frame " << frame;
        ASSERT_EQ(falling.inverted(0).count, 0u) << GetParam() << ", frame " << frame;
        ASSERT_EQ(report.unstable_substeps, 0u) << GetParam() << ", frame " << frame;
        ASSERT_LT(falling.energy(context).total(), before + 0.01 * kinetic) << GetParam() << ", frame " << frame;
    }
}

} // namespace
} // namespace filigree
