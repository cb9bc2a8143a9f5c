#include "filigree/core/dense_solve.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/fem/plasticity.h"
#include "filigree/physics/meshfree/mls_neighbours.h"

#include "physics/elastic_checks.h"
#include "threads.h"

#include <Eigen/LU>

namespace filigree {
namespace {

using checks::moved;

Material meshfree() {
    Material material;
    material.model = MaterialModel::meshfree;
    return material;
}

/// One particle a cell, and a sheet of one layer (split in eight).
Body sheet() { return make_body(box_cells(4, 1, 4, 0.1), meshfree()); }

/// Explicit steps with nothing but the elasticity and what a test adds.
struct Motion {
    const Body& body;
    std::unique_ptr<Elasticity> elasticity;
    Vectors x, velocity, forces;
    double time = 0;

    Motion(const Body& of, const RunContext& context)
        : body(of), elasticity(make_meshfree_elasticity(of, context)), x(of.rest), velocity(of.particle_count()),
          forces(of.particle_count()) {}

    /// hold(i, x, v) corrects a particle after it moved.
    template <class Hold>
    void step(const RunContext& context, const Vec3f& gravity, float damping, const Hold& hold) {
        const float rate = elasticity->forces(x, forces, context).squared_frequency;
        const float dt = std::min(0.9f * 2 / std::sqrt(rate), 1 / 60.f);
        for (std::size_t i = 0; i < x.size(); ++i) {
            Vec3f v = velocity[i] * std::exp(-damping * dt) + dt * (forces[i] / body.mass[i] + gravity);
            Vec3f p = x[i] + dt * v;
            hold(i, p, v);
            velocity.set(i, v);
            x.set(i, p);
        }
        elasticity->finish_substep(x, dt, context);
        time += double(dt);
    }
};

TEST(MeshfreeElasticity, ForcesAreTheEnergysDerivative) {
    checks::expect_forces_from_energy(make_body(box_cells(3, 4, 3, 0.1), meshfree()), make_meshfree_elasticity);
    checks::expect_forces_from_energy(make_body(checks::uneven_cells(0.1), meshfree()), make_meshfree_elasticity);
    checks::expect_forces_from_energy(sheet(), make_meshfree_elasticity);
}

TEST(MeshfreeElasticity, KeepsMomentum) {
    checks::expect_no_net_force(make_body(checks::uneven_cells(0.1), meshfree()), make_meshfree_elasticity);
    checks::expect_no_net_force(sheet(), make_meshfree_elasticity);
}

TEST(MeshfreeElasticity, RateIsABound) {
    for (const double nu : {0.0, 0.3, 0.45}) {
        Material material = meshfree();
        material.poisson_ratio = nu;
        EXPECT_GT(
            checks::expect_rate_is_a_bound(make_body(box_cells(3, 3, 4, 0.1), material), make_meshfree_elasticity),
            0.6);
    }
    checks::expect_rate_is_a_bound(make_body(checks::uneven_cells(0.1), meshfree()), make_meshfree_elasticity);
    checks::expect_rate_is_a_bound(make_body(box_cells(3, 1, 2, 0.1), meshfree()), make_meshfree_elasticity);
}

TEST(MeshfreeElasticity, ComesBackFromBadStarts) {
    const Body body = make_body(box_cells(5, 5, 5, 0.05), meshfree());
    checks::expect_to_come_back(body, make_meshfree_elasticity, 20);
}

TEST(MeshfreeElasticity, SameBytesForAnyNumberOfThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    checks::expect_same_bytes_for_threads(make_body(box_cells(11, 9, 10, 0.05), meshfree()), make_meshfree_elasticity);
}

TEST(MeshfreeElasticity, NeighboursAreSymmetricAndManyEnough) {
    const RunContext context(1);
    for (const Body& body : {make_body(checks::uneven_cells(0.1), meshfree()), sheet()}) {
        const MlsNeighbours mls = find_mls_neighbours(body.rest, body.volume, body.spacing(), context);
        EXPECT_EQ(mls.lonely_particles, 0u);
        for (std::size_t i = 0; i < mls.size(); ++i) {
            EXPECT_GE(mls.offsets[i + 1] - mls.offsets[i], 8u);
            for (std::size_t k = mls.offsets[i]; k < mls.offsets[i + 1]; ++k) {
                const Index j = mls.neighbours[k];
                std::size_t back = mls.offsets[j];
                while (back < mls.offsets[j + 1] && mls.neighbours[back] != i) ++back;
                ASSERT_LT(back, mls.offsets[j + 1]);
                EXPECT_EQ(mls.pairs[k][3], mls.pairs[back][3]);
                EXPECT_EQ(mls.pairs[k][0], -mls.pairs[back][0]);
            }
        }
    }
}

TEST(MeshfreeElasticity, InsideALatticeThereAre26Neighbours) {
    const Body body = make_body(box_cells(5, 5, 5, 0.1), meshfree());
    const MlsNeighbours mls = find_mls_neighbours(body.rest, body.volume, body.spacing(), RunContext(1));
    const std::size_t middle = 62;
    EXPECT_EQ(mls.offsets[middle + 1] - mls.offsets[middle], 26u);
}

TEST(MeshfreeElasticity, GradientsAreExactForAffineMotions) {
    const RunContext context(1);
    Mat3f A;
    A << 1.1f, 0.2f, 0, -0.3f, 0.9f, 0.1f, 0, 0.4f, 1.3f;
    for (const Body& body : {make_body(checks::uneven_cells(0.1), meshfree()), sheet()}) {
        const auto elasticity = make_meshfree_elasticity(body, context);
        const Vectors x = moved(body.rest, [&](std::size_t, const Vec3f& p) { return Vec3f(A * p); });
        std::vector<Mat3f> gradients(body.particle_count());
        elasticity->gradients(x, gradients, context);
        for (const Mat3f& F : gradients) EXPECT_LT((F - A).norm(), 2e-5f);
    }
}

// Of the fourth kind of particle the checkerboard moves none; gradients inside do not see it, the hourglass term does.
TEST(MeshfreeElasticity, CheckerboardsAreFeltAndAffineMotionsAreNot) {
    const Body body = make_body(box_cells(7, 7, 7, 0.1), meshfree());
    const RunContext context(1);
    const auto elasticity = make_meshfree_elasticity(body, context);
    const std::size_t n = body.particle_count(), middle = 171;
    const Vectors board = moved(body.rest, [&](std::size_t i, const Vec3f& p) {
        const auto& at = body.cells.cells[i];
        return Vec3f(p + Vec3f((at[0] + at[1] + at[2]) % 2 == 0 ? 0.01f : -0.01f, 0, 0));
    });
    std::vector<Mat3f> gradients(n);
    elasticity->gradients(board, gradients, context);
    EXPECT_LT((gradients[middle] - Mat3f::Identity()).norm(), 1e-5f);
    Vectors forces(n);
    elasticity->forces(board, forces, context);
    const float here =
        (body.cells.cells[middle][0] + body.cells.cells[middle][1] + body.cells.cells[middle][2]) % 2 == 0 ? 1.f : -1.f;
    EXPECT_LT(here * forces[middle].x(), -0.1f); // back to where it came from; N

    // A turn changes no energy at all.
    const Mat3f turn = Eigen::AngleAxisf(1.f, Vec3f(1, 2, 3).normalized()).toRotationMatrix();
    const Vectors turned = moved(body.rest, [&](std::size_t, const Vec3f& p) { return Vec3f(turn * p); });
    EXPECT_LT(elasticity->energy(turned, context), 1e-6 * elasticity->energy(board, context));
}

TEST(MeshfreeElasticity, UniformStrainHasTheEnergyOfLinearElasticity) {
    const Body body = make_body(box_cells(5, 5, 5, 0.1), meshfree());
    const RunContext context(1);
    const auto elasticity = make_meshfree_elasticity(body, context);
    const LameParameters lame = lame_parameters(1e5, 0.3);
    const float e = 1e-2f;
    const auto density = [&](const Mat3f& strain) { // even part: the third order cancels
        double sum = 0;
        for (const float sign : {1.f, -1.f})
            sum += elasticity->energy(
                moved(body.rest, [&](std::size_t, const Vec3f& p) { return Vec3f(p + sign * strain * p); }), context);
        return sum / 2 / 0.125 / double(e * e);
    };
    Mat3f along = Mat3f::Zero(), shear = Mat3f::Zero();
    along(0, 0) = e;
    shear(0, 1) = shear(1, 0) = e / 2;
    EXPECT_NEAR(density(along), 0.5 * (lame.lambda + 2 * lame.mu), 0.01 * lame.mu);
    EXPECT_NEAR(density(shear), 0.5 * lame.mu, 0.01 * lame.mu);
}

TEST(Plasticity, EigenvectorsDiagonalise) {
    for (std::uint64_t trial = 0; trial < 50; ++trial) {
        Mat3f A;
        for (int c = 0; c < 3; ++c) A.col(c) = checks::random_vector(3 * trial + std::uint64_t(c));
        A = (A.transpose() * A).eval();
        if (trial % 3 == 0) A = Mat3f::Identity() + 1e-4f * A;
        Vec3f values;
        Mat3f vectors;
        symmetric_eigen(A, values, vectors);
        EXPECT_LT((vectors * values.asDiagonal() * vectors.transpose() - A).norm(), 2e-6f * A.norm());
        EXPECT_LT((vectors * vectors.transpose() - Mat3f::Identity()).norm(), 2e-6f);
    }
}

TEST(Plasticity, FlowEndsOnTheYieldSurfaceAndKeepsVolume) {
    const float never = std::numeric_limits<float>::infinity();
    Mat3f F;
    F << 1.3f, 0.2f, 0, 0.1f, 0.8f, 0, 0, 0.1f, 1.1f;
    Mat3f R;
    EXPECT_FALSE(flow(F, {never, 1}, R));
    EXPECT_FALSE(flow(F, {2, 1}, R));
    ASSERT_TRUE(flow(F, {0.1f, 1}, R));
    EXPECT_NEAR(R.determinant(), 1, 1e-5);
    const auto deviation = [](const Mat3f& G) {
        const Vec3f e = 0.5f * symmetric_eigenvalues(G.transpose() * G).array().log();
        return (e - Vec3f::Constant(e.mean())).norm();
    };
    EXPECT_NEAR(deviation(F * R), 0.1, 1e-4);
    ASSERT_TRUE(flow(F, {0.1f, 0.25f}, R)); // creep: a quarter of the excess
    EXPECT_NEAR(deviation(F * R), 0.1 + 0.75 * (double(deviation(F)) - 0.1), 1e-4);
}

/// Pulls the ends of a bar along y to `stretch`, lets go, and returns its length at rest over that at the start.
double length_after_pulling(const Material& material, double stretch) {
    const Body body = make_body(box_cells(3, 9, 3, 0.1), material);
    const RunContext context(1);
    Motion run(body, context);
    const auto free = [](std::size_t, Vec3f&, Vec3f&) {};
    const auto hold = [&](std::size_t i, Vec3f& p, Vec3f& v) {
        const float y = body.rest.y[i], part = float(std::min(run.time / 0.5, 1.0) * (stretch - 1));
        if (y > 0.1f && y < 0.8f) return;
        p = body.rest[i] + Vec3f(0, (y - 0.45f) * part, 0);
        v.setZero();
    };
    while (run.time < 0.7) run.step(context, Vec3f::Zero(), 20, hold);
    while (run.time < 2) run.step(context, Vec3f::Zero(), 10, free);
    double low = 0, high = 0;
    for (std::size_t i = 0; i < body.particle_count(); ++i) {
        if (body.rest.y[i] < 0.1f) low += double(run.x.y[i]) / 9;
        if (body.rest.y[i] > 0.8f) high += double(run.x.y[i]) / 9;
    }
    return (high - low) / 0.8;
}

TEST(MeshfreeElasticity, YieldsBeyondItsYieldStressOnly) {
    Material material = meshfree();
    EXPECT_NEAR(length_after_pulling(material, 1.3), 1, 2e-3); // elastic
    material.yield_stress = 1e4;                               // 10 % strain
    EXPECT_NEAR(length_after_pulling(material, 1.05), 1, 5e-3);
    // The return map leaves the elastic strain of the yield stress: log length falls by yield stress / E. Both ends are
    // held as two layers each and stretch as well.
    EXPECT_NEAR(length_after_pulling(material, 1.3), std::exp(std::log(1.3) - 0.1), 0.03);
}

/// Pulled without end it flows until its limit, and is elastic from there on: what was stored stays sound.
TEST(MeshfreeElasticity, FlowsNoFurtherThanToItsLimit) {
    Material clay = meshfree();
    clay.yield_stress = 1e3;
    const Body body = make_body(box_cells(3, 6, 3, 0.1), clay);
    const RunContext context(1);
    const auto elasticity = make_meshfree_elasticity(body, context);
    const auto stretched = [&](float stretch) {
        return moved(body.rest, [&](std::size_t, const Vec3f& p) {
            return Vec3f(p.cwiseProduct(Vec3f(1 / std::sqrt(stretch), stretch, 1 / std::sqrt(stretch))));
        });
    };
    const auto pull_to = [&](float from, float to) {
        for (int step = 1; step <= 400; ++step)
            elasticity->finish_substep(stretched(from * std::pow(to / from, float(step) / 400)), 1e-3f, context);
    };
    pull_to(1, 6);
    EXPECT_EQ(elasticity->flowed_out(), 0u);
    EXPECT_LT(elasticity->energy(stretched(6), context), 5.0) << "J; elastic it would store hundreds";
    pull_to(6, 12);
    EXPECT_EQ(elasticity->flowed_out(), body.particle_count());
    EXPECT_GT(elasticity->energy(stretched(12), context), 100.0);
    pull_to(12, 6.9f);
    Vectors forces(body.particle_count());
    const ElasticReport report = elasticity->forces(stretched(6.9f), forces, context);
    EXPECT_TRUE(std::isfinite(report.squared_frequency));
    EXPECT_NEAR(report.least_volume_ratio, 1, 0.01);
}

TEST(MeshfreeElasticity, StateGoesOnWithTheSameBytes) {
    Material clay = meshfree();
    clay.yield_stress = 2e3;
    const Body body = make_body(box_cells(5, 5, 5, 0.05), clay);
    const RunContext context;
    Motion first(body, context);
    const auto floor = [](std::size_t, Vec3f& p, Vec3f& v) {
        if (p.y() >= 0.025f) return;
        p.y() = 0.025f;
        v.y() = std::max(v.y(), 0.f);
    };
    const Vec3f heavy = {0, -300, 0}; // squashes it
    while (first.time < 0.1) first.step(context, heavy, 0, floor);
    const std::string state = first.elasticity->state();
    EXPECT_NE(state, make_meshfree_elasticity(body, context)->state()) << "it has yielded";
    Motion second(body, RunContext(1));
    ASSERT_TRUE(second.elasticity->restore_state(state));
    EXPECT_EQ(second.elasticity->state(), state);
    second.x = first.x;
    second.velocity = first.velocity;
    for (int k = 0; k < 60; ++k) {
        first.step(context, heavy, 0, floor);
        second.step(RunContext(1), heavy, 0, floor);
    }
    EXPECT_TRUE(checks::same_bytes(first.x, second.x));
    EXPECT_EQ(first.elasticity->state(), second.elasticity->state());

    EXPECT_FALSE(second.elasticity->restore_state(state.substr(1)));
    EXPECT_FALSE(second.elasticity->restore_state("nonsense"));
    EXPECT_FALSE(second.elasticity->restore_state(std::string(8, char(0xff)) + state.substr(8)));
    EXPECT_EQ(make_meshfree_elasticity(make_body(box_cells(3, 3, 3, 0.1), meshfree()), context)->state(), "");
}

TEST(MeshfreeElasticity, PositionsThatAreNoNumbersAreToldByTheRate) {
    Material clay = meshfree();
    clay.yield_stress = 1e3;
    const Body body = make_body(box_cells(3, 3, 3, 0.1), clay);
    const RunContext context(1);
    const auto elasticity = make_meshfree_elasticity(body, context);
    Vectors x = body.rest, forces(body.particle_count());
    const std::string before = elasticity->state();
    x.y[13] = std::nanf("");
    EXPECT_FALSE(std::isfinite(elasticity->forces(x, forces, context).squared_frequency));
    elasticity->finish_substep(x, 1e-3f, context);
    EXPECT_EQ(elasticity->state(), before) << "nothing yields to what is no number";
}

} // namespace
} // namespace filigree
