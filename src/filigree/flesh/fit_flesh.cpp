// The flesh of several clips as one model.
#include "filigree/flesh.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <numeric>

namespace filigree {

namespace {

constexpr std::size_t kFewestPlaces = 12; ///< FitOptions::base

/// A driver has no more vertices than there are places.
std::size_t places_of_faces(const Mesh& mesh) {
    const std::vector<Index> first = weld_map(mesh.positions);
    std::vector<std::uint8_t> is_used(mesh.vertex_count());
    for (const Index v : mesh.corners) is_used[first[v]] = 1;
    return std::size_t(std::ranges::count(is_used, 1));
}

std::vector<std::string> different_names(std::span<const FleshClip> clips) {
    std::vector<std::string> names;
    for (const FleshClip& clip : clips) {
        std::string name = clip.name;
        for (int number = 2; std::ranges::find(names, name) != names.end(); ++number)
            name = clip.name + " " + std::to_string(number);
        names.push_back(std::move(name));
    }
    return names;
}

bool ends_as_it_begins(const FleshClip& clip) {
    const Vectors &first = clip.frames.front(), &last = clip.frames.back();
    for (std::size_t i = 0; i < first.size(); ++i)
        if (first[i] != last[i]) return false;
    return true;
}

} // namespace

Result<FittedFlesh> fit_flesh(const Flesh& flesh, std::span<const FleshClip> clips, std::size_t joints,
                              const RunContext& context) {
    if (clips.empty()) return Error{ErrorCode::usage, "There are no clips to fit joints to."};
    if (joints < kFewestPlaces)
        return Error{ErrorCode::usage, "Flesh is fitted with " + std::to_string(kFewestPlaces) + " joints or more."};
    const Mesh& mesh = flesh.skin().mesh;
    const std::size_t places = places_of_faces(mesh);
    if (places < kFewestPlaces)
        return Error{ErrorCode::unsuitable, "The mesh has " + std::to_string(places) +
                                                " vertices at different places, and " + std::to_string(kFewestPlaces) +
                                                " are the fewest that flesh is fitted to; subdivide the mesh."};
    std::vector<Index> all(mesh.vertex_count());
    std::iota(all.begin(), all.end(), Index{0});
    RunContext silent = context; // the progress is that of the fit
    silent.progress = nullptr;
    Result<FleshCarrier> carrier = FleshCarrier::create(flesh, all, silent);
    if (!carrier) return carrier.error();
    std::vector<std::size_t> first = {0}; // frames of all clips, one behind the other
    for (const FleshClip& clip : clips) first.push_back(first.back() + clip.frames.size());
    const MeshAnimation animation = {&mesh, first.back(), clips.front().frames_per_second,
                                     [&](std::size_t frame, std::span<Vec3f> positions) -> Status {
                                         const auto after = std::ranges::upper_bound(first, frame);
                                         const auto clip = std::size_t(after - first.begin()) - 1;
                                         carrier->at(clips[clip], frame - first[clip], positions, {}, silent);
                                         return Success{};
                                     }};
    Result<Fitted> made =
        fit_animation(animation, {.base = std::min(joints, places), .sound_gradients = true}, context);
    if (!made) return made.error();
    FittedFlesh fitted{std::move(made->model), different_names(clips), {}, made->report, flesh.skin().morphs, {}};
    for (std::size_t c = 0; c < clips.size(); ++c) {
        if (!fitted.morphs.empty()) fitted.morph_weights.push_back(flesh.skin().morph_weights[clips[c].clip]);
        PoseSequence& poses = fitted.poses.emplace_back();
        poses.frames_per_second = clips[c].frames_per_second;
        const auto at = [&](std::size_t frame) { return made->poses.frames.begin() + std::ptrdiff_t(frame); };
        poses.frames.assign(at(first[c]), at(first[c + 1]));
        if (clips[c].is_loop && ends_as_it_begins(clips[c])) poses.frames.back() = poses.frames.front();
    }
    return fitted;
}

std::vector<NamedPoses> FittedFlesh::animations() const {
    std::vector<NamedPoses> animations;
    for (std::size_t c = 0; c < poses.size(); ++c)
        animations.push_back(
            {names[c], frames_of(poses[c]), morph_weights.empty() ? MorphWeights() : morph_weights[c]});
    return animations;
}

} // namespace filigree
