// What the runtime's tests share: models of every kind as bytes, and an opened one.
#pragma once

#include "blend/stripping.h"
#include "filigree/file.h"
#include "filigree/mesh/normals.h"
#include "threads.h"

#include "filigree_rt.h"

#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace filigree_test {

struct Close {
    void operator()(flg_model* model) const { flg_close(model); }
};
using Opened = std::unique_ptr<flg_model, Close>;

inline flg_options options_of(std::uint32_t flags = 0, std::uint32_t level = FLG_FINEST, std::uint32_t lanes = 0) {
    return {sizeof(flg_options), flags, level, lanes, nullptr, nullptr, nullptr};
}

inline flg_status open_status(const std::string& bytes, const flg_options& options = options_of()) {
    flg_model* model = nullptr;
    const flg_status status = flg_open(bytes.data(), bytes.size(), &options, &model);
    EXPECT_EQ(model != nullptr, status == FLG_OK);
    flg_close(model);
    return status;
}

inline Opened open_model(const std::string& bytes, const flg_options& options = options_of()) {
    flg_model* model = nullptr;
    const flg_status status = flg_open(bytes.data(), bytes.size(), &options, &model);
    EXPECT_EQ(status, FLG_OK) << flg_status_text(status);
    return Opened(model);
}

inline flg_info info_of(const Opened& model) {
    flg_info info{};
    info.struct_size = sizeof info;
    EXPECT_EQ(flg_get_info(model.get(), &info), FLG_OK);
    return info;
}

inline const float* floats(const std::vector<Vec3f>& points) { return points.empty() ? nullptr : points[0].data(); }
inline float* floats(std::vector<Vec3f>& points) { return points.empty() ? nullptr : points[0].data(); }
inline const float* floats(const std::vector<Mat3f>& matrices) {
    return matrices.empty() ? nullptr : matrices[0].data();
}

/// A prepared pose, in memory that ends where the runtime says it may.
struct SetPose {
    std::vector<std::max_align_t> memory;
    flg_status status;

    SetPose(const Opened& model, const Pose& pose)
        : memory(flg_pose_bytes(model.get()) / sizeof(std::max_align_t) + 1),
          status(flg_set_pose(model.get(), floats(pose.positions), floats(pose.gradients),
                              static_cast<std::uint32_t>(pose.positions.size()), memory.data())) {}
    const void* get() const { return memory.data(); }
};

struct Scratch {
    std::vector<std::max_align_t> memory;
    explicit Scratch(const Opened& model) : memory(flg_scratch_bytes(model.get()) / sizeof(std::max_align_t) + 1) {}
    void* get() { return memory.data(); }
};

struct RuntimeMesh {
    std::vector<Vec3f> positions, normals;
};

inline RuntimeMesh restore_all(const Opened& model, const Pose& pose) {
    const flg_info info = info_of(model);
    RuntimeMesh out;
    out.positions.assign(info.vertices, Vec3f::Constant(NAN));
    out.normals.assign(info.normals, Vec3f::Constant(NAN));
    const SetPose set(model, pose);
    EXPECT_EQ(set.status, FLG_OK);
    Scratch scratch(model);
    EXPECT_EQ(flg_restore(model.get(), set.get(), floats(out.positions), floats(out.normals), scratch.get()), FLG_OK);
    return out;
}

/// A pose far from rest, with gradients that have nothing to do with it.
inline Pose random_pose(const Model& model, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> any(-1, 1);
    Pose pose = rest_pose(model);
    Box box;
    for (const Vec3f& p : pose.positions) box.extend(p.cast<double>());
    const float size = box.diagonal() > 0 ? float(box.diagonal()) : 1.0f;
    for (Vec3f& p : pose.positions) {
        p = 1.2f * p + 0.1f * size * Vec3f(any(random), any(random), any(random));
        Mat3f& a = pose.gradients.emplace_back();
        for (int k = 0; k < 9; ++k) a.data()[k] = any(random) + (k % 4 == 0);
    }
    return pose;
}

inline Mesh with_vertex_normals(Mesh mesh) {
    mesh.normals.values = vertex_normals(mesh, mesh.positions, kOneThread);
    for (Vec3f& n : mesh.normals.values) n *= 1.7f; // not of length one
    return mesh;
}

/// One normal a face, which its corners share; some corners have none, and one value has no corner.
inline Mesh with_corner_normals(Mesh mesh) {
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        mesh.normals.values.push_back(doubled_area_vector(mesh.positions, mesh.face(f)).cast<float>());
        for (std::size_t k = 0; k < mesh.face_size(f); ++k)
            mesh.normals.corners.push_back(f % 17 == 3 && k == 0 ? kNoIndex : static_cast<Index>(f));
    }
    mesh.normals.values.push_back({0, 0, 1});
    return mesh;
}

inline Mesh scaled(Mesh mesh, float factor) {
    for (Vec3f& p : mesh.positions) p *= factor;
    return mesh;
}

struct NamedModel {
    std::string name;
    Model model;
};

/// Every kind of model that a file can hold, small.
inline std::vector<NamedModel> models_of_every_kind() {
    std::vector<NamedModel> all;
    const Mesh cube = make_wavy_cube({.resolution = 16}), sphere = make_wavy_sphere({.resolution = 16});
    Mesh points;
    points.positions = sphere.positions;
    Mesh single;
    single.positions = {{1, 2, 3}};
    const auto add = [&](const char* name, Mesh mesh, std::size_t base, bool reorder = false) {
        all.push_back({name, stripped(std::move(mesh), {.base = base, .reorder = reorder}).model});
    };
    add("cube", cube, 60);
    add("cube, vertex normals", with_vertex_normals(cube), 60);
    add("sphere, corner normals", with_corner_normals(sphere), 60);
    add("sphere, reordered", with_vertex_normals(sphere), 60, true);
    add("tiny", with_vertex_normals(scaled(cube, 1e-20f)), 40);
    add("huge", with_vertex_normals(scaled(cube, 1e20f)), 40);
    add("points", points, 30);
    add("one point", single, 3);
    all.push_back(
        {"driver made elsewhere",
         strip_to_driver(with_corner_normals(cube), make_wavy_cube({.resolution = 3, .amplitude = 0}), kOneThread)
             .value()
             .model});
    return all;
}

} // namespace filigree_test
