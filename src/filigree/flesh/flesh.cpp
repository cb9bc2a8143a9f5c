// How a skinned mesh becomes a body, and what each of its particles follows.
#include "filigree/flesh.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/flesh/inward_weights.h"
#include "filigree/mesh/mesh_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string_view>

namespace filigree {

namespace {

constexpr std::size_t kTargetsGrain = 512; // particles
constexpr double kKeepsScale = 0.05;       ///< joints that change their size by less are rigid
constexpr double kLeastScale = 0.5, kMostScale = 2;
constexpr float kCarries = 0.15f;              ///< weight from which a bone is near to a particle
constexpr float kHeldStrength = 0.75f;         ///< of joints that hold their core
constexpr float kFreeStrength = 0.1f;          ///< of joints that have no leash
constexpr double kLeafReach = 1.5;             ///< times the way from a last joint to the middle of what it carries
constexpr float kFolded = 0.3f, kWhole = 0.7f; ///< volume of a cell that the joints alone leave: from free to held
constexpr float kInverted = 0.1f;              ///< volume of a cell at the start below which it is opened
constexpr int kSettledRings = 2, kSettlingSteps = 60;
constexpr float kThinDepth = 0.9f;                          ///< spacings
constexpr int kThinReach = 3;                               ///< cells
constexpr float kMainShare = 0.6f;                          ///< weight of the joint that a particle belongs to
constexpr std::size_t kFarInSkeleton = 4, kFewestGlued = 4; ///< joints, edges of the lattice
constexpr std::size_t kMostMoments = 120;                   ///< of a clip that are looked at for scales

Error usage(std::string sentence) { return {ErrorCode::usage, std::move(sentence)}; }

/// A line from one end to the other, m.
struct Bone {
    Index joint;
    Vec3d from, to;

    double distance(const Vec3d& point) const {
        const Vec3d along = to - from;
        const double squared = along.squaredNorm();
        const double part = squared > 0 ? std::clamp((point - from).dot(along) / squared, 0.0, 1.0) : 0.0;
        return (from + part * along - point).norm();
    }
};

std::string list_of(const std::vector<std::string>& names) {
    constexpr std::size_t kMost = 4;
    std::string list;
    for (std::size_t n = 0; n < std::min(names.size(), kMost); ++n) list += (n > 0 ? ", '" : "'") + names[n] + "'";
    return names.size() > kMost ? list + " and " + std::to_string(names.size() - kMost) + " more" : list;
}

/// S of a transform R S, R a rotation: what it does to sizes, a symmetric matrix. Singular values stay within the
/// range of joints that flesh follows, also between the moments that were looked at.
Mat3d stretch_of(const Eigen::Affine3d& transform) {
    const SingularValues<double> parts = singular_values(Mat3d(transform.linear()));
    const Vec3d s = parts.s.cwiseMax(kLeastScale / 2).cwiseMin(2 * kMostScale);
    const Mat3d stretch = parts.v * s.asDiagonal() * parts.v.transpose();
    return 0.5 * (stretch + stretch.transpose());
}

} // namespace

Material flesh_material() { return {.density = 1000, .young_modulus = 1.5e4, .poisson_ratio = 0.47, .damping = 0}; }

double flesh_scale(double size) {
    double scale = 1;
    if (!(size > 0) || !std::isfinite(size) || (size >= 0.1 && size <= 10)) return scale;
    while (size * scale > 3) scale /= 10;
    while (size * scale < 0.3) scale *= 10;
    return scale;
}

/// Makes a Flesh, one thing after the other.
class FleshMaker {
public:
    FleshMaker(SkinnedMesh skin, const FleshOptions& options, std::span<const std::size_t> clips,
               const RunContext& context)
        : context_(context), clips_(clips.begin(), clips.end()) {
        flesh_.skin_ = std::make_shared<const SkinnedMesh>(std::move(skin));
        flesh_.options_ = options;
        if (clips_.empty())
            for (std::size_t c = 0; c < flesh_.skin_->clips.size(); ++c) clips_.push_back(c);
    }

    Result<Flesh> make() {
        if (Status fine = check(); !fine) return fine.error();
        find_scales();
        if (Status cut = cut_surface(); !cut) return cut.error();
        if (Status made = make_matter(); !made) return made.error();
        find_softness();
        find_folds();
        if (Status set = set_springs(); !set) return set.error();
        collect_warnings();
        return std::move(flesh_);
    }

private:
    const SkinnedMesh& skin() const { return *flesh_.skin_; }
    const Body& body() const { return *flesh_.body_; }

    Status check() {
        if (const std::string wrong = check_skin(skin()); !wrong.empty()) return usage(wrong);
        FleshOptions& o = flesh_.options_;
        const auto is_part = [](double x) { return x >= 0 && x <= 1; };
        const auto is_number = [](double x) { return x >= 0 && std::isfinite(x); };
        if (!is_number(o.scale)) return usage("The scale must be above 0, in metres a model unit.");
        if (!is_part(o.core)) return usage("The core must be between 0 and 1.");
        if (!is_number(o.frequency) || !is_number(o.surface_frequency))
            return usage("The frequencies of the springs must be 0 Hz or more.");
        if (!is_number(o.damping)) return usage("The damping must be 0 or more, per second.");
        if (o.leash && !(*o.leash > 0)) return usage("The leash must be longer than 0 m.");
        if (!(o.most_acceleration > 0)) return usage("The largest acceleration must be above 0 m/s^2.");
        if (!o.gravity.allFinite()) return usage("Gravity must be finite.");
        if (o.material.model != MaterialModel::fem) return usage("Flesh is of the model fem.");
        for (const std::size_t clip : clips_)
            if (clip >= skin().clips.size())
                return usage("There is no clip " + std::to_string(clip) + "; the skin has " +
                             std::to_string(skin().clips.size()) + ".");
        if (o.spacing && !(*o.spacing > 0 && std::isfinite(*o.spacing)))
            return usage("The spacing of the particles must be above 0 m.");
        if (!is_part(o.loose_strength)) return usage("The strength of loose matter must be between 0 and 1.");
        if (!o.loose.empty() && o.loose.size() != skin().mesh.vertex_count())
            return usage("There are " + std::to_string(o.loose.size()) + " numbers of how loose the matter is for " +
                         std::to_string(skin().mesh.vertex_count()) + " vertices.");
        if (!std::ranges::all_of(o.loose, [&](float x) { return is_part(double(x)); }))
            return usage("How loose the matter is must be between 0 and 1 at each vertex.");
        if (o.scale == 0) o.scale = flesh_scale(bounds(skin().mesh).size().maxCoeff());
        return name_joints();
    }

    /// The number of the first pattern that a joint fits, or a joint above it; `patterns`: there is none.
    template <class Patterns, class Pattern>
    std::size_t first_fit(std::size_t joint, const Patterns& patterns, const Pattern& pattern) const {
        Index at = Index(joint);
        for (std::size_t steps = 0; at != kNoIndex && steps <= skin().joints.size(); ++steps) {
            for (std::size_t p = 0; p < patterns.size(); ++p)
                if (fits_pattern(skin().joints[at].name, pattern(patterns[p]))) return p;
            at = skin().joints[at].parent;
        }
        return patterns.size();
    }

    Error no_joint_called(const std::string& pattern) const {
        if (!skin().has_bones)
            return usage("'" + pattern + "' should name joints, and this mesh moves without joints.");
        std::vector<std::string> names;
        for (const SkinJoint& joint : skin().joints) names.push_back(joint.name);
        return usage("No joint is called '" + pattern + "'; there are " + list_of(names) + ".");
    }

    /// What the patterns say of each joint.
    Status name_joints() {
        const FleshOptions& o = flesh_.options_;
        const std::size_t count = skin().joints.size();
        soft_of_.resize(count);
        std::vector<std::uint8_t> met(o.soft.size());
        for (std::size_t j = 0; j < count; ++j) {
            soft_of_[j] =
                first_fit(j, o.soft, [](const SoftJoints& soft) -> const std::string& { return soft.pattern; });
            if (soft_of_[j] == o.soft.size() || !skin().has_bones) continue;
            met[soft_of_[j]] = 1;
            flesh_.report_.soft.push_back(skin().joints[j].name);
        }
        const auto is_number = [](const std::optional<double>& x) { return !x || (*x >= 0 && std::isfinite(*x)); };
        for (std::size_t s = 0; s < o.soft.size(); ++s) {
            const SoftJoints& soft = o.soft[s];
            if (!(soft.strength >= 0 && soft.strength <= 1))
                return usage("The strength of a soft joint must be between 0 and 1.");
            if (!is_number(soft.core) || soft.core.value_or(0) > 1)
                return usage("The core of a soft joint must be between 0 and 1.");
            if (!is_number(soft.frequency) || !is_number(soft.surface_frequency) || !is_number(soft.damping))
                return usage("The frequencies and the damping of a soft joint must be 0 or more.");
            if (!met[s]) return no_joint_called(soft.pattern);
        }
        return set_contacts();
    }

    /// Joints that fit the same patterns are one group of contact.
    Status set_contacts() {
        const std::vector<JointContact>& contacts = flesh_.options_.contacts;
        std::map<std::vector<std::uint8_t>, std::uint16_t> numbers;
        std::vector<std::vector<std::uint8_t>> groups; ///< whether it fits first and second of each contact
        std::vector<std::uint8_t> met(2 * contacts.size());
        for (std::size_t j = 0; j < skin().joints.size() && !contacts.empty(); ++j) {
            std::vector<std::uint8_t> fits_them;
            for (const JointContact& contact : contacts)
                for (const std::string* name : {&contact.first, &contact.second})
                    fits_them.push_back(skin().has_bones &&
                                        first_fit(j, std::span(name, 1),
                                                  [](const std::string& n) -> const std::string& { return n; }) == 0);
            for (std::size_t k = 0; k < met.size(); ++k) met[k] |= fits_them[k];
            const auto [known, is_new] = numbers.try_emplace(fits_them, std::uint16_t(groups.size()));
            if (is_new) groups.push_back(fits_them);
            group_of_.push_back(known->second);
        }
        for (std::size_t k = 0; k < met.size(); ++k)
            if (!met[k]) return no_joint_called(k % 2 == 0 ? contacts[k / 2].first : contacts[k / 2].second);
        for (std::uint16_t a = 0; a < groups.size(); ++a)
            for (std::uint16_t b = 0; b <= a; ++b) {
                bool touch = true;
                for (std::size_t c = 0; c < contacts.size(); ++c)
                    if ((groups[a][2 * c] && groups[b][2 * c + 1]) || (groups[b][2 * c] && groups[a][2 * c + 1]))
                        touch = contacts[c].touch;
                if (!touch) flesh_.follow_.passing.push_back({a, b});
            }
        return Success{};
    }

    /// Calls visit(seconds) for moments of a clip: 30 a second, or fewer.
    template <class Visit>
    void each_moment(std::size_t clip, const Visit& visit) const {
        const double seconds = skin().clips[clip].seconds;
        const auto moments = std::min(kMostMoments, std::size_t(seconds * 30) + 2);
        for (std::size_t m = 0; m < moments; ++m) visit(seconds * double(m) / double(moments - 1));
    }

    /// Which joints change their size in the clips, and which are no motion that flesh can follow.
    void find_scales() {
        const std::size_t count = skin().joints.size();
        is_odd_.assign(count, 0);
        if (!skin().has_bones) return; // patches stretch as their surface does
        std::vector<double> least(count, 1), most(count, 1);
        std::vector<Eigen::Affine3d> transforms(count);
        for (const std::size_t clip : clips_) {
            each_moment(clip, [&](double seconds) {
                skin().transforms(clip, seconds, transforms);
                for (std::size_t j = 0; j < count; ++j) {
                    const Mat3d linear = transforms[j].linear();
                    const Vec3d s = singular_values_only(linear);
                    least[j] = std::min(least[j], linear.determinant() > 0 && s.allFinite() ? s[2] : 0.0);
                    most[j] = std::max(most[j], s.allFinite() ? s[0] : 1e9);
                }
            });
        }
        std::vector<std::uint8_t> grows(count);
        std::vector<double> carried(count);
        for (std::size_t i = 0; i < skin().weights.joints.size(); ++i)
            carried[skin().weights.joints[i]] += double(skin().weights.weights[i]);
        for (std::size_t j = 0; j < count; ++j) {
            if (!(carried[j] > 0) || skin().joints[j].is_node_of_mesh) continue;
            is_odd_[j] = least[j] < kLeastScale || most[j] > kMostScale;
            grows[j] = !is_odd_[j] && (least[j] < 1 - kKeepsScale || most[j] > 1 + kKeepsScale);
            if (grows[j]) flesh_.report_.scaled.push_back(skin().joints[j].name);
            if (is_odd_[j]) flesh_.report_.left_out.push_back(skin().joints[j].name);
        }
        if (!flesh_.report_.scaled.empty()) flesh_.grows_ = std::move(grows);
    }

    /// Leaves out faces of meshes without a skin, and those that odd joints carry.
    Status cut_surface() {
        const Mesh& mesh = skin().mesh;
        const SkinWeights& weights = skin().weights;
        flesh_.left_out_.assign(mesh.vertex_count(), 0);
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
            float odd = 0;
            for (Index i = weights.first[v]; i < weights.first[v + 1]; ++i) {
                const Index joint = weights.joints[i];
                if (is_odd_[joint] || skin().joints[joint].is_node_of_mesh) odd += weights.weights[i];
            }
            flesh_.left_out_[v] = odd > 0.5f;
        }
        Mesh& surface = flesh_.surface_;
        surface.positions = mesh.positions;
        std::vector<std::uint8_t> is_used(mesh.vertex_count()), has_flesh(mesh.vertex_count());
        for (std::size_t f = 0; f < mesh.face_count(); ++f) {
            const auto face = mesh.face(f);
            const bool is_left_out = std::ranges::any_of(face, [&](Index v) { return flesh_.left_out_[v]; });
            if (!is_left_out) surface.add_face(face);
            for (const Index v : face) (is_left_out ? is_used : has_flesh)[v] = 1;
        }
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
            if (is_used[v] && !has_flesh[v]) flesh_.left_out_[v] = 1;
            flesh_.report_.left_out_vertices += flesh_.left_out_[v];
        }
        if (surface.face_count() == 0)
            return Error{ErrorCode::unsuitable,
                         flesh_.report_.left_out.empty()
                             ? std::string("No face hangs on a joint of a skin.")
                             : "All faces hang on joints that are mirrored, or that clips scale beyond 1/2 and 2 (" +
                                   list_of(flesh_.report_.left_out) +
                                   "). Choose other clips, or take the scale out of them."};
        return Success{};
    }

    Status make_matter() {
        BodyOptions options;
        options.scale = flesh_.options_.scale;
        options.cells.count = flesh_.options_.particles;
        options.cells.spacing = flesh_.options_.spacing.value_or(0);
        options.separate = flesh_.options_.separate;
        options.fields = flesh_.options_.fields;
        Result<Body> made =
            make_body(flesh_.surface_, flesh_.options_.material, options, context_, &flesh_.report_.body);
        if (!made) return made.error();
        flesh_.body_ = std::make_shared<const Body>(std::move(*made));
        neighbours_ = lattice_neighbours(body());
        Result<std::vector<FleshWeights>> found =
            inward_weights(body(), flesh_.surface_, skin().weights, skin().joints.size(), neighbours_, context_);
        if (!found) return found.error();
        flesh_.weights_ = std::move(*found);
        if (flesh_.options_.loose.empty()) return Success{};
        Result<std::vector<float>> loose =
            inward_values(body(), flesh_.surface_, flesh_.options_.loose, neighbours_, context_);
        if (!loose) return loose.error();
        loose_ = std::move(*loose);
        return Success{};
    }

    /// From joint to joint; a last joint reaches beyond the middle of what it carries.
    std::vector<Bone> find_bones() const {
        const SkinWeights& weights = skin().weights;
        const std::size_t count = skin().joints.size();
        std::vector<std::uint8_t> has_child(count);
        std::vector<Bone> bones;
        const double scale = flesh_.options_.scale;
        for (std::size_t j = 0; j < count; ++j) {
            const Index parent = skin().joints[j].parent;
            if (parent == kNoIndex || skin().joints[j].is_node_of_mesh) continue;
            has_child[parent] = 1;
            bones.push_back({parent, scale * skin().joints[parent].place, scale * skin().joints[j].place});
        }
        std::vector<Vec3d> middles(count, Vec3d::Zero());
        std::vector<double> totals(count);
        for (std::size_t v = 0; v + 1 < weights.first.size(); ++v)
            for (Index i = weights.first[v]; i < weights.first[v + 1]; ++i) {
                const auto weight = double(weights.weights[i]);
                middles[weights.joints[i]] += weight * skin().mesh.positions[v].cast<double>();
                totals[weights.joints[i]] += weight;
            }
        for (std::size_t j = 0; j < count; ++j) {
            if (has_child[j] || !(totals[j] > 0)) continue;
            const Vec3d from = skin().joints[j].place, middle = middles[j] / totals[j];
            bones.push_back({Index(j), scale * from, scale * (from + kLeafReach * (middle - from))});
        }
        return bones;
    }

    void find_softness() {
        const std::size_t count = body().particle_count();
        std::vector<float> depth(count);
        for (std::size_t i = 0; i < count; ++i)
            depth[i] = std::max(0.0f, -body().field->distance(body().rest[i]) - body().field_radius);
        flesh_.softness_.assign(count, 1);
        find_thin(depth);
        if (!skin().has_bones) return soften_by_depth(depth);
        const std::vector<Bone> bones = find_bones();
        parallel_for(context_, count, kTargetsGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Vec3d at = body().rest[i].cast<double>();
                double nearest = std::numeric_limits<double>::infinity();
                for (const Bone& bone : bones)
                    if (weight_of(i, bone.joint) > kCarries) nearest = std::min(nearest, bone.distance(at));
                if (std::isfinite(nearest))
                    flesh_.softness_[i] = float(nearest / std::max(nearest + double(depth[i]), 1e-12));
            }
        });
    }

    /// Without bones: 0 where it is deepest around, by the way up the lattice.
    void soften_by_depth(const std::vector<float>& depth) {
        std::vector<Index> order(depth.size());
        std::iota(order.begin(), order.end(), Index{0});
        std::ranges::stable_sort(order, std::greater<>(), [&](Index i) { return depth[i]; });
        std::vector<float> top = depth;
        for (const Index i : order) { // deeper ones have theirs
            Index up = i;
            for (const Index n : neighbours_[i])
                if (n != kNoIndex && depth[n] > depth[up]) up = n;
            top[i] = std::max(top[i], top[up]);
            if (top[i] > 0) flesh_.softness_[i] = 1 - depth[i] / top[i];
        }
    }

    void find_thin(const std::vector<float>& depth) {
        const std::size_t count = depth.size();
        const auto h = float(body().spacing());
        std::vector<float> deepest = depth; // within a few cells
        for (int step = 0; step < kThinReach; ++step) {
            const std::vector<float> before = deepest;
            for (std::size_t i = 0; i < count; ++i)
                for (const Index n : neighbours_[i])
                    if (n != kNoIndex) deepest[i] = std::max(deepest[i], before[n]);
        }
        is_thin_.assign(count, 0);
        for (std::size_t i = 0; i < count; ++i) is_thin_[i] = deepest[i] < kThinDepth * h;
    }

    /// How far the joints alone crush each cell in the clips: a bone that holds a crushed cell turns it inside out.
    void find_folds() {
        least_volume_.assign(body().particle_count(), 1);
        std::vector<Eigen::Affine3d> transforms(skin().joints.size());
        const auto& cells = body().cells.cell_corners;
        std::vector<float> of_cell(cells.size(), 1);
        const auto inverse = float(1 / body().spacing());
        Vectors at;
        for (const std::size_t clip : clips_)
            each_moment(clip, [&](double seconds) {
                skin().transforms(clip, seconds, transforms);
                flesh_.targets(transforms, Vec3d::Zero(), at, nullptr, context_);
                const std::vector<Mat3f> stretches = flesh_.stretches(transforms, context_);
                parallel_for(context_, cells.size(), kTargetsGrain, [&](std::size_t begin, std::size_t end) {
                    for (std::size_t c = begin; c < end; ++c) {
                        Mat3f gradient = Mat3f::Zero();
                        float grown = stretches.empty() ? 1 : 0; // volume of the rest shape
                        for (int corner = 0; corner < 8; ++corner)
                            for (int axis = 0; axis < 3; ++axis)
                                gradient.col(axis) += (corner >> axis & 1 ? 0.25f : -0.25f) * at[cells[c][corner]];
                        for (std::size_t corner = 0; corner < 8 && !stretches.empty(); ++corner)
                            grown += 0.125f * stretches[cells[c][corner]].determinant();
                        of_cell[c] = std::min(of_cell[c], (inverse * gradient).determinant() / grown);
                    }
                });
            });
        for (std::size_t c = 0; c < cells.size(); ++c)
            for (const Index corner : cells[c]) least_volume_[corner] = std::min(least_volume_[corner], of_cell[c]);
    }

    float weight_of(std::size_t particle, Index joint) const {
        const FleshWeights& of = flesh_.weights_[particle];
        float sum = 0;
        for (std::size_t k = 0; k < FleshWeights::kMost; ++k)
            if (of.joints[k] == joint) sum += of.weights[k];
        return sum;
    }

    Status set_springs() {
        const FleshOptions& o = flesh_.options_;
        Follow& follow = flesh_.follow_;
        const std::size_t count = body().particle_count();
        const auto leash = float(o.leash.value_or(2 * body().spacing()));
        follow.damping.clear();
        follow.most_acceleration = o.most_acceleration;
        for (std::size_t i = 0; i < count; ++i) {
            const FleshWeights& of = flesh_.weights_[i];
            float strength = 0;
            double core = o.core, edge = o.frequency, surface = o.surface_frequency, damping = o.damping;
            for (std::size_t k = 0; k < FleshWeights::kMost; ++k) {
                const Index joint = of.joints[k];
                if (soft_of_[joint] == o.soft.size()) {
                    strength += of.weights[k];
                    continue;
                }
                const SoftJoints& soft = o.soft[soft_of_[joint]];
                const auto weight = double(of.weights[k]);
                strength += of.weights[k] * float(soft.strength);
                core += weight * (soft.core.value_or(o.core) - o.core);
                edge += weight * (soft.frequency.value_or(o.frequency) - o.frequency);
                surface += weight * (soft.surface_frequency.value_or(o.surface_frequency) - o.surface_frequency);
                damping += weight * (soft.damping.value_or(o.damping) - o.damping);
            }
            if (!loose_.empty()) strength *= 1 - loose_[i] * (1 - float(o.loose_strength));
            const double u = double(flesh_.softness_[i]);
            const float whole = std::clamp((least_volume_[i] - kFolded) / (kWhole - kFolded), 0.0f, 1.0f);
            const bool is_held = (u < core && strength > kHeldStrength && whole >= 1) || core >= 1;
            const double out = std::clamp((1 - u) / std::max(1 - core, 1e-9), 0.0, 1.0);
            double frequency = surface + (edge - surface) * out * std::sqrt(out);
            if (is_thin_[i]) frequency = std::max(frequency, edge);
            frequency = std::max(0.0, surface + (frequency - surface) * double(whole));
            follow.frequency.push_back(is_held ? std::numeric_limits<float>::infinity()
                                               : float(frequency) * std::sqrt(strength));
            follow.leash.push_back(strength < kFreeStrength ? std::numeric_limits<float>::infinity()
                                                            : leash / (strength * strength));
            follow.damping.push_back(float(std::max(0.0, damping)));
            if (!follow.passing.empty()) follow.groups.push_back(group_of_[of.joints[0]]); // the largest is first
            flesh_.report_.held += is_held;
            flesh_.report_.thin += is_thin_[i];
        }
        if (flesh_.report_.held == count)
            return Error{ErrorCode::unsuitable, "Everything is held by the core; choose a smaller one."};
        return Success{};
    }

    /// Joints between two of them along the skeleton.
    std::size_t steps_between(Index a, Index b) const {
        const auto way_up = [&](Index joint) {
            std::vector<Index> way;
            for (Index at = joint; at != kNoIndex && way.size() <= skin().joints.size(); at = skin().joints[at].parent)
                way.push_back(at);
            return way;
        };
        const std::vector<Index> from_a = way_up(a), from_b = way_up(b);
        for (std::size_t up = 0; up < from_a.size(); ++up) {
            const auto met = std::ranges::find(from_b, from_a[up]);
            if (met != from_b.end()) return up + std::size_t(met - from_b.begin());
        }
        return from_a.size() + from_b.size();
    }

    /// Limbs that one cell holds together, though the skeleton joins them far away: the pair that does so most often.
    std::string glued_limbs() const {
        std::map<std::pair<Index, Index>, std::size_t> counts;
        const auto main_joint = [&](Index particle) {
            const FleshWeights& of = flesh_.weights_[particle];
            return of.weights[0] > kMainShare ? of.joints[0] : kNoIndex; // the largest is first
        };
        for (Index i = 0; i < neighbours_.size(); ++i)
            for (const int side : {1, 3, 5}) {
                const Index other = neighbours_[i][side];
                if (other == kNoIndex) continue;
                const Index a = main_joint(i), b = main_joint(other);
                if (a != b && a != kNoIndex && b != kNoIndex) ++counts[std::minmax(a, b)];
            }
        std::pair<Index, Index> most;
        std::size_t count = 0;
        for (const auto& [pair, times] : counts)
            if (times > count && steps_between(pair.first, pair.second) >= kFarInSkeleton) {
                most = pair;
                count = times;
            }
        if (count < kFewestGlued) return "";
        return "'" + skin().joints[most.first].name + "' and '" + skin().joints[most.second].name +
               "' are closer to each other than the particles and move as one piece there; take more particles, or "
               "part them in the bind pose.";
    }

    void collect_warnings() {
        FleshReport& report = flesh_.report_;
        std::vector<std::string>& warnings = report.warnings;
        if (!report.body.warning.empty()) warnings.push_back(report.body.warning);
        if (std::string glued = glued_limbs(); !glued.empty()) warnings.push_back(std::move(glued));
        if (!report.left_out.empty())
            warnings.push_back("Joints that are mirrored or scaled beyond 1/2 and 2 carry their vertices as before, "
                               "without flesh: " +
                               list_of(report.left_out) + ".");
        if (!report.scaled.empty() && body().material.is_plastic())
            warnings.push_back("Flesh that yields does not grow with its joints; it is drawn after them: " +
                               list_of(report.scaled) + ".");
        const auto thin = double(report.thin) / double(body().particle_count());
        if (thin > 0.5)
            warnings.push_back(std::to_string(int(100 * thin + 0.5)) +
                               " % of the particles are in parts fewer than two cells thick, which follow as a whole; "
                               "take more particles.");
    }

    const RunContext& context_;
    std::vector<std::size_t> clips_;
    Flesh flesh_;
    std::vector<std::size_t> soft_of_;    ///< of joints: number in FleshOptions::soft, or behind its end
    std::vector<std::uint16_t> group_of_; ///< of joints, for contact; empty: everything touches
    std::vector<float> loose_;            ///< of particles; empty: none is
    std::vector<std::uint8_t> is_odd_;    ///< of joints
    std::vector<std::array<Index, 6>> neighbours_;
    std::vector<std::uint8_t> is_thin_; ///< of particles
    std::vector<float> least_volume_;   ///< of particles: of their cells, where the joints have them, over that at rest
};

Result<Flesh> Flesh::create(SkinnedMesh skin, const FleshOptions& options, std::span<const std::size_t> clips,
                            const RunContext& context) {
    return FleshMaker(std::move(skin), options, clips, context).make();
}

void Flesh::targets(std::span<const Eigen::Affine3d> transforms, const Vec3d& offset, Vectors& positions,
                    Vectors* accelerations, const RunContext& context) const {
    struct Joint {
        Eigen::Vector4d real, dual; ///< x, y, z, w
        Eigen::Affine3d whole;      ///< m
        Vec3d place;                ///< m, in the bind pose
        Mat3d growth;               ///< what the rest shape gains there, about the joint
    };
    std::vector<Joint> joints(transforms.size());
    for (std::size_t j = 0; j < joints.size(); ++j) {
        const Mat3d turn = nearest_rotation(transforms[j].linear());
        const Eigen::Quaterniond q(turn);
        const Vec3d place = skin_->joints[j].place; // where a joint that changes its size stays
        const Vec3d shift = scale() * (transforms[j] * place - turn * place) - offset;
        const Eigen::Quaterniond half(0, 0.5 * shift.x(), 0.5 * shift.y(), 0.5 * shift.z());
        joints[j].real = q.coeffs();
        joints[j].dual = (half * q).coeffs();
        joints[j].whole = transforms[j];
        joints[j].whole.translation() = scale() * transforms[j].translation() - offset;
        joints[j].place = scale() * place;
        if (!grows_.empty() && grows_[j]) joints[j].growth = stretch_of(transforms[j]) - Mat3d::Identity();
    }
    const std::size_t count = body_->particle_count();
    if (positions.size() != count) positions = Vectors(count);
    if (accelerations && accelerations->size() != count) *accelerations = Vectors(count);
    const Vec3d undone = -options_.gravity;
    parallel_for(context, count, kTargetsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const FleshWeights& of = weights_[i];
            const Vec3d rest = body_->rest[i].cast<double>();
            Vec3d grown = rest;
            Eigen::Vector4d real = Eigen::Vector4d::Zero(), dual = Eigen::Vector4d::Zero();
            const Eigen::Vector4d& first = joints[of.joints[0]].real;
            for (std::size_t k = 0; k < FleshWeights::kMost && of.weights[k] > 0; ++k) {
                const Joint& joint = joints[of.joints[k]];
                const double weight = joint.real.dot(first) < 0 ? -double(of.weights[k]) : double(of.weights[k]);
                real += weight * joint.real;
                dual += weight * joint.dual;
                if (!grows_.empty() && grows_[of.joints[k]])
                    grown += double(of.weights[k]) * (joint.growth * (rest - joint.place));
            }
            const double inverse = 1 / std::max(real.norm(), 1e-12);
            real *= inverse;
            dual *= inverse;
            const Vec3d r = real.head<3>(), d = dual.head<3>();
            const auto turned = [&](const Vec3d& v) -> Vec3d { return v + 2 * r.cross(r.cross(v) + real[3] * v); };
            Vec3d place = turned(grown) + 2 * (real[3] * d - dual[3] * r + r.cross(d));
            if (!skin_->has_bones) {
                place.setZero();
                for (std::size_t k = 0; k < FleshWeights::kMost && of.weights[k] > 0; ++k)
                    place += double(of.weights[k]) * (joints[of.joints[k]].whole * rest);
            }
            positions.set(i, place.cast<float>());
            if (accelerations) accelerations->set(i, turned(undone).cast<float>());
        }
    });
}

std::vector<Mat3f> Flesh::stretches(std::span<const Eigen::Affine3d> transforms, const RunContext& context) const {
    if (grows_.empty()) return {};
    std::vector<Mat3f> of_joints(transforms.size(), Mat3f::Identity());
    for (std::size_t j = 0; j < of_joints.size(); ++j)
        if (grows_[j]) of_joints[j] = stretch_of(transforms[j]).cast<float>();
    std::vector<Mat3f> stretches(body_->particle_count());
    parallel_for(context, stretches.size(), kTargetsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Mat3f sum = Mat3f::Zero();
            for (std::size_t k = 0; k < FleshWeights::kMost; ++k)
                sum += weights_[i].weights[k] * of_joints[weights_[i].joints[k]];
            stretches[i] = sum;
        }
    });
    return stretches;
}

Vectors Flesh::settled(const Vectors& targets) const {
    const auto& cells = body_->cells.cell_corners;
    const auto h = float(body_->spacing());
    const auto gradient = [&](const Vectors& at, std::size_t cell) {
        Mat3f sum = Mat3f::Zero();
        for (int corner = 0; corner < 8; ++corner)
            for (int axis = 0; axis < 3; ++axis)
                sum.col(axis) += (corner >> axis & 1 ? 0.25f : -0.25f) * at[cells[cell][corner]];
        return Mat3f(sum / h);
    };
    std::vector<std::uint8_t> moves(targets.size());
    const auto spread = [&](const auto& is_asked) {
        std::vector<std::uint8_t> more = moves;
        for (std::size_t c = 0; c < cells.size(); ++c)
            if (is_asked(c))
                for (const Index corner : cells[c]) more[corner] = 1;
        moves = std::move(more);
    };
    const auto is_near = [&](std::size_t c) {
        return std::ranges::any_of(cells[c], [&](Index corner) { return moves[corner]; });
    };
    spread([&](std::size_t c) { return gradient(targets, c).determinant() < kInverted; });
    Vectors at = targets;
    if (std::ranges::count(moves, 1) == 0) return at;
    for (int ring = 0; ring < kSettledRings; ++ring) spread(is_near);
    std::vector<std::size_t> active;
    for (std::size_t c = 0; c < cells.size(); ++c)
        if (is_near(c)) active.push_back(c);
    std::vector<Vec3f> sums(targets.size());
    std::vector<float> counts(targets.size());
    for (int step = 0; step < kSettlingSteps; ++step) { // each cell draws its corners to where it is rigid
        std::ranges::fill(sums, Vec3f::Zero());
        std::ranges::fill(counts, 0.0f);
        for (const std::size_t c : active) {
            const Mat3f turn = nearest_rotation(gradient(at, c).cast<double>()).cast<float>();
            Vec3f middle = Vec3f::Zero();
            for (const Index corner : cells[c]) middle += 0.125f * at[corner];
            for (int corner = 0; corner < 8; ++corner) {
                const Vec3f from_middle(corner & 1 ? 0.5f : -0.5f, corner & 2 ? 0.5f : -0.5f,
                                        corner & 4 ? 0.5f : -0.5f);
                sums[cells[c][corner]] += middle + turn * (h * from_middle);
                ++counts[cells[c][corner]];
            }
        }
        for (std::size_t i = 0; i < sums.size(); ++i)
            if (moves[i] && counts[i] > 0 && !std::isinf(follow_.frequency[i])) at.set(i, sums[i] / counts[i]);
    }
    return at;
}

} // namespace filigree
