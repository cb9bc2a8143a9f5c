#include "filigree/blend/pose_mesh.h"

#include <algorithm>
#include <array>

namespace filigree {
namespace {

constexpr int kEntries = 9; // of a gradient, row by row

std::string gradient_name(int k) { return {'f', static_cast<char>('0' + k / 3), static_cast<char>('0' + k % 3)}; }

const std::vector<float>* find_scalar(const Mesh& mesh, const std::string& name) {
    const auto scalar = std::ranges::find(mesh.scalars, name, &VertexScalar::name);
    return scalar == mesh.scalars.end() ? nullptr : &scalar->values;
}

} // namespace

bool is_gradient_name(std::string_view scalar) {
    const auto is_index = [](char c) { return c >= '0' && c <= '2'; };
    return scalar.size() == 3 && scalar[0] == 'f' && is_index(scalar[1]) && is_index(scalar[2]);
}

void add_gradients(Mesh& mesh, const Pose& pose) {
    for (int k = 0; k < kEntries && !pose.gradients.empty(); ++k) {
        VertexScalar& scalar = mesh.scalars.emplace_back(VertexScalar{gradient_name(k), {}});
        for (const Mat3f& gradient : pose.gradients) scalar.values.push_back(gradient(k / 3, k % 3));
    }
}

Pose pose_of_mesh(const Mesh& moved, const Vec3d& origin) {
    Pose pose;
    pose.positions.resize(moved.vertex_count());
    for (std::size_t v = 0; v < pose.positions.size(); ++v)
        pose.positions[v] = (moved.world_position(v) - origin).cast<float>();
    std::array<const std::vector<float>*, kEntries> entries;
    for (int k = 0; k < kEntries; ++k)
        if (!(entries[std::size_t(k)] = find_scalar(moved, gradient_name(k)))) return pose;
    pose.gradients.resize(pose.positions.size());
    for (std::size_t v = 0; v < pose.gradients.size(); ++v)
        for (int k = 0; k < kEntries; ++k) pose.gradients[v](k / 3, k % 3) = (*entries[std::size_t(k)])[v];
    return pose;
}

Mesh driver_mesh(const Model& model) { return driver_mesh(level_mesh(model, 0)); }

Mesh driver_mesh(Mesh driver) {
    std::erase_if(driver.scalars, [](const VertexScalar& scalar) { return is_gradient_name(scalar.name); });
    return driver;
}

Mesh posed_driver(const Model& model, const Pose& pose) {
    Mesh driver = driver_mesh(model);
    driver.positions = pose.positions;
    driver.normals = {};
    add_gradients(driver, pose);
    return driver;
}

} // namespace filigree
