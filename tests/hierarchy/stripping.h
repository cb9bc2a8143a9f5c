// What the tests of strip and restore share.
#pragma once

#include "filigree/restore.h"
#include "filigree/strip.h"
#include "threads.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <numeric>

namespace filigree_test {

using namespace filigree;

inline Stripped stripped(Mesh mesh, const StripOptions& options = {}, const RunContext& context = kOneThread) {
    Result<Stripped> result = strip(std::move(mesh), options, context);
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
    if (!result.ok()) return {};
    EXPECT_EQ(check_model(result->model), "");
    return std::move(*result);
}

inline Restorer restorer_of(const Model& model, const RestoreOptions& options = {}) {
    Result<Restorer> restorer = Restorer::create(model, options, kOneThread);
    EXPECT_TRUE(restorer.ok());
    return std::move(*restorer);
}

inline std::vector<Vec3f> restored(const Model& model, const Pose& pose, const RestoreOptions& options = {},
                                   const RunContext& context = kOneThread) {
    Result<std::vector<Vec3f>> positions = restorer_of(model, options).positions(pose, context);
    EXPECT_TRUE(positions.ok()) << (positions.ok() ? "" : positions.error().message);
    return positions.ok() ? std::move(*positions) : std::vector<Vec3f>{};
}

inline std::vector<Index> all_vertices(const Model& model) {
    std::vector<Index> all(model.mesh.vertex_count());
    std::iota(all.begin(), all.end(), Index{0});
    return all;
}
inline Pose without_gradients(Pose pose) {
    pose.gradients.clear();
    return pose;
}

/// A deformation: where a point goes, and its gradient there.
struct Deformation {
    std::function<Vec3d(const Vec3d&)> position;
    std::function<Mat3d(const Vec3d&)> gradient;
};

inline Deformation affine(const Mat3d& a, const Vec3d& shift) {
    return {[=](const Vec3d& p) { return Vec3d(a * p + shift); }, [=](const Vec3d&) { return a; }};
}

inline std::vector<Vec3f> deformed(const Deformation& f, std::span<const Vec3f> positions) {
    std::vector<Vec3f> out;
    for (const Vec3f& p : positions) out.push_back(f.position(p.cast<double>()).cast<float>());
    return out;
}

inline Pose pose_by(const Deformation& f, const Model& model) {
    Pose pose;
    for (const Vec3f& p : driver_positions(model)) {
        pose.positions.push_back(f.position(p.cast<double>()).cast<float>());
        pose.gradients.push_back(f.gradient(p.cast<double>()).cast<float>());
    }
    return pose;
}

/// Every face with vertices of its own.
inline Mesh soup(const Mesh& mesh) {
    Mesh out;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        std::vector<Index> face;
        for (Index v : mesh.face(f)) {
            face.push_back(static_cast<Index>(out.positions.size()));
            out.positions.push_back(mesh.positions[v]);
        }
        out.add_face(face);
    }
    return out;
}

/// Largest distance and root mean square, as fractions of b's diagonal (model units when that is zero); NaN stays NaN.
struct Distance {
    double max = 0, rms = 0;
};
inline Distance distance(std::span<const Vec3f> a, std::span<const Vec3f> b) {
    EXPECT_EQ(a.size(), b.size());
    if (a.size() != b.size() || a.empty()) return {};
    const double diagonal = bounds(b).diagonal(), unit = diagonal > 0 ? diagonal : 1;
    Distance d;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double x = ((a[i].cast<double>() - b[i].cast<double>()) / unit).norm();
        if (!(x <= d.max)) d.max = x;
        d.rms += x * x;
    }
    d.rms = std::sqrt(d.rms / double(a.size()));
    return d;
}

inline bool same_bytes(std::span<const Vec3f> a, std::span<const Vec3f> b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

} // namespace filigree_test
