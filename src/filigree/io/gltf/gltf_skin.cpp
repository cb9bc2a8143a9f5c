// The skins of a glTF scene as one: the bind pose, and what moves it.
#include "filigree/skin.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/io/gltf/glb_morphs.h"
#include "filigree/io/gltf/gltf_scene.h"
#include "filigree/io/system/file.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace filigree {

namespace {

using gltf::Affine;

constexpr std::size_t kSkinGrain = 1024; // vertices
constexpr double kUpright = 30;          // degrees: nearer to an axis a skin is taken as standing along it
constexpr double kSameBind = 1e-3;       // of the mesh's size: binds of one node that differ less are the same
constexpr double kLeastScale = 1e-9;

Affine inverse(const Affine& of) {
    const Mat3d linear = of.linear.inverse();
    return {linear, -(linear * of.translation)};
}

Eigen::Affine3d as_eigen(const Affine& of) {
    Eigen::Affine3d to = Eigen::Affine3d::Identity();
    to.linear() = of.linear;
    to.translation() = of.translation;
    return to;
}

/// A rotation that is near one of the 24 that map axes to axes becomes that.
Mat3d upright(const Mat3d& rotation) {
    Mat3d snapped = Mat3d::Zero();
    for (int c = 0; c < 3; ++c) {
        int row = 0;
        rotation.col(c).cwiseAbs().maxCoeff(&row);
        snapped(row, c) = rotation(row, c) < 0 ? -1 : 1;
    }
    const double cosine = 0.5 * ((snapped.transpose() * rotation).trace() - 1);
    return snapped.determinant() > 0.5 && cosine > math::cos(radians(kUpright)) ? snapped : rotation;
}

class SkinReader {
public:
    SkinReader(std::shared_ptr<const gltf::Scene> scene, const RunContext& context)
        : scene_(*scene), kept_(std::move(scene)), context_(context), rest_(gltf::rest_pose(scene_)) {}

    Result<SkinnedMesh> read() {
        if (std::ranges::none_of(scene_.blocks, &gltf::Block::skinned))
            return refuse("has no skin, and flesh needs joints that carry the mesh; export the character with "
                          "its armature.");
        if (scene_.animations.empty())
            return refuse("has a skin and no animation that moves it; export the character with its actions.");
        if (Status placed = place_skins(); !placed) return placed.error();
        place_nodes();
        if (Status laid = lay_out_mesh(); !laid) return laid.error();
        lay_out_joints();
        lay_out_weights();
        lay_out_clips();
        lay_out_morphs();
        skin_.warnings.insert(skin_.warnings.begin(), scene_.warnings.begin(), scene_.warnings.end());
        return std::move(skin_);
    }

private:
    Error refuse(const std::string& why) const { return {ErrorCode::unsuitable, scene_.name + ": " + why}; }

    /// The weight that each joint of a skin has, the vertices' middle in the skin's own space, and where a pose has it.
    struct Mean {
        std::vector<double> of_joint;
        Vec3d middle = Vec3d::Zero();
        double total = 0;
    };
    Mean mean_of(std::size_t skin) const {
        Mean mean;
        mean.of_joint.resize(scene_.skins[skin].joints.size());
        for (const gltf::Block& block : scene_.blocks) {
            if (!block.skinned || *scene_.nodes[block.node].skin != skin) continue;
            const gltf::Geometry& geometry = scene_.geometries[block.geometry];
            const gltf::Influences& influences = geometry.influences;
            for (std::size_t v = 0; v < geometry.kept; ++v) {
                for (Index i = influences.first[v]; i < influences.first[v + 1]; ++i)
                    mean.of_joint[influences.joints[i]] += influences.weights[i];
                mean.middle += geometry.positions[v].cast<double>();
                mean.total += 1;
            }
        }
        mean.middle /= std::max(mean.total, 1.0);
        return mean;
    }

    /// Size and turn of a skin's space in the world: by its joints at the start of the first clip and at rest.
    std::optional<Affine> own_placement(std::size_t number, const Mean& mean) const {
        const gltf::ScenePose start =
            gltf::pose_at(scene_, scene_.animations[0], scene_.animations[0].summary.first_key);
        Mat3d linear = Mat3d::Zero();
        Vec3d middle = Vec3d::Zero();
        double total = 0;
        std::vector<std::pair<double, double>> sizes; // and weights
        for (std::size_t j = 0; j < mean.of_joint.size(); ++j) {
            const double weight = mean.of_joint[j];
            if (!(weight > 0)) continue;
            sizes.emplace_back(math::cbrt(start.joints[number][j].linear.determinant()), weight);
            const Affine& joint = rest_.joints[number][j];
            const double size = math::cbrt(std::abs(joint.linear.determinant()));
            if (!(size > kLeastScale)) continue;
            linear += weight / size * joint.linear;
            middle += weight * (joint * mean.middle);
            total += weight;
        }
        if (!(total > 0)) return std::nullopt;
        std::ranges::sort(sizes);
        double half = 0, all = 0;
        for (const auto& [size, weight] : sizes) all += weight;
        double scale = 0; // the median
        for (const auto& [size, weight] : sizes) {
            half += weight;
            scale = size;
            if (half >= 0.5 * all) break;
        }
        if (!(std::abs(scale) > kLeastScale) || !std::isfinite(scale)) return std::nullopt;
        const double side = scale < 0 ? -1 : 1; // mirrored as a whole
        Affine placed;
        placed.linear = scale * upright(nearest_rotation(side * linear));
        placed.translation = middle / total - placed.linear * mean.middle;
        return placed;
    }

    /// Where each skin's space is in the bind pose: the largest by itself, others by a joint that they share with one
    /// that is placed.
    Status place_skins() {
        placed_.resize(scene_.skins.size());
        std::vector<Mean> means;
        std::vector<std::size_t> order;
        for (std::size_t s = 0; s < scene_.skins.size(); ++s) {
            means.push_back(mean_of(s));
            if (means[s].total > 0) order.push_back(s);
        }
        std::ranges::stable_sort(order, std::greater<>(), [&](std::size_t s) { return means[s].total; });
        std::map<std::size_t, Affine> binds; // of nodes
        for (const std::size_t s : order) {
            const gltf::Skin& skin = scene_.skins[s];
            for (std::size_t j = 0; j < skin.joints.size() && !placed_[s]; ++j)
                if (const auto known = binds.find(skin.joints[j]); known != binds.end() && has_bind(skin, j))
                    placed_[s] = known->second * skin.inverse_binds[j];
            if (!placed_[s]) placed_[s] = own_placement(s, means[s]);
            if (!placed_[s])
                return refuse("its joints have the scale zero where its first clip starts; cut the clip, or scale them "
                              "up.");
            for (std::size_t j = 0; j < skin.joints.size(); ++j)
                if (has_bind(skin, j)) binds.try_emplace(skin.joints[j], *placed_[s] * inverse(skin.inverse_binds[j]));
        }
        node_binds_ = std::move(binds);
        return Success{};
    }

    static bool has_bind(const gltf::Skin& skin, std::size_t joint) {
        return (skin.damaged.empty() || !skin.damaged[joint]) &&
               std::abs(skin.inverse_binds[joint].linear.determinant()) > 1e-30;
    }

    /// Nodes in the bind pose: joints as their skins have them, what hangs on them with them, others as at rest.
    void place_nodes() {
        bind_ = rest_.world;
        std::vector<bool> is_moved(bind_.size(), false);
        for (const std::size_t n : scene_.order) {
            if (const auto known = node_binds_.find(n); known != node_binds_.end()) {
                bind_[n] = known->second;
                is_moved[n] = true;
                continue;
            }
            const std::size_t parent = scene_.nodes[n].parent;
            if (parent == n || !is_moved[parent]) continue;
            if (std::abs(rest_.world[parent].linear.determinant()) < 1e-30) continue;
            bind_[n] = bind_[parent] * (inverse(rest_.world[parent]) * rest_.world[n]);
            is_moved[n] = true;
        }
    }

    Status lay_out_mesh() {
        gltf::ScenePose pose = rest_;
        pose.world = bind_;
        for (std::size_t s = 0; s < scene_.skins.size(); ++s)
            if (placed_[s]) pose.joints[s].assign(scene_.skins[s].joints.size(), *placed_[s]);
        skin_.mesh = scene_.mesh;
        skin_.mesh.origin.setZero();
        std::vector<Vec3d> world(skin_.mesh.positions.size());
        gltf::place_vertices(scene_, pose, context_, [&](std::size_t first, std::span<const Vec3d> positions) {
            std::ranges::copy(positions, world.begin() + std::ptrdiff_t(first));
        });
        if (context_.is_cancelled()) return cancelled_error();
        for (const Vec3d& place : world)
            if (!(place.allFinite() && place.cwiseAbs().maxCoeff() < 1e30))
                return refuse("its bind pose has vertices at no place that 32-bit float can hold.");
        split_origin(world, skin_.mesh);
        if (!skin_.mesh.normals.empty()) skin_.mesh.normals.values = gltf::turned_normals(scene_, pose, context_);
        if (is_mirrored()) turn_inside_out();
        return Success{};
    }

    /// Whether the armature turns all of the mesh inside out.
    bool is_mirrored() const {
        return std::ranges::all_of(scene_.blocks, [&](const gltf::Block& block) {
            return block.skinned && placed_[*scene_.nodes[block.node].skin]->linear.determinant() < 0;
        });
    }

    void turn_inside_out() {
        Mesh& mesh = skin_.mesh;
        for (std::size_t f = 0; f < mesh.face_count(); ++f)
            for (std::vector<Index>* corners : {&mesh.corners, &mesh.uvs.corners, &mesh.normals.corners})
                if (!corners->empty())
                    std::reverse(corners->begin() + std::ptrdiff_t(mesh.face_offsets[f]),
                                 corners->begin() + std::ptrdiff_t(mesh.face_offsets[f + 1]));
        for (Vec3f& normal : mesh.normals.values) normal = -normal;
    }

    /// What a joint is in the file, and the map from the bind pose's world to the space that its matrix expects.
    struct Source {
        std::size_t node = 0;
        Affine before;
    };

    Index joint_of(std::size_t node, const Affine& before, bool is_node) {
        const double size = std::max(bounds(skin_.mesh).diagonal(), 1e-12);
        for (const Index known : joints_of_[node]) {
            const Affine& other = sources_[known].before;
            const double scale = other.linear.norm();
            const double apart = (before.linear - other.linear).norm() / scale * size +
                                 (before.translation - other.translation).norm() / scale;
            if (apart < kSameBind * size) return known;
        }
        const auto number = Index(sources_.size());
        sources_.push_back({node, before});
        joints_of_[node].push_back(number);
        SkinJoint joint;
        joint.name = scene_.nodes[node].name.empty() ? "node " + std::to_string(node) : scene_.nodes[node].name;
        joint.is_node_of_mesh = is_node;
        joint.place = bind_[node].translation - skin_.mesh.origin;
        skin_.joints.push_back(std::move(joint));
        return number;
    }

    void lay_out_joints() {
        numbers_.resize(scene_.skins.size());
        for (std::size_t s = 0; s < scene_.skins.size(); ++s) {
            if (!placed_[s]) continue;
            const gltf::Skin& skin = scene_.skins[s];
            const Affine to_skin = inverse(*placed_[s]);
            for (std::size_t j = 0; j < skin.joints.size(); ++j)
                numbers_[s].push_back(joint_of(skin.joints[j], skin.inverse_binds[j] * to_skin, false));
        }
        for (const gltf::Block& block : scene_.blocks)
            if (!block.skinned) {
                const Affine& bind = bind_[block.node];
                const bool is_flat = std::abs(bind.linear.determinant()) < 1e-30;
                mesh_joints_[block.node] = joint_of(block.node, is_flat ? Affine() : inverse(bind), true);
            }
        for (std::size_t j = 0; j < sources_.size(); ++j) {
            std::size_t n = sources_[j].node;
            while (scene_.nodes[n].parent != n && skin_.joints[j].parent == kNoIndex) {
                n = scene_.nodes[n].parent;
                if (!joints_of_[n].empty()) skin_.joints[j].parent = joints_of_[n].front();
            }
        }
    }

    void lay_out_weights() {
        SkinWeights& weights = skin_.weights;
        weights.first.assign(1, 0);
        for (const gltf::Block& block : scene_.blocks) { // their vertices follow each other
            const gltf::Geometry& geometry = scene_.geometries[block.geometry];
            for (std::size_t v = 0; v < geometry.kept; ++v) {
                if (block.skinned)
                    add_vertex(geometry.influences, v, numbers_[*scene_.nodes[block.node].skin]);
                else
                    add(mesh_joints_.at(block.node), 1);
                weights.first.push_back(Index(weights.joints.size()));
            }
        }
    }

    void add(Index joint, double weight) {
        skin_.weights.joints.push_back(joint);
        skin_.weights.weights.push_back(float(weight));
    }

    void add_vertex(const gltf::Influences& influences, std::size_t v, const std::vector<Index>& numbers) {
        double sum = 0;
        for (Index i = influences.first[v]; i < influences.first[v + 1]; ++i) sum += influences.weights[i];
        if (!(sum > 0)) return add(numbers.front(), 1);
        for (Index i = influences.first[v]; i < influences.first[v + 1]; ++i)
            if (influences.weights[i] > 0) add(numbers[influences.joints[i]], influences.weights[i] / sum);
    }

    void lay_out_clips() {
        std::vector<double> begins;
        for (std::size_t a = 0; a < scene_.animations.size(); ++a) {
            const gltf::Animation& animation = scene_.animations[a];
            const GltfAnimation& summary = animation.summary;
            skin_.clips.push_back({summary.name.empty() ? "clip " + std::to_string(a + 1) : summary.name,
                                   std::max(0.0, summary.last_key - summary.first_key)});
            begins.push_back(summary.first_key);
        }
        skin_.transforms = [scene = kept_, sources = std::move(sources_), begins, origin = skin_.mesh.origin](
                               std::size_t clip, double seconds, std::span<Eigen::Affine3d> transforms) {
            const gltf::Animation& animation = scene->animations[clip];
            const double at = begins[clip] + std::max(seconds, 0.0);
            const gltf::ScenePose pose = gltf::pose_at(*scene, animation, at);
            for (std::size_t j = 0; j < sources.size(); ++j) {
                Affine joint = pose.world[sources[j].node] * sources[j].before;
                joint.translation += joint.linear * origin - origin;
                transforms[j] = as_eigen(joint);
            }
        };
    }

    /// What a block's morph targets add to the bind pose.
    void add_targets(const gltf::Block& block, std::size_t first) {
        const gltf::Geometry& geometry = scene_.geometries[block.geometry];
        const Mat3d linear = block.skinned ? placed_[*scene_.nodes[block.node].skin]->linear : bind_[block.node].linear;
        const double size = math::cbrt(std::abs(linear.determinant()));
        const double side = (!block.skinned && block.mirrored) || (block.skinned && is_mirrored()) ? -1 : 1;
        const Mat3d turn = side / std::max(size * size, 1e-30) * cofactor(linear);
        std::vector<Vec3d> places(geometry.kept), normals(geometry.kept);
        for (std::size_t t = 0; t < geometry.targets.size(); ++t) {
            const gltf::MorphTarget& target = geometry.targets[t];
            SkinMorph& morph = skin_.morphs[first + t];
            std::ranges::fill(places, Vec3d::Zero());
            std::ranges::fill(normals, Vec3d::Zero());
            if (target.positions) target.positions->add_to(places, 0, geometry.kept, 1);
            if (target.normals) target.normals->add_to(normals, 0, geometry.kept, 1);
            has_normals_[first + t] = has_normals_[first + t] || target.normals.has_value();
            for (std::size_t v = 0; v < geometry.kept; ++v) {
                if (places[v].isZero(0) && normals[v].isZero(0)) continue;
                morph.vertices.push_back(Index(block.first_vertex + v));
                morph.positions.push_back((linear * places[v]).cast<float>());
                morph.normals.push_back((turn * normals[v]).cast<float>());
            }
        }
    }

    /// A morph target is that of a node; its blocks follow each other.
    void lay_out_morphs() {
        std::vector<std::pair<std::size_t, std::size_t>> targets; // nodes, and numbers in their meshes
        std::map<std::size_t, std::size_t> first_of;
        for (const gltf::Block& block : scene_.blocks) {
            const std::size_t count = scene_.geometries[block.geometry].targets.size();
            const auto [first, is_new] = first_of.try_emplace(block.node, targets.size());
            const gltf::Value names =
                scene_.document->item("meshes", *scene_.nodes[block.node].mesh)["extras"]["targetNames"];
            for (std::size_t t = 0; is_new && t < count; ++t) {
                targets.emplace_back(block.node, t);
                const bool is_named =
                    names && names.json().is_array() && t < names.size() && names[t].json().is_string();
                SkinMorph& morph = skin_.morphs.emplace_back();
                morph.name = is_named ? names[t].text() : "morph " + std::to_string(targets.size());
                morph.weight = rest_.weights[block.node][t];
            }
            has_normals_.resize(targets.size());
            if (first->second + count <= targets.size()) add_targets(block, first->second);
        }
        for (std::size_t m = 0; m < targets.size(); ++m)
            if (!has_normals_[m]) skin_.morphs[m].normals.clear();
        for (std::size_t a = 0; a < scene_.animations.size() && !targets.empty(); ++a)
            skin_.morph_weights.push_back([scene = kept_, a, targets](double seconds, std::span<double> weights) {
                const gltf::Animation& animation = scene->animations[a];
                const gltf::ScenePose pose =
                    gltf::pose_at(*scene, animation, animation.summary.first_key + std::max(seconds, 0.0));
                for (std::size_t m = 0; m < targets.size(); ++m)
                    weights[m] = pose.weights[targets[m].first][targets[m].second];
            });
    }

    const gltf::Scene& scene_;
    std::shared_ptr<const gltf::Scene> kept_;
    const RunContext& context_;
    const gltf::ScenePose rest_;
    std::vector<std::optional<Affine>> placed_; ///< of each skin: from its space to the bind pose; none: unused
    std::map<std::size_t, Affine> node_binds_;
    std::vector<Affine> bind_;                            ///< of nodes
    std::vector<Source> sources_;                         ///< of joints
    std::map<std::size_t, std::vector<Index>> joints_of_; ///< of nodes
    std::map<std::size_t, Index> mesh_joints_;            ///< of nodes that carry a mesh without a skin
    std::vector<std::vector<Index>> numbers_;             ///< of each skin's joints
    std::vector<bool> has_normals_;                       ///< of morph targets
    SkinnedMesh skin_;
};

} // namespace

Result<SkinnedMesh> read_skin(const std::filesystem::path& path, const RunContext& context) {
    Result<std::string> bytes = read_file(path);
    if (!bytes) return bytes.error();
    auto scene = std::make_shared<gltf::Scene>();
    scene->name = path == "-" ? "standard input" : path.string();
    scene->owned = *std::move(bytes);
    if (!is_gltf(scene->owned))
        return Error{ErrorCode::unsuitable, scene->name + ": is no glTF; skins are read from .glb and .gltf."};
    if (Status read = gltf::read_scene(scene->owned, *scene, context); !read) return read.error();
    return SkinReader(std::move(scene), context).read();
}

Eigen::Affine3d blended_transform(const SkinnedMesh& skin, std::span<const Eigen::Affine3d> transforms, Index vertex) {
    Eigen::Affine3d blend(Eigen::Affine3d::MatrixType::Zero());
    const SkinWeights& weights = skin.weights;
    for (Index i = weights.first[vertex]; i < weights.first[vertex + 1]; ++i)
        blend.affine() += double(weights.weights[i]) * transforms[weights.joints[i]].affine();
    blend.makeAffine();
    return blend;
}

Status clip_positions(const SkinnedMesh& skin, std::size_t clip, double seconds, std::span<Vec3f> positions,
                      const RunContext& context) {
    if (skin.surface) return skin.surface(clip, seconds, positions);
    std::vector<Eigen::Affine3d> transforms(skin.joints.size());
    skin.transforms(clip, seconds, transforms);
    skin_positions(skin, transforms, positions, context);
    return Success{};
}

void skin_positions(const SkinnedMesh& skin, std::span<const Eigen::Affine3d> transforms, std::span<Vec3f> positions,
                    const RunContext& context) {
    const SkinWeights& weights = skin.weights;
    parallel_for(context, positions.size(), kSkinGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const Vec3d at = skin.mesh.positions[v].cast<double>();
            Vec3d sum = Vec3d::Zero();
            for (Index i = weights.first[v]; i < weights.first[v + 1]; ++i)
                sum += double(weights.weights[i]) * (transforms[weights.joints[i]] * at);
            positions[v] = sum.cast<float>();
        }
    });
}

std::string check_morph(const SkinMorph& morph, std::size_t vertex_count) {
    const std::size_t count = morph.vertices.size();
    const bool fits = morph.positions.size() == count && (morph.normals.empty() || morph.normals.size() == count) &&
                      std::ranges::is_sorted(morph.vertices, std::less_equal<>()) &&
                      (count == 0 || morph.vertices.back() < vertex_count);
    return fits ? "" : "The morph target '" + morph.name + "' is not of the mesh's vertices.";
}

std::string check_skin(const SkinnedMesh& skin) {
    if (std::string wrong = check_mesh(skin.mesh); !wrong.empty()) return wrong;
    const SkinWeights& w = skin.weights;
    if (w.first.size() != skin.mesh.vertex_count() + 1 || w.first.front() != 0 || w.first.back() != w.joints.size() ||
        w.joints.size() != w.weights.size() || !std::ranges::is_sorted(w.first))
        return "The skin's weights are not those of its mesh's vertices.";
    for (std::size_t v = 0; v + 1 < w.first.size(); ++v) {
        double sum = 0;
        for (Index i = w.first[v]; i < w.first[v + 1]; ++i) {
            if (w.joints[i] >= skin.joints.size())
                return "Vertex " + std::to_string(v) + " hangs on joint " + std::to_string(w.joints[i]) +
                       ", and the skin has " + std::to_string(skin.joints.size()) + ".";
            if (!(w.weights[i] > 0)) return "A weight of vertex " + std::to_string(v) + " is not above 0.";
            sum += double(w.weights[i]);
        }
        if (!(std::abs(sum - 1) < 1e-3)) return "The weights of vertex " + std::to_string(v) + " do not sum to 1.";
    }
    for (std::size_t j = 0; j < skin.joints.size(); ++j)
        if (skin.joints[j].parent != kNoIndex && skin.joints[j].parent >= skin.joints.size())
            return "Joint " + std::to_string(j) + " has a parent that is no joint.";
    if (!skin.transforms) return "The skin has no transforms.";
    if (!skin.morphs.empty() && skin.morph_weights.size() != skin.clips.size())
        return "The skin has morph targets, and weights of them for " + std::to_string(skin.morph_weights.size()) +
               " of " + std::to_string(skin.clips.size()) + " clips.";
    for (const SkinMorph& morph : skin.morphs)
        if (std::string wrong = check_morph(morph, skin.mesh.vertex_count()); !wrong.empty()) return wrong;
    return "";
}

} // namespace filigree
