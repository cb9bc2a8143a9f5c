#include "filigree/restore.h"

#include "filigree/core/dense_solve.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace filigree {

namespace {

constexpr double kWeightSteps = 65535;

/// A vertex's joints and weights while they are put together.
struct Influence {
    Index joint;
    double weight;
};

/// One entry a joint, none without weight, the largest first (among equals the lower joint).
void merge(std::vector<Influence>& influences) {
    std::stable_sort(influences.begin(), influences.end(), // weights of one joint are added in the order they came in
                     [](const Influence& a, const Influence& b) { return a.joint < b.joint; });
    std::size_t kept = 0;
    for (const Influence& influence : influences) {
        if (kept > 0 && influences[kept - 1].joint == influence.joint)
            influences[kept - 1].weight += influence.weight;
        else
            influences[kept++] = influence;
    }
    influences.resize(kept);
    std::erase_if(influences, [](const Influence& influence) { return influence.weight <= 0; });
    std::stable_sort(influences.begin(), influences.end(),
                     [](const Influence& a, const Influence& b) { return a.weight > b.weight; });
}

/// Weights as whole steps that sum to kWeightSteps: what is left over goes to the largest remainders.
void round_weights(std::vector<Influence>& influences) {
    std::vector<double> remainders;
    double left = kWeightSteps;
    for (Influence& influence : influences) {
        const double steps = influence.weight * kWeightSteps;
        influence.weight = std::floor(steps);
        remainders.push_back(steps - influence.weight);
        left -= influence.weight;
    }
    for (; left > 0.5 && !influences.empty(); left -= 1) {
        const auto largest = std::max_element(remainders.begin(), remainders.end());
        influences[std::size_t(largest - remainders.begin())].weight += 1;
        *largest = -1;
    }
    for (Influence& influence : influences) influence.weight /= kWeightSteps;
    std::erase_if(influences, [](const Influence& influence) { return influence.weight <= 0; });
}

/// Joints by the driver vertices they follow; edges get theirs when they are first met.
class JointList {
public:
    JointList(std::span<const Vec3d> driver, Skin& skin) : driver_(driver), skin_(skin) {
        for (Index i = 0; i < driver.size(); ++i) add({i, i});
    }
    Index of(Index i, Index j) {
        if (i == j) return i;
        const auto [place, is_new] = edges_.try_emplace({std::min(i, j), std::max(i, j)}, Index(skin_.joints.size()));
        if (is_new) add({std::min(i, j), std::max(i, j)});
        return place->second;
    }

private:
    std::span<const Vec3d> driver_;
    Skin& skin_;
    std::map<Skin::Joint, Index> edges_;

    void add(const Skin::Joint& joint) {
        skin_.joints.push_back(joint);
        skin_.rest.push_back(0.5 * (driver_[joint[0]] + driver_[joint[1]]));
    }
};

/// The rotations that carry the axes onto the axes: 24.
std::vector<Mat3d> axis_rotations() {
    std::vector<Mat3d> rotations;
    std::array<int, 3> order = {0, 1, 2};
    do {
        for (int signs = 0; signs < 8; ++signs) {
            Mat3d rotation = Mat3d::Zero();
            for (int k = 0; k < 3; ++k) rotation(order[k], k) = signs >> k & 1 ? -1 : 1;
            if (rotation.determinant() > 0) rotations.push_back(rotation);
        }
    } while (std::next_permutation(order.begin(), order.end()));
    return rotations;
}

/// matrix = u diag(s) v^T with u and v rotations; the last of s is negative where the matrix mirrors.
struct Decomposition {
    Mat3d u, v;
    Vec3d s;
};

Decomposition decompose(const Mat3d& matrix) {
    const SingularValues<double> svd = singular_values(matrix);
    if (!svd.converged) return {Mat3d::Identity(), Mat3d::Identity(), Vec3d::Zero()}; // not finite
    Decomposition parts{svd.u, svd.v, svd.s};
    if (parts.u.determinant() < 0) parts.u.col(2) *= -1, parts.s[2] *= -1;
    if (parts.v.determinant() < 0) parts.v.col(2) *= -1, parts.s[2] *= -1;
    return parts;
}

/// How clearly the three singular values can be told apart.
double smallest_gap(const Vec3d& s) {
    const double a = std::abs(s[0]), b = std::abs(s[1]), c = std::abs(s[2]);
    return a > 0 ? std::min(a - b, b - c) / a : 0;
}

/// Renames and turns round the axes of `parts` so that its rotations are closest to those of `before`.
void align(Decomposition& parts, const Decomposition& before) {
    static const std::vector<Mat3d> kRotations = axis_rotations();
    const Mat3d turned = before.v.transpose() * parts.v + before.u.transpose() * parts.u;
    const Mat3d* best = nullptr;
    double closest = -std::numeric_limits<double>::infinity();
    for (const Mat3d& rotation : kRotations) {
        const double trace = (turned * rotation).trace();
        if (trace > closest + 1e-12) closest = trace, best = &rotation; // the first of equals, whatever the rounding
    }
    parts.u = parts.u * *best;
    parts.v = parts.v * *best;
    parts.s = (best->transpose() * parts.s.asDiagonal() * *best).diagonal();
}

void keep_sign(Eigen::Quaterniond& rotation, const Eigen::Quaterniond& before) {
    if (rotation.dot(before) < 0) rotation.coeffs() *= -1;
}

} // namespace

Result<Skin> make_skin(const Model& model, unsigned level, unsigned influences, bool exact) {
    if (influences != 3 && influences != 6)
        return Error{ErrorCode::usage, "A skin has 3 or 6 influences, not " + std::to_string(influences) + "."};
    if (const Result<unsigned> found = restored_level(model, {.level = level}); !found) return found.error();
    const BlendDetail& detail = model.detail;
    const std::span<const Vec3f> positions = model.mesh.positions;
    std::vector<Vec3d> driver;
    for (Index v : model.driver().vertices) driver.push_back(positions[v].cast<double>());

    Skin skin;
    skin.influences = influences;
    skin.slots = influences == 3 ? 4 : 8;
    JointList joint_list(driver, skin);

    std::vector<Index> place(positions.size(), kNoIndex); // of each mesh vertex in the level
    const bool finest = level == model.finest_level();
    const std::size_t count = finest ? model.vertex_count() : model.levels[level].vertices.size();
    for (Index k = 0; k < count; ++k) place[finest ? k : model.levels[level].vertices[k]] = k;
    skin.positions.resize(count);
    skin.vertex_joints.assign(count * skin.slots, 0);
    skin.vertex_weights.assign(count * skin.slots, 0);

    std::vector<Influence> bonds, pairs;
    for (std::size_t c = 0; c < detail.cells.size(); ++c)
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
            const Index vertex = detail.order[r], k = place[vertex];
            if (k == kNoIndex) continue;
            const Triangle& cell = detail.cells[c];
            const double u = detail.u[r], v = detail.v[r];
            bonds = {{cell[0], std::max(0.0, 1 - u - v)}, {cell[1], u}, {cell[2], v}};
            merge(bonds);
            if (!exact && influences == 3) round_weights(bonds);
            Vec3d m = Vec3d::Zero();
            for (const Influence& bond : bonds) m += bond.weight * driver[bond.joint];
            const Vec3d p = positions[vertex].cast<double>();
            skin.positions[k] = influences == 3 ? Vec3f((2 * p - m).cast<float>()) : positions[vertex];
            if (influences == 6) {
                pairs.clear();
                for (const Influence& a : bonds)
                    for (const Influence& b : bonds)
                        pairs.push_back({joint_list.of(a.joint, b.joint), a.weight * b.weight});
                merge(pairs);
                if (!exact) round_weights(pairs);
                bonds = pairs;
            }
            for (std::size_t n = 0; n < bonds.size(); ++n) {
                skin.vertex_joints[k * skin.slots + n] = bonds[n].joint;
                skin.vertex_weights[k * skin.slots + n] = static_cast<float>(bonds[n].weight);
            }
        }
    return skin;
}

JointTransform joint_transform(const Skin& skin, std::size_t joint, std::span<const Vec3f> positions,
                               std::span<const Mat3f> gradients) {
    const auto& [i, j] = skin.joints[joint];
    return {0.5 * skin.gradient_scale() * (gradients[i].cast<double>() + gradients[j].cast<double>()),
            0.5 * (positions[i].cast<double>() + positions[j].cast<double>())};
}

std::vector<NestedRotations> align_rotations(std::span<const Mat3d> matrices) {
    std::vector<Decomposition> parts;
    for (const Mat3d& matrix : matrices) parts.push_back(decompose(matrix * kInnerScale.cwiseInverse().asDiagonal()));

    // Begin at the key whose stretches differ most, where the axes are sure. From there each key follows its neighbour,
    // so where two stretches cross and the axes are unsure, only the keys there are affected.
    std::size_t start = 0;
    for (std::size_t k = 1; k < parts.size(); ++k)
        if (smallest_gap(parts[k].s) > smallest_gap(parts[start].s)) start = k;
    if (!parts.empty()) { // of the 24 names for the same matrix, the one that turns least
        Decomposition rest{Mat3d::Identity(), Mat3d::Identity(), Vec3d::Ones()};
        rest.u = parts[start].u * parts[start].v.transpose();
        align(parts[start], rest);
    }
    for (std::size_t k = start + 1; k < parts.size(); ++k) align(parts[k], parts[k - 1]);
    for (std::size_t k = start; k-- > 0;) align(parts[k], parts[k + 1]);

    std::vector<NestedRotations> nested(parts.size());
    for (std::size_t k = 0; k < parts.size(); ++k) {
        nested[k] = {Eigen::Quaterniond(parts[k].u).normalized(),
                     Eigen::Quaterniond(Mat3d(parts[k].v.transpose())).normalized(), parts[k].s};
        const Eigen::Quaterniond one = Eigen::Quaterniond::Identity();
        keep_sign(nested[k].outer_rotation, k > 0 ? nested[k - 1].outer_rotation : one);
        keep_sign(nested[k].inner_rotation, k > 0 ? nested[k - 1].inner_rotation : one);
    }
    return nested;
}

NestedRotations resting_rotations(double scale) {
    return {Eigen::Quaterniond::Identity(), Eigen::Quaterniond::Identity(), scale * kInnerScale.cwiseInverse()};
}

} // namespace filigree
