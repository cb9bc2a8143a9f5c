// What has to come out the same two ways, on random meshes: threads, order, place, precision, file and memory.
// rapidcheck prints the seed of a failure; scripts/properties tries many more.
#include "filigree/coding/mesh_code.h"
#include "filigree/fracture.h"
#include "filigree/io/file.h"
#include "filigree/io/model_file.h"
#include "filigree/mesh.h"
#include "filigree/physics/simulation.h"
#include "filigree/restore.h"
#include "filigree/sample.h"
#include "filigree/strip.h"
#include "threads.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <filesystem>
#include <numeric>
#include <random>

#include <unistd.h>

using namespace filigree;

namespace {

namespace gen = rc::gen;

std::mt19937 any_random() { return std::mt19937(*gen::noShrink(gen::arbitrary<unsigned>())); }

/// A shape in any pose, its vertices moved a little; perhaps with a few faces taken out.
Mesh any_surface(bool may_be_open = true) {
    const std::string_view name = *gen::element<std::string_view>("wavy-cube", "wavy-sphere", "torus");
    std::mt19937 random = any_random();
    Mesh mesh = *make_shape(name, {.resolution = *gen::inRange(4u, 20u)});
    const float noise = *gen::element(0.0f, 0.002f, 0.01f);
    std::normal_distribution<float> normal(0, noise > 0 ? noise : 1);
    const Eigen::Quaternionf turn = Eigen::Quaternionf(normal(random), normal(random), normal(random), 1).normalized();
    for (Vec3f& p : mesh.positions) {
        p = turn * p;
        if (noise > 0) p += Vec3f(normal(random), normal(random), normal(random));
    }
    if (!may_be_open || *gen::inRange(0, 3) > 0) return mesh;
    Mesh open;
    open.positions = mesh.positions;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        if (random() % 40 > 0) open.add_face(mesh.face(f));
    return open;
}

struct Renumbered {
    Mesh mesh;
    std::vector<Index> now; ///< of each vertex of the source
};

Renumbered renumbered(const Mesh& mesh) {
    std::mt19937 random = any_random();
    Renumbered result;
    result.now.resize(mesh.vertex_count());
    std::iota(result.now.begin(), result.now.end(), 0);
    std::ranges::shuffle(result.now, random);
    result.mesh.positions.resize(mesh.vertex_count());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) result.mesh.positions[result.now[v]] = mesh.positions[v];
    std::vector<Index> order(mesh.face_count());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::shuffle(order, random);
    for (const Index f : order) {
        std::vector<Index> face;
        for (const Index v : mesh.face(f)) face.push_back(result.now[v]);
        result.mesh.add_face(face);
    }
    return result;
}

float largest_coordinate(const Mesh& mesh) {
    float most = 0;
    for (const Vec3f& p : mesh.positions) most = std::max(most, p.cwiseAbs().maxCoeff());
    return most;
}

Mat3f any_affine() {
    std::mt19937 random = any_random();
    std::uniform_real_distribution<float> number(-0.4f, 0.4f);
    Mat3f affine = Mat3f::Identity();
    for (float& x : affine.reshaped()) x += number(random);
    return affine;
}

} // namespace

RC_GTEST_PROP(Differential, StripIsTheSameForAnyNumberOfThreads, ()) {
    const Mesh mesh = any_surface();
    const StripOptions options{.base = *gen::inRange<std::size_t>(8, 200),
                               .one_piece = *gen::element<std::size_t>(100, 1'000'000)};
    const auto a = strip(mesh, options, kOneThread), b = strip(mesh, options, kTwoThreads);
    RC_ASSERT(a.ok() == b.ok());
    if (a) RC_ASSERT(write_model(a->model) == write_model(b->model));
}

RC_GTEST_PROP(Differential, AnAffinePoseGivesTheMeshMovedAlike, ()) {
    const Mesh mesh = any_surface();
    const auto stripped = strip(mesh, {.base = *gen::inRange<std::size_t>(20, 300)}, kOneThread);
    RC_PRE(stripped.ok());
    const Mat3f affine = any_affine();
    const Vec3f shift(0.3f, -2, 0.1f);
    Pose pose = rest_pose(stripped->model);
    for (Vec3f& p : pose.positions) p = affine * p + shift;
    pose.gradients.assign(pose.positions.size(), affine);
    const auto restorer = Restorer::create(stripped->model, {}, kOneThread);
    RC_ASSERT(restorer.ok());
    const auto one = restorer->positions(pose, kOneThread), many = restorer->positions(pose, kTwoThreads);
    RC_ASSERT(one.ok() && many.ok() && *one == *many);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        RC_ASSERT(((*one)[v] - (affine * mesh.positions[v] + shift)).norm() < 2e-5f * (1 + largest_coordinate(mesh)));
}

RC_GTEST_PROP(Differential, AModelsFileHoldsTheModel, ()) {
    const auto stripped = strip(any_surface(), {.base = 60}, kOneThread);
    RC_PRE(stripped.ok());
    const std::string bytes = write_model(stripped->model);
    const auto read = read_model(FileReader(std::string_view(bytes)), "file", kOneThread);
    RC_ASSERT(read.ok());
    RC_ASSERT(write_model(*read) == bytes);
}

RC_GTEST_PROP(Differential, DistanceDoesNotDependOnOrderOrPlace, ()) {
    const Mesh mesh = any_surface();
    const Renumbered other = renumbered(mesh);
    const auto self = mesh_distance(mesh, other.mesh, 500, kOneThread);
    RC_ASSERT(self.ok() && self->surfaces);
    RC_ASSERT(self->surfaces->hausdorff < 2e-6 * self->diagonal);
    const Mesh sphere = make_wavy_sphere({.resolution = 8});
    const Eigen::Quaternionf turn = Eigen::Quaternionf(0.3f, 0.8f, -0.2f, 0.5f).normalized();
    Mesh turned = mesh, turned_sphere = sphere;
    for (Vec3f& p : turned.positions) p = turn * p;
    for (Vec3f& p : turned_sphere.positions) p = turn * p;
    const auto before = mesh_distance(mesh, sphere, 0, kOneThread),
               after = mesh_distance(turned, turned_sphere, 0, kTwoThreads);
    RC_ASSERT(before.ok() && after.ok());
    RC_ASSERT(std::abs(before->surfaces->hausdorff - after->surfaces->hausdorff) < 1e-5 * before->diagonal);
}

RC_GTEST_PROP(Differential, ScanRaysAndWindingFindTheSamePoints, ()) {
    const Mesh mesh = any_surface(false);
    const auto lattice = make_lattice(bounds(mesh.positions), {.spacing = *gen::element(0.07, 0.11, 0.2)});
    RC_ASSERT(lattice.ok());
    const auto scan = sample_inside(mesh, *lattice, {.method = InsideMethod::scan}, kOneThread),
               rays = sample_inside(mesh, *lattice, {.method = InsideMethod::rays}, kTwoThreads),
               winding = sample_inside(mesh, *lattice, {.method = InsideMethod::winding}, kOneThread);
    RC_ASSERT(scan.ok() && rays.ok() && winding.ok());
    RC_ASSERT(scan->bits == rays->bits);
    std::size_t different = 0; // at the surface itself a sum of angles is a half give or take
    for (std::size_t k = 0; k < scan->bits.size(); ++k)
        different += std::size_t(std::popcount(scan->bits[k] ^ winding->bits[k]));
    RC_ASSERT(different <= 1 + lattice->point_count() / 1000);
}

RC_GTEST_PROP(Differential, ACodedMeshIsThePlainOneWithinItsStep, ()) {
    const Mesh mesh = any_surface();
    const PackOptions options{
        .bits = *gen::inRange(10u, 17u), .keep_order = *gen::arbitrary<bool>(), .levels = *gen::arbitrary<bool>()};
    PackedMeshReport report;
    const auto coded = pack_mesh(mesh, options, &report, kOneThread),
               again = pack_mesh(mesh, options, nullptr, kTwoThreads);
    RC_ASSERT(coded.ok() && again.ok());
    RC_ASSERT(coded->places == again->places && coded->connectivity == again->connectivity);
    const auto read = unpack_mesh(*coded, kOneThread);
    RC_ASSERT(read.ok());
    if (options.keep_order) RC_ASSERT(read->corners == mesh.corners);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        const Vec3f& was = mesh.positions[options.keep_order ? v : report.vertex[v]];
        RC_ASSERT((read->positions[v] - was).norm() < 1.15 * coded->step + 1e-6f);
    }
}

RC_GTEST_PROP(Differential, PiecesAddUpToTheMesh, ()) {
    const Mesh mesh = any_surface(false);
    std::mt19937 random = any_random();
    const Box box = bounds(mesh.positions);
    std::vector<Vec3d> points(2 + random() % 8);
    for (Vec3d& p : points)
        for (int k = 0; k < 3; ++k) p[k] = box.min[k] + box.size()[k] * float(random() % 1000) / 1000;
    const auto cells = FractureCells::create(points, {}, {}, kOneThread);
    RC_PRE(cells.ok());
    const auto one = fracture(mesh, *cells, {}, kOneThread), many = fracture(mesh, *cells, {}, kTwoThreads);
    RC_ASSERT(one.ok() && many.ok());
    RC_ASSERT(one->mesh.positions == many->mesh.positions && one->mesh.corners == many->mesh.corners);
    RC_ASSERT(one->report.volume_error < 1e-5);
}

RC_GTEST_PROP(Differential, BodiesMoveAlikeForAnyNumberOfThreads, ()) {
    const Mesh mesh = any_surface(false);
    Material material;
    material.model = *gen::element(MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree,
                                   MaterialModel::rigid, MaterialModel::mpm);
    const auto body = make_body(mesh, material, {.scale = 0.1, .cells = {.count = 150}}, kOneThread);
    RC_PRE(body.ok());
    std::array<Vectors, 2> ends;
    for (const RunContext* context : {&kOneThread, &kTwoThreads}) {
        World world;
        world.obstacles.push_back({HalfSpace{{0, -0.15, 0}, {0, 1, 0}}, {}});
        Actor actor{std::make_shared<const Body>(*body)};
        actor.velocity = {0, -1, 0.2};
        auto simulation = Simulation::create(world, {actor}, {}, *context);
        RC_ASSERT(simulation.ok());
        for (int frame = 0; frame < 4; ++frame) RC_ASSERT(simulation->advance(*context).ok());
        ends[context == &kTwoThreads] = simulation->positions(0);
    }
    for (std::size_t k = 0; k < ends[0].size(); ++k) RC_ASSERT(Vec3f(ends[0][k]) == Vec3f(ends[1][k]));
}
