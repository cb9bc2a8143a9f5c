// What tests of pictures share: a renderer without a window, and scenes.
#pragma once

#include "filigree/mesh.h"
#include "filigree/render.h"
#include "hierarchy/stripping.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <numbers>
#include <optional>

namespace filigree_test {

using namespace filigree;

/// Root mean square over all channels, in grey levels. Another driver's rounding stays well below; a part of the
/// picture that is missing goes well above, which TheToleranceIsTight* show.
inline constexpr double kTolerance = 2.5;
inline constexpr double kSame = 0.5; // of pictures that differ by rounding alone

inline constexpr PictureOptions kSmall = {.width = 200, .height = 150, .passes = 8};

class Rendered : public testing::Test {
protected:
    void SetUp() override {
        Result<HeadlessContext> context = HeadlessContext::create();
        if (!context) {
            ASSERT_EQ(context.error().code, ErrorCode::unsupported) << context.error().message;
            GTEST_SKIP() << context.error().message;
        }
        context_.emplace(std::move(*context));
        Result<Renderer> renderer = Renderer::create();
        ASSERT_TRUE(renderer.ok()) << renderer.error().message;
        renderer_.emplace(std::move(*renderer));
    }

    Picture draw(const Scene& scene, const Camera& camera, const PictureOptions& options = kSmall) {
        Result<Picture> picture = renderer_->picture(scene, camera, options, kOneThread);
        EXPECT_TRUE(picture.ok()) << (picture.ok() ? "" : picture.error().message);
        return picture.ok() ? std::move(*picture) : Picture();
    }
    Error refusal(const Scene& scene, const PictureOptions& options, const RunContext& context = kOneThread) {
        const Result<Picture> picture = renderer_->picture(scene, {}, options, context);
        return picture.ok() ? Error{ErrorCode::usage, "it was drawn"} : picture.error();
    }

    void expect_golden(const Picture& picture, const std::string& name) {
        const std::string path = std::string(FILIGREE_ROOT) + "/tests/render/golden/" + name + ".png";
        if (std::getenv("FILIGREE_WRITE_GOLDEN")) {
            std::ofstream(path, std::ios::binary) << encode_png(picture);
            return;
        }
        const Result<Picture> golden = read_picture(path);
        ASSERT_TRUE(golden.ok()) << golden.error().message;
        EXPECT_LT(picture_distance(picture, *golden), kTolerance) << name;
    }

    std::optional<HeadlessContext> context_;
    std::optional<Renderer> renderer_;
};

inline Drawable drawable_of(Result<Drawable> made) {
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
    return std::move(*made);
}
inline Drawable surface(const Mesh& mesh, const SurfaceOptions& options = {}) {
    return drawable_of(Drawable::surface(mesh, options, kOneThread));
}
inline Drawable points(const Mesh& mesh, const PointOptions& options = {}) {
    return drawable_of(Drawable::points(mesh.positions, mesh.origin, options, kOneThread));
}

inline Camera camera_on(const Mesh& mesh, View view = View::iso, double field_of_view = 30) {
    const CameraPoints seen{mesh.positions, mesh.origin};
    return fit_camera(std::span(&seen, 1), view_direction(view, UpAxis::y), up_vector(UpAxis::y), 4.0 / 3,
                      field_of_view, 0.12);
}

inline Scene scene_of(const Drawable& drawable, const Appearance& look = {}) {
    Scene scene;
    scene.objects.push_back({&drawable, look});
    return scene;
}

inline Mesh wavy_cube() { return make_wavy_cube({.resolution = 24, .frequency = 2, .amplitude = 0.06}); }
inline Mesh sphere(unsigned resolution = 12) { return make_wavy_sphere({.resolution = resolution, .amplitude = 0}); }
inline Mesh scaled(Mesh mesh, double factor) {
    for (Vec3f& p : mesh.positions) p = (factor * p.cast<double>()).cast<float>();
    return mesh;
}

inline Deformation bend(double degrees) {
    const double r = 1 / (degrees * std::numbers::pi / 180);
    return {[=](const Vec3d& p) {
                return Vec3d((r - p.z()) * std::sin(p.x() / r), p.y(), r - (r - p.z()) * std::cos(p.x() / r));
            },
            [=](const Vec3d& p) {
                const double c = std::cos(p.x() / r), s = std::sin(p.x() / r), k = (r - p.z()) / r;
                Mat3d a;
                a << k * c, 0, -s, 0, 1, 0, k * s, 0, c;
                return a;
            }};
}

} // namespace filigree_test
