// Where a glTF scene's vertices are: keys, nodes, morph targets and skins, in double.
#include "filigree/core/dense_solve.h"
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/io/gltf/gltf_scene.h"

#include <algorithm>
#include <cmath>

namespace filigree::gltf {

namespace {

constexpr std::size_t kGltfEvaluateGrain = 2048;

/// Where a time lies between keys.
struct Moment {
    std::size_t key = 0, next = 0;
    double fraction = 0, span = 0; ///< of the way to `next`; seconds between the two
};

Moment find_moment(const Accessor& times, double seconds) {
    const std::size_t last = times.count - 1;
    if (!(seconds > times.scalar(0))) return {0, 0};
    if (seconds >= times.scalar(last)) return {last, last};
    std::size_t key = 0, after = last; // times[key] <= seconds < times[after]
    while (after - key > 1) {
        const std::size_t middle = (key + after) / 2;
        (times.scalar(middle) <= seconds ? key : after) = middle;
    }
    const double from = times.scalar(key), span = times.scalar(after) - from;
    return {key, after, (seconds - from) / span, span};
}

/// The numbers of a sampler at a moment, in `values`; the others are room to work in.
class SamplerReader {
public:
    const std::vector<double>& read(const Sampler& sampler, Path path, double seconds) {
        const Moment moment = find_moment(sampler.times, seconds);
        const bool cubic = sampler.interpolation == Interpolation::cubic;
        const std::size_t parts = cubic ? 3 : 1, value = cubic ? 1 : 0;
        read_part(sampler, path, moment.key * parts + value, values_);
        if (moment.fraction == 0 || sampler.interpolation == Interpolation::step) return values_;
        read_part(sampler, path, moment.next * parts + value, next_);
        if (cubic) {
            read_part(sampler, path, moment.key * parts + 2, leaving_);
            read_part(sampler, path, moment.next * parts, arriving_);
            interpolate_cubic(moment);
        } else if (path == Path::rotation) {
            interpolate_rotation(moment.fraction);
        } else {
            for (std::size_t k = 0; k < values_.size(); ++k) values_[k] += moment.fraction * (next_[k] - values_[k]);
        }
        return values_;
    }

private:
    static void read_part(const Sampler& sampler, Path path, std::size_t part, std::vector<double>& out) {
        out.resize(sampler.width);
        if (path == Path::weights)
            for (std::size_t k = 0; k < sampler.width; ++k) out[k] = sampler.values.scalar(part * sampler.width + k);
        else
            sampler.values.read(part, out.data());
    }

    void interpolate_cubic(const Moment& moment) {
        const double t = moment.fraction, t2 = t * t, t3 = t2 * t;
        for (std::size_t k = 0; k < values_.size(); ++k)
            values_[k] = (2 * t3 - 3 * t2 + 1) * values_[k] + moment.span * (t3 - 2 * t2 + t) * leaving_[k] +
                         (3 * t2 - 2 * t3) * next_[k] + moment.span * (t3 - t2) * arriving_[k];
    }

    void interpolate_rotation(double fraction) {
        const Eigen::Quaterniond a = Eigen::Quaterniond(values_.data()).normalized();
        const Eigen::Quaterniond b = Eigen::Quaterniond(next_.data()).normalized();
        Eigen::Map<Eigen::Quaterniond>(values_.data()) = math::slerp(a, fraction, b);
    }

    std::vector<double> values_, next_, leaving_, arriving_;
};

Affine affine(const Vec3d& translation, const Eigen::Quaterniond& rotation, const Vec3d& scale) {
    return {rotation.toRotationMatrix() * scale.asDiagonal(), translation};
}

Affine local(const Node& node) {
    return node.matrix ? *node.matrix : affine(node.translation, node.rotation, node.scale);
}

std::vector<double> rest_weights(const Scene& scene, const Node& node) {
    if (!node.mesh || !node.weights.empty()) return node.weights;
    const Value weights = scene.document->item("meshes", *node.mesh)["weights"];
    std::vector<double> numbers(weights.size());
    for (std::size_t w = 0; w < numbers.size(); ++w) numbers[w] = weights[w].number();
    return numbers;
}

/// Weights of the blocks' nodes as they are, one a morph target.
std::vector<std::vector<double>> rest_weights(const Scene& scene) {
    std::vector<std::vector<double>> weights(scene.nodes.size());
    for (const Block& block : scene.blocks) {
        std::vector<double>& own = weights[block.node];
        const std::size_t targets = scene.geometries[block.geometry].targets.size();
        if (own.empty() && targets > 0) own = rest_weights(scene, scene.nodes[block.node]);
        if (own.size() < targets) own.resize(targets);
    }
    return weights;
}

/// Turns transforms within parents into transforms in the world.
void apply_parents(const Scene& scene, std::vector<Affine>& transforms) {
    for (const std::size_t n : scene.order)
        if (const std::size_t parent = scene.nodes[n].parent; parent != n)
            transforms[n] = transforms[parent] * transforms[n];
}

/// What follows from where the nodes are within their parents.
void finish_pose(const Scene& scene, ScenePose& pose) {
    apply_parents(scene, pose.world);
    pose.joints.resize(scene.skins.size());
    for (const Block& block : scene.blocks) {
        if (!block.skinned) continue;
        const std::size_t number = *scene.nodes[block.node].skin;
        const Skin& skin = scene.skins[number];
        std::vector<Affine>& joints = pose.joints[number];
        if (!joints.empty()) continue;
        joints.reserve(skin.joints.size());
        for (std::size_t j = 0; j < skin.joints.size(); ++j)
            joints.push_back(pose.world[skin.joints[j]] * skin.inverse_binds[j]);
    }
}

/// What a block needs of a pose.
class PosedBlock {
public:
    PosedBlock(const Scene& scene, const Block& block, const ScenePose& pose)
        : block_(block), geometry_(scene.geometries[block.geometry]), world_(pose.world[block.node]) {
        const std::vector<double>& weights = pose.weights[block.node];
        for (std::size_t t = 0; t < std::min(weights.size(), geometry_.targets.size()); ++t)
            if (weights[t] != 0) targets_.push_back({&geometry_.targets[t], weights[t]});
        if (block.skinned) joints_ = pose.joints[*scene.nodes[block.node].skin];
    }

    const Geometry& geometry() const { return geometry_; }

    /// World positions of vertices begin .. end - 1.
    void positions(std::size_t begin, std::size_t end, std::span<Vec3d> out) const {
        for (std::size_t v = begin; v < end; ++v) out[v - begin] = geometry_.positions[v].cast<double>();
        for (const auto& [target, weight] : targets_)
            if (target->positions) target->positions->add_to(out, begin, end, weight);
        if (block_.skinned) {
            for (std::size_t v = begin; v < end; ++v) out[v - begin] = skinned(v, out[v - begin]);
        } else if (!world_.is_identity()) { // which would make +0 of -0
            for (std::size_t v = begin; v < end; ++v) out[v - begin] = world_ * out[v - begin];
        }
    }

    void normals(std::size_t begin, std::size_t end, std::span<Vec3f> out) const {
        std::copy(geometry_.normals.begin() + static_cast<std::ptrdiff_t>(begin),
                  geometry_.normals.begin() + static_cast<std::ptrdiff_t>(end), out.begin());
        if (!block_.skinned && targets_.empty() && world_.is_identity()) return;
        std::vector<Vec3d> sums(end - begin);
        for (std::size_t i = 0; i < sums.size(); ++i) sums[i] = out[i].cast<double>();
        for (const auto& [target, weight] : targets_)
            if (target->normals) target->normals->add_to(sums, begin, end, weight);
        const Mat3d rigid = (block_.mirrored ? -1.0 : 1.0) * cofactor(world_.linear);
        for (std::size_t i = 0; i < sums.size(); ++i) {
            const Vec3d turned = (block_.skinned ? cofactor(blended(begin + i)) : rigid) * sums[i];
            const double length = turned.norm();
            out[i] = length > 0 && std::isfinite(length) ? Vec3f((turned / length).cast<float>()) : Vec3f::Zero();
        }
    }

private:
    Vec3d skinned(std::size_t v, const Vec3d& p) const {
        const Influences& influences = geometry_.influences;
        Vec3d sum = Vec3d::Zero();
        for (Index i = influences.first[v]; i < influences.first[v + 1]; ++i)
            sum += influences.weights[i] * (joints_[influences.joints[i]] * p);
        return sum;
    }
    Mat3d blended(std::size_t v) const {
        const Influences& influences = geometry_.influences;
        Mat3d sum = Mat3d::Zero();
        for (Index i = influences.first[v]; i < influences.first[v + 1]; ++i)
            sum += influences.weights[i] * joints_[influences.joints[i]].linear;
        return sum;
    }

    const Block& block_;
    const Geometry& geometry_;
    const Affine& world_;
    std::vector<std::pair<const MorphTarget*, double>> targets_;
    std::span<const Affine> joints_; ///< with the inverse binds
};

} // namespace

ScenePose rest_pose(const Scene& scene) {
    ScenePose pose;
    pose.weights = rest_weights(scene);
    pose.world.reserve(scene.nodes.size());
    for (const Node& node : scene.nodes) pose.world.push_back(local(node));
    finish_pose(scene, pose);
    return pose;
}

ScenePose pose_at(const Scene& scene, const Animation& animation, double seconds) {
    std::vector<Node> moved(scene.nodes.size());
    ScenePose pose;
    pose.weights = rest_weights(scene);
    for (std::size_t n = 0; n < moved.size(); ++n) {
        moved[n].translation = scene.nodes[n].translation;
        moved[n].rotation = scene.nodes[n].rotation;
        moved[n].scale = scene.nodes[n].scale;
        moved[n].matrix = scene.nodes[n].matrix;
    }
    SamplerReader reader;
    for (const Channel& channel : animation.channels) {
        if (channel.path == Path::weights && pose.weights[channel.node].empty()) continue; // it is not shown
        const std::vector<double>& values = reader.read(animation.samplers[channel.sampler], channel.path, seconds);
        Node& node = moved[channel.node];
        switch (channel.path) {
        case Path::translation:
            node.translation = Vec3d(values.data());
            break;
        case Path::scale:
            node.scale = Vec3d(values.data());
            break;
        case Path::rotation: {
            const Eigen::Quaterniond rotation(values.data());
            const double length = rotation.norm();
            node.rotation = length > 0 ? rotation.normalized() : Eigen::Quaterniond::Identity();
            break;
        }
        case Path::weights:
            pose.weights[channel.node] = values;
            break;
        }
    }
    for (const Node& node : moved) pose.world.push_back(local(node));
    finish_pose(scene, pose);
    return pose;
}

void place_vertices(const Scene& scene, const ScenePose& pose, const RunContext& context,
                    const std::function<void(std::size_t first_vertex, std::span<const Vec3d> positions)>& take) {
    for (const Block& block : scene.blocks) {
        if (context.is_cancelled()) break;
        const PosedBlock posed(scene, block, pose);
        parallel_for(context, posed.geometry().kept, kGltfEvaluateGrain, [&](std::size_t begin, std::size_t end) {
            std::array<Vec3d, kGltfEvaluateGrain> positions;
            posed.positions(begin, end, positions);
            take(block.first_vertex + begin, std::span(positions).first(end - begin));
        });
    }
}

std::vector<Vec3f> turned_normals(const Scene& scene, const ScenePose& pose, const RunContext& context) {
    std::vector<Vec3f> normals(scene.mesh.normals.values.size());
    for (const Block& block : scene.blocks) {
        if (context.is_cancelled()) break;
        const PosedBlock posed(scene, block, pose);
        parallel_for(context, posed.geometry().normals.size(), kGltfEvaluateGrain,
                     [&](std::size_t begin, std::size_t end) {
                         posed.normals(begin, end, std::span(normals).subspan(block.first_normal + begin, end - begin));
                     });
    }
    return normals;
}

} // namespace filigree::gltf
