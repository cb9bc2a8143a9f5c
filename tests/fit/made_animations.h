// Animations by formulas: cloth, a rod that slides in a tube, crumpling, skins with sharp weights, morphs, a fluid.
// Tests and bench/fit.cpp use the same ones.
#pragma once

#include "filigree/file.h"
#include "filigree/mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace filigree_test {

using filigree::Index;
using filigree::Mat3d;
using filigree::Mesh;
using filigree::Vec3d;
using filigree::Vec3f;

/// A mesh that moves. The animation refers to the mesh.
struct MadeAnimation {
    std::shared_ptr<Mesh> rest;
    filigree::MeshAnimation animation;
};

/// move(frame) gives the positions of a frame, one a vertex.
inline MadeAnimation animate(Mesh mesh, std::size_t frames, std::function<std::vector<Vec3d>(std::size_t frame)> move) {
    MadeAnimation made{std::make_shared<Mesh>(std::move(mesh)), {}};
    made.animation.rest = made.rest.get();
    made.animation.frames = frames;
    made.animation.positions = [move = std::move(move)](std::size_t frame,
                                                        std::span<Vec3f> positions) -> filigree::Status {
        const std::vector<Vec3d> moved = move(frame);
        for (std::size_t v = 0; v < positions.size(); ++v) positions[v] = moved[v].cast<float>();
        return filigree::Success{};
    };
    return made;
}

/// The positions of a mesh in doubles.
inline std::vector<Vec3d> places_of(const Mesh& mesh) {
    std::vector<Vec3d> places;
    for (const Vec3f& p : mesh.positions) places.push_back(p.cast<double>());
    return places;
}

inline Mesh wavy_sphere(unsigned resolution) {
    return filigree::make_shape("wavy-sphere", {.resolution = resolution}).value();
}

/// A sheet of 1.5 x 1 in the plane of x and y, of two triangles a quad.
inline Mesh sheet(std::size_t columns, std::size_t rows) {
    Mesh mesh;
    for (std::size_t j = 0; j <= rows; ++j)
        for (std::size_t i = 0; i <= columns; ++i)
            mesh.positions.push_back({1.5f * float(i) / float(columns), float(j) / float(rows), 0});
    const auto at = [&](std::size_t i, std::size_t j) { return static_cast<Index>(j * (columns + 1) + i); };
    for (std::size_t j = 0; j < rows; ++j)
        for (std::size_t i = 0; i < columns; ++i) {
            mesh.add_face(std::array{at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.add_face(std::array{at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return mesh;
}

/// Cloth in the wind: three waves run along it, and its threads along x keep their length.
inline MadeAnimation flag(std::size_t columns, std::size_t rows, std::size_t frames) {
    Mesh mesh = sheet(columns, rows);
    return animate(mesh, frames, [=, places = places_of(mesh)](std::size_t frame) {
        const double t = double(frame) / 60, step = 1.5 / double(columns);
        std::vector<Vec3d> moved(places.size());
        for (std::size_t j = 0; j <= rows; ++j) {
            const double y = double(j) / double(rows);
            const auto slope = [&](double s) {
                return std::min(1.0, s / 0.4) *
                       (0.9 * std::sin(7 * s - 9 * t + 1.5 * y) + 0.35 * std::sin(17 * s - 14 * t - 3 * y) +
                        0.12 * std::sin(41 * s - 25 * t + 7 * y));
            };
            double x = 0, z = 0;
            for (std::size_t i = 0; i <= columns; ++i) {
                moved[j * (columns + 1) + i] = {x, y - 0.08 * x * x, z};
                const double middle = (slope(double(i) * step) + slope(double(i + 1) * step)) / 2;
                x += std::cos(middle) * step;
                z += std::sin(middle) * step;
            }
        }
        return moved;
    });
}

/// An open tube of length 2 along x. waves: of its radius, a fraction.
inline Mesh open_tube(double radius, std::size_t around, std::size_t along, double waves) {
    Mesh mesh;
    for (std::size_t j = 0; j <= along; ++j)
        for (std::size_t i = 0; i < around; ++i) {
            const double angle = 2 * std::numbers::pi * double(i) / double(around), x = 2 * double(j) / double(along);
            const double r = radius * (1 + waves * std::sin(9 * angle) * std::sin(30 * x));
            mesh.positions.push_back(Vec3d(x, r * std::cos(angle), r * std::sin(angle)).cast<float>());
        }
    const auto at = [&](std::size_t i, std::size_t j) { return static_cast<Index>(j * around + i % around); };
    for (std::size_t j = 0; j < along; ++j)
        for (std::size_t i = 0; i < around; ++i) {
            mesh.add_face(std::array{at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.add_face(std::array{at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return mesh;
}

inline void append(Mesh& mesh, const Mesh& other) {
    const auto first = static_cast<Index>(mesh.vertex_count());
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (std::size_t f = 0; f < other.face_count(); ++f) {
        std::vector<Index> face(other.face(f).begin(), other.face(f).end());
        for (Index& v : face) v += first;
        mesh.add_face(face);
    }
}

/// A smooth rod slides and turns in a wavy tube, and both are bent.
inline MadeAnimation rod_in_tube(std::size_t around, std::size_t along, std::size_t frames) {
    Mesh mesh = open_tube(0.15, around, along, 0.03);
    const std::size_t tube = mesh.vertex_count();
    append(mesh, open_tube(0.142, around, along, 0));
    return animate(mesh, frames, [tube, places = places_of(mesh)](std::size_t frame) {
        const double t = double(frame) / 60, bend = 0.9 * std::sin(1.2 * t) + 1e-9;
        const Mat3d turn = Eigen::AngleAxisd(std::numbers::pi / 2 * std::sin(t), Vec3d::UnitX()).toRotationMatrix();
        std::vector<Vec3d> moved = places;
        for (std::size_t v = 0; v < moved.size(); ++v) {
            Vec3d& p = moved[v];
            if (v >= tube) p = turn * Vec3d(p + Vec3d(0.5 * std::sin(2 * t), 0, 0));
            const double angle = bend * p.x();
            p = {std::sin(angle) / bend - std::sin(angle) * p.y(),
                 (1 - std::cos(angle)) / bend + std::cos(angle) * p.y(), p.z()};
        }
        return moved;
    });
}

/// Paper that is folded at fourteen planes, one after the other, and swells to 1.5 times its size.
inline MadeAnimation crumple(std::size_t columns, std::size_t rows, std::size_t frames) {
    Mesh mesh = sheet(columns, rows);
    std::mt19937 random(2);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<std::pair<Vec3d, double>> planes;
    for (int k = 0; k < 14; ++k) {
        const Vec3d normal = Vec3d(unit(random), unit(random), unit(random)).normalized();
        planes.emplace_back(normal, 0.3 * unit(random));
    }
    return animate(mesh, frames, [=, places = places_of(mesh)](std::size_t frame) {
        const double s = double(frame) / double(std::max<std::size_t>(frames - 1, 1));
        std::vector<Vec3d> moved = places;
        for (Vec3d& p : moved) {
            p = p - Vec3d(0.75, 0.5, -0.02 * std::sin(20 * p.x()) * std::sin(17 * p.y()) * s);
            for (std::size_t k = 0; k < planes.size(); ++k) {
                const double folded = std::clamp(0.7 * s * double(planes.size()) - 0.6 * double(k), 0.0, 1.0);
                p -= std::max(p.dot(planes[k].first) - planes[k].second, 0.0) * 2 * folded * planes[k].first;
            }
            p *= 1 + 0.5 * s;
        }
        return moved;
    });
}

/// A mesh on bones at its farthest vertices, with weights that change within 6 % of the diagonal; it walks off.
inline MadeAnimation skinned(Mesh mesh, std::size_t bones, std::size_t frames) {
    const filigree::Box box = filigree::bounds(mesh);
    std::vector<Vec3d> places = places_of(mesh);
    for (Vec3d& p : places) p = (p - box.centre()) / box.diagonal();
    for (std::size_t v = 0; v < places.size(); ++v) mesh.positions[v] = places[v].cast<float>();
    std::vector<double> nearest(places.size(), std::numeric_limits<double>::infinity());
    std::vector<Vec3d> joints;
    std::size_t next = std::size_t(std::ranges::min_element(places, {}, &Vec3d::squaredNorm) - places.begin());
    while (joints.size() < bones) {
        joints.push_back(places[next]);
        for (std::size_t v = 0; v < places.size(); ++v)
            nearest[v] = std::min(nearest[v], (places[v] - joints.back()).squaredNorm());
        next = std::size_t(std::ranges::max_element(nearest) - nearest.begin());
    }
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<Vec3d> axes;
    std::vector<double> phases, angles;
    for (std::size_t k = 0; k < bones; ++k) {
        axes.push_back(Vec3d(unit(random), unit(random), unit(random)).normalized());
        phases.push_back(std::numbers::pi * unit(random));
        angles.push_back(filigree::radians(40 + 20 * unit(random)));
    }
    return animate(std::move(mesh), frames, [=](std::size_t frame) {
        const double t = double(frame) / 30;
        std::vector<Mat3d> turns;
        for (std::size_t k = 0; k < bones; ++k) {
            const double angle = k > 0 ? angles[k] * std::sin(2 * t + phases[k]) : 0;
            turns.push_back(Eigen::AngleAxisd(angle, axes[k]).toRotationMatrix());
        }
        const Mat3d whole = Eigen::AngleAxisd(filigree::radians(20) * std::sin(t), Vec3d::UnitY()).toRotationMatrix();
        std::vector<Vec3d> moved(places.size());
        for (std::size_t v = 0; v < places.size(); ++v) {
            Vec3d sum = Vec3d::Zero();
            double weights = 0;
            for (std::size_t k = 0; k < bones; ++k) {
                const double w = std::exp(((places[v] - joints[k]).squaredNorm() * -1 + nearest[v]) / 0.004);
                const Vec3d pivot = 0.6 * joints[k];
                sum += w * (turns[k] * (places[v] - pivot) + pivot);
                weights += w;
            }
            moved[v] = whole * (sum / weights) + Vec3d(0.2 * t, 0, 0);
        }
        return moved;
    });
}

/// Smooth bulges come and go on a mesh, as on a face.
inline MadeAnimation bulges(Mesh mesh, std::size_t count, std::size_t frames) {
    const double diagonal = filigree::bounds(mesh).diagonal();
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    const std::vector<Vec3d> places = places_of(mesh);
    struct Bulge {
        Vec3d centre, direction;
        double radius, rate, phase;
    };
    std::vector<Bulge> all;
    for (std::size_t k = 0; k < count; ++k) {
        const Vec3d centre = places[std::size_t(unit(random) * double(places.size()))];
        const Vec3d direction = (Vec3d(unit(random), unit(random), unit(random)) - Vec3d::Constant(0.5)).normalized();
        const double radius = diagonal * (0.04 + 0.06 * unit(random));
        all.push_back({centre, direction, radius, 1 + 3 * unit(random), 6 * unit(random)});
    }
    return animate(std::move(mesh), frames, [=](std::size_t frame) {
        std::vector<Vec3d> moved = places;
        for (const Bulge& bulge : all) {
            const double height = std::clamp(std::sin(bulge.rate * double(frame) / 15 + bulge.phase), 0.0, 1.0);
            for (std::size_t v = 0; v < places.size(); ++v)
                moved[v] += 0.35 * bulge.radius * height * bulge.direction *
                            std::exp((places[v] - bulge.centre).squaredNorm() * -0.5 / (bulge.radius * bulge.radius));
        }
        return moved;
    });
}

/// A mesh that a turbulent flow (Arnold, Beltrami and Childress) carries away and mixes.
inline MadeAnimation fluid(Mesh mesh, std::size_t frames) {
    auto moved = std::make_shared<std::vector<std::vector<Vec3d>>>();
    std::vector<Vec3d> now = places_of(mesh);
    const auto velocity = [](const Vec3d& p, double t) {
        const Vec3d q = 5 * p;
        return Vec3d(std::sin(q.z() + 0.7 * t) + 0.6 * std::cos(q.y()),
                     0.8 * std::sin(q.x()) + std::cos(q.z() + 0.7 * t), 0.6 * std::sin(q.y()) + 0.8 * std::cos(q.x()));
    };
    constexpr int kSteps = 4;
    constexpr double kStep = 1.0 / 15 / kSteps;
    for (std::size_t frame = 0; frame < frames; ++frame) {
        const double t = double(frame) / 15;
        for (int step = 0; step < kSteps; ++step)
            for (Vec3d& p : now) p += 0.5 * kStep * velocity(p + 0.25 * kStep * velocity(p, t), t);
        moved->push_back(now);
    }
    return animate(std::move(mesh), frames, [moved](std::size_t frame) { return (*moved)[frame]; });
}

/// Any mesh in any affine motion, with a walk across the world.
inline MadeAnimation affine(Mesh mesh, std::size_t frames) {
    return animate(mesh, frames, [places = places_of(mesh)](std::size_t frame) {
        const double t = double(frame);
        Mat3d matrix = Eigen::AngleAxisd(0.4 * t, Vec3d(1, 2, 3).normalized()).toRotationMatrix();
        matrix *= Vec3d(1 + 0.1 * t, 1, 1 / (1 + 0.2 * t)).asDiagonal();
        matrix(0, 1) += 0.3;
        std::vector<Vec3d> moved = places;
        for (Vec3d& p : moved) p = matrix * p + Vec3d(3 * t, t, -t);
        return moved;
    });
}

} // namespace filigree_test
