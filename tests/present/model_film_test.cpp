#include "filigree/present/model_film.h"

#include "filigree/mesh.h"
#include "filigree/render.h"
#include "filigree/strip.h"

#include <filesystem>
#include <gtest/gtest.h>
#include <unistd.h>

namespace filigree {
namespace {

namespace fs = std::filesystem;

TEST(ModelFilm, DrawsAPictureAPose) {
    if (!HeadlessContext::create().ok()) GTEST_SKIP() << "no OpenGL";
    const fs::path folder = fs::temp_directory_path() / ("filigree_model_film_" + std::to_string(::getpid()));
    fs::create_directories(folder);
    ModelFilm film;
    const Mesh cube = make_wavy_cube({.resolution = 8});
    film.model = std::make_shared<const Model>(strip(cube, {.base = 60}, RunContext()).value().model);
    film.width = 64;
    film.height = 48;
    film.passes = 1;
    const CameraPoints points{cube.positions, cube.origin};
    film.camera = fit_camera(std::span(&points, 1), view_direction(View::iso, film.up), up_vector(film.up), 4.0 / 3);
    film.poses = {30, {3, Pose{driver_positions(*film.model), {}}}};
    EXPECT_EQ(film_model(film, folder / "at_%02d.png", RunContext()).value(), 3u);
    EXPECT_TRUE(fs::exists(folder / "at_03.png"));
    EXPECT_FALSE(fs::exists(folder / "at_04.png"));
    const RunContext cancelled;
    cancelled.cancel();
    EXPECT_EQ(film_model(film, folder / "none_%02d.png", cancelled).error().code, ErrorCode::cancelled);
    EXPECT_FALSE(fs::exists(folder / "none_01.png"));
    fs::remove_all(folder);
}

} // namespace
} // namespace filigree
