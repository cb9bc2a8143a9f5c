// A surface that moves without joints, as a skin whose joints are patches of it.
#include "filigree/core/parallel_for.h"
#include "filigree/flesh.h"
#include "filigree/mesh/weld.h"
#include "filigree/restore.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kFewestPatches = 12, kSmallMesh = 64;
constexpr std::size_t kMostSamples = 100'000;

Error wrong_use(std::string sentence) { return {ErrorCode::usage, std::move(sentence)}; }

/// Places that faces use: a driver has no more vertices.
std::size_t places_of(const Mesh& mesh) {
    const std::vector<Index> first = weld_map(mesh.positions);
    std::vector<std::uint8_t> is_used(mesh.vertex_count());
    for (const Index v : mesh.corners) is_used[first[v]] = 1;
    return std::size_t(std::ranges::count(is_used, 1));
}

/// The patches' transforms at even moments of a clip.
struct Samples {
    double rate = 60; ///< a second
    std::vector<std::vector<Eigen::Affine3d>> transforms;

    /// Cubic in between [Catmull and Rom 1974], with the ends as they are.
    void at(double seconds, std::span<Eigen::Affine3d> out) const {
        const auto last = double(transforms.size() - 1);
        const double place = std::clamp(seconds * rate, 0.0, last);
        const auto k = std::min(std::size_t(place), transforms.size() - 1);
        const auto sample = [&](std::size_t number) -> const std::vector<Eigen::Affine3d>& {
            return transforms[std::min(number, transforms.size() - 1)];
        };
        const auto &a = sample(k == 0 ? 0 : k - 1), &b = sample(k), &c = sample(k + 1), &d = sample(k + 2);
        const double t = place - double(k), s = 1 - t;
        const double wa = -0.5 * t * s * s, wb = 1 + t * t * (1.5 * t - 2.5), wd = -0.5 * t * t * s,
                     wc = 1 - wa - wb - wd;
        for (std::size_t j = 0; j < out.size(); ++j)
            out[j].affine() = wa * a[j].affine() + wb * b[j].affine() + wc * c[j].affine() + wd * d[j].affine();
    }
};

} // namespace

Result<SkinnedMesh> skin_of_surface(MovingSurface surface, std::size_t patches, const RunContext& context) {
    if (const std::string wrong = check_mesh(surface.rest); !wrong.empty()) return wrong_use(wrong);
    if (surface.clips.empty()) return wrong_use("The surface has no clip.");
    if (patches < kFewestPatches) return wrong_use("A surface needs 12 patches or more.");
    if (!(surface.samples_per_second > 0 && std::isfinite(surface.samples_per_second)))
        return wrong_use("The number of samples a second must be above 0.");
    if (surface.rest.face_count() == 0) return Error{ErrorCode::unsuitable, "The mesh has no faces."};
    const std::size_t count = surface.rest.vertex_count(), places = places_of(surface.rest);
    if (places < kFewestPatches)
        return Error{ErrorCode::unsuitable, "The mesh has " + std::to_string(places) +
                                                " vertices at different places, and 12 are the fewest; subdivide it."};
    SkinnedMesh skin;
    skin.has_bones = false;
    skin.mesh = surface.rest;
    skin.clips = surface.clips;

    StripOptions options;
    options.base = std::min({patches, places, std::max(places / 4, kSmallMesh)});
    Result<Stripped> stripped = strip(surface.rest, options, context);
    if (!stripped) return stripped.error();
    const Model& model = stripped->model;
    const auto source = [&](Index v) { return model.source_order.empty() ? v : model.source_order[v]; };
    const Result<Skin> made = make_skin(model, model.finest_level(), 3, true);
    if (!made) return made.error();
    const std::vector<Index>& vertices = model.driver().vertices;
    for (std::size_t j = 0; j < vertices.size(); ++j)
        skin.joints.push_back({.name = "patch " + std::to_string(j + 1),
                               .place = surface.rest.positions[source(vertices[j])].cast<double>()});
    std::vector<Index> place_of(count);
    for (Index v = 0; v < count; ++v) place_of[source(v)] = v;
    for (std::size_t v = 0; v < count; ++v) {
        for (std::size_t k = 0; k < made->slots; ++k) {
            const std::size_t slot = place_of[v] * made->slots + k;
            if (!(made->vertex_weights[slot] > 0)) continue;
            skin.weights.joints.push_back(made->joints[made->vertex_joints[slot]][0]);
            skin.weights.weights.push_back(made->vertex_weights[slot]);
        }
        skin.weights.first.push_back(Index(skin.weights.joints.size()));
    }

    const Result<Restorer> restorer = Restorer::create(model, {}, context);
    if (!restorer) return restorer.error();
    std::vector<Vec3f> positions(count);
    Pose pose;
    pose.positions.resize(vertices.size());
    auto samples = std::make_shared<std::vector<Samples>>();
    for (std::size_t c = 0; c < skin.clips.size(); ++c) {
        const double seconds = std::max(skin.clips[c].seconds, 0.0);
        if (!(seconds * surface.samples_per_second < double(kMostSamples)))
            return wrong_use("Clip '" + skin.clips[c].name + "' would have more than 100,000 samples.");
        const auto steps =
            std::max<std::size_t>(1, std::size_t(std::ceil(seconds * surface.samples_per_second - 1e-6)));
        Samples& of_clip = samples->emplace_back();
        of_clip.rate = seconds > 0 ? double(steps) / seconds : surface.samples_per_second;
        for (std::size_t k = 0; k <= steps; ++k) {
            if (context.is_cancelled()) return cancelled_error();
            context.report("reading '" + skin.clips[c].name + "'", double(k) / double(steps));
            if (Status read = surface.positions(c, double(k) / of_clip.rate, positions); !read) return read.error();
            for (std::size_t j = 0; j < vertices.size(); ++j) pose.positions[j] = positions[source(vertices[j])];
            if (!std::ranges::all_of(pose.positions, [](const Vec3f& p) { return p.allFinite(); }))
                return Error{ErrorCode::unsuitable,
                             "Clip '" + skin.clips[c].name + "' has positions that are not finite."};
            const Result<std::vector<Mat3f>> gradients = restorer->gradients(pose, context);
            if (!gradients) return gradients.error();
            std::vector<Eigen::Affine3d>& transforms = of_clip.transforms.emplace_back(vertices.size());
            for (std::size_t j = 0; j < vertices.size(); ++j) {
                transforms[j].linear() = (*gradients)[j].cast<double>();
                transforms[j].translation() =
                    pose.positions[j].cast<double>() - transforms[j].linear() * skin.joints[j].place;
                transforms[j].makeAffine();
            }
        }
    }
    skin.transforms = [samples](std::size_t clip, double seconds, std::span<Eigen::Affine3d> out) {
        (*samples)[clip].at(seconds, out);
        for (Eigen::Affine3d& joint : out) joint.makeAffine();
    };
    skin.surface = std::move(surface.positions);
    return skin;
}

} // namespace filigree
