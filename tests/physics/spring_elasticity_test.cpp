#include "filigree/physics/body/elasticity.h"

#include "filigree/physics/body/make_cells.h"
#include "physics/elastic_checks.h"
#include "threads.h"

#include <numbers>

namespace filigree {
namespace {

using checks::moved;

Material springs(double bending = 0.05) {
    Material material;
    material.model = MaterialModel::springs;
    material.bending = bending;
    return material;
}

TEST(SpringElasticity, ForcesAreTheEnergysDerivative) {
    checks::expect_forces_from_energy(make_body(box_cells(3, 4, 2, 0.1), springs()), make_spring_elasticity);
    checks::expect_forces_from_energy(make_body(checks::uneven_cells(0.1), springs(0.2)), make_spring_elasticity);
}

TEST(SpringElasticity, KeepsMomentum) {
    checks::expect_no_net_force(make_body(checks::uneven_cells(0.1), springs()), make_spring_elasticity);
}

TEST(SpringElasticity, RateIsABound) {
    EXPECT_GT(checks::expect_rate_is_a_bound(make_body(box_cells(2, 3, 3, 0.1), springs()), make_spring_elasticity),
              0.6);
    checks::expect_rate_is_a_bound(make_body(checks::uneven_cells(0.1), springs()), make_spring_elasticity);
}

TEST(SpringElasticity, ComesBackFromBadStarts) {
    const Body body = make_body(box_cells(4, 4, 4, 0.05), springs());
    checks::expect_to_come_back(body, make_spring_elasticity, 20);
}

TEST(SpringElasticity, SameBytesForAnyNumberOfThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    checks::expect_same_bytes_for_threads(make_body(box_cells(19, 9, 10, 0.05), springs()), make_spring_elasticity);
}

TEST(SpringElasticity, RestsAtRest) {
    const Body body = make_body(checks::uneven_cells(0.1), springs());
    const RunContext context(1);
    const auto elasticity = make_spring_elasticity(body, context);
    Vectors forces(body.particle_count());
    const ElasticReport report = elasticity->forces(body.rest, forces, context);
    EXPECT_LT(std::sqrt(checks::dot(forces, forces)), 1e-5 * body.material.young_modulus * 0.01);
    EXPECT_NEAR(report.least_volume_ratio, 1, 1e-5);
    EXPECT_NEAR(report.most_stretch, 1, 1e-5);
    EXPECT_LT(elasticity->energy(body.rest, context), 1e-9);
}

/// Energy density over Young's modulus in a uniform small strain.
double energy_of(const Body& body, const Mat3f& strain) {
    const RunContext context(1);
    double volume = 0;
    for (const float v : body.volume) volume += double(v);
    const Vectors x = moved(body.rest, [&](std::size_t, const Vec3f& p) { return Vec3f(p + strain * p); });
    return make_spring_elasticity(body, context)->energy(x, context) / (volume * body.material.young_modulus);
}

// Stiffness of an isotropic solid with Poisson's ratio 1/4 over E: C11 = 1.2, C12 = C44 = 0.4.
TEST(SpringElasticity, UniformStrainGivesYoungsModulusAndAQuarter) {
    for (const double bending : {0.0, 0.05, 0.2})
        for (const Cells& cells : {box_cells(4, 3, 5, 0.1), checks::uneven_cells(0.1)}) {
            const Body body = make_body(cells, springs(bending));
            const float e = 2e-3f;
            Mat3f along = Mat3f::Zero(), both = Mat3f::Zero(), shear = Mat3f::Zero();
            along(1, 1) = e;
            both(0, 0) = both(2, 2) = e;
            shear(0, 1) = shear(1, 0) = e / 2;
            EXPECT_NEAR(energy_of(body, along) / double(e * e), 0.5 * 1.2, 0.01);
            EXPECT_NEAR(energy_of(body, both) / double(e * e), 1.2 + 0.4, 0.02);
            EXPECT_NEAR(energy_of(body, shear) / double(e * e), 0.5 * 0.4, 0.005);
        }
}

// Where strain changes from cell to cell, second neighbours see another strain than first ones do: a sawtooth along x
// leaves their lengths alone, and their share of the axis springs' stiffness goes.
TEST(SpringElasticity, BendingSpringsTakeTheirShareFromAxisSprings) {
    double energy[2];
    for (int k = 0; k < 2; ++k) {
        const Body body = make_body(box_cells(12, 1, 1, 0.1), springs(k == 0 ? 0.0 : 0.2));
        const RunContext context(1);
        const Vectors x = moved(body.rest, [&](std::size_t i, const Vec3f& p) {
            return Vec3f(p + Vec3f(body.cells.corners[i][0] % 2 == 0 ? 1e-3f : -1e-3f, 0, 0));
        });
        energy[k] = make_spring_elasticity(body, context)->energy(x, context);
    }
    // Axis springs, 4 rows of 12 a quarter each: k/2 (2e-3)^2. Inner ones lose 4 * 0.2, the two at the ends 2 * 0.2.
    const double k = 0.4 * 1e5 * 0.1, lost = 0.5 * k * 4e-6 * (10 * 0.8 + 2 * 0.4);
    EXPECT_NEAR(energy[0] - energy[1], lost, 0.01 * lost);
}

// A slender free bar rings lengthwise with the wave speed sqrt(E / density): first mode, half a wave long.
TEST(SpringElasticity, BarRingsWithTheWaveSpeed) {
    const Body body = make_body(box_cells(40, 2, 2, 0.05), springs());
    const RunContext context(1);
    const auto elasticity = make_spring_elasticity(body, context);
    const double length = 2, speed = std::sqrt(body.material.young_modulus / body.material.density);
    Vectors x = moved(body.rest, [&](std::size_t, const Vec3f& p) {
        return Vec3f(p + 1e-3f * Vec3f(float(std::sin(std::numbers::pi * double(p.x()) / length)), 0, 0));
    });
    const std::size_t n = body.particle_count();
    Vectors velocity(n), forces(n);
    std::vector<double> crossings;
    double time = 0, before = 0;
    while (time < 6 * length / speed) {
        const float dt = 0.5f * 2 / std::sqrt(elasticity->forces(x, forces, context).squared_frequency);
        for (std::size_t i = 0; i < n; ++i) {
            velocity.add(i, forces[i] * (dt / body.mass[i]));
            x.add(i, velocity[i] * dt);
        }
        time += double(dt);
        double amplitude = 0;
        for (std::size_t i = 0; i < n; ++i)
            amplitude +=
                double(x.x[i] - body.rest.x[i]) * std::sin(std::numbers::pi * (double(body.rest.x[i]) - 1) / length);
        if (before * amplitude < 0) crossings.push_back(time - double(dt) * amplitude / (amplitude - before));
        before = amplitude;
    }
    ASSERT_GE(crossings.size(), 4u);
    const double half_period = (crossings.back() - crossings.front()) / double(crossings.size() - 1);
    EXPECT_NEAR(half_period, length / speed, 0.02 * length / speed);
}

TEST(SpringElasticity, GradientsAreExactForAffineMotions) {
    const Body body = make_body(checks::uneven_cells(0.1), springs());
    const RunContext context(1);
    Mat3f A;
    A << 1.1f, 0.2f, 0, -0.3f, 0.9f, 0.1f, 0, 0.4f, 1.3f;
    const Vectors x = moved(body.rest, [&](std::size_t, const Vec3f& p) { return Vec3f(A * p); });
    std::vector<Mat3f> gradients(body.particle_count());
    const auto elasticity = make_spring_elasticity(body, context);
    elasticity->gradients(x, gradients, context);
    for (const Mat3f& F : gradients) EXPECT_LT((F - A).norm(), 1e-5f);
}

TEST(SpringElasticity, PositionsThatAreNoNumbersAreToldByTheRate) {
    const Body body = make_body(box_cells(3, 3, 3, 0.1), springs());
    const RunContext context(1);
    const auto elasticity = make_spring_elasticity(body, context);
    Vectors x = body.rest, forces(body.particle_count());
    x.y[17] = std::nanf("");
    EXPECT_FALSE(std::isfinite(elasticity->forces(x, forces, context).squared_frequency));
}

} // namespace
} // namespace filigree
