// What every material's elasticity must satisfy, whatever its formulas.
#pragma once

#include "filigree/core/dense_solve.h"
#include "filigree/core/random.h"
#include "filigree/physics/body.h"
#include "filigree/physics/body/elasticity.h"
#include "filigree/physics/body/make_cells.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace filigree::checks {

using Make = std::function<std::unique_ptr<Elasticity>(const Body&, const RunContext&)>;

inline Vec3f random_vector(std::uint64_t i) {
    return {float(random_unit(7, 3 * i) - 0.5), float(random_unit(7, 3 * i + 1) - 0.5),
            float(random_unit(7, 3 * i + 2) - 0.5)};
}

inline Vectors moved(const Vectors& rest, const std::function<Vec3f(std::size_t, const Vec3f&)>& move) {
    Vec3f centre = Vec3f::Zero();
    for (std::size_t i = 0; i < rest.size(); ++i) centre += rest[i] / float(rest.size());
    Vectors result(rest.size());
    for (std::size_t i = 0; i < rest.size(); ++i) result.set(i, centre + move(i, rest[i] - centre));
    return result;
}

struct Start {
    std::string name;
    Vectors positions;
};

/// Deformed but sound, stretched, squashed, inverted.
inline std::vector<Start> states(const Body& body) {
    const auto h = float(body.spacing());
    return {
        {"shaken",
         moved(body.rest, [&](std::size_t i, const Vec3f& p) { return Vec3f(p + 0.3f * h * random_vector(i)); })},
        {"stretched", moved(body.rest, [](std::size_t, const Vec3f& p) { return Vec3f(2 * p.x(), p.y(), p.z()); })},
        {"squashed", moved(body.rest, [](std::size_t, const Vec3f& p) { return Vec3f(p.x(), 0.5f * p.y(), p.z()); })},
        {"inverted", moved(body.rest, [&](std::size_t i, const Vec3f& p) {
             return Vec3f(Vec3f(-p.x(), p.y(), p.z()) + 0.1f * h * random_vector(i));
         })}};
}

/// Random, flat, on a line, in a point, tiny, mirrored.
inline std::vector<Start> bad_starts(const Body& body) {
    const auto h = float(body.spacing());
    return {{"random", moved(body.rest, [&](std::size_t i, const Vec3f&) { return Vec3f(3 * h * random_vector(i)); })},
            {"flat", moved(body.rest, [](std::size_t, const Vec3f& p) { return Vec3f(p.x(), 0, p.z()); })},
            {"line", moved(body.rest, [](std::size_t, const Vec3f& p) { return Vec3f(p.x(), 0, 0); })},
            {"point", moved(body.rest, [](std::size_t, const Vec3f&) { return Vec3f(0, 0, 0); })},
            {"shaken point",
             moved(body.rest, [&](std::size_t i, const Vec3f&) { return Vec3f(1e-3f * h * random_vector(i)); })},
            {"tiny", moved(body.rest, [](std::size_t, const Vec3f& p) { return Vec3f(1e-3f * p); })},
            {"mirrored", moved(body.rest, [](std::size_t, const Vec3f& p) { return Vec3f(-p.x(), p.y(), p.z()); })}};
}

inline double dot(const Vectors& a, const Vectors& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].cast<double>().dot(b[i].cast<double>());
    return sum;
}

/// Forces against differences of the energy, along random directions.
inline void expect_forces_from_energy(const Body& body, const Make& make) {
    const RunContext context(1);
    const auto elasticity = make(body, context);
    const std::size_t n = body.particle_count();
    for (const Start& state : states(body)) {
        Vectors forces(n), direction(n);
        elasticity->forces(state.positions, forces, context);
        for (std::uint64_t trial = 0; trial < 3; ++trial) {
            Vectors there = state.positions, back = state.positions;
            for (std::size_t i = 0; i < n; ++i) {
                const Vec3f step = 2e-3f * float(body.spacing()) * random_vector(1000 * (trial + 1) + i);
                there.add(i, step);
                back.add(i, -step);
                direction.set(i, there[i] - back[i]); // as rounded
            }
            const double work = elasticity->energy(there, context) - elasticity->energy(back, context);
            const double size = std::sqrt(dot(forces, forces) * dot(direction, direction));
            EXPECT_NEAR(work, -dot(forces, direction), 2e-3 * size) << state.name;
        }
    }
}

inline void expect_no_net_force(const Body& body, const Make& make) {
    const RunContext context(1);
    const auto elasticity = make(body, context);
    const std::size_t n = body.particle_count();
    for (const Start& state : states(body)) {
        Vectors forces(n);
        elasticity->forces(state.positions, forces, context);
        Vec3d force = Vec3d::Zero(), torque = Vec3d::Zero();
        double size = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const Vec3d f = forces[i].cast<double>(), x = state.positions[i].cast<double>();
            force += f;
            torque += x.cross(f);
            size += f.norm();
        }
        EXPECT_GT(size, 0) << state.name;
        EXPECT_LT(force.norm(), 2e-6 * size) << state.name;
        EXPECT_LT(torque.norm(), 2e-6 * size * 10 * body.spacing()) << state.name;
    }
}

/// The reported rate against the largest eigenvalue of M^-1 K, K by differences of forces. Returns dt c_p / h that the
/// rate allows at rest.
inline double expect_rate_is_a_bound(const Body& body, const Make& make) {
    const RunContext context(1);
    const auto elasticity = make(body, context);
    const std::size_t n = body.particle_count();
    std::vector<Start> all = states(body);
    all.push_back({"rest", body.rest});
    double at_rest = 0;
    for (Start& state : all) {
        Vectors forces(n), ahead(n), behind(n);
        const ElasticReport report = elasticity->forces(state.positions, forces, context);
        Eigen::MatrixXd K(3 * n, 3 * n);
        std::vector<float>* axes[3] = {&state.positions.x, &state.positions.y, &state.positions.z};
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t a = 0; a < 3; ++a) {
                float& value = (*axes[a])[i];
                const float kept = value, step = 1e-3f * float(body.spacing());
                value = kept + step;
                const double high = double(value);
                elasticity->forces(state.positions, ahead, context);
                value = kept - step;
                const double width = high - double(value);
                elasticity->forces(state.positions, behind, context);
                value = kept;
                for (std::size_t j = 0; j < n; ++j)
                    for (int b = 0; b < 3; ++b)
                        K(Eigen::Index(3 * j) + b, Eigen::Index(3 * i + a)) =
                            -double(ahead[j][b] - behind[j][b]) / width /
                            std::sqrt(double(body.mass[i]) * double(body.mass[j]));
            }
        const Eigen::VectorXd rates = symmetric_eigen(Eigen::MatrixXd((K + K.transpose()) / 2)).values;
        EXPECT_GT(double(report.squared_frequency), rates.maxCoeff()) << state.name;
        if (state.name == "rest")
            at_rest =
                2 / std::sqrt(double(report.squared_frequency)) * pressure_wave_speed(body.material) / body.spacing();
    }
    return at_rest;
}

/// Damped steps from bad starts until the body is itself again, which is within `seconds`.
inline void expect_to_come_back(const Body& body, const Make& make, double seconds) {
    constexpr double kDamping = 5; // 1/s
    const RunContext context;
    const std::size_t n = body.particle_count();
    double volume = 0;
    for (const float v : body.volume) volume += double(v);
    for (const Start& start : bad_starts(body)) {
        const auto elasticity = make(body, context);
        Vectors x = start.positions, velocity(n), forces(n);
        ElasticReport report = elasticity->forces(x, forces, context);
        if (std::abs(report.least_volume_ratio) < 1e-12f) { // flat: as the stepper does, shaken apart first
            const auto shift = [&](std::size_t k) { return float((random_unit(1, k) - 0.5) * 2e-3 * body.spacing()); };
            for (std::size_t i = 0; i < n; ++i) x.add(i, {shift(3 * i), shift(3 * i + 1), shift(3 * i + 2)});
            report = elasticity->forces(x, forces, context);
        }
        double energy = 0, time = 0;
        do {
            const double dt = 1.5 / std::sqrt(double(report.squared_frequency));
            const auto kept = float(std::exp(-kDamping * dt));
            for (std::size_t i = 0; i < n; ++i) {
                velocity.set(i, kept * (velocity[i] + float(dt) / body.mass[i] * forces[i]));
                x.add(i, float(dt) * velocity[i]);
            }
            report = elasticity->forces(x, forces, context);
            energy = elasticity->energy(x, context) / (body.material.young_modulus * volume);
            time += dt;
        } while (time < seconds && !(energy < 1e-6 && report.least_volume_ratio > 0.9f));
        EXPECT_LT(energy, 1e-6) << start.name;
        EXPECT_GT(report.least_volume_ratio, 0.9f) << start.name;
    }
}

inline bool same_bytes(const Vectors& a, const Vectors& b) {
    const auto same = [](const std::vector<float>& u, const std::vector<float>& v) {
        return u.size() == v.size() && std::memcmp(u.data(), v.data(), u.size() * sizeof(float)) == 0;
    };
    return same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z);
}

/// Forces, energy and report with one thread and with two.
inline void expect_same_bytes_for_threads(const Body& body, const Make& make) {
    const std::size_t n = body.particle_count();
    for (const Start& state : states(body)) {
        Vectors forces[2] = {Vectors(n), Vectors(n)};
        ElasticReport reports[2];
        double energies[2];
        for (unsigned t = 0; t < 2; ++t) {
            const RunContext context(t + 1);
            const auto elasticity = make(body, context);
            reports[t] = elasticity->forces(state.positions, forces[t], context);
            energies[t] = elasticity->energy(state.positions, context);
        }
        EXPECT_TRUE(same_bytes(forces[0], forces[1])) << state.name;
        EXPECT_EQ(reports[0].squared_frequency, reports[1].squared_frequency);
        EXPECT_EQ(reports[0].least_volume_ratio, reports[1].least_volume_ratio);
        EXPECT_EQ(reports[0].most_stretch, reports[1].most_stretch);
        EXPECT_EQ(energies[0], energies[1]);
    }
}

/// Cells of an L whose fractions differ.
inline Cells uneven_cells(double spacing) {
    std::vector<Cells::LatticeIndex> indices;
    for (std::uint16_t k = 0; k < 3; ++k)
        for (std::uint16_t j = 0; j < 4; ++j)
            for (std::uint16_t i = 0; i < 5; ++i)
                if (i < 2 || j < 2) indices.push_back({i, j, k});
    Cells cells = lattice_cells(std::move(indices), spacing, Vec3d(0.2, -0.1, 0.3));
    for (std::size_t c = 0; c < cells.fraction.size(); ++c) cells.fraction[c] = float(0.1 + 0.9 * random_unit(3, c));
    return cells;
}

} // namespace filigree::checks
