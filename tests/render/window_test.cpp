// What a window asks of the renderer: previews, pictures beside each other, objects that melt into each other, and
// drawables that are made in other threads, posed by the processor, and changed.
#include "cases.h"
#include "render/rendered.h"

#include "filigree/mesh/normals.h"

#include <epoxy/gl.h>
#include <random>
#include <thread>

using namespace filigree_test;

namespace {

/// A framebuffer to show pictures in, as a window's.
class Window {
public:
    Window(unsigned width, unsigned height, int samples = 0) : width_(width), height_(height) {
        glGenRenderbuffers(1, &color_);
        glBindRenderbuffer(GL_RENDERBUFFER, color_);
        glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_RGBA8, GLsizei(width), GLsizei(height));
        glGenFramebuffers(1, &name_);
        glBindFramebuffer(GL_FRAMEBUFFER, name_);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color_);
        const std::array<float, 4> clear = {kClear / 255.0f, kClear / 255.0f, kClear / 255.0f, 1};
        glClearBufferfv(GL_COLOR, 0, clear.data());
    }
    Window(const Window&) = delete;
    ~Window() {
        glDeleteFramebuffers(1, &name_);
        glDeleteRenderbuffers(1, &color_);
    }
    unsigned name() const { return name_; }
    Picture picture(unsigned x, unsigned y, unsigned width, unsigned height) const {
        Picture upward(width, height), picture(width, height);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, name_);
        glPixelStorei(GL_PACK_ALIGNMENT, 1);
        glReadPixels(GLint(x), GLint(y), GLsizei(width), GLsizei(height), GL_RGBA, GL_UNSIGNED_BYTE,
                     upward.rgba.data());
        for (unsigned row = 0; row < height; ++row)
            std::copy_n(upward.pixel(0, height - 1 - row), 4 * width, picture.pixel(0, row));
        return picture;
    }
    Picture picture() const { return picture(0, 0, width_, height_); }

    static constexpr std::uint8_t kClear = 51;

private:
    unsigned width_, height_;
    GLuint name_ = 0, color_ = 0;
};

class InWindow : public Rendered {
protected:
    static constexpr unsigned kWidth = 200, kHeight = 150;

    Picture preview(const Scene& scene, const Camera& camera) {
        EXPECT_TRUE(renderer_->preview(scene, camera, kWidth, kHeight).ok());
        const Window window(kWidth, kHeight);
        renderer_->show(window.name());
        return window.picture();
    }
};

Vec3d mean_color(const Picture& picture) {
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4)
        for (int k = 0; k < 3; ++k) sum[k] += picture.rgba[i + k];
    return sum / (double(picture.rgba.size()) / 4);
}

std::size_t opaque_pixels(const Picture& picture) {
    std::size_t count = 0;
    for (std::size_t i = 3; i < picture.rgba.size(); i += 4) count += picture.rgba[i] == 255;
    return count;
}

Scene cut_out(const Drawable& drawable, const Appearance& look = {}) {
    Scene scene = scene_of(drawable, look);
    scene.background.transparent = true;
    scene.ground = false;
    return scene;
}

Drawable posed_on(RestoreOn where, const Model& model, const RestoreOptions& restore, const Pose& pose) {
    Result<DrawData> data = DrawData::model(model, restore, {}, where, kOneThread);
    EXPECT_TRUE(data.ok());
    Drawable drawable = drawable_of(Drawable::upload(std::move(*data)));
    EXPECT_TRUE(drawable.set_pose(pose, kOneThread).ok());
    return drawable;
}

} // namespace

TEST_F(InWindow, ThePreviewIsAsBrightAsThePicture) {
    const Mesh cube = wavy_cube(), ball = make_wavy_sphere({.resolution = 40}), coarse = sphere(6);
    for (const Mesh* mesh : {&cube, &ball, &coarse}) { // the second is lit vertex by vertex
        const Drawable drawable = surface(*mesh);
        const Scene scene = cut_out(drawable);
        const Vec3d quick = mean_color(preview(scene, camera_on(*mesh)));
        const Vec3d whole = mean_color(draw(scene, camera_on(*mesh), {.width = kWidth, .height = kHeight}));
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(quick[k] / whole[k], 1, 0.06) << k;
    }
}

TEST_F(InWindow, ThePreviewShowsTheSameShapes) {
    const Mesh mesh = wavy_cube(), fine = make_wavy_sphere({.resolution = 40});
    const Drawable cube = surface(mesh), ball = surface(fine), balls = points(mesh);
    for (const Appearance& look :
         {Appearance{}, Appearance{.edges = true}, Appearance{.clip = ClipPlane{Vec3d::UnitX(), 0}}})
        for (const Drawable* drawable : {&cube, &ball, &balls}) {
            const Scene scene = cut_out(*drawable, look);
            const auto quick = double(opaque_pixels(preview(scene, camera_on(mesh))));
            const auto whole =
                double(opaque_pixels(draw(scene, camera_on(mesh), {.width = kWidth, .height = kHeight, .passes = 1})));
            EXPECT_GT(whole, 1000);
            EXPECT_NEAR(quick / whole, 1, 0.06); // rims that are partly covered are not opaque
        }
}

TEST_F(InWindow, APreviewDoesNotDisturbThePasses) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh);
    const Scene scene = scene_of(cube);
    const Picture before = draw(scene, camera_on(mesh));
    preview(scene, camera_on(mesh));
    EXPECT_FALSE(renderer_->add_pass()); // a preview is whole
    EXPECT_TRUE(draw(scene, camera_on(mesh)).rgba == before.rgba);
    EXPECT_EQ(renderer_->preview(scene, camera_on(mesh), 0, 10).error().code, ErrorCode::unsuitable);
    EXPECT_EQ(renderer_->preview(scene, camera_on(mesh), 1u << 20, 10).error().code, ErrorCode::unsuitable);
}

TEST_F(InWindow, AFinePreviewShowsColorsAndNumbers) {
    Mesh mesh = make_wavy_sphere({.resolution = 40, .amplitude = 0});
    const std::vector<float> values(mesh.vertex_count(), 1.0f);
    const Drawable numbers = surface(mesh, {.scalars = {values, ColorMap::diverging, {-1, 1}}});
    const Vec3d red = mean_color(preview(cut_out(numbers), camera_on(mesh)));
    EXPECT_GT(red.x(), 1.5 * red.z());
    mesh.colors.assign(mesh.vertex_count(), Vec4f(0.1f, 0.1f, 0.9f, 1));
    const Drawable colors = surface(mesh);
    const Vec3d blue = mean_color(preview(cut_out(colors), camera_on(mesh)));
    EXPECT_GT(blue.z(), 1.5 * blue.x());
}

TEST_F(InWindow, PicturesStandBesideEachOther) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh);
    const Scene scene = scene_of(cube);
    for (const int samples : {0, 4})
        for (const bool is_preview : {false, true}) {
            const Window window(3 * kWidth, 2 * kHeight, samples), alone(kWidth, kHeight);
            if (is_preview) {
                ASSERT_TRUE(renderer_->preview(scene, camera_on(mesh), kWidth, kHeight).ok());
            } else {
                ASSERT_TRUE(renderer_->begin(scene, camera_on(mesh), kWidth, kHeight, 4).ok());
                while (renderer_->add_pass()) {
                }
            }
            renderer_->show(alone.name());
            renderer_->show(window.name(), kWidth, 70);
            if (samples) { // read through a copy
                const Window copy(3 * kWidth, 2 * kHeight);
                glBindFramebuffer(GL_READ_FRAMEBUFFER, window.name());
                glBindFramebuffer(GL_DRAW_FRAMEBUFFER, copy.name());
                glBlitFramebuffer(0, 0, 3 * kWidth, 2 * kHeight, 0, 0, 3 * kWidth, 2 * kHeight, GL_COLOR_BUFFER_BIT,
                                  GL_NEAREST);
                EXPECT_TRUE(copy.picture(kWidth, 70, kWidth, kHeight).rgba == alone.picture().rgba);
                continue;
            }
            EXPECT_TRUE(window.picture(kWidth, 70, kWidth, kHeight).rgba == alone.picture().rgba);
            const Picture all = window.picture();
            for (unsigned y = 0; y < all.height; ++y)
                for (unsigned x = 0; x < all.width; ++x) {
                    const bool is_inside = x >= kWidth && x < 2 * kWidth && y >= kHeight - 70 && y < 2 * kHeight - 70;
                    ASSERT_TRUE(is_inside || all.pixel(x, y)[1] == Window::kClear) << x << " " << y;
                }
        }
}

TEST_F(InWindow, WhateverStateIsFoundAndNothingIsLeft) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh, {});
    const Scene scene = scene_of(cube, {.edges = true});
    const Picture clean = draw(scene, camera_on(mesh)), clean_preview = preview(scene, camera_on(mesh));
    GLuint sampler = 0;
    glGenSamplers(1, &sampler);
    const auto soil = [&] {
        for (const GLenum ability :
             {GL_BLEND, GL_SCISSOR_TEST, GL_STENCIL_TEST, GL_CULL_FACE, GL_FRAMEBUFFER_SRGB, GL_POLYGON_OFFSET_FILL})
            glEnable(ability);
        glDisable(GL_DEPTH_TEST);
        glScissor(3, 3, 5, 5);
        glStencilFunc(GL_NEVER, 1, 0xff);
        glBlendFunc(GL_DST_COLOR, GL_ZERO);
        glBlendEquation(GL_FUNC_REVERSE_SUBTRACT);
        glDepthMask(GL_FALSE);
        glDepthFunc(GL_GREATER);
        glClearDepth(0.2);
        glDepthRange(0.8, 0.3);
        glColorMask(GL_FALSE, GL_TRUE, GL_FALSE, GL_FALSE);
        glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
        glPolygonOffset(5, 500);
        glPixelStorei(GL_UNPACK_ALIGNMENT, 8);
        glPixelStorei(GL_UNPACK_ROW_LENGTH, 7);
        for (GLuint unit = 0; unit < 5; ++unit) glBindSampler(unit, sampler);
        glActiveTexture(GL_TEXTURE3);
    };
    const std::vector<float> values(mesh.vertex_count(), 0.3f);
    const Drawable colored = surface(mesh, {.scalars = {values, ColorMap::diverging, {0, 1}}});
    const Picture clean_colors = draw(scene_of(colored), camera_on(mesh));
    soil();
    const Drawable colored_again = surface(mesh, {.scalars = {values, ColorMap::diverging, {0, 1}}});
    EXPECT_TRUE(draw(scene_of(colored_again), camera_on(mesh)).rgba == clean_colors.rgba);
    soil();
    EXPECT_TRUE(draw(scene, camera_on(mesh)).rgba == clean.rgba);
    soil();
    ASSERT_TRUE(renderer_->preview(scene, camera_on(mesh), kWidth, kHeight).ok());
    const Window window(kWidth, kHeight);
    soil();
    renderer_->show(window.name());
    EXPECT_TRUE(window.picture().rgba == clean_preview.rgba);

    const auto number = [](GLenum name) {
        GLint value = -1;
        glGetIntegerv(name, &value);
        return value;
    };
    EXPECT_EQ(number(GL_DRAW_FRAMEBUFFER_BINDING), GLint(window.name()));
    for (const bool is_preview : {true, false}) {
        if (is_preview) {
            ASSERT_TRUE(renderer_->preview(scene, camera_on(mesh), kWidth, kHeight).ok());
        } else {
            ASSERT_TRUE(renderer_->begin(scene, camera_on(mesh), kWidth, kHeight, 2).ok());
            renderer_->add_pass();
        }
        for (const GLenum name : {GL_CURRENT_PROGRAM, GL_VERTEX_ARRAY_BINDING, GL_ARRAY_BUFFER_BINDING,
                                  GL_TEXTURE_BINDING_2D, GL_DEPTH_TEST, GL_BLEND, GL_SCISSOR_TEST})
            EXPECT_EQ(number(name), 0) << name;
        EXPECT_EQ(number(GL_ACTIVE_TEXTURE), GL_TEXTURE0);
        EXPECT_EQ(number(GL_DRAW_FRAMEBUFFER_BINDING), GLint(window.name()));
    }
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    glDeleteSamplers(1, &sampler);
}

TEST_F(InWindow, ComplementsCoverEverythingTogether) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh), balls = points(mesh);
    const Camera camera = camera_on(mesh);
    for (const Drawable* drawable : {&cube, &balls}) {
        const auto pixels = [&](float coverage) {
            return double(opaque_pixels(preview(cut_out(*drawable, {.coverage = coverage}), camera)));
        };
        const double all = pixels(1);
        EXPECT_EQ(pixels(0), 0);
        EXPECT_EQ(pixels(-1), 0);
        for (const float part : all_cases() ? std::vector{0.1f, 0.5f, 0.8f} : std::vector{0.3f}) {
            EXPECT_NEAR(pixels(part) / all, part, 0.05);
            EXPECT_NEAR(pixels(-part) / all, 1 - part, 0.05);
            Scene both = cut_out(*drawable, {.coverage = part});
            both.objects.push_back({drawable, {.coverage = -part}});
            EXPECT_TRUE(preview(both, camera).rgba == preview(cut_out(*drawable), camera).rgba);
            // With light and shadow, too.
            both.ground = true;
            both.background.transparent = false;
            EXPECT_LT(picture_distance(draw(both, camera), draw(scene_of(*drawable), camera)), kSame);
        }
        // The pattern changes from pass to pass: half of an object is half transparent.
        const Picture half =
            draw(cut_out(*drawable, {.coverage = 0.5f}), camera, {.width = 200, .height = 150, .passes = 16});
        EXPECT_NEAR(half.pixel(100, 75)[3], 128, 24);
    }
}

TEST_F(InWindow, ProcessorAndShaderRestoreTheSame) {
    Mesh with_normals = wavy_cube();
    with_normals.normals.values = vertex_normals(with_normals, with_normals.positions, kOneThread);
    for (const Mesh& mesh : {wavy_cube(), with_normals}) {
        const Model model = stripped(mesh, {.base = 150}).model;
        const Pose pose = pose_by(bend(80), model);
        for (unsigned level = 0; level <= model.finest_level(); ++level) {
            const RestoreOptions restore{.level = level};
            const Drawable on_cpu = posed_on(RestoreOn::cpu, model, restore, pose);
            const Drawable on_gpu = posed_on(RestoreOn::gpu, model, restore, pose);
            const std::vector<Vec3f> there = *restorer_of(model, restore).positions(pose, kOneThread);
            const Box exact = bounds(there);
            EXPECT_LT((on_cpu.box().min - exact.min).norm(), 1e-6);
            EXPECT_LT((on_cpu.box().max - exact.max).norm(), 1e-6);
            Mesh seen;
            seen.positions = there;
            Scene a = scene_of(on_cpu), b = scene_of(on_gpu);
            a.fixed_ground = b.fixed_ground = true;
            a.ground_level = b.ground_level = exact.min.y() - 1e-4;
            EXPECT_LT(picture_distance(draw(a, camera_on(seen)), draw(b, camera_on(seen))), 2 * kSame) << level;
            EXPECT_LT(picture_distance(preview(a, camera_on(seen)), preview(b, camera_on(seen))), 2 * kSame);
        }
        Drawable drawable = posed_on(RestoreOn::cpu, model, {}, pose);
        const Picture before = draw(scene_of(drawable), camera_on(mesh));
        Pose wrong = pose;
        wrong.positions.pop_back();
        EXPECT_EQ(drawable.set_pose(wrong, kOneThread).error().code, ErrorCode::mismatch);
        const RunContext cancelled(1);
        cancelled.cancel();
        EXPECT_EQ(drawable.set_pose(rest_pose(model), cancelled).error().code, ErrorCode::cancelled);
        EXPECT_TRUE(draw(scene_of(drawable), camera_on(mesh)).rgba == before.rgba); // nothing happened
        EXPECT_TRUE(drawable.set_pose(rest_pose(model), kOneThread).ok());
        const Drawable rest = surface(mesh);
        EXPECT_LT(picture_distance(draw(scene_of(drawable), camera_on(mesh)), draw(scene_of(rest), camera_on(mesh))),
                  kSame);
    }
}

TEST_F(InWindow, DrawablesArePreparedInAnyThread) {
    const Mesh mesh = wavy_cube();
    const Model model = stripped(mesh, {.base = 150}).model;
    std::vector<DrawData> made;
    std::jthread([&] {
        made.push_back(*DrawData::surface(mesh, {}, kOneThread));
        made.push_back(*DrawData::model(model, {}, {}, RestoreOn::gpu, kOneThread));
        made.push_back(*DrawData::model(model, {}, {}, RestoreOn::cpu, kOneThread));
        EXPECT_EQ(DrawData::model(model, {.level = 99}, {}, RestoreOn::cpu, kOneThread).error().code, ErrorCode::usage);
        EXPECT_EQ(DrawData::surface({}, {}, kOneThread).error().code, ErrorCode::unsuitable);
        const RunContext cancelled(1);
        cancelled.cancel();
        EXPECT_EQ(DrawData::surface(mesh, {}, cancelled).error().code, ErrorCode::cancelled);
    }).join();
    std::vector<Drawable> here;
    here.push_back(surface(mesh));
    here.push_back(drawable_of(Drawable::upload(*DrawData::model(model, {}, {}, RestoreOn::gpu, kOneThread))));
    here.push_back(surface(mesh));
    for (std::size_t i = 0; i < made.size(); ++i) {
        const Drawable there = drawable_of(Drawable::upload(std::move(made[i])));
        EXPECT_EQ(there.triangle_count(), here[i].triangle_count());
        EXPECT_LT(picture_distance(draw(scene_of(there), camera_on(mesh)), draw(scene_of(here[i]), camera_on(mesh))),
                  i == 2 ? kSame : 1e-9)
            << i;
    }
}

TEST_F(InWindow, NumbersAreChanged) {
    const Mesh mesh = wavy_cube();
    const Model model = stripped(mesh, {.base = 150}).model;
    std::vector<float> heights;
    for (const Vec3f& p : mesh.positions) heights.push_back(p.z());
    const ScalarColors colors{heights, ColorMap::sequential, {-0.5f, 0.5f}};
    const Camera camera = camera_on(mesh);
    const Drawable expected = surface(mesh, {.scalars = colors}), plain = surface(mesh);
    const Picture with = draw(scene_of(expected), camera), without = draw(scene_of(plain), camera);
    ASSERT_GT(picture_distance(with, without), 10);

    std::vector<Drawable> drawables;
    drawables.push_back(surface(mesh));
    for (const RestoreOn where : {RestoreOn::cpu, RestoreOn::gpu})
        drawables.push_back(posed_on(where, model, {}, rest_pose(model)));
    for (Drawable& drawable : drawables) {
        Scene scene = scene_of(drawable); // the box of a posed model is a little larger
        scene.fixed_ground = true;
        scene.ground_level = scene_of(plain).box().min.y() - 1e-4 * scene_of(plain).box().diagonal();
        ASSERT_TRUE(drawable.set_scalars(colors).ok());
        EXPECT_LT(picture_distance(draw(scene, camera), with), 2 * kSame);
        EXPECT_EQ(drawable.set_scalars({std::span(heights).first(5)}).error().code, ErrorCode::mismatch);
        EXPECT_LT(picture_distance(draw(scene, camera), with), 2 * kSame);
        ASSERT_TRUE(drawable.set_scalars({}).ok());
        EXPECT_LT(picture_distance(draw(scene, camera), without), 2 * kSame);
        ASSERT_TRUE(drawable.set_scalars(colors).ok());
        EXPECT_LT(picture_distance(draw(scene, camera), with), 2 * kSame);
    }
    Drawable coarse = drawable_of(Drawable::model(model, {.level = 0}, {}, kOneThread));
    const std::vector<float> driver(model.driver().vertices.size(), 0.5f);
    EXPECT_TRUE(coarse.set_scalars({driver}).ok());
    EXPECT_EQ(coarse.set_scalars(colors).error().code, ErrorCode::mismatch);
}

TEST_F(InWindow, PointsAreMoved) {
    const Mesh mesh = sphere(6);
    Mesh moved = mesh;
    for (Vec3f& p : moved.positions) p = Vec3f(2 * p.x(), p.y() + 0.3f, p.z());
    Drawable balls = points(mesh, {.radius = 0.06f});
    const Drawable expected = points(moved, {.radius = 0.06f});
    ASSERT_TRUE(balls.set_positions(moved.positions).ok());
    EXPECT_LT((balls.box().max - expected.box().max).norm(), 1e-12);
    EXPECT_TRUE(draw(scene_of(balls), camera_on(moved)).rgba == draw(scene_of(expected), camera_on(moved)).rgba);
    EXPECT_EQ(balls.set_positions(std::span(moved.positions).first(3)).error().code, ErrorCode::mismatch);
    const std::vector<float> values(mesh.vertex_count(), 1.0f);
    EXPECT_TRUE(balls.set_scalars({values, ColorMap::sequential, {0, 1}}).ok());
    EXPECT_GT(picture_distance(draw(scene_of(balls), camera_on(moved)), draw(scene_of(expected), camera_on(moved))), 2);
    Drawable still = surface(mesh);
    EXPECT_EQ(still.set_positions(mesh.positions).error().code, ErrorCode::usage);
}
