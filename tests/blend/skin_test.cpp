// The blend code as a skin: what another program computes from joints is what we restore.
#include "filigree/restore.h"

#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/strip.h"
#include "threads.h"

#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <set>

namespace filigree {
namespace {

const Model& wavy_model() {
    static const Model model = strip(make_wavy_cube({.resolution = 24}), {.base = 150}, kAllThreads).value().model;
    return model;
}

/// A violent pose: bent, twisted, stretched, mirrored at will.
Pose make_pose(const Model& model, double bend, double stretch) {
    const Box box = bounds(model.mesh.positions);
    std::vector<std::unique_ptr<SpaceWarp>> warps;
    warps.push_back(make_stretch(box, Axis::x, stretch).value());
    warps.push_back(make_bend(box, Axis::z, bend));
    warps.push_back(make_twist(box, Axis::y, 120));
    return warp_pose(*make_chain(std::move(warps)), driver_positions(model), Vec3d::Zero(), kAllThreads);
}

/// Linear-blend skinning as the glTF specification has it, in double.
std::vector<Vec3d> play(const Skin& skin, const Pose& pose) {
    std::vector<JointTransform> joints;
    for (std::size_t j = 0; j < skin.joints.size(); ++j)
        joints.push_back(joint_transform(skin, j, pose.positions, pose.gradients));
    std::vector<Vec3d> positions;
    for (std::size_t v = 0; v < skin.positions.size(); ++v) {
        Vec3d sum = Vec3d::Zero();
        for (std::size_t k = 0; k < skin.slots; ++k) {
            const Index j = skin.vertex_joints[v * skin.slots + k];
            const double weight = skin.vertex_weights[v * skin.slots + k];
            sum +=
                weight * (joints[j].matrix * (skin.positions[v].cast<double>() - skin.rest[j]) + joints[j].translation);
        }
        positions.push_back(sum);
    }
    return positions;
}

double largest_distance(std::span<const Vec3d> a, std::span<const Vec3f> b) {
    double largest = 0;
    for (std::size_t v = 0; v < b.size(); ++v) largest = std::max(largest, (a[v] - b[v].cast<double>()).norm());
    return largest;
}

Pose rest_with_gradients(const Model& model) {
    Pose pose = rest_pose(model);
    pose.gradients.assign(pose.positions.size(), Mat3f::Identity());
    return pose;
}

struct Case {
    unsigned influences;
    bool exact;
    double tolerance; ///< of the diagonal, against the restore
};

class SkinCase : public testing::TestWithParam<Case> {};

TEST_P(SkinCase, PlaysWhatWeRestore) {
    const auto& [influences, exact, tolerance] = GetParam();
    const Model& model = wavy_model();
    const double diagonal = bounds(model.mesh.positions).diagonal();
    const Skin skin = make_skin(model, model.finest_level(), influences, exact).value();
    const Restorer restorer = Restorer::create(model, {}, kAllThreads).value();
    for (const Pose& pose : {rest_with_gradients(model), make_pose(model, 90, 1.7), make_pose(model, -150, 0.4)}) {
        const std::vector<Vec3f> restored = restorer.positions(pose, kAllThreads).value();
        EXPECT_LT(largest_distance(play(skin, pose), restored), tolerance * diagonal);
    }
}

TEST_P(SkinCase, IsTheMeshAtRest) {
    const Model& model = wavy_model();
    const Skin skin = make_skin(model, model.finest_level(), GetParam().influences, GetParam().exact).value();
    EXPECT_LT(largest_distance(play(skin, rest_with_gradients(model)), model.mesh.positions), 3e-7);
    if (GetParam().influences == 6) {
        EXPECT_TRUE(skin.positions == model.mesh.positions);
    }
}

TEST_P(SkinCase, HasWeightsThatGltfTakes) {
    const auto& [influences, exact, tolerance] = GetParam();
    const Skin skin = make_skin(wavy_model(), wavy_model().finest_level(), influences, exact).value();
    for (std::size_t v = 0; v < skin.positions.size(); ++v) {
        double sum = 0;
        long steps = 0;
        std::set<Index> used;
        for (std::size_t k = 0; k < skin.slots; ++k) {
            const float weight = skin.vertex_weights[v * skin.slots + k];
            const Index joint = skin.vertex_joints[v * skin.slots + k];
            ASSERT_GE(weight, 0);
            ASSERT_LT(joint, skin.joints.size());
            if (k > 0) {
                ASSERT_LE(weight, skin.vertex_weights[v * skin.slots + k - 1]);
            }
            if (weight == 0) {
                ASSERT_EQ(joint, 0u);
            } else {
                ASSERT_TRUE(used.insert(joint).second) << "twice in one vertex";
            }
            sum += weight;
            steps += std::lround(65535 * weight);
        }
        ASSERT_NEAR(sum, 1, 2e-7 * double(skin.slots));
        if (!exact) {
            ASSERT_EQ(steps, 65535);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Encodings, SkinCase,
                         testing::Values(Case{3, true, 3e-7}, Case{3, false, 2e-6}, Case{6, true, 3e-7},
                                         Case{6, false, 3e-5}),
                         [](const auto& which) {
                             return std::to_string(which.param.influences) + (which.param.exact ? "Exact" : "Rounded");
                         });

TEST(Skin, OfACoarserLevelHasItsVertices) {
    const Model& model = wavy_model();
    const Skin finest = make_skin(model, model.finest_level(), 3, true).value();
    for (unsigned level = 0; level < model.finest_level(); ++level) {
        const Skin skin = make_skin(model, level, 3, true).value();
        const std::vector<Index>& ids = model.levels[level].vertices;
        ASSERT_EQ(skin.positions.size(), ids.size());
        for (std::size_t k = 0; k < ids.size(); ++k) ASSERT_EQ(skin.positions[k], finest.positions[ids[k]]);
    }
}

Mat3d matrix_of(const NestedRotations& parts) {
    return parts.outer_rotation.toRotationMatrix() * parts.outer_scale.asDiagonal() *
           parts.inner_rotation.toRotationMatrix() * kInnerScale.asDiagonal();
}

Mat3d rotation(double degrees, const Vec3d& axis) {
    return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis.normalized()).toRotationMatrix();
}

double turn_degrees(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
    return 2 * std::acos(std::min(1.0, std::abs(a.dot(b)))) * 180 / std::numbers::pi;
}

/// A joint that turns by `degrees` and stretches by up to `stretch` while its own axes turn the other way.
std::vector<Mat3d> make_motion(std::size_t keys, double degrees, double stretch) {
    std::vector<Mat3d> matrices;
    for (std::size_t k = 0; k < keys; ++k) {
        const double t = double(k) / double(keys - 1);
        const Mat3d axes = rotation(-70 * t, {1, 2, 0.5});
        const Vec3d scale(1 + (stretch - 1) * std::sin(3 * t), 1 + 0.3 * t, 1 - 0.4 * t * t);
        matrices.push_back(rotation(degrees * t, {0.3, 1, -0.2}) * axes * scale.asDiagonal() * axes.transpose());
    }
    return matrices;
}

TEST(AlignRotations, GivesTheMatricesBack) {
    std::vector<Mat3d> matrices = make_motion(40, 300, 1.8);
    matrices.push_back(Mat3d::Identity());
    matrices.push_back(Vec3d(1, 1, 0).asDiagonal());  // flat
    matrices.push_back(Vec3d(1, 1, -1).asDiagonal()); // mirrored
    matrices.push_back(Mat3d::Zero());
    const std::vector<NestedRotations> parts = align_rotations(matrices);
    ASSERT_EQ(parts.size(), matrices.size());
    for (std::size_t k = 0; k < parts.size(); ++k)
        EXPECT_LT((matrix_of(parts[k]) - matrices[k]).norm(), 1e-14) << "key " << k;
}

TEST(AlignRotations, TurnsLittleFromKeyToKey) {
    const std::vector<NestedRotations> parts = align_rotations(make_motion(60, 300, 1.8));
    for (std::size_t k = 1; k < parts.size(); ++k) {
        EXPECT_LT(turn_degrees(parts[k].outer_rotation, parts[k - 1].outer_rotation), 20) << "key " << k;
        EXPECT_LT(turn_degrees(parts[k].inner_rotation, parts[k - 1].inner_rotation), 20) << "key " << k;
        EXPECT_GE(parts[k].outer_rotation.dot(parts[k - 1].outer_rotation), 0) << "key " << k;
        EXPECT_GE(parts[k].inner_rotation.dot(parts[k - 1].inner_rotation), 0) << "key " << k;
    }
}

/// Half way between keys the parts, interpolated as viewers do, are hardly worse than interpolated matrices.
TEST(AlignRotations, InterpolatesAsMatricesDo) {
    const std::size_t keys = 31;
    const std::vector<Mat3d> fine = make_motion(2 * keys - 1, 90, 1.5);
    std::vector<Mat3d> coarse;
    for (std::size_t k = 0; k < keys; ++k) coarse.push_back(fine[2 * k]);
    const std::vector<NestedRotations> parts = align_rotations(coarse);
    double worst = 0, worst_matrices = 0;
    for (std::size_t k = 0; k + 1 < keys; ++k) {
        const NestedRotations half = {parts[k].outer_rotation.slerp(0.5, parts[k + 1].outer_rotation),
                                      parts[k].inner_rotation.slerp(0.5, parts[k + 1].inner_rotation),
                                      0.5 * (parts[k].outer_scale + parts[k + 1].outer_scale)};
        worst = std::max(worst, (matrix_of(half) - fine[2 * k + 1]).norm());
        worst_matrices = std::max(worst_matrices, (0.5 * (coarse[k] + coarse[k + 1]) - fine[2 * k + 1]).norm());
    }
    EXPECT_LT(worst, 3 * worst_matrices);
    EXPECT_LT(worst, 1e-2);
}

TEST(AlignRotations, OfARigidMotionTurnsOneNodeAlone) {
    std::vector<Mat3d> matrices;
    for (int k = 0; k < 40; ++k) matrices.push_back(0.5 * rotation(17.0 * k, {1, 0.2, 0.4}));
    const std::vector<NestedRotations> parts = align_rotations(matrices);
    for (const NestedRotations& part : parts) {
        EXPECT_LT(turn_degrees(part.inner_rotation, Eigen::Quaterniond::Identity()), 1e-5);
        EXPECT_LT((part.outer_scale - resting_rotations(0.5).outer_scale).norm(), 1e-12);
    }
}

TEST(Skin, LevelsAndInfluencesThatAreNotThereAreRefused) {
    const Model model = strip(make_wavy_sphere({.resolution = 8}), {.base = 60}, kOneThread).value().model;
    EXPECT_TRUE(make_skin(model, model.finest_level(), 3, false).ok());
    for (const auto& [level, influences] : {std::pair(model.finest_level() + 1, 3u), {~0u, 3u}, {0u, 4u}}) {
        const auto skin = make_skin(model, level, influences, false);
        ASSERT_FALSE(skin.ok()) << level;
        EXPECT_EQ(skin.error().code, ErrorCode::usage);
    }
}

} // namespace
} // namespace filigree
