// The blend code as linear-blend skinning with ordinary joints, for programs that know nothing of ours.
//
// Driver vertex i rests at c_i and goes to c_i' with gradient A_i; p hangs at m = sum b_i c_i (blend_code.h). Then,
// with every joint bound by a translation alone,
//     three influences:  p' = sum b_i [ (A_i / 2) (x - c_i) + c_i' ],  x = 2 p - m
//     six influences:    p' = sum_ij b_i b_j [ (A_i + A_j) / 2 (p - (c_i + c_j) / 2) + (c_i' + c_j') / 2 ]
// The first moves a rest shape whose detail is twice as high by half matrices; the second moves the rest shape itself
// and has a joint for each edge of the driver as well.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/hierarchy/model.h"

#include <array>
#include <cstdint>

namespace filigree {

/// Which points move with which joints, for one level of a model.
struct Skin {
    /// What a joint follows: a driver vertex (twice the same), or the middle of two.
    using Joint = std::array<Index, 2>;

    unsigned influences = 3;           ///< 3 or 6
    unsigned slots = 4;                ///< a vertex has so many joints and weights: 4 or 8
    std::vector<Joint> joints;         ///< driver vertices (positions in level 0's list) of each joint
    std::vector<Vec3d> rest;           ///< where each joint is at rest
    std::vector<Vec3f> positions;      ///< x of each vertex of the level: what is skinned
    std::vector<Index> vertex_joints;  ///< slots a vertex, largest weight first; 0 where the weight is 0
    std::vector<float> vertex_weights; ///< slots a vertex, none negative, sum 1; multiples of 1 / 65535 unless exact

    /// By what every joint's gradient is multiplied: 1/2 or 1.
    double gradient_scale() const { return influences == 3 ? 0.5 : 1; }
};

/// The skin of level k. Weights are rounded to multiples of 1 / 65535 before positions are computed from them, so that
/// rounding does not move the rest shape; `exact` leaves them as floats. influences: 3 or 6.
/// Errors: usage (no such level, other influences). Cost O(V).
Result<Skin> make_skin(const Model& model, unsigned level, unsigned influences, bool exact);

/// How a joint stands in one moment: world = [matrix | translation].
struct JointTransform {
    Mat3d matrix;
    Vec3d translation;
};
JointTransform joint_transform(const Skin& skin, std::size_t joint, std::span<const Vec3f> positions,
                               std::span<const Mat3f> gradients);

/// A matrix as two nested nodes with a rotation and a scale each, which is what files of joints can hold:
/// matrix = outer_rotation * diag(outer_scale) * inner_rotation * diag(kInnerScale).
struct NestedRotations {
    Eigen::Quaterniond outer_rotation, inner_rotation;
    Vec3d outer_scale; ///< negative in one place where the matrix mirrors
};

/// Constant scale of the inner node. A matrix near a rotation has three equal singular values and so no axes of its
/// own; this tells them apart.
inline const Vec3d kInnerScale = {0.8, 1, 1.25};

/// The matrices of one joint, moment after moment, taken apart so that both rotations turn as little as possible from
/// each moment to the next: interpolating the parts is then as good as interpolating the matrices.
std::vector<NestedRotations> align_rotations(std::span<const Mat3d> matrices);

/// The same for a matrix alone that is a multiple of the identity: no rotation at all.
NestedRotations resting_rotations(double scale);

} // namespace filigree
