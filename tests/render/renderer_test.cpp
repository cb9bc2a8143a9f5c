// Pictures of scenes. Golden ones lie in golden/; FILIGREE_WRITE_GOLDEN=1 writes them anew (look at them then).
#include "render/rendered.h"

#include "filigree/mesh/normals.h"

using namespace filigree_test;

namespace {

/// A square in the plane z = 0, seen whole from the front, with UVs.
Mesh square() { return make_wavy_plane({.resolution = 1, .amplitude = 0}); }

/// Four by four fields; the one at the top left is red.
Picture checker() {
    Picture picture(64, 64);
    for (unsigned y = 0; y < 64; ++y)
        for (unsigned x = 0; x < 64; ++x) {
            const bool bright = (x / 16 + y / 16) % 2;
            const std::array<std::uint8_t, 4> color = x < 16 && y < 16 ? std::array<std::uint8_t, 4>{200, 20, 20, 255}
                                                      : bright         ? std::array<std::uint8_t, 4>{230, 230, 220, 255}
                                                                       : std::array<std::uint8_t, 4>{40, 70, 120, 255};
            std::copy(color.begin(), color.end(), picture.pixel(x, y));
        }
    return picture;
}

bool is_redder(const std::uint8_t* pixel) { return pixel[0] > pixel[1] + 40 && pixel[0] > pixel[2] + 40; }

unsigned darkest(const Picture& picture) {
    unsigned least = 255;
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4)
        least = std::min<unsigned>(least, std::max({picture.rgba[i], picture.rgba[i + 1], picture.rgba[i + 2]}));
    return least;
}

} // namespace

TEST_F(Rendered, GoldenCube) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh);
    EXPECT_EQ(cube.triangle_count(), 2 * mesh.face_count());
    expect_golden(draw(scene_of(cube), camera_on(mesh)), "cube");
}

TEST_F(Rendered, GoldenEdges) {
    const Mesh mesh = sphere(8);
    const Drawable ball = surface(mesh);
    expect_golden(draw(scene_of(ball, {.edges = true}), camera_on(mesh)), "edges");
    expect_golden(draw(scene_of(ball, {.surface = false, .edges = true}), camera_on(mesh)), "wireframe");
}

TEST_F(Rendered, GoldenPoints) {
    const Mesh mesh = sphere(6);
    const Drawable balls = points(mesh, {.radius = 0.06f});
    EXPECT_EQ(balls.point_count(), mesh.vertex_count());
    EXPECT_EQ(balls.triangle_count(), 0u);
    expect_golden(draw(scene_of(balls, {.color = {0.3f, 0.5f, 0.8f}}), camera_on(mesh)), "points");
}

TEST_F(Rendered, PointsAreAsLargeAsTheirSpacingAsks) {
    std::vector<Vec3f> lattice;
    for (int x = 0; x < 12; ++x)
        for (int y = 0; y < 12; ++y)
            for (int z = 0; z < 12; ++z) lattice.emplace_back(float(2 * x), float(2 * y), float(2 * z));
    const auto radius = [](std::span<const Vec3f> positions) {
        return -drawable_of(Drawable::points(positions, Vec3d::Zero(), {}, kOneThread)).box().min.x();
    };
    EXPECT_GT(radius(lattice), 0.3 * 2);
    EXPECT_LT(radius(lattice), 0.51 * 2); // balls hardly touch
    std::vector<Vec3f> twice(lattice);
    twice.insert(twice.end(), lattice.begin(), lattice.end());
    EXPECT_NEAR(radius(twice), radius(lattice), 1e-6);
    const std::vector<Vec3f> one = {{0, 0, 0}}, same(5, one[0]), two = {{0, 0, 0}, {1, 0, 0}};
    for (const std::vector<Vec3f>& few : {one, same, two}) {
        EXPECT_GT(radius(few), 0);
        EXPECT_LE(radius(few), 1);
    }
}

TEST_F(Rendered, GoldenClip) {
    const Mesh mesh = make_torus({.resolution = 24, .amplitude = 0});
    const Drawable torus = surface(mesh);
    const Appearance look{.clip = ClipPlane{Vec3d(0, 0, 2), 0}}; // of any length
    expect_golden(draw(scene_of(torus, look), camera_on(mesh)), "clip");
}

TEST_F(Rendered, GoldenHeatMap) {
    const Mesh mesh = make_wavy_plane({.resolution = 24, .frequency = 1.5, .amplitude = 0.1});
    std::vector<float> heights;
    for (const Vec3f& p : mesh.positions) heights.push_back(p.z());
    heights[24 * 25 + 12] = NAN; // no value there
    for (const ColorMap map : {ColorMap::sequential, ColorMap::diverging}) {
        const Drawable plane = surface(mesh, {.scalars = {heights, map, {-0.1f, 0.1f}}});
        Scene scene = scene_of(plane, {.gloss = 0.15f});
        scene.up = UpAxis::z;
        const CameraPoints seen{mesh.positions, mesh.origin};
        const Camera camera =
            fit_camera(std::span(&seen, 1), view_direction(View::iso, UpAxis::z), Vec3d::UnitZ(), 4.0 / 3);
        expect_golden(draw(scene, camera), map == ColorMap::sequential ? "heat" : "heat_diverging");
    }
}

TEST_F(Rendered, GoldenTexture) {
    Mesh mesh = square();
    mesh.materials = {{"checker"}, {0}};
    const Picture picture = checker();
    SurfaceOptions options;
    options.materials = {{Vec3f::Ones(), &picture}};
    const Drawable drawn = surface(mesh, options);
    const Picture front = draw(scene_of(drawn), camera_on(mesh, View::front));
    expect_golden(front, "texture");
    EXPECT_TRUE(is_redder(front.pixel(55, 30))); // v counts from the bottom, rows of the picture from the top
    EXPECT_FALSE(is_redder(front.pixel(55, 120)));
    EXPECT_FALSE(is_redder(front.pixel(145, 30)));
}

TEST_F(Rendered, GoldenTransparent) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh);
    Scene scene = scene_of(cube);
    scene.background.transparent = true;
    const Picture picture = draw(scene, camera_on(mesh));
    expect_golden(picture, "transparent");
    for (const unsigned x : {0u, 199u}) EXPECT_EQ(picture.pixel(x, 0)[3], 0);
    EXPECT_EQ(picture.pixel(100, 75)[3], 255);
    std::size_t shadow = 0; // dark, and neither there nor not
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4)
        shadow += picture.rgba[i + 3] > 20 && picture.rgba[i + 3] < 200 && picture.rgba[i] < 30;
    EXPECT_GT(shadow, 300u);
    scene.ground = false;
    const Picture alone = draw(scene, camera_on(mesh));
    for (std::size_t i = 0; i < alone.rgba.size(); i += 4) EXPECT_TRUE(alone.rgba[i + 3] == 0 || alone.rgba[i] > 30);
}

/// What each golden picture stands for would be missed.
TEST_F(Rendered, TheToleranceIsTightForLightAndShadow) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh);
    const Camera camera = camera_on(mesh);
    const Picture whole = draw(scene_of(cube), camera);
    Scene scene = scene_of(cube);
    scene.ground = false;
    EXPECT_GT(picture_distance(draw(scene, camera), whole), 2 * kTolerance);

    // A plate in the key light's way, out of the picture. What it does to the sky's light is little: a further plate,
    // as large, on the other side does not come near.
    const Vec3d right = camera.basis().col(0), up = Vec3d::UnitY(), front = right.cross(up);
    const Vec3d key = (-0.72 * right + 0.72 * up + 0.42 * front).normalized();
    const Vec3d other = (0.72 * right + 0.72 * up - 0.42 * front).normalized();
    const auto with_plate = [&](const Vec3d& direction) {
        Mesh plate = square();
        const Eigen::AngleAxisd turn(std::acos(direction.z()), Vec3d::UnitZ().cross(direction).normalized());
        for (Vec3f& p : plate.positions) p = (turn * (1.7 * p.cast<double>()) + 4 * direction).cast<float>();
        const Drawable drawn = surface(plate);
        Scene shaded = scene_of(cube);
        shaded.fixed_ground = true;
        shaded.ground_level = world_bounds(mesh).min.y() - 1e-4;
        shaded.objects.push_back({&drawn, {}});
        return draw(shaded, camera);
    };
    const double without_key = picture_distance(with_plate(key), whole);
    EXPECT_GT(without_key, 3 * kTolerance);
    EXPECT_GT(without_key, 3 * picture_distance(with_plate(other), whole));
}

TEST_F(Rendered, TheToleranceIsTightForNormalsAndEdges) {
    Mesh mesh = wavy_cube();
    mesh.normals.values = vertex_normals(mesh, mesh.positions, kOneThread);
    mesh.normals.corners = mesh.corners;
    const Drawable sound = surface(mesh);
    const Camera camera = camera_on(mesh);
    const Picture whole = draw(scene_of(sound), camera);
    const auto with_normals = [&](const std::function<Vec3f(const Vec3f&)>& change) {
        Mesh changed = mesh;
        for (Vec3f& n : changed.normals.values) n = change(n);
        const Drawable drawn = surface(changed);
        return picture_distance(draw(scene_of(drawn), camera), whole);
    };
    EXPECT_GT(with_normals([](const Vec3f& n) { return Vec3f(-n.x(), n.y(), n.z()); }), 2 * kTolerance);
    EXPECT_GT(with_normals([](const Vec3f& n) { return Vec3f(n.x(), -n.y(), n.z()); }), 2 * kTolerance);
    EXPECT_GT(with_normals([](const Vec3f& n) { return Vec3f(n.x(), n.z(), n.y()); }), 2 * kTolerance);

    const Mesh coarse = sphere(5);
    const Drawable ball = surface(coarse), facets = surface(coarse, {.shading = Shading::flat});
    const Camera close = camera_on(coarse);
    const Picture smooth = draw(scene_of(ball), close);
    EXPECT_GT(picture_distance(draw(scene_of(ball, {.edges = true}), close), smooth), 2 * kTolerance);
    EXPECT_GT(picture_distance(draw(scene_of(facets), close), smooth), kTolerance);

    // Diagonals would be seen: the same surface of triangles.
    Mesh triangles;
    triangles.positions = coarse.positions;
    for (std::size_t f = 0; f < coarse.face_count(); ++f)
        for (const int k : {1, 2})
            triangles.add_face(std::array{coarse.face(f)[0], coarse.face(f)[k], coarse.face(f)[k + 1]});
    const Drawable cut = surface(triangles);
    EXPECT_GT(
        picture_distance(draw(scene_of(cut, {.edges = true}), close), draw(scene_of(ball, {.edges = true}), close)),
        kTolerance);
}

TEST_F(Rendered, SameBytesFromRunToRunWhateverTheThreadsAndWhatWasDrawnBefore) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh, {});
    const Scene scene = scene_of(cube, {.edges = true});
    const Camera camera = camera_on(mesh);
    const Picture first = draw(scene, camera);
    EXPECT_EQ(draw(scene, camera).rgba, first.rgba);
    draw(scene, camera, {.width = 77, .height = 33, .passes = 2}); // another size, and multisampled
    EXPECT_EQ(draw(scene, camera).rgba, first.rgba);
    const RunContext many(8);
    const Drawable again = drawable_of(Drawable::surface(mesh, {}, many));
    const Result<Picture> picture = renderer_->picture(scene_of(again, {.edges = true}), camera, kSmall, many);
    ASSERT_TRUE(picture.ok());
    EXPECT_EQ(picture->rgba, first.rgba);
}

/// A pixel is lit when all is drawn, or as it is drawn where there are lines: lines without width make no difference.
TEST_F(Rendered, LightIsTheSameAtOnceAndLater) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh);
    const Camera camera = camera_on(mesh);
    for (const Vec3f& color : {Vec3f(0.8f, 0.3f, 0.1f), Vec3f(0.05f, 0.05f, 0.9f)}) {
        Appearance later{.color = color, .gloss = 0.6f}, at_once = later;
        at_once.edges = true;
        at_once.edge_width = -1;
        const double off = picture_distance(draw(scene_of(cube, later), camera), draw(scene_of(cube, at_once), camera));
        EXPECT_LT(off, 0.6);
    }
}

/// From inside a solid, its back faces are all there is to see.
TEST_F(Rendered, ASolidIsSeenFromInsideToo) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh);
    Camera camera = camera_on(mesh);
    camera.eye = world_bounds(mesh).centre();
    camera.target = camera.eye + Vec3d(1, 0.2, 0.1);
    Scene scene = scene_of(cube);
    scene.background.transparent = true;
    const Picture inside = draw(scene, camera);
    for (std::size_t i = 3; i < inside.rgba.size(); i += 4) ASSERT_EQ(inside.rgba[i], 255);
}

TEST_F(Rendered, AModelIsRestoredInTheShaderAsOnTheProcessor) {
    Mesh mesh = wavy_cube();
    mesh.normals.values = vertex_normals(mesh, mesh.positions, kOneThread); // which both carry along with the gradients
    const Model model = stripped(mesh, {.base = 150}).model;
    const Pose pose = pose_by(bend(80), model);
    for (const std::optional<unsigned> level : {std::optional<unsigned>(), std::optional<unsigned>(0)}) {
        const RestoreOptions restore{.level = level};
        Drawable posed =
            drawable_of(Drawable::upload(*DrawData::model(model, restore, {}, RestoreOn::gpu, kOneThread)));
        EXPECT_TRUE(posed.set_pose(pose, kOneThread).ok());
        const Mesh rest = level_mesh(model, level.value_or(model.finest_level()));
        Result<Mesh> moved = restorer_of(model, restore).mesh(pose, kOneThread);
        ASSERT_TRUE(moved.ok());
        const Mesh& there = *moved;
        ASSERT_EQ(there.normals.values.size(), there.vertex_count());
        const Drawable here = surface(there);
        Scene a = scene_of(posed), b = scene_of(here);
        a.fixed_ground = b.fixed_ground = true;
        a.ground_level = b.ground_level = world_bounds(there).min.y() - 1e-4;
        const Camera camera = camera_on(there);
        EXPECT_LT(picture_distance(draw(a, camera), draw(b, camera)), 2 * kSame);
        a.objects[0].appearance.edges = b.objects[0].appearance.edges = true;
        EXPECT_LT(picture_distance(draw(a, camera), draw(b, camera)), 2 * kSame);

        // At rest there is only rounding between them.
        EXPECT_TRUE(posed.set_pose(rest_pose(model), kOneThread).ok());
        const Drawable resting = surface(rest);
        const Scene c = scene_of(resting);
        const Camera before = camera_on(rest);
        a = scene_of(posed);
        a.fixed_ground = true; // the box of a posed model is a little larger
        a.ground_level = c.box().min.y() - 1e-4 * c.box().diagonal();
        EXPECT_LT(picture_distance(draw(a, before), draw(c, before)), 2 * kSame);
    }
}

TEST_F(Rendered, ThePlaceOfASceneDoesNotMatter) {
    const Mesh near_mesh = sphere(6);
    Mesh far_mesh = near_mesh;
    far_mesh.origin = Vec3d(500000, -300000, 20);
    Camera camera = camera_on(near_mesh), far_camera = camera;
    far_camera.eye += far_mesh.origin;
    far_camera.target += far_mesh.origin;
    const Drawable near_ball = surface(near_mesh), far_ball = surface(far_mesh);
    const Drawable near_points = points(near_mesh), far_points = points(far_mesh);
    for (const auto& [a, b] : {std::pair(&near_ball, &far_ball), std::pair(&near_points, &far_points)}) {
        const Appearance look{.edges = true};
        EXPECT_LT(picture_distance(draw(scene_of(*a, look), camera), draw(scene_of(*b, look), far_camera)), kSame);
        const Appearance clipped{.clip = ClipPlane{Vec3d::UnitX(), 0.1}},
            far_clipped{.clip = ClipPlane{Vec3d::UnitX(), 500000.1}};
        EXPECT_LT(picture_distance(draw(scene_of(*a, clipped), camera), draw(scene_of(*b, far_clipped), far_camera)),
                  kSame);
    }
}

TEST_F(Rendered, TheSizeOfASceneDoesNotMatter) {
    const Mesh mesh = make_wavy_cube({.resolution = 8, .frequency = 1});
    const Drawable plain = surface(mesh), balls = points(mesh);
    const Appearance look{.edges = true};
    const Picture expected = draw(scene_of(plain, look), camera_on(mesh)),
                  expected_balls = draw(scene_of(balls), camera_on(mesh));
    for (const double factor : {1e-25, 1e-6, 1e6, 1e25}) {
        const Mesh changed = scaled(mesh, factor);
        const Camera camera = camera_on(changed);
        const Drawable drawn = surface(changed), drawn_balls = points(changed);
        EXPECT_LT(picture_distance(draw(scene_of(drawn, look), camera), expected), kSame) << factor;
        EXPECT_LT(picture_distance(draw(scene_of(drawn_balls), camera), expected_balls), kSame) << factor;
    }
}

TEST_F(Rendered, TheWindingDoesNotMatter) {
    const Mesh mesh = wavy_cube();
    Mesh flipped = mesh;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        std::reverse(flipped.corners.begin() + flipped.face_offsets[f],
                     flipped.corners.begin() + flipped.face_offsets[f + 1]);
    const Drawable a = surface(mesh), b = surface(flipped);
    const Camera camera = camera_on(mesh);
    EXPECT_LT(picture_distance(draw(scene_of(a), camera), draw(scene_of(b), camera)), kSame);
}

TEST_F(Rendered, AMeshWithoutNormalsOfItsOwnIsShadedByItsFaces) {
    Mesh mesh = sphere(8);
    const Drawable facets = surface(mesh, {.shading = Shading::flat});
    mesh.normals.values = {Vec3f::UnitX()};
    mesh.normals.corners.assign(mesh.corner_count(), kNoIndex);
    const Drawable none = surface(mesh);
    mesh.normals.values.assign(mesh.vertex_count(), Vec3f::Zero());
    mesh.normals.corners.clear();
    const Drawable zero = surface(mesh);
    const Camera camera = camera_on(mesh);
    const Picture expected = draw(scene_of(facets), camera);
    EXPECT_LT(picture_distance(draw(scene_of(none), camera), expected), 1.0); // quads are not quite flat
    EXPECT_LT(picture_distance(draw(scene_of(zero), camera), expected), 1.0);
}

TEST_F(Rendered, ColorsAreTheObjectsOwnOrThoseAskedFor) {
    Mesh mesh = sphere();
    const Camera camera = camera_on(mesh);
    const Appearance red{.color = {0.8f, 0.1f, 0.1f}};
    const auto middle = [&](const Drawable& drawable, const Appearance& look) {
        const Picture picture = draw(scene_of(drawable, look), camera, {.width = 200, .height = 150, .passes = 4});
        EXPECT_GT(darkest(picture), 8u);
        const std::uint8_t* pixel = picture.pixel(100, 75);
        return Vec3d(pixel[0], pixel[1], pixel[2]);
    };
    const auto is = [](const Vec3d& color, int channel) {
        return color[channel] > color[(channel + 1) % 3] + 30 && color[channel] > color[(channel + 2) % 3] + 30;
    };
    const Drawable plain = surface(mesh);
    EXPECT_TRUE(is(middle(plain, red), 0));
    const Vec3d grey = middle(plain, {});
    EXPECT_LT(grey.maxCoeff() - grey.minCoeff(), 40);

    mesh.materials = {{"green"}, std::vector<Index>(mesh.face_count(), 0)};
    SurfaceOptions options;
    options.materials = {{Vec3f(0.1f, 0.7f, 0.1f), nullptr}};
    const Drawable green = surface(mesh, options);
    EXPECT_TRUE(is(middle(green, red), 1));
    Appearance forced = red;
    forced.own_colors = false;
    EXPECT_TRUE(is(middle(green, forced), 0));

    mesh.colors.assign(mesh.vertex_count(), Vec4f(0.1f, 0.1f, 0.8f, 1));
    const Drawable blue = surface(mesh), blue_points = points(mesh, {.radius = 0.1f, .colors = mesh.colors});
    EXPECT_TRUE(is(middle(blue, red), 2));
    EXPECT_TRUE(is(middle(blue, forced), 0));
    EXPECT_TRUE(is(middle(blue_points, red), 2));
    EXPECT_TRUE(is(middle(blue_points, forced), 0));
}

/// Edges are found by the triangle's number, which begins anew with each material.
TEST_F(Rendered, EdgesAndMaterialsGoTogether) {
    Mesh mesh = sphere(8);
    const Drawable one = surface(mesh);
    mesh.materials.names = {"a", "b", "c"};
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        mesh.materials.of_face.push_back(f % 5 == 4 ? kNoIndex : Index(f % 5 % 3));
    SurfaceOptions options;
    options.materials.assign(3, {Appearance().color, nullptr});
    const Drawable many = surface(mesh, options);
    const Camera camera = camera_on(mesh);
    EXPECT_LT(
        picture_distance(draw(scene_of(one, {.edges = true}), camera), draw(scene_of(many, {.edges = true}), camera)),
        kSame);
}

TEST_F(Rendered, HolesOfATextureAreHoles) {
    Mesh mesh = square();
    mesh.materials = {{"holes"}, {0}};
    Picture holes(8, 8);
    for (unsigned y = 0; y < 8; ++y)
        for (unsigned x = 0; x < 8; ++x)
            for (int k = 0; k < 4; ++k) holes.pixel(x, y)[k] = k < 3 || x < 4 ? 255 : 0;
    SurfaceOptions options;
    options.materials = {{Vec3f::Ones(), &holes}};
    const Drawable drawn = surface(mesh, options);
    Scene scene = scene_of(drawn);
    scene.background.transparent = true;
    scene.ground = false;
    const Picture picture = draw(scene, camera_on(mesh, View::front));
    EXPECT_EQ(picture.pixel(70, 75)[3], 255);
    EXPECT_EQ(picture.pixel(130, 75)[3], 0);
}

TEST_F(Rendered, FewPassesAreSmoothToo) {
    const Mesh mesh = wavy_cube();
    const Drawable cube = surface(mesh);
    Scene scene = scene_of(cube);
    const Camera camera = camera_on(mesh);
    const Picture best = draw(scene, camera, {.width = 200, .height = 150});
    EXPECT_LT(picture_distance(draw(scene, camera), best), 4);
    scene.background.transparent = true;
    scene.ground = false;
    for (const unsigned passes : {1u, 2u, 3u, 4u}) {
        const Picture picture = draw(scene, camera, {.width = 200, .height = 150, .passes = passes});
        std::size_t between = 0; // pixels that the outline goes through
        for (std::size_t i = 3; i < picture.rgba.size(); i += 4)
            between += picture.rgba[i] > 0 && picture.rgba[i] < 255;
        EXPECT_GT(between, 100u) << passes;
    }
}

TEST_F(Rendered, NoSceneShowsTheBackground) {
    Scene scene;
    scene.background.top = scene.background.bottom = {0.2f, 0.4f, 0.6f};
    const Picture picture = draw(scene, {}, {.width = 16, .height = 9});
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4) {
        EXPECT_NEAR(picture.rgba[i], 51, 1);
        EXPECT_NEAR(picture.rgba[i + 1], 102, 1);
        EXPECT_NEAR(picture.rgba[i + 2], 153, 1);
        EXPECT_EQ(picture.rgba[i + 3], 255);
    }
    scene.background.transparent = true;
    for (std::uint8_t byte : draw(scene, {}, {.width = 16, .height = 9}).rgba) EXPECT_EQ(byte, 0);
    scene.background = {};
    const Picture gradient = draw(scene, {}, {.width = 16, .height = 60});
    EXPECT_GT(gradient.pixel(8, 0)[0], gradient.pixel(8, 59)[0] + 20);
}

TEST_F(Rendered, EveryCameraGivesAPicture) {
    const Mesh mesh = sphere();
    const Drawable ball = surface(mesh), balls = points(mesh);
    std::vector<Camera> cameras;
    for (const View view : {View::front, View::side, View::top, View::iso})
        for (const double angle : {0.0, 30.0, 140.0}) cameras.push_back(camera_on(mesh, view, angle));
    cameras.push_back({.eye = {0, 0, 0}, .target = {0, 0, 1}});                  // inside
    cameras.push_back({.eye = {0, -3, 0}, .target = {0, 0, 0}});                 // from below the ground
    cameras.push_back({.eye = {0, 1e6, 1e6}, .target = {0, 0, 0}});              // far away
    cameras.push_back({.eye = {0, 0, 3}, .target = {0, 0, 10}});                 // looking elsewhere
    cameras.push_back({.eye = {0, 0, 0.500001}, .target = {0, 0, 0}});           // nearly touching
    cameras.push_back({.eye = {0, 5, 0}, .target = {0, 0, 0}, .up = {0, 1, 0}}); // along up
    for (std::size_t i = 0; i < cameras.size(); ++i)
        for (const Drawable* drawable : {&ball, &balls}) {
            const Appearance look{.edges = true, .edge_color = {0.5f, 0.5f, 0.5f}};
            const Picture picture =
                draw(scene_of(*drawable, look), cameras[i], {.width = 60, .height = 45, .passes = 4});
            EXPECT_GT(darkest(picture), 8u) << i;
            if (i >= 12) continue;
            Scene scene = scene_of(*drawable);
            scene.background.transparent = true;
            EXPECT_GT(draw(scene, cameras[i], {.width = 60, .height = 45, .passes = 4}).pixel(30, 22)[3], 100) << i;
        }
}

TEST_F(Rendered, FlatAndTinyThingsHaveAPicture) {
    Mesh triangle, degenerate;
    triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.add_face(std::array<Index, 3>{0, 1, 2});
    degenerate.positions.assign(3, Vec3f(1, 1, 1));
    degenerate.add_face(std::array<Index, 3>{0, 1, 2});
    Mesh point;
    point.positions = {{7, 7, 7}};
    const Drawable drawn = surface(triangle), nothing = surface(degenerate), ball = points(point);
    EXPECT_GT(darkest(draw(scene_of(drawn), camera_on(triangle, View::front))), 8u);
    EXPECT_GT(darkest(draw(scene_of(nothing), camera_on(degenerate))), 8u);
    EXPECT_GT(darkest(draw(scene_of(ball), camera_on(point))), 8u);
}

TEST_F(Rendered, WhatCannotBeDrawnIsRefused) {
    const Mesh mesh = sphere();
    const Drawable ball = surface(mesh);
    const Error large = refusal(scene_of(ball), {.width = 1u << 20, .height = 10});
    EXPECT_EQ(large.code, ErrorCode::unsuitable);
    EXPECT_NE(large.message.find("1048576 by 10"), std::string::npos) << large.message;
    EXPECT_EQ(refusal(scene_of(ball), {.width = 0, .height = 10}).code, ErrorCode::unsuitable);
    EXPECT_EQ(draw(scene_of(ball), camera_on(mesh)).width, 200u); // and the next one is fine
    const RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(refusal(scene_of(ball), kSmall, cancelled).code, ErrorCode::cancelled);

    Mesh no_faces;
    no_faces.positions = mesh.positions;
    const Result<Drawable> none = Drawable::surface(no_faces, {}, kOneThread);
    ASSERT_FALSE(none.ok());
    EXPECT_EQ(none.error().code, ErrorCode::unsuitable);
    EXPECT_EQ(Drawable::points({}, {0, 0, 0}, {}, kOneThread).error().code, ErrorCode::unsuitable);
    SurfaceOptions hidden;
    hidden.hidden_faces.assign(mesh.face_count(), 1);
    EXPECT_EQ(Drawable::surface(mesh, hidden, kOneThread).error().code, ErrorCode::unsuitable);
    const Model model = stripped(mesh).model;
    EXPECT_EQ(Drawable::model(model, {.level = 99}, {}, kOneThread).error().code, ErrorCode::usage);
    Drawable posed = drawable_of(Drawable::model(model, {}, {}, kOneThread));
    EXPECT_EQ(posed.set_pose({}, kOneThread).error().code, ErrorCode::mismatch);
    Drawable still = surface(mesh);
    EXPECT_EQ(still.set_pose({}, kOneThread).error().code, ErrorCode::usage);
}
