// The box of a posed model: never smaller than what it holds, and not much larger.
#include "filigree/render/pose_box.h"

#include "blend/stripping.h"
#include "filigree/mesh.h"
#include "filigree/pose.h"

#include <numbers>
#include <numeric>
#include <random>

using namespace filigree_test;

namespace {

/// The largest distance by which a point is outside a box, and by which the box reaches beyond the points' own box.
struct Fit {
    double outside = 0, slack = 0;
};
Fit fit(const Box& box, std::span<const Vec3f> points) {
    const Box exact = bounds(points);
    return {(box.min - exact.min).cwiseMax(exact.max - box.max).maxCoeff() / exact.diagonal(),
            (exact.min - box.min).cwiseMax(box.max - exact.max).maxCoeff() / exact.diagonal()};
}

Fit fit_at(const Model& model, const Pose& pose) {
    const PoseBox box(model, all_vertices(model));
    const Restorer restorer = restorer_of(model);
    return fit(box.at(pose.positions, restorer.gradients(pose, kOneThread).value()), restored(model, pose));
}

Deformation bend_and_twist(double bend_deg, double twist_deg) {
    const double b = bend_deg * std::numbers::pi / 180, t = twist_deg * std::numbers::pi / 180;
    const auto map = [=](const Vec3d& p) {
        const Eigen::AngleAxisd twist(t * p.x(), Vec3d::UnitX());
        const Vec3d q = twist * p;
        if (b == 0) return q;
        const double r = 1 / b; // the axis is bent to an arc
        return Vec3d((r - q.z()) * std::sin(q.x() / r), q.y(), r - (r - q.z()) * std::cos(q.x() / r));
    };
    return {map, [=](const Vec3d& p) {
                Mat3d a;
                constexpr double h = 1e-5;
                for (int k = 0; k < 3; ++k)
                    a.col(k) = (map(p + h * Vec3d::Unit(k)) - map(p - h * Vec3d::Unit(k))) / (2 * h);
                return a;
            }};
}

/// Rounding of float positions.
constexpr double kRounding = 2e-6;

Model model_of(Mesh mesh, std::size_t base = 100) { return stripped(std::move(mesh), {.base = base}).model; }

} // namespace

TEST(PoseBoxes, HoldsBentTwistedAndMirroredShapes) {
    const Mesh meshes[] = {make_wavy_cube({.resolution = 24, .frequency = 3}), make_wavy_sphere({.resolution = 24}),
                           make_bar({.resolution = 8}), make_torus({.resolution = 32}),
                           make_wavy_plane({.resolution = 32})};
    Mat3d mirror = Vec3d(-1, 1, 1).asDiagonal(), shear = Mat3d::Identity();
    shear(0, 1) = 2;
    const Deformation deformations[] = {affine(Mat3d::Identity(), {0, 0, 0}),
                                        affine(mirror, {5, 0, 0}),
                                        affine(shear, {0, -3, 1}),
                                        affine(Mat3d::Zero(), {1, 2, 3}),
                                        affine(0.01 * Mat3d::Identity(), {0, 0, 0}),
                                        bend_and_twist(60, 0),
                                        bend_and_twist(0, 90),
                                        bend_and_twist(-90, 60)};
    for (const Mesh& mesh : meshes) {
        const Model model = model_of(mesh);
        for (std::size_t i = 0; i < std::size(deformations); ++i) {
            const Pose pose = pose_by(deformations[i], model);
            if (i == 3) continue; // a point: fit() has no diagonal; below
            for (const Pose& p : {pose, without_gradients(pose)}) {
                const Fit f = fit_at(model, p);
                EXPECT_LE(f.outside, kRounding) << i;
                EXPECT_LE(f.slack, 0.05) << i;
            }
        }
        const Pose point = pose_by(deformations[3], model);
        const Box box = PoseBox(model, all_vertices(model)).at(point.positions, point.gradients);
        EXPECT_LT(box.diagonal(), 1e-5);
        EXPECT_LT((box.centre() - Vec3d(1, 2, 3)).norm(), 1e-5);
    }
}

TEST(PoseBoxes, HoldsWhateverTheGradients) {
    std::mt19937 random(7);
    std::normal_distribution<float> number(0, 1);
    const Model model = model_of(make_wavy_cube({.resolution = 16, .frequency = 2}), 60);
    for (int round = 0; round < 40; ++round) {
        Pose pose;
        for (const Vec3f& p : driver_positions(model)) {
            pose.positions.push_back(p + 0.3f * Vec3f(number(random), number(random), number(random)));
            Mat3f a;
            for (int k = 0; k < 9; ++k) a(k) = 2 * number(random);
            pose.gradients.push_back(a);
        }
        EXPECT_LE(fit_at(model, pose).outside, kRounding);
    }
}

TEST(PoseBoxes, HoldsOnlyTheVerticesAskedFor) {
    const Model model = model_of(make_wavy_plane({.resolution = 32, .amplitude = 0}));
    std::vector<Index> left;
    std::vector<Vec3f> points;
    for (Index v = 0; v < model.mesh.vertex_count(); ++v)
        if (model.mesh.positions[v].x() < -0.25f) {
            left.push_back(v);
            points.push_back(model.mesh.positions[v]);
        }
    ASSERT_FALSE(left.empty());
    const Pose pose = rest_pose(model);
    const Box box =
        PoseBox(model, left).at(pose.positions, std::vector<Mat3f>(pose.positions.size(), Mat3f::Identity()));
    const Fit f = fit(box, points);
    EXPECT_LE(f.outside, kRounding);
    EXPECT_LE(f.slack, 0.15); // of the fewer points' diagonal
    EXPECT_TRUE(PoseBox(model, {}).at(pose.positions, std::vector<Mat3f>(pose.positions.size())).empty());
}

/// A driver without faces: cells of one vertex.
TEST(PoseBoxes, HoldsPointSets) {
    Mesh points;
    points.positions = make_wavy_sphere({.resolution = 16}).positions;
    const Model model = model_of(points);
    const Fit f = fit_at(model, pose_by(bend_and_twist(60, 30), model));
    EXPECT_LE(f.outside, kRounding);
    EXPECT_LE(f.slack, 0.1); // one gradient reaches further there
}
