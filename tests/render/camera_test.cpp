#include "filigree/render.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace filigree;

namespace {

constexpr double kHeight = 1000;

std::vector<Vec3f> cloud(std::size_t count, const Vec3f& stretch, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-1, 1);
    std::vector<Vec3f> points;
    for (std::size_t i = 0; i < count; ++i)
        points.push_back(stretch.cwiseProduct(Vec3f(uniform(random), uniform(random), uniform(random))));
    return points;
}

Vec3d random_direction(std::mt19937& random) {
    std::normal_distribution<double> normal;
    return Vec3d(normal(random), normal(random), normal(random)).normalized();
}

/// The points' box on a picture of that aspect, in pixels; z: distances.
Box on_picture(const Camera& camera, std::span<const CameraPoints> parts, double aspect) {
    Box box;
    for (const CameraPoints& part : parts)
        for (const Vec3f& p : part.positions)
            box.extend(camera.project(part.origin + p.cast<double>(), aspect * kHeight, kHeight));
    return box;
}

/// Everything lies inside the margin, in front of the camera, and two opposite sides are touched.
void expect_tight(const Camera& camera, std::span<const CameraPoints> parts, double aspect, double margin,
                  double tolerance = 1e-6) {
    const Box box = on_picture(camera, parts, aspect);
    const double edge = margin * kHeight, right = aspect * kHeight - edge, bottom = kHeight - edge;
    EXPECT_GT(box.min.z(), 0);
    EXPECT_GE(box.min.x(), edge - tolerance);
    EXPECT_GE(box.min.y(), edge - tolerance);
    EXPECT_LE(box.max.x(), right + tolerance);
    EXPECT_LE(box.max.y(), bottom + tolerance);
    const bool sides = box.min.x() < edge + tolerance && box.max.x() > right - tolerance;
    const bool ends = box.min.y() < edge + tolerance && box.max.y() > bottom - tolerance;
    EXPECT_TRUE(sides || ends) << box.min.transpose() << " to " << box.max.transpose();
}

void expect_same(const Vec3d& a, const Vec3d& b) { EXPECT_LT((a - b).norm(), 1e-12) << a.transpose(); }

void expect_rotation(const Mat3d& basis) {
    EXPECT_LT((basis.transpose() * basis - Mat3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(basis.determinant(), 1, 1e-12);
}

bool is_finite(const Camera& camera) { return camera.eye.allFinite() && camera.target.allFinite(); }

} // namespace

TEST(Camera, BasisIsRightUpAndBack) {
    Camera camera;
    camera.eye = {0, 0, 5};
    expect_same(camera.basis().col(0), {1, 0, 0});
    expect_same(camera.basis().col(1), {0, 1, 0});
    expect_same(camera.basis().col(2), {0, 0, 1});
    std::mt19937 random(1);
    for (int i = 0; i < 100; ++i) {
        camera.eye = 3 * random_direction(random);
        camera.up = 7 * random_direction(random);
        expect_rotation(camera.basis());
        EXPECT_GT(camera.basis().col(1).dot(camera.up), 0);
    }
}

TEST(Camera, AViewAlongUpHasTheFrontAtTheBottom) {
    Camera camera;
    const auto up_of_picture = [&](const Vec3d& from, const Vec3d& up) -> Vec3d {
        camera.eye = from;
        camera.up = up;
        expect_rotation(camera.basis());
        return camera.basis().col(1);
    };
    expect_same(up_of_picture({0, 4, 0}, {0, 1, 0}), {0, 0, -1});
    expect_same(up_of_picture({0, -4, 0}, {0, 1, 0}), {0, 0, 1});
    expect_same(up_of_picture({0, 0, 4}, {0, 0, 1}), {0, 1, 0});
    expect_same(up_of_picture({0, 0, -4}, {0, 0, 1}), {0, -1, 0});
    expect_same(up_of_picture({4, 0, 0}, {1, 0, 0}), {0, 0, -1});
    up_of_picture({1, 2, 3}, {-2, -4, -6});
    up_of_picture({0, 0, 0}, {0, 1, 0}); // no view at all
    up_of_picture({1, 2, 3}, {0, 0, 0}); // no up at all
    // As the view tilts up from the front, the picture does not jump.
    const Vec3d nearly = up_of_picture({0, 4, 0.001}, {0, 1, 0});
    EXPECT_LT((nearly - Vec3d(0, 0, -1)).norm(), 1e-3);
}

TEST(Camera, ProjectionAndProjectAgree) {
    std::mt19937 random(2);
    for (const double field_of_view : {30.0, 90.0, 0.0}) {
        Camera camera;
        camera.eye = {1, 2, 9};
        camera.target = {0.5, -1, 0};
        camera.field_of_view_deg = field_of_view;
        camera.height = 3;
        const double width = 1500, near = 2, far = 40;
        const Eigen::Matrix4d matrix = camera.projection(width / kHeight, near, far);
        for (int i = 0; i < 100; ++i) {
            const Vec3d world = 2 * random_direction(random);
            const Eigen::Vector4d clip = matrix * camera.to_camera(world).homogeneous();
            const Vec3d ndc = clip.hnormalized();
            const Vec3d pixel = camera.project(world, width, kHeight);
            EXPECT_NEAR(pixel.x(), (ndc.x() + 1) / 2 * width, 1e-9);
            EXPECT_NEAR(pixel.y(), (1 - ndc.y()) / 2 * kHeight, 1e-9);
            EXPECT_NEAR(pixel.z(), (camera.eye - world).dot(camera.basis().col(2)), 1e-12);
        }
        for (const auto& [distance, depth] : {std::pair{near, -1.0}, {far, 1.0}})
            EXPECT_NEAR((matrix * Eigen::Vector4d(0.3, 0.2, -distance, 1)).hnormalized().z(), depth, 1e-12);
        const Vec3d centre = camera.project(camera.target, width, kHeight);
        EXPECT_NEAR(centre.x(), width / 2, 1e-9);
        EXPECT_NEAR(centre.y(), kHeight / 2, 1e-9);
    }
}

TEST(Camera, RaysAreTheInverseOfProject) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> at(-0.2, 1.2), along(0.1, 30);
    for (const double field_of_view : {30.0, 100.0, 0.0}) {
        Camera camera;
        camera.eye = {1, 2, 9};
        camera.target = {0.5, -1, 0};
        camera.field_of_view_deg = field_of_view;
        camera.height = 3;
        for (int i = 0; i < 100; ++i) {
            const double width = 1500, x = width * at(random), y = kHeight * at(random), distance = along(random);
            const Camera::Ray ray = camera.ray(x, y, width, kHeight);
            EXPECT_NEAR(ray.direction.norm(), 1, 1e-12);
            const Vec3d pixel = camera.project(ray.origin + distance * ray.direction, width, kHeight);
            EXPECT_NEAR(pixel.x(), x, 1e-8);
            EXPECT_NEAR(pixel.y(), y, 1e-8);
            EXPECT_GT(pixel.z(), 0);
        }
        const Camera::Ray middle = camera.ray(750, 500, 1500, kHeight);
        expect_same(middle.origin, camera.eye);
        expect_same(middle.direction, (camera.target - camera.eye).normalized());
    }
}

TEST(View, DirectionsSuitTheUpAxis) {
    expect_same(view_direction(View::front, UpAxis::y), {0, 0, 1});
    expect_same(view_direction(View::side, UpAxis::y), {1, 0, 0});
    expect_same(view_direction(View::top, UpAxis::y), {0, 1, 0});
    expect_same(view_direction(View::front, UpAxis::z), {0, -1, 0});
    expect_same(view_direction(View::side, UpAxis::z), {1, 0, 0});
    expect_same(view_direction(View::top, UpAxis::z), {0, 0, 1});
    for (const UpAxis up : {UpAxis::x, UpAxis::y, UpAxis::z}) {
        const Vec3d front = view_direction(View::front, up), side = view_direction(View::side, up);
        expect_same(up_vector(up), view_direction(View::top, up));
        expect_same(up_vector(up).cross(front), side); // the side is to the right of the front
        const Vec3d iso = view_direction(View::iso, up);
        EXPECT_NEAR(iso.norm(), 1, 1e-12);
        for (const Vec3d& axis : {front, side, up_vector(up)}) EXPECT_GT(iso.dot(axis), 0.3);
    }
    expect_same(up_vector(UpAxis::x), {1, 0, 0});
    expect_same(up_vector(UpAxis::y), {0, 1, 0});
    expect_same(up_vector(UpAxis::z), {0, 0, 1});
}

TEST(FitCamera, ShowsAllAsLargeAsItFits) {
    std::mt19937 random(3);
    for (int i = 0; i < 200; ++i) {
        const Vec3f stretch =
            Vec3f(1, 1, 1).cwiseQuotient(Vec3f(1, static_cast<float>(1 + i % 7), static_cast<float>(1 + i % 11)));
        const std::vector<Vec3f> points = cloud(3 + i, stretch, static_cast<unsigned>(i));
        const CameraPoints part{points};
        const double aspect = 0.4 + 0.1 * (i % 20), margin = 0.01 * (i % 12);
        const double field_of_view = 15.0 * (i % 4); // 0: parallel
        const Vec3d direction = random_direction(random);
        const Camera camera =
            fit_camera({&part, 1}, direction, random_direction(random), aspect, field_of_view, margin);
        SCOPED_TRACE(i);
        EXPECT_EQ(camera.field_of_view_deg, field_of_view);
        expect_tight(camera, {&part, 1}, aspect, margin);
        EXPECT_LT(((camera.eye - camera.target).normalized() - direction).norm(), 1e-9);
    }
}

TEST(FitCamera, TheTargetIsHalfWayThroughTheObject) {
    const std::vector<Vec3f> points = cloud(100, {1, 2, 3}, 4);
    const CameraPoints part{points};
    for (const double field_of_view : {0.0, 30.0}) {
        const Camera camera = fit_camera({&part, 1}, {0, 0, 1}, {0, 1, 0}, 1.5, field_of_view);
        EXPECT_NEAR(camera.target.z(), bounds(points).centre().z(), 1e-9);
        const Box box = on_picture(camera, {&part, 1}, 1.5);
        EXPECT_NEAR((camera.eye - camera.target).norm(), (box.min.z() + box.max.z()) / 2, 1e-9);
    }
}

TEST(FitCamera, SeveralPartsAndAFarOriginLoseNoDigits) {
    const std::vector<Vec3f> house = cloud(200, {5, 4, 3}, 5), tree = cloud(200, {1, 1, 4}, 6);
    const Vec3d far(500000, -5200000, 300);
    const std::vector<CameraPoints> near_parts = {{house, Vec3d::Zero()}, {tree, {9, 0, 0}}};
    const std::vector<CameraPoints> far_parts = {{house, far}, CameraPoints{}, {tree, far + Vec3d(9, 0, 0)}};
    for (const double field_of_view : {0.0, 30.0}) {
        const Vec3d direction = view_direction(View::iso, UpAxis::z);
        const Camera near = fit_camera(near_parts, direction, up_vector(UpAxis::z), 1.3, field_of_view);
        const Camera camera = fit_camera(far_parts, direction, up_vector(UpAxis::z), 1.3, field_of_view);
        expect_tight(near, near_parts, 1.3, 0.06);
        expect_tight(camera, far_parts, 1.3, 0.06, 1e-3); // of a pixel
        EXPECT_LT((camera.eye - far - near.eye).norm(), 1e-6);
        EXPECT_LT((camera.target - far - near.target).norm(), 1e-6);
        EXPECT_NEAR(camera.height, near.height, 1e-6);
    }
}

TEST(FitCamera, PointsWithoutExtentAreSeen) {
    const std::vector<std::vector<Vec3f>> sets = {{{3, 4, 5}},
                                                  {{3, 4, 5}, {3, 4, 5}},
                                                  {{0, 0, -2}, {0, 0, 7}},
                                                  {{1, 0, 0}, {2, 0, 0}},
                                                  {{0, 1e-30f, 0}, {0, 0, 0}}};
    for (const std::vector<Vec3f>& points : sets)
        for (const double field_of_view : {0.0, 30.0}) {
            const CameraPoints part{points};
            const Camera camera = fit_camera({&part, 1}, {0, 0, 1}, {0, 1, 0}, 1.5, field_of_view);
            ASSERT_TRUE(is_finite(camera));
            EXPECT_GT(camera.height, 0);
            EXPECT_GT((camera.eye - camera.target).norm(), 0);
            const Box box = on_picture(camera, {&part, 1}, 1.5);
            EXPECT_GT(box.min.z(), 0);
            EXPECT_GE(box.min.x(), 60 - 1e-6);
            EXPECT_LE(box.max.x(), 1440 + 1e-6);
            EXPECT_NEAR((box.min.y() + box.max.y()) / 2, 500, 1e-6);
        }
}

TEST(FitCamera, NoPointsShowTheUnitCube) {
    std::vector<Vec3f> cube;
    for (int c = 0; c < 8; ++c) cube.emplace_back(c & 1 ? 0.5f : -0.5f, c & 2 ? 0.5f : -0.5f, c & 4 ? 0.5f : -0.5f);
    const CameraPoints part{cube}, nothing;
    expect_tight(fit_camera({}, {1, 1, 1}, {0, 1, 0}, 1.5), {&part, 1}, 1.5, 0.06);
    expect_tight(fit_camera({&nothing, 1}, {1, 1, 1}, {0, 1, 0}, 1.5), {&part, 1}, 1.5, 0.06);
}

TEST(FitCamera, AMarginLargerThanThePictureLeavesSomething) {
    const std::vector<Vec3f> points = cloud(50, {1, 1, 1}, 8);
    const CameraPoints part{points};
    const Camera camera = fit_camera({&part, 1}, {0, 0, 1}, {0, 1, 0}, 0.1, 30, 0.6);
    EXPECT_TRUE(is_finite(camera));
    EXPECT_GT(on_picture(camera, {&part, 1}, 0.1).min.z(), 0);
}

TEST(Turned, GoesAroundTheTarget) {
    Camera camera;
    camera.eye = {0, 1, 4};
    camera.target = {0, 1, 1};
    camera.up = {0, 2, 0};
    expect_same(turned(camera, 90).eye, {3, 1, 1});
    expect_same(turned(camera, 90).target, camera.target);
    expect_same(turned(camera, -90).eye, {-3, 1, 1});
    expect_same(turned(turned(camera, 100), 260).eye, camera.eye);
}
